"""The page of a run of a system as one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.atomic import atomic_path
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import audits, failures
from modalprep.report.body_page import parts as body_parts
from modalprep.report.body_page.frame import page_text
from modalprep.report.body_page.inputs import Inputs, inputs_section
from modalprep.report.body_page.requirements import of_envelopes
from modalprep.report.body_page.section import Section
from modalprep.report.explain.run import describe_run
from modalprep.report.numbers import number
from modalprep.report.run_page import parts
from modalprep.report.run_page.channels import shown_channels
from modalprep.verdicts.notes import kind_of, warnings_of
from modalprep.verdicts.verdict import Verdict

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
    verdict: Verdict | None = None,
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
        Messages, by default those of the run.
    sections : sequence of Section
        Further sections, such as damage.
    inputs : Inputs, optional
        Text, hashes and versions that the run was made of.
    verdict : Verdict, optional
        For the box at the top; by default that of the audits, the extremes, the sections and the messages.

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
    mass = sum(body.m for body in system.bodies.values()) if system else 0.0
    shown, told = shown_channels(run, channels), list(dict.fromkeys(notes or run.notes))
    if verdict is None:
        met = [*audits(run, rtol, mass), *of_envelopes(envelopes), *(r for part in sections for r in part.requirements)]
        verdict = Verdict.of(met, warnings_of(told))
    found = [
        body_parts.in_short(describe_run(run), verdict),
        *body_parts.requirements(verdict),
        parts.the_run(
            run,
            {"relative tolerance": number(rtol)} | dict(settings or {}),
            [note for note in told if kind_of(note) == "notes"],
        ),
        *parts.the_system(system),
        parts.audits(run, rtol, failures(run, rtol, mass)),
        *parts.events(run),
        *body_parts.simulation((), envelopes),
        *sections,
        *parts.histories(run, shown, plots, plotted),
        *parts.film(film),
        *parts.extremes(run, shown),
        *([inputs_section(inputs)] if inputs.text else []),
        *body_parts.provenance({"Files (SHA-256)": inputs.files, "Program": inputs.made}),
    ]
    text = page_text(title, "run of a system", _lead(run, system), found, verdict)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _lead(run: Result, system: System | None) -> str:
    what = f" of {len(system.bodies)} bodies and {len(system.joints)} joints" if system else ""
    span = f" from {number(run.time[0])} to {number(run.time[-1], 6)} s" if len(run.time) else ""
    return f"Simulation{what}{span}."
