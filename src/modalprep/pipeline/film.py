"""Films and pictures of the system of a pipeline file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.formats.resultfile import read_result
from modalprep.pipeline.building.build import made_bodies
from modalprep.pipeline.building.sources import needed_files, output_folder, refuse_overwriting
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.systems.read import read_system
from modalprep.report.pictures.animation import check_target
from modalprep.report.pictures.files import PICTURES
from modalprep.report.pictures.render import PICTURE
from modalprep.report.pictures.system_animation import animate_system, render_motion

if TYPE_CHECKING:
    from modalprep.multibody.deploying.system import DeployingSystem
    from modalprep.multibody.model.system import System
    from modalprep.multibody.results.result import Result
    from modalprep.pipeline.schema.film import FilmTable


def film_pipeline(
    source: Loaded,
    target: Path | None,
    run: Path | None,
    output: Path | None,
    reporter: Reporter,
    positions: int = 6,
    *,
    strip: bool = False,
) -> Path:
    """Draw a finished run of a pipeline file; `target` is an animation, or a picture or strip with several positions.

    Raises
    ------
    InputError
        When there is no such run, or it is not of this system.
    RenderError
        When the machine cannot draw.
    """
    need("pyvista", PICTURE)
    path = source.path
    folder = output_folder(source.path, output)
    if not (source.pipeline.simulation or run):
        raise InputError(f"{path} has no [simulation], so there is no run to draw; name one with --run")
    run = run or folder / f"{path.stem}-run.h5"
    target = target or folder / f"{path.stem}.webp"
    if target.suffix.lower() not in PICTURES:
        check_target(target)
        if strip:
            raise InputError(f"--strip draws a picture, and {target} is none; name one of {', '.join(PICTURES)} by -o")
    refuse_overwriting([target], [run, *needed_files(source), *made_bodies(source, output)])
    result = read_result(run)
    system = read_system(source, output, reporter)
    return draw_film(source.pipeline.film, system, result, target, positions, strip=strip)


def draw_film(
    table: FilmTable,
    system: System | DeployingSystem,
    result: Result,
    target: Path,
    positions: int = 6,
    *,
    strip: bool = False,
) -> Path:
    """Draw a run as the table says: an animation, or in a picture by its suffix.

    Raises
    ------
    InputError
        When the result is not of this system, or the table names what is not there.
    RenderError
        When the machine cannot draw.
    """
    style = table.style()
    size = table.size[0], table.size[1]
    if target.suffix.lower() in PICTURES:
        return render_motion(system, result, target, style=style, positions=positions, size=size, strip=strip)
    return animate_system(system, result, target, style=style, seconds=table.seconds, frames=table.frames, size=size)
