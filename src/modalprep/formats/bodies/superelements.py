"""Reading superelements: stiffness and mass on boundary nodes and generalised coordinates, as Nastran has them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import cross_moment
from modalprep.errors import InputError
from modalprep.fe.external.model import unit_factors
from modalprep.fe.readers.output4 import read_output4
from modalprep.formats.bodies.described import NOTES, Units
from modalprep.formats.contractions import moment
from modalprep.suggest import refuse_missing
from modalprep.supplied.extseout import read_extseout
from modalprep.supplied.integrals import Rigid, moments
from modalprep.supplied.matrices import checked, rigid_motion
from modalprep.supplied.reduced import REBUILT, body_from_reduced
from modalprep.supplied.rows import Points
from modalprep.supplied.turning import turning_stiffness

STIFFENING = "stress stiffness: the body is for spins well below its first frequency"
MASSLESS = 1e6  # of the lowest elastic frequency: a mode above it has round-off for its mass
RIGID = 1e-6  # of a unit motion, where the recovery of a node follows a rigid motion
SAME = 1e-9  # of a unit motion: the recovery of a row of the matrices
LARGEST = 10**9  # numbers of a matrix that is stored as a dense one


class Recovered(NamedTuple):
    """Nodes of a recovery matrix: positions (k, 3), motions (k, 3 or 6, rows), of interfaces and of the mesh."""

    place: np.ndarray
    motion: np.ndarray
    points: np.ndarray
    shape: np.ndarray


def output4_body(path: Path, length_unit: str, mass_unit: str | None) -> FlexibleBody:
    """Return the body of an OUTPUT4 file: that of an external superelement, or of ``KAAX``, ``MAAX`` and ``PHI``.

    The latter is what modalprep writes. The root is the first six rows, and the rigid motions in the recovery PHI say
    where all other nodes are.
    """
    refuse_missing(path, "OUTPUT4 file")
    found = read_output4(path)
    if "PHI" not in found or "KAAX" not in found:
        return noted(read_extseout(path, length_unit=length_unit, mass_unit=mass_unit), "cells between the nodes")
    K, M, PHI = (_dense(found, name) for name in ("KAAX", "MAAX", "PHI"))
    if len(K) < 6:
        raise InputError(f"KAAX has {len(K)} rows, of which the first six are the root")
    damping = _dense(found, "BAAX") if "BAAX" in found else None
    units: Units = {"length_unit": length_unit, "mass_unit": mass_unit}
    body = _superelement(path.stem, K, M, damping, _recovered(PHI, K), units)
    return noted(body, "names of the interfaces", "cells between the nodes")


def _dense(matrices: dict[str, csr_array], name: str) -> np.ndarray:
    if name not in matrices:
        raise InputError(f"it holds {', '.join(matrices)} and no {name}; export it again")
    if np.prod(matrices[name].shape) > LARGEST:
        raise InputError(f"{name} is of {matrices[name].shape} numbers, too large for a reduced body")
    return matrices[name].toarray()


def _recovered(PHI: np.ndarray, K: np.ndarray) -> Recovered:
    """Return the nodes of a recovery matrix: interfaces have six rows, nodes of the mesh three."""
    if PHI.shape[1] != len(K) or len(PHI) % 3:
        raise InputError(f"PHI has the shape {PHI.shape}; it needs {len(K)} columns, and three or six rows for a node")
    root = np.eye(len(K), 6)
    T = rigid_motion(checked(K, "stiffness", "row {}".format), root, np.arange(6, len(K)), "row {}".format)
    blocks = PHI.reshape(-1, 3, len(K))
    moved = (PHI @ T).reshape(-1, 3, 6)
    turning = np.abs(moved[:, :, :3]).max(axis=(1, 2)) <= RIGID
    count = 2 * int(turning.sum())
    wanted = np.zeros(len(turning), dtype=bool)
    wanted[1:count:2] = True
    if not np.array_equal(turning, wanted) or np.abs(moved[~turning][:, :, :3] - np.eye(3)).max() > RIGID:
        raise InputError("PHI does not move its nodes rigidly where the stiffness resists no motion")
    place = -moment(moved[:, :, 3:].transpose(1, 2, 0)).T / 2
    return Recovered(place[:count:2], PHI[: 3 * count].reshape(-1, 6, len(K)), place[count:], blocks[count:])


def _superelement(
    name: str, K: np.ndarray, M: np.ndarray, damping: np.ndarray | None, nodes: Recovered, units: Units
) -> FlexibleBody:
    """Return the body with the interfaces that are rows of the matrices, then those that follow by recovery."""
    own = [_rows(motion) for motion in nodes.motion]
    kept, others = ([k for k, rows in enumerate(own) if (rows is None) == follows] for follows in (False, True))
    first = own[0] if own else None
    if first is None or not np.array_equal(first, np.arange(6)):
        raise InputError("the first six rows of PHI are not those of the root")
    names = ["root", *(f"interface_{k + 1}" for k in range(1, len(own)))]
    points = Points(  # translations and rotations of the others, as if of two points
        np.concatenate([np.repeat(nodes.place[others], 2, axis=0), nodes.points]),
        np.concatenate([nodes.motion[others].reshape(-1, 3, len(K)), nodes.shape]),
    )
    body = body_from_reduced(
        name,
        K,
        M,
        nodes.place[kept],
        damping=damping,
        dof=np.array([own[k] for k in kept]),
        names=[names[k] for k in kept],
        points=points,
        **units,
    )
    mesh = len(kept) + 2 * len(others)
    length = unit_factors(**units)[0]
    followed = body.shape[len(kept) : mesh]
    phi = np.concatenate([body.phi, followed[::2]])
    psi = np.concatenate([body.psi, followed[1::2] / length])
    place = np.concatenate([body.interface_position, length * nodes.place[others]])
    rigid = Rigid(body.m, body.s0, body.E0)
    turn = moments(rigid, body.S, cross_moment(body.H), body.H).turn
    Kg = turning_stiffness(rigid, turn, body.S, body.H, place, phi, psi)
    drawn = slice(mesh if len(nodes.points) else 0, None)
    return body.with_(
        phi=phi,
        psi=psi,
        interface_position=place,
        Kg_F=Kg.Kg_F,
        Kg_T=Kg.Kg_T,
        interface_name=(*body.interface_name, *(names[k] for k in others)),
        points=body.points[drawn],
        shape=body.shape[drawn],
    )


def _rows(motion: np.ndarray) -> np.ndarray | None:
    """Return the rows of the matrices that are the motion (6, rows) of a node, None where it follows others."""
    rows = np.argmax(motion, axis=1)
    unit = np.zeros_like(motion)
    unit[np.arange(6), rows] = 1.0
    return rows if np.abs(motion - unit).max() <= SAME else None


def noted(body: FlexibleBody, *lost: str) -> FlexibleBody:
    """Return the body without modes of round-off, with what its matrices and its file do not tell in its provenance."""
    said = [f"{body.provenance[REBUILT]}, which are rebuilt from its rigid motions", STIFFENING, *lost]
    lowest = body.frequency[body.frequency > 0].min(initial=np.inf)
    heavy = body.frequency <= MASSLESS * lowest
    if not np.all(heavy):
        body = _with_modes(body, heavy)
        said.append(f"mass in {np.count_nonzero(~heavy)} motions, which are left out: it is round-off")
    return body.with_(provenance=body.provenance | {"format": "superelement", NOTES: "; ".join(said)})


def _with_modes(body: FlexibleBody, kept: np.ndarray) -> FlexibleBody:
    """Return the body with some of its modes."""
    vectors = ("S", "H", "phi", "psi", "shape", "K", "D", "frequency")
    forms = ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T")
    changed = {name: getattr(body, name)[..., kept] for name in vectors}
    changed |= {name: getattr(body, name)[..., kept, :][..., kept] for name in forms}
    coupled = body.coupled_damping
    changed["coupled_damping"] = None if coupled is None else coupled[np.ix_(kept, kept)]
    changed["recovery"] = {name: rows.with_(q=rows.q[..., kept]) for name, rows in body.recovery.items()}
    return body.with_(**changed)
