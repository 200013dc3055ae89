"""Reading reduced matrices whose rows are labelled by node and component: DMIG, Abaqus and CalculiX."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.external.files import deck_matrices, pick, read_nodes
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.abaqus.lexer import Block, read_blocks
from modalprep.fe.readers.abaqus.matrices import read_abaqus_matrix
from modalprep.fe.readers.entries import Found, cloud, together
from modalprep.formats.bodies.described import Units
from modalprep.formats.bodies.superelements import noted
from modalprep.suggest import refuse_missing
from modalprep.supplied.reduced import body_from_reduced

NAMED = re.compile(r"\$ GRID (\d+): interface (.+)")  # as modalprep writes it
HEAD = re.compile(r"\$ Body (.*): .* kg, reduced")
MOST = 20_000  # rows of a reduced body
Interfaces = Mapping[str, Sequence[int]] | None
BARE = "it holds the matrices of a whole model, which a pipeline file with [matrices] reduces"


def dmig_body(path: Path, length_unit: str, mass_unit: str | None, interfaces: Interfaces = None) -> FlexibleBody:
    """Return the body of a deck with GRID and DMIG entries; scalar points are its generalised coordinates."""
    refuse_missing(path, "DMIG file")
    found = deck_matrices(path, scalar=True)
    if found.nodes is None:
        raise InputError("it has no GRID, so that the places of its nodes are not known; add those of the matrices")
    lines = path.read_text(encoding="ascii", errors="replace").splitlines()
    names = {int(match[1]): match[2].strip() for line in lines if (match := NAMED.match(line))}
    title = next((match[1] for line in lines if (match := HEAD.match(line))), path.stem)
    units: Units = {"length_unit": length_unit, "mass_unit": mass_unit}
    body = _reduced(title, found, path, found.nodes, names, interfaces, units)
    return noted(body, "shapes between the nodes")


def substructure_body(
    path: Path, length_unit: str, mass_unit: str | None, interfaces: Interfaces = None, nodes: Path | None = None
) -> FlexibleBody:
    """Return the body of a substructure of Abaqus or CalculiX.

    That is a file with ``*USER ELEMENT`` and ``*MATRIX``, or a deck with ``*MATRIX ASSEMBLE``. The places of the nodes
    are those of the deck, else of the file `nodes`.
    """
    refuse_missing(path, "substructure")
    blocks = read_blocks(path)[0] if path.suffix.lower() == ".inp" else []
    found = _assembled(blocks, path) if blocks else Found(read_abaqus_matrix(path))
    if "mass" not in found.matrices:
        raise InputError(
            "it has no *MATRIX, TYPE=MASS; write it with MASS=YES" if "stiffness" in found.matrices else BARE
        )
    mesh = read_nodes(Path(nodes), "m", 1.0) if nodes is not None else _own_nodes(blocks)
    if mesh is None:
        raise InputError("it does not say where its nodes are; name the deck or table that does: --nodes FILE")
    units: Units = {"length_unit": length_unit, "mass_unit": mass_unit}
    return noted(_reduced(path.stem, found, path, mesh, {}, interfaces, units), "shapes between the nodes")


def _assembled(blocks: list[Block], path: Path) -> Found:
    """Return the matrices of a deck: in it, or in the files of ``*MATRIX ASSEMBLE``."""
    found = [block for block in blocks if block.keyword == "MATRIX ASSEMBLE"]
    if not found:
        return Found(read_abaqus_matrix(path) if any(b.keyword == "USER ELEMENT" for b in blocks) else {})
    if len(found) > 1:
        raise InputError(f"it has {len(found)} *MATRIX ASSEMBLE; give a deck with the one that is the body")
    named = {key: found[0].options.get(f"{key.upper()}FILE") for key in ("stiffness", "mass")}
    files = {key: name for key, name in named.items() if name is not None}
    if len(files) < len(named):
        raise InputError("its *MATRIX ASSEMBLE needs STIFFNESSFILE and MASSFILE; a body without mass cannot move")
    matrices = {}
    for key, name in files.items():
        refuse_missing(path.parent / name, f"{key} file")
        matrices[key] = next(iter(read_abaqus_matrix(path.parent / name).values()))
    return Found(matrices)


def _own_nodes(blocks: list[Block]) -> Mesh | None:
    """Return the nodes of a deck in its own unit; None when it has none."""
    rows = [row for block in blocks if block.keyword == "NODE" for row in block.rows]
    if not rows:
        return None
    points = np.array([row.reals(1, 3, "a coordinate") for row in rows])
    return cloud(points, labels=np.array([row.integer(0, "a node") for row in rows]))


def _reduced(
    name: str,
    matrices: Found,
    path: Path,
    mesh: Mesh,
    names: dict[int, str],
    interfaces: Interfaces,
    units: Units,
) -> FlexibleBody:
    """Return the body of labelled matrices; rows of nodes without a place are generalised coordinates."""
    K, M, rows = together(pick(matrices, "stiffness", path), pick(matrices, "mass", path))
    if rows is None:
        raise InputError(BARE)
    if len(rows) > MOST:
        raise InputError(f"its matrices have {len(rows)} rows; {BARE}")
    labels = mesh.labels if len(mesh.labels) else np.arange(1, len(mesh.points) + 1)
    used = np.intersect1d(rows[:, 0], labels)
    if not len(used):
        raise InputError(f"the matrices are of the nodes {_few(rows[:, 0])}, none of which has a place")
    inside = np.isin(rows[:, 0], used) & (rows[:, 1] >= 0) & (rows[:, 1] < 6)
    table = np.full((len(used), 6), -1)
    table[np.searchsorted(used, rows[inside, 0]), rows[inside, 1]] = np.flatnonzero(inside)
    order = np.argsort(labels)
    place = mesh.points[order[np.searchsorted(labels, used, sorter=order)]]
    said = [names.get(int(number), f"node_{number}") for number in used]
    chosen = (interfaces or {}).items()
    own = {key: [names.get(k, f"node_{k}") for k in nodes] for key, nodes in chosen} or None
    damping = _damping(matrices, rows)
    return body_from_reduced(
        name, K.toarray(), M.toarray(), place, dof=table, names=said, interfaces=own, damping=damping, **units
    )


def _few(numbers: np.ndarray) -> str:
    some = [str(number) for number in np.unique(numbers)[:5]]
    return ", ".join(some) + (" ..." if len(np.unique(numbers)) > len(some) else "")


def _damping(matrices: Found, rows: np.ndarray) -> np.ndarray | None:
    """Return the viscous damping over the rows, of a matrix whose name begins with B."""
    given = [A for key, A in matrices.matrices.items() if key.lower().startswith(("b", "viscous"))]
    if len(given) != 1 or given[0].rows is None:
        return None
    known = {tuple(row): k for k, row in enumerate(rows.tolist())}
    at = [known.get(tuple(row), -1) for row in given[0].rows.tolist()]
    if -1 in at:
        raise InputError("its damping has rows that its stiffness and mass do not have")
    D = np.zeros((len(rows), len(rows)))
    D[np.ix_(at, at)] = given[0].matrix.toarray()
    return D
