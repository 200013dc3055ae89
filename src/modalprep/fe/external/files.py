"""Read stiffness and mass matrices, and the nodes they belong to, from the files of other programs."""

from __future__ import annotations

import codecs
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.external.ansys_full import read_full, refuse_turned
from modalprep.fe.external.archive import read_archive
from modalprep.fe.external.matrix_market import BANNER, read_market
from modalprep.fe.external.model import model_from_matrices, unit_factors
from modalprep.fe.links.interface import Interface
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.abaqus.matrices import read_abaqus_matrix
from modalprep.fe.readers.deck_format import deck_format
from modalprep.fe.readers.digest import NASTRAN, matrices_digest
from modalprep.fe.readers.entries import Found, Labelled, cloud, in_basic_axes, together
from modalprep.fe.readers.nastran.dmig import read_dmig
from modalprep.fe.readers.nastran.grids import deck_grids
from modalprep.fe.readers.nastran.reader import read_cards
from modalprep.fe.readers.output4 import read_output4
from modalprep.fe.readers.read import read_cells
from modalprep.suggest import refuse_missing

DECK = NASTRAN | {".pch", ".dmig"}
ENTRIES = {".sti", ".mas"}  # of CalculiX
FULL = ".full"  # of Ansys
RELATIVE = "give a path relative to the pipeline file"
TABLE = {".csv", ".txt", ".dof"}
FIRST = {"stiffness": "k", "mass": "m"}  # how the name of a matrix begins


@dataclass(frozen=True, eq=False, kw_only=True)
class Matrices(Mesh):
    """The nodes of a model (a mesh, m) with its stiffness and mass, as read.

    Attributes
    ----------
    K, M : (n, n) csr
        In the units of the file.
    dof : (n_nodes, 6) or (n, 2) int, or None
        As `model_from_matrices` takes it.
    units : (str, str or None)
        Of length and mass.
    supported : str
        Why the matrices are those of a supported structure; empty when they are not known to be.
    """

    K: csr_array
    M: csr_array
    dof: Any
    units: tuple[str, str | None]
    supported: str = ""

    def model(self, interfaces: Mapping[str, Interface], root: str | None = None) -> FEModel:
        """Return the model, as `model_from_matrices` does; refuse a structure that is known to be supported."""
        if self.supported:
            raise InputError(self.supported)
        return model_from_matrices(
            self.K,
            self.M,
            self,
            self.dof,
            interfaces=interfaces,
            root=root,
            length_unit=self.units[0],
            mass_unit=self.units[1],
        )


def read_matrices(
    *,
    file: str | Path | None = None,
    stiffness: str | Path | None = None,
    mass: str | Path | None = None,
    nodes: str | Path | None = None,
    dof: str | Path | None = None,
    dofs_per_node: int | None = None,
    length_unit: str = "m",
    mass_unit: str | None = None,
) -> Matrices:
    """Read stiffness, mass and nodes for `model_from_matrices`.

    Formats of the matrices are MatrixMarket (.mtx), numpy archives (.npz; also FEM files of Exudyn), Nastran OUTPUT4
    (.op4) and DMIG (.bdf, .dat, .nas, .pch), Abaqus substructures and matrix output (.mtx, .inp), CalculiX (.sti, .mas)
    and Ansys (.full, whose nodes come from the .cdb file).

    Parameters
    ----------
    file : path
        With both matrices, perhaps the nodes too.
    stiffness, mass : path
        Instead of `file`.
    nodes : path
        .csv or .npy with x, y, z, or node number, x, y, z in each row; a Nastran deck; any mesh file.
    dof : path
        The node number and component (1..6) of each row of the matrices, as ``17 3`` or ``17.3``; needed where the
        matrices do not contain it and their rows are not in the order of the nodes.
    dofs_per_node : int
        Three or six, to check against the matrices.
    length_unit, mass_unit : str
        Units of the matrices and the nodes, with seconds.

    Returns
    -------
    Matrices
        A mesh in m with ``K`` and ``M (n, n)`` in the units of the file; its method `model` returns the FEModel.

    Raises
    ------
    InputError
        When a file is missing or damaged, or does not contain the matrices or nodes.

    Examples
    --------
    >>> read_matrices(stiffness="k.mtx", mass="m.mtx", nodes="nodes.csv")
    Traceback (most recent call last):
    modalprep.errors.InputError: matrix file k.mtx does not exist; give a path relative to the pipeline file
    """
    length, _ = unit_factors(length_unit, mass_unit)
    sources = _sources(file, stiffness, mass)
    K, M = (pick(found, name, path) for name, (path, found) in sources.items())
    found = sources["stiffness"][1]
    mesh = found.nodes.with_(points=found.nodes.points * length, scale=length) if found.nodes is not None else None
    if nodes is not None:
        mesh = read_nodes(Path(nodes), length_unit, length)
        if sources["stiffness"][0].suffix.lower() == FULL:
            refuse_turned(Path(nodes))
    if mesh is None:
        raise InputError(
            f"{sources['stiffness'][0]} holds no nodes; say in which file their coordinates are: nodes = ..."
        )
    K, M, rows = together(K, M)
    if dof is not None:
        rows = _read_rows(Path(dof))
    if dofs_per_node is not None and K.shape[0] != dofs_per_node * len(mesh.points):
        raise InputError(
            f"{K.shape[0]} rows of the matrices are not {dofs_per_node} for each of {len(mesh.points)} nodes; give "
            "every node, or a file dof that says which row is which"
        )
    used = [path for path in (file, stiffness, mass, nodes, dof) if path is not None]
    fields = {f: getattr(mesh, f) for f in Mesh.__dataclass_fields__}
    fields |= {"source": ", ".join(Path(p).name for p in used), "sha256": matrices_digest(used)}
    return Matrices(
        **fields,
        K=K,
        M=M,
        dof=found.dof if rows is None else _pairs(rows, mesh),
        units=(length_unit, mass_unit),
        supported=found.supported,
    )


def _sources(file, stiffness, mass) -> dict[str, tuple[Path, Found]]:
    if (file is None) == (stiffness is None or mass is None) or (file is not None and (stiffness or mass)):
        raise InputError("matrices come from either 'file' (both in one), or 'stiffness' and 'mass'; give one way")
    paths = {"stiffness": Path(str(file or stiffness)), "mass": Path(str(file or mass))}
    read = {path: _read(path) for path in dict.fromkeys(paths.values())}
    return {name: (path, read[path]) for name, path in paths.items()}


def _read(path: Path) -> Found:
    refuse_missing(path, "matrix file", RELATIVE)
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return read_archive(path)
    if suffix == FULL:
        return read_full(path)
    if suffix == ".op4":
        return Found({name: Labelled(A, None) for name, A in read_output4(path).items()})
    if suffix in DECK:
        return deck_matrices(path)
    if suffix in ENTRIES | {".mtx", ".inp"}:
        with path.open("rb") as opened:
            market = opened.read(1000).removeprefix(codecs.BOM_UTF8).startswith(BANNER)
        return Found({"": Labelled(read_market(path), None)} if market else read_abaqus_matrix(path))
    raise InputError(
        f"matrix file {path}: {suffix or 'a name without ending'} is not known; known are .mtx, .npz, .op4, "
        f"{FULL}, {', '.join(sorted(DECK | ENTRIES))}"
    )


def pick(matrices: Found, name: str, path: Path) -> Labelled:
    """Return the only matrix of a file, or the only one whose name begins with k or m."""
    chosen = [A for key, A in matrices.matrices.items() if key.lower().startswith((FIRST[name], name))]
    if len(matrices.matrices) == 1:
        chosen = list(matrices.matrices.values())
    if len(chosen) != 1:
        listed = ", ".join(matrices.matrices) or "none"
        raise InputError(
            f"matrix file {path} holds the matrices {listed}: which is the {name} cannot be told; give it one whose "
            f"name begins with {FIRST[name].upper()}, or a file of its own"
        )
    return chosen[0]


def read_nodes(path: Path, unit: str, length: float) -> Mesh:
    """Return the nodes of a table, a deck or a mesh file in m; `length` is a `unit` in m."""
    refuse_missing(path, "file of nodes", RELATIVE)
    suffix = path.suffix.lower()
    if suffix in DECK and deck_format(path) in (None, "nastran"):
        mesh = deck_nodes(path)
        if mesh is None:
            raise InputError(f"file of nodes {path} has no GRID; give the deck with the nodes")
        return mesh.with_(points=mesh.points * length, scale=length)
    if suffix in TABLE | {".npy"}:
        table = _table(path)
        if table.ndim != 2 or table.shape[1] not in (3, 4):
            raise InputError(f"file of nodes {path} has rows of {table.shape[-1]} numbers; give [node number,] x, y, z")
        labels = _integers(table[:, 0], path) if table.shape[1] == 4 else np.zeros(0, dtype=int)
        return cloud(table[:, -3:], length, labels=labels)
    if suffix == ".npz":
        found = read_archive(path).nodes
        if found is None:
            raise InputError(f"file of nodes {path} holds no array 'nodes'; save the coordinates under this name")
        return found.with_(points=found.points * length, scale=length)
    return read_cells(path, unit).with_(properties={}, links=(), data={})


def deck_nodes(path: Path) -> Mesh | None:
    """Return the grids of a deck in its own unit of length, None when it has none."""
    grids = deck_grids(path, read_cards(path).cards)
    if grids is None:
        return None
    if np.any(grids.cd):
        raise grids.card(int(np.flatnonzero(grids.cd)[0])).error(
            "its displacement system (CD) is not the basic one; give the matrices in a deck with these grids, or "
            "export them with all displacements in basic axes"
        )
    return cloud(grids.points, labels=grids.ids)


def deck_matrices(path: Path, scalar: bool = False) -> Found:
    """Return the DMIG matrices of a deck, turned to basic axes, with its grids; `scalar` as `read_dmig` takes it."""
    cards = read_cards(path).cards
    matrices = read_dmig(path, scalar, cards)
    grids = deck_grids(path, cards)
    if grids is None:
        return Found(matrices)
    axes = {int(grids.ids[row]): grids.displacement(row).T for row in np.flatnonzero(grids.cd).tolist()}
    turned = {name: in_basic_axes(A, axes) for name, A in matrices.items()}
    return Found(turned, cloud(grids.points, labels=grids.ids))


def _read_rows(path: Path) -> np.ndarray:
    """Return (node number, component 0..5) of each row."""
    refuse_missing(path, "file of DOFs", RELATIVE)
    if path.suffix.lower() == ".npy":
        table = _table(path)
    else:
        words = path.read_text(encoding="utf-8-sig", errors="replace").replace(",", " ").replace(".", " ")
        table = _numbers([line.split() for line in words.splitlines() if line.strip()], path)
    if table.ndim != 2 or table.shape[1] != 2:
        raise InputError(f"file of DOFs {path} must have two numbers in each row: node number and component 1 to 6")
    rows = _integers(table.ravel(), path).reshape(-1, 2) - [0, 1]
    return rows


def _table(path: Path) -> np.ndarray:
    """Return the numbers of a table of text, whose first line may be a heading, or of a .npy file."""
    if path.suffix.lower() == ".npy":
        try:
            return np.array(np.load(path, mmap_mode="r", allow_pickle=False), dtype=float)  # never beyond its end
        except (ValueError, OSError, EOFError, TypeError):
            raise InputError(f"{path} is damaged or no array of numbers; save it again with numpy.save") from None
    lines = path.read_text(encoding="utf-8-sig", errors="replace").replace(",", " ").replace(";", " ").splitlines()
    rows = [line.split() for line in lines if line.strip() and not line.lstrip().startswith(("#", "%", "*"))]
    heading = rows and not _is_number(rows[0][0])
    return _numbers(rows[1:] if heading else rows, path)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _numbers(rows: list[list[str]], path: Path) -> np.ndarray:
    width = len(rows[0]) if rows else 0
    for k, row in enumerate(rows):
        if len(row) != width or not all(map(_is_number, row)):
            raise InputError(
                f"{path}: row {k + 1} is {' '.join(row)!r}, not {width} numbers like the first; correct it"
            )
    return np.array(rows, dtype=float).reshape(len(rows), width)


def _integers(values: np.ndarray, path: Path) -> np.ndarray:
    numbers = values.astype(int) if np.all(np.isfinite(values)) else np.zeros(0)
    if not np.array_equal(numbers, values):
        raise InputError(f"{path}: a node number is not a whole number; give node number, x, y, z")
    return numbers


def _pairs(rows: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Return (row of the node in the mesh, component) of (node number, component)."""
    labels = mesh.labels if len(mesh.labels) else np.arange(1, len(mesh.points) + 1)
    order = np.argsort(labels)
    at = np.searchsorted(labels, rows[:, 0], sorter=order)
    known = at < len(labels)
    known[known] = labels[order[at[known]]] == rows[known, 0]
    if not np.all(known):
        missing = np.unique(rows[~known, 0])
        raise InputError(
            f"the matrices have rows of node {missing[0]} ({len(missing)} such nodes), which is not among the "
            f"{len(labels)} nodes given; give every node with its number"
        )
    return np.stack([order[at], rows[:, 1]], axis=1)
