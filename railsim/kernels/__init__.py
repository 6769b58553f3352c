"""Compiled kernels: floats and arrays in, floats and status codes out.

Only math, numpy, numba and each other are imported here.  Compiled code is cached on disk in a
folder named after a hash of *all* kernel sources: numba itself notices an edit only in the file
that holds the compiled function, so that a caller would keep running an old callee.  Only `cache`
is left out, in which nothing is compiled.

`compiler` fences what is used of numba's inside.
"""

import functools
import hashlib
import os
import sys
from contextlib import suppress
from pathlib import Path

import llvmlite
import numba

from railsim.kernels.cache import cache_subfolder, remove_old_code
from railsim.kernels.compiler import PRIVATE, compile_kernel

# The subset of fastmath that keeps NaN and infinity visible to the blow-up checks.
FASTMATH = {"contract", "arcp", "reassoc", "nsz"}
# What of it is left where every sum and product is rounded as it is written.
ORDERED = {"nsz"}


def source_hash(folder: Path) -> str:
    """Hash of the kernel sources in `folder`, and of the versions that compile them."""
    versions = f"{numba.__version__} {llvmlite.__version__} {sys.implementation.cache_tag}"
    versions += "" if PRIVATE else " plain"
    digest = hashlib.sha256(versions.encode())
    for path in sorted(set(folder.glob("*.py")) - {folder / "cache.py"}):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path | None:
    """Folder of these sources' compiled code; None where it must not or cannot be used."""
    user_folder = os.environ.get("NUMBA_CACHE_DIR")  # a user's choice comes first
    name = source_hash(Path(__file__).parent)
    folder = cache_subfolder("kernels", name, base=Path(user_folder) if user_folder else None)
    if folder is not None:
        with suppress(OSError):
            remove_old_code(folder)
    return folder


_FOLDER = _cache_folder()


def compiled(function=None, *, python=True, inline=False, ordered=False, in_loop=True):
    """Compile a kernel: numpy error model, fastmath that preserves NaN; kept in the cache.

    Parameters
    ----------
    python : bool
        Whether Python calls it too; its other threads go on meanwhile.  If not, it is optimised and
        translated as a part of its callers alone: half of the time of compilation.
    inline : bool
        For a small function, such as a sum of vectors: numba puts it into its caller, which saves
        the compilation of a call.
    ordered : bool
        For a loop over contact patches: no sum is reordered, and each patch gets the same bits
        everywhere.  Of many patches the compiler takes eight at a time, of few one after the other;
        free to reorder, it would do so in another way for each, and a run would depend on what else
        is in its call.
    in_loop : bool
        False for use outside the time loop: it may allocate.
    """
    if function is None:
        return functools.partial(
            compiled, python=python, inline=inline, ordered=ordered, in_loop=in_loop
        )
    options = {"inline": "always"} if inline else {}
    if python:
        options["nogil"] = True
    return compile_kernel(
        function,
        _FOLDER,
        ORDERED if ordered else FASTMATH,
        python=python,
        allocates=not in_loop,
        **options,
    )
