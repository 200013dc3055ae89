"""What came of a run: one result of each stage, and what all of them are worth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from modalprep.correlation.derivatives import Sensitivities
    from modalprep.pipeline.building.built import Built
    from modalprep.pipeline.building.synthesis import Synthesised
    from modalprep.pipeline.drawn import Drawn
    from modalprep.pipeline.responses.respond import Responded
    from modalprep.pipeline.responses.strength import Strength
    from modalprep.pipeline.schema.pipeline import Pipeline
    from modalprep.pipeline.systems.analysis import Analysed
    from modalprep.pipeline.systems.systems import Simulated
    from modalprep.reduction.cyclic.modes import CyclicModes
    from modalprep.verdicts.verdict import Requirement, Verdict


@dataclass(frozen=True)
class Outcome:
    """Results of a run by its stages; None, or nothing, of those that its file does not ask for.

    Attributes
    ----------
    folder : Path
        Of the outputs.
    asked : Pipeline or None
        Its requirements count in the verdict.
    built, exported, responses, sensitivities, cyclic, synthesised, system_drawn, analysed, simulated, run_drawn
        Of the stages, in their order.
    strength : Strength or None
        Shock spectra and damage.
    body_drawn : Drawn or None
        Pictures of the mesh and of the modes.
    """

    folder: Path
    asked: Pipeline | None = None
    built: Built | None = None
    exported: Drawn | None = None
    responses: tuple[Responded, ...] = ()
    sensitivities: Sensitivities | None = None
    cyclic: CyclicModes | None = None
    synthesised: Synthesised | None = None
    system_drawn: Drawn | None = None
    analysed: Analysed | None = None
    simulated: Simulated | None = None
    run_drawn: Drawn | None = None
    strength: Strength | None = None
    body_drawn: Drawn | None = None

    @cached_property
    def notes(self) -> list[str]:
        """What the user should know, in the order of the stages."""
        body = (self.built, self.exported, *self.responses, self.sensitivities, self.cyclic, self.synthesised)
        parts = (
            *body,
            self.system_drawn,
            self.analysed,
            self.simulated,
            self.run_drawn,
            self.strength,
            self.body_drawn,
        )
        return [note for part in parts if part is not None for note in part.notes]

    @cached_property
    def audits(self) -> tuple[Requirement, ...]:
        """Whether analyses and runs are what their equations say."""
        return tuple(audit for part in (self.analysed, self.simulated) if part for audit in part.audits)

    @cached_property
    def verdict(self) -> Verdict:
        """PASS, PASS WITH WARNINGS or FAIL, with the reasons; the same on the page, in JSON and in the terminal."""
        from modalprep.report.body_page import requirements
        from modalprep.verdicts.notes import warnings_of
        from modalprep.verdicts.verdict import Verdict

        built = self.built
        limits = self.asked.reduction.limits if self.asked else {}
        met = [*self._required(), *self.audits]
        met += requirements.of_envelopes(self.simulated.envelopes if self.simulated else ())
        met += [margin for found in self.responses for margin in requirements.of_response(found.name, found.response)]
        met += [requirements.of_damage(*found) for found in self.strength.fatigue.items()] if self.strength else []
        if built is None:
            return Verdict.of(met, warnings_of(self.notes))
        static = {"static responses": ((), built.error.static)} if built.error else {}
        met = [*(requirements.of_errors(static, limits) if static else ()), *met]
        found = {"checks": built.checks, "notes": self.notes, "errors": built.error_curves, "error_limits": limits}
        return requirements.body_verdict(requirements=met, **found)

    @cached_property
    def margins(self) -> dict[str, float]:
        """Margin of the worst place of each recovered component, and of the peaks of responses; NaN where none is."""
        envelopes = self.simulated.envelopes if self.simulated else ()
        rows = [row for envelope in envelopes for row in envelope.worst()]
        found = {
            f"{row['body']}.{row['recovery']}.{row['place']}.{row['component']}": float(row["margin"]) for row in rows
        }
        return found | {
            f"{found.name}.{peak.channel}": peak.margin for found in self.responses for peak in found.response.worst()
        }

    def _required(self) -> list[Requirement]:
        """Return the requirements of [require]; those on the body only where it was built."""
        if self.asked is None:
            return []
        from modalprep.pipeline.responses.required import required_margin, required_of_body

        table, built = self.asked.require, self.built
        of_body = required_of_body(table, built.body, built.error) if built else []
        return [*of_body, *required_margin(table, self.margins.values())]
