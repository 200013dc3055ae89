"""Moments of the modes of a body of which only the mass matrix on its boundary is known (theory 10).

The rigid motions R give ``M R``: mass, first moment, inertia, and for each mode its momentum and its moment of momentum
about the origin. They are exact. Of a mode's moments ``H_ab = int rho x_b phi_a`` they leave the six symmetric ones
open, of its mass tensor P everything but the sum ``P_11 + P_22 + P_33``.

In the four functions of mass.py, orthonormal in the mass, a mode has the coordinates B (3, 4) and the body at rest the
coordinates (centre, F) with ``F F^T = E_c``. The momentum fixes the part of B that is a rigid motion,
``[S / sqrt(m), w~ F]`` with ``J_c w = C_c``; the part orthogonal to it, a homogeneous strain, is taken from what M says
about the boundary nodes (fe/assembly/matrix_mass.py), as far as the mode's kinetic energy allows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.mass import FLAT, cross_moment, rigid_mass_matrix
from modalprep.vectors import skew

SKEW = skew(np.eye(3))  # SKEW[c, a, d] r_c x_d = (r x x)_a
SPENT = 1e-9  # of unit modal mass: what is left of a mode that is a rigid motion


class Rigid(NamedTuple):
    """Mass (kg), first moment (3,) kg m and second moment (3, 3) kg m^2 about the origin."""

    m: float
    s0: np.ndarray
    E0: np.ndarray


class Moments(NamedTuple):
    """H (3, 3, n), P (3, 3, n, n) and the mean rotation (3, n) of the modes."""

    H: np.ndarray
    P: np.ndarray
    turn: np.ndarray


class Affine:
    """The affine motions of a body at rest.

    Parameters
    ----------
    rigid : Rigid

    Attributes
    ----------
    centre : (3,)
        Centre of mass, m.
    F : (3, 3)
        ``F F^T`` is the second moment about it; the column of a direction without extent is zero.
    """

    def __init__(self, rigid: Rigid) -> None:
        self.mass = rigid.m
        self.centre = rigid.s0 / rigid.m
        E = rigid.E0 - rigid.m * np.outer(self.centre, self.centre)
        size, axes = np.linalg.eigh(E)
        scale = np.sqrt(np.where(size > FLAT * np.trace(rigid.E0), size, 0.0))
        self.F = axes * scale
        self._inverse = axes * np.divide(1.0, scale, out=np.zeros(3), where=scale > 0)  # F^-T
        self._turn = np.linalg.pinv(rigid_mass_matrix(1.0, np.zeros(3), E)[3:, 3:], rcond=FLAT, hermitian=True)

    def turn(self, S: np.ndarray, C: np.ndarray) -> np.ndarray:
        """Return the mean rotation (3, n) of fields with ``int rho u (3, n)`` and ``int rho x cross u`` (3, n)."""
        return self._turn @ (C - np.cross(self.centre, S, axis=0))

    def rigid_coordinates(self, S: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """Return the coordinates (3, 4, n) of the rigid part of such fields."""
        return np.concatenate([(S / np.sqrt(self.mass))[:, None], self._turned(turn)], axis=1)

    def strain(self, S: np.ndarray, H: np.ndarray) -> np.ndarray:
        """Return the homogeneous strain (3, 3, n) of fields with ``int rho u`` and ``int rho x_b u_a (3, 3, n)``."""
        about = H - np.einsum("an,b->abn", S, self.centre)
        return np.einsum("abn,br->arn", about, self._inverse) - self._turned(self._turn @ cross_moment(about))

    def _turned(self, turn: np.ndarray) -> np.ndarray:
        return np.einsum("cad,cn,dr->arn", SKEW, turn, self.F)


def moments(rigid: Rigid, S: np.ndarray, C: np.ndarray, strain: np.ndarray) -> Moments:
    """Return H, P and mean rotation of modes with unit modal mass.

    Parameters
    ----------
    S, C : (3, n)
        ``int rho phi`` and ``int rho x cross phi`` about the origin.
    strain : (3, 3, n)
        An estimate of the homogeneous strain of the modes (`Affine.strain`).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=3)
    >>> known = Rigid(beam.m, beam.s0, beam.E0)
    >>> found = moments(known, beam.S, cross_moment(beam.H), Affine(known).strain(beam.S, beam.H))
    >>> bool(np.allclose(found.H, beam.H)), round(float(np.trace(found.P[:, :, 0, 0])), 9)
    (True, 1.0)
    """
    affine = Affine(rigid)
    turn = affine.turn(S, C)
    first = affine.rigid_coordinates(S, turn)
    first[:, 1:] += _affordable(strain, first)
    H = np.einsum("arn,br->abn", first[:, 1:], affine.F) + np.einsum("an,b->abn", S, affine.centre)
    return Moments(H, _mass_tensor(first), turn)


def _affordable(strain: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Return the strain (3, 3, n) with no more kinetic energy than the rigid part leaves to any combination."""
    n = strain.shape[-1]
    left, V = np.linalg.eigh(np.eye(n) - np.einsum("ari,arj->ij", total, total))
    root = np.sqrt(np.where(left > SPENT, left, 0.0))
    inverse = np.divide(1.0, root, out=np.zeros(n), where=root > 0)
    U, share, Wt = np.linalg.svd(strain.reshape(9, n) @ (V * inverse), full_matrices=False)
    return ((U * np.minimum(share, 1.0)) @ Wt @ (V * root).T).reshape(3, 3, n)


def _mass_tensor(first: np.ndarray) -> np.ndarray:
    """Return P (3, 3, n, n): that of the affine motion, and the rest of each mode in the directions of that motion."""
    n = first.shape[-1]
    own = np.einsum("ari,brj->abij", first, first)
    left, V = np.linalg.eigh(np.eye(n) - np.einsum("aaij->ij", own))
    root = (V * np.sqrt(np.maximum(left, 0.0))) @ V.T
    direction = np.einsum("ari,bri->abi", first, first)
    size = np.einsum("aai->i", direction)
    known = size > SPENT
    share = np.where(known, direction / np.where(known, size, 1.0), np.eye(3)[:, :, None] / 3)
    return own + np.einsum("ik,abk,kj->abij", root, share, root, optimize=True)
