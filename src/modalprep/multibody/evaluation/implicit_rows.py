"""What an implicit step knows of constraints: rows of closed loops, and rows of springs, which are compliant."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.elements.registry import KINDS, Loads
from modalprep.multibody.kernels.closed_loops.constraints import (
    END,
    ROW,
    TERM,
    Constraints,
)
from modalprep.multibody.packing.tree import rows


def with_force_elements(loops: Constraints | None, loads: Loads) -> Constraints | None:
    """Return the rows that an implicit step knows: those of closed loops, then those of force elements.

    A spring is a row along its line, a bushing a row for each axis of its first end that has stiffness or damping.
    The iterations of the implicit step see how the line and the axes turn, and springs that can go slack.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.elements.registry import pack_loads
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> from modalprep.multibody.model.loads import Bushing
    >>> from modalprep.multibody.model.system import System
    >>> block = rigid_body("block", mass=2.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> mount = Bushing(name="mount", between=("ground", "block.root"), stiffness=np.array([9.0, 0, 0, 0, 0, 7.0]),
    ...                 damping=np.zeros(6))
    >>> free = Joint(name="free", type="free", parent="ground", child="block")
    >>> system = System(bodies={"block": block}, joints=(free,), loads=(mount,))
    >>> with_force_elements(None, pack_loads(system, pack(system), 1.0)).rows["stiffness"]
    array([9., 7.])
    """
    stiff = {name: kind.implicit for name, kind in KINDS.items() if kind.implicit}
    found = [row for name, implicit in stiff.items() for row in implicit(getattr(loads.elements, name))]
    found = [row for row in found if row.stiffness > 0 or row.damping > 0]
    if not found:
        return loops
    first = 0 if loops is None else len(loops.ends)
    packed = np.zeros(len(found), ROW).view(np.recarray)
    for k, row in enumerate(found):
        own = packed[k]
        own.kind = row.kind
        own.a = first + 2 * k
        own.b = first + 2 * k + 1
        own.table = -1
        own.in_a, own.stiffness, own.damping = row.axis, row.stiffness, row.damping
    ends = rows(END, [end for row in found for end in row.ends])
    compliant = Constraints(loads.environment.tables, ends, packed, rows(TERM, []))
    return compliant if loops is None else _joined(loops, compliant)


def _joined(one: Constraints, two: Constraints) -> Constraints:
    """Return the rows of both; functions of time are those of the first."""
    fields = ([getattr(x, name) for x in (one, two)] for name in ("ends", "rows", "terms"))
    return Constraints(one.tables, *(np.concatenate(pair).view(np.recarray) for pair in fields))
