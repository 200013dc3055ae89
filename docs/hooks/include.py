"""Pages take parts of the repository's own texts: one source, no copy.

``<!-- include README.md -->`` stands for a whole file without its title, ``<!-- include README.md "Simulation" -->``
for what is under a heading (with ``only``: before the next heading of any level), and ``with files`` folds the pipeline
that a section is named after under it. Links between these texts lead to the pages that hold them.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[2]
INCLUDE = re.compile(r'^<!-- include (\S+?)(?: "(.+?)")?( only| with files)? -->$', re.MULTILINE)
LINK = re.compile(r"(?<!`)(!?)\[([^\]]*)\]\(([^)#\s]+)\)")
PAGES = {  # texts of the repository: the page that holds them
    "README.md": "index.md",
    "pipelines/README.md": "gallery.md",
    "src/modalprep/fe/README.md": "elements.md",
    "src/modalprep/formats/README.md": "formats.md",
    "src/modalprep/body/mass.py": "theory/body.md",
}


def on_files(files, config):
    """Add the pictures of the gallery to the site."""
    for picture in sorted((ROOT / "pipelines" / "pictures").glob("*.png")):
        files.append(File.generated(config, f"pictures/{picture.name}", abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Put the included texts in their places."""
    return INCLUDE.sub(lambda found: included(*found.groups(), page.file.src_uri), markdown)


def included(name, heading, how, page):
    """Return the text of a file, or of what is under a heading of it, with its links seen from a page."""
    text = (ROOT / name).read_text(encoding="utf-8")
    text = under(text, heading, name, how == " only") if heading else text.split("\n", 1)[1]
    text = LINK.sub(lambda found: _link(*found.groups(), posixpath.dirname(name), page), text)
    return _with_files(text, posixpath.dirname(name)) if how == " with files" else text


def under(text, heading, name="text", only=False):
    """Return what stands between a heading and the next of its level or above; `only`: the next of any level."""
    blank = re.sub(r"```.*?```", lambda code: re.sub(r"[^\n]", " ", code[0]), text, flags=re.DOTALL)
    begin = re.search(rf"^(#+) {re.escape(heading)}$", blank, re.MULTILINE)
    if begin is None:
        raise PluginError(f"{name} has no heading {heading!r}")
    level = 6 if only else len(begin[1])
    end = re.search(rf"^#{{1,{level}}} ", blank[begin.end() :], re.MULTILINE)
    return text[begin.end() + 1 : begin.end() + end.start() if end else None]


def _link(bang, label, target, folder, page):
    if "://" in target:
        return f"{bang}[{label}]({target})"
    path = posixpath.normpath(posixpath.join(folder, target))
    if bang:
        path = path.removeprefix("pipelines/")
    elif path in PAGES:
        path = PAGES[path]
    else:
        raise PluginError(f"{page} includes a link to {path}, which is on no page")
    return f"{bang}[{label}]({posixpath.relpath(path, posixpath.dirname(page) or '.')})"


def _with_files(text, folder):
    """Fold the file that each section is about under it."""

    def fold(found):
        file = ROOT / folder / f"{found[1]}.toml"
        if not file.exists():
            return found[0]
        lines = "\n".join(f"    {line}".rstrip() for line in file.read_text(encoding="utf-8").splitlines())
        return f'{found[0].rstrip()}\n\n??? note "{folder}/{file.name}"\n\n    ```toml\n{lines}\n    ```\n\n'

    return re.sub(r"^## (\S+)\n.*?(?=^## |\Z)", fold, text, flags=re.MULTILINE | re.DOTALL)
