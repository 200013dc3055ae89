"""The bodies of a run as a scene: meshes with deflections, interfaces, trails, time, colour bar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import deflected_points
from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.loads import GROUND
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.records import Record
from modalprep.report.pictures.camera import look, viewpoint
from modalprep.report.pictures.marks import BALL, MARK, QUIET, spheres
from modalprep.report.pictures.recovered_colour import RecoveredColour
from modalprep.report.pictures.render import BODY_COLOUR, TUBE, empty_plotter
from modalprep.report.tables import prefixed
from modalprep.suggest import suggestion

SHOWN = 2.0  # deflection in body sizes up to which a diverging run is shown
GROUND_COLOUR, PATH, TRAIL = "#5b7486", "#c3ccd4", "#0072B2"
LINE = 28  # height of a line of text, pixels
SHADE = {"smooth_shading": True, "ambient": 0.25, **QUIET}


@dataclass(frozen=True, eq=False, kw_only=True)
class FilmStyle(Record):
    """How the motion of a system is drawn.

    Attributes
    ----------
    colour : str
        ``displacement``, or a component of a recovery over the mesh, ``<recovery>.<component>`` such as
        ``skin.von_mises``; other parts are then grey.
    exaggeration : float
        Factor of the deflections; the picture states it. Joints come apart in the picture where it is not 1.
    trails : sequence of str
        Interfaces, ``<body>.<interface>``, that draw their path behind them.
    follow : str
        Body that the camera follows; none by default.
    title : str
        In the picture.

    Examples
    --------
    >>> FilmStyle(exaggeration=0.0)
    Traceback (most recent call last):
    modalprep.errors.InputError: exaggeration = 0 must be a positive number
    """

    colour: str = "displacement"
    exaggeration: float = 1.0
    trails: Sequence[str] = ()
    follow: str = ""
    title: str = ""

    def __post_init__(self) -> None:
        """Refuse a factor that hides or turns deflections."""
        if not 0 < self.exaggeration < float("inf"):
            raise InputError(f"exaggeration = {self.exaggeration:g} must be a positive number")


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
        self.bodies = {n: b for n, b in self.system.bodies.items() if not _never_out(n, system, result)}
        self.result, self.style = result, style
        self._refuse()
        coloured = style.colour != "displacement"
        self.recovered = RecoveredColour(self.bodies, result, style.colour) if coloured else None
        self.bends = {name: self._deflections(name) for name in self.bodies}
        self.rows = np.unique(np.linspace(0, _last_shown(self.bodies, self.bends), frames).round().astype(int))
        amounts = [self._amount(name, k) for name in self.bends for k in self.rows]
        lowest, largest = _range([amount for amount in amounts if amount is not None], coloured)
        self.factor, self.unit = prefixed(self.recovered.unit if coloured else "m", max(abs(lowest), largest))
        self.lowest, self.largest = self.factor * lowest, self.factor * largest
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
        return self._turn(name, k).apply(bent) + self.result[f"{name}.origin"][k]

    def interfaces(self, name: str, k: int) -> np.ndarray:
        """Interfaces of a body at a row of the result, inertial (n_if, 3)."""
        more, names = self.style.exaggeration - 1, self.bodies[name].interface_name
        places = np.array([self.result[f"{name}.{i}.position"][k] for i in names])
        if not (more and self.bodies[name].n):
            return places
        bends = np.array([self.result[f"{name}.{i}.deflection"][k] for i in names])
        return places + more * self._turn(name, k).apply(bends)

    def _turn(self, name: str, k: int) -> Rotation:
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
        self.radius = BALL * plotter.camera.parallel_scale
        self._still(plotter)
        return plotter

    def _seen(self) -> np.ndarray:
        """Return every place of the motion (n, 3), as the camera sees it."""
        there = [(name, k) for name in self.bodies for k in self.rows if self.is_out(name, k)]
        found = [f(name, k) - self._shift(k) for name, k in there for f in (self.points, self.interfaces)]
        return np.concatenate([np.zeros((0, 3)) if self.style.follow else self.ground, *found])

    def _still(self, plotter) -> None:
        """Add the fixed parts: joints on the ground, the paths of the outermost interfaces."""
        import pyvista

        if len(self.ground):
            side = dict.fromkeys(("x_length", "y_length", "z_length"), 4 * self.radius)
            cubes = pyvista.PolyData(self.ground).glyph(geom=pyvista.Cube(**side), scale=False, orient=False)
            plotter.add_mesh(cubes, color=GROUND_COLOUR, **QUIET)
        for name, body in self.bodies.items() if not self.style.trails else ():
            self._line(plotter, f"{name}.{body.interface_name[-1]}", self.rows[-1], PATH, 2)

    def _line(self, plotter, interface: str, k: int, colour: str, width: int) -> None:
        """Add the path of an interface up to a row of the result, where it moves."""
        import pyvista

        path = self.result[f"{interface}.position"][: k + 1]
        path = path[np.isfinite(path).all(axis=1)]
        if len(path) > 1 and np.ptp(path, axis=0).max() > self.radius:
            line = pyvista.MultipleLines(path)
            plotter.add_mesh(line, name=f"path {interface}", color=colour, line_width=width, **QUIET)

    def place(self, plotter, k: int, *, opacity: float = 1.0, ghost: str = "", since: int | None = None) -> None:
        """Add the bodies at a row of the result in place of those of another row, or as a `ghost` beside them.

        `since` is the first row of a picture with several.
        """
        coloured = None
        for name in self.bodies:
            drawn = self._body(plotter, name, k, f"{name}{ghost}", opacity)
            coloured = drawn or coloured
        for trail in self.style.trails:
            self._line(plotter, trail, k, TRAIL, 3)
        self._move(plotter, k)
        if coloured and not ghost and not plotter.scalar_bars.keys():
            self._bar(plotter, coloured)
        self._text(plotter, k, since)

    def _body(self, plotter, name: str, k: int, actor: str, opacity: float):
        """Add a body; return the actor that has its colours, if it has any."""
        if not self.is_out(name, k):
            for kind in ("skin", "beams", "rods", "balls"):
                plotter.remove_actor(f"{actor} {kind}", **QUIET)
            return None
        amount, points = self._amount(name, k), self.points(name, k)
        style = {**SHADE, "color": BODY_COLOUR, "opacity": opacity}
        if amount is not None and self.largest > self.lowest:
            amount, clim = self.factor * amount, (self.lowest, self.largest)
            style |= {"scalars": "amount", "cmap": "viridis", "clim": clim, "show_scalar_bar": False}
            style |= {"nan_color": BODY_COLOUR}
        drawn = _add_body(plotter, actor, self.bodies[name], points, amount, self.radius, style)
        balls = spheres(self.interfaces(name, k), self.radius)
        plotter.add_mesh(balls, name=f"{actor} balls", color=MARK, ambient=0.4, opacity=opacity, **QUIET)
        return drawn if "scalars" in style else None

    def _move(self, plotter, k: int) -> None:
        """Let the camera follow, and see all depths."""
        if self.style.follow:
            plotter.camera.position, plotter.camera.focal_point = (at + self._shift(k) for at in self.camera)
        plotter.reset_camera_clipping_range()

    def _bar(self, plotter, coloured) -> None:
        name = self.recovered.name_of_colour if self.recovered else "deflection"
        plotter.add_scalar_bar(
            f"{name}, {self.unit}", mapper=coloured.mapper, color="black", n_labels=2, fmt="%.3g", vertical=False,
            title_font_size=18, label_font_size=18, position_x=0.52, position_y=0.02, width=0.36, height=0.085,
        )  # fmt: skip

    def _text(self, plotter, k: int, since: int | None) -> None:
        begin = "" if since is None else f"{self.result.time[since]:.2f} .. "
        head = [self.style.title] if self.style.title else []
        tail = [f"deflections x {self.style.exaggeration:g}"] if self.style.exaggeration != 1 else []
        lines = [*head, f"t = {begin}{self.result.time[k]:.2f} s", *tail]
        top = 0.98 - LINE * len(lines) / plotter.window_size[1]
        where = {"position": (0.025, top), "viewport": True, "render": False}
        plotter.add_text("\n".join(lines), name="time", font_size=12, color="black", **where)


def _never_out(name: str, system: System | DeployingSystem, result: Result) -> bool:
    """Say whether a body is the massless exit of a deployment, or one of its rods that stays stowed."""
    if not isinstance(system, DeployingSystem) or name in system.bodies:
        return False
    return name in {d.exit_body for d in system.deployments} or f"{name}.origin" not in result.channels


def _last_shown(bodies: dict[str, FlexibleBody], bends: dict[str, np.ndarray]) -> int:
    """Row up to which every body's deflection is less than `SHOWN` of its size."""
    last = len(next(iter(bends.values()))) - 1
    for name, rows in bends.items():
        body = bodies[name]
        most = SHOWN * np.ptp(np.vstack([body.points, body.interface_position]), axis=0).max()
        far = [k for k, bend in enumerate(rows) if not np.abs(bend).max(initial=0.0) <= (most or np.inf)]
        last = min([last, *(k - 1 for k in far[:1])])
    return max(last, 0)


def _range(amounts: list[np.ndarray], signed: bool) -> tuple[float, float]:
    """Return the ends of the colour scale: from 0, unless there are negative values."""
    known = np.concatenate([np.zeros(1), *amounts])
    known = known[np.isfinite(known)]
    return (float(known.min()) if signed else 0.0), float(known.max())


def _add_body(plotter, name: str, body: FlexibleBody, points: np.ndarray, amount, radius: float, style: dict):
    """Add a body in place of its last picture, coloured by its `amount`; return its last actor."""
    from modalprep.report.pictures.surface import surface, tubes

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
