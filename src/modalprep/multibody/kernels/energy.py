"""Energies and momenta of one body, after `kernel.outward` and `kernel.world`."""

from __future__ import annotations

from typing import NamedTuple

from modalprep.jit import compile_kernel
from modalprep.multibody.kernels.articulated_body import seen_spin
from modalprep.multibody.kernels.data import H_, IA, J_, KIND, MASS, MODES, POSITION, ROTATION, SLOT, VELOCITY
from modalprep.multibody.kernels.spatial import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get6,
    get8,
    get9,
    inertia_times,
    times,
    transposed_times,
)


class Sums(NamedTuple):
    """Energies (J), `gravity` that of a uniform field, and momenta (3 numbers each) about the inertial origin."""

    kinetic: float
    strain: float
    gravity: float
    linear: tuple[float, float, float]
    angular: tuple[float, float, float]


@compile_kernel
def body_sums(tree, flex, W, F, link):
    """Return the `Sums` of a link's body: ``T = V' M V / 2`` with the mass matrix of `outward`."""
    base, p = get9(W, link, ROTATION), get3(W, link, POSITION)
    v, w = transposed_times(base, get3(W, link, VELOCITY)), seen_spin(W, link)
    H, m = get9(W, link, H_), tree.fixed[link, MASS]
    b = inertia_times(get6(W, link, IA), H, get6(W, link, J_), (v[0], v[1], v[2], w[0], w[1], w[2]))
    linear, angular, modal, strain = (b[0], b[1], b[2]), (b[3], b[4], b[5]), 0.0, 0.0
    if flex is not None:
        s, k = tree.ints[link, SLOT], tree.ints[link, KIND]
        if s >= 0:
            for a in range(tree.ints[link, MODES]):
                Z, q, qd = get8(F.Z, s, a, 0), F.q[s, a], F.qd[s, a]
                S, C = (Z[0], Z[1], Z[2]), (Z[3], Z[4], Z[5])
                linear, angular = axpy3(linear, qd, S), axpy3(angular, qd, C)
                own = qd * F.Z[s, a, 1 + (a >> 3), a & 7]
                for b in range(a + 1, tree.ints[link, MODES]):  # M_ff is symmetric, its upper half is there
                    own += 2.0 * F.qd[s, b] * F.Z[s, a, 1 + (b >> 3), b & 7]
                modal += qd * (dot3(S, v) + dot3(C, w) + own)
                strain += 0.5 * flex.diagonal[k, a, 0] * q * q
    first, g = times(base, (H[5], H[6], H[1])), get3(tree.fixed, len(tree.fixed) - 1, 0)
    kinetic = 0.5 * (dot3(v, linear) + dot3(w, angular) + modal)
    linear, angular = times(base, linear), times(base, angular)
    return Sums(kinetic, strain, -dot3(g, axpy3(first, m, p)), linear, add3(cross(p, linear), angular))
