"""Free-interface reduction with residual attachment modes, and Guyan's reduction improved by inertia (IRS)."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError, MechanismError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.blas import one_numpy_thread
from modalprep.reduction.basis import Reduction, Spans, reduced, refuse_no_body, rigid_totals
from modalprep.reduction.clamped import Clamped, clamp, unit_loads
from modalprep.reduction.craig_bampton import with_constraint_modes
from modalprep.reduction.notes import completeness, fewer_modes, more_modes
from modalprep.reduction.participation import free_coupling, interface_shares, model_size, static_share
from modalprep.reduction.recoveries.shares import Share, recovery_shares
from modalprep.reduction.recoveries.unit_loads import ACCELERATION, floating_loads
from modalprep.reduction.selection import recoveries_named, select
from modalprep.reduction.table import ATTACHMENT, DIRECTIONS, FREE, ModeTable
from modalprep.verdicts.notes import told

RIGID = 1e-6  # w^2 of a rigid motion over that of the body clamped at its root
LINE = 1e-13  # smallest eigenvalue of a scaled rigid inertia: round-off where it resists not, 1e-8 of a slender wire


@told
@one_numpy_thread(beside_mkl=True)
def free_interface(
    model: FEModel,
    *,
    modes: int,
    keep: str | list[int] = "all",
    recovery: ModelRecovery | None = None,
    solver: str = "auto",
    algebra: Algebra = DIRECT,
) -> Reduction:
    """Reduce to free-free modes and the residual attachment modes of every interface (MacNeal, Rubin, Craig-Chang).

    The static response to forces and moments on the interfaces is exact, inertia relief included; the elastic modes are
    those of the floating body, as a ground test measures them. The basis is then moved to the frame of the root.

    Parameters
    ----------
    model : FEModel
    modes : int
        Elastic free-free modes to compute as candidates.
    keep : str or list of int
        Which of them to keep (`selection.select`); they have no effective mass.
    recovery : ModelRecovery or None
        Quantities that `keep` may name, but for accelerations, as there is no base; the reduction then has `spans`.
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
        When the mode count is negative or the selection cannot be read.
    MechanismError
        When the floating body has more than six rigid-body motions.

    References
    ----------
    R. H. MacNeal, A hybrid method of component mode synthesis, Comput. Struct. 1 (1971) 581.
    S. Rubin, Improved component-mode representation for structural dynamic analysis, AIAA J. 13 (1975) 995.
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section 17.4.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> free_interface(cantilever_model(), modes=4).table.kind[:5]
    ('free-interface', 'free-interface', 'free-interface', 'free-interface', 'attachment')
    """
    refuse_no_body("free_interface", model)
    if modes < 0:
        raise InputError(f"modes = {modes} must not be negative")
    clamped = clamp(model, solver, algebra)
    R = model.rigid_body()[model.free]
    w2, Phi, counted = _elastic_modes(clamped, R, modes, solver, algebra)
    F, x = _relieved(clamped, R)
    recovered = _recovered(clamped, w2, Phi, F, x, recovery, keep)
    candidates = _candidates(model, w2, Phi, keep, static_share(F, x, w2, Phi), recovered)
    kind = f"elastic {FREE}"
    notes = (*fewer_modes(len(w2), modes, kind), *completeness(w2, counted, kind), *more_modes(keep, candidates, modes))
    w2 = w2[candidates.kept]
    Phi = Phi[:, candidates.kept]
    W = np.hstack([Phi, x - Phi @ ((Phi.T @ F) / w2[:, None])])
    spans = None
    if recovery is not None:
        own = (vectors - R @ vectors[clamped.b[:6]] for vectors in (Phi, x))
        spans = Spans(next(own), np.sqrt(w2) / (2 * np.pi), next(own), R[:, :0])
    W = W - R @ W[clamped.b[:6]]  # the root's DOFs are its rigid-body motion
    attached = [f"unit load {d} on interface {frame.name}" for frame in model.interfaces for d in DIRECTIONS]
    return reduced("free_interface", clamped, W, candidates.with_rows(ATTACHMENT, attached), notes, spans=spans)


def _elastic_modes(
    clamped: Clamped, R: np.ndarray, modes: int, solver: str, algebra: Algebra
) -> tuple[np.ndarray, np.ndarray, str]:
    """Return the lowest elastic modes of the free body, and how they were counted."""
    _refuse_line(R.T @ (clamped.M @ R))
    x = clamped.static_free(clamped.M @ R)
    softest = np.min(np.einsum("ij,ij->j", x, clamped.K @ x) / np.einsum("ij,ij->j", x, clamped.M @ x))
    w2, Phi, counted = algebra.lowest_modes(
        clamped.K.tocsr(), clamped.M.tocsr(), modes + 6, shift=-softest, solver=solver
    )
    elastic = np.abs(w2) > RIGID * softest
    if np.sum(~elastic) != 6:
        raise MechanismError(
            f"the floating body has {np.sum(~elastic)} rigid-body motions, not six; connect its loose parts"
        )
    return w2[elastic], Phi[:, elastic], counted


def _relieved(clamped: Clamped, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit loads on every interface, moments times the body's size, with inertia relief, and the answers to them.

    Both ``(n_free, 6 n_if)``; the answers do no work on the rigid motions' inertia.
    """
    model = clamped.model
    F = model.C.T @ unit_loads(model, [frame.dofs for frame in model.interfaces])
    F = F * np.tile(np.repeat([1.0, model_size(model)], 3), len(model.interfaces))
    MR = clamped.M @ R
    F = F - MR @ np.linalg.solve(R.T @ MR, R.T @ F)
    x = clamped.static_free(F)
    return F, x - R @ np.linalg.solve(R.T @ MR, MR.T @ x)


def _recovered(
    clamped: Clamped, w2, Phi, F, x, recovery: ModelRecovery | None, keep: str | list[int]
) -> dict[str, list[Share]] | None:
    """Return the shares of the modes in the recoveries but accelerations; None where `keep` does not use them."""
    if recovery is None or not recoveries_named(keep)[0]:
        return None
    some = {name: quantity for name, quantity in recovery.quantities.items() if quantity.kind != ACCELERATION}
    return recovery_shares(ModelRecovery(recovery.wanted, some), floating_loads(clamped, w2, Phi, F, x))


def _candidates(
    model: FEModel, w2: np.ndarray, Phi: np.ndarray, keep: str | list[int], static, recovered: dict | None
) -> ModeTable:
    frequency = np.sqrt(w2) / (2 * np.pi)
    n = len(w2)
    shares = interface_shares(free_coupling(model, Phi), w2)
    kept, reason = select(keep, frequency, None, static, *shares, recovered)
    return ModeTable(
        kind=(FREE,) * n,
        frequency=frequency,
        effective_mass=np.zeros((n, 6)),
        total=rigid_totals(model),
        kept=kept,
        reason=reason,
    )


@told
@one_numpy_thread(beside_mkl=True)
def improved_guyan(model: FEModel, *, solver: str = "auto", algebra: Algebra = DIRECT) -> Reduction:
    """Guyan's reduction with the interior's inertia to first order (IRS): same size, better.

    In the body's frame: the root is locked, the other fixed interfaces are the coordinates.

    ``T = [1; Psi + K_ii^-1 (M_ib + M_ii Psi) M_R^-1 K_R]`` with Guyan's ``K_R``, ``M_R``; exact in statics still.

    Returns
    -------
    Reduction
        The basis (n_dof, n), as many vectors as `guyan` has.

    References
    ----------
    J. O'Callahan, A procedure for an improved reduced system (IRS) model, Proc. 7th IMAC (1989) 17.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import guyan
    >>> model = cantilever_model(tip="fixed")
    >>> guyan(model).frequency[0] > improved_guyan(model).frequency[0]
    np.True_
    """
    refuse_no_body("improved_guyan", model)
    clamped = clamp(model, solver, algebra)
    T = np.zeros((clamped.K.shape[0], len(clamped.b)))
    T[clamped.b, np.arange(len(clamped.b))], T[clamped.i] = 1.0, clamped.Psi
    T = T[:, 6:]  # the root is clamped
    reduced_K, reduced_M = T.T @ (clamped.K @ T), T.T @ (clamped.M @ T)
    T[clamped.i] += clamped.factor.solve((clamped.M @ T)[clamped.i] @ _accelerations(reduced_M, reduced_K))
    return reduced("irs", clamped, T, with_constraint_modes(ModeTable.empty(rigid_totals(model)), model), ())


def _refuse_line(inertia: np.ndarray) -> None:
    """Refuse a rigid inertia ``(6, 6)`` without resistance to some rotation: the free body has no frequency there."""
    size = np.sqrt(np.diag(inertia))
    if not size.all() or np.linalg.eigvalsh(inertia / size / size[:, None])[0] < LINE:
        raise InputError(
            "the free body has no inertia about a line, such as a straight beam of lumped mass about its axis; "
            "use mass = 'coupled', or a basis with its interfaces held"
        )


def _accelerations(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return ``M^-1 K`` (k, k); directions without mass, as lumped masses leave them, have none."""
    diagonal = np.diag(M)
    size = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    return size[:, None] * (np.linalg.pinv(M * size * size[:, None], rcond=1e-14, hermitian=True) @ (size[:, None] * K))
