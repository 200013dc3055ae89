"""What a deck says of its analysis, as lines of the pipeline file; what these cannot hold stands in comments."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.analysis import AnalysisCase
from modalprep.fe.mesh.mesh import Mesh
from modalprep.pipeline.init.case import BAND
from modalprep.pipeline.init.proposal import comment, key, numbers, quoted
from modalprep.pipeline.schema.pipeline import BUILT_IN

MODES, MOST_MODES = 10, 500  # candidates without a word of the deck, and the most that it may ask for
MOST_LOADS = 12  # that are active: each adds a mode


def load_tables(mesh: Mesh, case: AnalysisCase | None) -> list[str]:
    """Return the tables of the static loads of a case, and in comments those of others."""
    active = case.loads[:MOST_LOADS] if case else ()
    tables = {name: f"[loads.{key(name)}]\nset = {quoted(name)}" for name in mesh.loads}
    parts = [f"# A static load of the deck, on {len(mesh.loads[one].nodes)} nodes.\n{tables[one]}" for one in active]
    others = [table for name, table in tables.items() if name not in active]
    if others:
        intro = "# Further static loads of the deck, for truncation_vectors."
        parts.append("\n".join([intro, *map(comment, others)]))
    return parts


def said_lines(case: AnalysisCase) -> list[str]:
    """Return comments of what the file cannot hold: gravity and a lowest frequency."""
    lines = []
    if np.any(case.gravity):
        g = numbers(case.gravity, 1.0)
        lines.append(f"# Gravity of {case.name} is {g} m/s^2: 'inertia' among the truncation vectors has its static")
        lines.append(f"# response, and a system has it by [environment] gravity = {g}.")
    if case.lowest:
        lines.append(f"# Modes above {case.lowest:g} Hz are asked for; a body needs those below too.")
    return lines


def modes_text(case: AnalysisCase, in_band: int | None) -> str:
    """Return the number of candidate modes and where it comes from; a deck may ask for all by a large number."""
    if case.modes and case.modes <= MOST_MODES:
        return f"{case.modes}  # candidates, as many as {case.name} asks for"
    if in_band is not None and case.highest and in_band <= MOST_MODES:
        return f"{max(in_band, 1)}  # candidates, those up to {BAND:g} times the {case.highest:g} Hz of {case.name}"
    asked = f", where {case.name} asks for {case.modes}" if case.modes else ""
    return f"{MODES}  # candidates{asked}{f', of {in_band} in the band' if in_band else ''}"


def band_lines(case: AnalysisCase) -> list[str]:
    """Return the highest frequency as a comment: to measure the error up to it takes the modes of the full model."""
    if case.highest is None:
        return []
    what = "Hz, the highest frequency of the deck: measures the error against the full model up to there"
    return [f"# up_to = {case.highest:.10g}  # {what}"]


def damping_text(case: AnalysisCase) -> str:
    """Return the value of the damping and where it comes from."""
    if case.damping is None:
        return "0.01  # ASSUMPTION: of critical, of every mode"
    given = case.damping
    if isinstance(given, dict):
        return f"{{ alpha = {given['alpha']:.10g}, beta = {given['beta']:.10g} }}  # of the deck, 1/s and s"
    if isinstance(given, list):
        pairs = ", ".join(f"[{f:.10g}, {ratio:.10g}]" for f, ratio in given)
        return f"[{pairs}]  # of the deck: Hz and share of critical"
    return f"{given:.10g}  # of the deck: share of critical"


def vector_lines(case: AnalysisCase) -> list[str]:
    """Return the truncation vectors where the deck has static loads."""
    active = case.loads[:MOST_LOADS]
    names = ", ".join(quoted(name) for name in (*BUILT_IN, *active))
    return [f"truncation_vectors = [{names}]  # loads whose static response stays exact"] if active else []
