"""Forces in one coordinate of a joint: spring, damper, friction, limits, drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.records import Record, given, optional


@dataclass(frozen=True, eq=False, kw_only=True)
class HingeElement(Record):
    """Spring, damper, friction, limits and drive in one coordinate of a joint: forces (N) or torques (N m).

    Attributes
    ----------
    stiffness, free_position : float
        Spring ``-stiffness (x - free_position)``; N/m or N m/rad, m or rad.
    damping : float
        Viscous, N s/m or N m s/rad.
    friction, transition_velocity : float
        Regularised Coulomb friction ``-friction tanh(rate / transition_velocity)``: the Coulomb force (N) or torque
        (N m), and the velocity of transition from sticking to sliding (m/s or rad/s).
    lower, upper : float
        Limits of the coordinate, m or rad.
    limit_stiffness, limit_damping : float
        The limits push back by ``k p (1 + limit_damping p')`` at penetration p, never inwards; N/m or N m/rad, and
        s/m or s/rad. An impact at speed v rebounds at about ``v / (1 + 2/3 limit_damping v)``.
    drive : TimeFunction or what makes one
        Force or torque of an actuator.

    Raises
    ------
    InputError
        When a constant is negative, or limits cross or have no stiffness.

    Examples
    --------
    >>> HingeElement(stiffness=10.0, drive="sin(t)").limited
    False
    """

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("limit_stiffness", "limit_damping"), needs=("lower", "upper")),)
    stiffness: float = 0.0
    free_position: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    transition_velocity: float = 1e-3
    lower: float = -float("inf")
    upper: float = float("inf")
    limit_stiffness: float = 0.0
    limit_damping: float = 0.0
    drive: TimeFunction | None = given(converter=optional(TimeFunction.of), default=None)

    def __post_init__(self) -> None:
        """Check the constants."""
        refuse_idle(self)
        for name in ("stiffness", "damping", "friction", "limit_stiffness", "limit_damping"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"{name} = {getattr(self, name):g} must not be negative")
        if not self.transition_velocity > 0:
            raise InputError(f"friction: transition_velocity = {self.transition_velocity:g} must be positive")
        if not self.lower < self.upper:
            raise InputError(f"limits: lower = {self.lower:g} must be below upper = {self.upper:g}")
        if self.limited and not self.limit_stiffness > 0:
            raise InputError("limits need a stiffness")
        super().__post_init__()

    @property
    def limited(self) -> bool:
        """Whether there is a limit."""
        return bool(np.isfinite(self.lower) or np.isfinite(self.upper))

    @property
    def needs_coordinate(self) -> bool:
        """Whether it depends on a coordinate, not only on a speed."""
        return self.stiffness > 0 or self.limited
