"""Many numbers of a text at once, where they are written plainly; what is not is left to the readers' own rules."""

from __future__ import annotations

import re
from functools import partial

import numpy as np

from modalprep.compiler.jit import compile_kernel

REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[ED]?([+-]\d+)|[ED](\d+))?")
POWERS = np.array([float(f"1e{k}") for k in range(23)])  # those that a double has exactly
EXACT = 2**53  # whole numbers up to it are doubles; times or over an exact power they are rounded once, as by float()
DIGITS = 18  # of an int64
LABEL = 10  # digits of a whole number
LARGE = 1e300  # no number of a model
BLANK, PLUS, MINUS, POINT, ZERO, NINE = (ord(c) for c in " +-.09")
LETTERS = tuple(ord(c) for c in "EeDd")


@partial(compile_kernel, fastmath=False)  # which would divide by a power as by its rounded inverse
def _read_fields(text, first, last, whole, bare, found):
    """Write the number of each field ``text[first:last]``, NaN of a blank one, infinity of one with many digits.

    `whole` says of the fields in turn, over and over, which are whole numbers. With `bare` an exponent may have a sign
    in place of its letter. Return the number of fields before the first that is no plain number.
    """
    for k in range(len(first)):
        i, end = first[k], last[k]
        while i < end and text[i] == BLANK:
            i += 1
        while i < end and text[end - 1] == BLANK:
            end -= 1
        if i == end:
            found[k] = np.nan
            continue
        sign = text[i]
        if sign == PLUS or sign == MINUS:
            i += 1
        digits, significant, mantissa, power, point = 0, 0, 0, 0, False
        while i < end:
            c = np.int64(text[i])
            if ZERO <= c <= NINE:
                digits += 1
                power -= point
                significant += significant > 0 or c > ZERO
                if significant <= DIGITS:
                    mantissa = 10 * mantissa + (c - ZERO)
            elif c == POINT and not point:
                point = True
            else:
                break
            i += 1
        if digits == 0:
            return k
        if whole[k % len(whole)]:
            if i < end or point or digits > LABEL or sign == PLUS or (sign == MINUS and mantissa == 0):
                return k
        elif i < end:
            letter = text[i] in LETTERS
            i += letter
            signed = i < end and (text[i] == PLUS or text[i] == MINUS)
            if not (letter or (bare and signed)):
                return k
            down = signed and text[i] == MINUS
            i += signed
            if i == end:
                return k
            exponent = 0
            while i < end:
                c = np.int64(text[i])
                if not ZERO <= c <= NINE:
                    return k
                exponent = min(10 * exponent + (c - ZERO), 99999)
                i += 1
            power += -exponent if down else exponent
        if mantissa == 0:
            value = 0.0
        elif significant > DIGITS or mantissa > EXACT or abs(power) >= len(POWERS):
            value = np.inf
        elif power < 0:
            value = mantissa / POWERS[-power]
        else:
            value = mantissa * POWERS[power]
        found[k] = -value if sign == MINUS else value
    return len(first)


def plain_numbers(
    text: np.ndarray, first: np.ndarray, last: np.ndarray, whole: np.ndarray, bare: bool = False
) -> np.ndarray | None:
    """Return the numbers of fields ``text[first:last]``, NaN where a field is blank; None unless all are plain.

    Parameters
    ----------
    text : (n,) uint8
    first, last : int arrays of one shape
    whole : (k,) bool
        Which of the fields are whole numbers, which have at most ten digits; the fields have it in turn, over and over.
    bare : bool
        Whether an exponent may have its sign alone, as in ``1.5-6``.

    Examples
    --------
    >>> text = np.frombuffer(b"12 1.5-6", dtype=np.uint8)
    >>> plain_numbers(text, np.array([0, 2]), np.array([2, 8]), np.array([True, False]), bare=True)
    array([1.2e+01, 1.5e-06])
    >>> plain_numbers(text, np.array([0, 2]), np.array([2, 8]), np.array([True]))
    """
    found = np.empty(first.size)
    starts, ends = first.ravel(), last.ravel()
    if _read_fields(text, starts, ends, whole, bare, found) < first.size:
        return None
    large = np.flatnonzero(np.abs(found) >= LARGE)
    for k in large[np.isinf(found[large])]:
        found[k] = real(text[starts[k] : ends[k]].tobytes().decode("ascii").strip().upper())
    return found.reshape(first.shape) if (np.abs(found[large]) < LARGE).all() else None


def real(text: str) -> float | str:
    """Return the number that a text in capitals is, with an exponent after E, D or a sign alone; else the text.

    Examples
    --------
    >>> real("7.+10"), real("1.D3"), real("THRU")
    (70000000000.0, 1000.0, 'THRU')
    """
    match = REAL.fullmatch(text)
    return float(f"{match[1]}e{match[2] or match[3] or 0}") if match else text
