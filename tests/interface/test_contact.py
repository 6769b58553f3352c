"""``railsim contact``: the interface's names and signs, files, messages."""

import csv
import json
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from railsim import cli
from railsim.contact import contact_geometry
from railsim.contact.gauges import gauge_table, wheel_gauge
from railsim.contact.summary import PATCH_SHARES, ContactSummary, Pair
from railsim.contact.tables import (
    conicity_map_table,
    conicity_table,
    function_table,
    patch_table,
    printed_conicity,
    printed_functions,
)
from railsim.plot.contact import profiles_figure
from railsim.plot.creep import _components
from railsim.profiles import Profile, load_profile

NAMES = (
    "lateral",
    "delta_r",
    "rolling_radius_left",
    "rolling_radius_right",
    "contact_angle_left",
    "contact_angle_right",
    "contact_y_left",
    "contact_y_right",
    "wheel_y_left",
    "wheel_y_right",
    "roll",
)


def as_json(capsys, *arguments):
    assert cli.main(["contact", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_json_has_the_names_units_and_signs_of_the_interface(capsys):
    data = as_json(capsys, "--wheel", "S1002", "--rail", "60E1", "--max-shift", "0.008")
    lists = {name: np.array(data[name]) for name in NAMES}
    assert len({values.size for values in lists.values()}) == 1
    y = lists["lateral"]
    assert y[0] == pytest.approx(-0.008)
    assert y[-1] == pytest.approx(0.008)
    np.testing.assert_allclose(
        lists["delta_r"], lists["rolling_radius_right"] - lists["rolling_radius_left"], atol=1e-15
    )
    # shifted to the right: right wheel on its larger radius towards the flange, steeper there
    right = y > 0.001
    assert np.all(lists["delta_r"][right] > 0)
    assert np.all(lists["contact_angle_right"][right] > lists["contact_angle_left"][right])
    assert np.all(lists["contact_angle_left"] > 0)
    assert np.all(lists["contact_y_left"] < -0.7)
    assert np.all(lists["contact_y_right"] > 0.7)
    assert np.all(lists["wheel_y_right"][right] < 0)  # between nominal rolling circle and flange
    assert np.all(lists["roll"][right] < 0)  # the right side is lifted
    conicity = {row["amplitude"]: row["value"] for row in data["equivalent_conicity"]}
    assert conicity[0.003] == pytest.approx(0.177, abs=0.002)  # PHYSICS.md: about 0.18


def test_pictures_of_a_contact_name_the_inclination_of_the_rail():
    """The conicity of 1:20 and that of 1:40 had the same title."""
    profiles = load_profile("S1002"), load_profile("60E1")
    for inclination, words in ((0.025, "1:40"), (0.05, "1:20"), (0.0, "upright")):
        assert Pair(*profiles, 1.435, inclination, 1.36).words == f"S1002 on 60E1 {words}"


def test_picture_of_profiles_joins_points_of_wheels_and_rails():
    """Left and right mirror each other; every line ends on the contour of a wheel and a rail."""
    profiles = load_profile("S1002"), load_profile("60E1")
    pair, y = Pair(*profiles, 1.435, 0.025, 1.36), 1e-3 * np.arange(-6.0, 6.5)
    figure = profiles_figure(contact_geometry(*profiles, lateral=y), (pair, pair))
    (left, right) = ([line.get_xydata() for line in axes.lines] for axes in figure.axes)
    for one, other in zip(left[:2], right[:2], strict=True):
        np.testing.assert_allclose(one * [-1.0, 1.0], other, atol=1e-9)
    rail, wheel, *joined = right
    assert len(joined) == len(y)
    for ends in joined:
        for (at, height), contour in zip(ends, (wheel, rail), strict=True):
            near = contour[np.argsort(np.abs(contour[:, 0] - at))[:6]]
            assert near[:, 1].min() - 0.05 <= height <= near[:, 1].max() + 0.05
    assert np.all(np.ptp([ends[:, 0] for ends in joined], axis=1) < 8.0)


@pytest.mark.usefixtures("small_contact_tables")
def test_pictures_and_tables_are_written_and_kept(tmp_path, capsys):
    """Also those of a worn wheel over a new one, which exceeds its limits."""
    out = tmp_path / "contact"
    worn = ["S1002_hollow", "60E1", "--overlay", "S1002", "--gauges", "1.43:1.45:3"]
    arguments = ["contact", *worn, "--out", str(out)]
    out.mkdir()
    (out / "patches.csv").write_text("mine")
    assert cli.main(arguments) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert [path.name for path in out.iterdir()] == ["patches.csv"]
    assert cli.main([*arguments, "--overwrite"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Sd")]
    assert lines[0].split()[-1] == "fail"  # 33.1 mm: the tread is hollow, its flank measured lower
    names = {path.name for path in out.iterdir()}
    assert names == {
        "profiles.png", "functions.png", "conicity.png", "patches.png",
        "functions.csv", "conicity.csv", "patches.csv",
        "overlay.png", "conicity_over_gauge.png", "conicity_over_gauge.csv",
    }  # fmt: skip
    for name in names:
        if name.endswith(".png"):
            pixels = np.asarray(Image.open(out / name).convert("L"))
            assert pixels.std() > 5.0, f"{name} is empty"
    with (out / "functions.csv").open() as file:
        header = next(csv.reader(file))
    assert [cell.partition(" (")[0] for cell in header] == [*NAMES]
    units = {cell.partition(" (")[2] for cell in header}
    assert units == {"m)", "rad)"}


@pytest.mark.usefixtures("small_contact_tables")
def test_profiles_may_be_named_alone_and_have_gauge_values(capsys):
    data = as_json(capsys, "S1002", "60E1", "--gauges", "1.430,1.435,1.440")
    assert data == {
        **as_json(capsys, "--wheel", "S1002", "--rail", "60E1"),
        "gauges": [1.43, 1.435, 1.44],
        "conicity_over_gauge": data["conicity_over_gauge"],
    }
    values = {row["name"]: row for row in data["gauge_values"]}
    # EN 13715: flange 28 mm high and 32.5 mm thick, qR 10.8 mm; SR = 1360 + 2 32.5
    found = [1e3 * values[name]["value"] for name in ("Sh", "Sd", "qR", "AR", "SR", "play")]
    assert found == pytest.approx([28.0, 32.5, 10.79, 1360.0, 1425.0, 10.0], abs=0.02)
    assert {row["verdict"] for row in data["gauge_values"]} == {"pass", ""}
    # the same as at that gauge alone
    alone = [row["value"] for row in data["equivalent_conicity"]]
    assert data["conicity_over_gauge"][1] == pytest.approx(alone)
    at_3_mm = [row[5] for row in data["conicity_over_gauge"]]
    assert at_3_mm[0] > at_3_mm[1] > at_3_mm[2]  # more play, less conicity of this pair
    assert cli.main(["contact", "S1002", "60E1", "54E1"]) == 2


@pytest.mark.parametrize(
    ("diameter", "least"), [(0.92, 27.5), (0.80, 27.5), (0.76, 29.5), (0.65, 29.5), (0.63, 31.5)]
)
def test_least_flange_height_of_small_wheels(diameter, least):
    """EN 13715 makes flanges 28 mm high for wheels above 760 mm, 30 and 32 mm for smaller ones."""
    wheel = load_profile("S1002")
    first, *_ = gauge_table((wheel, wheel), diameter=diameter).records()
    assert first["name"] == "Sh"
    assert first["least"] == pytest.approx(1e-3 * least)
    assert first["verdict"] == ("pass" if diameter > 0.76 else "fail")


@pytest.mark.parametrize("z", [0.0, 2e-3, -0.46])
@pytest.mark.parametrize(("high", "slope", "thick"), [(0.028, 2.75, 0.032), (0.033, 1.5, 0.022)])
def test_gauge_of_a_flange_with_a_straight_flank(high, slope, thick, z):
    """qR = (Sh - 2 mm - 10 mm)/slope, wherever the profile's heights count from.

    Sd is taken 10 mm beyond the nominal rolling circle, from the back of the flange 70 mm off it.
    """
    at_10_mm = thick - 0.070
    y = [-0.070, -0.065, at_10_mm - (high - 0.010) / slope, at_10_mm + 0.010 / slope, 0.0, 0.06]
    wheel = Profile("made", "wheel", y, np.add([0.0, 0.9 * high, high, 0.0, 0.0, 0.0], z), "made")
    assert wheel_gauge(wheel) == pytest.approx((high, thick, (high - 0.012) / slope), abs=1e-9)


def test_gauge_values_that_fail_do_not_read_like_their_limits():
    """40 um beyond 33 mm and 1426 mm were "33.0" of 33.0 and "1426.0" of 1426.0, and failed."""
    wheel = load_profile("S1002")
    thicker = replace(wheel, y=np.where(wheel.y < -0.03, wheel.y + 0.00054, wheel.y))
    rows = {row[1]: row for row in gauge_table((thicker, thicker), back_to_back=1.35995).texts()}
    assert rows["flange thickness, left"][2:] == ["33.04", "22.0", "33.0", "fail"]
    assert rows["active faces"][2:] == ["1426.03", "1410.0", "1426.0", "fail"]


@pytest.mark.parametrize(("gauge", "verdict"), [(1.445, "fail"), (1.000, ""), (1.668, "")])
def test_distances_across_the_wheelset_have_limits_on_their_gauge_only(gauge, verdict):
    wheel = load_profile("S1002")
    table = gauge_table((wheel, wheel), back_to_back=gauge - 0.07, gauge=gauge)
    verdicts = {row["name"]: row["verdict"] for row in table.records()}
    assert [verdicts["AR"], verdicts["SR"]] == [verdict, verdict]
    assert verdicts["Sh"] == "pass"


def test_exact_patches_stand_beside_those_of_the_table(capsys, monkeypatch):
    """At every displacement; of the twelve of the command four, half a second each."""
    shares = (-0.6, 0.0, 0.4, 0.7)
    monkeypatch.setattr("railsim.contact.summary.PATCH_SHARES", shares)
    data = as_json(capsys, "--max-shift", "0.004", "--exact", "--load", "40000")
    for method in ("table", "exact"):
        rows = [row for row in data["patches"] if row["method"] == method]
        found = sorted({row["lateral"] for row in rows})
        assert found == pytest.approx([0.004 * share for share in shares])
        for y in found:
            load = sum(row["Q"] for row in rows if row["lateral"] == y)
            assert load == pytest.approx(40e3, rel=1e-3)


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.further
def test_left_and_right_may_differ(tmp_path, capsys):
    data = as_json(capsys, "--wheel", "cone_1in20", "--wheel", "cone_1in40")
    i = int(np.argmin(np.abs(np.array(data["lateral"]))))
    angles = data["contact_angle_left"][i], data["contact_angle_right"][i]
    # the wheelset rolls a little
    assert np.tan(angles) == pytest.approx([0.05, 0.025], abs=5e-4)
    data = as_json(capsys, "--radius", "0.460", "--radius", "0.461", "--wheel", "cone_1in40")
    assert data["delta_r"][i] == pytest.approx(0.001, abs=5e-5)


@pytest.mark.usefixtures("small_contact_tables")
def test_the_smaller_wheel_stands_for_steering_and_gauge_values(capsys):
    """Radius of the lateral contact 0.5 rad: e r0/R over the largest difference before it."""
    radii = 0.460, 0.455
    data = as_json(capsys, "S1002", "60E1", *(f"--radius={r}" for r in radii))
    y, angle = np.array(data["lateral"]), np.array(data["contact_angle_left"])
    before = (y <= 0.0) & (y > y[y <= 0.0][angle[y <= 0.0] > 0.5].max())
    i, middle = np.flatnonzero(before)[0], np.argmin(np.abs(y))
    apart = data["contact_y_right"][middle] - data["contact_y_left"][middle]
    index = data["steering_index"]
    assert index["value"] == pytest.approx(
        apart * min(radii) / index["radius"] / -data["delta_r"][i], rel=1e-6
    )


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.further
def test_what_was_put_right_in_a_file_is_told(tmp_path, capsys):
    profile = load_profile("S1002")
    path = tmp_path / "wheel.csv"
    rows = "".join(
        f"{-1e3 * y:.6f},{1e3 * z:.6f}\n" for y, z in zip(profile.y, profile.z, strict=True)
    )
    path.write_text("y_mm,z_mm\n" + rows)
    assert cli.main(["contact", "--wheel", str(path)]) == 0
    assert "mirrored" in capsys.readouterr().err
    assert cli.main(["contact", "--wheel", str(path), "--quiet"]) == 0
    assert "mirrored" not in capsys.readouterr().err
    assert any("mirrored" in note for note in as_json(capsys, "--wheel", str(path))["notes"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--wheel", "60E1"], "this is a rail profile"),
        (["--wheel", "S1003"], "did you mean 'S1002'"),
        (["--gauge", "1.6"], "falls between the rails"),
        (["--gauge", "1.4"], "flange"),
        (["--load", "-5"], "--load"),
        (["--max-shift", "5"], "--max-shift"),
        (["--radius", "46"], "--radius"),
        (["--gauge", "nan"], "--gauge"),
        (["--inclination", "1"], "--inclination"),
        (["--back-to-back", "1360"], "--back-to-back"),
        (["--wheel", "none.csv"], "cannot be read"),
        (["--overlay", "S1002"], "--overlay goes with --out"),
        (["--friction", "0.35"], "--friction goes with --creep"),
        (["--workers", "2"], "--workers goes with --build-creep-table"),
        (["S1002_hollow", "--wheel", "S1002"], "--wheel goes with no WHEEL"),
        (["--wheel", "S1002", "--wheel", "S1002", "--wheel", "S1002"], "given 3 times"),
    ],
)
def test_wrong_input_is_named_with_status_2(arguments, words, capsys):
    assert cli.main(["contact", *arguments]) == 2
    out, err = capsys.readouterr()
    assert words in err
    assert out == ""
    assert "Traceback" not in err


def test_help_shows_an_example(capsys):
    assert cli.main(["contact", "--help"]) == 0
    assert "railsim contact --wheel S1002" in capsys.readouterr().out


def test_creep_has_a_row_for_each_law_direction_and_size(capsys):
    rows = as_json(capsys, "--creep", "--friction", "0.35")["creep"]
    from railsim.contact.creep import LAWS

    assert {row["law"] for row in rows} == set(LAWS)
    creepages = {(row["case"], row["size"]) for row in rows}
    assert len(rows) == len(creepages) * len(LAWS)
    sizes = np.array([np.hypot(row["T_x"], row["T_y"]) for row in rows])
    # midpoint sums of the elliptic bound over 10 x 10 cells exceed mu N by 1.48 %
    assert (sizes < 1.0148).all()
    assert cli.main(["contact", "--creep"]) == 0
    printed = capsys.readouterr().out
    assert "Creep force over mu N" in printed
    assert "-0.000" not in printed


def test_creep_directions_are_what_they_are_called(capsys):
    """Beside their creepages, by symmetry: along the rail no force across and no moment."""
    for row in as_json(capsys, "--creep")["creep"]:
        named = [word in row["case"] for word in ("longitudinal", "lateral", "spin")]
        assert [row[name] != 0.0 for name in ("xi_x", "xi_y", "phi")] == named
        if "sign" in row["case"]:
            assert (row["xi_y"] * row["phi"] > 0.0) == ("same" in row["case"])
        if row["case"] == "longitudinal":
            assert row["T_y"] == pytest.approx(0.0, abs=1e-12)
            assert row["M_z"] == pytest.approx(0.0, abs=1e-12)
            if row["size"] == 0.1:  # nearly mu N times the normalised creepage
                assert abs(row["T_x"]) == pytest.approx(0.1, rel=0.1)
        elif not named[0]:
            assert row["T_x"] == pytest.approx(0.0, abs=1e-12)


def test_creep_refuses_a_friction_that_means_nothing(capsys):
    for friction in ("0", "-0.3", "nan", "1.5"):
        assert cli.main(["contact", "--creep", "--friction", friction]) == 2
        assert "--friction" in capsys.readouterr().err


def test_creep_table_that_is_there_is_told_before_half_an_hour(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("railsim.contact.creep_table.build_nodes", None)
    (tmp_path / "creep_table.npz").touch()
    assert cli.main(["contact", "--build-creep-table", "--out", str(tmp_path)]) == 2
    assert "holds creep_table.npz; give --overwrite" in capsys.readouterr().err


def test_creep_table_is_built_from_the_rows_that_are_there(tmp_path, capsys):
    from railsim.contact.creep_table import shipped_nodes

    nodes = shipped_nodes()
    ratios, thetas = nodes.force.shape[:2]
    for i in range(ratios):
        for j in range(thetas):
            with open(tmp_path / f"row_{i:02d}_{j:02d}.npz", "wb") as stream:
                np.savez(stream, row=nodes.force[i, j], kalker=nodes.kalker[i], failures=0)
    found = as_json(capsys, "--build-creep-table", "--out", str(tmp_path))
    assert found["largest_difference"] == 0.0
    with np.load(found["file"]) as written:
        np.testing.assert_array_equal(written["force"], nodes.force)


@pytest.mark.parametrize(
    ("direction", "components"),
    [
        ((1, 0, 0), [0]),
        ((0, 1, 0), [1]),
        ((0, 0, 1), [1]),
        ((1, 1, 0), [0, 1]),
        ((1, 0, 1), [0, 1]),
    ],
)
def test_lateral_forces_are_drawn_with_lateral_creepage_or_spin(direction, components):
    assert [k for k, _ in _components(direction)] == components


@pytest.mark.slow
@pytest.mark.further
def test_creep_pictures_are_written(tmp_path, capsys):
    out = tmp_path / "creep"
    assert cli.main(["contact", "--creep", "--out", str(out), "--quiet"]) == 0
    for name in ("creep_curves.png", "traction.png"):
        with Image.open(out / name) as picture:
            assert min(picture.size) > 600
    with (out / "creep_curves.csv").open() as file:
        assert {"law", "T_x", "T_y", "M_z"} <= set(next(csv.DictReader(file)))


def test_an_amplitude_without_an_oscillation_is_shown():
    """Between its two contacts a hollow wheel has a hump: 1 mm is less than what crosses it."""
    hollow, rail = load_profile("S1002_hollow"), load_profile("60E1")
    geometry = contact_geometry(hollow, rail, inclination=0.025, gauge=1.436)
    amplitudes = 1e-3 * np.arange(0.5, 3.1, 0.5)
    found = SimpleNamespace(
        amplitudes=amplitudes, conicity=geometry.equivalent_conicity(amplitudes)
    )
    caption, heading, values = printed_conicity(found).lines()
    assert "-: no oscillation with this amplitude" in caption
    assert heading.split()[2:] == ["1", "2", "3"]
    assert values.split()[1] == "-"


@pytest.mark.parametrize("without", range(9))
def test_caption_speaks_of_the_amplitudes_that_are_printed(without):
    """Whole millimetres of 0.5 to 4.5 mm; halves are in the file only."""
    conicity = np.where(np.arange(9) == without, np.nan, 0.1)
    found = SimpleNamespace(amplitudes=1e-3 * np.arange(0.5, 4.6, 0.5), conicity=conicity)
    printed = printed_conicity(found)
    whole = [1, 3, 5, 7]
    assert ("no oscillation" in printed.caption) == (without in whole)
    assert printed.texts()[0][1:] == ["-" if k == without else "0.100" for k in whole]


def test_each_quantity_stands_in_its_unit():
    """A summary of plain numbers: 1, 2, 3 ... mm, mrad, kN by the columns."""
    sides = {
        "rolling_radius": (461e-3, 459e-3), "contact_angle": np.radians([2.0, 3.0]),
        "contact_y": (4e-3, 5e-3), "wheel_y": (6e-3, 7e-3),
    }  # fmt: skip
    places = {name: np.array([each]) for name, each in sides.items()}
    alone = {"lateral": np.array([1e-3]), "delta_r": np.array([2e-3]), "roll": np.array([8e-3])}
    patch = SimpleNamespace(
        N=60e3, N_z=59e3, N_y=5e3, y=9e-3, angle=np.radians(1.5), length=11e-3, width=12e-3,
        area=104e-6, p_max=900e6, zone="tread",
    )  # fmt: skip
    solved = SimpleNamespace(patches=[patch], z=0.01e-3)
    found = ContactSummary(
        pairs=(None, None), radii=(0.46, 0.46), load=64e3, normal="hertz",
        geometry=SimpleNamespace(**places, **alone),
        amplitudes=1e-3 * np.arange(0.5, 2.1, 0.5), conicity=np.array([0.1, 0.2, 0.3, 0.4]),
        contacts={2e-3: solved}, exact={2e-3: solved},
    )  # fmt: skip

    def shown(table, row=0):
        texts = table.texts()[row]
        return {c.name: f"{t} {c.unit}".strip() for c, t in zip(table.columns, texts, strict=True)}

    assert shown(function_table(found)) == {
        "lateral": "1.00 mm", "delta_r": "2.000 mm",
        "rolling_radius_left": "461.000 mm", "rolling_radius_right": "459.000 mm",
        "contact_angle_left": "2.00 deg", "contact_angle_right": "3.00 deg",
        "contact_y_left": "4.00 mm", "contact_y_right": "5.00 mm",
        "wheel_y_left": "6.00 mm", "wheel_y_right": "7.00 mm", "roll": "8.000 mrad",
    }  # fmt: skip
    assert list(shown(printed_functions(found))) == [n for n in NAMES if "contact_y" not in n]
    assert shown(conicity_table(found), 1) == {"amplitude": "1 mm", "equivalent_conicity": "0.200"}
    over_gauge = conicity_map_table(found, [1.4355], np.array([found.conicity]))
    assert shown(over_gauge) == {"gauge": "1435.5 mm", "amplitude 1 mm": "0.200",
                                 "amplitude 2 mm": "0.400"}  # fmt: skip
    patches = patch_table(found)
    assert "under 64 kN" in patches.caption
    for row, method, zone in ((0, "table", "tread"), (1, "exact", "")):
        assert shown(patches, row) == {
            "lateral": "2.00 mm", "method": method, "zone": zone, "N": "60.0 kN", "Q": "59.0 kN",
            "Y": "5.0 kN", "contact_y": "9.00 mm", "contact_angle": "1.5 deg", "length": "11.0 mm",
            "width": "12.0 mm", "area": "104 mm2", "p_max": "900 MPa", "z": "0.010 mm",
        }  # fmt: skip


def test_some_lines_of_the_contact_functions_are_printed():
    """Of 201 each tenth: 21, both ends among them; of 15 all."""
    for count, printed in ((201, 21), (15, 15)):
        y = np.linspace(-0.01, 0.01, count)
        functions = {name: y for name in NAMES}
        lines = printed_functions(SimpleNamespace(functions=functions))["lateral"]
        assert lines == pytest.approx(np.linspace(-0.01, 0.01, printed).tolist())


def test_patches_are_shown_at_displacements_that_rise():
    """To both sides, in the middle, and most of them towards the flange of the right wheel."""
    assert all(one < two for one, two in pairwise(PATCH_SHARES))
    assert 0.0 in PATCH_SHARES
    assert -1.0 < PATCH_SHARES[0] < 0.0 < -PATCH_SHARES[0] < PATCH_SHARES[-1] < 1.0
