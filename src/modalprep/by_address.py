"""Records of arrays that compiled code takes as one pointer.

Numba hands a tuple of arrays to a function number by number: hundreds of arguments, in every call, for the equations
of a system. A tuple of a class with `by_address` is the address of a block of words instead, which holds where each
array lies, its shape and strides, the addresses of the records inside, and numbers. The block is written once, at the
first call, and never changes: compiled code may keep what it has read of it.
"""

from __future__ import annotations

import hashlib
from ctypes import c_void_p
from functools import cached_property
from struct import pack, unpack
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba import typeof, types
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

WORD = 8
SHAPE, STRIDES = np.ndarray.shape.__get__, np.ndarray.strides.__get__  # those of a recarray take ten times as long
Named = TypeVar("Named")


class AddressType(types.Type):
    """Type of a record: the types of its fields, and the first word of each."""

    def __init__(self, name: str, fields: dict[str, types.Type]) -> None:
        self.fields, self.first, words = fields, {}, 0
        for field, kind in fields.items():
            self.first[field] = words
            words += _words(kind)
        layout = hashlib.sha256(repr([(field, str(kind)) for field, kind in fields.items()]).encode())
        super().__init__(f"{name}_{layout.hexdigest()[:12]}")


def _data(array: np.ndarray) -> int:
    """Return where the numbers of an array lie, which follows the object's head; `ctypes` takes ten times as long."""
    return c_void_p.from_address(id(array) + object.__basicsize__).value or 0


class Addressed:
    """What `by_address` adds to a NamedTuple."""

    @cached_property
    def _words(self) -> np.ndarray:
        words: list[int] = []
        for value in self:  # type: ignore[attr-defined]
            if isinstance(value, np.ndarray):
                words += [_data(value), *SHAPE(value), *STRIDES(value)]
            elif isinstance(value, Addressed):
                words.append(value._address)
            elif isinstance(value, float):
                words.append(unpack("q", pack("d", value))[0])
            elif value is not None:
                words.append(int(value))
        return np.array(words, dtype=np.int64)

    @cached_property
    def _address(self) -> int:
        return self._words.ctypes.data

    def __reduce__(self) -> tuple:
        """Copies and pickles have blocks of their own."""
        return type(self), tuple(self)  # type: ignore[arg-type]


def by_address(cls: type[Named]) -> type[Named]:
    """Return a NamedTuple of arrays, numbers, records and None whose values kernels take as one pointer.

    Kernels read its fields and cannot make one. Its arrays must not be exchanged, which a tuple does not allow; what
    they hold may change.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from modalprep.jit import compile_kernel
    >>> @by_address
    ... class Line(NamedTuple):
    ...     slope: float
    ...     points: np.ndarray  # (n,)
    >>> @compile_kernel
    ... def rise(line, k):
    ...     return line.slope * line.points[k]
    >>> rise(Line(2.0, np.array([1.0, 3.0])), 1)
    6.0
    """
    found = type(cls.__name__, (Addressed, cls), {"__module__": cls.__module__, "__doc__": cls.__doc__})
    found.__qualname__ = cls.__qualname__
    return found


@typeof_impl.register(Addressed)
def _type_of(value: Any, context: Any) -> AddressType:
    return AddressType(type(value).__name__, {name: typeof(x) for name, x in zip(value._fields, value, strict=True)})


def _words(kind: types.Type) -> int:
    """How many words of the block a field takes."""
    if isinstance(kind, types.NoneType):
        return 0
    return 1 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


@register_model(AddressType)
class _Address(models.OpaqueModel):
    """A pointer to the block."""


@unbox(AddressType)
def _unbox(kind: AddressType, value: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(value, "_address")
    address = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return NativeValue(address, is_error=c.pyapi.c_api_error())


@infer_getattr
class _Fields(AttributeTemplate):
    key = AddressType

    def generic_resolve(self, kind: AddressType, name: str) -> types.Type | None:
        return kind.fields.get(name)


@lower_getattr_generic(AddressType)
def _read(context: Any, builder: Any, kind: AddressType, value: Any, name: str) -> Any:
    field, first = kind.fields[name], kind.first[name]
    if isinstance(field, types.Array):
        return _read_array(context, builder, field, value, first)
    if isinstance(field, types.NoneType):
        return context.get_dummy_value()
    return _word(builder, value, first, context.get_value_type(field))


def _read_array(context: Any, builder: Any, kind: types.Array, value: Any, first: int) -> Any:
    array = context.make_array(kind)(context, builder)
    numbers = [_word(builder, value, first + k, ir.IntType(64)) for k in range(1, 1 + 2 * kind.ndim)]
    shape, strides = numbers[: kind.ndim], numbers[kind.ndim :]
    size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    if kind.layout == "C":
        strides[-1] = size
    data = _word(builder, value, first, array.data.type)
    context.populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
    return array._getvalue()


def _word(builder: Any, value: Any, index: int, kind: Any) -> Any:
    """Return a word of the block, which never changes: also after other stores it need not be read again."""
    place = builder.gep(value, [ir.Constant(ir.IntType(64), WORD * index)], inbounds=True)
    word = builder.load(builder.bitcast(place, kind.as_pointer()))
    word.set_metadata("invariant.load", builder.module.add_metadata([]))
    return word
