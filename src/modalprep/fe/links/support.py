"""Supports: nodes that are held at the frame of the root interface, by component."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.links.components import ALIGNED
from modalprep.fe.mesh.mesh import Mesh, SupportSet
from modalprep.fe.mesh.select import NodeSet
from modalprep.suggest import suggestion
from modalprep.vectors import frame_of_axes

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, repr=False)
class Support(NodeSet):
    """Nodes whose named components are tied rigidly to the frame of the root interface.

    Attributes
    ----------
    components : str
        Digits 1 to 6 of the displacements and rotations that are held; default all that the nodes have.
    axes : two (3,) vectors
        e1, and a direction in the plane of e1 and e2, along which the components are counted; default those of the
        mesh.
    set : str
        A set of supports that the file of the mesh brings (``Mesh.supports``), with its own components and axes,
        instead of nodes and components.

    Raises
    ------
    InputError
        When none or several node sets are given, components are not digits 1 to 6, or the axes lie on one line.

    References
    ----------
    Theory 1.4.

    Examples
    --------
    >>> Support(group="edge", components="3").components
    '3'
    >>> Support(set="spc_1")
    set 'spc_1'
    """

    components: str | None = None
    axes: tuple[Vector, Vector] | None = None
    set: str | None = None

    def __post_init__(self) -> None:
        """Refuse other components and axes."""
        if self.set is None:
            super().__post_init__()
        elif self._given() or self.components or self.axes:
            raise InputError(f"support by set {self.set!r} has its own nodes, components and axes; leave those out")
        if self.components is not None and (not self.components or set(self.components) - set("123456")):
            raise InputError(f"components {self.components!r} of a support are not digits 1 to 6; give such as '123'")
        if self.axes is not None:
            frame_of_axes(self.axes, "a support")

    def constrained_nodes(self, mesh: Mesh, used: np.ndarray) -> SupportSet:
        """Return the nodes with their components and axes; queries by position choose among the nodes `used`.

        Raises
        ------
        InputError
            When there is no such set or node.
        """
        if self.set is not None:
            if self.set not in mesh.supports:
                known = suggestion(self.set, mesh.supports, "it has")
                raise InputError(f"mesh {mesh.source or 'in memory'} has no set of supports {self.set!r}; {known}")
            return mesh.supports[self.set]
        nodes = self.nodes(mesh, used)
        components = np.array([digit in (self.components or "123456") for digit in "123456"])
        axes = (
            np.zeros((0, 3, 3))
            if self.axes is None
            else np.tile(frame_of_axes(self.axes, "a support"), (len(nodes), 1, 1))
        )
        return SupportSet(nodes=nodes, components=np.tile(components, (len(nodes), 1)), axes=axes)

    def __repr__(self) -> str:
        """The set or the nodes."""
        return f"set {self.set!r}" if self.set is not None else super().__repr__()


def held_nodes(mesh: Mesh, supports: Mapping[str, Support], used: np.ndarray) -> dict[str, SupportSet]:
    """Return what each support holds that none before it holds, on the nodes `used` by elements.

    Raises
    ------
    InputError
        When a support has no node of an element, or two hold a node along different axes.
    """
    known = np.zeros((len(mesh.points), 6), dtype=bool)
    frames = np.tile(np.eye(3), (len(mesh.points), 1, 1))  # of what is held in part
    owner: dict[tuple[int, int], np.ndarray] = {}
    found = {}
    for name, spec in supports.items():
        held = spec.constrained_nodes(mesh, used)
        here = np.isin(held.nodes, used)
        if not np.any(here):
            raise InputError(f"support {name!r}: no node of {spec} belongs to an element with a property")
        axes = held.axes[here] if len(held.axes) else np.tile(np.eye(3), (here.sum(), 1, 1))
        nodes, components = held.nodes[here], held.components[here]
        for k in np.flatnonzero(known[nodes].any(axis=1)):
            axes[k] = _axes_of_both(name, known[nodes[k]], frames[nodes[k]], components[k], axes[k])
        new = components & ~known[nodes]
        known[nodes] |= components
        frames[nodes] = axes
        for k in np.flatnonzero(np.any(np.abs(axes - np.eye(3)) > ALIGNED, axis=(1, 2))):
            _give_to_first(owner, int(nodes[k]), new[k])
        found[name] = (nodes, new, axes)
    return {name: SupportSet(nodes=n, components=c, axes=a) for name, (n, c, a) in found.items()}


def _give_to_first(owner: dict[tuple[int, int], np.ndarray], node: int, new: np.ndarray) -> None:
    """Give components (6,) along turned axes to the support that holds a part of them: together they are one link.

    `owner` has the components of the first support by node and by translations (0) or rotations (1).
    """
    for half, part in enumerate((slice(0, 3), slice(3, 6))):
        if not np.any(new[part]):
            continue
        first = owner.setdefault((node, half), new)
        if first is not new:
            first[part] |= new[part]
            new[part] = False


def _axes_of_both(name: str, known: np.ndarray, frame: np.ndarray, own: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the axes of what two supports hold of a node: of translations or rotations held wholly any axes are."""
    first, second = _in_part(known), _in_part(own)
    if np.any(np.abs(frame - axes) > ALIGNED) and np.any(first) and np.any(second):
        raise InputError(f"support {name!r} holds a node that another holds along other axes; join the two")
    return frame if np.any(first) else axes


def _in_part(components: np.ndarray) -> np.ndarray:
    """Return whether translations and rotations (2,) are held, but not all three."""
    count = np.count_nonzero(components.reshape(2, 3), axis=1)
    return (count > 0) & (count < 3)
