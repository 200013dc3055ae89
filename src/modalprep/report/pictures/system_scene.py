"""The bodies of a run as a scene: meshes with deflections, interfaces, trails, time, colour bar."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.body.mass import deflected_points
from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.loads import GROUND
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.report.pictures.body_parts import BODY_COLOUR
from modalprep.report.pictures.camera import look, viewpoint
from modalprep.report.pictures.marks import BALL, MARK, QUIET, add_lines, add_unit_bar, spheres
from modalprep.report.pictures.recovered_colour import RecoveredColour
from modalprep.report.pictures.render import empty_plotter
from modalprep.report.pictures.system_parts import (
    FilmStyle,
    bodies_at,
    box_corners,
    boxes_at,
    clock,
    colour_range,
    last_shown,
    lines_between,
    never_out,
    put,
)
from modalprep.report.tables import prefixed
from modalprep.suggest import suggestion

GROUND_COLOUR, PATH, TRAIL = "#5b7486", "#c3ccd4", "#0072B2"
MANY = 12  # bodies, from which on the marks are smaller
SHADE = {"smooth_shading": True, "ambient": 0.25, **QUIET}


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
        self.result, self.style = result, style
        self._refuse()
        coloured = style.colour != "displacement"
        self.recovered = RecoveredColour(self.bodies, result, style.colour) if coloured else None
        self.boxes = {name: box_corners(self.bodies[name].with_(name=name)) for name in style.boxes}
        self.bends = {name: self._deflections(name) for name in self.bodies}
        self.rows = np.unique(np.linspace(0, last_shown(self.bodies, self.bends), frames).round().astype(int))
        amounts = [self._amount(name, k) for name in self.bends for k in self.rows]
        lowest, largest = colour_range([amount for amount in amounts if amount is not None], coloured)
        self.factor, self.unit = prefixed(self.recovered.unit if coloured else "m", max(abs(lowest), largest))
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
        return deflected_points(body, self.result[f"{name}.modal"]) - body.points

    def _amount(self, name: str, k: int) -> np.ndarray | None:
        """Value of each mesh point of a body at a row of the result (n_points,), for its colour; None: grey."""
        if self.recovered is not None:
            return self.recovered.at(name, k)
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
        return np.array([self._path(name, i, k) for i in self.bodies[name].interface_name])

    def _path(self, name: str, interface: str, k: int | slice = slice(None)) -> np.ndarray:
        """Place of an interface at a row of the result (3,), or at all of them (n_times, 3), as it is drawn."""
        place = self.result[f"{name}.{interface}.position"][k]
        return place + self._carried(name, k) + self._more(name, interface, k)

    def _more(self, name: str, interface: str, k: int | slice) -> np.ndarray:
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
        return self._carried(carrier, k) + self._more(carrier, interface, k)

    def _turn(self, name: str, k: int | slice) -> Rotation:
        return Rotation.from_quat(self.result[f"{name}.orientation"][k], scalar_first=True)

    def is_out(self, name: str, k: int) -> bool:
        """Say whether a body is there: rods of a deployment are not while they are stowed."""
        return bool(np.isfinite(self.result[f"{name}.origin"][k]).all())

    def _shift(self, k: int) -> np.ndarray:
        """Travel of the followed body since the first picture (3,)."""
        if not self.style.follow:
            return np.zeros(3)
        origin = self.result[f"{self.style.follow}.origin"]
        return origin[k] - origin[self.rows[0]]

    def stage(self, size: tuple[int, int], *, off_screen: bool = True):
        """Return a plotter that sees the whole motion, with the parts that do not move."""
        plotter = empty_plotter(size, off_screen=off_screen)
        seen = self._seen()
        look(plotter, seen, *viewpoint(seen, self.system.gravity))
        self.camera = np.array(plotter.camera.position), np.array(plotter.camera.focal_point)
        plotter.add_axes(color="black", line_width=3, viewport=(0, 0, 0.14, 0.18))
        crowd = max(0.4, min(1.0, MANY / len(self.bodies)))
        self.radius = crowd * BALL * plotter.camera.parallel_scale
        self._still(plotter)
        return plotter

    def _seen(self) -> np.ndarray:
        """Return every place of the motion (n, 3), as the camera sees it."""
        there = [(name, k) for name in self.bodies for k in self.rows if self.is_out(name, k)]
        found = [f(name, k) - self._shift(k) for name, k in there for f in (self.points, self.interfaces, self.box)]
        still = [self.ground, *(end[self.rows] for ends in self.lines.values() for end in ends)]
        seen = np.concatenate([*([np.zeros((0, 3))] if self.style.follow else still), *found])
        return seen[np.isfinite(seen).all(axis=1)]

    def _still(self, plotter) -> None:
        """Add the fixed parts: joints on the ground, the paths of the bodies that carry no other."""
        import pyvista

        if len(self.ground):
            side = dict.fromkeys(("x_length", "y_length", "z_length"), 4 * self.radius)
            cubes = pyvista.PolyData(self.ground).glyph(geom=pyvista.Cube(**side), scale=False, orient=False)
            plotter.add_mesh(cubes, color=GROUND_COLOUR, **QUIET)
        carry = {joint.parent.partition(".")[0] for joint in self.system.joints}
        shown = not (self.style.trails or self.style.follow)
        for name, body in self.bodies.items():
            if shown and name not in carry:
                self._line(plotter, f"{name}.{body.interface_name[-1]}", self.rows[-1], PATH, 2)

    def _line(self, plotter, interface: str, k: int, colour: str, width: int) -> None:
        """Add the path of an interface up to a row of the result, where it moves."""
        import pyvista

        path = self._path(*interface.split("."))[: k + 1]
        path = path[np.isfinite(path).all(axis=1)]
        if len(path) > 1 and np.ptp(path, axis=0).max() > self.radius:
            line = pyvista.MultipleLines(path)
            plotter.add_mesh(line, name=f"path {interface}", color=colour, line_width=width, **QUIET)

    def _between(self, plotter, k: int, ghost: str, opacity: float) -> None:
        """Draw prismatic joints and springs as lines between their ends."""
        import pyvista

        for name, ends in self.lines.items():
            pair = np.array([end[k] for end in ends])
            if np.isfinite(pair).all() and np.ptp(pair, axis=0).max() > self.radius:
                line = {"color": GROUND_COLOUR, "line_width": 2, "opacity": opacity, **QUIET}
                plotter.add_mesh(pyvista.Line(*pair), name=f"between {name}{ghost}", **line)

    def place(self, plotter, k: int, *, opacity: float = 1.0, ghost: str = "", since: int | None = None) -> None:
        """Add the bodies at a row of the result in place of those of another row, or as a `ghost` beside them.

        `since` is the first row of a picture with several.
        """
        there = [name for name in self.bodies if self.is_out(name, k)]
        coloured = self._bodies(plotter, there, k, ghost, opacity)
        self._marks(plotter, there, k, ghost, opacity)
        for trail in self.style.trails:
            self._line(plotter, trail, k, TRAIL, 3)
        self._between(plotter, k, ghost, opacity)
        self._move(plotter, k)
        if coloured and not ghost and not plotter.scalar_bars.keys():
            self._bar(plotter, coloured)
        self._text(plotter, k, since)

    def _bodies(self, plotter, there: list[str], k: int, ghost: str, opacity: float):
        """Add the bodies that are there; return the actor that has their colours, if any has."""
        shown = [(self.bodies[n], self.points(n, k), self._value(n, k)) for n in there if n not in self.boxes]
        style = {**SHADE, "color": BODY_COLOUR, "opacity": opacity}
        colours = {"scalars": "amount", "cmap": "viridis", "clim": (self.lowest, self.largest)}
        colours |= {"nan_color": BODY_COLOUR, "show_scalar_bar": False}
        parts = bodies_at(shown, self.radius)
        coloured = None
        for kind in ("skin", "beams"):
            own = style | (colours if self.largest > self.lowest else {})
            drawn = put(plotter, f"{kind}{ghost}", parts[kind], own | {"split_sharp_edges": kind == "skin"})
            coloured = drawn if drawn is not None and "scalars" in own else coloured
        put(plotter, f"rods{ghost}", parts["rods"], style)
        boxes = boxes_at([self.box(name, k) for name in there if name in self.boxes])
        flat = {"smooth_shading": False, "show_edges": True, "edge_color": GROUND_COLOUR}
        put(plotter, f"boxes{ghost}", boxes, style | flat)
        return coloured

    def _value(self, name: str, k: int) -> np.ndarray:
        """Values of a body for its colour, in the unit of the bar (n_points,); NaN where it has none."""
        amount = self._amount(name, k)
        return np.full(len(self.bodies[name].points), np.nan) if amount is None else self.factor * amount

    def _marks(self, plotter, there: list[str], k: int, ghost: str, opacity: float) -> None:
        """Add the interfaces, except those of boxes."""
        places = [self.interfaces(name, k) for name in there if name not in self.boxes]
        balls = spheres(np.concatenate(places), self.radius) if places else None
        put(plotter, f"balls{ghost}", balls, {"color": MARK, "ambient": 0.4, "opacity": opacity, **QUIET})

    def _move(self, plotter, k: int) -> None:
        """Let the camera follow, and see all depths."""
        if self.style.follow:
            plotter.camera.position, plotter.camera.focal_point = (at + self._shift(k) for at in self.camera)
        plotter.reset_camera_clipping_range()
        if self.style.follow:  # a path that leads past the camera would move the near plane into the bodies
            away = plotter.camera.distance
            plotter.camera.clipping_range = (0.01 * away, 10 * away)

    def _bar(self, plotter, coloured) -> None:
        name = self.recovered.name_of_colour if self.recovered else "deflection"
        add_unit_bar(plotter, f"{name} ({self.unit})", coloured.mapper)

    def _text(self, plotter, k: int, since: int | None) -> None:
        times = [self.clock(float(self.result.time[row])) for row in (since, k) if row is not None]
        head = [self.style.title] if self.style.title else []
        tail = [f"deflections × {self.style.exaggeration:g}"] if self.style.exaggeration != 1 else []  # noqa: RUF001
        add_lines(plotter, [*head, f"t = {' to '.join(times)}", *tail])
