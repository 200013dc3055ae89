"""Sections of beams: by shape, and by area and moments."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from modalprep.fe.properties.materials import Material
from modalprep.fe.properties.properties import Beam
from modalprep.fe.readers.abaqus.deck import Deck, Key
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.materials import isotropic
from modalprep.fe.readers.abaqus.profiles import CALCULIX, SHAPES, Profile
from modalprep.fe.readers.abaqus.sections import give, section_set

SLIGHT = 1e-6  # of the larger moment, for one that is zero
CIRC = "has SECTION=CIRC, which is a radius in Abaqus and one or two diameters in CalculiX"


def beam_section(deck: Deck, block: Block) -> None:
    """``*BEAM SECTION``: a shape and a material."""
    _, keys = section_set(deck, block, "beam")
    if not keys:
        return
    profile, second = _shape(deck, block, _nodal_thickness(deck, block, keys))
    _finish(deck, block, keys, profile, second, isotropic(deck, block, block.option("MATERIAL")), 1.0)


def beam_general_section(deck: Deck, block: Block) -> None:
    """``*BEAM GENERAL SECTION``: a shape, or area and moments; with E and G of its own."""
    _, keys = section_set(deck, block, "beam")
    if not keys:
        return
    if block.choice("SECTION", "GENERAL") == "GENERAL":
        A, I11, I12, I22, J = block.row().reals(0, 5, "a value of the section")
        slight = SLIGHT * max(I11, I22)
        if not (I11 and I22 and J):
            deck.note(f"zero I11, I22 or J of beams is {SLIGHT:g} of the larger moment (first in line {block.line})")
        profile = Profile(A, I11 or slight, I22 or slight, I12, J or slight, k=1.0)
        second = 1
    else:
        profile, second = _shape(deck, block, None)
    moduli = block.row(second + 1)
    E, G = moduli.real(0, "E"), moduli.real(1, "G")
    if not (E > 0 and G > 0):
        raise moduli.error(f"E = {E:g} and G = {G:g} must be positive; give both")
    nu = E / (2 * G) - 1
    nu = nu if -1 < nu < 0.5 else 0.0
    text = block.options.get("DENSITY", "")
    rho = Row([text], block.file, block.line).real(0, "DENSITY", 0.0) * deck.units.density
    if not rho:
        deck.note(f"beams of {block.options['ELSET']} have no DENSITY: they have no mass")
    made = block.made(Material, E=E * deck.units.stress, nu=nu, rho=rho)
    _finish(deck, block, keys, profile, second, made, G / made.G * deck.units.stress)


def _shape(deck: Deck, block: Block, thicknesses: tuple[float, float] | None) -> tuple[Profile, int]:
    """Return the profile, of the given thicknesses or those of its line, and the number of the line with n1."""
    kind = block.option("SECTION").upper()
    count, law = _law(deck, block, kind)
    lines = 1 if count else 1 + block.row().integer(0, "number of walls")
    row = block.row() if count else _walls(block, lines)
    if thicknesses is not None:
        row = row._replace(fields=[repr(t) for t in thicknesses])
    elif kind in ("RECT", "CIRC") and count == 2 and not row.text(1) and deck.spoken.dialect == "calculix":
        row = row._replace(fields=[row.text(0)] * 2)
    values = [row.real(k, f"size {k + 1} of {kind}") for k in range(count or len(row.fields))]
    if count and not min(values) > (-math.inf if kind in ("I", "T", "GENERAL") else 0):
        raise row.error(f"a size of {kind} is not positive; correct it")
    if kind == "GENERAL" and values[2]:
        raise row.error("U1 has no product of inertia I12; give the moments about the principal axes")
    try:
        profile = law(*values)
    except ZeroDivisionError:
        raise row.error(f"the sizes of {kind} make no section; correct them") from None
    if not (profile.A > 0 and profile.I11 > 0 and profile.I22 > 0 and profile.J > 0):
        raise row.error(f"the sizes of {kind} make no section (walls that overlap?); correct them")
    return profile, lines if count else lines - 1


def _law(deck: Deck, block: Block, kind: str) -> tuple[int, Callable[..., Profile]]:
    """Return how many sizes a shape has, and the profile of them."""
    if kind == "CIRC" and deck.dialect(block, CIRC) == "calculix":
        return CALCULIX[kind]
    if kind == "GENERAL" and deck.spoken.dialect == "calculix":
        return CALCULIX[kind]
    if kind not in SHAPES:
        block.refuse(f"has SECTION={kind}; known are {', '.join(SHAPES)}, and GENERAL with area and moments")
    return SHAPES[kind]


def _nodal_thickness(deck: Deck, block: Block, keys: list[Key]) -> tuple[float, float] | None:
    """Return the two thicknesses of the nodes of a section that asks for them, of CalculiX."""
    if "NODAL THICKNESS" not in block.options:
        return None
    table: dict[int, tuple[float, float]] = deck.current.get("nodal thickness", {})
    own = [table.get(node) for key in keys for node in deck.elements[key].nodes]
    if None in own or block.option("SECTION").upper() not in ("RECT", "CIRC"):
        block.refuse("has NODAL THICKNESS, but not all its nodes have one, or it is none of RECT and CIRC; correct it")
    sizes = {pair for pair in own if pair is not None}
    if len(sizes) > 1:
        block.refuse("has NODAL THICKNESS that differs from node to node; give every element a section of its own")
    return sizes.pop()


def _walls(block: Block, lines: int) -> Row:
    fields: list[str] = []
    for row in block.rows[: lines - 1]:
        fields += [f for f in row.fields if f]
    return Row(fields, block.file, block.row().line)


def _finish(deck: Deck, block: Block, keys: list[Key], profile: Profile, second: int, material, factor: float) -> None:
    """Give the section, and every element its direction; `factor` on J and k is G over that of the material."""
    m = deck.units.length
    major, minor, angle = profile.principal
    c = math.cos(angle)
    s = math.sin(angle)
    x1, x2 = profile.centroid
    for k, name in enumerate(("OFFSET1", "OFFSET2")):  # of CalculiX, in thicknesses
        shift = Row([block.options.get(name, "")], block.file, block.line).real(0, name, 0.0) * profile.size[k]
        x1, x2 = (x1 - shift, x2) if k == 0 else (x1, x2 - shift)
    own = deck.current.get("shear", {}).get(id(block))
    ky, kz = profile.k, profile.k
    if own:
        ky, kz = (stiffness * deck.units.stress * m**2 / (material.G * factor * profile.A * m**2) for stiffness in own)
    cubic = all(deck.elements[key].type.startswith("B33") for key in keys)
    section = block.made(
        Beam,
        material=material,
        A=profile.A * m**2,
        Iy=major * m**4,
        Iz=minor * m**4,
        J=profile.J * factor * m**4,
        ky=ky * factor,
        kz=kz * factor,
        offset=((c * x1 + s * x2) * m, (c * x2 - s * x1) * m),
        theory="euler-bernoulli" if cubic else "timoshenko",
        fibres=tuple(((c * a + s * b) * m, (c * b - s * a) * m) for a, b in profile.points),
    )
    give(deck, block, section)
    row = block.row(second)
    n1 = np.array(row.reals(0, 3, "n1"))
    n1 = deck.turned(block.scope, n1 if n1.any() else np.array([0.0, 0.0, -1.0]))
    for key in keys:
        _direct(deck, block, key, n1, angle)


def _direct(deck: Deck, block: Block, key: Key, n1: np.ndarray, angle: float) -> None:
    """Give an element the direction of its major axis: e3 = n2 turned by `angle` about the beam."""
    element = deck.elements[key]
    for kind, row in element.cells:
        a, b = (deck.points[i] for i in deck.cells[kind][row])
        own = deck.points[element.extra[0]] - deck.points[element.nodes[0]] if element.extra else n1
        if given := deck.current.get("normals", {}).get(key):
            own = np.cross(np.sum(given, axis=0), b - a)
        n2 = np.cross(b - a, own)
        if not np.linalg.norm(n2) > 1e-6 * np.linalg.norm(b - a) * np.linalg.norm(own):
            block.refuse(f"gives element {key[1]} a direction n1 along it; give another in its second line")
        n2 = n2 / np.linalg.norm(n2)
        across = np.cross(n2, b - a)
        across = across / np.linalg.norm(across)
        deck.put("up", (kind, row), math.cos(angle) * n2 - math.sin(angle) * across)


def normal(deck: Deck, block: Block) -> None:
    """``*NORMAL`` of Abaqus: axis 2 of beams at a node of an element; the mean of its nodes holds for an element."""
    if block.choice("TYPE", "ELEMENT") != "ELEMENT" or deck.spoken.dialect == "calculix":
        deck.skipped.append(("*NORMAL", f"line {block.line}"))
        return
    normals = deck.current.setdefault("normals", {})
    for row in block.rows:
        own = np.array(row.reals(2, 3, "a direction"))
        for key in deck.elements_of(row, block.scope, row.text(0)):
            if deck.elements[key].family == "beam":
                normals.setdefault(key, []).append(deck.turned(block.scope, own / (np.linalg.norm(own) or 1.0)))
            else:
                deck.skipped.append(("*NORMAL of elements that are no beams", f"line {row.line}"))


def transverse_shear(deck: Deck, block: Block) -> None:
    """``*TRANSVERSE SHEAR STIFFNESS`` of a beam: it stands behind the section that it belongs to."""
    if block.owner is None or not block.owner.keyword.startswith("BEAM"):
        block.refuse("belongs to no section of beams; those of shells follow from thickness and material")
    K23 = block.row().real(0, "K23")
    K13 = block.row().real(1, "K13", 0.0)
    deck.current.setdefault("shear", {})[id(block.owner)] = (K13 or K23, K23)
