"""Free flight of a system of one body in momenta or efficient variables, as channels of a run."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.evaluation.stresses import stress_channels
from modalprep.multibody.free_body.free_flyer import FreeBodyMotion, simulate_free_body
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.reference.equations import node_motion, quaternion_matrix
from modalprep.multibody.results.momenta import Momenta, with_momenta
from modalprep.multibody.results.observation import STILL
from modalprep.multibody.results.recovered import recovery_channels
from modalprep.multibody.results.result import Result, output_times
from modalprep.multibody.results.validity import large_deflections
from modalprep.verdicts.notes import told


@told
def simulate_free_system(
    system: System, *, t_end: float, output_step: float = 0.01, rtol: float = 1e-7, variables: str = "momentum"
) -> Result:
    """Integrate a system of one free body by `simulate_free_body` from its joint's start; arguments as `simulate`.

    Returns
    -------
    Result
        Channels ``<body>.origin``, ``.orientation``, ``.modal``, ``.stress``, ``<body>.<interface>.position``, momenta
        and energies.

    Raises
    ------
    InputError
        When the system is not one free body under uniform gravity, or the variables do not apply to it.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> free = Joint(name="flight", type="free", parent="ground", child="arm", angular_velocity=np.array([0, 0, 1.0]))
    >>> run = simulate_free_system(System(bodies={"arm": uniform_beam(modes=2)}, joints=(free,)), t_end=0.1)
    >>> run["arm.tip.position"].shape, run.stats["energy_error"] < 1e-6
    ((11, 3), True)
    """
    joint = _only_joint(system, variables)
    name, body = next(iter(system.bodies.items()))
    start = {key: getattr(joint, key) for key in ("position", "rotation", "velocity", "angular_velocity")}
    options = {"gravity": system.gravity, "variables": variables, "rtol": rtol}
    motion = simulate_free_body(body, output_times(t_end, output_step), **start, **options)
    energy = motion.energy
    total = sum(energy.values(), np.zeros(len(motion.time)))
    channels = {
        f"{name}.origin": motion.position,
        f"{name}.orientation": motion.quaternion,
        f"{name}.modal": motion.q,
        "momentum.linear": motion.linear,
        "momentum.angular": motion.angular,
        "energy.kinetic": energy["kinetic"],
        "energy.strain": energy["strain"],
        "energy.gravity": energy["gravity"],
        "energy.work": -energy["dissipated"],
        "energy.error": total - total[0],
    }
    for k, interface in enumerate(body.interface_name):
        channels[f"{name}.{interface}.position"] = _positions(system, name, k, motion)
    channels |= stress_channels({name: body}, channels)
    channels |= recovery_channels(system, motion.time, channels)
    largest = max(np.abs(part - part[0] * (key == "gravity")).max() for key, part in energy.items())
    error = float(np.abs(total - total[0]).max() / (largest or 1.0))
    stats = {"method": "explicit", "steps": int(motion.steps), "energy_error": error}
    message = f"free flight in {variables} variables, explicit method of order 8"
    notes = large_deflections({name: body}, motion.time, {name: motion.q})
    run = Result(time=motion.time, channels=channels, status="done", message=message, stats=stats, notes=notes)
    return with_momenta(run, [_momenta(system, body, motion)], system.gravity)


def _momenta(system: System, body: FlexibleBody, motion: FreeBodyMotion) -> Momenta:
    """Return the momenta of the body, the angular one about where its mass centre flies to from the modes' rest."""
    turn = quaternion_matrix(motion.quaternion[0])
    t = motion.time[:, None]
    m = body.m
    flown = motion.position[0] + turn @ body.s0 / m + t * motion.linear[0] / m + t**2 / 2 * system.gravity
    angular = motion.angular - np.cross(flown, motion.linear)
    p = np.linalg.norm(motion.linear, axis=1)
    twice = np.maximum(2 * motion.energy["kinetic"] - p**2 / m, m * STILL**2)
    polar = np.trace(body.E0) - body.s0 @ body.s0 / m
    rows = np.column_stack([motion.linear, angular, p + np.sqrt(m * twice), np.sqrt(polar * twice)])
    return Momenta(m, rows, np.zeros(6))


def _only_joint(system: System, variables: str) -> Joint:
    joint, *others = system.joints
    reason = (
        "more than one body"
        if others
        else f"joint {joint.name!r} is {joint.type}, not free"
        if joint.type != "free"
        else "a load"
        if system.loads or joint.elements
        else "a closed loop"
        if system.closures
        else "an orbit"
        if system.orbit
        else "a body that loses mass"
        if system.depletions
        else None
    )
    if reason:
        raise InputError(
            f"variables = {variables!r} need one free body under uniform gravity, but there is {reason}; leave them out"
        )
    return joint


def _positions(system: System, name: str, node: int, motion: FreeBodyMotion) -> np.ndarray:
    body = system.bodies[name]
    none = np.zeros(system.bodies[name].n)
    arms = [node_motion(body, node, np.zeros(3), q, none)[0] for q in motion.q]
    rotations = [quaternion_matrix(e) for e in motion.quaternion]
    return motion.position + np.einsum("tab,tb->ta", rotations, arms)
