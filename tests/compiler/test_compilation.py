"""The kernel as plain Python, and its compilation where no cache can be written."""

import contextlib
import gc
import importlib
import itertools
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from fresh_process import printed
from numba.core.caching import IndexDataCacheFile
from packaging.requirements import Requirement
from size import FULL, some

from modalprep import exercise
from modalprep.cli import main
from modalprep.compiler import cache, dispatch_code, jit, switch
from modalprep.examples import small_systems

TESTS = Path(__file__).parents[1]


def test_plain_python_gives_the_same_and_stays_in_bounds():
    code = (
        "from multibody.kernels.closed_loops import test_constraints as loops\n"
        "from multibody.kernels.test_kernel import test_order_n_equals_dense_on_random_trees as test\n"
        "from compiler import test_lanes as lanes\n"
        "from modalprep.multibody.kernels import articulated_body as kernel\n"
        "assert type(kernel.accelerations).__name__ == 'function'\n"
        "for seed in range(10): test(seed, 6)\n"
        "for seed in range(10): loops.test_loops_equal_the_dense_solution_on_random_trees(seed)\n"
        "for name in ('operators_take_lanes_and_numbers', 'sums_and_numbers'): getattr(lanes, 'test_' + name)()\n"
    )
    paths = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_no_writable_cache_is_no_error(monkeypatch):
    def no_locator(function, stamp):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(dispatch_code, "KernelCache", no_locator)
    assert jit.compile_kernel(lambda x: x + 1)(1.0) == 2.0


@pytest.mark.parametrize(
    ("change", "further_down"),
    some(itertools.product(["return 3 * x", "return x * SCALE", "SCALE = 5"], [False, True]), 3),
)
def test_cache_follows_helpers_and_constants_of_other_files(tmp_path, change, further_down):
    """The compiled caller is used again while its helper is the same, and compiled anew when that changes."""
    head = "from modalprep.compiler.jit import compile_inline, compile_kernel\n"
    helper = head + "SCALE = 4\n@compile_inline\ndef scaled(x):\n    return 2 * x\n"
    caller = [
        "@compile_kernel\ndef total(x):\n    return add(x)\n",
        "@compile_kernel\ndef add(x):\n    return scaled(x) + SCALE\n",
    ]
    caller = head + "from helper import SCALE, scaled\n" + "".join(caller if further_down else caller[::-1])
    run = "import caller; print(caller.total(1.0), sum(caller.total.dispatcher.stats.cache_hits.values()))"
    (tmp_path / "caller.py").write_text(caller)

    def result(text):
        (tmp_path / "helper.py").write_text(text)
        return printed(run, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache")).strip()

    old = "SCALE = 4" if change.startswith("SCALE") else "return 2 * x"
    expected = {"return 3 * x": "7.0 0", "return x * SCALE": "8.0 0", "SCALE = 5": "7.0 0"}[change]
    assert [result(helper), result(helper), result(helper.replace(old, change))] == ["6.0 0", "6.0 1", expected]
    assert not list((tmp_path / "cache").rglob("*.nbi"))  # none of numba's own files


def test_numba_is_one_that_was_tried(project):
    """Its private parts are used; of another version they are not, and no bound keeps it out."""
    needed = tomllib.loads((project / "pyproject.toml").read_text())["project"]["optional-dependencies"]["build"]
    (bound,) = [Requirement(text) for text in needed if text.startswith("numba")]
    assert [part.operator for part in bound.specifier] == [">="]
    assert switch.is_fast(numba.__version__, "")


PRIVATE = (
    r"(?:numba|llvmlite)[\w.]*\._(?!_)\w+|import _(?!_)\w+"
    r"|\._(?:compile_core|shared_module|final_module|engine|cache|reduce)\b"
)


def test_private_parts_are_used_behind_the_switch_only(project):
    """The files that use them are imported where `fast` says so."""
    folder = project / "src" / "modalprep" / "compiler"
    for name in ("stamps", "switch", "by_address", "address_code", "callback_code"):
        assert not re.search(PRIVATE, (folder / f"{name}.py").read_text()), name
    text = (folder / "dispatch_code.py").read_text()
    assert re.findall(
        r"\nif fast\(\):\n    from modalprep.compiler import linking\n    from [\w.]+ import KernelCache\n", text
    )


SMALL = """
from typing import NamedTuple
import numpy as np
from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import bound, compile_inline, compile_kernel
from modalprep.compiler.switch import fast
from modalprep.compiler.lanes import add_lanes, four

@by_address
class Line(NamedTuple):
    slope: float
    points: np.ndarray

@compile_inline
def square(x):
    return x * x

@compile_kernel
def total(line, k):
    return line.slope * line.points[k] + square(add_lanes(four(1.0) * line.points[0]))

print(fast(), bound(total, Line(2.0, np.array([1.5, 3.0])), rest=(int,))(1))
"""
TREE = """
import numpy as np, modalprep as mp
from modalprep.compiler.switch import fast
from modalprep.examples import small_systems
found = mp.simulate(small_systems()["flexible bodies in trees"], t_end=0.02)
print(fast(), *(float(np.sum(found[name] ** 2)) for name in found.channels))
"""


def by_both(code):
    """Return what code prints where the private parts of numba are used, and where they are not."""
    command = [sys.executable, "-W", "ignore", "-c", code]
    environments = [os.environ | {"MODALPREP_COMPILER": wanted} for wanted in ("fast", "plain")]
    found = [subprocess.run(command, env=e, capture_output=True, text=True, check=True) for e in environments]
    fast, plain = (process.stdout.split() for process in found)
    assert (fast[0], plain[0]) == ("True", "False")
    return np.array(fast[1:], float), np.array(plain[1:], float)


def test_kernels_need_no_private_part_of_numba():
    """Records, lanes, functions compiled into others: 2 3 + (4 1.5)^2."""
    assert [found.tolist() for found in by_both(SMALL)] == [[42.0], [42.0]]


@pytest.mark.skipif(not FULL, reason="takes five minutes")
def test_plain_kernels_give_the_same_numbers():
    """The run of a tree of flexible bodies by the public interface of numba alone, to round-off."""
    fast, plain = by_both(TREE)
    np.testing.assert_allclose(plain, fast, rtol=1e-9)


def compiled_files(folder, stamp="now"):
    """The files of one function, as another process sees them."""
    return cache.CompiledFiles(IndexDataCacheFile(str(folder), "f-1.py311", None), stamp)


def test_processes_that_compile_at_the_same_time_do_not_mix_their_code(tmp_path):
    """Both look, then both save: Numba's own files give one of them the code of the other."""
    keys = [(numba.types.float64(t, t), "cpu") for t in (numba.types.float64, numba.types.int64)]
    processes = [compiled_files(tmp_path), compiled_files(tmp_path)]
    assert [files.load(key) for files, key in zip(processes, keys, strict=True)] == [None, None]
    for files, key in zip(processes, keys, strict=True):
        files.save(key, f"code of {key}")
    assert [compiled_files(tmp_path).load(key) for key in keys] == [f"code of {key}" for key in keys]


def test_code_of_another_version_or_half_a_file_is_compiled_anew(tmp_path):
    key = (numba.types.float64(numba.types.float64), "cpu")
    compiled_files(tmp_path).save(key, "code" * 1000)
    assert compiled_files(tmp_path, "later").load(key) is None
    (file,) = tmp_path.iterdir()
    for size in (0, 10, file.stat().st_size // 2):
        file.write_bytes(file.read_bytes()[:size])
        assert compiled_files(tmp_path).load(key) is None
    compiled_files(tmp_path, "later").save(key, "new")
    assert compiled_files(tmp_path, "later").load(key) == "new"
    assert [file] == list(tmp_path.iterdir())  # nothing is left of the old one


def test_full_disk_leaves_the_cache_as_it_was(tmp_path):
    key = (numba.types.float64(numba.types.float64), "cpu")
    compiled_files(tmp_path / "missing").save(key, "code")
    assert compiled_files(tmp_path / "missing").load(key) is None


def test_second_process_finds_the_compiled_kernel():
    """What this process has compiled or found, the next one loads: counted by numba itself."""
    code = (
        "import numpy as np, modalprep as mp\n"
        "from modalprep.examples import uniform_beam\n"
        "from modalprep.multibody.evaluation.evaluate import evaluate\n"
        "from modalprep.multibody.preparation import prepare\n"
        "hinge = mp.Joint(name='h', type='revolute', parent='ground', child='a')\n"
        "system = mp.System(bodies={'a': uniform_beam(modes=1)}, joints=(hinge,))\n"
        "prepare(system, np.array([0.0, 1.0]), method='auto', rtol=1e-5, atol=1e-9)\n"
        "stats = evaluate.dispatcher.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))\n"
    )
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True) for _ in range(2)]
    assert runs[0].stdout.strip() in ("0 1", "1 0"), runs[0].stderr
    assert runs[1].stdout.strip() == "1 0", runs[1].stderr


def test_compilation_is_announced_once_and_only_when_the_cache_is_cold(tmp_path):
    """Two kernels of the package and one of another; the second process loads all of them."""
    head = "from modalprep.compiler.jit import compile_kernel\n"
    (tmp_path / "solver.py").write_text(head + "".join(
        f"@compile_kernel\ndef {name}(x):\n    return x + 1\n" for name in ("first", "second")
    ))  # fmt: skip
    (tmp_path / "other.py").write_text(head + "@compile_kernel\ndef third(x):\n    return x + 1\n")
    run = (
        "import other, solver\nfrom modalprep.compiler.jit import when_compiling\n"
        "with when_compiling(lambda: print('compiling'), 'solver'):\n"
        "    print(other.third(1.0))\n    print(solver.first(1.0), solver.second(1.0))\n"
    )
    said = [printed(run, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache")).split("\n")[:-1] for _ in range(2)]
    assert said == [["2.0", "compiling", "2.0 2.0"], ["2.0", "2.0 2.0"]]


def test_read_only_installation_compiles_in_memory(tmp_path):
    """No folder beside the file nor of the user takes a cache: a plain file stands where each would be made."""
    (tmp_path / "solver.py").write_text(
        "from modalprep.compiler.jit import compile_kernel\n@compile_kernel\ndef first(x):\n    return x + 1\n"
    )
    blocked = tmp_path / "__pycache__"
    blocked.write_text("")
    code = (
        "import solver; print(solver.first(1.0), type(solver.first.dispatcher._cache).__name__)\n"
        "from modalprep.multibody.kernels.articulated_body import forward\n"
        "print(type(forward.dispatcher._cache).__name__)"
    )
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"PYTHONPATH": path, "XDG_CACHE_HOME": str(blocked), "HOME": str(blocked)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run([sys.executable, "-B", "-c", code], env=environment, capture_output=True, text=True)
    assert done.stdout.split() == ["2.0", "NullCache", "KernelCache"], done.stderr


def test_large_kernels_are_not_compiled_into_their_callers(tmp_path, monkeypatch):
    """A kernel keeps a function of its own also where a function that is inlined is the first to call it."""
    (tmp_path / "nested.py").write_text(
        "from modalprep.compiler.jit import compile_inline, compile_kernel\n"
        "@compile_kernel\ndef total(x):\n    return x[0] + x[1]\n"
        "@compile_inline\ndef twice(x):\n    return 2.0 * total(x)\n"
        "@compile_kernel\ndef caller(x):\n    return twice(x)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    nested = importlib.import_module("nested")
    assert nested.caller(np.ones(2)) == 4.0
    (code,) = nested.total.dispatcher.inspect_llvm().values()
    assert "define" in code
    assert "alwaysinline" not in code


def test_warmup_runs_every_compiled_kind(capsys, monkeypatch):
    """With and without modes, with and without loops; in the reduced size the calls of one, as others make the rest."""
    named = exercise.jobs()
    assert set(named) == {"elements", *small_systems()}
    monkeypatch.setattr(exercise, "jobs", lambda: named if FULL else {"rigid bodies in trees": None})
    assert main(["warmup"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "the solver is compiled"
    kinds = {(s.bodies["rod"].n > 0, bool(s.closures)) for s in small_systems().values()}
    assert kinds == {(modes, loops) for modes in (False, True) for loops in (False, True)}


def test_constants_of_callers_do_not_compile_a_kernel_again(tmp_path, monkeypatch):
    """Numba compiles for each constant, as `compile_kernel` does, whose code need not look at them."""
    (tmp_path / "constants.py").write_text(
        "from modalprep.compiler.jit import compile_kernel, compile_once\n"
        "def power(x, square):\n    return x * x if square else x\n"
        "once, each = compile_once(power), compile_kernel(power)\n"
        "@compile_kernel\ndef of_once(x):\n    return once(x, True) + 10.0 * once(x, square=False)\n"
        "@compile_kernel\ndef of_each(x):\n    return each(x, True) + 10.0 * each(x, square=False)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    constants = importlib.import_module("constants")
    assert constants.of_once(3.0) == constants.of_each(3.0) == 39.0
    assert [len(kernel.dispatcher.overloads) for kernel in (constants.once, constants.each)] == [1, 2]


def test_first_simulation_needs_one_evaluation_of_the_equations():
    """Explicit and implicit steps, output and choice of the method share their kernels.

    Those that an implicit step lets add to the hinges' inertias are compiled twice: `evaluate` has nothing to add.
    """
    code = (
        "import modalprep as mp\n"
        "from modalprep.examples import small_systems\n"
        "from modalprep.compiler.stamps import KERNELS\n"
        "mp.simulate(small_systems()['rigid bodies in trees'], t_end=0.01)\n"
        "print(*(f'{key[1]}:{len(k.dispatcher.overloads)}' for key, k in KERNELS.items() if k.dispatcher.overloads))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    found = dict(part.split(":") for part in done.stdout.split())
    assert found["evaluate"] == found["solve_implicit"] == found["set_weights"] == "1", done.stderr
    twice = {"inward", "_factor", "_left_of_free", "scatter_rows"}
    assert {name for name, count in found.items() if count != "1"} <= twice  # of small ones their callers hold copies
    assert max(found.values()) == "2"


@pytest.mark.parametrize("function", [lambda x: x + 1, lambda x: x.missing])
def test_compilation_leaves_the_collector_and_the_clocks_of_numba_as_they_were(function):
    """Also when it fails."""
    kernel = jit.compile_kernel(function)
    lock = llvm.ffi.lib._lock
    before = gc.get_threshold(), list(lock._cblist)
    with contextlib.suppress(numba.TypingError):
        kernel(1.0)
    assert before == (gc.get_threshold(), lock._cblist)
    assert before[1]


def test_expressions_of_whole_arrays_and_nested_functions_are_compiled():
    """They need the passes of numba that other kernels do without."""

    @jit.compile_allocating
    def norm(x, y):
        scaled = [2.0 * k for k in x]
        total = x + y * y
        return sum(scaled) + total.sum()

    assert norm(np.ones(3), 2.0 * np.ones(3)) == 21.0


def test_no_machine_code_is_made_of_functions_that_are_copied(tmp_path, monkeypatch):
    (tmp_path / "copied.py").write_text(
        "from modalprep.compiler.jit import compile_inline, compile_kernel\n"
        "@compile_inline\ndef twice(x):\n    return 2.0 * x\n"
        "@compile_kernel\ndef caller(x):\n    return twice(x)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    copied = importlib.import_module("copied")
    assert copied.caller(2.0) == 4.0
    made = {}
    for kernel in (copied.twice, copied.caller):
        (result,) = kernel.dispatcher.overloads.values()
        made[kernel.__name__] = result.library.get_pointer_to_function(result.fndesc.llvm_func_name) != 0
    assert made == {"twice": False, "caller": True}
