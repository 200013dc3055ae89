"""The runs of single cases, as workers do them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from modalprep.ensemble.parameters import Parameters
from modalprep.ensemble.record import DONE, FAILED, NOTED, WAITING
from modalprep.errors import ModalprepError
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack_changed
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import failures
from modalprep.multibody.simulate import simulate
from modalprep.verdicts.notes import silent
from modalprep.workers.team import never

ERRORS = "energy_error", "momentum_error"  # of the audits of a run
Block = tuple[int, ...]  # numbers of cases that a worker runs at once


class Stopped(BaseException):
    """A run is left because the ensemble ends; no error of the run."""


class Ended(NamedTuple):
    """How a case went: histories of the channels (nt,) or (nt, k), empty when there are none."""

    case: int
    status: str
    message: str
    seconds: float
    end: float = np.nan
    energy_error: float = np.nan
    momentum_error: float = np.nan
    audit: str = ""
    events: Mapping[str, float] = {}
    channels: Mapping[str, np.ndarray] = {}


class CaseTask:
    """Runs blocks of cases of a system.

    Parameters
    ----------
    parameters : Parameters
        Of the system.
    cases : {name: (n,)}
        Values of the parameters.
    shapes : {channel: tuple}
        Channels that are kept, and the shape of one at one time.
    times : (nt,)
        Output times, s.
    options : dict
        As `simulate` takes them.
    """

    own_process: ClassVar[bool] = False

    def __init__(
        self,
        parameters: Parameters,
        cases: Mapping[str, np.ndarray],
        shapes: Mapping[str, tuple[int, ...]],
        times: np.ndarray,
        options: Mapping[str, Any],
    ) -> None:
        self.parameters = parameters
        self.cases = dict(cases)
        self.shapes = dict(shapes)
        self.times = times
        self.options = dict(options)
        self.values = np.column_stack(list(cases.values()))
        self._mass = sum(body.m for body in parameters.system.bodies.values())

    def run(self, job: Block, stopped: Callable[[], bool] = never) -> list[Ended]:
        """Return the outcomes of a block; a case that fails has a message, and one that is stopped waits."""
        return [self._run(case, stopped) for case in job]

    def lost(self, job: Block, cause: str) -> list[Ended]:
        """Return the outcome of a case whose worker has died; none of a block, whose cases are run again one by one."""
        return [Ended(case, FAILED, cause, 0.0) for case in job] if len(job) == 1 else []

    def tidy(self, job: Block, process: int) -> None:
        """Nothing is left of a case."""

    def system_of(self, case: int) -> System:
        """Return the system of a case."""
        system = self.parameters.change(self.values[case])
        pack_changed(system, self.parameters.system)
        return system

    def _run(self, case: int, stopped: Callable[[], bool]) -> Ended:
        begin = time.perf_counter()

        def look(t: float) -> None:
            if stopped():
                raise Stopped

        try:
            look(0.0)
            with silent():  # the ensemble has its notes
                run = simulate(self.system_of(case), progress=look, **self.options)
            events = {name: float(found[0]) if len(found) else np.nan for name, found in run.events.items()}
            histories = {name: on_grid(run, name, self.times) for name in self.shapes}
        except Stopped:
            return Ended(case, WAITING, "", 0.0)
        except MemoryError:
            return self._failed(case, "not enough memory; use fewer workers", begin)
        except ModalprepError as error:
            return self._failed(case, " ".join(str(error).split()), begin)
        except Exception as error:  # a fault of the program or of a user's function fails this case only
            return self._failed(case, f"{type(error).__name__}: {' '.join(str(error).split())}", begin)
        spent = time.perf_counter() - begin
        energy, momentum = (run.stats.get(name, np.nan) for name in ERRORS)
        audit = "; ".join(failures(run, self.options["rtol"], self._mass)) if run.status == DONE else ""
        message = NOTED.join((run.message, *run.notes))
        return Ended(case, run.status, message, spent, float(run.time[-1]), energy, momentum, audit, events, histories)

    def _failed(self, case: int, message: str, begin: float) -> Ended:
        return Ended(case, FAILED, message, time.perf_counter() - begin)


def on_grid(run: Result, name: str, times: np.ndarray) -> np.ndarray:
    """Return a channel at the output times (nt,) or (nt, k), after the events there; NaN after the end of the run.

    Examples
    --------
    >>> run = Result(time=np.array([0.0, 1.0, 1.0, 1.5]), channels={"a": np.arange(4.0)}, status="done", message="")
    >>> on_grid(run, "a", np.array([0.0, 1.0, 2.0]))
    array([ 0.,  2., nan])
    """
    values = run[name]
    if len(run.time) == len(times) and np.array_equal(run.time, times):
        return values.copy()  # not a view of all channels
    row = np.searchsorted(run.time, times, side="right") - 1
    known = run.time[row] == times
    found = np.full((len(times), *values.shape[1:]), np.nan)
    found[known] = values[row[known]]
    return found
