"""One evaluation of a loaded system for all integrators: its derivative, or the accelerations of an implicit stage.

States of the integrators are ``[coordinates | speeds | work]``: the work of loads and prescribed hinges, less what
dampers take, is integrated along, so that the energy balance checks the whole run.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from modalprep.compiler.by_address import Pattern, by_address, layout
from modalprep.compiler.callbacks import call_address
from modalprep.compiler.jit import compile_inline, compile_kernel, compile_once
from modalprep.multibody.elements.registry import Loads, apply, prescribe
from modalprep.multibody.evaluation.implicit_rows import with_force_elements
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.kernels.algebra.matrices import inertia_times
from modalprep.multibody.kernels.algebra.tuples import (
    add6,
    copy,
    get6,
)
from modalprep.multibody.kernels.articulated_body import (
    clear_wrenches,
    forward,
    forward_bias,
    inward,
    inward_bias,
    kinematic,
    outward,
    outward_in_world,
)
from modalprep.multibody.kernels.closed_loops.compliance import (
    constrain_increment,
    copy_loop_states,
    implicit_accelerations,
    set_targets,
)
from modalprep.multibody.kernels.closed_loops.constraints import (
    Constraints,
    Work,
    constraint_residual,
    has_rows,
)
from modalprep.multibody.kernels.closed_loops.multipliers import (
    constraint_accelerations,
    constraint_power,
)
from modalprep.multibody.kernels.closed_loops.planar import moves_in_plane
from modalprep.multibody.kernels.closed_loops.planar_tree import planar_accelerations
from modalprep.multibody.kernels.closed_loops.projection import CLOSED, project_state
from modalprep.multibody.kernels.closed_loops.responses import inward_with_rows
from modalprep.multibody.kernels.data import Data, Model
from modalprep.multibody.kernels.energy import body_sums
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.kernels.joints import along_axis
from modalprep.multibody.kernels.loads.deployment import Reels, add_deployment_forces, set_deployed_masses
from modalprep.multibody.kernels.loads.variable_mass import refresh
from modalprep.multibody.kernels.modal import add_modal_loads
from modalprep.multibody.kernels.modal_dampers import damper_power, subtract_damper_forces
from modalprep.multibody.model.joint_types import PRESCRIBED
from modalprep.multibody.packing.constraints import constraint_work, no_constraints
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import blank

MOST_PROJECTIONS = 10
GOOD, FAILED_CALLBACK = -1, -2  # any other status is the link whose pivot is not positive
FLAGS = np.dtype(
    [
        ("loaded", np.int64),  # whether there are loads
        ("callback", np.int64),  # address of Python's loads, or 0
        ("reference", np.int64),  # address of the accelerations of the reference implementation, or 0
        ("measured", np.int64),  # whether `evaluate` also writes the energy
    ]
)
SHARED = np.dtype(
    [
        ("power", np.float64),  # W
        ("stored", np.float64),  # J, in springs
        ("potential", np.float64),  # J, of a planet and of buoyancy
        ("callback_power", np.float64),  # W
        ("raised", np.float64),  # 1 where a callback has raised
        ("energy", np.float64),  # J, of the whole system less the work: constant but for errors
        ("energy_size", np.float64),  # J, the largest of kinetic and strain energy and of the work
        ("energy_sum", np.float64),  # J, of the sizes of all parts, whose round-off it has
    ]
)


@by_address
class Equations(NamedTuple):
    """The equations of a loaded system: model and data, loads, constraints, what a step method adds."""

    model: Model
    data: Data
    trial: Data  # of states that are projected onto closed loops
    loads: Loads
    motion: np.ndarray  # (nl, 3)
    tau: np.ndarray  # (nu,)
    slope: np.ndarray  # (2, nu) of tau by the hinge's coordinate and speed
    hinge: np.ndarray  # (nu,) added to the hinges' inertias by an implicit step
    linear: np.ndarray  # (2, nu) stiffness and damping that an implicit step knows: modes, hinges
    flags: np.ndarray  # (1,) FLAGS
    state: np.ndarray  # (nx + nu,) what Python sees of the state
    reference: np.ndarray  # (nu,) accelerations of the reference implementation
    shared: np.ndarray  # (1,) SHARED
    cons: Constraints | None  # closed loops, without rows where there are none; None without `implicit`
    work: Work | None  # their scratch
    implicit: Constraints | None  # closed loops, springs and bushings: what an implicit step knows; None of nothing
    implicit_work: Work | None
    reels: Reels  # deployments


def build_equations(packed: Packed, loading: Loading, data: Data | None = None) -> Equations:
    """Return the arrays of a packed system and its loads; modal stiffness and damping stand in `linear`.

    `data` is that of an evaluation before, whose memory is used again; new if none is given.
    """
    loops = loading.loops
    implicit = with_force_elements(loops.arrays if loops else None, loading.arrays)
    cons = loops.arrays if loops else None if implicit is None else no_constraints(implicit.tables)
    data = data or packed.data()
    records: dict[str, Any] = {
        "model": packed.model,
        "data": data,
        "trial": loops.trial if loops else data,
        "loads": loading.arrays,
        "cons": cons,
        "work": loops.work if loops else None if cons is None else constraint_work(cons, packed),
        "implicit": implicit,
        "reels": loading.reels,
        "implicit_work": constraint_work(implicit, packed, size=loops.closing.size if loops else 1.0)
        if implicit
        else None,
    }
    given: dict[str, Any] = {"motion": loading.motion, "tau": loading.tau, "slope": loading.slope}
    key = "equations", *map(layout, records.values())
    pattern = packed.pattern(key, lambda: Pattern(Equations(**records, **given, **_own_arrays(packed)), tuple(given)))
    present = {name: record for name, record in records.items() if record is not None}
    equations = pattern.copy(**present, **given)
    if loading.active:
        equations.flags["loaded"] = 1
    return equations


def _own_arrays(packed: Packed) -> dict[str, Any]:
    """Return the arrays of `Equations` that belong to one run."""
    nu = packed.nu
    return {
        "hinge": np.zeros(nu),
        "linear": packed.linear,
        "flags": blank(FLAGS, 1),
        "state": np.zeros(packed.nx + nu),
        "reference": np.zeros(nu),
        "shared": blank(SHARED, 1),
    }


@compile_kernel
def load(eq, t, y):
    """Kinematics and all loads at a state, up to `inward`; False when a callback raised."""
    model, data = eq.model, eq.data
    prescribe(eq.loads, t, eq.motion)
    refresh(eq.loads.fill, eq.loads.environment.tables, model, data, t)
    set_deployed_masses(eq.reels, model, data, y, eq.motion)
    if eq.flags[0].loaded or has_rows(eq.cons):
        outward_in_world(model, data, y, eq.motion)
    else:
        outward(model, data, y, eq.motion)
    eq.shared[0].power = 0.0
    if eq.flags[0].loaded:
        energies = apply(eq.loads, model, data, y, t, eq.tau, eq.slope)
        eq.shared[0].power, eq.shared[0].stored, eq.shared[0].potential = energies
    reeled, bent = add_deployment_forces(eq.reels, model, data, y, eq.motion, eq.tau, eq.slope)
    eq.shared[0].power += reeled
    eq.shared[0].stored += bent
    if eq.flags[0].callback:
        copy(y, eq.state)
        call_address(eq.flags[0].callback, t)
        eq.shared[0].power += eq.shared[0].callback_power
        return eq.shared[0].raised == 0.0
    return True


@compile_kernel
def evaluate(eq, t, y, ydot):
    """Time derivative of ``[coordinates | speeds | work]``; returns GOOD, FAILED_CALLBACK or the link that failed."""
    nx = eq.model.nx
    nu = len(eq.tau)
    if not load(eq, t, y):
        return FAILED_CALLBACK
    if eq.flags[0].measured:
        _measure(eq, y[nx + nu])
    status = respond(eq, t, y, ydot)
    if status >= 0:
        return status
    ydot[nx + nu] = power(eq, eq.work, y)
    if eq.flags[0].reference:
        copy(y, eq.state)
        call_address(eq.flags[0].reference, t)
        copy(eq.reference, ydot[nx : nx + nu])
    return GOOD


@compile_kernel
def evaluate_measured(eq, t, y, ydot):
    """Do as `evaluate`, and write the energy to `shared`."""
    eq.flags[0].measured = 1
    status = evaluate(eq, t, y, ydot)
    eq.flags[0].measured = 0
    return status


@compile_once
def _measure(eq, work):
    """Write the energy of the whole system, after `load`."""
    model = eq.model
    data = eq.data
    shared = eq.shared[0]
    if not (eq.flags[0].loaded or has_rows(eq.cons)):
        world(model, data)
    kinetic, strain, gravity = 0.0, 0.0, 0.0
    for i in range(len(model.links)):
        sums = body_sums(model, data, i)
        kinetic = kinetic + sums.kinetic
        strain = strain + sums.strain
        gravity = gravity + sums.gravity
    shared.energy = kinetic + strain + gravity + shared.stored + shared.potential - work
    shared.energy_size = max(kinetic, strain, abs(work))
    shared.energy_sum = kinetic + strain + abs(gravity) + abs(shared.stored) + abs(shared.potential) + abs(work)


@partial(compile_kernel, forceinline=True)
def respond(eq, t, y, ydot):
    """Rates of the coordinates and accelerations after `load`; returns GOOD or the link that failed."""
    udot = ydot[eq.model.nx : eq.model.nx + len(eq.tau)]
    status = _accelerations(eq.cons, eq, t, y, udot)
    if status >= 0:
        return status
    kinematic(eq.model, y, ydot)
    return GOOD


@compile_inline
def _accelerations(cons, eq, t, y, udot):
    """Accelerations with constraints, which may be None; returns the status of `inward`."""
    if cons is not None:
        if len(cons.rows) > 0:
            return _constrained(cons, eq, t, y, udot)
    status = inward(eq.model, eq.data, eq.tau, None, 0.0, 0.0)
    if status < 0:
        forward(eq.model, eq.data, eq.tau, udot)
    return status


@compile_inline
def _constrained(cons, eq, t, y, udot):
    """Accelerations with constraints; returns the status of `inward`."""
    model, data, work = eq.model, eq.data, eq.work
    if moves_in_plane(work, data):
        return planar_accelerations(cons, model, data, t, work, eq.tau, udot)
    constraint_residual(cons, model, data, y, eq.motion, t, work, True)
    status = inward_with_rows(cons, model, data, work, eq.tau, None, 0.0, 0.0)
    if status < 0:
        constraint_accelerations(cons, model, data, work, eq.tau, udot)
    return status


@compile_once
def close(eq, t, y, stiff, factored):
    """Project a state onto closed loops, see `project_state`; returns the number of changes, -1 on failure.

    `factored`: the last `evaluate` was at this state, or very near to it, and `stiff` is zero.
    """
    if eq.cons is None:
        return 0
    prescribe(eq.loads, t, eq.motion)
    return project_state(
        eq.cons,
        eq.model,
        eq.data,
        eq.trial,
        y,
        eq.motion,
        t,
        eq.work,
        eq.hinge,
        stiff,
        CLOSED,
        MOST_PROJECTIONS,
        factored,
    )


@compile_kernel
def hinge_slopes(eq):
    """Write the hinges' stiffness and damping of the last `load` to `linear`, negative ones as zero."""
    for i in range(len(eq.model.links)):
        for u in range(eq.model.links[i].u, eq.model.links[i].uq):
            eq.linear[0, u] = max(0.0, -eq.slope[0, u])
            eq.linear[1, u] = max(0.0, -eq.slope[1, u])


@compile_once
def solve_implicit(eq, t, y, c1, c2, by_rate, by_place, places, out):
    """Solve ``(M + c1 D + c2 K) out = F - D by_rate - K by_place`` after `load`; returns the status of `inward`.

    D and K are those of modes (dampers between them too) and hinges (`linear`) and of springs and bushings. Closed
    loops constrain accelerations, or with `places` the coordinates to which ``c2 out + by_place`` leads from y.
    """
    model, data = eq.model, eq.data
    copy_loop_states(eq.work, eq.implicit_work)
    constraint_residual(eq.implicit, model, data, y, eq.motion, t, eq.implicit_work, True)
    set_targets(eq.implicit, model, data, eq.implicit_work, c1, c2, places, by_rate, by_place)
    for u in range(len(out)):
        out[u] = -eq.linear[1, u] * by_rate[u] - eq.linear[0, u] * by_place[u]
    subtract_damper_forces(data.modal, model, 1.0, by_rate, out)
    for i in range(len(model.links)):
        for u in range(model.links[i].u, model.links[i].uq):
            eq.hinge[u] = c1 * eq.linear[1, u] + c2 * eq.linear[0, u]
            eq.tau[u] += out[u]
    add_modal_loads(data.modal, model, out)
    status = inward_with_rows(eq.implicit, model, data, eq.implicit_work, eq.tau, eq.hinge, c1, c2)
    if status < 0:
        implicit_accelerations(eq.implicit, model, data, eq.implicit_work, places, eq.tau, out)
    return status


@compile_kernel
def smooth(eq, c1, c2, e, scratch):
    """Replace ``e (nu,)`` by ``(M + c1 D + c2 K)^-1 M e``, its rows on closed loops, after `solve_implicit`."""
    model, data, tau = eq.model, eq.data, eq.tau
    clear_wrenches(model, data)
    for u in range(len(tau)):
        tau[u] = -(c1 * eq.linear[1, u] + c2 * eq.linear[0, u]) * e[u]
    subtract_damper_forces(data.modal, model, c1, e, tau)
    add_modal_loads(data.modal, model, tau)
    inward_bias(model, data, tau)
    forward_bias(model, data, tau, scratch)
    tau[:] = 0.0
    for u in range(len(e)):
        e[u] += scratch[u]
    constrain_increment(eq.implicit, model, data, eq.implicit_work, e)


@compile_once
def keep_slow(eq, t, y, c1, c2, times, e, scratch):
    """Take the errors of vibrations off ``e (nu,)``: `smooth` it at (t, y) so many `times` by a long step (c1, c2)."""
    scratch[:] = 0.0
    load(eq, t, y)
    solve_implicit(eq, t, y, c1, c2, scratch, scratch, False, eq.reference)
    for _ in range(times):
        smooth(eq, c1, c2, e, scratch)


@compile_kernel
def power(eq, work, y):
    """Power (W) of loads, prescribed hinges and prescribed values of `work` less modal damping, after `forward`."""
    model, data, nx = eq.model, eq.data, eq.model.nx
    total = eq.shared[0].power + constraint_power(eq.cons, work, eq.motion)
    for i in range(len(model.links)):
        if model.links[i].joint == PRESCRIBED:
            own = data.links[i]
            f = add6(inertia_times(own.M, own.H, own.J, get6(own.acceleration)), get6(own.force))
            total += along_axis(model.links[i], f) * eq.motion[i, 1]
        for u in range(model.links[i].uq, model.links[i].uq + model.links[i].modes):
            total -= eq.linear[1, u] * y[nx + u] * y[nx + u]
        total -= damper_power(data.modal, model, i)
    return total
