"""What a mesh group is made of: material and section."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from modalprep.errors import InputError
from modalprep.fe.properties.materials import Material, Orthotropic, refuse_not_positive
from modalprep.suggest import refuse_unknown

Vector = tuple[float, float, float]
Membrane = Literal["opt", "cst"]
Vector6 = tuple[float, float, float, float, float, float]


class Property:
    """What a mesh group is made of; `fe.families` says which block evaluates each kind."""


@dataclass(frozen=True, kw_only=True)
class Beam(Property):
    """Straight two-node beam, Timoshenko or (``shear=False``) Euler-Bernoulli.

    The section axes are e1 along the beam, ``e2 = up x e1`` and ``e3 = e1 x e2``, so that e3 points to `up`.
    The mesh may override `up` and `offset` per element (``Mesh.data``).

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
    shear : bool
        Whether shear deforms the beam.
    fibres : tuple of tuples of 2 or 3 floats
        Where stress is asked for: y, z from the centroid along e2 and e3 (m) and, where it is known, the shear stress
        of a unit torque there (1/m^3).

    Raises
    ------
    InputError
        When a section value is not positive, or a fibre is not two or three numbers.
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
    shear: bool = True
    fibres: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        """Refuse sections without area or stiffness."""
        values = {name: getattr(self, name) for name in ("A", "Iy", "Iz", "J", "ky", "kz")}
        refuse_not_positive("beam section", **values)
        for fibre in self.fibres:
            if len(fibre) not in (2, 3) or not all(math.isfinite(x) for x in fibre):
                raise InputError(f"fibre {list(fibre)} of a beam is not y, z and, where known, the shear per torque")


@dataclass(frozen=True, kw_only=True)
class Truss(Property):
    """Two-node bar that carries axial force and, with ``J > 0``, torque.

    Attributes
    ----------
    material : Material
    A : float
        Area, m^2.
    J : float
        Torsion constant, m^4; 0 leaves the rotations of its nodes alone.
    nsm : float
        Further mass per length, kg/m.
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
    """One layer of a laminate: its material, thickness (m) and angle (rad) from the shell's axis 1."""

    material: Material | Orthotropic
    thickness: float
    angle: float = 0.0

    def __post_init__(self) -> None:
        """Refuse plies without thickness."""
        refuse_not_positive("ply", thickness=self.thickness)


@dataclass(frozen=True, kw_only=True)
class Shell(Property):
    """Three- or four-node shell: membrane, bending, transverse shear and drilling (theory 7.3).

    A homogeneous sheet is `material` and `thickness`; a laminate is `plies`, listed from the bottom (-e3) to the
    top. Axis 1 of the material is the projection of `axis` on the element turned by `angle` about its normal.
    The mesh may override `axis`, `angle` and `offset` per element (``Mesh.data``).

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
        None takes the element's first side.
    angle : float
        rad.
    bending_ratio : float
        Bending inertia over ``t^3/12`` (sandwich panels).
    shear_ratio : float
        Shear thickness over ``t``.
    bending_material, shear_material : Material or Orthotropic or None
        None takes `material`.
    membrane : {"opt", "cst"}
        Triangles only: optimal drilling triangle, or constant strain (very thin doubly curved shells).

    Raises
    ------
    InputError
        When thickness or a ratio is not positive, or both or neither of material and plies are given, or there is
        no such membrane.
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
    """Three-dimensional continuum: tetrahedra, wedges and hexahedra of first or second order.

    Attributes
    ----------
    material : Material
    """

    material: Material


@dataclass(frozen=True, kw_only=True)
class PointMass(Property):
    """Rigid mass at each node of a group.

    Attributes
    ----------
    mass : float
        kg.
    inertia : tuple of 6 floats
        ``xx, yy, zz, xy, xz, yz`` of the inertia tensor about the mass centre, mesh axes, kg m^2
        (off-diagonal entries are those of the tensor: ``xy = -int x y dm``).
    offset : tuple of 3 floats
        From the node to the mass centre, mesh axes, m.

    Raises
    ------
    InputError
        When the mass is negative.
    """

    mass: float
    inertia: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    offset: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse negative mass."""
        if not 0 <= self.mass < float("inf"):
            raise InputError(f"point mass of {self.mass:g} kg must not be negative")


@dataclass(frozen=True, kw_only=True)
class Spring(Property):
    """Six springs between two nodes (line cells), or from a node to the ground (vertex cells).

    Between two nodes, e1 runs from the first to the second, ``e2 = up x e1``; coincident nodes and grounded
    springs use the mesh axes. The elastic centre lies at the fraction `location` of the line between the nodes,
    so that a bushing of finite length turns as a rigid body without force. The mesh may override the axes.

    Attributes
    ----------
    k : tuple of 6 floats
        N/m along e1, e2, e3; N m/rad about them.
    up : tuple of 3 floats
    location : float
        0 at the first node, 1 at the second.

    Raises
    ------
    InputError
        When a stiffness is negative, or all are zero.
    """

    k: Vector6
    up: Vector = (0.0, 0.0, 1.0)
    location: float = 0.5

    def __post_init__(self) -> None:
        """Refuse springs that do nothing."""
        if len(self.k) != 6 or not all(0 <= k < float("inf") for k in self.k) or not any(self.k):
            raise InputError(
                f"spring k = {self.k} needs six stiffnesses (N/m and N m/rad), none negative, one positive"
            )
