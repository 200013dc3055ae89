"""Runs that are interrupted: the run so far is kept now and then, and another one goes on from it."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.results.record import audited
from modalprep.multibody.results.result import Result, output_times

SAME = 1e-12  # of the time: output times that are nearer are one
COUNTS = ("steps", "evaluations", "rejected", "halved")
RUNNING = "running"  # status of a run so far


class Every:
    """Calls a function at most every so many seconds of real time."""

    def __init__(self, seconds: float, function: Callable[[], None]) -> None:
        if not seconds > 0:
            raise InputError(f"simulation checkpoint_every = {seconds:g} must be positive")
        self.seconds = seconds
        self.function = function
        self.last = monotonic()

    def call(self) -> None:
        """Call the function when it is time."""
        if monotonic() - self.last >= self.seconds:
            self.function()
            self.last = monotonic()


def times_from(begin: float, t_end: float, output_step: float) -> np.ndarray:
    """Return the begin of a run and the later ones of the output times of the whole run (nt,), s.

    Examples
    --------
    >>> times_from(0.25, 1.0, 0.2).round(9)
    array([0.25, 0.4 , 0.6 , 0.8 , 1.  ])
    """
    if not begin:
        return output_times(t_end, output_step)
    later = output_times(t_end, output_step)
    return np.append(begin, later[later > begin * (1 + SAME)])


def join_runs(first: Result, second: Result) -> Result:
    """Return the run of which the first part ended, or was interrupted, where the second one starts.

    Returns
    -------
    Result
        With the outputs, events and counts of both; notes, message, last state and method are those of the second one.

    Raises
    ------
    InputError
        When the second run does not start where the first one ended, or has other channels.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> from modalprep.multibody.simulate import simulate
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", rate=1.0)
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> first = simulate(arm, t_end=0.1)
    >>> whole = join_runs(first, simulate(arm, t_end=0.2, start=first))
    >>> len(whole.time), whole.status
    (21, 'done')
    """
    if not len(second.time) or second.time[0] < first.time[-1] * (1 - SAME):
        raise InputError("join_runs: the second run does not start where the first one ended")
    if set(first.channels) != set(second.channels):
        raise InputError("join_runs: the runs have different channels; they are of different systems")
    own = slice(1, None)  # without its start
    time = np.append(first.time, second.time[own])
    channels = {name: np.concatenate([first.channels[name], a[own]]) for name, a in second.channels.items()}
    joined = audited(time, channels, second.status, second.message, second.stats | _counts(first, second))
    events = {name: np.append(first.events.get(name, []), found) for name, found in second.events.items()}
    impacts = {name: (*first.impacts.get(name, ()), *found) for name, found in second.impacts.items()}
    return joined.with_(state=second.state, events=events, impacts=impacts, notes=second.notes)


def _counts(first: Result, second: Result) -> dict[str, int]:
    return {name: int(first.stats[name]) + int(second.stats[name]) for name in COUNTS}
