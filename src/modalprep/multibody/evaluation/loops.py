"""The closed loops of one run: packed, with their scratch; assembly of the start, projection after steps."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels import constraints
from modalprep.multibody.kernels.constraints import ANGLE, COUPLER, DISTANCE, KIND, POINT, TABLE, VALUE
from modalprep.multibody.kernels.data import FREE, IA, J_, PRISMATIC, REVOLUTE, SPEEDS, SPHERICAL, Scratch, U, X
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.constraints import constraint_work, pack_constraints
from modalprep.multibody.packing.tree import Packed

CLOSED = 1e-11  # of lengths by the size of the system, and of angles: what Newton reaches in double precision
CLOSED_RATE = 1e-8  # of the largest rate, the same way
MOST_STEPS = 60
HELD = 1e8  # how much heavier a coordinate is that should stay


class Loops:
    """Closed loops and motion constraints of a system on [0, t_end].

    Attributes
    ----------
    arrays, work
        For the functions of `constraints`.
    notes : list of str
        After `assemble`: what was moved to close the loops, and which conditions are redundant.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.constraints import Closure
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.kernels.data import workspace
    >>> from modalprep.multibody.packing.tree import pack
    >>> rod = rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3),
    ...                  interfaces={"root": np.zeros(3), "end": np.array([1.0, 0, 0])})
    >>> joints = (Joint(name="crank", type="revolute", parent="ground", child="a", angle=1.0, keep_start=True),
    ...           Joint(name="knee", type="revolute", parent="a.end", child="b", angle=-2.2))
    >>> slot = Closure(name="slot", type="point_on_plane", a="ground", b="b.end", axis=np.array([0, 1.0, 0]))
    >>> system = System(bodies={"a": rod, "b": rod}, joints=joints, closures=(slot,))
    >>> packed = pack(system)
    >>> loops = Loops(system, packed, t_end=1.0)
    >>> y = loops.assemble(*workspace(packed.tree, packed.flex), np.array([1.0, -2.2, 0, 0]), np.zeros((2, 3)))
    >>> y[:2].round(6)
    array([ 1., -2.])
    """

    def __init__(self, system: System, packed: Packed, t_end: float) -> None:
        self.system, self.packed = system, packed
        self.closing = pack_constraints(system, packed, t_end)
        self.arrays = self.closing.arrays
        self.work = constraint_work(self.arrays, packed)
        self.notes: list[str] = []

    @property
    def breaks(self) -> np.ndarray:
        """Times at which a prescribed value changes its piece, s."""
        return self.arrays.tables.until

    def enter(self, begin: float, end: float) -> None:
        """Say which stretch between breaks is integrated."""
        self.arrays.tables.middle[0] = (begin + end) / 2

    def residual(self, W: np.ndarray, F: Scratch | None, y: np.ndarray, motion: np.ndarray, t: float) -> None:
        """Measure all rows, after `kernel.outward`."""
        kernel.world(self.packed.tree, W)
        constraints.constraint_residual(self.arrays, self.packed.tree, self.packed.flex, W, F, y, motion, t, self.work)

    def correct(
        self, W: np.ndarray, F: Scratch | None, udot: np.ndarray, baumgarte: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Turn the accelerations of `kernel.forward` into those of the closed system."""
        tree, flex = self.packed.tree, self.packed.flex
        constraints.constraint_accelerations(self.arrays, tree, flex, W, F, self.work, *baumgarte, udot)

    def assemble(
        self, W: np.ndarray, F: Scratch | None, y: np.ndarray, motion: np.ndarray, t: float = 0.0
    ) -> np.ndarray:
        """Return the consistent state nearest to y, and write the notes.

        Joints with `keep_start` and modes at rest are kept where the loops close without them: in the metric they
        are 1e8 times heavier. Nearest is meant in the mass matrix.

        Raises
        ------
        InputError
            When a loop cannot be closed; the sentence names the closure and its gap.
        """
        self.notes.clear()
        self._as_at_start(W, F, y, motion, t)
        held = self._held(W, F, y, motion)
        soft = self.softest()
        for hinge, stiff in ((held, HELD * soft), (held, soft), (0 * held, soft)):
            found = y.copy()
            if self._closed(W, F, found, motion, t, hinge, stiff):
                self._note_moved(y, found)
                self._note_redundant()
                return found
        raise InputError(self._gap(W, F, y, motion, t))

    def settle(self, W: np.ndarray, F: Scratch | None, y: np.ndarray, motion: np.ndarray, t: float) -> bool:
        """Project a state in place, stiff modes moving least; False when it cannot be closed."""
        tree, flex, none = self.packed.tree, self.packed.flex, np.zeros(self.packed.nu)
        args = (self.arrays, tree, flex, W, F, y, motion, t, self.work, none, self.softest(), CLOSED, MOST_STEPS)
        return constraints.settle(*args) >= 0

    def begin(self, closure: int) -> None:
        """Let a closure hold the ends as they are, after `residual`."""
        rows = self.closing.of(closure)
        self.arrays.constants[rows, VALUE] += self.work.phi[rows]
        self.closing.activate(closure, True)

    def exerted(self) -> dict[str, np.ndarray]:
        """Return ``name.force``, ``name.torque``, ``name.multiplier`` of the multipliers, as in `Result.channels`."""
        found: dict[str, np.ndarray] = {}
        for k, closure in enumerate(self.system.closures):
            rows = self.closing.of(k)
            size, lines = self.work.multiplier[rows], self.work.lines[rows]
            if isinstance(closure, Coupler):
                found[f"{closure.name}.multiplier"] = size[0]
                continue
            to_a = self._axes(2 * k).T
            found[f"{closure.name}.force"] = to_a @ (size @ lines[:, : constraints.TORQUE_A])
            found[f"{closure.name}.torque"] = to_a @ (size @ lines[:, constraints.TORQUE_B :])
        return found

    def _closed(self, W, F, y, motion, t, hinge, stiff) -> bool:
        args = (self.arrays, self.packed.tree, self.packed.flex, W, F, y)
        if constraints.project_positions(*args, motion, t, self.work, hinge, stiff, CLOSED, MOST_STEPS) < 0:
            return False
        if self._other_way_round() or not constraints.project_velocities(*args, self.work, hinge, stiff):
            return False
        kernel.outward(self.packed.tree, self.packed.flex, W, F, y, motion)
        self.residual(W, F, y, motion, t)
        reach = np.abs(y[self.packed.nx :]).max(initial=0.0) + np.abs(self.work.push).max() / self.closing.size
        return bool(constraints.violation(self.arrays, self.work.rate) <= CLOSED_RATE * reach)

    def _other_way_round(self) -> bool:
        """Whether the axes of a closure agree but point against each other: ``ea.eb = 0`` holds both ways."""
        for k, closure in enumerate(self.system.closures):
            count = sum(self.closing.rows[i].kind == ANGLE for i in self.closing.of(k))
            if count >= 2 and self.closing.active(k):
                turn = self._axes(2 * k).T @ self._axes(2 * k + 1) @ closure.rotation.T
                if closure.axis @ turn @ closure.axis < 0 or (count == 3 and np.trace(turn) < 2):
                    return True
        return False

    def _axes(self, end: int) -> np.ndarray:
        return self.work.ends[end, constraints.TURN : constraints.SPEED].reshape(3, 3)

    def _as_at_start(self, W, F, y, motion, t) -> None:
        """Take lengths and sums of joint coordinates that have no value from the start values."""
        arrays = self.arrays
        rows = np.isin(arrays.rows[:, KIND], (DISTANCE, COUPLER)) & (arrays.rows[:, TABLE] < 0)
        if np.any(rows):
            kernel.outward(self.packed.tree, self.packed.flex, W, F, y, motion)
            self.residual(W, F, y, motion, t)
            arrays.constants[rows, VALUE] += self.work.phi[rows]

    def _held(self, W, F, y, motion) -> np.ndarray:
        """Inertias that keep the coordinates of joints with `keep_start`: each HELD times what the hinge carries."""
        tree, hinge = self.packed.tree, np.zeros(self.packed.nu)
        kernel.outward(tree, self.packed.flex, W, F, y, motion)
        kernel.inward(tree, self.packed.flex, W, F, np.zeros(self.packed.nu), np.zeros(self.packed.nu), 0.0, 0.0)
        along, about = [IA, IA + 3, IA + 5], [J_, J_ + 3, J_ + 5]
        columns = {REVOLUTE: about[2:], PRISMATIC: along[2:], SPHERICAL: about, FREE: along + about}
        for i, link in enumerate(self.packed.links):
            kind, u = self.packed.types[i], tree.ints[i, U]
            if link.joint.keep_start and SPEEDS[kind]:
                hinge[u : u + SPEEDS[kind]] = HELD * np.abs(W[i, columns[kind]]).max()
        return hinge

    def softest(self) -> float:
        """Return 1 / K of the softest mode, 0 without modes."""
        stiffness = np.concatenate([body.K for body in self.system.bodies.values()])
        return 1 / stiffness[stiffness > 0].min() if np.any(stiffness > 0) else 0.0

    def _note_moved(self, before: np.ndarray, after: np.ndarray) -> None:
        moved = []
        for i, link in enumerate(self.packed.links):
            x = self.packed.tree.ints[i, X]
            if self.packed.types[i] in (REVOLUTE, PRISMATIC) and abs(after[x] - before[x]) > 1e-6:
                unit = "rad" if self.packed.types[i] == REVOLUTE else "m"
                moved.append(f"{link.joint.name} from {before[x]:.6g} to {after[x]:.6g} {unit}")
        if moved:
            self.notes.append(f"closing the loops moved {', '.join(moved)}")

    def _note_redundant(self) -> None:
        """Name the rows that the factorisation left out, by closure."""
        left = sorted(i for i in self.work.order[self.work.rank[0] :] if self.closing.holding[i])
        for k, closure in enumerate(self.system.closures):
            names = [self.closing.rows[i].stops for i in left if self.closing.rows[i].closure == k]
            if names:
                self.notes.append(
                    f"closure {closure.name!r}: {', '.join(names)} {'is' if len(names) == 1 else 'are'} already "
                    "stopped by other joints; the forces there are not determined and reported as zero"
                )

    def _gap(self, W, F, y, motion, t) -> str:
        """Say which closure stays open, and by how much."""
        found, free, soft = y.copy(), np.zeros(self.packed.nu), self.softest()
        args = (self.arrays, self.packed.tree, self.packed.flex, W, F, found)
        reached = constraints.project_positions(*args, motion, t, self.work, free, soft, CLOSED, MOST_STEPS) >= 0
        if reached and self._other_way_round():
            return "the loops close only with an axis pointing the other way; give start values nearer to closed loops"
        if reached:
            constraints.project_velocities(*args, self.work, free, soft)
            kernel.outward(self.packed.tree, self.packed.flex, W, F, found, motion)
            self.residual(W, F, found, motion, t)
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
        """Say which closure the last projection left open."""
        what, stops, gap, unit = self._worst(self.work.phi)
        return f"{what} cannot be kept closed: {stops}, a gap of {gap:.3g} {unit} is left"

    def _worst(self, values: np.ndarray) -> tuple[str, str, float, str]:
        """Return closure, what it stops, size and unit of the largest of ``values (m,)``."""
        sizes = np.abs(values) * self.arrays.constants[:, constraints.UNIT]
        worst = int(np.argmax(np.where(np.isfinite(sizes), sizes, np.inf)))
        row = self.closing.rows[worst]
        unit = "m" if row.kind in (POINT, DISTANCE) else "rad" if row.kind == ANGLE else "(m or rad)"
        what = f"closure {self.system.closures[row.closure].name!r}"
        return what, row.stops, abs(values[worst]), unit
