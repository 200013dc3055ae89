"""A system at one state, for the analyses: accelerations, the forces that accelerations need, closed loops, scales."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import scipy

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.evaluation.singular import without_inertia
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.kernels.joints import move
from modalprep.multibody.kernels.linear_equations import linear_equations
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.responses import Responses, mean_response, new_responses, prepare, respond
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.coordinate_names import CoordinateNames, coordinate_names
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack

LEAST_REACH = 1e-6  # of the mode that moves most
AHEAD = 1.0  # s after the time of interest for which functions of time are tabulated


def start_state(packed: Packed) -> np.ndarray:
    """Return the state (nx + nu,) that the joints say, modes at rest.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.5)
    >>> start_state(pack(System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))))
    array([0.5, 0. , 0. , 0. ])
    """
    y = np.zeros(packed.nx + packed.nu)
    before = [0, 0]  # translations and rotations of the joint up to a link
    for link, (code, x, u, about) in zip(packed.links, packed.columns, strict=True):
        joint = link.joint
        kind = KINDS[code]
        u = packed.nx + u
        turns = bool(about)
        before = [0, 0] if link.hinge == 0 else before
        if kind.named:
            value, rate = (joint.angle, joint.rate) if turns else (joint.displacement, joint.speed)
            y[x], y[u] = _component(value, before[turns]), _component(rate, before[turns])
        before[turns] += 1
        if kind.quaternion >= 0:
            q, w = x + kind.quaternion, u + kind.translations
            y[x:q] = joint.position[: kind.quaternion]
            y[u:w] = joint.velocity[: kind.translations]
            y[q : q + 4] = scipy.spatial.transform.Rotation.from_matrix(joint.rotation).as_quat(scalar_first=True)
            y[w : w + 3] = joint.angular_velocity
    return y


def _component(values: float | np.ndarray, k: int) -> float:
    """Return number k of values, or the one value for all."""
    return values if isinstance(values, int | float) else np.resize(values, 3)[k]


class Measures(NamedTuple):
    """What is found once of a system: see `Evaluator`."""

    start: np.ndarray  # loops as they are
    scale: np.ndarray
    turns: np.ndarray
    owner: tuple[tuple[str, str], ...]
    size: float


MEASURES: WeakKeyDictionary[System, Measures] = WeakKeyDictionary()  # systems do not change


def _measured(system: System) -> Measures:
    if system not in MEASURES:
        MEASURES[system] = _measure(system, pack(system))
    return MEASURES[system]


def _measure(system: System, packed: Packed) -> Measures:
    distinct = {id(body): body for body in system.bodies.values()}
    sizes = {key: _size(body) for key, body in distinct.items()}
    scales = {key: sizes[key] / _reach(body) for key, body in distinct.items() if body.n}
    travels = [np.abs(joint.displacement).max() for joint in system.joints if np.any(joint.displacement)]
    largest = float(max(*sizes.values(), *travels, 0.0))
    scale = np.ones(packed.nu)
    turns = np.zeros(packed.nu, dtype=bool)
    owner = [("", "")] * packed.nu
    columns = (packed.model.links[name].tolist() for name in ("joint", "u", "uq", "about"))
    for link, kind, u, first, about in zip(packed.links, *columns, strict=True):
        count = KINDS[kind].speeds
        owner[u : u + count] = [("joint", link.joint.name)] * count
        shifts = 0 if about else KINDS[kind].translations
        scale[u : u + shifts] = largest
        turns[u + shifts : u + count] = True
        body = system.bodies[link.body] if link.body else None
        if body and body.n:
            owner[first : first + body.n] = [("body", link.body)] * body.n
            scale[first : first + body.n] = scales[id(body)]
    return Measures(start_state(packed), scale, turns, tuple(owner), largest)


class Evaluator:
    """A packed system and its loads at one time.

    Attributes
    ----------
    start : (nx + nu,)
        State that the joints say, closed loops closed.
    scale : (nu,)
        Size of a change of each coordinate: 1 rad, the largest body or travel at the start (m), a deflection of the
        body's own size.
    size : float
        The largest body or travel at the start, m.
    turns : (nu,) bool
        Whether the coordinate is an angle.
    owner : tuple of (str, str)
        What each speed belongs to: ``("joint", name)`` or ``("body", name)``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), gravity=np.array([0, -10.0, 0]))
    >>> evaluator = Evaluator(arm)
    >>> y = start_state(evaluator.packed)
    >>> float(evaluator.required(y, np.zeros(2))[0])  # 12 kg, centre at 5 m
    600.0
    """

    def __init__(self, system: System, t: float = 0.0, *, until: float = 0.0) -> None:
        self.system = system
        self.packed = pack(system)
        self.nx, self.nu = self.packed.nx, self.packed.nu
        self.data = self.packed.data()
        self.loading = Loading(system, self.packed, until if until > t else t + AHEAD)
        self.loops = self.loading.loops
        self.udot = np.zeros(self.nu)  # the last accelerations
        self.factored = False  # whether the data are those of `accelerations` at y
        self.prepared = False  # whether `respond` has prepared them
        self.applied: list[tuple[str, np.ndarray]] = []  # interface, force and torque (6,) besides the loads
        self.inputs: dict[str, Any] = {}  # made by `input_of`
        self.start = self._started(t)
        _, self.scale, self.turns, self.owner, self.size = _measured(system)

    @cached_property
    def names(self) -> CoordinateNames:
        """Those of the nu coordinates and of the nu speeds."""
        return self.packed.kept("names", lambda: coordinate_names(self.packed))

    def _started(self, t: float) -> np.ndarray:
        """Return the start, lengths and sums "as at the start" taken at zero, closed again at t."""
        y = _measured(self.system).start.copy()
        if self.loops is None:
            self.set_time(t)
            return y
        self.set_time(0.0)
        y = self.loops.assemble(self.data, y, self.loading.prescribe(0.0, self.data))
        self.set_time(t)
        return self.closed(y) if t else y

    def closed(self, y: np.ndarray) -> np.ndarray:
        """Return a state brought onto the closed loops.

        Raises
        ------
        SimulationError
            When they cannot be closed from there.
        """
        found = y.copy()
        if self.loops and not self.loops.project(self.data, found, self.loading.prescribe(self.t, self.data), self.t):
            raise SimulationError(f"the closed loops cannot be closed at t = {self.t:g} s from the state given")
        return found

    def set_time(self, t: float) -> None:
        """Take functions of time at t (s), not after that of the start."""
        self.t = float(t)  # kernels are compiled anew for an integer
        stretches = self.loading.stretches
        self.loading.enter(*next((stretch for stretch in stretches if t < stretch[1]), stretches[-1]))

    def coordinates(self, kind: str, name: str) -> list[int]:
        """Return the places in y of the coordinates of a joint or a body's modes."""
        if kind == "body":
            modes = self.packed.modes_of(name)
            return list(range(modes.start, modes.stop))
        return self.packed.coordinates_of(name)

    def load(self, y: np.ndarray, *, moving: bool = True) -> None:
        """Kinematics and loads of a state; not `moving`: prescribed hinges are held where they are."""
        motion = self.loading.prescribe(self.t, self.data)
        self.applied = []
        self.y, self.factored = y, False
        if not moving:
            motion[:, 1:] = 0.0
        kernel.outward(self.packed.model, self.data, y, motion)
        self.loading.apply(self.data, y, self.t)
        if self.loops:
            self.loops.residual(self.data, y, motion, self.t)

    @property
    def gap_count(self) -> int:
        """Number of conditions that the loops make."""
        return len(self.loops.arrays.rows) if self.loops else 0

    def gaps(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what the loops leave open (m,), lengths by the size of the system, and its rate (m,)."""
        motion = self.loading.prescribe(self.t, self.data)
        kernel.outward(self.packed.model, self.data, y, motion)
        loops = self.loading.closed_loops
        loops.residual(self.data, y, motion, self.t)
        return loops.work.unit * loops.work.phi, loops.work.unit * loops.work.rate

    def jacobian(self, y: np.ndarray) -> np.ndarray:
        """Return the derivatives of the gaps' rates by the speeds (m, nu), exactly: they are linear."""
        if self.loops is None:
            return np.zeros((0, self.nu))
        motion = self.loading.prescribe(self.t, self.data)
        motion[:, 1:] = 0.0
        return self.loops.work.unit[:, None] * self.loops.rate_slopes(self.data, y, motion, self.t)

    def kept_rows(self, y: np.ndarray) -> np.ndarray:
        """Return which conditions of the loops do not follow from others at a state (int)."""
        if self.loops is None:
            return np.zeros(0, dtype=int)
        self.load(y)
        self.accelerations(np.zeros(self.nu))
        return np.sort(self.loops.work.order[: self.loops.work.rank[0]])

    def exerted(self, y: np.ndarray, required: np.ndarray) -> dict[str, np.ndarray]:
        """Return what the closures exert to be the generalised forces ``required (nu,)``, named as in `Loops.exerted`.

        Conditions that follow from others take no part.
        """
        if self.loops is None:
            return {}
        kept = self.kept_rows(y)
        multiplier = self.loops.work.multiplier
        G = self.jacobian(y)[kept]
        multiplier[:] = 0.0
        multiplier[kept] = np.linalg.lstsq(G.T, required)[0] * self.loops.work.unit[kept]
        return self.loops.exerted()

    def required(
        self, y: np.ndarray, udot: np.ndarray, *, moving: bool = True, push: Callable[[], np.ndarray] | None = None
    ) -> np.ndarray:
        """Return the generalised forces (nu,), beyond all loads, that accelerations ``udot (nu,)`` need.

        Those that closed loops exert are among them. `push` adds further loads and returns their joint forces (nu,).
        """
        out = np.zeros(self.nu)
        self.load(y, moving=moving)
        tau = self.loading.tau
        if push is not None:
            world(self.packed.model, self.data)
            tau = tau + push()
        required_forces(self.packed.model, self.data, udot, out)
        return out - tau

    def push_modes(self, force: np.ndarray) -> None:
        """Add the modal rows of generalised forces ``force (nu,)`` to the loads, after `load`, which clears them."""
        modal = self.data.modal
        for link in self.packed.model.links:
            if link.modes and modal is not None:
                modal.load[link.slot, : link.modes] += force[link.uq : link.uq + link.modes]

    def mass(self, y: np.ndarray) -> np.ndarray:
        """Return the mass matrix (nu, nu)."""
        rest = self.required(y, np.zeros(self.nu))
        return np.column_stack([self.required(y, e) - rest for e in np.eye(self.nu)])

    def accelerations(self, tau: np.ndarray) -> np.ndarray:
        """Return ``udot (nu,)`` under hinge forces ``tau (nu,)`` besides the loads, after `load`.

        Raises
        ------
        SimulationError
            When the mass matrix is not positive.
        """
        udot = np.zeros(self.nu)
        status = self._accelerations(tau + self.loading.tau, udot)
        if status >= 0:
            name = next(link.body for link in self.packed.links[status:] if link.body)
            if self.system.bodies[name].n:
                why = f"the mass matrix of body {name!r} is not positive: its deflection is too large"
            else:
                why = without_inertia(self.system, self.packed, self.y, name)
            raise SimulationError(why)
        self.udot, self.factored, self.prepared = udot, True, False
        return udot

    def respond(self, factor: float, forces: np.ndarray, out: np.ndarray, row: int = 0, column: int = 0) -> np.ndarray:
        """Write what accelerations generalised forces ``factor * forces (nu, k)`` alone make, after `accelerations`.

        They go to ``out[row : row + nu, column : column + k]``; the largest of each column in the scales (k,) is
        returned. By the factors of the order-n algorithm, which `load` overwrites and systems with closures lack.
        """
        sizes = np.empty(forces.shape[1])
        respond(self.packed.model, self.data, factor, forces, out, row, column, self.scale, sizes, self._prepared())
        return sizes

    def linear_equations(self, *given: np.ndarray) -> float:
        """Write the accelerations by coordinates, speeds and inputs, after `accelerations`; returns the error.

        Parameters
        ----------
        given : arrays
            K, D, M, size, force, signs, numbers, state and by_input of the kernel `linear_equations`.
        """
        K, D, M, size, force, *others = given
        error = linear_equations(self.packed.model, self.data, K, D, M, size, force, self.scale, *others, self._scratch)
        self.prepared = True
        return error

    def mean_response(self, force: np.ndarray, signs: np.ndarray) -> float:
        """Return the largest root mean square, in the scales, of what forces (nu,) times signs (nu, 4) accelerate.

        As `respond`.
        """
        return mean_response(self.packed.model, self.data, force, signs, self.scale, self._prepared())

    def _prepared(self) -> Responses:
        if not self.prepared:
            prepare(self.packed.model, self.data, self._scratch)
            self.prepared = True
        return self._scratch

    @cached_property
    def _scratch(self) -> Responses:
        return new_responses(self.packed.model, self.nu)

    def _accelerations(self, tau: np.ndarray, udot: np.ndarray) -> int:
        """Write the accelerations under all hinge forces; returns the link whose pivot is not positive, else -1."""
        if self.loops:
            return self.loops.accelerations(self.data, tau, udot)
        status = kernel.inward(self.packed.model, self.data, tau, None, 0.0, 0.0)
        if status < 0:
            kernel.forward(self.packed.model, self.data, tau, udot)
        return status

    def rates(self, y: np.ndarray, ydot: np.ndarray) -> None:
        """Write the time derivatives of the coordinates to ``ydot (nx + nu,)``."""
        kernel.kinematic(self.packed.model, y, ydot)

    def moved(self, y: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return y with its coordinates moved as speeds ``step (nu,)`` would in unit time."""
        y = y.copy()
        move(self.packed.model, y, np.array(step, dtype=float), y)
        return y


LAST: list[Evaluator] = []  # none or one, that nobody uses


@contextmanager
def evaluator_at(system: System, t: float) -> Iterator[Evaluator]:
    """Give an evaluator for a while: that of the last call where system and time are the same, ready at once.

    Nothing that is kept longer may refer to it. It goes on to the next call only where it keeps nothing of the
    evaluations before: without closures, which begin where the last solution was, and without callbacks.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> with evaluator_at(arm, 0.0) as one:
    ...     pass
    >>> with evaluator_at(arm, 0.0) as other, evaluator_at(arm, 0.0) as third:
    ...     print(one is other, one is third)
    True False
    """
    last = LAST.pop() if LAST else None
    evaluator = last if last and last.system is system and last.t == t else Evaluator(system, t)
    yield evaluator
    if evaluator.loops is None and evaluator.loading.compiled:
        LAST[:] = [evaluator]


def _size(body) -> float:
    """Size of a body by its points and interfaces, m."""
    return float(np.ptp(np.vstack([body.points, body.interface_position]), axis=0).max()) or 1.0


def _reach(body) -> np.ndarray:
    """Largest displacement of any point, or turn of an interface times the size, per modal coordinate (n,)."""
    turns = _size(body) * body.psi
    largest = np.abs(np.vstack([body.shape, body.phi, turns])).max(axis=(0, 1), initial=0.0)
    return np.maximum(largest, LEAST_REACH * largest.max(initial=0.0)) if np.any(largest) else np.ones(body.n)
