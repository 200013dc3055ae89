"""Couplings, rigid bodies, multi-point constraints, equations and supports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from modalprep.fe.links.mean_points import MeanPoints
from modalprep.fe.links.multipoint import PlacedLink
from modalprep.fe.mesh.mesh import Link
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.sets import faces_of, surface_nodes, surface_of

NAMED = {
    "ENCASTRE": "123456",
    "PINNED": "123",
    "XSYMM": "156",
    "YSYMM": "246",
    "ZSYMM": "345",
    "XASYMM": "234",
    "YASYMM": "135",
    "ZASYMM": "126",
    "NOWARP": "",
    "NOOVAL": "",
    "NODEFORM": "",
}
ROTATING = ("shell", "beam", "rotary inertia")  # families whose nodes have rotations


def components(row: Row, first: int) -> list[int]:
    """Return the components 0 to 5 from one field to the next; the second defaults to the first."""
    low = row.integer(first, "a component")
    high = row.integer(first + 1, "a component", low) or low
    if not 1 <= low <= high:
        raise row.error(f"the components {low} to {high} are not between 1 and 6; correct them")
    return [c - 1 for c in range(low, min(high, 6) + 1)]


def boundary(deck: Deck, block: Block) -> None:
    """``*BOUNDARY`` before the steps and in the first: components that are held."""
    if "SUBMODEL" in block.options:
        block.refuse("of a submodel is not read; hold its nodes by their numbers")
    if block.step and block.choice("OP") == "NEW":
        deck.fixed.clear()
    for row in block.rows:
        nodes = deck.nodes_of(row, block.scope, row.text(0))
        word = row.text(1).upper()
        if word in NAMED:
            held = [int(c) - 1 for c in NAMED[word]]
        elif row.text(1):
            held = components(row, 1)
        else:
            raise row.error("the line has no component; give such as 1, 3 or ENCASTRE")
        if row.text(3) and row.real(3, "a displacement"):
            deck.skipped.append(("displacement in *BOUNDARY, which is held at zero", f"line {row.line}"))
        for node in nodes:
            deck.fixed.setdefault(node, set()).update(held)


def equation(deck: Deck, block: Block) -> None:
    """``*EQUATION``: a count, then node or set, component and coefficient of each term."""
    k = 0
    while k < len(block.rows):
        count = block.row(k).integer(0, "number of terms")
        start = block.row(k)
        if not 1 <= count <= 100_000:
            raise start.error(f"an equation has {count} terms; give their number")
        fields: list[str] = []
        k += 1
        while len(fields) < 3 * count and k < len(block.rows):
            fields += block.row(k).fields[:-1] if not block.row(k).fields[-1] else block.row(k).fields
            k += 1
        row = Row(fields, start.file, start.line)
        if len(fields) < 3 * count:
            raise row.error(f"an equation of {count} terms has {len(fields)} fields; give node, component, coefficient")
        _equations(deck, block, row, count)


def _equations(deck: Deck, block: Block, row: Row, count: int) -> None:
    """One equation, or one for each node of its sets."""
    terms = [deck.nodes_of(row, block.scope, row.text(3 * i)) for i in range(count)]
    size = max(map(len, terms))
    if any(len(nodes) not in (1, size) for nodes in terms):
        raise row.error(f"its sets have {', '.join(str(len(nodes)) for nodes in terms)} nodes; give sets of one size")
    for n in range(size):
        found = []
        for i, nodes in enumerate(terms):
            component = row.integer(3 * i + 1, "a component")
            if not 1 <= component <= 6:
                raise row.error(f"component {component} is none of 1 to 6; correct it")
            found.append((nodes[n % len(nodes)], component - 1, row.real(3 * i + 2, "a coefficient")))
        deck.equations.append((found, f"*EQUATION in line {row.line}"))


def coupling(deck: Deck, block: Block) -> None:
    """``*COUPLING``: the nodes of a surface and a reference node; what follows says how they move together."""
    if "INFLUENCE RADIUS" in block.options:
        block.refuse("has an INFLUENCE RADIUS; give a surface of the nodes that it couples")
    name = block.options.get("REF NODE", "")
    nodes = deck.nodes_of(block, block.scope, name) if name else block.refuse("has no REF NODE; add it")
    if len(nodes) != 1:
        block.refuse(f"names {len(nodes)} nodes as REF NODE; give one")
    tied = [node for node in surface_nodes(deck, block, block.option("SURFACE")) if node != nodes[0]]
    if not tied:
        block.refuse("couples no nodes; give a surface with faces or nodes")
    deck.current.setdefault("couplings", {})[id(block)] = (nodes[0], tied)


def kinematic(deck: Deck, block: Block) -> None:
    """``*KINEMATIC``: the nodes follow the reference node rigidly, in some components along axes at each of them."""
    node, tied = _coupled(deck, block)
    mask = _mask(block)
    axes = _axes(deck, block, mask, tied)
    deck.links.append(Link(kind="rbe2", node=node, nodes=np.array(tied), components=mask, axes=axes))


def distributing(deck: Deck, block: Block) -> None:
    """``*DISTRIBUTING``: the reference node follows the mean motion of the faces; only its rotations may be free.

    Of faces every node has the weight of its area, in Abaqus (Analysis Guide, coupling constraints) as in CalculiX.
    """
    node, tied = _coupled(deck, block)
    mask = _mask(block)
    mask[:3] = True
    axes = _axes(deck, block, mask, [node])
    if block.choice("WEIGHTING METHOD", "UNIFORM") != "UNIFORM":
        block.refuse(f"has WEIGHTING METHOD={block.options['WEIGHTING METHOD']}; only UNIFORM is read")
    over = _cells(deck, block.owner or block, tied)
    deck.links.append(Link(kind="rbe3", node=node, nodes=np.array(tied), components=mask, over=over, axes=axes))


def _cells(deck: Deck, block: Block, tied: list[int]) -> dict[str, np.ndarray]:
    """Return the faces of the surface of a coupling; none of a surface that names further nodes."""
    found: dict[str, list] = {}
    for kind, nodes in faces_of(deck, block, surface_of(deck, block, block.option("SURFACE"))):
        found.setdefault(kind, []).append(nodes)
    cells = {kind: np.array(nodes) for kind, nodes in found.items()}
    used = {node for conn in cells.values() for node in conn.ravel().tolist()}
    return cells if used == set(tied) else {}


def mean_terms(deck: Deck, link: Link) -> Iterator[list[tuple[int, int, float]]]:
    """Yield the terms of the equations of an averaging link whose node something else holds."""
    points = np.array(deck.points)
    arm = points[link.nodes] - points[link.node]
    every = np.ones(6, dtype=bool)
    dofs = np.full((len(arm), 6), -1)
    name = "*DISTRIBUTING"
    over = MeanPoints.over(points, link.nodes, link.over) if link.over else None
    placed = PlacedLink("rbe3", name, np.arange(6), dofs, arm, every, link.weights, False, mean_points=over)
    mean = placed.average()[0]
    for c in np.flatnonzero(link.components):
        rows = mean[c].reshape(-1, 3)
        terms = [(int(n), k, -float(x)) for n, row in zip(link.nodes, rows, strict=True) for k, x in enumerate(row)]
        yield [(link.node, int(c), 1.0), *terms]


def _coupled(deck: Deck, block: Block) -> tuple[int, list[int]]:
    if block.owner is None or block.owner.keyword != "COUPLING":
        block.refuse("stands behind no *COUPLING; put it there")
    deck.current.setdefault("coupled", set()).add(id(block.owner))
    return deck.current["couplings"][id(block.owner)]


def _mask(block: Block) -> np.ndarray:
    mask = np.zeros(6, dtype=bool)
    for row in block.rows:
        if row.text(0):
            mask[components(row, 0)] = True
    return mask if mask.any() else ~mask


def _axes(deck: Deck, block: Block, mask: np.ndarray, nodes: Sequence[int]) -> np.ndarray:
    """Return the axes ``(k, 3, 3)`` of an ORIENTATION at nodes, none where all or no components of three are held."""
    whole = all(mask[s].all() or not mask[s].any() for s in (slice(3), slice(3, 6)))
    name = block.owner.options.get("ORIENTATION") if block.owner is not None else None
    if not name or whole:
        return np.zeros((0, 3, 3))
    orientation = deck.named("orientation", block, block.scope, name)
    return np.array([orientation.axes_at(deck, ("", 0), deck.points[node]) for node in nodes])


def kinematic_coupling(deck: Deck, block: Block) -> None:
    """``*KINEMATIC COUPLING``, the older form: nodes or sets with their components."""
    reference = deck.nodes_of(block, block.scope, block.option("REF NODE"))
    for row in block.rows:
        nodes = deck.nodes_of(row, block.scope, row.text(0))
        mask = np.zeros(6, dtype=bool)
        mask[components(row, 1) if row.text(1) else range(6)] = True
        _rigid(deck, row, reference[0], nodes, mask)


def distributing_coupling(deck: Deck, block: Block) -> None:
    """``*DISTRIBUTING COUPLING``: the node of an element DCOUP3D follows the mean of nodes with weights."""
    keys = deck.elements_of(block, block.scope, block.option("ELSET"))
    if len(keys) != 1 or deck.elements[keys[0]].family != "coupling":
        block.refuse(f"names {len(keys)} elements, or one that is no DCOUP3D; give the one with the reference node")
    weights: dict[int, float] = {}
    for row in block.rows:
        for node in deck.nodes_of(row, block.scope, row.text(0)):
            weights[node] = weights.get(node, 0.0) + row.real(1, "a weight", 1.0)
    [node] = deck.elements[keys[0]].nodes
    if node in weights or not weights or min(weights.values()) <= 0:
        block.refuse("couples no nodes, its own node, or has a weight that is not positive; correct its lines")
    values = np.array(list(weights.values()))
    deck.links.append(Link(kind="rbe3", node=node, nodes=np.array(list(weights)), weights=values))


def rigid_body(deck: Deck, block: Block) -> None:
    """``*RIGID BODY``: elements and nodes that follow a reference node; those of PIN NSET by their place only."""
    if "ANALYTICAL SURFACE" in block.options:
        block.refuse("with an ANALYTICAL SURFACE is not read; give the rigid body by elements or nodes")
    reference = deck.nodes_of(block, block.scope, block.option("REF NODE"))
    whole = np.ones(6, dtype=bool)
    pinned = np.array([True] * 3 + [False] * 3)
    tied: list[int] = []
    for name in ("NSET", "TIE NSET"):
        if block.options.get(name):
            tied += deck.nodes_of(block, block.scope, block.options[name])
    if block.options.get("ELSET"):
        keys = deck.elements_of(block, block.scope, block.options["ELSET"])
        tied += [node for key in keys for node in deck.elements[key].nodes]
    pins = deck.nodes_of(block, block.scope, block.options["PIN NSET"]) if block.options.get("PIN NSET") else []
    tied = [node for node in dict.fromkeys(tied) if node not in set(pins)]
    _rotation_node(deck, block, reference[0])
    _rigid(deck, block, reference[0], tied, whole)
    _rigid(deck, block, reference[0], list(dict.fromkeys(pins)), pinned)


def _rotation_node(deck: Deck, block: Block, reference: int) -> None:
    """Remember that the displacements of CalculiX' ROT NODE are the rotations of the reference node."""
    name = block.options.get("ROT NODE")
    if not name:
        return
    nodes = deck.nodes_of(block, block.scope, name)
    if len(nodes) != 1 or nodes[0] == reference:
        block.refuse(f"names {len(nodes)} nodes as ROT NODE, or the reference node; give one node of its own")
    deck.current.setdefault("rotation nodes", {})[nodes[0]] = reference


def turn_rotation_nodes(deck: Deck) -> None:
    """Hold and join the rotations of the reference nodes in place of the displacements of their ROT NODE."""
    for node, reference in deck.current.get("rotation nodes", {}).items():
        held = {c + 3 for c in deck.fixed.pop(node, set()) if c < 3}
        if held:
            deck.fixed.setdefault(reference, set()).update(held)
        for k, (terms, name) in enumerate(deck.equations):
            own = [(reference, c + 3, f) if n == node and c < 3 else (n, c, f) for n, c, f in terms]
            deck.equations[k] = own, name


def _rigid(deck: Deck, at: Row | Block, node: int, nodes: Sequence[int], mask: np.ndarray) -> None:
    nodes = [other for other in nodes if other != node]
    if nodes:
        deck.links.append(Link(kind="rbe2", node=node, nodes=np.array(nodes), components=mask))


def mpc(deck: Deck, block: Block) -> None:
    """``*MPC`` of types BEAM, TIE, PIN and LINK: the first node follows the second."""
    if {"USER", "MODE"} & set(block.options):
        block.refuse("of the user's own is not read; give it as *EQUATION")
    if block.row().text(0).upper() == "MEANROT":
        _mean_rotation(deck, block)
        return
    for row in block.rows:
        kind = row.text(0).upper()
        if kind not in ("BEAM", "TIE", "PIN", "LINK"):
            raise row.error(f"*MPC of type {kind} is not read; known are BEAM, TIE, PIN, LINK and MEANROT")
        first, second = (deck.nodes_of(row, block.scope, row.text(k)) for k in (1, 2))
        if len(second) not in (1, len(first)):
            raise row.error(f"*MPC joins {len(first)} and {len(second)} nodes; give sets of one size, or one node")
        for n, node in enumerate(first):
            _join(deck, row, kind, node, second[n % len(second)])


def _mean_rotation(deck: Deck, block: Block) -> None:
    """MEANROT of CalculiX: DOF 1 of the last node is a mean rotation, which matters only where something holds it."""
    [node] = deck.nodes_of(block, block.scope, block.joined().fields[-1])[-1:]
    deck.current.setdefault("mean rotations", {})[node] = block
    deck.note(f"*MPC MEANROT (line {block.line}) measures a rotation and leaves the body as it is")


def refuse_held_rotations(deck: Deck) -> None:
    """Refuse a mean rotation that something holds: it is no support of single nodes."""
    for node, block in deck.current.get("mean rotations", {}).items():
        if node in deck.fixed:
            block.refuse("MEANROT holds a mean rotation, which no set of supports does; give an interface of kind rbe3")


def pretension(deck: Deck, block: Block) -> None:
    """``*PRE-TENSION SECTION``: the mesh goes on through the section, which stays closed."""
    deck.note(
        f"*PRE-TENSION SECTION (line {block.line}): the section is closed, as after tightening, and its force does not "
        "act; give it by prestress where it stiffens"
    )
    for name in ("SURFACE", "NODE", "ELEMENT"):
        block.options.get(name)


def _join(deck: Deck, row: Row, kind: str, node: int, to: int) -> None:
    if node == to:
        raise row.error(f"*MPC ties node {deck.label(node)} to itself; give two nodes")
    arm = deck.points[node] - deck.points[to]
    near = not np.linalg.norm(arm) > 1e-9 * (np.ptp(deck.points, axis=0).max() or 1.0)
    name = f"*MPC in line {row.line}"
    if kind == "BEAM" or (kind == "TIE" and near):
        _rigid(deck, row, to, [node], np.ones(6, dtype=bool))
    elif kind == "LINK":
        if near:
            raise row.error("*MPC LINK joins nodes at one place, which have no direction between them; use PIN")
        along = arm / np.linalg.norm(arm)
        terms = [(one, c, s * along[c]) for one, s in ((node, 1.0), (to, -1.0)) for c in np.argsort(-abs(along))]
        deck.equations.append(([(n, int(c), float(f)) for n, c, f in terms if f], name))
    else:
        for c in range(3 if kind == "PIN" else 6):
            deck.equations.append(([(node, c, 1.0), (to, c, -1.0)], name))
