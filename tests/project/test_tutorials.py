"""The notebooks of the tutorials, which are run when the documentation is built: plain, listed, with captions."""

import json
import re

import pytest

DRAWS = re.compile(r"\.(?:plot|animate)\(|\bplt\.(?:figure|subplots)\(|^Image\(", re.MULTILINE)
HELPERS = re.compile(r"axes\.plot\(")  # of axes that the cell has made


@pytest.fixture(scope="module")
def notebooks(project):
    found = {file.name: file.read_text(encoding="utf-8") for file in (project / "docs" / "tutorials").glob("*.ipynb")}
    assert len(found) >= 8
    return found


def cells(text, kind):
    return ["".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == kind]


def test_every_notebook_is_in_the_navigation_once(notebooks, project):
    shown = re.findall(r": tutorials/(\S+\.ipynb)$", (project / "mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(shown) == sorted(notebooks)


def test_notebooks_are_kept_without_outputs_as_the_hook_writes_them(notebooks, project):
    """Nothing but text: no output, no count, no name of a machine; a change shows as a change of its lines."""
    for name, text in notebooks.items():
        notebook = json.loads(text)
        assert set(notebook) == {"cells", "metadata", "nbformat", "nbformat_minor"}, name
        assert notebook["metadata"] == {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        }, name
        for number, cell in enumerate(notebook["cells"], start=1):
            assert cell["id"] == f"cell-{number}", name
            assert cell["metadata"] == {}, name
            assert cell.get("outputs", []) == [], f"{name}: clear the outputs"
            assert cell.get("execution_count") is None, f"{name}: clear the outputs"
            assert isinstance(cell["source"], list), name


def test_notebooks_begin_with_a_title_and_check_numbers(notebooks):
    for name, text in notebooks.items():
        assert re.match(r"# \S.*\n\n", cells(text, "markdown")[0]), name
        assert json.loads(text)["cells"][0]["cell_type"] == "markdown", name
        assert sum("assert " in code for code in cells(text, "code")) >= 2, name
        assert "**Check 1" in text, name


def test_every_picture_has_a_caption(notebooks):
    for name, text in notebooks.items():
        for code in cells(text, "code"):
            if DRAWS.search(HELPERS.sub("", code)):
                assert re.match(r"#\| caption: \S.*\n", code), f"{name}: {code}"
