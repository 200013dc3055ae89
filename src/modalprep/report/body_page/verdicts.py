"""The box at the top of the page: PASS or FAIL, with the requirements that failed and those not checked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from modalprep.report.body_page.section import FAILED, PASSED, UNCHECKED, Verdict
from modalprep.report.body_page.table import Table, part
from modalprep.report.tables import margin_of_safety

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.multibody.results.envelopes import Envelope
    from modalprep.response.fatigue import Fatigue
    from modalprep.response.result import Response

NOT_MEASURED = "it was not measured; up_to under [reduction] asks for it"
NAMED = 3  # requirements in one sentence
COLUMNS = ("check", "value", "limit", "result", "meaning")


def of_checks(checks: Iterable[Check]) -> list[Verdict]:
    """Return the verdicts of physics checks; one beyond its limit that is not required counts as not checked."""
    return [
        Verdict(name=check.name, result=_result(check), anchor=f"check-{number}",
                says=f"{check.value:.1e}, limit {check.limit:.0e}: {check.meaning}")
        for number, check in enumerate(checks, start=1)
    ]  # fmt: skip


def _result(check: Check) -> str:
    return PASSED if check.within else FAILED if check.required else UNCHECKED


def of_envelopes(envelopes: Iterable[Envelope]) -> list[Verdict]:
    """Return the verdicts of margins; recoveries without an allowable are not checked."""
    rows = [row for envelope in envelopes for row in envelope.worst()]
    known = [row for row in rows if row["margin"] == row["margin"]]
    found = [
        Verdict(name=f"margin of {row['body']}.{row['recovery']} {row['component']}", anchor="recovered",
                result=PASSED if row["margin"] >= 0 else FAILED,
                says=f"{margin_of_safety(row['margin'])} at {row['place']}")
        for row in known
    ]  # fmt: skip
    if len(known) < len(rows):
        says = f"{len(rows) - len(known)} components of the recoveries have no allowable"
        found.append(Verdict(name="margins", result=UNCHECKED, anchor="recovered", says=says))
    return found


def of_errors(curves: Mapping[str, tuple[Any, Any]] | None, limits: Mapping[str, float]) -> list[Verdict]:
    """Return the verdict of each error against the full model; those without a limit are not checked.

    Examples
    --------
    >>> of_errors({"frequencies": ([1.0, 2.0], [1e-6, 1e-3])}, {"frequencies": 1e-2})[0].result
    'passed'
    """
    if not curves:
        return [Verdict(name="error against the full model", result=UNCHECKED, says=NOT_MEASURED)]
    found = []
    for label, (_, values) in curves.items():
        worst, limit = float(np.max(values, initial=0.0)), limits.get(label)
        result = UNCHECKED if limit is None else PASSED if worst <= limit else FAILED
        asked = "no limit is given: target_error sets one" if limit is None else f"limit {limit:.0e}"
        name = f"error of {label}"
        found.append(Verdict(name=name, result=result, says=f"{worst:.1e}, {asked}", anchor="errors"))
    return found


def of_response(name: str, response: Response) -> list[Verdict]:
    """Return the verdicts of the margins of a response."""
    return [
        Verdict(name=f"margin of {peak.channel} in response {name}", result=PASSED if peak.margin >= 0 else FAILED,
                says=margin_of_safety(peak.margin))
        for peak in response.worst() if peak.margin == peak.margin
    ]  # fmt: skip


def of_damage(name: str, damage: Mapping[str, Fatigue]) -> Verdict:
    """Return the verdict of the largest damage of channels, which must be below 1."""
    worst = max(damage, key=lambda key: damage[key].damage)
    result = PASSED if damage[worst].damage < 1 else FAILED
    return Verdict(
        name=f"fatigue {name}", result=result, says=f"largest damage {damage[worst].damage:.3g} of 1, at {worst}"
    )


def exceeded(verdicts: Iterable[Verdict]) -> tuple[str, ...]:
    """Return a sentence of the margins and damages that failed, with which a command ends; nothing where none did.

    Examples
    --------
    >>> exceeded([Verdict(name="margin of strut N", result=FAILED, says="-0.2 at 3")])
    ('1 requirement is not met: margin of strut N (-0.2 at 3)',)
    """
    failed = [f"{verdict.name} ({verdict.says})" for verdict in verdicts if verdict.result == FAILED]
    if not failed:
        return ()
    count = "1 requirement is" if len(failed) == 1 else f"{len(failed)} requirements are"
    more = f" and {len(failed) - NAMED} more" if len(failed) > NAMED else ""
    return (f"{count} not met: {', '.join(failed[:NAMED])}{more}",)


def check_table(checks: Sequence[Check]) -> Table:
    """Return the checks with value, limit, result and meaning.

    Examples
    --------
    >>> from modalprep.body.checks import Check
    >>> check_table([Check("mass", 1e-12, 1e-9, "of body and mesh")]).rows
    [('mass', 1e-12, 1e-09, 'passed', 'of body and mesh')]
    """
    return Table(
        name="check-table",
        columns=COLUMNS,
        rows=[(check.name, check.value, check.limit, _result(check), check.meaning) for check in checks],
        forms={"value": ".1e", "limit": ".0e"},
        marks=[f"check-{number}" for number in range(1, len(checks) + 1)],
        caption="Relative errors of identities that a wrong sign, unit or matrix violates.",
    )


def verdict_box(verdicts: Sequence[Verdict]) -> Markup:
    """Return the box: one word, the counts, and what failed or was not checked, with links.

    Examples
    --------
    >>> bad = Verdict(name="modal mass", result="FAILED", says="2e-3, limit 1e-7", anchor="check-1")
    >>> "FAIL" in verdict_box([bad]), 'href="#check-1"' in verdict_box([bad])
    (True, True)
    """
    by = {word: [v for v in verdicts if v.result == word] for word in (FAILED, UNCHECKED, PASSED)}
    word = "FAIL" if by[FAILED] else "PASS" if by[PASSED] else "NOT CHECKED"
    return part("box.html", word=word, failed=by[FAILED], unchecked=by[UNCHECKED], passed=len(by[PASSED]))
