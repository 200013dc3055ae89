"""The cases of an ensemble: values of named parameters, given or drawn from distributions."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri

from modalprep.errors import InputError
from modalprep.suggest import refuse_unknown, suggestion

SAMPLINGS = ("random", "latin_hypercube", "sobol")
MOST_CASES = 10**6
INSIDE = 2.0**-54  # least distance of a probability from 0 and 1, where a normal variable is infinite


class Distribution(NamedTuple):
    """Names of the parameters of a distribution, what refuses them, and its inverse distribution function."""

    parameters: tuple[str, ...]
    refused: Callable[..., bool]
    inverse: Callable[..., np.ndarray]


def _triangular(p: np.ndarray, lower: float, mode: float, upper: float) -> np.ndarray:
    whole, left = upper - lower, mode - lower
    rising = np.sqrt(p * whole * left)
    falling = np.sqrt((1 - p) * whole * (upper - mode))
    return np.where(p * whole < left, lower + rising, upper - falling)


DISTRIBUTIONS = {
    "normal": Distribution(("mean", "deviation"), lambda m, s: not s >= 0, lambda p, m, s: m + s * ndtri(p)),
    "uniform": Distribution(("lower", "upper"), lambda a, b: not a <= b, lambda p, a, b: a + p * (b - a)),
    "lognormal": Distribution(
        ("median", "deviation of the logarithm"),
        lambda m, s: not (m > 0 and s >= 0),
        lambda p, m, s: m * np.exp(s * ndtri(p)),
    ),
    "triangular": Distribution(("lower", "mode", "upper"), lambda a, c, b: not (a <= c <= b and a < b), _triangular),
}


def draw_cases(
    distributions: Mapping[str, Any], count: int, *, seed: int | np.random.Generator = 0, sampling: str = "random"
) -> dict[str, np.ndarray]:
    """Draw cases for `simulate_many` from independent distributions of parameters.

    Parameters
    ----------
    distributions : {parameter: distribution}
        A distribution is ``{"normal": [mean, deviation]}``, ``{"uniform": [lower, upper]}``,
        ``{"lognormal": [median, deviation of the logarithm]}``, ``{"triangular": [lower, mode, upper]}``, or an object
        with the inverse distribution function ``ppf``, such as a frozen one of ``scipy.stats``. The numbers have the
        unit of the parameter.
    count : int
        Number of cases.
    seed : int or numpy.random.Generator
        Equal seeds draw equal cases.
    sampling : {"random", "latin_hypercube", "sobol"}
        Independent cases; one case in each of `count` equally probable intervals of every parameter; a scrambled Sobol
        sequence, best with a power of two cases. More cases of one seed begin with the fewer, but for
        ``latin_hypercube``.

    Returns
    -------
    dict of (count,) float
        Values by parameter.

    Raises
    ------
    InputError
        When a distribution is unknown or cannot have such parameters, or the count is not positive.

    References
    ----------
    M. D. McKay, R. J. Beckman, W. J. Conover, A comparison of three methods for selecting values of input variables
    in the analysis of output from a computer code, Technometrics 21 (1979) 239 (Latin hypercube).
    A. B. Owen, Scrambling Sobol' and Niederreiter-Xing points, J. Complexity 14 (1998) 466.

    Examples
    --------
    >>> drawn = draw_cases({"hinge.angle": {"uniform": [0.0, 1.0]}}, 4, sampling="latin_hypercube")
    >>> np.sort(drawn["hinge.angle"] * 4).astype(int).tolist()
    [0, 1, 2, 3]
    """
    if not isinstance(distributions, Mapping) or not distributions:
        raise InputError(
            'draw_cases: give a distribution for each parameter, such as {"hinge.angle": {"normal": [0, 1]}}'
        )
    refuse_count(count)
    refuse_unknown(sampling, SAMPLINGS, "draw_cases: sampling")
    inverses = [_inverse(name, given) for name, given in distributions.items()]
    p = np.clip(_probabilities(sampling, count, len(inverses), seed), INSIDE, 1 - INSIDE / 2)
    drawn = (np.asarray(inverse(column), dtype=float) for inverse, column in zip(inverses, p.T, strict=True))
    return dict(zip(distributions, drawn, strict=True))


def refuse_count(count: Any) -> None:
    """Refuse a number of cases that is not positive, or too large.

    Examples
    --------
    >>> refuse_count(0)
    Traceback (most recent call last):
    modalprep.errors.InputError: the number of cases is 0; give a whole number from 1 to 1000000
    """
    if not isinstance(count, int | np.integer) or not 1 <= count <= MOST_CASES:
        raise InputError(f"the number of cases is {count}; give a whole number from 1 to {MOST_CASES}")


def _probabilities(sampling: str, count: int, width: int, seed: int | np.random.Generator) -> np.ndarray:
    """Return points (count, width) of the unit cube."""
    if sampling == "random":
        return np.random.default_rng(seed).random((count, width))
    from scipy.stats import qmc  # takes as long to import as all of this package

    engine = qmc.LatinHypercube if sampling == "latin_hypercube" else qmc.Sobol
    with warnings.catch_warnings():  # of a count that is no power of two, which the docstring tells
        warnings.simplefilter("ignore", UserWarning)
        return engine(width, seed=np.random.default_rng(seed)).random(count)


def _inverse(name: str, given: Any) -> Callable[[np.ndarray], np.ndarray]:
    """Return the inverse distribution function of a parameter."""
    if callable(getattr(given, "ppf", None)):
        return given.ppf
    if not isinstance(given, Mapping) or len(given) != 1:
        raise InputError(f'distribution of {name!r}: {given!r} is none; give for example {{"normal": [0.0, 0.1]}}')
    (kind, numbers), *_ = given.items()
    if kind not in DISTRIBUTIONS:
        raise InputError(f"distribution of {name!r}: unknown {kind!r}; {suggestion(kind, DISTRIBUTIONS, 'known are')}")
    wanted, refused, inverse = DISTRIBUTIONS[kind]
    try:
        numbers = np.array(numbers, dtype=float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (len(wanted),) or not np.all(np.isfinite(numbers)):
        raise InputError(f"distribution of {name!r}: {kind} needs {len(wanted)} numbers: {', '.join(wanted)}")
    if refused(*numbers):
        raise InputError(f"distribution of {name!r}: {kind} cannot have {', '.join(wanted)} = {numbers.tolist()}")
    return lambda p: inverse(p, *numbers)


def read_cases(cases: Mapping[str, Any] | Sequence[Mapping[str, float]]) -> dict[str, np.ndarray]:
    """Return the values (n,) of each parameter of explicit cases.

    Parameters
    ----------
    cases : {parameter: (n,) or (n, k)} or sequence of {parameter: number}
        The k columns of an array are the components of a parameter with several numbers.

    Raises
    ------
    InputError
        When there is no case, or not a finite number for every parameter in each case.

    Examples
    --------
    >>> read_cases([{"hinge.angle": 0.1}, {"hinge.angle": 0.2}])
    {'hinge.angle': array([0.1, 0.2])}
    >>> sorted(read_cases({"root.velocity": np.zeros((2, 3))}))
    ['root.velocity.x', 'root.velocity.y', 'root.velocity.z']
    """
    given = cases if isinstance(cases, Mapping) else _columns(cases)
    found: dict[str, np.ndarray] = {}
    for name, values in given.items():
        found |= _components(str(name), values)
    lengths = {name: len(values) for name, values in found.items()}
    if not found or not max(lengths.values()):
        raise InputError('there are no cases; give values of parameters, such as {"hinge.angle": [0.1, 0.2]}')
    first = next(iter(lengths))
    for name, length in lengths.items():
        if length != lengths[first]:
            raise InputError(
                f"cases: {first!r} has {lengths[first]} values and {name!r} {length}; give as many of each"
            )
    refuse_count(lengths[first])
    return found


def _columns(cases: Any) -> dict[str, list[float]]:
    if not isinstance(cases, Sequence) or not all(isinstance(case, Mapping) for case in cases):
        raise InputError(
            "cases must be a mapping of parameters to values, or a list of such mappings, one for each case"
        )
    for number, case in enumerate(cases):
        if case.keys() != cases[0].keys():
            other = min(case.keys() ^ cases[0].keys())
            raise InputError(f"cases: {other!r} is not in all cases, see case {number}; give it in all or in none")
    return {name: [case[name] for case in cases] for name in (cases[0] if cases else ())}


def _components(name: str, values: Any) -> dict[str, np.ndarray]:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"cases: the values of {name!r} are not numbers, one for each case") from None
    if array.ndim not in (1, 2):
        raise InputError(f"cases: {name!r} needs a list of values, one for each case")
    if not np.all(np.isfinite(array)):
        raise InputError(f"cases: {name!r} is not a finite number in case {np.argwhere(~np.isfinite(array))[0][0]}")
    if array.ndim == 1:
        return {name: array}
    parts = "xyz" if array.shape[1] == 3 else [str(k + 1) for k in range(array.shape[1])]
    return {f"{name}.{part}": column for part, column in zip(parts, array.T, strict=True)}
