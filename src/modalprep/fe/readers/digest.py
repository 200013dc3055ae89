"""Fingerprints of the files of a body; nothing is imported that reads more than their lines."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

from modalprep.fe.readers.abaqus.lexer import read_blocks
from modalprep.fe.readers.deck_format import BY_ENDING, deck_format
from modalprep.fe.readers.nastran.reader import read_cards
from modalprep.program import file_digest

NASTRAN = {ending for ending, name in BY_ENDING.items() if name == "nastran"}
OTHER_FILES = re.compile(rb"include|input|(stiffness|mass)\s*file", re.IGNORECASE)


def mesh_digest(path: Path) -> str:
    """Return the SHA-256 of a mesh file, of a deck with its includes; empty when the file is not there."""
    digest = file_digest(path)
    kind = deck_format(path) if digest else None
    if kind not in ("nastran", "abaqus") or not _may_include(path, digest):
        return digest
    return read_cards(path).sha256 if kind == "nastran" else read_blocks(path)[1]


@lru_cache(maxsize=1000)
def _may_include(path: Path, digest: str) -> bool:
    """Whether a deck may name other files; of one without any, the hash is that of its bytes."""
    return OTHER_FILES.search(path.read_bytes()) is not None


def matrices_digest(paths: Iterable[str | Path]) -> str:
    """Return one SHA-256 of all files; a missing file counts as empty."""
    return hashlib.sha256(" ".join(mesh_digest(Path(path)) for path in paths).encode()).hexdigest()
