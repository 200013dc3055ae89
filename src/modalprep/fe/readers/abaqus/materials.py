"""Materials of a deck, and the axes in which they are given."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.fe.properties.materials import Anisotropic, Material, Orthotropic, Orthotropic3D
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.geometry import frame
from modalprep.fe.readers.abaqus.lexer import Block, Row

CONSTANTS = {"ISOTROPIC": 2, "LAMINA": 6, "ENGINEERING CONSTANTS": 9, "ORTHOTROPIC": 9, "ANISOTROPIC": 21}
SPELLINGS = {
    "ISO": "ISOTROPIC",
    "ORTHO": "ORTHOTROPIC",
    "ANISO": "ANISOTROPIC",
    "ENGINEERINGCONSTANTS": "ENGINEERING CONSTANTS",
}

NINE = ("E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23")
STRAINS = [0, 1, 2, 3, 5, 4]  # where strains 11, 22, 33, 12, 23, 13 stand in Abaqus' order


@dataclass
class Substance:
    """A material of the deck, in its units."""

    name: str
    block: Block
    kind: str = ""
    constants: list[float] = field(default_factory=list)
    density: float = 0.0
    damping: tuple[float, float] = (0.0, 0.0)  # alpha, 1/s, and beta, s
    structural: float = 0.0


@dataclass
class Orientation:
    """Axes of a material: of the whole set, or of single elements.

    Attributes
    ----------
    axis : int
        1, 2 or 3: the axis of the additional rotation, in shells the one along the normal.
    angle : float
        rad.
    """

    block: Block
    kind: str
    values: np.ndarray
    axis: int
    angle: float
    of_element: dict = field(default_factory=dict)

    def axes_at(self, deck: Deck, key: tuple[str, int], point: np.ndarray) -> np.ndarray:
        """Return the axes (rows) at a point of an element, in global axes."""
        scope = self.block.scope
        a, b, *more = self.of_element.get(key, self.values).reshape(-1, 3)
        if self.kind in ("RECTANGULAR", "Z RECTANGULAR"):
            c = more[0] if more else np.zeros(3)
            axes = frame(self.block, *(deck.turned(scope, x - c) for x in (a, b)))
            if self.kind == "Z RECTANGULAR":  # a on z, b in the plane of x and z
                axes = axes[[1, 2, 0]]
        else:
            a, b = deck.placed(scope, a), deck.placed(scope, b)
            radial = point - a
            z = (b - a) / np.linalg.norm(b - a)
            if self.kind == "CYLINDRICAL":
                radial = radial - (radial @ z) * z
            if np.linalg.norm(radial) <= 1e-9 * np.linalg.norm(point - a):
                at = ", ".join(f"{x:.4g}" for x in point)
                self.block.refuse(
                    f"has no radial direction at ({at}), which lies on its axis; leave that out of the set"
                )
            axes = frame(self.block, radial, np.cross(z, radial))
        turn = np.zeros(3)
        turn[self.axis - 1] = self.angle
        return Rotation.from_rotvec(turn).as_matrix().T @ axes


def material(deck: Deck, block: Block) -> None:
    """``*MATERIAL``: what follows belongs to it."""
    name = block.option("NAME")
    table = deck.tables.setdefault("material", {})
    if ("", name.upper()) in table:
        block.refuse(f"has the name {name} of another material; give every material its own")
    table["", name.upper()] = deck.current["material"] = Substance(name, block)


def _current(deck: Deck, block: Block) -> Substance:
    if "material" not in deck.current:
        block.refuse("stands in no material; put it after its *MATERIAL")
    return deck.current["material"]


def elastic(deck: Deck, block: Block) -> None:
    """``*ELASTIC``: the constants of the first temperature."""
    substance = _current(deck, block)
    given = block.choice("TYPE", "ISOTROPIC")
    kind = SPELLINGS.get(given.replace(" ", ""), SPELLINGS.get(given, given))
    if kind not in CONSTANTS:
        block.refuse(f"has TYPE={kind}; known are {', '.join(CONSTANTS)}")
    if not block.rows:
        block.refuse("has no constants; give them in the next line")
    count = CONSTANTS[kind]
    joined = block.joined()
    per_set = -(-(count + 1) // 8)
    if len(joined.fields) < count - (kind == "ISOTROPIC"):
        raise joined.error(f"{kind} needs {count} constants; it has {len(joined.fields)}")
    substance.kind = kind
    substance.constants = joined.reals(0, count, "an elastic constant")
    if len(block.rows) > per_set:
        deck.note(f"material {substance.name}: of its temperatures the first holds (line {block.line})")


def damping(deck: Deck, block: Block) -> None:
    """``*DAMPING`` of a material, for the first pipeline file: Rayleigh's and structural damping."""
    names = ("ALPHA", "BETA", "STRUCTURAL")
    at = Row([block.options.get(name, "") for name in names], block.file, block.line)
    substance = _current(deck, block)
    alpha, beta, substance.structural = at.reals(0, 3, "damping")
    substance.damping = alpha, beta


def density(deck: Deck, block: Block) -> None:
    """``*DENSITY``: that of the first temperature."""
    substance = _current(deck, block)
    substance.density = block.row().real(0, "density", 0.0)
    if len(block.rows) > 1:
        deck.note(f"material {substance.name}: of its temperatures the first holds (line {block.line})")


def _elastic_of(deck: Deck, block: Block | Row, scope: str, name: str) -> tuple[Substance, float, float]:
    """Return the material, Pa per unit of its constants and its density, kg/m^3."""
    substance: Substance = deck.named("material", block, scope, name)
    if not substance.constants:
        substance.block.refuse(f"{substance.name} has no *ELASTIC, which its section needs; add its constants")
    rho = substance.density * deck.units.density
    if not rho:
        deck.note(f"material {substance.name} has no density: its elements have no mass")
    return substance, deck.units.stress, rho


def isotropic(deck: Deck, block: Block, name: str) -> Material:
    """Return the isotropic material of a section."""
    substance, stress, rho = _elastic_of(deck, block, block.scope, name)
    if substance.kind != "ISOTROPIC":
        block.refuse(f"needs an isotropic material; {substance.name} is {substance.kind}")
    E, nu = substance.constants
    return substance.block.made(Material, E=E * stress, nu=nu, rho=rho)


def of_sheet(deck: Deck, block: Block, name: str) -> Material | Orthotropic:
    """Return the material of a shell or a ply."""
    substance, stress, rho = _elastic_of(deck, block, block.scope, name)
    if substance.kind == "ISOTROPIC":
        return isotropic(deck, block, name)
    if substance.kind == "LAMINA":
        E1, E2, nu12, G12, G13, G23 = substance.constants
    elif substance.kind == "ENGINEERING CONSTANTS":  # plane stress needs these only
        E1, E2, _, nu12, _, _, G12, G13, G23 = substance.constants
    elif substance.kind == "ORTHOTROPIC":
        E1, E2, _, nu12, _, _, G12, G13, G23 = engineering(substance)
    else:
        block.refuse(f"needs a material of at most orthotropic stiffness; {substance.name} is {substance.kind}")
    moduli = {"E1": E1, "E2": E2, "G12": G12, "G13": G13, "G23": G23}
    return substance.block.made(Orthotropic, nu12=nu12, rho=rho, **{k: v * stress for k, v in moduli.items()})


def of_solid(deck: Deck, block: Block, name: str) -> Material | Orthotropic3D | Anisotropic:
    """Return the material of a solid."""
    substance, stress, rho = _elastic_of(deck, block, block.scope, name)
    if substance.kind == "ISOTROPIC":
        return isotropic(deck, block, name)
    if substance.kind == "LAMINA":
        block.refuse(f"needs a material of solids; {substance.name} is a LAMINA of plane stress")
    if substance.kind == "ANISOTROPIC":
        C = np.zeros((6, 6))
        C.T[np.tril_indices(6)] = substance.constants  # column by column, strains 11, 22, 33, 12, 13, 23
        C = (C + np.triu(C, 1).T)[np.ix_(STRAINS, STRAINS)] * stress
        return substance.block.made(Anisotropic, C=tuple(C[np.triu_indices(6)].tolist()), rho=rho)
    constants = engineering(substance) if substance.kind == "ORTHOTROPIC" else substance.constants
    values = {name: value * (1.0 if name[0] == "n" else stress) for name, value in zip(NINE, constants, strict=True)}
    return substance.block.made(Orthotropic3D, rho=rho, **{name: float(value) for name, value in values.items()})


def engineering(substance: Substance) -> list[float]:
    """Return E1, E2, E3, nu12, nu13, nu23, G12, G13, G23 of the stiffnesses D1111, D1122, D2222, D1133, ..."""
    D11, D12, D22, D13, D23, D33, G12, G13, G23 = substance.constants
    D = np.array([[D11, D12, D13], [D12, D22, D23], [D13, D23, D33]])
    if not np.linalg.eigvalsh(D)[0] > 0:
        substance.block.refuse(f"{substance.name} has stiffnesses that are not positive definite; correct them")
    S = np.linalg.inv(D)
    E = 1 / S.diagonal()
    return [*E, -S[0, 1] * E[0], -S[0, 2] * E[0], -S[1, 2] * E[1], G12, G13, G23]


# ---------------------------------------------------------------- axes


def orientation(deck: Deck, block: Block) -> None:
    """``*ORIENTATION`` by coordinates, of the whole set or by a distribution."""
    name = block.option("NAME")
    kind = block.choice("SYSTEM", "RECTANGULAR") or "RECTANGULAR"
    if kind not in ("RECTANGULAR", "Z RECTANGULAR", "CYLINDRICAL", "SPHERICAL"):
        block.refuse(f"has SYSTEM={kind}; known are RECTANGULAR, Z RECTANGULAR, CYLINDRICAL and SPHERICAL")
    if block.choice("DEFINITION", "COORDINATES") != "COORDINATES":
        block.refuse(f"has DEFINITION={block.options['DEFINITION']}; give the points by their coordinates")
    of_element: dict = {}
    row, second = block.row(0), block.row(1)
    if row.text(0) and not _is_number(row.text(0)):
        table = deck.named("distribution", row, block.scope, row.text(0))
        values = np.array(table[None])
        of_element = {k: np.array(v) for k, v in table.items() if k is not None}
    else:
        values = np.array(row.reals(0, 9 if len(row.fields) > 6 else 6, "a coordinate"))
    axis = second.integer(0, "an axis", 1)
    angle = np.radians(second.real(1, "an angle", 0.0))
    if axis not in (1, 2, 3):
        raise second.error(f"the axis {axis} of the rotation is none of 1, 2, 3; correct it")
    made = Orientation(block, kind, values, axis, float(angle), of_element)
    deck.tables.setdefault("orientation", {})[block.scope, name.upper()] = made


def _is_number(text: str) -> bool:
    try:
        float(text.upper().replace("D", "E"))
    except ValueError:
        return False
    return True


def distribution(deck: Deck, block: Block) -> None:
    """``*DISTRIBUTION`` of six coordinates over elements, for an orientation; others are kept as they are."""
    table: dict = {}
    for row in block.rows:
        values = row.reals(1, 6, "a coordinate") if all(map(_is_number, filter(None, row.fields[1:]))) else None
        if not row.text(0):
            table[None] = values
        else:
            for key in deck.elements_of(row, block.scope, row.text(0)):
                table[key] = values
    if None not in table or any(values is None for values in table.values()):
        table = {None: [0.0] * 6}
    deck.tables.setdefault("distribution", {})[block.scope, block.option("NAME").upper()] = table


def transform(deck: Deck, block: Block) -> None:
    """``*TRANSFORM``: axes of the components at the nodes of a set."""
    kind = {"": "RECTANGULAR", "R": "RECTANGULAR", "C": "CYLINDRICAL", "S": "SPHERICAL"}.get(block.choice("TYPE"))
    if kind is None:
        block.refuse(f"has TYPE={block.options['TYPE']}; known are R, C and S")
    values = np.array(block.joined().reals(0, 6, "a coordinate"))
    axes = Orientation(block, kind, values, 3, 0.0)
    for node in deck.nodes_of(block, block.scope, block.option("NSET")):
        deck.axes[node] = axes.axes_at(deck, ("", 0), deck.points[node])
