"""Rails whose section changes: kinematic path and shares of wing and nose, runs over a crossing.

The crossing is that of the shipped track; results of the program CONTACT on it stand in
tests/data/sections (licence beside them).
"""

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq
from selection import points

from railsim.contact.curves import HALF_WIDTHS, wheel_curve
from railsim.contact.rail_sections import envelope_curve, kinematic_height, rail_parts
from railsim.contact.section_tables import SectionRange, _number_zones, section_table
from railsim.contact.table import _wheel_arrays, ellipse_functions, strip_influence
from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.section_files import SectionList, read_sections
from railsim.errors import InputError
from railsim.kernels import table_slice as kernel
from railsim.kernels.contact_table import G as HEIGHT
from railsim.model import rail_ranges
from railsim.model.assembly import assemble
from railsim.profiles import load_profile
from railsim.result.filters import low_passed
from railsim.simulation import simulate

ROOT = Path(__file__).parents[2]
LIST = ROOT / "tracks" / "sections" / "crossing_56e1_r245.csv"
RADIUS, G, NU = 0.46, 82e9, 0.28


@pytest.fixture(scope="module")
def parts():
    return rail_parts(read_sections(LIST, "rail"))


@pytest.fixture(scope="module")
def wheel():
    return wheel_curve(load_profile("S1002", "wheel"), RADIUS, 0.75, 1e-4)


def test_wing_and_nose_are_two_rails(parts):
    wing, nose = parts
    assert wing.positions[0] < -0.9
    assert wing.positions[-1] == pytest.approx(1.05853)
    assert nose.positions[0] == pytest.approx(0.11894)
    assert nose.positions[-1] > 2.2
    # a nose that appears is a nose and not a ramp
    Y = np.linspace(-0.03, 0.01, 5)
    assert np.isinf(nose.height(0.1185, Y)).all()
    assert nose.height(0.119, Y).min() == pytest.approx(0.0226, abs=1e-3)


@points(
    ("y", "lowest", "where"),
    [
        (-3.0, 0.290, 0.280),
        (-2.0, 0.169, 0.272),
        (-1.0, 0.034, 0.263),
        (0.0, -0.109, 0.252),
        (0.975, -0.268, 0.239),
        (2.0, -0.471, 0.2205),
        (3.0, -0.749, 0.190),
    ],
    always=(0, 3, 6),
)
def test_kinematic_path(parts, wheel, y, lowest, where):
    """Lowest point of a wheel that changes from wing to nose, within 0.015 mm and 3 mm."""
    s = where + np.arange(-0.006, 0.0065, 0.003)
    z = [kinematic_height(parts, at, (wheel.y, wheel.r), RADIUS, 1e-3 * y)[0] for at in s]
    k = int(np.argmax(z))
    assert 1e3 * z[k] == pytest.approx(lowest, abs=0.015)
    assert s[k] == pytest.approx(where, abs=0.003)


def test_two_patches_on_wing_and_flank_of_the_nose(parts, wheel):
    """Wing and nose at s = 160 mm, y = 3.52 mm under 10 kN: loads within 600 N of CONTACT's."""
    z, (wing, nose) = carried(parts, wheel, 3.52, 0.160)
    assert wing == pytest.approx(6171.0 * np.cos(0.05), abs=600.0)
    # its normal force and the vertical part of its friction
    assert nose == pytest.approx(4790.0 * np.cos(0.764) + 557.3 * np.sin(0.764), abs=600.0)
    assert z == pytest.approx(-0.9238, abs=0.005)


def test_contact_lies_where_the_rail_slopes(parts, wheel):
    """Behind the axle on the falling wing, ahead of it on the rising nose, as CONTACT finds it."""
    for part, lead in zip(parts, (-3.20, 4.59), strict=True):
        _, found, _ = kinematic_height((part,), 0.239, (wheel.y, wheel.r), RADIUS, 0.97e-3)
        assert 1e3 * found == pytest.approx(lead, abs=0.5)


def carried(parts, wheel, y, s=0.239, load=10e3):
    """Height of the wheel [mm] and loads of the rails, such as wing and nose [N], under a load."""
    tables = []
    for part in parts:
        rail = envelope_curve(part, s, RADIUS)
        fields = np.empty((3, 1, 12))
        kernel.fill_table_slice(
            fields,
            np.array([1e-3 * y]),
            0.0,
            0.0,
            RADIUS,
            _wheel_arrays(wheel, rail),
            kernel.Rail(rail.Y0, rail.dY, rail.z, rail.slope, rail.curvature),
            kernel.Elastic(G / (1.0 - NU), HALF_WIDTHS, 10e3, 0.02, False),
            ellipse_functions(G, NU),
            strip_influence(),
        )
        tables.append(fields[:, 0])

    def loads(z):
        approach = [np.maximum(z - table[:, 0], 0.0) for table in tables]
        return np.array(
            [
                (table[:, 1] * e**1.5 + table[:, 2] * e**2).sum()
                for table, e in zip(tables, approach, strict=True)
            ]
        )

    z = brentq(lambda z: loads(z).sum() - load, -3e-3, 0.0, xtol=1e-10)
    return 1e3 * z, loads(z)


def test_wing_and_nose_share_the_load_as_in_contact(parts, wheel):
    """Equal at y = 0.975 +- 0.02 mm; moved by the difference, each within 300 N, z 0.005 mm."""
    equal = brentq(lambda y: float(np.diff(carried(parts, wheel, y)[1])[0]), 0.93, 1.02, xtol=1e-3)
    assert equal == pytest.approx(0.975, abs=0.02)
    with (ROOT / "tests" / "data" / "sections" / "crossing_s239_dev.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["y_mm"] in ("0.95", "0.97", "0.99")]
    assert len(rows) == 6
    for row in rows:
        z, loads = carried(parts, wheel, float(row["y_mm"]) + equal - 0.975)
        angle, N = float(row["deltcp_rad"]), float(row["Fn_N"])
        assert loads[int(row["patch"]) - 1] == pytest.approx(N * np.cos(angle), abs=300.0)
        assert z == pytest.approx(float(row["z_mm"]), abs=0.005)


def test_height_on_a_nose_that_rises(wheel):
    """Rising 1:10, 46 mm ahead of the axle: within 0.003 mm of CONTACT under its load."""
    folder = ROOT / "tests" / "data" / "sections"
    y, z = 1e-3 * np.loadtxt(folder / "cross_nose_0.csv", delimiter=",", skiprows=1).T
    s = np.linspace(-0.1, 0.1, 21)
    sections = SectionList(s, tuple(np.array([y, z - 0.1 * at]) for at in s))
    nose = rail_parts(sections)
    with (folder / "cross_nose_s0_dev.csv").open() as lines:
        (row,) = ({k: float(v) for k, v in row.items()} for row in csv.DictReader(lines))
    height, _ = carried(nose, wheel, row["y_mm"], 1e-3 * row["s_mm"], row["Fz_N"])
    assert height == pytest.approx(row["z_mm"], abs=0.003)
    _, ahead, _ = kinematic_height(nose, 1e-3 * row["s_mm"], (wheel.y, wheel.r), RADIUS, 0.0)
    assert 1e3 * ahead == pytest.approx(row["xcp_tr_mm"], abs=0.5)


def test_every_table_along_a_rising_rail_lies_higher_by_its_way():
    """Rising 1:500 all along: heights of the tables lie on a line of that slope within 0.2 um."""
    y = np.linspace(-0.035, 0.035, 40)
    s = np.linspace(-0.5, 1.0, 16)
    sections = SectionList(s, tuple(np.array([y, 1.3e4 * y**4 - 2e-3 * at]) for at in s))
    settings = load_settings()
    model = assemble(load_vehicle("coach_manchester"), load_track("straight"), settings)
    plain, profiles = model.tables[0], (load_profile("S1002"), load_profile("60E1"))
    given = SectionRange(sections, 0.0, 0.22, 0.75, *profiles, plain, settings.normal_contact)
    table = section_table(given)
    (rows,) = table.description["parts"]
    along, zones = np.array(rows)[:, 0], np.array(rows)[:, 1:].astype(int)
    fields = table.values.reshape(-1, *table.values.shape[2:])
    middle, zero = fields.shape[2] // 2, round(-table.y0 / table.dy)
    height = fields[zones, 0, middle, zero, HEIGHT].min(axis=1)
    own = (along > 0.0) & (along < 0.22)
    assert own.sum() >= 3
    line = height[own][0] - 2e-3 * (along[own] - along[own][0])
    np.testing.assert_allclose(height[own], line, atol=2e-7)
    # the first follows from the plain rail, which the range begins with
    assert height[1] - height[own][0] == pytest.approx(2e-3 * along[own][0], abs=2e-6)


def test_sections_of_a_rail_stand_under_the_wheels_of_its_side(monkeypatch):
    """With the profiles of wheel and plain rail there; alike for the next wheelset alone."""
    monkeypatch.setattr(rail_ranges, "cached_section_table", lambda given: given)
    track = load_track("crossing_56e1_r245_1in9.25")
    both = [track.sections[0].model_copy(update={"rail": rail}) for rail in ("right", "left")]
    track = track.replace(sections=both, rail=("rail on the left", "rail on the right"))
    wheels = SimpleNamespace(wheelset=SimpleNamespace(profile=("left", "right")))
    found = rail_ranges.rail_ranges(
        SimpleNamespace(of_kind=lambda _: [wheels, wheels]),
        track,
        {name: name for name in (*track.rail, *wheels.wheelset.profile)},
        (("left table", "right table"), np.array([[0, 1], [0, 1]])),
        None,
    )
    assert found.which.tolist() == [[[-1, 0], [-1, 0]], [[1, -1], [1, -1]]]
    assert [(one.wheel, one.rail, one.plain) for one in found.tables] == [
        ("right", "rail on the right", "right table"),
        ("left", "rail on the left", "left table"),
    ]


def test_a_rail_that_stands_beside_the_range_alone_has_no_tables():
    """Such as the nose of a crossing whose range ends ahead of it."""
    all_zones = np.ones(3, dtype=bool)
    kept, described = _number_zones([[(0.0, 0, all_zones), (0.1, 1, all_zones)], []], 0.0)
    assert kept == [(0, [0, 1, 2]), (1, [0, 1, 2])]
    assert described == [[[0.0, 0, 1, 2], [0.1, 3, 4, 5]], []]


@pytest.mark.parametrize("beyond", [0.0, 0.02, 0.04, 0.058])
@pytest.mark.parametrize("end", [-1.0, 1.0])
def test_a_wheel_beyond_the_end_of_a_rail_stands_on_its_edge(beyond, end):
    """By r - sqrt(r^2 - x^2) lower than on the rail, the axle x from the edge."""
    y = np.linspace(-0.035, 0.035, 40)
    s = np.linspace(-0.5, 0.5, 11)
    (part,) = rail_parts(SectionList(s, tuple(np.array([y, 1.3e4 * y**4]) for _ in s)))
    there = envelope_curve(part, end * (0.5 + beyond), RADIUS)
    lower = RADIUS - np.sqrt(RADIUS**2 - beyond**2)
    assert there.z.min() == pytest.approx(lower, abs=2e-6)
    assert envelope_curve(part, 0.0, RADIUS).z.min() == pytest.approx(0.0, abs=2e-6)


@pytest.mark.further
def test_impact_has_the_size_of_the_formula():
    """Contact force below 90 Hz on the nose: 0.7 to 1.1 times the P2 formula, dip 18.15 mrad.

    At 10 m/s; the formula takes ramps that go on, and these end 0.1 m behind the lowest point.
    """
    speed, force = 10.0, 86.5e3
    track = load_track("crossing_56e1_r245_1in9.25").replace(
        support={"preset": "p2"}, check_rail=[], gauge=1.43
    )
    settings = load_settings().with_values({"output_rate": 4000.0})
    coach = load_vehicle("benchmark_vehicle1")
    run = simulate(coach, track, speed=speed, settings=settings, start=36.0, until=42.0)
    Q = low_passed(run["Q"][:, 0, 1], 4000.0, 90.0)
    near = np.abs(run["wheelset_distance"][:, 0] - 50.3) < 0.4
    assert 0.7 * force < Q[near].max() < 1.1 * force


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"begin": 40.0}, "do not reach"),
        ({"end": 49.4}, "behind 'begin'"),
        ({"rail": "both"}, "rail"),
        ({"file": "none.slcs"}, "file"),
    ],
)
def test_wrong_sections_are_refused(changed, said):
    track = load_track("crossing_56e1_r245_1in9.25")
    part = track.sections[0].model_dump(exclude_none=True)
    with pytest.raises(InputError, match=said):
        track.replace(sections=[{**part, **changed}])


@pytest.mark.parametrize(
    ("rail", "begin", "faults"), [("right", 50.2, 1), ("right", 50.5, 0), ("left", 50.2, 0)]
)
def test_ranges_of_a_rail_that_overlap_are_refused(rail, begin, faults):
    """Where two say what a rail is, none does."""
    track = load_track("crossing_56e1_r245_1in9.25")
    part = track.sections[0].model_dump(exclude_none=True) | {"begin": 49.6, "end": 50.5}
    found = []
    try:
        track.replace(sections=[part, {**part, "rail": rail, "begin": begin, "end": 51.0}])
    except InputError as error:
        found = [f"{fault.file}: {fault.key}: {fault.found}" for fault in error.faults]
    assert found == ["track: sections.1: 50.2 to 51 m, within the range of sections.0"] * faults
