"""The text of a system file in which a part swings about one of its interfaces."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.elements.mass import RigidInertia
from modalprep.fe.features.cylinder import normals_to
from modalprep.pipeline.init.proposal import key, numbers, quoted
from modalprep.pipeline.init.survey import Survey

G = 9.81  # m/s^2
START = 30  # degrees
STRAIGHT = np.cos(np.radians(2.0))  # to an axis of the mesh, which gravity then follows
CENTRED = 1e-3  # of the distances of the masses: an arm that does not make a pendulum
SWINGS, POINTS = 3, 100  # periods of the run, and outputs in each


class Hung(NamedTuple):
    """An interface to swing about: axis, arm of the centre of mass (m), mean square distance (m^2), gravity's way."""

    name: str
    axis: np.ndarray
    arm: float
    square: float
    down: np.ndarray


def pendulum_text(survey: Survey, part: Path, model: FEModel) -> str:
    """Return the system file of a part that swings under gravity.

    It hangs from the first opening that is away from its centre of mass, else from another interface; gravity points
    from there to the centre of mass, so that it hangs at the angle zero.
    """
    axes = {one.name: one.direction for one in survey.active}
    frames = sorted(model.interfaces, key=lambda frame: axes.get(frame.name) is None)
    return _text(part, [_hung(model.rigid, frame.name, frame.position, axes.get(frame.name)) for frame in frames])


def body_pendulum_text(body: FlexibleBody, part: Path) -> str:
    """Return the system file of a reduced body that swings about its root."""
    return _text(part, [_hung(body, body.interface_name[0], body.interface_position[0], None)])


def _text(part: Path, hung: list[Hung]) -> str:
    swinging = [one for one in hung if one.arm > CENTRED * np.sqrt(one.square)]
    name, axis, arm, square, down = (swinging or hung)[0]
    period = 2 * np.pi * np.sqrt(square / (G * arm)) if swinging else 1.0
    step = float(f"{period / POINTS:.1g}")
    start = f'angle = "{START} deg"' if swinging else 'rate = "1 rad/s"'
    body = part.stem if part.stem.isidentifier() else "part"
    expected = (
        f"# Expected: small swings take about {period:.3g} s, 2 pi sqrt(J / (m g d)) of a rigid part,\n"
        f"# and those of {START} degrees 1.7 % more; the energy is conserved but for the modal damping."
        if swinging
        else "# Its centre of mass lies on the axis, so that it does not swing: it turns at a constant rate."
    )
    return f"""\
# The part of {part.name} swings about {name}. modalprep init wrote it.
#
# modalprep simulate {part.stem}-pendulum.toml simulates it, and draws a film where the machine can draw.
{expected}

[bodies.{key(body)}]
pipeline = {quoted(part.name)}

[joints.hinge]
type = "revolute"
child = "{body}.{name}"
axis = {numbers(axis, 1.0)}
start = {{ {start} }}

[environment]
gravity = {numbers(G * down, 1.0)}  # from the hinge to the centre of mass, where the angle is zero

[simulation]
t_end = {float(f"{SWINGS * period:.2g}"):.6g}
output_step = {step:.6g}
rtol = 1e-6
output = ["hinge.angle", "{body}.modal", "energy.error"]

[output]
film = "gif"

[[plots]]
y = "hinge.angle"
title = "The part swings about {name}"
ylabel = "hinge angle (rad)"
"""


def _hung(rigid: RigidInertia | FlexibleBody, name: str, position: np.ndarray, axis: np.ndarray | None) -> Hung:
    centre = rigid.s0 / rigid.m
    if axis is None:
        axis = _across(centre - position)
    arm = (centre - position) - (centre - position) @ axis * axis
    aside = centre - centre @ axis * axis  # Steiner's theorem, from the origin to the hinge
    square = float((np.trace(rigid.E0) - axis @ rigid.E0 @ axis) / rigid.m - aside @ aside + arm @ arm)
    length = float(np.linalg.norm(arm))
    down = arm / length if length > 0 else normals_to(axis)[0]
    nearest = np.zeros(3)
    nearest[np.argmax(np.abs(down))] = np.sign(down[np.argmax(np.abs(down))])
    straight = down @ nearest > STRAIGHT and abs(nearest @ axis) < 1e-6
    return Hung(name, axis, length, square, nearest if straight else down)


def _across(arm: np.ndarray) -> np.ndarray:
    """Return the axis of the mesh that is most nearly across an arm, z before y before x."""
    return np.eye(3)[2 - int(np.argmin(np.abs(arm[::-1]).round(9)))]
