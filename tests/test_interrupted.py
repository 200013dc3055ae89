"""A killed run: every file under its final name is whole, or absent."""

import os
import signal
import subprocess
import sys
import time

import pytest
from PIL import Image

import modalprep as mp

RUN = "import sys; from modalprep.cli import main; sys.exit(main(sys.argv[1:]))"


def start(project, folder):
    command = [sys.executable, "-c", RUN, "run", str(project / "pipelines" / "bracket.toml"), "--output", str(folder)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def whole(file) -> bool:
    if file.suffix == ".h5":
        return mp.read_body(file).n > 0
    if file.suffix == ".html":
        return file.read_text().rstrip().endswith("</html>")
    with Image.open(file) as image:
        image.load()
    return True


@pytest.fixture(scope="module")
def duration(project, tmp_path_factory) -> float:
    """Seconds of an undisturbed run."""
    begin = time.monotonic()
    assert start(project, tmp_path_factory.mktemp("undisturbed")).wait() == 0
    return time.monotonic() - begin


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "shares"), [(signal.SIGKILL, (0.3, 0.6, 0.8, 0.95)), (signal.SIGTERM, (0.7,)), (signal.SIGINT, (0.7,))]
)
def test_files_are_whole_or_absent(project, tmp_path, duration, how, shares):
    for share in shares:
        process = start(project, tmp_path)
        time.sleep(share * duration)
        os.kill(process.pid, how)
        process.wait()
        files = [f for f in tmp_path.rglob("*") if f.is_file() and ".part" not in f.name]
        assert all(whole(file) for file in files)


@pytest.mark.slow
def test_a_killed_run_does_not_disturb_the_next(project, tmp_path, duration):
    process = start(project, tmp_path)
    time.sleep(0.7 * duration)
    process.kill()
    process.wait()
    assert start(project, tmp_path).wait() == 0
