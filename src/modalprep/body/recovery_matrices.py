"""Recovery matrices from a model and its reduction, by mode displacement or mode acceleration (theory 4.9)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.recovery import ACCELERATION, DISPLACEMENT, DRIVES, Recovery
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.fields import Fields, Quantity
from modalprep.fe.recovery.recover import ModelRecovery, Recover
from modalprep.linalg.blas import inner, subtract
from modalprep.reduction.basis import Reduction


class DroppedModes(NamedTuple):
    """Static response of the modes that a basis has not, to unit loads and to unit modal accelerations.

    Attributes
    ----------
    to_loads : (n_dof, 12 + 6 n_if)
        The full static response less that of the basis.
    to_inertia : (n_dof, n)
        The same under ``M basis``.
    """

    to_loads: np.ndarray
    to_inertia: np.ndarray


def dropped_modes(reduction: Reduction) -> DroppedModes:
    """Return the static response of the dropped modes: that of the model less ``Phi K^-1 Phi^T`` of the kept ones.

    References
    ----------
    Theory 4.9.
    """
    stiff = reduction.frequency > 0
    Phi, K = reduction.basis[:, stiff], (2 * np.pi * reduction.frequency[stiff]) ** 2
    kept = np.zeros((int(stiff.sum()), reduction.basis.shape[1]))
    kept[np.arange(len(K)), np.flatnonzero(stiff)] = 1 / K
    return DroppedModes(
        subtract(reduction.static, Phi, inner(Phi, reduction.loads) / K[:, None]),
        subtract(reduction.inertial, Phi, kept),
    )


def recovery_matrices(model: FEModel, reduction: Reduction, recovery: ModelRecovery) -> dict[str, Recovery]:
    """Return the recovery matrices of every quantity in the coordinates of a reduction.

    References
    ----------
    Theory 4.9.
    """
    if not recovery.wanted:
        return {}
    strained = np.where(reduction.frequency > 0, reduction.basis, 0.0)
    everything, found = None, {}
    for name, quantity in recovery.quantities.items():
        wanted = recovery.wanted[name]
        if wanted.method == "displacement" and quantity.kind != ACCELERATION:
            modes = reduction.basis if quantity.kind == DISPLACEMENT else strained
            found[name] = _block(quantity, wanted, {"q": quantity.values(Fields.static(modes))})
            continue
        if everything is None:
            everything = _all_fields(reduction, strained)
        q, qdd, loads = np.split(quantity.values(everything), np.cumsum([reduction.basis.shape[1]] * 2), axis=2)
        if quantity.kind == DISPLACEMENT:  # mechanisms move the nodes without strain
            q = quantity.values(Fields.static(reduction.basis))
        found[name] = _block(quantity, wanted, {"q": q, "qdd": qdd, "loads": loads})
    return found


def _all_fields(reduction: Reduction, strained: np.ndarray) -> Fields:
    """Return the fields of unit coordinates, unit modal accelerations, and unit A, W and interface loads."""
    dropped, n = dropped_modes(reduction), strained.shape[1]
    u = np.hstack([strained, -dropped.to_inertia, dropped.to_loads])
    a, drives = np.zeros_like(u), np.zeros((DRIVES, u.shape[1]))
    a[:, n : 2 * n] = reduction.basis
    drives[:, 2 * n : 2 * n + DRIVES] = np.eye(DRIVES)
    return Fields(u, a, drives)


def _block(quantity: Quantity, wanted: Recover, matrices: dict[str, np.ndarray]) -> Recovery:
    return Recovery(
        kind=quantity.kind,
        places=quantity.places,
        components=quantity.components,
        units=quantity.units,
        position=quantity.position,
        node=quantity.node,
        cell=quantity.cell,
        allowable=wanted.allowable,
        **matrices,
    )
