"""State feedback that minimises a quadratic cost (LQR)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.multibody.control.marginal import unmoved
from modalprep.multibody.control.riccati import solve_riccati
from modalprep.multibody.control.rows import places, positive, rows
from modalprep.multibody.control.truncation import ReducedSystem
from modalprep.records import Record
from modalprep.suggest import refuse_other

SMALL = 1e-300  # least weight of an input


@dataclass(frozen=True, eq=False, kw_only=True)
class Regulator(Record):
    """State feedback ``i = -K z``.

    Attributes
    ----------
    K : (ni, nz)
        Gains, units of the input per unit of the state.
    inputs, states : tuple of str
        Rows and columns of K.
    poles : (nz,) complex
        Of the closed loop, 1/s, the least damped first.
    cost : (nz, nz)
        The cost from a state z on is ``z' cost z``; of a reduced system that of its own states.
    plant : LinearSystem
        The whole one, of whose states K is.
    notes : tuple of str
    """

    K: np.ndarray
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    poles: NDArray[np.complex128]
    cost: np.ndarray
    plant: LinearSystem
    notes: tuple[str, ...] = ()

    @property
    def closed_loop(self) -> LinearSystem:
        """The plant with the feedback; its inputs act besides."""
        linear = self.plant
        own = [linear.inputs.index(name) for name in self.inputs]
        return LinearSystem(
            A=linear.A - linear.B[:, own] @ self.K,
            B=linear.B,
            C=linear.C - linear.D[:, own] @ self.K,
            D=linear.D,
            states=linear.states,
            inputs=linear.inputs,
            outputs=linear.outputs,
            notes=linear.notes,
        )


def lqr(linear: LinearSystem, weights: Mapping[str, float], inputs: Mapping[str, float]) -> Regulator:
    """Return the state feedback ``i = -K z`` that minimises the integral of ``sum w o^2 + sum r i^2``.

    Parameters
    ----------
    linear : StateSpace, LinearSystem or ReducedSystem
        From `linearise`. Gains of a reduced system are expanded to the states of the whole one, with whose poles the
        regulator is checked.
    weights : {name: w}
        Of outputs and states o, in 1 / unit^2.
    inputs : {name: r}
        Of the inputs that the regulator drives, in 1 / unit^2; others are left alone.

    Returns
    -------
    Regulator

    Raises
    ------
    InputError
        When a name is unknown or a weight is not positive; when an input moves no motion that does not decay by itself,
        or the weights see none.
    SimulationError
        When the Riccati equation is not solved accurately, or gains of a reduced system leave the whole one unstable.

    References
    ----------
    B. D. O. Anderson, J. B. Moore, Optimal Control: Linear Quadratic Methods, Prentice Hall 1990, chapters 2 and 3.

    Examples
    --------
    >>> mass = LinearSystem(A=np.array([[0, 1.0], [0, 0]]), B=np.array([[0], [1.0]]), C=np.zeros((0, 2)),
    ...                     D=np.zeros((0, 1)), states=("slide.displacement", "slide.speed"), inputs=("slide",),
    ...                     outputs=())
    >>> lqr(mass, {"slide.displacement": 1.0, "slide.speed": 1.0}, {"slide": 1.0}).K  # 1, sqrt(3)
    array([[1.        , 1.73205081]])
    """
    refuse_other("lqr: the linear system", LinearSystem, linear)
    if not inputs:
        raise InputError(f"lqr: give a weight for each input that the regulator drives; {linear.inputs} are there")
    own = places(inputs, linear.inputs, "lqr: input")
    weighed = rows(linear, weights, "lqr: weight")
    effort = positive(inputs, "lqr: weight of input", least=SMALL)
    A, B, D = linear.A, linear.B[:, own], weighed.D[:, own]
    seen = np.sqrt(weighed.numbers)[:, None] * weighed.C
    _refuse_unmoved(linear, B, seen, list(inputs))
    Q = seen.T @ seen
    R = np.diag(effort) + D.T @ (weighed.numbers[:, None] * D)
    S = weighed.C.T @ (weighed.numbers[:, None] * D)
    cost, K, poles = solve_riccati(A, B, Q, R, S, "lqr")
    found = {"inputs": tuple(inputs), "cost": cost, "notes": linear.notes}
    if isinstance(linear, ReducedSystem):
        return _expanded(linear, K @ linear.W.T, own, found)
    return Regulator(K=K, states=linear.states, poles=poles, plant=linear, **found)


def _refuse_unmoved(linear: LinearSystem, B: np.ndarray, seen: np.ndarray, inputs: list[str]) -> None:
    """Refuse a system that the inputs cannot stabilise, and weights that leave something adrift."""
    told = ", ".join(map(repr, inputs))
    if found := unmoved(linear.A, B):
        raise InputError(
            f"lqr: {told} cannot stabilise the system: {found.told(linear.states)} does not decay, and no input moves "
            "it; add an input or damping there"
        )
    if found := unmoved(linear.A.T, seen.T):
        raise InputError(
            f"lqr: the weights do not see {found.told(linear.states)}, which does not decay by itself; weigh one of "
            "its states"
        )


def _expanded(linear: ReducedSystem, K: np.ndarray, own: list[int], found: dict) -> Regulator:
    """Return the regulator of the whole system by the gains of the reduced one."""
    whole = linear.full
    poles = np.linalg.eigvals(whole.A - whole.B[:, own] @ K).astype(np.complex128)
    if not np.all(poles.real < 0):
        raise SimulationError(
            "lqr: the gains of the reduced system do not stabilise the whole one, whose slowest pole then is at "
            f"{poles.real.max():.2g} 1/s; take a higher order, or a larger weight of the inputs"
        )
    poles = poles[np.argsort(-poles.real, kind="stable")]
    return Regulator(K=K, states=whole.states, poles=poles, plant=whole, **found)
