"""Remarks on a run stand wherever its numbers are shown."""

import csv
import json

import numpy as np
import pytest
import xarray
from example_result import COORDINATES, PROFILES, arrays, attributes

import railsim
from railsim.cli import main
from railsim.result import Hdf5Sink, MemorySink, open_result
from railsim.studies import summary
from railsim.studies.case import load_case
from railsim.studies.journal import Records
from railsim.studies.spec import RunSpec

REMARKS = ("The first remark of two.", "The second one, on another matter.")


def fed(sink, remarks=REMARKS):
    given = arrays(duration=10.0)
    static = {"Q0": given.pop("Q0")}
    sink.begin(COORDINATES)
    sink.append(given)
    return sink.close({**attributes(), "remarks": "\n".join(remarks)}, static, PROFILES)


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / "remarked.h5", tmp_path / "plain.h5"]
    for path, remarks in zip(paths, (REMARKS, ()), strict=True):
        with Hdf5Sink(path) as sink:
            fed(sink, remarks)
    return [str(path) for path in paths]


def test_root_attribute_is_text_with_one_sentence_a_line(files):
    with xarray.open_dataset(files[0], engine="h5netcdf") as data:
        assert data.attrs["remarks"].splitlines() == list(REMARKS)
    assert open_result(files[0]).remarks == REMARKS
    assert open_result(files[1]).remarks == ()


def test_result_without_the_attribute_opens():
    assert MemorySink().close({}, {}).remarks == ()


def test_index_and_table_of_a_study_repeat_them(tmp_path):
    case = load_case(RunSpec("coach_manchester", "curve_r250", 20.0))
    records = [
        summary.finished_record(case, fed(MemorySink())),
        summary.finished_record(case, fed(MemorySink(), ())),
        summary.failed_record(case, "a reason"),
    ]
    assert [record.get("remarks") for record in records] == [list(REMARKS), [], None]
    summary.write_index(tmp_path, {}, "complete", Records(tmp_path / "none", records))
    rows = list(csv.DictReader((tmp_path / "summary.csv").read_text().splitlines()))
    assert [row["remarks"] for row in rows] == [" ".join(REMARKS), "", ""]


def test_comparison_names_the_result_that_they_belong_to(files, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("railsim.plot.style.to_bytes", lambda _: b"")
    assert main(["compare", *files, "--out", str(tmp_path / "both")]) == 0
    printed = capsys.readouterr().out
    for remark in REMARKS:
        assert f"remarked: remark: {remark}" in printed
    assert "plain: remark" not in printed
    expected = {"remarked": list(REMARKS), "plain": []}
    assert json.loads((tmp_path / "both" / "compare.json").read_text())["remarks"] == expected
    assert main(["compare", *files, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["remarks"] == expected


def test_info_shows_them(files, capsys):
    assert main(["info", files[0]]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(maxsplit=1)[1] for line in lines if line.startswith("remark")] == [*REMARKS]
    assert main(["info", files[0], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["remarks"] == list(REMARKS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("output_rate=1000", None),
        ("output_rate=2", "Between two outputs (2 per s) forces peak: the largest"),
        ("output_spacing=7", "Between two outputs (every 7 m) forces peak: the largest"),
        ("outputs.low_pass={ frequency = 5.0, phase = 'causal' }", "The low pass takes "),
    ],
)
def test_what_outputs_and_filters_cost_a_peak_is_said(assignment, words):
    """A dip of 10 mm: its blow lasts some hundredths of a second."""
    dip = 'irregularities=[{ type = "dip", s = 25.0, length = 2.0, depth = 0.01 }]'
    result = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("straight", [dip]),
        speed=20.0, until=45.0, settings=railsim.load_settings(None, [assignment]),
    )  # fmt: skip
    found = [text for text in result.remarks if "in what is stored" in text or "outputs" in text]
    assert [text.startswith(words or "") for text in found] == [True] * (words is not None)
    if found:
        name = found[0].split("the largest ")[1].split()[0].rstrip(":")
        assert f"{1e-3 * abs(result[name]).max():.2f} kN in" in found[0]


@pytest.mark.parametrize("second", [0.0, 0.003])
def test_lost_peak_is_one_that_tables_list(second):
    """They leave out the start, with the larger of two dips."""
    dips = [{"type": "dip", "s": 8.0, "length": 1.0, "depth": 0.004}]
    dips += [{**dips[0], "s": 34.0, "depth": second}] if second else []
    result = railsim.simulate(
        railsim.load_vehicle("coach_manchester"),
        railsim.load_track("straight").replace(irregularities=dips),
        speed=20.0, duration=1.9,
        settings=railsim.load_settings(None, ["output_rate=20", "outputs.evaluate_after=1.2"]),
    )  # fmt: skip
    found = [text for text in result.remarks if text.startswith("Between two outputs")]
    assert len(found) == (second > 0.0)
    if found:
        (listed,) = railsim.peaks(result, ["Q"])
        stored = np.abs(result["Q"][result["time"] > 1.2 - 1e-9]).max()
        assert f"{1e-3 * listed.value:.2f} kN over all steps" in found[0]
        assert f"{1e-3 * stored:.2f} kN in the stored" in found[0]


def test_run_remarks_on_what_was_recognised_in_the_files_of_its_profiles(tmp_path):
    rail = railsim.load_profile("60E1")
    rows = "".join(f"{y!r},{-z!r}\n" for y, z in zip(rail.y.tolist(), rail.z.tolist(), strict=True))
    (tmp_path / "rail.csv").write_text("y,z\n" + rows)
    track = railsim.load_track("straight").with_values({"rail": str(tmp_path / "rail.csv")})
    result = railsim.simulate(railsim.load_vehicle("wagon_y25"), track, speed=20.0, duration=0.01)
    assert [remark for remark in result.remarks if remark.startswith("Profile")] == [
        f"Profile {tmp_path / 'rail.csv'}: z pointed upwards: turned."
    ]
