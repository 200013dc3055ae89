"""Static derivatives: what the softest shapes of a body change to when it bends (theory 3.10).

A body that bends by ``phi_i q_i + phi_j q_j`` moves to second order by ``x_ij q_i q_j``, with
``K x_ij = -(Kg(phi_i) phi_j + Kg(phi_j) phi_i) / 2``, Kg of the stress of a shape. As vectors of the basis they let
the body strain along what large deflections need, such as the stretching or twisting of a bar bent in two planes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import inner
from modalprep.linalg.ritz import ritz
from modalprep.linalg.sparse import times
from modalprep.reduction.clamped import Clamped

SHAPES = 6  # the softest, whose products have 21 derivatives
NOISE = 1e-10  # of the largest energy
NEXT = 6  # of the derivatives that are left out, the most important: the others are smaller by decades


class LeftOut(NamedTuple):
    """Derivatives that a basis leaves out: at a displacement d it lacks ``z products[r] z`` of vector r (theory 4.10).

    ``z = shapes^T K d`` are the softest shapes in d.

    Attributes
    ----------
    shapes : (n_dof, k)
        The softest, at unit strain energy.
    products : (m, k, k)
    vectors : (n_dof, m)
    """

    shapes: np.ndarray
    products: np.ndarray
    vectors: np.ndarray


class Derivatives(NamedTuple):
    """Loads and responses (n_i, k) that span the most important derivatives, and those that are left out."""

    force: np.ndarray
    answer: np.ndarray
    left_out: LeftOut


def derivative_loads(clamped: Clamped, W: np.ndarray, kept: np.ndarray, w2: np.ndarray, count: int) -> Derivatives:
    """Return loads and responses whose span are the `count` most important derivatives, and what that leaves out.

    Parameters
    ----------
    W : (n_free, m)
        The basis so far, whose softest shapes are bent.
    kept, w2 : (n_i, n), (n,)
        Its fixed-interface vectors and their squared frequencies, to which the responses are made orthogonal.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.clamped import clamp
    >>> clamped = clamp(cantilever_model(tip="fixed"))
    >>> found = derivative_loads(clamped, clamped.constraint_shapes, np.zeros((54, 0)), np.zeros(0), 2)
    >>> found.force.shape, bool(np.allclose(clamped.K_ii @ found.answer, found.force))
    ((54, 2), True)
    """
    shapes = times(clamped.model.C, softest(clamped, W))
    force = (clamped.model.C.T @ _loads(clamped.model, shapes))[clamped.i]
    answer = clamped.interior_response(force)
    rest = answer - kept @ (inner(kept, force) / w2[:, None])
    energy = inner(rest, times(clamped.K_ii, rest))
    size, Y = np.linalg.eigh((energy + energy.T) / 2)
    order = np.argsort(size)[::-1]
    order = order[size[order] > NOISE * size.max(initial=0.0)]
    own, others = order[:count], order[count : count + NEXT]
    left = times(clamped.model.C, clamped.expand(rest @ Y[:, others]))
    combined = Y[:, own] / np.sqrt(size[own])
    return Derivatives(
        force @ combined, answer @ combined, LeftOut(shapes, _products(Y[:, others], shapes.shape[1]), left)
    )


def _products(Y: np.ndarray, k: int) -> np.ndarray:
    """Return the combinations ``Y (k (k + 1) / 2, m)`` of pairs as symmetric matrices (m, k, k)."""
    found = np.zeros((Y.shape[1], k, k))
    for row, (i, j) in zip(Y, _pairs(k), strict=True):
        found[:, i, j] = found[:, j, i] = row
    return found


def _pairs(k: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(k) for j in range(i, k)]


def softest(clamped: Clamped, W: np.ndarray) -> np.ndarray:
    """Return the softest shapes (n_free, k) of a span at unit strain energy, k at most `SHAPES`."""
    w2, V = ritz(W, clamped.K, clamped.M)
    strained = w2 > NOISE * w2.max(initial=0.0)
    return V[:, strained][:, :SHAPES] / np.sqrt(w2[strained][:SHAPES])


def _loads(model: FEModel, shapes: np.ndarray) -> np.ndarray:
    """Return ``-(Kg_i phi_j + Kg_j phi_i) / 2`` of all pairs (n_dof, k (k + 1) / 2)."""
    forces = [model.geometric_stiffness(d, model.K @ d) @ shapes for d in shapes.T]
    pairs = _pairs(shapes.shape[1])
    return np.reshape([-(forces[i][:, j] + forces[j][:, i]) / 2 for i, j in pairs], (-1, model.n_dof)).T
