"""Masses that change with time: what the kernel reads of a body is written anew at each evaluation.

The mass integrals of a body are linear in its mass between two fill levels; the affine part of its motion
(body/mass.py) follows from them. The three functions beside the constant one that are orthonormal in the mass are those
of a Cholesky factor here, not of principal axes: any three do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.mass import FLAT
from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.tuples import (
    put3,
    put6,
)
from modalprep.multibody.kernels.energy import body_sums
from modalprep.multibody.kernels.loads.gravity import near_planet, planet_load
from modalprep.multibody.kernels.modal_inertia import own_inertia
from modalprep.multibody.kernels.time_tables import Tables, table

DEPLETION = np.dtype(
    [
        ("link", np.int64),
        ("table", np.int64),  # function of time of the mass
        ("first_level", np.int64),
        ("levels", np.int64),
        ("numbers", np.int64),  # numbers of a level
    ]
)
RIGID = 10  # m, s0 (3), J (6): the first numbers of a level
CHANGE = 1e-3  # of the mass, for the energy that leaves with it: energies are linear in it but for fourth orders of q


@by_address
class Fill(NamedTuple):
    """Packed depletions: the mass integrals of each fill level, in the axes of the body's link, modes i, j.

    A level is m, s0 (3), J (6), then ``int rho (1, x, y, z) phi_i`` (n, 4, 3), ``Kg_A, Kg_W`` (n, n, 4, 3) with j
    first, ``int rho phi_ja phi_ib`` (n, n, 3, 3), the modal mass (n, n).
    """

    rows: np.ndarray  # (nd,) DEPLETION
    mass: np.ndarray  # (levels,) kg, of each body the lightest first
    levels: np.ndarray  # (levels, largest size)
    now: np.ndarray  # (largest size,) scratch


@compile_kernel
def refresh(fill, tables: Tables, model, data, t):
    """Write the mass integrals of time t to the data."""
    for i in range(len(fill.rows)):
        m, _, _ = table(tables, fill.rows[i].table, t)
        set_mass(fill, model, data, i, m, 0.0)


@compile_kernel
def set_mass(fill, model, data, i, m, change):
    """Write the constants of depletion i at mass ``m + change`` on the line between the levels about m."""
    body = fill.rows[i]
    link = body.link
    row = body.first_level
    last = body.first_level + body.levels - 1
    while row < last - 1 and m > fill.mass[row + 1]:
        row += 1
    share = (m + change - fill.mass[row]) / (fill.mass[row + 1] - fill.mass[row])
    for c in range(body.numbers):
        fill.now[c] = fill.levels[row, c] + share * (fill.levels[row + 1, c] - fill.levels[row, c])
    own = data.links[link]
    now = fill.now
    own.mass = now[0]
    put3(own.first_moment, (now[1], now[2], now[3]))
    put6(own.inertia, (now[4], now[5], now[6], now[7], now[8], now[9]))
    _set_modes(data.modal, model, link, now)


@compile_kernel
def _set_modes(modal, model, link, now):
    """Write the affine part of a link's body and the rest: body/mass.py, `affine_part`; `modal` may be None."""
    if modal is None:
        return
    if model.links[link].slot < 0:
        return
    k, n = model.links[link].kind, model.links[link].modes
    root = np.sqrt(now[0])
    c = (now[1] / now[0], now[2] / now[0], now[3] / now[0])
    L = _extent(now, c)
    place = modal.integrals.place[k]
    size = 0.0
    for a in range(3):
        place[a] = root * c[a]
        place[12 + a] = 0.0
    for r in range(3):
        for a in range(3):
            f = L[3 * a + r]
            place[3 + 3 * r + a], place[15 + 3 * r + a] = f, f
            size += f * f
    for r in range(9):
        place[15 + r] /= max(size, 1e-300)
    place[24] = root
    first = RIGID
    second = RIGID + 12 * n
    tensor = RIGID + 12 * n + 12 * n * n
    base, N = modal.integrals.base[k], modal.q.shape[1]
    for i in range(n):
        _coordinates(now, first + 12 * i, L, c, root, base, i, N)
        for j in range(n):
            _coordinates(now, second + 12 * (n * j + i), L, c, root, modal.integrals.by_q[k, j], i, N)
    unit = tensor + 9 * n * n
    for j in range(n):
        rest, gyro = modal.integrals.rest[k, j], modal.integrals.gyro[k, j]
        for i in range(n):
            own = 0.0
            for a in range(3):
                for b in range(3):
                    f = 0.0
                    for r in range(4):
                        f += base[(3 * r + a) * N + i] * base[(3 * r + b) * N + j]
                    rest[(3 * a + b) * N + i] = now[tensor + 9 * (n * j + i) + 3 * a + b] - f
                    own += f if a == b else 0.0
            gyro[i] = rest[7 * N + i] - rest[5 * N + i]
            gyro[N + i] = rest[2 * N + i] - rest[6 * N + i]
            gyro[2 * N + i] = rest[3 * N + i] - rest[N + i]
            modal.integrals.mass[k, j, i] = now[unit + n * j + i] - own


@compile_inline
def _extent(now, c):
    """Lower Cholesky factor (9, by rows) of ``int rho (x - c) (x - c)'``; without extent a column is zero."""
    m = now[0]
    J = (now[4], now[5], now[6], now[7], now[8], now[9])
    half = 0.5 * (J[0] + J[3] + J[5])
    xx = half - J[0] - m * c[0] * c[0]
    yy = half - J[3] - m * c[1] * c[1]
    zz = half - J[5] - m * c[2] * c[2]
    xy = -J[1] - m * c[0] * c[1]
    xz = -J[2] - m * c[0] * c[2]
    yz = -J[4] - m * c[1] * c[2]
    flat = FLAT * (xx + yy + zz)
    a, b, d, e, f, g = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if xx > flat:
        a = np.sqrt(xx)
        b, d = xy / a, xz / a
    yy, yz, zz = yy - b * b, yz - b * d, zz - d * d
    if yy > flat:
        e = np.sqrt(yy)
        f = yz / e
    zz -= f * f
    if zz > flat:
        g = np.sqrt(zz)
    return (a, 0.0, 0.0, b, e, 0.0, d, f, g)


@compile_inline
def _coordinates(now, at, L, c, root, out, i, N):
    """Write the affine coordinates (4, 3) of the field of mode i by its moments ``int rho (1, x, y, z) u`` (4, 3)."""
    for a in range(3):
        total = now[at + a]
        x = now[at + 3 + a] - c[0] * total
        y = now[at + 6 + a] - c[1] * total
        z = now[at + 9 + a] - c[2] * total
        x = x / L[0] if L[0] > 0.0 else 0.0
        y = (y - L[3] * x) / L[4] if L[4] > 0.0 else 0.0
        z = (z - L[6] * x - L[7] * y) / L[8] if L[8] > 0.0 else 0.0
        out[a * N + i] = total / root
        out[(3 + a) * N + i] = x
        out[(6 + a) * N + i] = y
        out[(9 + a) * N + i] = z


@compile_kernel
def leaving_power(fill, tables, planet, model, data, y, t):
    """Power (data, negative) of the energy that leaves with the mass: ``V' dM/dt V / 2`` and the potentials of gravity.

    After `outward` and `world`, before any load; it leaves the bodies' own inertias and biases as they were.
    """
    power = 0.0
    for i in range(len(fill.rows)):
        m, rate, _ = table(tables, fill.rows[i].table, t)
        if rate != 0.0:
            link = fill.rows[i].link
            for side in (1.0, -1.0):
                set_mass(fill, model, data, i, m, side * CHANGE * m)
                _renew_inertia(model, data, link)
                sums = body_sums(model, data, link)
                energy = sums.kinetic + sums.gravity + _planet(planet, model, data, link)
                power += rate * side * energy / (2.0 * CHANGE * m)
            set_mass(fill, model, data, i, m, 0.0)
            _renew_inertia(model, data, link)
    return power


@compile_kernel
def _renew_inertia(model, data, link):
    """Do as `own_inertia` in a kernel of its own: each caller of that one compiles a copy, which takes seconds."""
    own_inertia(data.modal, model, data, link)


@compile_kernel
def _planet(planet, model, data, link):
    """Potential (J) of a link's body near a planet; zero without one."""
    if not near_planet(planet):
        return 0.0
    _, _, U, _ = planet_load(planet, model, data, link)
    return U
