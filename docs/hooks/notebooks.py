"""The notebooks of the tutorials are run, and become pages that show what they print and draw.

One kernel runs them all, and forgets the variables of each. A cell that fails or warns fails the build; what
modalprep says of a result, its own warnings, is shown. A notebook that
was run before with the same program, meshes and pipelines is taken from `build/notebooks`.

`python docs/hooks/notebooks.py NAME.ipynb ...` takes the outputs out of notebooks, as they are kept in the repository.
"""

import hashlib
import json
import os
import re
import shutil
import sys
from base64 import b64decode
from html import escape
from pathlib import Path

import nbformat
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

ROOT = Path(__file__).parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
CACHE = ROOT / "build" / "notebooks"
PROGRAM = ("src/**/*.py", "meshes/*", "pipelines/*.toml")
FRESH = """%reset -f
%config InlineBackend.figure_formats = ["retina"]
import pyvista
pyvista.set_jupyter_backend("static")
del pyvista
"""
CAPTION = re.compile(r"#\| caption: (.+)\n")
DATA_URI = re.compile(r'<img src="data:image/(\w+);base64,([\w+/=]+)"[^>]*>')
COLOURS = re.compile(r"\x1b\[[\d;?]*\w")  # of terminals
WARNING = re.compile(r"^\S+:\d+: (ModalprepWarning: .*)\n(?:  .*\n)?", re.MULTILINE)  # the line of the code below
STYLE = re.compile(r"<style.*?</style>", re.DOTALL)
SIZED = re.compile(r'<table border="1" class="dataframe"')


class Notebook(File):
    """A notebook among the files of the site, whose page has its outputs."""

    def is_documentation_page(self):
        """Make a page of it."""
        return True


def on_files(files, config):
    """Put pages, pictures and the notebooks themselves among the files."""
    sources = {path.stem: path.read_text(encoding="utf-8") for path in sorted(TUTORIALS.glob("*.ipynb"))}
    for name, notebook in executed(sources).items():
        text, pictures = page(name, notebook)
        files.remove(files.get_file_from_path(f"tutorials/{name}.ipynb"))
        files.append(Notebook.generated(config, f"tutorials/{name}.ipynb", content=text))
        files.append(File.generated(config, f"tutorials/notebooks/{name}.ipynb", content=sources[name]))
        for file, data in pictures.items():
            files.append(File.generated(config, f"tutorials/{file}", content=data))
    return files


def executed(sources):
    """Return notebooks with their outputs, those that are not in the cache from one kernel."""
    found = {name: CACHE / f"{name}-{_digest(source)}.ipynb" for name, source in sources.items()}
    waiting = [name for name, file in found.items() if not file.exists()]
    if waiting:
        CACHE.mkdir(parents=True, exist_ok=True)
        for name, notebook in _run({name: sources[name] for name in waiting}):
            nbformat.write(notebook, found[name])
    return {name: nbformat.read(file, 4) for name, file in found.items()}


def _digest(source):
    whole = hashlib.sha256((source + FRESH).encode())
    for file in sorted(file for pattern in PROGRAM for file in ROOT.glob(pattern) if file.is_file()):
        whole.update(file.read_bytes())
    return whole.hexdigest()[:16]


def _run(sources):
    """Yield each notebook after its last cell."""
    commands = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # those of this environment
    environment = {**os.environ, "PATH": commands, "PYDEVD_DISABLE_FILE_VALIDATION": "1"}  # no hint for debuggers
    environment |= {"TERM": "dumb", "COLUMNS": "100"}  # of commands that cells run
    options = {"timeout": 600, "extra_arguments": ["--log-level=ERROR"], "resources": {"metadata": {"path": TUTORIALS}}}
    client = NotebookClient(nbformat.v4.new_notebook(), **options)
    shutil.rmtree(TUTORIALS / "output", ignore_errors=True)
    with client.setup_kernel(env=environment):
        for name, source in sources.items():
            notebook = nbformat.reads(source, 4)
            notebook.cells.insert(0, nbformat.v4.new_code_cell(FRESH))
            client.nb = notebook
            try:
                for number, cell in enumerate(notebook.cells):
                    client.execute_cell(cell, number)
            except CellExecutionError as error:
                raise PluginError(f"docs/tutorials/{name}.ipynb: {COLOURS.sub('', str(error))}") from None
            del notebook.cells[0]
            yield name, notebook


def page(name, notebook):
    """Return the Markdown of a notebook and its pictures by their places, relative to the page."""
    parts, pictures = [], {}
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        caption = CAPTION.match(cell.source)
        parts.append(f"```python\n{CAPTION.sub('', cell.source)}\n```")
        for output in _joined(cell.outputs):
            parts.append(_shown(output, name, caption and caption[1], pictures))
    title, *rest = parts[0].split("\n", 1)
    link = f"*This page is a notebook: [download it](notebooks/{name}.ipynb), or open `docs/tutorials/{name}.ipynb`.*"
    return "\n\n".join([title, link, *rest, *parts[1:]]), pictures


def _joined(outputs):
    """Return outputs, those of one stream that follow each other as one."""
    found = []
    for output in outputs:
        if found and output.get("name", "no stream") == found[-1].get("name"):
            found[-1] = nbformat.from_dict({**found[-1], "text": found[-1].text + output.text})
        else:
            found.append(output)
    return found


def _shown(output, name, caption, pictures):
    """Return an output as HTML; a picture goes into a file of its own."""
    if output.output_type == "stream" and output.name == "stderr":
        if WARNING.sub("", output.text).strip():
            raise PluginError(f"docs/tutorials/{name}.ipynb: a cell warns: {output.text}")
        output = nbformat.from_dict({**output, "name": "stdout", "text": WARNING.sub(r"\1\n", output.text)})
    data = output.get("data", {})
    if "image/png" in data:
        size = output.metadata.get("image/png", {})
        return _figure("png", data["image/png"], name, caption, pictures, size.get("width"))
    if film := DATA_URI.search(data.get("text/html", "")):
        return _figure(film[1], film[2], name, caption, pictures)
    if "text/html" in data:
        table = SIZED.sub("<table", STYLE.sub("", data["text/html"]))
        return f'<div class="output" tabindex="0">{table}</div>'
    text = COLOURS.sub("", output.get("text") or data.get("text/plain", ""))
    return f'<pre class="output" tabindex="0">{escape(text)}</pre>'


def _figure(kind, data, name, caption, pictures, width=None):
    if caption is None:
        raise PluginError(f"docs/tutorials/{name}.ipynb: a cell draws; begin it with a line '#| caption: ...'")
    file = f"{name}/{len(pictures) + 1}.{kind}"
    pictures[file] = b64decode(data)
    size = f' width="{width}"' if width else ""
    text = escape(caption)
    return f'<figure><img src="{file}" alt="{text}"{size}><figcaption>{text}</figcaption></figure>'


def bare(notebook):
    """Return the text of a notebook without outputs and without what Jupyter notes beside the cells."""
    plain = {"display_name": "Python 3", "language": "python", "name": "python3"}
    notebook.metadata = {"kernelspec": plain, "language_info": {"name": "python"}}
    for number, cell in enumerate(notebook.cells, start=1):
        cell.id, cell.metadata = f"cell-{number}", {}
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    split = nbformat.v4.rwbase.split_lines(notebook)
    return json.dumps(split, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:]):
        path.write_text(bare(nbformat.read(path, 4)), encoding="utf-8")
