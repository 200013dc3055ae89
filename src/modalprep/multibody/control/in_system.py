"""A regulator in the nonlinear system: loads that follow the whole state, or the texts of control laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.analysis.inputs_outputs import Input
from modalprep.multibody.analysis.state_space import StateSpace
from modalprep.multibody.control.regulator import Regulator
from modalprep.multibody.control.rows import places
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.loads import Callback
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.coordinate_names import coordinate_names
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.suggest import refuse_other


def state_feedback(
    system: System, regulator: Regulator, *, name: str = "regulator", target: Mapping[str, float] | None = None
) -> Callback:
    """Return a load that drives a system by a regulator, all of whose states it measures.

    Parameters
    ----------
    system : System
        That of the linear equations, without the load.
    regulator : Regulator
        By `lqr` on what `linearise` returned, or on its balanced truncation.
    target : {state: value}
        Changes of states from the reference to which the regulator is to bring them, others to zero: where nothing
        holds the system there, such as the angle of a motor.

    Returns
    -------
    Callback
        One of the `loads` of a system.

    Raises
    ------
    InputError
        When the regulator is of another system, or of one whose reference moves.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.analysis.linearise import linearise
    >>> from modalprep.multibody.control.regulator import lqr
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.simulate import simulate
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="disc")
    >>> system = System(bodies={"disc": disc}, joints=(hinge,))
    >>> gains = lqr(linearise(system, inputs=["hinge"]), {"hinge.angle": 100.0, "hinge.rate": 20.0}, {"hinge": 1.0})
    >>> law = state_feedback(system, gains, target={"hinge.angle": 0.5})
    >>> run = simulate(system.with_(loads=(law,)), t_end=5.0)
    >>> bool(abs(run["hinge.angle"][-1] - 0.5) < 1e-4)
    True
    """
    plant = _plant(system, regulator)
    packed = pack(system)
    change = _change(packed, plant.y)
    rows = np.concatenate([plant.independent, packed.nu + plant.independent])
    aim = np.zeros(len(rows))
    aim[places(target or (), plant.states, "state feedback: target")] = list((target or {}).values())
    outlets = _outlets(system, regulator.inputs)

    def function(t: float, state: State) -> dict[str, np.ndarray]:
        sizes = -regulator.K @ (change(state.vector)[rows] - aim)
        found: dict[str, np.ndarray] = {}
        for size, (at, push) in zip(sizes, outlets, strict=True):
            found[at] = found.get(at, 0.0) + size * push
        return found

    return Callback(name=name, function=function)


def control_laws(system: System, regulator: Regulator) -> dict[str, str]:
    """Return a regulator as expressions of channels, as `[controls]` of a pipeline file and `feedback` take them.

    Returns
    -------
    dict of str
        By the name of the input.

    Raises
    ------
    InputError
        When the regulator is of another system, of one whose reference moves, or needs a shift or a rotation of a
        spherical or free joint, for which there is `state_feedback`.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.analysis.linearise import linearise
    >>> from modalprep.multibody.control.regulator import lqr
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.5)
    >>> system = System(bodies={"arm": uniform_beam(modes=0)}, joints=(hinge,))
    >>> gains = lqr(linearise(system, inputs=["hinge"]), {"hinge.angle": 4.0}, {"hinge": 1.0})
    >>> control_laws(system, gains)["hinge"].split(" + ")[0].partition("*")[2]
    '(hinge.angle - 0.5)'
    """
    plant = _plant(system, regulator)
    packed = pack(system)
    known = _singles(packed)
    lost = [name for name in plant.states if name not in known]
    if lost:
        raise InputError(
            f"control laws: no channel of a run is {lost[0]!r}, a change in the axes of the child; use state_feedback"
        )
    terms = [f"({name} - {float(plant.y[known[name]])!r})" for name in plant.states]
    return {
        name: " + ".join(f"{-float(gain)!r}*{term}" for gain, term in zip(row, terms, strict=True))
        for name, row in zip(regulator.inputs, regulator.K, strict=True)
    }


def _plant(system: System, regulator: Regulator) -> StateSpace:
    """Return the linear equations of a regulator, refused where they are of another system or of a motion."""
    refuse_other("state feedback: the system", System, system)
    plant = regulator.plant
    if not isinstance(plant, StateSpace):
        raise InputError(
            "state feedback: the regulator is not of linear equations by linearise; make them of the system"
        )
    packed = pack(system)
    names = coordinate_names(packed)
    own = tuple(each[k] for each in names for k in plant.independent if k < packed.nu)
    if len(plant.y) != packed.nx + packed.nu or own != plant.states:
        raise InputError("state feedback: the regulator is of another system; its states are other ones")
    if np.any(plant.y[packed.nx :]):
        raise InputError(
            "state feedback: the linear equations are about a motion, whose reference moves; take a state at rest"
        )
    return plant


class _Outlet(NamedTuple):
    """Where an input acts, as a callback names it, and what a unit of it is there."""

    at: str
    push: np.ndarray


def _outlets(system: System, inputs: tuple[str, ...]) -> list[_Outlet]:
    evaluator = Evaluator(system)
    found = []
    for name in inputs:
        given = Input(evaluator, name)
        if given.link >= 0:
            found.append(_Outlet(given.at, given.wrench))
        else:
            joint = evaluator.owner[int(np.flatnonzero(given.tau)[0])][1]
            found.append(_Outlet(joint, given.tau[evaluator.packed.speeds_of(joint)]))
    return found


def _singles(packed: Packed) -> dict[str, int]:
    """Return the places in the state of coordinates that are numbers, and of all speeds, by name."""
    names = coordinate_names(packed)
    found = {name: packed.nx + k for k, name in enumerate(names.speeds)}
    found |= {names.coordinates[u]: x for u, x in _pairs(packed)}
    return found


def _pairs(packed: Packed) -> list[tuple[int, int]]:
    """Return the indices of the speed and of the coordinate, for coordinates that are single numbers."""
    single = [(u, x) for code, x, u, _ in packed.columns if KINDS[code].named]
    modal = [
        pair for _, x, u in packed.flexible for pair in zip(range(u.start, u.stop), range(x.start, x.stop), strict=True)
    ]
    return single + modal


def _change(packed: Packed, reference: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return ``y -> [changes of coordinates | speeds]`` (2 nu,) from a reference state."""
    u, x = np.array(_pairs(packed), dtype=int).reshape(-1, 2).T
    turning = [(KINDS[code], x, u) for code, x, u, _ in packed.columns if KINDS[code].quaternion >= 0]

    def change(y: np.ndarray) -> np.ndarray:
        found = np.concatenate([np.zeros(packed.nu), y[packed.nx :]])
        found[u] = y[x] - reference[x]
        for kind, first, speed in turning:
            n = kind.translations
            own = slice(first + n, first + n + 4)
            found[speed : speed + n] = _in_axes(reference[own], y[first : first + n] - reference[first : first + n])
            found[speed + n : speed + n + 3] = _turn(reference[own], y[own])
        return found

    return change


def _turn(q0: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the rotation vector (3,) from one unit quaternion to another, in the axes of the first.

    Examples
    --------
    >>> _turn(np.array([1.0, 0, 0, 0]), np.array([np.cos(0.1), 0, 0, np.sin(0.1)])).round(12)
    array([0. , 0. , 0.2])
    """
    w = float(q0 @ q)
    v = np.copysign(1.0, w) * (q0[0] * q[1:] - q[0] * q0[1:] - np.cross(q0[1:], q[1:]))
    s = float(np.linalg.norm(v))
    return v * (2 * np.arctan2(s, abs(w)) / s) if s else 2 * v


def _in_axes(q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Return a vector in the axes that a unit quaternion turns, ``R^T r``."""
    return r - 2 * q[0] * np.cross(q[1:], r) + 2 * np.cross(q[1:], np.cross(q[1:], r))
