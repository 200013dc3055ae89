"""Mass as weak forms, the same for all families (theory 1.2).

A family says how its mass moves: by one or several bases whose displacement is that of mass of a density at a position.
Mass of a section beside the line or surface of an element is a basis of its own, whose displacement is per unit
of the distance, whose position is a direction and whose ``unit`` is 0: the distance itself integrates to zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from skfem.assembly import Form, Functional, LinearForm, asm
from skfem.assembly.form.coo_data import COOData
from skfem.helpers import dot

from modalprep.fe.elements.mass import RigidInertia
from modalprep.fe.forms.basis import ModelBasis
from modalprep.fe.forms.bilinear import AllTrials


# --8<-- [start:forms]
@AllTrials
def mass(u, v, w):
    """``M = int rho N^T N``."""
    return w.rho * dot(u, v)


@AllTrials
def mass_of_pair(u, v, w):
    """``M_ab = int rho N_a^T N_b``."""
    return w.rho * v[w.a] * u[w.b]


@LinearForm
def first(v, w):
    """``g_a = int rho N_a``."""
    return w.unit * w.rho * v[w.a]


@LinearForm
def second(v, w):
    """``h_ab = int rho x_b N_a``."""
    return w.rho * w.at[w.b] * v[w.a]


@Functional
def total(w):
    """``int rho``."""
    return w.unit * w.rho


@Functional
def moment(w):
    """``int rho x_a``."""
    return w.unit * w.rho * w.at[w.a]


@Functional
def moment_of_pair(w):
    """``int rho x_a x_b``."""
    return w.rho * w.at[w.a] * w.at[w.b]


# --8<-- [end:forms]


class Mass(NamedTuple):
    """Mass that moves as the displacement of a basis.

    Attributes
    ----------
    basis : ModelBasis
        Its first field is the displacement of the mass.
    rho : (ne or 1, nq or 1)
        Per measure of the basis: kg/m^3, kg/m^2 or kg/m; times m^2 where `unit` is 0.
    at : (3, ne, nq)
        Positions in the model's frame, m, or directions.
    unit : float
        1, or 0 where displacement and position are per distance.
    """

    basis: ModelBasis
    rho: np.ndarray
    at: np.ndarray
    unit: float = 1.0

    def assembled(self, form, **given):
        """Return the matrix, vector or number of a form of this mass."""
        return asm(form, self.basis, **self._given, **given)

    def cells(self, form: Form, **given: int) -> COOData:
        """Return the matrices of a form of the single cells."""
        return form.coo_data(self.basis, **self._given, **given)

    @property
    def _given(self) -> dict[str, Any]:
        return {"rho": np.atleast_2d(self.rho), "at": self.at, "unit": self.unit}


def added(form: Form, masses: Sequence[Mass], **given: int) -> Any:
    """Return the matrix, vector or number of a form of all masses."""
    return sum(mass.assembled(form, **given) for mass in masses)


def mass_vectors(masses: Sequence[Mass], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return ``g (n, 3)`` and ``h (n, 3, 3)`` in n DOFs."""
    g = np.zeros((n, 3))
    h = np.zeros((n, 3, 3))
    for a in range(3):
        g[:, a] = added(first, masses, a=a)
        for b in range(3):
            h[:, a, b] = added(second, masses, a=a, b=b)
    return g, h


def rigid_inertia(masses: Sequence[Mass]) -> RigidInertia:
    """Return mass, first and second moments."""
    axes = range(3)
    s0 = np.array([added(moment, masses, a=a) for a in axes])
    E0 = np.array([[added(moment_of_pair, masses, a=a, b=b) for b in axes] for a in axes])
    return RigidInertia(m=float(added(total, masses)), s0=s0, E0=E0)
