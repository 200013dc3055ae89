"""How a run is drawn, and what of it is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.loads import GROUND, AxialSpring
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.records import Record

SHOWN = 2.0  # deflection in body sizes up to which a diverging run is shown
SIDES = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False, kw_only=True)
class FilmStyle(Record):
    """How the motion of a system is drawn.

    Attributes
    ----------
    colour : str
        ``displacement``, or a component of a recovery over the mesh, ``<recovery>.<component>`` such as
        ``skin.von_mises``; other parts are then grey.
    exaggeration : float
        Factor of the deflections; the picture states it. Joints of the tree stay together, closures come apart.
    trails : sequence of str
        Interfaces, ``<body>.<interface>``, that draw their path behind them.
    follow : str
        Body that the camera follows; none by default.
    boxes : sequence of str
        Rigid bodies that are drawn as the uniform box of their mass and inertia; others are rods between interfaces.
    title : str
        In the picture.

    Examples
    --------
    >>> FilmStyle(exaggeration=0.0)
    Traceback (most recent call last):
    modalprep.errors.InputError: exaggeration = 0 must be a positive number
    """

    colour: str = "displacement"
    exaggeration: float = 1.0
    trails: Sequence[str] = ()
    follow: str = ""
    boxes: Sequence[str] = ()
    title: str = ""

    def __post_init__(self) -> None:
        """Refuse a factor that hides or turns deflections."""
        if not 0 < self.exaggeration < float("inf"):
            raise InputError(f"exaggeration = {self.exaggeration:g} must be a positive number")


def never_out(name: str, system: System | DeployingSystem, result: Result) -> bool:
    """Say whether a body is the massless exit of a deployment, or one of its rods that stays stowed."""
    if not isinstance(system, DeployingSystem) or name in system.bodies:
        return False
    return name in {d.exit_body for d in system.deployments} or f"{name}.origin" not in result.channels


def last_shown(bodies: dict[str, FlexibleBody], bends: dict[str, np.ndarray]) -> int:
    """Row up to which every body's deflection is less than `SHOWN` of its size."""
    last = len(next(iter(bends.values()))) - 1
    for name, rows in bends.items():
        body = bodies[name]
        most = SHOWN * np.ptp(np.vstack([body.points, body.interface_position]), axis=0).max()
        far = [k for k, bend in enumerate(rows) if not np.abs(bend).max(initial=0.0) <= (most or np.inf)]
        last = min([last, *(k - 1 for k in far[:1])])
    return max(last, 0)


def colour_range(amounts: list[np.ndarray], signed: bool) -> tuple[float, float]:
    """Return the ends of the colour scale: from 0, unless there are negative values."""
    known = np.concatenate([np.zeros(1), *amounts])
    known = known[np.isfinite(known)]
    return (float(known.min()) if signed else 0.0), float(known.max())


def clock(end: float) -> Callable[[float], str]:
    """Return what writes times (s) of a run up to `end`, in ms where it is short.

    Examples
    --------
    >>> clock(20.0)(3.0), clock(0.05)(0.012), clock(8e4)(60.0)
    ('3.0 s', '12.0 ms', '60 s')
    """
    factor, unit = (1e3, "ms") if 0 < end < 1 else (1.0, "s")
    decimals = max(0, 2 - int(np.floor(np.log10(factor * end)))) if end > 0 else 2
    return lambda time: f"{factor * time:.{decimals}f} {unit}"


def box_corners(body: FlexibleBody) -> np.ndarray:
    """Return the corners (8, 3) of the uniform box that has the mass and the inertia of a rigid body.

    Raises
    ------
    InputError
        When the body is flexible, or has no inertia about its centre of mass.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> inertia = np.diag([4.0 + 9.0, 1.0 + 9.0, 1.0 + 4.0]) / 12  # of a box of 1 kg, 1 m by 2 m by 3 m
    >>> box = rigid_body("box", mass=1.0, centre=np.zeros(3), inertia=inertia, interfaces={"root": np.zeros(3)})
    >>> np.ptp(box_corners(box), axis=0).round(9)
    array([1., 2., 3.])
    """
    if body.n:
        raise InputError(f"body {body.name!r} is flexible and has no box; leave it out of boxes")
    centre = body.s0 / body.m
    second, axes = np.linalg.eigh(body.E0 - body.m * np.outer(centre, centre))
    sides = np.sqrt(12 * np.maximum(second, 0.0) / body.m)
    if not sides.any():
        raise InputError(f"body {body.name!r} has no inertia about its centre and so no box; leave it out of boxes")
    return centre + (SIDES * sides) @ axes.T


def lines_between(system: System, result: Result) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
    """Yield the names of the prismatic joints and the springs, and both of their ends over time ``(n_times, 3)``."""
    found: list[tuple[Joint | AxialSpring, tuple[str, str]]] = [
        (joint, (joint.parent, f"{joint.child}.{_root(system, joint)}".removesuffix(".")))
        for joint in system.joints
        if joint.type == "prismatic"
    ]
    found += [(load, load.between) for load in system.loads if isinstance(load, AxialSpring)]
    for element, ends in found:
        first, second = (_place(result, element, end) for end in ends)
        if first is not None and second is not None:
            yield element.name, (first, second)


def _root(system: System, joint: Joint) -> str:
    """Return the interface of the child, where the joint does not say it."""
    return "" if "." in joint.child else system.bodies[system.child(joint)].interface_name[0]


def _place(result: Result, element: Joint | AxialSpring, end: str) -> np.ndarray | None:
    if end == GROUND:
        return np.broadcast_to(element.position, (len(result.time), 3))
    name = f"{end}.position"
    return result[name] if name in result.channels else None
