"""Work of the derivatives of the inverse dynamics: what the outward sweep finds and the inward sweep takes.

Places number the speeds so that those of a subtree follow each other: those of a link's joint, the modes of its body,
then its descendants. Rows of modes are written four at a time, also over places that are written later. Vectors have
the axes of the ground, moments and velocities the origin of their link; spatial vectors are (linear, angular).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.data import Model
from modalprep.multibody.kernels.tangents.station_data import StationWork, new_stations

FRAME = np.dtype(
    [
        ("first", np.int64),  # place of the joint's first speed
        ("modes", np.int64),  # place of the first mode
        ("end", np.int64),  # place after the last descendant
        ("velocity", np.float64, 6),
        ("acceleration", np.float64, 6),  # rates of the velocity's components in the link's axes, less gravity
        # of the link and its descendants, which the inward sweep adds; their modes held
        ("mass", np.float64),
        ("first_moment", np.float64, 3),
        ("inertia", np.float64, 6),
        ("gyro", np.float64, 18),  # derivative of force and torque by the spin, (3, 3) by rows each
        ("wrench", np.float64, 6),  # that the accelerations need
        ("sizes", np.float64, 6),  # sum of the absolute values that make it
    ]
)
COLUMN = 24  # J, V, b by coordinates, b by speeds: six numbers each
ROW = 21  # changes of the wrench by coordinates, by speeds, by accelerations: six numbers each; by the spin: three


@by_address
class Bends(NamedTuple):
    """Displacements of second order (tangents/bends.py): those of interfaces, one for passing use, of affine parts."""

    Dq: np.ndarray  # (ends, 12, N)
    Dqd: np.ndarray
    Dqdd: np.ndarray
    dp: np.ndarray  # derivative of the displacement by q
    rate_q: np.ndarray  # of its rate
    acceleration_q: np.ndarray
    rows: np.ndarray  # (ends, 3, N) derivative of the strain by q, its rate, its second rate but for q'''
    p: np.ndarray  # (ends, 12)
    rate: np.ndarray
    acceleration: np.ndarray
    along: np.ndarray  # derivative of p by the strain
    bow: np.ndarray  # second derivative
    factors: np.ndarray  # (ends, 3) g, and the derivatives of h and g


@by_address
class Turns(NamedTuple):
    """Rotations of interfaces (tangents/turns.py) and their motion relative to the body, axes of the link."""

    v: np.ndarray  # (ends, 3) rotation vector
    factors: np.ndarray  # (ends, 12) of the spin (tangents/spins.py)
    v_q: np.ndarray  # (ends, 3, N)
    spin_q: np.ndarray  # (ends, 3, N)
    w_q: np.ndarray
    wd_q: np.ndarray
    wd_qd: np.ndarray
    twist: np.ndarray  # (ends, 6)
    rate: np.ndarray  # (ends, 6)
    columns: np.ndarray  # (ends, 24, N) of the modes, at the origin of the link that is held there


@by_address
class BodyWork(NamedTuple):
    """Derivatives of the forces of flexible bodies by their own motion, axes of the link."""

    force: np.ndarray  # (nf, 6 + N) modal forces follow the wrench
    size: np.ndarray  # (nf, N) sums of the absolute values that make the modal forces
    by_spin: np.ndarray  # (3, 6 + N) of one body, as the others where the first number is not nf
    by_q: np.ndarray  # (nf, 6 + N, N)
    by_qd: np.ndarray
    by_qdd: np.ndarray  # (nf, N, N) of the modal forces
    acc_q: np.ndarray  # (12, N)
    acc_qd: np.ndarray
    eta: np.ndarray  # (3, N) with two rates
    P_eta: np.ndarray  # (3, 12, N) nine rows P' times eta and its rates; the others stay zero
    rest: np.ndarray  # (9, N) torque by eta, by its rate and by its second rate
    modal: np.ndarray  # (N,) force on eta
    by_eta: np.ndarray  # (2, N, N) its derivatives by eta and its rate
    slope: np.ndarray  # (3, N, N) of eta by q, with two rates
    product: np.ndarray  # (2, N, N)


@by_address
class Modes(NamedTuple):
    """Work of flexible bodies."""

    bends: Bends
    turns: Turns
    bodies: BodyWork
    stations: StationWork
    own: np.ndarray  # (21, N) rows of the modes of a parent at a joint
    columns: np.ndarray  # (N, 24) their columns, mode by mode


@by_address
class Sweep(NamedTuple):
    """Work of the two sweeps."""

    order: np.ndarray  # (nu,) speed at each place
    straight: np.ndarray  # (places,) whether four speeds follow each other from there
    preorder: np.ndarray  # (nl,) links, each before its descendants, which follow it at once
    frames: np.ndarray  # (nl + 1,) FRAME, the last is the ground
    columns: np.ndarray  # (places, 24) of the joints' speeds
    rows: np.ndarray  # (21, places) at the link to which the inward sweep has come
    modes: Modes | None


def new_sweep(model: Model, more: int = 0) -> Sweep:
    """Return the work of a model, with places of so many more interfaces than those to which joints are attached.

    Examples
    --------
    >>> from modalprep import Joint, System
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> new_sweep(pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))).model).order
    array([0, 1, 2])
    """
    links = model.links
    frames = np.zeros(len(links) + 1, FRAME).view(np.recarray)
    preorder = _preorder(links["parent"])
    order: list[int] = []
    for i in preorder:
        u, uq, modes = (int(links[name][i]) for name in ("u", "uq", "modes"))
        frames["first"][i] = len(order)
        order += range(u, uq)
        frames["modes"][i] = len(order)
        order += range(uq, uq + modes)
        frames["end"][i] = len(order)
    for i in reversed(preorder):
        parent = links["parent"][i]
        frames["end"][parent] = max(frames["end"][parent], frames["end"][i])
    places = len(order) + WIDTH
    straight = np.zeros(places, dtype=bool)
    for k in range(len(order) - WIDTH + 1):
        straight[k] = order[k : k + WIDTH] == list(range(order[k], order[k] + WIDTH))
    return Sweep(
        np.array(order, dtype=np.int64),
        straight,
        np.array(preorder),
        frames,
        np.zeros((places, COLUMN)),
        np.zeros((ROW, places)),
        None if model.modal is None else _modes(model, more),
    )


def _preorder(parents: np.ndarray) -> list[int]:
    """Return the links, each before its descendants, which follow it at once."""
    children: list[list[int]] = [[] for _ in range(len(parents) + 1)]
    for i, parent in enumerate(parents.tolist()):
        children[parent].append(i)
    found = []
    left = children[-1][::-1]
    while left:
        found.append(left.pop())
        left += children[found[-1]][::-1]
    return found


def first_place(model: Model) -> int:
    """Return the first place of the work for interfaces to which no joint is attached."""
    return int(model.links["phi"].max()) + 1


def _modes(model: Model, more: int) -> Modes:
    assert model.modal is not None
    N = model.modal.K.shape[1]
    slots = int(model.links["slot"].max()) + 1
    ends = first_place(model) + more + 2
    bends = {name: (ends, 12, N) for name in ("Dq", "Dqd", "Dqdd", "dp", "rate_q", "acceleration_q")}
    bends |= {"rows": (ends, 3, N), **dict.fromkeys(("p", "rate", "acceleration", "along", "bow"), (ends, 12))}
    turns = {name: (ends, 3, N) for name in ("v_q", "spin_q", "w_q", "wd_q", "wd_qd")}
    turns |= {"v": (ends, 3), "factors": (ends, 12), "twist": (ends, 6), "rate": (ends, 6)}
    bodies = {
        "force": (slots, 6 + N),
        "size": (slots, N),
        "by_spin": (3, 6 + N),
        "by_q": (slots, 6 + N, N),
        "by_qd": (slots, 6 + N, N),
        "by_qdd": (slots, N, N),
        "acc_q": (12, N),
        "acc_qd": (12, N),
        "eta": (3, N),
        "P_eta": (3, 12, N),
        "rest": (9, N),
        "modal": (N,),
        "by_eta": (2, N, N),
        "slope": (3, N, N),
        "product": (2, N, N),
    }
    return Modes(
        Bends(**_zeros(bends | {"factors": (ends, 3)})),
        Turns(**_zeros(turns | {"columns": (ends, COLUMN, N)})),
        BodyWork(**_zeros(bodies)),
        new_stations(*_station_rows(model, ends), N),
        np.zeros((ROW, N)),
        np.zeros((N, COLUMN)),
    )


def _station_rows(model: Model, ends: int) -> tuple[int, int]:
    """Return how many parts the bodies with stations have in all, and the ends of `Bends` if there are any."""
    assert model.modal is not None
    parts = int(model.modal.parts.number[model.links["kind"][model.links["stations"] >= 0]].sum())
    return parts, ends if parts else 0


def _zeros(shapes: dict[str, tuple[int, ...]]) -> dict[str, np.ndarray]:
    return {name: np.zeros(shape) for name, shape in shapes.items()}
