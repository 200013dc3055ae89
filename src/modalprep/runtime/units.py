"""Units of the channels of a run, for programs that import it."""

from __future__ import annotations

from collections.abc import Collection

from modalprep.multibody.model.system import System

BASE = {  # of the units of all variables, in powers of the SI's
    "1": {},
    "s": {"s": 1},
    "kg": {"kg": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N/m": {"kg": 1, "s": -2},
    "N.s/m": {"kg": 1, "s": -1},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "kg.m/s": {"kg": 1, "m": 1, "s": -1},
    "kg.m2/s": {"kg": 1, "m": 2, "s": -1},
}
OF_PART = {  # last part of a channel's name
    "angle": "rad",
    "rate": "rad/s",
    "displacement": "m",
    "speed": "m/s",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s2",
    "frame_acceleration": "m/s2",
    "frame_angular_velocity": "rad/s",
    "frame_angular_acceleration": "rad/s2",
    "force": "N",
    "torque": "N.m",
    "origin": "m",
    "position": "m",
    "velocity": "m/s",
    "deflection": "m",
    "mass": "kg",
    "length": "m",
    "tension": "N",
}
RATE_OF = {"rad": "rad/s", "rad/s": "rad/s2", "m": "m/s", "m/s": "m/s2", "J": "W"}  # units of rates
ABOUT = {  # last part of a channel's name, where it is not the description itself
    "rate": "rate of the angle",
    "speed": "rate of the displacement",
    "drive": "force or torque of drive, spring and damper",
    "modal": "modal coordinate (m sqrt(kg))",
    "modal_rate": "rate of the modal coordinate (m sqrt(kg)/s)",
    "origin": "position of the frame, inertial axes,",
    "orientation": "quaternion w, x, y, z of the frame",
    "position": "position, inertial axes,",
    "velocity": "velocity, inertial axes,",
    "deflection": "elastic deflection, axes of the body,",
    "multiplier": "force of the condition",
    "violation": "error of the condition",
}
OF_TOTAL = {"linear": "kg.m/s", "angular": "kg.m2/s", "input": "W"}


def about_channel(label: str) -> str:
    """Return the description of a channel.

    Examples
    --------
    >>> about_channel("arm.tip.position[2]"), about_channel("energy.kinetic")
    ('position, inertial axes, of arm.tip, component 2', 'kinetic energy')
    """
    name, _, number = label.partition("[")
    owner, _, part = name.rpartition(".")
    if owner in ("energy", "momentum", "power"):
        text = f"{part} {owner}" if part != "work" else "work of forces, drives and prescribed motions"
    else:
        text = f"{ABOUT.get(part, part.replace('_', ' '))} of {owner}"
    return f"{text}, component {number[:-1]}" if number else text


def unit_of(system: System, name: str, channels: Collection[str]) -> str:
    """Return the unit of a channel; empty where it is not known, as that of a multiplier.

    Examples
    --------
    >>> from modalprep.examples import small_systems
    >>> system = small_systems()["rigid bodies in trees"]
    >>> unit_of(system, "energy.kinetic", ()), unit_of(system, "hinge.acceleration", ("hinge.angle",))
    ('J', 'rad/s2')
    """
    owner, _, part = name.rpartition(".")
    if owner in ("energy", "momentum", "power"):
        return OF_TOTAL.get(part, "J")
    if part in ("acceleration", "drive"):
        turns = f"{owner}.angle" in channels
        return ("rad/s2" if turns else "m/s2") if part == "acceleration" else ("N.m" if turns else "N")
    parts = name.split(".")
    if len(parts) > 2 and parts[1] == "stress":
        return "Pa"
    if len(parts) > 2 and parts[1] == "recovery":
        return _of_recovery(system, parts)
    return OF_PART.get(part, "")


def _of_recovery(system: System, parts: list[str]) -> str:
    """Return the unit of a recovered quantity that `BASE` knows."""
    block = system.bodies[parts[0]].recovery.get(parts[2])
    if block is None or len(block.units) != len(block.components):  # each place has units of its own
        return ""
    unit = dict(zip(block.components, block.units, strict=True)).get(parts[-1], "")
    return unit if unit in BASE else ""
