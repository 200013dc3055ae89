"""Six springs and dampers between two frames (`Bushing`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene
from modalprep.multibody.elements.packer import TWO_ENDS, ElementKind, ImplicitRow, Packer, ground_or_interface, motion
from modalprep.multibody.elements.slopes import EndSlopes
from modalprep.multibody.kernels.algebra.matrices import (
    product,
    product_transposed,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
)
from modalprep.multibody.kernels.closed_loops.constraints import (
    ABOUT,
    POINT,
)
from modalprep.multibody.kernels.interfaces import add_wrench
from modalprep.multibody.model.loads import Bushing
from modalprep.multibody.packing.tree import rows
from modalprep.vectors import cross as cross_product
from modalprep.vectors import skew

ROW = np.dtype(
    [
        *TWO_ENDS,
        ("stiffness", np.float64, 6),
        ("damping", np.float64, 6),
        ("free_position", np.float64, 3),  # of the second frame in the first
        ("free_rotation", np.float64, 9),
        ("position", np.float64, 3),  # of a frame on the ground
        ("rotation", np.float64, 9),
    ]
)
SMALL = 1e-2  # rad: below, the series of the rotation vector is exact to round-off
NO_AXIS = 1e-8
BENT = 0.1  # rad: below, the series of the derivative of the rotation vector is


def pack(packer: Packer, loads: Sequence[Bushing]) -> np.recarray:
    """Return the rows."""
    return rows(ROW, [_row(packer, load) for load in loads])


def _row(packer: Packer, load: Bushing) -> tuple:
    free = (load.free_position, load.free_rotation.ravel())
    ends = packer.ends(load.between)
    return (*ends, load.stiffness, load.damping, *free, load.position, load.rotation.ravel())


def implicit(packed: np.recarray) -> list[ImplicitRow]:
    """Return a row for each axis of the first frame."""
    return [
        ImplicitRow(
            POINT if k < 3 else ABOUT,
            np.eye(3)[k % 3],
            c.stiffness[k],
            c.damping[k],
            ground_or_interface(c, c.rotation),
        )
        for c in packed
        for k in range(6)
    ]


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add the forces and torques; returns the power of the dampers, the energy stored, 0."""
    rows = elements.bushing
    power, stored = 0.0, 0.0
    for i in range(len(rows)):
        own = rows[i]
        place = get3(own.position)
        turn = get9(own.rotation)
        first = motion(model, data, own.link_a, own.interface_a, place, turn)
        second = motion(model, data, own.link_b, own.interface_b, place, turn)
        f, m, back, p, e = law(own, first, second)
        add_wrench(model, data, own.link_a, own.interface_a, (-f[0], -f[1], -f[2]), back)
        add_wrench(model, data, own.link_b, own.interface_b, f, m)
        power, stored = power + p, stored + e
    return power, stored, 0.0


@compile_kernel
def law(c, first, second):
    """Six springs and dampers in the axes of the first of two frames (position, rotation, velocity, spin; inertial).

    Displacement ``d = R1' (p2 - p1) - free position``, rotation vector x of ``R1' R2 free rotation'``; potential
    ``d K d / 2 + x K x / 2``, dampers on ``d'`` and the relative angular velocity; all in the first frame's axes.

    Returns
    -------
    force, torque : on the second frame, at its origin, inertial axes
    torque on the first frame; the force on it is opposite
    power of the dampers, energy stored
    """
    pa, Ra, va, wa = first
    pb, Rb, vb, wb = second
    k, damping = c.stiffness, c.damping
    r = transposed_times(Ra, (pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2]))
    v = transposed_times(Ra, (vb[0] - va[0], vb[1] - va[1], vb[2] - va[2]))
    v = axpy3(v, -1.0, cross(transposed_times(Ra, wa), r))
    w = transposed_times(Ra, (wb[0] - wa[0], wb[1] - wa[1], wb[2] - wa[2]))
    d = axpy3(r, -1.0, get3(c.free_position))
    x, g = _turned(c, Ra, Rb)
    spring = (-k[0] * d[0], -k[1] * d[1], -k[2] * d[2])
    damper = (-damping[0] * v[0], -damping[1] * v[1], -damping[2] * v[2])
    moment = (-k[3] * x[0], -k[4] * x[1], -k[5] * x[2])
    brake = (-damping[3] * w[0], -damping[4] * w[1], -damping[5] * w[2])
    stored = -0.5 * (dot3(spring, d) + dot3(moment, x))
    power = dot3(damper, v) + dot3(brake, w)
    xm = cross(x, moment)
    moment = add3(add3(moment, brake), axpy3((0.5 * xm[0], 0.5 * xm[1], 0.5 * xm[2]), g, cross(x, xm)))
    f = add3(spring, damper)
    back = add3(moment, cross(r, f))
    back = (-back[0], -back[1], -back[2])
    return times(Ra, f), times(Ra, moment), times(Ra, back), power, stored


@compile_kernel
def turn(own, model, data):
    """Rotation vector of a bushing from where it is free, and its spin, in axes of the first frame; after `world`."""
    rotation = get9(own.rotation)
    _, Ra, _, wa = motion(model, data, own.link_a, own.interface_a, ZERO3, rotation)
    _, Rb, _, wb = motion(model, data, own.link_b, own.interface_b, ZERO3, rotation)
    return _turned(own, Ra, Rb)[0], transposed_times(Ra, axpy3(wb, -1.0, wa))


@compile_inline
def _turned(c, Ra, Rb):
    """Return `rotation_vector` of a bushing's frames."""
    turn = product((Ra[0], Ra[3], Ra[6], Ra[1], Ra[4], Ra[7], Ra[2], Ra[5], Ra[8]), Rb)
    return rotation_vector(product_transposed(turn, get9(c.free_rotation)))


@compile_kernel
def rotation_vector(Q):
    """Rotation vector of a rotation below 180 degrees, and c of ``1 + x~ / 2 + c x~ x~``, which takes moments to it."""
    a = (0.5 * (Q[7] - Q[5]), 0.5 * (Q[2] - Q[6]), 0.5 * (Q[3] - Q[1]))
    s = np.sqrt(dot3(a, a))
    c = 0.5 * (Q[0] + Q[4] + Q[8] - 1.0)
    angle = np.arctan2(s, c)
    f = angle / s if s > NO_AXIS else 1.0
    if angle < SMALL:
        g = 1.0 / 12.0 + angle * angle / 720.0 + angle * angle * angle * angle / 30240.0
    else:
        g = 1.0 / (angle * angle) - (1.0 + c) / (2.0 * angle * s)
    return (f * a[0], f * a[1], f * a[2]), g


def dense(load: Bushing, scene: Scene) -> DenseLoads:
    """Return the virtual work of displacement and rotation vector, the latter by its left Jacobian: the reference."""
    a, b = (scene.end(end, load.position, load.rotation) for end in load.between)
    Ra = a.frame.rotation
    r = Ra.T @ (b.frame.position - a.frame.position)
    d = r - load.free_position
    x = scipy.spatial.transform.Rotation.from_matrix(Ra.T @ b.frame.rotation @ load.free_rotation.T).as_rotvec()
    left = scipy.linalg.expm(np.block([[skew(x), np.eye(3)], [np.zeros((3, 6))]]))[:3, 3:]
    linear = Ra.T @ (b.J[:3] - a.J[:3]) + skew(r) @ Ra.T @ a.J[3:]
    angular = Ra.T @ (b.J[3:] - a.J[3:])
    v = Ra.T @ (b.frame.velocity - a.frame.velocity) + np.cross(r, Ra.T @ a.frame.angular_velocity)
    w = Ra.T @ (b.frame.angular_velocity - a.frame.angular_velocity)
    k, c = load.stiffness, load.damping
    f = -linear.T @ (k[:3] * d + c[:3] * v) - angular.T @ (np.linalg.solve(left.T, k[3:] * x) + c[3:] * w)
    power = -float(c[:3] @ v**2 + c[3:] @ w**2)
    stored = float(k[:3] @ d**2 + k[3:] @ x**2) / 2
    return DenseLoads(f, power, stored, 0.0)


def tangent(load: Bushing, scene: Scene) -> EndSlopes:
    """Return the forces with their derivatives, made in axes of the first frame."""
    a, b = (scene.end(end, load.position, load.rotation).frame for end in load.between)
    to_a = a.rotation.T
    r, v = to_a @ (b.position - a.position), to_a @ (b.velocity - a.velocity)
    spin = to_a @ a.angular_velocity
    w = to_a @ (b.angular_velocity - a.angular_velocity)
    x = scipy.spatial.transform.Rotation.from_matrix(to_a @ b.rotation @ load.free_rotation.T).as_rotvec()
    k, c = load.stiffness, load.damping
    moment, by_turn = _moment(x, k[3:])
    F = -k[:3] * (r - load.free_position) - c[:3] * (v + cross_product(r, spin))
    M = moment - c[3:] * w
    turn, apart, turned = _relative(to_a)
    dr = apart + skew(r) @ turn  # of r by displacements and rotations, of its rate by velocities and spins
    dv = (skew(v) + skew(r) @ skew(spin)) @ turn - skew(spin) @ dr
    dF = -k[:3, None] * dr - c[:3, None] * dv
    dM = by_turn @ turned - c[3:, None] * (skew(w) @ turn)
    wrench = np.concatenate([-F, -M - cross_product(r, F), F, M])
    by_pose = np.vstack([-dF, -dM - skew(r) @ dF + skew(F) @ dr, dF, dM])
    by_pose -= np.vstack([skew(part) for part in wrench.reshape(4, 3)]) @ turn
    dF, dM = -c[:3, None] * dr, -c[3:, None] * turned
    by_rate = np.vstack([-dF, -dM - skew(r) @ dF, dF, dM])
    out = scipy.linalg.block_diag(*[a.rotation] * 4)
    return EndSlopes(load.between, out @ wrench, out @ by_pose, out @ by_rate)


def _relative(to_a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, by twists of both ends (3, 12): rotation of the first, what the second shifts and turns against it."""
    none = np.zeros((3, 3))
    return (
        np.hstack([none, to_a, none, none]),
        np.hstack([-to_a, none, to_a, none]),
        np.hstack([none, -to_a, none, to_a]),
    )


def _moment(x: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the moment of springs k against a rotation vector x, and its derivative by small rotations (3, 3).

    With ``x' = (1 - x~ / 2 + g x~ x~) w`` of an angular velocity w it is ``-(1 + x~ / 2 + g x~ x~) k x``.
    """
    angle = float(np.linalg.norm(x))
    if angle < BENT:
        g = 1 / 12 + angle**2 / 720 + angle**4 / 30240 + angle**6 / 1209600
        slope = 1 / 360 + angle**2 / 7560 + angle**4 / 201600 + angle**6 / 5987520  # g' / angle
    else:
        cot = 1 / np.tan(angle / 2)
        g = 1 / angle**2 - cot / (2 * angle)
        slope = ((1 + cot**2) / (4 * angle) + cot / (2 * angle**2) - 2 / angle**3) / angle
    X, m = skew(x), -k * x
    to_rate = np.eye(3) - X / 2 + g * X @ X
    by_x = -to_rate.T * k - skew(m) / 2 + slope * np.outer(X @ X @ m, x) - g * (skew(X @ m) + X @ skew(m))
    return to_rate.T @ m, by_x @ to_rate


KIND = ElementKind(Bushing, pack, apply, dense, tangent, implicit=implicit)
