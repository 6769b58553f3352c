"""A study on a dask cluster of several processes, with and without a folder in common."""

import os
import signal

import numpy as np
import pytest

import railsim
from railsim.result import open_run
from railsim.studies.case import load_case
from railsim.studies.execute import Job, _marks, compile_on_cluster, perform_remotely
from railsim.studies.spec import RunSpec

distributed = pytest.importorskip("distributed")

STUDY = {"vehicles": "coach_manchester", "tracks": "straight", "until": 10.0, "grid": {
    "track.friction": "0.2:0.5:6"}}  # fmt: skip


def arrays(folder):
    found = {}
    for path in sorted(folder.glob("*.h5")):
        result = open_run(path)
        found[path.name] = {name: result[name] for name in result}
    return found


def test_folders_are_marked_while_workers_are_asked_whether_they_see_them(tmp_path):
    folders = {tmp_path / "a", tmp_path / "b"}
    for folder in folders:
        folder.mkdir()
    with _marks(folders) as mark:
        assert all((folder / mark).exists() for folder in folders)
    assert not any(list(folder.iterdir()) for folder in folders)


def test_job_whose_folder_is_not_seen_sends_its_files_back(tmp_path):
    case = load_case(RunSpec("coach_manchester", "straight", 20.0, until=10.0))
    job = Job(case, *(tmp_path / "elsewhere" / name for name in (case.file_name, "a.png")))
    record, files = perform_remotely(job, "nobody made this mark")
    assert record["status"] == "complete"
    assert set(files) == {case.file_name, "a.png"}
    assert files["a.png"].startswith(b"\x89PNG")
    assert not job.path.parent.exists()
    (tmp_path / "here.h5").write_bytes(files[case.file_name])
    assert open_run(tmp_path / "here.h5").status == "complete"


def test_one_worker_of_each_machine_compiles_before_the_others_begin():
    class Client:
        first, told = [], []

        def run(self, function, **_):
            ready = {"tcp://one:1": False, "tcp://one:2": False, "tcp://two:1": False}
            return {**ready, "tls://three:1": True}

        def submit(self, function, workers, **_):
            self.first += workers

        def gather(self, runs, errors):
            assert self.told == [2]

    client = Client()
    compile_on_cluster(client, lambda text: client.told.append(int(text.split()[-1])))
    assert [address[:9] for address in client.first] == ["tcp://one", "tcp://two"]


@pytest.mark.slow
def test_study_survives_the_death_of_a_worker_and_is_that_of_one_process(tmp_path):
    alone = railsim.study(speeds=20.0, out=tmp_path / "alone", workers=1, **STUDY)
    assert not alone.failed
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        pids = [worker.pid for worker in cluster.workers.values()]
        killed, shares = [], []

        def kill(record):
            if not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        outcome = railsim.study(
            speeds=20.0, out=tmp_path / "many", scheduler=cluster.scheduler_address,
            on_record=kill, progress=shares.append, **STUDY
        )  # fmt: skip
    assert killed
    assert shares == sorted(shares)
    assert min(shares) < 0.5
    assert shares[-1] == pytest.approx(1.0)
    assert not outcome.failed
    assert [r["name"] for r in outcome.records] == [r["name"] for r in alone.records]
    one, many = arrays(tmp_path / "alone"), arrays(tmp_path / "many")
    assert one.keys() == many.keys()
    for name, expected in one.items():
        assert all(np.array_equal(expected[q], many[name][q], equal_nan=True) for q in expected)
    assert not [p for p in (tmp_path / "many").iterdir() if p.name.startswith(".")]
