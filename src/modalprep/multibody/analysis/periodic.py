"""The motion that repeats itself under loads and prescribed motions that do: Fourier collocation of the equations.

Unknown are the coordinates at equal steps of a period. Their derivatives are those of the trigonometric polynomial
through them, so that no vibration is followed in time, however fast: what remains is the forced motion alone.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import scipy

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.linearise import transport
from modalprep.multibody.analysis.tangent import SystemTangent
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.joint_types import KINDS, JointKind
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Link
from modalprep.multibody.packing.tree import pack

SAMPLES = (15, 31, 63, 127, 255)  # of a period, odd: as many sines as cosines
MOST_UNKNOWNS = 6000  # whose matrix takes 288 MB
LARGEST = 0.3  # step, in scales of the coordinates
MAX_STEPS = 40
CONVERGED = 1e-11  # step
STALLED = 1e-9  # step that no longer shrinks: round-off
SLOW = 0.2  # reduction of a step, above which the matrix is renewed
REMAINS = 1e-9  # of what no step cancels
NEUTRAL = 1e-10  # of the largest: what the equations do not determine remains as it is
TAIL = 1e-8  # of the largest harmonic of a body or joint: the upper third of all is below it
REPEATS = 1e-9  # step, by which loads may differ a period later
ROUND_OFF = 1e-12  # of the scale of a coordinate
CONSTANT = 1e-12  # of a rate
SOME_TIMES = (0.0, 0.1234, 0.7071)  # s, at which rates are compared
TURN = 2 * np.pi


def period_of(system: System) -> float:
    """Return the period (s) of a turn of the slowest joint that turns at a constant rate.

    Raises
    ------
    InputError
        When no joint does.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> wheel = rigid_body("wheel", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> axle = Joint(name="axle", type="revolute", parent="ground", child="wheel", rate=2 * np.pi)
    >>> period_of(System(bodies={"wheel": wheel}, joints=(axle,)))
    1.0
    """
    packed = pack(system)
    kinds = enumerate(zip(packed.links, packed.types, strict=True))
    rates = [_rate(link, KINDS[kind]) for i, (link, kind) in kinds if packed.turns(i) or KINDS[kind].quaternion >= 0]
    if not any(rates):
        raise InputError("start = 'periodic': no joint turns at a constant rate; give the period")
    return TURN / min(rate for rate in rates if rate)


def _rate(link: Link, kind: JointKind) -> float:
    """Return the constant rate of a turn, without sign; zero of another."""
    joint = link.joint
    if kind.quaternion >= 0:
        return float(np.linalg.norm(joint.angular_velocity))
    if joint.motions:
        rates = [joint.motions[link.hinge](t)[1] for t in SOME_TIMES]
        return abs(float(rates[0])) if np.ptp(rates) <= CONSTANT * abs(rates[0]) else 0.0
    return abs(float(np.resize(joint.rate, 3)[link.hinge])) if kind.named else 0.0


def periodic_state(system: System, period: float | None = None) -> np.ndarray:
    """Return the state at t = 0 of the motion that repeats itself after a period.

    Newton's method starts from the motion of the joints at their start rates, loops closed, modes at rest.

    Parameters
    ----------
    period : float or None
        s, after which all loads and prescribed motions repeat, but for whole turns; default: `period_of`.

    Returns
    -------
    (nx + nu,)

    Raises
    ------
    InputError
        When loads or motions do not repeat, or no period is known.
    SimulationError
        When no such motion is found.

    References
    ----------
    M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019, chapter 2.
    L. N. Trefethen, Spectral Methods in MATLAB, SIAM 2000, chapter 3.
    Theory 5.6.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.time_function import TimeFunction
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", motion=TimeFunction("2*t"))
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    >>> y = periodic_state(arm)  # gravity turns about the arm
    >>> bool(np.all(y != 0))
    True
    """
    T = period_of(system) if period is None else period
    evaluator = Evaluator(system, until=2 * T)
    motion = _first(evaluator, T)
    motion.refuse_other_loads()
    for samples in SAMPLES:
        motion = motion.with_samples(samples)
        motion.solve()
        if motion.is_resolved():
            return motion.states()[0]
    raise SimulationError(
        f"no periodic motion: {SAMPLES[-1]} samples do not resolve a period of {T:g} s; loads or motions have kinks or "
        "jumps; use start = 'quasi_static'"
    )


def _first(evaluator: Evaluator, T: float) -> _Motion:
    """Return the motion of the start rates, loops closed."""
    count = SAMPLES[0]
    path = [evaluator.start]
    for k in range(1, count + 1):
        ahead = evaluator.moved(path[-1], path[-1][evaluator.nx :] * T / count)
        evaluator.set_time(k * T / count)
        path.append(evaluator.closed(ahead))
    x = np.array(path)[:, : evaluator.nx]
    flips = np.zeros(evaluator.nx, dtype=bool)
    for q in evaluator.packed.quaternions:
        flips[q] = x[0, q] @ x[-1, q] < 0
    turns = np.zeros(evaluator.nx)
    for i, (kind, first, *_) in enumerate(evaluator.packed.columns):
        if KINDS[kind].named and evaluator.packed.turns(i):
            turns[first] = TURN * np.round((x[-1, first] - x[0, first]) / TURN)
    return _Motion(evaluator, T, turns, flips, x[:-1])


def _waves(phase: np.ndarray, count: int, flips: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return cosines and sines ``(n, count)`` at phases (n,), and their derivatives, of what is periodic, or `flips`.

    That is what changes its sign after a period: its waves have half a turn more.
    """
    k = np.arange(count // 2 + 1) + 0.5 * flips
    c = np.cos(np.outer(phase, k))
    s = np.sin(np.outer(phase, k))
    own = slice(-1) if flips else slice(1, None)
    return np.hstack([c, s[:, own]]), np.hstack([-k * s, (k * c)[:, own]])


class _Motion:
    """The coordinates ``x (N, nx)`` at equal steps of a period.

    They are periodic but for `turns` (nx,) of joints, and for quaternions whose sign `flips` (nx,).
    """

    def __init__(self, evaluator: Evaluator, T: float, turns: np.ndarray, flips: np.ndarray, x: np.ndarray) -> None:
        self.evaluator, self.T, self.x = evaluator, T, x
        self.turns, self.flips = turns, flips
        self.count = len(x)
        self.share = np.arange(self.count) / self.count
        self.rate = self._between(self.share, flips=False)[1]  # derivatives by time of what is periodic
        self.kept = evaluator.kept_rows(evaluator.start)
        self.step: Callable[[np.ndarray], tuple[np.ndarray, float]] | None = None
        if self.count * (evaluator.nu + len(self.kept)) > MOST_UNKNOWNS:
            raise SimulationError(
                f"no periodic motion: a period of {T:g} s needs {self.count} samples of {evaluator.nu} coordinates, "
                f"more than {MOST_UNKNOWNS} in all; keep fewer modes"
            )

    @property
    def wave(self) -> np.ndarray:
        """The coordinates without the turns (N, nx)."""
        return self.x - np.outer(self.share, self.turns)

    def _between(self, share: np.ndarray, flips: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return what gives values and derivatives at shares (n,) of the period from those at the samples (n, N)."""
        inverse = np.linalg.inv(_waves(TURN * self.share, self.count, flips)[0])
        waves, slopes = _waves(TURN * share, self.count, flips)
        return waves @ inverse, TURN / self.T * slopes @ inverse

    def _course(self, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the coordinates at shares (n,) of the period, and their rates, (n, nx)."""
        values, rates = self._between(share, flips=False)
        x = values @ self.wave + np.outer(share, self.turns)
        xdot = rates @ self.wave + self.turns / self.T
        values, rates = self._between(share, flips=True)
        x[:, self.flips] = values @ self.x[:, self.flips]
        xdot[:, self.flips] = rates @ self.x[:, self.flips]
        return x, xdot

    def with_samples(self, count: int) -> _Motion:
        """Return the motion by another number of samples."""
        x = self._course(np.arange(count) / count)[0]
        for q in self.evaluator.packed.quaternions:
            x[:, q] /= np.linalg.norm(x[:, q], axis=1)[:, None]
        return _Motion(self.evaluator, self.T, self.turns, self.flips, x)

    def states(self) -> np.ndarray:
        """Return coordinates and speeds (N, nx + nu)."""
        rates = self._course(self.share)[1]
        return np.array([self._with_speeds(x, rate) for x, rate in zip(self.x, rates, strict=True)])

    def _with_speeds(self, x: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the state whose coordinates have a rate (nx,)."""
        nx, nu = self.evaluator.nx, self.evaluator.nu
        columns = np.zeros((nu, nx + nu))
        for unit, column in zip(np.eye(nu), columns, strict=True):
            self.evaluator.rates(np.append(x, unit), column)
        return np.append(x, np.linalg.lstsq(columns[:, :nx].T, rate)[0])

    def solve(self) -> None:
        """Solve the equations at all samples by Newton's method; the matrix is renewed where steps shrink slowly."""
        evaluator = self.evaluator
        before = size = np.inf
        for _ in range(MAX_STEPS):
            y = self.states()
            udot = self.rate @ y[:, evaluator.nx :]
            if self.step is None:
                self.step = self._steps(y, udot)
            step, remains = self.step(self._left(y, udot))
            size = np.abs(step).max(initial=0.0)
            step *= evaluator.scale * min(1.0, LARGEST / max(size, LARGEST))
            self.x = np.array([evaluator.moved(*each)[: evaluator.nx] for each in zip(y, step, strict=True)])
            if size <= CONVERGED or (size <= STALLED and size >= 0.5 * before):
                if remains <= REMAINS:
                    return
                break
            if size > SLOW * before:
                self.step = None
            before = size
        raise SimulationError(
            f"no motion with a period of {self.T:g} s was found: the loads are in resonance with a vibration that "
            "nothing damps, or the start values are too far from it; change the rate, or add damping"
        )

    def _forces(self, y: np.ndarray, udot: np.ndarray) -> np.ndarray:
        """Return what accelerations need beyond loads and closures (nu,), with the best multipliers."""
        required = self.evaluator.required(y, udot)
        G = self.evaluator.jacobian(y)[self.kept]
        return self.evaluator.scale * (required - G.T @ np.linalg.lstsq(G.T, required)[0])

    def _left(self, y: np.ndarray, udot: np.ndarray, later: int = 0) -> np.ndarray:
        """Return the scaled forces and gaps that are left (N, nu + m), at once or so many periods later."""
        found = []
        for share, *state in zip(self.share, y, udot, strict=True):
            self.evaluator.set_time((share + later) * self.T)
            gaps = self.evaluator.gaps(state[0])[0][self.kept] if len(self.kept) else []
            found.append(np.append(self._forces(*state), gaps))
        return np.array(found)

    def _steps(self, y: np.ndarray, udot: np.ndarray) -> Callable[[np.ndarray], tuple[np.ndarray, float]]:
        """Return the function that gives the scaled step (N, nu) against what is left, and what no step cancels."""
        N, nu = self.count, self.evaluator.nu
        n = nu + len(self.kept)
        J = np.zeros((N, n, N, n))
        for k in range(N):
            self.evaluator.set_time(self.share[k] * self.T)
            self._fill(J[k].transpose(1, 0, 2), k, y[k], udot[k])
        J = J.reshape(N * n, N * n)
        rows = np.maximum(np.abs(J).max(axis=1), np.finfo(float).tiny)
        J /= rows[:, None]
        columns = np.maximum(np.abs(J).max(axis=0), np.finfo(float).tiny)
        J /= columns
        solve = _solver(J)

        def step(left: np.ndarray) -> tuple[np.ndarray, float]:
            scaled = -left.ravel() / rows
            found = solve(scaled)
            return (found / columns).reshape(N, n)[:, :nu], float(np.abs(J @ found - scaled).max(initial=0.0))

        return step

    def _fill(self, J: np.ndarray, k: int, y: np.ndarray, udot: np.ndarray) -> None:
        """Write the derivatives of what is left at sample k by coordinates and multipliers of all, ``J (N, n, n)``."""
        evaluator, scale, nu = self.evaluator, self.evaluator.scale, self.evaluator.nu
        places, speeds, mass = self._derivatives(y, udot)
        own = self.rate[k][:, None, None]
        J[:, :nu, :nu] = own * speeds + (self.rate[k] @ self.rate)[:, None, None] * mass
        J[k, :nu, :nu] += places
        if evaluator.packed.quaternions:  # axes that turn carry small changes along
            carry = transport(evaluator, y) * scale / scale[:, None]
            J[:, :nu, :nu] -= own * (mass @ carry)
            J[k, :nu, :nu] -= speeds @ carry
        G = evaluator.jacobian(y)[self.kept] * scale
        J[k, :nu, nu:] = -G.T
        J[k, nu:, :nu] = G

    def _derivatives(self, y: np.ndarray, udot: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return those of the scaled forces by scaled coordinates, speeds and accelerations (nu, nu)."""
        evaluator, scale, nu = self.evaluator, self.evaluator.scale, self.evaluator.nu
        exact = SystemTangent(Chart(evaluator, y), udot)
        called = 0.0 if exact.called is None else exact.called[0][:, nu:]
        scales = np.outer(scale, scale)
        return exact.K * scales, (exact.found.D - called) * scales, exact.found.M * scales

    def is_resolved(self) -> bool:
        """Whether the harmonics of every joint and body end."""
        waves = np.where(self.flips, 0.0, self.wave)  # what turns a body with such a quaternion is smooth by itself
        size = np.abs(np.fft.rfft(waves, axis=0))
        scale = dict(zip(self.evaluator.owner, self.evaluator.scale, strict=True))
        for owner, least in scale.items():
            own = size[:, self.evaluator.coordinates(*owner)]
            if own[self.count // 3 :].max() > TAIL * own.max() + ROUND_OFF * self.count * least:
                return False
        return True

    def refuse_other_loads(self) -> None:
        """Refuse loads and motions that are others a period later."""
        y = self.states()
        udot = self.rate @ y[:, self.evaluator.nx :]
        later = y + np.append(self.turns, np.zeros(self.evaluator.nu))
        change, _ = self._steps(y, udot)(self._left(later, udot, 1) - self._left(y, udot))
        if np.abs(change).max(initial=0.0) > REPEATS:
            raise InputError(
                f"start = 'periodic': loads or prescribed motions do not repeat after {self.T:g} s; give their period"
            )


def _solver(J: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function that solves with a matrix; the shortest solution where it is singular."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scipy.linalg.LinAlgWarning)
        factor = scipy.linalg.lu_factor(J)
    if scipy.linalg.lapack.dgecon(factor[0], np.abs(J).sum(axis=0).max())[0] > NEUTRAL:
        return lambda b: scipy.linalg.lu_solve(factor, b)
    return lambda b: scipy.linalg.lstsq(J, b, cond=NEUTRAL, lapack_driver="gelsy")[0]
