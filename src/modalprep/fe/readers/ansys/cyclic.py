"""CYCLIC of Ansys: a sector, its axis, and the components of its edges."""

from __future__ import annotations

import re

import numpy as np

from modalprep.fe.mesh.cyclic import HIGH, LOW, CyclicSymmetry
from modalprep.fe.readers.ansys.commands import Command
from modalprep.fe.readers.ansys.deck import Deck
from modalprep.fe.readers.ansys.systems import PREDEFINED
from modalprep.fe.readers.units import Units


def cyclic(deck: Deck, command: Command) -> None:
    """CYCLIC: number of sectors, angle, coordinate system and name of the components."""
    if command.text(1) in ("OFF", "STATUS", "UNDOUBLE"):
        return
    sectors = command.integer(1, "number of sectors", 0)
    angle = command.real(2, "angle", 360.0 / sectors if sectors > 1 else 0.0)
    if sectors < 2 or abs(sectors * angle - 360.0) > 1e-3:
        raise command.error(f"has {sectors} sectors of {angle:g} degrees, which make no circle; give both")
    deck.cyclic = (sectors, command.integer(3, "coordinate system", 1), command.text(4) or "CYCLIC")


def cyclic_symmetry(deck: Deck, units: Units) -> CyclicSymmetry | None:
    """Return the symmetry of the deck in m; the components ``NAME_M01L`` and ``NAME_M01H`` and so on make two groups.

    Without them the edges are found by the rotation.
    """
    if deck.cyclic is None:
        return None
    sectors, number, name = deck.cyclic
    system = deck.systems.get(number) or PREDEFINED.get(number)
    axis = np.array([0.0, 0.0, 1.0]) if system is None else system.axes[2]
    point = np.zeros(3) if system is None else np.asarray(system.origin) * units.length
    for group, end in ((LOW, "L"), (HIGH, "H")):
        pattern = re.compile(f"{re.escape(name)}_M[0-9]+{end}", re.IGNORECASE)
        found = [nodes for key, nodes in deck.node_sets.items() if pattern.fullmatch(key)]
        if found:
            deck.node_sets[group] = [node for nodes in found for node in nodes]
    low, high = (name if name in deck.node_sets else "" for name in (LOW, HIGH))
    return CyclicSymmetry(sectors=sectors, axis=axis, point=point, low=low, high=high)
