"""Built-in profiles and profile files: what is recognised, put right and refused."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from profile_files import bare, csv_m, csv_mm, miniprof, points, simpack

from railsim.contact import build_contact_table, contact_geometry
from railsim.contact.table import TableGrid
from railsim.errors import InputError
from railsim.profiles import Profile, load_profile, recognition
from railsim.profiles.builtin import DEFINITIONS, RAIL_HEADS, S1002_SECTIONS, cone

WHEEL, RAIL = points("S1002"), points("60E1")
LATERAL = np.linspace(-0.005, 0.005, 21)


def written(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def same_contact(profile, builtin):
    """Largest difference of the rolling radius difference to the built-in profile's [m]."""
    partner = load_profile("60E1" if profile.kind == "wheel" else "S1002")

    def delta_r(p):
        pair = (p, partner) if p.kind == "wheel" else (partner, p)
        return contact_geometry(*pair, lateral=LATERAL).delta_r

    return np.max(np.abs(delta_r(profile) - delta_r(load_profile(builtin))))


@pytest.mark.parametrize(
    ("name", "half_width", "depth"),
    [("60E1", 36.0, 14.3), ("60E2", 36.0, 14.3), ("54E1", 35.0, 14.1), ("49E1", 33.5, 14.0)],
)
def test_arcs_of_a_rail_close_on_the_standards_head(name, half_width, depth):
    # EN 13674-1 gives the head's width in round numbers; the arcs were not made from it.
    # Their joints are printed to 0.001 mm.
    half_widths, radii, flank = RAIL_HEADS[name]
    centre, angle = np.array([0.0, radii[0]]), 0.0
    for i, half in enumerate(half_widths):
        angle = np.arcsin((half - centre[0]) / radii[i])
        centre = centre + (radii[i] - radii[i + 1]) * np.array([np.sin(angle), -np.cos(angle)])
    end = np.arctan2(1.0, flank)
    closing = centre + radii[-1] * np.array([np.sin(end), -np.cos(end)])
    assert closing == pytest.approx([half_width, depth], abs=5e-4)
    profile = load_profile(name)
    assert 1e3 * np.interp(1e-3 * depth, profile.z[profile.y > 0], profile.y[profile.y > 0]) == (
        pytest.approx(half_width, abs=2e-3)
    )


@pytest.mark.parametrize(("inner", "outer"), list(pairwise(S1002_SECTIONS)))
def test_sections_of_s1002_join_at_their_ends_in_height_and_slope(inner, outer):
    (end, one), (_, other) = S1002_SECTIONS[inner], S1002_SECTIONS[outer]
    y = end + 1e-4 * np.arange(-1, 2)
    assert one(y)[1] == pytest.approx(other(y)[1], abs=1.3e-4)  # mm; the standard's own steps
    assert np.ptp(one(y)[::2]) == pytest.approx(np.ptp(other(y)[::2]), rel=2e-5)


@pytest.mark.parametrize("name", DEFINITIONS)
def test_built_in_profile_is_smooth_and_usable(name):
    profile = load_profile(name)
    assert profile.source
    assert np.all(np.diff(profile.y) > 0) or profile.inclination
    # 0.05 mm along the contour
    assert np.hypot(np.diff(profile.y), np.diff(profile.z)).max() < 6e-5
    turn = np.abs(np.diff(np.arctan2(np.diff(profile.z), np.diff(profile.y))))
    assert np.max(turn[:-20]) < 0.01 or profile.kind == "wheel"
    pair = (
        (profile, load_profile("60E1"))
        if profile.kind == "wheel"
        else (load_profile("S1002"), profile)
    )
    table = build_contact_table(*pair, grid=TableGrid(ds=1e-3, droll=5e-3, n_w=2))
    assert np.all(np.isfinite(table.values))


@pytest.mark.parametrize(("name", "taper"), [("cone_1in20", 1 / 20), ("cone_1in40", 1 / 40)])
def test_cone_on_a_rail_has_wickens_conicity(name, taper):
    # Wickens (2003), Fundamentals of rail vehicle dynamics, eq. 2.14: for a cone on a circular
    # rail head the contact moves on the rail only through roll
    geometry = contact_geometry(load_profile(name), load_profile("60E1"), lateral=LATERAL)
    angle = np.arctan(taper)
    b, R, r = 0.75, 0.300, 0.46
    expected = taper * (b + R * np.sin(angle)) / (b - r * np.sin(angle))
    found = np.polyfit(geometry.lateral, geometry.delta_r, 1)[0] / 2
    # the contact's distance from the track's centre differs from b by a few millimetres
    assert found == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("taper", [0.001, 0.05, 0.24, 0.25, 0.3125, 0.5])
def test_fillet_of_a_cone_is_tangent_to_cone_and_flange(taper):
    """No sharper curve than its 13 mm from the flange to the tread, also of steep cones."""
    profile = cone(taper)
    steps = np.diff(profile.y), np.diff(profile.z)
    turn = np.diff(np.unwrap(np.arctan2(steps[1], steps[0]))) / np.hypot(*steps)[1:]
    there = (profile.y[1:-1] > -47e-3) & (profile.y[1:-1] < 50e-3)
    assert np.max(np.abs(turn[there])) == pytest.approx(1.0 / 13e-3, rel=1e-5)
    assert float(profile.name.removeprefix("cone 1:")) == pytest.approx(1.0 / taper, rel=2e-3)
    assert "e" not in profile.name.removeprefix("cone")


@pytest.mark.parametrize(
    ("suffix", "writer"),
    [(".csv", csv_mm), (".csv", csv_m), (".txt", bare), ("", simpack), ("", miniprof)],
)
@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_file_of_each_format_gives_the_profile_it_was_made_of(tmp_path, suffix, writer, kind):
    own = {simpack: {"wheel": ".prw", "rail": ".prr"}, miniprof: {"wheel": ".whl", "rail": ".ban"}}
    suffix = suffix or own[writer][kind]
    text = writer(*(WHEEL if kind == "wheel" else RAIL), kind=kind)
    profile = load_profile(written(tmp_path, "p" + suffix, text), kind)
    assert profile.kind == kind
    # points every 0.2 mm, printed to 1e-6 mm, by MiniProf to 1e-4 mm: slopes within 5e-4
    print_error = 1e-5 if writer is miniprof else 1.5e-6
    assert same_contact(profile, "S1002" if kind == "wheel" else "60E1") < print_error


@pytest.mark.parametrize(
    ("suffix", "head", "separator", "comma"),
    [
        (".txt", "", "  ", ","),
        (".txt", "", "\t", ","),
        (".csv", "y_mm;z_mm\n", "; ", ","),
        (".txt", "", " , ", "."),
        (".whl", "Filename=x\nColumnDef=X,Y\n\n", ";", ","),
        (".whl", "Filename=x\nColumnDef=X,Y\n\n", " ", ","),
        (".whl", "Filename=x\nColumnDef=X,Y\n\n", ";", "."),
        (".whl", "Filename=x\nColumnDef=X,Y\n\n", ",", "."),
    ],
)
def test_decimal_commas_and_separators_of_measuring_devices(
    tmp_path, suffix, head, separator, comma
):
    rows = (f"{a:.6f}\0{b:.6f}\n".replace(".", comma) for a, b in zip(*WHEEL, strict=True))
    text = head + "".join(rows).replace("\0", separator)
    profile = load_profile(written(tmp_path, "wheel" + suffix, text), "wheel")
    assert same_contact(profile, "S1002") < 1.5e-6


def changed_wheel(how):
    y, z = WHEEL
    rng = np.random.default_rng(1)
    back = y - y.min()
    return {
        "mirrored": (-y, z),
        "upside down": (y, -z),
        "turned by 180 degrees": (-y, -z),
        "reversed": (y[::-1], z[::-1]),
        "shuffled": tuple(np.array([y, z])[:, rng.permutation(y.size)]),
        "double points": (np.repeat(y, 2), np.repeat(z, 2)),
        "origin at the flange back": (back, z),
        "origin at the flange back, z up": (back, -z),
        "z from the flange tip": (y, z - z.max()),
        "one outlier": (y, z + 5.0 * (np.arange(y.size) == 400)),
    }[how]


@pytest.mark.parametrize(
    ("how", "note"),
    [
        ("mirrored", "mirrored"),
        ("upside down", "z pointed to the axle"),
        ("turned by 180 degrees", "mirrored"),
        ("reversed", None),
        ("shuffled", "not in order"),
        ("double points", "double points"),
        ("origin at the flange back", "nominal rolling circle, 70 mm from the flange back"),
        ("origin at the flange back, z up", "nominal rolling circle"),
        ("z from the flange tip", "zero at the nominal rolling circle"),
        ("one outlier", "outliers left out"),
    ],
)
def test_wheel_is_put_right_and_the_note_says_so(tmp_path, how, note):
    path = written(tmp_path, "wheel.csv", csv_mm(*changed_wheel(how)))
    profile = load_profile(path, "wheel")
    assert note is None or any(note in line for line in profile.notes), profile.notes
    # sorting by y confuses the nearly vertical flange back, nothing that touches the rail
    assert same_contact(profile, "S1002") < (5e-6 if how == "one outlier" else 1.5e-6)


@pytest.mark.parametrize("height", [0.05, -0.1, 0.25])  # mm
@pytest.mark.parametrize(("name", "at"), [("S1002", 400), ("60E1", 200)])
def test_outlier_far_beyond_the_noise_is_left_out(tmp_path, name, at, height):
    y, z = points(name)
    z[at] += height
    profile = load_profile(written(tmp_path, "p.csv", csv_mm(y, z)))
    assert f"1 outliers left out (line {at + 2})" in profile.notes
    assert same_contact(profile, name) < 5e-6


@pytest.mark.parametrize("find", [recognition._spike, recognition._small_outlier])
def test_an_outlier_is_the_same_wherever_a_profile_stands(find):
    """Moved, mirrored, upside down and on end."""
    y, z = (1e-3 * x for x in points("S1002"))
    z[400] += 3e-3 if find is recognition._spike else 2.5e-4
    for turned in ((y, z), (y + 0.4, z + 0.3), (y - 0.4, z - 0.3), (-y, z), (y, -z), (z, y)):
        assert find(*turned) == 400
    assert find(y[::-1], z[::-1]) == len(y) - 401


def test_points_far_apart_show_no_small_outlier():
    """Four steps of 1.2 mm are no longer a neighbourhood, along a tread as along a face."""
    y, z = (1e-3 * x[::6].copy() for x in points("S1002"))
    z[66] += 1e-3
    assert recognition._small_outlier(y, z) is recognition._small_outlier(z, y) is None


def test_edges_of_worn_rails_are_no_outliers(tmp_path):
    path = written(tmp_path, "rail.csv", csv_mm(*side_cut(6.0, 0.0)))
    assert not any("outlier" in note for note in load_profile(path, "rail").notes)


@pytest.mark.parametrize("shift", [-5.0, 1.0, 5.0])
def test_origin_is_told_by_the_flange_back_wherever_the_flange_lies(tmp_path, shift):
    y, z = WHEEL
    profile = load_profile(written(tmp_path, "wheel.csv", csv_mm(y + shift, z)), "wheel")
    assert any(f"origin moved by {-shift:.2f} mm" in line for line in profile.notes)
    assert same_contact(profile, "S1002") < 1.5e-6


def test_wheel_cut_off_before_the_flange_back_keeps_its_origin(tmp_path):
    y, z = (values[WHEEL[0] > -66.0] for values in WHEEL)
    profile = load_profile(written(tmp_path, "wheel.csv", csv_mm(y, z)), "wheel")
    assert not profile.notes
    assert same_contact(profile, "S1002") < 1.5e-6


def test_shift_to_the_rolling_circle_is_told_as_it_is_where_points_run_back(tmp_path):
    # points 0.05 mm apart with noise of 20 um are no function of y
    y, z = points("S1002", every=1)
    noise = np.random.default_rng(3).normal(0.0, 0.02, (2, y.size))
    path = written(tmp_path, "wheel.csv", csv_mm(y + noise[0], z + 4.0 + noise[1]))
    told = [note for note in load_profile(path, "wheel").notes if note.startswith("z moved")]
    assert [float(note.split()[3]) for note in told] == [pytest.approx(-4.0, abs=0.01)]


def test_points_that_nearly_coincide_do_not_make_a_slope_of_their_rounding(tmp_path):
    y, z = WHEEL
    y, z = np.insert(y, 500, y[499] + 1e-4), np.insert(z, 500, z[499] + 1e-4)
    profile = load_profile(written(tmp_path, "wheel.csv", csv_mm(y, z)), "wheel")
    assert any("double points" in note for note in profile.notes)
    assert same_contact(profile, "S1002") < 1.5e-6


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_units_are_told_by_the_size_when_the_header_is_wrong(tmp_path, scale):
    y, z = WHEEL
    rows = "".join(f"{a * scale:.9f},{b * scale:.9f}\n" for a, b in zip(y, z, strict=True))
    header = "y,z\n" if scale == 1.0 else "y_mm,z_mm\n"
    profile = load_profile(written(tmp_path, "wheel.csv", header + rows), "wheel")
    assert any("its width says" in line for line in profile.notes)
    assert same_contact(profile, "S1002") < 1.5e-6


@pytest.mark.parametrize("inclination", [1 / 20, 1 / 30, 1 / 40])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_inclined_rail_is_recognised_and_not_inclined_twice(tmp_path, inclination, side):
    y, z = RAIL
    angle = np.arctan(inclination)
    turned = y * np.cos(angle) + z * np.sin(angle), z * np.cos(angle) - y * np.sin(angle)
    path = written(tmp_path, "rail.csv", csv_mm(side * turned[0], turned[1]))
    profile = load_profile(path, "rail")
    assert profile.inclination == pytest.approx(inclination, abs=1e-12)
    (note,) = [line for line in profile.notes if "already inclined" in line]
    assert note.endswith(f"1:{1.0 / inclination:.0f}; that of the track counts")
    assert same_contact(profile, "60E1") < 1.5e-6


@pytest.mark.parametrize("seed", range(4))
def test_upright_rail_stays_as_it_was_measured_whatever_the_noise(tmp_path, seed):
    y, z = RAIL
    noise = np.random.default_rng(seed).normal(0.0, 0.01, y.size)
    profile = load_profile(written(tmp_path, "rail.csv", csv_mm(y, z + noise)), "rail")
    assert profile.inclination == 0.0
    assert not any("mirrored" in line for line in profile.notes)


def side_cut(depth, slope, side=1.0, inclination=0.0):
    """60E1 with side wear: its depth [mm] 14 mm below the top, the face's slope to the vertical."""
    y, z = RAIL
    y = np.where((y < 0.0) & (z > 0.5), np.maximum(y, depth - 36.0 - slope * (z - 14.0)), y)
    angle = np.arctan(inclination)
    return (side * (y * np.cos(angle) + z * np.sin(angle)), z * np.cos(angle) - y * np.sin(angle))


@pytest.mark.parametrize(
    ("depth", "slope"), [(2.0, 1e-3), (4.0, 0.07), (4.0, 0.1), (8.0, 0.25), (12.0, 0.3)]
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_side_wear_of_an_upright_rail_is_not_taken_for_an_inclination(tmp_path, depth, slope, side):
    path = written(tmp_path, "rail.csv", csv_mm(*side_cut(depth, slope, side)))
    profile = load_profile(path, "rail")
    assert profile.inclination == 0.0
    assert any("is worn: the gauge side is taken at negative y" in note for note in profile.notes)
    assert not any("mirrored" in note for note in profile.notes)


def test_inclination_between_parallel_flanks_is_recognised_on_a_worn_head(tmp_path):
    path = written(tmp_path, "rail.csv", csv_mm(*side_cut(3.0, 0.05, -1.0, 1 / 40)))
    profile = load_profile(path, "rail")
    assert profile.inclination == pytest.approx(1 / 40, abs=1e-12)


@pytest.mark.parametrize("slope", [0.05, 0.0, -0.1])  # of the face; the last one overhangs
def test_vertical_and_overhanging_faces_of_rails_are_told(tmp_path, slope):
    path = written(tmp_path, "rail.csv", csv_mm(*side_cut(6.0, slope)))
    notes = load_profile(path, "rail").notes
    assert any("gauge face vertical or nearly so from" in note for note in notes), notes


def test_overhang_of_the_crown_is_refused_with_its_line(tmp_path):
    y, z = RAIL
    y = np.where(np.abs(y - 3.0) < 1.0, y - 1.0, y)
    with pytest.raises(InputError, match=r"line \d+: .* runs back"):
        load_profile(written(tmp_path, "rail.csv", csv_mm(y, z)), "rail")


@pytest.mark.parametrize(
    ("contour", "end", "told"), [(WHEEL, 35.0, True), (WHEEL, 45.0, False), (RAIL, 10.0, True)]
)
def test_field_side_that_ends_where_contact_may_lie_is_told(tmp_path, contour, end, told):
    part = contour[0] < end
    path = written(tmp_path, "p.csv", csv_mm(contour[0][part], contour[1][part]))
    notes = load_profile(path, "wheel" if contour is WHEEL else "rail").notes
    assert any(note.startswith("field side ends at y") for note in notes) == told


def test_rail_measured_on_the_gauge_side_only_is_turned_to_it(tmp_path):
    y, z = RAIL
    part = (y > -20.0) & (z < 20.0)  # crown and right flank, here the gauge side
    profile = load_profile(written(tmp_path, "rail.csv", csv_mm(y[part], -z[part])), "rail")
    assert any("deeper side" in line for line in profile.notes)
    assert any("taken as upright" in line for line in profile.notes)
    assert same_contact(profile, "60E1") < 1.5e-6


def test_simpack_file_is_processed_in_its_own_order(tmp_path):
    y, z = WHEEL
    turned = np.radians(3.0)
    there = y * np.cos(turned) + z * np.sin(turned), -y * np.sin(turned) + z * np.cos(turned)
    keys = {
        "shift.y": -2.0,
        "shift.z": 1.0,
        "rotate": 3.0,
        "units.ang.f": 57.29577951308232,
        "mirror.y": 1,
        "inversion": 1,
    }
    text = simpack(there[0] + 2.0, there[1] - 1.0, **keys)
    profile = load_profile(written(tmp_path, "p.prw", text), "wheel")
    assert any("rotated" in line for line in profile.notes)
    assert same_contact(profile, "S1002") < 2e-6


def test_a_path_is_kept_as_text(tmp_path):
    path = tmp_path / "wheel.csv"
    path.write_text(csv_mm(*WHEEL), encoding="utf-8")
    assert load_profile(path, "wheel").source == str(path)
    path.write_text("y,z\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_profile(path, "wheel")
    assert caught.value.faults[0].file == str(path)


@pytest.mark.parametrize("key", ["units.ang.f", "units.len.f"])
@pytest.mark.parametrize("factor", [0, -1])
def test_simpack_units_that_scale_nothing_are_refused(tmp_path, key, factor):
    path = written(tmp_path, "p.prw", simpack(*WHEEL, **{key: factor}))
    with pytest.raises(InputError, match=f"{key}: {factor}; units per"):
        load_profile(path, "wheel")


@pytest.mark.parametrize("noise", [2e-3, 10e-3])
def test_measuring_noise_is_smoothed_and_the_effect_is_told(tmp_path, noise):
    rng = np.random.default_rng(3)
    y, z = WHEEL
    text = csv_mm(y + noise * rng.normal(size=y.size), z + noise * rng.normal(size=y.size))
    profile = load_profile(written(tmp_path, "wheel.csv", text), "wheel")
    note = next(line for line in profile.notes if "smoothed" in line)
    assert "um rms" in note
    told = float(note.partition("noise of ")[2].partition(" um")[0])
    assert told == pytest.approx(1e3 * noise, rel=0.3)  # of that along the contour little is seen
    # a contact angle's noise after smoothing moves the contact by some tenths of a millimetre
    geometry = contact_geometry(profile, load_profile("60E1"))
    exact = contact_geometry(load_profile("S1002"), load_profile("60E1"))
    found = geometry.equivalent_conicity([0.003])[0]
    assert found == pytest.approx(exact.equivalent_conicity([0.003])[0], abs=0.01)


@pytest.mark.parametrize("size", [0.005, 0.02])  # mm
@pytest.mark.parametrize("name", ["S1002", "60E1"])
def test_noise_that_is_told_is_that_of_the_points(tmp_path, name, size):
    y, z = points(name)
    noise = np.random.default_rng(11).normal(0.0, size, (2, y.size))
    profile = load_profile(written(tmp_path, "p.csv", csv_mm(y + noise[0], z + noise[1])))
    told = next(float(note.split()[2]) for note in profile.notes if note.startswith("noise of"))
    assert told == pytest.approx(1e3 * size, rel=0.12)


def test_a_wheel_hollow_beside_its_rolling_circle_is_zero_on_it(tmp_path):
    """Its lowest point near the circle lies 5 mm outside of it, and not inside as on others."""
    y, z = WHEEL
    hollow = z + 0.1 * y * np.exp(-((y / 10.0) ** 2))
    profile = load_profile(written(tmp_path, "w.csv", csv_mm(y, hollow + 3.0)), "wheel")
    tread = np.abs(profile.y) < 0.02
    assert np.interp(0.0, profile.y[tread], profile.z[tread]) == pytest.approx(0.0, abs=1e-6)


def test_clean_points_are_not_smoothed(tmp_path):
    profile = load_profile(written(tmp_path, "w.csv", csv_mm(*WHEEL)), "wheel")
    assert not any("smoothed" in line for line in profile.notes)


def refused(tmp_path, text, kind="wheel", name="profile.csv"):
    path = written(tmp_path, name, text)
    with pytest.raises(InputError) as caught:
        load_profile(path, kind)
    (fault,) = caught.value.faults
    assert fault.file == path
    assert fault.allowed, "no remedy"
    return fault


def test_hole_is_refused_with_its_line(tmp_path):
    y, z = WHEEL
    keep = (y < 5.0) | (y > 15.0)
    fault = refused(tmp_path, csv_mm(y[keep], z[keep]))
    assert "hole of 10" in fault.found
    assert fault.key == f"line {int(np.argmax(y[keep] > 15.0)) + 1}"


def test_vertical_step_is_refused_with_its_line(tmp_path):
    y, z = WHEEL
    fault = refused(tmp_path, csv_mm(y, z + 1.5 * (y > 10.0)))
    assert "vertical step of 1.5" in fault.found
    assert fault.key == f"line {int(np.argmax(y > 10.0)) + 1}"


def test_two_points_are_refused(tmp_path):
    assert "2 points" in refused(tmp_path, "y_mm,z_mm\n0,0\n100,-3\n").found


def test_letters_are_refused_with_their_line(tmp_path):
    lines = csv_mm(*WHEEL).split("\n")
    lines[99] = "12.0,abc"
    fault = refused(tmp_path, "\n".join(lines))
    assert fault.key == "line 100"
    assert "abc" in fault.found


def test_decimal_commas_between_commas_are_refused_with_the_remedy(tmp_path):
    rows = [f"{a:.3f},{b:.3f}".replace(".", ",") for a, b in zip(*WHEEL, strict=True)]
    fault = refused(tmp_path, "\n".join(rows))
    assert (fault.key, "semicolons" in fault.allowed) == ("line 1", True)


@pytest.mark.parametrize("columns", ["Y,A", "X,A", "A,N"])
def test_miniprof_without_both_coordinates_is_refused_with_the_columns(tmp_path, columns):
    text = miniprof(*WHEEL).replace("ColumnDef=X,Y,A", f"ColumnDef={columns}")
    fault = refused(tmp_path, text, name="profile.whl")
    assert fault.found == f"ColumnDef={columns}"


def test_letters_between_the_points_of_miniprof_are_refused_with_their_line(tmp_path):
    path = written(tmp_path, "wheel.whl", miniprof(*WHEEL).replace("\n-5", "\nx-5"))
    with pytest.raises(InputError, match=r"line \d+: not a pair of numbers: 'x-5"):
        load_profile(path, "wheel")


def test_rail_given_as_wheel_and_wheel_given_as_rail_are_refused(tmp_path):
    assert "looks like a rail" in refused(tmp_path, csv_mm(*RAIL), "wheel").found
    assert "like a wheel's flange" in refused(tmp_path, csv_mm(*WHEEL), "rail").found
    text = simpack(*RAIL, kind="rail")
    assert "rail profile" in refused(tmp_path, text, "wheel", "x.prr").found


@pytest.mark.parametrize(
    ("writer", "suffix", "words"),
    [(simpack, ".prw", "no point.end"), (miniprof, ".whl", "the header announces")],
)
def test_a_file_that_was_cut_off_is_refused(tmp_path, writer, suffix, words):
    """The field side is missing: what is left would pass for a narrow wheel."""
    text = writer(*WHEEL, kind="wheel")
    cut = "\n".join(text.split("\n")[:-30])
    load_profile(written(tmp_path, "whole" + suffix, text), "wheel")
    assert words in refused(tmp_path, cut, "wheel", "cut" + suffix).found


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "0 points"),
        ("a,b\n1,2\n", "unknown columns"),
        ("y_mm,z_mm\n1\n", "columns"),
        ("y_mm,z_mm\n-70,0,9,5\n-69,5,9,4\n", "4 values under 2 names"),
        ("\x00\x01", "not a text file"),
    ],
)
def test_what_is_no_profile_is_refused(tmp_path, text, words):
    assert words in refused(tmp_path, text).found


def test_unknown_names_suffixes_and_missing_files_are_refused(tmp_path):
    for name, words in (
        ("S1003", "did you mean 'S1002'"),
        ("none.csv", "cannot be read"),
        ("60E1", "rail profile"),
        (str(tmp_path), "no such profile"),
    ):
        with pytest.raises(InputError, match=words):
            load_profile(name, "wheel")
    with pytest.raises(InputError, match="unknown kind of file"):
        load_profile(written(tmp_path, "p.xyz", "1 2"), "wheel")


def test_profiles_compare_by_their_points():
    one, other = load_profile("S1002"), load_profile("60E1")
    assert one == Profile("S1002", "wheel", one.y.copy(), one.z.copy())
    assert one != other
    assert hash(one) == hash(Profile("S1002", "wheel", one.y, one.z))
    with pytest.raises(ValueError, match="read-only"):
        one.y[0] = 0.0


def test_a_profile_may_be_given_as_a_path(tmp_path):
    assert load_profile(Path("S1002")) == load_profile("S1002")
    for missing in (tmp_path / "none", None):
        with pytest.raises(InputError, match="no such profile"):
            load_profile(missing)
