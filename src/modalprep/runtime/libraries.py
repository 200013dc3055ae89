"""Libraries of the kernels and their C part: one for each kind of system and each platform.

They are kept in the user's cache, under a fingerprint of all that they are made of.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from modalprep.atomic import atomic_path
from modalprep.errors import ModalprepError
from modalprep.extras import need
from modalprep.suggest import refuse_unknown

C = Path(__file__).parent / "c"
COLLECTED = "x86-64-v3"  # the processor for which numba writes LLVM code, wherever it runs


@dataclass(frozen=True)
class Platform:
    """What a library is made for.

    Attributes
    ----------
    fmi2, fmi3 : str
        Its folder in an FMU.
    triple, target : str
        Its name for LLVM and for zig.
    suffix : str
        Of its libraries.
    processors : {prefix: str}
        LLVM's name of the processor for the roots with a prefix; the second one is used where the processor can.
    """

    fmi2: str
    fmi3: str
    triple: str
    target: str
    suffix: str
    processors: dict[str, str]


X86 = {"mp_": "x86-64", "mp3_": "x86-64-v3"}
ARM, APPLE = {"mp_": "generic"}, {"mp_": "apple-m1"}
PLATFORMS = {
    "linux-x86_64": Platform(
        "linux64", "x86_64-linux", "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", ".so", X86
    ),
    "linux-aarch64": Platform(
        "aarch64-linux", "aarch64-linux", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", ".so", ARM
    ),
    "windows-x86_64": Platform("win64", "x86_64-windows", "x86_64-pc-windows-gnu", "x86_64-windows-gnu", ".dll", X86),
    "macos-arm64": Platform(
        "aarch64-darwin", "aarch64-darwin", "aarch64-apple-macosx11.0.0", "aarch64-macos.11.0", ".dylib", APPLE
    ),
}


def library(kind: str, platform: str, say: Callable[[str], None] = lambda text: None) -> Path:
    """Return the library of a kind of system for a platform; it is made where there is none.

    Parameters
    ----------
    kind : str
        One of `kinds.KINDS`.
    platform : str
        One of `PLATFORMS`.
    say : callable
        Told what takes long.

    Raises
    ------
    NotInstalledError
        When there is none, and no compiler to make it.
    """
    refuse_unknown(platform, PLATFORMS, "platform")
    for module in "numba", "ziglang":
        need(module, "an FMU")
    own = PLATFORMS[platform]
    path = cache_folder() / f"{kind}-{platform}-{_of_library(own)}{own.suffix}"
    with _alone(path):
        if not path.exists():
            code = llvm_code(kind, say)
            say(f"linking the library for {platform}")
            with tempfile.TemporaryDirectory() as folder, atomic_path(path) as temporary:
                objects = [_object(code, own, prefix, Path(folder)) for prefix in own.processors]
                made = Path(folder) / f"library{own.suffix}"
                _link(own, [*sorted(C.glob("*.c")), *objects], made, len(objects) > 1)  # perhaps with an import library
                shutil.copy(made, temporary)
    return path


def linear_library(platform: str, say: Callable[[str], None] = lambda text: None) -> Path:
    """Return the library of linear equations for a platform, which has no kernels; it is made where there is none.

    Raises
    ------
    NotInstalledError
        When there is none, and no compiler to make it.
    """
    refuse_unknown(platform, PLATFORMS, "platform")
    own = PLATFORMS[platform]
    files = [C / "fmi2.c", C / "fmi3.c", C / "linear" / "core.c"]
    parts = [repr(own).encode(), *(f.read_bytes() for f in (C / "core.h", *files))]
    path = cache_folder() / f"linear-{platform}-{_fingerprint(parts)}{own.suffix}"
    if not path.exists():
        need("ziglang", "an FMU")
        say(f"linking the library for {platform}")
        with tempfile.TemporaryDirectory() as folder, atomic_path(path) as temporary:
            made = Path(folder) / f"library{own.suffix}"
            _link(own, files, made, has_v3=False)
            shutil.copy(made, temporary)
    return path


def llvm_code(kind: str, say: Callable[[str], None] = lambda text: None) -> str:
    """Return the LLVM code of the roots of a kind of system; another process compiles it where there is none."""
    path = cache_folder() / f"{kind}-{_of_code()}.ll"
    with _alone(path):
        if not path.exists():
            say("compiling the kernels for use without Python: once, for a minute or two")
            _run([sys.executable, "-m", "modalprep.runtime.collect", kind, str(path)], "the kernels", _compiling())
    return path.read_text()


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Let other processes wait that make the same file; where the system has no such locks, each makes its own."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _compiling() -> dict[str, str]:
    """Return the environment of the process that compiles: no cache, one processor, the private parts of numba."""
    own = {"MODALPREP_COMPILER": "fast", "NUMBA_CPU_NAME": COLLECTED, "NUMBA_CPU_FEATURES": ""}
    return {**os.environ, **own}


def _object(code: str, platform: Platform, prefix: str, folder: Path) -> Path:
    """Return the object file of the roots with a prefix."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(platform.triple)
    machine = target.create_target_machine(cpu=platform.processors[prefix], opt=3, reloc="pic", codemodel="small")
    code = re.sub(r"^target triple = .*$", f'target triple = "{platform.triple}"', code, flags=re.MULTILINE)
    code = re.sub(r"^target datalayout = .*$", f'target datalayout = "{machine.target_data}"', code, flags=re.MULTILINE)
    path = folder / f"{prefix}.o"
    path.write_bytes(machine.emit_object(llvm.parse_assembly(code.replace("@mp_", f"@{prefix}"))))
    return path


def _link(platform: Platform, files: list[Path], target: Path, has_v3: bool) -> None:
    """Compile the C part and link it with the objects of the kernels."""
    options = ["-target", platform.target, "-shared", "-O2", "-fPIC", "-fvisibility=hidden", "-s"]
    if has_v3:
        options.append("-DWITH_V3")
    libraries = [] if platform.suffix == ".dll" else ["-lm"]
    _run(
        [sys.executable, "-m", "ziglang", "cc", *options, *map(str, files), "-o", str(target), *libraries],
        "the library",
    )


def _run(command: list[str], what: str, environment: dict[str, str] | None = None) -> None:
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        raise ModalprepError(f"{what} cannot be compiled: {done.stderr.strip()[-2000:]}")


@lru_cache
def _of_code() -> str:
    """Return the fingerprint of all kernels and their compiler."""
    from modalprep.compiler.stamps import STAMP
    from modalprep.runtime.roots import ROOTS

    parts = [getattr(kernel.py_func, STAMP).encode() for kernel in ROOTS.values()]
    parts.append(Path(__file__).with_name("collect.py").read_bytes())
    return _fingerprint([*parts, *(version(name).encode() for name in ("numba", "llvmlite"))])


def _of_library(platform: Platform) -> str:
    """Return the fingerprint of all that the library of a platform is made of."""
    return _fingerprint(
        [_of_code().encode(), repr(platform).encode(), *(f.read_bytes() for f in sorted(C.glob("*.[ch]")))]
    )


def _fingerprint(parts: list[bytes]) -> str:
    return hashlib.sha256(b"|".join(parts)).hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of the libraries: ``MODALPREP_LIBRARIES``, or one in the user's cache."""
    if given := os.environ.get("MODALPREP_LIBRARIES"):
        return Path(given)
    at = {"win32": "LOCALAPPDATA"}.get(sys.platform, "XDG_CACHE_HOME")
    return Path(os.environ.get(at) or Path.home() / ".cache") / "modalprep" / "libraries"
