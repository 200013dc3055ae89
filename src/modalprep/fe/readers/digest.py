"""Fingerprints of the files of a body; nothing is imported that reads more than their lines."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from modalprep.fe.readers.abaqus.lexer import read_blocks
from modalprep.fe.readers.nastran.cards import read_cards

NASTRAN = {".bdf", ".dat", ".nas", ".blk"}
ANSYS = {".cdb", ".ans"}


def mesh_digest(path: Path) -> str:
    """Return the SHA-256 of a mesh file, of a deck with its includes; empty when the file is not there."""
    if not path.is_file():
        return ""
    if path.suffix.lower() in NASTRAN:
        return read_cards(path).sha256
    if path.suffix.lower() == ".inp":
        return read_blocks(path)[1]
    return hashlib.sha256(path.read_bytes()).hexdigest()


def matrices_digest(paths: Iterable[str | Path]) -> str:
    """Return one SHA-256 of all files; a missing file counts as empty."""
    return hashlib.sha256(" ".join(mesh_digest(Path(path)) for path in paths).encode()).hexdigest()
