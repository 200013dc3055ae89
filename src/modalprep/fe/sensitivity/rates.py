"""Derivatives of stiffness and mass of a model by a parameter, as quadratic forms of displacements (theory 1.7).

Each is exact: energies that are proportional to a parameter are their own derivative; the mass is a polynomial of at
most third degree, for which differences are exact; moduli of shells and sections of beams are analytic functions, whose
derivative a complex step gives to the last digits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.parts import Part
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.distribution import MassRule
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.properties.properties import Beam, Shell
from modalprep.fe.sensitivity.parameters import ModelParameter, materials_of, scaled
from modalprep.fe.sensitivity.shells import STEP, shell_rate

# Difference of f(1/2), f(3/4), f(5/4), f(3/2) that is the derivative at 1 of polynomials of up to the fourth degree.
CUBIC = ((0.5, 1 / 3), (0.75, -8 / 3), (1.25, 8 / 3), (1.5, -1 / 3))
LINEAR = ((1.0, -1.0), (2.0, 1.0))


def model_rates(model: FEModel, parameter: ModelParameter, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``phi_a^T (p dK/dp) phi_b`` and ``phi_a^T (p dM/dp) phi_b``, each (k, k).

    Parameters
    ----------
    model : FEModel
    parameter : ModelParameter
    phi : (n_dof, k)
        Displacements, mesh axes.

    Raises
    ------
    InputError
        When the derivative is not available: section sizes of beams with released ends.
    """
    K, M = np.zeros((2, phi.shape[1], phi.shape[1]))
    elements = model.elements
    if elements is None:
        raise InputError("a model from matrices has no properties to differentiate by; assemble the mesh")
    for part in elements.parts:
        if parameter.belongs_to(part.group, part.section):
            for piece in part.pieces():
                own = _Piece(model, elements.rule, part, piece, parameter, phi)
                K += own.stiffness()
                M += own.mass()
    return (K + K.T) / 2, (M + M.T) / 2


class _Piece:
    """Some elements of a part whose property depends on the parameter."""

    def __init__(
        self, model: FEModel, rule: MassRule, part: Part, piece: slice, parameter: ModelParameter, phi: np.ndarray
    ) -> None:
        self.model = model
        self.rule = rule
        self.part = part
        self.piece = piece
        self.parameter = parameter
        self.block = self._block(1.0)
        dofs = model.dof[self.block.nodes, : self.block.components].reshape(len(self.block.nodes), -1)
        self.d = phi[dofs]
        if self.in_section and np.any(np.nan_to_num(part.data.get("pins", 0.0)) > 0):
            raise InputError(f"{parameter.name}: beams with released ends have no derivative by the size of a section")

    @property
    def in_section(self) -> bool:
        """Whether the parameter is a size of a beam's section, on which its shapes depend."""
        return isinstance(self.part.section, Beam) and self.parameter.material is None

    def stiffness(self) -> np.ndarray:
        kind, section = self.parameter.kind, self.part.section
        if kind in ("density", "mass"):
            return np.zeros((self.d.shape[2],) * 2)
        if self.in_section:
            return self._form(np.imag(self._stiffness(1 + STEP * 1j)) / STEP)
        block = self.block
        depends = kind == "thickness" or len(materials_of(section)) > 1
        if isinstance(section, Shell) and isinstance(block, ShellBlock | CurvedShellBlock) and depends:
            return shell_rate(block, scaled(section, self.parameter, 1 + STEP * 1j), self.d)
        if kind in ("A", "J"):
            return self._difference(LINEAR, self._stiffness)
        return self._form(self._stiffness(1.0))

    def mass(self) -> np.ndarray:
        kind = self.parameter.kind
        if kind in ("modulus", "stiffness"):
            return np.zeros((self.d.shape[2],) * 2)
        if self.in_section:
            return self._form(np.imag(self._mass(1 + STEP * 1j)) / STEP)
        return self._difference(CUBIC if kind == "thickness" else LINEAR, self._mass)

    def _difference(
        self, rule: tuple[tuple[float, float], ...], matrices: Callable[[complex], np.ndarray]
    ) -> np.ndarray:
        return np.sum([weight * self._form(matrices(factor)) for factor, weight in rule], axis=0)

    def _stiffness(self, factor: complex) -> np.ndarray:
        K = self._block(factor).stiffness()
        assert K is not None  # what depends on such a parameter has stiffness
        return K

    def _mass(self, factor: complex) -> np.ndarray:
        mass = self.rule.inertia(self._block(factor), self.model.points).mass()
        assert mass is not None  # what depends on such a parameter has mass
        return mass.matrix()

    def _block(self, factor: complex) -> Block:
        """Return the elements with the parameter times a factor, thicknesses that the mesh prescribes included."""
        part = replace(self.part, section=scaled(self.part.section, self.parameter, factor))
        if self.parameter.kind == "thickness" and "thickness" in part.data:
            part = replace(part, data=part.data | {"thickness": factor * part.data["thickness"]})
        return part.block(self.piece, self.model.points + self.model.origin, self.model.origin)

    def _form(self, A: np.ndarray) -> np.ndarray:
        """``sum d_a^T A d_b (k, k)`` of element matrices ``(ne, nl, nl)``."""
        k = self.d.shape[2]
        return self.d.reshape(-1, k).T @ (A @ self.d).reshape(-1, k)
