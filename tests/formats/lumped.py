"""Particles with random mode shapes to second order: every term of an exchange format is a sum over them.

Particle p is at ``x + phi q + 1/2 q g q``. The displacement of second order is what geometric stiffness stands for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.body.rigid import rigid_body
from modalprep.multibody.reference.equations import node_motion


@dataclass
class Particles:
    """Masses (p,), positions (p, 3), shapes (p, 3, n), curvatures (p, 3, n, n); rotations (k, 3, n) of the nodes.

    The interfaces are particles 1 to k - 1; the root is the origin.
    """

    m: np.ndarray
    x: np.ndarray
    phi: np.ndarray
    g: np.ndarray
    psi: np.ndarray
    Kg_T: np.ndarray
    K: np.ndarray
    D: np.ndarray

    def __iter__(self):
        """Yield (m, x, phi, g) of each particle."""
        return zip(self.m, self.x, self.phi, self.g, strict=True)


def particles(seed=0, n=4, count=12, interfaces=3, curvature=0.2) -> Particles:
    rng = np.random.default_rng(seed)
    m, x = rng.uniform(0.5, 1.0, count), rng.standard_normal((count, 3))
    phi = rng.standard_normal((count, 3, n))
    gram = np.einsum("p,pai,paj->ij", m, phi, phi)
    phi = phi @ np.linalg.inv(np.linalg.cholesky(gram)).T

    def symmetric(*axes):
        a = curvature * rng.standard_normal((*axes, n, n))
        return a + np.swapaxes(a, -1, -2)

    psi, Kg_T = rng.standard_normal((interfaces, 3, n)), symmetric(interfaces, 3)
    psi[0], Kg_T[0] = 0.0, 0.0
    return Particles(m, x, phi, symmetric(count, 3), psi, Kg_T, rng.uniform(1.0, 9.0, n), rng.uniform(0.0, 0.3, n))


def modal_integrals(m, x, phi, g) -> dict[str, np.ndarray]:
    """Sums of theory 4 over particles: see `Particles`."""
    return {
        "s0": m @ x,
        "E0": np.einsum("p,pa,pb->ab", m, x, x),
        "S": np.einsum("p,pai->ai", m, phi),
        "H": np.einsum("p,pb,pai->abi", m, x, phi),
        "P": np.einsum("p,pai,pbj->abij", m, phi, phi),
        "Kg_A": np.einsum("p,paij->aij", m, g),
        "Kg_W": np.einsum("p,pb,paij->abij", m, x, g),
    }


def modal_body(lump: Particles):
    """Return the particles as a modal body: the arrays of theory 4."""
    m, x, phi, g = lump.m, lump.x, lump.phi, lump.g
    k = len(lump.psi)
    names = ["root", *(f"n{i}" for i in range(1, k))]
    at = np.vstack([np.zeros((1, 3)), x[1:k]])
    rigid = rigid_body(
        "lump", mass=m.sum(), centre=np.zeros(3), inertia=np.eye(3), interfaces=dict(zip(names, at, strict=True))
    )
    return rigid.with_(
        **modal_integrals(m, x, phi, g),
        Kg_F=-np.concatenate([0 * g[:1], g[1:k]]),
        Kg_T=lump.Kg_T,
        phi=np.concatenate([0 * phi[:1], phi[1:k]]),
        psi=lump.psi,
        K=lump.K, D=lump.D, frequency=np.sqrt(lump.K) / (2 * np.pi),
        points=x, shape=phi,
    )  # fmt: skip


def shape_to_first_order(body, k, q):
    """Partial velocities (3, n) of interface k to first order in q, which is what the formats hold.

    By a central difference of the equations' own, over a step whose third order is 1e-8 of the first.
    """
    step = 1e-4

    def shape(s):
        return node_motion(body, k, np.zeros(3), s * q, 0 * q)[2][:3]

    return shape(0.0) + (shape(step) - shape(-step)) / (2 * step)
