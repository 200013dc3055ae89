"""A content-addressed store of arrays: bounded in size, verified by checksums, without executable content."""

from __future__ import annotations

import hashlib
import json
import os
import stat
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from io import BufferedIOBase
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.errors import OutputError
from modalprep.program import program

MAGIC = b"modalprep cache 1\n"
LIMIT = 5.0  # GiB
KEPT = 0.95  # share of the limit to which the folder is reduced, when the least recently used entries are removed
MOST_RECORDS = 100_000  # of sizes, after which the folder is listed anyway
RECORD = "<i8"  # bytes
SECONDS = "seconds"  # name of the computing time that is stored with the entry


@dataclass
class Use:
    """Hits and misses of a cache, and the computing time saved."""

    found: int = 0
    computed: int = 0
    saved_seconds: float = 0.0

    def summary(self) -> dict[str, float]:
        """Return the counts by name."""
        return asdict(self)


@dataclass(frozen=True)
class Cache:
    """Arrays in the files of a folder, named by the hash of their inputs and of the program.

    Several processes may use one folder. An entry with a wrong checksum is removed and counts as missing; the
    least recently used entries are removed before the folder would exceed `limit`. The file ``sizes`` has the size of
    the folder when it was last listed, and that of each entry written since, so that a write need not list the folder.
    The folder may exceed the limit by the entries that several processes are writing, one each, and, until the next
    listing, by those that are finished while ``sizes`` is replaced.

    Attributes
    ----------
    folder : Path
    limit : float
        Bytes.
    use : Use

    Examples
    --------
    >>> import tempfile
    >>> cache = Cache(Path(tempfile.mkdtemp()))
    >>> key = cache.key("square", np.arange(3.0))
    >>> for _ in range(2):
    ...     entry = cache.recall(key, lambda: {"y": np.arange(3.0) ** 2})
    >>> entry["y"], cache.use.found, cache.use.computed
    (array([0., 1., 4.]), 1, 1)
    """

    folder: Path
    limit: float = LIMIT * 2**30
    use: Use = field(default_factory=Use)

    def key(self, *parts: Any) -> str:
        """Return the hash of arrays, sparse matrices and JSON values, and of the program."""
        total = hashlib.sha256()
        for part in (program(), *parts):
            for piece in _pieces(part):
                total.update(piece)
        return total.hexdigest()

    def recall(
        self,
        key: str,
        compute: Callable[[], Mapping[str, np.ndarray]],
        sufficient: Callable[[Mapping[str, np.ndarray]], bool] = lambda entry: True,
    ) -> Mapping[str, np.ndarray]:
        """Return the arrays of an entry if they are `sufficient`, else compute and store them."""
        entry = self.read(key)
        if entry is not None and sufficient(entry):
            self.count_use(entry)
            return entry
        start = time.perf_counter()
        arrays = compute()
        self.use.computed += 1
        self.write(key, arrays, time.perf_counter() - start)
        return arrays

    def count_use(self, entry: Mapping[str, np.ndarray]) -> None:
        """Count a used entry, and its computing time as saved."""
        self.use.found += 1
        self.use.saved_seconds += float(entry[SECONDS])

    def read(self, key: str) -> dict[str, np.ndarray] | None:
        """Return the arrays of an entry; None where it is missing or damaged, which removes it."""
        path = self._path(key)
        try:
            with path.open("rb") as file:
                intact = file.read(len(MAGIC)) == MAGIC and file.read(64) == _checksum(key, file)
                file.seek(len(MAGIC) + 64)
                entry = dict(np.load(file, allow_pickle=False)) if intact else None
        except FileNotFoundError:
            return None
        except (OSError, ValueError):
            entry = None
        with suppress(OSError):  # another process may have removed it
            path.unlink() if entry is None else os.utime(path)
        return entry

    def write(self, key: str, arrays: Mapping[str, np.ndarray], seconds: float) -> None:
        """Store arrays with their computing time; on a full disk nothing is stored."""
        size = sum(array.nbytes for array in arrays.values())
        if size > self.limit:
            return
        entries: dict[str, Any] = {**arrays, SECONDS: np.float64(seconds)}
        path = self._path(key)
        with suppress(OutputError), atomic_path(path, beside=self._new / path.name) as temporary:
            with temporary.open("w+b") as file:
                file.write(MAGIC + b" " * 64)
                np.savez(file, **entries)
                file.seek(len(MAGIC) + 64)
                checksum = _checksum(key, file)
                file.seek(len(MAGIC))
                file.write(checksum)
            self._make_room(temporary)

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.stage"

    @property
    def _new(self) -> Path:
        return self.folder / "new"

    @property
    def _sizes(self) -> Path:
        return self.folder / "sizes"

    def _make_room(self, entry: Path) -> None:
        """Record the size of an entry that is about to be stored; list the folder where it may exceed the limit.

        Of two processes that record at the same time, the second reads both sizes.
        """
        if len(self._recorded()):
            with self._sizes.open("ab") as file:
                file.write(np.array(entry.stat().st_size, dtype=RECORD).tobytes())
        recorded = self._recorded()
        if not 0 < len(recorded) < MOST_RECORDS or recorded.sum() > self.limit:
            self._prune(entry)

    def _recorded(self) -> np.ndarray:
        """Return the size of the folder when it was last listed, and of each entry since; empty if damaged."""
        raw = self._sizes.read_bytes() if self._sizes.is_file() else b""
        intact = len(raw) % 8 == 0 and int.from_bytes(raw[:8], "little") > 0
        return np.frombuffer(raw if intact else b"", dtype=RECORD)

    def _prune(self, entry: Path) -> None:
        """List the folder; remove the least recently used files, those of interrupted writers included, but `entry`."""
        before = self._recorded()
        files = [*_files(self._new), *_files(self.folder)]
        total = sum(size for _, size, _ in files)
        goal = KEPT * self.limit if total > self.limit else total
        for _, size, path in sorted(files):
            if total <= goal:
                break
            if path in (str(entry), str(self._sizes)):
                continue
            with suppress(OSError):
                os.unlink(path)
            total -= size
        now = self._recorded()  # another process may have added to it, or replaced it
        since = now[len(before) :] if np.array_equal(now[: len(before)], before) else now[1:]
        with atomic_path(self._sizes, beside=self._new / self._sizes.name) as temporary:
            np.array([total + since.sum()], dtype=RECORD).tofile(temporary)


def _files(folder: Path) -> Iterator[tuple[float, int, str]]:
    """Yield when each file of a folder was used, its size and its path."""
    with suppress(OSError), os.scandir(folder) as entries:  # a folder that cannot be listed has no files
        for entry in entries:
            with suppress(OSError):
                status = entry.stat()
                if stat.S_ISREG(status.st_mode):
                    yield status.st_mtime, status.st_size, entry.path


def _checksum(key: str, file: BufferedIOBase) -> bytes:
    """Return the hash (64 characters) of the rest of an open file and its key, which detects renamed entries too."""
    return hashlib.file_digest(file, lambda: hashlib.sha256(key.encode())).hexdigest().encode()


def _pieces(part: Any) -> list[Any]:
    """Return what to hash of a part: its kind and shape before its bytes, so that different parts never hash alike."""
    if not isinstance(part, np.ndarray) and hasattr(part, "tocsr"):
        matrix = part.tocsr()
        matrix = matrix if matrix.has_sorted_indices else matrix.sorted_indices()
        return [
            f"csr {matrix.shape}\n".encode(),
            *(p for name in ("data", "indices", "indptr") for p in _pieces(getattr(matrix, name))),
        ]
    if isinstance(part, np.ndarray):
        order = "F" if part.flags.f_contiguous else "C"
        head = f"array {part.dtype.str} {part.shape} {order}\n"
        entries = np.ascontiguousarray(part.T if order == "F" else part).reshape(-1)
        return [head.encode(), entries.view(np.uint8)]
    if isinstance(part, np.generic):
        part = part.item()
    return [json.dumps(part, sort_keys=True).encode() + b"\n"]
