"""Craig-Bampton and Guyan reduction of a model to the coordinates of its body: theory 3."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.blas import one_numpy_thread
from modalprep.reduction.basis import Reduction, Spans, effective_mass, reduced, refuse_no_body, rigid_totals
from modalprep.reduction.clamped import Clamped, clamp
from modalprep.reduction.derivatives import LeftOut, derivative_loads
from modalprep.reduction.notes import (
    completeness,
    fewer_modes,
    interface_boundaries,
    more_modes,
    place_of,
    pseudo_resonances,
)
from modalprep.reduction.participation import fixed_coupling, interface_shares, model_size, static_share
from modalprep.reduction.recoveries.shares import Share, recovery_shares
from modalprep.reduction.recoveries.unit_loads import fixed_interface_loads
from modalprep.reduction.selection import recoveries_named, select
from modalprep.reduction.table import (
    CONSTRAINT,
    DERIVATIVE_VECTORS,
    DERIVATIVES,
    DIRECTIONS,
    FIXED,
    OF_INTERFACE,
    TRUNCATION,
    ModeTable,
)
from modalprep.reduction.truncation import truncation_vectors
from modalprep.suggest import refuse_unknown
from modalprep.verdicts.notes import told

COPIES = 4  # copies of its basis that a reduction has at once beside a factor
BUILT_IN = ("interfaces", "inertia")  # loads that every body has


class InteriorLoads(NamedTuple):
    """Loads on the interior DOFs and the displacements under them with every fixed interface held, ``(n_i, k)``."""

    force: np.ndarray
    answer: np.ndarray


@told
@one_numpy_thread(beside_mkl=True)
def guyan(model: FEModel, *, solver: str = "auto", algebra: Algebra = DIRECT) -> Reduction:
    """Reduce to the constraint modes of the fixed interfaces: exact in statics, approximate in dynamics.

    Returns
    -------
    Reduction
        The basis (n_dof, n) of unit displacements (m) and rotations (rad) of the interfaces, in modal form.

    References
    ----------
    R. J. Guyan, Reduction of stiffness and mass matrices, AIAA J. 3 (1965) 380.
    Theory 3.2.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> guyan(cantilever_model(tip="fixed"))
    Reduction(guyan, 6 coordinates, 0.6073..133.2 Hz)
    """
    refuse_no_body("guyan", model)
    clamped = clamp(model, solver, algebra)
    table = with_constraint_modes(ModeTable.empty(rigid_totals(model)), model)
    return reduced("guyan", clamped, clamped.constraint_shapes, table, ())


def with_constraint_modes(table: ModeTable, model: FEModel) -> ModeTable:
    """Return a table with a row for each constraint mode except those of the root."""
    others = [frame.name for frame in model.interfaces if frame.boundary == "fixed"][1:]
    return table.with_rows(
        CONSTRAINT, [f"unit displacement {d}{OF_INTERFACE}{name}" for name in others for d in DIRECTIONS]
    )


@told
@one_numpy_thread(beside_mkl=True)
def craig_bampton(
    model: FEModel,
    *,
    modes: int,
    keep: str | list[int] = "all",
    truncation: Sequence[str] = ("interfaces", "inertia"),
    loads: Mapping[str, np.ndarray] | None = None,
    recovery: ModelRecovery | None = None,
    derivatives: int = DERIVATIVE_VECTORS,
    solver: str = "auto",
    algebra: Algebra = DIRECT,
) -> Reduction:
    """Reduce to constraint modes, selected fixed-interface modes and modal truncation vectors.

    Fixed and free interfaces may be mixed: fixed ones have constraint modes, free ones move with the modes.

    Parameters
    ----------
    model : FEModel
    modes : int
        Fixed-interface modes to compute as candidates.
    keep : str or list of int
        Which of them to keep (`selection.select`).
    truncation : of {"interfaces", "inertia", "derivatives"} and the names of `loads`
        Loads whose static response the basis represents exactly: forces and moments on the free interfaces, the twelve
        inertia loads, user loads; "derivatives" are what the softest shapes change to when they bend, for large
        deflections (derivatives.py).
    loads : {name: (n_dof,) or (n_dof, k)}
        Nodal loads (`nodal_load`, `interface_load`) beside those of the model (``FEModel.loads``); their magnitude
        does not matter.
    recovery : ModelRecovery or None
        Quantities that `keep` may name; the reduction then has `spans`.
    derivatives : int
        Number of vectors of "derivatives", the most important ones.
    solver : {"auto", "in_memory", "single", "out_of_core", "superlu"}
        As `factorise` takes it.
    algebra : Algebra
        Functions for factorisation and eigensolution.

    Returns
    -------
    Reduction
        The basis (n_dof, n) in SI units, in the frame of the root, and the table of all candidates.

    Raises
    ------
    InputError
        When the mode count is negative, a load or selection is unknown, or a load does nothing.
    MechanismError
        When the structure can move without strain.

    References
    ----------
    R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313.
    Theory 3.2, 3.4 and 3.10.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> red = craig_bampton(cantilever_model(), modes=6, keep="effective_mass > 1%")
    >>> red.table.kind[:2], red.table.reason[0]
    (('fixed-interface', 'fixed-interface'), 'effective mass 97.1% in rz > 1%')
    """
    refuse_no_body("craig_bampton", model)
    if modes < 0:
        raise InputError(f"modes = {modes} must not be negative")
    clamped = clamp(model, solver, algebra, columns=_columns(model, modes))
    F = _interior_loads(clamped, {**model.loads, **(loads or {})})
    for name in truncation:
        refuse_unknown(name, (*F, DERIVATIVES), "truncation_vectors: load")
    w2, Phi, counted = algebra.lowest_modes(clamped.K_ii, clamped.M_ii, modes, factor=clamped.factor, solver=solver)
    recovered = _recovered(clamped, w2, Phi, F, recovery, keep)
    table = _candidates(clamped, w2, Phi, keep, F, recovered)
    kept = Phi[:, table.kept]
    wanted = _side_by_side(F, [name for name in truncation if name != DERIVATIVES])
    w2_t, X = truncation_vectors(clamped, wanted.force, w2[table.kept], kept, wanted.answer)
    left_out = None
    if DERIVATIVES in truncation:
        wanted, left_out = _with_derivatives(clamped, kept, w2[table.kept], (w2_t, X), wanted, derivatives)
        w2_t, X = truncation_vectors(clamped, wanted.force, w2[table.kept], kept, wanted.answer)
    notes = (
        *fewer_modes(len(w2), modes, FIXED),
        *completeness(w2, counted, FIXED),
        *place_of(clamped.factor),
        *more_modes(keep, table, modes),
        *pseudo_resonances(table, w2_t),
        *interface_boundaries(model, truncation),
    )
    W = np.concatenate([clamped.constraint_shapes, clamped.expand(kept, X)], axis=1)
    answers = ["static response of dropped modes"] * len(w2_t)
    frequency = np.sqrt(w2_t) / (2 * np.pi)
    table = with_constraint_modes(table, model).with_rows(TRUNCATION, answers, frequency, effective_mass(clamped, X)[0])
    spans = _spans(clamped, w2[table.kept[: len(w2)]], kept, wanted.answer) if recovery else None
    del F, Phi, kept, wanted, X, recovered  # a large body needs their memory
    found = reduced("craig_bampton", clamped, W, table, notes, spans=spans, residual=len(w2_t))
    return found if left_out is None else found.with_(left_out=left_out)


def _with_derivatives(
    clamped: Clamped, kept: np.ndarray, w2: np.ndarray, found: tuple, wanted: InteriorLoads, count: int
) -> tuple[InteriorLoads, LeftOut]:
    """Return the wanted loads with those of static derivatives of the basis `found`, and derivatives left out."""
    if count < 1:
        raise InputError(f"derivatives = {count} must be at least 1; leave 'derivatives' out of truncation_vectors")
    inside = np.concatenate([kept, found[1]], axis=1)
    W = np.concatenate([clamped.constraint_shapes, clamped.expand(inside)], axis=1)
    force, answer, left_out = derivative_loads(clamped, W, inside, np.concatenate([w2, found[0]]), count)
    size = np.sqrt(np.einsum("ij,ij->j", wanted.force, wanted.answer).max(initial=0.0)) or 1.0  # of like energy
    more = InteriorLoads(np.hstack([wanted.force, size * force]), np.hstack([wanted.answer, size * answer]))
    return more, left_out


def _columns(model: FEModel, modes: int) -> int:
    """Return about how many vectors of the size of the model there are at once besides the factor."""
    return COPIES * (min(modes, len(model.free)) + 12 + 6 * len(model.interfaces))


def _spans(clamped: Clamped, w2: np.ndarray, kept: np.ndarray, answers: np.ndarray) -> Spans:
    """Return the kept modes, and what the basis has whatever their number."""
    modes = clamped.expand(kept)
    frequency = np.sqrt(w2) / (2 * np.pi)
    return Spans(modes, frequency, clamped.constraint_shapes, clamped.expand(answers))


def _recovered(
    clamped: Clamped, w2: np.ndarray, Phi: np.ndarray, F: Mapping, recovery: ModelRecovery | None, keep: str | list[int]
) -> dict[str, list[Share]] | None:
    """Return the shares of the modes in the recoveries; None where `keep` does not use them or there are none."""
    if recovery is None or not recovery.quantities or not recoveries_named(keep)[0]:
        return None
    users = {name: f.force for name, f in F.items() if name not in BUILT_IN}
    return recovery_shares(recovery, fixed_interface_loads(clamped, w2, Phi, users))


def _candidates(
    clamped: Clamped, w2: np.ndarray, Phi: np.ndarray, keep: str | list[int], F: Mapping, recovered: dict | None
) -> ModeTable:
    """Select the modes; values that cost much are computed only if `keep` uses them."""
    frequency = np.sqrt(w2) / (2 * np.pi)
    mass, total = effective_mass(clamped, Phi)
    table = ModeTable.empty(total).with_rows(FIXED, [""] * len(w2), frequency, mass)
    static = static_share(*_side_by_side(F, F), w2, Phi) if "static" in str(keep) else None
    coupled = any(name in str(keep) for name in ("controllability", "observability"))
    shares = interface_shares(fixed_coupling(clamped, Phi), w2) if coupled else ()
    controllability, observability = shares or (None, None)
    kept, reason = select(keep, frequency, table.fraction, static, controllability, observability, recovered)
    return table.with_(kept=kept, reason=reason)


def _interior_loads(clamped: Clamped, loads: Mapping[str, np.ndarray]) -> dict[str, InteriorLoads]:
    """Return the loads by name, scaled to about 1 N in total."""
    model = clamped.model
    size = model_size(clamped.model)
    force, answer = clamped.inside_loads, clamped.unit_answers
    free = np.flatnonzero([frame.boundary == "free" for frame in model.interfaces])
    own = {
        "interfaces": ((12 + 6 * free[:, None] + range(6)).ravel(), np.tile(np.repeat([1.0, size], 3), len(free))),
        "inertia": (np.arange(12), 1 / (model.rigid.m * np.repeat([1.0, size], [3, 9]))),
    }
    inside = {name: InteriorLoads(force[:, k] * scale, answer[:, k] * scale) for name, (k, scale) in own.items()}
    for name, load in loads.items():
        if name in own:
            raise InputError(f"load {name!r} has the name of built-in loads; choose another")
        f = (model.C.T @ _user_load(model, name, load))[clamped.i]
        if not np.any(f):
            raise InputError(f"load {name!r} acts on fixed interfaces only and has no effect; load other nodes")
        inside[name] = InteriorLoads(f, clamped.interior_response(f))
    return inside


def _side_by_side(F: Mapping[str, InteriorLoads], names: Iterable[str]) -> InteriorLoads:
    """Return the loads of these names in one."""
    none = F["inertia"].force[:, :0]
    names = dict.fromkeys(names)
    return InteriorLoads(*(np.hstack([none, *(F[name][k] for name in names)]) for k in range(2)))


def _user_load(model: FEModel, name: str, load: np.ndarray) -> np.ndarray:
    """Return a load ``(n_dof, k)`` over its magnitude: the sum of its forces and its moments over the body's size."""
    load = np.asarray(load, dtype=float).reshape(len(load), -1)
    if len(load) != model.n_dof or not np.all(np.isfinite(load)):
        raise InputError(f"load {name!r} needs {model.n_dof} finite numbers, one per DOF; it has {len(load)} rows")
    arm = np.ones(model.n_dof)
    arm[model.dof[:, 3:][model.dof[:, 3:] >= 0]] = model_size(model)
    total = np.sum(np.abs(load) / arm[:, None], axis=0)
    return load / np.where(total > 0, total, 1.0)
