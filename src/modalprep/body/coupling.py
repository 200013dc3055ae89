"""Coupling matrices of an appendage: what the hub of a spacecraft feels of it, in hybrid coordinates (theory 4.8)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import cross_moment, rigid_mass_matrix
from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.vectors import skew, vector


@dataclass(frozen=True, eq=False, kw_only=True)
class CouplingMatrices(Record):
    """An appendage for small motions: forces on its hub, and its modes with the root clamped to the hub.

    With the acceleration a (6,) of the point, translation before rotation, the hub loads the appendage by

        f = mass a + participation q''        q'' + 2 zeta w q' + w^2 q = -participation^T a

    Attributes
    ----------
    point : (3,) float
        m, in the body's frame, whose axes all matrices have.
    mass : (6, 6) float
        Rigid mass matrix about the point: kg, kg m, kg m2.
    participation : (6, n) float
        Momentum and moment of momentum of each mode about the point, sqrt(kg) and m sqrt(kg).
    frequency : (n,) float
        Hz, with the root clamped.
    damping : (n,) float
        Damping ratios; 0 of a mode without stiffness.
    residual_mass : (6, 6) float
        ``mass - participation participation^T``: what no mode of the body moves, rigid with the hub.

    References
    ----------
    P. W. Likins, Dynamics and control of flexible space vehicles, JPL TR 32-1329 (1969): hybrid coordinates.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> found = coupling_matrices(uniform_beam(modes=2), [5.0, 0.0, 0.0])  # about its middle
    >>> found.mass.diagonal().round(2).tolist()
    [12.0, 12.0, 12.0, 0.03, 100.02, 100.01]
    """

    point: np.ndarray
    mass: np.ndarray
    participation: np.ndarray
    frequency: np.ndarray
    damping: np.ndarray
    residual_mass: np.ndarray


def coupling_matrices(body: FlexibleBody, point: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0)) -> CouplingMatrices:
    """Return the coupling matrices of a body whose root is clamped to a hub, about a point that moves with the hub.

    Parameters
    ----------
    body : FlexibleBody
        Its frame at the root.
    point : (3,)
        Reference point, m, in the body's frame: the centre of mass of the hub, say. The default is the root.

    Returns
    -------
    CouplingMatrices

    Raises
    ------
    InputError
        When the modes are those of a free body, or the point is not three numbers.

    References
    ----------
    Theory 4.8.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> found = coupling_matrices(uniform_beam(modes=4))
    >>> bool(found.residual_mass[1, 1] < 0.4 * found.mass[1, 1])  # bending moves the rest of the mass
    True
    """
    if not body.at_root:
        raise InputError(
            f"body {body.name!r} has the modes of a free body, which no hub holds; move its frame to an interface "
            "first (reroot, or import --root)"
        )
    r = vector(point, "the point")
    if r.shape != (3,) or not np.all(np.isfinite(r)):
        raise InputError(f"the point is {point!r}; give three numbers x, y, z in m")
    shift = np.block([[np.eye(3), skew(r)], [np.zeros((3, 3)), np.eye(3)]])  # of the point's motion to the root's
    mass = shift.T @ rigid_mass_matrix(body.m, body.s0, body.E0) @ shift
    participation = shift.T @ np.vstack([body.S, cross_moment(body.H)])
    omega = np.sqrt(body.K)
    return CouplingMatrices(
        point=r,
        mass=mass,
        participation=participation,
        frequency=body.frequency,
        damping=np.divide(body.D, 2 * omega, out=np.zeros(body.n), where=omega > 0),
        residual_mass=mass - participation @ participation.T,
    )
