"""A current along straight segments in a planet's magnetic field (`Conductor`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene, plus, value_at, wrench_at
from modalprep.multibody.elements.packer import TWO_ENDS, ElementKind, Packer
from modalprep.multibody.elements.slopes import EndSlopes, stacked
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    dot3,
)
from modalprep.multibody.kernels.interfaces import add_wrench, node_state
from modalprep.multibody.kernels.loads.gravity import conductor_leg
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.environment import Conductor, Orbit
from modalprep.multibody.packing.tree import rows
from modalprep.vectors import cross, skew

ROW = np.dtype([("current", np.int64), ("first", np.int64), ("end", np.int64)])  # function of time; its segments
SEGMENT = np.dtype([*TWO_ENDS])


@by_address
class Conductors(NamedTuple):
    """Packed conductors and their straight segments."""

    rows: np.ndarray  # (conductors,) ROW
    segments: np.ndarray  # (segments,) SEGMENT


def pack(packer: Packer, loads: Sequence[Conductor]) -> Conductors:
    """Return the rows of conductors and segments."""
    found, segments = [], []
    for load in loads:
        first = len(segments)
        segments += [packer.ends(pair) for pair in load.segments]
        found.append((packer.table(f"conductor {load.name!r}", load.current), first, len(segments)))
    return Conductors(rows(ROW, found), rows(SEGMENT, segments))


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add the magnetic forces; returns their power, 0, 0."""
    packed = elements.conductor
    power = 0.0
    for i in range(len(packed.rows)):
        own = packed.rows[i]
        half = 0.5 * value(environment.tables, own.current, t)
        for k in range(own.first, own.end):
            ends = packed.segments[k]
            f, _, va, vb = _segment(ends, environment, model, data, t)
            f = (half * f[0], half * f[1], half * f[2])
            add_wrench(model, data, ends.link_a, ends.interface_a, f, ZERO3)
            add_wrench(model, data, ends.link_b, ends.interface_b, f, ZERO3)
            power += dot3(f, va) + dot3(f, vb)
    return power, 0.0, 0.0


@compile_kernel
def observe(elements, environment, model, data, t, i):
    """Return current and electromotive force of conductor i."""
    packed = elements.conductor
    own = packed.rows[i]
    total = 0.0
    for k in range(own.first, own.end):
        _, emf, _, _ = _segment(packed.segments[k], environment, model, data, t)
        total += emf
    return value(environment.tables, own.current, t), total


@compile_kernel
def _segment(ends, environment, model, data, t):
    """Return force per current, electromotive force, and the velocities of the ends of a straight segment."""
    a, _, va, _ = node_state(model, data, ends.link_a, ends.interface_a)
    b, _, vb, _ = node_state(model, data, ends.link_b, ends.interface_b)
    f, emf = conductor_leg(environment.planet[0], t, a, b, va, vb)
    return f, emf, va, vb


def dense(load: Conductor, scene: Scene) -> DenseLoads:
    """Return the forces, the dipole's field by rotations from the planet's axes: the reference implementation."""
    total = scene.nothing
    for ends in load.segments:
        a, b = (scene.end(end) for end in ends)
        B, _ = _field(scene.system.orbit, scene.t, (a.frame.position + b.frame.position) / 2)
        f = value_at(load.current, scene.t) * np.cross(b.frame.position - a.frame.position, B)
        for point in (a, b):
            total = plus(total, wrench_at(point, f / 2, np.zeros(3)))
    return total


def _field(orbit: Orbit | None, t: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the field of the dipole at x, T, and its derivative by the place (3, 3); none without a dipole."""
    if orbit is None or orbit.dipole is None:
        return np.zeros(3), np.zeros((3, 3))
    d = orbit.dipole
    u = orbit.argument_of_latitude + orbit.rate * t
    to_orbit = scipy.spatial.transform.Rotation.from_euler("ZXZ", [0.0, orbit.inclination, u])
    turn = d.longitude + orbit.planet_spin * t
    north = to_orbit.inv().apply(scipy.spatial.transform.Rotation.from_euler("ZY", [turn, d.tilt]).apply([0, 0, 1.0]))
    r = x + np.array([orbit.radius, 0, 0])
    R = np.linalg.norm(r)
    n, size = r / R, d.strength * (d.radius / R) ** 3
    along = north @ n
    slope = np.outer(north, n) + np.outer(n, north) + along * np.eye(3) - 5 * along * np.outer(n, n)
    return size * (north - 3 * along * n), -3 * size / R * slope


def tangent(load: Conductor, scene: Scene) -> EndSlopes:
    """Return the forces with their derivatives."""
    ends = [end for pair in load.segments for end in pair]
    wrench, by_pose, by_rate = stacked(len(ends))
    half = value_at(load.current, scene.t) / 2
    for k, pair in enumerate(load.segments):
        a, b = (scene.end(end).frame.position for end in pair)
        B, slope = _field(scene.system.orbit, scene.t, (a + b) / 2)
        for one in (12 * k, 12 * k + 6):
            wrench[one : one + 3] = half * cross(b - a, B)
            for other, sign in ((12 * k, -1.0), (12 * k + 6, 1.0)):
                by_pose[one : one + 3, other : other + 3] = half * (skew(b - a) @ slope / 2 - sign * skew(B))
    return EndSlopes(ends, wrench, by_pose, by_rate)


KIND = ElementKind(Conductor, pack, apply, dense, tangent, channels=("current", "emf"), observe=observe)
