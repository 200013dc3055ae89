"""Untrusted HDF5 files: they can neither read other files nor exhaust memory."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from modalprep.atomic import atomic_path, refuse_folder
from modalprep.errors import InputError
from modalprep.linalg.memory import available_memory
from modalprep.suggest import refuse_missing

PACKED = 2000  # largest compression ratio of deflate, the only filter of these files
# A file may unpack to so many times its size, or to so many bytes if it is small. Bodies without geometric stiffness,
# whose arrays of zeros pack best, reach 65 times with 200 modes and 200 interfaces.
PACKING = 100
SMALL = 2**26
COPY = 9  # bytes for each number that is read: the number as float64, and whether it is finite
CHECKSUM = "checksum"  # attribute of the file
NOT_SUMMED = (CHECKSUM, "created")  # equal bodies have equal sums
TEXTS = 100  # in one attribute
FAULTS = (OSError, LookupError, ValueError, TypeError, AttributeError, RuntimeError, MemoryError)


@contextmanager
def reading(path: Path, kind: str, advice: str) -> Iterator[h5py.File]:
    """Open a file for reading; every error becomes one message.

    A file of kilobytes may declare arrays of terabytes, and its links may refer to any file of the machine: such files
    are refused before reading.

    Parameters
    ----------
    path : Path
    kind, advice : str
        Expected kind of file, and advice if it is another.

    Raises
    ------
    InputError
        When the file is missing, damaged, or leads or declares beyond itself.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.h5"
    >>> with h5py.File(path, "w") as file:
    ...     _ = file.create_dataset("K", shape=(10**12,), chunks=(1000,), dtype="f4")
    >>> with reading(path, "modal file", "write it again") as file:  # doctest: +ELLIPSIS
    ...     pass
    Traceback (most recent call last):
    modalprep.errors.InputError: modal file ...a.h5: K declares 4e+12 bytes, of which the file holds 0; write it again
    """
    refuse_missing(path, kind)
    try:
        with h5py.File(path, "r") as file:
            _refuse_dangers(file)
            yield file
    except InputError as error:
        raise InputError(f"{kind} {path}: {error}; {advice}") from None
    except FAULTS as error:
        raise InputError(f"{kind} {path} is damaged or not a {kind} ({error}); {advice}") from None


def file_format(path: Path) -> str:
    """Return what an HDF5 file says that it is, such as ``modalprep result``; "" where it says nothing.

    Raises
    ------
    InputError
        When it is missing, damaged or no HDF5 file.
    """
    with reading(path, "file", "give a modal file, a result file or a mesh") as file:
        return str(file.attrs.get("format", ""))


@contextmanager
def writing(path: Path) -> Iterator[h5py.File]:
    """Open a file in memory and write it at the end, completely or not at all.

    HDF5 itself cannot recover from a full disk and would leave an incomplete file.

    Raises
    ------
    OutputError
        When the folder cannot be written, or the disk is full.
    """
    refuse_folder(path)
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    with atomic_path(path) as temporary:
        temporary.write_bytes(image)


def checksum(file: h5py.File) -> str:
    """Return the SHA-256 of all that a file says, whatever its layout and compression, but for when it was made.

    Examples
    --------
    >>> with h5py.File("a.h5", "w", driver="core", backing_store=False) as file:
    ...     file["K"] = [1.0, 2.0]
    ...     before = checksum(file)
    ...     file["K"][1] = 3.0
    ...     before == checksum(file)
    False
    """
    names = ["/"]
    file.visit(names.append)
    total = hashlib.sha256()
    for name in sorted(names):
        item = file[name]
        values = {key: item.attrs[key] for key in sorted(item.attrs) if key not in NOT_SUMMED}
        values |= {"": item[()]} if isinstance(item, h5py.Dataset) else {}
        for key, value in values.items():
            total.update(f"{name} {key}\n".encode())
            total.update(_bytes(value))
    return total.hexdigest()


def stated_checksum(path: Path) -> str:
    """Return the checksum that a file states of its contents; empty where it states none.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.formats.modalfile import write_body
    >>> len(stated_checksum(write_body(uniform_beam(modes=1), Path(tempfile.mkdtemp()) / "beam.h5")))
    64
    """
    with h5py.File(path) as file:
        return str(file.attrs.get(CHECKSUM, ""))


def _bytes(value: Any) -> bytes:
    """Return what to hash of numbers, texts and tables, their kind and shape before their content."""
    if isinstance(value, str):
        return value.encode("utf-8", "surrogateescape")
    array = np.asarray(value)
    if array.dtype.names:
        return b"".join(name.encode() + _bytes(array[name]) for name in array.dtype.names)
    if array.dtype.hasobject:
        return repr([x.decode("utf-8", "replace") if isinstance(x, bytes) else x for x in array.ravel()]).encode()
    array = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return f"{array.dtype.str} {array.shape}\n".encode() + array.tobytes()


def _refuse_dangers(file: h5py.File) -> None:
    size = os.path.getsize(file.filename)
    unpacked = working = 0

    def look(name: str, item: h5py.Group | h5py.Dataset) -> None:
        nonlocal unpacked, working
        _refuse_long_attributes(item, name)
        if isinstance(item, h5py.Group):
            _refuse_links(item)
        elif isinstance(item, h5py.Dataset):
            _refuse_outside(item, name)
            _refuse_repeated_texts(item, name, size)
            unpacked += _unpacked(item)
            working += _unpacked(item) + item.size * COPY

    look("/", file)
    file.visititems(look)
    if unpacked > max(SMALL, PACKING * size):
        raise InputError(
            f"it unpacks to {unpacked:.3g} bytes, {unpacked / size:.0f} times its size, as no mesh and no modes do"
        )
    if working > available_memory():
        raise InputError(f"reading it takes {working:.3g} bytes, more than the memory that is free")


def _unpacked(data: h5py.Dataset) -> int:
    """Return the bytes that HDF5 unpacks to read a dataset; a chunk may be larger than the dataset."""
    chunk = math.prod(data.chunks) * data.dtype.itemsize if data.chunks else 0
    return max(data.nbytes, chunk)


def _refuse_links(group: h5py.Group) -> None:
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InputError(f"{name} is an external link, which is not followed")


def _refuse_outside(data: h5py.Dataset, name: str) -> None:
    if data.is_virtual or data.external:
        raise InputError(f"{name} is stored in other files, which are not read")
    held = data.id.get_storage_size()
    if _unpacked(data) > PACKED * held:
        raise InputError(f"{name} declares {_unpacked(data):.3g} bytes, of which the file holds {held}")


def _refuse_repeated_texts(data: h5py.Dataset, name: str, size: int) -> None:
    """Refuse texts that are longer together than the file: many rows may refer to one long text."""
    if not data.dtype.hasobject:
        return
    if data.ndim != 1:
        raise InputError(f"{name} is not a list of texts")
    # rows whose texts fit into memory, were each as long as the file
    total = 0
    block = max(1, SMALL // size)
    for row in range(0, len(data), block):
        total += sum(map(_length, data[row : row + block]))
        if total > size:
            raise InputError(f"the texts of {name} are longer than the file")


def _length(value: Any) -> int:
    """Return the bytes of a text, of a list of numbers or of a row with such columns."""
    if isinstance(value, np.void):
        return sum(_length(column) for column in value)
    return len(value) if isinstance(value, (str, bytes)) else getattr(value, "nbytes", 0)


def _refuse_long_attributes(item: h5py.Group | h5py.Dataset, name: str) -> None:
    for key in item.attrs:
        attribute = item.attrs.get_id(key)
        if attribute.dtype.hasobject and math.prod(attribute.shape) > TEXTS:
            raise InputError(f"attribute {key} of {name} has more than {TEXTS} texts")


def write_texts(file: h5py.File, name: str, texts: Sequence[str]) -> None:
    """Write a dataset of texts, none of them too.

    Examples
    --------
    >>> with h5py.File("notes.h5", "w", driver="core", backing_store=False) as file:
    ...     write_texts(file, "notes", ())
    ...     file["notes"].shape
    (0,)
    """
    file.create_dataset(name, data=list(texts), shape=(len(texts),), dtype=h5py.string_dtype())
