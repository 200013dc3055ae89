"""Shares of the groups of a model in the strain and kinetic energy of the modes of its body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array

from modalprep.body.flexible_body import FlexibleBody
from modalprep.fe.assembly.model import FEModel
from modalprep.reduction.basis import Reduction
from modalprep.report.body_page.table import Table

MOST_GROUPS = 16  # with a column of their own; the others are summed
OTHERS = "others"


def energy_tables(model: FEModel, reduction: Reduction, body: FlexibleBody) -> list[Table]:
    """Return the shares of groups and added terms in strain and kinetic energy of each mode, %; none without groups.

    Each share is relative to ``K / 2`` or to ``(2 pi f)^2 / 2`` times the modal mass, so that sums other than 100 %
    show the error of either energy. Modes of 0 Hz have no strain energy.

    Examples
    --------
    >>> from modalprep.body.build import flexible_body
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> reduction = craig_bampton(model, modes=2)
    >>> energy_tables(model, reduction, flexible_body(model, reduction, name="beam"))[1].columns
    ('mode', 'Hz', 'beam', 'sum')
    """
    if model.groups is None or not body.n or not body.energy:
        return []
    added = model.terms
    names = [*model.groups.names, *added]
    with np.errstate(divide="ignore", invalid="ignore"):
        energy = [
            model.groups.summed(body.energy),
            *(quadratic(term.K, reduction.basis) / 2 for term in added.values()),
        ]
        strain = np.where(body.K > 0, np.vstack(energy) / (body.K / 2), np.nan)
    mass = [model.groups.modal_mass(reduction.basis), *(quadratic(term.M, reduction.basis) for term in added.values())]
    kinetic = np.vstack(mass)
    shares = {"strain": strain, "kinetic": kinetic}
    return [_table(name, names, share, body.frequency) for name, share in shares.items()]


def quadratic(A: csr_array | None, Phi: np.ndarray) -> np.ndarray:
    """Return ``phi^T A phi (n,)`` of each column of ``Phi (n_dof, n)``; zero without a matrix.

    Examples
    --------
    >>> quadratic(csr_array(np.diag([1.0, 2.0])), np.array([[1.0], [3.0]]))
    array([19.])
    """
    return np.zeros(Phi.shape[1]) if A is None else np.einsum("ij,ij->j", Phi, A @ Phi)


def _table(name: str, groups: Sequence[str], share: np.ndarray, frequency: np.ndarray) -> Table:
    groups, share = _largest(groups, 100 * share)
    rows = [
        (mode + 1, float(frequency[mode]), *share[:, mode].tolist(), float(share[:, mode].sum()))
        for mode in range(share.shape[1])
    ]
    columns = ("mode", "Hz", *groups, "sum")
    forms = dict.fromkeys(groups, ".1f") | {"sum": ".4f"}
    caption = f"{name.capitalize()} energy of each group and added term in % of that of the mode."
    return Table(name=f"{name}-energy", columns=columns, rows=rows, forms=forms, heat=groups, caption=caption)


def _largest(groups: Sequence[str], share: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Return the groups with the largest shares in their order, and the sum of the others."""
    if len(groups) <= MOST_GROUPS:
        return list(groups), share
    order = np.argsort(-np.nan_to_num(share).max(axis=1), kind="stable")
    largest = np.sort(order[: MOST_GROUPS - 1])
    others = order[MOST_GROUPS - 1 :]
    names = [name for k, name in enumerate(groups) if k in largest]
    return [*names, OTHERS], np.vstack([share[largest], share[others].sum(axis=0)])
