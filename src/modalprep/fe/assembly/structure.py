"""The elements of a model as what forms are assembled over: `skfem.asm(form, structure)`."""

from __future__ import annotations

from copy import copy
from functools import cached_property

import numpy as np

from modalprep.fe.assembly.parts import Part
from modalprep.fe.assembly.sparsity import Pattern, node_graph, pairs_of
from modalprep.fe.assembly.totals import Totals
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.distribution import Inertia, MassRule
from modalprep.fe.elements.kernels import ahead
from modalprep.fe.elements.mass import MassObjects
from modalprep.fe.forms.basis import DofMap
from modalprep.fe.forms.families import plain
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.plain import Plain


class Structure:
    """Elements of several kinds and properties, in place of the basis of one kind of cells.

    Parameters
    ----------
    parts : list of Part
    points : (n, 3)
        Nodes in mesh coordinates, m.
    dof : (n_nodes, 6) int
    rule : MassRule
    origin : (3,)
        Of the model's frame in the mesh, m.
    """

    def __init__(
        self, parts: list[Part], points: np.ndarray, dof: np.ndarray, rule: MassRule, origin: np.ndarray
    ) -> None:
        self.parts, self.rule = parts, rule
        self._points, self._origin = points, origin
        self.dofmap = DofMap(points - origin, dof, int(dof.max()) + 1)
        self.pieces = [(part, piece) for part in parts for piece in part.pieces()]

    @cached_property
    def pattern(self) -> Pattern:
        """Pattern of K, M and Kg: every pair of nodes that shares an element."""
        return Pattern.build([part.nodes for part in self.parts], self.dofmap.dof)

    @cached_property
    def blocks(self) -> list[Block]:
        """The elements of each piece."""
        return [self._block(*own) for own in self.pieces]

    @cached_property
    def plain(self) -> list[Plain | None]:
        """The weak forms of each block; None of those without an inside."""
        return [plain(block, self.dofmap) for block in self.blocks]

    @cached_property
    def weak_masses(self) -> list[list[Mass] | None]:
        """The mass of each block as weak forms have it; None where it has none or is distributed in another way."""
        both = zip(self.blocks, self.inertias, self.plain, strict=True)
        return [None if own is None or inertia is not block else own.masses() for block, inertia, own in both]

    def without_masses(self) -> Structure:
        """Return the structure without `weak_masses`, whose bases take much memory."""
        other = copy(self)
        other.__dict__.pop("weak_masses", None)
        return other

    @cached_property
    def inertias(self) -> list[Inertia]:
        """What has the mass of each block."""
        return [self.rule.inertia(block, self.dofmap.points) for block in self.blocks]

    @cached_property
    def totals(self) -> Totals:
        """What compiled loops sum up in one pass that evaluates every element once."""
        total = _totals(self.parts, self.pattern, self.dofmap.dof, self.rule)
        found = []
        for block, inertia, pairs, stiffness, mass in ahead(self._evaluated, self.pieces):
            total.add(block, pairs, stiffness, mass)
            found.append((block, inertia, mass.rigid.m if mass else 0.0))
        self.blocks, self.inertias, self.masses = (list(own) for own in zip(*found, strict=True))
        return total

    @cached_property
    def masses(self) -> list[float]:
        """Mass of each block, kg."""
        masses = (inertia.mass() for inertia in self.inertias)
        return [mass.rigid.m if mass else 0.0 for mass in masses]

    def _block(self, part: Part, piece: slice) -> Block:
        return part.block(piece, self._points, self._origin)

    def _evaluated(
        self, own: tuple[Part, slice]
    ) -> tuple[Block, Inertia, np.ndarray, np.ndarray | None, MassObjects | None]:
        block = self._block(*own)
        inertia = self.rule.inertia(block, self.dofmap.points)
        return block, inertia, pairs_of(self.pattern.graph, block.nodes), block.stiffness(), inertia.mass()


def _totals(parts: list[Part], pattern: Pattern, dof: np.ndarray, rule: MassRule) -> Totals:
    """Begin the sums over elements whose mass tensors have different forms."""
    shells, thin = (
        [part.nodes for part in parts if rule.tensor(part.family) == form] for form in ("functions", "pairs")
    )
    graph = None
    if shells:
        graph = pattern.graph if len(shells) == len(parts) else node_graph(shells, len(dof))
    return Totals(pattern, graph, Pattern.build(thin, dof) if thin else None, dof)
