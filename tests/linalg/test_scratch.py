"""Folders of temporary files: that of a killed process is removed, that of a living one is not."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from modalprep.linalg.scratch import ScratchFolder

PREFIX = "modalprep-factor-"
HOLDS = f"""
import sys
from modalprep.linalg.scratch import ScratchFolder
folder = ScratchFolder({PREFIX!r})
open(folder.path + "/factor", "w").close()
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such locks")
def test_the_folder_of_a_killed_process_goes_with_the_next_one(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    other = tmp_path / f"{PREFIX}without-lock"
    other.mkdir()
    with subprocess.Popen([sys.executable, "-c", HOLDS], stdin=-1, stdout=-1, text=True) as process:
        assert process.stdout
        left = Path(process.stdout.readline().strip())
        own = ScratchFolder(PREFIX)
        assert (left / "factor").exists()  # its process lives
        process.send_signal(signal.SIGKILL)
        process.wait()
        own.remove()
    assert left.exists()
    again = ScratchFolder(PREFIX)
    assert {Path(again.path), other} == set(tmp_path.iterdir())
    again.remove()
    assert [other] == list(tmp_path.iterdir())
