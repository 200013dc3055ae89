"""Compressed arrays of .vtu files: they unpack to no more than meshes do."""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

PACKING, SMALL = 100, 2**26  # times the size of the file, and bytes that any file may unpack to


class Limited:
    """A module like `zlib` whose `decompress` stops at the bytes that are left.

    Examples
    --------
    >>> Limited(zlib.decompressobj, [1000]).decompress(zlib.compress(bytes(500))) == bytes(500)
    True
    >>> Limited(zlib.decompressobj, [1000]).decompress(zlib.compress(bytes(2000)))
    Traceback (most recent call last):
    ValueError: it unpacks to far more than its size, as no mesh does
    """

    def __init__(self, begin: Callable[[], Any], left: list[int]) -> None:
        self._begin, self._left = begin, left

    def decompress(self, data: bytes) -> bytes:
        """Return what the data unpack to."""
        found = self._begin().decompress(data, self._left[0] + 1)
        self._left[0] -= len(found)
        if self._left[0] < 0:
            raise ValueError("it unpacks to far more than its size, as no mesh does")
        return found


@contextmanager
def limited_unpacking(size: int) -> Iterator[None]:
    """Let meshio unpack the arrays of a .vtu file of that size (bytes) to so much only; it knows no limit itself."""
    from meshio.vtu import _vtu

    left = [max(SMALL, PACKING * size)]
    before = _vtu.zlib, _vtu.lzma
    _vtu.zlib, _vtu.lzma = Limited(zlib.decompressobj, left), Limited(lzma.LZMADecompressor, left)
    try:
        yield
    finally:
        _vtu.zlib, _vtu.lzma = before
