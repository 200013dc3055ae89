"""What an Ansys deck says of its analysis: forces, gravity, modes, damping and master DOFs."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.analysis import AnalysisCase, Damping, LoadSet
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.commands import Command
from modalprep.fe.readers.ansys.deck import Deck
from modalprep.fe.readers.ansys.handlers import nodes_in_range
from modalprep.fe.readers.ansys.systems import axes_of

MASTER = "master"  # the group of the nodes with master DOFs
LOAD = "forces"
FORCES = ("FX", "FY", "FZ", "MX", "MY", "MZ")
WHOLE = {"ALPH": "ALPD", "BETA": "BETD", "DMPR": "DMPR", "DMPS": "DMPS"}  # label of a material by the command
OLD = {"DAMP": "BETD"}


def force(deck: Deck, command: Command) -> None:
    """F: one force or moment at a node, along the axes of the node."""
    try:
        nodes, value = nodes_in_range(deck, command, 5), command.real(3, "force", 0.0)
    except InputError:
        unread(deck, command)
        return
    if command.text(2) in FORCES:
        deck.forces |= {(node, FORCES.index(command.text(2))): value for node in nodes}


def analysis(deck: Deck, command: Command) -> None:
    """ACEL, MODOPT, and the damping of the whole: their numbers."""
    try:
        first = 2 if command.key == "MODO" else 1
        deck.said[command.key] = [command.real(k, "value", 0.0) for k in range(first, first + 3)]
    except InputError:
        unread(deck, command)


def master(deck: Deck, command: Command) -> None:
    """M: a node with master DOFs."""
    try:
        deck.node_sets.setdefault(MASTER, []).extend(nodes_in_range(deck, command, 3))
    except InputError:
        unread(deck, command)


def prestressed(deck: Deck, command: Command) -> None:
    """PSTRES: modes under load, which are said."""
    if command.text(1) in ("ON", "1"):
        deck.unread.append(("PSTRES (modes under load)", f"line {command.line}"))


def unread(deck: Deck, command: Command) -> None:
    """Note a load or an option of the analysis that has no use here, unless all its numbers are zero."""
    try:
        if not any(command.reals(1)):
            return
    except InputError:
        pass
    deck.unread.append((command.fields[0].upper(), f"line {command.line}"))


def add_case(b: Builder) -> None:
    """Give the mesh its load and what the deck says of its analysis."""
    deck = b.deck
    length = b.units.length
    terms = []
    for (node, component), value in deck.forces.items():
        if node in b.row:
            axis = axes_of(np.array(deck.angles.get(node, [0.0] * 3)))[component % 3]
            unit = b.units.mass * length ** (1 + component // 3)
            terms += [(b.row[node], component - component % 3 + c, value * unit * float(x)) for c, x in enumerate(axis)]
    if any(value for _, _, value in terms):
        b.loads[LOAD] = LoadSet.of_terms(terms)
    count, lowest, highest = ([*deck.said.get("MODO", []), 0.0, 0.0, 0.0])[:3]
    said = [*left_out(deck.unread, "of the analysis these are not used; give loads in [loads]")]
    case = AnalysisCase(
        number=0,
        name="the deck",
        supports=tuple(b.supports),
        loads=tuple(b.loads),
        modes=int(count) or None,
        lowest=lowest if lowest > 0 else None,
        highest=highest if highest > 0 else None,
        damping=_damping(deck, said),
        gravity=0.0 - length * np.array([*deck.said.get("ACEL", []), 0.0, 0.0, 0.0][:3]),  # ACEL accelerates the ground
        said=tuple(said),
    )
    b.cases += [] if case.is_empty else [case]


def _damping(deck: Deck, said: list[str]) -> Damping | None:
    """Return the damping of the whole, or that of the materials where all have the same; Rayleigh's before ratios."""
    own = {label: deck.said[name][0] for name, label in WHOLE.items() if any(deck.said.get(name, [])[:1])}
    if not own:
        found = [
            {label: x for name, x in of.items() if (label := OLD.get(name, name)) in WHOLE.values() and x}
            for of in deck.materials.values()
        ]
        if any(one != found[0] for one in found):
            said.append("materials have damping of their own each, which is not used")
            return None
        own = found[0] if found else {}
    if "ALPD" in own or "BETD" in own:
        return {"alpha": own.get("ALPD", 0.0), "beta": own.get("BETD", 0.0)}
    return own.get("DMPR", 0.0) + own.get("DMPS", 0.0) / 2 or None  # structural damping is twice the ratio
