"""Track case 4 of the Manchester benchmark: both rails step aside by 5 mm within 0.1 m.

S. Iwnicki (1999), The Manchester Benchmarks for Rail Vehicle Simulation, Vehicle System Dynamics
Supplement 31.  A rail's tangent turns by 50 mrad, and by up to 75 mrad where a spline through the
samples swings; the wheelsets themselves yaw by some milliradians.
"""

import dataclasses

import numpy as np
import pytest
from dynamics import load_any_track, load_vehicle
from selection import points

from railsim import simulate
from railsim.contact import build_contact_table
from railsim.contact.table import TableGrid
from railsim.definitions.settings import Settings
from railsim.kernels.contact_table import (
    B1,
    D_B1,
    G_ROLL,
    G_Y,
    K2,
    K2_ROLL,
    K2_Y,
    K_ROLL,
    K_Y,
    LOOK_UP_SIZE,
    MAX_W,
    N_PATCH,
    N_WEIGHT,
    K,
    look_up,
    set_cell_weights,
)
from railsim.model import assembly

VEHICLES = ("coach_manchester", "coach_flexicoil", "benchmark_vehicle1")
SPEEDS = (10.0, 20.0, 40.0, 60.0, 80.0)
CASES = [
    (vehicle, spacing, support, speed)
    for vehicle in VEHICLES
    for spacing in (0.05, 0.5)
    for support in ("rigid", "co-running")
    for speed in SPEEDS
]
ALWAYS = [
    CASES.index(case)
    for case in (
        ("coach_manchester", 0.05, "co-running", 40.0),
        ("coach_flexicoil", 0.5, "rigid", 80.0),
        ("benchmark_vehicle1", 0.5, "co-running", 10.0),
    )
]


def ramp(spacing, support="co-running", begin=40.0, step=5e-3, length=0.1):
    """Straight track with the ramp, sampled at `spacing` [m] and at the ramp's ends."""
    s = np.unique(np.round([*np.arange(0.0, 90.0, spacing), begin, begin + length], 6))
    y = np.interp(s, [begin, begin + length], [0.0, step])
    rows = [(float(a), float(b), 0.0, float(b), 0.0) for a, b in zip(s, y, strict=True)]
    return load_any_track("straight").replace(
        irregularities=[{"type": "measured", "rows": rows}], support={"preset": support}
    )


@points(("vehicle", "spacing", "support", "speed"), CASES, always=ALWAYS)
def test_vehicle_runs_over_the_ramp(vehicle, spacing, support, speed):
    """To the end; it was stopped, for a yaw of its rails beyond the range of the contact table."""
    result = simulate(
        load_vehicle(vehicle), ramp(spacing, support), speed=speed, until=60.0 + 0.2 * speed
    )
    assert result.status == "complete"
    # in the middle it follows the new alignment within the clearance of the flanges, and what the
    # rails yield
    assert np.abs(result.wheelset_yaw).max() < 0.02
    assert np.abs(result.wheelset_lateral).max() < 0.016
    assert any("mrad, where the contact table ends" in remark for remark in result.remarks)


def test_smooth_and_sharp_ramps_below_60_mrad_have_no_remark():
    """A cosine of 5 mm over 0.14 m turns the rail by 56 mrad: within the table."""
    kink = {"type": "kink", "s": 30.0, "length": 0.28, "offset": 5e-3}
    result = simulate(
        load_vehicle("coach_manchester"),
        load_any_track("straight").replace(irregularities=[kink]),
        speed=20.0,
        until=45.0,
    )
    assert result.status == "complete"
    assert not any("contact table" in remark for remark in result.remarks)


def looked_up(contact, patch, j, share, t=0.5, table=0):
    """Fields of a patch in cell `j` of y at no roll, at a share of the table's last yaw squared."""
    _, _, n_w, n_roll, _, _ = contact.values.shape
    weights, out = np.empty(N_WEIGHT), np.empty(LOOK_UP_SIZE)
    set_cell_weights(contact, t, 0.0, 1.0, weights)
    tw = 1.0 + (share - 1.0) * contact.w[-1] / (contact.w[-1] - contact.w[-2])
    look_up(contact, table, patch, j + 1, n_roll // 2, n_w - 2, tw, weights, out)
    return out


def every_patch(contact):
    """Cells of y with each patch of the wheel."""
    return [(patch, j) for j in range(contact.values.shape[4] - 3) for patch in range(N_PATCH)]


@pytest.fixture(scope="module")
def contact():
    vehicle, track = load_vehicle("coach_manchester"), load_any_track("straight")
    return assembly.assemble(vehicle, track, Settings()).system.contact


@points("root", [0.0, 0.005, 0.01], always=(1,))
def test_patches_keep_stiffness_and_width_as_far_as_the_table_is_continued(contact, root):
    """A straight line takes those of a yawed flange below zero: the run ended as not finite.

    `root`: of the penetration [m^0.5].
    """
    shares, patches = [1.0, 1.2, 1.56, MAX_W], every_patch(contact)
    found = np.array([[looked_up(contact, *one, share) for one in patches] for share in shares])
    exists = (found[0, :, K] > 0.0) & (found[0, :, K] + 0.01 * found[0, :, K2] > 0.0)
    exists &= np.minimum(found[0, :, B1], found[0, :, B1] + found[0, :, D_B1]) > 0.0
    assert exists.sum() > 500
    assert np.all(found[:, exists, K] + root * found[:, exists, K2] > 0.0)
    assert np.all(np.minimum(found[..., B1], found[..., B1] + found[..., D_B1])[:, exists] > 0.0)


def test_gradients_of_continued_patches_are_those_of_their_stiffness(contact):
    """The force stays the gradient of an energy: difference quotients over y."""
    step, limited = 1e-4, 0
    for patch, j in every_patch(contact):
        inner, found = (looked_up(contact, patch, j, share) for share in (1.0, 1.3))
        if inner[K] < 1e8 or found[K] > 0.6 * inner[K]:
            continue
        before, after = (looked_up(contact, patch, j, 1.3, 0.5 + d) for d in (-step, step))
        for field, gradient in ((K, K_Y), (K2, K2_Y)):
            quotient = (after[field] - before[field]) / (2.0 * step * contact.dy)
            assert found[gradient] == pytest.approx(quotient, rel=1e-4, abs=1e-6 * abs(quotient))
        limited += 1
    assert limited > 3


def test_wheels_of_two_radii_roll_about_their_own(contact):
    """Tables are over y - r roll: from r to r' slopes over roll grow by (r - r') d/dy."""
    r, other = contact.shear[0], 0.42
    both = contact._replace(
        values=np.concatenate([contact.values[:1]] * 2), shear=np.array([r, other])
    )
    for patch, j in every_patch(contact)[::40]:
        one, two = (looked_up(both, patch, j, 0.9, table=table) for table in (0, 1))
        for over_y, over_roll in ((G_Y, G_ROLL), (K_Y, K_ROLL), (K2_Y, K2_ROLL)):
            expected = one[over_roll] + (r - other) * one[over_y]
            assert two[over_roll] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.further
def test_continued_table_agrees_with_a_table_of_75_mrad(monkeypatch):
    """Peaks of the run that leaves the table by most, with a table that it does not leave."""

    def peaks():
        result = simulate(load_vehicle("coach_manchester"), ramp(0.5), speed=40.0, until=60.0)
        found = result.groups["peaks"]
        return np.array([np.abs(found[name]).max() for name in ("Q", "Y", "sum_Y")])

    usual = peaks()
    wide = dataclasses.replace(TableGrid(), yaw_max=0.085, n_w=37)

    def wide_table(wheel, rail, **geometry):
        return build_contact_table(wheel, rail, grid=wide, **geometry)

    monkeypatch.setattr(assembly, "cached_contact_table", wide_table)
    assert peaks() == pytest.approx(usual, rel=0.05)
