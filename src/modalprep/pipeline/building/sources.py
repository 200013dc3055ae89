"""Input files and output folder of a pipeline file, and the refusal to overwrite inputs and outputs of others."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from modalprep.atomic import refuse_unwritable, write_text
from modalprep.errors import InputError
from modalprep.pipeline.building.supplied import supplied_files
from modalprep.pipeline.schema.base import BodyName, PipelineName, named_files
from modalprep.pipeline.schema.load import Loaded, same_file

MARK = ".source"  # end of the name of the file, in or beside an output, with the relative path of its source


def source_files(source: Loaded) -> list[Path]:
    """Return the files that a pipeline file names, except other pipelines, and those read along with its bodies."""
    names = [name for _, name in named_files(source.pipeline)]
    bodies = dict.fromkeys(source.folder / name for name in names if isinstance(name, BodyName))
    named = dict.fromkeys(source.folder / name for name in names if not isinstance(name, PipelineName))
    return [*named, *(file for body in bodies for file in supplied_files(body)[1:])]


def needed_files(source: Loaded) -> list[Path]:
    """Return all files that a pipeline file needs: itself, its inputs, and those of the pipelines of its bodies."""
    return [file for each in source.files for file in (each.path, *source_files(each))]


def refuse_overwriting(targets: Iterable[Path], needed: Iterable[Path]) -> None:
    """Refuse targets that are also inputs, that are written twice, or that cannot be written.

    Raises
    ------
    InputError
        Which names the file.
    OutputError
        When it is a folder, or cannot be written.

    Examples
    --------
    >>> refuse_overwriting([Path("run.h5")], [Path("body.h5")])
    >>> refuse_overwriting([Path("body.h5")], [Path("./body.h5")])
    Traceback (most recent call last):
    modalprep.errors.InputError: body.h5 is read by this command, which would overwrite it; write to another file
    """
    needed = list(needed)
    written = []
    for target in targets:
        refuse_unwritable(target)
        if any(same_file(target, file) for file in needed):
            raise InputError(f"{target} is read by this command, which would overwrite it; write to another file")
        if any(same_file(target, file) for file in written):
            raise InputError(f"{target} would be written twice by this command; give each output a file of its own")
        written.append(target)


def relative(file: Path, folder: Path) -> str:
    """Return the path of a file relative to a folder, so that both may be moved together; a link keeps its name.

    Examples
    --------
    >>> relative(Path("meshes/a.msh"), Path("pipelines"))
    '../meshes/a.msh'
    """
    try:
        return Path(os.path.relpath(file.parent.resolve() / file.name, folder.resolve())).as_posix()
    except ValueError:  # on another drive, or its name cannot be one
        return file.absolute().as_posix()


def output_folder(path: Path, output: Path | None) -> Path:
    """Return the folder of the outputs of a pipeline file: ``<output>/<name>``, by default ``output`` beside it.

    Examples
    --------
    >>> output_folder(Path("pipelines/bracket.toml"), None).as_posix()
    'pipelines/output/bracket'
    """
    return (output or path.parent / "output") / path.stem


def refuse_shared(target: Path, file: Path) -> None:
    """Refuse an output folder or file that has another source of the same name, which still exists.

    Raises
    ------
    InputError
        Which names both files.

    Examples
    --------
    >>> refuse_shared(Path("output/arm"), Path("arm.toml"))
    """
    mark = _mark(target)
    if not mark.is_file():
        return
    other = Path(mark.parent, mark.read_text(encoding="utf-8").strip())
    if other.is_file() and not same_file(other, file):
        raise InputError(
            f"{file} would overwrite the outputs of {other.resolve()} in {target}; rename one of the two files, or "
            f"choose another {'-o file' if target.is_file() else '--output folder'}"
        )


def refuse_shared_folders(source: Loaded, output: Path | None) -> None:
    """Refuse a pipeline file when its outputs, or those of its bodies, would overwrite those of another file.

    Raises
    ------
    InputError
        Which names both files.
    """
    sources: dict[Path, Path] = {}  # by folder
    for file in (each.path for each in source.files):
        folder = output_folder(file, output)
        if other := sources.get(folder.resolve()):
            raise InputError(f"{other} and {file} would both write into {folder}; rename one, or leave out --output")
        sources[folder.resolve()] = file
        if (
            file.parent.resolve() != folder.resolve()
        ):  # else a copy in the output folder, which has the mark of its source
            refuse_shared(folder, file)


def mark_source(target: Path, file: Path) -> None:
    """Record the source of an output folder, or of an output file that exists."""
    mark = _mark(target)
    text = relative(file, mark.parent)
    if file.parent.resolve() == target.resolve() or (mark.is_file() and mark.read_text(encoding="utf-8") == text):
        return
    write_text(text, mark)


@contextmanager
def claiming(sources: Mapping[Path, Path]) -> Iterator[None]:
    """Refuse targets (keys) that have another source than the given one (value); in the end mark those written.

    Raises
    ------
    InputError
        Which names both files.

    Examples
    --------
    >>> with claiming({Path("arm-modes.png"): Path("arm.h5")}):
    ...     pass
    """
    for target, file in sources.items():
        refuse_shared(target, file)
    yield
    for target, file in sources.items():
        if target.is_file():
            mark_source(target, file)


def _mark(target: Path) -> Path:
    return target.with_name(f".{target.name}{MARK}") if target.is_file() else target / MARK
