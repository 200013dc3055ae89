"""Properties of mesh groups: materials with the sections of beams, trusses, shells and solids."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

from modalprep.errors import InputError
from modalprep.fe.properties.materials import Anisotropic, Material, Orthotropic, Orthotropic3D, refuse_not_positive
from modalprep.suggest import refuse_unknown
from modalprep.vectors import frame_of_axes

# Poisson's ratio of solids. Above it elements lock more and more: frequencies of the bracket of second-order tetrahedra
# lie 0.6 % above those of nu = .49 for .5 - 1e-3, 2 % for .5 - 1e-4, 4 % for .5 - 1e-5 and 8 % for .5 - 1e-7; at
# .5 - 1e-8 round-off hides modes.
INCOMPRESSIBLE = 0.49999

Vector = tuple[float, float, float]
BeamTheory = Literal["timoshenko", "euler-bernoulli"]
Membrane = Literal["opt", "cst"]
SolidIntegration = Literal["full", "reduced_stiffness", "reduced"]


@dataclass(frozen=True, kw_only=True)
class Property:
    """Base of all properties of mesh groups; `fe.families` registers the block that evaluates each."""


@dataclass(frozen=True, kw_only=True)
class Beam(Property):
    """Section of straight two-node beams, by Timoshenko or by Euler and Bernoulli.

    The section axes are e1 along the beam, ``e2 = up x e1`` and ``e3 = e1 x e2``, so that e3 points to `up`.
    The mesh may override `up` and `offset` for single elements (``Mesh.data``).

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
    offset : tuple of 2 floats
        From the nodes' line to the centroid along e2 and e3, m (eccentric stiffeners).
    nsm : float
        Further mass per length, kg/m.
    theory : {"timoshenko", "euler-bernoulli"}
        Whether shear deforms the beam, or not.
    fibres : tuple of tuples of 2 or 3 floats
        Points of the section where stress is recovered: y, z from the centroid along e2 and e3 (m) and, where it is
        known, the shear stress of a unit torque there (1/m^3).
    shear_centre : tuple of 2 floats
        From the centroid to the shear centre along e2 and e3, m.
    taper : tuple of tuples of 6 floats
        Sections along each element: position from 0 at its first node to 1 at its second, A, Iy, Iz, J and nsm; linear
        in between. Empty for beams of one section. Beams of several elements need a section for each of them.
    bar : bool
        Whether it is a CBAR, which has no inertia about its own axis where the mass is distributed as in Nastran.

    Raises
    ------
    InputError
        When a section value is not positive, or a fibre is not two or three numbers.

    References
    ----------
    Theory 7.1.

    Examples
    --------
    >>> steel = Material(E=210e9, nu=0.3, rho=7800.0)
    >>> Beam(material=steel, A=6e-4, Iy=4.5e-8, Iz=2e-8, J=4.7e-8).up
    (0.0, 0.0, 1.0)
    """

    material: Material
    A: float
    Iy: float
    Iz: float
    J: float
    ky: float = 5 / 6
    kz: float = 5 / 6
    up: Vector = (0.0, 0.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    nsm: float = 0.0
    theory: BeamTheory = "timoshenko"
    fibres: tuple[tuple[float, ...], ...] = ()
    shear_centre: tuple[float, float] = (0.0, 0.0)
    taper: tuple[tuple[float, ...], ...] = ()
    bar: bool = False

    def section_at(self, x: float) -> tuple[float, ...]:
        """Return A, Iy, Iz, J and nsm at the fraction x of the length.

        Examples
        --------
        >>> steel = Material(E=210e9, nu=0.3, rho=7800.0)
        >>> ends = (0.0, 1e-4, 4e-9, 2e-9, 5e-9, 0.0), (1.0, 3e-4, 8e-9, 2e-9, 9e-9, 0.0)
        >>> Beam(material=steel, A=2e-4, Iy=6e-9, Iz=2e-9, J=7e-9, taper=ends).section_at(0.5)[1]
        6e-09
        """
        if not self.taper:
            return self.A, self.Iy, self.Iz, self.J, self.nsm
        for (a, *first), (b, *second) in pairwise(self.taper):
            if x <= b:
                w = (x - a) / (b - a)
                return tuple((1 - w) * u + w * v for u, v in zip(first, second, strict=True))
        return tuple(self.taper[-1][1:])

    def __post_init__(self) -> None:
        """Refuse sections without area or stiffness."""
        places = [place[0] for place in self.taper]
        if (places and (places[0], places[-1]) != (0.0, 1.0)) or any(a >= b for a, b in pairwise(places)):
            raise InputError(f"taper of a beam: the positions {places} do not increase from 0 to 1")
        for place in self.taper:
            names = ("position", "A", "Iy", "Iz", "J", "nsm")
            refuse_not_positive("taper of a beam", **dict(zip(names, place, strict=True)) | {"position": 1, "nsm": 1})
        values = {name: getattr(self, name) for name in ("A", "Iy", "Iz", "J", "ky", "kz")}
        refuse_not_positive("beam section", **values)
        refuse_unknown(self.theory, get_args(BeamTheory), "theory of a beam:")
        for fibre in self.fibres:
            if len(fibre) not in (2, 3) or not all(math.isfinite(x) for x in fibre):
                raise InputError(f"fibre {list(fibre)} of a beam is not y, z and, where known, the shear per torque")


@dataclass(frozen=True, kw_only=True)
class Truss(Property):
    """Section of two-node bars that carry axial force and, with ``J > 0``, torque.

    Attributes
    ----------
    material : Material
    A : float
        Area, m^2.
    J : float
        Torsion constant, m^4; with 0 the bar does not involve the rotations of its nodes.
    nsm : float
        Further mass per length, kg/m.

    Raises
    ------
    InputError
        When the area is not positive.

    References
    ----------
    Theory 7.2.

    Examples
    --------
    >>> Truss(material=Material(E=210e9, nu=0.3, rho=7800.0), A=1e-4).J
    0.0
    """

    material: Material
    A: float
    J: float = 0.0
    nsm: float = 0.0

    def __post_init__(self) -> None:
        """Refuse bars without area."""
        refuse_not_positive("truss section", A=self.A)


@dataclass(frozen=True, kw_only=True)
class Ply:
    """One layer of a laminate.

    Attributes
    ----------
    material : Material or Orthotropic
    thickness : float
        m.
    angle : float
        From the shell's axis 1 to the fibre, about the normal, rad.

    Raises
    ------
    InputError
        When the thickness is not positive.

    Examples
    --------
    >>> Ply(material=Material(E=70e9, nu=0.3, rho=2700.0), thickness=1e-3).angle
    0.0
    """

    material: Material | Orthotropic
    thickness: float
    angle: float = 0.0

    def __post_init__(self) -> None:
        """Refuse plies without thickness."""
        refuse_not_positive("ply", thickness=self.thickness)


@dataclass(frozen=True, kw_only=True)
class Shell(Property):
    """Section of shells with membrane, bending, transverse shear and drilling stiffness.

    Cells are flat three-node and warped four-node ones, and curved ones of six to nine nodes. A homogeneous sheet has
    `material` and `thickness`; a laminate has `plies`, listed from the bottom (-e3) to the top. Axis 1 of the material
    is the projection of `axis` on the element, rotated by `angle` about its normal. The mesh may override `axis`,
    `angle`, `offset` and, at the corners of a homogeneous sheet, `thickness` for single elements (``Mesh.data``).

    Attributes
    ----------
    material : Material or Orthotropic or None
    thickness : float
        m.
    plies : tuple of Ply
    offset : float
        From the nodes to the mid-surface along the element's normal, m.
    nsm : float
        Further mass per area, kg/m^2.
    axis : tuple of 3 floats or None
        Mesh axes; None takes the element's first side.
    angle : float
        rad.
    bending_ratio : float
        Bending inertia over ``t^3/12`` (sandwich panels).
    shear_ratio : float
        Shear thickness over ``t``.
    bending_material, shear_material : Material or Orthotropic or None
        None takes `material`.
    membrane : {"opt", "cst"}
        Three-node triangles only: optimal drilling triangle, or constant strain (very thin doubly curved shells).

    Raises
    ------
    InputError
        When the thickness or a ratio is not positive, both or neither of material and plies are given, or the
        membrane is unknown.

    References
    ----------
    Theory 7.3, of curved shells theory 7.8.

    Examples
    --------
    >>> skin, core = Material(E=70e9, nu=0.3, rho=2700.0), Material(E=1e8, nu=0.3, rho=50.0)
    >>> sheets = [(skin, 1e-3), (core, 1e-2), (skin, 1e-3)]
    >>> len(Shell(plies=tuple(Ply(material=m, thickness=t) for m, t in sheets)).plies)
    3
    """

    material: Material | Orthotropic | None = None
    thickness: float = 0.0
    plies: tuple[Ply, ...] = ()
    offset: float = 0.0
    nsm: float = 0.0
    axis: Vector | None = None
    angle: float = 0.0
    bending_ratio: float = 1.0
    shear_ratio: float = 5 / 6
    bending_material: Material | Orthotropic | None = None
    shear_material: Material | Orthotropic | None = None
    membrane: Membrane = "opt"

    def __post_init__(self) -> None:
        """Refuse shells without material or thickness."""
        if (self.material is None) == (not self.plies):
            raise InputError("a shell needs either a material with a thickness or a list of plies")
        if not self.plies:
            refuse_not_positive("shell", thickness=self.thickness)
        refuse_unknown(self.membrane, get_args(Membrane), "shell: membrane")
        refuse_not_positive("shell", bending_ratio=self.bending_ratio, shear_ratio=self.shear_ratio)


@dataclass(frozen=True, kw_only=True)
class Solid(Property):
    """Three-dimensional continuum of tetrahedra, pyramids, wedges and hexahedra of first or second order.

    The mesh may override the axes of the material for single elements (``Mesh.data``, "frame").

    Attributes
    ----------
    material : Material, Orthotropic3D or Anisotropic
    axes : two (3,) vectors or None
        e1, and a direction in the plane of e1 and e2, of the material's axes in those of the mesh; None takes these.
    integration : {"full", "reduced_stiffness", "reduced"} or None
        Of hexahedra of 20 nodes: by 3 x 3 x 3 points; by 2 x 2 x 2, which do not lock on thin curved walls, of the
        stiffness (as Abaqus and Ansys do) or of stiffness and mass (as CalculiX does). None takes what the mesh says of
        single elements (``Mesh.data``, "integration"), else full.

    Raises
    ------
    InputError
        When the material is one of shells or nearly incompressible, the axes lie on one line, or the integration is
        unknown.

    References
    ----------
    Theory 7.5.

    Examples
    --------
    >>> Solid(material=Material(E=70e9, nu=0.3, rho=2700.0)).material.rho
    2700.0
    """

    material: Material | Orthotropic3D | Anisotropic
    axes: tuple[Vector, Vector] | None = None
    integration: SolidIntegration | None = None

    def __post_init__(self) -> None:
        """Refuse laminae, axes on one line and unknown integrations."""
        refuse_unknown(self.integration or "full", get_args(SolidIntegration), "solid: integration")
        if isinstance(self.material, Orthotropic):
            raise InputError("a solid cannot be made of a lamina, which lacks E3, nu13, nu23; give an Orthotropic3D")
        if isinstance(self.material, Material) and self.material.nu > INCOMPRESSIBLE:
            raise InputError(
                f"a solid is nearly incompressible with nu = {self.material.nu!r}: its elements lock, and round-off "
                f"hides their stiffness in shear; give at most nu = {INCOMPRESSIBLE}"
            )
        if self.axes is not None:
            frame_of_axes(self.axes, "a solid")
