"""Off-screen picture of a mesh with the findings of its quality check."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.fe.mesh.cells import cell_dimension
from modalprep.report.pictures import render
from modalprep.report.pictures.body_parts import BODY_COLOUR
from modalprep.report.pictures.files import save_picture
from modalprep.report.pictures.marks import BALL, spheres
from modalprep.report.scene.record import Scene

BEAM, EDGE = "#5b7486", "#3c4f5b"
COLOURS = {"error": "#d62728", "warning": "#f07f00"}
MATT = {"ambient": 0.4, "diffuse": 0.65}
LIFT = 2e-3  # of the body's depth: offset of edges in front of their faces
SHOWN = 400  # maximum number of markers of one finding
SMALL = 3.0  # radii of a marker: smaller cells get one
ROOM = 0.1  # of the body's size: nodes further outside are not drawn
LEGEND = 9  # maximum number of findings named in the picture


def render_findings(
    points: np.ndarray,
    cells: Mapping[str, np.ndarray],
    findings: Iterable[Any],
    path: str | Path,
    *,
    name: str = "mesh",
    size: tuple[int, int] = (1200, 900),
) -> Path:
    """Draw a mesh with its bad cells and nodes: red for errors, orange for warnings, over the rest of the body.

    Parameters
    ----------
    points : (n_points, 3) float
    cells : {cell type: (n_cells, n_nodes) int}
        meshio's types; points are not drawn, nor cells with nodes without finite position.
    findings : sequence of Finding
        Of `check_mesh`: severity, count, kind, cells (rows of `cells`), edges and nodes are read.
    path : path
        A .png or .jpg file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the file is neither .png nor .jpg.
    RenderError
        When the machine cannot draw.
    """
    findings = list(findings)
    body = _body(name, points, cells)
    plotter = render.framed_plotter(_seen(body), size, body.points[:0], None)
    towards = _towards(plotter, body)
    _add_mesh(plotter, body, towards)
    for finding in sorted(findings, key=lambda f: f.severity, reverse=True):  # errors last, over the warnings
        _add_finding(plotter, body, cells, finding, towards)
    plotter.reset_camera_clipping_range()
    _add_legend(plotter, findings, size)
    return save_picture(plotter, path)


def _body(name: str, points: np.ndarray, cells: Mapping[str, np.ndarray]) -> Scene:
    finite = np.asarray(np.isfinite(points).all(axis=1))
    known = {kind: conn[finite[conn].all(axis=1)] for kind, conn in cells.items() if kind != "vertex"}
    cells = {kind: conn for kind, conn in known.items() if len(conn)}
    return Scene(name=name, points=np.where(finite[:, None], points, 0.0), cells=cells)


def _seen(body: Scene) -> Scene:
    """Return the body with only the nodes that are drawn, for the camera."""
    used = np.unique(np.concatenate([np.zeros(0, dtype=int), *(conn.ravel() for conn in body.cells.values())]))
    points = body.points[used] if len(used) else np.zeros((1, 3))
    return Scene(name=body.name, points=points, cells={})


def _add_mesh(plotter, body: Scene, towards: np.ndarray) -> None:
    from modalprep.report.pictures.surface import segments, surface

    skin = surface(body.skin, body.points)
    beams = segments(body.skin.lines, body.points)
    if skin is not None:
        plotter.add_mesh(skin, color=BODY_COLOUR, **MATT)
        plotter.add_mesh(segments(body.skin.edges, body.points + LIFT * towards), color=EDGE, line_width=1.5)
    if beams is not None:
        ends = np.unique(np.concatenate([body.cells[kind].ravel() for kind in body.cells if cell_dimension(kind) == 1]))
        dots = spheres(body.points[ends] + LIFT * towards, 0.4 * BALL * plotter.camera.parallel_scale)
        plotter.add_mesh(beams, color=BEAM, line_width=4)
        plotter.add_mesh(dots, color=EDGE, **MATT)


def _towards(plotter, body: Scene) -> np.ndarray:
    """Return the vector to the camera with the length of the body's depth.

    In the parallel projection a defect inside the body can be moved along it to the front without visible change.
    """
    camera = plotter.camera
    direction = np.array(camera.position) - camera.focal_point
    direction /= np.linalg.norm(direction)
    depth = np.ptp(_seen(body).points @ direction) + camera.parallel_scale
    camera.position = tuple(np.array(camera.focal_point) + 20 * depth * direction)
    return depth * direction


def _add_finding(plotter, body: Scene, cells: Mapping[str, np.ndarray], finding, towards: np.ndarray) -> None:
    """Draw the edges of a finding, or its cells with markers on the small ones, and its nodes."""
    radius = BALL * plotter.camera.parallel_scale
    error = finding.severity == "error"
    style = {"color": COLOURS[finding.severity], "reset_camera": False, **MATT}
    rows = {} if len(finding.edges) else finding.cells
    bad = _body(body.name, body.points + (2 if error else 1) * towards, {k: cells[k][r] for k, r in rows.items()})
    _add_cells(plotter, bad, style, towards)
    if len(finding.edges):
        bad = _body(body.name, bad.points, {"line": finding.edges})
        _add_cells(plotter, bad, style, towards)
    nodes = np.zeros(0, dtype=int) if finding.cells else _near(body, finding)
    marks = np.concatenate([_small_cells(bad, SMALL * radius), bad.points[nodes]])[:SHOWN]
    if len(marks):
        plotter.add_mesh(spheres(marks + 2 * towards, radius * (1.2 if error else 0.9)), **style)


def _add_cells(plotter, bad: Scene, style: dict[str, Any], towards: np.ndarray) -> None:
    from modalprep.report.pictures.surface import segments, surface

    skin = surface(bad.skin, bad.points)
    beams = segments(bad.skin.lines, bad.points)
    if skin is not None:
        plotter.add_mesh(skin, **style)
        lifted = segments(bad.skin.edges, bad.points + LIFT * towards)
        plotter.add_mesh(lifted, color="black", line_width=1.5, reset_camera=False)
    if beams is not None:
        plotter.add_mesh(beams, line_width=8, **style)


def _small_cells(bad: Scene, limit: float) -> np.ndarray:
    """Return the centres of cells too thin or too short to be visible."""
    found = [np.zeros((0, 3))]
    for kind, conn in bad.cells.items():
        corners = bad.points[conn]
        extent = np.linalg.svd(corners - corners.mean(axis=1, keepdims=True), compute_uv=False)
        second = extent[:, 0 if cell_dimension(kind) == 1 else 1]
        found.append(corners.mean(axis=1)[second < limit / 2])
    return np.concatenate(found)


def _near(body: Scene, finding) -> np.ndarray:
    """Return a finding's nodes without those far outside the body."""
    seen = _seen(body).points
    room = ROOM * np.linalg.norm(np.ptp(seen, axis=0))
    place = body.points[finding.nodes]
    inside = (place >= seen.min(axis=0) - room) & (place <= seen.max(axis=0) + room)
    return finding.nodes[inside.all(axis=1)]


def _add_legend(plotter, findings: list, size: tuple[int, int]) -> None:
    """Name the findings with their colours in the free strip at the bottom, in rows of three."""
    rows = [(f"{f.kind}: {f.count}", COLOURS[f.severity]) for f in findings]
    if len(rows) > LEGEND:
        rows[LEGEND - 1 :] = [(f"and {len(rows) - LEGEND + 1} more", "black")]
    for k, (text, colour) in enumerate(rows or [("no findings", "black")]):
        place = (0.16 + 0.28 * (k % 3), 0.085 - 0.036 * (k // 3))
        plotter.add_text(text, position=place, viewport=True, font_size=size[1] // 65, color=colour)
