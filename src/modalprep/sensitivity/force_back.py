"""What force elements add to the products with the derivatives of the inverse dynamics: theory 5.9.

With the velocities W that a vector w of speeds gives the ends, ``w' Q`` of the generalised forces Q is the power of the
forces on the ends. Their laws say what it changes by with the motion of the ends (laws_back.py), and the ends bring
that to their links, which the inward sweep adds (kernels/tangents/pulled_back.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements import axial_spring, bushing
from modalprep.multibody.elements.rotational_spring import curve, twist
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.algebra.matrices import UNIT9, times
from modalprep.multibody.kernels.algebra.rows import dots6
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    axpy3,
    copy,
    cross,
    dot3,
    get3,
    get9,
    get_angular,
    put3,
    put9,
    put_angular,
    scaled3,
    sub3,
)
from modalprep.multibody.kernels.interfaces import node_state
from modalprep.multibody.kernels.tangents.data import first_place
from modalprep.multibody.kernels.tangents.outward import end_motion, mode_columns, put_twist, shifted_twist
from modalprep.multibody.kernels.tangents.pulled_back import PULLED, add_wrench_at, pull_modes
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.loads import AxialSpring, Bushing, PointForce
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import rows
from modalprep.sensitivity.laws_back import bushing_back, follower_back, rotational_back, spring_back

KNOWN = (AxialSpring, Bushing, PointForce, RotationalSpring)
END = np.dtype(
    [
        ("link", np.int64),
        ("node", np.int64),
        ("slot", np.int64),  # place in the work of the sweeps, of a flexible body; else -1
        ("position", np.float64, 3),  # relative to the ground, its axes; as all that follows
        ("rotation", np.float64, 9),
        ("velocity", np.float64, 3),
        ("omega", np.float64, 3),
        ("velocity_of", np.float64, 6),  # both, where they are asked for
        ("acceleration", np.float64, 6),  # less gravity, of ends of closures
        ("wrench", np.float64, 6),
        ("by_pose", np.float64, 6),
        ("by_rate", np.float64, 6),
        ("by_acceleration", np.float64, 6),
        *((name, PULLED[name].base, PULLED[name].shape) for name in ("twist", "momentum", "spin", "placed", "moving")),
    ]
)
OTHER = np.dtype([("element", np.int64), ("product", np.int64)])


@by_address
class Ends(NamedTuple):
    """The ends of force elements, the last is on the ground, and which ends each element has."""

    rows: np.ndarray  # (ends + 1,) END
    springs: np.ndarray  # (n, 2)
    bushings: np.ndarray  # (n, 2)
    rotational: np.ndarray  # (n, 2)
    points: np.ndarray  # (n, 1)
    power_of_springs: np.ndarray  # (n,)
    power_of_bushings: np.ndarray
    other_springs: np.ndarray  # (k,) those of neighbouring systems instead
    of_springs: np.ndarray  # (k,) OTHER
    other_bushings: np.ndarray
    of_bushings: np.ndarray
    products: np.ndarray  # (neighbours,) sums of their power beyond that of this system


def ends_of(evaluator: Evaluator, neighbours: Sequence[Evaluator]) -> Ends | None:
    """Return the ends of the force elements of a system, and those of neighbours with other springs or bushings.

    None where it has no force elements.
    """
    if not evaluator.system.loads:
        return None
    elements = evaluator.loading.arrays.elements
    packed = elements.axial_spring, elements.bushing, elements.rotational_spring.rows, elements.point_force
    springs, bushings, turns, points = map(_places, packed)
    every = [each for own in (springs, bushings, turns, points) for each in own.reshape(-1, 2).tolist()]
    known = sorted({(link, node) for link, node in every if link >= 0})
    numbers = {place: k for k, place in enumerate(known)}

    def ends(own: np.ndarray) -> np.ndarray:
        found = [numbers.get((link, node), len(known)) for link, node in own.reshape(-1, 2).tolist()]
        return np.array(found, dtype=np.int64).reshape(own.shape[:2])

    def others(kind: str) -> tuple[np.recarray, np.recarray]:
        return _others([getattr(each.loading.arrays.elements, kind) for each in (evaluator, *neighbours)])

    other_springs, of_springs = others("axial_spring")
    other_bushings, of_bushings = others("bushing")
    return Ends(
        rows=end_rows(evaluator.packed, known, first_place(evaluator.packed.model)),
        springs=ends(springs),
        bushings=ends(bushings),
        rotational=ends(turns),
        points=ends(points),
        power_of_springs=np.zeros(len(springs)),
        power_of_bushings=np.zeros(len(bushings)),
        other_springs=other_springs,
        of_springs=of_springs,
        other_bushings=other_bushings,
        of_bushings=of_bushings,
        products=np.zeros(len(neighbours)),
    )


def _places(packed: np.recarray) -> np.ndarray:
    """Return links and interfaces of the ends (n, k, 2) of elements."""
    pairs = ("",) if "link" in (packed.dtype.names or ()) else ("_a", "_b")
    return np.array([[packed[f"link{k}"], packed[f"interface{k}"]] for k in pairs]).transpose(2, 0, 1)


def end_rows(packed: Packed, known: Sequence[tuple[int, int]], first: int) -> np.recarray:
    """Return ends by link and interface, and a last one on the ground; `first` is a place in the work of the sweeps."""
    found = np.zeros(len(known) + 1, END).view(np.recarray)
    for k, (link, node) in enumerate(known):
        found.link[k], found.node[k] = link, node
        found.slot[k] = first + k if link >= 0 and packed.model.links["modes"][link] else -1
    found.slot[-1] = -1
    return found


def _others(packed: list[np.recarray]) -> tuple[np.recarray, np.recarray]:
    """Return the elements that are others in neighbours of the first, and to which they belong."""
    own = packed[0]
    found, of = [], []
    for k, other in enumerate(packed[1:]):
        for i in np.flatnonzero(own != other):
            found.append(other[i])
            of.append((i, k))
    return np.array(found, own.dtype).view(np.recarray), rows(OTHER, of)


def same_joints(one: Evaluator, other: Evaluator) -> bool:
    """Whether the elements of joints of two systems, and all functions of time, are the same."""
    a, b = one.loading.arrays, other.loading.arrays
    tables = zip(a.environment.tables, b.environment.tables, strict=True)
    return all(np.array_equal(x, y) for x, y in [*tables, (a.hinges, b.hinges)])


def only_elements_differ(one: Evaluator, other: Evaluator) -> bool:
    """Whether two systems with the same tree differ in springs and bushings alone."""
    a, b = one.loading.arrays, other.loading.arrays
    same = list(zip(a.elements.rotational_spring, b.elements.rotational_spring, strict=True))
    same.append((a.elements.point_force, b.elements.point_force))
    return same_joints(one, other) and all(np.array_equal(x, y) for x, y in same)


@compile_inline
def forces_back(ends, eq, t, work, pulled):
    """Add what the force elements do between the sweeps of `pulled_back`; `ends` may be None."""
    if ends is not None:
        _go_back(ends, eq, t, work, pulled)


@compile_inline
def keep_products(ends, kept, away):
    """Put the products of neighbouring systems away, or back again."""
    if ends is not None:
        if away:
            copy(ends.products, kept)
        else:
            copy(kept, ends.products)


@compile_kernel
def _go_back(ends, eq, t, work, pulled):
    last = len(ends.rows) - 1
    for k in range(last):
        place_end(work.modes, eq.model, eq.data, work, pulled, ends.rows[k])
    elements, tables = eq.loads.elements, eq.loads.environment.tables
    _springs(ends, elements.axial_spring, tables, t)
    _bushings(ends, elements.bushing)
    _rotational(ends, elements.rotational_spring)
    _points(ends, elements.point_force, tables, t)
    for k in range(last):
        _add(work.modes, eq.model, eq.data, work, pulled, ends.rows[k])


@compile_kernel
def place_end(modes, model, data, work, pulled, end):
    """Write the motion of an end, and its velocities by w."""
    link = model.links[end.link]
    p, R, v, w = node_state(model, data, end.link, end.node)
    put3(end.position, p)
    put9(end.rotation, R)
    put3(end.velocity, v)
    put3(end.omega, w)
    own = pulled.links[end.link]
    arm = sub3(p, get3(data.links[end.link].position))
    x = shifted_twist(get3(own.twist), get_angular(own.twist), arm)
    if modes is not None:
        if end.slot >= 0:
            r = end_motion(model, data, work, end.link, end.node, end.slot)
            mode_columns(model, data, work, end.link, end.slot, r, ZERO3)
            more = dots6(modes.turns.columns[end.slot], pulled.modes[0, link.slot], link.modes)
            x = add3(x[0], (more[0], more[1], more[2])), add3(x[1], (more[3], more[4], more[5]))
    put_twist(end.twist, 0, x)
    end.wrench[:] = end.by_pose[:] = end.by_rate[:] = 0.0


@compile_kernel
def _add(modes, model, data, work, pulled, end):
    """Bring what acts on an end to its link and to the modes of its body: less the forces, as inverse dynamics has it.

    Forces keep their directions, while those of the sweep turn with the link: the difference is a torque.
    """
    f, t = get3(end.wrench), get_angular(end.wrench)
    rate, brake = get3(end.by_rate), get_angular(end.by_rate)
    turned = add3(cross(get3(end.velocity), rate), cross(get3(end.omega), brake))
    turned = add3(turned, add3(cross(get3(end.twist), f), cross(get_angular(end.twist), t)))
    put_twist(end.placed, 0, (get3(end.by_pose), add3(get_angular(end.by_pose), turned)))
    for c in range(6):
        end.placed[c], end.moving[c], end.wrench[c] = -end.placed[c], -end.by_rate[c], -end.wrench[c]
    bring_to_link(modes, model, data, work, pulled, end)


@compile_kernel
def bring_to_link(modes, model, data, work, pulled, end):
    """Add what stands at an end to its link and to the modes of its body."""
    arm = sub3(get3(end.position), get3(data.links[end.link].position))
    if modes is not None:
        if end.slot >= 0:
            pull_modes(model, data, work, pulled, end.link, end.node, end.slot, arm, end.wrench, end)
    own = pulled.links[end.link]
    add_wrench_at(own.momentum, end.momentum, arm)
    add_wrench_at(own.placed, end.placed, arm)
    add_wrench_at(own.moving, end.moving, arm)
    add_wrench_at(work.frames[end.link].wrench, end.wrench, arm)


@compile_inline
def _push(end, f, t):
    """Add a wrench to that on an end."""
    put3(end.wrench, add3(get3(end.wrench), f))
    put_angular(end.wrench, add3(get_angular(end.wrench), t))


@compile_inline
def _on_ground(ends, position, rotation):
    """Write the place of the end on the ground, of one element."""
    ground = ends.rows[len(ends.rows) - 1]
    put3(ground.position, position)
    put9(ground.rotation, rotation)


@compile_inline
def _spring(c, tables, t, a, b):
    """Return force on the first end and tension of a spring."""
    actuator = value(tables, c.actuator, t)
    at = get3(a.position), get3(b.position)
    f, _, tension, _, _ = axial_spring.law(c, actuator, at[0], at[1], get3(a.velocity), get3(b.velocity))
    return f, tension


@compile_kernel
def _springs(ends, packed, tables, t):
    """Go back through springs; the power of those of neighbours is added to the products."""
    for i in range(len(packed)):
        c, a, b = packed[i], ends.rows[ends.springs[i, 0]], ends.rows[ends.springs[i, 1]]
        _on_ground(ends, get3(c.position), UNIT9)
        f, tension = _spring(c, tables, t, a, b)
        _push(a, f, ZERO3)
        _push(b, scaled3(-1.0, f), ZERO3)
        ends.power_of_springs[i] = dot3(f, sub3(get3(a.twist), get3(b.twist)))
        spring_back(c, tension, a, b)
    for k in range(len(ends.of_springs)):
        c, of = ends.other_springs[k], ends.of_springs[k]
        a = ends.rows[ends.springs[of.element, 0]]
        b = ends.rows[ends.springs[of.element, 1]]
        _on_ground(ends, get3(c.position), UNIT9)
        f, _ = _spring(c, tables, t, a, b)
        power = dot3(f, sub3(get3(a.twist), get3(b.twist)))
        ends.products[of.product] += power - ends.power_of_springs[of.element]


@compile_inline
def _bushing(c, a, b):
    """Return force and torque on the second frame of a bushing, torque on the first, and their power at W."""
    first = get3(a.position), get9(a.rotation), get3(a.velocity), get3(a.omega)
    second = get3(b.position), get9(b.rotation), get3(b.velocity), get3(b.omega)
    f, m, back, _, _ = bushing.law(c, first, second)
    power = dot3(f, sub3(get3(b.twist), get3(a.twist)))
    return f, m, back, power + dot3(m, get_angular(b.twist)) + dot3(back, get_angular(a.twist))


@compile_kernel
def _bushings(ends, packed):
    """Go back through bushings; the power of those of neighbours is added to the products."""
    for i in range(len(packed)):
        c = packed[i]
        a = ends.rows[ends.bushings[i, 0]]
        b = ends.rows[ends.bushings[i, 1]]
        _on_ground(ends, get3(c.position), get9(c.rotation))
        f, m, back, ends.power_of_bushings[i] = _bushing(c, a, b)
        _push(a, scaled3(-1.0, f), back)
        _push(b, f, m)
        bushing_back(c, a, b)
    for k in range(len(ends.of_bushings)):
        c, of = ends.other_bushings[k], ends.of_bushings[k]
        a = ends.rows[ends.bushings[of.element, 0]]
        b = ends.rows[ends.bushings[of.element, 1]]
        _on_ground(ends, get3(c.position), get9(c.rotation))
        _, _, _, power = _bushing(c, a, b)
        ends.products[of.product] += power - ends.power_of_bushings[of.element]


@compile_kernel
def _rotational(ends, packed):
    """Go back through rotational springs."""
    for i in range(len(packed.rows)):
        c = packed.rows[i]
        a = ends.rows[ends.rotational[i, 0]]
        b = ends.rows[ends.rotational[i, 1]]
        _on_ground(ends, ZERO3, get9(c.rotation))
        angle, G = twist(get9(a.rotation), get9(b.rotation), get3(c.axis))
        rate = dot3(G, axpy3(get3(b.omega), -1.0, get3(a.omega)))
        _, spring, _ = curve(packed.knots, c.spring[0], c.spring[1], angle - c.free_angle)
        _, damper, _ = curve(packed.knots, c.damper[0], c.damper[1], rate)
        torque = scaled3(spring + damper, G)
        _push(a, ZERO3, torque)
        _push(b, ZERO3, scaled3(-1.0, torque))
        rotational_back(packed.knots, c, a, b)


@compile_kernel
def _points(ends, packed, tables, t):
    """Go back through forces on interfaces."""
    for i in range(len(packed)):
        c, a = packed[i], ends.rows[ends.points[i, 0]]
        f = value(tables, c.force[0], t), value(tables, c.force[1], t), value(tables, c.force[2], t)
        m = value(tables, c.torque[0], t), value(tables, c.torque[1], t), value(tables, c.torque[2], t)
        if c.follows:
            f, m = times(get9(a.rotation), f), times(get9(a.rotation), m)
            follower_back(f, m, a)
        _push(a, f, m)
