"""Pages that show a modal file, a run or a mesh."""

from __future__ import annotations

import tempfile
from pathlib import Path

from modalprep.atomic import refuse_folder
from modalprep.errors import InputError
from modalprep.formats.hdf5 import file_format
from modalprep.formats.modalfile import read_body
from modalprep.formats.resultfile import read_result
from modalprep.pipeline.building.sources import refuse_overwriting
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system
from modalprep.report.view.page import view_body, view_mesh, view_run

RUN = "-run"  # ends the name of a result file


def default_page(file: Path) -> Path:
    """Return a page in a temporary folder that remains until the machine removes it."""
    return Path(tempfile.mkdtemp(prefix="modalprep-")) / f"{file.stem}-view.html"


def view_file(
    file: Path,
    page: Path,
    reporter: Reporter,
    *,
    pipeline: Path | None = None,
    output: Path | None = None,
    length_unit: str | None = None,
) -> str:
    """Write the page of a file; return what the file is: ``body``, ``run`` or ``mesh``.

    Parameters
    ----------
    pipeline : Path or None
        Of a run; by default it is looked for.
    output : Path or None
        Folder of the outputs of the pipeline file, with the bodies of the run.

    Raises
    ------
    InputError
        When the file cannot be read, or is a run without its pipeline file.
    """
    if page.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"cannot write {page}: the page is an .html file")
    refuse_folder(page)
    refuse_overwriting([page], [file, *([pipeline] if pipeline else [])])
    kind = _kind(file)
    for option, value, own in (("--pipeline", pipeline, "run"), ("--length-unit", length_unit, "mesh")):
        if value is not None and kind != own:
            raise InputError(f"{option} is of a {own}, and {file} is a {kind}; leave it out")
    if kind == "body":
        view_body(read_body(file), page)
    elif kind == "run":
        _view_run(file, page, pipeline, output, reporter)
    else:
        from modalprep.fe.readers.read import read_cells

        view_mesh(read_cells(file, length_unit or "m"), page)
    return kind


def _kind(file: Path) -> str:
    if file.suffix.lower() == ".toml":
        raise InputError(f"{file} is a pipeline file: give its modal file, its result file or its mesh")
    if file.suffix.lower() not in (".h5", ".hdf5"):
        return "mesh"
    return "run" if file_format(file) == "modalprep result" else "body"


def _view_run(file: Path, page: Path, pipeline: Path | None, output: Path | None, reporter: Reporter) -> None:
    result = read_result(file)
    source = pipeline or _pipeline_of(file)
    output = output or (file.parent.parent if file.parent.name == source.stem else None)
    system = read_system(load(source), output, reporter)
    view_run(system, result, page, name=file.stem)


def _pipeline_of(file: Path) -> Path:
    """Return the pipeline file of a run, from the places where it lies beside the outputs."""
    name = f"{file.stem.removesuffix(RUN)}.toml"
    folder = file.resolve().parent
    for place in (folder, folder.parent, folder.parent.parent):
        if (place / name).is_file():
            return place / name
    raise InputError(f"{file}: its pipeline file {name} is not beside the outputs; name it with --pipeline")
