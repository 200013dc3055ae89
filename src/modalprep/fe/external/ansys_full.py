"""Matrices of Ansys: binary .full files (theory 8.4)."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.matrix_checks import COMPONENTS
from modalprep.fe.readers.ansys.read import turned_nodes
from modalprep.fe.readers.deck_format import deck_format
from modalprep.fe.readers.entries import Found, Labelled, mirrored, refuse_hollow

FULL_FILE = -4  # word 1 of the header of matrices that are sorted by equations
INTEGER, SHORT, PACKED = 1 << 31, 1 << 30, 0b111 << 27  # flags of a record
# Words of the header, counted from 1; a pointer is a number of words in two halves.
EQUATIONS, MATRICES, LUMPED, UNSYMMETRIC, CONSTRAINTS = 2, 4, 11, 14, 21
STIFFNESS_AT, MASS_AT, EQUATIONS_OF_NODES_AT = 19, 27, 36


def read_full(path: Path) -> Found:
    """Return stiffness and mass with the node and the component of each row; rows of held DOFs are left out.

    Raises
    ------
    InputError
        When the file is damaged, holds compressed records, other DOFs than displacements and rotations, a lumped or
        an unsymmetric matrix, or constraint equations.

    References
    ----------
    Theory 8.4. Ansys, Programmer's Reference, format of binary data files: the full stiffness-mass file, fdfull.inc.
    """
    try:
        return _matrices(_Records(path.read_bytes()), path)
    except (IndexError, ValueError, struct.error, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"matrix file {path} is damaged, cut short or no .full file of Ansys; export it again"
        ) from None


class _Records:
    """Records of 32-bit words between their length with flags and their length."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.order = next(o for o in ("<", ">", "") if not o or content[:4] == struct.pack(f"{o}i", 100))
        if not self.order:
            raise ValueError("no standard header")

    def read(self, where: int) -> tuple[np.ndarray, int]:
        """Return the numbers of the record at a word and the word behind it."""
        count, flags = struct.unpack_from(f"{self.order}iI", self.content, 4 * where)
        end = 4 * (where + 2 + count)
        if count < 0 or flags & PACKED or struct.unpack_from(f"{self.order}i", self.content, end) != (count,):
            raise ValueError("a record is damaged or compressed")
        size = (4 if flags & INTEGER else 8) // (2 if flags & SHORT else 1)
        kind = f"{self.order}{'i' if flags & INTEGER else 'f'}{size}"
        return np.frombuffer(self.content[4 * (where + 2) : end], dtype=kind), where + 3 + count


def _matrices(records: _Records, path: Path) -> Found:
    _, at = records.read(0)
    header, at = records.read(at)
    _refuse_kinds(header, path)
    components, at = records.read(at)
    nodes, _ = records.read(at)
    of_node, at = records.read(_pointer(header, EQUATIONS_OF_NODES_AT))
    state, _ = records.read(at)
    n = int(header[EQUATIONS - 1])
    refuse_hollow(n, len(records.content) // 8)
    if np.any(components < 1) or np.any(components > 6):
        raise InputError(
            f"matrix file {path} has DOFs other than displacements and rotations; give the structure alone"
        )
    rows = _rows(nodes.astype(int), of_node.astype(int), components.astype(int) - 1, n)
    free = state[:n] >= 0
    K, M = (_matrix(records, _pointer(header, word), n) for word in (STIFFNESS_AT, MASS_AT))
    K, M = (Labelled(A[free][:, free].tocsr(), rows[free]) for A in (K, M))
    return Found({"K": K, "M": M}, supported=_supports(rows[~free], path))


def _supports(fixed_dofs: np.ndarray, path: Path) -> str:
    """Return why the matrices are those of a supported structure, by the (node, component) of the held DOFs."""
    if not len(fixed_dofs):
        return ""
    node, component = fixed_dofs[0]
    return (
        f"matrix file {path} leaves out {len(fixed_dofs)} DOFs that supports hold, the first "
        f"{COMPONENTS[component]} of node {node}: write it without supports (DDELE,ALL), and give these nodes as "
        "interfaces"
    )


def refuse_turned(nodes: Path) -> None:
    """Refuse nodes of an Ansys file whose matrices have rows along axes of their own."""
    turned = turned_nodes(nodes) if deck_format(nodes) == "ansys" else []
    if turned:
        raise InputError(
            f"file of nodes {nodes}: {len(turned)} nodes are turned (THXY to THZX), the first is node {turned[0]}; "
            "write the matrices with all nodes in global axes (NROTAT)"
        )


def _pointer(header: np.ndarray, word: int) -> int:
    low, high = (int(x) for x in header[word - 1 : word + 1])
    return (low & 0xFFFFFFFF) | (high << 32)


def _refuse_kinds(header: np.ndarray, path: Path) -> None:
    """Refuse what the matrices may be and cannot be read; a file without mass has no pointer to it."""
    if len(header) < 40 or header[0] != FULL_FILE or not 0 < header[EQUATIONS - 1]:
        raise ValueError("no file of assembled matrices")
    advice = "write it by ANTYPE,MODAL with LUMPM,OFF, MODOPT,LANB and WRFULL"
    for word, what in (
        (LUMPED, "a lumped mass matrix"),
        (UNSYMMETRIC, "unsymmetric matrices"),
        (CONSTRAINTS, "constraint equations"),
    ):
        if header[word - 1]:
            raise InputError(f"matrix file {path} has {what}, which cannot be read; {advice}")
    for word, what in ((STIFFNESS_AT, "stiffness"), (MASS_AT, "mass")):
        if not _pointer(header, word):
            raise InputError(f"matrix file {path} has no {what} matrix; {advice}")


def _rows(nodes: np.ndarray, of_node: np.ndarray, components: np.ndarray, n: int) -> np.ndarray:
    """Return node number and component of each equation; a node has the first of the components."""
    if of_node.sum() != n or of_node.max() > len(components) or len(of_node) != len(nodes):
        raise ValueError("nodes and equations do not match")
    first = np.repeat(np.cumsum(of_node) - of_node, of_node)
    return np.stack([np.repeat(nodes, of_node), components[np.arange(n) - first]], axis=1)


def _matrix(records: _Records, where: int, n: int) -> csr_array:
    """Read the columns and the values of one half of each row in turn."""
    columns, values = [], []
    for _ in range(n):
        found, where = records.read(where)
        numbers, where = records.read(where)
        if len(found) != len(numbers):
            raise ValueError("a row is damaged")
        columns.append(found)
        values.append(numbers)
    row = np.repeat(np.arange(n), [len(found) for found in columns])
    place = row, np.concatenate(columns).astype(int) - 1
    return mirrored(coo_array((np.concatenate(values).astype(float), place), shape=(n, n)).tocsr())
