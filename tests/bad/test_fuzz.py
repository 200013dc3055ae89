"""Damaged input at random: exit code 0, 1 or 2 with one sentence; never a traceback, a hang, NaN or half a file.

`MODALPREP_FUZZ=100` makes a hundred times as many cases as by default, and others each time.
"""

import _thread
import io
import os
import re
import shutil
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from threading import Timer

import h5py
import numpy as np
import pytest
from bad import good
from bad.mutations import of_bytes, of_tables, places
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from modalprep.cli import main
from modalprep.pipeline.toml_text import toml_text

MORE = int(os.environ.get("MODALPREP_FUZZ", "1"))
PATIENCE = 60.0  # s; the slowest case takes a tenth of it
PIPELINES = Path(__file__).parents[2] / "pipelines"
NOT_FINITE = re.compile(r"(?<![\w.])[-+]?(nan|inf|infinity)(?![\w.])", re.IGNORECASE)
MESHES = {"beam.msh": "job.toml", "plate.inp": "plate.toml", "deck.bdf": "deck.toml", "body.h5": "system.toml"}
MATRICES = {"k.mtx": "matrices.toml", "nodes.csv": "matrices.toml", "model.npz": "archive.toml"}
CAPS = {"t_end": 2e-3, "modes": 8, "count": 8, "points": 40, "up_to": 1e3, "elements": 8}
FLOORS = {"output_step": 1e-4, "rtol": 1e-6, "target_error": 1e-2}


def bounded(cases):
    """Settings of a test with so many cases, always the same ones unless there are to be more."""
    return settings(
        max_examples=cases * MORE,
        derandomize=MORE == 1,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    folder = good.write_good(tmp_path_factory.mktemp("good"))
    text = (folder / "matrices.toml").read_text()
    text = text.replace('stiffness = "k.mtx"\nmass = "m.mtx"\nnodes = "nodes.csv"', 'file = "model.npz"')
    (folder / "archive.toml").write_text(text)
    return folder


def survives(folder, *arguments):
    """Run in a folder of its own, and look at what was said and written."""
    before = {path.name for path in folder.rglob("*")}
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
    for path in folder.rglob("*"):
        if path.is_file() and path.name not in before:
            assert ".part" not in path.name
            assert finite(path), path
    shutil.rmtree(folder / "output", ignore_errors=True)


def finite(path):
    """Whether a file holds numbers only; an effective mass that does not exist is NaN."""
    if path.suffix in (".json", ".csv"):
        return not NOT_FINITE.search(path.read_text())
    if path.suffix != ".h5":
        return True
    found = []
    with h5py.File(path) as file:
        file.visititems(lambda name, data: found.append(data[()]) if isinstance(data, h5py.Dataset) else None)
    return all(np.all(np.isfinite(values)) for values in found if np.asarray(values).dtype.kind == "f")


@pytest.mark.parametrize(("damaged", "pipeline"), (MESHES | MATRICES).items())
@bounded(25)
@given(data=st.data())
def test_damaged_files(originals, damaged, pipeline, data):
    content = (originals / damaged).read_bytes()
    try:
        (originals / damaged).write_bytes(data.draw(of_bytes(content)))
        survives(originals, "run", originals / pipeline)
    finally:
        (originals / damaged).write_bytes(content)


def tables(file):
    return tomllib.loads(file.read_text())


def cheap(found, folder):
    """Bound what a case may cost: short simulations, few modes; files are named from where they are."""
    for path in places(found):
        inside = found
        for key in path[:-1]:
            inside = inside[key]
        key, value = path[-1], inside.get(path[-1]) if isinstance(inside, dict) else None
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            if value > CAPS.get(key, value):
                inside[key] = type(value)(CAPS[key])
            if 0 < value < FLOORS.get(key, 0):
                inside[key] = FLOORS[key]
        if key in ("file", "pipeline") and isinstance(value, str) and (folder / value).is_file():
            inside[key] = (
                os.path.relpath(folder / value, PIPELINES / "..") if False else str((folder / value).resolve())
            )
    if isinstance(found.get("output"), dict):
        found["output"]["pictures"] = "none"
    found.pop("plots", None)
    return found


SHIPPED = ["double-pendulum", "double-four-bar", "slider-crank", "squeezer", "spinning-spacecraft", "spinup-rods"]


@pytest.mark.parametrize("name", [*good.PIPELINES, *SHIPPED])
@bounded(10)
@given(data=st.data())
def test_damaged_pipelines(originals, name, data):
    file = originals / f"{name}.toml" if name in good.PIPELINES else PIPELINES / f"{name}.toml"
    damaged = cheap(data.draw(of_tables(tables(file))), file.parent)
    (originals / "damaged.toml").write_text(toml_text(damaged))
    survives(originals, "run", originals / "damaged.toml")
