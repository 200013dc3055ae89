"""From the reduction tables of a pipeline file to a reduced basis, loads and damping."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.pipeline.building.model import connected_mesh, node_set
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.reduction import RayleighTable, ReductionTable
from modalprep.reduction.basis import Reduction
from modalprep.reduction.craig_bampton import craig_bampton, guyan
from modalprep.reduction.damping import Ratio, Rayleigh
from modalprep.reduction.error import DAMPING, ReductionError, reduction_error, to_target
from modalprep.reduction.free_interface_basis import free_interface, improved_guyan
from modalprep.reduction.loads import Load, nodal_load
from modalprep.reduction.notes import dropped_in_band
from modalprep.reduction.recoveries.convergence import Asked
from modalprep.reduction.table import DERIVATIVE_VECTORS, DERIVATIVES
from modalprep.response.modal import unit_inputs
from modalprep.response.random import find_band
from modalprep.response.validity import highest_mode


def reduce_model(
    pipeline: Pipeline,
    mesh: Mesh,
    model: FEModel,
    algebra: Algebra = DIRECT,
    recovery: ModelRecovery | None = None,
    derivatives: int = DERIVATIVE_VECTORS,
) -> tuple[Reduction, ReductionError | None]:
    """Reduce the model by the file's options, with so many derivatives; with `up_to` also measure the error."""
    table = pipeline.reduction
    loads = pipeline_loads(pipeline, mesh, model)

    def basis(modes: int) -> Reduction:
        return _basis(table, model, modes, loads, algebra, recovery, derivatives)

    if table.up_to is None:
        return basis(table.modes), None
    options = {"algebra": algebra, "recovery": recovery, "damping": DAMPING}
    if isinstance(table.damping, float) and table.damping > 0:
        options["damping"] = table.damping
    if table.target_error is not None:
        reduction, error = to_target(model, basis, table.target_error, table.up_to, **options)
    else:
        reduction = basis(table.modes)
        error = reduction_error(model, reduction, table.up_to, **options)
    notes = (*reduction.notes, *dropped_in_band(reduction.table, table.up_to), _statement(error))
    return reduction.with_(notes=notes), error


def _basis(
    table: ReductionTable,
    model: FEModel,
    modes: int,
    loads: Mapping[str, np.ndarray],
    algebra: Algebra,
    recovery: ModelRecovery | None,
    derivatives: int,
) -> Reduction:
    how = {"solver": table.solver, "algebra": algebra}
    common = {"modes": modes, "recovery": recovery, **how}
    match table.method:
        case "guyan":
            return guyan(model, **how)
        case "irs":
            return improved_guyan(model, **how)
        case "free_interface":
            return free_interface(model, keep=table.keep, **common)
    if DERIVATIVES in table.truncation:
        common["derivatives"] = derivatives or DERIVATIVE_VECTORS
    return craig_bampton(model, keep=table.keep, truncation=table.truncation, loads=loads, **common)


def _statement(error: ReductionError) -> str:
    parts = {"frequencies": error.frequency, "static responses": error.static, "dynamic compliance": error.dynamic}
    parts |= {f"recovery {name}": error.worst_of(name) for name in error.recoveries}
    if not len(error.full):
        del parts["frequencies"]
    where = f" (at {error.worst_at:.4g} Hz, with {100 * error.damping:.3g} % damping)" if len(error.sweep) else ""
    suffix = {"dynamic compliance": where}
    worst = ", ".join(f"{name} {np.max(x, initial=0.0):.1e}{suffix.get(name, '')}" for name, x in parts.items())
    return (
        f"error against the full model below {error.up_to:g} Hz, where it has {len(error.full) or 'no'} modes (counted "
        f"by the inertia of K - w^2 M): {worst}"
    )


def response_loads(source: Loaded, body: FlexibleBody) -> list[Asked]:
    """Return the loads and bands of the responses of a file, for the convergence of its recoveries."""
    pipeline = source.pipeline
    loads = []
    for name, table in pipeline.response.items() if pipeline.recovery else ():
        with naming(f"[response.{name}]"):
            inputs = table.inputs(source.folder)
        ratios = [x for x in (table.damping, pipeline.reduction.damping, DAMPING) if isinstance(x, float) and x > 0]
        low, high = _band(table, inputs, body)
        columns = unit_inputs(body, list(inputs))[0]
        loads.append(
            Asked(name, columns, partial(_amplitudes, list(inputs.values()), table.kind), low, high, ratios[0])
        )
    return loads


def _band(table: Any, inputs: Mapping[str, Any], body: FlexibleBody) -> tuple[float, float]:
    """Return the ends of the band of a response, Hz; of a history up to the highest kept mode."""
    match table.kind:
        case "transient":
            return 0.0, highest_mode(body)
        case "random":
            return find_band(inputs, table.band)
        case "sweep":
            return table.lowest, table.highest
    return float(table.axis[0]), float(table.axis[-1])


def _amplitudes(inputs: list, kind: str, f: np.ndarray) -> np.ndarray:
    """Return the amplitudes (nf, m) of the inputs of a response at frequencies (nf, m); histories by their spectrum."""
    if kind == "transient":
        waves = [np.exp(-2j * np.pi * f[:, :1] * x.time) * x.value for x in inputs]
        return np.stack([np.abs(np.trapezoid(y, x.time)) for x, y in zip(inputs, waves, strict=True)], axis=1)
    size = np.abs(np.stack([x.values_at(f[:, k]) for k, x in enumerate(inputs)], axis=1))
    return np.sqrt(size) if kind == "random" else size


def pipeline_loads(pipeline: Pipeline, mesh: Mesh, model: FEModel) -> dict[str, np.ndarray]:
    """Return the nodal loads ``{name: (n_dof,)}`` of the file's [loads]; groups may be those of connections."""
    if not pipeline.loads:
        return {}
    mesh = connected_mesh(pipeline, mesh, model)
    loads = {}
    for name, table in pipeline.loads.items():
        with naming(f"[loads.{name}]"):
            loads[name] = nodal_load(model, mesh, name, Load(**node_set(table, mesh.scale)))
    return loads


def target_damping(given: float | list | RayleighTable) -> Ratio | Rayleigh:
    """Return the damping of a file in the form of `reduction.damping`.

    Examples
    --------
    >>> target_damping([[5.0, 0.02], [50.0, 0.01]])
    {5.0: 0.02, 50.0: 0.01}
    """
    if isinstance(given, RayleighTable):
        return Rayleigh(alpha=given.alpha, beta=given.beta)
    if not isinstance(given, list):
        return given
    if not given or not isinstance(given[0], list):
        return np.array(given, dtype=float)
    points = dict(given)
    if len(points) < len(given):
        raise InputError("damping gives two ratios at one frequency; keep one")
    return points


def implausible_ratios(given: Ratio | Rayleigh) -> tuple[str, ...]:
    """Return a note where a damping ratio is above critical; none for Rayleigh's, which rises with the frequency.

    Examples
    --------
    >>> implausible_ratios(50.0)
    ('the damping ratio 50 is implausible (0 to 1, which is critical): a ratio of 0.5 is 50 %',)
    """
    if isinstance(given, Rayleigh):
        return ()
    largest = float(np.max(list(given.values()) if isinstance(given, Mapping) else given, initial=0.0))
    text = f"the damping ratio {largest:g} is implausible (0 to 1, which is critical): a ratio of {largest / 100:g} is"
    return (f"{text} {largest:g} %",) if largest > 1 else ()
