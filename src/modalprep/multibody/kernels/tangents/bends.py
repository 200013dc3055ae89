"""Displacements of second order in the modal coordinates, and what their velocity and acceleration change by.

Affine functions and interfaces of a body move alike (body/mass.py, body/line.py): with linear part B, second order D
and the strain ``tau = e.(q D q) / 2``

    p(q) = h(tau) B q + g(tau) q D q / 2

whose derivatives of third order are those of g and h.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import WIDTH, add_lanes, four, get_lanes, numbers, put_lanes, sum_lanes
from modalprep.multibody.kernels.algebra.rows import put_rows3, rows3
from modalprep.multibody.kernels.algebra.tuples import axpy3, scaled3
from modalprep.multibody.kernels.modal_inertia import shortening, swing


@compile_inline
def along_modes(x, f, n):
    """Return the product of a row with the numbers of n modes."""
    total = four(0.0)
    for b in range(0, n, WIDTH):
        total = total + get_lanes(x, b) * get_lanes(f, b)
    return add_lanes(total)


@compile_inline
def along_rates(x, q, qd, qdd, n):
    """Return the products of a row with modal coordinates and their rates."""
    z = four(0.0)
    a, b, c = z, z, z
    for k in range(0, n, WIDTH):
        row = get_lanes(x, k)
        a = a + row * get_lanes(q, k)
        b = b + row * get_lanes(qd, k)
        c = c + row * get_lanes(qdd, k)
    found = numbers(sum_lanes(a, b, c, z))
    return found[0], found[1], found[2]


@compile_inline
def second_order(bends, k, table, sign, count, q, qd, qdd, n):
    """Write ``D q``, ``D q'`` and ``D q''`` (count, n) of D, a sign times a table (n, count, n)."""
    for c in range(0, count, 3):
        for b in range(0, n, WIDTH):
            z = four(0.0)
            x, xd, xdd = (z, z, z), (z, z, z), (z, z, z)
            for j in range(n):
                row = rows3(table[j], c, b)
                x = axpy3(x, q[j], row)
                xd = axpy3(xd, qd[j], row)
                xdd = axpy3(xdd, qdd[j], row)
            put_rows3(bends.Dq[k], c, b, scaled3(sign, x))
            put_rows3(bends.Dqd[k], c, b, scaled3(sign, xd))
            put_rows3(bends.Dqdd[k], c, b, scaled3(sign, xdd))


@compile_inline
def straight(bends, k, B, count, q, qd, qdd, n):
    """Write a displacement ``p = B q`` (count,) and its derivatives."""
    for c in range(count):
        for b in range(0, n, WIDTH):
            put_lanes(bends.dp[k, c], b, get_lanes(B[c], b))
            put_lanes(bends.rate_q[k, c], b, four(0.0))
            put_lanes(bends.acceleration_q[k, c], b, four(0.0))
        x, xd, xdd = along_rates(B[c], q, qd, qdd, n)
        bends.p[k, c], bends.rate[k, c], bends.acceleration[k, c] = x, xd, xdd


@compile_inline
def bent(bends, k, B, strain, count, q, qd, qdd, n):
    """Write a displacement (count,) of second order and its derivatives, after `second_order`."""
    _strain_rows(bends, k, strain, count, n)
    bent_by(bends, k, B, count, q, qd, qdd, n)


@compile_inline
def bent_by(bends, k, B, count, q, qd, qdd, n):
    """Do as `bent`, the derivatives of the strain written."""
    tau_q, growth = bends.rows[k, 0], bends.rows[k, 1]
    tau, speed, pull = along_rates(tau_q, q, qd, qdd, n)
    tau *= 0.5
    rising = along_modes(growth, qd, n)
    g, g1, g2 = shortening(tau)
    h, h1, h2 = swing(tau)
    bends.factors[k, 0], bends.factors[k, 1], bends.factors[k, 2] = g, h1, g1
    third = third_slopes(tau, g1, g2)
    for c in range(count):
        x, xd, xdd = along_rates(B[c], q, qd, qdd, n)
        Dq = bends.Dq[k, c]
        t, td, tdd = along_rates(Dq, q, qd, qdd, n)
        t *= 0.5
        bow = h2 * x + g2 * t
        along = h1 * x + g1 * t
        mixed = h1 * xd + g1 * td + speed * bow
        by_tau = 2.0 * speed * (h2 * xd + g2 * td) + g1 * along_modes(bends.Dqd[k, c], qd, n)
        by_tau += (rising + pull) * bow + speed * speed * (third[0] * x + third[1] * t) + h1 * xdd + g1 * tdd
        bends.along[k, c], bends.bow[k, c] = along, bow
        bends.p[k, c] = h * x + g * t
        rate, acceleration = four(0.0), four(0.0)
        for b in range(0, n, WIDTH):
            own = get_lanes(B[c], b)
            curved = get_lanes(Dq, b)
            bending = get_lanes(bends.Dqd[k, c], b)
            first, second = get_lanes(tau_q, b), get_lanes(growth, b)
            slope = h1 * own + g1 * curved
            dp = h * own + g * curved + along * first
            rate_q = speed * slope + g * bending + along * second + mixed * first
            by_q = (pull + rising) * slope + g * get_lanes(bends.Dqdd[k, c], b) + by_tau * first
            by_q = by_q + along * get_lanes(bends.rows[k, 2], b) + (2.0 * mixed) * second
            by_q = by_q + (2.0 * g1 * speed) * bending + (speed * speed) * (h2 * own + g2 * curved)
            put_lanes(bends.dp[k, c], b, dp)
            put_lanes(bends.rate_q[k, c], b, rate_q)
            put_lanes(bends.acceleration_q[k, c], b, by_q)
            rate = rate + dp * get_lanes(qd, b)
            acceleration = acceleration + dp * get_lanes(qdd, b) + rate_q * get_lanes(qd, b)
        bends.rate[k, c] = add_lanes(rate)
        bends.acceleration[k, c] = add_lanes(acceleration)


@compile_inline
def third_slopes(tau, g1, g2):
    """Return the third derivatives of `swing` and `shortening`, the first two of the latter given."""
    c = 5.0 / 6.0
    s = 1.0 / (1.0 + tau * tau)
    d = 1.0 - tau + c * tau * tau
    return (4.0 * tau * tau - 1.0) * s * s * s * s**0.5, -3.0 * (g2 * (2.0 * c * tau - 1.0) + 2.0 * c * g1) / d


@compile_inline
def _strain_rows(bends, k, strain, count, n):
    """Write the derivative of the strain by q, its rate, and its second rate but for q'''."""
    for b in range(0, n, WIDTH):
        x, y, z = four(0.0), four(0.0), four(0.0)
        for c in range(count):
            x = x + strain[c] * get_lanes(bends.Dq[k, c], b)
            y = y + strain[c] * get_lanes(bends.Dqd[k, c], b)
            z = z + strain[c] * get_lanes(bends.Dqdd[k, c], b)
        put_lanes(bends.rows[k, 0], b, x)
        put_lanes(bends.rows[k, 1], b, y)
        put_lanes(bends.rows[k, 2], b, z)


@compile_inline
def add_bend_curvature(bends, k, B, table, sign, strain, count, force, n, out):
    """Add the derivative by q of ``dp' force`` at constant forces (count,) to ``out (n, n)``; arguments as before."""
    g, h1, g1 = bends.factors[k, 0], bends.factors[k, 1], bends.factors[k, 2]
    along, bow = 0.0, 0.0
    for c in range(count):
        along += force[c] * bends.along[k, c]
        bow += force[c] * bends.bow[k, c]
    tau_q, mixed = bends.rows[k, 0], bends.rows[k, 1]  # the rates are not needed any more
    for b in range(0, n, WIDTH):
        x = four(0.0)
        for c in range(count):
            x = x + (h1 * force[c]) * get_lanes(B[c], b) + (g1 * force[c]) * get_lanes(bends.Dq[k, c], b)
        put_lanes(mixed, b, x + (0.5 * bow) * get_lanes(tau_q, b))
    for a in range(n):
        for b in range(0, n, WIDTH):
            x = mixed[a] * get_lanes(tau_q, b) + tau_q[a] * get_lanes(mixed, b)
            for c in range(count):
                x = x + (sign * (g * force[c] + along * strain[c])) * get_lanes(table[a, c], b)
            put_lanes(out[a], b, get_lanes(out[a], b) + x)
