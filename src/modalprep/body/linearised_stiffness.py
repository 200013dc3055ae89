"""Geometric stiffness linearised about one steady motion."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import steady_mass
from modalprep.errors import InputError
from modalprep.reduction.dampers import damping_in_basis
from modalprep.vectors import skew


def linearised_geometric_stiffness(
    body: FlexibleBody, spin: np.ndarray, acceleration: np.ndarray | None = None
) -> FlexibleBody:
    """Return the body with the geometric stiffness linearised about one steady motion, included in new modes.

    ``K + W_ab Kg_W_ab + A_a Kg_A_a`` with ``W = w~ w~`` of that motion is diagonalised to new modes; the geometric
    stiffness itself is dropped, as is T except for the modal mass at the steady deflection. At that motion, but not at
    others, the frequencies are those of the full body. Damping is the diagonal of the old one in the new modes, with
    dampers between modes the whole.

    Parameters
    ----------
    spin : (3,)
        rad/s in the body frame.
    acceleration : (3,)
        Specific acceleration of the root in the body frame, m/s^2.

    Returns
    -------
    FlexibleBody
        In the modes under that motion, with constant stiffness.

    Raises
    ------
    InputError
        When the body buckles under the motion.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 6; theory 4.4 and 4.7.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.analysis.spin import spin_modes
    >>> body, spin = uniform_beam(modes=4), np.array([0, 0, 6.0])
    >>> linearised = linearised_geometric_stiffness(body, spin)
    >>> bool(np.allclose(spin_modes(linearised, spin).frequency, spin_modes(body, spin).frequency))
    True
    """
    w = skew(np.asarray(spin, dtype=float))
    A = np.zeros(3) if acceleration is None else np.asarray(acceleration, dtype=float)
    Kg = np.einsum("ab,abij->ij", w @ w, body.Kg_W) + np.einsum("a,aij->ij", A, body.Kg_A)
    load = np.einsum("an,a->n", body.S, A) + np.einsum("ab,abn->n", w @ w, body.H)
    q0 = -np.linalg.solve(np.diag(body.K) + Kg + np.einsum("ab,abij->ij", w @ w, body.P), load)
    K, Y = eigh(np.diag(body.K) + (Kg + Kg.T) / 2, steady_mass(body, q0))
    if not np.all(K > 0):
        raise InputError(f"body {body.name!r} buckles under this motion; its stiffness cannot be linearised about it")
    plain = body.conventional()
    changed = {name: getattr(plain, name) @ Y for name in ("S", "H", "phi", "psi", "shape")}
    return plain.with_(
        **changed,
        P=Y.T @ body.P @ Y,
        K=K,
        **damping_in_basis(body, Y),
        frequency=np.sqrt(K) / (2 * np.pi),
        stress={name: at.in_basis(Y) for name, at in body.stress.items()},
        recovery={name: block.in_basis(Y) for name, block in body.recovery.items()},
    )
