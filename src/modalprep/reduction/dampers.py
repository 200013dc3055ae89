"""Modal damping with viscous dampers, which couple the modes (theory 4.11)."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.reduction.table import ModalBody

COUPLED = 1e-12  # relative entry off the diagonal of a damping matrix that couples modes
DIGITS = 1e-9  # the same of matrices of files, to the digits that these have


def damping_fields(own: np.ndarray, dampers: np.ndarray | None = None, least: float = COUPLED) -> dict[str, Any]:
    """Return D and `coupled_damping` of a body with modal damping ``own (n,)`` and `dampers` (n, n), both 1/s.

    What `dampers` have off the diagonal is round-off where no entry is more than a share `least` of the largest on it.

    Examples
    --------
    >>> damping_fields(np.array([0.1, 0.2]), np.array([[1.0, -2.0], [-2.0, 4.0]]))["D"]
    array([1.1, 4.2])
    >>> damping_fields(np.array([0.1, 0.2]))
    {'D': array([0.1, 0.2]), 'coupled_damping': None}
    """
    if dampers is None:
        return {"D": own, "coupled_damping": None}
    C = np.diag(own) + (dampers + dampers.T) / 2
    D = np.diag(C).copy()
    coupled = np.abs(C - np.diag(D)).max(initial=0.0) > least * D.max(initial=0.0)
    return {"D": D, "coupled_damping": C if coupled else None}


def damping_in_basis(body: ModalBody, Y: np.ndarray) -> dict[str, Any]:
    """Return D and `coupled_damping` of a body in other coordinates, ``q = Y y`` with ``Y (n, k)``.

    Without dampers the damping stays one of the modes: the diagonal of ``Y^T D Y``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> damping_in_basis(uniform_beam(modes=2), np.eye(2)[:, :1])["D"].shape
    (1,)
    """
    if body.coupled_damping is None:
        return {"D": np.einsum("ni,n,ni->i", Y, body.D, Y), "coupled_damping": None}
    return damping_fields(np.zeros(Y.shape[1]), Y.T @ body.coupled_damping @ Y)


def coupling_note(coupled: np.ndarray | None) -> tuple[str, ...]:
    """Return what to know of a damping matrix (n, n) that couples the modes; nothing without one.

    Examples
    --------
    >>> coupling_note(np.array([[1.0, 0.5], [0.5, 1.0]]))[0][:41]
    'viscous dampers couple the modes, by up t'
    """
    if coupled is None:
        return ()
    D = np.diag(coupled)
    size = np.sqrt(np.where(D > 0, D, np.inf))
    share = np.abs((coupled - np.diag(D)) / size / size[:, None]).max()
    return (
        f"viscous dampers couple the modes, by up to {share:.2g} of their own damping: responses, motions and files "
        "with damping matrices have the whole matrix, damping ratios of single modes are those of its diagonal",
    )
