"""Compilation by two processes: a second one compiles what the first run of the solver needs last."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import parent_process
from subprocess import DEVNULL, Popen

import numpy as np

from modalprep.compiler.jit import compile_for, is_cached, when_compiling
from modalprep.multibody.evaluation import evaluate
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.dop853 import explicit_rows
from modalprep.multibody.integration.generalized_alpha import alpha_step
from modalprep.multibody.integration.rosenbrock import rosenbrock_step
from modalprep.multibody.integration.stepping import new_run, set_weights
from modalprep.multibody.kernels.articulated_body import forward, inward
from modalprep.multibody.kernels.closed_loops.factor import solve_multipliers
from modalprep.multibody.kernels.closed_loops.responses import inward_with_rows
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.free_parts import part_of_links
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.channels import Channels
from modalprep.multibody.results.observation import observe

FIRST = evaluate.__name__, "modalprep.multibody.kernels.closed_loops"  # modules of kernels that a first run begins with
_started: dict[str, Popen] = {}  # by the kind of system


@contextmanager
def by_two_processes(system: System) -> Iterator[None]:
    """Let a second process compile kernels that are needed last, if the equations of a system must be compiled.

    Each process finds in the cache what the other one has compiled. Workers of a process pool start no second process.

    Examples
    --------
    >>> from modalprep.examples import small_systems
    >>> with by_two_processes(small_systems()["rigid bodies in trees"]):
    ...     pass
    """
    with when_compiling(partial(_start, _kind(system)), FIRST):
        yield


def _kind(system: System) -> str:
    """Return the name of the system among `small_systems` that needs the same kernels."""
    bodies = "flexible" if any(body.n for body in system.bodies.values()) else "rigid"
    return f"{bodies} bodies in {'closed loops' if system.closures else 'trees'}"


def _start(kind: str) -> None:
    if kind in _started or not _may_start():
        return
    code = (
        "from modalprep.examples import small_systems; from modalprep.multibody.compilation import compile_last; "
        f"compile_last(small_systems()[{kind!r}])"
    )
    with suppress(OSError):  # without it everything is compiled here
        _started[kind] = Popen([sys.executable, "-c", code], stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL)


def _may_start() -> bool:
    """Whether there is a core to spare, a cache to share, and a Python to start (not a program that embeds it)."""
    spare = parent_process() is None and (os.cpu_count() or 1) > 1
    return spare and is_cached(evaluate.evaluate) and "python" in os.path.basename(sys.executable or "").lower()


def compile_last(system: System) -> None:
    """Compile kernels for the first run of a system; where possible, those that the run needs last come first.

    Examples
    --------
    >>> from modalprep.examples import small_systems
    >>> compile_last(small_systems()["rigid bodies in trees"])
    """
    for kernel, arguments in _needed(system):
        compile_for(kernel, *arguments)


def _needed(system: System) -> Iterator[tuple[Callable, tuple]]:
    """Yield kernels and their arguments; the loads, with which the first process begins, come last."""
    packed = pack(system)
    loading = Loading(system, packed, 1.0)
    eq = evaluate.build_equations(packed, loading, packed.data())
    y = np.append(start_state(packed), 0.0)
    run = new_run(y, part_of_links(system, packed), 0, 1e-5, 1e-10, 0.9, 0.0, 1.0, 1.0)
    model, data, tau = eq.model, eq.data, eq.tau
    if loading.loops:
        yield solve_multipliers, (eq.work,)
        yield inward_with_rows, (eq.cons, model, data, eq.work, tau, None, 0.0, 0.0)
    else:
        yield inward, (model, data, tau, None, 0.0, 0.0)
    yield forward, (model, data, tau, tau)
    channels = Channels(system, packed, loading.loops)
    yield observe, (eq, channels.columns, 0.0, y, y, np.empty(channels.width))
    yield inward, (model, data, tau, eq.hinge, 0.0, 0.0)
    yield set_weights, (model, eq.linear, run, y, True)
    yield evaluate.smooth, (eq, 0.0, 0.0, tau, tau)
    for kernel in explicit_rows, alpha_step, rosenbrock_step:
        yield kernel, (eq, run, 0.0, 0.0)
