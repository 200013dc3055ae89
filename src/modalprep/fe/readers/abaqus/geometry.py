"""Nodes of a deck: listed, on lines and arcs, between sets, and copied."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.fe.readers.abaqus.deck import LABEL, Deck
from modalprep.fe.readers.abaqus.lexer import Block, Numbers, Row

MOST = 1_000_000  # nodes that one line may make


def label_of(row: Row, k: int, what: str) -> int:
    """Return the number in field `k`."""
    if not LABEL.fullmatch(row.text(k)):
        raise row.error(f"{what} {', '.join(row.fields)[:60]!r} begins with no number; repair the line")
    return int(row.text(k))


def system(deck: Deck, block: Block) -> None:
    """``*SYSTEM``: axes of the coordinates that follow, by the origin, a point on x and one in the plane x y."""
    if not block.rows:
        deck.systems.pop(block.scope, None)
        return
    values = np.array(block.joined().reals(0, 9, "a coordinate")).reshape(3, 3)
    a, b, c = values
    if len(block.rows) < 2:  # the new z axis is the global one
        x = (b - a) * (1.0, 1.0, 0.0)
        c = a + np.cross((0.0, 0.0, 1.0), x)
    deck.systems[block.scope] = (a, frame(block, b - a, c - a))


def frame(block: Block | Row, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the axes (rows) with e1 along `x` and e2 in the plane of `x` and `y`."""
    z = np.cross(x, y)
    if not np.linalg.norm(z) > 1e-9 * np.linalg.norm(x) * np.linalg.norm(y):
        raise block.error("has points on one line, which give no axes; give three points that span a plane")
    axes = np.array([x, np.cross(z, x), z])
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def nodes(deck: Deck, block: Block) -> None:
    """``*NODE``."""
    kind = block.choice("SYSTEM", "R") or "R"
    if kind not in ("R", "C", "S"):
        block.refuse(f"has SYSTEM={kind}; known are R, C and S")
    members = deck.members("NSET", block.scope, block.options["NSET"]) if block.options.get("NSET") else []
    if block.numbers and (labels := _many(deck, block, block.numbers, kind)) is not None:
        members.append((block.scope, labels))
        block.numbers = None  # their memory is free
        return
    for row in block.rows:
        label = label_of(row, 0, "node")
        deck.add_node(row, block.scope, label, _global(deck, block.scope, kind, _coordinates(row, label)))
        members.append((block.scope, label))
        if any(row.fields[4:7]):
            deck.skipped.append(("normals in lines of *NODE", f"line {row.line}"))


def _many(deck: Deck, block: Block, numbers: Numbers, kind: str) -> np.ndarray | None:
    """Add nodes whose lines are numbers, and return their labels; None where one of them has no number of its own."""
    table = numbers.values.reshape(len(numbers.counts), -1)
    if not (table[:, 0] >= 0).all() or not np.isnan(table[:, 4:7]).all():
        return None
    labels = table[:, 0].astype(int)
    if not deck.numbered.add_block(block.scope, labels):
        return None
    points = np.zeros((len(table), 3))
    given = table[:, 1:4]
    points[:, : given.shape[1]] = np.nan_to_num(given)
    if kind != "R" or block.scope in deck.systems or block.scope in deck.parts.moves:
        points = np.array([_global(deck, block.scope, kind, point) for point in points])
    deck.points.extend(points)
    return labels


def _global(deck: Deck, scope: str, kind: str, point: np.ndarray) -> np.ndarray:
    """Return a point of a line of *NODE in global axes."""
    point = _local(kind, point)
    if scope in deck.systems:
        origin, axes = deck.systems[scope]
        point = origin + point @ axes
    return deck.placed(scope, point)


def _coordinates(row: Row, label: int) -> np.ndarray:
    try:
        x, y, z = (float(text or 0.0) for text in (*row.fields[1:4], "", "", "")[:3])
    except ValueError:  # the exponents of Fortran, or no number
        x, y, z = (row.real(k, f"coordinate {k} of node {label}", 0.0) for k in (1, 2, 3))
    if not math.isfinite(x + y + z):
        x, y, z = (row.real(k, f"coordinate {k} of node {label}", 0.0) for k in (1, 2, 3))
    return np.array([x, y, z])


def _local(kind: str, x: np.ndarray) -> np.ndarray:
    """Return Cartesian coordinates of r, theta, z (degrees) or of r, theta, phi."""
    if kind == "R":
        return x
    theta = np.radians(x[1])
    if kind == "C":
        return np.array([x[0] * np.cos(theta), x[0] * np.sin(theta), x[2]])
    phi = np.radians(x[2])
    return x[0] * np.array([np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)])


def ngen(deck: Deck, block: Block) -> None:
    """``*NGEN``: nodes between two, on a line, a parabola through a third, or an arc about a third."""
    kind = block.choice("LINE")
    scope = block.scope
    if kind not in ("", "C", "P") or "SYSTEM" in block.options:
        block.refuse("has a SYSTEM or a LINE other than C and P; list the nodes")
    for row in block.rows:
        first = label_of(row, 0, "first node")
        last = label_of(row, 1, "last node")
        step = row.integer(2, "step", 1)
        step = step or 1
        if (last - first) % step or (last - first) // step < 1 or (last - first) // step > MOST:
            raise row.error(f"the numbers from {first} to {last} are not reached in steps of {step}; correct them")
        count = (last - first) // step
        s = np.arange(1, count)[:, None] / count
        ends = [deck.points[deck.node(row, scope, str(label))] for label in (first, last)]
        made = ends[0] + s * (ends[1] - ends[0]) if not kind else _curve(deck, row, scope, kind, ends, s)
        for k, point in enumerate(made, 1):
            deck.add_node(row, scope, first + k * step, point)
        if block.options.get("NSET"):
            members = deck.members("NSET", scope, block.options["NSET"])
            members += [(scope, first + k * step) for k in range(count + 1)]


def _curve(deck: Deck, row: Row, scope: str, kind: str, ends: list[np.ndarray], s: np.ndarray) -> np.ndarray:
    third = (
        deck.points[deck.node(row, scope, row.text(3))]
        if row.text(3) not in ("", "0")
        else deck.placed(scope, np.array(row.reals(4, 3, "a coordinate")))
    )
    if kind == "P":
        return ends[0] * (1 - s) * (1 - 2 * s) + third * 4 * s * (1 - s) + ends[1] * s * (2 * s - 1)
    a, b = ends[0] - third, ends[1] - third
    normal = deck.turned(scope, np.array(row.reals(7, 3, "a normal")))
    normal = normal if normal.any() else np.cross(a, b)
    size = np.linalg.norm(normal)
    if not size > 1e-9 * np.linalg.norm(a) * np.linalg.norm(b):
        raise row.error("the arc is a half circle or has no radius; give the normal of its plane in fields 8 to 10")
    normal = normal / size
    angle = np.arctan2(np.cross(a, b) @ normal, a @ b) % (2 * np.pi)
    radius = 1 + s * (np.linalg.norm(b) / np.linalg.norm(a) - 1)
    return third + radius * Rotation.from_rotvec(s * angle * normal).apply(a)


def nfill(deck: Deck, block: Block) -> None:
    """``*NFILL``: rows of nodes between the nodes of two sets."""
    if set(block.options) & {"BIAS", "SINGULAR", "TWO STEP"}:
        block.refuse("fills unevenly (BIAS or SINGULAR); list the nodes")
    for row in block.rows:
        first, last = (deck.nodes_of(row, block.scope, row.text(k)) for k in (0, 1))
        count = row.integer(2, "number of intervals")
        step = row.integer(3, "step", 1)
        if len(first) != len(last) or not 1 <= count <= MOST:
            raise row.error(f"fills between {len(first)} and {len(last)} nodes in {count} intervals; give equal sets")
        _fill(deck, block, row, (first, last), count, step)


def _fill(deck: Deck, block: Block, row: Row, ends: tuple[list[int], list[int]], count: int, step: int) -> None:
    members = deck.members("NSET", block.scope, block.options["NSET"]) if block.options.get("NSET") else []
    for a, b in zip(*ends, strict=True):
        members += [(block.scope, deck.keys[i][1]) for i in (a, b)]
        for k in range(1, count):
            point = deck.points[a] + k / count * (deck.points[b] - deck.points[a])
            deck.add_node(row, block.scope, deck.keys[a][1] + k * step, point)
            members.append((block.scope, deck.keys[a][1] + k * step))


def ncopy(deck: Deck, block: Block) -> None:
    """``*NCOPY, SHIFT``: copies of a set, shifted, then turned about a line."""
    if set(block.options) & {"POLE", "REFLECT", "MULTIPLE"}:
        block.refuse("has POLE, REFLECT or MULTIPLE; only SHIFT is read")
    step = Row([block.option("CHANGE NUMBER")], block.file, block.line).integer(0, "CHANGE NUMBER")
    shift = np.array(block.row(0).reals(0, 3, "a shift"))
    row = block.row(1)
    a = np.array(row.reals(0, 3, "a"))
    b = np.array(row.reals(3, 3, "b"))
    angle = row.real(6, "an angle", 0.0)
    length = np.linalg.norm(b - a)
    turn = Rotation.from_rotvec(np.radians(angle) * (b - a) / (length or 1.0)).as_matrix()
    own, moved = deck.parts.moves.get(block.scope, (np.eye(3), np.zeros(3)))
    members = deck.members("NSET", block.scope, block.options["NEW SET"]) if block.options.get("NEW SET") else []
    for index in deck.nodes_of(block, block.scope, block.option("OLD SET")):
        local = own.T @ (deck.points[index] - moved)
        label = deck.keys[index][1] + step
        deck.add_node(block.row(0), block.scope, label, deck.placed(block.scope, a + turn @ (local + shift - a)))
        members.append((block.scope, label))
