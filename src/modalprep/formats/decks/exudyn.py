"""A system as a script of Exudyn, with the files of its flexible bodies."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.decks.start import refuse_others, start_of
from modalprep.formats.decks.time_text import is_zero, python_text
from modalprep.formats.export import lost_in
from modalprep.formats.exudyn import write_exudyn
from modalprep.formats.refusals import with_suffix
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.reference.equations import BodyState
from modalprep.suggest import refuse_other

KINDS = ("weld", "revolute", "prismatic", "cylindrical", "spherical", "planar")
HEAD = "exudyn_head.txt"


def write_exudyn_script(
    system: System, path: str | Path, *, t_end: float = 1.0, step: float = 1e-3, output_step: float = 1e-2
) -> Path:
    """Write a system as a script of Exudyn, with an NPZ file beside it for each flexible body.

    Bodies at their start, joints with springs, dampers, drives and prescribed motions, loops that joints close, gravity
    and forces. Flexible bodies have their modal damping and the torque of gravity on their deflection, which
    Exudyn's own load leaves out. ``run()`` of the script returns the histories of interfaces and modes; run as a
    program, it writes them beside itself.

    Parameters
    ----------
    path : str or Path
        Must end in ``.py``.
    t_end, step, output_step : float
        s, of the run: its end, its fixed step, and the time between outputs.

    Returns
    -------
    Path
        The script.

    Raises
    ------
    InputError
        When the system has what the script cannot carry: friction, limits, couplers, loads other than forces, tables
        over time, joints of other types; or the folder cannot be written.

    References
    ----------
    J. Gerstmayr, Exudyn - a C++-based Python package for flexible multibody systems, Multibody Syst. Dyn. 60 (2024)
    533; its items ObjectFFRFreducedOrder, ObjectJointGeneric, ObjectConnectorTorsionalSpringDamper.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> system = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> script = write_exudyn_script(system, Path(tempfile.mkdtemp()) / "pendulum.py")
    >>> sorted(file.name for file in script.parent.iterdir())
    ['pendulum-arm.npz', 'pendulum.py']
    """
    refuse_other("write_exudyn_script: the system", System, system)
    path = with_suffix(path, "a script of Exudyn", ".py")
    refuse_others(system, "a script of Exudyn", KINDS, elements=True)
    times = {"T_END": t_end, "STEP": step, "PERIOD": output_step}
    lines = list(_lines(system, path.stem, times))
    for name, body in system.bodies.items():
        if body.n:
            write_exudyn(body, path.with_name(_file(path.stem, name)))
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def lost_in_exudyn_script(system: System) -> list[str]:
    """Return notes on what of a system a script of Exudyn does not hold.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> lost_in_exudyn_script(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))[0][:47]
    "body 'arm': geometric stiffness has no place in"
    """
    return [
        f"body {name!r}: {said}" for name, body in system.bodies.items() if body.n for said in lost_in(body, "exudyn")
    ]


def _file(stem: str, body: str) -> str:
    return f"{stem}-{body}.npz"


def _lines(system: System, stem: str, times: dict[str, float]) -> Iterator[str]:
    yield f'"""{stem}: a model of Exudyn, in SI units, by modalprep."""\n'
    head = files("modalprep.formats.decks").joinpath(HEAD).read_text(encoding="utf-8")
    imports, rest = head.split("HERE = ", 1)
    yield imports.rstrip() + "\n"
    yield from (f"{name} = {value!r}" for name, value in times.items())
    yield f"CLOSED = {bool(system.closures)}"
    yield f"GRAVITY = {_list(system.gravity)}"
    yield f"HERE = {rest.rstrip()}\n\n"
    yield "markers = {}"
    for name, state in start_of(system).items():
        yield f"markers[{name!r}] = {_body(name, system.bodies[name], state, stem)}"
    for joint in system.joints:
        yield from _joint(joint)
    for closure in system.closures:
        yield _closure(closure)
    for load in system.loads:
        yield _force(load)
    yield '\nif __name__ == "__main__":\n    np.savez(HERE / f"{Path(__file__).stem}-run.npz", **run())'


def _list(values: Any) -> Any:
    return np.asarray(values, dtype=float).tolist()


def _body(name: str, body: FlexibleBody, state: BodyState, stem: str) -> str:
    """Return the call that adds a body where it starts, with velocities in the axes of the ground."""
    start = [_list(state.p), _list(state.R), _list(state.R @ state.V[:3]), _list(state.R @ state.V[3:])]
    placed = ", ".join(map(repr, start))
    if body.n:
        damping = _list(body.D if body.coupled_damping is None else body.coupled_damping)
        return f"flexible({name!r}, {_file(stem, name)!r}, {damping}, {placed})"
    J = np.trace(body.E0) * np.eye(3) - body.E0
    six = _list([J[0, 0], J[1, 1], J[2, 2], J[1, 2], J[0, 2], J[0, 1]])
    places = dict(zip(body.interface_name, _list(body.interface_position), strict=True))
    return f"rigid({name!r}, {body.m!r}, {_list(body.s0 / body.m)}, {six}, {places}, {placed})"


def _marker(end: str, position: np.ndarray) -> str:
    body, _, interface = end.partition(".")
    if body == "ground":
        return f"on_ground({_list(position)})"
    return f"markers[{body!r}][{interface!r}]" if interface else f"next(iter(markers[{body!r}].values()))"


def _frame(axis: np.ndarray) -> np.ndarray:
    """Return axes whose z is a unit vector."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _joint(joint: Joint) -> Iterator[str]:
    if joint.type == "free":
        return
    parent = _marker(joint.parent, joint.position)
    child = _marker(joint.child, joint.position)
    frame = _frame(joint.axis)
    ends = f"{joint.type!r}, {parent}, {child}, {_list(frame)}, {_list(joint.rotation.T @ frame)}"
    motion = (
        f", lambda t: {python_text(joint.motions[0], f'joint {joint.name!r}: the motion')}" if joint.motions else ""
    )
    yield f"joint({ends}{motion})"
    for each in joint.elements:
        drive = "0.0" if each.drive is None else python_text(each.drive, f"joint {joint.name!r}: the drive")
        yield f"spring({ends}, {each.stiffness!r}, {each.damping!r}, {each.free_position!r}, lambda t: {drive})"


def _closure(closure: Closure | Coupler) -> str:
    assert isinstance(closure, Closure)  # by `refuse_others`
    frame = _frame(closure.axis)
    ends = ", ".join(_marker(end, closure.position) for end in (closure.a, closure.b))
    return f"joint({closure.type!r}, {ends}, {_list(frame)}, {_list(closure.rotation.T @ frame)})"


def _force(load: Any) -> str:
    both = [_vector(getattr(load, key), f"force {load.name!r}") for key in ("force", "torque")]
    return f"push({_marker(load.at, np.zeros(3))}, {', '.join(both)}, {load.axes == 'body'})"


def _vector(components: tuple[TimeFunction, ...], what: str) -> str:
    if all(map(is_zero, components)):
        return "None"
    return f"lambda t: [{', '.join(f'({python_text(each, what)})' for each in components)}]"
