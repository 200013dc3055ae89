"""Tables of the command line's arguments and options, made from the application's own functions.

``<!-- options run -->`` stands for the table of a command, ``<!-- commands -->`` for the list of all.
"""

import inspect
import re
import types
from pathlib import Path
from typing import NamedTuple, Union, get_args, get_origin, get_type_hints

from typer.models import ArgumentInfo

import modalprep.cli.commands

OPTIONS = re.compile(r"^<!-- options (\S+) -->$", re.MULTILINE)
WORDS = {str: "text", int: "integer", float: "number", Path: "path", bool: ""}


class Parameter(NamedTuple):
    """An argument or option of a command."""

    name: str
    kind: type
    many: bool
    info: object
    default: object

    @property
    def positional(self):
        """Whether it has no name on the command line."""
        return isinstance(self.info, ArgumentInfo)

    @property
    def required(self):
        """Whether it must be given."""
        return self.default is inspect.Parameter.empty


def on_page_markdown(markdown, page, config, files):
    """Put the tables in their places."""
    found = commands()
    markdown = OPTIONS.sub(lambda mark: described(mark[1], found[mark[1]]), markdown)
    return markdown.replace("<!-- commands -->", listing(found))


def commands():
    """Return the functions of all commands by their names."""
    registered = modalprep.cli.commands.app.registered_commands
    return {command.name or command.callback.__name__: command.callback for command in registered}


def parameters(function):
    """Return the arguments and options of a command."""
    hints, found = get_type_hints(function, include_extras=True), []
    for name, parameter in inspect.signature(function).parameters.items():
        kind, info = get_args(hints[name])
        if get_origin(kind) in (Union, types.UnionType):
            kind = next(one for one in get_args(kind) if one is not type(None))
        many = get_origin(kind) is list
        found.append(Parameter(name, get_args(kind)[0] if many else kind, many, info, parameter.default))
    return found


def listing(functions):
    """Return a table of all commands."""
    rows = [f"| [`{name}`]({name}.md) | {_cell(_paragraphs(function)[0])} |" for name, function in functions.items()]
    return "\n".join(["| command | |", "|---|---|", *rows])


def described(name, function):
    """Return what a command does, how it is called, and the table of its arguments and options."""
    given = parameters(function)
    usage = " ".join(filter(None, ["modalprep", name, "[OPTIONS]" if given else "", *map(_usage, given)]))
    rows = [f"| {_names(p)} | {_value(p)} | {_default(p)} | {_cell(p.info.help)} |" for p in given]
    table = ["| | value | default | |", "|---|---|---|---|", *rows] if rows else ["It has no options."]
    return "\n\n".join([*map(_cell, _paragraphs(function)), f"    {usage}", "\n".join(table)])


def _paragraphs(function):
    return [" ".join(part.split()) for part in inspect.getdoc(function).split("\n\n")]


def _usage(parameter):
    if not parameter.positional:
        return ""
    name = parameter.name.upper() + ("..." if parameter.many else "")
    return name if parameter.required else f"[{name}]"


def _names(parameter):
    if parameter.positional:
        return f"`{parameter.name.upper()}`"
    declared = [text for text in (parameter.info.default, *(parameter.info.param_decls or ())) if isinstance(text, str)]
    option = parameter.name.replace("_", "-")
    both = [f"--{option}", f"--no-{option}"] if parameter.kind is bool else [f"--{option}"]
    return ", ".join(f"`{name}`" for name in declared or both)


def _value(parameter):
    return WORDS[parameter.kind] + (", repeated" if parameter.many else "")


def _default(parameter):
    if parameter.required:
        return "required"
    if parameter.default is True:
        return "yes"
    return "" if parameter.default in (None, False) else f"`{parameter.default}`"


def _cell(text):
    """Return a text with its bars, and brackets that look like links, as they are."""
    return re.sub(r"(?<![`\w])(\[[\w.]+\])", r"`\1`", text.replace("|", "\\|"))
