"""The modal body of matrices that another program reduced to boundary nodes and generalised coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.linalg import eigh, qr
from scipy.sparse import csr_array

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import rigid_mass_matrix
from modalprep.errors import InputError
from modalprep.fe.assembly.matrix_mass import linear_vectors
from modalprep.fe.external.model import unit_factors
from modalprep.linalg.ritz import ritz
from modalprep.linalg.unique import unique_modes
from modalprep.reduction.dampers import DIGITS, damping_fields
from modalprep.reduction.table import CONSTRAINT, DIRECTIONS, FIXED, ModeTable
from modalprep.supplied.boundary import BoundaryRows, boundary_rows, interface_nodes
from modalprep.supplied.integrals import Affine, Rigid, moments
from modalprep.supplied.matrices import checked, loose, rigid_mass, rigid_motion
from modalprep.supplied.rows import Points, Rows, drawn, recovered
from modalprep.supplied.turning import turning_stiffness

MASSLESS = 1e-10  # mass of a motion over that of its absolute terms
EXACT, REBUILT, MISSING = "known exactly", "rebuilt", "not known"  # keys of the provenance


def body_from_reduced(
    name: str,
    stiffness: Any,
    mass: Any,
    nodes: Any,
    *,
    damping: Any = None,
    structural_damping: Any = None,
    dof: Any = None,
    axes: Any = None,
    names: Sequence[str] | None = None,
    interfaces: Mapping[str, Sequence[str]] | None = None,
    root: str | None = None,
    length_unit: str = "m",
    mass_unit: str | None = None,
    points: Points | None = None,
    recovery: Mapping[str, Rows] | None = None,
    provenance: Mapping[str, str] | None = None,
) -> FlexibleBody:
    """Return the modal body of a free (unsupported) structure that another program has reduced.

    The rows of the matrices are displacements and rotations of boundary nodes, and generalised coordinates (modes of
    Craig and Bampton, free modes, residual vectors, scalar points). Nothing is truncated: the body has the modes of all
    coordinates with its root clamped. Rows with neither stiffness nor mass are left out.

    Mass, first moment, inertia, stiffness, modal mass, and momentum and moment of momentum of the modes (S and the
    antisymmetric part of H) are exact. The symmetric part of H and P are rebuilt (integrals.py), of the geometric
    stiffness that of the body's mean rotation (turning.py). The ``provenance`` says so.

    Parameters
    ----------
    name : str
    stiffness, mass : (n, n) dense or sparse
        Symmetric, positive semidefinite.
    nodes : (k, 3)
        Positions of the boundary nodes in basic axes.
    damping, structural_damping : (n, n), optional
        Viscous damping, and the imaginary part of the stiffness. Of the latter the diagonal in the modes is kept.
    dof : (k, 6) int, optional
        Row of ux, uy, uz, rx, ry, rz of each node, -1 where it has none; rows of no node are generalised coordinates.
        Default six rows for each node in turn, then the generalised coordinates.
    axes : (k, 3, 3), optional
        Columns are the axes of a node's components in basic axes; default basic axes.
    names : sequence of str, optional
        Of the nodes, ``node_1`` and so on by default.
    interfaces : {name: names of nodes}, optional
        An interface on several nodes has their mean motion. Default: each node is one; where no node has rotations, the
        mean motion of all is the root, ``boundary``.
    root : str, optional
        The interface at which the body frame sits; default the first (that has six components).
    length_unit, mass_unit : str
        Of the matrices and positions, with seconds; ``mass_unit`` may be left out with metres (kg).
    points : Points, optional
        Further points with their motion, for pictures (rows.py).
    recovery : {name: Rows}, optional
        The supplier's recovery matrices (rows.py), for `FlexibleBody.recovered`.
    provenance : {str: str}, optional
        What else the body shall say of its source.

    Returns
    -------
    FlexibleBody
        In SI units, its frame at the root and parallel to basic axes.

    Raises
    ------
    InputError
        When sizes do not match, or the matrices are not those of a free structure with these nodes.

    References
    ----------
    R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313; theory 10.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.reduction.projected import body_matrices
    >>> beam = uniform_beam(modes=3)
    >>> M, K = body_matrices(beam)  # six rows of the root, three modes
    >>> body = body_from_reduced("beam", np.diag(K), M, [[0.0, 0.0, 0.0]], names=["root"])
    >>> bool(np.allclose(body.frequency, beam.frequency)), bool(np.allclose(body.E0, beam.E0))
    (True, True)
    """
    length, weight = unit_factors(length_unit, mass_unit)
    sizes = np.shape(stiffness)
    if len(sizes) != 2 or sizes[0] != sizes[1]:
        raise InputError(f"the stiffness matrix has shape {sizes}; it must be square, one row per coordinate")
    ends = boundary_rows(nodes, sizes[0], length, dof=dof, axes=axes, names=names)
    K = checked(stiffness, "stiffness", ends.label)
    M = checked(mass, "mass", ends.label, len(K))
    dampers = {"viscous": damping, "structural": structural_damping}
    C = {key: checked(A, f"{key} damping", ends.label, len(K)) for key, A in dampers.items() if A is not None}
    scale = np.ones(len(K))
    scale[ends.dof[:, 3:][ends.dof[:, 3:] >= 0]] = length
    K, M, *dampings = (A * scale * scale[:, None] * weight for A in (K, M, *C.values()))
    C = dict(zip(C, dampings, strict=True))
    body, Phi = _reduced(name, K, M, C, ends, interface_nodes(ends, interfaces, root))
    motion = Phi * scale[:, None] / length
    position, shape = drawn(points, motion, length)
    origin = ends.position[0] - body.points[0]
    return body.with_(
        points=np.concatenate([body.points, position - origin]),
        shape=np.concatenate([body.shape, shape]),
        recovery={key: recovered(key, rows, motion) for key, rows in (recovery or {}).items()},
        provenance={**body.provenance, **(provenance or {})},
    )


def _reduced(name: str, K, M, C, ends: BoundaryRows, groups: dict[str, list[int]]):
    """Return the body, and the motion (rows, n) of the rows in SI units per modal coordinate."""
    at, G = zip(*(ends.group(nodes) for nodes in groups.values()), strict=True)
    origin = at[0]
    place = np.array(at) - at[0]
    R = rigid_motion(K, ends.motion(origin), ends.generalised, ends.label)
    _refuse_loose_root(next(iter(groups)), G[0] @ R, ends)
    rigid = rigid_mass(M, R, ends.size)
    w2, Phi = _modes(K, M, G[0], ends)
    S, about = np.split(R.T @ M @ Phi, 2)
    H, P, turn = moments(rigid, S, about, _strain(M, ends, R, rigid) @ Phi)
    moved = np.array([g @ Phi for g in G])
    moved[0] = 0.0
    phi = moved[:, :3]
    psi = moved[:, 3:]
    Kg = turning_stiffness(rigid, turn, S, H, place, phi, psi)
    total = np.diag(rigid_mass_matrix(*rigid))
    body = FlexibleBody(
        name=name,
        m=rigid.m,
        s0=rigid.s0,
        E0=rigid.E0,
        S=S,
        H=H,
        P=P,
        **Kg._asdict(),
        phi=phi,
        psi=psi,
        K=w2,
        **_damping(C, Phi, w2),
        frequency=np.sqrt(w2) / (2 * np.pi),
        interface_name=tuple(groups),
        interface_position=place,
        points=ends.position - origin,
        cells={},
        shape=_translations(ends, Phi),
        modes=_table(K, M, R, ends, groups, total),
        provenance=_provenance(ends),
    )
    return body, Phi


def _refuse_loose_root(name: str, moved: np.ndarray, ends: BoundaryRows) -> None:
    scale = np.repeat([1.0, ends.size], 3)
    if np.abs(moved * scale[:, None] / scale - np.eye(6)).max() > 1e-6:
        raise InputError(
            f"root interface {name!r} does not determine the position and the rotation of the body: take a node with "
            "six components, or at least three nodes that are not in one line"
        )


def _modes(K: np.ndarray, M: np.ndarray, G: np.ndarray, ends: BoundaryRows) -> tuple[np.ndarray, np.ndarray]:
    """Return ``w^2 (n,)`` and M-orthonormal motions (rows, n) of all coordinates with the root (G u = 0) clamped."""
    used = (np.diag(K) > 0) | (np.diag(M) > 0)
    scale = np.repeat([1.0, ends.size], 3)
    _, _, order = qr(G * scale[:, None], pivoting=True, mode="economic")
    held = order[:6]
    kept = np.setdiff1d(np.flatnonzero(used), order[:6])
    N = np.zeros((len(K), len(kept)))
    N[kept, np.arange(len(kept))] = 1.0
    N[held] = -np.linalg.solve(G[:, held], G[:, kept])
    k = N.T @ K @ N
    m = csr_array(N.T @ M @ N)
    still = loose(k)
    mass, V = eigh(still.T @ (m @ still)) if still.shape[1] else (np.zeros(0), np.zeros((0, 0)))
    moved = np.abs(still @ V)
    heavy = mass > MASSLESS * np.einsum("in,ij,jn->n", moved, np.abs(m.toarray()), moved, optimize=True)
    still = still @ (V[:, heavy] / np.sqrt(mass[heavy]))
    w2, X = ritz(_strained(k), csr_array(k), m, still)
    return w2, unique_modes(w2, N @ X, K)


def _strained(k: np.ndarray) -> np.ndarray:
    """Return a basis (n, r) of the motions with strain, the unit vectors where every motion has some."""
    still = loose(k)
    if not still.shape[1]:
        return np.eye(len(k))
    return np.linalg.svd(still.T)[2][still.shape[1] :].T


def _strain(M: np.ndarray, ends: BoundaryRows, R: np.ndarray, rigid: Rigid) -> np.ndarray:
    """Return an estimate (3, 3, rows) of the homogeneous strain of each row's displacement field, in basic axes.

    That of boundary displacements is the one of ``u = n(x) u_i`` with the moments of n that M has; that of rotations
    and of generalised coordinates is taken to be none.
    """
    basic = np.eye(len(M))
    table = np.where(np.all(ends.dof[:, :3] >= 0, axis=1)[:, None], ends.dof, -1)
    table[:, 3:] = -1
    for rows, Q in ((dof[:3], Q) for dof, Q in zip(table, ends.axes, strict=True) if dof[0] >= 0):
        basic[np.ix_(rows, rows)] = Q.T
    g, h = linear_vectors(basic.T @ M @ basic, table, basic.T @ R)
    strain = np.zeros((3, 3, len(M)))
    moved = table[table >= 0]
    strain[:, :, moved] = Affine(rigid).strain(g[moved].T, np.moveaxis(h[moved], 0, -1))
    return strain @ basic.T


def _damping(C: dict[str, np.ndarray], Phi: np.ndarray, w2: np.ndarray) -> dict[str, Any]:
    """Return the modal damping: structural damping of each mode as the viscous one of the same loss at resonance."""
    none = np.zeros(len(w2))
    own, viscous = none.copy(), np.zeros((len(w2), len(w2)))
    if "structural" in C:
        loss = np.einsum("in,ij,jn->n", Phi, C["structural"], Phi)
        own = np.maximum(np.divide(loss, np.sqrt(w2), out=none, where=w2 > 0), 0.0)
    if "viscous" in C:
        viscous = Phi.T @ C["viscous"] @ Phi
        np.fill_diagonal(viscous, np.maximum(np.diag(viscous), 0.0))
    return damping_fields(own, viscous, DIGITS)


def _translations(ends: BoundaryRows, Phi: np.ndarray) -> np.ndarray:
    """Return the displacement (k, 3, n) of the nodes in basic axes, 0 along missing components."""
    shape = Phi[ends.dof[:, :3]]
    shape[ends.dof[:, :3] < 0] = 0.0
    return np.einsum("kab,kbn->kan", ends.axes, shape)


def _table(K, M, R, ends: BoundaryRows, groups: dict[str, list[int]], total: np.ndarray) -> ModeTable:
    """List the modes with the whole boundary held, with effective masses, and the boundary's unit displacements."""
    inner = ends.generalised
    k, m = (A[np.ix_(inner, inner)] for A in (K, M))
    inner, k, m = _with_mass(inner, k, m)
    w2, Y = eigh(k, m) if len(inner) else (np.zeros(0), np.zeros((0, 0)))
    mass = ((R.T @ M)[:, inner] @ Y).T ** 2
    frequency = np.sqrt(np.maximum(w2, 0.0)) / (2 * np.pi)
    table = ModeTable.empty(total).with_rows(FIXED, ["generalised coordinates"] * len(inner), frequency, mass)
    rows = [f"unit displacement {d} of interface {name}" for name in list(groups)[1:] for d in DIRECTIONS]
    return table.with_rows(CONSTRAINT, rows)


def _with_mass(inner: np.ndarray, k: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    heavy = np.diag(m) > 0
    return inner[heavy], k[np.ix_(heavy, heavy)], m[np.ix_(heavy, heavy)]


def _provenance(ends: BoundaryRows) -> dict[str, str]:
    missing = "stress stiffness, and the mesh: pictures show the boundary nodes alone"
    partial = [name for name, dof in zip(ends.names, ends.dof, strict=True) if np.any(dof < 0)]
    if partial:
        missing += f"; components of {', '.join(partial[:8])} that the matrices do not have, which follow the root"
    return {
        EXACT: "mass, first moment and inertia, frequencies and stiffness, and the momentum of the modes (S and the "
        "antisymmetric part of H)",
        REBUILT: "the symmetric part of H, P, and the geometric stiffness of the body's mean rotation",
        MISSING: missing,
    }
