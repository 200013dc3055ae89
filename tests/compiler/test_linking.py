"""Records by their address, and kernels that refer to each other by name: in one process and from the cache."""

import copy
import pickle
from typing import NamedTuple

import numpy as np
import pytest
from fresh_process import printed

from modalprep.compiler.by_address import Pattern, by_address
from modalprep.compiler.jit import bound, compile_kernel

ROW = np.dtype([("number", np.int64), ("place", np.float64, 3)])


@by_address
class Inner(NamedTuple):
    vector: np.ndarray
    missing: None


@by_address
class Outer(NamedTuple):
    inner: Inner
    factor: float
    count: int
    matrix: np.ndarray
    rows: np.ndarray


@compile_kernel
def read(outer, out):
    """Read each kind of field, and write an array."""
    out[0], out[1] = outer.factor, outer.count
    out[2] = outer.inner.vector[1] + (1.0 if outer.inner.missing is None else 0.0)
    out[3] = outer.matrix[1, 2]
    out[4], out[5] = outer.rows[1].number, outer.rows[1].place[2]
    out[6], out[7] = len(outer.matrix), outer.matrix.shape[1]
    outer.inner.vector[0] = -1.0


def outer(matrix):
    rows = np.zeros(2, ROW).view(np.recarray)
    rows.number, rows.place = [3, 4], [[0, 1, 2], [3, 4, 5]]
    return Outer(Inner(np.array([7.0, 8.0]), None), 0.5, 6, matrix, rows)


@pytest.mark.parametrize(
    "matrix",
    [np.arange(6.0).reshape(2, 3), np.asfortranarray(np.arange(6.0).reshape(2, 3)), np.arange(24.0)[::4].reshape(2, 3)],
)
def test_kernels_read_all_fields_of_a_record(matrix):
    given, found = outer(matrix), np.zeros(8)
    read(given, found)
    np.testing.assert_array_equal(found, [0.5, 6, 9.0, matrix[1, 2], 4, 5.0, 2, 3])
    assert given.inner.vector[0] == -1.0


@pytest.mark.parametrize("remake", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_copies_have_their_own_block(remake):
    """A block that was copied with the arrays would point to those of the original."""
    given, found = outer(np.zeros((2, 3))), np.zeros(8)
    read(given, found)
    other = remake(given)
    other.matrix[1, 2] = 11.0
    read(other, found)
    assert found[3] == 11.0
    read(given._replace(factor=2.5), found)
    assert found[0] == 2.5


def test_copies_of_a_pattern_are_records_of_their_own():
    """Kernels read copies as they read the record; what is written to one is not in the others."""
    given, found = outer(np.arange(6.0).reshape(2, 3)), np.zeros((3, 8))
    inner = Pattern(given.inner)
    pattern = Pattern(given)
    copies = [pattern.copy(inner=inner.copy()) for _ in range(2)]
    copies[0].matrix[1, 2], copies[0].rows[1].number = 11.0, 9
    for record, out in zip((*copies, given), found, strict=True):
        read(record, out)
    np.testing.assert_array_equal(found[0], [0.5, 6, 9.0, 11.0, 9, 5.0, 2, 3])
    np.testing.assert_array_equal(found[1:], [[0.5, 6, 9.0, 5.0, 4, 5.0, 2, 3]] * 2)
    assert all(record.inner.vector[0] == -1.0 for record in (*copies, given))


def test_copies_of_a_pattern_begin_lines_of_the_cache():
    """Wherever their memory is, so that no vector of four numbers lies in two lines of 64 bytes."""
    pattern = Pattern(outer(np.zeros((2, 3))))
    copies = [pattern.copy() for _ in range(20)]
    assert {copy.matrix.ctypes.data % 64 for copy in copies} == {0}


def test_copies_of_a_pattern_take_arrays_of_other_sizes_but_not_of_other_kinds():
    found, matrix = np.zeros(8), np.arange(12.0).reshape(3, 4)
    pattern = Pattern(outer(np.zeros((2, 3))), ("matrix",))
    read(pattern.copy(matrix=matrix), found)
    assert found[3] == matrix[1, 2]
    np.testing.assert_array_equal(found[6:], [3, 4])
    for other in (matrix.astype(int), np.asfortranarray(matrix), matrix[0]):
        with pytest.raises(TypeError, match="Outer.matrix has another layout"):
            pattern.copy(matrix=other)


def test_arrays_of_a_record_cannot_be_exchanged():
    """Kernels keep the address of the first."""
    with pytest.raises(AttributeError, match="Outer.matrix cannot be exchanged"):
        outer(np.zeros((2, 3))).matrix = np.zeros((2, 3))


def test_calls_with_bound_arguments_see_what_these_hold_now():
    """The call alone keeps the record and its arrays."""
    found = np.zeros(8)
    call = bound(read, outer(np.zeros((2, 3))), found)
    call()
    assert found[3] == 0.0
    call.first[0].matrix[1, 2] = 4.0
    call()
    assert found[3] == 4.0


def test_functions_of_one_name_keep_their_own_code():
    double, triple = compile_kernel(lambda x: 2.0 * x), compile_kernel(lambda x: 3.0 * x)
    both = [compile_kernel(lambda x: double(x) + 1.0), compile_kernel(lambda x: triple(x) + 1.0)]
    assert [f(1.0) for f in both] == [3.0, 4.0]


LARGE = (
    "from modalprep.compiler.jit import compile_kernel\n@compile_kernel\ndef large(row, out):\n    x = row[0].x\n"
    + "".join(f"    for i in range(len(out)):\n        out[i] += x ** {k}\n" for k in range(2, 12))
)
CALLER = """
from modalprep.compiler.jit import compile_kernel
from large import large

@compile_kernel
def small(row, out):
    large(row, out)

@compile_kernel
def caller(row, out):
    small(row, out)
    return out[0]
"""
RUN = """
import sys
import numba, numpy as np, caller, large
for k in range(int(sys.argv[1])):
    numba.typeof(np.zeros(1, [(f"of_another_{k}", float)]))
row = np.full(1, 2.0, [("x", float)]).view(np.recarray)
value = caller.caller(row, np.zeros(3))
print(value, *(sum(f.dispatcher.stats.cache_hits.values()) for f in (caller.caller, large.large)))
result = next(iter(caller.caller.dispatcher.overloads.values()))
names = [f.name for f in result.library._final_module.functions if "large" in f.name and not f.is_declaration]
print(len([name for name in names if "cpython" not in name]))
"""


@pytest.fixture
def run(tmp_path):
    """Run a process that calls `caller`: its result, hits in the cache of both kernels, copies of the large one."""
    (tmp_path / "large.py").write_text(LARGE)
    (tmp_path / "caller.py").write_text(CALLER)

    def run(other_records=0):
        return printed(RUN, tmp_path, str(other_records), NUMBA_CACHE_DIR=str(tmp_path / "cache")).split()

    return run


POWERS = float(sum(2**k for k in range(2, 12)))


def test_cached_code_finds_the_kernels_that_it_calls(run, tmp_path):
    """They are not copied into it, so they are loaded, or compiled again where their file is gone.

    Compiled again, they have another name: Numba numbers types of records in the order in which a process meets them.
    """
    assert run() == [str(POWERS), "0", "0", "0"]
    assert run() == [str(POWERS), "1", "1", "0"]
    (file,) = (tmp_path / "cache").rglob("large.large*.nbc")
    file.unlink()
    assert run(other_records=3) == [str(POWERS), "1", "0", "0"]
    assert run() == [str(POWERS), "1", "1", "0"]


def test_code_copied_from_the_cache_keeps_the_names_that_it_knows(run, tmp_path):
    """The cached code of `small` calls `large` by its first name, and so does `caller`, into which it is copied."""
    run()
    for name in ("large.large*.nbc", "caller.caller*.nbc"):
        (file,) = (tmp_path / "cache").rglob(name)
        file.unlink()
    assert run(other_records=3) == [str(POWERS), "0", "0", "0"]
    assert run(other_records=1) == [str(POWERS), "1", "1", "0"]


def test_another_version_of_a_kernel_that_is_called(run, tmp_path):
    run()
    (tmp_path / "large.py").write_text(LARGE.replace("+=", "-="))
    assert run() == [str(-POWERS), "0", "0", "0"]


PRODUCT = """
from modalprep.compiler.jit import compile_allocating

@compile_allocating
def product(a, b):
    return (a @ b).sum()
"""
MULTIPLY = """
import sys
import numpy as np, product
print(product.product(np.ones((2, 2)), np.ones((2, 3))), "numba.np.arraymath" in sys.modules)
try:
    product.product(np.ones((2, 2)), np.ones((3, 3)))
except ValueError as error:
    print(error)
"""


def test_cached_code_is_loaded_without_the_modules_that_compiled_it(tmp_path):
    """Numba's functions that are copied into a kernel need nothing of their modules, even where they raise.

    To load these modules takes longer than the code of all kernels of a simulation.
    """
    (tmp_path / "product.py").write_text(PRODUCT)
    compiled, loaded = (printed(MULTIPLY, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache")) for _ in range(2))
    refused = "incompatible array sizes for np.dot(a, b) (matrix * matrix)\n"
    assert compiled == "12.0 True\n" + refused
    assert loaded == "12.0 False\n" + refused
