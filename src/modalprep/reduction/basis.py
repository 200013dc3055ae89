"""A reduced basis in the coordinates of its body: root clamped, M-orthonormal, with the unit loads of its prestress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import eigh, inner, product
from modalprep.linalg.ritz import ritz
from modalprep.linalg.sparse import times
from modalprep.linalg.unique import unique_modes
from modalprep.records import Record
from modalprep.reduction.clamped import Clamped
from modalprep.reduction.table import ModeTable

DEPENDENT = 1e-14  # share of mass of a combination of unit vectors: round-off
EIGEN = 1e-6  # residual of a mode of the full model, relative to its inertia force


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

    def __repr__(self) -> str:
        """Method, size and frequency range."""
        band = f", {self.frequency[0]:.4g}..{self.frequency[-1]:.4g} Hz" if len(self.frequency) else ""
        return f"Reduction({self.method}, {len(self.frequency)} coordinates{band})"


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
    products = times(clamped.K, W), times(clamped.M, W)
    w2, span = ritz(W, clamped.K, clamped.M, clamped.mechanisms if rigid is None else rigid, products)
    loads = clamped.unit_loads.copy()
    loads[:, 12:18] = 0.0  # the root is clamped
    modes = unique_modes(w2, span, clamped.K)
    if spans is not None:
        inside = {name: inner(modes, times(clamped.M, getattr(spans, name))) for name in ("modes", "others", "answers")}
        spans = spans._replace(**inside)
    return Reduction(
        basis=times(model.C, modes),
        frequency=np.sqrt(w2) / (2 * np.pi),
        loads=loads,
        static=times(model.C, clamped.static_free(model.C.T @ loads, clamped.unit_answers[1])),
        inertial=times(model.C, _inertial(clamped, W, *products, modes)),
        table=table,
        method=method,
        notes=(*notes, *_mechanism_note(clamped)),
        spans=spans,
        truncation=(inner(modes, products[1][:, W.shape[1] - residual :]) ** 2).sum(axis=1),
    )


def _inertial(
    clamped: Clamped, W: np.ndarray, strain: np.ndarray, inertia: np.ndarray, modes: np.ndarray
) -> np.ndarray:
    """Return the static responses ``(n_free, n)`` to ``M modes``, from those of the span W of the modes and mechanisms.

    `strain` and `inertia` are K W and M W. The response to a fixed-interface mode is the mode itself over w^2, apart
    from the reactions of the interfaces.
    """
    loose = clamped.mechanisms
    x = _responses(clamped, W, strain, inertia)
    span, force = W, inertia
    if loose.shape[1]:
        span, force = np.hstack([W, loose]), np.hstack([inertia, times(clamped.M, loose)])
    mass = inner(span, force)
    size = np.sqrt(np.maximum(np.diag(mass), 0.0))
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
    share, Y = eigh(mass * scale * scale[:, None])
    new = share > DEPENDENT * share.max(initial=0.0)
    Y = scale[:, None] * Y[:, new]
    return product(x, (Y / share[new] @ (Y.T @ inner(force, modes)))[: x.shape[1]])


def _responses(clamped: Clamped, W: np.ndarray, strain: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Return the static responses to ``inertia (n_free, k)`` of vectors W; zero for those without mass."""
    energy, mass = (np.einsum("ij,ij->j", W, force) for force in (strain, inertia))
    flexibility = np.divide(mass, energy, out=np.zeros_like(energy), where=energy > 0)
    left = strain * -flexibility
    left += inertia
    left[clamped.b[:6]] = 0.0
    reaction = left[clamped.b]
    left[:, _inside(left, clamped) <= EIGEN * _inside(inertia, clamped)] = 0.0
    left[clamped.b] = reaction
    x = clamped.static_free(left)
    x += W * flexibility
    return x


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


def _mechanism_note(clamped: Clamped) -> tuple[str, ...]:
    count, root = clamped.mechanisms.shape[1], clamped.model.interfaces[0].name
    if not count:
        return ()
    return (
        f"with only {root!r} clamped, the body moves without strain in {count} ways, which are modes of 0 Hz; "
        "if that is not meant, take a root that holds it",
    )
