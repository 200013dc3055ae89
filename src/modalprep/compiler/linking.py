"""Large kernels are compiled once: what calls them refers to them by name.

Numba copies all that a function calls, and all that this calls in turn, into the function's own code, optimises and
translates it there once more. That takes most of the time of programs whose kernels call each other. Here the code of
a large kernel stands in one place, under a name that no other code has; cached code says which others it calls, and
they are loaded before it.
"""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import CodeType
from typing import Any

import llvmlite.binding as llvm
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.typed_passes import AnnotateTypes, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes

from modalprep.compiler.stamps import KERNELS, Key, key_of

_dynfunc: Any = import_module("numba._dynfunc")  # of C, without types
SMALL = 100  # instructions that are still copied, for the sake of speed
COLLECTION = (50_000, 100, 100)  # thresholds of gc while a kernel is compiled
MANGLED = "_ZN"  # begin of the symbols of compiled functions; of those, only kernels are declared
_compiled: dict[str, tuple[Key, tuple]] = {}  # kernel and types of arguments by symbol, also of other processes
_calls: dict[str, list[str]] = {}  # symbols of kernels that a symbol's code refers to


class KernelCompiler(Compiler):
    """Numba's compiler, but kernels are named by source and argument types, and large ones are not copied."""

    def _compile_core(self) -> CompileResult:
        function, args = self.state.func_id.func, self.state.args
        source = f"{key_of(function)}{args}"  # numba numbers functions and records as they come
        self.state.func_id.unique_id = hashlib.sha256(source.encode()).hexdigest()[:16]
        with _undisturbed():
            return self._compile_copied() if self.state.flags.no_cpython_wrapper else self._compile_kernel()

    def _compile_kernel(self) -> CompileResult:
        result = super()._compile_core()
        symbol, library = result.fndesc.llvm_func_name, result.library
        _compiled[symbol] = key_of(self.state.func_id.func), self.state.args
        functions = library._final_module.functions
        _calls[symbol] = [f.name for f in functions if f.is_declaration and f.name.startswith(MANGLED)]
        if not self.state.flags.forceinline and _is_large(library.get_function(symbol)):
            library._shared_module = _declaration(library._final_module, symbol)
        return result

    def _compile_copied(self) -> CompileResult:
        """Compile a function that only kernels call, which take a copy: no machine code is made of its own."""
        state = self.state
        state.library = CopiedCode(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        result = super()._compile_core()
        module = result.fndesc.lookup_module()
        name = state.func_id.func_name
        entry = _dynfunc.make_function(module, name, "", 0, result.environment, (result.library,))
        state.targetctx.insert_user_function(entry, result.fndesc, [result.library])
        return result._replace(entry_point=entry)

    def define_pipelines(self) -> list:
        """Return numba's passes without its notes on types, and without those that find nothing to do."""
        (passes,) = super().define_pipelines()
        needless: list[type] = [AnnotateTypes]
        if not any(isinstance(x, CodeType) for x in self.state.func_id.code.co_consts):
            needless.append(InlineClosureLikes)
        if not self.state.flags.nrt:  # no expressions of whole arrays
            needless.append(NopythonRewrites)
        passes.passes = [given for given in passes.passes if given[0] not in needless]
        return [passes]


class CopiedCode(JITCodeLibrary):
    """Code of which no machine code is made."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Compile without what takes a tenth of the time.

    That is a search for cyclic garbage after every few hundred new objects, and numba's clocks of all calls of LLVM, of
    which there is one for each level of kernels that call each other.
    """
    thresholds = gc.get_threshold()
    lock = llvm.ffi.lib._lock
    gc.set_threshold(*COLLECTION)
    clocks = lock._cblist
    lock._cblist = []
    try:
        yield
    finally:
        lock._cblist = clocks
        gc.set_threshold(*thresholds)


class LinkedCode(CompileResultCacheImpl):
    """The cached code of a kernel, and the names of the kernels that it calls."""

    def reduce(self, cres: CompileResult) -> tuple[Any, ...]:
        """Return what is written of a kernel.

        Without the globals of numba's own functions, which only Python objects need: to read them back imports half of
        numba, and SciPy.
        """
        symbol = cres.fndesc.llvm_func_name
        *own, globals_ = cres._reduce()
        own.append(tuple(g for g in globals_ if g.consts or not g.globals["__name__"].startswith("numba.")))
        return _compiled[symbol], [(name, *_compiled[name]) for name in _calls[symbol]], tuple(own)

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> Any:
        """Return the kernel after those that it refers to; None when one is gone."""
        own, called, reduced = payload
        if not all(key in KERNELS for _, key, _ in called):
            return None
        for name, key, args in called:
            _alias(name, _loaded(KERNELS[key].dispatcher, args))
            _compiled[name] = key, args
        descriptor = reduced[1]
        _compiled[descriptor.llvm_func_name] = own
        known = {descriptor.llvm_func_name, descriptor.llvm_cpython_wrapper_name}
        target_context.codegen()._engine._defined_symbols |= known  # of a library that holds a declaration
        return super().rebuild(target_context, reduced)


def _loaded(kernel: Any, args: tuple) -> CompileResult:
    """Return a kernel for its types of arguments, as numba's `compile`, which times each step once a level of calls."""
    if args not in kernel.overloads:
        found = kernel._cache.load_overload(args, kernel.targetctx)
        if found is None:
            kernel.compile(args)
        else:
            kernel._cache_hits[args] += 1
            kernel.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
            kernel.add_overload(found)
    return kernel.overloads[args]


def _alias(symbol: str, kernel: CompileResult) -> None:
    """Make a loaded kernel known by the name that another process has given it."""
    own = kernel.fndesc.llvm_func_name
    if own != symbol:
        llvm.add_symbol(symbol, kernel.library.get_pointer_to_function(own))


def _is_large(function: Any) -> bool:
    count = 0
    for block in function.blocks:
        for _ in block.instructions:
            count += 1
            if count > SMALL:
                return True
    return False


def _declaration(module: Any, symbol: str) -> Any:
    kind = str(module.get_function(symbol).global_value_type)
    result, arguments = kind.split("(", 1)
    return llvm.parse_assembly(
        f'target triple = "{module.triple}"\ntarget datalayout = "{module.data_layout}"\n'
        f'declare {result} @"{symbol}"({arguments}\n'
    )
