"""How much memory a factorisation may take."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from ctypes import CDLL
from functools import cache
from pathlib import Path

from modalprep.errors import InputError

BUDGET = "MODALPREP_MEMORY"  # GiB; the limit that a user sets
SHARE = 0.9  # of what is free
_reserved: ContextVar[float] = ContextVar("reserved", default=0.0)
GROUPS = Path("/sys/fs/cgroup")
NAMES = {
    "": ("memory.max", "memory.current"),
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes"),
}  # files of limits and use, by the controllers of a line: version 2 names none


def available_memory() -> float:
    """Return the bytes that may be taken: of `MODALPREP_MEMORY` (GiB) and 90 % of the free memory the lesser.

    Free is what the machine has left, and each control group of the process, such as the container in which it runs.

    Raises
    ------
    InputError
        When the variable is not a positive number.

    Examples
    --------
    >>> available_memory() > 1e6
    True
    """
    import psutil  # here: who reads files of matrices alone goes without

    free = min([psutil.virtual_memory().available, *_left_to_groups()])
    return max(0.0, min(_budget(), SHARE * free) - _reserved.get())


@contextmanager
def reserved(size: float) -> Iterator[None]:
    """Keep so many bytes of `available_memory` for other use within the block.

    Examples
    --------
    >>> with reserved(1e18):
    ...     available_memory()
    0.0
    """
    token = _reserved.set(_reserved.get() + size)
    try:
        yield
    finally:
        _reserved.reset(token)


def give_back() -> None:
    """Give memory that was freed back to the system, which the C library keeps for small arrays to come (Linux).

    Examples
    --------
    >>> give_back()
    """
    if (c := _c_library()) is not None:
        c.malloc_trim(0)


@cache
def _c_library() -> CDLL | None:
    """Return the GNU C library; None where there is another."""
    with suppress(OSError, AttributeError):
        found = CDLL("libc.so.6")
        return found if found.malloc_trim else None
    return None


def _budget() -> float:
    text = os.environ.get(BUDGET, "inf")
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise InputError(f"{BUDGET} = {text!r} must be a positive number, the memory to use in GiB")
    return value * 2**30


def _left_to_groups() -> Iterator[float]:
    """Yield the bytes that the control groups of this process have left (Linux, versions 1 and 2)."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, path = line.split(":", 2)
            if controllers in ("", "memory"):
                root = GROUPS / controllers
                yield from _left(root, root / path.lstrip("/"), *NAMES[controllers])


def _left(root: Path, group: Path, limit: str, used: str) -> Iterator[float]:
    """Yield what a group and those that contain it have left; files that it has read count as free."""
    for folder in (group, *group.parents):
        with suppress(OSError, ValueError):
            left = int((folder / limit).read_text()) - int((folder / used).read_text())
            yield max(0.0, left + _file_pages(folder))
        if folder == root:
            return


def _file_pages(folder: Path) -> int:
    """Return the bytes of a group that hold files and may be given back at once."""
    lines = (line.split() for line in (folder / "memory.stat").read_text().splitlines())
    found = {name: int(value) for name, value in lines}
    return found.get("total_inactive_file", found.get("inactive_file", 0))
