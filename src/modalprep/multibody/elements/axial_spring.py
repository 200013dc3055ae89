"""A spring and damper along the line between two ends (`AxialSpring`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene, value_at
from modalprep.multibody.elements.packer import TWO_ENDS, ElementKind, ImplicitRow, Packer, ground_or_interface, motion
from modalprep.multibody.elements.slopes import EndSlopes, opposite, stacked
from modalprep.multibody.kernels.algebra.matrices import UNIT9
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    dot3,
    get3,
)
from modalprep.multibody.kernels.closed_loops.constraints import DISTANCE
from modalprep.multibody.kernels.interfaces import add_wrench
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.loads import AxialSpring
from modalprep.multibody.packing.tree import rows

ROW = np.dtype(
    [
        *TWO_ENDS,
        ("actuator", np.int64),  # function of time
        ("tension_only", np.int64),
        ("stiffness", np.float64),
        ("damping", np.float64),
        ("free_length", np.float64),
        ("position", np.float64, 3),  # of an end on the ground
    ]
)


def pack(packer: Packer, loads: Sequence[AxialSpring]) -> np.recarray:
    """Return the rows."""
    return rows(ROW, [_row(packer, load) for load in loads])


def _row(packer: Packer, load: AxialSpring) -> tuple:
    ends = packer.ends(load.between)
    actuator = packer.table(f"spring {load.name!r}", load.actuator_force)
    constants = (load.stiffness, load.damping, load.free_length, load.position)
    return (*ends, actuator, load.tension_only, *constants)


def implicit(packed: np.recarray) -> list[ImplicitRow]:
    """Return a row along the line of each spring that cannot go slack."""
    tight = [c for c in packed if not c.tension_only]
    return [ImplicitRow(DISTANCE, np.zeros(3), c.stiffness, c.damping, ground_or_interface(c)) for c in tight]


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add the forces; returns the power of dampers and actuators, the energy stored, 0."""
    rows = elements.axial_spring
    power, stored = 0.0, 0.0
    for i in range(len(rows)):
        own = rows[i]
        f, _, _, p, e = _evaluate(own, environment, model, data, t)
        add_wrench(model, data, own.link_a, own.interface_a, f, ZERO3)
        add_wrench(model, data, own.link_b, own.interface_b, (-f[0], -f[1], -f[2]), ZERO3)
        power, stored = power + p, stored + e
    return power, stored, 0.0


@compile_kernel
def observe(elements, environment, model, data, t, i):
    """Return length and tension of spring i."""
    rows = elements.axial_spring
    _, length, tension, _, _ = _evaluate(rows[i], environment, model, data, t)
    return length, tension


@compile_kernel
def _evaluate(own, environment, model, data, t):
    """Return what `law` does at the present motion."""
    place = get3(own.position)
    a, _, va, _ = motion(model, data, own.link_a, own.interface_a, place, UNIT9)
    b, _, vb, _ = motion(model, data, own.link_b, own.interface_b, place, UNIT9)
    return law(own, value(environment.tables, own.actuator, t), a, b, va, vb)


@compile_kernel
def law(c, actuator, a, b, va, vb):
    """Spring of constants c between points a and b with velocities va, vb, inertial; `actuator` draws them together, N.

    With `tension_only` it pulls or does nothing: no force below its length, and none of a damper that would push.
    Returns the force on a (b feels the opposite), length, tension, power of damper and actuator, energy stored.
    """
    d = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    long = np.sqrt(dot3(d, d))
    g = 1.0 / long if long > 0.0 else 0.0
    rate = g * dot3(d, (vb[0] - va[0], vb[1] - va[1], vb[2] - va[2]))
    stretch = long - c.free_length
    elastic = c.stiffness * stretch
    other = c.damping * rate + actuator
    if c.tension_only:
        if stretch < 0.0:
            return ZERO3, long, 0.0, 0.0, 0.0
        other = max(other, -elastic)
    f = g * (elastic + other)
    return (f * d[0], f * d[1], f * d[2]), long, elastic + other, -other * rate, 0.5 * elastic * stretch


def dense(load: AxialSpring, scene: Scene) -> DenseLoads:
    """Return what it does: the reference implementation."""
    a, b = (scene.end(end, load.position) for end in load.between)
    apart = b.frame.position - a.frame.position
    length = float(np.linalg.norm(apart))
    along = apart / length if length > 0 else apart
    rate = float(along @ (b.frame.velocity - a.frame.velocity))
    other = load.damping * rate + value_at(load.actuator_force, scene.t)
    stretch = length - load.free_length
    tension = load.stiffness * stretch + other
    if load.tension_only:
        stretch, tension = max(stretch, 0.0), max(tension, 0.0) if stretch > 0 else 0.0
        other = tension - load.stiffness * stretch
    stored = load.stiffness * stretch**2 / 2
    return DenseLoads((a.J - b.J)[:3].T @ (tension * along), -other * rate, stored, 0.0)


def tangent(load: AxialSpring, scene: Scene) -> EndSlopes:
    """Return the forces with their derivatives; none where the spring is slack, or has no direction."""
    a, b = (scene.end(end, load.position).frame for end in load.between)
    apart, moving = b.position - a.position, b.velocity - a.velocity
    length = float(np.linalg.norm(apart))
    along = apart / length if length > 0 else apart
    other = load.damping * (along @ moving) + value_at(load.actuator_force, scene.t)
    tension = load.stiffness * (length - load.free_length) + other
    if not length > 0 or (load.tension_only and (length < load.free_length or tension < 0)):
        return EndSlopes(load.between, *stacked(2))
    across = (np.eye(3) - np.outer(along, along)) / length
    by_place = np.outer(along, load.stiffness * along + load.damping * across @ moving) + tension * across
    by_speed = load.damping * np.outer(along, along)
    return EndSlopes(load.between, *opposite(-tension * along, -by_place, -by_speed))


KIND = ElementKind(
    AxialSpring, pack, apply, dense, tangent, channels=("length", "tension"), observe=observe, implicit=implicit
)
