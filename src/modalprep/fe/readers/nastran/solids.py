"""Nastran materials of solids."""

from __future__ import annotations

from modalprep.fe.properties.materials import Anisotropic, Material, Orthotropic3D
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import Conversion, density, elastic, made

RATIOS, SHEARS = ("NU12", "NU13", "NU23"), ("G12", "G13", "G23")


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
