"""Ansys input files: every command and element of the registry in a small deck, with numbers in closed form."""

import numpy as np
import pytest
import shared_data
from analytic import cantilever_frequency
from fe.ansys_decks import SHEET, STEEL, UNIT_CUBE, beam_line, bricks, deck, eblock, nblock
from scipy.spatial import cKDTree

import modalprep as mp
from modalprep.fe.external.files import read_matrices
from modalprep.fe.mesh.cells import CELLS
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp

DATA = shared_data.DATA / "ansys"
real = pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)")


@pytest.fixture
def read(tmp_path):
    def from_lines(*lines, length="m", mass="kg"):
        return mp.read_mesh(deck(tmp_path, lines), length, mass)

    return from_lines


def frequencies(mesh, count=3, **interface):
    model = mp.assemble(mesh, {}, {"root": mp.Interface(**interface)})
    held = clamp(model)
    return np.sqrt(lowest_modes(held.K_ii, held.M_ii, count, factor=held.factor)[0]) / (2 * np.pi)


def bending(EI, rho_A):
    """First frequency (Hz) of a cantilever of 1 m."""
    return cantilever_frequency(1, EI, rho_A, 1.0)[0] / (2 * np.pi)


@pytest.mark.parametrize(("unit", "mass", "E", "rho"), [("m", "kg", 2.1e11, 7800.0), ("mm", "t", 2.1e5, 7.8e-9)])
def test_brick_of_unit_size_has_the_mass_of_its_material(read, unit, mass, E, rho):
    mesh = read("ET,1,185", f"MP,EX,1,{E}", f"MP,DENS,1,{rho}", "MP,PRXY,1,.3", *nblock(UNIT_CUBE),
                *eblock(range(1, 9)), length=unit, mass=mass)  # fmt: skip
    size = {"m": 1.0, "mm": 1e-3}[unit]
    model = mp.assemble(mesh, {}, {"root": mp.Interface(group="type1_mat1")})
    assert model.rigid.m == pytest.approx(7800 * size**3, rel=1e-12)
    assert mesh.properties["type1_mat1"].material.E == pytest.approx(2.1e11)


DEGENERATE = {  # corners of a brick that coincide, and the volume that is left of the unit cube
    "wedge": ((1, 2, 3, 3, 5, 6, 7, 7), 1 / 2),
    "tetra": ((1, 2, 3, 3, 5, 5, 5, 5), 1 / 6),
}


@pytest.mark.parametrize(("kind", "nodes", "volume"), [(k, *v) for k, v in DEGENERATE.items()])
@pytest.mark.parametrize("element", [185, 45])
def test_degenerate_bricks(read, element, kind, nodes, volume):
    mesh = read(f"ET,1,{element}", *STEEL, *nblock(UNIT_CUBE), *eblock(nodes))
    assert list(mesh.cells) == [kind]
    model = mp.assemble(mesh, {}, {"root": mp.Interface(group="type1_mat1")})
    assert model.rigid.m == pytest.approx(7800 * volume, rel=1e-12)


def middles(corners, pairs):
    corners = np.array(corners, dtype=float)
    return [tuple(corners[[a - 1, b - 1]].mean(axis=0)) for a, b in pairs]


# Edges I-J, J-K, K-L, L-I, M-N, N-O, O-P, P-M, I-M, J-N, K-O, L-P of SOLID186 in Ansys' help, figure 186.1.
EDGES = [(1, 2), (2, 3), (3, 4), (4, 1), (5, 6), (6, 7), (7, 8), (8, 5), (1, 5), (2, 6), (3, 7), (4, 8)]


CORNERS = {
    "hexahedron20": (1, 2, 3, 4, 5, 6, 7, 8),
    "wedge15": (1, 2, 3, 3, 5, 6, 7, 7),
    "pyramid13": (1, 2, 3, 4, 5, 5, 5, 5),
    "tetra10": (1, 2, 3, 3, 5, 5, 5, 5),
}


@pytest.mark.parametrize("kind", CORNERS)
@pytest.mark.parametrize("element", [186, 95])
def test_mid_side_nodes_of_quadratic_bricks_lie_in_the_middle_of_their_edges(read, element, kind):
    corners = CORNERS[kind]
    pairs = [tuple(sorted((corners[a - 1], corners[b - 1]))) for a, b in EDGES]
    own = sorted({p for p in pairs if p[0] != p[1]})
    label = {pair: 9 + k for k, pair in enumerate(own)} | {(c, c): c for c in corners}
    mesh = read(f"ET,1,{element}", *nblock(UNIT_CUBE + middles(UNIT_CUBE, own)),
                *eblock([*corners, *(label[pair] for pair in pairs)]))  # fmt: skip
    [nodes] = mesh.cells[kind]
    edges = CELLS[kind].edges
    first = len(nodes) - len(edges)
    np.testing.assert_allclose(mesh.points[nodes[first:]], mesh.points[nodes[edges]].mean(axis=1), atol=1e-13)


@pytest.mark.parametrize(("element", "count", "kind"), [(187, 10, "tetra10"), (92, 10, "tetra10"), (285, 4, "tetra")])
def test_tetrahedra(read, element, count, kind):
    corners = [UNIT_CUBE[k] for k in (0, 1, 3, 4)]
    edges = middles(corners, [(1, 2), (2, 3), (3, 1), (1, 4), (2, 4), (3, 4)])
    mesh = read(f"ET,1,{element}", *STEEL, *nblock((corners + edges)[:count]), *eblock(range(1, count + 1)))
    assert list(mesh.cells) == [kind]
    model = mp.assemble(mesh, {}, {"root": mp.Interface(group="type1_mat1")})
    assert model.rigid.m == pytest.approx(7800 / 6, rel=1e-12)


def test_bricks_bend_like_a_beam(read):
    """Closed form of a slender cantilever: bricks with incompatible modes are within a percent of it."""
    mesh = read("ET,1,185", *STEEL, *bricks(40, 0.01, 0.02, 1.0), "CMBLOCK,ROOT    ,NODE,       4", "(8i10)",
                "         1        -4")  # fmt: skip
    expected = bending(2.1e11 * 0.02 * 0.01**3 / 12, 7800 * 0.01 * 0.02)
    assert frequencies(mesh, group="ROOT")[0] == pytest.approx(expected, rel=0.02)


SECTIONS = {  # SECTYPE and SECDATA; bending stiffness over E about y (bending along z), and about z; area
    "RECT": ("0.02,0.03", 0.02 * 0.03**3 / 12, 0.03 * 0.02**3 / 12, 0.02 * 0.03),
    "CSOLID": ("0.01,8", np.pi / 4 * 0.01**4, np.pi / 4 * 0.01**4, np.pi * 0.01**2),
    "CTUBE": ("0.008,0.01,8", np.pi / 4 * (1e-8 - 4.096e-9), np.pi / 4 * (1e-8 - 4.096e-9), np.pi * 3.6e-5),
    "HREC": ("0.02,0.03,.002,.002,.002,.002", (0.02 * 0.03**3 - 0.016 * 0.026**3) / 12,
             (0.03 * 0.02**3 - 0.026 * 0.016**3) / 12, 0.02 * 0.03 - 0.016 * 0.026),
    "ASEC": ("6e-4,4.5e-8,0,2e-8,0,4.7e-8", 4.5e-8, 2e-8, 6e-4),
}  # fmt: skip


@pytest.mark.parametrize("element", [188, 189])
@pytest.mark.parametrize("shape", SECTIONS)
def test_beams_bend_about_both_axes(read, element, shape):
    """The node of orientation lies along z: two cantilever frequencies in closed form (rotary inertia: 2e-3)."""
    sizes, Iy, Iz, A = SECTIONS[shape]
    pieces = [(k, k + 1, 22) if element == 188 else (k, k + 2, k + 1, 22) for k in range(1, 21, 1 + (element == 189))]
    mesh = read(f"ET,1,{element}", *STEEL, f"SECTYPE,1,BEAM,{shape},a,0", f"SECDATA,{sizes}", "SECOFFSET,CENT",
                *beam_line(20, 1.0), *eblock(*pieces))  # fmt: skip
    found = frequencies(mesh, 2, node=1, kind="node")
    expected = sorted(bending(2.1e11 * x, 7800 * A) for x in (Iy, Iz))
    np.testing.assert_allclose(found, expected, rtol=3e-3)
    stiffer = np.array(mesh.data["up"]["line" if element == 188 else "line3"][0])
    np.testing.assert_allclose(stiffer / np.linalg.norm(stiffer), [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(("end", "y"), [((1, 0, 0), (0, 1, 0)), ((0, 0, 1), (0, 1, 0)), ((0, 0, -1), (0, 1, 0)),
                                        ((0, 1, 1), (-1, 0, 0))])  # fmt: skip
def test_beams_without_orientation_node(read, end, y):
    """Ansys' help of BEAM188: y lies parallel to the global x-y plane, along the global y axis for vertical beams."""
    mesh = read("ET,1,188", *STEEL, "SECTYPE,1,BEAM,RECT", "SECDATA,.02,.03", *nblock([(0, 0, 0), end]),
                *eblock((1, 2, 0)))  # fmt: skip
    axis = np.array(end, dtype=float)
    found = np.cross(mesh.data["up"]["line"][0], axis)
    np.testing.assert_allclose(found / np.linalg.norm(found), y, atol=1e-12)


def test_beam4_by_its_real_constants(read):
    """AREA, IZZ, IYY, TKZ, TKY, THETA: with THETA = 90 the two bending axes change places."""
    found = []
    for theta in (0, 90):
        mesh = read("ET,1,4", *STEEL, f"R,1,6e-4,2e-8,4.5e-8,0.03,0.02,{theta}", "RMORE,0,4.7e-8", *beam_line(20, 1.0),
                    *eblock(*[(k, k + 1, 22) for k in range(1, 21)]))  # fmt: skip
        up = mesh.data["up"]["line"][0]
        found.append(up / np.linalg.norm(up))
        f = frequencies(mesh, 2, node=1, kind="node")
        expected = [bending(2.1e11 * x, 7800 * 6e-4) for x in (2e-8, 4.5e-8)]
        np.testing.assert_allclose(f, expected, rtol=1e-3)
    np.testing.assert_allclose(found, [[0, 0, 1], [0, -1, 0]], atol=1e-12)


@pytest.mark.parametrize(("lines", "area"), [
    (["ET,1,180", "SECTYPE,1,LINK,,bar", "SECDATA,3e-4"], 3e-4),
    (["ET,1,LINK180", "R,1,3e-4,0.5"], 3e-4),
    (["ET,1,8", "R,1,3e-4,0.5"], 3e-4),
])  # fmt: skip
def test_links(read, lines, area):
    mesh = read(*lines, *STEEL, *nblock([(0, 0, 0), (2, 0, 0)]), *eblock((1, 2)))
    [truss] = mesh.properties.values()
    assert truss.A == area
    assert truss.nsm == (0.5 if lines[0].endswith("LINK180") else 0.0)  # LINK8: the second is the initial strain


def test_masses_and_springs(read):
    """Two masses on a spring: the frequency of their relative motion is sqrt(k (1/m1 + 1/m2))."""
    mesh = read("ET,1,21", "ET,2,14", "KEYOPT,1,3,2", "R,1,2.0", "R,2,3.0", "R,3,1e6,5,7", *STEEL, "ET,3,180",
                "R,4,1e-6", *nblock([(0, 0, 0), (1, 0, 0), (2, 0, 0)]), *eblock((1,), real=1),
                *eblock((2,), real=2, first=2), *eblock((1, 2), kind=2, real=3, first=3),
                *eblock((2, 3), kind=3, real=4, section=0, first=4))  # fmt: skip
    spring = mesh.properties["type2_real3"]
    assert spring.translation == (1e6, 0.0, 0.0)
    assert spring.translation_damping == (5.0, 0.0, 0.0)
    assert (mesh.properties["type1_real1"].mass, mesh.properties["type1_real2"].mass) == (2.0, 3.0)
    assert any("damping by the square of the speed (CV2)" in note for note in mesh.notes)


def test_rotary_inertia_and_a_spring_in_one_component(read):
    mesh = read("ET,1,21", "ET,2,14", "KEYOPT,2,2,5", "R,1,2,2,2,.1,.2,.3", "R,3,1e3", *STEEL, "ET,3,180", "R,4,1e-6",
                *nblock([(0, 0, 0), (0, 0, 0), (2, 0, 0)]), *eblock((1,), real=1),
                *eblock((1, 2), kind=2, real=3, first=3), *eblock((2, 3), kind=3, real=4, section=0, first=4),
                length="mm", mass="t")  # fmt: skip
    assert mesh.properties["type1_real1"].inertia[:3] == pytest.approx((1e-4, 2e-4, 3e-4))
    assert mesh.properties["type2_real3"].rotation == pytest.approx((0.0, 1e3 * 1e3 * 1e-6, 0.0))  # N mm to N m
    np.testing.assert_array_equal(mesh.data["frame"]["line"][0], np.eye(3))


@pytest.mark.parametrize(("place", "offset"), [("MID", 0.0), ("TOP", -0.01), ("BOT", 0.01), ("USER,0.004", -0.004)])
def test_shells_with_offset(read, place, offset):
    mesh = read("ET,1,181", *STEEL, "SECTYPE,1,SHELL,,skin", "SECDATA,0.02,1,0.0,3", f"SECOFFSET,{place}",
                *nblock(SHEET),
                *eblock((1, 2, 3, 4)))  # fmt: skip
    shell = mesh.properties["type1_mat1_sec1"]
    assert (shell.thickness, shell.offset) == (0.02, pytest.approx(offset))


def test_triangles_of_shell181(read):
    mesh = read(
        "ET,1,181", *STEEL, "SECTYPE,1,SHELL", "SECBLOCK,1", "0.02,1,0.0,3", *nblock(SHEET), *eblock((1, 2, 3, 3))
    )
    assert list(mesh.cells) == ["triangle"]
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    assert model.rigid.m == pytest.approx(7800 * 0.02 / 2, rel=1e-12)


def test_layers_of_a_shell_with_their_materials_and_axes(read):
    mesh = read("ET,1,SHELL181", *STEEL, "MP,EX,2,140e9", "MP,EY,2,10e9", "MP,PRXY,2,.3", "MP,GXY,2,5e9",
                "MP,DENS,2,1600",
                "LOCAL,R5.0,LOC,  11,  0,  0,  0,  0", "LOCAL,R5.0,ANG,  11,  0,  90,  0,  0",
                "SECTYPE,1,SHELL,,panel", "SECBLOCK,2", "0.001,2,45,3", "0.002,1,0,3", *nblock(SHEET),
                *eblock((1, 2, 3, 4), system=11))  # fmt: skip
    below, above = mesh.properties["type1_mat1_sec1"].plies
    assert (below.material.E1, below.material.E2, below.material.nu12) == (140e9, 10e9, 0.3)
    assert (np.degrees(below.angle), above.thickness) == (pytest.approx(45), 0.002)
    np.testing.assert_allclose(mesh.data["axis"]["quad"][0], [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize("turned", [False, True])
def test_minor_and_major_ratio(read, turned):
    """NUXY is the minor ratio of Ansys: PRXY = NUXY EX / EY."""
    ratio = "MP,NUXY,1,.02" if turned else "MP,PRXY,1,.28"
    mesh = read("ET,1,181", "MP,EX,1,140e9", "MP,EY,1,10e9", ratio, "MP,GXY,1,5e9", "MP,DENS,1,1", "SECTYPE,1,SHELL",
                "SECDATA,.1,1", *nblock(SHEET), *eblock((1, 2, 3, 4)))  # fmt: skip
    assert mesh.properties["type1_mat1_sec1"].material.nu12 == pytest.approx(0.28)


MODULI = {
    "EX": 140e9,
    "EY": 10e9,
    "EZ": 9e9,
    "GXY": 5e9,
    "GYZ": 3e9,
    "GXZ": 4e9,
    "PRXY": 0.3,
    "PRYZ": 0.4,
    "PRXZ": 0.25,
}


def test_orthotropic_solids_along_their_system(read):
    """A bar of bricks whose material is turned by 90 degrees stretches with EY along the bar."""
    lines = ["ET,1,185", "MP,DENS,1,1600", *(f"MP,{name},1,{value}" for name, value in MODULI.items())]
    mesh = read(*lines, "LOCAL,11,0,0,0,0,90", *nblock(UNIT_CUBE), *eblock(range(1, 9), system=11))
    material = mesh.properties["type1_mat1"].material
    assert (material.E1, material.E2, material.E3) == (140e9, 10e9, 9e9)
    assert (material.nu12, material.nu23, material.nu13) == (0.3, 0.4, 0.25)
    assert (material.G12, material.G23, material.G13) == (5e9, 3e9, 4e9)
    np.testing.assert_allclose(mesh.data["frame"]["hexahedron"][0], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-12)


def test_anisotropic_solids(read):
    """The 21 constants of steel in Ansys' order x, y, z, xy, yz, xz make the frequencies of steel."""
    E, nu = 2.1e11, 0.3
    lame, G = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    D = np.diag([lame + 2 * G] * 3 + [G] * 3)
    D[:3, :3] += lame * (1 - np.eye(3))
    C = D[np.triu_indices(6)]
    table = ["TB,ANEL,1", *(f"TBDATA,{k + 1}," + ",".join(f"{x:.15g}" for x in C[k : k + 6]) for k in range(0, 21, 6))]
    cut = [*bricks(10, 0.1, 0.2, 1.0), "CMBLOCK,ROOT,NODE,2", "(8i10)", f"{1:10d}{-4:10d}"]
    steel = read("ET,1,185", *STEEL, *cut)
    same = read("ET,1,185", "MP,DENS,1,7800", *table, *cut)
    np.testing.assert_allclose(frequencies(same, group="ROOT"), frequencies(steel, group="ROOT"), rtol=1e-9)


def test_shell63_and_real_constants_in_a_block(read):
    mesh = read("ET,1,63", *STEEL, "RLBLOCK,       1,       1,      12,       7", "(2i8,6g16.9)", "(7g16.9)",
                f"{1:8d}{12:8d}" + "".join(f"{x:16.9g}" for x in (0.375, 0.375, 0.375, 0.375, 0, 0)),
                "".join(f"{0.0:16.9g}" for _ in range(6)), *nblock(SHEET), *eblock((1, 2, 3, 4)))  # fmt: skip
    assert mesh.properties["type1_mat1_real1"].thickness == 0.375


def test_rigid_beams_make_one_spider(read):
    mesh = read("ET,1,181", "ET,2,184", "KEYOPT,2,1,1", *STEEL, "SECTYPE,1,SHELL", "SECDATA,.01,1",
                *nblock([*SHEET, (0.5, 0.5, 1)]), *eblock((1, 2, 3, 4)),
                *eblock((1, 5), (5, 2), (3, 5), (5, 4), kind=2, first=2))  # fmt: skip
    [link] = mesh.links
    assert (link.node, link.nodes.tolist()) == (4, [0, 1, 2, 3])
    assert mp.assemble(mesh, {}, {"root": mp.Interface(node=5, kind="node")}).n_dof > 0


def test_rigid_links_keep_the_distance_of_their_nodes(read):
    """Two cantilevers whose tips a rigid link joins have the frequencies of those that a very stiff bar joins."""
    beams = eblock(*[(k, k + 1, 0) for k in (1, 2, 3)], *[(k, k + 1, 0) for k in (5, 6, 7)])
    points = nblock([*((x, 0, 0) for x in (0, 0.3, 0.6, 1)), *((x, 1, 0) for x in (0, 0.3, 0.6, 1.5))])
    lines = ["ET,1,188", *STEEL, "SECTYPE,1,BEAM,RECT", "SECDATA,.02,.03", *points, *beams, "ET,2,184", "ET,3,180",
             "MP,EX,2,1e14", "R,2,1", *eblock((1, 5), kind=2, first=20), "D,1,ALL", "D,5,ALL"]  # fmt: skip
    rigid = read(*lines, *eblock((4, 8), kind=2, first=30))
    stiff = read(*lines, *eblock((4, 8), kind=3, material=2, real=2, section=0, first=30))
    found = [frequencies(mesh.with_(equations=mesh.equations[1:]), group="held") for mesh in (rigid, stiff)]
    assert len(rigid.equations) == 2
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5)  # the bar stretches by 1e-6 of the beams


def test_a_lumped_mass_is_noted(read):
    assert any("LUMPM,ON" in note for note in read("LUMPM,ON", "ET,1,185", *STEEL, *nblock(UNIT_CUBE),
                                                   *eblock(range(1, 9))).notes)  # fmt: skip


def test_old_way_of_nodes_and_elements(read):
    mesh = read(
        "ET,1,180 $ R,1,1e-4", *STEEL, "N,1", "N,2,3.5,1.5-1  ! far", "TYPE,1 $ MAT,1 $ REAL,1", "E,1,2", "EN,7,2,1"
    )
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [3.5, 0.15, 0]])
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 0]]


def test_materials_at_temperatures(read):
    mesh = read("ET,1,180", "R,1,1", "MPTEMP,R5.0, 1, 2,  0.0, 100.0", "MPDATA,R5.0, 2,EX  , 1, 1, 2.1e11, 1.9e11,",
                "MPDATA,R5.0, 1,DENS, 1, 1, 7800,", *nblock([(0, 0, 0), (1, 0, 0)]), *eblock((1, 2),
                    section=0))  # fmt: skip
    assert mesh.properties["type1_mat1_real1"].material.E == 2.1e11
    assert any("EX depends on the temperature" in note for note in mesh.notes)
    assert any("no Poisson's ratio; 0.3 is taken" in note for note in mesh.notes)


def test_supports_and_components_are_groups(read):
    mesh = read("ET,1,180", "R,1,1", *STEEL, *nblock([(0, 0, 0), (1, 0, 0), (2, 0, 0)]), *eblock((1, 2), (2, 3)),
                "CMBLOCK,Ends    ,NODE,  2", "(8i10)", "         1         3", "CMBLOCK,BOTH,ELEM,  2  ! comment",
                    "(8i10)",
                "         1        -2", "D,      2,UX  ,  0.0    ,  0.0")  # fmt: skip
    assert mesh.nodes("Ends").tolist() == [0, 2]
    assert mesh.groups["BOTH"]["line"].tolist() == [0, 1]
    assert mesh.nodes("held").tolist() == [1]
    assert mesh.supports["held"].components.tolist() == [[True, False, False, False, False, False]]


TIED = {  # two halves of a beam, of which the second begins at node 12 where the first ends, at node 11
    "CE of CDWRITE": [line for k, dof in enumerate(("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"), 1) for line in (
        f"CE,R5.0,DEFI,       2,       {k},  0.00000000    ",
        f"CE,R5.0,NODE,      11,{dof}  ,  1.00000000    ,      12,{dof}  , -1.00000000  ")],
    "CE": [f"CE,{k},0,11,{dof},1,12,{dof},-1" for k, dof in enumerate(("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"), 1)],
    "CP": ["CP,1,ALL,11,12"],
    "CP of CDWRITE": ["CP,R5.0,DEFI,       2,       1,ALL ,", "CP,R5.0,NODE,      11,      12"],
}  # fmt: skip


def test_components_of_what_is_selected(read):
    """As HyperMesh writes them: nothing is selected, elements are made, a component names these."""
    points = nblock([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)])
    mesh = read("ET,1,180", "R,1,1", *STEEL, *points, *eblock((1, 2)), "CM,first,ELEM", "ESEL,NONE",
                *eblock((2, 3), (3, 4), first=2), "CM,second,ELEM", "ESEL,ALL", "CM,all,ELEM", "CM,nodes,NODE",
                "ESEL,S,MAT,,1", "CM,chosen,ELEM")  # fmt: skip
    found = {name: group["line"].tolist() for name, group in mesh.groups.items() if "line" in group}
    assert found == {"type1_mat1_real1": [0, 1, 2], "first": [0], "second": [1, 2], "all": [0, 1, 2]}
    assert mesh.nodes("nodes").tolist() == [0, 1, 2, 3]
    assert mesh.notes[0].startswith("left out: 1 CM of ELEM by a selection")


@pytest.mark.parametrize("how", TIED)
@pytest.mark.parametrize("turned", [0, 30])
def test_equations_and_couplings_tie_two_halves_of_a_beam(read, how, turned):
    """The whole is a cantilever in closed form; both nodes of the joint are turned alike, which changes nothing."""
    points = [(k / 20, 0, 0) for k in [*range(11), *range(10, 21)]]
    lines = nblock([*points[:10], *((*point, turned, 0, 0) for point in points[10:12]), *points[12:], (0, 0, 1)])
    pieces = [(k, k + 1, 23) for k in range(1, 22) if k != 11]
    mesh = read("ET,1,188", *STEEL, "SECTYPE,1,BEAM,RECT", "SECDATA,.02,.03", *lines, *eblock(*pieces), *TIED[how])
    expected = sorted(bending(2.1e11 * x, 7800 * 6e-4) for x in (4.5e-8, 2e-8))
    np.testing.assert_allclose(frequencies(mesh, 2, node=1, kind="node"), expected, rtol=3e-3)
    assert len(mesh.equations) == 6
    np.testing.assert_allclose([e.coefficients.sum(axis=0) for e in mesh.equations], 0.0, atol=1e-15)  # as one node


def test_supports_of_a_turned_node_have_its_axes(read):
    mesh = read("ET,1,180", "R,1,1", *STEEL, *nblock([(0, 0, 0), (1, 0, 0, 90, 0, 0)]), *eblock((1, 2)), "D,2,UX,0.001")
    held = mesh.supports["held"]
    np.testing.assert_allclose(held.axes[0][held.components[0][:3]], [[0, 1, 0]], atol=1e-12)
    assert any("the displacement 0.001 of node 2 is left out" in note for note in mesh.notes)


def test_a_deck_without_materials_is_a_mesh(read):
    mesh = read("ET,1,185", *nblock(UNIT_CUBE), *eblock(range(1, 9)))
    assert (mesh.properties, mesh.notes) == ({}, ("the deck has no materials; its groups have no sections",))


# Frequencies of the modal analysis whose file.full the reader of PyMAPDL ships; test_ansys_full.py has them exactly.
TITANIUM = {"E": 16.9e6, "nu": 0.31, "rho": 4.1408e-4}  # psi, lbf s^2/in^4


@real
def test_hex_beam_has_the_stiffness_and_the_frequencies_of_ansys():
    """SOLID186 has 2 x 2 x 2 points in its stiffness. Its mass has 14 in Ansys, 27 here: 2e-6 of these frequencies."""
    mesh = mp.read_mesh(DATA / "HexBeam.cdb")
    assert mesh.notes[-1].endswith("2 x 2 x 2 points, their mass with 3 x 3 x 3, as the deck says")
    section = mp.Solid(material=mp.Material(**TITANIUM))
    model = mp.assemble(mesh, {"type1_mat1": section}, {"root": mp.Interface(box=((0, 0, 0), (1, 1, 0)))})
    theirs = read_matrices(file=DATA / "file.full", nodes=DATA / "HexBeam.cdb")
    node, component = theirs.dof.T
    same = cKDTree(mesh.points).query(theirs.points)[1]
    own = model.dof[same[node], component]
    K, M = (A[own][:, own] for A in (model.K, model.M))
    assert abs(K - theirs.K).max() < 1e-11 * abs(theirs.K).max()
    found = np.sqrt(lowest_modes(K, M, 4)[0]) / (2 * np.pi)
    np.testing.assert_allclose(found, [1283.200, 1283.200, 5781.975, 6919.399], rtol=2.5e-6)


@real
def test_other_real_decks():
    solids = mp.read_mesh(DATA / "all_solid_cells.cdb")
    assert {kind: len(rows) for kind, rows in solids.cells.items()} == {
        "hexahedron20": 1, "wedge15": 1, "pyramid13": 1, "tetra10": 1,
    }  # fmt: skip
    sheet = mp.read_mesh(DATA / "hypermesh.cdb", "mm", "t")
    assert (len(sheet.cells["quad"]), sheet.properties["type1_mat1_real1"].thickness) == (80, pytest.approx(0.375e-3))
    assert len(sheet.groups["PSHELL_1"]["quad"]) == 80
    sector = mp.read_mesh(DATA / "sector.cdb")
    assert (len(sector.cells["hexahedron"]), len(sector.cells["wedge"])) == (101, 4)  # CDWRITE counts 105 elements


def test_parameters_that_are_set_have_no_effect(read):
    plain = read("ET,1,185", *STEEL, *nblock(UNIT_CUBE), *eblock(range(1, 9)))
    mesh = read("width = 0.5", "ET,1,185", *STEEL, *nblock(UNIT_CUBE), *eblock(range(1, 9)))
    assert mesh.notes == plain.notes
    np.testing.assert_array_equal(mesh.points, plain.points)


def test_a_rod_by_its_radius_alone(read):
    mesh = read("ET,1,188", *STEEL, "SECTYPE,1,BEAM,CSOLID", "SECDATA,.01", *beam_line(1, 1.0), *eblock((1, 2, 3)))
    [beam] = mesh.properties.values()
    assert pytest.approx(np.pi * 1e-4) == beam.A


def test_blocks_of_elements_without_their_type(read):
    """Without the key SOLID a row is number, section, constants, material, system and nodes; the type is the first."""
    row = "".join(f"{x:9d}" for x in (7, 1, 1, 1, 0, *range(1, 9)))
    mesh = read("ET,1,185", *STEEL, *nblock(UNIT_CUBE), "EBLOCK,13,,,1", "(15i9)", row, "       -1")
    assert mesh.cells["hexahedron"].tolist() == [list(range(8))]


def test_a_pretension_section_is_closed(read):
    """Two bars whose ends in one place PRETS179 joins vibrate as one bar of three nodes."""
    bars = ["ET,1,180", *STEEL, "R,1,1e-4", "N,1", "N,2,1", "N,4,2", "TYPE,1", "REAL,1", "E,1,2"]
    cut = read(*bars, "N,3,1", "N,5,0,1", "ET,2,179", "E,3,4", "TYPE,2", "E,2,3,5")
    along = {"fix": mp.Support(node=1), "guide": mp.Support(plane=((0, 0, 0), (0, 0, 1)), components="23")}
    found = []
    for mesh in (read(*bars, "E,2,4"), cut):
        model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports=along)
        found.append(mp.craig_bampton(model, modes=2, truncation=[]).frequency[:2])
    np.testing.assert_allclose(*found, rtol=1e-12)
    assert any("PRETS179: the sections are closed" in note for note in cut.notes)


# --- cyclic symmetry -----------------------------------------------------------------------------------------------

QUARTER = [(1000.0, 0, 0), (2000.0, 0, 0), (0, 1000.0, 0), (0, 2000.0, 0)]  # a quarter of a ring, one element
SECTOR = ["ET,1,181", *STEEL, "SECTYPE,1,SHELL", "SECDATA,10", *nblock(QUARTER), *eblock((1, 2, 4, 3))]
ENDS_OF_SECTOR = ["CMBLOCK,CYCLIC_M01L,NODE,2", "(8i10)", "         1         2"]
ENDS_OF_SECTOR += ["CMBLOCK,CYCLIC_M01H,NODE,2", "(8i10)", "         3         4"]


def test_a_sector_brings_its_symmetry_and_its_edges(read):
    """In mm; without components the rotation finds the edges, and a local system has an axis of its own."""
    mesh = read(*SECTOR, *ENDS_OF_SECTOR, "CYCLIC,4", length="mm")
    assert (mesh.cyclic.sectors, mesh.cyclic.low, mesh.cyclic.high) == (4, "cyclic_low", "cyclic_high")
    assert mesh.nodes("cyclic_low").tolist() == [0, 1]
    assert len(mp.fe.make_ring(mesh).points) == 8
    local = read(*SECTOR, "LOCAL,11,1,0.,0.,500.,0.,90.,0.", "CYCLIC,4,90.,11", length="mm").cyclic
    np.testing.assert_allclose(local.point, [0, 0, 0.5])
    np.testing.assert_allclose(local.direction, [0, -1, 0], atol=1e-12)  # z after a turn about x by 90 degrees
    assert local.low == local.high == ""
    assert read(*SECTOR, "CYCLIC,OFF").cyclic is None
    assert len(mp.fe.make_ring(read(*SECTOR, "CYCLIC,4", "CYCOPT,HINDEX,ALL")).points) == 8


@real
def test_the_edges_of_a_real_sector_are_found():
    """One of fifteen: 34 nodes of each edge lie within 1e-14 of their partners, other numbers join single nodes."""
    mesh = mp.read_mesh(DATA / "sector.cdb")
    ring = mp.fe.make_ring(mesh, mp.fe.CyclicSymmetry(sectors=15))
    assert len(ring.points) == 15 * (len(mesh.points) - 34)
    with pytest.raises(mp.InputError, match="make up no face or edge of the mesh; check sectors"):
        mp.fe.make_ring(mesh, mp.fe.CyclicSymmetry(sectors=24, tolerance=1e-3))


@pytest.mark.parametrize("line", ["CYCLIC", "CYCLIC,4,60.", "CYCLIC,1"])
def test_a_symmetry_that_is_no_circle_is_refused(read, line):
    with pytest.raises(mp.InputError, match="which make no circle; give both"):
        read(*SECTOR, line)
