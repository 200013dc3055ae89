"""Chains of equal bodies, and beams of large deflection made of rigid segments with springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.records import Record, given

AXES = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # of the turns of a beam, in their order


def chain_links(name: str, count: int, parent: str, through: str) -> list[tuple[str, str]]:
    """Return the name of each body of a chain, which is that of its joint too, and what carries it.

    Examples
    --------
    >>> chain_links("rope", 3, "ship.winch", "tip")
    [('rope1', 'ship.winch'), ('rope2', 'rope1.tip'), ('rope3', 'rope2.tip')]
    """
    names = [f"{name}{i}" for i in range(1, count + 1)]
    return list(zip(names, [parent, *(f"{each}.{through}" for each in names[:-1])], strict=True))


def _joints(value: Joint | Sequence[Joint], what: str = "") -> tuple[Joint, ...]:
    return (value,) if isinstance(value, Joint) else tuple(value)


@dataclass(frozen=True, eq=False, kw_only=True)
class Chain(Record):
    """Many equal bodies ``<name>1``, ``<name>2``, ..., each hinged to the one before by a joint of its own name.

    Attributes
    ----------
    name : str
    segment : FlexibleBody
    count : int
    joint : Joint or tuple of Joint
        Between neighbours; its name, parent and child are replaced. Several are taken in turn: two hinges about z and
        y make a chain of links whose axes alternate.
    first : Joint or None
        To the parent, instead.
    parent : str
        What carries the first: ``ground`` or ``body.interface``.
    through : str
        Interface of a segment that carries the next one.

    Raises
    ------
    InputError
        When there is no segment or no joint.

    Examples
    --------
    >>> ends = {"root": np.zeros(3), "tip": np.array([0.1, 0, 0])}
    >>> link = rigid_body("link", mass=0.1, centre=ends["tip"] / 2, inertia=1e-4 * np.eye(3), interfaces=ends)
    >>> hinges = tuple(Joint(name="", type="revolute", parent="", child="", axis=axis) for axis in AXES[:2])
    >>> rope = Chain(name="rope", segment=link, count=3, joint=hinges)
    >>> [(joint.parent, joint.child, joint.axis.tolist()) for joint in rope.joints[:2]]
    [('ground', 'rope1', [0.0, 0.0, 1.0]), ('rope1.tip', 'rope2', [0.0, 1.0, 0.0])]
    >>> list(rope.bodies)
    ['rope1', 'rope2', 'rope3']
    """

    name: str
    segment: FlexibleBody
    count: int
    joint: tuple[Joint, ...] = given(converter=_joints)
    first: Joint | None = None
    parent: str = "ground"
    through: str = "tip"

    def __post_init__(self) -> None:
        """Refuse a chain without links."""
        self._convert()
        if self.count < 1 or not self.joint:
            raise InputError(f"chain {self.name!r} needs at least one segment and one joint")
        super().__post_init__()

    @property
    def bodies(self) -> dict[str, FlexibleBody]:
        """The segments, by name."""
        return {f"{self.name}{i}": self.segment for i in range(1, self.count + 1)}

    @property
    def joints(self) -> tuple[Joint, ...]:
        """One joint for each segment."""
        pattern = [self.joint[i % len(self.joint)] for i in range(self.count)]
        pattern[0] = self.first or pattern[0]
        links = chain_links(self.name, self.count, self.parent, self.through)
        return tuple(
            joint.with_(name=body, parent=parent, child=body)
            for joint, (body, parent) in zip(pattern, links, strict=True)
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class SegmentedBeam(Record):
    """A straight or curved uniform beam along x, of any deflection: rigid segments, hinged by springs.

    A joint is as compliant as one segment of length l: its springs are EI/l, GJ/l, EA/l, GA/l. The clamp has the half
    segment next to it, 2 EI/l. Deflections and frequencies then converge with order two in l.

    Attributes
    ----------
    name : str
    length : float
        m.
    segments : int
    mass_per_length : float
        kg/m.
    rotary_inertia : (3,)
        Of the cross-section about x, y, z, per length, kg m.
    EI : float or (2,)
        Bending stiffness, N m^2: a number bends in the plane x y; two, about y and z, also out of it.
    GJ : float or None
        Twisting stiffness, N m^2, with two of EI; None: no twist.
    EA, GA : float or None
        Stretching stiffness, and shearing stiffness with the shear factor, N, with one EI; None: neither.
    curvature : float
        Of the unloaded beam, in the plane x y, 1/m.
    damping : float
        Of the material: damping over stiffness, s.
    parent : str
        What carries it: ``ground`` or ``body.interface``.
    root : Joint or None
        Joint to the parent in place of the clamp; its name, parent and child are replaced.

    Raises
    ------
    InputError
        When a number is not positive, or stiffnesses do not go together.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 10.

    Examples
    --------
    >>> beam = SegmentedBeam(name="spar", length=10.0, segments=5, mass_per_length=1.2, EI=140.0)
    >>> [joint.elements[0].stiffness for joint in beam.chain.joints]
    [140.0, 70.0, 70.0, 70.0, 70.0]
    >>> float(beam.chain.segment.m)
    2.4
    """

    name: str
    length: float
    segments: int
    mass_per_length: float
    rotary_inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)
    EI: float | tuple[float, float]
    GJ: float | None = None
    EA: float | None = None
    GA: float | None = None
    curvature: float = 0.0
    damping: float = 0.0
    parent: str = "ground"
    root: Joint | None = None

    def __post_init__(self) -> None:
        """Refuse what makes no beam."""
        what = f"beam {self.name!r}"
        both = np.ndim(self.EI) == 1
        if self.GJ is not None and not both:
            raise InputError(f"{what}: GJ twists the beam out of its plane: give EI as two numbers, about y and z")
        if (self.EA is None) != (self.GA is None) or (self.EA is not None and both):
            raise InputError(f"{what}: EA and GA go together, with one EI: it stretches and shears in its plane only")
        given = [self.length, self.segments, self.mass_per_length, *np.ravel(self.EI)]
        given += [value for value in (self.GJ, self.EA, self.GA) if value is not None]
        if np.ndim(self.EI) > 1 or np.size(self.EI) > 2 or not all(0 < value < np.inf for value in given):
            raise InputError(f"{what}: length, segments, mass and stiffnesses must be positive")
        bend = abs(self.curvature) * self.length / self.segments
        if not bend < np.pi:
            raise InputError(
                f"{what}: curvature = {self.curvature:g} 1/m bends a segment by {bend:.3g} rad, half a turn or more; "
                "give more segments or a smaller curvature"
            )
        if not (0 <= self.damping < np.inf and np.all(np.asarray(self.rotary_inertia) >= 0)):
            raise InputError(f"{what}: damping and rotary_inertia must not be negative")
        super().__post_init__()

    @property
    def chain(self) -> Chain:
        """The segments and their joints.

        Every second joint turns in the reverse order: turns a, b in a row leave a twist of a b/2, an error of order one
        in l, which the reverse order takes back.
        """
        step = self.length / self.segments
        forward = self.hinge(step)
        return Chain(
            name=self.name,
            segment=rigid_body(f"{self.name} segment", **self.segment()),
            count=self.segments,
            joint=(forward, self.hinge(step, reverse=True)) if np.ndim(self.EI) else forward,
            first=self.root or self.hinge(step / 2),
            parent=self.parent,
        )

    @property
    def bodies(self) -> dict[str, FlexibleBody]:
        """The segments, by name."""
        return self.chain.bodies

    @property
    def joints(self) -> tuple[Joint, ...]:
        """One joint for each segment."""
        return self.chain.joints

    def hinge(self, length: float, *, reverse: bool = False) -> Joint:
        """Return a joint as compliant as this length: travels along x, y, turns about z, y, x (or x, y, z).

        Returns
        -------
        Joint
            Without name, parent and child.
        """
        travels = [] if self.EA is None else [self.EA, self.GA]
        turns = [*np.ravel(self.EI)[::-1], *([self.GJ] if self.GJ else [])]
        bend = [self.curvature * length, *[0.0] * (len(turns) - 1)]
        axes = [AXES[0], AXES[2]] if travels else list(AXES[: max(2, len(turns))])
        if reverse:
            turns, bend, axes = turns[::-1], bend[::-1], axes[::-1]
        rest = [0.0] * len(travels) + bend
        kind = "planar" if travels else ("revolute", "universal", "gimbal")[len(turns) - 1]
        return Joint(
            name="",
            parent="",
            child="",
            type=kind,
            axis=axes[0],
            second_axis=None if kind == "revolute" else axes[1],
            angle=np.array(bend) if len(bend) > 1 else bend[0],
            elements=tuple(
                HingeElement(stiffness=c / length, damping=self.damping * (c / length), free_position=free)
                for c, free in zip(map(float, travels + turns), rest, strict=True)
            ),
        )

    def segment(self) -> dict[str, Any]:
        """Return mass (kg), centre (m), inertia (3, 3) about it (kg m^2) and interfaces of one segment.

        Returns
        -------
        dict
            Arguments of `rigid_body`.
        """
        step = self.length / self.segments
        mass = self.mass_per_length * step
        across = mass * step**2 / 12
        return {
            "mass": mass,
            "centre": np.array([step / 2, 0.0, 0.0]),
            "inertia": np.diag(step * np.asarray(self.rotary_inertia) + [0.0, across, across]),
            "interfaces": {"root": np.zeros(3), "tip": np.array([step, 0.0, 0.0])},
        }
