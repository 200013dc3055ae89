"""Which modes to keep, by an expression the user writes, and why."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Sequence

import numpy as np

from modalprep.errors import InputError
from modalprep.reduction.table import DIRECTIONS

OPERATORS: dict[type, tuple[Callable, str]] = {
    ast.Lt: (operator.lt, "<"),
    ast.LtE: (operator.le, "<="),
    ast.Gt: (operator.gt, ">"),
    ast.GtE: (operator.ge, ">="),
}
LARGEST = 1e300
NOTHING = 1e-6  # fraction of the body's mass
SHARES = {"effective_mass", "cumulative", "static"}
HELP = "write for example 'effective_mass > 0.1% or frequency < 500 Hz'"


def select(
    keep: str | Sequence[int], frequency: np.ndarray, fraction: np.ndarray, static: np.ndarray | None = None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return which modes satisfy the expression `keep`, and the reason for each.

    Parameters
    ----------
    keep : str or list of int
        Comparisons of values with numbers, joined by ``and``, ``or``, ``not`` and parentheses; ``all`` keeps all; a
        list of mode numbers (1, 2, ...) keeps these. The values of a mode:

        - ``frequency``, Hz;
        - ``effective_mass``, the largest of its six fractions of the body's mass;
        - ``cumulative``, the fraction that heavier modes have already, in the direction where that is least:
          ``cumulative < 90%`` keeps the fewest modes that reach 90 % in every direction that can;
        - ``static``, its largest share of the strain energy of the unit loads (interfaces and inertia);
        - ``mode``, its number.
    frequency : (n,) Hz
    fraction : (n, 6)
        Effective mass over the body's total.
    static : (n,)
        Default 0.

    Raises
    ------
    InputError
        When the expression cannot be read, or a listed mode does not exist.

    Examples
    --------
    >>> select("effective_mass > 10%", np.array([1.0, 9.0]), np.array([[.6, 0, 0, 0, 0, 0], [.01, 0, 0, 0, 0, 0]]))
    (array([ True, False]), ('effective mass 60% in x > 10%', 'effective mass 1% in x, not > 10%'))
    """
    n = len(frequency)
    if not isinstance(keep, str):
        return _listed(keep, n)
    if keep.strip() == "all":
        return np.ones(n, dtype=bool), ("all candidates kept",) * n
    tree = _parse(keep)
    _judge(tree, _mode_values(0, *_columns(np.zeros(1), np.zeros((1, 6)), None)))  # bad without modes too
    columns = _columns(frequency, fraction, static)
    verdicts = [_judge(tree, _mode_values(k, *columns)) for k in range(n)]
    return np.array([kept for kept, _ in verdicts], dtype=bool), tuple(reason for _, reason in verdicts)


def _parse(keep: str) -> ast.expr:
    text = re.sub(r"(?<=[\d.])\s*Hz\b", "", keep)
    text = re.sub(r"([\d.]+(?:e[+-]?\d+)?)\s*%", r"(\1 * 0.01)", text)
    try:
        return ast.parse(text, mode="eval").body
    except (SyntaxError, RecursionError, MemoryError, ValueError):
        raise InputError(f"keep = {keep[:60]!r} cannot be read; {HELP}") from None


def _listed(modes: Sequence[int], n: int) -> tuple[np.ndarray, tuple[str, ...]]:
    wrong = [mode for mode in modes if not 1 <= mode <= n]
    if wrong:
        raise InputError(f"keep lists mode {wrong[0]}, but there are {n} candidates, counted from 1; raise 'modes'")
    kept = np.isin(np.arange(1, n + 1), list(modes))
    return kept, tuple("listed" if k else "not listed" for k in kept)


def _columns(frequency: np.ndarray, fraction: np.ndarray, static: np.ndarray | None) -> tuple:
    """Return frequency, fraction, cumulative fraction of heavier modes with its direction, and static share."""
    order = np.argsort(-fraction, axis=0, kind="stable")
    descending = np.take_along_axis(fraction, order, axis=0)
    before = np.zeros_like(fraction)
    np.put_along_axis(before, order, np.cumsum(descending, axis=0) - descending, axis=0)
    before[fraction <= NOTHING] = np.inf  # a direction in which the mode does not move says nothing about it
    return frequency, fraction, before, np.zeros(len(frequency)) if static is None else static


def _mode_values(k: int, frequency, fraction, before, static) -> dict[str, tuple[float, str]]:
    largest, least = int(np.argmax(fraction[k])), int(np.argmin(before[k]))
    mass, reached = fraction[k, largest], before[k, least]
    return {
        "frequency": (frequency[k], f"frequency {frequency[k]:.5g} Hz"),
        "effective_mass": (mass, f"effective mass {100 * mass:.3g}% in {DIRECTIONS[largest]}"),
        "cumulative": (reached, f"heavier modes have {100 * reached:.3g}% in {DIRECTIONS[least]}"),
        "static": (static[k], f"static share {100 * static[k]:.3g}%"),
        "mode": (k + 1, f"mode {k + 1}"),
    }


def _judge(node: ast.expr, values: dict[str, tuple[float, str]]) -> tuple[bool, str]:
    """Return the verdict of one expression and the words for it."""
    match node:
        case ast.BoolOp(op=op, values=parts):
            verdicts = [_judge(part, values) for part in parts]
            kept = (any if isinstance(op, ast.Or) else all)(v for v, _ in verdicts)
            return kept, "; ".join(dict.fromkeys(words for v, words in verdicts if v == kept))
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            kept, words = _judge(inner, values)
            return not kept, words
        case ast.Compare(left=ast.Name(id=name), ops=[op], comparators=[number]) if (
            name in values and type(op) in OPERATORS
        ):
            compare, sign = OPERATORS[type(op)]
            value, words = values[name]
            limit = _number(number)
            kept = bool(compare(value, limit))
            shown = f"{100 * limit:g}%" if name in SHARES else f"{limit:g}"
            return kept, f"{words} {sign} {shown}" if kept else f"{words}, not {sign} {shown}"
    raise InputError(
        f"keep: {ast.unparse(node)!r} is not a comparison of frequency, effective_mass, cumulative, static or mode; "
        f"{HELP}"
    )


def _number(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if abs(value) < LARGEST:
            return float(value)
        case ast.BinOp(op=ast.Mult(), left=left, right=right):
            return _number(left) * _number(right)
    raise InputError(f"keep: {ast.unparse(node)[:60]!r} is not a number of any use; {HELP}")
