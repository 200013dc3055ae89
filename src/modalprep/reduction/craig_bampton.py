"""Craig-Bampton and Guyan reduction of a model to the coordinates of its body: FORMULATION section 3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.model import FEModel
from modalprep.linalg.modes import lowest_modes, unique_signs
from modalprep.linalg.ritz import ritz
from modalprep.records import Record
from modalprep.reduction.clamped import Clamped, clamp
from modalprep.reduction.selection import select
from modalprep.reduction.table import CONSTRAINT, DIRECTIONS, FIXED, TRUNCATION, ModeTable
from modalprep.reduction.truncation import truncation_vectors


@dataclass(frozen=True, eq=False, kw_only=True)
class Reduction(Record):
    """A reduced basis of a model, with the root interface clamped.

    Attributes
    ----------
    basis : (n_dof, n)
        M-orthonormal, ``basis^T K basis = diag((2 pi frequency)^2)``.
    frequency : (n,)
        Hz.
    loads, static : (n_dof, 12 + 6 n_if)
        Unit loads (twelve inertia loads, then force and moment on each interface) and the model's full static
        answers with the root clamped; the root's own columns are zero.
    table : ModeTable
    method : str
    notes : tuple of str
        What the user should know about the choice of modes.
    """

    basis: np.ndarray
    frequency: np.ndarray
    loads: np.ndarray
    static: np.ndarray
    table: ModeTable
    method: str
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Method, size and frequency range."""
        band = f", {self.frequency[0]:.4g}..{self.frequency[-1]:.4g} Hz" if len(self.frequency) else ""
        return f"Reduction({self.method}, {len(self.frequency)} coordinates{band})"


def guyan(model: FEModel, *, solver: str = "auto") -> Reduction:
    """Reduce to the constraint modes of the fixed interfaces: exact in statics, crude in dynamics.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> guyan(cantilever_model(tip="fixed"))
    Reduction(guyan, 6 coordinates, 0.6073..133.2 Hz)
    """
    held = clamp(model, solver)
    no_modes = np.zeros((len(held.i), 0))
    return _reduction("guyan", held, np.zeros(0), no_modes, _no_candidates(held), np.zeros(0), no_modes, ())


def craig_bampton(
    model: FEModel,
    *,
    modes: int,
    keep: str = "all",
    truncation: Sequence[str] = ("interfaces", "inertia"),
    solver: str = "auto",
) -> Reduction:
    """Reduce to constraint modes, selected fixed-interface modes and modal truncation vectors.

    Parameters
    ----------
    model : FEModel
    modes : int
        Fixed-interface modes to compute as candidates.
    keep : str
        Which of them to keep (`selection.select`).
    truncation : of {"interfaces", "inertia"}
        Loads whose static answer the basis must hold: forces and moments on the free interfaces, the twelve
        inertia loads.
    solver : {"auto", "pardiso", "superlu"}

    Raises
    ------
    InputError
        When the mode count is negative, or a load or selection is unknown.
    MechanismError
        When the structure can move without strain.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> red = craig_bampton(cantilever_model(), modes=6, keep="effective_mass > 1%")
    >>> red.table.kind[:2], red.table.reason[0]
    (('fixed-interface', 'fixed-interface'), 'effective mass 97.1% in rz > 1%')
    """
    if modes < 0:
        raise InputError(f"modes = {modes} must not be negative")
    held = clamp(model, solver)
    w2, Phi = lowest_modes(held.K_ii, held.M_ii, modes, factor=held.factor, solver=solver)
    table = _candidates(held, w2, Phi, keep)
    kept = table.kept
    F = _truncated_loads(held, truncation)
    w2_t, X = truncation_vectors(held, F, w2[kept], Phi[:, kept])
    notes = _notes(keep, table, modes)
    return _reduction("craig_bampton", held, w2[kept], Phi[:, kept], table, w2_t, X, notes)


def _candidates(held: Clamped, w2: np.ndarray, Phi: np.ndarray, keep: str) -> ModeTable:
    frequency = np.sqrt(w2) / (2 * np.pi)
    mass, total = effective_mass(held, Phi)
    table = ModeTable(
        kind=(FIXED,) * len(w2),
        frequency=frequency,
        effective_mass=mass,
        total=total,
        kept=np.ones(len(w2), dtype=bool),
        reason=("",) * len(w2),
    )
    kept, reason = select(keep, frequency, table.fraction)
    return table.with_(kept=kept, reason=reason)


def _no_candidates(held: Clamped) -> ModeTable:
    return _candidates(held, np.zeros(0), np.zeros((len(held.i), 0)), "all")


def effective_mass(held: Clamped, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the effective masses ``(n, 6)`` of interior vectors ``Phi (n_i, n)`` and the body's totals ``(6,)``.

    ``L = Phi^T (M_ii Psi + M_ib) R_b``, ``m_eff = L o L``; directions x, y, z in kg and rotations about the root
    interface in kg m^2. FORMULATION section 3.
    """
    R = held.model.rigid_body()[held.model.free]
    MR = held.M @ R
    return (Phi.T @ MR[held.i]) ** 2, np.einsum("ij,ij->j", R, MR)


def _truncated_loads(held: Clamped, truncation: Sequence[str]) -> np.ndarray:
    """Loads on the interior DOFs, moments and position-proportional loads divided by the body's size."""
    model = held.model
    size = np.ptp(model.points, axis=0).max()
    loads = {"inertia": model.inertia_loads / np.repeat([1.0, size], [3, 9])}
    loads["inertia"] = loads["inertia"] / model.rigid.m
    free = [frame.dofs for frame in model.interfaces if frame.boundary == "free"]
    unit = _unit_loads(model, free) / np.tile(np.repeat([1.0, size], 3), len(free))
    loads["interfaces"] = unit
    for name in truncation:
        if name not in loads:
            raise InputError(f"truncation_vectors: {name!r} is not one of interfaces, inertia")
    chosen = [loads[name] for name in dict.fromkeys(truncation)]
    return (model.C.T @ np.concatenate([np.zeros((model.n_dof, 0)), *chosen], axis=1))[held.i]


def _unit_loads(model: FEModel, dofs: list[np.ndarray]) -> np.ndarray:
    columns = np.concatenate([np.zeros(0, dtype=int), *dofs])
    unit = np.zeros((model.n_dof, len(columns)))
    unit[columns, np.arange(len(columns))] = 1.0
    return unit


def _notes(keep: str, table: ModeTable, modes: int) -> tuple[str, ...]:
    if "frequency" in keep and len(table.kept) and table.kept[-1] and "frequency" in table.reason[-1]:
        return (
            f"the highest of the {modes} candidates, {table.frequency[-1]:.4g} Hz, still satisfies {keep!r}: "
            "there may be more modes, raise 'modes'",
        )
    return ()


def _reduction(method, held, w2, Phi, table, w2_t, X, notes) -> Reduction:
    """Assemble the basis, orthonormalise it and collect the unit loads."""
    model = held.model
    W = np.concatenate([held.constraint_shapes, held.expand(Phi), held.expand(X)], axis=1)
    w2_body, span = ritz(W, held.K, held.M, held.mechanisms)
    loads = np.concatenate([model.inertia_loads, _unit_loads(model, [f.dofs for f in model.interfaces])], axis=1)
    loads[:, 12:18] = 0.0  # the root is held
    return Reduction(
        basis=model.C @ (span * unique_signs(span)),
        frequency=np.sqrt(w2_body) / (2 * np.pi),
        loads=loads,
        static=held.static(loads),
        table=_with_static_rows(table, held, w2_t, X),
        method=method,
        notes=(*notes, *_mechanism_note(held)),
    )


def _mechanism_note(held: Clamped) -> tuple[str, ...]:
    count, root = held.mechanisms.shape[1], held.model.interfaces[0].name
    if not count:
        return ()
    return (
        f"with only {root!r} held, the body moves without strain in {count} ways, which are modes of 0 Hz; "
        "if that is not meant, take a root that holds it",
    )


def _with_static_rows(table: ModeTable, held: Clamped, w2_t: np.ndarray, X: np.ndarray) -> ModeTable:
    """Append the constraint modes and truncation vectors to the table of candidates."""
    others = [f.name for f in held.model.interfaces if f.boundary == "fixed"][1:]
    constraint = [f"unit displacement {d} of interface {name}" for name in others for d in DIRECTIONS]
    truncation = ["static answer of dropped modes"] * len(w2_t)
    n_c, n_t = len(constraint), len(w2_t)
    return table.with_(
        kind=table.kind + (CONSTRAINT,) * n_c + (TRUNCATION,) * n_t,
        frequency=np.concatenate([table.frequency, np.full(n_c, np.nan), np.sqrt(w2_t) / (2 * np.pi)]),
        effective_mass=np.concatenate([table.effective_mass, np.full((n_c, 6), np.nan), effective_mass(held, X)[0]]),
        kept=np.concatenate([table.kept, np.ones(n_c + n_t, dtype=bool)]),
        reason=(*table.reason, *constraint, *truncation),
    )
