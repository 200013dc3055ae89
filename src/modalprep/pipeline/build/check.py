"""Physics checks of a modal file, or of the body that a pipeline file describes against its mesh."""

from __future__ import annotations

from pathlib import Path

from modalprep.body.build import flexible_body
from modalprep.body.checks import CheckReport, check_body, check_model
from modalprep.body.verify import check_buckling, check_geometric_stiffness, check_projection
from modalprep.errors import InputError
from modalprep.formats.modalfile import read_body
from modalprep.pipeline.build.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.build.reduce import reduce_model
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import load_pipeline


def check_file(path: Path, reporter: Reporter, energy: bool = False) -> CheckReport:
    """Check a modal file; for a pipeline file build its body again and check it against the mesh as well.

    Nothing is written. With `energy` the geometric stiffness is also compared with the nonlinear strain energy.

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
        return CheckReport(subject=path.name, checks=tuple(check_body(read_body(path, checked=False))))
    pipeline = load_pipeline(path)
    if not pipeline.has_body:
        raise InputError(f"{path} has no [mesh] or [matrices]: give the modal files of its bodies")
    with naming(path), reporter.progress(f"{path.name}: body against its mesh", 4) as done:
        mesh = read_pipeline_mesh(path, pipeline)
        model = assemble_pipeline(pipeline, mesh)
        done(1)
        reduction, _ = reduce_model(pipeline, mesh, model)
        done(2)
        taken = pipeline.reduction.second_order_mass
        body = flexible_body(model, reduction, name=pipeline.name or path.stem, second_order_mass=taken)
        done(3)
        checks = (*check_model(model), *check_body(body), *check_projection(model, reduction, body))
        checks = (*checks, *(check_buckling(model, body) if body.has_geometric_stiffness else ()))
        checks = (*checks, *(check_geometric_stiffness(model, reduction, body) if energy else ()))
        done(4)
    return CheckReport(subject=path.name, checks=checks)
