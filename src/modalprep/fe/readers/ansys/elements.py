"""Elements of Ansys' library to cells with their sections."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from modalprep.fe.mesh.mesh import Equation
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.properties.properties import Shell, Solid
from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.deck import Element
from modalprep.fe.readers.ansys.matrices import add_matrix
from modalprep.fe.readers.coverage import Entry

# Places in the list I, J, ... of a brick of the corners and the mid-side nodes of what it degenerates to.
BRICKS = {
    "hexahedron": (range(8), range(8, 20)),
    "wedge": ((0, 1, 2, 4, 5, 6), (8, 9, 11, 12, 13, 15, 16, 17, 18)),
    "pyramid": (range(5), (8, 9, 10, 11, 16, 17, 18, 19)),
    "tetra": ((0, 1, 2, 4), (8, 9, 11, 16, 17, 18)),
}
QUADS = {"quad": (range(4), range(4, 8)), "triangle": (range(3), (4, 5, 7))}
TETRAS = {"tetra": (range(4), range(4, 10))}
COUNT = {"hexahedron": 20, "wedge": 15, "pyramid": 13, "tetra": 10, "quad": 8, "triangle": 6}
PARALLEL = 1e-4  # sine of the angle to the global z axis below which Ansys takes the y axis


def _brick_shape(nodes: tuple[int, ...]) -> str:
    """Return what eight corners, of which some may coincide, are."""
    same = nodes[2] == nodes[3], len(set(nodes[4:8])) == 1
    if same[1]:
        return "tetra" if same[0] else "pyramid"
    return "wedge" if same[0] and nodes[6] == nodes[7] else "hexahedron"


def _places(b: Builder, element: Element, shape: str, table: dict, corners: int) -> tuple[str, list[int]]:
    """Return the cell and the indices of its nodes, of second order where there is a mid-side node."""
    own, middle = table[shape]
    there = [k < len(element.nodes) and element.nodes[k] > 0 for k in middle]
    if len(element.nodes) <= corners or not any(there):
        return shape, list(own)
    return f"{shape}{COUNT[shape]}", [*own, *middle]


def add_solid(b: Builder, element: Element) -> None:
    """Add a brick, or what its corners leave of it."""
    if len(element.nodes) < 8:
        raise b.deck.error(element, f"it has {len(element.nodes)} nodes and needs 8 or 20; export the model again")
    kind, places = _places(b, element, _brick_shape(element.nodes), BRICKS, 8)
    _add_cell(b, element, kind, places)


def add_tetra(b: Builder, element: Element) -> None:
    """Add a tetrahedron."""
    if len(element.nodes) >= 8 and len(element.nodes) != 10:  # a brick of the same corners
        add_solid(b, element)
        return
    kind, places = _places(b, element, "tetra", TETRAS, 4)
    _add_cell(b, element, kind, places)


def solid_group(b: Builder, element: Element) -> str:
    """Return the group of a solid."""
    return b.group(element, "m", lambda e: Solid(material=b.materials.solid(e, e.material)))


def note_solids(b: Builder, element: Element, kind: str, rows: Iterable[int]) -> None:
    """Say how solids like one are integrated."""
    if b.deck.types[element.type].name == "185" and b.deck.types[element.type].options.get(2, 0) == 1:
        b.deck.note(ONE_POINT)
    if _is_reduced(b, element) and kind in ("hexahedron20", "wedge15"):
        b.put_all("integration", kind, rows, 1.0 if kind == "hexahedron20" else 2.0)


def _add_cell(b: Builder, element: Element, kind: str, places: list[int]) -> None:
    b.refuse_without_element(element, kind, Solid)
    name = solid_group(b, element)
    nodes = b.cell_nodes(element, kind, places, 3)
    row = b.cell(element, kind, nodes, name)
    note_solids(b, element, kind, [row])
    if system := b.system(element):
        b.put("frame", kind, row, system.axes_at(b.centre(nodes, b.points)))


def _is_reduced(b: Builder, element: Element) -> bool:
    """Whether the stiffness has 2 x 2 x 2 points: by default of SOLID186, by KEYOPT(11) = 1 of SOLID95."""
    kind = b.deck.types[element.type]
    return (kind.name == "186" and kind.options.get(2, 0) == 0) or (kind.name == "95" and kind.options.get(11, 0) == 1)


def shell_group(b: Builder, element: Element) -> str:
    """Return the group of a shell."""
    old = b.deck.types[element.type].name == "63"
    return b.group(element, "mrs", b.sections.thin_shell if old else b.sections.shell)


def add_shell(b: Builder, element: Element) -> None:
    """Add a quadrilateral, or a triangle."""
    if len(element.nodes) < 3:
        raise b.deck.error(element, f"it has {len(element.nodes)} nodes and needs 4 or 8; export the model again")
    triangle = len(element.nodes) == 3 or element.nodes[2] == element.nodes[3]
    kind, places = _places(b, element, "triangle" if triangle else "quad", QUADS, 4)
    b.refuse_without_element(element, kind, Shell)
    name = shell_group(b, element)
    nodes = b.cell_nodes(element, kind, places, 6)
    b.turning.update(nodes)
    b.put("axis", kind, b.cell(element, kind, nodes, name), _shell_axis(b, element, nodes, triangle))


def _shell_axis(b: Builder, element: Element, nodes: list[int], triangle: bool) -> np.ndarray:
    """Return x of the material: that of ESYS, else the middle of a quadrilateral's sides I-J and L-K."""
    if system := b.system(element):
        return system.axes_at(b.centre(nodes, b.points))[0]
    return middle_sides(b.points[nodes[: 3 if triangle else 4]], triangle)


def middle_sides(x: np.ndarray, triangle: bool) -> np.ndarray:
    """Return the side I-J of shells ``x (..., nodes, 3)``, of quadrilaterals twice the middle of I-J and L-K."""
    side = x[..., 1, :] - x[..., 0, :]
    return side if triangle else side + x[..., 2, :] - x[..., 3, :]


def _link(b: Builder, element: Element) -> None:
    name = b.group(element, "mrs", b.sections.link)
    b.cell(element, "line", b.nodes(element, range(2)), name)


def _beam(b: Builder, element: Element) -> None:
    """Beams of two or three nodes (the ends, then the middle), and a node of orientation."""
    number = b.deck.types[element.type].name
    kind, count = ("line3", 3) if number in ("189", "289") else ("line", 2)
    nodes = b.nodes(element, range(count))
    up = _up(b, element, count)
    b.turning.update(nodes)
    name = b.group(element, "mrs", b.sections.beam4 if number == "4" else b.sections.beam)
    b.put("up", kind, b.cell(element, kind, nodes, name), up)


def _up(b: Builder, element: Element, place: int) -> np.ndarray:
    """Return a direction in the plane of x and z: towards the orientation node, else up along the global z axis."""
    first, last = b.points[b.nodes(element, (0, 1))]
    axis = (last - first) / (np.linalg.norm(last - first) or 1.0)
    if place < len(element.nodes) and element.nodes[place] > 0:
        up = b.points[b.nodes(element, (place,))[0]] - first
        if not np.linalg.norm(np.cross(axis, up)) > PARALLEL * np.linalg.norm(up):
            raise b.deck.error(element, f"its orientation node {element.nodes[place]} lies on its axis; move it")
    elif np.hypot(*axis[:2]) < PARALLEL:
        up = np.array([-np.sign(axis[2]), 0.0, 0.0])  # so that y of the section is the global y axis
    else:
        up = np.array([0.0, 0.0, 1.0])
    angle = b.deck.reals.get(element.real, [])[5:6] if b.deck.types[element.type].name == "4" else []
    return _turned(axis, up, np.radians(angle[0])) if any(angle) else up


def _turned(axis: np.ndarray, up: np.ndarray, angle: float) -> np.ndarray:
    """Return the z axis of a section, turned about the beam from y towards z."""
    y = np.cross(up, axis)
    y /= np.linalg.norm(y)
    return np.cos(angle) * np.cross(axis, y) - np.sin(angle) * y


def _mass(b: Builder, element: Element) -> None:
    values = b.sections.constants(element, 6)
    options = b.deck.types[element.type].options
    if options.get(1) or options.get(3, 0) not in (0, 2):
        raise b.deck.error(
            element, "KEYOPT(1) = 0 and KEYOPT(3) = 0 or 2 of MASS21 can be read only; give masses by them"
        )
    if options.get(3) == 2:
        values = [values[0]] * 3 + [0.0] * 3
    if not values[0] == values[1] == values[2]:
        raise b.deck.error(element, f"its masses {values[:3]} differ with the direction; give three equal ones")
    inertia = (*(x * b.units.mass * b.units.length**2 for x in values[3:]), 0.0, 0.0, 0.0)
    if element.nodes[0] in b.deck.angles and any(inertia):
        raise b.deck.error(element, "its node is turned (THXY to THZX); give the inertia in global axes")
    name = b.group(
        element, "r", lambda e: b.sections.made(e, PointMass, mass=values[0] * b.units.mass, inertia=inertia)
    )
    b.cell(element, "vertex", b.nodes(element, (0,)), name)


def _spring(b: Builder, element: Element) -> None:
    """COMBIN14: along or about the line between its nodes, or in one component of both."""
    k, c, *more = b.sections.constants(element, 4)
    options = b.deck.types[element.type].options
    if any(more):
        b.deck.note("COMBIN14: its damping by the square of the speed (CV2) and its initial state are left out")
    along, turns = options.get(2, 0), options.get(3, 0)
    if not 0 <= along <= 6 or turns not in (0, 1):
        raise b.deck.error(element, f"KEYOPT(2) = {along} and KEYOPT(3) = {turns} of COMBIN14 are not read")
    place = along - 1 if along else 3 * turns
    unit = b.units.mass * (b.units.length**2 if place > 2 else 1.0)
    stiffness, damping = ([value * unit if i == place else 0.0 for i in range(6)] for value in (k, c))
    ends = [label for label in element.nodes[:2] if label > 0]
    kind = ("vertex", "line")[len(ends) - 1]
    nodes = b.nodes(element, range(len(ends)))
    if along and any(label in b.deck.angles for label in ends):
        raise b.deck.error(element, "its nodes are turned (THXY to THZX); give the spring in global axes")
    given = {"translation": stiffness[:3], "rotation": stiffness[3:]}
    given |= {"translation_damping": damping[:3], "rotation_damping": damping[3:]}
    six = {name: tuple(values) for name, values in given.items()}
    name = b.group(element, "r", lambda e: b.sections.made(e, Spring, **six))
    row = b.cell(element, kind, nodes, name)
    if along:
        b.put("frame", kind, row, np.eye(3))
        apart = np.ptp(b.points[nodes], axis=0)
        if np.delete(apart, place % 3).any() or (place > 2 and apart.any()):
            b.deck.note(
                "COMBIN14 in one component between distant nodes acts through rigid arms to the middle, so that it is "
                "free of rotation"
            )
    elif kind == "vertex" or not np.ptp(b.points[nodes], axis=0).any():
        raise b.deck.error(element, "its nodes coincide, so that it has no direction; set KEYOPT(2)")


def _rigid(b: Builder, element: Element) -> None:
    """MPC184: a rigid beam, or a rigid link, which keeps the distance of its nodes."""
    option = b.deck.types[element.type].options[1]
    if option not in (0, 1):
        raise b.deck.error(
            element, "of MPC184 rigid links and beams are read (KEYOPT(1) = 0 or 1); name MPC184 in 'ignore'"
        )
    pair = b.nodes(element, (0, 1))
    if option == 1:
        b.rigid.append((pair[0], pair[1]))
        return
    along = b.points[pair[1]] - b.points[pair[0]]
    if not np.any(along):
        raise b.deck.error(element, "its nodes coincide, so that it has no direction; couple them by CP")
    along /= np.linalg.norm(along)
    terms = [(node, c, sign * along[c]) for node, sign in zip(pair, (-1, 1), strict=True) for c in range(3) if along[c]]
    name = f"MPC184 element {element.label} (line {element.line})"
    b.equations.append(Equation.of_terms(terms, length=b.units.length, name=name))


def _pretension(b: Builder, element: Element) -> None:
    """PRETS179: the two nodes on the cut of a bolt move alike."""
    first, second = b.nodes(element, (0, 1))
    name = f"PRETS179 element {element.label} (line {element.line})"
    for component in range(3):
        terms = [(first, component, 1.0), (second, component, -1.0)]
        b.equations.append(Equation.of_terms(terms, length=b.units.length, name=name))
    b.deck.note("PRETS179: the sections are closed, as after tightening, and their force does not act")


def _surface(b: Builder, element: Element) -> None:
    """SURF154: loads, unless its constants EFS and ADMSUA give a foundation or a mass."""
    values = b.deck.reals.get(element.real, [])
    if any(values[3:4]) or any(values[5:6]):
        raise b.deck.error(element, "its foundation or added mass (EFS, ADMSUA) is not read; name SURF154 in 'ignore'")
    b.deck.skipped.append(("elements SURF154", f"line {element.line}"))


OWN = (
    "Its bricks have incompatible modes here. Ansys' own integration (B-bar, reduced, enhanced strains) differs, so "
    "frequencies differ by the error of the mesh."
)
FULLY = (
    "Reduced integration has 2 x 2 x 2 points as in Ansys, with 3 x 3 x 3 of the mass; full integration has 27 points, "
    "where Ansys takes 14."
)
ONE_POINT = (
    "SOLID185 with KEYOPT(2) = 1 (one point, hourglass control) has incompatible modes here, and no hourglasses: with "
    "one point, in CalculiX, the first frequency of a plate in two layers is 8 % lower"
)
QUADRATIC = "It is read where a quadratic element of its shape exists."
CONTACT = "Contact is not linear; tie the parts by an interface, or leave the contact out."

ELEMENTS: dict[str, Entry] = {
    "BEAM4": Entry("read", "", _beam),
    "LINK8": Entry("read", "Its initial strain is left out.", _link),
    "COMBIN14": Entry("approximated", "Its damping by CV2 and its initial state are left out.", _spring),
    "MASS21": Entry("read", "", _mass),
    "SOLID45": Entry("approximated", OWN, add_solid),
    "SHELL63": Entry("approximated", "It is read as the flat shell, with shear flexibility.", add_shell),
    "SOLID92": Entry("read", "", add_tetra),
    "SOLID95": Entry("approximated", f"{FULLY} With KEYOPT(11) = 1 it is reduced.", add_solid),
    "SURF154": Entry("no effect", "It carries loads; with a foundation or added mass it is refused.", _surface),
    "LINK180": Entry("approximated", "In tension or compression alone it bears both, as a note says.", _link),
    "SHELL181": Entry("approximated", "It is read as the flat or warped shell.", add_shell),
    "MPC184": Entry("approximated", "Rigid beams and links are read, joints are refused.", _rigid),
    "SOLID185": Entry("approximated", OWN, add_solid),
    "SOLID186": Entry("approximated", f"{FULLY} With KEYOPT(2) = 0, the default, it is reduced.", add_solid),
    "SOLID187": Entry("read", "", add_tetra),
    "BEAM188": Entry("approximated", "Shear factors and torsion constant are those of the shape here.", _beam),
    "BEAM189": Entry("approximated", "Shear factors and torsion constant are those of the shape here.", _beam),
    "MESH200": Entry("no effect", "It has no stiffness."),
    "SHELL281": Entry("approximated", QUADRATIC, add_shell),
    "SOLID285": Entry("approximated", OWN, add_tetra),
    "PIPE288": Entry("approximated", "It is read as a tube, without pressure and contents.", _beam),
    "PIPE289": Entry("approximated", "It is read as a tube, without pressure and contents.", _beam),
    **{f"CONTA{k}": Entry("refused", CONTACT) for k in (171, 172, 173, 174, 175, 176, 177, 178)},
    **{f"TARGE{k}": Entry("refused", CONTACT) for k in (169, 170)},
    "PRETS179": Entry("approximated", "The section is closed, as after tightening; no force acts.", _pretension),
    "MATRIX27": Entry("read", "Symmetric stiffness and mass; damping is left out with a note.", add_matrix),
    "MATRIX50": Entry(
        "refused",
        "A superelement is in a binary file of its own; read the .full file of its generation pass by [matrices] as a "
        "body, and join the bodies by [welds].",
    ),
    "COMBIN39": Entry("refused", "A nonlinear spring has no stiffness of its own; give COMBIN14."),
    "COMBIN40": Entry("refused", "A combination with a gap is not linear; give COMBIN14."),
    "COMBI214": Entry("refused", "Bearings are force elements of a system, not of a body."),
}
BY_NUMBER = {name.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"): name for name in ELEMENTS}
