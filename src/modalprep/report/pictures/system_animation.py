"""Films of a simulated system, and pictures of its motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.report.pictures.animation import SIZE, check_target, write_frames
from modalprep.report.pictures.files import save_image, save_picture, shot
from modalprep.report.pictures.render import refuse_drawing
from modalprep.report.scene.style import FilmStyle
from modalprep.report.scene.system import SystemScene

if TYPE_CHECKING:
    from modalprep.report.pictures.system_picture import SystemPicture

FAINT, GHOST = 0.12, 0.25  # opacity of the oldest of several positions in one picture, of the one before in a strip


def animate_system(
    system: System | DeployingSystem,
    result: Result,
    path: str | Path,
    *,
    style: FilmStyle | None = None,
    seconds: float = 5.0,
    frames: int = 60,
    size: tuple[int, int] = SIZE,
) -> Path:
    """Write a run as an animation: every body's mesh with its deflection, interfaces as spheres, time in the corner.

    Deflections are those of the run, to first order in the modal coordinates, coloured by their size. A diverging
    run is shown while deflections are below twice the body size. Rods of a deployment appear when they are out.

    Parameters
    ----------
    result : Result
        Of `simulate` for this system.
    path : path
        A .gif, a .webp, or an .mp4 where the package imageio-ffmpeg is installed.
    style : FilmStyle, optional
        Colour, exaggeration of deflections, trails, camera and title.
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
    return write_frames(_pictures(_scene(system, result, frames, style), size), path, seconds)


def _scene(system: System | DeployingSystem, result: Result, frames: int, style: FilmStyle | None) -> SystemScene:
    scene = SystemScene(system, result, frames, style or FilmStyle())
    refuse_drawing()
    return scene


def _picture(scene: SystemScene, size: tuple[int, int]) -> SystemPicture:
    from modalprep.report.pictures.system_picture import SystemPicture  # loads pyvista, which is optional

    return SystemPicture(scene, size)


def _pictures(scene: SystemScene, size: tuple[int, int]) -> list[np.ndarray]:
    """Return the pictures (height, width, 3)."""
    picture = _picture(scene, size)
    try:
        images = []
        for k in scene.rows:
            picture.place(k)
            images.append(shot(picture.plotter))
        return images
    finally:
        picture.plotter.close()


def render_motion(
    system: System | DeployingSystem,
    result: Result,
    path: str | Path,
    *,
    style: FilmStyle | None = None,
    positions: int = 6,
    size: tuple[int, int] = (1000, 750),
    strip: bool = False,
) -> Path:
    """Draw a run in one picture: the bodies at several times, the earlier the fainter.

    Parameters
    ----------
    result : Result
        Of `simulate` for this system.
    path : path
        A .png or .jpg file.
    style : FilmStyle, optional
        As of `animate_system`; the camera stays.
    positions : int
        Number of times, spread evenly over the run.
    size : (int, int)
        Width and height in pixels, in a strip of each of its pictures.
    strip : bool
        Draw the times side by side, each with the one before it as a ghost.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the result is not of this system, or the file is of another kind.
    RenderError
        When the machine cannot draw.
    """
    if positions < 1:
        raise InputError(f"positions = {positions} must be at least 1")
    style = style or FilmStyle()
    if strip:
        return save_image(_strip(_scene(system, result, positions, style), size), path)
    scene = _scene(system, result, positions, style.with_(follow=""))
    picture = _picture(scene, size)
    faint = np.linspace(FAINT, 0.5, max(1, len(scene.rows) - 1))
    for number, k in enumerate(scene.rows[:-1]):
        picture.place(k, opacity=float(faint[number]), ghost=f" at {number}")
    picture.place(scene.rows[-1], since=scene.rows[0])
    return save_picture(picture.plotter, path)


def _strip(scene: SystemScene, size: tuple[int, int]) -> np.ndarray:
    """Return the pictures side by side, with a line between them."""
    picture = _picture(scene, size)
    images = []
    try:
        for before, k in zip([None, *scene.rows], scene.rows, strict=False):
            if before is not None:
                picture.place(before, opacity=GHOST, ghost=" before")
            picture.place(k)
            images += [shot(picture.plotter), np.full((size[1], 2, 3), 200, dtype=np.uint8)]
        return np.concatenate(images[:-1], axis=1)
    finally:
        picture.plotter.close()
