"""Rigid bodies: modal bodies without modes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import FAR
from modalprep.reduction.table import ModeTable
from modalprep.suggest import refuse_name
from modalprep.vectors import MatrixLike, VectorLike, refuse_impossible_inertia


def rigid_body(
    name: str, *, mass: float, centre: VectorLike, inertia: MatrixLike, interfaces: Mapping[str, VectorLike]
) -> FlexibleBody:
    """Return a rigid body with its frame at the first interface.

    Parameters
    ----------
    mass : float
        kg.
    centre : (3,)
        Centre of mass, m.
    inertia : (3, 3)
        About the centre of mass, kg m^2.
    interfaces : {name: (3,)}
        m; the first is the root.

    Returns
    -------
    FlexibleBody
        Without modes, its frame at the first interface.

    Raises
    ------
    InputError
        When the mass is not positive, no body can have the inertia, or there is no interface.

    Examples
    --------
    >>> rod = rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0, 1 / 12, 1 / 12]),
    ...                  interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])})
    >>> rod.n, round(float(rod.E0[0, 0]), 6)
    (0, 0.333333)
    """
    what = f"rigid body {name!r}: "
    if not 0 < mass < np.inf:
        raise InputError(f"{what}mass = {mass:g} must be positive")
    inertia = np.asarray(inertia, dtype=float)
    refuse_impossible_inertia(inertia, what)
    for interface in interfaces:
        refuse_name(interface, f"{what}interface")
    positions = np.array(list(interfaces.values()), dtype=float)
    if not len(positions) or not (np.all(np.abs(positions) < FAR) and np.all(np.abs(centre) < FAR)):
        raise InputError(f"{what}needs an interface, and positions of three numbers below {FAR:g} m")
    c = np.asarray(centre, dtype=float) - positions[0]
    E0 = np.trace(inertia) / 2 * np.eye(3) - inertia + mass * np.outer(c, c)
    k = len(positions)
    moments = np.trace(E0) - np.diag(E0)
    none = ModeTable.empty(np.concatenate([np.full(3, mass), moments]))
    return FlexibleBody(
        name=name,
        m=float(mass),
        s0=mass * c,
        E0=E0,
        S=np.zeros((3, 0)),
        H=np.zeros((3, 3, 0)),
        P=np.zeros((3, 3, 0, 0)),
        Kg_A=np.zeros((3, 0, 0)),
        Kg_W=np.zeros((3, 3, 0, 0)),
        Kg_F=np.zeros((k, 3, 0, 0)),
        Kg_T=np.zeros((k, 3, 0, 0)),
        phi=np.zeros((k, 3, 0)),
        psi=np.zeros((k, 3, 0)),
        K=np.zeros(0),
        D=np.zeros(0),
        frequency=np.zeros(0),
        interface_name=tuple(interfaces),
        interface_position=positions - positions[0],
        points=positions - positions[0],
        cells={},
        shape=np.zeros((k, 3, 0)),
        modes=none,
    )
