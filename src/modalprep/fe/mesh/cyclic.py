"""Cyclic symmetry: a structure of equal sectors around an axis, of which a mesh has one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.vectors import rotation_matrix

LOW, HIGH = "cyclic_low", "cyclic_high"  # groups of the edges that a deck names


@dataclass(frozen=True, eq=False, kw_only=True)
class CyclicSymmetry(Record):
    """A mesh is one of `sectors` equal sectors around an axis.

    Attributes
    ----------
    sectors : int
        Their number in the whole circle.
    axis : (3,)
        Direction of the axis, mesh axes.
    point : (3,)
        A point on the axis, m, mesh coordinates.
    low, high : str
        Groups with the nodes of the two edges. Those of `high` follow those of `low`, which the rotation by one sector
        moves onto them, or the reverse. Empty: all nodes that it moves onto others.
    whole : bool
        Whether the mesh has all sectors (`make_ring`).
    tolerance : float
        m, how far nodes may lie from where the rotation moves their partners; 0: 1e-5 of the size of the mesh.

    Raises
    ------
    InputError
        When there are less than two sectors, the axis has no direction, or one edge alone is named.

    References
    ----------
    Theory 3.9.

    Examples
    --------
    >>> CyclicSymmetry(sectors=8).rotation(2).round(9)[0]
    array([ 0., -1.,  0.])
    """

    sectors: int
    axis: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    low: str = ""
    high: str = ""
    tolerance: float = 0.0
    whole: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no symmetry."""
        for name in ("axis", "point"):
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != (3,) or not np.all(np.isfinite(value)):
                raise InputError(f"cyclic symmetry: {name} must be three numbers, it is {getattr(self, name)!r}")
            object.__setattr__(self, name, value)
        if self.sectors != int(self.sectors) or self.sectors < 2:
            raise InputError(f"cyclic symmetry: sectors = {self.sectors} must be a whole number of at least 2")
        if not np.any(self.axis):
            raise InputError("cyclic symmetry: the axis (0, 0, 0) has no direction")
        if bool(self.low) != bool(self.high):
            raise InputError(f"cyclic symmetry names the edge {self.low or self.high!r} alone; name low and high")
        if not self.low and self.sectors == 2:
            raise InputError("cyclic symmetry of 2 sectors: half a turn moves both edges onto each other; name them")
        super().__post_init__()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a model of the mesh by itself should say."""
        said = (
            f"the mesh is one of {self.sectors} sectors, and its edges are free in this model: [cyclic] of a pipeline "
            "file, cyclic_modes and make_ring join them"
        )
        return () if self.whole else (said,)

    @property
    def direction(self) -> np.ndarray:
        """Unit vector (3,) of the axis."""
        return self.axis / np.linalg.norm(self.axis)

    @property
    def angle(self) -> float:
        """Angle of a sector, rad."""
        return 2 * np.pi / self.sectors

    def rotation(self, turns: int) -> np.ndarray:
        """Return the rotation (3, 3) by a number of sectors."""
        return rotation_matrix(self.direction * self.angle * turns)

    def turned(self, points: np.ndarray, turns: int) -> np.ndarray:
        """Return points (k, 3), m, mesh coordinates, rotated by a number of sectors about the axis."""
        return self.point + (points - self.point) @ self.rotation(turns).T

    def radius(self, points: np.ndarray) -> np.ndarray:
        """Return the distances (k,) of points (k, 3) from the axis, m."""
        return np.linalg.norm(np.cross(points - self.point, self.direction), axis=1)
