"""Weighted sum of rows of the creep table, written directly in vector registers.

Why this exists: the look-up adds 64 rows of 16 numbers each.  Left to the compiler the sums go to
memory and back with every row (some 400 ns a patch); here they stay in registers.  Any processor
will do: the instructions are generic vectors that LLVM cuts to what it has.

The same in plain Python is :func:`railsim.kernels.creep_table._sum_rows_plain`, used where
compilation is switched off; a test holds both to the same result.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from railsim.kernels.registers import INT, LANES, VECTOR, Registers

_NODES = 4  # weights of a cubic B-spline in each direction
_FLOATS = ir.VectorType(ir.FloatType(), LANES)


@intrinsic
def sum_rows(typingctx, table, start, strides, weights, first, sums):
    """Write to sums (16) the sum over i, j, k < 4 of three weights times a row of 16 numbers.

    The row begins at table[start + i strides[0] + j strides[1] + k strides[2]]; the weights are
    weights[first + i] weights[first + 4 + j] weights[first + 8 + k].  table: ndarray of float32,
    one dimension; start, first: int64; strides: three int64; weights, sums: contiguous ndarray of
    any shape, taken as flat; they may be the same one if what is read and written is apart.
    """
    signature = types.void(table, types.int64, strides, weights, types.int64, sums)

    def codegen(context, builder, sig, args):
        def data(position):
            return context.make_array(sig.args[position])(context, builder, args[position]).data

        begin = builder.gep(data(3), [args[4]])
        _emit(builder, data(0), args[1], cgutils.unpack_tuple(builder, args[2]), begin, data(5))
        return context.get_dummy_value()

    return signature, codegen


def _emit(builder, table, start, strides, weights, sums):
    registers = Registers(builder)
    fma, zero = registers.fma, registers.zero

    def weight(number):
        return registers.splat(builder.load(builder.gep(weights, [number])))

    def constant(number):
        return ir.Constant(INT, number)

    totals = [cgutils.alloca_once_value(builder, zero) for _ in range(2)]
    inner = [weight(constant(2 * _NODES + k)) for k in range(_NODES)]
    middle = [weight(constant(_NODES + j)) for j in range(_NODES)]
    with cgutils.for_range(builder, constant(_NODES)) as loop:
        plane = builder.add(start, builder.mul(strides[0], loop.index))
        sums_j = [zero, zero]
        for j in range(_NODES):
            line = builder.add(plane, builder.mul(strides[1], constant(j)))
            sums_k = [zero, zero]
            for k in range(_NODES):
                row = builder.add(line, builder.mul(strides[2], constant(k)))
                for half in range(2):
                    at = builder.add(row, constant(LANES * half))
                    pointer = builder.bitcast(builder.gep(table, [at]), ir.PointerType(_FLOATS))
                    values = builder.fpext(builder.load(pointer, align=4), VECTOR)
                    sums_k[half] = fma(inner[k], values, sums_k[half])
            sums_j = [fma(middle[j], sums_k[h], sums_j[h]) for h in range(2)]
        outer = weight(loop.index)
        for half in range(2):
            present = builder.load(totals[half])
            builder.store(fma(outer, sums_j[half], present), totals[half])
    for half in range(2):
        registers.store(builder.load(totals[half]), sums, constant(LANES * half))
