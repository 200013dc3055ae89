"""Output of the commands with --json: plain dictionaries; the names of physical numbers end in their unit."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

SHOCK_UNITS = {  # of a spectrum of accelerations in m/s^2
    "absolute_acceleration": "m/s²",
    "relative_displacement": "m",
    "pseudo_velocity": "m/s",
    "pseudo_acceleration": "m/s²",
}


def outcome(outcome: Any, reporter: Any) -> dict[str, Any]:
    """Return the results of a run: files, frequencies, checks, simulations, notes."""
    built, simulated = outcome.built, outcome.simulated
    return {
        "folder": str(outcome.folder),
        "files": [str(f) for f in reporter.files],
        "frequency_Hz": built.body.frequency.tolist() if built else [],
        "mode_names": list(built.body.mode_names) if built else [],
        "mass_kg": built.body.m if built else None,
        "checks": [check.row() for check in built.checks] if built else [],
        "sensitivities": plain(outcome.sensitivities.rows()) if outcome.sensitivities else [],
        "nodal_diameters": plain(outcome.cyclic.rows()) if outcome.cyclic else [],
        "system": outcome.synthesised.summary() if outcome.synthesised else {},
        "analysis": outcome.analysed.summary() if outcome.analysed else {},
        "runs": runs(simulated) if simulated else {},
        "ensemble": ensemble(simulated.ensemble) if simulated else {},
        "responses": {found.name: response(found.response, found.cut) for found in outcome.responses},
        **(strength(outcome.strength) if outcome.strength else {}),
        "notes": outcome.notes,
        "verdict": outcome.verdict.summary(),
    }


def runs(simulated: Any) -> dict[str, Any]:
    """Return status and statistics of each simulation."""
    return {
        label: {"status": r.status, "message": r.message, "notes": list(r.notes), **r.stats}
        for label, r in simulated.runs.items()
    }


def simulation(outcome: Any, reporter: Any) -> dict[str, Any]:
    """Return the runs of a simulation, its shock spectra and damage, its files, and what failed."""
    simulated = outcome.simulated
    extra = outcome.strength
    files = [str(f) for f in reporter.files]
    found = {"ensemble": ensemble(simulated.ensemble)} if simulated.ensemble is not None else {}
    found |= {"envelopes": envelopes(simulated)} if simulated.envelopes else {}
    found |= strength(extra) | {"notes": extra.notes} if extra else {}
    return {"runs": runs(simulated), **found, "files": files, "verdict": outcome.verdict.summary()}


def envelopes(simulated: Any) -> list[dict[str, Any]]:
    """Return, of each recovered component, the place with its largest magnitude in the run."""
    return plain([row for envelope in simulated.envelopes for row in envelope.worst()])


def response(results: Any, cut: Any = None) -> dict[str, Any]:
    """Return the kind, the inputs, the notes and the largest peaks of a response, and its notches."""
    peaks = plain([peak.row() for peak in results.worst()])
    notches = {} if cut is None else {"notches": [vars(each) for each in cut.notches]}
    return {
        "kind": results.kind,
        "inputs": list(results.inputs),
        "peaks": peaks,
        "notes": list(results.notes),
    } | notches


def strength(results: Any) -> dict[str, Any]:
    """Return the largest values of shock spectra and the damage, by table and channel."""
    shocks = {
        name: {
            channel: {
                "maximax": float(x.maximax.max()),
                "unit": SHOCK_UNITS[x.kind],
                "at_hz": float(x.frequency[x.maximax.argmax()]),
            }
            for channel, x in spectra.items()
        }
        for name, spectra in results.shocks.items()
    }
    keys = ("damage", "cycles", "largest", "method")
    damage = {
        name: {channel: {key: getattr(x, key) for key in keys} for channel, x in parts.items()}
        for name, parts in results.fatigue.items()
    }
    return {"srs": shocks, "fatigue": damage}


def correlation(results: Any, reporter: Any) -> dict[str, Any]:
    """Return the pairs of modes that a comparison found, its notes and files."""
    files = [str(f) for f in reporter.files]
    return {"pairs": plain(results.rows()), "notes": list(results.notes), "files": files}


def plain(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows without NaN, which is not JSON.

    Examples
    --------
    >>> plain([{"mac": 1.0, "damping": float("nan")}])
    [{'mac': 1.0, 'damping': None}]
    """
    return [{key: None if x != x else x for key, x in row.items()} for row in rows]


def ensemble(results: Any) -> dict[str, Any]:
    """Return the counts of the cases of an ensemble by status, and a sentence for each that failed; empty without."""
    if results is None:
        return {}
    counts = {status: results.status.count(status) for status in dict.fromkeys(("done", *results.status))}
    return {"cases": len(results), **counts, "notes": list(results.notes), "failures": list(results.failures)}


def mode_rows(table: Any) -> list[dict[str, Any]]:
    """Return the rows of the mode-selection table."""
    mass = [[None if v != v else v for v in row] for row in table.effective_mass.tolist()]  # NaN is not JSON
    frequency = [None if v != v else v for v in table.frequency.tolist()]
    return [
        {
            "kind": table.kind[k],
            "frequency_Hz": frequency[k],
            "effective_mass_kg": mass[k][:3],
            "effective_inertia_kg_m2": mass[k][3:],
            "kept": bool(table.kept[k]),
            "reason": table.reason[k],
        }
        for k in range(len(table.kind))
    ]


def quality(mesh: Any, results: Any) -> dict[str, Any]:
    """Return statistics and findings of a mesh."""
    return {
        "mesh": mesh.source,
        "statistics": {kind: _with_units(vars(row)) for kind, row in results.statistics.items()},
        "free_edges": results.free_edges,
        "joints": results.joints,
        "errors": len(results.errors),
        "warnings": len(results.warnings),
        "findings": [finding.summary(mesh.labels) for finding in results.findings],
        "notes": list(mesh.notes),
    }


def _with_units(row: dict[str, Any]) -> dict[str, Any]:
    units = {"smallest": "_m", "median": "_m", "largest": "_m", "small": "_deg", "large": "_deg"}
    return {f"{key}{units.get(key, '')}": value for key, value in row.items()}


def shapes(generators: Iterable[Any]) -> dict[str, Any]:
    """Return the parametric shapes with their parameters and groups."""
    return {
        g.name: {"meaning": g.meaning, "groups": g.groups, "parameters": [vars(p) for p in g.parameters.values()]}
        for g in generators
    }
