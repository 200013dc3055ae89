"""A few named canonical models, shared by documentation, tests and benchmarks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.materials import Material
from modalprep.fe.properties.properties import Beam, Shell, Solid

if TYPE_CHECKING:
    from modalprep.fe.links.interface import Boundary


def beam_mesh(elements: int = 40, length: float = 10.0) -> Mesh:
    """Straight line of beam elements along x, groups ``beam``, ``root``, ``tip``."""
    points = np.zeros((elements + 1, 3))
    points[:, 0] = np.linspace(0, length, elements + 1)
    return Mesh(
        points=points,
        cells={
            "line": np.stack([np.arange(elements), np.arange(1, elements + 1)], axis=1),
            "vertex": np.array([[0], [elements]]),
        },
        groups={
            "beam": {"line": np.arange(elements)},
            "root": {"vertex": np.array([0])},
            "tip": {"vertex": np.array([1])},
        },
    )


def spinup_section(**changes: Any) -> Beam:
    """Return the section of the spin-up beam of Simo and Vu-Quoc (1986): EA 2.8e7, EI 1.4e4, GA 1e7, 1.2 kg/m.

    Bending is in the x-y plane; out of plane the beam is four times as stiff.
    """
    values: dict[str, Any] = {"A": 4e-4, "Iy": 8e-7, "Iz": 2e-7, "J": 5e-7, "ky": 1.0, "kz": 1.0} | changes
    return Beam(material=Material(E=7e10, nu=0.4, rho=3000.0), **values)


def cantilever_model(elements: int = 10, tip: Boundary = "free"):
    """Assemble the spin-up beam with interfaces ``root`` and ``tip`` (`tip` is its boundary)."""
    from modalprep.fe.assembly.assemble import assemble
    from modalprep.fe.links.interface import Interface

    ends = {
        "root": Interface(group="root", kind="node"),
        "tip": Interface(group="tip", kind="node", boundary=tip),
    }
    return assemble(beam_mesh(elements), {"beam": spinup_section()}, ends)


def block_model():
    """Return the model of a steel cube of 1 m, with sheets on two faces, a bar on one edge, and fixed at one corner.

    Its solid, shells and beam need every kernel of the assembly.

    Examples
    --------
    >>> block_model()  # doctest: +ELLIPSIS
    FEModel(8 nodes, 45 DOFs, m=7956.78 kg; interfaces root)
      warning: hidden hinge: ...
    """
    from modalprep.fe.assembly.assemble import assemble
    from modalprep.fe.links.interface import Interface

    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = Mesh(
        points=np.vstack([corners, corners + np.array([0, 0, 1])]),
        cells={
            "hexahedron": np.arange(8)[None],
            "quad": np.array([[4, 5, 6, 7]]),
            "triangle": np.array([[0, 1, 5], [0, 5, 4]]),
            "line": np.array([[2, 6]]),
            "vertex": np.zeros((1, 1), dtype=int),
        },
        groups={
            "cube": {"hexahedron": np.zeros(1, dtype=int)},
            "sheet": {"quad": np.zeros(1, dtype=int), "triangle": np.arange(2)},
            "edge": {"line": np.zeros(1, dtype=int)},
            "root": {"vertex": np.zeros(1, dtype=int)},
        },
    )
    steel = Material(E=2.1e11, nu=0.3, rho=7800.0)
    sections = {
        "cube": Solid(material=steel),
        "sheet": Shell(material=steel, thickness=0.01),
        "edge": Beam(material=steel, A=1e-4, Iy=1e-9, Iz=1e-9, J=2e-9, up=(1, 0, 0)),
    }
    return assemble(mesh, sections, {"root": Interface(group="root", kind="node")})


def small_systems():
    """Return the smallest system of every kind that the solver is compiled for: rigid or not, loops or not."""
    from modalprep.body.rigid import rigid_body
    from modalprep.multibody.model.constraints import Closure
    from modalprep.multibody.model.joint import Joint
    from modalprep.multibody.model.system import System

    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    rigid = rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3), interfaces=ends)
    hinge = Joint(name="hinge", type="revolute", parent="ground", child="rod")
    wire = Closure(name="wire", type="distance", a="ground", b="rod.tip", position=np.array([0, 2.0, 0]))
    return {
        f"{kind} bodies{loop}": System(bodies={"rod": body}, joints=(hinge,), closures=closures)
        for kind, body in (("rigid", rigid), ("flexible", uniform_beam(modes=1)))
        for loop, closures in ((" in trees", ()), (" in closed loops", (wire,)))
    }


def uniform_beam(modes: int = 3, elements: int = 40, **reduction: Any):
    """Return the modal body of the spin-up beam, clamped at its root."""
    from modalprep.body.build import flexible_body
    from modalprep.reduction.craig_bampton import craig_bampton

    model = cantilever_model(elements)
    reduction = {"truncation": ()} | reduction
    return flexible_body(model, craig_bampton(model, modes=modes, **reduction), name="beam")


def large_cantilever(modes: int = 4, stations: int = 16, elements: int = 40):
    """Return the body of `uniform_beam` with stations, for deflections up to its length (theory 4.10)."""
    from modalprep.body.build import flexible_body
    from modalprep.reduction.craig_bampton import craig_bampton

    model = cantilever_model(elements)
    reduction = craig_bampton(model, modes=modes, truncation=("interfaces", "derivatives"), derivatives=2)
    return flexible_body(model, reduction, name="beam", stations=stations)


def disc_sector(sectors: int = 8, around: int = 2, across: int = 3):
    """Return mesh, model and symmetry of a sector of a steel disc, 0.1 to 0.5 m, 10 mm thick, held at its bore.

    Examples
    --------
    >>> mesh, model, cyclic = disc_sector()
    >>> model
    FEModel(12 nodes, 78 DOFs, m=7.16383 kg; interfaces bore)
    """
    from modalprep.fe.assembly.assemble import assemble
    from modalprep.fe.links.interface import Interface
    from modalprep.fe.mesh.cyclic import CyclicSymmetry

    radius, angle = np.meshgrid(np.linspace(0.1, 0.5, across + 1), np.linspace(0, 2 * np.pi / sectors, around + 1))
    number = np.arange(radius.size).reshape(radius.shape)
    cells = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    mesh = Mesh(
        points=np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(radius)], axis=-1).reshape(
            -1, 3
        ),
        cells={"quad": np.stack(cells, axis=-1).reshape(-1, 4), "vertex": number[:, 0][:, None]},
        groups={"disc": {"quad": np.arange(around * across)}, "bore": {"vertex": np.arange(around + 1)}},
    )
    steel = Material(E=2.1e11, nu=0.3, rho=7800.0)
    model = assemble(mesh, {"disc": Shell(material=steel, thickness=0.01)}, {"bore": Interface(group="bore")})
    return mesh, model, CyclicSymmetry(sectors=sectors)


def disc_ring():
    """Return the model of the whole disc of `disc_sector`.

    Examples
    --------
    >>> disc_ring().dof.shape
    (65, 6)
    """
    from modalprep.fe.assembly.assemble import assemble
    from modalprep.fe.links.interface import Interface
    from modalprep.fe.links.ring import make_ring

    mesh, model, cyclic = disc_sector()
    ring = make_ring(mesh, cyclic, {"disc": model.elements.parts[0].section})
    return assemble(ring, {}, {"bore": Interface(group="bore")})
