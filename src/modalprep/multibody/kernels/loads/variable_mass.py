"""Masses that change with time: the constants of a body are written to the data in each evaluation.

The mass integrals of a body are linear in its mass between two fill levels; the affine part of its motion
(body/mass.py) follows from them. Beside the constant one, the functions that are orthonormal in the mass are those of a
Cholesky factor here, not of principal axes: any orthonormal three span the same motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.mass import FLAT
from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import antisymmetric
from modalprep.multibody.kernels.algebra.tuples import axpy3, get3, put3, sub3
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
    ]
)
LEVEL = np.dtype([("mass", np.float64), ("first_moment", np.float64, 3), ("inertia", np.float64, 6)])
CHANGE = 1e-3  # of the mass, for the energy that leaves with it: energies are linear in it but for fourth orders of q


@by_address
class Fill(NamedTuple):
    """Packed depletions: the mass integrals of each fill level, in the axes of the body's link, at most N modes."""

    rows: np.ndarray  # (nd,) DEPLETION
    levels: np.ndarray  # (levels,) LEVEL, of each body the lightest first
    S: np.ndarray  # (levels, 3, N)
    H: np.ndarray  # (levels, 3, 3, N)
    Kg_A: np.ndarray  # (levels, N, 3, N)
    Kg_W: np.ndarray  # (levels, N, 3, 3, N)
    P: np.ndarray  # (levels, N, 3, 3, N) P_ab of modes i and j, j first
    M: np.ndarray  # (levels, N, N) modal mass


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
    level = body.first_level
    last = body.first_level + body.levels - 1
    while level < last - 1 and m > fill.levels[level + 1].mass:
        level += 1
    low = fill.levels[level]
    high = fill.levels[level + 1]
    share = (m + change - low.mass) / (high.mass - low.mass)
    own = data.links[body.link]
    own.mass = _between(low.mass, high.mass, share)
    for c in range(3):
        own.first_moment[c] = _between(low.first_moment[c], high.first_moment[c], share)
    for c in range(6):
        own.inertia[c] = _between(low.inertia[c], high.inertia[c], share)
    _set_modes(data.modal, model.links[body.link], own, fill, level, share)


@compile_inline
def _between(low, high, share):
    """Return the number on the line between two."""
    return low + share * (high - low)


@compile_inline
def _between3(low, high, share):
    """Return three numbers on the line between two vectors."""
    return axpy3(get3(low), share, sub3(get3(high), get3(low)))


@compile_kernel
def _set_modes(modal, link, own, fill, level, share):
    """Write the affine part of a link's body and the rest: body/mass.py, `affine_part`; `modal` may be None."""
    if modal is None:
        return
    if link.slot < 0:
        return
    k = link.kind
    n = link.modes
    root = np.sqrt(own.mass)
    c = (own.first_moment[0] / own.mass, own.first_moment[1] / own.mass, own.first_moment[2] / own.mass)
    L = _extent(own.mass, own.inertia, c)
    modal.integrals.root_mass[k] = root
    _place(modal.integrals.p0[k], modal.integrals.strain[k], root, c, L)
    B = modal.integrals.B[k]
    above = level + 1
    for i in range(n):
        for a in range(3):
            total = _between(fill.S[level, a, i], fill.S[above, a, i], share)
            by_x = _between3(fill.H[level, a, :, i], fill.H[above, a, :, i], share)
            _put_coordinates(total, by_x, L, c, root, B[:, i], a)
            for j in range(n):
                total = _between(fill.Kg_A[level, j, a, i], fill.Kg_A[above, j, a, i], share)
                by_x = _between3(fill.Kg_W[level, j, a, :, i], fill.Kg_W[above, j, a, :, i], share)
                _put_coordinates(total, by_x, L, c, root, modal.integrals.Kg_p[k, j, :, i], a)
    for j in range(n):
        for i in range(n):
            _set_rest(modal.integrals, k, j, i, fill, level, share)


@compile_inline
def _place(p0, strain, root, c, L):
    """Write ``p_r(0)`` and ``p(0) / p(0).p(0)`` of a body of mass centre c and extent L."""
    size = 0.0
    for r in range(9):
        size += L[r] * L[r]
    for a in range(3):
        p0[a] = root * c[a]
        strain[a] = 0.0
        for r in range(3):
            p0[3 + 3 * r + a] = L[3 * a + r]
            strain[3 + 3 * r + a] = L[3 * a + r] / max(size, 1e-300)


@compile_inline
def _set_rest(integrals, k, j, i, fill, level, share):
    """Write ``P' = P - B_r B_r^T`` of modes i and j, ``eps_cab P'_ba`` and ``M' = M - B^T B``."""
    B = integrals.B[k]
    P = integrals.P_rest[k, j]
    affine = 0.0
    for a in range(3):
        for b in range(3):
            f = 0.0
            for r in range(0, 12, 3):
                f += B[r + a, i] * B[r + b, j]
            P[3 * a + b, i] = _between(fill.P[level, j, a, b, i], fill.P[level + 1, j, a, b, i], share) - f
            affine += f if a == b else 0.0
    put3(integrals.gyro[k, j, :, i], antisymmetric(P[:, i]))
    integrals.M_rest[k, j, i] = _between(fill.M[level, j, i], fill.M[level + 1, j, i], share) - affine


@compile_inline
def _extent(m, J, c):
    """Lower Cholesky factor (9, by rows) of ``int rho (x - c) (x - c)'``; without extent a column is zero."""
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
def _put_coordinates(total, by_x, L, c, root, out, a):
    """Write component a of the four affine coordinates of a field by ``int rho u_a`` and ``int rho x_b u_a``."""
    x, y, z = axpy3(by_x, -total, c)
    x = x / L[0] if L[0] > 0.0 else 0.0
    y = (y - L[3] * x) / L[4] if L[4] > 0.0 else 0.0
    z = (z - L[6] * x - L[7] * y) / L[8] if L[8] > 0.0 else 0.0
    coordinates = (total / root, x, y, z)
    for r in range(4):
        out[3 * r + a] = coordinates[r]


@compile_kernel
def leaving_power(fill, tables, planet, model, data, y, t):
    """Power (W, negative) of the energy that leaves with the mass: ``V' dM/dt V / 2`` and the potentials of gravity.

    After `outward` and `world`, before any load; the bodies' inertias and bias forces are restored.
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
    """`own_inertia` as a kernel: inline, each caller would compile a copy, which takes seconds."""
    own_inertia(data.modal, model, data, link)


@compile_kernel
def _planet(planet, model, data, link):
    """Potential (J) of a link's body near a planet; zero without one."""
    if not near_planet(planet):
        return 0.0
    _, _, U, _ = planet_load(planet, model, data, link)
    return U
