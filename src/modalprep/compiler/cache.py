"""Compiled kernels between processes: whole files that say themselves what they hold."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.runtime.nrt import rtsys

from modalprep.compiler.linking import LinkedCode

DIGEST = hashlib.sha256().digest_size


class KernelCache(FunctionCache):
    """Numba's cache of a function, which loads compiled code without the registries that only a compiler needs."""

    _impl_class = LinkedCode

    def __init__(self, function: Callable, stamp: str) -> None:
        super().__init__(function)
        self._cache_file = CompiledFiles(self._cache_file, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code of a signature, None if there is none."""
        rtsys.initialize(target_context)  # what kernels that make arrays call
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _index_key(self, sig: Any, codegen: Any) -> tuple:
        return super()._index_key(sig, _asked_once(codegen))


@lru_cache
def _asked_once(codegen: Any) -> SimpleNamespace:
    """Return what numba's key needs of a code generator, which looks at the processor at every call."""
    processor = codegen.magic_tuple()
    return SimpleNamespace(magic_tuple=lambda: processor)


class CompiledFiles(IndexDataCacheFile):
    """One whole file for each compiled signature, which says itself what it holds.

    Numba keeps an index beside numbered files. After a kill between the two, or when two processes compile for
    different types at the same moment, a number may belong to other code: wrong results, or a crash. Numba lets a
    program choose the folder and the stamp of its files (NUMBA_CACHE_LOCATOR_CLASSES, for all functions of the
    process) but not how they are kept, so this takes the place of a private attribute: pyproject.toml bounds numba.

    A file begins with the digest of all that follows and of its stamp: damaged code, which would end the process, and
    that of other sources is never looked at.
    """

    def __init__(self, numbered: IndexDataCacheFile, stamp: str) -> None:
        base = numbered._index_name.removesuffix(".nbi")
        super().__init__(numbered._cache_path, base, stamp)
        self._base = base

    def save(self, key: Any, data: Any) -> None:
        """Write the file of a signature; without room for it the next process compiles again."""
        content = self._dump((key, data))
        with suppress(OSError), self._open_for_write(self._data_path(self._name(key))) as file:
            file.write(self._digest(content))
            file.write(content)

    def load(self, key: Any) -> Any:
        """Return what was saved for a signature, None if there is nothing."""
        return self._read(self._data_path(self._name(key)), key)

    def _read(self, path: str | Path, key: Any) -> Any:
        """Return the data of a file, None if there is none, of another version, or not as it was written."""
        with suppress(OSError, ImportError, AttributeError), open(path, "rb") as file:
            digest = file.read(DIGEST)
            content = file.read()
            if digest == self._digest(content):
                saved, data = pickle.loads(content)
                return data if saved == key else None
        return None

    def _digest(self, content: bytes) -> bytes:
        found = hashlib.sha256(repr((self._version, self._source_stamp)).encode())
        found.update(content)
        return found.digest()

    def flush(self) -> None:
        """Leave the files: they are written anew."""

    def _name(self, key: Any) -> str:
        return f"{self._base}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"
