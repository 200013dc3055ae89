"""What a result is worth: requirements that are met or not, warnings, and the verdict that follows from both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

PASSED, FAILED, UNCHECKED = "passed", "FAILED", "not checked"
PASS, WARNED, FAIL, OPEN = "PASS", "PASS WITH WARNINGS", "FAIL", "NOT CHECKED"
NAMED = 3  # requirements in one sentence


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """What was required of a result, and whether it is met.

    Attributes
    ----------
    name : str
    result : {"passed", "FAILED", "not checked"}
    says : str
        Value and limit, or why it was not checked.
    anchor : str
        Of the place on the page that has more; those of a section without one lead to the section.
    """

    name: str
    result: Literal["passed", "FAILED", "not checked"]
    says: str = ""
    anchor: str = ""

    def __str__(self) -> str:
        """Return the name with what there is to say."""
        return f"{self.name}: {self.says}" if self.says else self.name


@dataclass(frozen=True)
class Verdict:
    """One word for a result, with its reasons: the same on the page, in JSON, in the terminal and in the exit code.

    FAIL where a requirement is not met, PASS WITH WARNINGS where there is a warning, PASS where what was checked is
    well, NOT CHECKED where nothing was.

    Attributes
    ----------
    requirements : tuple of Requirement
    warnings : tuple of str

    Examples
    --------
    >>> met = Requirement(name="mass", result="passed")
    >>> Verdict((met,)).word, Verdict((met,), ("its size is implausible",)).word, Verdict().word
    ('PASS', 'PASS WITH WARNINGS', 'NOT CHECKED')
    """

    requirements: tuple[Requirement, ...] = ()
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(cls, requirements: Iterable[Requirement], warnings: Iterable[str] = ()) -> Verdict:
        """Return the verdict of requirements and warnings, each warning once.

        Returns
        -------
        Verdict
            Also of none of them.
        """
        return cls(tuple(requirements), tuple(dict.fromkeys(warnings)))

    def those(self, result: str) -> tuple[Requirement, ...]:
        """Return the requirements with a result.

        Returns
        -------
        tuple of Requirement
            In their order.
        """
        return tuple(requirement for requirement in self.requirements if requirement.result == result)

    @property
    def word(self) -> str:
        """PASS, PASS WITH WARNINGS, FAIL or NOT CHECKED."""
        if self.those(FAILED):
            return FAIL
        if self.warnings:
            return WARNED
        return PASS if self.those(PASSED) else OPEN

    @property
    def counts(self) -> str:
        """How many requirements are met or not, and how many warnings there are.

        Examples
        --------
        >>> Verdict((), ("its size is implausible",)).counts
        '0 requirements met, 0 not met, 0 not checked, 1 warning'
        """
        met, failed, left = (len(self.those(result)) for result in (PASSED, FAILED, UNCHECKED))
        plural = "" if met == 1 else "s", "" if len(self.warnings) == 1 else "s"
        warned = f"{len(self.warnings)} warning{plural[1]}"
        return f"{met} requirement{plural[0]} met, {failed} not met, {left} not checked, {warned}"

    @property
    def reasons(self) -> tuple[str, ...]:
        """Requirements that are not met, then warnings."""
        return (*map(str, self.those(FAILED)), *self.warnings)

    @property
    def lines(self) -> list[str]:
        """The verdict as a command prints it last: the word with its counts, then a line for each reason.

        Examples
        --------
        >>> Verdict((Requirement(name="mass", result="passed"),)).lines
        ['PASS: 1 requirement met, 0 not met, 0 not checked, 0 warnings']
        """
        failed = [f"  not met: {requirement}" for requirement in self.those(FAILED)]
        return [f"{self.word}: {self.counts}", *failed, *(f"  warning: {warning}" for warning in self.warnings)]

    @property
    def failure(self) -> str:
        """A sentence of the requirements that are not met, with which a command ends; empty where all are.

        Examples
        --------
        >>> Verdict((Requirement(name="margin of strut N", result="FAILED", says="-0.2 at 3"),)).failure
        '1 requirement is not met: margin of strut N (-0.2 at 3)'
        """
        failed = [f"{requirement.name} ({requirement.says})" for requirement in self.those(FAILED)]
        if not failed:
            return ""
        count = "1 requirement is" if len(failed) == 1 else f"{len(failed)} requirements are"
        more = f" and {len(failed) - NAMED} more" if len(failed) > NAMED else ""
        return f"{count} not met: {', '.join(failed[:NAMED])}{more}"

    def summary(self) -> dict[str, Any]:
        """Return the verdict for JSON: the word, every requirement with its result, the warnings.

        Returns
        -------
        dict
            Which `read_verdict` reads.
        """
        rows = [{"name": r.name, "result": r.result, "says": r.says} for r in self.requirements]
        return {"word": self.word, "requirements": rows, "warnings": list(self.warnings)}


def read_verdict(table: Mapping[str, Any]) -> Verdict:
    """Return the verdict that `Verdict.summary` wrote.

    Examples
    --------
    >>> read_verdict(Verdict((), ("its mass is implausible",)).summary()).word
    'PASS WITH WARNINGS'
    """
    return Verdict.of((Requirement(**row) for row in table["requirements"]), table["warnings"])
