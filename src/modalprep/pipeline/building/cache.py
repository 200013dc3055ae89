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
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.errors import OutputError
from modalprep.program import program

MAGIC = b"modalprep cache 1\n"
LIMIT = 5.0  # GiB
KEPT = 0.95  # of the limit, when the oldest entries go
MOST = 100_000  # records of sizes, until the folder is listed anyway
RECORD = "<i8"  # bytes
SECONDS = "seconds"  # computing time, stored with the entry


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
    the folder when it was last listed, and that of each entry since, so that no other write lists it. The limit may be
    passed by what several processes are writing, one entry each, and until the next listing by the entries that others
    finish in the moment in which this file is replaced.

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
    ...     found = cache.recall(key, lambda: {"y": np.arange(3.0) ** 2})
    >>> found["y"], cache.use.found, cache.use.computed
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
        enough: Callable[[Mapping[str, np.ndarray]], bool] = lambda found: True,
    ) -> Mapping[str, np.ndarray]:
        """Return the arrays of an entry if `enough` accepts it, else compute and store them."""
        found = self.read(key)
        if found is not None and enough(found):
            self.took(found)
            return found
        start = time.perf_counter()
        arrays = compute()
        self.use.computed += 1
        self.write(key, arrays, time.perf_counter() - start)
        return arrays

    def took(self, found: Mapping[str, np.ndarray]) -> None:
        """Count a used entry."""
        self.use.found += 1
        self.use.saved_seconds += float(found[SECONDS])

    def read(self, key: str) -> dict[str, np.ndarray] | None:
        """Return the arrays of an entry; None where it is missing or damaged, which removes it."""
        path = self._path(key)
        try:
            with path.open("rb") as file:
                whole = file.read(len(MAGIC)) == MAGIC and file.read(64) == _checksum(key, file)
                file.seek(len(MAGIC) + 64)
                found = dict(np.load(file, allow_pickle=False)) if whole else None
        except FileNotFoundError:
            return None
        except (OSError, ValueError):
            found = None
        with suppress(OSError):  # another process may have removed it
            path.unlink() if found is None else os.utime(path)
        return found

    def write(self, key: str, arrays: Mapping[str, np.ndarray], seconds: float) -> None:
        """Store arrays with their computing time; on a full disk nothing is stored."""
        size = sum(array.nbytes for array in arrays.values())
        if size > self.limit:
            return
        path = self._path(key)
        with suppress(OutputError), atomic_path(path, beside=self._new / path.name) as temporary:
            with temporary.open("w+b") as file:
                file.write(MAGIC + b" " * 64)
                np.savez(file, **arrays, **{SECONDS: np.float64(seconds)})
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
        """Record the size of an entry that is not yet in its place; list the folder where that may be too much.

        Of two processes that record at once, the second sees both.
        """
        if len(self._recorded()):
            with self._sizes.open("ab") as file:
                file.write(np.array(entry.stat().st_size, dtype=RECORD).tobytes())
        recorded = self._recorded()
        if not 0 < len(recorded) < MOST or recorded.sum() > self.limit:
            self._prune(entry)

    def _recorded(self) -> np.ndarray:
        """Return the size of the folder when it was last listed, and of each entry since; nothing if that is lost."""
        raw = self._sizes.read_bytes() if self._sizes.is_file() else b""
        whole = len(raw) % 8 == 0 and int.from_bytes(raw[:8], "little") > 0
        return np.frombuffer(raw if whole else b"", dtype=RECORD)

    def _prune(self, entry: Path) -> None:
        """List the folder; remove what was not used for longest, also files of interrupted writers, not the entry."""
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
    with suppress(OSError), os.scandir(folder) as entries:  # it cannot be listed
        for entry in entries:
            with suppress(OSError):
                found = entry.stat()
                if stat.S_ISREG(found.st_mode):
                    yield found.st_mtime, found.st_size, entry.path


def _checksum(key: str, file: BinaryIO) -> bytes:
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
