"""The gradient of one number by all parameters: the discrete adjoint of a run, from its end to its begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.starts import Given
from modalprep.records import Record
from modalprep.sensitivity.course import Course, Options
from modalprep.sensitivity.notes import notes_of
from modalprep.sensitivity.objective import Objective
from modalprep.sensitivity.observed import ChannelSlopes
from modalprep.sensitivity.parameters import Parameter, find
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told, with_warnings


@dataclass(frozen=True, eq=False, kw_only=True)
class Gradient(Record):
    """A number that a run makes, and its derivatives by parameters.

    Attributes
    ----------
    value : float
    derivatives : {parameter: float}
        In the unit of the value over that of the parameter.
    at : (np,)
        Values of the parameters.
    stats : dict
        Method and steps of the run; seconds of the run, and of the way back, ``reverse_seconds``.
    notes : tuple of str
        What was found by differences, and where derivatives jump.
    """

    value: float
    derivatives: dict[str, float]
    at: np.ndarray
    stats: dict[str, str | int | float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """The value and the number of parameters."""
        return with_warnings(f"Gradient(value = {self.value:g}, {len(self.derivatives)} parameters)", self.notes)

    @property
    def vector(self) -> np.ndarray:
        """The derivatives (np,) in the order of the parameters."""
        return np.array(list(self.derivatives.values()))


@told
def gradient(
    system: System,
    objective: Objective,
    parameters: Sequence[Parameter | str],
    duration: float,
    *,
    output_step: float = 0.01,
    times: Sequence[float] | np.ndarray | None = None,
    method: str = "auto",
    step: float | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-12,
    rho_inf: float = 0.9,
    max_step: float | None = None,
    start: Given = "rest",
    period: float | None = None,
    events: Sequence[Event] = (),
) -> Gradient:
    """Return a number that a run makes and its gradient, by the steps of the run from the last to the first.

    It is the gradient of the steps that are taken, whose lengths are held: to the digits of the computer of a run of
    fixed steps, else to its tolerance. The way back does not depend on how many parameters there are, but for the
    derivative of the forces by each.

    Parameters
    ----------
    objective : Objective
        Such as `sensitivity.last`, `sensitivity.squares` and `sensitivity.integral` make.
    parameters, duration, output_step, times, method, step, rtol, atol, rho_inf, max_step, start, period, events
        As `run_sensitivities` has them.

    Returns
    -------
    Gradient
        The value and its derivatives.

    Raises
    ------
    InputError
        When a name is unknown, or derivatives of such a system are not known.
    SimulationError
        When the run cannot be integrated.

    References
    ----------
    W. W. Hager, Runge-Kutta methods in optimal control and the transformed adjoint system, Numer. Math. 87 (2000) 247;
    theory 5.9.

    Examples
    --------
    A spring of 100 N/m pulls 1 kg from 1 m: after a quarter of a period it is where the spring has no force, and more
    stiffness takes it further.

    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> from modalprep.sensitivity.objective import last
    >>> block = rigid_body("block", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> slide = Joint(name="slide", type="prismatic", parent="ground", child="block", displacement=1.0,
    ...               elements=HingeElement(stiffness=100.0))
    >>> found = gradient(System(bodies={"block": block}, joints=(slide,)), last("slide.displacement"),
    ...                  ["slide.stiffness"], np.pi / 20)
    >>> found.derivatives["slide.stiffness"] / (-np.pi / 400)  # -t / (2 sqrt(k m))
    1.0
    """
    refuse_other("gradient: the objective", Objective, objective)
    options = Options(
        duration=duration,
        output_step=output_step,
        times=times,
        method=method,
        step=step,
        rtol=rtol,
        atol=atol,
        rho_inf=rho_inf,
        max_step=max_step,
        start=start,
        period=period,
        events=events,
    )
    begin = perf_counter()
    course = Course(system, find(system, parameters), options)
    run = perf_counter()
    slopes = ChannelSlopes(course.model, objective.channels, duration, course.given)
    value, weights = objective.evaluate(course.times, slopes.observer.values(course.moments, course.states))
    found = reverse(course, slopes, weights)
    seconds = {"seconds": run - begin, "reverse_seconds": perf_counter() - run}
    return Gradient(
        value=value,
        derivatives=dict(zip([each.name for each in course.parameters], found.tolist(), strict=True)),
        at=np.array([each.value for each in course.parameters]),
        stats={"method": course.run.method, "steps": len(course.run.steps_taken)} | seconds,
        notes=notes_of(course, slopes),
    )


def reverse(course: Course, slopes: ChannelSlopes, weights: np.ndarray) -> np.ndarray:
    """Return the gradient (np,) of the sum of the channels with weights (nt, nc)."""
    bar_p = np.zeros(len(course.parameters))
    of_states = slopes.reverse(course.moments, course.states, weights, course.projection, bar_p)
    bar = np.zeros(course.nz)
    k = len(course.trace)
    while k:
        begin = course.way_back.begin(course.trace, k) if course.way_back else k
        if begin < k:
            bar = _many(course, begin, k, of_states, bar, bar_p)
        else:
            begin = k - 1
            _take(course, k, of_states, bar, bar_p)
            bar = course.map(begin).reverse(bar, bar_p)
        k = begin
    _take(course, 0, of_states, bar, bar_p)
    return bar_p + course.start_slopes().T @ bar[: course.ny]


def _many(
    course: Course, begin: int, end: int, of_states: np.ndarray, bar: np.ndarray, bar_p: np.ndarray
) -> np.ndarray:
    """Return the gradient before step `begin`, by that after the step before `end`."""
    assert course.way_back is not None
    after = np.zeros((end - begin, course.ny))
    for k in range(begin, end):
        for output in course.outputs_after(k + 1):
            after[k - begin] += of_states[output]
    return course.way_back.reverse(course.trace[begin:end], after, bar, bar_p)


def _take(course: Course, k: int, of_states: np.ndarray, bar: np.ndarray, bar_p: np.ndarray) -> None:
    """Add the gradients by the state after k steps."""
    for output in course.outputs_after(k):
        if not np.any(of_states[output]):
            continue
        bar[: course.ny] += course.reverse_closed(output, of_states[output], bar_p)
