"""Nastran rigid elements to links, constraint sets to vertex groups."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from modalprep.fe.mesh.mesh import SupportSet
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.constraints import (
    components_of,
    digits_of,
    is_line,
    made_link,
    mean_equations,
    pairs,
    rbar,
    rbe1,
    rigid_link,
    rrod,
)
from modalprep.fe.readers.nastran.spline import rspline

SUPPORTS = ("SPC", "SPC1")
NODE_SETS = ("SUPORT", "SUPORT1", "ASET", "ASET1", "BSET", "BSET1", "CSET", "CSET1", "QSET", "QSET1")


def _rbe2(b: Builder, card: Card) -> None:
    last = Card(card.name, card.fields[:-1], card.file, card.line) if "." in card.fields[-1] else card  # ALPHA
    node = b.grids.node(card, 1, "GN")
    nodes = [b.grids.of(card, number) for number in last.numbers(3, "GM", b.grids.ids)]
    rigid_link(b, card, node, nodes, np.tile(components_of(card, card.text(2)), (len(nodes), 1)))


def _rbe3(b: Builder, card: Card) -> None:
    """REFGRID and REFC, then groups of weight, components, grids; UM and ALPHA end the list."""
    node = b.grids.node(card, 2, "REFGRID")
    words = [text for text in card.fields[4:] if text]
    words = words[: words.index("ALPHA")] if "ALPHA" in words else words
    stop = words.index("UM") if "UM" in words else len(words)
    nodes, weights, digits = [], [], []
    starts = [i for i, w in enumerate(words[:stop]) if "." in w] + [stop]
    if starts[0] or stop == 0:
        raise card.error("the weight before its components and grids is missing; write it with a decimal point")
    for k, end in pairwise(starts):
        group = Card(card.name, words[k:end], card.file, card.line)
        found = [b.grids.of(card, number) for number in group.numbers(2, "a grid", b.grids.ids)]
        nodes = nodes + found
        weights = weights + [group.real(0, "a weight")] * len(found)
        digits += [sorted(digits_of(card, group.text(1)))] * len(found)
    mask = components_of(card, card.text(3))
    axes = b.grids.displacement(node)[None]
    link = made_link(b, card, "rbe3", node, nodes, mask, axes, weights)
    dependent = [number for number, _ in pairs(card, words[stop + 1 :])]
    plain = all(digit == ["1", "2", "3"] for digit in digits)
    whole = all(digit == list("123456") for digit in digits) and not is_line(b, nodes)
    if dependent or not (plain or whole):
        measured = [(n, int(c) - 1, w) for n, w, own in zip(nodes, weights, digits, strict=True) for c in own]
        mean_equations(b, card, link, measured, dependent)
        return
    if plain and mask[3:].any() and is_line(b, nodes):
        raise card.error(
            f"its {len(nodes)} grids lie on one line, so that components 123 determine no rotation of grid "
            f"{card.text(2)}; add grids off that line, or components 456"
        )
    if not plain:
        b.conversion.note("RBE3: every independent grid counts with components 123")
    b.links.append(link)


HANDLERS: dict[str, Callable[[Builder, Card], None]] = {
    "RBE2": _rbe2,
    "RBE3": _rbe3,
    "RBAR": rbar,
    "RBE1": rbe1,
    "RROD": rrod,
    "RSPLINE": rspline,
}


def add_node_sets(b: Builder) -> None:
    """Add the vertex groups of SPC, PS of GRID, ASET, BSET, QSET, CSET and SUPORT."""
    sets: dict[str, set[int]] = {}
    for label, held in _supports(b).items():
        if held:
            b.supports[label] = _support_set(b, held)
        for group, node in _by_components(b, label, held):
            sets.setdefault(group, set()).add(node)
    for name in NODE_SETS:
        for card in b.tables.get(name, {}).values():
            sets.setdefault(name.rstrip("1").lower(), set()).update(_set_nodes(b, card))
    for label, nodes in sets.items():
        for node in sorted(nodes):
            b.append("vertex", [node], label)


def _supports(b: Builder) -> dict[str, dict[int, set[str]]]:
    """Return which components of which grids each set holds."""
    found: dict[str, dict[int, set[str]]] = {"grid_ps": {}}
    for node, text in b.grids.fixed.items():
        found["grid_ps"][node] = digits_of(b.grids.card(node), text)
    for card in (card for name in SUPPORTS for card in b.tables.get(name, {}).values()):
        held = found.setdefault(f"spc_{card.id}", {})
        for number, text in _held_by(b, card):
            if not _is_no_structure(b, number):
                held.setdefault(b.grids.of(card, number), set()).update(digits_of(card, text))
    for card in b.tables.get("SPCADD", {}).values():
        joined = found.setdefault(f"spc_{card.id}", {})
        for part in (f"spc_{number}" for number in card.numbers(1, "a set", b.grids.ids)):
            for node, components in list(found.get(part, {}).items()):
                joined.setdefault(node, set()).update(components)
    return found


def _held_by(b: Builder, card: Card) -> Iterator[tuple[int, str]]:
    """Yield the grids and components of SPC and SPC1; a displacement that is not zero is left out with a note."""
    if card.name == "SPC1":
        yield from ((number, card.text(1)) for number in card.numbers(2, "a grid", b.grids.ids))
        return
    for k in (k for k in range(1, len(card.fields), 3) if card.text(k)):
        number = card.integer(k, "a grid", lowest=1)
        if moved := card.real(k + 2, "D", 0.0):
            where = f"SPC {card.id} ({card.file} line {card.line})"
            b.conversion.note(f"{where}: the displacement {moved:g} of grid {number} is left out; give it as a motion")
        yield number, card.text(k + 1)


def _support_set(b: Builder, fixed: dict[int, set[str]]) -> SupportSet:
    nodes = sorted(fixed)
    return SupportSet(
        nodes=np.array(nodes),
        components=np.array([[c in fixed[node] for c in "123456"] for node in nodes]),
        axes=np.array([b.grids.displacement(node) for node in nodes]),
    )


def _by_components(b: Builder, label: str, fixed: dict[int, set[str]]) -> Iterator[tuple[str, int]]:
    """Yield the groups and their grids: those held in some components only are apart, because interfaces hold six."""
    apart: dict[str, list[int]] = {}
    for node, components in sorted(fixed.items()):
        if len(components) == 6:
            yield label, node
        else:
            apart.setdefault("".join(sorted(components)), []).append(node)
            yield f"{label}_{''.join(sorted(components))}", node
    for digits, nodes in apart.items():
        b.conversion.note(
            f"{label} holds only components {digits} of {len(nodes)} grids, the first is grid {b.grids.ids[nodes[0]]}: "
            f"they are the group {label}_{digits} and not in {label}, because an interface holds all six; a support by "
            f"set {label!r} holds them by component"
        )


def _is_no_structure(b: Builder, number: int) -> bool:
    return b.grids.is_scalar(number) or b.grids.is_fluid(number)


def _set_nodes(b: Builder, card: Card) -> list[int]:
    """Return the grids of a set card: components first and a list of ids, or pairs of id and components."""
    first = int(card.name == "SUPORT1")
    if card.name in ("ASET1", "BSET1", "CSET1", "QSET1"):
        numbers = card.numbers(1, "a grid", b.grids.ids)
    else:
        numbers = [card.integer(k, "a grid", lowest=1) for k in range(first, len(card.fields), 2) if card.text(k)]
    return [b.grids.of(card, number) for number in numbers if not _is_no_structure(b, number)]
