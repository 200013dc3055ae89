"""Nastran decks against closed forms, hand conversions and the decks' own text."""

import math
import re
from collections import Counter

import numpy as np
import pytest
from fe.decks import BAR, GRIDS, PBAR, STEEL, free
from shared_data import DATA

from modalprep.fe.properties.materials import Material, Orthotropic
from modalprep.fe.properties.properties import Beam, Truss
from modalprep.fe.readers.nastran.deck import read_nastran

needs_data = pytest.mark.skipif(not (DATA / "isat").is_dir(), reason="the folder of foreign decks is not there")
INCH, SLINCH = 0.0254, 175.126835  # m; kg in a lbf s^2/in


# ---------------------------------------------------------------- decks that nobody here wrote


@pytest.fixture(scope="module")
def isat():
    return read_nastran(DATA / "isat" / "ISat_Launch_Sm_4pt.dat", INCH, SLINCH)


@needs_data
def test_isat_has_every_card_of_its_deck(isat):
    text = (DATA / "isat" / "ISat_Launch_Sm_4pt.dat").read_text()
    count = Counter(re.findall(r"^([A-Z]+\d*)\*? ", text, re.MULTILINE))
    assert (count["GRID"], count["CQUAD4"], count["CBAR"], count["CBUSH"]) == (5379, 4580, 827, 104)
    assert len(isat.points) == count["GRID"]
    assert len(isat.cells["quad"]) == count["CQUAD4"]
    assert len(isat.cells["triangle"]) == count["CTRIA3"] == 32
    assert len(isat.cells["hexahedron"]) == count["CHEXA"] == 25
    assert len(isat.cells["line"]) == count["CBAR"] + count["CBUSH"]
    assert len(isat.links) == count["RBE2"] == 43
    assert len(isat.cells["vertex"]) == count["CONM2"] + 4 == 19
    assert isat.labels[isat.nodes("spc_1_123")].tolist() == [5630, 5631, 5632, 5633]


@needs_data
def test_isat_every_structural_cell_has_one_property(isat):
    for kind, cells in isat.cells.items():
        rows = [g[kind] for name, g in isat.groups.items() if kind in g and name in isat.properties]
        used = np.sort(np.concatenate(rows))
        assert np.array_equal(used, np.arange(len(cells)) if kind != "vertex" else np.arange(15))


def columns(path):
    """Second reader, for the mass only: fixed columns, card by card, numbers as text."""
    cards = []
    for line in path.read_text().split("BEGIN BULK")[1].splitlines():
        if line.startswith(("$", "ENDDATA", "PARAM")) or not line.strip():
            continue
        width = 16 if "*" in line[:8] else 8
        fields = [line[i : i + width].strip() for i in range(8, 72, width)][: 64 // width]
        if line[0] in "+* ":
            cards[-1] += fields
        else:
            cards.append([line[:8].strip(" *"), *fields])
    return cards


def number(text):
    return float(re.sub(r"(?<=[\d.])([+-])", r"e\1", text or "0"))


@needs_data
def test_isat_mass_is_that_of_its_cards(isat):
    """In the deck's units (lbf s^2/in), from a second reader of the text: ISAT_KG / SLINCH."""
    cards = columns(DATA / "isat" / "ISat_Launch_Sm_4pt.dat")
    point = dict(zip(isat.labels.tolist(), isat.points / INCH, strict=True))
    rho = {c[1]: number(c[5] if c[0] == "MAT1" else c[8]) for c in cards if c[0] in ("MAT1", "MAT8")}
    area = {c[1]: rho[c[2]] * number(c[3]) + number(c[8]) for c in cards if c[0] == "PSHELL"}
    line = {c[1]: rho[c[2]] * number(c[3]) + number(c[7]) for c in cards if c[0] == "PBAR"}
    for c in cards:
        if c[0] == "PBARL":
            line[c[1]] = rho[c[2]] * math.pi * (number(c[9]) ** 2 - number(c[10]) ** 2) + number(c[11])
    solid = {c[1]: rho[c[2]] for c in cards if c[0] == "PSOLID"}
    mass = sum(number(c[4]) for c in cards if c[0] == "CONM2")
    for c in cards:
        if c[0] in ("CQUAD4", "CTRIA3", "CBAR", "CHEXA"):
            count = {"CQUAD4": 4, "CTRIA3": 3, "CBAR": 2, "CHEXA": 8}[c[0]]
            x = np.array([point[int(n)] for n in c[3 : 3 + count]])
            if count == 2:
                mass += line[c[2]] * np.linalg.norm(x[1] - x[0])
            elif count == 8:
                mass += solid[c[2]] * gauss_volume(x)
            else:
                mass += area[c[2]] * np.linalg.norm(np.cross(x[2] - x[0], x[-1] - x[1])) / 2
    assert mass == pytest.approx(mesh_mass(isat) / SLINCH, rel=1e-7)  # densities of 1e-6 kg/m^3 are below this
    assert mass * SLINCH == pytest.approx(ISAT_KG, rel=1e-6)


ISAT_KG = 310.780285


def gauss_volume(x):
    """Volume of a hexahedron with the trilinear map, two Gauss points per direction."""
    corners = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    total = 0.0
    for p in corners / math.sqrt(3):
        terms = 1 + corners * p
        grad = np.stack([corners[:, i] * np.prod(np.delete(terms, i, 1), axis=1) / 8 for i in range(3)])
        total += np.linalg.det(grad @ x)
    return total


def mesh_mass(mesh):
    total = 0.0
    for name, section in mesh.properties.items():
        for kind, conn in mesh.group(name).items():
            x = mesh.points[conn]
            if kind == "vertex":
                total += section.mass * len(conn)
            elif isinstance(section, (Beam, Truss)):
                length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum()
                total += length * (section.material.rho * section.A + section.nsm)
            elif kind == "hexahedron":
                total += section.material.rho * sum(gauss_volume(corners) for corners in x)
            elif kind in ("quad", "triangle"):
                sides = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
                total += (
                    (section.material.rho * section.thickness + section.nsm) * np.linalg.norm(sides, axis=1).sum() / 2
                )
    return total


@needs_data
def test_small_deck_of_every_family():
    mesh = read_nastran(DATA / "nastran_modes" / "mode_solid_shell_bar.bdf", 0.0254, 0.45359237)
    assert {k: len(c) for k, c in mesh.cells.items()} == {
        **{"hexahedron": 1, "wedge": 2, "tetra": 2, "quad": 4, "triangle": 8, "line": 4},
        "vertex": 4 + 9 + 13,  # SPC1 with four grids and with 5 thru 13, then SPCADD joins both
    }
    assert [ply.thickness / 0.0254 for ply in mesh.properties["pcomp_7"].plies] == pytest.approx(
        [0.1, 0.2, 0.3, 0.4, 0.5]
    )
    assert [ply.thickness / 0.0254 for ply in mesh.properties["pcomp_6"].plies] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    beam = mesh.properties["pbeam_5"]
    assert (beam.kz, beam.ky, beam.theory) == (0.850116, 0.850116, "timoshenko")
    assert beam.Iy == pytest.approx(0.0052083 * 0.0254**4)
    assert mesh.properties["pbar_1"].theory == "euler-bernoulli"  # blank K1, K2
    assert [note.partition(":")[0] for note in mesh.notes] == [
        "spc_123456 holds only components 456 of 9 grids, the first is grid 5",
        "spc_2 holds only components 456 of 9 grids, the first is grid 5",
    ]


@needs_data
def test_frame_deck_with_include_and_boundary_set():
    mesh = read_nastran(DATA / "nastran_cb" / "inboard.dat", 1e-3, 1e3)  # mm, t, N
    assert (len(mesh.points), len(mesh.cells["line"])) == (26, 66)
    assert mesh.labels[mesh.nodes("bset")].tolist() == [3, 11, 19, 27]
    assert mesh.points[mesh.labels == 11][0] == pytest.approx([0.6, 0.3, 0.3])
    beam = mesh.properties["pbar_100"]
    assert beam.A == pytest.approx(12.566e-6)
    assert beam.material.E == pytest.approx(6.894e13)  # what 6.894+7 N/mm^2 is in Pa
    row = mesh.groups["pbar_100"]["line"][0]  # CBAR 3 from grid 4 to 5, G0 = 13
    assert mesh.data["up"]["line"][row] == pytest.approx([math.sqrt(0.5), math.sqrt(0.5), 0])
    assert mesh_mass(mesh) / 1e3 == pytest.approx(1.7550518, rel=1e-7)  # t: rigid mass of MSC's mxx in inboard.op4
    assert "aset" not in mesh.groups
    assert "qset" not in mesh.groups  # holds scalar points only


# ---------------------------------------------------------------- places and axes


def test_coordinate_systems_in_closed_form(read):
    """A cylinder about the basic x axis, a sphere in it, and CORD1R from three grids."""
    mesh = read(
        "CORD2C,4,,1.,0.,0.,2.,0.,0.,+\n+,1.,1.,0.\n"  # z along x, theta = 0 along y
        "GRID,1,4,2.,30.,5.\nCORD2S,5,4,0.,0.,0.,1.,0.,0.,+\n+,0.,0.,1.\n"  # z along y, x along basic x
        "GRID,2,5,3.,60.,90.\nCORD1R,6,11,12,13\nGRID,11\nGRID,12,,0.,0.,1.\nGRID,13,,0.,1.,0.\nGRID,3,6,1.,2.,3.\n"
        "CROD,1,2,1,2\nPROD,2,7,1.\n" + STEEL
    )
    at = dict(zip(mesh.labels.tolist(), mesh.points, strict=True))
    assert at[1] == pytest.approx([6.0, 2 * math.cos(math.pi / 6), 2 * math.sin(math.pi / 6)])
    # sphere: e3 = basic y, e1 = basic x, so e2 = e3 x e1 = -z; polar 60 deg from y, 90 deg from x
    assert at[2] == pytest.approx([1.0, 1.5, -3 * math.sin(math.pi / 3)])
    assert at[3] == pytest.approx([-2.0, 1.0, 3.0])  # x along basic y, z along z, y along -x


def test_grdset_gives_the_blank_systems(read):
    mesh = read(
        "GRDSET,,3\nCORD2R,3,,5.,0.,0.,5.,0.,1.,+\n+,6.,0.,0.\nGRID,1\nGRID,2,0,1.\nCROD,1,2,1,2\nPROD,2,7,1.\n" + STEEL
    )
    assert mesh.points.tolist() == [[5, 0, 0], [1, 0, 0]]


def our_frame(mesh, row=0):
    """Axes as Beam documents them: e2 = up x e1, e3 = e1 x e2."""
    x = mesh.points[mesh.cells["line"][row]]
    e1 = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
    e2 = np.cross(mesh.data["up"]["line"][row], e1)
    e2 /= np.linalg.norm(e2)
    return e1, e2, np.cross(e1, e2)


def test_plane_one_is_bending_towards_e3(read):
    """A flat 40 x 10 bar lying in x-y, v = y: I1 is the large moment, deflection along y; K1 goes with it."""
    mesh = read(GRIDS + BAR + "PBARL,5,7,,BAR,,,,,+\n+,.01,.04\n" + STEEL)
    beam, (_, e2, e3) = mesh.properties["pbarl_5"], our_frame(mesh)
    assert e3 == pytest.approx([0, 1, 0])
    assert e2 == pytest.approx([0, 0, -1])
    assert beam.Iy == pytest.approx(0.01 * 0.04**3 / 12)
    assert beam.Iz == pytest.approx(0.04 * 0.01**3 / 12)
    beam = read(GRIDS + BAR + "PBAR,5,7,.01,3.-6,2.-6,4.-6,,,+\n+,,,,,,,,,+\n+,.7,.6\n" + STEEL).properties["pbar_5"]
    assert (beam.kz, beam.ky, beam.Iy, beam.Iz) == (0.7, 0.6, 3e-6, 2e-6)


def test_orientation_vector_and_offsets_are_in_the_displacement_system(read):
    """CD cylinder about z: at a grid on the y axis, e_r = y and e_theta = -x."""
    deck = "CORD2C,4,,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\nGRID,1,,0.,2.,0.,4\nGRID,2,,0.,2.,3.\n"
    mesh = read(deck + "CBAR,9,5,1,2,1.,0.,0.,,+\n+,,,.1,.2,.3,.4,.5,.6\n" + PBAR + STEEL, length=2.0)
    assert mesh.data["up"]["line"][0] == pytest.approx([0, 1, 0])
    assert mesh.data["ends"]["line"][0] == pytest.approx(2 * np.array([[-0.2, 0.1, 0.3], [0.4, 0.5, 0.6]]))


def test_displacement_axes_of_a_sphere(read):
    """CD sphere in basic axes: at (0, 3, 0) e_r = y, e_theta = -z, e_phi = -x."""
    deck = "CORD2S,4,,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\nGRID,1,,0.,3.,0.,4\nGRID,2,,0.,3.,3.\nGRID,3,,9.,3.,0.,4\n"
    mesh = read(deck + "CBAR,9,5,1,2,.1,.2,.3,,+\n+,,,1.,2.,3.\n" + PBAR + STEEL)
    assert mesh.data["ends"]["line"][0] == pytest.approx(np.array([[-3, 1, -2], [0, 0, 0]]))


def test_baror_fills_the_orientation(read):
    mesh = read("BAROR,,,,,0.,0.,1.\n" + GRIDS + "CBAR,9,5,1,2\nCBAR,8,5,2,3,1.,0.,0.\n" + PBAR + STEEL)
    assert mesh.data["up"]["line"].tolist() == [[0, 0, 1], [1, 0, 0]]


def test_product_of_inertia_turns_the_section_to_its_principal_axes(read):
    """The bending stiffness tensor rebuilt from the principal moments is that of I1, I2, I12."""
    I1, I2, I12 = 5e-6, 2e-6, 1e-6
    mesh = read(GRIDS + BAR + "PBAR,5,7,.01,5.-6,2.-6,4.-6,,,+\n+,,,,,,,,,+\n+,,,1.-6\n" + STEEL)
    beam, (_, e2, e3) = mesh.properties["pbar_5"], our_frame(mesh)
    tensor = beam.Iy * np.outer(e3, e3) + beam.Iz * np.outer(e2, e2)  # int r r dA over the section
    y, z = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
    assert [y @ tensor @ y, z @ tensor @ z, y @ tensor @ z] == pytest.approx([I1, I2, I12])


def test_midside_nodes_come_in_the_order_of_vtk(read):
    """Every mid-side node lies in the middle of the edge where VTK's order expects it."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    nastran = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)]
    vtk = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    check_midside(read, "CHEXA", "hexahedron20", corners, nastran, vtk)
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
    nastran = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)]
    vtk = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
    check_midside(read, "CPENTA", "wedge15", corners, nastran, vtk)
    corners, edges = corners[:4], [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    check_midside(read, "CTETRA", "tetra10", corners, edges, edges)


def check_midside(read, name, kind, corners, written, expected):
    x = np.array([*corners, *[np.mean([corners[a], corners[b]], axis=0) for a, b in written]])
    grids = "".join(f"GRID,{i},,{p[0]},{p[1]},{p[2]}\n" for i, p in enumerate(x.tolist(), 1))
    mesh = read(grids + free([name, "1", "2", *(str(i + 1) for i in range(len(x)))]) + "PSOLID,2,7\n" + STEEL)
    found = mesh.points[mesh.cells[kind][0]]
    for (a, b), middle in zip(expected, found[len(corners) :], strict=True):
        assert middle == pytest.approx((found[a] + found[b]) / 2)


# ---------------------------------------------------------------- sections and materials


def test_units_inch_pound_and_metre_decks_agree(read):
    """The same plate with a stiffener, a mass and a spring, in SI and in lbf, in, s."""

    def deck(m, kg):
        n, pa = kg * m, kg / m  # units of force and stress per SI unit
        corners = ((1, 0, 0), (2, 2, 0), (3, 2, 1), (4, 0, 1))
        inertia = f"{2 * kg * m * m},{kg * m * m / 4},{3 * kg * m * m}"
        bar = [0.01 * m**2, 3e-6 * m**4, 2e-6 * m**4, 4e-6 * m**4, 0.7 * kg / m]
        return (
            "".join(f"GRID,{i},,{x * m},{y * m},0.\n" for i, x, y in corners)
            + f"CQUAD4,1,2,1,2,3,4,30.\nCBAR,9,5,1,2,0.,1.,0.\nCELAS2,4,{1e5 * n / m},1,2\nCBUSH,5,6,3,,,,,0\n"
            + f"CONM2,3,1,,{5 * kg},{0.1 * m},0.,0.,,+\n+,{inertia}\n"
            + f"PSHELL,2,7,{0.01 * m},7,1.,7,.8,{0.3 * kg / m**2}\nPBAR,5,7,{','.join(map(str, bar))}\n"
            + f"PBUSH,6,K,{1e4 * n / m},,,{2e3 * n * m}\nMAT1,7,{2e11 * pa},,.3,{8000 * kg / m**3}\n"
        )

    si, inch = read(deck(1.0, 1.0)), read(deck(1 / INCH, 1 / SLINCH), INCH, SLINCH)
    assert inch.points == pytest.approx(si.points)
    assert inch.properties.keys() == si.properties.keys()
    for name in si.properties:
        for key, value in vars(si.properties[name]).items():
            other = getattr(inch.properties[name], key)
            if isinstance(value, Material):
                assert (other.E, other.nu, other.rho) == pytest.approx((value.E, value.nu, value.rho))
            elif isinstance(value, (float, tuple)):
                assert other == pytest.approx(value), (name, key)
    mass = si.properties["conm2_3"]
    assert (mass.mass, mass.inertia, mass.offset) == (5, (2, 3, 0, -0.25, 0, 0), (0.1, 0, 0))  # tensor: -I21
    assert si.properties["celas2_4"].k == (0, 1e5, 0, 0, 0, 0)
    assert si.properties["pbush_6"].k == (1e4, 0, 0, 2e3, 0, 0)
    assert inch.data["angle"]["quad"] == pytest.approx([math.pi / 6])


def test_wtmass_scales_every_mass(read):
    deck = GRIDS + BAR + STEEL + "PBAR,5,7,.01,3.-6,2.-6,4.-6,.7\nCONM2,3,1,,5.\n"
    one, half = read(deck), read("PARAM,WTMASS,.5\n" + deck)
    assert half.properties["pbar_5"].material.rho == one.properties["pbar_5"].material.rho / 2 == 4000
    assert (half.properties["pbar_5"].nsm, half.properties["conm2_3"].mass) == (0.35, 2.5)
    assert half.properties["pbar_5"].material.E == 2e11


def test_concentrated_mass_in_a_turned_system_and_by_position(read):
    """CID 3 is turned by 90 deg about z: its x is y. CID -1 gives the mass centre in basic coordinates."""
    system = "CORD2R,3,,0.,0.,0.,0.,0.,1.,+\n+,0.,1.,0.\n"
    mesh = read(
        GRIDS
        + BAR
        + PBAR
        + STEEL
        + system
        + "CONM2,3,2,3,5.,.1,.2,.3,,+\n+,1.,.2,4.,.3,.5,9.\nCONM2,4,2,-1,5.,2.5,0.,1.\n"
    )
    local = np.array([[1, -0.2, -0.3], [-0.2, 4, -0.5], [-0.3, -0.5, 9]])
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])  # columns: the system's axes
    turned = turn @ local @ turn.T
    found = mesh.properties["conm2_3"]
    assert found.offset == pytest.approx((-0.2, 0.1, 0.3))
    assert found.inertia == pytest.approx([turned[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
    assert mesh.properties["conm2_4"].offset == pytest.approx((0.5, 0, 1))


def test_bar_keeps_the_moduli_no_isotropic_body_has(read):
    """E = 2.12e7 with G = 5.3e6 means nu = 1; G J and k G A must still be those of the card."""
    mesh = read(GRIDS + BAR + "PBAR,5,7,.01,3.-6,2.-6,4.-6,,,+\n+,,,,,,,,,+\n+,.7,.6\nMAT1,7,2.12+7,5.3+6\n")
    beam = mesh.properties["pbar_5"]
    assert beam.material.E == 2.12e7
    assert beam.material.G * beam.J == pytest.approx(5.3e6 * 4e-6)
    assert beam.material.G * beam.kz == pytest.approx(5.3e6 * 0.7)


def test_shell_cards(read):
    mesh = read(
        GRIDS + "CQUAD4,1,2,1,2,3,4,3,.05\nCTRIA3,2,2,1,2,3,45.\nCQUAD4,3,6,1,2,3,4\nCQUAD4,4,6,1,2,3,4,0.,.05\n"
        "CQUAD4,5,9,1,2,3,4\n"
        "CORD2R,3,,0.,0.,0.,0.,0.,1.,+\n+,0.,1.,0.\nPSHELL,2,7,.01,8,20.,8,3.,.5\n"
        "PCOMP,6,-.1,.25,,,,,SYM,+\n+,8,.02,45.,,,.01\nPSHELL,9,7,.02\n"
        "MAT8,8,1.+11,2.+10,.25,5.+9,,,1600.\n" + STEEL
    )
    sheet, laminate, membrane = (mesh.properties[name] for name in ("pshell_2", "pcomp_6", "pshell_9"))
    assert (sheet.thickness, sheet.bending_ratio, sheet.shear_ratio, sheet.nsm) == (0.01, 20.0, 3.0, 0.5)
    assert isinstance(sheet.bending_material, Orthotropic)
    assert sheet.bending_material.G13 == 5e9  # blank G1Z is rigid in Nastran, G12 here
    assert [p.thickness for p in laminate.plies] == pytest.approx([0.02, 0.01, 0.01, 0.02])
    assert [p.angle for p in laminate.plies] == pytest.approx([math.pi / 4, 0, 0, math.pi / 4])
    assert laminate.offset == pytest.approx(-0.1 + 0.03)
    assert (membrane.bending_ratio, membrane.bending_material) == (1e-3, None)
    assert mesh.data["axis"]["quad"][0] == pytest.approx([0, 1, 0])
    assert np.isnan(mesh.data["axis"]["quad"][1:]).all()
    assert mesh.data["angle"]["triangle"] == pytest.approx([math.pi / 4])
    assert mesh.data["offset"]["quad"] == pytest.approx([0.05, np.nan, 0.05 - 0.07, np.nan], nan_ok=True)


def test_bush_axes(read):
    """CID, orientation vector in a displacement system, line AB, and to the ground."""
    mesh = read(
        GRIDS + "CORD2R,3,,0.,0.,0.,0.,0.,1.,+\n+,0.,1.,0.\nPBUSH,6,K,1.,2.,3.\n"
        "CBUSH,1,6,1,2,,,,3\nCBUSH,2,6,1,2,0.,0.,1.\nCBUSH,3,6,4,1,,,,,+\n+,.25\nCBUSH,4,6,3,,,,,0\n"
    )
    cid, vector, line = mesh.data["frame"]["line"]
    assert cid == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    assert vector == pytest.approx(np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]))
    assert line[0] == pytest.approx([0, -1, 0])
    assert line @ line.T == pytest.approx(np.eye(3))
    assert mesh.data["frame"]["vertex"][0] == pytest.approx(np.eye(3))
    assert mesh.properties["pbush_6_s0.25"].location == 0.25


def test_rigid_elements(read):
    deck = (
        GRIDS
        + BAR
        + PBAR
        + STEEL
        + "RBE2,20,1,123,2,THRU,4\nRBE3,21,,4,123456,1.5,123,1,2,+\n+,2.,123,3\nRBAR,22,1,2,,123456\n"
    )
    follow, mean, bar = read(deck).links
    assert (follow.kind, follow.node, follow.nodes.tolist(), follow.components.tolist()) == (
        "rbe2",
        0,
        [1, 2, 3],
        [True] * 3 + [False] * 3,
    )
    assert (mean.kind, mean.node, mean.nodes.tolist(), mean.weights.tolist()) == ("rbe3", 3, [0, 1, 2], [1.5, 1.5, 2])
    assert (bar.node, bar.nodes.tolist(), bar.components.all()) == (1, [0], True)


def test_rods_carry_torque_and_mass(read):
    mesh = read(GRIDS + "CROD,1,2,1,2\nPROD,2,7,.01,3.-6,,.4\nCONROD,14,2,3,7,.02\n" + STEEL)
    rod = mesh.properties["prod_2"]
    assert (rod.A, rod.J, rod.nsm) == (0.01, pytest.approx(3e-6), 0.4)
    assert (mesh.properties["conrod_14"].A, mesh.properties["conrod_14"].J) == (0.02, 0)
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]
