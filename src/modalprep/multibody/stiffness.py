"""Which step method suits a system: its highest frequencies, with and without what an implicit step treats."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.multibody.driver import ALPHA, EXPLICIT, ROSENBROCK
from modalprep.multibody.evaluate import GOOD, Model, evaluate
from modalprep.multibody.laws import LOWER, UPPER
from modalprep.multibody.loading import Loading
from modalprep.multibody.stepping import FIXED, RTOL, Run, move

STABLE = 6.0  # DOP853 stays stable to h omega of about 6 on the imaginary axis
EQUAL_COST = 0.5  # times 1 / sqrt(rtol): see `_automatic`
FEW_STEPS = 2000  # explicit steps that take less time than it matters
ITERATIONS = 30  # of a power iteration: the frequency to a few per cent, which is all that is asked
NUDGE = 1e-7  # of the largest coordinate


class Choice(NamedTuple):
    """Method, the steps that stability would ask of the explicit one, and why, as the end of a sentence."""

    method: int
    ratio: float
    why: str


def choose(model: Model, run: Run, loading: Loading, method: str, t_end: float) -> Choice:
    """Return the method asked for, or for "auto" the one that should be quickest."""
    loading.enter(*loading.stretches[0])
    top = top_frequency(model, run)
    steps = top * t_end / STABLE
    named = {"explicit": EXPLICIT, "generalized_alpha": ALPHA, "rosenbrock": ROSENBROCK}
    if method in named:
        return Choice(named[method], steps, "")
    return _automatic(model, run, top, steps)


def top_frequency(model: Model, run: Run) -> float:
    """Return the highest frequency (rad/s) of small motions about the start, by power iteration on differences."""
    nx, nu = len(model.state) - len(model.tau), len(model.tau)
    y, base, moved = run.y.copy(), np.zeros(nx + nu + 1), np.zeros(nx + nu + 1)
    if nu == 0 or evaluate(model, 0.0, y, base) != GOOD:
        return 0.0
    near, d, square = y.copy(), np.random.default_rng(0).standard_normal(nu), 0.0
    for _ in range(ITERATIONS):
        d *= NUDGE / np.abs(d).max()
        move(model.tree, model.place, y, d, near)
        if evaluate(model, 0.0, near, moved) != GOOD:
            return 0.0
        force = base[nx:-1] - moved[nx:-1]
        square = float(np.linalg.norm(force) / np.linalg.norm(d))
        if square == 0.0 or not np.isfinite(square):
            return 0.0
        d = force
    return float(np.sqrt(square))


def _automatic(model: Model, run: Run, top: float, steps: float) -> Choice:
    """Implicit where stability, not accuracy, would hold the explicit step.

    A step of order 2 or 3 resolves a mode of frequency w and amplitude a to ``(h w)^3 a / 12``. Amplitudes of modes
    that a load excites fall with ``1 / w^2``, and those below the tolerance need not be resolved, so that
    ``h = 2.3 sqrt(rtol) / w1``, w1 the lowest frequency. An explicit step costs 12 evaluations and is at most
    ``6 / top``, an implicit one 2 to 5: equal cost at ``top / w1 = 0.5 / sqrt(rtol)``.
    """
    if run.clock[FIXED] > 0.0:
        explicit = run.clock[FIXED] * top < STABLE
        return Choice(EXPLICIT if explicit else ALPHA, steps, _because("the step against the highest frequency"))
    stiffness = model.linear[0][model.linear[0] > 0.0]
    lowest = np.sqrt(stiffness.min()) if len(stiffness) else top
    limit = EQUAL_COST / np.sqrt(run.clock[RTOL])
    found = f"highest over lowest frequency {top / lowest if lowest else 1.0:.3g}"
    if top <= limit * lowest or steps < FEW_STEPS:
        return Choice(EXPLICIT, steps, _because(f"{found}, or few steps" if steps < FEW_STEPS else found))
    smooth = model.cons is None and not np.any(np.isfinite(model.loads.hinge[:, [LOWER, UPPER]]))
    return Choice(ROSENBROCK if smooth else ALPHA, steps, _because(f"{found}, above {limit:.3g}"))


def _because(why: str) -> str:
    return f", chosen by {why}"
