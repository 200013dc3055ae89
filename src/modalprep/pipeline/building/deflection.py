"""Stations and derivatives that the deflection error of a pipeline file asks for."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, sqrt
from typing import TypeVar

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.error import errors_at
from modalprep.pipeline.schema.reduction import ReductionTable
from modalprep.reduction.table import DERIVATIVE_VECTORS

MORE = (2 * DERIVATIVE_VECTORS, 21)  # derivatives to try where the default leaves too much; there are no more than 21
SLACK = 2.0  # times the error that is asked for: estimates are not better
R = TypeVar("R")


def deflecting(
    table: ReductionTable, reduce: Callable[[int], R], build: Callable[[R, int], FlexibleBody]
) -> tuple[R, FlexibleBody]:
    """Return the reduction and the body whose error at `reach` is what the table asks for.

    Parameters
    ----------
    reduce : callable
        Of the number of derivatives.
    build : callable
        Of a reduction and the number of stations along each way.
    """
    reduction = reduce(DERIVATIVE_VECTORS if table.derivatives is None else table.derivatives)
    body = build(reduction, table.parts)
    if body.stations is None:
        return reduction, body
    asked = table.deflection_error
    for count in MORE if table.derivatives is None else ():
        if errors_at(body, table.reach).basis[0] <= asked:
            break
        reduction = reduce(count)
        body = build(reduction, table.parts)
    spacing = errors_at(body, table.reach).spacing[0]
    if table.stations is None and spacing > SLACK * asked:
        body = build(reduction, 2 * ceil(table.parts * sqrt(spacing / asked) / 2))
    return reduction, body.with_(notes=(*body.notes, *_missed(table, body)))


def _missed(table: ReductionTable, body: FlexibleBody) -> tuple[str, ...]:
    """Return a note where the numbers that a file gives leave more than the error it asks for, or none reach it."""
    found = float(errors_at(body, table.reach).both[0])
    chosen = table.stations is not None and table.derivatives is not None
    if chosen or found <= SLACK * table.deflection_error:
        return ()
    return (
        f"bent by {100 * table.reach:.0f} % of its size the body is off by about {100 * found:.1g} %, more than the "
        f"deflection_error of {100 * table.deflection_error:.2g} %; give 'stations' and 'derivatives' larger numbers, "
        "or more 'modes'",
    )
