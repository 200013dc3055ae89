"""Drilling rotations that yield where eccentric beams stand on a flat shell (theory 7.4).

The section of a beam at a distance e from a plate that twists by ``tx = k x`` moves sideways by ``e k x``: it turns
about the normal of the plate by ``e k``, while its membrane does not turn at all. A rigid arm that ties the beam to the
drilling rotation of the membrane would shear one of them. At these nodes the membrane therefore takes its own rotation
in place of nearly all of the nodal one, ``s tz + (1 - s) (v,x - u,y)/2``, and leaves the nodal rotation to the beam.
"""

from __future__ import annotations

import numpy as np

from modalprep.fe.elements.shells.flat_fields import TZ, FlatCells
from modalprep.fe.mesh.reference_cells import NODES

HELD = 0.03  # s: a tenth already is within 2 % of none, whose nodal rotations nothing but the beam would hold
LEAST = 1e-6  # of the size of an element: a shorter arm is none


def yielding_nodes(arm: np.ndarray, normal: np.ndarray, offset: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Return at which nodes (ne, n) the drilling rotation yields.

    Parameters
    ----------
    arm : (ne, n, 3)
        From the nodes to the beams on them, m; not a number where there is none.
    normal : (ne, 3)
    offset : (ne,)
        From the nodes to the mid-surface of the shell, m.
    xy : (ne, n, 2)
        Nodes in the plane, m.

    Examples
    --------
    >>> arm = np.array([[[0.0, 0, -0.02], [0.03, 0, 0], [np.nan] * 3]])
    >>> xy = np.array([[[0.0, 0], [1, 0], [0, 1]]])
    >>> yielding_nodes(arm, np.array([[0, 0, 1.0]]), np.zeros(1), xy)
    array([[ True, False, False]])
    """
    size = np.ptp(xy, axis=1).max(axis=1)
    height = np.einsum("ena,ea->en", arm, normal) - offset[:, None]
    return np.abs(height) > LEAST * size[:, None]


def yielding_map(kind: str, xy: np.ndarray, yields: np.ndarray) -> np.ndarray:
    """Return the DOFs ``(ne, 6n, 6n)`` that the shell feels per local DOF, for nodes that `yields (ne, n)`.

    Examples
    --------
    >>> xy, turned = np.array([[[0.0, 0], [1, 0], [0, 1]]]), np.zeros(18)
    >>> turned[[6 + 1, 12 + 0]] = 1.0, -1.0  # v of the second node, u of the third: a rotation by 1
    >>> (yielding_map("triangle", xy, np.array([[True, False, False]])) @ turned)[0, [5, 11, 17]]
    array([0.97, 0.  , 0.  ])
    """
    grad = FlatCells(kind, xy, NODES).mapped[0]
    ne, n = yields.shape
    held = np.where(yields, HELD, 1.0)
    T = np.zeros((ne, n, 6, n, 6))
    for i in range(n):
        T[:, i, range(6), i, range(6)] = 1.0
        T[:, i, TZ, i, TZ] = held[:, i]
        own = (1.0 - held[:, i, None]) / 2
        T[:, i, TZ, :, 0] = -own * grad[:, i, :, 1]
        T[:, i, TZ, :, 1] = own * grad[:, i, :, 0]
    return T.reshape(ne, 6 * n, 6 * n)
