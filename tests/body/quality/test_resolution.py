"""Meshes that are too coarse for their modes are told where their frequencies are off, and only there."""

import numpy as np
import pytest
from structured import surface

import modalprep as mp
from modalprep.examples import cantilever_model

OFF, WELL = 0.06, 0.02  # frequencies that are further off are told; those that are closer are not


def told(body):
    return [note for note in body.notes if "too coarse" in note]


def beam(elements):
    model = cantilever_model(elements=elements)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=min(6, 5 * elements), truncation=()), name="beam")


def plate(kind, nx, ny):
    points, cells = surface(nx, ny, kind, lambda s, t: np.stack([1.0 * s, 0.5 * t, 0 * s]))
    root = np.flatnonzero(points[:, 0] < 1e-9)
    mesh = mp.fe.Mesh(
        points=points, cells={kind: cells, "vertex": root[:, None]},
        groups={"plate": {kind: np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}},
    )  # fmt: skip
    shell = {"plate": mp.Shell(material=mp.Material(E=7e10, nu=0.3, rho=2700.0), thickness=0.01)}
    model = mp.assemble(mesh, shell, {"root": mp.Interface(group="root", kind="rbe2", position=(0, 0.25, 0))})
    return mp.flexible_body(model, mp.craig_bampton(model, modes=5, truncation=()), name="plate")


@pytest.mark.parametrize("elements", [1, 2, 3, 6, 12])
def test_beams_against_a_fine_mesh(elements):
    coarse, fine = beam(elements), beam(40)
    error = np.abs(coarse.frequency / fine.frequency[: coarse.n] - 1).max()
    assert bool(told(coarse)) or error < OFF
    assert not told(coarse) or error > WELL


@pytest.mark.parametrize("kind", ["triangle", "quad", "quad8"])
@pytest.mark.parametrize("cells", [(2, 1), (8, 4)])
def test_plates_against_a_fine_mesh(kind, cells):
    coarse, fine = plate(kind, *cells), plate("quad8", 10, 5)
    error = np.abs(coarse.frequency / fine.frequency - 1).max()
    assert bool(told(coarse)) == (error > WELL)


def test_a_shaft_that_twists_is_not_taken_for_a_coarse_mesh():
    """Its nodes do not move sideways, so that any slope is large beside their displacement."""
    x = np.linspace(0.0, 1.0, 11)
    mesh = mp.fe.Mesh(
        points=np.stack([x, 0 * x, 0 * x], axis=1),
        cells={"line": np.stack([np.arange(10), np.arange(1, 11)], axis=1), "vertex": np.array([[0]])},
        groups={"shaft": {"line": np.arange(10)}, "root": {"vertex": np.array([0])}},
    )
    rod = mp.fe.beam_section("rod", mp.Material(E=2e11, nu=0.3, rho=7800.0), diameter=0.3)
    model = mp.assemble(mesh, {"shaft": rod}, {"root": mp.Interface(group="root", kind="node")})
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=3, truncation=()), name="shaft")
    assert body.mode_names[2] == "1st rotation in place"
    assert not told(body)
