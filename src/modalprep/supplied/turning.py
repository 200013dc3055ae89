"""Geometric stiffness of a body of which nothing but its mean rotation is known (theory 10).

A mode moves the body as a whole, by the rotation of its mean axes, and deforms it. The second-order displacement of a
rotation is that of geometry; the one that the deformation causes (stress stiffness) is not known and left out. With
``theta = turn q`` of the mean axes relative to the root

    u2 = theta x (phi q) - theta x (theta x x) / 2

so that a body on a soft mounting, or a hinged one, stiffens as a rigid body does, whose moments these are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.supplied.integrals import SKEW, Rigid


class GeometricStiffness(NamedTuple):
    """The arrays of `FlexibleBody`."""

    Kg_A: np.ndarray
    Kg_W: np.ndarray
    Kg_F: np.ndarray
    Kg_T: np.ndarray


def turning_stiffness(
    rigid: Rigid, turn: np.ndarray, S: np.ndarray, H: np.ndarray, place: np.ndarray, phi: np.ndarray, psi: np.ndarray
) -> GeometricStiffness:
    """Return the geometric stiffness of the mean rotation.

    Parameters
    ----------
    turn : (3, n)
        Rotation of the mean axes per modal coordinate.
    place, phi, psi : (k, 3), (k, 3, n), (k, 3, n)
        Interfaces and their motion.

    Examples
    --------
    >>> rod = Rigid(1.0, np.zeros(3), np.diag([1.0, 0, 0]))  # turned about z
    >>> x, y, z = np.zeros((3, 3, 1))
    >>> turn, H = np.array([[0.0], [0], [1]]), np.zeros((3, 3, 1))
    >>> H[1, 0] = 1.0
    >>> none = np.zeros((0, 3, 1))
    >>> turning_stiffness(rod, turn, np.zeros((3, 1)), H, none[..., 0], none, none).Kg_W[0, 0]
    array([[-1.]])
    """
    B = np.einsum("cad,cn->adn", SKEW, turn)
    S = S - np.einsum("adn,d->an", B, rigid.s0) / 2
    H = H - np.einsum("adn,db->abn", B, rigid.E0) / 2
    phi = phi - np.einsum("adn,kd->kan", B, place) / 2
    return GeometricStiffness(
        _twice(np.einsum("adi,dj->aij", B, S)),
        _twice(np.einsum("adi,dbj->abij", B, H)),
        -_twice(np.einsum("adi,kdj->kaij", B, phi)),
        -_twice(np.einsum("adi,kdj->kaij", B, psi)) / 2,
    )


def _twice(form: np.ndarray) -> np.ndarray:
    return form + np.swapaxes(form, -1, -2)
