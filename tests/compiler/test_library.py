"""The library of compiled kernels: built from what jobs call, and used by processes without numba."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from size import FULL

from modalprep.compiler.targets import COLLECTED

pytest.importorskip("ziglang")

WINDOWS = ["kernels-v3.dll", "kernels-v1.dll"] if FULL else []  # zig compiles its C library for minutes, once
KERNELS = """
from typing import NamedTuple
import numpy as np
from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import bound, compile_allocating, compile_inline, compile_kernel

class Pair(NamedTuple):
    a: np.ndarray
    b: np.ndarray

@by_address
class Line(NamedTuple):
    slope: float
    points: np.ndarray

class Ends(NamedTuple):
    first: float
    last: float

@compile_inline
def square(x):
    return x * x

@compile_kernel
def total(line, k, x):
    return line.slope * line.points[k] + square(x)

@compile_kernel
def split(pair, i, up):
    return (pair.a[0, i], i + 1, up), pair.b[i]

@compile_kernel
def put(a, none, x):
    if none is None:
        a[1] = x

@compile_kernel
def ordered(a):
    return a[0] <= a[1]

@compile_kernel
def ends(a):
    return Ends(a[0], a[-1])

@compile_kernel
def between(a):
    own = ends(a)
    return own.last - own.first

@compile_allocating
def multiply(a, b, out):
    square = np.empty((len(a), len(a)))
    for k in range(len(a)):
        square[k] = 2.0 * a[k]
    np.dot(square, b.reshape(len(a), -1), out)

@compile_allocating
def refused(n):
    return len(np.zeros(n))

LINE = Line(2.0, np.array([1.5, 3.0]))

def refused_job():
    return refused(1)

def job():
    a, out = np.zeros(2), np.empty((2, 2))
    pair = Pair(np.array([[4.0, 5.0], [0.0, 0.0]]).T[:, ::-1], np.array([6, 7], dtype=np.int32).astype(np.int64))
    frozen = np.array([1.0, 0.0])
    frozen.flags.writeable = False
    put(a, None, 8.0)
    multiply(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([1.0, 0.0, 1.0, 1.0]), out)
    call = bound(total, LINE, rest=(int, float))
    return [total(LINE, 1, 3.0), call(0, np.float64(2.0)), call(np.int64(1), 1), split(pair, 1, True), a.tolist(),
            ordered(a), ordered(frozen), out.tolist(), refused(3), ends(a).last]
"""
RESULT = [15.0, 7.0, 7.0, ((4.0, 2, True), 7), [0.0, 8.0], True, False, [[6.0, 4.0], [14.0, 8.0]], 3, 8.0]
# 2 3 + 3^2, 2 1.5 + 2^2, 2 3 + 1; entries as written; 2 [[1, 2], [3, 4]] [[1, 0], [1, 1]]
BUILD = """
import sys
from pathlib import Path
import kernels
from modalprep.compiler.build import build

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    platforms = sys.argv[2:]
    print(*build([kernels.refused_job, kernels.job, kernels.job], dict.fromkeys(platforms, folder)))
"""
WITHOUT_NUMBA = """
import sys
sys.modules["numba"] = sys.modules["llvmlite"] = None
from pathlib import Path
from modalprep.compiler import library
library.FOLDER = Path(sys.argv[1])
import kernels
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Kernels of a module and their library, built by a process of its own, of what another one has compiled."""
    folder = tmp_path_factory.mktemp("library")
    (folder / "kernels.py").write_text(KERNELS)
    kept = {"MODALPREP_KEEP_CODE": "1", "NUMBA_CPU_NAME": COLLECTED, "NUMBA_CPU_FEATURES": ""}
    kept = environment(NUMBA_CACHE_DIR=str(folder / "cache"), **kept)
    code = "import kernels; kernels.job(); kernels.refused_job()"
    subprocess.run([sys.executable, "-c", code], cwd=folder, env=kept, check=True)
    before = {file: file.stat().st_mtime_ns for file in folder.rglob("*.nbc")}
    (folder / "build.py").write_text(BUILD)
    platforms = ["linux-x86_64", *["windows-x86_64"] * bool(WINDOWS), "macos-arm64"]
    done = subprocess.run([sys.executable, "build.py", str(folder), *platforms], cwd=folder, env=kept,
                          text=True, capture_output=True)  # fmt: skip
    assert before == {file: file.stat().st_mtime_ns for file in folder.rglob("*.nbc")}  # nothing was compiled anew
    assert len(before) >= 7
    assert done.returncode == 0, done.stderr
    assert [Path(name).name for name in done.stdout.split()] == [
        *("kernels-v4.so", "kernels-v3.so", "kernels-v1.so", *WINDOWS, "kernels-v1.dylib"),
    ]
    return folder


def environment(**changes):
    return os.environ | {"PYTHONPATH": os.environ.get("PYTHONPATH", "") + os.pathsep + "."} | changes


def printed(folder, code, **changes):
    """What code prints after the module is imported in a process without numba."""
    command = [sys.executable, "-c", WITHOUT_NUMBA + code, str(folder)]
    return subprocess.run(command, cwd=folder, env=environment(**changes), text=True, capture_output=True)


@pytest.mark.parametrize("level", ["v3", "v1"])
def test_functions_of_the_library_take_and_return_what_the_kernels_do(folder, level):
    """By LLVM's code for new processors and for all; numbers of NumPy are taken for those of Python."""
    can = f"library._flags = lambda: library.LEVELS[{level!r}]\n"
    done = printed(folder, f"{can}print(kernels.job() == {RESULT}, library.loaded()._name)")
    assert done.stderr == ""
    equal, path = done.stdout.split()
    assert equal == "True"
    assert path.endswith(f"kernels-{level}.so")


def test_refusals_of_kernels_are_errors(folder):
    """Numba's code refuses a negative size; a text is no number, also at a call with bound arguments."""
    done = printed(folder, "kernels.refused(-1)")
    assert done.stderr.endswith("ValueError: the compiled function refused refuses its arguments\n")
    done = printed(folder, "kernels.bound(kernels.total, kernels.LINE, rest=(int, float))(0, 'x')")
    assert done.stderr.splitlines()[-1] == "TypeError: must be real number, not str"


def test_code_of_another_source_is_not_used(folder, tmp_path):
    """A changed helper in the same file: its kernels run as Python, and say so once each."""
    (tmp_path / "kernels.py").write_text(KERNELS.replace("return x * x", "return x * x + 1.0"))
    code = f"library.FOLDER = Path({str(folder)!r})\nprint(kernels.total(kernels.LINE, 1, 3.0))"
    done = printed(tmp_path, code + "\nkernels.total(kernels.LINE, 0, 3.0)")
    assert done.stdout == "16.0\n"
    assert done.stderr.count("total: the library of compiled functions has no code for these arguments") == 1


def test_other_arguments_run_as_python_with_a_warning(folder):
    done = printed(folder, "print(kernels.ordered(kernels.np.array([1, 2])))")
    assert done.stdout == "True\n"
    assert "pip install 'modalprep[build]'" in done.stderr


def test_what_runs_as_python_takes_records_of_the_library(folder):
    done = printed(folder, "print(kernels.between(kernels.np.array([1.0, 4.0])), len(kernels.ends.entries))")
    assert done.stdout == "3.0 1\n", done.stderr
    assert done.stderr.count("between: the library of compiled functions has no code for these arguments") == 1


def test_without_library_and_numba_nothing_runs(tmp_path):
    (tmp_path / "kernels.py").write_text(KERNELS)
    done = printed(tmp_path, "kernels.job()")
    assert done.stderr.splitlines()[-1].endswith("needs numba: pip install 'modalprep[build]'")


def test_numba_serves_what_the_library_lacks(folder):
    """Where numba is installed: other types of arguments, and kernels that call those of the library."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom modalprep.compiler import library\n"
        f"library.FOLDER = Path({str(folder)!r})\n"
        "import kernels, numpy as np\n"
        "kernels.job()\nprint('numba' in sys.modules, end=' ')\n"
        "print(kernels.ordered(np.array([1, 2])), end=' ')\n"
        "double = kernels.compile_kernel(lambda a: 2.0 if kernels.ordered(a) else 1.0)\n"
        "print(double(np.zeros(2)), 'numba' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment(), text=True, capture_output=True)
    assert done.stdout == "False True 2.0 True\n", done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not WINDOWS, reason="minutes: zig compiles its C library for Windows")
def test_the_library_of_windows(folder, tmp_path):
    """In Wine, by a program in C: a kernel with an array, for both levels of processors."""
    wine = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
    if wine is None:
        pytest.skip("there is no Wine")
    program, source = tmp_path / "call.exe", Path(__file__).with_name("call_library.c")
    command = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-O1", "-o", program, source]
    subprocess.run(command, check=True)
    named = "import numpy as np\nfrom modalprep.compiler.by_address import written\n"
    symbol = printed(folder, f"{named}print(library.symbol_of(kernels.ordered, [written(np.zeros(2))]))").stdout.strip()
    for level in ("v1", "v3"):
        for given, said in (("1.5 2.5", "yes"), ("2.5 1.5", "no")):
            call = [wine, program, folder / f"kernels-{level}.dll", symbol, *given.split()]
            done = subprocess.run(call, capture_output=True, text=True)
            assert done.stdout.split() == [said], done.stderr
