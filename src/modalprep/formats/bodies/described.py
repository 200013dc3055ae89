"""From what a file says of a body, in its own coordinates and units, to a `FlexibleBody`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
from scipy.linalg import LinAlgError, eigh

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import cross_moment, rigid_mass_matrix
from modalprep.errors import InputError
from modalprep.reduction.dampers import DIGITS, damping_fields
from modalprep.reduction.table import ModeTable
from modalprep.supplied.uncertainty import MISSING

ROUND_OFF = 1e-9
VECTORS = ("S", "H", "phi", "psi", "shape")
FORMS = ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T")
NOTES = "not in the file"  # key of the provenance
MESH = "mesh and shapes between the nodes: pictures show the nodes alone"
FREE = "a node at rest at the origin: only a free joint can carry the body, for others choose a node as its root"


class Units(TypedDict):
    """The units of a file."""

    length_unit: str
    mass_unit: str | None


def body_of(M: np.ndarray, K: np.ndarray, D: np.ndarray, **said: Any) -> FlexibleBody:
    """Return the body of a file in its modes, with a node at rest at the origin as its root.

    Parameters
    ----------
    M, K, D : (n, n)
        Modal mass, stiffness and damping in the coordinates of the file.
    said
        The other arrays of `FlexibleBody` in these coordinates, its name and interfaces.

    Raises
    ------
    InputError
        When the numbers are those of no body.
    """
    V = modes_of(M, K)
    said |= {name: np.einsum("ix,...ij,jy->...xy", V, said[name], V) for name in FORMS}
    said |= {name: said[name] @ V for name in VECTORS}
    k = np.diag(V.T @ K @ V).copy()
    k[np.abs(k) < ROUND_OFF * np.abs(k).max()] = 0.0
    if not k.min() >= 0:
        raise InputError(f"its stiffness has the negative eigenvalue {k.min():.3g}")
    table = ModeTable.empty(np.diag(rigid_mass_matrix(said["m"], said["s0"], said["E0"])))
    arrays: dict[str, Any] = {"cells": {}} | said
    damping = damping_fields(np.zeros(len(k)), V.T @ D @ V, DIGITS)
    body = FlexibleBody(**arrays, K=k, **damping, frequency=np.sqrt(k) / (2 * np.pi), modes=table)
    _refuse_not_finite(body)
    return _rooted(body)


def modes_of(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return M-orthonormal modes (n, n): the unit matrix where M is, and K diagonal."""
    M, K = even(M), even(K)
    size = np.sqrt(np.abs(np.outer(np.diag(K), np.diag(K))))
    if np.abs(M - np.eye(len(M))).max() < ROUND_OFF and np.all(np.abs(K - np.diag(np.diag(K))) <= ROUND_OFF * size):
        return np.eye(len(M))
    try:
        return eigh(K, M)[1]
    except LinAlgError:
        raise InputError("its modal mass is not positive definite, so that its modes have no mass") from None


def even(X: np.ndarray) -> np.ndarray:
    """Return the part that is symmetric in the modes, the last two axes."""
    return (X + X.swapaxes(-1, -2)) / 2


def _refuse_not_finite(body: FlexibleBody) -> None:
    names = (*VECTORS, *FORMS, "points", "K", "damping_matrix", "s0", "E0")
    if not all(np.all(np.isfinite(getattr(body, name))) for name in names):
        raise InputError("its numbers are too large")


def _rooted(body: FlexibleBody) -> FlexibleBody:
    """Put the node that is at rest at the origin first, with its round-off set to zero."""
    resting = np.flatnonzero(at_rest(body.interface_position, body.phi, body.psi))
    if not len(resting):
        return body.with_(provenance={"origin": "origin of the file"})
    k = int(resting[0])
    order = [k, *(j for j in range(len(body.interface_name)) if j != k)]
    moved = {key: getattr(body, key)[order] for key in ("phi", "psi", "Kg_F", "Kg_T", "interface_position")}
    for array in moved.values():
        array[0] = 0.0
    return body.with_(**moved, interface_name=tuple(body.interface_name[j] for j in order))


def at_rest(position: np.ndarray, phi: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Return which nodes (k,) are at the origin and do not move, to round-off of the largest of each array.

    Parameters
    ----------
    position : (k, 3)
    phi, psi : (k, 3, n)
        Translations and rotations in the modes.

    Examples
    --------
    >>> at_rest(np.array([[1e-18, 0, 0], [1.0, 0, 0]]), np.zeros((2, 3, 1)), np.zeros((2, 3, 1))).tolist()
    [True, False]
    """
    sizes = [np.abs(x).reshape(len(x), -1).max(axis=1, initial=0.0) for x in (position, phi, psi)]
    return np.all([size <= ROUND_OFF * max(size.max(), np.finfo(float).tiny) for size in sizes], axis=0)


def with_notes(body: FlexibleBody, said: str, notes: list[str], modes: Sequence[str] = ()) -> FlexibleBody:
    """Return the body of a format with its table of modes, and with what the file does not hold in its provenance.

    Parameters
    ----------
    said : str
        Name of the format.
    modes : sequence of str
        What the file says of each mode.
    """
    reasons = [*modes, *("mode of the file" for _ in range(body.n))][: body.n]
    momentum = np.concatenate([body.S, cross_moment(body.H)]) ** 2
    kind = "fixed-interface" if body.at_root else "free-interface"
    table = body.modes.with_rows(kind, reasons, body.frequency, momentum.T if body.at_root else np.nan)
    known = {"format": said, NOTES: "; ".join(notes), MISSING: "; ".join(notes)}
    return body.with_(modes=table, provenance=body.provenance | known)


def notes_of(body: FlexibleBody) -> list[str]:
    """Return what the file of a body did not hold, and how it was rebuilt.

    Returns
    -------
    list of str
        One note for each; none for a body that modalprep made.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> notes_of(uniform_beam(modes=2))  # of no other program's file
    []
    """
    said = body.provenance[NOTES].split("; ") if body.provenance.get(NOTES) else []
    return said + ([] if body.at_root or NOTES not in body.provenance else [FREE])


def in_si_units(body: FlexibleBody, length: float, mass: float) -> FlexibleBody:
    """Return the body of numbers in other units of length (m) and mass (kg), with seconds, in SI units.

    A modal coordinate has the unit ``length sqrt(mass)``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = in_si_units(uniform_beam(modes=2), 1e-3, 1e3)
    >>> body.m, round(float(body.interface_position[1, 0]), 6)
    (12000.0, 0.01)
    """
    if length == mass == 1.0:
        return body
    q = np.sqrt(mass)  # of S; of H and of a coordinate with one length more
    factors = {
        "m": mass,
        "s0": mass * length,
        "E0": mass * length**2,
        "S": q,
        "H": q * length,
        "phi": 1 / q,
        "shape": 1 / q,
        "psi": 1 / (q * length),
        "Kg_A": 1 / length,
        "Kg_F": 1 / (mass * length),
        "Kg_T": 1 / (mass * length**2),
        "interface_position": length,
        "points": length,
    }
    unit = mass * np.repeat([1.0, length**2], 3)
    table = body.modes.with_(total=unit * body.modes.total, effective_mass=unit * body.modes.effective_mass)
    return body.with_(modes=table, **{key: factor * getattr(body, key) for key, factor in factors.items()})
