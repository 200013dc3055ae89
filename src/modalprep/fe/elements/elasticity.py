"""Elasticity of solids: from material and axes to stiffness, stress and energy of elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.kernels import directional_elastic, directional_stress, elastic, in_threads, isotropic_stress
from modalprep.fe.properties.materials import Material
from modalprep.fe.properties.properties import Solid
from modalprep.vectors import frame_of_axes

PLACE = ((0, 3, 5), (3, 1, 4), (5, 4, 2))  # of each stress among 11, 22, 33, 12, 23, 13
ORTHONORMAL = 1e-6


@dataclass(frozen=True, eq=False)
class Elasticity:
    """Moduli of elements.

    Attributes
    ----------
    moduli : (float, float) or (ne or 1, 3, 3, 3, 3)
        Lame's constants of an isotropic material, Pa; of others, in mesh axes: ``sigma_ab = c_abkl u_k,l``, Pa.
    """

    moduli: tuple[float, float] | np.ndarray

    @classmethod
    def of(cls, section: Solid, frames: np.ndarray | None = None) -> Elasticity:
        """Return the elasticity of a section; ``frames (ne, 3, 3)`` have the axes of single elements, or NaN.

        Raises
        ------
        InputError
            When a frame is not orthonormal.
        """
        material = section.material
        if isinstance(material, Material):
            return cls((material.E * material.nu / ((1 + material.nu) * (1 - 2 * material.nu)), material.G))
        c = material.moduli()[np.array(PLACE)[:, :, None, None], np.array(PLACE)]
        own = np.eye(3) if section.axes is None else frame_of_axes(section.axes, "a solid")
        R = own[None] if frames is None else np.where(np.isnan(frames), own, frames)
        if np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() > ORTHONORMAL:
            raise InputError("the axes of the material of a solid element are not orthonormal; correct its frame")
        return cls(np.einsum("eia,ejb,ekc,eld,ijkl->eabcd", R, R, R, R, c, optimize=True))

    def stiffness(self, grad: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """Return the stiffness ``(ne, 3 nf, 3 nf)`` of shapes with gradients ``grad (ne, nq, nf, 3)``."""
        K = np.empty((len(dx), 3 * grad.shape[2], 3 * grad.shape[2]))
        if isinstance(self.moduli, tuple):
            in_threads(elastic, len(dx), grad, dx, *self.moduli, K)
        else:
            in_threads(directional_elastic, len(dx), grad, dx, self.moduli, K)
        return K

    def stress(self, grad: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Return Cauchy's stress ``(ne, nq, 3, 3, k)``, Pa, of displacements ``d (ne, nf, 3, k)`` of the shapes."""
        d, sigma = np.ascontiguousarray(d), np.empty((*grad.shape[:2], 3, 3, d.shape[3]))
        if isinstance(self.moduli, tuple):
            in_threads(isotropic_stress, len(d), grad, d, *self.moduli, sigma)
        else:
            in_threads(directional_stress, len(d), grad, d, self.moduli, sigma)
        return sigma

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Return the energy per volume ``(ne, nq)`` of symmetric strains ``(ne, nq, 3, 3)``."""
        if isinstance(self.moduli, tuple):
            lam, mu = self.moduli
            return lam * np.einsum("eqaa->eq", strain) ** 2 / 2 + mu * np.einsum("eqab,eqab->eq", strain, strain)
        c = np.broadcast_to(self.moduli, (len(strain), 3, 3, 3, 3))
        return np.einsum("eqab,eabcd,eqcd->eq", strain, c, strain, optimize=True) / 2

    def piece(self, some: slice | np.ndarray) -> Elasticity:
        """Return that of `some` of the elements."""
        if isinstance(self.moduli, tuple) or len(self.moduli) == 1:
            return self
        return Elasticity(self.moduli[some])
