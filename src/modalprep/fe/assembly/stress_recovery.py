"""Stress at chosen nodes: the mean of the stresses of the elements that share a node (theory 7.6)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.laminate import strain_rotation
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.fe.properties.properties import Beam, Property, Shell

Vector = tuple[float, float, float]
StressBlock = BeamBlock | ThreeNodeBeamBlock | TrussBlock | ShellBlock | CurvedShellBlock | SolidBlock
MOST = 1000  # points of a body: each is a history of every run
ALIKE = 0.85  # cosine between elements whose stress is averaged: 32 degrees
ACROSS = 0.99  # a direction whose cosine with a shell's normal is larger has no projection to speak of


@dataclass(frozen=True, kw_only=True, repr=False)
class StressPoint(NodeSet):
    """Where stress is recovered: at every node of a set, as the mean over the elements that share the node.

    Attributes
    ----------
    element_group : str or None
        Mesh group of these elements; needed where others of another property meet at the node.
    direction : (3,) or None
        Only elements whose axis (beams, trusses) or normal (shells) points there, to 32 degrees; mesh axes.
    axis : (3,) or None
        Shells: its projection is x of the components, z their normal; None takes x of the mesh, or y where the shell
        is normal to x.
    fibres : tuple of tuples of 2 or 3 floats
        Beams: points of the section as in `Beam.fibres`, which they replace.

    Raises
    ------
    InputError
        When none or several node sets are given.

    References
    ----------
    Theory 7.6.

    Examples
    --------
    >>> StressPoint(group="root", element_group="beam", fibres=((0.0, 0.05), (0.0, -0.05)))
    group 'root'
    """

    element_group: str | None = None
    direction: Vector | None = None
    axis: Vector | None = None
    fibres: tuple[tuple[float, ...], ...] = ()


class Stress(NamedTuple):
    """Stress at a point.

    Attributes
    ----------
    position : (3,)
        m, of its node in the model's frame.
    axes : (3, 3)
        Rows: the axes of the components, in the model's frame.
    components : tuple of str
        Names of the c components.
    modes : (c, k)
        Pa, for each of k displacement fields.
    """

    position: np.ndarray
    axes: np.ndarray
    components: tuple[str, ...]
    modes: np.ndarray


@dataclass(frozen=True, eq=False)
class SharedNode:
    """A node with the elements that share it and have stress there.

    Attributes
    ----------
    name : str
    position : (3,)
        m, in the model's frame.
    axes : (3, 3)
        Rows: the axes of the components.
    pieces : tuple of (StressBlock, (ne,) int, (ne, nl) int)
        Elements, which of their nodes it is, and their DOFs.
    """

    name: str
    position: np.ndarray
    axes: np.ndarray
    pieces: tuple[tuple[StressBlock, np.ndarray, np.ndarray], ...]

    def stresses(self, Phi: np.ndarray) -> Iterator[tuple[str, Stress]]:
        """Yield name and stress of each point of the section for each column of ``Phi (n_dof, k)``."""
        found: dict[tuple[str, tuple[str, ...]], list[np.ndarray]] = {}
        for block, local, dofs in self.pieces:
            for label, (components, values) in block.nodal_stress(Phi[dofs]).items():
                own = values[np.arange(len(values)), local]
                shell = isinstance(block.section, Shell)
                found.setdefault((label, components), []).append(self._turned(own, block.frame) if shell else own)
        for (label, components), own in found.items():
            name = f"{self.name}.{label}" if label else self.name
            yield name, Stress(self.position, self.axes, components, np.concatenate(own).mean(axis=0))

    def _turned(self, own: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Plane stress ``xx, yy, xy (ne, 3, k)`` from the elements' axes to the point's: ``T(-a)^T`` of strains."""
        x, y = frame[:, 0] @ self.axes[0], frame[:, 1] @ self.axes[0]
        return strain_rotation(-np.arctan2(y, x)).transpose(0, 2, 1) @ own


@dataclass(frozen=True, eq=False)
class StressRecovery:
    """A linear map from displacements of a model to stress at its points.

    Attributes
    ----------
    nodes : tuple of SharedNode
    """

    nodes: tuple[SharedNode, ...]

    def __call__(self, Phi: np.ndarray) -> dict[str, Stress]:
        """Return the stress at every point for each column of ``Phi (n_dof, k)``, by name."""
        return {name: found for node in self.nodes for name, found in node.stresses(Phi)}


def stress_recovery(model: FEModel, mesh: Mesh, points: Mapping[str, StressPoint]) -> StressRecovery:
    """Prepare the recovery of stress at nodes.

    The point of a set of one node has the name of the set; those of several nodes have the number of the node after a
    dot. Faces of a shell are ``.top`` (towards its normal) and ``.bottom``; fibres of a beam are ``.1``, ``.2``, ...
    where there are several.

    Parameters
    ----------
    model : FEModel
    mesh : Mesh
        From which the model was assembled.
    points : {name: StressPoint}

    Returns
    -------
    StressRecovery
        A function of displacements ``Phi (n_dof, k)`` that returns ``{point: Stress}``, Pa.

    Raises
    ------
    InputError
        When the model has no elements, a set has no node of an element with stress, elements of several properties
        or directions share a node, or a beam has no fibres.

    References
    ----------
    Theory 7.6.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh, cantilever_model
    >>> model = cantilever_model(elements=2)
    >>> recovery = stress_recovery(model, beam_mesh(2), {"middle": StressPoint(node=2, fibres=((0.0, 0.0),))})
    >>> pull = np.zeros((model.n_dof, 1))
    >>> pull[model.dof[:, 0], 0] = 0.0, 1e-3, 2e-3  # strain 2e-4
    >>> recovery(pull)["middle"].modes.round(3)
    array([[14000000.]])
    """
    if model.strain_energy is None:
        raise InputError("a model from matrices knows no elements and no stress; assemble the mesh, or name no points")
    blocks = [block for block in model.strain_energy.blocks if isinstance(block, StressBlock)]
    found: list[SharedNode] = []
    for name, spec in points.items():
        if not name or {"/", "."} & set(name):
            raise InputError(f"stress point {name!r} cannot be the name of channels; leave '.' and '/' out")
        try:
            found += _shared_nodes(model, blocks, mesh, name, spec, MOST - len(found))
        except InputError as error:
            raise InputError(f"stress point {name!r}: {error}") from None
    return StressRecovery(tuple(found))


def _shared_nodes(
    model: FEModel, blocks: list[StressBlock], mesh: Mesh, name: str, spec: StressPoint, most: int
) -> list[SharedNode]:
    own = None if spec.element_group is None else list(mesh.group(spec.element_group).values())
    used = _used(len(mesh.points), own if own is not None else [block.nodes for block in blocks])
    nodes = np.intersect1d(spec.nodes(mesh, used), used)
    if len(nodes) > most:
        raise InputError(f"{spec} has {len(nodes)} nodes; a body keeps the stress of {MOST} at most")
    pieces = [block.piece(rows) for block in blocks if len(rows := _touching(block.nodes, nodes, own))]
    if spec.direction is not None:
        pieces = [piece.piece(_pointing(piece, spec.direction)) for piece in pieces]
    at = {int(node): there for node in nodes if (there := _meeting(node, pieces))}
    if not at:
        which = f" of group {spec.element_group!r}" if spec.element_group else ""
        which += f" in direction {list(spec.direction)}" if spec.direction else ""
        raise InputError(f"no element{which} that has stress meets at {spec}")
    names = [name if len(at) == 1 else f"{name}.{_label(mesh, node)}" for node in at]
    return [
        _shared_node(model, full, mesh.points[node], spec, there)
        for full, (node, there) in zip(names, at.items(), strict=True)
    ]


def _used(count: int, connectivity: list[np.ndarray]) -> np.ndarray:
    seen = np.zeros(count, dtype=bool)
    for cells in connectivity:
        seen[cells] = True
    return np.flatnonzero(seen)


def _touching(cells: np.ndarray, nodes: np.ndarray, own: list[np.ndarray] | None) -> np.ndarray:
    """Return the rows of the cells that have any of the nodes and, unless it is None, are among those of a group."""
    rows = np.flatnonzero(np.isin(cells, nodes).any(axis=1))
    if own is None:
        return rows
    wanted = {tuple(cell) for group in own for cell in group[np.isin(group, nodes).any(axis=1)].tolist()}
    return rows[[tuple(cell) in wanted for cell in cells[rows].tolist()]]


def _pointing(block: StressBlock, direction: Vector) -> np.ndarray:
    """Return the rows of a block whose main axis is within 32 degrees of a direction."""
    main = block.alike[:1]
    size = np.linalg.norm(direction)
    if not main or not size > 0:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(block.frame[:, main[0]] @ np.asarray(direction) >= ALIKE * size)


def _meeting(node: int, pieces: list[StressBlock]) -> list[tuple[StressBlock, np.ndarray]]:
    """Return the elements at a node, and which of their nodes it is."""
    found = []
    for piece in pieces:
        rows, local = np.nonzero(piece.nodes == node)
        if len(rows):
            found.append((piece.piece(rows), local))
    return found


def _label(mesh: Mesh, node: int) -> int:
    """Return the number of a node as `NodeSet.node` counts it."""
    return int(mesh.labels[node]) if len(mesh.labels) else node + 1


def _shared_node(model: FEModel, name: str, place: np.ndarray, spec: StressPoint, there: list) -> SharedNode:
    sections = [block.section for block, _ in there]
    if any(section != sections[0] for section in sections):
        kinds = sorted({_type(section) for section in sections})
        raise InputError(
            f"elements of different properties ({', '.join(kinds)}) meet at {name}; say whose stress by 'of', a group"
        )
    section = _with_fibres(sections[0], spec)
    frame = np.concatenate([block.frame for block, _ in there])
    axes = _axes(frame, section, spec)
    known = list(there[0][0].alike)
    if np.any(np.einsum("eka,ka->ek", frame, axes)[:, known] < ALIKE):
        raise InputError(
            f"elements that meet at {name} point in different directions, {_list(frame[:, known[0]])}, so that their "
            "mean stress says nothing; choose one by 'direction', or by 'of', a group"
        )
    dof = model.dof
    pieces = [
        (replace(block, section=section), local, dof[block.nodes, : block.components].reshape(len(local), -1))
        for block, local in there
    ]
    return SharedNode(name, place - model.origin, axes, tuple(pieces))


def _list(directions: np.ndarray) -> str:
    distinct = np.unique(directions.round(2) + 0.0, axis=0)
    return ", ".join(str(d) for d in distinct[:4].tolist()) + ", ..." * (len(distinct) > 4)


def _with_fibres(section: Property, spec: StressPoint) -> Property:
    for key, family in (("fibres", Beam), ("axis", Shell)):
        if getattr(spec, key) and not isinstance(section, family):
            raise InputError(
                f"{key!r} is not for elements of type {_type(section)}; leave it out, or name others by 'of'"
            )
    if not isinstance(section, Beam):
        return section
    if not (spec.fibres or section.fibres):
        raise InputError("the section of the beam does not say where its outer fibres are; give fibres = [[y, z], ...]")
    return replace(section, fibres=spec.fibres or section.fibres)


def _type(section: Property) -> str:
    return type(section).__name__.lower()


def _axes(frame: np.ndarray, section: Property, spec: StressPoint) -> np.ndarray:
    """Return the axes of the components: those of the first element, of a shell by its mean normal and `axis`."""
    if not isinstance(section, Shell):
        return frame[0]
    normal = frame[:, 2].mean(axis=0)
    normal = normal / max(np.linalg.norm(normal), np.finfo(float).tiny)
    x = np.array(spec.axis or ((1.0, 0, 0) if abs(normal[0]) < ACROSS else (0.0, 1, 0)), dtype=float)
    along = x - (x @ normal) * normal
    if not np.linalg.norm(along) > np.sqrt(1 - ACROSS**2) * np.linalg.norm(x):
        raise InputError(f"axis {x.tolist()} is zero or normal to the shell there; choose another")
    along = along / np.linalg.norm(along)
    return np.stack([along, np.cross(normal, along), normal])
