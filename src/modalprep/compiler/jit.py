"""One way to compile kernels: cached between runs, also where no cache folder can be written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from numba import njit, typeof, types
from numba.core import dispatcher, event

from modalprep.compiler import by_address
from modalprep.compiler.stamps import stamp_of
from modalprep.compiler.switch import FAST

# No flag that assumes finite numbers: a NaN must stay a NaN. Nobody takes kernels as C functions. Without
# `forceinline` here a kernel takes it from the function for which it is compiled first.
OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
    "error_model": "numpy",
    "nogil": True,
    "no_cfunc_wrapper": True,
    "forceinline": False,
}
INLINE: dict[str, Any] = {"no_cpython_wrapper": True, "forceinline": True}
# Without reference counts (_nrt) a kernel cannot make arrays, nor assign one to a slice of another (algebra.copy does).
ALLOCATING: dict[str, Any] = {}
Dispatcher: Any = dispatcher.Dispatcher  # whose private parts are used
if FAST:
    from modalprep.compiler import linking
    from modalprep.compiler.cache import KernelCache

    OPTIONS |= {"_nrt": False, "pipeline_class": linking.KernelCompiler}
    ALLOCATING = {"_nrt": True}

    def _keep(kernel: Any, function: Callable, stamp: str) -> None:
        """Keep the code of a kernel between processes, for itself and for the kernels that call it."""
        with suppress(RuntimeError):  # numba: "no locator available"
            kernel._cache = KernelCache(function, stamp)
        linking.register(kernel)
else:

    def _keep(kernel: Any, function: Callable, stamp: str) -> None:
        """Keep nothing."""


def compile_kernel(function: Callable, **options: Any) -> Any:
    """Return ``njit(cache=True)`` of the function; without a writable cache it compiles in every process.

    The cached code is used only while the function's file and the kernels and constants that the file imports are as
    they were (numba alone looks at the function's own file).
    """
    stamp = stamp_of(function)
    kernel = njit(**(OPTIONS | options))(function)
    if isinstance(kernel, Dispatcher):  # not without a compiler
        _keep(kernel, function, stamp)
    return kernel


def compile_allocating(function: Callable) -> Any:
    """Return `compile_kernel` of a function that makes arrays of its own."""
    return compile_kernel(function, **ALLOCATING)


def compile_once(function: Callable) -> Any:
    """Return `compile_kernel` of a function that takes the constants of its callers, such as True, as it takes numbers.

    Numba compiles a function anew for each constant that a compiled caller gives.
    """
    kernel = compile_kernel(function)
    if FAST and isinstance(kernel, Dispatcher):
        template = kernel.get_call_template
        kernel.get_call_template = lambda args, named: template(
            tuple(map(types.unliteral, args)), {name: types.unliteral(x) for name, x in named.items()}
        )
    return kernel


def compile_inline(function: Callable, **options: Any) -> Any:
    """Return the function compiled into each of its callers: small algebra on tuples that stay in registers."""
    stamp_of(function)
    return njit(**(OPTIONS | INLINE | options))(function)


def compile_for(kernel: Any, *arguments: Any) -> None:
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


def is_cached(kernel: Any) -> bool:
    """Return whether the compiled code of a kernel is kept between processes.

    Examples
    --------
    >>> is_cached(njit(lambda x: 2 * x))
    False
    """
    return FAST and isinstance(kernel, Dispatcher) and kernel._cache.cache_path is not None


NUMBERS = {int: types.int64, float: types.float64, bool: types.boolean}
ENTRIES: dict[tuple[Any, ...], Callable] = {}  # compiled functions as Python calls them, by kernel and types


def bound(kernel: Any, *first: Any, rest: Sequence[type] = ()) -> Callable:
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
    if not (FAST and isinstance(kernel, Dispatcher)):
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
    with event.install_listener("numba:compile", listener):
        yield


class _Compilation(event.Listener):
    def __init__(self, tell: Callable[[], None], package: str | tuple[str, ...]) -> None:
        self.tell, self.package, self.told = tell, package, False

    def on_start(self, event: Any) -> None:
        if not self.told and event.data["dispatcher"].py_func.__module__.startswith(self.package):
            self.told = True
            self.tell()

    def on_end(self, event: Any) -> None:
        pass
