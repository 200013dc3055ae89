"""Every table and key of a pipeline file, made from its JSON schema: ``<!-- schema -->``."""

import json

from modalprep.pipeline.schema.pipeline import Pipeline

MARK = "<!-- schema -->"
BOUNDS = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
WORDS = {"string": "text", "number": "number", "integer": "integer", "boolean": "true or false"}


def on_page_markdown(markdown, page, config, files):
    """Put the reference in its place."""
    return markdown.replace(MARK, reference(Pipeline.model_json_schema())) if MARK in markdown else markdown


def reference(schema):
    """Return a section for each table of the file; a table inside others is described where it is first met."""
    tables, told, lines = schema["$defs"], set(), []
    plain = {k: v for k, v in schema["properties"].items() if v.get("type") != "object" and not _refs(v)}
    lines += ["## Keys without a table { #top }", "", *_rows(plain, set()), ""]
    for key, value in schema["properties"].items():
        if key not in plain:
            lines += _section(key, value, tables, told)
    return "\n".join(lines)


def _section(key, value, tables, told):
    """Describe a table of the file, then the tables that its keys hold."""
    refs = _refs(value)
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
        lines += [f"A {_kind(value)}.", ""]
    waiting = [*refs]
    while waiting:
        ref = waiting.pop(0)
        waiting = [*_refs(tables[ref]["properties"]), *waiting] if ref not in told or ref in refs else waiting
        waiting = [other for k, other in enumerate(waiting) if other not in told and other not in waiting[:k]]
        if ref not in told:
            told.add(ref)
            lines += [f"### {_title(ref, tables[ref])} {{ #{ref} }}", "", *_body(tables[ref])]
    return lines


def _body(table):
    text = table.get("description", "").split("\n\nExamples")[0]
    return [text, "", *_rows(table["properties"], set(table.get("required", []))), ""]


def _rows(properties, required):
    rows = [
        f"| `{key}` | {_kind(value)} | {'required' if key in required else _default(value)} "
        f"| {_cell(value.get('description', ''))} |"
        for key, value in properties.items()
    ]
    return ["| key | value | default | |", "|---|---|---|---|", *rows]


def _title(ref, table):
    """Name a table inside another: by what its `type` must be, or by its own name."""
    kind = table["properties"].get("type", {})
    if "const" in kind:
        return f'`type = "{kind["const"]}"`'
    return _word(ref)


def _word(ref):
    name = ref.split("__")[-1].removesuffix("Table")
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name).strip()


def _link(ref):
    return f"[{_word(ref)}](#{ref})"


def _refs(value):
    """List the tables that a schema names, in order, each once."""
    if isinstance(value, dict):
        own = [value["$ref"].split("/")[-1]] if "$ref" in value else []
        inner = [ref for key, part in value.items() if key != "discriminator" for ref in _refs(part)]
        return list(dict.fromkeys(own + inner))
    return list(dict.fromkeys(ref for part in value for ref in _refs(part))) if isinstance(value, list) else []


def _kind(value):
    """Say what a value may be."""
    if "$ref" in value:
        return _link(value["$ref"].split("/")[-1])
    for key in ("anyOf", "oneOf"):
        if key in value:
            return " or ".join(dict.fromkeys(_kind(part) for part in value[key] if part.get("type") != "null"))
    if "const" in value or "enum" in value:
        return ", ".join(f"`{json.dumps(one)}`" for one in value.get("enum", [value.get("const")]))
    if value.get("type") == "array":
        return _list(value)
    if value.get("type") == "object":
        inner = value.get("additionalProperties")
        return f"table of {_kind(inner)}" if isinstance(inner, dict) else "table"
    bounds = [f"{word} {value[key]:g}" for key, word in BOUNDS.items() if key in value]
    return " ".join([WORDS.get(value.get("type"), "any value"), " and ".join(bounds)]).strip()


def _list(value):
    least, most, item = value.get("minItems"), value.get("maxItems"), _kind(value.get("items", {}))
    item = f"{item}s" if item in WORDS.values() else f"({item})" if " or " in item else item
    return f"list of {item}" if least is None or least != most else f"{least} {item}"


def _default(value):
    default = value.get("default")
    return "" if default in (None, {}, []) or isinstance(default, dict) else f"`{_cell(json.dumps(default))}`"


def _cell(text):
    return text.replace("|", "\\|").replace("[[", "\\[[").replace("*", "\\*")


def _sentence(text):
    return text[0].upper() + text[1:].rstrip(".") + "."
