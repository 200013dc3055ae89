"""A sector at a speed of rotation: prestress, change of the centrifugal forces, Coriolis forces, second-order mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.assembly.model import FEModel
from modalprep.reduction.cyclic.problem import Problem, Spin
from modalprep.vectors import skew


def at_speed(problem: Problem, speed: float) -> Problem:
    """Return the problem at a speed (rad/s) about the axis of the symmetry.

    Examples
    --------
    >>> from modalprep.examples import disc_sector
    >>> from modalprep.reduction.cyclic.sector import make_sector
    >>> mesh, model, cyclic = disc_sector()
    >>> problem = Problem(make_sector(model, mesh, cyclic, held=True), True, "auto")
    >>> at_speed(problem, 100.0).spin.x.shape == (model.n_dof,)
    True
    """
    sector = problem.sector
    model, cyclic = sector.model, sector.cyclic
    w = skew(speed * cyclic.direction)
    W = w @ w
    field = np.concatenate([W @ (model.origin - cyclic.point), W.ravel()])
    load = model.inertia_loads @ field
    x = sector.C @ problem.static(0, (sector.C.T @ load)[:, None])[:, 0]
    K = model.geometric_stiffness(x, load) + model.rotating_mass(field) + _weighted(model, W)
    return replace(problem, spin=Spin(sector.reduced(K), sector.reduced(2 * _weighted(model, w)), x))


def _weighted(model: FEModel, factors: np.ndarray) -> csr_array:
    """Return the sum of the mass tensor times factors (3, 3)."""
    return sum((factors[a, b] * model.M_ab[a, b] for a, b in zip(*np.nonzero(factors), strict=True)), start=0 * model.M)


def moved_mass(problem: Problem, n: int, Z: np.ndarray) -> np.ndarray:
    """Return the mass (k, k) of orthonormal shapes (p, k) of n nodal diameters about the steady displacement.

    As `prestressed_modes`: their motion is ``phi_k + Gamma(x, phi_k)``, and ``phi_i M Gamma(x, phi_k)`` is the work on
    both by the geometric stiffness of the static response to ``M phi_i``. Of products of shapes the mean over the ring
    is that of the products of their real and of their imaginary parts.
    """
    sector, spin = problem.sector, problem.spin
    assert spin is not None
    model = sector.model
    inside = sector.map(n) @ Z
    static = sector.C @ problem.static(n, problem.mass @ inside)
    shape = sector.C @ inside
    both = np.column_stack([spin.x, shape.real, shape.imag])
    inertia = model.M @ both[:, 1:]
    work = model.rotating_mass.project_modes(both, slice(1, None))[:, 0, 1:]
    work -= model.geometric_stiffness.project(np.hstack([static.real, static.imag]), inertia, both)[:, 0, 1:]
    (rr, ri), (ir, ii) = (np.split(part, 2, axis=1) for part in np.split(work, 2))
    motion = np.eye(Z.shape[1]) + (rr + ii + 1j * (ri - ir) if np.iscomplexobj(Z) else rr)
    return motion.conj().T @ motion
