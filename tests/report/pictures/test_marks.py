"""Names of interfaces: beside the part, inside the picture, apart from each other."""

import numpy as np
import pytest

from modalprep.report.pictures.body_parts import label_shifts
from modalprep.report.pictures.marks import FONT, HEIGHT, WIDTH, pixels
from modalprep.report.pictures.render import framed_plotter
from modalprep.report.scene.record import scene_of

SIZE = (1000, 750)


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("name", ["cantilever", "block", "frame"])
def test_names_cover_nothing_of_the_body(name, request):
    body = scene_of(request.getfixturevalue(name))
    plotter = framed_plotter(body, SIZE, body.points, None, text=False)
    shifts = label_shifts(plotter, body, [body.points], body.interface_position)
    middles = pixels(plotter, body.interface_position) + shifts
    nodes = pixels(plotter, body.points)
    plotter.close()
    half = [np.array([WIDTH * len(words), HEIGHT]) * FONT / 2 for words in body.interface_name]
    for middle, size in zip(middles, half, strict=True):
        assert (middle - size >= 0).all()
        assert (middle + size <= SIZE).all()
        assert not (np.abs(nodes - middle) < size).all(axis=1).any()
    apart = np.abs(middles[0] - middles[-1])
    assert (apart > half[0] + half[-1]).any()


@pytest.mark.usefixtures("drawing")
def test_pixels_are_those_of_the_picture(cantilever):
    """The middle of the picture is the camera's focal point, and a parallel scale is half of its height."""
    plotter = framed_plotter(scene_of(cantilever), SIZE, cantilever.points, None, text=False)
    focus, up = np.array(plotter.camera.focal_point), np.array(plotter.camera.up)
    found = pixels(plotter, np.array([focus, focus + plotter.camera.parallel_scale * up]))
    plotter.close()
    np.testing.assert_allclose(found, [[500, 375], [500, 0]], atol=1e-6)  # pixels
