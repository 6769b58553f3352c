"""Five hundred damaged profile files: refused with a reason or usable, never anything else."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

from railsim.contact import build_contact_table, contact_geometry
from railsim.contact.table import TableGrid
from railsim.errors import InputError
from railsim.profiles import load_profile

sys.path.append(str(Path(__file__).parents[1] / "unit"))
from profile_files import bare, csv_m, csv_mm, damaged, miniprof, points, simpack

FORMATS = {
    "wheel": [
        (csv_mm, ".csv"),
        (csv_m, ".csv"),
        (bare, ".txt"),
        (simpack, ".prw"),
        (miniprof, ".whl"),
    ],
    "rail": [
        (csv_mm, ".csv"),
        (csv_m, ".csv"),
        (bare, ".txt"),
        (simpack, ".prr"),
        (miniprof, ".ban"),
    ],
}
LATERAL = np.linspace(-0.006, 0.006, 13)
GRID = TableGrid(ds=1e-3, roll_max=0.006, droll=2e-3, n_w=2)


@pytest.mark.slow
@pytest.mark.parametrize("number", [20, pytest.param(500, marks=pytest.mark.further)])
def test_damaged_files_are_refused_or_usable(number, tmp_path):
    outcomes = {"refused": 0, "usable": 0}
    clean = {"wheel": points("S1002"), "rail": points("60E1")}
    partner = {"wheel": load_profile("60E1"), "rail": load_profile("S1002")}
    for seed in range(number):
        rng = np.random.default_rng(seed)
        kind = ("wheel", "rail")[seed % 2]
        writer, suffix = FORMATS[kind][rng.integers(5)]
        path = tmp_path / f"damaged{seed}{suffix}"
        path.write_text(damaged(writer(*clean[kind], kind=kind), rng), encoding="utf-8")
        start = time.perf_counter()
        try:
            profile = load_profile(str(path), kind)
            pair = (profile, partner[kind]) if kind == "wheel" else (partner[kind], profile)
            geometry = contact_geometry(*pair, lateral=LATERAL)
            assert np.isfinite(geometry.delta_r[6]), path
            if seed % 5 == 0:
                assert np.all(np.isfinite(build_contact_table(*pair, grid=GRID).values)), path
            outcomes["usable"] += 1
        except InputError:
            outcomes["refused"] += 1
        # a hang would be a loop without end, not a slow machine
        assert time.perf_counter() - start < 30.0, path
    # the damage is neither always fatal nor always harmless
    assert min(outcomes.values()) > number // 5, outcomes
