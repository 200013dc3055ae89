"""Whirl of a rotor at one speed: modes about the steady rotation, as they are seen from the ground.

The equations of coordinates that turn with the rotor repeat themselves after a turn. A mode is
``z = sum_m z_m exp((lambda + i m speed) t)`` (Floquet), and the amplitudes of all m are an eigenvector of one constant
matrix (Hill). Points of the rotor move as ``C z``, C turning once: their motion has further multiples of the speed. The
largest of them is what an observer on the ground calls the frequency of the mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from modalprep.errors import SimulationError
from modalprep.multibody.model.system import System
from modalprep.multibody.rotors.hill import HARMONICS, across, drives_more, hill_matrices, motion_spectrum
from modalprep.multibody.rotors.turning import Spinning, Turn, turn
from modalprep.records import Record
from modalprep.vectors import VectorLike

AT_REST = 1e-5  # of the slowest vibration and of the speed: what is slower is a motion without stiffness
SAME = 1e-6  # relative difference of eigenvalues of one mode
ALIKE = 0.99  # correlation of shapes of one mode
ACROSS = 1e-3  # share of a mode's motion across the axis, below which it is axial or torsional
PLANAR = 0.05  # whirl below which a mode has no direction


@dataclass(frozen=True, eq=False, kw_only=True)
class WhirlModes(Record):
    """Modes of a system with a rotor that turns steadily, seen from the ground, by ascending frequency.

    Attributes
    ----------
    speed : float
        rad/s.
    eigenvalue : (n,) complex
        1/s, of the largest harmonic of the motion in inertial axes.
    turning : (n,) complex
        1/s, of the largest harmonic in the coordinates that turn with the rotor.
    whirl : (n,) float
        1 where all points of the rotor circle with the spin, -1 where they circle against it, 0 where they move in
        planes, or the rotor is at rest.
    across : (n,) float
        Share of the rotor's motion across the axis; small for axial and torsional modes.
    motion : {str: (6, n) complex}
        Of each ``body.interface`` at that frequency: displacement (m) and rotation (rad), inertial axes, the largest of
        each mode 1 (rotations times the size of the system).
    shape : (n, harmonics, nc) complex
        Amplitudes of the scaled coordinates, by multiples of the speed from the middle one, which turns with the
        ground's axes.
    notes : tuple of str

    Examples
    --------
    See `whirl_modes`.
    """

    speed: float
    eigenvalue: NDArray[np.complex128]
    turning: NDArray[np.complex128]
    whirl: np.ndarray
    across: np.ndarray
    motion: dict[str, NDArray[np.complex128]]
    shape: NDArray[np.complex128]
    notes: tuple[str, ...] = ()

    @property
    def frequency(self) -> np.ndarray:
        """Hz (n,), in inertial axes."""
        return np.abs(self.eigenvalue.imag) / (2 * np.pi)

    @property
    def damping(self) -> np.ndarray:
        """Damping ratio (n,) in inertial axes, negative where the mode grows."""
        return -self.eigenvalue.real / np.abs(self.eigenvalue)

    @property
    def logarithmic_decrement(self) -> np.ndarray:
        """``-2 pi Re / |Im|`` of the eigenvalues (n,); infinite where a mode does not oscillate."""
        with np.errstate(divide="ignore"):
            return -2 * np.pi * self.eigenvalue.real / np.abs(self.eigenvalue.imag)

    @property
    def kind(self) -> tuple[str, ...]:
        """``forward``, ``backward``, ``planar``, or ``axial or torsional``."""
        return tuple(kind_of(whirl, across) for whirl, across in zip(self.whirl, self.across, strict=True))

    def __repr__(self) -> str:
        """Number of modes and speed."""
        return f"WhirlModes({len(self.eigenvalue)} modes at {self.speed:g} rad/s)"


def kind_of(whirl: float, across: float) -> str:
    """Return the motion of a mode in a word.

    Examples
    --------
    >>> kind_of(0.9, 1.0), kind_of(-0.9, 1.0), kind_of(0.0, 1.0), kind_of(0.9, 0.0)
    ('forward', 'backward', 'planar', 'axial or torsional')
    """
    if across < ACROSS:
        return "axial or torsional"
    if abs(whirl) < PLANAR:
        return "planar"
    return "forward" if whirl > 0 else "backward"


def whirl_modes(
    system: System, joint: str, speed: float, *, axis: VectorLike | None = None, modes: int = 10
) -> WhirlModes:
    """Return the modes of a system while one of its joints turns at a steady speed.

    Weight is left out: under it a flexible rotor has no steady state in axes that turn. Supports may differ across the
    axis, and so may the rotor; neither has to be symmetric. Where a rotor is not balanced, its linear equations are
    those of its motion about the axis that it is given.

    Parameters
    ----------
    joint : str
        The joint about which the rotor turns: revolute, cylindrical, spherical, or free, with bushings as bearings.
    speed : float
        rad/s.
    axis : (3,) or None
        Of a spherical or free joint: direction of the spin in the parent's frame; default: of its angular velocity.
    modes : int
        How many, the slowest first.

    Returns
    -------
    WhirlModes

    Raises
    ------
    InputError
        When the joint is unknown, cannot spin, or has no axis.
    SimulationError
        When there is no steady state, or no linear equations.

    References
    ----------
    M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, Dynamics of Rotating Machines, Cambridge 2010, chapters 5
    and 7. G. Genta, Dynamics of Rotating Systems, Springer 2005, chapter 5 (Hill's determinant). Theory 5.10.

    Examples
    --------
    >>> import numpy as np
    >>> import modalprep as mp
    >>> disc = mp.rigid_body("disc", mass=10.0, centre=np.zeros(3), inertia=np.diag([0.2, 0.1, 0.1]),
    ...                      interfaces={"hub": np.zeros(3)})
    >>> flight = mp.Joint(name="flight", type="free", parent="ground", child="disc")
    >>> shaft = mp.multibody.Bushing(name="shaft", between=("ground", "disc.hub"),
    ...                              stiffness=[1e6, 1e6, 1e6, 0, 0, 0])
    >>> found = whirl_modes(mp.System(bodies={"disc": disc}, joints=(flight,), loads=(shaft,)), "flight", 100.0,
    ...                     axis=(1, 0, 0))
    >>> bool(np.allclose(found.eigenvalue.imag[-3:], np.sqrt(1e6 / 10)))
    True
    """
    found = turn(Spinning(system, joint, speed, axis))
    chosen = _seen_modes(found, modes)
    return WhirlModes(
        speed=found.speed,
        eigenvalue=np.array([each.eigenvalue for each in chosen], dtype=complex),
        turning=np.array([each.turning for each in chosen], dtype=complex),
        whirl=np.array([each.whirl for each in chosen], dtype=float),
        across=np.array([each.across for each in chosen], dtype=float),
        motion=_motions(found, chosen),
        shape=np.array([each.shape for each in chosen]),
        notes=found.notes,
    )


class _Seen(NamedTuple):
    """A mode as it is seen from the ground."""

    value: complex  # in units of the rate, and the vector (harmonics, 2 n) of Hill's matrix
    vector: np.ndarray
    eigenvalue: complex
    turning: complex
    centre: float  # of its harmonics in the turning coordinates
    motion: np.ndarray  # (6 ni,) of the interfaces
    whirl: float
    across: float
    shape: np.ndarray  # (harmonics, nc)


def _seen_modes(found: Turn, modes: int) -> list[_Seen]:
    """Return the slowest modes, each once."""
    for count in HARMONICS if len(found.E) > 1 else (0,):
        chosen = sorted(_chosen(found, count), key=lambda each: abs(each.eigenvalue))[:modes]
        if not any(drives_more(found, each.value, each.vector) for each in chosen):
            return chosen
    raise SimulationError(
        f"the modes at {found.speed:g} rad/s have more than {HARMONICS[-1]} multiples of the speed in turning axes: "
        "rotor and supports are too unsymmetric"
    )


def _chosen(found: Turn, count: int) -> list[_Seen]:
    values, vectors = _roots(found, count)
    unit = found.speed / found.rate
    seen = [_seen(found, value, vector) for value, vector in zip(values, vectors, strict=True)]
    slow = AT_REST * (1 + abs(unit)) * found.rate
    moving = [each for each in seen if abs(each.eigenvalue) > slow and each.eigenvalue.imag >= -slow]
    once: list[_Seen] = []
    for each in sorted(moving, key=lambda each: abs(each.centre)):
        if abs(each.centre) <= 0.5 + SAME and not any(_is_same(each, other) for other in once):
            once.append(each)
    return once


def _is_same(a: _Seen, b: _Seen) -> bool:
    """Whether two modes are one, their harmonics counted from another one."""
    if abs(a.eigenvalue - b.eigenvalue) > SAME * abs(a.eigenvalue):
        return False
    size = np.linalg.norm(a.shape) * np.linalg.norm(b.shape)
    return bool(abs(np.vdot(a.shape, b.shape)) > ALIKE * size)


def _roots(found: Turn, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues (k,) in units of the rate, and vectors (k, 2 count + 1, 2 n): by inversion, for slow ones."""
    A, B = hill_matrices(found, count)
    mu, vectors = eig(np.linalg.solve(A - B, B))
    with np.errstate(divide="ignore", invalid="ignore"):
        return 1 + 1 / mu, vectors.T.reshape(-1, 2 * count + 1, found.E.shape[1])


def _seen(found: Turn, value: complex, vector: np.ndarray) -> _Seen:
    """Return a mode (harmonics, 2 n) as the interfaces move in it."""
    count = len(vector) // 2
    x = vector[:, : found.C.shape[2]]
    spectrum = motion_spectrum(found, x)
    largest = int(np.argmax(np.linalg.norm(spectrum, axis=1)))
    place = largest - len(spectrum) // 2
    motion = spectrum[largest]
    own = int(np.argmax(np.linalg.norm(x, axis=1))) - count
    energy = np.sum(np.abs(x) ** 2, axis=1)
    return _Seen(
        value=value,
        vector=vector,
        eigenvalue=complex(found.rate * value + 1j * place * found.speed),
        turning=complex(found.rate * value + 1j * own * found.speed),
        centre=float(energy @ np.arange(-count, count + 1) / energy.sum()),
        motion=motion,
        **_direction(motion.reshape(-1, 2, 3)[found.on_rotor].reshape(-1, 3), found.axis, found.speed),
        shape=_about(x, place, count),
    )


def _about(x: np.ndarray, place: int, count: int) -> np.ndarray:
    """Return the harmonics of a shape counted from that of the ground, from ``-reach`` to ``reach``."""
    reach = 2 * count + 1
    found = np.zeros((2 * reach + 1, x.shape[1]), dtype=complex)
    first = reach - count - place
    found[first : first + len(x)] = x
    return found


def _direction(motion: np.ndarray, axis: np.ndarray, speed: float) -> dict[str, float]:
    """Return the whirl and the share across the axis of motions (k, 3)."""
    a, b = across(motion, axis)
    forward, backward = (float(np.sum(np.abs(a + sign * 1j * b) ** 2)) / 2 for sign in (1, -1))
    all_of_it = float(np.sum(np.abs(motion) ** 2))
    whirl = np.sign(speed) * (forward - backward) / max(forward + backward, np.finfo(float).tiny)
    return {"whirl": whirl, "across": (forward + backward) / max(all_of_it, np.finfo(float).tiny)}


def _motions(found: Turn, seen: list[_Seen]) -> dict[str, np.ndarray]:
    """Return the motion of each interface, the largest of each mode one."""
    own = np.array([each.motion / each.motion[np.argmax(np.abs(each.motion))] for each in seen]).reshape(len(seen), -1)
    parts = own.T.reshape(len(found.interfaces), 2, 3, len(seen))
    parts[:, 1] /= found.size
    return dict(zip(found.interfaces, parts.reshape(len(found.interfaces), 6, -1), strict=True))
