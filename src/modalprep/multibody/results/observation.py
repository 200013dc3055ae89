"""All channels of a system at one state, written to one row of numbers in compiled code: see `channels`."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_allocating, compile_inline, compile_kernel
from modalprep.multibody.elements import registry
from modalprep.multibody.elements.registry import prescribe
from modalprep.multibody.evaluation.evaluate import FAILED_CALLBACK, GOOD, evaluate
from modalprep.multibody.integration.momentum import restore_momenta
from modalprep.multibody.kernels.algebra.matrices import (
    product_transposed,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rotations import rotation_quaternion
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    axpy3,
    copy,
    dot3,
    get3,
    get6,
    get9,
    get_angular,
)
from modalprep.multibody.kernels.articulated_body import outward, reactions
from modalprep.multibody.kernels.closed_loops.constraint_forces import complete_bias_forces
from modalprep.multibody.kernels.closed_loops.constraints import line_of_action
from modalprep.multibody.kernels.closed_loops.multipliers import coupler_force
from modalprep.multibody.kernels.closed_loops.projection import CLOSED, MOST_STEPS, project_state
from modalprep.multibody.kernels.energy import body_sums
from modalprep.multibody.kernels.free_parts import sum_parts
from modalprep.multibody.kernels.interfaces import carried, node_acceleration, node_state, world
from modalprep.multibody.kernels.joints import along_axis
from modalprep.multibody.kernels.modal_interfaces import deflection
from modalprep.multibody.results.channels import (
    ACCELERATION,
    ANGULAR,
    GRAVITY,
    HINGE_FORCE,
    KINETIC,
    LINEAR,
    MOTION,
    POWER_IN,
    REACTION,
    STATE,
    STORED,
    STRAIN,
    SUMS,
    WEIGHT,
    WORK,
)

STILL = 1e-6  # m/s: a slower motion counts as none


@compile_allocating
def record(eq, run, columns, times, states, soft, rows):
    """Write the channels at all times, ``rows (nt, width)``; returns whether no callback raised.

    Parameters
    ----------
    times, states : (nt,), (nt, nx + nu + 1)
        States of an integration between its steps: they are brought back onto closed loops, and to the momenta of
        free parts.
    soft : float
        1 / K of the softest mode: the metric's modal rows are then ``1 + soft K``.
    """
    y, ydot = np.zeros(states.shape[1]), np.zeros(states.shape[1])
    for k in range(len(times)):
        copy(states[k], y)
        prescribe(eq.loads, times[k], eq.motion)
        eq.hinge[:] = 0.0
        project_state(
            eq.cons,
            eq.model,
            eq.data,
            eq.trial,
            y,
            eq.motion,
            times[k],
            eq.work,
            eq.hinge,
            soft,
            CLOSED,
            MOST_STEPS,
            False,
        )
        if len(run.kept) > 0 and times[k] >= run.kept[0].time:
            restore_momenta(eq, run, times[k], y, 0.0)
        status = evaluate(eq, times[k], y, ydot)
        if status == FAILED_CALLBACK:
            return False
        if status != GOOD:  # the state is known, its accelerations are not
            ydot[:] = np.nan
            for i in range(len(eq.model.links)):
                eq.data.links[i].acceleration[:] = np.nan
        observe(eq, columns, times[k], y, ydot, rows[k])
    return True


@compile_kernel
def observe(eq, columns, t, y, ydot, row):
    """Write all channels of a state to ``row (width,)``, after `evaluate`; only accelerations are left in the data."""
    model, data = eq.model, eq.data
    complete_bias_forces(eq.cons, model, data, y, eq.motion, t, eq.work, eq.tau)
    reactions(model, data, columns.reactions)
    row[:SUMS] = 0.0
    row[WORK], row[POWER_IN] = y[-1], ydot[-1]
    row[STORED], row[GRAVITY] = eq.shared[0].stored, eq.shared[0].potential
    _joints(eq, columns, y, ydot, row)
    _closures(eq.cons, model, eq.work, columns.closures, row)
    outward(model, data, y, eq.motion)  # `inward` made articulated inertias of the bodies' own
    world(model, data)
    _elements(eq.loads, columns, model, data, t, row)
    for i in range(len(columns.wrenches)):
        _wrench(model, data, columns, i, row)
    _begin_momenta(model, data, columns, row)
    for i in range(len(columns.bodies)):
        link, first, count, column = columns.bodies[i]
        _body(model, data, link, first, y, row)
        _sums(model, data, columns, link, row)
        for node in range(count):
            _interface(model, data, link, node, row, column + 12 * node)
    _end_momenta(columns, row)
    for i in range(len(columns.motions)):
        _motion(model, data, columns.motions[i, 0], columns.motions[i, 1], y, ydot, row)


@compile_inline
def _write(row, c, v):
    row[c], row[c + 1], row[c + 2] = v


@compile_inline
def _add(row, c, v):
    row[c] += v[0]
    row[c + 1] += v[1]
    row[c + 2] += v[2]


@compile_kernel
def _joints(eq, columns, y, ydot, row):
    for k in range(len(columns.joints)):
        source, i, j, c = columns.joints[k]
        if source == STATE:
            row[c] = y[i]
        elif source == HINGE_FORCE:
            row[c] = eq.tau[i]
        elif source == MOTION:
            row[c] = eq.motion[i, j]
        elif source == REACTION:
            whole = along_axis(eq.model.links[i], get6(columns.reactions[i]))
            row[c] = whole - coupler_force(eq.cons, eq.work, i)
        elif source == WEIGHT:
            row[c] = eq.data.links[i].mass
        elif source == ACCELERATION:
            row[c] = ydot[i]


@compile_kernel
def _closures(cons, model, work, closures, row):
    """Largest gap, then the multiplier of a coupler, or force and torque on b, at b, in the axes of a."""
    if cons is None:
        return
    for k in range(len(closures)):
        first, count, couples, c = closures[k]
        worst, f, t = 0.0, ZERO3, ZERO3
        for i in range(first, first + count):
            if not abs(work.phi[i]) <= worst:  # NaN counts
                worst = abs(work.phi[i])
            f = axpy3(f, work.multiplier[i], line_of_action(work, i, 0))
            t = axpy3(t, work.multiplier[i], line_of_action(work, i, 6))
        row[c] = worst
        if couples:
            row[c + 1] = work.multiplier[first]
        else:
            turn = get9(work.ends[2 * k].rotation)
            link = cons.ends[2 * k].link
            f, t = transposed_times(turn, f), transposed_times(turn, t)
            if link >= 0:
                align = get9(model.links[link].align)
                f, t = times(align, f), times(align, t)
            _write(row, c + 1, f)
            _write(row, c + 4, t)


@compile_kernel
def _elements(loads, columns, model, data, t, row):
    """Two numbers of each force element that has channels."""
    for k in range(len(columns.elements)):
        kind, i, _, c = columns.elements[k]
        row[c], row[c + 1] = registry.observe(loads, kind, i, model, data, t)


@compile_kernel
def _wrench(model, data, columns, i, row):
    """Force and torque of the parent on a joint's child at the child's root, in the axes of the parent's interface."""
    link, parent, node, c = columns.wrenches[i]
    base = get9(data.links[link].orientation)
    f = times(base, get3(columns.reactions[link]))
    t = times(base, get_angular(columns.reactions[link]))
    if parent >= 0:
        _, turn, _, _ = node_state(model, data, parent, node)
        f, t = transposed_times(turn, f), transposed_times(turn, t)
    _write(row, c, f)
    _write(row, c + 3, t)


@compile_kernel
def _body(model, data, link, c, y, row):
    """Modal coordinates, origin and orientation of a body's frame."""
    n, x = model.links[link].modes, model.links[link].xq
    for a in range(n):
        row[c + a] = y[x + a]
    _write(row, c + n, get3(data.links[link].position))
    e = rotation_quaternion(product_transposed(get9(data.links[link].orientation), get9(model.links[link].align)))
    row[c + n + 3], row[c + n + 4], row[c + n + 5], row[c + n + 6] = e


@compile_kernel
def _motion(model, data, link, c, y, ydot, row):
    """Specific acceleration, angular velocity and acceleration in body axes; rates and accelerations of the modes."""
    own = data.links[link]
    align = get9(model.links[link].align)
    _write(row, c, times(align, get3(own.acceleration)))
    _write(row, c + 3, times(align, get3(own.omega)))
    _write(row, c + 6, times(align, get_angular(own.acceleration)))
    n = model.links[link].modes
    u = model.nx + model.links[link].uq
    for a in range(n):
        row[c + 9 + a], row[c + 9 + n + a] = y[u + a], ydot[u + a]


@compile_kernel
def _begin_momenta(model, data, columns, row):
    """Write the momenta of the parts that nothing holds, and zero for their kinetic energies."""
    if len(columns.momenta) > 0:
        sum_parts(model, data, columns.part, columns.sums)
    for k in range(len(columns.momenta)):
        own = columns.sums[k]
        c = columns.momenta[k, 1]
        _write(row, c, get3(own.linear))
        _write(row, c + 3, get3(own.angular))
        row[c + 6] = 0.0


@compile_kernel
def _end_momenta(columns, row):
    """Write after the momenta of a part how large they can be: ``|p| + sqrt(2 m T)``, ``sqrt(2 J T)``.

    T is the energy (J) of the motion about the mass centre, that of `STILL` at least, ``J = sum m r^2``: Cauchy and
    Schwarz.
    """
    for k in range(len(columns.momenta)):
        own = columns.sums[k]
        c = columns.momenta[k, 1]
        pp = dot3(get3(own.linear), get3(own.linear))
        twice = max(own.mass * STILL * STILL, 2.0 * row[c + 6] - pp / own.mass)
        polar = 0.5 * (own.inertia[0] + own.inertia[3] + own.inertia[5])
        row[c + 6] = np.sqrt(pp) + np.sqrt(own.mass * twice)
        row[c + 7] = np.sqrt(polar * twice)


@compile_kernel
def _sums(model, data, columns, link, row):
    """Add the energies and momenta of a link's body."""
    sums = body_sums(model, data, link)
    if columns.part[link] >= 0:
        row[columns.momenta[columns.part[link], 1] + 6] += sums.kinetic
    row[KINETIC] += sums.kinetic
    row[STRAIN] += sums.strain
    row[GRAVITY] += sums.gravity
    _add(row, LINEAR, sums.linear)
    _add(row, ANGULAR, sums.angular)


@compile_kernel
def _interface(model, data, link, node, row, c):
    """Position, velocity and acceleration (inertial axes), and deflection (body axes) of an interface."""
    position, _, velocity, _ = node_state(model, data, link, node)
    linear, _ = node_acceleration(model, data, link, node, 1.0)
    moved = deflection(data.modal, model, link, node)
    _write(row, c, position)
    _write(row, c + 3, velocity)
    _write(row, c + 6, times(get9(model.links[link].align), moved))
    _write(row, c + 9, axpy3(linear, -1.0, carried(data, position, velocity)))
