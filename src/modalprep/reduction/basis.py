"""A reduced basis in the coordinates of its body: root clamped, M-orthonormal, with the unit loads of its prestress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import eigh, inner, product
from modalprep.linalg.modes import unique_modes
from modalprep.linalg.ritz import ritz
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
) -> Reduction:
    """Orthonormalise the span ``W (n_free, k)`` with the root clamped, and collect the unit loads of the body.

    `rigid` (n_free, r) are M-orthonormal rigid-body motions; the default are the mechanisms of `clamped`. The vectors
    of `spans` (n_free, k) are brought into the coordinates of the basis.
    """
    model = clamped.model
    w2, span = ritz(W, clamped.K, clamped.M, clamped.mechanisms if rigid is None else rigid)
    loads = np.concatenate([model.inertia_loads, unit_loads(model, [f.dofs for f in model.interfaces])], axis=1)
    loads[:, 12:18] = 0.0  # the root is clamped
    modes = unique_modes(w2, span)
    if spans is not None:
        inside = {name: inner(modes, clamped.M @ getattr(spans, name)) for name in ("modes", "others", "answers")}
        spans = spans._replace(**inside)
    return Reduction(
        basis=model.C @ modes,
        frequency=np.sqrt(w2) / (2 * np.pi),
        loads=loads,
        static=clamped.static(loads),
        inertial=model.C @ _inertial(clamped, W, modes),
        table=table,
        method=method,
        notes=(*notes, *_mechanism_note(clamped)),
        spans=spans,
    )


def _inertial(clamped: Clamped, W: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Return the static responses ``(n_free, n)`` to ``M modes``, from those of the span W of the modes and mechanisms.

    The response to a fixed-interface mode is the mode itself over w^2, apart from the reactions of the interfaces.
    """
    W, force = _unit_mass(W, clamped)
    strain = clamped.K @ W
    quotient = np.einsum("ij,ij->j", W, strain)
    flexibility = np.divide(1.0, quotient, out=np.zeros_like(quotient), where=quotient > 0)
    strain *= flexibility
    left = np.subtract(force, strain, out=strain)
    left[clamped.b[:6]] = 0.0
    more = ~(_inside(left, clamped) <= EIGEN * _inside(force, clamped))
    x = W * flexibility
    x[:, more] += clamped.static_free(left[:, more])
    if np.any(left[clamped.b[6:]][:, ~more]):
        reaction = np.zeros((len(x), np.sum(~more)))
        reaction[clamped.b] = left[clamped.b][:, ~more]
        x[:, ~more] += clamped.static_free(reaction)
    loose = clamped.mechanisms
    span, inertia = np.hstack([W, loose]), np.hstack([force, clamped.M @ loose])
    share, Y = eigh(inner(span, inertia))
    new = share > DEPENDENT * share.max(initial=0.0)
    factors = Y[:, new] / share[new] @ (Y[:, new].T @ inner(inertia, modes))
    return product(x, factors[: x.shape[1]])


def _inside(x: np.ndarray, clamped: Clamped) -> np.ndarray:
    """Return the norms (k,) of vectors ``x (n_free, k)`` over the interior DOFs."""
    held = x[clamped.b].copy()
    x[clamped.b] = 0.0
    norm = np.sqrt(np.einsum("ij,ij->j", x, x))
    x[clamped.b] = held
    return norm


def _unit_mass(W: np.ndarray, clamped: Clamped) -> tuple[np.ndarray, np.ndarray]:
    """Return the vectors with nonzero mass, scaled to unit mass, and their inertia ``M W``."""
    force = clamped.M @ W
    mass = np.einsum("ij,ij->j", W, force)
    heavy, scale = mass > 0, 1 / np.sqrt(mass[mass > 0])
    return W[:, heavy] * scale, force[:, heavy] * scale


def unit_loads(model: FEModel, dofs: list[np.ndarray]) -> np.ndarray:
    """Return unit nodal loads ``(n_dof, k)`` on each of the DOFs."""
    columns = np.concatenate([np.zeros(0, dtype=int), *dofs])
    unit = np.zeros((model.n_dof, len(columns)))
    unit[columns, np.arange(len(columns))] = 1.0
    return unit


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
