"""The energy of a loaded system at one state."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.evaluation.evaluate import Equations, load
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.energy import body_sums
from modalprep.multibody.kernels.interfaces import world


def energy(eq: Equations, t: float, y: np.ndarray) -> float:
    """Return the energy (J) of all bodies, springs and fields at a state ``y (nx + nu + 1,)``."""
    load(eq, t, y)
    model, data = eq.model, eq.data
    outward(model, data, y, eq.motion)  # loads may have added to the bodies' own inertias
    world(model, data)
    total = float(eq.shared[0].stored + eq.shared[0].potential)
    for link in np.flatnonzero(model.links["body"] >= 0):
        sums = body_sums(model, data, link)
        total += sums.kinetic + sums.strain + sums.gravity
    return total
