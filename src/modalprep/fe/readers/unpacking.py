"""Compressed arrays of .vtu files and of meshes in HDF5: they unpack to no more than meshes do."""

from __future__ import annotations

import lzma
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

# times the size of the file, and bytes that any file may unpack to
PACKING = 100
SMALL = 2**26
TOO_MUCH = "it unpacks to far more than its size, as no mesh does"
HDF5 = b"\x89HDF\r\n\x1a\n"


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
            raise ValueError(TOO_MUCH)
        return found


def refuse_packed_datasets(path: Path, content: bytes) -> None:
    """Refuse a mesh in HDF5 (.med, .cgns, .h5m), or beside an .xdmf file, that unpacks to far more than its size.

    Raises
    ------
    ValueError
        When it does.
    """
    beside = re.findall(rb">\s*([^<>:]+\.h5):", content) if path.suffix in (".xdmf", ".xmf") else []
    files = [path.parent / name.decode() for name in sorted(set(beside))]
    for file in [*files, *([path] if content.startswith(HDF5) else [])]:
        if file.is_file() and _unpacked(file) > max(SMALL, PACKING * file.stat().st_size):
            raise ValueError(TOO_MUCH)


def _unpacked(path: Path) -> int:
    """Return the bytes of all datasets of an HDF5 file."""
    import h5py

    total = 0

    def add(_: str, item: Any) -> None:
        nonlocal total
        total += getattr(item, "nbytes", 0)

    with h5py.File(path) as file:
        file.visititems(add)
    return total


@contextmanager
def limited_unpacking(size: int) -> Iterator[None]:
    """Let meshio unpack the arrays of a .vtu file of that size (bytes) to so much only; it knows no limit itself."""
    from meshio.vtu import _vtu

    left = [max(SMALL, PACKING * size)]
    before = _vtu.zlib, _vtu.lzma
    _vtu.zlib = Limited(zlib.decompressobj, left)
    _vtu.lzma = Limited(lzma.LZMADecompressor, left)
    try:
        yield
    finally:
        _vtu.zlib, _vtu.lzma = before
