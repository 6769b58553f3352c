"""One wheelset held in a pose against CONTACT, against Nadal, and on springs against a formula."""

import csv
from pathlib import Path

import numpy as np
import pytest
from dynamics import load_track
from held_wheelset import GRAVITY, RADIUS, HeldWheelset
from scipy.optimize import brentq, root
from selection import points

from railsim.kernels.contact_columns import C11, C22, C23, C_Y, A, B
from railsim.linear.circle import circle

MASS, INERTIA = 1813.0, 1120.0
HEAD = 0.3  # m, radius of the 60E1 rail's head
A22 = Path(__file__).parent.parent / "data" / "contact_a22_left.csv"


def contact_a22():
    """Rows of the table as numbers."""
    with A22.open() as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            yield {key: float(row[key]) for key in row if key != "side"}


@pytest.mark.usefixtures("small_contact_tables")
def test_creep_forces_of_contacts_wheelset_a22():
    """Manchester contact benchmark A2.2, solved by the full theory: 10 kN, 2 m/s, friction 0.3.

    On the tread from 6.5 mm the creep forces differ by at most 1 % of mu N (rms); up to 4.5 mm,
    where creepages are small and the patch lies on the rail's joint of two arcs, by 4 % (rms) and
    10 %.
    """
    wheelset = HeldWheelset(10e3, 2.0, "S1002", law="table", rail="benchmark", friction=0.3)
    lateral, errors, heights = [], [], []
    for row in contact_a22():
        y, roll, yaw, spin = (
            1e-3 * row["y_mm"],
            *(row[key] for key in ("roll_rad", "yaw_rad", "pitch_rate_rad_per_s")),
        )

        def unbalanced(z, pose=(y, roll, yaw, spin)):
            y, roll, yaw, spin = pose
            return wheelset.forces(y, z, roll, yaw, spin).Q[0] - 10e3

        z = 1e-3 * row["z_ws_mm"]
        z = brentq(unbalanced, z - 0.2e-3, z + 0.2e-3, xtol=1e-11)
        found = wheelset.forces(y, z, roll, yaw, spin)
        lateral.append(row["y_mm"])
        heights.append(1e3 * z - row["z_ws_mm"])
        errors.append((found.X[0] - row["FX_track_total"], found.Y[0] - row["FY_track_total"]))
    errors = np.hypot(*np.array(errors).T) / (0.3 * 10e3)
    lateral = np.array(lateral)
    far, near = errors[lateral >= 6.5], errors[lateral <= 4.5]
    assert len(far) == 7
    assert len(near) == 7
    assert np.sqrt(np.mean(far**2)) < 0.01
    assert np.sqrt(np.mean(near**2)) < 0.04
    assert np.max(near) < 0.10
    # the heights of a wheelset that lies by up to 10 mm aside
    assert np.max(np.abs(heights)) < 0.04


@points(("friction", "limit"), [(0.3, 1.342), (0.4, 1.118), (0.5, 0.947)], always=(0,))
def test_flange_climbs_at_nadals_limit(friction, limit):
    """Nadal (1896): (tan 70 - mu)/(1 + mu tan 70), sliding sideways on the flange, 1.5 %.

    Angle of attack 19 mrad; the axle turns so that the flanging wheel has no longitudinal force, as
    Nadal assumes; the wheelset is moved aside until Y/Q falls again, both wheels carrying their
    load.  On the straight flank, the wheel lifted by 1.5 to 2.5 mm, Nadal's formula is met.  Where
    the patch still reaches into the root, the stiffness changes along the profile and Y/Q is up to
    3.5 % higher.  Where the solid axle turns freely, longitudinal slip
    takes its part of the friction.
    """
    load = 50e3
    wheelset = HeldWheelset(load, 2.0, "S1002", friction=friction)

    def climbed(free):
        ratios, lifts, angles = [], [], []
        scaled = before = np.array([1e3 * wheelset.height(spin(0.0)), 0.0, 0.0])
        for y in 1e-3 * np.concatenate(
            (np.arange(0.0, 6.2, 0.1), np.arange(6.2, 6.6, 0.01), np.arange(6.6, 8.6, 0.1))
        ):

            def unbalanced(x, y=y):
                found = wheelset.forces(y, 1e-3 * x[0], 1e-3 * x[1], 0.019, spin(x[2]))
                X = found.X.sum() if free else found.X[1]
                return np.array([*(found.Q / load - 1.0), X / load])

            solution = root(unbalanced, 2.0 * scaled - before, options={"eps": 1e-9})
            assert np.max(np.abs(solution.fun)) < 1e-6
            scaled, before = solution.x, scaled
            found = wheelset.forces(y, 1e-3 * scaled[0], 1e-3 * scaled[1], 0.019, spin(scaled[2]))
            ratios.append(found.Y[1] / found.Q[1])
            angles.append(np.degrees(found.angle[1]))
            lifts.append(0.75 * scaled[1] + scaled[0])
        return np.array(ratios), -np.array(lifts), np.array(angles)

    def spin(x):
        return -2.0 / RADIUS * (1.0 + 1e-3 * x)

    ratios, lifts, angles = climbed(free=False)
    flank = (lifts > 1.5) & (lifts < 2.5)
    assert np.count_nonzero(flank) > 1
    assert angles[flank] == pytest.approx(70.0, abs=0.5)
    assert ratios[flank] == pytest.approx(limit, rel=0.015)
    assert limit < np.max(ratios) < 1.035 * limit
    assert ratios[-1] < 0.95 * limit  # it has climbed
    assert 1.0 < np.max(climbed(free=True)[0]) / np.max(ratios) < 1.06


@pytest.mark.parametrize(("lateral", "yaw"), [(2e5, 4e5), (5e6, 2e7), (5e6, 1e5), (1e5, 4e7)])
@pytest.mark.usefixtures("small_contact_tables")
def test_wheelset_on_springs_in_a_curve(lateral, yaw):
    """Restrained wheelset on cones, small creepages: closed form of its displacement and yaw.

    Longitudinal creepage +-(b0/R + lambda y/r0), lateral -psi, hence with springs k_y, k_psi
    to the track and the stiffness of gravity W delta/(b0 - r0 delta), -W b0 delta of the cones:
    2 f22 psi = (k_y (1 - f23 delta/(b0 N)) + k_g) y (the spring moves load to one wheel, whose
    spin creep force delta f23/r0 grows with it) and
    -2 b0 f11 (b0/R + lambda y/r0) = (k_psi - W b0 delta + 2 f23) psi;
    lambda = delta (b0 + R_r delta)/(b0 - r0 delta) on rail heads of R_r (Wickens 2003, chapter 2).
    """
    radius, speed, cone = 30e3, 20.0, 0.05
    load = MASS * GRAVITY / 2.0
    track = circle(
        load_track("straight"),
        curvature=1.0 / radius,
        cant=1.5 * np.sin(np.arctan(speed**2 / radius / GRAVITY)),
        friction=10.0,
    )
    wheelset = HeldWheelset(load, speed, track=track, law="linear")

    def unbalanced(x):
        y, z, roll, psi = 1e-3 * x[:4]
        rates = wheelset.rates(y, z, roll, psi, -speed / RADIUS * (1.0 + 1e-3 * x[4]))
        springs = np.array([lateral * y / MASS, 0.0, 0.0, 0.0, yaw * psi / INERTIA])
        return rates - springs

    start = np.array([0.0, 1e3 * wheelset.height(-speed / RADIUS), 0.0, 0.0, 0.0])
    solution = root(unbalanced, start, options={"eps": 1e-9})
    assert np.max(np.abs(solution.fun)) < 1e-6
    y, _, _, psi, _ = 1e-3 * solution.x
    patch = wheelset.work.patch
    a_b = patch[A, 0] * patch[B, 0]
    f11, f22, f23 = 82e9 * a_b * patch[[C11, C22, C23], 0] * [1.0, 1.0, np.sqrt(a_b)]
    b0 = abs(patch[C_Y, 0])
    gravity = 2.0 * load * cone / (b0 - RADIUS * cone)
    moved = f23 * cone / (b0 * load)
    turned = (lateral * (1.0 - moved) + gravity) / (2.0 * f22)
    conicity = cone * (b0 + HEAD * cone) / (b0 - RADIUS * cone)
    steering = 2.0 * b0 * f11 * conicity / RADIUS
    steering += (yaw - 2.0 * load * b0 * cone + 2.0 * f23) * turned
    expected = -2.0 * f11 * b0**2 / radius / steering
    # of first order in the angles
    assert y == pytest.approx(expected, rel=0.02)
    assert psi == pytest.approx(turned * expected, rel=0.02)
