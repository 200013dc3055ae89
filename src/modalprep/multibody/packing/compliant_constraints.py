"""Springs, dampers and bushings between interfaces as rows that give way, beside the rows of closed loops."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.kernels.constraints import ABOUT, CONSTANTS, DISTANCE, IN_A, IN_B, POINT, Constraints
from modalprep.multibody.kernels.force_laws import GROUND, REST_POSITION
from modalprep.multibody.kernels.forces import Loads


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
    >>> with_bonds(None, pack_loads(system, pack(system), 1.0)).yielding.tolist()
    [[9.0, 0.0], [7.0, 0.0]]
    """
    ends, ground, rows = [], [], []
    first = 0 if loops is None else len(loops.ends)
    for at, c in zip(loads.spring_at, loads.spring, strict=True):
        if at[5]:
            continue  # slack at times, and then no row
        rows.append((DISTANCE, first + len(ends), np.zeros(3), c[:2]))
        ends += [at[:2], at[2:4]]
        ground += [np.append(place, np.eye(3)) for place in (c[3:6], c[6:9])]
    for at, c in zip(loads.bushing_at, loads.bushing, strict=True):
        values = c[:REST_POSITION].reshape(2, 6).T
        rows += [(POINT if k < 3 else ABOUT, first + len(ends), np.eye(3)[k % 3], values[k]) for k in range(6)]
        ends += [at[:2], at[2:4]]
        ground += 2 * [c[GROUND:]]
    rows = [row for row in rows if np.any(row[3] > 0)]
    if not rows:
        return loops
    ints = np.array([[kind, end, end + 1, -1] for kind, end, _, _ in rows], dtype=np.int64)
    constants = np.zeros((len(rows), CONSTANTS))
    constants[:, IN_A:IN_B] = [axis for _, _, axis, _ in rows]
    bonds = Constraints(
        tables=loads.tables,
        ends=np.array(ends, dtype=np.int64),
        ground=np.array(ground),
        rows=ints,
        constants=constants,
        terms=np.zeros((0, 4), dtype=np.int64),
        factors=np.zeros(0),
        yielding=np.array([values for *_, values in rows]),
    )
    return bonds if loops is None else _joined(loops, bonds)


def _joined(one: Constraints, two: Constraints) -> Constraints:
    """Return the rows of both; functions of time are those of the first."""
    return Constraints(one.tables, *(np.concatenate(pair) for pair in zip(one[1:], two[1:], strict=True)))
