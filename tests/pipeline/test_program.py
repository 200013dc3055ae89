"""The identity of the program covers every package: what any of them computes differently is computed again."""

import hashlib
import os
import shutil
from pathlib import Path

import pytest

import modalprep
from modalprep.fe.readers.digest import mesh_digest
from modalprep.program import program, sources_digest

ROOT = Path(modalprep.__file__).parent


def test_one_line_in_any_package_makes_another_program(tmp_path):
    """With the stiffness of beams changed, a batch once said "finished before" and gave the old frequencies."""
    copy = shutil.copytree(ROOT, tmp_path / "modalprep", ignore=shutil.ignore_patterns("__pycache__"))
    whole = sources_digest(copy)
    assert program()["sources_sha256"] == whole
    packages = sorted(file.parent for file in copy.glob("*/__init__.py"))
    assert len(packages) > 12
    for package in packages:
        file = sorted(package.rglob("*.py"))[-1]
        text = file.read_text()
        file.write_text(f"{text}\n# changed\n")
        assert sources_digest(copy) != whole, file
        file.write_text(text)
    assert sources_digest(copy) == whole


@pytest.mark.parametrize("name", ["plate.bdf", "plate.inp", "plate.msh"])
def test_a_file_is_read_once_as_long_as_it_is_the_same(tmp_path, monkeypatch, name):
    """Its hash is that of its bytes; ten thousand jobs that share a mesh read it once, and see that it has changed."""
    reads = []
    monkeypatch.setattr("modalprep.program._read_digest", lambda path: reads.append(path) or sha(path))
    file = tmp_path / name
    file.write_text("$ nothing\n** nothing\n")
    assert mesh_digest(file) == mesh_digest(file) == sha(file)
    assert len(reads) == 2  # it has just been written, and may change again in the same instant
    os.utime(file, (1e9, 1e9))
    reads.clear()
    assert mesh_digest(file) == mesh_digest(file) == sha(file)
    assert len(reads) == 1
    file.write_text("$ another\n** anotherX\n")
    os.utime(file, (1e9, 1e9))  # even with the old time
    assert mesh_digest(file) == sha(file)


def test_a_deck_with_includes_changes_with_them(tmp_path):
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=b.inp\n")
    (tmp_path / "b.inp").write_text("*NODE\n1, 0, 0, 0\n")
    before = mesh_digest(tmp_path / "a.inp")
    (tmp_path / "b.inp").write_text("*NODE\n1, 1, 0, 0\n")
    assert mesh_digest(tmp_path / "a.inp") != before


def sha(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()
