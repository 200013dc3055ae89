"""Geometric stiffness against finite differences of the nonlinear strain energy: elements, links, masses on arms."""

from dataclasses import replace

import numpy as np
import pytest
from structured import box, random_rotation, surface

import modalprep as mp
from modalprep.body.verify import _third, check_geometric_stiffness
from modalprep.cli import main
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.point import SpringBlock
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.families import FAMILIES
from modalprep.fe.mesh.mesh import Link
from modalprep.vectors import skew

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
    return SolidBlock, kind, bent, cells[:1], mp.Solid(**{"material": METAL} | section)


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
    **{
        f"{kind} of wood": solid(kind, material=WOOD, axes=((1, 2, 0), (0, 1, 3))) for kind in ("tetra10", "hexahedron")
    },
}


def built(name):
    family, kind, points, nodes, section, *data = ELEMENTS[name]
    given = data[0] if data else DATA.get(name, {})
    return family.build(kind, points @ random_rotation(3).T, nodes, section, given, np.zeros(3))


def motions(block, seed):
    rng = np.random.default_rng(seed)
    return 0.003 * rng.standard_normal((2, len(block.nodes), block.nodes.shape[1] * block.components))


@pytest.mark.parametrize("name", ELEMENTS)
def test_geometric_stiffness_is_the_third_derivative_of_the_energy(name):
    block = built(name)
    for seed in range(3):
        d, y = motions(block, seed)
        own = np.einsum("ei,eij,ej->", y, block.geometric_stiffness(d), y)
        beside = 2 * np.einsum("ei,eij,ej->", d, block.geometric_stiffness(y), y)
        found = _third(lambda s, t, d=d, y=y: block.energy(s * d + t * y).sum())
        # steps of 0.003: the derivative of the fifth order is 1e-6 of that of the third
        assert own + beside == pytest.approx(found, abs=3e-6 * (abs(own) + abs(beside)))
        assert abs(own) > 1e-3 * abs(found)


@pytest.mark.parametrize("name", ELEMENTS)
def test_energy_does_not_change_as_the_element_turns(name):
    """To the third order, of which the geometric stiffness is made: nodes turn by R, ``x + u`` to ``R (x + u)``."""
    block, (_, _, points, nodes, *_) = built(name), ELEMENTS[name]
    points, n = (points @ random_rotation(3).T)[nodes], nodes.shape[1]
    d = motions(block, 0)[0].reshape(len(nodes), n, block.components)
    axis, size = np.array([0.6, -0.3, 0.5]), 1e-2
    gaps = []
    for turn in (size, size / 2):
        w = turn * axis
        R = np.eye(3) + skew(w) + skew(w) @ skew(w) / 2
        moved = (turn / size) * d
        still = moved.copy()
        moved = moved.copy()
        moved[..., :3] = (points + still[..., :3]) @ R.T - points
        if block.components == 6:  # R exp(t) to second order
            moved[..., 3:] = still[..., 3:] + w + np.cross(w, still[..., 3:]) / 2
        gaps.append(sum(block.energy(x.reshape(len(x), -1)).sum() * sign for x, sign in ((moved, 1), (still, -1))))
    assert abs(gaps[0]) < 1e-12 or np.log2(gaps[0] / gaps[1]) > 3.7  # the fourth order, and no energy below it


def mast(links=(), extra=(), section=None, **masses):
    """A bent cantilever of 12 beams in the mesh axes, its tip with masses and links to the `extra` points."""
    s = np.linspace(0, 1, 13)
    points = np.vstack([np.stack([s, 0.3 * s**2, 0.2 * s**3], axis=1), *extra])
    vertices = np.concatenate([[0, 12], np.arange(13, len(points))]).astype(int)
    groups = {"beam": {"line": np.arange(12)}, "root": {"vertex": [0]}, "tip": {"vertex": [1]}}
    groups |= {"ends": {"vertex": np.arange(2, len(vertices))}} if len(extra) else {}
    cells = {"line": np.stack([np.arange(12), np.arange(1, 13)], axis=1), "vertex": vertices[:, None]}
    mesh = mp.fe.Mesh(points=points, cells=cells, groups=groups, links=tuple(links))
    section = section or mp.fe.beam_section(
        "rectangle", STIFF, width=0.06, height=0.03, up=(0, 0, 1), offset=(0.02, 0.01)
    )
    ends = {"root": mp.Interface(group="root", kind="node")}
    return mp.assemble(mesh, {"beam": section} | masses, ends)


def panel(tip, depth=0.2, faces=False):
    """A strip of quads bent to an arch and twisted, whose tip of a depth is held by a frame of that kind."""
    points, cells = surface(8, 3, "quad", lambda s, t: (
        np.sin(s), (t - 0.5) * 0.3 * np.cos(s), 1 - np.cos(s) + (t - 0.5) * 0.3 * np.sin(s)))  # fmt: skip
    ends = {
        "root": np.flatnonzero(points[:, 0] < 1e-9),
        "tip": np.flatnonzero(points[:, 0] > points[:, 0].max() - depth),
    }
    groups = {"skin": {"quad": np.arange(len(cells))}}
    groups |= {"root": {"vertex": np.arange(4)}, "tip": {"vertex": 4 + np.arange(len(ends["tip"]))}}
    groups |= {"tip": {"quad": np.flatnonzero(np.isin(cells, ends["tip"]).all(axis=1))}} if faces else {}
    vertices = np.concatenate(list(ends.values()))[:, None]
    mesh = mp.fe.Mesh(points=points, cells={"quad": cells, "vertex": vertices}, groups=groups)
    held = {"root": mp.Interface(group="root"), "tip": mp.Interface(group="tip", kind=tip, boundary="free")}
    return mp.assemble(mesh, {"skin": mp.Shell(material=METAL, thickness=0.02, offset=0.01)}, held)


def guided():
    """A bent mast whose tip guides the end of a second one: rigid in two directions off the axes of the mesh."""
    s = np.linspace(0, 1, 9)
    first = np.stack([s, 0.3 * s**2, 0.2 * s**3], axis=1)
    points = np.vstack([first, first[1:] @ np.diag([1.0, -1.4, 2.0])])
    lines = np.array([[k, k + 1] for k in range(8)] + [[0, 9]] + [[k, k + 1] for k in range(9, 16)])
    components = np.array([1, 0, 1, 0, 1, 0], dtype=bool)
    link = Link(kind="rbe2", node=8, nodes=np.array([16]), components=components, axes=random_rotation(8)[None])
    groups = {"beam": {"line": np.arange(16)}, "root": {"vertex": np.array([0])}}
    mesh = mp.fe.Mesh(points=points, cells={"line": lines, "vertex": np.array([[0]])}, groups=groups, links=(link,))
    section = mp.fe.beam_section("rectangle", STIFF, width=0.06, height=0.03, up=(0, 0, 1))
    return mp.assemble(mesh, {"beam": section}, {"root": mp.Interface(group="root", kind="node")})


ARMS = (np.array([[1.1, 0.5, 0.2]]), np.array([[0.9, 0.1, 0.4]]), np.array([[1.0, 0.4, -0.2]]))
MODELS = {
    "eccentric beams": mast,
    "inertia and offset": lambda: mast(
        tip=mp.PointMass(mass=0.01, inertia=(1e-3, 2e-3, 2.5e-3, 2e-4, -1e-4, 3e-4), offset=(0.1, 0.05, -0.1))
    ),
    "masses on rigid arms": lambda: mast(
        [Link(kind="rbe2", node=12, nodes=np.arange(13, 16))], ARMS, ends=mp.PointMass(mass=0.01)
    ),
    "an end guided in oblique directions": guided,
    "skin on a rigid frame": lambda: panel("rbe2"),
    "skin on a mean frame": lambda: panel("rbe3"),
    "skin on the mean of some faces": lambda: panel("rbe3", 0.4, faces=True),
    "skin on the mean of its straight edge": lambda: panel("rbe3", 1e-6),
}


def sound(name):
    model = MODELS[name]()
    reduction = mp.craig_bampton(model, modes=8, truncation=())
    return model, reduction, mp.flexible_body(model, reduction, name="body")


@pytest.mark.parametrize("name", MODELS)
def test_geometric_stiffness_of_a_body_is_that_of_the_energy(name):
    model, reduction, body = sound(name)
    (check,) = check_geometric_stiffness(model, reduction, body)
    assert check.within, check
    for array in ("Kg_A", "Kg_W", "Kg_F"):
        value = getattr(body, array)
        if np.any(value):
            (check,) = check_geometric_stiffness(model, reduction, body.with_(**{array: 1.1 * value}, T=None))
            assert not check.within, array


def test_mass_on_the_mean_of_nodes():
    """An rbe3 that carries a mass with offset: its frame turns as its nodes do, to second order."""
    model = panel("rbe3")
    free = mp.craig_bampton(model, modes=8, truncation=())
    link = model.geometric_stiffness.links.constraints.links[1]
    turn = 1e-3 * np.array([0.3, -0.5, 0.4])
    d = np.zeros(model.n_dof)
    R = np.eye(3) + skew(turn) + skew(turn) @ skew(turn) / 2
    d[link.dofs[:, :3]] = link.arm @ (R - np.eye(3)).T
    np.testing.assert_allclose(link._fitted(d)[3:], turn, atol=1e-8)  # the third order of R
    assert free.basis.shape[1] == 8


def test_check_command_compares_with_the_energy(project, capsys):
    assert main(["check", str(project / "pipelines" / "half-beam.toml"), "--energy"]) == 0
    assert "energy of second order" in capsys.readouterr().out


def test_a_modal_file_has_no_energy_to_compare_with(tmp_path, capsys):
    from modalprep.examples import uniform_beam

    file = mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    assert main(["check", str(file), "--energy"]) == 2
    assert "no mesh" in capsys.readouterr().err
