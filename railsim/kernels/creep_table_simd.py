"""Weighted sum of rows of the creep table, written directly in vector registers.

Why this exists: the look-up adds 64 rows of 16 numbers each.  Left to the compiler the sums go to
memory and back with every row (some 400 ns a patch); here they stay in registers.  Any processor
will do: the instructions are generic vectors that LLVM cuts to what it has.

The same in plain Python is :func:`railsim.kernels.creep_table._sum_of_rows_plain`, used where
compilation is switched off; a test holds both to the same result.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_LANES = 8
_BLOCK = 4  # neighbouring rows that are added to sums of their own: hides the latency
_DOUBLES = ir.VectorType(ir.DoubleType(), _LANES)
_FLOATS = ir.VectorType(ir.FloatType(), _LANES)
_INT = ir.IntType(64)


@intrinsic
def sum_of_rows(typingctx, table, offsets, weights, stride, sums):
    """Write to sums (16) the sum over i < 16, j < 4 of weights[4 i + j] times a row.

    The row begins at table[offsets[i] + j stride]; table: ndarray of float32, one dimension;
    offsets: ndarray of int64, shape (16,); weights, sums: ndarray, shapes (64,), (16,).
    """
    signature = types.void(table, offsets, weights, types.intp, sums)

    def codegen(context, builder, sig, args):
        def data(position):
            return context.make_array(sig.args[position])(context, builder, args[position]).data

        _emit(builder, data(0), data(1), data(2), args[3], data(4))
        return context.get_dummy_value()

    return signature, codegen


def _emit(builder, table, offsets, weights, stride, sums):
    kind = ir.FunctionType(_DOUBLES, [_DOUBLES] * 3)
    fma = cgutils.get_or_insert_function(builder.module, kind, "llvm.fma.v8f64")
    zero = ir.Constant(_DOUBLES, [0.0] * _LANES)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), _LANES), [0] * _LANES)

    def splat(value):
        single = builder.insert_element(zero, value, ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(single, zero, mask)

    parts = [[cgutils.alloca_once_value(builder, zero) for _ in range(2)] for _ in range(_BLOCK)]
    for pair in parts:
        for slot in pair:
            builder.store(zero, slot)
    with cgutils.for_range(builder, ir.Constant(_INT, 16)) as loop:
        start = builder.load(builder.gep(offsets, [loop.index]))
        first_weight = builder.mul(loop.index, ir.Constant(_INT, _BLOCK))
        for j in range(_BLOCK):
            place = builder.add(start, builder.mul(stride, ir.Constant(_INT, j)))
            number = builder.add(first_weight, ir.Constant(_INT, j))
            weight = splat(builder.load(builder.gep(weights, [number])))
            for half in range(2):
                at = builder.add(place, ir.Constant(_INT, _LANES * half))
                pointer = builder.bitcast(builder.gep(table, [at]), ir.PointerType(_FLOATS))
                row = builder.fpext(builder.load(pointer, align=4), _DOUBLES)
                slot = parts[j][half]
                builder.store(builder.call(fma, [weight, row, builder.load(slot)]), slot)
    for half in range(2):
        total = zero
        for j in range(_BLOCK):
            total = builder.fadd(total, builder.load(parts[j][half]))
        at = builder.gep(sums, [ir.Constant(_INT, _LANES * half)])
        builder.store(total, builder.bitcast(at, ir.PointerType(_DOUBLES)), align=8)
