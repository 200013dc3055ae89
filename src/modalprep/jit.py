"""One way to compile kernels: cached between runs, also where no cache folder can be written."""

from __future__ import annotations

import hashlib
import pickle
import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from pathlib import Path
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
from numba import core, njit, typeof, types
from numba.core.runtime.nrt import rtsys

from modalprep import by_address, linking
from modalprep.linking import STAMP, KernelCompiler, LinkedCode

# No flag that assumes finite numbers: a NaN must stay a NaN. Without reference counts (_nrt) a kernel cannot make
# arrays, nor assign one to a slice of another (algebra.copy does). Nobody takes kernels as C functions. Without
# `forceinline` here a kernel takes it from the function for which it is compiled first.
OPTIONS = {
    "fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy", "nogil": True, "_nrt": False,
    "no_cfunc_wrapper": True, "forceinline": False, "pipeline_class": KernelCompiler,
}  # fmt: skip

DIGEST = hashlib.sha256().digest_size
NO_KERNELS = ("math", "numpy", "scipy")  # modules
NUMERIC = (int, float)  # also bool, and numpy's float64
Dispatcher = core.dispatcher.Dispatcher

# A wheel may bring kernels compiled for all processors from Haswell and Zen on (.ci/build-wheel), which would take up
# to a minute here. Those of an older numba, Python or source are not used: the files say what they hold.
COMPILED = Path(__file__).with_name("compiled")
BASELINE = "x86-64-v3"
BASELINE_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave")


def compile_kernel(function: Callable, **options: Any) -> Callable:
    """Return ``njit(cache=True)`` of the function; without a writable cache it compiles in every process.

    The cached code is used only while the function's file and the kernels and constants that the file imports are as
    they were (numba alone looks at the function's own file).
    """
    stamp = _stamp(function)
    kernel = njit(**(OPTIONS | options))(function)
    if isinstance(kernel, Dispatcher):  # not without a compiler
        with suppress(RuntimeError):  # numba: "no locator available"
            kernel._cache = KernelCache(function, stamp)
        linking.register(kernel)
    return kernel


def compile_allocating(function: Callable) -> Callable:
    """Return `compile_kernel` of a function that makes arrays of its own."""
    return compile_kernel(function, _nrt=True)


def compile_once(function: Callable) -> Callable:
    """Return `compile_kernel` of a function that takes the constants of its callers, such as True, as it takes numbers.

    Numba compiles a function anew for each constant that a compiled caller gives.
    """
    kernel = compile_kernel(function)
    if isinstance(kernel, Dispatcher):
        template = kernel.get_call_template
        kernel.get_call_template = lambda args, named: template(
            tuple(map(types.unliteral, args)), {name: types.unliteral(x) for name, x in named.items()}
        )
    return kernel


def compile_inline(function: Callable, **options: Any) -> Callable:
    """Return the function compiled into each of its callers: small algebra on tuples that stay in registers."""
    _stamp(function)
    return njit(no_cpython_wrapper=True, **(OPTIONS | {"forceinline": True} | options))(function)


def compile_for(kernel: Callable, *arguments: Any) -> None:
    """Compile a kernel for the types of some arguments, unless a cache has it.

    Examples
    --------
    >>> double = compile_kernel(lambda x: 2 * x)
    >>> compile_for(double, 1.5)
    >>> len(double.overloads)
    1
    """
    if isinstance(kernel, Dispatcher):
        kernel.compile(tuple(map(typeof, arguments)))


def is_cached(kernel: Callable) -> bool:
    """Return whether the compiled code of a kernel is kept between processes.

    Examples
    --------
    >>> is_cached(njit(lambda x: 2 * x))
    False
    """
    return isinstance(kernel, Dispatcher) and kernel._cache.cache_path is not None


NUMBERS = {int: types.int64, float: types.float64, bool: types.boolean}
ENTRIES: dict[tuple, Callable] = {}  # compiled functions as Python calls them, by kernel and types of arguments


def bound(kernel: Callable, *first: Any, rest: Sequence[type] = ()) -> Callable:
    """Return the call of a kernel with its first arguments, whose types are looked at here and not at every call.

    Numba looks at all arguments of a call to find the code for their types, which takes several microseconds; the call
    that is returned takes a tenth of one.

    Parameters
    ----------
    first : records and arrays
        Their numbers may change, not they.
    rest : sequence of type
        int, float or bool of the arguments that are given at every call.

    Examples
    --------
    >>> import numpy as np
    >>> add = compile_kernel(lambda row, k, x: row[k] + x)
    >>> call = bound(add, np.array([1.0, 3.0]), rest=(int, float))
    >>> call(1, 0.5)
    3.5
    """
    if not isinstance(kernel, Dispatcher):
        return partial(kernel, *first)
    key = kernel, *map(by_address.layout, first), *rest
    if key not in ENTRIES:
        ENTRIES[key] = kernel.compile((*map(typeof, first), *(NUMBERS[kind] for kind in rest)))
    call = partial(ENTRIES[key], *(x._address if isinstance(x, by_address.Addressed) else x for x in first))
    vars(call)["first"] = first  # lives as long as the call
    return call


@contextmanager
def when_compiling(tell: Callable[[], None], package: str | tuple[str, ...]) -> Iterator[None]:
    """Call `tell` once, when the first kernel of a package, or one of several, is compiled that no cache has.

    Examples
    --------
    >>> said = []
    >>> with when_compiling(lambda: said.append("compiling"), __name__):
    ...     compile_kernel(lambda x: x + 1)(1.0)
    2.0
    >>> said
    ['compiling']
    """
    listener = _Compilation(tell, package)
    with core.event.install_listener("numba:compile", listener):
        yield


class _Compilation(core.event.Listener):
    def __init__(self, tell: Callable[[], None], package: str | tuple[str, ...]) -> None:
        self.tell, self.package, self.told = tell, package, False

    def on_start(self, event: core.event.Event) -> None:
        if not self.told and event.data["dispatcher"].py_func.__module__.startswith(self.package):
            self.told = True
            self.tell()

    def on_end(self, event: core.event.Event) -> None:
        pass


class KernelCache(core.caching.FunctionCache):
    """Numba's cache of a function, which loads compiled code without the registries that only a compiler needs."""

    _impl_class = LinkedCode

    def __init__(self, function: Callable, stamp: str) -> None:
        super().__init__(function)
        self._cache_file = CompiledFiles(self._cache_file, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code of a signature, None if there is none."""
        rtsys.initialize(target_context)  # what kernels that make arrays call
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _index_key(self, sig: Any, codegen: Any) -> tuple:
        return super()._index_key(sig, _asked_once(codegen))


@lru_cache
def _asked_once(codegen: Any) -> SimpleNamespace:
    """Return what numba's key needs of a code generator, which looks at the processor at every call."""
    processor = codegen.magic_tuple()
    return SimpleNamespace(magic_tuple=lambda: processor)


class CompiledFiles(core.caching.IndexDataCacheFile):
    """One whole file for each compiled signature, which says itself what it holds.

    Numba keeps an index beside numbered files. After a kill between the two, or when two processes compile for
    different types at the same moment, a number may belong to other code: wrong results, or a crash. Numba lets a
    program choose the folder and the stamp of its files (NUMBA_CACHE_LOCATOR_CLASSES, for all functions of the
    process) but not how they are kept, so this takes the place of a private attribute: pyproject.toml bounds numba.

    A file begins with the digest of all that follows and of its stamp: damaged code, which would end the process, and
    that of other sources is never looked at.
    """

    def __init__(self, numbered: core.caching.IndexDataCacheFile, stamp: str) -> None:
        base = numbered._index_name.removesuffix(".nbi")
        super().__init__(numbered._cache_path, base, stamp)
        self._base = base

    def save(self, key: Any, data: Any) -> None:
        """Write the file of a signature; without room for it the next process compiles again."""
        content = self._dump((key, data))
        with suppress(OSError), self._open_for_write(self._data_path(self._name(key))) as file:
            file.write(self._digest(content))
            file.write(content)

    def load(self, key: Any) -> Any:
        """Return what was saved for a signature, here or in the installed package; None if there is nothing."""
        found = self._read(self._data_path(self._name(key)), key)
        if found is None and _runs_baseline():
            signature, (triple, _, _), function = key
            common = signature, (triple, BASELINE, ""), function
            found = self._read(COMPILED / self._name(common), common)
        return found

    def _read(self, path: str | Path, key: Any) -> Any:
        """Return the data of a file, None if there is none, of another version, or not as it was written."""
        with suppress(OSError, ImportError, AttributeError), open(path, "rb") as file:
            digest, content = file.read(DIGEST), file.read()
            if digest == self._digest(content):
                saved, data = pickle.loads(content)
                return data if saved == key else None
        return None

    def _digest(self, content: bytes) -> bytes:
        found = hashlib.sha256(repr((self._version, self._source_stamp)).encode())
        found.update(content)
        return found.digest()

    def flush(self) -> None:
        """Leave the files: they are written anew."""

    def _name(self, key: Any) -> str:
        return f"{self._base}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"


@lru_cache
def _runs_baseline() -> bool:
    """Whether this processor runs the code of the installed package, if there is any."""
    if not COMPILED.is_dir() or platform.machine() not in ("x86_64", "AMD64"):
        return False
    features = llvm.get_host_cpu_features()
    return all(features.get(name) for name in BASELINE_FEATURES)


def _stamp(function: Callable) -> str:
    """Fingerprint of all that the compiled code depends on; kept on the function for its callers."""
    parts = [_file(name) for name in (__file__, by_address.__file__, linking.__file__)]
    parts += _known(function)
    if code := getattr(function, "__code__", None):
        parts += [_file(code.co_filename), repr(_own(function, code))]
    stamp = hashlib.sha256("|".join(parts).encode()).hexdigest()
    if code:
        setattr(function, STAMP, stamp)
    return stamp


def _own(function: Callable, code: CodeType) -> list:
    """What tells functions of one name apart, as two lambdas in one line."""
    constants = [x for x in code.co_consts if not isinstance(x, CodeType)]
    return [code.co_firstlineno, code.co_code, constants, [cell.cell_contents for cell in function.__closure__ or ()]]


def _known(function: Callable) -> Iterator[str]:
    """Yield the fingerprints of all constants and compiled functions of the function's file so far, and of its modules.

    Not only those that it names: functions that stand below it in the file, which it may call, are not known yet, but
    all that they use of other files is imported.
    """
    for value in getattr(function, "__globals__", {}).values():
        if isinstance(value, ModuleType):
            yield from _fingerprints(value)
        elif stamp := _fingerprint(value):
            yield stamp
        elif _constant(value):
            yield repr(value)


@lru_cache
def _fingerprints(module: ModuleType) -> tuple[str, ...]:
    if module.__name__ in NO_KERNELS:
        return ()
    return tuple(stamp for value in vars(module).values() if (stamp := _fingerprint(value)))


def _fingerprint(value: Any) -> str | None:
    """Return the fingerprint of a compiled function, None of anything else."""
    compiled = value.py_func if isinstance(value, Dispatcher) else value
    return getattr(compiled, STAMP, None) if isinstance(compiled, FunctionType) else None


def _constant(value: Any) -> bool:
    """Whether compiled code takes a global in by its value: a number, or tuples of them."""
    return isinstance(value, NUMERIC) or (isinstance(value, tuple) and all(map(_constant, value)))


@lru_cache
def _file(name: str) -> str:
    path = Path(name)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else name
