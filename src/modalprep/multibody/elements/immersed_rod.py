"""Slender rods in water: drag, buoyancy and added mass (`ImmersedRod`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene
from modalprep.multibody.elements.packer import ElementKind, Packer
from modalprep.multibody.elements.slopes import BodySlopes
from modalprep.multibody.kernels.algebra.matrices import (
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
    row3,
)
from modalprep.multibody.kernels.interfaces import add_at_origin
from modalprep.multibody.model.hydrodynamics import ImmersedRod, end_positions
from modalprep.multibody.packing.tree import rows
from modalprep.vectors import skew

ROW = np.dtype(
    [
        ("link", np.int64),
        ("current", np.int64),  # its first row of the current
        ("currents", np.int64),
        ("start", np.float64, 3),  # axes of the link, as the following
        ("axis", np.float64, 3),
        ("length", np.float64),
        ("normal", np.float64),  # drag across and along, N s^2/m^2 per m
        ("tangential", np.float64),
        ("added", np.float64),  # added and displaced mass, kg/m
        ("displaced", np.float64),
        ("surface", np.float64),  # height, m
        ("up", np.float64, 3),  # inertial
        ("M", np.float64, 6),  # added mass as a spatial inertia [[M, H], [H', J]] at the link's origin
        ("H", np.float64, 9),
        ("J", np.float64, 6),
    ]
)
GAUSS = tuple(((1 + float(x)) / 2, float(w) / 2) for x, w in zip(*np.polynomial.legendre.leggauss(5), strict=True))


@by_address
class Rods(NamedTuple):
    """Packed rods."""

    rows: np.ndarray  # (rods,) ROW
    current: np.ndarray  # (rows, 4): depth, velocity of the water


def pack(packer: Packer, loads: Sequence[ImmersedRod]) -> Rods:
    """Return the rows; each rod has its own rows of the current."""
    profiles = [np.column_stack([rod.water.depths, rod.water.current]) for rod in loads]
    first = np.cumsum([0, *(len(profile) for profile in profiles)])
    found = [
        (packer.packed.link_of(rod.body), first[k], len(profiles[k]), *_constants(packer, rod))
        for k, rod in enumerate(loads)
    ]
    return Rods(rows(ROW, found), np.vstack([np.zeros((0, 4)), *profiles]))


def _constants(packer: Packer, rod: ImmersedRod) -> tuple:
    """Return the other numbers of a row."""
    align = packer.packed.align(packer.packed.link_of(rod.body))
    first, last = (align.T @ end for end in end_positions(packer.system.bodies[rod.body], rod))
    length = float(np.linalg.norm(last - first))
    axis = (last - first) / length
    water = rod.water
    numbers = (length, rod.normal, rod.tangential, rod.added, rod.displaced, water.surface, water.up)
    return (first, axis, *numbers, *added_inertia(first, axis, length, rod.added))


def added_inertia(
    first: np.ndarray, axis: np.ndarray, length: float, added: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the added mass of a rod as a spatial inertia [[M, H], [H', J]]: M (6,), H (9,), J (6,).

    ``int m [1, -r~]' P [1, -r~] ds`` with P across the rod; exact, the integrand is of second degree.
    """
    P = np.eye(3) - np.outer(axis, axis)
    total = np.zeros((6, 6))
    for x, weight in zip(*np.polynomial.legendre.leggauss(2), strict=True):
        r = first + (1 + x) / 2 * length * axis
        lever = np.hstack([np.eye(3), -skew(r)])
        total += added * length * weight / 2 * lever.T @ P @ lever
    upper = np.triu_indices(3)
    return total[:3, :3][upper], total[:3, 3:].ravel(), total[3:, 3:][upper]


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add wrenches, and the added mass to the inertia of the links; returns power, energy of the water, potential."""
    packed = elements.immersed_rod
    power, stored, potential = 0.0, 0.0, 0.0
    for i in range(len(packed.rows)):
        rod = packed.rows[i]
        own = data.links[rod.link]
        f, m, p, e, u = law(rod, packed.current, own, get3(model.gravity))
        add_at_origin(own, f, m)
        for k in range(6):
            own.M[k] += rod.M[k]
            own.J[k] += rod.J[k]
        for k in range(9):
            own.H[k] += rod.H[k]
        power, stored, potential = power + p, stored + e, potential + u
    return power, stored, potential


@compile_kernel
def law(c, profile, link, g):
    """Rod of constants c in water, axes of the link: drag, buoyancy, the reaction of the water that it moves across.

    The link's data have its rotation, origin p and velocity v (inertial) and angular velocity w; g is gravity
    (inertial). The reaction of a strip is ``-m P a``, P across the rod, a its acceleration; what the accelerations of
    the link give of it, gravity taken off, is left to `added_inertia`.

    Returns
    -------
    force, torque : on the link, at its origin
    power of the drag, and of the water where the rod's turn changes what is across
    kinetic energy of the water, ``m v P v / 2``
    potential of the buoyancy
    """
    base = get9(link.orientation)
    p = get3(link.position)
    v = get3(link.velocity)
    w = get3(link.omega)
    start, axis, up = get3(c.start), get3(c.axis), get3(c.up)
    own = transposed_times(base, v)
    turn = cross(w, axis)
    weight = transposed_times(base, g)
    force, torque, power, stored, potential = ZERO3, ZERO3, 0.0, 0.0, 0.0
    for k in range(len(GAUSS)):
        x, part = GAUSS[k]
        ds = part * c.length
        r = axpy3(start, x * c.length, axis)
        wr = cross(w, r)
        moves = add3(own, wr)
        place = add3(p, times(base, r))
        current = _current(profile, c.current, c.currents, c.surface - dot3(up, place))
        slip = axpy3(moves, -1.0, transposed_times(base, current))
        ahead = dot3(axis, slip)
        across = axpy3(slip, -ahead, axis)
        a = -c.normal * np.sqrt(dot3(across, across))
        b = -c.tangential * abs(ahead) * ahead
        drag = axpy3((a * across[0], a * across[1], a * across[2]), b, axis)
        swing = add3(cross(w, wr), weight)
        swing = axpy3(swing, -dot3(axis, swing), axis)
        f = axpy3(axpy3(drag, -c.added, swing), -c.displaced, weight)
        force = axpy3(force, ds, f)
        torque = axpy3(torque, ds, cross(r, f))
        along = dot3(axis, moves)
        power += ds * (dot3(drag, moves) - c.added * dot3(turn, moves) * along)
        stored += 0.5 * ds * c.added * (dot3(moves, moves) - along * along)
        potential += ds * c.displaced * dot3(g, place)
    return force, torque, power, stored, potential


@compile_kernel
def _current(profile, first, count, depth):
    """Velocity of the water at a depth, inertial axes."""
    last = first + count - 1
    if depth <= profile[first, 0]:
        return row3(profile, first, 1)
    if depth >= profile[last, 0]:
        return row3(profile, last, 1)
    k = first
    while depth > profile[k + 1, 0]:
        k += 1
    part = (depth - profile[k, 0]) / (profile[k + 1, 0] - profile[k, 0])
    below = row3(profile, k, 1)
    return axpy3(below, part, axpy3(row3(profile, k + 1, 1), -1.0, below))


def dense(load: ImmersedRod, scene: Scene) -> DenseLoads:
    """Sum strips, each with its own partial velocities: the reference implementation."""
    s = scene.states[load.body]
    gravity = scene.system.gravity
    first, last = end_positions(s.body, load)
    length = np.linalg.norm(last - first)
    axis = (last - first) / length
    w = s.V[3:]
    g = s.R.T @ gravity
    P = np.eye(3) - np.outer(axis, axis)
    turn = np.cross(w, axis)
    nu = s.J.shape[1]
    water = load.water
    f = np.zeros(nu)
    mass = np.zeros((nu, nu))
    power = 0.0
    stored = 0.0
    potential = 0.0
    for x, weight in zip(*np.polynomial.legendre.leggauss(len(GAUSS)), strict=True):
        r = first + (1 + x) / 2 * (last - first)
        ds = weight * length / 2
        J = s.J[:3] - skew(r) @ s.J[3:]
        v = s.V[:3] + np.cross(w, r)
        place = s.p + s.R @ r
        slip = v - s.R.T @ water.current_at(water.surface - float(water.up @ place))
        along = (axis @ slip) * axis
        across = P @ slip
        drag = -load.normal * np.linalg.norm(across) * across - load.tangential * np.linalg.norm(along) * along
        fall = s.c[:3] + np.cross(s.c[3:], r) + np.cross(w, np.cross(w, r)) + g  # acceleration without u'
        f += ds * J.T @ (drag - load.added * P @ fall - load.displaced * g)
        mass += ds * load.added * J.T @ P @ J
        power += ds * (drag @ v - load.added * (turn @ v) * (axis @ v))
        stored += ds * load.added * v @ P @ v / 2
        potential += ds * load.displaced * gravity @ place
    return DenseLoads(f, float(power), float(stored), float(potential), mass)


def tangent(load: ImmersedRod, scene: Scene) -> BodySlopes:
    """Return the sum of strips with its derivatives."""
    body = scene.states[load.body].body
    strips = [_strip(load, scene, x, weight) for x, weight in GAUSS]
    force, *slopes = (sum(each) for each in zip(*strips, strict=True))
    none = np.zeros((body.n, 6))
    return BodySlopes(load.body, np.append(force, none[:, 0]), *(np.vstack([slope, none]) for slope in slopes))


def _strip(load: ImmersedRod, scene: Scene, x: float, weight: float) -> tuple[np.ndarray, ...]:
    """Return the force (6,) of a strip on its body, and its derivatives (6, 6) by pose, velocity and acceleration."""
    s, water = scene.states[load.body], load.water
    g, up, spin = s.R.T @ scene.system.gravity, s.R.T @ water.up, skew(s.V[3:])
    first, last = end_positions(s.body, load)
    axis = (last - first) / np.linalg.norm(last - first)
    across = np.eye(3) - np.outer(axis, axis)
    r = first + x * (last - first)
    lever = np.hstack([np.eye(3), -skew(r)])
    current, shear = (s.R.T @ c for c in water.sheared(water.surface - float(water.up @ (s.p + s.R @ r))))
    drag, by_slip = _drag(load, axis, lever @ s.V - current)
    fall = lever @ s.c + spin @ spin @ r + g
    by_place = np.outer(by_slip @ shear, up @ lever)
    by_place[:, 3:] -= by_slip @ skew(current) + (load.added * across + load.displaced * np.eye(3)) @ skew(g)
    by_speed = by_slip @ lever
    by_speed[:, 3:] += load.added * across @ (skew(spin @ r) + spin @ skew(r))
    work = weight * np.linalg.norm(last - first) * lever.T
    f = drag - load.added * across @ fall - load.displaced * g
    return work @ f, work @ by_place, work @ by_speed, -load.added * work @ across @ lever


def _drag(load: ImmersedRod, axis: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the drag of a unit length and its derivative by the velocity of the rod in the water."""
    ahead = axis @ slip
    across = np.eye(3) - np.outer(axis, axis)
    beside = across @ slip
    speed = float(np.linalg.norm(beside))
    drag = -load.normal * speed * beside - load.tangential * abs(ahead) * ahead * axis
    slope = speed * across + (np.outer(beside, beside) / speed if speed > 0 else 0.0)
    return drag, -load.normal * slope - 2 * load.tangential * abs(ahead) * np.outer(axis, axis)


KIND = ElementKind(ImmersedRod, pack, apply, dense, tangent, adds_mass=True)
