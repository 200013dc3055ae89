"""Strain energy of curved shells at finite displacements; its third derivative is the geometric stiffness."""

from __future__ import annotations

import numpy as np

from modalprep.fe.elements.shells.curved_shell import CurvedShell
from modalprep.fe.elements.shells.curved_surface import Points
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.vectors import rotation_matrix, skew


class CurvedShellBlock(CurvedShell):
    """Curved shells with the work of their stress at finite displacements."""

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """Geometric stiffness ``(ne, 6n, 6n)`` of the prestress from the displacements ``d (ne, 6n)``, mesh axes."""
        B, C, dx = self.strain
        force = np.einsum("eqbj,ej->eqb", B, d, optimize=True) @ C * dx[..., None]
        ne, n = self.nodes.shape
        xx, xt, pull = (np.zeros((ne, n, k)) for k in (n, n, 3))
        for forms, work in zip(self.forms(self.degree), self._covariant(force), strict=True):
            own_xx, own_xt = forms.works(work)
            by_t = self.slopes(forms)[1]
            xx = xx + own_xx
            xt = xt + own_xt
            pull = pull + np.einsum(f"{forms.subscripts}c,{forms.subscripts}cja->eja", work, by_t)
        o = self.offset[:, None, None]
        lever = -skew(self.normal)
        both = xt + 2 * o * xx
        K = np.zeros((ne, n, 6, n, 6))
        for a in range(3):
            K[:, :, a, :, a] = 2 * xx
        K[:, :, :3, :, 3:] = np.einsum("eij,ejab->eiajb", both, lever)
        K[:, :, 3:, :, 3:] = np.einsum("eij,eica,ejcb->eiajb", o * (both + xt.transpose(0, 2, 1)), lever, lever)
        self._add_drilling(K, pull, force[:, :, 8], self.points)
        for i, own in enumerate(link_geometric_stiffness(pull[:, :, None], self.normal[:, :, None]).swapaxes(0, 1)):
            K[:, i, 3:, i, 3:] += own
        K[:, :, 3:, :, :3] = K[:, :, :3, :, 3:].transpose(0, 3, 4, 1, 2)
        K = K.reshape(ne, 6 * n, 6 * n)
        return (K + K.transpose(0, 2, 1)) / 2

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Return the strain energy ``(ne,)`` at finite displacements ``d (ne, 6n)``, rotation vectors at the nodes."""
        u, vector = np.split(d.reshape(len(d), -1, 6), 2, axis=2)
        R = rotation_matrix(vector)
        t = np.einsum("eiab,eib->eia", R, self.normal)
        x = self.x + u + self.offset[:, None, None] * (t - self.normal)
        _, C, dx = self.strain
        forms = self.forms(self.degree)
        grown = [own.measures(x, t) - own.measures(self.x, self.normal) for own in forms]
        strain = np.concatenate(
            [self.along_axes(self.points, *(g[..., None] for g in grown))[..., 0], self._drilled(self.points, x, R)],
            axis=2,
        )
        strain = self.thickened(strain[..., None], self.degree)
        strain = self.relaxed(strain)[..., 0]
        return np.einsum("eqa,eqab,eqb,eq->e", strain, np.broadcast_to(C[:, None], (*dx.shape, 9, 9)), strain, dx) / 2

    def _covariant(self, force: np.ndarray) -> list[np.ndarray]:
        """Forces ``(ne, nq, 9)`` on strains along the axes as those on the measures of each of the `forms`."""
        force = self.thickened(force[..., :8, None], self.degree)[..., 0]
        return [(force[:, :, None] @ self.points.cartesian)[:, :, 0], force.sum(axis=1)][: len(self.forms(self.degree))]

    def _drilled(self, at: Points, x: np.ndarray, R: np.ndarray) -> np.ndarray:
        """The strain of `_drilling` ``(ne, nq, 1)`` where nodes are at ``x (ne, n, 3)`` and have rotated by R."""
        (e1, e2) = self.plane(at)[0]
        N = self.shapes
        change = np.zeros(at.dx.shape)
        for own, rotations in ((x, R), (self.x, np.broadcast_to(np.eye(3), R.shape))):
            mean = np.einsum("qi,eiab->eqab", N, rotations)
            sign = 1 if own is x else -1
            p1, p2 = np.moveaxis(at.gradient @ own[:, None], 2, 0)
            change = change + sign * (_dot(p1, mean, e2) - _dot(p2, mean, e1))
        return change[..., None] / 2

    def _add_drilling(self, K: np.ndarray, pull: np.ndarray, moment: np.ndarray, at: Points) -> None:
        """Add the work of drilling moments ``(ne, nq)`` on the second order of `_drilled` to K, and to `pull`."""
        N, axes, slopes = self.shapes, *self.plane(at)
        o = self.offset
        lever = -skew(self.normal)
        n = N.shape[1]
        back = (o[:, None, None, None] * lever).swapaxes(2, 3)
        for k, work in enumerate((moment / 2, -moment / 2)):
            e = axes[1 - k]
            p = slopes[k]
            slope = at.gradient[:, :, k]
            mixed = np.einsum("eq,eqi,qj,eqab->eiajb", work, slope, N, -skew(e), optimize=True)
            K[:, :, :3, :, 3:] += mixed
            arm = (back @ mixed.reshape(-1, n, 3, 3 * n)).reshape(mixed.shape)
            K[:, :, 3:, :, 3:] += arm + arm.transpose(0, 3, 4, 1, 2)
            pull += np.einsum("e,eq,eqi,eqa->eia", o, work, slope, e, optimize=True)
            own = np.einsum("eq,qi,eqab->ieab", work, N, link_geometric_stiffness(p[:, :, None], e[:, :, None]))
            for i in range(len(own)):
                K[:, i, 3:, i, 3:] += own[i]


def _dot(p: np.ndarray, mean: np.ndarray, e: np.ndarray) -> np.ndarray:
    return np.einsum("eqa,eqab,eqb->eq", p, mean, e, optimize=True)
