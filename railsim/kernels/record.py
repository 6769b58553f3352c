"""Records of arrays by reference: a named tuple of which compiled code takes the address.

By value a `System` and its `Work` are some five hundred words, which every call would copy and
every function be compiled with.  `record` gives a named tuple an `address`: that of 64-bit words
with its numbers, where its arrays lie and how long they are, its records one after the other.
In compiled code the attributes are the same.

The words are made once for each tuple and never change, which the compiler is told: a named tuple
is immutable, and its arrays are written in place.  The tuple has to outlive the call.
"""

import hashlib
import struct
from functools import cached_property
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

Class = TypeVar("Class", bound=type)
ARRAY_WORDS = 5  # owner, parent, entries, bytes of an entry, address; then lengths and strides


class RecordType(types.Type):
    """Type of a record: its fields and at which word each begins."""

    def __init__(self, name, fields):
        self.fields, self.first, self.size = dict(fields), {}, 0
        for field, kind in fields:
            self.first[field] = self.size
            self.size += _size(kind)
        text = ", ".join(f"{field}: {kind}" for field, kind in fields)
        super().__init__(f"{name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}")


register_model(RecordType)(models.OpaqueModel)
# by what decides them: numba takes 10 us for each type of an array
_types: dict[Any, RecordType] = {}


def _size(kind) -> int:
    """Words of a field."""
    if isinstance(kind, RecordType):
        return kind.size
    return ARRAY_WORDS + 2 * kind.ndim if isinstance(kind, types.Array) else 1


class Record:
    """What `record` adds to a named tuple."""

    @cached_property
    def compiled_type(self) -> RecordType:
        """Its type in compiled code."""
        fields: Any = self
        alike = type(self), *map(_shape, fields)
        if alike not in _types:
            name, hints = type(self).__name__, type(self).__annotations__
            kinds = [
                (field, _kind(value, hints[field], f"{name}.{field}"))
                for field, value in zip(fields._fields, fields, strict=True)
            ]
            _types[alike] = RecordType(name, kinds)
        return _types[alike]

    @cached_property
    def words(self) -> np.ndarray:
        """The record as compiled code reads it."""
        fields: Any = self
        words = b"".join(map(_words, fields, self.compiled_type.fields.values()))
        return np.frombuffer(bytearray(words), dtype=np.uint64)

    @cached_property
    def address(self) -> int:
        """Where the words begin."""
        return int(self.words.ctypes.data)

    def __getstate__(self) -> None:
        """Addresses are those of this process."""


def record(kind: Class) -> Class:
    """Give a class of named tuples its address in memory."""
    copied = ("__doc__", "__module__", "__annotations__")
    body = {name: getattr(kind, name) for name in copied}
    return cast(Class, type(kind.__name__, (Record, kind), body))


def _shape(value):
    """What decides the type of a field, beside its hint."""
    if isinstance(value, Record):
        return id(value.compiled_type)
    if isinstance(value, np.ndarray):
        return value.dtype.char, value.ndim, value.flags.c_contiguous
    return None


def _kind(value, hint, where):
    """Type of a field in compiled code."""
    if isinstance(value, Record):
        return value.compiled_type
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise TypeError(f"{where}: an array in C order is needed")
        return types.Array(numba.from_dtype(value.dtype), value.ndim, "C")
    return types.float64 if hint is float else types.int64


def _words(value, kind) -> bytes:
    """Words of a field."""
    if isinstance(value, Record):
        return value.words.tobytes()
    if isinstance(value, np.ndarray):
        about = (0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
        return struct.pack(f"<{len(about)}q", *about)
    return struct.pack("<d" if kind == types.float64 else "<q", value)


@typeof_impl.register(Record)
def _type_of(value, context):
    return value.compiled_type


@unbox(RecordType)
def _unbox(kind, instance, c):
    """Read the address, in whose making a signal may be heard: then there is none.

    Python reads no number where there is no object, it ends the process.
    """
    number = c.pyapi.object_getattr_string(instance, "address")
    address = cgutils.alloca_once_value(c.builder, cgutils.get_null_value(c.pyapi.voidptr))
    with c.builder.if_then(cgutils.is_not_null(c.builder, number), likely=True):
        c.builder.store(c.pyapi.long_as_voidptr(number), address)
        c.pyapi.decref(number)
    failed = cgutils.is_not_null(c.builder, c.pyapi.err_occurred())
    return NativeValue(c.builder.load(address), is_error=failed)


@infer_getattr
class _Attributes(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, kind, name):  # type: ignore[override]
        return kind.fields.get(name)


@lower_getattr_generic(RecordType)
def _attribute(context, builder, kind, address, name):
    field, first = kind.fields[name], kind.first[name]

    def place(word, of):
        pointer = builder.gep(address, [context.get_constant(types.intp, 8 * word)])
        return builder.bitcast(pointer, of.as_pointer())

    def load(word, of):
        value = builder.load(place(word, of), align=8)
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    if isinstance(field, RecordType):
        return builder.gep(address, [context.get_constant(types.intp, 8 * first)])
    if not isinstance(field, types.Array):
        return load(first, context.get_value_type(field))
    array = context.make_array(field)(context, builder)
    word = context.get_value_type(types.intp)
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    array.nitems = load(first + 2, word)
    array.itemsize = context.get_constant(
        types.intp, context.get_abi_sizeof(array.data.type.pointee)
    )
    array.data = load(first + 4, array.data.type)
    ends = first + ARRAY_WORDS, first + ARRAY_WORDS + field.ndim
    lengths, strides = ([load(end + k, word) for k in range(field.ndim)] for end in ends)
    array.shape = cgutils.pack_array(builder, lengths, ty=word)
    array.strides = cgutils.pack_array(builder, strides, ty=word)
    return array._getvalue()
