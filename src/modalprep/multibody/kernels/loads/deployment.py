"""Deployment of rods from a reel: masses, springs next to the exit and forces at the exit by the length deployed.

The innermost rod, of length r outside, has the mass ``m r`` and moves as its material does: its particles are those of
a rigid body, so that its equations hold with the present constants. Stowed mass is fixed to the base at the exit. A
particle that passes the exit at speed v changes its velocity by ``v e``, e along the innermost rod; its reaction on the
base is ``-m v^2 e``, extending or retracting, and the power of the reel is ``m v^3 / 2``; likewise with the spin of the
rod about itself. Springs of the strain energy V act on the reel by the force ``-dV/dL``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import (
    dot3,
    get3,
    get6,
    get9,
    put3,
    put6,
)
from modalprep.multibody.kernels.interfaces import add_wrench, free_position

REEL = np.dtype(
    [
        ("slider", np.int64),  # its link
        ("coordinate", np.int64),  # in y; -1: prescribed
        ("speed", np.int64),  # in y
        ("carrier", np.int64),  # link; -1: the ground
        ("exit", np.int64),  # interface of the base
        ("mass_per_length", np.float64),
        ("rotary_inertia", np.float64),  # axial moment of inertia per length
        ("rod_length", np.float64),
        ("length", np.float64),  # of all rods
        ("inner", np.float64),  # of all rods but the innermost
    ]
)
SPRING = np.dtype(
    [
        ("reel", np.int64),
        ("coordinate", np.int64),  # in y
        ("speed", np.int64),  # counted from the first speed
        ("EI", np.float64),
        ("damping", np.float64),  # over stiffness, s
        ("bend", np.float64, 3),  # length that bends, a polynomial of the deployed length of the innermost rod
        ("fading_rest", np.float64),  # angle without torque, which vanishes as the innermost rod is deployed
    ]
)


@by_address
class Reels(NamedTuple):
    """Packed deployments in one stage, each with the rods that are deployed."""

    reels: np.ndarray  # (reels,) REEL
    springs: np.ndarray  # (springs,) SPRING, the hinges next to the exits
    carriers: np.ndarray  # (bases,) int, links


@compile_kernel
def set_deployed_masses(reels, model, data, y, motion):
    """Write masses and moments of inertia of rods and bases in a state to the data; before `outward`."""
    for b in range(len(reels.carriers)):
        link = reels.carriers[b]
        base, own = data.links[link], model.links[link]
        base.mass = own.mass
        put3(base.first_moment, get3(own.first_moment))
        put6(base.inertia, get6(own.inertia))
    for k in range(len(reels.reels)):
        reel = reels.reels[k]
        length, _ = travel(reel, y, motion)
        _innermost(data.links[reel.slider], reel, length)
        if reel.carrier >= 0:
            _stowed(data.links[reel.carrier], free_position(model, reel.carrier, reel.exit), reel, length)


@compile_kernel
def travel(reel, y, motion):
    """Return the deployed length and its rate (m, m/s)."""
    if reel.coordinate >= 0:
        return y[reel.coordinate], y[reel.speed]
    return motion[reel.slider, 0], motion[reel.slider, 1]


@compile_kernel
def _innermost(own, reel, length):
    """Write the rigid constants of the innermost rod to its link's data: from ``l - r`` to ``l`` along z."""
    out = max(0.0, length - reel.inner)
    b, m = reel.rod_length, reel.mass_per_length
    a = b - out
    across = m * (b * b * b - a * a * a) / 3.0
    own.mass = m * out
    own.first_moment[2] = 0.5 * m * out * (a + b)
    own.inertia[0] = across
    own.inertia[3] = across
    own.inertia[5] = reel.rotary_inertia * out


@compile_kernel
def _stowed(own, r, reel, length):
    """Add the stowed mass to the data of the base, at the exit r."""
    m = reel.mass_per_length * (reel.length - length)
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
def _stiffness(spring, reel, length):
    """Stiffness and rest angle of a hinge near the exit, and their derivatives by the length."""
    out = length - reel.inner
    bend = spring.bend
    bent = bend[0] + (bend[1] + bend[2] * out) * out
    slope = bend[1] + 2.0 * bend[2] * out
    k = spring.EI / bent
    fading = spring.fading_rest / reel.rod_length
    return k, fading * (reel.rod_length - out), -k * slope / bent, -fading


@compile_kernel
def add_deployment_forces(reels, model, data, y, motion, tau, slope):
    """Add the forces of the springs next to the exits and of the mass that passes them to wrenches and ``tau (nu,)``.

    After the loads. Returns the power of all but the springs (W) and the energy of the springs (J). A reel with a
    coordinate of its own gets the force of its springs in `tau`; the power of one that is driven counts as power.
    """
    power, stored = 0.0, 0.0
    for k in range(len(reels.reels)):
        power += _passing(reels.reels[k], model, data, y, motion)
    for h in range(len(reels.springs)):
        spring = reels.springs[h]
        p, e = _bent(spring, reels.reels[spring.reel], model.nx, y, motion, tau, slope)
        power, stored = power + p, stored + e
    return power, stored


@compile_kernel
def _passing(reel, model, data, y, motion):
    """Add the reaction of mass that passes the exit to the base; returns its power and that of the reel (W)."""
    _, v = travel(reel, y, motion)
    turn = get9(data.links[reel.slider].orientation)
    spin = data.links[reel.slider].omega[2]
    thrust, twist = reel.mass_per_length * v * v, reel.rotary_inertia * v * spin
    power = 0.5 * (thrust * v + twist * spin)
    if reel.carrier >= 0:
        along = (turn[2], turn[5], turn[8])
        force = (-thrust * along[0], -thrust * along[1], -thrust * along[2])
        torque = (-twist * along[0], -twist * along[1], -twist * along[2])
        add_wrench(model, data, reel.carrier, reel.exit, force, torque)
        base = data.links[reel.carrier]
        power += dot3(torque, times(get9(base.orientation), get3(base.omega)))
    return power


@compile_kernel
def _bent(spring, reel, nx, y, motion, tau, slope):
    """Torque of a hinge next to the exit, and the force ``-dV/dL`` on its reel; returns power (W) and energy (J)."""
    length, v = travel(reel, y, motion)
    k, rest, by_length, rest_by_length = _stiffness(spring, reel, length)
    bent = y[spring.coordinate] - rest
    rate = y[nx + spring.speed]
    damping = spring.damping * k
    tau[spring.speed] -= k * bent + damping * rate
    slope[0, spring.speed] -= k
    slope[1, spring.speed] -= damping
    power = -damping * rate * rate
    force = bent * (k * rest_by_length - 0.5 * by_length * bent)
    if reel.speed >= 0:
        tau[reel.speed - nx] += force
    else:
        power -= force * v
    return power, 0.5 * k * bent * bent
