"""Modal assurance criterion (MAC) of a body's own modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.correlation import criteria
from modalprep.errors import InputError
from modalprep.report.scene.motion import largest_displacement
from modalprep.report.tables import hertz

SHOWN = 60  # maximum number of modes in the matrix
WRITTEN = 16  # maximum number of modes with values written in the cells
LOW, HIGH = np.array([255, 255, 255]), np.array([0, 72, 128])  # colours of 0 and 1


def auto_mac(shape: np.ndarray, nodal_mass: np.ndarray | None = None) -> np.ndarray:
    """Return ``MAC_ij = (phi_i . phi_j)^2 / ((phi_i . phi_i) (phi_j . phi_j))`` of nodal shapes.

    Parameters
    ----------
    shape : (n_points, 3, n)
    nodal_mass : (n_points,), optional
        Weights of the nodes; default: equal weights.

    Returns
    -------
    (n, n); zero for modes without nodal displacement.

    Examples
    --------
    >>> shape = np.zeros((2, 3, 2))
    >>> shape[:, 0] = [[1, 1], [1, 0]]
    >>> auto_mac(shape).round(2)
    array([[1. , 0.5],
           [0.5, 1. ]])
    """
    rows = np.where(largest_displacement(shape) > 0, shape, 0.0).reshape(-1, shape.shape[2])
    if nodal_mass is not None:
        rows = np.sqrt(np.repeat(_checked(nodal_mass, shape), 3))[:, None] * rows
    return criteria.mac(rows, rows)


def _checked(nodal_mass: np.ndarray, shape: np.ndarray) -> np.ndarray:
    weight = np.asarray(nodal_mass, dtype=float)
    if weight.shape != (len(shape),) or not (weight >= 0).all():
        raise InputError(f"nodal_mass must hold one mass >= 0 for each of the {len(shape)} nodes of the mesh")
    return weight


def mac_chart(body: FlexibleBody, nodal_mass: np.ndarray | None = None) -> dict[str, Any] | None:
    """Return the data of the matrix for the page; None with fewer than two modes.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> chart = mac_chart(uniform_beam(modes=2))
    >>> chart["count"], len(chart["squares"]), chart["largest"]  # bending in y and in z
    (2, 2, [])
    """
    count = min(body.n, SHOWN)
    if count < 2:
        return None
    mac = auto_mac(body.shape[:, :, :count], nodal_mass)
    rows, columns = np.nonzero(mac >= 0.005)
    return {
        "count": count,
        "of": body.n,
        "weighted": nodal_mass is not None,
        "squares": [_square(i, j, mac[i, j], count) for i, j in zip(rows.tolist(), columns.tolist(), strict=True)],
        "values": [[round(float(value), 3) for value in row] for row in mac],
        "frequencies": [hertz(f) for f in body.frequency[:count]],
        "largest": _most_similar(mac),
    }


def _square(i: int, j: int, value: float, count: int) -> dict[str, Any]:
    red, green, blue = np.rint(LOW + value * (HIGH - LOW)).astype(int)
    text = f"{value:.2f}" if count <= WRITTEN else ""
    ink = "white" if value > 0.5 else "#1d2733"
    return {"x": j, "y": i, "fill": f"#{red:02x}{green:02x}{blue:02x}", "text": text, "ink": ink}


def _most_similar(mac: np.ndarray) -> list[tuple[int, int, str]]:
    """Return the three pairs of different modes with the largest MAC above 0.1, as (mode, mode, value)."""
    i, j = np.tril_indices(len(mac), -1)
    best = np.argsort(-mac[i, j], kind="stable")[:3]
    return [(int(j[k]) + 1, int(i[k]) + 1, f"{mac[i[k], j[k]]:.2f}") for k in best if mac[i[k], j[k]] >= 0.1]
