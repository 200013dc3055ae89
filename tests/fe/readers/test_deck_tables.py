"""The table of keywords in the reference is the registry of the readers, and the readers work by it."""

import importlib.util

import pytest

import modalprep as mp
from modalprep.fe.readers.abaqus.elements import type_of
from modalprep.fe.readers.abaqus.registry import IN_STEPS, REGISTRY, STAGES
from modalprep.fe.readers.registries import REGISTRIES

BAR = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*ELEMENT, TYPE=T3D2, ELSET=bar\n1, 1, 2\n"


@pytest.fixture(scope="module")
def hook(project):
    spec = importlib.util.spec_from_file_location("decks", project / "docs" / "hooks" / "decks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_has_every_keyword_once_with_its_treatment(hook, project):
    page = hook.on_page_markdown((project / "docs" / "reference" / "decks.md").read_text(), None, None, None)
    assert hook.MARK not in page
    for name, registry in REGISTRIES.items():
        section = page.split(f"## {name}\n")[1].split("\n## ")[0]
        for treatment, heading in hook.HEADINGS.items():
            rows = section.partition(f"**{heading}**")[2].partition("\n**")[0]
            own = [key for key, entry in registry.items() if entry.treatment == treatment]
            assert [key for key in own if f"`{key}`" not in rows] == []
            assert rows.count("`") == 2 * len(own)


def test_every_keyword_that_is_read_has_its_reader():
    """Except those that frame the others, and the types of elements, which one function reads."""
    frames = {"INCLUDE", "PART", "END PART", "INSTANCE", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY"}
    read = {key for key, entry in REGISTRY.items() if entry.treatment in ("read", "approximated")}
    handled = {key for stage in (*STAGES, IN_STEPS) for key, entry in stage.items() if entry.handle}
    assert {key for key in read - frames if not key.startswith("ELEMENT, TYPE=")} <= handled


@pytest.mark.parametrize("key", [k for k, e in REGISTRY.items() if e.treatment == "refused"])
def test_what_the_page_calls_refused_is_refused_and_can_be_ignored(key, tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(f"{BAR}*{key}\n7, 1, 2\n" if "TYPE" in key else f"{BAR}*{key}\n")
    with pytest.raises(mp.InputError, match=r"line 6|line 7"):
        mp.read_mesh(path)
    assert mp.read_mesh(path, ignore=[f"*{key}"]).notes == (f"ignored: 1 *{key}",)


@pytest.mark.parametrize("key", [k for k, e in REGISTRY.items() if e.treatment == "no effect" and "TYPE" not in k])
def test_what_the_page_calls_without_effect_is_read_over(key, tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(f"{BAR}*{key}\n")
    mesh = mp.read_mesh(path)
    assert (mesh.cells["line"].tolist(), mesh.properties, mesh.links) == ([[0, 1]], {}, ())


@pytest.mark.parametrize("key", [k for k in REGISTRY if k.startswith("ELEMENT, TYPE=")])
def test_every_type_of_the_page_is_one_of_the_reader(key):
    names = key.partition("=")[2].split(", ")
    refused = REGISTRY[key].treatment == "refused"
    assert [name for name in names if (type_of(name) is None) != refused] == []
    assert refused or all(type_of(name).entry is REGISTRY[key] for name in names)


@pytest.mark.parametrize("name", ["*TEI", "*ELEMENT, TYPE=S4"])
def test_a_keyword_to_ignore_must_be_there(name, tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(BAR + "*TIE\n")
    with pytest.raises(mp.InputError, match="has no '.*' to ignore"):
        mp.read_mesh(path, ignore=[name])


def test_only_decks_have_keywords_to_ignore(project):
    with pytest.raises(mp.InputError, match="'ignore' names keywords of decks"):
        mp.read_mesh(project / "meshes" / "beam.msh", ignore=["*TIE"])


def test_a_format_that_is_not_known_is_called_that(tmp_path):
    path = tmp_path / "beam.foo"
    path.write_text("whatever")
    with pytest.raises(mp.InputError, match=r"the format '.foo' is not known; known are .*\.inp"):
        mp.read_mesh(path)
