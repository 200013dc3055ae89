"""The [cyclic] table of a pipeline file: modes of its ring by nodal diameter, from the mesh of one sector."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.assemble import assemble, root_first
from modalprep.fe.links.interface import Interface
from modalprep.fe.mesh.mesh import Mesh
from modalprep.pipeline.building.model import (
    cyclic_symmetry,
    own_sections,
    pipeline_node_sets,
    pipeline_supports,
    pipeline_terms,
    read_own_mesh,
)
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.fe import CyclicTable
from modalprep.pipeline.schema.load import Loaded
from modalprep.reduction.cyclic.modes import CyclicModes, cyclic_modes


def pipeline_cyclic(source: Loaded, table: CyclicTable) -> CyclicModes:
    """Return the modes of the ring with the fixed interfaces that every sector has held.

    Raises
    ------
    InputError
        When the root is not in every sector, or the sector does not fit itself.
    """
    pipeline = source.pipeline
    with naming(source.path):
        mesh = read_own_mesh(source)
        symmetry = cyclic_symmetry(table, mesh)
        interfaces, connections = pipeline_node_sets(pipeline, mesh)
        order = root_first(interfaces, pipeline.reduction.root)
        held = {name: interfaces[name] for name in order if _in_every_sector(mesh, interfaces[name], name == order[0])}
        if order[0] not in held:
            raise InputError(
                f"[cyclic]: the root {order[0]!r} is not in every sector; let its group have nodes of each"
            )
        sections = {**mesh.properties, **own_sections(pipeline)}
        supports, terms = pipeline_supports(pipeline, mesh), pipeline_terms(pipeline)
        assert pipeline.mesh is not None
        model = assemble(
            mesh.with_(cyclic=None), sections, held, order[0], connections, supports, pipeline.mesh.mass, terms
        )
        options = {"modes": table.modes, "nodal_diameters": table.nodal_diameters, "speed": table.speed}
        found = cyclic_modes(model, mesh, symmetry, **options)
    others = [name for name in order if name not in held and interfaces[name].boundary == "fixed"]
    said = f"fixed interfaces that not every sector has are free in the nodal diameters: {', '.join(others)}"
    return found.with_(notes=(*found.notes, *[said] * bool(others)))


def _in_every_sector(mesh: Mesh, spec: Interface, root: bool) -> bool:
    """Whether an interface is held, and has nodes of the sector of the mesh, and so of each."""
    if spec.kind == "support":
        return True
    if not root and spec.boundary == "free":
        return False
    with suppress(InputError):
        return spec.near is None and spec.node is None and bool(len(spec.nodes(mesh, np.arange(len(mesh.points)))))
    return False
