"""Matrices of Abaqus and CalculiX as text: substructures, and one entry per line (theory 8.3)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.errors import InputError
from modalprep.fe.readers.entries import Labelled, integers, labelled, mirrored, refuse_hollow

ENTRY = {3: "row, column, value", 5: "node, dof, node, dof, value"}


def read_abaqus_matrix(path: Path) -> dict[str, Labelled]:
    r"""Return the matrices of a file: ``stiffness`` and ``mass`` of a substructure, one without a name else.

    A substructure is ``*USER ELEMENT`` with packed ``*MATRIX`` blocks. Entries are ``node, dof, node, dof, value``
    (``*MATRIX OUTPUT``, matrix input) or ``row, column, value`` (coordinate; ``.sti`` and ``.mas`` of CalculiX),
    both triangles or one.

    Raises
    ------
    InputError
        When the file is damaged or of neither form.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "k.mtx"
    >>> _ = path.write_text("7,1, 7,1, 4.\n7,2, 7,1, -2.\n7,2, 7,2, 5.\n")
    >>> K = read_abaqus_matrix(path)[""]
    >>> K.matrix.toarray().tolist(), K.rows.tolist()
    ([[4.0, -2.0], [-2.0, 5.0]], [[7, 0], [7, 1]])
    """
    lines = [line.strip() for line in path.read_text(encoding="utf-8-sig", errors="replace").splitlines()]
    try:
        if any(line.upper().startswith("*USER ELEMENT") for line in lines):
            return _substructure(lines)
        return {"": _entries([line for line in lines if line and not line.startswith("*")])}
    except (ValueError, IndexError) as error:
        raise InputError(f"matrix file {path} is damaged or cut short ({error}); export it again") from None


def _numbers(lines: list[str]) -> np.ndarray:
    return np.array(" ".join(lines).replace(",", " ").upper().replace("D", "E").split(), dtype=float)


def _entries(lines: list[str]) -> Labelled:
    width = len(lines[0].replace(",", " ").split()) if lines else 0
    if width not in ENTRY:
        raise ValueError(f"{width} numbers in a line, not {' or '.join(ENTRY.values())}")
    table = _numbers(lines)
    if table.size % width:
        raise ValueError("the last line is not complete")
    table = table.reshape(-1, width)
    place = integers(table[:, :-1])
    if width == 3:
        return Labelled(mirrored(_square(table[:, 2], *(place - 1).T)), None)
    found = labelled(place[:, :2] - [0, 1], place[:, 2:] - [0, 1], table[:, 4])
    return found._replace(matrix=mirrored(found.matrix))


def _square(values: np.ndarray, row: np.ndarray, column: np.ndarray) -> csr_array:
    n = 1 + max(row.max(), column.max())
    refuse_hollow(n, len(values))
    return coo_array((values, (row, column)), shape=(n, n)).tocsr()


def _substructure(lines: list[str]) -> dict[str, Labelled]:
    start = next(k for k, line in enumerate(lines) if line.upper().startswith("*USER ELEMENT"))
    full = "UNSYM" in lines[start].upper()
    blocks = [k for k in range(start, len(lines)) if lines[k].upper().startswith("*MATRIX")]
    if not blocks:
        raise ValueError("there is no *MATRIX after *USER ELEMENT")
    rows = _rows(lines[start + 1 : blocks[0]])
    found = {}
    for k, end in zip(blocks, [*blocks[1:], len(lines)], strict=True):
        kind = lines[k].upper().replace(" ", "").partition("TYPE=")[2]
        data = [line for line in lines[k + 1 : end] if line and not line.startswith("*")]
        found[kind.lower()] = Labelled(packed(_numbers(data), len(rows), full), rows)
    return found


def _rows(lines: list[str]) -> np.ndarray:
    """Node and component of each row: node numbers stand in the comments, lists of dofs on the other lines."""
    listed = [line for line in lines if line.startswith("**") and line.strip("*, \t0123456789") == ""]
    nodes = [int(x) for line in listed for x in line.strip("*").replace(",", " ").split()]
    dofs: dict[int, list[int]] = {}
    for k, line in enumerate(line for line in lines if line and not line.startswith("*")):
        numbers = [int(x) for x in line.replace(",", " ").split()]
        dofs |= {0: numbers} if k == 0 else {numbers[0] - 1: numbers[1:]}
    rows = []
    held = dofs.get(0, [])
    for k, node in enumerate(nodes):
        held = dofs.get(k, held)
        rows += [(node, dof - 1) for dof in held]
    if not rows:
        raise ValueError("the nodes or dofs of *USER ELEMENT are missing")
    return np.array(rows)


def packed(values: np.ndarray, n: int, full: bool) -> csr_array:
    """Return the matrix (n, n) of its lower triangle row by row, or where `full` of all its rows.

    Raises
    ------
    ValueError
        When there are too many or too few values.

    Examples
    --------
    >>> packed(np.array([2.0, 1.0, 3.0]), 2, full=False).toarray().tolist()
    [[2.0, 1.0], [1.0, 3.0]]
    """
    wanted = n * n if full else n * (n + 1) // 2
    if len(values) != wanted:
        raise ValueError(f"a matrix of {n} dofs has {len(values)} of {wanted} values")
    if full:
        return csr_array(values.reshape(n, n))
    A = np.zeros((n, n))
    A[np.tril_indices(n)] = values
    return csr_array(A + np.tril(A, -1).T)
