"""One rigid body on one joint to the ground."""

import numpy as np

import modalprep as mp

DOWN = np.array([0.0, -1.0, 0.0])


def rigid(mass=2.0, centre=(0.5, 0, 0), inertia=(0.1, 0.2, 0.3), **interfaces):
    ends = {"root": np.zeros(3)} | {name: np.array(at, dtype=float) for name, at in interfaces.items()}
    return mp.rigid_body("part", mass=mass, centre=np.array(centre), inertia=np.diag(inertia), interfaces=ends)


def carried(body, **joint):
    return mp.System(
        bodies={"part": body},
        joints=(mp.Joint(name="joint", parent="ground", child="part", **joint),),
        gravity=10 * DOWN,
    )
