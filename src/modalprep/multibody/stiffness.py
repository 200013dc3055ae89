"""Which step method suits a run: its highest frequency, and what each method spends on the first steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.multibody.driver import ALPHA, EXPLICIT, REACHED, ROSENBROCK, RUNNING, Watch, advance, begin
from modalprep.multibody.evaluate import GOOD, Model, evaluate
from modalprep.multibody.loading import Loading
from modalprep.multibody.stepping import EVALUATIONS, FIXED, Run, T, move

STABLE = 6.0  # DOP853 stays stable to h omega of about 6 on the imaginary axis
STEP_COST = 12.0  # evaluations of an explicit step
FEW_STEPS = 2000  # explicit steps that take less time than it matters
TRIAL_STEPS = 20  # that are counted, after as many at least that find the step
TRIAL_SHARE = (
    0.005  # of the evaluations of an explicit run, for the trial of each method: vibrations of the start decay
)
PATIENCE = 2.0  # times the explicit method's cost: an implicit run beyond it is changed
ITERATIONS, SETTLED = 30, 5e-3  # of a power iteration: the frequency to a few per cent, which is all that is asked
NUDGE = 1e-7  # of the largest coordinate


SHORT = {EXPLICIT: "explicit", ROSENBROCK: "Rosenbrock", ALPHA: "generalized-alpha"}


class Choice(NamedTuple):
    """Method, the steps that stability would ask of the explicit one, why, and the cost that is too much for it.

    `why` is the end of a sentence; more evaluations than ``spare + limit t`` up to time t are too many.
    """

    method: int
    ratio: float
    why: str
    limit: float = np.inf
    spare: float = 0.0


def choose(model: Model, run: Run, watch: Watch, loading: Loading, method: str, t_end: float) -> Choice:
    """Return the method asked for, or for "auto" the one that should be quickest."""
    loading.enter(*loading.stretches[0])
    top = top_frequency(model, run, loading.stretches[0][0])
    steps = top * t_end / STABLE
    named = {"explicit": EXPLICIT, "generalized_alpha": ALPHA, "rosenbrock": ROSENBROCK}
    if method in named:
        return Choice(named[method], steps, "")
    if run.clock[FIXED] > 0.0:
        explicit = run.clock[FIXED] * top < STABLE
        return Choice(EXPLICIT if explicit else ALPHA, steps, ", chosen by the step against the highest frequency")
    if steps < FEW_STEPS:
        return Choice(EXPLICIT, steps, "")
    return _quickest(model, run, watch, loading.stretches[0], steps, STEP_COST * top / STABLE)


def top_frequency(model: Model, run: Run, t: float) -> float:
    """Return the highest frequency (rad/s) of small motions about the start at t, by power iteration on differences."""
    nx, nu = len(model.state) - len(model.tau), len(model.tau)
    y, base, moved = run.y.copy(), np.zeros(nx + nu + 1), np.zeros(nx + nu + 1)
    if nu == 0 or evaluate(model, t, y, base) != GOOD:
        return 0.0
    near, d, square = y.copy(), np.random.default_rng(0).standard_normal(nu), 0.0
    for _ in range(ITERATIONS):
        d *= NUDGE / np.abs(d).max()
        move(model.tree, model.place, y, d, near)
        if evaluate(model, t, near, moved) != GOOD:
            return 0.0
        force = base[nx:-1] - moved[nx:-1]
        before, square = square, float(np.linalg.norm(force) / np.linalg.norm(d))
        if square == 0.0 or not np.isfinite(square):
            return 0.0
        if abs(square - before) < SETTLED * square:
            break
        d = force
    return float(np.sqrt(square))


def _quickest(model: Model, run: Run, watch: Watch, stretch: tuple, steps: float, explicit: float) -> Choice:
    """Choose the method that spends the fewest evaluations on a second of motion at the tolerance of the run.

    An explicit step is at most ``6 / top`` and costs 12 evaluations, whatever the tolerance; implicit steps follow
    tolerance and motion, and vibrations where these count. So stiff systems and loose tolerances are for implicit
    methods, of order 2 or 3, tight tolerances for the explicit one of order 8; what wins is counted. The Rosenbrock
    method is left out where springs or bushings may turn, which takes its order. What the explicit method spends a
    second at least, `explicit`, is known; a trial ends where it has spent what the best method so far asks for the
    whole run.
    """
    budget, bonds, cost = TRIAL_SHARE * STEP_COST * steps, model.bonds is not model.cons, {EXPLICIT: explicit}
    for method in (ALPHA,) if bonds else (ROSENBROCK, ALPHA):
        most = min(cost.values()) * (stretch[1] - stretch[0])
        cost[method] = _cost(model, run, watch, method, stretch, budget, most)
    best = min(cost, key=cost.__getitem__)
    others = " and ".join(f"{cost[method]:.2g} {SHORT[method]}" for method in cost if method != best)
    why = f", chosen for {cost[best]:.2g} evaluations of the equations a second on trial, against {others}"
    return Choice(best, steps, why, np.inf if best == EXPLICIT else PATIENCE * explicit, budget)


def _cost(model: Model, run: Run, watch: Watch, method: int, stretch: tuple, budget: float, most: float) -> float:
    """Return the evaluations a second of motion at the end of a trial of `budget` of them, or of the whole run.

    After `most` evaluations the trial ends too.
    """
    first, stop = stretch
    trial = Run(*(part.copy() for part in run))
    unwatched = watch._replace(times=np.zeros(0), hook=np.zeros(1, dtype=np.int64))
    if begin(model, trial, method, first, stop) != GOOD:
        return np.inf
    code, trials, cost = RUNNING, 0, np.inf
    while code == RUNNING and (trials < 2 or trial.count[EVALUATIONS] < budget) and trial.count[EVALUATIONS] < most:
        t, spent = trial.clock[T], trial.count[EVALUATIONS]
        code = advance(model, trial, unwatched, method, stop, TRIAL_STEPS)
        moved, trials = trial.clock[T] - t, trials + 1
        cost = (trial.count[EVALUATIONS] - spent) / moved if moved > 0.0 else np.inf
    if code == REACHED:
        return trial.count[EVALUATIONS] / (stop - first)
    return cost if code == RUNNING else np.inf
