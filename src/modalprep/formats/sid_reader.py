"""Reading SID_FEM: the modal body that a file of FEMBS, of another program or of modalprep describes.

The file holds contractions of the modal integrals, which determine them to first order: H follows from ``J.M1`` (its
symmetric part) and ``Cr.M0`` (its antisymmetric part), the sum ``P + Kg_W`` from ``Cr.M1`` and ``Oe.M1`` in the same
way, so that the layouts of Gr and Ge, which differ between programs, are not needed (theory 4).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, eigh

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.frames import reroot
from modalprep.body.mass import affine_part, cross_moment, rigid_mass_matrix
from modalprep.body.mass_tensor import nearest_mass_tensor
from modalprep.errors import InputError
from modalprep.formats.contractions import centrifugal, from_centrifugal, from_moment, inertia
from modalprep.formats.modalfile import refuse_impossible
from modalprep.formats.sid import Taylor
from modalprep.formats.sid_blocks import Contents, read_contents
from modalprep.reduction.table import ModeTable

AGREES = 1e-6  # relative: two blocks that hold the same number
ROUND_OFF = 1e-9
NOTES = "not in the SID_FEM file"  # key of the provenance
FAULTS = (ArithmeticError, LookupError, ValueError, TypeError, OSError, RecursionError, LinAlgError)


class Moments(NamedTuple):
    """First-order terms of a file in its own coordinates: the arrays of `FlexibleBody`, with ``F = P + Kg_W``."""

    E0: np.ndarray
    S: np.ndarray
    H: np.ndarray
    F: np.ndarray
    Kg_A: np.ndarray
    planar: bool


def read_sid(path: str | Path, *, root: str | None = None) -> FlexibleBody:
    """Read the modal body of a SID_FEM file; its numbers are taken as SI units.

    Every dialect of `modalprep.formats.sid` is read. The coordinates become the modes of ``Ke`` and ``Me`` where these
    are not diagonal. A node without displacement at the origin of the file's frame becomes the root. What the file
    does not hold, and how it was rebuilt, is said in the body's ``provenance``.

    Parameters
    ----------
    root : str or None
        Interface to which the frame is moved, as `reroot` does: a body in mean axes, of which no node is at rest, needs
        it for any other joint than a free one.

    Returns
    -------
    FlexibleBody
        The nodes are its interfaces, with the names that modalprep wrote, or ``node_1`` for label 1.

    Raises
    ------
    InputError
        When the file is missing, damaged, truncated, contradicts itself, or describes what no body is.

    References
    ----------
    O. Wallrapp, Standardization of flexible body modeling in multibody system codes, part I: definition of standard
    input data, Mech. Struct. Mach. 22 (1994) 283.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.formats.sid import write_sid
    >>> body = read_sid(write_sid(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.sid_fem"))
    >>> body, body.interface_name
    (FlexibleBody('beam', m=12 kg, 2 modes, 0.6044..1.209 Hz), ('root', 'tip'))
    """
    path = Path(path)
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused
            body = _body(read_contents(path), path)
            refuse_impossible(body, vouched=True)
        return body if root is None else reroot(body, root)
    except InputError as error:
        said = str(error)
        raise InputError(said if str(path) in said else f"SID_FEM file {path}: {said}") from None
    except FAULTS as error:
        raise InputError(f"SID_FEM file {path} is damaged or no SID_FEM file ({error})") from None


def notes_of(body: FlexibleBody) -> list[str]:
    """Return what the file of a body did not hold, and how it was rebuilt.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> notes_of(uniform_beam(modes=2))  # of no SID_FEM file
    []
    """
    said = body.provenance[NOTES].split("; ") if NOTES in body.provenance else []
    free = "a node at rest at the origin: only a free joint can carry the body, for others choose a node as its root"
    return said + ([] if body.at_root or not said else [free])


def _moments(file: Contents) -> Moments:
    n, blocks, m = len(file.body["Me"].M0), file.body, file.mass
    s0, S = blocks["mdCM"].M0[:, 0], blocks["Ct"].M0.T
    J, (dJ, of_J) = _tensor(blocks["J"].M0), _even_part(blocks, n)
    Cr, field, turn = blocks["Cr"], _first(blocks["Oe"], n), _first(blocks["Cr"], n)
    planar = not (np.any(J[:2]) or np.any(Cr.M0[:, :2]) or np.any(turn[:, :, :2]) or np.any(s0[2:]))
    F = from_moment(turn.transpose(2, 0, 1)) + from_centrifugal(field.transpose(2, 0, 1))
    H = from_moment(Cr.M0.T) + dJ
    E0 = np.trace(J) / 2 * np.eye(3) - J
    _refuse_contradiction("Ct.M0", S, "mdCM.M1", _first(blocks["mdCM"], n)[:, :, 0])
    if of_J:
        _refuse_contradiction("J.M1", centrifugal(H), "Oe.M0", blocks["Oe"].M0.T)
    if planar:
        E0, H, F = _in_plane(m, s0, E0), _flat(H, S, s0 / m), _without_normal(F)
    return Moments(E0, S, H, F, _even(_first(blocks["Ct"], n).transpose(2, 0, 1)), planar)


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


def _even(X: np.ndarray) -> np.ndarray:
    """Return the part that is symmetric in the modes, the last two axes."""
    return (X + X.swapaxes(-1, -2)) / 2


def _in_plane(m: float, s0: np.ndarray, E0: np.ndarray) -> np.ndarray:
    """Return E0 of a file with the moment of inertia about z alone: equal in x and y about the centre of mass."""
    about = E0[0, 0] + E0[1, 1] - s0 @ s0 / m
    return np.diag([about, about, 0.0]) / 2 + np.outer(s0, s0) / m


def _flat(H: np.ndarray, S: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the least H about the centre with the moment and the trace of a motion in the plane."""
    own = np.einsum("ai,b->abi", S, centre)
    X = H - own
    trace, turn = (X[0, 0] + X[1, 1]) / 2, (X[1, 0] - X[0, 1]) / 2
    zero = np.zeros_like(trace)
    return own + np.array([[trace, -turn, zero], [turn, trace, zero], [zero, zero, zero]])


def _without_normal(F: np.ndarray) -> np.ndarray:
    F = F.copy()
    F[2, 2] = 0.0
    return F


def _modes(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return M-orthonormal modes (n, n): the unit matrix where M is, and K diagonal."""
    M, K = _even(M), _even(K)
    size = np.sqrt(np.abs(np.outer(np.diag(K), np.diag(K))))
    if np.abs(M - np.eye(len(M))).max() < ROUND_OFF and np.all(np.abs(K - np.diag(np.diag(K))) <= ROUND_OFF * size):
        return np.eye(len(M))
    try:
        return eigh(K, M)[1]
    except LinAlgError:
        raise InputError("Me is not positive definite, so that its modes have no mass") from None


def _body(file: Contents, path: Path) -> FlexibleBody:
    found, blocks, n = _moments(file), file.body, len(file.body["Me"].M0)
    V = _modes(blocks["Me"].M0, blocks["Ke"].M0)
    nodes = list(file.nodes.values())
    position = np.array([node["origin"].M0[:, 0] for node in nodes])
    forms = {
        "Kg_A": found.Kg_A,
        "Kg_F": _even(-np.array([_first(node["phi"], n).swapaxes(1, 2) for node in nodes])),
        "Kg_T": _even(-np.array([_first(node["psi"], n).swapaxes(1, 2) for node in nodes])),
        "F": found.F,
    }
    forms = {key: np.einsum("ix,...ij,jy->...xy", V, form, V) for key, form in forms.items()}
    vectors = {"S": found.S, "H": found.H, "phi": [x["phi"].M0 for x in nodes], "psi": [x["psi"].M0 for x in nodes]}
    vectors = {key: np.asarray(array) @ V for key, array in vectors.items()}
    K, D = np.diag(V.T @ blocks["Ke"].M0 @ V).copy(), np.diag(V.T @ blocks["De"].M0 @ V).copy()
    K[np.abs(K) < ROUND_OFF * np.abs(K).max()] = 0.0
    if K.min() < 0:
        raise InputError(f"Ke has the negative eigenvalue {K.min():.3g}")
    field = forms.pop("F")
    total = np.diag(rigid_mass_matrix(file.mass, blocks["mdCM"].M0[:, 0], found.E0))
    body = FlexibleBody(
        name=file.name, m=file.mass, s0=blocks["mdCM"].M0[:, 0], E0=found.E0, K=K, D=D, **vectors, **forms,
        P=np.zeros((3, 3, n, n)), Kg_W=np.zeros((3, 3, n, n)), frequency=np.sqrt(K) / (2 * np.pi),
        interface_name=tuple(file.nodes), interface_position=position, points=position, cells={},
        shape=vectors["phi"], modes=ModeTable.empty(total),
    )  # fmt: skip
    _refuse_not_finite(body, field)
    body = _with_mass_tensor(_rooted(body), field)
    return _with_table(body, file, _notes(body, file, found.planar, V))


def _refuse_not_finite(body: FlexibleBody, field: np.ndarray) -> None:
    names = ("S", "H", "Kg_A", "Kg_F", "Kg_T", "phi", "psi", "K", "D", "E0")
    if not all(np.all(np.isfinite(array)) for array in (field, *(getattr(body, name) for name in names))):
        raise InputError("its numbers are too large")


def _rooted(body: FlexibleBody) -> FlexibleBody:
    """Put the node that is at rest at the origin first, with its round-off set to zero."""
    size = [max(np.abs(x).max(), np.finfo(float).tiny) for x in (body.interface_position, body.phi, body.psi)]
    arrays = body.interface_position, body.phi, body.psi
    for k in range(len(body.interface_name)):
        if all(np.abs(x[k]).max() <= ROUND_OFF * s for x, s in zip(arrays, size, strict=True)):
            order = [k, *(j for j in range(len(body.interface_name)) if j != k)]
            moved = {key: getattr(body, key)[order] for key in ("phi", "psi", "Kg_F", "Kg_T", "interface_position")}
            for array in moved.values():
                array[0] = 0.0
            return body.with_(**moved, interface_name=tuple(body.interface_name[j] for j in order))
    return body.with_(provenance={"origin": "origin of the SID_FEM file"})


def _with_mass_tensor(body: FlexibleBody, field: np.ndarray) -> FlexibleBody:
    """Divide the sum of P and Kg_W; a file without it leaves both zero."""
    if not np.any(field):
        return body
    P = nearest_mass_tensor(field, affine_part(body).first, body.modal_mass)
    Kg = _even(field - P)
    none = np.abs(Kg).max() <= ROUND_OFF * np.abs(field).max()
    return body.with_(P=P, Kg_W=np.zeros_like(Kg) if none else Kg)


def _notes(body: FlexibleBody, file: Contents, planar: bool, V: np.ndarray) -> list[str]:
    said = ["mesh and shapes between the nodes: pictures show the nodes alone", "units: the numbers are taken as SI"]
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
    if not np.array_equal(V, np.eye(body.n)):
        said.append("modes that are orthogonal: the coordinates are those of Me and Ke, and of De the diagonal is kept")
    if np.any(file.body["ksigma"].M0):
        said.append("a state without stress: its prestress load ksigma is dropped")
    return said


def _with_table(body: FlexibleBody, file: Contents, notes: list[str]) -> FlexibleBody:
    reasons = [*file.modes, *("mode of the file" for _ in range(body.n))][: body.n]
    momentum = np.concatenate([body.S, cross_moment(body.H)]) ** 2
    kind = "fixed-interface" if body.at_root else "free-interface"
    table = body.modes.with_rows(kind, reasons, body.frequency, momentum.T if body.at_root else np.nan)
    return body.with_(modes=table, provenance=body.provenance | {"format": "SID_FEM", NOTES: "; ".join(notes)})
