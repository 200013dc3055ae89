"""A rotor whose modes reach from 14 Hz to far above: derivatives of stiff coordinates, and of those that turn nodes."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, uniform_beam
from modalprep.multibody.analysis.linearise import _column_error

# Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines, Cambridge 2010, example 5.9.1: six equal elements
LENGTH, D, E, G, RHO = 1.5, 0.05, 211e9, 81.2e9, 7810.0
BEARING = 1e6  # N/m across, at both ends
AT_REST = [86.65811, 274.31285, 716.78631]  # rad/s, each double; with these elements, by ROSS
SPIN = 4000 * 2 * np.pi / 60
SPINNING = {"backward": [85.38947, 251.78460], "forward": [87.79586, 294.71333]}


def disc(width, outer):
    mass = RHO * np.pi / 4 * (outer**2 - D**2) * width
    polar = mass / 8 * (outer**2 + D**2)
    across = polar / 2 + mass * width**2 / 12
    return mp.PointMass(mass=mass, inertia=(polar, across, across, 0.0, 0.0, 0.0))


def shaft():
    A, second = np.pi / 4 * D**2, np.pi / 64 * D**4
    nu = E / (2 * G) - 1
    shear = 6 * (1 + nu) / (7 + 6 * nu)  # Cowper, J. Applied Mechanics 33 (1966) 335, of a circle
    steel = mp.Material(E=E, nu=nu, rho=RHO)
    mesh = beam_mesh(6, LENGTH)
    places = {"root": 0, "tip": 6, "one": 2, "two": 4}
    mesh = mesh.with_(
        cells={**mesh.cells, "vertex": np.array(list(places.values()))[:, None]},
        groups={"beam": mesh.groups["beam"]} | {x: {"vertex": np.array([k])} for k, x in enumerate(places)},
    )
    properties = {
        "beam": mp.Beam(material=steel, A=A, Iy=second, Iz=second, J=2 * second, ky=shear, kz=shear),
        "one": disc(0.07, 0.28),
        "two": disc(0.07, 0.35),
    }
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(mesh, properties, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=36), name="shaft")


@pytest.fixture(scope="module")
def rotor():
    def at(spin):
        joint = mp.Joint(name="flight", type="free", parent="ground", child="shaft", angular_velocity=[spin, 0, 0])
        bearings = tuple(
            mp.multibody.Bushing(
                name=f"bearing {end}",
                between=("ground", f"shaft.{end}"),
                stiffness=[0.0, BEARING, BEARING, 0.0, 0.0, 0.0],
                position=[x, 0.0, 0.0],
            )
            for end, x in (("root", 0.0), ("tip", LENGTH))
        )
        return mp.System(bodies={"shaft": body}, joints=(joint,), loads=bearings)

    body = shaft()
    return at


def rates(system):
    """Return the positive imaginary parts of the eigenvalues of A, and the largest real part of all."""
    values = np.linalg.eigvals(mp.linearise(system).A)
    return np.sort(values.imag[values.imag > 1.0]), values.real.max()


def test_at_rest(rotor):
    found, growth = rates(rotor(0.0))
    bending = [found[np.argmin(np.abs(found - rate)) + k] for rate in AT_REST for k in (0, 1)]
    assert bending == pytest.approx(np.repeat(AT_REST, 2), rel=1e-7)  # the digits printed
    assert growth < 1e-6  # 1/s: nothing damps, nothing drives


def test_whirl_in_the_turning_axes(rotor):
    """The body's axes turn: a forward whirl is slower there by the spin, a backward whirl is faster."""
    found, growth = rates(rotor(SPIN))
    expected = [SPIN + rate for rate in SPINNING["backward"]] + [SPIN - rate for rate in SPINNING["forward"]]
    nearest = [found[np.argmin(np.abs(found - rate))] for rate in expected]
    assert nearest == pytest.approx(expected, rel=1e-7)
    assert growth < 1e-6


def test_derivatives_that_are_not_known_are_refused():
    """A force whose slope changes within any step: 1e-3 sin(1e9 x)."""
    mass = mp.rigid_body("mass", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"c": np.zeros(3)})
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="mass")

    def rough(t, state):
        x = state.joint("slide").position
        return {"slide": -x + 1e-3 * np.sin(1e9 * x)}

    load = mp.multibody.Callback(name="rough", function=rough)
    with pytest.raises(mp.SimulationError, match="accurate to .* only"):
        mp.linearise(mp.System(bodies={"mass": mass}, joints=(slide,), loads=(load,)))


def test_errors_count_relative_to_their_column():
    """A column of 1 beside one of 1e6: an error of 1e-8 in the first is 1e-8, though it is 1e-14 of the largest."""
    of = np.array([[1.0, 1e6, 0.0, 0.0], [0.5, 1e6, 0.0, 0.0]])
    error = np.zeros_like(of)
    error[0, 0] = 1e-8
    assert _column_error(error, of, np.ones(2)) == pytest.approx(1e-8)
    error[:] = 0.0
    error[0, 2] = 1e-8  # damping that is not there, beside a rate of 1e3/s: counts as 1e-6 of this rate
    assert _column_error(error, of, np.ones(2)) == pytest.approx(1e-8 / (1e-6 * 1e3))
    assert _column_error(np.zeros((1, 2)), np.zeros((1, 2)), np.ones(1)) == 0.0  # a free body at rest


@pytest.mark.parametrize("gravity", [0.0, 9.81])
@pytest.mark.parametrize("drive", [(), ("0.1",)])
def test_accelerations_are_rates_of_velocities(gravity, drive):
    """``a = v'`` as outputs of a turning flexible beam, with and without loads and elements at its hinge."""
    elements = tuple(mp.multibody.HingeElement(drive=each) for each in drive)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", rate=2.0, elements=elements)
    system = mp.System(bodies={"beam": uniform_beam(modes=3)}, joints=(hinge,), gravity=[0.0, -gravity, 0.0])
    outputs = [f"beam.tip.{what}.{axis}" for axis in "xy" for what in ("velocity", "acceleration")]
    linear = mp.linearise(system, inputs=["hinge"], outputs=outputs)
    assert linear.D[1::2] == pytest.approx(linear.C[::2] @ linear.B, rel=1e-9, abs=1e-12)
    assert linear.error < 1e-9
