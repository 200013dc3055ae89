"""A killed run: every file under its final name is whole, or absent; an interrupted one ends in one line."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from bad import good
from bad.forks import forks
from PIL import Image
from size import some

import modalprep as mp

# A shell that starts the tests in the background has them ignore Ctrl-C; the run must not inherit that.
CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
RUN = f"{CTRL_C}; from modalprep.cli import entry; entry()"
READY = f"{CTRL_C}; from modalprep.cli import entry; print('ready', flush=True); entry()"
FILES = {"beam.h5", "beam-effective-mass.png", "beam-mesh.png", "beam-mode-01.png", "beam.html"}


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory):
    """A beam with the picture of a mode, in a folder of its own."""
    folder = tmp_path_factory.mktemp("pipeline")
    shutil.copy(good.MESHES / "beam.msh", folder)
    text = good.BEAM.replace('pictures = "none"', "pictures = 1")
    assert text != good.BEAM
    (folder / "beam.toml").write_text(text)
    return folder / "beam.toml"


def names(folder):
    return {path.name for path in folder.rglob("*") if path.is_file()}


def run(pipeline, folder, how=None, moment=""):
    """Run; send the signal `how` as soon as a file named like `moment` is there; return exit code and stderr.

    Moments are files, not seconds: the clock would hit another one on a busier machine.
    """
    command = [sys.executable, "-c", RUN, "run", str(pipeline), "--output", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        while how and process.poll() is None:
            if any(moment in name for name in names(folder)):
                os.kill(process.pid, how)
                break
            time.sleep(0.001)
        _, error = process.communicate()
    return process.returncode, error


def all_whole(folder) -> bool:
    for file in folder.rglob("*"):
        if not file.is_file() or ".part" in file.name:
            continue
        if file.suffix == ".h5":
            assert mp.read_body(file).n > 0
        elif file.suffix == ".html":
            assert file.read_text().rstrip().endswith("</html>")
        elif file.name == ".source":
            assert (file.parent / file.read_text()).is_file()
        else:
            with Image.open(file) as image:
                image.load()
    return True


@pytest.mark.slow
def test_killed_at_any_moment(pipeline, tmp_path):
    """While each kind of file is written, and just after; then once more into the same folder."""
    disturbed, again = 0, tmp_path / "mesh.png"
    with forks(tmp_path, draws=True) as server:
        for moment in (".part.h5", "beam.h5", ".part.png", "mesh.png", ".part.html"):
            output = tmp_path / moment.strip(".")
            code, _, _ = server.run("run", pipeline, "--output", output, moment=moment, folder=output)
            assert all_whole(output)
            disturbed += code == -signal.SIGKILL
        assert disturbed >= 3  # a file of a millisecond may be missed, not all of them
        assert server.run("run", pipeline, "--output", again)[0] == 0
    assert names(again) >= FILES
    assert all_whole(again)


@pytest.mark.slow
def test_terminated(pipeline, tmp_path):
    code, _ = run(pipeline, tmp_path, signal.SIGTERM, "beam.h5")
    assert code != 0
    assert all_whole(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("moment", [".part.png", "beam.h5"])
def test_interrupted_by_the_user(pipeline, tmp_path, moment):
    """Ctrl-C: one line, exit code 130, no temporary file left."""
    code, error = run(pipeline, tmp_path, signal.SIGINT, moment)
    assert (code, error) == (130, "modalprep: interrupted\n")
    assert all_whole(tmp_path)
    assert not [name for name in names(tmp_path) if ".part" in name]


@pytest.mark.slow
@pytest.mark.parametrize("seconds", some([0.01, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.3], 4))
def test_interrupted_while_importing(pipeline, tmp_path, seconds):
    """NumPy, SciPy, numba and VTK are loaded, or whatever comes then: Ctrl-C is the same at all times."""
    command = [sys.executable, "-c", READY, "run", str(pipeline), "--output", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(seconds)
        os.kill(process.pid, signal.SIGINT)
        _, error = process.communicate()
    assert (process.returncode, error) == (130, "modalprep: interrupted\n")


def test_interrupts_are_handled_before_other_imports():
    code = "import sys; before = set(sys.modules); import modalprep.cli; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    light = {"modalprep", "modalprep.lazy", "modalprep.cli", "importlib", "warnings"}
    assert not {name for name in done.stdout.split() if "._" not in name and name[0] != "_"} - light


LATE = """
import os, signal, time, warnings
from modalprep.cli.interrupt import repeated_interrupts
warnings.warn("before", stacklevel=1)
with repeated_interrupts():
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(5)
    except KeyboardInterrupt:
        warnings.warn("after", stacklevel=1)
"""


def test_a_library_that_is_cut_short_does_not_warn():
    """Matplotlib warns when an import within it fails, also by Ctrl-C."""
    done = subprocess.run([sys.executable, "-c", f"{CTRL_C}\n{LATE}"], capture_output=True, text=True, check=False)
    assert "UserWarning: before" in done.stderr
    assert "after" not in done.stderr.replace('warn("after"', "")
    assert "KeyboardInterrupt" in done.stderr
