"""A page in Debian's chromium: inject a probe, read back what it found."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM = next((found for found in map(shutil.which, NAMES) if found), None)
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium here: apt-get install chromium")
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu-sandbox", "--enable-unsafe-swiftshader", "--window-size=1200,900")
FIRST = "<head><script>const faults = []; addEventListener('error', e => faults.push(e.message));%s</script>"
FRAMES = """
const frames = []; let clock = performance.now();
window.requestAnimationFrame = draw => frames.push(draw);
const nextFrame = () => { clock += 60; frames.splice(0).forEach(draw => draw(clock)); };
"""
LAST = """<script>
const wait = ms => new Promise(done => setTimeout(done, ms));
(async () => {
  const out = {};
  try { await (async () => { %s })(); } catch (fault) { faults.push(String(fault)); }
  const place = document.createElement("pre");
  place.id = "probe"; place.textContent = JSON.stringify({ ...out, faults });
  document.body.append(place);
})();
</script></body>"""


def run_page(
    page, folder, probe: str, *, before: str = "", library: str = "", flags: tuple[str, ...] = (), profile=None
) -> dict:
    """Load a page, run JavaScript that fills `out` behind its own scripts, and return `out` with the `faults`.

    Parameters
    ----------
    before : str
        JavaScript to run before the page's own.
    library : str
        A script that the probe uses.
    flags : tuple of str
        Further options of the browser.
    profile : Path, optional
        Folder of the browser's own files, by default inside `folder`, which has the probed page.
    """
    text = page.read_text(encoding="utf-8")
    text = text.replace("<head>", FIRST % before + f"<script>{library}</script>", 1).replace("</body>", LAST % probe, 1)
    copy = folder / "probed.html"
    copy.write_text(text, encoding="utf-8")
    command = [
        CHROMIUM,
        *FLAGS,
        f"--user-data-dir={profile or folder / 'profile'}",
        "--virtual-time-budget=8000",
        "--dump-dom",
        *flags,
    ]
    done = subprocess.run([*command, copy.as_uri()], capture_output=True, text=True, timeout=120)
    found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found, f"the page's scripts did not end: {done.stderr[-500:]}"
    return json.loads(html.unescape(found[1]))


def run_viewer(page, folder, probe: str) -> dict:
    """Run a probe that gives frames itself and says by `out.ink` what is drawn at first; once more if that is nothing.

    On a busy machine the browser sometimes takes the canvas away from a page.
    """
    for _ in range(3):
        out = run_page(page, folder, probe, before=FRAMES)
        if out.get("ink") != 0:
            break
    return out
