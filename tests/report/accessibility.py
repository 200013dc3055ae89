"""Rules of WCAG 2.1 A and AA on a page, by axe-core in Debian's chromium."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from report.browser import run_page

BUNDLE = Path(os.environ.get("MODALPREP_AXE", "build/axe/node_modules/axe-core/axe.min.js"))
needs_axe = pytest.mark.skipif(not BUNDLE.is_file(), reason="no axe-core here: npm install --prefix build/axe axe-core")
DARK = ("--force-dark-mode", "--blink-settings=preferredColorScheme=0")
PROBE = """
const rules = { type: "tag", values: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"] };
const found = await axe.run(document, { runOnly: rules });
out.dark = matchMedia("(prefers-color-scheme: dark)").matches;
out.passes = found.passes.length;
out.violations = found.violations.map(v => [v.id, v.nodes.length, v.nodes[0].html.slice(0, 120)]);
"""


def violations(page, folder, *, dark: bool, profile=None) -> dict:
    """Return the rules that a page violates, how many it passes, and whether its colours were dark."""
    bundle = BUNDLE.read_text(encoding="utf-8")
    return run_page(page, folder, PROBE, library=bundle, flags=DARK if dark else (), profile=profile)
