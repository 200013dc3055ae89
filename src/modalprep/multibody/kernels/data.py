"""Model and data of the equations of motion: constants, and the results of an evaluation.

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
from modalprep.multibody.kernels.stations.data import Parts, PartsData, parts_data

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
        ("stations", np.int64),  # first row in `PartsData` of a body with stations, else -1
        ("dampers", np.int64),  # row in `Modal.dampers`, -1 where no damper couples modes
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
        ("bias", np.float64, 6),  # acceleration where that of the parent, u' and q'' are zero
        ("M", np.float64, 6),  # articulated inertia [[M, H], [H', J]]
        ("H", np.float64, 9),
        ("J", np.float64, 6),
        ("children", np.float64, 24),  # sum of its children's articulated inertias, by axes (algebra/inertia_blocks.py)
        ("force", np.float64, 6),  # articulated bias force
        ("acceleration", np.float64, 6),  # of the origin, less gravity
        ("pivot", np.float64, 21),  # factor of the joint's inertia, for the accelerations
        ("wrench", np.float64, 6),  # external, at the origin
        ("position", np.float64, 3),  # inertial, as the following
        ("orientation", np.float64, 9),  # link to inertial
        ("velocity", np.float64, 3),
        ("slide", np.float64, 3),  # velocity relative to the parent's material, parent's axes
        ("mass", np.float64),  # of the body at this time: the model's unless it changes
        ("first_moment", np.float64, 3),
        ("inertia", np.float64, 6),
    ]
)


@by_address
class Integrals(NamedTuple):
    """Mass integrals of the flexible bodies in their links' frames: `AffinePart` of body/mass.py, theory 4.6.

    N is the largest number of modes, filled up to a multiple of four with zeros. The vectors of the four affine
    functions follow each other, component ``3 r + a`` of function r and axis a; those of a matrix by rows, ``3 a + b``.
    """

    p0: np.ndarray  # (nk, 12) p_r(0)
    strain: np.ndarray  # (nk, 12) p(0) / p(0).p(0), of the mean strain tau; zero for the constant function
    root_mass: np.ndarray  # (nk,) sqrt(m)
    B: np.ndarray  # (nk, 12, N)
    Kg_p: np.ndarray  # (nk, N, 12, N) D_r of (4.4): Kg_A, Kg_W in the affine functions
    P_rest: np.ndarray  # (nk, N, 9, N) P' of the rest of the motion
    gyro: np.ndarray  # (nk, N, 3, N) eps_cab P'_ba
    M_rest: np.ndarray  # (nk, N, N) M' = M - B^T B, M the modal mass


@by_address
class Modal(NamedTuple):
    """Constants of the flexible bodies."""

    integrals: Integrals  # of the bodies as they are given
    K: np.ndarray  # (nk, N) stiffness
    D: np.ndarray  # (nk, N) damping, of a body whose dampers couple modes the diagonal
    dampers: np.ndarray  # (bodies whose dampers couple modes, N, N) their damping off the diagonal, symmetric
    c: np.ndarray  # (nk, N, N, N) c_ljk of (4.9), j first; (nk, 0, 0, 0) where no body has T
    Phi: np.ndarray  # (interfaces, 6, N) phi (3), psi (3) at q = 0
    Kg_FT: np.ndarray  # (interfaces, N, 6, N) Kg_F (3), Kg_T (3)
    arm: np.ndarray  # (interfaces, 3) `strain_arms` of body/line.py
    parts: Parts  # of bodies with stations, whose p0, B are zero and Kg_p, Kg_FT what the stations leave


@by_address
class Model(NamedTuple):
    """Constants of a packed system."""

    links: np.ndarray  # (nl,) LINK
    interfaces: np.ndarray  # (interfaces, 3) m, on the undeformed bodies, in their links' frames
    gravity: np.ndarray  # (3,) m/s^2, inertial
    ground_rate: float  # rad/s, of the ground's turn about z
    nx: int  # number of coordinates
    modal: Modal | None  # None in a system without modes


@by_address
class ModalData(NamedTuple):
    """Results of an evaluation for the flexible bodies, in the notation of theory 4 and 5; N as in `Integrals`."""

    integrals: Integrals  # now: the model's own arrays, copies where a body loses mass
    q: np.ndarray  # (nf, N)
    qd: np.ndarray  # (nf, N)
    qdd: np.ndarray  # (nf, N)
    load: np.ndarray  # (nf, N) external modal forces
    M_rf: np.ndarray  # (nf, 6, N) S (3), C (3), with what children add; L^-1 M_fr after the elimination
    M_ff: np.ndarray  # (nf, N, N) the upper half counts; L^T with the pivots after the elimination
    b_f: np.ndarray  # (nf, N) modal bias force; L^-1 b_f after the elimination
    inverse: np.ndarray  # (nf, N) 1 / pivot
    Phi: np.ndarray  # (links on flexible parents + 1, 6, N) [Phi_k] at q; the last for passing use
    # workspace of one body: the affine part (4.4) and its terms
    Bq: np.ndarray  # (12,) B q
    Bqd: np.ndarray  # (12,) B q'
    t: np.ndarray  # (12,) q D q / 2
    td: np.ndarray  # (12,) its rate
    tdd: np.ndarray  # (12,) q' D q'
    p: np.ndarray  # (12,) p(q)
    pd: np.ndarray  # (12,) its rate
    pdd: np.ndarray  # (12,) its acceleration without q''
    p_tau: np.ndarray  # (12,) its derivative by the mean strain tau
    Kg_q: np.ndarray  # (12, N) D q
    Kg_qd: np.ndarray  # (12, N) D q'
    dp: np.ndarray  # (12, N) dp / dq
    # workspace of one body: the rest of the motion (4.9)
    eta: np.ndarray  # (N,)
    etad: np.ndarray  # (N,)
    P_eta: np.ndarray  # (12, N) nine rows P'_ab eta; the others stay zero
    gyro: np.ndarray  # (3, N) eps_cab P'_ba eta'
    d_eta: np.ndarray  # (N, N) d eta / dq of a body with T
    d_etad: np.ndarray  # (N, N) its rate
    M_d_eta: np.ndarray  # (N, N) M' d eta
    eta_bias: np.ndarray  # (N,) c q' q', the acceleration of eta without q''
    eta_force: np.ndarray  # (N,) d eta^T M' c q' q'
    row: np.ndarray  # (N,) workspace
    # workspace of one interface
    I_Phi: np.ndarray  # (6, N) inertia that it carries times its Phi
    Kg_FT_qd: np.ndarray  # (6, N) Kg_F q', Kg_T q'
    parts: PartsData  # of bodies with stations


@by_address
class Data(NamedTuple):
    """Results of an evaluation."""

    links: np.ndarray  # (nl + 1,) LINK_DATA, the last is the ground
    modal: ModalData | None


def new_data(model: Model, *, depleting: bool = False) -> Data:
    """Return the data of a model; `depleting`: bodies lose mass, so that their integrals are the present ones.

    Examples
    --------
    >>> from modalprep import Joint, System
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> packed = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> data = new_data(packed.model)
    >>> data.links["mass"], data.modal.M_rf.shape
    (array([12.,  0.]), (1, 6, 4))
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
    N = modal.K.shape[1]
    with_T = modal.c.shape[1]
    slots = int(model.links["slot"].max()) + 1
    attached = int(model.links["phi"].max()) + 2
    integrals = Integrals(*(x.copy() for x in modal.integrals)) if depleting else modal.integrals
    shapes: dict[str, tuple[int, ...]] = {
        **dict.fromkeys(("q", "qd", "qdd", "load", "b_f", "inverse"), (slots, N)),
        "M_rf": (slots, 6, N),
        "M_ff": (slots, N, N),
        "Phi": (attached, 6, N),
        **dict.fromkeys(("Bq", "Bqd", "t", "td", "tdd", "p", "pd", "pdd", "p_tau"), (12,)),
        **dict.fromkeys(("Kg_q", "Kg_qd", "dp", "P_eta"), (12, N)),
        **dict.fromkeys(("eta", "etad"), (N,)),
        "gyro": (3, N),
        **dict.fromkeys(("d_eta", "d_etad", "M_d_eta"), (with_T, with_T)),
        **dict.fromkeys(("eta_bias", "eta_force", "row"), (with_T,)),
        **dict.fromkeys(("I_Phi", "Kg_FT_qd"), (6, N)),
    }
    parts = parts_data(int(modal.parts.number[model.links["kind"][model.links["stations"] >= 0]].sum()), N)
    return ModalData(integrals, **{name: np.zeros(shape) for name, shape in shapes.items()}, parts=parts)
