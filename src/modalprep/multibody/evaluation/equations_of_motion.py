"""The equations of motion of a system as one call of compiled code, for loops in Python."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import bound, compile_kernel
from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluate import Equations, build_equations, load, respond
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.kernels.modal import add_modal_loads
from modalprep.multibody.model.loads import Callback
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack
from modalprep.suggest import refuse_other

FEW = 32  # speeds: `update` takes a few microseconds


@by_address
class Call(NamedTuple):
    """All that the compiled function reads and writes, at places that do not change."""

    equations: Equations
    time: np.ndarray  # (1,) s
    y: np.ndarray  # (nx + nu,)
    tau: np.ndarray  # (nu,)
    ydot: np.ndarray  # (nx + nu,)
    t_end: float  # s


@compile_kernel
def update(call):
    """Write the derivative of the state, NaN where there is none."""
    eq = call.equations
    t = call.time[0]
    eq.tau[:] = 0.0
    load(eq, t, call.y)
    for u in range(len(eq.tau)):
        eq.tau[u] += call.tau[u]
    add_modal_loads(eq.data.modal, eq.model, call.tau)
    if respond(eq, t, call.y, call.ydot) >= 0 or not 0.0 <= t <= call.t_end:
        call.ydot[:] = np.nan


@partial(compile_kernel, nogil=False)
def update_at_once(call):
    """Do as `update`, but keep Python's lock: releasing it takes as long as evaluating two links."""
    update(call)


class EquationsOfMotion:
    """The derivative of a system's state, in compiled code whose arguments are prepared once.

    For control loops, integrators of other libraries and whatever else calls it from Python: `update` takes a tenth of
    a microsecond beside the evaluation itself. Write to `y`, `tau` and `time`, call `update`, read `ydot`; or call the
    object as a function of time and state. An integrator of another library knows nothing of the functions of time: let
    it end steps where they jump, and give it a longest step, or it steps over short pulses.

    Parameters
    ----------
    system : System
        Without callbacks: what they would do is added to `tau` before the call.
    t_end : float
        Functions of time are known from 0 to this time, s.

    Attributes
    ----------
    packed : Packed
        Where joints and modes stand in the state: `coordinates_of`, `speeds_of`, `modes_of`.
    time : (1,)
        s; 0 at first.
    y : (nx + nu,)
        State ``[coordinates | speeds]``; at first the start, closed loops closed. They stay so only to the error of
        an integration, as nothing projects y.
    tau : (nu,)
        Forces on the speeds beside the loads: torques (N m), forces (N), modal forces; zero at first.
    ydot : (nx + nu,)
        Derivative of y, its last nu numbers the accelerations. NaN where the mass matrix is not positive or the time
        is not between 0 and `t_end`.
    update : callable
        Without arguments: writes `ydot`. Other Python threads run meanwhile if there are more than 32 speeds.

    Raises
    ------
    InputError
        When the system has callbacks, or its loops cannot be closed at the start.

    References
    ----------
    Theory 5.1, 5.2 and 5.4.

    Examples
    --------
    >>> from scipy.integrate import solve_ivp
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> rod = rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([1e-3, 1 / 12, 1 / 12]),
    ...                  interfaces={"root": np.zeros(3)})
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="rod")
    >>> equations = EquationsOfMotion(System(bodies={"rod": rod}, joints=(hinge,), gravity=np.array([0, -10.0, 0])))
    >>> equations.update()
    >>> equations.ydot.round(6)  # 3/2 g / l
    array([  0., -15.])
    >>> equations.tau[:] = 5.0  # holds it
    >>> run = solve_ivp(equations, (0.0, 0.1), equations.y.copy())
    >>> bool(abs(run.y[0, -1]) < 1e-12)
    True
    """

    def __init__(self, system: System, t_end: float = 1.0) -> None:
        refuse_other("equations of motion: the system", System, system)
        called = [load.name for load in system.loads if isinstance(load, Callback)]
        if called:
            raise InputError(
                f"equations of motion: callback {called[0]!r} is Python; add what it does to `tau` instead"
            )
        self.packed = packed = pack(system)
        loading = Loading(system, packed, t_end)
        data = packed.data()
        self.time = np.zeros(1)
        self.y = start_state(packed)
        self.tau = np.zeros(packed.nu)
        if loading.loops:
            self.y = loading.loops.assemble(data, self.y, loading.prescribe(0.0, data))
        self.ydot = np.zeros(packed.nx + packed.nu)
        equations = build_equations(packed, loading, data)
        call = Call(equations, self.time, self.y, self.tau, self.ydot, float(t_end))
        self.update = bound(update_at_once if packed.nu <= FEW else update, call)

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the derivative of a state.

        Parameters
        ----------
        t : float
            s.
        y : (nx + nu,)
            ``[coordinates | speeds]``.

        Returns
        -------
        (nx + nu,)
            A new array, NaN as `ydot`.

        Raises
        ------
        InputError
            When y has another length.
        """
        if len(y) != len(self.y):
            raise InputError(f"equations of motion: the state has {len(y)} numbers, not {len(self.y)}")
        self.time[0], self.y[:] = t, y
        self.update()
        return self.ydot.copy()
