"""What determines the body of a pipeline file: its mesh or matrices, its options, the program."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from modalprep import __version__
from modalprep.fe.readers.digest import matrices_digest, mesh_digest
from modalprep.pipeline.build.supplied import supplied_digest
from modalprep.pipeline.schema.base import named_files
from modalprep.pipeline.schema.pipeline import Pipeline


def inputs(path: Path, pipeline: Pipeline) -> dict[str, str]:
    """Return what determines the body: hash of the mesh, of the body's options, program version."""
    made_of = ("mesh", "matrices", "materials", "properties", "connections", "supports")
    parts = {"name", *made_of, "interfaces", "stress", "recovery", "loads", "reduction"}
    parts |= {"body"} if pipeline.body else set()
    options = json.dumps(pipeline.model_dump(include=parts), sort_keys=True)
    return {
        "pipeline": path.name,
        "mesh_sha256": source_digest(path, pipeline),
        "options_sha256": hashlib.sha256(options.encode()).hexdigest(),
        "program": f"modalprep {__version__}",
    }


def source_digest(path: Path, pipeline: Pipeline) -> str:
    """Return the hash of the files that define the body; empty without a body."""
    if pipeline.matrices is not None:
        return matrices_digest(matrix_files(path, pipeline).values())
    if pipeline.body is not None:
        return supplied_digest(path, pipeline.body)
    return mesh_digest(path.parent / pipeline.mesh.file) if pipeline.mesh else ""


def matrix_files(path: Path, pipeline: Pipeline) -> dict[str, Path]:
    """Return the files of the matrices by their keys in the pipeline file."""
    return {str(keys[-1]): path.parent / name for keys, name in named_files(pipeline.matrices)}
