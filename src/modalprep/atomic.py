"""Atomic writing of files: write to a temporary name, rename when finished."""

from __future__ import annotations

import csv
import json
import os
import platform
import re
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

from modalprep.errors import OutputError

if TYPE_CHECKING:
    import numpy as np

ABANDONED, PAUSE = 3600.0, 60.0  # s
PART = re.compile(r"\..*\.(?:([0-9a-f]{8})-)?(\d+)\.part(?:\.[^.]*)?")  # place and number of the process
_swept: dict[str, float] = {}  # when, by folder
FORMULA = re.compile(r"'*[=+\-@\t\r]")  # begins a cell that spreadsheets compute, or one with apostrophes before it


@contextmanager
def atomic_path(path: str | Path, beside: Path | None = None) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it to `path` on success, remove it on failure.

    The temporary name keeps the suffix, and the folder is made when it is missing. For a folder of very many files the
    temporary path may be `beside` another one of the same disk: what killed runs have left is looked for there.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> with atomic_path(folder / "a.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> [p.name for p in folder.iterdir()]
    ['a.txt']
    """
    path = Path(path)
    refuse_folder(path)
    temporary = _temporary(beside or path)
    try:
        temporary.parent.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(temporary.parent)
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise not_written(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _temporary(path: Path) -> Path:
    return path.with_name(f".{path.stem}.{_here()}-{os.getpid()}.part{path.suffix}")


def _remove_abandoned(folder: Path) -> None:
    """Remove the temporary files that killed runs have left in a folder, at most once a minute."""
    now = time.monotonic()
    if now - _swept.get(str(folder), -PAUSE) < PAUSE:
        return
    _swept[str(folder)] = now
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            found = PART.fullmatch(entry.name)
            with suppress(OSError):
                if found and _is_abandoned(found[1], found[2], entry.stat().st_mtime):
                    os.unlink(entry.path)


def _is_abandoned(place: str | None, process: str, written: float) -> bool:
    """Whether the process of a temporary file has ended; one of another machine, when it has not written for long."""
    if place != _here() or os.name != "posix":
        return time.time() - written > ABANDONED
    try:
        os.kill(int(process), 0)  # asks only
    except ProcessLookupError:
        return True
    except (PermissionError, OverflowError):
        pass
    return False


@cache
def _here() -> str:
    """Name where the number of a process means something: this machine since its start, and its container."""
    parts = [platform.node()]
    with suppress(OSError):
        parts += [Path("/proc/sys/kernel/random/boot_id").read_text(), os.readlink("/proc/self/ns/pid")]
    return f"{crc32('|'.join(parts).encode()):08x}"


def refuse_folder(path: Path) -> None:
    """Refuse to write a file where a folder is.

    Raises
    ------
    OutputError
        Which names it.

    Examples
    --------
    >>> refuse_folder(Path("."))
    Traceback (most recent call last):
    modalprep.errors.OutputError: cannot write .: Is a directory; name a file in it
    """
    if path.is_dir():
        raise OutputError(f"cannot write {path}: Is a directory; name a file in it")


def refuse_unwritable(path: Path) -> None:
    """Refuse a file that could not be written, before the work for it; nothing is left behind.

    Raises
    ------
    OutputError
        Which names it and says why.

    Examples
    --------
    >>> refuse_unwritable(Path("pyproject.toml") / "body.h5")
    Traceback (most recent call last):
    modalprep.errors.OutputError: cannot write pyproject.toml/body.h5: Not a directory; choose another --output folder
    """
    refuse_folder(path)
    there = next((folder for folder in path.absolute().parents if os.path.lexists(folder)), Path())
    try:
        if path.exists() and not path.is_file():
            raise OSError("it is not a file")
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise not_written(path, error) from None


def not_written(path: Path, error: OSError) -> OutputError:
    """Return the error of a file that cannot be written.

    Examples
    --------
    >>> not_written(Path("a.h5"), OSError(28, "No space left on device"))
    OutputError('cannot write a.h5: No space left on device; choose another --output folder')
    """
    return OutputError(f"cannot write {path}: {error.strerror or error}; choose another --output folder")


def remove_temporary(folder: Path, process: int) -> None:
    """Remove incomplete files of a terminated process of this machine in a folder and its subfolders.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> temporary = _temporary(folder / "a.txt")
    >>> _ = temporary.write_text("ha")
    >>> remove_temporary(folder, os.getpid())
    >>> list(folder.iterdir())
    []
    """
    for pattern in ("", "*/"):
        for path in folder.glob(f"{pattern}.*.{_here()}-{process}.part*"):
            with suppress(OSError):
                path.unlink()


def write_text(text: str, path: str | Path, errors: str = "strict") -> Path:
    """Write a text in UTF-8; the file is written completely or not at all. `errors` is as of `str.encode`.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> write_text("<html></html>", Path(tempfile.mkdtemp()) / "a.html").read_text()
    '<html></html>'
    """
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors=errors)
    return Path(path)


def write_json(data: dict[str, Any], path: Path) -> Path:
    """Write one JSON object; the file is written completely or not at all.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> write_json({"modes": 2}, Path(tempfile.mkdtemp()) / "a.json").read_text().split()
    ['{', '"modes":', '2', '}']
    """
    return write_text(json.dumps(data, indent=1) + "\n", path)


def csv_text(text: str) -> str:
    """Return a text as the cell of a CSV file: with an apostrophe before what a spreadsheet would take as a formula.

    Examples
    --------
    >>> csv_text("=1+1"), csv_text("arm.angle"), csv_text("-1.5")
    ("'=1+1", 'arm.angle', '-1.5')
    """
    with suppress(ValueError):
        float(text)
        return text
    return f"'{text}" if FORMULA.match(text) else text


def text_of_csv(cell: str) -> str:
    """Return the text that `csv_text` has written.

    Examples
    --------
    >>> [text_of_csv(csv_text(text)) for text in ("=1+1", "'=", "'a", "a")]
    ['=1+1', "'=", "'a", 'a']
    """
    return cell[1:] if cell.startswith("'") and FORMULA.match(cell[1:]) else cell


def write_table(header: Iterable[str], rows: Iterable[Sequence[float | str]], path: str | Path) -> Path:
    """Write numbers to ten digits, and texts, as a CSV file; the file is written completely or not at all.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> write_table(["t", "x"], [(0.5, 1 / 3)], Path(tempfile.mkdtemp()) / "a.csv").read_text().split()
    ['t,x', '0.5,0.3333333333']
    """
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(map(csv_text, header))
        writer.writerows([csv_text(x) if isinstance(x, str) else f"{x:.10g}" for x in row] for row in rows)
    return Path(path)


def write_columns(columns: Mapping[str, np.ndarray], path: str | Path) -> Path:
    """Write columns of numbers under their names, to ten digits, in half the time of `write_table`.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> columns = {"t": np.array([0.5]), "x": np.array([1 / 3])}
    >>> write_columns(columns, Path(tempfile.mkdtemp()) / "a.csv").read_text().split()
    ['t,x', '0.5,0.3333333333']
    """
    line = ",".join(["%.10g"] * len(columns)) + "\r\n"
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerow(map(csv_text, columns))
        file.writelines(line % row for row in rows)
    return Path(path)
