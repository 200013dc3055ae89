"""Tables of the model of a body for its page: units, materials, sections, masses, elements, links, interfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from modalprep.fe.assembly.model import AddedTerm, FEModel
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.materials import Anisotropic, Material
from modalprep.fe.properties.points import PointMass
from modalprep.fe.properties.properties import Beam, Ply, Property, Shell, Truss
from modalprep.fe.quality.quality import Quality
from modalprep.formats.hdf5 import stated_checksum
from modalprep.pipeline.building.built import Built
from modalprep.pipeline.building.inputs import page_inputs
from modalprep.pipeline.building.model import pipeline_node_sets, pipeline_sections
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.report.body_page.inputs import Inputs
from modalprep.report.body_page.table import Table, written

MODULI = ("E", "E1", "E2", "E3", "G", "G12", "G13", "G23")
RATIOS = ("nu", "nu12", "nu13", "nu23")
UNITS = {
    "A": "mm²",
    "Iy": "mm⁴",
    "Iz": "mm⁴",
    "J": "mm⁴",
    "thickness": "mm",
    "offset": "mm",
    "mass": "kg",
    "inertia": "kg m²",
    "translation": "N/m",
    "rotation": "N m/rad",
    "angle": "rad",
}
FACTORS = {"mm": 1e3, "mm²": 1e6, "mm⁴": 1e12}
NSM = {Beam: "kg/m", Truss: "kg/m", Shell: "kg/m²"}
HIDDEN = ("material", "plies", "bending_material", "shear_material", "fibres", "taper")  # written in another form


def body_inputs(source: Loaded, built: Built) -> Inputs:
    """Return inputs, program and tables for the page of the body of a pipeline file."""
    given = page_inputs(source, {f"{built.file.name}, of its contents": stated_checksum(built.file)})
    return replace(given, tables=built.tables.model, energies=built.tables.energies)


def model_tables(pipeline: Pipeline, mesh: Mesh, model: FEModel, quality: Quality | None) -> list[Table]:
    """Return the tables of a model; those of matrices have neither materials, properties, masses nor elements."""
    tables = [_units(pipeline, mesh, model)]
    if model.groups is not None:
        sections = {**mesh.properties, **pipeline_sections(pipeline)}
        sections = {name: sections[name] for name in model.groups.names}
        materials = _materials(pipeline, sections)
        tables += [material_table(materials), section_table(sections, materials), mass_table(model, sections)]
        tables += [quality_table(quality)] if quality else []
        tables += _links(pipeline, mesh)
    return [*tables, _interfaces(pipeline, model), *_supports(pipeline), rigid_table(model)]


def _units(pipeline: Pipeline, mesh: Mesh, model: FEModel) -> Table:
    table = pipeline.mesh or pipeline.matrices
    assert table is not None  # one of them is the source of the model
    rows = [
        ("file", mesh.source),
        ("length unit of the file", f"{table.length_unit} = {mesh.scale:g} m"),
        ("mass unit of the file", table.mass_unit or "not given: SI"),
        ("nodes", _nodes(mesh, model)),
        ("elements", str(sum(map(len, model.cells.values())))),
        ("degrees of freedom", f"{model.n_dof}, of which {len(model.free)} are independent"),
        ("origin of the body frame", f"({', '.join(written(float(x), '.6g') for x in model.origin)}) m in the mesh"),
    ]
    if pipeline.mesh is not None:
        rows.append(("distribution of the mass", pipeline.mesh.mass))
    return Table(name="model", columns=("quantity", "value"), rows=rows)


def _nodes(mesh: Mesh, model: FEModel) -> str:
    """Return the number of nodes, of those that connections add to the mesh, and of those without DOFs."""
    count = len(model.points)
    added = len(model.points) - len(mesh.points)
    bare = int(np.count_nonzero(np.all(model.dof[:count] < 0, axis=1)))
    parts = [f"{added} that connections add to the {len(mesh.points)} of the file"] if added else []
    parts += [f"{bare} without degrees of freedom"] if bare else []
    return f"{count}, of which {' and '.join(parts)}" if parts else str(count)


def _materials(pipeline: Pipeline, sections: Mapping[str, Property]) -> dict[str, Any]:
    """Return the materials of sections by the names of the pipeline file; those of a deck are numbered."""
    given = {name: table.build() for name, table in pipeline.materials.items()}
    materials: dict[str, Any] = {}
    for material in (material for section in sections.values() for material in _materials_of(section)):
        if material not in materials.values():
            name = next((name for name, known in given.items() if known == material and name not in materials), None)
            number = 1 + sum(key.startswith("of the deck") for key in materials)
            materials[name or f"of the deck, {number}"] = material
    return materials


def _materials_of(section: Property) -> list[Any]:
    names = ("material", "bending_material", "shear_material")
    own = [getattr(section, name, None) for name in names] + [ply.material for ply in getattr(section, "plies", ())]
    return [material for material in own if material is not None]


def material_table(materials: Mapping[str, Any]) -> Table:
    """Return the constants of materials; columns that none of them has are left out.

    Examples
    --------
    >>> steel = Material(E=210e9, nu=0.3, rho=7800.0)
    >>> material_table({"steel": steel}).columns
    ('material', 'kind', 'E (GPa)', 'G (GPa)', 'nu', 'density (kg/m³)')
    """
    names = [name for name in (*MODULI, *RATIOS) if any(hasattr(material, name) for material in materials.values())]
    units = [f"{name} (GPa)" if name in MODULI else name for name in names]
    rows = [
        (key, _kind(material), *(_modulus(material, name) for name in names), material.rho)
        for key, material in materials.items()
    ]
    return Table(name="materials", columns=("material", "kind", *units, "density (kg/m³)"), rows=rows)


def _modulus(material: Any, name: str) -> float | None:
    value = getattr(material, name, None)
    return value / 1e9 if name in MODULI and value is not None else value


def _kind(material: Any) -> str:
    if isinstance(material, Material):
        return "isotropic"
    return "anisotropic, 21 moduli" if isinstance(material, Anisotropic) else "orthotropic"


def section_table(sections: Mapping[str, Property], materials: Mapping[str, Any]) -> Table:
    """Return type, materials and dimensions of the sections of groups.

    Examples
    --------
    >>> steel = Material(E=210e9, nu=0.3, rho=7800.0)
    >>> section_table({"skin": Shell(material=steel, thickness=2e-3)}, {"steel": steel}).rows
    [('skin', 'shell', 'steel', 'thickness 2 mm')]
    """
    rows = []
    for group, section in sections.items():
        used = [next(name for name, known in materials.items() if known == own) for own in _materials_of(section)]
        rows.append((group, _family(section), ", ".join(dict.fromkeys(used)), _dimensions(section)))
    return Table(name="properties", columns=("group", "type", "material", "dimensions"), rows=rows)


def _of_term(term: AddedTerm) -> str:
    """Return what a term is by what it has."""
    if term.K is not None and term.M is not None:
        return "stiffness and mass"
    return "foundation" if term.M is None else "added mass"


def _family(section: Property) -> str:
    return "point mass" if isinstance(section, PointMass) else type(section).__name__.lower()


def _dimensions(section: Property) -> str:
    """Return the dimensions of a section that are not defaults, with units."""
    parts = []
    if isinstance(section, Shell) and section.plies:
        thickness = _number(sum(ply.thickness for ply in section.plies), 1e3)
        parts.append(f"{len(section.plies)} plies, {thickness} mm: {_stack(section)}")
    for field in fields(section):
        value = getattr(section, field.name)
        if field.name not in HIDDEN and value != field.default and value is not None:
            unit = NSM.get(type(section), "") if field.name == "nsm" else UNITS.get(field.name, "")
            parts.append(f"{field.name} {_number(value, FACTORS.get(unit, 1.0))} {unit}".strip())
    if isinstance(section, Beam) and section.taper:
        parts.append(f"tapered, {len(section.taper)} sections")
    return ", ".join(parts)


def _stack(section: Shell) -> str:
    def text(ply: Ply) -> str:
        return f"{_number(ply.thickness, 1e3)} mm" + (f" at {np.degrees(ply.angle):g}°" if ply.angle else "")

    return " / ".join(map(text, section.plies))


def _number(value: Any, factor: float = 1.0) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(_number(each, factor) for each in value)})"
    return written(factor * value, ".6g") if isinstance(value, float) or factor != 1 else str(value)


def mass_table(model: FEModel, sections: Mapping[str, Property]) -> Table:
    """Return elements, volume and mass of each group, and their sum against the mass of the assembled matrix.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model, spinup_section
    >>> table = mass_table(cantilever_model(elements=4), {"beam": spinup_section()})
    >>> table.rows
    [('beam', 'beam', '4 line', 0.004, 12.0, 100.0)]
    """
    groups = model.groups
    assert groups is not None  # the model is assembled from elements
    assert model.strain_energy is not None
    R = model.rigid_body()[:, :3]
    volume = groups.summed({kind: v[:, None] for kind, v in model.strain_energy.volume().items()})[:, 0]
    rows = []
    percent = 100 / model.rigid.m if model.rigid.m else 0.0
    for name, size in zip(groups.names, volume.tolist(), strict=True):
        count = ", ".join(f"{number} {kind}" for kind, number in groups.count(name).items())
        mass = groups.mass(name)
        rows.append((name, _family(sections[name]), count, size, mass, percent * mass))
    for name, term in model.terms.items():
        mass = 0.0 if term.M is None else float(R[:, 0] @ (term.M @ R[:, 0]))
        rows.append((name, _of_term(term), "", 0.0, mass, percent * mass))
    total = sum(row[4] for row in rows)
    assembled = float(R[:, 0] @ (model.M @ R[:, 0]))
    return Table(
        name="mass-by-group",
        columns=("group", "type", "elements", "volume (m³)", "mass (kg)", "share (%)"),
        rows=rows,
        total=("sum", "", "", float(volume.sum()), total, percent * total),
        below=[
            ("assembled mass matrix", "", "", None, assembled, None),
            ("difference", "", "", None, total - assembled, None),
        ],
        forms={"mass (kg)": ".6g", "share (%)": ".2f"},
        caption="Mass of each group; the assembled mass is that of the mass matrix in a unit translation.",
    )


def quality_table(quality: Quality) -> Table:
    """Return number, size and worst shape of the elements of each type."""
    names = ("count", "smallest", "median", "largest", "aspect", "small", "large", "jacobian", "warpage")
    return Table(
        name="elements",
        columns=(
            "type",
            "number",
            "smallest (m)",
            "median (m)",
            "largest (m)",
            "aspect ratio",
            "smallest angle (°)",
            "largest angle (°)",
            "scaled Jacobian",
            "warpage",
        ),
        rows=[(kind, *(getattr(row, name) for name in names)) for kind, row in quality.statistics.items()],
        forms={"aspect ratio": ".3g", "smallest angle (°)": ".1f", "largest angle (°)": ".1f"},
        caption="Elements by their type: mean edge, and the worst aspect ratio, angles, scaled Jacobian and warpage.",
    )


def _links(pipeline: Pipeline, mesh: Mesh) -> list[Table]:
    """Return the table of links, equations, matrices and connections, none without any."""
    rows = []
    for kind in dict.fromkeys(link.kind for link in mesh.links):
        own = [link for link in mesh.links if link.kind == kind]
        rows.append((kind, "of the mesh file", len(own), sum(len(link.nodes) for link in own)))
    if mesh.equations:
        rows.append(("equation", "of the mesh file", len(mesh.equations), sum(len(e.nodes) for e in mesh.equations)))
    if mesh.matrices:
        rows.append(("matrix", "of the mesh file", len(mesh.matrices), sum(len(own.nodes) for own in mesh.matrices)))
    for name, spec in pipeline_node_sets(pipeline, mesh)[1].items():
        rows.append((spec.kind, f"connection {name}", 1, len(spec.nodes(mesh, np.arange(len(mesh.points))))))
    return [Table(name="links", columns=("kind", "from", "number", "nodes"), rows=rows)] if rows else []


def _interfaces(pipeline: Pipeline, model: FEModel) -> Table:
    given = pipeline.interfaces
    rows = []
    for k, frame in enumerate(model.interfaces):
        place = (frame.position + model.origin).tolist()
        kind = given[frame.name].kind if frame.name in given else ""
        rows.append((frame.name, "root" if k == 0 else "", kind or "", frame.boundary, len(frame.nodes), *place))
    columns = ("interface", "role", "kind", "boundary", "tied nodes", "x (m)", "y (m)", "z (m)")
    return Table(name="interfaces", columns=columns, rows=rows, caption="Places in the coordinates of the mesh.")


def _supports(pipeline: Pipeline) -> list[Table]:
    rows = []
    for name, table in pipeline.supports.items():
        nodes = table.model_dump(exclude_none=True, exclude={"components"})
        where = ", ".join(f"{key} {value}" for key, value in nodes.items())
        rows.append((name, where, table.components or "all that the nodes have"))
    return [Table(name="supports", columns=("support", "nodes", "components"), rows=rows)] if rows else []


def rigid_table(model: FEModel) -> Table:
    """Return the frequencies of the six rigid motions of the free model, which are round-off.

    They are the Rayleigh quotients ``x^T K x / x^T M x`` in the space of the rigid motions.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> all(row[1] < 1e-3 for row in rigid_table(cantilever_model()).rows)
    True
    """
    R = model.rigid_body()
    K, M = R.T @ (model.K @ R), R.T @ (model.M @ R)
    scale = 1 / np.sqrt(np.maximum(np.diag(M), 1e-12 * np.diag(M).max()))
    stiffness = (K + K.T) / 2 * scale * scale[:, None]
    w2 = np.abs(eigh(stiffness, eigvals_only=True))
    return Table(
        name="rigid-body-motions",
        columns=("motion", "Hz"),
        rows=[(k, float(f)) for k, f in enumerate(np.sqrt(w2) / (2 * np.pi), start=1)],
        forms={"Hz": ".1e"},
        caption="The free model (free-free check): frequencies of its six rigid motions by their Rayleigh quotients "
        "for masses of 1; they are round-off unless the model is supported.",
    )
