"""Compiled kernels: floats and arrays in, floats and status codes out.

Only math, numpy, numba and each other are imported here.  Compiled code is cached on disk in a
folder named after a hash of *all* kernel sources: numba itself notices an edit only in the file
that holds the compiled function, so that a caller would keep running an old callee.

Every compiled function holds its callees for itself.  By numba's own choice the callees of one
name, compiled alone or within several callers, are merged when they are loaded: the first one
wins.  They are optimised differently, sums are reordered, and the last bits of a run would depend
on what the process compiled or called before.
"""

import hashlib
import os
import shutil
import sys
import time
from contextlib import suppress
from pathlib import Path

import llvmlite
import numba
from llvmlite.binding import Linkage
from numba.core import config as _config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.registry import CPUDispatcher

from railsim.kernels.cache import KernelCache, cache_base, safe_folder

# The subset of fastmath that keeps NaN and infinity visible to the blow-up checks.
FASTMATH = {"contract", "arcp", "reassoc", "nsz"}
# What of it is left where every sum and product is rounded as it is written.
ORDERED = {"nsz"}


def source_hash(folder: Path) -> str:
    """Hash of all kernel sources in `folder` and of the versions that compile them."""
    versions = f"{numba.__version__} {llvmlite.__version__} {sys.implementation.cache_tag}"
    digest = hashlib.sha256(versions.encode())
    for path in sorted(folder.glob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path | None:
    """Folder of these sources' compiled code; None where it must not or cannot be used."""
    own = os.environ.get("NUMBA_CACHE_DIR")  # a user's choice comes first
    base = Path(own) if own else cache_base()
    hashed = source_hash(Path(__file__).parent)
    folder = safe_folder(base and (base / "kernels" / hashed))
    if folder is not None:
        with suppress(OSError):
            _drop_old(folder)
    return folder


def _drop_old(folder: Path) -> None:
    """Remove code of sources that nobody has used for a month, and files never finished."""
    now = folder.stat().st_mtime
    for old in folder.parent.iterdir():
        # another version of railsim may be in use beside this one
        if old != folder and old.is_dir() and old.stat().st_mtime < now - 30 * 24 * 3600.0:
            shutil.rmtree(old, ignore_errors=True)
    for part in folder.glob("*.part"):
        if part.stat().st_mtime < time.time() - 3600.0:
            part.unlink(missing_ok=True)


_FOLDER = _cache_folder()


class _SelfContained(JITCodeLibrary):  # type: ignore[misc]
    """Compiled code whose callees are invisible to all other code."""

    def _finalize_final_module(self):
        self._finalized = True  # no more is added: what callers link is taken before
        self._get_module_for_linking()
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal
        super()._finalize_final_module()


class _Flags(Flags):  # type: ignore[misc]
    """Compiler flags that are compared by those that are set.

    Numba looks up each operator under a key with the flags; its own comparison goes through all
    thirty of them in Python, some 400 000 times for the time loop: a quarter of its compilation.
    """

    def __hash__(self):
        return hash(frozenset(self._values))

    def __eq__(self, other):
        if isinstance(other, _Flags):
            return self._values == other._values
        return super().__eq__(other)


class _Compiler(Compiler):  # type: ignore[misc]
    def compile_extra(self, func):
        self.state.flags = _Flags(self.state.flags)
        self.state.library = _SelfContained(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


def _compiled(function, fastmath=FASTMATH, **options):
    """Compile into the cache of these sources."""
    compiled = numba.njit(
        error_model="numpy",
        fastmath=fastmath,
        pipeline_class=_Compiler,
        no_cfunc_wrapper=True,
        **options,
    )(function)
    if _FOLDER is not None and not _config.DISABLE_JIT:
        compiled._cache = KernelCache(function, _FOLDER)
    return compiled


def jit(function):
    """Compile for the time loop: numpy error model, NaN-preserving fastmath, no allocation."""
    return _compiled(function, _nrt=False)


class _Internal(CPUDispatcher):  # type: ignore[misc]
    """Compiled function without an entry for Python, where a call of it would crash."""

    def __call__(self, *args):
        raise TypeError(f"{self.py_func.__name__} can be called from compiled code only")


def jit_internal(function, **options):
    """As `jit`, for a function that only other compiled code calls.

    The entry for Python, which takes a `System` apart into its arrays, costs more to compile than
    many a function itself.
    """
    compiled = _compiled(function, _nrt=False, no_cpython_wrapper=True, **options)
    if not _config.DISABLE_JIT:
        compiled.__class__ = _Internal
    return compiled


def jit_merged(function):
    """As `jit_internal`, for a part of the time loop: LLVM puts it into its callers.

    A `System` handed down is copied to the stack, some five hundred words: for the right-hand side
    and its parts together a tenth of the time.
    """
    return jit_internal(function, forceinline=True)


def jit_inline(function):
    """As `jit`, for a small function that is put into its caller.

    A call with a tuple of arrays puts all their descriptions on the stack, some hundred words; in
    the innermost loops that costs more than the function itself.
    """
    return _compiled(function, inline="always", _nrt=False)


def jit_ordered(function):
    """As `jit`, but for a loop over contact patches that gives each the same bits everywhere.

    Of many patches the compiler takes eight at a time, of few one after the other; free to reorder,
    it would do so in another way for each, and a run would depend on what else is in its call.
    """
    return _compiled(function, ORDERED, _nrt=False)


def jit_outside(function):
    """Compile for use outside the time loop: may allocate, lets other Python threads run."""
    return _compiled(function, nogil=True)
