"""What was required of a body and its responses, and whether it is met."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.body.checks import beyond, required_checks
from modalprep.report.body_page.section import anchor_of
from modalprep.report.tables import margin_of_safety
from modalprep.verdicts.notes import warnings_of
from modalprep.verdicts.verdict import FAILED, PASSED, UNCHECKED, Requirement, Verdict

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.multibody.results.envelopes import Envelope
    from modalprep.response.fatigue import Fatigue
    from modalprep.response.result import Response

NOT_MEASURED = "it was not measured; up_to under [reduction] asks for it"


def of_envelopes(envelopes: Iterable[Envelope]) -> list[Requirement]:
    """Return the requirements of margins; recoveries without an allowable are not checked."""
    rows = [row for envelope in envelopes for row in envelope.worst()]
    known = [row for row in rows if row["margin"] == row["margin"]]
    found = [
        Requirement(
            name=f"margin of {row['body']}.{row['recovery']} {row['component']}",
            anchor="recovered",
            result=PASSED if float(row["margin"]) >= 0 else FAILED,
            says=f"{margin_of_safety(float(row['margin']))} at {row['place']}",
        )
        for row in known
    ]
    if len(known) < len(rows):
        says = f"{len(rows) - len(known)} components of the recoveries have no allowable"
        found.append(Requirement(name="margins", result=UNCHECKED, anchor="recovered", says=says))
    return found


def of_errors(curves: Mapping[str, tuple[Any, Any]] | None, limits: Mapping[str, float]) -> list[Requirement]:
    """Return the requirement on each error against the full model; those without a limit are not checked.

    Examples
    --------
    >>> of_errors({"frequencies": ([1.0, 2.0], [1e-6, 1e-3])}, {"frequencies": 1e-2})[0].result
    'passed'
    """
    if not curves:
        return [Requirement(name="error against the full model", result=UNCHECKED, says=NOT_MEASURED)]
    found = []
    for label, (_, values) in curves.items():
        worst = float(np.max(values, initial=0.0))
        limit = limits.get(label)
        result = UNCHECKED if limit is None else PASSED if worst <= limit else FAILED
        asked = "no limit is given: target_error sets one" if limit is None else f"limit {limit:.0e}"
        name = f"error of {label}"
        found.append(Requirement(name=name, result=result, says=f"{worst:.1e}, {asked}", anchor="errors"))
    return found


def of_response(name: str, response: Response) -> list[Requirement]:
    """Return the requirements of the margins of a response."""
    return [
        Requirement(
            name=f"margin of {peak.channel} in response {name}",
            result=PASSED if peak.margin >= 0 else FAILED,
            says=margin_of_safety(peak.margin),
            anchor=anchor_of("response", name),
        )
        for peak in response.worst()
        if peak.margin == peak.margin
    ]


def of_damage(name: str, damage: Mapping[str, Fatigue]) -> Requirement:
    """Return the requirement on the largest damage of channels, which must be below 1."""
    worst = max(damage, key=lambda key: damage[key].damage)
    result = PASSED if damage[worst].damage < 1 else FAILED
    says = f"largest damage {damage[worst].damage:.3g} of 1, at {worst}"
    return Requirement(name=f"fatigue {name}", result=result, says=says, anchor=anchor_of("fatigue", name))


def body_verdict(
    *,
    checks: Sequence[Check] = (),
    notes: Sequence[str] = (),
    envelopes: Sequence[Envelope] = (),
    errors: Mapping[str, tuple[Any, Any]] | None = None,
    error_limits: Mapping[str, float] | None = None,
    requirements: Sequence[Requirement] = (),
) -> Verdict:
    """Return the verdict of a body by its checks, notes, extremes, errors and further requirements.

    Examples
    --------
    >>> from modalprep.body.checks import Check
    >>> found = body_verdict(checks=[Check("mass", 1e-12, 1e-9, "")], notes=["its mass is implausible"])
    >>> found.word, found.reasons
    ('PASS WITH WARNINGS', ('its mass is implausible',))
    """
    met = [*required_checks(checks), *of_envelopes(envelopes), *of_errors(errors, error_limits or {}), *requirements]
    return Verdict.of(met, (*beyond(checks), *warnings_of(notes)))
