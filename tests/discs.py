"""Rotors of one rigid disc, whose whirl is known in closed form."""

import numpy as np

import modalprep as mp

MASS, POLAR, ACROSS = 10.0, 0.2, 0.15  # kg, kg m^2
X = (1.0, 0.0, 0.0)


def disc(polar=POLAR, across=ACROSS):
    inertia = np.diag([polar, across, across])
    return mp.rigid_body("disc", mass=MASS, centre=np.zeros(3), inertia=inertia, interfaces={"hub": np.zeros(3)})


def held(stiffness, body=None):
    """A disc that floats in springs to the ground, which turn about x with nothing."""
    flight = mp.Joint(name="flight", type="free", parent="ground", child="disc")
    bearing = mp.multibody.Bushing(name="bearing", between=("ground", "disc.hub"), stiffness=stiffness)
    return mp.System(bodies={"disc": body or disc()}, joints=(flight,), loads=(bearing,))


def tilting(ky, kz, body=None):
    """A disc that turns and tilts in a gimbal: rotations about y, z with springs, and the spin about x."""
    spring = mp.multibody.HingeElement
    light = {"mass": 1e-3, "centre": np.zeros(3), "inertia": 1e-9 * np.eye(3), "interfaces": {"hub": np.zeros(3)}}
    ring = {name: mp.rigid_body(name, **light) for name in ("outer", "inner")}
    yaw = {"parent": "ground", "child": "outer", "axis": (0, 1, 0), "elements": spring(stiffness=ky)}
    pitch = {"parent": "outer.hub", "child": "inner", "axis": (0, 0, 1), "elements": spring(stiffness=kz)}
    joints = (
        mp.Joint(name="yaw", type="revolute", **yaw),
        mp.Joint(name="pitch", type="revolute", **pitch),
        mp.Joint(name="spin", type="revolute", parent="inner.hub", child="disc", axis=X),
    )
    return mp.System(bodies=ring | {"disc": body or disc()}, joints=joints)


def shaft_of_two_stiffnesses(k1, k2, inner=0.0, outer=0.0, supports=(0.0, 0.0)):
    """A mass on a turning massless shaft (k1, k2 along its own y, z; damping `inner`); the ground has springs too."""
    hub = mp.rigid_body("hub", mass=1e-3, centre=np.zeros(3), inertia=np.eye(3), interfaces={"end": np.zeros(3)})
    mass = mp.rigid_body("mass", mass=MASS, centre=np.zeros(3), inertia=np.eye(3), interfaces={"c": np.zeros(3)})
    slides = [
        mp.Joint(name="spin", type="revolute", parent="ground", child="hub", axis=X),
        mp.Joint(
            name="shaft",
            type="planar",
            parent="hub.end",
            child="mass",
            axis=X,
            second_axis=(0, 1, 0),
            elements=[mp.multibody.HingeElement(stiffness=k, damping=inner) for k in (k1, k2)]
            + [mp.multibody.HingeElement(stiffness=1e9)],
        ),
    ]
    casing = mp.multibody.Bushing(
        name="casing",
        between=("ground", "mass.c"),
        stiffness=[0, *supports, 0, 0, 0],
        damping=[0, outer, outer, 0, 0, 0],
    )
    return mp.System(bodies={"hub": hub, "mass": mass}, joints=slides, loads=(casing,))
