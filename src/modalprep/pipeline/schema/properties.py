"""What a pipeline file may say of materials and of the properties of mesh groups: one table for each family."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from modalprep.applies import Rule
from modalprep.errors import InputError
from modalprep.fe.properties.materials import Anisotropic, Material, Orthotropic, Orthotropic3D
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.properties.properties import Beam, Ply, Shell, Solid, Truss
from modalprep.fe.properties.sections import beam_section
from modalprep.pipeline.schema.base import Table, Vector, triple
from modalprep.pipeline.schema.quantities import (
    Angle,
    Area,
    Damping,
    Density,
    Inertia,
    Length,
    Mass,
    MassPerArea,
    MassPerLength,
    RotationalDamping,
    RotationalStiffness,
    SecondMoment,
    Stiffness,
    Stress,
    Three,
)
from modalprep.suggest import refuse_unknown

Materials = Mapping[str, Material | Orthotropic | Orthotropic3D | Anisotropic]


class MaterialTable(Table):
    """An isotropic material, SI."""

    type: Literal["isotropic"] = "isotropic"
    E: Stress = Field(description="Young's modulus, Pa")
    nu: float = Field(description="Poisson's ratio")
    rho: Density = Field(description="density, kg/m^3")

    def build(self) -> Material:
        """Return the material in SI."""
        return Material(**self.model_dump(exclude={"type"}))


class OrthotropicTable(Table):
    """A lamina, SI; for shells and their plies."""

    type: Literal["orthotropic"]
    E1: Stress = Field(description="Young's modulus along the fibre, Pa")
    E2: Stress = Field(description="across the fibre, Pa")
    nu12: float = Field(description="contraction along 2 under tension along 1")
    G12: Stress = Field(description="shear modulus in the plane, Pa")
    G13: Stress = Field(description="transverse shear modulus along 1, Pa")
    G23: Stress = Field(description="transverse shear modulus along 2, Pa")
    rho: Density = Field(description="density, kg/m^3")

    def build(self) -> Orthotropic:
        """Return the material in SI."""
        return Orthotropic(**self.model_dump(exclude={"type"}))


class OrthotropicSolidTable(Table):
    """An orthotropic material of solids, SI."""

    type: Literal["orthotropic_solid"]
    E1: Stress = Field(description="Young's modulus along axis 1, Pa")
    E2: Stress = Field(description="along axis 2, Pa")
    E3: Stress = Field(description="along axis 3, Pa")
    nu12: float = Field(description="contraction along 2 under tension along 1")
    nu13: float = Field(description="contraction along 3 under tension along 1")
    nu23: float = Field(description="contraction along 3 under tension along 2")
    G12: Stress = Field(description="shear modulus, Pa")
    G13: Stress = Field(description="shear modulus, Pa")
    G23: Stress = Field(description="shear modulus, Pa")
    rho: Density = Field(description="density, kg/m^3")

    def build(self) -> Orthotropic3D:
        """Return the material in SI."""
        return Orthotropic3D(**self.model_dump(exclude={"type"}))


class AnisotropicTable(Table):
    """An anisotropic material of solids, SI."""

    type: Literal["anisotropic"]
    C: Annotated[list[Stress], Field(min_length=21, max_length=21)] = Field(
        description="upper triangle of the moduli, row by row, of strains 11, 22, 33, 12, 23, 13, Pa"
    )
    rho: Density = Field(description="density, kg/m^3")

    def build(self) -> Anisotropic:
        """Return the material in SI."""
        return Anisotropic(C=tuple(self.C), rho=self.rho)


def _material_type(table: Any) -> str:
    return str(table.get("type", "isotropic")) if isinstance(table, dict) else getattr(table, "type", "isotropic")


AnyMaterial = Annotated[
    Annotated[MaterialTable, Tag("isotropic")]
    | Annotated[OrthotropicTable, Tag("orthotropic")]
    | Annotated[OrthotropicSolidTable, Tag("orthotropic_solid")]
    | Annotated[AnisotropicTable, Tag("anisotropic")],
    Discriminator(
        _material_type,
        custom_error_type="material_type",
        custom_error_message="type of a material is 'isotropic' (the default), 'orthotropic' (shells), "
        "'orthotropic_solid' or 'anisotropic'",
    ),
]


ONLY = {
    Orthotropic: "orthotropic: only shells and plies",
    Orthotropic3D: "orthotropic in three directions: only solids",
    Anisotropic: "anisotropic: only solids",
}


def find_material(name: str, materials: Materials, kinds: tuple[type, ...]) -> Any:
    """Return the material of that name; refuse one that is not there or not of the `kinds`."""
    refuse_unknown(name, materials, "material")
    if not isinstance(materials[name], kinds):
        raise InputError(f"material {name!r} is {ONLY[type(materials[name])]} can be made of it")
    return materials[name]


class ShapeTable(Table):
    """A standard section; height lies along 'up'. Sizes in m."""

    shape: Literal["rectangle", "rod", "tube", "box", "i"]
    width: Length | None = None
    height: Length | None = None
    diameter: Length | None = None
    thickness: Length | None = Field(None, description="of the wall")
    flange: Length | None = Field(None, description="thickness of the flanges")
    web: Length | None = Field(None, description="thickness of the web")


class BeamTable(Table):
    """Section of a group of line cells, SI: `section`, or A, Iy, Iz and J."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("ky", "kz"), needs=("theory",), among=("timoshenko",)),
        Rule(("nsm",), beside=("taper",), advice="the last number of each row of the taper is the further mass there"),
    )

    type: Literal["beam"]
    material: str
    section: ShapeTable | None = Field(None, description="a standard shape instead of A, Iy, Iz, J, ky, kz")
    A: Area | None = Field(None, description="area, m^2")
    Iy: SecondMoment | None = Field(None, description="second moment of area about e2 (bending towards 'up'), m^4")
    Iz: SecondMoment | None = Field(None, description="second moment of area about e3, m^4")
    J: SecondMoment | None = Field(None, description="torsion constant, m^4")
    ky: float | None = Field(None, description="shear factor along e2; default 5/6")
    kz: float | None = Field(None, description="shear factor along e3; default 5/6")
    up: Vector = Field([0.0, 0.0, 1.0], description="direction that e3 points to")
    offset: Annotated[list[Length], Field(min_length=2, max_length=2)] = Field(
        [0.0, 0.0], description="of the centroid from the nodes along e2 and e3, m"
    )
    nsm: MassPerLength = Field(0.0, ge=0, description="further mass, kg/m")
    theory: Literal["timoshenko", "euler-bernoulli"] = "timoshenko"
    shear_centre: Annotated[list[Length], Field(min_length=2, max_length=2)] = Field(
        [0.0, 0.0], description="from the centroid along e2 and e3, m"
    )
    taper: list[Annotated[list[float], Field(min_length=6, max_length=6)]] = Field(
        [],
        description="sections along each element: position from 0 to 1, A, Iy, Iz, J and nsm; linear in between",
    )

    @model_validator(mode="after")
    def _one_section(self) -> BeamTable:
        given = [name for name in ("A", "Iy", "Iz", "J", "ky", "kz") if getattr(self, name) is not None]
        if self.section is not None and given:
            raise ValueError(f"a beam needs either 'section' or numbers; this one has both ({', '.join(given)})")
        missing = [name for name in ("A", "Iy", "Iz", "J") if getattr(self, name) is None]
        if self.section is None and missing:
            raise ValueError(f"a beam needs {', '.join(missing)}, or a 'section' with a shape")
        return self

    def build(self, materials: Materials) -> Beam:
        """Return the property in SI."""
        material = find_material(self.material, materials, (Material,))
        more: dict[str, Any] = {
            "offset": tuple(self.offset),
            "nsm": self.nsm,
            "shear_centre": tuple(self.shear_centre),
        }
        more["taper"] = tuple(tuple(row) for row in self.taper)
        if self.section is not None:
            sizes = self.section.model_dump(exclude={"shape"}, exclude_none=True)
            return beam_section(self.section.shape, material, up=triple(self.up), theory=self.theory, **sizes, **more)
        values = self.model_dump(include={"A", "Iy", "Iz", "J", "ky", "kz"}, exclude_none=True)
        return Beam(material=material, up=triple(self.up), theory=self.theory, **values, **more)


class TrussTable(Table):
    """Bars of a group of line cells."""

    type: Literal["truss"]
    material: str
    A: Area = Field(description="area, m^2")
    J: SecondMoment = Field(0.0, ge=0, description="torsion constant, m^4; 0: no rotations")
    nsm: MassPerLength = Field(0.0, ge=0, description="further mass, kg/m")

    def build(self, materials: Materials) -> Truss:
        """Return the property in SI."""
        values = self.model_dump(include={"A", "J", "nsm"})
        return Truss(material=find_material(self.material, materials, (Material,)), **values)


class PlyTable(Table):
    """A layer, from the bottom up."""

    material: str
    thickness: Length = Field(description="m")
    angle: Angle = Field(0.0, description="from the shell's axis 1")


class ShellTable(Table):
    """Sheet or laminate of a group of triangles and quads."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("material", "thickness"), beside=("plies",), advice="each ply has its own; leave it out"),
        Rule(("symmetric",), needs=("plies",)),
    )

    type: Literal["shell"]
    material: str | None = None
    thickness: Length | None = Field(None, description="m")
    plies: list[PlyTable] = Field([], description="instead of material and thickness, from the bottom (-normal) up")
    symmetric: bool = Field(False, description="the plies are the lower half, mirrored above")
    offset: Length = Field(0.0, description="of the mid-surface from the nodes along the normal, m")
    nsm: MassPerArea = Field(0.0, ge=0, description="further mass, kg/m^2")
    axis: Vector | None = Field(None, description="its projection is material axis 1; default the first side")
    angle: Angle = Field(0.0, description="from that to axis 1")
    membrane: Literal["opt", "cst"] = Field("opt", description="of triangles: optimal, or constant strain")

    @model_validator(mode="after")
    def _one_sheet(self) -> ShellTable:
        if bool(self.plies) == (self.material is not None and self.thickness is not None):
            raise ValueError("a shell needs either 'material' and 'thickness', or 'plies'")
        return self

    def build(self, materials: Materials) -> Shell:
        """Return the property in SI."""
        kinds = (Material, Orthotropic)
        values = self.model_dump(include={"offset", "nsm", "angle", "membrane"})
        values["axis"] = None if self.axis is None else tuple(self.axis)
        if self.material is not None and self.thickness is not None:
            return Shell(material=find_material(self.material, materials, kinds), thickness=self.thickness, **values)
        plies = [
            Ply(material=find_material(ply.material, materials, kinds), thickness=ply.thickness, angle=ply.angle)
            for ply in self.plies
        ]
        return Shell(plies=tuple(plies + plies[::-1] if self.symmetric else plies), **values)


class SolidTable(Table):
    """Material of a group of tetrahedra, wedges or hexahedra."""

    type: Literal["solid"]
    material: str
    axes: Annotated[list[Vector], Field(min_length=2, max_length=2)] | None = Field(
        None, description="e1, and a direction in the plane of e1 and e2, of the material; default those of the mesh"
    )
    integration: Literal["full", "reduced_stiffness", "reduced"] | None = Field(
        None,
        description="of hexahedra of 20 nodes: 3 x 3 x 3 points, or 2 x 2 x 2 of the stiffness, or of stiffness and "
        "mass, which suit thin curved walls; default what the mesh file says, else full",
    )

    def build(self, materials: Materials) -> Solid:
        """Return the property in SI."""
        axes = None if self.axes is None else (triple(self.axes[0]), triple(self.axes[1]))
        kinds = (Material, Orthotropic3D, Anisotropic)
        material = find_material(self.material, materials, kinds)
        return Solid(material=material, axes=axes, integration=self.integration)


class MassTable(Table):
    """Rigid mass at each node of a group of points or at the node of a connection."""

    type: Literal["mass"]
    mass: Mass = Field(ge=0, description="kg")
    inertia: Annotated[list[Inertia], Field(min_length=6, max_length=6)] = Field(
        [0.0] * 6, description="xx, yy, zz, xy, xz, yz of the inertia tensor about the mass centre, kg m^2"
    )
    offset: Three[Length] = Field([0.0, 0.0, 0.0], description="from the node to the mass centre, m")

    def build(self, materials: Materials) -> PointMass:
        """Return the property in SI."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return PointMass(mass=self.mass, inertia=(xx, yy, zz, xy, xz, yz), offset=triple(self.offset))


class SpringTable(Table):
    """Springs and dampers of a group of lines (between two nodes) or of points (to the ground)."""

    type: Literal["spring"]
    translation: Three[Stiffness] = Field([0.0, 0.0, 0.0], description="along e1, e2, e3, N/m")
    rotation: Three[RotationalStiffness] = Field([0.0, 0.0, 0.0], description="about e1, e2, e3, N m/rad")
    up: Vector = Field([0.0, 0.0, 1.0], description="direction that e3 points to")
    location: float = Field(0.5, ge=0, le=1, description="of the elastic centre from the first node to the second")
    translation_damping: Three[Damping] = Field([0.0, 0.0, 0.0], description="along e1, e2, e3, N s/m")
    rotation_damping: Three[RotationalDamping] = Field([0.0, 0.0, 0.0], description="about e1, e2, e3, N m s/rad")

    def build(self, materials: Materials) -> Spring:
        """Return the property in SI."""
        return Spring(
            translation=triple(self.translation),
            rotation=triple(self.rotation),
            up=triple(self.up),
            location=self.location,
            translation_damping=triple(self.translation_damping),
            rotation_damping=triple(self.rotation_damping),
        )


Section = Annotated[
    BeamTable | TrussTable | ShellTable | SolidTable | MassTable | SpringTable, Field(discriminator="type")
]
