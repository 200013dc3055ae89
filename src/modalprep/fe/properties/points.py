"""Properties without a volume: point masses and springs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.properties.materials import LARGEST
from modalprep.fe.properties.properties import Property, Vector
from modalprep.vectors import ROUNDING, impossible_inertia, inertia_tensor

Vector6 = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class PointMass(Property):
    """Rigid body at each node of a group.

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
        When the mass is negative or infinite, or a principal moment of inertia is.

    Examples
    --------
    >>> PointMass(mass=2.0, inertia=(0.1, 0.1, 0.2, 0.0, 0.0, 0.0)).offset
    (0.0, 0.0, 0.0)
    """

    mass: float
    inertia: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    offset: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse what no rigid body has."""
        if not 0 <= self.mass < LARGEST:
            raise InputError(f"point mass of {self.mass:g} kg must not be negative, and below {LARGEST:g}")
        for name, count in (("offset", 3), ("inertia", 6)):
            given = list(getattr(self, name))
            if len(given) != count or not np.all(np.abs(given) < LARGEST):
                raise InputError(f"point mass: {name} {given} needs {count} numbers below {LARGEST:g}")
        moments = np.linalg.eigvalsh(inertia_tensor(self.inertia))
        if moments[0] < -ROUNDING * moments[-1]:
            raise InputError(f"point mass: inertia has a negative principal moment: {moments.round(6).tolist()}")


def impossible_masses(sections: Mapping[str, Property]) -> list[str]:
    """Return a note for each point mass with the inertia of no body, as lumped models have it about one axis.

    Examples
    --------
    >>> impossible_masses({"disc": PointMass(mass=1.0, inertia=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))})
    ["the inertia of 'disc' is physically impossible: of its principal moments [0.0, 0.0, 2.0] the largest exceeds the \
sum of the others"]
    """
    masses = {group: section for group, section in sections.items() if isinstance(section, PointMass)}
    found = {group: impossible_inertia(inertia_tensor(each.inertia)) for group, each in masses.items()}
    return [f"the inertia of {group!r} is physically impossible: {why}" for group, why in found.items() if why]


@dataclass(frozen=True, kw_only=True)
class Spring(Property):
    """Six springs and dampers between two nodes (line cells), or from a node to the ground (vertex cells).

    Between two nodes, e1 runs from the first to the second and ``e2 = up x e1``; coincident nodes and grounded
    springs use the mesh axes. The elastic centre lies at the fraction `location` of the line between the nodes,
    so that the rigid rotation of a bushing of finite length causes no force. The mesh may override the axes.

    Attributes
    ----------
    translation : tuple of 3 floats
        Stiffness along e1, e2, e3, N/m.
    rotation : tuple of 3 floats
        About them, N m/rad.
    up : tuple of 3 floats
        A direction that is not parallel to the line between the nodes, mesh axes.
    location : float
        0 at the first node, 1 at the second.
    translation_damping : tuple of 3 floats
        Viscous damping along e1, e2, e3, N s/m.
    rotation_damping : tuple of 3 floats
        About them, N m s/rad.

    Raises
    ------
    InputError
        When a stiffness or a damping is negative, or all are zero.

    Examples
    --------
    >>> Spring(translation=(1e6, 1e6, 1e6)).location
    0.5
    """

    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 0.0, 1.0)
    location: float = 0.5
    translation_damping: Vector = (0.0, 0.0, 0.0)
    rotation_damping: Vector = (0.0, 0.0, 0.0)

    @property
    def k(self) -> Vector6:
        """All six stiffnesses, translations first."""
        return (*self.translation, *self.rotation)

    @property
    def c(self) -> Vector6:
        """All six dampings, translations first."""
        return (*self.translation_damping, *self.rotation_damping)

    def __post_init__(self) -> None:
        """Refuse springs without stiffness and damping."""
        both = (*self.k, *self.c)
        if len(both) != 12 or not all(0 <= value < float("inf") for value in both) or not any(both):
            damped = (
                f", damping {self.translation_damping} N s/m, {self.rotation_damping} N m s/rad" if any(self.c) else ""
            )
            raise InputError(
                f"spring with translation {self.translation} N/m, rotation {self.rotation} N m/rad{damped}: each needs "
                "three numbers, none negative, one of all positive"
            )
