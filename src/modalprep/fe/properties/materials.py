"""Materials: isotropic, the orthotropic lamina of shells, and the orthotropic and anisotropic ones of solids."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError

LARGEST = 1e60  # in SI units: products of several values are still numbers


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
        Density, kg/m^3; zero where the mass comes from elsewhere.

    Raises
    ------
    InputError
        When E is not positive, rho is negative, or nu is outside its range.

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
        refuse_not_positive("material", E=self.E)
        refuse_no_density(self.rho)
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
        Density, kg/m^3; zero where the mass comes from elsewhere.

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
        refuse_not_positive("material", **{name: getattr(self, name) for name in ("E1", "E2", "G12", "G13", "G23")})
        refuse_no_density(self.rho)
        if not self.nu12**2 < self.E1 / self.E2:
            raise InputError(f"material nu12 = {self.nu12:g} must stay below the root of E1/E2 = {self.E1 / self.E2:g}")


@dataclass(frozen=True, kw_only=True)
class Orthotropic3D:
    """Orthotropic material of solids: nine engineering constants along the axes e1, e2, e3 of the solid.

    Attributes
    ----------
    E1, E2, E3 : float
        Young's moduli, Pa.
    nu12, nu13, nu23 : float
        Poisson's ratios: nu12 of the contraction along axis 2 under tension along axis 1.
    G12, G13, G23 : float
        Shear moduli, Pa.
    rho : float
        Density, kg/m^3; zero where the mass comes from elsewhere.

    Raises
    ------
    InputError
        When a modulus is not positive, or the ratios are such that some strain would have no positive energy.

    References
    ----------
    R. M. Jones, Mechanics of Composite Materials, 2nd edition (1999), sections 2.2 to 2.4.

    Examples
    --------
    >>> wood = Orthotropic3D(E1=11e9, E2=0.9e9, E3=0.5e9, nu12=0.4, nu13=0.4, nu23=0.5, G12=0.9e9, G13=0.7e9,
    ...                      G23=0.1e9, rho=500.0)
    >>> round(float(1 / np.linalg.inv(wood.moduli())[0, 0]) / 1e9, 6)  # E1
    11.0
    """

    E1: float
    E2: float
    E3: float
    nu12: float
    nu13: float
    nu23: float
    G12: float
    G13: float
    G23: float
    rho: float

    def __post_init__(self) -> None:
        """Refuse values no material has."""
        names = ("E1", "E2", "E3", "G12", "G13", "G23")
        refuse_not_positive("material", **{name: getattr(self, name) for name in names})
        refuse_no_density(self.rho)
        if not np.linalg.eigvalsh(self._compliance()[:3, :3])[0] > 0:
            ratios = f"nu12 = {self.nu12:g}, nu13 = {self.nu13:g}, nu23 = {self.nu23:g}"
            raise InputError(f"material {ratios}: some strain has no positive energy; nu_ij^2 must stay below E_i/E_j")

    def moduli(self) -> np.ndarray:
        """Return the stiffness ``(6, 6)``, Pa, of strains 11, 22, 33, 12, 23, 13 (engineering shear)."""
        return np.linalg.inv(self._compliance())

    def _compliance(self) -> np.ndarray:
        S = np.diag([1 / self.E1, 1 / self.E2, 1 / self.E3, 1 / self.G12, 1 / self.G23, 1 / self.G13])
        S[0, 1] = S[1, 0] = -self.nu12 / self.E1
        S[0, 2] = S[2, 0] = -self.nu13 / self.E1
        S[1, 2] = S[2, 1] = -self.nu23 / self.E2
        return S


@dataclass(frozen=True, kw_only=True)
class Anisotropic:
    """Anisotropic material of solids: all 21 moduli along the axes e1, e2, e3 of the solid.

    Attributes
    ----------
    C : tuple of 21 floats
        Upper triangle, row by row, of the stiffness of strains 11, 22, 33, 12, 23, 13 (engineering shear), Pa; the
        order of Nastran's MAT9.
    rho : float
        Density, kg/m^3; zero where the mass comes from elsewhere.

    Raises
    ------
    InputError
        When there are not 21 numbers, or some strain has no positive energy.

    Examples
    --------
    >>> silicon = Anisotropic.cubic(c11=166e9, c12=64e9, c44=80e9, rho=2330.0)
    >>> silicon.moduli()[3, 3]
    np.float64(80000000000.0)
    """

    C: tuple[float, ...]
    rho: float

    def __post_init__(self) -> None:
        """Refuse values no material has."""
        refuse_no_density(self.rho)
        if len(self.C) != 21 or not all(math.isfinite(c) for c in self.C):
            raise InputError(f"material C has {len(self.C)} numbers; give the 21 of the upper triangle, row by row")
        if not np.linalg.eigvalsh(self.moduli())[0] > 0:
            raise InputError("material C: some strain has no positive energy; the matrix must be positive definite")

    @classmethod
    def cubic(cls, *, c11: float, c12: float, c44: float, rho: float) -> Anisotropic:
        """Return a cubic crystal along its axes, moduli in Pa."""
        rows = ((c11, c12, c12, 0, 0, 0), (c11, c12, 0, 0, 0), (c11, 0, 0, 0), (c44, 0, 0), (c44, 0), (c44,))
        return cls(C=tuple(float(c) for row in rows for c in row), rho=rho)

    def moduli(self) -> np.ndarray:
        """Return the stiffness ``(6, 6)``, Pa, of strains 11, 22, 33, 12, 23, 13 (engineering shear)."""
        C = np.zeros((6, 6))
        C[np.triu_indices(6)] = self.C
        return C + np.triu(C, 1).T


def refuse_not_positive(what: str, **values: float) -> None:
    """Raise InputError naming the first value that is not a positive number, or whose products would be none."""
    for name, value in values.items():
        if not 1 / LARGEST < value < LARGEST:
            wanted = "positive" if not value > 0 else f"between {1 / LARGEST:g} and {LARGEST:g}"
            raise InputError(f"{what} {name} = {value:g} must be {wanted}; give SI units (Pa, kg/m^3, m, m^2, m^4)")


def refuse_no_density(rho: float) -> None:
    """Raise InputError when a density is negative or no number; zero is that of a part without mass."""
    if not 0 <= rho < LARGEST:
        wanted = "zero or positive" if not rho > 0 else f"below {LARGEST:g}"
        raise InputError(f"material rho = {rho:g} must be {wanted}; give SI units (kg/m^3)")
