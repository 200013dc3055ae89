"""Hinge forces for prescribed joint histories."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy.integrate import solve_ivp

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.inverse_closed import drive_loops
from modalprep.multibody.analysis.tangent import SystemTangent
from modalprep.multibody.evaluation.coordinates import coordinates
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.idle_stations import stations_where_needed
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.step_bounds import step_bounds
from modalprep.multibody.packing.time_tables import tabulate
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.ranges import left_ranges
from modalprep.multibody.results.validity import large_deflections
from modalprep.records import Record
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import told

MAX_STEPS = 30  # Newton steps of a quasi-static solution
CONVERGED = 1e-11  # Newton step, in scales of the coordinates


@dataclass(frozen=True, eq=False, kw_only=True)
class InverseDynamics(Record):
    """Hinge forces, modal coordinates and states of a prescribed motion.

    Attributes
    ----------
    time : (nt,)
    force : dict of (nt, k)
        Force (N) or torque (N m) of an actuator in each coordinate of the joints with a history, in addition
        to springs and other loads of the system.
    modal : dict of (nt, n)
        Modal coordinates of each body.
    y, udot : (nt, nx + nu), (nt, nu)
        States, which `coordinates` reads by name, and accelerations.
    notes : tuple of str
        Bodies that deflect by more than a tenth of their size, and joints that leave their range.
    """

    time: np.ndarray
    force: dict[str, np.ndarray]
    modal: dict[str, np.ndarray]
    y: np.ndarray
    udot: np.ndarray
    notes: tuple[str, ...] = ()


def hinge_forces(system: System, y: np.ndarray, udot: np.ndarray, t: float = 0.0) -> np.ndarray:
    """Return the generalised forces (nu,) that a state and its accelerations require besides the loads, in O(n).

    The inverse of forward dynamics: the modal rows vanish where the modal accelerations are those of the motion.

    Returns
    -------
    (nu,) float
        N, N m, and the modal rows in m sqrt(kg) / s^2.

    References
    ----------
    J. Y. S. Luh, M. W. Walker, R. P. C. Paul, On-line computational scheme for mechanical manipulators,
    J. Dyn. Syst. Meas. Control 102 (1980) 69.
    Theory 5.2.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> hinge_forces(arm, np.zeros(4), np.array([1.0, 0.0]))[:1].round(6)  # 12 kg 100 m^2 / 3, plus rotary inertia
    array([400.006])
    """
    return _tree(system, t).required(np.asarray(y, dtype=float), np.asarray(udot, dtype=float))


def _tree(system: System, t: float) -> Evaluator:
    if system.closures:
        raise InputError(
            f"hinge forces: {system.closures[0].name!r} closes a loop, so that a state and its accelerations do not "
            "determine them; use inverse_dynamics with histories of as many joints as are driven"
        )
    return Evaluator(system, t)


@told
@stations_where_needed(lambda found, name: found.modal[name])
def inverse_dynamics(
    system: System,
    motion: Mapping[str, Any],
    times: np.ndarray,
    *,
    modes: Literal["dynamic", "quasi_static"] = "dynamic",
    rtol: float = 1e-9,
) -> InverseDynamics:
    """Return the hinge forces that move joints as prescribed.

    Modes and joints without a prescribed history follow from their equations of motion, from the joints' start values
    with modes at rest ("dynamic"). In a tree where every joint has a history the modes may instead be in quasi-static
    equilibrium with the loads and the motion at each time ("quasi_static"): their speeds and accelerations are
    neglected, also in the forces. With closed loops the number of histories is that of the drives.

    Parameters
    ----------
    motion : {joint: function of time, or one for each of its coordinates}
        Length (m) or angle (rad), translations before rotations; anything that makes a `TimeFunction`.
    times : (nt,)
        s, ascending.
    rtol : float
        Relative tolerance of the integration of modes and joints without a history.

    Returns
    -------
    InverseDynamics
        Forces (N) and torques (N m) over the times, by joint, and all coordinates.

    Raises
    ------
    InputError
        When a joint is unknown, prescribed already, spherical or free, the times do not ascend, or there are
        more histories than degrees of freedom.
    SimulationError
        When the integration fails, the loops cannot be closed, or no quasi-static deflection is found.

    References
    ----------
    Theory 5.2.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=2 * np.eye(3), interfaces={"root": np.zeros(3)})
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="disc")
    >>> system = System(bodies={"disc": disc}, joints=(hinge,))
    >>> found = inverse_dynamics(system, {"hinge": "3*t**2"}, np.array([0, 0.5]))
    >>> found.force["hinge"][:, 0].tolist()
    [12.0, 12.0]
    """
    refuse_other("inverse_dynamics: the system", System, system)
    times = np.asarray(times, dtype=float)
    if times.ndim != 1 or not len(times) or np.any(np.diff(times) <= 0):
        raise InputError("inverse dynamics: the times must ascend")
    if modes not in ("dynamic", "quasi_static"):
        raise InputError(f"inverse dynamics: modes {modes!r} is neither 'dynamic' nor 'quasi_static'")
    if system.closures:
        return _looped(system, motion, times, modes, rtol)
    guided = _Guided(system, motion, times)
    states = guided.dynamic(times, rtol) if modes == "dynamic" else guided.quasi_static(times)
    responses = [guided.response(t, y, dynamic=modes == "dynamic") for t, y in zip(times, states, strict=True)]
    udot, force = (np.array(rows) for rows in zip(*responses, strict=True))
    forces = {name: force[:, guided.evaluator.packed.speeds_of(name)] for name in motion}
    return _result(system, times, states, udot, forces)


def _looped(system: System, motion: Mapping[str, Any], times: np.ndarray, modes: str, rtol: float) -> InverseDynamics:
    if modes != "dynamic":
        raise InputError(
            f"inverse dynamics: {system.closures[0].name!r} closes a loop; quasi-static modes are for trees, use "
            "dynamic ones"
        )
    packed = pack(system)
    laws = {name: _laws(packed, name, functions) for name, functions in motion.items()}
    return _result(system, times, *drive_loops(system, laws, times, rtol))


def _result(
    system: System, times: np.ndarray, y: np.ndarray, udot: np.ndarray, force: dict[str, np.ndarray]
) -> InverseDynamics:
    packed = pack(system)
    modal = {}
    for name, body in system.bodies.items():
        first = packed.modes_of(name).start
        modal[name] = y[:, first : first + body.n]
    at = coordinates(system, y, times)
    ranged = {each.name: at.joint(each.name).position[..., 0] for each in system.joints if each.range is not None}
    notes = (*large_deflections(system.bodies, times, modal), *left_ranges(system.joints, times, ranged))
    return InverseDynamics(time=times, force=force, modal=modal, y=y, udot=udot, notes=notes)


def _laws(packed: Packed, name: str, functions: Any) -> list[TimeFunction]:
    """Return a function of time for each coordinate of a joint."""
    known = list(dict.fromkeys(link.joint.name for link in packed.links))
    refuse_unknown(name, known, "inverse dynamics: joint")
    kinds = [KINDS[code] for code in packed.types[packed.links_of(name)]]
    count = sum(kind.named for kind in kinds)
    if not count:
        raise InputError(
            f"inverse dynamics: joint {name!r} has no coordinate that a function of time can prescribe; leave it out"
        )
    laws = [TimeFunction.of(f).as_motion() for f in (functions if _several(functions) else [functions])]
    if len(laws) != count:
        raise InputError(f"inverse dynamics: joint {name!r} needs {count} functions of time, not {len(laws)}")
    for law in laws:
        law.refuse_jumps(f"inverse dynamics: the motion of joint {name!r}")
    return laws


class _Guided:
    """A system with prescribed histories of some joints: `given` are the indices of their speeds, `left` the others."""

    def __init__(self, system: System, motion: Mapping[str, Any], times: np.ndarray) -> None:
        self.evaluator = _tree(system, float(times[-1]))
        self.start = self.evaluator.start
        self.laws: list[tuple[int, int, TimeFunction]] = []
        packed = self.evaluator.packed
        for name, functions in motion.items():
            laws = _laws(packed, name, functions)
            self.laws += zip(packed.coordinates_of(name), packed.speeds_of(name), laws, strict=True)
        self.given = np.array([u for _, u, _ in self.laws], dtype=int)
        self.left = np.setdiff1d(np.arange(self.evaluator.nu), self.given)

    def guide(self, t: float, y: np.ndarray) -> np.ndarray:
        """Write the histories into state y at time t; returns their accelerations (nu,), zero for all others."""
        udot = np.zeros(self.evaluator.nu)
        self.evaluator.set_time(t)
        for x, u, law in self.laws:
            y[x], y[self.evaluator.nx + u], udot[u] = law(t)
        return udot

    def response(self, t: float, y: np.ndarray, *, dynamic: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return all accelerations, those without a history by the equations of motion, and the required forces."""
        udot = self.guide(t, y)
        need = self.evaluator.required(y, udot)
        left = self.left
        if dynamic and len(left):
            unit = np.eye(self.evaluator.nu)[left]
            columns = np.column_stack([self.evaluator.required(y, udot + e) - need for e in unit])
            udot[left] = -np.linalg.solve(columns[left], need[left])
            need = need + columns @ udot[left]
        return udot, need

    def dynamic(self, times: np.ndarray, rtol: float) -> np.ndarray:
        """Return the states (nt, nx + nu) by integration of the coordinates without a history."""
        evaluator = self.evaluator
        y = self.start.copy()

        def rate(t: float, y: np.ndarray) -> np.ndarray:
            y, out = y.copy(), np.zeros(len(y))
            udot, _ = self.response(t, y, dynamic=True)
            evaluator.rates(y, out)
            out[evaluator.nx :] = udot
            return out

        self.guide(times[0], y)
        if not len(self.left) or len(times) == 1:
            states = np.tile(y, (len(times), 1))
        else:
            states = self._integrated(rate, y, times, rtol)
        for t, state in zip(times, states, strict=True):
            self.guide(t, state)
        return states

    def _integrated(self, rate: Callable, y: np.ndarray, times: np.ndarray, rtol: float) -> np.ndarray:
        """Return the states at the times, in stretches between which functions of time bend or vary more quickly."""
        loading = self.evaluator.loading
        laws = [law for _, _, law in self.laws]
        tables = [loading.arrays.environment.tables, tabulate(laws, float(times[-1]))]
        bounds = step_bounds(tables, float(times[-1]))
        breaks = [t for each in tables for t in each.until]
        begins, longest = bounds.cells.T
        inside = [t for t in (*begins, *bounds.ends, *breaks) if times[0] < t < times[-1]]
        states = [y]
        for begin, end in pairwise(np.unique([times[0], *inside, times[-1]])):
            here = times[(times > begin) & (times <= end)]
            last = np.nextafter(end, begin)
            cell = np.searchsorted(begins, begin, side="right")
            run = solve_ivp(
                lambda t, y, last=last: rate(min(t, last), y),
                (begin, end),
                y,
                method="DOP853",
                rtol=rtol,
                t_eval=np.unique([*here, end]),
                atol=1e-3 * rtol,
                max_step=longest[cell - 1] if cell else np.inf,
            )
            if not run.success:
                raise SimulationError(f"inverse dynamics stopped at t = {run.t[-1]:g} s: {run.message}")
            y = run.y[:, -1]
            states += list(run.y.T[: len(here)])
        return np.array(states)

    def quasi_static(self, times: np.ndarray) -> np.ndarray:
        """Return the states (nt, nx + nu) with the modes in quasi-static equilibrium at each time."""
        passive = [name for kind, name in (self.evaluator.owner[u] for u in self.left) if kind == "joint"]
        if passive:
            raise InputError(
                f"inverse dynamics: joint {passive[0]!r} has no history; give it one, or use dynamic modes"
            )
        y = self.start.copy()
        states = []
        y[self.evaluator.nx :] = 0.0
        for t in times:
            y = self._settled(float(t), y)
            states.append(y)
        return np.array(states)

    def _settled(self, t: float, y: np.ndarray) -> np.ndarray:
        evaluator, left = self.evaluator, self.left
        udot = self.guide(t, y := y.copy())
        scale = self.evaluator.scale[self.left]
        lift = np.eye(evaluator.nu)[:, left] * scale
        for _ in range(MAX_STEPS):
            residual = scale * evaluator.required(y, udot)[left]
            K = SystemTangent(Chart(evaluator, y), udot).K[np.ix_(left, left)]
            step = -np.linalg.solve(K * np.outer(scale, scale), residual) if len(left) else np.zeros(0)
            y = evaluator.moved(y, lift @ step)
            if np.abs(step).max(initial=0.0) < CONVERGED:
                return y
        raise SimulationError(f"inverse dynamics: no quasi-static deflection of the modes at t = {t:g} s")


def _several(functions: Any) -> bool:
    """Whether there is a function for each coordinate, not a single one in pieces ``(until, expression)``."""
    return isinstance(functions, list) and not isinstance(functions[0], tuple)
