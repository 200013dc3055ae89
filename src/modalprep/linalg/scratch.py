"""Folders of temporary files that go with their process, also with one that was killed.

A process holds a lock on a file in its folder, which the system releases when the process ends, however it ends. The
next process that makes a folder removes those whose lock is free.
"""

from __future__ import annotations

import os
import shutil
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir, mkdtemp

LOCK = "in-use"


class ScratchFolder:
    """A new folder among the temporary files of the system; folders of the same kind that nobody uses are removed.

    Parameters
    ----------
    prefix : str
        Its name begins with it.

    Attributes
    ----------
    path : str

    Examples
    --------
    >>> folder = ScratchFolder("modalprep-example-")
    >>> Path(folder.path).is_dir()
    True
    >>> folder.remove()
    >>> Path(folder.path).exists()
    False
    """

    def __init__(self, prefix: str) -> None:
        remove_left(prefix)
        made = mkdtemp(prefix=f"new-{prefix}")
        lock = os.open(Path(made, LOCK), os.O_CREAT | os.O_RDWR)
        _lock(lock)
        self.path = str(Path(made).with_name(Path(made).name.removeprefix("new-")))
        os.rename(made, self.path)  # it has its name once it is locked
        self.remove = weakref.finalize(self, _remove, self.path, lock)


def remove_left(prefix: str) -> None:
    """Remove the folders whose process is gone; what has no lock, or belongs to another user, stays.

    Examples
    --------
    >>> remove_left("modalprep-example-")
    """
    for folder in Path(gettempdir()).glob(f"{prefix}*"):
        with _opened(folder / LOCK) as lock:
            if lock is not None and _lock(lock):
                shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _opened(path: Path) -> Iterator[int | None]:
    """Yield the descriptor of a file, None where it cannot be opened."""
    try:
        descriptor = os.open(path, os.O_RDWR)
    except OSError:
        yield None
        return
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    """Lock a file and return whether nobody else had it; never where the system has no such locks."""
    try:
        from fcntl import LOCK_EX, LOCK_NB, flock  # which Windows does not have

        flock(descriptor, LOCK_EX | LOCK_NB)
    except (ImportError, OSError):
        return False
    return True


def _remove(path: str, lock: int) -> None:
    shutil.rmtree(path, ignore_errors=True)
    os.close(lock)
