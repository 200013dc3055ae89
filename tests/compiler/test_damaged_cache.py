"""Damaged files of the cache of compiled kernels: compiled anew, with the right values, and never loaded."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fresh_process import printed
from size import FULL

CODE = """
from modalprep.compiler.jit import compile_kernel

@compile_kernel
def part(x):
    s = x
    for k in range(9):
        s += k * x
    return s

@compile_kernel
def total(x):
    return 2.0 * part(x)

@compile_kernel
def other(x):
    return 3.0 * x
"""
RUN = "import a; print(a.total(1.0), a.other(1.0), sum(a.total.dispatcher.stats.cache_hits.values()))"
RIGHT = "74.0 3.0"  # 2 (1 + 0 + 1 + ... + 8), 3
KINDS = ["cut to half", "empty", "one byte more", "zeros at the end", "zeros in the middle", "first byte", "head",
         "code of another kernel", "text", "last byte", "a page of noise", "twice", "begins later",
         "one bit in the middle"]  # fmt: skip


def damaged(kind, content, foreign, rng):
    """Return what is left of a file after damage of a kind."""
    half, n = len(content) // 2, len(content)
    noise = rng.integers(0, 256, min(4096, n // 2), dtype=np.uint8).tobytes()
    start = int(rng.integers(0, n - len(noise)))
    return {
        "cut to half": content[:half], "empty": b"", "one byte more": content + b"\0",
        "zeros at the end": content[: n - 512] + bytes(512),
        "zeros in the middle": content[:half] + bytes(64) + content[half + 64 :],
        "first byte": bytes([content[0] ^ 1]) + content[1:], "head": noise[:64] + content[64:],
        "code of another kernel": foreign, "text": b"no code at all\n" * 99, "last byte": content[:-1] + b"x",
        "a page of noise": content[:start] + noise + content[start + len(noise) :], "twice": 2 * content,
        "begins later": content[7:], "one bit in the middle": content[:half] + bytes([content[half] ^ 4])
        + content[half + 1 :],
    }[kind]  # fmt: skip


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """The files of three kernels that one process has compiled."""
    folder = tmp_path_factory.mktemp("damaged")
    (folder / "a.py").write_text(CODE)
    assert printed(RUN, folder, NUMBA_CACHE_DIR=str(folder / "cache")).split() == [*RIGHT.split(), "0"]
    assert printed(RUN, folder, NUMBA_CACHE_DIR=str(folder / "cache")).split() == [*RIGHT.split(), "1"]
    return folder


def load_all(folder, kinds, seed):
    """Damage the files in each way, and load them in one process that tells after each what it found."""
    files = {path.name.split(".")[1].split("-")[0]: path for path in (folder / "cache").rglob("*.nbc")}
    whole = {name: path.read_bytes() for name, path in files.items()}
    rng = np.random.default_rng(seed)
    for kind in kinds:
        for name, path in files.items():
            path.write_bytes(damaged(kind, whole[name], whole["other" if name != "other" else "part"], rng))
        yield kind
    for name, path in files.items():
        path.write_bytes(whole[name])


@pytest.mark.parametrize("kind", KINDS if FULL else KINDS[::5])
def test_damaged_code_is_compiled_anew(cache, kind):
    """All three files are damaged; a process that looked at such code ended with a segmentation fault in 5 of 14."""
    for _ in load_all(cache, [kind], seed=KINDS.index(kind)):
        environment = os.environ | {"NUMBA_CACHE_DIR": str(cache / "cache")}
        done = subprocess.run([sys.executable, "-c", RUN], cwd=cache, env=environment, capture_output=True, text=True)
        assert (done.returncode, done.stdout.split()) == (0, [*RIGHT.split(), "0"]), done.stderr[-500:]


def test_no_damage_is_taken_for_code(cache):
    """One changed byte, at random places of each file: nothing is unpickled, so that nothing can be run."""
    from modalprep.compiler.cache import DIGEST, CompiledFiles

    rng = np.random.default_rng(5)
    for path in Path(cache / "cache").rglob("*.nbc"):
        content = path.read_bytes()
        files = CompiledFiles.__new__(CompiledFiles)
        files._version, files._source_stamp = "", ""
        sealed = files._digest(content[DIGEST:]) + content[DIGEST:]
        for at in rng.integers(0, len(content), 200):
            path.with_suffix(".bad").write_bytes(sealed[:at] + bytes([sealed[at] ^ 0x10]) + sealed[at + 1 :])
            assert files._read(path.with_suffix(".bad"), None) is None
        path.with_suffix(".bad").unlink()
