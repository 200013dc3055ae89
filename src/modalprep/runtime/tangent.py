"""Exact derivatives of the rates of a tree, for the C part: by states, along a direction (theory 5.8)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.evaluation.evaluate import GOOD, Equations
from modalprep.multibody.kernels.algebra.matrices import times, transposed_times
from modalprep.multibody.kernels.algebra.rotations import quaternion_rate, quaternion_rotation
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    get_angular,
    put3,
    put_angular,
    scaled3,
    sub3,
    take3,
    take4,
)
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.data import Data
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.responses import Responses, new_responses, prepare, respond
from modalprep.multibody.kernels.tangents.data import Sweep
from modalprep.multibody.kernels.tangents.frames import end_curvature, end_frame, link_frame
from modalprep.multibody.kernels.tangents.inward import inward_tangents, turned_wrench
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.environment import CentralGravity
from modalprep.multibody.model.joint_types import FREE, KINDS, SPHERICAL
from modalprep.multibody.model.loads import PointForce
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.runtime.changes import constant
from modalprep.runtime.roots import derive

QUATERNION = KINDS[FREE].quaternion  # place among the coordinates of a free joint


@by_address
class Tangent(NamedTuple):
    """What the derivatives need beside the equations, and what C reads and writes."""

    data: Data  # the motion with the accelerations of the state
    sweep: Sweep
    scratch: Responses
    place: np.ndarray  # (3,) zeros: the origin of a link
    motion: np.ndarray  # (2, 24) of an interface and of its link
    columns: np.ndarray  # (2, 6, 4, nu)
    curvature: np.ndarray  # (N, N)
    wrench: np.ndarray  # (6,)
    added: np.ndarray  # (nu, nu) derivative by coordinates of what point forces take from the forces
    K: np.ndarray  # (nu, nu) of the forces by coordinates, speeds and accelerations
    D: np.ndarray
    M: np.ndarray
    force: np.ndarray  # (nu,)
    size: np.ndarray
    scale: np.ndarray  # (nu,) ones
    A: np.ndarray  # (nu, 2 nu) accelerations by the coordinates, as speeds move them, and by the speeds
    move: np.ndarray  # (2 nu,) a direction in these
    seed: np.ndarray  # (ny,) direction of the state
    found: np.ndarray  # (ny,) what the rates change by; zero for the work


def new_tangent(packed: Packed) -> Tangent:
    """Return the work of a system.

    Examples
    --------
    >>> from modalprep.examples import small_systems
    >>> from modalprep.multibody.packing.tree import pack
    >>> new_tangent(pack(small_systems()["flexible bodies in trees"])).A.shape
    (2, 4)
    """
    nu, modal = packed.nu, packed.model.modal
    N = 0 if modal is None else modal.K.shape[1]
    shapes: dict[str, tuple[int, ...]] = {"place": (3,), "motion": (2, 24), "columns": (2, 6, 4, nu)}
    shapes |= {"curvature": (N, N), "wrench": (6,), **dict.fromkeys(("added", "K", "D", "M"), (nu, nu))}
    shapes |= {"force": (nu,), "size": (nu,), "A": (nu, 2 * nu), "move": (2 * nu,)}
    shapes |= dict.fromkeys(("seed", "found"), (packed.nx + nu + 1,))
    arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
    scratch = new_responses(packed.model, nu)
    return Tangent(packed.data(), packed.sweep(), scratch, scale=np.ones(nu), **arrays)


def without_tangent(system: System, eq: Equations) -> Iterator[str]:
    """Yield what of a system has no exact derivatives in compiled code."""
    if eq.cons is not None and len(eq.cons.rows):
        yield "closed loops"
    for load in system.loads:
        if not isinstance(load, PointForce):
            yield "the gravity of a point" if isinstance(load, CentralGravity) else f"element {load.name!r}"
    for joint in system.joints:
        functions = joint.motion if isinstance(joint.motion, tuple) else (joint.motion,)
        if any(constant(function) is not None for function in functions):
            yield f"the motion of joint {joint.name!r}, which is an input"
    if system.orbit:
        yield "an orbit"
    if system.depletions:
        yield "bodies that lose mass"


@compile_kernel
def differentiate(eq, out, own, t):
    """Write A at `y`; returns a status of `derive`. The data are then those of no evaluation."""
    status = derive(eq, out, t)
    if status != GOOD:
        return status
    model, sweep, nx, nu = eq.model, own.sweep, eq.model.nx, len(eq.tau)
    outward(model, own.data, out.state, eq.motion)
    required_forces(model, own.data, out.ydot[nx : nx + nu], own.force)
    outward_tangents(model, own.data, sweep)
    _clear(own)
    points = eq.loads.elements.point_force
    for i in range(len(points)):
        _add_point_force(sweep.modes, eq, own, points[i], t)
    inward_tangents(model, own.data, sweep, own.K, own.D, own.M, own.force, own.size)
    _add(eq, own)
    prepare(model, eq.data, own.scratch)
    respond(model, eq.data, -1.0, own.K, own.A, 0, 0, own.scale, own.size, own.scratch)
    respond(model, eq.data, -1.0, own.D, own.A, 0, nu, own.scale, own.size, own.scratch)
    return status


@compile_kernel
def _clear(own):
    """Take out what was added before; entries of different branches stay zero."""
    for u in range(len(own.K)):
        for v in range(len(own.K)):
            own.added[u, v], own.K[u, v], own.D[u, v] = 0.0, 0.0, 0.0


@compile_kernel
def _add(eq, own):
    """Add point forces and elements of joints."""
    for u in range(len(own.K)):
        for v in range(len(own.K)):
            own.K[u, v] += own.added[u, v]
        if eq.flags[0].loaded:
            own.K[u, u] -= eq.slope[0, u]
            own.D[u, u] -= eq.slope[1, u]


@compile_inline
def _add_point_force(modes, eq, own, load, t):
    """Add a force and a torque on an interface, which turn with it, or not at all."""
    model, sweep, motion, columns = eq.model, own.sweep, own.motion[0], own.columns[0]
    clear(columns)
    if not _deflected(modes, model, own, load, motion, columns):
        place = model.interfaces[model.links[load.link].first_interface + load.interface]
        link_frame(model, own.data, sweep, load.link, place, motion, columns)
    tables, R = eq.loads.environment.tables, get9(motion[3:])
    f, m = _three(tables, load.force, t), _three(tables, load.torque, t)
    if not load.follows:
        f, m = transposed_times(R, f), transposed_times(R, m)
        _hold_still(own.added, columns, f, m)
    f, m = scaled3(-1.0, f), scaled3(-1.0, m)  # from the forces that the motion needs
    _add_to_modes(modes, model, own, load, f, m)
    f, m = _at_link(own, load.link, times(R, f), times(R, m))
    frame = sweep.frames[load.link]
    put3(frame.wrench, add3(get3(frame.wrench), f))
    put_angular(frame.wrench, add3(get_angular(frame.wrench), m))


@compile_kernel
def clear(columns):
    """Write zeros to columns (6, 4, nu)."""
    for c in range(columns.shape[0]):
        for part in range(columns.shape[1]):
            for u in range(columns.shape[2]):
                columns[c, part, u] = 0.0


@compile_inline
def _deflected(modes, model, own, load, motion, columns):
    """Write the motion of an interface of a flexible body; False of a rigid one."""
    if modes is not None:
        if model.links[load.link].modes > 0:
            end_frame(model, own.data, own.sweep, load.link, load.interface, motion, columns)
            return True
    return False


@compile_inline
def _three(tables, laws, t):
    return value(tables, laws[0], t), value(tables, laws[1], t), value(tables, laws[2], t)


@compile_kernel
def _hold_still(K, columns, f, m):
    """Add what a wrench, axes of a frame, that does not turn with the frame takes from the forces."""
    for u in range(len(K)):
        turn = columns[3, 0, u], columns[4, 0, u], columns[5, 0, u]
        by_force, by_torque = cross(turn, f), cross(turn, m)
        for v in range(len(K)):
            linear = columns[0, 0, v], columns[1, 0, v], columns[2, 0, v]
            angular = columns[3, 0, v], columns[4, 0, v], columns[5, 0, v]
            K[v, u] += dot3(linear, by_force) + dot3(angular, by_torque)


@compile_inline
def _at_link(own, link, f, m):
    """Return a wrench on the interface, axes of the ground, at the origin of its link."""
    arm = sub3(get3(own.motion[0]), get3(own.data.links[link].position))
    return f, add3(m, cross(arm, f))


@compile_inline
def _add_to_modes(modes, model, own, load, f, m):
    """Add what a wrench on an interface, its axes, does as the modes turn their own partial velocities."""
    if modes is not None:
        if model.links[load.link].modes > 0:
            _turn_modes(model, own, load.link, load.interface, f, m)


@compile_kernel
def _turn_modes(model, own, link, node, f, m):
    """See `_add_to_modes`."""
    columns, at_link, R = own.columns[0], own.columns[1], get9(own.motion[0, 3:])
    first, n = model.links[link].uq, model.links[link].modes
    base = get9(own.data.links[link].orientation)
    put3(own.wrench, transposed_times(base, times(R, f)))
    put_angular(own.wrench, transposed_times(base, times(R, m)))
    clear_square(own.curvature)
    end_curvature(model, own.data, own.sweep, link, node, own.wrench, own.curvature)
    clear(at_link)
    link_frame(model, own.data, own.sweep, link, own.place, own.motion[1], at_link)
    put3(own.wrench, f)
    put_angular(own.wrench, m)
    back = get9(own.motion[1, 3:])
    for a in range(n):
        for b in range(n):
            own.added[first + a, first + b] += own.curvature[a, b]
        moved = columns[0, 0, first + a], columns[1, 0, first + a], columns[2, 0, first + a]
        turn = columns[3, 0, first + a], columns[4, 0, first + a], columns[5, 0, first + a]
        x, y = turned_wrench(own.wrench, moved, turn)
        x, y = _at_link(own, link, times(R, x), times(R, y))
        x, y = transposed_times(back, x), transposed_times(back, y)
        for v in range(len(own.added)):
            linear = at_link[0, 0, v], at_link[1, 0, v], at_link[2, 0, v]
            angular = at_link[3, 0, v], at_link[4, 0, v], at_link[5, 0, v]
            own.added[v, first + a] += dot3(linear, x) + dot3(angular, y)


@compile_kernel
def clear_square(matrix):
    """Write zeros."""
    for a in range(matrix.shape[0]):
        for b in range(matrix.shape[1]):
            matrix[a, b] = 0.0


@compile_kernel
def follow(eq, out, own):
    """Write what the rates change by along the seed to `found`, after `differentiate` at the same state."""
    model, nx, nu = eq.model, eq.model.nx, len(eq.tau)
    for u in range(nu):
        own.move[nu + u] = own.seed[nx + u]
    for i in range(len(model.links)):
        link = model.links[i]
        for a in range(link.modes):
            own.move[link.uq + a] = own.seed[link.xq + a]
            own.found[link.xq + a] = own.seed[nx + link.uq + a]
        if link.joint == FREE:
            _follow_free(link, nx, out, own)
        elif link.joint == SPHERICAL:
            _follow_turn(link.x, link.u, nx, out, own)
        else:
            for s in range(link.uq - link.u):
                own.move[link.u + s] = own.seed[link.x + s]
                own.found[link.x + s] = own.seed[nx + link.u + s]
    for u in range(nu):
        total = 0.0
        for v in range(2 * nu):
            total += own.A[u, v] * own.move[v]
        own.found[nx + u] = total
    own.found[nx + nu] = 0.0


@compile_inline
def _follow_free(link, nx, out, own):
    """Position and quaternion of a free joint; its velocity has the axes of the body."""
    x, u = link.x, link.u
    turn = _follow_turn(x + QUATERNION, u + 3, nx, out, own)
    R = quaternion_rotation(take4(out.state, x + QUATERNION))
    put3(own.move[u:], transposed_times(R, take3(own.seed, x)))
    put3(own.found[x:], times(R, add3(cross(turn, take3(out.state, nx + u)), take3(own.seed, nx + u))))


@compile_inline
def _follow_turn(x, u, nx, out, own):
    """A quaternion, of which the part that changes its length moves nothing; returns the rotation, axes of the body."""
    e, d, raw = take4(out.state, x), take4(own.seed, x), take4(out.y, x)
    length = np.sqrt(raw[0] ** 2 + raw[1] ** 2 + raw[2] ** 2 + raw[3] ** 2)
    along = e[0] * d[0] + e[1] * d[1] + e[2] * d[2] + e[3] * d[3]
    d = (
        (d[0] - along * e[0]) / length,
        (d[1] - along * e[1]) / length,
        (d[2] - along * e[2]) / length,
        (d[3] - along * e[3]) / length,
    )
    v, w = (d[1], d[2], d[3]), (e[1], e[2], e[3])
    turn = scaled3(2.0, sub3(axpy3(scaled3(e[0], v), -d[0], w), cross(w, v)))
    put3(own.move[u:], turn)
    by_turn = quaternion_rate(d, take3(out.state, nx + u))
    by_spin = quaternion_rate(e, take3(own.seed, nx + u))
    for k in range(4):
        own.found[x + k] = by_turn[k] + by_spin[k]
    return turn


TANGENT_ROOTS = {"differentiate": differentiate, "follow": follow}
