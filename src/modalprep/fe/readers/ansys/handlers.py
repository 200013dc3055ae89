"""Commands of Ansys input files to the records of the deck."""

from __future__ import annotations

import re

import numpy as np

from modalprep.fe.readers.ansys.blocks import (
    element_rows,
    element_table,
    integers,
    members,
    node_rows,
    node_table,
    real_sets,
)
from modalprep.fe.readers.ansys.commands import Command, number
from modalprep.fe.readers.ansys.deck import Deck, Element, ElementType, FixedDof, SectionData
from modalprep.fe.readers.ansys.systems import axes_of, local_system

ATTRIBUTES = {"TYPE": "type", "MAT": "material", "REAL": "real", "SECN": "section", "ESYS": "system"}
VERSIONED = re.compile(r"R\d+\.\d*|UNBL.*")  # field 1 of commands that CDWRITE writes


def is_versioned(command: Command) -> bool:
    """Whether CDWRITE wrote a command, with the form of its lines in the first field."""
    return VERSIONED.fullmatch(command.text(1)) is not None


def nblock(deck: Deck, command: Command) -> None:
    """Read nodes with their coordinates and angles."""
    table = node_table(command)
    if table and deck.points.add_table(table[0], table[1][:, :3]):
        for k in np.flatnonzero(table[1][:, 3:].any(axis=1)).tolist():
            deck.angles[int(table[0][k])] = table[1][k, 3:].tolist()
        return
    for line, label, values in node_rows(command):
        _add_node(deck, command, label, values, line)


def node(deck: Deck, command: Command) -> None:
    """Read one node, or skip the end of a block."""
    if is_versioned(command):
        return
    values = [command.real(k, "coordinate", 0.0) for k in range(2, 8)]
    _add_node(deck, command, command.integer(1, "node"), values, command.line)


def _add_node(deck: Deck, command: Command, label: int, values: list[float], line: int) -> None:
    if label < 1:
        raise command.error(f"node {label} has no positive number; correct it", line)
    if deck.points.listed().setdefault(label, values[:3]) != values[:3]:
        raise command.error(f"node {label} is there twice and differs; give every node its own number", line)
    if any(values[3:]):
        deck.angles[label] = values[3:]


def eblock(deck: Deck, command: Command) -> None:
    """Read elements; without the key SOLID their type is that of the last TYPE."""
    table = element_table(command)
    if table and deck.elements.add_block(table):
        return
    solid = "SOLID" in command.text(2)
    for line, row in element_rows(command):
        if solid:
            material, kind, real, section, system, *_ = row
            label = row[10]
            nodes = row[11:]
        elif len(row) > 5:
            label, section, real, material, system, *nodes = row
            kind = deck.attributes.get("type", 1)
        else:
            raise command.error("an element has no nodes; the block is damaged", line)
        _add_element(deck, command, Element(label, kind, material, real, section, system, tuple(nodes), line))


def element(deck: Deck, command: Command) -> None:
    """E and EN: nodes of one element, whose attributes are those of the last TYPE, MAT, REAL, SECNUM and ESYS.

    The EN of CDWRITE ends a block.
    """
    if is_versioned(command):
        return
    first = 1 + (command.key == "EN")
    label = command.integer(1, "element") if first > 1 else deck.elements.highest + 1
    nodes = tuple(int(value) for value in command.reals(first))
    names = ("type", "material", "real", "section", "system")
    kind, material, real, section, system = (deck.attributes.get(name, int(name != "system")) for name in names)
    _add_element(deck, command, Element(label, kind, material, real, section, system, nodes, command.line))


def emore(deck: Deck, command: Command) -> None:
    """EMORE: further nodes of the last element."""
    if not deck.elements:
        raise command.error("no element stands before it; correct the file")
    label, last = next(reversed(deck.elements.last.items()))
    deck.elements.last[label] = last._replace(nodes=last.nodes + tuple(int(value) for value in command.reals(1)))


def _add_element(deck: Deck, command: Command, found: Element) -> None:
    if not deck.elements.add(found):
        raise command.error(f"element {found.label} is there twice; give every element its own number", found.line)


def attribute(deck: Deck, command: Command) -> None:
    """Note the attribute of the elements that follow."""
    deck.attributes[ATTRIBUTES[command.key]] = command.integer(1, "number", 1)


def element_type(deck: Deck, command: Command) -> None:
    """ET: the element of a type, and its first options."""
    name = command.text(2).lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ")
    if name:
        options = {k: command.integer(k + 2, "option", 0) for k in range(1, 7)}
        deck.types[command.integer(1, "type")] = ElementType(name, options)


def option(deck: Deck, command: Command) -> None:
    """KEYOPT: one option of a type."""
    kind = command.integer(1, "type")
    if kind not in deck.types:
        raise command.error(f"type {kind} is not there; add its ET")
    deck.types[kind].options[command.integer(2, "option")] = command.integer(3, "value", 0)


def type_block(deck: Deck, command: Command) -> None:
    """ETBLOCK: types with their elements and options."""
    for line, text in command.rows:
        kind, name, *options = [*integers(command, text.split(), line), 0, 0]
        if kind > 0:
            deck.types[kind] = ElementType(str(name), dict(enumerate(options, 1)))


def material(deck: Deck, command: Command) -> None:
    """MP: a property that does not depend on temperature."""
    if command.text(1) in ("REFT", "UVID"):
        return
    label = command.text(1)
    number_ = command.integer(2, "material", 1)
    values = command.reals(3)
    _add_material(deck, label, number_, values[:1])
    if any(values[1:]):
        deck.note(f"material {number_}: {label} depends on the temperature; its value at 0 degrees is taken")


def material_data(deck: Deck, command: Command) -> None:
    """MPDATA: a property at several temperatures, of which the first is taken."""
    first = 3 if is_versioned(command) else 1
    label = command.text(first)
    number_ = command.integer(first + 1, "material", 1)
    values = command.reals(first + 3)
    if command.integer(first + 2, "place", 1) > 1:
        return
    _add_material(deck, label, number_, values)
    if any(value != values[0] for value in values):
        deck.note(f"material {number_}: {label} depends on the temperature; its first value is taken")


def _add_material(deck: Deck, label: str, number_: int, values: list[float]) -> None:
    deck.materials.setdefault(number_, {})[label] = values[0] if values else 0.0


def table(deck: Deck, command: Command) -> None:
    """TB: elastic constants, isotropic or all 21; what is not linear is left out."""
    kind = command.text(1)[:4]
    form = command.text(5)
    deck.table = (command.integer(2, "material", 1), kind)
    if (kind == "ANEL" and form not in ("", "0")) or (kind == "ELAS" and form not in ("", "ISOT", "2")):
        raise command.error(f"material {deck.table[0]}: option {form} is not read; give EX to GXZ by MP")
    if kind not in ("ELAS", "ANEL", "CTE"):
        deck.note(f"material {deck.table[0]}: TB,{command.text(1)} is left out; the material is linear")


def table_data(deck: Deck, command: Command) -> None:
    """TBDATA of elastic constants from one place on."""
    label, kind = deck.table
    names = {"ELAS": ("EX", "NUXY"), "ANEL": tuple(f"C{k}" for k in range(1, 22))}.get(kind, ())
    first = command.integer(1, "place", 1)
    for name, value in zip(names[max(first - 1, 0) :], command.reals(2), strict=False):
        _add_material(deck, name, label, [value])


def reals(deck: Deck, command: Command) -> None:
    """R: the first real constants of a set."""
    deck.attributes["set"] = command.integer(1, "set", 1)
    deck.reals[deck.attributes["set"]] = (command.reals(2) + [0.0] * 6)[:6]


def more_reals(deck: Deck, command: Command) -> None:
    """RMORE: six further constants of the last set."""
    deck.reals.setdefault(deck.attributes.get("set", 1), [0.0] * 6).extend((command.reals(1) + [0.0] * 6)[:6])


def real_block(deck: Deck, command: Command) -> None:
    """RLBLOCK: sets of real constants."""
    for label, values in real_sets(command):
        deck.reals[label] = values


def section_type(deck: Deck, command: Command) -> None:
    """SECTYPE: begin a section."""
    deck.section = command.integer(1, "section", 1)
    deck.sections[deck.section] = SectionData(command.text(2), command.text(3), command.line)


def _section(deck: Deck, command: Command) -> SectionData:
    if deck.section not in deck.sections:
        raise command.error("no SECTYPE stands before it; add it")
    return deck.sections[deck.section]


def section_data(deck: Deck, command: Command) -> None:
    """SECDATA: a ply of a shell, or the sizes of a beam."""
    section = _section(deck, command)
    values = command.reals(1)
    if section.kind == "SHEL" or section.kind == "SHELL":
        section.plies.append(values)
    else:
        section.values += values


def section_block(deck: Deck, command: Command) -> None:
    """SECBLOCK: the plies of a shell."""
    section = _section(deck, command)
    for line, text in command.rows:
        section.plies.append([number(command, f, "value", line) for f in text.replace(",", " ").split()])


def section_offset(deck: Deck, command: Command) -> None:
    """SECOFFSET: where the nodes lie in the section."""
    section = _section(deck, command)
    section.place = command.text(1)
    section.offset = (command.real(2, "offset", 0.0), command.real(3, "offset", 0.0))


def section_control(deck: Deck, command: Command) -> None:
    """SECCONTROL: transverse shear stiffness and added mass are refused; those of hourglasses have no effect."""
    if any(command.reals(1)[:4]):
        raise command.error("shear stiffness or added mass of a section cannot be read; name SECCONTROL in 'ignore'")


def component(deck: Deck, command: Command) -> None:
    """CMBLOCK: a set of nodes or elements by their numbers."""
    sets = deck.node_sets if command.text(2).startswith("NODE") else deck.element_sets
    sets[command.fields[1] if len(command.fields) > 1 else ""] = members(command)


UNKNOWN = -1  # a selection by a condition
SELECTORS = {"NSEL": ("NODE",), "ESEL": ("ELEM",)}  # of one kind only


def selection(deck: Deck, command: Command) -> None:
    """NSEL, ESEL, ALLSEL: from which node or element on the next CM names them; what is made later is selected too."""
    for kind in SELECTORS.get(command.key, ("NODE", "ELEM")):
        made = deck.points if kind == "NODE" else deck.elements
        first = {"": 0, "ALL": 0, "NONE": len(made)}.get(command.text(1), UNKNOWN)
        deck.attributes[f"selected {kind}"] = first if command.key in (*SELECTORS, "ALLS") else UNKNOWN


def named(deck: Deck, command: Command) -> None:
    """CM: the selected nodes or elements as a component, where the file says which these are."""
    kind = command.text(2)[:4]
    first = deck.attributes.get(f"selected {kind}", 0)
    if kind not in ("NODE", "ELEM") or first == UNKNOWN:
        deck.skipped.append((f"CM of {kind or 'nothing'} by a selection", f"line {command.line}"))
        return
    if kind == "NODE":
        deck.node_sets[command.fields[1]] = list(deck.points.listed())[first:]
    else:
        deck.element_sets[command.fields[1]] = deck.elements.labels[first:]


def local(deck: Deck, command: Command) -> None:
    """LOCAL, also in the two lines of CDWRITE: origin, then angles."""
    if not is_versioned(command):
        angles = np.array([command.real(k, "angle", 0.0) for k in range(6, 9)])
        origin = np.array([command.real(k, "origin", 0.0) for k in range(3, 6)])
        deck.systems[command.integer(1, "system")] = local_system(
            command, command.integer(2, "kind", 0), origin, angles
        )
        return
    label = command.integer(3, "system")
    kind = command.integer(4, "kind", 0)
    values = np.array([command.real(k, "value", 0.0) for k in range(5, 8)])
    if command.text(2) == "LOC":
        deck.systems[label] = local_system(command, kind, values, np.zeros(3))
    elif command.text(2) == "ANG" and label in deck.systems:
        deck.systems[label].axes = axes_of(values)


def active_system(deck: Deck, command: Command) -> None:
    """CSYS: coordinates of the nodes that follow must be global."""
    if command.text(1) not in ("", "0"):
        raise command.error("nodes in a local system cannot be read; export the model by CDWRITE")


def lumped(deck: Deck, command: Command) -> None:
    """LUMPM: a lumped mass matrix of Ansys."""
    if command.text(1) == "ON":
        deck.note("LUMPM,ON: the mass is consistent here, while Ansys lumps it")


def switch(deck: Deck, command: Command) -> None:
    """*IF of CDWRITE: the numbers of an earlier model, of which there is none."""
    if command.text(1) != "_CDRDOFF":
        raise command.error("it chooses commands by a parameter; export the model by CDWRITE")


def nodes_in_range(deck: Deck, command: Command, end: int) -> list[int]:
    """Return the nodes of a command: its first, or those of the deck from there to NEND (field `end`) by NINC."""
    first = command.integer(1, "node")
    last = command.integer(end, "NEND", 0)
    step = command.integer(end + 1, "NINC", 1) or 1
    if last in (0, first):
        return [first]
    if last < first or step < 0:
        raise command.error(f"its nodes from {first} to {last} by {step} are none; correct the range")
    there = (node for node in deck.points.listed() if first <= node <= last)
    return sorted(node for node in there if (node - first) % step == 0) or [first]


def support(deck: Deck, command: Command) -> None:
    """D: one DOF of a node, held or moved."""
    labels = [command.text(2), *(command.text(k) for k in range(7, 13))]
    value = command.real(3, "value", 0.0)
    for node in nodes_in_range(deck, command, 5):
        deck.fixed += [FixedDof(node, label, value, command.line) for label in labels if label in (*DOFS, "ALL")]


DOFS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")


def equation(deck: Deck, command: Command) -> None:
    """CE: terms (node, component, factor) of an equation and its constant, in the two lines of CDWRITE or in one."""
    versioned = is_versioned(command)
    defines = command.text(2) == "DEFI"
    if not versioned or defines:
        deck.attributes["equation"] = command.integer(4 if versioned else 1, "equation")
    found = deck.equations.setdefault(
        deck.attributes.get("equation", 0), {"constant": 0.0, "terms": [], "line": command.line}
    )
    if not versioned or defines:
        found["constant"] += command.real(5 if versioned else 2, "constant", 0.0)
    for k in range(3, 0 if defines else len(command.fields) - 1, 3):
        if command.text(k) and (label := command.integer(k, "node")):
            found["terms"].append((label, _component(command, k + 1), command.real(k + 2, "factor", 1.0)))


def _component(command: Command, k: int) -> int:
    if command.text(k) not in DOFS:
        raise command.error(f"the DOF {command.text(k)!r} is not one of {', '.join(DOFS)}; correct it")
    return DOFS.index(command.text(k))


def couple(deck: Deck, command: Command) -> None:
    """CP: nodes that share one DOF."""
    versioned = is_versioned(command)
    if not versioned:
        label = command.integer(1, "set")
        dofs = command.text(2)
        first = 3
    elif command.text(2) == "DEFI":
        named = [f.upper() for f in command.fields if f.upper() in (*DOFS, "ALL")]
        label = command.integer(4, "set")
        dofs = named[0] if named else ""
        first = len(command.fields)
        deck.attributes["couple"] = label
    else:
        label = deck.attributes.get("couple", 0)
        dofs = ""
        first = 3
    found = deck.couples.setdefault(label, {"label": dofs, "nodes": [], "line": command.line})
    if found["label"] not in (*DOFS, "ALL"):
        raise command.error(f"the DOF {found['label']!r} is not one of {', '.join(DOFS)}; correct it")
    found["nodes"] += [int(value) for value in command.reals(first) if value > 0]
