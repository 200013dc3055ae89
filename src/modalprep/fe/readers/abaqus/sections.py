"""Sections of solids, trusses and shells."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.properties.materials import Material, Orthotropic
from modalprep.fe.properties.properties import Ply, Property, Shell, Solid, Truss
from modalprep.fe.readers.abaqus.deck import Deck, Key
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.materials import Orientation, isotropic, of_sheet, of_solid

SHELL_OPTIONS = ("SHELL THICKNESS", "DENSITY", "ZMODULUS", "STACK DIRECTION", "LAYUP")
NORMAL = 0.1  # degrees: an axis this close to the normal of a shell gives no direction


def section_set(deck: Deck, block: Block, *families: str) -> tuple[str, list[Key]]:
    """Return the family of the elements of a section, one of some, and their keys; each has one section."""
    name = block.option("ELSET")
    keys = deck.elements_of(block, block.scope, name)
    found = deck.elements.families(keys)
    for family, (_, label) in found.items():
        if deck.elements[_, label].type.startswith("CPE"):
            block.refuse(f"of set {name} has plane strain, which no body in space has; mesh the body with solids")
        if family not in families:
            what = f"{deck.elements[_, label].type} element {label}"
            block.refuse(f"of set {name} has the {what}, which is none of {', '.join(families)}; split the set")
    if len(found) > 1:
        block.refuse(f"of set {name} has {' and '.join(found)} elements; give each a section of its own")
    for key in keys:
        known = deck.sectioned.setdefault(key, block)
        if known is not block:
            block.refuse(f"gives element {key[1]} another section than line {known.line}; keep one of the two")
    return next(iter(found), ""), keys


def give(deck: Deck, block: Block, section: Property) -> None:
    """Give a section to the element set of a keyword."""
    of, name = deck.split(block.scope, block.option("ELSET"))
    key = deck.find(deck.sets["ELSET"], of, name)
    if key is None:  # the number of one element
        key = (of, f"ELEMENT {name}".upper())
        deck.members("ELSET", of, f"element {name}").append((of, int(name)))
    deck.sections[key] = section


def solid_section(deck: Deck, block: Block) -> None:
    """``*SOLID SECTION`` of volumes, and of trusses with their area."""
    if "COMPOSITE" in block.options:
        block.refuse("with COMPOSITE is not read; mesh the layers, or use shells")
    family, keys = section_set(deck, block, "solid", "truss", "plane stress")
    if not keys:
        return
    if family == "plane stress":
        _plane_stress(deck, block, keys)
        return
    if family == "truss":
        area = block.row().real(0, "area", 1.0) * deck.units.length**2
        material = isotropic(deck, block, block.option("MATERIAL"))
        give(deck, block, block.made(Truss, material=material, A=area))
        return
    material = of_solid(deck, block, block.option("MATERIAL"))
    give(deck, block, Solid(material=material))
    if not isinstance(material, Material):
        _put_frames(deck, block, _axes(deck, block), keys)


def _plane_stress(deck: Deck, block: Block, keys: list[Key]) -> None:
    """Make shells of plane stress elements, and of their nodes supports that keep them in their plane."""
    material = of_sheet(deck, block, block.option("MATERIAL"))
    thickness = (block.row().real(0, "thickness", 0.0) or 1.0) * deck.units.length
    give(deck, block, block.made(Shell, material=material, thickness=thickness))
    if isinstance(material, Orthotropic):
        _put_axes(deck, _axes(deck, block), keys)
    axes = np.array([deck.turned(block.scope, axis) for axis in np.eye(3)])
    for key in keys:
        deck.elements[key] = deck.elements[key]._replace(family="shell")
        deck.current.setdefault("plane", {}).update(dict.fromkeys(deck.elements[key].nodes, axes))
    deck.note(
        "plane stress elements are shells of their thickness, which also bend out of their plane; a support by set "
        "'plane' keeps them in it"
    )


def _put_frames(deck: Deck, block: Block, axes: Orientation | None, keys: list[Key]) -> None:
    """Give every solid the axes of its material: of the orientation, else of the part."""
    own = np.array([deck.turned(block.scope, axis) for axis in np.eye(3)])
    for key in keys:
        for kind, row in deck.elements[key].cells:
            centre = np.mean([deck.points[i] for i in deck.cells[kind][row]], axis=0)
            deck.put("frame", (kind, row), own if axes is None else axes.axes_at(deck, key, centre))


def shell_section(deck: Deck, block: Block) -> None:
    """``*SHELL SECTION`` and ``*SHELL GENERAL SECTION`` with a material, or with the layers of a laminate."""
    for name in SHELL_OPTIONS:
        if name in block.options:
            block.refuse(f"has {name}, which is not read; give the shell by thickness and material")
    _, keys = section_set(deck, block, "shell")
    if not keys:
        return
    axes = _axes(deck, block)
    if "COMPOSITE" in block.options:
        plies, turned = _plies(deck, block, axes, keys)
        total = sum(ply.thickness for ply in plies)
        section = block.made(Shell, plies=tuple(plies), offset=_offset(block) * total)
        _put_axes(deck, turned or axes, keys)
    else:
        t = _thickness(deck, block, keys) * deck.units.length
        material = of_sheet(deck, block, _material(block))
        section = block.made(Shell, material=material, thickness=t, offset=_offset(block) * t)
        if isinstance(material, Orthotropic):
            _put_axes(deck, axes, keys)
    deck.current["shell"] = block
    give(deck, block, section)


def _material(block: Block) -> str:
    if not block.options.get("MATERIAL"):
        block.refuse("has no MATERIAL: general stiffnesses of a shell are not read; give material and thickness")
    return block.options["MATERIAL"]


def _thickness(deck: Deck, block: Block, keys: list[Key]) -> float:
    """Return the thickness of a section; where it differs by node, every element has its own ones."""
    if "NODAL THICKNESS" not in block.options:
        return block.row().real(0, "thickness")
    table: dict[int, tuple[float, float]] = deck.current.get("nodal thickness", {})
    values = [(key, [table.get(n, (np.nan,))[0] for n in deck.elements[key].nodes]) for key in keys]
    every = np.concatenate([own for _, own in values])
    if not np.isfinite(every).all():
        block.refuse("has NODAL THICKNESS, but not all its nodes have one; give it for every node")
    if np.ptp(every) > 0:
        if _offset(block):
            block.refuse("has an OFFSET of a thickness that differs by node; give the mid-surface")
        for key, own in values:
            for kind, row in deck.elements[key].cells:
                count = len(own) if CELLS[kind].second_order else len(CELLS[kind].corners)
                deck.put("thickness", (kind, row), np.array(own[:count]) * deck.units.length)
    return float(every.mean())


def nodal_thickness(deck: Deck, block: Block) -> None:
    """``*NODAL THICKNESS``: kept for the sections that ask for it; beams of CalculiX have two."""
    table = deck.current.setdefault("nodal thickness", {})
    for row in block.rows:
        own = row.real(1, "thickness")
        own = own, row.real(2, "second thickness", own)
        table.update(dict.fromkeys(deck.nodes_of(row, block.scope, row.text(0)), own))


def _offset(block: Block) -> float:
    """From the nodes to the middle of the shell, over its thickness: the deck says where the nodes lie in it."""
    text = block.options.get("OFFSET", "0").upper()
    if text in ("SPOS", "SNEG"):
        return -0.5 if text == "SPOS" else 0.5
    return -Row([text], block.file, block.line).real(0, "OFFSET", 0.0)


def _axes(deck: Deck, block: Block) -> Orientation | None:
    name = block.options.get("ORIENTATION", "")
    return deck.named("orientation", block, block.scope, name) if name else None


def _plies(deck: Deck, block: Block, axes: Orientation | None, keys: list[Key]) -> tuple[list[Ply], Orientation | None]:
    """Layers from the bottom up: thickness, points, material, angle or orientation; or one material for all."""
    plies: list[Ply] = []
    own: set[str] = set()
    for row in block.rows:
        name = row.text(2) or block.options.get("MATERIAL", "")
        if not name:
            raise row.error("the layer has no material; name it in field 3")
        text = row.text(3) or (block.options.get("ORIENTATION", "") if "COMPOSITE" in block.options else "")
        angle = 0.0
        try:
            angle = float(row.text(3) or 0.0)
        except ValueError:
            own.add(text.upper())
        material: Material | Orthotropic = of_sheet(deck, block, name)
        t = row.real(0, "thickness of the layer") * deck.units.length
        plies.append(block.made(Ply, material=material, thickness=t, angle=float(np.radians(angle))))
    if not plies:
        block.refuse("has no layers; give thickness, points and material of each")
    if len(own) > 1 or (own and any(ply.angle for ply in plies)):
        block.refuse("has layers with several orientations; give one for all, and an angle for each layer")
    if "SYMMETRIC" in block.options:
        plies += plies[::-1]
    return plies, deck.named("orientation", block, block.scope, own.pop()) if own else None


def _put_axes(deck: Deck, axes: Orientation | None, keys: list[Key]) -> None:
    """Give every element its axis 1: of the orientation, else the global x, or z where x is normal to it."""
    for key in keys:
        for kind, row in deck.elements[key].cells:
            corners = np.array([deck.points[i] for i in deck.cells[kind][row]])
            normal = np.cross(corners[2] - corners[0], corners[min(3, len(corners) - 1)] - corners[1])
            size = np.linalg.norm(normal) or 1.0
            if axes is None:
                near = abs(normal[0]) > np.cos(np.radians(NORMAL)) * size
                axis = np.array([0.0, 0.0, 1.0]) if near else np.array([1.0, 0.0, 0.0])
            else:
                rows = axes.axes_at(deck, key, corners.mean(axis=0))
                axis = rows[axes.axis % 3]  # the one after that along the normal
            deck.put("axis", (kind, row), axis)
