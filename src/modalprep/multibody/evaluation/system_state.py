"""The state of a system by name: where a run starts, and where it was left."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.coordinates import coordinates
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.records import Record
from modalprep.suggest import refuse_other, refuse_unknown

SHORTEST = 1e-3  # length of a quaternion that still has a direction


@dataclass(frozen=True, eq=False, kw_only=True)
class SystemState(Record):
    """Coordinates and speeds of a system at one time, by the names of its joints and bodies.

    What a state does not name is as at the start of a run: joints at their start values, modes at rest. Joints that
    follow a prescribed motion have no entry.

    Attributes
    ----------
    t : float
        s.
    joints : dict of (k,)
        Coordinates of each joint, translations (m) before rotations (rad); the rotation of a spherical or free joint is
        a quaternion w, x, y, z.
    joint_rates : dict of (k,)
        Its speeds, m/s and rad/s; angular velocities of spherical and free joints in the axes of the child.
    modal : dict of (n,)
        Modal coordinates of each body, m sqrt(kg).
    modal_rates : dict of (n,)
        Their rates, m sqrt(kg) / s.
    closures : dict of (m,)
        What the conditions of each closure keep: lengths (m), angles (rad), sums of coupled coordinates. Where it is
        missing they are those of this state.
    active : dict of bool
        Whether each closure is active.
    steps : dict of array
        The step control of a run that ended here, with which it goes on by the steps that it would have taken.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.simulate import simulate
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> plucked = SystemState(modal={"arm": np.array([0.1, 0.0])})
    >>> simulate(arm, t_end=0.1, start=plucked)["arm.modal"][0].tolist()
    [0.1, 0.0]
    """

    t: float = 0.0
    joints: dict[str, np.ndarray] = field(default_factory=dict)
    joint_rates: dict[str, np.ndarray] = field(default_factory=dict)
    modal: dict[str, np.ndarray] = field(default_factory=dict)
    modal_rates: dict[str, np.ndarray] = field(default_factory=dict)
    closures: dict[str, np.ndarray] = field(default_factory=dict)
    active: dict[str, bool] = field(default_factory=dict)
    steps: dict[str, np.ndarray] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the time, and of how many joints and bodies it is."""
        return f"SystemState(t = {self.t:g} s, {len(self.joints)} joints, {len(self.modal)} flexible bodies)"

    def vector(self, system: System) -> np.ndarray:
        """Return the state as the solver orders it, ``[coordinates | speeds]``.

        Returns
        -------
        (nx + nu,) float

        Raises
        ------
        InputError
            When a joint or body is unknown, or has another number of coordinates.
        """
        refuse_other("state: the system", System, system)
        packed = pack(system)
        y = start_state(packed)
        named = [joint.name for joint in system.joints]
        for name, values in _known(self.joints, named, "joint"):
            _put(y, packed.coordinates_of(name), values, f"joint {name!r} has {{}} coordinates")
        for name, values in _known(self.joint_rates, named, "joint"):
            _put(y, [packed.nx + k for k in packed.speeds_of(name)], values, f"joint {name!r} has {{}} speeds")
        for name, values in _known(self.modal, system.bodies, "body"):
            _put(y, packed.modes_of(name), values, f"body {name!r} has {{}} modal coordinates")
        for name, values in _known(self.modal_rates, system.bodies, "body"):
            _put(y, packed.modal_rates_of(name), values, f"body {name!r} has {{}} modal rates")
        return _with_unit_quaternions(packed, y)


def _known(values: Mapping[str, np.ndarray], names: Iterable[str], what: str) -> Iterable[tuple[str, np.ndarray]]:
    for name in values:
        refuse_unknown(name, names, f"state: {what}")
    return values.items()


def _put(y: np.ndarray, where: list[int] | slice, values: np.ndarray, what: str) -> None:
    given = np.atleast_1d(np.asarray(values, dtype=float))
    count = len(y[where])
    if given.shape != (count,):
        raise InputError(f"state: {what.format(count)}, of which {given.size} are given")
    if not np.all(np.isfinite(given)):
        raise InputError(f"state: {what.format(count)}, one of which is not finite")
    y[where] = given


def _with_unit_quaternions(packed: Packed, y: np.ndarray) -> np.ndarray:
    for q in packed.quaternions:
        size = np.linalg.norm(y[q])
        if size < SHORTEST:
            raise InputError("state: the quaternion of a joint is zero; give w, x, y, z of a rotation")
        if abs(size - 1) > 1e-12:
            y[q] /= size
    return y


def state_of(
    system: System,
    y: np.ndarray,
    t: float = 0.0,
    *,
    loops: Loops | None = None,
    steps: Mapping[str, np.ndarray] | None = None,
) -> SystemState:
    """Return a state vector by name.

    Parameters
    ----------
    y : (nx + nu,)
        State as of `Equilibrium.y`.
    t : float
        s.
    loops : Loops
        Of the system, in the run that has this state; without it the closures keep what they find at y.
    steps : dict of array
        The step control of that run.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> state = state_of(arm, np.array([0.1, 2.0, 3.0, 0.4, 5.0, 6.0]))
    >>> state.joints["hinge"].tolist(), state.modal_rates["arm"].tolist()
    ([0.1], [5.0, 6.0])
    """
    packed = pack(system)
    named = coordinates(system, y, t)
    moving = [joint.name for joint in system.joints if packed.speeds_of(joint.name)]
    flexible = [name for name, body in system.bodies.items() if body.n]
    closures = [] if loops is None else [(closure.name, k) for k, closure in enumerate(system.closures)]
    return SystemState(
        t=float(t),
        joints={name: y[packed.coordinates_of(name)] for name in moving},
        joint_rates={name: y[[packed.nx + k for k in packed.speeds_of(name)]] for name in moving},
        modal={name: np.array(named.modal(name)) for name in flexible},
        modal_rates={name: np.array(named.modal_rate(name)) for name in flexible},
        closures={name: np.array(loops.work.value[loops.closing.of(k)]) for name, k in closures if loops},
        active={name: loops.active(k) for name, k in closures if loops},
        steps=dict(steps or {}),
    )
