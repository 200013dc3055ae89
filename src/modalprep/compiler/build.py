"""The library of the compiled kernels that Python calls.

Calls of the package are made once (`modalprep.exercise`), and every kernel that they call from Python, with the types
of its arguments, becomes a function of the library (`library`): a few lines of C around the code of numba. Users of the
library need neither numba nor a compiler.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from modalprep.compiler.kept import keep_code, kept_code, renamed
from modalprep.compiler.library import file_of, symbol_of
from modalprep.compiler.targets import COLLECTED, TARGETS, Target, link, machine_code

C = Path(__file__).parent / "c"
X86 = {"v4": "x86-64-v4", "v3": "x86-64-v3", "v1": "x86-64"}  # LLVM's names of `library.LEVELS`
PROCESSORS = {  # of Windows also v3, of others one: `library.loaded`
    "linux-x86_64": X86,
    "linux-aarch64": {"v1": "generic"},
    "windows-x86_64": {"v3": X86["v3"], "v1": X86["v1"]},
    "macos-arm64": {"v1": "apple-m1"},
}


class Root(NamedTuple):
    """A kernel that Python calls: names in the library and in LLVM's code, its C function."""

    symbol: str
    code: str
    wrapper: str


def collected(job: Callable[[], object]) -> tuple[list[Root], dict[str, str]]:
    """Return the kernels that Python calls in a job, and LLVM's code of all by its symbol."""
    from modalprep.compiler.jit import Kernel

    keep_code()
    roots: list[Root] = []
    plain: Callable = Kernel.entry

    def entry(kernel: Kernel, first: Sequence[object], rest: Sequence[type] = ()) -> None:
        roots.append(_root(kernel, first, rest))

    Kernel.entry = entry  # type: ignore[method-assign]
    try:
        job()
    finally:
        Kernel.entry = plain  # type: ignore[method-assign]
    return roots, kept_code()


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


def build(jobs: Iterable[Callable[[], object]], folders: Mapping[str, Path]) -> list[Path]:
    """Write the libraries of the kernels that some jobs call, for platforms each with its folder; return them."""
    os.environ.update({"MODALPREP_COMPILER": "fast", "NUMBA_CPU_NAME": COLLECTED, "NUMBA_CPU_FEATURES": ""})
    with ProcessPoolExecutor(2, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        found = list(pool.map(collected, jobs))
    roots = {root.symbol: root for own, _ in found for root in own}
    modules = {symbol: code for _, own in found for symbol, code in own.items()}
    names = {root.code: f"kernel_{k}" for k, root in enumerate(roots.values())}
    calls = '#include "python.h"\n' + "".join(root.wrapper.format(names[root.code]) for root in roots.values())
    whole = _whole(modules, names)
    return [path for platform, folder in folders.items() for path in _libraries(calls, whole, platform, folder)]


def _whole(modules: dict[str, str], names: dict[str, str]) -> str:
    """Return LLVM's code of all kernels, those that Python calls by their names."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return renamed(str(linked(modules.values(), names)), names)


def _libraries(calls: str, whole: str, platform: str, folder: Path) -> Iterator[Path]:
    target = TARGETS[platform]
    with tempfile.TemporaryDirectory() as scratch:
        source, made = Path(scratch) / "calls.c", Path(scratch) / f"made{target.suffix}"
        source.write_text(calls)
        for level, processor in PROCESSORS[platform].items():
            code = Path(scratch) / f"{level}.o"
            code.write_bytes(machine_code(whole, target, processor))
            link(target, [*sorted(C.glob("*.c")), source, code], made, _options(target))
            path = folder / file_of(level, target.suffix)
            shutil.copy(made, path)  # without the import library of Windows
            yield path


def _options(target: Target) -> list[str]:
    """Return the options of the linker: nothing may be undefined, which is an error on other systems anyway."""
    return [f"-I{C}", *["-Wl,-z,defs"] * (target.suffix == ".so")]
