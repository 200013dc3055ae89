"""Random bodies made of particles, and random trees of them: exact modal integrals without finite elements."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.model.joint_types import FREE, JOINT_TYPES, SPHERICAL
from modalprep.multibody.packing.tree import pack
from modalprep.reduction.dampers import damping_fields


def particles(rng, n):
    """Masses and places of 30 particles, n random modes that are normalised."""
    mass, x = rng.uniform(0.5, 1.0, 30), rng.standard_normal((30, 3))
    shape = rng.standard_normal((30, 3, n)) * 0.3
    if n:
        gram = np.einsum("p,pai,paj->ij", mass, shape, shape)
        shape = shape @ np.linalg.inv(np.linalg.cholesky(gram)).T
    return mass, x, shape


def integrals(mass, x, shape):
    """Mass integrals of particles."""
    return dict(
        m=mass.sum(),
        s0=mass @ x,
        E0=np.einsum("p,pa,pb->ab", mass, x, x),
        S=np.einsum("p,pai->ai", mass, shape),
        H=np.einsum("p,pb,pai->abi", mass, x, shape),
        P=np.einsum("p,pai,pbj->abij", mass, shape, shape),
    )


def random_body(rng, n, *, geometric=True, damping=False):
    """Body of 30 particles with n random modes; its geometric stiffness is random but symmetric, and so is its T.

    Bodies of 2, 3 and 5 modes have T; with `damping`, two dampers couple the modes of bodies of 3 and more.
    """
    grown = 0.1 * np.random.default_rng(n).standard_normal((n, n, n))
    mass, x, shape = particles(rng, n)

    def symmetric(*axes):
        a = rng.standard_normal((*axes, n, n))
        return 0.15 * geometric * (a + np.swapaxes(a, -1, -2))

    carried = np.array([0.0, 0.3, 0.3])[:, None, None]  # the root is at rest in the body's frame
    frame = {"root": np.zeros(3), "a": rng.standard_normal(3), "b": rng.standard_normal(3)}
    rigid = rigid_body("random", mass=mass.sum(), centre=np.zeros(3), inertia=np.eye(3), interfaces=frame)
    body = rigid.with_(
        **integrals(mass, x, shape),
        Kg_A=symmetric(3), Kg_W=symmetric(3, 3), Kg_F=symmetric(3, 3), Kg_T=symmetric(3, 3),
        phi=carried * rng.standard_normal((3, 3, n)), psi=carried * rng.standard_normal((3, 3, n)),
        K=rng.uniform(1.0, 3.0, n), D=damping * rng.uniform(0.0, 0.3, n), frequency=np.sqrt(rng.uniform(1.0, 3.0, n)),
        shape=0.1 * np.ones((3, 3, n)), T=grown + grown.swapaxes(1, 2) if geometric and n in (2, 3, 5) else None,
    )  # fmt: skip
    return with_dampers(body) if damping and n > 2 else body


def with_dampers(body, ratio=0.1):
    """The body with two dampers more, which couple its modes, of about such a damping ratio."""
    across = body.K[:, None] ** 0.25 * np.random.default_rng(body.n).standard_normal((body.n, 2))
    return body.with_(**damping_fields(body.D, ratio * across @ across.T))


KINDS = tuple(JOINT_TYPES)
ROOTS = (*KINDS, "prescribed", "sliding")


def random_tree(seed, *, root="free", prescribed=True, gravity=True, damping=True, geometric=True, most=6):
    """Tree of 2 to 7 bodies with 0 to 5 modes, every joint type, one body record shared by two names."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 8))
    bodies = {
        f"b{i}": random_body(rng, int(rng.integers(0, most)), geometric=geometric, damping=damping)
        for i in range(count)
    }
    bodies[f"b{count - 1}"] = bodies["b0"]
    kinds = [*KINDS, *(["prescribed", "sliding"] if prescribed else [])]
    joints = [_joint(rng, "j0", root, "ground", "b0")]
    for i in range(1, count):
        parent = f"b{rng.integers(0, i)}.{rng.choice(['a', 'b'])}"
        joints.append(_joint(rng, f"j{i}", str(rng.choice(kinds)), parent, f"b{i}"))
    pull = rng.standard_normal(3) if gravity else np.zeros(3)
    return mp.System(bodies=bodies, joints=tuple(joints), gravity=pull)


def _joint(rng, name, kind, parent, child):
    driven = {"prescribed": "revolute", "sliding": "prismatic"}
    return mp.Joint(
        name=name,
        type=driven.get(kind, kind),
        parent=parent,
        child=child,
        **directions(rng, driven.get(kind, kind)),
        rotation=Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix(),
        motion=mp.multibody.TimeFunction("sin(t)") if kind in driven else None,
    )


def directions(rng, kind):
    """Random axes of a joint of a type, and its constants; two are drawn for each type, so that others stay."""
    return axes_of(kind, *rng.standard_normal((2, 3)))


def axes_of(kind, axis, second):
    """Return those of two axes that a joint of a type has, and its constants, by key."""
    steps = JOINT_TYPES[kind]
    axes = ({"axis": axis} if steps.motions else {}) | ({"second_axis": second} if steps.second_axis else {})
    return axes | {constant.name: 2.0 for constant in steps.constants}


def random_state(system, seed, size=0.2):
    """State vector with proper quaternions."""
    rng = np.random.default_rng(seed)
    packed = pack(system)
    y = size * rng.standard_normal(packed.nx + packed.nu)
    for x, kind in zip(packed.model.links["x"], packed.types, strict=True):
        if kind in (SPHERICAL, FREE):
            first = x + (3 if kind == FREE else 0)
            y[first : first + 4] = rng.standard_normal(4)
    return y


def order_n(system, y, motion, tau=None):
    """Accelerations by the kernel, and what every hinge exerts on its link (nl, 6)."""
    packed = pack(system)
    data = packed.data()
    udot, forces = np.zeros(packed.nu), np.zeros((len(packed.links), 6))
    tau = np.zeros(packed.nu) if tau is None else tau
    assert kernel.accelerations(packed.model, data, y, motion, tau, udot) == -1
    kernel.reactions(packed.model, data, forces)
    return udot, forces
