"""A pipeline file that was read: what is handed from stage to stage, so that no stage reads it again."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from modalprep.pipeline.schema.base import PipelineName, named_files
from modalprep.pipeline.schema.load import read_pipeline
from modalprep.pipeline.schema.pipeline import Pipeline


@dataclass(frozen=True, eq=False)
class Loaded:
    """A pipeline file and what it says.

    Attributes
    ----------
    path : Path
        Files that it names are relative to its folder.
    pipeline : Pipeline
    text : str

    Examples
    --------
    >>> Loaded(Path("pipelines/arm.toml"), Pipeline.model_validate({"mesh": {"file": "a.msh"}})).body_name
    'arm'
    """

    path: Path
    pipeline: Pipeline
    text: str = ""

    @property
    def folder(self) -> Path:
        """Where the file lies."""
        return self.path.parent

    @property
    def body_name(self) -> str:
        """Name of the body that the file builds."""
        return self.pipeline.name or self.path.stem

    @property
    def body_files(self) -> list[Path]:
        """The pipeline files of the bodies."""
        names = [name for _, name in named_files(self.pipeline) if isinstance(name, PipelineName)]
        return [self.folder / name for name in dict.fromkeys(names)]

    @cached_property
    def files(self) -> tuple[Loaded, ...]:
        """The file itself, and the pipeline files of its bodies and of their bodies; each is read once.

        Raises
        ------
        InputError
            When one of them cannot be read.
        """
        found, todo = [self], self.body_files
        while todo:
            path = todo.pop()
            if not any(same_file(path, other.path) for other in found):
                found.append(load(path))
                todo += found[-1].body_files
        return tuple(found)

    def of_body(self, name: str) -> Loaded:
        """Return the pipeline file of a body, by the name that a table has for it."""
        path = self.folder / name
        return replace(next(file for file in self.files if same_file(file.path, path)), path=path)


def load(file: str | Path | Loaded) -> Loaded:
    """Read and validate a pipeline file; one that was read already is returned as it is.

    Raises
    ------
    InputError
        When the file is missing, is not TOML, or has an unknown key.

    Examples
    --------
    >>> load("no.toml")
    Traceback (most recent call last):
    modalprep.errors.InputError: pipeline file no.toml does not exist
    """
    return file if isinstance(file, Loaded) else Loaded(Path(file), *read_pipeline(Path(file)))


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths lead to one file, also through links; files that are not there yet count by their names."""
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):  # one is not there, or its name cannot be one
        return os.path.abspath(one) == os.path.abspath(other)
