"""A step of the explicit Runge-Kutta method as a map of changes.

With ``Y_i = y + h sum a_ij k_j``, ``k_i = f(Y_i, p)`` and the derivatives F_i of f at the stages, changes follow from
``dk_i = F_i dY_i``. Trees go back in compiled code (stages_back.py).
"""

from __future__ import annotations

import numpy as np

from modalprep.multibody.integration.dop853_table import STAGES, A, B, C
from modalprep.sensitivity.local import Local, Model
from modalprep.sensitivity.projection import Projection
from modalprep.sensitivity.tangent_maps import StepMap
from modalprep.sensitivity.trace import Step


class ExplicitStep(StepMap):
    """The stages of a step, at which the equations of motion are linear in changes; the state is closed before it."""

    def __init__(self, model: Model, step: Step) -> None:
        self.model, self.step = model, step
        self.stages: list[Local] = []
        rates: list[np.ndarray] = []
        for i in range(STAGES):
            y = step.y + step.h * sum((A[i][j] * rates[j] for j in range(i)), np.zeros_like(step.y))
            self.stages.append(Local(model, y, step.at(C[i])))
            rates.append(self.stages[i].ydot)
        self.projection = Projection(self.stages[0])
        self.raw = step.y + step.h * sum((B[j] * rates[j] for j in range(STAGES)), np.zeros_like(step.y))

    def forward(self, dz: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the changes (ny + 2 nu, k) after the step."""
        ny, h = len(self.step.y), self.step.h
        dy = self.projection.forward(dz[:ny], dp)
        rates: list[np.ndarray] = []
        for i, stage in enumerate(self.stages):
            rates.append(stage.forward(dy + h * sum((A[i][j] * rates[j] for j in range(i)), np.zeros_like(dy)), dp))
        after = dy + h * sum((b * rate for b, rate in zip(B, rates, strict=True)), np.zeros_like(dy))
        found = np.zeros_like(dz)
        found[:ny] = self.model.layout.normalised(self.raw, after)
        return found
