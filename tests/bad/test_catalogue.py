"""Bad input of every kind: exit code 2, one message that says what to do, no traceback, nothing left behind."""

import shutil

import pytest
from bad import files, good, pipelines

from modalprep.cli import main

CHANGED = {
    "job.toml": ("run", pipelines.BODY),
    "solid.toml": ("run", pipelines.SOLIDS),
    "plate.toml": ("run", pipelines.PLATES),
    "system.toml": ("simulate", pipelines.SYSTEMS),
}


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    return good.write_good(tmp_path_factory.mktemp("good"))


@pytest.fixture
def folder(originals, tmp_path, monkeypatch):
    shutil.copytree(originals, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys, folder, arguments, words):
    """Run the command and check the promise."""
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    assert main(list(arguments)) == 2
    error = capsys.readouterr().err
    assert error.startswith("modalprep: ")
    assert error.count("\n") == 1
    assert not [word for word in words if word not in error], error
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before


def cases(changed):
    for file, (command, rows) in changed.items():
        for row in rows:
            yield pytest.param(file, command, *row[:2], row[2:], id=f"{file}: {row[1].strip()[:60]!r}")


@pytest.mark.parametrize(("file", "command", "old", "new", "words"), list(cases(CHANGED)))
def test_one_thing_wrong(folder, capsys, file, command, old, new, words):
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    refused(capsys, folder, [command, file], words)


TABLES = {
    "mesh": files.MESHES,
    "matrices": files.MATRICES,
    "modal": files.MODAL,
    "command": files.COMMANDS,
    "folder": files.FOLDERS,
    "name": files.NAMES,
    "before work": files.BEFORE_WORK,
}
FILES = [
    pytest.param(*row[:2], row[2:], id=f"{kind} {number}: {row[0]}: {row[2][:50]}")
    for kind, rows in TABLES.items()
    for number, row in enumerate(rows)
]


@pytest.mark.parametrize(("command", "change", "words"), FILES)
def test_one_file_wrong(folder, capsys, command, change, words):
    change(folder)
    refused(capsys, folder, command.split(), words)


@pytest.mark.parametrize("name", good.PIPELINES)
def test_the_originals_are_good(folder, capsys, name):
    assert main(["run", f"{name}.toml"]) == 0
