"""Universal file, read back by pyuff, and its mesh by gmsh."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.fe.mesh.cells import CELLS
from modalprep.formats.uff import write_uff

DIGITS = 6e-6  # E13.5


@pytest.fixture(scope="module")
def file(bracket_body, tmp_path_factory):
    return write_uff(bracket_body, tmp_path_factory.mktemp("uff") / "bracket.unv")


@pytest.fixture(scope="module")
def sets(file):
    """Datasets by their number, in order."""
    found = {}
    for data in pytest.importorskip("pyuff").UFF(str(file)).read_sets():
        found.setdefault(int(data["type"]), []).append(data)
    return found


def test_units_and_nodes(sets, bracket_body):
    assert list(sets) == [164, 2411, 2412, 55]
    units, nodes = sets[164][0], sets[2411][0]
    assert (units["units_code"], units["length"], units["force"], units["temp_offset"]) == (1, 1.0, 1.0, 273.15)
    assert np.array_equal(nodes["node_nums"], np.arange(1, len(bracket_body.points) + 1))
    assert np.array_equal(np.stack([nodes[a] for a in "xyz"], axis=1), bracket_body.points)  # seventeen digits


def test_elements_by_their_corners(sets, bracket_body):
    tetra = sets[2412][0][111]
    assert np.array_equal([e["nodes_nums"] for e in tetra], bracket_body.cells["tetra10"][:, :4] + 1)
    assert sum(len(sets[2412][0][d]) for d in sets[2412][0] if isinstance(d, int)) == sum(
        len(nodes) for kind, nodes in bracket_body.cells.items() if kind != "vertex"
    )


def test_modes(sets, bracket_body):
    modes = sets[55]
    assert [m["mode_n"] for m in modes] == list(range(1, bracket_body.n + 1))
    assert {(m["analysis_type"], m["data_ch"], m["spec_data_type"], m["modal_m"]) for m in modes} == {(2, 2, 8, 1.0)}
    np.testing.assert_allclose([m["freq"] for m in modes], bracket_body.frequency, rtol=DIGITS)
    np.testing.assert_allclose([m["modal_damp_vis"] for m in modes], 0.01, rtol=DIGITS)
    for k, m in enumerate(modes):
        assert np.array_equal(m["node_nums"], np.arange(1, len(bracket_body.points) + 1))
        found = np.stack([m["r1"], m["r2"], m["r3"]], axis=1)
        np.testing.assert_allclose(found, bracket_body.shape[:, :, k], rtol=DIGITS, atol=1e-99)


def test_modes_stay_orthonormal(sets, bracket_model):
    """Shapes as read, on the nodes' own mass matrix: six digits in, six digits out."""
    dofs = bracket_model.dof[: len(bracket_model.points), :3].ravel()
    Phi = np.stack([np.stack([m["r1"], m["r2"], m["r3"]], axis=1).ravel() for m in sets[55]], axis=1)
    M = bracket_model.M[dofs][:, dofs]
    np.testing.assert_allclose(Phi.T @ (M @ Phi), np.eye(Phi.shape[1]), atol=2 * DIGITS)


def test_gmsh_reads_the_mesh(file):
    """Volume by linear tetrahedra as gmsh sees them."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(file))
        labels, points, _ = gmsh.model.mesh.getNodes()
        nodes = gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4)
    finally:
        gmsh.finalize()
    order = np.argsort(labels)
    x = points.reshape(-1, 3)[order][np.searchsorted(labels[order], nodes)]
    volume = np.linalg.det(x[:, 1:] - x[:, :1]) / 6
    assert np.all(volume > 0)
    assert volume.sum() == pytest.approx(27808.46e-9, rel=5e-3)  # straight sides cut the holes


@pytest.mark.parametrize("kind", ["line3", "triangle6", "quad8", "pyramid", "wedge15", "hexahedron20"])
def test_every_family(kind, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    nodes = {"line3": 3, "triangle6": 6, "quad8": 8, "pyramid": 5, "wedge15": 15, "hexahedron20": 20}[kind]
    body = uniform_beam(modes=1)
    cells = {"vertex": np.array([[0]]), kind: np.stack([np.arange(nodes), np.arange(nodes) + 1])}
    file = write_uff(body.with_(cells=cells), tmp_path / "cell.unv")
    descriptor, corners = CELLS[kind].uff
    found = pyuff.UFF(str(file)).read_sets(2)
    assert [e["element_nums"] for e in found[descriptor]] == [1, 2]
    assert found[descriptor][1]["nodes_nums"] == [c + 2 for c in corners]
    assert found[descriptor][1]["num_nodes"] == len(corners)


def test_a_mechanism_has_no_damping_ratio(tmp_path):
    body = uniform_beam(modes=2)
    file = write_uff(body.with_(K=np.array([0.0, 1.0]), frequency=np.array([0, 1 / (2 * np.pi)])), tmp_path / "b.unv")
    text = file.read_text()
    assert "nan" not in text.lower()
    assert "  0.00000E+00  1.00000E+00  0.00000E+00  0.00000E+00" in text


def test_refusals(tmp_path):
    body = uniform_beam(modes=1)
    rigid = mp.rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    with pytest.raises(mp.InputError, match="body 'rod' has no mesh to write; a universal file needs one"):
        write_uff(rigid, tmp_path / "rod.unv")
    with pytest.raises(mp.InputError, match="body 'rod' has no modes to write"):
        write_uff(rigid.with_(cells=body.cells), tmp_path / "rod.unv")
    with pytest.raises(mp.InputError, match="cannot write"):
        write_uff(body, "/proc/no/beam.unv")
    assert list(tmp_path.iterdir()) == []
