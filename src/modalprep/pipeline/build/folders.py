"""Whose outputs a folder holds: files of one name in different folders do not overwrite each other's outputs."""

from __future__ import annotations

from pathlib import Path

from modalprep.atomic import atomic_path
from modalprep.errors import InputError
from modalprep.pipeline.build.sources import pipelines_of, relative, same_file

MARK = ".source"  # beside or in what is written: the file that it was made of, as seen from there


def output_folder(path: Path, output: Path | None) -> Path:
    """Return where the outputs of a pipeline file go: ``<output>/<name>``, by default ``output`` beside the file.

    Examples
    --------
    >>> output_folder(Path("pipelines/bracket.toml"), None).as_posix()
    'pipelines/output/bracket'
    """
    return (output or path.parent / "output") / path.stem


def refuse_shared(target: Path, file: Path) -> None:
    """Refuse a folder, or a page, that was made of another file of the same name, as long as that one is there.

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
            "choose another --output folder"
        )


def refuse_shared_folders(path: Path, output: Path | None) -> None:
    """Refuse a pipeline file when its outputs, or those of its bodies, would overwrite those of another file.

    Raises
    ------
    InputError
        Which names both files.
    """
    found: dict[Path, Path] = {}
    for file in pipelines_of(path):
        folder = output_folder(file, output)
        if other := found.get(folder.resolve()):
            raise InputError(f"{other} and {file} would both write into {folder}; rename one, or leave out --output")
        found[folder.resolve()] = file
        if file.parent.resolve() != folder.resolve():  # a copy that the program has written has the mark of its source
            refuse_shared(folder, file)


def mark_source(target: Path, file: Path) -> None:
    """Note of which file a folder, or a page, is made."""
    mark = _mark(target)
    text = relative(file, mark.parent)
    if file.parent.resolve() == target.resolve() or (mark.is_file() and mark.read_text(encoding="utf-8") == text):
        return
    with atomic_path(mark) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _mark(target: Path) -> Path:
    return target.with_name(f".{target.name}{MARK}") if target.suffix == ".html" else target / MARK
