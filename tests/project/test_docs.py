"""The documentation: what docstrings cite is there, what pages show is so."""

import importlib
import re
import shutil

import numpy as np
import pytest

from modalprep.cli import main
from modalprep.cli.commands import app
from modalprep.compiler.switch import how_long
from modalprep.lazy import public_homes
from modalprep.pipeline.console import COMPILING
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.report.pictures.render import drawing_problem

NUMBERS = r"\d+(?:\.\d+)?(?:(?:, | and | to )\d+(?:\.\d+)?)*"
PAPERS = re.compile(r"\b(?:FORMULATION|ORDER_N|STYLE\.md|DESIGN\.md|FE\.md|FORMATS\.md|CASES \d)")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
ROUND_OFF = 1e-6  # residuals of checks: any value below it will do
DIGITS = 2e-2  # what solvers of other machines may change in printed values


def source(project):
    return {file: file.read_text() for file in sorted((project / "src").rglob("*.py"))}


def sections(project):
    heading = re.compile(r"^#+ (\d+(?:\.\d+)?) .*\{ #s\S+ \}$", re.MULTILINE)
    pages = [file.read_text() for file in (project / "docs" / "theory").glob("*.md")]
    return {number for page in pages for number in heading.findall(page)}


def test_every_cited_section_exists(project):
    known, cited = sections(project), 0
    for file, text in source(project).items():
        for numbers in re.findall(rf"\b[Tt]heory ({NUMBERS})", " ".join(text.split())):
            for number in re.findall(r"\d+(?:\.\d+)?", numbers):
                assert number in known, f"{file} cites theory {number}"
                cited += 1
    assert cited > 30


def test_docstrings_cite_nothing_that_users_lack(project):
    for file, text in source(project).items():
        assert not PAPERS.findall(text), file


def test_equations_are_numbered_by_their_chapter(project):
    for file in (project / "docs" / "theory").glob("*.md"):
        text = file.read_text()
        chapter = re.search(r"^# (\d+) ", text, re.MULTILINE)
        tags = re.findall(r"\\tag\{([\d.]+)\}", text)
        assert tags == [f"{chapter[1] if chapter else ''}.{k}" for k in range(1, len(tags) + 1)], file
        for number in re.findall(r"\((\d\.\d)\)", text):
            assert any(f"tag{{{number}}}" in page.read_text() for page in file.parent.glob("*.md")), number


def test_every_command_has_its_page(project):
    names = {command.name or command.callback.__name__ for command in app.registered_commands}
    pages = {file.stem for file in (project / "docs" / "commands").glob("*.md")} - {"index"}
    assert pages == names
    for name in names:
        assert f"<!-- options {name} -->" in (project / "docs" / "commands" / f"{name}.md").read_text()


def test_every_public_name_is_on_one_page(project):
    listed = []
    for page in (project / "docs" / "api").glob("*.md"):
        listed += [package for line in re.findall(r"<!-- api (.+) -->", page.read_text()) for package in line.split()]
    assert sorted(listed) == sorted({home.split(".")[1] for home in public_homes().values()})


def test_names_of_pages_are_defined_where_they_say(project):
    """As ``<!-- names pipeline.run.run_pipeline -->``: in that file, not imported there."""
    lists = [found for page in (project / "docs" / "api").glob("*.md")
             for found in re.findall(r"^<!-- names (.+) -->$", page.read_text(), re.MULTILINE)]  # fmt: skip
    assert lists
    for dotted in " ".join(lists).split():
        module, _, name = f"modalprep.{dotted}".rpartition(".")
        assert getattr(importlib.import_module(module), name).__module__ == module, dotted


def test_every_page_is_in_the_navigation(project):
    shown = set(re.findall(r"(?:: |- )(\S+\.md)$", (project / "mkdocs.yml").read_text(), re.MULTILINE))
    docs = project / "docs"
    assert shown == {str(file.relative_to(docs)) for file in docs.rglob("*.md")}


@pytest.mark.parametrize("page", ["element", "joint", "force-element", "format", "reader", "analysis", "table"])
def test_how_to_names_files_that_exist(page, project):
    text = (project / "docs" / "how-to" / f"{page}.md").read_text()
    tests = [file.name for file in (project / "tests").rglob("*.py")]
    for name in re.findall(r"`([\w/.]+\.(?:py|md))`", text):
        found = (project / name).exists() or (project / "src" / "modalprep" / name).exists() or name in tests
        assert found, name


def test_how_to_names_what_the_code_has(project):
    """Capital names in backquotes and the functions beside their files."""
    tests = (file.read_text() for file in (project / "tests").rglob("*.py"))
    c = (file.read_text() for file in (project / "src").rglob("*.[ch]"))
    words = set(re.findall(r"\w+", "\n".join([*source(project).values(), *c, *tests])))
    for page in (project / "docs" / "how-to").glob("*.md"):
        for name in re.findall(r"`(_?[A-Za-z]\w+)`", page.read_text()):
            assert name in words, f"{page.name}: {name}"


def equation_rows(project):
    """Return (sections, files, tests) of each row of the table of equations."""
    text = (project / "docs" / "architecture.md").read_text().split("## Equations, files, tests")[1]
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| [")]
    return [(row[0], *(re.findall(r"`([\w/.]+\.py)`", cell) for cell in row[2:])) for row in rows]


def test_architecture_names_files_that_exist(project):
    rows = equation_rows(project)
    assert len(rows) > 40
    for sections, files, tests in rows:
        assert files, sections
        assert tests, sections
        for name in files:
            assert (project / "src" / "modalprep" / name).exists(), name
        for name in tests:
            assert (project / "tests" / name).exists(), name
            assert (project / "tests" / name).name.startswith("test_"), name


def test_architecture_has_every_equation(project):
    """Each section of the theory that has a numbered equation is in a row, with a link that leads there."""
    cited = "".join(sections for sections, _, _ in equation_rows(project))
    known = set()
    for file in (project / "docs" / "theory").glob("*.md"):
        for number, anchor, body in re.findall(
            r"^## (\d+\.\d+) [^\n]*\{ #(\S+) \}$(.*?)(?=^## |\Z)", file.read_text(), re.MULTILINE | re.DOTALL
        ):
            known.add(f"theory/{file.name}#{anchor}")
            if "\\tag{" in body:
                assert f"[{number}](theory/{file.name}#{anchor})" in cited, number
    assert set(re.findall(r"\]\((\S+?)\)", cited)) <= known


def test_architecture_has_every_layer(project):
    """Its packages, and the folders of two of them, in the order that the imports hold to."""
    text = (project / "docs" / "architecture.md").read_text()
    first = re.findall(r"^\| `(\w+)` \| [^|]+ \| [^|]+ \|$", text.split("## What flows")[0], re.MULTILINE)
    packages = {path.parent.name for path in (project / "src" / "modalprep").glob("*/__init__.py")}
    assert set(first) == packages
    for package in ("fe", "multibody"):
        for folder in (project / "src" / "modalprep" / package).glob("*/__init__.py"):
            assert f"`{folder.parent.name}`" in text, folder


COMMANDS = sorted(command.name or command.callback.__name__ for command in app.registered_commands)


@pytest.fixture(scope="module")
def checkout(project, tmp_path_factory):
    """A folder with meshes, pipelines, and the body that most examples are about."""
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "meshes").symlink_to(project / "meshes")
    (folder / "pipelines").mkdir()
    for file in (project / "pipelines").glob("*.toml"):
        shutil.copy(file, folder / "pipelines")
    assert main(["run", str(folder / "pipelines" / "half-beam.toml"), "--json"]) == 0
    return folder


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_print_what_pages_show(name, project, checkout, monkeypatch, capsys):
    if name == "render" and drawing_problem():
        pytest.skip(f"cannot draw: {drawing_problem()}")
    monkeypatch.chdir(checkout)
    text = (project / "docs" / "commands" / f"{name}.md").read_text()
    for file, block in re.findall(r'```toml title="(\S+)"\n(.*?)```', text, re.DOTALL):
        (checkout / file).write_text(block)
    shown = re.search(r"```console\n(.*?)```", text, re.DOTALL)
    assert shown or name == "warmup"  # which compiles for minutes
    for command, output in re.findall(r"\$ modalprep (.*)\n((?:(?!\$ ).*\n)*)", shown[1] if shown else ""):
        capsys.readouterr()
        assert main(command.split()) == 0
        printed = capsys.readouterr().out.replace(f"{COMPILING}{how_long()}", "")
        assert agrees(output, printed), f"modalprep {command} prints\n{printed}"


def agrees(shown, printed):
    """Say whether an output is the one shown, in which a line ``...`` stands for any number of lines."""
    first, *parts = [tokens(part) for part in re.split(r"^\.\.\.$", shown, flags=re.MULTILINE)]
    printed, at = tokens(printed), len(first)
    if not same(first, printed[:at]):
        return False
    for part in parts[:-1]:
        ends = range(at + len(part), len(printed) + 1)
        at = next((end for end in ends if same(part, printed[end - len(part) : end])), len(printed) + 1)
    last = parts[-1] if parts else []
    start = len(printed) - len(last)
    return (start >= at if parts else start == at) and same(last, printed[start:])


def tokens(text):
    """Words of an output, without rules and times."""
    return re.sub(r"\b\d+(\.\d+)? s\b", "SECONDS", text.replace("─", " ")).split()


def same(shown, printed):
    """Say whether the words are the same, and their numbers close."""
    shown, printed = " ".join(shown), " ".join(printed)
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    a, b = (np.array(NUMBER.findall(text), dtype=float) for text in (shown, printed))
    return bool(np.all((np.maximum(abs(a), abs(b)) < ROUND_OFF) | (abs(a - b) <= DIGITS * abs(a))))


def test_examples_are_told_apart():
    shown = "a 1.00 x\n...\nb 2.0\n"
    assert agrees(shown, "a 1.01 x\nc\nd\nb 2.0\n")
    assert agrees("steps 3\nerror 1e-12\n", "steps 3\nerror 7e-15\n")
    assert not agrees("a\n...\nb\n...\n", "a\nc\n")
    for wrong in ("a 1.00 x\nb 3.0\n", "a 1.00 y\nb 2.0\n", "a 1.00 x\nb 2.0\nc\n", "b 2.0\n", "a 1.00 x\n"):
        assert not agrees(shown, wrong), wrong


TABLE_ROW = re.compile(r"\| ((?:`\[\[?[\w.]+\]?\]`,? ?)+)\| (.*)")


def keys_of(node, definitions, inside=()):
    """Yield the keys of a table of the JSON schema, those of its inner tables, and the words that they may have."""
    name = node.get("$ref", "").rpartition("/")[2]
    if name and name not in inside:
        yield from keys_of(definitions[name], definitions, (*inside, name))
    for key, inner in node.get("properties", {}).items():
        yield key
        yield from keys_of(inner, definitions, inside)
    yield from map(str, [*node.get("enum", ()), *([node["const"]] if "const" in node else [])])
    several = [inner for kind in ("anyOf", "oneOf", "allOf", "prefixItems") for inner in node.get(kind, ())]
    single = [node[kind] for kind in ("items", "additionalProperties") if isinstance(node.get(kind), dict)]
    for inner in (*several, *single):
        yield from keys_of(inner, definitions, inside)


def test_tables_of_the_reference_name_keys_that_exist(project):
    """Rows such as "| `[joints.X]` | `stiffness`, ... |": the keys `rest` and `law` were there, which nobody reads."""
    schema = Pipeline.model_json_schema()
    rows = [found for page in (project / "docs" / "reference").glob("*.md")
            for line in page.read_text().splitlines() if (found := TABLE_ROW.match(line))]  # fmt: skip
    assert len(rows) > 15
    for row in rows:
        tables = [name.split(".")[0] for name in re.findall(r"\[\[?([\w.]+)\]", row[1])]
        known = {key for name in tables for key in keys_of(schema["properties"][name], schema["$defs"])}
        assert set(re.findall(r"`([A-Za-z_]\w*)`", row[2])) <= known, row[0]
