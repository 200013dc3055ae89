"""Reading SID_FEM: the modal body that a file of FEMBS, of another program or of modalprep describes.

The file holds contractions of the modal integrals, which determine them to first order: H follows from ``J.M1`` (its
symmetric part) and ``Cr.M0`` (its antisymmetric part), the sum ``P + Kg_W`` from ``Cr.M1`` and ``Oe.M1`` in the same
way, so that the layouts of Gr and Ge, which differ between programs, are not needed (theory 4).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import affine_part
from modalprep.body.mass_tensor import nearest_mass_tensor
from modalprep.errors import InputError
from modalprep.formats.bodies.described import MESH, ROUND_OFF, body_of, even, modes_of, with_notes
from modalprep.formats.bodies.sid_blocks import Contents, read_contents
from modalprep.formats.contractions import centrifugal, from_centrifugal, from_moment, inertia
from modalprep.formats.sid import Taylor

AGREES = 1e-6  # relative: two blocks that hold the same number


class Moments(NamedTuple):
    """First-order terms of a file in its own coordinates: the arrays of `FlexibleBody`, with ``F = P + Kg_W``."""

    E0: np.ndarray
    S: np.ndarray
    H: np.ndarray
    F: np.ndarray
    Kg_A: np.ndarray
    planar: bool


def sid_body(path: Path) -> FlexibleBody:
    """Return the body of a SID_FEM file, in the units of its numbers.

    Every dialect of `modalprep.formats.sid` is read. The nodes are its interfaces, with the names that modalprep wrote,
    or ``node_1`` for label 1.

    References
    ----------
    O. Wallrapp, Standardization of flexible body modeling in multibody system codes, part I: definition of standard
    input data, Mech. Struct. Mach. 22 (1994) 283.
    """
    file = read_contents(path)
    found = _moments(file)
    blocks = file.body
    n = len(file.body["Me"].M0)
    nodes = list(file.nodes.values())
    position = np.array([node["origin"].M0[:, 0] for node in nodes])
    phi = np.array([node["phi"].M0 for node in nodes])
    body = body_of(
        name=file.name,
        m=file.mass,
        s0=blocks["mdCM"].M0[:, 0],
        E0=found.E0,
        M=blocks["Me"].M0,
        K=blocks["Ke"].M0,
        D=blocks["De"].M0,
        S=found.S,
        H=found.H,
        P=np.zeros((3, 3, n, n)),
        Kg_A=found.Kg_A,
        Kg_W=found.F,
        Kg_F=even(-np.array([_first(node["phi"], n).swapaxes(1, 2) for node in nodes])),
        Kg_T=even(-np.array([_first(node["psi"], n).swapaxes(1, 2) for node in nodes])),
        phi=phi,
        psi=np.array([node["psi"].M0 for node in nodes]),
        interface_name=tuple(file.nodes),
        interface_position=position,
        points=position,
        shape=phi,
    )
    own = np.array_equal(modes_of(blocks["Me"].M0, blocks["Ke"].M0), np.eye(n))
    body = _with_mass_tensor(body)
    return with_notes(body, "SID_FEM", _notes(body, file, found.planar, own), file.modes)


def _moments(file: Contents) -> Moments:
    n = len(file.body["Me"].M0)
    blocks = file.body
    m = file.mass
    s0 = blocks["mdCM"].M0[:, 0]
    S = blocks["Ct"].M0.T
    J = _tensor(blocks["J"].M0)
    dJ, of_J = _even_part(blocks, n)
    Cr = blocks["Cr"]
    field = _first(blocks["Oe"], n)
    turn = _first(blocks["Cr"], n)
    planar = not (np.any(J[:2]) or np.any(Cr.M0[:, :2]) or np.any(turn[:, :, :2]) or np.any(s0[2:]))
    F = from_moment(turn.transpose(2, 0, 1)) + from_centrifugal(field.transpose(2, 0, 1))
    H = from_moment(Cr.M0.T) + dJ
    E0 = np.trace(J) / 2 * np.eye(3) - J
    _refuse_contradiction("Ct.M0", S, "mdCM.M1", _first(blocks["mdCM"], n)[:, :, 0])
    if of_J:
        _refuse_contradiction("J.M1", centrifugal(H), "Oe.M0", blocks["Oe"].M0.T)
    if planar:
        E0 = _in_plane(m, s0, E0)
        H = _planar_least(H, S, s0 / m)
        F = _without_normal(F)
    return Moments(E0, S, H, F, even(_first(blocks["Ct"], n).transpose(2, 0, 1)), planar)


def _refuse_contradiction(one: str, a: np.ndarray, other: str, b: np.ndarray) -> None:
    """Refuse two blocks that hold the same numbers and do not agree; one of zeros alone was left out."""
    if np.any(b) and np.abs(a - b).max() > AGREES * max(np.abs(a).max(), np.abs(b).max()):
        raise InputError(f"{one} and {other} hold the same integrals but do not agree; the file is damaged")


def _first(term: Taylor, n: int) -> np.ndarray:
    return np.zeros((len(term.M0), n, term.M0.shape[1])) if term.M1 is None else term.M1


def _tensor(J: np.ndarray) -> np.ndarray:
    """Return (3, 3, ...) of xx, yy, zz, xy, xz, yz (6, 1, ...), or of the matrix."""
    if J.shape[0] == 3:
        return (J + J.swapaxes(0, 1)) / 2
    return J[[0, 3, 4, 3, 1, 5, 4, 5, 2], 0].reshape(3, 3, *J.shape[2:])


def _even_part(blocks: dict[str, Taylor], n: int) -> tuple[np.ndarray, bool]:
    """Return the symmetric part of H (3, 3, n): of ``J.M1 = tr(E) - E``, ``E = H + H^T``, else of Oe; whether of J."""
    if blocks["J"].M1 is None:
        return from_centrifugal(blocks["Oe"].M0.T), False
    J1 = _tensor(blocks["J"].M1.swapaxes(1, 2))
    return inertia(J1) / 2 - np.einsum("ab,cc...->ab...", np.eye(3), J1) / 4, True


def _in_plane(m: float, s0: np.ndarray, E0: np.ndarray) -> np.ndarray:
    """Return E0 of a file with the moment of inertia about z alone: equal in x and y about the centre of mass."""
    about = E0[0, 0] + E0[1, 1] - s0 @ s0 / m
    return np.diag([about, about, 0.0]) / 2 + np.outer(s0, s0) / m


def _planar_least(H: np.ndarray, S: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the least H about the centre with the moment and the trace of a motion in the plane."""
    own = np.einsum("ai,b->abi", S, centre)
    X = H - own
    trace = (X[0, 0] + X[1, 1]) / 2
    turn = (X[1, 0] - X[0, 1]) / 2
    zero = np.zeros_like(trace)
    return own + np.array([[trace, -turn, zero], [turn, trace, zero], [zero, zero, zero]])


def _without_normal(F: np.ndarray) -> np.ndarray:
    F = F.copy()
    F[2, 2] = 0.0
    return F


def _with_mass_tensor(body: FlexibleBody) -> FlexibleBody:
    """Divide the sum of P and Kg_W, which stands for Kg_W; a file without it leaves both zero."""
    field = body.Kg_W
    if not np.any(field):
        return body
    P = nearest_mass_tensor(field, affine_part(body).B, body.modal_mass)
    Kg = even(field - P)
    none = np.abs(Kg).max() <= ROUND_OFF * np.abs(field).max()
    return body.with_(P=P, Kg_W=np.zeros_like(Kg) if none else Kg)


def _notes(body: FlexibleBody, file: Contents, planar: bool, own: bool) -> list[str]:
    said = [MESH]
    if not np.any(body.P):
        said.append("Cr and Oe of first order: the modes feel no centrifugal and no Coriolis forces")
    elif body.has_geometric_stiffness:
        said.append("P and Kg_W apart from their sum, which decides to second order: the nearest possible P is taken")
    else:
        said.append("geometric stiffness: there is none, so that spins well below the first frequency are in order")
    if planar:
        said.append(
            "inertia other than about z: the file describes motions in the plane x y alone, and out of it the body "
            "has an inertia that was made up"
        )
    if not own:
        said.append("modes that are orthogonal: the coordinates are those of Me and Ke")
    if np.any(file.body["ksigma"].M0):
        said.append("a state without stress: its prestress load ksigma is dropped")
    return said
