"""The march of FASTSIM over a block of strips, written directly in vector registers.

Why this exists: left to the compiler, the march keeps the state of the strips in memory (13
accesses per cell for some 20 operations) and divides by a square root (27 clock cycles per 8
strips).  Here the state of 16 to 32 strips stays in registers over the whole march, and the
reciprocal square root comes from the processor's 14-bit estimate and one cubic correction,
``r (1 + e/2 + 3/8 e^2)`` with ``e = 1 - s r^2``, whose error is below 1e-12.  Gain on an AVX-512
machine: see docs/performance.md and benchmarks/fastsim_benchmark.py.

The algorithm is that of :func:`railsim.kernels.fastsim._march_plain`, which is used wherever
AVX-512 is missing or compilation is switched off; a test holds both to the same result.
"""

from contextlib import contextmanager

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from railsim.kernels.registers import DOUBLE, INT, LANES, VECTOR, Registers

_BYTE = ir.IntType(8)

# rows of the work array that hold what depends on the grid only, see `fastsim.fastsim_workspace`
BOUNDS, PER_L, Y_PER_L, W_SUM, W_ALONG, W_ACROSS = 9, 11, 12, 13, 14, 15
# rows that receive the sums over the strips
RESULTS = (6, 7, 8, 10, 0)


def available() -> bool:
    """Say whether numba compiles, and for a processor that has AVX-512.

    That is this one, unless `NUMBA_CPU_NAME` or `NUMBA_CPU_FEATURES` names another.
    """
    if numba.config.DISABLE_JIT:
        return False
    if numba.config.CPU_FEATURES is not None:
        return "+avx512f" in numba.config.CPU_FEATURES.split(",")
    return bool(llvm.get_host_cpu_features().get("avx512f", False))


def _block_march(n_vectors):
    """Make the intrinsic that marches n_vectors x 8 strips over nx cells.

    The intrinsic takes (work, first, bounds, nx): the work array of `fastsim` (rows growth x,
    growth y, spin growth, then the three sums), the first column of the block, the bound per
    march step (ndarray, shape (>= nx,)), and the number of cells.
    """

    @intrinsic
    def march(typingctx, work, first, bounds, nx):
        signature = types.void(work, types.intp, bounds, types.intp)

        def codegen(context, builder, sig, args):
            array = context.make_array(sig.args[0])(context, builder, args[0])
            bound_data = context.make_array(sig.args[2])(context, builder, args[2]).data
            columns = cgutils.unpack_tuple(builder, array.shape)[1]
            _emit_march(builder, n_vectors, array.data, columns, args[1], bound_data, args[3])
            return context.get_dummy_value()

        return signature, codegen

    return march


def _emit_march(builder, n_vectors, data, columns, first, bounds, nx):
    """Write the instructions; see `railsim.kernels.fastsim._march_plain` for the same in Python."""
    registers = Registers(builder)
    constant, splat, fma = registers.constant, registers.splat, registers.fma
    # the estimate of AVX-512: register, what stands where the mask does not, mask
    kind = ir.FunctionType(VECTOR, [VECTOR, VECTOR, _BYTE])
    name = "llvm.x86.avx512.rsqrt14.pd.512"
    rsqrt14 = cgutils.get_or_insert_function(builder.module, kind, name)
    all_lanes = ir.Constant(_BYTE, -1)
    zero, one = registers.zero, constant(1.0)

    def index(row, vector):
        offset = builder.add(builder.mul(ir.Constant(INT, row), columns), first)
        return builder.add(offset, ir.Constant(INT, LANES * vector))

    def load(row, vector):
        return registers.load(data, index(row, vector))

    cell = builder.fdiv(ir.Constant(DOUBLE, 1.0), builder.sitofp(nx, DOUBLE))
    two_cells = splat(builder.fmul(cell, ir.Constant(DOUBLE, 2.0)))
    half_first = splat(builder.fmul(cell, ir.Constant(DOUBLE, -0.5)))
    grow_x, change, state = [], [], []
    for v in range(n_vectors):
        gx, gy, gs = load(0, v), load(1, v), load(2, v)
        grow_x.append(gx)
        change.append(builder.fmul(two_cells, gs))
        grow_y = builder.fadd(gy, gs)
        # a full step from here is the half step that the first cell needs
        half = builder.fmul(constant(0.5), fma(half_first, gs, grow_y))
        start = (
            builder.fmul(constant(-0.5), gx),
            builder.fsub(half, grow_y),
            grow_y,
            zero,
            zero,
            zero,
        )
        state.append([cgutils.alloca_once_value(builder, value) for value in start])
        for slot, value in zip(state[v], start, strict=True):
            builder.store(value, slot)
    with cgutils.for_range(builder, nx) as loop:
        bound = splat(builder.load(builder.gep(bounds, [loop.index])))
        for v in range(n_vectors):
            px, py, grow_y, sum_x, sum_y, sum_m = (builder.load(slot) for slot in state[v])
            px = builder.fadd(px, grow_x[v])
            py = builder.fadd(py, grow_y)
            square = fma(py, py, constant(1e-30))
            square = fma(px, px, square)
            r = builder.call(rsqrt14, [square, zero, all_lanes])
            e = fma(builder.fneg(builder.fmul(square, r)), r, one)
            f = builder.fmul(bound, r)
            correction = fma(e, constant(0.375), constant(0.5))
            f = fma(builder.fmul(f, e), correction, f)
            f = registers.call("minnum", f, one)
            px = builder.fmul(px, f)
            py = builder.fmul(py, f)
            sum_x = builder.fadd(sum_x, px)
            sum_y = builder.fadd(sum_y, py)
            sum_m = builder.fadd(sum_m, sum_y)
            grow_y = builder.fsub(grow_y, change[v])
            for slot, value in zip(state[v], (px, py, grow_y, sum_x, sum_y, sum_m), strict=True):
                builder.store(value, slot)
    for v in range(n_vectors):
        for row, slot in zip((3, 4, 5), state[v][3:], strict=True):
            registers.store(builder.load(slot), data, index(row, v))


march_2 = _block_march(2)
march_3 = _block_march(3)
march_4 = _block_march(4)


@intrinsic
def spread(typingctx, work, n, ny):
    """Spread the growth per cell of n patches over their ny strips, see `fastsim._spread_plain`.

    Blocks of eight patches: the last one runs over into the next strip, which is written after it.
    """

    def codegen(context, builder, sig, args):
        load, row = _rows(context, builder, sig, args[0])
        with _strips(builder, args[1], args[2]) as (strip, first, column):
            per_l = load(PER_L, strip, splat=True)
            y_per_l = load(Y_PER_L, strip, splat=True)
            x, y = load(3, first), load(4, first)
            spin_a, spin_b = load(5, first), load(6, first)
            grow_x = builder.fsub(builder.fmul(x, per_l), builder.fmul(spin_b, y_per_l))
            for k, value in enumerate((grow_x, builder.fmul(y, per_l), spin_a)):
                builder.store(value, row(k, column), align=8)
        return context.get_dummy_value()

    return types.void(work, types.intp, types.intp), codegen


@intrinsic
def gather(typingctx, work, n, ny):
    """Add up the strips of n patches, see `fastsim._gather_plain`."""

    def codegen(context, builder, sig, args):
        load, row = _rows(context, builder, sig, args[0])
        terms = ((W_SUM, 3), (W_SUM, 4), (W_ALONG, 5), (W_ALONG, 4), (W_ACROSS, 3))
        with _blocks(builder, args[1]) as first:
            zero = Registers(builder).zero
            slots = [cgutils.alloca_once(builder, VECTOR) for _ in terms]
            for slot in slots:
                builder.store(zero, slot)
            with cgutils.for_range(builder, args[2]) as loop:
                column = builder.add(builder.mul(loop.index, args[1]), first)
                weights = {k: load(k, loop.index, splat=True) for k in (W_SUM, W_ALONG, W_ACROSS)}
                sums = {k: load(k, column) for k in (3, 4, 5)}
                for slot, (weight, k) in zip(slots, terms, strict=True):
                    product = builder.fmul(weights[weight], sums[k])
                    builder.store(builder.fadd(builder.load(slot), product), slot)
            for k, slot in zip(RESULTS, slots, strict=True):
                builder.store(builder.load(slot), row(k, first), align=8)
        return context.get_dummy_value()

    return types.void(work, types.intp, types.intp), codegen


def _rows(context, builder, sig, work):
    """Functions that load from a row of the work array, and that point into it."""
    array = context.make_array(sig.args[0])(context, builder, work)
    columns = cgutils.unpack_tuple(builder, array.shape)[1]
    registers = Registers(builder)

    def index(k, column):
        return builder.add(builder.mul(ir.Constant(INT, k), columns), column)

    def row(k, column):
        return registers.pointer(array.data, index(k, column))

    def load(k, column, splat=False):
        if splat:
            return registers.splat(builder.load(builder.gep(array.data, [index(k, column)])))
        return registers.load(array.data, index(k, column))

    return load, row


@contextmanager
def _blocks(builder, n):
    """Loop over blocks of eight patches: the number of the first one."""
    lanes = ir.Constant(INT, LANES)
    count = builder.sdiv(builder.add(n, ir.Constant(INT, LANES - 1)), lanes)
    with cgutils.for_range(builder, count) as loop:
        yield builder.mul(loop.index, lanes)


@contextmanager
def _strips(builder, n, ny):
    """Loop over strips and blocks of patches: strip, first patch, its column."""
    with cgutils.for_range(builder, ny) as loop, _blocks(builder, n) as first:
        yield loop.index, first, builder.add(builder.mul(loop.index, n), first)
