"""What the README shows is run."""

import re
import tomllib
from pathlib import Path

import pytest

from modalprep.cli import app
from modalprep.pipeline.schema import Pipeline


@pytest.fixture
def text(project):
    return (project / "README.md").read_text()


def test_python_blocks_run_in_order(text, project, tmp_path, monkeypatch, capsys):
    (tmp_path / "meshes").symlink_to(project / "meshes")
    monkeypatch.chdir(tmp_path)
    scope: dict = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "README.md", "exec"), scope)
    printed = capsys.readouterr().out
    assert "modalprep 1 SI" in printed
    assert "fixed-interface" in printed
    assert scope["run"].stats["energy_error"] < 1e-4


def test_pipeline_block_is_valid_and_true(text, project):
    block = tomllib.loads(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])
    shipped = tomllib.loads((project / "pipelines" / "bracket.toml").read_text())
    Pipeline.model_validate(block)
    assert block == {key: shipped[key] for key in block}


def test_every_command_exists(text):
    shown = set(re.findall(r"bin/modalprep (\w+)", text))
    assert shown <= {command.name or command.callback.__name__ for command in app.registered_commands}
    assert shown == {"run", "modes", "check", "render", "simulate", "mesh", "quality", "schema"}


def test_every_file_named_exists(text, project):
    for name in re.findall(r"\]\((\S+?)\)", text) + [f"pipelines/{n}" for n in re.findall(r"`([\w-]+\.toml)`", text)]:
        assert (project / Path(name)).exists(), name


def test_element_page(project, capsys):
    """Its TOML is valid where a material and a mesh are added; its Python runs."""
    text = (project / "src" / "modalprep" / "fe" / "README.md").read_text()
    elements, deck = (tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL))
    Pipeline.model_validate({"mesh": {"file": "a.msh"}, **elements})
    Pipeline.model_validate(deck)
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "fe/README.md", "exec"), {})
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_element_page_names_every_type(project):
    from modalprep.pipeline.model import SECTIONS

    text = (project / "src" / "modalprep" / "fe" / "README.md").read_text()
    assert set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)) - {"type"} == set(SECTIONS)
