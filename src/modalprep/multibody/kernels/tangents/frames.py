"""Motion of frames on links and interfaces with all columns, for what acts there or is read there."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import product, product_transposed, times, transposed_times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    cross,
    get3,
    get9,
    get_angular,
    put3,
    put9,
    sub3,
    take3,
)
from modalprep.multibody.kernels.interfaces import free_position
from modalprep.multibody.kernels.tangents.bodies import flexible_slopes
from modalprep.multibody.kernels.tangents.outward import mode_columns, put_twist, shifted_twist
from modalprep.multibody.kernels.tangents.turns import add_turn_curvature, turn_interface


@compile_kernel
def link_frame(model, data, work, link, place, motion, columns):
    """Write the motion of a frame that is fixed to a link at `place` (3,), axes of the link; after `outward_tangents`.

    The frame has the axes of the link's body. ``motion (24,)`` is its position and orientation (9, by rows) in the axes
    of the ground, then velocity and acceleration (6 each) in its own; ``columns (6, 4, nu)`` are J, V, b by
    coordinates, b by speeds in its own axes, zero where nothing is written.
    """
    base = get9(data.links[link].orientation)
    frame = work.frames[link]
    arm = times(base, get3(place))
    R = product_transposed(base, get9(model.links[link].align))
    V = shifted_twist(get3(frame.velocity), get_angular(frame.velocity), arm)
    a = shifted_twist(get3(frame.acceleration), get_angular(frame.acceleration), arm)
    _put_motion(motion, add3(get3(data.links[link].position), arm), R, V, a)
    _path(work.modes, model, data, work, link, get3(motion), R, columns)


@compile_kernel
def end_frame(model, data, work, link, node, motion, columns):
    """Write the motion of an interface of a flexible body, as `link_frame`."""
    k = len(work.modes.bends.p) - 2
    base = get9(data.links[link].orientation)
    align = get9(model.links[link].align)
    moved, turn = turn_interface(data.modal, model, work.modes, link, node, k)
    r = add3(free_position(model, link, node), moved)
    R = product_transposed(product(base, turn), align)
    V, a = mode_columns(model, data, work, link, k, r, ZERO3)
    _put_motion(motion, add3(get3(data.links[link].position), times(base, r)), R, V, a)
    for m in range(model.links[link].modes):
        _put_columns(columns, model.links[link].uq + m, work.modes.turns.columns[k, :, m], ZERO3, R)
    _path(work.modes, model, data, work, link, get3(motion), R, columns)


@compile_kernel
def end_curvature(model, data, work, link, node, wrench, out):
    """Write the derivative by q of what a wrench (6,) at an interface does on its modes to ``out (N, N)``, zeros.

    It turns with the interface, and is given in the axes of the link.
    """
    k = len(work.modes.bends.p) - 2
    turn_interface(data.modal, model, work.modes, link, node, k)
    add_turn_curvature(model, work.modes, link, node, k, get3(wrench), get_angular(wrench), out)


@compile_kernel
def field_tangent(model, data, work, i, g, gradient):
    """Write force and derivatives by q of link i's body in a field ``g + gradient x`` to the work, axes of the link."""
    flexible_slopes(data.modal, model, work.modes, i, get3(g), get9(gradient), ZERO3)


@compile_inline
def _put_motion(motion, p, R, V, a):
    """Write the motion of a frame, given in the axes of the ground."""
    put3(motion, p)
    put9(motion[3:], R)
    put_twist(motion, 12, (transposed_times(R, V[0]), transposed_times(R, V[1])))
    put_twist(motion, 18, (transposed_times(R, a[0]), transposed_times(R, a[1])))


@compile_inline
def _path(modes, model, data, work, link, p, R, columns):
    """Write the columns of all speeds that move a link, at a point p with axes R."""
    i = link
    while i < len(model.links):
        own = model.links[i]
        arm = sub3(p, get3(data.links[i].position))
        for s in range(own.uq - own.u):
            _put_columns(columns, own.u + s, work.columns[work.frames[i].first + s], arm, R)
        if modes is not None:
            if own.phi >= 0:
                for m in range(model.links[own.parent].modes):
                    u = model.links[own.parent].uq + m
                    _put_columns(columns, u, modes.turns.columns[own.phi, :, m], arm, R)
        i = own.parent


@compile_inline
def _put_columns(out, u, column, arm, R):
    """Write the column of speed u, shifted and turned."""
    for part in range(4):
        linear, angular = take3(column, 6 * part), take3(column, 6 * part + 3)
        x = transposed_times(R, add3(linear, cross(angular, arm)))
        y = transposed_times(R, angular)
        for c in range(3):
            out[c, part, u], out[3 + c, part, u] = x[c], y[c]
