"""What the README shows is run."""

import re
import tomllib

import pytest
from PIL import Image

from modalprep import __version__
from modalprep.pipeline.schema.pipeline import Pipeline

LONGEST = 150  # lines of a landing page
LARGEST = 1.5e6  # bytes of its moving picture


@pytest.fixture
def text(project):
    return (project / "README.md").read_text()


def test_it_is_a_landing_page(text):
    assert len(text.splitlines()) <= LONGEST
    for command in ("pip install", "make demo", "make test"):
        assert command in text


def test_python_block_runs(text, project, tmp_path, monkeypatch):
    (tmp_path / "meshes").symlink_to(project / "meshes")
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(compile(block, "README.md", "exec"), scope := {})
    assert scope["run"].stats["energy_error"] < 1e-4
    assert (tmp_path / "output" / "link.h5").exists()


@pytest.mark.parametrize("page", ["README.md", "docs/tutorials/first-body.md"])
def test_pipeline_block_is_valid_and_true(page, project):
    """It is the shipped file, less some of its tables."""
    (block,) = re.findall(r"```toml\n(.*?)```", (project / page).read_text(), re.DOTALL)
    shipped = tomllib.loads((project / "pipelines" / "bracket.toml").read_text())
    found = tomllib.loads(block)
    Pipeline.model_validate(found)
    assert found == {key: shipped[key] for key in found}


def test_a_picture_moves(text, project):
    (name,) = re.findall(r"\]\((\S+\.webp)\)", text)
    assert (project / name).stat().st_size < LARGEST
    with Image.open(project / name) as picture:
        assert picture.n_frames > 10


@pytest.mark.parametrize(
    "page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "pipelines/README.md", "meshes/README.md"]
)
def test_every_file_named_exists(page, project):
    file = project / page
    text = file.read_text()
    for name in re.findall(r"\]\(([^\s)#]+)", text):
        assert "://" in name or (file.parent / name).exists(), name
    for name in re.findall(r"`(pipelines/[\w-]+\.toml)`", text):
        assert (project / name).exists(), name


def test_the_changelog_begins_with_the_version(project):
    first = re.search(r"^## (.*)$", (project / "CHANGELOG.md").read_text(), re.MULTILINE)[1]
    assert re.fullmatch(rf"{re.escape(__version__)} \((not released|\d{{4}}-\d\d-\d\d)\)", first), first
