"""Positions and motion of links and interfaces, and forces on them; after `articulated_body.outward`."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import get_rows9, put_rows9
from modalprep.multibody.kernels.algebra.matrices import (
    product,
    product_transposed,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add6,
    axpy3,
    cross,
    get3,
    get6,
    get9,
    get_angular,
    put3,
    put6,
    unsigned,
)
from modalprep.multibody.kernels.modal_interfaces import (
    deflected_acceleration,
    deflected_node,
    load_modes,
)


@compile_inline
def ground_rate(data):
    """Angular velocity of the ground, which turns about z, rad/s."""
    return data.links[unsigned(len(data.links) - 1)].omega[2]


@compile_inline
def seen_spin(data, i):
    """Angular velocity of link i relative to the ground, which may turn about z, in the link's axes; after `world`."""
    n = ground_rate(data)
    w = get3(data.links[i].omega)
    base = data.links[i].orientation
    return w[0] - n * base[6], w[1] - n * base[7], w[2] - n * base[8]


@compile_kernel
def carried(data, p, v):
    """Specific acceleration of a point at p with a constant velocity v relative to the ground, inertial axes."""
    ground = data.links[unsigned(len(data.links) - 1)]
    g = get3(ground.acceleration)
    n = ground.omega[2]
    return g[0] - n * (n * p[0] + 2.0 * v[1]), g[1] - n * (n * p[1] - 2.0 * v[0]), g[2]


@compile_kernel
def world(model, data):
    """Position, orientation and velocity of every link after `outward`, all relative to the ground."""
    for i in range(len(model.links)):
        place_link(model, data, i)


@compile_inline
def place_link(model, data, i):
    """Position, orientation and velocity of link i, after its parent's."""
    p = unsigned(model.links[unsigned(i)].parent)
    own = data.links[unsigned(i)]
    parent = data.links[p]
    base = get9(parent.orientation)
    arm = get3(own.arm)
    v = add3(cross(seen_spin(data, p), arm), get3(own.slide))
    put3(own.position, add3(get3(parent.position), times(base, arm)))
    put3(own.velocity, add3(get3(parent.velocity), times(base, v)))
    put_rows9(own.orientation, times(base, get_rows9(own.rotation)))


@compile_inline
def free_position(model, link, node):
    """Position of an interface on the undeformed body of a link, in the link's axes."""
    return get3(model.interfaces[unsigned(model.links[link].first_interface + node)])


@compile_kernel
def node_state(model, data, link, node):
    """Motion of an interface of a link's body, after `world`.

    Returns
    -------
    position : 3 numbers, m, inertial
    rotation : 9 numbers by rows, interface frame (the body's axes, turned with the node) to inertial
    velocity, spin : 3 numbers each, m/s and rad/s, inertial axes, relative to the ground
    """
    r, turn, v, w = deflected_node(data.modal, model, data, link, node, free_position(model, link, node))
    return seen_from_ground(model, data, link, r, turn, v, w)


@compile_inline
def seen_from_ground(model, data, link, r, turn, v, w):
    """Return `node_state` of an interface by its position, rotation, velocity and spin in its link's axes."""
    own = data.links[link]
    spin = seen_spin(data, link)
    base = get9(own.orientation)
    velocity = add3(get3(own.velocity), times(base, add3(cross(spin, r), v)))
    position = add3(get3(own.position), times(base, r))
    turn = product_transposed(product(base, turn), get9(model.links[link].align))
    return position, turn, velocity, times(base, add3(spin, w))


@compile_kernel
def node_acceleration(model, data, link, node, biases):
    """Acceleration of an interface (linear, angular, 3 numbers each, inertial axes), after `forward` and `world`.

    biases = 1 after `forward`: specific acceleration (acceleration minus gravity); 0 after `forward_bias`: the
    response.
    """
    own = data.links[link]
    base = get9(own.orientation)
    angular = get_angular(own.acceleration)
    r, v, t, linear, turning = deflected_acceleration(
        data.modal, model, data, link, node, free_position(model, link, node)
    )
    v = axpy3(add3(get3(own.acceleration), add3(cross(angular, r), v)), biases, linear)
    return times(base, v), times(base, axpy3(add3(angular, t), biases, turning))


@compile_kernel
def add_wrench(model, data, link, node, force, torque):
    """Add a force (N) and a torque (N m), inertial axes, 3 numbers each, at an interface of a link's body.

    On the ground (link -1) they have no effect. After `world`, before `inward` or `inward_bias`; the modes of a
    flexible body get ``Phi_k(q)^T`` times them.
    """
    if link < 0:
        return
    base = get9(data.links[link].orientation)
    f, t = transposed_times(base, force), transposed_times(base, torque)
    r = load_modes(data.modal, model, data, link, node, free_position(model, link, node), f, t)
    add_at_origin(data.links[link], f, add3(t, cross(r, f)))


@compile_inline
def add_at_origin(own, f, t):
    """Add a force and a torque at a link's origin, in its axes, to its wrench."""
    put6(own.wrench, add6(get6(own.wrench), (f[0], f[1], f[2], t[0], t[1], t[2])))
