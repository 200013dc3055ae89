"""Joints of one axis, z: a revolute turns about it, a sliding one moves by `along` and `about` per unit.

They need a column of the inertia and one pivot. Only the revolute has code of its own: it is the common case.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import numbers
from modalprep.multibody.kernels.algebra.inertia_blocks import (
    all_blocks,
    blocks_times,
    column_parts,
    first_column,
    less_outer_blocks,
    rotated,
    second_column,
)
from modalprep.multibody.kernels.algebra.matrices import product, times
from modalprep.multibody.kernels.algebra.rotations import turned
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    add6,
    axpy3,
    combined,
    dot_in_pairs,
    get6,
    get9,
    put6,
    take6,
    unsigned,
)
from modalprep.multibody.model.joint_types import REVOLUTE


@compile_inline
def along_axis(link, v):
    """Return the component of a spatial vector (force or acceleration) along the axis: ``S' v``."""
    return v[5] if link.joint == REVOLUTE else link.along * v[2] + link.about * v[5]


@compile_inline
def motion(link, prescribed, nx, y, turn):
    """See `weld.motion`."""
    x = link.x
    u = nx + link.u
    if link.joint == REVOLUTE:
        return turned(turn, y[x]), ZERO3, ZERO3, (0.0, 0.0, y[u]), ZERO6
    return moved_along_axis(link, turn, (y[x], y[u], 0.0))


@compile_inline
def moved_along_axis(link, turn, moved):
    """Return the motion of a link that is `moved`: place, speed and acceleration per unit; see `weld.motion`."""
    along, about = link.along, link.about
    place, speed, acceleration = moved
    offset = times(turn, (0.0, 0.0, along * place))
    rate, spin = (0.0, 0.0, along * speed), (0.0, 0.0, about * speed)
    extra = (0.0, 0.0, along * acceleration, 0.0, 0.0, about * acceleration)
    return turned(turn, about * place), offset, rate, spin, extra


@compile_inline
def rates(link, nx, y, ydot):
    """Write the speed."""
    ydot[link.x] = y[nx + link.u]


@compile_inline
def along(link, speeds, linear, angular):
    """Return (linear, angular) with ``S speeds`` added."""
    u = speeds[link.u]
    if link.joint == REVOLUTE:
        return linear, (angular[0], angular[1], angular[2] + u)
    linear = (linear[0], linear[1], linear[2] + link.along * u)
    return linear, (angular[0], angular[1], angular[2] + link.about * u)


@compile_inline
def direction(link, s):
    """See `weld.direction`."""
    return (0.0, 0.0, link.along), (0.0, 0.0, link.about)


@compile_inline
def project(link, wrench, out):
    """Write ``S' wrench``."""
    out[link.u] = along_axis(link, wrench)


@compile_inline
def column(link, M, H, J):
    """Return ``I S``: force and torque."""
    if link.joint == REVOLUTE:
        return (H[2], H[5], H[8]), (J[2], J[4], J[5])
    a, b = link.along, link.about
    force = (a * M[2] + b * H[2], a * M[4] + b * H[5], a * M[5] + b * H[8])
    return force, (a * H[6] + b * J[2], a * H[7] + b * J[4], a * H[8] + b * J[5])


@compile_inline
def eliminate(link, own, B, P, tau, added, grounded):
    """See `weld.eliminate`."""
    d = _axis_inertia(link, B, added)
    if not d > 0.0:
        return False, B, ZERO3, ZERO3
    v = _axis_column(link, own, 1.0 / d, B)
    if grounded:
        return True, B, ZERO3, ZERO3
    return _through_axis(link, own, 1.0 / d, v, B, P, tau)


@compile_inline
def _axis_inertia(link, B, added):
    """Return ``S' I S + added``, B the inertia I by axes. `added` (nu,) may be None."""
    m, h, _, d = numbers(B[5])
    if link.joint != REVOLUTE:
        d = link.along * (link.along * m + 2.0 * link.about * h) + link.about * link.about * d
    return d if added is None else d + added[unsigned(link.u)]


@compile_inline
def _axis_column(link, own, g, B):
    """Return ``I S`` in the parent link's axes, each axis (linear, angular) twice.

    What the accelerations need of it goes to `pivot`: ``g``, ``g I S`` and ``g S' I b``; g is the inverse of
    `_axis_inertia`, B is I by axes.
    """
    half = product(get9(own.rotation), all_blocks(B))
    v = second_column(half[2]), second_column(half[5]), second_column(half[8])
    if link.joint != REVOLUTE:
        linear = first_column(half[2]), first_column(half[5]), first_column(half[8])
        v = combined(link.along, linear, link.about, v)
    f, t = column_parts(v)
    own.pivot[0], own.pivot[7] = g, g * along_axis(link, blocks_times(B, get6(own.bias)))
    put6(own.pivot[1:], (g * f[0], g * f[1], g * f[2], g * t[0], g * t[1], g * t[2]))
    return v


@compile_inline
def _through_axis(link, own, g, v, B, P, tau):
    """Return True, inertia and bias force of the link with its joint eliminated, in the parent link's axes.

    ``I - I S g S' I`` and ``P + I b + I S g (tau - S' (P + I b))``; v is of `_axis_column`.
    """
    turn = get9(own.rotation)
    P = add6(P, blocks_times(B, get6(own.bias)))
    e = g * (tau[unsigned(link.u)] - along_axis(link, P))
    f, t = column_parts(v)
    f = axpy3(times(turn, (P[0], P[1], P[2])), e, f)
    t = axpy3(times(turn, (P[3], P[4], P[5])), e, t)
    return True, less_outer_blocks(rotated(turn, B), g, v), f, t


@compile_inline
def response(link, own, P, tau):
    """See `weld.response`."""
    e = own.pivot[0] * (tau[link.u] - along_axis(link, P))
    if link.joint == REVOLUTE:
        return (0.0, 0.0, 0.0, 0.0, 0.0, e)
    return (0.0, 0.0, link.along * e, 0.0, 0.0, link.about * e)


@compile_inline
def accelerations(link, own, base, linear, angular, tau, udot, biases):
    """See `weld.accelerations`."""
    v, t, u = linear, angular, link.u
    free = own.pivot[0] * (tau[unsigned(u)] - along_axis(link, own.force)) - biases * own.pivot[7]
    found = udot[unsigned(u)] = free - dot_in_pairs(take6(own.pivot, 1), base)
    if link.joint == REVOLUTE:
        return v, (t[0], t[1], t[2] + found)
    return (v[0], v[1], v[2] + link.along * found), (t[0], t[1], t[2] + link.about * found)


@compile_inline
def move(link, y, d, out):
    """Move the coordinate."""
    out[link.x] = y[link.x] + d[link.u]
