"""The way back through many steps at once, in compiled code, for systems to which it applies.

Closed loops go back so through explicit steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile
from typing import Any

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluate import GOOD, Equations, build_equations
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.integration import driver, rosenbrock
from modalprep.multibody.integration.dop853_table import STAGES
from modalprep.multibody.kernels.closed_loops.constraints import Work
from modalprep.multibody.kernels.closed_loops.factor import update_weights
from modalprep.multibody.kernels.tangents.data import first_place
from modalprep.multibody.kernels.tangents.pulled_back import new_pulled
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.constraints import constraint_work
from modalprep.sensitivity.alpha_back import NOT_SOLVED, AlphaSteps, alpha_back, new_alpha_work
from modalprep.sensitivity.force_back import KNOWN, ends_of, only_elements_differ, same_joints
from modalprep.sensitivity.generalised_alpha import AlphaMethod
from modalprep.sensitivity.jumps import Jump
from modalprep.sensitivity.local import Model
from modalprep.sensitivity.loops_back import closed_product, loop_ends
from modalprep.sensitivity.rosenbrock_back import Implicit, rosenbrock_back
from modalprep.sensitivity.stages_back import Back, Kept, Stages, Steps, force_rows, hinge_product, steps_back
from modalprep.sensitivity.trace import Step

NOT_POSITIVE = "the mass matrix is not positive at a stage of a step"
NOT_SOLVABLE = "the equations of a step of generalised-alpha are not solved on the way back; give a shorter step"
MOST = 2**20  # numbers that are kept of the stages of some steps
MOST_CLOSED = 256  # steps of closed loops at once


def applies(system: System) -> bool:
    """Whether compiled code goes back: where nothing acts but gravity, loops and the commonest force elements."""
    return not (system.orbit or system.depletions) and all(isinstance(e, KNOWN) for e in system.loads)


class WayBack:
    """The way back through steps of all methods, through those of closed loops by the explicit one.

    Parameters
    ----------
    model : Model
        Of a system to which it `applies`.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        nx, nu, packed = model.nx, model.nu, model.packed
        self.ny = ny = nx + nu
        conditions = 0 if model.loops is None else len(model.loops.arrays.rows)
        self.at_once = max(1, MOST // (STAGES * (ny + 2 * nu + 2 * conditions)))
        if conditions:
            self.at_once = min(self.at_once, MOST_CLOSED)
        self.known: dict[int, Equations] = {}  # of the system and those beside it, by their evaluators
        own = self.equations(model.evaluator)
        self.sprung = [each for each in model.evaluators[1:] if each is not model.evaluator and self._is_sprung(each)]
        self.ends = ends_of(model.evaluator, self.sprung)
        elements = 0 if self.ends is None else len(self.ends.rows)
        self.loops = loop_ends(model.evaluator, first_place(packed.model) + elements, self.at_once, STAGES)
        self.stages = Stages(*(self._stage(own) for _ in range(STAGES)))
        modal = self.stages.s0.data.modal
        rows, rates = (np.zeros((1, 6, 1)), np.zeros((1, 1))) if modal is None else (modal.M_rf, modal.qdd)
        links = len(packed.links)
        self.back = Back(
            kept=Kept(
                inertia=np.empty((STAGES, links, 16)),
                acceleration=np.empty((STAGES, links, 6)),
                M_rf=np.empty((STAGES, *rows.shape)),
                qdd=np.empty((STAGES, *rates.shape)),
            ),
            work=packed.sweep(elements + (0 if self.loops is None else len(self.loops.rows))),
            pulled=new_pulled(packed.model),
            ends=self.ends,
            loops=self.loops,
            rates=np.empty((STAGES, ny + 1)),
            bars=np.empty((STAGES, ny)),
            raw=np.empty(ny + 1),
            by_x=np.zeros(nu),
            by_u=np.zeros(nu),
            own=np.zeros(ny),
            joints=np.empty(1),
        )
        self.implicit = Implicit(
            rate=np.empty((4, nu)),
            place=np.empty((4, nu)),
            moved=np.empty((4, ny + 1)),
            bars=np.empty((4, nu)),
            joints=np.empty((4, nu)),
            by_linear=np.empty((2, nu)),
            total=np.empty(nu),
        )
        method = np.array(AlphaMethod.of(model.rho_inf))
        self.alpha = new_alpha_work(nx, model.evaluator.scale, method, len(self.sprung), self.back.work)
        turning = any(e.friction or e.limited for joint in model.system.joints for e in joint.elements)
        turning = turning or model.compliance.rows is not None  # what the matrix of a stage has changes with states
        turning = turning or not all(np.array_equal(_dampers(x), _dampers(model.evaluator)) for x in model.evaluators)
        self.methods = {driver.EXPLICIT: STAGES}
        if self.loops is None:
            self.methods |= {driver.ALPHA: 1} | ({} if turning else {driver.ROSENBROCK: rosenbrock.STAGES})

    def _is_sprung(self, other: Evaluator) -> bool:
        """Whether a system beside this one has other springs or bushings, and is the same otherwise."""
        own = self.model.evaluator
        return bool(own.system.loads) and self._has_own_tree(other) and only_elements_differ(own, other)

    def _has_own_tree(self, other: Evaluator) -> bool:
        """Whether bodies, joints and closures of a system beside this one are the same but for joints' elements."""
        if other.packed.model is not self.model.packed.model:
            return False
        if self.model.loops is None or other.loops is None:
            return True
        same = zip(other.system.closures, self.model.system.closures, strict=True)
        return all(a is b for a, b in same) and np.array_equal(other.loops.work.value, self.model.loops.work.value)

    def _stage(self, own: Equations) -> Equations:
        nu, loops = self.model.nu, self.model.loops
        work = own.work if loops is None else in_space(constraint_work(loops.arrays, self.model.packed))
        return own._replace(data=self.model.packed.data(), work=work, tau=np.zeros(nu), slope=np.zeros((2, nu)))

    def begin(self, trace: Sequence[Step | Jump], end: int) -> int:
        """Return from which step on it goes back at once to step `end`; `end` where it cannot."""
        last = trace[end - 1] if end else None
        before = reversed(range(max(0, end - self.at_once), end))
        alike = takewhile(lambda k: self.is_like(trace[k], last), before)
        return end - sum(1 for _ in alike)

    def is_like(self, step: Step | Jump, last: Step | Jump | None) -> bool:
        """Whether compiled code takes a step at once with another."""
        if not (isinstance(step, Step) and isinstance(last, Step)):
            return False
        return step.method in self.methods and (step.method, step.stretch) == (last.method, last.stretch)

    def reverse(self, steps: Sequence[Any], after: np.ndarray, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return the gradient by the state before some steps; that by the parameters is added to `bar_p`.

        Parameters
        ----------
        after : (k, nx + nu)
            What is added to the gradient by the state after each step.
        """
        self.model.at(steps[0].begin)
        method = steps[0].method
        kept = self.kept(steps, after)
        if self.loops is not None:
            self._close(steps)
        if self.ends is not None:
            self.ends.products[:] = 0.0
        found = bar.copy() if method == driver.ALPHA else np.concatenate([bar[: self.ny], np.zeros(2 * self.model.nu)])
        status = self._go_back(steps, kept, found)
        if status != GOOD:
            raise SimulationError(f"derivatives of the run: {NOT_SOLVABLE if status == NOT_SOLVED else NOT_POSITIVE}")
        self._add_parameters(kept, bar_p)
        if method == driver.ROSENBROCK:
            _, by_parameter = self.model.linear(steps[0].y, steps[0].begin)
            bar_p -= np.einsum("ck,ckp->p", self.implicit.by_linear, by_parameter)
        return found

    def _close(self, steps: Sequence[Any]) -> None:
        """Let all stages have the loops of the system as they are, and keep the ends of some steps."""
        assert self.loops is not None
        assert self.model.loops is not None
        own = self.model.loops.work
        for stage in self.stages:
            for name in ("value", "unit", "least_mobility", "reference_mobility"):
                getattr(stage.work, name)[:] = getattr(own, name)
            update_weights(stage.work)
        self.loops.ends[: len(steps), : self.ny] = [step.end for step in steps]

    def _go_back(self, steps: Sequence[Any], kept: Steps, bar: np.ndarray) -> int:
        given = self.stages, kept
        if steps[0].method == driver.EXPLICIT:
            return steps_back(*given, len(steps), self.back, bar[: self.ny])
        if steps[0].method == driver.ROSENBROCK:
            return rosenbrock_back(*given, len(steps), self.back, self.implicit, bar[: self.ny])
        return alpha_back(*given, _alpha_steps(steps), len(steps), self.back, self.alpha, bar)

    def kept(self, steps: Sequence[Any], after: np.ndarray) -> Steps:
        """Return steps for compiled code, with what is added to the gradient (k, nx + nu) after each."""
        y = np.array([step.y for step in steps])
        found = self._rows(steps, after, y)
        if steps[0].method == driver.ALPHA:
            begins = [k for k, step in enumerate(steps) if step.ratio == 0.0]
            at = [step.t + step.h for step in steps] + [steps[k].t for k in begins]
            found.time[:] = at
            found.states[:, : self.ny] = [*(step.end for step in steps), *y[begins]]
            found.accelerations[: len(steps)] = [step.udot for step in steps]
        return found

    def _rows(self, steps: Sequence[Any], after: np.ndarray, y: np.ndarray) -> Steps:
        rows, nu = self._row_count(steps), self.model.nu
        return Steps(
            t=np.array([step.t for step in steps]),
            h=np.array([step.h for step in steps]),
            y=np.hstack([y, np.zeros((len(steps), 1))]),
            after=after,
            time=np.empty(rows),
            states=np.zeros((rows, self.ny + 1)),
            accelerations=np.empty((rows, nu)),
            push=np.empty((rows, nu)),
        )

    def _row_count(self, steps: Sequence[Any]) -> int:
        """Return how many evaluations some steps have."""
        begins = sum(step.ratio == 0.0 for step in steps) if steps[0].method == driver.ALPHA else 0
        return self.methods[steps[0].method] * len(steps) + begins

    def _add_parameters(self, kept: Steps, bar_p: np.ndarray) -> None:
        """Add the gradients by the parameters: of the forces that the accelerations need beyond the loads."""
        known: dict[int, float] = {}
        for along in self.model.beside:
            bar_p[along.number] -= along.weights @ [self._product(each, kept, known) for each in along.evaluators]

    def _product(self, evaluator: Evaluator, kept: Steps, known: dict[int, float]) -> float:
        """Return the sum of the products of the gradients with these forces, less those of the system itself."""
        own = self.model.evaluator
        if evaluator is own:
            return 0.0
        if evaluator in self.sprung:
            assert self.ends is not None
            return -float(self.ends.products[self.sprung.index(evaluator)])
        if self._has_own_tree(evaluator) and evaluator.system.loads == own.system.loads:  # but for joints' elements
            if same_joints(own, evaluator):  # of a start value
                return 0.0
            return float(self.back.joints[0]) - hinge_product(self.equations(evaluator), kept, len(kept.time))
        for each in (own, evaluator):
            if id(each) not in known:
                known[id(each)] = self._whole_product(each, kept)
        return known[id(evaluator)] - known[id(own)]

    def _whole_product(self, evaluator: Evaluator, kept: Steps) -> float:
        """Return the sum of the products of the gradients with all forces of a system, and what its loops add."""
        if self.loops is None:
            return float(np.vdot(kept.push, self.forces(evaluator, kept)))
        given = self.equations(evaluator), self.loops, kept, len(kept.time), len(kept.t)
        return float(closed_product(*given, np.zeros(self.model.nu)))

    def forces(self, evaluator: Evaluator, kept: Steps) -> np.ndarray:
        """Return the forces (rows, nu) that the accelerations of the stages need beyond the loads of a system."""
        found = np.empty_like(kept.accelerations)
        force_rows(self.equations(evaluator), kept, len(found), found)
        return found

    def equations(self, evaluator: Evaluator) -> Equations:
        """Return the equations of the system, or of one beside it, which are made once."""
        if id(evaluator) not in self.known:
            self.known[id(evaluator)] = build_equations(evaluator.packed, evaluator.loading, evaluator.data)
        return self.known[id(evaluator)]


def in_space(work: Work) -> Work:
    """Return the work of constraints, by which systems that move in a plane are evaluated as all others."""
    return work._replace(paths=work.paths._replace(planar=False))


def _dampers(evaluator: Evaluator) -> np.ndarray:
    """Return the damping between modes of all bodies, which compiled stages take for no parameter."""
    modal = evaluator.packed.model.modal
    return np.zeros(0) if modal is None else modal.dampers


def _alpha_steps(steps: Sequence[Any]) -> AlphaSteps:
    first = np.full(len(steps), -1)
    begins = [k for k, step in enumerate(steps) if step.ratio == 0.0]
    first[begins] = len(steps) + np.arange(len(begins))
    ratio = np.array([step.ratio for step in steps])
    return AlphaSteps(ratio, np.array([step.algorithmic for step in steps]), first)
