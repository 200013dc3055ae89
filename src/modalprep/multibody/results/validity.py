"""What a run says against itself: deflections beyond the theory, energy and momenta that do not stay, divergence."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.body.deflection import mesh_at
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.error import station_errors
from modalprep.multibody.results.result import Result
from modalprep.verdicts.notes import warnings_of
from modalprep.verdicts.verdict import FAILED, PASSED, UNCHECKED, Requirement

BEYOND = 0.1  # of the body's size: displacements linear in the modes, and their second order, hold to about that
TURNED = 0.3  # rad, within a body: what is there moves 1.7 % too far, as the sine of the angle is its angle
PRECISE = 0.01  # of the body's size: the most that stations may leave
LOOKED_AT = 200  # times of the largest bounds, at which the displacement of every node is computed
AUDIT = 1000  # times rtol: a balance that is worse fails the run; most are better than rtol
MOMENTUM = 100  # likewise of momenta, which all methods keep exactly, but not free flight in other variables
TOLD = 3  # times rtol: a balance that is worse is told, as then the motion may be off by ten times rtol and more
WORST = 0.1  # whatever rtol
ROUND_OFF = 1e-9  # of the energies themselves
STILL = 1e-6  # m/s: the energy of this speed counts as none
UNAUDITED = "is not audited"
END, BALANCE = "end of the run", "energy balance"
FREE, BEGINS = "momenta of what nothing holds", "the time it begins"
LOWER = "do not trust the histories; lower rtol"
DISTRUST = f"{LOWER}, and look at "


def body_warnings(bodies: Mapping[str, FlexibleBody]) -> tuple[str, ...]:
    """Return the warnings of the bodies of a system, each with the first body that has it.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> light = uniform_beam(modes=1).with_(notes=("its mass is implausible",))
    >>> body_warnings({"left": light, "right": light})
    ("body 'left': its mass is implausible",)
    """
    first: dict[str, str] = {}
    for name, body in bodies.items():
        for note in warnings_of(body.notes):
            first.setdefault(note, f"body {name!r}: {note}")
    return tuple(first.values())


def large_deflections(
    bodies: Mapping[str, FlexibleBody], time: np.ndarray, modal: Mapping[str, np.ndarray]
) -> tuple[str, ...]:
    """Return a note for each body that deflects by more than a tenth of its size, or turns within itself by 0.3 rad.

    Parameters
    ----------
    bodies : {name: FlexibleBody}
    time : (nt,)
        s.
    modal : {name: (nt, n)}
        Modal coordinates of the bodies.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> modal = {"arm": np.array([[0.0], [8.0]])}
    >>> note = large_deflections({"arm": uniform_beam(modes=1)}, np.array([0.0, 2.0]), modal)[0]
    >>> note.partition(": ")[0]
    "body 'arm' deflects by 4.54 m at t = 2 s, 45 % of its size"
    >>> note.partition(": ")[2]
    'above 10 % the theory is not valid; use several bodies or stations'
    """
    bent = {name: (body, np.asarray(modal[name])) for name, body in bodies.items() if body.n}
    found = (_note(name, body, time, q) or _turned(name, body, time, q) for name, (body, q) in bent.items())
    return tuple(note for note in found if note)


def _note(name: str, body: FlexibleBody, time: np.ndarray, q: np.ndarray) -> str:
    size = np.ptp(body.points, axis=0).max(initial=0.0)
    each = np.abs(body.shape).max(axis=(0, 1), initial=0.0)
    rows = _largest(q, each * np.sqrt(3), BEYOND * size)
    if not len(rows):
        return ""
    reach = np.linalg.norm(mesh_at(body, q[rows]) - body.points, axis=2).max(axis=1, initial=0.0)
    if not reach.max(initial=0.0) > BEYOND * size > 0:
        return ""
    at = int(np.argmax(reach))
    share = 100 * reach[at] / size
    where = f"{reach[at]:.3g} m at t = {time[rows[at]]:.4g} s, {share:.0f} % of its size"
    if body.stations:
        return f"body {name!r} deflects by {where}: {_left(body, q[rows[at]], size)}"
    return (
        f"body {name!r} deflects by {where}: above {100 * BEYOND:.0f} % the theory is not "
        "valid; use several bodies or stations"
    )


def _left(body: FlexibleBody, q: np.ndarray, size: float) -> str:
    """Return what the stations of a body leave, and where that is much, what to do."""
    found = station_errors(body, q[None])
    error = float(found.both[0])
    said = f"its {len(body.stations or ())} stations leave about {error:.1g} m of it, {100 * error / size:.1g} %"
    stiff = bool(found.basis[0] > found.spacing[0])
    if stiff:
        said += ", most by the derivatives that its basis leaves out"
    more = "more derivatives" if stiff else "more stations"
    return said + (f", more than {PRECISE:.0%}: take {more}" if error > PRECISE * size else "")


def _largest(q: np.ndarray, each: np.ndarray, limit: float) -> np.ndarray:
    """Return the times at which the bounds of modal coordinates (nt, n) are largest, those beyond the limit."""
    bound = np.nan_to_num(np.abs(q)) @ each
    if not bound.max(initial=0.0) > limit:
        return np.zeros(0, dtype=int)
    rows = np.argsort(bound)[::-1][:LOOKED_AT]
    return rows[bound[rows] > limit]


def _turned(name: str, body: FlexibleBody, time: np.ndarray, q: np.ndarray) -> str:
    """Return the note on the interface that turns most against the root: an arm there moves by the sine, not the angle.

    A shaft twisted by 0.3, 0.6 and 1 rad moves the end of an arm 1.7, 5.5 and 15 % too far: about the angle's square
    over six.
    """
    if body.stations:
        return ""
    rows = _largest(q, np.sqrt((body.psi**2).sum(axis=1)).max(axis=0, initial=0.0), TURNED)
    if not len(rows):
        return ""
    angle = np.linalg.norm(np.einsum("kan,tn->tka", body.psi, q[rows]), axis=2)
    if not np.any(angle > TURNED):
        return ""
    at, k = np.unravel_index(np.argmax(angle), angle.shape)
    most = angle[at, k]
    where = f"at {body.interface_name[k]!r} at t = {time[rows[at]]:.4g} s"
    return (
        f"body {name!r} turns within itself by {most:.2g} rad {where}, so that an arm there moves about "
        f"{100 * most**2 / 6:.0f} % too far: above {TURNED:g} rad the theory is not valid; use several bodies or "
        "stations"
    )


def audits(run: Result, rtol: float, mass: float) -> list[Requirement]:
    """Return what every run is required to do: reach its end, balance its energy, keep the momenta of what is free.

    Parameters
    ----------
    rtol : float
        Relative tolerance of the run.
    mass : float
        Of all bodies, kg.

    Examples
    --------
    >>> run = Result(time=np.arange(2.0), channels={"energy.kinetic": np.ones(2), "energy.error": np.array([0.0, 0.5])},
    ...              status="done", message="", stats={"energy_error": 0.5})
    >>> [(audit.name, audit.result) for audit in audits(run, 1e-5, 1.0)]
    [('end of the run', 'passed'), ('energy balance', 'FAILED')]
    """
    if run.status == "diverged":
        return [Requirement(name=END, result=FAILED, says=f"the run did not reach its end: {run.message}")]
    found = [Requirement(name=END, result=PASSED, says=f"t = {run.time[-1]:.6g} s" if len(run.time) else "")]
    found += [Requirement(name="momenta", result=UNCHECKED, says=note) for note in run.notes if UNAUDITED in note]
    energy, kept, lost = (run.stats.get(name) for name in ("energy_error", "momentum_error", "momentum_restored"))
    if energy is not None and not _counts(run, mass):
        found.append(Requirement(name=BALANCE, result=PASSED, says="the energies differ by round-off only"))
    elif energy is not None:
        wrong = f"the energy balances to {energy:.0e} only, which is {{}}: {DISTRUST}'energy.error' for {BEGINS}"
        found.append(_audit(BALANCE, energy, AUDIT, rtol, wrong))
    if kept is not None:
        wrong = f"the {FREE} stay to {kept:.0e} only, which is {{}}: {DISTRUST}'momentum.error' for {BEGINS}"
        found.append(_audit("momenta", kept, MOMENTUM, rtol, wrong))
    if lost is not None:
        wrong = f"the steps lost {lost:.0e} of the {FREE}, which is {{}}: they were given back, but {LOWER}"
        found.append(_audit("momenta given back", lost, AUDIT, rtol, wrong))
    return found


def _audit(name: str, error: float, times: float, rtol: float, wrong: str) -> Requirement:
    """Return the requirement that an error stays below a number of times rtol; `wrong` says what to do."""
    limit = _limit(times, rtol)
    if error > limit:
        return Requirement(name=name, result=FAILED, says=wrong.format(_worse(times, rtol)))
    return Requirement(name=name, result=PASSED, says=f"{error:.1e} of the largest part, limit {limit:.0e}")


def failures(run: Result, rtol: float, mass: float) -> tuple[str, ...]:
    """Return the sentences that make a run fail; arguments as `audits`.

    Examples
    --------
    >>> run = Result(time=np.arange(2.0), channels={"energy.kinetic": np.ones(2), "energy.error": np.array([0.0, 0.5])},
    ...              status="done", message="", stats={"energy_error": 0.5})
    >>> failures(run, 1e-5, 1.0)[0][:55]
    'the energy balances to 5e-01 only, which is worse than '
    """
    return tuple(audit.says for audit in audits(run, rtol, mass) if audit.result == FAILED)


def _limit(times: float, rtol: float) -> float:
    return min(times * rtol, WORST)


def _worse(times: float, rtol: float) -> str:
    return f"worse than {_limit(times, rtol):.0e} ({times} times rtol, at most {WORST:.0%})"


def imbalance(run: Result, rtol: float, mass: float) -> tuple[str, ...]:
    """Return the note on an energy that balances worse than three times the tolerance; arguments as `failures`.

    Examples
    --------
    >>> channels = {"energy.kinetic": np.ones(3), "energy.error": np.array([0, 0, 2e-3])}
    >>> run = Result(
    ...     time=np.arange(3.0), channels=channels, status="done", message="", stats={"energy_error": 2e-3}
    ... )
    >>> imbalance(run, 1e-5, 1.0)[0][:82]
    'the energy balances to 0.002 of its largest part, 200 times rtol, from t = 2 s on:'
    """
    error = run.stats.get("energy_error", 0.0)
    if not error > TOLD * rtol or not _counts(run, mass):
        return ()
    found = np.abs(run.channels["energy.error"])
    begins = run.time[np.argmax(found > TOLD * rtol / error * found.max())]
    return (
        f"the energy balances to {error:.2g} of its largest part, {error / rtol:.0f} times rtol, from "
        f"t = {begins:.4g} s on: there are vibrations, or light bodies in fast motion, that the steps do not follow to "
        "the tolerance; forces, which are stiffness times deflection, may be as wrong or more; lower rtol until they "
        "no longer change",
    )


def _counts(run: Result, mass: float) -> bool:
    """Whether the error is more than round-off of the energies, and of a system at rest."""
    energies = [np.abs(run.channels[name]).max() for name in run.channels if name.startswith("energy.")]
    error = np.abs(run.channels.get("energy.error", np.inf)).max()
    return bool(error > ROUND_OFF * max(energies, default=0.0) + mass * STILL**2)
