"""The gallery: every shipped system has a card and a page, with a film, a strip for print and a time."""

import importlib.util
import json
import re
import tomllib

import pytest

LARGEST = 1.5e6  # bytes of a film


@pytest.fixture(scope="module")
def gallery(project):
    spec = importlib.util.spec_from_file_location("gallery", project / "docs" / "hooks" / "gallery.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def rows(gallery, project):
    return gallery.systems((project / "docs" / "gallery.md").read_text())


def test_every_pipeline_has_a_card_and_a_time(rows, project):
    names = sorted(file.stem for file in (project / "pipelines").glob("*.toml"))
    assert sorted(rows) == names
    assert sorted(json.loads((project / "pipelines" / "times.json").read_text())) == names


def test_every_card_moves(rows, project):
    for name in rows:
        film = project / "pipelines" / "pictures" / f"{name}.webp"
        assert film.stat().st_size < LARGEST, name
        with_table = "film" in tomllib.loads((project / "pipelines" / f"{name}.toml").read_text())
        assert film.with_name(f"{name}-strip.webp").exists() == with_table, name


def test_every_page_has_its_parts(gallery, rows, project):
    for name, sentence in rows.items():
        text = gallery.page_of(name, sentence)
        assert sentence in text
        for part in (f"{name}.webp){{ .film }}", "## What to look for", "## How long it takes", "It takes about "):
            assert part in text, f"{name}: {part}"
        for picture in re.findall(r"\.\./pictures/([\w.-]+)", text):
            assert (project / "pipelines" / "pictures" / picture).exists(), picture


def test_head_of_a_file_is_told_apart(gallery, tmp_path):
    file = tmp_path / "a.toml"
    file.write_text(
        "# A title.\n#\n# What it is,\n# in words.\n#\n# Source: a paper. Expected: 3 Hz\n# and < 4 kg.\n\na = 1\n# no"
    )
    title, about, source, expected = gallery.told_in(file)
    assert title == "A title."
    assert about == ["What it is,\nin words."]
    assert source == ["Source: a paper."]
    assert expected == ["Expected: 3 Hz\nand < 4 kg."]
    assert gallery._html(*expected) == "<p>Expected: 3 Hz\nand &lt; 4 kg.</p>"


def test_tables_become_cards(gallery, rows, project):
    text = gallery.TABLE.sub(gallery._cards, (project / "docs" / "gallery.md").read_text())
    assert text.count("<a href=") == len(rows)
    assert ".toml" not in text
