"""Rigid trees of every joint type against Pinocchio's articulated-body algorithm (Featherstone 2008, chapter 7)."""

import numpy as np
import pytest
from multibody.trees import KINDS, order_n, random_state, random_tree
from scipy.spatial.transform import Rotation

from modalprep.multibody.model import joint_types
from modalprep.multibody.model.joint_types import FREE, SPHERICAL
from modalprep.multibody.packing.tree import hinges, pack

pin = pytest.importorskip("pinocchio")


def hinge_models(joint):
    """Pinocchio's joint models of a joint's hinges, axes in the parent's frame at zero."""
    if joint.type == "spherical":
        return [pin.JointModelSpherical()]
    if joint.type == "free":
        return [pin.JointModelFreeFlyer()]
    return [one_axis(hinge) for hinge in hinges(joint) if joint.type != "weld"]


def one_axis(hinge):
    """Pinocchio's joint of one axis; its pitch is the travel for a radian."""
    if not hinge.along:
        return pin.JointModelRevoluteUnaligned(hinge.axis)
    return (
        pin.JointModelHelicalUnaligned(hinge.axis, hinge.along)
        if hinge.about
        else pin.JointModelPrismaticUnaligned(hinge.axis)
    )


def peer(system):
    """Pinocchio's model, and of each moving link of ours its joint there."""
    model, frames, order = pin.Model(), {}, []
    model.gravity.linear = np.array(system.gravity)
    for name in system.order:
        joint, body = system.carrier(name), system.bodies[name]
        parent, place = 0, pin.SE3(np.eye(3), np.zeros(3) if joint.type == "free" else np.array(joint.position))
        if system.parent(joint):
            (carrier, k), base = system.parent(joint), None
            parent, base = frames[carrier]
            place = base * pin.SE3(np.eye(3), np.array(system.bodies[carrier].interface_position[k]))
        for k, hinge in enumerate(hinge_models(joint)):
            parent = model.addJoint(parent, hinge, place, f"{joint.name}.{k}")
            place = pin.SE3.Identity()
            order.append(parent)
        own = place * pin.SE3(
            np.array(joint.rotation) if joint.type not in ("spherical", "free") else np.eye(3), np.zeros(3)
        )
        J = np.trace(body.E0) * np.eye(3) - body.E0
        c = body.s0 / body.m
        inertia = pin.Inertia(body.m, c, J - body.m * (c @ c * np.eye(3) - np.outer(c, c)))
        model.appendBodyToJoint(parent, inertia, own)
        frames[name] = parent, own
    return model, order


def pinocchio_accelerations(system, y, tau):
    """Accelerations in our order of speeds."""
    model, order = peer(system)
    packed = pack(system)
    q, v, forces = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    moving = [i for i, kind in enumerate(packed.types) if joint_types.KINDS[kind].speeds]
    pairs = [(packed.types[i], packed.model.links[i], model.joints[j]) for i, j in zip(moving, order, strict=True)]
    for kind, row, joint in pairs:
        own = y[row["x"] : row["x"] + joint_types.KINDS[kind].coordinates].copy()
        if kind in (SPHERICAL, FREE):
            e = own[-4:] / np.linalg.norm(own[-4:])
            own[-4:] = [*e[1:], e[0]]
        q[joint.idx_q : joint.idx_q + joint.nq] = own
        u = slice(row["u"], row["u"] + joint_types.KINDS[kind].speeds)
        at = slice(joint.idx_v, joint.idx_v + joint.nv)
        v[at], forces[at] = y[packed.nx :][u], tau[u]
    a, out = pin.aba(model, model.createData(), q, v, forces), np.zeros(packed.nu)
    for kind, row, joint in pairs:
        out[row["u"] : row["u"] + joint_types.KINDS[kind].speeds] = a[joint.idx_v : joint.idx_v + joint.nv]
    return out


@pytest.mark.parametrize("seed", range(32))
def test_rigid_trees_of_every_joint_type(seed):
    system = random_tree(seed, root=KINDS[seed % len(KINDS)], prescribed=False, most=1)
    y = random_state(system, seed, size=1.0)
    packed = pack(system)
    tau = np.random.default_rng(seed).standard_normal(packed.nu)
    found, _ = order_n(system, y, np.zeros((len(packed.links), 3)), tau)
    expected = pinocchio_accelerations(system, y, tau)
    # two algorithms of the same kind: round-off times the condition of a few bodies
    assert np.abs(found - expected).max(initial=0.0) <= 1e-12 * np.abs(expected).max(initial=1e-300)


def test_rotation_convention_of_the_peer():
    """SciPy's quaternions (x, y, z, w) are those of the peer."""
    turn = Rotation.from_rotvec([0.1, 0.2, 0.3])
    np.testing.assert_allclose(
        pin.Quaternion(*np.roll(turn.as_quat(), 1)).toRotationMatrix(), turn.as_matrix(), atol=1e-15
    )
