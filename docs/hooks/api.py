"""Public names by package, and links from their docstrings to the theory.

``<!-- api fe linalg -->`` stands for the public names that live in these packages, ``<!-- names a.b.c a.b.d -->`` for
the names given. "theory 5.2" in a docstring becomes a link.
"""

import posixpath
import re

from mkdocs.exceptions import PluginError

from modalprep.lazy import public_homes

PACKAGES = re.compile(r"^<!-- api (.+) -->$", re.MULTILINE)
NAMES = re.compile(r"^<!-- names (.+) -->$", re.MULTILINE)
HEADING = re.compile(r"^#+ (\d+(?:\.\d+)?) .*\{ ?#(\S+) ?\}$", re.MULTILINE)
CITATION = re.compile(r"\b([Tt]heory\s+)((?:\d+(?:\.\d+)?)(?:(?:, | and | to )\d+(?:\.\d+)?)*)")
FOUND = {}


def on_files(files, config):
    """Collect the numbered sections of the theory."""
    FOUND.clear()
    for file in files.documentation_pages():
        if file.src_uri.startswith("theory/"):
            FOUND.update({number: f"{file.url}#{anchor}" for number, anchor in HEADING.findall(file.content_string)})
    return files


def on_page_markdown(markdown, page, config, files):
    """Write the names out for mkdocstrings."""
    markdown = PACKAGES.sub(lambda found: _entries(public(found[1].split())), markdown)
    return NAMES.sub(lambda found: _entries(f"modalprep.{name}" for name in found[1].split()), markdown)


def on_page_content(content, page, config, files):
    """Link what docstrings cite."""
    if not page.file.src_uri.startswith("api/"):
        return content
    return CITATION.sub(lambda found: found[1] + _linked(found[2], posixpath.dirname(page.file.url)), content)


def public(packages):
    """Return the full names of the public names that live in some packages, in the order of the package's list."""
    homes = [(name.rpartition(".")[2], home) for name, home in public_homes().items()]
    return [f"{home}.{name}" for name, home in homes if home.split(".")[1] in packages]


def _entries(names):
    return "\n\n".join(f"::: {name}" for name in names)


def _linked(numbers, folder):
    def link(found):
        if found[0] not in FOUND:
            raise PluginError(f"a docstring cites theory {found[0]}, which is on no page of docs/theory")
        target, anchor = FOUND[found[0]].split("#")
        return f'<a href="{posixpath.relpath(target, folder)}#{anchor}">{found[0]}</a>'

    return re.sub(r"\d+(?:\.\d+)?", link, numbers)
