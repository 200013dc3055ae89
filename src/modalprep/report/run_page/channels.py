"""Which channels of a run its page shows, and their units."""

from __future__ import annotations

from collections.abc import Sequence

from modalprep.multibody.results.result import Result

UNITS = {  # by the last word of a name
    "angle": "rad",
    "rate": "rad/s",
    "displacement": "m",
    "speed": "m/s",
    "force": "N",
    "torque": "N m",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s²",
    "mass": "kg",
    "origin": "m",
    "position": "m",
    "velocity": "m/s",
    "deflection": "m",
    "semi_major_axis": "m",
    "length": "m",
    "tension": "N",
    "current": "A",
    "emf": "V",
    "modal": "m kg^½",
    "frame_acceleration": "m/s²",
    "frame_angular_velocity": "rad/s",
    "frame_angular_acceleration": "rad/s²",
}
AUDIT = {
    "energy": "J",
    "power.input": "W",
    "momentum.linear": "N s",
    "momentum.angular": "N m s",
    "momentum.error": "1",
}
INSIDE = (  # what other channels follow from, and numbers without a meaning of their own
    ".modal",
    ".modal_rate",
    ".modal_acceleration",
    ".orientation",
    ".quaternion",
    ".interface_loads",
    ".frame_acceleration",
    ".frame_angular_velocity",
    ".frame_angular_acceleration",
)


def shown_channels(run: Result, chosen: Sequence[str] = ()) -> list[str]:
    """Return the channels to show, of the chosen ones or of all: no recoveries, and none from which others follow.

    Examples
    --------
    >>> import numpy as np
    >>> names = ("hinge.angle", "arm.recovery.strut.1.N", "arm.modal")
    >>> run = Result(time=np.zeros(1), channels=dict.fromkeys(names, np.zeros(1)), status="done", message="")
    >>> shown_channels(run), shown_channels(run, ["arm.modal"])
    (['hinge.angle'], [])
    """
    known = [name for name in chosen if name in run] if chosen else list(run)
    return [name for name in known if not name.endswith(INSIDE) and ".recovery." not in name]


def channel_unit(run: Result, name: str) -> str:
    """Return the unit of a channel or of a component of one; an empty text where it depends on what it belongs to.

    Examples
    --------
    >>> import numpy as np
    >>> run = Result(time=np.zeros(1), channels={"tip.position": np.zeros((1, 3))}, status="done", message="")
    >>> channel_unit(run, "tip.position.z"), channel_unit(run, "energy.kinetic"), channel_unit(run, "arm.stress.a.xx")
    ('m', 'J', 'Pa')
    """
    if name in AUDIT or name.partition(".")[0] in AUDIT:
        return AUDIT.get(name, AUDIT.get(name.partition(".")[0], ""))
    if ".stress." in name:
        return "Pa"
    channel = name if name in run.channels else name.rpartition(".")[0]
    if channel in AUDIT:
        return AUDIT[channel]
    owner, _, word = channel.rpartition(".")
    if word == "acceleration":
        return "m/s²" if f"{owner}.position" in run.channels else ""
    return UNITS.get(word, "")
