"""Names of modes whose motion is known in closed form."""

import numpy as np
import pytest
from structured import surface

import modalprep as mp
from modalprep.body.quality.mode_names import Moving, mode_names

ALLOY = mp.Material(E=7e10, nu=0.3, rho=2700.0)
X = np.linspace(0.0, 1.0, 21)
LINE = np.stack([X, 0 * X, 0 * X], axis=1)


def grid(nx=21, ny=9):
    """Return nodes of a strip in x and y, 1 m long and .3 m wide."""
    x, y = np.meshgrid(np.linspace(0, 1, nx), np.linspace(-0.15, 0.15, ny), indexing="ij")
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)


def named(points, *motions, parts=None, strain=None):
    shape = np.stack([np.stack(np.broadcast_arrays(*motion), axis=1) for motion in motions], axis=2)
    return mode_names(Moving(points, shape.astype(float), np.ones(len(points)), parts or {}, strain or {}))


def test_a_beam_bends_stretches_and_bends_again():
    y1, y2 = X**2, X**2 * (X - 0.7)
    assert named(LINE, (0, y1, 0), (0, y2, 0), (0, 0, y1), (np.sin(X), 0, 0)) == (
        "1st bending in y", "2nd bending in y", "1st bending in z", "1st stretching along x",
    )  # fmt: skip


def test_a_strip_bends_and_twists_in_a_symmetry_of_its_own():
    """w = x^2 is even in y, w = x y odd; both about the plane xz."""
    p = grid()
    x, y, _ = p.T
    assert named(p, (0, 0, x**2), (0, -0 * y, x * y)) == (
        "1st bending in z, symmetric about xz", "1st torsion about x, antisymmetric about xz",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("motion", "name"),
    [((1, 0, 0), "1st sway in x"), ((0, 1, 1), "1st sway in yz"), ((0, 0, "x"), "1st rotation about y")],
)
def test_a_part_without_strain_sways_or_rotates(motion, name):
    """The tip's fifth of a beam carries all motion and no strain; about its own centre it rotates."""
    tip = X > 0.79
    lever = np.where(tip, X - X[tip].mean(), 0.0)
    u = [np.where(tip, 1.0 if each == 1 else 0.0, 0.0) if each != "x" else lever for each in motion]
    parts, strain = {"arm": ~tip, "tip": tip}, {"arm": np.ones(1), "tip": np.zeros(1)}
    assert named(LINE, u, parts=parts, strain=strain)[0].startswith(f"tip: {name}")


def test_the_groups_that_move_are_named():
    p = grid()
    left, right = p[:, 1] < 0, p[:, 1] > 0
    both = named(p, (0, 0, p[:, 0] ** 2 * np.abs(p[:, 1])), parts={"port": left, "starboard": right})
    assert both[0].startswith(("port and starboard: ", "starboard and port: "))
    one = named(p, (0, 0, p[:, 0] ** 2 * right), parts={"port": left, "starboard": right})
    assert one[0].startswith("starboard: 1st bending in z")


def test_modes_of_a_plate_by_finite_elements():
    """Leissa, Vibration of plates (NASA SP-160): a clamped-free plate of aspect 2 bends, twists, bends, twists."""
    points, cells = surface(12, 6, "quad", lambda s, t: np.stack([1.0 * s, 0.5 * t, 0 * s]))
    root = np.flatnonzero(points[:, 0] < 1e-9)
    mesh = mp.fe.Mesh(
        points=points, cells={"quad": cells, "vertex": root[:, None]},
        groups={"plate": {"quad": np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}},
    )  # fmt: skip
    shell = {"plate": mp.Shell(material=ALLOY, thickness=0.01)}
    model = mp.assemble(mesh, shell, {"root": mp.Interface(group="root", kind="rbe2", position=(0, 0.25, 0))})
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=4, truncation=()), name="plate")
    bending, torsion = "bending in z, symmetric about xz", "torsion about x, antisymmetric about xz"
    assert body.mode_names == (f"1st {bending}", f"1st {torsion}", f"2nd {bending}", f"2nd {torsion}")


def test_names_survive_the_modal_file_and_end_with_their_modes(tmp_path):
    from modalprep.examples import uniform_beam

    beam = uniform_beam(modes=2)
    again = mp.read_body(mp.write_body(beam, tmp_path / "beam.h5"))
    assert again.mode_names == beam.mode_names == ("1st bending in y", "1st bending in z")
    assert again.notes == beam.notes
    assert beam.with_(K=beam.K[:1]).mode_names == ()
