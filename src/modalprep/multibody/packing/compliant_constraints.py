"""Springs, dampers and bushings between interfaces as rows that give way, beside the rows of closed loops."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.kernels.constraints import ABOUT, DISTANCE, END, POINT, ROW, TERM, Constraints
from modalprep.multibody.kernels.loads.laws import GROUND, GROUND_ROTATION, REST_POSITION
from modalprep.multibody.kernels.loads.loads import Loads


def with_bonds(loops: Constraints | None, loads: Loads) -> Constraints | None:
    """Return the rows that an implicit step knows: those of closed loops, then of springs and bushings.

    A spring is a row along its line, a bushing a row per axis of its first end that has stiffness or damping. What
    turns the line and the axes is left to the sweeps, and so are springs that can go slack.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> from modalprep.multibody.model.loads import Bushing
    >>> from modalprep.multibody.packing.loads import pack_loads
    >>> from modalprep.multibody.model.system import System
    >>> block = rigid_body("block", mass=2.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> mount = Bushing(name="mount", between=("ground", "block.root"), stiffness=np.array([9.0, 0, 0, 0, 0, 7.0]),
    ...                 damping=np.zeros(6))
    >>> free = Joint(name="free", type="free", parent="ground", child="block")
    >>> system = System(bodies={"block": block}, joints=(free,), loads=(mount,))
    >>> with_bonds(None, pack_loads(system, pack(system), 1.0)).rows["stiffness"]
    array([9., 7.])
    """
    ends, rows = [], []
    first = 0 if loops is None else len(loops.ends)
    for at, c in zip(loads.spring_at, loads.spring, strict=True):
        if at[5]:
            continue  # slack at times, and then no row
        rows.append((DISTANCE, first + len(ends), np.zeros(3), c[:2]))
        ends += [_end(at[:2], c[3:6], np.eye(3)), _end(at[2:4], c[6:9], np.eye(3))]
    for at, c in zip(loads.bushing_at, loads.bushing, strict=True):
        values = c[:REST_POSITION].reshape(2, 6).T
        rows += [(POINT if k < 3 else ABOUT, first + len(ends), np.eye(3)[k % 3], values[k]) for k in range(6)]
        ends += [_end(place, c[GROUND:GROUND_ROTATION], c[GROUND_ROTATION:]) for place in (at[:2], at[2:4])]
    rows = [row for row in rows if np.any(row[3] > 0)]
    if not rows:
        return loops
    packed = np.zeros(len(rows), ROW).view(np.recarray)
    for row, (kind, end, axis, (stiffness, damping)) in zip(packed, rows, strict=True):
        row["kind"], row["a"], row["b"], row["table"] = kind, end, end + 1, -1
        row["in_a"], row["stiffness"], row["damping"] = axis, stiffness, damping
    bonds = Constraints(
        loads.tables, np.array(ends, END).view(np.recarray), packed, np.zeros(0, TERM).view(np.recarray)
    )
    return bonds if loops is None else _joined(loops, bonds)


def _end(at: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> tuple:
    return (*at, position, np.ravel(rotation))


def _joined(one: Constraints, two: Constraints) -> Constraints:
    """Return the rows of both; functions of time are those of the first."""
    return Constraints(
        one.tables, *(np.concatenate(pair).view(np.recarray) for pair in zip(one[1:], two[1:], strict=True))
    )
