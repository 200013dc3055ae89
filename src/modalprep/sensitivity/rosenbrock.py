"""A step of the Rosenbrock method as a map of changes.

A stage solves ``ID(Y, k) + D_0 (r + h g k) + K_0 (h g s_0 + q + (h g)^2 k) = G' l`` with the speeds
``s = s_0 + h g k``, the stiffness and damping K_0, D_0 of modes and hinges, and sums r, q, s_0 of the stages before
(theory 5.3), and closed loops keep the accelerations of their conditions zero: its changes need the tangent of inverse
dynamics at Y with k for the accelerations. Limits and friction make K_0 and D_0 depend on the state before the step,
springs and bushings on that of the stage (compliance.py). Trees without these go back in compiled code
(rosenbrock_back.py).
"""

from __future__ import annotations

import numpy as np

from modalprep.multibody.integration.rosenbrock import ALPHA, GAMMA, STAGES, WEIGHTS, G
from modalprep.sensitivity.local import Local, Model, saddle_inverse
from modalprep.sensitivity.projection import closing
from modalprep.sensitivity.tangent_maps import Kinematics, StepMap
from modalprep.sensitivity.trace import Step


class Stage:
    """A stage of a step: state Y, accelerations k, and what is linear in its changes."""

    def __init__(self, model: Model, step: Step, Y: np.ndarray, c: float, sums: np.ndarray, linear: np.ndarray) -> None:
        nx, wide = model.nx, step.h * G
        rate, place = sums
        own = Y[nx:] + rate
        place = place + wide * own
        K0, D0 = linear
        closed, rows = model.constrained(Y, step.at(c))
        springs = model.compliance
        self.by_places, self.by_rates = springs.matrices(Y)
        M = model.evaluator.mass(Y) + np.diag(wide * D0 + wide**2 * K0)
        M += wide**2 * self.by_places + wide * self.by_rates
        by_force, by_rows = saddle_inverse(M, rows)
        push = model.evaluator.required(Y, np.zeros(model.nu)) + D0 * rate + K0 * place
        push += self.by_places @ place + self.by_rates @ rate
        self.k = by_rows @ closed - by_force @ push
        self.by_linear = np.array([place + wide**2 * self.k, rate + wide * self.k])  # the residual by K_0 and D_0
        more = self.by_places @ self.by_linear[0] + self.by_rates @ self.by_linear[1]
        self.local = Local(model, Y, step.at(c), self.k, more + np.sum(linear * self.by_linear, axis=0))
        self.local.K = self.local.K + springs.force_slopes(Y, *self.by_linear)
        self.by_force, self.by_rows = saddle_inverse(M, self.local.rows.slopes.G if self.local.rows else None)
        self.springs_p = model.compliance_slopes(Y, *self.by_linear)
        self.speed = own + wide * self.k
        self.kinematics: Kinematics = model.layout.kinematics(np.concatenate([Y[:nx], self.speed]))
        self.rate = np.concatenate([self.kinematics.rates_u @ self.speed, self.k])


class RosenbrockStep(StepMap):
    """The four stages of a step, and closed loops closed after it."""

    def __init__(self, model: Model, step: Step) -> None:
        self.model, self.step, nu = model, step, model.nu
        self.linear, self.linear_p = model.linear(step.y, step.begin)
        self.linear_y = linear_slopes(model, step.y) * (self.linear > 0)[:, None]
        self.increments = model.layout.kinematics(step.y).increments
        self.stages: list[Stage] = []
        for i in range(STAGES):
            Y, sums = step.y.copy(), np.zeros((2, nu))
            for j, before in enumerate(self.stages):
                Y += step.h * ALPHA[i, j] * before.rate
                sums += step.h * GAMMA[i, j] * np.array([before.k, before.speed])
            self.stages.append(Stage(model, step, Y, float(ALPHA[i].sum()), sums, self.linear))
        rates = [w * stage.rate for w, stage in zip(WEIGHTS, self.stages, strict=True)]
        self.raw = step.y + step.h * sum(rates, np.zeros_like(step.y))
        wide = step.h * G
        self.projection = closing(model, step, self.raw, (wide**2, wide))

    def forward(self, dz: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the changes (ny + 2 nu, k) after the step."""
        nx, ny, h = self.model.nx, len(self.step.y), self.step.h
        wide = h * G
        K0, D0 = self.linear[:, :, None]
        here = np.stack([self.increments @ dz[:nx], dz[nx:ny]])
        linear = np.einsum("cdk,dkp->ckp", self.linear_y, here) + self.linear_p @ dp
        rates: list[np.ndarray] = []
        speeds: list[np.ndarray] = []
        for i, stage in enumerate(self.stages):
            Y = dz[:ny].copy()
            rate, place = np.zeros((2, self.model.nu, dz.shape[1]))
            for j in range(i):
                Y += h * ALPHA[i, j] * rates[j]
                rate = rate + h * GAMMA[i, j] * rates[j][nx:]
                place = place + h * GAMMA[i, j] * speeds[j]
            own = Y[nx:] + rate
            x, u, local = Y[:nx], Y[nx:], stage.local
            force = local.force(x, u, dp) + np.einsum("ck,ckp->kp", stage.by_linear, linear)
            force += D0 * rate + K0 * (place + wide * own) + stage.springs_p @ dp
            force += stage.by_rates @ rate + stage.by_places @ (place + wide * own)
            k = -stage.by_force @ force - stage.by_rows @ local.acceleration(x, u, dp)
            speeds.append(own + wide * k)
            rates.append(np.vstack([stage.kinematics.rates_x @ x + stage.kinematics.rates_u @ speeds[i], k]))
        after = dz[:ny] + h * sum((w * each for w, each in zip(WEIGHTS, rates, strict=True)), np.zeros_like(rates[0]))
        found = np.zeros_like(dz)
        after = self.model.layout.normalised(self.raw, after)
        found[:ny] = self.projection.forward(after, dp) if self.projection else after
        return found


def linear_slopes(model: Model, y: np.ndarray) -> np.ndarray:
    """Return the derivatives (2, 2, nu) of the stiffness and damping of hinges by their coordinates and speeds."""
    found = np.zeros((2, 2, model.nu))
    for hinge in model.evaluator.loading.arrays.hinges:
        k = int(hinge["speed"])
        x = y[int(hinge["coordinate"])] if hinge["coordinate"] >= 0 else 0.0
        found[:, :, k] += _law_slopes(hinge, x, y[model.nx + k])
    return found


def _law_slopes(c: np.void, x: float, u: float) -> np.ndarray:
    """Return the derivatives (2, 2) of stiffness and damping of `elements.hinge.law` by coordinate and speed."""
    slip = np.tanh(u / c["transition_velocity"])
    friction = -2 * c["friction"] * slip * (1 - slip**2) / c["transition_velocity"] ** 2
    side = float(x > c["upper"]) - float(x < c["lower"])
    damping = side * c["limit_stiffness"] * c["limit_damping"]
    if 1 + side * c["limit_damping"] * u <= 0:  # it is left faster than it springs back
        damping = 0.0
    return np.array([[0.0, damping], [damping, friction]])
