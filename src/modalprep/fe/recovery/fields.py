"""Displacement and acceleration fields of a model, the elements that are asked for, and the forces on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeGuard, TypeVar

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.strain_energy import StrainEnergy
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.distribution import Inertia
from modalprep.fe.elements.mass import MassObjects
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet

AXES = ("x", "y", "z")
Family = TypeVar("Family", bound=Block, covariant=True)


class Fields(NamedTuple):
    """Fields over the DOFs of a model, k at a time: an equation of motion in each column (theory 4.9).

    Attributes
    ----------
    u : (n_dof, k)
        Displacement.
    a : (n_dof, k)
        Acceleration relative to the body's frame.
    drives : (12, k)
        Specific acceleration A of the origin (3) and ``W = alpha~ + omega~ omega~`` (9, row by row) of the frame.

    Examples
    --------
    >>> Fields.static(np.zeros((6, 2))).drives.shape
    (12, 2)
    """

    u: np.ndarray
    a: np.ndarray
    drives: np.ndarray

    @classmethod
    def static(cls, u: np.ndarray) -> Fields:
        """Return displacements ``u (n_dof, k)`` of a model at rest.

        Returns
        -------
        Fields
            Without accelerations.
        """
        return cls(u, np.zeros_like(u), np.zeros((12, u.shape[1])))

    def acceleration(self, at: np.ndarray) -> np.ndarray:
        """Return ``A + W x`` of the frame at places x ``(..., 3)``, m.

        Returns
        -------
        (..., 3, k) float
            m/s^2.

        References
        ----------
        Theory 4.9.
        """
        A = self.drives[:3]
        W = self.drives[3:].reshape(3, 3, -1)
        return A + np.einsum("...b,abk->...ak", at, W)


class Quantity(NamedTuple):
    """A recovered quantity: p places with c components each, linear in the fields.

    Attributes
    ----------
    kind : str
    places, components, units : tuple of str
        p names, c names, c units.
    values : callable
        ``Fields -> (p, c, k)``.
    position : (p, 3)
        m, in the model's frame.
    node : (p,) int or None
        Mesh nodes of the places.
    cell : (p,) int or None
        Their cells, counted over the model's cell types in alphabetical order.
    """

    kind: str
    places: tuple[str, ...]
    components: tuple[str, ...]
    units: tuple[str, ...]
    values: Callable[[Fields], np.ndarray]
    position: np.ndarray
    node: np.ndarray | None = None
    cell: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Piece(Generic[Family]):
    """Some elements of one block.

    Attributes
    ----------
    block : Block
    inertia : Inertia
        The mass of the whole block they are from, or their own.
    rows : (ne,) int or None
        Their rows in `inertia`; None where it is their own.
    dofs : (ne, nl) int
    numbers : (ne,) int
        Of the elements in their group, from 1.
    cells : (ne,) int
        Of the elements, counted over the model's cell types in alphabetical order.
    """

    block: Family
    inertia: Inertia
    rows: np.ndarray | None
    dofs: np.ndarray
    numbers: np.ndarray
    cells: np.ndarray

    @property
    def consistent(self) -> bool:
        """Whether the mass has the shapes of the element."""
        return self.inertia is self.block

    def stiffness_forces(self, fields: Fields) -> np.ndarray:
        """Return ``K_e u_e (ne, nl, k)``: forces of the nodes on the elements, less those that inertia needs."""
        K = self.block.stiffness()
        return np.zeros((*self.dofs.shape, fields.u.shape[1])) if K is None else K @ fields.u[self.dofs]

    def forces(self, fields: Fields) -> np.ndarray:
        """Return the forces ``(ne, nl, k)`` of the nodes on the elements: ``K_e u + M_e a + g_e A + h_e W``."""
        total = self.stiffness_forces(fields)
        mass = self._mass()
        if mass is None or not (np.any(fields.a) or np.any(fields.drives)):
            return total
        linear = np.concatenate([mass.g, mass.h.reshape(*mass.h.shape[:2], 9)], axis=2)
        return total + mass.matrix() @ fields.a[self.dofs] + linear @ fields.drives

    def _mass(self) -> MassObjects | None:
        mass = self.inertia.mass()
        return mass if mass is None or self.rows is None else mass.rows(self.rows)


def chosen(model: FEModel, mesh: Mesh, where: NodeSet | None) -> list[Piece]:
    """Return the elements of a group, or all whose nodes lie in a node set; None: every element.

    Raises
    ------
    InputError
        When the model has no elements, or none is chosen.
    """
    energy = elements_of(model)
    numbers = _numbers(mesh, where, energy.blocks)
    starts = _starts(model)
    found = []
    for start, block, inertia in zip(starts, energy.blocks, model.rotating_mass.blocks, strict=True):
        own = np.array([numbers.get(tuple(cell), 0) for cell in block.nodes.tolist()], dtype=int)
        rows = np.flatnonzero(own)
        if len(rows):
            piece = block.piece(rows)
            dofs = model.dof[piece.nodes, : block.components].reshape(len(rows), -1)
            whole = inertia is not block
            found.append(
                Piece(piece, inertia if whole else piece, rows if whole else None, dofs, own[rows], start + rows)
            )
    if not found:
        raise InputError(f"no element lies at {where}")
    return found


def elements_of(model: FEModel) -> StrainEnergy:
    """Return the elements of a model.

    Raises
    ------
    InputError
        When the model is from matrices.
    """
    if model.strain_energy is None:
        raise InputError(
            "a model from matrices knows no elements; its reactions, accelerations and displacements can be recovered"
        )
    return model.strain_energy


def _starts(model: FEModel) -> list[int]:
    """Return the number of the first cell of each block."""
    first = {}
    count = 0
    for kind in sorted(model.cells):
        first[kind] = count
        count = count + len(model.cells[kind])
    found = []
    energy = elements_of(model)
    for kind, block in zip(energy.kinds, energy.blocks, strict=True):
        found.append(first[kind])
        first[kind] += len(block.nodes)
    return found


def _numbers(mesh: Mesh, where: NodeSet | None, blocks: list[Block]) -> dict[tuple[int, ...], int]:
    """Return the number of each chosen element by its nodes, from 1 in the order of the mesh."""
    cells = [tuple(cell) for block in blocks for cell in block.nodes.tolist()]
    if where is not None and where.group is not None:
        own = [tuple(cell) for conn in mesh.group(where.group).values() for cell in conn.tolist()]
        if not set(cells).isdisjoint(own):
            return {cell: number for number, cell in enumerate(own, start=1)}
    if where is not None:
        inside = set(where.nodes(mesh, np.unique(np.concatenate([b.nodes.ravel() for b in blocks]))).tolist())
        cells = [cell for cell in cells if inside.issuperset(cell)]
    return {cell: number for number, cell in enumerate(cells, start=1)}


def of_family(pieces: list[Piece], families: tuple[type[Family], ...], what: str) -> list[Piece[Family]]:
    """Return the pieces of some element families.

    Raises
    ------
    InputError
        When there is none; `what` says what they would be.
    """
    found = [piece for piece in pieces if _is_of(piece, families)]
    if not found:
        raise InputError(f"there are no {what} among these elements; choose another group")
    return found


def _is_of(piece: Piece, families: tuple[type[Family], ...]) -> TypeGuard[Piece[Family]]:
    return isinstance(piece.block, families)


def labels(pieces: list[Piece]) -> Iterator[str]:
    """Yield the names of the elements: their numbers, nothing where there is only one."""
    alone = sum(len(piece.numbers) for piece in pieces) == 1
    for piece in pieces:
        for number in piece.numbers.tolist():
            yield "" if alone else str(number)
