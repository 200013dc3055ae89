"""From the mesh of a pipeline file, or the file of its body, to the modal file, with the checks of both."""

from __future__ import annotations

from pathlib import Path

from modalprep.body.build import flexible_body
from modalprep.body.checks import check_body, check_model
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.quality.missing_mass import missing_mass
from modalprep.body.verify import check_projection
from modalprep.errors import AccuracyError
from modalprep.extras import missing
from modalprep.formats.modalfile import write_body
from modalprep.linalg.forecast import forecasts_to
from modalprep.pipeline.building.built import Built, Tables
from modalprep.pipeline.building.cache import Cache
from modalprep.pipeline.building.deflection import deflecting
from modalprep.pipeline.building.described import model_tables
from modalprep.pipeline.building.energies import energy_tables
from modalprep.pipeline.building.inputs import inputs
from modalprep.pipeline.building.model import checked_model, pipeline_recovery, pipeline_stress, read_pipeline_mesh
from modalprep.pipeline.building.reduce import implausible_ratios, reduce_model, response_loads, target_damping
from modalprep.pipeline.building.stages import caching_algebra
from modalprep.pipeline.building.supplied import read_supplied
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.reduction import SuppliedTable
from modalprep.reduction.basis import Reduction, held_mass
from modalprep.reduction.cyclic.ring import ring_algebra
from modalprep.reduction.dampers import coupling_note, damping_fields
from modalprep.reduction.damping import modal_damping
from modalprep.reduction.error import ReductionError
from modalprep.reduction.recoveries.convergence import recovery_convergence

LARGE = 20_000  # unknowns from which SuperLU takes seconds longer than PARDISO (docs/reference/installation.md)


def compute_body(source: Loaded, file: Path, reporter: Reporter, cache: Cache | None) -> Built:
    """Return the body of a pipeline file and write it; intermediate results may come from a cache.

    Raises
    ------
    AccuracyError
        When a physics check fails; nothing is written then.
    """
    table = source.pipeline.body
    built = _reduced(source, file, reporter, cache) if table is None else _supplied(source, table, file, reporter)
    failed = [check for check in built.checks if not check.passed]
    if failed:
        first = failed[0]
        advice = (
            "very stiff parts on soft ones, bad elements and mixed units lose the digits: see 'modalprep quality', and "
            "use rbe2 for stiff parts"
        )
        raise AccuracyError(
            f"{source.path}: check {first.name!r} failed ({first.value:.1e} > {first.limit:.0e}: {first.meaning}); "
            + (advice if table is None else "ask for a file with more digits")
        )
    reporter.wrote(write_body(built.body, file))
    return built


def _reduced(source: Loaded, file: Path, reporter: Reporter, cache: Cache | None) -> Built:
    """Return the body of a mesh or of matrices."""
    path, pipeline = source.path, source.pipeline
    with naming(path), reporter.progress(f"{path.name}: mesh to modal body", 5, stage="reading the mesh") as done:
        mesh = read_pipeline_mesh(source)
        done(1, "assembly")
        model, quality = checked_model(pipeline, mesh)
        done(2, "reduction")
        stress = pipeline_stress(pipeline, mesh, model)
        recovery = pipeline_recovery(pipeline, mesh, model)
        algebra = caching_algebra(cache)
        algebra = ring_algebra(model, mesh.cyclic, algebra) if pipeline.cyclic and mesh.cyclic else algebra
        table = pipeline.reduction

        def reduce(derivatives: int) -> tuple[Reduction, ReductionError | None]:
            with forecasts_to(lambda text: reporter.say(f"  {text}")):
                found = reduce_model(pipeline, mesh, model, algebra, recovery, derivatives)
            done(4, "modal body")
            return found

        def build(found: tuple[Reduction, ReductionError | None], stations: int) -> FlexibleBody:
            return flexible_body(
                model,
                found[0],
                name=source.body_name,
                stress=stress,
                recovery=recovery,
                second_order_mass=table.second_order_mass,
                stations=stations,
                idle_below=table.deflection_error if table.large_deflection == "auto" else 0.0,
                provenance=inputs(source),
            )

        (reduction, error), body = deflecting(table, reduce, build)
        damping = target_damping(table.damping)
        whole = damping_fields(modal_damping(body, damping), body.damping_matrix)
        body = body.with_(**whole, modes=body.modes.with_(held_mass=held_mass(model)))
        tables = Tables(model_tables(pipeline, mesh, model, quality), energy_tables(model, reduction, body))
        done(5)
    checks = check_model(model) + check_body(body) + check_projection(model, reduction, body)
    reporter.notes(_slower(model.K.shape[0]))
    body = body.with_(notes=(*body.notes, *missing_mass(body), *implausible_ratios(damping)))
    loads = response_loads(source, body)
    convergence = recovery_convergence(body, reduction.spans, table.up_to, loads)
    return Built(body, file, checks, error, tables, convergence)


def _slower(unknowns: int) -> list[str]:
    """Return a note where another factorisation would be quicker by seconds."""
    why = "" if unknowns < LARGE else missing("pypardiso", f"SuperLU factorised {unknowns} unknowns; PARDISO, quicker,")
    return [why] if why else []


def _supplied(source: Loaded, table: SuppliedTable, file: Path, reporter: Reporter) -> Built:
    """Return the body of a file that is reduced already."""
    path = source.path
    with naming(path), reporter.progress(f"{path.name}: {table.file} to modal body", 1) as done:
        body = read_supplied(path, table)
        body = body.with_(name=source.body_name, provenance=body.provenance | inputs(source))
        damping = 0.0 if table.damping is None else target_damping(table.damping)
        if table.damping is not None:
            body = body.with_(D=modal_damping(body, damping))
        done(1)
    said = (*coupling_note(body.coupled_damping), *implausible_ratios(damping))
    body = body.with_(notes=(*body.notes, *said))
    return Built(body, file, check_body(body))
