"""Inverse dynamics of the tree by the recursive Newton-Euler algorithm: forces of given accelerations, in O(n)."""

from __future__ import annotations

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.matrices import (
    inertia_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add6,
    cross,
    get3,
    get6,
    get9,
    get_angular,
    put3,
    put6,
    put_angular,
    sub6,
)
from modalprep.multibody.kernels.joints import along_joint, joint_force
from modalprep.multibody.kernels.modal import (
    add_modal_forces,
    modal_forces,
    write_accelerations,
)
from modalprep.multibody.kernels.modal_interfaces import parent_acceleration


@compile_kernel
def required_forces(model, data, udot, out):
    """Write ``M udot - f`` of all bodies and loads but joint forces to ``out (nu,)``.

    After `articulated_body.outward` and the loads, in place of `inward`: joint forces equal to `out` give the
    accelerations ``udot (nu,)``, where the modal rows of `out` vanish.
    """
    for i in range(len(model.links)):
        f = _outward(model, data, i, udot)
        f = modal_forces(data.modal, model, data, i, f, out)
        put6(data.links[i].force, sub6(f, get6(data.links[i].wrench)))
    for i in range(len(model.links) - 1, -1, -1):
        _inward(model, data, i, out)


@compile_kernel
def _outward(model, data, i, udot):
    """Write the acceleration of link i, q'' too, to the data; returns its own inertia force without q''."""
    own = data.links[i]
    turn = get9(own.rotation)
    linear, angular = parent_acceleration(data.modal, model, data, i, 1.0)
    v = add3(transposed_times(turn, linear), get3(own.bias))
    t = add3(transposed_times(turn, angular), get_angular(own.bias))
    v, t = along_joint(model.links[i], udot, v, t)
    put3(own.acceleration, v)
    put_angular(own.acceleration, t)
    write_accelerations(data.modal, model, i, udot)
    return add6(inertia_times(own.M, own.H, own.J, get6(own.acceleration)), get6(own.force))


@compile_kernel
def _inward(model, data, i, out):
    """Write the joint's generalised forces of link i, and add its wrench to its parent's."""
    link = model.links[i]
    own = data.links[i]
    f = get6(data.links[i].force)
    joint_force(link, f, out)
    if link.parent == len(model.links):
        return
    turn = get9(own.rotation)
    force, torque = times(turn, (f[0], f[1], f[2])), times(turn, (f[3], f[4], f[5]))
    add_modal_forces(data.modal, model, i, force, torque, out)
    torque = add3(torque, cross(get3(own.arm), force))
    parent = data.links[link.parent]
    put6(parent.force, add6(get6(parent.force), (force[0], force[1], force[2], torque[0], torque[1], torque[2])))
