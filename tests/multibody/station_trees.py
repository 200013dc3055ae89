"""Random bodies with stations, and trees of them."""

from __future__ import annotations

import numpy as np
from multibody.trees import particles, random_body

import modalprep as mp
from modalprep.body.stations.record import Stations
from modalprep.examples import uniform_beam

PARENTS = [-1, 0, 0, 2, -1]


def random_stations(seed, n):
    """A random body of particles, its stations a tree with two branches at the root."""
    rng = np.random.default_rng(seed)
    body = random_body(np.random.default_rng(seed), n, damping=True).with_(T=None)
    mass, x, shape = particles(np.random.default_rng(seed), n)
    of = np.sort(rng.integers(0, len(PARENTS), len(mass)))
    of[: len(PARENTS)] = range(len(PARENTS))
    groups = [of == p for p in range(len(PARENTS))]
    centre = np.array([mass[g] @ x[g] / mass[g].sum() for g in groups])
    arms = [x[g] - c for g, c in zip(groups, centre, strict=True)]
    pairs = list(zip(groups, arms, strict=True))
    stations = Stations(
        parent=np.array(PARENTS), m=np.array([mass[g].sum() for g in groups]), centre=centre,
        E=np.array([np.einsum("p,pa,pb->ab", mass[g], r, r) for g, r in pairs]),
        S=np.array([np.einsum("p,pai->ai", mass[g], shape[g]) for g in groups]),
        H=np.array([np.einsum("p,pb,pai->abi", mass[g], r, shape[g]) for g, r in pairs]),
        owner=np.array([-1, 1, 3]), part=np.array([-1, 1, 3]),
    )  # fmt: skip
    return body.with_(stations=stations)


def station_tree(seed, beam=None):
    """A body with stations on a skew hinge carries one without and one with them."""
    beam = beam or random_stations(seed, 3)
    tip, end = beam.interface_name[1], beam.interface_name[-1]
    bodies = {"arm": beam, "plain": uniform_beam(modes=2), "more": random_stations(seed + 7, 3)}
    return mp.System(
        bodies=bodies, gravity=np.array([1.0, 2, -9]),
        joints=(
            mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=[0.3, 1, 0.2]),
            mp.Joint(name="ball", type="spherical", parent=f"arm.{tip}", child="plain"),
            mp.Joint(name="second", type="revolute", parent=f"arm.{end}", child="more", axis=[1, 0, 0]),
        ),
    )  # fmt: skip
