"""The memory of packed records as one image: bytes, and the places in it that hold addresses."""

from __future__ import annotations

from collections.abc import Iterator
from ctypes import c_uint8
from typing import Any

import numpy as np

from modalprep.compiler.by_address import WORD, Addressed

ALIGNMENT = 64  # bytes


class Image:
    """Records and all that they hold, copied as they are; addresses are relative to the begin of the image.

    The layout depends on the order of the records and on what they hold, not on where they lie: images of two systems
    that differ in numbers alone have the same places.

    Attributes
    ----------
    bytes : (n,) uint8
    relocations : list of int
        Indices of the words to which the address of the image is to be added.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from modalprep.compiler.by_address import by_address
    >>> @by_address
    ... class Line(NamedTuple):
    ...     points: np.ndarray
    >>> line = Line(np.array([1.0, 2.0]))
    >>> image = Image(line)
    >>> image.relocations, image.of(line.points), image.words[image.of(line.points) // 8 :][:2].view(float)
    ([0], 64, array([1., 2.]))
    """

    def __init__(self, *records: object) -> None:
        self._records = list(dict.fromkeys(each for record in records for each in _with_inner(record)))
        self._first, self._last, self._place = _laid_out([*self._ranges()])
        size = int((self._place + self._last - self._first).max(initial=0))
        self.bytes = np.zeros(-(-size // ALIGNMENT) * ALIGNMENT, dtype=np.uint8)
        for low, high, place in zip(self._first, self._last, self._place, strict=True):
            self.bytes[place : place + high - low] = _memory(int(low), int(high - low))
        self.relocations = [*self._relocate()]

    @property
    def words(self) -> np.ndarray:
        """The image as (n / 8,) integers."""
        return self.bytes.view(np.int64)

    def of(self, what: object) -> int:
        """Return the offset of a record or an array in the image, in bytes."""
        return self._where(_begin(what) if isinstance(what, np.ndarray) else _address(what))

    def _where(self, address: int) -> int:
        k = int(np.searchsorted(self._order, address, "right")) - 1
        group = self._by_address[k]
        return int(self._place[group] + address - self._first[group])

    @property
    def _by_address(self) -> np.ndarray:
        return np.argsort(self._first)

    @property
    def _order(self) -> np.ndarray:
        return self._first[self._by_address]

    def _ranges(self) -> Iterator[tuple[int, int]]:
        for record in self._records:
            yield _address(record), _address(record) + record._words.nbytes
            for value in record:
                if isinstance(value, np.ndarray) and value.nbytes:
                    yield np.lib.array_utils.byte_bounds(value)

    def _relocate(self) -> Iterator[int]:
        """Put relative addresses into the blocks of the records, and zero for those of empty arrays."""
        for record in self._records:
            place = self._where(_address(record))
            first = record._type.first
            for name, value in zip(record._fields, record, strict=True):
                word = place // WORD + first[name]
                if isinstance(value, Addressed):
                    self.words[word] = self._where(_address(value))
                elif isinstance(value, np.ndarray):
                    self.words[word] = self._where(_begin(value)) if value.nbytes else 0
                if isinstance(value, Addressed) or (isinstance(value, np.ndarray) and value.nbytes):
                    yield WORD * word


def _with_inner(record: object) -> Iterator[Addressed]:
    """Yield a record and those inside, in the order of their fields."""
    if isinstance(record, Addressed):
        yield record
        for value in record:
            yield from _with_inner(value)


def _laid_out(ranges: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return begin, end and offset in the image of stretches of memory that do not overlap, in the order given."""
    groups: list[list[int]] = []  # begin, end, number of the first range
    for low, high, number in sorted((low, high, k) for k, (low, high) in enumerate(ranges)):
        if groups and low < groups[-1][1]:
            groups[-1][1:] = max(groups[-1][1], high), min(groups[-1][2], number)
        else:
            groups.append([low, high, number])
    groups.sort(key=lambda group: group[2])
    low, high = np.array([group[:2] for group in groups], dtype=np.int64).T
    size = -(-(high - low) // ALIGNMENT) * ALIGNMENT
    return low, high, np.cumsum(size) - size


def _address(record: object) -> int:
    return record.__index__()  # type: ignore[attr-defined]


def _begin(array: np.ndarray) -> int:
    return int(array.ctypes.data)


def _memory(address: int, size: int) -> np.ndarray:
    memory: Any = (c_uint8 * size).from_address(address)
    return np.frombuffer(memory, np.uint8)
