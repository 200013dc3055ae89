"""MatrixMarket files.

SciPy's reader (1.17) ends the process on characters behind the last number, and takes 1.5D3 as 1.5, so this is our own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.errors import InputError
from modalprep.fe.readers.entries import integers, mirrored, refuse_hollow

BANNER = b"%%MatrixMarket"


def read_market(path: Path) -> csr_array:
    r"""Return the real matrix of a file: coordinates or array, general or symmetric.

    Raises
    ------
    InputError
        When the file is cut short, or not a real matrix.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "k.mtx"
    >>> lines = ["%%MatrixMarket matrix coordinate real symmetric", "2 2 3", "1 1 4.", "2 1 -2.", "2 2 5."]
    >>> _ = path.write_text("\n".join(lines))
    >>> read_market(path).toarray().tolist()
    [[4.0, -2.0], [-2.0, 5.0]]
    """
    head, *lines = path.read_text(encoding="utf-8-sig", errors="replace").split("\n")
    words = head.lower().split()
    if len(words) != 5 or words[1] != "matrix" or words[2] not in ("coordinate", "array"):
        raise InputError(f"matrix file {path}: its first line {head!r} is no MatrixMarket heading; write it again")
    if words[3] not in ("real", "integer", "double") or words[4] not in ("general", "symmetric"):
        raise InputError(f"matrix file {path} is {words[3]} and {words[4]}; give a real, general or symmetric matrix")
    try:
        body = " ".join(line for line in lines if not line.startswith("%")).upper().replace("D", "E")
        numbers = np.array(body.split(), dtype=float)
        return (_coordinates if words[2] == "coordinate" else _array)(numbers, words[4] == "symmetric")
    except (ValueError, IndexError, MemoryError) as error:
        raise InputError(f"matrix file {path} is damaged or cut short ({error}); write it again") from None


def _coordinates(numbers: np.ndarray, symmetric: bool) -> csr_array:
    rows, columns, count = integers(numbers[:3])
    _refuse_missing(len(numbers) - 3, 3 * count)
    refuse_hollow(max(rows, columns), count)
    row, column, values = numbers[3:].reshape(-1, 3).T
    A = coo_array((values, (integers(row) - 1, integers(column) - 1)), shape=(rows, columns)).tocsr()
    return mirrored(A) if symmetric else A


def _array(numbers: np.ndarray, symmetric: bool) -> csr_array:
    rows, columns = integers(numbers[:2])
    _refuse_missing(len(numbers) - 2, rows * (rows + 1) // 2 if symmetric else rows * columns)
    if not symmetric:
        return csr_array(numbers[2:].reshape(columns, rows).T)
    A = np.zeros((rows, rows))
    A.T[np.triu_indices(rows)] = numbers[2:]  # the lower triangle, column by column
    return csr_array(A + np.tril(A, -1).T)


def _refuse_missing(count: int, wanted: int) -> None:
    if count != wanted:
        raise ValueError(f"{count} numbers instead of {wanted}")
