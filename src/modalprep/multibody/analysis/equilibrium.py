"""Static equilibrium of a system under its loads: Newton's method on the full equations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tangent import SystemTangent
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.idle_stations import stations_where_needed
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.preparation import channels_at
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import large_deflections
from modalprep.records import Record
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told

LARGEST = 0.3  # step, in scales of the coordinates: a third of a radian, of a body's size
CONVERGED = 1e-12  # step
MAX_STEPS = 200  # at LARGEST, ten revolutions or sixty body sizes
TRIALS = 12  # of one line search
SLACK = 0.8  # fraction of the force along the step that may remain at its end: Crisfield (1991), section 9.2
SOFT = 1e-7  # of the largest stiffness of a joint: lower bound of the scale of a coordinate's stiffness
ROUND_OFF = 1e-15  # of the largest of the forces that balance each other
FLAT = 1e-5  # of the scale of a coordinate's stiffness: below it the stiffness counts as zero
MOVING = 1e-9  # 1/s, rate of a loop's gap over its size, above which the loop moves


@dataclass(frozen=True, eq=False, kw_only=True)
class Equilibrium(Record):
    """A state of rest; ``rest["arm.tip.position"]`` is a channel of it, named as those of a run (see `Result`).

    Positions, forces of springs and what joints carry (``rest["hinge.force"]``, N, ``.torque``, N m) are among them.

    Attributes
    ----------
    system : System
        With prescribed motions held where they are, unless the motion is steady.
    t : float
        s.
    y : (nx + nu,)
        State, speeds zero; `joints` and `modal` have its coordinates by name.
    stable : bool
        Whether the stiffness is positive definite; False also for a neutral equilibrium.
    stiffness : (n, n)
        Derivative of the restoring forces by the independent coordinates.
    independent : (n,) int
        Indices of the independent ones among the nu coordinates; all of them without closed loops.
    joints : dict of (k,)
        Coordinates of each joint (m, rad).
    modal : dict of (n,)
        Modal coordinates of each body.
    closures : dict
        ``name.force`` (N), ``name.torque`` (N m) on b in a's axes, ``name.multiplier``, as channels of a run.
    steps : int
        Newton steps.
    notes : tuple of str
        Bodies that deflect by more than a tenth of their size, where the theory and `stable` are not valid.
    """

    system: System
    t: float
    y: np.ndarray
    stable: bool
    stiffness: np.ndarray
    independent: np.ndarray
    joints: dict[str, np.ndarray]
    modal: dict[str, np.ndarray]
    closures: dict[str, np.ndarray]
    steps: int
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a channel of this state, or one component of it by a trailing ``.x``, ``.y``, ``.z`` or ``.<number>``.

        Returns
        -------
        float or (k,) float
            In the unit of the channel.
        """
        return self._channels[name][0]

    @cached_property
    def _channels(self) -> Result:
        return channels_at(self.system, self.y, self.t)


@told
@stations_where_needed(lambda rest, name: rest.modal[name][None])
def static_equilibrium(system: System, *, t: float = 0.0, steady: bool = False) -> Equilibrium:
    """Return the static equilibrium of a system under its loads at time t, with zero speeds and accelerations.

    Newton's method starts from the start values of the joints and solves the inverse dynamics, in which no mass enters,
    in independent coordinates that are chosen again at each step. Where the stiffness is not positive definite it is
    shifted until the step follows the force, so that the search leaves unstable equilibria. The line search limits the
    force against the step at its end.

    Parameters
    ----------
    t : float
        s, at which functions of time are taken.
    steady : bool
        Whether prescribed hinges move at their rate: equilibrium relative to a steady motion. Otherwise they are fixed.

    Returns
    -------
    Equilibrium
        The state, whether it is stable, and its coordinates by name.

    Raises
    ------
    SimulationError
        When no equilibrium is found; the message names the joint. When closed loops move in the steady motion.
    InputError
        When a loop cannot be closed.

    References
    ----------
    Theory 5.6.
    J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., Springer 2006, chapters 3 and 11.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> from modalprep.multibody.model.joint import Joint
    >>> ends = {"root": np.zeros(3)}
    >>> bob = rigid_body("bob", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3), interfaces=ends)
    >>> spring = HingeElement(stiffness=20.0)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="bob", elements=spring)
    >>> rest = static_equilibrium(System(bodies={"bob": bob}, joints=(hinge,), gravity=np.array([0, -10.0, 0])))
    >>> angle = rest.joints["hinge"][0]
    >>> round(float(20 * angle + 10 * np.cos(angle)), 12)
    0.0
    """
    refuse_other("static_equilibrium: the system", System, system)
    evaluator = Evaluator(system, t)
    y = evaluator.start.copy()
    y[evaluator.nx :] = 0.0
    _refuse_moving_loops(evaluator, y, steady)
    steps = 0
    while True:
        state = _State(Chart(evaluator, y), steady)
        g = state.force(np.zeros(state.n))
        K, K_error = state.stiffness()
        g[np.abs(g) <= ROUND_OFF * state.largest_force(g)] = 0.0
        step, lowest = _step(state, K, K_error, g)
        y = state.y(_length(state, step, g) * step)
        if np.abs(step).max(initial=0.0) <= CONVERGED:
            return _equilibrium(state, K / np.outer(state.scale, state.scale), lowest > 0, steps)
        steps += 1
        if steps == MAX_STEPS:
            raise SimulationError(_no_balance(state, g))


class _State:
    """A static state and its neighbours, by scaled changes ``z (n,)`` of the independent coordinates."""

    def __init__(self, chart: Chart, steady: bool) -> None:
        self.chart, self.evaluator, self.steady = chart, chart.evaluator, steady
        self.scale = chart.evaluator.scale[chart.independent]
        self.n = len(chart.independent)

    def y(self, z: np.ndarray) -> np.ndarray:
        return self.chart.moved(self.scale * z)

    def force(self, z: np.ndarray) -> np.ndarray:
        """Generalised forces of the independent coordinates, times their scales."""
        y = self.y(z)
        return -self.scale * (self.chart.tangent(y).T @ self.required(y))

    def stiffness(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of the restoring forces (n, n) and its round-off, in the scales."""
        exact = SystemTangent(self.chart, np.zeros(self.evaluator.nu), moving=self.steady)
        found = exact.equations(np.zeros((self.n, self.n)))
        scales = np.outer(self.scale, self.scale)
        return found.K * scales, found.errors.K * scales

    def largest_force(self, g: np.ndarray) -> float:
        """Largest of the forces that balance each other, times their scales: those of deflected modes, and the rest."""
        evaluator = self.evaluator
        found = np.abs(g).max(initial=0.0)
        for name, body in evaluator.system.bodies.items():
            own = [k for k, owner in enumerate(evaluator.owner) if owner == ("body", name)]
            q = self.chart.y[evaluator.coordinates("body", name)]
            found = max(found, np.abs(body.K * q * evaluator.scale[own]).max(initial=0.0))
        return float(found)

    def own_stiffness(self, K: np.ndarray, K_error: np.ndarray) -> np.ndarray:
        """Diagonal of the stiffness ``K (n, n)``, positive: at least a fraction of that of the joints."""
        joints = [self.evaluator.owner[k][0] == "joint" for k in self.chart.independent]
        largest = np.abs(K[joints]).max(initial=0.0)
        if largest <= K_error[joints].max(initial=0.0):
            largest = np.abs(K).max() or 1.0
        return np.maximum(np.abs(np.diag(K)), SOFT * largest)

    def required(self, y: np.ndarray) -> np.ndarray:
        return self.evaluator.required(y, np.zeros(self.evaluator.nu), moving=self.steady)


def _refuse_moving_loops(evaluator: Evaluator, y: np.ndarray, steady: bool) -> None:
    """Refuse closed loops that a steady motion deforms: only prescribed hinges may move."""
    if evaluator.loops and steady:
        rate = np.abs(evaluator.gaps(y)[1])
        if rate.max() > MOVING:
            name = evaluator.system.closures[evaluator.loops.closing.rows[int(np.argmax(rate))].closure].name
            raise SimulationError(
                f"no steady motion: the prescribed motions move the loop that {name!r} closes; use steady = False"
            )


def _step(state: _State, K: np.ndarray, K_error: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the step, and the lowest eigenvalue of the scaled stiffness, zero where it is round-off.

    The stiffness is scaled by its diagonal, because that of modes exceeds that of a pendulum by many orders.
    """
    if not len(g):
        return g, 1.0
    d = np.sqrt(state.own_stiffness(K, K_error))
    g = g / d
    K = K / np.outer(d, d)
    lowest = float(np.linalg.eigvalsh((K + K.T) / 2)[0])
    lowest = 0.0 if abs(lowest) <= FLAT else lowest
    shift = 0.0 if lowest > 0 else FLAT - lowest + np.linalg.norm(g)
    step = np.linalg.solve(K + shift * np.eye(len(g)), g) / d
    return step * min(1.0, LARGEST / max(np.abs(step).max(), LARGEST)), lowest


def _length(state: _State, step: np.ndarray, g: np.ndarray) -> float:
    """Return the fraction of the step at whose end the opposing force is at most `SLACK` of the initial force.

    The loops must close there.
    """
    length, closed = 1.0, False
    for _ in range(TRIALS):
        try:
            closed = True
            if state.force(length * step) @ step >= -SLACK * abs(g @ step):
                break
        except SimulationError:
            closed = False
        length /= 2
    return length if closed else 0.0


def _equilibrium(state: _State, stiffness: np.ndarray, stable: bool, steps: int) -> Equilibrium:
    y, evaluator = state.chart.y, state.evaluator
    modal = {name: y[evaluator.coordinates("body", name)] for name in evaluator.system.bodies}
    deflected = {name: q[None] for name, q in modal.items()}
    return Equilibrium(
        system=evaluator.system if state.steady else _with_hinges_fixed(evaluator.system, evaluator.t),
        t=evaluator.t,
        y=y,
        stable=stable,
        stiffness=stiffness,
        independent=state.chart.independent,
        joints={joint.name: y[evaluator.coordinates("joint", joint.name)] for joint in evaluator.system.joints},
        modal=modal,
        closures=evaluator.exerted(y, state.required(y)),
        steps=steps,
        notes=large_deflections(evaluator.system.bodies, np.array([evaluator.t]), deflected),
    )


def _with_hinges_fixed(system: System, t: float) -> System:
    """Return the system with prescribed motions held where they are at time t."""
    held = {j.name: tuple(TimeFunction(law(t)[0]) for law in j.motions) for j in system.joints if j.motions}
    return system.with_(joints=tuple(j.with_(motion=held[j.name]) if j.motions else j for j in system.joints))


def _no_balance(state: _State, g: np.ndarray) -> str:
    owner = [state.evaluator.owner[k] for k in state.chart.independent]
    moves = np.array([kind == "joint" for kind, _ in owner])
    worst = int(np.argmax(np.abs(g) * (moves if moves.any() else 1)))
    kind, name = owner[worst]
    unit = "N m" if state.evaluator.turns[state.chart.independent[worst]] else "N"
    left = f"{abs(g[worst] / state.scale[worst]):.3g} {unit}" if kind == "joint" else "modal force"
    return (
        f"no static equilibrium: residual of {left} in {kind} {name!r} after {MAX_STEPS} steps; "
        "constrain it by a spring, a weld or a prescribed motion"
    )
