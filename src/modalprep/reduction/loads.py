"""User loads: forces and moments on node sets, loads per area and per length of groups, as nodal loads of a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_array

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.links.interface import interface_position
from modalprep.fe.links.mean_points import MeanPoints, cells_of
from modalprep.fe.links.multipoint import PlacedLink
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.fe.terms.bases import term_bases
from modalprep.fe.terms.forms import follower, pressure, traction
from modalprep.fe.terms.term import Term
from modalprep.suggest import refuse_other, suggestion

Vector = tuple[float, float, float]
NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, repr=False)
class Load(NodeSet):
    """A force or a moment on a node set (fe.select), or a load per area or length of a group, mesh axes.

    Loads per area and length are integrated with the displacement of the elements: a uniform line load on a beam has
    the end moments of a clamped one, so that its nodes move as those of the exact solution.

    Attributes
    ----------
    force, moment : (3,)
        Total, N and N m. On several nodes they are distributed as by an rbe3 (theory 1.4): a force at the centroid
        evenly over faces, edges or nodes, a moment by forces about it.
    pressure : float
        Pa, on the faces of a group: along their right-hand normal, in the order of their nodes.
    traction : (3,)
        N/m^2, on the faces of a group.
    line_load : (3,)
        N/m, on the lines of a group.
    position : (3,) or None
        Point of application, m, mesh coordinates; None: the centroid, of a cylinder the middle of its axis.
    set : str
        A static load that the file of the mesh brings (``Mesh.loads``), instead of nodes and forces.

    Examples
    --------
    >>> Load(near=(10.0, 0, 0), force=(0, 0, 5.0))
    near (10, 0, 0)
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("position",), needs=("force",), advice="other loads have no such place"),
        Rule(("force", "moment", "pressure", "traction", "line_load"), beside=("set",)),
    )
    force: Vector = NONE
    moment: Vector = NONE
    pressure: float = 0.0
    traction: Vector = NONE
    line_load: Vector = NONE
    position: Vector | None = None
    set: str | None = None
    kind = "rbe3"

    def __post_init__(self) -> None:
        """Refuse a place that nothing uses."""
        if self.set is None:
            super().__post_init__()
        elif self._given():
            raise InputError(f"load by set {self.set!r} has its own nodes; leave {self._given()[0]!r} out")
        refuse_idle(self, "load: ")

    def __repr__(self) -> str:
        """The set or the nodes."""
        return f"set {self.set!r}" if self.set is not None else super().__repr__()


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
        When the load is zero, its node set is empty or cannot carry it, or its group has no such cells.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh, cantilever_model
    >>> F = nodal_load(cantilever_model(), beam_mesh(10), "tip", Load(group="tip", force=(0, 3.0, 0)))
    >>> F.shape, float(F[-5])
    ((66,), 3.0)
    """
    refuse_other("nodal_load: the model", FEModel, model)
    refuse_other("nodal_load: the mesh", Mesh, mesh)
    if load.set is not None:
        return _of_file(model, mesh, name, load.set)
    used = np.flatnonzero(model.dof[: len(mesh.points), 0] >= 0)
    nodes = np.intersect1d(load.nodes(mesh, used), used)
    if not len(nodes):
        raise InputError(f"load {name!r}: no node of {load} belongs to an element with a property")
    F = _resultant(model, mesh, name, load, nodes) + _distributed(model, mesh, name, load)
    if not np.any(F):
        raise InputError(f"load {name!r} is zero; give force, moment, pressure, traction or line_load")
    return F


def _of_file(model: FEModel, mesh: Mesh, name: str, set_: str) -> np.ndarray:
    """Return a load of the mesh file; what acts on DOFs that no element has is nothing, as moments on solids."""
    if set_ not in mesh.loads:
        known = suggestion(set_, mesh.loads, "it has")
        raise InputError(f"load {name!r}: mesh {mesh.source or 'in memory'} has no load {set_!r}; {known}")
    given = mesh.loads[set_]
    F = np.zeros(model.n_dof)
    dofs = model.dof[given.nodes]
    there = dofs >= 0
    np.add.at(F, dofs[there], np.hstack([given.forces, given.moments])[there])
    if not np.any(F):
        raise InputError(f"load {name!r}: {set_!r} acts on no node of an element with a property")
    return F


def _resultant(model: FEModel, mesh: Mesh, name: str, load: Load, nodes: np.ndarray) -> np.ndarray:
    F = np.zeros(model.n_dof)
    dofs = model.dof[nodes]
    wrench = np.concatenate([load.force, load.moment])
    if not np.any(wrench):
        return F
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


def _distributed(model: FEModel, mesh: Mesh, name: str, load: Load) -> np.ndarray:
    """Integrate what is given per area and per length."""
    F = np.zeros(model.n_dof)
    for key, term in _terms(name, load).items():
        F += sum(term.form.assemble(basis) for basis in _bases(model, mesh, f"load {name!r}: {key}", term))
    return F


def _terms(name: str, load: Load) -> dict[str, Term]:
    """Return the forms of what is given per area and per length, by its key."""
    faces, lines = bool(load.pressure) or any(load.traction), any(load.line_load)
    if (faces or lines) and load.group is None:
        cells = "triangles or quads" if faces else "lines"
        raise InputError(f"load {name!r}: pressure, traction and line_load need a mesh group of {cells}; name a group")
    group = str(load.group)
    terms = {}
    if load.pressure:
        terms["pressure"] = Term(form=pressure(load.pressure), group=group, to="load", on="faces")
    if any(load.traction):
        terms["traction"] = Term(form=traction(np.array(load.traction)), group=group, to="load", on="faces")
    if lines:
        terms["line_load"] = Term(form=traction(np.array(load.line_load)), group=group, to="load", on="lines")
    return terms


def _bases(model: FEModel, mesh: Mesh, what: str, term: Term) -> list:
    try:
        return term_bases(model, mesh, term)
    except InputError as error:
        raise InputError(f"{what}: {error}") from None


def follower_stiffness(model: FEModel, mesh: Mesh, name: str, load: Load) -> csr_array:
    """Return the load stiffness ``(n_dof, n_dof)`` of a pressure that stays normal to its faces.

    For `buckling` and `prestressed_modes`, to whose geometric stiffness it adds. It is symmetric where the edges of the
    pressurised faces are held or move along the edge's own normal plane, as of closed vessels; its unsymmetric rest,
    which is work at free edges and has no potential, is left out.

    Parameters
    ----------
    model : FEModel
    mesh : Mesh
        From which the model was assembled.
    name : str
        For messages.
    load : Load
        With a pressure; a force, a moment, a traction and a line load keep their directions.

    Returns
    -------
    (n_dof, n_dof) csr
        N/m, mesh axes.

    Raises
    ------
    InputError
        When the load has no pressure, or its group no faces.

    References
    ----------
    Theory 1.9. K. Schweizerhof, E. Ramm, Displacement dependent pressure loads in nonlinear finite element analyses,
    Computers & Structures 18 (1984) 1099.

    Examples
    --------
    >>> import modalprep as mp
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> cells, groups = {"quad": np.array([[0, 1, 2, 3]])}, {"a": {"quad": np.array([0])}}
    >>> mesh = mp.fe.Mesh(points=square, cells=cells, groups=groups)
    >>> section = mp.Shell(material=mp.Material(E=7e10, nu=0.3, rho=2700.0), thickness=1e-3)
    >>> model = mp.assemble(mesh, {"a": section}, {"root": mp.Interface(node=1, kind="node")})
    >>> follower_stiffness(model, mesh, "gas", Load(group="a", pressure=1e3)).shape
    (24, 24)
    """
    if not load.pressure:
        raise InputError(f"load {name!r} has no pressure; other loads keep their directions")
    term = Term(form=follower(load.pressure), group=str(load.group), to="stiffness", on="faces")
    A = csr_array(sum(term.form.assemble(basis) for basis in _bases(model, mesh, name, term)))
    return ((A + A.T) / 2).tocsr()
