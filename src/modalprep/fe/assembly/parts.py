"""The elements of a model: mesh groups with their properties, which must cover the structure exactly once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.distribution import MassRule
from modalprep.fe.elements.solid import INTEGRATIONS, REDUCED
from modalprep.fe.families import FAMILIES
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.points import Spring
from modalprep.fe.properties.properties import Property, Solid
from modalprep.fe.quality.connectivity import smallest_part

CHUNK = 512  # elements evaluated at once: their matrices stay in the cache


@dataclass(frozen=True, eq=False)
class Part:
    """Elements of one kind that share a property.

    Attributes
    ----------
    group : str
    section : Property
    kind : str
    nodes : (ne, nn) int
    data : {name: (ne, ...)}
        What the mesh says per element.
    """

    group: str
    section: Property
    kind: str
    nodes: np.ndarray
    data: dict[str, np.ndarray]

    def pieces(self) -> list[slice]:
        """Slices of the elements that are evaluated at once."""
        return [slice(start, start + CHUNK) for start in range(0, len(self.nodes), CHUNK)]

    def rows(self, some: np.ndarray) -> Part:
        """Return some of the elements."""
        return replace(self, nodes=self.nodes[some], data={name: values[some] for name, values in self.data.items()})

    def block(self, piece: slice, points: np.ndarray, origin: np.ndarray) -> Block:
        """Return some elements; `points` in mesh coordinates, `origin` of the model's frame in them."""
        data = {name: values[piece] for name, values in self.data.items()}
        try:
            return self.family.build(self.kind, points, self.nodes[piece], self.section, data, origin)
        except InputError as error:
            raise InputError(f"group {self.group!r}: {error}") from None

    def components(self, points: np.ndarray) -> int:
        """DOFs that each node of these elements has: 3, or 6 with rotations."""
        family = self.family
        if hasattr(family, "components"):
            return family.components
        return max(self.block(piece, points, np.zeros(3)).components for piece in self.pieces())

    @property
    def family(self) -> type[Block]:
        """What evaluates these elements."""
        return FAMILIES[type(self.section)][self.kind]


class Elements(NamedTuple):
    """The elements of a model with their properties: what can be evaluated again with other ones.

    Attributes
    ----------
    parts : tuple of Part
    rule : MassRule
    """

    parts: tuple[Part, ...]
    rule: MassRule


def find_parts(mesh: Mesh, properties: Mapping[str, Property], boundary: set[str]) -> tuple[list[Part], list[str]]:
    """Return the structural elements, and notes on cells that are left out.

    Parameters
    ----------
    mesh : Mesh
    properties : {group: Property}
    boundary : set of str
        Groups that only carry interfaces; their cells need no property.

    Raises
    ------
    InputError
        When a group is unknown or of the wrong cells, or a cell has two properties or none.
    """
    covered = {kind: np.zeros(len(c), dtype=int) for kind, c in mesh.cells.items()}
    parts = []
    for group, section in properties.items():
        for kind in _kinds(mesh, group, section):
            rows = mesh.groups[group][kind]
            covered[kind][rows] += 1
            data = {name: v[kind][rows] for name, v in mesh.data.items() if kind in v}
            parts += _of_one_integration(Part(group, section, kind, mesh.cells[kind][rows], data))
    for kind, count in covered.items():
        if np.any(count > 1):
            raise InputError(f"{np.sum(count > 1)} {kind} cells have two properties; give each group its own cells")
    return parts, [*_left_out(mesh, covered, boundary), *_other_integration(parts)]


def _kinds(mesh: Mesh, group: str, section: Property) -> list[str]:
    wanted = FAMILIES[type(section)]
    dimensions = {cell_dimension(kind) for kind in wanted}
    kinds = [kind for kind in mesh.group(group) if cell_dimension(kind) in dimensions]
    if isinstance(section, Spring) and "line" in kinds:
        kinds = ["line"]  # the vertices of such a group are its ends
    if not kinds or set(kinds) - set(wanted):
        has = ", ".join(mesh.group(group))
        name = type(section).__name__.lower()
        raise InputError(f"group {group!r} has {has} cells, but type {name!r} needs {' or '.join(wanted)} cells")
    integration = section.integration if isinstance(section, Solid) else None
    if integration not in (None, "full") and not set(kinds) & set(REDUCED):
        raise InputError(
            f"group {group!r} has {', '.join(kinds)} cells, and integration {integration!r} is of "
            f"{' and '.join(REDUCED)} cells; leave it out"
        )
    return kinds


def _of_one_integration(part: Part) -> list[Part]:
    """Split elements whose integration the mesh gives one by one."""
    own = np.nan_to_num(part.data.get("integration", np.zeros(1)))
    return [part] if len(np.unique(own)) == 1 else [part.rows(own == each) for each in np.unique(own)]


def _other_integration(parts: list[Part]) -> Iterator[str]:
    """Say which groups are integrated as their property says, where the mesh says otherwise."""
    for part in parts:
        given = part.section.integration if isinstance(part.section, Solid) and part.kind in REDUCED else None
        own = part.data.get("integration", np.zeros(0))
        if given and np.any(own != INTEGRATIONS.index(given)):
            yield f"group {part.group!r} has the integration of its property, {given!r}, where its mesh says another"


def _left_out(mesh: Mesh, covered: dict[str, np.ndarray], boundary: set[str]) -> list[str]:
    """Refuse cells of the highest dimension without a property; note those of lower dimension."""
    notes = []
    top = max(cell_dimension(kind) for kind in covered)
    for kind, count in covered.items():
        for name in boundary & set(mesh.groups):
            count[mesh.groups[name].get(kind, [])] += 1
        missing = count == 0
        if not np.any(missing) or cell_dimension(kind) == 0:
            continue
        names = [g for g, rows in mesh.groups.items() if kind in rows and np.any(missing[rows[kind]])]
        where = f"group {names[0]!r}" if names else "cells in no group"
        sentence = f"{missing.sum()} of {len(count)} {kind} cells have no property ({where})"
        if cell_dimension(kind) == top:
            raise InputError(f"{sentence}; add one under [properties]")
        notes.append(f"{sentence} and are left out; their groups name nodes only")
    return notes


def used_nodes(parts: list[Part]) -> np.ndarray:
    """Return the sorted nodes (k,) that elements use."""
    used = np.zeros(1 + max(int(part.nodes.max(initial=-1)) for part in parts), dtype=bool)
    for part in parts:
        used[part.nodes] = True
    return np.flatnonzero(used)


def refuse_disconnected(points: np.ndarray, parts: list[Part], tied: list[np.ndarray], used: np.ndarray) -> None:
    """Refuse `used` nodes in several parts; `tied` lists the node sets that links and interfaces connect."""
    groups = [part.nodes for part in parts] + [nodes[None] for nodes in tied]
    count, small, where = smallest_part(groups, used, points)
    if count > 1:
        raise InputError(
            f"the structure is in {count} disconnected parts, the smallest has {len(small)} nodes "
            f"around {where}; merge coincident nodes or mesh the parts together"
        )
