"""How the ends of constraints move: interfaces of bodies, with their elastic motion.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import product, times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    at,
    cross,
    get3,
    get9,
    get_angular,
    put3,
    put6,
    put_angular,
)
from modalprep.multibody.kernels.interfaces import free_position, ground_rate
from modalprep.multibody.kernels.modal_interfaces import interface_motion, shape_acceleration


@compile_inline
def end_state(end, model, data, found, shape):
    """Return the motion of an end as `node_state` does, and write to `found` what its acceleration follows from."""
    link = at(end.link)
    node = end.interface
    place = free_position(model, link, node)
    r, turn, v, w, linear, angular = interface_motion(data.modal, model, data, link, node, place, shape)
    put3(found.arm, r)
    put6(found.bias, (linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]))
    own = data.links[link]
    spin = get3(data.links[link].omega)
    base = get9(own.orientation)
    origin = get3(own.position)
    moving = get3(own.velocity)
    n = ground_rate(data)
    moving = (moving[0] - n * origin[1], moving[1] + n * origin[0], moving[2])
    position = times(base, r)
    velocity = times(base, add3(cross(spin, r), v))
    return add3(origin, position), _turned(data.modal, base, turn), add3(moving, velocity), times(base, add3(spin, w))


@compile_inline
def _turned(modal, base, turn):
    """Return a link's orientation with the rotation of a node, which is none without modes."""
    return base if modal is None else product(base, turn)


@compile_kernel
def observe_ends(cons, model, data, work):
    """Accelerations of the ends after `spread`, when those of the links and q'' are all there is."""
    for k in range(len(cons.ends)):
        v = ZERO3
        w = ZERO3
        link = cons.ends[k].link
        if link >= 0:
            v = get3(data.links[link].acceleration)
            w = get_angular(data.links[link].acceleration)
            moved, turned = shape_acceleration(data.modal, model, link, work.shape[k])
            base = get9(data.links[link].orientation)
            v = add3(v, cross(w, get3(work.ends[k].arm)))
            v, w = times(base, add3(v, moved)), times(base, add3(w, turned))
        put3(work.ends[k].acceleration, v)
        put_angular(work.ends[k].acceleration, w)
