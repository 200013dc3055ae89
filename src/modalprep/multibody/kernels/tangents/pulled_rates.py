"""Gradients by the coordinates and speeds of a state, from those by their rates and by increments in body axes."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import times, transposed_times
from modalprep.multibody.kernels.algebra.rotations import quaternion_rotation
from modalprep.multibody.kernels.algebra.tuples import cross, get3, put3, sub3
from modalprep.multibody.model.joint_types import FREE, KINDS, REVOLUTE, SLIDING, WITH_QUATERNION

PLACES = tuple(kind.quaternion for kind in KINDS)


@compile_kernel
def pull_rates(model, y, bar, by_x, by_u, out):
    """Write the gradient (nx + nu,) by a state of ``bar . x'`` less ``by_x . dx + by_u . du``.

    Parameters
    ----------
    bar : (nx,)
        Of the rates of the coordinates.
    by_x, by_u : (nu,)
        Of increments in body axes and of the speeds.
    """
    for i in range(len(model.links)):
        link = model.links[i]
        if link.joint == REVOLUTE or link.joint == SLIDING:
            out[link.x] = -by_x[link.u]
            out[model.nx + link.u] = bar[link.x] - by_u[link.u]
        elif link.joint in WITH_QUATERNION:
            _turning(model, link, y, bar, by_x, by_u, out)
        for a in range(link.modes):
            out[link.xq + a] = -by_x[link.uq + a]
            out[model.nx + link.uq + a] = bar[link.xq + a] - by_u[link.uq + a]


@compile_inline
def _turning(model, link, y, bar, by_x, by_u, out):
    """Write the gradient of a joint that turns freely, and may travel; its quaternion may have any length."""
    moves = link.joint == FREE
    q, s = (link.x + 3, link.u + 3) if moves else (link.x, link.u)
    u = model.nx
    e, b = get4(y[q:]), get4(bar[q:])
    turn = get3(by_x[s:])
    if moves:
        R = quaternion_rotation(e)
        back = transposed_times(R, get3(bar[link.x :]))
        turn = sub3(turn, cross(get3(y[u + link.u :]), back))
        travel = times(R, get3(by_x[link.u :]))
        put3(out[link.x :], (-travel[0], -travel[1], -travel[2]))
        put3(out[u + link.u :], sub3(back, get3(by_u[link.u :])))
    rates = _turned(b, get3(y[u + s :]))
    f = 2.0 / (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    moved = _turned(e, turn)
    for c in range(4):
        out[q + c] = -0.5 * rates[c] - f * moved[c]
    put3(out[u + s :], sub3(_turned_back(e, b), get3(by_u[s:])))


@compile_inline
def get4(a):
    """Return the first four numbers."""
    return a[0], a[1], a[2], a[3]


@compile_inline
def _turned(e, w):
    """Return ``E(e) w``: twice the rate of a quaternion at an angular velocity in its axes."""
    return (
        -e[1] * w[0] - e[2] * w[1] - e[3] * w[2],
        e[0] * w[0] - e[3] * w[1] + e[2] * w[2],
        e[3] * w[0] + e[0] * w[1] - e[1] * w[2],
        -e[2] * w[0] + e[1] * w[1] + e[0] * w[2],
    )


@compile_inline
def _turned_back(e, b):
    """Return ``E(e)' b / 2``."""
    return (
        0.5 * (-e[1] * b[0] + e[0] * b[1] + e[3] * b[2] - e[2] * b[3]),
        0.5 * (-e[2] * b[0] - e[3] * b[1] + e[0] * b[2] + e[1] * b[3]),
        0.5 * (-e[3] * b[0] + e[2] * b[1] - e[1] * b[2] + e[0] * b[3]),
    )


@compile_kernel
def pull_lengths(model, y, bar):
    """Replace a gradient by the coordinates of y with quaternions of length one by that before they are scaled."""
    for i in range(len(model.links)):
        link = model.links[i]
        if link.joint in WITH_QUATERNION:
            _unscaled(y[link.x + PLACES[link.joint] :], bar[link.x + PLACES[link.joint] :])


@compile_inline
def _unscaled(e, b):
    square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]
    along = (e[0] * b[0] + e[1] * b[1] + e[2] * b[2] + e[3] * b[3]) / square
    for c in range(4):
        b[c] = (b[c] - along * e[c]) / square**0.5
