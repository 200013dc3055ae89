"""The page of a run of a system as one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.atomic import atomic_path
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import failures
from modalprep.report.body_page import parts as body_parts
from modalprep.report.body_page.frame import page_text
from modalprep.report.body_page.inputs import Inputs, inputs_section
from modalprep.report.body_page.notes import sorted_notes
from modalprep.report.body_page.section import FAILED, PASSED, Section, Verdict
from modalprep.report.body_page.verdicts import of_envelopes
from modalprep.report.numbers import number
from modalprep.report.run_page import parts
from modalprep.report.run_page.channels import shown_channels

if TYPE_CHECKING:
    from modalprep.multibody.model.system import System
    from modalprep.multibody.results.envelopes import Envelope


def write_run_page(
    run: Result,
    path: str | Path,
    *,
    name: str = "",
    system: System | None = None,
    rtol: float = 1e-5,
    settings: Mapping[str, str] | None = None,
    channels: Sequence[str] = (),
    plots: Sequence[tuple[str, Path]] = (),
    plotted: Sequence[str] = (),
    film: Path | None = None,
    envelopes: Sequence[Envelope] = (),
    notes: Sequence[str] = (),
    sections: Sequence[Section] = (),
    inputs: Inputs | None = None,
    verdicts: Sequence[Verdict] = (),
) -> Path:
    """Write the page: verdict, method and tolerance, system, audits, events, extremes, plots, film, inputs, sign-off.

    The page is one file; it loads no script, style or picture from elsewhere.

    Parameters
    ----------
    run : Result
        Of a simulation.
    name : str
        Title of the page, by default the name of the file.
    system : System, optional
        What was simulated.
    rtol : float
        Relative tolerance of the run, by which its audits are judged.
    settings : {name: text}, optional
        Further ones of the run, such as its theory.
    channels : sequence of str
        Channels to list and draw; by default all that have a meaning of their own.
    plots : sequence of (title, picture file)
    plotted : sequence of str
        Channels that the plots show, which are not drawn again.
    film : Path, optional
    envelopes : sequence of Envelope
        Of the recoveries.
    notes : sequence of str
        Messages besides those of the run.
    sections : sequence of Section
        Further sections, such as damage.
    inputs : Inputs, optional
        Text, hashes and versions that the run was made of.
    verdicts : sequence of Verdict
        Further requirements for the box at the top.

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
    >>> import numpy as np
    >>> import tempfile
    >>> t = np.linspace(0.0, 1.0)
    >>> run = Result(time=t, channels={"hinge.angle": t**2}, status="done", message="reached t = 1 s")
    >>> page = write_run_page(run, Path(tempfile.mkdtemp()) / "hinge.html")
    >>> "reached t = 1 s" in page.read_text(encoding="utf-8")
    True
    """
    inputs, title = inputs or Inputs(), name or Path(path).stem
    failed = failures(run, rtol, sum(body.m for body in system.bodies.values()) if system else 0.0)
    shown, told = shown_channels(run, channels), sorted_notes([*run.notes, *notes])
    found = [
        parts.the_run(run, {"relative tolerance": number(rtol)} | dict(settings or {}), told),
        *parts.the_system(system),
        parts.audits(run, rtol, failed),
        *parts.events(run),
        *body_parts.simulation((), envelopes),
        *sections,
        *parts.histories(run, shown, plots, plotted),
        *parts.film(film),
        *parts.extremes(run, shown),
        *([inputs_section(inputs)] if inputs.text else []),
        *body_parts.provenance({"Files (SHA-256)": inputs.files, "Program": inputs.made}),
    ]
    said = [*_audited(failed), *of_envelopes(envelopes), *verdicts]
    text = page_text(title, "run of a system", _lead(run, system), found, said)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _audited(failed: Sequence[str]) -> list[Verdict]:
    """Return the verdict of the audits."""
    wrong = [Verdict(name="audit of the run", result=FAILED, says=why, anchor="audit-section") for why in failed]
    return wrong or [Verdict(name="audit of the run", result=PASSED, anchor="audit-section")]


def _lead(run: Result, system: System | None) -> str:
    what = f" of {len(system.bodies)} bodies and {len(system.joints)} joints" if system else ""
    span = f" from {number(run.time[0])} to {number(run.time[-1], 6)} s" if len(run.time) else ""
    return f"Simulation{what}{span}."
