"""One evaluation of a loaded system for all integrators: its derivative, or the accelerations of an implicit stage.

States of the integrators are ``[coordinates | speeds | work]``: the work of loads and prescribed hinges, less what
dampers take, is integrated along, so that the energy balance checks the whole run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_kernel, compile_pass
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.kernels.articulated_body import (
    clear_wrenches,
    forward,
    forward_bias,
    inward,
    inward_bias,
    kinematic,
    outward,
    world,
)
from modalprep.multibody.kernels.callbacks import call_address
from modalprep.multibody.kernels.constraints import (
    Constraints,
    Work,
    aim,
    constraint_accelerations,
    constraint_power,
    constraint_residual,
    implicit_accelerations,
    restrain,
)
from modalprep.multibody.kernels.data import (
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
    Scratch,
    Tree,
    U,
    workspace,
)
from modalprep.multibody.kernels.deployment import Reels, pay_out, take_up
from modalprep.multibody.kernels.forces import Loads, apply, prescribe
from modalprep.multibody.kernels.spatial import copy, get6, get9, inertia_times
from modalprep.multibody.kernels.variable_mass import refresh
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.compliant_constraints import with_bonds
from modalprep.multibody.packing.constraints import constraint_work
from modalprep.multibody.packing.tree import Packed

GOOD, FAILED_CALLBACK = -1, -2  # any other status is the link whose pivot is not positive
LOADED, CALLBACK, TWIN = range(3)  # columns of Model.flags
POWER, SPRINGS, POTENTIAL, CALLBACK_POWER, RAISED, SHARED = range(6)  # columns of Model.shared
# by how much longer steps errors of slow motion are told from those of vibrations, and how often they are smoothed:
# of h omega = 0.5 there is 0.003 left, of 0.03 0.93
WIDE, SMOOTHINGS = 10.0, 3


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
    bonds: Constraints | None  # closed loops, springs and bushings: what an implicit step knows
    bonds_work: Work | None
    reels: Reels | None  # deployments


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
    bonds = with_bonds(loops.arrays if loops else None, loading.arrays)
    work = loops.work if loops else None
    return Model(
        tree, packed.flex, loading.arrays, W, F, loading.motion, loading.tau, loading.slope, np.zeros(nu), linear,
        place, np.array([loading.active, 0, 0], dtype=np.int64), np.zeros(packed.nx + nu), np.zeros(nu),
        np.zeros(SHARED), loops.arrays if loops else None, work, bonds,
        constraint_work(bonds, packed) if bonds else None, loading.reels,
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
    refresh(model.loads.fill, model.loads.tables, tree, flex, t)
    pay_out(model.reels, tree, model.loads, y, model.motion)
    outward(tree, flex, W, F, y, model.motion)
    model.shared[POWER] = 0.0
    if model.flags[LOADED] or model.cons is not None:
        world(tree, W)
    if model.flags[LOADED]:
        energies = apply(model.loads, tree, flex, W, F, y, t, model.tau, model.slope)
        model.shared[POWER], model.shared[SPRINGS], model.shared[POTENTIAL] = energies
    model.shared[POWER] += take_up(model.reels, tree, flex, W, F, y, model.motion, model.tau, model.loads.hinge_at)
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
    flex, W, F = model.flex, model.W, model.F
    if not load(model, t, y):
        return FAILED_CALLBACK
    constraint_residual(model.cons, tree, flex, W, F, y, model.motion, t, model.work)
    status = inward(tree, flex, W, F, model.tau, None, 0.0, 0.0)
    if status >= 0:
        return status
    forward(tree, flex, W, F, model.tau, ydot[nx : nx + nu])
    constraint_accelerations(model.cons, tree, flex, W, F, model.work, 0.0, 0.0, ydot[nx : nx + nu])
    kinematic(tree, y, ydot)
    ydot[nx + nu] = power(model, model.work, y)
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


@compile_kernel
def solve_implicit(model, t, y, c1, c2, by_rate, by_place, places, out):
    """Solve ``(M + c1 D + c2 K) out = F - D by_rate - K by_place`` after `load`; returns the status of `inward`.

    D and K are those of modes and hinges (`linear`) and of springs and bushings. Closed loops hold accelerations, or
    with `places` the coordinates that ``c2 out + by_place`` leads to from y.
    """
    tree, flex, W, F = model.tree, model.flex, model.W, model.F
    constraint_residual(model.bonds, tree, flex, W, F, y, model.motion, t, model.bonds_work)
    aim(model.bonds, tree, flex, W, F, model.bonds_work, c1, c2, places, by_rate, by_place)
    for u in range(len(out)):
        out[u] = -model.linear[1, u] * by_rate[u] - model.linear[0, u] * by_place[u]
    for i in range(len(tree.ints)):
        for u in range(tree.ints[i, U], tree.ints[i, UQ]):
            model.hinge[u] = c1 * model.linear[1, u] + c2 * model.linear[0, u]
            model.tau[u] += out[u]
    _push_modes(tree, F, out)
    status = inward(tree, flex, W, F, model.tau, model.hinge, c1, c2)
    if status < 0:
        forward(tree, flex, W, F, model.tau, out)
        implicit_accelerations(model.bonds, tree, flex, W, F, model.bonds_work, places, out)
    return status


@compile_kernel
def smooth(model, c1, c2, e, scratch):
    """Replace ``e (nu,)`` by ``(M + c1 D + c2 K)^-1 M e``, its rows on closed loops, after `solve_implicit`."""
    tree, flex, W, F, tau = model.tree, model.flex, model.W, model.F, model.tau
    clear_wrenches(tree, flex, W, F)
    for u in range(len(tau)):
        tau[u] = -(c1 * model.linear[1, u] + c2 * model.linear[0, u]) * e[u]
    _push_modes(tree, F, tau)
    inward_bias(tree, flex, W, F, tau)
    forward_bias(tree, flex, W, F, tau, scratch)
    tau[:] = 0.0
    for u in range(len(e)):
        e[u] += scratch[u]
    restrain(model.bonds, tree, flex, W, F, model.bonds_work, e)


@compile_kernel
def keep_slow(model, t, y, c1, c2, e, scratch):
    """Take the errors of vibrations off ``e (nu,)``: `smooth` it by a step at (t, y) that is longer than (c1, c2)."""
    scratch[:] = 0.0
    load(model, t, y)
    solve_implicit(model, t, y, WIDE * c1, WIDE * WIDE * c2, scratch, scratch, False, model.twin)
    for _ in range(SMOOTHINGS):
        smooth(model, WIDE * c1, WIDE * WIDE * c2, e, scratch)


@compile_pass
def power(model, work, y):
    """Power (W) of loads, prescribed hinges and prescribed values of `work` less modal damping, after `forward`."""
    tree, W, nx = model.tree, model.W, model.tree.ints[0, NX]
    total = model.shared[POWER] + constraint_power(work)
    for i in range(len(tree.ints)):
        joint = tree.ints[i, JOINT]
        if joint == PRESCRIBED_REVOLUTE or joint == PRESCRIBED_PRISMATIC:
            f = inertia_times(get6(W, i, IA), get9(W, i, H_), get6(W, i, J_), get6(W, i, A))
            along = f[5] + W[i, PA + 5] if joint == PRESCRIBED_REVOLUTE else f[2] + W[i, PA + 2]
            total += along * model.motion[i, 1]
        for u in range(tree.ints[i, UQ], tree.ints[i, UQ] + tree.ints[i, MODES]):
            total -= model.linear[1, u] * y[nx + u] * y[nx + u]
    return total
