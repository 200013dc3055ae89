"""Pictures of a run by pyvista: bodies with their deflections, interfaces, trails, time, colour bar."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista

from modalprep.report.pictures.body_parts import BODY_COLOUR
from modalprep.report.pictures.camera import look
from modalprep.report.pictures.marks import BALL, MARK, QUIET, add_lines, add_unit_bar, spheres
from modalprep.report.pictures.render import empty_plotter
from modalprep.report.pictures.system_parts import bodies_at, boxes_at, put
from modalprep.report.scene.camera import viewpoint
from modalprep.report.scene.system import SystemScene

GROUND_COLOUR, PATH, TRAIL = "#5b7486", "#c3ccd4", "#0072B2"
MANY = 12  # bodies, from which on the marks are smaller
SHADE = {"smooth_shading": True, "ambient": 0.25, **QUIET}


class SystemPicture:
    """A plotter that sees the whole motion of a scene, with the parts that do not move.

    Parameters
    ----------
    scene : SystemScene
    size : (int, int)
        Width and height in pixels.
    """

    def __init__(self, scene: SystemScene, size: tuple[int, int], *, off_screen: bool = True) -> None:
        self.scene = scene
        self.plotter: Any = empty_plotter(size, off_screen=off_screen)
        seen = scene.seen()
        look(self.plotter, seen, *viewpoint(seen, scene.system.gravity))
        camera = self.plotter.camera
        self.camera = np.array(camera.position), np.array(camera.focal_point)
        self.plotter.add_axes(color="black", line_width=3, viewport=(0, 0, 0.14, 0.18))
        crowd = max(0.4, min(1.0, MANY / len(scene.bodies)))
        self.radius = crowd * BALL * camera.parallel_scale
        self._add_ground()
        self._add_paths()

    def _add_ground(self) -> None:
        """Add the joints on the ground."""
        if len(self.scene.ground):
            side = 4 * self.radius
            cube = pyvista.Cube(x_length=side, y_length=side, z_length=side)
            cubes = pyvista.PolyData(self.scene.ground).glyph(geom=cube, scale=False, orient=False)
            self.plotter.add_mesh(cubes, color=GROUND_COLOUR, **QUIET)

    def _add_paths(self) -> None:
        """Add the paths of the bodies that carry no other."""
        if self.scene.style.trails or self.scene.style.follow:
            return
        carriers = {joint.parent.partition(".")[0] for joint in self.scene.system.joints}
        for name, body in self.scene.bodies.items():
            if name not in carriers:
                self._add_path(f"{name}.{body.interface_name[-1]}", self.scene.rows[-1], PATH, 2)

    def _add_path(self, interface: str, k: int, colour: str, width: int) -> None:
        """Add the path of an interface up to a row of the result, where it moves."""
        name, _, end = interface.partition(".")
        path = self.scene.path(name, end)[: k + 1]
        path = path[np.isfinite(path).all(axis=1)]
        if len(path) > 1 and np.ptp(path, axis=0).max() > self.radius:
            line = pyvista.MultipleLines(path)
            self.plotter.add_mesh(line, name=f"path {interface}", color=colour, line_width=width, **QUIET)

    def _add_lines_between(self, k: int, ghost: str, opacity: float) -> None:
        """Draw prismatic joints and springs as lines between their ends."""
        for name, ends in self.scene.lines.items():
            pair = np.array([end[k] for end in ends])
            if np.isfinite(pair).all() and np.ptp(pair, axis=0).max() > self.radius:
                line = {"color": GROUND_COLOUR, "line_width": 2, "opacity": opacity, **QUIET}
                self.plotter.add_mesh(pyvista.Line(*pair), name=f"between {name}{ghost}", **line)

    def place(self, k: int, *, opacity: float = 1.0, ghost: str = "", since: int | None = None) -> None:
        """Add the bodies at a row of the result in place of those of another row, or as a `ghost` beside them.

        `since` is the first row of a picture with several.
        """
        there = [name for name in self.scene.bodies if self.scene.is_out(name, k)]
        coloured = self._add_bodies(there, k, ghost, opacity)
        self._add_interfaces(there, k, ghost, opacity)
        for trail in self.scene.style.trails:
            self._add_path(trail, k, TRAIL, 3)
        self._add_lines_between(k, ghost, opacity)
        self._move_camera(k)
        if coloured and not ghost and not self.plotter.scalar_bars.keys():
            self._add_bar(coloured)
        self._add_text(k, since)

    def _add_bodies(self, there: list[str], k: int, ghost: str, opacity: float):
        """Add the bodies that are there; return the actor that has their colours, if any has."""
        scene = self.scene
        shown = [(scene.skins[n], scene.points(n, k), scene.value(n, k)) for n in there if n not in scene.boxes]
        style = {**SHADE, "color": BODY_COLOUR, "opacity": opacity}
        coloured = None
        for kind, part in bodies_at(shown, self.radius):
            own = style | self._colours() | {"split_sharp_edges": kind == "skin"}
            coloured = put(self.plotter, f"{kind}{ghost}", part, own) or coloured
        boxes = boxes_at([scene.box(name, k) for name in there if name in scene.boxes])
        plain = {"smooth_shading": False, "show_edges": True, "edge_color": GROUND_COLOUR}
        put(self.plotter, f"boxes{ghost}", boxes, style | plain)
        return coloured if self._colours() else None

    def _colours(self) -> dict:
        """Return how the values of the nodes become colours; nothing where all are the same."""
        lowest, largest = self.scene.lowest, self.scene.largest
        scale = {"scalars": "amount", "cmap": "viridis", "clim": (lowest, largest)}
        return scale | {"nan_color": BODY_COLOUR, "show_scalar_bar": False} if largest > lowest else {}

    def _add_interfaces(self, there: list[str], k: int, ghost: str, opacity: float) -> None:
        """Add the interfaces, except those of boxes."""
        places = [self.scene.interfaces(name, k) for name in there if name not in self.scene.boxes]
        balls = spheres(np.concatenate(places), self.radius) if places else None
        put(self.plotter, f"balls{ghost}", balls, {"color": MARK, "ambient": 0.4, "opacity": opacity, **QUIET})

    def _move_camera(self, k: int) -> None:
        """Let the camera follow, and see all depths."""
        camera = self.plotter.camera
        if self.scene.style.follow:
            camera.position, camera.focal_point = (place + self.scene.shift(k) for place in self.camera)
        self.plotter.reset_camera_clipping_range()
        if self.scene.style.follow:  # a path that leads past the camera would move the near plane into the bodies
            camera.clipping_range = (0.01 * camera.distance, 10 * camera.distance)

    def _add_bar(self, coloured) -> None:
        name = self.scene.recovered.name_of_colour if self.scene.recovered else "deflection"
        add_unit_bar(self.plotter, f"{name} ({self.scene.unit})", coloured.mapper)

    def _add_text(self, k: int, since: int | None) -> None:
        style, time = self.scene.style, self.scene.result.time
        times = [self.scene.clock(float(time[row])) for row in (since, k) if row is not None]
        head = [style.title] if style.title else []
        tail = [f"deflections × {style.exaggeration:g}"] if style.exaggeration != 1 else []  # noqa: RUF001
        add_lines(self.plotter, [*head, f"t = {' to '.join(times)}", *tail])
