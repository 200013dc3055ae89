"""Archives of numpy (.npz) with matrices: scipy's, plain ones, and FEM files of Exudyn.

Such files may hold pickles, which can run any program when they are read. Here a pickle may only make numpy arrays,
sparse matrices of scipy, and Python's lists, dictionaries, strings and numbers.
"""

from __future__ import annotations

import math
import pickle
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from scipy import sparse

from modalprep.errors import InputError
from modalprep.fe.readers.entries import Found, Labelled, cloud
from modalprep.linalg.memory import available_memory

CORNERS = {"Tet4": ("tetra", 4), "Tet10": ("tetra", 4), "Hex8": ("hexahedron", 8), "Hex20": ("hexahedron", 8)}
COPIES = 3  # of an array at a time: as it is stored, as float64, and as a sparse matrix
ARRAYS = {("_reconstruct", "multiarray"), ("scalar", "multiarray"), ("_frombuffer", "numeric")}
SPARSE = {f"{kind}_{form}" for kind in ("bsr", "coo", "csc", "csr", "dia") for form in ("array", "matrix")}


class _Unpickler(pickle.Unpickler):
    """Restores arrays, sparse matrices and plain containers, and refuses everything else."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a harmless constructor; refuse every other name."""
        parts = module.split(".")
        if module == "numpy" and name in ("ndarray", "dtype"):
            return getattr(np, name)
        if parts[:2] in (["numpy", "core"], ["numpy", "_core"]) and (name, parts[-1]) in ARRAYS:
            return super().find_class(f"numpy._core.{parts[-1]}", name)
        if parts[:2] == ["scipy", "sparse"] and name in SPARSE:
            return getattr(sparse, name)
        if (module, name) == ("_codecs", "encode"):
            return _encode
        raise pickle.UnpicklingError(f"it wants to load {module}.{name}")


def _encode(text: str, encoding: str = "latin1") -> bytes:
    """Bytes as old pickles spell them."""
    return text.encode("latin1")


def read_archive(path: Path) -> Found:
    """Return the matrices of an archive, its nodes (n_nodes, 3) and dof table where it has them.

    One matrix of ``scipy.sparse.save_npz`` has no name. Plain archives hold ``K``, ``M``, ``nodes`` and ``dof``
    (as `FEModel.from_matrices` takes them), FEM files of Exudyn matrices, nodes, elements and node sets.

    Raises
    ------
    InputError
        When the file is damaged, holds none of these, or a pickle that would do more than make arrays.
    """
    with opened(path) as members:
        names = members.names
        if {"stiffnessMatrix", "massMatrix", "nodes"} <= names:
            return _fem(members)
        if {"format", "data", "shape"} <= names:
            return Found({"": Labelled(_parts(members), None)})
        if names & {"K", "M", "nodes"}:
            return _plain(members, names)
    raise InputError(f"archive {path} holds {', '.join(sorted(names)) or 'nothing'}; it needs K, M and nodes")


@contextmanager
def opened(path: Path) -> Iterator[Members]:
    """Open an archive; every error becomes one message.

    Raises
    ------
    InputError
        When it is damaged, larger than the memory, or holds a pickle that would do more than make arrays.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if COPIES * sum(info.file_size for info in archive.infolist()) > available_memory():
                raise InputError(f"archive {path} takes more than the memory that is free; use a larger machine")
            yield Members(archive, path)
    except InputError:
        raise
    except Exception:  # a damaged archive may fail in any way
        raise InputError(f"archive {path} is damaged or cut short; write it again") from None


class Members:
    """The arrays of an archive by name, each read on first use."""

    def __init__(self, archive: zipfile.ZipFile, path: Path) -> None:
        self.archive, self.path = archive, path
        self.names = {name.removesuffix(".npy") for name in archive.namelist()}

    def __getitem__(self, name: str) -> Any:
        info = self.archive.getinfo(f"{name}.npy")
        with self.archive.open(info) as file:
            version = npy.read_magic(file)
            header = npy.read_array_header_1_0(file) if version == (1, 0) else npy.read_array_header_2_0(file)
            if header[2].hasobject:
                return self._unpickled(file, name)
        if math.prod(header[0]) * header[2].itemsize > info.file_size:
            raise InputError(f"archive {self.path}: {name} declares more than it holds; write it again")
        with self.archive.open(info) as file:
            return npy.read_array(file, allow_pickle=False)

    def _unpickled(self, file: IO[bytes], name: str) -> Any:
        try:
            value = _Unpickler(file).load()
        except Exception as error:  # a damaged pickle may fail in any way
            raise InputError(
                f"archive {self.path}: {name} is a pickle that is not read, because {error}; save the matrices with "
                "scipy.sparse.save_npz and the nodes with numpy.save"
            ) from None
        return value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value


def _parts(members: Members) -> sparse.csr_array:
    """Matrix of the arrays that `scipy.sparse.save_npz` writes."""
    kind = members["format"].item()
    shape = members["shape"]
    data = members["data"]
    kind = kind.decode() if isinstance(kind, bytes) else kind
    if kind == "coo":
        return sparse.coo_array((data, (members["row"], members["col"])), shape=tuple(shape)).tocsr()
    if kind not in ("csr", "csc"):
        raise InputError(f"archive {members.path}: its matrix is stored as {kind}; save it as csr")
    return _checked(kind, data, members["indices"], members["indptr"], tuple(shape))


def _checked(kind: str, data: Any, indices: Any, indptr: Any, shape: tuple) -> sparse.csr_array:
    """Return a matrix after checking its indices, which scipy does not do."""
    A = getattr(sparse, f"{kind}_array")((data, indices, indptr), shape=shape)
    A.check_format(full_check=True)
    return A.tocsr()


def _matrix(value: Any) -> Any:
    """Return a sparse matrix of a pickle checked, an array as it is."""
    if not sparse.issparse(value):
        return sparse.csr_array(np.asarray(value, dtype=float))
    if value.format in ("csr", "csc"):
        return _checked(value.format, value.data, value.indices, value.indptr, value.shape)
    value = value.tocoo()
    return sparse.coo_array((value.data, (value.row, value.col)), shape=value.shape).tocsr()


def _plain(members: Members, names: set[str]) -> Found:
    matrices = {name: Labelled(_matrix(members[name]), None) for name in sorted(names & {"K", "M"})}
    nodes = cloud(members["nodes"]) if "nodes" in names else None
    return Found(matrices, nodes, members["dof"] if "dof" in names else None)


def _fem(members: Members) -> Found:
    matrices = {name: Labelled(_matrix(members[f"{name}Matrix"]), None) for name in ("stiffness", "mass")}
    points = next(iter(members["nodes"].values()))
    cells: dict[str, list[np.ndarray]] = {}
    for part in members["elements"]:
        for name in part.keys() & CORNERS.keys():
            kind, corners = CORNERS[name]
            cells.setdefault(kind, []).append(np.asarray(part[name], dtype=int)[:, :corners])
    sets = {str(s["Name"]): np.asarray(s["NodeNumbers"], dtype=int) for s in members["nodeSets"] if len(s)}
    return Found(matrices, cloud(points, 1.0, {kind: np.concatenate(c) for kind, c in cells.items()}, sets))
