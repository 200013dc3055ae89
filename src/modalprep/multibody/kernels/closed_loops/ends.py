"""Motion of the ends of constraints: interfaces of bodies, with their elastic motion.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import product, times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    cross,
    get3,
    get9,
    get_angular,
    put3,
    put6,
    put_angular,
    unsigned,
)
from modalprep.multibody.kernels.interfaces import free_position, ground_rate
from modalprep.multibody.kernels.modal_interfaces import interface_motion, shape_acceleration


@compile_inline
def end_state(end, model, data, out, shape):
    """Return position, rotation, velocity and spin of an end on a link; writes its arm and bias to `out`."""
    link = unsigned(end.link)
    node = end.interface
    place = free_position(model, link, node)
    r, turn, v, w, linear, angular = interface_motion(data.modal, model, data, link, node, place, shape)
    put3(out.arm, r)
    put6(out.bias, (linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]))
    own = data.links[link]
    spin = get3(data.links[link].omega)
    base = get9(own.orientation)
    origin = get3(own.position)
    moving = get3(own.velocity)
    n = ground_rate(data)
    moving = (moving[0] - n * origin[1], moving[1] + n * origin[0], moving[2])
    position = times(base, r)
    velocity = times(base, add3(cross(spin, r), v))
    turn = _node_rotation(data.modal, base, turn)
    return add3(origin, position), turn, add3(moving, velocity), times(base, add3(spin, w))


@compile_inline
def _node_rotation(modal, base, turn):
    """Return a link's orientation with the elastic rotation of a node, which is none without modes."""
    return base if modal is None else product(base, turn)


@compile_kernel
def end_accelerations(cons, model, data, work):
    """Write the accelerations of the ends due to those of the links and q'' alone, after `spread`."""
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
