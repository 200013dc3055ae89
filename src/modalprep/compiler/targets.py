"""Other machines: their code from LLVM's code of this one, and their libraries by zig's C compiler and linker."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from modalprep.errors import ModalprepError

COLLECTED = "x86-64-v3"  # the processor for which numba writes LLVM code, wherever it runs


class Target(NamedTuple):
    """A machine with its system.

    Attributes
    ----------
    triple, zig : str
        Its names for LLVM and for zig.
    suffix : str
        Of its libraries.
    wheel : str
        Its tag in the name of a wheel.
    """

    triple: str
    zig: str
    suffix: str
    wheel: str


TARGETS = {  # with the C library of manylinux 2.17, and macOS 11
    "linux-x86_64": Target("x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", ".so", "manylinux_2_17_x86_64"),
    "linux-aarch64": Target("aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", ".so", "manylinux_2_17_aarch64"),
    "windows-x86_64": Target("x86_64-pc-windows-gnu", "x86_64-windows-gnu", ".dll", "win_amd64"),
    "macos-arm64": Target("aarch64-apple-macosx11.0.0", "aarch64-macos.11.0", ".dylib", "macosx_11_0_arm64"),
}


COUNTED = "llvm.x86.atomic.sub.cc.i64"  # by which numba's code for x86 counts down who uses an array
COUNT_DOWN = """
define internal i8 @count_down(ptr %users, i64 %by, i32 %equal) {
  %before = atomicrmw sub ptr %users, i64 %by seq_cst
  %none = icmp eq i64 %before, %by
  %found = zext i1 %none to i8
  ret i8 %found
}
"""


def machine_code(code: str, target: Target, processor: str) -> bytes:
    """Return the object file of LLVM's code for a processor, by LLVM's name of it."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    found = llvm.Target.from_triple(target.triple)
    machine = found.create_target_machine(cpu=processor, opt=3, reloc="pic", codemodel="small")
    for key, own in (("triple", target.triple), ("datalayout", str(machine.target_data))):
        code = re.sub(rf"^target {key} = .*$", f'target {key} = "{own}"', code, flags=re.MULTILINE)
    if not target.triple.startswith("x86"):
        code = _without_x86(code)
    return machine.emit_object(llvm.parse_assembly(code))


def _without_x86(code: str) -> str:
    """Return LLVM's code without the one function that x86 alone has: whether a count became zero (condition 4)."""
    if COUNTED not in code:
        return code
    code = re.sub(rf"^declare .*@{re.escape(COUNTED)}\(.*$", COUNT_DOWN, code, flags=re.MULTILINE)
    return re.sub(rf"@{re.escape(COUNTED)}(\(.*i32 4\))", r"@count_down\1", code)


def link(target: Target, files: Iterable[Path], path: Path, options: Iterable[str] = ()) -> None:
    """Compile files of C and link them with object files.

    Raises
    ------
    ModalprepError
        With what the compiler says.
    """
    common = ["-target", target.zig, "-shared", "-O2", "-fPIC", "-fvisibility=hidden", "-s", *options]
    libraries = [] if target.suffix == ".dll" else ["-lm"]
    command = [sys.executable, "-m", "ziglang", "cc", *common, *map(str, files), "-o", str(path), *libraries]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise ModalprepError(f"the library cannot be compiled: {done.stderr.strip()[-2000:]}")
