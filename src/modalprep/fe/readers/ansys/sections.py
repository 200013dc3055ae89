"""Sections and real constants of an Ansys deck to properties in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from modalprep.errors import InputError
from modalprep.fe.properties.properties import Beam, Ply, Shell, Truss
from modalprep.fe.properties.sections import beam_section
from modalprep.fe.readers.ansys.deck import Deck, Element, SectionData
from modalprep.fe.readers.ansys.materials import Materials

RIGID = 1e6  # shear factor of a plane without shear flexibility
MEMBRANE = 1e-3  # of the bending stiffness that a membrane keeps
EQUAL = 1e-6  # relative difference of lengths that are meant to be equal


class Sections:
    """Properties of the elements of a deck: each function returns one, in SI."""

    def __init__(self, deck: Deck, materials: Materials) -> None:
        self.deck, self.materials, self.m = deck, materials, materials.units.length

    def _find(self, element: Element, kind: str) -> SectionData:
        found = self.deck.sections.get(element.section)
        if found is None or not found.kind.startswith(kind):
            raise self.deck.error(
                element, f"section {element.section} is no {kind} section of the deck; add its SECTYPE"
            )
        return found

    def constants(self, element: Element, count: int) -> list[float]:
        """Return the real constants of an element, zeros behind the last."""
        if element.real not in self.deck.reals:
            raise self.deck.error(element, f"real constants {element.real} are not in the deck; add its R or RLBLOCK")
        return (self.deck.reals[element.real] + [0.0] * count)[:count]

    def made(self, element: Element, kind: Callable[..., Any], *shape: str, **values: Any) -> Any:
        """Return ``kind(**values)``, naming the element when a value is refused."""
        try:
            return kind(*shape, **values)
        except InputError as error:
            raise self.deck.error(element, f"{error} (converted to SI)") from None

    def shell(self, element: Element) -> Shell:
        """SHELL181 and SHELL281: plies from the bottom up, or the thickness of old decks' real constants."""
        if element.section not in self.deck.sections and element.real in self.deck.reals:
            return self.thin_shell(element)
        section = self._find(element, "SHEL")
        plies = []
        for values in section.plies:
            thickness, number, angle, *_ = [*values, 0.0, 0.0][: max(len(values), 3)]
            material = self.materials.sheet(element, int(number) or element.material)
            angle = math.radians(angle)
            plies.append(self.made(element, Ply, material=material, thickness=thickness * self.m, angle=angle))
        if not plies:
            raise self.deck.error(element, f"section {element.section} has no thickness; add its SECDATA")
        offset = self._shell_offset(element, section, sum(ply.thickness for ply in plies))
        if len(plies) > 1:
            return self.made(element, Shell, plies=tuple(plies), offset=offset)
        [ply] = plies
        return self.made(
            element,
            Shell,
            material=ply.material,
            thickness=ply.thickness,
            angle=ply.angle,
            offset=offset,
            bending_ratio=self._bending(element),
        )

    def _shell_offset(self, element: Element, section: SectionData, thickness: float) -> float:
        """From the nodes to the mid-plane: with TOP the nodes are on top of the shell."""
        places = {"": 0.0, "MID": 0.0, "TOP": -thickness / 2, "BOT": thickness / 2}
        if section.place in places:
            return places[section.place]
        if section.place != "USER":
            raise self.deck.error(
                element, f"SECOFFSET,{section.place} is not known for shells; use MID, TOP, BOT or USER"
            )
        self.deck.note("SECOFFSET,USER of shells is taken as the place of the nodes above the mid-plane")
        return -section.offset[0] * self.m

    def _bending(self, element: Element) -> float:
        if self.deck.types[element.type].options.get(1) != 1:
            return 1.0
        self.deck.note(f"membranes (KEYOPT(1) = 1) keep {MEMBRANE:g} of their bending stiffness")
        return MEMBRANE

    def thin_shell(self, element: Element) -> Shell:
        """SHELL63: thickness in the real constants, equal at all corners."""
        t, *others = self.constants(element, 6)
        if any(x and not math.isclose(x, t, rel_tol=EQUAL) for x in others[:3]):
            raise self.deck.error(element, "its corners have thicknesses of their own; give each element one thickness")
        if others[3]:
            raise self.deck.error(element, "it has an elastic foundation (EFS); give springs instead")
        material = self.materials.sheet(element, element.material)
        return self.made(
            element,
            Shell,
            material=material,
            thickness=t * self.m,
            angle=math.radians(others[4]),
            bending_ratio=self._bending(element),
        )

    def link(self, element: Element) -> Truss:
        """LINK180 and LINK8: area in the section or in the real constants, with added mass per length."""
        if element.section in self.deck.sections:
            section = self._find(element, "LINK")
            area = [*section.values, 0.0][0]
            added = 0.0
        else:
            area, added, bears = self.constants(element, 3)
            if bears and self.deck.types[element.type].name == "180":
                self.deck.note("LINK180 in tension or in compression alone is a bar that bears both")
            added = 0.0 if self.deck.types[element.type].name == "8" else added  # there it is the initial strain
        material = self.materials.isotropic(element, element.material)
        nsm = added * self.materials.units.mass / self.m
        return self.made(element, Truss, material=material, A=area * self.m**2, nsm=nsm)

    def beam4(self, element: Element) -> Beam:
        """BEAM4: AREA, IZZ, IYY, TKZ, TKY, THETA, ISTRN, IXX, SHEARZ, SHEARY, SPIN, ADDMAS."""
        A, Izz, Iyy, _, _, _, _, Ixx, shear_z, shear_y, _, added = self.constants(element, 12)
        return self.made(
            element,
            Beam,
            material=self.materials.isotropic(element, element.material),
            A=A * self.m**2,
            Iy=Iyy * self.m**4,
            Iz=Izz * self.m**4,
            J=(Ixx or Iyy + Izz) * self.m**4,
            ky=1 / shear_z if shear_z else RIGID,
            kz=1 / shear_y if shear_y else RIGID,
            nsm=added * self.materials.units.mass / self.m,
            theory="timoshenko" if shear_z or shear_y else "euler-bernoulli",
        )

    def beam(self, element: Element) -> Beam:
        """BEAM188, BEAM189, PIPE288 and PIPE289: a section by its shape or its numbers."""
        section = self.deck.sections.get(element.section)
        kind = "PIPE" if section is not None and section.kind.startswith("PIPE") else "BEAM"
        section = self._find(element, kind)
        shape = "PIPE" if kind == "PIPE" else section.shape
        if shape not in SHAPES:
            known = ", ".join(SHAPES)
            raise self.deck.error(
                element, f"beam section {shape} is not read ({known}); give it as ASEC with its numbers"
            )
        count, law = SHAPES[shape]
        if len(section.values) < count:
            raise self.deck.error(element, f"section {element.section} has {len(section.values)} of {count} sizes")
        material = self.materials.isotropic(element, element.material)
        if shape == "ASEC":
            return self._arbitrary(element, section, material)
        name, sizes = law(section.values)
        if not name:
            raise self.deck.error(element, f"beam section {shape} is not symmetric; give it as ASEC with its numbers")
        sizes = {key: value * self.m for key, value in sizes.items()}
        nsm = self._filling(element, section.values) if kind == "PIPE" else 0.0
        return self.made(
            element, beam_section, name, material=material, offset=self._offset(element, section), nsm=nsm, **sizes
        )

    def _filling(self, element: Element, values: Sequence[float]) -> float:
        """Mass per length of what is in a pipe and around it: Do, Tw, Nc, Ss, Nt, Mint, Mins, Tins."""
        outer, wall, _, _, _, inside, around, thick = (*values, *[0.0] * 8)[:8]
        radius = outer / 2
        rings = ((inside, (radius - wall) ** 2), (around, (radius + thick) ** 2 - radius**2))
        squares = sum(self.materials.filling(element, int(number)) * own for number, own in rings if number)
        return math.pi * squares * self.m**2

    def _offset(self, element: Element, section: SectionData) -> tuple[float, float]:
        """From the nodes to the centroid, along e2 and e3."""
        central = section.kind.startswith("PIPE") or section.shape in ("RECT", "CSOLID", "CTUBE")
        if section.place in ("", "CENT") and not section.kind.startswith("PIPE"):
            return 0.0, 0.0
        if not central and section.place != "SHRC":
            raise self.deck.error(element, f"SECOFFSET,{section.place} of this section is not read; use CENT")
        y, z = section.offset if section.place not in ("ORIGIN", "SHRC") else (0.0, 0.0)
        return -y * self.m, -z * self.m

    def _arbitrary(self, element: Element, section: SectionData, material: Any) -> Beam:
        """ASEC: A, Iyy, Iyz, Izz, Iw, J, CGy, CGz, SHy, SHz, TKz, TKy."""
        A, Iyy, Iyz, Izz, _, J, *rest = (section.values + [0.0] * 12)[:12]
        if abs(Iyz) > EQUAL * max(Iyy, Izz):
            raise self.deck.error(element, "its section has a product of inertia; turn the section to its main axes")
        if any(rest[:4]):
            self.deck.note("ASEC: centroid and shear centre are taken to lie on the line of the nodes")
        self.deck.note("ASEC: sections by their numbers are rigid in shear")
        m = self.m
        values = {"A": A * m**2, "Iy": Iyy * m**4, "Iz": Izz * m**4, "J": J * m**4}
        return self.made(element, Beam, material=material, theory="euler-bernoulli", **values)


def _box(sizes: Sequence[float]) -> tuple[str, dict[str, float]]:
    """HREC: outer widths and the four walls."""
    width, height, t, *others = sizes[:6]
    equal = all(math.isclose(t, x, rel_tol=EQUAL) for x in others)
    return "box" if equal else "", {"width": width, "height": height, "thickness": t}


def _i(sizes: Sequence[float]) -> tuple[str, dict[str, float]]:
    """I: widths of the flanges, height, thickness of flanges and web."""
    w1, w2, height, t1, t2, web = sizes[:6]
    equal = math.isclose(w1, w2, rel_tol=EQUAL) and math.isclose(t1, t2, rel_tol=EQUAL)
    return "i" if equal else "", {"width": w1, "height": height, "flange": t1, "web": web}


SHAPES: dict[str, tuple[int, Callable[[Sequence[float]], tuple[str, dict[str, float]]]]] = {
    "RECT": (2, lambda s: ("rectangle", {"width": s[0], "height": s[1]})),
    "CSOLID": (1, lambda s: ("rod", {"diameter": 2 * s[0]})),
    "CTUBE": (2, lambda s: ("tube", {"diameter": 2 * s[1], "thickness": s[1] - s[0]})),
    "PIPE": (2, lambda s: ("tube", {"diameter": s[0], "thickness": s[1]})),
    "HREC": (6, _box),
    "I": (6, _i),
    "ASEC": (6, lambda s: ("", {})),
}
