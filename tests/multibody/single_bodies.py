"""Bodies of a few numbers, and one on a joint to the ground."""

import numpy as np

import modalprep as mp

DOWN = np.array([0.0, -1.0, 0.0])


def rigid(mass=2.0, centre=(0.5, 0, 0), inertia=(0.1, 0.2, 0.3), **interfaces):
    ends = {"root": np.zeros(3)} | {name: np.array(at, dtype=float) for name, at in interfaces.items()}
    return mp.rigid_body("part", mass=mass, centre=np.array(centre), inertia=np.diag(inertia), interfaces=ends)


def carried(body, **joint):
    return mp.System(
        bodies={"part": body},
        joints=(mp.Joint(name="joint", parent="ground", child="part", **joint),),
        gravity=10 * DOWN,
    )


def particles(rng, count=3):
    """A rigid hub and particles on springs, each free in all directions: w x phi stays within the modes."""
    x, m, n = rng.standard_normal((count, 3)), rng.uniform(0.5, 1, count), 3 * count
    shape = np.zeros((count, 3, n))
    for p in range(count):
        shape[p, :, 3 * p : 3 * p + 3] = np.eye(3) / np.sqrt(m[p])
    return rigid(5 + m.sum()).with_(
        s0=m @ x,
        E0=np.diag([1, 2, 1.5]) + np.einsum("p,pa,pb->ab", m, x, x),
        S=np.einsum("p,pai->ai", m, shape),
        H=np.einsum("p,pb,pai->abi", m, x, shape),
        P=np.einsum("p,pai,pbj->abij", m, shape, shape),
        Kg_A=np.zeros((3, n, n)), Kg_W=np.zeros((3, 3, n, n)), Kg_F=np.zeros((1, 3, n, n)), Kg_T=np.zeros((1, 3, n, n)),
        phi=np.zeros((1, 3, n)), psi=np.zeros((1, 3, n)), K=rng.uniform(20, 40, n), D=np.zeros(n), frequency=np.ones(n),
        points=x, shape=shape,
    )  # fmt: skip
