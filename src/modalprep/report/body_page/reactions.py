"""Static reactions of a body's supports under its weight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.vectors import UNIT, skew

G = 9.80665  # m/s^2, standard gravity


def gravity_reactions(body: FlexibleBody, supported: Sequence[str] = ()) -> np.ndarray:
    """Return the forces and moments with which the root and further held interfaces carry the body under 1 g.

    The modes deflect under ``S^T g`` with the held interfaces at rest (linear statics); the root carries the rest:
    all forces sum up to ``-m g``, their moments about the root to ``-s0 x g``. With the root alone nothing else is
    needed. The reactions of interfaces with constraint modes are exact, whatever other modes were kept.

    Parameters
    ----------
    body : FlexibleBody
        In the frame of its root.
    supported : sequence of str
        Further interfaces.

    Returns
    -------
    (3, 1 + len(held), 6) float
        N and N m about each interface, in the axes of the body, under gravity of 9.80665 m/s^2 along x, y and z.

    Raises
    ------
    InputError
        When the body has no such interface, moves without strain, or is not in the frame of its root.

    References
    ----------
    Theory 4.9.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> gravity_reactions(uniform_beam(modes=2))[2, 0].round(2)  # 12 kg over 10 m, gravity along z
    array([  -0.  ,   -0.  , -117.68,   -0.  ,  588.4 ,   -0.  ])
    """
    if not body.at_root:
        raise InputError("reactions need a body in the frame of its root; see reroot")
    if np.any(body.K == 0):
        raise InputError("the body moves without strain, so that it has no static reactions")
    missing = [name for name in supported if name not in body.interface_name]
    if missing:
        raise InputError(f"the body has no interface {missing[0]!r}; it has {', '.join(body.interface_name)}")
    rows = [body.interface_name.index(name) for name in supported]
    other = _reactions(body, rows)
    force = -G * body.m * UNIT
    moment = -G * np.array([np.cross(body.s0, axis) for axis in UNIT])
    for k, row in enumerate(rows):
        force = force - other[:, k, :3]
        moment = moment - other[:, k, 3:] - other[:, k, :3] @ skew(body.interface_position[row]).T
    return np.concatenate([np.concatenate([force, moment], axis=1)[:, None], other], axis=1)


def _reactions(body: FlexibleBody, rows: Sequence[int]) -> np.ndarray:
    """Return those of the interfaces ``(3, k, 6)``: ``K q = G S^T + A^T r`` with ``A q = 0``."""
    if not rows:
        return np.zeros((3, 0, 6))
    A = np.concatenate([np.concatenate([body.phi[row], body.psi[row]]) for row in rows])
    A = A / np.sqrt(body.K)
    load = G * body.S.T / np.sqrt(body.K)[:, None]
    r = -np.linalg.lstsq(A @ A.T, A @ load, rcond=1e-12)[0]
    return r.T.reshape(3, len(rows), 6)
