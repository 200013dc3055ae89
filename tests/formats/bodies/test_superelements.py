"""Reading superelements: OUTPUT4, DMIG, Abaqus and CalculiX, those of Nastran's own reduction, and damaged ones."""

import numpy as np
import pytest
from compare import assert_close
from formats.lumped import modal_body, particles
from scipy.linalg import eigh, null_space
from shared_data import DATA

import modalprep as mp
from modalprep.body.difference import compare_bodies
from modalprep.body.mass import cross_moment
from modalprep.examples import uniform_beam
from modalprep.formats import import_body, notes_of, write_dmig, write_output4
from modalprep.formats.nastran import superelement
from modalprep.vectors import skew

REBUILT = {  # what linear matrices do not tell; of the inertia coupling the symmetric part of H
    "inertia coupling", "mass integrals", "geometric stiffness of accelerations",
    "geometric stiffness of interface loads", "second order of the modal mass",
}  # fmt: skip


def cloud():
    """Particles whose modes are in the order of their frequencies, as those of every body that is read."""
    found = particles(seed=3, n=14, count=20)
    found.K.sort()
    return modal_body(found)


BODIES = {
    "particles": cloud,
    "beam": lambda: uniform_beam(modes=4, truncation=("interfaces", "inertia")),
    "beam with a free tip": lambda: uniform_beam(modes=4),
}


def renamed(found, body):
    return found.with_(interface_name=body.interface_name)


@pytest.fixture(params=BODIES)
def body(request):
    return BODIES[request.param]()


def refuse_differences(body, found, tolerance):
    for check in compare_bodies(body, found, tolerance):
        assert check.passed or check.name in REBUILT, check
    for one, other in ((found.S, body.S), (cross_moment(found.H), cross_moment(body.H))):  # independent of the modes
        assert_close(one @ one.T, other @ other.T, tolerance, scale=np.abs(other @ other.T).max())


def test_output4_comes_back(body, tmp_path):
    """All digits are in the file; stiff bodies lose some of them in the change of coordinates and back."""
    found = import_body(write_output4(body, tmp_path / "body.op4"))
    assert found.interface_name[0] == "root"
    assert found.at_root
    refuse_differences(body, renamed(found, body), 1e-9)
    assert_close(found.points, body.points, 1e-9, scale=10.0)
    assert any("stress stiffness" in note for note in notes_of(found))
    assert any("names" in note for note in notes_of(found))


@pytest.mark.parametrize(
    "truncation", [(), ("interfaces", "inertia")]
)  # a tip that follows the modes, a tip of its own
def test_tip_moves_towards_the_root(truncation, tmp_path):
    """By the integral of the squared slope of the first mode, 1.162 u^2 / L; that of a turned line is 1."""
    body = uniform_beam(modes=4, truncation=truncation)
    found = renamed(import_body(write_output4(body, tmp_path / "body.op4")), body)
    short, own = (10.0 * x.Kg_F[1, 0, 0, 0] / np.sum(x.phi[1, :, 0] ** 2) for x in (found, body))
    assert_close(own, 1.162, 1e-3)
    assert 0.9 < short < 1.2


def test_output4_of_other_units(tmp_path):
    """The same numbers as of mm and t: lengths a thousandth, masses a thousand times, rotations a thousand times."""
    file = write_output4(uniform_beam(modes=4), tmp_path / "body.op4")
    one, other = import_body(file), import_body(file, length_unit="mm", mass_unit="t")
    assert_close(other.m, 1e3 * one.m, 1e-12)
    assert_close(other.E0, 1e-3 * one.E0, 1e-12, scale=np.abs(one.E0).max())
    assert_close(other.K, one.K, 1e-9)
    assert_close(other.interface_position, 1e-3 * one.interface_position, 1e-12, scale=1e-2)
    assert_close(np.abs(other.phi), np.abs(one.phi) / np.sqrt(1e3), 1e-9, scale=np.abs(other.phi).max())
    assert_close(np.abs(other.psi), np.abs(one.psi) * np.sqrt(1e3), 1e-9, scale=np.abs(other.psi).max())
    assert_close(np.abs(other.shape), np.abs(one.shape) / np.sqrt(1e3), 1e-9, scale=np.abs(other.shape).max())


def test_dmig_comes_back_with_its_names(tmp_path):
    """Ten digits of every entry, in a change of coordinates that is not well conditioned: 2e-8 in frequencies."""
    body = uniform_beam(modes=4, truncation=("interfaces", "inertia"))
    found = import_body(write_dmig(body, tmp_path / "body.dmig"))
    assert found.name == body.name
    assert found.interface_name == body.interface_name
    refuse_differences(body, found, 5e-8)


def test_interface_that_is_no_grid_point_is_lost_in_dmig(tmp_path):
    found = import_body(write_dmig(uniform_beam(modes=4), tmp_path / "body.dmig"))
    assert found.interface_name == ("root",)


def test_damping_comes_back(tmp_path):
    body = uniform_beam(modes=4, truncation=("interfaces", "inertia"))
    body = body.with_(D=2 * 0.01 * np.sqrt(body.K))
    assert_close(import_body(write_output4(body, tmp_path / "body.op4")).D, body.D, 1e-8)
    assert_close(import_body(write_dmig(body, tmp_path / "body.dmig")).D, body.D, 1e-7)  # ten digits of small sums


def substructure(path, whole):
    """An Abaqus substructure: nodes 101 and 205 with six components, and nodes with one that have no place."""
    labels = [101, 205, *range(900, 900 + len(whole.K) - 12)]
    out = [f"*USER ELEMENT, NODES={len(labels)}, LINEAR", "** ELEMENT NODES"]
    out += ["** " + ", ".join(str(label) for label in labels[k : k + 10]) for k in range(0, len(labels), 10)]
    out += [" 1, 2, 3, 4, 5, 6", " 3, 1"]  # from the third on, one component
    for kind, A in (("STIFFNESS", whole.K), ("MASS", whole.M)):
        out += [f"*MATRIX,TYPE={kind}", *(f"{A[i, j]:.16e}" for i in range(len(A)) for j in range(i + 1))]
    path.write_text("\n".join(out) + "\n")
    return path


def test_abaqus_substructure_with_nodes_of_a_table(tmp_path):
    """The superelement of a beam as *USER ELEMENT: the same body as from OUTPUT4."""
    body = uniform_beam(modes=4, truncation=("interfaces", "inertia"))
    whole = superelement(body)
    file = substructure(tmp_path / "arm.mtx", whole)
    (tmp_path / "nodes.csv").write_text("101, 0, 0, 0\n205, 10, 0, 0\n")
    with pytest.raises(mp.InputError, match="--nodes FILE"):
        import_body(file)
    found = import_body(file, nodes=tmp_path / "nodes.csv")
    assert found.interface_name == ("node_101", "node_205")
    refuse_differences(body, renamed(found, body), 1e-9)
    turned = import_body(file, nodes=tmp_path / "nodes.csv", root="node_205")
    assert turned.interface_name[0] == "node_205"


def test_interfaces_are_chosen_by_their_nodes(tmp_path):
    whole = superelement(uniform_beam(modes=4, truncation=("interfaces", "inertia")))
    file = substructure(tmp_path / "arm.mtx", whole)
    (tmp_path / "nodes.csv").write_text("101, 0, 0, 0\n205, 10, 0, 0\n")
    found = import_body(file, nodes=tmp_path / "nodes.csv", interfaces={"tip": [205]})
    assert found.interface_name == ("tip",)
    assert_close(found.s0, [12.0 * -5.0, 0, 0], 1e-6)  # about the tip


def test_places_that_are_not_those_of_the_matrices_are_refused(tmp_path):
    whole = superelement(uniform_beam(modes=4, truncation=("interfaces", "inertia")))
    file = substructure(tmp_path / "arm.mtx", whole)
    (tmp_path / "nodes.csv").write_text("101, 0, 0, 0\n205, 9, 0, 0\n")
    with pytest.raises(mp.InputError, match="resists a rigid"):
        import_body(file, nodes=tmp_path / "nodes.csv")


def test_deck_of_calculix_with_a_matrix_element():
    """Element 32 of a bar of 1 x 1.5 x 8 mm in 32 equal C3D20R: its mass, inertia, and frequencies of its matrices."""
    file = DATA / "calculix" / "beamfsuper.inp"
    if not file.exists():
        pytest.skip("no deck of CalculiX")
    found = import_body(file, length_unit="mm", mass_unit="t")
    m = 7.8e-6 * 12 / 32  # kg of 7.8e-9 t/mm^3
    assert_close(found.m, m, 1e-9)
    a, b, c = 0.5e-3, 0.75e-3, 1e-3
    centre = found.s0 / found.m
    inertia = np.trace(found.E0) * np.eye(3) - found.E0 - m * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    assert_close(np.diag(inertia), m / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b]), 1e-9)
    K, M = (entries(DATA / "calculix" / f"beamfsuper.{name}") for name in ("stiff", "mass"))
    x = np.array(found.points) * 1e3
    motions = np.concatenate([np.broadcast_to(np.eye(3), (20, 3, 3)), -skew(x)], axis=2).reshape(60, 6)
    N = null_space(np.linalg.pinv(motions))  # no mean motion of the nodes, which is that of the root
    K, M = N.T @ K @ N, N.T @ M @ N
    mass, V = np.linalg.eigh(M)  # integration is reduced: 30 motions have no mass and follow without inertia
    heavy, light = V[:, mass > 1e-9 * mass[-1]], V[:, mass <= 1e-9 * mass[-1]]
    follow = np.linalg.pinv(light.T @ K @ light, rcond=1e-9, hermitian=True) @ (light.T @ K @ heavy)
    moved = heavy - light @ follow
    w2 = eigh(moved.T @ K @ moved, np.diag(mass[mass > 1e-9 * mass[-1]]), eigvals_only=True)
    assert_close((2 * np.pi * found.frequency) ** 2, w2, 1e-8)
    assert any("left out: it is round-off" in note for note in notes_of(found))


def entries(file):
    table = np.loadtxt(file, delimiter=",")
    nodes = np.unique(table[:, 0])
    i, j = (3 * np.searchsorted(nodes, table[:, k]) + table[:, k + 1].astype(int) - 1 for k in (0, 2))
    A = np.zeros((3 * len(nodes),) * 2)
    A[i, j] = A[j, i] = table[:, 4]
    return A


@pytest.mark.parametrize("name", ["inboard", "outboard"])
def test_external_superelements_of_nastran(name):
    """Clamped at grid 3: the eigenvalues of kxx and mxx without the rows of that grid."""
    file = DATA / "nastran_cb" / f"{name}.op4"
    if not file.exists():
        pytest.skip("no superelements of Nastran")
    found = import_body(file, length_unit="in", mass_unit="slinch")
    assert found.interface_name == ("grid_3", "grid_11", "grid_19", "grid_27")
    from modalprep.fe.readers.output4 import read_output4

    matrices = {key.lower(): A.toarray() for key, A in read_output4(file).items()}
    kept = slice(6, None)
    w2 = eigh(matrices["kxx"][kept, kept], matrices["mxx"][kept, kept], eigvals_only=True)
    assert_close(found.K, w2, 1e-7)
    assert any("in, slinch and s" in note for note in notes_of(found))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("body.unv", "mode shapes but no mass integrals"),
        ("body.vtu", "mode shapes but no mass integrals"),
        ("body.mat", "state spaces, coupling matrices and data of Simscape are not read"),
        ("body.json", "coupling matrices hold small motions of the root alone"),
        ("body.sub", "substructures of Ansys are not read"),
        ("body.op2", "EXTSEOUT"),
        ("body.h5", "modal file already"),
        ("body.doc", r"bodies are read from files \.sid"),
    ],
)
def test_files_without_a_body_say_what_to_export(name, said, tmp_path):
    with pytest.raises(mp.InputError, match=said):
        import_body(tmp_path / name)


def test_matrices_of_whole_models_are_for_another_table(tmp_path):
    (tmp_path / "k.mtx").write_text("1,1,1,1,4.\n1,2,1,2,4.\n")
    with pytest.raises(mp.InputError, match=r"pipeline file with \[matrices\]"):
        import_body(tmp_path / "k.mtx")


def test_options_that_a_format_does_not_take_are_refused(tmp_path):
    file = write_output4(uniform_beam(modes=4), tmp_path / "body.op4")
    with pytest.raises(mp.InputError, match="leave out interfaces"):
        import_body(file, interfaces={"tip": [1]})
    with pytest.raises(mp.InputError, match="say in which mass_unit"):
        import_body(file, length_unit="mm")
