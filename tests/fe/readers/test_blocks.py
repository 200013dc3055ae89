"""Blocks of numbers that are read at once give what line by line gives: each mesh, each note, each sentence."""

import dataclasses
import random

import numpy as np
import pytest
from fe.readers.boxes import BDF, CDB, INP
from size import cases

import modalprep as mp
from modalprep.fe.readers import numbers
from modalprep.fe.readers.nastran import runs
from modalprep.fe.readers.text import Lines

DECKS = {"bdf": BDF, "cdb": CDB, "inp": INP}
NAMES = [(kind, name) for kind, decks in DECKS.items() for name in decks]
COMMENTS = {"bdf": "$ Tr\u00e4ger\n", "cdb": "! Tr\u00e4ger\n", "inp": "** Tr\u00e4ger\n"}
CHANGES = {
    "none": lambda text: text,
    "crlf": lambda text: text.replace("\n", "\r\n"),
    "cr": lambda text: text.replace("\n", "\r"),
    "lower case": str.lower,
    "tabs": lambda text: text.replace("        ", "\t"),
    "form feed": lambda text: f"{text}\f",
}


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read a deck in blocks of at least so many lines; return the mesh, or the sentence that refuses it."""

    def call(kind, content, least):
        monkeypatch.setattr(Lines, "least", least)
        path = tmp_path / f"deck.{kind}"
        path.write_bytes(content)
        try:
            return mp.read_mesh(path)
        except mp.InputError as error:
            return str(error)

    return call


def assert_same(a, b, where=""):
    """Assert that two records are equal to the last bit, in the order of their names."""
    assert type(a) is type(b), (where, a, b)
    if dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name), f"{where}.{field.name}")
    elif isinstance(a, dict):
        assert list(a) == list(b), where
        for key in a:
            assert_same(a[key], b[key], f"{where}[{key}]")
    elif isinstance(a, tuple | list):
        assert len(a) == len(b), where
        for k, pair in enumerate(zip(a, b, strict=True)):
            assert_same(*pair, f"{where}[{k}]")
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()), where
    else:
        assert a == b, where


def assert_both_ways(read, kind, content):
    assert_same(read(kind, content, 3), read(kind, content, 10**9))


@pytest.mark.parametrize(("kind", "name"), NAMES)
def test_blocks_and_lines_agree(read, kind, name):
    for change in CHANGES.values():
        assert_both_ways(read, kind, change(DECKS[kind][name]).encode())
    for encoding in ("latin-1", "utf-8-sig"):
        assert_both_ways(read, kind, (COMMENTS[kind] + DECKS[kind][name]).encode(encoding))


PIECES = [
    b"",
    b" ",
    b"0",
    b"-1",
    b".",
    b"1",
    b"\n",
    b"\r\n",
    b"$",
    b"!",
    b",",
    b"*",
    b"+",
    b"E",
    b"nan",
    b"\t",
    b"\xe4",
]
PIECES += [b"99999999999", b"1.5-6", b"1e400", b"=", b"(", b"\x0b", b"       -1\n", b"        ", b"**", b"\n\n", b"-0"]


def damaged(rng, content):
    """Return the content with some bytes or lines lost, put in or exchanged."""
    for _ in range(rng.randint(1, 3)):
        k = rng.randrange(len(content))
        if rng.random() < 0.7:
            content = content[:k] + rng.choice(PIECES) + content[k + rng.choice((0, 0, 1, 1, 2, 8)) :]
        else:
            lines = content.split(b"\n")
            a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
            lines[a : a + rng.randint(0, 1)] = [lines[b]][: rng.randint(0, 1)]
            content = b"\n".join(lines)
    return content


@pytest.mark.parametrize(("kind", "name"), NAMES)
def test_damaged_blocks_and_lines_agree(read, kind, name):
    rng = random.Random(f"{kind} {name}")
    for _ in range(cases(4)):
        assert_both_ways(read, kind, damaged(rng, DECKS[kind][name].encode()))


@pytest.mark.parametrize(
    ("kind", "name", "count"),
    [("bdf", "small", 2), ("bdf", "large", 2), ("bdf", "own markers", 2), ("bdf", "shells", 2), ("cdb", "bricks", 3)],
)
def test_regular_decks_are_read_in_blocks(read, kind, name, count, monkeypatch):
    """Nodes, elements and sets of regular decks come from tables alone."""
    found = []
    whole = Lines.table
    monkeypatch.setattr(Lines, "table", lambda *args: found.append(whole(*args)) or found[-1])
    read(kind, DECKS[kind][name].encode(), 3)
    assert len(found) == count
    assert all(table is not None for table in found)


@pytest.mark.parametrize("name", ["free without markers", "free with marks", "free shells"])
def test_free_fields_are_read_in_blocks(read, name, monkeypatch):
    found = []
    whole = runs._free_block
    monkeypatch.setattr(runs, "_free_block", lambda *args: found.append(whole(*args)) or found[-1])
    read("bdf", DECKS["bdf"][name].encode(), 3)
    assert [block is not None for block in found] == [True, True]


@pytest.mark.parametrize("digits", range(20))
def test_numbers_are_rounded_as_python_rounds_them(digits):
    rng = random.Random(digits)
    texts = [f"{rng.uniform(-1, 1) * 10.0 ** rng.randint(-30, 30):.{digits}{rng.choice('Eg')}}" for _ in range(300)]
    texts += [f"{rng.uniform(-1e4, 1e4):.{digits}f}" for _ in range(300)] + ["-0.0", "5.", "-.5", "1e-320", "4.9e-324"]
    ends = np.cumsum([len(text) for text in texts])
    text = np.frombuffer("".join(texts).encode(), dtype=np.uint8)
    found = numbers.plain_numbers(text, np.append(0, ends[:-1]), ends, np.zeros(1, dtype=bool))
    assert found is not None
    assert found.tobytes() == np.array(list(map(float, texts))).tobytes()
