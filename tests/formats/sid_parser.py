"""A reader of SID_FEM that knows the format and nothing of the writer."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

KEYS = ["order", "nrow", "ncol", "nq", "nqn", "structure"]
BODY = ["mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De"]
NODE = ["origin", "phi", "psi", "AP"]


@dataclass
class Block:
    keys: dict[str, int]
    m0: dict[tuple[int, ...], float] = field(default_factory=dict)
    m1: dict[tuple[int, ...], float] = field(default_factory=dict)
    M0: np.ndarray | None = None
    M1: np.ndarray | None = None  # (row, mode, column)

    def at(self, q):
        return self.M0 + np.einsum("rqc,q->rc", self.M1, q)


@dataclass
class Sid:
    name: str
    counts: tuple[int, int]
    mass: float
    modes: list[str]
    nodes: dict[str, dict[str, Block]]
    body: dict[str, Block]
    layout: dict[str, str]  # of Gr and Ge: "axis" or "mode"
    mode_last: bool
    Gr: np.ndarray  # (3, mode, axis)
    Ge: np.ndarray  # (mode, mode, axis)


def read_sid(path) -> Sid:
    lines = [line.strip() for line in path.read_text().splitlines()]
    counts = tuple(int(x) for x in re.findall(r"\d+", lines[0])[:2])
    cursor = iter(lines[1:])
    expect(cursor, "part")
    name = value(next(cursor), "new modal")
    mass, modes = read_modes(cursor)
    nodes = read_nodes(cursor)
    body = {block: read_block(cursor, next(cursor), block) for block in BODY}
    expect(cursor, "end modal")
    expect(cursor, "end part")
    last = mode_is_last(body["mdCM"])
    for block in [*body.values(), *(b for node in nodes.values() for b in node.values())]:
        fill(block, last)
    Gr, gr_layout = arranged(body["Gr"], lambda Gr: gyroscopic_residual(Gr, body["J"]))
    Ge, ge_layout = arranged(body["Ge"], lambda Ge: coriolis_residual(Ge, body["Cr"]))
    return Sid(name, counts, mass, modes, nodes, body, {"Gr": gr_layout, "Ge": ge_layout}, last, Gr, Ge)


def expect(cursor, text):
    found = next(cursor)
    assert found == text, f"{found!r} instead of {text!r}"


def value(line, key):
    assert line.startswith(key), f"{line!r} instead of {key!r}"
    return line.split("=", 1)[1].strip()


def number(text):
    assert re.fullmatch(r"[+-]?\d\.\d+[DE][+-]\d+", text), text
    return float(text.replace("D", "E"))


def read_modes(cursor):
    expect(cursor, "refmod")
    mass = number(value(next(cursor), "mass"))
    count = int(value(next(cursor), "nelastq"))
    modes = [value(next(cursor), "ielastq") for _ in range(count)]
    expect(cursor, "end refmod")
    return mass, modes


def read_nodes(cursor):
    expect(cursor, "frame")
    nodes = {}
    while (line := next(cursor)) != "end frame":
        label = value(line, "new node")
        assert label not in nodes, label
        assert value(next(cursor), "rframe") == "body ref"
        nodes[label] = {block: read_block(cursor, next(cursor), block) for block in NODE}
        expect(cursor, "end node")
    return nodes


def read_block(cursor, line, name):
    assert line == name, f"{line!r} instead of {name!r}"
    block = Block({key: int(value(next(cursor), key)) for key in KEYS})
    while (line := next(cursor)) != f"end {name}":
        kind, place, text = re.fullmatch(r"(m[01])\(([\d, ]+)\)\s*=\s*(\S+)", line).groups()
        place = tuple(int(i) - 1 for i in place.split(","))
        store = getattr(block, kind)
        assert place not in store, line
        store[place] = number(text)
    assert block.keys["order"] or not block.m1, f"{name} has m1 at order 0"
    return block


def mode_is_last(mdcm):
    """The only column of mdCM shows which index of m1 is the mode."""
    return any(place[2] > 0 for place in mdcm.m1)


def fill(block, mode_last):
    rows, columns, n = (block.keys[key] for key in ("nrow", "ncol", "nq"))
    block.M0, block.M1 = np.zeros((rows, columns)), np.zeros((rows, n, columns))
    structure = block.keys["structure"]
    assert structure or not (block.m0 or block.m1), "entries in a zero block"
    if structure == 4:
        block.M0 = np.eye(rows)
    for place, x in block.m0.items():
        block.M0[place] = x
        if structure == 2:
            block.M0[place[::-1]] = x
    for (row, a, b), x in block.m1.items():
        block.M1[(row, b, a) if mode_last else (row, a, b)] = x


def gyroscopic_residual(Gr, J):
    """``Gr_j + Gr_j^T = 2 dJ/dq_j``: both hold the first moment of the shape."""
    dJ = J.M1
    if J.M0.shape == (6, 1):
        dJ = dJ[[0, 3, 4, 3, 1, 5, 4, 5, 2], :, 0].reshape(3, 3, -1).transpose(0, 2, 1)
    return Gr + Gr.swapaxes(0, 2) - 2 * dJ


def coriolis_residual(Ge, Cr):
    """``Ge_ija = 2 int (phi_j x phi_i)_a``, twice the part of Cr.M1 that is antisymmetric in its modes.

    FEMBS writes all of ``2 Cr.M1``, with the symmetric part that is geometric stiffness: compare what is common.
    """
    return Ge - Ge.swapaxes(0, 1) - 2 * (Cr.M1 - Cr.M1.swapaxes(0, 1))


def arranged(block, residual):
    """Return the (row, mode, axis) array and the column layout that fulfils its identity."""
    rows = len(block.M0)
    choices = {
        "axis": block.M0.reshape(rows, 3, -1).swapaxes(1, 2),
        "mode": block.M0.reshape(rows, -1, 3),
    }
    size = np.abs(block.M0).max()
    fits = {name: np.abs(residual(array)).max() < 1e-8 * size for name, array in choices.items()}
    assert list(fits.values()).count(True) == 1, fits
    layout = next(name for name, fit in fits.items() if fit)
    return choices[layout], layout
