"""Untrusted HDF5 files: they can neither read other files nor exhaust memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from modalprep.atomic import atomic_path
from modalprep.errors import InputError
from modalprep.linalg.memory import available_memory

PACKED = 2000  # largest compression ratio of deflate, the only filter of these files
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
    if not path.is_file():
        raise InputError(f"{kind} {path} does not exist")
    try:
        with h5py.File(path, "r") as file:
            _refuse_dangers(file)
            yield file
    except InputError as error:
        raise InputError(f"{kind} {path}: {error}; {advice}") from None
    except FAULTS as error:
        raise InputError(f"{kind} {path} is damaged or not a {kind} ({error}); {advice}") from None


@contextmanager
def writing(path: Path) -> Iterator[h5py.File]:
    """Open a file in memory and write it at the end, completely or not at all.

    HDF5 itself cannot recover from a full disk and would leave an incomplete file.

    Raises
    ------
    OutputError
        When the folder cannot be written, or the disk is full.
    """
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    with atomic_path(path) as temporary:
        temporary.write_bytes(image)


def _refuse_dangers(file: h5py.File) -> None:
    total = 0

    def look(name: str, item: h5py.Group | h5py.Dataset) -> None:
        nonlocal total
        if isinstance(item, h5py.Group):
            _refuse_links(item)
        elif isinstance(item, h5py.Dataset):
            _refuse_outside(item, name)
            total += item.nbytes

    look("/", file)
    file.visititems(look)
    if total > available_memory():
        raise InputError(f"it holds {total:.3g} bytes, more than the memory that is free")


def _refuse_links(group: h5py.Group) -> None:
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InputError(f"{name} is an external link, which is not followed")


def _refuse_outside(data: h5py.Dataset, name: str) -> None:
    if data.is_virtual or data.external:
        raise InputError(f"{name} is stored in other files, which are not read")
    held = data.id.get_storage_size()
    if data.nbytes > PACKED * held:
        raise InputError(f"{name} declares {data.nbytes:.3g} bytes, of which the file holds {held}")
