"""Eight numbers side by side in one vector register, with the arithmetic of one number.

Why this exists: bodies and force elements are some forty scalar formulas an evaluation, each with
hundreds of operations that wait for each other; the compiler does not put two of them side by side.
With `Lanes` a formula is written once, as for one body, and is worked out for eight.  Gain:
docs/performance.md.  Any processor will do: the instructions are generic vectors that LLVM cuts to
what it has.

`load_rows` reads eight rows of a table and turns them, so that each result holds one column of all
eight; `store_rows` and `add_rows` go back.  Rows are given by where they start in the flat array;
beyond the last body or element the last one is taken again, so that nothing outside is touched and
a repeated store writes what is there.

Where compilation is switched off, `lanes_plain` does the same with arrays of eight.
"""

import operator

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, lower_builtin, models, register_model

from railsim.kernels import compiled
from railsim.kernels import lanes_plain as plain
from railsim.kernels.compiler import define_operator
from railsim.kernels.registers import INDEX, INT, LANES, VECTOR, Registers


class LanesType(types.Type):  # type: ignore[misc]
    """Type of eight float64 in one register."""

    def __init__(self):
        super().__init__(name="Lanes")


lanes = LanesType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager, kind):
        super().__init__(manager, kind, VECTOR)


def _as_lanes(context, builder, kind, value):
    if isinstance(kind, LanesType):
        return value
    return Registers(builder).splat(context.cast(builder, value, kind, types.float64))


def _define(operation, instruction):
    """Let an operator take Lanes, and a number beside Lanes."""

    def result_of(args):
        fits = lanes in args and all(a == lanes or isinstance(a, types.Number) for a in args)
        return lanes if fits else None

    def lower(context, builder, sig, args):
        values = [_as_lanes(context, builder, *pair) for pair in zip(sig.args, args, strict=True)]
        return getattr(builder, instruction)(*values)

    if instruction == "fneg":
        lower_builtin(operation, LanesType)(lower)
    else:
        for kinds in ((LanesType, LanesType), (LanesType, types.Number), (types.Number, LanesType)):
            lower_builtin(operation, *kinds)(lower)
    define_operator(operation, result_of, lower)


_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")
_define(operator.truediv, "fdiv")
_define(operator.neg, "fneg")


def _unary(name):
    """Make the intrinsic of an LLVM function of one number, lane by lane."""

    @intrinsic
    def function(typingctx, x):
        def codegen(context, builder, sig, args):
            return Registers(builder).call(name, *args)

        return lanes(lanes), codegen

    return function


square_root, sine, cosine = _unary("sqrt"), _unary("sin"), _unary("cos")


def _binary(name):
    """Make the intrinsic of an LLVM function of two numbers, lane by lane."""

    @intrinsic
    def function(typingctx, x, y):
        def codegen(context, builder, sig, args):
            return Registers(builder).call(name, *args)

        return lanes(lanes, lanes), codegen

    return function


minimum, maximum = _binary("minnum"), _binary("maxnum")


@intrinsic
def swap_pairs(typingctx, x):
    """Lanes with the two of each pair swapped."""

    def codegen(context, builder, sig, args):
        mask = ir.Constant(ir.VectorType(INDEX, LANES), [1, 0, 3, 2, 5, 4, 7, 6])
        return builder.shuffle_vector(args[0], args[0], mask)

    return lanes(lanes), codegen


@intrinsic
def splat(typingctx, x):
    """One number in all lanes."""

    def codegen(context, builder, sig, args):
        return Registers(builder).splat(args[0])

    return lanes(types.float64), codegen


def _is_beyond(builder, x, limit):
    registers = Registers(builder)
    return builder.fcmp_unordered(">", registers.call("fabs", x), registers.splat(limit))


@intrinsic
def any_beyond(typingctx, x, limit):
    """Whether |x| is more than `limit`, or not a number, in any lane."""

    def codegen(context, builder, sig, args):
        bits = builder.bitcast(_is_beyond(builder, *args), ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(lanes, types.float64), codegen


@intrinsic
def where_beyond(typingctx, x, limit, beyond, within):
    """Lane by lane: `beyond` where |x| is more than `limit`, or not a number; else `within`."""

    def codegen(context, builder, sig, args):
        return builder.select(_is_beyond(builder, *args[:2]), args[2], args[3])

    return lanes(lanes, types.float64, lanes, lanes), codegen


def _pointer(context, builder, kind, array, offset):
    data = context.make_array(kind)(context, builder, array).data
    return Registers(builder).pointer(data, offset)


def _mask(count):
    return ir.Constant(ir.VectorType(ir.IntType(1), LANES), [k < count for k in range(LANES)])


def _short_vector(count):
    return ir.VectorType(VECTOR.element, count)


def _load(builder, pointer, count):
    """Load the first `count` of eight numbers, which need not be aligned."""
    if count == LANES:
        return builder.load(pointer, align=8)
    if count in (2, 4):
        narrow = builder.load(builder.bitcast(pointer, _short_vector(count).as_pointer()), align=8)
        mask = [min(k, count) for k in range(LANES)]
        zero = ir.Constant(_short_vector(count), [0.0] * count)
        return builder.shuffle_vector(narrow, zero, ir.Constant(ir.VectorType(INDEX, LANES), mask))
    return _load_masked(builder, pointer, _mask(count))


def _load_masked(builder, pointer, mask):
    bits = ir.VectorType(ir.IntType(1), LANES)
    kind = ir.FunctionType(VECTOR, [ir.PointerType(VECTOR), INDEX, bits, VECTOR])
    load = cgutils.get_or_insert_function(builder.module, kind, "llvm.masked.load.v8f64.p0")
    return builder.call(load, [pointer, ir.Constant(INDEX, 8), mask, Registers(builder).zero])


def _store(builder, value, pointer, count):
    if count == LANES:
        builder.store(value, pointer, align=8)
        return
    if count in (2, 4):
        first = ir.Constant(ir.VectorType(INDEX, count), list(range(count)))
        narrow = builder.shuffle_vector(value, value, first)
        builder.store(narrow, builder.bitcast(pointer, _short_vector(count).as_pointer()), align=8)
        return
    bits = ir.VectorType(ir.IntType(1), LANES)
    kind = ir.FunctionType(ir.VoidType(), [VECTOR, ir.PointerType(VECTOR), INDEX, bits])
    store = cgutils.get_or_insert_function(builder.module, kind, "llvm.masked.store.v8f64.p0")
    builder.call(store, [value, pointer, ir.Constant(INDEX, 8), _mask(count)])


def _transpose(builder, rows):
    """Turn eight registers: the k-th of the result holds the k-th number of each."""

    def pairs(registers, distance, first, second):
        result = list(registers)
        for k in range(LANES):
            if not k & distance:
                a, b = registers[k], registers[k + distance]
                for index, mask in ((k, first), (k + distance, second)):
                    result[index] = builder.shuffle_vector(
                        a, b, ir.Constant(ir.VectorType(INDEX, LANES), mask)
                    )
        return result

    rows = pairs(rows, 1, [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15])
    rows = pairs(rows, 2, [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15])
    return pairs(rows, 4, [0, 1, 2, 3, 8, 9, 10, 11], [4, 5, 6, 7, 12, 13, 14, 15])


def _offsets(builder, rows, column):
    return [builder.add(start, column) for start in cgutils.unpack_tuple(builder, rows)]


@intrinsic(prefer_literal=True)
def load_rows(typingctx, array, rows, column, count):
    """Columns of eight rows of an array of float64 in C order, as a tuple of `count` <= 8 Lanes.

    rows : UniTuple(int64, 8), where each row starts in the flat array; column : the first of the
    columns; count : a literal number.
    """
    if not isinstance(count, types.IntegerLiteral):
        return None
    number = count.literal_value
    result = types.UniTuple(lanes, number)

    def codegen(context, builder, sig, args):
        column = context.cast(builder, args[2], sig.args[2], types.intp)
        loaded = [
            _load(builder, _pointer(context, builder, sig.args[0], args[0], offset), number)
            for offset in _offsets(builder, args[1], column)
        ]
        return context.make_tuple(builder, result, _transpose(builder, loaded)[:number])

    return result(array, rows, column, count), codegen


def _to_rows(builder, values):
    columns = cgutils.unpack_tuple(builder, values)
    zero = Registers(builder).zero
    return len(columns), _transpose(builder, columns + [zero] * (LANES - len(columns)))


@intrinsic
def store_rows(typingctx, array, rows, column, values):
    """Store a tuple of up to eight Lanes into columns of eight rows, see `load_rows`."""

    def codegen(context, builder, sig, args):
        column = context.cast(builder, args[2], sig.args[2], types.intp)
        count, transposed = _to_rows(builder, args[3])
        for offset, row in zip(_offsets(builder, args[1], column), transposed, strict=True):
            _store(builder, row, _pointer(context, builder, sig.args[0], args[0], offset), count)
        return context.get_dummy_value()

    return types.void(array, rows, column, values), codegen


@intrinsic
def add_rows(typingctx, array, rows, column, values, n):
    """Add a tuple of up to eight Lanes to columns of the first `n` of eight rows."""

    def codegen(context, builder, sig, args):
        column = context.cast(builder, args[2], sig.args[2], types.intp)
        count, transposed = _to_rows(builder, args[3])
        for k, (offset, row) in enumerate(
            zip(_offsets(builder, args[1], column), transposed, strict=True)
        ):
            active = builder.icmp_signed(">", args[4], ir.Constant(INT, k))
            with builder.if_then(active, likely=True):
                pointer = _pointer(context, builder, sig.args[0], args[0], offset)
                total = builder.fadd(_load(builder, pointer, count), row)
                _store(builder, total, pointer, count)
        return context.get_dummy_value()

    return types.void(array, rows, column, values, types.intp), codegen


@intrinsic
def add_to_pairs(typingctx, array, rows_1, rows_2, column, values_1, values_2, n):
    """Add tuples of eight Lanes to columns of the first `n` rows `rows_1` and rows `rows_2`.

    Pair after pair: what several pairs add to one row is summed in their order, whichever of them
    share a register.
    """

    def codegen(context, builder, sig, args):
        column = context.cast(builder, args[3], sig.args[3], types.intp)
        ends = [
            zip(_offsets(builder, rows, column), _to_rows(builder, values)[1], strict=True)
            for rows, values in ((args[1], args[4]), (args[2], args[5]))
        ]
        for k, pair in enumerate(zip(*ends, strict=True)):
            active = builder.icmp_signed(">", args[6], ir.Constant(INT, k))
            with builder.if_then(active, likely=True):
                for offset, row in pair:
                    pointer = _pointer(context, builder, sig.args[0], args[0], offset)
                    total = builder.fadd(_load(builder, pointer, LANES), row)
                    _store(builder, total, pointer, LANES)
        return context.get_dummy_value()

    return types.void(array, rows_1, rows_2, column, values_1, values_2, types.intp), codegen


@intrinsic
def load_lanes(typingctx, array, offset):
    """Eight numbers that follow each other in the flat array."""

    def codegen(context, builder, sig, args):
        return _load(builder, _pointer(context, builder, sig.args[0], *args), LANES)

    return lanes(array, types.intp), codegen


@intrinsic
def load_part(typingctx, array, offset, n):
    """As `load_lanes`, of which only the first `n` are read; the others are 0."""

    def codegen(context, builder, sig, args):
        kind = ir.VectorType(INT, LANES)
        first = builder.insert_element(ir.Constant(kind, ir.Undefined), args[2], INDEX(0))
        broadcast = ir.Constant(ir.VectorType(INDEX, LANES), [0] * LANES)
        counts = builder.shuffle_vector(first, first, broadcast)
        active = builder.icmp_signed(">", counts, ir.Constant(kind, list(range(LANES))))
        return _load_masked(builder, _pointer(context, builder, sig.args[0], *args[:2]), active)

    return lanes(array, types.intp, types.intp), codegen


@intrinsic
def store_lanes(typingctx, array, offset, x):
    """Store eight numbers one after the other in the flat array."""

    def codegen(context, builder, sig, args):
        pointer = _pointer(context, builder, sig.args[0], args[0], args[1])
        _store(builder, args[2], pointer, LANES)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), codegen


@compiled(inline=True)
def lane_numbers(first, count):
    """The numbers from `first` on; beyond `count` the last one again."""
    last = count - 1
    a, b, c = min(first, last), min(first + 1, last), min(first + 2, last)
    d, e, f = min(first + 3, last), min(first + 4, last), min(first + 5, last)
    return a, b, c, d, e, f, min(first + 6, last), min(first + 7, last)


@compiled(inline=True)
def paired_numbers(first, count):
    """2 k and 2 k + 1 of four numbers k from `first` on; beyond `count` those of the last again."""
    last = count - 1
    a, b = 2 * min(first, last), 2 * min(first + 1, last)
    c, d = 2 * min(first + 2, last), 2 * min(first + 3, last)
    return a, a + 1, b, b + 1, c, c + 1, d, d + 1


@compiled(inline=True)
def pair_starts(numbers, begin, size, shift):
    """Where rows of a `size` start after `begin`: one a pair, for its second `shift` on."""
    a, b = begin + (numbers[0] >> 1) * size, begin + (numbers[2] >> 1) * size
    c, d = begin + (numbers[4] >> 1) * size, begin + (numbers[6] >> 1) * size
    return a, a + shift, b, b + shift, c, c + shift, d, d + shift


@compiled(inline=True)
def gather_pairs(index, numbers):
    """Entries of `index` at the four numbers k of the eight 2 k and 2 k + 1."""
    a, b = index[numbers[0] >> 1], index[numbers[2] >> 1]
    c, d = index[numbers[4] >> 1], index[numbers[6] >> 1]
    return a, a, b, b, c, c, d, d


@compiled(inline=True)
def shift_seconds(rows, shift):
    """Rows, the second of each pair shifted."""
    a, b, c, d, e, f, g, h = rows
    return a, b + shift, c, d + shift, e, f + shift, g, h + shift


@compiled(inline=True)
def gather(index, numbers):
    """Entries of `index` at the eight `numbers`."""
    a, b, c, d, e, f, g, h = numbers
    return index[a], index[b], index[c], index[d], index[e], index[f], index[g], index[h]


@compiled(inline=True)
def gather_from(index, first):
    """Eight entries of `index` from `first` on; beyond its end the last one again."""
    return gather(index, lane_numbers(first, index.shape[0]))


@compiled(inline=True)
def row_starts(numbers, size):
    """Where eight rows of a table with rows of `size` start."""
    a, b, c, d, e, f, g, h = numbers
    return a * size, b * size, c * size, d * size, e * size, f * size, g * size, h * size


if numba.config.DISABLE_JIT:
    minimum, maximum, swap_pairs = plain.minimum, plain.maximum, plain.swap_pairs
    splat, where_beyond, any_beyond = plain.splat, plain.where_beyond, plain.any_beyond
    square_root, sine, cosine = plain.square_root, plain.sine, plain.cosine
    load_rows, store_rows, add_rows = plain.load_rows, plain.store_rows, plain.add_rows
    load_lanes, store_lanes, add_to_pairs = plain.load_lanes, plain.store_lanes, plain.add_to_pairs
    load_part = plain.load_part
