"""A rotor of beams with two discs, in bearings that are the same across: published digits."""

import functools

import numpy as np

import modalprep as mp
from modalprep.examples import beam_mesh

# Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines, Cambridge 2010, example 5.9.1: six equal elements
LENGTH, D, E, G, RHO = 1.5, 0.05, 211e9, 81.2e9, 7810.0
BEARING = 1e6  # N/m across, at both ends
AT_REST = [86.65811, 274.31285, 716.78631]  # rad/s, each double; with these elements, by ROSS
SPIN = 4000 * 2 * np.pi / 60
SPINNING = {"backward": [85.38947, 251.78460], "forward": [87.79586, 294.71333]}

UNEQUAL = {"lateral": (1e6, 0.8e6), "damping": 100.0}  # example 5.9.2, with dampers; ROSS 2.3.0 of PyPI:
OF_UNEQUAL = {
    "frequency": [82.326426104, 86.8642841884, 239.6520900602, 287.2673424014, 583.5136541258],  # rad/s at 4000 rpm
    "decrement": [1.4067234566e-02, 1.1336294367e-02, 6.6258925723e-02, 5.7731512126e-02, 9.7815472657e-02],
    "rpm": [1000.0, 2000.0, 2700.0],  # at which 1e-3 kg m at the tip move the root by, m in y and z
    "y": [7.4703481014e-06, 2.2696149289e-05, 1.4841891243e-03],
    "z": [9.1080248386e-06, 4.7131478685e-05, 9.5520530575e-04],
    "phase": [3.13308076, 3.1057247827, 1.1610654271],  # of y, rad
}


def disc(width, outer):
    mass = RHO * np.pi / 4 * (outer**2 - D**2) * width
    polar = mass / 8 * (outer**2 + D**2)
    across = polar / 2 + mass * width**2 / 12
    return mp.PointMass(mass=mass, inertia=(polar, across, across, 0.0, 0.0, 0.0))


@functools.cache
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


def floating(spin=0.0, lateral=(BEARING, BEARING), damping=0.0):
    """The shaft that floats in springs to the ground, which may differ in y and z."""
    joint = mp.Joint(name="flight", type="free", parent="ground", child="shaft", angular_velocity=[spin, 0, 0])
    bearings = tuple(
        mp.multibody.Bushing(
            name=f"bearing {end}",
            between=("ground", f"shaft.{end}"),
            stiffness=[0.0, *lateral, 0.0, 0.0, 0.0],
            damping=[0.0, damping, damping, 0.0, 0.0, 0.0],
            position=[x, 0.0, 0.0],
        )
        for end, x in (("root", 0.0), ("tip", LENGTH))
    )
    return mp.System(bodies={"shaft": shaft()}, joints=(joint,), loads=bearings)
