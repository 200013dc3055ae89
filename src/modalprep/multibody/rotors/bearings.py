"""Bearings and seals by coefficients that depend on the speed: tables, and the short journal bearing in closed form."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from modalprep.errors import InputError
from modalprep.multibody.evaluation.feedback import feedback
from modalprep.multibody.model.loads import Callback
from modalprep.records import Record
from modalprep.vectors import VectorLike

AXES = ("x", "y", "z")
PARTS = ("xx", "xy", "yx", "yy")


@dataclass(frozen=True, eq=False, kw_only=True)
class BearingCoefficients(Record):
    """Stiffness and damping across the axis of a rotor: ``force = -K shift - C velocity`` on the rotor.

    Attributes
    ----------
    speed : (ns,)
        rad/s, ascending.
    stiffness : (ns, 2, 2)
        N/m; rows are the force, columns the shift, along the first and the second direction across the axis.
    damping : (ns, 2, 2)
        N s/m.

    Examples
    --------
    >>> K = np.array([np.zeros((2, 2)), 1e6 * np.eye(2)])
    >>> seal = BearingCoefficients(speed=np.array([0.0, 100.0]), stiffness=K, damping=0 * K)
    >>> seal.at(50.0)[0].tolist()
    [[500000.0, 0.0], [0.0, 500000.0]]
    """

    speed: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray

    def __post_init__(self) -> None:
        """Check the shapes, and that the speeds ascend."""
        count = len(self.speed)
        if self.stiffness.shape != (count, 2, 2) or self.damping.shape != (count, 2, 2):
            raise InputError(f"a bearing with {count} speeds needs stiffness and damping of the shape ({count}, 2, 2)")
        if np.any(np.diff(self.speed) <= 0):
            raise InputError("the speeds of a bearing must ascend")

    def at(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the coefficients at a speed, between those of the table by a monotone curve (PCHIP).

        Returns
        -------
        (2, 2), (2, 2)
            N/m, N s/m.

        Raises
        ------
        InputError
            When the table does not reach there.
        """
        if not self.speed[0] <= speed <= self.speed[-1]:
            reach = f"{self.speed[0]:g} to {self.speed[-1]:g} rad/s"
            raise InputError(f"a bearing is known from {reach}, not at {speed:g} rad/s; give its coefficients there")
        if len(self.speed) == 1:
            return self.stiffness[0], self.damping[0]
        K, C = (PchipInterpolator(self.speed, values, axis=0)(speed) for values in (self.stiffness, self.damping))
        return K, C

    def load(
        self, name: str, at: str, speed: float, *, position: VectorLike = (0.0, 0.0, 0.0), axes: str = "yz"
    ) -> Callback:
        """Return the load on an interface at a speed, one of the `loads` of a system.

        Parameters
        ----------
        at : str
            ``body.interface``.
        speed : float
            rad/s.
        position : (3,)
            m, of the bearing, inertial.
        axes : str
            The first and the second direction across the axis, inertial: ``yz`` of a rotor along x.

        Returns
        -------
        Callback

        Raises
        ------
        InputError
            When the axes are not two of x, y, z, or the table does not reach the speed.
        """
        if len(axes) != 2 or axes[0] == axes[1] or not set(axes) <= set(AXES):
            raise InputError(f"bearing {name!r}: axes {axes!r} are not two of x, y and z")
        K, C = self.at(speed)
        shift = [f"({at}.position.{axis} - {float(position[AXES.index(axis)])!r})" for axis in axes]
        rate = [f"{at}.velocity.{axis}" for axis in axes]
        values = ["0", "0", "0"]
        for row, axis in enumerate(axes):
            terms = [f"{-float(K[row, k])!r}*{shift[k]} + {-float(C[row, k])!r}*{rate[k]}" for k in (0, 1)]
            values[AXES.index(axis)] = " + ".join(terms)
        return feedback(name, at, values)


def read_bearing(path: str | Path) -> BearingCoefficients:
    r"""Read a table of coefficients: a CSV file with a head.

    Its columns are ``speed`` in rad/s or ``rpm``, then ``kxx``, ``kxy``, ``kyx``, ``kyy`` in N/m and ``cxx``, ``cxy``,
    ``cyx``, ``cyy`` in N s/m, x and y being the first and the second direction across the axis. A cross-coupled column
    that is missing is zero.

    Returns
    -------
    BearingCoefficients

    Raises
    ------
    InputError
        When a column is missing or unknown, or a cell is no number.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "seal.csv"
    >>> _ = file.write_text("rpm, kxx, kyy, cxx, cyy\n3000, 1e6, 2e6, 10, 20\n")
    >>> read_bearing(file).at(100 * np.pi)[0].tolist()
    [[1000000.0, 0.0], [0.0, 2000000.0]]
    """
    with Path(path).open(newline="") as file:
        rows = [[cell.strip() for cell in row] for row in csv.reader(file) if row]
    head = [name.lower() for name in rows[0]] if rows else []
    known = ("speed", "rpm", *(f"{kind}{part}" for kind in "kc" for part in PARTS))
    if unknown := [name for name in head if name not in known]:
        raise InputError(f"{path}: column {unknown[0]!r} is none of {', '.join(known)}")
    needed = ("kxx", "kyy", "cxx", "cyy")
    lacking = [name for name in needed if name not in head]
    if lacking := lacking + ([] if {"speed", "rpm"} & set(head) else ["speed"]):
        raise InputError(f"{path} has no column {lacking[0]!r}; it needs speed or rpm, {', '.join(needed)}")
    try:
        columns = dict(zip(head, np.array(rows[1:], dtype=float).reshape(-1, len(head)).T, strict=True))
    except ValueError as error:
        raise InputError(f"{path}: {error}; every row needs {len(head)} numbers") from None
    speed = columns["speed"] if "speed" in columns else columns["rpm"] * np.pi / 30
    K, C = (_matrices(columns, kind, len(speed)) for kind in "kc")
    return BearingCoefficients(speed=speed, stiffness=K, damping=C)


def _matrices(columns: dict[str, np.ndarray], kind: str, count: int) -> np.ndarray:
    parts = [columns.get(f"{kind}{part}", np.zeros(count)) for part in PARTS]
    return np.stack(parts, axis=1).reshape(count, 2, 2)


def short_journal_bearing(
    speed: VectorLike, *, load: float, length: float, diameter: float, clearance: float, viscosity: float
) -> BearingCoefficients:
    """Return the coefficients of a plain journal bearing that is short against its diameter, by Ocvirk's theory.

    The load acts against the second direction across the axis, as weight along -y (then x, y are horizontal and
    vertical, the shaft turning from x to y). Half of the film is void (Gumbel), the journal near its equilibrium.

    Parameters
    ----------
    speed : (ns,)
        rad/s, above zero.
    load : float
        N, steady, on this bearing.
    length, diameter, clearance : float
        m; the clearance is that of the radius.
    viscosity : float
        Pa s.

    Returns
    -------
    BearingCoefficients

    Raises
    ------
    InputError
        When a value is not positive.

    References
    ----------
    M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, Dynamics of Rotating Machines, Cambridge 2010, section
    5.5.1. F. W. Ocvirk, Short-bearing approximation for full journal bearings, NACA TN 2808, 1952.

    Examples
    --------
    >>> found = short_journal_bearing([50 * np.pi], load=525, length=0.03, diameter=0.1, clearance=1e-4, viscosity=0.1)
    >>> found.stiffness[0].round(-4).tolist()  # example 5.5.1: 12.81, 16.39, -25.06, 8.815 MN/m
    [[12810000.0, 16390000.0], [-25060000.0, 8820000.0]]
    """
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    sizes = {"load": load, "length": length, "diameter": diameter, "clearance": clearance, "viscosity": viscosity}
    refuse_not_positive("a journal bearing", {"speed": float(speeds.min()), **sizes})
    modified = diameter * speeds * viscosity * length**3 / (8 * load * clearance**2)
    units = [_unit_coefficients(_eccentricity(each)) for each in modified.tolist()]
    K = load / clearance * np.array([stiffness for stiffness, _ in units])
    C = load / clearance * np.array([damping / w for (_, damping), w in zip(units, speeds, strict=True)])
    return BearingCoefficients(speed=speeds, stiffness=K, damping=C)


def refuse_not_positive(what: str, values: dict[str, float]) -> None:
    """Refuse the first of named values that is not above zero, and finite.

    Raises
    ------
    InputError

    Examples
    --------
    >>> refuse_not_positive("a bearing", {"load": 0.0})
    Traceback (most recent call last):
    ...
    modalprep.errors.InputError: a bearing needs a positive load, not 0
    """
    for name, value in values.items():
        if not 0 < value < np.inf:
            raise InputError(f"{what} needs a positive {name}, not {value:g}")


def _eccentricity(modified: float) -> float:
    """Return the eccentricity of the journal over the clearance, by the modified Sommerfeld number."""

    def left(e: float) -> float:
        return (1 - e**2) ** 2 - modified * np.pi * e * np.sqrt(1 - e**2 + (4 * e / np.pi) ** 2)

    return float(brentq(left, 0.0, 1.0, xtol=1e-15, rtol=1e-14))


def _unit_coefficients(e: float) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and damping (2, 2), over load and clearance, of an eccentricity."""
    p, s = np.pi**2, 1 - e**2
    root = np.sqrt(s)
    h = (p * s + 16 * e**2) ** -1.5
    xx = 4 * (p * (2 - e**2) + 16 * e**2)
    xy = np.pi * (p * s**2 - 16 * e**4) / (e * root)
    yx = -np.pi * (p * s * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2)) / (e * root)
    yy = 4 * (p * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2) / s)
    cross = -8 * (p * (1 + 2 * e**2) - 16 * e**2)
    first = 2 * np.pi * root * (p * (1 + 2 * e**2) - 16 * e**2) / e
    second = 2 * np.pi * (p * s**2 + 48 * e**2) / (e * root)
    return h * np.array([[xx, xy], [yx, yy]]), h * np.array([[first, cross], [cross, second]])
