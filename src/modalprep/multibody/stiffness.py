"""Which step method suits a system: its highest frequencies, with and without what an implicit step treats."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.multibody.driver import ALPHA, EXPLICIT, ROSENBROCK
from modalprep.multibody.evaluate import GOOD, Model, evaluate
from modalprep.multibody.layout import MODES, NX, UQ
from modalprep.multibody.loading import Loading
from modalprep.multibody.stepping import FIXED, RTOL, SIZES, Run, move

STABLE = 6.0  # DOP853 stays stable to h omega of about 6 on the imaginary axis
LEAST_AMPLITUDE = 0.01  # of the smallest deflection that counts
FEW_STEPS = 2000  # explicit steps that take less time than it matters
ITERATIONS, SETTLED = 30, 5e-3  # of a power iteration: the frequency to a few per cent, which is all that is asked
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
        before, square = square, float(np.linalg.norm(force) / np.linalg.norm(d))
        if square == 0.0 or not np.isfinite(square):
            return 0.0
        if abs(square - before) < SETTLED * square:
            break
        d = force
    return float(np.sqrt(square))


def _automatic(model: Model, run: Run, top: float, steps: float) -> Choice:
    """Implicit where stability, not accuracy, would hold the explicit step.

    An implicit step h leaves ``(h w)^3 a / 12`` of error in a mode of frequency w and amplitude a; taken for a is the
    static answer to the start's accelerations, at least LEAST_AMPLITUDE of the smallest deflection that counts,
    falling with ``1 / w^2``. An explicit step costs 12 evaluations and is at most ``6 / top``, an implicit one about 4.
    """
    if run.clock[FIXED] > 0.0:
        explicit = run.clock[FIXED] * top < STABLE
        return Choice(EXPLICIT if explicit else ALPHA, steps, ", chosen by the step against the highest frequency")
    explicit, implicit = 12.0 * top / STABLE, 4.0 * _accurate_rate(model, run)
    costs = f"{explicit:.2g} evaluations of the equations a second against {implicit:.2g}"
    if explicit <= implicit or steps < FEW_STEPS:
        return Choice(EXPLICIT, steps, f", chosen for {costs}" if steps >= FEW_STEPS else "")
    return Choice(ALPHA, steps, f", chosen for {implicit:.2g} evaluations a second against {explicit:.2g}")


def _accurate_rate(model: Model, run: Run) -> float:
    """Return the steps a second that an implicit method needs to meet the tolerance in every mode."""
    nx, ydot = model.tree.ints[0, NX], np.zeros(len(run.y))
    if evaluate(model, 0.0, run.y, ydot) != GOOD:
        return 0.0
    rate = 0.0
    for i, row in enumerate(model.tree.ints):
        modes = slice(row[UQ], row[UQ] + row[MODES])
        K = model.linear[0, modes]
        if len(K) and K.min() > 0.0:
            size = run.size[SIZES + 2 * i]
            amplitude = np.maximum(np.abs(ydot[nx:][modes]) / K / size, LEAST_AMPLITUDE * K.min() / K)
            rate = max(rate, float(np.max(np.sqrt(K) * np.cbrt(amplitude / (12.0 * run.clock[RTOL])))))
    return rate
