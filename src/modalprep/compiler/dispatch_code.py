"""Kernels as numba compiles them: `Kernel.dispatcher`. What compiled code knows beside numba is imported here."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from numba import njit, types
from numba.core import event

from modalprep.compiler import address_code, callback_code, lane_code  # noqa: F401
from modalprep.compiler.stamps import LISTENERS, STAMP
from modalprep.compiler.switch import fast

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
NUMBERS = {int: types.int64, float: types.float64, bool: types.boolean}
if fast():
    from modalprep.compiler import linking
    from modalprep.compiler.cache import KernelCache

    OPTIONS |= {"_nrt": False, "pipeline_class": linking.KernelCompiler}

    def _keep(dispatcher: Any, function: Callable) -> None:
        """Keep the code of a kernel between processes, for itself and for the kernels that call it."""
        with suppress(RuntimeError):  # numba: "no locator available"
            dispatcher._cache = KernelCache(function, getattr(function, STAMP))
else:

    def _keep(dispatcher: Any, function: Callable) -> None:
        """Keep nothing."""


def dispatcher_of(kernel: Any) -> Any:
    """Return numba's dispatcher of a kernel."""
    options = OPTIONS | kernel.options
    if kernel.inline:
        return njit(**(options | INLINE))(kernel.py_func)
    if kernel.allocating and fast():
        options["_nrt"] = True
    dispatcher = njit(**options)(kernel.py_func)
    _keep(dispatcher, kernel.py_func)
    if kernel.once and fast():
        _take_numbers(dispatcher)
    return dispatcher


def _take_numbers(dispatcher: Any) -> None:
    """Let a kernel take the constants of its callers as numbers."""
    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda args, named: template(
        tuple(map(types.unliteral, args)), {name: types.unliteral(x) for name, x in named.items()}
    )


class _Compilation(event.Listener):
    """Tells `jit.when_compiling` what is compiled."""

    def on_start(self, event: Any) -> None:
        for listener in LISTENERS:
            listener(event.data["dispatcher"].py_func.__module__)

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Compilation())
