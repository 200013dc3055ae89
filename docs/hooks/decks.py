"""Tables of what is read of each format of decks, made from the registries of the readers: ``<!-- decks -->``."""

from modalprep.fe.readers.registries import REGISTRIES

MARK = "<!-- decks -->"
HEADINGS = {
    "read": "Read",
    "approximated": "Read with a difference",
    "refused": "Refused, unless the deck's keyword is ignored",
    "no effect": "Without effect on the model",
}


def on_page_markdown(markdown, page, config, files):
    """Put the tables in their place."""
    return markdown.replace(MARK, tables()) if MARK in markdown else markdown


def tables():
    """Return a section for each format, and in it a table for each treatment."""
    lines = []
    for name, registry in REGISTRIES.items():
        lines += [f"## {name}", ""]
        for treatment, heading in HEADINGS.items():
            rows = _rows({key: entry for key, entry in registry.items() if entry.treatment == treatment})
            if rows:
                lines += [f"**{heading}**", "", "| keyword | |", "|---|---|", *rows, ""]
    return "\n".join(lines)


def _rows(entries):
    """One row for each remark, with the keywords that share it."""
    found = {}
    for key, entry in entries.items():
        found.setdefault(entry.remark, []).append(f"`{key}`")
    return [f"| {', '.join(keys)} | {remark.replace('|', chr(92) + '|')} |" for remark, keys in found.items()]
