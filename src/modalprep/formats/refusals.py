"""What writers of files for other programs refuse alike: another suffix, a body without modes."""

from __future__ import annotations

from pathlib import Path

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError


def with_suffix(path: str | Path, what: str, *suffixes: str) -> Path:
    """Return the path of a file that is to be written, which its program finds by the suffix.

    Raises
    ------
    InputError
        When its suffix is another.

    Examples
    --------
    >>> with_suffix("arm.txt", "a script of Exudyn", ".py")
    Traceback (most recent call last):
    modalprep.errors.InputError: arm.txt: a script of Exudyn ends in .py; give such a name with -o
    """
    path = Path(path)
    if path.suffix not in suffixes:
        raise InputError(f"{path}: {what} ends in {' or '.join(suffixes)}; give such a name with -o")
    return path


def refuse_without_modes(body: FlexibleBody, target: str, advice: str) -> None:
    """Refuse a rigid body; the target is what it would be written for, the advice what to do instead.

    Raises
    ------
    InputError
        When it has no modes.
    """
    if not body.n:
        raise InputError(f"body {body.name!r} has no modes to write {target}; {advice}")
