"""Mass and energy of the groups of a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.elements.distribution import Inertia
from modalprep.fe.elements.kernels import ahead
from modalprep.fe.elements.mass import MassObjects


@dataclass(frozen=True, eq=False)
class Groups:
    """The groups of a model's elements.

    Attributes
    ----------
    of, kinds : list of str
        Group and cell type of each block of elements, in the order in which the model has them.
    inertias : list of Inertia
        What has the mass of each block.
    masses : list of float
        Mass of each block, kg.
    dof : (n_nodes, 6) int

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> groups = cantilever_model(elements=4).groups
    >>> groups.names, groups.count("beam"), round(groups.mass("beam"), 9)
    (['beam'], {'line': 4}, 12.0)
    """

    of: list[str]
    kinds: list[str]
    inertias: list[Inertia]
    masses: list[float]
    dof: np.ndarray

    @property
    def names(self) -> list[str]:
        """The groups, in the order of their first elements."""
        return list(dict.fromkeys(self.of))

    def count(self, name: str) -> dict[str, int]:
        """Return the number of elements of a group by their cell type."""
        found: dict[str, int] = {}
        for group, kind, inertia in zip(self.of, self.kinds, self.inertias, strict=True):
            if group == name:
                found[kind] = found.get(kind, 0) + len(inertia.nodes)
        return found

    def mass(self, name: str) -> float:
        """Return the mass of a group, kg."""
        return float(sum(mass for group, mass in zip(self.of, self.masses, strict=True) if group == name))

    def summed(self, values: dict[str, np.ndarray]) -> np.ndarray:
        """Return sums over each group ``(g, ...)`` of values of the cells ``{type: (n_cells, ...)}``.

        Examples
        --------
        >>> from modalprep.examples import cantilever_model
        >>> model = cantilever_model(elements=4)
        >>> model.groups.summed(model.strain_energy.volume()).round(4)  # 4e-4 m^2 times 10 m
        array([0.004])
        """
        names = self.names
        start = dict.fromkeys(values, 0)
        found = np.zeros((len(names), *next(iter(values.values())).shape[1:]))
        for group, kind, inertia in zip(self.of, self.kinds, self.inertias, strict=True):
            rows = slice(start[kind], start[kind] + len(inertia.nodes))
            found[names.index(group)] += values[kind][rows].sum(axis=0, dtype=float)
            start[kind] = rows.stop
        return found

    def modal_mass(self, Phi: np.ndarray) -> np.ndarray:
        """Return the share ``phi^T M_g phi (g, n)`` of each group in the modal masses of ``Phi (n_dof, n)``.

        The mass matrices of the elements are evaluated again, block by block, so that none is kept. With modal masses
        of 1 this is the share in the kinetic energy; its sum over the groups is 1.

        Examples
        --------
        >>> from modalprep.examples import cantilever_model
        >>> model = cantilever_model(elements=4)
        >>> model.groups.modal_mass(model.rigid_body()[:, :1]).round(9)  # a unit translation
        array([[12.]])
        """
        names = self.names
        found = np.zeros((len(names), Phi.shape[1]))
        for group, share in zip(self.of, ahead(lambda inertia: self._of(inertia, Phi), self.inertias), strict=True):
            found[names.index(group)] += share
        return found

    def _of(self, inertia: Inertia, Phi: np.ndarray) -> np.ndarray:
        mass = inertia.mass()
        if mass is None:
            return np.zeros(Phi.shape[1])
        own = Phi[self.dof[inertia.nodes, : inertia.components]]  # (ne, nn, components, n)
        return _quadratic(mass, own)


def _quadratic(mass: MassObjects, own: np.ndarray) -> np.ndarray:
    """Return the sum over elements of ``u^T M u (n,)`` of displacements ``own (ne, nn, c, n)``."""
    ne, nn, _, n = own.shape
    if mass.form == "scalar":
        matrix = mass.tensor
        u = own[:, :, :3].reshape(ne, nn, -1)
    else:
        matrix = mass.matrix()
        u = own.reshape(ne, -1, n)
    return ((matrix @ u) * u).reshape(-1, n).sum(axis=0)
