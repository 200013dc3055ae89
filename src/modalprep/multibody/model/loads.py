"""Loads of a system: forces, springs, bushings, central gravity, water, callbacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.model.depletion import ExpelledGas
from modalprep.multibody.model.environment import CentralGravity, Conductor
from modalprep.multibody.model.hydrodynamics import ImmersedRod, check_rod
from modalprep.multibody.model.time_function import TimeFunction, TimeFunctionLike
from modalprep.records import Record, given, optional, pair
from modalprep.suggest import find_interface, refuse_name, refuse_unknown
from modalprep.vectors import as_rotation, matrix, vector

# public names of `modalprep.multibody`
__all__ = ["AxialSpring", "Bushing", "Callback", "DistributedForce", "SampledLoad"]

GROUND = "ground"
ROUNDING = 1e-9  # of a sum of fractions
ZERO = (0.0, 0.0, 0.0)
Axes = Literal["inertial", "body"]


def _components(values: Sequence[TimeFunctionLike], what: str = "") -> tuple[TimeFunction, ...]:
    return tuple(map(TimeFunction.of, values))


ON_GROUND = "it is that of an end on the ground, so leave it out"


@dataclass(frozen=True, eq=False, kw_only=True)
class PointForce(Record):
    """A force (N) and a torque (N m) on an interface, each of three functions of time.

    Attributes
    ----------
    name : str
    at : str
        ``body.interface``.
    force, torque : (3,) of TimeFunction or what makes one
    axes : {"inertial", "body"}
        Body axes rotate with the interface, elastic rotation included.

    Examples
    --------
    >>> PointForce(name="thrust", at="bus.nozzle", force=("10*t", 0, 0), axes="body").force[0](2.0)[0]
    20.0
    """

    name: str
    at: str
    force: tuple[TimeFunction, ...] = given(converter=_components, default=ZERO)
    torque: tuple[TimeFunction, ...] = given(converter=_components, default=ZERO)
    axes: Axes = "inertial"

    def __post_init__(self) -> None:
        """Count the components."""
        for name in ("force", "torque"):
            if len(values := getattr(self, name)) != 3:
                raise InputError(f"force {self.name!r}: {name} has {len(values)} components; give three")
        _check_axes(self.name, self.axes)
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class DistributedForce(Record):
    """Forces on all mesh points of a body, times one function of time; modal forces follow from the nodal shapes.

    Attributes
    ----------
    name, body : str
    force : (n_points, 3)
        N, at the `points` of the modal body; they move with the points, to first order in the modes.
    factor : TimeFunction or what makes one
    axes : {"inertial", "body"}
        Body axes are those of the body frame B.

    Examples
    --------
    >>> DistributedForce(name="gust", body="wing", force=np.ones((4, 3)), factor="sin(t)").force.shape
    (4, 3)
    """

    name: str
    body: str
    force: np.ndarray = given(converter=matrix)
    factor: TimeFunction = given(converter=TimeFunction.of, default_factory=lambda: TimeFunction(1.0))
    axes: Axes = "body"

    def __post_init__(self) -> None:
        """Check the axes."""
        _check_axes(self.name, self.axes)
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class TwoEnded(Record):
    """What acts between two interfaces, or an interface and the ground.

    Attributes
    ----------
    name : str
    between : (str, str)
        ``body.interface`` twice, or one and ``ground``.
    noun : str
        What messages call it.
    """

    applies: ClassVar[tuple[Rule, ...]] = ()
    name: str
    between: tuple[str, str] = given(converter=pair)
    noun: ClassVar[str] = "element"

    def __post_init__(self) -> None:
        """Refuse one end twice."""
        if len(self.between) != 2 or self.between[0] == self.between[1]:
            raise InputError(f"{self.noun} {self.name!r}: joins {' and '.join(self.between)}; name two different ends")
        refuse_idle(self, f"{self.noun} {self.name!r}: ")
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class AxialSpring(TwoEnded):
    """A spring and damper along the line between two interfaces, or an interface and a point of the ground.

    Attributes
    ----------
    name : str
    between : (str, str)
        ``body.interface`` twice, or one and ``ground``.
    stiffness, damping : float
        N/m, N s/m.
    free_length : float
        m, at which the spring carries no force.
    position : (3,)
        m, inertial: the end on the ground.
    actuator_force : TimeFunction or what makes one
        N, of an actuator that draws the ends together.
    tension_only : bool
        It goes slack below its free length, and its damper never pushes: a tether or a strap.

    Examples
    --------
    >>> AxialSpring(name="stay", between=("ground", "mast.top"), stiffness=1e4, free_length=2.0).damping
    0.0
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("position",), needs=("between",), among=(GROUND,), advice=ON_GROUND),
        Rule(("free_length",), needs=("stiffness", "tension_only")),
        Rule(("tension_only",), needs=("stiffness", "damping")),
        Rule(("tension_only",), needs=("free_length", "damping"), advice="it is never slack; give one of them"),
    )
    stiffness: float = 0.0
    damping: float = 0.0
    free_length: float = 0.0
    position: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    actuator_force: TimeFunction | None = given(converter=optional(TimeFunction.of), default=None)
    tension_only: bool = False
    noun: ClassVar[str] = "spring"

    def __post_init__(self) -> None:
        """Check the constants."""
        for name in ("stiffness", "damping", "free_length"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"spring {self.name!r}: {name} = {getattr(self, name):g} must not be negative")
        if self.tension_only and self.actuator_force is not None:
            raise InputError(f"spring {self.name!r}: tension_only and actuator_force exclude each other; leave one out")
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class Bushing(TwoEnded):
    """Six springs and dampers between two frames, in the axes of the first.

    A run ends where the frames turn by half a turn against each other: the torques would jump there.

    Attributes
    ----------
    name : str
    between : (str, str)
        ``body.interface`` twice, or one and ``ground``.
    stiffness, damping : (6,)
        x, y, z (N/m, N s/m) and about x, y, z (N m/rad, N m s/rad) of the first interface.
    free_position, free_rotation : (3,), rotation
        Second frame in the first where the springs are free: its origin (m), and its axes to those of the first.
    position, rotation : (3,), rotation
        The frame on the ground, inertial. Rotations are a matrix (3, 3), a quaternion w, x, y, z, or a pair of axis and
        angle (rad), kept as the matrix.

    Examples
    --------
    >>> mount = Bushing(name="mount", between=("ground", "engine.foot"), stiffness=np.full(6, 1e5))
    >>> mount.damping.tolist()
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("position", "rotation"), needs=("between",), among=(GROUND,), advice=ON_GROUND),
        Rule(("free_position", "free_rotation", "position"), needs=("stiffness",)),
        Rule(("rotation",), needs=("stiffness", "damping")),
    )
    stiffness: np.ndarray = given(converter=vector, default_factory=lambda: np.zeros(6))
    damping: np.ndarray = given(converter=vector, default_factory=lambda: np.zeros(6))
    free_position: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    free_rotation: np.ndarray = given(converter=as_rotation, default_factory=lambda: np.eye(3))
    position: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    rotation: np.ndarray = given(converter=as_rotation, default_factory=lambda: np.eye(3))
    noun: ClassVar[str] = "bushing"

    def __post_init__(self) -> None:
        """Check the constants."""
        self._convert(f"bushing {self.name!r}: ")
        for name, shape in (("stiffness", (6,)), ("damping", (6,)), ("free_position", (3,)), ("position", (3,))):
            value = getattr(self, name)
            if value.shape != shape:
                raise InputError(f"bushing {self.name!r}: {name} has {value.size} numbers; give {shape[0]}")
            if shape == (6,) and not np.all(value >= 0):
                raise InputError(f"bushing {self.name!r}: {name} {value.tolist()} must not be negative")
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class Callback(Record):
    """Loads of a Python function, for control loops: ``function(t, state) -> {where: load}``.

    `state` is a `State`: ``state["arm.tip"].position``, ``.rotation``, ``.velocity``, ``.angular_velocity`` of an
    interface, ``state.joint("hinge").position`` and ``.rate`` of a joint. ``where`` is ``body.interface`` with a
    force, or with a force followed by a torque (3 or 6 numbers, N and N m, inertial), or the name of a joint with one
    number for each of its speeds. The function is called at every evaluation, so it must depend on t and state alone.

    The step control sees what the function returns at the stages of a step, and nothing of what happens between them. A
    load that the function switches on for a short time may be missed: give loads that depend on time alone as functions
    of time, whose bends are known, or let no step be longer than the event (`max_step` of `simulate`).

    Attributes
    ----------
    name : str
    function : callable (float, State) -> {where: load}
    laws : tuple of str
        Expressions whose parts in ``t`` alone limit the step, as `feedback` gives them.

    Examples
    --------
    >>> brake = Callback(name="brake", function=lambda t, state: {"hinge": -2.0 * state.joint("hinge").rate})
    >>> brake.name
    'brake'
    """

    name: str
    function: Callable[[float, Any], Mapping[str, Any]]
    laws: tuple[str, ...] = ()


class Held:
    """What a sampled load was when it was called last; `loads` is None but in a run."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.loads: Mapping[str, Any] | None = None

    def __call__(self, t: float, state: Any) -> Mapping[str, Any]:
        """Return the loads by their places.

        Returns
        -------
        dict
            As a callback does.
        """
        if self.loads is None:
            raise InputError(
                f"load {self.name!r} is sampled in time and acts in runs of simulate only; leave it out here"
            )
        return self.loads

    def __reduce__(self) -> tuple:
        """Copies in other processes are not in a run."""
        return Held, (self.name,)


def _nothing(t: float) -> None:
    """Do nothing at the begin of a run."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SampledLoad(Callback):
    """Loads of a Python function that is called once in each period and held in between, as a digital controller is.

    ``sample(t, state) -> {where: load}`` is called with states of the run alone, at its begin and at each multiple of
    the period, in order of time: it may keep what it likes. Steps end at these times. `simulate` alone has such loads;
    other analyses, and derivatives of runs, refuse them.

    Attributes
    ----------
    name : str
    sample : callable (float, State) -> {where: load}
        As that of a `Callback`.
    period : float
        s.
    begin : callable (float) -> None
        Called with the time at which a run begins.
    balanced : bool
        Whether it stands for what acts continuously, so that `Result.stats` has the energy of the exchange and
        `Result.notes` say where more than 1 % of it is out of balance.

    Raises
    ------
    InputError
        When the period is not positive.

    Examples
    --------
    >>> law = SampledLoad(name="law", sample=lambda t, state: {"hinge": -2.0 * state.joint("hinge").rate}, period=0.01)
    >>> law.period
    0.01
    """

    function: Callable[[float, Any], Mapping[str, Any]] = field(init=False)
    sample: Callable[[float, Any], Mapping[str, Any]]
    period: float
    begin: Callable[[float], None] = _nothing
    balanced: bool = False

    def __post_init__(self) -> None:
        """Check the period."""
        if not isinstance(self.period, int | float) or not 0 < self.period < float("inf"):
            raise InputError(f"sampled load {self.name!r}: period = {self.period} must be a positive number")
        object.__setattr__(self, "function", Held(self.name))
        super().__post_init__()


Load = PointForce | DistributedForce | TwoEnded | CentralGravity | Conductor | ExpelledGas | ImmersedRod | Callback


def locate(bodies: Mapping[str, FlexibleBody], text: str, what: str) -> tuple[str, int] | None:
    """Return body and interface number of ``body.interface``; None for the ground.

    Raises
    ------
    InputError
        When there is no such body or interface; `what` starts the message.

    Examples
    --------
    >>> locate({}, "ground", "spring 's'") is None
    True
    """
    return None if text == GROUND else find_interface(bodies, text, what)


def check_loads(bodies: Mapping[str, FlexibleBody], loads: tuple[Load, ...]) -> None:
    """Refuse loads on unknown bodies or interfaces, and a second central gravity field."""
    if sum(isinstance(load, CentralGravity) for load in loads) > 1:
        raise InputError("a system has at most one central gravity field")
    _refuse_more_than_lost([load for load in loads if isinstance(load, ExpelledGas)])
    for load in loads:
        refuse_name(getattr(load, "name", "gravity"), "load")
        if isinstance(load, PointForce | Conductor):
            _refuse_ground(bodies, load)
        if isinstance(load, TwoEnded):
            for end in load.between:
                locate(bodies, end, f"{load.noun} {load.name!r}")
        if isinstance(load, DistributedForce):
            _check_distributed(bodies, load)
        if isinstance(load, ExpelledGas) and None in [
            locate(bodies, x, f"gas {load.name!r}") for x in load.flow_points
        ]:
            raise InputError(f"gas {load.name!r} has the ground on its flow path; name 'body.interface'")
        if isinstance(load, ImmersedRod):
            check_rod(bodies, load)


def _refuse_more_than_lost(jets: list[ExpelledGas]) -> None:
    """Refuse jets through which more mass leaves than their body loses."""
    for source in {id(jet.source): jet.source for jet in jets}.values():
        shares = {jet.name: jet.mass_fraction for jet in jets if jet.source is source}
        if sum(shares.values()) > 1 + ROUNDING:
            named = " and ".join(map(repr, shares))
            raise InputError(
                f"gas {named}: the mass fractions of one source add up to {sum(shares.values()):g}, above 1"
            )


def _refuse_ground(bodies: Mapping[str, FlexibleBody], load: PointForce | Conductor) -> None:
    what = f"{'force' if isinstance(load, PointForce) else 'conductor'} {load.name!r}"
    for end in (load.at,) if isinstance(load, PointForce) else load.through:
        if locate(bodies, end, what) is None:
            raise InputError(f"{what} is on the ground, where it has no effect; name 'body.interface'")


def _check_distributed(bodies: Mapping[str, FlexibleBody], load: DistributedForce) -> None:
    refuse_unknown(load.body, bodies, f"force {load.name!r}: body")
    wanted = bodies[load.body].points.shape
    if load.force.shape != wanted:
        raise InputError(
            f"force {load.name!r}: needs a force on each of the {wanted[0]} points of body {load.body!r}, shape "
            f"{wanted}; it has {load.force.shape}"
        )


def _check_axes(name: str, axes: str) -> None:
    if axes not in ("inertial", "body"):
        raise InputError(f"force {name!r}: axes {axes!r} is neither 'inertial' nor 'body'")
