"""A system as an input deck of MBDyn, with the .fem files of its flexible bodies."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.decks.start import refuse_others, start_of
from modalprep.formats.decks.time_text import mbdyn_text
from modalprep.formats.export import lost_in
from modalprep.formats.mbdyn import carried_interfaces, write_mbdyn
from modalprep.formats.refusals import with_suffix
from modalprep.multibody.model.constraints import Closure
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.reference.equations import BodyState
from modalprep.suggest import refuse_other

HELD = {  # translations and rotations that a joint holds, in axes whose z is that of the joint
    "weld": ("xyz", "xyz"),
    "revolute": ("xyz", "xy"),
    "prismatic": ("xy", "xyz"),
    "cylindrical": ("xy", "xy"),
    "spherical": ("xyz", ""),
    "planar": ("z", "xy"),
}
GROUND = 1  # label of its node


@dataclass
class Deck:
    """Nodes and elements, with the labels that ends of joints have.

    Attributes
    ----------
    label : {body.interface: (node, place in its axes)}
    """

    nodes: list[str] = field(default_factory=list)
    elements: list[str] = field(default_factory=list)
    label: dict[str, tuple[int, np.ndarray]] = field(default_factory=dict)
    bodies: int = 0
    forces: int = 0

    def node(self, kind: str, state: BodyState, place: np.ndarray) -> int:
        """Add a node at a place in the axes of a body, with the motion that it has at rest in them."""
        label = len(self.nodes) + GROUND + 1
        at = [state.p + state.R @ place, state.R]
        moving = [state.R @ (state.V[:3] + np.cross(state.V[3:], place)), state.R @ state.V[3:]]
        vectors = [_row(at[0]), f"matr, {_row(at[1])}", *map(_row, moving)]
        self.nodes.append(f"structural: {label}, {kind},\n    " + ",\n    ".join(vectors))
        return label

    @property
    def joints(self) -> int:
        """How many of the elements are joints."""
        return sum(text.startswith("joint:") for text in self.elements)

    def joint(self, text: str) -> None:
        """Add a joint with the next label."""
        self.elements.append(f"joint: {len(self.elements) + 1}, {text}")

    def end(self, name: str, position: np.ndarray) -> tuple[int, np.ndarray]:
        """Return the node of ``body.interface``, ``body`` or the ground, and the place in its axes."""
        return (GROUND, position) if name == "ground" else self.label[name]


def write_mbdyn_deck(
    system: System, path: str | Path, *, t_end: float = 1.0, step: float = 1e-3, output_step: float = 1e-2
) -> Path:
    """Write a system as an input deck of MBDyn, with a .fem file beside it for each flexible body.

    Bodies at their start, joints (``total joint``), prescribed motions, loops that joints close, gravity and forces.
    Flexible bodies are modal joints with all record groups, for which the deck switches automatic differentiation on;
    the tolerance of the derivatives at the start is loose, since the modes there are not in equilibrium.

    Parameters
    ----------
    path : str or Path
        Must end in ``.mbd``.
    t_end, step, output_step : float
        s, of the run: its end and its fixed step; outputs are at the multiple of the step next to `output_step`.

    Returns
    -------
    Path
        The deck.

    Raises
    ------
    InputError
        When the system has what the deck cannot carry: elements in joints, couplers, loads other than forces, tables
        over time, joints of other types; or the folder cannot be written.

    References
    ----------
    P. Masarati and others, MBDyn input file format: structural nodes, body, joints modal, clamp and total joint, force.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> system = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> deck = write_mbdyn_deck(system, Path(tempfile.mkdtemp()) / "pendulum.mbd")
    >>> sorted(file.name for file in deck.parent.iterdir())
    ['pendulum-arm.fem', 'pendulum.mbd']
    """
    refuse_other("write_mbdyn_deck: the system", System, system)
    path = with_suffix(path, "a deck of MBDyn", ".mbd")
    refuse_others(system, "a deck of MBDyn", HELD, elements=False)
    deck = _deck(system, path.stem)
    every = max(1, round(output_step / step))
    lines = [*_head(system, path.stem, deck, t_end, step, every), *_blocks(deck)]
    for name, body in system.bodies.items():
        if body.n:
            write_mbdyn(body, path.with_name(_file(path.stem, name)))
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def lost_in_mbdyn_deck(system: System) -> list[str]:
    """Return notes on what of a system a deck of MBDyn does not hold.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> lost_in_mbdyn_deck(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    []
    """
    flexible = {name: body for name, body in system.bodies.items() if body.n}
    return [f"body {name!r}: {said}" for name, body in flexible.items() for said in lost_in(body, "mbdyn")]


def _deck(system: System, stem: str) -> Deck:
    deck = Deck()
    deck.joint(f"clamp, {GROUND}, node, node")
    for name, state in start_of(system).items():
        (_add_flexible if state.body.n else _add_rigid)(deck, name, state.body, state, stem)
    for joint in system.joints:
        if joint.type != "free":
            _add_joint(deck, joint, joint.parent, joint.child)
    for closure in system.closures:
        assert isinstance(closure, Closure)  # by `refuse_others`
        _add_joint(deck, closure, closure.a, closure.b)
    for load in system.loads:
        _add_force(deck, load)
    if np.any(system.gravity):
        deck.elements.append(f"gravity: uniform, {_row(system.gravity)}, const, 1.")
    return deck


def _add_rigid(deck: Deck, name: str, body: FlexibleBody, state: BodyState, stem: str) -> None:
    node = deck.node("dynamic", state, np.zeros(3))
    centre = body.s0 / body.m
    J = np.trace(body.E0) * np.eye(3) - body.E0 - body.m * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    deck.bodies += 1
    deck.elements.append(f"body: {node}, {node}, {body.m!r},\n    {_row(centre)},\n    matr, {_row(J)}")
    deck.label[name] = (node, np.zeros(3))
    for interface, place in zip(body.interface_name, body.interface_position, strict=True):
        deck.label[f"{name}.{interface}"] = (node, place)


def _add_flexible(deck: Deck, name: str, body: FlexibleBody, state: BodyState, stem: str) -> None:
    """Add the modal node, a node for each interface that moves against it, and the modal joint with its card."""
    modal = deck.node("modal", state, np.zeros(3))
    deck.label[name] = deck.label[f"{name}.{body.interface_name[0]}"] = (modal, np.zeros(3))
    ends = []
    for k in carried_interfaces(body):
        node = deck.node("static", state, body.interface_position[k])
        interface = body.interface_name[k]
        deck.label[f"{name}.{interface}"] = (node, np.zeros(3))
        label = re.sub(r"[^\w.+-]", "_", interface, flags=re.ASCII)  # as in the .fem file
        ends.append(f'"{label}", {node}, null')
    card = f'modal, {modal}, {body.n}, from file, damping from file, "{_file(stem, name)}", {len(ends)}'
    deck.joint(",\n    ".join([card, *ends]))


def _add_joint(deck: Deck, joint: Joint | Closure, first: str, second: str) -> None:
    """Add a total joint: it holds directions in axes whose z is the axis of the joint."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(joint.axis))], joint.axis)
    x /= np.linalg.norm(x)
    frame = np.column_stack([x, np.cross(joint.axis, x), joint.axis])
    ends = [*zip((first, second), (frame, joint.rotation.T @ frame), strict=True)]
    lines = ["total joint"]
    for name, axes in ends:
        node, place = deck.end(name, joint.position)
        lines += [f"{node}", f"    position, {_row(place)}"]
        lines += [f"    {kind} orientation, matr, {_row(axes)}" for kind in ("position", "rotation")]
    motion = joint.motions[0] if isinstance(joint, Joint) and joint.motions else None
    driven = "" if motion is None else mbdyn_text(motion, f"joint {joint.name!r}: the motion")
    slides = joint.type == "prismatic"
    held = HELD[joint.type]
    lines += [_constraint("position", held[0], driven if slides else "")]
    lines += [_constraint("orientation", held[1], "" if slides else driven)]
    deck.joint(",\n    ".join(lines))


def _constraint(kind: str, held: str, driven: str) -> str:
    active = ", ".join("active" if each in held or (driven and each == "z") else "inactive" for each in "xyz")
    value = f'component, const, 0., const, 0., string, "{driven}"' if driven else "null"
    return f"{kind} constraint, {active}, {value}"


def _add_force(deck: Deck, load: Any) -> None:
    node, place = deck.end(load.at, np.zeros(3))
    kind = "follower" if load.axes == "body" else "absolute"
    for key, element in (("force", "force"), ("torque", "couple")):
        parts = [mbdyn_text(each, f"force {load.name!r}") for each in getattr(load, key)]
        if any(part != "0.0" for part in parts):
            deck.forces += 1
            at = f"position, {_row(place)}, " if key == "force" else ""
            drives = ", ".join(f'string, "{part}"' for part in parts)
            deck.elements.append(f"{element}: {deck.forces}, {kind}, {node}, {at}component, {drives}")


def _head(system: System, stem: str, deck: Deck, t_end: float, step: float, every: int) -> Iterator[str]:
    yield f"# {stem}: a deck of MBDyn, in SI units, by modalprep"
    yield "begin: data;\n  problem: initial value;\nend: data;\n"
    yield "begin: initial value;\n  initial time: 0.;"
    yield f"  final time: {t_end!r};\n  time step: {step!r};"
    yield "  method: ms, 0.6;\n  tolerance: 1e-6;\n  max iterations: 20;"
    yield "  derivatives tolerance: 1e3;\n  derivatives max iterations: 20;\n  derivatives coefficient: 1e-6;"
    yield "end: initial value;\n"
    yield "begin: control data;\n  use automatic differentiation;\n  skip initial joint assembly;"
    yield f"  output meter: meter, 0., forever, steps, {every};"
    yield f"  structural nodes: {len(deck.nodes) + 1};\n  rigid bodies: {deck.bodies};"
    yield f"  joints: {deck.joints};\n  forces: {deck.forces};"
    yield from ["  gravity;"] if np.any(system.gravity) else []
    yield "end: control data;\n"


def _blocks(deck: Deck) -> Iterator[str]:
    yield "begin: nodes;"
    yield f"  structural: {GROUND}, static, null, eye, null, null;"
    yield from (f"  {node};" for node in deck.nodes)
    yield "end: nodes;\n\nbegin: elements;"
    yield from (f"  {element};" for element in deck.elements)
    yield "end: elements;"


def _file(stem: str, body: str) -> str:
    return f"{stem}-{body}.fem"


def _row(values: np.ndarray | Sequence[float]) -> str:
    return ", ".join(repr(float(value) + 0.0) for value in np.asarray(values).ravel())
