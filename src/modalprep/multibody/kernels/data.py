"""Model and data of the equations of motion: what is constant, and what an evaluation writes.

A packed system is a tree of links, parents first. A joint of several axes is a chain of joints of one axis with
massless links between; the last link carries the body. A link's frame has the joint's axis as z; its body's constants
are turned there when packed, so that users' frames never change.

State ``y = [coordinates | speeds]``. Per link: its joint's coordinates (revolute: angle; sliding: length;
spherical: quaternion w, x, y, z of the body in the parent's axes; free: position of the root in the parent's interface
frame, then the quaternion; weld and prescribed: none), then modal coordinates. Speeds alike: rate; spherical: angular
velocity relative to the parent, in the body's axes; free: velocity of the root and angular velocity, relative
to the parent, in the body's axes; then modal rates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address

# Types of links' joints. SLIDING moves along its axis, PRESCRIBED along or about it, by the link's `along` and `about`.
WELD, REVOLUTE, SLIDING, SPHERICAL, FREE, PRESCRIBED = range(6)
COORDINATES = (0, 1, 1, 4, 7, 0)
SPEEDS = (0, 1, 1, 3, 6, 0)

UNIT, AFFINE, GROWS = range(3)  # `modal_mass` of a link: 1 throughout; geometric stiffness or another fill; T

EPSILON = np.zeros((3, 3, 3))
EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
EPSILON[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = -1.0

# One link of the model. Rotations by rows; a moment of inertia by xx, xy, xz, yy, yz, zz.
LINK = np.dtype(
    [
        ("parent", np.int64),  # link; the number of links for the ground
        ("interface", np.int64),  # of the parent's body
        ("joint", np.int64),  # type
        ("along", np.float64),  # of a joint of one axis: travel (m) and turn (rad) per unit of its coordinate
        ("about", np.float64),
        ("modes", np.int64),
        ("x", np.int64),  # first coordinate
        ("u", np.int64),  # first speed, counted from the first speed
        ("xq", np.int64),  # first modal coordinate
        ("uq", np.int64),  # first modal speed
        ("kind", np.int64),  # row in `Modal`, -1 rigid
        ("slot", np.int64),  # row in `ModalData`, -1 rigid
        ("modal_mass", np.int64),  # UNIT, AFFINE or GROWS
        ("body", np.int64),  # in the system's order, -1 none
        ("phi", np.int64),  # row of `ModalData.Phi` of the parent's interface, -1 rigid parent
        ("first_interface", np.int64),  # row of `Model.interfaces`
        ("last_child", np.int64),  # link, -1 of a tip
        ("rotation", np.float64, 9),  # joint frame at zero to the parent's link frame
        ("arm", np.float64, 3),  # interface on the parent's undeformed body, in the parent's link frame, m
        ("align", np.float64, 9),  # link frame to the body's frame
        ("mass", np.float64),  # kg, of the body
        ("first_moment", np.float64, 3),  # kg m
        ("inertia", np.float64, 6),  # kg m^2, about the link's origin
    ]
)

# One link of the data, in its own axes where nothing else is said. Spatial vectors are (linear, angular).
LINK_DATA = np.dtype(
    [
        ("rotation", np.float64, 9),  # to the parent link's axes
        ("arm", np.float64, 3),  # from the parent link's origin, in its axes
        ("omega", np.float64, 3),  # angular velocity, inertial
        ("bias", np.float64, 6),  # acceleration when that of the parent, u' and q'' are zero
        ("M", np.float64, 6),  # articulated inertia [[M, H], [H', J]]
        ("H", np.float64, 9),
        ("J", np.float64, 6),
        ("handed", np.float64, 24),  # what children add to it, by axes (algebra/inertia_blocks.py)
        ("force", np.float64, 6),  # articulated bias force
        ("acceleration", np.float64, 6),  # of the origin, less gravity
        ("pivot", np.float64, 21),  # what the joint's elimination leaves for the accelerations
        ("wrench", np.float64, 6),  # external, at the origin
        ("position", np.float64, 3),  # inertial, as the following
        ("orientation", np.float64, 9),  # link to inertial
        ("velocity", np.float64, 3),
        ("slide", np.float64, 3),  # velocity relative to the parent's material, parent's axes
        ("mass", np.float64),  # of the body now: the model's, where nothing changes it
        ("first_moment", np.float64, 3),
        ("inertia", np.float64, 6),
    ]
)


@by_address
class Integrals(NamedTuple):
    """Mass integrals of the flexible bodies in their links' frames.

    N is the largest number of modes, filled up to a multiple of four with zeros. The affine part and the rest of a
    body's motion are those of body/mass.py. Rows of N numbers, one of each mode i, stand one after the other
    (algebra/rows.py), functions r first, then axes: in `base` B (12 rows); in `by_q` (factors of q_j and q'_j) D (12);
    in `rest` (of q_j) P'_ab (9); in `gyro` (of q'_j) ``eps_cab P'_ba`` (3).
    """

    place: np.ndarray  # (nk, 25) p(0), p(0) / p(0).p(0) of the mean strain, sqrt(m)
    base: np.ndarray  # (nk, 12 N)
    by_q: np.ndarray  # (nk, N, 12 N), j first
    rest: np.ndarray  # (nk, N, 9 N)
    gyro: np.ndarray  # (nk, N, 3 N)
    mass: np.ndarray  # (nk, N, N) M - B^T B, M the modal mass


@by_address
class Modal(NamedTuple):
    """Constants of the flexible bodies."""

    integrals: Integrals  # of the bodies as they are given
    diagonal: np.ndarray  # (nk, 2, N) K, D
    second: np.ndarray  # (nk, N, N, N) c_ljk of the rest, j first; (nk, 0, 0, 0) where no body has T
    shape: np.ndarray  # (interfaces, 6 N) rows of phi (3), psi (3)
    Kg_node: np.ndarray  # (interfaces, N, 6 N) rows of Kg_F (3), Kg_T (3)
    arm: np.ndarray  # (interfaces, 3) `strain_arms` of body/line.py


@by_address
class Model(NamedTuple):
    """What is constant in a packed system."""

    links: np.ndarray  # (nl,) LINK
    interfaces: np.ndarray  # (interfaces, 3) m, on the undeformed bodies, in their links' frames
    gravity: np.ndarray  # (3,) m/s^2, inertial
    ground_rate: float  # rad/s, of the ground's turn about z
    nx: int  # number of coordinates
    modal: Modal | None  # None in a system without modes


@by_address
class ModalData(NamedTuple):
    """What an evaluation writes of the flexible bodies; N as in `Integrals`, rows filled up with zeros."""

    integrals: Integrals  # now: the model's own arrays, copies where a body loses mass
    q: np.ndarray  # (nf, N)
    qd: np.ndarray  # (nf, N)
    load: np.ndarray  # (nf, N) external modal forces
    qdd: np.ndarray  # (nf, N)
    Z: np.ndarray  # (nf, N, 8 + N): [S C | b_f | 1 / pivot], then M_ff, the upper half; eliminated in place
    Phi: np.ndarray  # (links on flexible parents + 1, 6 N): rows of [Phi_k]; the last for passing use
    dp: np.ndarray  # (12 N,) rows of one body's dp(q); then D q', P' q, the gyroscopic products with q'
    Dqd: np.ndarray  # (12 N,)
    affine: np.ndarray  # (5, 12) p, p', p'' without q'', workspace
    rest: np.ndarray  # (12 N,) nine rows; the others stay zero
    gyro: np.ndarray  # (3 N,)
    eta: np.ndarray  # (2, N) coordinates of the rest and their rates
    slope: np.ndarray  # (3, N, N) of a body with T: d eta / d q, its rate, M' d eta
    turned: np.ndarray  # (N,) of a body with T: a row of `rest` or `gyro` for eta
    curved: np.ndarray  # (2, N) of a body with T: c q' q', and its modal force
    phi: np.ndarray  # (6 N,) rows of the inertia that one interface carries, times its Phi
    turn: np.ndarray  # (6 N,) rows of one interface's ``Kg_F q'``, ``Kg_T q'``


LOAD, INVERSE = 6, 7  # in the first eight of a row of `ModalData.Z`: b_f and 1 / pivot, after S and C


@by_address
class Data(NamedTuple):
    """What an evaluation writes."""

    links: np.ndarray  # (nl + 1,) LINK_DATA, the last is the ground
    modal: ModalData | None


def new_data(model: Model, *, depleting: bool = False) -> Data:
    """Return the data of a model; `depleting`: bodies lose mass, so that their integrals are those of the moment.

    Examples
    --------
    >>> from modalprep import Joint, System
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> packed = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> data = new_data(packed.model)
    >>> data.links["mass"], data.modal.Z.shape
    (array([12.,  0.]), (1, 4, 12))
    """
    links = np.zeros(len(model.links) + 1, LINK_DATA).view(np.recarray)
    for name in ("mass", "first_moment", "inertia"):
        links[name][:-1] = model.links[name]
    ground = links[-1]
    ground["orientation"][[0, 4, 8]] = 1.0
    ground["acceleration"][:3] = -model.gravity
    ground["omega"][2] = model.ground_rate
    return Data(links, None if model.modal is None else _modal_data(model, model.modal, depleting))


def _modal_data(model: Model, modal: Modal, depleting: bool) -> ModalData:
    N, grows = modal.integrals.by_q.shape[1], modal.second.shape[1]
    slots = int(model.links["slot"].max()) + 1
    attached = int(model.links["phi"].max()) + 2
    integrals = Integrals(*(x.copy() for x in modal.integrals)) if depleting else modal.integrals
    shapes = {
        "q": (slots, N),
        "qd": (slots, N),
        "load": (slots, N),
        "qdd": (slots, N),
        "Z": (slots, N, 8 + N),
        "Phi": (attached, 6 * N),
        "dp": (12 * N,),
        "Dqd": (12 * N,),
        "affine": (5, 12),
        "rest": (12 * N,),
        "gyro": (3 * N,),
        "eta": (2, N),
        "slope": (3, grows, grows),
        "turned": (grows,),
        "curved": (2, grows),
        "phi": (6 * N,),
        "turn": (6 * N,),
    }
    return ModalData(integrals, **{name: np.zeros(shape) for name, shape in shapes.items()})
