"""Calls of the kernels that Python calls, with all types of their arguments.

They are what the library of kernels is built from, and what `modalprep warmup` does.
``python -m modalprep.exercise FOLDER PLATFORMS [NAMES of jobs]`` builds it for platforms with commas between them, each
in a folder of its own.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.compiler.jit import compile_for
from modalprep.errors import ModalprepError
from modalprep.multibody.model.system import System

if TYPE_CHECKING:
    from modalprep.multibody.evaluation.loops import Loops
    from modalprep.multibody.kernels.data import Data


def elements() -> None:
    """Assemble, reduce and check; elements of curved shells and of directional materials are called without cells."""
    from modalprep.body.build import flexible_body
    from modalprep.body.checks import check_body
    from modalprep.examples import block_model
    from modalprep.fe.elements.kernels import directional_elastic, directional_stress, quadratic
    from modalprep.fe.readers.numbers import plain_numbers
    from modalprep.reduction.craig_bampton import craig_bampton

    model = block_model()
    check_body(flexible_body(model, craig_bampton(model, modes=2), name="block"))
    none = [np.empty(ndim * (0,)) for ndim in range(6)]
    quadratic(0, 0, none[4], none[3], none[2], none[3])
    directional_elastic(0, 0, none[4], none[2], none[5], none[3])
    directional_stress(0, 0, none[4], none[4], none[5], none[5])
    plain_numbers(np.frombuffer(b"1.5", dtype=np.uint8), np.array([0]), np.array([3]), np.array([False]))


def solver(kind: str) -> None:
    """Simulate and analyse one of `examples.small_systems`."""
    from modalprep.examples import small_systems
    from modalprep.multibody.analysis.linearise import linearise
    from modalprep.multibody.simulate import simulate

    system = small_systems()[kind]
    simulate(system, t_end=1e-3)
    for kernel, arguments in _kernels(system):
        compile_for(kernel, *arguments)
    for call in (
        linearise,
        _events,
        _analyses,
        _slopes,
        *(partial(_gradient, method) for method in ("explicit", "rosenbrock", "generalised_alpha")),
        _gradients_of_springs,
    ):
        with suppress(ModalprepError):  # not all of them can be had of every system
            call(system)


def _kernels(system: System) -> Iterator[tuple[Any, tuple]]:
    """Yield kernels that only some analyses and loads call, with arguments of the right types."""
    from modalprep.multibody.elements import registry, rotational_spring
    from modalprep.multibody.evaluation import equations_of_motion, evaluate
    from modalprep.multibody.evaluation.evaluator import Evaluator
    from modalprep.multibody.integration import driver
    from modalprep.multibody.integration.stepping import new_run
    from modalprep.multibody.integration.watching import new_watch
    from modalprep.multibody.kernels import articulated_body, energy, interfaces, joints, newton_euler, responses
    from modalprep.multibody.kernels.loads import variable_mass
    from modalprep.multibody.kernels.tangents import frames
    from modalprep.multibody.packing.free_parts import part_of_links
    from modalprep.multibody.results import observation
    from modalprep.multibody.results.channels import Channels

    e = Evaluator(system)
    packed, loading, loads = e.packed, e.loading, e.loading.arrays
    model, data = packed.model, packed.data()
    y, u = np.append(e.start, 0.0), np.zeros(e.nu)
    motion = loading.motion
    eq = evaluate.build_equations(packed, loading, data)
    run = new_run(y, part_of_links(system, packed), 0, 1e-5, 1e-10, 0.9, 0.0, 1.0, 1.0)
    watch = new_watch(np.zeros(0), np.zeros(packed.nx), len(y), eq)
    seen = Channels(system, packed, loading.loops)
    call = equations_of_motion.Call(eq, np.zeros(1), y, u, y, 1.0)
    vector = 0.0, 0.0, 0.0
    yield from ((kernel, (call,)) for kernel in (equations_of_motion.update, equations_of_motion.update_at_once))
    yield evaluate.evaluate, (eq, 0.0, y, y)
    yield evaluate.load, (eq, 0.0, y)
    yield driver.sample, (model, run, watch)
    yield observation.observe, (eq, seen.columns, 0.0, y, y, np.zeros(seen.width))
    yield registry.prescribe, (loads, 0.0, motion)
    yield registry.apply, (loads, model, data, y, 0.0, u, loading.slope)
    yield variable_mass.refresh, (loads.fill, loads.environment.tables, model, data, 0.0)
    yield rotational_spring.curve, (np.zeros((1, 7)), 0, 1, 0.0)
    yield articulated_body.outward, (model, data, y, motion)
    yield articulated_body.inward, (model, data, u, u, 0.0, 0.0)
    yield articulated_body.inward, (model, data, u, None, 0.0, 0.0)
    yield articulated_body.inward_bias, (model, data, u)
    yield articulated_body.forward, (model, data, u, u)
    yield articulated_body.forward_bias, (model, data, u, u)
    yield articulated_body.clear_wrenches, (model, data)
    yield articulated_body.kinematic, (model, y, y)
    yield joints.move, (model, y, u, y)
    yield joints.normalise, (model, y)
    yield interfaces.world, (model, data)
    yield interfaces.node_state, (model, data, 0, 0)
    yield interfaces.add_wrench, (model, data, 0, 0, vector, vector)
    yield energy.body_sums, (model, data, 0)
    yield newton_euler.required_forces, (model, data, u, u)
    work, forces = responses.new_responses(model, e.nu), np.zeros((e.nu, 1))
    yield responses.prepare, (model, data, work)
    yield responses.respond, (model, data, 1.0, forces, forces, 0, 0, u, u, work)
    yield responses.mean_response, (model, data, u, forces, u, work)
    if model.modal is not None:
        sweep, N = packed.sweep(), model.modal.K.shape[1]
        yield frames.field_tangent, (model, data, sweep, 0, np.zeros(3), np.zeros(9))
        yield frames.end_curvature, (model, data, sweep, 0, 0, np.zeros(6), np.zeros((N, N)))
    if loading.loops:
        yield from _kernels_of_loops(loading.loops, data, y, u, motion)


def _kernels_of_loops(loops: Loops, data: Data, y: np.ndarray, u: np.ndarray, motion: np.ndarray) -> Iterator:
    from modalprep.multibody.kernels.closed_loops import constraint_forces, constraints, factor, multipliers, projection
    from modalprep.multibody.kernels.closed_loops import responses as of_loops

    cons, model, work = loops.arrays, loops.packed.model, loops.work
    given = cons, model, data, loops.trial, y, motion, 0.0, work
    yield constraints.constraint_residual, (cons, model, data, y, motion, 0.0, work, False)
    yield factor.update_weights, (work,)
    yield multipliers.constraint_accelerations, (cons, model, data, work, u, u)
    yield constraint_forces.multiplier_response, (model, data, work)
    yield of_loops.gather_responses, (work,)
    yield of_loops.inward_with_rows, (cons, model, data, work, u, None, 0.0, 0.0)
    yield projection.rate_slopes, (cons, model, data, y, motion, 0.0, work, np.zeros((1, len(u))))
    yield projection.assemble, (*given, loops.orientations, loops.kept, u, 1.0, 1.0, y)
    yield projection.project_state, (*given, u, 1.0, 1.0, 1, False)
    yield projection.project_positions, (*given, u, 1.0, 1.0, 1, False)
    yield projection.project_velocities, (cons, model, data, y, motion, work, u, 1.0, 0.0, False)
    yield projection.is_reversed, (loops.orientations, work)


def _events(system: System) -> None:
    from modalprep.multibody.model.events import Event
    from modalprep.multibody.simulate import simulate

    events = [Event(name=when, when=when) for when in ("hinge.angle - 1", "rod.tip.rotation.z - 1")]
    simulate(system, t_end=1e-3, events=events, output_step=1e-4)


def _analyses(system: System) -> None:
    from modalprep.multibody.analysis.inverse_dynamics import inverse_dynamics
    from modalprep.multibody.analysis.system_modes import system_modes

    times = np.linspace(0.0, 1e-3, 5)
    system_modes(system)
    inverse_dynamics(system, {"hinge": np.zeros(5)}, times)


def _slopes(system: System) -> None:
    from modalprep.sensitivity.run_sensitivities import run_sensitivities

    run_sensitivities(system, ["hinge.angle"], ["hinge.angle", "gravity.y"], 1e-3)


def _gradient(method: str, system: System) -> None:
    from modalprep.multibody.model.joint_element import HingeElement
    from modalprep.sensitivity.gradient import gradient
    from modalprep.sensitivity.objective import last
    from modalprep.sensitivity.run_sensitivities import run_sensitivities

    system = system.with_(joints=(replace(system.joints[0], elements=HingeElement(damping=1.0)),))
    given = ["hinge.angle", "gravity.y"]
    gradient(system, last("hinge.angle"), [*given, *["hinge.damping"] * (method == "explicit")], 1e-3, method=method)
    run_sensitivities(system, ["hinge.angle"], given, 1e-3, method=method)


def _gradients_of_springs(system: System) -> None:
    from modalprep.multibody.model.loads import AxialSpring

    spring = AxialSpring(name="spring", between=("ground", "rod.tip"), stiffness=1.0)
    for method in ("explicit", "generalised_alpha"):
        _gradient(method, system.with_(loads=(spring,)))


def jobs() -> dict[str, Callable[[], None]]:
    """Return the calls by names for users; the systems of one kind of bodies follow each other."""
    from modalprep.runtime.kinds import KINDS

    return {"elements": elements} | {kind: partial(solver, kind) for kind in reversed(KINDS.values())}


if __name__ == "__main__":
    from modalprep.compiler.build import build

    folder, platforms, *names = sys.argv[1:]
    folders = {each: Path(folder) / each for each in platforms.split(",")}
    for each in folders.values():
        each.mkdir(parents=True, exist_ok=True)
    for path in build([jobs()[name] for name in names or jobs()], folders):
        print(path)
