"""A reduced basis in the coordinates of its body: root clamped, M-orthonormal, with the unit loads of its prestress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, cg

from modalprep.errors import AccuracyError, InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import eigh, inner, product
from modalprep.linalg.bordered import Bordered
from modalprep.linalg.ritz import ritz
from modalprep.linalg.sparse import times
from modalprep.linalg.unique import made_unique
from modalprep.records import Record
from modalprep.reduction.clamped import Clamped
from modalprep.reduction.derivatives import LeftOut
from modalprep.reduction.table import ModeTable
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import with_warnings

DEPENDENT = 1e-14  # share of mass of a combination of unit vectors: round-off
EIGEN = 1e-6  # residual of a mode of the full model, relative to its inertia force
HELD_TOLERANCE = 1e-5  # of the accelerations; the mass, a minimum, is then accurate to its square
HELD_STEPS = 5000


class Spans(NamedTuple):
    """Vectors that span a basis, in its coordinates.

    Attributes
    ----------
    modes : (n, N)
        The kept candidates, in ascending order of frequency.
    frequency : (N,)
        Hz, of the candidates.
    others : (n, k)
        Constraint or attachment modes.
    answers : (n, m)
        Static responses to the loads of truncation vectors.
    """

    modes: np.ndarray
    frequency: np.ndarray
    others: np.ndarray
    answers: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Reduction(Record):
    """A reduced basis of a model, with the root interface clamped.

    Attributes
    ----------
    basis : (n_dof, n)
        M-orthonormal, ``basis^T K basis = diag((2 pi frequency)^2)``.
    frequency : (n,)
        Hz, with the root alone clamped; the candidates in `table` have those with every fixed interface held.
    loads, static : (n_dof, 12 + 6 n_if)
        Unit loads (twelve inertia loads, then force and moment on each interface) and the model's full static
        answers with the root clamped; the root's own columns are zero.
    inertial : (n_dof, n)
        The model's full static responses to the inertia ``M basis`` of unit modal accelerations, root clamped.
    table : ModeTable
    method : str
    notes : tuple of str
        What the user should know about the choice of modes.
    truncation : (n,) or None
        Share of each coordinate in the truncation vectors, 0 to 1.
    spans : Spans or None
        What the coordinates span, where recoveries were given.
    left_out : LeftOut or None
        Static derivatives beyond those of the basis, where it has some.

    References
    ----------
    Theory 3.2 and 3.5.
    """

    basis: np.ndarray
    frequency: np.ndarray
    loads: np.ndarray
    static: np.ndarray
    inertial: np.ndarray
    table: ModeTable
    method: str
    notes: tuple[str, ...] = ()
    spans: Spans | None = None
    truncation: np.ndarray | None = None
    left_out: LeftOut | None = None

    def __repr__(self) -> str:
        """Method, size and frequency range, and the warnings."""
        band = f", {self.frequency[0]:.4g}..{self.frequency[-1]:.4g} Hz" if len(self.frequency) else ""
        return with_warnings(f"Reduction({self.method}, {len(self.frequency)} coordinates{band})", self.notes)


def refuse_no_body(what: str, model: FEModel) -> None:
    """Refuse what is no model, and a model without mass, which no body can be made of."""
    refuse_other(f"{what}: the model", FEModel, model)
    if not model.rigid.m > 0:
        raise InputError(
            f"{what}: the model has no mass, for no material has a density and no element a mass of its own; "
            "give rho of [materials], the density in the deck, or point masses"
        )


def reduced(
    method: str,
    clamped: Clamped,
    W: np.ndarray,
    table: ModeTable,
    notes: tuple[str, ...],
    rigid: np.ndarray | None = None,
    spans: Spans | None = None,
    residual: int = 0,
) -> Reduction:
    """Orthonormalise the span ``W (n_free, k)`` with the root clamped, and collect the unit loads of the body.

    `rigid` (n_free, r) are M-orthonormal rigid-body motions; the default are the mechanisms of `clamped`. The vectors
    of `spans` (n_free, k) are brought into the coordinates of the basis. The last `residual` columns of W are
    truncation vectors, which are M-orthonormal.
    """
    model = clamped.model
    loads = clamped.unit_loads
    loads[:, 12:18] = 0.0  # the root is clamped
    answers = _responses(clamped, W)
    if not clamped.mechanisms.shape[1]:  # whose responses need it
        clamped.factor.release()
    static = times(model.C, clamped.static_free(model.C.T @ loads, clamped.unit_answers))
    clamped.release()
    stiffness, mass = _gram(clamped, clamped.K, W), _gram(clamped, clamped.M, W)
    w2, span = ritz(W, clamped.K, clamped.M, clamped.mechanisms if rigid is None else rigid, (stiffness, mass))
    modes = made_unique(w2, span, clamped.K)
    del span
    inertia = times(clamped.M, modes)
    inertial = product(answers, _combination(clamped, W, mass, inertia))
    if spans is not None:
        inside = {name: inner(inertia, getattr(spans, name)) for name in ("modes", "others", "answers")}
        spans = spans._replace(**inside)
    truncation = (inner(inertia, W[:, W.shape[1] - residual :]) ** 2).sum(axis=1)
    del answers, inertia  # a large body needs their memory
    return Reduction(
        basis=times(model.C, modes),
        frequency=np.sqrt(w2) / (2 * np.pi),
        loads=loads,
        static=static,
        inertial=times(model.C, inertial),
        table=table,
        method=method,
        notes=(*notes, *_mechanism_note(clamped)),
        spans=spans,
        truncation=truncation,
    )


def _gram(clamped: Clamped, A: Bordered, W: np.ndarray) -> np.ndarray:
    """Return ``W^T A W (k, k)``, of some columns at a time, whose products with A need memory."""
    found = np.empty((W.shape[1], W.shape[1]))
    for columns in clamped.at_once(W.shape[1]):
        found[:, columns] = inner(W, times(A, W[:, columns]))
    return found


def _combination(clamped: Clamped, W: np.ndarray, mass: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Return the combinations ``(k, n)`` of ``M W`` that are the inertia ``M modes``, apart from that of mechanisms.

    `mass` is ``W^T M W``.
    """
    loose = clamped.mechanisms
    if loose.shape[1]:
        span = np.hstack([W, loose])
        mass = inner(span, times(clamped.M, span))
        return _solved(mass, inner(span, inertia))[: W.shape[1]]
    return _solved(mass, inner(W, inertia))


def _solved(mass: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of ``mass x = right`` without dependent directions of the symmetric mass."""
    size = np.sqrt(np.maximum(np.diag(mass), 0.0))
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
    share, Y = eigh(mass * scale * scale[:, None])
    new = share > DEPENDENT * share.max(initial=0.0)
    Y = scale[:, None] * Y[:, new]
    return Y / share[new] @ (Y.T @ right)


def _responses(clamped: Clamped, W: np.ndarray) -> np.ndarray:
    """Return the static responses ``(n_free, k)`` to the inertia ``M W``; zero for vectors without mass.

    The response to a fixed-interface mode is the mode itself over w^2, apart from the reactions of the interfaces.
    """
    x = np.empty(W.shape)
    for columns in clamped.at_once(W.shape[1]):
        x[:, columns] = _few_responses(clamped, W[:, columns])
    return x


def _few_responses(clamped: Clamped, W: np.ndarray) -> np.ndarray:
    """Return `_responses` of some vectors."""
    left, inertia = times(clamped.K, W), times(clamped.M, W)
    energy, mass = (np.einsum("ij,ij->j", W, force) for force in (left, inertia))
    flexibility = np.divide(mass, energy, out=np.zeros_like(energy), where=energy > 0)
    left *= -flexibility
    left += inertia
    left[clamped.b[:6]] = 0.0
    reaction = left[clamped.b]
    left[:, _inside(left, clamped) <= EIGEN * _inside(inertia, clamped)] = 0.0
    left[clamped.b] = reaction
    return clamped.static_free(left) + W * flexibility


def _inside(x: np.ndarray, clamped: Clamped) -> np.ndarray:
    """Return the norms (k,) of vectors ``x (n_free, k)`` over the interior DOFs."""
    held = x[clamped.b].copy()
    x[clamped.b] = 0.0
    norm = np.sqrt(np.einsum("ij,ij->j", x, x))
    x[clamped.b] = held
    return norm


def rigid_totals(model: FEModel) -> np.ndarray:
    """Return the body's mass (kg) and moments of inertia (kg m^2) about the root interface ``(6,)``."""
    R = model.rigid_body()
    return np.einsum("ij,ij->j", R, model.M @ R)


def effective_mass(clamped: Clamped, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the effective masses ``(n, 6)`` of interior vectors ``Phi (n_i, n)`` and the body's totals ``(6,)``.

    ``L = Phi^T (M_ii Psi + M_ib) R_b``, ``m_eff = L o L``; directions x, y, z in kg and rotations about the root
    interface in kg m^2. Theory 3.
    """
    R = clamped.model.rigid_body()[clamped.model.free]
    MR = clamped.M @ R
    return inner(Phi, MR[clamped.i]) ** 2, np.einsum("ij,ij->j", R, MR)


def held_mass(model: FEModel) -> np.ndarray:
    """Return the mass (kg) and the moments of inertia (kg m^2) about the root that stay on the held root, ``(6,)``.

    The effective masses of all modes of the model, held at its root and supports, and this mass sum up to the body's:
    ``R^T M R - b^T M_ff^-1 b`` with ``b = C_f^T M R``, R the rigid motions and f the DOFs that are free to move.

    Returns
    -------
    (6,) float
        In x, y, z and about x, y, z through the root interface.

    Raises
    ------
    AccuracyError
        When the iteration does not converge.

    References
    ----------
    Theory 3.3. A. Girard and N. Roy, Structural Dynamics in Industry (2008), on effective and residual masses.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> held_mass(cantilever_model(elements=4))[0].round(6)  # of 12 kg, of which an element has 3 kg
    np.float64(0.865979)
    """
    R = model.rigid_body()
    f = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    C = model.C.tocsc()[:, f].tocsr()
    M = (C.T.tocsr() @ model.M @ C).tocsr()
    moving = R[model.free][f]
    carried, load = model.M @ R, M @ moving
    left = C.T @ carried - load  # on the neighbours of what is held only, so that few steps solve for it
    moved = np.einsum("ij,ij->j", moving, load + 2 * left) + np.einsum("ij,ij->j", left, _mass_solution(M, left))
    return np.maximum(np.einsum("ij,ij->j", R, carried) - moved, 0.0)


def _mass_solution(M: csr_array, b: np.ndarray) -> np.ndarray:
    """Return ``M^-1 b`` by conjugate gradients; M may lack the mass of some DOFs, on which b is zero then."""
    diagonal = M.diagonal()
    scale = np.divide(1.0, diagonal, out=np.ones_like(diagonal), where=diagonal > 0)
    inverse = LinearOperator(M.shape, matvec=lambda x: scale * x.ravel(), dtype=float)
    found = [cg(M, column, rtol=HELD_TOLERANCE, M=inverse, maxiter=HELD_STEPS) for column in b.T]
    if any(code for _, code in found):
        raise AccuracyError("the mass at the held root was not found: the mass matrix is ill-conditioned")
    return np.stack([x for x, _ in found], axis=1)


def _mechanism_note(clamped: Clamped) -> tuple[str, ...]:
    count = clamped.mechanisms.shape[1]
    root = clamped.model.interfaces[0].name
    if not count:
        return ()
    return (
        f"with only {root!r} clamped, the body moves without strain in {count} ways, which are modes of 0 Hz; "
        "if that is not meant, take a root that holds it",
    )
