"""Circular cylinders fitted to the nodes of a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.records import Record

ROUND = 2e-3  # of the radius: how far a node may lie off its cylinder
FLAT = 1e-4  # variance of the normals across the axis that a surface must have to be curved
STEPS = 20


@dataclass(frozen=True, eq=False, kw_only=True)
class Cylinder(Record):
    """A circular cylinder.

    Attributes
    ----------
    point : (3,)
        m, on the axis.
    axis : (3,)
        Of length one.
    radius : float
        m.
    """

    point: np.ndarray
    axis: np.ndarray
    radius: float

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return how far points (k, 3) lie outside the cylinder (k,), m."""
        return np.linalg.norm(self.radial(points), axis=1) - self.radius

    def radial(self, points: np.ndarray) -> np.ndarray:
        """Return the vectors (k, 3) from the axis to points (k, 3), m."""
        arm = points - self.point
        return arm - np.outer(arm @ self.axis, self.axis)

    def gap(self, points: np.ndarray) -> float:
        """Return the largest angle (rad) around the axis without any of the points (k, 3)."""
        radial = self.radial(points)
        e1, e2 = normals_to(self.axis)
        angle = np.sort(np.arctan2(radial @ e2, radial @ e1))
        return float(np.diff(angle, append=angle[0] + 2 * np.pi).max())

    def coaxial(self, other: Cylinder, slack: float) -> bool:
        """Whether another cylinder has the same axis and radius within `slack`, m."""
        aside = np.linalg.norm(self.radial(other.point[None]))
        return bool(
            abs(abs(self.axis @ other.axis) - 1) < 1e-6 and aside < slack and abs(self.radius - other.radius) < slack
        )


def fit_cylinder(points: np.ndarray, normals: np.ndarray) -> Cylinder | None:
    """Return the cylinder through nodes of a surface, None where they lie on none.

    The axis is first taken across all normals, the circle from linear least squares; Gauss and Newton's iteration
    then finds the least squares of the distances.

    Parameters
    ----------
    points : (k, 3)
        m.
    normals : (n, 3)
        Of the faces between them, in any length.

    Examples
    --------
    >>> angle = np.arange(12) * np.pi / 6
    >>> ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> found = fit_cylinder(np.concatenate([2 * ring, 2 * ring + [0, 0, 1]]), ring)
    >>> print(found.axis.round(12), round(found.radius, 12))
    [0. 0. 1.] 2.0
    """
    variance, axes = np.linalg.eigh(normals.T @ normals / (normals**2).sum())
    if len(points) < 6 or variance[1] < FLAT:
        return None
    origin = points.mean(axis=0)
    size = np.ptp(points, axis=0).max()
    found = _circle((points - origin) / size, axes[:, 0])
    for _ in range(STEPS):
        if found is None or not 0 < found.radius < 1e3:
            return None
        found, step = _improved(found, (points - origin) / size)
        if step < 1e-14:
            break
    if found is None or np.abs(found.distance((points - origin) / size)).max() > ROUND * found.radius:
        return None
    axis = found.axis * np.sign(found.axis[np.argmax(np.abs(found.axis).round(6))])
    return Cylinder(point=origin + size * found.point, axis=axis, radius=float(size * found.radius))


def normals_to(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two directions (3,) across an axis (3,) of length one, which make right-handed axes with it."""
    e1 = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(axis, e1)


def _circle(points: np.ndarray, axis: np.ndarray) -> Cylinder | None:
    """Return the cylinder of a known axis whose circle solves ``2 c . x + (r^2 - c^2) = x^2`` in least squares."""
    e1, e2 = normals_to(axis)
    flat = np.stack([points @ e1, points @ e2], axis=1)
    system = np.column_stack([2 * flat, np.ones(len(flat))])
    (x, y, rest), _, rank, _ = np.linalg.lstsq(system, (flat**2).sum(axis=1))
    square = rest + x**2 + y**2
    if rank < 3 or not square > 0:
        return None
    return Cylinder(point=x * e1 + y * e2, axis=axis, radius=float(np.sqrt(square)))


def _improved(cylinder: Cylinder, points: np.ndarray) -> tuple[Cylinder, float]:
    """Return a cylinder after one step of Gauss and Newton, and the size of that step."""
    e1, e2 = normals_to(cylinder.axis)
    radial = cylinder.radial(points)
    out = radial / np.maximum(np.linalg.norm(radial, axis=1), 1e-300)[:, None]
    along = (points - cylinder.point) @ cylinder.axis
    slopes = np.stack([-out @ e1, -out @ e2, -along * (out @ e1), -along * (out @ e2), -np.ones(len(points))], axis=1)
    step = np.linalg.lstsq(slopes, -cylinder.distance(points))[0]
    axis = cylinder.axis + step[2] * e1 + step[3] * e2
    better = Cylinder(
        point=cylinder.point + step[0] * e1 + step[1] * e2,
        axis=axis / np.linalg.norm(axis),
        radius=cylinder.radius + step[4],
    )
    return better, float(np.abs(step).max())
