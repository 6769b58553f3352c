"""Full disks, folders that go away, killed writers: nothing half-written, nothing lost."""

import os
import subprocess
import sys
from contextlib import suppress
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from cases import tried
from selection import points

from railsim.cli import main
from railsim.errors import InputError
from railsim.files.access import PartialFile, sweep, whole_file, write_folder
from railsim.result import check_result
from railsim.studies.journal import Journal

sys.path.append(str(Path(__file__).parents[1] / "interface"))
from example_result import example_result

KB = 1024


@pytest.fixture
def small_disk(tmp_path):
    """A file system of six megabytes, really full when it is full; where one may be mounted."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={6 * 1024 * KB}", "tmpfs", str(folder)]
    try:
        done = subprocess.run(command, capture_output=True)
    except FileNotFoundError:
        pytest.skip("no mount here")
    if done.returncode:
        pytest.skip("only root may mount a file system")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def leave(disk, room):
    """Fill a disk up to some bytes."""
    filler = disk / "filler"
    free = os.statvfs(disk).f_bavail * os.statvfs(disk).f_bsize
    if filler.exists():
        free += filler.stat().st_size
        filler.unlink()
    filler.write_bytes(bytes(max(0, free - room)))


def test_full_disk_leaves_no_half_result(small_disk):
    result = example_result(duration=1.0, rate=5.0)
    size = result.to_hdf5(small_disk / "run.h5").stat().st_size
    (small_disk / "run.h5").unlink()

    def case(seed):
        written = False
        leave(small_disk, int(np.random.default_rng(seed).uniform(0, 1.3 * size)))
        with suppress(OSError):
            np.testing.assert_array_equal(
                check_result(result.to_hdf5(small_disk / "run.h5")).Q, result.Q
            )
            written = True
            (small_disk / "run.h5").unlink()
        assert os.listdir(small_disk) == ["filler"]
        return written

    assert set(tried(24, case)) == {True, False}


@points(
    ("command", "room"),
    [
        *product(["plot", "compare"], [0, 4 * KB, 60 * KB]),
        ("info", 4 * KB),  # a picture, as by plot
        ("modes", 4 * KB),
    ],
    always=(1, 3, 7),
)
def test_full_disk_is_one_line(small_disk, tmp_path, capsys, command, room):
    a, b = (str(example_result(duration=2.0).to_hdf5(tmp_path / f"{n}.h5")) for n in "ab")
    leave(small_disk, room)
    given = {
        # one quantity's picture is smaller than the largest room
        "plot": ["plot", a, *["Q"] * (room < 60 * KB), "--out", str(small_disk / "a.png")],
        "compare": ["compare", a, b, "--out", str(small_disk / "out")],
        "modes": ["modes", "coach_manchester", "--quiet", "--out", str(small_disk / "modes")],
        "info": ["info", "coach_manchester", "--draw", str(small_disk / "coach.png")],
    }
    status = main(given[command])
    error = capsys.readouterr().err
    assert status in (0, 1), error
    if status:
        assert error.count("\n") == 1
        assert f"No space left on device: {small_disk}{os.sep}" in error
    left = [path.name for path in small_disk.rglob("*") if path.is_file()]
    assert not [name for name in left if name.endswith(".partial")]


def test_files_that_belong_together_are_all_there_or_none(small_disk):
    """One alone would refuse the same command once there is room."""
    leave(small_disk, 32 * KB)
    folder = small_disk / "out"
    content = {"a.json": bytes(8 * KB), "b.png": bytes(64 * KB)}
    with pytest.raises(OSError, match="No space left on device") as error:
        write_folder(folder, content)
    assert error.value.filename == str(folder / "b.png")
    assert os.listdir(folder) == []
    leave(small_disk, 128 * KB)
    assert write_folder(folder, content) == [folder / "a.json", folder / "b.png"]


def fill(journal, record):
    for number in range(10):
        journal.add({**record, "name": f"run {number}"}, "key", None)


def test_full_disk_keeps_the_journal_whole(small_disk):
    record = {"name": "a", "status": "complete", "x": "x" * 3000}
    with Journal(small_disk) as journal:
        journal.begin({"vehicles": []})
        leave(small_disk, 8 * KB)
        with pytest.raises(OSError, match="No space left"):
            fill(journal, record)
        done = len(journal.entries)
    with Journal(small_disk) as journal:
        assert journal.damaged == 0
        assert len(journal.entries) == done > 0


def test_folder_that_goes_away_is_one_line(tmp_path, monkeypatch, capsys):
    import railsim.studies.case

    def simulate(*_, sink, **how):
        (tmp_path / "out").rename(tmp_path / "moved")
        from example_result import feed

        return feed(sink, duration=1.0)

    monkeypatch.setattr(railsim.studies.case, "simulate", simulate)
    (tmp_path / "out").mkdir()
    given = ["run", "coach_manchester", "straight", "--speed", "20", "--quiet"]
    assert main([*given, "--out", str(tmp_path / "out" / "run.h5")]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "No such file or directory" in error


def test_second_writer_is_refused_and_the_first_goes_on(tmp_path):
    with PartialFile(tmp_path / "run.h5", alone=True) as first:
        with pytest.raises(InputError, match="being written by another process"):
            PartialFile(tmp_path / "run.h5", alone=True)
        with PartialFile(tmp_path / "other.h5", alone=True):
            pass
        first.path.write_text("whole")
        first.finish()
    assert (tmp_path / "run.h5").read_text() == "whole"


def test_file_that_appeared_in_the_meantime_is_kept_and_so_is_the_result(tmp_path):
    with PartialFile(tmp_path / "run.h5") as partial:
        partial.path.write_text("result")
        (tmp_path / "run.h5").write_text("of somebody else")
        assert partial.finish(overwrite=False) == tmp_path / "run-2.h5"
    assert (tmp_path / "run.h5").read_text() == "of somebody else"
    assert (tmp_path / "run-2.h5").read_text() == "result"


def test_partial_files_of_the_dead_are_swept_and_nothing_else(tmp_path):
    program = (
        "import os, sys; from pathlib import Path; from railsim.files.access import PartialFile;"
        "PartialFile(Path(sys.argv[1])); os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", program, tmp_path / "run.h5"])
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".run.h5.")
    # the third is what rclone writes of a file `.notes`
    others = [".run.h5.railsim.partial", "x.abcdefgh.railsim.partial", ".notes.1a2b3c4d.partial"]
    for name in others:
        (tmp_path / name).touch()
    (tmp_path / ".link.h5.abcdefgh.railsim.partial").symlink_to(tmp_path / others[0])
    with PartialFile(tmp_path / "other.h5") as alive:
        sweep(tmp_path)
        names = {path.name for path in tmp_path.iterdir()}
        assert names == {*others, ".link.h5.abcdefgh.railsim.partial", alive.path.name}


def test_hidden_names_cannot_be_foreseen_and_go_through_no_link(tmp_path):
    names = set()
    for _ in range(20):
        with PartialFile(tmp_path / "run.h5") as partial:
            names.add(partial.path.name)
            assert partial.path.stat().st_mode & 0o777 == 0o600
    assert len(names) == 20


def test_longest_name_can_be_written(tmp_path):
    path = tmp_path / f"{'ü' * 125}.txt"
    with whole_file(path) as partial:
        partial.write_text("whole")
    assert path.read_text() == "whole"


def test_too_long_a_name_is_refused(tmp_path, capsys):
    given = ["run", "coach_manchester", "straight", "--speed", "20"]
    assert main([*given, "--out", str(tmp_path / f"{'x' * 300}.h5")]) == 2
    assert "File name too long" in capsys.readouterr().err
