"""LLVM's code of compiled kernels, which numba forgets: for libraries that other programs and other machines load.

It is kept beside the machine code in numba's cache, whose files are then others. ``MODALPREP_KEEP_CODE=1`` has every
process keep it: what is compiled once then serves runs, functional mock-up units and the library of the wheel, if all
are for one processor (``NUMBA_CPU_NAME``).
"""

from __future__ import annotations

import os
import re
import zlib
from functools import cache
from typing import Any

WANTED = os.environ.get("MODALPREP_KEEP_CODE", "0") not in ("", "0")
FAST = 1  # of zlib: a tenth of the size
SYMBOL = re.compile(r"(?<![\w.$])_ZN[\w.$]+")  # of numba
_code: dict[str, bytes] = {}  # compressed, of each kernel by its symbol
_names: dict[str, str] = {}  # symbols by other names, by which code of the cache knows them


@cache
def keep_code() -> None:
    """Let numba keep LLVM's code of every kernel from now on, and in its cache."""
    from modalprep.compiler import linking
    from modalprep.compiler.cache import KernelCache

    compile_kernel, alias = linking.KernelCompiler._compile_kernel, linking._alias
    reduce, rebuild = linking.LinkedCode.reduce, linking.LinkedCode.rebuild

    def compiled(self):
        result = compile_kernel(self)
        text = str(result.library._final_module)
        _code[result.fndesc.llvm_func_name] = zlib.compress(text.encode(), FAST)
        return result

    def reduced(self, result):
        return *reduce(self, result), _code[result.fndesc.llvm_func_name]

    def rebuilt(self, target, payload):
        *payload, code = payload
        result = rebuild(self, target, tuple(payload))
        if result is not None:
            _code[result.fndesc.llvm_func_name] = code
        return result

    def aliased(symbol, kernel):
        alias(symbol, kernel)
        if symbol != kernel.fndesc.llvm_func_name:
            _names[symbol] = kernel.fndesc.llvm_func_name

    linking._alias = aliased
    linking.KernelCompiler._compile_kernel = compiled
    cached: Any = linking.LinkedCode
    cached.reduce, cached.rebuild = reduced, rebuilt
    files: Any = KernelCache
    index_key = files._index_key
    files._index_key = lambda self, *given: (*index_key(self, *given), "with LLVM's code")


def kept_code() -> dict[str, str]:
    """Return LLVM's code of all kernels that were compiled or loaded, by their symbols."""
    return {symbol: renamed(zlib.decompress(code).decode(), _names) for symbol, code in _code.items()}


def renamed(code: str, names: dict[str, str]) -> str:
    """Return LLVM's code with other names of numba's symbols."""
    return re.sub(SYMBOL, lambda found: names.get(found[0], found[0]), code) if names else code
