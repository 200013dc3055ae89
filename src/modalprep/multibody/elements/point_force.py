"""A force and a torque on an interface (`PointForce`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene, value_at, wrench_at
from modalprep.multibody.elements.packer import ElementKind, Packer
from modalprep.multibody.elements.slopes import EndSlopes, turning
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import dot3
from modalprep.multibody.kernels.interfaces import add_wrench, node_state
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.loads import PointForce
from modalprep.multibody.packing.tree import rows

ROW = np.dtype(
    [
        ("link", np.int64),
        ("interface", np.int64),
        ("follows", np.int64),  # whether its axes are those of the interface
        ("force", np.int64, 3),  # functions of time
        ("torque", np.int64, 3),
    ]
)


def pack(packer: Packer, loads: Sequence[PointForce]) -> np.recarray:
    """Return the rows."""
    return rows(ROW, [_row(packer, load) for load in loads])


def _row(packer: Packer, load: PointForce) -> tuple:
    force, torque = (
        [packer.table(f"force {load.name!r}", law) for law in three] for three in (load.force, load.torque)
    )
    return (*packer.end(load.at), load.axes == "body", force, torque)


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add the forces; returns their power, 0, 0."""
    rows = elements.point_force
    power = 0.0
    for i in range(len(rows)):
        own = rows[i]
        _, turn, v, w = node_state(model, data, own.link, own.interface)
        f = _values(environment.tables, own.force, t)
        m = _values(environment.tables, own.torque, t)
        if own.follows:
            f, m = times(turn, f), times(turn, m)
        add_wrench(model, data, own.link, own.interface, f, m)
        power += dot3(f, v) + dot3(m, w)
    return power, 0.0, 0.0


@compile_kernel
def _values(tables, three, t):
    return value(tables, three[0], t), value(tables, three[1], t), value(tables, three[2], t)


def dense(load: PointForce, scene: Scene) -> DenseLoads:
    """Return what it does: the reference implementation."""
    point = scene.end(load.at)
    turn = point.frame.rotation if load.axes == "body" else np.eye(3)
    force, torque = ([value_at(function, scene.t) for function in three] for three in (load.force, load.torque))
    return wrench_at(point, turn @ force, turn @ torque)


def tangent(load: PointForce, scene: Scene) -> EndSlopes:
    """Return the force with its derivatives: it turns with the interface, or not at all."""
    follows = load.axes == "body"
    turn = scene.end(load.at).frame.rotation if follows else np.eye(3)
    wrench = np.concatenate([turn @ [value_at(f, scene.t) for f in three] for three in (load.force, load.torque)])
    return EndSlopes((load.at,), wrench, follows * turning(wrench), np.zeros((6, 6)))


KIND = ElementKind(PointForce, pack, apply, dense, tangent)
