"""The step control of a run that ended, kept for another run that goes on from there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.multibody.integration.stepping import Run

ARRAYS = ("y", "ydot", "old", "K", "rows", "size", "modal_size", "kept", "turns")
CLOCK = (
    "time",
    "next_step",
    "error",
    "last_step",
    "begin",
    "power_before",
    "kink",
    "slow_share",
    "share_step",
    "energy",
    "energy_size",
)
SAME = ("fixed_step", "rtol", "atol", "rho_inf")  # without which the steps would be others anyway


def step_control(run: Run, method: str, longest: float) -> dict[str, np.ndarray]:
    """Return what the next steps of a run depend on, besides its equations; its user allows the `longest` step (s).

    Returns
    -------
    dict of array
        Arrays of `Run`, entries of its clock, and the method by its name.
    """
    found = {name: _numbers(run, name).copy() for name in ARRAYS}
    clock = {name: np.array(run.clock[0][name]) for name in (*CLOCK, *SAME)}
    stable = run.clock[0].longest if run.clock[0].longest < longest else 0.0  # none
    return found | clock | {"method": np.array(method), "longest": np.array(stable)}


def go_on(run: Run, kept: Mapping[str, np.ndarray], method: str, longest: float) -> None:
    """Let a run that has begun take the steps that the one before would have taken, where method and step agree."""
    if not kept or str(kept["method"]) != method:
        return
    if any(run.clock[0][name] != kept[name] for name in SAME):
        return
    if any(_numbers(run, name).shape != kept[name].shape for name in ARRAYS):
        return
    for name in ARRAYS:
        _numbers(run, name)[...] = kept[name]
    for name in CLOCK:
        run.clock[name] = kept[name]
    run.clock["longest"] = min(longest, float(kept["longest"]) or np.inf)


def _numbers(run: Run, name: str) -> np.ndarray:
    """Return an array of a run as floating-point numbers, those of records in a row."""
    return getattr(run, name).view(np.float64)
