"""Systems of which beams, cables or tethers come out: the rods of each stage as bodies and joints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.multibody.model.deployment import Deployment, Stage
from modalprep.multibody.model.environment import Orbit
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import Load
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.records import Record

EYE = np.eye(3)


@dataclass(frozen=True, eq=False, kw_only=True)
class DeployingSystem(Record):
    """A system of which beams, cables or tethers come out; see `System` and `Deployment`.

    Examples
    --------
    >>> from modalprep.multibody.model.deployment_law import first_stage
    >>> boom = Deployment(name="boom", parent="ground", length=10.0, segments=5, mass_per_length=1.2, law="5 + t/2")
    >>> system = DeployingSystem(bodies={}, joints=(), deployments=(boom,))
    >>> system.at([first_stage(boom)]).order
    ('boom_exit', 'boom3', 'boom2', 'boom1')
    """

    bodies: dict[str, FlexibleBody]
    joints: tuple[Joint, ...]
    deployments: tuple[Deployment, ...]
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    loads: tuple[Load, ...] = ()
    orbit: Orbit | None = None

    def __post_init__(self) -> None:
        """Check names, and that exits are in rigid bodies."""
        for d in self.deployments:
            name = d.parent.partition(".")[0]
            if name in self.bodies and self.bodies[name].n:
                raise InputError(
                    f"deployment {d.name!r}: body {name!r} has modes, but stowed mass needs a rigid body; give it a "
                    "'mass' in place of a file, or put a rigid body between"
                )
        super().__post_init__()
        self.full()

    def at(self, stages: list[Stage], places: dict[str, dict] | None = None) -> System:
        """Return the system with the rods of these stages; `places` are start values of joints by name.

        Returns
        -------
        System
            Of what is out then.
        """
        bodies, joints = dict(self.bodies), list(self.joints)
        for d, stage in zip(self.deployments, stages, strict=True):
            new = _bodies(d, stage)
            for twice in new.keys() & bodies.keys():
                raise InputError(f"deployment {d.name!r} makes body {twice!r}, which is already there; rename one")
            bodies |= new
            joints += [joint.with_(**(places or {}).get(joint.name, {})) for joint in _joints(d, stage)]
        return System(bodies=bodies, joints=tuple(joints), gravity=self.gravity, loads=self.loads, orbit=self.orbit)

    def without_exit(
        self, stages: list[Stage], d: Deployment, turn: np.ndarray, velocity: np.ndarray, spin: np.ndarray
    ) -> System:
        """Return the system with the innermost rod gone and the next one free of the exit.

        turn : (3, 3) of that rod in the exit's frame; velocity, spin : (3,) of its root, relative to the exit, in its
        own frame.

        Returns
        -------
        System
            Of one rod less.
        """
        full, stage = self.at(stages), stages[self.deployments.index(d)]
        gone = {d.leads, f"{d.name}{stage.rods}"}
        rod = f"{d.name}{stage.rods - 1}"
        loose = Joint(
            name=rod, type="free", parent=d.parent, child=rod, position=d.position, rotation=d.frame @ turn,
            velocity=velocity, spin=spin,
        )  # fmt: skip
        kept = tuple(joint for joint in full.joints if full.child(joint) not in {*gone, rod})
        bodies = {name: body for name, body in full.bodies.items() if name not in gone}
        return full.with_(bodies=bodies, joints=(*kept, loose))

    def full(self) -> System:
        """Return the system with everything out.

        Returns
        -------
        System
            Of all rods.
        """
        return self.at([Stage(rods=d.segments, locked=False, law=TimeFunction(d.length)) for d in self.deployments])


def _bodies(d: Deployment, stage: Stage) -> dict[str, FlexibleBody]:
    mass, ends = d.mass_per_length * d.rod, {"root": np.zeros(3), "tip": np.array([d.rod, 0, 0])}
    across = mass * d.rod**2 / 12
    inertia = np.diag([d.rotary_inertia * d.rod, across, across])
    rod = rigid_body(d.name, mass=mass, centre=ends["tip"] / 2, inertia=inertia, interfaces=ends)
    behind = {"root": np.zeros(3), "sleeve": np.array([-stage.rods * d.rod, 0, 0])}
    leads = rigid_body(d.leads, mass=1.0, centre=np.zeros(3), inertia=np.zeros((3, 3)), interfaces=behind)
    leads = leads.with_(m=0.0, points=np.zeros((1, 3)), shape=np.zeros((1, 3, 0)))
    return {d.leads: leads} | {f"{d.name}{k}": rod for k in range(stage.rods, 0, -1)}


def _joints(d: Deployment, stage: Stage) -> Iterator[Joint]:
    """Yield exit hinge, sliding joint, then the hinges outwards."""
    n, welded = stage.rods, max(1, stage.rods - 1) if stage.locked else 0
    outside = {"parent": d.parent, "child": d.leads, "position": d.position, "rotation": d.frame}
    yield _guide(d, stage, **outside) if d.guided else _hinge(d, n, stage, welded=n == welded, **outside)
    yield _slider(d, stage)
    for k in range(n - 1, 0, -1):
        yield _hinge(d, k, stage, welded=k == welded, parent=f"{d.name}{k + 1}.tip", child=f"{d.name}{k}")


def _guide(d: Deployment, stage: Stage, **ends) -> Joint:
    name = f"{d.name}{stage.rods}"
    if stage.tilt is None:
        return Joint(name=name, type="weld", **ends)
    return Joint(name=name, type="revolute", axis=d.normal, motion=stage.tilt, **ends)


def _hinge(d: Deployment, k: int, stage: Stage, *, welded: bool, rotation: np.ndarray = EYE, **ends) -> Joint:
    name = f"{d.name}{k}"
    if welded:
        return Joint(name=name, type="weld", rotation=rotation @ stage.turn, **ends)
    if d.spatial:
        return Joint(name=name, type="spherical", rotation=rotation, **ends)
    stiffness = d.EI / d.rod
    elements = (HingeElement(stiffness=stiffness, damping=d.damping * stiffness),) if d.EI > 0 else ()
    return Joint(name=name, type="revolute", axis=rotation[:, 2], rotation=rotation, elements=elements, **ends)


def _slider(d: Deployment, stage: Stage) -> Joint:
    out, speed = d.start
    moves = {"displacement": out, "speed": speed} if stage.law is None else {"motion": stage.law}
    if stage.law is None and d.law is None:
        moves["elements"] = (HingeElement(damping=d.brake, drive=-d.tension),)
    ends = {"parent": f"{d.leads}.sleeve", "child": f"{d.name}{stage.rods}"}
    return Joint(name=d.name, type="prismatic", axis=EYE[0], **ends, **moves)
