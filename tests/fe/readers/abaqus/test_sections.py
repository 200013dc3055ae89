"""Sections and materials of small decks, against closed forms."""

import math

import numpy as np
import pytest
from fe.abaqus_decks import BEAM, CUBE, NODES, NU, QUAD, SECTION, STEEL, E, G, displacements

import modalprep as mp
from modalprep.fe.readers.abaqus.profiles import SHAPES


@pytest.fixture
def static(read):
    return lambda text, loads: displacements(read(text), loads)


# ---------------------------------------------------------------- beams

I1, I2, AREA = 0.02 * 0.05**3 / 12, 0.05 * 0.02**3 / 12, 0.02 * 0.05


@pytest.mark.parametrize(("component", "second"), [(2, I1), (1, I2)])
def test_a_cantilever_bends_by_the_height_along_axis_2(static, component, second):
    """P L^3 / (3 E I) and P L / (k G A) with Abaqus' k = 0.85; axis 1 is y, so that the height stands along z."""
    u = static(BEAM + SECTION + STEEL + "*BOUNDARY\n1, ENCASTRE\n", {(3, component): 1000.0})
    assert u[2, component] == pytest.approx(1000 * 8 / (3 * E * second) + 1000 * 2 / (0.85 * G * AREA), rel=1e-9)


def test_the_default_direction_of_axis_1_is_minus_z(static):
    section = SECTION.replace("0, 1, 0\n", "")
    u = static(BEAM + section + STEEL + "*BOUNDARY\n1, ENCASTRE\n", {(3, 1): 1000.0})  # height along y
    assert u[2, 1] == pytest.approx(1000 * 8 / (3 * E * I1) + 1000 * 2 / (0.85 * G * AREA), rel=1e-9)


def test_a_node_may_give_the_direction(static):
    """It takes the place of the line of the section: axis 1 points to it."""
    text = BEAM.replace("3, 2, 0, 0\n", "3, 2, 0, 0\n9, 0, 0, 4\n").replace(
        "1, 1, 2\n2, 2, 3", "1, 1, 2, 9\n2, 2, 3, 9"
    )
    u = static(text + SECTION + STEEL + "*BOUNDARY\n1, ENCASTRE\n", {(3, 1): 1000.0})
    assert u[2, 1] == pytest.approx(1000 * 8 / (3 * E * I1) + 1000 * 2 / (0.85 * G * AREA), rel=1e-9)


def test_beams_of_a_turned_instance_turn_with_it(read):
    text = "*PART, NAME=p\n" + BEAM + SECTION + "*END PART\n*INSTANCE, NAME=i, PART=p\n0, 0, 0\n0, 0, 0, 1, 0, 0, 90\n"
    mesh = read(text + "*END INSTANCE\n" + STEEL)
    np.testing.assert_allclose(mesh.data["up"]["line"], [[0, -1, 0]] * 2, atol=1e-15)  # z turned about x


def test_cubic_beams_have_no_shear(static):
    u = static(BEAM.replace("B31", "B33") + SECTION + STEEL + "*BOUNDARY\n1, ENCASTRE\n", {(3, 2): 1000.0})
    assert u[2, 2] == pytest.approx(1000 * 8 / (3 * E * I1), rel=1e-9)


def test_a_general_section_and_its_own_moduli(static):
    """Also product of inertia: loads along the principal axes, at 45 degrees when I11 = I22, bend apart."""
    general = "*BEAM GENERAL SECTION, ELSET=b, SECTION=GENERAL, DENSITY=7800.\n"
    general += "1e-3, 3e-6, 1e-6, 3e-6, 5e-6\n0, 1, 0\n2e11, 8e10\n"
    text = BEAM + general + "*BOUNDARY\n1, ENCASTRE\n"
    p = 1000 / math.sqrt(2)
    for sign, second in ((1, 4e-6), (-1, 2e-6)):  # int (x1 + x2)^2 / 2 = (I11 + I22) / 2 + I12 resists along (1, 1)
        u = static(text, {(3, 1): p, (3, 2): sign * p})
        along = (u[2, 1] + sign * u[2, 2]) / math.sqrt(2)
        assert along == pytest.approx(1000 * 8 / (3 * E * second) + 1000 * 2 / (8e10 * 1e-3), rel=1e-9)
    twist = static(text, {(3, 3): 1000.0})[2, 3]
    assert twist == pytest.approx(1000 * 2 / (8e10 * 5e-6), rel=1e-9)


def test_a_shear_stiffness_of_its_own(static):
    text = BEAM + SECTION + "*TRANSVERSE SHEAR STIFFNESS\n1e6, 3e6\n" + STEEL + "*BOUNDARY\n1, ENCASTRE\n"
    for component, second, shear in ((2, I1, 1e6), (1, I2, 3e6)):
        u = static(text, {(3, component): 1000.0})
        assert u[2, component] == pytest.approx(1000 * 8 / (3 * E * second) + 1000 * 2 / shear, rel=1e-9)


# Every shape against integrals of its own: A, I11, I22, I12 and the centroid by the areas of thin slices.
def inside(kind, s, x, y):
    """Whether points lie in a section, from the manual's figures."""
    if kind == "RECT":
        return (abs(x) < s[0] / 2) & (abs(y) < s[1] / 2)
    if kind in ("CIRC", "PIPE", "THICK PIPE"):
        r = np.hypot(x, y)
        return (r < s[0]) & (r > (s[0] - s[1] if len(s) > 1 else -1))
    if kind == "BOX":
        a, b, t1, t2, t3, t4 = s
        hole = (x < a / 2 - t1) & (x > -a / 2 + t3) & (y < b / 2 - t2) & (y > -b / 2 + t4)
        return (abs(x) < a / 2) & (abs(y) < b / 2) & ~hole
    if kind == "I":
        up, h, b1, b2, t1, t2, t3 = s
        z = y + up
        flanges = ((z < t1) & (abs(x) < b1 / 2)) | ((z > h - t2) & (abs(x) < b2 / 2))
        return (z > 0) & (z < h) & (flanges | (abs(x) < t3 / 2))
    if kind == "T":
        b, h, up, tf, tw = s
        z = y + up
        return (z > 0) & (z < h) & (((z > h - tf) & (abs(x) < b / 2)) | (abs(x) < tw / 2))
    if kind == "L":
        a, b, t1, t2 = s
        p, q = x + t2 / 2, y + t1 / 2
        return (p > 0) & (q > 0) & (((q < t1) & (p < a)) | ((p < t2) & (q < b)))
    a, b, c, d = s
    z = y + d
    return (z > 0) & (z < b) & (abs(x) < (a + (c - a) * z / b) / 2)


SIZES = {
    "RECT": (2.0, 3.0), "CIRC": (2.0,), "PIPE": (2.0, 0.5), "THICK PIPE": (2.0, 0.5),
    "BOX": (4.0, 3.0, 0.2, 0.3, 0.4, 0.5),
    "I": (1.0, 4.0, 3.0, 2.0, 0.3, 0.4, 0.5), "T": (3.0, 4.0, 1.0, 0.5, 0.4), "L": (3.0, 4.0, 0.5, 0.4),
    "TRAPEZOID": (3.0, 2.0, 1.0, 0.5),
}  # fmt: skip


@pytest.mark.parametrize("kind", SIZES)
def test_moments_of_every_shape(kind):
    sizes = SIZES[kind]
    x, h = np.linspace(-5, 5, 4001, retstep=True)
    x = (x[1:] + x[:-1]) / 2
    X, Y = np.meshgrid(x, x)
    mask = inside(kind, sizes, X, Y)
    area, X, Y = h * h * mask.sum(), X[mask], Y[mask]
    c1, c2 = X.mean(), Y.mean()
    found = SHAPES[kind][1](*sizes)
    assert SHAPES[kind][0] == len(sizes)
    rtol = 2e-3  # slices of 1/400 of the size at slanted and round edges
    assert pytest.approx(area, rel=rtol) == found.A
    np.testing.assert_allclose(found.centroid, (c1, c2), atol=2e-3)
    moments = [h * h * np.sum(v) for v in ((Y - c2) ** 2, (X - c1) ** 2, (X - c1) * (Y - c2))]
    np.testing.assert_allclose((found.I11, found.I22, found.I12), moments, rtol=4 * rtol, atol=4 * rtol * moments[0])


def test_thin_walls_one_after_the_other(read):
    """A square tube of four walls: 4 a t, Bredt's torsion a^3 t; and open at a corner a t^3 4 / 3."""
    closed = SHAPES["ARBITRARY"][1](4, -1, -1, 1, -1, 0.01, 1, 1, 0.01, -1, 1, 0.01, -1, -1, 0.01)
    assert closed.A == pytest.approx(0.08)
    assert pytest.approx(8 * 0.01) == closed.J  # a = 2
    assert pytest.approx(2 * (0.02 * 1) + 2 * 0.01 * 8 / 12) == closed.I11
    open_one = SHAPES["ARBITRARY"][1](3, -1, -1, 1, -1, 0.01, 1, 1, 0.01, -1, 1, 0.01)
    assert pytest.approx(6 * 0.01**3 / 3) == open_one.J
    section = "*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=ARBITRARY\n2, 0, 0, .1, 0, .01\n.1, .1, .01\n0, 1, 0\n"
    assert pytest.approx(2e-3) == read(BEAM + section + STEEL).properties["b"].A


def test_an_eccentric_section_bends_under_tension(static):
    """T with its node at the foot: a force along the axis at the node bends by F e L^2 / (2 E I)."""
    section = SECTION.replace("RECT", "T").replace(".02, .05", ".04, .06, 0., .01, .01")
    u = static(BEAM + section + STEEL + "*BOUNDARY\n1, ENCASTRE\n", {(3, 0): 1000.0})
    A1, A2 = 0.04 * 0.01, 0.01 * 0.05
    e = (A1 * 0.055 + A2 * 0.025) / (A1 + A2)
    second = 0.04 * 0.01**3 / 12 + A1 * (0.055 - e) ** 2 + 0.01 * 0.05**3 / 12 + A2 * (0.025 - e) ** 2
    assert abs(u[2, 2]) == pytest.approx(1000 * e * 4 / (2 * E * second), rel=1e-9)
    assert u[2, 2] > 0  # the node is pulled below the centroid: the beam bends upwards


# ---------------------------------------------------------------- trusses, points


def test_a_truss_with_its_area(static):
    bar = NODES + "*ELEMENT, TYPE=T3D2, ELSET=t\n1, 1, 2\n2, 2, 3\n*SOLID SECTION, ELSET=t, MATERIAL=steel\n1e-4\n"
    u = static(bar + STEEL + "*BOUNDARY\n1, PINNED\n2, 2, 3\n3, 2, 3\n", {(3, 0): 1000.0})
    assert u[2, 0] == pytest.approx(1000 * 2 / (E * 1e-4), rel=1e-12)


def test_masses_and_rotary_inertias(read):
    text = BEAM + SECTION + STEEL + "*ELEMENT, TYPE=MASS, ELSET=m\n7, 3\n*MASS, ELSET=m\n5.\n"
    text += "*ELEMENT, TYPE=ROTARYI, ELSET=r\n8, 3\n*ROTARY INERTIA, ELSET=r, ORIENTATION=o\n1, 2, 3, .1, .2, .3\n"
    mesh = read(text + "*ORIENTATION, NAME=o\n0, 1, 0, -1, 0, 0\n")
    assert mesh.properties["m"].mass == 5.0
    # axis 1 is y, axis 2 is -x: Iyy = I11, Ixx = I22, Ixy = -I12, Iyz = I13, Ixz = -I23
    np.testing.assert_allclose(mesh.properties["r"].inertia, (2, 1, 3, -0.1, -0.3, 0.2), atol=1e-15)


def test_springs(static):
    """Along a line of 3-4-5, to the ground, and between two nodes at one place."""
    text = (
        "*NODE\n1, 0, 0, 0\n2, 3, 4, 0\n3, 3, 4, 0\n*ELEMENT, TYPE=SPRINGA, ELSET=a\n1, 1, 2\n*SPRING, ELSET=a\n\n1e5\n"
    )
    text = text.replace("\n\n1e5", "\n,\n1e5")
    text += "*ELEMENT, TYPE=SPRING1, ELSET=g\n2, 2\n*SPRING, ELSET=g\n2\n3e4\n"
    text += "*ELEMENT, TYPE=SPRING2, ELSET=t\n3, 2, 3\n*SPRING, ELSET=t\n1, 1\n2e4\n"
    u = static(text + "*BOUNDARY\n1, 1, 3\n2, 3\n3, 2, 3\n", {(3, 0): 100.0})
    K = 1e5 * np.outer((0.6, 0.8), (0.6, 0.8)) + np.diag((0, 3e4))
    expected = np.linalg.solve(K, (100.0, 0.0))
    np.testing.assert_allclose(u[1, :2], expected, rtol=1e-9)
    assert u[2, 0] == pytest.approx(expected[0] + 100 / 2e4, rel=1e-9)


def test_units_of_masses_springs_and_sections(read):
    """In mm, t and s: forces in N, stresses in MPa, densities in t/mm^3, inertias in t mm^2."""
    text = BEAM + SECTION + "*MATERIAL, NAME=steel\n*ELASTIC\n2e5, .25\n*DENSITY\n7.8e-9\n"
    text += "*ELEMENT, TYPE=MASS, ELSET=m\n7, 3\n*MASS, ELSET=m\n.005\n"
    text += "*ELEMENT, TYPE=ROTARYI, ELSET=r\n8, 3\n*ROTARY INERTIA, ELSET=r\n1e3, 1e3, 1e3\n"
    text += "*ELEMENT, TYPE=SPRING1, ELSET=s\n9, 3\n*SPRING, ELSET=s\n4\n1e6\n"
    mesh = read(text, "mm", "t")
    beam = mesh.properties["b"]
    assert beam.material.E == pytest.approx(2e11)
    assert beam.material.rho == pytest.approx(7800)
    assert pytest.approx(AREA * 1e-6) == beam.A
    assert pytest.approx(I1 * 1e-12) == beam.Iy
    assert mesh.properties["m"].mass == pytest.approx(5.0)
    assert mesh.properties["r"].inertia[0] == pytest.approx(1.0)
    assert mesh.properties["s"].rotation[0] == pytest.approx(1e3)
    with pytest.raises(mp.InputError, match="brings its own materials: give their mass_unit"):
        read(text, "mm")


# ---------------------------------------------------------------- solids and shells


def test_a_cube_under_tension(static):
    text = CUBE + STEEL + "*BOUNDARY\n1, 1, 3\n2, 3\n4, 3\n3, 3\n2, 2\n"
    u = static(text, {(n, 2): 250.0 for n in (5, 6, 7, 8)})
    np.testing.assert_allclose(u[4:, 2], 1000 / E, rtol=1e-9)
    assert u[6, 0] == pytest.approx(-NU * 1000 / E, rel=1e-9)


def test_shells_their_thickness_and_offset(read):
    for option, offset in (("SPOS", -0.005), ("SNEG", 0.005), ("0.2", -0.002), ("0.", 0.0)):
        mesh = read(QUAD + f"*SHELL SECTION, ELSET=s, MATERIAL=steel, OFFSET={option}\n.01, 5\n" + STEEL)
        shell = mesh.properties["s"]
        assert (shell.thickness, shell.offset) == pytest.approx((0.01, offset))


def test_the_top_surface_as_reference_leaves_the_mass_below(read):
    """SPOS: the nodes lie on the top, so that the mass centre is half a thickness below them."""
    mesh = read(QUAD + "*SHELL SECTION, ELSET=s, MATERIAL=steel, OFFSET=SPOS\n.01\n" + STEEL)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    R = model.rigid_body()
    M = R.T @ (model.M @ R)
    assert M[0, 4] / M[0, 0] == pytest.approx(-0.005, rel=1e-9)  # int z dm over the mass


COMPOSITE = "*SHELL SECTION, ELSET=s, COMPOSITE{more}\n.001, 3, ud, 0.\n.002, 3, ud, 90.\n*MATERIAL, NAME=ud\n"
LAMINA = "*ELASTIC, TYPE=LAMINA\n1.4e11, 1e10, .3, 5e9, 4e9, 3.5e9\n*DENSITY\n1600.\n"


def test_laminates(read):
    shell = read(QUAD + COMPOSITE.format(more="") + LAMINA).properties["s"]
    assert [(p.thickness, p.angle) for p in shell.plies] == [(0.001, 0.0), (0.002, pytest.approx(math.pi / 2))]
    m = shell.plies[0].material
    assert (m.E1, m.E2, m.nu12, m.G12, m.G13, m.G23, m.rho) == (1.4e11, 1e10, 0.3, 5e9, 4e9, 3.5e9, 1600.0)


def test_symmetric_laminates_and_their_offset(read):
    shell = read(QUAD + COMPOSITE.format(more=", SYMMETRIC, OFFSET=SNEG") + LAMINA).properties["s"]
    assert [p.thickness for p in shell.plies] == [0.001, 0.002, 0.002, 0.001]
    assert shell.offset == pytest.approx(0.003)


AXES = {
    "none": ("", "", (1, 0, 0)),
    "coordinates": (", ORIENTATION=o", "*ORIENTATION, NAME=o\n0, 1, 0, -1, 0, 0\n3, 0.\n", (0, 1, 0)),
    "turned about the normal": (", ORIENTATION=o", "*ORIENTATION, NAME=o\n1, 0, 0, 0, 1, 0\n3, 90.\n", (0, 1, 0)),
    "the normal is axis 1": (", ORIENTATION=o", "*ORIENTATION, NAME=o\n0, 0, 1, 1, 0, 0\n1, 0.\n", (1, 0, 0)),
    "about an axis z": (
        ", ORIENTATION=o", "*ORIENTATION, NAME=o, SYSTEM=CYLINDRICAL\n0, 0, 0, 0, 0, 1\n3, 0.\n", (2**-0.5, 2**-0.5, 0)
    ),
    "by a distribution": (
        ", ORIENTATION=o",
        "*DISTRIBUTION, NAME=d, LOCATION=ELEMENT, TABLE=t\n, 1, 0, 0, 0, 1, 0\n1, 0, 1, 0, -1, 0, 0\n"
        "*ORIENTATION, NAME=o\nd\n3, 0.\n", (0, 1, 0),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("option", "more", "axis"), AXES.values(), ids=AXES)
def test_axis_1_of_laminates(read, option, more, axis):
    mesh = read(QUAD + COMPOSITE.format(more=option) + LAMINA + more)
    np.testing.assert_allclose(mesh.data["axis"]["quad"], [axis], atol=1e-15)


def test_axis_1_where_x_is_normal_to_the_shell(read):
    turned = (
        QUAD.replace("2, 1, 0, 0", "2, 0, 1, 0").replace("3, 1, 1, 0", "3, 0, 1, 1").replace("4, 0, 1, 0", "4, 0, 0, 1")
    )
    mesh = read(turned + COMPOSITE.format(more="") + LAMINA)
    np.testing.assert_allclose(mesh.data["axis"]["quad"], [[0, 0, 1]])


def test_orthotropic_materials_of_shells(read):
    """Engineering constants, and the same by their stiffnesses D1111, D1122, D2222, D1133, ..., D1212, D1313, D2323."""
    E1, E2, E3, n12, n13, n23, G12, G13, G23 = 1.4e11, 1e10, 0.9e10, 0.3, 0.28, 0.4, 5e9, 4e9, 3.5e9
    S = np.array([[1 / E1, -n12 / E1, -n13 / E1], [-n12 / E1, 1 / E2, -n23 / E2], [-n13 / E1, -n23 / E2, 1 / E3]])
    D = np.linalg.inv(S)
    stiffnesses = [D[0, 0], D[0, 1], D[1, 1], D[0, 2], D[1, 2], D[2, 2], G12, G13]
    decks = (
        f"ENGINEERING CONSTANTS\n{E1}, {E2}, {E3}, {n12}, {n13}, {n23}, {G12}, {G13}\n{G23}\n",
        "ORTHO\n" + ", ".join(map(repr, map(float, stiffnesses))) + f",\n{G23}, 293.\n",
    )
    for text in decks:
        mesh = read(QUAD + "*SHELL SECTION, ELSET=s, MATERIAL=ud\n.01\n*MATERIAL, NAME=ud\n*ELASTIC, TYPE=" + text)
        m = mesh.properties["s"].material
        assert (m.E1, m.E2, m.nu12, m.G12, m.G13, m.G23) == pytest.approx((E1, E2, n12, G12, G13, G23), rel=1e-9)
        assert np.isfinite(mesh.data["axis"]["quad"]).all()


def test_of_temperatures_the_first_holds(read):
    text = STEEL.replace("2e11, 0.25\n", "2e11, 0.25, 20.\n1e11, 0.25, 600.\n").replace(
        "7800.\n", "7800., 20.\n7000., 600.\n"
    )
    mesh = read(CUBE + text)
    assert (mesh.properties["c"].material.E, mesh.properties["c"].material.rho) == (2e11, 7800.0)
    assert mesh.notes == tuple(f"material Steel: of its temperatures the first holds (line {n})" for n in (14, 17))


def test_materials_without_density_are_noted(read):
    mesh = read(CUBE + STEEL[: STEEL.index("*DENSITY")])
    assert mesh.notes == ("material Steel has no density: its elements have no mass",)


def test_orthotropic_solids_along_axes_of_their_own(static):
    """A cube of fibres along y: tension along y extends it by E1, along x by E2."""
    E1, E2, E3 = 1.4e11, 1e10, 0.9e10
    wood = (
        f"*MATERIAL, NAME=steel\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{E1}, {E2}, {E3}, .3, .28, .4, 5e9, 4e9\n3e9\n"
    )
    wood += "*DENSITY\n500.\n*ORIENTATION, NAME=o\n0, 1, 0, -1, 0, 0\n3, 0.\n"
    text = CUBE.replace("MATERIAL=steel", "MATERIAL=steel, ORIENTATION=o") + wood
    u = static(text + "*BOUNDARY\n1, 1, 3\n5, 2\n2, 2, 3\n6, 2\n", {(n, 1): 250.0 for n in (3, 4, 7, 8)})
    assert u[2, 1] == pytest.approx(1000 / E1, rel=1e-9)
    assert u[1, 0] == pytest.approx(-0.3 * 1000 / E1, rel=1e-9)


def test_stiffnesses_of_solids_in_the_order_of_abaqus(read):
    """D1111, D1122, D2222, ...: column by column of the upper triangle, strains 11, 22, 33, 12, 13, 23."""
    names = ("11", "22", "33", "12", "13", "23")
    C = np.eye(6) * 1e11 + 1e8 * np.add.outer(np.arange(6), np.arange(6))
    given = [C[i, j] for j in range(6) for i in range(j + 1)]
    lines = "\n".join(", ".join(f"{x!r}" for x in map(float, given[k : k + 8])) for k in (0, 8, 16))
    text = CUBE + f"*MATERIAL, NAME=steel\n*ELASTIC, TYPE=ANISOTROPIC\n{lines}\n*DENSITY\n1000.\n"
    mesh = read(text)
    ours = ("11", "22", "33", "12", "23", "13")
    order = [names.index(name) for name in ours]
    np.testing.assert_allclose(mesh.properties["c"].material.moduli(), C[np.ix_(order, order)], rtol=1e-12)
    np.testing.assert_allclose(mesh.data["frame"]["hexahedron"], [np.eye(3)])


def test_shear_factors_of_the_shapes():
    """The table of the Abaqus Analysis User's Guide, "Choosing a beam element": transverse shear stiffness."""
    table = {
        "RECT": 0.85, "CIRC": 0.89, "PIPE": 0.53, "THICK PIPE": 0.89, "BOX": 0.44, "I": 0.44, "T": 0.44, "L": 1.0,
        "TRAPEZOID": 0.822,
    }  # fmt: skip
    assert {kind: SHAPES[kind][1](*sizes).k for kind, sizes in SIZES.items()} == table
    assert SHAPES["ARBITRARY"][1](1, 0.0, 0.0, 1.0, 0.0, 0.01).k == 1.0


def test_a_section_of_one_element_by_its_number(read):
    """Where no set has the name, it is the number of an element."""
    mesh = read(
        NODES
        + "*ELEMENT, TYPE=T3D2\n1, 1, 2\n2, 2, 3\n"
        + "*SOLID SECTION, ELSET=1, MATERIAL=steel\n2e-4\n*SOLID SECTION, ELSET=2, MATERIAL=steel\n3e-4\n"
        + STEEL
    )
    areas = {mesh.groups[name]["line"].tolist()[0]: truss.A for name, truss in mesh.properties.items()}
    assert areas == {0: 2e-4, 1: 3e-4}


def test_engineering_constants_of_solids_in_mm(read):
    """Moduli in MPa, ratios as they are."""
    wood = (
        "*MATERIAL, NAME=steel\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n14e3, 1e3, 900., .3, .28, .4, 500., 400.\n300.\n"
    )
    wood += "*DENSITY\n5e-10\n*ORIENTATION, NAME=o\n0, 1, 0, -1, 0, 0\n3, 0.\n"
    material = (
        read(CUBE.replace("MATERIAL=steel", "MATERIAL=steel, ORIENTATION=o") + wood, "mm", "t").properties["c"].material
    )
    assert (material.E1, material.E3, material.G23, material.rho) == pytest.approx((14e9, 0.9e9, 0.3e9, 500.0))
    assert (material.nu12, material.nu13, material.nu23) == (0.3, 0.28, 0.4)


def test_springs_along_axes_of_their_own(read):
    """Component 1 of an orientation whose first axis is y."""
    text = BEAM + SECTION + STEEL + "*ELEMENT, TYPE=SPRING1, ELSET=s\n9, 3\n*SPRING, ELSET=s, ORIENTATION=o\n1\n1e6\n"
    mesh = read(text + "*ORIENTATION, NAME=o\n0, 1, 0, -1, 0, 0\n")
    np.testing.assert_allclose(mesh.data["frame"]["vertex"], [[[0, 1, 0], [-1, 0, 0], [0, 0, 1]]], atol=1e-15)
    assert mesh.properties["s"].translation == (1e6, 0, 0)


def test_axes_of_solids_by_their_third(read):
    """Z RECTANGULAR: the first point lies on the third axis, the second in the plane of the first and third."""
    wood = "*MATERIAL, NAME=steel\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n14e9, 1e9, 9e8, .3, .28, .4, 5e8, 4e8\n3e8\n"
    wood += "*DENSITY\n500.\n*ORIENTATION, NAME=o, SYSTEM=Z RECTANGULAR\n0, 0, 2, 0, 3, 1\n3, 0.\n"
    mesh = read(CUBE.replace("MATERIAL=steel", "MATERIAL=steel, ORIENTATION=o") + wood)
    np.testing.assert_allclose(mesh.data["frame"]["hexahedron"], [[[0, 1, 0], [-1, 0, 0], [0, 0, 1]]], atol=1e-15)


def test_direction_of_walls_behind_their_lines(read):
    """n1 stands behind all walls; a channel that is symmetric about axis 1 has no other principal axes."""
    walls = "3, .05, -.05, 0, -.05, .01\n0, .05, .01\n.05, .05, .01\n"
    section = f"*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=ARBITRARY\n{walls}0, 0, 1\n"
    up = read(BEAM + section + STEEL).data["up"]["line"]
    np.testing.assert_allclose(np.abs(up), [[0, 1, 0], [0, 1, 0]], atol=1e-12)  # n2 = t x n1


def test_springs_of_unlike_components_are_refused(read):
    text = BEAM + SECTION + STEEL + "*ELEMENT, TYPE=SPRING2, ELSET=t\n8, 2, 3\n*SPRING, ELSET=t\n1, 2\n2e4\n"
    with pytest.raises(mp.InputError, match="joins unlike components"):
        read(text)


def test_layers_without_material_are_refused(read):
    with pytest.raises(mp.InputError, match="the layer has no material"):
        read(QUAD + "*SHELL SECTION, ELSET=s, COMPOSITE\n.001, 3\n" + STEEL)


def test_shear_stiffness_in_mm(read):
    """The factor K / (G A) has no unit."""
    text = BEAM + SECTION + "*TRANSVERSE SHEAR STIFFNESS\n1e6, 3e6\n" + STEEL
    ours, in_mm = (read(text, *units).properties["b"] for units in (("m", "kg"), ("mm", "t")))
    assert (ours.ky, ours.kz) == pytest.approx((3e6 / (G * 0.001), 1e6 / (G * 0.001)))
    assert (in_mm.ky, in_mm.kz) == pytest.approx((ours.ky, ours.kz))


def test_sections_without_product_of_inertia_keep_their_axes():
    """Also where the moment about axis 2 is the larger."""
    assert SHAPES["RECT"][1](0.05, 0.02).principal == pytest.approx((0.05 * 0.02**3 / 12, 0.02 * 0.05**3 / 12, 0.0))
