"""Records of arrays in compiled code: a pointer to their block of words (`by_address`)."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import typeof, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, lower_getattr_generic, models, register_model, unbox

from modalprep.compiler.sizes import WORD

TYPES: dict[str, AddressType] = {}  # by the name of the layout


class AddressType(types.Type):
    """Type of a record: the types of its fields, and the first word of each."""

    def __init__(self, layout: Any, fields: dict[str, types.Type]) -> None:
        self.fields, self.first = fields, layout.first
        super().__init__(layout.name)


def type_of(record: Any) -> AddressType:
    """Return numba's type of a record."""
    layout = record._type
    if layout.name not in TYPES:
        fields = {name: typeof(value) for name, value in zip(record._fields, record, strict=True)}
        TYPES[layout.name] = AddressType(layout, fields)
    return TYPES[layout.name]


@register_model(AddressType)
class _Address(models.OpaqueModel):
    """A pointer to the block."""


@unbox(AddressType)
def _unbox(kind: AddressType, value: Any, c: Any) -> NativeValue:
    """Take the address from a record, or as the number that `jit.bound` gives."""
    number = c.pyapi.number_as_ssize_t(value)
    address = c.builder.inttoptr(number, c.context.get_value_type(kind))
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
    shape = numbers[: kind.ndim]
    strides = numbers[kind.ndim :]
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
