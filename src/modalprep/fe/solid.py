"""Second-order tetrahedra with straight or curved edges (isoparametric), isotropic.

``K_(Ii)(Jj) = lam G_(Ii)(Jj) + mu (G_(Ij)(Ji) + delta_ij G_(Ik)(Jk))`` with the Gram matrix
``G_(Ik)(Jl) = int phi_I,k phi_J,l``: one matrix product per element instead of a strain matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skfem import Basis, ElementTetP2, MeshTet2

from modalprep.errors import InputError
from modalprep.fe.block import PAIRS, MassObjects, Triplets, rigid_from_samples
from modalprep.fe.properties import Solid

COMPONENTS = 3
NODES = 10
QUADRATURE = 6  # degree: 15 points, all weights positive; exact for mass of straight tetrahedra


@dataclass(frozen=True, eq=False)
class SolidBlock:
    """Tetrahedra of one property, evaluated at their quadrature points.

    Attributes
    ----------
    dofs : (ne, 30) int
        x, y, z of node 1, then of node 2, ...
    shape : (nq, 10)
    grad : (ne, nq, 10, 3)
    dx : (ne, nq)
    position : (ne, nq, 3)
    """

    section: Solid
    dofs: np.ndarray
    shape: np.ndarray
    grad: np.ndarray
    dx: np.ndarray
    position: np.ndarray

    @classmethod
    def build(
        cls, points: np.ndarray, conn: np.ndarray, dofs: np.ndarray, section: Solid, origin: np.ndarray
    ) -> SolidBlock:
        """Evaluate the shapes of the elements ``conn (ne, 10)`` (VTK order) with DOFs ``(ne, 30)``.

        `points` are in mesh coordinates, `origin` is the origin of the model's frame in them.

        Raises
        ------
        InputError
            When an element is inverted or flat.
        """
        used, local = np.unique(conn, return_inverse=True)
        local = local.reshape(conn.shape)
        _refuse_flat(points[conn[:, :4]])
        mesh = MeshTet2(np.ascontiguousarray(points[used].T), np.ascontiguousarray(local.T.astype(np.int32)))
        basis = Basis(mesh, ElementTetP2(), intorder=QUADRATURE, disable_doflocs=True)
        _refuse_inverted(basis.mapping.detDF(basis.X), points[conn].mean(axis=1))
        fields = [shape[0] for shape in basis.basis]
        shape = np.array([np.asarray(f)[0] for f in fields]).T
        grad = np.moveaxis(np.array([f.grad for f in fields]), (0, 1), (2, 3))
        position = np.einsum("qi,eix->eqx", shape, points[conn]) - origin
        return cls(section, dofs, shape, np.ascontiguousarray(grad), basis.dx, position)

    def stiffness(self) -> list[Triplets]:
        """Elastic stiffness (module docstring)."""
        mat = self.section.material
        lam, mu = mat.E * mat.nu / ((1 + mat.nu) * (1 - 2 * mat.nu)), mat.G
        ne, nq = self.dx.shape
        A = self.grad.reshape(ne, nq, 3 * NODES)
        gram = (A.transpose(0, 2, 1) @ (A * self.dx[..., None])).reshape(ne, NODES, 3, NODES, 3)
        K = lam * gram + mu * gram.transpose(0, 1, 4, 3, 2)
        trace = mu * np.einsum("eikjk->eij", gram)
        for i in range(3):
            K[:, :, i, :, i] += trace
        return [Triplets.square(self.dofs, K.reshape(ne, 3 * NODES, 3 * NODES))]

    def mass(self) -> MassObjects:
        """Every mass object of FORMULATION section 1; one scalar matrix serves all components."""
        ne = len(self.dx)
        weight = self.section.material.rho * self.dx
        scalar = np.einsum("eq,qi,qj->eij", weight, self.shape, self.shape, optimize=True)
        first = weight @ self.shape
        moment = np.einsum("eq,qi,eqb->eib", weight, self.shape, self.position, optimize=True)
        g, h = np.zeros((ne, NODES, 3, 3)), np.zeros((ne, NODES, 3, 3, 3))
        for a in range(3):
            g[:, :, a, a] = first
            h[:, :, a, a] = moment
        tensor = {(a, b): [Triplets(self.dofs[:, a::3], self.dofs[:, b::3], scalar)] for a, b in PAIRS}
        rigid = rigid_from_samples(weight, np.ones(len(self.shape)), self.position)
        return MassObjects(self.dofs, g.reshape(ne, -1, 3), h.reshape(ne, -1, 3, 3), tensor, rigid)

    def geometric_stiffness(self, d: np.ndarray) -> list[Triplets]:
        """``int sigma_kl phi_I,k phi_J,l`` for each displacement component; sigma from the displacement d."""
        sigma = self.stress(d)
        weighted = np.matmul(self.grad, sigma * self.dx[..., None, None])
        ne = len(self.dx)
        left, right = (np.swapaxes(x, 2, 3).reshape(ne, -1, NODES) for x in (self.grad, weighted))
        scalar = left.transpose(0, 2, 1) @ right
        return [Triplets.square(self.dofs[:, a::3], scalar) for a in range(3)]

    def stress(self, d: np.ndarray) -> np.ndarray:
        """Cauchy stress ``(ne, nq, 3, 3)`` in Pa at the quadrature points for nodal displacements ``d (n_dof,)``."""
        mat = self.section.material
        lam = mat.E * mat.nu / ((1 + mat.nu) * (1 - 2 * mat.nu))
        nodal = d[self.dofs].reshape(-1, NODES, 3)
        strain = np.einsum("eqik,eij->eqjk", self.grad, nodal, optimize=True)
        strain = (strain + np.swapaxes(strain, 2, 3)) / 2
        trace = np.trace(strain, axis1=2, axis2=3)
        return 2 * mat.G * strain + lam * trace[..., None, None] * np.eye(3)


def _refuse_flat(corners: np.ndarray) -> None:
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.abs(np.linalg.det(edges))
    size = np.linalg.norm(edges, axis=2).max(axis=1) ** 3
    _refuse(volume <= 1e-10 * size, corners.mean(axis=1), "flat")


def _refuse_inverted(jacobian: np.ndarray, centre: np.ndarray) -> None:
    _refuse(np.any(jacobian <= 0, axis=1), centre, "inverted")


def _refuse(bad: np.ndarray, centre: np.ndarray, what: str) -> None:
    if np.any(bad):
        at = ", ".join(f"{x:.4g}" for x in centre[np.argmax(bad)])
        raise InputError(
            f"{bad.sum()} of {len(bad)} solid elements are {what}, the first near ({at}) m; repair the mesh"
        )
