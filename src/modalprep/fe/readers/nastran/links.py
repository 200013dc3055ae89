"""Nastran rigid elements to links, constraint sets to vertex groups."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from modalprep.fe.mesh.mesh import Link, SupportSet
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card

SUPPORTS = ("SPC", "SPC1")
NODE_SETS = ("SUPORT", "SUPORT1", "ASET", "ASET1", "BSET", "BSET1", "CSET", "CSET1", "QSET", "QSET1")


def _components(b: Builder, card: Card, text: str, nodes: list[int]) -> np.ndarray:
    """Return which of the six components a text such as 123 names; parts of a triple need basic axes."""
    named = _digits(card, text)
    mask = np.array([c in named for c in "123456"])
    whole = all(mask[s].all() or not mask[s].any() for s in (slice(3), slice(3, 6)))
    if not whole and any(not np.allclose(b.grids.displacement(i), np.eye(3), atol=1e-9) for i in nodes):
        raise card.error(f"components {text} refer to a displacement system CD; give 123, 456 or 123456")
    return mask


def _digits(card: Card, text: str) -> set[str]:
    if not text or set(text) - set("123456"):
        raise card.error(f"components {text!r} are not made of the digits 1 to 6; give such as 123456")
    return set(text)


def _rbe2(b: Builder, card: Card) -> None:
    last = Card(card.name, card.fields[:-1], card.file, card.line) if "." in card.fields[-1] else card  # ALPHA
    node = b.grids.node(card, 1, "GN")
    nodes = [b.grids.of(card, number) for number in last.numbers(3, "GM", b.grids.ids)]
    _link(b, card, "rbe2", node, nodes, _components(b, card, card.text(2), nodes))


def _link(b: Builder, card: Card, kind: str, node: int, nodes: list[int], mask: np.ndarray, weights=()) -> None:
    if not nodes or node in nodes or len(set(nodes)) < len(nodes):
        raise card.error("it joins no grids, or one grid twice; name every grid once")
    weights = np.array(weights, dtype=float)
    b.links.append(Link(kind=kind, node=node, nodes=np.array(nodes), components=mask, weights=weights))


def _rbar(b: Builder, card: Card) -> None:
    independent = [card.text(3), card.text(4)]
    rest = [text for text in card.fields[5:7] if text not in ("", "0", "123456")]
    if sorted(text if text != "0" else "" for text in independent) != ["", "123456"] or rest:
        raise card.error("it is not rigid from one end to the other; give CNA = 123456 and leave CNB, CMA, CMB blank")
    a, c = (b.grids.node(card, k, f"G{end}") for k, end in ((1, "A"), (2, "B")))
    node, follower = (a, c) if independent[0] == "123456" else (c, a)
    _link(b, card, "rbe2", node, [follower], np.ones(6, dtype=bool))


def _rbe3(b: Builder, card: Card) -> None:
    """REFGRID and REFC, then groups of weight, components, grids; UM and ALPHA end the list."""
    node = b.grids.node(card, 2, "REFGRID")
    words = [text for text in card.fields[4:] if text]
    stop = min((words.index(w) for w in ("UM", "ALPHA") if w in words), default=len(words))
    if "UM" in words:
        b.conversion.note("RBE3: the UM set is left out, the reference grid depends on the others")
    nodes, weights, k = [], [], 0
    starts = [i for i, w in enumerate(words[:stop]) if "." in w] + [stop]
    if starts[0] or stop == 0:
        raise card.error("the weight before its components and grids is missing; write it with a decimal point")
    for k, end in pairwise(starts):
        group = Card(card.name, words[k:end], card.file, card.line)
        if group.text(1) not in ("123", "123456"):
            b.conversion.note("RBE3: every independent grid counts with components 123")
        found = [b.grids.of(card, number) for number in group.numbers(2, "a grid", b.grids.ids)]
        nodes, weights = nodes + found, weights + [group.real(0, "a weight")] * len(found)
    _link(b, card, "rbe3", node, nodes, _components(b, card, card.text(3), [node]), weights)


HANDLERS: dict[str, Callable[[Builder, Card], None]] = {"RBE2": _rbe2, "RBE3": _rbe3, "RBAR": _rbar}


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
            rows = b.cells.setdefault("vertex", [])
            rows.append([node])
            b.groups.setdefault(label, {}).setdefault("vertex", []).append(len(rows) - 1)


def _supports(b: Builder) -> dict[str, dict[int, set[str]]]:
    """Return which components of which grids each set holds."""
    found: dict[str, dict[int, set[str]]] = {"grid_ps": {}}
    for node, text in b.grids.held.items():
        found["grid_ps"][node] = _digits(b.grids.cards[node], text)
    for card in (card for name in SUPPORTS for card in b.tables.get(name, {}).values()):
        held = found.setdefault(f"spc_{card.id}", {})
        for number, text in _held_by(b, card):
            if not _is_no_structure(b, number):
                held.setdefault(b.grids.of(card, number), set()).update(_digits(card, text))
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


def _support_set(b: Builder, held: dict[int, set[str]]) -> SupportSet:
    nodes = sorted(held)
    return SupportSet(
        nodes=np.array(nodes),
        components=np.array([[c in held[node] for c in "123456"] for node in nodes]),
        axes=np.array([b.grids.displacement(node) for node in nodes]),
    )


def _by_components(b: Builder, label: str, held: dict[int, set[str]]) -> Iterator[tuple[str, int]]:
    """Yield the groups and their grids: those held in some components only are apart, because interfaces hold six."""
    apart: dict[str, list[int]] = {}
    for node, components in sorted(held.items()):
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
