"""Geometrically exact planar beams by Exudyn, an independent multibody program (github.com/jgerstmayr/EXUDYN)."""

from itertools import pairwise

import numpy as np


def exudyn_ends(exudyn, places, step, times, *, EI, mass, rotary, axial, shear, push=None, until=np.inf, turn=None):
    """Where both ends of a straight beam are, rows of x, y, x, y, at the times (s), ascending.

    `places (n + 1, 2)` are those of the nodes; `mass` and `rotary` per length. `push` is a force and a torque on the
    first node until one of the times; `turn` a function of time, its angle on a shaft.
    """
    from exudyn import itemInterface as items

    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    nodes = [mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[*place, 0.0])) for place in places]
    for pair, length in zip(pairwise(nodes), np.linalg.norm(np.diff(places, axis=0), axis=1), strict=True):
        beam = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=[*pair],
            length=length,
            massPerLength=mass,
            crossSectionInertia=rotary,
            bendingStiffness=EI,
            axialStiffness=axial,
            shearStiffness=shear,
        )
        mbs.AddObject(beam)
    loads = []
    if push is not None:
        end = mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=nodes[0]))
        loads = [items.LoadForceVector(markerNumber=end, loadVector=[*push[0], 0]),
                 items.LoadTorqueVector(markerNumber=end, loadVector=[0, 0, push[1]])]  # fmt: skip
    loads = [mbs.AddLoad(load) for load in loads]
    if turn is not None:
        ground = mbs.AddMarker(
            items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0)
        )
        for k in range(3):
            own = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=k))
            law = {"offsetUserFunction": lambda mbs, t, item, offset: turn(t)} if k == 2 else {}
            mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, own], **law))
    mbs.Assemble()
    settings, out, begin = exudyn.SimulationSettings(), [], 0.0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0 if turn is None else 0.95
    settings.solution.file.write = False
    settings.timeIntegration.verboseMode = 0
    for t in times:
        settings.timeIntegration.startTime, settings.timeIntegration.endTime = begin, t
        settings.timeIntegration.numberOfSteps = round((t - begin) / step)
        mbs.SolveDynamic(settings, updateInitialValues=True)
        for load in loads if t >= until else ():
            mbs.SetLoadParameter(load, "loadVector", [0.0, 0.0, 0.0])
        kind, begin = exudyn.OutputVariableType.Position, t
        out.append(np.concatenate([mbs.GetNodeOutput(k, kind)[:2] for k in (nodes[0], nodes[-1])]))
    return np.array(out)
