"""Impossible values are refused at every door alike, odd angles and ratios are noted, headers of tables have units."""

import re

import numpy as np
import pytest
from bad.good import BDF
from bad.keys import base, system
from bad.test_keys import written

import modalprep as mp
from modalprep.ensemble.parameters import Parameters
from modalprep.examples import beam_mesh
from modalprep.fe.properties.materials import Material
from modalprep.fe.properties.plausible import implausible_sections
from modalprep.fe.properties.points import PointMass
from modalprep.fe.properties.properties import Shell
from modalprep.multibody import AxialSpring, Bushing, Closure, HingeElement, RotationalSpring
from modalprep.multibody.model.chain import SegmentedBeam
from modalprep.multibody.model.depletion import ExpelledGas, deplete
from modalprep.multibody.model.environment import Dipole, Orbit
from modalprep.pipeline.building.reduce import implausible_ratios
from modalprep.pipeline.schema.columns import points_of_file

IMPOSSIBLE = [0.0, 0.0, 5.0]  # kg m^2: a thin disc has 2 to 1 to 1 at most
ROOT = {"root": np.zeros(3)}


def rigid(**changes):
    given = {"mass": 1.0, "centre": np.zeros(3), "inertia": np.eye(3), "interfaces": ROOT}
    return mp.rigid_body("hub", **given | changes)


def joint(**changes):
    return mp.Joint(**{"name": "j", "type": "revolute", "parent": "ground", "child": "hub"} | changes)


def single(**changes):
    return mp.System(**{"bodies": {"hub": rigid()}, "joints": (joint(),)} | changes)


def gas(**changes):
    given = {"name": "jet", "at": "hub.root", "source": SOURCE, "speed": 100.0, "axis": [1, 0, 0]}
    return ExpelledGas(**given | changes)


ENDS, TURN = ("ground", "b.tip"), ([0, 0, 1.0], 0.1)
BEAM = {"length": 1.0, "segments": 6, "mass_per_length": 1.0, "EI": 10.0, "curvature": 1e6}
SOURCE = deplete(2.0, 1.0, 0.1)
PYTHON = [
    (lambda: rigid(inertia=np.diag(IMPOSSIBLE)), "inertia is physically impossible"),
    (lambda: rigid(inertia=np.full((3, 3), np.nan)), "3 x 3 finite numbers"),
    (lambda: rigid(mass=np.inf), "mass = inf must be positive"),
    (lambda: rigid(centre=[np.nan, 0, 0]), "three numbers below 1e+30 m"),
    (lambda: rigid(interfaces={}), "needs an interface"),
    (lambda: rigid(interfaces={"a/b": np.zeros(3)}), "'a/b' has '/' in its name"),
    (lambda: single(joints=(joint(name="a/b"),)), "joint 'a/b' has '/' in its name"),
    (lambda: single(loads=(mp.PointForce(name="a\0", at="hub.root"),)), "in its name"),
    (lambda: joint(angle=np.nan), "angle nan must be finite"),
    (lambda: joint(type="free", velocity=2.0), "velocity 2.0 must be 3 number"),
    (lambda: joint(velocity=[1.0, 0, 0]), "a revolute joint has no velocity; it starts with angle, rate"),
    (lambda: joint(motion="t", rate=1.0), "'rate' has no effect beside 'motion'"),
    (lambda: Parameters(single(joints=(joint(motion="t"),)), ["j.angle"]).change([0.3]), "no effect beside 'motion'"),
    (lambda: Parameters(single(), ["j.velocity.x"]), "'j' has axis, pitch, position, angle, rate"),
    (lambda: HingeElement(limit_stiffness=1e5), "'limit_stiffness' has no effect without 'lower' or 'upper'"),
    (lambda: Closure(name="c", type="weld", a="hub.root", b="x.y", position=[1, 0, 0]), "'position' has no effect"),
    (lambda: Closure(name="c", type="distance", a="hub.root", b="x.y", axis=[1, 0, 0]), "'axis' has no effect where"),
    (lambda: Closure(name="c", type="distance", a="hub.root", b="x.y", rotation=TURN), "'rotation' has no effect"),
    (lambda: Bushing(name="m", between=ENDS, damping=[1.0] * 6, free_position=[1.0, 0, 0]), "'free_position' has"),
    (lambda: AxialSpring(name="s", between=ENDS, damping=1.0, free_length=0.1), "'free_length' has no effect"),
    (lambda: AxialSpring(name="s", between=ENDS, stiffness=1.0, tension_only=True), "it is never slack"),
    (lambda: RotationalSpring(name="s", between=ENDS, damping=1.0, free_angle=0.1), "'free_angle' has no effect"),
    (lambda: Dipole(strength=3e-5, longitude=0.1), "'longitude' has no effect without 'tilt'"),
    (lambda: Orbit(rate=1e-3, radius=7e6, dipole=Dipole(strength=3e-5), argument_of_latitude=0.1), "untilted dipole"),
    (lambda: mp.Event(name="e", when="t", restitution=0.5), "'restitution' has no effect without 'impacts'"),
    (lambda: mp.Event(name="e", when="t", terminal=True, deactivates=["c"]), "'deactivates' has no effect beside"),
    (lambda: gas(mass_fraction=3.0), "mass_fraction = 3 must not exceed 1"),
    (lambda: single(loads=(gas(mass_fraction=0.6), gas(name="b", mass_fraction=0.6))), "add up to 1.2, above 1"),
    (lambda: SegmentedBeam(name="b", **BEAM), "half a turn"),
    (lambda: mp.correlation.correlate(None, None, smallest_mac=2.0), "smallest_mac = 2 must lie between 0 and 1"),
    (lambda: mp.simulate(single(), t_end=1.0, reference=True, method="rosenbrock"), "explicit"),
    (lambda: mp.simulate(single(), t_end=1.0, method="explicit", rho_inf=0.5), "rho_inf"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "said"), PYTHON, ids=[row[1] for row in PYTHON])
def test_python_refuses(make, said):
    with pytest.raises(mp.InputError, match=re.escape(said)):
        make()


DEPLETION = {"body": "b", "empty": {"mass": 0.5, "inertia": [0.1, 0.1, 0.1]}, "rate": 0.5}
JET = {"at": "b.tip", "depletion": "d", "speed": 100.0, "axis": [1, 0, 0]}
FILES = [
    ({"bodies": {"d": {"mass": 1.0, "inertia": IMPOSSIBLE}}}, "[bodies.d.inertia]: inertia is physically impossible"),
    ({"depletions": {"d": DEPLETION | {"empty": {"mass": 0.5, "inertia": IMPOSSIBLE}}}}, "physically impossible"),
    ({"depletions": {"d": DEPLETION | {"intermediate": [{"mass": 2.5}]}}}, "an intermediate level has 2.5 kg"),
    ({"depletions": {"d": DEPLETION}, "jets": {"j": JET | {"mass_fraction": 3.0}}}, "less than or equal to 1"),
    ({"beams": {"x": BEAM}}, "half a turn"),
    ({"springs": {"a/b": {"between": ["ground", "b.tip"]}}}, "spring 'a/b' has '/' in its name"),
    ({"jets": {"a/b": JET}, "depletions": {"d": DEPLETION}}, "jet 'a/b' has '/' in its name"),
]  # fmt: skip


@pytest.mark.parametrize(("tables", "said"), FILES, ids=[row[1] for row in FILES])
def test_pipeline_files_refuse(tmp_path, tables, said):
    with pytest.raises(mp.InputError, match=re.escape(said)):
        system(written(tmp_path, base() | {key: base().get(key, {}) | value for key, value in tables.items()}))


def test_the_sum_of_two_exits_is_possible():
    assert len(single(loads=(gas(mass_fraction=0.5), gas(name="b", mass_fraction=0.5))).loads) == 2


def test_angles_in_degrees_are_noted(tmp_path):
    file = base()
    file["joints"]["r"] |= {"start": {"angle": 90.0}, "limits": {"lower": -180.0, "stiffness": 1e3}}
    notes = system(written(tmp_path, file))[1].notes
    assert "the angle of [joints.r.start], 90 rad, is implausible: did you mean '90 deg'?" in notes
    assert "the lower of [joints.r.limits], -180 rad, is implausible: did you mean '-180 deg'?" in notes
    file["joints"]["r"] |= {"start": {"angle": "90 deg"}, "limits": {"lower": "-180 deg", "stiffness": 1e3}}
    assert not system(written(tmp_path, file))[1].notes


def test_an_angle_of_a_sheet_in_degrees_is_noted():
    alloy = Material(E=70e9, nu=0.3, rho=2700.0)
    sheet = Shell(material=alloy, thickness=1e-3, angle=90.0)
    assert "did you mean 90 deg?" in implausible_sections({"skin": sheet}, 1.0)[0]
    assert not implausible_sections({"skin": Shell(material=alloy, thickness=1e-3, angle=np.pi / 2)}, 1.0)


@pytest.mark.parametrize("given", [50.0, {10.0: 0.01, 20.0: 2.0}, np.array([0.1, 3.0])])
def test_damping_above_critical_is_noted(given):
    assert "is implausible" in implausible_ratios(given)[0]
    assert not implausible_ratios(0.02)


HEADERS = [  # header, units, factors of both columns, from the definitions of the units
    ("angle (deg),torque (N mm)", (("rad",), ("N m",)), np.pi / 180, 1e-3),
    ("angle [°],torque [kN m]", (("rad",), ("N m",)), np.pi / 180, 1e3),
    ("t (ms),value", (("s",), ()), 1e-3, 1.0),
    ("t,force (lbf)", (("s",), ()), 1.0, 4.4482216152605),
    ("f (kHz),a (g)", (("Hz",), ("m/s^2",)), 1e3, 9.80665),
    ("rate (rpm),torque (N m)", (("rad/s",), ("N m",)), np.pi / 30, 1.0),
    ("angle,torque", (("rad",), ("N m",)), 1.0, 1.0),
]


@pytest.mark.parametrize(("header", "units", "first", "second"), HEADERS)
def test_headers_say_the_units(tmp_path, header, units, first, second):
    file = tmp_path / "points.csv"
    file.write_text(f"{header}\n0,0\n90,2000\n180,3000\n")
    x, y = points_of_file(file, units)
    np.testing.assert_allclose(x, first * np.array([0, 90, 180]), rtol=1e-14)
    np.testing.assert_allclose(y, second * np.array([0, 2000, 3000]), rtol=1e-14)


@pytest.mark.parametrize(
    ("header", "said"), [("angle (mm),torque", "another dimension than rad"), ("angle,torque (Nmm)", "'Nmm'")]
)
def test_headers_with_other_units(tmp_path, header, said):
    file = tmp_path / "points.csv"
    file.write_text(f"{header}\n0,0\n1,2\n")
    with pytest.raises(mp.InputError, match=said):
        points_of_file(file, (("rad",), ("N m",)))


def test_a_characteristic_in_degrees_is_that_in_radians(tmp_path):
    """A spring of 0.02 N m/rad, at 2 N mm for 0.1 rad."""
    rows = "".join(f"{float(np.degrees(angle))!r},{20 * angle!r}\n" for angle in (0.0, 0.1, 0.2))
    (tmp_path / "deg.csv").write_text(f"angle (deg),torque (N mm)\n{rows}")
    table = {"between": ["ground", "b.tip"], "characteristic": {"file": "deg.csv"}}
    file = base() | {"rotational_springs": {"s": table}}
    spring = system(written(tmp_path, file))[1].loads[0]
    np.testing.assert_allclose(spring.characteristic[0], [0.0, 0.1, 0.2], rtol=1e-12)
    np.testing.assert_allclose(spring.characteristic[1], 0.02 * np.array([0.0, 0.1, 0.2]), rtol=1e-12)


def test_a_case_without_stiffness_or_friction_is_no_fault(tmp_path):
    """Zero among the values of a parameter leaves the keys beside it without effect, in that case only."""
    spring = AxialSpring(name="s", between=("ground", "hub.root"), stiffness=1.0, free_length=0.1)
    case = Parameters(single(loads=(spring,)), ["s.stiffness"]).change([0.0])
    assert (case.loads[0].stiffness, case.loads[0].free_length) == (0.0, 0.1)
    with pytest.raises(mp.InputError, match="'free_length' has no effect without 'stiffness'"):
        Parameters(single(loads=(spring.with_(stiffness=0.0, free_length=0.0),)), ["s.free_length"]).change([0.1])
    plane = {"type": "point_on_plane", "a": "a.tip", "b": "c.root", "transition_velocity": 0.5}
    file = base() | {"closures": {"x": plane | {"friction_coefficient": 0.0}}}
    file["joints"]["r"] = {"type": "free", "child": "c.root"}
    assert system(written(tmp_path, file))[1].closures[0].friction_coefficient == 0.0
    with pytest.raises(mp.InputError, match="'transition_velocity' has no effect without 'friction_coefficient'"):
        system(written(tmp_path, file | {"closures": {"x": plane}}))


def test_a_point_mass_with_a_negative_moment_is_refused(tmp_path):
    said = "point mass: inertia has a negative principal moment: [-0.1, 0.1, 0.3]"
    with pytest.raises(mp.InputError, match=re.escape(said)):
        PointMass(mass=1.0, inertia=(0.1, 0.1, 0.1, 0.2, 0.0, 0.0))
    deck = tmp_path / "deck.bdf"
    deck.write_text(BDF.replace("ENDDATA", "CONM2,21,3,,1.0,,,,,+\n+,.1,-.2,.1,,,.1\nENDDATA"))
    with pytest.raises(mp.InputError, match=f"deck.bdf line 11: CONM2 21: {re.escape(said)}"):
        mp.read_mesh(deck)


def test_a_point_mass_that_no_body_can_be_is_noted(tmp_path):
    """Of the principal moments of a rigid body none exceeds the sum of the others; lumped models have such inertias."""
    deck = tmp_path / "deck.bdf"
    deck.write_text(BDF.replace("ENDDATA", "CONM2,21,3,,1.0,,,,,+\n+,.1,,.1,,,.3\nENDDATA"))
    notes = mp.assemble(mp.read_mesh(deck), {}, {"root": mp.Interface(node=1, kind="node")}).notes
    assert any("the inertia of 'conm2_21' is physically impossible: of its principal moments" in note for note in notes)


@pytest.mark.parametrize("far", [1e308, 1e160, np.inf, np.nan])
def test_a_mesh_beyond_the_universe_is_refused(far):
    """Powers of it are no numbers."""
    mesh = beam_mesh(2)
    points = np.array(mesh.points)
    points[-1, 0] = far
    alloy = Material(E=70e9, nu=0.3, rho=2700.0)
    beam = mp.Beam(material=alloy, A=1e-4, Iy=1e-8, Iz=1e-8, J=1e-8)
    with pytest.raises(mp.InputError, match="mesh: 1 of 3 nodes have coordinates that are not numbers below 1e"):
        mp.assemble(mesh.with_(points=points), {"beam": beam}, {"root": mp.Interface(node=1, kind="node")})
    with pytest.raises(mp.InputError, match=r"beam section A = .* must be"):
        mp.Beam(material=alloy, A=far, Iy=1e-8, Iz=1e-8, J=1e-8)
