"""From the tables of a pipeline file to the finite-element model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.assemble import assemble
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.stress_recovery import StressPoint, StressRecovery, stress_recovery
from modalprep.fe.external.files import Matrices, read_matrices
from modalprep.fe.links.interface import Connection, Interface, connect
from modalprep.fe.links.ring import make_ring
from modalprep.fe.links.support import Support
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.properties import Property
from modalprep.fe.quality.quality import Quality, check_mesh
from modalprep.fe.readers.read import read_mesh
from modalprep.fe.recovery.recover import ModelRecovery, Recover, model_recovery
from modalprep.fe.terms.added import AnyTerm
from modalprep.fe.terms.added_mass import AddedMass
from modalprep.fe.terms.foundation import Foundation
from modalprep.pipeline.building.inputs import matrix_files
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.fe import CyclicTable, InterfaceTable, NodeSetTable, StressTable
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline


def read_pipeline_mesh(source: Loaded) -> Mesh:
    """Read the mesh, or the nodes with their matrices, that a pipeline file names; with [cyclic] that of the ring."""
    return whole_mesh(source.pipeline, read_own_mesh(source))


def whole_mesh(pipeline: Pipeline, mesh: Mesh) -> Mesh:
    """Return the mesh of a file; with [cyclic] that of the ring of which it is a sector."""
    table = pipeline.cyclic
    return mesh if table is None else make_ring(mesh, cyclic_symmetry(table, mesh), own_sections(pipeline))


def cyclic_symmetry(table: CyclicTable, mesh: Mesh) -> CyclicSymmetry:
    """Return the symmetry of a sector that the file states, or else its deck."""
    given: dict[str, Any] = table.model_dump(include={"sectors", "axis", "low", "high"}, exclude_none=True)
    given |= {key: mesh.scale * np.array(x) for key in ("point", "tolerance") if (x := getattr(table, key)) is not None}
    with naming("[cyclic]"):
        if mesh.cyclic is not None:
            return mesh.cyclic.with_(**given)
        if table.sectors is None:
            raise InputError("the mesh file has no number of sectors; give sectors")
        return CyclicSymmetry(**given)


def read_own_mesh(source: Loaded) -> Mesh:
    """Read the mesh of a pipeline file as it is: of a ring, one sector."""
    pipeline, table = source.pipeline, source.pipeline.mesh
    if pipeline.matrices is not None:
        given: dict[str, Any] = pipeline.matrices.model_dump()
        given |= matrix_files(pipeline.matrices, source.folder)
        return read_matrices(**given)
    if pipeline.body is not None:
        raise InputError(f"{source.path}: [body] is reduced already and has no mesh; give a file with [mesh]")
    if table is None:
        raise InputError(f"{source.path} has no [mesh]: there is no body to build")
    return read_mesh(
        source.folder / table.file,
        table.length_unit,
        table.mass_unit,
        table.ignore,
        size=table.size,
        order=table.order,
        dialect=table.dialect,
        integration=table.integration,
        gaps=table.gaps,
    )


def assemble_pipeline(pipeline: Pipeline, mesh: Mesh) -> FEModel:
    """Return the model of `checked_model`, without the quality of its mesh."""
    return checked_model(pipeline, mesh)[0]


def checked_model(pipeline: Pipeline, mesh: Mesh) -> tuple[FEModel, Quality | None]:
    """Assemble and check the mesh with the file's properties, connections and interfaces; or return that of matrices.

    Returns
    -------
    The model, and the quality of its mesh; of matrices None.

    Raises
    ------
    InputError
        When a table names something unknown, or the mesh has errors.
    """
    sections = pipeline_sections(pipeline)
    interfaces, connections = pipeline_node_sets(pipeline, mesh)
    if isinstance(mesh, Matrices):
        return mesh.model(interfaces, pipeline.reduction.root), None
    if not {**mesh.properties, **sections}:
        raise InputError(f"there are no [properties]: give the property of each mesh group ({', '.join(mesh.groups)})")
    supports = pipeline_supports(pipeline, mesh)
    assert pipeline.mesh is not None  # the mesh is not of [matrices]
    model = assemble(
        mesh,
        sections,
        interfaces,
        pipeline.reduction.root,
        connections,
        supports,
        pipeline.mesh.mass,
        pipeline_terms(pipeline),
        pipeline.mesh.forms,
    )
    quality = mesh_quality(mesh, sections, interfaces, connections, supports)
    return model.with_(notes=(*model.notes, *_defects(quality))), quality


def mesh_quality(
    mesh: Mesh,
    sections: Mapping[str, Property],
    interfaces: Mapping[str, Interface],
    connections: Mapping[str, Connection],
    supports: Mapping[str, Support],
) -> Quality:
    """Check the cells with a property; interfaces, connections and supports connect parts of the mesh."""
    ties = {**interfaces, **connections}
    joined = [spec.group for spec in ties.values() if spec.kind != "node" and spec.group]
    if supports:
        used = np.unique(np.concatenate([np.ravel(conn) for conn in mesh.cells.values()]))
        joined.append(np.concatenate([spec.constrained_nodes(mesh, used).nodes for spec in supports.values()]))
    own = {name: section for name, section in {**mesh.properties, **sections}.items() if name not in ties}
    return check_mesh(mesh, own or None, joined)


def _defects(quality: Quality) -> list[str]:
    """Return messages on the defects of a mesh that can be assembled; duplicate elements are refused."""
    for finding in quality.errors:
        if finding.kind == "duplicate":
            raise InputError(finding.message)
    return [finding.message for finding in quality.findings]


def pipeline_node_sets(pipeline: Pipeline, mesh: Mesh) -> tuple[dict[str, Interface], dict[str, Connection]]:
    """Return the interfaces and connections of the file, in m."""
    interfaces = {name: _interface(table, mesh.scale) for name, table in pipeline.interfaces.items()}
    connections = {name: Connection(**node_set(table, mesh.scale)) for name, table in pipeline.connections.items()}
    return interfaces, connections


def pipeline_supports(pipeline: Pipeline, mesh: Mesh) -> dict[str, Support]:
    """Return the supports of the file, in m."""
    supports = {}
    for name, table in pipeline.supports.items():
        with naming(f"[supports.{name}]"):
            given = node_set(table, mesh.scale)
            if "axes" in given:
                given["axes"] = tuple(map(tuple, given["axes"]))
            supports[name] = Support(**given)
    return supports


def pipeline_terms(pipeline: Pipeline) -> dict[str, AnyTerm]:
    """Return the foundations and added masses of the file."""
    terms: dict[str, AnyTerm] = {}
    for name, table in pipeline.foundations.items():
        with naming(f"[foundations.{name}]"):
            terms[name] = Foundation(**table.model_dump())
    for name, table in pipeline.added_masses.items():
        with naming(f"[added_masses.{name}]"):
            terms[name] = AddedMass(**table.model_dump())
    return terms


def connected_mesh(pipeline: Pipeline, mesh: Mesh, model: FEModel) -> Mesh:
    """Return the mesh with the new nodes of the file's [connections], in groups of their names."""
    used = np.flatnonzero(model.dof[: len(mesh.points), 0] >= 0)
    return connect(mesh, pipeline_node_sets(pipeline, mesh)[1], used)


def pipeline_stress(pipeline: Pipeline, mesh: Mesh, model: FEModel) -> StressRecovery | None:
    """Return the stress recovery of the file's [stress]; None without any."""
    if not pipeline.stress:
        return None
    points = {name: _stress_point(table, mesh.scale) for name, table in pipeline.stress.items()}
    with naming("[stress]"):
        return stress_recovery(model, connected_mesh(pipeline, mesh, model), points)


def pipeline_recovery(pipeline: Pipeline, mesh: Mesh, model: FEModel) -> ModelRecovery | None:
    """Return the recoveries of the file's [recovery]; None without any."""
    if not pipeline.recovery:
        return None
    recoveries = {}
    for name, table in pipeline.recovery.items():
        with naming(f"[recovery.{name}]"):
            recoveries[name] = Recover(**node_set(table, mesh.scale))
    with naming("[recovery]"):
        return model_recovery(model, connected_mesh(pipeline, mesh, model), recoveries)


def pipeline_quality(source: Loaded) -> tuple[Mesh, Quality]:
    """Read and check the mesh of a pipeline file."""
    pipeline = source.pipeline
    if pipeline.matrices is not None:
        raise InputError(f"{source.path}: [matrices] have no elements to check; use [mesh]")
    with naming(source.path):
        mesh = read_pipeline_mesh(source)
        interfaces, connections = pipeline_node_sets(pipeline, mesh)
        sections = pipeline_sections(pipeline)
        supports = pipeline_supports(pipeline, mesh)
        return mesh, mesh_quality(mesh, sections, interfaces, connections, supports)


def pipeline_sections(pipeline: Pipeline) -> dict[str, Property]:
    """Return the properties that the mesh of `read_pipeline_mesh` does not have: that of a ring has all."""
    return {} if pipeline.cyclic else own_sections(pipeline)


def own_sections(pipeline: Pipeline) -> dict[str, Property]:
    """Return the property of each group that the file names."""
    materials, sections = {}, {}
    for name, table in pipeline.materials.items():
        with naming(f"[materials.{name}]"):
            materials[name] = table.build()
    for group, table in pipeline.properties.items():
        with naming(f"[properties.{group}]"):
            sections[group] = table.build(materials)
    return sections


def _interface(table: InterfaceTable, scale: float) -> Interface:
    given = node_set(table, scale)
    given.setdefault("kind", "node" if {"node", "near"} & set(given) else "rbe2")
    return Interface(**given)


def _stress_point(table: StressTable, scale: float) -> StressPoint:
    given = node_set(table, scale)
    given["fibres"] = tuple(map(tuple, table.fibres))
    return StressPoint(**given)


def node_set(table: NodeSetTable, scale: float) -> dict[str, Any]:
    """Return the node set of a table, lengths in m."""
    given = {key: value for key, value in table.model_dump().items() if value is not None}
    for key in ("near", "position"):
        if key in given:
            given[key] = tuple(scale * np.array(given[key]))
    if "box" in given:
        given["box"] = tuple(tuple(scale * np.array(corner)) for corner in given["box"])
    if "plane" in given:
        given["plane"] = (tuple(scale * np.array(given["plane"]["point"])), tuple(given["plane"]["normal"]))
    if "cylinder" in given:
        cylinder = given["cylinder"]
        lengths = [scale * cylinder[key] for key in ("radius", "tolerance") if cylinder[key] is not None]
        given["cylinder"] = (tuple(scale * np.array(cylinder["point"])), tuple(cylinder["axis"]), *lengths)
    return given
