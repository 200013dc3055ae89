"""Pack the closures of a system for the kernel, row by row."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import Pattern
from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.closed_loops.constraints import (
    ANGLE,
    BUNDLE_DATA,
    COUPLER,
    DISTANCE,
    END,
    END_DATA,
    ENTRY_DATA,
    GROUP_DATA,
    POINT,
    RESPONSES,
    ROW,
    SLIP,
    TERM,
    Constraints,
    Work,
)
from modalprep.multibody.kernels.time_tables import Tables
from modalprep.multibody.model.constraints import Closure, Coupler, coordinate_of
from modalprep.multibody.model.joint_types import JOINT_TYPES, NAMED, PRESCRIBED
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.row_paths import row_paths
from modalprep.multibody.packing.time_tables import tabulate
from modalprep.multibody.packing.tree import blank, rows, turn_to

IMMOBILE = 1e-18  # of 1 / mass: mobility below which a row counts as immobile, that of a lever of 1e-9
BY_ROW = ("phi", "rate", "bias", "driven_rate", "residual", "target", "compliance", "multiplier", "free")  # of `Work`
BY_LANE = ("diagonal", "remaining", "inverse", "rhs", "reduced", "solution")


class Row(NamedTuple):
    """One scalar constraint of a closure: its kind, vectors in the ends' axes, value and function, what it prevents."""

    closure: int
    kind: int
    in_a: np.ndarray
    in_b: np.ndarray
    value: float
    function: TimeFunction | None
    stops: str
    friction: tuple[float, float] = (0.0, 0.0)  # coefficient, speed from which it slides


@dataclass(frozen=True)
class Closing:
    """Packed constraints, and the rows from which they were packed."""

    arrays: Constraints
    rows: tuple[Row, ...]
    size: float  # m, unit of lengths
    value: np.ndarray  # (m,) of the rows, see `Work`
    unit: np.ndarray  # (m,) of rows that are active
    least_mobility: np.ndarray  # (m,)

    def of(self, closure: int) -> list[int]:
        """Return the rows of a closure."""
        return self._rows_of.get(closure, [])

    @cached_property
    def _rows_of(self) -> dict[int, list[int]]:
        of = [row.closure for row in self.rows]  # those of a closure follow each other
        return {closure: list(found) for closure, found in groupby(range(len(of)), of.__getitem__)}

    def sliding(self, closure: int) -> list[int]:
        """Return the SLIP rows of a closure, those of its friction."""
        return [i for i in self.of(closure) if self.rows[i].kind == SLIP]

    def normal(self, closure: int) -> list[int]:
        """Return the other rows of a closure, which constrain it."""
        return [i for i in self.of(closure) if self.rows[i].kind != SLIP]


ZERO = np.zeros(3)
DISPLACEMENTS = {"x": 0, "y": 1, "z": 2}
ROTATIONS = {"x": (2, 1), "y": (2, 0), "z": (0, 1)}
# displacements and rotations that each type constrains, in the frame whose z is the axis
CONSTRAINED = {
    **{name: steps.constrained for name, steps in JOINT_TYPES.items() if steps.constrained},
    "point_on_line": ("xy", ""),
    "point_on_plane": ("z", ""),
}


def pack_constraints(system: System, packed: Packed, t_end: float, shortest_event: float | None = None) -> Closing:
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
    >>> len(closing.rows), closing.rows[0].stops, closing.arrays.ends["link"].tolist()
    (5, 'displacement of arm.tip to ground along (1, 0, 0)', [0, -1])
    """
    conditions = [row for k, closure in enumerate(system.closures) for row in _rows(k, closure)]
    functions = [row.function for row in conditions if row.function is not None]
    numbers = iter(range(len(functions)))
    size = _size(system)
    mass = sum(body.m for body in system.bodies.values())
    packed_rows = blank(ROW, len(conditions))
    value, unit, least_mobility = np.zeros((3, len(conditions)))
    for i, row in enumerate(conditions):
        own = packed_rows[i]
        length = row.kind in (POINT, DISTANCE)
        own["kind"] = row.kind
        own["a"] = 2 * row.closure
        own["b"] = 2 * row.closure + 1
        own["table"] = -1 if row.function is None else next(numbers)
        own["in_a"], own["in_b"], own["stiffness"] = row.in_a, row.in_b, np.inf
        value[i] = row.value
        unit[i] = 1 / size if length else 1.0
        least_mobility[i] = {COUPLER: 0.0}.get(row.kind, IMMOBILE / mass * (1.0 if length else size**-2))
        if row.kind == SLIP:
            own["friction"], own["sliding"] = row.friction
            unit[i], least_mobility[i] = 0.0, np.inf
    terms = [
        term for i, row in enumerate(conditions) for term in _terms(system, packed, i, system.closures[row.closure])
    ]
    ends = [end for closure in system.closures for end in _ends(system, packed, closure)]
    arrays = Constraints(
        tabulate(functions, t_end, shortest_event=shortest_event),
        rows(END, ends),
        packed_rows,
        rows(TERM, terms),
    )
    return Closing(arrays, tuple(conditions), size, value, unit, least_mobility)


def no_constraints(tables: Tables) -> Constraints:
    """Return constraints without a row, of a system whose only constraints are compliant."""
    return Constraints(tables, *(blank(dtype, 0) for dtype in (END, ROW, TERM)))


def constraint_work(arrays: Constraints, packed: Packed, value=None, size: float = 1.0) -> Work:
    """Return the Work of constraints, all active; lengths relative to a size (m)."""
    key = *(table.tobytes() for table in (arrays.ends, arrays.rows, arrays.terms)), size
    work = packed.pattern(key, lambda: Pattern(_work(arrays, packed, size))).copy()
    if value is not None:
        work.value[:] = value
    return work


def _work(arrays: Constraints, packed: Packed, size: float) -> Work:
    modal = packed.model.modal
    nu = packed.nu
    N = 0 if modal is None else modal.K.shape[1]
    m = len(arrays.rows)
    ne = len(arrays.ends)
    paths = row_paths(arrays, packed)
    nb = len(paths.bundles)
    unit = np.where(np.isin(arrays.rows["kind"], (POINT, DISTANCE)), 1 / size, 1.0)
    return Work(
        value=np.zeros(m),
        unit=unit,
        least_mobility=np.zeros(m),
        reference_mobility=np.zeros(m),
        ends=_ends_at_rest(arrays),
        **{name: np.zeros(m) for name in BY_ROW},
        S=np.zeros((m, m)),
        **{name: np.zeros((WIDTH * nb, WIDTH * nb)) for name in ("factor", "columns")},
        **{name: np.zeros(WIDTH * nb) for name in BY_LANE},
        pivots=np.zeros(WIDTH * nb, dtype=np.int64),
        order=np.arange(m),
        rank=np.zeros(1, dtype=np.int64),
        closed_rank=np.full(1, m),
        in_plane=np.zeros(1, dtype=np.int64),
        **{name: np.ones(1) for name in ("sine", "closed_sine", "least_sine")},
        tau=np.zeros(nu),
        step=np.zeros(nu),
        paths=paths,
        groups=blank(GROUP_DATA, len(paths.groups)),
        bundles=_all_active(paths.row, unit),
        entries=blank(ENTRY_DATA, len(paths.entries)),
        modal=np.zeros((len(paths.entries), WIDTH * N)),
        between=blank(RESPONSES, nb, nb),
        speeds=np.zeros(6 * WIDTH),
        shape=np.zeros((ne, N, 6)),
    )


def _all_active(row: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Return the data of the bundles with all rows active; lanes without a row are immobile."""
    found = blank(BUNDLE_DATA, len(row) // WIDTH)
    found.weight[:] = np.where(row >= 0, unit[row] ** 2, 0.0).reshape(-1, WIDTH)
    found.least_mobility[:] = np.where(row >= 0, 0.0, np.inf).reshape(-1, WIDTH)
    return found


def _ends_at_rest(arrays: Constraints) -> np.ndarray:
    """Return the data of the ends, those on the ground at their places."""
    found = blank(END_DATA, len(arrays.ends))
    ground = arrays.ends["link"] < 0
    found.position[ground] = arrays.ends["position"][ground]
    found.rotation[ground] = np.eye(3).ravel()
    return found


def _rows(k: int, closure: Closure | Coupler) -> list[Row]:
    if isinstance(closure, Coupler):
        names = " and ".join(closure.factors)
        return [Row(k, COUPLER, ZERO, ZERO, 0.0, closure.value, f"motion of {names}")]
    if closure.type == "distance":
        return [Row(k, DISTANCE, ZERO, ZERO, 0.0, closure.length, f"distance of {closure.b} from {closure.a}")]
    if closure.path is not None:
        return [
            _point(k, closure, axis, path)
            for axis, path in zip(np.eye(3), closure.path, strict=True)
            if path is not None
        ]
    frame = turn_to(closure.axis)
    moves, turns = CONSTRAINED[closure.type]
    rows = [_point(k, closure, frame[:, DISPLACEMENTS[c]], None) for c in moves]
    if closure.friction_coefficient:
        along = [frame[:, c] for c in range(3) if "xyz"[c] not in moves]
        law = (closure.friction_coefficient, closure.transition_velocity)
        rows += [Row(k, SLIP, axis, ZERO, 0.0, None, f"sliding of {closure.b} on {closure.a}", law) for axis in along]
    in_b = closure.rotation.T @ frame
    for about in turns:
        b, a = ROTATIONS[about]
        rows.append(Row(k, ANGLE, frame[:, a], in_b[:, b], 0.0, None, _turn(closure, frame[:, DISPLACEMENTS[about]])))
    second = closure.second_axis
    if second is not None:
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


def _ends(system: System, packed: Packed, closure: Closure | Coupler) -> list[tuple]:
    """Return the ends of a closure as records END; those of a coupler are not read."""
    unit = np.eye(3).ravel()
    located = [None, None]
    if not isinstance(closure, Coupler):
        located = [locate(system.bodies, end, closure.name) for end in (closure.a, closure.b)]
    position = np.zeros(3) if isinstance(closure, Coupler) else closure.position
    return [(packed.link_of(end[0]), end[1], position, unit) if end else (-1, 0, position, unit) for end in located]


def _terms(system: System, packed: Packed, row: int, closure: Closure | Coupler) -> list[tuple]:
    if not isinstance(closure, Coupler):
        return []
    found = []
    for text, factor in closure.factors.items():
        joint, k = coordinate_of(text, system.coordinate_counts, closure.name)
        moving = [i for i in packed.links_of(joint) if packed.types[i] in (*NAMED, PRESCRIBED)]
        link = packed.model.links[moving[k]]
        free = packed.types[moving[k]] != PRESCRIBED
        found.append((row, moving[k], link["x"] if free else -1, link["u"] if free else -1, float(factor)))
    return found


def _size(system: System) -> float:
    """Return the largest extent of a body's interfaces, m."""
    extents = [np.ptp(body.interface_position, axis=0).max(initial=0.0) for body in system.bodies.values()]
    return float(max(extents)) or 1.0
