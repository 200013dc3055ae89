"""Identity of the program that writes a file: versions and a hash of its sources."""

from __future__ import annotations

import hashlib
import platform
import time
from collections.abc import Iterable
from contextlib import suppress
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import modalprep

FRESH = 5.0  # s, in which a file may change without another time of change
NUMERICAL = ("numpy", "scipy", "mkl")  # packages whose version may change results by round-off


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; empty when it is missing.

    A file that has been as it is for some seconds is read once, as long as its time, size and place remain.

    Examples
    --------
    >>> file_digest(Path("no.toml"))
    ''
    """
    if not path.is_file():
        return ""
    stat = path.stat()
    if time.time() - stat.st_mtime < FRESH:
        return _read_digest(path)
    return _kept_digest(path.absolute(), (stat.st_mtime_ns, stat.st_ctime_ns, stat.st_size, stat.st_ino))


@lru_cache(maxsize=1000)
def _kept_digest(path: Path, state: tuple[int, ...]) -> str:
    return _read_digest(path)


def _read_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def program() -> dict[str, str]:
    """Return the versions of modalprep, Python and the numerical packages, and the hash of modalprep's sources.

    Examples
    --------
    >>> {"modalprep", "numpy", "python", "sources_sha256"} <= set(program())
    True
    """
    sources = sources_digest(Path(modalprep.__file__).parent)
    found = {"modalprep": modalprep.__version__, "sources_sha256": sources, "python": platform.python_version()}
    return dict(sorted((found | versions(NUMERICAL)).items()))


def versions(names: Iterable[str]) -> dict[str, str]:
    """Return the versions of those packages that are installed.

    Examples
    --------
    >>> list(versions(["numpy", "no-package"]))
    ['numpy']
    """
    found = {}
    for name in names:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def sources_digest(root: Path) -> str:
    """Return the SHA-256 of the names and contents of all Python files below the folder of a package.

    Examples
    --------
    >>> len(sources_digest(Path(modalprep.__file__).parent / "verdicts"))
    64
    """
    total = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        total.update(f"{file.relative_to(root).as_posix()} {_read_digest(file)}\n".encode())
    return total.hexdigest()
