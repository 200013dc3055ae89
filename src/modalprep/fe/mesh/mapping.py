"""scikit-fem's map from the unit cell to cells in space: volumes, and surfaces and lines embedded in space.

scikit-fem itself takes a surface for its projection on the plane. With this map its own elements have the right
measure, and `grad` is the gradient in space along the cell, ``u_i,j`` with j = x, y, z, for cells of every dimension.
"""

from __future__ import annotations

import numpy as np
from skfem.mapping import Mapping

from modalprep.fe.mesh.reference_cells import shapes_at


class CellMapping(Mapping):
    """The isoparametric map of the cells of one kind.

    Parameters
    ----------
    kind : str
        meshio's name of the cell.
    x : (ne, nn, 3)
        Their nodes in meshio's order, m.
    """

    def __init__(self, kind: str, x: np.ndarray) -> None:
        self.kind, self.x = kind, x
        self._last: tuple | None = None

    def F(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """Return points ``(3, ne, nq)`` of points of the unit cell ``X (dim, nq)`` or ``(dim, ne, nq)``."""
        return np.einsum("...qi,eia->aeq" if X.ndim == 2 else "eqi,eia->aeq", self._shapes(X)[0], self._nodes(tind))

    def DF(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """Return ``dx_a / dX_b (3, dim, ne, nq)``."""
        return np.einsum("qib,eia->abeq" if X.ndim == 2 else "eqib,eia->abeq", self._shapes(X)[1], self._nodes(tind))

    def detDF(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """Return the volume, area or length per measure of the unit cell, ``(ne, nq)``."""
        J = np.moveaxis(self.DF(X, tind), (0, 1), (2, 3))
        if J.shape[3] == 3:
            return np.linalg.det(J)
        return np.sqrt(np.linalg.det(J.swapaxes(2, 3) @ J))

    def invDF(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """Return ``dX_b / dx_a (dim, 3, ne, nq)``, which has no part normal to the cell."""
        if self._last is None or self._last[0] is not X or self._last[1] is not tind:  # scikit-fem asks per function
            J = np.moveaxis(self.DF(X, tind), (0, 1), (2, 3))
            inverse = np.linalg.inv(J) if J.shape[3] == 3 else np.linalg.solve(J.swapaxes(2, 3) @ J, J.swapaxes(2, 3))
            self._last = X, tind, np.moveaxis(inverse, (2, 3), (0, 1))
        return self._last[2]

    def normals(self, X: np.ndarray) -> np.ndarray:
        """Return the unit normals ``(3, ne, nq)`` of surfaces, or the unit tangents of lines."""
        J = self.DF(X)
        along = J[:, 0] if J.shape[1] == 1 else np.cross(J[:, 0], J[:, 1], axis=0)
        return along / np.linalg.norm(along, axis=0)

    def _nodes(self, tind: np.ndarray | None) -> np.ndarray:
        return self.x if tind is None else self.x[tind]

    def _shapes(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        N, dN = shapes_at(self.kind, X.reshape(len(X), -1))
        return N.reshape(*X.shape[1:], -1), dN.reshape(*X.shape[1:], *dN.shape[1:])
