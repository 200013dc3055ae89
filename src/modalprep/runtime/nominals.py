"""Sizes of the states of an FMU, by which importing programs measure errors."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed

DEFLECTION = 0.01  # sizes of a body, as the step control of runs has it


def nominals(system: System, packed: Packed, deflections: np.ndarray) -> np.ndarray:
    """Return the size of each coordinate, speed, and of the work (nx + nu + 1,).

    A radian, and one in a second; a hundredth of a body's size for the deflection by a mode, and that times its
    frequency; the size of the largest body for a displacement, and that in a second. Work: the mass of all bodies at
    such a speed.

    Parameters
    ----------
    deflections : (nx,)
        By each modal coordinate, in sizes of its body.
    """
    length = max(float(np.ptp(body.points, axis=0).max(initial=0.0)) for body in system.bodies.values()) or 1.0
    found = np.ones(packed.nx + packed.nu + 1)
    columns = (packed.model.links[name].tolist() for name in ("joint", "x", "u"))
    for kind, x, u in zip(*columns, strict=True):
        count = KINDS[kind].translations
        found[x : x + count] = found[packed.nx + u : packed.nx + u + count] = length
    for name, body in system.bodies.items():
        if body.n:
            own, rates = packed.modes_of(name), packed.modal_rates_of(name)
            reach = deflections[own]
            found[own] = np.where(reach > 0, DEFLECTION / np.where(reach > 0, reach, 1.0), 1.0)
            found[rates] = found[own] * np.maximum(np.sqrt(np.maximum(body.K, 0.0)), 1.0)
    found[-1] = sum(float(body.m) for body in system.bodies.values()) * length**2 or 1.0
    return found
