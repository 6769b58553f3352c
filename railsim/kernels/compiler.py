"""The compiler: all that railsim uses of numba's inside, and what it does without it.

Numba's private parts are used here and nowhere else.  They make compilation two fifths shorter,
keep compiled code by the hash of all sources, and give every run the same bits whatever else is
compiled.
Where they are missing, or where `RAILSIM_PLAIN_NUMBA=1` asks for it, functions are compiled by
numba's public means: slower to compile, and the last bits of a run may depend on what was compiled
before, but the same formulas.  A version of numba costs time at worst.

Every compiled function holds its callees for itself.  By numba's own choice the callees of one
name, compiled alone or within several callers, are merged when they are loaded: the first one
wins.  They are optimised differently, sums are reordered, and the last bits of a run would depend
on what the process compiled or called before.
"""

import hashlib
import os
import pickle
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numba
from numba.core import config as _config
from numba.extending import intrinsic, overload

from railsim.kernels.cache import discard, load, store, warn_once
from railsim.kernels.lock import exclusive

try:
    from llvmlite.binding import Linkage, parse_bitcode
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler, CompileResult, Flags
    from numba.core.inline_closurecall import InlineWorker
    from numba.core.ir import Loc
    from numba.core.registry import CPUDispatcher
    from numba.core.runtime.nrt import rtsys
    from numba.core.serialize import dumps
    from numba.core.types import BaseFunction
    from numba.core.typing.templates import AbstractTemplate, infer_global, signature

    MISSING = ""
except ImportError as error:
    MISSING = str(error)

PRIVATE = not MISSING and os.environ.get("RAILSIM_PLAIN_NUMBA", "") in ("", "0")
"""Whether numba's private parts are used."""

if MISSING:
    warn_once(
        f"numba {numba.__version__} is not known to this railsim ({MISSING}): kernels are compiled "
        "by its public means, more slowly"
    )

if PRIVATE:

    class _SelfContained(JITCodeLibrary):  # type: ignore[misc]
        """Compiled code whose callees are invisible to all other code."""

        def add_linking_library(self, library):
            """Take a callee, and what that one calls."""
            super().add_linking_library(library)
            if isinstance(library, _Part):
                for callee in library._linking_libraries:
                    self.add_linking_library(callee)

        def _optimize_final_module(self):
            # Once: numba's first pass prepares the removal of reference counts.  What nobody else
            # sees may be put into its only caller.
            self._hide_callees()
            passes = self._codegen._module_pass_manager()
            if isinstance(passes, tuple):
                passes[0].run(self._final_module, passes[1])
            else:  # before numba 0.62
                passes.run(self._final_module)

        def _finalize_final_module(self):
            self._finalized = True  # no more is added: what callers link is taken before
            self._get_module_for_linking()
            self._hide_callees()
            super()._finalize_final_module()

        def _hide_callees(self):
            for function in self._final_module.functions:
                if function.linkage == Linkage.linkonce_odr:
                    function.linkage = Linkage.internal

    class _NoEnvironment:
        @staticmethod
        def set_env(name, env):
            """Nothing: a part raises no exceptions."""

    class _Part(_SelfContained):
        """Code that only compiled code calls: optimised and translated with its callers alone."""

        codegen = _NoEnvironment()

        def finalize(self):
            """Nothing is added any more."""
            self._raise_if_finalized()
            self._finalized = True

        def get_pointer_to_function(self, name):
            """None: it is nowhere in memory."""
            return 0

    class _Stored(JITCodeLibrary):  # type: ignore[misc]
        """Compiled code from the disk, whose bitcode is parsed when other code is compiled with it.

        To parse it and to fill numba's registries, which only compilation needs, takes 0.4 s.
        """

        @classmethod
        def _unserialize(cls, codegen, state):
            name, _, (object_code, bitcode) = state
            library = cls(codegen, name)
            library._bitcode = bitcode
            library.enable_object_caching()
            library._set_compiled_object(object_code)
            library._finalize_final_module()
            return library

        def _get_module_for_linking(self):
            if self._shared_module is None:
                self._shared_module = parse_bitcode(self._bitcode)
                self._codegen._engine._load_defined_symbols(self._shared_module)
            return self._shared_module

        def get_pointer_to_function(self, name):
            return self._codegen._engine.get_function_address(name)

    class _Flags(Flags):  # type: ignore[misc]
        """Compiler flags that are compared by those that are set.

        Numba looks up each operator under a key with the flags; its own comparison goes through all
        thirty of them in Python, some 400 000 times for the time loop: a quarter of its
        compilation.
        """

        def __hash__(self):
            return hash(frozenset(self._values))

        def __eq__(self, other):
            if isinstance(other, _Flags):
                return self._values == other._values
            return super().__eq__(other)

    _resolved: dict[tuple[Any, ...], Any] = {}
    _resolve = BaseFunction.get_call_type

    def _resolve_once(function, context, args, kws):
        """Signature of a call of numba's own functions and operators; found once for its types.

        For each of 44 000 operators in the kernels numba tries some ten rules, until one applies.
        """
        if kws:
            return _resolve(function, context, args, kws)
        call = context, function, args
        signature = _resolved.get(call) or _resolve(function, context, args, kws)
        if signature is not None:  # nothing: another module may define it yet
            _resolved[call] = signature
        return signature

    BaseFunction.get_call_type = _resolve_once

    _parsed: dict[tuple[Any, ...], Any] = {}
    _parse = InlineWorker.run_untyped_passes

    def _parse_once(worker, function, enable_ssa=False):
        """Representation of an inlined function, of which numba puts a copy into each caller."""
        call = function, enable_ssa
        if call not in _parsed:
            _parsed[call] = _parse(worker, function, enable_ssa)
        worker.flags.enable_ssa = enable_ssa
        return _parsed[call]

    InlineWorker.run_untyped_passes = _parse_once
    Loc.__deepcopy__ = lambda place, _: place  # a line of the source; no copy of it is changed

    class _Compiler(Compiler):  # type: ignore[misc]
        library = _SelfContained

        def compile_extra(self, func):
            self.state.flags = _Flags(self.state.flags)
            self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
            self.state.library.enable_object_caching()
            return super().compile_extra(func)

    class _PartCompiler(_Compiler):
        library = _Part

    class _Kept(CPUDispatcher):  # type: ignore[misc]
        """Compiled function whose code is on disk: what is missing there one process compiles."""

        def compile(self, sig):
            with ExitStack() as until_stored:
                self._cache.until_stored = until_stored
                return super().compile(sig)

    class _Internal(CPUDispatcher):  # type: ignore[misc]
        """Compiled function without an entry for Python, where a call of it would crash."""

        def __call__(self, *args):
            raise TypeError(f"{self.py_func.__name__} can be called from compiled code only")


class KernelCache:
    """Compiled code of one function on disk, as numba's dispatcher wants it.

    One file for every signature, kind of processor and way of compiling that a user asks numba for;
    which sources they belong to is said by the name of the folder.
    """

    def __init__(self, function: Callable[..., object], folder: Path) -> None:
        self._folder = folder
        module = function.__module__.rpartition(".")[2]
        self._name = f"{module}.{function.__qualname__}"
        closure = [cell.cell_contents for cell in function.__closure__ or ()]
        self._code = hashlib.sha256(function.__code__.co_code + repr(closure).encode()).hexdigest()
        self.until_stored = ExitStack()

    @property
    def cache_path(self) -> str:
        """Folder of the files."""
        return str(self._folder)

    def _path(self, signature: object, codegen) -> Path:
        how = str(_config.OPT), _config.BOUNDSCHECK
        key = repr((str(signature), codegen.magic_tuple(), self._code, how))
        digest = hashlib.sha256(key.encode()).hexdigest()[:24]
        return self._folder / f"{self._name}-{digest}.nbc"

    def load_overload(self, signature, target_context):
        """Return the compiled function of a signature, or None."""
        codegen = target_context.codegen()
        path = self._path(signature, codegen)
        data = load(path)
        if data is None:
            self.until_stored.enter_context(exclusive(path.with_suffix(".lock")))
            data = load(path)  # by the process that was waited for
        if data is not None:
            rtsys.initialize(target_context)
            usual, codegen._library_class = codegen._library_class, _Stored
            try:
                return CompileResult._rebuild(target_context, *pickle.loads(data))
            except Exception:  # what another version of a library has written
                discard(path)
            finally:
                codegen._library_class = usual
        target_context.refresh()  # what the compilation that follows needs
        return None

    def save_overload(self, signature, result) -> None:
        """Store the compiled function of a signature."""
        if not result.lifted and not result.library.has_dynamic_globals:
            store(self._path(signature, result.codegen), dumps(result._reduce()))

    def enable(self) -> None:
        """Nothing to do: it is on."""

    def disable(self) -> None:
        """Nothing to do."""

    def flush(self) -> None:
        """Forget all signatures."""
        for path in self._folder.glob(f"{self._name}-*.nbc"):
            path.unlink(missing_ok=True)


def entry(function: Any, *args: object) -> Any:
    """Return a compiled function without what finds its types, for arguments of these types.

    It has been called with such arguments before.  Numba looks through a `System` for its type,
    20 us a call; the function itself takes a few microseconds.
    """
    if not PRIVATE or _config.DISABLE_JIT:
        return function
    kinds = tuple(function.typeof_pyval(value) for value in args)
    return function.overloads[kinds].entry_point


def compile_kernel(function, folder, fastmath, *, python=True, allocates=False, **options):
    """Compile a function, keeping the code in `folder`.

    Parameters
    ----------
    function : callable
    folder : Path or None
        Where compiled code of these sources is kept; None keeps none.
    fastmath : set of str
        Which freedom the compiler has with sums and products.
    python : bool
        Whether Python calls it too; the entry for Python, which takes a `System` apart into its
        arrays, costs more to compile than many a function itself.
    allocates : bool
        Whether it may allocate arrays.
    **options
        Public options of `numba.njit`.
    """
    if not PRIVATE:
        return _compile_publicly(function, folder, fastmath, options)
    compiled = numba.njit(
        error_model="numpy",
        fastmath=fastmath,
        pipeline_class=_Compiler if python else _PartCompiler,
        no_cfunc_wrapper=True,
        **({} if python else {"no_cpython_wrapper": True}),
        **({} if allocates else {"_nrt": False}),
        **options,
    )(function)
    if _config.DISABLE_JIT:
        return compiled
    if not python:
        compiled.__class__ = _Internal
    elif folder is not None:
        compiled.__class__ = _Kept
        compiled._cache = KernelCache(function, folder)
    return compiled


def _compile_publicly(function, folder: Path | None, fastmath, options):
    """Compile by numba's public means; its own cache in the folder of these sources."""
    user_folder = _config.CACHE_DIR
    try:
        if folder is not None:
            _config.CACHE_DIR = str(folder / "plain")
        cached = folder is not None and Path(function.__code__.co_filename).is_file()
        return numba.njit(error_model="numpy", fastmath=fastmath, cache=cached, **options)(function)
    finally:
        _config.CACHE_DIR = user_folder


def define_operator(operation, result_of, lower):
    """Let an operator of Python take further types in compiled code.

    Parameters
    ----------
    operation : callable
        Such as `operator.add`.
    result_of : callable
        Type of the result of some types, None where they are not concerned.
    lower : callable
        Writes the instructions: context, builder, signature, values; registered with numba already
        for all types that are concerned.
    """
    if PRIVATE:

        @infer_global(operation)
        class _Template(AbstractTemplate):  # type: ignore[misc]
            def generic(self, args, kws):
                result = result_of(args)
                return None if result is None else signature(result, *args)

        return

    @intrinsic
    def of_one(typingctx, a):
        return result_of((a,))(a), lower

    @intrinsic
    def of_two(typingctx, a, b):
        return result_of((a, b))(a, b), lower

    if operation.__name__ == "neg":

        @overload(operation, inline="always")
        def one(a):
            return (lambda a: of_one(a)) if result_of((a,)) is not None else None

        return

    @overload(operation, inline="always")
    def two(a, b):
        return (lambda a, b: of_two(a, b)) if result_of((a, b)) is not None else None
