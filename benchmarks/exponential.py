"""What would an exponential Rosenbrock method gain, which solves what is linear exactly?

    python benchmarks/exponential.py

Fixed steps of exprb32 (Hochbruck, Ostermann and Schweitzer 2009, SIAM J. Numer. Anal. 47, 786; order 3, two stages)
with the whole Jacobian by differences and dense matrix exponentials, so only its errors count, not its time, against
the same steps of our Rosenbrock method: places of the tip, relative to the way (see work_precision.py). The last line
is JSON: `exponential_gain`, the error of ours over its error at 320 steps, by motion.
"""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
from motions import stiff_arm, thin_pendulum
from scipy.linalg import expm
from work_precision import OUTPUTS, Measured

from modalprep.multibody import simulate
from modalprep.multibody.evaluation.evaluate import evaluate

STEPS = (20, 80, 320, 1280)
COMPARED = 320
NUDGE = 1e-7


def phi(A: np.ndarray, b: np.ndarray, order: int) -> np.ndarray:
    """Return ``phi_order(A) b``, by the exponential of a matrix with `order` more rows."""
    n = len(b)
    whole = np.zeros((n + order, n + order))
    whole[:n, :n], whole[:n, n] = A, b
    whole[n:-1, n + 1 :] = np.eye(order - 1)
    return expm(whole)[:n, -1]


def jacobian(rate: Callable[[np.ndarray], np.ndarray], y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the derivative of the rates, `at` those of y."""
    moves = NUDGE * np.maximum(1e-3, np.abs(y))
    return np.stack([(rate(y + d * row) - at) / d for d, row in zip(moves, np.eye(len(y)), strict=True)], axis=1)


def exponential_step(rate: Callable[[np.ndarray], np.ndarray], y: np.ndarray, h: float) -> np.ndarray:
    """Return the state after a step of exprb32."""
    at = rate(y)
    J = jacobian(rate, y, at)
    inner = y + h * phi(h * J, at, 1)
    return inner + 2 * h * phi(h * J, rate(inner) - at - J @ (inner - y), 3)


def exponential(case: Measured, steps: int) -> float:
    """Return the error of so many exponential steps."""
    motion = case.motion
    start = simulate.prepare(motion.system, np.array([0.0, motion.t_end]), method="explicit", rtol=1.0, atol=1.0)
    whole, places = np.zeros_like(start.steps.y), []

    def rate(y: np.ndarray) -> np.ndarray:
        evaluate(start.equations, 0.0, np.append(y, 0.0), whole)
        return whole[:-1].copy()

    y = start.steps.y[:-1].copy()
    for k in range(steps):
        y = exponential_step(rate, y, motion.t_end / steps)
        if (k + 1) % (steps // OUTPUTS) == 0:
            places.append(simulate.channels_at(motion.system, y)[motion.followed][0])
    return case.error(np.array(places))


def main() -> None:
    """Print the errors, and the JSON line."""
    gain = {}
    for name, make in (("stiff arm", stiff_arm), ("thin pendulum", thin_pendulum)):
        case = Measured(make())
        for steps in STEPS:
            error = exponential(case, steps)
            own = case.error(case.places(method="rosenbrock", step=case.motion.t_end / steps)[0])
            print(f"{name}, {steps} steps: error {error:.1e}, of ours {own:.1e}", flush=True)
            if steps == COMPARED:
                gain[name] = round(own / error, 1)
    print(json.dumps({"exponential_gain": gain}))


if __name__ == "__main__":
    main()
