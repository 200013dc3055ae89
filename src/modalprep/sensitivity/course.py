"""The run along which derivatives are taken: its options, its start and the steps with their maps of changes."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.evaluation.evaluator import Evaluator, start_state
from modalprep.multibody.evaluation.system_state import SystemState
from modalprep.multibody.integration import driver
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.loads import SampledLoad
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack_changed
from modalprep.multibody.preparation import prepare
from modalprep.multibody.results.result import output_times
from modalprep.multibody.simulate import check_span
from modalprep.multibody.starts import Given, started
from modalprep.sensitivity.differences import neighbours
from modalprep.sensitivity.explicit import ExplicitStep
from modalprep.sensitivity.generalised_alpha import AlphaStep
from modalprep.sensitivity.jumps import Jump, JumpMap, Readers
from modalprep.sensitivity.local import Beside, Local, Model, Moment
from modalprep.sensitivity.parameters import ModalStart, Parameter
from modalprep.sensitivity.projection import Projection
from modalprep.sensitivity.rosenbrock import RosenbrockStep
from modalprep.sensitivity.tangent_maps import StepMap
from modalprep.sensitivity.trace import Traced
from modalprep.sensitivity.way_back import WayBack, applies
from modalprep.sensitivity.way_forward import FEW, WayForward
from modalprep.suggest import refuse_other

EXPLICIT = "explicit"  # the method of closed loops where none is given
GIVEN_START = "the start is a given state, which the start values of joints and modes do not change"


@dataclass(frozen=True, kw_only=True)
class Options:
    """How a run is integrated; see `run_sensitivities`."""

    duration: float
    output_step: float = 0.01
    times: Sequence[float] | np.ndarray | None = None
    method: str = "auto"
    step: float | None = None
    rtol: float = 1e-8
    atol: float = 1e-12
    rho_inf: float = 0.9
    max_step: float | None = None
    start: Given = "rest"
    period: float | None = None
    events: Sequence[Event] = ()

    def output_times(self) -> np.ndarray:
        """Return the output times (nt,), from 0 to the duration.

        Raises
        ------
        InputError
            When those that are given do not ascend from 0 or later to the duration.
        """
        if self.times is None:
            return output_times(self.duration, self.output_step)
        times = np.asarray(self.times, dtype=float)
        if times.ndim != 1 or not len(times) or not np.all(np.isfinite(times)) or np.any(np.diff(times) <= 0):
            raise InputError("times must be ascending numbers, s")
        if times[0] < 0 or times[-1] > self.duration * (1 + 1e-12):
            raise InputError(f"times must lie between 0 and the duration, {self.duration:g} s")
        return times


class Course:
    """A run that was integrated, and its steps as maps of changes ``[state | accelerations | those of the method]``.

    Attributes
    ----------
    times : (nt,)
        Outputs, s.
    moments : list of Moment
        Those of the outputs.
    states : (nt, nx + nu)
        At the outputs.
    """

    def __init__(self, system: System, parameters: Sequence[Parameter], options: Options) -> None:
        refuse(system, options)
        self.system, self.parameters, self.options = system, list(parameters), options
        self.times = options.output_times()
        self.state = started(system, options.start, options.period)
        self._refuse_idle_starts()
        self.model = Model(system, self.parameters, options.duration, options.rho_inf)
        if self.model.loops is not None and self.given is not None:
            self.model.restore(self.given)
        self.run = self._integrated()
        self.trace = self.run.trace
        self.ny = self.model.nx + self.model.nu
        self.nz = self.ny + 2 * self.model.nu
        self.outputs = self._find_outputs()
        self._projections: dict[int, Projection] = {}

    @property
    def given(self) -> SystemState | None:
        """The state from which the run was to start; None where the start values of joints say it."""
        return None if isinstance(self.options.start, str) else self.state

    def _refuse_idle_starts(self) -> None:
        for each in self.parameters:
            if each.is_start and self.given is not None and not isinstance(each, ModalStart):
                raise InputError(f"parameter {each.name!r}: {GIVEN_START}")
            if isinstance(each, ModalStart) and (self.options.start != "rest" or self.system.closures):
                raise InputError(
                    f"parameter {each.name!r}: start values of modes are known where a run without closures starts "
                    "at rest"
                )

    def _prepared(self, system: System, state: SystemState | None) -> Traced:
        o = self.options
        return prepare(
            system,
            np.array([0.0, o.duration]),
            start=state,
            kind=Traced,
            method=EXPLICIT if (system.closures and o.method == "auto") or o.events else o.method,
            events=tuple(o.events),
            rtol=o.rtol,
            atol=o.atol,
            step=o.step,
            rho=o.rho_inf,
            longest=o.max_step or np.inf,
            ends=self.times[self.times > 0],
            keeps_momenta=False,
            beside=self.model.loadings_beside,
        )

    def _integrated(self) -> Traced:
        run = self._prepared(self.system, self.state)
        outcome = run.run(lambda times, states: None, None)
        if outcome.status != "done":
            raise SimulationError(f"derivatives of a run that ends early: {outcome.message}")
        return run

    def _find_outputs(self) -> list[int]:
        """Return after how many steps each output comes, ascending."""
        ends = np.array([0.0, *(each.at(1.0).t for each in self.trace)])
        found = [int(np.argmin(np.abs(ends - t))) for t in self.times]
        for k, t in zip(found, self.times, strict=True):
            if abs(ends[k] - t) > 1e-9 * self.options.duration:
                raise SimulationError(f"no step of the run ends at the output time {t:g} s")
        return found

    def outputs_after(self, steps: int) -> range:
        """Return which outputs come after so many steps."""
        return range(bisect_left(self.outputs, steps), bisect_right(self.outputs, steps))

    @property
    def moments(self) -> list[Moment]:
        """The moments of the outputs."""
        return [self.moment(k) for k in self.outputs]

    def moment(self, k: int) -> Moment:
        """Return the moment after k steps."""
        return self.trace[k - 1].at(1.0) if k else self.trace[0].begin

    @property
    def states(self) -> np.ndarray:
        """The states (nt, ny) at the outputs."""
        return np.array([self.trace[k - 1].end if k else self.trace[0].y for k in self.outputs])

    def start_slopes(self) -> np.ndarray:
        """Return the derivatives (ny, np) of the state at the start by the parameters."""
        found = np.zeros((self.ny, len(self.parameters)))
        if self._rests and self.system.closures:
            for along in self.model.beside:
                found[:, along.number] = self._closed_start_slopes(along)
            return found
        for k, each in enumerate(self.parameters):
            if isinstance(each, ModalStart):
                found[each.row, k] = 1.0
            elif self._starts_alike(each):
                continue
            elif self._rests and each.is_linear:
                there = self._start(each.change(self.system, each.value + each.step))
                found[:, k] = (there - self._start(self.system)) / each.step
            else:
                beside = neighbours(self.system, each)
                found[:, k] = beside.derivative([self._start(other) for other in beside.systems])
        return found

    def _closed_start_slopes(self, along: Beside) -> np.ndarray:
        """Return the derivative (ny,) of the start at rest, closed, by one parameter."""
        starts = [each.start for each in along.evaluators]
        if all(np.array_equal(each, starts[0]) for each in starts):
            return np.zeros(self.ny)
        if along.moves_loops:
            return along.derivative(starts)
        others = along.found.systems  # closed by the least motion, which is not linear in masses
        return along.found.derivative([Evaluator(other, until=self.options.duration).start for other in others])

    def _starts_alike(self, parameter: Parameter) -> bool:
        """Whether runs start at the same state for all values of a parameter: given states are closed anew."""
        if self.system.closures:
            return False
        return self.given is not None or (self._rests and parameter.is_linear and not parameter.is_start)

    @property
    def _rests(self) -> bool:
        return self.options.start == "rest"

    def _start(self, system: System) -> np.ndarray:
        """Return the state at which a run of a system starts (ny,)."""
        if self._rests:
            return start_state(pack_changed(system, self.system))
        state = started(system, self.options.start, self.options.period)
        return self._prepared(system, state).steps.y[: self.ny].copy()

    def map(self, k: int) -> StepMap:
        """Return the map of changes of step k."""
        step = self.trace[k]
        if isinstance(step, Jump):
            return JumpMap(self.model, step, self._readers)
        return MAPS[step.method](self.model, step)

    @cached_property
    def way_back(self) -> WayBack | None:
        """The way back through many steps at once; None of a system to which it does not apply."""
        return WayBack(self.model) if applies(self.system) else None

    @cached_property
    def way_forward(self) -> WayForward | None:
        """The way forward through many explicit steps at once; None of a system to which it does not apply."""
        is_small_tree = self.model.loops is None and self.model.nu <= FEW
        return WayForward(self.way_back) if self.way_back and is_small_tree else None

    @cached_property
    def _readers(self) -> Readers:
        return Readers.of(self.model, self.options.events, self.options.duration)

    def projection(self, output: int) -> Projection:
        """Return the projection onto closed loops of the state at an output."""
        if output not in self._projections:
            k = self.outputs[output]
            y = self.trace[k - 1].end if k else self.trace[0].y
            self._projections[output] = Projection(Local(self.model, y, self.moment(k)))
        return self._projections[output]

    def closed(self, output: int, dy: np.ndarray) -> np.ndarray:
        """Return changes (ny, np) of the state at an output, on closed loops."""
        return dy if self.model.loops is None else self.projection(output).forward(dy, np.eye(dy.shape[1]))

    def reverse_closed(self, output: int, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return a gradient (ny,) by the state at an output, by that before it is closed."""
        return bar if self.model.loops is None else self.projection(output).reverse(bar, bar_p)


MAPS = {driver.EXPLICIT: ExplicitStep, driver.ROSENBROCK: RosenbrockStep, driver.ALPHA: AlphaStep}


def refuse(system: System, options: Options) -> None:
    """Refuse what has no derivatives here, in a sentence."""
    refuse_other("derivatives of a run: the system", System, system)
    check_span(options.duration, options.output_step, options.rtol, options.atol, options.method)
    sliding = [c.name for c in system.closures if getattr(c, "friction_coefficient", 0.0)]
    if sliding:
        raise InputError(f"derivatives of a run: closure {sliding[0]!r} has friction, whose derivatives are not known")
    if options.events and options.method not in ("auto", EXPLICIT):
        raise InputError(
            f"derivatives of a run with events by {options.method!r} are not known; give method = 'explicit'"
        )
    for event in options.events:
        _refuse_event(event)
    for load in system.loads:
        if isinstance(load, SampledLoad):
            raise InputError(
                f"derivatives of a run: load {load.name!r} is sampled in time; give a Callback or leave it out"
            )


def _refuse_event(event: Event) -> None:
    if event.terminal or event.activates or event.deactivates:
        does = "ends the run" if event.terminal else "begins or ends closures"
        raise InputError(f"derivatives of a run: event {event.name!r} {does}; those of impacts are known only")
