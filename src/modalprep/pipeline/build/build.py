"""From a pipeline file to its modal body: mesh, model, reduction, body, checks."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from modalprep import __version__
from modalprep.body.build import flexible_body
from modalprep.body.checks import check_body, check_model
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.body.second_order import SECOND_ORDER
from modalprep.body.verify import check_projection
from modalprep.errors import AccuracyError, InputError
from modalprep.formats.export import EXPORTS
from modalprep.formats.modalfile import read_body, write_body
from modalprep.pipeline.build.built import Built, body_key, recall_body, store_body
from modalprep.pipeline.build.cache import Cache
from modalprep.pipeline.build.model import assemble_pipeline, pipeline_stress, read_pipeline_mesh, source_digest
from modalprep.pipeline.build.reduce import reduce_model, target_damping
from modalprep.pipeline.build.sources import pipelines_of, refuse_overwriting, source_files
from modalprep.pipeline.build.stages import caching_algebra
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import Vector, naming
from modalprep.pipeline.schema.depletion import LevelTable
from modalprep.pipeline.schema.load import load_pipeline
from modalprep.pipeline.schema.pipeline import BodyTable, Pipeline
from modalprep.pipeline.schema.system import inertia_tensor
from modalprep.reduction.damping import modal_damping

# plausible range of the mass over the cube of the size, kg/m^3: from a thread to more than a cube of osmium
LIGHT, HEAVY = 1e-6, 2.3e4
GIANT = 1e6  # kg; an arm of 0.1 m read as 100 m has 1e9 times its mass
SHORT, LONG = 1e-3, 100.0  # m
SLOW, FAST = 0.1, 1e5  # m/s, first frequency times size: from a film to a block of diamond


def output_folder(path: Path, output: Path | None) -> Path:
    """Return where the outputs of a pipeline file go: ``<output>/<name>``, by default ``output`` beside the file.

    Examples
    --------
    >>> output_folder(Path("pipelines/bracket.toml"), None).as_posix()
    'pipelines/output/bracket'
    """
    return (output or path.parent / "output") / path.stem


def build_body(path: Path, folder: Path, reporter: Reporter, cache: Cache | None = None) -> Built:
    """Run the mesh part of a pipeline file and write ``<folder>/<name>.h5``; parts may come from a cache.

    Raises
    ------
    InputError
        When the file or the mesh cannot be used.
    AccuracyError
        When a physics check fails; nothing is written then.
    """
    pipeline, file = _body_pipeline(path), folder / f"{path.stem}.h5"
    exports = (file.with_suffix(EXPORTS[name].suffix) for name in set(pipeline.output.export))
    refuse_overwriting({file, *exports}, source_files(path, pipeline))
    if cache is None:
        return _build(path, pipeline, file, reporter, None)
    with naming(path):
        given = inputs(path, pipeline)
        key = body_key(cache, pipeline.name or path.stem, given)
    found = recall_body(cache, key, file, given)
    if found is not None:
        reporter.say(f"{path.name}: modal body from the cache")
        reporter.wrote(file)
        return found
    start = time.perf_counter()
    built = _build(path, pipeline, file, reporter, cache)
    store_body(cache, key, built, time.perf_counter() - start)
    return built


def _build(path: Path, pipeline: Pipeline, file: Path, reporter: Reporter, cache: Cache | None) -> Built:
    with naming(path), reporter.progress(f"{path.name}: mesh to modal body", 5) as done:
        mesh = read_pipeline_mesh(path, pipeline)
        done(1)
        model = assemble_pipeline(pipeline, mesh)
        done(2)
        reduction, error = reduce_model(pipeline, mesh, model, caching_algebra(cache))
        done(4)
        name = pipeline.name or path.stem
        stress = pipeline_stress(pipeline, mesh, model)
        wanted = {"stress": stress, "second_order_mass": pipeline.reduction.second_order_mass}
        body = flexible_body(model, reduction, name=name, **wanted, provenance=inputs(path, pipeline))
        body = body.with_(D=modal_damping(body, target_damping(pipeline.reduction.damping)))
        done(5)
    checks = check_model(model) + check_body(body) + check_projection(model, reduction, body)
    failed = [check for check in checks if not check.passed]
    if failed:
        first = failed[0]
        raise AccuracyError(
            f"{path}: check {first.name!r} failed ({first.value:.1e} > {first.limit:.0e}: {first.meaning}); "
            "very stiff parts on soft ones, bad elements and mixed units lose the digits: see 'modalprep quality', and "
            "use rbe2 for stiff parts"
        )
    reporter.wrote(write_body(body, file))
    said = [text for key, text in body.provenance.items() if key == SECOND_ORDER]
    return Built(body, file, checks, (*model.notes, *reduction.notes, *said, *_unit_warnings(body)), error)


def made_bodies(path: Path, output: Path | None) -> list[Path]:
    """Return the modal files that a pipeline file and the pipelines of its bodies make."""
    made = [file for file, pipeline in pipelines_of(path).items() if pipeline.has_body]
    return [output_folder(file, output) / f"{file.stem}.h5" for file in made]


def current_body(path: Path, output: Path | None, reporter: Reporter) -> FlexibleBody:
    """Return the body of a pipeline file, built again only when its inputs changed."""
    pipeline, folder = load_pipeline(path), output_folder(path, output)
    file = folder / f"{path.stem}.h5"
    try:
        body, wanted = read_body(file), inputs(path, pipeline)
        if wanted.items() <= body.provenance.items():
            return body
    except InputError:
        pass
    built = build_body(path, folder, reporter)
    for note in built.notes:
        if "is implausible" in note:  # the others are in the report of the body's own run
            reporter.say(f"  note: {note}")
    return built.body


def stand_in(path: Path) -> FlexibleBody:
    """Return a rigid body with the interfaces of the body of a pipeline file, by which names are checked early."""
    pipeline = _body_pipeline(path)
    names = sorted(pipeline.interfaces or ["root"], key=lambda name: name != pipeline.reduction.root)
    ends = {name: np.array([k, 0.0, 0.0]) for k, name in enumerate(names)}
    return rigid_body(pipeline.name or path.stem, mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=ends)


def _body_pipeline(path: Path) -> Pipeline:
    pipeline = load_pipeline(path)
    if not pipeline.has_body:
        raise InputError(f"{path} has no [mesh] or [matrices]: there is no body to build")
    return pipeline


def read_bodies(pipeline: Pipeline, path: Path, build: Callable[[Path], FlexibleBody]) -> dict[str, FlexibleBody]:
    """Return the bodies of a pipeline file: those of [bodies] and that of its own [mesh].

    Parameters
    ----------
    build : callable
        Makes the body of a pipeline file.
    """
    made: dict[int, FlexibleBody] = {}  # the segments of a chain share one table
    for name, table in pipeline.bodies.items():
        if id(table) not in made:
            made[id(table)] = _body(name, table, path, build)
    bodies = {name: made[id(table)] for name, table in pipeline.bodies.items()}
    if pipeline.has_body:
        name = pipeline.name or path.stem
        if name in bodies:
            raise InputError(f"{path}: body {name!r} is made by [mesh] and named again under [bodies]; rename one")
        bodies[name] = build(path)
    return bodies


def _body(name: str, table: BodyTable, path: Path, build: Callable[[Path], FlexibleBody]) -> FlexibleBody:
    if table.mass is not None:
        return read_rigid(name, table, table.interfaces)
    if table.file is not None:
        return read_body(path.parent / table.file)
    return build(path.parent / str(table.pipeline))


def read_rigid(name: str, table: BodyTable | LevelTable, interfaces: dict[str, Vector]) -> FlexibleBody:
    """Return the rigid body of a table, with its interfaces at these positions (m).

    Examples
    --------
    >>> read_rigid("hub", BodyTable(mass=2.0), {"root": [0.0, 0.0, 0.0]}).m
    2.0
    """
    positions = {key: np.array(x) for key, x in interfaces.items()}
    inertia = inertia_tensor(table.inertia)
    return rigid_body(name, mass=table.mass, centre=table.centre, inertia=inertia, interfaces=positions)


def inputs(path: Path, pipeline: Pipeline) -> dict[str, str]:
    """Return what determines the body: hash of the mesh, of the body's options, program version."""
    made_of = ("mesh", "matrices", "materials", "properties", "connections")
    parts = {"name", *made_of, "interfaces", "stress", "loads", "reduction"}
    options = json.dumps(pipeline.model_dump(include=parts), sort_keys=True)
    return {
        "pipeline": path.name,
        "mesh_sha256": source_digest(path, pipeline),
        "options_sha256": hashlib.sha256(options.encode()).hexdigest(),
        "program": f"modalprep {__version__}",
    }


def _unit_warnings(body: FlexibleBody) -> tuple[str, ...]:
    """Return warnings of values that suggest a wrong unit."""
    size = np.ptp(body.points, axis=0).max()
    what = (
        f"for a body of {size:.3g} m and {body.m:.3g} kg: check length_unit, mass_unit and the SI units of [materials]"
    )
    warnings = []
    if not (LIGHT < body.m / size**3 < HEAVY and 1 / GIANT < body.m < GIANT):
        warnings.append(f"its mass is implausible {what}")
    elastic = body.frequency[body.frequency > 0]
    if not SHORT <= size <= LONG:
        warnings.append(f"its size is implausible {what}")
    if len(elastic) and not SLOW < elastic[0] * size < FAST:
        warnings.append(f"first frequency {elastic[0]:.3g} Hz is implausible {what}")
    return tuple(warnings)
