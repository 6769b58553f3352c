"""Compiled kernels: floats and arrays in, floats and status codes out.

Only math, numpy, numba and each other are imported here.  Compiled code is cached on disk in a
folder named after a hash of *all* kernel sources: numba itself notices an edit only in the file
that holds the compiled function, so that a caller would keep running an old callee.
"""

import hashlib
import os
import shutil
from pathlib import Path

import numba
from numba.core import config as _config

# The subset of fastmath that keeps NaN and infinity visible to the blow-up checks.
FASTMATH = {"contract", "arcp", "reassoc", "nsz"}


def jit(function):
    """Compile `function` with numba: cached, numpy error model, NaN-preserving fastmath."""
    return numba.njit(cache=True, error_model="numpy", fastmath=FASTMATH, _nrt=False)(function)


def jit_inline(function):
    """As `jit`, for a small function that is put into its caller.

    A call with a tuple of arrays puts all their descriptions on the stack, some hundred words; in
    the innermost loops that costs more than the function itself.
    """
    return numba.njit(cache=True, error_model="numpy", fastmath=FASTMATH, inline="always",
                      _nrt=False)(function)


def source_hash(folder: Path) -> str:
    """Hash of all kernel sources in `folder` and of the versions that compile them."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(folder.glob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    base = os.environ.get("RAILSIM_CACHE_DIR")
    if base is None:
        base = os.environ.get("XDG_CACHE_HOME", "") or str(Path.home() / ".cache")
        base = str(Path(base) / "railsim")
    return Path(base) / "kernels" / source_hash(Path(__file__).parent)


def _use_own_cache() -> None:
    """Point numba to the folder of these sources unless the user has set one."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    folder = _cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return  # numba falls back to its own choice of folder
    for old in folder.parent.iterdir():
        # keep the newest few: another version of railsim may be in use beside this one
        if old != folder and old.is_dir() and _is_stale(old, folder):
            shutil.rmtree(old, ignore_errors=True)
    _config.CACHE_DIR = str(folder)


def _is_stale(old: Path, current: Path) -> bool:
    month = 30 * 24 * 3600.0
    return old.stat().st_mtime < current.stat().st_mtime - month


_use_own_cache()
