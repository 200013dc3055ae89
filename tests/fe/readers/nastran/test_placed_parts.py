"""Parts of a deck that are mirrored (SEMPLN), or come as matrices (EXTOP4), are the structure that is written out."""

import re

import numpy as np
import pytest
from scipy.sparse import block_diag

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.links.mirror import Plane, mirrored_mesh
from modalprep.fe.readers.digest import mesh_digest

STEEL = "MAT1,1,2.+11,,.3,8000.\n"
MATERIALS = f"""{STEEL}MAT8,2,1.4+11,9.+9,.3,5.+9,5.+9,3.+9,1600.
MAT9,3,6.+10,2.+10,1.+10,3.+8,2.+8,1.+8,5.+10
,2.+10,1.+8,4.+8,3.+8,4.+10,2.+8,1.+8,5.+8
,2.+10,1.+9,5.+8,2.+10,3.+8,1.+10,2500.
"""
PROPERTIES = """PSHELL,1,1,.02,1,,1
PBAR,3,1,1.-3,2.-7,1.-7,3.-7
PSOLID,6,1
PBUSH,7,K,1.+6,2.+6,3.+6,4.+4,5.+4,6.+4
"""
MORE_PROPERTIES = """PCOMP,2,-.01
,2,.002,30.,YES,2,.003,-60.,YES
PBEAM,4,1,1.-3,2.-7,1.-7,,3.-7
PSOLID,5,3,9
PBEAML,8,1,,L
,.1,.08,.005,.006
"""
SYSTEM = "CORD2R,9,,0.,0.,0.,.1,.2,1.\n,1.,.3,0.\n"
PLACES = {  # x is above zero, and zero at grids 1 to 3 and 7
    **{1: (0, 0, 0), 2: (0, 1, 0), 3: (0, 0, 1), 4: (1, 0, 0), 5: (1, 1, 0.1), 6: (1, 0, 1), 7: (0, 1, 1)},
    **{8: (1, 1.1, 1), 9: (2, 0, 0), 10: (2, 1, 0.1), 11: (3, 0.2, 0), 12: (3, 1, 0.3), 13: (2, 2, 0.2)},
    **{14: (2, 3, 0.1), 15: (2, 3, 0.1), 16: (2, 4, 0), 17: (3, 3, 1)},
}
TURNED = {5: 9, 10: 9, 14: 9}  # CD of grids
ELEMENTS = """CHEXA,1,5,1,4,5,2,3,6
,8,7
CQUAD4,2,1,4,9,10,5,,.05
CQUAD4,3,2,9,11,12,10,20.
CTRIA3,4,2,10,12,13,35.,-.02
CBAR,5,3,10,13,.3,.2,1.
,,,0.,.03,.05,.01,.0,.02
CBEAM,6,4,13,14,1.,.2,.4
,5
CBEAM,12,8,11,14,0.,0.,1.
CBUSH,7,7,14,15,,,,9
CONM2,8,16,,5.,.1,.2,.05
,.4,.01,.5,.02,.03,.6
RBE2,9,15,123456,16
RBE3,10,,17,123456,1.,123,12,14,16
CONM2,11,17,,3.
MPC,4,12,3,1.,13,3,-.7
,,11,4,.01
"""


def grid_cards(change=lambda x: x, first=0, but=(), systems=None):
    """Write the grids in other places, with numbers from another one on, without some, and with their systems CD."""
    rows = {k: change(np.array(x, dtype=float)) for k, x in PLACES.items() if k not in but}
    cd = systems or {}
    return "".join(f"GRID,{k + first},,{x:.15g},{y:.15g},{z:.15g},{cd.get(k, '')}\n" for k, (x, y, z) in rows.items())


def opposite(x):
    return x * [-1, 1, 1]


PART = grid_cards(systems=TURNED) + ELEMENTS + PROPERTIES + MORE_PROPERTIES + MATERIALS + SYSTEM


def assembled(mesh, root=None):
    return mp.assemble(mesh, {}, {"root": root or mp.Interface(node=int(mesh.labels[3]), kind="node")})


def test_matrices_of_the_mirror_image(read):
    """``K' = T K T`` with the mirror T of displacements and rotations; so are mass and geometric stiffness."""
    mesh = read("CEND\nMPC=4\nBEGIN BULK\n" + PART)
    normal = np.array([0.6, 0.48, 0.64])
    plane = Plane(np.array([0.3, -0.2, 0.5]), normal)
    brick = mp.Interface(group="psolid_5")
    model, image = assembled(mesh, brick), assembled(mirrored_mesh(mesh, plane), brick)
    full = block_diag([plane.H, -plane.H] * len(model.dof), format="csr")
    T = full[model.dof.ravel() >= 0][:, model.dof.ravel() >= 0]
    np.testing.assert_array_equal(image.dof, model.dof)
    d = np.random.default_rng(3).normal(size=model.n_dof) * 1e-3
    pairs = [(own.K, own.M, own.geometric_stiffness(x, own.K @ x)) for own, x in ((model, d), (image, T @ d))]
    for A, B in zip(*pairs, strict=True):
        np.testing.assert_allclose((T @ A @ T).toarray(), B.toarray(), rtol=0, atol=1e-12 * abs(A).max())
    np.testing.assert_allclose(plane.H @ model.rigid.E0 @ plane.H, image.rigid.E0, atol=1e-12 * model.rigid.E0.max())
    found = [mp.craig_bampton(own, modes=12, truncation=[]).frequency for own in (model, image)]
    np.testing.assert_allclose(*found, rtol=1e-9)  # links, equations and offsets too


def frequencies(mesh, modes=12):
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    return model.rigid.m, mp.craig_bampton(model, modes=modes, truncation=[]).frequency


HALF = """CQUAD4,2,1,1,4,5,2
CQUAD4,3,1,4,9,10,5
CBAR,5,3,10,13,.3,.2,1.
,,,0.,.03,.05,.01,.0,.02
CBUSH,6,7,13,14
CONM2,8,14,,5.,.1,.2,.05
CHEXA,1,6,1,4,5,2,3,6
,8,7
"""
LEFT = """CQUAD4,102,1,1,2,105,104
CQUAD4,103,1,104,105,110,109
CBAR,105,3,110,113,-.3,.2,1.
,,,0.,.03,.05,-.01,.0,.02
CBUSH,106,7,113,114
CONM2,108,114,,5.,-.1,.2,.05
CHEXA,101,6,1,104,105,2,3,106
,108,7
"""
USED = (11, 12, 15, 16, 17)
PROPERTIES += STEEL
RIGHT = grid_cards(but=USED) + HALF + PROPERTIES
OTHER_GRIDS = grid_cards(opposite, 100, (1, 2, 3, 7, *USED))
WHOLE = RIGHT + OTHER_GRIDS + LEFT
LINES = grid_cards().splitlines(keepends=True)
ON_PLANE = "".join(LINES[:3])
MIRROR = "SEBULK,1,PRIMARY\nSEBULK,2,MIRROR,1\nSEMPLN,2,PLANE,1,2,3\n"


def test_a_mirrored_part_is_the_other_half_written_out(read):
    mesh = read("CEND\nBEGIN BULK\n" + ON_PLANE + MIRROR + "BEGIN SUPER=1\n" + RIGHT)
    (m, ours), (m_whole, theirs) = frequencies(mesh), frequencies(read(WHOLE))
    assert m == pytest.approx(m_whole, rel=1e-12)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)


def test_a_part_that_is_mirrored_and_moved(read):
    """The image stands a quarter of a turn about z away, and 2 m up, and a note says in which order."""
    there = {90: (0, 0, 2), 91: (-1, 0, 2), 92: (0, 0, 3)}  # of grids 1, 2 and 3 of the image
    residual = ON_PLANE + "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in there.items())
    mesh = read("CEND\nBEGIN BULK\n" + residual + MIRROR + "SELOC,2,1,2,3,90,91,92\nBEGIN SUPER=1\n" + RIGHT)
    image = {number % 100: mesh.points[mesh.labels == number][0] for number in (204, 205, 209, 210)}
    for number, at in image.items():
        x, y, z = PLACES[number]
        np.testing.assert_allclose(at, [-y, -x, z + 2], atol=1e-12)
    assert "part 2: it has SELOC and SEMPLN: it is mirrored first and moved then" in mesh.notes


def write_output4(path, matrices):
    """Text of 17 digits: every column whole."""
    out = []
    for name, A in matrices.items():
        n = len(A)
        out.append(f"{n:8d}{n:8d}{6:8d}{2:8d}{name:8s}1P,3E24.16")
        for j, column in enumerate(A.T):
            out.append(f"{j + 1:8d}{1:8d}{n:8d}")
            out += ["".join(f"{v:24.16E}" for v in column[k : k + 3]) for k in range(0, n, 3)]
        out += [f"{n + 1:8d}{1:8d}{1:8d}", f"{1.0:24.16E}"]
    path.write_text("\n".join(out) + "\n")


EXTERNAL = "ASSIGN INPUTT4='part.op4',\n   UNIT=31 $ matrices\nCEND\nBEGIN BULK\n"
OTHERS = {4: 9, 8: 9, 14: 9}  # grids of the part with displacements in system 9


def external(read, tmp_path, extra=""):
    """The right half as matrices of all of its grids, the left half as elements."""
    mesh = read(grid_cards(but=USED, systems=OTHERS) + HALF + PROPERTIES + SYSTEM)
    model = assembled(mesh)
    own = np.array([[0.1, 0.2, 1.0], [1.0, 0.3, 0.0]])
    z = own[0] / np.linalg.norm(own[0])
    y = np.cross(z, own[1]) / np.linalg.norm(np.cross(z, own[1]))
    E = np.array([np.cross(y, z), y, z])
    turn = [E if int(number) in OTHERS else np.eye(3) for number in mesh.labels for _ in range(2)]
    T = block_diag(turn, format="csr")[model.dof.ravel() >= 0][:, model.dof.ravel() >= 0]
    K, M = ((T @ A @ T.T).toarray() for A in (model.K, model.M))
    write_output4(tmp_path / "part.op4", {"KAAX": K, "MAAX": M})
    rows = [
        (number, "".join(str(c + 1) for c in np.flatnonzero(dof >= 0)))
        for number, dof in zip(mesh.labels, model.dof, strict=True)
    ]
    extrn = "".join(f"EXTRN,{number},{components}\n" for number, components in rows if components)
    part = grid_cards(but=USED, systems=OTHERS) + SYSTEM + extrn
    left = OTHER_GRIDS + LEFT + PROPERTIES
    residual = ON_PLANE + LINES[6]
    return EXTERNAL + extra + residual + left + "SEBULK,1,EXTOP4,,,,,31\nBEGIN SUPER=1\n" + part


def test_a_part_from_a_file_of_matrices_is_its_elements(read, tmp_path):
    deck = external(read, tmp_path)
    (tmp_path / "deck.bdf").write_text(deck)
    before = mesh_digest(tmp_path / "deck.bdf")
    (m, ours), (m_whole, theirs) = frequencies(read(deck)), frequencies(read(WHOLE))
    assert m == pytest.approx(m_whole, rel=1e-12)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)
    (tmp_path / "deck.bdf").write_text(deck)
    (tmp_path / "part.op4").write_text("of another part")
    assert mesh_digest(tmp_path / "deck.bdf") != before  # caches know the file


def test_the_mirror_image_of_a_part_from_a_file(read, tmp_path):
    """The matrices of the right half and their mirror image are the whole."""
    start, part = external(read, tmp_path).split("BEGIN SUPER=1\n")
    residual = ON_PLANE + LINES[6]
    bar = "GRID,80,,0.,.5,.5\nCBAR,80,3,1,80,1.,0.,0.\n" + PROPERTIES  # a deck needs an element
    deck = (
        EXTERNAL
        + residual
        + bar
        + "SEBULK,1,EXTOP4,,,,,31\nSEBULK,2,MIRROR,1\nSEMPLN,2,PLANE,1,2,3\nBEGIN SUPER=1\n"
        + part
    )
    assert "LEFT" not in start
    (m, ours), (m_whole, theirs) = frequencies(read(deck)), frequencies(read(WHOLE + bar.split("PSHELL")[0]))
    assert m == pytest.approx(m_whole, rel=1e-12)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "said"),
    {
        ("UNIT=31", "UNIT=32"): "SEBULK 1: no file is assigned to unit 31; write ASSIGN INPUTT4",
        ("part.op4", "none.op4"): "SEBULK 1: the file none.op4 of unit 31 is not there",
        (
            "EXTRN,14,",
            "EXTRN,77,0,14,",
        ): "SEBULK 1: its matrices have 1 generalised coordinates, which no mesh has; read",
        ("EXTRN,14,123456", "EXTRN,14,12345"): "KAAX of part.op4 is 60x60, but EXTRN lists 59 rows",
        (
            "EXTRN,14,",
            "CBAR,1,3,8,9,1.,0.,0.\n" + PROPERTIES + "EXTRN,14,",
        ): "its part has elements and matrices; leave one",
        ("EXTRN,14,", "EXTRN,144,"): "EXTRN names grid 144, which is not in its part",
    }.items(),
)
def test_what_of_a_file_of_matrices_cannot_be_read(read, tmp_path, change, said):
    with pytest.raises(InputError, match=re.escape(said)):
        read(external(read, tmp_path).replace(*change))


@pytest.mark.parametrize(
    ("cards", "said"),
    {
        "SEBULK,2,MIRROR,1\n": "SEBULK 2: the mirror image of part 1 needs its place; add SEMPLN",
        MIRROR + "SELOC,1,1,2,3,1,2,3\n": "part 1, which it mirrors, is moved by SELOC in line 8; mirror it in place",
        "SEMPLN,1,PLANE,1,2,3\n": "SEMPLN 1: part 1 is no mirror image; write SEBULK,1,MIRROR,n",
        MIRROR.replace("PLANE", "AXIS"): "SEMPLN 2: a mirror of type 'AXIS' is not read; give PLANE and three grids",
        MIRROR.replace("1,2,3\n", "1,2,30\n"): "SEMPLN 2: grids [1, 2, 30] are not in the residual structure",
        MIRROR + "SEMPLN,2,PLANE,1,2,3\n": "SEMPLN 2: part 2 has another SEMPLN in line 7; keep one",
        "CSUPER,2,1,4,5\n": "CSUPER 2: it makes an image of grids and elements that GRID, SESET or SEELT give",
    }.items(),
)
def test_what_of_mirror_images_cannot_be_read(read, cards, said):
    with pytest.raises(InputError, match=re.escape(said)):
        read("CEND\nBEGIN BULK\n" + ON_PLANE.split("GRID,3")[0] + cards + "GRID,3,,0.,0.,1.\nBEGIN SUPER=1\n" + RIGHT)


def bars(numbers, joint):
    """Bars along x between grids, of which 6 lies at `joint`."""
    places = {k: joint if k == 6 else float(k - 1) for k in numbers}
    grids = "".join(f"GRID,{k},,{x},0.,0.\n" for k, x in places.items())
    return grids + "".join(f"CBAR,{k},3,{k},{k + 1},0.,1.,0.\n" for k in list(numbers)[:-1]) + PROPERTIES


def test_which_grids_in_one_place_are_joined(read):
    """Of two bars that meet in one place the joint is looked for within TOL, where SEBNDRY says, and not by SEEXCLD."""
    both = f"BEGIN SUPER=1\n{bars(range(6, 12), 5.001)}BEGIN SUPER=2\n{bars(range(1, 7), 5.0)}"
    count = {
        "": 12,
        "SEBULK,1,PRIMARY,,,.01\n": 11,
        "SEBULK,1,PRIMARY,,,.01\nSEEXCLD,1,2,6\n": 12,
        "SEBULK,1,PRIMARY,,,.01\nSEEXCLD,1,ALL,1,THRU,6\n": 12,
        "SEBULK,1,PRIMARY,,,.01\nSEEXCLD,1,3,6\n": 11,
        "SEBULK,1,PRIMARY,,,.01\nSEBNDRY,1,2,7\n": 12,
        "SEBULK,1,PRIMARY,,,.01\nSEBNDRY,1,ALL,6\n": 11,
    }
    for cards, points in count.items():
        assert len(read("CEND\nBEGIN BULK\nPARAM,POST,0\n" + cards + both).points) == points, cards
