"""Provenance of the body of a pipeline file: hashes of its mesh or matrices and options, and the program."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path

from modalprep import __version__
from modalprep.fe.readers.digest import matrices_digest, mesh_digest
from modalprep.pipeline.building.sources import needed_files
from modalprep.pipeline.building.supplied import supplied_digest
from modalprep.pipeline.schema.base import named_files
from modalprep.pipeline.schema.fe import MatricesTable
from modalprep.pipeline.schema.load import Loaded
from modalprep.program import file_digest, program
from modalprep.report.body_page.inputs import Inputs


def inputs(source: Loaded) -> dict[str, str]:
    """Return the provenance of the body: hashes of the mesh and of the options of the body, program version."""
    pipeline = source.pipeline
    made_of = ("mesh", "cyclic", "matrices", "materials", "properties", "connections", "supports")
    parts = {"name", *made_of, "interfaces", "stress", "recovery", "foundations", "added_masses", "loads", "reduction"}
    parts |= {"body"} if pipeline.body else set()
    options = json.dumps(pipeline.model_dump(include=parts), sort_keys=True)
    return {
        "pipeline": source.path.name,
        "mesh_sha256": source_digest(source),
        "options_sha256": hashlib.sha256(options.encode()).hexdigest(),
        "program": f"modalprep {__version__}",
    }


def source_digest(source: Loaded) -> str:
    """Return the hash of the files that define the body; empty without a body."""
    pipeline = source.pipeline
    if pipeline.matrices is not None:
        return matrices_digest(matrix_files(pipeline.matrices, source.folder).values())
    if pipeline.body is not None:
        return supplied_digest(source.path, pipeline.body)
    return mesh_digest(source.folder / pipeline.mesh.file) if pipeline.mesh else ""


def matrix_files(table: MatricesTable, folder: Path) -> dict[str, Path]:
    """Return the files of the matrices by their keys in the table; `folder` is that of the pipeline file."""
    return {str(keys[-1]): folder / name for keys, name in named_files(table)}


def page_inputs(source: Loaded, made: Mapping[str, str]) -> Inputs:
    """Return the input files of a page with their hashes, and the program, host and system of its results.

    Parameters
    ----------
    made : {name: hash}
        Of the files with results.
    """
    needed = (file for file in needed_files(source) if file.is_file())
    return Inputs(
        text=source.text,
        files={os.path.relpath(file, source.folder): file_digest(file) for file in needed} | dict(made),
        made=program() | {"host": platform.node(), "system": platform.platform()},
    )
