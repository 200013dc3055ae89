"""The page of a run of a system as one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.atomic import write_text
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import audits
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
    from modalprep.multibody.deploying.system import DeployingSystem
    from modalprep.multibody.model.system import System
    from modalprep.multibody.results.envelopes import Envelope
    from modalprep.verdicts.verdict import Requirement


@dataclass(frozen=True)
class RunPage:
    """What the page of a run shows.

    Attributes
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

    Examples
    --------
    >>> import numpy as np
    >>> run = Result(time=np.zeros(1), channels={}, status="done", message="")
    >>> RunPage(run, notes=["it turned over", "it turned over"]).told
    ['it turned over']
    """

    run: Result
    _: KW_ONLY
    name: str = ""
    system: System | DeployingSystem | None = None
    rtol: float = 1e-5
    settings: Mapping[str, str] = field(default_factory=dict)
    channels: Sequence[str] = ()
    plots: Sequence[tuple[str, Path]] = ()
    plotted: Sequence[str] = ()
    film: Path | None = None
    envelopes: Sequence[Envelope] = ()
    notes: Sequence[str] = ()
    sections: Sequence[Section] = ()
    inputs: Inputs = field(default_factory=Inputs)
    verdict: Verdict | None = None

    @property
    def told(self) -> list[str]:
        """The messages, each once."""
        return list(dict.fromkeys(self.notes or self.run.notes))

    @cached_property
    def audited(self) -> list[Requirement]:
        """What the run is required to do."""
        mass = sum(body.m for body in self.system.bodies.values()) if self.system else 0.0
        return audits(self.run, self.rtol, mass)

    @cached_property
    def judgement(self) -> Verdict:
        """The verdict of the box at the top."""
        met = [*self.audited, *of_envelopes(self.envelopes), *(r for part in self.sections for r in part.requirements)]
        return self.verdict or Verdict.of(met, warnings_of(self.told))


def write_run_page(shown: RunPage | Result, path: str | Path) -> Path:
    """Write the page: verdict, method and tolerance, system, audits, events, extremes, plots, film, inputs, sign-off.

    The page is one file; it loads no script, style or picture from elsewhere.

    Parameters
    ----------
    shown : RunPage or Result
        Of a result alone the page shows what the result holds.
    path : str or Path

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
    >>> import tempfile
    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0)
    >>> run = Result(time=t, channels={"hinge.angle": t**2}, status="done", message="reached t = 1 s")
    >>> page = write_run_page(run, Path(tempfile.mkdtemp()) / "hinge.html")
    >>> "reached t = 1 s" in page.read_text(encoding="utf-8")
    True
    """
    shown = shown if isinstance(shown, RunPage) else RunPage(shown)
    run, system, rtol, inputs = shown.run, shown.system, shown.rtol, shown.inputs
    verdict = shown.judgement
    channels = shown_channels(run, shown.channels)
    settings = {"relative tolerance": number(rtol)} | dict(shown.settings)
    found = [
        body_parts.in_short(describe_run(run), verdict),
        *body_parts.requirements(verdict),
        parts.the_run(run, settings, [note for note in shown.told if kind_of(note) == "notes"]),
        *parts.the_system(system),
        parts.audits(run, rtol, shown.audited),
        *parts.events(run),
        *body_parts.simulation((), shown.envelopes),
        *shown.sections,
        *parts.histories(run, channels, shown.plots, shown.plotted),
        *parts.film(shown.film),
        *parts.extremes(run, channels),
        *([inputs_section(inputs)] if inputs.text else []),
        *body_parts.provenance({"Files (SHA-256)": inputs.files, "Program": inputs.made}),
    ]
    text = page_text(shown.name or Path(path).stem, "run of a system", _lead(run, system), found, verdict)
    return write_text(text, path)


def _lead(run: Result, system: System | DeployingSystem | None) -> str:
    what = f" of {len(system.bodies)} bodies and {len(system.joints)} joints" if system else ""
    span = f" from {number(run.time[0])} to {number(run.time[-1], 6)} s" if len(run.time) else ""
    return f"Simulation{what}{span}."
