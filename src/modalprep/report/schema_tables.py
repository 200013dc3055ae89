"""The schema of pipeline files in words: what each key of a table may be, and what it means."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Column
from rich.text import Text

from modalprep.errors import InputError
from modalprep.report.terminal import plain_table, print_table
from modalprep.suggest import suggestion

BOUNDS = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
WORDS = {"string": "text", "number": "number", "integer": "integer", "boolean": "true or false"}
SLIP = 0.7  # likeness to a key, from which a name is taken for a slip; difflib takes "hinge" for "range" at 0.6
Node = Mapping[str, Any]  # a part of a JSON schema


class Key(NamedTuple):
    """A key of a table: its name, what its value may be, its default, and what it means."""

    name: str
    kind: str
    default: str
    meaning: str


def table_word(ref: str) -> str:
    """Return the name of a table of the schema as a word.

    Examples
    --------
    >>> table_word("OrthotropicSolidTable")
    'orthotropic solid'
    """
    name = ref.split("__")[-1].removesuffix("Table")
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name).strip()


class Style(NamedTuple):
    """How a table is named by its name in the schema, and how a literal value is quoted."""

    link: Callable[[str], str] = table_word
    literal: Callable[[str], str] = str


PLAIN = Style()


def keys_of(table: Node, style: Style = PLAIN) -> list[Key]:
    """Return the keys of a table of the schema.

    Examples
    --------
    >>> keys_of({"properties": {"mass": {"type": "number", "minimum": 0, "description": "kg"}}, "required": ["mass"]})
    [Key(name='mass', kind='number at least 0', default='required', meaning='kg')]
    """
    required = table.get("required", [])
    return [
        Key(name, kind_of(value, style), "required" if name in required else _default(value), _meaning(value))
        for name, value in table["properties"].items()
    ]


def kind_of(value: Node, style: Style = PLAIN) -> str:
    """Say what a value may be."""
    if "$ref" in value:
        return style.link(value["$ref"].split("/")[-1])
    for key in ("anyOf", "oneOf"):
        if key in value:
            return " or ".join(dict.fromkeys(kind_of(part, style) for part in value[key] if part.get("type") != "null"))
    if "const" in value or "enum" in value:
        return ", ".join(style.literal(json.dumps(one)) for one in value.get("enum", [value.get("const")]))
    if value.get("type") == "array":
        return _list(value, style)
    if value.get("type") == "object":
        inner = value.get("additionalProperties")
        return f"table of {kind_of(inner, style)}" if isinstance(inner, dict) else "table"
    bounds = [f"{word} {value[key]:g}" for key, word in BOUNDS.items() if key in value]
    return " ".join([WORDS.get(value.get("type", ""), "any value"), " and ".join(bounds)]).strip()


def tables_named_in(value: Any) -> list[str]:
    """Return the names of the tables that a part of the schema refers to, in order, each once."""
    if isinstance(value, dict):
        own = [value["$ref"].split("/")[-1]] if "$ref" in value else []
        inner = [ref for key, part in value.items() if key != "discriminator" for ref in tables_named_in(part)]
        return list(dict.fromkeys(own + inner))
    return (
        list(dict.fromkeys(ref for part in value for ref in tables_named_in(part))) if isinstance(value, list) else []
    )


def find_part(schema: Node, path: str) -> Node:
    """Return the part of the schema of a table or key such as ``joints.revolute`` or ``joints.axis``.

    A name that a user chooses may stand in it or be left out: ``joints.hinge`` is ``joints``.

    Raises
    ------
    InputError
        When a table has no such key and no such type.
    """
    first, *steps = path.split(".")
    part = _step(path, schema["properties"], first)
    for step in steps:
        known: dict[str, Node] = {}
        named = isinstance(part.get("additionalProperties"), dict)
        for table in _tables(schema, part):
            kind = table["properties"].get("type", {})
            types = kind.get("enum", [kind["const"]] if "const" in kind else [])
            known |= table["properties"] | dict.fromkeys(types, table)
        chosen = named and step not in known and not get_close_matches(step, known, cutoff=SLIP)  # by the user
        if not chosen:
            part = _step(path, known, step)
    return part


def _step(path: str, known: Mapping[str, Node], name: str) -> Node:
    if name not in known:
        raise InputError(f"{path!r} is not in the schema: {suggestion(name, known, 'there are')}")
    return known[name]


def schema_list(schema: Node, console: Console) -> None:
    """Print the tables of a pipeline file with their keys."""
    rows = plain_table(Column("table", no_wrap=True), "keys, or types of table")
    for name, value in schema["properties"].items():
        tables = _tables(schema, value)
        words = [_type(table) or table_word(ref) for ref, table in zip(tables_named_in(value), tables, strict=True)]
        keys = words if len(tables) > 1 else tables[0]["properties"] if tables else [kind_of(value)]
        rows.add_row(Text(name, "bold"), Text(", ".join(keys)))
    print_table(rows, console)
    console.print("modalprep schema TABLE describes one, such as materials.orthotropic; --json prints all.")


def schema_page(schema: Node, path: str, console: Console) -> None:
    """Print a table of the schema: each key, what its value may be, its default, and its meaning."""
    part = find_part(schema, path)
    tables = [part] if "properties" in part else _tables(schema, part)
    if "properties" not in part and (_meaning(part) or not tables):
        console.print(Text(f"{path}: {_meaning(part) or kind_of(part)}"))
    for table in tables:
        _print_table(path, table, console)


def _print_table(path: str, table: Node, console: Console) -> None:
    kind = _type(table)
    console.print(Text.assemble((path, "bold"), f" with type = {kind!r}" if kind else ""))
    said = table.get("description", "").split("\n\nExamples")[0]
    if said:
        console.print(Text(said))
    rows = plain_table(Column("key", no_wrap=True), "value", "default", "meaning")
    for key in keys_of(table):
        rows.add_row(Text(key.name, "bold"), Text(key.kind), Text(key.default), Text(key.meaning))
    print_table(rows, console)


def _tables(schema: Node, value: Node) -> list[Node]:
    return [schema["$defs"][ref] for ref in tables_named_in(value)] if "properties" not in value else [value]


def _type(table: Node) -> str | None:
    return table["properties"].get("type", {}).get("const")


def _list(value: Node, style: Style) -> str:
    least = value.get("minItems")
    most = value.get("maxItems")
    item = kind_of(value.get("items", {}), style)
    item = f"{item}s" if item in WORDS.values() else f"({item})" if " or " in item else item
    return f"list of {item}" if least is None or least != most else f"{least} {item}"


def _default(value: Node) -> str:
    default = value.get("default")
    return "" if default in (None, {}, []) or isinstance(default, dict) else json.dumps(default)


def _meaning(value: Node) -> str:
    return value.get("description", "")
