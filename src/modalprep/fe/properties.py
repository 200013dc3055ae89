"""What a mesh group is made of: material and section."""

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
        Poisson's ratio, in (-1, 0.5).
    rho : float
        Density, kg/m^3.

    Raises
    ------
    InputError
        When a value is not physical.

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
        for name, value in (("E", self.E), ("rho", self.rho)):
            if not 0 < value < float("inf"):
                raise InputError(f"material {name} = {value:g} must be positive; give SI units (Pa, kg/m^3)")
        if not -1 < self.nu < 0.5:
            raise InputError(f"material nu = {self.nu:g} must lie between -1 and 0.5")

    @property
    def G(self) -> float:
        """Shear modulus, Pa."""
        return self.E / (2 * (1 + self.nu))


@dataclass(frozen=True, kw_only=True)
class Beam:
    """Straight two-node beam, Timoshenko or (``shear=False``) Euler-Bernoulli.

    The section axes are e1 along the beam, ``e2 = up x e1`` and ``e3 = e1 x e2``, so that e3 points to `up`.

    Attributes
    ----------
    material : Material
    A : float
        Area, m^2.
    Iy, Iz : float
        Second moments of area about e2 (bending towards e3) and e3 (bending towards e2), m^4.
    J : float
        Torsion constant, m^4.
    ky, kz : float
        Shear factors along e2 and e3.
    up : tuple of 3 floats
        A direction that is not parallel to the beam.
    shear : bool
        Whether shear deforms the beam.

    Raises
    ------
    InputError
        When a section value is not positive.
    """

    material: Material
    A: float
    Iy: float
    Iz: float
    J: float
    ky: float = 5 / 6
    kz: float = 5 / 6
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    shear: bool = True

    def __post_init__(self) -> None:
        """Refuse sections without area or stiffness."""
        for name in ("A", "Iy", "Iz", "J", "ky", "kz"):
            if not 0 < getattr(self, name) < float("inf"):
                raise InputError(f"beam section {name} = {getattr(self, name):g} must be positive (SI units: m^2, m^4)")


@dataclass(frozen=True, kw_only=True)
class Solid:
    """Three-dimensional continuum, meshed by second-order tetrahedra (``tetra10``), edges may be curved.

    Attributes
    ----------
    material : Material
    """

    material: Material


Property = Beam | Solid
