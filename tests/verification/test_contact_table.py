"""The contact table against an independent search, and the laws that it must keep."""

from functools import cache

import numpy as np
import pytest
from independent_contact import evaluate, forces, lowest_gap, potential, rail_points, under_load
from selection import points

from railsim.contact import build_contact_table, cached_contact_table, hertz
from railsim.contact.elastic import loaded_contact
from railsim.contact.table import TableGrid
from railsim.profiles import Profile, load_profile
from railsim.profiles.builtin import s1002_height

WHEEL_Y = np.arange(-60.0, 60.0, 0.05)
WHEEL = 1e-3 * WHEEL_Y, 1e-3 * s1002_height(WHEEL_Y)


RANGE = {"s_min": -0.013, "s_max": 0.011, "roll_max": 0.014}  # of `random_positions`
NARROW, FINE_YAW, ONE_YAW = TableGrid(**RANGE, n_w=5), TableGrid(**RANGE), TableGrid(**RANGE, n_w=2)


@cache
def table_of(seed, rail):
    """Of S1002 where `seed` is None, else of a worn one."""
    wheel = load_profile("S1002") if seed is None else worn(seed)
    return build_contact_table(wheel, load_profile(rail), grid=NARROW)


def standard_table():
    return table_of(None, "60E1")


def worn(seed):
    """S1002 with random smooth wear: hollows and ridges up to some tenths of a millimetre."""
    rng = np.random.default_rng(seed)
    profile = load_profile("S1002")
    change = np.zeros(profile.y.size)
    for wave in (60.0, 25.0, 12.0):
        phase, size = rng.uniform(0, 2 * np.pi), rng.normal() * 1.5e-6 * wave
        change += size * np.sin(2e3 * np.pi * profile.y / wave + phase)
    fade = np.clip((profile.y + 0.045) / 0.015, 0.0, 1.0)  # the flange stays
    return Profile(f"worn {seed}", "wheel", profile.y, profile.z + fade * change)


def random_positions(n, seed):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        roll = rng.uniform(-0.010, 0.010)
        yaw = rng.choice([0.0, rng.uniform(-0.03, 0.03)])
        yield rng.uniform(-0.011, 0.009) + 0.46 * roll, roll, yaw


def test_heights_agree_with_a_search_over_the_whole_wheel_surface():
    table, rail = standard_table(), rail_points()
    errors = []
    for y, roll, yaw in random_positions(15, seed=1):
        height = lowest_gap(*WHEEL, *rail, y, roll, yaw, 0.46)[0]
        errors.append(evaluate(table, y, roll, yaw**2)[0][:, 0].min() - height)
    # g is fitted to the patch's energies: below first touch where a patch grows to one side only
    assert np.max(np.abs(errors)) < 40e-6
    assert np.median(np.abs(errors)) < 15e-6


@points("seed", range(3), always=(0,))
@pytest.mark.further
def test_heights_of_worn_profiles_agree_too(seed):
    wheel, rail = worn(seed), rail_points(inclination=0.05)
    table = build_contact_table(wheel, load_profile("60E1"), inclination=0.05, grid=FINE_YAW)
    errors = []
    for y, roll, yaw in random_positions(12, seed):
        height = lowest_gap(wheel.y, wheel.z, *rail, y, roll, yaw, 0.46)[0]
        errors.append(evaluate(table, y, roll, yaw**2)[0][:, 0].min() - height)
    assert np.max(np.abs(errors)) < 40e-6
    assert np.median(np.abs(errors)) < 15e-6


@points(("wheel", "rail"), [(None, "60E1"), (7, "benchmark"), (1, "60E1")], always=(0,))
def test_normal_force_is_the_gradient_of_one_potential_over_the_whole_table(wheel, rail):
    table = table_of(wheel, rail)
    step = np.diag([1e-8, 1e-8, 1e-8, 1e-9])
    for y, roll, yaw in random_positions(40, seed=5):
        w = yaw**2 + 1e-6
        z = evaluate(table, y, roll, w)[0][:, 0].min() + 70e-6
        at = np.array([y, z, roll, w])
        difference = np.array(
            [
                (potential(table, *(at + d)) - potential(table, *(at - d))) / (2 * d.max())
                for d in step
            ]
        )
        found = forces(table, *at)
        # cubic pieces: the difference quotient's own round-off and truncation
        assert difference == pytest.approx(found, rel=1e-4, abs=0.2)


def test_work_around_a_closed_path_through_root_and_flange_is_zero():
    table = standard_table()
    t = np.linspace(0.0, 2 * np.pi, 1001)
    y, roll = 0.0062 + 0.0010 * np.cos(t), 3e-4 * np.sin(2 * t)
    lowest = np.array([evaluate(table, a, b)[0][:, 0].min() for a, b in zip(y, roll, strict=True)])
    z = lowest + 60e-6 + 20e-6 * np.sin(t)
    f = np.array([forces(table, *point) for point in zip(y, z, roll, strict=True)])
    steps = np.diff(np.column_stack((y, z, roll)), axis=0)
    parts = 0.5 * (f[1:, :3] + f[:-1, :3]) * steps
    # the trapezoid's own error over 1000 steps, 8e-6
    assert abs(parts.sum()) < 1e-4 * np.abs(parts).sum()


@pytest.mark.parametrize("lateral", [0.0002, 0.0052, 0.0066])
def test_force_has_no_jump_where_the_contact_jumps(lateral):
    # through the jumps within the tread, to the root and to the flange, with the wheel pressed
    # down by the same amount: a quarter of the step gives a quarter of the change
    table = standard_table()

    def largest_change(step):
        y = np.arange(lateral - 3e-4, lateral + 3e-4, step)
        lowest = np.array([evaluate(table, a, 0.0)[0][:, 0].min() for a in y])
        f = [forces(table, a, b + 80e-6, 0.0)[:2] for a, b in zip(y, lowest, strict=True)]
        return np.abs(np.diff(f, axis=0)).max()

    assert largest_change(2.5e-6) == pytest.approx(0.25 * largest_change(1e-5), rel=0.1)


def hollow_wheel():
    profile = load_profile("S1002")
    depth = 1.5e-3 * np.exp(-(((1e3 * profile.y - 2.0) / 14.0) ** 2)) * (profile.y > -0.040)
    return Profile("hollow", "wheel", profile.y, profile.z - depth)


def conformal_rail():
    """60E1 worn by 0.25 mm to the shape of the wheel that stands 4 mm aside."""
    y, z = rail_points()
    shape = 1e-3 * s1002_height(1e3 * (y - 0.754))
    worn_z = np.maximum(z, shape + np.min(z - shape) + 0.25e-3)
    return Profile("conformal", "rail", y - 0.7533, worn_z, inclination=0.025)


@pytest.mark.parametrize("pair", ["hollow wheel", "conformal rail"])
def test_worn_and_conformal_pairs_have_forces_without_jumps(pair):
    wheel = hollow_wheel() if pair == "hollow wheel" else load_profile("S1002")
    rail = load_profile("60E1") if pair == "hollow wheel" else conformal_rail()
    table = build_contact_table(wheel, rail, grid=ONE_YAW)
    assert np.all(np.isfinite(table.values))

    def largest_change(step):
        y = np.arange(3.5e-3, 4.6e-3, step)
        lowest = np.array([evaluate(table, a, 0.0)[0][:, 0].min() for a in y])
        f = [forces(table, a, b + 80e-6, 0.0)[:2] for a, b in zip(y, lowest, strict=True)]
        assert np.all(np.isfinite(f))
        return np.abs(np.diff(f, axis=0)).max()

    # tread and flange root touch at once here; half the step, half the change
    assert largest_change(5e-6) == pytest.approx(0.5 * largest_change(1e-5), rel=0.15)


@pytest.mark.parametrize(
    "degrees",
    [
        pytest.param(
            15.0,
            marks=[
                pytest.mark.xfail(
                    reason="a patch shared by tread and flange root is turned by up to 11 mrad",
                    strict=False,
                ),
                pytest.mark.further,
            ],
        ),
        30.0,
        45.0,
    ],
)
def test_patch_under_load_lies_on_the_common_normal_of_two_circles(degrees):
    # concave wheel on convex rail, both circles in the cross-section: the line through the
    # centres is the common normal, whatever the load
    R_wheel, R_rail = 0.035, 0.020
    y = 1e-3 * np.arange(-60.0, 60.01, 0.02)
    centre = -0.004  # of the wheel's circle; tread and flank go on along tangents
    sine = np.clip((y - centre) / R_wheel, -np.sin(np.radians(65)), -np.sin(np.radians(3)))
    slope = np.tan(np.arcsin(sine))
    z = np.concatenate(([0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(y))))
    wheel = Profile("arcs", "wheel", y, z - np.interp(0.0, y, z))
    angle = np.linspace(-1.45, 1.45, 20_001)
    rail = Profile("round", "rail", R_rail * np.sin(angle), R_rail * (1 - np.cos(angle)))
    face = R_rail * np.sin(np.arccos(1 - 0.014 / R_rail))
    offset = R_wheel - R_rail
    theta = np.radians(degrees)
    shift = 0.7175 + face - 0.75 - centre + offset * np.sin(theta)

    grid = TableGrid(s_min=shift - 2e-3, s_max=shift + 2e-3, roll_max=0.003, n_w=2)
    table = build_contact_table(wheel, rail, inclination=0.0, grid=grid)
    patches = {
        load: max(loaded_contact(table, shift, 0.0, load).patches, key=lambda patch: patch.N)
        for load in (14e3, 110e3)
    }
    for patch in patches.values():
        # Hertz' approach on the ellipse of rolling radius and relative curvature
        ellipse = hertz(
            0.5 * np.cos(theta) / 0.46, 0.5 / R_rail - 0.5 / R_wheel, patch.N, 2 * 82e9 * 1.28, 0.28
        )
        assert 2.0 / 3.0 * patch.p_max * patch.area == pytest.approx(patch.N)  # half an ellipsoid
        loaded = np.arcsin(offset * np.sin(theta) / (offset + ellipse.approach))
        # turned from the angle of first touch as far as the line of centres, to a fifth of it
        assert patch.angle - theta == pytest.approx(loaded - theta, rel=0.2, abs=1.3e-3)
    assert patches[110e3].angle < patches[14e3].angle < theta + 1e-4


def test_flange_contact_has_the_flanks_angle_under_load():
    for y in (0.0070, 0.0075):
        fields = evaluate(standard_table(), y, 0.0)[0]
        for load in (10e3, 60e3, 120e3):
            angle = np.degrees(np.arctan(under_load(fields, load)[2, 3]))
            assert angle == pytest.approx(70.0, abs=0.6)


def test_landmarks_of_the_zones():
    # with the roll that both wheels allow: PHYSICS.md, section 6
    table = standard_table()
    roll = {0.0045: -0.29e-3, 0.0056: -0.49e-3, 0.0067: -5.3e-3}
    patches = [int(np.argmin(evaluate(table, y, angle)[0][:, 0])) for y, angle in roll.items()]
    assert patches == [0, 1, 2]


def test_zones_share_a_contact_on_their_border_instead_of_counting_it_twice():
    # a cone without flange root in contact: moving the wheel so that the contact crosses the
    # border of two zones must leave the vertical force nearly constant
    y = 1e-3 * np.arange(-60.0, 60.01, 0.05)
    angle = np.radians(np.where(y < 0, np.minimum(-1.0 * 1e3 * y, 70.0), 0.0))
    slope = -np.tan(np.clip(angle, 0, np.radians(70)))
    z = np.concatenate(([0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(y))))
    z -= np.interp(0.0, y, z)
    arc = Profile("arc", "wheel", y, z)
    rail_angle = np.linspace(-1.45, 1.45, 4001)
    rail = Profile("round rail", "rail", 0.02 * np.sin(rail_angle), 0.02 * (1 - np.cos(rail_angle)))
    table = build_contact_table(
        arc,
        rail,
        gauge=1.42,
        inclination=0.0,
        grid=TableGrid(s_min=-0.02, s_max=0.0, roll_max=0.003, n_w=2),
    )
    nodes = table.y0 + table.dy * np.arange(table.values.shape[3])
    assert (nodes[0], nodes[-1]) == pytest.approx((-0.02, 0.0), abs=1e-12)
    positions = np.arange(-0.018, -0.005, 1e-4)
    totals, shares = [], []
    for position in positions:
        fields = evaluate(table, position, 0.0)[0]
        p = np.maximum(fields[:, 0].min() + 60e-6 - fields[:, 0], 0.0)
        tangent = under_load(fields, 60e3)[:, 3]
        vertical = (fields[:, 1] * p**1.5 + fields[:, 2] * p**2) * np.hypot(1.0, tangent) ** 2.5
        totals.append(vertical.sum())
        shares.append(vertical.max() / vertical.sum())
    assert min(shares) < 0.7  # a border was crossed
    assert np.max(totals) < 1.25 * np.min(totals)


def test_ellipses_are_those_of_hertz_where_curvatures_are_constant():
    y = 1e-3 * np.arange(-50.0, 60.01, 0.05)
    z = np.where(y > -0.04, -y / 40, 0.04 / 40 - 2.7 * (y + 0.04))
    cone = Profile("cone", "wheel", y, z)
    angle = np.linspace(-1.45, 1.45, 4001)
    rail = Profile("round rail", "rail", 0.05 * np.sin(angle), 0.05 * (1 - np.cos(angle)))
    table = build_contact_table(cone, rail, inclination=0.0, grid=ONE_YAW)
    fields = evaluate(table, 0.0, 0.0)[0][0]
    G, nu, N = 82e9, 0.28, 60e3
    cosine = np.cos(np.arctan(1 / 40))
    exact = hertz(0.5 * cosine / fields[5], 10.0, N, 2 * G * (1 + nu), nu)
    assert fields[3] * N ** (1 / 3) == pytest.approx(exact.a, rel=2e-3)
    assert under_load(fields[None], N)[0, 2] * N ** (1 / 3) == pytest.approx(exact.b, rel=2e-3)
    p = (N / (fields[1] + 8e-3 * fields[2])) ** (2 / 3)
    assert p * cosine == pytest.approx(exact.approach, rel=2e-3)


def test_every_value_of_the_table_is_finite_with_positive_stiffness_and_axes():
    for table in (standard_table(), table_of(7, "benchmark")):
        assert np.all(np.isfinite(table.values))
        assert np.all(table.values[..., [3, 6]] >= 0.0)
        assert table.values[..., 1].min() > -1e-6 * table.values[..., 1].max()
        # up to 0.3 mm of penetration
        assert np.all(table.values[..., 1] + 0.017 * table.values[..., 2] >= -1e3)


def test_stored_table_is_the_built_one_and_any_input_makes_another(tmp_path, monkeypatch):
    monkeypatch.setenv("RAILSIM_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("railsim.kernels.cache.notices", {})
    wheel, rail = load_profile("S1002"), load_profile("60E1")
    grid = TableGrid(ds=1e-3, droll=3e-3, n_w=2)
    built = build_contact_table(wheel, rail, grid=grid)
    first = cached_contact_table(wheel, rail, grid=grid)
    again = cached_contact_table(wheel, rail, grid=grid)
    np.testing.assert_array_equal(first.values, built.values)
    np.testing.assert_array_equal(again.values, built.values)
    assert again.shear == built.shear
    assert again.description == built.description
    files = set(tmp_path.rglob("*.npy"))
    assert len(files) == 1
    cached_contact_table(wheel, rail, gauge=1.436, grid=grid)
    assert len(set(tmp_path.rglob("*.npy"))) == 2
    assert not list(tmp_path.rglob("*.part"))
    # a damaged file is built anew
    for file in files:
        file.write_bytes(b"not an array")
    mended = cached_contact_table(wheel, rail, grid=grid)
    np.testing.assert_array_equal(mended.values, built.values)


def test_flipped_bit_in_a_stored_table_is_found(tmp_path, monkeypatch):
    monkeypatch.setenv("RAILSIM_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("railsim.kernels.cache.notices", {})
    wheel, rail = load_profile("S1002"), load_profile("60E1")
    grid = TableGrid(ds=1e-3, droll=3e-3, n_w=2)
    built = cached_contact_table(wheel, rail, grid=grid).values.copy()
    for _ in range(2):  # checked in full, and known to be
        cached_contact_table(wheel, rail, grid=grid)
    (file,) = tmp_path.rglob("*.npy")
    assert file.with_suffix(".checked").exists()
    with open(file, "r+b") as stored:
        stored.seek(4711)
        (byte,) = stored.read(1)
        stored.seek(4711)
        stored.write(bytes([byte ^ 4]))
    np.testing.assert_array_equal(cached_contact_table(wheel, rail, grid=grid).values, built)
