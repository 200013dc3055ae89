"""From a pipeline file to its modal body: mesh, model, reduction, body, checks."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modalprep import __version__
from modalprep.body.build import flexible_body
from modalprep.body.checks import Check, check_body, check_model
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import AccuracyError, InputError
from modalprep.fe.model import FEModel
from modalprep.fe.read import mesh_digest
from modalprep.formats.modalfile import read_body, write_body
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.load import load_pipeline, naming
from modalprep.pipeline.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.schema import Pipeline
from modalprep.reduction.basis import Reduction
from modalprep.reduction.craig_bampton import craig_bampton, guyan
from modalprep.reduction.error import ReductionError, reduction_error, to_target
from modalprep.reduction.free_interface import free_interface, improved_guyan

LIGHT, HEAVY = 1e-6, 2.3e4  # kg over the cube of the size, kg/m^3: a thread, and more than a cube of osmium
GIANT = 1e6  # kg; an arm of 0.1 m read as 100 m weighs 1e9 times as much


@dataclass(frozen=True)
class Built:
    """A modal body, where it was written, its checks, notes for the user, and its error where it was measured."""

    body: FlexibleBody
    file: Path
    checks: list[Check]
    notes: tuple[str, ...]
    error: ReductionError | None = None

    @property
    def error_curves(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Curves of the relative errors over frequency (Hz) for the report; empty when none were measured."""
        if self.error is None:
            return {}
        found = {"frequencies": (self.error.full, self.error.frequency)}
        if len(self.error.sweep):
            found["compliance at the interfaces"] = (self.error.sweep, self.error.dynamic)
        return found


def output_folder(path: Path, output: Path | None) -> Path:
    """Return where the outputs of a pipeline file go: ``<output>/<name>``, by default ``output`` beside the file.

    Examples
    --------
    >>> output_folder(Path("pipelines/bracket.toml"), None).as_posix()
    'pipelines/output/bracket'
    """
    return (output or path.parent / "output") / path.stem


def build_body(path: Path, folder: Path, reporter: Reporter) -> Built:
    """Run the mesh part of a pipeline file and write ``<folder>/<name>.h5``.

    Raises
    ------
    InputError
        When the file or the mesh cannot be used.
    AccuracyError
        When a physics check fails; nothing is written then.
    """
    pipeline = load_pipeline(path)
    if pipeline.mesh is None:
        raise InputError(f"{path} has no [mesh]: there is no body to build")
    with naming(path), reporter.progress(f"{path.name}: mesh to modal body", 5) as done:
        mesh = read_pipeline_mesh(path, pipeline)
        done(1)
        model = assemble_pipeline(pipeline, mesh)
        done(2)
        reduction, error = _reduce(pipeline, model)
        done(4)
        body = flexible_body(
            model,
            reduction,
            name=pipeline.name or path.stem,
            damping=pipeline.reduction.damping,
            provenance=inputs(path, pipeline),
        )
        done(5)
    checks = check_model(model) + check_body(body)
    failed = [check for check in checks if not check.passed]
    if failed:
        first = failed[0]
        raise AccuracyError(
            f"{path}: check {first.name!r} failed ({first.value:.1e} > {first.limit:.0e}: {first.meaning})"
        )
    file = reporter.wrote(write_body(body, folder / f"{path.stem}.h5"))
    said = () if error is None else (_statement(error),)
    return Built(body, file, checks, (*model.notes, *reduction.notes, *said, *_doubts(body)), error)


def current_body(path: Path, folder: Path, reporter: Reporter) -> FlexibleBody:
    """Return the body of a pipeline file, built again only when its inputs changed."""
    pipeline, file = load_pipeline(path), folder / f"{path.stem}.h5"
    try:
        body, wanted = read_body(file), inputs(path, pipeline)
        if wanted.items() <= body.provenance.items():
            return body
    except InputError:
        pass
    return build_body(path, folder, reporter).body


def inputs(path: Path, pipeline: Pipeline) -> dict[str, str]:
    """Return what determines the body: hash of the mesh, of the body's options, program version."""
    parts = ("name", "mesh", "materials", "properties", "connections", "interfaces", "reduction")
    options = json.dumps(pipeline.model_dump(include=set(parts)), sort_keys=True)
    digest = mesh_digest(path.parent / pipeline.mesh.file) if pipeline.mesh else ""
    return {
        "pipeline": path.name,
        "mesh_sha256": digest,
        "options_sha256": hashlib.sha256(options.encode()).hexdigest(),
        "program": f"modalprep {__version__}",
    }


def _reduce(pipeline: Pipeline, model: FEModel) -> tuple[Reduction, ReductionError | None]:
    """Reduce as the file says; with `up_to` also measure the error."""
    table = pipeline.reduction
    if table.target_error is not None:
        return to_target(model, lambda n: _basis(table, model, n), table.target_error, table.up_to)
    reduction = _basis(table, model, table.modes)
    if table.up_to is None:
        return reduction, None
    return reduction, reduction_error(model, reduction, table.up_to)


def _basis(table, model: FEModel, modes: int) -> Reduction:
    match table.method:
        case "guyan":
            return guyan(model)
        case "irs":
            return improved_guyan(model)
        case "free_interface":
            return free_interface(model, modes=modes, keep=table.keep)
    return craig_bampton(model, modes=modes, keep=table.keep, truncation=table.truncation_vectors)


def _statement(error: ReductionError) -> str:
    parts = {"frequencies": error.frequency, "static answers": error.static, "dynamic compliance": error.dynamic}
    worst = ", ".join(f"{name} {np.max(values, initial=0.0):.1e}" for name, values in parts.items())
    return (
        f"error against the full model below {error.up_to:g} Hz, where it has {len(error.full)} modes (counted by the "
        f"inertia of K - w^2 M): {worst}"
    )


def _doubts(body: FlexibleBody) -> tuple[str, ...]:
    """Warn of numbers that a wrong unit produces."""
    size = np.ptp(body.points, axis=0).max()
    what = (
        f"for a body of {size:.3g} m and {body.m:.3g} kg: check length_unit, mass_unit and the SI units of [materials]"
    )
    doubts = []
    if not (LIGHT < body.m / size**3 < HEAVY and 1 / GIANT < body.m < GIANT):
        doubts.append(f"its mass is odd {what}")
    elastic = body.frequency[body.frequency > 0]
    if len(elastic) and not 1e-3 < elastic[0] * size < 1e5:  # m/s: a wave crosses the body
        doubts.append(f"first frequency {elastic[0]:.3g} Hz is odd {what}")
    return tuple(doubts)
