"""Reading MBDyn's files: bodies that were written, lumped masses against sums, and files that lack groups."""

import numpy as np
import pytest
from compare import assert_close
from formats.lumped import modal_body, particles

import modalprep as mp
from modalprep.body.difference import compare_bodies
from modalprep.body.frames import in_mean_axes
from modalprep.examples import uniform_beam
from modalprep.formats import import_body, notes_of, write_mbdyn

BODIES = {
    "particles": lambda: modal_body(particles(seed=3, n=6, count=20)),
    "beam": lambda: uniform_beam(modes=4, truncation=("interfaces", "inertia")),
    "free beam": lambda: in_mean_axes(uniform_beam(modes=8)),
}


@pytest.mark.parametrize("name", BODIES)
def test_everything_but_the_mesh_comes_back(name, tmp_path):
    """17 digits are written, so that every array differs by round-off alone."""
    body = BODIES[name]()
    found = import_body(write_mbdyn(body, tmp_path / "body.fem"))
    assert found.name == body.name
    assert found.interface_name == body.interface_name
    for check in compare_bodies(body, found, 1e-12):
        assert check.passed, check
    for array in ("P", "H", "Kg_W", "Kg_F", "Kg_T", "phi", "psi", "D"):
        assert_close(getattr(found, array), getattr(body, array), 1e-12, scale=np.abs(getattr(body, array)).max())


def test_mesh_nodes_are_points(tmp_path):
    """Nodes that the card does not name are of the mesh, with their shapes."""
    body = uniform_beam(modes=2)
    found = import_body(write_mbdyn(body, tmp_path / "body.fem", mesh_nodes=[7, 9]))
    assert found.interface_name == body.interface_name
    assert_close(found.points[2:], body.points[[7, 9]], 1e-15)
    assert_close(found.shape[2:], body.shape[[7, 9]], 1e-15)


def without_comments(file):
    """As another program writes the file: no card in its head, labels as numbers."""
    lines = [line for line in file.read_text().splitlines() if not line.startswith('**      "')]
    text = "\n".join(lines).replace("root\ntip\n", "11\n12\n").replace("by modalprep", "by another program")
    file.write_text(text)
    return file


def test_files_of_other_programs_have_numbers_for_names(tmp_path):
    body = uniform_beam(modes=2)
    found = import_body(without_comments(write_mbdyn(body, tmp_path / "arm.fem")))
    assert found.name == "arm"
    assert found.interface_name == ("node_11", "node_12")
    assert_close(found.Kg_F, body.Kg_F, 1e-12)  # group 19 has matrices for all nodes but the one at rest


def lumped_file(path, cloud, n=3, invariants=False):
    """A file of particles (m, x, phi) with their masses in group 11, as the older programs write them."""
    m, x, phi = cloud
    rows = lambda values: "\n".join(" ".join(f"{v:.17g}" for v in np.ravel(row)) for row in values)  # noqa: E731
    M = np.einsum("i,iaj,iak->jk", m, phi, phi)
    shapes = np.concatenate([phi, np.zeros_like(phi)], axis=1)
    groups = {
        1: f"** a comment\nREV0 {len(m)} {n} 0 0 0",
        2: " ".join(str(k + 1) for k in range(len(m))),
        **{5 + a: rows(x[:, a : a + 1]) for a in range(3)},
        8: "\n".join(f"** NORMAL MODE SHAPE # {k + 1}\n{rows(shapes[:, :, k])}" for k in range(n)),
        9: rows(M),
        10: rows(np.diag(np.arange(1.0, n + 1))),
        11: rows(np.concatenate([np.repeat(m[:, None], 3, axis=1), np.zeros((len(m), 3))], axis=1)),
    }
    path.write_text("".join(f"**\n** RECORD GROUP {k}, NAME\n{text}\n" for k, text in groups.items()))
    return path


def test_lumped_masses_are_summed(tmp_path):
    """Ten particles: mass, centre, inertia and the momentum of the modes are the sums over them."""
    rng = np.random.default_rng(4)
    m, x, phi = rng.uniform(1, 2, 10), rng.standard_normal((10, 3)), rng.standard_normal((10, 3, 3))
    found = import_body(lumped_file(tmp_path / "cloud.fem", (m, x, phi)))
    assert_close(found.m, m.sum(), 1e-14)
    assert_close(found.s0, m @ x, 1e-13)
    assert_close(found.E0, np.einsum("i,ia,ib->ab", m, x, x), 1e-13)
    M = np.einsum("i,iaj,iak->jk", m, phi, phi)
    S = np.einsum("i,iak->ak", m, phi)
    assert_close(found.S @ found.S.T, S @ np.linalg.solve(M, S.T), 1e-12)  # independent of the modes' basis
    H = np.einsum("i,ib,iak->abk", m, x, phi).reshape(9, 3)
    assert_close(found.H.reshape(9, 3) @ found.H.reshape(9, 3).T, H @ np.linalg.solve(M, H.T), 1e-12)
    assert any("lumped masses" in note for note in notes_of(found))


def test_a_root_may_move_by_round_off(tmp_path):
    """As in files of other programs, whose root moves by 1e-20 of the largest displacement."""
    body = uniform_beam(modes=2)
    file = without_comments(write_mbdyn(body, tmp_path / "arm.fem"))
    zeros = "\n" + " ".join([f"{0.0:.16e}"] * 6) + "\n"
    assert file.read_text().count(zeros) == body.n
    file.write_text(file.read_text().replace(zeros, zeros.replace("0.0", "2.1", 1).replace("e+00", "e-21", 1)))
    found = import_body(file)
    assert found.interface_name == ("node_11", "node_12")
    assert found.at_root
    assert not found.phi[0].any()
    assert_close(found.Kg_F, body.Kg_F, 1e-12)


def test_surplus_rows_of_lumped_masses_are_said(tmp_path):
    """MBDyn reads one row for each node."""
    rng = np.random.default_rng(4)
    cloud = rng.uniform(1, 2, 10), rng.standard_normal((10, 3)), rng.standard_normal((10, 3, 3))
    expected = import_body(lumped_file(tmp_path / "cloud.fem", cloud))
    file = lumped_file(tmp_path / "longer.fem", cloud)
    file.write_text(file.read_text().rstrip("\n") + "\n9 9 9 0 0 0\n")
    found = import_body(file)
    assert found.m == expected.m
    assert any("1 further row of lumped masses" in note for note in notes_of(found))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("RECORD GROUP 9", "RECORD GROUP 8", "group 8 twice"),
        ("REV0 2 2", "REV0 2 3", "instead of"),
        ("REV0 2 2", "REV0 2 -2", "no record group 1"),
        ("RECORD GROUP 15", "RECORD GROUP 99", "no invariants"),
        ("RECORD GROUP 12", "RECORD GROUP 98", "neither the inertia"),
        ("\nroot\ntip\n", "\ntip\ntip\n", "1 different labels for 2 nodes"),
    ],
)
def test_files_that_contradict_themselves_are_one_sentence(old, new, said, tmp_path):
    file = write_mbdyn(uniform_beam(modes=2), tmp_path / "beam.fem")
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(mp.InputError, match=said) as error:
        import_body(file)
    assert str(file) in str(error.value)


def test_classic_files_have_too_little(tmp_path):
    file = write_mbdyn(uniform_beam(modes=2), tmp_path / "beam.fem", "classic")
    with pytest.raises(mp.InputError, match="how rigid motion excites the modes"):
        import_body(file)


def test_invariants_that_do_not_agree_are_refused(tmp_path):
    file = write_mbdyn(uniform_beam(modes=2), tmp_path / "beam.fem")
    lines = file.read_text().splitlines()
    at = next(k for k, line in enumerate(lines) if "RECORD GROUP 15" in line) + 1
    lines[at] = " ".join(["9.9"] * len(lines[at].split()))
    file.write_text("\n".join(lines))
    with pytest.raises(mp.InputError, match="15 and 16 hold the same integrals but do not agree"):
        import_body(file)
