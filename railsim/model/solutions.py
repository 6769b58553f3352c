"""Equilibria and stable time steps on disk, found once for all runs with the same inputs.

Both depend on the inputs and on the program alone, and are read back to the last bit: a first run
and all later ones are the same.  The key of a solution holds all that enters: inputs, sources,
versions of the libraries that compute, and the processor.
"""

import hashlib
import json
import os
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import numpy as np

from railsim import kernels
from railsim.kernels.cache import cache_subfolder, load, store
from railsim.kernels.lock import exclusive

MOST_STORED = 1000
"""Solutions on disk; the older half of more goes."""
MOST_NEW = 50
"""Solutions of a kind that a process stores, shared ones apart: the runs of a large study each have
their own."""
_SOURCES = ("contact", "definitions", "linear", "model", "profiles", "simulation", "track")
_new: Counter[str] = Counter()


def solution(
    kind: str, inputs: str, solve: Callable[[], dict[str, Any]], *, shared: bool = False
) -> dict[str, Any]:
    """Return what was found for these inputs before, or what is found now.

    `kind`: what is sought; `inputs`: all that it depends on, the program apart; `solve`: finds it:
    numbers, texts and lists of them by name. What it raises is not stored. `shared`: many runs of a
    study have it in common: one process finds it, the others wait.
    """
    folder = solutions_folder(os.environ.get("RAILSIM_CACHE_DIR"))
    if folder is None:
        return solve()
    key = hashlib.sha256(f"{program_hash()} {kind} {inputs}".encode()).hexdigest()[:32]
    path = folder / f"{key}.json"
    result: dict[str, Any]
    if (data := load(path)) is None:
        with exclusive(path.with_suffix(".lock")) if shared else nullcontext():
            if not shared or (data := load(path)) is None:  # not by one that was waited for
                result = solve()
                if shared or _new[kind] < MOST_NEW:
                    _new[kind] += not shared
                    _drop_old(path.parent)
                    store(path, json.dumps(result).encode())
                return result
    result = json.loads(data)
    return result


@cache
def solutions_folder(cache_folder: str | None) -> Path | None:
    """Folder of the solutions in the cache, looked at once a process."""
    return cache_subfolder("solutions")


@cache
def program_hash() -> str:
    """Hash of everything but the inputs that decides the bits of a solution."""
    package = Path(__file__).parent.parent
    versions = f"{kernels.source_hash(package / 'kernels')} numpy {np.__version__}"
    processor = llvmlite.binding.get_host_cpu_name()
    digest = hashlib.sha256(f"{versions} {processor}".encode())
    for room in _SOURCES:
        for path in sorted((package / room).rglob("*.py")):
            digest.update(path.name.encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _drop_old(folder: Path) -> None:
    """Remove the older half of the solutions where there are too many."""
    if len(os.listdir(folder)) <= MOST_STORED:  # with the mark
        return
    ages = {path: path.stat().st_mtime for path in folder.glob("*.json") if path.exists()}
    for path in sorted(ages, key=ages.__getitem__)[: len(ages) // 2]:
        path.unlink(missing_ok=True)
