"""Craig-Bampton and Guyan reduction of a model to the coordinates of its body: FORMULATION section 3."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.model import FEModel
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.basis import Reduction, effective_mass, reduced, unit_loads
from modalprep.reduction.clamped import Clamped, clamp
from modalprep.reduction.selection import select
from modalprep.reduction.table import CONSTRAINT, DIRECTIONS, FIXED, TRUNCATION, ModeTable
from modalprep.reduction.truncation import ENERGY, truncation_vectors


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
    table = _with_static_rows(_no_candidates(held), held, np.zeros(0), no_modes)
    return reduced("guyan", held, held.constraint_shapes, table, ())


def craig_bampton(
    model: FEModel,
    *,
    modes: int,
    keep: str | list[int] = "all",
    truncation: Sequence[str] = ("interfaces", "inertia"),
    solver: str = "auto",
) -> Reduction:
    """Reduce to constraint modes, selected fixed-interface modes and modal truncation vectors.

    Parameters
    ----------
    model : FEModel
    modes : int
        Fixed-interface modes to compute as candidates.
    keep : str or list of int
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
    F = _truncated_loads(held, truncation)
    table = _candidates(held, w2, Phi, keep, _static_share(held, w2, Phi))
    kept = table.kept
    w2_t, X = truncation_vectors(held, F, w2[kept], Phi[:, kept])
    notes = _notes(keep, table, modes)
    W = np.concatenate([held.constraint_shapes, held.expand(Phi[:, kept]), held.expand(X)], axis=1)
    return reduced("craig_bampton", held, W, _with_static_rows(table, held, w2_t, X), notes)


def _static_share(held: Clamped, w2: np.ndarray, Phi: np.ndarray) -> np.ndarray:
    """Largest share (n,) of each mode in the strain energy of the interface and inertia loads."""
    F = _truncated_loads(held, ("interfaces", "inertia"))
    energy = np.einsum("ij,ij->j", F, held.factor.solve(F))
    real = energy > ENERGY * energy.max(initial=0.0)
    return np.max((Phi.T @ F[:, real]) ** 2 / w2[:, None] / energy[real], axis=1, initial=0.0)


def _candidates(held: Clamped, w2: np.ndarray, Phi: np.ndarray, keep: str | list[int], static=None) -> ModeTable:
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
    kept, reason = select(keep, frequency, table.fraction, static)
    return table.with_(kept=kept, reason=reason)


def _no_candidates(held: Clamped) -> ModeTable:
    return _candidates(held, np.zeros(0), np.zeros((len(held.i), 0)), "all")


def _truncated_loads(held: Clamped, truncation: Sequence[str]) -> np.ndarray:
    """Loads on the interior DOFs, moments and position-proportional loads divided by the body's size."""
    model = held.model
    size = np.ptp(model.points, axis=0).max()
    loads = {"inertia": model.inertia_loads / np.repeat([1.0, size], [3, 9])}
    loads["inertia"] = loads["inertia"] / model.rigid.m
    free = [frame.dofs for frame in model.interfaces if frame.boundary == "free"]
    unit = unit_loads(model, free) / np.tile(np.repeat([1.0, size], 3), len(free))
    loads["interfaces"] = unit
    for name in truncation:
        if name not in loads:
            raise InputError(f"truncation_vectors: {name!r} is not one of interfaces, inertia")
    chosen = [loads[name] for name in dict.fromkeys(truncation)]
    return (model.C.T @ np.concatenate([np.zeros((model.n_dof, 0)), *chosen], axis=1))[held.i]


def _notes(keep: str, table: ModeTable, modes: int) -> tuple[str, ...]:
    if (
        isinstance(keep, str)
        and "frequency" in keep
        and len(table.kept)
        and table.kept[-1]
        and "frequency" in table.reason[-1]
    ):
        return (
            f"the highest of the {modes} candidates, {table.frequency[-1]:.4g} Hz, still satisfies {keep!r}: "
            "there may be more modes, raise 'modes'",
        )
    return ()


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
