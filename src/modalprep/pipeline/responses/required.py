"""Requirements of a pipeline file's [require] on its body: value, limit, result."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.quality.effective_mass import participation, totals
from modalprep.pipeline.schema.responses.require import RequireTable, _Bounds, bounds
from modalprep.reduction.error import ReductionError
from modalprep.reduction.table import DIRECTIONS
from modalprep.report.body_page.requirements import NOT_MEASURED
from modalprep.verdicts.verdict import FAILED, PASSED, UNCHECKED, Requirement

SIGNIFICANT = 0.1  # share of the effective mass in a direction, above which a mode counts as one of it
NO_MARGIN = "nothing has an allowable or a limit"


def required_of_body(table: RequireTable, body: FlexibleBody, error: ReductionError | None) -> list[Requirement]:
    """Return the requirements of a table on a body and its error.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> table = RequireTable.model_validate({"mass": {"below": "10 kg"}})
    >>> [str(requirement) for requirement in required_of_body(table, uniform_beam(modes=2), None)]
    ['mass: 12 kg, must be below 10 kg']
    """
    return [*_inertia(table, body), *_frequencies(table, body), *_effective(table, body), *_error(table, error)]


def required_margin(table: RequireTable, margins: Iterable[float]) -> list[Requirement]:
    """Return the requirement on the smallest of margins; NaN is an unknown margin.

    Examples
    --------
    >>> str(required_margin(RequireTable(margin=0.25), [0.5, float("nan"), 0.1])[0])
    'least margin: 0.1, must be at least 0.25'
    """
    if table.margin is None:
        return []
    known = [margin for margin in margins if margin == margin]
    if not known:
        return [Requirement(name="least margin", result=UNCHECKED, says=NO_MARGIN)]
    return [_judged("least margin", min(known) >= table.margin, f"{min(known):.3g}", f"at least {table.margin:g}")]


def _inertia(table: RequireTable, body: FlexibleBody) -> Iterator[Requirement]:
    if table.mass is not None:
        yield _between("mass", body.m, table.mass, "kg")
    for axis, bound in bounds(table.centre_of_mass):
        yield _between(f"centre of mass {axis}", float((body.s0 / body.m)["xyz".index(axis)]), bound, "m")


def _frequencies(table: RequireTable, body: FlexibleBody) -> Iterator[Requirement]:
    for key, bound in bounds(table.frequency):
        name = "first frequency" if key == "first" else f"first frequency with 10 % of the effective mass in {key}"
        frequencies = body.frequency[(body.K > 0) & _has_mass(body, key)]
        if len(frequencies):
            yield _between(name, float(frequencies[0]), bound, "Hz")
        else:
            yield Requirement(name=name, result=UNCHECKED, says="the body has no such mode")


def _has_mass(body: FlexibleBody, key: str) -> np.ndarray:
    """Return which modes have a significant effective mass in a direction; all of them for ``first``."""
    if key == "first":
        return np.ones(body.n, dtype=bool)
    axis = DIRECTIONS.index(key)
    return participation(body)[:, axis] ** 2 > SIGNIFICANT * totals(body)[axis]


def _effective(table: RequireTable, body: FlexibleBody) -> Iterator[Requirement]:
    if table.effective_mass is None:
        return
    for axis, share in zip(DIRECTIONS[:3], (participation(body)[:, :3] ** 2).sum(axis=0) / body.m, strict=True):
        limit = f"at least {100 * table.effective_mass:g} %"
        yield _judged(f"effective mass {axis}", share >= table.effective_mass, f"{100 * share:.1f} %", limit)


def _error(table: RequireTable, error: ReductionError | None) -> Iterator[Requirement]:
    if table.error is None:
        return
    name = "error against the full model"
    if error is None:
        yield Requirement(name=name, result=UNCHECKED, says=NOT_MEASURED)
        return
    worst = largest_error(error)
    yield _judged(name, worst <= table.error, f"{100 * worst:.2g} %", f"at most {100 * table.error:g} %")


def largest_error(error: ReductionError) -> float:
    """Return the largest relative error of a reduction, those of recoveries included."""
    return max(error.worst, float(np.max(error.recovery, initial=0.0)))


def _between(name: str, value: float, bound: _Bounds, unit: str) -> Requirement:
    met = (bound.above is None or value >= bound.above) and (bound.below is None or value <= bound.below)
    limits = [
        f"{word} {limit:g} {unit}"
        for word, limit in (("above", bound.above), ("below", bound.below))
        if limit is not None
    ]
    return _judged(name, met, f"{value:.4g} {unit}", " and ".join(limits))


def _judged(name: str, met: bool, value: str, limit: str) -> Requirement:
    return Requirement(name=name, result=PASSED if met else FAILED, says=f"{value}, must be {limit}")
