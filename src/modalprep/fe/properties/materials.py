"""Materials: isotropic, and the orthotropic lamina of shells."""

from __future__ import annotations

from dataclasses import dataclass

from modalprep.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Material:
    """Isotropic linear elastic material.

    Attributes
    ----------
    E : float
        Young's modulus, Pa.
    nu : float
        Poisson's ratio, between -1 and 0.5.
    rho : float
        Density, kg/m^3.

    Raises
    ------
    InputError
        When E or rho is not positive, or nu is outside its range.

    Examples
    --------
    >>> round(Material(E=70e9, nu=0.33, rho=2700.0).G / 1e9, 2)
    26.32
    """

    E: float
    nu: float
    rho: float

    def __post_init__(self) -> None:
        """Refuse values no material has."""
        refuse_not_positive("material", E=self.E, rho=self.rho)
        if not -1 < self.nu < 0.5:
            raise InputError(f"material nu = {self.nu:g} must lie between -1 and 0.5")

    @property
    def G(self) -> float:
        """Shear modulus, Pa."""
        return self.E / (2 * (1 + self.nu))


@dataclass(frozen=True, kw_only=True)
class Orthotropic:
    """Orthotropic lamina in plane stress: axis 1 along the fibre, axis 2 across it, axis 3 normal to the shell.

    Attributes
    ----------
    E1, E2 : float
        Young's moduli, Pa.
    nu12 : float
        Poisson's ratio of the contraction along axis 2 under tension along axis 1.
    G12, G13, G23 : float
        Shear moduli, Pa.
    rho : float
        Density, kg/m^3.

    Raises
    ------
    InputError
        When a modulus is not positive, or nu12^2 is not below E1/E2, which a positive strain energy requires.

    References
    ----------
    R. M. Jones, Mechanics of Composite Materials, 2nd edition (1999), section 2.4 (limits of the constants).

    Examples
    --------
    >>> carbon = Orthotropic(E1=140e9, E2=10e9, nu12=0.3, G12=5e9, G13=5e9, G23=3.5e9, rho=1600.0)
    >>> round(carbon.nu12 * carbon.E2 / carbon.E1, 4)  # nu21
    0.0214
    """

    E1: float
    E2: float
    nu12: float
    G12: float
    G13: float
    G23: float
    rho: float

    def __post_init__(self) -> None:
        """Refuse values no material has."""
        refuse_not_positive(
            "material", **{name: getattr(self, name) for name in ("E1", "E2", "G12", "G13", "G23", "rho")}
        )
        if not self.nu12**2 < self.E1 / self.E2:
            raise InputError(f"material nu12 = {self.nu12:g} must stay below the root of E1/E2 = {self.E1 / self.E2:g}")


def refuse_not_positive(what: str, **values: float) -> None:
    """Raise InputError naming the first value that is not a positive number."""
    for name, value in values.items():
        if not 0 < value < float("inf"):
            raise InputError(f"{what} {name} = {value:g} must be positive; give SI units (Pa, kg/m^3, m, m^2, m^4)")
