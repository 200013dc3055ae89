"""Where branches of the motion of closed loops cross: the change points in one step of a run.

There a row loses its direction: a singular value of the Jacobian G of the rows passes zero. Its singular vectors
``w`` of the rows and ``v`` of the speeds go on smoothly, so that one of them seems to turn round. The null space of G
has one direction more there, and tangents of the branches are its motions d for which ``w^T G'(d) d = 0``.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.stepping import Run
from modalprep.multibody.kernels.articulated_body import kinematic, outward
from modalprep.multibody.kernels.joints import move, normalise
from modalprep.multibody.model.joint_types import PRESCRIBED

SURE = 0.5  # product of cosines between singular vectors at both ends of a part of a step: they are the same ones
PARTS = 16  # of a step whose ends are too far from each other to be compared
DEEP = 1e-4  # of the largest singular value: steps from there may be too short to be seen as near it
ZERO = 1e-6  # of the largest singular value: none
SOLVED, MOST_SOLUTIONS = 1e-9, 8  # last of the Newton steps (rad or m) to a change point, and how many they are
FLAT = 1e-5  # of the largest bend: none
SHIFT = 1e-4  # rad or m, of differences
CLEARLY = 0.2  # difference of cosines: a motion goes along one tangent, not the other


class Regular(NamedTuple):
    """Of the Jacobian G away from change points: its rank, and its largest singular value."""

    rank: int
    size: float


class Singular(NamedTuple):
    """The least singular value that should not be zero, relative to the largest, and the vectors about it."""

    value: float
    rows: np.ndarray  # (m,) w
    speeds: np.ndarray  # (nu,) v
    null: np.ndarray  # (nu, nu - rank + 1) v and the motions that the rows allow
    inverse: np.ndarray  # (nu, m) of G without w and v


class Crossing(NamedTuple):
    """A change point: time (s), row that loses its direction, how far apart the branches come by (rad or m), tangents.

    The first tangent is that of the branch along which the motion came; None where there are more than two branches.
    """

    time: float
    row: int
    apart: float
    tangents: tuple[np.ndarray, np.ndarray] | None  # (nu,) each
    left: bool  # whether the motion leaves along the second tangent


class Course:
    """The motion in a step, or a few: the cubic through both ends and their rates; `before` is the one before."""

    def __init__(
        self, loading: Loading, times: tuple[float, float], ends: tuple, regular: Regular, before: Course | None = None
    ) -> None:
        self.loading, self.packed = loading, loading.packed
        self.loops = loading.closed_loops
        self.model, self.data, self.nx = self.packed.model, self.packed.data(), self.packed.nx
        self.begin, self.end = times
        self.ends, self.h = ends, self.end - self.begin
        self.rank, self.size = regular
        if before is not None and before.end == self.begin and before.rank == self.rank:
            self.first = before.last

    @classmethod
    def of(cls, loading: Loading, run: Run, regular: Regular, before: Course | None) -> Course:
        """Return that of the last step of a run."""
        times = float(run.clock[0].begin), float(run.clock[0].time)
        return cls(loading, times, (run.old[:-1].copy(), run.y[:-1].copy()), regular, before)

    def between(self, before: Course) -> Course | None:
        """Return the course from an earlier one to this; None where the loops are not at the same singular position."""
        if not before.end < self.begin or max(before.last.value, self.first.value) > DEEP or before.rank != self.rank:
            return None
        times = (before.end, self.begin)
        ends = (before.ends[1], self.ends[0])
        return Course(self.loading, times, ends, Regular(self.rank, self.size), before)

    @cached_property
    def first(self) -> Singular:
        """The singular value at the begin of the step."""
        return self._at(0.0)

    @cached_property
    def last(self) -> Singular:
        """The singular value at the end of the step."""
        return self._at(1.0)

    @cached_property
    def largest(self) -> float:
        """The largest singular value at the begin of the step."""
        return float(np.linalg.norm(self.jacobian(self.state(0.0), 0.0), 2))

    @cached_property
    def _rates(self) -> list[np.ndarray]:
        found = np.zeros((2, len(self.ends[0])))
        for y, out in zip(self.ends, found, strict=True):
            kinematic(self.model, y, out)
        return list(self.h * found[:, : self.nx])

    def state(self, s: float) -> np.ndarray:
        """Return the state at a share of the step, its speeds by the line between those of its ends."""
        (y0, y1), (r0, r1), n = self.ends, self._rates, self.nx
        y = y0 + s * (y1 - y0)
        step = (y1 - y0)[:n]
        y[:n] += s * (1 - s) * ((1 - s) * (r0 - step) - s * (r1 - step))
        normalise(self.model, y)
        return y

    def crossings(self) -> list[Crossing]:
        """Return the change points in the step."""
        found = [self._crossing(a, b) for a, b in self._turns()]
        return [crossing for crossing in found if crossing is not None]

    def _turns(self) -> list[tuple[float, float]]:
        """Return the parts of the step in which the singular value passes through zero."""
        if self.rank < 1 or _same(self.first, self.last) > SURE:
            return []
        shares = np.linspace(0, 1, PARTS + 1)
        each = [self._at(s) for s in shares]
        pairs = zip(shares[:-1], shares[1:], each[:-1], each[1:], strict=True)
        found = [(a, b) for a, b, one, two in pairs if _same(one, two) < -SURE]
        if not found and max(self.first.value, self.last.value) < DEEP and _same(self.first, self.last) < -SURE:
            return [(0.0, 1.0)]  # it turns little by little where round-off leads past beside the change point
        return found

    def _crossing(self, a: float, b: float) -> Crossing | None:
        """Return the change point in a part of the step; None where there is none."""
        first = self._at(a)

        def signed(s: float) -> float:
            here = self._at(s)
            return here.value * np.sign(_same(first, here))

        s = scipy.optimize.brentq(signed, a, b, xtol=1e-12) if signed(a) * signed(b) < 0.0 else b
        y = self.state(s)
        moved = 0.0
        if self.packed.nu > self.rank:
            found = self._solve(y, s)
            if found is None:
                return None
            moved = found
        here = self._singular(y, s)
        if here.value > ZERO:
            return None
        apart, tangents = 0.0, None
        if self.packed.nu > self.rank:
            bend = self.bend_at(y, s, here)
            gap = abs(here.rows @ self._gap(y, s))
            apart = float(np.sqrt(2 * gap / max(np.abs(bend).max(), 1e-300)))
            tangents = None if self.driven else tangents_of(here.null, bend)
        row = int(np.argmax(np.abs(here.rows)))
        return Crossing(self.begin + (s + moved) * self.h, row, apart, *self._incoming_first(tangents))

    def _solve(self, y: np.ndarray, s: float) -> float | None:
        """Bring the state y near a change point there; returns the further share of the step, None where it fails."""
        total = np.zeros(self.packed.nu)
        limit = 1.0 + np.linalg.norm(self.ends[1] - self.ends[0])
        for _ in range(MOST_SOLUTIONS):
            here = self._singular(y, s)
            slope = here.rows @ self.jacobian(y, s) @ here.null
            step = -here.inverse @ self._gap(y, s) - here.null @ (
                np.linalg.pinv(self.bend_at(y, s, here), FLAT, hermitian=True) @ slope
            )
            total += step
            move(self.model, y, step, y)
            if np.linalg.norm(step) <= SOLVED:
                speeds = self.state(s)[self.nx :] * self.h
                return float(speeds @ total / max(speeds @ speeds, 1e-300))
            if not np.linalg.norm(total) <= limit:
                break
        return None

    def _incoming_first(self, tangents: list[np.ndarray] | None) -> tuple[tuple[np.ndarray, np.ndarray] | None, bool]:
        """Return the tangent along which the motion came and the other one, and whether it left along the other."""
        if tangents is None:
            return None, False
        before, after = (along(tangents, y[self.nx :]) for y in self.ends)
        left = before * after < 0.0 and min(abs(before), abs(after)) > CLEARLY
        one, two = tangents if before > 0.0 else tangents[::-1]
        return (one, two), bool(left)

    @property
    def driven(self) -> bool:
        """Whether the loops move by themselves: then their branches are not those of the joints alone."""
        return bool((self.loops.arrays.rows["table"] >= 0).any() or (self.model.links["joint"] == PRESCRIBED).any())

    def _motion(self, s: float) -> tuple[np.ndarray, float]:
        t = self.begin + s * self.h
        return self.loading.prescribe(t, self.data), t

    def jacobian(self, y: np.ndarray, s: float) -> np.ndarray:
        """Return the derivatives of the rows that hold by the speeds (m, nu), lengths by the size of the system."""
        return self.loops.rate_slopes(self.data, y, *self._motion(s)) * self.loops.work.unit[:, None]

    def _gap(self, y: np.ndarray, s: float) -> np.ndarray:
        """Return what the rows measure (m,), lengths by the size of the system."""
        motion, t = self._motion(s)
        outward(self.model, self.data, y, motion)
        self.loops.residual(self.data, y, motion, t)
        return self.loops.work.phi * self.loops.work.unit

    def _at(self, s: float) -> Singular:
        return self._singular(self.state(s), s)

    def _singular(self, y: np.ndarray, s: float) -> Singular:
        u, sizes, v = np.linalg.svd(self.jacobian(y, s))
        k = max(self.rank, 1) - 1
        inverse = v[:k].T @ (u[:, :k] / sizes[:k]).T
        return Singular(sizes[k] / max(sizes[0], self.size), u[:, k], v[k], v[k:].T, inverse)

    def bend_at(self, y: np.ndarray, s: float, here: Singular) -> np.ndarray:
        """Return ``w^T G'(d) e`` for all motions d, e of the null space."""
        found = []
        for d in here.null.T:
            ends = [y.copy(), y.copy()]
            for end, shift in zip(ends, (SHIFT, -SHIFT), strict=True):
                move(self.model, end, shift * d, end)
            one, two = (here.rows @ self.jacobian(end, s) for end in ends)
            found.append((one - two) @ here.null / (2 * SHIFT))
        return (np.array(found) + np.array(found).T) / 2


def _same(one: Singular, two: Singular) -> float:
    """Return whether singular vectors are the same ones (1), or one of them has turned round (-1)."""
    return float((one.rows @ two.rows) * (one.speeds @ two.speeds))


def tangents_of(null: np.ndarray, bend: np.ndarray) -> list[np.ndarray] | None:
    """Return the two motions d of a null space for which ``d^T bend d = 0``; None where there are not just two.

    Motions that do not bend, of bodies beside the loops, are left out.
    """
    sizes, axes = np.linalg.eigh(bend)
    bent = np.abs(sizes) > FLAT * np.abs(sizes).max()
    if np.count_nonzero(bent) != 2 or np.prod(sizes[bent]) > 0.0:
        return None
    low, high = sizes[bent]
    one, other = (null @ axes[:, bent]).T
    pair = np.sqrt(high) * one, np.sqrt(-low) * other
    return [d / np.linalg.norm(d) for d in (pair[0] + pair[1], pair[0] - pair[1])]


def along(tangents: Sequence[np.ndarray], speeds: np.ndarray) -> float:
    """Return by how much speeds are more along the first of two tangents, by their cosines in the plane of both."""
    plane = np.linalg.qr(np.column_stack(tangents))[0]
    own = plane.T @ speeds
    one, two = (abs(d @ plane @ own) for d in tangents)
    return float((one - two) / max(np.linalg.norm(own), 1e-300))
