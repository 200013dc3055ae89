"""OpenFAST, Simscape and Modelica: files read by parsers of their manuals; superelements by pyYeti's cbcheck."""

import io
import re

import numpy as np
import pytest
import scipy
from compare import assert_close
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body.mass import mass_matrix
from modalprep.examples import uniform_beam
from modalprep.formats.modelica import ARRAYS, write_modelica
from modalprep.formats.nastran import superelement
from modalprep.formats.openfast import write_extptfm
from modalprep.formats.simscape import write_simscape


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=4, truncation=("interfaces",)).with_(D=np.full(10, 0.3))


def flex_ascii(text):
    """Matrices and loads by the specification of FlexASCII: keywords in any case, one dimension line after each."""
    lines = text.splitlines()
    assert lines[0].startswith("!")
    assert "flex 5 format" in lines[1].lower()
    n = next(int(line.split(":")[1]) for line in lines[2:] if line.lower().startswith("!dimension:"))
    found = {}
    for at, line in enumerate(lines):
        for key in ("mass matrix", "stiffness matrix", "damping matrix", "loading"):
            if line.lower().startswith(f"!{key}"):
                rows = lines[at + 2 :] if key == "loading" else lines[at + 2 : at + 2 + n]
                found[key] = np.array([[float(x) for x in row.split()] for row in rows])
    head = {line.split(":")[0].lower(): float(line.split(":")[1]) for line in lines[3:5]}
    steps = head["!total simulation time in file"] / head["!time increment in simulation"]
    assert len(found["loading"]) == steps + 1
    return found


def test_extptfm(beam, tmp_path):
    """Clamped frequencies, rigid mass, and the weight at the root and in the modes."""
    found = flex_ascii(write_extptfm(beam, tmp_path / "b.dat").read_text())
    M, K, D = (found[f"{name} matrix"] for name in ("mass", "stiffness", "damping"))
    assert_close(M, mass_matrix(beam, np.zeros(beam.n)), 1e-14)
    w2 = eigh(K[6:, 6:], M[6:, 6:], eigvals_only=True)
    assert_close(np.sqrt(w2) / (2 * np.pi), np.sort(beam.frequency), 1e-9)
    assert (np.diag(D)[6:].tolist(), np.abs(K[:6]).max()) == ([0.3] * 10, 0.0)
    weight = found["loading"][0]
    assert_close(weight[1:7], np.array([0, 0, -1, 0, 5.0, 0]) * 12 * 9.80665, 1e-12)  # r x F at half of 10 m
    assert_close(weight[7:-1], -9.80665 * beam.S[2], 1e-12)
    with pytest.raises(mp.InputError, match="ExtPtfm needs reroot"):
        write_extptfm(beam.with_(interface_position=beam.interface_position + 1), tmp_path / "c.dat")


def test_simscape(beam, tmp_path):
    """Six rigid motions of the frames without force, with the mass of the body; free frequencies of both."""
    data = scipy.io.loadmat(write_simscape(beam, tmp_path / "b.mat"))
    K, M = data["stiffness"], data["mass"]
    R = np.zeros((len(K), 6))
    for k, (x, y, z) in enumerate(data["origins"]):
        R[6 * k : 6 * k + 6] = np.eye(6)
        R[6 * k : 6 * k + 3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    assert np.abs(K @ R).max() < 1e-9 * np.abs(K).max()
    assert_close(np.diag(R.T @ M @ R)[:3], np.full(3, beam.m), 1e-9)
    assert np.count_nonzero(eigh(K, M, eigvals_only=True) > 1) == len(K) - 6
    assert [str(name[0]) for name in data["interfaces"].ravel()] == ["root", "tip"]
    assert np.array_equal(data["orientations"], [[1, 0, 0, 0]] * 2)
    with pytest.raises(mp.InputError, match="a body of Simscape ends in .mat"):
        write_simscape(beam, tmp_path / "b.txt")


def record(text):
    """Parameters of a Modelica record: name, dimensions, and the array constructor in braces."""
    found = {}
    for name, shape, value in re.findall(r"parameter Real (\w+)\[([\d, ]+)\] = (\{.*\}) \"[^\"]*\";", text):
        numbers = np.array([float(word) for word in re.findall(r"[-+\d.e]+", value)])
        found[name] = numbers.reshape([int(d) for d in shape.split(",")])
    return found


@pytest.mark.parametrize("coupled", [False, True])
def test_modelica(beam, tmp_path, coupled):
    if coupled:
        beam = beam.with_(coupled_damping=np.diag(beam.D) + 0.1)
    text = write_modelica(beam, tmp_path / "beam.mo").read_text()
    found = record(text)
    assert found.keys() == {name for name in ARRAYS if coupled or name != "coupled_damping"}
    for name, values in found.items():
        assert np.array_equal(values, getattr(beam, name)), name
    assert text.startswith("record beam ")
    assert text.endswith("end beam;\n")
    assert f"parameter Real m = {beam.m!r} " in text
    with pytest.raises(mp.InputError, match="'1st' is no name in Modelica"):
        write_modelica(beam, tmp_path / "1st.mo")


def test_cbcheck_finds_exact_zeros(beam):
    """pyYeti's checks of a Craig-Bampton model write a warning where K_bq or the rest of K_qq are not zero."""
    cb = pytest.importorskip("pyyeti.cb")
    whole = superelement(beam)
    n = 6 * len(whole.physical)
    b = np.arange(n)
    assert not np.any(whole.K[:n, n:])
    assert np.array_equal(whole.K[n:, n:], np.diag(np.diag(whole.K)[n:]))
    said = io.StringIO()
    xyz = beam.interface_position[list(whole.physical)]
    uset = pytest.importorskip("pyyeti.nastran").n2p.addgrid(None, [1, 2], "b", 0, xyz, 0)
    cb.cbcheck(said, whole.M, whole.K, b, b[:6], uset, n_freefree_modes=8)
    assert said.getvalue().count("(should be zero) Okay") == 4, said.getvalue()  # M_qq twice, K_bq, K_qq
