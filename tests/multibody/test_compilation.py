"""The kernel as plain Python, and its compilation where no cache can be written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from modalprep import jit

TESTS = Path(__file__).parent.parent


def test_plain_python_gives_the_same_and_stays_in_bounds():
    code = (
        "from multibody.test_kernel import test_order_n_equals_dense_on_random_trees as test\n"
        "from modalprep.multibody import kernel\n"
        "assert not hasattr(kernel.accelerations, 'signatures')\n"
        "for seed in range(10): test(seed, 6)\n"
    )
    paths = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_no_writable_cache_is_no_error(monkeypatch):
    asked = []

    def njit(*, cache, **options):
        asked.append(cache)
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr(jit, "njit", njit)
    assert jit.compile_kernel(len) is len
    assert asked == [True, False]


@pytest.mark.parametrize("further_down", [False, True])
@pytest.mark.parametrize("change", ["return 3 * x", "return x * SCALE", "SCALE = 5"])
def test_cache_follows_helpers_and_constants_of_other_files(tmp_path, change, further_down):
    """The compiled caller is used again while its helper is the same, and compiled anew when that changes."""
    head = "from modalprep.jit import compile_inline, compile_kernel\n"
    helper = head + "SCALE = 4\n@compile_inline\ndef scaled(x):\n    return 2 * x\n"
    caller = [
        "@compile_kernel\ndef total(x):\n    return add(x)\n",
        "@compile_kernel\ndef add(x):\n    return scaled(x) + SCALE\n",
    ]
    caller = head + "from helper import SCALE, scaled\n" + "".join(caller if further_down else caller[::-1])
    run = "import caller; print(caller.total(1.0), sum(caller.total.stats.cache_hits.values()))"
    (tmp_path / "caller.py").write_text(caller)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": path}

    def result(text):
        (tmp_path / "helper.py").write_text(text)
        command = [sys.executable, "-B", "-c", run]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    old = "SCALE = 4" if change.startswith("SCALE") else "return 2 * x"
    expected = {"return 3 * x": "7.0 0", "return x * SCALE": "8.0 0", "SCALE = 5": "7.0 0"}[change]
    assert [result(helper), result(helper), result(helper.replace(old, change))] == ["6.0 0", "6.0 1", expected]


@pytest.mark.slow
def test_second_process_finds_the_compiled_kernel(tmp_path):
    """Loads and hits, no compilation: counted by numba itself."""
    code = (
        "import numpy as np, modalprep as mp\n"
        "from modalprep.examples import uniform_beam\n"
        "from modalprep.multibody import kernel\n"
        "hinge = mp.Joint(name='h', type='revolute', parent='ground', child='a')\n"
        "mp.simulate(mp.System(bodies={'a': uniform_beam(modes=1)}, joints=(hinge,)), t_end=0.01)\n"
        "stats = kernel.outward.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))\n"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    runs = [
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True) for _ in range(2)
    ]
    assert [run.stdout.strip() for run in runs] == ["0 1", "1 0"], runs[0].stderr + runs[1].stderr
