"""The built pages are read without a network: the build fails where one would load anything from elsewhere."""

import re
from pathlib import Path

from mkdocs.exceptions import PluginError

LOADED = (  # what a browser fetches by itself; links that a reader follows are not
    re.compile(r"<(?:script|img|iframe|source|audio|video|embed)\b[^>]*\bsrc=[\"']?((?:https?:)?//[^\"'\s>]+)", re.I),
    re.compile(r"<link\b(?![^>]*rel=[\"']?canonical)[^>]*\bhref=[\"']?((?:https?:)?//[^\"'\s>]+)", re.I),
    re.compile(r"@import\s*(?:url\()?[\"']?((?:https?:)?//[^\"')\s;]+)", re.I),
    re.compile(r"url\([\"']?((?:https?:)?//[^\"')]+)", re.I),
    re.compile(r"class=[\"']?mermaid\b()", re.I),  # the theme would fetch its renderer
)


def on_post_build(config):
    """Read every page and style sheet of the site."""
    for file in sorted(Path(config.site_dir).rglob("*")):
        if file.suffix in (".html", ".css"):
            for address in requests(file.read_text(encoding="utf-8")):
                raise PluginError(f"{file} would load {address or 'a renderer of diagrams'}; ship it with the site")


def requests(text):
    """List the addresses elsewhere that a page loads."""
    return [found[1] for pattern in LOADED for found in pattern.finditer(text)]
