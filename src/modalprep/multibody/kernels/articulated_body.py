"""Order-n forward dynamics of a tree of rigid and flexible bodies, by the articulated-body algorithm: theory 4 and 5.

One evaluation: `outward`, [`world`, loads by `add_wrench`,] `inward`, `forward`, `kinematic`; `derivative` is all of
them for a system without loads. The cost is linear in the number of links. Nothing is allocated or raised: functions
return the link whose pivot is not positive, otherwise -1. `reference/equations.py` is the reference implementation.

Arguments, the same in all functions (see data.py): `model` Model, `data` Data, ``y (nx + nu,)`` state,
``motion (nl, 3)`` position, rate and acceleration of prescribed joints, ``tau (nu,)`` joint forces (modal rows unused).
Spatial vectors are (linear, angular), in the link's frame; accelerations are those of the link's origin less gravity.
"""

from __future__ import annotations

from functools import partial

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import get_lanes6, put_lanes6
from modalprep.multibody.kernels.algebra.inertia_blocks import blocks, parts, put_parts, shifted
from modalprep.multibody.kernels.algebra.matrices import (
    inertia_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rotations import turned
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    add3,
    add6,
    axpy3,
    cross,
    get3,
    get6,
    get9,
    put3,
    put6,
    put9,
    put_angular,
    sub6,
    unsigned,
)
from modalprep.multibody.kernels.interfaces import place_link
from modalprep.multibody.kernels.joints import (
    along_joint,
    eliminate_joint,
    joint_accelerations,
    joint_motion,
    joint_rates,
    speeds_from_bias,
)
from modalprep.multibody.kernels.modal import (
    add_bias_to_modes,
    add_to_modes,
    clear_modal_loads,
    eliminate_load,
    eliminate_modes,
    modal_accelerations,
    set_bias_from_loads,
    write_accelerations,
)
from modalprep.multibody.kernels.modal_inertia import modal_coordinates, own_inertia
from modalprep.multibody.kernels.modal_interfaces import (
    parent_acceleration,
    parent_frame,
    turn_parent_shape,
)
from modalprep.multibody.model.joint_types import REVOLUTE


@compile_kernel
def outward(model, data, y, motion):
    """Kinematics of every link, its own inertia and bias, root to tips: theory (5.1), and the bias of (5.2).

    External wrenches and modal loads become zero.
    """
    _outward(model, data, y, motion, True, False)


@compile_kernel
def outward_motion(model, data, y, motion):
    """Kinematics of every link as of `outward`, then `world`; inertias, biases and loads stay what they were."""
    _outward(model, data, y, motion, False, True)


@compile_kernel
def outward_in_world(model, data, y, motion):
    """Do as `outward`, then as `world`."""
    _outward(model, data, y, motion, True, True)


@compile_inline
def _outward(model, data, y, motion, inertia, placed):
    """Do as `outward` with inertias if `inertia`, as `world` if `placed`."""
    for i in range(len(model.links)):
        if model.links[i].joint == REVOLUTE and model.links[i].phi < 0:
            _revolute_kinematics(model, data, i, y)
        else:
            _link_kinematics(model, data, i, y, motion[i])
        modal_coordinates(data.modal, model, i, y)
        if inertia:
            put6(data.links[i].wrench, ZERO6)
            own_inertia(data.modal, model, data, i)
        if placed:
            place_link(model, data, i)


@compile_inline
def _revolute_kinematics(model, data, i, y):
    """Kinematics of link i with a revolute joint on a rigid body: the common case, without the terms that vanish."""
    link, own = model.links[i], data.links[i]
    arm = get3(link.arm)
    wP = get3(data.links[unsigned(link.parent)].omega)
    rate = y[unsigned(model.nx + link.u)]
    turn = turned(get9(link.rotation), y[unsigned(link.x)])
    w = transposed_times(turn, wP)
    v = transposed_times(turn, cross(wP, cross(wP, arm)))
    put9(own.rotation, turn)
    put3(own.arm, arm)
    put3(own.slide, ZERO3)
    put3(own.omega, (w[0], w[1], w[2] + rate))
    put6(own.bias, (v[0], v[1], v[2], w[1] * rate, -w[0] * rate, 0.0))


@compile_inline
def _link_kinematics(model, data, i, y, prescribed):
    """Position, velocity and bias acceleration of link i relative to its parent: theory (5.1), (5.2)."""
    link = model.links[i]
    own = data.links[i]
    wP = get3(data.links[model.links[i].parent].omega)
    # of the joint's frame on the parent; its acceleration is that where A and q'' of the parent are zero
    frame, arm, slide, t, linear, angular, shape, scale = parent_frame(data.modal, model, data, i)
    wF = add3(wP, t)
    turn, offset, rate, spin, extra = joint_motion(link, prescribed, model.nx, y, frame)
    if link.joint != REVOLUTE:
        rate = times(turn, rate)
        moved = axpy3(cross(wF, offset), 2.0, rate)
        linear = add3(add3(linear, cross(angular, offset)), cross(wF, moved))
        slide = add3(add3(slide, cross(t, offset)), rate)
    turn_parent_shape(data.modal, model, i, shape, scale, offset)
    w = add3(transposed_times(turn, wF), spin)
    bias = transposed_times(turn, linear)
    turning = add3(transposed_times(turn, angular), cross(w, spin))
    put9(own.rotation, turn)
    put3(own.arm, add3(arm, offset))
    put3(own.slide, slide)
    put3(own.omega, w)
    put6(own.bias, add6((bias[0], bias[1], bias[2], turning[0], turning[1], turning[2]), extra))


@compile_kernel
def inward(model, data, tau, added, c1, c2):
    """Articulated inertias and bias forces, tips to root: theory (5.3), (5.4).

    Returns the link whose pivot is not positive, else -1.

    Parameters
    ----------
    added : (nu,) or None
        Added to the diagonal of the joints' inertias: damping and stiffness in an implicit step. Modal rows unused.
    c1, c2 : float
        Modal rows get ``1 + c1 D + c2 K`` in place of 1; 0 for the accelerations.
    """
    for i in range(len(model.links) - 1, -1, -1):
        if not inward_link(model, data, i, tau, added, c1, c2):
            return i
    return -1


@compile_inline
def inward_link(model, data, i, tau, added, c1, c2):
    """Articulated inertia and bias force of link i, after its children; False when a pivot is not positive."""
    if not eliminate_modes(data.modal, model, data, i, c1, c2):
        return False
    link = model.links[i]
    own = data.links[i]
    B = blocks(get6(own.M), get9(own.H), get6(own.J))
    if link.last_child >= 0:
        B = add6(B, get_lanes6(own.children))
        put_parts(own, B)
    P = sub6(get6(own.force), get6(own.wrench))
    put6(own.force, P)
    grounded = link.parent == len(model.links)
    positive, B, f, t = eliminate_joint(link, own, B, P, tau, added, grounded)
    if positive and not grounded:
        _add_to_parent(model, data, i, B, f, t)
    return positive


@compile_inline
def _add_to_parent(model, data, i, B, f, t):
    """Add articulated inertia and bias force of link i, in the parent link's axes, to its parent's."""
    arm = get3(data.links[i].arm)
    parent = data.links[unsigned(model.links[i].parent)]
    M, H, J = parts(B)
    add_to_modes(data.modal, model, i, M, H, J, (f[0], f[1], f[2], t[0], t[1], t[2]), arm)
    B = shifted(B, arm)
    if model.links[unsigned(model.links[i].parent)].last_child != i:
        B = add6(B, get_lanes6(parent.children))
    put_lanes6(parent.children, B)
    t = add3(t, cross(arm, f))
    put6(parent.force, add6(get6(parent.force), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_kernel
def forward(model, data, tau, udot):
    """Accelerations after `inward`, root to tips, theory (5.2): ``udot (nu,)``, of links and q'' in the data."""
    _accelerate(model, data, tau, udot, 1.0)


@compile_inline
def _accelerate(model, data, tau, udot, biases):
    """Accelerations, root to tips; `biases` = 1, or 0 of the response to the forces of `inward_bias` alone."""
    for i in range(len(model.links)):
        own = data.links[i]
        linear, angular = parent_acceleration(data.modal, model, data, i, biases)
        turn = get9(own.rotation)
        b = get6(own.bias)
        v = axpy3(transposed_times(turn, linear), biases, (b[0], b[1], b[2]))
        t = axpy3(transposed_times(turn, angular), biases, (b[3], b[4], b[5]))
        base = (linear[0], linear[1], linear[2], angular[0], angular[1], angular[2])
        v, t = joint_accelerations(model.links[i], own, base, v, t, tau, udot, biases)
        put3(own.acceleration, v)
        put_angular(own.acceleration, t)
        modal_accelerations(data.modal, model, data, i, udot)


@compile_kernel
def clear_wrenches(model, data):
    """Set all external wrenches and modal loads to zero."""
    for i in range(len(model.links)):
        put6(data.links[i].wrench, ZERO6)
    clear_modal_loads(data.modal)


@compile_kernel
def inward_bias(model, data, tau):
    """Bias forces of external wrenches, modal loads and `tau` alone, with the inertias of the last `inward`.

    The bodies' own bias forces and gravity are left out; `forward_bias` then gives the response of the accelerations:
    columns of the inverse mass matrix in O(n) each. Overwrites the bias forces (b_f too), accelerations and q'' of the
    last evaluation.
    """
    ground = len(model.links)
    for i in range(ground):
        put6(data.links[i].force, sub6(ZERO6, get6(data.links[i].wrench)))
        set_bias_from_loads(data.modal, model, i)
    for i in range(ground - 1, -1, -1):
        eliminate_load(data.modal, model, data, i)
        link, own = model.links[i], data.links[i]
        if link.parent == ground:
            continue
        P = get6(own.force)
        turn = get9(own.rotation)
        x = speeds_from_bias(link, own, P, tau)
        P = add6(P, inertia_times(own.M, own.H, own.J, x))
        f, t = times(turn, (P[0], P[1], P[2])), times(turn, (P[3], P[4], P[5]))
        add_bias_to_modes(data.modal, model, i, f, t)
        t = add3(t, cross(get3(own.arm), f))
        parent = data.links[link.parent]
        put6(parent.force, add6(get6(parent.force), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_kernel
def forward_bias(model, data, tau, udot):
    """Response of the accelerations to the forces of `inward_bias`: ``udot (nu,)``, those of the links and q''."""
    _accelerate(model, data, tau, udot, 0.0)


@compile_kernel
def spread(model, data, udot):
    """Write the links' accelerations and q'' by ``udot (nu,)`` alone, without biases and gravity, after `outward`."""
    for i in range(len(model.links)):
        own = data.links[i]
        linear, angular = parent_acceleration(data.modal, model, data, i, 0.0)
        turn = get9(own.rotation)
        v, t = transposed_times(turn, linear), transposed_times(turn, angular)
        v, t = along_joint(model.links[i], udot, v, t)
        put3(own.acceleration, v)
        put_angular(own.acceleration, t)
        write_accelerations(data.modal, model, i, udot)


@compile_kernel
def kinematic(model, y, ydot):
    """Time derivatives of the coordinates: the first nx numbers of ``ydot``."""
    for i in range(len(model.links)):
        link = model.links[i]
        joint_rates(link, model.nx, y, ydot)
        for a in range(link.modes):
            ydot[link.xq + a] = y[model.nx + link.uq + a]


@compile_kernel
def reactions(model, data, out):
    """Write the force and torque that each joint exerts on its link, ``out (nl, 6)``, link frame, after `forward`.

    They act at the link's origin and include the joint forces `tau`, or the drive's force or torque along z of a
    prescribed joint.
    """
    for i in range(len(model.links)):
        own = data.links[i]
        put6(out[i], add6(inertia_times(own.M, own.H, own.J, get6(own.acceleration)), get6(own.force)))


@partial(compile_kernel, forceinline=True)
def accelerations(model, data, y, motion, tau, udot):
    """All accelerations ``udot (nu,)`` of a system without loads but `tau`; returns the status of `inward`."""
    outward(model, data, y, motion)
    status = inward(model, data, tau, None, 0.0, 0.0)
    if status < 0:
        forward(model, data, tau, udot)
    return status


@compile_kernel
def derivative(model, data, y, motion, tau, ydot):
    """Time derivative of the state of a system without loads but `tau`; returns the status of `inward`."""
    kinematic(model, y, ydot)
    return accelerations(model, data, y, motion, tau, ydot[model.nx :])
