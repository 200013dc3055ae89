"""Tables as TOML text, for the pipeline files that a grid makes."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any


def toml_text(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> str:
    """Return the TOML text of nested tables: values first, then each table under its header.

    Examples
    --------
    >>> print(toml_text({"mesh": {"file": "a.msh"}, "reduction": {"modes": 5, "root": "tip"}}))
    <BLANKLINE>
    [mesh]
    file = "a.msh"
    <BLANKLINE>
    [reduction]
    modes = 5
    root = "tip"
    <BLANKLINE>
    """
    values = {key: value for key, value in table.items() if not isinstance(value, dict)}
    head = f"\n[{'.'.join(map(_key, path))}]\n" if path and (values or not table) else ""
    lines = "".join(f"{_key(key)} = {_value(value)}\n" for key, value in values.items())
    inner = (toml_text(value, (*path, key)) for key, value in table.items() if isinstance(value, dict))
    return head + lines + "".join(inner)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _string(key)


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return _string(value)
        case int() | float():
            return repr(value)
        case list():
            return f"[{', '.join(map(_value, value))}]"
        case dict():
            return f"{{{', '.join(f'{_key(k)} = {_value(v)}' for k, v in value.items())}}}"
    return value.isoformat()  # dates and times, the only other values of TOML
