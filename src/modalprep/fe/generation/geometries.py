"""Parametric shapes, one function each; its keywords are the parameters of `modalprep mesh`.

A shape draws with a `Drawing` (generate.py) and names groups; where nodes do not lie on what it draws, it returns
``transform(points) -> points``, which moves them once the mesh is made. A keyword is annotated ``Annotated[type, unit,
meaning]``, followed by `ZERO` or `SIGNED` where the number need not be positive. Lengths in m, angles in degrees; the
long axis is x (of the tower z), the root is at the origin, the tip at the far end.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, pi, radians
from typing import Annotated, Any, Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.gmsh_session import SEGMENTS, TETRAHEDRA, refuse_too_many

ZERO, SIGNED = "may be zero", "may be negative"
SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))

Face = Literal["quad", "triangle"]
Size = Annotated[float, "m", "size of an element; 0: chosen to suit", ZERO]
Facets = Annotated[Face, "", "kind of element"]
Order = Annotated[Literal[1, 2], "", "order of the elements"]


def groups(*names: str) -> Callable[[Callable], Callable]:
    """Decorate a shape with the groups it creates."""

    def mark(shape: Callable) -> Callable:
        vars(shape)["groups"] = names
        return shape

    return mark


def steps(length: float, size: float) -> int:
    """Return how many elements of about `size` divide `length`.

    Examples
    --------
    >>> steps(1.0, 0.1), steps(1.0, 0.11), steps(0.1, 1.0)
    (10, 10, 1)
    """
    return max(1, ceil(length / size - 1e-9))


@groups("beam", "root", "tip")
def beam(
    draw: Any,
    *,
    length: Annotated[float, "m", "along x"] = 1.0,
    elements: Annotated[int, "", "number of elements"] = 20,
) -> None:
    """Straight beam of line elements."""
    refuse_too_many(elements, "choose fewer elements")
    geo = draw.model.geo
    root = geo.addPoint(0, 0, 0)
    (_, tip), (_, line) = geo.extrude([(0, root)], length, 0, 0, numElements=[elements])
    draw.name(1, beam=[line])
    draw.name(0, root=[root], tip=[tip])


@groups("plate", "root", "tip", "edge", "hole", "corners")
def plate(
    draw: Any,
    *,
    length: Annotated[float, "m", "along x"] = 1.0,
    width: Annotated[float, "m", "along y, half of it below y = 0"] = 0.5,
    hole: Annotated[float, "m", "diameter of a hole in the middle; 0: none", ZERO] = 0.0,
    size: Size = 0.0,
    element: Facets = "quad",
) -> None:
    """Rectangular plate, with or without a round hole."""
    if hole > 0.9 * min(length, width):
        raise InputError(
            f"hole = {hole:g} m does not fit into a plate of {length:g} m by {width:g} m; "
            f"make it smaller than {0.9 * min(length, width):g} m"
        )
    size = size or min(length, width) / 10
    least = min(size, pi * hole / SEGMENTS)
    rim = draw.circle((length / 2, 0), hole / 2, least) if hole else []
    drawn = draw.strips(length, [-width / 2, width / 2], size, element, rim)
    if rim:
        draw.fill(least, size, element)
    draw.name(2, plate=drawn["faces"])
    draw.name(1, root=drawn["root"], tip=drawn["tip"], hole=rim)
    draw.name(1, edge=[*drawn["root"], *drawn["tip"], *drawn["rows"]])
    draw.name(0, corners=drawn["corners"])


@groups("skin", "stiffeners", "root", "tip", "edge", "corners")
def stiffened_panel(
    draw: Any,
    *,
    length: Annotated[float, "m", "along x"] = 2.0,
    width: Annotated[float, "m", "along y, half of it below y = 0"] = 1.0,
    stiffeners: Annotated[int, "", "number of stiffeners, along x, at equal spacing"] = 4,
    size: Size = 0.0,
    element: Facets = "quad",
) -> None:
    """Flat skin with beam elements for stiffeners, which share its nodes."""
    refuse_too_many(stiffeners, "choose fewer stiffeners")
    pitch = width / stiffeners
    inner = [pitch * (k + 0.5) - width / 2 for k in range(stiffeners)]
    drawn = draw.strips(length, [-width / 2, *inner, width / 2], size or min(pitch, length) / 4, element)
    rows = drawn["rows"]
    draw.name(2, skin=drawn["faces"])
    draw.name(1, stiffeners=rows[1:-1], root=drawn["root"], tip=drawn["tip"])
    draw.name(1, edge=[*drawn["root"], *drawn["tip"], rows[0], rows[-1]])
    draw.name(0, corners=drawn["corners"])


@groups("tube", "root", "tip")
def tube(
    draw: Any,
    *,
    length: Annotated[float, "m", "along x"] = 1.0,
    radius: Annotated[float, "m", "of the middle surface"] = 0.1,
    size: Size = 0.0,
    element: Facets = "quad",
) -> None:
    """Round tube: a shell closed around x."""
    size = size or 2 * pi * radius / 24
    drawn = draw.rolled(length, radius, 0.0, 2 * pi, max(SEGMENTS, steps(2 * pi * radius, size)), size, element)
    draw.name(2, tube=drawn["faces"])
    draw.name(1, root=drawn["root"], tip=drawn["tip"])


@groups("boom", "root", "tip", "edge")
def boom(
    draw: Any,
    *,
    length: Annotated[float, "m", "along x"] = 2.0,
    radius: Annotated[float, "m", "of the middle surface, about x"] = 0.02,
    angle: Annotated[float, "deg", "of the arc, halved by +z: tape spring 60 to 180, slit tube up to 355"] = 300.0,
    size: Size = 0.0,
    element: Facets = "quad",
) -> None:
    """Deployable boom: a tape spring or slit tube, a shell open along its length."""
    if angle > 355:
        raise InputError(f"angle = {angle:g} deg leaves no slit; make it at most 355, or take shape tube")
    arc = radians(angle)
    size = size or arc * radius / 8
    around = max(ceil(SEGMENTS * angle / 360), steps(arc * radius, size))
    drawn = draw.rolled(length, radius, (pi - arc) / 2, arc, around, size, element)
    draw.name(2, boom=drawn["faces"])
    draw.name(1, root=drawn["root"], tip=drawn["tip"], edge=drawn["rows"])


@groups("blade", "root", "tip", "edge")
def blade(
    draw: Any,
    *,
    span: Annotated[float, "m", "along x"] = 2.0,
    root_chord: Annotated[float, "m", "width at x = 0, along y"] = 0.3,
    tip_chord: Annotated[float, "m", "width at x = span"] = 0.15,
    twist: Annotated[float, "deg", "of the tip about x, linear along the span", SIGNED] = 15.0,
    size: Size = 0.0,
    element: Facets = "quad",
) -> Callable[[np.ndarray], np.ndarray]:
    """Tapered blade twisted about its middle line."""
    if abs(twist) > 360:
        raise InputError(f"twist = {twist:g} deg is more than one turn; make it at most 360")
    chord = max(root_chord, tip_chord)
    drawn = draw.strips(span, [-chord / 2, chord / 2], size or min(chord, span) / 8, element)
    draw.name(2, blade=drawn["faces"])
    draw.name(1, root=drawn["root"], tip=drawn["tip"], edge=drawn["rows"])

    def transform(points: np.ndarray) -> np.ndarray:
        s = points[:, 0] / span
        across = points[:, 1] * (root_chord + (tip_chord - root_chord) * s) / chord
        return np.column_stack([points[:, 0], across * np.cos(s * radians(twist)), across * np.sin(s * radians(twist))])

    return transform


@groups("legs", "braces", "root", "tip")
def truss_tower(
    draw: Any,
    *,
    height: Annotated[float, "m", "along z"] = 10.0,
    base: Annotated[float, "m", "side of the square at z = 0"] = 2.0,
    top: Annotated[float, "m", "side of the square at z = height"] = 1.0,
    bays: Annotated[int, "", "number of storeys, of equal height"] = 6,
    bracing: Annotated[Literal["cross", "single"], "", "two diagonals per side and bay, or one, in zigzag"] = "cross",
    elements: Annotated[int, "", "elements per member; 1 for hinged bars"] = 1,
) -> None:
    """Square tower of four legs; each bay has a ring on top, and diagonals that do not touch where they cross."""
    refuse_too_many(16.0 * bays * elements, "choose fewer bays or elements")
    geo = draw.model.geo
    corner: list[list[int]] = []
    for k in range(bays + 1):
        half = (base + (top - base) * k / bays) / 2
        corner.append([geo.addPoint(sx * half, sy * half, height * k / bays) for sx, sy in SQUARE])
    members: dict[str, list[tuple[int, int]]] = {"legs": [], "braces": []}
    for k in range(bays):
        for i in range(4):
            low = (corner[k][i], corner[k][i - 3])
            high = (corner[k + 1][i], corner[k + 1][i - 3])
            members["legs"].append((low[0], high[0]))
            diagonals = [(low[0], high[1]), (low[1], high[0])]
            members["braces"] += [high, *(diagonals if bracing == "cross" else diagonals[k % 2 :][:1])]
    lines = {name: [geo.addLine(*ends) for ends in pairs] for name, pairs in members.items()}
    for line in lines["legs"] + lines["braces"]:
        geo.mesh.setTransfiniteCurve(line, elements + 1)
    draw.name(1, **lines)
    draw.name(0, root=corner[0], tip=corner[-1])


@groups("box", "root", "tip")
def box(
    draw: Any,
    *,
    length: Annotated[float, "m", "along x"] = 1.0,
    width: Annotated[float, "m", "along y, half of it below y = 0"] = 0.2,
    height: Annotated[float, "m", "along z, half of it below z = 0"] = 0.1,
    size: Size = 0.0,
    element: Annotated[Literal["tetrahedron", "hexahedron"], "", "kind of element"] = "tetrahedron",
    order: Order = 2,
) -> None:
    """Solid block."""
    size = size or min(length, width, height) / 2
    sides = (length, width, height)
    number = [steps(side, size) for side in sides]
    refuse_too_many(np.prod(number, dtype=float) * (1 if element == "hexahedron" else TETRAHEDRA), "give a larger size")
    body = draw.model.occ.addBox(0, -width / 2, -height / 2, *sides)
    draw.model.occ.synchronize()
    draw.fill(size, size, element, order)
    if element == "hexahedron":
        for _, line in draw.model.getEntities(1):
            reach = np.subtract(*np.split(np.array(draw.model.getBoundingBox(1, line)), 2))
            draw.model.mesh.setTransfiniteCurve(line, number[int(np.argmax(abs(reach)))] + 1)
        for _, face in draw.model.getEntities(2):
            draw.model.mesh.setTransfiniteSurface(face)
        draw.model.mesh.setTransfiniteVolume(body)
    draw.name(3, box=[body])
    y, z = width / 2, height / 2
    draw.name(2, root=draw.faces_within((0, -y, -z), (0, y, z)))
    draw.name(2, tip=draw.faces_within((length, -y, -z), (length, y, z)))


@groups("bracket", "bolt_a", "bolt_b")
def l_bracket(
    draw: Any,
    *,
    length: Annotated[float, "m", "of the foot, along x, from the outer corner"] = 0.08,
    height: Annotated[float, "m", "of the upright, along z, from the outer corner"] = 0.06,
    width: Annotated[float, "m", "along y, half of it below y = 0"] = 0.04,
    thickness: Annotated[float, "m", "of foot and upright"] = 0.006,
    fillet: Annotated[float, "m", "radius of the inner corner; 0: sharp", ZERO] = 0.005,
    hole: Annotated[float, "m", "diameter of both bolt holes"] = 0.009,
    size: Size = 0.0,
    order: Order = 2,
) -> None:
    """Angle bracket with a bolt hole in the foot (bolt_a, along z) and one in the upright (bolt_b, along x)."""
    inner = thickness + fillet
    room = 0.9 * min(length - inner, height - inner, width)
    if hole > room:
        least = f"make it smaller than {room:g} m" if room > 0 else "make length and height larger"
        raise InputError(f"hole = {hole:g} m does not fit beside the fillet; {least}")
    size = size or thickness / 1.5
    refuse_too_many(TETRAHEDRA * (length + height) * thickness * width / size**3, "give a larger size")
    occ = draw.model.occ
    body = occ.extrude([(2, _profile(occ, length, height, -width / 2, thickness, fillet))], 0, width, 0)
    foot, upright = (length + inner) / 2, (height + inner) / 2
    axes = (foot, 0, 0, 0, 0, thickness), (0, 0, upright, thickness, 0, 0)
    drills = [(3, occ.addCylinder(*axis, hole / 2)) for axis in axes]
    body, _ = occ.cut([entity for entity in body if entity[0] == 3], drills)
    occ.synchronize()
    draw.fill(size / 10, size, "tetrahedron", order)
    r = hole / 2
    draw.name(3, bracket=[tag for _, tag in body])
    draw.name(2, bolt_a=draw.faces_within((foot - r, -r, 0), (foot + r, r, thickness)))
    draw.name(2, bolt_b=draw.faces_within((0, -r, upright - r), (thickness, r, upright + r)))


def _profile(occ: Any, length: float, height: float, y: float, t: float, fillet: float) -> int:
    """Draw the L in the plane of the foot's side; return its face."""
    corner = [(0, 0), (length, 0), (length, t), (t + fillet, t), (t, t + fillet), (t, height), (0, height)]
    if not fillet:
        del corner[3]
    points = [occ.addPoint(x, y, z) for x, z in corner]
    pairs = list(zip(points, points[1:] + points[:1], strict=True))
    round_one = [occ.addCircleArc(pairs[3][0], occ.addPoint(t + fillet, y, t + fillet), pairs[3][1])] if fillet else []
    straight = [occ.addLine(*pair) for k, pair in enumerate(pairs) if not (fillet and k == 3)]
    return occ.addPlaneSurface([occ.addCurveLoop(straight[:3] + round_one + straight[3:])])


SHAPES = (beam, plate, stiffened_panel, tube, box, truss_tower, boom, l_bracket, blade)
