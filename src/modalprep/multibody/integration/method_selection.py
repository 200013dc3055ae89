"""Which step method suits a run: its highest frequency, and what each method spends on a second of motion."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modalprep.compiler.jit import bound, compile_kernel
from modalprep.multibody.evaluation.evaluate import GOOD, Equations, evaluate
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.driver import ALPHA, EXPLICIT, REACHED, ROSENBROCK, RUNNING, Watch, advance, begin
from modalprep.multibody.integration.stepping import Run
from modalprep.multibody.kernels.joints import move

STABLE = 6.0  # DOP853 stays stable to h omega of about 6 on the imaginary axis
STEP_COST = 12.0  # evaluations of an explicit step
FEW_STEPS = 2000  # explicit steps that take less time than it matters
FEW_SMOOTH = 250  # the same of a run that begins without vibrations: of their evaluations a first look takes 4 %
FIRST_REVIEW = 0.01  # of the evaluations of an explicit run
TRIAL_SHARE = 0.01  # of the evaluations of the rest of a run, for the trial of another method
TRIAL_STEPS = 20  # that are counted, after as many at least that find the step
LEAST_TRIAL, MOST_TRIAL = 150.0, 1e5  # evaluations of a trial
WORTH = 0.8  # of the cost of the method in use: another that takes more does not take its place
ITERATIONS, SETTLED = 30, 5e-3  # of a power iteration: the frequency to a few per cent, which is all that is asked
NUDGE = 1e-7  # of the largest coordinate

METHODS = {"explicit": EXPLICIT, "generalised_alpha": ALPHA, "rosenbrock": ROSENBROCK}
SHORT = {EXPLICIT: "explicit", ROSENBROCK: "Rosenbrock", ALPHA: "generalized-alpha"}


class Choice(NamedTuple):
    """Method, the steps that stability would ask of the explicit one (None: not asked), why (the end of a sentence).

    It is looked at again after `review` evaluations; `explicit` is the least that the explicit method spends on a
    second.
    """

    method: int
    ratio: float | None = None
    why: str = ""
    explicit: float = 0.0
    review: float = np.inf
    t: float = 0.0  # its begin
    spent: int = 0  # evaluations then
    before: str = ""  # the methods before it (the end of a sentence)

    @property
    def name(self) -> str:
        """The method by its name in `METHODS`."""
        return next(name for name, method in METHODS.items() if method == self.method)


def choose(eq: Equations, run: Run, loading: Loading, method: str, t_end: float, *, smooth: bool = False) -> Choice:
    """Return the method asked for, or for "auto" the one to begin with.

    An explicit step is at most ``6 / top`` and costs 12 evaluations, whatever the tolerance; implicit steps follow
    tolerance and motion, and vibrations where these count. So a run that is not stiff is for the explicit method, any
    other begins with an implicit one, and `review` counts. A run of few explicit steps is left to them, as vibrations
    of its start may take an implicit method just as long; of one that is `smooth`, which begins at a state that was
    found, the implicit step is as long as the motion allows, and fewer steps are few.
    """
    loading.enter(*loading.stretches[0])
    start = loading.stretches[0][0]
    if method in METHODS:
        return Choice(METHODS[method])
    top = top_frequency(eq, run, start)
    steps = top * t_end / STABLE
    if run.clock[0].fixed_step > 0.0:
        explicit = run.clock[0].fixed_step * top < STABLE
        why = ", chosen by the step against the highest frequency"
        return Choice(EXPLICIT if explicit else _implicit(eq), steps, why)
    if steps < (FEW_SMOOTH if smooth else FEW_STEPS):
        return Choice(EXPLICIT, steps)
    first = max(FIRST_REVIEW * STEP_COST * steps, LEAST_TRIAL)
    why = f", chosen against {STEP_COST * steps:.2g} evaluations that the explicit method takes at least"
    return Choice(_implicit(eq), steps, why, STEP_COST * top / STABLE, first, start)


def top_frequency(eq: Equations, run: Run, t: float) -> float:
    """Return the highest frequency (rad/s) of small motions about the start at t, by power iteration on differences."""
    scratch = np.empty((5, len(run.y)))
    scratch[:2] = run.y
    scratch[2, : len(eq.tau)] = any_direction(len(eq.tau))
    return float(np.sqrt(bound(_iterated, eq, scratch, rest=(float,))(t)))


@lru_cache(8)
def any_direction(count: int) -> np.ndarray:
    """Return a vector ``(count,)`` that lies across no mode, always the same; not to be written to."""
    return np.random.default_rng(0).standard_normal(count)


@compile_kernel
def _iterated(eq, scratch, t):
    """Return the largest square of a frequency; 0 where the equations fail.

    `scratch` (5, ny) begins with the state, twice, and a direction of its nu speeds.
    """
    nx, square = eq.model.nx, 0.0
    y = scratch[0]
    near = scratch[1]
    d = scratch[2, : len(eq.tau)]
    base = scratch[3]
    moved = scratch[4]
    if len(d) == 0 or evaluate(eq, t, y, base) != GOOD:
        return 0.0
    for _ in range(ITERATIONS):
        largest, length, force = 0.0, 0.0, 0.0
        for u in range(len(d)):
            largest = max(largest, abs(d[u]))
        for u in range(len(d)):
            d[u] *= NUDGE / largest
            length += d[u] * d[u]
        move(eq.model, y, d, near)
        if evaluate(eq, t, near, moved) != GOOD:
            return 0.0
        for u in range(len(d)):
            d[u] = base[nx + u] - moved[nx + u]
            force += d[u] * d[u]
        before = square
        square = np.sqrt(force / length)
        if not 0.0 < square < np.inf:
            return 0.0
        if abs(square - before) < SETTLED * square:
            break
    return square


def review(eq: Equations, run: Run, watch: Watch, choice: Choice, spent: float, stop: float, t_end: float) -> Choice:
    """Return the method that should spend the fewest evaluations on the rest of the run.

    The one in use has just `spent` so many on a second; of the explicit method the least is known, an implicit one is
    tried where the rest of the run is long enough to pay for it. The next review comes when as many evaluations again
    are counted: vibrations of the start decay, others come.
    """
    t = float(run.clock[0].time)
    count = int(run.counters[0].evaluations)
    cost = {choice.method: _expected(t - choice.t, count - choice.spent, spent, t_end - t)}
    if choice.method != EXPLICIT:
        cost[EXPLICIT] = choice.explicit
    elif (budget := min(MOST_TRIAL, TRIAL_SHARE * cost[EXPLICIT] * (t_end - t))) > LEAST_TRIAL:
        cost[_implicit(eq)] = _trial(eq, run, watch, _implicit(eq), (t, stop), budget)
    best = min(cost, key=cost.__getitem__)
    if cost[best] > WORTH * cost[choice.method]:
        best = choice.method
    others = "".join(f", against {cost[method]:.2g} {SHORT[method]}" for method in cost if method != best)
    why = f", chosen for {cost[best]:.2g} evaluations of the equations a second{others}"
    if best != choice.method:
        before = f"{choice.before}; {SHORT[choice.method]} before t = {t:.3g} s"
        choice = choice._replace(t=t, spent=int(run.counters[0].evaluations), before=before)
    return choice._replace(method=best, why=why + choice.before, review=2.0 * count)


def _expected(age: float, count: int, spent: float, left: float) -> float:
    """Return the mean cost of a second of what is left, by the power law through the count at an age and its slope.

    Vibrations of the start decay: after a hundredth of a run what has just been `spent` says little of its end.
    """
    power = min(1.0, spent * age / count)
    if left <= 0.0:
        return spent
    return max(spent, count / age) if power == 1.0 else count * ((1 + left / age) ** power - 1) / left


def _implicit(eq: Equations) -> int:
    """Return the implicit method that suits a system.

    The Rosenbrock method is the more accurate one at the same tolerance, for stiff modes that are loaded suddenly by
    far; but springs and bushings that may turn take its order.
    """
    return ALPHA if eq.implicit is not eq.cons else ROSENBROCK


def without(choice: Choice, t: float) -> Choice:
    """Return the explicit method for a choice that was free, after an implicit one could not go on at t."""
    if choice.review == np.inf:
        return choice
    why = f", as {SHORT[choice.method]} could not go on at t = {t:.3g} s"
    return choice._replace(method=EXPLICIT, why=why, review=np.inf)


def _trial(eq: Equations, run: Run, watch: Watch, method: int, stretch: tuple[float, float], budget: float) -> float:
    """Return the evaluations a second of motion at the end of a trial of `budget` of them, or of the whole stretch."""
    first, stop = stretch
    trial = Run(*(part.copy() for part in run))
    trial.counters[0].evaluations = 0
    none = np.zeros(1, np.int64)
    unwatched = watch._replace(times=np.zeros(0), hook=none, branches=none, cuts=none)
    if begin(eq, trial, method, first, stop) != GOOD:
        return np.inf
    code, trials, cost = RUNNING, 0, np.inf
    while code == RUNNING and (trials < 2 or trial.counters[0].evaluations < budget):
        t, before = trial.clock[0].time, trial.counters[0].evaluations
        code = advance(eq, trial, unwatched, method, stop, TRIAL_STEPS)
        moved = trial.clock[0].time - t
        trials = trials + 1
        cost = (trial.counters[0].evaluations - before) / moved if moved > 0.0 else np.inf
    run.counters[0].evaluations += trial.counters[0].evaluations
    if code == REACHED:
        return trial.counters[0].evaluations / (stop - first)
    return cost if code == RUNNING else np.inf
