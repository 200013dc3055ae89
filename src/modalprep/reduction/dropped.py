"""Static response of what a basis of a body drops, for its recoveries by mode acceleration (theory 4.9)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

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
    Phi = reduction.basis[:, stiff]
    K = (2 * np.pi * reduction.frequency[stiff]) ** 2
    kept = np.zeros((int(stiff.sum()), reduction.basis.shape[1]))
    kept[np.arange(len(K)), np.flatnonzero(stiff)] = 1 / K
    return DroppedModes(
        subtract(reduction.static, Phi, inner(Phi, reduction.loads) / K[:, None]),
        subtract(reduction.inertial, Phi, kept),
    )


def projected_recovery(body: Any, Y: np.ndarray, w: np.ndarray) -> dict[str, Any]:
    """Return the recoveries of a body in the coordinates p of ``q = Y p``, corrected for the directions that Y drops.

    Those by mode displacement have no correction.

    Parameters
    ----------
    body : ModalBody
    Y : (n, r)
        Of unit modal mass.
    w : (r,)
        Circular frequencies of the coordinates p, rad/s.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> projected_recovery(uniform_beam(modes=2), np.eye(2)[:, :1], np.ones(1))
    {}
    """
    flexibility = dropped_flexibility(body.K, Y, w)
    forces = unit_forces(body)
    found = {}
    for name, old in body.recovery.items():
        new = old.in_basis(Y)
        if old.loads is not None:
            static = old.q @ flexibility
            inertia = static @ (body.modal_mass @ Y)
            qdd = -inertia if new.qdd is None else new.qdd - inertia
            new = new.with_(qdd=qdd, loads=old.loads + static @ forces)
        found[name] = new
    return found


def dropped_flexibility(K: np.ndarray, Y: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return the flexibility ``1 / K - Y / w^2 Y^T (n, n)`` of what a basis drops; mechanisms have none.

    Examples
    --------
    >>> dropped_flexibility(np.array([4.0, 25.0]), np.eye(2)[:, :1], np.array([2.0])).round(12)
    array([[0.  , 0.  ],
           [0.  , 0.04]])
    """
    whole, kept = (np.divide(1.0, k, out=np.zeros_like(k), where=k > 0) for k in (np.array(K), w**2))
    return np.diag(whole) - (Y * kept) @ Y.T


def unit_forces(body: Any) -> np.ndarray:
    """Return the modal forces ``(n, 12 + 6 n_if)`` of unit A, W and loads on the interfaces.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> unit_forces(uniform_beam(modes=2)).shape
    (2, 24)
    """
    at_interfaces = np.concatenate([body.phi, body.psi], axis=1).reshape(-1, body.n)
    return np.concatenate([-body.S, -body.H.reshape(9, -1), at_interfaces]).T


def complete_response(body: Any, block: Any) -> np.ndarray:
    """Return the static values ``Q K^-1 F + L (p, c, 12 + 6 n_if)`` of a recovery under unit A, W and interface loads.

    With the static correction of mode acceleration they are those of the full model, whatever the modes.

    Examples
    --------
    >>> from modalprep.body.recovery import Recovery
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> row = Recovery(kind="force", places=("a",), components=("N",), units=("N",), q=np.ones((1, 1, 2)))
    >>> complete_response(body, row).shape
    (1, 1, 24)
    """
    found = block.q @ dropped_flexibility(body.K, np.zeros((body.n, 0)), np.zeros(0)) @ unit_forces(body)
    return found if block.loads is None else found + block.loads
