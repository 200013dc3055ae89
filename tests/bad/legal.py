"""Random legal tables of a pipeline file, drawn from its schema: what it allows in kind, sign and range.

Values that only a mesh or another table can judge, names and texts, are given by the caller.
"""

import types
from typing import Annotated, Literal, Union, get_args, get_origin

from hypothesis import strategies as st
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from modalprep.pipeline.schema.base import OneOf

SELDOM = (False, False, False, True)  # a key that may be left out is there


@st.composite
def number(draw, low=-1e300, high=1e300, above=-1e300):
    """A float: mostly of everyday size, now and then of any, zero and negative ones where they are legal."""
    wide = draw(st.sampled_from((*SELDOM, False, False)))
    size = 10.0 ** draw(st.floats(-40, 40) if wide else st.floats(-4, 4))
    sign = draw(st.sampled_from((1.0, 1.0, 1.0, -1.0, 0.0)))
    value = sign * size
    if not (low <= value <= high and value > above):
        value = min(size, high)
    return value


def whole(low, high):
    """An integer: small ones mostly."""
    few = st.integers(max(low, 0), max(low, 0) + 6)
    return st.one_of(few, few, few, st.integers(max(low, -(10**12)), min(high, 10**12)))


def bounds(metadata):
    """Return the constraints of a field by name: ge, gt, le, lt, min_length, max_length."""
    found = {}
    for item in metadata:
        found |= bounds(item.metadata) if isinstance(item, FieldInfo) else {}
        for name in ("ge", "gt", "le", "lt", "min_length", "max_length"):
            if getattr(item, name, None) is not None:
                found[name] = getattr(item, name)
    return found


def value(kind, metadata=()):
    """Return a strategy for an annotation; None for texts and dictionaries, which only the caller knows."""
    limits = bounds(metadata)
    if get_origin(kind) is Annotated:
        kind, *more = get_args(kind)
        return value(kind, (*metadata, *more))
    if get_origin(kind) in (Union, types.UnionType):
        found = [each for each in (value(part, metadata) for part in get_args(kind)) if each is not None]
        return st.one_of(found) if found else None
    for names in (item.names for item in metadata if isinstance(item, OneOf)):
        return st.sampled_from(names)
    if get_origin(kind) is Literal:
        return st.sampled_from(get_args(kind))
    if get_origin(kind) is list:
        item = value(get_args(kind)[0])
        few, many = limits.get("min_length", 0), limits.get("max_length", limits.get("min_length", 0) + 3)
        return None if item is None else st.lists(item, min_size=few, max_size=many)
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return table(kind)
    if kind is float:
        return number(limits.get("ge", -1e300), limits.get("le", limits.get("lt", 1e300)), limits.get("gt", -1e300))
    plain = {bool: st.booleans(), int: whole(limits.get("ge", -(10**12)), limits.get("le", 10**12))}
    return plain.get(kind)


@st.composite
def table(draw, schema, without=(), **given):
    """A legal table of a class of the schema.

    Parameters
    ----------
    without : names
        Keys that are left out.
    given : values or strategies
        Of keys by name.
    """
    found = {}
    for name, field in schema.model_fields.items():
        if name in given:
            found[name] = draw(given[name]) if isinstance(given[name], st.SearchStrategy) else given[name]
        elif name not in without and (field.is_required() or draw(st.sampled_from(SELDOM))):
            drawn = value(field.annotation, field.metadata)
            if drawn is not None:
                found[name] = draw(drawn)
    return found
