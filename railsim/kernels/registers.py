"""Instructions on vector registers of doubles, for the modules that write them directly.

They are generic vectors, which LLVM cuts to what the processor has.
"""

from llvmlite import ir
from numba.core import cgutils

LANES = 8
DOUBLE = ir.DoubleType()
INT = ir.IntType(64)
INDEX = ir.IntType(32)
VECTOR = ir.VectorType(DOUBLE, LANES)


class Registers:
    """What `builder` can do with registers of `count` doubles."""

    def __init__(self, builder, count=LANES):
        self.builder = builder
        self.count = count
        self.kind = ir.VectorType(DOUBLE, count)
        self.zero = self.constant(0.0)

    def constant(self, value):
        """Return the same number in all lanes."""
        return ir.Constant(self.kind, [value] * self.count)

    def splat(self, value):
        """Put one number into all lanes."""
        single = self.builder.insert_element(self.zero, value, ir.Constant(INDEX, 0))
        mask = ir.Constant(ir.VectorType(INDEX, self.count), [0] * self.count)
        return self.builder.shuffle_vector(single, self.zero, mask)

    def pointer(self, data, index):
        """Point to the numbers that begin at an index of flat data."""
        return self.builder.bitcast(self.builder.gep(data, [index]), ir.PointerType(self.kind))

    def load(self, data, index):
        """Load numbers that follow each other, aligned or not."""
        return self.builder.load(self.pointer(data, index), align=8)

    def store(self, value, data, index):
        """Store numbers one after the other."""
        self.builder.store(value, self.pointer(data, index), align=8)

    def call(self, name, *values):
        """Call the LLVM function `name` of registers, such as `sqrt` or `fma`."""
        signature = ir.FunctionType(self.kind, [self.kind] * len(values))
        name = f"llvm.{name}.v{self.count}f64"
        function = cgutils.get_or_insert_function(self.builder.module, signature, name)
        return self.builder.call(function, values)

    def fma(self, a, b, c):
        """Return a b + c, rounded once."""
        return self.call("fma", a, b, c)
