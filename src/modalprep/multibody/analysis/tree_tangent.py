"""Derivatives of the inverse dynamics of a tree: one sweep of columns outward, one inward (theory 5.8).

A column of a frame says what one coordinate or speed changes by: the twist of the frame, ``J``; the components of its
velocity V; and ``b = da - dV x V`` of those of its acceleration a. Where a joint or an interface has no part in a
change, the columns (J, dV, b) of the next frame are those of the last one, taken to its axes as twists are.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.elements.dense import BodyState, Frame, Point, Scene
from modalprep.multibody.elements.slopes import BodySlopes, EndSlopes, turning
from modalprep.multibody.model.joint_types import KINDS, PRESCRIBED
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.reference.equations import RELATIVE, ground_spin
from modalprep.multibody.tangents.bodies import body_force
from modalprep.multibody.tangents.interfaces import Shapes, curvature, interface_motion
from modalprep.multibody.tangents.spatial import (
    Tangents,
    add_rows,
    carried,
    inertia_columns,
    inward,
    motion_cross,
    shift,
    single_axis_way,
)
from modalprep.vectors import cross, on_both, skew

ONE = np.eye(3)
NONE = np.zeros((6, 0))


class Moving(NamedTuple):
    """A frame: orientation and place (inertial), velocity and acceleration less gravity, and columns; own axes."""

    R: np.ndarray  # (3, 3)
    p: np.ndarray  # (3,)
    V: np.ndarray  # (6,)
    a: np.ndarray  # (6,) rates of the components of V
    columns: np.ndarray  # (6, 4 nu): J, dV by coordinates, b by coordinates, b by speeds; dV by speeds is J

    @property
    def J(self) -> np.ndarray:
        """Twists by the coordinates (6, nu), and velocities by the speeds."""
        return self.part(0)

    @property
    def V_x(self) -> np.ndarray:
        """Velocities by the coordinates (6, nu)."""
        return self.part(1)

    def acceleration_slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (6, nu) of the acceleration of the origin, and the angular one, by x and by u."""
        v, w = skew(self.V[:3]), skew(self.V[3:])
        found = self.part(2).copy(), self.part(3).copy()
        for slopes, spin in zip(found, (self.V_x[3:], self.J[3:]), strict=True):
            slopes[:3] -= 2 * v @ spin
            slopes[3:] -= w @ spin
        return found

    def part(self, k: int) -> np.ndarray:
        """Return part k of the columns (6, nu)."""
        n = self.columns.shape[1] // 4
        return self.columns[:, k * n : (k + 1) * n]


class Seen(NamedTuple):
    """Derivatives (6, nu) of the motion of a frame in inertial axes, relative to the ground.

    By the coordinates J of its place and rotation, `V_x` of its velocity and `a_x` of its acceleration; by the speeds J
    of its velocity and `a_u` of its acceleration.
    """

    J: np.ndarray
    V_x: np.ndarray
    a_x: np.ndarray
    a_u: np.ndarray


class Crossing(NamedTuple):
    """The way from one frame to the next one outward, whose own coordinates are `own`."""

    X: np.ndarray  # (6, 6)
    partial: np.ndarray  # (6, k) axes of the next frame
    own: slice
    shapes: Shapes | None = None  # of an interface of a body with modes


class LinkConstants(NamedTuple):
    """What the way to a link has that does not move; axes of the bodies."""

    parent: int  # link, -1 the ground
    interface: int
    flexible: bool  # whether the parent's interface moves on its body
    file: str  # of `RELATIVE`
    prescribed: bool
    along: float
    about: float
    coordinates: slice
    speeds: slice
    modal: slice  # modal coordinates
    modes: slice  # modal speeds
    base: np.ndarray  # (3, 3) axes of the joint to those of the last frame
    back: np.ndarray  # (3, 3) axes of the link to those of the joint
    arm: np.ndarray  # (3,) from the last frame, its axes
    S: np.ndarray  # (6, k) directions of the joint's rates
    partial: np.ndarray  # (6, k) those of its speeds, none of a prescribed joint


def link_constants(packed: Packed, carried: Sequence[FlexibleBody | None]) -> list[LinkConstants]:
    """Return them of all links; the directions of joints are constant in the axes of their links."""
    found = []
    for i, row in enumerate(packed.model.links):
        kind, parent = KINDS[row["joint"]], int(row["parent"])
        grounded = parent == len(packed.links)
        body = None if grounded else carried[parent]
        flexible = bool(body is not None and body.n)
        align, back = np.eye(3) if grounded else packed.align(parent), packed.align(i).T
        prescribed = row["joint"] == PRESCRIBED
        file = "single_axis" if prescribed else kind.file
        x, u, xq, uq, modes = (int(row[name]) for name in ("x", "u", "xq", "uq", "modes"))
        at_rest = np.array([1.0, 0, 0, 0]) if kind.quaternion == 0 else np.array([0, 0, 0, 1.0, 0, 0, 0])
        S = on_both(back.T) @ RELATIVE[file](row, at_rest, np.zeros(6 if file == "free" else 3)).S
        found.append(
            LinkConstants(
                parent=-1 if grounded else parent,
                interface=int(row["interface"]),
                flexible=flexible,
                file=file,
                prescribed=prescribed,
                along=float(row["along"]),
                about=float(row["about"]),
                coordinates=slice(x, x + kind.coordinates),
                speeds=slice(u, u + kind.speeds),
                modal=slice(xq, xq + modes),
                modes=slice(uq, uq + modes),
                base=align @ row["rotation"].reshape(3, 3),
                back=back,
                arm=np.zeros(3) if flexible else np.array(align @ row["arm"]),
                S=S,
                partial=S[:, : kind.speeds],
            )
        )
    return found


class TreeTangent:
    """The tree at a state with accelerations: `add` what acts on it, then `finish`.

    Parameters
    ----------
    system : System
        With the masses of the time.
    y : (nx + nu,)
        State.
    udot : (nu,)
        Accelerations.
    motion : (nl, 3)
        Position, rate and acceleration of prescribed hinges.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), gravity=np.array([0, -10.0, 0]))
    >>> found = TreeTangent(arm, pack(arm), np.zeros(4), np.zeros(2), np.zeros((1, 3))).finish()
    >>> found.force[:1].round(9), found.M[:1, :1].round(6)
    (array([600.]), array([[400.]]))
    """

    def __init__(
        self, system: System, packed: Packed, y: np.ndarray, udot: np.ndarray, motion: np.ndarray, t: float = 0.0
    ) -> None:
        self.system, self.packed = system, packed
        self.y, self.udot, self.motion, self.t = y, udot, motion, t
        nu = self.nu = packed.nu
        M, D, K, stiffness = np.zeros((4, nu, nu))
        self.found = Tangents(np.zeros(nu), M, D, K, np.zeros(nu), stiffness)
        self.spin = ground_spin(system)
        self.ground = Moving(
            ONE,
            np.zeros(3),
            np.concatenate([np.zeros(3), self.spin]),
            np.concatenate([-system.gravity, np.zeros(3)]),
            np.zeros((6, 4 * nu)),
        )
        self.links: list[Moving] = []
        self.ways: list[tuple[Crossing, ...]] = []
        self.interfaces: dict[tuple[int, int], tuple[Moving, tuple[Crossing, ...]]] = {}
        self.views: dict[tuple[int, int], Seen] = {}
        self.carried = [system.bodies[link.body] if link.body else None for link in packed.links]
        self.constants = packed.kept("ways", lambda: link_constants(packed, self.carried))
        for i in range(len(packed.links)):
            self._outward(i)
        self.wrench = np.zeros((len(self.links), 6))
        self.sizes = np.zeros((len(self.links), 6))  # sums of absolute values
        self.wrench_columns = np.zeros((len(self.links), 6, 3 * nu))  # by coordinates, speeds, accelerations
        for i in range(len(self.links)):
            self._add_inertia(i)

    def _outward(self, i: int) -> None:
        """Find the motion of link i."""
        own = self.constants[i]
        frame, way = (self.ground, ()) if own.parent < 0 else (self.links[own.parent], ())
        if own.flexible:
            frame, way = self.interface(own.parent, own.interface)
        rate, growth = self.y[self.packed.nx :][own.speeds], self.udot[own.speeds]
        x = self.y[own.coordinates]
        if own.prescribed:
            x, rate, growth = (self.motion[i, k : k + 1] for k in range(3))
        if own.file == "single_axis":
            turn, place, X = single_axis_way(own.base, own.back, own.arm, own.along, own.about, float(x[0]))
        else:
            moved = RELATIVE[own.file](self.packed.model.links[i], x, rate)
            turn, place = own.base @ moved.turn @ own.back, own.arm + own.base @ moved.place
            X = shift(turn, place)
        crossing = Crossing(X, own.partial, own.speeds)
        self.links.append(self._moved(frame, turn, place, crossing, own.S @ rate, own.S @ growth))
        self.ways.append((*way, crossing))

    def interface(self, link: int, node: int) -> tuple[Moving, tuple[Crossing, ...]]:
        """Return the motion of an interface of a link's body, in axes of the interface, and the way to it."""
        if (link, node) not in self.interfaces:
            self.interfaces[link, node] = self._interface(link, node)
        return self.interfaces[link, node]

    def _interface(self, link: int, node: int) -> tuple[Moving, tuple[Crossing, ...]]:
        body = self.body_of(link)
        frame = self.links[link]
        if not body.n:
            r = body.interface_position[node]
            crossing = Crossing(shift(ONE, r), NONE, slice(0, 0))
            none = np.zeros(6)
            return self._moved(frame, ONE, r, crossing, none, none), (crossing,)
        at = interface_motion(body, node, self.modal(link))
        crossing = Crossing(shift(at.R, at.r), at.partial, self.constants[link].modes, at.shapes)
        own = at.twist_q, at.rate_q, at.rate_qd
        return self._moved(frame, at.R, at.r, crossing, at.twist, at.rate, own), (crossing,)

    def on_ground(self, position: np.ndarray) -> Moving:
        """Return the motion of a point of the ground."""
        crossing = Crossing(shift(ONE, position), NONE, slice(0, 0))
        return self._moved(self.ground, ONE, position, crossing, np.zeros(6), np.zeros(6))

    def body_of(self, link: int) -> FlexibleBody:
        """Return the body that a link carries."""
        body = self.carried[link]
        assert body is not None  # massless links have no interfaces
        return body

    def modal(self, link: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return q, q' and q'' of a link's body."""
        own = self.constants[link]
        return self.y[own.modal], self.y[self.packed.nx :][own.modes], self.udot[own.modes]

    def _moved(
        self,
        frame: Moving,
        R: np.ndarray,
        r: np.ndarray,
        way: Crossing,
        twist: np.ndarray,
        rate: np.ndarray,
        own: tuple[np.ndarray, ...] | None = None,
    ) -> Moving:
        """Return the frame at the end of a way, with its velocity relative to the last one and the rate of that.

        `own` has the derivatives of these: of the velocity by the coordinates, of the rate by coordinates and speeds.
        """
        S, first = way.partial, way.own.start
        none = np.zeros_like(S)
        found = carried(way.X, frame.V, frame.a, frame.columns, twist, rate, S, first, *(own or (none, none, none)))
        return Moving(frame.R @ R, frame.p + frame.R @ r, *found)

    def _add_inertia(self, i: int) -> None:
        body, frame = self.carried[i], self.links[i]
        if body is None:
            return
        v, w = frame.V[:3], frame.V[3:]
        A = frame.a.copy()
        A[:3] += cross(w, v)
        own = body_force(body, w, A, self.modal(i))
        first = self.constants[i].modes.start
        columns = inertia_columns(frame.V, frame.columns, own.by_spin, own.mass, own.by_q, own.by_qd, first)
        self.add_to_body(i, own.force, columns)

    def add_to_body(self, link: int, force: np.ndarray, columns: np.ndarray) -> None:
        """Add a force (6 + n,) of a link's body at its origin, its axes, and its derivatives (6 + n, 3 nu)."""
        self.wrench[link] += force[:6]
        self.sizes[link] += np.abs(force[:6])
        self.wrench_columns[link] += columns[:6]
        own = force[6:]
        add_rows(self.constants[link].modes.start, own, np.abs(own), columns[6:], self.found)

    def add_to_interface(self, link: int, node: int, wrench: np.ndarray, columns: np.ndarray) -> None:
        """Add a wrench (6,) on an interface, its axes, and its derivatives (6, 3 nu)."""
        _, way = self.interface(link, node)
        self._inward(link, way, wrench, np.abs(wrench), columns)

    def _inward(
        self, link: int, way: tuple[Crossing, ...], w: np.ndarray, size: np.ndarray, columns: np.ndarray
    ) -> None:
        """Take a wrench along a way, from its end, to a link; -1: the ground."""
        for X, S, own, shapes in reversed(way):
            if shapes is not None:
                self.found.K[own, own] += curvature(shapes, w)
            w, size, columns = inward(X, S, own.start, w, size, columns, self.found)
        if link >= 0:
            self.wrench[link] += w
            self.sizes[link] += size
            self.wrench_columns[link] += columns

    @cached_property
    def scene(self) -> Scene:
        """What elements read: motion relative to the ground; `c` of bodies and points is their acceleration."""
        states = {link.body: self._seen(i) for i, link in enumerate(self.packed.links) if link.body}
        return Scene(self.system, states, self._point, self.t)

    def _seen(self, i: int) -> BodyState:
        frame = self.links[i]
        q, qd, _ = self.modal(i)
        V = frame.V - self._carried(frame)
        A = frame.a + np.concatenate([cross(frame.V[3:], frame.V[:3]), np.zeros(3)])
        return BodyState(frame.R, frame.p, V, frame.J, A, self.body_of(i), q, qd, self.constants[i].modes)

    def _carried(self, frame: Moving) -> np.ndarray:
        """Return the velocity (6,) of the ground where a frame is, in its axes."""
        return np.concatenate([frame.R.T @ cross(self.spin, frame.p), frame.R.T @ self.spin])

    def _point(self, body: str, node: int) -> Point:
        frame, _ = self.interface(self.packed.link_of(body), node)
        world = on_both(frame.R)
        V = world @ (frame.V - self._carried(frame))
        return Point(Frame(frame.p, frame.R, V[:3], V[3:]), world @ frame.J, world @ frame.a)

    def add(self, load: EndSlopes | BodySlopes) -> None:
        """Add what an element does."""
        if isinstance(load, EndSlopes):
            self._add_ends(load)
        else:
            self._add_body(load)

    def add_joint_elements(self, slope: np.ndarray) -> None:
        """Add elements of joints by the derivatives (2, nu) of their forces by their own coordinates and speeds.

        The forces themselves are not added.
        """
        for matrix, own in zip((self.found.K, self.found.D), slope, strict=True):
            matrix[np.diag_indices(self.nu)] -= own

    def _add_ends(self, load: EndSlopes) -> None:
        ends = [locate(self.system.bodies, end, end) for end in load.ends]
        moving = [k for k, end in enumerate(ends) if end is not None]
        places = [(self.packed.link_of(end[0]), end[1]) for end in ends if end is not None]
        frames = [self.interface(*place)[0] for place in places]
        rows = np.concatenate([np.arange(6 * k, 6 * k + 6) for k in moving])
        pose = np.vstack([on_both(frame.R) @ frame.J for frame in frames])
        rate = np.vstack([on_both(frame.R) @ self.seen_rates(frame) for frame in frames])
        by_pose, by_rate = (each[np.ix_(rows, rows)] for each in (load.by_pose, load.by_rate))
        self.found.stiffness[:] += np.abs(pose).T @ (np.abs(by_pose) @ np.abs(pose))
        columns = np.hstack([by_pose @ pose + by_rate @ rate, by_rate @ pose, np.zeros((len(rows), self.nu))])
        for k, (place, frame) in enumerate(zip(places, frames, strict=True)):
            own = slice(6 * k, 6 * k + 6)
            wrench, back = load.wrench[rows][own], on_both(frame.R.T)
            columns[own, : self.nu] -= turning(wrench)[:, 3:] @ pose[own][3:]
            self.add_to_interface(*place, -back @ wrench, -back @ columns[own])

    def seen(self, link: int, node: int) -> Seen:
        """Return how an interface moves, seen from the ground, which turns with a constant spin."""
        if (link, node) not in self.views:
            self.views[link, node] = self._view(self.interface(link, node)[0])
        return self.views[link, node]

    def _view(self, frame: Moving) -> Seen:
        world, w = on_both(frame.R), skew(self.spin)
        by_x, by_u = frame.acceleration_slopes()
        A = frame.a + np.concatenate([cross(frame.V[3:], frame.V[:3]), np.zeros(3)])
        J, V_x, a_u = world @ frame.J, world @ self.seen_rates(frame), world @ by_u
        a_x = world @ (by_x + turning(A)[:, 3:] @ frame.J[3:])
        # of the ground's points: w x (w x p + 2 v); a spin relative to it turns with it
        a_x[:3] -= w @ (w @ J[:3] + 2 * V_x[:3])
        a_u[:3] -= 2 * w @ J[:3]
        a_x[3:] -= w @ V_x[3:]
        a_u[3:] -= w @ J[3:]
        return Seen(J, V_x, a_x, a_u)

    def seen_rates(self, frame: Moving) -> np.ndarray:
        """Return how a velocity relative to the ground changes by the coordinates: inertial components in own axes."""
        V = frame.V - self._carried(frame)
        found = frame.V_x - motion_cross(self._carried(frame)) @ frame.J
        return found + turning(V)[:, 3:] @ frame.J[3:]

    def _add_body(self, load: BodySlopes) -> None:
        i = self.packed.link_of(load.body)
        frame, modes = self.links[i], self.constants[i].modes
        n = 6 + modes.stop - modes.start
        by_rate, by_acceleration = (X + np.zeros((n, 6)) for X in (load.by_rate, load.by_acceleration))
        seen = frame.V_x - motion_cross(self._carried(frame)) @ frame.J
        by_x, by_u = frame.acceleration_slopes()
        columns = np.hstack(
            [
                load.by_pose @ frame.J + by_rate @ seen + by_acceleration @ by_x,
                by_rate @ frame.J + by_acceleration @ by_u,
                by_acceleration @ frame.J,
            ]
        )
        columns[:, modes] += load.by_q
        self.add_to_body(i, -load.force, -columns)

    def finish(self) -> Tangents:
        """Return the derivatives of the forces that the accelerations need beyond what was added."""
        for i in range(len(self.links) - 1, -1, -1):
            self._inward(self.constants[i].parent, self.ways[i], self.wrench[i], self.sizes[i], self.wrench_columns[i])
        return self.found
