"""Every table and key of a pipeline file, made from its JSON schema: ``<!-- schema -->``."""

from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.report.schema_tables import Style, keys_of, kind_of, table_word, tables_named_in

MARK = "<!-- schema -->"


def on_page_markdown(markdown, page, config, files):
    """Put the reference in its place."""
    return markdown.replace(MARK, reference(Pipeline.model_json_schema())) if MARK in markdown else markdown


def reference(schema):
    """Return a section for each table of the file; a table inside others is described where it is first met."""
    tables, told, lines = schema["$defs"], set(), []
    plain = {k: v for k, v in schema["properties"].items() if v.get("type") != "object" and not tables_named_in(v)}
    lines += ["## Keys without a table { #top }", "", *_rows({"properties": plain}), ""]
    for key, value in schema["properties"].items():
        if key not in plain:
            lines += _section(key, value, tables, told)
    return "\n".join(lines)


def _section(key, value, tables, told):
    """Describe a table of the file, then the tables that its keys hold."""
    refs = tables_named_in(value)
    name = f"[[{key}]]" if value.get("type") == "array" else f"[{key}]"
    name = f"[{key}.NAME]" if "additionalProperties" in value else name
    lines = [f"## `{name}` {{ #{key} }}", ""]
    if value.get("description"):
        lines += [f"{_sentence(value['description'])}", ""]
    if len(refs) == 1 and refs[0] not in told:
        told.add(refs[0])
        lines += [f'<a id="{refs[0]}"></a>', "", *_body(tables[refs[0]])]
    elif refs:
        lines += [" or ".join(f"[{_title(ref, tables[ref])}](#{ref})" for ref in refs), ""]
    else:
        lines += [f"A {kind_of(value, STYLE)}.", ""]
    waiting = [*refs]
    while waiting:
        ref = waiting.pop(0)
        waiting = [*tables_named_in(tables[ref]["properties"]), *waiting] if ref not in told or ref in refs else waiting
        waiting = [other for k, other in enumerate(waiting) if other not in told and other not in waiting[:k]]
        if ref not in told:
            told.add(ref)
            lines += [f"### {_title(ref, tables[ref])} {{ #{ref} }}", "", *_body(tables[ref])]
    return lines


def _body(table):
    text = table.get("description", "").split("\n\nExamples")[0]
    return [text, "", *_rows(table), ""]


def _rows(table):
    rows = [f"| `{key.name}` | {key.kind} | {_default(key)} | {_cell(key.meaning)} |" for key in keys_of(table, STYLE)]
    return ["| key | value | default | |", "|---|---|---|---|", *rows]


def _title(ref, table):
    """Name a table inside another: by what its `type` must be, or by its own name."""
    kind = table["properties"].get("type", {})
    if "const" in kind:
        return f'`type = "{kind["const"]}"`'
    return table_word(ref)


def _link(ref):
    return f"[{table_word(ref)}](#{ref})"


def _default(key):
    return key.default if key.default in ("", "required") else f"`{_cell(key.default)}`"


def _cell(text):
    return text.replace("|", "\\|").replace("[[", "\\[[").replace("*", "\\*")


def _sentence(text):
    return text[0].upper() + text[1:].rstrip(".") + "."


STYLE = Style(_link, "`{}`".format)
