"""The LLVM code of the kernels of one kind of system, and of all that they call, in one module.

Numba keeps machine code alone, so the kernels are compiled once more, in a process of their own, whose files in numba's
cache hold LLVM's code too (`compiler.kept`): ``python -m modalprep.runtime.collect KIND FILE``.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import typeof, types

from modalprep.atomic import atomic_path
from modalprep.compiler.build import linked
from modalprep.compiler.kept import keep_code, kept_code
from modalprep.multibody.evaluation.evaluate import build_equations
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.stepping import new_run
from modalprep.multibody.integration.watching import new_watch
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.free_parts import part_of_links
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.channels import Channels
from modalprep.runtime.kinds import example, is_tree
from modalprep.runtime.roots import ROOTS, Outside
from modalprep.runtime.tangent import TANGENT_ROOTS, new_tangent

PREFIX = "mp_"  # of the names of the roots


def collect(system: System, tree: bool) -> str:
    """Return the LLVM code of the roots for the types of a system, all else internal.

    Of a tree also that of its exact derivatives.
    """
    keep_code()
    roots = ROOTS | TANGENT_ROOTS if tree else ROOTS
    symbols = {name: _symbol(kernel, _types(system, name)) for name, kernel in roots.items()}
    return _renamed(str(linked(kept_code().values(), symbols.values())), symbols)


def _symbol(kernel: Any, arguments: tuple) -> str:
    kernel.dispatcher.compile(arguments)
    return kernel.dispatcher.overloads[arguments].fndesc.llvm_func_name


def _types(system: System, root: str) -> tuple:
    """Return the types of a root's arguments."""
    packed = pack(system)
    loading = Loading(system, packed, 1.0)
    eq = build_equations(packed, loading, packed.data())
    y = np.append(start_state(packed), 0.0)
    run = new_run(y, part_of_links(system, packed), 0, 1e-5, 1e-10, 0.9, 0.0, 1.0, 1.0)
    watch = new_watch(np.zeros(0), np.zeros(packed.nx), len(y), eq)
    seen = Channels(system, packed, loading.loops)
    out = Outside(y, y.copy(), y.copy(), np.zeros(seen.width), *seen.columns)
    own = new_tangent(packed)
    eq, run, watch, out, own = map(typeof, (eq, run, watch, out, own))
    real, whole = types.float64, types.int64
    return {
        "derive": (eq, out, real),
        "channels": (eq, out, real),
        "enter": (eq, out, run, real),
        "complete": (eq, out, run, watch, real, real),
        "begin": (eq, run, whole, real, real),
        "advance": (eq, run, watch, whole, real, whole),
        "differentiate": (eq, out, own, real),
        "follow": (eq, out, own),
    }[root]


def _renamed(text: str, symbols: Mapping[str, str]) -> str:
    for name, symbol in symbols.items():
        text = text.replace(f'@"{symbol}"', f"@{PREFIX}{name}").replace(f"@{symbol}(", f"@{PREFIX}{name}(")
    return text


if __name__ == "__main__":
    llvm.initialize_native_target()
    with atomic_path(sys.argv[2]) as temporary:
        temporary.write_text(collect(example(sys.argv[1]), is_tree(sys.argv[1])))
