"""Recovery matrices from a model and its reduction, by mode displacement or mode acceleration (theory 4.9)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.body.recovery import ACCELERATION, DISPLACEMENT, DRIVES, Recovery
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.fields import Fields, Quantity
from modalprep.fe.recovery.recover import ModelRecovery, Recover
from modalprep.reduction.basis import Reduction
from modalprep.reduction.dropped import dropped_modes


def recovery_matrices(model: FEModel, reduction: Reduction, recovery: ModelRecovery) -> dict[str, Recovery]:
    """Return the recovery matrices of every quantity in the coordinates of a reduction.

    References
    ----------
    Theory 4.9.
    """
    if not recovery.wanted:
        return {}
    strained = np.where(reduction.frequency > 0, reduction.basis, 0.0)
    everything = None
    found = {}
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
    dropped = dropped_modes(reduction)
    n = strained.shape[1]
    u = np.hstack([strained, -dropped.to_inertia, dropped.to_loads])
    a = np.zeros_like(u)
    drives = np.zeros((DRIVES, u.shape[1]))
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


def recovery_in_frame(
    recovery: Mapping[str, Recovery], provenance: Mapping[str, str], a: np.ndarray, Y: np.ndarray
) -> dict[str, dict]:
    """Return the recoveries and the provenance of a body in a frame that follows the deformation.

    Displacements are relative to the former frame; they are left out, and the provenance says so.

    Parameters
    ----------
    a : (6, n)
        Rigid motion of the former frame in the new one for each modal coordinate.
    Y : (n, m)
        The new modes.

    Returns
    -------
    dict
        ``recovery`` and ``provenance``.

    Examples
    --------
    >>> at = Recovery(kind="displacement", places=("7",), components=("x",), units=("m",), q=np.ones((1, 1, 1)))
    >>> recovery_in_frame({"feet": at}, {}, np.zeros((6, 1)), np.eye(1))["provenance"]
    {'recoveries left out': 'feet: displacements relative to another frame'}
    """
    kept = {key: x.following(a).in_basis(Y) for key, x in recovery.items() if x.strained}
    lost = ", ".join(key for key in recovery if key not in kept)
    said = {"recoveries left out": f"{lost}: displacements relative to another frame"} if lost else {}
    return {"recovery": kept, "provenance": {**provenance, **said}}
