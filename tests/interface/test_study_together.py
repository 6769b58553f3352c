"""``railsim study --together``: runs that differ in the vehicle only share calls, and nothing else.

Short runs of the real thing: ten metres take a tenth of a second.
"""

import json

import numpy as np
import pytest
from planned import combinations

import railsim
import railsim.studies.run
from railsim.cli import main
from railsim.studies import execute
from railsim.studies.execute import Job, batches

COACH, CURVE, STRAIGHT = "coach_manchester", "curve_r250", "straight"
MASS = "vehicle.bodies.carbody.mass"


def arguments(out, *masses, together=8, tracks=(STRAIGHT,), more=()):
    return ["study", "--vehicles", COACH, "--tracks", *tracks, "--speeds", "20", "--until", "10",
            "--grid", f"{MASS}={','.join(map(str, masses))}", "--together", str(together),
            "--workers", "1", "--quiet", "--out", str(out), *more]  # fmt: skip


def runs(folder):
    return json.loads((folder / "study.json").read_text(encoding="utf-8"))["runs"]


def shared(folder):
    """How many runs shared a call with each run of a study."""
    return [
        railsim.open_result(folder / run["file"]).attributes["runs_together"]
        for run in runs(folder)
    ]


@pytest.fixture
def calls(monkeypatch):
    """Names of the vehicles, rather their masses, of every joint call."""
    made = []
    outcomes = railsim.studies.run.outcomes

    def noted(vehicles, *arguments, **how):
        made.append([vehicle.bodies["carbody"].mass for vehicle in vehicles])
        return outcomes(vehicles, *arguments, **how)

    monkeypatch.setattr(railsim.studies.run, "outcomes", noted)
    return made


def test_results_are_those_of_runs_apart(tmp_path, calls):
    assert main(arguments(tmp_path / "together", 40e3, 42e3, 44e3)) == 0
    assert main(arguments(tmp_path / "apart", 40e3, 42e3, 44e3, together=1)) == 0
    assert calls == [[40e3, 42e3, 44e3]]
    assert shared(tmp_path / "together") == [3, 3, 3]
    assert shared(tmp_path / "apart") == [1, 1, 1]
    for run, alone in zip(runs(tmp_path / "together"), runs(tmp_path / "apart"), strict=True):
        assert run["inputs_hash"] == alone["inputs_hash"]
        for peak, expected in zip(run["peaks"], alone["peaks"], strict=True):
            # round-off of the compiler's vectors, see tests/verification/test_ensemble.py
            assert peak["value"] == pytest.approx(expected["value"], rel=1e-9, abs=1e-9)


def test_runs_together_hold_no_more_in_memory_than_what_is_kept_and_summed_up(
    tmp_path, monkeypatch
):
    held, finished = [], execute.finished_record

    def noted(case, result, *more):
        held.append(set(result))
        return finished(case, result, *more)

    monkeypatch.setattr(execute, "finished_record", noted)
    for together in ("2", "1"):
        more = ["--keep", "Q,xi_x"]
        assert main(arguments(tmp_path / together, 40e3, 42e3, together=together, more=more)) == 0
    assert held == [held[-1]] * 4
    assert {"xi_x", "T_gamma"} <= held[0]
    assert not {"body_position", "phi"} & held[0]
    files = [railsim.open_result(tmp_path / n / runs(tmp_path / n)[0]["file"]) for n in "12"]
    assert set(files[0]) == set(files[1]) == {"time", "distance", "Q0", "Q", "xi_x"}
    np.testing.assert_array_equal(files[0]["xi_x"], files[1]["xi_x"])


def test_only_runs_on_the_same_track_at_the_same_speed_share_calls():
    cases = combinations([COACH], [STRAIGHT, CURVE], [15.0, 20.0], {MASS: ["40e3", "42e3"]})
    jobs = [Job(case, f"{case.name}.h5") for case in cases]
    found = batches(jobs, 8, workers=1)
    assert [len(batch) for batch in found] == [2, 2, 2, 2]
    for batch in found:
        assert len({(job.case.labels["track"], job.case.speed) for job in batch}) == 1
    settings = {"settings.fastsim_grid": ["[5,5]", "[10,10]"], MASS: ["40e3", "42e3"]}
    other = combinations([COACH], [STRAIGHT], [20.0], settings)
    assert [len(batch) for batch in batches([Job(c, "x") for c in other], 8, 1)] == [2, 2]


def test_batches_are_of_like_size_and_leave_no_worker_without_work():
    masses = [str(mass) for mass in range(30_000, 30_009)]
    jobs = [Job(case, "x") for case in combinations([COACH], [STRAIGHT], [20.0], {MASS: masses})]
    assert [len(batch) for batch in batches(jobs, 8, workers=1)] == [4, 5]
    assert [len(batch) for batch in batches(jobs, 8, workers=4)] == [3, 3, 3]
    assert [len(batch) for batch in batches(jobs, 1, workers=4)] == [1] * 9
    assert batches([], 8, workers=2) == []


def test_finished_runs_are_not_computed_again(tmp_path, calls):
    assert main(arguments(tmp_path, 40e3, 42e3)) == 0
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.h5")}
    assert main(arguments(tmp_path, 40e3, 42e3, 44e3, 46e3, more=["--resume"])) == 0
    assert calls == [[40e3, 42e3], [44e3, 46e3]]
    after = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.h5")}
    assert {name: after[name] for name in before} == before
    assert main(arguments(tmp_path, 40e3, 42e3, 44e3, 46e3, more=["--overwrite"])) == 0
    assert calls[2:] == [[40e3, 42e3, 44e3, 46e3]]


def test_a_run_without_equilibrium_fails_by_itself(tmp_path):
    """Without preload nothing carries the body; the other run is as usual."""
    key = "vehicle.assemblies.bogie.elements.secondary_spring.preload"
    given = arguments(tmp_path, 40e3, more=["--grid", f"{key}=auto,[0.0,0.0,0.0]"])
    assert main(given) == 1
    fine, failed = runs(tmp_path)
    assert fine["status"] == "complete"
    assert failed["status"] == "failed"
    assert failed["status_reason"].startswith("no static equilibrium")
    assert [path.name for path in tmp_path.glob("*.h5")] == [fine["file"]]


def test_a_run_that_cannot_be_written_fails_by_itself(tmp_path):
    cases = combinations([COACH], [STRAIGHT], [20.0], {MASS: ["40e3", "42e3"]}, until=10.0)
    paths = [tmp_path / "there.h5", tmp_path / "new.h5"]
    paths[0].write_text("a letter")
    refused, fine = railsim.studies.run.run_cases(cases, paths)
    assert isinstance(refused, railsim.InputError)
    assert fine.status == "complete"
    assert paths[0].read_text() == "a letter"


def test_interrupt_leaves_whole_files_only(tmp_path, monkeypatch):
    def interrupted(*arguments, progress, **how):
        raise KeyboardInterrupt

    monkeypatch.setattr(railsim.studies.run, "outcomes", interrupted)
    assert main(arguments(tmp_path, 40e3, 42e3)) == 130
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "study.journal",
        "study.json",
        "summary.csv",
    ]
    assert [run["status"] for run in runs(tmp_path)] == ["waiting", "waiting"]


def test_pictures_are_drawn_of_every_run(tmp_path):
    assert main(arguments(tmp_path, 40e3, 42e3, more=["--plots"])) == 0
    assert len(list(tmp_path.glob("*.png"))) == 2


@pytest.mark.slow
def test_processes_share_batches(tmp_path):
    seen = []
    outcome = railsim.study(
        [COACH], [STRAIGHT], [20.0], until=10.0, out=tmp_path, workers=2, together=8,
        grid={MASS: [40e3, 42e3, 44e3, 46e3]}, progress=seen.append,
    )  # fmt: skip
    assert [record["status"] for record in outcome.records] == ["complete"] * 4
    assert shared(tmp_path) == [2, 2, 2, 2]
    assert seen == sorted(seen)
    alone = railsim.simulate(railsim.load_vehicle(COACH, ["bodies.carbody.mass=46e3"]),
                             railsim.load_track(STRAIGHT), speed=20.0, until=10.0)  # fmt: skip
    last = railsim.open_result(tmp_path / outcome.records[-1]["file"])
    np.testing.assert_allclose(last.Q, alone.Q, rtol=1e-9)
