"""Pack deployments for the kernel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from modalprep.multibody.kernels.loads.deployment import REEL, SPRING, Reels
from modalprep.multibody.model.deployment import NEAR_EXIT, Deployment, Stage, bending_lengths
from modalprep.multibody.model.joint_types import PRESCRIBED
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import blank, rows


def pack_reels(deployments: Sequence[Deployment], stages: Sequence[Stage], system: System, packed: Packed) -> Reels:
    """Return the arrays of deployments in their stages.

    Examples
    --------
    >>> from modalprep.multibody.model.deployment_law import first_stage
    >>> from modalprep.multibody.deploying.system import DeployingSystem
    >>> from modalprep.multibody.packing.tree import pack
    >>> boom = Deployment(name="boom", parent="ground", length=4.0, segments=2, mass_per_length=1.0, EI=3.0,
    ...                   deployed_length="3.0")
    >>> stages = [first_stage(boom)]
    >>> system = DeployingSystem(bodies={}, joints=(), deployments=(boom,)).in_stages(stages)
    >>> packed = pack(system)
    >>> pack_reels((boom,), stages, system, packed).springs.bend.tolist()
    [[0.002, 1.374, 0.25]]
    """
    reels, springs = [], []
    for k, (d, stage) in enumerate(zip(deployments, stages, strict=True)):
        constants = (d.mass_per_length, d.rotary_inertia, d.rod_length, d.length, stage.inner(d))
        reels.append((*_place(d, system, packed), *constants))
        for number, bend, rest in _springs(d, stage):
            hinge = f"{d.name}{number}"
            place = packed.coordinates_of(hinge)[0], packed.speeds_of(hinge)[0]
            springs.append((k, *place, d.EI, d.damping, bend, rest))
    found = rows(REEL, reels)
    return Reels(found, rows(SPRING, springs), np.unique(found.carrier[found.carrier >= 0]))


@cache
def no_reels() -> Reels:
    """Return the arrays of a system without deployments, the same for all: nothing is written to them."""
    return Reels(blank(REEL, 0), blank(SPRING, 0), np.zeros(0, dtype=np.int64))


def _place(d: Deployment, system: System, packed: Packed) -> tuple[int, ...]:
    """Return the first five fields of a reel."""
    slider = packed.links_of(d.name)[0]
    row = packed.model.links[slider]
    driven = packed.types[slider] == PRESCRIBED
    found = locate(system.bodies, d.parent, f"deployment {d.name!r}")
    base = (packed.link_of(found[0]), found[1]) if found else (-1, 0)
    coordinate, speed = (-1, -1) if driven else (int(row["x"]), packed.nx + int(row["u"]))
    return slider, coordinate, speed, *base


def _springs(d: Deployment, stage: Stage) -> Iterator[tuple[int, np.ndarray, float]]:
    """Yield the hinges next to the exit: rod, length that bends as a polynomial of r, rest angle that fades."""
    if d.guided:
        bends = bending_lengths(d, stage.rods)
        rests = (stage.vanishing_angle, -stage.vanishing_angle, 0.0)
        for k, rest in zip(range(stage.rods - 1, 0, -1), rests[:NEAR_EXIT], strict=False):
            yield k, bends[:, k - 1], rest
