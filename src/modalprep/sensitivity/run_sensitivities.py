"""Forward sensitivities: how channels of a run change with parameters, at all output times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.starts import Given
from modalprep.records import Record
from modalprep.sensitivity.course import Course, Options
from modalprep.sensitivity.notes import notes_of
from modalprep.sensitivity.observed import ChannelSlopes
from modalprep.sensitivity.parameters import Parameter, find
from modalprep.verdicts.notes import told, with_warnings


@dataclass(frozen=True, eq=False, kw_only=True)
class RunSensitivities(Record):
    """Channels of a run and their derivatives by parameters.

    Attributes
    ----------
    time : (nt,)
        s.
    channels : tuple of str
    parameters : tuple of str
    at : (np,)
        Values of the parameters.
    values : (nt, nc)
        The channels.
    derivatives : (np, nt, nc)
        Of each channel by each parameter, in the unit of the channel over that of the parameter.
    stats : dict
        Method and steps of the run.
    notes : tuple of str
        What was found by differences, and where derivatives jump.
    """

    time: np.ndarray
    channels: tuple[str, ...]
    parameters: tuple[str, ...]
    at: np.ndarray
    values: np.ndarray
    derivatives: np.ndarray
    stats: dict[str, str | int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Numbers of channels, parameters and times."""
        text = f"{len(self.channels)} channels by {len(self.parameters)} parameters at {len(self.time)} times"
        return with_warnings(f"RunSensitivities({text})", self.notes)

    def of(self, channel: str, parameter: str) -> np.ndarray:
        """Return the derivative of one channel by one parameter.

        Returns
        -------
        (nt,) float

        Raises
        ------
        InputError
            When a name is unknown.
        """
        from modalprep.suggest import refuse_unknown

        refuse_unknown(channel, self.channels, "run_sensitivities: channel")
        refuse_unknown(parameter, self.parameters, "run_sensitivities: parameter")
        return self.derivatives[self.parameters.index(parameter), :, self.channels.index(channel)]


@told
def run_sensitivities(
    system: System,
    channels: Sequence[str],
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
) -> RunSensitivities:
    """Return channels of a run and their derivatives by parameters, which go along with the run.

    They are those of the steps that are taken, whose lengths are held: to the digits of the computer of a run of fixed
    steps, else to its tolerance. Steps end at the output times. One parameter more costs little beside the first; the
    derivatives of one number by many parameters are cheaper by `gradient`.

    Parameters
    ----------
    channels : sequence of str
        Single numbers among the channels of a `Result`: ``hinge.angle``, ``arm.tip.position.x``, ``arm.modal.2``.
    parameters : sequence of str or Parameter
        The names that `simulate_many` takes, such as ``hinge.stiffness``, ``hinge.angle`` (start value),
        ``stay.damping``, ``thrust.amplitude``, ``root.position.x`` and ``gravity.y``, those of bodies,
        ``arm.mode_stiffness.2``, ``arm.mode_damping.2``, the start values ``arm.modal.2`` and ``arm.modal_rate.2``, and
        ``disc.mass`` of a rigid body; a `Parameter` is any other number.
    duration, output_step : float
        s.
    times : (nt,) or None
        Output times instead of equal steps, s.
    method, step, rtol, atol, rho_inf, max_step, start, period, events
        As `simulate` has them; events may be impacts.

    Returns
    -------
    RunSensitivities
        Histories of the channels, and of their derivatives.

    Raises
    ------
    InputError
        When a name is unknown, or derivatives of such a system are not known.
    SimulationError
        When the run cannot be integrated.

    References
    ----------
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993, II.6
    (dependence on parameters); theory 5.9.

    Examples
    --------
    The period of a pendulum of 1 m grows with its angle and falls with gravity.

    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> bob = rigid_body("bob", mass=1.0, centre=np.array([1.0, 0, 0]), inertia=np.eye(3) * 1e-9,
    ...                  interfaces={"root": np.zeros(3)})
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="bob", angle=-1.4)
    >>> pendulum = System(bodies={"bob": bob}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    >>> found = run_sensitivities(pendulum, ["hinge.angle"], ["hinge.angle", "gravity.y"], 0.1)
    >>> found.of("hinge.angle", "hinge.angle")[[0, -1]].round(3)
    array([1.   , 0.952])
    """
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
    course = Course(system, find(system, parameters), options)
    slopes = ChannelSlopes(course.model, channels, duration, course.given)
    moments, states = course.moments, course.states
    values = slopes.observer.values(moments, states)
    derivatives = slopes.forward(moments, states, state_changes(course))
    return RunSensitivities(
        time=course.times,
        channels=tuple(channels),
        parameters=tuple(each.name for each in course.parameters),
        at=np.array([each.value for each in course.parameters]),
        values=values,
        derivatives=derivatives,
        stats={"method": course.run.method, "steps": len(course.run.steps_taken)},
        notes=notes_of(course, slopes),
    )


def state_changes(course: Course) -> np.ndarray:
    """Return the derivatives (nt, ny, np) of the states at the outputs by the parameters."""
    dz = np.zeros((course.nz, len(course.parameters)))
    dz[: course.ny] = course.start_slopes()
    found = np.zeros((len(course.times), course.ny, dz.shape[1]))
    _put(course, 0, dz, found)
    for k, after in enumerate(_changes(course, dz), start=1):
        _put(course, k, after, found)
    return found


def _changes(course: Course, dz: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the changes after each step."""
    k = 0
    while k < len(course.trace):
        many = course.way_forward.count(course.trace, k) if course.way_forward else 0
        maps = course.way_forward.maps(course.trace[k : k + many]) if course.way_forward and many else [course.map(k)]
        for each in maps:
            dz = each.forward(dz, np.eye(dz.shape[1]))
            yield dz
        k += len(maps)


def _put(course: Course, k: int, dz: np.ndarray, found: np.ndarray) -> None:
    for output in course.outputs_after(k):
        found[output] = course.closed(output, dz[: course.ny])
