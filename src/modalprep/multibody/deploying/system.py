"""Systems with deploying beams, cables or tethers: the rods of each stage as bodies and joints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.multibody.model.deployment import NEAR_EXIT, Deployment, Stage
from modalprep.multibody.model.environment import Orbit
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import Load, SampledLoad
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.records import Record

EYE = np.eye(3)


@dataclass(frozen=True, eq=False, kw_only=True)
class DeployingSystem(Record):
    """A system with deploying beams, cables or tethers; see `System` and `Deployment`.

    Attributes
    ----------
    bodies : {name: FlexibleBody}
    joints : tuple of Joint
        One for each body.
    deployments : tuple of Deployment
        What moves out of a body or of the ground, or back.
    gravity : (3,)
        m/s^2, inertial.
    loads : tuple of PointForce, Bushing and other loads
    orbit : Orbit or None

    Examples
    --------
    >>> from modalprep.multibody.model.deployment_law import first_stage
    >>> boom = Deployment(name="boom", parent="ground", length=10.0, segments=5, mass_per_length=1.2,
    ...                   deployed_length="5 + t/2")
    >>> system = DeployingSystem(bodies={}, joints=(), deployments=(boom,))
    >>> system.in_stages([first_stage(boom)]).order
    ('boom_exit', 'boom3', 'boom2', 'boom1')
    """

    bodies: dict[str, FlexibleBody]
    joints: tuple[Joint, ...]
    deployments: tuple[Deployment, ...]
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    loads: tuple[Load, ...] = ()
    orbit: Orbit | None = None

    def __post_init__(self) -> None:
        """Check names, and that exits belong to rigid bodies."""
        for d in self.deployments:
            name = d.parent.partition(".")[0]
            if name in self.bodies and self.bodies[name].n:
                raise InputError(
                    f"deployment {d.name!r}: body {name!r} has modes, but stowed mass needs a rigid body; give it a "
                    "'mass' instead of a file, or insert a rigid body"
                )
        for load in self.loads:
            if isinstance(load, SampledLoad):
                raise InputError(
                    f"load {load.name!r} is sampled in time, which systems that deploy do not have; leave it out"
                )
        super().__post_init__()
        self.full()

    def in_stages(self, stages: list[Stage], start: dict[str, dict] | None = None) -> System:
        """Return the system with the rods of these stages; `start` has initial values of joints by name.

        Returns
        -------
        System
            With the rods that are deployed then.
        """
        bodies = dict(self.bodies)
        joints = list(self.joints)
        for d, stage in zip(self.deployments, stages, strict=True):
            new = _bodies(d, stage)
            for twice in new.keys() & bodies.keys():
                raise InputError(f"deployment {d.name!r} makes body {twice!r}, which exists already; rename one")
            bodies |= new
            joints += [joint.with_(**(start or {}).get(joint.name, {})) for joint in _joints(d, stage)]
        return System(bodies=bodies, joints=tuple(joints), gravity=self.gravity, loads=self.loads, orbit=self.orbit)

    def without_exit(
        self, stages: list[Stage], d: Deployment, rotation: np.ndarray, velocity: np.ndarray, spin: np.ndarray
    ) -> System:
        """Return the system with the innermost rod removed and the next one free of the exit.

        rotation : (3, 3) of that rod in the exit's frame; velocity, spin : (3,) of its root, relative to the exit, in
        its own frame.

        Returns
        -------
        System
            Of one rod less.
        """
        full = self.in_stages(stages)
        stage = stages[self.deployments.index(d)]
        removed = {d.exit_body, f"{d.name}{stage.rods}"}
        rod = f"{d.name}{stage.rods - 1}"
        free = Joint(
            name=rod,
            type="free",
            parent=d.parent,
            child=rod,
            position=d.position,
            rotation=d.frame @ rotation,
            velocity=velocity,
            angular_velocity=spin,
        )
        kept = tuple(joint for joint in full.joints if full.child(joint) not in {*removed, rod})
        bodies = {name: body for name, body in full.bodies.items() if name not in removed}
        return full.with_(bodies=bodies, joints=(*kept, free))

    def full(self) -> System:
        """Return the system with everything out.

        Returns
        -------
        System
            Of all rods.
        """
        return self.in_stages(
            [Stage(rods=d.segments, locked=False, length=TimeFunction(d.length)) for d in self.deployments]
        )


def _bodies(d: Deployment, stage: Stage) -> dict[str, FlexibleBody]:
    mass = d.mass_per_length * d.rod_length
    ends = {"root": np.zeros(3), "tip": np.array([d.rod_length, 0, 0])}
    across = mass * d.rod_length**2 / 12
    inertia = np.diag([d.rotary_inertia * d.rod_length, across, across])
    rod = rigid_body(d.name, mass=mass, centre=ends["tip"] / 2, inertia=inertia, interfaces=ends)
    behind = {"root": np.zeros(3), "sleeve": np.array([-stage.rods * d.rod_length, 0, 0])}
    massless = rigid_body(d.exit_body, mass=1.0, centre=np.zeros(3), inertia=np.zeros((3, 3)), interfaces=behind)
    massless = massless.with_(m=0.0, points=np.zeros((1, 3)), shape=np.zeros((1, 3, 0)))
    return {d.exit_body: massless} | {f"{d.name}{k}": rod for k in range(stage.rods, 0, -1)}


def _joints(d: Deployment, stage: Stage) -> Iterator[Joint]:
    """Yield exit hinge, sliding joint, then the hinges outwards."""
    n = stage.rods
    welded = max(1, stage.rods - 1) if stage.locked else 0
    outside = {"parent": d.parent, "child": d.exit_body, "position": d.position, "rotation": d.frame}
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
        return Joint(name=name, type="weld", rotation=rotation @ stage.rotation, **ends)
    if d.spatial:
        return Joint(name=name, type="spherical", rotation=rotation, **ends)
    stiffness = 0.0 if d.guided and k >= stage.rods - NEAR_EXIT else d.EI / d.rod_length
    elements = (HingeElement(stiffness=stiffness, damping=d.damping * stiffness),) if d.EI > 0 else ()
    return Joint(name=name, type="revolute", axis=rotation[:, 2], rotation=rotation, elements=elements, **ends)


def _slider(d: Deployment, stage: Stage) -> Joint:
    out, speed = d.start
    moves: dict[str, Any] = {"displacement": out, "speed": speed}
    if stage.length is not None:
        moves = {"motion": stage.length}
    elif d.tension is not None:  # the deployed length is free
        moves["elements"] = (HingeElement(damping=d.brake, drive=-d.tension),)
    ends = {"parent": f"{d.exit_body}.sleeve", "child": f"{d.name}{stage.rods}"}
    return Joint(name=d.name, type="prismatic", axis=EYE[0], **ends, **moves)
