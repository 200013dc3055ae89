"""Calls of the kernels that Python calls, with all types of their arguments.

They are what the library of kernels is built from, and what `modalprep warmup` does.
``python -m modalprep.exercise FOLDER [NAMES of jobs]`` builds it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from modalprep.errors import ModalprepError
from modalprep.multibody.model.system import System


def elements() -> None:
    """Assemble, reduce and check; elements of curved shells and of directional materials are called without cells."""
    from modalprep.body.build import flexible_body
    from modalprep.body.checks import check_body
    from modalprep.examples import block_model
    from modalprep.fe.elements.kernels import directional_elastic, directional_stress, quadratic
    from modalprep.reduction.craig_bampton import craig_bampton

    model = block_model()
    check_body(flexible_body(model, craig_bampton(model, modes=2), name="block"))
    none = [np.empty(ndim * (0,)) for ndim in range(6)]
    quadratic(0, 0, none[4], none[3], none[2], none[3])
    directional_elastic(0, 0, none[4], none[2], none[5], none[3])
    directional_stress(0, 0, none[4], none[4], none[5], none[5])


def solver(kind: str) -> None:
    """Simulate and analyse one of `examples.small_systems`."""
    from modalprep.examples import small_systems
    from modalprep.multibody.analysis.linearise import linearise
    from modalprep.multibody.simulate import simulate

    system = small_systems()[kind]
    simulate(system, t_end=1e-3)
    _equations(system)
    for call in linearise, _events, _analyses, _slopes:
        with suppress(ModalprepError):  # not all of them can be had of every system
            call(system)


def _equations(system: System) -> None:
    from modalprep.compiler.jit import bound
    from modalprep.multibody.evaluation.equations_of_motion import EquationsOfMotion, update

    bound(update, *EquationsOfMotion(system).update.first)  # type: ignore[attr-defined]


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


def jobs() -> dict[str, Callable[[], None]]:
    """Return the calls by names for users; the systems of one kind of bodies follow each other."""
    from modalprep.runtime.kinds import KINDS

    return {"elements": elements} | {kind: partial(solver, kind) for kind in reversed(KINDS.values())}


if __name__ == "__main__":
    from modalprep.compiler.build import build

    folder, *names = sys.argv[1:]
    for path in build([jobs()[name] for name in names or jobs()], Path(folder)):
        print(path)
