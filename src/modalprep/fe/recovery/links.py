"""Forces of multipoint constraints: what links, ties and supports exert on their nodes (theory 4.9)."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.geometric_stiffness import GeometricStiffness
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.fe.recovery.fields import Fields, Quantity
from modalprep.fe.recovery.nodes import FORCE, FORCE_UNITS, chosen_nodes, residual
from modalprep.fe.terms.added import WithGeometricTerms


def link_forces(model: FEModel, mesh: Mesh, where: NodeSet | None) -> Quantity:
    """Return the force and moment of all links, equations and supports on each of their nodes, about that node.

    Nodes are named by their numbers, the frames of interfaces by their names; these only where no nodes are given.

    Raises
    ------
    InputError
        When no link holds one of the nodes.
    """
    prestress = model.geometric_stiffness
    while isinstance(prestress, WithGeometricTerms):
        prestress = prestress.inner
    if not isinstance(prestress, GeometricStiffness):
        raise InputError("a model from matrices knows no links of its nodes; recover the reaction of its interfaces")
    step = prestress.links.constraints.step
    dependent = np.diff(step.indptr) > 0
    linked = dependent.copy()
    linked[step.indices] = True
    names, dofs, position, node = _places(model, mesh, where, linked)

    def values(fields: Fields) -> np.ndarray:
        force = _on_dofs(step, dependent, residual(model, fields))
        return np.where(dofs[..., None] >= 0, force[dofs], 0.0)

    return Quantity("mpc_force", names, FORCE, FORCE_UNITS, values, position, node)


def _on_dofs(step: csr_array, dependent: np.ndarray, needed: np.ndarray) -> np.ndarray:
    """Return the forces ``(n_dof, k)`` of the links: what dependent DOFs need, and its opposite on their sources.

    Loads act on independent DOFs alone, so that the links exert all that a dependent DOF needs beyond its elements.

    Examples
    --------
    >>> lever = csr_array(np.array([[0.0, 0.0], [2.0, 0.0]]))  # u1 = 2 u0
    >>> _on_dofs(lever, np.array([False, True]), np.array([[0.0], [5.0]])).ravel()
    array([-10.,   5.])
    """
    multiplier = needed
    of_sources = needed
    while np.any(of_sources):
        of_sources = step.T @ of_sources
        multiplier = multiplier + of_sources
    multiplier = np.where(dependent[:, None], multiplier, 0.0)
    return multiplier - step.T @ multiplier


def _places(
    model: FEModel, mesh: Mesh, where: NodeSet | None, linked: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray, np.ndarray | None]:
    """Return names, DOFs (p, 6) and positions of the places, and their nodes where all are nodes of the mesh."""
    own = model.dof[: len(model.points)]
    held = np.any((own >= 0) & linked[own], axis=1)
    nodes = np.flatnonzero(held)
    if where is not None:
        nodes = chosen_nodes(model, mesh, where)
        nodes = nodes[held[nodes]]
    at_nodes = set(own[:, 0].tolist())
    frames = [f for f in model.interfaces if where is None and f.dofs[0] not in at_nodes and np.any(linked[f.dofs])]
    if not len(nodes) and not frames:
        raise InputError(f"no link, equation or support holds {'a node of the model' if where is None else where}")
    names = [str(label) for label in (mesh.labels[nodes] if len(mesh.labels) else nodes + 1)]
    return (
        (*names, *(frame.name for frame in frames)),
        np.concatenate([own[nodes], np.reshape([f.dofs for f in frames], (-1, 6)).astype(int)]),
        np.concatenate([model.points[nodes], np.reshape([f.position for f in frames], (-1, 3))]),
        None if frames else nodes,
    )
