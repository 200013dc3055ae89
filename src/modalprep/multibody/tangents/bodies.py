"""The force of a field on a body, and its derivatives by the modal coordinates (theory 5.8)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.kernels.tangents.frames import field_tangent
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack


@lru_cache(maxsize=256)  # bodies compare by identity
def _alone(body: FlexibleBody) -> Packed:
    """Return a body on a weld, whose link has its axes."""
    weld = Joint(name="weld", type="weld", parent="ground", child="body")
    return pack(System(bodies={"body": body}, joints=(weld,)))


def field_slopes(body: FlexibleBody, g: np.ndarray, gradient: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the derivative by q (6 + n, n) of the force of a field that is ``g + gradient x`` on a particle at x.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=1)
    >>> found = field_slopes(body, np.zeros(3), -np.eye(3), np.zeros(1))
    >>> bool(np.allclose(found[:3, 0], -body.S[:, 0]))
    True
    """
    packed = _alone(body)
    data, work = packed.data(), packed.sweep()
    assert data.modal is not None
    assert work.modes is not None
    data.modal.q[0, : body.n] = q
    field_tangent(packed.model, data, work, 0, g, np.ascontiguousarray(gradient).reshape(9))
    found = work.modes.bodies.by_q[0, : 6 + body.n, : body.n].copy()
    found[6:] -= np.diag(body.K)
    return found
