"""Pictures of mesh quality: flaws are coloured, also inside the body, and nothing is cut off."""

from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import modalprep as mp
from modalprep.report.pictures import mesh_picture, render
from modalprep.report.pictures.mesh_picture import render_findings

needs_drawing = pytest.mark.usefixtures("drawing")
LEGEND = 0.87  # the strip below holds axes and legend


def finding(severity="error", kind="flaw", count=1, cells=None, nodes=(), edges=()):
    return SimpleNamespace(
        severity=severity, kind=kind, count=count, cells=cells or {}, nodes=np.array(nodes, dtype=int),
        edges=np.array(edges, dtype=int).reshape(-1, 2),
    )  # fmt: skip


def draw(body, findings, file):
    with Image.open(render_findings(body.points, body.cells, findings, file)) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def like(image, severity):
    """Pixels of the colour of a severity, bright or shaded, above the legend."""
    red, green, blue = np.moveaxis(image[: int(LEGEND * len(image))], 2, 0)
    if severity == "error":
        return (red > 90) & (green < 0.35 * red) & (blue < 0.35 * red)
    return (red > 120) & (green > 0.4 * red) & (green < 0.65 * red) & (blue < 0.2 * red)


@needs_drawing
def test_mesh_without_findings_has_no_flaw_and_fills_the_picture(block, tmp_path):
    image = draw(block, [], tmp_path / "m.png")
    assert image.shape == (900, 1200, 3)
    assert not like(image, "error").any()
    assert not like(image, "warning").any()
    rows, columns = (np.flatnonzero((image[60:780].min(axis=2) < 220).any(axis=axis)) for axis in (1, 0))
    assert np.ptp(columns) > 0.6 * 1200 or np.ptp(rows) > 0.6 * 720
    assert columns[0] > 0
    assert columns[-1] < 1199


@needs_drawing
@pytest.mark.parametrize("severity", ["error", "warning"])
def test_cells_inside_are_seen_in_their_colour(block, severity, tmp_path):
    middle = block.points[block.cells["tetra10"]].mean(axis=1)
    inside = int(np.argmin(np.linalg.norm(middle - middle.mean(axis=0), axis=1)))
    seen = like(draw(block, [finding(severity, cells={"tetra10": np.array([inside])})], tmp_path / "m.png"), severity)
    assert seen.sum() > 500
    other = {"error": "warning", "warning": "error"}[severity]
    assert not like(draw(block, [finding(severity, nodes=[0])], tmp_path / "n.png"), other).any()


@needs_drawing
def test_tiny_cells_get_a_marker(cantilever, tmp_path):
    points = np.array(cantilever.points)
    points[11] = points[10]  # element 10 has no length
    body = cantilever.with_(points=points)
    seen = like(draw(body, [finding(cells={"line": np.array([10])})], tmp_path / "m.png"), "error")
    assert seen.sum() > 150
    assert abs(np.nonzero(seen)[1].mean() / 1200 - 0.5) < 0.1  # x = 1 of 2


@needs_drawing
def test_nodes_and_edges_are_marked_over_the_body(block, tmp_path):
    far = int(np.argmax(block.points @ [-0.5, 0.8, -0.55]))  # the corner that the body hides
    assert like(draw(block, [finding("warning", nodes=[far])], tmp_path / "m.png"), "warning").sum() > 80
    ends = block.cells["tetra10"][0, :2]
    edged = finding("warning", cells={"tetra10": np.array([0])}, nodes=ends, edges=[ends])
    assert 80 < like(draw(block, [edged], tmp_path / "e.png"), "warning").sum() < 5000  # a line, not the cell


@needs_drawing
def test_nodes_far_away_and_nowhere_leave_the_picture_as_it_is(block, tmp_path):
    plain = draw(block, [], tmp_path / "m.png")
    points = np.vstack([block.points, [[1e6, 0, 0], [np.nan, 0, 0]]])
    body = block.with_(points=points)
    lone = finding("warning", nodes=[len(points) - 2])
    nowhere = finding("error", nodes=[len(points) - 1])
    image = draw(body, [lone, nowhere], tmp_path / "n.png")
    part = slice(int(0.1 * len(image)), int(0.8 * len(image)))
    assert np.abs(plain[part] - image[part]).mean() < 2


@needs_drawing
def test_legend_names_the_findings_in_their_colours(block, tmp_path):
    few = draw(block, [finding(), finding("warning", "other")], tmp_path / "m.png")[int(LEGEND * 900) :]
    none = draw(block, [], tmp_path / "n.png")[int(LEGEND * 900) :]
    for image, expected in ((few, True), (none, False)):
        red = (image[:, :, 0] > 150) & (image[:, :, 1] < 100) & (image[:, :, 2] < 100)
        assert (red[:, 200:].sum() > 20) == expected
    many = [finding(kind=f"flaw {k}") for k in range(mesh_picture.LEGEND + 5)]
    assert draw(block, many, tmp_path / "l.png").shape == (900, 1200, 3)


@needs_drawing
def test_wrong_suffix_leaves_nothing(block, tmp_path):
    with pytest.raises(mp.InputError, match=r"\.png"):
        render_findings(block.points, block.cells, [], tmp_path / "m.docx")
    assert list(tmp_path.iterdir()) == []


def test_machine_that_cannot_draw_is_reported(block, tmp_path, monkeypatch):
    monkeypatch.setattr(render, "drawing_problem", lambda: "VTK finds no OpenGL")
    with pytest.raises(mp.RenderError, match="no OpenGL"):
        render_findings(block.points, block.cells, [], tmp_path / "m.png")
    assert list(tmp_path.iterdir()) == []
