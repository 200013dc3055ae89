"""Mode selection by a user expression, with the reason for each mode."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from modalprep.errors import InputError
from modalprep.reduction.table import DIRECTIONS

if TYPE_CHECKING:
    from modalprep.reduction.recoveries.shares import Share

OPERATORS: dict[type, tuple[Callable, str]] = {
    ast.Lt: (operator.lt, "<"),
    ast.LtE: (operator.le, "<="),
    ast.Gt: (operator.gt, ">"),
    ast.GtE: (operator.ge, ">="),
}
MIRRORED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE}
LARGEST = 1e300
NOTHING = 1e-6  # fraction of the body's mass
TINY = 1e-5  # fraction below which no digits are written
RECOVERY = "recovery"
SHARES = ("effective_mass", "cumulative", "static", "controllability", "observability")
VALUES = ("frequency", *SHARES, RECOVERY, "mode")
HELP = "write for example 'static > 1% or frequency < 500 Hz'"
Values = dict[str, tuple[float, str]]


def select(
    keep: str | Sequence[int],
    frequency: np.ndarray,
    fraction: np.ndarray | None = None,
    static: np.ndarray | None = None,
    controllability: np.ndarray | None = None,
    observability: np.ndarray | None = None,
    recovery: Mapping[str, Sequence[Share]] | None = None,
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return which modes satisfy the expression `keep`, and the reason for each.

    Parameters
    ----------
    keep : str or list of int
        Comparisons of values with numbers, such as ``frequency < 500 Hz`` or ``20 < frequency < 500``, joined by
        ``and``, ``or``, ``not`` and parentheses; ``all`` keeps all; a list of mode numbers (1, 2, ...) keeps these.
        The values of a mode:

        - ``frequency``, Hz;
        - ``effective_mass``, the largest of its six fractions of the body's mass;
        - ``cumulative``, the fraction that modes of larger effective mass have together, in its smallest direction:
          ``cumulative < 90%`` keeps the fewest modes that reach 90 % in every direction that can;
        - ``static``, its largest fraction of the strain energy of the loads (interfaces, inertia, user);
        - ``controllability``, ``observability``: how strongly it answers to its interfaces and is seen there, over the
          strongest candidate (`participation.interface_shares`);
        - ``recovery``, its largest share in any of the recoveries, ``recovery.NAME`` that in one of them
          (`recoveries.shares`);
        - ``mode``, its number.
    frequency : (n,) Hz
    fraction : (n, 6)
        Effective mass over the body's total.
    static, controllability, observability : (n,)
        A selection variable that is not given (None) cannot be used.
    recovery : {name: n shares}

    Raises
    ------
    InputError
        When the expression cannot be read, these modes have no such value, or a listed mode does not exist.

    Examples
    --------
    >>> select("effective_mass > 10%", np.array([1.0, 9.0]), np.array([[.6, 0, 0, 0, 0, 0], [.01, 0, 0, 0, 0, 0]]))
    (array([ True, False]), ('effective mass 60% in x > 10%', 'effective mass 1% in x, not > 10%'))
    >>> select("5 < frequency < 500 Hz", np.array([1.0, 9.0]))[1]
    ('frequency 1 Hz, not > 5', 'frequency 9 Hz > 5; frequency 9 Hz < 500')
    """
    n = len(frequency)
    if not isinstance(keep, str):
        return _listed(keep, n)
    if keep.strip() == "all":
        return np.ones(n, dtype=bool), ("all candidates kept",) * n
    tree = _parse(keep)
    columns = _columns(frequency, fraction, static, controllability, observability) | _recovered(recovery or {})
    _judge(tree, dict.fromkeys(columns, (0.0, "")))  # errors are reported without modes too
    verdicts = [_judge(tree, {name: column[k] for name, column in columns.items()}) for k in range(n)]
    return np.array([kept for kept, _ in verdicts], dtype=bool), tuple(reason for _, reason in verdicts)


def refuse_unreadable(keep: str | Sequence[int]) -> None:
    """Refuse an expression that cannot be read, before there are modes.

    Raises
    ------
    InputError

    Examples
    --------
    >>> refuse_unreadable("effective_mass > 10% or frequency < 2 kHz")
    >>> refuse_unreadable("f < 1 h")
    Traceback (most recent call last):
    modalprep.errors.InputError: keep = 'f < 1 h' cannot be read; write for example 'static > 1% or frequency < 500 Hz'
    """
    if isinstance(keep, str) and keep.strip() != "all":
        names = (f"{RECOVERY}.{name}" for name in recoveries_named(keep)[1])
        _judge(_parse(keep), dict.fromkeys((*VALUES, *names), (0.0, "")))


def _parse(keep: str) -> ast.expr:
    text = re.sub(r"(?<=[\d.])\s*Hz\b", "", keep)
    text = re.sub(r"([\d.]+(?:e[+-]?\d+)?)\s*kHz\b", r"(\1 * 1000)", text)
    text = re.sub(r"([\d.]+(?:e[+-]?\d+)?)\s*%", r"(\1 * 0.01)", text)
    text = re.sub(r"\brecovery\.(\w[\w-]*)", r"recovery['\1']", text)
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


def _columns(frequency, fraction, static, controllability, observability) -> dict[str, list[tuple[float, str]]]:
    """Return, for each selection variable, (value, text) of every mode."""
    columns = {
        "frequency": [(f, f"frequency {f:.5g} Hz") for f in frequency],
        "mode": [(k, f"mode {k}") for k in range(1, len(frequency) + 1)],
    }
    if fraction is not None:
        columns |= {"effective_mass": _largest(fraction), "cumulative": _cumulative(fraction)}
    if static is not None:
        columns["static"] = [(v, f"static share {100 * v:.3g}%") for v in static]
    for name, values in (("controllability", controllability), ("observability", observability)):
        if values is not None:
            columns[name] = [(v, f"{name} {100 * v:.3g}%") for v in values]
    return columns


def _recovered(recovery: Mapping[str, Sequence[Share]]) -> dict[str, list[tuple[float, str]]]:
    """Return the columns of each recovery, and of the largest share in any."""
    columns = {f"{RECOVERY}.{name}": [(s.value, s.words()) for s in shares] for name, shares in recovery.items()}
    if columns:
        columns[RECOVERY] = [max(shares) for shares in zip(*columns.values(), strict=True)]
    return columns


def recoveries_named(keep: str | Sequence[int]) -> tuple[bool, tuple[str, ...]]:
    """Return whether `keep` asks for recoveries, and which it names.

    Examples
    --------
    >>> recoveries_named("recovery > 1% or recovery.struts > 5%"), recoveries_named([1, 2])
    ((True, ('struts',)), (False, ()))
    """
    text = keep if isinstance(keep, str) else ""
    named = re.findall(r"\brecovery(?:\.|\[['\"])(\w[\w-]*)", text)
    return bool(re.search(r"\brecovery\b", text)), tuple(dict.fromkeys(named))


def _largest(fraction: np.ndarray) -> list[tuple[float, str]]:
    most = fraction.argmax(axis=1)
    return [(f[d], f"effective mass {_share(f[d])} in {DIRECTIONS[d]}") for f, d in zip(fraction, most, strict=True)]


def _share(fraction: float) -> str:
    return f"{100 * fraction:.3g}%" if fraction >= TINY else "below 0.001%"


def _cumulative(fraction: np.ndarray) -> list[tuple[float, str]]:
    """Cumulative fraction of heavier modes in its smallest direction; directions without motion are ignored."""
    order = np.argsort(-fraction, axis=0, kind="stable")
    descending = np.take_along_axis(fraction, order, axis=0)
    before = np.zeros_like(fraction)
    np.put_along_axis(before, order, np.cumsum(descending, axis=0) - descending, axis=0)
    before[fraction <= NOTHING] = np.inf
    least = before.argmin(axis=1)
    return [(b[d], f"heavier modes have {_share(b[d])} in {DIRECTIONS[d]}") for b, d in zip(before, least, strict=True)]


def _judge(node: ast.expr, values: Values) -> tuple[bool, str]:
    """Return the result of one expression and its text."""
    match node:
        case ast.BoolOp(op=op, values=parts):
            verdicts = [_judge(part, values) for part in parts]
            kept = (any if isinstance(op, ast.Or) else all)(v for v, _ in verdicts)
            return kept, "; ".join(dict.fromkeys(words for v, words in verdicts if v == kept))
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            kept, words = _judge(inner, values)
            return not kept, words
        case ast.Compare(left=first, ops=[_, _, *_] as ops, comparators=others):
            pairs = zip([first, *others[:-1]], ops, others, strict=True)
            return _judge(ast.BoolOp(ast.And(), [ast.Compare(a, [op], [b]) for a, op, b in pairs]), values)
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in OPERATORS:
            if name := _variable(left):
                return _compared(name, type(op), _number(right), values)
            if name := _variable(right):
                return _compared(name, MIRRORED[type(op)], _number(left), values)
    names = (each.id for each in ast.walk(node) if isinstance(each, ast.Name))
    close = [match for name in names for match in get_close_matches(name, VALUES, n=1) if name not in VALUES]
    guess = f"did you mean {close[0]!r}? " if close else ""
    raise InputError(
        f"keep: {_shown(node)!r} is not a comparison of {', '.join(VALUES[:-1])} or {VALUES[-1]}; {guess}{HELP}"
    )


def _shown(node: ast.expr) -> str:
    """Return the text of an expression as it was given."""
    return re.sub(r"([\w.]+) \* 0\.01\b", r"\1%", re.sub(r"([\w.]+) \* 1000\b", r"\1 kHz", ast.unparse(node)))[:60]


def _variable(node: ast.expr) -> str:
    """Return the name of a selection variable; empty where it is none."""
    match node:
        case ast.Name(id=name) if name in VALUES:
            return name
        case ast.Subscript(value=ast.Name(id="recovery"), slice=ast.Constant(value=str() as name)):
            return f"{RECOVERY}.{name}"
    return ""


def _compared(name: str, op: type, limit: float, values: Values) -> tuple[bool, str]:
    if name not in values:
        more = "; recoveries are [recovery.NAME] tables" if name.startswith(RECOVERY) else ""
        raise InputError(f"keep: these modes have no {name}; they have {', '.join(values)}{more}")
    compare, sign = OPERATORS[op]
    value, words = values[name]
    kept = bool(compare(value, limit))
    shown = f"{100 * limit:g}%" if name in SHARES or name.startswith(RECOVERY) else f"{limit:g}"
    return kept, f"{words} {sign} {shown}" if kept else f"{words}, not {sign} {shown}"


def _number(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if abs(value) < LARGEST:
            return float(value)
        case ast.BinOp(op=ast.Mult(), left=left, right=right):
            return _number(left) * _number(right)
    raise InputError(f"keep: {_shown(node)!r} is not a usable number; {HELP}")
