"""The equations of motion near a state of a run: accelerations, and their derivatives by state and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from modalprep.multibody.analysis.closure_tangent import Conditions, conditions
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tangent import SystemTangent
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.evaluation.system_state import SystemState
from modalprep.multibody.kernels.time_tables import Tables
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack_changed
from modalprep.sensitivity.compliance import Compliance
from modalprep.sensitivity.differences import LINEAR, Neighbours, neighbours, weighted
from modalprep.sensitivity.parameters import Parameter
from modalprep.sensitivity.tangent_maps import Kinematics, Layout


class Moment(NamedTuple):
    """A time, s, and the stretch between breaks of functions of time that it belongs to."""

    t: float
    stretch: tuple[float, float]


@dataclass(frozen=True)
class Beside:
    """Systems along a parameter that changes its forces.

    Attributes
    ----------
    number : int
        Of the parameter.
    evaluators, weights : tuple of Evaluator, (k,)
        Those for its forces, and the weights of their derivative.
    moves_loops : bool
        Whether the conditions of closed loops may depend on it.
    """

    number: int
    system: System
    parameter: Parameter
    evaluators: tuple[Evaluator, ...]
    weights: np.ndarray
    moves_loops: bool

    @cached_property
    def found(self) -> Neighbours:
        """Systems for what may depend on the parameter in any way."""
        return neighbours(self.system, self.parameter)

    def derivative(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Return the derivative of what was found by the evaluators, one by one."""
        return weighted(self.weights, values)


class Model:
    """A system and its neighbours along each parameter, for the derivatives at any state.

    Parameters
    ----------
    system : System
    parameters : sequence of Parameter
    until : float
        Functions of time are known to this time, s.
    rho_inf : float
        Of generalised-alpha.
    """

    def __init__(self, system: System, parameters: list[Parameter], until: float, rho_inf: float = 0.9) -> None:
        self.system, self.parameters, self.rho_inf = system, parameters, rho_inf
        self.evaluator = Evaluator(system, until=until)
        self.packed = self.evaluator.packed
        self.nx, self.nu = self.packed.nx, self.packed.nu
        self.layout = Layout(self.packed)
        self.loops = self.evaluator.loops
        self._tree: Chart | None = None
        self.beside = []
        for k, each in enumerate(parameters):
            if not each.is_start or system.closures:
                self.beside.append(self._along(k, each, until))

    def _along(self, number: int, parameter: Parameter, until: float) -> Beside:
        if parameter.is_linear and not parameter.is_start:
            weights = np.array(LINEAR.weights) / parameter.step
            other = self._evaluator(parameter.change(self.system, parameter.value + parameter.step), until)
            return Beside(number, self.system, parameter, (self.evaluator, other), weights, moves_loops=False)
        found = neighbours(self.system, parameter)
        evaluators = tuple(self._evaluator(other, until) for other in found.systems)
        return Beside(number, self.system, parameter, evaluators, found.weights, moves_loops=True)

    def _evaluator(self, other: System, until: float) -> Evaluator:
        pack_changed(other, self.system)
        return Evaluator(other, until=until)

    def restore(self, state: SystemState) -> None:
        """Let closed loops keep what they keep in a state."""
        for evaluator in self.evaluators:
            assert evaluator.loops is not None
            evaluator.loops.restore(state.closures, state.active)
            evaluator.loops.assemble(evaluator.data, state.vector(self.system), evaluator.loading.prescribe(state.t))

    @property
    def evaluators(self) -> list[Evaluator]:
        """That of the system, and those beside it."""
        return [self.evaluator, *(each for along in self.beside for each in along.evaluators)]

    @property
    def loadings_beside(self) -> list[Loading]:
        """Loadings beside that of the system which have other functions of time."""
        own = self.evaluator.loading.tables
        others = (each.loading for along in self.beside for each in along.evaluators)
        return [other for other in others if not all(map(_are_alike, other.tables, own))]

    def at(self, moment: Moment) -> None:
        """Take functions of time at a moment."""
        for evaluator in self.evaluators:
            evaluator.t = float(moment.t)
            evaluator.loading.enter(*moment.stretch)

    def chart(self, y: np.ndarray) -> Chart:
        """Return the independent coordinates near a state; without loops they are all, and one chart is used again."""
        if self.loops is not None:
            return Chart(self.evaluator, y)
        if self._tree is None:
            self._tree = Chart(self.evaluator, y)
        self._tree.y = y
        return self._tree

    def accelerations(self, y: np.ndarray, moment: Moment) -> np.ndarray:
        """Return the accelerations (nu,) of a state."""
        self.at(moment)
        self.evaluator.load(y)
        return self.evaluator.accelerations(np.zeros(self.nu)).copy()

    def constrained(self, y: np.ndarray, moment: Moment) -> tuple[np.ndarray, np.ndarray | None]:
        """Return what conditions of loops ask of the accelerations (m,), and the matrix (m, nu) by which they do."""
        self.at(moment)
        if self.loops is None:
            return np.zeros(0), None
        udot = self.accelerations(y, moment)
        G = row_slopes(self.evaluator, y)[self.chart(y).kept]
        return G @ udot, G

    def linear(self, y: np.ndarray, moment: Moment) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness and damping (2, nu) of modes and hinges, and their derivatives (2, nu, np)."""
        self.at(moment)
        by_parameter = np.zeros((2, self.nu, len(self.parameters)))
        for along in self.beside:
            found = [linear_of(each, y) for each in along.evaluators]
            by_parameter[:, :, along.number] = along.derivative(found)
        return linear_of(self.evaluator, y), by_parameter

    @cached_property
    def compliance(self) -> Compliance:
        """The springs and bushings that a Rosenbrock step treats implicitly."""
        return Compliance(self.evaluator)

    @cached_property
    def _compliances(self) -> dict[int, Compliance]:
        """Those of all evaluators."""
        return {id(each): Compliance(each) for each in self.evaluators}

    def compliance_slopes(self, y: np.ndarray, place: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the derivatives (nu, np) of the force of these springs by the parameters."""
        found = np.zeros((self.nu, len(self.parameters)))
        for along in self.beside:
            forces = [self._compliances[id(each)].force(y, place, rate) for each in along.evaluators]
            found[:, along.number] = along.derivative(forces)
        return found


def _are_alike(one: Tables, other: Tables) -> bool:
    return np.array_equal(one.knots, other.knots) and np.array_equal(one.knot, other.knot)


def linear_of(evaluator: Evaluator, y: np.ndarray) -> np.ndarray:
    """Return what a step of the Rosenbrock method treats implicitly (2, nu): stiffness and damping."""
    evaluator.load(y)
    found = evaluator.packed.linear.copy()
    for row in evaluator.packed.model.links:
        own = slice(int(row["u"]), int(row["uq"]))
        found[:, own] = np.maximum(0.0, -evaluator.loading.slope[:, own])
    return found


def row_slopes(evaluator: Evaluator, y: np.ndarray) -> np.ndarray:
    """Return the derivatives (m, nu) of all conditions of closed loops by the speeds."""
    assert evaluator.loops is not None
    motion = evaluator.loading.prescribe(evaluator.t, evaluator.data).copy()
    motion[:, 1:] = 0.0
    return evaluator.loops.rate_slopes(evaluator.data, y, motion, evaluator.t)


class Rows(NamedTuple):
    """Conditions of closed loops that do not follow from others, scaled, and their multipliers."""

    kept: np.ndarray
    unit: np.ndarray
    multiplier: np.ndarray
    slopes: Conditions


class Local:
    """The equations of motion at a state with accelerations, and their derivatives.

    Changes of the state are (nx + nu,), as the solver keeps it. ``M du' + D du + K dx + F_p dp = G' dl`` with the
    increments dx, and ``G du' + A_u du + A_x dx + c_p dp = 0`` of the accelerations of loops.

    Parameters
    ----------
    udot : (nu,) or None
        Accelerations; None for those of the state.
    more : (nu,) or 0
        Forces that loops exert beside those that the accelerations need, as of an implicit step.
    """

    def __init__(
        self,
        model: Model,
        y: np.ndarray,
        moment: Moment,
        udot: np.ndarray | None = None,
        more: np.ndarray | float = 0.0,
    ) -> None:
        self.model, self.y, self.moment, self.more = model, np.array(y), moment, more
        self.udot = model.accelerations(self.y, moment) if udot is None else udot
        model.at(moment)
        chart = model.chart(self.y)
        exact = SystemTangent(chart, self.udot, more=more)
        called = (0.0, 0.0) if exact.called is None else np.hsplit(exact.called[0], 2)
        self.M, self.D, self.K = exact.found.M, exact.found.D - called[1], exact.K
        self.M = (self.M + self.M.T) / 2
        self.kinematics: Kinematics = model.layout.kinematics(self.y)
        self.rows = self._rows(chart, exact) if model.loops else None
        self.force_p = self._force_slopes()
        self._mobility: tuple[np.ndarray, np.ndarray] | None = None
        self._acceleration_p: np.ndarray | None = None

    @property
    def ydot(self) -> np.ndarray:
        """The derivative of the state (nx + nu,)."""
        return np.concatenate([self.kinematics.rates_u @ self.y[self.model.nx :], self.udot])

    def _rows(self, chart: Chart, exact: SystemTangent) -> Rows:
        loops, evaluator = self.model.evaluator.loops, self.model.evaluator
        assert loops is not None
        unit = loops.work.unit[chart.kept].copy()
        slopes = Conditions(*(unit[:, None] * part for part in conditions(exact.tree, loops, chart.kept)))
        required = evaluator.required(self.y, self.udot) + self.more
        return Rows(chart.kept, unit, chart.inverse.T @ required[chart.dependent], slopes)

    def _force_slopes(self) -> np.ndarray:
        """Return the derivatives (nu, np) of the forces that the accelerations need, by the parameters."""
        found = np.zeros((self.model.nu, len(self.model.parameters)))
        own = self._force(self.model.evaluator)
        for along in self.model.beside:
            forces = [own if each is self.model.evaluator else self._force(each) for each in along.evaluators]
            found[:, along.number] = along.derivative(forces)
        return found

    def _force(self, evaluator: Evaluator) -> np.ndarray:
        force = evaluator.required(self.y, self.udot)
        return force if self.rows is None else force - self._row_slopes(evaluator).T @ self.rows.multiplier

    def _row_slopes(self, evaluator: Evaluator) -> np.ndarray:
        """Return the derivatives (m, nu) of the kept conditions of a system beside this one by the speeds."""
        assert self.rows is not None
        return self.rows.unit[:, None] * row_slopes(evaluator, self.y)[self.rows.kept]

    @property
    def acceleration_p(self) -> np.ndarray:
        """The derivatives (m, np) of the accelerations of the kept conditions, those of the state given."""
        if self._acceleration_p is None:
            self._acceleration_p = self._condition_slopes()
        return self._acceleration_p

    def _condition_slopes(self) -> np.ndarray:
        if self.rows is None:
            return np.zeros((0, len(self.model.parameters)))
        self.model.at(self.moment)
        found = np.zeros((len(self.rows.kept), len(self.model.parameters)))
        for along in self._moving_loops():
            found[:, along.number] = along.derivative([self._excess(each) for each in along.evaluators])
        return found

    def _excess(self, evaluator: Evaluator) -> np.ndarray:
        """Return the accelerations of the conditions of a system beside this one: its own leave none."""
        G = self._row_slopes(evaluator)
        evaluator.load(self.y)
        return G @ (self.udot - evaluator.accelerations(np.zeros(self.model.nu)))

    def gap_slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (m, np) of the kept conditions and of their rates by the parameters."""
        assert self.rows is not None
        self.model.at(self.moment)
        gap, rate = np.zeros((2, len(self.rows.kept), len(self.model.parameters)))
        for along in self._moving_loops():
            found = [self._gaps(each) for each in along.evaluators]
            gap[:, along.number], rate[:, along.number] = along.derivative(found)
        return gap, rate

    def _moving_loops(self) -> list[Beside]:
        return [along for along in self.model.beside if along.moves_loops]

    def _gaps(self, evaluator: Evaluator) -> np.ndarray:
        assert evaluator.loops is not None
        assert self.rows is not None
        evaluator.load(self.y)
        work = evaluator.loops.work
        return self.rows.unit * np.array([work.phi[self.rows.kept], work.rate[self.rows.kept]])

    @property
    def mobility(self) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations by forces (nu, nu), and by accelerations that conditions ask for (nu, m)."""
        if self._mobility is None:
            self._mobility = saddle_inverse(self.M, None if self.rows is None else self.rows.slopes.G)
        return self._mobility

    def forward(self, dy: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the change (ny, k) of the rate of the state by changes (ny, k) of it and (np, k) of parameters."""
        nx, kin = self.model.nx, self.kinematics
        x, u = dy[:nx], dy[nx:]
        by_force, by_rows = self.mobility
        udot = -by_force @ self.force(x, u, dp) - by_rows @ self.acceleration(x, u, dp)
        return np.vstack([kin.rates_x @ x + kin.rates_u @ u, udot])

    def force(self, x: np.ndarray, u: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the change (nu, k) of the forces that the accelerations need, with coordinates, speeds, parameters."""
        return self.K @ (self.kinematics.increments @ x) + self.D @ u + self.force_p @ dp

    def acceleration(self, x: np.ndarray, u: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the change (m, k) of the accelerations of the kept conditions, those of the state given."""
        if self.rows is None:
            return np.zeros((0, x.shape[1]))
        s = self.rows.slopes
        turned = self.kinematics.increments @ x
        return s.acceleration_x @ turned + s.acceleration_u @ u + self.acceleration_p @ dp


def saddle_inverse(M: np.ndarray, G: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the solutions (n, n) and (n, m) of ``M a - G' l = f``, ``G a = g`` by f and by g."""
    n = len(M)
    if G is None:
        return np.linalg.inv(M), np.zeros((n, 0))
    m = len(G)
    whole = np.block([[M, -G.T], [G, np.zeros((m, m))]])
    inverse = np.linalg.inv(whole)
    return inverse[:n, :n], inverse[:n, n:]
