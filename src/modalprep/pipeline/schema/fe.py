"""Finite-element models in pipeline files: mesh, units, materials, sections, interfaces and connections."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from modalprep.pipeline.schema.base import DeckName, Table, Vector
from modalprep.pipeline.schema.quantities import (
    Allowable,
    AngularVelocity,
    Bedding,
    Density,
    Length,
    LineStiffness,
    MassPerArea,
    MassPerLength,
    Three,
)


class MeshTable(Table):
    """The mesh file."""

    file: DeckName = Field(
        description="mesh file, relative to this file; .msh 4.1 is best; .inp, .bdf/.dat, .cdb, .vtu, .step"
    )
    length_unit: str = Field("m", description="unit of its coordinates: m, mm, cm, in, ft")
    mass_unit: str | None = Field(
        None, description="of a deck's own materials: kg, g, t, lbm, slug, slinch (lbf s^2/in)"
    )
    ignore: list[str] = Field(
        default_factory=list, description='keywords or cards of a deck to leave out, such as "*TIE"; a note counts them'
    )
    size: float | None = Field(
        None, description="of a CAD file (.step, .iges, .brep): edge of an element, in length_unit or as text"
    )
    order: Literal[1, 2] | None = Field(None, description="of a CAD file: order of its tetrahedra; default 2")
    dialect: Literal["abaqus", "calculix"] | None = Field(
        None, description="of an .inp deck, where it does not tell itself: some keywords differ"
    )
    integration: Literal["full", "reduced_stiffness", "reduced"] | None = Field(
        None, description="of the 20-node hexahedra of a deck; default what the deck says, which a note has"
    )
    gaps: Literal["open", "closed"] | None = Field(
        None, description="of a Nastran deck with CGAP: which stiffness they have; refused without"
    )
    mass: Literal["coupled", "lumped", "nastran"] = Field(
        "coupled",
        description="mass of elements: consistent, all at the nodes, or as Nastran (PARAM,COUPMASS of a deck)",
    )
    forms: Literal["compiled", "plain"] = Field(
        "compiled", description="compiled elements, or their reference implementation in scikit-fem, which is slow"
    )


class CyclicTable(Table):
    """Cyclic symmetry: the mesh is one sector of a ring, whose body is built, with its modes by nodal diameter."""

    sectors: int | None = Field(None, ge=2, description="their number in the circle; default that of a deck")
    axis: Vector | None = Field(None, description="direction of the axis; default that of a deck, or z")
    point: Vector | None = Field(
        None, description="on the axis, mesh coordinates; default that of a deck, or the origin"
    )
    low: str | None = Field(
        None, description="group with the nodes of one edge; default all that one sector's rotation moves onto others"
    )
    high: str | None = Field(None, description="group with the nodes of the other edge, which follow those of low")
    tolerance: float | None = Field(
        None,
        gt=0,
        description="how far nodes may lie from their partners, in the unit of the mesh; default 1e-5 of its size",
    )
    nodal_diameters: list[Annotated[int, Field(ge=0)]] | None = Field(
        None, description="of the table of modes; default all, and an empty list for no table"
    )
    modes: int = Field(10, ge=1, description="number of modes of each nodal diameter in the table")
    speed: AngularVelocity = Field(0.0, description="rad/s about the axis, for the table")


class MatricesTable(Table):
    """Stiffness and mass of the unsupported structure, assembled by another program, instead of [mesh]."""

    file: DeckName | None = Field(
        None,
        description="both matrices in one: .npz (K, M, nodes; FEM file of Exudyn), .op4, .full, DMIG deck, .mtx "
        "substructure",
    )
    stiffness: DeckName | None = Field(
        None, description="matrix file: .mtx (MatrixMarket, Abaqus), .npz, .op4, .sti, .bdf/.dat/.pch with DMIG"
    )
    mass: DeckName | None = Field(None, description="matrix file like that of the stiffness")
    nodes: DeckName | None = Field(
        None, description="coordinates: .csv ([number,] x, y, z), .npy, a Nastran deck, or any mesh file"
    )
    dof: DeckName | None = Field(
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


class PlaneTable(Table):
    """A plane in mesh coordinates."""

    point: Vector
    normal: Vector


class CylinderTable(Table):
    """A cylinder in mesh coordinates."""

    point: Vector
    axis: Vector
    radius: float = Field(gt=0)
    tolerance: float | None = Field(
        None, gt=0, description="how far its nodes may lie off it; default a millionth of the model's size"
    )


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
        ways = ("group", "node", "near", "box", "plane", "cylinder", *self._instead())
        given = [way for way in ways if getattr(self, way, None) is not None]
        if len(given) != 1 and not (self._needs_none() and not given):
            raise ValueError(f"needs exactly one of {', '.join(ways)}; it has {' and '.join(given) or 'none'}")
        return self

    def _instead(self) -> tuple[str, ...]:
        """Further ways to name nodes."""
        return ()

    def _needs_none(self) -> bool:
        """Whether there may be no nodes."""
        return False


class NodesTable(NodeSetTable):
    """A node set and its reference point."""

    position: Vector | None = Field(
        None, description="of the frame, mesh coordinates; default the centroid, or on the axis"
    )


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


RecoveryKind = Literal[
    "section_force", "force", "mpc_force", "resultant", "stress", "reaction", "cut", "acceleration", "displacement"
]


class RecoveryTable(NodeSetTable):
    """A quantity with recovery matrices in the modal file: of elements of a group or within a node set, or of nodes."""

    kind: RecoveryKind = Field(
        description="section_force of beams and trusses, force of springs, mpc_force of links, ties and supports on "
        "each of their nodes, resultant of shells, stress of solids at nodes or of shells in the faces of elements, "
        "reaction of fixed interfaces or of nodes with supports or links, cut: what the other elements exert on these, "
        "acceleration of nodes, displacement of nodes in the frame of the body; without nodes: everything"
    )
    method: Literal["acceleration", "displacement"] = Field(
        "acceleration", description="acceleration adds the static response of the dropped modes"
    )
    stations: Annotated[int, Field(ge=2, le=101)] = Field(
        2, description="of section forces: places along each element, both ends included"
    )
    axis: Vector | None = Field(None, description="of shells: its projection is x of the components; default mesh x")
    allowable: Allowable | None = Field(
        None, gt=0, description="largest value allowed, of von Mises stress or of each component's magnitude: margins"
    )

    def _needs_none(self) -> bool:
        return self.kind not in ("cut", "acceleration", "displacement")


class InterfaceTable(NodesTable):
    """A 6-DOF frame; the first in the file is the root unless [reduction] says otherwise."""

    kind: Literal["node", "rbe2", "rbe3", "support"] | None = Field(
        None,
        description="one node, a frame tied rigidly to all nodes (rbe2), one that follows their mean motion (rbe3), or "
        "the frame of the [supports], without nodes of its own; default node for 'node' and 'near', else rbe2",
    )
    boundary: Literal["fixed", "free"] = Field(
        "fixed", description="fixed: constraint modes; free: moves with the modes"
    )

    def _needs_none(self) -> bool:
        return self.kind == "support"


class SupportTable(NodeSetTable):
    """Components of nodes that are held at the frame of the root interface."""

    set: str | None = Field(
        None, description="instead of nodes and components: a set of supports that the deck brings, such as spc_1"
    )
    components: str | None = Field(None, description="digits 1 to 6 that are held, such as '123'; default all")
    axes: Annotated[list[Vector], Field(min_length=2, max_length=2)] | None = Field(
        None, description="e1, and a direction in the plane of e1 and e2, of the components; default those of the mesh"
    )

    def _instead(self) -> tuple[str, ...]:
        return ("set",)


class FoundationTable(Table):
    """Springs under faces or along lines, whose other ends move with the frame of the root interface."""

    group: str = Field(description="mesh group of shells or beams, or of faces or lines on the nodes of other elements")
    stiffness_per_area: Bedding | Three[Bedding] | None = Field(
        None, description="of faces, N/m^3: along their normal; or a list along x, y, z of the mesh"
    )
    stiffness_per_length: LineStiffness | Three[LineStiffness] | None = Field(
        None, description="of lines, N/m^2: across them in every direction; or a list along x, y, z of the mesh"
    )


class AddedMassTable(Table):
    """Mass without stiffness on faces and lines, or fluid of constant depth on faces."""

    group: str = Field(description="mesh group of shells or beams, or of faces or lines on the nodes of other elements")
    mass_per_area: MassPerArea | None = Field(None, description="of faces, kg/m^2")
    mass_per_length: MassPerLength | None = Field(None, description="of lines, kg/m")
    fluid_density: Density | None = Field(
        None,
        description="of fluid on faces, kg/m^3, which moves with them along their normal and with the root along them",
    )
    depth: Length | None = Field(None, description="of the fluid, m")


class ConnectionTable(NodesTable):
    """A new node tied to others, in a group of the connection's name, for a mass, spring or beam."""

    kind: Literal["rbe2", "rbe3"] = Field(
        "rbe3", description="tied rigidly (rbe2), or following their mean motion (rbe3)"
    )
