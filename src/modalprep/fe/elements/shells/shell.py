"""Geometric stiffness inside a flat shell: the work of its stress against the rotating axes (theory 7.3, 7.7)."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from modalprep.fe.elements.corotation import Corotational
from modalprep.fe.elements.shells.flat_fields import (
    FlatCells,
    mean_rotation,
    nodal_rotations,
    side_fields,
    side_weights,
    slopes,
)
from modalprep.fe.elements.shells.flat_shell import STIFFNESS_DEGREE, FlatShell
from modalprep.fe.elements.shells.flat_strains import OPT_ALPHA
from modalprep.fe.elements.shells.laminate import strain_rotation
from modalprep.fe.elements.shells.yielding import yielding_map


class ShellBlock(FlatShell, Corotational):
    """Flat shells with the fields and weights of their geometric stiffness."""

    @property
    def position(self) -> np.ndarray:
        """(ne, n, 3) nodes in the mean plane, m."""
        return np.pad(self.xy, ((0, 0), (0, 0), (0, 1)))

    @property
    def axes_rotation(self) -> np.ndarray:
        """(ne, 3, 6n) rotation of the element's axes per local DOF."""
        return mean_rotation(self._cells)

    @cached_property
    def _cells(self) -> FlatCells:
        """Shapes and gradients, which every prestress of the block needs again."""
        return FlatCells(self.kind, self.xy, STIFFNESS_DEGREE[self.kind])

    def inner_fields(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of u (6: ``u_i,a``), rotations t (3) and their slopes (6); rows of `side_fields`."""
        cells = self._cells
        t, slope = nodal_rotations(cells)
        rows = (slopes(cells), t, slope)
        ne = len(self.xy)
        nq = t.shape[1]
        nl = t.shape[-1]
        return np.concatenate([x.reshape(ne, nq, -1, nl) for x in rows], axis=2), side_fields(cells)

    def inner_weights(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Work of the stress on second-order strains, of ``u + t x z e3 + t x (t x z e3) / 2``.

        With b = (ty, -tx): membrane forces ``N_ab (u_i,a u_i,b + v_a,b + v_b,a)``, v the second order of the sides
        (`side_weights`); moments ``M_ab (2 u_i,a b_i,b + (tz t_a),b)``; transverse shears
        ``Q_a (2 u_i,a b_i + tz t_a)``; of unsymmetric sections second moments ``L_ab b_i,a b_i,b``.
        """
        cells = self._cells
        N, M, Q, L = self._stress_resultants(d, cells.mapped[1])
        G = np.zeros((*N.shape[:2], 15, 15))
        u, t, slope = np.split(np.arange(15), (6, 9))
        for a in range(2):
            G[..., u[3 * a], t[1]] = Q[..., a]
            G[..., u[3 * a + 1], t[0]] = -Q[..., a]
            G[..., t[2], t[a]] = Q[..., a] / 2
            for b in range(2):
                m = M[..., a, b]
                for i in range(3):
                    G[..., u[3 * a + i], u[3 * b + i]] = N[..., a, b] / 2
                G[..., u[3 * a], slope[3 * b + 1]], G[..., u[3 * a + 1], slope[3 * b]] = m, -m
                G[..., t[a], slope[3 * b + 2]], G[..., t[2], slope[3 * b + a]] = m / 2, m / 2
                if L is not None:
                    for c in range(2):
                        G[..., slope[3 * a + c], slope[3 * b + c]] = L[..., a, b] / 2
        pull = np.einsum("eqab,eqkb->eka", N, cells.bubbles[1], optimize=True)
        bow = OPT_ALPHA if self.kind == "triangle" and self.section.membrane == "opt" else 0.0
        return G + np.swapaxes(G, 2, 3), side_weights(cells, pull, bow)

    def _stress_resultants(
        self, d: np.ndarray, dx: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
        """N and M ``(ne, nq, 2, 2)``, Q ``(ne, nq, 2)`` and L as N or None, times `dx`."""
        B, C, _ = self.strain
        strain = np.einsum("eqbj,ej->eqb", B[:, :, :8], d)
        force = strain @ C[:, :8, :8] * dx[..., None]
        moments = [force[..., :3], force[..., 3:6]]
        if self.unsymmetric_moduli is not None:
            moments.append(strain[..., :6] @ self.unsymmetric_moduli * dx[..., None])
        N, M, *L = (x[..., [0, 2, 2, 1]].reshape(*dx.shape, 2, 2) for x in moments)
        return N, M, force[..., 6:], L[0] if L else None

    def straining(self) -> np.ndarray:
        """Return the projector of `Corotational`, after the drilling rotations have yielded."""
        straining = super().straining()
        if self.yields is None:
            return straining
        return yielding_map(self.kind, self.xy, self.yields) @ straining

    @property
    def unsymmetric_moduli(self) -> np.ndarray | None:
        """Moduli ``(ne or 1, 6, 3)``: second moments of the stress of membrane strains and curvatures.

        Over the thickness, without those of the mean strain about the neutral surface; None for symmetric sections.
        """
        s = self._section
        C = self.moduli[0]
        if not (np.any(s.B) or np.any(s.third)):
            return None
        T = strain_rotation(self.angle if len(C) > 1 else self.angle[:1])
        A = C[:, :3, :3]
        B = C[:, :3, 3:]
        D = C[:, 3:, 3:]
        neutral = np.linalg.solve(A, np.concatenate([A, B], axis=2))
        central = D - B @ np.linalg.solve(A, B)
        both = np.concatenate([D, T.transpose(0, 2, 1) @ s.third @ T], axis=2)
        return (both - central @ neutral).transpose(0, 2, 1)
