"""Spatial vectors (linear, angular) in the axes of moving frames, at their origins (Featherstone 2008, chapter 2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.vectors import skew


class Tangents(NamedTuple):
    """Forces of inverse dynamics (nu,), and their derivatives (nu, nu) by accelerations, speeds and coordinates.

    `size` (nu,) and `stiffness` (nu, nu) are sums of the absolute values of what makes forces and K: for round-off;
    `stiffness` is 0 where no element acts.
    """

    force: np.ndarray
    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    size: np.ndarray
    stiffness: np.ndarray | float


def shift(R: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Return X (6, 6), which takes twists to a frame at r with rotation R (3, 3), its axes to these.

    Examples
    --------
    >>> shift(np.eye(3), np.array([2.0, 0, 0])) @ [0, 0, 0, 0, 0, 1.0]
    array([0., 2., 0., 0., 0., 1.])
    """
    X = np.zeros((6, 6))
    X[:3, :3] = X[3:, 3:] = R.T
    X[:3, 3:] = -R.T @ skew(r)
    return X


def motion_cross(V: np.ndarray) -> np.ndarray:
    """Return ``V x`` (6, 6): what turning with the twist V does to the components of a twist.

    Examples
    --------
    >>> motion_cross(np.array([0, 0, 0, 0, 0, 1.0])) @ [1.0, 0, 0, 0, 0, 0]
    array([0., 1., 0., 0., 0., 0.])
    """
    found = np.zeros((6, 6))
    found[:3, :3] = found[3:, 3:] = skew(V[3:])
    found[:3, 3:] = skew(V[:3])
    return found


def turned_wrench(w: np.ndarray) -> np.ndarray:
    """Return the change (6, 6) of a wrench, given in fixed axes at a fixed point, when its frame moves by a twist.

    Force and torque are those of a wrench that moves with its frame: by a displacement d and a rotation x
    ``x cross f`` and ``x cross t + d cross f``.

    Examples
    --------
    >>> turned_wrench(np.array([1.0, 0, 0, 0, 0, 0])) @ [0, 1.0, 0, 0, 0, 0]
    array([ 0.,  0.,  0.,  0.,  0., -1.])
    """
    found = np.zeros((6, 6))
    found[:3, 3:] = found[3:, :3] = -skew(w[:3])
    found[3:, 3:] = -skew(w[3:])
    return found
