"""Response of a rotor to unbalance over its speed: what turns with it pushes steadily in axes that turn.

So the motion there is constant where supports are alike in all directions, and has a few multiples of the speed where
they are not: one solution with Hill's matrix at each speed. Seen from the ground it has the frequency of the speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.rotors.campbell import AtSpeed, Systems, ascending, at_speed
from modalprep.multibody.rotors.hill import HARMONICS, across, drives_more, hill_matrices, motion_spectrum
from modalprep.multibody.rotors.turning import Spinning, Turn, turn
from modalprep.records import Record
from modalprep.suggest import refuse_unknown
from modalprep.vectors import VectorLike, vector

RANK = 1e-11  # of Hill's matrix: motions without stiffness, which unbalance does not drive
STRAIGHT = 1e-6  # share of an unbalance along the axis, above which it is not one
FINE = 8  # speeds within the width of a peak whose height they show
HALF_POWER = 1 / np.sqrt(2)  # of a peak


@dataclass(frozen=True, kw_only=True)
class Peak(AtSpeed):
    """A peak of an amplitude over the speed.

    Attributes
    ----------
    speed : float
        rad/s.
    amplitude : float
        m.
    amplification : float
        Speed over the width of the peak at 0.707 of its height; NaN where the speeds do not reach there.

    Examples
    --------
    >>> Peak(speed=100 * np.pi, amplitude=1e-4, amplification=8.0).rpm
    3000.0
    """

    amplitude: float
    amplification: float


@dataclass(frozen=True, eq=False, kw_only=True)
class UnbalanceResponse(Record):
    """Motion of the interfaces at the frequency of the speed.

    Attributes
    ----------
    speed : (ns,)
        rad/s.
    motion : {str: (ns, 6) complex}
        Of each ``body.interface``: amplitudes ``a`` of displacements (m) and rotations (rad), ``Re(a exp(i W t))`` in
        inertial axes, the rotor at its start at t = 0.
    axis : (3,)
        Unit vector of the spin, inertial.
    notes : tuple of str

    Examples
    --------
    See `unbalance_response`.
    """

    speed: np.ndarray
    motion: dict[str, NDArray[np.complex128]]
    axis: np.ndarray
    notes: tuple[str, ...] = ()

    def orbit(self, interface: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the semi-axes of the ellipse of an interface across the axis.

        Returns
        -------
        (ns,), (ns,)
            m; the second is negative where the ellipse is run through against the spin.

        Raises
        ------
        InputError
            When there is no such interface.
        """
        refuse_unknown(interface, self.motion, "the interfaces are")
        a, b = across(self.motion[interface][:, :3], self.axis)
        forward, backward = np.abs(a + 1j * b) / 2, np.abs(a - 1j * b) / 2
        return forward + backward, forward - backward

    def phase(self, interface: str) -> np.ndarray:
        """Return the angle of the forward circle of an interface, the rotor at its start.

        Returns
        -------
        (ns,)
            rad, from the inertial axis that is most across the axis of the rotor: y where this is x. A lag is negative.
        """
        a, b = across(self.motion[interface][:, :3], self.axis)
        return np.angle(a + 1j * b)

    def peaks(self, interface: str) -> list[Peak]:
        """Return the peaks of the larger semi-axis, with the amplification factors of API 617.

        Returns
        -------
        list of Peak
        """
        large = self.orbit(interface)[0]
        tops = [k for k in range(1, len(large) - 1) if large[k - 1] < large[k] >= large[k + 1]]
        return [self._peak(large, k) for k in tops]

    def _peak(self, large: np.ndarray, k: int) -> Peak:
        """Return the peak at the top of the parabola through a largest value and its neighbours."""
        curve = np.polyfit(self.speed[k - 1 : k + 2] - self.speed[k], large[k - 1 : k + 2], 2)
        shift = -curve[1] / (2 * curve[0])
        top = float(np.polyval(curve, shift))
        below = _crossing(self.speed[k::-1], large[k::-1], HALF_POWER * top)
        above = _crossing(self.speed[k:], large[k:], HALF_POWER * top)
        speed = float(self.speed[k] + shift)
        return Peak(speed=speed, amplitude=top, amplification=speed / (above - below))


def _crossing(speed: np.ndarray, values: np.ndarray, level: float) -> float:
    """Return the first speed from the beginning at which values fall below a level, NaN where they do not."""
    low = np.flatnonzero(values < level)
    if not len(low):
        return np.nan
    k = int(low[0])
    return float(np.interp(level, [values[k], values[k - 1]], [speed[k], speed[k - 1]]))


def unbalance_response(
    system: Systems,
    joint: str,
    speeds: VectorLike,
    unbalance: Mapping[str, VectorLike],
    *,
    axis: VectorLike | None = None,
) -> UnbalanceResponse:
    """Return the steady motion of a rotor under unbalance over its speed.

    Parameters
    ----------
    system, joint, speeds, axis
        As in `campbell`. What is unbalanced in the body itself is not counted.
    unbalance : {``body.interface``: (3,)}
        kg m, mass times distance from the axis, in the axes of the body.

    Returns
    -------
    UnbalanceResponse

    Raises
    ------
    InputError
        When an interface is unknown or not on the rotor, or an unbalance is not across the axis; as `campbell`.
    SimulationError
        As `campbell`.

    References
    ----------
    M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, Dynamics of Rotating Machines, Cambridge 2010, chapter 6.
    API Standard 617 (amplification factor). Theory 5.10.

    Examples
    --------
    >>> import modalprep as mp
    >>> disc = mp.rigid_body("disc", mass=10.0, centre=np.zeros(3), inertia=np.diag([0.2, 0.1, 0.1]),
    ...                      interfaces={"hub": np.zeros(3)})
    >>> flight = mp.Joint(name="flight", type="free", parent="ground", child="disc")
    >>> shaft = mp.multibody.Bushing(name="shaft", between=("ground", "disc.hub"), stiffness=[0, 1e6, 1e6, 0, 0, 0],
    ...                              damping=[0, 100, 100, 0, 0, 0])
    >>> rotor = mp.System(bodies={"disc": disc}, joints=(flight,), loads=(shaft,))
    >>> found = unbalance_response(rotor, "flight", [100.0, 200.0], {"disc.hub": (0, 1e-3, 0)}, axis=(1, 0, 0))
    >>> expected = 1e-3 * found.speed**2 / np.abs(1e6 - 10 * found.speed**2 + 100j * found.speed)
    >>> bool(np.allclose(found.orbit("disc.hub")[0], expected))
    True
    """
    speed = ascending(speeds)
    found = [_at(system, joint, w, unbalance, axis) for w in speed.tolist()]
    names = found[0][0].interfaces
    parts = np.array([motion for _, motion in found]).reshape(len(speed), len(names), 6)
    response = UnbalanceResponse(
        speed=speed,
        motion={name: parts[:, k] for k, name in enumerate(names)},
        axis=found[0][0].axis,
        notes=tuple(dict.fromkeys(note for each, _ in found for note in each.notes)),
    )
    return response.with_(notes=(*response.notes, *_coarse(response)))


def _coarse(response: UnbalanceResponse) -> list[str]:
    """Return a note on peaks that a few speeds cannot show."""
    step = float(np.diff(response.speed).max(initial=0.0))
    peaks = [peak for end in response.motion for peak in response.peaks(end)]
    coarse = sorted({round(peak.rpm) for peak in peaks if not peak.speed / peak.amplification > FINE * step})
    if not coarse:
        return []
    about = ", ".join(map(str, coarse))
    few = f"have fewer than {FINE} speeds in their width, or are cut off"
    return [f"peaks near {about} rpm {few}; give more to know their height"]


def _at(
    system: Systems, joint: str, speed: float, unbalance: Mapping[str, VectorLike], axis: VectorLike | None
) -> tuple[Turn, np.ndarray]:
    """Return the equations at a speed, and the motion (6 ni,) of the interfaces at its frequency."""
    spinning = Spinning(at_speed(system, speed), joint, speed, axis)
    found = turn(spinning)
    force = np.zeros((len(found.interfaces), 2, 3))
    for name, value in unbalance.items():
        own = _place(found, name)
        force[own, 0] += speed**2 * _turned(spinning, found, name, vector(value))
    if not speed:
        return found, np.zeros(force.size, dtype=complex)
    z = _response(found, found.C[0].T @ force.ravel())
    spectrum = motion_spectrum(found, z[:, : found.C.shape[2]])
    motion = 2 * spectrum[len(spectrum) // 2 + 1]
    motion.reshape(-1, 2, 3)[:, 1] /= found.size
    return found, motion


def _place(found: Turn, name: str) -> int:
    on_rotor = [each for each, own in zip(found.interfaces, found.on_rotor, strict=True) if own]
    refuse_unknown(name, on_rotor, "an unbalance: the interfaces of the rotor are")
    return found.interfaces.index(name)


def _turned(spinning: Spinning, found: Turn, name: str, unbalance: np.ndarray) -> np.ndarray:
    """Return an unbalance (3,) in inertial axes at the start."""
    own = spinning.orientation(name.partition(".")[0]) @ unbalance
    along = abs(own @ found.axis)
    if along > STRAIGHT * np.linalg.norm(own):
        raise InputError(
            f"the unbalance of {name!r} has a part of {along:g} kg m along the axis of the rotor; leave it out"
        )
    return own


def _response(found: Turn, force: np.ndarray) -> np.ndarray:
    """Return the harmonics (harmonics, 2 n) of the motion under constant forces (n,) in turning axes."""
    z = np.zeros((1, 2 * len(force)), dtype=complex)
    for count in HARMONICS if len(found.E) > 1 else (0,):
        driven = np.zeros((2 * count + 1, 2 * len(force)))
        driven[count, len(force) :] = force
        A, _ = hill_matrices(found, count)
        z = np.linalg.lstsq(A, -driven.ravel(), rcond=RANK)[0].reshape(driven.shape)
        if not drives_more(found, 0.0, z):
            return z
    raise SimulationError(
        f"the motion at {found.speed:g} rad/s has more than {HARMONICS[-1]} multiples of the speed in turning axes: "
        "rotor and supports are too unsymmetric"
    )
