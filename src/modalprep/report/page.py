"""The report of a body as one self-contained HTML page."""

from __future__ import annotations

import base64
import mimetypes
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.reduction.table import DIRECTIONS, ModeTable
from modalprep.report.mac import mac_chart
from modalprep.report.pictures.motion import unseen_modes
from modalprep.report.plots import effective_mass_plot, error_plot
from modalprep.report.scene import drawable
from modalprep.report.tables import (
    ENVELOPE,
    HELD,
    envelope_rows,
    hertz,
    is_held_elsewhere,
    kept_fraction,
    percent,
    summary_rows,
)

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.multibody.results.envelopes import Envelope


def write_page(
    body: FlexibleBody,
    path: str | Path,
    *,
    pictures: Mapping[int, Path] | None = None,
    mesh_picture: Path | None = None,
    plots: Sequence[tuple[str, Path]] = (),
    checks: Sequence[Check] = (),
    notes: Sequence[str] = (),
    errors: Mapping[str, tuple[Any, Any]] | None = None,
    error_axes: tuple[str, str] = ("frequency (Hz)", "relative error"),
    mass_plot: Path | None = None,
    nodal_mass: np.ndarray | None = None,
    envelopes: Sequence[Envelope] = (),
) -> Path:
    """Write the page: summary, selection, animated mode shapes, MAC, checks, plots, provenance.

    The page is one file; it loads no script, style or picture from elsewhere.

    Parameters
    ----------
    pictures : {mode: picture file}
        Of the body's own modes, counted from 1.
    plots : sequence of (title, picture file)
    notes : sequence of str
        Messages shown at the top.
    errors : {label: (x, y)}, optional
        Curves of a section on errors; without, there is no such section.
    error_axes : (str, str)
        Labels of its axes.
    mass_plot : Path or None
        The chart of `effective_mass_plot`, where it is drawn already.
    nodal_mass : (n_points,), optional
        Weights of the nodes where modes are compared; default: equal weights.
    envelopes : sequence of Envelope
        Of the recoveries in a run.

    Returns
    -------
    Path
        The file.

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
    text = _template().render(
        **_static(),
        **_selection(body.modes, mass_plot),
        **_shapes(body, pictures or {}, nodal_mass),
        body=body,
        summary=summary_rows(body),
        mesh_picture=_embedded(mesh_picture) if mesh_picture else None,
        plots=[(title, _embedded(file)) for title, file in plots],
        errors_plot=_drawn(error_plot, errors, xlabel=error_axes[0], ylabel=error_axes[1]) if errors else None,
        envelope_columns=ENVELOPE,
        envelopes=envelope_rows(envelopes),
        checks=checks,
        failed=sum(not check.passed for check in checks),
        notes=notes,
    )
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


@cache
def _template() -> Template:
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(_part("page.html"))


def _part(name: str) -> str:
    return files("modalprep.report").joinpath(name).read_text(encoding="utf-8")


def _static() -> dict[str, Any]:
    """Return style and scripts, common to all pages."""
    return {"style": Markup(_part("page.css")), "script": Markup(_part("page.js") + _part("viewer.js"))}


def _selection(table: ModeTable, mass_plot: Path | None) -> dict[str, Any]:
    return {
        "table": table,
        "directions": DIRECTIONS,
        "rows": _rows(table),
        "kinds": list(dict.fromkeys(table.kind)),
        "held": HELD if is_held_elsewhere(table) else "",
        "sums": [percent(value) for value in kept_fraction(table)],
        "mass_plot": _embedded(mass_plot) if mass_plot else _drawn(effective_mass_plot, table),
    }


def _shapes(body: FlexibleBody, pictures: Mapping[int, Path], nodal_mass: np.ndarray | None) -> dict[str, Any]:
    """Return the animated view, the cards and the MAC of the modes."""
    scene, problem = drawable(body)
    return {
        "scene": scene,
        "scene_problem": problem,
        "pictured": bool(pictures),
        "cards": _cards(body, pictures, len(scene["modes"]) if scene else 0),
        "unseen": unseen_modes(body.shape),
        "mac": mac_chart(body, nodal_mass),
    }


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


def _cards(body: FlexibleBody, pictures: Mapping[int, Path], moving: int) -> list[dict]:
    """One card per mode of the body, with a picture where there is one; the first `moving` are in the viewer."""
    damping = body.D / (2 * np.sqrt(np.where(body.K > 0, body.K, 1.0)))  # rigid-body modes have none
    return [
        {
            "number": mode,
            "frequency": hertz(body.frequency[mode - 1]),
            "damping": f"{100 * damping[mode - 1]:.3g}",
            "moving": mode <= moving,
            "image": _embedded(pictures[mode]) if mode in pictures else None,
        }
        for mode in range(1, body.n + 1)
    ]


def _drawn(draw: Callable[..., Path], what: Any, **options: Any) -> str:
    """Return a chart as a data address."""
    with tempfile.TemporaryDirectory() as folder:
        return _embedded(draw(what, Path(folder) / "chart.png", **options))


def _embedded(file: Path) -> str:
    """Return a picture as a data address."""
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise InputError(f"the picture {file} cannot be read: {error.strerror}") from error
    kind = mimetypes.guess_type(Path(file).name)[0] or "image/png"
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
