"""Strategies of hypothesis that damage a good file: its bytes and lines, or the tables of a pipeline file."""

import copy
import re

from hypothesis import strategies as st

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eEdD][-+]?\d+)?")
NUMBERS = [b"0", b"-1", b"1", b"2", b"1.5", b"nan", b"inf", b"1e308", b"-1e308", b"1e-320", b"4294967296", b"1e5"]
NUMBERS += [b"99999999999999999999", b"", b"x", b"-0.0", b"1e", b"0x10", b"\xff", b"1,", b"*", b"$", b"1e200"]
VALUES = [0, 1, -1, 2, 3.5, -1e-3, 1e-320, 1e308, -1e308, float("nan"), float("inf"), 10**20, True, False, "", "x"]
VALUES += ["t", "ground", "90 deg", "sin(t)", "1/t", [], [0], [0, 0, 0], [1, 0, 0], [1e200, 0, 0], [[1]], ["x"], {}]
VALUES += [{"x": 1}, [{}], [1, 2], [1e-200, 0, 0], "../x", "\x00", "9**9**9", "nan", "0.0001"]


def of_bytes(data: bytes) -> st.SearchStrategy[bytes]:
    """One to three changes of bytes, lines or numbers."""
    changes = (_flipped, _truncated, _without_line, _with_line_twice, _with_other_number, _overwritten)
    return _changed(data, changes)


def of_tables(tables: dict) -> st.SearchStrategy[dict]:
    """One to three changes of keys or values of a pipeline file."""
    return _changed(tables, (_without_key, _renamed, _replaced, _moved, _copied, _scaled))


@st.composite
def _changed(draw, good, changes):
    for change in draw(st.lists(st.sampled_from(changes), min_size=1, max_size=3)):
        good = change(draw, good)
    return good


def _at(draw, things):
    return draw(st.integers(0, max(0, len(things) - 1)))


def _flipped(draw, data):
    k = _at(draw, data)
    return data[:k] + bytes([data[k] ^ (1 << draw(st.integers(0, 7)))]) + data[k + 1 :] if data else data


def _overwritten(draw, data):
    k = _at(draw, data)
    new = draw(st.sampled_from([b"\x00" * 8, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80", b"\x01"]))
    return data[:k] + new + data[k + len(new) :]


def _truncated(draw, data):
    return data[: _at(draw, data)]


def _without_line(draw, data):
    lines = data.split(b"\n")
    k = _at(draw, lines)
    return b"\n".join(lines[:k] + lines[k + 1 :])


def _with_line_twice(draw, data):
    lines = data.split(b"\n")
    lines.insert(_at(draw, lines), lines[_at(draw, lines)])
    return b"\n".join(lines)


def _with_other_number(draw, data):
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    at = found[_at(draw, found)]
    return data[: at.start()] + draw(st.sampled_from(NUMBERS)) + data[at.end() :]


def places(value, path=()):
    """Return the path of every key and item."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [found for key, inner in items for found in [(*path, key), *places(inner, (*path, key))]]


def _reached(tables, path):
    """Return a copy of the tables, and in it the container of a place."""
    tables = copy.deepcopy(tables)
    inside = tables
    for key in path[:-1]:
        inside = inside[key]
    return tables, inside


def _value(tables, path):
    for key in path:
        tables = tables[key]
    return tables


def _place(draw, tables):
    found = places(tables)
    return found[_at(draw, found)] if found else None


def _changed_at(draw, tables, change):
    path = _place(draw, tables)
    if path is None:
        return tables
    tables, inside = _reached(tables, path)
    change(inside, path[-1])
    return tables


def _without_key(draw, tables):
    return _changed_at(draw, tables, lambda inside, key: inside.pop(key))


def _renamed(draw, tables):
    def rename(inside, key):
        if isinstance(inside, dict):
            inside[draw(st.sampled_from([key + "s", key[:-1], key.upper(), key + ".x", "x", key + "/y"]))] = inside.pop(
                key
            )

    return _changed_at(draw, tables, rename)


def _replaced(draw, tables):
    return _changed_at(draw, tables, lambda inside, key: inside.__setitem__(key, draw(st.sampled_from(VALUES))))


def _moved(draw, tables):
    """Another value of the same file in the place of one."""
    other = _place(draw, tables)
    return tables if other is None else _changed_at(
        draw, tables, lambda inside, key: inside.__setitem__(key, copy.deepcopy(_value(tables, other)))
    )  # fmt: skip


def _copied(draw, tables):
    def again(inside, key):
        if isinstance(inside, dict):
            inside[f"{key}2"] = copy.deepcopy(inside[key])
        else:
            inside.append(copy.deepcopy(inside[key]))

    return _changed_at(draw, tables, again)


def _scaled(draw, tables):
    factor = draw(st.sampled_from([-1, 0, 1e-12, 1e-3, 1e3, 1e12, 1e200]))

    def scale(inside, key):
        if isinstance(inside[key], (int, float)) and not isinstance(inside[key], bool):
            inside[key] = inside[key] * factor

    return _changed_at(draw, tables, scale)
