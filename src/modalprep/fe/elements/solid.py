"""Solids: tetrahedra, pyramids, wedges and hexahedra, isoparametric; 8-node bricks with incompatible modes.

Linear hexahedra lock in bending; nine internal DOFs on the shapes ``1 - xi^2`` (Wilson), with their gradients
taken at the element's centre (Taylor) so that the patch test holds, cure it. They are condensed per element and
kept for the recovery of stress. Hexahedra of 20 nodes lock on thin curved walls; 2 x 2 x 2 points cure it (theory 7.5).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import get_args

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.block import Block, NodalStress
from modalprep.fe.elements.elasticity import Elasticity
from modalprep.fe.elements.hourglass import hourglass_stiffness
from modalprep.fe.elements.kernels import gradients, in_threads, measures, stress_stiffness
from modalprep.fe.elements.mass import MassObjects, rigid_from_samples
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import NODES, quadrature, shapes, shapes_at
from modalprep.fe.properties.properties import Solid, SolidIntegration

# Degrees of quadrature: stiffness, stiffness of curved elements, mass. Rules of positive weights only.
DEGREE = {
    "tetra": (1, 1, 2),
    "tetra10": (2, 6, 5),
    "pyramid": (3, 3, 3),
    "pyramid13": (5, 5, 5),
    "wedge": (2, 2, 4),
    "wedge15": (4, 4, 5),  # 4: 3 x 3 points
    "hexahedron": (3, 3, 5),
    "hexahedron20": (5, 5, 5),
    "hexahedron27": (5, 5, 7),
}
REDUCED = {"hexahedron20": 3, "wedge15": 4}  # degrees of reduced integration: 2 x 2 x 2, 3 x 3 points
INTEGRATIONS = get_args(SolidIntegration)  # by their numbers in ``Mesh.data``
SIX = ("xx", "yy", "zz", "xy", "yz", "xz")  # components of stress
STRAIGHT = 1e-9  # mid nodes off the middle of their edges, over the size of the element
PRESTRESS = {"tetra10": 3}  # degree for Kg of straight elements: linear stress times linear gradients squared


def integration_of(kind: str, section: Solid, data: Mapping[str, np.ndarray]) -> SolidIntegration:
    """Return the integration of elements that have one: of their property, else of the mesh."""
    if kind not in REDUCED:
        return "full"
    own = np.nan_to_num(data.get("integration", np.zeros(1)))
    return section.integration or INTEGRATIONS[int(own[0])]


@cache
def _middles() -> np.ndarray:
    """Return the shapes ``(6, 4)`` of the corners of a tetrahedron in the middle of its edges."""
    return shapes_at("tetra", CELLS["tetra10"].node_coordinates()[4:].T)[0]


@cache
def _from_points() -> np.ndarray:
    """Return the values ``(20, 8)`` at the nodes of a hexahedron of each of its 2 x 2 x 2 points, trilinear."""
    inside = shapes_at("hexahedron", quadrature("hexahedron20", REDUCED["hexahedron20"])[0])[0]
    nodes = shapes_at("hexahedron", CELLS["hexahedron20"].node_coordinates().T)[0]
    return nodes @ np.linalg.inv(inside)


@dataclass(frozen=True, eq=False)
class SolidBlock(Block):
    """Solid elements of one kind and property.

    Attributes
    ----------
    kind : str
    nodes : (ne, nn) int
        meshio's node order.
    x : (ne, nn, 3)
        Node positions in the model's frame, m.
    elasticity : Elasticity
    integration : {"full", "reduced_stiffness", "reduced"}
    free_faces : (ne, 6) or None
        Of elements of reduced integration: the share of each face whose hourglass motion no neighbour holds.
    """

    components = 3
    tensor = "scalar"
    kind: str
    section: Solid
    nodes: np.ndarray
    x: np.ndarray
    elasticity: Elasticity
    integration: SolidIntegration = "full"
    free_faces: np.ndarray | None = None

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> SolidBlock:
        """Take the elements ``nodes (ne, nn)`` at ``points (n, 3)`` (mesh axes); `origin` is the model's origin.

        Raises
        ------
        InputError
            When an element is inverted or flat.
        """
        elasticity = Elasticity.of(section, data.get("frame"))
        rule = integration_of(kind, section, data)
        block = cls(kind, section, nodes, points[nodes] - origin, elasticity, rule, data.get("free_faces"))
        block._refuse_bad_shape(origin)
        return block

    @cached_property
    def degree(self) -> int:
        """Degree of the stiffness quadrature: more for curved elements."""
        return DEGREE[self.kind][0 if self._straight else 1] if self.integration == "full" else REDUCED[self.kind]

    @property
    def mass_degree(self) -> int:
        """Degree of the mass quadrature."""
        return REDUCED[self.kind] if self.integration == "reduced" else DEGREE[self.kind][2]

    def gradients(self, degree: int) -> tuple[np.ndarray, np.ndarray]:
        """Return ``grad (ne, nq, nn, 3)`` and ``dx (ne, nq)``."""
        _, dN, weight = shapes(self.kind, degree)
        return self._map(dN, weight)

    def _map(self, dN: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        grad = np.empty((len(self.x), *dN.shape))
        dx = np.empty(grad.shape[:2])
        in_threads(gradients, len(self.x), self.x, dN, weight, grad, dx)
        return grad, dx

    def _measure(self, degree: int) -> np.ndarray:
        """Return the volume ``(ne, nq)`` of each point of a quadrature; affine elements need one Jacobian."""
        _, dN, weight = shapes(self.kind, degree)
        own = slice(1 if self._affine else None)
        dx = np.empty((len(self.x), len(dN[own])))
        in_threads(measures, len(self.x), self.x, dN[own], weight[own], dx)
        return dx * (weight / weight[0]) if self._affine else dx

    def stiffness(self) -> np.ndarray:
        """Elastic stiffness ``(ne, 3 nn, 3 nn)``, internal DOFs condensed."""
        grad, dx = self.gradients(self.degree)
        if self.kind != "hexahedron":
            return self._held(self._elastic(grad, dx))
        K = self._elastic(self._widened(grad, self.degree), dx)
        G = _internal(K, 24)
        K = K[:, :24, :24] + K[:, :24, 24:] @ G
        return (K + K.transpose(0, 2, 1)) / 2

    def _held(self, K: np.ndarray) -> np.ndarray:
        """Return the stiffness with that of the faces whose hourglass motion no neighbour holds."""
        if self.free_faces is None or not np.any(self.free_faces):
            return K
        size = np.trace(K, axis1=1, axis2=2) / K.shape[1]
        return K + hourglass_stiffness(self.x, self.free_faces, size)

    def _elastic(self, grad: np.ndarray, dx: np.ndarray) -> np.ndarray:
        return self.elasticity.stiffness(np.ascontiguousarray(grad), dx)

    def _widened(self, grad: np.ndarray, degree: int) -> np.ndarray:
        """Gradients and those ``(ne, nq, 3, 3)`` of the three internal shapes, mapped by the Jacobian of the centre."""
        X = quadrature("hexahedron", degree)[0]
        centre = shapes_at("hexahedron", np.full((3, 1), 0.5))[1]
        det0 = self._map(centre, np.ones(1))[1]
        inverse = np.linalg.inv(np.einsum("eia,ib->eab", self.x, centre[0]))
        det = self._map(shapes_at("hexahedron", X)[1], np.ones(X.shape[1]))[1]
        slope = np.einsum("kq,eka->eqka", 4 - 8 * X, inverse)  # of 4 xi (1 - xi)
        return np.concatenate([grad, slope * (det0 / det)[:, :, None, None]], axis=2)

    def mass(self) -> MassObjects:
        """Every mass object of theory 1; one scalar matrix serves all components."""
        N = shapes(self.kind, self.mass_degree)[0]
        dx = self._measure(self.mass_degree)
        rho = self.section.material.rho * dx
        ne, nn = self.nodes.shape
        products = (N[:, :, None] * N[:, None]).reshape(len(N), -1)
        scalar = (rho @ products).reshape(ne, nn, nn)
        position = np.swapaxes(np.tensordot(N, self.x, (1, 1)), 0, 1)
        first = rho @ N
        moment = np.swapaxes(np.tensordot(N, rho[..., None] * position, (0, 1)), 0, 1)
        g = np.zeros((ne, nn, 3, 3))
        h = np.zeros((ne, nn, 3, 3, 3))
        for a in range(3):
            g[:, :, a, a] = first
            h[:, :, a, a] = moment
        rigid = rigid_from_samples(rho, np.ones(len(N)), position)
        scalar = (scalar + scalar.transpose(0, 2, 1)) / 2
        return MassObjects(g.reshape(ne, -1, 3), h.reshape(ne, -1, 3, 3), rigid, "scalar", scalar)

    def volume(self) -> np.ndarray:
        """Volume ``(ne,)``, m^3."""
        return self._measure(self.mass_degree).sum(axis=1)

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """`geometric_scalar` on each displacement component, ``(ne, 3 nn, 3 nn)``."""
        ne, nn = self.nodes.shape
        scalar = self.geometric_scalar(d.reshape(ne, nn, 3, 1))[..., 0]
        K = np.zeros((ne, nn, 3, nn, 3))
        for a in range(3):
            K[:, :, a, :, a] = scalar
        return K.reshape(ne, 3 * nn, 3 * nn)

    def geometric_scalar(self, d: np.ndarray) -> np.ndarray:
        """``int sigma_kl N_I,k N_J,l (ne, nn, nn, k)``; sigma from each of the displacements ``d (ne, nn, 3, k)``."""
        degree = max(self.degree, PRESTRESS.get(self.kind, 0))
        grad, dx = self.gradients(degree)
        S = np.empty((*self.nodes.shape, *d.shape[1::2]))
        in_threads(stress_stiffness, len(d), grad, self._stress(d, grad, dx, degree), dx, S)
        return S

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Return the energy ``(ne,)`` of Green's strain at finite displacements ``d (ne, 3 nn)``.

        The internal shapes of the eight-node hexahedron enter the linear strain only.
        """
        degree = max(self.degree, PRESTRESS.get(self.kind, 0))
        grad, dx = self.gradients(degree)
        u = d.reshape(*self.nodes.shape, 3)
        H = np.einsum("eia,eqib->eqab", u, grad, optimize=True)
        bent = np.swapaxes(H, 2, 3) @ H / 2
        linear = self._stress(u[..., None], grad, dx, degree)[..., 0]
        quadratic = self.elasticity.energy(bent)
        cubic = np.einsum("eqab,eqab->eq", linear, bent)
        elastic = np.einsum("ei,eij,ej->e", d, self.stiffness(), d) / 2
        return elastic + np.sum((cubic + quadratic) * dx, axis=1)

    def stress(self, d: np.ndarray) -> np.ndarray:
        """Cauchy stress ``(ne, nq, 3, 3, k)``, Pa, at the quadrature points for displacements ``d (ne, nn, 3, k)``."""
        return self._stress(d, *self.gradients(self.degree), self.degree)

    @property
    def frame(self) -> np.ndarray:
        """(ne, 3, 3) axes of the components of stress: those of the mesh."""
        return np.tile(np.eye(3), (len(self.nodes), 1, 1))

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress at the nodes of each element for displacements ``d (ne, 3 nn, k)``, mesh axes."""
        sigma = self._at_nodes(d.reshape(*self.nodes.shape, 3, -1))
        values = np.stack([sigma[:, :, "xyz".index(a), "xyz".index(b)] for a, b in SIX], axis=2)
        return {"": (SIX, values)}

    def _at_nodes(self, d: np.ndarray) -> np.ndarray:
        """Cauchy stress ``(ne, nn, 3, 3, k)`` at the nodes; of 2 x 2 x 2 points linear in each direction."""
        if self.integration != "full" and self.kind == "hexahedron20":
            return np.einsum("iq,eqabk->eiabk", _from_points(), self.stress(d))
        grad, _ = self.gradients(NODES)
        if self.kind == "hexahedron":
            inside, weight = self.gradients(self.degree)
            d = self._with_internal(d, self._widened(inside, self.degree), weight)
            grad = self._widened(grad, NODES)
        return self.elasticity.stress(grad, d)

    def _stress(self, d: np.ndarray, grad: np.ndarray, dx: np.ndarray, degree: int) -> np.ndarray:
        if self.kind == "hexahedron":
            grad = self._widened(grad, degree)
            d = self._with_internal(d, grad, dx)
        return self.elasticity.stress(grad, d)

    def _with_internal(self, d: np.ndarray, grad: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """Displacements ``(ne, nn + 3, 3, k)`` with the internal ones that `_widened` gradients at a rule condense."""
        internal = _internal(self._elastic(grad, dx), 24) @ d.reshape(len(d), 24, -1)
        return np.concatenate([d, internal.reshape(len(d), 3, 3, -1)], axis=1)

    def piece(self, some: slice | np.ndarray) -> SolidBlock:
        """Return the block of `some` of the elements."""
        free = None if self.free_faces is None else self.free_faces[some]
        elasticity = self.elasticity.piece(some)
        return replace(self, nodes=self.nodes[some], x=self.x[some], elasticity=elasticity, free_faces=free)

    @cached_property
    def _straight(self) -> bool:
        if self.kind != "tetra10":
            return True
        corners = 4
        off = np.abs(self.x[:, corners:] - _middles() @ self.x[:, :corners]).max(axis=(1, 2))
        return bool(np.all(off <= STRAIGHT * self._size))

    @property
    def _affine(self) -> bool:
        """Whether the Jacobian is the same everywhere."""
        return self.kind.startswith("tetra") and self._straight

    @cached_property
    def _size(self) -> np.ndarray:
        """Largest extent ``(ne,)`` along an axis, m."""
        return np.ptp(self.x.transpose(1, 2, 0).copy(), axis=0).max(axis=0)  # 20 times faster than along axis 1

    def _refuse_bad_shape(self, origin: np.ndarray) -> None:
        dx = self._measure(DEGREE[self.kind][2])
        flat = np.abs(dx).sum(axis=1) <= 1e-11 * self._size**3
        for bad, what in ((flat, "flat"), (np.any(dx <= 0, axis=1), "inverted")):
            if np.any(bad):
                at = ", ".join(f"{v:.4g}" for v in self.x[np.argmax(bad)].mean(axis=0) + origin)
                raise InputError(
                    f"{bad.sum()} of {len(bad)} solid elements are {what}, the first near ({at}) m; repair the mesh"
                )


def _internal(K: np.ndarray, n: int) -> np.ndarray:
    """Return ``-K_bb^-1 K_ba (ne, nb, n)``: internal DOFs per nodal DOF."""
    return -np.linalg.solve(K[:, n:, n:], K[:, n:, :n])
