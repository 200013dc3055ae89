"""Reading Exudyn's reduced bodies: those that were written, and one that Exudyn itself has reduced and saved."""

import numpy as np
import pytest
from compare import assert_close
from formats.exudyn_reduction import reduced_by_exudyn
from formats.lumped import modal_body, particles

import modalprep as mp
from modalprep.body.difference import compare_bodies
from modalprep.examples import uniform_beam
from modalprep.formats import import_body, notes_of, write_exudyn
from modalprep.formats.exudyn import surface_triangles

NOT_HELD = {"damping", "geometric stiffness of accelerations", "geometric stiffness of interface loads"}


@pytest.mark.parametrize(
    "make",
    [lambda: modal_body(particles(seed=3, n=6, count=20)), lambda: uniform_beam(modes=4)],
    ids=["particles", "beam"],
)
def test_what_the_file_holds_comes_back(make, tmp_path):
    """The rotation of an interface follows from nodes at a twentieth of the size, which costs two digits."""
    body = make()
    found = import_body(write_exudyn(body, tmp_path / "body.npz"))
    assert found.interface_name == body.interface_name
    assert found.at_root
    for check in compare_bodies(body, found, 1e-12):
        assert check.passed or check.name in NOT_HELD, check
    for array in ("P", "H", "S", "phi", "psi"):
        assert_close(getattr(found, array), getattr(body, array), 1e-12, scale=np.abs(getattr(body, array)).max())
    assert_close(found.points, body.points, 1e-15)
    assert_close(found.shape, body.shape, 1e-15)
    assert any("geometric stiffness" in note for note in notes_of(found))


def test_surface_of_a_solid_is_drawn(bracket_body, tmp_path):
    found = import_body(write_exudyn(bracket_body, tmp_path / "b.npz"))
    assert np.array_equal(found.cells["triangle"], surface_triangles(bracket_body.cells))
    assert found.points.shape == bracket_body.points.shape


def test_body_that_exudyn_saved(bracket_model, bracket_body, tmp_path):
    """Exudyn reduces the bracket's matrices on its modes and saves them; the interface is named by its nodes."""
    reduced_by_exudyn(bracket_model, bracket_body).SaveToFile(str(tmp_path / "saved.npz"))
    file = next(tmp_path.glob("*.npz"))
    with pytest.raises(mp.InputError, match="name them: --interface"):
        import_body(file)
    at_rest = np.flatnonzero(np.all(bracket_body.shape == 0, axis=(1, 2)))  # on the bolt that is the root
    found = import_body(file, interfaces={"bolt": at_rest})
    assert found.interface_name == ("bolt",)
    for name in ("m", "s0", "E0", "frequency"):  # the modes are orthonormal to 1e-8 of their mass
        assert_close(getattr(found, name), getattr(bracket_body, name), 1e-7, scale=np.max(getattr(bracket_body, name)))
    assert_close(np.abs(found.S), np.abs(bracket_body.S), 1e-6, scale=np.abs(bracket_body.S).max())


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"totalMass": np.array(-1.0)}, "mass is not positive"),
        ({"mPhitTPsi": np.zeros((3, 1))}, "mPhitTPsi has 3 numbers instead of 6"),
        ({"xRef": np.full(6, np.nan)}, "not finite"),
        ({"interfaceNodes": np.full((2, 6), 10**6)}, "nodes that do not exist"),
        ({"stiffnessMatrixReduced": -np.eye(2)}, "negative eigenvalue"),
        ({"massMatrixReduced": -np.eye(2)}, "not positive definite"),
    ],
)
def test_archives_that_contradict_themselves_are_one_sentence(changes, said, tmp_path):
    file = write_exudyn(uniform_beam(modes=2), tmp_path / "beam.npz")
    with np.load(file, allow_pickle=True) as data:
        arrays = dict(data) | changes
    np.savez(file, **arrays)
    with pytest.raises(mp.InputError, match=said) as error:
        import_body(file)
    assert str(file) in str(error.value)


def test_matrices_are_no_reduced_body(tmp_path):
    np.savez(tmp_path / "km.npz", K=np.eye(3), M=np.eye(3))
    with pytest.raises(mp.InputError, match=r"pipeline file with \[matrices\]"):
        import_body(tmp_path / "km.npz")
