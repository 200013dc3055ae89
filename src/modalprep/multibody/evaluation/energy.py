"""The energy of a loaded system at one state."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.evaluation.evaluate import POTENTIAL, SPRINGS, Model, load
from modalprep.multibody.kernels.articulated_body import outward, world
from modalprep.multibody.kernels.data import BODY
from modalprep.multibody.kernels.energy import body_sums


def energy(model: Model, t: float, y: np.ndarray) -> float:
    """Return the energy (J) of all bodies, springs and fields at a state ``y (nx + nu + 1,)``."""
    load(model, t, y)
    tree, flex, W, F = model.tree, model.flex, model.W, model.F
    outward(tree, flex, W, F, y, model.motion)  # loads may have added to the bodies' own inertias
    world(tree, W)
    total = float(model.shared[SPRINGS] + model.shared[POTENTIAL])
    for link in np.flatnonzero(tree.ints[:, BODY] >= 0):
        sums = body_sums(tree, flex, W, F, link)
        total += sums.kinetic + sums.strain + sums.gravity
    return total
