"""Nastran: the body as a superelement with its interfaces as grid points, in OUTPUT4 or as DMIG entries."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import null_space

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import mass_matrix
from modalprep.errors import InputError
from modalprep.formats.refusals import refuse_without_modes
from modalprep.records import Record
from modalprep.vectors import skew

INDEPENDENT = 1e-6  # smallest singular value of the interface motions over the largest; K loses digits by its inverse
HELD = 1e-12  # of the largest modal stiffness: below it, a fixed-interface mode has none
RECTANGULAR, SYMMETRIC, DOUBLE = 2, 6, 2  # Nastran's codes of form and type
HIGHEST_ID = 99_999_999  # eight digits


@dataclass(frozen=True, eq=False, kw_only=True)
class Superelement(Record):
    """A body in the coordinates ``y = (u_root, u_1, ..., eta)``, ``M y'' + D y' + K y = f``.

    Attributes
    ----------
    M, D, K : (k, k)
        Mass, damping and stiffness. K has the six rigid motions as its null space.
    recovery : (6 n_if + 3 n_points, k)
        Motion of every interface of the body (ux, uy, uz, rx, ry, rz), then of every mesh node (ux, uy, uz), per
        coordinate; small motions in frame B.
    physical : tuple of int
        Interfaces of the body whose six DOFs are coordinates, the root first.
    frequency : (n_eta,)
        Hz, of the generalised coordinates: the body's modes with its physical interfaces clamped.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> superelement(uniform_beam(modes=3)).K.shape
    (9, 9)
    """

    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    recovery: np.ndarray
    physical: tuple[int, ...]
    frequency: np.ndarray


def superelement(body: FlexibleBody) -> Superelement:
    """Change a body's coordinates from (root frame, q) to (interfaces, fixed-interface modes): Craig-Bampton form.

    A small motion of an interface is ``u_k = R_k u_root + Phi_k q`` with ``R_k`` rigid and ``Phi_k`` the rows of phi
    and psi. Where the modes span all motions of the interfaces b, ``q = G (u_b - R_b u_root) + Z eta``: Z are the
    modes of K with ``Phi_b q = 0``, G the answer of least strain energy to unit interface motions, so that K does not
    couple interfaces and eta. This is an exact change of coordinates.

    An interface with fewer independent motions than six (a free one in a basis of few modes) cannot be a grid point;
    it is not in `Superelement.physical` but follows from `Superelement.recovery`.

    Raises
    ------
    InputError
        When the body has no modes, or its frame is not that of its root (`reroot`).

    References
    ----------
    Craig and Kurdila (2006), chapter 17; theory 3 and 4.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep import craig_bampton, flexible_body
    >>> model = cantilever_model(tip="fixed")
    >>> body = flexible_body(model, craig_bampton(model, modes=2, truncation=()), name="beam")
    >>> whole = superelement(body)
    >>> whole.physical, whole.frequency  # the first of the beam clamped at both ends, in the two planes
    ((0, 1), array([3.8448, 7.6810]))
    """
    refuse_without_modes(body, "for Nastran", "make it a CONM2 there")
    if not body.at_root:
        raise InputError(f"body {body.name!r} has its {body.frame}; a superelement needs reroot(body, interface) first")
    Phi = np.concatenate([body.phi, body.psi], axis=1)
    R = _rigid(body.interface_position)
    physical = _independent(body, Phi)
    G, Z, w2 = _interface_coordinates(body, Phi[physical[1:]].reshape(-1, body.n))
    q = np.concatenate([-G @ R[physical[1:]].reshape(-1, 6), G, Z], axis=1)
    frame = np.eye(6, q.shape[1])
    coordinates = np.concatenate([frame, q])
    nodes = _rigid(body.points)[:, :3].reshape(-1, 6) @ frame + body.shape.reshape(-1, body.n) @ q
    return Superelement(
        M=_symmetric(coordinates.T @ mass_matrix(body, np.zeros(body.n)) @ coordinates),
        D=_symmetric(q.T @ body.damping_matrix @ q),
        K=_uncoupled(_symmetric(q.T @ (body.K[:, None] * q)), w2),
        recovery=np.concatenate([R.reshape(-1, 6) @ frame + Phi.reshape(-1, body.n) @ q, nodes]),
        physical=tuple(physical),
        frequency=np.sqrt(w2) / (2 * np.pi),
    )


def _rigid(points: np.ndarray) -> np.ndarray:
    """Motion (k, 6, 6) of points under unit motions of the root: ``[[I, -x~], [0, I]]``."""
    R = np.tile(np.eye(6), (len(points), 1, 1))
    R[:, :3, 3:] = -skew(points)
    return R


def _uncoupled(K: np.ndarray, w2: np.ndarray) -> np.ndarray:
    """Return the stiffness with exact zeros where fixed-interface modes couple with nothing."""
    b = len(K) - len(w2)
    K[:b, b:] = K[b:, :b] = 0.0
    K[b:, b:] = np.diag(w2)
    return K


def _symmetric(A: np.ndarray) -> np.ndarray:
    return (A + A.T) / 2


def _independent(body: FlexibleBody, Phi: np.ndarray) -> list[int]:
    """Root, and each interface whose motions are independent of those before it."""
    size = np.ptp(np.concatenate([body.points, body.interface_position]), axis=0).max()
    scaled = Phi * np.repeat([1.0, size], 3)[:, None]
    chosen = [0]
    for k in range(1, len(Phi)):
        rows = scaled[[*chosen[1:], k]].reshape(-1, body.n)
        sigma = np.linalg.svd(rows, compute_uv=False)
        if len(rows) <= body.n and sigma[-1] > INDEPENDENT * sigma[0]:
            chosen.append(k)
    return chosen


def _interface_coordinates(body: FlexibleBody, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return G (n, b), Z (n, n - b) and the squared frequencies of Z, for interface rows Phi (b, n)."""
    if not len(Phi):
        return np.zeros((body.n, 0)), np.eye(body.n), body.K
    N = null_space(Phi, rcond=INDEPENDENT * 1e-3)
    w2, V = np.linalg.eigh(N.T @ (body.K[:, None] * N))
    Z = N @ V
    w2 = np.maximum(w2, 0.0)
    flexibility = np.divide(1.0, w2, out=np.zeros_like(w2), where=w2 > HELD * body.K.max())
    G = np.linalg.pinv(Phi)
    return G - Z @ (flexibility[:, None] * (Z.T @ (body.K[:, None] * G))), Z, w2


def write_output4(body: FlexibleBody, path: str | Path) -> Path:
    """Write the superelement of a body to a binary OUTPUT4 file, in full double precision.

    Matrices, in the coordinates ``y = (u_root, u_interface, ..., eta)`` of `superelement` (frame B, SI):

    - ``KAAX``, ``MAAX`` (k, k), symmetric; ``BAAX`` (k, k), viscous damping, when the body has any;
    - ``PHI`` (6 n_if + 3 n_points, k), the recovery of all interfaces and mesh nodes.

    Lost: the geometric stiffness and all terms of large rotation; the linear body about its rest position
    remains.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no modes or the folder cannot be written.

    References
    ----------
    Theory 8.2.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_output4(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.op4")
    >>> file.read_bytes()[20:28]
    b'KAAX    '
    """
    path = Path(path)
    whole = superelement(body)
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        for name, matrix in _matrices(whole).items():
            file.writelines(_output4(name, matrix, SYMMETRIC))
        file.writelines(_output4("PHI", whole.recovery, RECTANGULAR))
    return path


def _matrices(superelement: Superelement) -> dict[str, np.ndarray]:
    damping = {"BAAX": superelement.D} if np.any(superelement.D) else {}
    return {"KAAX": superelement.K, "MAAX": superelement.M, **damping}


def _output4(name: str, matrix: np.ndarray, form: int) -> Iterator[bytes]:
    """Yield Fortran records: header, each column from its first to its last nonzero, trailer."""
    rows, columns = matrix.shape
    yield _record(struct.pack("<4i8s", columns, rows, form, DOUBLE, name.ljust(8).encode()))
    for column, values in enumerate(matrix.T, start=1):
        nonzero = np.flatnonzero(values)
        if len(nonzero):
            run = values[nonzero[0] : nonzero[-1] + 1]
            yield _record(struct.pack("<3i", column, nonzero[0] + 1, 2 * len(run)) + run.astype("<f8").tobytes())
    yield _record(struct.pack("<3id", columns + 1, 1, 2, 1.0))


def _record(data: bytes) -> bytes:
    length = struct.pack("<i", len(data))
    return length + data + length


def write_dmig(body: FlexibleBody, path: str | Path, *, first_grid: int = 1, first_spoint: int = 1001) -> Path:
    """Write the superelement of a body as bulk data to include: GRID, SPOINT and DMIG entries.

    The root and each further interface of `Superelement.physical` is a GRID (numbers from `first_grid`), each
    generalised coordinate an SPOINT (from `first_spoint`). ``KAAX``, ``MAAX`` and, with damping, ``BAAX`` are
    symmetric DMIG, lower triangle, ten digits: the six frequencies of rigid motion, round-off in
    `write_output4`, are then up to 1e-5 of the highest frequency. Comments in the file say how to use it, and which
    interface is which grid.

    Lost: as in `write_output4`, and the recovery of interfaces that are no grid points and of the mesh.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no modes, the numbers overlap or are not of eight digits, or the folder cannot be written.

    References
    ----------
    Theory 8.1.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_dmig(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.bdf", first_spoint=101)
    >>> [line for line in file.read_text().splitlines() if line.startswith("SPOINT")]
    ['SPOINT       101    THRU     102']
    """
    path = Path(path)
    whole = superelement(body)
    grids = np.arange(first_grid, first_grid + len(whole.physical))
    spoints = np.arange(first_spoint, first_spoint + len(whole.frequency))
    _check_numbers(grids, spoints)
    points = [(grid, component) for grid in grids.tolist() for component in range(1, 7)] + [
        (point, 0) for point in spoints.tolist()
    ]
    points, order = sorted(points), np.array(sorted(range(len(points)), key=points.__getitem__))
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii", errors="replace") as file:
        file.writelines(_heading(body, whole, grids, spoints))
        file.writelines(
            _grid(grid, body.interface_position[k]) for grid, k in zip(grids.tolist(), whole.physical, strict=True)
        )
        file.writelines(_spoints(spoints))
        for name, matrix in _matrices(whole).items():
            file.writelines(_dmig(name, matrix[np.ix_(order, order)], points))
    return path


def _check_numbers(grids: np.ndarray, spoints: np.ndarray) -> None:
    if np.intersect1d(grids, spoints).size:
        raise InputError(
            f"grid points {grids[0]} to {grids[-1]} and scalar points {spoints[0]} to {spoints[-1]} overlap; "
            "choose another first_spoint"
        )
    numbers = np.concatenate([grids, spoints])
    if not (1 <= numbers.min() and numbers.max() <= HIGHEST_ID):
        raise InputError(f"Nastran's numbers are 1 to {HIGHEST_ID}, not {numbers.min()} to {numbers.max()}")


def _heading(body: FlexibleBody, superelement: Superelement, grids: np.ndarray, spoints: np.ndarray) -> Iterator[str]:
    """Describe the file and its use."""
    yield f"$ Body {body.name}: {body.m:.6g} kg, reduced; units m, kg, s, N, rad\n"
    for grid, k in zip(grids, superelement.physical, strict=True):
        yield f"$ GRID {grid}: interface {body.interface_name[k]}\n"
    for k in set(range(len(body.interface_name))) - set(superelement.physical):
        yield f"$ interface {body.interface_name[k]} is not a grid point: the modes do not span its six motions\n"
    for point, frequency in zip(spoints, superelement.frequency, strict=True):
        yield f"$ SPOINT {point}: mode of {frequency:.6g} Hz with these grid points held\n"
    yield "$ Case control: K2GG = KAAX, M2GG = MAAX" + (", B2GG = BAAX\n" if np.any(superelement.D) else "\n")
    yield "$ Positions and matrices are in the body's own frame: to place the body, define a CORD2R\n"
    yield "$ and give its number to each GRID here, as CP and as CD.\n"


def _grid(number: int, x: np.ndarray) -> str:
    return f"{'GRID*':8}{number:16d}{0:16d}{x[0]:16.9E}{x[1]:16.9E}\n{'*':8}{x[2]:16.9E}{0:16d}\n"


def _spoints(numbers: np.ndarray) -> Iterator[str]:
    if len(numbers):
        rest = f"{'THRU':>8}{numbers[-1]:8d}" if len(numbers) > 1 else ""
        yield f"{'SPOINT':8}{numbers[0]:8d}{rest}\n"


def _dmig(name: str, matrix: np.ndarray, points: list[tuple[int, int]]) -> Iterator[str]:
    """Yield the header and each nonzero column from the diagonal down."""
    yield f"{'DMIG':8}{name:8}{0:8d}{SYMMETRIC:8d}{DOUBLE:8d}{0:8d}{'':16}{len(matrix):8d}\n"
    for j, (number, component) in enumerate(points):
        rows = j + np.flatnonzero(matrix[j:, j])
        if len(rows):
            yield f"{'DMIG*':8}{name:16}{number:16d}{component:16d}\n"
        for i in rows:
            value = f"{matrix[i, j]:16.9E}".replace("E", "D")
            yield f"{'*':8}{points[i][0]:16d}{points[i][1]:16d}{value}\n"
