"""A step of the explicit Runge-Kutta method as a map of changes, and its reverse.

With ``Y_i = y + h sum a_ij k_j``, ``k_i = f(Y_i, p)`` and the derivatives F_i of f at the stages, changes follow from
``dk_i = F_i dY_i``. Reversed, stage by stage from the last: ``k_i* = h b_i y* + h sum_(j > i) a_ji Y_j*`` and
``Y_i* = F_i' k_i*``, whose sum is what the state before the step gets (Hager 2000; Sandu 2006).
"""

from __future__ import annotations

import numpy as np

from modalprep.multibody.integration.dop853_table import STAGES, A, B, C
from modalprep.sensitivity.local import Local, Model
from modalprep.sensitivity.projection import Projection
from modalprep.sensitivity.trace import Step


class ExplicitStep:
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

    def forward(self, dz: np.ndarray) -> np.ndarray:
        """Return the changes (ny + 2 nu, np) after the step."""
        ny, h = len(self.step.y), self.step.h
        dy = self.projection.forward(dz[:ny])
        rates: list[np.ndarray] = []
        for i, stage in enumerate(self.stages):
            rates.append(stage.forward(dy + h * sum((A[i][j] * rates[j] for j in range(i)), np.zeros_like(dy))))
        after = dy + h * sum((b * rate for b, rate in zip(B, rates, strict=True)), np.zeros_like(dy))
        found = np.zeros_like(dz)
        found[:ny] = self.model.layout.normalised(self.raw, after)
        return found

    def reverse(self, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return the gradient (ny + 2 nu,) by the state before; that by the parameters is added to `bar_p`."""
        ny, h = len(self.step.y), self.step.h
        after = self.model.layout.normalised(self.raw, bar[:ny, None])[:, 0]  # a symmetric map
        rates = [h * b * after for b in B]
        before = after.copy()
        for i in range(STAGES - 1, -1, -1):
            own = self.stages[i].reverse(rates[i], bar_p)
            before += own
            for j in range(i):
                rates[j] += h * A[i][j] * own
        found = np.zeros_like(bar)
        found[:ny] = self.projection.reverse(before, bar_p)
        return found
