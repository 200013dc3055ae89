"""Pages with nothing but the viewer: of a body, a mesh or a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from modalprep.atomic import write_text
from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.report.body_page.modes import mode_tables
from modalprep.report.body_page.table import part, texts
from modalprep.report.scene.record import Scene
from modalprep.report.viewer.run import run_data
from modalprep.report.viewer.still import ViewerData, scene_data

SPEEDS = (5.0, 20.0, 60.0)  # s, in which a whole run is played


def view_body(body: FlexibleBody, path: str | Path) -> Path:
    """Write a page in which a body is turned and its modes move; a body without modes stays still.

    It is one file that loads nothing from elsewhere, for a browser with WebGL 2.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    RenderError
        When a cell type cannot be drawn.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> page = view_body(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.html")
    >>> "WebGL" in page.read_text(encoding="utf-8")
    True
    """
    scene = scene_data(body)
    if not body.n:
        return _write(path, body.name, f"A rigid body of {body.m:.6g} kg.", scene)
    about = f"Modal body with {body.n} modes, {body.m:.6g} kg."
    return _write(path, body.name, about, scene, table=mode_tables(body)[0].html())


def view_mesh(mesh: Any, path: str | Path) -> Path:
    """Write a page in which a mesh is turned; cells that are points are left out.

    Parameters
    ----------
    mesh : Mesh
        Of `read_mesh`.
    path : path

    Returns
    -------
    Path
        The file.

    Raises
    ------
    RenderError
        When a cell type cannot be drawn.
    """
    return view_still(Scene(name=Path(mesh.source).stem or "mesh", points=mesh.points, cells=mesh.cells), path)


def view_still(drawn: Scene, path: str | Path) -> Path:
    """Write a page in which points, cells and interfaces are turned; cells that are points are left out.

    Raises
    ------
    RenderError
        When a cell type cannot be drawn.
    """
    about = f"{len(drawn.points)} nodes: " + ", ".join(f"{len(nodes)} {kind}" for kind, nodes in drawn.cells.items())
    return _write(path, drawn.name, f"{about}.", scene_data(drawn))


def view_run(system: System | DeployingSystem, result: Result, path: str | Path, *, name: str = "run") -> Path:
    """Write a page in which a run is turned, played and scrubbed through; its notes stand above.

    Parameters
    ----------
    result : Result
        Of a simulation of this system; long ones are shown in 240 frames.
    path : path
    name : str
        Above the view.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the result is not of this system.
    RenderError
        When a cell type cannot be drawn.
    """
    scene = run_data(system, result)
    count = len(scene["bodies"])
    said = f"{count} {'body' if count == 1 else 'bodies'}, {len(result.time)} times: {result.message}."
    return _write(path, name, said, scene, notes=result.notes, speeds=_speeds(scene["seconds"]))


def _speeds(span: float) -> list[tuple[float, str]]:
    """Return the choices of the time that the whole run takes on the screen, with their names; a stretch of 5 first."""
    named = [(seconds, f"all in {seconds:g} s") for seconds in SPEEDS]
    return [*named, (span, "as in reality")] if span > 0 else named


def _write(path: str | Path, name: str, about: str, scene: ViewerData, **values: Any) -> Path:
    given = {"table": "", "notes": (), "speeds": (), "plain": scene.get("plain", False), **values}
    text = part(
        "view.html",
        "view",
        name=name,
        about=about,
        scene=scene,
        style=texts("page.css", "view/view.css"),
        script=texts("viewer.js"),
        **given,
    )
    return write_text(text, path)
