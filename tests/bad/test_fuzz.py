"""Damaged input at random: exit code 0, 1 or 2 with one message; never a traceback, a hang, NaN or half a file.

`MODALPREP_FULL=100` makes a hundred times as many cases as the full size has, and others each time.
"""

import _thread
import io
import os
import re
import shutil
import tomllib
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from threading import Timer
from unittest.mock import patch

import h5py
import numpy as np
import pytest
import tomli_w
from bad import good
from bad.decks import KINDS, write_matrices_of_the_part
from bad.mutations import of_bytes, of_tables, places
from fe.readers.boxes import BDF, CDB, INP
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from size import FULL, cases

import modalprep as mp
from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.fe.external.files import read_matrices
from modalprep.fe.readers.text import Lines
from modalprep.pipeline.schema.load import load_pipeline

PATIENCE = 300.0  # s; the slowest case takes some seconds, and a minute or two where it compiles another variant
SHIPPED = Path(__file__).parents[2] / "pipelines"
NOT_FINITE = re.compile(r"(?<![\w.])[-+]?(nan|inf|infinity)(?![\w.])", re.IGNORECASE)
COMMANDS = {
    "beam.msh": ("modes", "job.toml"),
    "plate.inp": ("modes", "plate.toml"),
    "deck.bdf": ("modes", "deck.toml"),
    "body.h5": ("simulate", "system.toml"),
    "k.mtx": ("modes", "matrices.toml"),
}
BOXES = {
    f"box.{kind}": text for kind, text in (("bdf", BDF["own markers"]), ("inp", INP["bricks"]), ("cdb", CDB["sets"]))
}
READERS = {
    **dict.fromkeys(BOXES, mp.read_mesh),
    **dict.fromkeys(("beam.msh", "plate.inp", "deck.bdf", "plate.vtu"), mp.read_mesh),
    "body.h5": mp.read_body,
    "run.h5": mp.read_result,
    "k.mtx": lambda file: read_matrices(stiffness=file, mass=file, nodes=file.with_name("nodes.csv")),
    "nodes.csv": lambda file: read_matrices(
        stiffness=file.with_name("k.mtx"), mass=file.with_name("m.mtx"), nodes=file
    ),
    "model.npz": lambda file: read_matrices(file=file),
}
CAPS = {"t_end": 2e-3, "modes": 8, "count": 8, "points": 40, "up_to": 1e3, "elements": 8, "segments": 8}
FLOORS = {"output_step": 1e-4, "rtol": 1e-6, "target_error": 1e-2}
FILES = ("file", "pipeline", "stiffness", "mass", "nodes", "dof")
SYSTEMS = ("double-pendulum", "double-four-bar", "slider-crank", "spinning-spacecraft")


def bounded(count):
    """Settings of a test with so many cases, always the same ones unless there are to be more."""
    return settings(
        max_examples=cases(count),
        derandomize=FULL <= 1,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    folder = good.write_good(tmp_path_factory.mktemp("good"))
    for name, text in BOXES.items():
        (folder / name).write_text(text)
    return folder


def all_finite(found):
    """Whether the arrays of a record hold numbers; an effective mass that does not exist is NaN."""
    values = [getattr(found, field.name) for field in fields(found)]
    arrays = [a for value in values for a in (value.values() if isinstance(value, dict) else [value])]
    return all(np.all(np.isfinite(a)) for a in arrays if isinstance(a, np.ndarray) and a.dtype.kind == "f")


@pytest.mark.parametrize("name", READERS)
@bounded(60)
@given(data=st.data())
def test_damaged_files_are_read_or_refused(originals, name, data):
    """The blocks of numbers in decks of boxes are read at once."""
    file = originals / f"damaged-{name}"
    file.write_bytes(data.draw(of_bytes((originals / name).read_bytes())))
    with patch.object(Lines, "least", 3), suppress(InputError):
        found = READERS[name](file)
        assert is_dataclass(found)
        assert name == "run.h5" or all_finite(found)  # a result may hold any number


def assembled(file):
    """The model of a deck of one of the kinds."""
    mesh = mp.read_mesh(file, gaps="closed" if file.suffix == ".bdf" else None)
    return mp.assemble(mesh, {}, {"root": mp.Interface(node=int(mesh.labels[0]), kind="node")})


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kinds")
    for name, text in KINDS.items():
        (folder / name).write_text(text)
    write_matrices_of_the_part(folder / "part.op4")
    return folder


@pytest.mark.parametrize("name", KINDS)
def test_decks_of_each_kind_are_read(kinds, name):
    model = assembled(kinds / name)
    assert model.rigid.m > 0


@pytest.mark.filterwarnings("ignore::modalprep.ModalprepWarning")
@pytest.mark.parametrize("name", [*KINDS, "part.op4"])
@bounded(60)
@given(data=st.data())
def test_damaged_decks_of_each_kind_are_read_or_refused(kinds, name, data):
    """Their models too; of the part that comes as matrices its file is damaged as well."""
    content = (kinds / name).read_bytes()
    file = kinds / ("external.bdf" if name == "part.op4" else f"damaged-{name}")
    damaged = kinds / name if name == "part.op4" else file
    damaged.write_bytes(data.draw(of_bytes(content)))
    try:
        with suppress(InputError):
            model = assembled(file)
            assert np.all(np.isfinite(model.K.data))
            assert np.all(np.isfinite(model.M.data))
    finally:
        (kinds / name).write_bytes(content)


def tables(file):
    return tomllib.loads(file.read_text())


PIPELINES = sorted(file.name for file in SHIPPED.glob("*.toml"))


@bounded(200)
@given(data=st.data())
def test_damaged_pipelines_are_read_or_refused(originals, data):
    file = SHIPPED / data.draw(st.sampled_from(PIPELINES))
    (originals / "read.toml").write_text(tomli_w.dumps(data.draw(of_tables(tables(file)))), encoding="utf-8")
    with suppress(InputError):
        assert load_pipeline(originals / "read.toml").model_fields_set


def survives(folder, *arguments):
    """Run in a folder of its own, and look at what was said and written."""
    said, error = io.StringIO(), io.StringIO()
    alarm = Timer(PATIENCE, _thread.interrupt_main)
    alarm.start()
    try:
        with redirect_stdout(said), redirect_stderr(error):
            code = main([*map(str, arguments), "--output", str(folder / "output")])
    finally:
        alarm.cancel()
    assert code in (0, 1, 2), said.getvalue()
    assert error.getvalue().count("\n") == bool(code), error.getvalue()
    assert error.getvalue().startswith("modalprep: ") or not code
    for path in (folder / "output").rglob("*"):
        assert ".part" not in path.name
        assert path.is_dir() or finite(path), path
    shutil.rmtree(folder / "output", ignore_errors=True)


def finite(path):
    """Whether a file holds numbers only."""
    if path.suffix in (".json", ".csv"):
        return not NOT_FINITE.search(path.read_text())
    if path.suffix != ".h5":
        return True
    found = []
    with h5py.File(path) as file:
        file.visititems(lambda name, data: found.append(data[()]) if isinstance(data, h5py.Dataset) else None)
    return all(np.all(np.isfinite(values)) for values in found if np.asarray(values).dtype.kind == "f")


@pytest.mark.parametrize("damaged", COMMANDS)
@bounded(8)
@given(data=st.data())
def test_commands_survive_damaged_files(originals, damaged, data):
    command, pipeline = COMMANDS[damaged]
    content = (originals / damaged).read_bytes()
    try:
        (originals / damaged).write_bytes(data.draw(of_bytes(content)))
        survives(originals, command, originals / pipeline)
    finally:
        (originals / damaged).write_bytes(content)


def cheap(found, folder):
    """Bound what a case may cost: short simulations, few modes; name files from where they are."""
    for path in places(found):
        inside = found
        for key in path[:-1]:
            inside = inside[key]
        key, value = path[-1], inside[path[-1]]
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            value = type(value)(min(value, CAPS.get(key, value)))
            inside[key] = max(value, FLOORS[key]) if value > 0 and key in FLOORS else value
        elif key in FILES and isinstance(value, str) and "\0" not in value:
            inside[key] = os.path.join(folder, value)
    if isinstance(found.get("output"), dict):
        found["output"]["pictures"] = "none"
    found.pop("plots", None)
    return found


@pytest.mark.parametrize("name", [*good.PIPELINES, *SYSTEMS])
@bounded(3)
@given(data=st.data())
def test_commands_survive_damaged_pipelines(originals, name, data):
    file = (originals if name in good.PIPELINES else SHIPPED) / f"{name}.toml"
    damaged = cheap(data.draw(of_tables(tables(file))), file.parent)
    (originals / "damaged.toml").write_text(tomli_w.dumps(damaged), encoding="utf-8")
    survives(originals, "run" if "simulation" in damaged else "modes", originals / "damaged.toml")
