"""What a factor will need, known before it is computed: memory and time; said where it is much."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache

import numpy as np

from modalprep.errors import InputError
from modalprep.linalg.memory import BUDGET

GIB = 2**30
LARGE = 1e11  # operations of a factorisation worth a word: seconds
TRIAL = 512  # rows of the matrices by whose product the speed of the machine is measured
SHARE = 0.5  # of that speed which a sparse factorisation has
WRITING = 3e8  # bytes a second: a slow solid-state disk
LOG = logging.getLogger("modalprep")
_say: ContextVar[Callable[[str], None]] = ContextVar("say", default=LOG.warning)


@dataclass(frozen=True)
class Forecast:
    """What a factor ``L D L^T`` needs, by its symbolic factorisation.

    Attributes
    ----------
    operations : float
        Floating-point operations.
    memory : float
        Bytes, on top of the matrix.
    free : float
        Bytes of memory that it may take.
    single : bool
        Whether it is in single precision.
    disk, room : float
        Bytes of disk, where it lies there, and those that it may take.

    Examples
    --------
    >>> print(Forecast(operations=2e9, memory=2**31, free=2**33))
    the factor needs 2 of the 8 GiB of memory that are free: in double precision
    >>> print(Forecast(operations=2e9, memory=2**31, free=2**33, single=True))
    the factor needs 2 of the 8 GiB of memory that are free: in single precision, with iterations
    >>> print(Forecast(operations=2e9, memory=2**31, free=2**33, disk=2**34, room=2**35))
    the factor needs 2 of the 8 GiB of memory and 16 of the 32 GiB of disk that are free: in double precision, on disk
    """

    operations: float
    memory: float
    free: float
    single: bool = False
    disk: float = 0.0
    room: float = 0.0

    @property
    def fits(self) -> bool:
        """Whether it has room."""
        return self.memory <= self.free and self.disk <= self.room

    @property
    def large(self) -> bool:
        """Whether the factorisation takes long enough for a word before."""
        return self.operations > LARGE

    @property
    def seconds(self) -> float:
        """About the time of the factorisation, by the speed of this machine at dense products, and of a slow disk."""
        return self.operations / (SHARE * speed()) + self.disk / WRITING

    def __str__(self) -> str:
        """Say what it needs, of what is free, and how it is stored."""
        disk = f" and {_gib(self.disk)} of the {_gib(self.room)} GiB of disk" if self.disk else ""
        memory = f"{_gib(self.memory)} of the {_gib(self.free)} GiB of memory"
        return f"the factor needs {memory}{disk} that are free: {self._how}"

    def shortfall(self) -> str:
        """Say what is missing."""
        if self.disk:
            needs = f"{_gib(self.memory)} GiB of memory and {_gib(self.disk)} GiB of disk"
            return f"needs {needs} and {_gib(self.free)} and {_gib(self.room)} GiB may be used (TMPDIR sets the folder)"
        return f"needs {_gib(self.memory)} GiB of memory {self._precision} and {_gib(self.free)} GiB may be used"

    @property
    def _precision(self) -> str:
        return "in single precision" if self.single else "in double precision"

    @property
    def _how(self) -> str:
        if self.disk:
            return f"{self._precision}, on disk"
        return f"{self._precision}, with iterations" if self.single else self._precision


class TooLarge(MemoryError):
    """A factor that does not fit; its first argument is the number of bytes that it needs."""

    def __init__(self, forecast: Forecast) -> None:
        super().__init__(forecast.memory)
        self.forecast = forecast

    def __str__(self) -> str:
        """Say what is missing."""
        return self.forecast.shortfall()


def no_room(n: int, missing: str, besides: str = "") -> InputError:
    """Return the refusal of a factor of an n x n matrix, with what is missing, and what may help besides.

    Examples
    --------
    >>> str(no_room(3, "needs 2 GiB of memory and 1 GiB may be used")).split(":")[0]
    'the factor of the 3 x 3 matrix needs 2 GiB of memory and 1 GiB may be used'
    """
    return InputError(
        f"the factor of the {n} x {n} matrix {missing}: take a coarser mesh or fewer modes, split the model into "
        f"components, {besides}or give it more memory ({BUDGET} sets the limit in GiB where it is set)"
    )


def tell(forecast: Forecast) -> None:
    """Say what a factor needs, and how long it will take, where it is large."""
    if forecast.large:
        _say.get()(f"{forecast}, about {_duration(forecast.seconds)}")


@contextmanager
def forecasts_to(say: Callable[[str], None]) -> Iterator[None]:
    """Tell forecasts by a function within the block, instead of by the log.

    Examples
    --------
    >>> with forecasts_to(print):
    ...     tell(Forecast(operations=0.0, memory=2**31, free=2**33))  # too small for a word
    """
    token = _say.set(say)
    try:
        yield
    finally:
        _say.reset(token)


@cache
def speed() -> float:
    """Return the floating-point operations in a second of dense products, by the library that also factorises.

    Examples
    --------
    >>> speed() > 1e6
    True
    """
    from modalprep.linalg.blas import product

    A = np.ones((TRIAL, TRIAL))
    product(A, A)
    begin = time.perf_counter()
    rounds = 4
    for _ in range(rounds):
        product(A, A)
    return rounds * 2.0 * TRIAL**3 / (time.perf_counter() - begin)


def _gib(size: float) -> str:
    return f"{size / GIB:.2g}"


def _duration(seconds: float) -> str:
    """Return a time in words."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
