"""From a pipeline file to its modal body: mesh, model, reduction, body, checks."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.formats.export import EXPORTS
from modalprep.formats.modalfile import read_body
from modalprep.pipeline.building.built import Built, body_key, recall_body, store_body
from modalprep.pipeline.building.cache import Cache
from modalprep.pipeline.building.inputs import inputs
from modalprep.pipeline.building.sources import mark_source, output_folder, refuse_overwriting, source_files
from modalprep.pipeline.building.supplied import read_supplied
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import Vector, naming
from modalprep.pipeline.schema.changing import LevelTable
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.pipeline.schema.pipeline import BodyTable
from modalprep.pipeline.schema.reduction import rotation_matrix
from modalprep.vectors import inertia_tensor
from modalprep.verdicts.notes import warnings_of


def build_body(path: str | Path | Loaded, folder: Path, reporter: Reporter, cache: Cache | None = None) -> Built:
    """Build the body of a pipeline file and write ``<folder>/<name>.h5``; intermediate results may come from a cache.

    Raises
    ------
    InputError
        When the file or the mesh cannot be used.
    AccuracyError
        When a physics check fails; nothing is written then.
    """
    from modalprep.pipeline.building.compute import compute_body  # imported here, as reading a body does not need it

    source = _with_body(load(path))
    file = folder / f"{source.path.stem}.h5"
    exports = (file.with_suffix(EXPORTS[name].suffix) for name in set(source.pipeline.output.export))
    refuse_overwriting({file, *exports}, source_files(source))
    built = compute_body(source, file, reporter, None) if cache is None else _cached(source, file, reporter, cache)
    mark_source(folder, source.path)
    return built


def _cached(source: Loaded, file: Path, reporter: Reporter, cache: Cache) -> Built:
    """Return the body of a pipeline file from the cache, or compute it and put it there."""
    from modalprep.pipeline.building.compute import compute_body

    with naming(source.path):
        provenance = inputs(source)
        key = body_key(cache, source.body_name, provenance)
    cached = recall_body(cache, key, file, provenance)
    if cached is not None:
        reporter.say(f"{source.path.name}: modal body from the cache")
        reporter.wrote(file)
        return cached
    start = time.perf_counter()
    built = compute_body(source, file, reporter, cache)
    store_body(cache, key, built, time.perf_counter() - start)
    return built


def made_bodies(source: Loaded, output: Path | None) -> list[Path]:
    """Return the modal files that a pipeline file and the pipelines of its bodies write."""
    paths = [file.path for file in source.files if file.pipeline.has_body]
    return [output_folder(path, output) / f"{path.stem}.h5" for path in paths]


def current_body(source: Loaded, output: Path | None, reporter: Reporter) -> FlexibleBody:
    """Return the body of a pipeline file, built again only when its inputs changed."""
    folder = output_folder(source.path, output)
    file = folder / f"{source.path.stem}.h5"
    with suppress(InputError):
        body = read_body(file)
        if inputs(source).items() <= body.provenance.items():
            return body
    built = build_body(source, folder, reporter)
    reporter.notes(warnings_of(built.notes))
    return built.body


def stand_in(source: Loaded) -> FlexibleBody:
    """Return a rigid body with the interfaces of the body of a pipeline file, to check names before it is computed.

    A body that a file supplies is read instead.
    """
    pipeline = _with_body(source).pipeline
    if pipeline.body is not None:
        return read_supplied(source.path, pipeline.body)
    names = sorted(pipeline.interfaces or ["root"], key=lambda name: name != pipeline.reduction.root)
    ends = {name: np.array([k, 0.0, 0.0]) for k, name in enumerate(names)}
    return rigid_body(source.body_name, mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=ends)


def _with_body(source: Loaded) -> Loaded:
    if not source.pipeline.has_body:
        raise InputError(f"{source.path} has no [mesh] or [matrices] and no [body]: there is no body to build")
    return source


def read_bodies(source: Loaded, build: Callable[[Loaded], FlexibleBody]) -> dict[str, FlexibleBody]:
    """Return the bodies of a pipeline file: those of [bodies] and that of its own [mesh].

    Parameters
    ----------
    build : callable
        Returns the body of a pipeline file.
    """
    by_origin: dict[object, FlexibleBody] = {}  # by pipeline file, else by table, which the segments of a chain share
    bodies = {}
    for name, table in source.pipeline.bodies.items():
        origin = table.pipeline or id(table)
        if origin not in by_origin:
            by_origin[origin] = _body(name, table, source, build)
        bodies[name] = by_origin[origin]
    if source.pipeline.has_body:
        name = source.body_name
        if name in bodies:
            raise InputError(
                f"{source.path}: body {name!r} is made by [mesh] and named again under [bodies]; rename one"
            )
        bodies[name] = build(source)
    return bodies


def _body(name: str, table: BodyTable, source: Loaded, build: Callable[[Loaded], FlexibleBody]) -> FlexibleBody:
    if table.mass is not None:
        return _drawn(read_rigid(name, table.mass, table, table.interfaces), table, source.folder)
    if table.file is not None:
        return read_supplied(source.path, table)
    return build(source.of_body(str(table.pipeline)))


def _drawn(body: FlexibleBody, table: BodyTable, folder: Path) -> FlexibleBody:
    """Return a rigid body with the surfaces that its table names."""
    if not table.surfaces:
        return body
    from modalprep.formats.robots.files import pictured, surface  # not for systems without them

    surfaces = [surface(folder / x.file, x.scale, x.position, rotation_matrix(x.rotation)) for x in table.surfaces]
    return pictured(body, surfaces)


def read_rigid(name: str, mass: float, table: BodyTable | LevelTable, interfaces: Mapping[str, Vector]) -> FlexibleBody:
    """Return the rigid body of a mass (kg), with the centre and the inertia of a table and interfaces (m).

    Examples
    --------
    >>> read_rigid("hub", 2.0, BodyTable(mass=2.0), {"root": [0.0, 0.0, 0.0]}).m
    2.0
    """
    return rigid_body(
        name, mass=mass, centre=table.centre, inertia=inertia_tensor(table.inertia), interfaces=interfaces
    )
