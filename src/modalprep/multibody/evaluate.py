"""One evaluation of a loaded system for all integrators: its derivative, or the accelerations of an implicit stage.

States of the integrators are ``[coordinates | speeds | work]``: the work of loads and prescribed hinges, less what
dampers take, is integrated along, so that the energy balance checks the whole run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_kernel, compile_pass
from modalprep.multibody.algebra import copy, get6, get9, inertia_times
from modalprep.multibody.callbacks import call_address
from modalprep.multibody.constraints import (
    Constraints,
    Work,
    constraint_accelerations,
    constraint_power,
    constraint_residual,
)
from modalprep.multibody.forces import Loads, apply, prescribe
from modalprep.multibody.kernel import forward, inward, kinematic, outward, world
from modalprep.multibody.layout import (
    COORDINATES,
    H_,
    IA,
    J_,
    JOINT,
    MODES,
    NX,
    PA,
    PRESCRIBED_PRISMATIC,
    PRESCRIBED_REVOLUTE,
    SLOT,
    SPEEDS,
    UQ,
    XQ,
    A,
    Flex,
    Packed,
    Scratch,
    Tree,
    U,
    workspace,
)
from modalprep.multibody.loading import Loading
from modalprep.multibody.system import System

GOOD, FAILED_CALLBACK = -1, -2  # any other status is the link whose pivot is not positive
LOADED, CALLBACK, TWIN = range(3)  # columns of Model.flags
POWER, SPRINGS, POTENTIAL, CALLBACK_POWER, RAISED, SHARED = range(6)  # columns of Model.shared


class Model(NamedTuple):
    """All arrays of one evaluation: constants, loads, scratch."""

    tree: Tree
    flex: Flex | None
    loads: Loads
    W: np.ndarray
    F: Scratch | None
    motion: np.ndarray  # (nl, 3)
    tau: np.ndarray  # (nu,)
    slope: np.ndarray  # (2, nu) of tau by the hinge's coordinate and speed
    hinge: np.ndarray  # (nu,) added to the hinges' inertias by an implicit step
    linear: np.ndarray  # (2, nu) stiffness and damping that an implicit step knows: modes, hinges
    place: np.ndarray  # (nu,) int, coordinate whose rate is this speed; -1 of a turn about three axes, or a free body
    flags: np.ndarray  # (3,) int: whether there are loads; addresses of Python's loads and accelerations, or 0
    state: np.ndarray  # (nx + nu,) what Python sees of the state
    twin: np.ndarray  # (nu,) accelerations of the dense twin
    shared: np.ndarray  # (5,) power (W), energy in springs and a central field (J), power of callbacks, one raised
    cons: Constraints | None  # closed loops
    work: Work | None  # their scratch


def build_model(system: System, packed: Packed, loading: Loading) -> Model:
    """Return the arrays of a packed system and its loads; modal stiffness and damping stand in `linear`."""
    nu, tree = packed.nu, packed.tree
    W, F = workspace(tree, packed.flex)
    linear, place = np.zeros((2, nu)), np.full(nu, -1, dtype=np.int64)
    for link, row, (x, u, count) in zip(packed.links, tree.ints, straight(packed), strict=True):
        place[u : u + count] = np.arange(x, x + count)
        if link.body:
            modes = slice(row[UQ], row[UQ] + row[MODES])
            linear[0, modes], linear[1, modes] = system.bodies[link.body].K, system.bodies[link.body].D
    loops = loading.loops
    return Model(
        tree, packed.flex, loading.arrays, W, F, loading.motion, loading.tau, loading.slope, np.zeros(nu), linear,
        place, np.array([loading.active, 0, 0], dtype=np.int64), np.zeros(packed.nx + nu), np.zeros(nu),
        np.zeros(SHARED), loops.arrays if loops else None, loops.work if loops else None,
    )  # fmt: skip


def straight(packed: Packed) -> list[tuple[int, int, int]]:
    """Return first coordinate, first speed and count of the coordinates of every link that are integrals of speeds."""
    found = []
    for row, kind in zip(packed.tree.ints, packed.types, strict=True):
        own = row[UQ] - row[U] if COORDINATES[kind] == SPEEDS[kind] else 0
        found.append((int(row[XQ] - own), int(row[UQ] - own), int(own + row[MODES])))
    return found


@compile_pass
def load(model, t, y):
    """Kinematics and all loads at a state, up to `inward`; False when a callback raised."""
    tree, flex, W, F = model.tree, model.flex, model.W, model.F
    prescribe(model.loads, t, model.motion)
    outward(tree, flex, W, F, y, model.motion)
    model.shared[POWER] = 0.0
    if model.flags[LOADED] or model.cons is not None:
        world(tree, W)
        constraint_residual(model.cons, tree, flex, W, F, y, model.motion, t, model.work)
    if model.flags[LOADED]:
        energies = apply(model.loads, tree, flex, W, F, y, t, model.tau, model.slope)
        model.shared[POWER], model.shared[SPRINGS], model.shared[POTENTIAL] = energies
    if model.flags[CALLBACK]:
        copy(y, model.state)
        call_address(model.flags[CALLBACK], t)
        model.shared[POWER] += model.shared[CALLBACK_POWER]
        return model.shared[RAISED] == 0.0
    return True


@compile_kernel
def evaluate(model, t, y, ydot):
    """Time derivative of ``[coordinates | speeds | work]``; returns GOOD, FAILED_CALLBACK or the link that failed."""
    tree, nx, nu = model.tree, model.tree.ints[0, NX], len(model.tau)
    if not load(model, t, y):
        return FAILED_CALLBACK
    status = inward(tree, model.flex, model.W, model.F, model.tau, None, 0.0, 0.0)
    if status >= 0:
        return status
    forward(tree, model.flex, model.W, model.F, model.tau, ydot[nx : nx + nu])
    _close(model, ydot[nx : nx + nu])
    kinematic(tree, y, ydot)
    ydot[nx + nu] = power(model, y)
    if model.flags[TWIN]:
        copy(y, model.state)
        call_address(model.flags[TWIN], t)
        copy(model.twin, ydot[nx : nx + nu])
    return GOOD


@compile_pass
def hinge_slopes(model):
    """Write the hinges' stiffness and damping of the last `load` to `linear`, negative ones as zero."""
    for i in range(len(model.tree.ints)):
        for u in range(model.tree.ints[i, U], model.tree.ints[i, UQ]):
            model.linear[0, u] = max(0.0, -model.slope[0, u])
            model.linear[1, u] = max(0.0, -model.slope[1, u])


@compile_pass
def _push_modes(tree, F, force):
    """Add generalised forces to the modal loads; F is an argument of its own so that None leaves nothing to compile."""
    if F is not None:
        for i in range(len(tree.ints)):
            for a in range(tree.ints[i, MODES]):
                F.load[tree.ints[i, SLOT], a] += force[tree.ints[i, UQ] + a]


@compile_pass
def solve_implicit(model, c1, c2, force, out):
    """Solve ``(M + c1 D + c2 K) out = F + force`` after `load`, D and K of `linear`; returns the status of `inward`."""
    tree = model.tree
    for i in range(len(tree.ints)):
        for u in range(tree.ints[i, U], tree.ints[i, UQ]):
            model.hinge[u] = c1 * model.linear[1, u] + c2 * model.linear[0, u]
            model.tau[u] += force[u]
    _push_modes(tree, model.F, force)
    status = inward(tree, model.flex, model.W, model.F, model.tau, model.hinge, c1, c2)
    if status < 0:
        forward(tree, model.flex, model.W, model.F, model.tau, out)
        _close(model, out)
    return status


@compile_pass
def _close(model, udot):
    """Let closed loops act on the accelerations of `forward`; drift is left to projection after steps."""
    constraint_accelerations(model.cons, model.tree, model.flex, model.W, model.F, model.work, 0.0, 0.0, udot)


@compile_pass
def power(model, y):
    """Power (W) of loads and prescribed hinges less modal damping, after `forward`."""
    tree, W, nx = model.tree, model.W, model.tree.ints[0, NX]
    total = model.shared[POWER] + constraint_power(model.work)
    for i in range(len(tree.ints)):
        joint = tree.ints[i, JOINT]
        if joint == PRESCRIBED_REVOLUTE or joint == PRESCRIBED_PRISMATIC:
            f = inertia_times(get6(W, i, IA), get9(W, i, H_), get6(W, i, J_), get6(W, i, A))
            along = f[5] + W[i, PA + 5] if joint == PRESCRIBED_REVOLUTE else f[2] + W[i, PA + 2]
            total += along * model.motion[i, 1]
        for u in range(tree.ints[i, UQ], tree.ints[i, UQ] + tree.ints[i, MODES]):
            total -= model.linear[1, u] * y[nx + u] * y[nx + u]
    return total
