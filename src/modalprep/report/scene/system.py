"""The bodies of a run at some of its times: their places, deflections and colours, which pictures and pages draw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.body.deflection import mesh_at
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.loads import GROUND
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.report.scene.recovered_colour import RecoveredColour
from modalprep.report.scene.skin import Skin, outer_skin
from modalprep.report.scene.style import (
    FilmStyle,
    box_corners,
    clock,
    colour_range,
    last_shown,
    lines_between,
    never_out,
)
from modalprep.report.tables import prefixed
from modalprep.suggest import suggestion


class SystemScene:
    """The bodies of a run at some of its times.

    Parameters
    ----------
    frames : int
        Number of the times, spread evenly over the run, or over the part of it whose deflections can be shown.

    Raises
    ------
    InputError
        When the result is not of this system, or the style names what is not there.
    """

    def __init__(self, system: System | DeployingSystem, result: Result, frames: int, style: FilmStyle) -> None:
        self.system = system.full() if isinstance(system, DeployingSystem) else system
        self.bodies = {n: b for n, b in self.system.bodies.items() if not never_out(n, system, result)}
        self.result = result
        self.style = style
        self._refuse()
        self.skins = {name: skin_of(body) for name, body in self.bodies.items()}
        coloured = style.colour != "displacement"
        self.recovered = RecoveredColour(self.bodies, result, style.colour) if coloured else None
        self.boxes = {name: box_corners(self.bodies[name].with_(name=name)) for name in style.boxes}
        self.bends = {name: self._deflections(name) for name in self.bodies}
        self.rows = np.unique(np.linspace(0, last_shown(self.bodies, self.bends), frames).round().astype(int))
        amounts = [self._amount(name, k) for name in self.bends for k in self.rows]
        lowest, largest = colour_range([amount for amount in amounts if amount is not None], coloured)
        unit = self.recovered.unit if self.recovered else "m"
        self.factor, self.unit = prefixed(unit, max(abs(lowest), largest))
        self.lowest, self.largest = self.factor * lowest, self.factor * largest
        self.clock = clock(float(result.time[self.rows[-1]]))
        self.lines = dict(lines_between(self.system, result))
        grounded = [joint for joint in self.system.joints if joint.parent == GROUND and joint.type != "free"]
        self.ground = np.array([joint.position for joint in grounded]).reshape(-1, 3)

    def _refuse(self) -> None:
        """Refuse a result of another system, and names that are not there."""
        for name in self.bodies:
            if f"{name}.origin" not in self.result.channels:
                raise InputError(f"the result has no motion of body {name!r}; simulate the same system")
        if self.style.follow and self.style.follow not in self.bodies:
            raise InputError(
                f"follow = {self.style.follow!r} is no body; {suggestion(self.style.follow, self.bodies, 'there are')}"
            )
        known = [f"{name}.{i}" for name, body in self.bodies.items() for i in body.interface_name]
        for box in self.style.boxes:
            if box not in self.bodies:
                raise InputError(f"boxes: {box!r} is no body; {suggestion(box, self.bodies, 'there are')}")
        for trail in self.style.trails:
            if trail not in known:
                raise InputError(f"trail {trail!r} is no interface of a body; {suggestion(trail, known, 'there are')}")

    def _deflections(self, name: str) -> np.ndarray:
        """Displacements of a body's mesh points in its frame (n_times, n_points, 3), with their second order."""
        body = self.bodies[name]
        if not body.n:
            return np.zeros((len(self.result.time), *body.points.shape))
        return mesh_at(body, self.result[f"{name}.modal"]) - body.points

    def _amount(self, name: str, k: int) -> np.ndarray | None:
        """Value of each mesh point of a body at a row of the result (n_points,), for its colour; None: grey."""
        if self.recovered is not None:
            return self.recovered.values(name, k)
        return np.linalg.norm(self.bends[name][k], axis=1) if self.bodies[name].n else None

    def points(self, name: str, k: int) -> np.ndarray:
        """Mesh points of a body at a row of the result, inertial (n_points, 3)."""
        bent = self.bodies[name].points + self.style.exaggeration * self.bends[name][k]
        return self._turn(name, k).apply(bent) + self.result[f"{name}.origin"][k] + self._carried(name, k)

    def box(self, name: str, k: int) -> np.ndarray:
        """Corners of a body's box at a row of the result, inertial (8, 3); none (0, 3) without a box."""
        corners = self.boxes.get(name, np.zeros((0, 3)))
        origin = self.result[f"{name}.origin"][k] + self._carried(name, k)
        return self._turn(name, k).apply(corners) + origin if len(corners) else corners

    def interfaces(self, name: str, k: int) -> np.ndarray:
        """Interfaces of a body at a row of the result, inertial (n_if, 3)."""
        return np.array([self.path(name, i, k) for i in self.bodies[name].interface_name])

    def path(self, name: str, interface: str, k: int | slice = slice(None)) -> np.ndarray:
        """Place of an interface at a row of the result (3,), or at all of them (n_times, 3), as it is drawn."""
        place = self.result[f"{name}.{interface}.position"][k]
        return place + self._carried(name, k) + self._added(name, interface, k)

    def _added(self, name: str, interface: str, k: int | slice) -> np.ndarray:
        """What exaggeration adds to the deflection of an interface, inertial (3,) or (n_times, 3)."""
        more = self.style.exaggeration - 1
        if not (more and self.bodies[name].n):
            return np.zeros(3)
        return more * self._turn(name, k).apply(np.array(self.result[f"{name}.{interface}.deflection"][k]))

    def _carried(self, name: str, k: int | slice) -> np.ndarray:
        """What exaggeration adds to the place of a body, by the deflections of those that carry it."""
        parent = self.system.parent(self.system.carrier(name))
        if parent is None or self.style.exaggeration == 1:
            return np.zeros(3)
        carrier = parent[0]
        interface = self.bodies[parent[0]].interface_name[parent[1]]
        return self._carried(carrier, k) + self._added(carrier, interface, k)

    def _turn(self, name: str, k: int | slice) -> Rotation:
        return Rotation.from_quat(self.result[f"{name}.orientation"][k], scalar_first=True)

    def is_out(self, name: str, k: int) -> bool:
        """Say whether a body is there: rods of a deployment are not while they are stowed."""
        return bool(np.isfinite(self.result[f"{name}.origin"][k]).all())

    def shift(self, k: int) -> np.ndarray:
        """Travel of the followed body since the first picture (3,)."""
        if not self.style.follow:
            return np.zeros(3)
        origin = self.result[f"{self.style.follow}.origin"]
        return origin[k] - origin[self.rows[0]]

    def seen(self) -> np.ndarray:
        """Return every place of the motion (n, 3), as the camera sees it."""
        there = [(name, k) for name in self.bodies for k in self.rows if self.is_out(name, k)]
        found = [f(name, k) - self.shift(k) for name, k in there for f in (self.points, self.interfaces, self.box)]
        still = [self.ground, *(end[self.rows] for ends in self.lines.values() for end in ends)]
        seen = np.concatenate([*([np.zeros((0, 3))] if self.style.follow else still), *found])
        return seen[np.isfinite(seen).all(axis=1)]

    def value(self, name: str, k: int) -> np.ndarray:
        """Values of a body for its colour, in the unit of the bar (n_points,); NaN where it has none."""
        amount = self._amount(name, k)
        return np.full(len(self.bodies[name].points), np.nan) if amount is None else self.factor * amount


def skin_of(body: FlexibleBody) -> Skin:
    """Return the skin of a body; of one without a mesh, rods from its first point to its others."""
    skin = outer_skin(body.points, body.cells)
    if len(skin.triangles) or len(skin.lines):
        return skin
    ends = np.arange(1, len(body.points))
    return replace(skin, lines=np.column_stack([np.zeros_like(ends), ends]))
