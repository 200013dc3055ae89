"""Colour by strain energy: high where the body strains, the same on any mesh, refused in a message without it."""

import base64

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import modalprep as mp
from modalprep.cli.commands import app
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.formats.modalfile import write_body
from modalprep.report.pictures import render
from modalprep.report.pictures.animation import animate_mode
from modalprep.report.pictures.sheet import contact_sheet
from modalprep.report.scene.colour import FULL, node_colour
from modalprep.report.viewer.still import scene_data

needs_drawing = pytest.mark.usefixtures("drawing")


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=3, elements=40)


def with_energy(body, energy, volume):
    return body.with_(energy={k: np.asarray(v, dtype=float)[:, None] for k, v in energy.items()}, volume=volume)


def test_bending_beam_strains_at_its_clamp_and_moves_at_its_tip(beam):
    """Density goes with the curvature squared, so the colour with the curvature of the closed form."""
    x = np.linspace(0, 1, 41)
    k = 1.875104068711961
    c = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    curvature = np.cosh(k * x) + np.cos(k * x) - c * (np.sinh(k * x) + np.sin(k * x))
    strain, moved = node_colour(beam, 1, "energy"), node_colour(beam, 1, "displacement")
    middle = (strain < 1) & (curvature > 0.2 * curvature.max())  # towards the tip shear takes over
    ratio = strain[middle] / curvature[middle]
    assert len(ratio) > 20
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=4e-3)
    assert strain.argmax() == 0
    assert strain[-1] < 0.05
    assert moved.argmax() == 40


def test_a_tenth_of_the_energy_lies_where_the_colour_is_full(beam):
    strain = node_colour(beam, 1, "energy")
    own = beam.energy["line"][:, 0]
    full = strain[beam.cells["line"]].max(axis=1) >= 1
    assert 1 - FULL <= own[full].sum() / own.sum() < 1 - FULL + own.max() / own.sum() * 2


def test_equal_strain_has_one_colour_whatever_the_cells(block):
    """Energies in proportion to uneven volumes: the density is the same everywhere."""
    volume = {"tetra10": np.random.default_rng(0).uniform(1, 5, len(block.cells["tetra10"]))}
    body = with_energy(block, {"tetra10": 3 * volume["tetra10"]}, volume)
    used = np.unique(block.cells["tetra10"])
    np.testing.assert_allclose(node_colour(body, 1, "energy")[used], 1.0)


def test_hot_cell_is_where_it_is(frame):
    """Of three types of cells, the energy of one quad colours its corners."""
    energy = {kind: np.zeros(len(nodes)) for kind, nodes in frame.cells.items()}
    energy["quad"][7] = 2.0
    body = with_energy(frame, energy, {kind: np.ones(len(nodes)) for kind, nodes in frame.cells.items()})
    colour = node_colour(body, 1, "energy")
    assert set(np.flatnonzero(colour)) == set(frame.cells["quad"][7])


def test_spring_without_volume_is_seen(frame):
    energy = {kind: np.zeros(len(nodes)) for kind, nodes in frame.cells.items()}
    volume = {kind: np.full(len(nodes), 1e-6) for kind, nodes in frame.cells.items()}
    energy["line"][1], volume["line"], volume["vertex"] = 1.0, np.array([1e-6, 0.0]), np.zeros(1)
    colour = node_colour(with_energy(frame, energy, volume), 1, "energy")
    assert set(np.flatnonzero(colour)) == set(frame.cells["line"][1])
    joint, end = frame.cells["line"][1]  # where a cell of that volume follows, and where nothing does
    assert (colour[joint] / colour[end]) ** 2 == pytest.approx(1 / 2)


def test_mode_without_strain_is_dark(frame):
    zero = {kind: np.zeros(len(nodes)) for kind, nodes in frame.cells.items()}
    assert not node_colour(with_energy(frame, zero, zero), 1, "energy").any()


def test_only_springs_are_coloured_too(cantilever):
    body = with_energy(cantilever, {"line": np.arange(20.0)}, {"line": np.zeros(20)})
    assert node_colour(body, 1, "energy").argmax() in (19, 20)


@pytest.mark.parametrize(
    "draw",
    [
        lambda body, folder: render.render_mode(body, 1, folder / "a.png", colour="energy"),
        lambda body, folder: animate_mode(body, 1, folder / "a.gif", colour="energy"),
        lambda body, folder: contact_sheet(body, folder / "a.png", colour="energy"),
    ],
)
def test_body_without_energy_is_reported(draw, cantilever, tmp_path):
    with pytest.raises(
        InputError, match=r"'cantilever' has no strain energy of its cells.* build it again from its mesh, or"
    ):
        draw(cantilever, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_unknown_colour_is_refused(beam, tmp_path):
    with pytest.raises(InputError, match="colour 'stress' is not one of displacement, energy"):
        render.render_mode(beam, 1, tmp_path / "a.png", colour="stress")


def colours(file):
    with Image.open(file) as image:
        red, green, blue = np.moveaxis(np.asarray(image.convert("RGB")).astype(int), 2, 0)
    rows = slice(int(0.12 * len(red)), int(0.8 * len(red)))
    violet = ((blue > green + 40) & (red > green + 25))[rows]
    yellow = ((green > blue + 80) & (red > blue + 80))[rows]
    return violet, yellow


@needs_drawing
def test_picture_is_yellow_at_the_clamp(beam, tmp_path):
    violet, yellow = colours(render.render_mode(beam, 1, tmp_path / "a.png", colour="energy"))
    assert min(violet.sum(), yellow.sum()) > 300
    assert np.nonzero(yellow)[1].mean() < np.nonzero(violet)[1].mean()


@needs_drawing
def test_animation_and_sheet_are_coloured_by_energy(beam, tmp_path):
    for colour, clamped_end_is_yellow in (("energy", True), ("displacement", False)):
        contact_sheet(beam.with_(name=colour), tmp_path / f"{colour}.png", colour=colour, columns=1)
        violet, yellow = colours(tmp_path / f"{colour}.png")
        half = len(yellow) // 4  # the first tile
        assert (np.nonzero(yellow[:half])[1].mean() < np.nonzero(violet[:half])[1].mean()) == clamped_end_is_yellow
    with Image.open(animate_mode(beam, 1, tmp_path / "a.gif", colour="energy", frames=4)) as image:
        image.seek(1)
        image.convert("RGB").save(tmp_path / "frame.png")
    violet, yellow = colours(tmp_path / "frame.png")
    assert np.nonzero(yellow)[1].mean() < np.nonzero(violet)[1].mean()


@needs_drawing
@pytest.mark.parametrize("options", [["--mode", "2"], ["--sheet"]])
def test_command_takes_the_colour(beam, options, tmp_path):
    body, pictures = write_body(beam, tmp_path / "beam.h5"), []
    for colour in ("displacement", "energy"):
        target = tmp_path / f"{colour}.png"
        done = CliRunner().invoke(app, ["render", str(body), *options, "--colour", colour, "-o", str(target)])
        assert done.exit_code == 0, done.output
        pictures.append(target.read_bytes())
    assert pictures[0] != pictures[1]


def test_scene_holds_the_strain_of_its_nodes(beam, cantilever):
    data = scene_data(beam)
    assert list(data["colours"]) == ["displacement", "energy"]
    for k, mode in enumerate(data["modes"]):
        strain = np.frombuffer(base64.b64decode(mode["energy"]), dtype="u1") / 255
        np.testing.assert_allclose(strain[:41], node_colour(beam, k + 1, "energy"), atol=0.5 / 255)
        assert not strain[41:].any()  # the interfaces have their own colour
    without = scene_data(cantilever)
    assert list(without["colours"]) == ["displacement"]
    assert without["modes"][0]["energy"] == ""


def test_body_of_other_modes_loses_its_energy(beam):
    from modalprep.reduction.projected import projected_basis, reduced_body

    smaller = reduced_body(beam, projected_basis(np.eye(3)[:, :2], np.diag(beam.K), np.eye(3)))
    assert smaller.energy == {}
    assert mp.body.FlexibleBody.conventional(beam).energy
