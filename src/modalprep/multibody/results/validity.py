"""What a run says against itself: deflections beyond the theory, an energy that does not balance, divergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import deflected_points
from modalprep.multibody.model.loads import Load
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.multibody.results.result import Result

BEYOND = 0.1  # of the body's size: displacements linear in the modes, and their second order, hold to about that
LOOKED_AT = 200  # times of the largest bounds, at which the displacement of every node is computed
AUDIT = 1000  # times rtol: a balance that is worse fails the run; most are better than rtol
WORST = 0.1  # whatever rtol
ROUND_OFF = 1e-9  # of the energies themselves
STILL = 1e-6  # m/s: the energy of this speed counts as none


def large_deflections(
    bodies: Mapping[str, FlexibleBody], time: np.ndarray, modal: Mapping[str, np.ndarray]
) -> tuple[str, ...]:
    """Return a note for each body that deflects by more than a tenth of its size.

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
    >>> for note in large_deflections({"arm": uniform_beam(modes=1)}, np.array([0.0, 2.0]), modal): print(note)
    body 'arm' deflects by 4.54 m at t = 2 s, 45 % of its size: above 10 % the theory is not valid; use several bodies
    """
    found = (_note(name, body, time, np.asarray(modal[name])) for name, body in bodies.items() if body.n)
    return tuple(note for note in found if note)


def wound_springs(loads: Sequence[Load], run: Result) -> tuple[str, ...]:
    """Return a note for each rotational spring that passes half a turn, where its torque jumps.

    Parameters
    ----------
    loads : sequence of Load
    run : Result
        With the springs' channels.
    """
    found = []
    for name in [load.name for load in loads if isinstance(load, RotationalSpring)]:
        jumps = np.abs(np.diff(run[f"{name}.angle"])) > np.pi
        if np.any(jumps):
            found.append(
                f"rotational spring {name!r} passes half a turn at t = {run.time[np.argmax(jumps)]:.4g} s, where its "
                "torque and its energy jump: make it an element of a joint, whose angle counts the turns"
            )
    return tuple(found)


def _note(name: str, body: FlexibleBody, time: np.ndarray, q: np.ndarray) -> str:
    size, each = np.ptp(body.points, axis=0).max(initial=0.0), np.abs(body.shape).max(axis=(0, 1), initial=0.0)
    bound = np.nan_to_num(np.abs(q)) @ each * np.sqrt(3)
    rows = np.argsort(bound)[::-1][:LOOKED_AT]
    rows = rows[bound[rows] > BEYOND * size]
    if not len(rows):
        return ""
    reach = np.linalg.norm(deflected_points(body, q[rows]) - body.points, axis=2).max(axis=1, initial=0.0)
    if not reach.max(initial=0.0) > BEYOND * size > 0:
        return ""
    at = int(np.argmax(reach))
    share, where = 100 * reach[at] / size, f"{reach[at]:.3g} m at t = {time[rows[at]]:.4g} s"
    return (
        f"body {name!r} deflects by {where}, {share:.0f} % of its size: above {100 * BEYOND:.0f} % the theory is not "
        "valid; use several bodies"
    )


def failures(run: Result, rtol: float, mass: float) -> tuple[str, ...]:
    """Return the sentences that make a run fail: it diverged, or its energy does not balance.

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
    >>> failures(run, 1e-5, 1.0)[0][:55]
    'the energy balances to 5e-01 only, which is worse than '
    """
    if run.status == "diverged":
        return (f"the run did not reach its end: {run.message}",)
    error, limit = run.stats.get("energy_error", 0.0), min(AUDIT * rtol, WORST)
    if error <= limit or not _counts(run, mass):
        return ()
    return (
        f"the energy balances to {error:.0e} only, which is worse than {limit:.0e} ({AUDIT} times rtol, at most "
        f"{WORST:.0%}): do not trust the histories; lower rtol, and look at 'energy.error' for the time it begins",
    )


def _counts(run: Result, mass: float) -> bool:
    """Whether the error is more than round-off of the energies, and of a system at rest."""
    energies = [np.abs(run.channels[name]).max() for name in run.channels if name.startswith("energy.")]
    error = np.abs(run.channels.get("energy.error", np.inf)).max()
    return bool(error > ROUND_OFF * max(energies, default=0.0) + mass * STILL**2)
