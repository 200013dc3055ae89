"""The [sensitivities] of a pipeline file."""

from __future__ import annotations

from modalprep.correlation.derivatives import Sensitivities, sensitivities
from modalprep.pipeline.building.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.schema.analysis import SensitivitiesTable
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded


def pipeline_sensitivities(source: Loaded, table: SensitivitiesTable) -> Sensitivities:
    """Return the derivatives of the frequencies of the model, which is clamped at its root alone, or free.

    Raises
    ------
    InputError
        When the model has no parameter of the kinds in the file.
    """
    pipeline = source.pipeline
    materials = {name: material.build() for name, material in pipeline.materials.items()}
    with naming(source.path):
        model = assemble_pipeline(pipeline, read_pipeline_mesh(source))
        return sensitivities(model, modes=table.modes, kinds=table.by, materials=materials, boundary=table.boundary)
