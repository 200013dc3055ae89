"""Springs, dampers, friction, limits and drives in the coordinates of joints (`HingeElement`)."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, value_at
from modalprep.multibody.elements.packer import Packer
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import rows

CONSTANTS = (
    "stiffness",
    "free_position",
    "damping",
    "friction",
    "transition_velocity",
    "lower",
    "upper",
    "limit_stiffness",
    "limit_damping",
)
ROW = np.dtype(
    [
        ("coordinate", np.int64),  # -1: of a joint without named coordinates
        ("speed", np.int64),
        ("drive", np.int64),  # function of time
        *((name, np.float64) for name in CONSTANTS),
    ]
)


def pack(packer: Packer) -> np.recarray:
    """Return the rows of all joints."""
    found = []
    for joint in [joint for joint in packer.system.joints if joint.elements]:
        for element, (x, u) in zip(joint.elements, _places(packer.packed, joint.name), strict=True):
            drive = packer.table(f"joint {joint.name!r}: drive", element.drive)
            found.append((x, u, drive, *(getattr(element, name) for name in CONSTANTS)))
    return rows(ROW, found)


def _places(packed: Packed, joint: str) -> list[tuple[int, int]]:
    """Return coordinate (-1: none of its own) and speed of everything that a joint can move."""
    found = []
    for i in packed.links_of(joint):
        kind, row = KINDS[packed.types[i]], packed.model.links[i]
        found += [(int(row["x"]) if kind.named else -1, int(row["u"]) + k) for k in range(kind.speeds)]
    return found


@compile_kernel
def apply(rows, environment, model, y, t, tau, slope):
    """Add hinge forces to ``tau (nu,)``, their derivatives to ``slope (2, nu)``; returns power, energy stored, 0."""
    power, stored = 0.0, 0.0
    for i in range(len(rows)):
        own = rows[i]
        x = y[own.coordinate] if own.coordinate >= 0 else 0.0
        f, p, e, dx, du = law(own, x, y[model.nx + own.speed], value(environment.tables, own.drive, t))
        tau[own.speed] += f
        slope[0, own.speed] += dx
        slope[1, own.speed] += du
        power, stored = power + p, stored + e
    return power, stored, 0.0


@compile_kernel
def law(c, x, u, drive):
    """Force of one hinge with the constants c at coordinate x and speed u.

    Spring ``-k (x - free)``, damper ``-d u``, Coulomb friction ``-f tanh(u / transition)``, limits as one-sided springs
    with ``k p max(0, 1 + a p')`` at penetration p (Hunt and Crossley 1975, exponent 1), and the drive.

    Returns
    -------
    tau : N or N m
    power : W, of all but the springs
    stored : J, in the springs
    slope_x, slope_u : derivatives of tau
    """
    stretch = x - c.free_position
    tau = -c.stiffness * stretch
    stored = 0.5 * c.stiffness * stretch * stretch
    slip = np.tanh(u / c.transition_velocity)
    other = drive - c.damping * u - c.friction * slip
    slope_x = -c.stiffness
    slope_u = -c.damping - c.friction * (1.0 - slip * slip) / c.transition_velocity
    above, below = x - c.upper, c.lower - x
    if above > 0.0 or below > 0.0:
        side = 1.0 if above > 0.0 else -1.0
        p = above if above > 0.0 else below
        k = c.limit_stiffness
        factor = 1.0 + c.limit_damping * side * u
        tau -= side * k * p
        stored += 0.5 * k * p * p
        if factor > 0.0:
            other -= side * k * p * (factor - 1.0)
            slope_x -= k * factor
            slope_u -= k * p * c.limit_damping
        else:
            other += side * k * p
    return tau + other, other * u, stored, slope_x, slope_u


def dense(system: System, packed: Packed, y: np.ndarray, t: float) -> DenseLoads:
    """Return what the elements of all joints do: the reference implementation."""
    f = np.zeros(packed.nu)
    power = 0.0
    stored = 0.0
    for joint in system.joints:
        for element, (x, u) in zip(joint.elements, _places(packed, joint.name), strict=bool(joint.elements)):
            rate = y[packed.nx + u]
            spring, other, energy = _element(element, 0.0 if x < 0 else y[x], rate, t)
            f[u] += spring + other
            power = power + other * rate
            stored = stored + energy
    return DenseLoads(f, power, stored, 0.0)


def _element(e: HingeElement, x: float, rate: float, t: float) -> tuple[float, float, float]:
    """Return the force of the springs, the force of all else, and the energy in the springs."""
    outside = x - min(max(x, e.lower), e.upper)  # positive above the upper limit
    stop = -e.limit_stiffness * outside
    push = stop * max(0.0, 1 + e.limit_damping * rate * np.sign(outside))
    other = value_at(e.drive, t) - e.damping * rate - e.friction * np.tanh(rate / e.transition_velocity) + push - stop
    energy = (e.stiffness * (x - e.free_position) ** 2 + e.limit_stiffness * outside**2) / 2
    return -e.stiffness * (x - e.free_position) + stop, other, energy
