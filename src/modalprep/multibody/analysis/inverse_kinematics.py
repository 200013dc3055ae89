"""Joint positions and speeds for which interfaces are, and move, as they should: assembly of loops, inverse kinematics.

Closed loops are conditions, targets are met as nearly as they allow: least squares in the motions that keep the loops
closed, damped by Levenberg and Marquardt. Speeds follow by one linear step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.start_values import with_start_values
from modalprep.multibody.evaluation.evaluator import Evaluator, start_state
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.interfaces import node_state, world
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.records import Record, given, optional
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.vectors import as_rotation, vector

LARGEST = 0.3  # step, in scales of the coordinates
MAX_STEPS = 300
CLOSINGS = 30  # Newton steps that close the loops
CLOSED = 1e-12  # of gaps, lengths by the size of the system
MET = 1e-10  # of targets, lengths by the size of the system
STALLED = 1e-12  # step
FIRST_DAMPING, LESS, MORE, MOST_DAMPING = 1e-3, 0.1, 10.0, 1e12
RANK = 1e-9  # singular values below it, of the largest, count as zero
MOVES = 1e-6  # of a motion: joints with less do not take part
KEPT = 1e-5  # rad or m, by which the closing of loops may move what it should keep
ROUND_OFF = 1e-15  # of targets
POSITIONS, SPEEDS, ALL = slice(0, 2), slice(2, 4), slice(None)
WHAT: tuple[str, ...] = ("position", "rotation", "velocity", "angular_velocity")
UNITS = ("m", "rad", "m/s", "rad/s")


@dataclass(frozen=True, eq=False, kw_only=True)
class Target(Record):
    """Where an interface should be, and how it should move, relative to the ground.

    Attributes
    ----------
    at : str
        ``body.interface``.
    position : (3,) or None
        m; NaN where it is free.
    rotation : (3, 3), (4,) or ((3,), float), or None
        Interface axes to those of the ground: a matrix, a quaternion, or axis and angle (rad).
    velocity, angular_velocity : (3,) or None
        m/s and rad/s, in the axes of the ground; NaN where it is free.
    weight : float
        Of its errors beside those of other targets, where not all can be met.

    Examples
    --------
    >>> Target(at="arm.tip", position=(1.0, float("nan"), 0.0)).position
    array([ 1., nan,  0.])
    """

    at: str
    position: np.ndarray | None = given(converter=optional(vector), default=None)
    rotation: np.ndarray | None = given(converter=optional(as_rotation), default=None)
    velocity: np.ndarray | None = given(converter=optional(vector), default=None)
    angular_velocity: np.ndarray | None = given(converter=optional(vector), default=None)
    weight: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        self._convert(f"target at {self.at!r}: ")
        if not 0 < self.weight < np.inf:
            raise InputError(f"target at {self.at!r}: weight = {self.weight:g} must be positive")
        for name in ("position", "velocity", "angular_velocity"):
            value = getattr(self, name)
            if value is not None and (value.shape != (3,) or np.any(np.isinf(value))):
                raise InputError(f"target at {self.at!r}: {name} needs three numbers, NaN where it is free")
        if all(getattr(self, name) is None for name in WHAT):
            raise InputError(f"target at {self.at!r}: give at least one of {', '.join(WHAT)}")
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class InverseKinematics(Record):
    """Joint positions and speeds that meet targets.

    Attributes
    ----------
    system : System
        With these positions and speeds as start values of its joints, for `simulate` and all analyses.
    joints : dict of (k,)
        Coordinates of each joint that may move, m and rad; a rotation about three axes is a quaternion w, x, y, z.
    joint_rates : dict of (k,)
        Its speeds, m/s and rad/s.
    errors : dict of (3,)
        ``body.interface.position`` (m), ``.rotation`` (rotation vector, rad), ``.velocity`` (m/s) and
        ``.angular_velocity`` (rad/s): what is reached, less the target; zero where it is free.
    freedom : int
        Motions that targets, loops and given joints leave open.
    open : tuple of str
        Joints that take part in these motions; they have moved as little as they could in each step.
    steps : int
        Of the search for the positions.
    """

    system: System
    joints: dict[str, np.ndarray]
    joint_rates: dict[str, np.ndarray]
    errors: dict[str, np.ndarray]
    freedom: int
    open: tuple[str, ...]
    steps: int


def inverse_kinematics(
    system: System,
    targets: Sequence[Target] = (),
    *,
    given: Sequence[str] = (),
    free: Sequence[str] | None = None,
    weights: Mapping[str, float] | None = None,
    nearest: bool = False,
) -> InverseKinematics:
    """Return the joint positions and speeds for which interfaces are, and move, as they should, loops closed.

    The search starts from the start values of the joints, with modes at rest, and each of its steps moves the joints
    as little as it can. Speeds differ from those of the start by as little as they can.

    Parameters
    ----------
    targets : sequence of Target
        None: only the loops are closed (assembly).
    given : sequence of str
        Joints that keep their start values and rates, ``joint`` or ``joint.k`` for its speed number k, translations
        before rotations.
    free : sequence of str or None
        Instead: the joints that may move; default all others.
    weights : dict of float
        How much a joint should stay at its start beside the others, which have 1; by ``joint`` or ``joint.k``.
    nearest : bool
        Whether targets that cannot all be met are met as nearly as they can, by their weights.

    Returns
    -------
    InverseKinematics
        Positions, speeds, what is left of the targets, and what they leave open.

    Raises
    ------
    InputError
        When a name is not known, or loops cannot be closed.
    SimulationError
        When targets are out of reach, or contradict each other, the loops or the given joints.

    References
    ----------
    P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, Prentice Hall 1988, chapters 3 and 4.
    K. Levenberg, Quarterly of Applied Mathematics 2 (1944) 164; D. W. Marquardt, J. SIAM 11 (1963) 431.
    Theory 5.6.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    >>> rod = rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=ends)
    >>> joints = (Joint(name="shoulder", type="revolute", parent="ground", child="a", angle=0.3),
    ...           Joint(name="elbow", type="revolute", parent="a.tip", child="b", angle=0.5))
    >>> tip = Target(at="b.tip", position=(1.0, 1.0, 0.0), velocity=(0.0, 1.0, 0.0))
    >>> found = inverse_kinematics(System(bodies={"a": rod, "b": rod}, joints=joints), [tip])
    >>> np.degrees([found.joints["shoulder"][0], found.joints["elbow"][0]]).round(9)
    array([ 0., 90.])
    >>> found.joint_rates["shoulder"].round(9), found.joint_rates["elbow"].round(9), found.freedom
    (array([1.]), array([-1.]), 0)
    """
    refuse_other("inverse_kinematics: the system", System, system)
    search = _Search(system, targets, given, free, weights or {})
    y, steps = search.positions(search.start())
    y = search.speeds(y)
    if not nearest:
        search.refuse_missed(y)
    return search.found(y, steps)


class _Search:
    """Targets, and motions of the joints that may move: scaled changes ``z (n,)``, small where weights are large."""

    def __init__(
        self,
        system: System,
        targets: Sequence[Target],
        given: Sequence[str],
        free: Sequence[str] | None,
        weights: Mapping[str, float],
    ) -> None:
        self.system = system
        packed = pack(system)
        joints = [speed for joint in system.joints for speed in packed.speeds_of(joint.name)]
        self.held = _held(system, packed, given, free, joints)
        kept = {j.name for j in system.joints if set(packed.speeds_of(j.name)) <= self.held and not j.motions}
        kept = {name for name in kept if packed.speeds_of(name)}
        self.evaluator = Evaluator(
            system.with_(joints=tuple(j.with_(keep_start=j.keep_start or j.name in kept) for j in system.joints))
        )
        self.columns = [speed for speed in joints if speed not in self.held]
        scale = self.evaluator.scale.copy()
        for name, weight in weights.items():
            if not 0 < weight < np.inf:
                raise InputError(f"inverse_kinematics: weight of {name!r} = {weight:g} must be positive")
            scale[_speeds(system, packed, name)] /= np.sqrt(weight)
        self.scale = scale[self.columns]
        self.targets = [(target, *_place(self.evaluator, target.at)) for target in targets]
        names = [f"{targets[k].at}.{what}" for (k, what), *_ in self._rows(ALL)]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            raise InputError(f"inverse_kinematics: {twice!r} has two targets; leave one of them out")

    def start(self) -> np.ndarray:
        """Return the start values with the loops closed by the joints that may move; speeds are those of the start."""
        evaluator = self.evaluator
        y = start_state(evaluator.packed)
        for joint in self.system.joints:
            own = evaluator.coordinates("joint", joint.name)
            moved = np.abs(evaluator.start - y)[own].max(initial=0.0)
            if not set(evaluator.packed.speeds_of(joint.name)) <= self.held:
                y[own] = evaluator.start[own]
            elif moved > KEPT:
                raise SimulationError(
                    f"the closed loops do not close with joint {joint.name!r} at the start value that is given: the "
                    f"nearest closed position has it {moved:.3g} away; give another value, or leave it out of 'given'"
                )
        closed = self._closed(y)
        if closed is None:
            raise SimulationError("the closed loops do not close by the joints that may move alone; give fewer joints")
        return closed

    def positions(self, y: np.ndarray) -> tuple[np.ndarray, int]:
        """Return the state nearest to the targets, and the number of steps, by Levenberg's and Marquardt's method."""
        damping = FIRST_DAMPING
        left, slopes = self._equations(y, POSITIONS)
        for step in range(MAX_STEPS):
            if np.abs(left).max(initial=0.0) <= ROUND_OFF or damping > MOST_DAMPING:
                return y, step
            free = self._motions_of_loops(y)
            damped = np.vstack([slopes @ free, np.sqrt(damping) * np.eye(free.shape[1])])
            z = free @ np.linalg.lstsq(damped, -np.append(left, np.zeros(free.shape[1])))[0]
            size = np.abs(z).max(initial=0.0)
            trial = self._closed(self._moved(y, z * min(1.0, LARGEST / max(size, LARGEST))))
            ahead = None if trial is None else self._equations(trial, POSITIONS)
            if trial is None or ahead is None or not ahead[0] @ ahead[0] < left @ left:
                damping *= MORE
                continue
            y, (left, slopes) = trial, ahead
            damping *= LESS
            if size <= STALLED:
                return y, step + 1
        return y, MAX_STEPS

    def speeds(self, y: np.ndarray) -> np.ndarray:
        """Return the state with the speeds nearest to its own that keep the loops closed and meet the targets."""
        evaluator = self.evaluator
        rates = evaluator.gaps(y)[1] if evaluator.loops else np.zeros(0)
        G = self._loops(y)
        z = -np.linalg.lstsq(G, rates, rcond=RANK)[0]
        if np.abs(G @ z + rates).max(initial=0.0) > MET * max(1.0, np.abs(rates).max(initial=0.0)):
            raise SimulationError(
                "the closed loops do not allow the rates that are given; leave a joint out of 'given'"
            )
        left, slopes = self._equations(y, SPEEDS)
        free = self._motions_of_loops(y)
        z += free @ np.linalg.lstsq(slopes @ free, -left - slopes @ z, rcond=RANK)[0]
        y = y.copy()
        y[[evaluator.nx + k for k in self.columns]] += self.scale * z
        return y

    def refuse_missed(self, y: np.ndarray) -> None:
        """Refuse a state that misses a target."""
        errors = self._errors(y)
        size = self.evaluator.size
        fastest = max(np.abs(y[self.evaluator.nx :]).max(initial=0.0), 1.0)
        limits = dict(zip(WHAT, np.array([size, 1.0, size * fastest, fastest]) * MET, strict=True))
        over = {(k, what): np.abs(error).max() / limits[what] for (k, what), error in errors.items()}
        if not over or max(over.values()) <= 1.0:
            return
        k, what = max(over, key=over.__getitem__)
        raise SimulationError(
            f"the target at {self.targets[k][0].at!r} is missed: its {what.replace('_', ' ')} stays "
            f"{np.linalg.norm(errors[k, what]):.3g} {UNITS[WHAT.index(what)]} away; it is out of reach, or contradicts "
            "the loops, the given joints or other targets; nearest = true accepts that"
        )

    def found(self, y: np.ndarray, steps: int) -> InverseKinematics:
        """Return the record of a state."""
        packed, nx = self.evaluator.packed, self.evaluator.nx
        free = self._motions_of_loops(y)
        left = free @ _null(self._slopes(y, POSITIONS) @ free)
        rows = np.linalg.norm(left, axis=1) > MOVES
        owners = [self.evaluator.owner[k][1] for k, moves in zip(self.columns, rows, strict=True) if moves]
        moving = [joint.name for joint in self.system.joints if packed.speeds_of(joint.name)]
        return InverseKinematics(
            system=with_start_values(self.system, y),
            joints={name: y[packed.coordinates_of(name)] for name in moving},
            joint_rates={name: y[[nx + k for k in packed.speeds_of(name)]] for name in moving},
            errors={f"{self.targets[k][0].at}.{what}": error for (k, what), error in self._errors(y).items()},
            freedom=left.shape[1],
            open=tuple(dict.fromkeys(owners)),
            steps=steps,
        )

    def _moved(self, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        step = np.zeros(self.evaluator.nu)
        step[self.columns] = self.scale * z
        return self.evaluator.moved(y, step)

    def _loops(self, y: np.ndarray) -> np.ndarray:
        """Return the derivatives of the gaps (m, n)."""
        return self.evaluator.jacobian(y)[:, self.columns] * self.scale

    def _motions_of_loops(self, y: np.ndarray) -> np.ndarray:
        """Return the motions that keep the loops closed (n, k)."""
        return _null(self._loops(y))

    def _closed(self, y: np.ndarray) -> np.ndarray | None:
        """Return a state with closed loops; None where none is found."""
        if not self.evaluator.loops:
            return y
        for _ in range(CLOSINGS):
            gaps = self.evaluator.gaps(y)[0]
            if np.abs(gaps).max(initial=0.0) <= CLOSED:
                return y
            y = self._moved(y, -np.linalg.lstsq(self._loops(y), gaps, rcond=RANK)[0])
        return None

    def _equations(self, y: np.ndarray, kinds: slice) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted errors (r,) of the targets, lengths by the size of the system, and their slopes (r, n)."""
        errors = self._errors(y)
        left = [factor * errors[row][parts] for row, parts, factor in self._rows(kinds)]
        return np.concatenate([np.zeros(0), *left]), self._slopes(y, kinds)

    def _rows(self, kinds: slice) -> list[tuple[tuple[int, str], np.ndarray, float]]:
        """Return the target and kind of each value, which of its components count, and the factor on its errors."""
        found = []
        for k, (target, *_) in enumerate(self.targets):
            for what in WHAT[kinds]:
                value = getattr(target, what)
                if value is not None:
                    parts = np.flatnonzero(~np.isnan(value)) if value.ndim == 1 else np.arange(3)
                    size = 1.0 if what in ("rotation", "angular_velocity") else self.evaluator.size
                    found.append(((k, what), parts, target.weight / size))
        return found

    def _motions(self, y: np.ndarray, *, moving: bool = True) -> list[tuple]:
        """Return position, rotation, velocity and spin of the interface of each target."""
        evaluator = self.evaluator
        motion = evaluator.loading.prescribe(evaluator.t, evaluator.data)
        if not moving:
            motion[:, 1:] = 0.0
        kernel.outward(evaluator.packed.model, evaluator.data, y, motion)
        world(evaluator.packed.model, evaluator.data)
        return [node_state(evaluator.packed.model, evaluator.data, *place) for _, *place in self.targets]

    def _errors(self, y: np.ndarray) -> dict[tuple[int, str], np.ndarray]:
        """Return what is reached less the targets, zero where it is free, by number of the target and kind."""
        found = {}
        states = self._motions(y)
        for (k, what), *_ in self._rows(ALL):
            wanted = getattr(self.targets[k][0], what)
            value = np.array(states[k][WHAT.index(what)])
            if what == "rotation":
                found[k, what] = Rotation.from_matrix(value.reshape(3, 3) @ wanted.T).as_rotvec()
            else:
                found[k, what] = np.nan_to_num(value - wanted)
        return found

    def _slopes(self, y: np.ndarray, kinds: slice) -> np.ndarray:
        """Return the derivatives (r, n) of the weighted errors by the changes, those of speeds by changes of speeds."""
        rows = self._rows(kinds)
        slopes = np.zeros((len(self.columns), sum(len(parts) for _, parts, _ in rows)))
        for k, slope in zip(self.columns, slopes, strict=True):
            unit = np.append(y[: self.evaluator.nx], np.zeros(self.evaluator.nu))
            unit[self.evaluator.nx + k] = 1.0
            states = self._motions(unit, moving=False)
            rates = [f * np.array(states[t][2 + WHAT.index(what) % 2])[parts] for (t, what), parts, f in rows]
            slope[:] = np.concatenate([np.zeros(0), *rates])
        return slopes.T * self.scale


def _null(J: np.ndarray) -> np.ndarray:
    """Return the null space (n, k) of a matrix, rows scaled to one."""
    return scipy.linalg.null_space(J, rcond=RANK) if J.size else np.eye(J.shape[1])


def _held(
    system: System, packed: Packed, given: Sequence[str], free: Sequence[str] | None, joints: Sequence[int]
) -> set[int]:
    """Return the speeds of the joints that keep their start values."""
    if free is not None and given:
        raise InputError("inverse_kinematics: 'given' and 'free' exclude each other; leave one of them out")
    if free is None:
        return {speed for name in given for speed in _speeds(system, packed, name)}
    return set(joints) - {speed for name in free for speed in _speeds(system, packed, name)}


def _speeds(system: System, packed: Packed, name: str) -> list[int]:
    """Return the speeds of ``joint``, or ``joint.k``."""
    joint, _, number = name.rpartition(".") if name.rpartition(".")[2].isdigit() else (name, "", "")
    refuse_unknown(joint, [each.name for each in system.joints], "inverse_kinematics: joint")
    speeds = packed.speeds_of(joint)
    if not speeds or (number and not 1 <= int(number) <= len(speeds)):
        raise InputError(f"inverse_kinematics: {name!r}: joint {joint!r} has {len(speeds)} free coordinates")
    return [speeds[int(number) - 1]] if number else speeds


def _place(evaluator: Evaluator, at: str) -> tuple[int, int]:
    found = locate(evaluator.system.bodies, at, "target")
    if found is None:
        raise InputError("target at the ground: it does not move; name 'body.interface'")
    return evaluator.packed.link_of(found[0]), found[1]
