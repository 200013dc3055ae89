"""Nastran materials and the units of a deck, to SI."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from modalprep.errors import InputError
from modalprep.fe.properties.materials import Anisotropic, Material, Orthotropic, Orthotropic3D
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.units import Units

RATIOS, SHEARS = ("NU12", "NU13", "NU23"), ("G12", "G13", "G23")
DENSITY = {"MAT1": 4, "MAT2": 7, "MAT8": 7}  # its field


@dataclass(slots=True)
class Conversion:
    """What the property builders share: units, material cards by id, and the notes for the user."""

    units: Units
    materials: dict[int, Card]
    notes: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Add a note once."""
        if text not in self.notes:
            self.notes.append(text)

    def material(self, card: Card, k: int, what: str, allowed: tuple[str, ...]) -> Card:
        """Return the material card that field `k` of `card` names."""
        number = card.integer(k, what, lowest=1)
        if number not in self.materials:
            raise card.error(f"material {number} is not in the deck; add its MAT1 card")
        found = self.materials[number]
        if found.name not in allowed:
            raise card.error(f"material {number} is {found.name}; use {' or '.join(allowed)} here")
        return found


def made(card: Card, kind: Callable[..., Any], **values: Any) -> Any:
    """Return ``kind(**values)``, naming the card when a value is refused."""
    try:
        return kind(**values)
    except InputError as error:
        raise card.error(f"{error} (converted to SI)") from None


def elastic(card: Card) -> tuple[float, float, float]:
    """Return E, G, nu of a MAT1; a blank one of the three follows from the others. E alone means nu = G = 0."""
    E, G = (card.real(k, name, 0.0) for k, name in ((1, "E"), (2, "G")))
    nu = card.real(3, "nu", math.nan) if card.text(3) else math.nan
    if E > 0 and not G and math.isnan(nu):
        return E, 0.0, 0.0
    if not E and G > 0 and not math.isnan(nu):
        E = 2 * G * (1 + nu)
    if not (E > 0 and (G > 0 or nu > -1)):
        raise card.error(f"E = {E:g}, G = {G:g}, nu = {nu:g}; give two of them, or E alone; the moduli positive")
    return E, G or E / (2 * (1 + nu)), E / (2 * G) - 1 if math.isnan(nu) else nu


def density(conversion: Conversion, card: Card, k: int) -> float:
    """Return the density in field `k`, kg/m^3; blank or zero is none, with a note."""
    rho = card.real(k, "rho", 0.0) * conversion.units.density
    if not rho:
        conversion.note(f"{card.name} {card.id} has no density: its elements have no mass but that of NSM")
    return rho


def bar_material(conversion: Conversion, card: Card, k: int) -> tuple[Material, float]:
    """Return the material of a bar and the factor on J and the shear factors that gives it the card's own G.

    A bar may hold E and G that no isotropic body has (equivalent moduli of a laminate).
    """
    source = conversion.material(card, k, "MID", ("MAT1",))
    E, G, _ = elastic(source)
    nu = E / (2 * G) - 1 if G else 0.0
    if not G:
        conversion.note("bars of a MAT1 with E alone have G = 0, as in Nastran: no torsion, and no shear flexibility")
    if not -1 < nu < 0.5:
        conversion.note(
            "bars with E and G that no isotropic body has keep E A, E I, G J and k G A through scaled J and k"
        )
        nu = 0.0
    material = made(source, Material, E=E * conversion.units.stress, nu=nu, rho=density(conversion, source, 4))
    return material, G * 2 * (1 + nu) / E


def _anisotropic(card: Card, stress: float, rho: float, shear: bool) -> Orthotropic:
    """MAT2 that is orthotropic along its axes; of MID3 it holds the two transverse shear moduli."""
    G11, G12, G13, G22, G23, G33 = (card.real(k + 1, f"G{ij}", 0.0) for k, ij in enumerate((11, 12, 13, 22, 23, 33)))
    if max(abs(G13), abs(G23), abs(G12) if shear else 0.0) > 1e-6 * max(G11, G22):
        raise card.error("it couples shear with tension; turn it to its own axes by THETA, or use MAT8")
    if shear:
        moduli = {"E1": G11, "E2": G22, "G12": G11, "G13": G11, "G23": G22}
        nu = 0.0
    elif G11 > 0 and G22 > 0 and G12**2 < G11 * G22:
        nu = G12 / G22
        left = 1 - G12**2 / (G11 * G22)
        moduli = {"E1": G11 * left, "E2": G22 * left, "G12": G33, "G13": G33, "G23": G33}
    else:
        raise card.error(f"G11 = {G11:g}, G12 = {G12:g}, G22 = {G22:g} are no elastic sheet; correct them")
    return made(card, Orthotropic, nu12=nu, rho=rho, **{name: value * stress for name, value in moduli.items()})


def sheet_material(conversion: Conversion, card: Card, k: int) -> Material | Orthotropic:
    """Return the material of a shell or a ply."""
    source = conversion.material(card, k, "MID", ("MAT1", "MAT2", "MAT8"))
    stress = conversion.units.stress
    rho = density(conversion, source, DENSITY[source.name])
    if source.name == "MAT2":
        return _anisotropic(source, stress, rho, shear=k == 5)
    if source.name == "MAT1":
        E, G, nu = elastic(source)
        if not G:
            G = E / 2
            conversion.note(
                "sheets of a MAT1 with E alone have NU = 0 and G = E / 2, where Nastran has no shear stiffness"
            )
        if math.isclose(G, E / (2 * (1 + nu)), rel_tol=1e-2):  # E, G and nu rounded on the card
            return made(source, Material, E=E * stress, nu=nu, rho=rho)
        moduli = {name: G * stress for name in ("G12", "G13", "G23")}
        return made(source, Orthotropic, E1=E * stress, E2=E * stress, nu12=nu, rho=rho, **moduli)
    E1, E2, nu12, G12 = (source.real(i, name) for i, name in enumerate(("E1", "E2", "NU12", "G12"), 1))
    G13, G23 = (source.real(i, name, 0.0) or G12 for i, name in ((5, "G1Z"), (6, "G2Z")))
    moduli = {"E1": E1, "E2": E2, "G12": G12, "G13": G13, "G23": G23}
    return made(source, Orthotropic, nu12=nu12, rho=rho, **{name: value * stress for name, value in moduli.items()})


def solid_material(conversion: Conversion, card: Card) -> Material | Orthotropic3D | Anisotropic:
    """Return the material of MAT1, MAT9 (21 moduli) or MAT11 (engineering constants)."""
    stress = conversion.units.stress
    if card.name == "MAT1":
        E, _, nu = elastic(card)
        return made(card, Material, E=E * stress, nu=nu, rho=density(conversion, card, 4))
    if card.name == "MAT9":
        C = tuple((card.reals(1, 21, "G") * stress).tolist())
        return made(card, Anisotropic, C=C, rho=density(conversion, card, 22))
    moduli = {f"E{i}": card.real(i, f"E{i}") * stress for i in (1, 2, 3)}
    ratios = {name.lower(): card.real(4 + k, name) for k, name in enumerate(RATIOS)}
    shears = {name: card.real(7 + k, name) * stress for k, name in enumerate(SHEARS)}
    return made(card, Orthotropic3D, **moduli, **ratios, **shears, rho=density(conversion, card, 10))
