"""Physics checks of a modal file, or of the body that a pipeline file describes against its mesh."""

from __future__ import annotations

from pathlib import Path

from modalprep.body.build import flexible_body
from modalprep.body.checks import CheckReport, check_body, check_model
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.verify import check_buckling, check_geometric_stiffness, check_projection
from modalprep.errors import InputError
from modalprep.formats.modalfile import read_body
from modalprep.pipeline.building.model import assemble_pipeline, pipeline_recovery, read_pipeline_mesh
from modalprep.pipeline.building.reduce import reduce_model
from modalprep.pipeline.building.supplied import read_supplied
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import load
from modalprep.supplied.uncertainty import check_spin, knowledge


def check_file(path: Path, reporter: Reporter, energy: bool = False, speed: float | None = None) -> CheckReport:
    """Check a modal file; for a pipeline file build its body again and check it against the mesh as well.

    Nothing is written. With `energy` the geometric stiffness is also compared with the nonlinear strain energy; with
    `speed` (rad/s) the report has an estimate of the error due to the rebuilt terms of a supplied body.

    Raises
    ------
    InputError
        When the file cannot be read, or the pipeline has no mesh; with `energy` when a modal file is given.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.formats.modalfile import write_body
    >>> file = write_body(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.h5")
    >>> check_file(file, Reporter(quiet=True)).passed
    True
    """
    if path.suffix != ".toml" and energy:
        raise InputError(f"{path.name} has no mesh to compute strain energy from; give its pipeline file")
    if path.suffix != ".toml":
        return _report(path.name, read_body(path, checked=False), speed)
    source = load(path)
    pipeline = source.pipeline
    if not pipeline.has_body:
        raise InputError(f"{path} has no [mesh] or [matrices] and no [body]: give the modal files of its bodies")
    if pipeline.body is not None and energy:
        raise InputError(f"{path.name} has no mesh to compute strain energy from; leave out --energy")
    if pipeline.body is not None:
        with naming(path):
            return _report(path.name, read_supplied(path, pipeline.body), speed)
    if speed is not None:
        raise InputError(f"{path.name}: --speed is for a body that was read in reduced form")
    with naming(path), reporter.progress(f"{path.name}: body against its mesh", 4, stage="assembly") as done:
        mesh = read_pipeline_mesh(source)
        model = assemble_pipeline(pipeline, mesh)
        done(1, "reduction")
        recovery = pipeline_recovery(pipeline, mesh, model)
        reduction, _ = reduce_model(pipeline, mesh, model, recovery=recovery)
        done(2, "modal body")
        second_order_mass = pipeline.reduction.second_order_mass
        body = flexible_body(model, reduction, name=source.body_name, second_order_mass=second_order_mass)
        done(3, "checks")
        checks = (*check_model(model), *check_body(body), *check_projection(model, reduction, body))
        checks = (*checks, *(check_buckling(model, body) if body.has_geometric_stiffness else ()))
        checks = (*checks, *(check_geometric_stiffness(model, reduction, body) if energy else ()))
        done(4)
    return CheckReport(subject=path.name, checks=checks)


def _report(subject: str, body: FlexibleBody, speed: float | None) -> CheckReport:
    """Return the checks of a body alone, with notes on the terms of one that was supplied."""
    notes = knowledge(body)
    checks = check_body(body)
    if speed is not None and not notes:
        notes = ("nothing of this body is rebuilt, so that --speed has nothing to estimate",)
    checks += [] if speed is None else check_spin(body, speed)
    return CheckReport(subject=subject, checks=tuple(checks), notes=notes)
