"""What killed and undisturbed runs leave in their folders: whole files, and the same bytes in the end."""

import csv
import json
import re
import tomllib

import h5py
from PIL import Image

TIME = re.compile(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?\+00:00")
OWN = ("started", "seconds", "worker", "cache", "pipeline", "folder", "manifest")  # of each run, in its manifest

OF_ONE_RUN = ("batch.jsonl", "study.parquet", "index.html")  # the order and times of jobs are in them


def contents(folder):
    """The bytes of all files without the time of their making, and without temporary ones; manifests as tables."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and ".part" not in path.name and path.name not in OF_ONE_RUN:
            place = str(folder).encode()
            found[str(path.relative_to(folder))] = TIME.sub(b"", path.read_bytes()).replace(place, b"")
            if path.name == ".source":  # the way from the folder to the pipeline file
                found[str(path.relative_to(folder))] = (path.parent / path.read_text()).resolve()
            if path.name in ("manifest.json", "batch.json"):
                found[str(path.relative_to(folder))] = steady(json.loads(path.read_text()))
            if path.name == "study.csv":
                with path.open(newline="") as file:
                    found[str(path.relative_to(folder))] = [steady(row) for row in csv.DictReader(file)]
    return found


def differing(folder, other):
    """The names of the files that are not to the last bit the same in both."""
    found, wanted = contents(folder), contents(other)
    return sorted(name for name in found.keys() | wanted.keys() if found.get(name) != wanted.get(name))


def steady(record):
    """A manifest without what is of one run only; hashes are those of files with the time of their making."""
    record = {key: value for key, value in record.items() if key not in OWN}
    if "outputs" in record:
        record["outputs"] = sorted(record["outputs"])
    if "jobs" in record:
        record["jobs"] = [steady({**job, "ran": None}) for job in record["jobs"]]
    return record


def all_whole(folder):
    readers = {
        ".h5": lambda path: h5py.File(path).close(),
        ".png": lambda path: Image.open(path).load(),
        ".json": lambda path: json.loads(path.read_text()),
        ".toml": lambda path: tomllib.loads(path.read_text()),
    }
    for path in folder.rglob("*"):
        if path.is_file() and ".part" not in path.name:
            if path.suffix in readers:
                readers[path.suffix](path)
            elif path.suffix == ".html":
                assert path.read_text().rstrip().endswith("</html>")
            elif path.suffix == ".csv":
                assert len({line.count(",") for line in path.read_text().splitlines()}) == 1
                assert path.read_text().endswith("\n")
    return True
