"""External superelements of Nastran by EXTSEOUT: two parts of a frame, welded, against the whole frame.

inboard and outboard (op4, asm, pch), full.dat and its frequencies by NX Nastran are tests of pyYeti
(twmacro/pyyeti, tests/nas2cam_extseout). The decks are in mm, kg, s.
"""

import io
import json
import shutil
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import shared_data
from scipy.linalg import eigh, null_space

import modalprep as mp
from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.fe.readers.output4 import read_output4
from modalprep.reduction.synthesis import synthesise
from modalprep.supplied.extseout import read_extseout

DATA = shared_data.DATA / "nastran_cb"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the superelements are not in {DATA} (set MODALPREP_DATA)")
BOUNDARY = (3, 11, 19, 27)
WELDS = [(f"a.grid_{grid}", f"b.grid_{grid}") for grid in BOUNDARY]
UNITS = {"length_unit": "mm", "mass_unit": "kg"}
TO_BASIC = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # columns: axes of grid 11, CORD2R 10


@pytest.fixture(scope="module")
def inboard():
    return read_extseout(DATA / "inboard.op4", **UNITS)


@pytest.fixture(scope="module")
def outboard():
    return read_extseout(DATA / "outboard.op4", **UNITS)


@pytest.fixture(scope="module")
def nastran():
    """Frequencies of the whole frame, Hz."""
    return np.array([float(line.split()[1]) for line in (DATA / "full.frequencies.txt").read_text().splitlines()])


def fe_model(name):
    mesh = mp.read_mesh(DATA / f"{name}.dat", "mm", "kg")
    ends = {f"grid_{grid}": mp.Interface(node=grid, kind="node") for grid in BOUNDARY}
    return mesh, mp.assemble(mesh, mesh.properties, ends, mass="nastran")


def our_own(name, modes):
    """The deck by our elements, reduced as Nastran does: modes below a limit and residual vectors of six inertia loads.

    (Nastran adds those of the deck's loads in the inboard part.)
    """
    _, model = fe_model(name)
    loads = {"inertia of rigid motions": model.M @ model.rigid_body()}
    reduction = mp.craig_bampton(model, modes=modes, loads=loads, truncation=tuple(loads))
    return mp.flexible_body(model, reduction, name=name, second_order_mass=False)


def welded(a, b):
    found = synthesise({"a": a, "b": b}, WELDS, modes=30)
    assert found.rigid == 6
    return found.frequency


def test_contents(inboard, outboard):
    """1.755 and 1.590 kg; four boundary grids; 8 and 22 scalar points; grid 11 at (0, 300, 0) mm from grid 3."""
    assert inboard.interface_name == outboard.interface_name == tuple(f"grid_{grid}" for grid in BOUNDARY)
    assert (inboard.n, outboard.n) == (24 + 8 - 6, 24 + 22 - 6)
    np.testing.assert_allclose(inboard.interface_position[1], [0, 0.3, 0], atol=1e-12)
    for name, body in (("inboard", inboard), ("outboard", outboard)):
        rigid = fe_model(name)[1].rigid
        np.testing.assert_allclose(body.m, rigid.m, rtol=1e-7)  # cards of Nastran are in single precision
        np.testing.assert_allclose(body.s0, rigid.s0, rtol=0, atol=1e-7 * rigid.m)
        np.testing.assert_allclose(body.E0, rigid.E0, rtol=0, atol=1e-7 * rigid.E0.max())
        assert [check.name for check in mp.check_body(body) if not check.passed] == []


def test_weld_is_the_whole_frame(inboard, outboard, nastran):
    """Eighteen of the first twenty elastic modes to 2e-5, the 19th (47.8 Hz) to 1.1e-4.

    The 20th has 53.7 Hz, above the 50 Hz up to which Nastran kept modes: it is missing, and the next one that the
    kept vectors make lies at 69.5 Hz.
    """
    found, exact = welded(inboard, outboard)[6:26], nastran[6:26]
    np.testing.assert_allclose(found[:18], exact[:18], rtol=2e-5)
    np.testing.assert_allclose(found[18], exact[18], rtol=1.1e-4)
    assert np.all(found > exact * (1 - 3e-7))  # by Rayleigh and Ritz; the file has seven digits
    assert exact[19] > 50
    assert found[19] > 69


def test_truncation_explains_the_rest(inboard, outboard, nastran):
    """Our own elements, reduced to the same modes, give the same twenty: seen 3e-6, the 20th 1e-5.

    With the modes to 70 Hz, three more, the 20th is that of the whole frame.
    """
    same = welded(our_own("inboard", 3), our_own("outboard", 16))
    np.testing.assert_allclose(same[6:26], welded(inboard, outboard)[6:26], rtol=1.5e-5)
    more = welded(our_own("inboard", 3), our_own("outboard", 24))
    np.testing.assert_allclose(more[6:26], nastran[6:26], rtol=1e-4)


def test_units_of_the_deck(inboard):
    """The same file taken as inches and slinches: 25.4 times as large and 175 times as heavy, as stiff per mass."""
    other = read_extseout(DATA / "inboard.op4", length_unit="in", mass_unit="slinch")
    slinch = mp.fe.MASS_UNITS["slinch"] if hasattr(mp.fe, "MASS_UNITS") else 0.45359237 * 9.80665 / 0.0254
    np.testing.assert_allclose(other.m, slinch * inboard.m, rtol=1e-12)
    np.testing.assert_allclose(other.interface_position, 25.4 * inboard.interface_position, rtol=1e-12)
    np.testing.assert_allclose(other.E0, slinch * 25.4**2 * inboard.E0, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(other.frequency, inboard.frequency, rtol=1e-7)  # stiff ones of 68 kHz beside 4 Hz


def test_files_beside_and_one_of_them_alone(inboard, tmp_path):
    """The .pch file alone, the .asm file alone, or files of other names that are given."""
    for suffix in (".pch", ".asm"):
        place = tmp_path / suffix[1:]
        place.mkdir()
        for copied in (".op4", suffix):
            shutil.copy(DATA / f"inboard{copied}", place / f"part{copied}")
        found = read_extseout(place / "part.op4", **UNITS)
        np.testing.assert_array_equal(found.frequency, inboard.frequency)
        assert bool(found.recovery) == (suffix == ".pch")
    given = read_extseout(tmp_path / "asm" / "part.op4", punch=DATA / "inboard.pch", root="grid_27", **UNITS)
    assert given.interface_name[0] == "grid_27"
    assert set(given.recovery) == {"MUG1", "MES1", "MEF1"}
    moved = mp.body.reroot(inboard, "grid_27")
    np.testing.assert_allclose(given.frequency, moved.frequency, rtol=1e-7)  # stiff ones of 68 kHz beside 4 Hz


def test_recovered_displacements_are_those_of_the_boundary(inboard):
    """MUG1 of the boundary grids, grid 11 in its own axes, as the interfaces move."""
    found = inboard.recovery["MUG1"]
    rows = {label: mode for label, mode in zip(found.places, found.q[:, 0], strict=True)}
    for k, grid in enumerate(BOUNDARY):
        Q = TO_BASIC if grid == 11 else np.eye(3)
        moved = np.array([rows[f"grid_{grid}.t{c}"] for c in (1, 2, 3)])
        turned = np.array([rows[f"grid_{grid}.r{c}"] for c in (1, 2, 3)])
        size = np.abs(inboard.phi).max()
        np.testing.assert_allclose(Q @ moved, inboard.phi[k], atol=2e-7 * size)  # MUG1 is in single precision
        np.testing.assert_allclose(Q @ turned, inboard.psi[k], atol=2e-7 * np.abs(inboard.psi).max())


def held(body, q):
    """Return what is recovered at one state of a body whose frame is at rest."""
    motion = mp.body.at_rest(q[None], interfaces=len(body.interface_name))
    return {name: float(values[0]) for name, values in body.recovered(motion).items()}


def held_modes(model, count):
    """Modes (n_dof, count) of our own elements with every boundary grid held, unit modal mass."""
    held = np.concatenate([frame.dofs for frame in model.interfaces])
    free = np.setdiff1d(np.flatnonzero(model.K.diagonal() > 0), held)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    found = np.zeros((model.n_dof, count))
    found[free] = eigh(K, M, subset_by_index=(0, count - 1))[1]
    return found


def held_coordinates(body, count):
    """Coordinates (n, count) of the same modes in a body: the lowest of those that leave its interfaces at rest."""
    moved = np.concatenate([body.phi[1:], body.psi[1:]], axis=1).reshape(-1, body.n)
    still = null_space(moved / np.abs(moved).max(axis=1, keepdims=True), rcond=1e-9)
    return still @ eigh(still.T @ np.diag(body.K) @ still)[1][:, :count]


def test_recovered_rows_in_a_vibration(inboard):
    """Three modes with the boundary held, which are exact in the reduced body: Nastran's rows, and our bars by hand.

    Displacement of grids 4 and 16; axial force ``E A`` times the elongation over the length, torque ``G J`` times the
    twist over it; axial stress of three bars. The matrices are in single precision, as the density on Nastran's cards.
    """
    mesh, model = fe_model("inboard")
    modes, coordinates = held_modes(model, 3), held_coordinates(inboard, 3)
    row = {int(label): k for k, label in enumerate(mesh.labels)}
    for u, q in zip(modes.T, coordinates.T, strict=True):
        at = u[model.dof]
        ours = np.array([at[row[grid], c] for grid in (4, 16) for c in range(3)])
        names = [f"MUG1.grid_{grid}.t{c}" for grid in (4, 16) for c in (1, 2, 3)]
        sign = np.sign(ours @ [held(inboard, q)[name] for name in names])
        found = held(inboard, sign * q)
        np.testing.assert_allclose([found[name] for name in names], ours, rtol=0, atol=1e-5 * np.abs(ours).max())
        bars = np.array([by_hand(mesh, at, element, row) for element in (10, 97)])[:, :2]
        there = [[found[f"MEF1.CBAR_{element}.{name}"] for name in ("axial", "torque")] for element in (10, 97)]
        np.testing.assert_allclose(there, bars, rtol=0, atol=1e-6 * np.abs(bars).max())
        stresses = [by_hand(mesh, at, element, row)[2] for element in (11, 23, 89)]
        there = [found[f"MES1.CBAR_{element}.axial"] for element in (11, 23, 89)]
        np.testing.assert_allclose(there, stresses, rtol=0, atol=1e-6 * np.abs(stresses).max())
        assert np.abs(bars).max() > 100


def by_hand(mesh, u, element, row):
    """Axial force, torque and axial stress of a CBAR from the motion of its ends."""
    bar = next(line.split() for line in (DATA / "inboard.blk").read_text().splitlines()
               if line.split()[:2] == ["CBAR", str(element)])  # fmt: skip
    a, b = row[int(bar[3])], row[int(bar[4])]
    section = mesh.properties[f"pbar_{bar[2]}"]
    along = mesh.points[b] - mesh.points[a]
    length = np.linalg.norm(along)
    stretch, twist = ((u[b, part] - u[a, part]) @ along / length**2 for part in (slice(3), slice(3, 6)))
    E, G = section.material.E, section.material.E / (2 * (1 + section.material.nu))
    return E * section.A * stretch, G * section.J * twist, E * stretch


def test_effective_masses_are_those_of_pyyeti(inboard, outboard):
    """Of the modes with all boundary grids held, about grid 3, from the same files."""
    with np.printoptions():
        cb, bulk, op4 = (pytest.importorskip(f"pyyeti.{name}") for name in ("cb", "nastran.bulk", "nastran.op4"))
    for name, body in (("inboard", inboard), ("outboard", outboard)):
        uset, _, b = bulk.asm2uset(str(DATA / f"{name}.asm"))
        read = op4.read(str(DATA / f"{name}.op4"))
        b = np.flatnonzero(b)
        with patch("builtins.print"), np.printoptions():
            found = cb.cbcheck(
                io.StringIO(),
                read["mxx"],
                read["kxx"],
                b,
                b[:6],
                uset.iloc[b],
                uref=3,
                rb_norm=True,
                n_freefree_modes=12,
            )
        ours = body.modes.effective_mass[: len(read["kxx"]) - 24]
        unit = np.array([1.0] * 3 + [1e-6] * 3)  # kg and kg mm^2
        np.testing.assert_allclose(ours, found.effmass * unit, rtol=1e-6, atol=1e-9 * body.m)


PIPELINE = """
[bodies.a]
file = "inboard.h5"
[bodies.b]
file = "outboard.h5"
{welds}
[synthesis]
modes = 25
[output]
pictures = "none"
"""


def test_pipeline_file_welds_them(inboard, outboard, tmp_path, capsys):
    """As modal files in a [synthesis], by the road of all welds."""
    for name, body in (("inboard", inboard), ("outboard", outboard)):
        mp.write_body(body, tmp_path / f"{name}.h5")
    welds = "".join(f'[welds.w{k}]\nbetween = ["{a}", "{b}"]\n' for k, (a, b) in enumerate(WELDS))
    (tmp_path / "frame.toml").write_text(PIPELINE.format(welds=welds))
    assert main(["run", str(tmp_path / "frame.toml"), "--json", "--no-report"]) == 0
    capsys.readouterr()
    found = json.loads((tmp_path / "output" / "frame" / "frame-synthesis.json").read_text())
    np.testing.assert_allclose(found["frequency_Hz"][6:], welded(inboard, outboard)[6:25], rtol=1e-12)


def test_check_says_what_is_known(inboard, tmp_path, capsys):
    file = mp.write_body(inboard, tmp_path / "inboard.h5")
    assert main(["check", str(file), "--speed", "5"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for words in ("known exactly: mass, first moment and inertia", "rebuilt: the symmetric part of H", "at 5 rad/s"):
        assert words in printed
    assert main(["check", str(file), "--speed", "5", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["checks"][-1]["name"] == "rebuilt terms"
    assert 0.01 < found["checks"][-1]["value"] < 0.1
    assert len(found["notes"]) == 3


@pytest.fixture
def part(tmp_path):
    """A copy of the inboard part to damage."""
    for suffix in (".op4", ".asm", ".pch"):
        shutil.copy(DATA / f"inboard{suffix}", tmp_path / f"part{suffix}")
        (tmp_path / f"part{suffix}").chmod(0o644)
    return tmp_path / "part.op4"


def edited(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_bad_files_are_one_sentence(part):
    cases = [
        (".pch", "EXTRN          3  123456", "EXTRN          3     123", "the boundary (EXTRN) 29"),
        (".pch", "EXTRN          3", "EXTRN          4", "names grid 4 on the boundary"),
        (".pch", "EXTRN          3  123456", "EXTRN          3  123457", "components '123457'"),
        (".pch", "EXTRN          3  123456", "EXTRN         11  123456", "point 11 stands there twice"),
        (".pch", "EXTRN  ", "XTRN   ", "has no EXTRN card"),
        (".pch", "0.600000000E+03 0.300000000E+03\n", "0.600000000E+03 0.400000000E+03\n", "resists a rigid"),
        (".pch", "CORD2R* ", "CORD9R* ", "coordinate system 10 is not in the deck"),
        (".pch", "        1       3       6       1 ", "        1       3       6       99", "names row"),
        (".pch", "        1       3       6       1 ", "        1       3       6       -1", "rows count from 1"),
        (".pch", "        1       3       6       1 ", "        1       3       0       1 ", "damaged or cut short"),
    ]  # fmt: skip
    for suffix, old, new, said in cases:
        file = part.with_suffix(suffix)
        kept = file.read_text()
        edited(file, old, new)
        with pytest.raises(InputError, match=said.replace("(", r"\(").replace(")", r"\)")) as caught:
            read_extseout(part, **UNITS)
        assert "\n" not in str(caught.value)
        file.write_text(kept)


def test_missing_files(part):
    with pytest.raises(InputError, match="does not exist"):
        read_extseout(part.with_name("other.op4"))
    with pytest.raises(InputError, match="mass_unit"):
        read_extseout(part, length_unit="mm")
    with pytest.raises(InputError, match="'grid_4' does not exist"):
        read_extseout(part, root="grid_4", **UNITS)
    part.with_suffix(".op2").write_bytes(b"x")
    with pytest.raises(InputError, match=r"read from .op4 files"):
        read_extseout(part.with_suffix(".op2"))
    part.with_suffix(".asm").unlink()
    part.with_suffix(".pch").unlink()
    with pytest.raises(InputError, match="neither part.asm nor part.pch"):
        read_extseout(part, **UNITS)


def sentence(part):
    """What the reader says of a damaged file; nothing where the damage does not matter."""
    try:
        read_extseout(part, **UNITS)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("suffix", [".op4", ".asm", ".pch"])
def test_truncated_files(part, suffix):
    """Cut at forty places: a body (where the rest is not needed) or one sentence."""
    if suffix == ".asm":
        part.with_suffix(".pch").unlink()
    file = part.with_suffix(suffix)
    content, said = file.read_bytes(), []
    for cut in np.linspace(0, len(content) - 1, 40).astype(int):
        file.write_bytes(content[:cut])
        said.append(sentence(part))
    assert not any("\n" in text for text in said)
    assert sum(bool(text) for text in said) > 5


@pytest.mark.parametrize("suffix", [".op4", ".pch"])
def test_garbled_files(part, suffix):
    """Three bytes exchanged at random, of the matrices among the first 400, which have the headers."""
    rng, file = np.random.default_rng(0), part.with_suffix(suffix)
    content, said = file.read_bytes(), []
    for _ in range(40):
        bad = bytearray(content)
        for at in rng.integers(0, len(bad) if suffix == ".pch" else 400, 3):
            bad[at] = rng.integers(0, 256) if suffix == ".op4" else rng.integers(32, 127)
        file.write_bytes(bytes(bad))
        said.append(sentence(part))
    assert not any("\n" in text for text in said)
    assert any(said)


def test_boundary_grid_with_one_component():
    """A part of pyYeti's own tests, in inches: grid 475 has its second component alone; 3 + 1/6 grids, 10 modes.

    Its free-free frequencies are those of KAA and MAA, and MUG1 has 3108 rows for grids and ten scalar points.
    """
    pyyeti = pytest.importorskip("pyyeti")
    file = Path(pyyeti.__file__).parent / "tests" / "nas2cam_extseout" / "reduced_bset_notall6.op4"
    if not file.is_file():
        pytest.skip("this pyYeti comes without its tests")
    body = read_extseout(file, length_unit="in", mass_unit="slinch")
    assert (body.n, len(body.interface_name)) == (19 + 10 - 6, 4)
    assert "grid_475" in body.provenance["not known"]
    K, M = (read_output4(file)[name].toarray() for name in ("KAA", "MAA"))
    free = np.sqrt(eigh(K, M, eigvals_only=True)[6:]) / (2 * np.pi)
    np.testing.assert_allclose(mp.body.in_mean_axes(body).frequency[:15], free[:15], rtol=1e-6)
    labels = body.recovery["MUG1"].places
    assert sum(label.startswith("point_") for label in labels) == 10
    assert len(labels) == 3108 - 5 * 10
