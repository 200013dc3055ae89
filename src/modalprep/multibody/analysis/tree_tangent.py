"""Derivatives of the inverse dynamics of a tree, by the compiled sweeps of kernels/tangents (theory 5.8).

What acts on links and interfaces is added between the two sweeps.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.elements.dense import BodyState, Frame, Point, Scene
from modalprep.multibody.elements.slopes import BodySlopes, EndSlopes, turning
from modalprep.multibody.kernels.tangents.frames import end_curvature, end_frame, link_frame
from modalprep.multibody.kernels.tangents.from_state import tangents_from_state
from modalprep.multibody.kernels.tangents.inward import inward_tangents
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.tangents.spatial import Tangents, motion_cross, shift, turned_wrench
from modalprep.vectors import cross, on_both, skew

ORIGIN = np.zeros(3)


class Moving(NamedTuple):
    """A frame: orientation and place (inertial), velocity and acceleration less gravity, and columns; own axes."""

    R: np.ndarray  # (3, 3)
    p: np.ndarray  # (3,)
    V: np.ndarray  # (6,)
    a: np.ndarray  # (6,) rates of the components of V
    columns: np.ndarray  # (6, 4, nu): J, dV by coordinates, b by coordinates, b by speeds; dV by speeds is J

    @property
    def J(self) -> np.ndarray:
        """Twists by the coordinates (6, nu), and velocities by the speeds."""
        return self.columns[:, 0]

    @property
    def V_x(self) -> np.ndarray:
        """Velocities by the coordinates (6, nu)."""
        return self.columns[:, 1]

    def acceleration_slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (6, nu) of the acceleration of the origin, and the angular one, by x and by u."""
        v, w = skew(self.V[:3]), skew(self.V[3:])
        found = self.columns[:, 2].copy(), self.columns[:, 3].copy()
        for slopes, spin in zip(found, (self.V_x[3:], self.J[3:]), strict=True):
            slopes[:3] -= 2 * v @ spin
            slopes[3:] -= w @ spin
        return found


class Seen(NamedTuple):
    """Derivatives (6, nu) of the motion of a frame in inertial axes, relative to the ground.

    By the coordinates J of its place and rotation, `V_x` of its velocity and `a_x` of its acceleration; by the speeds J
    of its velocity and `a_u` of its acceleration.
    """

    J: np.ndarray
    V_x: np.ndarray
    a_x: np.ndarray
    a_u: np.ndarray


class TreeTangent:
    """The tree at a state with accelerations: `add` what acts on it, then `finish`.

    Parameters
    ----------
    system : System
        With the masses of the time.
    packed : Packed
        Of that system.
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
        self.data, self.work = packed.work_of(self)
        tangents_from_state(packed.model, self.data, self.work, y, motion, udot, np.empty(nu))
        self.interfaces: dict[tuple[int, int], Moving] = {}
        self.links: dict[int, Moving] = {}
        self.views: dict[tuple[int, int], Seen] = {}
        self.added: Tangents | None = None

    @cached_property
    def spin(self) -> np.ndarray:
        """Angular velocity (3,) of the ground, that of the orbit."""
        return self.data.links["omega"][-1].copy()

    @property
    def sums(self) -> Tangents:
        """What was added, but for what the wrenches of the work do."""
        if self.added is None:
            self.added = _zeros(self.nu)
        return self.added

    def link(self, i: int) -> Moving:
        """Return the motion of a link, in axes of its body."""
        if i not in self.links:
            self.links[i] = self._fixed(i, ORIGIN)
        return self.links[i]

    def interface(self, link: int, node: int) -> Moving:
        """Return the motion of an interface of a link's body, in axes of the interface."""
        if (link, node) not in self.interfaces:
            self.interfaces[link, node] = self._interface(link, node)
        return self.interfaces[link, node]

    def _interface(self, link: int, node: int) -> Moving:
        model = self.packed.model
        if model.links["modes"][link]:
            motion, columns = np.empty(24), np.zeros((6, 4, self.nu))
            end_frame(model, self.data, self.work, link, node, motion, columns)
            return _moving(motion, columns)
        return self._fixed(link, model.interfaces[model.links["first_interface"][link] + node])

    def _fixed(self, link: int, place: np.ndarray) -> Moving:
        motion, columns = np.empty(24), np.zeros((6, 4, self.nu))
        link_frame(self.packed.model, self.data, self.work, link, place, motion, columns)
        return _moving(motion, columns)

    def on_ground(self, position: np.ndarray) -> Moving:
        """Return the motion of a point of the ground."""
        V = np.concatenate([cross(self.spin, position), self.spin])
        a = np.concatenate([-self.packed.model.gravity, ORIGIN])
        return Moving(np.eye(3), position, V, a, np.zeros((6, 4, self.nu)))

    def body_of(self, link: int) -> FlexibleBody:
        """Return the body that a link carries."""
        body = self.packed.links[link].body
        assert body is not None  # massless links have no interfaces
        return self.system.bodies[body]

    def modes(self, link: int) -> slice:
        """Return the speeds of the modes of a link's body."""
        row = self.packed.model.links[link]
        return slice(int(row["uq"]), int(row["uq"] + row["modes"]))

    def add_to_body(self, link: int, force: np.ndarray, columns: np.ndarray) -> None:
        """Add a force (6 + n,) of a link's body at its origin, its axes, and its derivatives (6 + n, 3 nu)."""
        frame = self.link(link)
        modes = self.modes(link)
        self._add(frame, columns[:6])
        self._pull(link, frame.R, force[:6])
        self.sums.force[modes] += force[6:]
        self.sums.size[modes] += np.abs(force[6:])
        for part, own in zip(self._parts, np.hsplit(columns[6:], 3), strict=True):
            part[modes] += own

    def add_to_interface(self, link: int, node: int, wrench: np.ndarray, columns: np.ndarray) -> None:
        """Add a wrench (6,) on an interface, its axes, and its derivatives (6, 3 nu)."""
        frame, own = self.interface(link, node), self.link(link)
        self._add(frame, columns)
        self._on_modes(link, node, wrench)
        self._pull(link, own.R, _at_link(own, frame, wrench))

    def _on_modes(self, link: int, node: int, wrench: np.ndarray) -> None:
        """Add what a wrench, axes of the interface, does on the modes, which turn their own partial velocities."""
        modes, model = self.modes(link), self.packed.model
        if model.modal is None or modes.stop == modes.start:
            return
        frame, own = self.interface(link, node), self.link(link)
        partial = frame.J[:, modes]
        self.sums.force[modes] += partial.T @ wrench
        self.sums.size[modes] += np.abs(partial).T @ np.abs(wrench)
        out = np.zeros((modes.stop - modes.start, model.modal.K.shape[1]))
        base = self.data.links["orientation"][link].reshape(3, 3)
        end_curvature(model, self.data, self.work, link, node, on_both(base.T @ frame.R) @ wrench, out)
        self.sums.K[modes, modes] += out[:, : len(out)]
        self.sums.K[:, modes] += own.J.T @ _at_link(own, frame, turned_wrench(wrench) @ partial)

    @property
    def _parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.sums.K, self.sums.D, self.sums.M

    def _add(self, frame: Moving, columns: np.ndarray) -> None:
        """Add what the changes (6, 3 nu) of a wrench on a frame do."""
        own = frame.J.T
        for part, change in zip(self._parts, np.hsplit(columns, 3), strict=True):
            part += own @ change

    def _pull(self, link: int, R: np.ndarray, wrench: np.ndarray) -> None:
        """Add a wrench (6,), axes R, that turns with a link at its origin."""
        row = self.work.frames[link]
        row["wrench"] += on_both(R) @ wrench
        row["sizes"] += np.abs(on_both(R)) @ np.abs(wrench)

    @cached_property
    def scene(self) -> Scene:
        """What elements read: motion relative to the ground; `c` of bodies and points is their acceleration."""
        states = {link.body: self._seen(i) for i, link in enumerate(self.packed.links) if link.body}
        return Scene(self.system, states, self._point, self.t)

    def _seen(self, i: int) -> BodyState:
        frame, row = self.link(i), self.packed.model.links[i]
        first, n = int(row["xq"]), int(row["modes"])
        q, qd = self.y[first : first + n], self.y[self.packed.nx :][self.modes(i)]
        V = frame.V - self._carried(frame)
        A = frame.a + np.concatenate([cross(frame.V[3:], frame.V[:3]), ORIGIN])
        return BodyState(frame.R, frame.p, V, frame.J, A, self.body_of(i), q, qd, self.modes(i))

    def _carried(self, frame: Moving) -> np.ndarray:
        """Return the velocity (6,) of the ground where a frame is, in its axes."""
        return np.concatenate([frame.R.T @ cross(self.spin, frame.p), frame.R.T @ self.spin])

    def _point(self, body: str, node: int) -> Point:
        frame = self.interface(self.packed.link_of(body), node)
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
        if np.any(slope):
            for matrix, own in zip((self.sums.K, self.sums.D), slope, strict=True):
                matrix[np.diag_indices(self.nu)] -= own

    def _add_ends(self, load: EndSlopes) -> None:
        ends = [locate(self.system.bodies, end, end) for end in load.ends]
        moving = [k for k, end in enumerate(ends) if end is not None]
        places = [(self.packed.link_of(end[0]), end[1]) for end in ends if end is not None]
        frames = [self.interface(*place) for place in places]
        rows = np.concatenate([np.arange(6 * k, 6 * k + 6) for k in moving])
        pose = np.vstack([on_both(frame.R) @ frame.J for frame in frames])
        rate = np.vstack([on_both(frame.R) @ self.seen_rates(frame) for frame in frames])
        by_pose, by_rate = (each[np.ix_(rows, rows)] for each in (load.by_pose, load.by_rate))
        stiffness = self.sums.stiffness
        stiffness += np.abs(pose).T @ (np.abs(by_pose) @ np.abs(pose))
        columns = np.hstack([by_pose @ pose + by_rate @ rate, by_rate @ pose, np.zeros((len(rows), self.nu))])
        for k, (place, frame) in enumerate(zip(places, frames, strict=True)):
            own = slice(6 * k, 6 * k + 6)
            wrench, back = load.wrench[rows][own], on_both(frame.R.T)
            columns[own, : self.nu] -= turning(wrench)[:, 3:] @ pose[own][3:]
            self.add_to_interface(*place, -back @ wrench, -back @ columns[own])

    def seen(self, link: int, node: int) -> Seen:
        """Return how an interface moves, seen from the ground, which turns with a constant spin."""
        if (link, node) not in self.views:
            self.views[link, node] = self._view(self.interface(link, node))
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
        frame, modes = self.link(i), self.modes(i)
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
        make = np.zeros if self.packed.branches else np.empty  # what speeds of different branches do is not written
        M, D, K = make((3, self.nu, self.nu))
        force, size = np.empty((2, self.nu))
        inward_tangents(self.packed.model, self.data, self.work, K, D, M, force, size)
        found = Tangents(force, M, D, K, size, 0.0)
        return found if self.added is None else Tangents(*map(np.add, found, self.added))


def _zeros(nu: int) -> Tangents:
    M, D, K, stiffness = np.zeros((4, nu, nu))
    return Tangents(np.zeros(nu), M, D, K, np.zeros(nu), stiffness)


def _moving(motion: np.ndarray, columns: np.ndarray) -> Moving:
    return Moving(motion[3:12].reshape(3, 3), motion[:3], motion[12:18], motion[18:], columns)


def _at_link(own: Moving, frame: Moving, wrench: np.ndarray) -> np.ndarray:
    """Return wrenches (6, ...) on a frame of a link, its axes, at the link and in its axes."""
    return shift(own.R.T @ frame.R, own.R.T @ (frame.p - own.p)).T @ wrench
