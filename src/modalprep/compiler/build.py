"""The library of the compiled kernels that Python calls.

Calls of the package are made once (`modalprep.exercise`), and every kernel that they call from Python, with the types
of its arguments, becomes a function of the library (`library`): a few lines of C around the code of numba. Users of the
library need neither numba nor a compiler.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from modalprep.compiler.library import FILE, LEVELS, symbol_of

C = Path(__file__).parent / "c"
PROCESSORS = {"v4": "x86-64-v4", "v3": "x86-64-v3", "v1": "x86-64"}  # LLVM's names of `LEVELS`
COLLECTED = "x86-64-v3"  # the processor for which numba writes LLVM code, wherever it runs


class Root(NamedTuple):
    """A kernel that Python calls: names in the library and in LLVM's code, its C function."""

    symbol: str
    code: str
    wrapper: str


def collected(job: Callable[[], object]) -> tuple[list[Root], dict[str, str]]:
    """Return the kernels that Python calls in a job, and LLVM's code of all by its symbol."""
    from modalprep.compiler.jit import Kernel

    modules, names = keep_code()
    roots: list[Root] = []
    plain: Callable = Kernel.entry

    def entry(kernel: Kernel, first: Sequence[object], rest: Sequence[type] = ()) -> None:
        roots.append(_root(kernel, first, rest))

    Kernel.entry = entry  # type: ignore[method-assign]
    try:
        job()
    finally:
        Kernel.entry = plain  # type: ignore[method-assign]
    return roots, {symbol: _renamed(code, names) for symbol, code in modules.items()}


def keep_code() -> tuple[dict[str, str], dict[str, str]]:
    """Let numba keep LLVM's code of every kernel, and in its cache.

    Returns
    -------
    dict
        The code of each kernel, by its symbol.
    dict
        Symbols by other names, by which code of the cache knows them.
    """
    from modalprep.compiler import cache, linking

    modules: dict[str, str] = {}
    names: dict[str, str] = {}
    compile_kernel = linking.KernelCompiler._compile_kernel
    reduce, rebuild = linking.LinkedCode.reduce, linking.LinkedCode.rebuild

    def compiled(self):
        result = compile_kernel(self)
        modules[result.fndesc.llvm_func_name] = str(result.library._final_module)
        return result

    def reduced(self, result):
        return *reduce(self, result), modules[result.fndesc.llvm_func_name]

    def rebuilt(self, target, payload):
        *payload, code = payload
        result = rebuild(self, target, tuple(payload))
        if result is not None:
            modules[result.fndesc.llvm_func_name] = code
        return result

    def aliased(symbol, kernel):
        alias(symbol, kernel)
        if symbol != kernel.fndesc.llvm_func_name:
            names[symbol] = kernel.fndesc.llvm_func_name

    alias, linking._alias = linking._alias, aliased
    linking.KernelCompiler._compile_kernel = compiled
    cached: Any = linking.LinkedCode
    cached.reduce, cached.rebuild = reduced, rebuilt
    files: Any = cache.KernelCache
    index_key = files._index_key
    files._index_key = lambda self, *given: (*index_key(self, *given), "with LLVM's code")
    return modules, names


def _renamed(code: str, names: dict[str, str]) -> str:
    """Return LLVM's code with other names of symbols."""
    if not names:
        return code
    known = "|".join(map(re.escape, names))
    return re.sub(rf"(?<![\w.$])({known})(?![\w.$])", lambda found: names[found[1]], code)


def _root(kernel, first: Sequence[object], rest: Sequence[type]) -> Root:
    from numba import typeof

    from modalprep.compiler.by_address import written
    from modalprep.compiler.dispatch_code import NUMBERS
    from modalprep.compiler.wrappers import wrapper

    kinds = (*map(typeof, first), *(NUMBERS[kind] for kind in rest))
    kernel.dispatcher.compile(kinds)
    found = kernel.dispatcher.overloads[kinds]
    symbol = symbol_of(kernel, [*map(written, first), *(written(kind(0)) for kind in rest)])
    code = found.fndesc.llvm_func_name
    return Root(symbol, code, wrapper(symbol, code, kernel, found.signature.return_type, kinds))


def linked(modules: Iterable[str], roots: Iterable[str]):
    """Return one module of LLVM of all, without what no root needs."""
    import llvmlite.binding as llvm

    whole, *others = map(llvm.parse_assembly, modules)
    for module in others:
        whole.link_in(module)
    kept = set(roots)
    for each in (*whole.functions, *whole.global_variables):
        if not each.is_declaration and each.name not in kept:
            each.linkage = "internal"
    machine = llvm.Target.from_default_triple().create_target_machine(opt=2)
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
    manager = llvm.create_new_module_pass_manager()
    manager.add_global_dead_code_eliminate_pass()
    manager.run(whole, builder)
    return whole


def build(jobs: Iterable[Callable[[], object]], folder: Path) -> list[Path]:
    """Write the libraries of the kernels that some jobs call to a folder; return them."""
    os.environ.update({"MODALPREP_COMPILER": "fast", "NUMBA_CPU_NAME": COLLECTED, "NUMBA_CPU_FEATURES": ""})
    with ProcessPoolExecutor(2, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        found = list(pool.map(collected, jobs))
    roots = {root.symbol: root for own, _ in found for root in own}
    modules = {symbol: code for _, own in found for symbol, code in own.items()}
    return [*_libraries(list(roots.values()), modules, folder)]


def _libraries(roots: list[Root], modules: dict[str, str], folder: Path):
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    names = {root.code: f"kernel_{k}" for k, root in enumerate(roots)}
    whole = _renamed(str(linked(modules.values(), names)), names)
    with tempfile.TemporaryDirectory() as scratch:
        calls = Path(scratch) / "calls.c"
        calls.write_text('#include "python.h"\n' + "".join(root.wrapper.format(names[root.code]) for root in roots))
        for level in LEVELS:
            target = folder / FILE.format(level)
            machine = llvm.Target.from_default_triple().create_target_machine(
                cpu=PROCESSORS[level], opt=3, reloc="pic", codemodel="small"
            )
            code = Path(scratch) / f"{level}.o"
            code.write_bytes(machine.emit_object(llvm.parse_assembly(whole)))
            options = ["-shared", "-O2", "-fPIC", "-fvisibility=hidden", "-s", "-Wl,-z,defs", f"-I{C}"]
            files = [*map(str, sorted(C.glob("*.c"))), str(calls), str(code)]
            command = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-linux-gnu.2.17"]
            subprocess.run([*command, *options, *files, "-o", str(target), "-lm"], check=True)
            yield target
