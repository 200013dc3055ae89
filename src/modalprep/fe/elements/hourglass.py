"""Motions of hexahedra of 20 nodes that 2 x 2 x 2 points do not see, and the stiffness that holds them (theory 7.5)."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cells import CELLS

FACES = np.array([CELLS["hexahedron20"].face(k)[1] for k in range(6)])  # (6, 8): corners around, then middles of sides
_XI = np.array([-1, 1, 1, -1, 0, 1, 0, -1])  # of the nodes of a face
_ETA = np.array([-1, -1, 1, 1, -1, 0, 1, 0])
ROUND_OFF = 1e-9  # of the size of a face: out of its plane


def hourglass_stiffness(x: np.ndarray, share: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the stiffness ``(ne, 60, 60)`` against the hourglass motion of single faces.

    Each motion gets one, of rank one: it fixes what no point sees, and changes nothing else.

    Parameters
    ----------
    x : (ne, 20, 3)
        Nodes.
    share : (ne, 6)
        Of the stiffness of each face: 1 where no other element has it, 1/2 where two have, 0 where others hold it.
    size : (ne,)
        Stiffness of one node, N/m.

    Examples
    --------
    >>> x = CELLS["hexahedron20"].node_coordinates()[None]
    >>> K = hourglass_stiffness(x, np.ones((1, 6)), np.ones(1))[0]
    >>> int(np.linalg.matrix_rank(K)), bool(abs(K @ x.ravel()).max() < 1e-12)
    (6, True)
    """
    motion = hourglass_motions(x)
    return np.einsum("e,ek,eki,ekj->eij", size, share, motion, motion, optimize=True)


def hourglass_motions(x: np.ndarray) -> np.ndarray:
    """Return the unit hourglass motion of each face, ``(ne, 6, 60)`` of nodes ``x (ne, 20, 3)``."""
    motion = np.zeros((len(x), 6, 20, 3))
    for k, nodes in enumerate(FACES):
        motion[:, k, nodes] = _motion(x[:, nodes])
    return motion.reshape(len(x), 6, 60)


def _motion(x: np.ndarray) -> np.ndarray:
    """Return the unit hourglass motion ``(ne, 8, 3)`` in the plane of faces ``x (ne, 8, 3)``, free of linear fields.

    In covariant components it is ``xi (1 - 3 eta^2), -eta (1 - 3 xi^2)``: no strain at the 2 x 2 points of the face.
    """
    first = _XI * (1 - 3 * _ETA**2)
    second = _ETA * (1 - 3 * _XI**2)
    sides = np.stack([_XI[:4], _ETA[:4]]) @ x[:, :4]
    along = np.linalg.pinv(sides)  # (ne, 3, 2): contravariant base
    u = np.einsum("i,ea->eia", first, along[:, :, 0]) - np.einsum("i,ea->eia", second, along[:, :, 1])
    centred = x - x.mean(axis=1, keepdims=True)
    centred /= np.abs(centred).max(axis=(1, 2), keepdims=True)
    fields = np.concatenate([np.ones((len(x), 8, 1)), centred], axis=2)
    u -= fields @ (np.linalg.pinv(fields, rcond=ROUND_OFF) @ u)
    return u / np.linalg.norm(u, axis=(1, 2), keepdims=True)
