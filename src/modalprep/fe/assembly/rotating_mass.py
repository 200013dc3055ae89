"""Second-order motion of eccentric mass, which rotates with the nodes (theory 7.7)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial.transform import Rotation

from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.distribution import Inertia
from modalprep.fe.links.interface import link_geometric_stiffness


@dataclass(frozen=True, eq=False)
class RotatingMass:
    """The eccentric mass of a model: all mass that lies beside the nodes.

    Attributes
    ----------
    blocks : list of Inertia
    dof : (n_nodes, 6) int
    """

    blocks: list[Inertia]
    dof: np.ndarray

    def project(self, Phi: np.ndarray) -> np.ndarray:
        """Return the part ``(12, n, n)`` of ``Kg_A`` (3) and ``Kg_W`` (9, by rows) due to arms, for ``Phi (n_dof, n)``.

        Examples
        --------
        >>> from modalprep.examples import cantilever_model
        >>> model = cantilever_model(elements=1)
        >>> twist = np.zeros((model.n_dof, 1))
        >>> twist[model.dof[1, 3]] = 1.0  # rho (Iy + Iz) L / 3 for both directions of the section
        >>> added = model.rotating_mass.project(twist)[3:].reshape(3, 3)
        >>> bool(np.allclose(added[1, 1] + added[2, 2], -(model.M @ twist)[model.dof[1, 3]]))
        True
        """
        out = np.zeros((12, Phi.shape[1], Phi.shape[1]))
        for arms, dofs in self._arms():
            for k, form in _forms(arms, arms.rotation @ Phi[dofs][:, None], arms.unit):
                out[k] += form
        return out

    def project_modes(self, Phi: np.ndarray, some: slice) -> np.ndarray:
        """Return the part ``(k, n, n)`` of ``phi_i^T M Gamma_jk`` of the modal mass due to arms, i in `some`."""
        n = Phi.shape[1]
        out = np.zeros((len(range(n)[some]), n, n))
        for arms, dofs in self._arms():
            own = Phi[dofs][:, None]
            for k, form in _forms(arms, arms.rotation @ own, arms.inertia @ own[..., some]):
                out[k] += form
        return out

    def __call__(self, field: np.ndarray) -> csr_array:
        """Return the stiffness ``(n_dof, n_dof)`` in a steady acceleration: factors ``(12,)`` on ``A`` and ``W``."""
        n = int(self.dof.max()) + 1
        total = csr_array((n, n))
        for arms, dofs in self._arms():
            form = link_geometric_stiffness((arms.unit @ field)[:, :, None], arms.arm[:, :, None])
            values = np.einsum("esai,esab,esbj->eij", arms.rotation, form, arms.rotation, optimize=True)
            rows = np.broadcast_to(dofs[:, :, None], values.shape)
            place = (rows.ravel(), rows.transpose(0, 2, 1).ravel())
            total = total + coo_array((values.ravel(), place), shape=(n, n)).tocsr()
        return total

    def work(self, d: np.ndarray, field: np.ndarray) -> float:
        """Return the work (J) of inertia on arms at finite rotations, beyond the first order of their displacement.

        ``d (n_dof,)`` rotation vectors at the nodes, `field` (12,) steady acceleration as in `__call__`.
        """
        total = 0.0
        for arms, dofs in self._arms():
            t = (arms.rotation @ d[dofs][:, None, :, None])[..., 0]
            turned = Rotation.from_rotvec(t.reshape(-1, 3)).apply(arms.arm.reshape(-1, 3)).reshape(t.shape)
            total -= np.sum((arms.unit @ field) * (turned - arms.arm - np.cross(t, arms.arm)))
        return float(total)

    def _arms(self) -> Iterator[tuple[RotatingArms, np.ndarray]]:
        for block in self.blocks:
            arms = block.rotating_arms()
            if arms is not None and np.any(arms.arm):
                yield arms, self.dof[block.nodes, : block.components].reshape(len(block.nodes), -1)


def _forms(arms: RotatingArms, turns: np.ndarray, force: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Yield number and form ``(n, n)`` of rotations ``turns (ne, ns, 3, n)`` for forces ``(ne, ns, 3, k)``."""
    ne, ns, _, n = turns.shape
    flat = turns.reshape(ne * ns, 3, n)
    rows = (ne * ns * 3, n)
    for k in range(force.shape[3]):
        if np.any(force[..., k]):
            form = link_geometric_stiffness(force[..., k][:, :, None], arms.arm[:, :, None]).reshape(-1, 3, 3)
            yield k, flat.reshape(rows).T @ np.einsum("sab,sbn->san", form, flat).reshape(rows)
