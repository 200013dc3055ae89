"""Names of coordinates and speeds, the same in histories, states, linear equations, control laws and events.

``hinge.angle`` and ``hinge.rate``, ``slide.displacement`` and ``slide.speed``, ``arm.modal.1`` and
``arm.modal_rate.1``. Where a joint has several of a kind they are numbered: ``gimbal.angle.2``,
``ball.angular_velocity.3``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

from modalprep.multibody.model.joint_types import KINDS, PRESCRIBED
from modalprep.multibody.packing.packed import Packed


class Words(NamedTuple):
    """What the numbers of a link's joint are called.

    Attributes
    ----------
    position : tuple of str
        Of its coordinates.
    change : tuple of str
        Of small changes of them, as many as speeds: a shift and a rotation in the axes of the child instead of a
        displacement in those of the parent and a quaternion.
    rate : tuple of str
        Of its speeds.
    """

    position: tuple[str, ...] = ()
    change: tuple[str, ...] = ()
    rate: tuple[str, ...] = ()


class CoordinateNames(NamedTuple):
    """Names of the nu coordinates of a system, or of small changes of them, and of its nu speeds."""

    coordinates: tuple[str, ...]
    speeds: tuple[str, ...]


def words_of(packed: Packed, link: int) -> Words:
    """Return what the numbers of the joint of a link are called, a prescribed one included."""
    kind = KINDS[packed.types[link]]
    if kind.named or packed.types[link] == PRESCRIBED:
        place, rate = ("angle", "rate") if packed.turns(link) else ("displacement", "speed")
        return Words((place,), (place,), (rate,))
    if kind.quaternion < 0:
        return Words()
    n = kind.translations
    return Words(
        ("displacement",) * n + ("quaternion",) * 4,
        ("shift",) * n + ("rotation",) * 3,
        ("speed",) * n + ("angular_velocity",) * 3,
    )


def numbered(names: Iterable[str]) -> list[str]:
    """Return names of which those that occur several times have a number.

    Examples
    --------
    >>> numbered(["angle", "rate", "angle"])
    ['angle.1', 'rate', 'angle.2']
    """
    names = list(names)
    several = Counter(names)
    seen: Counter[str] = Counter()
    found = []
    for name in names:
        seen[name] += 1
        found.append(f"{name}.{seen[name]}" if several[name] > 1 else name)
    return found


def coordinate_names(packed: Packed) -> CoordinateNames:
    """Return the names of the coordinates and speeds of a system, in the order of its speeds.

    Of a spherical or free joint the coordinates are small changes in the axes of the child, as its speeds are:
    ``flight.shift.1`` and ``flight.rotation.1``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> names = coordinate_names(pack(System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))))
    >>> names.coordinates, names.speeds
    (('hinge.angle', 'arm.modal.1'), ('hinge.rate', 'arm.modal_rate.1'))
    """
    coordinates, speeds = [""] * packed.nu, [""] * packed.nu
    for joint in dict.fromkeys(link.joint.name for link in packed.links):
        links = packed.links_of(joint)
        words = [words_of(packed, link) for link in links if packed.types[link] != PRESCRIBED]
        for row, change, rate in zip(
            packed.speeds_of(joint),
            numbered(word for each in words for word in each.change),
            numbered(word for each in words for word in each.rate),
            strict=True,
        ):
            coordinates[row] = f"{joint}.{change}"
            speeds[row] = f"{joint}.{rate}"
    for i, _, own in packed.flexible:
        body = packed.links[i].body
        count = own.stop - own.start
        coordinates[own] = [f"{body}.modal.{k + 1}" for k in range(count)]
        speeds[own] = [f"{body}.modal_rate.{k + 1}" for k in range(count)]
    return CoordinateNames(tuple(coordinates), tuple(speeds))
