"""Sum over the nodes of a contact table's cell, written directly in vector registers.

Why this exists: a look-up adds 32 nodes of twelve fields, and of four of them the three gradients
too.  Left to the compiler the sums of the gradients are scalars and the weights are worked out
anew for each patch; here every node is one register of four fields and one of eight, and all sums
stay in registers.  Gain: docs/performance.md.  Any processor will do: the instructions are generic
vectors that LLVM cuts to what it has.

The same in plain Python is :func:`railsim.kernels.contact_table._sum_of_nodes_plain`, used where
compilation is switched off; a test holds both to the same result.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_GRADIENT, _VALUE = 4, 8  # fields with and without gradients
_DOUBLE = ir.DoubleType()
_INT = ir.IntType(64)


@intrinsic
def sum_of_nodes(typingctx, values, first, row, slab, weights, tw, out, place):
    """Write to ``out[place:place + 24]`` values, then of the first four slopes and differences.

    Twelve values, slopes over y and over roll, difference over w.

    values : ndarray of float64, C order, whose last axis holds twelve fields; first : index of the
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


class _Lanes:
    """Instructions on registers of so many doubles."""

    def __init__(self, builder, count):
        self.builder = builder
        self.kind = ir.VectorType(_DOUBLE, count)
        self.zero = ir.Constant(self.kind, [0.0] * count)
        self.mask = ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count)
        signature = ir.FunctionType(self.kind, [self.kind] * 3)
        name = f"llvm.fma.v{count}f64"
        self.fma = cgutils.get_or_insert_function(builder.module, signature, name)

    def splat(self, value):
        first = ir.Constant(ir.IntType(32), 0)
        single = self.builder.insert_element(self.zero, value, first)
        return self.builder.shuffle_vector(single, self.zero, self.mask)

    def pointer(self, array, index):
        place = self.builder.gep(array, [index])
        return self.builder.bitcast(place, ir.PointerType(self.kind))

    def load(self, array, index):
        return self.builder.load(self.pointer(array, index), align=8)

    def store(self, value, array, index):
        self.builder.store(value, self.pointer(array, index), align=8)

    def add(self, a, b, total):
        if total is None:
            return self.builder.fmul(a, b)
        return self.builder.call(self.fma, [a, b, total])


def _emit(builder, values, first, row, slab, weights, tw, out, place):
    force, patch = _Lanes(builder, _GRADIENT), _Lanes(builder, _VALUE)

    def ahead(start, count):
        return builder.add(start, ir.Constant(_INT, count))

    def offset(start, stride, count):
        return builder.add(start, builder.mul(stride, ir.Constant(_INT, count)))

    scalars = [builder.load(builder.gep(weights, [ir.Constant(_INT, i)])) for i in range(16)]
    w = [force.splat(scalar) for scalar in scalars]
    w_patch = [patch.splat(scalar) for scalar in scalars[:4] + scalars[8:12]]
    slabs = []
    for j_w in range(2):
        value = slope_y = slope_roll = of_patch = None
        for j_roll in range(4):
            start = offset(offset(first, slab, j_w), row, j_roll)
            here = slope = there = None
            for k in range(4):
                at = ahead(start, (_GRADIENT + _VALUE) * k)
                node = force.load(values, at)
                here = force.add(w[k], node, here)
                slope = force.add(w[4 + k], node, slope)
                there = patch.add(w_patch[k], patch.load(values, ahead(at, _GRADIENT)), there)
            value = force.add(w[8 + j_roll], here, value)
            slope_y = force.add(w[8 + j_roll], slope, slope_y)
            slope_roll = force.add(w[12 + j_roll], here, slope_roll)
            of_patch = patch.add(w_patch[4 + j_roll], there, of_patch)
        slabs.append((value, slope_y, slope_roll, of_patch))

    def between(lanes, a, b):
        return lanes.add(lanes.splat(tw), builder.fsub(b, a), a)

    value, slope_y, slope_roll = (
        between(force, a, b) for a, b in zip(slabs[0][:3], slabs[1][:3], strict=True)
    )
    force.store(value, out, place)
    patch.store(between(patch, slabs[0][3], slabs[1][3]), out, ahead(place, _GRADIENT))
    gradients = slope_y, slope_roll, builder.fsub(slabs[1][0], slabs[0][0])
    for i, total in enumerate(gradients):
        force.store(total, out, ahead(place, _VALUE + _GRADIENT * (i + 1)))
