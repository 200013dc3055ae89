"""Nastran cards one by one: replication, scalar masses, mass matrices, tubes, panels, materials, tapered beams."""

import math
import random
import time

import numpy as np
import pytest
from fe.decks import BAR, GRIDS, PBAR, STEEL
from size import cases

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.readers.coverage import Entry
from modalprep.fe.readers.nastran.registry import REGISTRY

GOOD = GRIDS + BAR + PBAR + STEEL

# ------------------------------------------------------------------ replication


def test_replicated_grids_and_bars(read):
    """The card before, its increments, and three more of the same."""
    mesh = read("GRID,1\nGRID,2,,1.\n=,*1,=,*1.\n=3\nCBAR,1,1,1,2,0.,0.,1.\n=,*1,=,*1,*1,==\n=(3)\n"
                "PBAR,1,7,.01,3.-6,2.-6,4.-6\n" + STEEL)  # fmt: skip
    assert mesh.labels.tolist() == [1, 2, 3, 4, 5, 6]
    assert mesh.points.tolist() == [[x, 0, 0] for x in range(6)]
    assert mesh.cells["line"].tolist() == [[k, k + 1] for k in range(5)]
    assert (mesh.data["up"]["line"] == [0, 0, 1]).all()


@pytest.mark.parametrize(
    ("line", "label", "x"),
    [
        ("=,*1,=,*-.5", 5, -0.5),
        ("=           *(1)       =   *(1.)", 5, 1.0),
        ("GRID,5,=,*1.", 5, 1.0),
        ("GRID,5,==", 5, 0.0),
        ("GRID*,5,=,*-1.5+1", 5, -15.0),
        ("=,*(1),==$ a comment", 5, 0.0),
    ],
)
def test_spellings_of_replication(read, line, label, x):
    """Grid 4 at (0, 1, 0) stands before; y repeats only by ==."""
    mesh = read(GRIDS + line + "\n" + BAR + PBAR + STEEL)
    assert mesh.points[mesh.labels == label][0] == pytest.approx([x, 1.0 if "==" in line else 0.0, 0])


def test_continuations_are_replicated_too(read):
    text = "CBAR,9,5,1,2,0.,1.,0.,,+\n+,,,.1,.2,.3\n=,*1,=,2,3,1.,0.,0.,,+\n+,,,=,*(.1),==\n"
    ends = read(GRIDS + text + PBAR + STEEL).data["ends"]["line"]
    np.testing.assert_allclose(ends[:, 0], [[0.1, 0.2, 0.3], [0.1, 0.3, 0.3]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("=,*1\n" + GRIDS, "line 1: = and .* repeat the card before, and there is none"),
        (GRIDS + "=3\n", r"line 5: =.n. repeats increments .* which has none"),
        (GRIDS + "CBAR,=,5\n", "line 5: = and .* repeat fields of GRID in a CBAR"),
        (GRIDS + "GRID,5,=,*1.\nCORD2R,3,*1\n", "repeat fields of GRID in a CORD2R"),
        (GRIDS + "GRID,ABC\n=,*1\n", "line 6: 'ABC' is no number that can increase"),
        (GRIDS + "=,*1,=,*1.\n=99999999\n", "line 6: more than 1000000 cards by replication"),
        (GRIDS + "=,*1,=,*1.\n=" + 5000 * "9" + "\n", "line 6: more than 1000000 cards by replication"),
    ],
)
def test_replication_of_nothing_is_refused(read, text, message):
    with pytest.raises(InputError, match=message):
        read(text + BAR + PBAR + STEEL)


# ------------------------------------------------------------------ masses


def test_scalar_masses_of_a_grid_are_one_mass(read):
    """2 kg in each direction by three cards, and an inertia about x; PMASS holds up to four."""
    mesh = read(
        GOOD + "CMASS2,1,2.,1,1\nCMASS2,2,2.,1,2\nCMASS1,3,8,,,1,3\nPMASS,6,5.,8,2.\nCMASS1,4,9,1,4\nPMASS,9,.7\n"
    )
    mass = mesh.properties["cmass_1"]
    assert (mass.mass, mass.inertia) == (2.0, (0.7, 0, 0, 0, 0, 0))


def test_scalar_masses_in_mm_and_t(read):
    mesh = read(
        GOOD + "".join(f"CMASS2,{c},2.,1,{c}\n" for c in (1, 2, 3)) + "CMASS2,4,5.,1,4\n", length=1e-3, mass=1e3
    )
    mass = mesh.properties["cmass_1"]
    assert (mass.mass, mass.inertia[0]) == pytest.approx((2000.0, 5e-3))


@pytest.mark.parametrize(
    ("cards", "message"),
    [
        ("CMASS2,1,2.,1,1\n", r"CMASS2 1: its mass acts in some directions only.* ignore = \['CMASS2'\]"),
        ("CMASS2,1,2.,1,1,2,1\n", "CMASS2 1: it joins two grids, or none"),
        ("CMASS1,1,2,1,1\n", "CMASS1 1: property 2 is not in the deck; add its PMASS"),
        ("CMASS4,1,2.,1\n", "CMASS4 1: 1 is a grid, of which it names no component; use CMASS1 or 2"),
        (
            "SPOINT,7\nCMASS4,1,2.,7\nMPC,3,7,0,1.,1,1,-1.\n",
            r"CMASS4 1: it acts on scalar point 7, which MPC 3 .* joins to grids; .* ignore = \['CMASS4'\]",
        ),
    ],
)
def test_scalar_masses_that_no_body_has(read, cards, message):
    with pytest.raises(InputError, match=message):
        read(GOOD + cards)
    assert "conm2_1" not in read(GOOD + cards, ignore=["CMASS1", "CMASS2", "CMASS4", "MPC"]).properties


def test_elements_between_scalar_points_are_apart(read):
    """An oscillator that nothing joins to the structure, with and without SPOINT, has a note and no effect."""
    alone = "SPOINT,7\nCELAS3,1,2,7,8\nCELAS4,2,1.+3,8\nPELAS,2,1.+3\nCMASS3,3,4,7\nPMASS,4,.5\nCMASS4,4,.5,8\n"
    mesh = read(GOOD + alone)
    assert "left out: 4 elements between scalar points, which nothing joins to grids (first CELAS3 1" in mesh.notes[0]
    plain = read(GOOD)
    assert (len(mesh.points), mesh.groups.keys()) == (len(plain.points), plain.groups.keys())


def test_mass_matrix_of_a_rigid_body_is_that_of_conm2(read):
    """CONM1 of 5 kg at (.1, .2, .3) with its inertia: M = [m, -m r~; m r~, J - m r~ r~], Nastran's lower triangle."""
    m, r, J = 5.0, np.array([0.1, 0.2, 0.3]), np.array([[1.0, -0.2, -0.3], [-0.2, 4.0, -0.5], [-0.3, -0.5, 9.0]])
    cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    M = np.block([[m * np.eye(3), -m * cross], [m * cross, J - m * cross @ cross]])
    values = [f"{v:.12g}" if "." in f"{v:.12g}" else f"{v:.12g}." for v in M[np.tril_indices(6)]]
    fields = ["3", "2", "", *values]
    rows = [fields[k : k + 8] for k in range(0, len(fields), 8)]
    system = "CORD2R,4,,0.,0.,0.,0.,0.,1.,+\n+,0.,1.,0.\n"
    for cid in ("", "4"):
        rows[0][2] = cid
        conm1 = "".join(",".join(["CONM1" if k == 0 else "", *row]) + "\n" for k, row in enumerate(rows))
        conm2 = f"CONM2,3,2,{cid or 0},5.,.1,.2,.3,,+\n+,1.,.2,4.,.3,.5,9.\n"
        found, expected = (read(GOOD + system + c).properties for c in (conm1, conm2))
        assert found["conm1_3"].mass == expected["conm2_3"].mass
        assert found["conm1_3"].offset == pytest.approx(expected["conm2_3"].offset)
        assert found["conm1_3"].inertia == pytest.approx(expected["conm2_3"].inertia)


# ------------------------------------------------------------------ rods, panels, materials


def test_tube_is_a_rod_with_a_hole(read):
    mesh = read(GRIDS + "CTUBE,1,2,1,2\nCTUBE,2,3,2,3\nPTUBE,2,7,.2,.01,.3\nPTUBE,3,7,.2,,,.1\n" + STEEL)
    tube, solid = mesh.properties["ptube_2"], mesh.properties["ptube_3"]
    assert pytest.approx(math.pi * (0.1**2 - 0.09**2)) == tube.A
    assert pytest.approx(math.pi / 2 * (0.1**4 - 0.09**4)) == tube.J
    assert (tube.nsm, pytest.approx(math.pi * 0.075**2)) == (0.3, solid.A)
    assert mesh.notes == ("PTUBE with OD2: the mean of both diameters holds along the whole rod",)


def test_shear_panel_in_a_frame_of_rods(read):
    """Pure shear of a rectangle 2 x 1 with hinged edges: F = G t a gamma along a side a (Garvey 1951)."""
    rods = "".join(f"CROD,{k},2,{k},{k % 4 + 1}\n" for k in (1, 2, 3, 4)) + "PROD,2,7,.01\n"
    mesh = read(GRIDS + rods + "CSHEAR,9,3,1,2,3,4\nPSHEAR,3,7,.005,.7,.5,2.\n" + STEEL)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    u = np.zeros(model.n_dof)
    u[model.dof[[2, 3], 0]] = 1e-3  # the upper side moves along x, gamma = 1e-3
    force = model.K @ u
    G = 2e11 / 2.6
    # rods along y turn only; the sheet keeps 1e-6 of its normal stiffness and has drilling stiffness at free rotations
    u[model.dof[:, 5]] = -0.5e-3  # rotations follow the shear's rotation, so that drilling has no energy
    force = model.K @ u
    assert force[model.dof[[2, 3], 0]].sum() == pytest.approx(G * 0.005 * 2 * 1e-3, rel=1e-5)
    assert [mesh.properties[f"cshear_9_f{k}"].A for k in (1, 2)] == pytest.approx([0.5 * 0.005 * 0.5, 2 * 0.005**2 / 2])
    assert model.rigid.m == pytest.approx(8000 * (0.005 * 2 + 0.01 * 6) + 0.7 * 2)


def test_a_material_with_young_s_modulus_alone(read):
    """Nastran sets NU and G to zero: a rod without torque, a bar almost without; a sheet keeps G = E / 2."""
    mesh = read(GRIDS + BAR + "PBAR,5,7,.01,3.-6,2.-6,4.-6,,,+\n+,,,,,,,,,+\n+,.8,.9\nCROD,3,2,2,3\nPROD,2,7,.01,3.-6\n"
                "CQUAD4,6,6,1,2,3,4\nPSHELL,6,7,.01\nMAT1,7,2.+11,,,8000.\n")  # fmt: skip
    bar, rod, sheet = (mesh.properties[name] for name in ("pbar_5", "prod_2", "pshell_6"))
    assert (bar.theory, rod.J, sheet.material.nu, sheet.material.G) == ("euler-bernoulli", 0.0, 0.0, 1e11)
    assert pytest.approx(1e-6 * 3e-6) == bar.J
    assert any("G = 0, as in Nastran" in note for note in mesh.notes)
    assert any("NU = 0 and G = E / 2" in note for note in mesh.notes)


def test_anisotropic_sheets(read):
    """MAT2 of a lamina: Q11 = E1 / (1 - nu12 nu21), Q12 = nu12 Q22, Q66 = G12; of MID3 the moduli across."""
    E1, E2, nu, G = 1e11, 2e10, 0.25, 5e9
    left = 1 - nu**2 * E2 / E1
    mat2 = f"MAT2,8,{E1 / left},{nu * E2 / left},0.,{E2 / left},0.,{G},1600.\nMAT2,9,4.+9,0.,0.,3.+9,0.,0.,1.\n"
    mesh = read(GRIDS + "CQUAD4,1,2,1,2,3,4\nPSHELL,2,8,.01,8,,9\n" + mat2)
    sheet = mesh.properties["pshell_2"]
    found = sheet.material
    assert [found.E1, found.E2, found.nu12, found.G12, found.rho] == pytest.approx([E1, E2, nu, G, 1600])
    assert (sheet.shear_material.G13, sheet.shear_material.G23) == (4e9, 3e9)
    with pytest.raises(InputError, match="MAT2 8: it couples shear with tension"):
        read(GRIDS + "CQUAD4,1,2,1,2,3,4\nPSHELL,2,8,.01\nMAT2,8,1.+9,1.+8,2.+8,1.+9,0.,1.+8,1.\n")


# ------------------------------------------------------------------ tapered beams


def test_a_tapered_beam_has_its_stations(read):
    """From A = .01 to .03 with .04 in the middle: the mean is (.01 + 2 * .04 + .03) / 4."""
    text = (GRIDS + BAR.replace("CBAR", "CBEAM") + "PBEAM,5,7,.01,3.-6,2.-6,,4.-6,,+\n+,,,,,,,,,+\n"
            "+,NO,1.,.03,5.-6,2.-6,,4.-6,,+\n+,NO,.5,.04,4.-6,2.-6,,4.-6,.1\n" + STEEL)  # fmt: skip
    beam = read(text).properties["pbeam_5"]
    assert [beam.A, beam.Iy, beam.nsm] == pytest.approx([0.03, 4e-6, 0.05])
    np.testing.assert_allclose(beam.taper, [[0, 0.01, 3e-6, 2e-6, 4e-6, 0], [0.5, 0.04, 4e-6, 2e-6, 4e-6, 0.1],
                                            [1, 0.03, 5e-6, 2e-6, 4e-6, 0]])  # fmt: skip


def test_a_tapered_beam_by_its_dimensions(read):
    text = "PBEAML,5,7,,ROD,,,,,+\n+,.1,.5,YES,1.,.2,.7\n"
    beam = read(GRIDS + BAR.replace("CBAR", "CBEAM") + text + STEEL).properties["pbeaml_5"]
    assert [beam.nsm, beam.kz, *beam.section_at(0)[:1], *beam.section_at(1)[:1]] == pytest.approx(
        [0.6, 0.9, math.pi / 100, math.pi / 25]
    )


def test_the_neutral_axis_of_a_beam_lies_beside_its_shear_centre(read):
    """N1 along y (our e3), N2 along z (our -e2): the grids are at the shear centre. A tee hangs from its flange."""
    text = (
        GRIDS
        + BAR.replace("CBAR", "CBEAM")
        + "PBEAM,5,7,.01,3.-6,2.-6,,4.-6,,+\n+,.1,.2\n+,.8,.8,,,,,,,+\n+,,,,,.03,.04\n"
    )
    beam = read(text + STEEL).properties["pbeam_5"]
    assert [*beam.offset, *beam.shear_centre] == pytest.approx([-0.04, 0.03, 0.04, -0.03])
    assert beam.fibres[0] == pytest.approx((-0.16, 0.07))
    for kind, sign in (
        ("T", -1),
        ("T2", 1),
    ):  # flange 60 x 10, stem 60 x 10: the centroid is 17.5 from the flange's middle
        text = GRIDS + BAR.replace("CBAR", "CBEAM") + f"PBEAML,5,7,,{kind},,,,,+\n+,.06,.07,.01,.01\n"
        assert read(text + STEEL).properties["pbeaml_5"].offset == pytest.approx((0, sign * 0.0175))
    text = GRIDS + BAR.replace("CBAR", "CBEAM") + "PBEAML,5,7,,I,,,,,+\n+,.1,.05,.05,.006,.01,.01\n"
    assert read(text + STEEL).properties["pbeaml_5"].offset == pytest.approx((0, 0))


def pinned(read, flags, axis="0.,1.,0."):
    """One bar of length 2 along x; section 3e-6, 2e-6, 4e-6."""
    mesh = read("GRID,1\nGRID,2,,2.\n" + f"CBAR,9,5,1,2,{axis},,+\n+,{flags}\n" + PBAR + STEEL)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    return model, model.K.toarray()


def test_pin_flags_release_the_ends_of_bars(read):
    """A bar held and propped: 3 E I / L^3 in plane 1, where PB = 6 releases the rotation about z; plane 2 stays."""
    model, K = pinned(read, "0,6")
    EI = 2e11 / 8  # over L^3
    assert K[model.dof[1, 1], model.dof[1, 1]] == pytest.approx(3 * EI * 3e-6)
    assert K[model.dof[1, 2], model.dof[1, 2]] == pytest.approx(12 * EI * 2e-6)
    assert abs(K[model.dof[1, 5]]).max() < 1e-9 * abs(K).max()
    model, K = pinned(read, "56,5")  # plane 2 hinged at both ends, plane 1 at the first
    assert K[model.dof[1, 1], model.dof[1, 1]] == pytest.approx(3 * EI * 3e-6)
    assert abs(K[model.dof[1, 2]]).max() < 1e-9 * abs(K).max()
    model, K = pinned(read, ",1234")  # only moments act
    assert K[model.dof[1, 5], model.dof[1, 5]] == pytest.approx(2e11 * 3e-6 / 2)
    assert abs(K[model.dof[1, :4]]).max() < 1e-9 * abs(K).max()


def test_pinned_bars_keep_the_mass_of_rigid_motions(read):
    """The mass follows the released shapes: a hinged bar falls as (m / 3) at its end (theory 1.5 for all of it)."""
    model, _ = pinned(read, "56,56")
    assert model.M[[model.dof[1, 1]], [model.dof[1, 1]]][0] == pytest.approx(8000 * 0.01 * 2 / 3, rel=1e-3)
    for check in mp.body.check_model(pinned(read, "4,56")[0]):
        assert check.passed, check


def test_offsets_in_the_axes_of_the_element(read):
    """OFFT = GOG: WA along GA-GB (mesh y), the orientation (mesh z) and across (mesh x); WB in the grid's axes."""
    text = "GRID,1\nGRID,2,,0.,2.\nCBAR,9,5,1,2,0.,.5,1.,GOG,+\n+,,,.1,.2,.3,.4,.5,.6\n"
    ends = read(text + PBAR + STEEL).data["ends"]["line"][0]
    assert ends == pytest.approx(np.array([[0.3, 0.1, 0.2], [0.4, 0.5, 0.6]]))


def test_pin_flags_that_make_a_mechanism_are_refused(read):
    with pytest.raises(InputError, match="the pin flags of a beam let it move without strain"):
        pinned(read, "4,4")
    with pytest.raises(InputError, match="CBAR 9: pin flags 78 are not made of the digits 1 to 6"):
        pinned(read, "78")


# ------------------------------------------------------------------ curved beams

QUARTER = "GRID,1\nGRID,2,,2.,2.\nGRID,9,,5.\nCBEND,7,3,1,2,{v},{geom}\nMAT1,7,2.+11,,.3,8000.\n"  # centre (0, 2)


@pytest.mark.parametrize(
    ("geom", "v"), [(1, "0.,1.,0."), (2, "1.,0.,0."), (3, "1.,0.,0."), (4, "2.,-1.,0."), (2, "9,,")]
)
def test_a_quarter_of_a_ring(read, geom, v):
    """Its grids lie on the circle; pi F R^3 / 4 E I1 at the free end along the radius (Castigliano, thin)."""
    mesh = read(QUARTER.format(v=v, geom=geom) + "PBEND,3,7,1.-4,1.-9,2.-9,3.-9,2.,90.\n")
    assert np.linalg.norm(mesh.points[[0, 1, *range(3, 18)]] - [0, 2, 0], axis=1) == pytest.approx(np.full(17, 2.0))
    assert mesh.points[10] == pytest.approx([2 * math.sin(math.pi / 4), 2 - 2 * math.cos(math.pi / 4), 0])
    assert mesh.labels[[2, 3, -1]].tolist() == [9, 10, 24]
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    free = np.setdiff1d(np.arange(model.n_dof), model.dof[0])
    f = np.zeros(model.n_dof)
    f[model.dof[1, 0]] = 1.0  # the radius at (2, 2) is along x
    u = np.linalg.solve(model.K.toarray()[np.ix_(free, free)], f[free])[np.searchsorted(free, model.dof[1, 0])]
    assert u == pytest.approx(math.pi * 8 / (4 * 2e11 * 1e-9), rel=3e-3)  # sixteen chords
    assert mesh.notes == ("CBEND: the arc is followed by 16 straight beams between new grids",)


def test_three_quarters_of_a_ring_and_pipes(read):
    """THETAB = 270: the centre lies on the side of the orientation. A pipe has RM and T behind FSI."""
    mesh = read(QUARTER.format(v="0.,1.,0.", geom=4) + "PBEND,3,7,1,.1,.01,,2.,270.\n")
    centre = mesh.points[[0, 1, *range(3, 18)]]
    assert np.linalg.norm(centre - [0, 2, 0], axis=1) == pytest.approx(np.full(17, 2.0))
    assert mesh.points[10] == pytest.approx([-2 * math.sin(math.pi / 4), 2 + 2 * math.cos(math.pi / 4), 0])
    assert mesh.properties["pbend_3"].A == pytest.approx(2 * math.pi * 0.1 * 0.01)


def test_a_sixth_of_a_ring(read):
    """THETAB = 60: the radius is the chord, and the centre lies sqrt(3) / 2 of it beside the middle."""
    mesh = read(QUARTER.format(v="2.,-1.,0.", geom=4) + "PBEND,3,7,1.-4,1.-9,2.-9,3.-9,,60.\n")
    chord = 2 * math.sqrt(2)
    centre = np.array([1, 1, 0]) + math.sqrt(3) / 2 * chord * np.array([-1, 1, 0]) / math.sqrt(2)
    found = np.linalg.norm(mesh.points[[0, 1, *range(3, 18)]] - centre, axis=1)
    assert found == pytest.approx(np.full(17, chord))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (QUARTER.format(v="1.,1.,0.", geom=2) + "PBEND,3,7,1.-4,1.-9,2.-9,3.-9\n", "CBEND 7: GEOM is not 1 to 4, or"),
        (
            QUARTER.format(v="1.,0.,0.", geom=3) + "PBEND,3,7,1.-4,1.-9,2.-9,3.-9,1.\n",
            "CBEND 7: RB = 1 is less than half",
        ),
        (QUARTER.format(v="1.,0.,0.", geom=4) + "PBEND,3,7,1.-4,1.-9,2.-9,3.-9,,180.\n", "THETAB is not between"),
        (QUARTER.format(v="1.,0.,0.", geom=2), "CBEND 7: its property is not in the deck"),
    ],
)
def test_arcs_that_are_none(read, text, message):
    with pytest.raises(InputError, match=message):
        read(text)


# ------------------------------------------------------------------ registry and fuzz


def test_every_card_says_what_becomes_of_it():
    assert len(REGISTRY) > 250
    for name, entry in REGISTRY.items():
        assert isinstance(entry, Entry)
        wanted = {"read": [True], "approximated": [True], "refused": [False], "no effect": [True, False]}
        assert (entry.handle is not None) in wanted[entry.treatment], name
        assert entry.remark.endswith(".") or (
            not entry.remark and entry.treatment not in ("refused", "approximated")
        ), name


FUZZED = (
    GOOD
    + "GRID,5,,3.,0.,0.\n=,*1,=,*1.\n=2\nCBEAM,10,6,2,3,0.,0.,1.\nPBEAML,6,7,,HAT1,,,,,+\n+,.14,.07,.08,.01,.02,.1\n"
    "CMASS2,1,2.,1,1\nCMASS2,2,2.,1,2\nCMASS2,3,2.,1,3\nCTUBE,3,2,1,3\nPTUBE,2,7,.2,.01\nCSHEAR,11,3,1,2,3,4\n"
    "PSHEAR,3,7,.005,.7,.5,.5\nCONM1,12,1,,1.,0.,1.,0.,0.,+\n+,1.,0.,0.,0.,1.\nPBEAM,8,7,.1,1.-3,1.-3,,1.-3,,+\n"
    "+,NO,1.,.2,1.-3\nCBEAM,13,8,3,4,0.,0.,1.,,+\n+,45,6\nPARAM,COUPMASS,1\nMAT2,9,1.+9,1.+8,,1.+9,,1.+8,1.\n"
    "FORCE,31,2,,10.,0.,1.,0.\nMOMENT1,31,2,5.,1,3\nPLOAD4,32,41,6.,,,,THRU,49\nGRAV,33,,9.81,0.,0.,-1.\n"
    "CQUAD4,41,42,1,2,3,4\nPSHELL,42,7,.01,7,,7\nLOAD,34,2.,1.,31,3.,32,1.,33\nEIGRL,35,,200.,9\nTABDMP1,36,CRIT\n,10.,.02,ENDT\nPARAM,G,.02\n"
    "CBUSH,37,38,1,2,,,,0,+\n+,,0,.5,0.,0.\nPBUSH,38,K,3.+5,4.+5\n,,M,2.\nRSPLINE,39,.1,1,2,123,3\n"
)


def test_mutated_decks_are_read_or_refused(read):
    """Decks with fields and lines changed at random: nothing but the error for the user, and no hang."""
    rng = random.Random(7)
    words = [
        "",
        "-1",
        "0",
        "1",
        "2",
        "99",
        "1.",
        "-1.",
        "1.+30",
        "1.-30",
        "X",
        "THRU",
        "=",
        "==",
        "*1",
        "*(1.)",
        "=(9)",
        "456",
    ]
    start, refused = time.perf_counter(), 0
    count = cases(1000)
    for _ in range(count):
        lines = FUZZED.splitlines()
        for _ in range(rng.randint(1, 3)):
            k = rng.randrange(len(lines))
            fields = lines[k].split(",")
            fields[rng.randrange(len(fields))] = rng.choice(words)
            lines[k] = ",".join(fields)
            if rng.random() < 0.2:
                lines.insert(rng.randrange(len(lines)), lines[rng.randrange(len(lines))])
        try:
            read("\n".join(lines) + "\n")
        except InputError:
            refused += 1
    assert 0.2 * count < refused < count
    assert time.perf_counter() - start < 120  # some 4 ms a deck; a hang would be a million cards


def test_axes_of_materials_in_the_middle_of_a_solid(read):
    """CORDM of a cylindrical system: of a cube about the point r = 2, theta = 90 the first axis is y, the second -x."""
    grids = [(x, y, z) for z in (0, 1) for x, y in ((-0.5, 1.5), (0.5, 1.5), (0.5, 2.5), (-0.5, 2.5))]
    deck = "".join(f"GRID,{k},,{x},{y},{z}.\n" for k, (x, y, z) in enumerate(grids, 1))
    deck += "CORD2C,4,,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\nCHEXA,9,5,1,2,3,4,5,6,+\n+,7,8\nPSOLID,5,7,4\n"
    deck += "MAT11,7,1.+10,2.+10,3.+10,.1,.2,.3,4.+9,+\n+,5.+9,6.+9,500.\n"
    frame = read(deck).data["frame"]["hexahedron"][0]
    assert frame == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), abs=1e-12)


@pytest.mark.parametrize(("k1", "k2"), [(0.7, 0.0), (0.0, 0.6)])
def test_shear_flexibility_of_one_plane(read, k1, k2):
    beam = read(GRIDS + BAR + f"PBAR,5,7,.01,3.-6,2.-6,4.-6,,,+\n+,,,,,,,,,+\n+,{k1},{k2}\n" + STEEL).properties[
        "pbar_5"
    ]
    assert (beam.theory, beam.kz, beam.ky) == ("timoshenko", k1 or 1e6, k2 or 1e6)


def test_bars_without_bending_in_mm(read):
    """A is in mm^2, J in mm^4."""
    deck = GRIDS + BAR + "PBAR,5,7,100.,0.,0.,40.,3.-6\nMAT1,7,2.1+5,,.3,7.8-9\n"
    truss = read(deck, length=1e-3, mass=1e3).properties["pbar_5"]
    assert (truss.A, truss.J, truss.nsm) == pytest.approx((100e-6, 40e-12, 3.0))


@pytest.mark.parametrize("number", [7, 8])
def test_the_21_moduli_of_a_solid(read, number):
    """MAT9: the upper triangle row by row, then the density; MAT9 8 repeats all three lines."""
    grids = "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in enumerate(np.ndindex(2, 2, 2), 1))
    C = (np.eye(6) * 9e10 + 1e9 * np.add.outer(np.arange(6), np.arange(6)))[np.triu_indices(6)]
    values = [f"{x:.2e}" for x in C]
    card = "MAT9,7," + ",+\n+,".join(map(",".join, (values[:7], values[7:15], [*values[15:], "500."]))) + "\n"
    deck = grids + "CHEXA,9,5,1,5,7,3,2,6,+\n+,8,4\nPSOLID,5," + f"{number}\n"
    material = read(deck + card + "=,*1,==\n,==\n,==\n").properties["psolid_5"].material
    assert material.C == pytest.approx(C)
    assert material.rho == 500.0


def test_orientations_may_be_short(read):
    """The length of the vector does not count."""
    short = read(GRIDS + BAR.replace("0.,1.,0.", "0.,1.-6,0.") + PBAR + STEEL)
    np.testing.assert_allclose(short.data["up"]["line"], read(GOOD).data["up"]["line"])


def test_flanges_of_a_panel_in_mm(read):
    """F1 = 1: half of the panel's area stands at each of both sides."""
    deck = GRIDS + BAR + PBAR + "CSHEAR,8,3,1,2,3,4\nPSHEAR,3,7,.5,,1.,1.\n" + STEEL
    mesh = read(deck, length=1e-3, mass=1e3)
    areas = [mesh.properties[f"cshear_8_f{k}"].A for k in (1, 2)]
    assert areas == pytest.approx([0.5 * 1 / 2 * 1e-6, 0.5 * 2 / 2 * 1e-6])


def test_a_station_with_its_dimension_alone(read):
    """SO and X/XB are blank: the station is the end."""
    deck = GRIDS + BAR.replace("CBAR", "CBEAM") + "PBEAML,5,7,,ROD,,,,,+\n+,.02,,,,.01\n" + STEEL
    beam = read(deck).properties["pbeaml_5"]
    [(x, A, *_)] = [station for station in beam.taper if station[0] > 0]
    assert (x, A) == pytest.approx((1.0, math.pi * 1e-4))


def test_bushings_of_a_mesh_without_properties(read):
    """A deck that has elements only, as for matrices of another program, needs no PBUSH."""
    mesh = read(GRIDS + "CBUSH,9,5,1,2,,,,0\n")
    assert mesh.cells["line"].tolist() == [[0, 1]]
    assert not mesh.properties


def test_moduli_of_sheets_may_be_small_numbers(read):
    """In units in which they are below one."""
    sheet = read(GRIDS + "CQUAD4,1,2,1,2,3,4\nPSHELL,2,8,.01\nMAT2,8,.4,.1,,.5,,.2,1.\n").properties["pshell_2"]
    assert (sheet.material.E2, sheet.material.nu12) == pytest.approx((0.5 - 0.1**2 / 0.4, 0.1 / 0.5))
