"""Reactions and forces on nodes, forces through a cut, and accelerations of nodes (theory 4.9)."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.fe.recovery.fields import AXES, Fields, Piece, Quantity, elements_of
from modalprep.vectors import skew

FORCE = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
FORCE_UNITS = ("N",) * 3 + ("N m",) * 3


def interface_reactions(model: FEModel) -> Quantity:
    """Return force and moment of the neighbours on each fixed interface, at its frame, in the axes of the mesh."""
    frames = [frame for frame in model.interfaces if frame.boundary == "fixed"]
    rows = np.searchsorted(model.free, [frame.dofs for frame in frames])

    def values(fields: Fields) -> np.ndarray:
        return (model.C.T @ residual(model, fields))[rows]

    return Quantity(
        kind="reaction",
        places=tuple(frame.name for frame in frames),
        components=FORCE,
        units=FORCE_UNITS,
        values=values,
        position=np.array([frame.position for frame in frames]),
    )


def node_forces(model: FEModel, mesh: Mesh, where: NodeSet) -> Quantity:
    """Return the force and moment, about their centroid, that supports, links, joints and loads exert on nodes."""
    nodes = chosen_nodes(model, mesh, where)
    centre = model.points[nodes].mean(axis=0)
    return Quantity(
        kind="reaction",
        places=("nodes",),
        components=FORCE,
        units=FORCE_UNITS,
        values=lambda fields: resultant(model, nodes, residual(model, fields), centre)[None],
        position=centre[None],
    )


def cut_forces(model: FEModel, pieces: list[Piece]) -> Quantity:
    """Return force and moment of the rest of the model on some elements, about the centroid of the shared nodes.

    Raises
    ------
    InputError
        When the elements share no node with others.
    """
    nodes = _shared(model, pieces)
    centre = model.points[nodes].mean(axis=0)

    def values(fields: Fields) -> np.ndarray:
        total = np.zeros_like(fields.u)
        for piece in pieces:
            np.add.at(total, piece.dofs, piece.forces(fields))
        return resultant(model, nodes, total, centre)[None]

    return Quantity("cut", ("cut",), FORCE, FORCE_UNITS, values, centre[None])


def accelerations(model: FEModel, mesh: Mesh, where: NodeSet) -> Quantity:
    """Return what accelerometers at nodes measure: acceleration less gravity, m/s^2, in the axes of the mesh."""
    nodes = chosen_nodes(model, mesh, where)
    dofs = model.dof[nodes, :3]

    def values(fields: Fields) -> np.ndarray:
        return fields.a[dofs] + fields.acceleration(model.points[nodes])

    names = tuple(str(label) for label in (mesh.labels[nodes] if len(mesh.labels) else nodes + 1))
    return Quantity("acceleration", names, AXES, ("m/s^2",) * 3, values, model.points[nodes], nodes)


def displacements(model: FEModel, mesh: Mesh, where: NodeSet) -> Quantity:
    """Return the displacements of nodes relative to the frame of the body, m, in the axes of the mesh."""
    nodes = chosen_nodes(model, mesh, where)
    dofs = model.dof[nodes, :3]
    names = tuple(str(label) for label in (mesh.labels[nodes] if len(mesh.labels) else nodes + 1))
    return Quantity("displacement", names, AXES, ("m",) * 3, lambda fields: fields.u[dofs], model.points[nodes], nodes)


def residual(model: FEModel, fields: Fields) -> np.ndarray:
    """Return the forces ``(n_dof, k)`` on the DOFs that the motion needs: ``K u + M a + g A + h W``."""
    return model.K @ fields.u + model.M @ fields.a - model.inertia_loads @ fields.drives


def resultant(model: FEModel, nodes: np.ndarray, forces: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the force and the moment about a point ``(6, k)`` of nodal forces ``(n_dof, k)`` on nodes."""
    total = np.zeros((6, forces.shape[1]))
    for node in nodes:
        dofs = model.dof[node]
        own = np.where(dofs[:, None] >= 0, forces[dofs], 0.0)
        total += own
        total[3:] += skew(model.points[node] - centre) @ own[:3]
    return total


def chosen_nodes(model: FEModel, mesh: Mesh, where: NodeSet) -> np.ndarray:
    """Return the nodes of a set that have DOFs.

    Raises
    ------
    InputError
        When there is none.
    """
    used = np.flatnonzero(model.dof[: len(model.points), 0] >= 0)
    found = np.intersect1d(where.nodes(mesh, used), used)
    if not len(found):
        raise InputError(f"no node of an element lies at {where}")
    return found


def _shared(model: FEModel, pieces: list[Piece]) -> np.ndarray:
    count = np.zeros((2, len(model.points)), dtype=int)
    for nodes in (piece.block.nodes for piece in pieces):
        np.add.at(count[0], nodes, 1)
    for nodes in (block.nodes for block in elements_of(model).blocks):
        np.add.at(count[1], nodes, 1)
    found = np.flatnonzero((count[0] > 0) & (count[1] > count[0]))
    if not len(found):
        raise InputError("the elements share no node with others, so that there is no cut; name one side of it")
    return found
