"""Shells whose thickness varies: the same element, tapered strips against the beam's integrals, Nastran's T1 to T4."""

import numpy as np
import pytest
from structured import box, free_dofs, frequencies, solid_model, static, surface

import modalprep as mp
from modalprep.fe.families import FAMILIES

CALCULIX = mp.Material(E=210000.0, nu=0.3, rho=7.8e-9)
METAL = mp.Material(E=2.0e11, nu=0.0, rho=8000.0)
KINDS = list(FAMILIES[mp.Shell])
LENGTH, WIDTH, ROOT, TIP = 2.0, 0.5, 0.02, 0.01  # m; the thickness falls linearly from root to tip


def strip(kind, n):
    points, cells = surface(n, 1, kind, lambda s, v: (LENGTH * s, WIDTH * v, 0.0 * s))
    corners = 3 if kind.startswith("triangle") else 4
    thickness = ROOT + (TIP - ROOT) * points[cells[:, :corners], 0] / LENGTH
    return points, cells, thickness


def model(points, cells, kind, section, **data):
    mesh = mp.fe.Mesh(points=points, cells={kind: cells}, groups={"all": {kind: np.arange(len(cells))}},
                      data={name: {kind: values} for name, values in data.items()})  # fmt: skip
    return mp.assemble(mesh, {"all": section}, {"root": mp.Interface(near=(0.0, 0.0, 0.0))})


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("by_corner", [False, True])
def test_an_even_thickness_is_that_of_a_section(kind, by_corner):
    points, cells, corners = strip(kind, 3)
    t = np.full(corners.shape if by_corner else len(cells), 0.03)
    t[0] = np.nan  # the first element keeps the section's
    section = {"material": METAL, "offset": 0.01, "nsm": 5.0}
    found = model(points, cells, kind, mp.Shell(thickness=0.01, **section), thickness=t)
    mesh = mp.fe.Mesh(points=points, cells={kind: cells}, groups={
        "first": {kind: np.array([0])}, "others": {kind: np.arange(1, len(cells))}})  # fmt: skip
    sections = {"first": mp.Shell(thickness=0.01, **section), "others": mp.Shell(thickness=0.03, **section)}
    wanted = mp.assemble(mesh, sections, {"root": mp.Interface(near=(0.0, 0.0, 0.0))})
    for A, B in ((found.K, wanted.K), (found.M, wanted.M)):
        assert abs(A - B).max() < 1e-12 * abs(B).max()  # round-off of sums in another order
    assert found.rigid.m == pytest.approx(wanted.rigid.m, rel=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_tapered_strip(kind):
    """Beam: ``w = int F (L - x)^2 / (E I) dx``, mass ``rho b int t dx``, rotary inertia ``rho b int t^3 / 12 dx``.

    The flat elements have the mean stiffness: their error falls with the square of their length.
    """
    points, cells, t = strip(kind, 16)
    found = model(points, cells, kind, mp.Shell(material=METAL, thickness=0.5), thickness=t)
    x, w = np.polynomial.legendre.leggauss(40)
    x, w = LENGTH * (x + 1) / 2, LENGTH * w / 2
    at = ROOT + (TIP - ROOT) * x / LENGTH
    deflection = w @ ((LENGTH - x) ** 2 / (METAL.E * WIDTH * at**3 / 12))
    assert found.rigid.m == pytest.approx(METAL.rho * WIDTH * w @ at, rel=1e-12)
    assert found.rigid.E0[2, 2] == pytest.approx(METAL.rho * WIDTH * w @ at**3 / 12, rel=1e-12)
    tip = np.flatnonzero(np.isclose(points[:, 0], LENGTH))
    load = np.zeros(found.n_dof)
    load[found.dof[tip, 2]] = {2: [0.5, 0.5], 3: np.array([1, 4, 1])[np.argsort(np.argsort(points[tip, 1]))] / 6}[
        len(tip)
    ]
    d = static(found, free_dofs(found, found.dof[np.flatnonzero(np.isclose(points[:, 0], 0.0))]), load)
    assert d[found.dof[tip, 2]] == pytest.approx(deflection, rel=4e-3 if kind in ("quad", "triangle") else 1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_stress_at_the_faces_of_a_wedge(kind):
    """A curvature k bends the faces by ``E k t / 2`` with the thickness there."""
    points, cells, t = strip(kind, 1)
    block = FAMILIES[mp.Shell][kind].build(kind, points, cells, mp.Shell(material=METAL, thickness=0.5),
                                           {"thickness": t}, np.zeros(3))  # fmt: skip
    d = np.zeros((len(points), 6))
    d[:, 2], d[:, 4] = -1e-3 / 2 * points[:, 0] ** 2, 1e-3 * points[:, 0]
    found = block.nodal_stress(d[cells].reshape(len(cells), -1, 1))["top"][1][..., 0]
    corners = t.shape[1]
    c, s = block.frame[:, 0, 0, None], block.frame[:, 1, 0, None]  # axes in the strip's plane
    along = c**2 * found[..., 0] + s**2 * found[..., 1] + 2 * c * s * found[..., 2]
    assert along[:, :corners] == pytest.approx(METAL.E * 1e-3 * t / 2, rel=1e-9)


def plate_of_solids(kind, n):
    """CalculiX's test shellf: a unit square clamped at x = 0, .01 thick there, .03 in the middle and .02 at the tip."""
    points, cells = box(kind, n)
    points[:, 2] = (points[:, 2] - 0.5) * np.interp(points[:, 0], [0, 0.5, 1], [0.01, 0.03, 0.02])
    root = np.flatnonzero(np.isclose(points[:, 0], 0))
    found = solid_model(points, cells, kind, mp.Solid(material=CALCULIX), root)
    return frequencies(found, free_dofs(found, found.dof[root, :3]), 3) / (2 * np.pi)


def test_nodal_thickness_of_calculix():
    """CalculiX's S8 is a C3D20 of that thickness, which locks: its shellf.dat.ref has the frequencies of our own C3D20.

    The shell of eight nodes has those to which finer solids converge: 27 nodes, 32 along, are .5 % high.
    """
    assert plate_of_solids("hexahedron20", (2, 2, 1)) == pytest.approx([19246.92, 61882.39, 199076.9], rel=5e-7)
    points, cells = surface(8, 2, "quad8")
    t = np.interp(points[:, 0], [0, 0.5, 1], [0.01, 0.03, 0.02])[cells]  # at every node
    found = model(points, cells, "quad8", mp.Shell(material=CALCULIX, thickness=0.01), thickness=t)
    held = found.dof[np.flatnonzero(np.isclose(points[:, 0], 0.0))]
    own = frequencies(found, free_dofs(found, held), 3) / (2 * np.pi)
    assert own == pytest.approx(plate_of_solids("hexahedron27", (32, 4, 1)), rel=6e-3)


def test_refusals():
    points, cells, t = strip("quad", 1)
    ply = mp.fe.Ply(material=METAL, thickness=0.01)
    for section, thickness, words in (
        (mp.Shell(plies=(ply,)), t, "laminate"),
        (mp.Shell(material=METAL, thickness=0.01), -t, "1 shells have a thickness that is not positive"),
        (mp.Shell(material=METAL, thickness=0.01), t[:, :3], "one for each corner"),
    ):
        with pytest.raises(mp.InputError, match=words):
            model(points, cells, "quad", section, thickness=thickness)


DECK = """SOL 103
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,2.,0.,0.
GRID,3,,2.,1.,0.
GRID,4,,0.,1.,0.
GRID,5,,1.,0.,0.
GRID,6,,2.,.5,0.
GRID,7,,1.,1.,0.
GRID,8,,0.,.5,0.
{}
PSHELL,7,1,.01,1,,1
MAT1,1,2.+11,,.3,8000.
ENDDATA
"""


@pytest.mark.parametrize(
    ("card", "mean", "angle"),
    [
        ("CQUAD4,1,7,1,2,3,4,30.,,+\n+,,,.02,.04,.04,.02", 0.03, 30.0),
        ("CQUAD4,1,7,1,2,3,4,,,+\n+,,1,2.,4.,4.,2.", 0.03, 0.0),  # of the section's
        ("CTRIA3,1,7,1,2,3,,,+\n+,,,.03,.06", (0.03 + 0.06 + 0.01) / 3, 0.0),  # the third is the section's
        ("CQUAD8,1,7,1,2,3,4,5,6,+\n+,7,8,.02,.04,.04,.02,30.", 0.03, 30.0),
        ("CQUAD8,1,7,1,2,3,4,5,6,+\n+,7,8,2.,4.,4.,2.,,,+\n+,1", 0.03, 0.0),
    ],
)
def test_thickness_of_nastran_corners(tmp_path, card, mean, angle):
    """QRG: T1 to T4 are the thickness at the corners, with TFLAG = 1 over that of PSHELL."""
    (tmp_path / "deck.bdf").write_text(DECK.format(card))
    mesh = mp.read_mesh(tmp_path / "deck.bdf")
    found = mp.assemble(mesh, {}, {"root": mp.Interface(near=(0.0, 0.0, 0.0))})
    assert found.rigid.m == pytest.approx(8000 * mean * (1 if card.startswith("CTRIA3") else 2), rel=1e-12)
    (kind,) = (kind for kind in mesh.cells if kind != "vertex")
    assert np.degrees(mesh.data.get("angle", {kind: np.zeros(1)})[kind][0]) == pytest.approx(angle)
