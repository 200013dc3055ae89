"""What a response says against itself: missing modes, mass and recoveries, deflections beyond linear theory."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.quality.effective_mass import totals
from modalprep.reduction.table import ATTACHMENT, CONSTRAINT, DIRECTIONS, FIXED, FREE, TRUNCATION
from modalprep.response.dropped import BASE, dropped_below
from modalprep.response.modal import ModalEquations

SHOWN = 0.95  # effective mass in a driven direction below which a note says so
BEYOND = 0.1  # of the body's size: displacements are linear in the modes to about that
TELLING = 0.02  # of the force of a rigid body
SOME = 5  # dropped modes whose frequencies a warning lists
LOOKED_AT = 20  # points of the axis with the largest bounds, at which the displacement of every node is computed


def highest_mode(body: FlexibleBody) -> float:
    """Return the highest frequency (Hz) of the kept normal modes of a body's reduction; without a table, of its modes.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> round(highest_mode(uniform_beam(modes=2)), 2)
    1.21
    """
    table = body.modes
    normal = [table.kept[k] and kind not in (CONSTRAINT, TRUNCATION) for k, kind in enumerate(table.kind)]
    found = table.frequency[np.array(normal, dtype=bool)] if any(normal) else body.frequency
    found = found[np.isfinite(found)]
    return float(found.max(initial=0.0)) or float(body.frequency.max())


def missing_modes(body: FlexibleBody, equations: ModalEquations, top: float) -> list[str]:
    """Return warnings of modes that a response up to a frequency `top` (Hz) needs, and that the body has not.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response.modal import modal_equations
    >>> beam = uniform_beam(modes=2)
    >>> missing_modes(beam, modal_equations(beam, ["base.y"], 0.01), 9.0)
    ['the response goes up to 9 Hz, but the highest kept mode has 1.209 Hz: beyond it the dropped modes are missing']
    """
    said = []
    dropped = dropped_below(body, equations.inputs, top)
    if len(dropped):
        shown = ", ".join(f"{f:.4g}" for f in dropped[:SOME]) + ", ..." * (len(dropped) > SOME)
        still = int(np.sum(equations.M == 0))
        count = f"{len(dropped)} mode{'s' * (len(dropped) > 1)}"
        statics = f", and the {still} truncation vectors that mix them act statically" if still else ""
        if ATTACHMENT in body.modes.kind:
            statics += f", and {ATTACHMENT} modes, which mix them, resonate elsewhere"
        said.append(
            f"the body drops {count} in the band ({shown} Hz), whose resonances are "
            f"missing{statics}; keep them, with 'frequency < {top:.4g} Hz'"
        )
    if top > highest_mode(body):
        said.append(
            f"the response goes up to {top:.4g} Hz, but the highest kept mode has {highest_mode(body):.4g} Hz: "
            "beyond it the dropped modes are missing"
        )
    return said


def limits_of_validity(body: FlexibleBody, equations: ModalEquations, top: float | None = None) -> list[str]:
    """Return what a user should know of a response up to a frequency `top` (Hz): its mass, recoveries and damping.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response.modal import modal_equations
    >>> beam = uniform_beam(modes=2)
    >>> limits_of_validity(beam, modal_equations(beam, ["base.y"], 0.01))[0][:51]
    'the modes have 61.3 % of the effective mass for bas'
    """
    notes = []
    for name, b in zip(equations.inputs, equations.B.T, strict=True):
        if not name.startswith(f"{BASE}."):
            continue
        axis = DIRECTIONS.index(name.removeprefix(f"{BASE}."))
        moved = b @ (equations.M * b)
        total = totals(body)[axis]
        held = 0.0 if body.modes.held_mass is None else body.modes.held_mass[axis]
        if total > 0 and moved + held < SHOWN * total:
            effect = np.inf if top is None else _of_rigid_rest(body, axis, total - moved - held, top) / total
            right = f", which changes the force there by {100 * effect:.1f} % of a rigid body's at most"
            at_base = f" and the held root {100 * held / total:.1f} %" if held > 0 else ""
            notes.append(
                f"the modes have {100 * moved / total:.1f} % of the effective mass for {name}{at_base}; the rest moves "
                f"with the base as if it were rigid{right if effect < TELLING else ''}"
            )
    still = [name for name, x in body.recovery.items() if not x.moves]
    if still:
        notes.append(f"mode displacement, without the static response of dropped modes: {', '.join(still)}")
    if equations.coupled:
        notes.append("damping couples the modes: the coupled equations are solved")
    return notes


def _of_rigid_rest(body: FlexibleBody, axis: int, rest: float, top: float) -> float:
    """Return what the rest of the mass, as dropped modes without damping, would add to a rigid body's force (kg).

    A mode at f_d amplifies its mass by ``1 / (1 - (f / f_d)^2)``; what no candidate has is above the highest of them.
    """
    table = body.modes
    dropped = np.array([kind == FIXED for kind in table.kind], dtype=bool) & ~table.kept
    known = np.array([kind in (FIXED, FREE) for kind in table.kind], dtype=bool)
    f = np.append(table.frequency[dropped], table.frequency[known].max(initial=0.0))
    mass = np.append(table.effective_mass[dropped, axis], max(rest, 0.0))
    if not np.all(np.isfinite(mass)) or np.any(f <= top):
        return np.inf
    ratio = (top / f) ** 2
    return float(mass @ (ratio / (1 - ratio)))


def large_deflection(body: FlexibleBody, equations: ModalEquations, q: np.ndarray, what: str = "deflects") -> list[str]:
    """Say that magnitudes of modal coordinates ``q (nt, n)`` deflect the body by more than a tenth of its size.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response.modal import modal_equations
    >>> beam = uniform_beam(modes=1)
    >>> large_deflection(beam, modal_equations(beam, ["base.y"]), np.array([[8.0]]))
    ['the body deflects by 4.6 m, 46 % of its size: above 10 % linear theory is not valid']
    """
    if not len(body.points) or not body.shape.size:
        return []
    shape = body.shape @ equations.basis
    bound = np.abs(q) @ np.linalg.norm(shape, axis=1).max(axis=0)
    size = float(np.ptp(body.points, axis=0).max())
    if not bound.max(initial=0.0) > BEYOND * size > 0:
        return []
    top = q[np.argsort(-bound)[:LOOKED_AT]]
    u = float(np.linalg.norm(np.tensordot(top, shape, (1, 2)), axis=2).max())
    text = f"the body {what} by {u:.3g} m, {100 * u / size:.0f} % of its size: above 10 % linear theory is not valid"
    return [text] if u > BEYOND * size else []
