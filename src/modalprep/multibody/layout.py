"""Systems packed into flat arrays for the kernel: the only place that knows an offset.

State ``y = [coordinates | speeds]``. Per body, in the order of the tree: joint coordinates (revolute: angle;
free: position of the root, inertial, and a quaternion w, x, y, z from body to inertial frame; weld and
prescribed: none), then modal coordinates. Speeds alike: rate, or velocity and angular velocity in the body
frame; then modal rates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.system import System

WELD, REVOLUTE, FREE, PRESCRIBED = range(4)
COORDINATES = np.array([0, 1, 7, 0])
SPEEDS = np.array([0, 1, 6, 0])


class Tree(NamedTuple):
    """Topology, one row per body."""

    parent: np.ndarray  # (nb,) int, -1 for the ground
    node: np.ndarray  # (nb,) int, interface of the parent
    joint: np.ndarray  # (nb,) int, WELD, REVOLUTE, FREE or PRESCRIBED
    n: np.ndarray  # (nb,) int, modes
    x: np.ndarray  # (nb,) int, first coordinate
    u: np.ndarray  # (nb,) int, first speed
    kind: np.ndarray  # (nb,) int, row of `Bodies`
    fixed: np.ndarray  # (nb, 3, 3), child to parent frame at zero angle
    axis: np.ndarray  # (nb, 3), hinge axis in the child frame
    place: np.ndarray  # (nb, 3), where a joint to the ground sits
    gravity: np.ndarray  # (3,)


class Bodies(NamedTuple):
    """Constants of each distinct body, modes padded to the largest n and interfaces to the largest number."""

    m: np.ndarray  # (nk,)
    s0: np.ndarray  # (nk, 3)
    E0: np.ndarray  # (nk, 3, 3)
    S: np.ndarray  # (nk, 3, N)
    H: np.ndarray  # (nk, 3, 3, N)
    PW: np.ndarray  # (nk, 3, 3, N, N), P_ab + Kg_W_ab
    G: np.ndarray  # (nk, 3, N, N), G_c = eps_cab P_ba: gyroscopic
    Kg_A: np.ndarray  # (nk, 3, N, N)
    Kg_c: np.ndarray  # (nk, 3, N, N), eps_cab Kg_W_ba, its symmetric part
    K: np.ndarray  # (nk, N)
    D: np.ndarray  # (nk, N)
    at: np.ndarray  # (nk, I, 3), interface positions
    phi: np.ndarray  # (nk, I, 3, N)
    psi: np.ndarray  # (nk, I, 3, N)
    Kg_F: np.ndarray  # (nk, I, 3, N, N)
    Kg_T: np.ndarray  # (nk, I, 3, N, N)


def coordinate_count(tree: Tree) -> int:
    """Return the number of coordinates: where the speeds begin in the state."""
    return int(tree.x[-1] + COORDINATES[tree.joint[-1]] + tree.n[-1])


EPSILON = np.zeros((3, 3, 3))
EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
EPSILON[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = -1.0


def pack(system: System) -> tuple[Tree, Bodies]:
    """Return the arrays of a system, fresh and contiguous.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.system import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> tree, bodies = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> tree.n, bodies.S.shape
    (array([2]), (1, 3, 2))
    """
    return topology(system), _bodies(_distinct(system))


def _distinct(system: System) -> list[FlexibleBody]:
    return list({id(system.bodies[name]): system.bodies[name] for name in system.order}.values())


def topology(system: System) -> Tree:
    """Return the tree of a system."""
    order = system.order
    joints = [system.carrier(name) for name in order]
    parents = [system.parent(joint) for joint in joints]
    types = np.array([_type(joint) for joint in joints])
    n = np.array([system.bodies[name].n for name in order])
    distinct = _distinct(system)
    kind = np.array([next(k for k, b in enumerate(distinct) if b is system.bodies[name]) for name in order])
    return Tree(
        parent=np.array([-1 if p is None else order.index(p[0]) for p in parents]),
        node=np.array([0 if p is None else p[1] for p in parents]),
        joint=types,
        n=n,
        x=np.concatenate([[0], np.cumsum(COORDINATES[types] + n)])[:-1],
        u=np.concatenate([[0], np.cumsum(SPEEDS[types] + n)])[:-1],
        kind=kind,
        fixed=np.array([joint.rotation for joint in joints]),
        axis=np.array([joint.rotation.T @ joint.axis for joint in joints]),
        place=np.array([joint.position for joint in joints]),
        gravity=np.array(system.gravity, dtype=float),
    )


def _type(joint) -> int:
    if joint.type == "revolute":
        return REVOLUTE if joint.motion is None else PRESCRIBED
    return {"weld": WELD, "free": FREE}[joint.type]


MODAL_AXES = dict(m=0, s0=0, E0=0, S=1, H=1, PW=2, G=2, Kg_A=2, Kg_c=2, K=1, D=1) | dict(
    at=0, phi=1, psi=1, Kg_F=2, Kg_T=2
)
PER_INTERFACE = ("at", "phi", "psi", "Kg_F", "Kg_T")


def _bodies(distinct: list[FlexibleBody]) -> Bodies:
    N = max(body.n for body in distinct)
    interfaces = max(len(body.interface_name) for body in distinct)
    rows = [_constants(body) for body in distinct]
    padded = {
        name: [_pad(row[name], axes, N, interfaces if name in PER_INTERFACE else None) for row in rows]
        for name, axes in MODAL_AXES.items()
    }
    return Bodies(**{name: np.array(values, dtype=float) for name, values in padded.items()})


def _constants(body: FlexibleBody) -> dict[str, np.ndarray]:
    Kg_c = np.einsum("cab,baij->cij", EPSILON, body.Kg_W)
    own = {name: getattr(body, name) for name in MODAL_AXES if hasattr(body, name)}
    return own | {
        "PW": body.P + body.Kg_W,
        "G": np.einsum("cab,baij->cij", EPSILON, body.P),
        "Kg_c": (Kg_c + Kg_c.transpose(0, 2, 1)) / 2,
        "at": body.interface_position,
    }


def _pad(array: np.ndarray, modal_axes: int, N: int, interfaces: int | None) -> np.ndarray:
    """Pad the last `modal_axes` axes to N, and the leading interface axis."""
    array = np.asarray(array, dtype=float)
    width = [(0, 0)] * array.ndim
    for axis in range(array.ndim - modal_axes, array.ndim):
        width[axis] = (0, N - array.shape[axis])
    if interfaces is not None:
        width[0] = (0, interfaces - len(array))
    return np.pad(array, width) if width else array
