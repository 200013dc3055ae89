"""Component mode synthesis of a pipeline file: modes of welded bodies, projected bases and damping of the bodies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modalprep.atomic import write_json
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.modalfile import write_body
from modalprep.pipeline.building.build import current_body, read_bodies
from modalprep.pipeline.building.reduce import implausible_ratios, target_damping
from modalprep.pipeline.building.sources import (
    mark_source,
    needed_files,
    output_folder,
    refuse_overwriting,
    refuse_shared_folders,
)
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.pipeline.schema.reduction import PlacementTable, SynthesisTable, WeldTable, rotation_matrix
from modalprep.reduction.damping import ComponentDamping, component_damping
from modalprep.reduction.projected import ProjectedBasis, interface_shapes, projected_basis, reduced_body
from modalprep.reduction.synthesis import Placement, SynthesisedModes, synthesise
from modalprep.suggest import refuse_unknown

GROUND = "ground"


@dataclass(frozen=True, kw_only=True)
class Synthesised:
    """System modes of a pipeline, and the bodies changed by them.

    Attributes
    ----------
    modes : SynthesisedModes
    damping : ComponentDamping or None
    projected : {name: ProjectedBasis}
    bodies : {name: FlexibleBody}
        Bodies with a new basis or damping.
    """

    modes: SynthesisedModes
    damping: ComponentDamping | None
    projected: dict[str, ProjectedBasis]
    bodies: dict[str, FlexibleBody]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the validity of the results."""
        notes = [f"redundant: {text}" for text in self.modes.redundant]
        for name, basis in self.projected.items():
            notes.append(
                f"{name}: {len(basis.frequency)} of {self.modes.bodies[name].n} coordinates are kept; they "
                f"represent at least {100 * basis.captured.min(initial=1.0):.6g}% of its mass in a system mode"
            )
        if self.damping is not None:
            notes += implausible_ratios(self.damping.target)
            given = self.damping.target > 0
            share = self.damping.achieved[given] / self.damping.target[given]
            notes.append(
                f"damping of the bodies gives the system's modes {share.min(initial=1.0):.3g} to "
                f"{share.max(initial=1.0):.3g} times their target ratios, and couples two of them by up to "
                f"{self.damping.coupling:.2g} of their own"
            )
        return tuple(notes)

    def summary(self) -> dict:
        """Return the content of the JSON file: frequencies in Hz, fractions of strain energy, damping ratios."""
        summary = {
            "frequency_Hz": self.modes.frequency.tolist(),
            "rigid": self.modes.rigid,
            "strain_energy": {name: share.tolist() for name, share in strain_fractions(self.modes).items()},
            "position_m": {name: x.tolist() for name, x in self.modes.position.items()},
            "rotation": {name: turn.tolist() for name, turn in self.modes.rotation.items()},
            "notes": list(self.notes),
        }
        if self.damping is not None:
            summary["damping_ratio"] = {
                "target": self.damping.target.tolist(),
                "achieved": self.damping.achieved.tolist(),
            }
        return summary


def synthesise_pipeline(path: str | Path | Loaded, output: Path | None, reporter: Reporter) -> Synthesised:
    """Weld the bodies of a pipeline file; write ``<name>-synthesis.json`` and ``<name>-<body>.h5`` of changed bodies.

    Raises
    ------
    InputError
        When the file has no [synthesis], or names something unknown.
    """
    source = load(path)
    path, pipeline, table = source.path, source.pipeline, source.pipeline.synthesis
    if table is None:
        raise InputError(f"{path} has no [synthesis]: add one with modes")
    refuse_shared_folders(source, output)
    folder = output_folder(path, output)
    refuse_overwriting((folder / f"{path.stem}-{name}.h5" for name in pipeline.bodies), needed_files(source))
    bodies = read_bodies(source, lambda source: current_body(source, output, reporter))
    with naming(path), reporter.progress(f"{path.name}: system modes", 1) as done:
        synthesised = _synthesised(table, pipeline.welds, bodies)
        done(1)
    mark_source(folder, path)
    reporter.wrote(write_json(synthesised.summary(), folder / f"{path.stem}-synthesis.json"))
    for name, body in synthesised.bodies.items():
        reporter.wrote(write_body(body, folder / f"{path.stem}-{name}.h5"))
    return synthesised


def _synthesised(
    table: SynthesisTable, weld_tables: dict[str, WeldTable], bodies: dict[str, FlexibleBody]
) -> Synthesised:
    welds, ground = _welds(weld_tables)
    placement = {name: _placement(name, each) for name, each in table.placement.items()}
    modes = synthesise(bodies, welds, placement=placement, ground=ground, modes=table.modes)
    damping = None if table.damping is None else component_damping(modes, target_damping(table.damping))
    damped = bodies if damping is None else damping.applied(bodies)
    projected = {name: _projected(modes, name, table) for name in table.projected}
    changed = {name: damped[name] for name in (bodies if damping is not None else projected)}
    changed |= {name: reduced_body(damped[name], basis) for name, basis in projected.items()}
    return Synthesised(modes=modes, damping=damping, projected=projected, bodies=changed)


def _welds(tables: dict[str, WeldTable]) -> tuple[list[tuple], list[tuple]]:
    """Return the welds between bodies and those to the ground."""
    welds, ground = [], []
    for table in tables.values():
        ends = [end for end in table.between if end != GROUND]
        (welds if len(ends) == 2 else ground).append((*ends, tuple(table.free)))
    return welds, ground


def _placement(name: str, table: PlacementTable) -> Placement:
    with naming(f"[synthesis.placement.{name}]"):
        return np.array(table.position), rotation_matrix(table.rotation)


def _projected(modes: SynthesisedModes, name: str, table: SynthesisTable) -> ProjectedBasis:
    """Return the basis of a body for the elastic system modes, with the static responses at its interfaces."""
    refuse_unknown(name, modes.bodies, "[synthesis] project: body")
    body = modes.bodies[name]
    with naming(f"[synthesis] project {name!r}"):
        keep = interface_shapes(body, *body.interface_name[1:])
        shapes = modes.coordinates[name][6:, modes.rigid :]
        return projected_basis(shapes, np.diag(body.K), np.eye(body.n), tolerance=table.tolerance, keep=keep)


def strain_fractions(modes: SynthesisedModes) -> dict[str, np.ndarray]:
    """Return the fraction (s,) of each body in the strain energy of each system mode; 0 in rigid motions.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> arm = uniform_beam(modes=4)
    >>> pair = synthesise({"a": arm, "b": arm}, [("a.tip", "b.root")], ground=["a.root"], modes=2)
    >>> strain_fractions(pair)["a"].round(2)
    array([0.95, 0.95])
    """
    energy = {name: modes.bodies[name].K @ x[6:] ** 2 for name, x in modes.coordinates.items()}
    total = np.where(modes.frequency > 0, (2 * np.pi * modes.frequency) ** 2, np.inf)
    return {name: values / total for name, values in energy.items()}
