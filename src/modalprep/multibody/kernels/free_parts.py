"""Mass centre, momenta and inertia of the free-floating parts of a system, after `outward` and `world`.

Sums are about the origin of the first body of a part, so that no digits are lost far from the inertial origin.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import (
    first_moment,
    inverse_symmetric,
    product,
    square,
    symmetric_product,
    symmetric_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add6,
    axpy3,
    cross,
    dot3,
    get3,
    get6,
    get9,
    put3,
    put6,
    sub3,
    sub6,
)
from modalprep.multibody.kernels.energy import body_momenta
from modalprep.multibody.kernels.interfaces import seen_spin
from modalprep.multibody.model.joint_types import FREE

# The sums of a part in inertial axes. Until they are complete, `centre` is the first moment (kg m), and the angular
# momentum and inertia are about `origin`.
PART = np.dtype(
    [
        ("mass", np.float64),  # kg
        ("centre", np.float64, 3),  # m
        ("linear", np.float64, 3),  # momentum, kg m/s
        ("angular", np.float64, 3),  # about the mass centre, kg m^2/s
        ("inertia", np.float64, 6),  # about the mass centre, kg m^2
        ("origin", np.float64, 3),  # m
    ]
)


@compile_kernel
def sum_parts(model, data, part, sums):
    """Write the sums of all parts, ``part (nl,)`` that of each link, -1 of links tied to the ground."""
    for k in range(len(sums)):
        own = sums[k]
        own.mass = -1.0
        put3(own.centre, (0.0, 0.0, 0.0))
        put3(own.linear, (0.0, 0.0, 0.0))
        put3(own.angular, (0.0, 0.0, 0.0))
        put6(own.inertia, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    for i in range(len(part)):
        if part[i] >= 0 and model.links[i].body >= 0:
            _add_body(model, data, i, sums[part[i]])
    for k in range(len(sums)):
        own = sums[k]
        r = get3(own.centre)
        r = (r[0] / own.mass, r[1] / own.mass, r[2] / own.mass)
        put3(own.angular, sub3(get3(own.angular), cross(r, get3(own.linear))))
        put6(own.inertia, sub6(get6(own.inertia), _of_pair(own.mass, r, r)))
        put3(own.centre, add3(get3(own.origin), r))


@compile_inline
def _add_body(model, data, i, own):
    """Add the body of link i to the sums of its part."""
    link = data.links[i]
    base = get9(data.links[i].orientation)
    w = seen_spin(data, i)
    if own.mass < 0.0:
        own.mass = 0.0
        put3(own.origin, get3(link.position))
    r = sub3(get3(link.position), get3(own.origin))
    m = link.mass
    s = times(base, first_moment(link.H))
    v = transposed_times(base, get3(link.velocity))
    linear, angular, _, _ = body_momenta(model, data, i, v, w)
    linear, angular = times(base, linear), times(base, angular)
    J = symmetric_product(product(base, square(get6(link.J))), base)
    J = add6(J, add6(_of_pair(m, r, r), _of_pair(1.0, r, s)))
    own.mass += m
    put3(own.centre, add3(get3(own.centre), axpy3(s, m, r)))
    put3(own.linear, add3(get3(own.linear), linear))
    put3(own.angular, add3(get3(own.angular), add3(angular, cross(r, linear))))
    put6(own.inertia, add6(get6(own.inertia), add6(J, _of_pair(1.0, s, r))))


@compile_inline
def _of_pair(m, a, b):
    """Return ``m (a.b - (a b' + b a') / 2)``: the symmetric (3, 3) of a product of places in a moment of inertia."""
    d = m * dot3(a, b)
    return (
        d - m * a[0] * b[0],
        -0.5 * m * (a[0] * b[1] + a[1] * b[0]),
        -0.5 * m * (a[0] * b[2] + a[2] * b[0]),
        d - m * a[1] * b[1],
        -0.5 * m * (a[1] * b[2] + a[2] * b[1]),
        d - m * a[2] * b[2],
    )


@compile_kernel
def move_part(model, data, part, k, own, centre, linear, angular, y):
    """Change a state ``y`` by a rigid motion of part k so that its mass centre and momenta change by the values given.

    `own` are the sums of `sum_parts` in the same state. Only the free joints on the ground move: joints, modes and
    closed loops within the part are unchanged.
    """
    nx = model.nx
    inverse = inverse_symmetric(get6(own.inertia))[0]
    w = symmetric_times(inverse, angular)
    for i in range(len(part)):
        link = model.links[i]
        if part[i] == k and link.joint == FREE and link.parent == len(part):
            base = get9(data.links[i].orientation)
            r = sub3(get3(data.links[i].position), get3(own.centre))
            v = transposed_times(base, axpy3(cross(w, r), 1.0 / own.mass, linear))
            place = transposed_times(get9(link.rotation), centre)
            turn = transposed_times(base, w)
            for c in range(3):
                y[link.x + c] += place[c]
                y[nx + link.u + c] += v[c]
                y[nx + link.u + 3 + c] += turn[c]
