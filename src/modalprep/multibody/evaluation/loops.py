"""Closed loops of one run: packed constraints, assembly of the start, projection after steps."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from modalprep.compiler.lanes import WIDTH
from modalprep.errors import InputError
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.closed_loops import constraints, factor, multipliers, projection, responses
from modalprep.multibody.kernels.closed_loops.constraints import ANGLE, DISTANCE, POINT
from modalprep.multibody.kernels.closed_loops.projection import CLOSED, MOST_STEPS, ORIENTATION
from modalprep.multibody.kernels.data import Data
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.joint_types import KINDS, NAMED, REVOLUTE
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.constraints import Closing, constraint_work, pack_constraints
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import rows
from modalprep.suggest import refuse_unknown

NO_DISTANCE = 1e-9  # of the size of the system: below it a distance counts as zero
MOVED = 1e-6  # rad or m: smaller motions of an assembly are not noted


def _is_constant(closing: Closing) -> bool:
    """Return whether packed constraints do not depend on the time span."""
    return len(closing.arrays.tables.until) == 0


class Loops:
    """Closed loops and motion constraints of a system on [0, t_end].

    Attributes
    ----------
    arrays, work, trial
        For the functions of `constraints` and `projection`.
    notes : list of str
        After `assemble`.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.constraints import Closure
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> rod = rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3),
    ...                  interfaces={"root": np.zeros(3), "end": np.array([1.0, 0, 0])})
    >>> joints = (Joint(name="crank", type="revolute", parent="ground", child="a", angle=1.0, keep_start=True),
    ...           Joint(name="knee", type="revolute", parent="a.end", child="b", angle=-2.2))
    >>> slot = Closure(name="slot", type="point_on_plane", a="ground", b="b.end", axis=np.array([0, 1.0, 0]))
    >>> system = System(bodies={"a": rod, "b": rod}, joints=joints, closures=(slot,))
    >>> packed = pack(system)
    >>> loops = Loops(system, packed, t_end=1.0)
    >>> y = loops.assemble(packed.data(), np.array([1.0, -2.2, 0, 0]), np.zeros((2, 3)))
    >>> y[:2].round(6)
    array([ 1., -2.])
    """

    def __init__(self, system: System, packed: Packed, t_end: float, shortest_event: float | None = None) -> None:
        self.system, self.packed = system, packed
        make = partial(pack_constraints, system, packed, t_end, shortest_event)
        self.closing = packed.kept("closing", make, _is_constant)
        self.arrays = self.closing.arrays
        self.work = constraint_work(self.arrays, packed, self.closing.value)
        self.trial = packed.data()
        self.orientations, self.kept = rows(ORIENTATION, self._orientations()), self._kept()
        self._moved: list[str] = []
        self._redundant: list[str] = []
        self._values: dict[str, np.ndarray] = {}
        for k, closure in enumerate(system.closures):
            self.activate(k, closure.active)

    def activate(self, closure: int, active: bool) -> None:
        """Make a closure active or not: then its rows are evaluated, but have no multipliers and count as closed."""
        own = self.closing.of(closure)
        self.work.unit[own] = self.closing.unit[own] if active else 0.0
        self.work.least_mobility[own] = self.closing.least_mobility[own] if active else np.inf
        factor.update_weights(self.work)

    def active(self, closure: int) -> bool:
        """Return whether a closure is active."""
        return bool(self.active_rows[self.closing.of(closure)].any())

    def restore(self, values: Mapping[str, np.ndarray], active: Mapping[str, bool]) -> None:
        """Let `assemble` keep the lengths and sums of a state (m,) by closure, and activate its closures.

        Raises
        ------
        InputError
            When a closure is unknown, or has another number of conditions.
        """
        names = [closure.name for closure in self.system.closures]
        for name in {**values, **active}:
            refuse_unknown(name, names, "state: closure")
        for name, value in values.items():
            count = len(self.closing.of(names.index(name)))
            if np.shape(value) != (count,):
                raise InputError(f"state: closure {name!r} has {count} conditions, of which {np.size(value)} are given")
        for name, given in active.items():
            self.activate(names.index(name), given)
        self._values = dict(values)

    @property
    def active_rows(self) -> np.ndarray:
        """Which rows are active (m,): all but those of friction and of inactive closures."""
        return self.work.unit > 0

    @property
    def breaks(self) -> np.ndarray:
        """Times at which a prescribed value changes its piece, s."""
        return self.arrays.tables.until

    def enter(self, begin: float, end: float) -> None:
        """Set the interval between breaks that is integrated."""
        self.arrays.tables.middle[0] = (begin + end) / 2

    def residual(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> None:
        """Evaluate all rows, after `kernel.outward`."""
        world(self.packed.model, data)
        constraints.constraint_residual(self.arrays, self.packed.model, data, y, motion, t, self.work, False)

    def rate_slopes(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> np.ndarray:
        """Return the Jacobian (m, nu) of the rates of all rows by the speeds, prescribed joints at rest."""
        out = np.empty((len(self.arrays.rows), self.packed.nu))
        projection.rate_slopes(self.arrays, self.packed.model, data, y.copy(), motion, t, self.work, out)
        return out

    def accelerations(self, data: Data, tau: np.ndarray, udot: np.ndarray) -> int:
        """Write the accelerations of the closed system after `residual`; returns the status of `kernel.inward`."""
        given = self.arrays, self.packed.model, data, self.work, tau
        status = responses.inward_with_rows(*given, None, 0.0, 0.0)
        if status < 0:
            multipliers.constraint_accelerations(*given, udot)
        return status

    def assemble(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float = 0.0) -> np.ndarray:
        """Return the consistent state nearest to y, and write the notes.

        Joints with `keep_start` and modes at rest are kept where the loops close without them: in the metric they
        are 1e8 times heavier. Nearest is meant in the mass matrix.

        Raises
        ------
        InputError
            When a loop cannot be closed; the sentence names the closure and its gap. When a joint is moved farther than
            `reach` of the closures; the sentence names it and what it is moved by.
        """
        found = np.empty_like(y)
        hinge = np.empty(self.packed.nu)
        closing = self.closing
        given = self.arrays, self.packed.model, data, self.trial, y, motion, t, self.work
        kept = self.orientations, self.kept, hinge
        if not projection.assemble(*given, *kept, self.packed.softest, closing.size, found):
            raise InputError(self._gap(data, y, motion, t))
        if self._values:
            self._restore_values(data, found, motion, t)
        self._refuse_no_distance()
        self._moved = []
        if np.abs(found - y).max() > MOVED:
            self._to_nearest_turn(y, found)
            self._refuse_far(y, found)
            self._note_moved(y, found)
        self.note_redundant(self.redundant)
        return found

    def _restore_values(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> None:
        for k, closure in enumerate(self.system.closures):
            if closure.name in self._values:
                self.work.value[self.closing.of(k)] = self._values[closure.name]
        if not self.project(data, y, motion, t):
            raise InputError(self._gap(data, y, motion, t))

    @property
    def notes(self) -> list[str]:
        """Joints moved to close the loops, and redundant conditions."""
        return [*self._moved, *self._redundant]

    def _refuse_no_distance(self) -> None:
        """Refuse distances that are zero at the start: they have no direction."""
        for row, value in zip(self.closing.rows, self.work.value, strict=True):
            none = row.kind == DISTANCE and row.function is None and abs(value) <= NO_DISTANCE * self.closing.size
            if none and self.active(row.closure):
                name = self.system.closures[row.closure].name
                raise InputError(
                    f"closure {name!r}: the {row.stops} is zero at the start, and has no direction; give a length, or "
                    "use type = 'spherical', which keeps both points together"
                )

    def project(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> bool:
        """Project a state in place, stiff modes changing least; False when it cannot be closed."""
        none = np.zeros(self.packed.nu)
        args = (self.arrays, self.packed.model, data, self.trial, y, motion, t, self.work, none)
        return projection.project_state(*args, self.packed.softest, CLOSED, MOST_STEPS, False) >= 0

    def begin(self, closure: int) -> None:
        """Activate a closure with its ends as they are, after `residual`."""
        own = self.closing.of(closure)
        self.work.value[own] += self.work.phi[own]
        self.activate(closure, True)

    def exerted(self) -> dict[str, np.ndarray]:
        """Return ``name.force``, ``name.torque``, ``name.multiplier`` of the multipliers, as in `Result.channels`."""
        found: dict[str, np.ndarray] = {}
        for k, closure in enumerate(self.system.closures):
            own = self.closing.of(k)
            size, lane = self.work.multiplier[own], self.work.paths.lane[own]
            lines = self.work.groups["line"].reshape(-1, 9, WIDTH)[lane // WIDTH, :, lane % WIDTH]
            if isinstance(closure, Coupler):
                found[f"{closure.name}.multiplier"] = size[0]
                continue
            to_a = self._axes(2 * k).T
            found[f"{closure.name}.force"] = to_a @ (size @ lines[:, :3])
            found[f"{closure.name}.torque"] = to_a @ (size @ lines[:, 6:])
        return found

    def _axes(self, end: int) -> np.ndarray:
        return self.work.ends["rotation"][end].reshape(3, 3) @ self._align(end).T

    def _orientations(self) -> list[tuple]:
        """Return the closures that could close with reversed directions, as records ORIENTATION."""
        found = []
        for k, closure in enumerate(self.system.closures):
            turns = [i for i in self.closing.of(k) if self.closing.rows[i].kind == ANGLE]
            if len(turns) >= 2 and not isinstance(closure, Coupler):
                axes = np.vstack([closure.axis, np.eye(3)])
                in_a = axes @ self._align(2 * k)
                in_b = axes @ closure.rotation @ self._align(2 * k + 1)
                found.append((2 * k, 2 * k + 1, turns[0], len(turns) == 3, in_a.ravel(), in_b.ravel()))
        return found

    def _kept(self) -> np.ndarray:
        """Return the links of joints with `keep_start` (nk,)."""
        kept = [link.joint.keep_start for link in self.packed.links]
        moving = [KINDS[code].speeds > 0 for code in self.packed.types]
        return np.flatnonzero(np.logical_and(kept, moving))

    def _align(self, end: int) -> np.ndarray:
        """Return the rotation from the axes of an end's link to those of its body."""
        link = self.arrays.ends["link"][end]
        return self.packed.align(link) if link >= 0 else np.eye(3)

    def _to_nearest_turn(self, before: np.ndarray, after: np.ndarray) -> None:
        """Reduce rotations of hinges to less than half a turn, but not of those in couplers, which count turns."""
        for i, link in enumerate(self.packed.model.links):
            if self.packed.types[i] == REVOLUTE and not np.any(self.arrays.terms["link"] == i):
                after[link["x"]] -= 2 * np.pi * np.round((after[link["x"]] - before[link["x"]]) / (2 * np.pi))

    def _refuse_far(self, before: np.ndarray, after: np.ndarray) -> None:
        """Refuse a motion of a joint beyond the reach of the closures."""
        reach = max(closure.reach for closure in self.system.closures)
        far, name, unit, most = max(self._motions(before, after), default=(0.0, "", "", 0.0))
        if far > reach:
            raise InputError(
                f"closing the loops would move joint {name!r} by {most:.3g} {unit} from its start; closures may move "
                f"joints by {reach:g} rad, or {reach:g} times the size of the system, {self.closing.size:.3g} m: give "
                f"start values nearer to the closed loops, or reach = {1.1 * far:.2g} with one of the closures"
            )

    def _motions(self, before: np.ndarray, after: np.ndarray) -> list[tuple[float, str, str, float]]:
        """Return the motion of each joint: relative to a reach of 1, its name, its unit, absolute."""
        found = []
        size = self.closing.size
        for i, link in enumerate(self.packed.links):
            kind = KINDS[self.packed.types[i]]
            turns = self.packed.turns(i)
            x = self.packed.model.links["x"][i]
            q = x + kind.quaternion
            if kind.quaternion >= 0:
                angle = 2 * np.arccos(min(1.0, abs(before[q : q + 4] @ after[q : q + 4])))
                found.append((angle, link.joint.name, "rad", angle))
            if kind.translations and not turns:
                travel = np.linalg.norm((after - before)[x : x + kind.translations])
                found.append((travel / size, link.joint.name, "m", travel))
            if kind.named and turns:
                angle = abs(after[x] - before[x])
                found.append((angle, link.joint.name, "rad", angle))
        return found

    def _note_moved(self, before: np.ndarray, after: np.ndarray) -> None:
        moved = []
        far = np.abs(after - before) > MOVED
        for i, link in enumerate(self.packed.links):
            x = self.packed.model.links["x"][i]
            if self.packed.types[i] in NAMED and far[x]:
                unit = "rad" if self.packed.turns(i) else "m"
                moved.append(f"{link.joint.name} from {before[x]:.6g} to {after[x]:.6g} {unit}")
        if moved:
            self._moved = [f"closing the loops moved {', '.join(moved)}"]

    @property
    def redundant(self) -> np.ndarray:
        """Redundant rows of the last factorisation (k,)."""
        redundant = self.active_rows
        redundant[self.work.order[: self.work.rank[0]]] = False
        return np.flatnonzero(redundant)

    def note_redundant(self, left: np.ndarray) -> None:
        """Note rows (k,) that are redundant, by closure."""
        self._redundant = []
        for k, closure in enumerate(self.system.closures):
            names = [self.closing.rows[i].stops for i in left if self.closing.rows[i].closure == k]
            if names:
                self._redundant.append(
                    f"closure {closure.name!r}: {', '.join(names)} {'is' if len(names) == 1 else 'are'} already "
                    "stopped by other joints; the forces there are not determined and reported as zero"
                )

    def _gap(self, data, y, motion, t) -> str:
        """Return a sentence on the closure that stays open, and its gap."""
        found = y.copy()
        model = self.packed.model
        arrays = self.arrays
        metric = self.work, np.zeros(self.packed.nu), self.packed.softest
        given = arrays, model, data, self.trial, found, motion, t, *metric, CLOSED, MOST_STEPS, False
        reached = projection.project_positions(*given) >= 0
        if reached and projection.is_reversed(self.orientations, self.work):
            return "the loops close only with an axis pointing the other way; give start values nearer to closed loops"
        if reached:
            projection.project_velocities(arrays, model, data, found, motion, *metric, 0.0, False)
            kernel.outward(model, data, found, motion)
            self.residual(data, found, motion, t)
        what, stops, gap, unit = self._worst(self.work.rate if reached else self.work.phi)
        if reached:
            return (
                f"{what} cannot be kept at t = {t:g} s: {stops} goes on at {gap:.3g} {unit}/s; two prescribed motions "
                "contradict each other"
            )
        return (
            f"{what} cannot be closed at t = {t:g} s: {stops}, a gap of {gap:.3g} {unit} is left; correct lengths and "
            "positions, or give start values nearer to the closed loop"
        )

    def widest(self) -> str:
        """Return a sentence on the closure that the last projection left open."""
        what, stops, gap, unit = self._worst(self.work.phi)
        return f"{what} cannot be kept closed: {stops}, a gap of {gap:.3g} {unit} is left"

    def _worst(self, values: np.ndarray) -> tuple[str, str, float, str]:
        """Return closure, what it prevents, size and unit of the largest of ``values (m,)``."""
        sizes = np.abs(values) * self.work.unit
        worst = int(np.argmax(np.where(np.isfinite(sizes), sizes, np.inf)))
        row = self.closing.rows[worst]
        unit = "m" if row.kind in (POINT, DISTANCE) else "rad" if row.kind == ANGLE else "(m or rad)"
        what = f"closure {self.system.closures[row.closure].name!r}"
        return what, row.stops, abs(values[worst]), unit
