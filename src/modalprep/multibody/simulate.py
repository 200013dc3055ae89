"""Integrate a system in time with the order-n kernel, and audit the run by its energy balance."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.integrate import DOP853, Radau

from modalprep.errors import InputError, SimulationError
from modalprep.multibody import kernel
from modalprep.multibody.dense import dense_accelerations, mass_and_force
from modalprep.multibody.layout import COORDINATES, FREE, REVOLUTE, SPEEDS, coordinate_count, pack
from modalprep.multibody.record import Recorder
from modalprep.multibody.result import Result
from modalprep.multibody.system import System

MOST_OUTPUTS = 1e7
METHODS = ("auto", "explicit", "implicit")
EXPLICIT_STEPS = 30_000  # more than these, and the implicit method is quicker for any tolerance above 1e-9
STABLE = 6.0  # DOP853 stays stable to h omega of about 6 on the imaginary axis
NEARLY_SINGULAR = 1e-5  # of the scaled mass matrix: accelerations are then 1e5 times too large
DIVERGED = 100.0  # body sizes of deflection: far beyond the validity of a modal body


def simulate(
    system: System,
    *,
    t_end: float,
    output_step: float = 0.01,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    method: str = "auto",
    dense: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Integrate from the joints' start values, modes at rest, to `t_end`.

    Explicit Runge-Kutta of order 8 (DOP853), or implicit of order 5 (Radau IIA) where stiff modes would hold the
    explicit one to more than 30 000 steps; step control on the whole state, restarted where a prescribed motion
    changes its piece. The work of prescribed hinges less the damping's dissipation is integrated along,
    so that ``energy.error`` is a check of the whole run.

    Parameters
    ----------
    t_end, output_step : float
        s.
    rtol, atol : float
        Relative and absolute tolerance of coordinates and speeds.
    method : {"auto", "explicit", "implicit"}
    dense : bool
        Use the dense twin of the kernel: slow, for comparison.
    progress : callable
        Called with the time after every step.

    Returns
    -------
    Result
        ``status = "diverged"`` when a deflection exceeded 100 body sizes; the histories end there.

    Raises
    ------
    InputError
        When a time or tolerance is not positive.
    SimulationError
        When the step size collapses; the sentence names time and body.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.system import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    >>> run = simulate(arm, t_end=0.1)
    >>> bool(run["hinge.angle"][-1] < 0), run.stats["energy_error"] < 1e-8
    (True, True)
    """
    for name, value in (("t_end", t_end), ("output_step", output_step), ("rtol", rtol), ("atol", atol)):
        if not 0 < value < float("inf"):
            raise InputError(f"simulation {name} = {value:g} must be positive")
    if not t_end / output_step <= MOST_OUTPUTS:
        raise InputError(
            f"simulation t_end = {t_end:g} with output_step = {output_step:g} asks for more than {MOST_OUTPUTS:.0e} "
            "output times; lower t_end or raise output_step"
        )
    if method not in METHODS:
        raise InputError(f"simulation method {method!r} is not one of {', '.join(METHODS)}")
    run = _Run(system, dense)
    recorder = Recorder(system, run)
    start = run.solver(method, t_end, rtol, atol)
    times = np.linspace(0.0, t_end, max(2, round(t_end / output_step) + 1))
    status, message = "done", f"reached t = {t_end:g} s"
    y, done = run.start(), 0
    if not np.all(np.isfinite(run.derivative(0.0, y))):
        raise SimulationError(run.failure(0.0, y))
    for begin, end in run.segments(t_end):
        y, done, message_of_end = _segment(run, recorder, start(begin, y, end), times, done, progress)
        if message_of_end:
            status, message = "diverged", message_of_end
            break
    return recorder.result(times[:done], status, f"{message} ({run.method})", run.stats)


def start_channels(system: System) -> Result:
    """Return every channel at the start only: which names a run will have, before it runs."""
    run = _Run(system, dense=False)
    recorder = Recorder(system, run)
    recorder.add(0.0, run.start())
    return recorder.result(np.zeros(1), "start", "", run.stats)


def _segment(run, recorder, solver, times, done, progress):
    """Integrate one smooth piece; record the output times it passes."""
    while solver.status == "running":
        try:
            problem = solver.step()
        except ValueError:  # LAPACK met a NaN of the Jacobian
            problem = "NaN"
        if problem or not np.all(np.isfinite(solver.y)):
            raise SimulationError(run.failure(solver.t, solver.y))
        run.stats["steps"] += 1
        sample = None
        while done < len(times) and times[done] <= solver.t * (1 + 1e-14):
            sample = sample or solver.dense_output()
            recorder.add(times[done], sample(times[done]))
            done += 1
        if progress:
            progress(solver.t)
        diverged = run.diverged(solver.t, solver.y)
        if diverged:
            return solver.y, done, diverged
    return solver.y, done, ""


class _Run:
    """A packed system, its scratch and counters."""

    def __init__(self, system: System, dense: bool) -> None:
        self.system = system
        self.tree, self.bodies = pack(system)
        self.work = kernel.workspace(self.tree, self.bodies)
        self.joints = [system.carrier(name) for name in system.order]
        self.nx = coordinate_count(self.tree)
        self.nu = int(self.nx - np.sum(self.tree.joint == FREE))
        self.torque = np.zeros(len(self.joints))
        self.status = np.zeros(1, dtype=np.int64)
        self.dense = dense
        self.stats = {"evaluations": 0.0, "steps": 0.0}
        ranges = [np.abs(system.bodies[name].shape).max(axis=(0, 1), initial=0.0) for name in system.order]
        sizes = [max(np.ptp(system.bodies[name].points, axis=0).max(initial=0.0), 1e-12) for name in system.order]
        self.per_size = [r / size for r, size in zip(ranges, sizes, strict=True)]

    def segments(self, t_end: float) -> list[tuple[float, float]]:
        """Pieces of [0, t_end] in which every prescribed motion is smooth."""
        breaks = {b for joint in self.joints if joint.motion for b in joint.motion.breaks if 0 < b < t_end}
        edges = [0.0, *sorted(breaks), t_end]
        return list(pairwise(edges))

    def solver(self, method: str, t_end: float, rtol: float, atol: float) -> Callable:
        """Return ``(t, y, t_bound) -> solver`` of the method asked for, or of the quicker one."""
        top = max((np.sqrt(body.K.max(initial=0.0)) for body in self.system.bodies.values()), default=0.0)
        steps = top * t_end / STABLE
        if method == "auto":
            method = "explicit" if steps < EXPLICIT_STEPS else "implicit"
        self.method = {"explicit": "explicit, DOP853", "implicit": "implicit, Radau IIA"}[method]
        if method == "explicit":
            return lambda t, y, t_bound: DOP853(self.derivative, t, y, t_bound, rtol=rtol, atol=atol)
        return lambda t, y, t_bound: Radau(self.derivative, t, y, t_bound, rtol=rtol, atol=atol, jac=self.jacobian)

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        """Forward differences of the derivative; the work, last, drives nothing."""
        base = self.derivative(t, y)
        J = np.zeros((len(y), len(y)))
        for k in range(len(y) - 1):
            step = 1e-8 * max(1e-3, abs(y[k]))
            moved = y.copy()
            moved[k] += step
            J[:, k] = (self.derivative(t, moved) - base) / (moved[k] - y[k])
        return J

    def motion(self, t: float) -> np.ndarray:
        """Angle, rate and acceleration of the prescribed hinges (nb, 3)."""
        rows = [joint.motion(t) if joint.motion else (0.0, 0.0, 0.0) for joint in self.joints]
        return np.array(rows)

    def start(self) -> np.ndarray:
        """Joint coordinates and speeds as the joints say, modes at rest, no work done."""
        y = np.zeros(self.nx + self.nu + 1)
        for joint, kind, x, u in zip(self.joints, self.tree.joint, self.tree.x, self.tree.u, strict=True):
            if kind == REVOLUTE:
                y[x], y[self.nx + u] = joint.angle, joint.rate
            elif kind == FREE:
                from scipy.spatial.transform import Rotation

                y[x : x + 3] = joint.position
                y[x + 3 : x + 7] = Rotation.from_matrix(joint.rotation).as_quat(scalar_first=True)
                y[self.nx + u : self.nx + u + 6] = np.concatenate([joint.velocity, joint.spin])
        return y

    def derivative(self, t: float, y: np.ndarray) -> np.ndarray:
        """Time derivative of [coordinates | speeds | work]; NaN where the mass matrix is not positive."""
        self.stats["evaluations"] += 1
        motion = self.motion(t)
        ydot = np.zeros(len(y))
        kernel.derivative(self.tree, self.bodies, y[:-1], motion, self.work, self.torque, self.status, ydot[:-1])
        if self.status[0] >= 0:
            return np.full(len(y), np.nan)
        if self.dense:
            ydot[self.nx : -1] = dense_accelerations(self.system, y[:-1], motion)
        ydot[-1] = self.torque @ motion[:, 1] - self.dissipation(y)
        return ydot

    def dissipation(self, y: np.ndarray) -> float:
        """Power lost in modal damping, W."""
        lost = 0.0
        for i, joint in enumerate(self.tree.joint):
            u = self.nx + self.tree.u[i] + SPEEDS[joint]
            qd = y[u : u + self.tree.n[i]]
            lost += qd @ (self.bodies.D[self.tree.kind[i], : len(qd)] * qd)
        return lost

    def modal(self, i: int, y: np.ndarray) -> np.ndarray:
        """Modal coordinates of body i."""
        x = self.tree.x[i] + COORDINATES[self.tree.joint[i]]
        return y[x : x + self.tree.n[i]]

    def diverged(self, t: float, y: np.ndarray) -> str:
        """Return a sentence when a body's deflection is beyond all meaning, else nothing."""
        for i, name in enumerate(self.system.order):
            sizes = np.abs(self.modal(i, y)) @ self.per_size[i]
            if sizes > DIVERGED:
                why = "" if self.system.bodies[name].has_geometric_stiffness else " without geometric stiffness"
                return f"diverged at t = {t:.4g} s: body {name!r} deflects by {sizes:.0f} times its size{why}"
        return ""

    def failure(self, t: float, y: np.ndarray) -> str:
        """Say when and where the integration stopped."""
        worst = max(range(len(self.joints)), key=lambda i: np.abs(self.modal(i, y)).max(initial=0.0))
        if self.status[0] >= 0 or self._nearly_singular(t, y):
            name = self.system.order[int(self.status[0]) if self.status[0] >= 0 else worst]
            return (
                f"simulation stopped at t = {t:.6g} s: the mass matrix of body {name!r} is no longer positive, "
                "its deflection is too large for its modes; keep fewer modes, leave out the inertia "
                "truncation vectors, or cut the body into smaller ones"
            )
        return (
            f"simulation stopped at t = {t:.6g} s: the step size collapsed, body {self.system.order[worst]!r} moves "
            "fastest; drop its highest modes or loosen rtol"
        )

    def _nearly_singular(self, t: float, y: np.ndarray) -> bool:
        M, _ = mass_and_force(self.system, y[:-1], self.motion(t))
        scale = 1 / np.sqrt(np.abs(np.diag(M)))
        return not np.linalg.eigvalsh(M * scale * scale[:, None])[0] > NEARLY_SINGULAR
