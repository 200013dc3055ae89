"""The page of a comparison: paired modes that move side by side, tables, the MAC."""

from __future__ import annotations

import base64
import tempfile
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from modalprep.atomic import atomic_path
from modalprep.correlation.pairing import Correlation
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


def write_pairs_page(found: Correlation, drawn: Scene | None, path: str | Path) -> Path:
    """Write the page of a comparison; it is one file that loads nothing from elsewhere.

    Parameters
    ----------
    found : Correlation
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
    text = _template().render(
        style=Markup(_part("page.css") + _part("correlation/pairs.css")),
        script=Markup(_part("viewer.js")),
        found=found,
        columns=COLUMNS,
        rows=[_cells(k, row) for k, row in enumerate(found.rows(), start=1)],
        alone=unpaired(found),
        worst=worst_components(found, LISTED),
        options=[title.removeprefix("pair ") for title in drawn.titles] if drawn else [],
        scene=scene,
        scene_problem=problem,
        mac=_picture(found),
        smallest=f"{found.pair_mac.min():.3f}" if len(found.pairs) else "",
    )
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _picture(found: Correlation) -> str:
    """Return the chart of the MAC as a data address."""
    with tempfile.TemporaryDirectory() as folder:
        data = mac_plot(found, Path(folder) / "mac.png").read_bytes()
    return f"data:image/png;base64,{base64.b64encode(data).decode()}"


def _template():
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(_part("correlation/pairs.html"))


def _part(name: str) -> str:
    return files("modalprep.report").joinpath(name).read_text(encoding="utf-8")


def _cells(k: int, row: dict[str, Any]) -> list[str]:
    test, analysis, f_test, f_analysis, off, mac, cross, *damping = row.values()
    numbers = [_known(off, "+.2f"), f"{mac:.3f}", _known(cross, ".3f"), *(_known(value, ".2f") for value in damping)]
    return [str(k), str(test), str(analysis), hertz(f_test), hertz(f_analysis), *numbers]


def _known(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "not known"
