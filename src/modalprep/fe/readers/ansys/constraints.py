"""Supports, constraint equations and coupled sets of an Ansys deck, along the axes of the nodes."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import Equation, SupportSet
from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.handlers import DOFS
from modalprep.fe.readers.ansys.systems import axes_of

SUPPORTS = "held"  # the group and the set of supports


def add_constraints(b: Builder) -> None:
    """Add what the deck says of single DOFs."""
    _add_supports(b)
    for number, found in b.deck.equations.items():
        name = f"CE {number} (line {found['line']})"
        if found["constant"]:
            b.deck.note(f"{name}: its constant {found['constant']:g} is left out; give it as a motion")
        _add_equation(b, name, found["terms"])
    for number, found in b.deck.couples.items():
        _add_couple(b, f"CP {number} (line {found['line']})", found)


def _add_supports(b: Builder) -> None:
    held: dict[int, np.ndarray] = {}
    for entry in b.deck.fixed:
        if entry.node not in b.row:
            raise InputError(f"mesh file {b.deck.path}, line {entry.line}: D: node {entry.node} is not in the deck")
        components = held.setdefault(b.row[entry.node], np.zeros(6, dtype=bool))
        components |= np.array([entry.label in ("ALL", name) for name in DOFS])
        if entry.value:
            b.deck.note(
                f"D (line {entry.line}): the displacement {entry.value:g} of node {entry.node} is left out; "
                "give it as a motion"
            )
    if held:
        nodes = sorted(held)
        axes = np.array([axes_at_node(b, node) for node in nodes])
        b.supports[SUPPORTS] = SupportSet(
            nodes=np.array(nodes), components=np.array([held[node] for node in nodes]), axes=axes
        )
        b.deck.note(f"{len(nodes)} nodes are held by D: the group and the set of supports {SUPPORTS!r}")
        for node in nodes:
            b.append("vertex", [node], SUPPORTS)


def axes_at_node(b: Builder, row: int) -> np.ndarray:
    """Return the rows e1, e2, e3 of the displacements of a node."""
    return axes_of(np.array(b.deck.angles.get(int(b.labels[row]), [0.0] * 3)))


def _add_equation(b: Builder, name: str, terms: list[tuple[int, int, float]]) -> None:
    """Add an equation of (node number, component, coefficient)."""
    missing = [node for node, _, _ in terms if node not in b.row]
    if missing or not any(factor for _, _, factor in terms):
        what = f"node {missing[0]} is not in the deck" if missing else "it has no terms"
        raise InputError(f"mesh file {b.deck.path}: {name}: {what}; export the model again")
    rows = [(b.row[node], component, factor) for node, component, factor in terms]
    axes = {row: axes_at_node(b, row) for row, _, _ in rows}
    b.equations.append(Equation.of_terms(rows, length=b.units.length, name=name, axes=axes))


def _add_couple(b: Builder, name: str, found: dict) -> None:
    """The nodes of a coupled set follow the first; ALL couples rotations where each node has them."""
    first, *others = found["nodes"] or [0]
    turning = all(b.row.get(node) in b.turning for node in found["nodes"])
    every = range(6 if turning else 3)
    for component in every if found["label"] == "ALL" else [DOFS.index(found["label"])]:
        for node in others:
            _add_equation(b, name, [(node, component, 1.0), (first, component, -1.0)])
