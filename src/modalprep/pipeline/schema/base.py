"""Base of all TOML tables of a pipeline file: unknown keys are refused, vectors and angles are read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, ValidationError, model_validator
from pydantic_core import CoreSchema, core_schema

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.suggest import suggestion

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]


class FileName(str):
    """The name of a file that is read, relative to the folder of the pipeline file; the type of all such keys."""

    __slots__ = ()

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read text."""
        return core_schema.no_info_after_validator_function(cls, core_schema.str_schema())


class OneOf:
    """What accepts one of some names alone.

    Examples
    --------
    >>> from pydantic import TypeAdapter
    >>> TypeAdapter(Annotated[str, OneOf(("rest", "steady"))]).validate_python("rest")
    'rest'
    """

    def __init__(self, names: Iterable[str]) -> None:
        self.names = list(names)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Accept the names."""
        return core_schema.literal_schema(self.names)


class DeckName(FileName):
    """The name of a file that may include others."""


class BodyName(DeckName):
    """The name of a body's file, beside which further files may belong to it."""


class PipelineName(FileName):
    """The name of a pipeline file, which names files itself, from its own folder."""


def triple(values: Sequence[float]) -> tuple[float, float, float]:
    """Return a list of three numbers as a tuple."""
    x, y, z = values
    return x, y, z


def first_message(error: ValidationError) -> str:
    """Return the message of the first validation error.

    Examples
    --------
    >>> try:
    ...     ReferenceTable(label="a", t=[0.0], y=[])
    ... except ValidationError as error:
    ...     print(first_message(error))
    t has 1 values and y 0; give as many of each
    """
    first = error.errors()[0]
    value = first.get("input")
    if first["type"] in ("float_type", "int_type") and isinstance(value, str):
        return f"{value!r} is text; write the number without quotes and in SI units"
    context = first.get("ctx", {})
    if first["type"] == "union_tag_invalid" and context["discriminator"] == "form()":
        expected = context["expected_tags"].replace("'", "").replace(", ", " or ")
        return f"{value!r} is a {context['tag']}, but this key needs a {expected}"
    return first["msg"].removeprefix("Value error, ")


class Table(BaseModel):
    """A TOML table that refuses keys that it does not know, and those that have no effect beside the others."""

    applies: ClassVar[tuple[Rule, ...]] = ()
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.model_fields:
                raise ValueError(f"unknown key {key!r}; {suggestion(key, cls.model_fields, 'known are')}")
        return data

    @model_validator(mode="after")
    def _effective_keys(self) -> Self:
        refuse_idle(self)
        return self


class ReferenceTable(Table):
    """Reference points drawn in a plot."""

    label: str
    t: list[float]
    y: list[float]

    @model_validator(mode="after")
    def _pairs(self) -> ReferenceTable:
        if len(self.t) != len(self.y):
            raise ValueError(f"t has {len(self.t)} values and y {len(self.y)}; give as many of each")
        return self


def named_files(
    value: Table | dict[str, Any] | list[Any], keys: tuple[str | int, ...] = ()
) -> Iterator[tuple[tuple[str | int, ...], FileName]]:
    """Yield the keys and the name of each file that a table names, at any depth.

    Examples
    --------
    >>> class MeshTable(Table):
    ...     file: FileName
    >>> list(named_files({"mesh": MeshTable(file="a.msh")}))
    [(('mesh', 'file'), 'a.msh')]
    """
    items = value.__dict__ if isinstance(value, Table) else value
    for key, inner in items.items() if isinstance(items, dict) else enumerate(items):
        if isinstance(inner, FileName):
            yield (*keys, key), inner
        elif inner and isinstance(inner, Table | dict | list):
            yield from named_files(inner, (*keys, key))


@contextmanager
def naming(file: Path | str) -> Iterator[None]:
    """Put the name of the file (or table) before an input error that does not say it.

    Examples
    --------
    >>> with naming("job.toml"):
    ...     raise InputError("no group 'a'")
    Traceback (most recent call last):
    modalprep.errors.InputError: job.toml: no group 'a'
    """
    try:
        yield
    except InputError as error:
        if str(file) in str(error):
            raise
        raise type(error)(f"{file}: {error}") from None
