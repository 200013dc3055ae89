"""The box at the top of the page, with the verdict and its reasons; the table of the checks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from modalprep.report.body_page.table import Table, part
from modalprep.report.numbers import raised
from modalprep.verdicts.verdict import FAIL, FAILED, PASS, UNCHECKED, WARNED, Verdict

if TYPE_CHECKING:
    from modalprep.body.checks import Check

CHECK = "check-"  # begins the anchors of checks
COLUMNS = ("check", "value", "limit", "result", "meaning")
RESULTS = {"passed": "passed", "failed": FAILED, "warning": "warning"}  # of the table
STYLES = {PASS: "pass", WARNED: "warned", FAIL: "fail"}  # of the box


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
        rows=[(check.name, check.value, check.limit, RESULTS[check.result], check.meaning) for check in checks],
        forms={"value": ".1e", "limit": ".0e"},
        marks=[f"check-{number}" for number in range(1, len(checks) + 1)],
        caption="Relative errors of identities that a wrong sign, unit or matrix violates.",
    )


def requirement_table(verdict: Verdict) -> Table:
    """Return the requirements besides the checks, which have a table of their own.

    Examples
    --------
    >>> from modalprep.verdicts.verdict import Requirement
    >>> met = Requirement(name="mass", result="passed", says="12 kg, must be below 20 kg")
    >>> requirement_table(Verdict((met,))).rows
    [('mass', 'passed', '12 kg, must be below 20 kg')]
    """
    rows = [(r.name, r.result, raised(r.says)) for r in verdict.requirements if not r.anchor.startswith(CHECK)]
    return Table(name="requirement-table", columns=("requirement", "result", "value and limit"), rows=rows)


def verdict_box(verdict: Verdict) -> Markup:
    """Return the box: the word, the counts, and what is not met, warns or was not checked, with links.

    Examples
    --------
    >>> from modalprep.verdicts.verdict import Requirement
    >>> bad = Requirement(name="modal mass", result="FAILED", says="2e-3, limit 1e-7", anchor="check-1")
    >>> box = verdict_box(Verdict((bad,)))
    >>> ">FAIL<" in box, 'href="#check-1"' in box
    (True, True)
    """
    rows = {"Not met": verdict.those(FAILED), "Not checked": verdict.those(UNCHECKED)}
    return part("box.html", verdict=verdict, rows=rows, style=STYLES.get(verdict.word, "open-box"))
