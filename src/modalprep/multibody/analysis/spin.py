"""Vibration of a modal body about a steady spin: the linearised equations, from the modal file alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import steady_mass
from modalprep.records import Record
from modalprep.suggest import refuse_other
from modalprep.vectors import skew


@dataclass(frozen=True, eq=False, kw_only=True)
class SpinModes(Record):
    """Vibration about a steady spin.

    Attributes
    ----------
    frequency : (n,)
        Hz, ascending.
    q0 : (n,)
        The steady modal deflection.
    """

    frequency: np.ndarray
    q0: np.ndarray


def spin_modes(body: FlexibleBody, spin: np.ndarray, acceleration: np.ndarray | None = None) -> SpinModes:
    """Return the vibration of a body whose root rotates steadily.

    ``M q'' + (2 w~_ab P_ab + D) q' + [K + W_ab (P_ab + Kg_W_ab) + A_a Kg_A_a] q = -(S_a A_a + W_ab H_ab)`` with
    ``W = w~ w~``: theory 4 with constant A and w, and M the modal mass, of a body with T that of the steady deflection.
    Other effects of that deflection are of second order in it, of fourth order in the spin: `linearise` and
    `system_modes` include them. A complex pair counts once; an unstable real pair has frequency 0.

    Parameters
    ----------
    spin : (3,)
        rad/s in the body frame.
    acceleration : (3,)
        Steady specific acceleration A of the root in the body frame, m/s^2.

    Returns
    -------
    SpinModes
        Frequencies (Hz), and the steady deflection.

    References
    ----------
    Theory 4.4.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=4)
    >>> still, spinning = (spin_modes(body, np.array([0, 0, w])) for w in (0.0, 6.0))
    >>> bool(np.allclose(still.frequency, body.frequency)), bool(spinning.frequency[0] > still.frequency[0])
    (True, True)
    """
    refuse_other("spin_modes: the body", FlexibleBody, body)
    A = np.zeros(3) if acceleration is None else np.asarray(acceleration, dtype=float)
    w = skew(np.asarray(spin, dtype=float))
    W = w @ w
    stiffness = np.diag(body.K) + np.einsum("ab,abij->ij", W, body.P + body.Kg_W) + np.einsum("a,aij->ij", A, body.Kg_A)
    gyroscopic = 2 * np.einsum("ab,abij->ij", w, body.P) + body.damping_matrix
    load = np.einsum("an,a->n", body.S, A) + np.einsum("ab,abn->n", W, body.H)
    q0 = -np.linalg.solve(stiffness, load)
    n = body.n
    M = steady_mass(body, q0)
    stiffness = np.linalg.solve(M, stiffness)
    gyroscopic = np.linalg.solve(M, gyroscopic)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -gyroscopic]])
    roots = eigvals(state)
    return SpinModes(frequency=np.sort(np.abs(roots.imag))[::2] / (2 * np.pi), q0=q0)
