"""Wheels that are not round: paths against CONTACT and closed forms, runs against irregular rails.

Sections and results of the program CONTACT (tests/data/sections, licence beside them).
"""

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from railsim.contact import out_of_round
from railsim.contact.curves import RailCurve, rail_curve
from railsim.contact.out_of_round import (
    ACROSS,
    _deviation,
    rolled_out,
    surface_arrays,
    wheel_surface,
)
from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.mirror import mirrored_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.out_of_round import Flat, Harmonics, RadiusTable, Sections
from railsim.errors import InputError
from railsim.kernels.wheel_surface import SURFACE_ROW, WAVE, angle_to_flat, surface_height
from railsim.model.uneven_wheels import PER_LENGTH, PER_WAVE, ROUND
from railsim.profiles import Profile
from railsim.simulation import simulate

FOLDER = Path(__file__).parents[1] / "data" / "sections"
RADIUS = 0.46
FURTHER = pytest.mark.further
WHEELSET = "assemblies.bogie.assemblies.axle.wheelsets.wheelset"


def written_list(folder, name):
    """Write the kept sections of a wheel as a `.slcw` list with its files."""
    kept = np.load(FOLDER / "wheel_sections.npz")
    points = np.split(1e-4 * kept[f"{name}_points"], np.cumsum(kept[f"{name}_count"])[:-1], axis=1)
    angles = kept[f"{name}_angle"]
    lines = [" 0.0 1.0  TH_OFFSET, TH_SCALE", f" {angles.size}  NSLC", " 0 0 0 NFEAT", " 2 % kind"]
    for k, (angle, part) in enumerate(zip(angles, points, strict=True)):
        np.savetxt(folder / f"{k}.txt", part.T, fmt="%.4f")
        lines.append(f" {angle:.9f}  '{k}.txt'")
    path = folder / "wheel.slcw"
    path.write_text("% a wheel\n" + "\n".join(lines) + "\n")
    return path


def sections_of(tmp_path, name):
    """Sections of a wheel as a vehicle that is loaded holds them."""
    loaded = with_file(tmp_path, written_list(tmp_path, name))
    group = loaded.assemblies["bogie"].assemblies["axle"].wheelsets["wheelset"]
    part = group.out_of_round["scan"]
    assert isinstance(part, Sections)
    assert part.file is None
    return part


def measured(name):
    with (FOLDER / f"{name}_dev.csv").open() as lines:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(lines)]


class Tables:
    """Arrays of one surface as the kernel takes them."""

    def __init__(self, *args):
        self.surface_row, self.surface, self.flat_ahead = surface_arrays([wheel_surface(*args)])

    def at(self, phi, y=0.0):
        return surface_height.py_func(self, 0, phi, y)


def round_rail(radius):
    Y = 0.75 + np.arange(-0.05, 0.05, 2e-5)
    height = radius - np.sqrt(radius**2 - (Y - 0.75) ** 2)
    return RailCurve(float(Y[0]), 2e-5, height, np.zeros_like(Y), np.zeros_like(Y))


def test_rounded_flat_as_contact_finds_it(tmp_path):
    """Height less approach within 0.01 mm, contact ahead within 0.3 mm; symmetric to 1e-6 mm."""
    tables = Tables([sections_of(tmp_path, "rounded")], 0.45, round_rail(0.3), 0.75)
    cases = measured("rounded_flat_d09")
    assert len(cases) == 8
    for case in cases:
        e, lead, across = tables.at(-case["pitch_rad"])
        assert -1e3 * e == pytest.approx(case["z_mm"] - case["approach_mm"], abs=0.01)
        assert 1e3 * lead == pytest.approx(case["xcp_tr_mm"], abs=0.3)
        assert abs(across) < 1e-6
    for phi in np.radians(np.arange(0.5, 7.0, 0.5)):
        assert tables.at(phi)[0] == pytest.approx(tables.at(-phi)[0], abs=1e-9)


def test_measured_flat_as_contact_finds_it(tmp_path):
    """Height less approach within 0.02 mm at every angle, sections smoothed both ways."""
    with_points = np.loadtxt(FOLDER / "r300_wide.csv", delimiter=",", skiprows=1).T
    rail = rail_curve(Profile("r300", "rail", *with_points), 1.435, 0.02)
    part = sections_of(tmp_path, "chalmers")
    tables = Tables([part], 0.49, rail, 0.75)
    _, level, (begin, end) = rolled_out(part, 0.49, rail, 0.75, 1024, ACROSS)
    assert begin < 0.55 < 0.75 < end
    for case in measured("chalmers_flat_fz125"):
        e, lead, _ = tables.at(-case["pitch_rad"])
        height = 0.49 - level[20] - e
        assert 1e3 * height == pytest.approx(case["z_mm"] - case["approach_mm"], abs=0.02)
        assert 1e3 * lead == pytest.approx(case["xcp_tr_mm"], abs=1.5)


@pytest.mark.parametrize("middle", [0.0, -1.0, 1.0])
def test_sections_of_a_chord_are_a_flat_wherever_their_angles_begin(middle):
    """Every 2 mrad, 0.02 mm deep up to 64.5 mrad: of those to +-64, with one more on either side.

    Along the flat the centre falls by l^2/(8 r), but for its ends, which are smoothed.
    """
    half, away = 0.03 / RADIUS, 2e-3 * np.arange(-60, 61)
    heights = np.minimum(RADIUS * (np.cos(half) / np.cos(away) - 1.0), 0.0)
    read = {"angles": tuple(middle + away), "heights": tuple((h, h) for h in heights)}
    part = Sections(type="sections", positions=(-0.04, 0.04), **read)
    tables = Tables([part], RADIUS, round_rail(0.3), 0.75)
    assert tables.surface_row[0, 6] == pytest.approx(RADIUS * 0.132, rel=1e-9)
    assert -tables.at(middle)[0] == pytest.approx(0.06**2 / 8.0 / RADIUS, rel=0.01)
    for beside in (-1.5 * half, 1.5 * half):
        assert tables.at(middle + beside)[0] == pytest.approx(0.0, abs=5e-8)


def test_fresh_flat_is_a_chord():
    """Depth l^2/(8 r) in the middle, contact half a length away, nothing beyond its ends."""
    flat = Flat(type="flat", length=0.06, angle=1.0)
    tables = Tables([flat], RADIUS, round_rail(0.3), 0.75)
    half = 0.03 / RADIUS
    e, _, _ = tables.at(1.0)
    # the jump of the contact is rounded over a cell of the table
    assert -e == pytest.approx(0.06**2 / 8.0 / RADIUS, rel=0.02)
    fall = RADIUS * (1.0 - np.cos(0.9 * half))
    assert -tables.at(1.0 + 0.1 * half)[0] == pytest.approx(fall, rel=1e-5)
    assert tables.at(1.0 - 0.02 * half)[1] == pytest.approx(-0.98 * 0.03, rel=1e-2)
    assert tables.at(1.0 + 0.02 * half)[1] == pytest.approx(0.98 * 0.03, rel=1e-2)
    for phi in (1.0 - 1.01 * half, 1.0 + 1.01 * half, 1.0 + np.pi, 1.0 - np.pi):
        assert tables.at(phi)[0] == pytest.approx(0.0, abs=5e-8)
    # a turn later it is there again; before it, the way to it is known
    assert tables.at(1.0 + 2.0 * np.pi)[0] == pytest.approx(e, rel=1e-9)
    assert angle_to_flat.py_func(tables, 0, 1.0) == 0.0
    assert angle_to_flat.py_func(tables, 0, 0.5) == pytest.approx(0.5 - half, abs=5e-3)
    assert angle_to_flat.py_func(tables, 0, 1.0 + half + 0.1) == pytest.approx(2 * np.pi, abs=0.3)


def test_path_and_lead_belong_together():
    """The lead is the slope of the height, so that the normal force does no work over a turn."""
    parts = [
        Harmonics(type="harmonics", waves=((3, 1e-4, 0.2), (17, 2e-5, 1.0))),
        Flat(type="flat", length=0.05, shape="worn", angle=-2.0),
    ]
    tables = Tables(parts, RADIUS, round_rail(0.3), 0.75)
    for phi in np.linspace(-8.0, 8.0, 41):
        h = 1e-6
        slope = (tables.at(phi + h)[0] - tables.at(phi - h)[0]) / (2.0 * h)
        assert tables.at(phi)[1] == pytest.approx(slope, abs=1e-8)
    phi = 0.7
    exact = 1e-4 * np.cos(3 * phi + 0.2) + 2e-5 * np.cos(17 * phi + 1.0)
    assert tables.at(phi)[0] == pytest.approx(exact, abs=1e-10)


def straight(preset, length=200.0, **more):
    plan = [{"type": "STR", "length": length}]
    cant = [{"type": "CST", "length": length, "cant": 0.0}]
    values = {"plan": plan, "cant": cant, "support": {"preset": preset}, **more}
    return load_track("straight").replace(**values)


def with_wheels(**parts):
    return load_vehicle("benchmark_vehicle1").with_values({f"{WHEELSET}.out_of_round": parts})


def fitted(result, omega, begin):
    """Amplitude of the leading right wheel's load at a frequency [N]."""
    t = result["time"]
    known = t > begin
    t, Q = t[known], result["Q"][known, 0, 1]
    basis = np.column_stack([np.cos(omega * t), np.sin(omega * t), np.ones_like(t), t])
    found = np.linalg.lstsq(basis, Q, rcond=None)[0]
    return float(np.hypot(found[0], found[1]))


@pytest.mark.parametrize("preset", [pytest.param("rigid", marks=FURTHER), "co-running"])
def test_wave_around_the_wheel_is_a_wave_of_the_rail(preset):
    """Order n equals a sine of the wavelength 2 pi r/n as irregularity, within 0.1 %.

    On rigid rails with short steps: the scheme follows irregular rails better than wheels.
    """
    order, amplitude, speed = 8, 2e-5, 14.0
    wave = 2.0 * np.pi * RADIUS / order
    uneven = with_wheels(all={"type": "harmonics", "waves": [[order, amplitude, 0.3]]})
    sweep = {
        "type": "sweep",
        "amplitude": amplitude,
        "wavelengths": [wave, wave],
        "begin": -20.0,
        "end": 180.0,
        "fade": 0.0,
    }
    settings = load_settings().with_values({"output_rate": 2000.0})
    if preset == "rigid":
        settings = settings.with_values({"step": 1.25e-4})
    how = {"speed": speed, "start": 20.0, "duration": 2.5, "settings": settings}
    mine = simulate(uneven, straight(preset), **how)
    other = simulate(
        load_vehicle("benchmark_vehicle1"), straight(preset, irregularities=[sweep]), **how
    )
    omega = 2.0 * np.pi * speed / wave
    a, b = (fitted(result, omega, 1.0) for result in (mine, other))
    assert b > 200.0
    assert a == pytest.approx(b, rel=1e-3)


def test_wave_on_rigid_rails_is_followed_at_the_chosen_step():
    """By twenty steps a wave, as on elastic rails, the force was 6 % too large."""
    omega = 8.0 * 14.0 / RADIUS
    uneven = with_wheels(all={"type": "harmonics", "waves": [[8, 2e-5, 0.3]]})
    how = {"speed": 14.0, "start": 20.0, "duration": 1.5}
    fine = load_settings().with_values({"scheme": "rk4", "step": 2.5e-4, "output_rate": 400.0})
    chosen = load_settings().with_values({"output_rate": 400.0})
    forces = [
        fitted(simulate(uneven, straight("rigid"), **how, settings=settings), omega, 0.8)
        for settings in (chosen, fine)
    ]
    assert forces[0] == pytest.approx(forces[1], rel=0.01)


@pytest.mark.parametrize("length", [pytest.param(0.04, marks=FURTHER), 0.06])
def test_worn_flat_is_a_dip_of_the_rail(length):
    """A haversine flat gives the forces of a dip of its length and depth, within 1 %."""
    at, speed = 30.0, 16.0
    flat = {"type": "flat", "length": length, "shape": "worn"}
    flat["angle"] = float((at / RADIUS + np.pi) % (2.0 * np.pi) - np.pi)
    dip = {"type": "dip", "s": at, "length": length, "depth": length**2 / 16.0 / RADIUS}
    dip["shape"] = "cosine"
    settings = load_settings().with_values({"output_rate": 20000.0})
    vehicle = load_vehicle("benchmark_vehicle1")
    first = max(body.position[0] for body in flatten(vehicle).of_kind("wheelset"))
    how = {"speed": speed, "start": at - first - 0.5, "duration": 0.6 / speed, "settings": settings}
    mine = simulate(with_wheels(one=flat), straight("co-running"), **how)
    other = simulate(vehicle, straight("co-running", irregularities=[dip]), **how)
    Q, P = mine["Q"][:, 0, 1], other["Q"][:, 0, 1]
    assert P.max() > 1.5 * P[0]
    assert Q.max() == pytest.approx(P.max(), rel=0.01)


def test_left_and_right_are_mirror_images():
    """A flat on the left wheel of the mirrored vehicle gives the mirrored forces."""
    flat = {"type": "flat", "length": 0.05, "wheel": "right", "angle": 0.6}
    vehicle = with_wheels(one=flat)
    settings = load_settings().with_values({"output_rate": 5000.0})
    how = {"speed": 12.0, "start": 20.0, "duration": 0.1, "settings": settings}
    mine = simulate(vehicle, straight("p2"), **how)
    other = simulate(mirrored_vehicle(vehicle), straight("p2"), **how)
    Q, P = mine["Q"], other["Q"][:, :, ::-1]
    assert np.abs(Q - Q[0]).max() > 1e4
    np.testing.assert_allclose(Q, P, atol=1e-6 * Q.max())


def test_run_goes_on_at_the_wheels_angle():
    """The angle is part of the state: a run in two parts is the run in one."""
    vehicle = with_wheels(one={"type": "flat", "length": 0.05, "angle": 0.6})
    track = straight("p2")
    whole = simulate(vehicle, track, speed=12.0, start=20.0, duration=0.4)
    first = simulate(vehicle, track, speed=12.0, start=20.0, duration=0.2)
    second = simulate(vehicle, track, duration=0.2, resume=first)
    np.testing.assert_allclose(second["Q"][-1], whole["Q"][-1], rtol=1e-6)


def with_flat(at, length):
    """Vehicle whose fresh flats are on the rail where a wheelset is at `at`, and its first [m]."""
    flat = {"type": "flat", "length": length}
    flat["angle"] = float((at / RADIUS + np.pi) % (2.0 * np.pi) - np.pi)
    vehicle = with_wheels(one=flat)
    return vehicle, max(body.position[0] for body in flatten(vehicle).of_kind("wheelset"))


def test_the_chosen_step_follows_the_blow_of_a_fresh_flat():
    """The reference scheme at 0.0125 ms on rails with masses: Q within 1 %, Y within 4 %.

    In parts of 0.3 ms 222 instead of 279 kN and 7.5 instead of 33 kN (Manchester coach).
    """
    coach, first = with_flat(40.0, 0.06)
    way = {"speed": 10.0, "start": 39.9 - first, "until": 40.05 - first}

    def largest(**how):
        settings = load_settings().with_values(how)
        peaks = simulate(coach, straight("slab"), settings=settings, **way).groups["peaks"]
        return np.array([np.abs(peaks[name][:, 0]).max() for name in ("Q", "Y")])

    Q, Y = largest() / largest(scheme="rk4", step=1.25e-5)
    assert pytest.approx(1.0, abs=0.01) == Q
    assert pytest.approx(1.0, abs=0.04) == Y


def tipping(speed, length=0.06, **contact):
    """Force of the leading right wheel that tips over the end of a fresh flat, and static [N]."""
    at = 40.0
    vehicle, first = with_flat(at, length)
    settings = load_settings().with_values({"output_rate": 20000.0, **contact})
    how = {"speed": speed, "start": at - first - 0.2, "duration": 0.35 / speed}
    run = simulate(vehicle, straight("rigid"), settings=settings, **how)
    Q, ahead = run["Q"][:, 0, 1], run["wheelset_distance"][:, 0] - at
    return Q[(ahead > -0.5 * length - 2e-3) & (ahead < -1e-3)], Q[0]


@FURTHER
@pytest.mark.parametrize(("speed", "flies"), [(4.75, False), (5.3, True)])
def test_fresh_flat_lifts_off_where_tipping_asks_for_more_than_the_load(speed, flies):
    """Above sqrt(r P0/m_u) = 5.26 m/s within 10 %, where the contact does not ring.

    With the usual contact damping the force swings below that of steady tipping: from 4.2 m/s on.
    """
    tips, static = tipping(speed, contact_damping=2e6)
    assert np.sqrt(RADIUS * static / (0.5 * 1813.0)) == pytest.approx(5.26, abs=0.01)
    assert (tips.min() <= 0.0) == flies


def least_force(speed, damping, length=0.06, h=4e-6):
    """Least force of a mass under its load that tips on a sphere's contact, written anew [N].

    The formula is that of a rigid contact: the centre falls on a circle about the flat's edge with
    V^2/r, and the force is P0 - m V^2/r at once.
    """
    mass, load, hertz = 0.5 * 1813.0, 54.546e3, 1e11
    z, v, x, least = (load / hertz) ** (2.0 / 3.0), 0.0, -0.5 * length - 2e-3, load
    while x < -1e-3:
        turned = max(x + 0.5 * length, 0.0) / RADIUS
        e = max(z - RADIUS * (1.0 - np.cos(turned)), 0.0)
        damped = damping * min(1.0, e / 30e-6) * (v - speed * np.sin(turned))
        force = max(0.0, hertz * e**1.5 + damped) if e > 0.0 else 0.0
        v += h * (load - force) / mass
        z += h * v
        x += h * speed
        least = min(least, force)
    return least


def lift_off(damping):
    """Least speed at which the force of `least_force` vanishes [m/s]."""
    low, high = 3.0, 7.0
    while high - low > 0.005:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if least_force(middle, damping) <= 0.0 else (middle, high)
    return high


def test_formula_of_lift_off_is_that_of_a_contact_that_does_not_ring():
    """On a spring the force swings below its new mean: off at 4.1 m/s undamped, 5.2 m/s damped."""
    speeds = [lift_off(damping) for damping in (0.0, 2e5, 2e6, 5e6)]
    assert speeds == pytest.approx([4.08, 4.32, 4.96, 5.18], abs=0.02)
    assert speeds[-1] == pytest.approx(5.26, rel=0.02)


@FURTHER
@pytest.mark.parametrize("damping", [2e5, 2e6])
def test_fresh_flat_lifts_off_as_a_mass_on_its_contact(damping):
    """Within 4 % of the speed found by the independent integration."""
    speed = lift_off(damping)
    assert tipping(0.96 * speed, contact_damping=damping)[0].min() > 0.0
    assert tipping(1.01 * speed, contact_damping=damping)[0].min() <= 0.0


def test_angle_of_a_wheel_rises_as_it_rolls():
    """A section at the angle a is at the bottom at s = r0 a, later by r0 per pitch against it."""
    flat = {"type": "flat", "length": 0.05, "angle": 0.6}
    settings = load_settings().with_values({"output_rate": 5000.0})
    vehicle = with_wheels(one=flat)
    run = simulate(vehicle, straight("p2"), speed=12.0, start=20.0, duration=0.3, settings=settings)
    wheelset = run.bodies.index(run.wheelsets[0])
    phi = run["wheelset_distance"][:, 0] / RADIUS - run["body_position"][:, wheelset, 4]
    struck = np.argmax(run["Q"][:, 0, 1])
    turns = (phi[struck] - 0.6) / (2.0 * np.pi)
    assert turns == pytest.approx(round(turns), abs=0.02)


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ({"type": "flat", "length": 0.5}, "length"),
        ({"type": "harmonics", "waves": [[2.5, 1e-4, 0.0]]}, "whole number"),
        ({"type": "table", "rows": [[0.0, 0.0], [1.0, 1e-4], [7.0, 0.0]]}, "turn"),
        ({"type": "table", "rows": [[0.0, 0.0], [1.0, 1e-4], [0.5, 0.0]]}, "increase"),
        ({"type": "sections"}, "'file'"),
        ({"type": "oval"}, "type"),
    ],
)
def test_wrong_wheels_are_refused(part, said):
    with pytest.raises(InputError, match=said):
        with_wheels(one=part)


def test_sections_come_from_a_file_or_from_what_was_read():
    read = {"angles": (0.0, 2.0, 4.0), "positions": (0.0, 0.01), "heights": ((0.0, 0.0),) * 3}
    assert Sections(type="sections", file="scan.slcw").angles is None
    assert Sections(type="sections", **read).file is None
    for both in ({**read, "file": "scan.slcw"}, {"angles": read["angles"]}):
        with pytest.raises(ValueError, match="either 'file', or"):
            Sections(type="sections", **both)


def test_wrong_lists_are_refused(tmp_path):
    path = written_list(tmp_path, "rounded")
    text = path.read_text()
    lines = text.splitlines()
    wrong = {
        "rising positions": "\n".join([*lines[:6], lines[5], *lines[7:]]),
        "no file": text.replace("'3.txt'", "'none.txt'"),
        "sections": text.replace(" 57  NSLC", " 1  NSLC"),
        "times": text.replace(" 57  NSLC", " 99  NSLC"),
    }
    for said, changed in wrong.items():
        path.write_text(changed)
        with pytest.raises(InputError, match=said):
            with_file(tmp_path, path)
    path.write_text(text)
    (tmp_path / "3.txt").write_text("-3e-4 0\n" * 20)
    with pytest.raises(InputError, match="wide"):
        with_file(tmp_path, path)


def with_file(folder, path):
    file = folder / "coach.toml"
    head = 'format = "railsim-vehicle/1"\nname = "x"\nextends = "coach_manchester"\n'
    table = f'[{WHEELSET}.out_of_round.scan]\ntype = "sections"\nfile = "{path.name}"\n'
    file.write_text(head + table)
    return load_vehicle(file)


@pytest.mark.parametrize("order", [3, 24, 120])
def test_nodes_and_steps_resolve_the_shortest_wave(order):
    """It is the wheel's circumference over the highest order, of a table without what is small."""
    waves = [[1, 1e-4, 0.0], [order, 1e-5, 0.0]]
    angles = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    change = 1e-4 * np.cos(angles) + 1e-5 * np.cos(order * angles) + 1e-6 * np.cos(150 * angles)
    rows = np.stack([angles, change], axis=1).tolist()
    for part in Harmonics(type="harmonics", waves=waves), RadiusTable(type="table", rows=rows):
        surface = wheel_surface((part,), RADIUS, None, 0.75)
        assert surface.wave == pytest.approx(2.0 * np.pi * RADIUS / order, rel=1e-12)
        assert surface.flat == np.inf
        assert len(surface.ahead) >= 8 * order


@pytest.mark.parametrize(("wheel", "rail"), [(0.3, 0.5), (0.5, 0.3), (None, 0.3)])
def test_a_step_is_a_part_of_the_shorter_wave_at_any_speed(wheel, rail):
    rows = np.zeros((1 if wheel else 0, SURFACE_ROW))
    rows[:, WAVE] = wheel
    wheels = ROUND._replace(surface_row=rows)
    for elastic, parts in ((False, PER_WAVE), (True, PER_LENGTH)):
        for speed in (0.5, 60.0):
            found = wheels.longest_step(speed, rail, elastic=elastic)
            assert found * speed * parts == pytest.approx(0.3)


@pytest.mark.parametrize("wheel", ["both", "right"])
def test_a_run_begins_on_the_wheels_as_they_are(wheel):
    """Eccentric by 0.5 mm at 30 m/s: a wheelset m has m e (V/r)^2/2 = 2.8 % of Q0 a wheel.

    The radius was there at once: up to 17 Q0 in the first milliseconds.  One wheel moves about the
    other one.
    """
    part = f"{{w={{type='harmonics',wheel='{wheel}',waves=[[1,0.5e-3,1.57]]}}}}"
    coach = load_vehicle("coach_manchester", [f"{WHEELSET}.out_of_round={part}"])
    track = load_track("straight").replace(support={"preset": "rigid"})
    result = simulate(coach, track, speed=30.0, duration=0.1)
    force = result["dQ_over_Q0"]
    mass = coach.assemblies["bogie"].assemblies["axle"].wheelsets["wheelset"].mass
    most = 0.5 * mass * 0.5e-3 * (30.0 / RADIUS) ** 2 / result["Q0"].min()
    assert np.abs(force[0]).max() < 0.1 * most
    assert 0.5 * most < np.abs(force).max() < 1.5 * most


def test_a_wheel_that_begins_on_its_flat_is_not_thrown_up_by_it():
    """Behind the middle of a flat the radius grows by x/R per metre: at 28 m/s 0.9 m/s 15 mm on.

    No wheel follows that: it flies over the flat.  With this speed to begin with it flew for 20 ms;
    under the load of its springs it falls by the whole depth l^2/(8 R) of the flat in 4 ms.
    """
    length, speed = 0.05, 28.0
    ahead = 9.5 + 1.28  # m, of the leading wheelset
    flat = f"{{w={{type='flat',length={length},angle={(ahead - 0.01) / RADIUS % (2 * np.pi)}}}}}"
    coach = load_vehicle("coach_manchester", [f"{WHEELSET}.out_of_round={flat}"])
    track = load_track("straight").replace(support={"preset": "rigid"})
    settings = load_settings().replace(output_rate=5000.0)
    result = simulate(coach, track, speed=speed, duration=0.03, settings=settings)
    mass = coach.assemblies["bogie"].assemblies["axle"].wheelsets["wheelset"].mass
    fall = np.sqrt(length**2 / (4.0 * RADIUS) * 0.5 * mass / result["Q0"].max())
    lands = result["time"][1:][result["Q"][1:, 0, 0] > 0.0][0]
    assert lands < fall


def test_arms_begin_as_the_wheels_stand():
    """The bush of an arm would be strained by 0.5 mm: loads then change as by nothing later."""
    part = "{w={type='harmonics',waves=[[1,0.5e-3,0.5]]}}"
    coach = load_vehicle("coach_flexicoil", [f"{WHEELSET}.out_of_round={part}"])
    settings = Settings(output_rate=1000.0)
    result = simulate(coach, load_track("straight"), speed=20.0, duration=0.6, settings=settings)
    change, begins = np.abs(result["dQ_over_Q0"]), result["time"] < 0.1
    assert change[begins].max() < change[~begins].max()


def flattened(angles, depths):
    """Sections of three points, lower than a round wheel by depths, twice as much in the middle."""
    base = np.array([1e-3, 0.0, 2e-3])
    change = -np.outer(depths, [1.0, 2.0, 0.0])
    return SimpleNamespace(angles=angles, heights=base + change), change


@pytest.mark.parametrize("scatter", [False, True])
def test_a_flat_reaches_to_the_sections_beside_those_that_are_deep(scatter):
    """All around, each 0.1745 rad, 0.2 mm at 10 to 12; some 30 um elsewhere are none of it.

    Of scatter, what is deeper than a tenth of the deepest counts, within half a radian of it.
    """
    angles, depths = np.radians(10.0 * np.arange(36)), np.zeros(36)
    depths[10:13] = 1e-4, 2e-4, 1.5e-4
    if scatter:
        depths[[3, 25]] = 1.5e-5, 1.6e-5
        depths[20] = 3e-5  # more than a tenth, 1.6 rad off
    part, change = flattened(angles, depths)
    found, begin, end = _deviation(part)
    assert found == pytest.approx(change)
    assert (begin, end) == pytest.approx(np.radians([90.0, 130.0]))


def test_sections_without_a_flat_are_looked_at_from_the_first_to_the_last():
    """None is off by 20 um; of sections of a part the round wheel is between the ends."""
    angles = np.linspace(1.0, 1.5, 11)
    part, change = flattened(angles, np.full(11, 0.99e-5))
    found, begin, end = _deviation(part)
    assert found == pytest.approx(0.0 * change, abs=1e-12)
    assert (begin, end) == (1.0, 1.5)
    depths = np.zeros(11)
    depths[[0, 5, 10]] = 2e-6, 1.01e-4, 4e-6
    part, change = flattened(angles, depths)
    found, begin, end = _deviation(part)
    assert found == pytest.approx(change - 0.5 * (change[0] + change[-1]))
    assert (begin, end) == pytest.approx((1.2, 1.3))
    depths[5] = 1.2e-5  # 24 um less 6 um in the middle
    assert _deviation(flattened(angles, depths)[0])[1:] == (1.0, 1.5)


def test_steps_resolve_the_length_of_a_measured_flat(monkeypatch):
    """Of a centimetre at least; it is no wave all around."""
    for extent, length in ((0.1, 0.046), (0.001, 0.01)):
        monkeypatch.setattr(out_of_round, "_deviation", lambda _, x=extent: (None, 1.0, 1.0 + x))
        found = out_of_round._lengths(Sections.model_construct(), RADIUS)
        assert found == (pytest.approx(length), np.inf)


def test_sections_rolled_the_other_way_have_the_same_radius_at_the_opposite_angle():
    part = Sections(
        type="sections",
        angles=(-0.2, 0.1, 0.5),
        positions=(0.0, 0.01),
        heights=((1e-4, 2e-4), (3e-4, 4e-4), (5e-4, 6e-4)),
    )
    back = part.backwards()
    radii = dict(zip(part.angles, part.heights, strict=True))
    assert back.angles == (-0.5, -0.1, 0.2)
    assert {-a: row for a, row in zip(back.angles, back.heights, strict=True)} == radii
    assert back.backwards() == part
    assert Sections(type="sections", file="a.slcw").backwards().file == "a.slcw"
