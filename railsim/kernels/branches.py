"""Branches that are rarely taken, said to the compiler.

It puts their instructions behind all others and calls their functions instead of repeating them in
place.  A step runs through more instructions than the processor keeps at hand, and those of options
that are not used would be fetched with their neighbours.
"""

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def _unlikely(typingctx, condition):
    """Return the condition, which is rarely true."""

    def codegen(context, builder, sig, args):
        bit = ir.IntType(1)
        kind = ir.FunctionType(bit, [bit, bit])
        expect = cgutils.get_or_insert_function(builder.module, kind, "llvm.expect.i1")
        return builder.call(expect, [args[0], ir.Constant(bit, 0)])

    return types.boolean(types.boolean), codegen


unlikely = bool if numba.config.DISABLE_JIT else _unlikely
