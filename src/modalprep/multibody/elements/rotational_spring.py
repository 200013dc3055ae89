"""A rotational spring and damper about an axis of the first of two interfaces (`RotationalSpring`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene
from modalprep.multibody.elements.packer import (
    TWO_ENDS,
    ElementKind,
    ImplicitRow,
    Packer,
    ground_or_interface,
    motion,
)
from modalprep.multibody.elements.slopes import EndSlopes, stacked
from modalprep.multibody.kernels.algebra.matrices import (
    product,
    times,
)
from modalprep.multibody.kernels.algebra.rotations import rotation_quaternion
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
)
from modalprep.multibody.kernels.closed_loops.constraints import ABOUT
from modalprep.multibody.kernels.interfaces import add_wrench
from modalprep.multibody.kernels.time_tables import quintic
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.multibody.packing.tree import rows
from modalprep.vectors import skew

ROW = np.dtype(
    [
        *TWO_ENDS,
        ("axis", np.float64, 3),  # of the first frame
        ("free_angle", np.float64),
        ("rotation", np.float64, 9),  # of a frame on the ground
        ("position", np.float64, 3),  # of a frame on the ground, of no effect
        ("spring", np.int64, 2),  # its first knot, and the first one after
        ("damper", np.int64, 2),
        ("jumps", np.bool_),  # its torque, at half a turn
    ]
)
TILTED = 1e-12  # squared cosine of half the tilt between the axes: with opposite axes there is no angle


@by_address
class Rotational(NamedTuple):
    """Packed springs."""

    rows: np.ndarray  # (springs,) ROW
    knots: np.ndarray  # (knots, 4): angle or rate, energy, torque, slope


def pack(packer: Packer, loads: Sequence[RotationalSpring]) -> Rotational:
    """Return the rows and the knots of their laws."""
    found = []
    knots = [np.zeros((0, 4))]
    first = 0
    for load in loads:
        laws = []
        for constant in ("stiffness", "damping"):
            knots.append(load.knots(constant))
            laws.append((first, first + len(knots[-1])))
            first += len(knots[-1])
        constants = (load.axis, load.free_angle, load.rotation.ravel(), np.zeros(3))
        found.append((*packer.ends(load.between), *constants, *laws, _jumps(load)))
    return Rotational(rows(ROW, found), np.vstack(knots))


def _jumps(load: RotationalSpring) -> bool:
    """Whether the torque of a spring is another one at half a turn forwards than backwards."""
    knots = load.knots("stiffness")
    back, forth = (curve(knots, 0, len(knots), half - load.free_angle)[1] for half in (-np.pi, np.pi))
    return back != forth


def implicit(packed: Rotational) -> list[ImplicitRow]:
    """Return a row about each axis, with the slopes at rest; the iterations see the rest of the laws."""
    found = []
    for c in packed.rows:
        stiffness, damping = (max(0.0, curve(packed.knots, law[0], law[1], 0.0)[2]) for law in (c.spring, c.damper))
        found.append(ImplicitRow(ABOUT, c.axis, stiffness, damping, ground_or_interface(c, c.rotation)))
    return found


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add the torques; returns the power of the dampers, the energy stored, 0."""
    packed = elements.rotational_spring
    power, stored = 0.0, 0.0
    for i in range(len(packed.rows)):
        own = packed.rows[i]
        _, torque, G, p, e = _evaluate(packed, own, model, data)
        forth = (torque * G[0], torque * G[1], torque * G[2])
        add_wrench(model, data, own.link_a, own.interface_a, ZERO3, forth)
        add_wrench(model, data, own.link_b, own.interface_b, ZERO3, (-forth[0], -forth[1], -forth[2]))
        power, stored = power + p, stored + e
    return power, stored, 0.0


@compile_kernel
def observe(elements, environment, model, data, t, i):
    """Return the angle of spring i, and the torque that it has against it."""
    packed = elements.rotational_spring
    angle, torque, _, _, _ = _evaluate(packed, packed.rows[i], model, data)
    return angle, torque


@compile_kernel
def angle(own, model, data):
    """Angle of a spring about its axis (rad) and its rate, after `world`."""
    turn = get9(own.rotation)
    _, Ra, _, wa = motion(model, data, own.link_a, own.interface_a, ZERO3, turn)
    _, Rb, _, wb = motion(model, data, own.link_b, own.interface_b, ZERO3, turn)
    found, G = twist(Ra, Rb, get3(own.axis))
    return found, dot3(G, axpy3(wb, -1.0, wa))


@compile_kernel
def _evaluate(packed, own, model, data):
    """Angle, torque against it, its direction (inertial), power of the damper, and energy, at the present motion."""
    turn = get9(own.rotation)
    _, Ra, _, wa = motion(model, data, own.link_a, own.interface_a, ZERO3, turn)
    _, Rb, _, wb = motion(model, data, own.link_b, own.interface_b, ZERO3, turn)
    angle, G = twist(Ra, Rb, get3(own.axis))
    rate = dot3(G, axpy3(wb, -1.0, wa))
    stored, spring, _ = curve(packed.knots, own.spring[0], own.spring[1], angle - own.free_angle)
    _, damper, _ = curve(packed.knots, own.damper[0], own.damper[1], rate)
    return angle, spring + damper, G, -damper * rate, stored


@compile_kernel
def twist(Ra, Rb, n):
    """Angle about n of the rotation from a to b, and its derivative by small rotations of b against a, inertial.

    With the quaternion (w, v) of ``Ra' Rb`` the angle is ``2 atan(v.n / w)``, and its derivative in the axes of a
    ``(w^2 n + w v x n + (v.n) v) / (w^2 + (v.n)^2)``. Both are zero where the axis of b opposes that of a.
    """
    w, x, y, z = rotation_quaternion(product((Ra[0], Ra[3], Ra[6], Ra[1], Ra[4], Ra[7], Ra[2], Ra[5], Ra[8]), Rb))
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    v = (x, y, z)
    s = dot3(v, n)
    size = w * w + s * s
    if size < TILTED:
        return 0.0, ZERO3
    vn = cross(v, n)
    G = axpy3((w * w * n[0] + w * vn[0], w * w * n[1] + w * vn[1], w * w * n[2] + w * vn[2]), s, v)
    return 2.0 * np.arctan2(s, w), times(Ra, (G[0] / size, G[1] / size, G[2] / size))


@compile_kernel
def curve(knots, first, end, x):
    """Return integral, value and slope of a law at x; beyond its knots it goes straight on."""
    last = end - 1
    if x <= knots[first, 0] or x >= knots[last, 0]:
        k = first if x <= knots[first, 0] else last
        d = x - knots[k, 0]
        value = knots[k, 2] + knots[k, 3] * d
        return knots[k, 1] + 0.5 * (knots[k, 2] + value) * d, value, knots[k, 3]
    low = first
    while last - low > 1:
        middle = (low + last) // 2
        if knots[middle, 0] <= x:
            low = middle
        else:
            last = middle
    return quintic(knots[low], knots[low + 1], x)


def dense(load: RotationalSpring, scene: Scene) -> DenseLoads:
    """Return what it does, the angle by rotation matrices: the reference implementation."""
    a, b = (scene.end(end, np.zeros(3), load.rotation) for end in load.between)
    n = load.axis
    first = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    e = np.array([first, np.cross(n, first)]) / np.linalg.norm(first)
    R = a.frame.rotation.T @ b.frame.rotation
    one, two = R @ e[0], R @ e[1]
    sine = e[1] @ one - e[0] @ two
    cosine = e[0] @ one + e[1] @ two
    by_sine = np.cross(one, e[1]) - np.cross(two, e[0])
    by_cosine = np.cross(one, e[0]) + np.cross(two, e[1])
    G = a.frame.rotation @ (cosine * by_sine - sine * by_cosine) / (sine**2 + cosine**2)
    rate = G @ (b.frame.angular_velocity - a.frame.angular_velocity)
    energy, spring = _law(load.knots("stiffness"), np.arctan2(sine, cosine) - load.free_angle)
    _, damper = _law(load.knots("damping"), rate)
    return DenseLoads(-(spring + damper) * G @ (b.J - a.J)[3:], -damper * rate, energy, 0.0)


def _law(knots: np.ndarray, x: float) -> tuple[float, float]:
    """Return integral and value at x, by cubic polynomials between the knots."""
    at, energy, torque, slope = knots.T
    inside = float(np.clip(x, at[0], at[-1]))
    h = np.diff(at)
    rise = np.diff(torque) / np.diff(at)
    cubic = scipy.interpolate.PPoly(
        [
            (slope[:-1] + slope[1:] - 2 * rise) / h**2,
            (3 * rise - 2 * slope[:-1] - slope[1:]) / h,
            slope[:-1],
            torque[:-1],
        ],
        at,
    )
    value = float(cubic(inside))
    beyond = x - inside
    end = slope[0] if x < at[0] else slope[-1]
    integral = energy[0] + float(cubic.antiderivative()(inside)) + (value + end * beyond / 2) * beyond
    return integral, value + end * beyond


def tangent(load: RotationalSpring, scene: Scene) -> EndSlopes:
    """Return the torques with their derivatives, made in axes of the first frame; none where there is no angle."""
    a, b = (scene.end(end, np.zeros(3), load.rotation).frame for end in load.between)
    to_a = a.rotation.T
    spin = to_a @ (b.angular_velocity - a.angular_velocity)
    angle, G, by_turn = _twist_slopes(to_a @ b.rotation, load.axis)
    spring, stiffness = _value_and_slope(load.knots("stiffness"), angle - load.free_angle)
    damper, damping = _value_and_slope(load.knots("damping"), float(G @ spin))
    torque = spring + damper
    by_other = np.outer(G, stiffness * G + damping * spin @ by_turn) + torque * by_turn  # rotation of b against a
    by_both = np.outer(G, damping * G @ skew(spin)) - torque * skew(G)
    by_spin = damping * np.outer(G, G)
    wrench, by_pose, by_rate = stacked(2)
    for first, sign in ((3, 1.0), (9, -1.0)):
        own = slice(first, first + 3)
        out = sign * a.rotation
        wrench[own] = torque * (out @ G)
        by_pose[own, 9:12] = out @ by_other @ to_a
        by_pose[own, 3:6] = out @ (by_both - by_other) @ to_a
        by_rate[own, 9:12] = out @ by_spin @ to_a
        by_rate[own, 3:6] = -by_rate[own, 9:12]
    return EndSlopes(load.between, wrench, by_pose, by_rate)


def _twist_slopes(R: np.ndarray, n: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return `twist` of a rotation R (3, 3), in its first axes, and the derivative of its direction by rotations."""
    quaternion = scipy.spatial.transform.Rotation.from_matrix(R).as_quat(canonical=True, scalar_first=True)
    w, v = float(quaternion[0]), quaternion[1:]
    s = v @ n
    size = w * w + s * s
    if size < TILTED:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    dw, dv = -v / 2, (w * np.eye(3) - skew(v)) / 2
    vn, ds = np.cross(v, n), n @ dv
    G = (w * w * n + w * vn + s * v) / size
    by_turn = np.outer(2 * w * n + vn, dw) - w * skew(n) @ dv + np.outer(v, ds) + s * dv
    return 2 * float(np.arctan2(s, w)), G, (by_turn - 2 * np.outer(G, w * dw + s * ds)) / size


def _value_and_slope(knots: np.ndarray, x: float) -> tuple[float, float]:
    _, value, slope = curve(knots, 0, len(knots), x)
    return value, slope


KIND = ElementKind(
    RotationalSpring, pack, apply, dense, tangent, channels=("angle", "torque"), observe=observe, implicit=implicit
)
