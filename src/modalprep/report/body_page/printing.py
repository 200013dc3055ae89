"""The page on paper: a PDF file by a Chromium without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from modalprep.atomic import atomic_path
from modalprep.errors import InputError, OutputError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
FLAGS = ("--headless", "--disable-gpu-sandbox", "--enable-unsafe-swiftshader", "--no-pdf-header-footer")
PATIENCE = 300.0  # s


def find_browser() -> str:
    """Return the path of a Chromium.

    Raises
    ------
    InputError
        When there is none.
    """
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        raise InputError(
            f"--pdf needs a Chromium, and none of {', '.join(BROWSERS)} was found; install one "
            "(apt-get install chromium), or leave --pdf out and print the page from a browser"
        )
    return found


def print_page(page: Path, browser: str) -> Path:
    """Print a page to a PDF file beside it.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        When the browser fails; nothing is written then.
    """
    target = page.with_suffix(".pdf")
    flags = [*FLAGS, "--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else list(FLAGS)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, atomic_path(target) as temporary:
        command = [browser, *flags, f"--user-data-dir={profile}", f"--print-to-pdf={temporary.resolve()}"]
        try:
            done = subprocess.run([*command, page.resolve().as_uri()], capture_output=True, text=True, timeout=PATIENCE)
            said = done.stderr.strip().splitlines()[-1:] or [f"it ended with code {done.returncode}"]
        except (OSError, subprocess.TimeoutExpired) as error:
            said = [str(error)]
        if not temporary.is_file():
            raise OutputError(f"cannot write {target}: {browser} did not print the page ({said[0]})")
    return target
