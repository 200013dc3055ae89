"""How EMBSlib (ReadSID_C.h, MatrixFunctions.mo, Components.mo) and PyMbs (sidfilereader.py) read SID_FEM.

Written anew after their sources, vwaurich/EMBS_ModelicaLib and sevoigt/pymbs on GitHub, with what they overlook.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

KEYS = ("order ", "nrow ", "ncol ", "nqn ", "nq ", "structure ")  # in the order in which EMBSlib looks for them
BLOCKS = ("mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De")
NODE = ("origin", "phi", "psi", "AP")


@dataclass
class Read:
    """What a reader holds: blocks are pairs of M0 (rows, columns) and M1 (rows, modes, columns)."""

    mass: float
    nodes: list[dict]
    blocks: dict

    def at(self, name, q):
        M0, M1 = self.blocks[name]
        return M0 + np.einsum("rqc,q->rc", M1, q)

    def inertia(self, q):
        """J is a column of six."""
        xx, yy, zz, xy, xz, yz = self.at("J", q)[:, 0]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def gyroscopic(self, name, qd):
        """Columns 3 i to 3 i + 2 belong to mode i."""
        M0 = self.blocks[name][0]
        return sum(M0[:, 3 * i : 3 * i + 3] * x for i, x in enumerate(qd))


def read_as_embslib(path):
    """EMBSlib finds the names of blocks anywhere in a line, and only exponents that begin with D."""
    lines = iter(path.read_text().splitlines())
    counts = re.findall(r"\d+", next(lines))
    found, nodes, mass = {}, [], None
    for line in lines:
        if "refmod" in line:
            mass = _embs_mass(lines)
        elif "frame" in line:
            nodes = _embs_nodes(lines)
        elif (name := next((name for name in BLOCKS if name in line), None)) is not None:
            found[name] = _embs_block(lines)
    assert len(nodes) == int(counts[0])
    assert found["Ke"][0].shape == (int(counts[1]),) * 2
    return Read(mass, nodes, found)


def _embs_mass(lines):
    mass = 0.0
    for line in lines:
        if " mass " in line:
            mass = _embs_number(line)
        elif "end refmod" in line:
            break
    return mass


def _embs_nodes(lines):
    nodes = []
    for line in lines:
        if "new node" in line:
            nodes.append(_embs_node(lines))
        elif "end frame" in line:
            break
    return nodes


def _embs_node(lines):
    node = {}
    for line in lines:
        if "end node" in line:
            break
        name = next((name for name in NODE if name in line), None)
        if name:
            node[name] = _embs_block(lines)
    return node


def _embs_block(lines):
    values, M0, M1 = {}, None, None
    for line in lines:
        if len(values) == len(KEYS) and M0 is None:
            rows, columns, n = (values[key] for key in ("nrow ", "ncol ", "nq "))
            M0, M1 = np.zeros((rows, columns)), np.zeros((rows, n, columns))
        key = next((key for key in KEYS if key in line), None)
        if key:
            values[key] = int(re.search(r"\d+", line)[0])
        elif "m0" in line or "m1" in line:
            order, *place = (int(x) for x in re.findall(r"\d+", line.split("=")[0]))
            (M1 if order else M0)[tuple(x - 1 for x in place)] = _embs_number(line.split("=")[1])
        elif "end " in line:
            return M0, M1
    raise AssertionError("the block has no end")


def _embs_number(text):
    """Digits, points and signs before and after the D; plus signs are passed over."""
    base, _, exponent = re.search(r"[-\d].*", text)[0].partition("D")
    assert len(base) < 20, "its buffer overflows"
    kept = re.sub(r"[^-.\d]", "", exponent)
    return float(re.sub(r"[^-.\d]", "", base)) * 10.0 ** float(kept or 0)


def read_as_pymbs(path):
    """PyMbs takes the lines strictly in order, six keys in each block, and M1 by row, mode, column."""
    lines = iter(path.read_text().splitlines())
    n_nodes, _ = (int(x) for x in next(lines).split(":")[0].split(None, 2)[:2])
    assert next(lines).split() == ["part"]
    assert next(lines).split("=")[0].split() == ["new", "modal"]
    assert next(lines).split() == ["refmod"]
    mass, count = (next(lines).split("=") for _ in range(2))
    assert (mass[0].strip(), count[0].strip()) == ("mass", "nelastq")
    for _ in range(int(count[1])):
        key, said = next(lines).split("=")
        assert key.strip().startswith("ielastq")
        assert said.strip().startswith("Eigen Mode")
        float(said.split(":")[1].split("Hz")[0])
    assert next(lines).split() == ["end", "refmod"]
    assert next(lines).split() == ["frame"]
    nodes = [_pymbs_node(lines) for _ in range(n_nodes)]
    assert next(lines).split() == ["end", "frame"]
    blocks = {name: _pymbs_block(lines, name) for name in BLOCKS}
    assert [next(lines).split() for _ in range(2)] == [["end", "modal"], ["end", "part"]]
    return Read(float(mass[1].replace("D", "e")), nodes, blocks)


def _pymbs_node(lines):
    key, number = next(lines).split("=")
    assert key.split() == ["new", "node"]
    int(number)
    assert next(lines).split("=")[0].strip() == "rframe"
    node = {name: _pymbs_block(lines, name) for name in NODE}
    assert next(lines).split() == ["end", "node"]
    return node


def _pymbs_block(lines, name):
    assert next(lines).split() == [name]
    values = {}
    for key in ("order", "nrow", "ncol", "nq", "nqn", "structure"):
        found, value = next(lines).split("=")
        assert found.strip() == key
        values[key] = int(value)
    M0 = np.zeros((values["nrow"], values["ncol"]))
    M1 = np.zeros((values["nrow"], values["nq"], values["ncol"]))
    for line in lines:
        if line.strip().startswith("end"):
            return M0, M1
        key, value = line.split("=")
        place = tuple(int(x) - 1 for x in key.split("(")[1].split(")")[0].split(","))
        (M1 if key.strip().startswith("m1") else M0)[place] = float(value.split()[0].replace("D", "e"))
    raise AssertionError(f"{name} has no end")
