"""Simulate many cases of one system, in threads, processes or on a cluster."""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from modalprep import __version__
from modalprep.ensemble.cases import read_cases
from modalprep.ensemble.collect import Collected
from modalprep.ensemble.file import Keeper
from modalprep.ensemble.identity import fingerprint
from modalprep.ensemble.pace import LOG, Pace
from modalprep.ensemble.parameters import Parameters
from modalprep.ensemble.record import Ensemble
from modalprep.ensemble.task import CaseTask
from modalprep.errors import InputError
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import channel_names
from modalprep.multibody.results.result import Result, output_times
from modalprep.multibody.simulate import check_span, check_steps
from modalprep.multibody.starts import Given, started
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import told
from modalprep.workers.cluster import Cluster
from modalprep.workers.processes import Processes
from modalprep.workers.scheduler import Scheduler
from modalprep.workers.shares import exported_threads, processors
from modalprep.workers.team import Team
from modalprep.workers.threads import Threads

BLOCK = 0.1  # s, about, of the cases that a worker runs at once
TICK = 0.5  # s, longest wait for a case before an interrupt is looked at
POOLS = {"threads": Threads, "processes": Processes}


@told
def simulate_many(
    system: System,
    cases: Mapping[str, Any] | Sequence[Mapping[str, float]],
    t_end: float,
    *,
    channels: Sequence[str] = (),
    output_step: float = 0.01,
    rtol: float = 1e-5,
    atol: float = 1e-10,
    method: str = "auto",
    max_step: float | None = None,
    shortest_event: float | None = None,
    events: Sequence[Event] = (),
    start: Given = "rest",
    period: float | None = None,
    workers: int | None = None,
    pool: str = "threads",
    scheduler: str | None = None,
    file: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> Ensemble:
    """Simulate a system for many cases, each as `simulate` does; a case that fails does not stop the others.

    Parameters
    ----------
    system : System
    cases : {parameter: (n,)} or sequence of {parameter: number}
        Values of start values, parameters of joints, loads and closures, and gravity, by names such as
        ``hinge.angle``, ``stay.stiffness``, ``thrust.amplitude`` and ``gravity.y``; `draw_cases` draws them from
        distributions.
    t_end, output_step, rtol, atol, method, max_step, shortest_event, events, start, period
        As `simulate` has them. Each case has an equilibrium, a steady or periodic state of its own; a state that is
        given is that of all cases.
    channels : sequence of str
        Channels that are kept, all when none is named; ``arm.tip.position.x`` is one component.
    workers : int or None
        Number of threads or processes; None for one for each processor.
    pool : {"threads", "processes"}
        Threads run the compiled solver at the same time; processes also run Python callbacks and the set-up of small
        systems at the same time, but each takes seconds to start, and a script that uses them needs
        ``if __name__ == "__main__":``.
    scheduler : str or None
        Address of a Dask scheduler to use instead, or the file that it has written (``.json``). Its workers need the
        same program.
    file : str, Path or None
        HDF5 file in which finished cases are kept, every ten seconds and in the end. A repeated call runs only the
        cases that it lacks or that failed.
    progress : callable
        Called with the number of finished cases.

    Returns
    -------
    Ensemble
        Histories for every case; `Ensemble.status` tells which diverged or failed, and `Ensemble.message` why.

    Raises
    ------
    InputError
        When a parameter or channel is unknown, the arrays of cases differ in length, an option cannot be used, or the
        file holds another ensemble.
    ClusterError
        When the scheduler has gone, or none of its workers has the same program; the file keeps what had ended.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=(0, -9.81, 0))
    >>> found = simulate_many(arm, {"hinge.angle": [0.0, 0.1, 0.2]}, t_end=0.1, channels=["hinge.angle"])
    >>> found["hinge.angle"][:, 0], found.status
    (array([0. , 0.1, 0.2]), ('done', 'done', 'done'))
    """
    options = {
        "t_end": t_end,
        "output_step": output_step,
        "rtol": rtol,
        "atol": atol,
        "method": method,
        "max_step": max_step,
        "shortest_event": shortest_event,
        "events": tuple(events),
        "start": start if isinstance(start, str) else started(system, start, period),
        "period": period if isinstance(start, str) else None,
    }
    task = plan(system, cases, channels, options)
    keeper = Keeper(None if file is None else Path(file), identity(task))
    collected = Collected(task)
    collected.adopt(keeper.read())
    return run_cases(task, collected, keeper, workers=workers, pool=pool, scheduler=scheduler, progress=progress)


def plan(system: System, cases: Any, channels: Sequence[str], options: Mapping[str, Any]) -> CaseTask:
    """Return the task of an ensemble, its parameters, channels and times looked at.

    Raises
    ------
    InputError
        When one of them cannot be used.
    """
    refuse_other("simulate_many: the system", System, system)
    check_span(*(options[name] for name in ("t_end", "output_step", "rtol", "atol", "method")))
    check_steps(options["t_end"], options["max_step"], options["shortest_event"])
    values = read_cases(cases)
    begin = getattr(options.get("start"), "t", 0.0)
    times = begin + output_times(options["t_end"] - begin, options["output_step"])
    first = Parameters(system, list(values))
    known = _known_channels(first, [column[0] for column in values.values()], times[-1])
    named = tuple(channels) or tuple(known)
    shapes = {name: known[name].shape[1:] for name in named}
    return CaseTask(first, values, shapes, times, options)


def _known_channels(parameters: Parameters, values: Sequence[float], t_end: float) -> Result:
    """Return the channels of the first case, of the system itself where this case is none."""
    try:
        return channel_names(parameters.change(values), t_end)
    except InputError:
        return channel_names(parameters.system, t_end)


def identity(task: CaseTask) -> dict[str, str]:
    """Return the fingerprints that tell the results of an ensemble from those of others."""
    return {
        "system": fingerprint(task.parameters.system),
        "cases": fingerprint(task.cases),
        "run": fingerprint(task.options, list(task.shapes), __version__),
    }


def run_cases(
    task: CaseTask,
    collected: Collected,
    keeper: Keeper,
    *,
    workers: int | None = None,
    pool: str = "threads",
    scheduler: str | None = None,
    progress: Callable[[int], None] | None = None,
) -> Ensemble:
    """Run the cases that are waiting, and return all; also an interrupted call leaves the finished ones in the file.

    Raises
    ------
    InputError
        When the workers cannot be used.
    """
    if collected.waiting:
        team = _team(task, _share() if workers is None else workers, pool, scheduler)
        try:
            _dispatch(task, collected, keeper, team, progress)
        finally:
            team.close()
            keeper.write(collected.record())
    return collected.record()


def _share() -> int:
    """Return the number of threads that this process may use; a batch gives its jobs a share of the processors."""
    return int(min(processors(), exported_threads("NUMBA_NUM_THREADS")))


def _team(task: CaseTask, workers: int, pool: str, scheduler: str | None) -> Team:
    if not isinstance(workers, int) or workers < 1:
        raise InputError(f"simulate_many: workers = {workers} must be a positive whole number")
    refuse_unknown(pool, POOLS, "simulate_many: pool")
    if pool == "processes" or scheduler:
        try:
            pickle.dumps(task)
        except Exception as error:
            raise InputError(
                f"simulate_many: the system cannot be sent to other processes ({error}); use the pool of threads"
            ) from None
    return Cluster(Scheduler(scheduler), task) if scheduler else POOLS[pool](workers, task)


def _dispatch(
    task: CaseTask, collected: Collected, keeper: Keeper, team: Team, progress: Callable[[int], None] | None
) -> None:
    """Give blocks of cases to the workers until all have ended."""
    waiting = deque(collected.waiting)
    alone = []
    running = 0
    seconds = 0.0
    count = 0
    pace = Pace(collected.finished, len(task.values))
    while waiting or alone or running:
        while (waiting or alone) and team.free > 0 and running < 2 * team.size:
            size = _block(len(waiting), team.size, seconds / count if count else 0.0)
            team.submit((alone.pop(),) if alone else tuple(waiting.popleft() for _ in range(size)))
            running += 1
        for job, block in team.collect(TICK):
            running -= 1
            alone += [] if block else job  # their worker has died: one by one, only the cause fails
            for ended in block:
                collected.take(ended)
                seconds, count = seconds + ended.seconds, count + 1
            if progress:
                progress(collected.finished)
        pace.look(collected.finished)
        for line in team.news():
            LOG.warning("%s", line)
        if keeper.due:
            keeper.write(collected.record())


def _block(waiting: int, workers: int, seconds: float) -> int:
    """Return how many cases of so many seconds each a worker gets at once; one as long as that is not known.

    Examples
    --------
    >>> _block(1000, 2, 0.002), _block(1000, 2, 3.0), _block(10, 2, 0.002), _block(1000, 2, 0.0)
    (50, 1, 3, 1)
    """
    share = -(-waiting // (2 * workers))
    return max(1, min(share, int(BLOCK / seconds))) if seconds > 0 else 1
