"""What control laws ask of the steps: the parts of their expressions that depend on time alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from modalprep.multibody.evaluation.expressions import CHANNEL
from modalprep.multibody.model.functions.safe_expression import read_expression
from modalprep.multibody.packing.step_bounds import smooth_cells, tolerance_of

ROUNDS = 12  # of halving the intervals in which a part is not smooth


def parts_of_time(text: str) -> list[Any]:
    """Return the largest parts of a law that depend on `t` alone, as symengine's.

    Examples
    --------
    >>> parts_of_time("-3*hinge.angle*sin(t)^2 + 5")
    [sin(t)**2]
    """
    names = dict.fromkeys(CHANNEL.findall(text))
    symbols = {name: f"channel_{k}" for k, name in enumerate(names)}
    known = ("t", *symbols.values())
    return list(_parts(read_expression(CHANNEL.sub(lambda match: symbols[match[0]], text), text[:60], known)))


def _parts(node: Any) -> Iterator[Any]:
    names = {str(symbol) for symbol in node.free_symbols}
    if names == {"t"}:
        yield node
    elif "t" in names:
        for part in node.args:
            yield from _parts(part)


def smooth_times(part: Any, t_end: float, width: float) -> np.ndarray:
    """Return times (s) between which a part of a law is smooth, as far as it is seen at two times in each event."""
    import symengine

    values = symengine.Lambdify([symengine.Symbol("t")], [part])
    t = np.linspace(0.0, t_end, int(np.ceil(2 * t_end / width)) + 1)
    edges = np.arange(len(t))
    for _ in range(ROUNDS):
        with np.errstate(all="ignore"):
            value = np.asarray(values(t[:, None]), dtype=float).reshape(-1)
        value = np.where(np.isfinite(value), value, 0.0)
        edges = smooth_cells(t, value, tolerance_of(value))
        rough = edges[:-1][np.diff(edges) == 1]
        if not len(rough):
            break
        t = np.union1d(t, (t[rough] + t[rough + 1]) / 2)
    return t[edges]
