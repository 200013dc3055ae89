"""The gallery: a card and a page for each pipeline file that ``gallery.md`` lists.

A row of a table there, ``| [NAME](../pipelines/NAME.toml) | what to look for |``, becomes a card; its page
has the film, a strip of it for print, the text at the head of the file, the time that a run takes, and the file.
"""

import html
import json
import re
from pathlib import Path

from mkdocs.structure.files import File

PIPELINES = Path(__file__).parents[2] / "pipelines"
ROW = re.compile(r"^\| \[([\w-]+)\]\(\.\./pipelines/\1\.toml\) \| (.+) \|$", re.MULTILINE)
TABLE = re.compile(r"^\| system \| \|\n\|---\|---\|\n((?:\| \[.*\|\n)+)", re.MULTILINE)
STEPS = (1, 2, 3, 5, 7, 10, 15, 20, 30, 45, 60, 90, 120, 180, 240, 300, 600)  # s


def on_files(files, config):
    """Add the pages."""
    for name, sentence in systems((Path(config.docs_dir) / "gallery.md").read_text(encoding="utf-8")).items():
        files.append(File.generated(config, f"gallery/{name}.md", content=page_of(name, sentence)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Turn the tables of the gallery into cards."""
    return TABLE.sub(_cards, markdown) if page.file.src_uri == "gallery.md" else markdown


def systems(text):
    """Return what to look for in each system, by its name, in the order of the page."""
    return dict(ROW.findall(text))


def page_of(name, sentence):
    """Return the page of a system."""
    title, about, source, expected = told_in(PIPELINES / f"{name}.toml")
    parts = [f"# {name}", _html(title), *(_picture(name, *kind) for kind in KINDS), *map(_html, about)]
    parts += ["## What to look for", sentence, *map(_html, expected), _picture(name, ".png", "", "its plot")]
    parts += ["## How long it takes", duration(name)]
    parts += ["## Where its numbers come from", *map(_html, source)] if source else []
    parts += ["## The file", f'```toml\n--8<-- "pipelines/{name}.toml"\n```', "[All systems](../gallery.md)"]
    return "\n\n".join(part for part in parts if part)


KINDS = ((".webp", ".film", "in motion"), ("-strip.webp", ".strip", "in motion, frame by frame"))


def told_in(file):
    """Return the title, the description, the source of the numbers and what is expected, of a file's head."""
    head = re.match(r"(?:#.*\n)*", file.read_text(encoding="utf-8"))[0]
    lines = [line.removeprefix("#").removeprefix(" ") for line in head.splitlines()]
    title, *paragraphs = re.split(r"\n\s*\n", "\n".join(lines).strip())
    title, _, rest = title.partition("\n")
    text = "\n\n".join([rest, *paragraphs]) if rest else "\n\n".join(paragraphs)
    text, mark, expected = _split(text, r"\bExpected\b")
    about, begin, source = _split(text, r"^(?:Source|Data)\b")
    return title, _paragraphs(about), _paragraphs(begin + source), _paragraphs(mark + expected)


def _split(text, mark):
    """Return the text before the mark, the mark, and the rest."""
    found = re.search(mark, text, re.MULTILINE)
    return (text[: found.start()], found[0], text[found.end() :]) if found else (text, "", "")


def _paragraphs(text):
    return [part for part in re.split(r"\n\s*\n", text.strip()) if part]


def duration(name):
    """Return how long a run takes, in a round number of seconds."""
    seconds = json.loads((PIPELINES / "times.json").read_text(encoding="utf-8"))[name]
    near = min(STEPS, key=lambda step: abs(step / seconds - 1))
    shown = f"{near} s" if near < 90 else f"{near // 60} minutes" if near != 90 else "one and a half minutes"
    return f"    modalprep run pipelines/{name}.toml\n\nIt takes about {shown}."


def _html(text):
    """Return plain text as a paragraph: formulas have asterisks, brackets and lines of their own."""
    text = re.sub(r"^ {4}(.+)$", r"<br>\1<br>", html.escape(text), flags=re.MULTILINE)
    return "<p>" + re.sub(r"`+([^`]+)`+", r"<code>\1</code>", text) + "</p>"


def _picture(name, ending, kind, words):
    if not (PIPELINES / "pictures" / f"{name}{ending}").exists():
        return ""
    return f"![{name}, {words}](../pictures/{name}{ending})" + (f"{{ {kind} }}" if kind else "")


def _cards(table):
    return "\n".join(['<div class="films">', *(_card(*row) for row in ROW.findall(table[1])), "</div>", ""])


def _card(name, sentence):
    film = f'<img src="pictures/{name}.webp" alt="{name} in motion" loading="lazy">'
    return f'<a href="gallery/{name}.html">{film}<span><b>{name}</b><br>{html.escape(sentence)}</span></a>'
