"""Coordinates and speeds by name out of the state vectors that analyses return."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.model.joint_types import PRESCRIBED
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed, Place
from modalprep.multibody.packing.tree import pack
from modalprep.suggest import refuse_other, refuse_unknown


class JointState(NamedTuple):
    """Coordinates and speeds of a joint, translations before rotations.

    Attributes
    ----------
    position : (n,)
        m or rad; the rotation of a spherical or free joint is a quaternion w, x, y, z.
    rate : (m,)
        m/s or rad/s.
    """

    position: np.ndarray
    rate: np.ndarray


class Coordinates:
    """A state vector read by name: ``.joint("hinge").position``, ``.modal("arm")``, ``.modal_rate("arm")``.

    `coordinates` makes one of what `static_equilibrium`, `linearise`, `impact` and `inverse_dynamics` return.
    """

    def __init__(self, system: System, packed: Packed, y: np.ndarray, motion: np.ndarray) -> None:
        self.system, self.packed, self._y, self._motion = system, packed, y, motion

    def modal(self, body: str) -> np.ndarray:
        """Return the modal coordinates of a body.

        Returns
        -------
        (..., n) float
            m sqrt(kg).
        """
        refuse_unknown(body, self.system.bodies, "state: body")
        return self._y[..., self.packed.modes_of(body)]

    def modal_rate(self, body: str) -> np.ndarray:
        """Return the rates of the modal coordinates of a body.

        Returns
        -------
        (..., n) float
            m sqrt(kg) / s.
        """
        refuse_unknown(body, self.system.bodies, "state: body")
        return self._y[..., self.packed.modal_rates_of(body)]

    def joint(self, name: str) -> JointState:
        """Return coordinates and speeds of a joint, prescribed ones included.

        Returns
        -------
        JointState
            Coordinates (..., k), m and rad, and speeds (..., k), m/s and rad/s.
        """
        places = self.packed.places_of(name)
        if places == ([], []):
            refuse_unknown(name, [joint.name for joint in self.system.joints], "state: joint")
        shape = self._y.shape[:-1]
        return JointState(
            *(
                np.stack([self.value_at(place) for place in part], axis=-1) if part else np.empty((*shape, 0))
                for part in places
            )
        )

    def value_at(self, place: Place) -> Any:
        """Return the number at a place that `Packed.places_of` names.

        Returns
        -------
        (...) float
            m or rad, m/s or rad/s; of a quaternion one of its numbers.
        """
        return self._y[..., place] if isinstance(place, int) else self._motion[..., place[0], place[1]]


def coordinates(system: System, y: np.ndarray, t: float | np.ndarray = 0.0) -> Coordinates:
    """Return what a state vector of a system holds, by name.

    Parameters
    ----------
    y : (..., nx + nu)
        State, or states, such as `Equilibrium.y` and `InverseDynamics.y`.
    t : float or (...)
        s, at which prescribed motions are taken.

    Returns
    -------
    Coordinates
        With ``joint(name)``, ``modal(body)`` and ``modal_rate(body)``.

    Raises
    ------
    InputError
        When the state has another size.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> state = coordinates(arm, np.array([0.1, 2.0, 3.0, 0.4, 5.0, 6.0]))
    >>> state.joint("hinge").position, state.joint("hinge").rate, state.modal("arm")
    (array([0.1]), array([0.4]), array([2., 3.]))
    """
    refuse_other("coordinates: the system", System, system)
    packed = pack(system)
    y = np.asarray(y, dtype=float)
    size = packed.nx + packed.nu
    if y.ndim == 0 or y.shape[-1] != size:
        raise InputError(f"the state of this system has {size} numbers; the one given has the shape {y.shape}")
    return Coordinates(system, packed, y, _prescribed(packed, np.broadcast_to(t, y.shape[:-1])))


def _prescribed(packed: Packed, t: np.ndarray) -> np.ndarray:
    """Return position, rate and acceleration ``(..., nl, 3)`` of the prescribed hinges at times ``(...)``."""
    motion = np.zeros((*t.shape, len(packed.links), 3))
    for i, (link, kind) in enumerate(zip(packed.links, packed.types, strict=True)):
        if kind == PRESCRIBED:
            law = link.joint.motions[link.hinge]
            motion[..., i, :] = np.reshape([law(float(each)) for each in t.ravel()], (*t.shape, 3))
    return motion
