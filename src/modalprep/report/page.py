"""The report of a body as one self-contained HTML page."""

from __future__ import annotations

import base64
import mimetypes
import tempfile
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jinja2 import Environment, StrictUndefined

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.reduction.table import DIRECTIONS, ModeTable
from modalprep.report.plots import effective_mass_plot
from modalprep.report.tables import carried, hertz, percent, summary_rows

if TYPE_CHECKING:
    from modalprep.body.checks import Check


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
    pictures : {mode: picture file}
        Of the body's own modes, counted from 1.
    plots : sequence of (title, picture file)
    notes : sequence of str
        Sentences to show on top.

    Raises
    ------
    InputError
        When a picture cannot be read, or the page not be written.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> page = write_page(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.html")
    >>> "Mode selection" in page.read_text(encoding="utf-8")
    True
    """
    template = files("modalprep.report").joinpath("page.html").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    text = environment.from_string(template).render(
        body=body,
        table=body.modes,
        summary=summary_rows(body),
        directions=DIRECTIONS,
        rows=_rows(body.modes),
        sums=[percent(value) for value in carried(body.modes)],
        mass_plot=_mass_plot(body.modes),
        mesh_picture=_embedded(mesh_picture) if mesh_picture else None,
        plots=[(title, _embedded(file)) for title, file in plots],
        cards=_cards(body, pictures or {}),
        checks=checks,
        failed=sum(not check.passed for check in checks),
        notes=notes,
    )
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _rows(table: ModeTable) -> list[dict]:
    """Return the rows as text, with the plain numbers to sort by (-1 where there is none)."""
    return [
        {
            "kind": kind,
            "frequency": (hertz(table.frequency[k]), _sortable(table.frequency[k])),
            "masses": [(percent(value), _sortable(value)) for value in table.fraction[k]],
            "kept": bool(table.kept[k]),
            "reason": table.reason[k],
        }
        for k, kind in enumerate(table.kind)
    ]


def _sortable(value: float) -> str:
    return "-1" if np.isnan(value) else f"{value:.9g}"


def _cards(body: FlexibleBody, pictures: Mapping[int, Path]) -> list[dict]:
    """One card per mode of the body, with a picture where there is one."""
    damping = body.D / (2 * np.sqrt(np.where(body.K > 0, body.K, 1.0)))  # a mode of 0 Hz has none
    return [
        {
            "number": mode,
            "frequency": hertz(body.frequency[mode - 1]),
            "damping": f"{100 * damping[mode - 1]:.3g}",
            "image": _embedded(pictures[mode]) if mode in pictures else None,
        }
        for mode in range(1, body.n + 1)
    ]


def _mass_plot(table: ModeTable) -> str:
    with tempfile.TemporaryDirectory() as folder:
        return _embedded(effective_mass_plot(table, Path(folder) / "mass.png"))


def _embedded(file: Path) -> str:
    """Return a picture as a data address."""
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise InputError(f"the picture {file} cannot be read: {error.strerror}") from error
    kind = mimetypes.guess_type(Path(file).name)[0] or "image/png"
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
