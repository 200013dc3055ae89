"""What a deployment changes with the length that is out: masses, the springs next to the exit, the force at the exit.

The innermost rod, of length r outside, has the mass ``m r`` of what is out, and moves as this material does: the
particles of a rod are those of a rigid body, so that its equations hold with the constants of the moment. Stowed mass
sits at the exit and rides with the base. A particle that passes the exit at speed v changes its velocity by ``v e``,
e along the innermost rod; the base feels ``-m v^2 e`` for it, going out or coming in, and the reel spends
``m v^3 / 2``; likewise with the spin of the rod about itself. Springs of the strain energy V give the reel the force
``-dV/dL``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_kernel
from modalprep.multibody.kernels.interfaces import add_wrench, free_position
from modalprep.multibody.kernels.loads.laws import DAMPING, REST, STIFFNESS
from modalprep.multibody.kernels.spatial import dot3, get3, get6, get9, put3, put6, times

SLIDER, PLACE, SPEED, BASE, EXIT, AT = range(6)  # columns of Reels.at
LINEAR_MASS, ROTARY, ROD, TOTAL, INNER, REEL = range(6)  # of Reels.reel
EI, MATERIAL, BEND0, BEND1, BEND2, FADING_REST, SPRING = range(7)  # of Reels.spring


class Reels(NamedTuple):
    """Packed deployments in one stage, each with as many rods as are out."""

    at: np.ndarray  # (reels, 5) int: slider's link, coordinate and speed in y (-1 prescribed), base (-1), its interface
    reel: np.ndarray  # (reels, 5): mass and axial moment of inertia per length, length of a rod, of all of it, of all
    # rods but the innermost
    base: np.ndarray  # (bases,) int, links
    spring_at: np.ndarray  # (springs, 2) int: reel, row of the hinges' constants
    spring: np.ndarray  # (springs, 6): EI, damping over stiffness, length that bends as a polynomial of r (3), rest
    # angle that fades until the innermost rod is out


@compile_kernel
def pay_out(reels, model, data, loads, y, motion):
    """Set the masses and springs of a state; before `outward`."""
    if reels is None:
        return
    for b in range(len(reels.base)):
        link = reels.base[b]
        base, own = data.links[link], model.links[link]
        base.mass = own.mass
        put3(base.first_moment, get3(own.first_moment))
        put6(base.inertia, get6(own.inertia))
    for k in range(len(reels.at)):
        length, _ = travel(reels, k, y, motion)
        _innermost(data, reels.at[k, SLIDER], reels.reel[k], length)
        if reels.at[k, BASE] >= 0:
            _stowed(model, data, reels.at[k, BASE], reels.at[k, EXIT], reels.reel[k], length)
    for h in range(len(reels.spring_at)):
        k, row = reels.spring_at[h, 0], reels.spring_at[h, 1]
        length, _ = travel(reels, k, y, motion)
        stiffness, rest, _, _ = _spring(reels.spring[h], reels.reel[k], length)
        loads.hinge[row, STIFFNESS], loads.hinge[row, REST] = stiffness, rest
        loads.hinge[row, DAMPING] = reels.spring[h, MATERIAL] * stiffness


@compile_kernel
def travel(reels, k, y, motion):
    """Return length and speed (m, m/s) of deployment k."""
    place, speed = reels.at[k, PLACE], reels.at[k, SPEED]
    if place >= 0:
        return y[place], y[speed]
    return motion[reels.at[k, SLIDER], 0], motion[reels.at[k, SLIDER], 1]


@compile_kernel
def _innermost(data, i, reel, length):
    """Rigid constants of the innermost rod, from ``l - r`` to ``l`` along z of its link."""
    out = max(0.0, length - reel[INNER])
    b, m = reel[ROD], reel[LINEAR_MASS]
    a = b - out
    across = m * (b * b * b - a * a * a) / 3.0
    own = data.links[i]
    own.mass = m * out
    own.first_moment[2] = 0.5 * m * out * (a + b)
    own.inertia[0], own.inertia[3], own.inertia[5] = across, across, reel[ROTARY] * out


@compile_kernel
def _stowed(model, data, base, node, reel, length):
    """Add the mass that is not out to the base, at the exit."""
    r = free_position(model, base, node)
    m = reel[LINEAR_MASS] * (reel[TOTAL] - length)
    own = data.links[base]
    own.mass += m
    for c in range(3):
        own.first_moment[c] += m * r[c]
    own.inertia[0] += m * (r[1] * r[1] + r[2] * r[2])
    own.inertia[1] -= m * r[0] * r[1]
    own.inertia[2] -= m * r[0] * r[2]
    own.inertia[3] += m * (r[0] * r[0] + r[2] * r[2])
    own.inertia[4] -= m * r[1] * r[2]
    own.inertia[5] += m * (r[0] * r[0] + r[1] * r[1])


@compile_kernel
def _spring(spring, reel, length):
    """Stiffness and rest angle of a hinge near the exit, and their derivatives by the length."""
    out = length - reel[INNER]
    bend = spring[BEND0] + (spring[BEND1] + spring[BEND2] * out) * out
    slope = spring[BEND1] + 2.0 * spring[BEND2] * out
    k = spring[EI] / bend
    fading = spring[FADING_REST] / reel[ROD]
    return k, fading * (reel[ROD] - out), -k * slope / bend, -fading


@compile_kernel
def take_up(reels, model, data, y, motion, tau, hinge_at):
    """Add what passes the exit to wrenches and hinge forces, after the loads; returns the reels' power beside it (W).

    A reel that moves by itself gets the force of its springs in `tau`; one that is driven spends their power.
    """
    if reels is None:
        return 0.0
    total, nx = 0.0, model.nx
    for k in range(len(reels.at)):
        link, base = reels.at[k, SLIDER], reels.at[k, BASE]
        _, v = travel(reels, k, y, motion)
        turn, spin = get9(data.links[link].orientation), data.links[link].omega[2]
        thrust, twist = reels.reel[k, LINEAR_MASS] * v * v, reels.reel[k, ROTARY] * v * spin
        total += 0.5 * (thrust * v + twist * spin)
        if base >= 0:
            along = (turn[2], turn[5], turn[8])
            force = (-thrust * along[0], -thrust * along[1], -thrust * along[2])
            torque = (-twist * along[0], -twist * along[1], -twist * along[2])
            add_wrench(model, data, base, reels.at[k, EXIT], force, torque)
            total += dot3(torque, times(get9(data.links[base].orientation), get3(data.links[base].omega)))
    for h in range(len(reels.spring_at)):
        k, x = reels.spring_at[h, 0], hinge_at[reels.spring_at[h, 1], 0]
        length, v = travel(reels, k, y, motion)
        stiffness, rest, by_length, rest_by_length = _spring(reels.spring[h], reels.reel[k], length)
        bent = y[x] - rest
        force = bent * (stiffness * rest_by_length - 0.5 * by_length * bent)  # -dV/dL
        if reels.at[k, SPEED] >= 0:
            tau[reels.at[k, SPEED] - nx] += force
        else:
            total -= force * v
    return total
