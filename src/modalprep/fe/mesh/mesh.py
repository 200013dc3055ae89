"""Meshes: points, cells, named groups, and the element data of a deck."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from modalprep.drawing import Viewed
from modalprep.errors import InputError
from modalprep.fe.mesh.analysis import AnalysisCase, LoadSet
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.properties.properties import Property
from modalprep.records import Record
from modalprep.suggest import suggestion
from modalprep.verdicts.notes import with_warnings

if TYPE_CHECKING:
    from scipy.sparse import csr_array

FAR = 1e30  # m, beyond the universe: powers of it are still numbers


@dataclass(frozen=True, eq=False, kw_only=True)
class Link(Record):
    """A rigid or an averaging element between mesh nodes.

    Attributes
    ----------
    kind : {"rbe2", "rbe3"}
        rbe2: `nodes` follow `node` rigidly. rbe3: `node` moves with the weighted mean motion of `nodes`.
    node : int
    nodes : (k,) int
    components : (6,) or (k, 6) bool
        rbe2: which DOFs of `nodes` follow, of all or of each. rbe3: which DOFs (6,) of `node` follow.
    weights : (k,) float
        rbe3 only; equal ones by default.
    over : {cell type: (c, n) int}
        rbe3: cells over which the mean is an integral, in place of weights; they have all of `nodes`.
    axes : (k, 3, 3) or (0, 3, 3)
        Rows e1, e2, e3 of the components at each node that follows (of an rbe3 one, at `node`); empty: mesh axes.
    """

    kind: str
    node: int
    nodes: np.ndarray
    components: np.ndarray = field(default_factory=lambda: np.ones(6, dtype=bool))
    weights: np.ndarray = field(default_factory=lambda: np.zeros(0))
    over: dict[str, np.ndarray] = field(default_factory=dict)
    axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))

    def __post_init__(self) -> None:
        """Let the nodes of an rbe3 without weights have equal ones."""
        if self.kind == "rbe3" and not len(self.weights):
            object.__setattr__(self, "weights", np.ones(len(self.nodes)))
        super().__post_init__()

    def renumbered(self, place: np.ndarray) -> Link:
        """Return the same link where node i is ``place[i]``."""
        over = {kind: place[conn] for kind, conn in self.over.items()}
        return self.with_(node=int(place[self.node]), nodes=place[self.nodes], over=over)


@dataclass(frozen=True, eq=False, kw_only=True)
class Equation(Record):
    """A linear equation ``sum_k coefficients[k] . u(nodes[k]) = 0`` between the DOFs of mesh nodes.

    Attributes
    ----------
    nodes : (k,) int
        The first holds the dependent DOF, unless something else drives it; a node may occur several times.
    coefficients : (k, 6) float
        On ux, uy, uz (mesh axes, m) and rx, ry, rz (rad) of each node.
    name : str
        For messages: where the file has it.

    References
    ----------
    Theory 1.4.

    Examples
    --------
    >>> equation = Equation.of_terms([(4, 0, 2.0), (7, 4, -1.0)], length=1e-3, name="line 8")  # in mm: 2 u_x = r_y
    >>> equation.nodes, equation.coefficients[1]
    (array([4, 7]), array([ 0.   ,  0.   ,  0.   ,  0.   , -0.001,  0.   ]))
    """

    nodes: np.ndarray
    coefficients: np.ndarray
    name: str

    @classmethod
    def of_terms(
        cls,
        terms: Iterable[tuple[int, int, float]],
        *,
        length: float,
        name: str,
        axes: Mapping[int, np.ndarray] | None = None,
    ) -> Equation:
        """Return the equation of terms (node, component 0 to 5, coefficient) with `length` metres per unit of a file.

        ``axes[node] (3, 3)`` are the rows e1, e2, e3 of the components at a node; the others have mesh axes.
        """
        terms = list(terms)
        axes = axes or {}
        coefficients = np.zeros((len(terms), 6))
        for row, (node, component, factor) in zip(coefficients, terms, strict=True):
            triple = component // 3
            unit = length if triple else 1.0
            row[3 * triple : 3 * triple + 3] = factor * unit * axes.get(node, np.eye(3))[component % 3]
        return cls(nodes=np.array([node for node, _, _ in terms], dtype=int), coefficients=coefficients, name=name)


def refuse_far_points(points: np.ndarray, labels: np.ndarray, what: str) -> None:
    """Refuse coordinates (n, 3) that are no numbers, or so large that their powers are none; `what` begins the message.

    Nodes without labels count from 1.

    Raises
    ------
    InputError
        Which names the first node by its label.

    Examples
    --------
    >>> refuse_far_points(np.array([[0, 0, 1e308]]), np.array([7]), "mesh")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: mesh: 1 of 1 nodes have coordinates that are not numbers below 1e+30 m, ...
    """
    bad = np.flatnonzero(~(np.abs(points) < FAR).all(axis=1))
    if len(bad):
        raise InputError(
            f"{what}: {len(bad)} of {len(points)} nodes have coordinates that are not numbers below {FAR:g} m, "
            f"the first is node {labels[bad[0]] if len(labels) else bad[0] + 1}; repair the mesh"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class SupportSet(Record):
    """Nodes that a file holds, by component; a model has them only where a `Support` names the set.

    Attributes
    ----------
    nodes : (k,) int
    components : (k, 6) bool
    axes : (k, 3, 3) or (0, 3, 3)
        Rows e1, e2, e3 of the components at each node; empty: mesh axes.
    """

    nodes: np.ndarray
    components: np.ndarray
    axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))


@dataclass(frozen=True, eq=False, kw_only=True)
class MatrixElement(Record):
    """Stiffness and mass between DOFs of mesh nodes that a file gives as numbers, such as a superelement.

    Attributes
    ----------
    rows : (n, 2) int
        Node and component (0 to 5: ux, uy, uz, rx, ry, rz along the mesh axes) of each row of the matrices.
    K, M : (n, n) csr
        Symmetric; SI.
    name : str
        For messages and tables: where the file has it.

    References
    ----------
    Theory 1.9.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> k = csr_array(np.array([[5.0, -5.0], [-5.0, 5.0]]))  # N/m
    >>> spring = MatrixElement(rows=np.array([[0, 0], [3, 0]]), K=k, M=0 * k, name="line 8")
    >>> spring.nodes, spring.renumbered(np.array([4, 5, 6, 7])).nodes
    (array([0, 3]), array([4, 7]))
    """

    rows: np.ndarray
    K: csr_array
    M: csr_array
    name: str

    @property
    def nodes(self) -> np.ndarray:
        """The sorted nodes (k,) that the matrices join."""
        return np.unique(self.rows[:, 0])

    def renumbered(self, place: np.ndarray) -> MatrixElement:
        """Return the same matrices where node i is ``place[i]``."""
        return self.with_(rows=np.stack([place[self.rows[:, 0]], self.rows[:, 1]], axis=1))


@dataclass(frozen=True, eq=False, kw_only=True)
class Mesh(Record, Viewed):
    """A mesh with named groups.

    Attributes
    ----------
    points : (n_points, 3) float
        m.
    cells : {cell type: (n_cells, n_nodes) int}
        meshio's cell types and node order.
    groups : {name: {cell type: (k,) int}}
        Rows of ``cells`` that belong to each named group.
    source, sha256 : str
        The file it came from and the hash of its bytes; empty for a mesh made in memory.
    scale : float
        m per unit of length of the file.
    labels : (n_points,) int
        The file's own node numbers; empty counts from 1.
    properties : {group: Property}
        Sections that the file carries, SI.
    links : tuple of Link
        Rigid and averaging elements that the file carries.
    equations : tuple of Equation
        Multi-point constraints that the file carries.
    matrices : tuple of MatrixElement
        Stiffness and mass that the file carries as numbers.
    supports : {name: SupportSet}
        What the file holds, by the names of its sets.
    loads : {name: LoadSet}
        Static loads of the file, by the names of its sets.
    cases : tuple of AnalysisCase
        What the file says of its analyses.
    data : {name: {cell type: (n_cells, ...) float}}
        Per element, NaN where the section's own value holds: ``up (3)`` of a beam, ``ends (2, 3)`` offsets of a
        beam's ends (mesh axes, m), ``pins (12)``, 1 where a DOF of a beam's ends in its axes is released, ``axis (3)``,
        ``angle`` (rad), ``offset`` (m) and ``thickness`` (m, one value or one for each corner or node) of a shell,
        ``frame (3, 3)`` rows e1, e2, e3 of a spring or of a solid's material, ``integration`` of a solid: 1 where a
        deck says reduced integration of the stiffness, 2 where of stiffness and mass.
    coupled_mass : bool
        Whether a Nastran deck asks for coupled masses (``PARAM,COUPMASS``), which ``mass = "nastran"`` follows.
    cyclic : CyclicSymmetry or None
        That of a deck, of which the mesh is one sector.
    notes : tuple of str
        Messages for the user about content that the reader left out.

    Examples
    --------
    >>> mesh = Mesh(points=np.eye(3), cells={"line": np.array([[0, 1], [1, 2]])},
    ...             groups={"beam": {"line": np.array([0, 1])}})
    >>> mesh.nodes("beam")
    array([0, 1, 2])
    """

    points: np.ndarray
    cells: dict[str, np.ndarray]
    groups: dict[str, dict[str, np.ndarray]]
    source: str = ""
    sha256: str = ""
    scale: float = 1.0
    labels: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    properties: dict[str, Property] = field(default_factory=dict)
    links: tuple[Link, ...] = ()
    equations: tuple[Equation, ...] = ()
    matrices: tuple[MatrixElement, ...] = ()
    supports: dict[str, SupportSet] = field(default_factory=dict)
    loads: dict[str, LoadSet] = field(default_factory=dict)
    cases: tuple[AnalysisCase, ...] = ()
    data: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    coupled_mass: bool = False
    cyclic: CyclicSymmetry | None = None
    notes: tuple[str, ...] = ()

    def group(self, name: str) -> dict[str, np.ndarray]:
        """Return the connectivity of a group, ``{cell type: (k, n_nodes)}``.

        Raises
        ------
        InputError
            When the mesh has no such group; the message lists those it has.
        """
        if name not in self.groups:
            raise InputError(
                f"mesh {self.source or 'in memory'} has no group {name!r}; {suggestion(name, self.groups, 'it has')}"
            )
        return {kind: self.cells[kind][rows] for kind, rows in self.groups[name].items() if len(rows)}

    def nodes(self, name: str) -> np.ndarray:
        """Return the sorted node numbers ``(k,)`` of a group.

        Raises
        ------
        InputError
            When the mesh has no such group.
        """
        return np.unique(np.concatenate([c.ravel() for c in self.group(name).values()]))

    def __repr__(self) -> str:
        """Counts and group names, and the warnings."""
        counts = ", ".join(f"{len(c)} {kind}" for kind, c in self.cells.items())
        text = f"Mesh({len(self.points)} points, {counts}; groups {', '.join(self.groups)})"
        return with_warnings(text, self.notes)
