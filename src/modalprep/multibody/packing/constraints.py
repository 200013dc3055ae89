"""Pack the closures of a system for the kernel, row by row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.multibody.kernels.constraints import (
    ANGLE,
    COUPLER,
    DISTANCE,
    ENDS,
    FLOOR,
    IN_A,
    IN_B,
    LINES,
    POINT,
    SLIP,
    UNIT,
    VALUE,
    Constraints,
    Work,
)
from modalprep.multibody.kernels.constraints import CONSTANTS as WIDTH
from modalprep.multibody.kernels.data import PRESCRIBED, PRISMATIC, REVOLUTE, U, X
from modalprep.multibody.model.constraints import Closure, Coupler, coordinate_of
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.time_tables import tabulate
from modalprep.multibody.packing.tree import Packed, turn_to

IMMOBILE = 1e-18  # a row whose mobility is below this share of 1 / mass moves nothing: 1e-9 of a lever


class Row(NamedTuple):
    """One scalar condition of a closure: its kind, vectors in the ends' axes, value and function, what it stops."""

    closure: int
    kind: int
    in_a: np.ndarray
    in_b: np.ndarray
    value: float
    function: TimeFunction | None
    stops: str


@dataclass(frozen=True)
class Closing:
    """Packed constraints and the rows they were made of."""

    arrays: Constraints
    rows: tuple[Row, ...]
    size: float  # m, unit of lengths
    counts: np.ndarray  # (m, 2) UNIT and FLOOR of rows that hold

    def of(self, closure: int) -> list[int]:
        """Return the rows of a closure."""
        return [i for i, row in enumerate(self.rows) if row.closure == closure]

    def sliding(self, closure: int) -> list[int]:
        """Return the rows of a closure that only rub."""
        return [i for i in self.of(closure) if self.rows[i].kind == SLIP]

    def normal(self, closure: int) -> list[int]:
        """Return its other rows, those that hold."""
        return [i for i in self.of(closure) if self.rows[i].kind != SLIP]

    def activate(self, closure: int, active: bool) -> None:
        """Let a closure hold, or let it go: then its rows are measured, but push nothing and count as closed."""
        rows = self.of(closure)
        self.arrays.constants[rows, UNIT : FLOOR + 1] = self.counts[rows] if active else (0.0, np.inf)

    def active(self, closure: int) -> bool:
        """Return whether a closure holds."""
        return bool(self.holding[self.of(closure)].any())

    @property
    def holding(self) -> np.ndarray:
        """Which rows hold (m,): all but those that only rub, and those of closures let go."""
        return self.arrays.constants[:, UNIT] > 0


ZERO = np.zeros(3)
DISPLACEMENTS, ROTATIONS = {"x": 0, "y": 1, "z": 2}, {"x": (2, 1), "y": (2, 0), "z": (0, 1)}
# what each type holds fast: displacements and turns in the frame whose z is the axis
HOLDS = {
    "weld": ("xyz", "xyz"),
    "revolute": ("xyz", "xy"),
    "prismatic": ("xy", "xyz"),
    "cylindrical": ("xy", "xy"),
    "spherical": ("xyz", ""),
    "universal": ("xyz", ""),
    "planar": ("z", "xy"),
    "point_on_line": ("xy", ""),
    "point_on_plane": ("z", ""),
}


def pack_constraints(system: System, packed: Packed, t_end: float) -> Closing:
    """Return the arrays of all closures of a system on [0, t_end]; lengths "as at the start" are still zero.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> pin = Closure(name="pin", type="revolute", a="arm.tip", b="ground", position=np.array([10.0, 0, 0]))
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), closures=(pin,))
    >>> closing = pack_constraints(arm, pack(arm), 1.0)
    >>> len(closing.rows), closing.rows[0].stops, closing.arrays.ends.tolist()
    (5, 'displacement of arm.tip to ground along (1, 0, 0)', [[0, 1], [-1, 0]])
    """
    rows = [row for k, closure in enumerate(system.closures) for row in _rows(k, closure)]
    functions = [row.function for row in rows if row.function is not None]
    numbers = iter(range(len(functions)))
    size = _size(system)
    mass = sum(body.m for body in system.bodies.values())
    ints, constants = np.full((len(rows), 4), -1), np.zeros((len(rows), WIDTH))
    for i, row in enumerate(rows):
        ints[i] = row.kind, 2 * row.closure, 2 * row.closure + 1, -1 if row.function is None else next(numbers)
        c = constants[i]
        c[IN_A:IN_B], c[IN_B:VALUE], c[VALUE] = row.in_a, row.in_b, row.value
        length = row.kind in (POINT, DISTANCE)
        c[UNIT] = 1 / size if length else 1.0
        c[FLOOR] = {COUPLER: 0.0}.get(row.kind, IMMOBILE / mass * (1.0 if length else size**-2))
        if row.kind == SLIP:
            c[UNIT], c[FLOOR] = 0.0, np.inf
    terms = [term for i, row in enumerate(rows) for term in _terms(system, packed, i, system.closures[row.closure])]
    ends = [end for closure in system.closures for end in _ends(system, packed, closure)]
    ground = [place for closure in system.closures for place in _ground(closure)]
    arrays = Constraints(
        tables=tabulate(functions, t_end),
        ends=np.array(ends, dtype=np.int64).reshape(-1, 2),
        ground=np.array(ground, dtype=float).reshape(-1, 12),
        rows=ints.astype(np.int64),
        constants=constants,
        terms=np.array([at for at, _ in terms], dtype=np.int64).reshape(-1, 4),
        factors=np.array([factor for _, factor in terms], dtype=float),
        yielding=np.tile([np.inf, 0.0], (len(rows), 1)),
    )
    closing = Closing(arrays, tuple(rows), size, constants[:, UNIT : FLOOR + 1].copy())
    for k, closure in enumerate(system.closures):
        closing.activate(k, closure.active)
    return closing


def constraint_work(arrays: Constraints, packed: Packed) -> Work:
    """Allocate the scratch of `Constraints`."""
    nx, nu, nl = packed.nx, packed.nu, len(packed.links)
    m, ne = len(arrays.rows), len(arrays.ends)
    vectors = [np.zeros(m) for _ in range(8)]
    return Work(
        np.zeros((ne, ENDS)), np.zeros((ne, 6)), np.zeros((m, LINES)), *vectors, np.zeros((m, m)), np.zeros((m, m)),
        np.zeros(m), np.zeros(m, dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros((m, nu)), np.zeros(nu),
        np.zeros(nu), np.zeros((nl, 12)), np.zeros(nx + nu),
    )  # fmt: skip


def _rows(k: int, closure: Closure | Coupler) -> list[Row]:
    if isinstance(closure, Coupler):
        names = " and ".join(closure.factors)
        return [Row(k, COUPLER, ZERO, ZERO, 0.0, closure.value, f"motion of {names}")]
    if closure.type == "distance":
        return [Row(k, DISTANCE, ZERO, ZERO, 0.0, closure.length, f"distance of {closure.b} from {closure.a}")]
    if closure.type == "position":
        return [
            _point(k, closure, axis, path)
            for axis, path in zip(np.eye(3), closure.path, strict=True)
            if path is not None
        ]
    frame, (moves, turns) = turn_to(closure.axis), HOLDS[closure.type]
    rows = [_point(k, closure, frame[:, DISPLACEMENTS[c]], None) for c in moves]
    if closure.friction_coefficient:
        along = [frame[:, c] for c in range(3) if "xyz"[c] not in moves]
        law = np.array([closure.friction_coefficient, closure.transition_velocity, 0.0])
        rows += [Row(k, SLIP, axis, law, 0.0, None, f"sliding of {closure.b} on {closure.a}") for axis in along]
    in_b = closure.rotation.T @ frame
    for about in turns:
        b, a = ROTATIONS[about]
        rows.append(Row(k, ANGLE, frame[:, a], in_b[:, b], 0.0, None, _turn(closure, frame[:, DISPLACEMENTS[about]])))
    if closure.type == "universal":
        second = closure.second_axis
        about = np.cross(closure.axis, second)
        angle = float(closure.axis @ second)
        rows.append(Row(k, ANGLE, closure.axis, closure.rotation.T @ second, angle, None, _turn(closure, about)))
    return rows


def _point(k: int, closure: Closure, axis: np.ndarray, path: TimeFunction | None) -> Row:
    what = f"displacement of {closure.a} to {closure.b} along {_vector(axis)}"
    return Row(k, POINT, axis, ZERO, 0.0, path, what)


def _turn(closure: Closure, axis: np.ndarray) -> str:
    return f"rotation of {closure.a} to {closure.b} about {_vector(axis)}"


def _vector(axis: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in axis + 0.0) + ")"


def _ends(system: System, packed: Packed, closure: Closure | Coupler) -> list[tuple[int, int]]:
    if isinstance(closure, Coupler):
        return [(-1, 0), (-1, 0)]
    found = [locate(system.bodies, end, closure.name) for end in (closure.a, closure.b)]
    return [(packed.link_of(at[0]), at[1]) if at else (-1, 0) for at in found]


def _ground(closure: Closure | Coupler) -> list[np.ndarray]:
    position = np.zeros(3) if isinstance(closure, Coupler) else closure.position
    return [np.append(position, np.eye(3))] * 2


def _terms(system: System, packed: Packed, row: int, closure: Closure | Coupler) -> list[tuple[tuple, float]]:
    if not isinstance(closure, Coupler):
        return []
    found = []
    for text, factor in closure.factors.items():
        joint, k = coordinate_of(text, system.coordinate_counts, closure.name)
        moving = [i for i in packed.links_of(joint) if packed.types[i] in (REVOLUTE, PRISMATIC, *PRESCRIBED)]
        at, free = packed.tree.ints[moving[k]], packed.types[moving[k]] not in PRESCRIBED
        found.append(((row, moving[k], at[X] if free else -1, at[U] if free else -1), float(factor)))
    return found


def _size(system: System) -> float:
    """Return the largest extent of a body's interfaces, m."""
    extents = [np.ptp(body.interface_position, axis=0).max(initial=0.0) for body in system.bodies.values()]
    return float(max(extents)) or 1.0
