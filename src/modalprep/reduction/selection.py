"""Which modes to keep, by an expression the user writes, and why."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable

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
HELP = "write for example 'effective_mass > 0.1% or frequency < 500 Hz'"


def select(keep: str, frequency: np.ndarray, fraction: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return which modes satisfy the expression `keep`, and the reason for each.

    Parameters
    ----------
    keep : str
        Comparisons of ``frequency`` (Hz), ``effective_mass`` (the largest of its six fractions of the body's mass)
        and ``mode`` (1, 2, ...) with numbers, joined by ``and``, ``or``, ``not`` and parentheses; ``all`` keeps all.
    frequency : (n,) Hz
    fraction : (n, 6)
        Effective mass over the body's total.

    Raises
    ------
    InputError
        When the expression cannot be read.

    Examples
    --------
    >>> select("effective_mass > 10%", np.array([1.0, 9.0]), np.array([[.6, 0, 0, 0, 0, 0], [.01, 0, 0, 0, 0, 0]]))
    (array([ True, False]), ('effective mass 60% in x > 10%', 'effective mass 1% in x, not > 10%'))
    """
    n = len(frequency)
    if keep.strip() == "all":
        return np.ones(n, dtype=bool), ("all candidates kept",) * n
    tree = _parse(keep)
    _judge(tree, _mode_values(0, np.zeros(1), np.zeros((1, 6))))  # a bad expression is bad without modes too
    verdicts = [_judge(tree, _mode_values(k, frequency, fraction)) for k in range(n)]
    return np.array([kept for kept, _ in verdicts], dtype=bool), tuple(reason for _, reason in verdicts)


def _parse(keep: str) -> ast.expr:
    text = re.sub(r"(?<=[\d.])\s*Hz\b", "", keep)
    text = re.sub(r"([\d.]+(?:e[+-]?\d+)?)\s*%", r"(\1 * 0.01)", text)
    try:
        return ast.parse(text, mode="eval").body
    except (SyntaxError, RecursionError, MemoryError, ValueError):
        raise InputError(f"keep = {keep[:60]!r} cannot be read; {HELP}") from None


def _mode_values(k: int, frequency: np.ndarray, fraction: np.ndarray) -> dict[str, tuple[float, str]]:
    largest = int(np.argmax(fraction[k]))
    mass = fraction[k, largest]
    return {
        "frequency": (frequency[k], f"frequency {frequency[k]:.5g} Hz"),
        "effective_mass": (mass, f"effective mass {100 * mass:.3g}% in {DIRECTIONS[largest]}"),
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
            shown = f"{100 * limit:g}%" if name == "effective_mass" else f"{limit:g}"
            return kept, f"{words} {sign} {shown}" if kept else f"{words}, not {sign} {shown}"
    raise InputError(f"keep: {ast.unparse(node)!r} is not a comparison of frequency, effective_mass or mode; {HELP}")


def _number(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if abs(value) < LARGEST:
            return float(value)
        case ast.BinOp(op=ast.Mult(), left=left, right=right):
            return _number(left) * _number(right)
    raise InputError(f"keep: {ast.unparse(node)[:60]!r} is not a number of any use; {HELP}")
