"""Thrust of a jet, and the Coriolis force of the gas on its way to it (`ExpelledGas`)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene, plus, wrench_at
from modalprep.multibody.elements.packer import ElementKind, Packer
from modalprep.multibody.elements.slopes import EndSlopes, stacked, turning
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    dot3,
    get3,
)
from modalprep.multibody.kernels.interfaces import add_wrench, node_state
from modalprep.multibody.kernels.time_tables import table
from modalprep.multibody.model.depletion import ExpelledGas
from modalprep.multibody.packing.tree import rows

ROW = np.dtype(
    [
        ("source", np.int64),  # function of time, the mass of the source
        ("first", np.int64),  # point of its way
        ("exit", np.int64),
        ("mass_fraction", np.float64),
        ("speed", np.float64),
        ("pressure", np.float64),  # N
        ("axis", np.float64, 3),  # at the exit
    ]
)
POINT = np.dtype([("link", np.int64), ("interface", np.int64)])


@by_address
class Gas(NamedTuple):
    """Packed jets and the points of their ways."""

    rows: np.ndarray  # (jets,) ROW
    points: np.ndarray  # (points,) POINT


def pack(packer: Packer, loads: Sequence[ExpelledGas]) -> Gas:
    """Return the rows of jets and points."""
    found, points = [], []
    for load in loads:
        first = len(points)
        points += [packer.end(point) for point in load.flow_points]
        source = packer.table(f"gas {load.name!r}", load.source)
        found.append((source, first, len(points) - 1, load.mass_fraction, load.speed, load.pressure, load.axis))
    return Gas(rows(ROW, found), rows(POINT, points))


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add all jets; returns their power, 0, 0."""
    packed = elements.expelled_gas
    power = 0.0
    for i in range(len(packed.rows)):
        power += _jet(packed.rows[i], packed.points, environment, model, data, t)
    return power, 0.0, 0.0


@compile_kernel
def _jet(own, points, environment, model, data, t):
    """Thrust of a jet and the Coriolis force of its way: ``-m' (v_k+1 - v_k)`` on both ends of each stretch.

    That is ``-int 2 m' (w x t).v_r ds`` with velocities linear along the stretch. Returns the power.
    """
    _, rate, _ = table(environment.tables, own.source, t)
    flow = -own.mass_fraction * rate
    if flow == 0.0:
        return 0.0
    power = 0.0
    before = ZERO3
    turn = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for k in range(own.first, own.exit + 1):
        _, turn, v, _ = node_state(model, data, points[k].link, points[k].interface)
        if k > own.first:
            f = (flow * (before[0] - v[0]), flow * (before[1] - v[1]), flow * (before[2] - v[2]))
            for end in range(k - 1, k + 1):
                add_wrench(model, data, points[end].link, points[end].interface, f, ZERO3)
            power += dot3(f, before) + dot3(f, v)
        before = v
    push = -flow * own.speed - (own.pressure if flow > 0.0 else 0.0)
    axis = get3(own.axis)
    f = times(turn, (push * axis[0], push * axis[1], push * axis[2]))
    add_wrench(model, data, points[own.exit].link, points[own.exit].interface, f, ZERO3)
    return power + dot3(f, before)


def dense(load: ExpelledGas, scene: Scene) -> DenseLoads:
    """Return thrust, and on each stretch ``-int 2 m' (w x t).v_r ds``, all linear along it: the reference."""
    way = [scene.end(point) for point in load.flow_points]
    exit_ = way[-1]
    total = wrench_at(exit_, -load.thrust(scene.t) * (exit_.frame.rotation @ load.axis), np.zeros(3))
    for a, b in pairwise(way):
        coriolis = -2 * load.flow(scene.t) * (b.frame.velocity - a.frame.velocity)
        power = float(coriolis @ (a.frame.velocity + b.frame.velocity)) / 2
        total = plus(total, DenseLoads((a.J + b.J)[:3].T @ coriolis / 2, power, 0.0, 0.0))
    return total


def tangent(load: ExpelledGas, scene: Scene) -> EndSlopes:
    """Return the forces with their derivatives: the thrust turns with the exit, Coriolis forces follow velocities."""
    way = load.flow_points
    wrench, by_pose, by_rate = stacked(len(way))
    frames = [scene.end(point).frame for point in way]
    thrust = np.concatenate([-load.thrust(scene.t) * (frames[-1].rotation @ load.axis), np.zeros(3)])
    wrench[-6:], by_pose[-6:, -6:] = thrust, turning(thrust)
    flow = load.flow(scene.t)
    for k in range(len(way) - 1):
        ends = first, second = [slice(6 * j, 6 * j + 3) for j in (k, k + 1)]
        for end in ends:
            wrench[end] += flow * (frames[k].velocity - frames[k + 1].velocity)
            by_rate[end, first] += flow * np.eye(3)
            by_rate[end, second] -= flow * np.eye(3)
    return EndSlopes(way, wrench, by_pose, by_rate)


KIND = ElementKind(ExpelledGas, pack, apply, dense, tangent)
