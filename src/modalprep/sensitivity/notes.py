"""What a user should know of derivatives of a run, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from modalprep.multibody.model.loads import AxialSpring, Callback
from modalprep.multibody.model.system import System
from modalprep.multibody.results.validity import large_deflections
from modalprep.sensitivity.course import Course
from modalprep.sensitivity.observed import ChannelSlopes


def notes_of(course: Course, slopes: ChannelSlopes) -> tuple[str, ...]:
    """Return how derivatives were found, and where they are to be taken with care."""
    found = [*kinks(course.system), *_singular(course), *_deflected(course)]
    forces = [repr(course.parameters[along.number].name) for along in course.model.beside]
    if forces:
        found.append(f"by differences of the forces at given accelerations: derivatives by {', '.join(forces)}")
    start = course.options.start
    if isinstance(start, str) and start != "rest":
        found.append(f"by differences of the start {start!r} between systems: its derivatives")
    if slopes.differenced:
        names = ", ".join(map(repr, slopes.differenced))
        found.append(f"by differences of the channel at given states: {names}")
    return tuple(found)


def _singular(course: Course) -> Iterator[str]:
    if course.run.change_points.looks:
        yield "the run comes near a singular position of closed loops, where derivatives lose digits"


def _deflected(course: Course) -> Iterator[str]:
    """Return what a run says of deflections that are too large for modes."""
    packed, bodies = course.model.packed, course.system.bodies
    modal = {name: course.states[:, packed.modes_of(name)] for name, body in bodies.items() if body.n}
    yield from large_deflections(bodies, course.times, modal)


def kinks(system: System) -> Iterator[str]:
    """Return sentences on the laws of a system whose slopes jump, or change within a small speed.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> stop = HingeElement(upper=1.0, limit_stiffness=1e4)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=stop)
    >>> list(kinks(System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))))
    ["joint 'hinge' has limits: derivatives are of one side where a step touches or leaves one"]
    """
    for joint in system.joints:
        if any(element.limited for element in joint.elements):
            yield f"joint {joint.name!r} has limits: derivatives are of one side where a step touches or leaves one"
        if any(element.friction for element in joint.elements):
            yield f"joint {joint.name!r} has friction: derivatives change quickly where it sticks or slides"
    for load in system.loads:
        if isinstance(load, Callback):
            yield f"by differences of its forces at given states: derivatives of callback {load.name!r}"
        if isinstance(load, AxialSpring) and load.tension_only:
            yield f"spring {load.name!r} can go slack: derivatives are of one side where it does within a step"
