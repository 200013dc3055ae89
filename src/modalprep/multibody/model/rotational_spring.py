"""Rotational springs and dampers between any two interfaces, linear or by a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

from modalprep.applies import Rule
from modalprep.errors import InputError
from modalprep.multibody.model.loads import GROUND, ON_GROUND, TwoEnded
from modalprep.records import given, optional
from modalprep.vectors import VectorLike, as_rotation, vector


def _table(table: tuple[VectorLike, VectorLike], what: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Return a table as two arrays of numbers."""
    x, torque = (np.asarray(values, dtype=float) for values in table)
    if x.ndim != 1 or x.shape != torque.shape or len(x) < 2:
        raise InputError(f"{what}: needs two lists of as many numbers, two or more")
    if not np.all(np.isfinite([x, torque])) or not np.all(np.diff(x) > 0):
        raise InputError(f"{what}: needs finite numbers, the first list increasing")
    return x, torque


@dataclass(frozen=True, eq=False, kw_only=True)
class RotationalSpring(TwoEnded):
    """A rotational spring and damper about an axis of the first of two interfaces.

    The angle is the part about `axis` of the rotation from the first interface to the second (its twist), between -pi
    and pi: a spring that is wound further belongs to a joint (`HingeElement`). A run ends at pi where the torque would
    jump: a law with one torque at both ends goes on. The torque is
    the derivative of the stored energy by the rotation, also where the interfaces tilt against each other.

    Attributes
    ----------
    name : str
    between : (str, str)
        ``body.interface`` twice, or one and ``ground``.
    axis : (3,)
        In the axes of the first interface.
    stiffness, damping : float
        N m/rad, N m s/rad.
    characteristic : ((n,), (n,)) or None
        Instead of the stiffness: angles (rad) and the torques (N m) that resist them, by which a monotone cubic goes;
        straight on beyond the last ones.
    damping_characteristic : ((n,), (n,)) or None
        Instead of the damping: rates (rad/s) and the torques (N m) that resist them, likewise.
    free_angle : float
        rad, from which the angles of the spring count.
    rotation : rotation
        The frame on the ground, inertial: a matrix (3, 3), a quaternion w, x, y, z, or a pair of axis and angle (rad),
        kept as the matrix.

    Raises
    ------
    InputError
        When a constant is negative, the axis has no direction, or a table is not one.

    References
    ----------
    Theory 5.7. Fritsch, Carlson (1980), Monotone piecewise cubic interpolation, SIAM Journal on Numerical Analysis 17.

    Examples
    --------
    >>> stop = ([-0.2, -0.1, 0.1, 0.2], [-9.0, 0.0, 0.0, 9.0])
    >>> joint = RotationalSpring(name="play", between=("hull.a", "fin.root"), axis=[0, 0, 1], characteristic=stop)
    >>> joint.knots("stiffness")[:, 2].tolist()
    [-9.0, 0.0, 0.0, 9.0]
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("rotation",), needs=("between",), among=(GROUND,), advice=ON_GROUND),
        Rule(("free_angle",), needs=("stiffness", "characteristic")),
    )
    axis: np.ndarray = given(converter=vector, default=(0.0, 0.0, 1.0))
    stiffness: float = 0.0
    damping: float = 0.0
    characteristic: tuple[np.ndarray, np.ndarray] | None = given(converter=optional(_table), default=None)
    damping_characteristic: tuple[np.ndarray, np.ndarray] | None = given(converter=optional(_table), default=None)
    free_angle: float = 0.0
    rotation: np.ndarray = given(converter=as_rotation, default_factory=lambda: np.eye(3))
    noun: ClassVar[str] = "rotational spring"

    def __post_init__(self) -> None:
        """Normalise the axis, read the tables and check the constants."""
        what = f"{self.noun} {self.name!r}"
        self._convert(f"{what}: ")
        axis = self.axis
        if axis.shape != (3,) or not 0 < np.linalg.norm(axis) < np.inf:
            raise InputError(f"{what}: axis {axis.tolist()} has no direction")
        object.__setattr__(self, "axis", axis / np.linalg.norm(axis))
        for constant, key in (("stiffness", "characteristic"), ("damping", "damping_characteristic")):
            value, table = getattr(self, constant), getattr(self, key)
            if not 0 <= value < np.inf:
                raise InputError(f"{what}: {constant} = {value:g} must not be negative")
            if value and table is not None:
                raise InputError(f"{what}: {constant} and {key} exclude each other; leave one out")
        if self.damping_characteristic is not None and np.any(np.prod(self.damping_characteristic, axis=0) < 0):
            raise InputError(f"{what}: damping_characteristic drives at some rates; its torques need the rates' signs")
        super().__post_init__()

    def knots(self, constant: str) -> np.ndarray:
        """Return angle or rate, integral of the torque, torque and slope at the points of a law (n, 4).

        Parameters
        ----------
        constant : {"stiffness", "damping"}

        Returns
        -------
        numpy.ndarray (n, 4)
            Without a table those of a straight line. The integral is the energy (J) of a spring, zero at zero.
        """
        table = self.characteristic if constant == "stiffness" else self.damping_characteristic
        x, torque = ([-1.0, 1.0], [-getattr(self, constant), getattr(self, constant)]) if table is None else table
        law = scipy.interpolate.PchipInterpolator(x, torque)
        energy = law.antiderivative()
        return np.column_stack([x, energy(x) - energy(np.clip(0.0, x[0], x[-1])), torque, law.derivative()(x)])
