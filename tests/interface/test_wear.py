"""`railsim wear`: steps of wear, files, going on after an end, bad input."""

import json
from dataclasses import replace

import numpy as np
import pytest

import railsim
from railsim.cli import main
from railsim.errors import ModelError
from railsim.profiles import load_profile
from railsim.report.wear import WHEELS, wear_tables
from railsim.studies.wear_loop import WearStep, wear_loop

SHORT = """format = "railsim-track/1"
name = "some metres of a curve"
plan = [{ type = "CIR", length = 6.0, radius = 1500.0 }]
cant = [{ type = "CST", length = 6.0, cant = 0.05 }]
"""


@pytest.fixture
def command(tmp_path):
    track = tmp_path / "short.toml"
    track.write_text(SHORT)
    return [
        "wear", "coach_manchester", "--route", str(track), "72km/h", "1", "--step", "100",
        "--set", 'settings.start_state="steady"', "--out", str(tmp_path / "worn"), "--quiet",
    ]  # fmt: skip


@pytest.mark.usefixtures("small_contact_tables")
def test_steps_are_kept_and_a_longer_distance_goes_on(
    command, tmp_path, capsys, monkeypatch, undrawn
):
    folder = tmp_path / "worn"
    with undrawn():
        assert main([*command, "--distance", "100", "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    (kept,) = (folder / "steps").iterdir()
    content = kept.read_bytes()
    # the second hundred kilometres only; the first are read
    runs = []
    simulate = railsim.studies.wear_loop.simulate
    monkeypatch.setattr(
        "railsim.studies.wear_loop.simulate",
        lambda *given, **more: (runs.append(more["profiles"]), simulate(*given, **more))[1],
    )
    assert main([*command, "--distance", "200", "--overwrite"]) == 0
    told = capsys.readouterr().out
    assert len(runs) == 1
    assert kept.read_bytes() == content
    record = json.loads((folder / "wear.json").read_text())
    assert record["rows"][:2] == first["rows"]
    new, once, twice = record["rows"]
    assert new["area"] == 0.0 < once["area"] < twice["area"]
    assert [row["distance"] for row in record["rows"]] == [0.0, 1e5, 2e5]
    (line,) = [line for line in told.splitlines() if line.split()[:1] == ["200"]]
    assert f"{1e6 * twice['area']:.4f}" in line
    assert (folder / "wear.png").stat().st_size > 10_000
    # the last profile can stand in a vehicle file; it has lost what the table says.  A profile
    # that is read has z = 0 on the worn nominal rolling circle: the flange shows by how much
    worn, wheel = load_profile(str(folder / "wheel_200_km.csv"), "wheel"), load_profile("S1002")
    y = np.linspace(-0.06, 0.05, 5001)
    lost = np.interp(y, wheel.y, wheel.z) - np.interp(y, worn.y, worn.z)
    assert np.trapezoid(lost - lost.min(), y) == pytest.approx(twice["area"], rel=0.1)
    # a page about the folder; one that is damaged is refused
    page = tmp_path / "page.html"
    assert main(["report", str(folder), "--out", str(page)]) == 0
    told = page.read_text()
    assert f"<td>{1e6 * twice['area']:.4f}</td>" in told.replace('<td class="number">', "<td>")
    assert "Computed to 200 km." in told
    assert "data:image/png;base64," in told
    (folder / "wear.json").write_text('{"vehicle": "", "routes": []}')
    assert main(["report", str(folder), "--out", str(page), "--overwrite"]) == 2
    assert f"{folder / 'wear.json'}: " in capsys.readouterr().err
    assert page.read_text() == told
    # damage: told and computed again
    kept.write_bytes(content.replace(b"0", b"1", 3))
    with undrawn():
        assert main([*command, "--distance", "200", "--overwrite"]) == 0
    assert (
        capsys.readouterr().err == f"remark: {kept}: the record is damaged: it is computed again\n"
    )
    assert len(runs) == 2
    assert kept.read_bytes() == content


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--distance", "0"], "--distance: found 0"),
        (["--distance", "150"], "--step: found 100 km with a distance of 150 km"),
        (
            ["--distance", "100", "--route", "straight", "20", "-1"],
            "--route: found a share of -1 for",
        ),
        (
            ["--distance", "100", "--route", "straight", "900", "1"],
            "--route: found 900 m/s for Passen",
        ),
        (["--distance", "100", "--law", "x"], "found 'x'; one of pearce_sherratt, usfd, or a file"),
        (["--distance", "100", "--route", "nowhere", "20", "1"], "nowhere"),
        (["--distance", "100", "--set", 'vehicle.wheelsets.w.profile="x"'], "w"),
    ],
)
def test_bad_input_is_met_before_anything_is_computed(
    command, tmp_path, capsys, monkeypatch, given, said
):
    monkeypatch.setattr("railsim.studies.wear_loop.simulate", None)
    assert main([*command, *given]) == 2
    found = capsys.readouterr()
    assert said in found.err
    assert "Traceback" not in found.err
    assert not (tmp_path / "worn").exists()


@pytest.mark.usefixtures("small_contact_tables")
def test_loop_that_is_refused_keeps_what_was_done(command, tmp_path, capsys, monkeypatch, undrawn):
    """Of 200 km 150 are done: a whole step and a part of the second."""
    folder = tmp_path / "worn"
    parts_of_step = railsim.studies.wear_loop.parts_of_step
    parts = iter([1, 2])

    def refused_at_last(*given):
        parts_of_step(*given)
        if (number := next(parts, None)) is None:
            raise ModelError("worn too far")
        return number

    monkeypatch.setattr("railsim.studies.wear_loop.parts_of_step", refused_at_last)
    with undrawn():
        assert main([*command, "--distance", "200"]) == 2
    said = capsys.readouterr()
    assert "worn too far" in said.err
    firsts = [line.split()[0] for line in said.out.splitlines() if line]
    assert [first for first in firsts if first.isdigit()] == ["0", "100", "150"]
    record = json.loads((folder / "wear.json").read_text())
    assert [row["distance"] for row in record["rows"]] == [0.0, 1e5, 1.5e5]
    assert record["ended"] == "worn too far"
    files = {path.name for path in folder.iterdir()}
    assert files == {"wear.json", "wear.png", "steps", "wheel_100_km.csv", "wheel_150_km.csv"}


def test_straights_of_a_curve_are_said(capsys):
    """60 m of R 500 m and two transitions of 60 m between straights of 300 and 500 m."""
    route = ["--route", "curve_r500", "20", "1", "--route", "straight", "20", "1"]
    more = ["--distance", "1", "--step", "1", "--law", "none"]
    assert main(["wear", "coach_manchester", *route, *more]) == 2
    said = capsys.readouterr().err
    assert said.count("are curved") == 1
    words = "180 of its 980 m are curved; its mean wear is that over all."
    assert words in said
    traffic = ["--traffic", "coach_manchester", "20", "1", "--tonnage", "1", "--step", "1"]
    assert main(["rail-wear", "curve_r500", *traffic, "--law", "none"]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize(("speed", "hunts"), [(30.0, False), (60.0, True)])
def test_straight_above_the_critical_speed_is_a_remark(speed, hunts, tmp_path):
    """The coach hunts at 60 m/s, not at 30; its own run on a smooth straight shows neither."""
    straight = railsim.load_track("straight").replace(plan=[{"type": "STR", "length": 60.0}])
    coach, told = railsim.load_vehicle("coach_manchester"), []
    for _ in range(2):  # the second time it is read
        wear_loop(coach, [(straight, speed, 1.0)], step=1e5, steps=1, folder=tmp_path,
                  on_remark=told.append)  # fmt: skip
    assert len(told) == (2 if hunts else 0)
    if hunts:
        assert told[0] == told[1]
        assert told[0].startswith(f"after 0 km on {straight.name} at 60 m/s: The vehicle hunts at")
        assert told[0].endswith("disturbed by 6 mm.")


def test_command_draws_the_wear_of_both_rails(tmp_path, monkeypatch):
    """Left rail 0.2 mm lower after the second step, right rail 0.05 mm."""
    new = load_profile("60E1")

    def steps(*_, on_step, step, **__):
        for number, lower in enumerate([(1e-4, 2e-5), (2e-4, 5e-5)]):
            worn = {
                side: replace(new, z=np.asarray(new.z) + by)
                for side, by in zip(("left", "right"), lower, strict=True)
            }
            on_step(WearStep(number * step, step, {"left": new, "right": new}, worn, {}))

    monkeypatch.setattr("railsim.studies.rail_wear.rail_wear", steps)
    figures = []
    monkeypatch.setattr("railsim.plot.style.to_bytes", lambda figure: figures.append(figure) or b"")
    given = ["--traffic", "coach_manchester", "20", "1", "--tonnage", "0.2", "--step", "0.1"]
    assert main(["rail-wear", "curve_r500", *given, "--out", str(tmp_path / "w")]) == 0
    (figure,) = figures
    by_title = {axes.get_title(loc="left"): axes for axes in figure.axes}
    assert {"left rail", "right rail"} <= set(by_title)
    depths = [
        {line.get_label(): line.get_ydata().max() for line in axes.lines}
        for axes in figure.axes
        if "depth" in axes.get_ylabel()
    ]
    expected = [{"0.1 Mt": 0.1, "0.2 Mt": 0.2}, {"0.1 Mt": 0.02, "0.2 Mt": 0.05}]
    assert depths == [pytest.approx(one) for one in expected]
    page = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "w"), "--out", str(page)]) == 0
    for words in ("wear of the rails", "left rail", "right rail", "0.200", "0.050"):
        assert words in page.read_text()


def test_wear_that_is_interrupted_while_it_is_drawn_goes_on(tmp_path, monkeypatch):
    """The steps are kept; a record or a profile alone would refuse the command."""
    both = dict.fromkeys(("left", "right"), load_profile("60E1"))

    def steps(*_, on_step, step, **__):
        on_step(WearStep(0.0, step, both, both, {}))

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("railsim.studies.rail_wear.rail_wear", steps)
    monkeypatch.setattr("railsim.plot.style.to_bytes", lambda _: b"")
    folder = tmp_path / "worn"
    given = ["--traffic", "coach_manchester", "20", "1", "--tonnage", "0.1", "--step", "0.1"]
    command = ["rail-wear", "curve_r500", *given, "--out", str(folder)]
    with monkeypatch.context() as patch:
        patch.setattr("railsim.plot.study.rail_wear_figure", interrupted)
        assert main(command) == 130
    assert not folder.exists()
    assert main(command) == 0
    files = {"wear.json", "wear.png", "left_0.1_Mt.csv", "right_0.1_Mt.csv"}
    assert {path.name for path in folder.iterdir()} == files


@pytest.mark.parametrize(("deepest", "place"), [(4e-8, ""), (6e-8, "-2.5")])
def test_a_depth_that_is_printed_as_zero_has_no_place(deepest, place):
    row = {"distance": 1e6, "area": 0.0, "deepest": deepest, "deepest_y": -2.5e-3}
    (table,) = wear_tables(WHEELS, {"rows": [row]})
    assert table.texts() == [["1000", "0.0000", "0.0001" if place else "0.0000", place]]


def test_all_that_is_wrong_is_told_at_once_by_its_option(capsys):
    given = ["wear", "coach_manchester", "--route", "curve_r250", "400", "-1", "--law", "none"]
    assert main([*given, "--distance", "1", "--step", "1"]) == 2
    speed, share, law = capsys.readouterr().err.splitlines()[1:]
    assert speed.startswith("--route: found 400 m/s for Passenger coach")
    assert share.startswith("--route: found a share of -1 for Passenger coach")
    assert law.startswith("--law: found 'none'; one of pearce_sherratt")
