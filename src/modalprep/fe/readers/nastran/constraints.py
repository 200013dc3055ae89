"""Nastran constraints that are not links: RBAR, RBE1 and RROD of any components, MPC and MPCADD, RBE3 with UM."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from modalprep.fe.links.components import oblique
from modalprep.fe.mesh.mesh import Equation, Link
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.case_control import case_control

LISTS = ("MPC", "MPCADD")
SINGULAR = 1e-9  # of the independent components of a rigid element, over its size
ALL = "123456"
LINE = 1e-6  # of the length of a row of grids
Named = list[tuple[int, int]]  # components 0 to 5 of nodes
Measured = list[tuple[int, int, float]]  # with weights


def digits_of(card: Card, text: str) -> set[str]:
    """Return the digits of components such as 123."""
    if not text or set(text) - set(ALL):
        raise card.error(f"components {text!r} are not made of the digits 1 to 6; give such as 123456")
    return set(text)


def components_of(card: Card, text: str) -> np.ndarray:
    """Return which of the six components ``(6,) bool`` a text such as 123 names."""
    named = digits_of(card, text)
    return np.array([c in named for c in ALL])


def made_link(b: Builder, card: Card, kind: str, node: int, nodes: list[int], mask, axes, weights=()) -> Link:
    """Return a link, with axes only where its components need them."""
    if not nodes or node in nodes or len(set(nodes)) < len(nodes):
        raise card.error("it joins no grids, or one grid twice; name every grid once")
    axes = axes if np.any(oblique(np.atleast_2d(mask), axes)) else np.zeros((0, 3, 3))
    weights = np.array(weights, dtype=float)
    return Link(kind=kind, node=node, nodes=np.array(nodes), components=mask, weights=weights, axes=axes)


def rigid_link(b: Builder, card: Card, node: int, nodes: list[int], mask: np.ndarray) -> None:
    """Add a link whose `nodes` follow `node` in the components ``mask (k, 6)`` of their displacement systems."""
    axes = np.array([b.grids.displacement(other) for other in nodes]).reshape(-1, 3, 3)
    same = len(mask) > 0 and np.all(mask == mask[0])
    b.links.append(made_link(b, card, "rbe2", node, nodes, mask[0] if same else mask, axes))


def pairs(card: Card, words: list[str]) -> list[tuple[int, str]]:
    """Return pairs of a grid's number and components."""
    inner = Card(card.name, words, card.file, card.line)
    return [(inner.integer(k, "a grid", lowest=1), inner.text(k + 1)) for k in range(0, len(words), 2)]


def rbar(b: Builder, card: Card) -> None:
    """RBAR: what CMA and CMB leave blank depends, unless it is independent by CNA or CNB."""
    ends = [b.grids.node(card, k, f"G{end}") for k, end in ((1, "A"), (2, "B"))]
    free, held = ([text if text != "0" else "" for text in (card.text(k), card.text(k + 1))] for k in (3, 5))
    if not any(held):
        held = ["".join(sorted(set(ALL) - set(text))) for text in free]
    _rigid(b, card, _named(card, zip(ends, free, strict=True)), _named(card, zip(ends, held, strict=True)))


def rbe1(b: Builder, card: Card) -> None:
    """RBE1: pairs of grid and independent components, then UM and pairs of grid and dependent ones; ALPHA ends it."""
    words = [text for text in card.fields[1:] if text]
    words = words[:-1] if words and "." in words[-1] else words  # ALPHA
    if "UM" not in words:
        raise card.error("its UM is missing; write UM, then grids and their dependent components")
    cut = words.index("UM")
    named = (
        _named(card, ((b.grids.of(card, n), text) for n, text in pairs(card, w)))
        for w in (words[:cut], words[cut + 1 :])
    )
    _rigid(b, card, *named)


def rrod(b: Builder, card: Card) -> None:
    """RROD: its length does not change; which of its components depends makes no difference."""
    ends = [b.grids.node(card, k, f"G{end}") for k, end in ((1, "A"), (2, "B"))]
    along = np.subtract(*b.grids.points[ends[::-1]])
    length = np.linalg.norm(along)
    if not length > 0:
        raise card.error("its ends are in one place; move one, or use an RBAR")
    ends = ends[::-1] if card.text(4) not in ("", "0") else ends
    coefficients = np.zeros((2, 6))
    coefficients[:, :3] = along / length, -along / length
    b.equations.append(Equation(nodes=np.array(ends), coefficients=coefficients, name=place_of(card)))


def place_of(card: Card) -> str:
    """Return card, number and line for messages."""
    return f"{card.name} {card.text(0)} ({card.file} line {card.line})"


def _named(card: Card, found: Iterable[tuple[int, str]]) -> Named:
    return [(node, int(digit) - 1) for node, text in found if text for digit in sorted(digits_of(card, text))]


def _rigid(b: Builder, card: Card, independent: Named, dependent: Named) -> None:
    """Add a rigid body: its motion is that of the six `independent` components, the `dependent` ones follow it."""
    if len(independent) != 6 or set(independent) & set(dependent) or not dependent:
        raise card.error(
            f"it has {len(independent)} independent and {len(dependent)} dependent components; give six that are "
            "independent, and others that depend"
        )
    nodes = {node for node, _ in independent}
    if len(nodes) == 1 and nodes.isdisjoint(node for node, _ in dependent):
        others = list(dict.fromkeys(node for node, _ in dependent))
        mask = np.array([[(node, c) in dependent for c in range(6)] for node in others])
        rigid_link(b, card, nodes.pop(), others, mask)
        return
    points = b.grids.points * b.units.length
    centre = points[[node for node, _ in independent]].mean(axis=0)
    size = np.abs(points[[node for node, _ in independent + dependent]] - centre).max() or 1.0
    motion, own = (
        np.array([_row(b, points[n] - centre, n, c, size) for n, c in named]) for named in (independent, dependent)
    )
    if np.linalg.svd(motion, compute_uv=False)[-1] < SINGULAR:
        raise card.error("its six independent components do not determine a rigid motion; choose others")
    for (node, component), row in zip(dependent, np.linalg.solve(motion.T, own.T).T, strict=True):
        scale = [1.0 if c < 3 else size for _, c in independent]
        terms = [(node, component, 1.0 if component < 3 else size)]
        terms += [(n, c, -v * s) for (n, c), v, s in zip(independent, row, scale, strict=True) if abs(v) > SINGULAR]
        axes = {n: b.grids.displacement(n) for n, _, _ in terms}
        b.equations.append(Equation.of_terms(terms, length=1.0, name=place_of(card), axes=axes))


def _row(b: Builder, arm: np.ndarray, node: int, component: int, size: float) -> np.ndarray:
    """Component of a node, a rotation times `size`, by the rigid translation and rotation times `size` (6,)."""
    e = b.grids.displacement(node)[component % 3]
    return np.concatenate([e, np.cross(arm, e) / size] if component < 3 else [np.zeros(3), e])


def add_equations(b: Builder, path: Path) -> None:
    """Add the equations of the set of MPC that the deck's case control selects, or of its only one."""
    cards = list(b.tables.get("MPC", {}).values())
    joined = {card.id: card.numbers(1, "a set", b.grids.ids) for card in b.tables.get("MPCADD", {}).values()}
    wanted = selected(b, path, "MPC", cards, joined)
    parts = {number for chosen in wanted for number in joined.get(chosen, [chosen])}
    chosen = [card for card in cards if card.id in parts]
    _refuse_joined_points(b, chosen)
    chosen = _without_definitions(b, chosen)
    b.equations += [_equation(b, card) for card in chosen]


def _refuse_joined_points(b: Builder, cards: list[Card]) -> None:
    """Refuse springs and masses of scalar points that equations join to grids."""
    joined = {term[0]: card for card in cards for term in _terms(card)}
    for card, points in b.apart:
        for point in points:
            if str(point) in joined:
                raise card.error(
                    f"it acts on scalar point {point}, which {place_of(joined[str(point)])} joins to grids; a scalar "
                    f"point has no position in the body: use springs and masses at grids, or ignore = ['{card.name}']"
                )


def _without_definitions(b: Builder, cards: list[Card]) -> list[Card]:
    """Leave out equations that only say what a scalar point is, which no other equation has."""
    points = [[int(n) for n, *_ in _terms(card) if n.isdigit() and b.grids.is_scalar(int(n))] for card in cards]
    while True:
        count = Counter(point for named in points for point in named)
        alone = [any(count[point] == 1 for point in named) for named in points]
        if not any(alone):
            return cards
        b.conversion.note("equations that only define a scalar point (MPC) are left out")
        cards = [card for card, out in zip(cards, alone, strict=True) if not out]
        points = [named for named, out in zip(points, alone, strict=True) if not out]


def _terms(card: Card) -> Iterator[list[str]]:
    """Yield grid, component and coefficient of each term as text."""
    for k in (k for row in range(card.rows) for k in (8 * row + 1, 8 * row + 4)):
        if any(card.fields[k : k + 3]):
            yield [card.text(k), card.text(k + 1), card.text(k + 2)]


def selected(b: Builder, path: Path, name: str, cards: list[Card], joined: dict[int, list[int]]) -> list[int]:
    """Return the set of MPC or NSM that the case control selects, or the only one of a deck of bulk data alone."""
    known = list(dict.fromkeys([*joined, *(card.id for card in cards)]))
    if not known:
        return []
    subcases = case_control(path)
    numbers = [subcase.selected(name) for subcase in subcases or ()]
    chosen = list(dict.fromkeys(number for number in numbers if number is not None))
    if subcases is None:
        within = {number for numbers in joined.values() for number in numbers}
        chosen = [number for number in known if number not in within]
        if len(chosen) > 1:
            raise cards[0].error(
                f"of the {name} sets {_list(chosen)} none is selected; write {name} = {chosen[0]} before BEGIN BULK"
            )
    if not chosen:
        b.conversion.note(f"{name} sets {_list(known)} are left out, because the case control selects none")
    if len(chosen) > 1:
        b.conversion.note(f"subcases select the {name} sets {_list(chosen)}: set {chosen[0]} is used")
    return chosen[:1]


def _list(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers[:8])) + ", ..." * (len(numbers) > 8)


def _equation(b: Builder, card: Card) -> Equation:
    terms = []
    for words in _terms(card):
        term = Card(card.name, words, card.file, card.line)
        node = b.grids.node(term, 0, "a grid")
        component = term.integer(1, "its component", lowest=1)
        if component > 6:
            raise card.error(f"component {component} is not one of 1 to 6")
        terms.append((node, component - 1, term.real(2, "a coefficient")))
    if not terms or not terms[0][2]:
        raise card.error("its first coefficient is missing or zero; that grid and component is to depend on the others")
    axes = {node: b.grids.displacement(node) for node, _, _ in terms}
    return Equation.of_terms(terms, length=b.units.length, name=place_of(card), axes=axes)


def mean_equations(b: Builder, card: Card, link: Link, measured: Measured, dependent: Iterable[int] = ()) -> None:
    """Add the equations of an averaging link whose nodes count with components of any kind.

    Weighted least squares; rotations have the weight of translations times the square of the mean arm. The grids of
    the numbers `dependent` depend in the first place, else the link's own.

    References
    ----------
    MSC Nastran 2004 Reference Manual, section on RBE3.
    """
    points = b.grids.points * b.units.length
    own = link.node
    arm = points[[node for node, _, _ in measured]] - points[own]
    size = np.linalg.norm(arm, axis=1).mean() or 1.0
    S = np.array([_row(b, r, node, c, size) for r, (node, c, _) in zip(arm, measured, strict=True)])
    weighted = S.T * [weight for _, _, weight in measured]
    normal = weighted @ S
    if np.linalg.eigvalsh(normal)[0] < SINGULAR * np.trace(normal):
        raise card.error("its grids and components do not determine a rigid motion; add grids, or components 456")
    scale = np.array([1.0] * 3 + [size] * 3)  # of a rotation, which is counted as a displacement at the mean arm
    mean = np.linalg.solve(normal, weighted) / scale[:, None] * scale[[c for _, c, _ in measured]]
    axes = {node: b.grids.displacement(node) for node in {own, *(node for node, _, _ in measured)}}
    first = {b.grids.of(card, number) for number in dependent}
    turned = np.kron(np.eye(2), axes[own]) @ mean
    for c in np.flatnonzero(link.components):
        terms = [(own, int(c), 1.0), *((node, k, -v) for (node, k, _), v in zip(measured, turned[c], strict=True))]
        terms.sort(key=lambda term: term[0] not in first)
        b.equations.append(Equation.of_terms(terms, length=1.0, name=place_of(card), axes=axes))


def is_line(b: Builder, nodes: list[int]) -> bool:
    """Whether grids lie on one line, so that their displacements do not determine a rotation."""
    spread = np.linalg.svd(b.grids.points[nodes] - b.grids.points[nodes].mean(axis=0), compute_uv=False)
    return len(nodes) < 3 or bool(spread[1] <= LINE * spread[0])
