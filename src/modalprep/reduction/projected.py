"""A component's part of system modes: mass-weighted singular directions as its new modal basis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.linalg.ritz import ritz
from modalprep.linalg.unique import unique_modes
from modalprep.records import Record
from modalprep.reduction.dampers import damping_in_basis
from modalprep.reduction.dropped import projected_recovery
from modalprep.reduction.table import PROJECTED, AnyBody, ModalBody, ModeTable
from modalprep.suggest import refuse_unknown
from modalprep.vectors import skew

NEW = 1e-12  # of the mass of a vector: below it the vector depends on earlier ones; round-off is 1e-16
STRAIN = 1e-15  # of the absolute terms of a strain energy: round-off


@dataclass(frozen=True, eq=False, kw_only=True)
class ProjectedBasis(Record):
    """Basis of a component for given system modes.

    Attributes
    ----------
    basis : (n_dof, r)
        M-orthonormal, ``basis^T K basis = diag((2 pi frequency)^2)``.
    frequency : (r,)
        Hz; exactly 0 for the given rigid motions, which come first.
    directions : (n_dof, k)
        M-orthonormal left singular directions, kept or dropped, the strongest first.
    singular : (k,)
        Their singular values: kg^(1/2) where the system modes are displacements of unit modal mass.
    contribution : (k, s)
        Fraction of the component's modal mass in each system mode in each direction; a column sums to the part that
        the `rigid` and `keep` vectors do not represent.
    captured : (s,)
        Fraction of the component's modal mass in each system mode that the basis represents; 1 if reproduced.
    kept : (k,) bool
    reason : tuple of str, length k
        Why a direction was kept or dropped, and which system mode needs it most.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 7; theory 3.7.
    """

    basis: np.ndarray
    frequency: np.ndarray
    directions: np.ndarray
    singular: np.ndarray
    contribution: np.ndarray
    captured: np.ndarray
    kept: np.ndarray
    reason: tuple[str, ...]

    def __repr__(self) -> str:
        """Sizes and the least captured mode."""
        least = f"; captures at least {100 * self.captured.min():.6g}% of a mode" if len(self.captured) else ""
        return f"ProjectedBasis({len(self.frequency)} vectors, {self.kept.sum()} of {len(self.kept)} directions{least})"


def projected_basis(
    shapes: np.ndarray,
    K: csr_array,
    M: csr_array,
    *,
    tolerance: float = 1e-6,
    fraction: float | None = None,
    rigid: np.ndarray | None = None,
    keep: np.ndarray | None = None,
) -> ProjectedBasis:
    """Reduce system modes, restricted to a component, to a basis of the component.

    With ``M = L L^T`` the singular value decomposition ``L^T X = U diag(sigma) V^T`` orders the directions
    ``L^-T U`` by the mass they move in all system modes together: ``sigma_k^2`` of ``trace X^T M X``. L is not formed:
    X = Q R is orthonormalised by Gram-Schmidt in the inner product of M and R decomposed. What is kept is diagonalised
    with K and M (`linalg.ritz`).

    Parameters
    ----------
    shapes : (n_dof, s)
        System modes at the component's DOFs, or in its modal coordinates, each scaled by its weight.
    K, M : (n_dof, n_dof) csr or array
        Of the component; shapes without mass are ignored.
    tolerance : float
        Keep the directions with ``sigma_k > tolerance sigma_1``.
    fraction : float or None
        Instead of the tolerance: keep the fewest directions that hold this fraction (0..1) of ``sum sigma^2``.
    rigid : (n_dof, r) or None
        All motions of the component without strain; needed where K is singular, always kept.
    keep : (n_dof, c) or None
        Shapes always kept, such as `interface_shapes`: a coarse tolerance drops little mass but much flexibility.

    Returns
    -------
    ProjectedBasis
        The basis (n_dof, r), orthonormal in M, and the singular values.

    Raises
    ------
    InputError
        When sizes differ, the tolerance or fraction is out of range, or the shapes move without strain.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 7 (singular value decomposition of projected
    system modes); theory 3.7.

    Examples
    --------
    >>> shapes = np.array([[1.0, 1.0, 2.0], [0.0, 1e-9, 0.0]])
    >>> found = projected_basis(shapes, np.diag([4.0, 9.0]), np.eye(2))
    >>> found.kept, found.reason[1]
    (array([ True, False]), 'singular value 3.7e-10 of the largest, not > 1e-06; holds 1.4e-19 of all; most in mode 2')
    """
    X = np.asarray(shapes, dtype=float)
    K = csr_array(K)
    M = csr_array(M)
    none = np.zeros((len(X), 0))
    R, C = (none if v is None else np.asarray(v, dtype=float) for v in (rigid, keep))
    _refuse(X, K, M, R, C, tolerance, fraction)
    R = _independent(R, none, M)
    C = _independent(C, R, M)
    directions, singular, V = _directions(X, np.hstack([R, C]), M)
    kept, reason = _judged(singular, V, tolerance, fraction)
    w2, basis = _diagonal(np.hstack([C, directions[:, kept]]), R, K, M)
    mass = np.einsum("ij,ij->j", X, M @ X)
    mass = np.where(mass > 0, mass, 1.0)
    return ProjectedBasis(
        basis=basis,
        frequency=np.sqrt(w2) / (2 * np.pi),
        directions=directions,
        singular=singular,
        contribution=(singular[:, None] * V.T) ** 2 / mass,
        captured=np.sum((basis.T @ (M @ X)) ** 2, axis=0) / mass,
        kept=kept,
        reason=reason,
    )


def reduced_body(body: AnyBody, projected: ProjectedBasis) -> AnyBody:
    """Return a FlexibleBody in the coordinates p of ``q = basis p``: with every array of a modal body.

    Its damping is the diagonal of ``basis^T diag(D) basis``, the whole ``basis^T C basis`` where dampers couple modes.
    Its table lists the singular directions with their Rayleigh quotients as frequencies and their effective masses
    about the root.

    Returns
    -------
    ModalBody
        Of the type of `body`, with the modes of the basis.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 7; theory 3.7.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=4)
    >>> found = projected_basis(np.eye(4)[:, :2], np.diag(body.K), np.eye(4))
    >>> smaller = reduced_body(body, found)
    >>> smaller.n, bool(np.allclose(smaller.K, body.K[:2]))
    (2, True)
    """
    Y = projected.basis
    if len(Y) != body.n:
        raise InputError(f"the basis has {len(Y)} rows but the body {body.n} modal coordinates; project its own modes")
    names = ("S", "H", "phi", "psi", "shape")
    changed = {name: getattr(body, name) @ Y for name in names}
    changed |= {name: Y.T @ getattr(body, name) @ Y for name in ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T")}
    if body.T is not None:
        changed["T"] = np.einsum("ijk,ix,jy,kz->xyz", body.T, Y, Y, Y, optimize=True)
    if body.stations is not None:
        changed["stations"] = body.stations.in_basis(Y)
    w = 2 * np.pi * projected.frequency
    changed["stress"] = {name: at.in_basis(Y) for name, at in body.stress.items()}
    changed["recovery"] = projected_recovery(body, Y, w)
    return body.with_(
        **changed, K=w**2, **damping_in_basis(body, Y), frequency=projected.frequency, modes=_table(body, projected)
    )


def interface_shapes(body: ModalBody, *names: str) -> np.ndarray:
    """Return the static responses ``(n, 6 k)`` of a body to unit forces and moments on the named interfaces.

    They span the body's constraint modes: with them in `keep`, interface motion stays complete (Craig & Kurdila,
    chapter 17: attachment modes).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> interface_shapes(uniform_beam(modes=4), "tip").shape
    (4, 6)
    """
    if not np.all(body.K > 0):
        raise InputError(
            "the body moves without strain when its root is clamped, so that a load has no static response"
        )
    rows = [np.zeros((0, body.n))]
    for name in names:
        refuse_unknown(name, body.interface_name, f"body {body.name!r}: interface")
        rows.append(interface_motion(body, body.interface_name.index(name))[:, 6:])
    return np.vstack(rows).T / body.K[:, None]


def _refuse(X, K, M, R, C, tolerance: float, fraction: float | None) -> None:
    n = K.shape[0]
    if not (M.shape == K.shape == (n, n) and {len(X), len(R), len(C)} == {n}):
        sizes = f"K {K.shape}, M {M.shape}, shapes {X.shape}, rigid {R.shape}, keep {C.shape}"
        raise InputError(f"the component's matrices and shapes differ in size: {sizes}")
    if not 0 <= tolerance < 1:
        raise InputError(f"tolerance = {tolerance:g} must be at least 0 and below 1, a fraction of the largest")
    if fraction is not None and not 0 < fraction <= 1:
        raise InputError(f"fraction = {fraction:g} must be above 0 and at most 1")


def _independent(X: np.ndarray, given: np.ndarray, M: csr_array) -> np.ndarray:
    """Return an M-orthonormal basis of X beyond `given` (Gram-Schmidt, twice), without dependent vectors."""
    Q = np.hstack([given, X])
    first = given.shape[1]
    count = first
    for x in X.T:
        size = np.sqrt(x @ (M @ x))
        rest = x
        for _ in range(2):
            rest = rest - Q[:, :count] @ (Q[:, :count].T @ (M @ rest))
        left = np.sqrt(max(rest @ (M @ rest), 0.0))
        if left > NEW * size:
            Q[:, count] = rest / left
            count += 1
    return Q[:, first:count]


def _directions(X: np.ndarray, given: np.ndarray, M: csr_array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M-orthonormal directions (n, k) of X beyond `given`, singular values (k,) and right vectors (s, k)."""
    Q = _independent(X, given, M)
    U, sigma, Vt = np.linalg.svd(Q.T @ (M @ X), full_matrices=False)
    return Q @ U, sigma, Vt.T


def _judged(sigma: np.ndarray, V: np.ndarray, tolerance: float, fraction: float | None) -> tuple[np.ndarray, tuple]:
    """Return which directions to keep, and the reason for each."""
    part = sigma**2 / max(np.sum(sigma**2), np.finfo(float).tiny)
    if fraction is None:
        relative = sigma / sigma.max(initial=np.finfo(float).tiny)
        kept = relative > tolerance
        words = [
            f"singular value {v:.2g} of the largest, {'' if k else 'not '}> {tolerance:g}"
            for v, k in zip(relative, kept, strict=True)
        ]
    else:
        before = np.concatenate([[0.0], np.cumsum(part)])[: len(part)]
        kept = before < fraction * (1 - 4 * np.finfo(float).eps)
        words = [
            f"the stronger ones have {v:.6g} of all, {'less than' if k else 'already'} {fraction:g}"
            for v, k in zip(before, kept, strict=True)
        ]
    most = np.argmax(np.abs(V), axis=0) if V.size else []
    reasons = zip(words, part, most, strict=True)
    return kept, tuple(f"{text}; holds {p:.2g} of all; most in mode {m + 1}" for text, p, m in reasons)


def _diagonal(Q: np.ndarray, R: np.ndarray, K: csr_array, M: csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Rayleigh-Ritz on M-orthonormal vectors Q beside the rigid motions R."""
    w2, Y = eigh(Q.T @ (K @ Q)) if Q.shape[1] else (np.zeros(0), np.zeros((0, 0)))
    W = Q @ Y  # nearly in order of stiffness, so that ritz keeps the accuracy of the soft ones
    terms = np.einsum("ij,ij->j", np.abs(W), abs(K) @ np.abs(W))
    if np.any(np.einsum("ij,ij->j", W, K @ W) <= STRAIN * (terms + 10 * w2.max(initial=0.0))):
        raise InputError("the shapes hold motions of the component without strain; give all of those as 'rigid'")
    w2, X = ritz(W, K, M, R)
    return w2, unique_modes(w2, X, K)


def _table(body: ModalBody, projected: ProjectedBasis) -> ModeTable:
    d = projected.directions
    cross = body_matrices(body)[0][:6, 6:] @ d
    w2 = np.einsum("ij,i,ij->j", d, body.K, d)
    return ModeTable(
        kind=(PROJECTED,) * len(projected.kept),
        frequency=np.sqrt(w2) / (2 * np.pi),
        effective_mass=cross.T**2,
        total=body.modes.total,
        kept=projected.kept,
        reason=projected.reason,
    )


def body_matrices(body: ModalBody) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix ``(6 + n, 6 + n)`` and stiffness ``(6 + n,)`` of a body that is free and at rest.

    ``[[m, -s0~, S], [s0~, J, C], [S^T, C^T, M_ff]]`` with ``C_c = eps_cab H_ba`` and ``J = tr(E0) - E0``: theory
    4. It is the Craig-Bampton form of the body, its root the boundary.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> M, K = body_matrices(uniform_beam(modes=2))
    >>> M.diagonal()[:3], K[:6]
    (array([12., 12., 12.]), array([0., 0., 0., 0., 0., 0.]))
    """
    s = skew(body.s0)
    J = np.trace(body.E0) * np.eye(3) - body.E0
    H = body.H
    C = np.array([H[2, 1] - H[1, 2], H[0, 2] - H[2, 0], H[1, 0] - H[0, 1]])
    rows = [body.m * np.eye(3), -s, body.S], [s, J, C], [body.S.T, C.T, body.modal_mass]
    return np.block([list(row) for row in rows]), np.concatenate([np.zeros(6), body.K])


def interface_motion(body: ModalBody, k: int) -> np.ndarray:
    """Return the translation and rotation ``(6, 6 + n)`` of interface k per coordinate of the body, in its axes."""
    rigid = np.block([[np.eye(3), -skew(body.interface_position[k])], [np.zeros((3, 3)), np.eye(3)]])
    return np.hstack([rigid, np.vstack([body.phi[k], body.psi[k]])])
