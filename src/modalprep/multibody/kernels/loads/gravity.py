"""A planet in the kernel: gravity on bodies, central or about a point in orbit, and a turning magnetic dipole."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import (
    first_moment,
    symmetric_times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get6,
    get9,
)

PLANET = np.dtype(
    [
        ("mu", np.float64),  # m^3/s^2, of a central field; 0 without
        ("centre", np.float64, 3),
        ("rate", np.float64),  # rad/s, of an orbit; 0 without, and then the following are not used
        ("curvature", np.float64),  # 1 / radius
        ("inclination", np.float64),
        ("argument_of_latitude", np.float64),
        ("planet_spin", np.float64),
        ("field", np.float64),  # T, of the dipole at the radius
        ("tilt", np.float64),
        ("longitude", np.float64),
    ]
)


@compile_kernel
def central_field(mu, d):
    """Field of a point mass at d from its centre.

    Returns
    -------
    g, U : field and potential
    n, q, f : direction from the centre, mu / R^3, mu / R^4: the gradient is ``-q (1 - 3 n n')``
    """
    R = np.sqrt(dot3(d, d))
    q = mu / (R * R * R)
    return (-q * d[0], -q * d[1], -q * d[2]), -q * R * R, (d[0] / R, d[1] / R, d[2] / R), q, q / R


@compile_kernel
def orbit_field(rate, k, x, up):
    """Field of a planet at x from a point in orbit, less the field there; returns as `central_field`.

    In any axes; `up` is the direction from the planet to the point, k the inverse of their distance r. Differences are
    taken in closed form (Encke's way): with ``s = |up + k x|`` and ``a = r (s - 1)``

        g = -rate^2 / s^3 (x - a (1 + s + s^2) up) ;   U = rate^2 (x.x / 2 - a^2 (s + 2) / (2 s)).
    """
    xx = dot3(x, x)
    e = 2.0 * dot3(up, x) + k * xx
    s = np.sqrt(1.0 + k * e)
    a = e / (1.0 + s)
    q = rate * rate / (s * s * s)
    n = ((up[0] + k * x[0]) / s, (up[1] + k * x[1]) / s, (up[2] + k * x[2]) / s)
    g = axpy3((-q * x[0], -q * x[1], -q * x[2]), q * a * (1.0 + s + s * s), up)
    return g, rate * rate * (0.5 * xx - 0.5 * a * a * (s + 2.0) / s), n, q, q * k / s


@compile_inline
def near_planet(planet):
    """Whether there is a central field, or an orbit."""
    return planet.mu > 0.0 or planet.rate > 0.0


@compile_kernel
def planet_load(planet, model, data, i):
    """Gravity of the planet on link i's body with the inertia that `outward` left in data, axes of the link.

    Returns
    -------
    force, torque : at the link's origin; potential (J), that of the turning ground too; field at the origin
    """
    base = get9(data.links[i].orientation)
    p = get3(data.links[i].position)
    J = get6(data.links[i].J)
    m = data.links[i].mass
    rate = planet.rate
    c = first_moment(data.links[i].H)
    turn = 0.0
    if rate > 0.0:
        x = transposed_times(base, p)
        field = orbit_field(rate, planet.curvature, x, (base[0], base[1], base[2]))
        turn = centrifugal_potential(rate, x, (base[6], base[7], base[8]), m, c, J)
    else:
        centre = planet.centre
        d = (p[0] - centre[0], p[1] - centre[1], p[2] - centre[2])
        field = central_field(planet.mu, transposed_times(base, d))
    force, torque, U = gravity_law(field, m, c, J)
    return force, torque, U + turn, field


@compile_kernel
def gravity_law(field, m, c, J):
    """Gravity on a body, linearised about its root, where `central_field` or `orbit_field` is; axes of the body.

    With the body's m, first moment c and moment of inertia J (6) about the root. The potential is
    ``m U - g.c - Gamma_ab E_ab / 2`` with ``Gamma = -q (1 - 3 n n')``; force and torque are its exact derivatives,
    so that energy is conserved. What is left out is of order (size / R)^3.

    Returns
    -------
    force, torque : on the body, at the root
    potential : J
    """
    g, U, n, q, f = field
    trace = 0.5 * (J[0] + J[3] + J[5])
    En = axpy3((trace * n[0], trace * n[1], trace * n[2]), -1.0, symmetric_times(J, n))
    nc, nEn = dot3(n, c), dot3(n, En)
    along = 3.0 * q * nc + f * (1.5 * trace - 7.5 * nEn)
    force = (
        m * g[0] + along * n[0] - q * c[0] + 3.0 * f * En[0],
        m * g[1] + along * n[1] - q * c[1] + 3.0 * f * En[1],
        m * g[2] + along * n[2] - q * c[2] + 3.0 * f * En[2],
    )
    torque = axpy3(cross(c, g), 3.0 * q, cross(En, n))
    return force, torque, m * U - dot3(g, c) + 0.5 * q * (trace - 3.0 * nEn)


@compile_kernel
def centrifugal_potential(rate, p, up, m, c, J):
    """Potential (J) of the ground's turn about `up` on a body at p, all in the body's axes: ``-w J_O w / 2``."""
    along = dot3(up, p)
    across = axpy3(p, -along, up)
    moment = m * dot3(across, across) + 2.0 * dot3(across, c) + dot3(up, symmetric_times(J, up))
    return -0.5 * rate * rate * moment


@compile_kernel
def orbital_axes(planet, t, v):
    """Components in the local orbital frame of a vector in axes to the ascending node and along the planet's axis."""
    i = planet.inclination
    u = planet.argument_of_latitude + planet.rate * t
    across = np.cos(i) * v[1] + np.sin(i) * v[2]
    normal = np.cos(i) * v[2] - np.sin(i) * v[1]
    return np.cos(u) * v[0] + np.sin(u) * across, np.cos(u) * across - np.sin(u) * v[0], normal


@compile_kernel
def magnetic_field(planet, t, x):
    """Dipole field (T) at x in the local orbital frame: ``B_0 / s^3 (m - 3 n (m.n))``, m to the magnetic north."""
    tilt = planet.tilt
    turn = planet.longitude + planet.planet_spin * t
    k = planet.curvature
    m = orbital_axes(planet, t, (np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)))
    d = (1.0 + k * x[0], k * x[1], k * x[2])
    ss = dot3(d, d)
    f = planet.field / (ss * np.sqrt(ss))
    b = axpy3(m, -3.0 * dot3(m, d) / ss, d)
    return f * b[0], f * b[1], f * b[2]


@compile_kernel
def air_speed(planet, t, x, v):
    """Velocity of a point relative to the planet, which turns with atmosphere and field, axes of the orbital frame."""
    w = orbital_axes(planet, t, (0.0, 0.0, planet.planet_spin))
    r = (x[0] + 1.0 / planet.curvature, x[1], x[2])
    return add3(v, cross((-w[0], -w[1], planet.rate - w[2]), r))


@compile_kernel
def conductor_leg(planet, t, a, b, va, vb):
    """Magnetic force per current (N/A) and electromotive force (V) of a straight leg from a to b, velocities va, vb."""
    middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]))
    v = (0.5 * (va[0] + vb[0]), 0.5 * (va[1] + vb[1]), 0.5 * (va[2] + vb[2]))
    leg = axpy3(b, -1.0, a)
    B = magnetic_field(planet, t, middle)
    return cross(leg, B), dot3(cross(air_speed(planet, t, middle, v), B), leg)
