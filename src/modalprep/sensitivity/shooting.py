"""Drives that bring a system to a state at the end of a run, with the least effort: direct shooting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import minimize

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.linearise import linearise
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.joint_types import SPEEDS
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.multibody.starts import Given
from modalprep.records import Record
from modalprep.sensitivity.course import Course, Options
from modalprep.sensitivity.explicit import ExplicitStep
from modalprep.sensitivity.notes import notes_of
from modalprep.sensitivity.observed import ChannelSlopes
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import told, with_warnings

MET = 1e-6  # what a target may be missed by, over what the drives make of it
UNMOVED = 1e-9  # singular value of the targets by the drives over the largest
STILL = 1e-10  # slope of a target by the drives over the largest of all: round-off
RESTS = 1e-4  # change of the drives over the largest, at which the search ends: of the effort its square
QUADRATIC = 1e-12  # of the linearised problem within bounds


@dataclass(frozen=True, eq=False, kw_only=True)
class Steering(Record):
    """Drives with the least effort that bring a system to its targets.

    Attributes
    ----------
    time : (nk,)
        s, of the points of the drives; straight lines are between them.
    drives : dict of (nk,)
        Forces (N) or torques (N m) at these times, by the name of the joint; zero afterwards.
    effort : float
        The integral of ``sum weight drive^2``.
    reached : dict of float
        Values of the targets at the end of the run.
    system : System
        With the drives.
    runs : int
        Number of runs with derivatives.
    notes : tuple of str
        Those of the last run.
    """

    time: np.ndarray
    drives: dict[str, np.ndarray]
    effort: float
    reached: dict[str, float]
    system: System
    runs: int
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Names of the drives, effort and number of runs."""
        names = ", ".join(self.drives)
        text = f"{names} at {len(self.time)} times, effort {self.effort:.6g}, {self.runs} runs"
        return with_warnings(f"Steering({text})", self.notes)


@told
def steer(
    system: System,
    drives: Sequence[str] | Mapping[str, float],
    targets: Mapping[str, float],
    duration: float,
    *,
    points: int = 21,
    largest: Mapping[str, float] | None = None,
    start: Given = "rest",
    step: float | None = None,
    rtol: float = 1e-6,
    atol: float = 1e-12,
    most_runs: int = 30,
) -> Steering:
    """Return the drives of joints that reach targets at the end of a run with the least integral of their squares.

    Drives are straight lines between equal steps of time. The targets are met by runs of the nonlinear system
    (direct shooting), with the derivatives of those runs; the search begins with the solution of the linearised
    problem.

    Parameters
    ----------
    drives : sequence of str, or {joint: weight}
        Joints of one coordinate that have no drive yet, and the weights of their squares, 1 by default.
    targets : {channel: value}
        At the end, of channels as `run_sensitivities` takes them: ``hinge.angle``, ``hinge.rate``, ``arm.modal.1``,
        ``arm.modal_rate.1``.
    duration : float
        s.
    points : int
        Number of points of each drive, those at start and end included.
    largest : {joint: value}
        Bounds of the drives, N or N m, to both sides.
    start, step, rtol, atol
        As `simulate` has them; the method is the explicit one.
    most_runs : int
        With derivatives.

    Returns
    -------
    Steering
        The drives and the system with them.

    Raises
    ------
    InputError
        When a name is unknown, a joint has a drive or several coordinates, or the drives do not move a target.
    SimulationError
        When the targets are not met, as bounds are too narrow or the search has not converged.

    References
    ----------
    J. T. Betts, Practical Methods for Optimal Control and Estimation Using Nonlinear Programming, 2nd ed., SIAM 2010,
    chapter 3 (shooting).
    A. E. Bryson, Y.-C. Ho, Applied Optimal Control, Hemisphere 1975, section 5.3 (least effort by the Gramian).

    Examples
    --------
    From rest to rest by 1 rad in 1 s, a disc of 1 kg m2 needs the torque 6 - 12 t, whose square has the integral 12.

    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="disc")
    >>> system = System(bodies={"disc": disc}, joints=(hinge,))
    >>> found = steer(system, ["hinge"], {"hinge.angle": 1.0, "hinge.rate": 0.0}, 1.0, points=3)
    >>> (found.drives["hinge"].round(6) + 0.0).tolist(), round(found.effort, 6)
    ([6.0, 0.0, -6.0], 12.0)
    """
    refuse_other("steer: the system", System, system)
    weights = dict(drives) if isinstance(drives, Mapping) else dict.fromkeys(drives, 1.0)
    _refuse(system, weights, targets, duration, points, largest or {})
    time = np.linspace(0.0, duration, points)  # steps end at the bends of the drives
    options = Options(duration=duration, times=time, method="explicit", step=step, rtol=rtol, atol=atol, start=start)
    search = _Search(system, weights, targets, time, options)
    u = search.first()
    u = search.improved(u, _bounds(weights, largest or {}, points), most_runs)
    missed = np.abs(search.missed(u))
    if np.any(missed > MET * search.scale):
        name = list(targets)[int(np.argmax(missed / search.scale))]
        narrow = "; the bounds of the drives are too narrow for this duration" if largest else ""
        raise SimulationError(
            f"steer: no drives were found that meet the targets: {name} is missed by {missed.max():.3g} after "
            f"{search.count} runs{narrow}"
        )
    return Steering(
        time=search.time,
        drives=search.named(u),
        effort=search.effort(u),
        reached=dict(zip(targets, search.values.tolist(), strict=True)),
        system=search.driven(u),
        runs=search.count,
        notes=search.notes,
    )


class _Search:
    """The drives ``u (nd nk,)``, their effort ``u' H u``, and the targets that a run with them reaches."""

    def __init__(
        self,
        system: System,
        weights: Mapping[str, float],
        targets: Mapping[str, float],
        time: np.ndarray,
        options: Options,
    ) -> None:
        self.system, self.weights = system, weights
        self.targets, self.time = targets, time
        self.options = options
        self.aim = np.array(list(targets.values()), dtype=float)
        self.size = 1.0  # of a drive
        self.scale = np.ones(len(targets))  # of the targets
        self.H = block_diag(*(weight * _square(time) for weight in weights.values()))
        self.count = 0
        self._at: bytes | None = None

    def named(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """Return the drives by joint."""
        return dict(zip(self.weights, u.reshape(len(self.weights), -1), strict=True))

    def driven(self, u: np.ndarray) -> System:
        """Return the system with drives."""
        joints = list(self.system.joints)
        for name, values in self.named(u).items():
            k = [joint.name for joint in joints].index(name)
            element = (joints[k].elements or (HingeElement(),))[0]
            drive = TimeFunction.table(self.time.tolist(), values.tolist()).given
            drive = TimeFunction([(float(self.time[-1]), drive[0][1]), (FOREVER, 0.0)])
            joints[k] = joints[k].with_(elements=(element.with_(drive=drive),))
        return self.system.with_(joints=tuple(joints))

    def run(self, u: np.ndarray) -> None:
        """Run with drives; the last run is kept."""
        if self._at == u.tobytes():
            return
        self.count += 1
        course = Course(self.driven(u), (), self.options)
        changes = self._state_changes(course)
        slopes = ChannelSlopes(course.model, list(self.targets), self.options.duration, course.state)
        end = course.moments[-1:], course.states[-1:]
        self.values = slopes.observer.values(*end)[0]
        self.by_drives = slopes.forward(*end, changes)[:, 0].T
        self.notes = notes_of(course, slopes)
        self._at = u.tobytes()

    def _state_changes(self, course: Course) -> np.ndarray:
        """Return the derivatives (1, ny, nd nk) of the state at the end by the points of the drives."""
        rows = [course.model.packed.speeds_of(name)[0] for name in self.weights]
        dz = np.zeros((course.nz, len(self.H)))
        for k in range(len(course.trace)):
            step = course.map(k)
            assert isinstance(step, ExplicitStep)  # by the method
            for stage in step.stages:
                stage.force_p = np.zeros((course.model.nu, len(self.H)))
                stage.force_p[rows] = -block_diag(*[self._shares(stage.moment.t)] * len(rows))
            dz = step.forward(dz, np.eye(len(self.H)))
        return dz[None, : course.ny]

    def _shares(self, t: float) -> np.ndarray:
        """Return the derivatives (nk,) of a drive at a time by its points."""
        return np.array([np.interp(t, self.time, unit) for unit in np.eye(len(self.time))])

    def missed(self, u: np.ndarray) -> np.ndarray:
        """Return what the targets are missed by (nt,)."""
        self.run(u)
        return self.values - self.aim

    def slopes(self, u: np.ndarray) -> np.ndarray:
        """Return the derivatives (nt, nd nk) of the targets by the drives."""
        self.run(u)
        return self.by_drives

    def effort(self, u: np.ndarray) -> float:
        """Return the integral of the weighted squares."""
        return float(u @ self.H @ u)

    def first(self) -> np.ndarray:
        """Return the drives that solve the problem linearised about a run with a probe of them.

        A run without any drive might have such long steps that it would not notice one.

        Raises
        ------
        InputError
            When the drives do not move a target.
        """
        u = self._probe()
        J, missed = self.slopes(u), self.missed(u)
        rows = np.linalg.norm(J, axis=1)
        still = rows <= np.maximum(STILL * rows.max(), UNMOVED * np.abs(missed) / self.size)
        self._refuse_unmoved(np.where(still, 0.0, J.T / np.maximum(rows, np.finfo(float).tiny)).T)
        self.scale = rows * self.size
        u = self._best(J, J @ u - missed, np.array([[-np.inf], [np.inf]]))
        self.size = float(np.abs(u).max(initial=0.0)) or self.size
        self.scale = rows * self.size
        return u

    def _probe(self) -> np.ndarray:
        """Return drives to one side and the other, which would move their joints alone about as far as the targets."""
        linear = linearise(self.system, inputs=list(self.weights))
        speeds = [next(k for k, name in enumerate(linear.states) if name in _rates(joint)) for joint in self.weights]
        far = float(np.abs(self.aim).max(initial=0.0)) or 1.0
        sizes = 4 * far / (np.abs(np.diag(linear.B[speeds])) * self.time[-1] ** 2)
        self.size = float(sizes.max())
        sign = np.where(self.time < self.time[-1] / 2, 1.0, -1.0)
        return np.concatenate([size * sign for size in sizes])

    def _refuse_unmoved(self, J: np.ndarray) -> None:
        left, singular, _ = np.linalg.svd(J)
        count = int(np.sum(singular > UNMOVED * singular.max(initial=0.0)))
        if count < len(J):
            name = list(self.targets)[int(np.argmax(np.abs(left[:, count])))]
            raise InputError(
                f"steer: the drives do not move target {name!r}, or not apart from the others; leave it out, or give "
                "more drives or points"
            )

    def improved(self, u: np.ndarray, bounds: np.ndarray, most_runs: int) -> np.ndarray:
        """Return the drives of least effort within bounds (2, nd nk), by linearised problems one after the other.

        Where they come to rest the drives are best for the nonlinear system too: they are combinations of its own
        slopes there.
        """
        while self.count < most_runs:
            J, missed = self.slopes(u), self.missed(u)
            better = self._best(J, J @ u - missed, bounds)
            rests = np.abs(better - u).max() <= RESTS * self.size
            if rests and np.all(np.abs(missed) <= MET * self.scale):
                break
            u = better
        return u

    def _best(self, J: np.ndarray, aim: np.ndarray, bounds: np.ndarray) -> np.ndarray:
        """Return the u of least ``u' H u`` with ``J u = aim`` within bounds."""
        moved = np.linalg.solve(self.H, J.T)  # by unit multipliers
        u = moved @ np.linalg.solve(J @ moved, aim)
        if np.all((bounds[0] <= u) & (u <= bounds[1])):
            return u
        size, H = self.size, self.H / np.abs(self.H).max()
        rows = J * size / self.scale[:, None]
        found = minimize(
            lambda v: v @ H @ v,
            np.clip(u, *bounds) / size,
            jac=lambda v: 2 * H @ v,
            bounds=(bounds / size).T,
            constraints=[{"type": "eq", "fun": lambda v: rows @ v - aim / self.scale, "jac": lambda v: rows}],
            method="SLSQP",
            options={"maxiter": 500, "ftol": QUADRATIC},
        )
        return found.x * size


def _rates(joint: str) -> tuple[str, str]:
    return f"{joint}.rate", f"{joint}.speed"


def _square(time: np.ndarray) -> np.ndarray:
    """Return H (nk, nk) with ``u' H u`` the integral of the square of straight lines."""
    h = np.diff(time)
    H = np.zeros((len(time), len(time)))
    k = np.arange(len(h))
    H[k, k] += h / 3
    H[k + 1, k + 1] += h / 3
    H[k, k + 1] = H[k + 1, k] = h / 6
    return H


def _bounds(weights: Mapping[str, float], largest: Mapping[str, float], points: int) -> np.ndarray:
    """Return lower and upper bounds (2, nd nk) of the drives."""
    upper = np.repeat([largest.get(name, np.inf) for name in weights], points)
    return np.array([-upper, upper])


def _refuse(
    system: System,
    weights: Mapping[str, float],
    targets: Mapping[str, float],
    duration: float,
    points: int,
    largest: Mapping[str, float],
) -> None:
    """Refuse what cannot be steered."""
    if not weights or not targets:
        raise InputError("steer: name the joints that drive, and targets at the end of the run")
    joints = {joint.name: joint for joint in system.joints}
    if system.closures:
        raise InputError("steer: systems with closed loops are not steered; give one without closures")
    for name, weight in weights.items():
        refuse_unknown(name, joints, "steer: joint")
        joint = joints[name]
        if SPEEDS[joint.type] != 1 or joint.motion is not None:
            raise InputError(f"steer: joint {name!r} has no single free coordinate; name a joint that has")
        if joint.elements and joint.elements[0].drive is not None:
            raise InputError(f"steer: joint {name!r} has a drive, which would be replaced; leave it out")
        if not 0 < weight < float("inf"):
            raise InputError(f"steer: the weight of {name!r} is {weight}; it must be positive")
    for name, bound in largest.items():
        refuse_unknown(name, weights, "steer: largest drive of joint")
        if not bound > 0:
            raise InputError(f"steer: the largest drive of {name!r} is {bound}; it must be positive")
    if not 0 < duration < float("inf"):
        raise InputError(f"steer: the duration is {duration} s; it must be positive")
    if not isinstance(points, int) or points * len(weights) < max(2, len(targets)) or points < 2:
        raise InputError(f"steer: {points} points of each drive are not enough for {len(targets)} targets; give more")
