"""What the compiled equations of motion read and write: the packed tree, its modes, their scratch.

The packed tree consists of links, parents first. A joint of several axes is a chain of hinges with massless links
between; the last link carries the body. A link's frame has the hinge axis as z; its body's constants are turned
there when packed, so that users' frames never change.

State ``y = [coordinates | speeds]``. Per link: its hinge's coordinates (revolute: angle; prismatic: length; spherical:
quaternion w, x, y, z of the body in the parent's axes; free: position of the root in the parent's interface
frame, then the quaternion; weld and prescribed: none), then modal coordinates. Speeds alike: rate; spherical: angular
velocity relative to the parent, in the body's axes; free: velocity of the root and angular velocity, relative
to the parent, in the body's axes; then modal rates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

WELD, REVOLUTE, PRISMATIC, SPHERICAL, FREE, PRESCRIBED_REVOLUTE, PRESCRIBED_PRISMATIC = range(7)
COORDINATES = (0, 1, 1, 4, 7, 0, 0)
SPEEDS = (0, 1, 1, 3, 6, 0, 0)
PRESCRIBED = (PRESCRIBED_REVOLUTE, PRESCRIBED_PRISMATIC)

# columns of Tree.ints
PARENT, NODE, JOINT, MODES, X, U, KIND, SLOT, HAS_KG, BODY, PHI, XQ, UQ, NODES, NX, INTS = range(16)

# columns of Tree.fixed
C, ARM0, ALIGN, MASS, FIRST, INERTIA, FIXED = 0, 9, 12, 21, 22, 25, 31
GROUND_RATE = 3  # in the row of the ground

# columns of W
R, ARM, OMEGA, BIAS, IA, PA, A, PIVOT, WRENCH = 0, 9, 12, 15, 21, 42, 48, 54, 75
POSITION, ROTATION, VELOCITY, SLIDE, WIDTH = 81, 84, 93, 96, 99
H_, J_ = IA + 6, IA + 15

EPSILON = np.zeros((3, 3, 3))
EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
EPSILON[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = -1.0


class Tree(NamedTuple):
    """Topology and rigid constants.

    `ints`, a row per link: parent link (-1 the ground, which is the last row of W), interface of the parent's body,
    kernel joint type, modes, first coordinate, first speed (counted from the first speed), flexible kind (-1 rigid),
    flexible slot (-1), whether the modal mass is not 1 throughout (1: geometric stiffness or another fill, 2: T), body
    in the system's order (-1 none), slot of the mode shapes at the parent's interface (-1: rigid parent), first modal
    coordinate, first modal speed, first interface, and the number of coordinates of the whole system.

    `fixed`, a row per link: hinge frame at zero to the parent's link frame (9), interface on the parent's undeformed
    body in the parent's link frame (3), link frame to the body's frame (9), m, first moments s0 (3), moment of
    inertia (6: xx, xy, xz, yy, yz, zz) of the body in the link frame; then a row per interface of each body: its
    position in the link frame (3); the last row is the ground's: gravity (3), rate of its turn about z (1).
    """

    ints: np.ndarray  # (nl, 15) int64
    fixed: np.ndarray  # (nl + interfaces + 1, 31)


class Flex(NamedTuple):
    """Constants of the flexible bodies in their links' frames, modes padded to the largest number N.

    The affine part and the rest of a body's motion are those of body/mass.py. The numbers of one mode i stand together,
    functions r first, then axes: in `base` B (12); in `by_q` (factors of q_j and q'_j) D (12); in `rest` (of q_j) P'_ab
    (9); in `gyro` (of q'_j) ``eps_cab P'_ba`` (3). Rows j are filled up with zeros to N4, a multiple of four.
    """

    place: np.ndarray  # (nk, 25) p(0), p(0) / p(0).p(0) of the mean strain, sqrt(m)
    base: np.ndarray  # (nk, 12 N)
    by_q: np.ndarray  # (nk, N4, 12 N)
    rest: np.ndarray  # (nk, N4, 9 N)
    gyro: np.ndarray  # (nk, N4, 3 N)
    mass: np.ndarray  # (nk, N, N) M - B^T B, M the modal mass
    diagonal: np.ndarray  # (nk, N, 2) K, D
    second: np.ndarray  # (nk, N, N, N) c_ljk of the rest, j first; (nk, 0, 0, 0) where no body has T
    shape: np.ndarray  # (interfaces, 6 N) phi (3), psi (3)
    Kg_node: np.ndarray  # (interfaces, N, 6 N) Kg_F (3), Kg_T (3)


class Scratch(NamedTuple):
    """Scratch of the flexible bodies; rows of eight are filled up with zeros."""

    q: np.ndarray  # (nf, N4)
    qd: np.ndarray  # (nf, N4)
    load: np.ndarray  # (nf, N) external modal forces
    qdd: np.ndarray  # (nf, N / 8, 8)
    Z: np.ndarray  # (nf, N, 1 + N / 8, 8): [S C | b_f | 1 / pivot], then M_ff by blocks of eight; eliminated in place
    Phi: np.ndarray  # (links on flexible parents + 1, N, 8): [Phi_k] by mode; the last for passing use
    PhiT: np.ndarray  # (links on flexible parents + 1, 6, N / 8, 8): the same by component
    dp: np.ndarray  # (12 N,) one body's dp(q); then D q', P' q, the gyroscopic products with q'
    Dqd: np.ndarray  # (12 N,)
    affine: np.ndarray  # (5, 12) p, p', p'' without q'', t, t'
    rest: np.ndarray  # (9 N,)
    gyro: np.ndarray  # (3 N,)
    eta: np.ndarray  # (2, N4) coordinates of the rest and their rates
    slope: np.ndarray  # (3, N, N) of a body with T: d eta / d q, its rate, M' d eta
    turned: np.ndarray  # (11, N) of a body with T: rows of `rest` or `gyro` for eta; force of c q' q', and c q' q'
    phi: np.ndarray  # (6 N,) one interface's phi(q), psi(q) and their rates
    turn: np.ndarray  # (6 N,)


def workspace(tree: Tree, flex: Flex | None) -> tuple[np.ndarray, Scratch | None]:
    """Allocate the scratch of one evaluation: W (nl + 1, 99), the last row the ground, and that of the modes.

    Examples
    --------
    >>> from modalprep import Joint, System
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> packed = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> W, F = workspace(packed.tree, packed.flex)
    >>> W.shape, F.Z.shape
    ((2, 99), (1, 2, 2, 8))
    """
    W = np.zeros((len(tree.ints) + 1, WIDTH))
    W[-1, [ROTATION, ROTATION + 4, ROTATION + 8]] = 1.0
    W[-1, A : A + 3], W[-1, OMEGA + 2] = -tree.fixed[-1, :3], tree.fixed[-1, GROUND_RATE]
    if flex is None:
        return W, None
    N, slots = flex.diagonal.shape[1], int(tree.ints[:, SLOT].max()) + 1
    attached, blocks = int(tree.ints[:, PHI].max()) + 2, -(-N // 8)
    rows = [np.zeros((slots, size)) for size in (flex.by_q.shape[1], flex.by_q.shape[1], N)]
    return W, Scratch(
        *rows, np.zeros((slots, blocks, 8)), np.zeros((slots, N, 1 + blocks, 8)), np.zeros((attached, N, 8)),
        np.zeros((attached, 6, blocks, 8)), *(np.zeros(12 * N) for _ in range(2)), np.zeros((5, 12)),
        *(np.zeros(k * N) for k in (9, 3)), np.zeros((2, flex.by_q.shape[1])),
        np.zeros((3, flex.second.shape[1], flex.second.shape[1])), np.zeros((11, flex.second.shape[1])),
        *(np.zeros(6 * N) for _ in range(2)),
    )  # fmt: skip
