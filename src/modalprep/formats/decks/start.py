"""Where the bodies of a system start, and what decks of other programs cannot carry."""

from __future__ import annotations

from collections.abc import Collection

from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.loads import PointForce
from modalprep.multibody.model.system import System
from modalprep.multibody.reference.equations import BodyState, body_states


def start_of(system: System) -> dict[str, BodyState]:
    """Return the motion of each body at the start, loops closed: ``p, R`` of its root, ``V`` in its own axes.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", position=(0, 0, 2.0), rate=3.0)
    >>> state = start_of(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))["arm"]
    >>> state.p.tolist(), state.V.tolist()
    ([0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 0.0, 0.0, 3.0])
    """
    evaluator = Evaluator(system)
    motion = evaluator.loading.prescribe(0.0, evaluator.data)
    return dict(zip(system.order, body_states(system, evaluator.packed, evaluator.start, motion), strict=True))


def refuse_others(system: System, what: str, kinds: Collection[str], *, elements: bool) -> None:
    """Refuse a system that a deck cannot carry; `elements`: whether it has springs, dampers and drives of joints."""
    single = ("revolute", "prismatic")
    others = [joint for joint in system.joints if joint.type not in (*kinds, "free")]
    several = [joint for joint in system.joints if joint.type not in single and _acts(joint)]
    hard = [joint for joint in system.joints if any(each.friction or each.limited for each in joint.elements)]
    soft = [] if elements else [joint for joint in system.joints if joint.elements]
    closures = [each for each in system.closures if isinstance(each, Coupler) or each.type not in kinds]
    loads = [load for load in system.loads if not isinstance(load, PointForce)]
    names = [
        ("joints of these types", [joint.name for joint in others]),
        ("springs, drives or motions of joints with several coordinates", [joint.name for joint in several]),
        ("friction or limits of joints", [joint.name for joint in hard]),
        ("springs, dampers and drives of joints", [joint.name for joint in soft]),
        ("these closures and couplers", [each.name for each in closures]),
        ("closures that are not active", [each.name for each in system.closures if not each.active]),
        ("loads other than forces on interfaces", [getattr(load, "name", "") for load in loads]),
        ("bodies whose frame is not that of their root", [k for k, body in system.bodies.items() if not body.at_root]),
        ("an orbit or a body that loses mass", ["environment"] if system.orbit or system.depletions else []),
    ]
    for kind, found in names:
        if found:
            raise InputError(f"{what} cannot carry {kind}: {', '.join(found)}; leave them out")


def _acts(joint: Joint) -> bool:
    return joint.motion is not None or bool(joint.elements)
