"""The mass that no mode moves, because it sits on what is held."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, cg

from modalprep.errors import AccuracyError
from modalprep.fe.assembly.model import FEModel

TOLERANCE = 1e-5  # of the accelerations; the mass, a minimum, is then accurate to its square
STEPS = 5000


def held_mass(model: FEModel) -> np.ndarray:
    """Return the mass (kg) and the moments of inertia (kg m^2) about the root that stay on the held root, ``(6,)``.

    The effective masses of all modes of the model, held at its root and supports, and this mass sum up to the body's:
    ``R^T M R - b^T M_ff^-1 b`` with ``b = C_f^T M R``, R the rigid motions and f the DOFs that are free to move.

    Returns
    -------
    (6,) float
        In x, y, z and about x, y, z through the root interface.

    Raises
    ------
    AccuracyError
        When the iteration does not converge.

    References
    ----------
    Theory 3. A. Girard and N. Roy, Structural Dynamics in Industry (2008), on effective and residual masses.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> held_mass(cantilever_model(elements=4))[0].round(6)  # of 12 kg, of which an element has 3 kg
    np.float64(0.865979)
    """
    R = model.rigid_body()
    f = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    C = model.C.tocsc()[:, f].tocsr()
    M, moving = (C.T.tocsr() @ model.M @ C).tocsr(), R[model.free][f]
    carried, load = model.M @ R, M @ moving
    left = C.T @ carried - load  # on the neighbours of what is held only, so that few steps solve for it
    moved = np.einsum("ij,ij->j", moving, load + 2 * left) + np.einsum("ij,ij->j", left, _solved(M, left))
    return np.maximum(np.einsum("ij,ij->j", R, carried) - moved, 0.0)


def _solved(M: csr_array, b: np.ndarray) -> np.ndarray:
    """Return ``M^-1 b`` by conjugate gradients; M may lack the mass of some DOFs, on which b is zero then."""
    diagonal = M.diagonal()
    scale = np.divide(1.0, diagonal, out=np.ones_like(diagonal), where=diagonal > 0)
    inverse = LinearOperator(M.shape, matvec=lambda x: scale * x.ravel(), dtype=float)
    found = [cg(M, column, rtol=TOLERANCE, M=inverse, maxiter=STEPS) for column in b.T]
    if any(code for _, code in found):
        raise AccuracyError("the mass at the held root was not found: the mass matrix is ill-conditioned")
    return np.stack([x for x, _ in found], axis=1)
