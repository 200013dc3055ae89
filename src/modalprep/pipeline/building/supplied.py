"""Bodies that are read from files: modal files, and bodies reduced by other programs."""

from __future__ import annotations

from pathlib import Path

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.readers.digest import mesh_digest
from modalprep.formats import modalfile
from modalprep.pipeline.schema.reduction import SuppliedTable
from modalprep.pipeline.schema.system import BodyTable

MODAL_FILE = (".h5", ".hdf5")


def read_supplied(path: Path, table: SuppliedTable | BodyTable) -> FlexibleBody:
    """Return the body of a file that the pipeline file at `path` names, in SI units, its frame at its root.

    Raises
    ------
    InputError
        When the file cannot be read, or the table gives units to a modal file.
    """
    body = _read(path, table)
    # A system stores bodies of equal names and provenance once.
    return body if table.root is None else body.with_(provenance=body.provenance | {"root": table.root})


def _read(path: Path, table: SuppliedTable | BodyTable) -> FlexibleBody:
    file = path.parent / str(table.file)
    given = {"length_unit": table.length_unit, "mass_unit": table.mass_unit}
    options = {}
    if isinstance(table, SuppliedTable):
        nodes = None if table.nodes is None else path.parent / table.nodes
        options = {"interfaces": table.interfaces, "nodes": nodes}
    if not is_modal_file(file):
        from modalprep.formats.bodies.read import import_body  # imported here, as modal files need none of the readers

        return import_body(file, root=table.root, **given, **options)
    if any(options.values()) or given != {"length_unit": "m", "mass_unit": None}:
        raise InputError(f"modal file {file} is in SI units and has its interfaces; leave out units, interfaces, nodes")
    body = modalfile.read_body(file)
    if table.root is None:
        return body
    from modalprep.body.frames import reroot

    return reroot(body, table.root)


def is_modal_file(file: Path) -> bool:
    """Whether a file is a modal file, which is assumed where its suffix is that of no other program."""
    suffix = file.suffix.lower()
    if suffix in MODAL_FILE:
        return True
    from modalprep.formats.bodies.read import FORMATS, NO_BODY

    return suffix not in NO_BODY and not any(suffix in known.suffixes for known in FORMATS)


def supplied_digest(path: Path, table: SuppliedTable) -> str:
    """Return the hash of the files of the [body] of the pipeline file at `path`; a missing file counts as empty."""
    file = path.parent / table.file
    from modalprep.formats.bodies.read import body_digest

    own = mesh_digest(file) if is_modal_file(file) else body_digest(file)
    return own if table.nodes is None else own + mesh_digest(path.parent / table.nodes)


def supplied_files(file: Path) -> list[Path]:
    """Return the file of a body, then the further files beside it that are read with it."""
    if is_modal_file(file):
        return [file]
    from modalprep.formats.bodies.read import files_of

    return files_of(file)
