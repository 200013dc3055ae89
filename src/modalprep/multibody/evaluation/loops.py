"""The closed loops of one run: packed, with their scratch; assembly of the start, projection after steps."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.algebra.lanes import WIDTH
from modalprep.multibody.kernels.closed_loops import constraints, multipliers, projection
from modalprep.multibody.kernels.closed_loops.constraints import ANGLE, COUPLER, DISTANCE, POINT
from modalprep.multibody.kernels.closed_loops.projection import CLOSED
from modalprep.multibody.kernels.data import FREE, REVOLUTE, SLIDING, SPEEDS, SPHERICAL, Data
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.constraints import constraint_work, pack_constraints
from modalprep.multibody.packing.packed import Packed

CLOSED_RATE = 1e-8  # of the largest rate, the same way
MOST_STEPS = 60
HELD = 1e8  # how much heavier a coordinate is that should stay


class Loops:
    """Closed loops and motion constraints of a system on [0, t_end].

    Attributes
    ----------
    arrays, work, trial
        For the functions of `constraints` and `projection`.
    notes : list of str
        After `assemble`: what was moved to close the loops, and which conditions are redundant.

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

    def __init__(self, system: System, packed: Packed, t_end: float) -> None:
        self.system, self.packed = system, packed
        self.closing = pack_constraints(system, packed, t_end)
        self.arrays = self.closing.arrays
        self.work, self.trial = constraint_work(self.arrays, packed, self.closing.value), packed.data()
        self.notes: list[str] = []
        for k, closure in enumerate(system.closures):
            self.activate(k, closure.active)

    def activate(self, closure: int, active: bool) -> None:
        """Let a closure hold, or let it go: then its rows are measured, but push nothing and count as closed."""
        rows = self.closing.of(closure)
        self.work.unit[rows] = self.closing.unit[rows] if active else 0.0
        self.work.floor[rows] = self.closing.floor[rows] if active else np.inf

    def active(self, closure: int) -> bool:
        """Return whether a closure holds."""
        return bool(self.holding[self.closing.of(closure)].any())

    @property
    def holding(self) -> np.ndarray:
        """Which rows hold (m,): all but those of friction, and those of closures let go."""
        return self.work.unit > 0

    @property
    def breaks(self) -> np.ndarray:
        """Times at which a prescribed value changes its piece, s."""
        return self.arrays.tables.until

    def enter(self, begin: float, end: float) -> None:
        """Say which stretch between breaks is integrated."""
        self.arrays.tables.middle[0] = (begin + end) / 2

    def residual(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> None:
        """Measure all rows, after `kernel.outward`."""
        world(self.packed.model, data)
        constraints.constraint_residual(self.arrays, self.packed.model, data, y, motion, t, self.work, False)

    def rate_slopes(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> np.ndarray:
        """Return the derivatives of the rates of all rows by the speeds (m, nu); prescribed hinges stand still."""
        out = np.empty((len(self.arrays.rows), self.packed.nu))
        projection.rate_slopes(self.arrays, self.packed.model, data, y.copy(), motion, t, self.work, out)
        return out

    def forward(
        self, data: Data, tau: np.ndarray, udot: np.ndarray, baumgarte: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Write the accelerations of the closed system, as `kernel.forward` does those of the open one."""
        multipliers.constraint_accelerations(self.arrays, self.packed.model, data, self.work, *baumgarte, tau, udot)

    def assemble(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float = 0.0) -> np.ndarray:
        """Return the consistent state nearest to y, and write the notes.

        Joints with `keep_start` and modes at rest are kept where the loops close without them: in the metric they
        are 1e8 times heavier. Nearest is meant in the mass matrix.

        Raises
        ------
        InputError
            When a loop cannot be closed; the sentence names the closure and its gap.
        """
        self.notes.clear()
        self._as_at_start(data, y, motion, t)
        held = self._held(data, y, motion)
        soft = self.softest()
        for hinge, stiff in ((held, HELD * soft), (held, soft), (0 * held, soft)):
            found = y.copy()
            if self._closed(data, found, motion, t, hinge, stiff):
                self._note_moved(y, found)
                self._note_redundant()
                return found
        raise InputError(self._gap(data, y, motion, t))

    def settle(self, data: Data, y: np.ndarray, motion: np.ndarray, t: float) -> bool:
        """Project a state in place, stiff modes moving least; False when it cannot be closed."""
        none = np.zeros(self.packed.nu)
        args = (self.arrays, self.packed.model, data, self.trial, y, motion, t, self.work, none, self.softest())
        return projection.settle(*args, CLOSED, MOST_STEPS, False) >= 0

    def begin(self, closure: int) -> None:
        """Let a closure hold the ends as they are, after `residual`."""
        rows = self.closing.of(closure)
        self.work.value[rows] += self.work.phi[rows]
        self.activate(closure, True)

    def exerted(self) -> dict[str, np.ndarray]:
        """Return ``name.force``, ``name.torque``, ``name.multiplier`` of the multipliers, as in `Result.channels`."""
        found: dict[str, np.ndarray] = {}
        for k, closure in enumerate(self.system.closures):
            rows = self.closing.of(k)
            size, lane = self.work.multiplier[rows], self.work.paths.lane[rows]
            lines = self.work.groups["line"].reshape(-1, 9, WIDTH)[lane // WIDTH, :, lane % WIDTH]
            if isinstance(closure, Coupler):
                found[f"{closure.name}.multiplier"] = size[0]
                continue
            to_a = self._axes(2 * k).T
            found[f"{closure.name}.force"] = to_a @ (size @ lines[:, :3])
            found[f"{closure.name}.torque"] = to_a @ (size @ lines[:, 6:])
        return found

    def _closed(self, data, y, motion, t, hinge, stiff) -> bool:
        if not self._project_positions(data, y, motion, t, hinge, stiff) or self._other_way_round():
            return False
        if not self._project_velocities(data, y, motion, hinge, stiff):
            return False
        kernel.outward(self.packed.model, data, y, motion)
        self.residual(data, y, motion, t)
        reach = np.abs(y[self.packed.nx :]).max(initial=0.0) + np.abs(self.work.push).max() / self.closing.size
        return bool(multipliers.violation(self.work, self.work.rate) <= CLOSED_RATE * reach)

    def _project_positions(self, data, y, motion, t, hinge, stiff) -> bool:
        args = (self.arrays, self.packed.model, data, self.trial, y, motion, t, self.work, hinge, stiff)
        return projection.project_positions(*args, CLOSED, MOST_STEPS, False) >= 0

    def _project_velocities(self, data, y, motion, hinge, stiff) -> bool:
        args = (self.arrays, self.packed.model, data, y, motion, self.work, hinge, stiff)
        return projection.project_velocities(*args, 0.0, False)

    def _other_way_round(self) -> bool:
        """Whether the axes of a closure agree but point against each other: ``ea.eb = 0`` holds both ways."""
        for k, closure in enumerate(self.system.closures):
            count = sum(self.closing.rows[i].kind == ANGLE for i in self.closing.of(k))
            if count >= 2 and self.active(k):
                turn = self._axes(2 * k).T @ self._axes(2 * k + 1) @ closure.rotation.T
                if closure.axis @ turn @ closure.axis < 0 or (count == 3 and np.trace(turn) < 2):
                    return True
        return False

    def _axes(self, end: int) -> np.ndarray:
        turn, link = self.work.ends["rotation"][end].reshape(3, 3), self.arrays.ends["link"][end]
        return turn @ self.packed.align(link).T if link >= 0 else turn

    def _as_at_start(self, data, y, motion, t) -> None:
        """Take lengths and sums of joint coordinates that have no value from the start values."""
        arrays = self.arrays
        kind = arrays.rows["kind"]
        rows = ((kind == DISTANCE) | (kind == COUPLER)) & (arrays.rows["table"] < 0)
        if np.any(rows):
            kernel.outward(self.packed.model, data, y, motion)
            self.residual(data, y, motion, t)
            self.work.value[rows] += self.work.phi[rows]

    def _held(self, data, y, motion) -> np.ndarray:
        """Inertias that keep the coordinates of joints with `keep_start`: each HELD times what the hinge carries."""
        model, hinge = self.packed.model, np.zeros(self.packed.nu)
        kernel.outward(model, data, y, motion)
        kernel.inward(model, data, np.zeros(self.packed.nu), hinge, 0.0, 0.0)
        for i, link in enumerate(self.packed.links):
            kind, u = self.packed.types[i], model.links["u"][i]
            if link.joint.keep_start and SPEEDS[kind]:
                along, about = data.links["M"][i, [0, 3, 5]], data.links["J"][i, [0, 3, 5]]
                one = about[2:] if self.packed.turns(i) else along[2:]
                sizes = {REVOLUTE: one, SLIDING: one, SPHERICAL: about, FREE: [*along, *about]}[kind]
                hinge[u : u + SPEEDS[kind]] = HELD * np.abs(sizes).max()
        return hinge

    def softest(self) -> float:
        """Return 1 / K of the softest mode, 0 without modes."""
        stiffness = np.concatenate([body.K for body in self.system.bodies.values()])
        return 1 / stiffness[stiffness > 0].min() if np.any(stiffness > 0) else 0.0

    def _note_moved(self, before: np.ndarray, after: np.ndarray) -> None:
        moved = []
        for i, link in enumerate(self.packed.links):
            x = self.packed.model.links["x"][i]
            if self.packed.types[i] in (REVOLUTE, SLIDING) and abs(after[x] - before[x]) > 1e-6:
                unit = "rad" if self.packed.turns(i) else "m"
                moved.append(f"{link.joint.name} from {before[x]:.6g} to {after[x]:.6g} {unit}")
        if moved:
            self.notes.append(f"closing the loops moved {', '.join(moved)}")

    def _note_redundant(self) -> None:
        """Name the rows that the factorisation left out, by closure."""
        left = sorted(i for i in self.work.order[self.work.rank[0] :] if self.holding[i])
        for k, closure in enumerate(self.system.closures):
            names = [self.closing.rows[i].stops for i in left if self.closing.rows[i].closure == k]
            if names:
                self.notes.append(
                    f"closure {closure.name!r}: {', '.join(names)} {'is' if len(names) == 1 else 'are'} already "
                    "stopped by other joints; the forces there are not determined and reported as zero"
                )

    def _gap(self, data, y, motion, t) -> str:
        """Say which closure stays open, and by how much."""
        found, free, soft = y.copy(), np.zeros(self.packed.nu), self.softest()
        reached = self._project_positions(data, found, motion, t, free, soft)
        if reached and self._other_way_round():
            return "the loops close only with an axis pointing the other way; give start values nearer to closed loops"
        if reached:
            self._project_velocities(data, found, motion, free, soft)
            kernel.outward(self.packed.model, data, found, motion)
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
        """Say which closure the last projection left open."""
        what, stops, gap, unit = self._worst(self.work.phi)
        return f"{what} cannot be kept closed: {stops}, a gap of {gap:.3g} {unit} is left"

    def _worst(self, values: np.ndarray) -> tuple[str, str, float, str]:
        """Return closure, what it stops, size and unit of the largest of ``values (m,)``."""
        sizes = np.abs(values) * self.work.unit
        worst = int(np.argmax(np.where(np.isfinite(sizes), sizes, np.inf)))
        row = self.closing.rows[worst]
        unit = "m" if row.kind in (POINT, DISTANCE) else "rad" if row.kind == ANGLE else "(m or rad)"
        what = f"closure {self.system.closures[row.closure].name!r}"
        return what, row.stops, abs(values[worst]), unit
