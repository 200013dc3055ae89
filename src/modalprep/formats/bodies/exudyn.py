"""Reading Exudyn: the body of the ``ObjectFFRFreducedOrder`` that an NPZ file describes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.external.archive import Members, opened
from modalprep.formats.bodies.described import body_of, with_notes
from modalprep.formats.contractions import from_inertia
from modalprep.suggest import refuse_missing
from modalprep.vectors import skew

LOST = (
    "rotations of the nodes: those of an interface follow from the nodes around it",
    "damping",
    "geometric stiffness, which Exudyn does not have: the body is for spins well below its first frequency",
)
NEEDED = {"modeBasis", "xRef", "massMatrixReduced", "stiffnessMatrixReduced", "inertiaLocal", "totalMass", "chiU"}
NEEDED |= {"mPhitTPsi", "mXRefTildePsiTilde", "mPsiTildePsiTilde"}


def exudyn_body(path: Path, interfaces: Mapping[str, Sequence[int]] | None = None) -> FlexibleBody:
    """Return the body of an archive, in the units of its numbers.

    Parameters
    ----------
    interfaces : {name: nodes}
        Nodes (from 0) whose mean motion an interface follows; default those that modalprep wrote.

    References
    ----------
    J. Gerstmayr, Exudyn - a C++-based Python package for flexible multibody systems, Multibody Syst. Dyn. 60 (2024)
    533.
    """
    refuse_missing(path, "Exudyn file")
    with opened(path) as members:
        if missing := sorted(NEEDED - members.names):
            raise InputError(
                f"archive {path} is no reduced body of Exudyn (it has no {missing[0]}); a FEM file or matrices are "
                "reduced by a pipeline file with [matrices]"
            )
        body = _body(members, path, interfaces)
    return with_notes(body, "Exudyn", list(LOST))


def _body(members: Members, path: Path, interfaces: Mapping[str, Sequence[int]] | None) -> FlexibleBody:
    K = _numbers(members, "stiffnessMatrixReduced")
    n = len(K)
    points = _numbers(members, "xRef").reshape(-1, 3)
    shape = _numbers(members, "modeBasis", 3 * len(points), n).reshape(-1, 3, n)
    m = float(_numbers(members, "totalMass").reshape(-1)[0])
    J = _numbers(members, "inertiaLocal", 3, 3)
    if not m > 0:
        raise InputError("its mass is not positive")
    names, nodes = _interfaces(members, interfaces, len(points))
    position, phi, psi = zip(*(mean_motion(points[rows], shape[rows]) for rows in nodes), strict=True)
    mesh, cells = _mesh(members, np.concatenate(nodes) if interfaces is None else np.zeros(0, dtype=int), len(points))
    none = np.zeros((len(names), 3, n, n))
    return body_of(
        name=path.stem,
        m=m,
        s0=m * _numbers(members, "chiU", 3),
        E0=from_inertia((J + J.T) / 2),
        M=_numbers(members, "massMatrixReduced", n, n),
        K=_numbers(members, "stiffnessMatrixReduced", n, n),
        D=np.zeros((n, n)),
        S=_numbers(members, "mPhitTPsi", 3, n),
        H=from_inertia(_numbers(members, "mXRefTildePsiTilde", 3, 3 * n).reshape(3, n, 3).transpose(0, 2, 1)),
        P=from_inertia(_numbers(members, "mPsiTildePsiTilde", 3 * n, 3 * n).reshape(n, 3, n, 3).transpose(1, 3, 2, 0)),
        Kg_A=none[0],
        Kg_W=np.zeros((3, 3, n, n)),
        Kg_F=none,
        Kg_T=none,
        phi=np.array(phi),
        psi=np.array(psi),
        interface_name=names,
        interface_position=np.array(position),
        points=points[mesh],
        shape=shape[mesh],
        cells=cells,
    )


def _numbers(members: Members, name: str, *shape: int) -> np.ndarray:
    array = np.asarray(members[name], dtype=float)
    if not np.all(np.isfinite(array)) or (shape and array.size != np.prod(shape)):
        raise InputError(f"{name} has {array.size} numbers instead of {np.prod(shape)}, or some that are not finite")
    return array.reshape(shape) if shape else array


def _interfaces(
    members: Members, chosen: Mapping[str, Sequence[int]] | None, count: int
) -> tuple[tuple[str, ...], list[np.ndarray]]:
    if chosen is None and not {"interfaceNames", "interfaceNodes"} <= members.names:
        raise InputError(
            "it does not say which of its nodes are interfaces; name them: --interface root=1,2,3 (numbers from 0), in "
            "Python interfaces = {'root': [1, 2, 3]}"
        )
    if chosen is None:
        table = np.asarray(members["interfaceNodes"], dtype=int)
        chosen = dict(zip((str(name) for name in members["interfaceNames"]), table, strict=True))
    nodes = [np.asarray(rows, dtype=int) for rows in chosen.values()]
    for name, rows in zip(chosen, nodes, strict=True):
        if not len(rows) or rows.min() < 0 or rows.max() >= count:
            raise InputError(f"interface {name!r} has nodes that do not exist; there are 0 to {count - 1}")
    return tuple(chosen), nodes


def mean_motion(points: np.ndarray, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return place (3,), translation and rotation (3, n) of the rigid motion nearest to that of nodes (k, 3, n).

    Examples
    --------
    >>> cross = np.concatenate([np.eye(3), -np.eye(3)])
    >>> turned = np.cross([0, 0, 2.0], cross)[..., None]
    >>> mean_motion(cross, turned)[2].ravel().round(12)
    array([0., 0., 2.])
    """
    centre = points.mean(axis=0)
    move = shape.mean(axis=0)
    arms = points - centre
    n = shape.shape[2]
    turn = np.linalg.lstsq(-skew(arms).reshape(-1, 3), (shape - move).reshape(-1, n), rcond=1e-9)[0]
    return centre, move, turn


def _mesh(members: Members, added: np.ndarray, count: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the nodes without those that represent interfaces, and the triangles of the surface between them."""
    own = np.setdiff1d(np.arange(count), added)
    own = own if len(own) else np.arange(count)
    triangles = np.asarray(members["trigList"]) if "trigList" in members.names else np.zeros((0, 3), dtype=int)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu" or not len(triangles):
        return own, {}
    if triangles.min() < 0 or triangles.max() >= count:
        raise InputError(f"trigList names nodes that do not exist; there are 0 to {count - 1}")
    row = np.full(count, -1)
    row[own] = np.arange(len(own))
    triangles = row[triangles]
    return own, {"triangle": triangles[np.all(triangles >= 0, axis=1)]}
