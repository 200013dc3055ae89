"""Part superelements (BEGIN SUPER): joined parts are the structure that was not divided."""

import shutil

import numpy as np
import pytest
import shared_data
from scipy.linalg import eigh

import modalprep as mp
from modalprep.errors import InputError
from modalprep.reduction import synthesise

DATA = shared_data.DATA / "superelements"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the folder of foreign decks is not there")

SECTION = "PBAR,1,1,.1,.01,.01,.001\nMAT1,1,2.9+7,1.1+7,.3,7.357-4\n"
GRIDS = [f"GRID,{i + 1},,{float(i)},0.,0.\n" for i in range(11)]
BARS = [f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0.\n" for i in range(10)]
WHOLE = "".join(GRIDS) + "".join(BARS) + SECTION + "SPC,1,1,123456\n"
ONE = "".join(GRIDS[5:]) + "".join(BARS[5:]) + SECTION
TWO = "".join(GRIDS[:6]) + "".join(BARS[:5]) + SECTION + "SPC,1,1,123456\n"
JOINED = "SECONCT,1,0\n,6,6\nSECONCT,2,0\n,6,6\n"
RESIDUAL = "GRID,6,,5.,0.,0.\n"
BASE = {"base": mp.Interface(kind="support")}


def parts(residual, one=ONE, two=TWO):
    return "CEND\nBEGIN BULK\n" + residual + "BEGIN SUPER=1\n" + one + "BEGIN SUPER=2\n" + two


def frequencies(mesh, held):
    model = mp.assemble(mesh, {}, BASE, supports={name: mp.Support(set=name) for name in held}, mass="nastran")
    return mp.craig_bampton(model, modes=6).table.frequency[:6]


JOINS = {
    "by pairs": RESIDUAL + JOINED,
    "by pairs alone": RESIDUAL + JOINED + "SEBULK,1,PRIMARY,,MANUAL\nSEBULK,2,PRIMARY,,MANUAL\n",
    "by ranges": RESIDUAL + JOINED.replace(",6,6\n", ",6,THRU,6,6,THRU,6\n"),
    "by places": RESIDUAL + "SEBULK,1,PRIMARY\n",
    "part to part": "PARAM,POST,0\n",
    "in the residual": "".join(GRIDS[5:]) + "".join(BARS[5:]) + SECTION,
}


@pytest.mark.parametrize("residual", JOINS.values(), ids=list(JOINS))
def test_joined_parts_are_the_whole(read, residual):
    whole = frequencies(read(WHOLE), ["spc_1"])
    inside = residual is JOINS["in the residual"]
    mesh = read(parts(residual, "PARAM,POST,0\n" if inside else ONE), name="parts.dat")
    assert len(mesh.points) == 11
    assert sorted(mesh.labels.tolist()) == list(range(1, 12))
    np.testing.assert_allclose(frequencies(mesh, ["part2_spc_1"]), whole, rtol=1e-10)
    assert {"part2_pbar_1", "part2_spc_1"} <= set(mesh.groups)


def test_numbers_that_parts_share(read):
    """Part 2 numbers its grids as part 1 does; its own numbers follow its number."""
    shifted = TWO
    for old in range(6, 0, -1):
        shifted = shifted.replace(f"GRID,{old},", f"GRID,{old + 5},")
    bars = "".join(f"CBAR,{i + 1},1,{i + 6},{i + 7},0.,1.,0.\n" for i in range(5))
    two = "".join(line + "\n" for line in shifted.splitlines() if not line.startswith(("CBAR", "SPC"))) + bars
    mesh = read(parts(RESIDUAL + "SECONCT,1,0\n,6,6\nSECONCT,2,0\n,11,6\n", two=two + "SPC,1,6,123456\n"))
    assert mesh.labels.tolist() == [6, 7, 8, 9, 10, 11, 206, 207, 208, 209, 210]
    np.testing.assert_allclose(frequencies(mesh, ["part2_spc_1"]), frequencies(read(WHOLE), ["spc_1"]), rtol=1e-10)
    assert mp.Support(node=206).nodes(mesh, np.arange(11)).tolist() == [6]


def test_a_part_that_repeats_another(read):
    """Half of the bar, and the same once more at its end, is the whole bar."""
    half = "".join(GRIDS[:6]) + "".join(BARS[:5]) + SECTION + "GRID,90,,0.,1.,0.\n"
    there = RESIDUAL + "GRID,107,,6.,0.,0.\nGRID,190,,5.,1.,0.\n"
    repeat = "SEBULK,1,PRIMARY\nSEBULK,2,REPEAT,1\nSELOC,2,1,2,90,6,107,190\n"
    mesh = read("CEND\nBEGIN BULK\n" + there + repeat + "BEGIN SUPER=1\n" + half, name="repeat.dat")
    root = {"root": mp.Interface(node=1, kind="node")}
    ours, theirs = (mp.assemble(m, {}, root) for m in (mesh, read(WHOLE)))
    assert ours.rigid.m == pytest.approx(theirs.rigid.m, rel=1e-12)
    found = [mp.craig_bampton(m, modes=5, truncation=[]).frequency for m in (ours, theirs)]
    np.testing.assert_allclose(*found, rtol=1e-9)
    assert {"part1_pbar_1", "part2_pbar_1"} <= set(mesh.groups)


def turned(x, y):
    """A place of part 1 where it was made: a quarter of a turn away, and elsewhere."""
    return 40.0 - y, x + 3.0


def test_a_part_that_is_moved_into_place(read):
    """Part 1 lies elsewhere in its own deck, with its orientations, a mass off its grid and a system of its own."""
    extra = (
        "GRID,90,,5.,1.,0.\nCORD2R,4,,5.,0.,0.,5.,0.,1.\n,6.,0.,0.\nGRID,91,4,2.,.5,0.,4\nCONM2,95,91,,8.,.3,.1,.2\n"
    )
    extra += ",1.,.1,2.,.2,.3,3.\nCBAR,92,1,8,91,0.,0.,1.\n"
    residual = RESIDUAL + "GRID,97,,6.,0.,0.\nGRID,98,,5.,1.,0.\n"
    whole = read(parts(residual, one=ONE + extra))
    grids = "".join(f"GRID,{k + 1},,{turned(k, 0)[0]},{turned(k, 0)[1]},0.\n" for k in range(5, 11))
    bars = "".join(BARS[5:]).replace("0.,1.,0.", "-1.,0.,0.")
    cord = "CORD2R,4,,40.,8.,0.,40.,8.,1.\n,40.,9.,0.\n"
    there = f"GRID,90,,39.,8.,0.\n{cord}GRID,91,4,2.,.5,0.,4\nCONM2,95,91,4,8.,.3,.1,.2\n,1.,.1,2.,.2,.3,3.\n"
    there += "CBAR,92,1,8,91,0.,0.,1.\n"
    moved = read(parts(residual + "SELOC,1,6,7,90,6,97,98\n", one=grids + bars + SECTION + there))
    np.testing.assert_allclose(moved.points, whole.points, atol=1e-12)
    found = [frequencies(mesh, ["part2_spc_1"]) for mesh in (moved, whole)]
    np.testing.assert_allclose(*found, rtol=1e-10)


BAD = {
    "no number": (WHOLE + "BEGIN SUPER\n", "the number of the superelement is missing"),
    "moved by a grid that is not there": (
        parts(RESIDUAL + "SELOC,1,6,7,90,6,97,98\n", one=ONE + "GRID,90,,5.,1.,0.\n"),
        r"SELOC 1: grids \[6, 97, 98\] are not in the residual structure",
    ),
    "a copy of none": (parts(RESIDUAL + "SEBULK,3,REPEAT,7\n"), "SEBULK 3: part 7, which it repeats, has no cards"),
    "a copy with cards": (parts(RESIDUAL + "SEBULK,2,REPEAT,1\n"), "SEBULK 2: it has cards of its own"),
    "a copy in place": (parts(RESIDUAL + "SEBULK,3,REPEAT,1\n"), "SEBULK 3: a copy of part 1 needs its place"),
    "moved by grids on a line": (parts("".join(GRIDS[5:8]) + "SELOC,1,6,7,8,6,7,8\n"), "lie on one line"),
    "external, number after a space": (
        "CEND\nBEGIN BULK\n" + RESIDUAL + "SEBULK,101,EXTOP4\nBEGIN SUPER      101\n" + ONE,
        "its part has no EXTRN, which lists the rows of its matrices",
    ),
    "external, without its part": (
        WHOLE + "SEBULK,9,EXTOP4,,,,,31\n",
        "SEBULK 9: its part has no grids; INCLUDE its .pch",
    ),
    "external": (parts(RESIDUAL + "SEBULK,1,EXTERNAL\n"), "a part of type EXTERNAL is not read"),
    "not there": (parts(RESIDUAL + "SECONCT,1,0\n,60,6\n"), "grids 60 and 6 cannot be joined"),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=list(BAD))
def test_one_sentence(read, text, said):
    with pytest.raises(InputError, match=said):
        read(text)


@needs_data
def test_two_parts_of_a_cantilever_as_nastran_has_them(tmp_path):
    """MSC Nastran's frequencies of the undivided beam (data/superelements)."""
    (tmp_path / "deck").mkdir()
    for file in DATA.glob("cantileverBar?.dat"):
        shutil.copy(file, tmp_path)
    shutil.copy(DATA / "cbSuper3Modes.dat", tmp_path / "deck")
    expected = [349.7288, 2167.324, 6007.803, 11650.23]  # noReduction.f06
    for path, held in (
        (tmp_path / "deck" / "cbSuper3Modes.dat", ["part2_spc_1", "part1_grid_ps", "part2_grid_ps"]),
        (DATA / "noReduction.dat", ["spc_1", "grid_ps"]),
    ):
        mesh = mp.read_mesh(path)
        model = mp.assemble(mesh, {}, BASE, supports={name: mp.Support(set=name) for name in held}, mass="nastran")
        K, M = ((model.C.T @ A @ model.C).toarray() for A in (model.K, model.M))
        root = np.searchsorted(model.free, model.interfaces[0].dofs)
        keep = np.setdiff1d(np.arange(len(K)), root)
        K, M = K[np.ix_(keep, keep)], M[np.ix_(keep, keep)]
        flexibility = np.linalg.inv(K)  # the rotations have no mass: 1 / w^2 are the eigenvalues of m K^-1 m, m^2 = M
        root = np.sqrt(np.diag(M))
        found = np.sort(1 / np.sqrt(eigh(root[:, None] * flexibility * root, eigvals_only=True)[-4:])) / (2 * np.pi)
        np.testing.assert_allclose(found, expected, rtol=1e-6)  # seven digits are printed


def part_of_a_cantilever(file, modes, **interfaces):
    """Craig-Bampton body of one part along x with its interfaces at these x, fixed, and the lumped mass of Nastran."""
    fixed = {name: mp.Interface(near=(x, 0, 0), boundary="fixed") for name, x in interfaces.items()}
    model = mp.assemble(mp.read_mesh(DATA / file), {}, fixed, mass="nastran")
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name=file)


@needs_data
def test_two_superelements_of_three_modes_as_nastran_has_them():
    """MSC Nastran's component modes and frequencies of the two welded parts (cbSuper3Modes.f06), seven digits.

    Nastran's beam is plane; here each bending mode comes twice, and the parts have axial modes, one or two below their
    third bending modes.
    """
    inner = part_of_a_cantilever("cantileverBar2.dat", 8, root=0.0, tip=5.0)
    outer = part_of_a_cantilever("cantileverBar1.dat", 7, root=5.0)
    of_part = outer.frequency[[0, 2, 5]]
    np.testing.assert_allclose(of_part, [1380.011, 8287.086, 22364.10], rtol=4e-7)
    whole = synthesise({"inner": inner, "outer": outer}, [("inner.tip", "outer.root")], ground=["inner.root"])
    x, y, z = np.abs(whole.nodal_shape("outer")).max(axis=0)
    bending = whole.frequency[np.maximum(y, z) > x]
    expected = np.repeat([349.7289, 2167.436, 6008.068, 11670.88, 19073.61], 2)
    np.testing.assert_allclose(bending[:10], expected, rtol=4e-7)


def test_ranges_are_joined_grid_by_grid(read):
    """Two rows of three grids in the same places: three points are left."""
    rows = [
        "".join(f"GRID,{first + k},,{float(k)},0.,0.\n" for k in range(3))
        + "".join(f"CBAR,{1 + k},1,{first + k},{first + k + 1},0.,1.,0.\n" for k in range(2))
        + SECTION
        for first in (1, 11)
    ]
    manual = "SEBULK,1,PRIMARY,,MANUAL\nSEBULK,2,PRIMARY,,MANUAL\n"
    for joined, points in (("", 6), ("SECONCT,1,2\n,1,THRU,3,11,THRU,13\n", 3)):
        mesh = read(parts("PARAM,POST,0\n" + manual + joined, *rows), name="parts.dat")
        assert len(mesh.points) == points
