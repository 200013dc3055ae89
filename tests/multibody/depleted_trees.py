"""Random trees whose bodies lose mass, with the gas that leaves."""

import numpy as np
from multibody.trees import integrals, particles, random_body, random_tree

import modalprep as mp
from modalprep.multibody import ExpelledGas


def fill_levels(seed, n, shares=(0.3,)):
    """A random body, and lighter ones of the same particles and modes; each particle loses a share of its own."""
    full = random_body(np.random.default_rng(seed), n)
    mass, x, shape = particles(np.random.default_rng(seed), n)
    rng, found = np.random.default_rng(seed + 1), []
    for share in shares:
        left = mass * share * rng.uniform(0.5, 1.5, 30)
        modal = np.einsum("p,pai,paj->ij", left, shape, shape)
        Kg = dict(Kg_A=0.9 * share * full.Kg_A, Kg_W=1.1 * share * full.Kg_W)
        found.append(full.with_(**integrals(left, x, shape), **Kg, modal_mass=modal))
    return full, tuple(found)


def depleted_tree(seed, rate=0.5):
    """A random tree whose first two bodies lose mass, with gas that flows from one to the other."""
    system = random_tree(seed, root=["free", "revolute", "weld", "prescribed"][seed % 4])
    bodies, depletions = dict(system.bodies), []
    for name in ("b0", "b1"):
        full, levels = fill_levels(seed, bodies[name].n, shares=(0.3, 0.8))
        bodies[name] = full
        mass = f"{0.9 * full.m} - {rate * full.m}*t**2"
        depletions.append(mp.multibody.Depletion(name=name, body=name, levels=levels, mass=mass))
    gas = (
        ExpelledGas(name="one", at="b1.a", source=depletions[0].mass, speed=3.0, pressure=2.0, mass_fraction=0.7,
                    axis=np.array([1.0, 2, 3]), flow_path=("b0.b", "b0.a", "b1.b")),
        ExpelledGas(name="two", at="b0.b", source=depletions[1].mass, speed=2.0, axis=np.array([0, 0, 1.0])),
    )  # fmt: skip
    return system.with_(bodies=bodies, depletions=tuple(depletions), loads=gas)
