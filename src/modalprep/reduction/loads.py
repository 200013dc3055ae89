"""User loads: forces, moments and pressure on node sets, as nodal loads of a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.links.interface import interface_position
from modalprep.fe.links.mean_points import MeanPoints, cells_of
from modalprep.fe.links.multipoint import PlacedLink
from modalprep.fe.mesh.cells import Powers, cell_dimension, cell_of
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.suggest import refuse_other

Vector = tuple[float, float, float]
NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, repr=False)
class Load(NodeSet):
    """A force, a moment or a pressure on a node set (fe.select), mesh axes.

    Attributes
    ----------
    force, moment : (3,)
        Total, N and N m. On several nodes they are distributed as by an rbe3 (theory 1.4): a force at the centroid
        evenly over faces, edges or nodes, a moment by forces about it.
    pressure : float
        Pa, on the faces of a group: along their right-hand normal, in the order of their nodes.
    position : (3,) or None
        Point of application, m, mesh coordinates; None: the centroid, of a cylinder the middle of its axis.

    Examples
    --------
    >>> Load(near=(10.0, 0, 0), force=(0, 0, 5.0))
    near (10, 0, 0)
    """

    applies: ClassVar = (Rule(("position",), needs=("force",), advice="moments and pressures have no such place"),)
    force: Vector = NONE
    moment: Vector = NONE
    pressure: float = 0.0
    position: Vector | None = None
    kind = "rbe3"

    def __post_init__(self) -> None:
        """Refuse a place that nothing uses."""
        super().__post_init__()
        refuse_idle(self, "load: ")


def nodal_load(model: FEModel, mesh: Mesh, name: str, load: Load) -> np.ndarray:
    """Return the nodal load ``(n_dof,)`` in N and N m.

    Parameters
    ----------
    model : FEModel
    mesh : Mesh
        From which the model was assembled.
    name : str
        For messages.
    load : Load

    Returns
    -------
    (n_dof,) float
        Forces (N) and moments (N m) in the axes of the mesh.

    Raises
    ------
    InputError
        When the load is zero, its node set is empty or cannot carry it, or its group has no faces.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh, cantilever_model
    >>> F = nodal_load(cantilever_model(), beam_mesh(10), "tip", Load(group="tip", force=(0, 3.0, 0)))
    >>> F.shape, float(F[-5])
    ((66,), 3.0)
    """
    refuse_other("nodal_load: the model", FEModel, model)
    refuse_other("nodal_load: the mesh", Mesh, mesh)
    used = np.flatnonzero(model.dof[: len(mesh.points), 0] >= 0)
    nodes = np.intersect1d(load.nodes(mesh, used), used)
    if not len(nodes):
        raise InputError(f"load {name!r}: no node of {load} belongs to an element with a property")
    F = _resultant(model, mesh, name, load, nodes) + _pressure(model, mesh, name, load)
    if not np.any(F):
        raise InputError(f"load {name!r} is zero; give force, moment or pressure")
    return F


def _resultant(model: FEModel, mesh: Mesh, name: str, load: Load, nodes: np.ndarray) -> np.ndarray:
    F = np.zeros(model.n_dof)
    dofs = model.dof[nodes]
    wrench = np.concatenate([load.force, load.moment])
    if len(nodes) == 1:
        if load.position is not None:
            wrench[3:] += np.cross(load.position - mesh.points[nodes[0]], load.force)
        if np.any(wrench[3:]) and dofs[0, 3] < 0:
            raise InputError(f"load {name!r}: its only node has no rotations for a moment; name more nodes")
        present = dofs[0] >= 0
        F[dofs[0, present]] = wrench[present]
        return F
    arm = mesh.points[nodes] - interface_position(mesh, name, load, nodes)
    turning = np.repeat([False, bool(np.any(load.moment) or load.position or load.cylinder)], 3)
    over = cells_of(mesh, load, nodes)[0]
    ones = np.ones(len(nodes))
    mean = MeanPoints.over(mesh.points, nodes, over) if over else None
    frame = np.zeros(6, dtype=int)
    spread = PlacedLink("rbe3", f"load {name!r}", frame, dofs, arm, turning, ones, False, mean_points=mean)
    G, nodal = spread.average()
    F[nodal] = G.T @ wrench
    return F


def _pressure(model: FEModel, mesh: Mesh, name: str, load: Load) -> np.ndarray:
    F = np.zeros(model.n_dof)
    if not load.pressure:
        return F
    group = mesh.group(load.group) if load.group else {}
    faces = {kind: nodes for kind, nodes in group.items() if cell_dimension(kind) == 2}
    if not faces:
        raise InputError(f"load {name!r}: a pressure needs a mesh group of triangles or quads; {load} has none")
    for kind, nodes in faces.items():
        np.add.at(F, model.dof[nodes][..., :3], load.pressure * _face_areas(kind, mesh.points[nodes]))
    return F


def _face_areas(kind: str, points: np.ndarray) -> np.ndarray:
    """Integrate ``N_k n dA`` (faces, nodes, 3) of faces with corners and mid-sides at `points` (faces, nodes, 3)."""
    cell = cell_of(kind)
    if cell is None or cell.count != points.shape[1] or not cell.powers:
        raise InputError(f"a pressure on faces of {points.shape[1]} nodes ({kind}) is not known; take 3, 4, 6, 8 or 9")
    place, weight = _gauss(cell.shape == "triangle")
    own = _monomials(cell.powers, cell.node_coordinates(), (0, 0))
    N, a, b = (_monomials(cell.powers, place, d) @ np.linalg.inv(own) for d in ((0, 0), (1, 0), (0, 1)))
    normal = np.cross(np.einsum("gk,fkx->fgx", a, points), np.einsum("gk,fkx->fgx", b, points))
    return np.einsum("g,gk,fgx->fkx", weight, N, normal)


def _monomials(exponents: Powers, place: np.ndarray, derivative: tuple[int, int]) -> np.ndarray:
    columns = [
        np.prod(
            [
                p * x ** (p - 1) if d and p else 0 * x if d else x**p
                for x, p, d in zip(place.T, powers, derivative, strict=True)
            ],
            axis=0,
        )
        for powers in exponents
    ]
    return np.stack(columns, axis=1)


def _gauss(triangle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points (g, 2) and weights on the unit square; on the triangle by folding the square (Duffy)."""
    x, w = np.polynomial.legendre.leggauss(4)
    x = (x + 1) / 2
    w = w / 2
    u, v = (grid.ravel() for grid in np.meshgrid(x, x))
    weight = np.outer(w, w).ravel()
    if triangle:
        return np.stack([u, v * (1 - u)], axis=1), weight * (1 - u)
    return np.stack([u, v], axis=1), weight
