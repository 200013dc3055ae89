"""Nastran multi-point constraints to equations: MPC and MPCADD, and RBE3 whose dependent components UM names."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from modalprep.fe.links.multipoint import PlacedLink
from modalprep.fe.mesh.mesh import Equation, Link
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import BEGIN, Card
from modalprep.fe.readers.nastran.rigid import place_of

LISTS = ("MPC", "MPCADD")
SELECTS = re.compile(r"^\s*MPC\s*=\s*(\d+)", re.IGNORECASE | re.MULTILINE)


def add_equations(b: Builder, path: Path) -> None:
    """Add the equations of the set of MPC that the deck's case control selects, or of its only one."""
    cards = list(b.tables.get("MPC", {}).values())
    joined = {card.id: card.numbers(1, "a set", b.grids.ids) for card in b.tables.get("MPCADD", {}).values()}
    wanted = _selected(b, path, cards, joined)
    parts = {number for chosen in wanted for number in joined.get(chosen, [chosen])}
    b.equations += [_equation(b, card) for card in cards if card.id in parts]


def _selected(b: Builder, path: Path, cards: list[Card], joined: dict[int, list[int]]) -> list[int]:
    known = list(dict.fromkeys([*joined, *(card.id for card in cards)]))
    if not known:
        return []
    control = _case_control(path)
    chosen = list(dict.fromkeys(int(number) for number in SELECTS.findall(control or "")))
    if control is None:
        within = {number for numbers in joined.values() for number in numbers}
        chosen = [number for number in known if number not in within]
        if len(chosen) > 1:
            raise cards[0].error(
                f"of the MPC sets {_list(chosen)} none is selected; write MPC = {chosen[0]} before BEGIN BULK"
            )
    if not chosen:
        b.conversion.note(f"MPC sets {_list(known)} are left out, because the case control selects none")
    if len(chosen) > 1:
        b.conversion.note(f"subcases select the MPC sets {_list(chosen)}: set {chosen[0]} is used")
    return chosen[:1]


def _list(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers[:8])) + ", ..." * (len(numbers) > 8)


def _case_control(path: Path) -> str | None:
    """Return what stands before BEGIN BULK; None in a deck of bulk data alone."""
    lines = path.read_text(encoding="latin-1").splitlines()
    start = next((k for k, line in enumerate(lines) if BEGIN.match(line)), None)
    return None if start is None else "\n".join(line.split("$", 1)[0] for line in lines[:start])


def _equation(b: Builder, card: Card) -> Equation:
    terms = []
    for row in range(card.rows):
        for k in (8 * row + 1, 8 * row + 4):
            if not any(card.fields[k : k + 3]):
                continue
            node = b.grids.node(card, k, "a grid")
            component = card.integer(k + 1, "its component", lowest=1)
            if component > 6:
                raise card.error(f"component {component} is not one of 1 to 6")
            terms.append((node, component - 1, card.real(k + 2, "a coefficient")))
    if not terms or not terms[0][2]:
        raise card.error("its first coefficient is missing or zero; that grid and component is to depend on the others")
    axes = {node: b.grids.displacement(node) for node, _, _ in terms}
    return Equation.of_terms(terms, length=b.units.length, name=place_of(card), axes=axes)


def mean_equations(b: Builder, card: Card, link: Link, dependent: list[int]) -> None:
    """Add the equations of an averaging link of which the grids of numbers `dependent` follow, not its own node."""
    points = b.grids.points * b.units.length
    k = len(link.nodes)
    arm, dofs = points[link.nodes] - points[link.node], np.full((k, 6), -1)
    every = np.ones(6, dtype=bool)
    placed = PlacedLink("rbe3", place_of(card), np.arange(6), dofs, arm, every, link.weights, False)
    mean = placed.average()[0].reshape(6, k, 3)
    turn = np.kron(np.eye(2), link.axes[0] if len(link.axes) else np.eye(3))
    first = [b.grids.of(card, number) for number in dependent]
    order = np.argsort(~np.isin(link.nodes, first), kind="stable")
    for c in np.flatnonzero(link.components):
        coefficients = np.zeros((k + 1, 6))
        coefficients[:k, :3] = -np.einsum("a,aij->ij", turn[c], mean)[order]
        coefficients[k] = turn[c]
        nodes = np.append(link.nodes[order], link.node)
        b.equations.append(Equation(nodes=nodes, coefficients=coefficients, name=place_of(card)))
