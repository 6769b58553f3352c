"""Sum over the nodes of a contact table's cell, written directly in vector registers.

Why this exists: a look-up adds 32 nodes of twelve fields, and of four of them the three gradients
too.  Left to the compiler the sums of the gradients are scalars and the weights are worked out
again for each patch; here every node is two registers, one with four fields twice, and all sums
stay in registers.  Gain: docs/performance.md.  Any processor will do: the instructions are generic
vectors that LLVM cuts to what it has.

The same in plain Python is :func:`railsim.kernels.contact_table._sum_nodes_plain`, used where
compilation is switched off; a test holds both to the same result.
"""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from railsim.kernels.registers import INDEX, INT, Registers

_GRADIENT, _VALUE = 4, 8  # fields with and without gradients


@intrinsic
def sum_nodes(typingctx, values, first, row, slab, weights, tw, out, offset):
    """Write to ``out[offset:offset + 24]`` values, then of the first four slopes and differences.

    Twelve values, slopes over y and over roll, difference over w.

    values : ndarray of float64, C order, whose last axis holds twelve fields; first : index of the
    cell's first field in the flat array; row, slab : distances of neighbours in roll and in w;
    weights : ndarray, shape (16,), of y, their slopes, of roll, their slopes; tw : weight of
    the second slab.
    """
    integer, double = types.intp, types.float64
    signature = types.void(values, integer, integer, integer, weights, double, out, integer)

    def codegen(context, builder, sig, args):
        def data(position):
            return context.make_array(sig.args[position])(context, builder, args[position]).data

        _emit(builder, data(0), *args[1:4], data(4), args[5], data(6), args[7])
        return context.get_dummy_value()

    return signature, codegen


def _add(registers, a, b, total):
    """Product of two registers, added to a total where there is one."""
    return registers.builder.fmul(a, b) if total is None else registers.fma(a, b, total)


def _emit(builder, values, first, row, slab, weights, tw, out, begin):
    force, patch = Registers(builder, _GRADIENT), Registers(builder, _VALUE)

    def ahead(start, count):
        return builder.add(start, ir.Constant(INT, count))

    def offset(start, stride, count):
        return builder.add(start, builder.mul(stride, ir.Constant(INT, count)))

    def mixed(a, b, mask):
        return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(INDEX, len(mask)), mask))

    low, high = [0, 1, 2, 3], [4, 5, 6, 7]
    scalars = [builder.load(builder.gep(weights, [ir.Constant(INT, i)])) for i in range(16)]
    w = [patch.splat(scalar) for scalar in scalars]
    # weights and, in the upper half, their slopes: of a node's force both are wanted
    w_force = [mixed(w[k], w[4 + k], [*low, 8, 9, 10, 11]) for k in range(4)]
    slabs = []
    for j_w in range(2):
        force_y = force_roll = of_patch = None
        for j_roll in range(4):
            start = offset(offset(first, slab, j_w), row, j_roll)
            here = there = None
            for k in range(4):
                at = ahead(start, (_GRADIENT + _VALUE) * k)
                node = force.load(values, at)
                here = _add(patch, w_force[k], mixed(node, node, low * 2), here)
                there = _add(patch, w[k], patch.load(values, ahead(at, _GRADIENT)), there)
            force_y = _add(patch, w[8 + j_roll], here, force_y)
            force_roll = _add(patch, w[12 + j_roll], here, force_roll)
            of_patch = _add(patch, w[8 + j_roll], there, of_patch)
        slabs.append((force_y, force_roll, of_patch))

    tw = patch.splat(tw)
    force_y, force_roll, of_patch = (
        patch.fma(tw, builder.fsub(b, a), a) for a, b in zip(*slabs, strict=True)
    )
    difference = builder.fsub(slabs[1][0], slabs[0][0])
    force.store(mixed(force_y, force_y, low), out, begin)
    patch.store(of_patch, out, ahead(begin, _GRADIENT))
    gradients = (force_y, high), (force_roll, low), (difference, low)
    for i, (total, half) in enumerate(gradients):
        force.store(mixed(total, total, half), out, ahead(begin, _VALUE + _GRADIENT * (i + 1)))
