"""Participation factors of the modes of a body, whose squares are effective masses, and what they sum up to."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import cross_moment, rigid_mass_matrix


def participation(body: FlexibleBody) -> np.ndarray:
    """Return the participation factors of the modes in unit accelerations of the root.

    Returns
    -------
    (n, 6) float
        kg^(1/2) of x, y, z and kg^(1/2) m of rotations about the root; their squares are the effective masses.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> (participation(uniform_beam(modes=1)) ** 2).round(3)[0, 1]  # 61.3 % of 12 kg
    np.float64(7.357)
    """
    return np.concatenate([body.S, cross_moment(body.H)]).T


def totals(body: FlexibleBody) -> np.ndarray:
    """Return mass (kg) and moments of inertia about the root (kg m^2) of a body ``(6,)``."""
    return np.diag(rigid_mass_matrix(body.m, body.s0, body.E0)).copy()
