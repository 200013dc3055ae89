"""A run of a system in plain sentences."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.results.result import Result
from modalprep.report.explain.body import distrust
from modalprep.report.numbers import quantity
from modalprep.verdicts.notes import warnings_of

PARTS = {
    "kinetic": "kinetic energy",
    "strain": "strain energy",
    "gravity": "energy in gravity",
    "stored": "energy of springs",
    "work": "work of loads and losses",
}
AUDITED = 1e-2  # of the energy's largest part: a balance that anybody should look at


def explain_run(run: Result) -> list[str]:
    """Return how a run ended, what moves, what dominates its energy, how well it balances, and what not to trust.

    Examples
    --------
    >>> time = np.linspace(0.0, 1.0, 3)
    >>> run = Result(time=time, channels={"hinge.angle": np.array([0.0, 0.5, 0.2])}, status="done", message="")
    >>> for sentence in explain_run(run)[:2]: print(sentence)
    The run reached its end, t = 1 s.
    hinge.angle moves most of the joints: from 0 to 0.5 rad.
    """
    return [*describe_run(run), *distrust(warnings_of(run.notes))]


def describe_run(run: Result) -> list[str]:
    """Return how a run ended, what moves and what dominates, without what speaks against it.

    Examples
    --------
    >>> describe_run(Result(time=np.zeros(1), channels={}, status="done", message=""))
    ['The run reached its end, t = 0 s.']
    """
    return [_end(run), *_joints(run), *_bending(run), *_energy(run), *_balance(run), *_effort(run)]


def _end(run: Result) -> str:
    if run.status == "diverged":
        return f"The run did not reach its end: {run.message}; do not use its histories."
    return f"The run reached its end, t = {run.time[-1]:.4g} s." if len(run.time) else "The run has no times."


def _joints(run: Result) -> list[str]:
    """Return the coordinate of a joint that moves most, of rotations before translations."""
    for suffix, unit in ((".angle", "rad"), (".displacement", "m")):
        named = {name: a for name, a in run.channels.items() if name.endswith(suffix) and a.ndim == 1}
        if named:
            name, a = max(named.items(), key=lambda item: float(np.ptp(item[1])))
            return [f"{name} moves most of the joints: from {a.min():.4g} to {a.max():.4g} {unit}."]
    return []


def _bending(run: Result) -> list[str]:
    modal = {name: np.abs(a) for name, a in run.channels.items() if name.endswith(".modal") and a.size}
    if not modal:
        return []
    name, a = max(modal.items(), key=lambda item: float(item[1].max()))
    k = int(a.max(axis=0).argmax())
    return [f"Of the bodies '{name.removesuffix('.modal')}' bends most, mostly in its mode {k + 1}."]


def _energy(run: Result) -> list[str]:
    size = {
        text: float(np.ptp(run.channels[f"energy.{key}"]))
        for key, text in PARTS.items()
        if f"energy.{key}" in run.channels
    }
    if not size or not max(size.values()) > 0:
        return []
    first = sorted(size, key=lambda text: -size[text])[:2]
    return [
        f"Its {first[0]} changes most, by {quantity(size[first[0]], 'J')}, then its "
        f"{first[1]}, by {quantity(size[first[1]], 'J')}."
    ]


def _balance(run: Result) -> list[str]:
    error = run.stats.get("energy_error")
    if error is None:
        return []
    advice = ": lower rtol until the histories no longer change" if error > AUDITED else ""
    return [f"Its energy balances to {100 * error:.2g} % of its largest part{advice}."]


def _effort(run: Result) -> list[str]:
    method, steps = run.stats.get("method"), run.stats.get("steps")
    if method is None or steps is None:
        return []
    return [f"It took {steps:.0f} steps by the method {str(method).replace('_', ' ')}."]
