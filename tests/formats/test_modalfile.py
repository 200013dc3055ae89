"""The modal file: lossless, self-describing, refused when foreign."""

import json
from dataclasses import fields

import h5py
import numpy as np
import pytest

import modalprep as mp
from modalprep.formats.modalfile import SHAPES


@pytest.fixture
def file(bracket_body, tmp_path):
    return mp.write_body(bracket_body, tmp_path / "bracket.h5")


def test_round_trip_is_lossless(file, bracket_body):
    back = mp.read_body(file)
    for field in fields(bracket_body):
        a, b = getattr(bracket_body, field.name), getattr(back, field.name)
        if isinstance(a, np.ndarray):
            assert np.array_equal(a, b), field.name
    assert back.name == bracket_body.name
    assert back.interface_name == bracket_body.interface_name
    assert back.provenance == bracket_body.provenance
    assert back.modes.reason == bracket_body.modes.reason
    assert np.array_equal(back.modes.effective_mass, bracket_body.modes.effective_mass, equal_nan=True)
    assert np.array_equal(back.cells["tetra10"], bracket_body.cells["tetra10"])


def test_datasets_are_where_other_programs_look(file, bracket_body):
    n, k = bracket_body.n, 2
    with h5py.File(file) as h5:
        for name in "m s0 E0 S H P Kg_A Kg_W Kg_F Kg_T phi psi K D frequency interface_position".split():
            assert h5[name].shape == SHAPES[name](n, k), name
        assert [x.decode() for x in h5["interface_name"][()]] == ["bolt_a", "bolt_b"]
        assert set(h5["modes"].dtype.names) == {"kind", "frequency", "effective_mass", "kept", "reason"}
        assert h5["shape"].shape == (len(h5["points"]), 3, n)
        assert (h5.attrs["format"], h5.attrs["format_version"], h5.attrs["units"]) == ("modalprep", 2, "SI")
        assert len(json.loads(h5.attrs["inputs"])["mesh_sha256"]) == 64


def test_newer_version_is_refused(file):
    with h5py.File(file, "a") as h5:
        h5.attrs["format_version"] = 99
    with pytest.raises(mp.InputError, match="format version 99, this program reads up to 2; update modalprep"):
        mp.read_body(file)


def test_failed_write_leaves_nothing(bracket_body, tmp_path):
    broken = bracket_body.with_(provenance={"bad": object()})
    with pytest.raises(TypeError):
        mp.write_body(broken, tmp_path / "b.h5")
    assert list(tmp_path.iterdir()) == []


def test_result_files(tmp_path):
    run = mp.Result(
        time=np.arange(3.0),
        channels={"a.angle": np.arange(3.0), "b.tip.position": np.ones((3, 3))},
        status="done",
        message="m",
        stats={"method": "explicit", "steps": 12, "energy_error": 1e-9},
    )
    back = mp.read_result(mp.write_result(run, tmp_path / "r.h5", {"other": run}))
    assert np.array_equal(back["b.tip.position.y"], np.ones(3))
    assert back.stats == run.stats
    assert type(back.stats["steps"]) is int
    lines = mp.formats.write_csv(run, tmp_path / "r.csv").read_text().splitlines()
    assert lines[0] == "time,a.angle,b.tip.position.x,b.tip.position.y,b.tip.position.z"
    assert lines[3] == "2,2,1,1,1"


def test_strain_energy_of_the_cells_is_kept(file, bracket_body):
    back = mp.read_body(file)
    assert np.array_equal(back.energy["tetra10"], bracket_body.energy["tetra10"])
    assert back.energy["tetra10"].dtype == np.float32
    assert np.array_equal(back.volume["tetra10"], bracket_body.volume["tetra10"])


def test_file_without_strain_energy_is_read(file, bracket_body):
    with h5py.File(file, "a") as h5:
        del h5["energy"], h5["volume"], h5.attrs["checksum"]
        h5.attrs["format_version"] = 1  # which had no checksum
    back = mp.read_body(file)
    assert (back.energy, back.volume) == ({}, {})
    assert np.array_equal(back.shape, bracket_body.shape)
    assert mp.read_body(mp.write_body(back, file)).energy == {}


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("energy", lambda x: x[:, 1:], "energy/tetra10 has shape"),
        ("energy", lambda x: -x, "energy/tetra10 has negative values"),
        ("energy", lambda x: np.full_like(x, np.nan), "energy/tetra10 holds values that are not numbers"),
        ("volume", lambda x: x[1:], "volume/tetra10 has shape"),
    ],
)
def test_damaged_strain_energy_is_refused(file, name, change, words):
    with h5py.File(file, "a") as h5:
        values = change(h5[f"{name}/tetra10"][()])
        del h5[f"{name}/tetra10"]
        h5[f"{name}/tetra10"] = values
    with pytest.raises(mp.InputError, match=words):
        mp.read_body(file)


def test_energy_of_some_cells_only_is_refused(file):
    with h5py.File(file, "a") as h5:
        h5.move("energy/tetra10", "energy/other")
    with pytest.raises(mp.InputError, match=r"damaged.*write it again"):
        mp.read_body(file)


def test_a_body_linearised_in_its_modes_is_read(bracket_body, tmp_path):
    """Its P is zero, which is no damage."""
    assert not mp.read_body(mp.write_body(bracket_body.ruthless(), tmp_path / "ruthless.h5")).P.any()
