"""Marks in pictures: interfaces as spheres, with their names where the picture is free, and colour bars."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from modalprep.report.pictures.camera import FRAME
from modalprep.report.scene.record import Scene

BALL = 0.016  # radius of an interface's mark, of half the picture's height
MARK = "#D55E00"
QUIET = {"reset_camera": False, "render": False}  # `shot` draws once, when all parts are there

COARSE = 4  # pixels of the picture in one of the map
FONT = 24
WIDTH, HEIGHT = 0.56, 1.1  # of a letter with its margin, of the font's size
TURNS = np.radians([45, 135, 0, 180, 90, 315, 225, 270, 22, 158, 68, 112, 338, 202])  # the first are preferred
REACH = (0.8, 1.5, 2.5, 3.5, 5, 7, 9)  # distances from the mark, of the height of a label
INK = "#1d2733"


def plainly(text: str) -> str:
    r"""Return a text that VTK writes letter by letter; it reads what stands between two ``$`` as a formula.

    Examples
    --------
    >>> print(plainly("$x$"))
    \$x\$
    """
    return text.replace("$", r"\$")


def add_bar(plotter, words: str) -> None:
    """Add the bar of the colours, from 0 to 1, with its title."""
    plotter.add_scalar_bar(
        words,
        color="black",
        n_labels=2,
        fmt="%.0f",
        vertical=False,
        title_font_size=24,
        label_font_size=24,
        position_x=0.58,
        position_y=0.025,
        width=0.39,
        height=0.085,
    )


def add_unit_bar(plotter, words: str, mapper) -> None:
    """Add the bar of a quantity with a unit to a film, in letters of its size."""
    letters = max(11, plotter.window_size[1] // 27)
    plotter.add_scalar_bar(
        plainly(words),
        mapper=mapper,
        color="black",
        n_labels=2,
        fmt="%.3g",
        vertical=False,
        title_font_size=letters,
        label_font_size=letters,
        position_x=0.5,
        position_y=0.02,
        width=0.42,
        height=0.095,
    )


def add_lines(plotter, lines: list[str]) -> None:
    """Write lines at the top left of a film, in place of earlier ones."""
    actor = plotter.add_text(
        plainly("\n".join(lines)),
        name="time",
        font_size=12,
        color="black",
        render=False,
        position=(0.025, 0.98),
        viewport=True,
    )
    actor.prop.justification_vertical = "top"


def add_interfaces(
    plotter, body: Scene, places: np.ndarray, *, depth: float = 0.0, shifts: np.ndarray | None = None
) -> None:
    """Mark the interfaces by spheres, `depth` (m) before them, and by their names at `shifts` (k, 2) in pixels.

    A bolt's centre lies inside its hole: in the parallel projection the spheres move to the front without other change.
    """
    camera = plotter.camera
    towards = np.array(camera.position) - camera.focal_point
    front = np.array(places, dtype=float) + depth * towards / np.linalg.norm(towards)
    plotter.add_mesh(spheres(front, BALL * camera.parallel_scale), name="balls", color=MARK, ambient=0.4, **QUIET)
    if shifts is not None and len(shifts):
        write(plotter, front, body.interface_name, shifts, QUIET)


def spheres(places: np.ndarray, radius: float):
    """Return a mesh of spheres at points (k, 3)."""
    import pyvista

    return pyvista.PolyData(places).glyph(geom=pyvista.Sphere(radius=radius), scale=False, orient=False)


def beside(plotter, parts: Iterable[np.ndarray], places: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Return the shifts (k, 2) in pixels, right and down, from marks to the middles of their names, out of the body.

    Parameters
    ----------
    plotter
        Its camera sees all, in parallel projection.
    parts : iterable of (n, corners, 3) float
        What is drawn: faces, and lines of two points.
    places : (k, 3) float
        The marks.
    names : sequence of str
    """
    marks = pixels(plotter, places) / COARSE
    taken = _map(plotter, parts)
    for x, y in marks.round().astype(int).tolist():
        taken[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3] = True
    found = [_free(taken, mark, name) for mark, name in zip(marks, names, strict=True)]
    return COARSE * np.array(found).reshape(-1, 2)


def _map(plotter, parts: Iterable[np.ndarray]) -> np.ndarray:
    """Return where the picture is not free (rows from the top, columns), coarsely."""
    from PIL import Image, ImageDraw

    wide, high = (side // COARSE for side in plotter.window_size)
    image = Image.new("1", (wide, high))
    pen = ImageDraw.Draw(image)
    for part in filter(len, parts):
        corners = (pixels(plotter, part.reshape(-1, 3)) / COARSE).reshape(len(part), -1)
        draw = pen.polygon if part.shape[1] > 2 else pen.line
        for row in corners.tolist():
            draw(row, fill=1)
    taken = np.array(image)
    taken[: int((1 - FRAME[3]) * high) + 1] = True  # the title
    taken[int((1 - FRAME[1]) * high) :] = True  # axes and bar
    return taken


def _free(taken: np.ndarray, mark: np.ndarray, name: str) -> np.ndarray:
    """Return the shift to the nearest free place, which is taken then; to the emptiest if there is none."""
    half = np.array([WIDTH * len(name), HEIGHT]) * FONT / COARSE / 2
    shifts = [
        np.array([np.cos(turn), -np.sin(turn)]) * (half + reach * HEIGHT * FONT / COARSE)
        for reach in REACH
        for turn in TURNS
    ]
    best = min(shifts, key=lambda shift: _covered(taken, mark + shift, half))
    _area(taken, mark + best, half)[:] = True
    return best


def _covered(taken: np.ndarray, middle: np.ndarray, half: np.ndarray) -> float:
    """Return the number of points that a label would cover; none is free outside the picture."""
    outside = (middle < half).any() or (middle + half > np.array(taken.shape[::-1])).any()
    return np.inf if outside else float(_area(taken, middle, half).sum())


def _area(taken: np.ndarray, middle: np.ndarray, half: np.ndarray) -> np.ndarray:
    low = np.maximum((middle - half).astype(int), 0)
    high = np.ceil(middle + half).astype(int)
    return taken[low[1] : high[1], low[0] : high[0]]


def pixels(plotter, points: np.ndarray) -> np.ndarray:
    """Return points (n, 3) as pixels (n, 2), from the left and from the top."""
    right, up, size = pixel(plotter)
    apart = np.asarray(points, dtype=float) - np.array(plotter.camera.focal_point)
    return np.column_stack([apart @ right, -(apart @ up)]) / size + np.array(plotter.window_size) / 2


def pixel(plotter) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the unit vectors (3,) to the right and up in the picture, and the size of a pixel in m."""
    camera = plotter.camera
    towards = np.array(camera.position) - camera.focal_point
    right = np.cross(camera.up, towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    return right, up / np.linalg.norm(up), 2 * camera.parallel_scale / plotter.window_size[1]


def write(plotter, places: np.ndarray, names: Sequence[str], shifts: np.ndarray, style: dict) -> None:
    """Write names at `shifts` (k, 2) from their marks, in place of earlier ones, with lines to distant marks."""
    import pyvista

    right, up, size = pixel(plotter)
    middles = places + size * (np.outer(shifts[:, 0], right) - np.outer(shifts[:, 1], up))
    plotter.add_point_labels(
        middles,
        list(map(plainly, names)),
        name="names",
        font_size=FONT,
        text_color=INK,
        shape=None,
        bold=False,
        show_points=False,
        always_visible=True,
        justification_horizontal="center",
        justification_vertical="center",
        **style,
    )
    half = np.array([[WIDTH * len(name), HEIGHT] for name in names]) * FONT / 2
    ends = shifts - np.clip(shifts, -half, half)  # the point of each label's frame that is nearest to its mark
    far = np.linalg.norm(ends, axis=1) > FONT
    if far.any():
        ends = places + size * (np.outer(ends[:, 0], right) - np.outer(ends[:, 1], up))
        lines = pyvista.line_segments_from_points(np.stack([places, ends], axis=1)[far].reshape(-1, 3))
        plotter.add_mesh(lines, name="leaders", color=INK, line_width=1.5, **style)
