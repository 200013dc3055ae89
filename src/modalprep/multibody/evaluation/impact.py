"""Sudden constraints and impacts: jumps of the speeds by impulses of closures, in O(n) by the order-n recursion.

Closures ``G u = b(t)`` that act for no time change the speeds by ``u+ = u- + M^-1 G' p``. Those that hold already, and
those that begin, leave the rate ``Phi' = 0``; those that are only hit return it by ``Phi'+ = -e Phi'-`` (Newton). The
responses ``M^-1 G'`` and ``G M^-1 G'`` are those of the closed loops (see `constraints`); springs, gravity and all
other finite forces do nothing in no time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.kernels.closed_loops import constraint_forces, constraints, responses
from modalprep.multibody.kernels.closed_loops.factor import RANK_TOLERANCE
from modalprep.multibody.kernels.data import Data
from modalprep.multibody.model.system import System
from modalprep.records import Record
from modalprep.suggest import refuse_other, refuse_unknown

MOST_ITERATIONS, SETTLED = 2000, 1e-13  # of friction and normal impulses against each other


@dataclass(frozen=True, eq=False, kw_only=True)
class Impact(Record):
    """What a sudden constraint or an impact did.

    Attributes
    ----------
    t : float
        s.
    y : (nx + nu,)
        State after it; the coordinates are those before. `coordinates` reads it by name.
    impulse : dict
        ``name.force`` (3,) N s and ``name.torque`` (3,) N m s on b, at b, in a's axes; ``name.multiplier`` of couplers.
    energy_loss : float
        Kinetic energy that its impulses took, J; prescribed hinges that move may give some back.
    sticks : dict of str to bool
        Of each closure with friction that was hit: whether b's point stopped sliding.
    """

    t: float
    y: np.ndarray
    impulse: dict[str, np.ndarray]
    energy_loss: float
    sticks: dict[str, bool]


class Contact(NamedTuple):
    """A closure with friction among the rows of an impact: its normal rows, rows of sliding, coefficient."""

    normal: list[int]
    slide: list[int]
    friction: float


def impact(
    system: System, y: np.ndarray | None = None, *, closures: Sequence[str], restitution: float = 0.0, t: float = 0.0
) -> Impact:
    """Return what happens when closures act suddenly on a state.

    Closures of the system that are active hold throughout, as do prescribed motions.

    Parameters
    ----------
    y : (nx + nu,) or None
        State before; None: the start.
    closures : sequence of str
        Closures that act suddenly, usually ``active = False`` ones; their gaps may be open.
    restitution : float
        Newton's coefficient, 0 (plastic: the closure's motion stops, energy lost ``r (G M^-1 G')^-1 r / 2`` with its
        rate r before) to 1 (no energy is lost without friction).
    t : float
        s, at which functions of time are taken.

    Returns
    -------
    Impact
        Speeds after, impulses (N s, N m s) and the energy lost (J).

    Raises
    ------
    InputError
        When a name is unknown, or the restitution is not between 0 and 1.
    SimulationError
        When no impulse is found that satisfies Coulomb's law.

    References
    ----------
    F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 8; theory 9.4.

    Examples
    --------
    A rod of 1 m that falls flat at 1 m/s is caught at one end.

    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.constraints import Closure
    >>> from modalprep.multibody.model.joint import Joint
    >>> rod = rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0, 1 / 12, 1 / 12]),
    ...                  interfaces={"end": np.zeros(3)})
    >>> fall = Joint(name="fall", type="planar", parent="ground", child="rod", second_axis=np.array([1.0, 0, 0]),
    ...              speed=np.array([0, -1.0]))
    >>> pin = Closure(name="pin", type="point_on_plane", a="ground", b="rod.end", axis=np.array([0, 1.0, 0]),
    ...               active=False)
    >>> caught = impact(System(bodies={"rod": rod}, joints=(fall,), closures=(pin,)), closures=["pin"])
    >>> caught.impulse["pin.force"].round(12) + 0.0, round(caught.energy_loss, 12)
    (array([0.  , 0.25, 0.  ]), 0.125)
    """
    refuse_other("impact: the system", System, system)
    names = [closure.name for closure in system.closures]
    for name in closures:
        refuse_unknown(name, names, "impact: closure")
    if not 0 <= restitution <= 1:
        raise InputError(f"impact: restitution = {restitution:g} must be between 0 and 1")
    evaluator = Evaluator(system, t)
    state = evaluator.start if y is None else np.asarray(y, dtype=float)
    if evaluator.loops is None:
        raise InputError("impact: the system has no closures; name what is hit by a Closure with active = False")
    evaluator.load(state)
    struck = [names.index(name) for name in closures]
    return strike(evaluator.loops, evaluator.data, state, t, struck, restitution)


def strike(loops: Loops, data: Data, y: np.ndarray, t: float, struck: Sequence[int], restitution: float) -> Impact:
    """Return what closures `struck` (numbers) do to a state, after its kinematics, loads and `Loops.residual`."""
    packed, work, system = loops.packed, loops.work, loops.system
    none = np.zeros(packed.nu)
    if responses.inward_with_rows(loops.arrays, packed.model, data, work, none, None, 0.0, 0.0) >= 0:
        raise SimulationError(f"impact at t = {t:g} s: the mass matrix is not positive, a deflection is too large")
    responses.gather_responses(work)
    acting = {k: 1.0 for k in range(len(system.closures)) if loops.active(k)}
    acting |= dict.fromkeys(struck, 1 + restitution)
    contacts = {k: _contact(loops, k) for k in acting if loops.closing.sliding(k)}
    target = _target(loops, acting)
    what = f"impact at t = {t:g} s"
    work.multiplier[:], sticks = impulses(work.S, work.rate, target, list(contacts.values()), what)
    constraint_forces.multiplier_response(packed.model, data, work)
    after = y.copy()
    after[packed.nx : packed.nx + packed.nu] += work.step
    return Impact(
        t=t,
        y=after,
        impulse=loops.exerted(),
        energy_loss=-_work_done(loops),
        sticks={system.closures[k].name: stuck for k, stuck in zip(contacts, sticks, strict=True)},
    )


def _contact(loops: Loops, k: int) -> Contact:
    sliding = loops.closing.sliding(k)
    coefficient, _ = loops.closing.rows[sliding[0]].friction
    return Contact(loops.closing.normal(k), sliding, coefficient)


def _target(loops: Loops, acting: dict[int, float]) -> np.ndarray:
    """Return the changes of rates (m,) that closures want, by the factor on what they take off; NaN of other rows."""
    target = np.full(len(loops.work.rate), np.nan)
    work = loops.work
    closing = loops.closing
    for k, factor in acting.items():
        slide = closing.sliding(k)
        for i in closing.of(k):
            if work.S[i, i] > (0.0 if i in slide else closing.least_mobility[i]):
                target[i] = -work.rate[i] * (1.0 if i in slide else factor)
    return target


def _work_done(loops: Loops) -> float:
    """Work of the impulses on the mean of the rates before and after, without those of prescribed values."""
    work = loops.work
    frictional = np.array([row.kind == constraints.SLIP for row in loops.closing.rows])
    moving = work.rate + np.where(frictional, 0.0, work.driven_rate)
    return float(work.multiplier @ (moving + work.S @ work.multiplier / 2))


def impulses(
    S: np.ndarray, rate: np.ndarray, target: np.ndarray, contacts: Sequence[Contact], what: str = "impact"
) -> tuple[np.ndarray, list[bool]]:
    """Return the impulses p (m,) that change the rates by ``S p = target``, and which contacts stick.

    Each contact sticks where ``|p_t| <= mu |p_n|``; else it slides on with ``p_t = -mu |p_n| s``, s the direction in
    which it slides after the impact. Rows whose `target` is not a number take no part.

    Parameters
    ----------
    S : (m, m)
        ``G M^-1 G'``.
    rate, target : (m,)
        Rates before and their wanted change.
    what : str
        Begins the sentence of an error.

    Raises
    ------
    SimulationError
        When no impulses are found that satisfy Coulomb's law.

    Examples
    --------
    A particle of 2 kg falls at 1 m/s and slides at 3 m/s; the rows are normal and tangential.

    >>> S, rate = np.eye(2) / 2, np.array([-1.0, 3.0])
    >>> p, sticks = impulses(S, rate, -rate, [Contact([0], [1], 0.25)])
    >>> p, sticks
    (array([ 2. , -0.5]), [False])
    """
    sliding: dict[int, np.ndarray] = {}  # impulses of contacts that slide on
    while True:
        p = _settled(S, rate, target, contacts, sliding, what)
        slipping = [
            c
            for c, contact in enumerate(contacts)
            if c not in sliding and np.linalg.norm(p[contact.slide]) > _limit(p, contact) * (1 + 1e-12)
        ]
        if not slipping:
            return p, [c not in sliding for c in range(len(contacts))]
        for c in slipping:
            sliding[c] = _limit(p, contacts[c]) * _unit(p[contacts[c].slide])


def _limit(p: np.ndarray, contact: Contact) -> float:
    return contact.friction * float(np.linalg.norm(p[contact.normal]))


def _unit(v: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(v)
    return v / size if size > 0 else v


def _settled(S, rate, target, contacts, sliding: dict[int, np.ndarray], what: str) -> np.ndarray:
    """Let the impulses of contacts that slide, updated in place, and of all other rows follow each other."""
    slide = [i for c in sliding for i in contacts[c].slide]
    rows = [i for i in np.flatnonzero(np.isfinite(target)) if i not in slide]
    solve = _pseudo_inverse(S[np.ix_(rows, rows)])
    p = np.zeros(len(rate))
    for _ in range(MOST_ITERATIONS):
        for c, push in sliding.items():
            p[contacts[c].slide] = push
        p[rows] = solve @ (target[rows] - S[np.ix_(rows, slide)] @ p[slide])
        after = rate + S @ p
        change = 0.0
        for c, push in sliding.items():
            slip = after[contacts[c].slide]
            sliding[c] = -_limit(p, contacts[c]) * (_unit(slip) if np.any(slip) else -_unit(push))
            change = max(change, np.linalg.norm(sliding[c] - push))
        if change <= SETTLED * np.linalg.norm(p):
            return p
    raise SimulationError(
        f"{what}: no impulses are found that satisfy Coulomb's law; lower the coefficient of friction"
    )


def _pseudo_inverse(S: np.ndarray) -> np.ndarray:
    """Inverse of a symmetric matrix whose dependent rows are left out, scaled to a unit diagonal."""
    scale = 1 / np.sqrt(np.diag(S))
    return np.linalg.pinv(S * np.outer(scale, scale), rcond=RANK_TOLERANCE, hermitian=True) * np.outer(scale, scale)
