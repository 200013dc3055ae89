"""Materials of an Ansys deck, to SI."""

from __future__ import annotations

import math
from typing import Any

from modalprep.errors import InputError
from modalprep.fe.properties.materials import Anisotropic, Material, Orthotropic, Orthotropic3D
from modalprep.fe.readers.ansys.deck import Deck, Element
from modalprep.fe.readers.units import Units

POISSON = 0.3  # Ansys takes it where none is given


class Materials:
    """Materials by number, made when an element first names them."""

    def __init__(self, deck: Deck, units: Units) -> None:
        self.deck, self.units = deck, units

    def sheet(self, element: Element, number: int) -> Material | Orthotropic:
        """Return the material of a shell or a ply."""
        values = self._values(element, number)
        if not _is_orthotropic(values):
            return self.isotropic(element, number)
        E1 = values["EX"]
        E2 = values.get("EY") or values["EX"]
        nu12 = _major(values, "XY")
        moduli = {"E1": E1, "E2": E2, **_shears(values)}
        moduli = {name: x * self.units.stress for name, x in moduli.items()}
        return self._made(element, number, Orthotropic, nu12=nu12, rho=self._density(number, values), **moduli)

    def solid(self, element: Element, number: int) -> Material | Orthotropic3D | Anisotropic:
        """Return the material of a solid."""
        table = self.deck.materials.get(number, {})
        if "C1" in table:
            C = tuple(table.get(f"C{k}", 0.0) * self.units.stress for k in range(1, 22))
            return self._made(element, number, Anisotropic, C=C, rho=self._density(number, table))
        values = self._values(element, number)
        if not _is_orthotropic(values):
            return self.isotropic(element, number)
        moduli = {f"E{k}": values.get(name) or values["EX"] for k, name in enumerate(("EX", "EY", "EZ"), 1)}
        moduli = {name: x * self.units.stress for name, x in (moduli | _shears(values)).items()}
        ratios = {"nu12": _major(values, "XY"), "nu23": _major(values, "YZ"), "nu13": _major(values, "XZ")}
        return self._made(element, number, Orthotropic3D, rho=self._density(number, values), **moduli, **ratios)

    def isotropic(self, element: Element, number: int) -> Material:
        """Return the material of a beam, a link or an isotropic solid."""
        values = self._values(element, number)
        if _is_orthotropic(values):
            raise self.deck.error(
                element, f"material {number} is orthotropic; only solids and shells can be made of it"
            )
        nu = values.get("PRXY", values.get("NUXY", math.nan))
        if math.isnan(nu):
            nu = values["EX"] / (2 * values["GXY"]) - 1 if values.get("GXY") else POISSON
            if not values.get("GXY"):
                self.deck.note(f"material {number} has no Poisson's ratio; 0.3 is taken, as in Ansys")
        return self._made(
            element, number, Material, E=values["EX"] * self.units.stress, nu=nu, rho=self._density(number, values)
        )

    def filling(self, element: Element, number: int) -> float:
        """Return the density of what fills or covers a pipe."""
        rho = self.deck.materials.get(number, {}).get("DENS", 0.0)
        if not rho:
            raise self.deck.error(element, f"material {number} of its contents or insulation has no DENS; add its MP")
        return rho * self.units.density

    def _values(self, element: Element, number: int) -> dict[str, float]:
        values = self.deck.materials.get(number, {})
        if not values.get("EX"):
            raise self.deck.error(element, f"material {number} has no EX; add its MP or MPDATA")
        return values

    def _density(self, number: int, values: dict[str, float]) -> float:
        rho = values.get("DENS", 0.0) * self.units.density
        if not rho:
            self.deck.note(f"material {number} has no density: its elements have no mass but added one")
        return rho

    def _made(self, element: Element, number: int, kind: type, **values: Any) -> Any:
        try:
            return kind(**values)
        except InputError as error:
            raise self.deck.error(element, f"material {number}: {error} (converted to SI)") from None


def _major(values: dict[str, float], axes: str) -> float:
    """Return the contraction along the second axis by tension along the first: PRXY, or NUXY EX / EY."""
    if f"PR{axes}" in values:
        return values[f"PR{axes}"]
    if f"NU{axes}" not in values:
        return POISSON
    first, second = (values.get(f"E{axis}") or values["EX"] for axis in axes)
    return values[f"NU{axes}"] * first / second


def _shears(values: dict[str, float]) -> dict[str, float]:
    """Return the shear moduli; without GXY that of Ansys, which is isotropic for EX = EY."""
    E1 = values["EX"]
    E2 = values.get("EY") or values["EX"]
    G12 = values.get("GXY") or E1 * E2 / (E1 + E2 + 2 * _major(values, "XY") * E2)
    return {"G12": G12, "G13": values.get("GXZ") or G12, "G23": values.get("GYZ") or G12}


def _is_orthotropic(values: dict[str, float]) -> bool:
    """Whether moduli differ with the direction, or G from that of E and nu."""
    E = values["EX"]
    nu = values.get("PRXY", values.get("NUXY", POISSON))
    unlike = any(values.get(name) and not math.isclose(values[name], E, rel_tol=1e-3) for name in ("EY", "EZ"))
    shear = [values[name] for name in ("GXY", "GYZ", "GXZ") if values.get(name)]
    has_nu = "PRXY" in values or "NUXY" in values
    return unlike or (has_nu and any(not math.isclose(G, E / (2 * (1 + nu)), rel_tol=1e-2) for G in shear))
