"""Finite-element models in pipeline files: mesh, units, materials, sections, interfaces and connections."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from modalprep.pipeline.schema.base import Angle, Table, Vector


class MeshTable(Table):
    """The mesh file."""

    file: str = Field(description="mesh file, relative to this file; .msh 4.1 is best; .inp, .bdf/.dat, .vtu")
    length_unit: str = Field("m", description="unit of its coordinates: m, mm, cm, in, ft")
    mass_unit: str | None = Field(
        None, description="of a Nastran deck's own materials: kg, g, t, lbm, slug, slinch (lbf s^2/in)"
    )


class MatricesTable(Table):
    """Stiffness and mass of the unsupported structure, assembled by another program, instead of [mesh]."""

    file: str | None = Field(
        None,
        description="both matrices in one: .npz (K, M, nodes; FEM file of Exudyn), .op4, DMIG deck, .mtx substructure",
    )
    stiffness: str | None = Field(
        None, description="matrix file: .mtx (MatrixMarket, Abaqus), .npz, .op4, .sti, .bdf/.dat/.pch with DMIG"
    )
    mass: str | None = Field(None, description="matrix file like that of the stiffness")
    nodes: str | None = Field(
        None, description="coordinates: .csv ([number,] x, y, z), .npy, a Nastran deck, or any mesh file"
    )
    dof: str | None = Field(
        None, description="file with node number and component (1 to 6) of each row, where it is not that of the nodes"
    )
    dofs_per_node: Literal[3, 6] | None = Field(None, description="to check the matrices against the nodes")
    length_unit: str = Field("m", description="of matrices and nodes: m, mm, cm, in, ft")
    mass_unit: str | None = Field(None, description="of the matrices, with seconds: kg, g, t, lbm, slug, slinch")

    @model_validator(mode="after")
    def _one_way(self) -> MatricesTable:
        both = self.stiffness is not None and self.mass is not None
        if both == (self.file is not None) or (self.file and (self.stiffness or self.mass)):
            raise ValueError("needs either 'file' with both matrices, or 'stiffness' and 'mass'")
        return self


class MaterialTable(Table):
    """An isotropic material, SI."""

    type: Literal["isotropic"] = "isotropic"
    E: float = Field(description="Young's modulus, Pa")
    nu: float = Field(description="Poisson's ratio")
    rho: float = Field(description="density, kg/m^3")


class OrthotropicTable(Table):
    """A lamina, SI; for shells and their plies."""

    type: Literal["orthotropic"]
    E1: float = Field(description="Young's modulus along the fibre, Pa")
    E2: float = Field(description="across the fibre, Pa")
    nu12: float = Field(description="contraction along 2 under tension along 1")
    G12: float = Field(description="shear modulus in the plane, Pa")
    G13: float = Field(description="transverse shear modulus along 1, Pa")
    G23: float = Field(description="transverse shear modulus along 2, Pa")
    rho: float = Field(description="density, kg/m^3")


def _material_type(table: Any) -> str:
    return str(table.get("type", "isotropic")) if isinstance(table, dict) else getattr(table, "type", "isotropic")


AnyMaterial = Annotated[
    Annotated[MaterialTable, Tag("isotropic")] | Annotated[OrthotropicTable, Tag("orthotropic")],
    Discriminator(
        _material_type,
        custom_error_type="material_type",
        custom_error_message="type of a material is 'isotropic' (the default) or 'orthotropic'",
    ),
]


class ShapeTable(Table):
    """A standard section; height lies along 'up'. Sizes in m."""

    shape: Literal["rectangle", "rod", "tube", "box", "i"]
    width: float | None = None
    height: float | None = None
    diameter: float | None = None
    thickness: float | None = Field(None, description="of the wall")
    flange: float | None = Field(None, description="thickness of the flanges")
    web: float | None = Field(None, description="thickness of the web")


class BeamTable(Table):
    """Section of a group of line cells, SI: `section`, or A, Iy, Iz and J."""

    type: Literal["beam"]
    material: str
    section: ShapeTable | None = Field(None, description="a standard shape instead of A, Iy, Iz, J, ky, kz")
    A: float | None = Field(None, description="area, m^2")
    Iy: float | None = Field(None, description="second moment of area about e2 (bending towards 'up'), m^4")
    Iz: float | None = Field(None, description="second moment of area about e3, m^4")
    J: float | None = Field(None, description="torsion constant, m^4")
    ky: float | None = Field(None, description="shear factor along e2; default 5/6")
    kz: float | None = Field(None, description="shear factor along e3; default 5/6")
    up: Vector = Field([0.0, 0.0, 1.0], description="direction that e3 points to")
    offset: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(
        [0.0, 0.0], description="of the centroid from the nodes along e2 and e3, m"
    )
    nsm: float = Field(0.0, ge=0, description="further mass, kg/m")
    theory: Literal["timoshenko", "euler-bernoulli"] = "timoshenko"

    @model_validator(mode="after")
    def _one_section(self) -> BeamTable:
        given = [name for name in ("A", "Iy", "Iz", "J", "ky", "kz") if getattr(self, name) is not None]
        if self.section is not None and given:
            raise ValueError(f"a beam needs either 'section' or numbers; this one has both ({', '.join(given)})")
        missing = [name for name in ("A", "Iy", "Iz", "J") if getattr(self, name) is None]
        if self.section is None and missing:
            raise ValueError(f"a beam needs {', '.join(missing)}, or a 'section' with a shape")
        return self


class TrussTable(Table):
    """Bars of a group of line cells."""

    type: Literal["truss"]
    material: str
    A: float = Field(description="area, m^2")
    J: float = Field(0.0, ge=0, description="torsion constant, m^4; 0: no rotations")
    nsm: float = Field(0.0, ge=0, description="further mass, kg/m")


class PlyTable(Table):
    """A layer, from the bottom up."""

    material: str
    thickness: float = Field(description="m")
    angle: Angle = Field(0.0, description="from the shell's axis 1")


class ShellTable(Table):
    """Sheet or laminate of a group of triangles and quads."""

    type: Literal["shell"]
    material: str | None = None
    thickness: float | None = Field(None, description="m")
    plies: list[PlyTable] = Field([], description="instead of material and thickness, from the bottom (-normal) up")
    symmetric: bool = Field(False, description="the plies are the lower half, mirrored above")
    offset: float = Field(0.0, description="of the mid-surface from the nodes along the normal, m")
    nsm: float = Field(0.0, ge=0, description="further mass, kg/m^2")
    axis: Vector | None = Field(None, description="its projection is material axis 1; default the first side")
    angle: Angle = Field(0.0, description="from that to axis 1")
    membrane: Literal["opt", "cst"] = Field("opt", description="of triangles: optimal, or constant strain")

    @model_validator(mode="after")
    def _one_sheet(self) -> ShellTable:
        if bool(self.plies) == (self.material is not None and self.thickness is not None):
            raise ValueError("a shell needs either 'material' and 'thickness', or 'plies'")
        return self


class SolidTable(Table):
    """Material of a group of tetrahedra, wedges or hexahedra."""

    type: Literal["solid"]
    material: str


class MassTable(Table):
    """Rigid mass at each node of a group of points or at the node of a connection."""

    type: Literal["mass"]
    mass: float = Field(ge=0, description="kg")
    inertia: Annotated[list[float], Field(min_length=6, max_length=6)] = Field(
        [0.0] * 6, description="xx, yy, zz, xy, xz, yz of the inertia tensor about the mass centre, kg m^2"
    )
    offset: Vector = Field([0.0, 0.0, 0.0], description="from the node to the mass centre, m")


class SpringTable(Table):
    """Springs of a group of lines (between two nodes) or of points (to the ground)."""

    type: Literal["spring"]
    translation: Vector = Field([0.0, 0.0, 0.0], description="along e1, e2, e3, N/m")
    rotation: Vector = Field([0.0, 0.0, 0.0], description="about e1, e2, e3, N m/rad")
    up: Vector = Field([0.0, 0.0, 1.0], description="direction that e3 points to")
    location: float = Field(0.5, ge=0, le=1, description="of the elastic centre from the first node to the second")


Section = Annotated[
    BeamTable | TrussTable | ShellTable | SolidTable | MassTable | SpringTable, Field(discriminator="type")
]


class PlaneTable(Table):
    """A plane in mesh coordinates."""

    point: Vector
    normal: Vector


class CylinderTable(Table):
    """A cylinder in mesh coordinates."""

    point: Vector
    axis: Vector
    radius: float = Field(gt=0)


class NodeSetTable(Table):
    """Exactly one way to name nodes; lengths in the mesh's unit."""

    group: str | None = Field(None, description="mesh group")
    node: int | None = Field(None, description="number of one node in the file")
    near: Vector | None = Field(None, description="the node closest to this point")
    box: Annotated[list[Vector], Field(min_length=2, max_length=2)] | None = Field(
        None, description="nodes between two opposite corners"
    )
    plane: PlaneTable | None = Field(None, description="nodes on a plane")
    cylinder: CylinderTable | None = Field(None, description="nodes on a cylinder")

    @model_validator(mode="after")
    def _one_way(self) -> NodeSetTable:
        ways = ("group", "node", "near", "box", "plane", "cylinder")
        given = [way for way in ways if getattr(self, way) is not None]
        if len(given) != 1:
            raise ValueError(f"needs exactly one of {', '.join(ways)}; it has {' and '.join(given) or 'none'}")
        return self


class NodesTable(NodeSetTable):
    """A node set and its reference point."""

    position: Vector | None = Field(None, description="of the frame, in mesh coordinates; default the centroid")


class StressTable(NodeSetTable):
    """Stress at every node of a set, in the modal file: the mean over the elements that meet there."""

    element_group: str | None = Field(None, description="mesh group of these elements, where other elements meet there")
    direction: Vector | None = Field(
        None, description="only elements whose axis (beams, trusses) or normal (shells) points there, to 32 degrees"
    )
    axis: Vector | None = Field(None, description="of shells: its projection is x of the components; default mesh x")
    fibres: list[Annotated[list[float], Field(min_length=2, max_length=3)]] = Field(
        [],
        description="of beams: y, z along e2, e3 from the centroid, m, and if known the shear of a unit torque, 1/m^3; "
        "default the outer fibres of a 'section'",
    )


class InterfaceTable(NodesTable):
    """A 6-DOF frame; the first in the file is the root unless [reduction] says otherwise."""

    kind: Literal["node", "rbe2", "rbe3"] | None = Field(
        None,
        description="one node, a frame tied rigidly to all nodes (rbe2), or one that follows their mean motion (rbe3); "
        "default node for 'node' and 'near', else rbe2",
    )
    boundary: Literal["fixed", "free"] = Field(
        "fixed", description="fixed: constraint modes; free: moves with the modes"
    )


class ConnectionTable(NodesTable):
    """A new node tied to others, in a group of the connection's name, for a mass, spring or beam."""

    kind: Literal["rbe2", "rbe3"] = Field(
        "rbe3", description="tied rigidly (rbe2), or following their mean motion (rbe3)"
    )
