"""Linear equations about a state or a steady motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.accelerations import Accelerations
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.inputs_outputs import Input, Output, input_of, output
from modalprep.multibody.analysis.state_space import StateSpace
from modalprep.multibody.analysis.tangent import (
    ADVICE,
    PLACE_STEP,
    SPEED_STEP,
    GivenAccelerations,
    SystemTangent,
    nothing,
)
from modalprep.multibody.evaluation.evaluator import Evaluator, evaluator_at
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.loads import Callback
from modalprep.multibody.model.system import System
from modalprep.suggest import refuse_other
from modalprep.vectors import skew

WORST = 1e-6  # relative error of a derivative, above which there is no answer


def linearise(
    system: System,
    y: np.ndarray | None = None,
    t: float = 0.0,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
) -> StateSpace:
    """Return the linear equations about a state of a system.

    The kinematic rows are exact. The others are the derivatives of the forces that the accelerations of the state need
    (inverse dynamics), in closed form, solved with the mass matrix: to round-off. Only what callbacks do, and outputs
    that are recovered, are differences with Richardson extrapolation, accurate to about 1e-11 of a column; `notes` name
    them, and `StateSpace.error` estimates the error of each case.

    Parameters
    ----------
    y : (nx + nu,)
        State, such as `static_equilibrium(system).y`; default: the start of the joints. Loops that it leaves open
        are closed.
    t : float
        s, at which functions of time are taken; prescribed hinges move as they do then.
    inputs, outputs : sequence of str
        Inputs ``hinge`` or ``hinge.2`` (N or N m in the joint's second speed), ``body.interface.force.x`` (N) and
        ``.torque.z`` (N m), inertial axes. Outputs ``hinge.angle``, ``.rate``, ``.displacement``, ``.speed``
        (``.angle.2`` the second), ``ball.rotation.1``, ``.angular_velocity.1`` (axes of the child), ``body.modal.3``,
        ``.modal_rate.3``, ``body.stress.point.xx``, ``body.recovery.name.place.component``,
        ``body.interface.position.x``, ``.rotation``, ``.velocity``, ``.angular_velocity``, ``.acceleration`` and
        ``.angular_acceleration``, inertial axes.

    Returns
    -------
    StateSpace
        The four matrices in the independent coordinates, with estimates of their errors.

    Raises
    ------
    InputError
        When a name is not known in the system, the state has another size, or a loop cannot be closed.
    SimulationError
        When the mass matrix is not positive, closed loops are in a singular position, or the estimated error is above
        1e-6.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, section 9.4 (independent coordinates of closed loops);
    theory 5.6 and 5.8.
    R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, chapter 2 (spatial vectors).
    L. F. Richardson, The deferred approach to the limit, Phil. Trans. R. Soc. A 226 (1927) 299.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> from modalprep.multibody.model.joint import Joint
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=2 * np.eye(3), interfaces={"root": np.zeros(3)})
    >>> spring = HingeElement(stiffness=18.0, damping=0.4)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="disc", elements=spring)
    >>> linear = linearise(System(bodies={"disc": disc}, joints=(hinge,)), inputs=["hinge"], outputs=["hinge.angle"])
    >>> linear.A.round(9).tolist(), linear.B.round(9).tolist(), linear.C.tolist()
    ([[0.0, 1.0], [-9.0, -0.2]], [[0.0], [0.5]], [[1.0, 0.0]])
    """
    refuse_other("linearise: the system", System, system)
    with evaluator_at(system, t) as evaluator:
        return _linearised(evaluator, y, inputs, outputs)


def _linearised(
    evaluator: Evaluator, y: np.ndarray | None, inputs: Sequence[str], outputs: Sequence[str]
) -> StateSpace:
    y = evaluator.start if y is None else np.array(y, dtype=float)
    if y.shape != (evaluator.nx + evaluator.nu,) or not np.all(np.isfinite(y)):
        raise InputError(f"the state needs {evaluator.nx + evaluator.nu} finite numbers; it has {y.size}")
    chart = Chart(evaluator, y := evaluator.closed(y))
    applied = [input_of(evaluator, name) for name in inputs]
    read = [output(evaluator, name) for name in outputs]
    evaluator.load(chart.y)
    udot = evaluator.accelerations(np.zeros(evaluator.nu)).copy()
    exact = SystemTangent(chart, udot)
    equations = exact.equations(_turning(chart))
    found = Accelerations(exact, equations, _input_forces(chart, applied))
    C, D, C_error = _outputs(found, applied, read)
    error = max(found.error, _relative(C_error, C) if read else 0.0)
    if error > WORST:
        raise SimulationError(
            f"cannot linearise: the derivatives are accurate to {error:.0e} of their largest only, which is above "
            f"{WORST:.0e}; {ADVICE}"
        )
    return StateSpace(
        A=found.state,
        B=found.by_input,
        C=C,
        D=D,
        states=_states(chart),
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        owner=evaluator.owner,
        independent=chart.independent,
        R=chart.R,
        y=y,
        udot=udot,
        error=error,
        equations=equations,
        notes=_notes(evaluator.system, [name for name, each in zip(outputs, read, strict=True) if each.value]),
    )


def _states(chart: Chart) -> tuple[str, ...]:
    """Return the names of independent coordinates, then of their speeds."""
    names = chart.evaluator.names
    if not len(chart.dependent):
        return names.coordinates + names.speeds
    return tuple(each[k] for each in names for k in chart.independent.tolist())


def _turning(chart: Chart) -> np.ndarray:
    """Return `transport` of the independent coordinates (n, n)."""
    if not chart.evaluator.packed.quaternions:
        return nothing(2 * chart.independent.shape)
    return (transport(chart.evaluator, chart.y) @ chart.R)[chart.independent]


def _notes(system: System, recovered: Sequence[str]) -> tuple[str, ...]:
    """Return what was found by differences, and what is held constant."""
    called = [f"callback {load.name!r}" for load in system.loads if isinstance(load, Callback)]
    sliding = [closure.name for closure in system.closures if getattr(closure, "friction_coefficient", 0.0)]
    by_differences = called + [f"output {name!r}" for name in recovered]
    notes = []
    if by_differences:
        notes.append(f"by differences, all else exactly: {', '.join(by_differences)}")
    if sliding:
        notes.append(f"friction of closures is taken as constant: {', '.join(map(repr, sliding))}")
    return tuple(notes)


def _input_forces(chart: Chart, applied: Sequence[Input]) -> np.ndarray:
    """Return the generalised forces (n, ni) of unit inputs at the state of a chart."""
    evaluator = chart.evaluator
    still = np.zeros(evaluator.nu)
    forces = np.zeros((evaluator.nu, len(applied)))
    for k, each in enumerate(applied):
        if each.speed >= 0:
            forces[each.speed, k] = 1.0
        else:
            forces[:, k] = -evaluator.required(chart.y, still, push=partial(each.apply, 1.0))
    on_bodies = [k for k, each in enumerate(applied) if each.link >= 0]
    if on_bodies:
        forces[:, on_bodies] += evaluator.required(chart.y, still)[:, None]
    return chart.R.T @ forces if len(chart.dependent) else forces


def _outputs(
    found: Accelerations, applied: Sequence[Input], read: Sequence[Output]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return C, D and the estimated errors of C."""
    n, count = found.B.shape
    if not read:
        return np.zeros((0, 2 * n)), np.zeros((0, count)), np.zeros((0, 2 * n))
    exact, R = found.exact, found.exact.chart.R
    moved = np.hstack([R, np.zeros_like(R)]), np.hstack([exact.speeds_x, R])
    accelerations = np.hstack([exact.accelerations_x, exact.accelerations_u]) + R @ found.A
    C, C_error = np.zeros((2, len(read), 2 * n))
    D, by_own = np.zeros((len(read), count)), np.zeros((len(read), n))
    recovered = [k for k, each in enumerate(read) if each.value is not None]
    for k, each in enumerate(read):
        if each.slopes is not None:
            by_x, by_u, by_udot = each.slopes(exact.tree)
            C[k] = by_x @ moved[0] + by_u @ moved[1] + by_udot @ accelerations
            by_own[k] = by_udot @ R
    if recovered:
        values = [each.value for each in read if each.value is not None]
        C[recovered], by_own[recovered], D[recovered], C_error[recovered] = Recovered(
            exact.chart, exact.tree.udot, applied, values
        ).matrices(count)
        C[recovered] += by_own[recovered] @ found.A
    D += by_own @ found.B
    if np.any(by_own):
        C_error += found.error_of(by_own)
    return C, D, C_error


class Recovered:
    """What is recovered near the state of a chart, as a function of coordinates, speeds, accelerations and inputs."""

    def __init__(self, chart: Chart, udot: np.ndarray, applied: Sequence[Input], read: Sequence[Callable]):
        self.given = GivenAccelerations(chart, udot)
        self.applied, self.read = applied, read

    def values(self, z: np.ndarray) -> np.ndarray:
        """Return the outputs at changes ``[coordinates | speeds | accelerations | inputs]``."""
        chart, evaluator = self.given.chart, self.given.evaluator
        n = len(chart.independent)
        state = chart.moved(z[:n], z[n : 2 * n])
        push = partial(self._push, z[3 * n :])
        force = np.zeros(evaluator.nu)
        force[chart.independent] = self.given.force(state, self.given.own + z[2 * n : 3 * n], push)
        evaluator.load(state)
        world(evaluator.packed.model, evaluator.data)
        tau = push() + force
        evaluator.push_modes(force)
        evaluator.accelerations(tau)
        return np.array([function(state) for function in self.read])

    def _push(self, sizes: np.ndarray) -> np.ndarray:
        tau = np.zeros(self.given.evaluator.nu)
        return sum((each.apply(size) for each, size in zip(self.applied, sizes, strict=True)), tau)

    def matrices(self, count: int) -> tuple[np.ndarray, ...]:
        """Return the derivatives by [coordinates | speeds], accelerations and inputs, and the errors of the first."""
        n = len(self.given.chart.independent)
        scale = self.given.evaluator.scale[self.given.chart.independent]
        steps = np.concatenate([PLACE_STEP * scale, SPEED_STEP * scale, SPEED_STEP * scale, np.ones(count)])
        J, error = jacobian(self._where_valid, steps)
        if not np.all(np.isfinite(error)):
            raise SimulationError("cannot linearise: an output does not exist near this state; use another state")
        return *np.split(J, [2 * n, 3 * n], axis=1), error[:, : 2 * n]

    def _where_valid(self, z: np.ndarray) -> np.ndarray:
        """Return the outputs, NaN where the system cannot be evaluated."""
        try:
            return self.values(z)
        except SimulationError:
            return np.full(len(self.read), np.nan)


def _relative(error: np.ndarray, of: np.ndarray) -> float:
    largest = np.abs(of).max(initial=0.0)
    return float(error.max(initial=0.0) / largest) if largest > 0 else 0.0


def transport(evaluator: Evaluator, y: np.ndarray) -> np.ndarray:
    """Return the rate of small coordinate changes due to the rotation of the body axes (nu, nu).

    With rotation vector x and displacement d in the body's axes ``x' = dw - w~ x``, ``d' = dv - w~ d - v~ x``.
    """
    N = np.zeros((evaluator.nu, evaluator.nu))
    for row, kind in zip(evaluator.packed.model.links, evaluator.packed.types, strict=True):
        if KINDS[kind].quaternion < 0:
            continue
        first = int(row["u"])
        turning = first + KINDS[kind].translations
        rotation = slice(turning, turning + 3)
        spin = y[evaluator.nx + turning : evaluator.nx + turning + 3]
        N[rotation, rotation] = -skew(spin)
        if KINDS[kind].translations:
            translation = slice(first, turning)
            N[translation, translation] = -skew(spin)
            N[translation, rotation] = -skew(y[evaluator.nx + first : evaluator.nx + turning])
    return N
