"""One way to compile kernels: from the library of the package, or by numba, when they are called for the first time."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property, lru_cache, partial, update_wrapper
from importlib import util
from inspect import signature
from typing import Any
from warnings import warn

from modalprep.compiler import kept
from modalprep.compiler.by_address import Addressed, layout, written
from modalprep.compiler.library import entry_of, loaded
from modalprep.compiler.stamps import KERNELS, LISTENERS, Stamped, key_of, stamp_of
from modalprep.compiler.switch import fast
from modalprep.errors import ModalprepWarning
from modalprep.extras import need

DISABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")  # kernels are plain Python
SLOW = (
    "{}: the library of compiled functions has no code for these arguments, and numba is missing; it runs as Python, "
    "some hundred times as long (pip install 'modalprep[build]')"
)


class Kernel(Stamped):
    """A function that is called compiled; compiled callers take it as numba's `dispatcher`."""

    def __init__(self, function: Callable, **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self.inline = options.pop("inline", False)
        self.allocating = options.pop("allocating", False)
        self.once = options.pop("once", False)
        self.options = options
        self.entries: dict[tuple[Any, ...], Callable] = {}  # by layouts of arguments: as Python calls them
        self.bound_entries: dict[tuple[Any, ...], Callable] = {}
        if not self.inline:
            KERNELS[key_of(function)] = self

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Return what the function returns."""
        if named:
            args = signature(self.py_func).bind(*args, **named).args
        key = tuple(map(layout, args))
        if key not in self.entries:
            self.entries[key] = self.entry(args) or (self._made(args) if has_numba() else self._in_python())
        return self.entries[key](*args)

    def entry(self, first: Sequence[Any], rest: Sequence[type] = ()) -> Callable | None:
        """Return the function of the library for arguments, and numbers of some types; None if it has none."""
        return entry_of(self, [*map(written, first), *(written(kind(0)) for kind in rest)])

    def _made(self, args: Sequence[Any]) -> Callable:
        """Return the function that numba makes for arguments: without its dispatcher, which asks for types again."""
        return _compiled(self, args, ()) if fast() else self.dispatcher

    def _in_python(self) -> Callable:
        if loaded() is None:
            need("numba", "this installation, which brings no library of compiled functions for this machine,")
        if not self.inline:
            warn(SLOW.format(self.py_func.__name__), ModalprepWarning, stacklevel=3)
        return self.py_func

    @cached_property
    def dispatcher(self) -> Any:
        """Numba's."""
        from modalprep.compiler.dispatch_code import dispatcher_of

        if kept.WANTED and fast():
            kept.keep_code()
        return dispatcher_of(self)

    @property
    def _numba_type_(self) -> Any:
        return self.dispatcher._numba_type_

    def __reduce__(self) -> str | tuple[Any, ...]:
        """Kernels are found by their names, those without one made anew."""
        name = self.py_func.__qualname__
        return (Kernel, (self.py_func,)) if "<" in name else name


@lru_cache
def has_numba() -> bool:
    """Return whether numba is installed."""
    return util.find_spec("numba") is not None


def compile_kernel(function: Callable, **options: Any) -> Any:
    """Return the function compiled; the library of the package serves it, or numba when it is called.

    Compiled code is used only while the function's file and the kernels and constants that the file imports are as they
    were (numba alone looks at the function's own file). Without a writable cache it compiles in every process.
    """
    stamp_of(function)
    return function if DISABLED else Kernel(function, **options)


def compile_allocating(function: Callable) -> Any:
    """Return `compile_kernel` of a function that makes arrays of its own, or assigns one to a slice of another."""
    return compile_kernel(function, allocating=True)


def compile_once(function: Callable) -> Any:
    """Return `compile_kernel` of a function that takes the constants of its callers, such as True, as it takes numbers.

    Numba compiles a function anew for each constant that a compiled caller gives.
    """
    return compile_kernel(function, once=True)


def compile_inline(function: Callable, **options: Any) -> Any:
    """Return the function compiled into each of its callers: small algebra on tuples that stay in registers."""
    return compile_kernel(function, inline=True, **options)


def compile_for(kernel: Any, *arguments: Any) -> None:
    """Have a kernel's code for the types of some arguments: of the library, of a cache, or compiled now.

    Examples
    --------
    >>> double = compile_kernel(lambda x: 2 * x)
    >>> compile_for(double, 1.5)
    >>> len(double.dispatcher.overloads)
    1
    """
    if isinstance(kernel, Kernel) and kernel.entry(arguments) is None and has_numba():
        from numba import typeof

        kernel.dispatcher.compile(tuple(map(typeof, arguments)))


def is_cached(kernel: Any) -> bool:
    """Return whether the compiled code of a kernel is kept between processes.

    Examples
    --------
    >>> is_cached(lambda x: 2 * x)
    False
    """
    return isinstance(kernel, Kernel) and fast() and kernel.dispatcher._cache.cache_path is not None


def bound(kernel: Any, *first: Any, rest: Sequence[type] = ()) -> Callable:
    """Return the call of a kernel with its first arguments, whose types are looked at here and not at every call.

    To look at all arguments of a call, and find the code for their types, takes several microseconds; the call that is
    returned takes a tenth of one.

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
    if not isinstance(kernel, Kernel):
        return partial(kernel, *first)
    key = *map(layout, first), *rest
    if key not in kernel.bound_entries:
        found = kernel.entry(first, rest)
        if found is None and not (has_numba() and fast()):
            return partial(kernel, *first)
        kernel.bound_entries[key] = found or _compiled(kernel, first, rest)
    call = partial(kernel.bound_entries[key], *(x._address if isinstance(x, Addressed) else x for x in first))
    vars(call)["first"] = first  # lives as long as the call
    return call


def _compiled(kernel: Kernel, first: Sequence[Any], rest: Sequence[type]) -> Callable:
    from numba import typeof

    from modalprep.compiler.dispatch_code import NUMBERS

    return kernel.dispatcher.compile((*map(typeof, first), *(NUMBERS[kind] for kind in rest)))


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
    told = []

    def listen(module: str) -> None:
        if not told and module.startswith(package):
            told.append(module)
            tell()

    LISTENERS.append(listen)
    try:
        yield
    finally:
        LISTENERS.remove(listen)
