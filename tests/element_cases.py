"""One distorted element of every family and formulation, on which second implementations are compared."""

from dataclasses import replace

import numpy as np
from structured import box, random_rotation

import modalprep as mp
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.point import SpringBlock
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.families import FAMILIES

METAL = mp.Material(E=1.0, nu=0.3, rho=1.0)
STIFF = mp.Material(E=3.0, nu=0.2, rho=0.5)
PLIES = tuple(mp.fe.Ply(material=m, thickness=0.05) for m in (METAL, STIFF))  # stretching bends it
BOX = mp.fe.beam_section("rectangle", METAL, width=0.2, height=0.1)
MODULI = {"E1": 3.0, "E2": 0.5, "E3": 0.2, "nu12": 0.3, "nu13": 0.4, "nu23": 0.4, "G12": 0.3, "G13": 0.2, "G23": 0.05}
WOOD = mp.fe.Orthotropic3D(**MODULI, rho=1.0)
TAPER = tuple(
    (x, f * BOX.A, f**3 * BOX.Iy, f * BOX.Iz, f**2 * BOX.J, 0.0) for x, f in ((0.0, 2.0), (0.4, 1.2), (1.0, 0.8))
)
ARMS = np.array([[[0.1, 0.2, 0.3], [0.0, -0.1, 0.4], [np.nan] * 3, [np.nan] * 3]])  # from two nodes of a shell to beams
DATA = {
    "reduced hexahedron20": {"free_faces": np.array([[1.0, 0.5, 0.0, 0.5, 1.0, 0.0]])},
    "beam on a hinge": {"pins": np.array([[0.0] * 10 + [1.0, 1.0]])},
    "quad under a beam": {"beam_arm": ARMS},
    "eccentric triangle under a beam": {"beam_arm": ARMS[:, :3]},
}
LINE = np.array([[0.0, 0, 0], [1.0, 0.2, -0.3]])
CURVED = np.array([[0.0, 0, 0.1], [1.0, 0.1, -0.1], [1.1, 0.9, 0.2], [0.5, 0, 0.1], [1.0, 0.5, 0.15], [0.5, 0.5, 0.2]])
BENT = np.vstack([LINE, [0.4, 0.2, -0.2]])
BOWL = np.array([[0.0, 0, 0.1], [1, 0.1, -0.1], [1.1, 0.9, 0.2], [-0.1, 1.0, -0.1], [0.5, 0, 0.1], [1.0, 0.5, 0.15],
                 [0.5, 1.0, 0.2], [0, 0.5, 0.15], [0.55, 0.45, 0.25]])  # fmt: skip
WARPED = np.array([[0.0, 0, 0.1], [1.0, 0.1, -0.1], [1.1, 0.9, 0.2], [-0.1, 1.0, -0.1]])


def line(family, section, points=LINE):
    return family, "line", points, np.array([[0, 1]]), section


def shell(kind, **section):
    section = mp.Shell(**({"material": METAL, "thickness": 0.1} | section))
    return ShellBlock, kind, WARPED, np.arange(4 if kind == "quad" else 3)[None], section


def tapered(family, kind, points, nodes, section):
    corners = 3 if kind.startswith("triangle") else 4
    return family, kind, points, nodes, section, {"thickness": np.linspace(0.08, 0.15, corners)[None]}


def curved(kind="triangle6", **section):
    section = mp.Shell(**({"material": METAL, "thickness": 0.1} | section))
    points = CURVED if kind == "triangle6" else BOWL[: int(kind[-1])]
    return CurvedShellBlock, kind, points, np.arange(len(points))[None], section


def solid(kind, **section):
    points, cells = box(kind, (1, 1, 1), distort=0.0)
    bent = points + 0.1 * np.sin(points[:, [1, 2, 0]] * 2)
    return SolidBlock, kind, bent[cells[0]], np.arange(cells.shape[1])[None], mp.Solid(**{"material": METAL} | section)


ELEMENTS = {
    "beam": line(BeamBlock, BOX),
    "eccentric beam": line(
        BeamBlock, mp.fe.beam_section("rectangle", METAL, width=0.2, height=0.1, offset=(0.1, -0.2))
    ),
    "tapered beam": line(BeamBlock, replace(BOX, taper=TAPER, offset=(0.1, 0.0))),
    "beam with a shear centre": line(BeamBlock, replace(BOX, shear_centre=(0.05, 0.1))),
    "beam on a hinge": line(BeamBlock, BOX),
    "beam of three nodes": (ThreeNodeBeamBlock, "line3", BENT, np.array([[0, 1, 2]]), BOX),
    "truss": line(TrussBlock, mp.Truss(material=METAL, A=0.1)),
    "truss with torque": line(TrussBlock, mp.Truss(material=METAL, A=0.1, J=0.02)),
    "spring": line(SpringBlock, mp.Spring(translation=(1.0, 2.0, 3.0), rotation=(0.4, 0.5, 0.6), location=0.3)),
    "quad": shell("quad"),
    "eccentric quad": shell("quad", offset=0.2),
    "laminated quad": shell("quad", material=None, thickness=0.0, plies=PLIES),
    "triangle": shell("triangle"),
    "quad under a beam": shell("quad"),
    "eccentric triangle under a beam": shell("triangle", offset=0.1),
    "triangle of constant strain": shell("triangle", membrane="cst"),
    "laminated triangle": shell("triangle", material=None, thickness=0.0, plies=PLIES, offset=-0.1),
    "curved triangle": curved(),
    "eccentric curved triangle": curved(offset=0.2),
    "laminated curved triangle": curved(material=None, thickness=0.0, plies=PLIES, offset=-0.1),
    **{kind: curved(kind) for kind in ("quad8", "quad9")},
    **{f"eccentric {kind}": curved(kind, offset=0.2) for kind in ("quad8", "quad9")},
    "laminated quad8": curved("quad8", material=None, thickness=0.0, plies=PLIES, offset=-0.1),
    "tapered quad": tapered(*shell("quad")),
    "tapered quad8": tapered(*curved("quad8", offset=0.05)),
    **{kind: solid(kind) for kind in FAMILIES[mp.Solid]},
    **{f"reduced {kind}": solid(kind, integration="reduced") for kind in ("hexahedron20", "wedge15")},
    "hexahedron20 of reduced stiffness": solid("hexahedron20", integration="reduced_stiffness"),
    **{
        f"{kind} of wood": solid(kind, material=WOOD, axes=((1, 2, 0), (0, 1, 3))) for kind in ("tetra10", "hexahedron")
    },
}


def built(name):
    family, kind, points, nodes, section, *data = ELEMENTS[name]
    given = data[0] if data else DATA.get(name, {})
    return family.build(kind, points @ random_rotation(3).T, nodes, section, given, np.zeros(3))
