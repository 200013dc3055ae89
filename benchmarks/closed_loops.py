"""How does one evaluation of the accelerations of closed loops in space compare with Pinocchio's constraint dynamics?

    python benchmarks/closed_loops.py [--quick]

The systems are those of spatial.py, moving at random as their loops allow. Pinocchio has the same bodies and joints;
ball joints close its loops as CONTACT_3D, and Bennett's hinge as two of them on its axis, so that four of its six rows
depend on the others: there its proximal iterations run with mu = 1e-6. What it has no constraint for, the slider crank,
is left out. The accelerations of both must agree, or the benchmark stops.

Prints CPU times, medians of alternating rounds in one process, then one line of JSON. Of each system `python` is
Pinocchio's time over ours, both called from Python; `python_lcaba` the same with its loop-constrained articulated-body
algorithm (null where this does not agree with its constraint dynamics: four bars); `cpp` that of Pinocchio's constraint
dynamics in a C++ loop and ours in a compiled loop; `cpp_tree` that of the trees without closures, by its
articulated-body algorithm; `difference` the largest difference of the accelerations over the largest acceleration.
Numbers above one are in our favour; null where Pinocchio or a C++ compiler is missing.
"""

from __future__ import annotations

import argparse
import ctypes
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import spatial
from chains import medians
from peers_rigid import compiled_loop
from scissor import compiled

import modalprep as mp
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.packing.packed import Packed

SOURCE = Path(__file__).with_name("pinocchio_closed.cpp")
SYSTEMS = {
    "four bars": spatial.four_bar(),
    "Bennett's linkage": spatial.bennett(),
    "hexapod": spatial.hexapod(),
}
KINDS = ("revolute", "prismatic", "spherical", "universal")
BODY = np.dtype([
    ("kind", float), ("parent", float), ("place", float, 3), ("axis", float, 3), ("second", float, 3),
    ("mass", float), ("centre", float, 3), ("inertia", float, (3, 3)),
])  # fmt: skip
CONTACT = np.dtype([("a", float), ("b", float), ("in_a", float, 3), ("in_b", float, 3)])
PROXIMAL = {True: (1e-6, 20), False: (0.0, 1)}  # mu and steps, of rows that depend on each other and of others
LOOP_CONSTRAINED = (1e-8, 20)  # the same of its loop-constrained algorithm, whose mu must be positive
ACCURACY = 1e-10  # of the proximal iterations
AGREE = 1e-6
RATIOS = {"python": "ours", "python_lcaba": "ours", "cpp": "ours in a loop", "cpp_tree": "our tree"}


class Peer(NamedTuple):
    """A system as Pinocchio reads it."""

    bodies: np.ndarray  # BODY, parents counted from 1; 0 is the ground
    contacts: np.ndarray  # CONTACT
    redundant: bool  # whether rows depend on each other

    @property
    def proximal(self) -> tuple[float, int]:
        """Mu and the most steps of the proximal iterations."""
        return PROXIMAL[self.redundant]


def depth_first(joints: Sequence[mp.Joint], parent: str = "ground") -> list[mp.Joint]:
    """Return joints, each followed at once by all that it carries, which Pinocchio's mass matrix takes for granted."""
    found = []
    for joint in joints:
        if joint.parent.partition(".")[0] == parent:
            found += [joint, *depth_first(joints, joint.child)]
    return found


def peer(system: mp.System) -> Peer:
    """Return a system that is drawn closed, its bodies in the axes of space."""
    joints = depth_first(system.joints)
    names = {joint.child: k for k, joint in enumerate(joints, 1)}
    bodies = np.zeros(len(names), BODY)
    for k, joint in enumerate(joints):
        body = system.bodies[joint.child]
        parent, place = _end(system, names, joint.parent, joint.position)
        centre = body.s0 / body.m
        about_centre = body.E0 - body.m * np.outer(centre, centre)
        inertia = np.trace(about_centre) * np.eye(3) - about_centre
        second = np.zeros(3) if joint.second_axis is None else joint.second_axis
        bodies[k] = KINDS.index(joint.type), parent, place, joint.axis, second, body.m, centre, inertia
    contacts = [contact for closure in system.closures for contact in _contacts(system, names, closure)]
    return Peer(bodies, np.array(contacts, CONTACT), any(closure.type == "revolute" for closure in system.closures))


def _end(system: mp.System, names: dict[str, int], end: str, position: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the joint of an end, 0 of the ground, and its place there."""
    if end == "ground":
        return 0, position
    name, _, interface = end.partition(".")
    body = system.bodies[name]
    return names[name], body.interface_position[body.interface_name.index(interface)]


def _contacts(system: mp.System, names: dict[str, int], closure: Any) -> list[tuple]:
    """Return one point that a ball joint holds together, or two on the axis of a hinge."""
    a, in_a = _end(system, names, closure.a, closure.position)
    b, in_b = _end(system, names, closure.b, closure.position)
    shifts = (np.zeros(3), closure.axis) if closure.type == "revolute" else (np.zeros(3),)
    return [(a, b, in_a + shift, in_b + shift) for shift in shifts]


def moving_state(system: mp.System) -> np.ndarray:
    """Return the drawn state with random speeds that keep the loops closed, about 1 rad/s or m/s."""
    evaluator = Evaluator(system)
    y, nx = evaluator.start.copy(), evaluator.nx
    G, speeds = evaluator.jacobian(y), np.random.default_rng(0).standard_normal(evaluator.nu)
    y[nx:] = speeds - np.linalg.pinv(G, rcond=1e-9) @ (G @ speeds)
    return y


def places(packed: Packed, system: mp.System) -> list[int]:
    """Return where the speeds of the joints stand in the state, in the peer's order."""
    return [packed.nx + u for joint in depth_first(system.joints) for u in packed.speeds_of(joint.name)]


def from_python(given: Peer, v: np.ndarray) -> tuple[list[Callable[[int], None]], list[np.ndarray]] | None:
    """Return calls of Pinocchio's two algorithms from Python, and their accelerations; None where it is missing."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    calls, found = [], []
    for algorithm, proximal in ((pin.constraintDynamics, given.proximal), (pin.lcaba, LOOP_CONSTRAINED)):
        model, contacts, datas = _model(pin, given)
        data = model.createData()
        pin.initConstraintDynamics(model, data, contacts, datas)
        if algorithm is pin.lcaba:
            pin.computeJointMinimalOrdering(model, data, contacts)
        settings = pin.ProximalSettings(ACCURACY, *proximal)
        arguments = model, data, pin.neutral(model), v, np.zeros(model.nv), contacts, datas, settings
        calls.append(partial(_repeat, algorithm, arguments))
        found.append(algorithm(*arguments).copy())
    return calls, found


def _repeat(call: Callable, arguments: tuple, count: int) -> None:
    for _ in range(count):
        call(*arguments)


def _model(pin: Any, given: Peer) -> tuple[Any, Any, Any]:
    """Return Pinocchio's model, contacts and their data."""
    model, turn, makers = pin.Model(), np.eye(3), (
        lambda own: pin.JointModelRevoluteUnaligned(own["axis"]),
        lambda own: pin.JointModelPrismaticUnaligned(own["axis"]),
        lambda own: pin.JointModelSpherical(),
        lambda own: pin.JointModelUniversal(own["axis"], own["second"]),
    )  # fmt: skip
    for k, own in enumerate(given.bodies):
        joint = makers[int(own["kind"])](own)
        index = model.addJoint(int(own["parent"]), joint, pin.SE3(turn, own["place"]), f"j{k}")
        model.appendBodyToJoint(index, pin.Inertia(own["mass"], own["centre"], own["inertia"]), pin.SE3.Identity())
    contacts, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for own in given.contacts:
        ends = int(own["a"]), pin.SE3(turn, own["in_a"]), int(own["b"]), pin.SE3(turn, own["in_b"])
        contacts.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *ends, pin.ReferenceFrame.LOCAL))
        datas.append(contacts[-1].createData())
    return model, contacts, datas


def library() -> ctypes.CDLL | None:
    """Return Pinocchio's loops in C++; None without compiler or Eigen."""
    found = compiled_loop(SOURCE)
    if found is not None:
        number, address = ctypes.c_int, ctypes.c_void_p
        found.make_closed.restype = address
        found.make_closed.argtypes = [number, address, number, address, ctypes.c_double, number, address]
        for repeat in (found.repeat_closed, found.repeat_tree):
            repeat.argtypes = [address, number]
        found.accelerations.argtypes = [address, address]
    return found


def from_cpp(loops: ctypes.CDLL, given: Peer, v: np.ndarray) -> tuple[list[Callable[[int], None]], np.ndarray]:
    """Return calls of the compiled loops with and without closures, and the accelerations with them."""
    bodies, contacts, out = given.bodies, given.contacts, np.zeros(len(v))
    made = loops.make_closed(
        len(bodies), bodies.ctypes.data, len(contacts), contacts.ctypes.data, *given.proximal, v.ctypes.data
    )
    loops.repeat_closed(made, 1)
    loops.accelerations(made, out.ctypes.data)
    calls = [lambda count: loops.repeat_closed(made, count), lambda count: loops.repeat_tree(made, count)]
    return calls, out


def compared(system: mp.System, loops: ctypes.CDLL | None, rounds: int) -> dict[str, float | None]:
    """Return the ratios of a system and the difference of the accelerations."""
    y, equations, given = moving_state(system), mp.multibody.EquationsOfMotion(system), peer(system)
    equations.y[:] = y
    equations.update()
    order = places(equations.packed, system)
    v, own = y[order], equations.ydot[order]
    python = from_python(given, v)
    if python is None:
        return dict.fromkeys((*RATIOS, "difference"))
    (dynamics, recursive), (udot, other) = python
    calls, found = {"ours": partial(_repeat, equations.update, ()), "python": dynamics}, [udot]
    if _apart(other, own) < AGREE:
        calls["python_lcaba"] = recursive
    if loops is not None:
        (closed, tree), udot = from_cpp(loops, given, v)
        calls |= {"ours in a loop": compiled(system, y), "cpp": closed}
        calls |= {"our tree": compiled(system.with_(closures=()), y), "cpp_tree": tree}
        found.append(udot)
    difference = max(_apart(udot, own) for udot in found)
    if not difference < AGREE:
        raise RuntimeError(f"the accelerations differ by {difference:.1e} of the largest")
    return _ratios(dict(zip(calls, medians(list(calls.values()), rounds), strict=True))) | {"difference": difference}


def _apart(udot: np.ndarray, own: np.ndarray) -> float:
    """Return the largest difference of accelerations over the largest of ours."""
    return float(f"{np.abs(udot - own).max() / np.abs(own).max():.1e}")


def _ratios(spent: dict[str, float]) -> dict[str, float | None]:
    """Return the peers' times over ours, and print all."""
    print(", ".join(f"{name} {time:.2f} us" for name, time in spent.items()))
    return {name: round(spent[name] / spent[own], 2) if name in spent else None for name, own in RATIOS.items()}


def main() -> None:
    """Print the ratios and the line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    rounds, loops, figures = 15 if parser.parse_args().quick else 101, library(), {}
    for name, system in SYSTEMS.items():
        figures[name] = compared(system, loops, rounds)
        print(f"{name}: {figures[name]}", flush=True)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
