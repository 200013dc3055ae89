"""Animation of a simulated system as a GIF or an MP4."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import deflected_points
from modalprep.errors import InputError, RenderError
from modalprep.multibody.model.loads import GROUND
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.report.pictures.animation import SIZE, check_target, write_frames
from modalprep.report.pictures.marks import BALL, MARK, QUIET, spheres
from modalprep.report.pictures.recovered_colour import RecoveredColour
from modalprep.report.pictures.render import BODY_COLOUR, TUBE, drawing_problem, shot

FLAT = 0.15  # extent of the motion normal to a plane over that in it, below which the plane is viewed square-on
TILT = 0.1
SHOWN = 2.0  # deflection in body sizes up to which a diverging run is shown
GROUND_COLOUR, PATH = "#5b7486", "#c3ccd4"
STYLE = {"smooth_shading": True, "ambient": 0.25, **QUIET}


def animate_system(
    system: System,
    result: Result,
    path: str | Path,
    *,
    colour: str = "displacement",
    seconds: float = 5.0,
    frames: int = 60,
    size: tuple[int, int] = SIZE,
) -> Path:
    """Write a run as an animation: every body's mesh with its deflection, interfaces as spheres, time in the corner.

    Deflections are those of the run, to first order in the modal coordinates, coloured by their size. A diverging
    run is shown while deflections are below twice the body size.

    Parameters
    ----------
    result : Result
        Of `simulate` for this system.
    path : path
        A .gif, or an .mp4 where the package imageio-ffmpeg is installed.
    colour : str
        ``displacement``, or a component of a recovery over the mesh, ``<recovery>.<component>`` such as
        ``skin.von_mises``; other parts are then grey.
    seconds : float
        Duration, s.
    frames : int
        Number of frames.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the result is not of this system, no body recovers the colour, or the file is of another kind.
    RenderError
        When the machine cannot draw, or cannot write an MP4.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> rod = rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> weld = Joint(name="wall", type="weld", parent="ground", child="rod")
    >>> run = Result(time=np.arange(3.0), channels={}, status="done", message="")
    >>> animate_system(System(bodies={"rod": rod}, joints=(weld,)), run, "run.gif")
    Traceback (most recent call last):
    modalprep.errors.InputError: the result has no motion of body 'rod'; simulate the same system
    """
    path = check_target(path, frames)
    if not 0 < seconds < float("inf"):
        raise InputError(f"seconds = {seconds:g} must be positive")
    refuse_other_system(system, result)
    recovered = None if colour == "displacement" else RecoveredColour(system.bodies, result, colour)
    if problem := drawing_problem():
        raise RenderError(problem)
    film = SystemScene(system, result, frames, recovered)
    return write_frames(film.draw(size), path, seconds)


def refuse_other_system(system: System, result: Result) -> None:
    """Refuse a result that lacks the motion of a body."""
    for name in system.bodies:
        if f"{name}.origin" not in result.channels:
            raise InputError(f"the result has no motion of body {name!r}; simulate the same system")


class SystemScene:
    """The bodies of a run at the times of the frames."""

    def __init__(self, system: System, result: Result, frames: int, recovered: RecoveredColour | None = None) -> None:
        self.system, self.result, self.recovered = system, result, recovered
        bends = {name: self._deflections(name) for name in system.bodies}
        last = _last_shown(system, bends)
        self.rows = np.unique(np.linspace(0, last, frames).round().astype(int))
        self.bends = bends
        amounts = [self._amount(name, k) for name in bends for k in self.rows]
        self.lowest, self.largest = _range([amount for amount in amounts if amount is not None], recovered is not None)
        grounded = [joint for joint in system.joints if joint.parent == GROUND and joint.type != "free"]
        self.ground = np.array([joint.position for joint in grounded]).reshape(-1, 3)

    def _deflections(self, name: str) -> np.ndarray:
        """Displacements of a body's mesh points in its frame (n_times, n_points, 3), with their second order."""
        body = self.system.bodies[name]
        if not body.n:
            return np.zeros((len(self.result.time), *body.points.shape))
        return deflected_points(body, self.result[f"{name}.modal"]) - body.points

    def _amount(self, name: str, k: int) -> np.ndarray | None:
        """Value of each mesh point of a body at a row of the result (n_points,), for its colour; None: grey."""
        if self.recovered is not None:
            return self.recovered.at(name, k)
        return np.linalg.norm(self.bends[name][k], axis=1) if self.system.bodies[name].n else None

    def points(self, name: str, k: int) -> np.ndarray:
        """Mesh points of a body at a row of the result, inertial (n_points, 3)."""
        turn = Rotation.from_quat(self.result[f"{name}.orientation"][k], scalar_first=True)
        return turn.apply(self.system.bodies[name].points + self.bends[name][k]) + self.result[f"{name}.origin"][k]

    def interfaces(self, name: str, k: int) -> np.ndarray:
        """Interfaces of a body at a row of the result, inertial (n_if, 3)."""
        return np.array([self.result[f"{name}.{i}.position"][k] for i in self.system.bodies[name].interface_name])

    def draw(self, size: tuple[int, int]) -> list[np.ndarray]:
        """Return the pictures (height, width, 3)."""
        plotter = self.stage(size)
        try:
            images = []
            for k in self.rows:
                self.place(plotter, k)
                images.append(shot(plotter))
            return images
        finally:
            plotter.close()

    def stage(self, size: tuple[int, int], *, off_screen: bool = True):
        """Return a plotter that sees the whole motion, with the parts that do not move."""
        import pyvista

        from modalprep.report.pictures.camera import look

        plotter = pyvista.Plotter(off_screen=off_screen, window_size=size)
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        seen = np.concatenate([self.ground, *(self.points(n, k) for n in self.bends for k in self.rows),
                               *(self.interfaces(n, k) for n in self.bends for k in self.rows)])  # fmt: skip
        look(plotter, seen, *viewpoint(seen, self.system.gravity))
        plotter.add_axes(color="black", line_width=3, viewport=(0, 0, 0.14, 0.18))
        self.radius = BALL * plotter.camera.parallel_scale
        self._still(plotter)
        return plotter

    def _still(self, plotter) -> None:
        """Add the fixed parts: joints on the ground, the paths of the outermost interfaces, the colour bar."""
        import pyvista

        if len(self.ground):
            cubes = pyvista.PolyData(self.ground).glyph(
                geom=pyvista.Cube(x_length=4 * self.radius, y_length=4 * self.radius, z_length=4 * self.radius),
                scale=False, orient=False,
            )  # fmt: skip
            plotter.add_mesh(cubes, color=GROUND_COLOUR, reset_camera=False)
        for name, body in self.system.bodies.items():
            tip = self.result[f"{name}.{body.interface_name[-1]}.position"][: self.rows[-1] + 1]
            if np.ptp(tip, axis=0).max(initial=0.0) > self.radius:
                plotter.add_mesh(pyvista.MultipleLines(tip), color=PATH, line_width=2, reset_camera=False)

    def place(self, plotter, k: int) -> None:
        """Add the bodies at a row of the result, in place of those of another row."""
        coloured = None
        for name, body in self.system.bodies.items():
            amount = self._amount(name, k)
            drawn = _add_body(
                plotter, name, body, self.points(name, k), amount, (self.lowest, self.largest), self.radius
            )
            coloured = coloured if amount is None else drawn
            balls = spheres(self.interfaces(name, k), self.radius)
            plotter.add_mesh(balls, name=f"{name} balls", color=MARK, ambient=0.4, **QUIET)
        if k == self.rows[0] and self.largest > self.lowest and coloured:
            plotter.add_scalar_bar(
                "deflection, m" if self.recovered is None else self.recovered.label,
                mapper=coloured.mapper, color="black", n_labels=2, fmt="%.3g", vertical=False, title_font_size=18,
                label_font_size=18, position_x=0.52, position_y=0.02, width=0.36, height=0.085,
            )  # fmt: skip
        text = f"t = {self.result.time[k]:.2f} s"
        where = {"position": (0.025, 0.92), "viewport": True, "render": False}
        plotter.add_text(text, name="time", font_size=12, color="black", **where)


def _last_shown(system: System, bends: dict[str, list[np.ndarray]]) -> int:
    """Row up to which every body's deflection is less than `SHOWN` of its size."""
    last = len(next(iter(bends.values()))) - 1
    for name, rows in bends.items():
        body = system.bodies[name]
        most = SHOWN * np.ptp(np.vstack([body.points, body.interface_position]), axis=0).max()
        far = [k for k, bend in enumerate(rows) if not np.abs(bend).max(initial=0.0) <= (most or np.inf)]
        last = min([last, *(k - 1 for k in far[:1])])
    return max(last, 0)


def _range(amounts: list[np.ndarray], signed: bool) -> tuple[float, float]:
    """Return the ends of the colour scale: from 0, unless there are negative values."""
    known = np.concatenate([np.zeros(1), *amounts])
    known = known[np.isfinite(known)]
    return (float(known.min()) if signed else 0.0), float(known.max())


def _add_body(plotter, name: str, body: FlexibleBody, points: np.ndarray, amount, limits, radius: float):
    """Add a body in place of its last frame, coloured by its `amount` between `limits`; returns its actors."""
    from modalprep.report.pictures.surface import surface, tubes

    style = {**STYLE, "color": BODY_COLOUR}
    if amount is not None and limits[1] > limits[0]:
        style = {**STYLE, "scalars": "amount", "cmap": "viridis", "clim": limits, "show_scalar_bar": False}
        style["nan_color"] = BODY_COLOUR
    thick = max(0.5 * radius, TUBE * float(np.ptp(points, axis=0).max()))
    parts = {"skin": surface(body, points, amount), "beams": tubes(body, points, thick, amount)}
    if not any(part is not None for part in parts.values()) and len(points) > 1:
        parts = {"rods": _rods(points, thick)}
    drawn = None
    for kind, part in parts.items():
        if part is not None:
            sharp = {"split_sharp_edges": True} if kind == "skin" else {}
            drawn = plotter.add_mesh(part, name=f"{name} {kind}", **sharp, **style)
    return drawn


def _rods(points: np.ndarray, radius: float):
    """Lines from the first point of a body without a mesh to each other, as tubes."""
    import pyvista

    lines = np.array([[2, 0, k] for k in range(1, len(points))])
    return pyvista.PolyData(points, lines=lines.ravel()).tube(radius=radius, n_sides=16, capping=True)


def viewpoint(seen: np.ndarray, gravity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors (3,) to the camera and up: square to a plane motion, else from a corner; gravity is down.

    Examples
    --------
    >>> plane = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    >>> towards, up = viewpoint(plane, np.array([0, -9.81, 0]))
    >>> bool(towards[2] > 0.9), bool(up[1] > 0.9)
    (True, True)
    """
    from modalprep.report.pictures.camera import upright_camera

    extent, axes = np.linalg.svd(seen - seen.mean(axis=0), full_matrices=False)[1:]
    plane = len(extent) == 3 and extent[2] < FLAT * extent[0]
    normal = axes[-1] * np.sign(axes[-1][np.argmax(np.abs(axes[-1]))])
    down = np.linalg.norm(gravity) > 0
    up = -gravity / np.linalg.norm(gravity) if down else np.array([0.0, 0, 1])
    if plane and abs(up @ normal) > 0.9:  # a plane to stand on
        if not down and abs(normal[2]) > 0.9:
            return upright_camera(normal, np.array([0.0, 1, 0]))
        side = np.eye(3)[np.argmin(np.abs(up))]
        return upright_camera(0.8 * up + 0.6 * np.cross(side, up), up)
    if plane:
        if normal[1] > 0.9:  # x to the right
            normal = -normal
        return upright_camera(normal + TILT * up, up)
    first = np.eye(3)[0] - up[0] * up if abs(up[0]) < 0.9 else np.eye(3)[1]
    return upright_camera(0.5 * first + 0.55 * up - 0.8 * np.cross(up, first), up)
