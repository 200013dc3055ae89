"""Records that draw themselves: the one place from which lower packages reach `report`, at run time only."""

from __future__ import annotations

import base64
from importlib import import_module
from pathlib import Path
from typing import Any

from modalprep.atomic import atomic_path
from modalprep.errors import InputError


class Film:
    """An animation that a notebook plays; `data` has the bytes of the GIF.

    Examples
    --------
    >>> Film(b"GIF89a")._repr_html_()
    '<img src="data:image/gif;base64,R0lGODlh" alt="animation">'
    """

    def __init__(self, data: bytes) -> None:
        self.data = data

    def __repr__(self) -> str:
        """Size of the file."""
        return f"Film({len(self.data)} bytes)"

    def _repr_html_(self) -> str:
        text = base64.b64encode(self.data).decode("ascii")
        return f'<img src="data:image/gif;base64,{text}" alt="animation">'

    def save(self, path: str | Path) -> Path:
        """Write the GIF.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            When the file is no .gif.
        """
        path = Path(path)
        if path.suffix.lower() != ".gif":
            raise InputError(f"cannot write {path}: the film is a .gif; write others by animate_mode or animate_system")
        with atomic_path(path) as temporary:
            temporary.write_bytes(self.data)
        return path


def draw(kind: str, *args: Any, **options: Any) -> Any:
    """Call a function of `modalprep.report.show`, which is loaded at the first drawing.

    Examples
    --------
    >>> from modalprep.reduction.table import ModeTable
    >>> import numpy as np
    >>> draw("effective_mass", ModeTable.empty(np.ones(6)), None).get_xlabel()[:14]
    'effective mass'
    """
    return getattr(import_module("modalprep.report.show"), kind)(*args, **options)
