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


def floating(spin=0.0):
    """The shaft that floats in springs to the ground."""
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
    return mp.System(bodies={"shaft": shaft()}, joints=(joint,), loads=bearings)
