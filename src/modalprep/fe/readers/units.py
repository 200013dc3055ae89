"""Units of a deck, to SI."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Units:
    """SI values of the deck's units; time is in seconds, `inertial` holds PARAM,WTMASS too.

    Examples
    --------
    >>> inch = Units(length=0.0254, mass=175.126835)  # lbf s^2/in
    >>> round(inch.stress, 1)  # Pa in a psi
    6894.8
    """

    length: float
    mass: float
    wtmass: float = 1.0

    @property
    def stress(self) -> float:
        """Pa per unit of stress."""
        return self.mass / self.length

    @property
    def inertial(self) -> float:
        """Kg per unit of mass as the cards write it."""
        return self.mass * self.wtmass

    @property
    def density(self) -> float:
        """kg/m^3 per unit of density."""
        return self.inertial / self.length**3
