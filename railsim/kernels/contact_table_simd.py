"""Sum over the nodes of a contact table's cell, written directly in vector registers.

Why this exists: a look-up adds 32 nodes of eight fields, four sums each (the value and its three
gradients).  Left to the compiler the sums of the gradients are scalars and the weights are worked
out anew for each patch; here every node is one register of eight fields and all sums stay in
registers.  Gain: docs/performance.md.  Any processor will do: the instructions are generic vectors
that LLVM cuts to what it has.

The same in plain Python is :func:`railsim.kernels.contact_table._sum_of_nodes_plain`, used where
compilation is switched off; a test holds both to the same result.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_LANES = 8
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, _LANES)
_INT = ir.IntType(64)


@intrinsic
def sum_of_nodes(typingctx, values, first, row, slab, weights, tw, out, place):
    """Write to ``out[place:place + 32]`` value, slopes over y and roll, difference over w.

    values : ndarray of float64, C order, whose last axis holds eight fields; first : index of the
    cell's first field in the flat array; row, slab : distances of neighbours in roll and in w;
    weights : ndarray, shape (16,), of y, their slopes, of roll, their slopes; tw : place between
    the two slabs.
    """
    integer, double = types.intp, types.float64
    signature = types.void(values, integer, integer, integer, weights, double, out, integer)

    def codegen(context, builder, sig, args):
        def data(position):
            return context.make_array(sig.args[position])(context, builder, args[position]).data

        _emit(builder, data(0), *args[1:4], data(4), args[5], data(6), args[7])
        return context.get_dummy_value()

    return signature, codegen


def _emit(builder, values, first, row, slab, weights, tw, out, place):
    kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
    fma = cgutils.get_or_insert_function(builder.module, kind, "llvm.fma.v8f64")
    zero = ir.Constant(_VECTOR, [0.0] * _LANES)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), _LANES), [0] * _LANES)

    def splat(value):
        single = builder.insert_element(zero, value, ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(single, zero, mask)

    def pointer(array, index):
        return builder.bitcast(builder.gep(array, [index]), ir.PointerType(_VECTOR))

    def add(a, b, total):
        return builder.call(fma, [a, b, total]) if total is not None else builder.fmul(a, b)

    def offset(start, stride, count):
        return builder.add(start, builder.mul(stride, ir.Constant(_INT, count)))

    w = [splat(builder.load(builder.gep(weights, [ir.Constant(_INT, i)]))) for i in range(16)]
    slabs = []
    for j_w in range(2):
        value = slope_y = slope_roll = None
        for j_roll in range(4):
            start = offset(offset(first, slab, j_w), row, j_roll)
            here = slope = None
            for k in range(4):
                at = builder.add(start, ir.Constant(_INT, _LANES * k))
                node = builder.load(pointer(values, at), align=8)
                here = add(w[k], node, here)
                slope = add(w[4 + k], node, slope)
            value = add(w[8 + j_roll], here, value)
            slope_y = add(w[8 + j_roll], slope, slope_y)
            slope_roll = add(w[12 + j_roll], here, slope_roll)
        slabs.append((value, slope_y, slope_roll))
    between = splat(tw)
    sums = [add(between, builder.fsub(b, a), a) for a, b in zip(*slabs, strict=True)]
    sums.append(builder.fsub(slabs[1][0], slabs[0][0]))
    for i, total in enumerate(sums):
        at = builder.add(place, ir.Constant(_INT, _LANES * i))
        builder.store(total, pointer(out, at), align=8)
