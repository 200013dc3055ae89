"""Models from scikit-fem and to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from skfem.assembly import CellBasis

from modalprep.errors import InputError
from modalprep.fe.assembly.bases import group_bases
from modalprep.fe.assembly.matrix_checks import Places, real_square, symmetric
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.external.model import StressStiffness, model_from_matrices
from modalprep.fe.external.skfem_nodes import Nodes, boundary_dofs, nodes_of
from modalprep.fe.links.interface import Interface
from modalprep.fe.mesh.mesh import Mesh, SupportSet
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.terms.added import with_foundation
from modalprep.records import Record
from modalprep.suggest import refuse_other

HELD = "boundary conditions"
FOUNDATION = "foundation"


def model_from_skfem(
    basis: CellBasis | Sequence[CellBasis],
    K: Any,
    M: Any,
    interfaces: Mapping[str, Interface] | None = None,
    *,
    foundation: Any = None,
    held: Any = None,
    root: str | None = None,
    geometric_stiffness: StressStiffness | None = None,
) -> FEModel:
    """Return the model of matrices that a program with scikit-fem has assembled.

    Parameters
    ----------
    basis : skfem.Basis or a list of them
        Of the displacement: ``ElementVector`` of three components, of any order, on a mesh in space; or bases of
        `to_skfem`. Named boundaries of the mesh are groups, by which interfaces name their nodes.
    K, M : (n, n) sparse
        Stiffness (N/m) and mass (kg) of the free structure, as ``skfem.asm`` returns them.
    interfaces : {name: Interface}
        Default one root, the frame of what is held.
    foundation : (n, n) sparse
        Stiffness to the ground, N/m, which is not in K: its other end moves with the frame of the root.
    held : int array, or what ``basis.get_dofs`` returns
        DOFs of boundary conditions: they move with the frame of the root interface. Do not condense K and M.
    root : str
        The interface at which the body frame sits; default the first.
    geometric_stiffness : callable
        ``d (n,) -> (n, n)``, as in `model_from_matrices`.

    Returns
    -------
    FEModel
        In a frame at the root interface with the axes of the mesh. With displacements alone all integrals of the mass
        are exact; with rotations some are approximate, as in `model_from_matrices`.

    Raises
    ------
    InputError
        When DOFs are not displacements along x, y, z, matrices are not those of a free structure, or they have entries
        at DOFs that no basis has.

    References
    ----------
    Theory 8.

    Examples
    --------
    >>> import skfem
    >>> from skfem.helpers import ddot, dot, sym_grad
    >>> from skfem.models.elasticity import lame_parameters, linear_elasticity
    >>> mesh = skfem.MeshHex().refined(1).with_boundaries({"wall": lambda x: x[0] == 0})
    >>> basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()))
    >>> K = skfem.asm(linear_elasticity(*lame_parameters(2e11, 0.3)), basis)
    >>> M = skfem.asm(skfem.BilinearForm(lambda u, v, w: 8000 * dot(u, v)), basis)
    >>> model_from_skfem(basis, K, M, {"wall": Interface(group="wall")}).rigid.m.__round__(6)
    8000.0
    """
    bases = [basis] if isinstance(basis, CellBasis) else list(basis)
    for one in bases:
        refuse_other("model_from_skfem: the basis", CellBasis, one)
    nodes = nodes_of(bases)
    K, M = (_of_nodes(real_square(A, name), name, nodes) for A, name in ((K, "stiffness"), (M, "mass")))
    number = np.full(int(nodes.dof.max()) + 1, -1)
    own = np.sort(nodes.dof[nodes.dof >= 0])
    number[own] = np.arange(len(own))
    dof = np.where(nodes.dof >= 0, number[nodes.dof], -1)
    supports = {} if held is None else {HELD: _held(held, nodes)}
    if interfaces is None:
        if held is None:
            raise InputError("model_from_skfem: there is no interface; name one, or give 'held' boundary conditions")
        interfaces = {"root": Interface(kind="support")}
    mesh = _mesh(nodes, {name: nodes.of(dofs) for one in bases for name, dofs in boundary_dofs(one).items()})
    model = model_from_matrices(
        K, M, mesh, dof, interfaces=interfaces, root=root, geometric_stiffness=geometric_stiffness, held=supports
    )
    if foundation is None:
        return model
    A = symmetric(
        _of_nodes(real_square(foundation, FOUNDATION), FOUNDATION, nodes), FOUNDATION, Places(dof, mesh.labels)
    )
    A.resize(model.K.shape)
    return with_foundation(model, FOUNDATION, A)


def _of_nodes(A: csr_array, name: str, nodes: Nodes) -> csr_array:
    """Return the rows and columns of the nodes' DOFs; others must be empty, as the frames of interfaces are."""
    own = np.sort(nodes.dof[nodes.dof >= 0])
    if len(own) and own[-1] >= A.shape[0]:
        raise InputError(
            f"the {name} has {A.shape[0]} rows, the basis at least {own[-1] + 1} DOFs; take one basis for both"
        )
    other = np.setdiff1d(np.arange(A.shape[0]), own)
    if len(other) and abs(A[other]).max() > 0:
        raise InputError(f"the {name} has entries at {len(other)} DOFs that no basis has; give all bases")
    return A[own][:, own].tocsr()


def _held(held: Any, nodes: Nodes) -> SupportSet:
    dofs = np.asarray(held.flatten() if hasattr(held, "flatten") else held, dtype=int).ravel()
    at = nodes.of(dofs)
    if not len(at):
        raise InputError(
            "model_from_skfem: none of the DOFs that are held belongs to the basis; take basis.get_dofs(...)"
        )
    return SupportSet(nodes=at, components=np.isin(nodes.dof[at], dofs), axes=np.tile(np.eye(3), (len(at), 1, 1)))


def _mesh(nodes: Nodes, groups: dict[str, np.ndarray]) -> Mesh:
    """Return the nodes with their cells, and groups of nodes as vertices."""
    cells = dict(nodes.cells)
    rows = {}
    if groups:
        cells["vertex"] = np.concatenate(list(groups.values()))[:, None]
        ends = np.cumsum([0, *map(len, groups.values())])
        rows = {name: {"vertex": np.arange(a, b)} for name, a, b in zip(groups, ends[:-1], ends[1:], strict=True)}
    return Mesh(points=nodes.points, cells=cells, groups=rows)


@dataclass(frozen=True, eq=False, kw_only=True)
class SkfemModel(Record):
    """A model as scikit-fem sees it.

    Attributes
    ----------
    bases : {group: list of skfem.CellBasis}
        As `group_bases`: their DOFs are the rows of the matrices.
    K, M : (n_dof, n_dof) csr
        N/m and kg.
    C : (n_dof, n_free) csr
        All DOFs from the independent ones: rigid links, supports and frames of interfaces.
    dof : (n_nodes, 6) int
        DOFs of the nodes, -1 where a node has none; mesh nodes, then frames.
    points : (n_points, 3)
        Nodes of the mesh in the frame of the model, m.
    """

    bases: dict[str, list[CellBasis]]
    K: csr_array
    M: csr_array
    C: csr_array
    dof: np.ndarray
    points: np.ndarray


def to_skfem(model: FEModel) -> SkfemModel:
    """Return the meshes, bases and matrices of a model for a program with scikit-fem.

    ``bases["skin"][0].mesh`` is the mesh of the corners of the cells of a group, ``element_dofs`` the map from their
    functions to the rows of K and M. Springs and point masses have no basis; the matrices have them.

    Parameters
    ----------
    model : FEModel

    Returns
    -------
    SkfemModel
        In the frame of the model, SI units.

    Raises
    ------
    InputError
        When the model has no elements, as one from matrices.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> beam = to_skfem(cantilever_model(elements=4))
    >>> beam.bases["beam"][0].mesh.nelements, beam.K.shape
    (4, (30, 30))
    """
    refuse_other("to_skfem: the model", FEModel, model)
    if model.elements is None:
        raise InputError("a model from matrices has no elements, and so no bases; hand over its K, M and dof")
    inside = [part for part in model.elements.parts if not isinstance(part.section, (PointMass, Spring))]
    bases = {group: group_bases(model, group) for group in dict.fromkeys(part.group for part in inside)}
    return SkfemModel(bases=bases, K=model.K, M=model.M, C=model.C, dof=model.dof, points=model.points)
