"""Changes through many explicit steps of a small system, in compiled code: theory 5.9.

The derivatives of the rates at a stage are as many products of the way back (stages_back.py) as there are speeds, each
of about an evaluation: for few speeds far less than the tangent and the differences that Python makes of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, takewhile
from typing import Any, NamedTuple

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluate import GOOD
from modalprep.multibody.integration import driver
from modalprep.multibody.integration.dop853_table import STAGES, A, B
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.kernels.tangents.pulled_rates import pull_rates
from modalprep.sensitivity.jumps import Jump
from modalprep.sensitivity.solutions import accelerate
from modalprep.sensitivity.stages_back import evaluate_stages, pulled_products, restore, stage_of
from modalprep.sensitivity.tangent_maps import Layout
from modalprep.sensitivity.trace import Step
from modalprep.sensitivity.way_back import NOT_POSITIVE, WayBack

FEW = 24  # speeds
MOST = 2**21  # numbers of the derivatives that are kept at once


class StepSlopes(NamedTuple):
    """Derivatives at the stages of an explicit step.

    Attributes
    ----------
    h : float
        s.
    raw : (nx + nu,)
        State at its end, quaternions as they came.
    by_state : (12, nx + nu, nx + nu)
        Of the rates.
    by_parameter : (12, nu, np)
        Of the accelerations.
    """

    layout: Layout
    h: float
    raw: np.ndarray
    by_state: np.ndarray
    by_parameter: np.ndarray

    def forward(self, dz: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the changes (ny + 2 nu, k) after the step, by those before and of the parameters (np, k)."""
        ny = len(self.raw)
        nu, dy = self.by_parameter.shape[1], dz[:ny]
        rates = np.empty((STAGES, *dy.shape))
        for i in range(STAGES):
            rates[i] = self.by_state[i] @ (dy + self.h * np.tensordot(A[i][:i], rates[:i], 1))
            rates[i, ny - nu :] += self.by_parameter[i] @ dp
        found = np.zeros_like(dz)
        found[:ny] = self.layout.normalised(self.raw, dy + self.h * np.tensordot(B, rates, 1))
        return found


class WayForward:
    """The changes through explicit steps of a system to which the way back applies.

    Parameters
    ----------
    back : WayBack
        Its arrays are used.
    """

    def __init__(self, back: WayBack) -> None:
        self.back, self.model = back, back.model
        self.at_once = max(1, MOST // (STAGES * back.ny**2))

    def count(self, trace: Sequence[Step | Jump], begin: int) -> int:
        """Return how many steps from `begin` on are taken at once; 0 where it does not apply."""
        first = trace[begin]
        if not (isinstance(first, Step) and first.method == driver.EXPLICIT):
            return 0
        ahead = islice(trace, begin, begin + self.at_once)
        return sum(1 for _ in takewhile(lambda step: self.back.is_like(step, first), ahead))

    def maps(self, steps: Sequence[Any]) -> list[StepSlopes]:
        """Return the maps of some steps.

        Raises
        ------
        SimulationError
            Where the mass matrix is not positive.
        """
        self.model.at(steps[0].begin)
        nu, ny, rows = self.model.nu, self.back.ny, STAGES * len(steps)
        kept = self.back.kept(steps, np.zeros((len(steps), ny)))
        ends, mobility = np.empty((len(steps), ny + 1)), np.empty((rows, nu, nu))
        slopes = np.empty((rows, ny, ny))
        status = steps_slopes(self.back.stages, kept, len(steps), self.back.back, np.zeros(ny), mobility, ends, slopes)
        if status != GOOD:
            raise SimulationError(f"derivatives of the run: {NOT_POSITIVE}")
        by_parameter = np.zeros((rows, nu, len(self.model.parameters)))
        forces: dict[int, np.ndarray] = {}  # by evaluators, of which many parameters share one
        for along in self.model.beside:
            for evaluator in along.evaluators:
                if id(evaluator) not in forces:
                    forces[id(evaluator)] = self.back.forces(evaluator, kept)
            changes = along.derivative([forces[id(evaluator)] for evaluator in along.evaluators])
            by_parameter[:, :, along.number] = -np.einsum("rij,rj->ri", mobility, changes)
        shape = (len(steps), STAGES)
        parts = slopes.reshape(*shape, ny, ny), by_parameter.reshape(*shape, nu, -1)
        each = zip([step.h for step in steps], ends[:, :ny], *parts, strict=True)
        return [StepSlopes(self.model.layout, *own) for own in each]


@compile_kernel
def steps_slopes(stages, steps, count, back, unit, mobility, ends, slopes):
    """Write, for all stages of `count` steps, the derivatives of the rates by the states and the inverse of the mass.

    Parameters
    ----------
    unit : (nx + nu,)
        Zeros.
    mobility : (12 k, nu, nu)
    ends : (k, nx + nu + 1)
        Of the steps, quaternions as they came.
    slopes : (12 k, nx + nu, nx + nu)

    Returns
    -------
    int
        GOOD, or the link whose pivot is not positive at a stage.
    """
    for k in range(count):
        status = evaluate_stages(stages, steps, k, back)
        if status != GOOD:
            return status
        copy(back.raw, ends[k])
        for i in range(STAGES):
            row = STAGES * k + i
            _stage_slopes(stage_of(stages, i), i, steps, row, back, unit, mobility[row], slopes[row])
    return GOOD


@compile_kernel
def _stage_slopes(eq, i, steps, row, back, unit, mobility, slopes):
    """Write those of stage i: all solutions with the factor come before what it has overwritten is put back."""
    nx, nu = eq.model.nx, len(eq.tau)
    force = unit[nx:]
    for c in range(nu):
        force[c] = 1.0
        accelerate(eq, force, mobility[c])
        force[c] = 0.0
    restore(eq, back.kept, i)
    for c in range(nx + nu):
        unit[c] = 1.0
        back.by_x[:] = 0.0
        back.by_u[:] = 0.0
        if c >= nx:
            outward_tangents(eq.model, eq.data, back.work)  # whose wrenches the product adds up
            pulled_products(eq, steps.time[row], mobility[c - nx], back)
        pull_rates(eq.model, steps.states[row], unit, back.by_x, back.by_u, slopes[c])
        unit[c] = 0.0
