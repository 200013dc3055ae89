"""Campbell diagrams: whirl over the speed of a rotor, each mode followed by its shape, and critical speeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, linear_sum_assignment

from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.multibody.model.system import System
from modalprep.multibody.rotors.whirl import WhirlModes, whirl_modes
from modalprep.records import Record
from modalprep.vectors import VectorLike

SPARE = 4  # modes beyond those that are asked for, which may come among them
LOST = 0.3  # MAC with the speed before, below which a mode is no longer among the slowest
UNSURE = 0.6  # and below which it is not sure to be the same
CRITICAL = 1e-9  # relative accuracy of a critical speed
BESIDE = 1e-4  # of it: there a forward whirl at the speed, which rests in turning axes, still has its direction

Systems = System | Callable[[float], System]


@dataclass(frozen=True, kw_only=True)
class AtSpeed(Record):
    """What is found at a speed (rad/s).

    Examples
    --------
    >>> AtSpeed(speed=100 * np.pi).rpm
    3000.0
    """

    speed: float

    @property
    def rpm(self) -> float:
        """Turns per minute."""
        return self.speed * 30 / np.pi


@dataclass(frozen=True, kw_only=True)
class CriticalSpeed(AtSpeed):
    """A speed at which a mode has a multiple of the speed as its frequency.

    Attributes
    ----------
    speed : float
        rad/s.
    order : float
        The frequency over the speed: 1 for unbalance.
    mode : int
        Its number in the diagram, from 0.
    kind : str
        ``forward``, ``backward``, ``planar`` or ``axial or torsional``: unbalance of a rotor in supports that are the
        same in all directions drives forward modes alone.
    logarithmic_decrement : float
        Of the mode there.

    Examples
    --------
    >>> CriticalSpeed(speed=100 * np.pi, order=1.0, mode=0, kind="forward", logarithmic_decrement=0.1).rpm
    3000.0
    """

    order: float
    mode: int
    kind: str
    logarithmic_decrement: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Campbell(Plotted, Record):
    """Modes over the speed.

    Attributes
    ----------
    speed : (ns,)
        rad/s.
    eigenvalue : (ns, n) complex
        1/s, in inertial axes; each column is a mode, followed by its shape. NaN where it is not among the slowest.
    whirl : (ns, n)
        From 1, forward, to -1, backward.
    across : (ns, n)
        Share of the motion across the axis.
    certainty : (ns, n)
        MAC with the mode at the speed before, 1 at the first.
    critical : tuple of CriticalSpeed
    at : tuple of WhirlModes
        All modes of each speed, by frequency.
    notes : tuple of str

    Examples
    --------
    See `campbell`.
    """

    speed: np.ndarray
    eigenvalue: NDArray[np.complex128]
    whirl: np.ndarray
    across: np.ndarray
    certainty: np.ndarray
    critical: tuple[CriticalSpeed, ...]
    at: tuple[WhirlModes, ...]
    notes: tuple[str, ...] = ()

    @property
    def frequency(self) -> np.ndarray:
        """Hz (ns, n), in inertial axes."""
        return np.abs(self.eigenvalue.imag) / (2 * np.pi)

    @property
    def logarithmic_decrement(self) -> np.ndarray:
        """``-2 pi Re / |Im|`` (ns, n): negative where a mode grows."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return -2 * np.pi * self.eigenvalue.real / np.abs(self.eigenvalue.imag)

    @property
    def first_unstable(self) -> float | None:
        """The lowest of the speeds (rad/s) at which a mode grows; None where none does."""
        grows = np.any(self.eigenvalue.real > _round_off(self.eigenvalue), axis=1)
        return float(self.speed[np.argmax(grows)]) if np.any(grows) else None

    def __repr__(self) -> str:
        """Numbers of modes, speeds and critical speeds."""
        counts = f"{self.eigenvalue.shape[1]} modes at {len(self.speed)} speeds"
        return f"Campbell({counts}, {len(self.critical)} critical speeds)"


def _round_off(eigenvalue: np.ndarray) -> np.ndarray:
    return 1e-9 * np.abs(eigenvalue)


def campbell(
    system: Systems,
    joint: str,
    speeds: VectorLike,
    *,
    axis: VectorLike | None = None,
    modes: int = 8,
    orders: Sequence[float] = (1.0,),
) -> Campbell:
    """Return the modes of a system with a rotor over its speed, and the critical speeds.

    Parameters
    ----------
    system : System, or callable
        A function of the speed (rad/s) returns the system at that speed: bearings whose stiffness depends on it.
    joint, axis
        As in `whirl_modes`.
    speeds : (ns,)
        rad/s, ascending.
    modes : int
        The slowest at the first speed, which are followed.
    orders : sequence of float
        Multiples of the speed that excite: 1 unbalance, 2 misalignment, the number of blades, ...

    Returns
    -------
    Campbell
        Critical speeds are found between the speeds given, each to 1e-9 of itself.

    Raises
    ------
    InputError
        When speeds do not ascend; as `whirl_modes`.
    SimulationError
        As `whirl_modes`.

    References
    ----------
    As `whirl_modes`. W. Campbell, Protection of steam-turbine disk wheels from axial vibration, Trans. ASME 46 (1924).

    Examples
    --------
    >>> import modalprep as mp
    >>> disc = mp.rigid_body("disc", mass=10.0, centre=np.zeros(3), inertia=np.diag([0.2, 0.1, 0.1]),
    ...                      interfaces={"hub": np.zeros(3)})
    >>> flight = mp.Joint(name="flight", type="free", parent="ground", child="disc")
    >>> shaft = mp.multibody.Bushing(name="shaft", between=("ground", "disc.hub"), stiffness=[0, 1e6, 1e6, 0, 0, 0])
    >>> rotor = mp.System(bodies={"disc": disc}, joints=(flight,), loads=(shaft,))
    >>> found = campbell(rotor, "flight", np.linspace(0, 500, 6), axis=(1, 0, 0))
    >>> sorted({round(each.speed, 6) for each in found.critical if each.kind == "forward"})  # sqrt(1e6 / 10)
    [316.227766]
    """

    @cache
    def at(w: float) -> WhirlModes:
        return whirl_modes(at_speed(system, w), joint, w, axis=axis, modes=modes + SPARE)

    speed = ascending(speeds)
    found = [at(w) for w in speed.tolist()]
    rows, certainty = _followed(found, modes)
    critical = [each for order in orders for each in _critical_speeds(at, speed, found, rows, order)]
    return Campbell(
        speed=speed,
        eigenvalue=_columns([each.eigenvalue for each in found], rows),
        whirl=_columns([each.whirl for each in found], rows),
        across=_columns([each.across for each in found], rows),
        certainty=certainty,
        critical=tuple(sorted(critical, key=lambda each: each.speed)),
        at=tuple(found),
        notes=tuple(dict.fromkeys(note for each in found for note in each.notes)),
    )


def at_speed(system: Systems, speed: float) -> System:
    """Return the system at a speed (rad/s), itself where it is the same at all.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> wall = Joint(name="wall", type="weld", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(wall,))
    >>> at_speed(arm, 10.0) is arm, at_speed(lambda speed: arm, 10.0) is arm
    (True, True)
    """
    return system if isinstance(system, System) else system(speed)


def ascending(speeds: VectorLike) -> np.ndarray:
    """Return speeds (rad/s) that ascend, else refuse them.

    Examples
    --------
    >>> ascending([0, 10])
    array([ 0., 10.])
    """
    speed = np.atleast_1d(np.asarray(speeds, dtype=float))
    if speed.ndim > 1 or not speed.size or speed[0] < 0 or np.any(np.diff(speed) <= 0):
        raise InputError("the speeds of a rotor must be a list that ascends from zero or more, in rad/s")
    return speed


def _columns(values: list[np.ndarray], rows: np.ndarray) -> np.ndarray:
    """Return the values (ns, n) of each mode that is followed, NaN where it is not among those of a speed."""
    return np.array([np.where(own >= 0, each[own], np.nan) for each, own in zip(values, rows, strict=True)])


def _followed(found: Sequence[WhirlModes], modes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the row (ns, n) of each mode at each speed, -1 where it is lost, and the MAC with its last one."""
    count = min(modes, len(found[0].eigenvalue))
    last = list(zip([found[0]] * count, range(count), strict=True))
    rows, certainty = [np.arange(count)], [np.ones(count)]
    for here in found[1:]:
        table = np.array([[_alike(there, k, here, j) for j in range(len(here.eigenvalue))] for there, k in last])
        own = np.full(count, -1)
        sure = np.zeros(count)
        for i, j in zip(*linear_sum_assignment(-table), strict=True):
            sure[i] = table[i, j]
            if sure[i] >= LOST:
                own[i], last[i] = j, (here, int(j))
        rows.append(own)
        certainty.append(sure)
    return np.array(rows), np.array(certainty)


def _alike(a: WhirlModes, i: int, b: WhirlModes, j: int) -> float:
    """Return the MAC of two modes of two speeds, harmonics of the speed taken together where one rotor is at rest."""
    x, y = a.shape[i], b.shape[j]
    if not (a.speed and b.speed):
        x, y = x.sum(axis=0, keepdims=True), y.sum(axis=0, keepdims=True)
    both = min(len(x), len(y)) // 2
    x, y = (each[len(each) // 2 - both : len(each) // 2 + both + 1] for each in (x, y))
    size = np.linalg.norm(x) * np.linalg.norm(y)
    return float(abs(np.vdot(x, y)) / size) ** 2 if size else 0.0


def _critical_speeds(
    at: Callable[[float], WhirlModes], speed: np.ndarray, found: Sequence[WhirlModes], rows: np.ndarray, order: float
) -> list[CriticalSpeed]:
    """Return the speeds at which a mode has `order` times the speed as its frequency."""
    return [
        _critical(at, found[k], int(rows[k, mode]), speed[k + 1], order, mode)
        for k in range(len(speed) - 1)
        for mode in range(rows.shape[1])
        if rows[k, mode] >= 0
        and rows[k + 1, mode] >= 0
        and _above(found[k], rows[k, mode], order) * _above(found[k + 1], rows[k + 1, mode], order) < 0
    ]


def _above(modes: WhirlModes, row: int, order: float) -> float:
    """Return by how much (rad/s) the frequency of a mode is above a multiple of the speed."""
    return float(modes.eigenvalue[row].imag - order * modes.speed)


def _critical(
    at: Callable[[float], WhirlModes], below: WhirlModes, row: int, above: float, order: float, mode: int
) -> CriticalSpeed:
    """Return the critical speed between that of `below` and `above` (rad/s)."""

    def nearest(w: float) -> tuple[WhirlModes, int]:
        here = at(w)
        return here, int(np.argmax([_alike(below, row, here, j) for j in range(len(here.eigenvalue))]))

    w = brentq(lambda w: _above(*nearest(w), order), below.speed, above, rtol=CRITICAL)
    here, own = nearest((1 - BESIDE) * w)
    return CriticalSpeed(
        speed=w,
        order=order,
        mode=mode,
        kind=here.kind[own],
        logarithmic_decrement=float(here.logarithmic_decrement[own]),
    )
