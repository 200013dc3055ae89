"""A run of the compiled step loop: choice of the method, chunks of steps, samples, events, failures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modalprep.compiler.callbacks import Pointer
from modalprep.compiler.jit import bound
from modalprep.multibody.elements.half_turns import turning
from modalprep.multibody.evaluation.evaluate import GOOD, build_equations
from modalprep.multibody.evaluation.event_functions import Observer, event_functions, state_reader
from modalprep.multibody.evaluation.impact import Impact
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.integration import driver
from modalprep.multibody.integration.branching_start import branching_start
from modalprep.multibody.integration.change_points import ChangePoints
from modalprep.multibody.integration.driver import ALPHA, EXPLICIT, ROSENBROCK, Watch
from modalprep.multibody.integration.endless import Forecast, refuse_endless
from modalprep.multibody.integration.events.actions import Changes
from modalprep.multibody.integration.events.search import EventSearch
from modalprep.multibody.integration.failure import diverged, failure, refuse_fixed_step, refuse_noise, wound
from modalprep.multibody.integration.method_selection import (
    STABLE,
    TRIAL_STEPS,
    Choice,
    choose,
    review,
    top_frequency,
    without,
)
from modalprep.multibody.integration.step_control import go_on, step_control
from modalprep.multibody.integration.stepping import new_run
from modalprep.multibody.integration.watching import CHUNK, new_watch
from modalprep.multibody.kernels.data import Data
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.free_parts import part_of_links
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.step_bounds import StepBounds, ending_at

NAMES = {
    EXPLICIT: "explicit, DOP853",
    ROSENBROCK: "implicit, Rosenbrock-W of order 3",
    ALPHA: "implicit, generalized-alpha",
}
EVALUATIONS_OF_A_STEP = 5  # about
LEAST_DEFLECTION = driver.LEAST_DEFLECTION[EXPLICIT]
DAMPED = 0.8  # of the longest stable step: a shorter one damps the vibrations of round-off
OTHERS = 1e-6  # of the largest derivative: by more, the run before was of other equations
FINEST = 1e-3  # of the size by which deflections are measured of a start without deflection
Record = Callable[[np.ndarray, np.ndarray], None]


@dataclass(frozen=True)
class Outcome:
    """How a run went: status, one sentence, times and impacts of each event, counters, time at the end."""

    status: str
    message: str
    events: dict[str, np.ndarray]
    impacts: dict[str, tuple[Impact, ...]]
    stats: dict[str, str | int | float]
    t: float


class Integration:
    """One run of a system: arrays, hooks to Python, the step loop; `first` has the derivatives of the start.

    Parameters
    ----------
    y : (nx + nu + 1,)
        Coordinates, speeds and work at the start.
    times : (nt,)
        Output times, s, ascending, within the stretches of `loading`.
    method : str
        "auto", "explicit", "generalised_alpha" or "rosenbrock".
    step : float or None
        A fixed step, s; by error control otherwise.
    rho : float
        High-frequency amplification of generalized-alpha, 0 to 1.
    longest : float
        Step, s.
    reference : callable or None
        ``(y, motion, t) -> accelerations`` in place of the kernel's.
    size : (nx,)
        Deflection of a modal coordinate, in sizes of its body.
    observer : Observer or None
        Further channels of the events.
    is_deflected : bool
        Whether it begins with a deflection, beside which vibrations count.
    finer : float
        What generalised-alpha multiplies the relative tolerance by.
    steps : dict of array
        The step control of a run that ended where this one begins: see `step_control`.
    ends : (k,)
        Further times at which a step ends, s, ascending.
    keeps_momenta : bool
        Whether the momenta of parts that nothing holds are restored after each step.
    """

    def __init__(
        self,
        system: System,
        packed: Packed,
        loading: Loading,
        y: np.ndarray,
        times: np.ndarray,
        size: np.ndarray,
        *,
        method: str,
        rtol: float,
        atol: float,
        step: float | None = None,
        rho: float = 0.9,
        longest: float = np.inf,
        events: Sequence[Event] = (),
        reference: Callable | None = None,
        observer: Observer | None = None,
        is_deflected: bool = False,
        finer: float = 1.0,
        steps: Mapping[str, np.ndarray] | None = None,
        ends: np.ndarray | None = None,
        keeps_momenta: bool = True,
    ) -> None:
        self.system = system
        self.packed = packed
        self.loading = loading
        self.events = tuple(events)
        self.observer = observer
        data = packed.data()
        y = self._assembled(y, data)
        start = branching_start(loading, y[:-1]) if loading.loops else None
        self.equations = build_equations(packed, loading, data)
        self.changes = Changes(system, self.events, loading, self.equations)
        output = float((times[1:] - times[:-1]).max()) if len(times) > 1 else np.inf
        bounds = self._step_bounds(rtol)
        if ends is not None:
            bounds = ending_at(bounds, ends)
        settings = rtol, atol, rho, step or 0.0, loading.t_end, output, longest, bounds
        self.steps = new_run(y, self._free_parts(keeps_momenta), len(turning(system)), *settings)
        self._measure_deflections(size, y if is_deflected else None)
        self.pointers = {
            "callback": None if loading.compiled else self._pointer(self._loads),
            "reference": self._pointer(lambda t: self._reference(reference, t)) if reference else None,
        }
        for flag, pointer in self.pointers.items():
            if pointer:
                self.equations.flags[flag] = pointer.address
        self.watch = self._watch(times, size)
        self.change_points = ChangePoints(loading, start, y)
        self.sample(loading.stretches[0][0], self.steps.y[:-1])
        self.watch.branches[0] = loading.loops is not None
        self._clock, self._count = (np.asarray(x) for x in (self.steps.clock, self.steps.counters))  # read more quickly
        self.forecast = Forecast()
        self.looked: tuple[int, float] = (0, 0.0)  # evaluations and time when `refuse_endless` looked
        smooth = is_deflected and not steps
        self.choice = choose(self.equations, self.steps, loading, method, loading.t_end, smooth=smooth)
        if self.choice.method == ALPHA:
            self.steps.clock["rtol"] *= finer
        self._longest = longest
        if is_deflected and self.choice.method == EXPLICIT and not step:
            self._limit_to_stable_steps()
        self._given = steps or {}
        self.uncut: dict[str, np.ndarray] | None = None  # the step control before steps are cut to end with the run
        self.first = np.zeros_like(self.steps.ydot)
        loading.sampling.close()

    def _assembled(self, y: np.ndarray, data: Data) -> np.ndarray:
        """Return the start with its loops closed."""
        loading = self.loading
        if not loading.loops:
            return y
        loading.enter(*loading.stretches[0])
        t = loading.stretches[0][0]
        return np.append(loading.loops.assemble(data, y[:-1], loading.prescribe(t, data), t), y[-1])

    def _free_parts(self, keeps_momenta: bool) -> np.ndarray:
        """Return the part of each link whose momenta are kept; -1: of none, as where masses are not the model's."""
        part = part_of_links(self.system, self.packed)
        return np.full_like(part, -1) if len(self.loading.reels.reels) or not keeps_momenta else part

    def _measure_deflections(self, size: np.ndarray, start: np.ndarray | None) -> None:
        """Say which deflection of each body counts as one: its size, or less beside that of the `start`."""
        sizes = size.tolist()
        scale = self.steps.modal_size
        for i, own, _ in self.packed.flexible:
            reach = max(sizes[own])
            scale[i, 2] = 1.0 / reach if reach > 0 else 0.0
            if start is not None:
                scale[i, 2] = np.clip(np.abs(start[own]).max() / LEAST_DEFLECTION, FINEST * scale[i, 2], scale[i, 2])

    def _limit_to_stable_steps(self) -> None:
        """Let steps be no longer than the explicit method is stable: its errors do not tell while nothing vibrates."""
        top = top_frequency(self.equations, self.steps, self.loading.stretches[0][0])
        self.steps.clock["longest"] = min(self._longest, DAMPED * STABLE / top if top else np.inf)

    @cached_property
    def _start(self) -> Callable[[int, float, float], int]:
        return bound(driver.begin, self.equations, self.steps, rest=(int, float, float))

    @cached_property
    def _advance(self) -> Callable[[int, float, int], int]:
        return bound(driver.advance, self.equations, self.steps, self.watch, rest=(int, float, int))

    def _step_bounds(self, rtol: float) -> StepBounds:
        """Return what functions of time ask of the steps."""
        return self.loading.step_bounds(rtol)

    @property
    def _t(self) -> float:
        return float(self._clock["time"][0])

    def _counted(self, name: str) -> int:
        return int(self._count[name][0])

    def _pointer(self, function: Callable[[float], None]) -> Pointer:
        return Pointer(function, self.equations.shared["raised"])

    def _loads(self, t: float) -> None:
        m = self.equations
        with np.errstate(all="ignore"):  # a trial that is far off is rejected
            m.shared[0].callback_power = self.loading.call(m.data, m.state, t)

    def _reference(self, accelerations: Callable, t: float) -> None:
        with np.errstate(all="ignore"):
            self.equations.reference[:] = accelerations(self.equations.state, self.equations.motion, t)

    def _watch(self, times: np.ndarray, size: np.ndarray) -> Watch:
        watch = new_watch(times, size, len(self.steps.y), self.equations)
        if self.events:
            self.search = self._new_search(watch)
            self.pointers["events"] = pointer = self._pointer(self._search)
            watch.hook[0] = pointer.address
        return watch

    def _new_search(self, watch: Watch) -> EventSearch:
        given = self.system, self.packed, self.loading
        functions = event_functions(*given, self.events, self.observer)
        state_at = state_reader(*given, self.equations, self.events, self.observer)  # which reads what these ask for
        place = bound(driver.place, self.equations, self.steps, watch, rest=(float,))
        omega = self.equations.data.links["omega"]

        def state(t: float) -> State:
            place(t)
            return state_at(t)

        return EventSearch(
            functions,
            state,
            lambda: float(np.sqrt((omega * omega).sum(axis=1).max())),
            lambda e: self.changes.armed(self.events[e]),
            self.loading.t_end,
            self.loading.shortest_event,
        )

    def _search(self, t: float) -> None:
        self.search.step(t)
        self.watch.stop[0] = self.search.stop

    def run(
        self,
        record: Record,
        progress: Callable[[float], None] | None,
        between_steps: Callable[[], None] | None = None,
    ) -> Outcome:
        """Integrate to the last output time; `record` gets output times (k,) and states (k, nx + nu + 1).

        `between_steps` is called when all outputs so far are recorded, and the run can go on from its state.

        Raises
        ------
        SimulationError
            When the integration cannot go on: time, body, cause.
        """
        code = driver.REACHED
        try:
            for begin, end in self.loading.stretches:
                self.loading.enter(begin, end)
                self.sample(begin, self.steps.y[:-1])
                self._begin(begin, end)
                code = self._integrate_to(end, record, progress, between_steps)
                if code != driver.REACHED:
                    break
            self._end_sampling()
            return self._outcome(code, record)
        finally:
            self.loading.sampling.close()

    def sample(self, t: float, y: np.ndarray) -> None:
        """Call the sampled loads that are due at time t (s), at a state y (nx + nu,)."""
        if self.loading.sampling.loads:
            self.loading.sampling.sample(t, self._state(t, y))

    def _end_sampling(self) -> None:
        if self.loading.sampling.loads:
            self.loading.sampling.end(self._t, self._state(self._t, self.steps.y[:-1]))

    def _state(self, t: float, y: np.ndarray) -> State:
        """Return what callbacks see at time t (s) and a state y (nx + nu,)."""
        self.equations.state[:] = y
        return state_reader(self.system, self.packed, self.loading, self.equations, ())(t)

    def _integrate_to(
        self,
        end: float,
        record: Record,
        progress: Callable[[float], None] | None,
        between_steps: Callable[[], None] | None,
    ) -> int:
        """Take steps to the time `end`, or to what ends the run before; returns a code of `driver.advance`."""
        while True:
            t = self._t
            count = self._counted("evaluations")
            halved = self._counted("halved")
            code = self._advance(self.choice.method, end, self._chunk())
            self._drain(record)
            self.raise_callback()
            if code == driver.CUT:
                self.watch.cuts[0] = 0
                self.uncut = self.step_control()
                continue
            if code == driver.NEAR:
                self.watch.branches[0] = self.change_points.look(self.steps)
                continue
            if code == driver.COLLAPSED:
                self._escape(record, end)
                continue
            self.forecast.look(self)
            if progress:
                progress(self._t)
            if code == driver.STOPPED and self._change(record, end):
                continue
            if code not in (driver.RUNNING, driver.FULL):
                return code
            moved = self._t - t
            refuse_fixed_step(self, self._counted("halved") - halved)
            refuse_noise(self, self._counted("evaluations") - count, moved)
            refuse_endless(self)
            if code == driver.RUNNING and between_steps:
                self._sample_all(record)
                between_steps()
            if code == driver.RUNNING and moved > 0.0 and self._counted("evaluations") > self.choice.review:
                self._review((self._counted("evaluations") - count) / moved, record, end)

    def _begin(self, begin: float, end: float) -> None:
        self.uncut = None
        self.watch.cuts[0] = end == self.watch.times[-1] and not self.events
        status = self._start(self.choice.method, begin, end)
        self.raise_callback()
        if status != GOOD or not np.isfinite(self.steps.ydot).all():
            self._count["cause"] = status
            raise failure(self, begin)
        if begin == self.loading.stretches[0][0]:
            self.first = self.steps.ydot.copy()
            if self._given and self._continues(begin, end):
                go_on(self.steps, self._given, self.choice.name, self._longest)
            if self.events:
                self.search.start(begin)

    def _continues(self, begin: float, end: float) -> bool:
        """Whether the steps of the run before are of these equations: the derivative where they end is the same."""
        kept, y = self._given, self.steps.y.copy()
        if kept["y"].shape != y.shape:
            return False
        self.steps.y[:] = kept["y"]
        self._start(self.choice.method, float(kept["time"]), end)
        off = float(np.abs(self.steps.ydot - kept["ydot"]).max(initial=0.0))
        self.steps.y[:] = y
        self._start(self.choice.method, begin, end)
        return off <= OTHERS * float(np.abs(kept["ydot"]).max(initial=0.0))

    def _change(self, record: Record, end: float) -> bool:
        """Go on with other speeds and closures after the events that stopped the run; False where it ends."""
        t = self._t
        here = [self.events[e] for e in self.search.signs]
        if any(event.terminal for event in here):
            return False
        self.changes.refuse_contradiction(self.search.at_once(), t)
        self._sample_all(record)
        record(np.array([t]), self.steps.y[None])
        before = self.search.look(t).values
        for event in here:
            self.changes.apply(event, t, self.steps.y)
            self.raise_callback()
        record(np.array([t]), self.steps.y[None])
        self._begin(t, end)
        self.search.go_on(t, before)
        return True

    def _chunk(self) -> int:
        """Return how many steps to take at once: two times at least up to the next review."""
        left = (self.choice.review - self._counted("evaluations")) / (2 * EVALUATIONS_OF_A_STEP)
        return int(min(CHUNK, max(TRIAL_STEPS, left)))

    def _review(self, spent: float, record: Record, end: float) -> None:
        """Go on with the method that should be quickest; the present one has `spent` so many evaluations a second."""
        choice = review(self.equations, self.steps, self.watch, self.choice, spent, end, self.loading.t_end)
        self.raise_callback()
        self._go_on(choice, record, end)

    def _escape(self, record: Record, end: float) -> None:
        """Go on without an implicit method that does not converge, where the choice is free."""
        choice = without(self.choice, t := self._t)
        if choice.method == self.choice.method:
            raise failure(self, t)
        self._go_on(choice, record, end)

    def _go_on(self, choice: Choice, record: Record, end: float) -> None:
        changes = choice.method != self.choice.method
        self.choice = choice
        if changes:
            self.steps.clock["longest"] = self._longest
            self._sample_all(record)
            self._begin(self._t, end)

    def _sample_all(self, record: Record) -> None:
        full = True
        while full:
            full = not driver.sample(self.equations.model, self.steps, self.watch)
            self._drain(record)

    def _drain(self, record: Record) -> None:
        count, done = self._counted("buffered"), self._counted("sampled")
        if count:
            record(self.watch.times[done - count : done], self.watch.samples[:count])
            self.raise_callback()
        self._count["buffered"] = 0

    def notes(self) -> list[str]:
        """Return what the run may have missed, in sentences."""
        return [*(self.search.notes() if self.events else []), *self.loading.sampling.notes()]

    def raise_callback(self) -> None:
        """Raise what a function of the user raised in compiled code."""
        for pointer in self.pointers.values():
            if pointer and pointer.error:
                raise pointer.error

    def _outcome(self, code: int, record: Record) -> Outcome:
        t = self._t
        if code in (driver.STOPPED, driver.DIVERGED, driver.WOUND):
            self._sample_all(record)
        found = self.search.found if self.events else []
        times = {e.name: np.sort([s for k, s in found if k == i]) for i, e in enumerate(self.events)}
        status = "done"
        message = f"reached t = {t:g} s"
        if code == driver.DIVERGED:
            status = "diverged"
            message = diverged(self)
        if code == driver.WOUND:
            status = "diverged"
            message = wound(self)
        if code == driver.STOPPED:
            names = [e.name for e in self.events if e.terminal and t in times[e.name]]
            message = f"event {names[0]!r} ended the run at t = {t:.6g} s"
            if not np.any(self.watch.times[: self._counted("sampled")] >= t):
                record(np.array([t]), self.steps.y[None])
                self.raise_callback()
        impacts = {name: tuple(found) for name, found in self.changes.impacts.items()}
        return Outcome(
            status, f"{message} ({NAMES[self.choice.method]}{self.choice.why})", times, impacts, self.stats(), t
        )

    def step_control(self) -> dict[str, np.ndarray]:
        """Return that of the run as it is, for another run that goes on from here."""
        return step_control(self.steps, self.choice.name, self._longest)

    def stats(self) -> dict[str, str | int | float]:
        """Return how the run goes, as `Result.stats` has it."""
        counts = {name: self._counted(name) for name in ("steps", "evaluations", "rejected", "halved")}
        ratio = {} if self.choice.ratio is None else {"stiffness_ratio": float(self.choice.ratio)}
        return {"method": self.choice.name} | counts | ratio | self.loading.sampling.stats()
