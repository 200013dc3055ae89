"""The identity of the program covers every package: what any of them computes differently is computed again."""

import shutil
from pathlib import Path

import modalprep
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
