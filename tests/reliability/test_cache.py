"""The cache: what comes out is what went in, or nothing; nobody else's files are touched."""

import errno
import os
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from cases import tried
from mutations import bytes_damaged

import railsim.kernels
from railsim.contact import stored_table
from railsim.kernels import cache

AGO = time.time() - 60 * 24 * 3600.0  # two months
# a group that is not only the user's own; only root may give files to a group it is not in
GROUP = 54321 if os.geteuid() == 0 else (os.getgid(), *os.getgroups())[-1]


@pytest.fixture(autouse=True)
def fresh():
    cache.notices.clear()
    yield
    cache.notices.clear()
    cache._unwritable.clear()


def test_damaged_files_are_left_out(tmp_path):
    data = np.random.default_rng(0).bytes(5000)

    def case(seed):
        path = tmp_path / f"{seed}.nbc"
        cache.store(path, data)
        path.write_bytes(bytes_damaged(path.read_bytes(), np.random.default_rng(seed)))
        found = cache.load(path)
        assert found in (None, data), seed
        assert path.exists() == (found is not None)  # a damaged file is made anew
        return "lost" if found is None else "kept"

    outcomes = tried(60, case)
    assert outcomes.count("lost") > 0.9 * len(outcomes)
    assert len(cache.notices) == 1  # said once


def test_link_and_pipe_are_no_cache(tmp_path):
    cache.store(tmp_path / "real", b"data")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    os.mkfifo(tmp_path / "pipe")
    assert cache.load(tmp_path / "real") == b"data"
    assert cache.load(tmp_path / "link") is None
    assert cache.load(tmp_path / "pipe") is None


def test_full_disk_costs_nothing_but_time(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    cache.store(tmp_path / "a", b"data")
    cache.store(tmp_path / "b", b"data")
    assert list(tmp_path.iterdir()) == []
    (said,) = cache.notices
    assert "cannot be written (No space left on device)" in said


def tree(folder):
    """Every path below a folder with its kind, permissions and size."""
    return {
        path: (path.lstat().st_mode, path.lstat().st_size if path.is_file() else 0)
        for path in folder.rglob("*")
    }


def aged(folder):
    for path in (*folder.rglob("*"), folder):
        os.utime(path, (AGO, AGO), follow_symlinks=False)


@pytest.fixture
def variable(tmp_path, monkeypatch):
    """The folder that RAILSIM_CACHE_DIR names."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("RAILSIM_CACHE_DIR", str(tmp_path / "given"))
    return tmp_path / "given"


@pytest.mark.parametrize("name", ["RAILSIM_CACHE_DIR", "NUMBA_CACHE_DIR"])
def test_folders_of_others_are_neither_removed_nor_changed(name, tmp_path, monkeypatch):
    """Whatever they are called, as old as they may be, beside the cache and inside it."""
    monkeypatch.setenv(name, str(tmp_path))
    own = railsim.kernels._cache_folder()
    for folder in (tmp_path / "kernels", tmp_path / "tables", own.parent):
        for other in ("linux-6.1", "0123456789abcdef"):
            (folder / other).mkdir(parents=True, exist_ok=True)
            (folder / other / "thesis.tex").write_text("years of work")
    (own.parent / "fedcba9876543210").symlink_to(tmp_path / "kernels" / "linux-6.1")
    aged(tmp_path)
    os.utime(own)
    before = tree(tmp_path)
    assert railsim.kernels._cache_folder() == own
    assert tree(tmp_path) == before


def test_code_of_sources_unused_for_a_month_is_removed(variable):
    recent, old, full = (cache.cache_subfolder("kernels", 16 * digit) for digit in "123")
    for folder in (recent, old, full):
        (folder / "plain" / "rhs_1").mkdir(parents=True)
        for name in ("rhs.step-1.nbc", "rhs.step-2.nbc1.part", "plain/rhs_1/rhs.step.nbi"):
            (folder / name).touch()
    (full / "notes.txt").write_text("somebody's")
    for folder in (recent, old, full):
        aged(folder)
    os.utime(recent / cache.MARK)  # compiled long ago, and in use
    current = railsim.kernels._cache_folder()
    assert {path.name for path in current.parent.iterdir() if path.is_dir()} == {
        current.name, recent.name, full.name
    }  # fmt: skip
    assert {path.name for path in full.iterdir()} == {cache.MARK, "notes.txt"}
    assert (recent / "plain" / "rhs_1" / "rhs.step.nbi").exists()


def test_files_never_finished_are_removed_after_an_hour(variable):
    own = railsim.kernels._cache_folder()
    cache.store(own / "code", b"data")
    for name, age in (("old.part", 2 * 3600.0), ("new.part", 60.0)):
        (own / name).touch()
        os.utime(own / name, 2 * (time.time() - age,))
    railsim.kernels._cache_folder()
    assert {path.name for path in own.iterdir()} == {cache.MARK, "code", "new.part"}


def test_folder_of_that_name_with_other_files_is_not_taken_for_the_cache(variable):
    """As the clone of a repository would be, with folders `kernels` and `tables` of its own."""
    (variable / "railsim" / "kernels").mkdir(parents=True)
    (variable / "railsim" / "README.md").touch()
    before = tree(variable)
    assert cache.cache_subfolder("kernels", 16 * "0") is None
    assert tree(variable) == before
    (said,) = cache.notices
    assert "is not a cache of railsim's; choose another folder by RAILSIM_CACHE_DIR" in said


def test_every_missing_folder_is_made_for_its_user_only(variable):
    before = os.umask(0o002)
    try:
        folder = cache.cache_subfolder("kernels", 16 * "0")
    finally:
        os.umask(before)
    for path in (variable, variable / "railsim", folder.parent, folder):
        assert path.stat().st_mode & 0o777 == 0o700
    for path in (variable / "railsim", folder.parent, folder):
        assert (path / cache.MARK).read_text().startswith("Signature: 8a477f597d28d172789f0688")
    assert not (variable / cache.MARK).exists()


@pytest.mark.parametrize("mode", [0o755, 0o775, 0o777, 0o2775])
def test_own_folder_is_put_right(variable, mode):
    folder = cache.cache_subfolder("kernels", 16 * "0")
    for path in (folder, folder.parent, folder.parent.parent):
        path.chmod(mode)
    assert cache.cache_subfolder("kernels", 16 * "0") == folder
    for path in (folder, folder.parent, folder.parent.parent):
        assert path.stat().st_mode & 0o7777 == 0o700
    assert not cache.notices


def test_shared_primary_group_and_umask_002(tmp_path, monkeypatch):
    """As on clusters; also the folder that an earlier railsim has made there, without a mark."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("RAILSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home" / ".cache"))
    home = tmp_path / "home"
    home.mkdir()
    os.chown(home, -1, GROUP)
    home.chmod(0o2775)  # all that is made here belongs to the group
    before = os.umask(0o002)
    try:
        (home / ".cache" / "railsim" / "kernels").mkdir(parents=True)
        folder = railsim.kernels._cache_folder()
    finally:
        os.umask(before)
    assert not cache.notices
    assert folder.is_relative_to(home)
    assert folder.parent.stat().st_gid == GROUP
    assert (home / ".cache" / "railsim").stat().st_mode & 0o777 == 0o700
    assert (home / ".cache").stat().st_mode & 0o777 == 0o775  # not railsim's


def test_folder_above_that_everybody_may_write_to_is_refused(variable):
    variable.mkdir()
    variable.chmod(0o777)
    assert cache.cache_subfolder("tables") is None
    (said,) = cache.notices
    assert f"other users may write to {variable}" in said


def test_cache_of_another_user_is_refused(variable, monkeypatch):
    folder = cache.cache_subfolder("tables")
    cache.store(folder / "code", b"mine")
    if os.geteuid() == 0:
        os.chown(folder / "code", 54321, 54321)
        os.chown(folder, 54321, 54321)
    else:  # only root may give files away
        monkeypatch.setattr(os, "geteuid", lambda: 54321)
    assert cache.load(folder / "code") is None
    assert cache.cache_subfolder("tables") is None
    (said,) = cache.notices
    assert f"{folder} belongs to another user" in said


def test_file_that_others_may_write_to_is_not_loaded(tmp_path):
    cache.store(tmp_path / "code", b"data")
    (tmp_path / "code").chmod(0o664)
    assert cache.load(tmp_path / "code") is None
    cache.store(tmp_path / "code", b"data")
    assert cache.load(tmp_path / "code") == b"data"


def test_cache_on_a_read_only_disk_is_used_as_it_is(variable, monkeypatch):
    folder = cache.cache_subfolder("tables")
    cache.store(folder / "code", b"data")

    def refused(path, *_, **__):
        if not Path(path).exists():
            raise OSError(errno.EROFS, "Read-only file system")
        raise FileExistsError

    monkeypatch.setattr(os, "mkdir", refused)
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    assert cache.cache_subfolder("tables") == folder
    assert cache.load(folder / "code") == b"data"
    cache.store(folder / "new", b"data")
    assert not (folder / "new").exists()
    assert not cache.notices
    assert cache.cache_subfolder("kernels") is None  # is not there
    (said,) = cache.notices
    assert "Read-only file system" in said
    assert "choose another folder by RAILSIM_CACHE_DIR" in said


def test_relative_folder_for_caches_is_ignored(tmp_path, monkeypatch):
    """As the base directory specification of XDG asks for."""
    monkeypatch.delenv("RAILSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "caches")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert cache.cache_subfolder("tables") == tmp_path / ".cache" / "railsim" / "tables"


def test_only_the_source_of_the_cache_is_left_out_of_the_hash(tmp_path):
    kernels = tmp_path / "kernels"
    shutil.copytree(Path(railsim.kernels.__file__).parent, kernels)
    before = railsim.kernels.source_hash(kernels)
    for path in sorted(kernels.glob("*.py")):
        text = path.read_text(encoding="utf-8")
        path.write_text(f"{text}#", encoding="utf-8")
        assert (railsim.kernels.source_hash(kernels) == before) == (path.name == "cache.py")
        path.write_text(text, encoding="utf-8")


def test_tables_unused_for_longest_go_where_all_are_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_table, "MOST_BYTES", 2500)
    now = time.time()
    for age, name in ((9e5, "old"), (7e5, "older_file_used_later"), (4e4, "new"), (10.0, "last")):
        for end in ("json", "checked", "npy"):
            (tmp_path / f"{name}.{end}").write_bytes(bytes(1000))
        os.utime(tmp_path / f"{name}.json", (now - age, now - age))
    (tmp_path / "half_a_table.json").write_text("{}")
    stored_table.drop_unused(tmp_path)
    names = {"new", "last", "half_a_table"}
    assert {path.stem for path in tmp_path.iterdir()} == names
    monkeypatch.setattr(stored_table, "MOST_BYTES", 0)
    os.utime(tmp_path / "new.json", (now - 60.0, now - 60.0))
    stored_table.drop_unused(tmp_path)  # both used within the hour: another process may map them
    assert {path.stem for path in tmp_path.iterdir()} == names
