"""Tied strains of curved shells as constants of the unit cell.

A shell has the mid-surface ``x = N_i x_i`` and the director ``t = N_i t_i``. Its covariant strains are products of the
nodal vectors: membrane ``x,a . x,b / 2``, curvature ``x,a . t,b`` and transverse shear ``x,a . t``, each less its value
at the start. Evaluated everywhere they lock; interpolated from samples they do not. Since the points of the samples are
fixed on the unit cell, so are the coefficients of ``x_i . x_j`` and ``x_i . t_j``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

MEMBRANE, CURVATURE, SHEAR = slice(0, 3), slice(3, 6), slice(6, 8)  # rows of the eight strains


class Forms(NamedTuple):
    """Coefficients of the eight covariant strains ``rr, ss, 2 rs`` (twice), ``r, s`` at the points of a rule.

    The last one is that of a function inside the element, which vanishes on its sides and by which the director changes
    along tau; it is zero where there is none. With "e" in place of q the coefficients are those of each element at all
    of its points.

    Attributes
    ----------
    xx : (nq, 8, n, n)
        Of ``x_i . x_j``, symmetric in i and j.
    xt : (nq, 8, n, n)
        Of ``x_i . t_j``.
    turned : (nq, 8, n)
        Of ``x_i . tau``.
    lead : {"q", "e"}
        What the first index counts.
    """

    xx: np.ndarray
    xt: np.ndarray
    turned: np.ndarray
    lead: str = "q"

    @property
    def subscripts(self) -> str:
        """Indices of elements and points of what the forms give."""
        return "eq" if self.lead == "q" else "e"

    def measures(self, x: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the covariant measures ``(ne, nq, 8)`` of nodal positions and directors ``(ne, n, 3)``."""
        rule = f"{self.lead}cij,eij->{self.subscripts}c"
        products = np.einsum("eia,eja->eij", x, x), np.einsum("eia,eja->eij", x, t)
        return np.einsum(rule, self.xx, products[0]) + np.einsum(rule, self.xt, products[1])

    def slopes(self, x: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the slopes ``(ne, nq, 8, n, 3)`` of the measures by positions and by directors."""
        by_x = self._times(2 * self.xx, x) + self._times(self.xt, t)
        return by_x, self._times(self.xt.swapaxes(-1, -2), x)

    def _times(self, form: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Return ``form_ij v_j (ne, nq, 8, n, 3)`` of nodal vectors ``(ne, n, 3)``, by products of whole matrices."""
        n = form.shape[-1]
        rows = form.reshape(-1, n) if self.lead == "q" else form.reshape(len(form), -1, n)
        each = form.shape[:-1] if self.lead == "q" else form.shape[1:-1]
        return (rows @ vectors).reshape(len(vectors), *each, 3)

    def of_tau(self, x: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Return the strains ``(ne, nq, 8, k)`` of tau along the rows of ``axes (ne, k, 3)``."""
        return np.einsum(f"{self.lead}ci,eia,eka->{self.subscripts}ck", self.turned, x, axes, optimize=True)

    def works(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the work ``(ne, n, n)`` of forces ``(ne, nq, 8)`` on ``x_i . x_j`` and ``x_i . t_j``."""
        rule = f"{self.subscripts}c,{self.lead}cij->eij"
        return tuple(np.einsum(rule, force, form, optimize=True) for form in (self.xx, self.xt))
