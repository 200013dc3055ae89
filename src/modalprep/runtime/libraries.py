"""Libraries of the kernels and their C part: one for each kind of system and each platform.

They are kept in the user's cache, under a fingerprint of all that they are made of.
"""

from __future__ import annotations

import hashlib
import os
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
from modalprep.compiler.targets import COLLECTED, TARGETS, Target, link, machine_code
from modalprep.errors import ModalprepError
from modalprep.extras import need
from modalprep.runtime.kinds import is_tree
from modalprep.suggest import refuse_unknown

C = Path(__file__).parent / "c"
PROCESSOR = C.parents[1] / "compiler" / "c" / "processor.h"


@dataclass(frozen=True)
class Platform:
    """What a library is made for.

    Attributes
    ----------
    fmi2, fmi3 : str
        Its folder in an FMU.
    target : Target
    processors : {prefix: str}
        LLVM's name of the processor for the roots with a prefix; the second one is used where the processor can.
    """

    fmi2: str
    fmi3: str
    target: Target
    processors: dict[str, str]


X86 = {"mp_": "x86-64", "mp3_": "x86-64-v3"}
ARM, APPLE = {"mp_": "generic"}, {"mp_": "apple-m1"}
PLATFORMS = {
    "linux-x86_64": Platform("linux64", "x86_64-linux", TARGETS["linux-x86_64"], X86),
    "linux-aarch64": Platform("aarch64-linux", "aarch64-linux", TARGETS["linux-aarch64"], ARM),
    "windows-x86_64": Platform("win64", "x86_64-windows", TARGETS["windows-x86_64"], X86),
    "macos-arm64": Platform("aarch64-darwin", "aarch64-darwin", TARGETS["macos-arm64"], APPLE),
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
    path = cache_folder() / f"{kind}-{platform}-{_of_library(own)}{own.target.suffix}"
    with _alone(path):
        if not path.exists():
            code = llvm_code(kind, say)
            say(f"linking the library for {platform}")
            with tempfile.TemporaryDirectory() as folder, atomic_path(path) as temporary:
                objects = [_object(code, own, prefix, Path(folder)) for prefix in own.processors]
                made = Path(folder) / f"library{own.target.suffix}"
                # perhaps with an import library beside it
                link(own.target, [*sorted(C.glob("*.c")), *objects], made, _defined(kind, own))
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
    path = cache_folder() / f"linear-{platform}-{_fingerprint(parts)}{own.target.suffix}"
    if not path.exists():
        need("ziglang", "an FMU")
        say(f"linking the library for {platform}")
        with tempfile.TemporaryDirectory() as folder, atomic_path(path) as temporary:
            made = Path(folder) / f"library{own.target.suffix}"
            link(own.target, files, made)
            shutil.copy(made, temporary)
    return path


def llvm_code(kind: str, say: Callable[[str], None] = lambda text: None) -> str:
    """Return the LLVM code of the roots of a kind of system; another process compiles it where there is none."""
    path = cache_folder() / f"{kind}-{_of_code()}.ll"
    with _alone(path):
        if not path.exists():
            say("compiling the kernels for use without Python: once, for a minute or two")
            _collect(kind, path)
    return path.read_text()


def _collect(kind: str, path: Path) -> None:
    command = [sys.executable, "-m", "modalprep.runtime.collect", kind, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, env=_compiling())
    if done.returncode:
        raise ModalprepError(f"the kernels cannot be compiled: {done.stderr.strip()[-2000:]}")


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
    """Return the environment of the process that compiles: one processor, the private parts of numba."""
    own = {"MODALPREP_COMPILER": "fast", "NUMBA_CPU_NAME": COLLECTED, "NUMBA_CPU_FEATURES": ""}
    return {**os.environ, **own}


def _object(code: str, platform: Platform, prefix: str, folder: Path) -> Path:
    """Return the object file of the roots with a prefix."""
    path = folder / f"{prefix}.o"
    named = code.replace("@mp_", f"@{prefix}")
    path.write_bytes(machine_code(named, platform.target, platform.processors[prefix]))
    return path


def _defined(kind: str, platform: Platform) -> list[str]:
    """Return what the C part of a kind has."""
    found = {"-DWITH_TANGENT": is_tree(kind), "-DWITH_V3": len(platform.processors) > 1}
    return [name for name, there in found.items() if there]


@lru_cache
def _of_code() -> str:
    """Return the fingerprint of all kernels and their compiler."""
    from modalprep.compiler.stamps import STAMP
    from modalprep.runtime.roots import ROOTS
    from modalprep.runtime.tangent import TANGENT_ROOTS

    parts = [getattr(kernel.py_func, STAMP).encode() for kernel in (ROOTS | TANGENT_ROOTS).values()]
    parts.append(Path(__file__).with_name("collect.py").read_bytes())
    return _fingerprint([*parts, *(version(name).encode() for name in ("numba", "llvmlite"))])


def _of_library(platform: Platform) -> str:
    """Return the fingerprint of all that the library of a platform is made of."""
    files = (*sorted(C.glob("*.[ch]")), PROCESSOR)
    return _fingerprint([_of_code().encode(), repr(platform).encode(), *(f.read_bytes() for f in files)])


def _fingerprint(parts: list[bytes]) -> str:
    return hashlib.sha256(b"|".join(parts)).hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of the libraries: ``MODALPREP_LIBRARIES``, or one in the user's cache."""
    if given := os.environ.get("MODALPREP_LIBRARIES"):
        return Path(given)
    at = {"win32": "LOCALAPPDATA"}.get(sys.platform, "XDG_CACHE_HOME")
    return Path(os.environ.get(at) or Path.home() / ".cache") / "modalprep" / "libraries"
