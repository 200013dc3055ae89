"""Masses, rotary inertias, springs and dashpots."""

from __future__ import annotations

import numpy as np

from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.lexer import Block
from modalprep.fe.readers.abaqus.sections import give, section_set


def mass(deck: Deck, block: Block) -> None:
    """``*MASS``."""
    _, keys = section_set(deck, block, "mass")
    if block.choice("TYPE", "ISOTROPIC") != "ISOTROPIC":
        block.refuse("differs by direction (TYPE); give one mass for all three")
    if keys:
        give(deck, block, block.made(PointMass, mass=block.row().real(0, "mass") * deck.units.inertial))


def rotary_inertia(deck: Deck, block: Block) -> None:
    """``*ROTARY INERTIA``: entries 11, 22, 33, 12, 13, 23 of the tensor, in the axes of the part or the orientation."""
    _, keys = section_set(deck, block, "rotary inertia")
    if not keys:
        return
    xx, yy, zz, xy, xz, yz = block.joined().reals(0, 6, "a moment of inertia")
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    axes = _axes(deck, block, keys[0])
    J = axes.T @ J @ axes * deck.units.inertial * deck.units.length**2
    inertia = tuple(J[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist())
    give(deck, block, block.made(PointMass, mass=0.0, inertia=inertia))


def _axes(deck: Deck, block: Block, key: tuple[str, int]) -> np.ndarray:
    """Return the axes (rows) of a point element: of its orientation, else of the part."""
    if block.options.get("ORIENTATION"):
        axes = deck.named("orientation", block, block.scope, block.options["ORIENTATION"])
        return axes.axes_at(deck, key, deck.points[deck.elements[key].nodes[0]])
    return np.array([deck.turned(block.scope, axis) for axis in np.eye(3)])


def spring(deck: Deck, block: Block) -> None:
    """``*SPRING``: along the line of SPRINGA, in one component of SPRING1 and SPRING2."""
    _, keys = section_set(deck, block, "spring")
    if keys:
        k = _six(deck, block, keys, "stiffness")
        give(deck, block, block.made(Spring, translation=k[:3], rotation=k[3:]))


def dashpot(deck: Deck, block: Block) -> None:
    """``*DASHPOT``: along the line of DASHPOTA, in one component of DASHPOT1 and DASHPOT2."""
    _, keys = section_set(deck, block, "dashpot")
    if keys:
        c = _six(deck, block, keys, "damping")
        if any(c):
            give(deck, block, block.made(Spring, translation_damping=c[:3], rotation_damping=c[3:]))


def _six(deck: Deck, block: Block, keys: list[tuple[str, int]], what: str) -> tuple[float, ...]:
    """Return six values of springs or dashpots in SI units, translations first."""
    if "NONLINEAR" in block.options:
        block.refuse(f"is NONLINEAR; give the {what} of the state about which the body moves")
    types = {deck.elements[key].type for key in keys}
    if len(types) > 1:
        block.refuse(f"of set {block.options['ELSET']} has {' and '.join(sorted(types))} elements; split the set")
    along = types <= {"SPRINGA", "DASHPOTA"}
    rows = [row for row in block.rows if any(map(row.text, range(len(row.fields))))][not along :]
    if len(rows) > 1:
        deck.note(f"*{block.keyword} (line {block.line}): of its {len(rows)} values the first holds")
    k = rows[0].real(0, what, 0.0) if rows else 0.0
    if along:
        values = [k, 0.0, 0.0, 0.0, 0.0, 0.0]
    else:
        components = {
            block.row().integer(i, "a component") for i in range(len(block.row().fields)) if block.row().text(i)
        }
        if len(components) != 1 or not components <= set(range(1, 7)):
            block.refuse("joins unlike components; give one component from 1 to 6 for both nodes")
        c = components.pop() - 1
        values = [k if i == c else 0.0 for i in range(6)]
        _place(deck, block, keys, c)
    unit = [deck.units.inertial] * 3 + [deck.units.inertial * deck.units.length**2] * 3
    return tuple(value * factor for value, factor in zip(values, unit, strict=True))


def _place(deck: Deck, block: Block, keys, component: int) -> None:
    """Give springs of one component their axes, and say where their arms count."""
    for key in keys:
        nodes = deck.elements[key].nodes
        axes = _axes(deck, block, key) if block.options.get("ORIENTATION") else deck.axes.get(nodes[0], np.eye(3))
        deck.put("frame", deck.elements[key].cells[0], axes)
        along = axes @ (deck.points[nodes[-1]] - deck.points[nodes[0]])
        size = 1e-9 * np.ptp(deck.points, axis=0).max()
        if (abs(np.delete(along, component % 3)) > size).any() or (component > 2 and (abs(along) > size).any()):
            deck.note(
                f"{deck.elements[key].type} between distant nodes acts through rigid arms to the middle, so that it is "
                f"free of rotation (first in line {block.line})"
            )
