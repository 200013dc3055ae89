"""The same results on every processor: bit for bit on one, to the stated accuracy by the kernels of others."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from size import some

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.linalg.onemkl import library

TESTS = Path(__file__).parent.parent
SECTION = {"A": 1e-4, "Iy": 1e-9, "Iz": 1e-9, "J": 2e-9}  # round: every frequency of bending comes twice
REDUCTIONS = {"fixed": mp.craig_bampton, "free": mp.reduction.free_interface}
CALLS = 6


def beam():
    steel = mp.Material(E=2e11, nu=0.3, rho=7800.0)
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    return mp.assemble(beam_mesh(100, 10.0), {"beam": mp.Beam(material=steel, **SECTION)}, ends)


def repeated(reduce, model, solver="auto"):
    """Reductions of one model between which memory is used at random, so that arrays lie elsewhere."""
    rng, between = np.random.default_rng(0), []
    for _ in range(CALLS):
        yield reduce(model, modes=8, solver=solver)
        between.append(np.empty(rng.integers(1, 20_000), dtype=np.int8))


def processes():
    """Environments and solvers: kernels of older processors and of this one."""
    cores = ["Prescott", "Nehalem", "Haswell"] + ["SkylakeX"] * has_avx512()
    found = [("OPENBLAS_CORETYPE", core, "superlu") for core in cores]
    if library():
        found += [("MKL_CBWR", branch, "in_memory") for branch in ("COMPATIBLE", "AVX2", "AUTO")]
    return found


def has_avx512():
    flags = Path("/proc/cpuinfo")
    return flags.exists() and " avx512f " in flags.read_text()


@pytest.mark.parametrize("solver", ["auto", "superlu"])
@pytest.mark.parametrize("reduce", REDUCTIONS.values(), ids=REDUCTIONS)
def test_reductions_in_one_process_are_the_same_to_the_last_bit(reduce, solver):
    first, *others = repeated(reduce, beam(), solver)
    for other in others:
        for name in ("basis", "frequency", "static", "inertial"):
            assert np.array_equal(getattr(other, name), getattr(first, name)), name


@pytest.mark.skipif(library() is None, reason="oneMKL is not installed")
@pytest.mark.parametrize(("asked", "mode"), [(None, 2), ("COMPATIBLE", 3)])
def test_reproducible_sums_are_asked_of_the_library_unless_the_user_asks_otherwise(asked, mode):
    """The numbers are oneMKL's MKL_CBWR_AUTO and MKL_CBWR_COMPATIBLE; 1, no reproducibility, is its default."""
    code = "from modalprep.linalg.onemkl import library\nprint(library().MKL_CBWR_Get(-1))"
    assert int(by_process(code, **({} if asked is None else {"MKL_CBWR": asked}))) == mode


COMPUTE = """
import sys, numpy as np
from linalg.test_processors import REDUCTIONS, beam, left_by_plate
found = {"left": left_by_plate(sys.argv[2])}
for name, reduce in REDUCTIONS.items():
    reduction = reduce(beam(), modes=8, solver=sys.argv[2])
    found |= {f"{name}.basis": reduction.basis, f"{name}.frequency": reduction.frequency}
np.savez(sys.argv[1], **found)
"""


def by_process(code, *arguments, **environment):
    clean = {name: value for name, value in os.environ.items() if name not in ("MKL_CBWR", "OPENBLAS_CORETYPE")}
    clean["PYTHONPATH"] = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], env=clean | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def left_by_plate(solver):
    """What a thin shell leaves of a static solution and of its lowest mode, over ``eps |K| |x|``."""
    from fe.elements.shells.test_curved_shells import supported_plate
    from structured import submatrix

    from modalprep.linalg.factor import factorise
    from modalprep.linalg.modes import lowest_modes

    model, keep = supported_plate("quad8", 8, "S", distort=0.2)
    K, M = (submatrix(A, keep) for A in (model.K, model.M))
    factor, scale, load = factorise(K, solver), 1 / np.sqrt(K.diagonal())[:, None], np.ones((K.shape[0], 1))
    w2, phi, _ = lowest_modes(K, M, 1, factor=factor)
    x = np.hstack([factor.solve(load), phi])
    left, size = scale * (K @ x - np.hstack([load, w2 * (M @ phi)])), scale * (abs(K) @ abs(x))
    return np.linalg.norm(left, axis=0) / np.linalg.norm(size, axis=0) / np.finfo(float).eps


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the kernels have other names here")
def test_kernels_of_other_processors_agree(tmp_path):
    """Residuals are round-off by all of them, and bases agree, those of repeated roots included.

    Frequencies may differ by what one unit in the last place of K changes: 4e-8 of w^2 in this slender beam. Shapes
    agree to the eigensolver's tolerance of 1e-10 over the distance of the roots, some hundredths.
    """
    results = []
    for variable, value, solver in some(processes(), 3):
        file = tmp_path / f"{value}.npz"
        by_process(COMPUTE, str(file), solver, **{variable: value})
        results.append(np.load(file))
    for result in results:
        assert np.all(result["left"] < 20)
        for name in REDUCTIONS:
            basis, frequency = (results[0][f"{name}.{part}"] for part in ("basis", "frequency"))
            np.testing.assert_allclose(result[f"{name}.frequency"], frequency, rtol=2e-8)
            assert np.abs(result[f"{name}.basis"] - basis).max() < 1e-7 * np.abs(basis).max()
