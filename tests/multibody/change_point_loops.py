"""Random closed loops that pass change points, and the branch that each of them starts on.

The branch is a second implementation: positions of a chain of hinges in numpy, followed by their tangent. Where the
tangent is not unique, at a change point, the one before goes on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from closures import closure_of
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.model.constraints import Closure, Coupler

PLANAR = ("revolute", "spherical", "cylindrical", "universal", "point_on_line", "position", "weld")
ON_A_BODY = ("weld", "prismatic", "planar")  # of a further body, which turns about the hinge at the tip
ARC = 0.02  # rad, between points of the branch
SURE = 3e-3  # m: a smaller singular value does not correct a point, which is near a change point


class Chain(NamedTuple):
    """Hinges of a loop as drawn: a point of each axis, axes, the place that closes the loop, rows that hold it.

    The drawing needs not be a closed position; angles count from it.
    """

    places: np.ndarray  # (n, 3)
    axes: np.ndarray  # (n, 3)
    tip: np.ndarray  # (3,) of the last body
    target: np.ndarray  # (3,)
    rows: np.ndarray  # (k, 3) directions in which the tip stays at the target
    start: np.ndarray  # (n,) angles of a closed position
    closures: tuple[str, ...]  # that close it
    hinge: np.ndarray  # (3,) axis of the hinge that would close it, at the tip
    gear: np.ndarray  # (0 or 1, n) factors of a sum of angles that a coupler keeps


def poses(chain, angles):
    """Return points of the axes, axes (n, 3), the tip (3,) and how the last body is turned, at angles of the hinges."""
    turn, move, places, axes = np.eye(3), np.zeros(3), [], []
    for place, axis, angle in zip(chain.places, chain.axes, angles, strict=True):
        places.append(turn @ place + move)
        axes.append(turn @ axis)
        own = _turned(axis, angle)
        turn, move = turn @ own, turn @ (place - own @ place) + move
    return np.array(places), np.array(axes), turn @ chain.tip + move, turn


def _turned(axis, angle):
    (x, y, z), c, s = axis, np.cos(angle), np.sin(angle)
    return c * np.eye(3) + (1 - c) * np.outer(axis, axis) + s * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def conditions(chain, angles):
    """Return the gaps (k,) and their derivatives by the angles (k, n)."""
    places, axes, tip, _ = poses(chain, angles)
    gap = np.append(chain.rows @ (tip - chain.target), chain.gear @ angles)
    return gap, np.vstack([chain.rows @ np.cross(axes, tip - places).T, chain.gear])


def slopes(chain, angles):
    return conditions(chain, angles)[1]


def branch(chain, along, length):
    """Return points (p, n) of the branch from the start, towards speeds of the first hinges, over a length of these."""
    q, found, m = chain.start, [chain.start], len(along)
    tangent = np.linalg.svd(slopes(chain, q))[2][len(q) - 1]
    tangent *= np.sign(tangent[:m] @ along)
    while length > 0.0:
        further = q + ARC * tangent
        for _ in range(2):
            gap, slope = conditions(chain, further)
            further = further - _inverse(slope) @ gap
        tangent, before = (further - q) / np.linalg.norm(further - q), q
        if len(found) > 1:  # the parabola through three points
            tangent = 1.5 * tangent - 0.5 * (before - found[-2]) / np.linalg.norm(before - found[-2])
        q, length = further, length - np.linalg.norm((further - q)[:m])
        found.append(q)
    return np.array(found)


def _inverse(slope):
    u, sizes, v = np.linalg.svd(slope, full_matrices=False)
    return v[sizes > SURE].T @ (u[:, sizes > SURE] / sizes[sizes > SURE]).T


def distance_from(points, angles):
    """Return how far each of ``angles (k, m)`` is from a line through points (p, n), n >= m, whole turns apart."""
    points = points[:, : angles.shape[1]]
    points, angles = (np.concatenate([np.cos(x), np.sin(x)], axis=1) for x in (points, angles))
    begin, along = points[:-1], np.diff(points, axis=0)
    found = []
    for angle in angles:
        share = np.clip(np.einsum("pi,pi->p", angle - begin, along) / np.einsum("pi,pi->p", along, along), 0, 1)
        found.append(np.linalg.norm(begin + share[:, None] * along - angle, axis=1).min())
    return np.array(found)


def four_bar(rng):
    """Four bars of which two are as long as the other two: all may lie in one line."""
    one, two, three = rng.uniform(0.5, 1.5, 3)
    lengths = rng.permutation([one, two, three, max(one, two) + three - min(one, two)])
    return in_plane(rng, lengths, (*PLANAR, "distance")) or four_bar(rng)


def geared(rng):
    """Five bars, the cranks as long as each other and geared to turn against each other: the whole is a mirror image.

    Where the cranks point away from each other the bars between them come into line, and may go on to either side.
    """
    crank, ground = rng.uniform(0.5, 1.0), rng.uniform(1.0, 2.0)
    rod = crank + ground / 2
    return in_plane(rng, [crank, rod, rod, crank, ground], PLANAR, [[2.0, 1.0, 1.0, 1.0]]) or geared(rng)


def in_plane(rng, lengths, closures, gear=None):
    """Bars in a plane anywhere in space, drawn in one line; the last of the lengths is the ground."""
    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    along = np.append(0.0, np.cumsum(lengths[:-1]))
    places = along[:, None] * turn[:, 0]
    n = len(lengths) - 1
    chain = Chain(
        places[:-1], np.tile(turn[:, 2], (n, 1)), places[-1], lengths[-1] * turn[:, 0], turn[:, :2].T, np.zeros(n),
        closures, turn[:, 2], np.zeros((0, n)) if gear is None else np.array(gear),
    )  # fmt: skip
    return closed(rng, chain)


def on_sphere(rng):
    """Four bars on a sphere, arcs of which two are as long as the other two."""
    one, two, three = rng.uniform(0.4, 1.0, 3)
    arcs = rng.permutation([one, two, three, max(one, two) + three - min(one, two)])
    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    angles = np.append(0.0, np.cumsum(arcs[:-1]))
    axes = (np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])) @ turn.T
    target = turn @ np.array([np.cos(arcs[-1]), np.sin(arcs[-1]), 0.0])
    chain = Chain(
        axes[:-1], axes[:-1], axes[-1], target, np.eye(3), np.zeros(3),
        ("spherical", "position", "revolute", "weld", "distance"), axes[-1], np.zeros((0, 3)),
    )  # fmt: skip
    return closed(rng, chain) or on_sphere(rng)


def goldberg(rng):
    """Goldberg's linkage of five bars (1943), two of Bennett's that share a bar; closed by a ball joint."""
    size = rng.uniform(1.6, 2.4)
    a, b, c = rng.uniform(0.5, 1.5, 3)
    lengths = np.array([a, b, c, a])
    twist = np.arcsin(lengths / size)
    frames, places, axes = np.eye(4), [], []
    for length, bent in zip(lengths, [twist[0], twist[1], twist[2], twist[3]], strict=True):
        places.append(frames[:3, 3].copy())
        axes.append(frames[:3, 2].copy())
        step = np.eye(4)
        step[:3, :3], step[0, 3] = Rotation.from_rotvec([bent, 0, 0]).as_matrix(), length
        frames = frames @ step
    chain = Chain(
        np.array(places), np.array(axes), frames[:3, 3], np.array([-(b + c), 0, 0]), np.eye(3), np.zeros(4),
        ("spherical", "position"), frames[:3, 2], np.zeros((0, 4)),
    )  # fmt: skip
    return closed(rng, chain) or goldberg(rng)


def goldberg_linkage(kind):
    """One of them with masses: bars of 1, 1.4, .7 and 1 m, of twists whose sines are half as large."""
    lengths, sines, place = (1.0, 1.4, 0.7, 1.0), (0.0, 0.5, 0.7, 0.35), [-2.1, 0, 0]
    start = (0.8, -3.3167061132958771, -0.83413136275865885, -6.1080718474735001)
    bodies, joints = {}, []
    for k, (length, sine, angle) in enumerate(zip(lengths, sines, start, strict=True)):
        inertia = np.diag([0.02, 0.02 + 0.1 * length**2, 0.02 + length**2 / 11])
        ends = {"r": np.zeros(3), "e": np.array([length, 0, 0])}
        centre = np.array([length / 2 + 0.02, 0.03, 0.01])
        bodies[f"L{k}"] = mp.rigid_body(f"L{k}", mass=1 + 0.1 * k, centre=centre, inertia=inertia, interfaces=ends)
        bent = {"rotation": ([1.0, 0, 0], np.arcsin(sine)), "axis": np.array([0, -sine, np.sqrt(1 - sine**2)])}
        joints.append(
            mp.Joint(name=f"j{k}", type="revolute", parent=f"L{k - 1}.e" if k else "ground", child=f"L{k}.r",
                     angle=angle, rate=0.0 if k else 1.0, **(bent if k else {}))
        )  # fmt: skip
    both = np.arcsin(0.7) + np.arcsin(0.35)
    hinge = {"axis": np.array([0, np.sin(both), np.cos(both)]), "rotation": ([1.0, 0, 0], -both - np.arcsin(0.5))}
    more = hinge if kind == "revolute" else {}
    pin = Closure(name="pin", type=kind, a="ground", b="L3.e", position=place, **more)
    return mp.System(bodies=bodies, joints=tuple(joints), closures=(pin,), gravity=np.array([1.0, 2, -9]))


def folded_slider(rng):
    """A crank and a rod of the same length: its end on a line through the crank's hinge comes to this hinge."""
    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    length, angle = rng.uniform(0.5, 1.5), rng.uniform(0.3, 1.2) * rng.choice([-1, 1])
    places = np.array([0, length])[:, None] * turn[:, 0]
    start = np.array([angle, -2 * angle])
    return Chain(
        places, turn[:, [2, 2]].T, 2 * places[1], np.zeros(3), turn[:, [1]].T, start,
        ("point_on_plane", "point_on_line", "prismatic", "planar"), turn[:, 2], np.zeros((0, 2)),
    )  # fmt: skip


def closed(rng, chain):
    """A chain with start angles of a closed position that is not near a change point; None where none is found."""
    for _ in range(100):
        start = rng.uniform(-np.pi, np.pi, len(chain.axes))
        found = least_squares(lambda q: conditions(chain, q)[0], start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        sizes = np.linalg.svd(slopes(chain, found.x))[1]
        if np.abs(found.fun).max() < 1e-13 and sizes[len(chain.axes) - 2] > 0.15 * sizes[0]:
            return chain._replace(start=found.x)
    return None


FAMILIES = (four_bar, on_sphere, goldberg, folded_slider, geared, four_bar)


def body(rng, root, tip):
    """Some mass anywhere near two places, in the axes of the drawing."""
    mass, x = rng.uniform(0.1, 0.5, 6), (root + tip) / 2 + rng.standard_normal((6, 3)) * 0.4
    centre = mass @ x / mass.sum()
    second = np.einsum("p,pa,pb->ab", mass, x - centre, x - centre)
    return mp.rigid_body(
        "body", mass=mass.sum(), centre=centre - root, inertia=np.trace(second) * np.eye(3) - second,
        interfaces={"root": np.zeros(3), "tip": tip - root},
    )  # fmt: skip


def system(rng, chain, most=7):
    """The loop with pendulums on its bodies, four to seven bodies in all, and energy enough to go round.

    A pendulum may be geared to the first hinge. A distance is the last of the bars, without mass.
    """
    kind = str(rng.choice(chain.closures))
    n = len(chain.axes) - (kind == "distance")
    ends, turn = [*chain.places[1:], chain.tip], poses(chain, chain.start)[3]
    bodies = {f"b{k}": body(rng, chain.places[k], ends[k]) for k in range(n)}
    rates = rng.uniform(2.0, 4.0) * np.linalg.svd(slopes(chain, chain.start))[2][-1]
    joints = [
        mp.Joint(name=f"j{k}", type="revolute", parent=f"b{k - 1}.tip" if k else "ground", child=f"b{k}",
                 position=np.zeros(3) if k else chain.places[0], axis=chain.axes[k], angle=chain.start[k],
                 rate=rates[k])
        for k in range(n)
    ]  # fmt: skip
    if kind in ON_A_BODY:
        bodies["end"] = body(rng, np.zeros(3), 0.3 * rng.standard_normal(3))
        speed = poses(chain, chain.start)[1].T @ rates @ turn @ chain.hinge
        joints.append(mp.Joint(name="end", type="revolute", parent=f"b{n - 1}.tip", child="end", axis=chain.hinge,
                               rate=-speed))  # fmt: skip
    closures = [_closure(chain, kind, turn, "end.root" if kind in ON_A_BODY else f"b{n - 1}.tip")]
    pendulums = rng.integers(max(0, 4 - len(bodies)), most + 1 - len(bodies))
    for k in range(pendulums):
        bodies[f"p{k}"] = body(rng, np.zeros(3), 0.3 * rng.standard_normal(3))
        joints.append(
            mp.Joint(name=f"h{k}", type="revolute", parent=f"b{rng.integers(n)}.tip", child=f"p{k}",
                     axis=rng.standard_normal(3), rate=rng.uniform(-1, 1))
        )  # fmt: skip
    if len(chain.gear):
        closures.append(Coupler(name="gear", factors={f"j{k}": factor for k, factor in enumerate(chain.gear[0])}))
    elif pendulums and rng.random() < 0.3:
        closures.append(Coupler(name="gear", factors={"j0": rng.uniform(0.5, 2.0), "h0": 1.0}))
    return mp.System(bodies=bodies, joints=tuple(joints), closures=tuple(closures), gravity=rng.standard_normal(3))


def _closure(chain, kind, turn, end):
    axis = turn @ chain.hinge
    if kind in ("prismatic", "planar", "point_on_line", "point_on_plane") and len(chain.rows) == 1:
        axis = chain.rows[0] if kind in ("planar", "point_on_plane") else np.cross(chain.hinge, chain.rows[0])
    place = {"path": tuple(chain.target)} if kind == "position" else {"position": chain.target}
    return closure_of(
        name="pin", type=kind, a="ground", b=end, axis=axis, rotation=turn,
        second_axis=np.cross(chain.hinge, [0.3, -0.5, 0.8]), length=np.linalg.norm(chain.tip - chain.places[-1]),
        **place,
    )  # fmt: skip
