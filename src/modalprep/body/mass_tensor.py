"""The mass tensor P of a body of which a file holds only the sum ``F = P + Kg_W``.

The equations of motion contain F alone to first order in q, and to second order in the inertia ``E``; P on its own is
in the third order. Of P are known the part antisymmetric in its modes, which geometric stiffness does not have, and the
sum ``P_11 + P_22 + P_33``, the modal mass. The rest is chosen nearest to F among the tensors that some
distribution of mass can have: positive semidefinite beyond the affine part of the modes, which S and H determine.
"""

from __future__ import annotations

import numpy as np

NEAREST = 40  # rounds of Dykstra's algorithm, which leads near to F
ROUNDS = 1000  # of projections with extrapolation, which lead to a positive tensor faster
POSITIVE = 1e-9  # of the modal mass


def nearest_mass_tensor(field: np.ndarray, affine: np.ndarray, modal_mass: np.ndarray) -> np.ndarray:
    """Return P (3, 3, n, n).

    What remains negative after all rounds is below 1e-4 of the modal mass.

    Parameters
    ----------
    field : (3, 3, n, n)
        ``P + Kg_W``.
    affine : (3, 4, n)
        Affine part of the modes, B in mass.py.
    modal_mass : (n, n)

    References
    ----------
    R. L. Dykstra, An algorithm for restricted least squares regression, J. Am. Stat. Assoc. 78 (1983) 837;
    G. Pierra, Decomposition through formalization in a product space, Math. Program. 28 (1984) 96.

    Examples
    --------
    >>> from modalprep.body.mass import affine_part
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> found = nearest_mass_tensor(beam.P + beam.Kg_W, affine_part(beam).B, np.eye(2))
    >>> bool(np.allclose(found, beam.P, atol=1e-2))  # its geometric stiffness is nearly tension alone
    True
    """
    n = len(modal_mass)
    own = np.einsum("ari,brj->abij", affine, affine)
    spin = _antisymmetric((field - field.transpose(0, 1, 3, 2)) / 2 - own)
    total = modal_mass - np.einsum("aaij->ij", own)

    def admissible(X: np.ndarray) -> np.ndarray:
        even = (X + X.transpose(1, 0, 2, 3) + X.transpose(0, 1, 3, 2) + X.transpose(1, 0, 3, 2)) / 4
        missing = (total - np.einsum("aaij->ij", even)) / 3
        return even + spin + np.einsum("ab,ij->abij", np.eye(3), missing)

    def positive(X: np.ndarray) -> np.ndarray:
        size, V = np.linalg.eigh(X.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n))
        return ((V * np.maximum(size, 0.0)) @ V.T).reshape(3, n, 3, n).transpose(0, 2, 1, 3)

    X = admissible(field - own)
    correction = np.zeros_like(field)
    for _ in range(NEAREST):
        Y = positive(X + correction)
        correction = X + correction - Y
        X = admissible(Y)
    for _ in range(ROUNDS):
        Y = positive(X)
        defect = np.sum((Y - X) ** 2)
        step = admissible(Y) - X
        if defect <= (POSITIVE * np.linalg.norm(total)) ** 2:
            break
        X = admissible(X + defect / np.sum(step**2) * step)
    return X + own


def _antisymmetric(X: np.ndarray) -> np.ndarray:
    """Return the part that is antisymmetric in its axes and in its modes."""
    odd = (X - X.transpose(1, 0, 2, 3)) / 2
    return (odd - odd.transpose(0, 1, 3, 2)) / 2
