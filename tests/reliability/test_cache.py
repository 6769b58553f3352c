"""The cache under damage: what comes out is what went in, or nothing."""

import errno
import os

import numpy as np
import pytest
from cases import tried
from mutations import bytes_damaged

from railsim.kernels import cache


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
        found = cache.stored(path)
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
    assert cache.stored(tmp_path / "real") == b"data"
    assert cache.stored(tmp_path / "link") is None
    assert cache.stored(tmp_path / "pipe") is None


def test_full_disk_costs_nothing_but_time(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    cache.store(tmp_path / "a", b"data")
    cache.store(tmp_path / "b", b"data")
    assert list(tmp_path.iterdir()) == []
    (said,) = cache.notices
    assert "cannot be written (No space left on device)" in said
