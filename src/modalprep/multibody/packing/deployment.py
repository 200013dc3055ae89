"""Pack deployments for the kernel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from modalprep.multibody.kernels.data import PRESCRIBED
from modalprep.multibody.kernels.loads.deployment import AT, REEL, SPRING, Reels
from modalprep.multibody.kernels.loads.loads import Loads
from modalprep.multibody.model.deployment import Deployment, Stage, bending_lengths
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import Packed


def pack_reels(
    deployments: Sequence[Deployment], stages: Sequence[Stage], system: System, packed: Packed, loads: Loads
) -> Reels:
    """Return the arrays of deployments in their stages.

    Examples
    --------
    >>> from modalprep.multibody.model.deployment_law import first_stage
    >>> from modalprep.multibody.deploying.system import DeployingSystem
    >>> from modalprep.multibody.packing.tree import pack
    >>> from modalprep.multibody.packing.loads import pack_loads
    >>> boom = Deployment(name="boom", parent="ground", length=4.0, segments=2, mass_per_length=1.0, EI=3.0,
    ...                   deployed_length="3.0")
    >>> stages = [first_stage(boom)]
    >>> system = DeployingSystem(bodies={}, joints=(), deployments=(boom,)).at(stages)
    >>> packed = pack(system)
    >>> pack_reels((boom,), stages, system, packed, pack_loads(system, packed, 1.0)).spring[:, 2:5].tolist()
    [[0.002, 1.374, 0.25]]
    """
    at, reel, spring_at, springs = [], [], [], []
    row_of = {int(u): row for row, u in enumerate(loads.hinge_at[:, 1])}
    for k, (d, stage) in enumerate(zip(deployments, stages, strict=True)):
        at.append(_at(d, system, packed))
        reel.append([d.mass_per_length, d.rotary_inertia, d.rod_length, d.length, stage.inner(d)])
        for number, numbers in _springs(d, stage):
            u = packed.speeds_of(f"{d.name}{number}")[0]
            spring_at.append((k, row_of[u]))
            springs.append([d.EI, d.damping, *numbers])
    bases = sorted({row[3] for row in at if row[3] >= 0})
    return Reels(
        at=np.array(at, dtype=np.int64).reshape(-1, AT),
        reel=np.array(reel, dtype=float).reshape(-1, REEL),
        base=np.array(bases, dtype=np.int64),
        spring_at=np.array(spring_at, dtype=np.int64).reshape(-1, 2),
        spring=np.array(springs, dtype=float).reshape(-1, SPRING),
    )


def _at(d: Deployment, system: System, packed: Packed) -> tuple[int, ...]:
    slider = packed.links_of(d.name)[0]
    row, driven = packed.model.links[slider], packed.types[slider] in PRESCRIBED
    found = locate(system.bodies, d.parent, f"deployment {d.name!r}")
    base = (packed.link_of(found[0]), found[1]) if found else (-1, 0)
    place, speed = (-1, -1) if driven else (int(row["x"]), packed.nx + int(row["u"]))
    return slider, place, speed, *base


def _springs(d: Deployment, stage: Stage) -> Iterator[tuple[int, list[float]]]:
    """Yield the three hinges next to the exit: rod, length that bends as a polynomial of r, rest that fades."""
    if d.guided:
        bends = bending_lengths(d, stage.rods)
        for k, rest in zip(
            range(stage.rods - 1, 0, -1), (stage.vanishing_angle, -stage.vanishing_angle, 0.0), strict=False
        ):
            yield k, [*bends[:, k - 1], rest]
