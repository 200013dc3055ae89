"""Threads that evaluate elements ahead of their sum, and NumPy's own that rest meanwhile."""

import os
import subprocess
import sys
import time
from pathlib import Path
from threading import Barrier, Event, Thread, current_thread

import pytest
from threadpoolctl import OpenBLASController, ThreadpoolController

from modalprep.fe.elements import kernels
from modalprep.fe.elements.kernels import ahead
from modalprep.linalg.blas import one_numpy_thread

LONG = 60  # s, after which a thread counts as stuck


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_the_order_of_their_items(monkeypatch, threads):
    monkeypatch.setattr(kernels, "THREADS", threads)

    def squared(k: int) -> int:
        time.sleep(0.001 * (k % 3))
        return k * k

    assert list(ahead(squared, range(20))) == [k * k for k in range(20)]


def test_the_calling_thread_evaluates_what_no_other_has_begun(monkeypatch):
    """The only other thread waits in the first item for the second one, which nobody else can evaluate."""
    monkeypatch.setattr(kernels, "THREADS", 2)
    begun, done, evaluated_by = Event(), Event(), {}

    def evaluate(k: int) -> int:
        evaluated_by[k] = current_thread()
        if k == 0 and current_thread() is not here:
            begun.set()
            assert done.wait(LONG), "the calling thread waited"
        elif k == 0:
            pytest.skip("the other thread came too late for this test")
        elif k == 1:
            assert begun.wait(LONG)
            done.set()
        return k

    here = current_thread()
    assert list(ahead(evaluate, range(4))) == [0, 1, 2, 3]
    assert evaluated_by[1] is here


def test_the_error_of_the_first_item_is_raised_whichever_thread_meets_it(monkeypatch):
    monkeypatch.setattr(kernels, "THREADS", 3)

    def fail(k: int) -> None:
        time.sleep(0.02 * (k == 1))
        if k:
            raise ValueError(f"item {k}")

    for _ in range(5):
        with pytest.raises(ValueError, match="item 1"):
            list(ahead(fail, range(6)))
    assert not hasattr(kernels._thread, "works_alone")  # the thread shares its loops again


def test_numpy_has_its_threads_back_after_callers_that_overlap():
    """The first of two callers leaves before the second; the limit holds until then, and no longer."""
    libraries = ThreadpoolController().select(internal_api="openblas")
    if not libraries.lib_controllers:
        pytest.skip("NumPy has no OpenBLAS here")
    first_in, second_in, first_out = Barrier(2, timeout=LONG), Barrier(2, timeout=LONG), Barrier(2, timeout=LONG)

    def numbers() -> set[int]:
        return {library.num_threads for library in libraries.lib_controllers}

    def first() -> None:
        with one_numpy_thread():
            first_in.wait()
            second_in.wait()
        first_out.wait()

    with libraries.limit(limits=2):
        OpenBLASController.clear_controlling_thread()  # or nobody else could change it
        Thread(target=first).start()
        first_in.wait()
        with one_numpy_thread(beside_mkl=False):
            second_in.wait()
            first_out.wait()
            assert numbers() == {1}
        assert numbers() == {2}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_forked_process_assembles_too():
    """The child has none of the threads that its parent's assembly has started."""
    code = """
import os
from structured import box, solid_model
import modalprep as mp
steel = mp.Solid(material=mp.Material(E=2.1e11, nu=0.3, rho=7800.0))
mesh = box("hexahedron", (20, 20, 20))
mass = solid_model(*mesh, "hexahedron", steel).rigid.m
child = os.fork()
if not child:
    os._exit(0 if solid_model(*mesh, "hexahedron", steel).rigid.m == mass else 1)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    options = {"cwd": Path(__file__).parents[2], "timeout": LONG, "check": True, "capture_output": True, "text": True}
    done = subprocess.run([sys.executable, "-c", code], **options)
    assert done.stdout.split() == ["0"], done.stderr
