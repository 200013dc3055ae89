"""Another process compiles what a first run needs last: the same kernels, and only where nothing is compiled yet."""

import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numba
import pytest
from size import some

import modalprep as mp
from modalprep.examples import small_systems
from modalprep.multibody import compilation


@pytest.fixture
def started(monkeypatch):
    """Codes of the processes that would have been started."""
    found = []
    monkeypatch.setattr(compilation, "Popen", lambda command, **options: found.append(command[-1]))
    monkeypatch.setattr(compilation, "_started", {})
    monkeypatch.setattr(compilation.os, "cpu_count", lambda: 2)
    return found


@pytest.mark.parametrize("kind", some(small_systems(), 2))
def test_kernels_are_those_that_a_run_compiles(kind):
    """A run in a fresh process has every one of them, for the same types of arguments."""
    code = (
        "import sys\n"
        "import modalprep as mp\n"
        "from numba import typeof\n"
        "from modalprep.examples import small_systems\n"
        "from modalprep.multibody.compilation import _needed\n"
        "system = small_systems()[sys.argv[1]]\n"
        "mp.simulate(system, t_end=0.01)\n"
        "for kernel, arguments in _needed(system):\n"
        "    print(kernel.__name__, tuple(map(typeof, arguments)) in kernel.dispatcher.overloads)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, kind], capture_output=True, text=True)
    found = [line.split() for line in done.stdout.splitlines()]
    assert len(found) >= 9, done.stderr
    assert [name for name, known in found if known == "False"] == []


def test_a_compiled_solver_starts_no_process(started):
    for system in small_systems().values():
        mp.simulate(system, t_end=0.001)
    assert started == []


def test_the_first_compilation_of_each_kind_starts_one_process(started, monkeypatch):
    """Here of a kernel that stands for the equations of motion."""
    monkeypatch.setattr(compilation, "FIRST", (__name__,))
    systems = small_systems()
    for kind in ("rigid bodies in trees", "rigid bodies in trees", "flexible bodies in closed loops"):
        with compilation.by_two_processes(systems[kind]):
            numba.njit(lambda x: x + 1)(1.0)  # which no cache has
    assert [code.split("'")[1] for code in started] == ["rigid bodies in trees", "flexible bodies in closed loops"]


def test_processes_of_a_pool_start_none():
    with ProcessPoolExecutor(1, mp_context=get_context("fork")) as pool:
        assert pool.submit(_attempt).result() == {}


def _attempt():
    compilation._started.clear()
    compilation._start("rigid bodies in trees")
    return compilation._started
