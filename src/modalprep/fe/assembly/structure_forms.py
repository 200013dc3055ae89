"""Forms over a whole structure: ``skfem.asm(form, structure)`` of weak forms and of compiled loops alike."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from skfem.assembly import BilinearForm, Form, Functional, LinearForm, asm
from skfem.assembly.form.coo_data import COOData

from modalprep.fe.assembly.geometric_stiffness import GeometricStiffness
from modalprep.fe.assembly.link_stiffness import LinkStiffness
from modalprep.fe.assembly.structure import Structure
from modalprep.fe.assembly.totals import MassTensor
from modalprep.fe.elements.mass import RigidInertia

AXES = range(3)


class Summed(COOData):
    """A matrix, vector or number that is summed up already, where `skfem.asm` expects those of single cells."""

    def __init__(self, value: Any) -> None:
        self.value = value
        self.shape = np.shape(value)
        self.local_shape = None

    @property
    def indices(self) -> np.ndarray:
        """(order, k) rows and columns."""
        return np.array(self.value.tocoo().coords if len(self.shape) == 2 else np.indices(self.shape))

    @property
    def data(self) -> np.ndarray:
        """(k,) entries."""
        return self.value.tocoo().data if len(self.shape) == 2 else np.atleast_1d(self.value)

    def __add__(self, other: COOData | int) -> COOData:
        """Add the matrices of other cells."""
        return self if isinstance(other, int) else COOData(self.indices, self.data, self.shape, None) + other

    def todefault(self) -> Any:
        """Return the value."""
        return self.value


class _OverStructure(Form):
    """A form whose value a function of a structure gives."""

    def __init__(self, value: Callable[..., Any], like: Form) -> None:
        super().__init__(like)
        self._value = value

    def coo_data(self, structure: Structure, **given: Any) -> Summed:
        """Return the value in the shape that `skfem.asm` adds up."""
        given.pop("idx", None)
        return Summed(self._value(structure, **given))

    elemental = coo_data

    def assemble(self, structure: Structure, **given: Any) -> Any:
        """Return the value."""
        return self._value(structure, **given)


class MatrixForm(_OverStructure, BilinearForm):
    """A bilinear form over a structure."""


class VectorForm(_OverStructure, LinearForm):
    """A linear form over a structure."""


class NumberForm(_OverStructure, Functional):
    """A functional over a structure."""


class ModelForms(NamedTuple):
    """The forms of which a model consists (theory 1).

    Attributes
    ----------
    stiffness, mass : MatrixForm
    geometric_stiffness : MatrixForm
        For displacements ``d (n_dof,)``.
    mass_of_pair : MatrixForm
        ``M_ab`` for axes a and b.
    first, second : VectorForm
        ``g`` for an axis a; ``h`` for axes a and b.
    total, moment, moment_of_pair : NumberForm
        Mass; first moment for an axis a; second moment for axes a and b.
    mass_tensor, prestress : callable
        What a model keeps of `mass_of_pair` and `geometric_stiffness`.
    """

    stiffness: MatrixForm
    geometric_stiffness: MatrixForm
    mass: MatrixForm
    mass_of_pair: MatrixForm
    first: VectorForm
    second: VectorForm
    total: NumberForm
    moment: NumberForm
    moment_of_pair: NumberForm
    mass_tensor: Callable[[Structure], MassTensor]
    prestress: Callable[[Structure, LinkStiffness], GeometricStiffness]

    def rigid(self, structure: Structure) -> RigidInertia:
        """Return mass, first and second moments about the origin of the model."""
        s0 = [asm(self.moment, structure, a=a) for a in AXES]
        E0 = [[asm(self.moment_of_pair, structure, a=a, b=b) for b in AXES] for a in AXES]
        return RigidInertia(m=float(asm(self.total, structure)), s0=np.array(s0), E0=np.array(E0))

    def linear(self, structure: Structure) -> tuple[np.ndarray, np.ndarray]:
        """Return ``g (n, 3)`` and ``h (n, 3, 3)``."""
        g = np.stack([asm(self.first, structure, a=a) for a in AXES], axis=1)
        h = np.stack([asm(self.second, structure, a=a, b=b) for a in AXES for b in AXES], axis=1)
        return g, h.reshape(-1, 3, 3)
