"""The page of a comparison: paired modes that move side by side, tables, the MAC."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import write_text
from modalprep.correlation.pairing import Correlation
from modalprep.report.body_page.table import data_address, part, texts
from modalprep.report.correlation.pairs import mac_plot, unpaired, worst_components
from modalprep.report.scene.record import Scene
from modalprep.report.tables import hertz
from modalprep.report.viewer.still import drawable

LISTED = 20  # components of the lowest COMAC
COLUMNS = (
    "pair",
    "test mode",
    "analysis mode",
    "test Hz",
    "analysis Hz",
    "difference %",
    "MAC",
    "orthogonality",
    "test damping %",
    "analysis damping %",
)


def write_pairs_page(correlation: Correlation, drawn: Scene | None, path: str | Path) -> Path:
    """Write the page of a comparison; it is one file that loads nothing from elsewhere.

    Parameters
    ----------
    correlation : Correlation
    drawn : Scene or None
        The pairs side by side; None without pairs.
    path : path

    Returns
    -------
    Path
        The file.
    """
    scene, problem = drawable(drawn) if drawn is not None else (None, "")
    if scene and drawn is not None:
        scene["notes"] = [*scene["notes"], *drawn.notes]
    text = part(
        "pairs.html",
        "correlation",
        style=texts("page.css", "correlation/pairs.css"),
        script=texts("viewer.js"),
        found=correlation,
        columns=COLUMNS,
        rows=[_cells(k, row) for k, row in enumerate(correlation.rows(), start=1)],
        alone=unpaired(correlation),
        worst=worst_components(correlation, LISTED),
        options=[title.removeprefix("pair ") for title in drawn.titles] if drawn else [],
        scene=scene,
        scene_problem=problem,
        mac=_picture(correlation),
        smallest=f"{correlation.pair_mac.min():.3f}" if len(correlation.pairs) else "",
    )
    return write_text(text, path)


def _picture(correlation: Correlation) -> str:
    """Return the chart of the MAC as a data address."""
    with tempfile.TemporaryDirectory() as folder:
        data = mac_plot(correlation, Path(folder) / "mac.png").read_bytes()
    return data_address(data, "image/png")


def _cells(k: int, row: dict[str, Any]) -> list[str]:
    test, analysis, f_test, f_analysis, off, mac, cross, *damping = row.values()
    numbers = [_known(off, "+.2f"), f"{mac:.3f}", _known(cross, ".3f"), *(_known(value, ".2f") for value in damping)]
    return [str(k), str(test), str(analysis), hertz(f_test), hertz(f_analysis), *numbers]


def _known(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "not known"
