"""Springs of rotations end a run where they pass half a turn: two rotations by half a turn either way are the same."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements import bushing, rotational_spring
from modalprep.multibody.kernels.algebra.tuples import copy, dot3, get3, get_angular, put3, put_angular, sub3
from modalprep.multibody.model.loads import Bushing
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.multibody.model.system import System

MOST = 2.5  # rad, in a step: up to half a turn tells whether it was passed
SLIGHT = 1e-6  # of the largest jump: round-off of a rotation about an axis without stiffness


def turning(system: System) -> list[Bushing | RotationalSpring]:
    """Return the bushings and rotational springs of a system, in the order of `follow_turns`."""
    return [load for kind in (Bushing, RotationalSpring) for load in system.loads if isinstance(load, kind)]


@compile_kernel
def write_turns(loads, model, data, turns):
    """Write ``turns (n, 6)`` after `world`: turn and spin of bushings, angle and rate of rotational springs."""
    n = len(loads.elements.bushing)
    for i in range(n):
        x, w = bushing.turn(loads.elements.bushing[i], model, data)
        put3(turns[i], x)
        put_angular(turns[i], w)
    for i in range(len(turns) - n):
        angle, rate = rotational_spring.angle(loads.elements.rotational_spring.rows[i], model, data)
        turns[n + i, 0], turns[n + i, 3] = angle, rate


@compile_kernel
def follow_turns(loads, model, data, turns, now, h):
    """Return the first element whose torque has jumped in a step h from `turns`; -1, and `turns` those of now, if none.

    A step in which an element turns so far that it could have passed half a turn unseen counts too. `now` is scratch.
    """
    write_turns(loads, model, data, now)
    n = len(loads.elements.bushing)
    for i in range(len(turns)):
        d = sub3(get3(now[i]), get3(turns[i]))
        w = get_angular(now[i])
        d = d if dot3(d, d) > np.pi * np.pi else (h * w[0], h * w[1], h * w[2])
        if dot3(d, d) > MOST * MOST:
            if i >= n and loads.elements.rotational_spring.rows[i - n].jumps:
                return i
            if i < n and _jumps(loads.elements.bushing[i].stiffness, d):
                return i
    for i in range(len(turns)):
        copy(now[i], turns[i])
    return -1


@compile_inline
def _jumps(k, d):
    """Whether a bushing's torque changes with a rotation vector that changes by d."""
    return k[3] * abs(d[0]) + k[4] * abs(d[1]) + k[5] * abs(d[2]) > SLIGHT * np.pi * (k[3] + k[4] + k[5])
