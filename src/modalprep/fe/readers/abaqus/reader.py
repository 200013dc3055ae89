"""Abaqus and CalculiX input decks to a mesh in SI units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.builder import cell_data
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.mesh.mesh import Equation, Mesh, SupportSet
from modalprep.fe.readers.abaqus.analysis import cases, load_sets, read_steps
from modalprep.fe.readers.abaqus.constraints import ROTATING, mean_terms, refuse_held_rotations, turn_rotation_nodes
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.dialect import Dialect, spoken
from modalprep.fe.readers.abaqus.elements import note_others
from modalprep.fe.readers.abaqus.lexer import Block, read_blocks
from modalprep.fe.readers.abaqus.parts import Parts
from modalprep.fe.readers.abaqus.registry import IN_STEPS, REGISTRY, STAGES, WITHOUT_EFFECT
from modalprep.fe.readers.abaqus.superelements import note_idle_matrices, refuse_turned_nodes
from modalprep.fe.readers.abaqus.ties import tie_equations
from modalprep.fe.readers.units import Units
from modalprep.suggest import suggestion

ADVICE = "nobody knows whether they carry mass, stiffness or constraints; check the spelling, or model them otherwise"
BEHIND = {"KINEMATIC", "DISTRIBUTING", "TRANSVERSE SHEAR STIFFNESS", "MATRIX"}  # belong to the keyword before
PLANE = "plane"  # name of the set of supports that keeps plane stress in its plane
BOUNDARY = "boundary"  # name of the set of supports, and of their group
KEPT = {("SURFACE", "TYPE"), ("ORIENTATION", "LOCAL DIRECTIONS")}  # parameters that count where something uses them
FRAMES = ("PART", "INSTANCE", "ASSEMBLY")
POINTS = ("mass", "rotary inertia", "spring", "dashpot")
QUIET = {name for name, entry in REGISTRY.items() if entry.treatment == "no effect"} | {"STEP", "BOUNDARY"}
SQUEEZED = {name.replace(" ", ""): name for name in REGISTRY}


def read_abaqus(
    path: Path, length: float, mass: float, ignore: Collection[str] = (), dialect: Dialect | None = None
) -> Mesh:
    r"""Read an Abaqus or CalculiX deck with its sections, materials, couplings and ties.

    Groups are the sets: element sets as cells, node sets as vertices; with several instances a set of a part is
    ``instance.set``. A deck without sections gives groups without properties.

    Parameters
    ----------
    path : Path
    length, mass : float
        m and kg per unit of length and mass of the deck; its time is in seconds, its force mass length / s^2.
    ignore : collection of str
        Keywords such as ``"*TIE"``, or ``"*ELEMENT, TYPE=CONN3D2"``, that are left out of the model.
    dialect : {"abaqus", "calculix"}, optional
        Whose deck it is; None takes what the deck proves.

    Raises
    ------
    InputError
        When a line cannot be read, the deck refers to what it does not hold, or a keyword that carries stiffness,
        mass or constraints has no counterpart here and is not ignored, or a keyword means something else in Abaqus and
        in CalculiX and the deck does not say which it is of.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "bar.inp"
    >>> _ = path.write_text("*NODE\n1, 0, 0, 0\n2, 500, 0, 0\n*ELEMENT, TYPE=T3D2, ELSET=bar\n7, 1, 2\n")
    >>> read_abaqus(path, 1e-3, 1.0)
    Mesh(2 points, 1 line; groups bar)
    """
    blocks, sha256 = read_blocks(path)
    parts = Parts()
    blocks = [_spelled(block) for block in blocks]
    frames = [block for block in blocks if block.keyword in FRAMES]
    deck = Deck(path, Units(length=length, mass=mass), parts, spoken(blocks, dialect))
    blocks, of_steps = _chosen(deck, parts.placed(blocks), ignore)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        for stage in STAGES:
            for block in blocks:
                entry = stage.get(block.keyword)
                if entry and entry.handle:
                    entry.handle(deck, block)
        _refuse_bare_couplings(deck, blocks)
        _note_bare_points(deck)
        refuse_held_rotations(deck)
        for block in (*frames, *blocks):
            _skip_unread(deck, block)
        note_others(deck)
        refuse_turned_nodes(deck)
        note_idle_matrices(deck)
        read_steps(deck, of_steps, IN_STEPS, QUIET)
        return _mesh(deck, sha256)


def _skip_unread(deck: Deck, block: Block) -> None:
    """Note the parameters of a keyword that nothing has asked for, but those without effect on a linear model."""
    handled = block.keyword in FRAMES
    handled |= any(stage[block.keyword].handle for stage in STAGES if block.keyword in stage)
    for name in block.options.unread if handled else ():
        if name not in WITHOUT_EFFECT and (block.keyword, name) not in KEPT:
            deck.skipped.append((f"parameter {name} of *{block.keyword}", f"line {block.line}"))


def _spelled(block: Block) -> Block:
    """Return the block with its keyword as the registry has it; blanks do not count."""
    known = SQUEEZED.get(block.keyword.replace(" ", ""))
    return replace(block, keyword=known) if known else block


def _chosen(deck: Deck, blocks: list[Block], ignore: Collection[str]) -> tuple[list[Block], list[Block]]:
    """Return the blocks of the model and those of the steps; note ignored and unknown ones, refuse what is missed."""
    ignored = {name: 0 for name in ignore}
    by_name = {_plain(name): name for name in ignore}
    kept = []
    unknown = []
    steps = []
    owner = None
    for block in blocks:
        name = next((by_name[own] for own in _names(block) if own in by_name), None)
        if name is not None:
            ignored[name] += 1
        elif block.step and block.keyword != "MODEL CHANGE":
            if block.keyword == "BOUNDARY" and block.step == 1:
                kept.append(block)
            else:
                steps.append(block)
        elif block.keyword not in REGISTRY:
            if block.keyword:
                unknown.append((f"*{block.keyword}", f"line {block.line}"))
        elif REGISTRY[block.keyword].treatment == "refused":
            block.refuse(
                f'is not read. {REGISTRY[block.keyword].remark} Write ignore = ["*{block.keyword}"] to leave it out'
            )
        else:
            if block.keyword in BEHIND:
                block.owner = owner
            elif block.keyword in ("COUPLING", "USER ELEMENT") or block.keyword.endswith("SECTION"):
                owner = block
            kept.append(block)
    _refuse_absent(deck, ignored, blocks)
    deck.notes += [f"ignored: {count} {name}" for name, count in ignored.items()]
    if any(block.keyword == "BOUNDARY" for block in steps):
        deck.notes.append("supports of steps after the first are left out")
    deck.notes += left_out(unknown, ADVICE)
    return kept, steps


def _names(block: Block) -> tuple[str, ...]:
    kind = block.options.peek("TYPE")
    return _plain(block.keyword), _plain(f"{block.keyword},TYPE={kind}")


def _plain(name: str) -> str:
    return "".join(name.upper().replace("*", "").split())


def _refuse_absent(deck: Deck, ignored: dict[str, int], blocks: list[Block]) -> None:
    for name, count in ignored.items():
        if not count:
            known = sorted({f"*{block.keyword}" for block in blocks})
            raise InputError(f"mesh file {deck.path} has no {name!r} to ignore; {suggestion(name, known, 'it has')}")


def _refuse_bare_couplings(deck: Deck, blocks: list[Block]) -> None:
    done = deck.current.get("coupled", set())
    for block in blocks:
        if block.keyword == "COUPLING" and id(block) not in done:
            block.refuse("is neither *KINEMATIC nor *DISTRIBUTING; add the one that is meant behind it")


def _note_bare_points(deck: Deck) -> None:
    """Say which masses and springs have no keyword with their values."""
    bare = (key for key in deck.elements if key not in deck.sectioned)
    count = Counter(deck.elements[key].type for key in bare if deck.elements.family(key) in POINTS)
    for kind, number in count.items():
        deck.note(
            f"{number} elements of TYPE={kind} have no mass or stiffness, because no keyword of the deck gives it; "
            "give the property of their set in the pipeline file"
        )


def _mesh(deck: Deck, sha256: str) -> Mesh:
    if not deck.points or not any(kind != "vertex" for kind in deck.cells):
        raise InputError(f"mesh file {deck.path} holds no {'cells' if deck.points else 'nodes'}; export it again")
    turning = deck.elements.nodes_of(frozenset(ROTATING))
    turning |= {link.node for link in deck.links}
    turning |= {int(node) for own in deck.matrices for node in own.rows[own.rows[:, 1] > 2, 0]}
    tie_equations(deck, turning)
    turn_rotation_nodes(deck)
    _free_held_means(deck)
    _name_supports(deck)
    order, labels = _labels(deck)
    place = np.empty(len(order), dtype=int)
    place[order] = np.arange(len(order))
    groups, names = _groups(deck)
    return Mesh(
        points=deck.units.length * np.array(deck.points)[order],
        cells={kind: place[table.rows] for kind, table in deck.cells.items()},
        groups={name: {kind: np.array(rows) for kind, rows in g.items()} for name, g in groups.items()},
        labels=labels,
        source=deck.path.name,
        sha256=sha256,
        scale=deck.units.length,
        properties={names[key]: section for key, section in deck.sections.items()},
        links=tuple(link.renumbered(place) for link in deck.links),
        equations=tuple(_equations(deck, place, turning)),
        matrices=tuple(own.renumbered(place) for own in deck.matrices),
        supports=(supports := _supports(deck, place)),
        loads=(loads := load_sets(deck, place)),
        cases=tuple(case for case in cases(deck, (BOUNDARY,) * (BOUNDARY in supports), loads) if not case.is_empty),
        data=cell_data(deck.data, deck.cells),
        cyclic=deck.cyclic,
        notes=(*deck.notes, *left_out(deck.skipped, "model them otherwise where they matter")),
    )


def _free_held_means(deck: Deck) -> None:
    """Write couplings to a mean as equations where a support holds their node, which then cannot follow."""
    for link in [link for link in deck.links if link.kind == "rbe3" and link.node in deck.fixed]:
        deck.links.remove(link)
        name = f"*DISTRIBUTING of node {deck.label(link.node)}"
        deck.equations += [(terms, name) for terms in mean_terms(deck, link)]


def _equations(deck: Deck, place: np.ndarray, turning: set[int]) -> Iterator[Equation]:
    """Yield the equations between components that the nodes have: an equation between rotations of solids is none."""
    for terms, name in deck.equations:
        if all(c > 2 and node not in turning for node, c, _ in terms):
            continue
        axes = {int(place[node]): deck.axes[node] for node, _, _ in terms if node in deck.axes}
        own = [(int(place[node]), c, factor) for node, c, factor in terms]
        yield Equation.of_terms(own, length=deck.units.length, name=name, axes=axes)


def _name_supports(deck: Deck) -> None:
    """Make the nodes that are held a group, and say that they are free without a word of the user."""
    if not deck.fixed:
        return
    deck.members("NSET", "", BOUNDARY).extend(deck.keys[node] for node in sorted(deck.fixed))
    deck.note(
        f"*BOUNDARY holds {len(deck.fixed)} nodes where a support names the set {BOUNDARY!r}, and nothing without it"
    )


def _supports(deck: Deck, place: np.ndarray) -> dict[str, SupportSet]:
    """Return what the deck holds as the set `boundary`, and the components that plane stress has not as `plane`."""
    found = {}
    if deck.fixed:
        held = sorted(deck.fixed, key=lambda node: int(place[node]))
        components = np.array([[c in deck.fixed[node] for c in range(6)] for node in held])
        axes = np.array([deck.axes.get(node, np.eye(3)) for node in held]) if deck.axes else np.zeros((0, 3, 3))
        found[BOUNDARY] = SupportSet(nodes=place[held], components=components, axes=axes)
    if plane := deck.current.get("plane"):
        across = np.tile([False, False, True, True, True, False], (len(plane), 1))
        found[PLANE] = SupportSet(nodes=place[list(plane)], components=across, axes=np.array(list(plane.values())))
    return found


def _labels(deck: Deck) -> tuple[np.ndarray, np.ndarray]:
    """Return the order of the nodes by their numbers, and these; instances that share numbers are numbered apart."""
    numbers = deck.numbered.labels
    if len(np.unique(numbers)) < len(numbers):
        step = 10 ** len(str(numbers.max()))
        shift = {scope: k * step for k, scope in enumerate(["", *deck.parts.moves])}
        numbers = numbers + np.array([shift[scope] for scope, _ in deck.keys])
        listed = ", ".join(f"{deck.parts.spelled[scope]} {shift[scope]}" for scope in deck.parts.moves)
        deck.note(f"instances share numbers of nodes: to those of each is added {listed}")
    order = np.argsort(numbers, kind="stable")
    return order, numbers[order]


def _groups(deck: Deck) -> tuple[dict[str, dict[str, list]], dict[tuple[str, str], str]]:
    """Return the groups, and their names by those of the element sets."""
    groups: dict[str, dict[str, list]] = {}
    names: dict[tuple[str, str], str] = {}
    for kind in ("ELSET", "NSET"):
        for key in deck.sets[kind]:
            if (kind, key) in deck.internal and not (kind == "ELSET" and key in deck.sections):
                continue
            rows = _rows(deck, kind, key)
            name = _group_name(deck, kind, key)
            if kind == "ELSET":
                names[key] = name
            if not rows:
                continue
            if kind == "NSET" and "vertex" in groups.get(name, {}):
                deck.note(f"node set {name} is the group {name}_nodes, because an element set of points has its name")
                name = f"{name}_nodes"
            for cell, own in rows.items():
                groups.setdefault(name, {}).setdefault(cell, []).extend(own)
    return groups, names


def _group_name(deck: Deck, kind: str, key: tuple[str, str]) -> str:
    scope, name = key
    spelled = next(deck.spelled[k, key] for k in (kind, "ELSET", "NSET") if (k, key) in deck.spelled)
    several = len(deck.parts.moves) > 1 or any(("", name) in table for table in deck.sets.values())
    return f"{deck.parts.spelled[scope]}.{spelled}" if scope and several else spelled


def _rows(deck: Deck, kind: str, key: tuple[str, str]) -> dict[str, list[int]]:
    if kind == "NSET":
        return {"vertex": [deck.cell("vertex", [node])[1] for node in deck.resolve(kind, key)]}
    return deck.elements.cells(deck.resolve(kind, key))
