"""VTU file, read back by meshio and by VTK itself."""

import meshio
import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.formats.vtu import write_vtu


@pytest.fixture(scope="module")
def file(bracket_body, tmp_path_factory):
    return write_vtu(bracket_body, tmp_path_factory.mktemp("vtu") / "bracket.vtu")


def read_by_vtk(file):
    import pyvista  # late: collection would look at all of its names, which loads its plots

    return pyvista.read(file)


def test_meshio_reads_mesh_and_modes(file, bracket_body):
    found = meshio.read(file)
    assert np.array_equal(found.points, bracket_body.points)
    assert {block.type for block in found.cells} == set(bracket_body.cells)
    for block in found.cells:
        assert np.array_equal(block.data, bracket_body.cells[block.type])
    assert len(found.point_data) == bracket_body.n
    for k, (name, field) in enumerate(found.point_data.items()):
        assert name == f"mode_{k + 1:02d}_{bracket_body.frequency[k]:.1f}Hz"
        assert np.array_equal(field, bracket_body.shape[:, :, k])


def test_vtk_reads_the_same(file, bracket_body):
    grid = read_by_vtk(file)
    assert grid.n_points == len(bracket_body.points)
    # volume of the drawing; VTK cuts quadratic cells at their mid-side nodes, the holes by chords
    assert grid.extract_cells(grid.celltypes == 24).volume == pytest.approx(27808.46e-9, rel=5e-3)
    first = grid.point_data[f"mode_01_{bracket_body.frequency[0]:.1f}Hz"]
    assert np.array_equal(first, bracket_body.shape[:, :, 0])


@pytest.mark.parametrize("kind", ["wedge", "hexahedron", "pyramid"])  # meshio 5.3 would write the wedge inside out
def test_cells_are_not_inside_out_in_vtk(kind, tmp_path):
    """A unit cell of each kind: VTK finds its volume positive, so its order of corners is understood."""
    corners = {
        "hexahedron": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
        "wedge": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
        "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]],
    }[kind]
    body = uniform_beam(modes=1)
    n = len(corners)
    body = body.with_(
        points=np.array(corners, dtype=float), cells={kind: np.arange(n)[None]}, shape=np.zeros((n, 3, 1))
    )
    grid = read_by_vtk(write_vtu(body, tmp_path / "cell.vtu"))
    volume = grid.compute_cell_sizes().cell_data["Volume"][0]
    assert volume == pytest.approx({"hexahedron": 1, "wedge": 1 / 2, "pyramid": 1 / 3}[kind], rel=1e-12)


def test_beams_and_many_modes(tmp_path):
    body = uniform_beam(modes=100)
    names = list(meshio.read(write_vtu(body, tmp_path / "beam.vtu")).point_data)
    assert names[0] == "mode_001_0.6Hz"
    assert names == sorted(names)
    assert len(names) == body.n


def test_refusals(tmp_path):
    body = uniform_beam(modes=1)
    rigid = mp.rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    with pytest.raises(mp.InputError, match="body 'rod' has no mesh to write; a VTU file needs one"):
        write_vtu(rigid, tmp_path / "rod.vtu")
    with pytest.raises(mp.InputError, match="body 'rod' has no modes to write on its mesh"):
        write_vtu(rigid.with_(cells=body.cells), tmp_path / "rod.vtu")
    with pytest.raises(mp.InputError, match="cannot write"):
        write_vtu(body, "/proc/no/beam.vtu")
    with pytest.raises(mp.InputError, match="cells that VTK does not know: polygon"):
        write_vtu(body.with_(cells={"polygon": np.zeros((1, 5), dtype=int)}), tmp_path / "broken.vtu")
    assert list(tmp_path.iterdir()) == []
