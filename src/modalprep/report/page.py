"""The report of a body as one self-contained HTML page."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, StrictUndefined

from modalprep.atomic import atomic_path
from modalprep.body.checks import Check
from modalprep.body.flexible_body import FlexibleBody
from modalprep.reduction.table import DIRECTIONS, ModeTable
from modalprep.report.plots import effective_mass_plot
from modalprep.report.tables import carried, hertz, percent, summary_rows


def write_page(
    body: FlexibleBody,
    path: str | Path,
    *,
    pictures: Mapping[int, Path] | None = None,
    mesh_picture: Path | None = None,
    plots: Sequence[tuple[str, Path]] = (),
    checks: Sequence[Check] = (),
    notes: Sequence[str] = (),
) -> Path:
    """Write the page: summary, mode selection, mode shapes, checks, simulation plots, provenance.

    Everything is in the one file: no script, style or picture is loaded from elsewhere.

    Parameters
    ----------
    pictures : {mode: PNG file}
        Of the body's own modes, counted from 1.
    plots : sequence of (title, PNG file)
    notes : sequence of str
        Sentences to show on top.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> page = write_page(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.html")
    >>> "Mode selection" in page.read_text()
    True
    """
    template = files("modalprep.report").joinpath("page.html").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    with tempfile.TemporaryDirectory() as folder:
        mass_plot = _embedded(effective_mass_plot(body.modes, Path(folder) / "mass.png"))
    text = environment.from_string(template).render(
        body=body,
        table=body.modes,
        summary=summary_rows(body),
        directions=DIRECTIONS,
        rows=_rows(body.modes),
        sums=[percent(value) for value in carried(body.modes)],
        mass_plot=mass_plot,
        mesh_picture=_embedded(mesh_picture) if mesh_picture else None,
        plots=[(title, _embedded(file)) for title, file in plots],
        cards=_cards(body, pictures or {}),
        checks=checks,
        notes=notes,
    )
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _rows(table: ModeTable) -> list[dict]:
    return [
        {
            "kind": kind,
            "frequency": hertz(table.frequency[k]),
            "masses": [percent(value) for value in table.fraction[k]],
            "kept": bool(table.kept[k]),
            "reason": table.reason[k],
        }
        for k, kind in enumerate(table.kind)
    ]


def _cards(body: FlexibleBody, pictures: Mapping[int, Path]) -> list[dict]:
    return [
        {"number": mode, "frequency": hertz(body.frequency[mode - 1]), "image": _embedded(file)}
        for mode, file in sorted(pictures.items())
    ]


def _embedded(file: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(file.read_bytes()).decode()
