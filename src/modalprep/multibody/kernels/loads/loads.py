"""Loads of the kernel: evaluated between `world` and `inward`, they fill hinge forces, wrenches and modal loads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.data import GROWS
from modalprep.multibody.kernels.interfaces import add_at_origin, add_wrench, node_state, seen_spin
from modalprep.multibody.kernels.loads.gravity import conductor_leg, near_planet, planet_load
from modalprep.multibody.kernels.loads.laws import GROUND, GROUND_ROTATION, bushing_law, hinge_law, rod_law, spring_law
from modalprep.multibody.kernels.loads.variable_mass import Fill, leaving_power
from modalprep.multibody.kernels.modal_inertia import expand, mode_moments
from modalprep.multibody.kernels.modal_mass import apply_slopes
from modalprep.multibody.kernels.spatial import (
    ZERO3,
    axpy9,
    dot3,
    get3,
    get9,
    row3,
    row9,
    take12,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.time_tables import Tables, table


class Loads(NamedTuple):
    """Packed loads; link -1 is the ground, table -1 no function of time."""

    tables: Tables
    motion: np.ndarray  # (prescribed, 2) int: link, table
    hinge_at: np.ndarray  # (hinges, 3) int: coordinate (-1 none), speed, table of the drive
    hinge: np.ndarray  # (hinges, 9) of `laws`
    point_at: np.ndarray  # (points, 9) int: link, interface, whether it follows, tables of force and torque
    spread_at: np.ndarray  # (spread, 3) int: link, whether it follows, table of the factor
    spread: np.ndarray  # (spread, 12): sum F_b; sum x_a F_b, by rows; a in link axes, b in those of the load
    spread_modes: np.ndarray  # (spread, N, 9): sum phi_a F_b
    spring_at: np.ndarray  # (springs, 6) int: link, interface, twice; table of the pull, whether it goes slack
    spring: np.ndarray  # (springs, 9): stiffness, damping, length, place of either end on the ground
    bushing_at: np.ndarray  # (bushings, 4) int: link, interface, twice
    bushing: np.ndarray  # (bushings, 36) of `laws`
    leg_at: np.ndarray  # (legs, 5) int: link, interface, twice; table of the current
    centre: np.ndarray  # (4,): mu and centre of a central field; mu = 0 without
    orbit: np.ndarray  # (8,) of `orbit`; rate 0 without
    gas_at: np.ndarray  # (jets, 3) int: table of the source's mass, first point of its way, the exit
    gas: np.ndarray  # (jets, 6): share, speed, pressure (N), axis at the exit
    gas_way: np.ndarray  # (points, 2) int: link, interface
    fill: Fill | None  # bodies that lose mass
    rod_at: np.ndarray  # (rods, 3) int: link, first row of the current, rows
    rod: np.ndarray  # (rods, 15) of `laws`
    rod_mass: np.ndarray  # (rods, 6) added mass: M, H and J of the links
    rod_coupling: np.ndarray  # (rods, 9)
    rod_inertia: np.ndarray  # (rods, 6)
    current: np.ndarray  # (rows, 4): depth, velocity of the water


class Energies(NamedTuple):
    """Power of what is no potential (W), energy in springs and of moved water, potential of fields and buoyancy (J)."""

    power: float
    stored: float
    gravity: float


@compile_kernel
def prescribe(loads, t, motion):
    """Write position, rate and acceleration of prescribed hinges to ``motion (nl, 3)``."""
    for i in range(len(loads.motion)):
        link, k = loads.motion[i, 0], loads.motion[i, 1]
        motion[link, 0], motion[link, 1], motion[link, 2] = table(loads.tables, k, t) if k >= 0 else ZERO3


@compile_kernel
def apply(loads, model, data, y, t, tau, slope):
    """Add all loads after `world`; returns `Energies`.

    Parameters
    ----------
    tau : (nu,)
        Overwritten with the hinge forces.
    slope : (2, nu)
        Overwritten with their derivatives by the hinge's own coordinate and speed.
    """
    nx = model.nx
    stored, gravity = 0.0, 0.0
    power = leaving_power(loads.fill, loads.tables, loads.centre, loads.orbit, model, data, y, t)
    for u in range(len(tau)):
        tau[u], slope[0, u], slope[1, u] = 0.0, 0.0, 0.0
    for i in range(len(loads.hinge_at)):
        x, u, k = loads.hinge_at[i, 0], loads.hinge_at[i, 1], loads.hinge_at[i, 2]
        place = y[x] if x >= 0 else 0.0
        f, p, e, dx, du = hinge_law(loads.hinge, i, place, y[nx + u], _value(loads, k, t))
        tau[u] += f
        slope[0, u] += dx
        slope[1, u] += du
        power, stored = power + p, stored + e
    for i in range(len(loads.point_at)):
        power += _point(loads, i, model, data, t)
    for i in range(len(loads.spread_at)):
        power += _spread(loads, i, model, data, t)
    for i in range(len(loads.spring_at)):
        p, e = _spring(loads, i, model, data, t)
        power, stored = power + p, stored + e
    for i in range(len(loads.bushing_at)):
        p, e = _bushing(loads, i, model, data)
        power, stored = power + p, stored + e
    for i in range(len(loads.leg_at)):
        power += _leg(loads, i, model, data, t)
    for i in range(len(loads.gas_at)):
        power += _gas(loads, i, model, data, t)
    if near_planet(loads.centre, loads.orbit):
        for i in range(len(model.links)):
            if model.links[i].body >= 0:
                gravity += _planet(loads, i, model, data)
    for i in range(len(loads.rod_at)):
        p, e, u = _rod(loads, i, model, data)
        power, stored, gravity = power + p, stored + e, gravity + u
    return Energies(power, stored, gravity)


@compile_kernel
def _value(loads, k, t):
    """Value of function k at time t; zero without."""
    if k < 0:
        return 0.0
    value, _, _ = table(loads.tables, k, t)
    return value


@compile_kernel
def _point(loads, i, model, data, t):
    """Force and torque on an interface; returns its power."""
    at = loads.point_at
    _, turn, v, w = node_state(model, data, at[i, 0], at[i, 1])
    f = (_value(loads, at[i, 3], t), _value(loads, at[i, 4], t), _value(loads, at[i, 5], t))
    m = (_value(loads, at[i, 6], t), _value(loads, at[i, 7], t), _value(loads, at[i, 8], t))
    if at[i, 2]:
        f, m = times(turn, f), times(turn, m)
    add_wrench(model, data, at[i, 0], at[i, 1], f, m)
    return dot3(f, v) + dot3(m, w)


@compile_kernel
def _gas(loads, i, model, data, t):
    """Thrust of a jet and the Coriolis force of its way: ``-m' (v_k+1 - v_k)`` on both ends of each stretch.

    That is ``-int 2 m' (w x t).v_r ds`` with velocities linear along the stretch. Returns the power.
    """
    first, last = loads.gas_at[i, 1], loads.gas_at[i, 2]
    _, rate, _ = table(loads.tables, loads.gas_at[i, 0], t)
    flow = -loads.gas[i, 0] * rate
    if flow == 0.0:
        return 0.0
    power, before = 0.0, ZERO3
    for k in range(first, last + 1):
        _, turn, v, _ = node_state(model, data, loads.gas_way[k, 0], loads.gas_way[k, 1])
        if k > first:
            f = (flow * (before[0] - v[0]), flow * (before[1] - v[1]), flow * (before[2] - v[2]))
            for end in range(k - 1, k + 1):
                add_wrench(model, data, loads.gas_way[end, 0], loads.gas_way[end, 1], f, ZERO3)
            power += dot3(f, before) + dot3(f, v)
        before = v
    push = -flow * loads.gas[i, 1] - (loads.gas[i, 2] if flow > 0.0 else 0.0)
    f = times(turn, (push * loads.gas[i, 3], push * loads.gas[i, 4], push * loads.gas[i, 5]))
    add_wrench(model, data, loads.gas_way[last, 0], loads.gas_way[last, 1], f, ZERO3)
    return power + dot3(f, before)


@compile_kernel
def _spread(loads, i, model, data, t):
    """Forces on all points of a body, moving with them; returns their power."""
    link = loads.spread_at[i, 0]
    factor = _value(loads, loads.spread_at[i, 2], t)
    base = get9(data.links[link].orientation)
    turn = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)  # axes of the load to those of the link
    if not loads.spread_at[i, 1]:
        turn = (base[0], base[3], base[6], base[1], base[4], base[7], base[2], base[5], base[8])
    f = times(turn, row3(loads.spread, i, 0))
    X, power = _spread_modes(data.modal, model, link, loads.spread_modes[i], factor, turn, row9(loads.spread, i, 3))
    x, y, z = times(turn, (X[0], X[1], X[2])), times(turn, (X[3], X[4], X[5])), times(turn, (X[6], X[7], X[8]))
    m = (y[2] - z[1], z[0] - x[2], x[1] - y[0])  # sum r x F from the columns of sum r F'
    power += dot3(f, transposed_times(base, get3(data.links[link].velocity))) + dot3(m, seen_spin(data, link))
    wrench = (factor * f[0], factor * f[1], factor * f[2]), (factor * m[0], factor * m[1], factor * m[2])
    add_at_origin(data.links[link], wrench[0], wrench[1])
    return factor * power


@compile_inline
def _spread_modes(modal, model, link, shapes, factor, turn, X):
    """Add distributed forces to the modal loads; returns ``sum x_a F_b`` at the deflection, and their power."""
    power = 0.0
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            for a in range(model.links[link].modes):
                N, own = get9(shapes[a]), 0.0
                for c in range(9):
                    own += N[c] * turn[c]
                modal.load[s, a] += factor * own
                power += own * modal.qd[s, a]
                X = axpy9(X, modal.q[s, a], N)
    return X, power


@compile_kernel
def spring_state(loads, i, model, data, t):
    """Force on the first end of an axial spring, its length, tension, power and energy: see `spring_law`."""
    at, c = loads.spring_at, loads.spring
    a, va, b, vb = row3(c, i, 3), ZERO3, row3(c, i, 6), ZERO3
    if at[i, 0] >= 0:
        a, _, va, _ = node_state(model, data, at[i, 0], at[i, 1])
    if at[i, 2] >= 0:
        b, _, vb, _ = node_state(model, data, at[i, 2], at[i, 3])
    return spring_law(c, i, _value(loads, at[i, 4], t), at[i, 5], a, b, va, vb)


@compile_kernel
def _spring(loads, i, model, data, t):
    """Axial spring; returns the power of its damper and its pull, and its energy."""
    at = loads.spring_at
    f, _, _, power, stored = spring_state(loads, i, model, data, t)
    if at[i, 0] >= 0:
        add_wrench(model, data, at[i, 0], at[i, 1], f, ZERO3)
    if at[i, 2] >= 0:
        add_wrench(model, data, at[i, 2], at[i, 3], (-f[0], -f[1], -f[2]), ZERO3)
    return power, stored


@compile_kernel
def _bushing(loads, i, model, data):
    """Bushing; returns the power of its dampers and its energy."""
    at, c = loads.bushing_at, loads.bushing
    ground = (row3(c, i, GROUND), row9(c, i, GROUND_ROTATION), ZERO3, ZERO3)
    first, second = ground, ground
    if at[i, 0] >= 0:
        first = node_state(model, data, at[i, 0], at[i, 1])
    if at[i, 2] >= 0:
        second = node_state(model, data, at[i, 2], at[i, 3])
    f, m, back, power, stored = bushing_law(c, i, first, second)
    if at[i, 0] >= 0:
        add_wrench(model, data, at[i, 0], at[i, 1], (-f[0], -f[1], -f[2]), back)
    if at[i, 2] >= 0:
        add_wrench(model, data, at[i, 2], at[i, 3], f, m)
    return power, stored


@compile_kernel
def leg_state(loads, i, model, data, t):
    """Magnetic force on each end of a straight conductor, its power, current and electromotive force."""
    at = loads.leg_at
    a, _, va, _ = node_state(model, data, at[i, 0], at[i, 1])
    b, _, vb, _ = node_state(model, data, at[i, 2], at[i, 3])
    f, emf = conductor_leg(loads.orbit, t, a, b, va, vb)
    current = _value(loads, at[i, 4], t)
    f = (0.5 * current * f[0], 0.5 * current * f[1], 0.5 * current * f[2])
    return f, dot3(f, va) + dot3(f, vb), current, emf


@compile_kernel
def _leg(loads, i, model, data, t):
    """Straight conductor; returns the power of the magnetic force."""
    at = loads.leg_at
    f, power, _, _ = leg_state(loads, i, model, data, t)
    add_wrench(model, data, at[i, 0], at[i, 1], f, ZERO3)
    add_wrench(model, data, at[i, 2], at[i, 3], f, ZERO3)
    return power


@compile_kernel
def _rod(loads, i, model, data):
    """Rod in water: its wrench, and its added mass to the inertia of the link; returns power and energies."""
    own = data.links[loads.rod_at[i, 0]]
    f, m, power, stored, potential = rod_law(
        loads.rod, i, loads.current, loads.rod_at[i, 1], loads.rod_at[i, 2], get9(own.orientation),
        get3(own.position), get3(own.velocity), get3(own.omega), get3(model.gravity),
    )  # fmt: skip
    add_at_origin(own, f, m)
    for k in range(6):
        own.M[k] += loads.rod_mass[i, k]
        own.J[k] += loads.rod_inertia[i, k]
    for k in range(9):
        own.H[k] += loads.rod_coupling[i, k]
    return power, stored, potential


@compile_kernel
def _planet(loads, i, model, data):
    """Gravity of a planet on a link's body, with the inertia that `outward` left; returns its potential."""
    f, torque, U, field = planet_load(loads.centre, loads.orbit, model, data, i)
    add_at_origin(data.links[i], f, torque)
    _planet_on_modes(data.modal, model, i, field)
    return U


@compile_inline
def _planet_on_modes(modal, model, i, field):
    """Add gravity of a planet to the modal loads of link i's body."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            g, _, n, q, _ = field
            expand(modal, model, i)
            if model.links[i].modal_mass == GROWS:
                apply_slopes(modal, model, i)
            P = take12(modal.affine[0], 0)
            for a in range(model.links[i].modes):
                S, L = mode_moments(modal, model, i, P, a)
                modal.load[s, a] += dot3(g, S) + q * (3.0 * dot3(n, times(L, n)) - L[0] - L[4] - L[8])
