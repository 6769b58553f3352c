"""``railsim compare``: results side by side."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from example_result import example_result, text

import railsim
from railsim.cli import main
from railsim.compare import Comparison, compare, conditions, differences
from railsim.notation import QUANTITIES
from railsim.result import Peak, Result, peaks
from railsim.result.export import selected


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    return [
        str(example_result().to_hdf5(folder / "base.h5")),
        str(example_result(gain=0.9).to_hdf5(folder / "lower.h5")),
    ]


def test_difference_is_that_of_the_magnitudes():
    rows = compare({"base": example_result(), "lower": example_result(gain=0.9)})
    yaw = next(r for r in rows if r.quantity.name == "wheelset_yaw" and r.where == "peak")
    assert yaw.peaks["base"].value < 0.0
    assert yaw.differences == {"base": 0.0, "lower": pytest.approx(-0.1)}


def test_mirrored_run_differs_by_nothing():
    rows = compare({"right": example_result(), "left": example_result(gain=-1.0)})
    for row in rows:
        if row.quantity.name in ("wheelset_yaw", "wheelset_lateral", "sum_Y"):
            assert row.differences["left"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("gain", [0.0, 1e-12])  # rounding errors are shown as 0 too
def test_difference_from_nothing_is_not_a_number(gain):
    (row, *_) = compare({"none": example_result(gain=gain), "base": example_result()})[3:]
    assert row.quantity.text(row.peaks["none"].value) == "0.00"
    assert row.record()["values"]["base"]["difference"] is None


@pytest.mark.parametrize("name", sorted({peak.quantity.name for peak in peaks(example_result())}))
def test_a_difference_is_that_from_a_value_that_is_not_shown_as_0(name):
    """Just below and just above half of the last digit, on either side of 0."""
    quantity = QUANTITIES[name]
    digit = (quantity.least or 1e-3) / quantity.scale
    for share in (0.49, 0.51, 1.0, -0.49, -0.51):
        values = {"first": share * digit, "other": digit}
        both = {label: Peak(quantity, value, {}, 0.0, 0.0) for label, value in values.items()}
        found = Comparison(quantity, "peak", both, "first").differences["other"]
        shown = float(quantity.text(share * digit))
        expected = 1.0 / abs(share) - 1.0
        assert found == pytest.approx(expected if shown else np.nan, nan_ok=True)


def test_peaks_and_mid_curve_values_are_compared():
    rows = compare({"base": example_result(), "short": example_result(duration=19.0)})
    assert [row.where for row in rows].count("full curve 1, median") == 10
    assert set(rows[-1].peaks) == {"base"}  # the short run ends before the middle


def test_a_run_that_begins_after_a_curve_is_compared_in_the_others():
    """An S-curve: the circular elements are from 60 m to 120 m and from 126 m to 186 m."""
    made = example_result(speed=4.0, duration=70.0)
    whole = changed(made, {"track_toml": text("tracks/s_curve_r150.toml")})
    rows = compare({"whole": whole, "later": selected(whole, between=(100.0, 280.0))})
    for row in rows:
        if row.where.startswith("full curve"):
            middle = {"1": 90.0, "2": 156.0}[row.where[len("full curve ")]]
            assert {peak.distance for peak in row.peaks.values()} == {middle}
            assert set(row.peaks) == ({"whole", "later"} if middle == 156.0 else {"whole"})


def test_what_the_first_result_lacks_is_shown_without_a_difference():
    made = example_result()
    few = selected(made, quantities=["Q", "Y"])
    lacking = {row.quantity.name: row for row in compare({"few": few, "all": made})}
    assert {"Q", "sum_Y", "wheelset_yaw"} <= set(lacking)
    assert lacking["sum_Y"].record()["values"]["all"]["difference"] is None
    assert lacking["Q"].differences["all"] == pytest.approx(0.0, abs=1e-3)


def changed(made, attributes=None, **arrays):
    """Return a result with other arrays or attributes."""
    given = {name: made[name] for name in made} | arrays
    facts = {**made.attributes, **(attributes or {})}
    return Result(given, made.quantities, made.coordinates, facts, made.profiles)


def test_largest_difference_is_where_both_have_a_value():
    """A wheel without contact has no Y/Q: neither there nor next to it is there a difference."""
    base, lower = example_result(), example_result(gain=0.9)
    apart = (lower["Y_over_Q"] - base["Y_over_Q"])[:, 0, 0]
    lifted = lower["Y_over_Q"].copy()
    lifted[100, 0, 0] = lifted[:, 0, 1] = np.nan
    both = {"base": base, "lower": changed(lower, Y_over_Q=lifted)}
    left, right = differences(both, ["Y_over_Q"])
    assert left.largest[0] == apart[np.argmax(np.abs(apart))]
    assert np.isnan(right.largest).all()


def test_leading_wheelsets_are_compared_at_the_same_place():
    """Of a longer vehicle the reference body is farther behind its leading wheelset."""
    base = example_result()
    longer = changed(base, distance=base["distance"] - 3.0)
    for one in differences({"base": base, "longer": longer}, ["sum_Y", "Y_over_Q"]):
        assert not one.values.any()
        assert one.distance[-1] == base["distance"][-1]


@pytest.mark.parametrize(
    ("written", "instead", "same"),
    [
        ("radius = 250.0", "radius = 250.0000000001", True),
        (
            '{ type = "STR", length = 300.0 }',
            '{ type = "STR", length = 100.0 }, { type = "STR", length = 200.0 }',
            True,
        ),
        ("radius = 250.0", "radius = 250.1", False),
        ("length = 300.0", "length = 300.001", False),
    ],
)
def test_a_plan_is_the_same_up_to_rounding_and_however_it_is_divided(written, instead, same):
    base, track = example_result(), text("tracks/curve_r250.toml")
    assert written in track
    base = changed(base, {"track_toml": track})
    other = changed(base, {"track_toml": track.replace(written, instead)})
    if same:
        assert not differences({"base": base, "other": other}, ["sum_Y"])[0].values.any()
    else:
        with pytest.raises(railsim.InputError, match="runs over another plan than base"):
            differences({"base": base, "other": other}, ["sum_Y"])


def test_conditions_that_differ_are_said_and_those_alike_are_not(files, tmp_path, capsys):
    """Another friction on one rail, rigid rails and another law: not the vehicle's doing."""
    track = text("tracks/curve_r250.toml") + '\n[support]\npreset = "rigid"\n'
    other = changed(
        example_result(speed=15.0),
        {
            "track_toml": track.replace("friction = 0.4", "friction = [0.4, 0.1]"),
            "settings_json": '{"creep_law": "polach", "outputs": {"drives": true}}',
        },
    )
    assert conditions({"base": example_result(), "alike": example_result(gain=2.0)}) == {}
    assert conditions({"base": example_result(), "other": other}) == {
        "speed": ["20", "15"],
        "distance": ["0 to 980", "0 to 735"],  # 49 s
        "track.friction": ["0.4, 0.4", "0.4, 0.1"],
        "track.support.preset": ["ballasted", "rigid"],
        "settings.step": ["0.001", "none"],
        "settings.creep_law": ["fastsim", "polach"],
    }
    main(["compare", files[0], str(other.to_hdf5(tmp_path / "other.h5"))])
    head = capsys.readouterr().out.split("peaks")[0].splitlines()
    assert head[0].split() == ["conditions", "that", "differ", "base", "other"]
    assert head[1].split() == ["speed", "(m/s)", "20", "15"]


def test_results_without_an_instant_are_named_together():
    run = example_result()
    arrays = {
        name: run[name][:0] if len(run[name]) == len(run["time"]) else run[name] for name in run
    }
    empty = Result(arrays, run.quantities, run.coordinates, {**run.attributes, "status": "stopped"})
    with pytest.raises(railsim.InputError) as raised:
        compare({"whole": run, "one": empty, "other": empty})
    assert [(fault.file, fault.key) for fault in raised.value.faults] == [
        ("one", "time"), ("other", "time")
    ]  # fmt: skip
    assert all("holds no instants (stopped)" in str(fault) for fault in raised.value.faults)


@pytest.mark.parametrize("end", [0, -1])
@pytest.mark.parametrize(("apart", "said"), [(0.99, False), (1.01, True), (-1.01, True)])
def test_ends_that_lie_a_metre_apart_are_said(end, apart, said):
    run = example_result()
    arrays = {name: run[name] for name in run}
    arrays["distance"] = run["distance"].copy()
    arrays["distance"][end] += apart
    other = Result(arrays, run.quantities, run.coordinates, run.attributes)
    assert ("distance" in conditions({"a": run, "b": other})) == said


def test_parts_of_the_track_that_differ_are_said():
    """Peaks of 340 m against those of 320 m, at 20 m/s; 0.8 m are where a run happens to end."""
    base, shorter = example_result(duration=17.0), example_result(duration=16.0)
    found = conditions({"base": base, "shorter": shorter})
    assert found == {"distance": ["0 to 340", "0 to 320"]}
    assert conditions({"base": base, "alike": example_result(duration=16.96)}) == {}


def test_changed_keys_of_a_vehicle_are_said_with_their_values():
    """Of another vehicle too, if they are few; of one that differs in all its parts, its name."""
    base = example_result()

    def other(vehicle):
        return {"base": base, "other": changed(base, {"vehicle_toml": vehicle.to_toml()})}

    assignments = ["primary.stiffness.x=16e6", "load=laden"]
    found = conditions(other(railsim.load_vehicle("coach_manchester", assignments)))
    primary = "vehicle.assemblies.bogie.assemblies.axle.elements.primary.stiffness"
    assert found[primary] == ["31391000, 884665, 936340", "16000000, 884665, 936340"]
    assert found["vehicle.load"] == ["design", "laden"]
    assert len(found) == 2
    softer = railsim.load_vehicle("coach_manchester", [*assignments, "name=softer"])
    assert conditions(other(softer)) == {"vehicle": [base.vehicle().name, "softer"], **found}
    assert list(conditions(other(railsim.load_vehicle("coach_25t")))) == ["vehicle"]


def test_command_prints_value_wheel_time_and_difference(files, capsys):
    assert main(["compare", *files]) == 0
    printed = capsys.readouterr().out
    line = next(each for each in printed.splitlines() if "lower" in each and "-5.58" in each)
    assert line.endswith("-10.00")
    assert "difference (%)" in printed
    assert "full curve 1, median" in printed
    (head,) = [line for line in printed.splitlines() if line.startswith("full curve 1, median")]
    assert "t (s)" not in head  # a median has no instant
    assert "middle at s (m)" in head


def test_remarks_are_printed_unless_quiet(files, capsys, monkeypatch):
    monkeypatch.setattr("railsim.result.Result.remarks", ("hunts at 5 Hz",))
    assert main(["compare", *files]) == 0
    assert "lower: remark: hunts at 5 Hz" in capsys.readouterr().out
    assert main(["compare", *files, "--quiet"]) == 0
    assert "remark" not in capsys.readouterr().out


def test_peaks_on_random_irregularities_are_said_to_be_of_one_seed(tmp_path, capsys):
    random = '[[irregularities]]\ntype = "random"\nspectrum = "erri_b176_low"\n'
    base = example_result(duration=2.0)
    uneven = changed(base, {"track_toml": base.attributes["track_toml"] + random})
    pair = [str(r.to_hdf5(tmp_path / f"{k}.h5")) for k, r in enumerate((base, uneven))]
    for quiet in ([], ["--quiet"]):
        assert main(["compare", *pair, *quiet]) == 0
        assert ("from seed to seed" in capsys.readouterr().err) == (not quiet)


def test_a_result_that_ended_early_is_said_to_have(files, tmp_path, capsys):
    short = changed(
        example_result(duration=17.0, status="stopped"), {"status_reason": "out of patience"}
    ).to_hdf5(tmp_path / "short.h5")
    assert main(["compare", files[0], str(short), "--quiet"]) == 0
    words = "short: stopped: out of patience; compared up to s = 340.0 m"
    assert words in capsys.readouterr().out
    assert main(["compare", files[0], str(short), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == {"base": "complete", "short": "stopped"}
    assert found["status_reason"]["short"] == "out of patience"
    assert found["compared_up_to"]["short"] == pytest.approx(340.0)  # 17 s at 20 m/s


def test_folder_holds_table_record_and_picture_and_is_kept_without_overwrite(
    files, tmp_path, capsys
):
    folder = tmp_path / "comparison"
    folder.mkdir()
    (folder / "differences.png").write_text("mine")
    given = ["compare", *files, "--out", str(folder)]
    assert main(given) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert [path.read_text() for path in folder.iterdir()] == ["mine"]
    assert main([*given, "--overwrite"]) == 0
    assert sorted(path.name for path in folder.iterdir()) == [
        "compare.csv",
        "compare.json",
        "compare.png",
        "differences.png",
    ]
    rows = list(csv.DictReader((folder / "compare.csv").open(encoding="utf-8")))
    assert float(rows[0]["difference"]) == 0.0
    assert {row["result"] for row in rows} == {"base", "lower"}
    assert json.loads((folder / "compare.json").read_text())["results"] == ["base", "lower"]
    assert (folder / "differences.png").stat().st_size > 5000


def test_results_that_keep_few_quantities_are_drawn_by_what_all_have(tmp_path):
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    paths = []
    for name, kept in (("wheels", ["Q", "sum_Y"]), ("loads", ["Q"])):
        settings = railsim.Settings().with_values({"outputs.quantities": kept})
        run = railsim.simulate(vehicle, track, speed=20.0, duration=0.1, settings=settings)
        paths.append(str(run.to_hdf5(tmp_path / f"{name}.h5")))
    assert main(["compare", *paths, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "compare.png").stat().st_size > 0


def test_json_is_all_that_stdout_holds(files, capsys):
    assert main(["compare", *files, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["rows"][0]["quantity"] == "Q"


@pytest.mark.parametrize(
    ("chosen", "words"),
    [([0], "two results"), ([0, 0], "given twice"), ([0, "missing.h5"], "no such file")],
)
def test_bad_results_are_refused(files, chosen, words, capsys):
    given = [files[each] if isinstance(each, int) else each for each in chosen]
    assert main(["compare", *given]) == 2
    assert words in capsys.readouterr().err


def test_an_axis_without_a_picture_is_refused(files, capsys):
    assert main(["compare", *files, "--over", "time"]) == 2
    assert "--over goes with --out" in capsys.readouterr().err


def test_one_file_by_two_paths_is_given_twice(files, capsys, monkeypatch):
    path = Path(files[0])
    monkeypatch.chdir(path.parent)
    for command in (["compare"], ["assess", "--coarse"]):
        assert main([*command, str(path), path.name]) == 2
        assert "given twice" in capsys.readouterr().err
