"""Pack bodies that lose mass: their integrals at each fill level in the axes of their links."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.kernels.loads.variable_mass import DEPLETION, LEVEL, Fill
from modalprep.multibody.model.depletion import Depletion
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.bodies import rigid_constants
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.time_tables import tabulate
from modalprep.multibody.packing.tree import blank, rows

ROUNDED = 1e-9  # of the heaviest level: a mass beyond it is meant


def pack_fill(system: System, packed: Packed, tables: list[int], t_end: float) -> Fill:
    """Return the arrays of all depletions; `tables` are the numbers of their masses' functions.

    Raises
    ------
    InputError
        When a mass leaves the range of its levels on [0, t_end].

    Examples
    --------
    >>> from modalprep.body.levels import with_density_factor
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> full = uniform_beam(modes=1)
    >>> fuel = Depletion(name="fuel", body="arm", levels=(with_density_factor(full, 0.5),), mass="12 - t")
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": full}, joints=(hinge,), depletions=(fuel,))
    >>> pack_fill(arm, pack(arm), [0], 1.0).levels["mass"].round(9)
    array([ 6., 12.])
    """
    depletions = []
    levels: list[tuple] = []
    for depletion, number in zip(system.depletions, tables, strict=True):
        bodies = depletion.by_mass(system.bodies[depletion.body])
        link = packed.link_of(depletion.body)
        _refuse_outside(depletion, bodies, t_end)
        depletions.append((link, number, len(levels), len(bodies)))
        levels += [(body, packed.align(link)) for body in bodies]
    N = max((body.n for body, _ in levels), default=0)
    fill = empty_fill(len(levels), N)._replace(rows=rows(DEPLETION, depletions))
    for k, (body, align) in enumerate(levels):
        fill.levels[k] = tuple(x[0] for x in rigid_constants([body], align[None]))
        for name, value in _integrals(body, align).items():
            getattr(fill, name)[(k, *map(slice, value.shape))] = value
    return fill


def empty_fill(levels: int = 0, N: int = 0) -> Fill:
    """Return arrays of zeros for a number of levels of at most N modes, without depletions."""
    shapes = {"S": (3, N), "H": (3, 3, N), "Kg_A": (N, 3, N), "Kg_W": (N, 3, 3, N), "P": (N, 3, 3, N), "M": (N, N)}
    integrals = {name: np.zeros((levels, *shape)) for name, shape in shapes.items()}
    return Fill(rows(DEPLETION, ()), blank(LEVEL, levels), **integrals)


def _refuse_outside(depletion: Depletion, levels: list[FlexibleBody], t_end: float) -> None:
    """The knots of the table are dense enough to see a mass that is not between the levels."""
    knots = tabulate([depletion.mass], t_end).knots
    least, most = levels[0].m, levels[-1].m
    for t, m in knots[:, :2]:
        if not least - ROUNDED * most <= m <= most * (1 + ROUNDED):
            raise InputError(
                f"depletion {depletion.name!r}: body {depletion.body!r} would weigh {m:g} kg at t = {t:g} s, but its "
                f"levels are {least:g} to {most:g} kg"
            )


def _integrals(body: FlexibleBody, Q: np.ndarray) -> dict[str, np.ndarray]:
    """Return the modal integrals of one level as `Fill` stores them, turned by Q."""
    vector = lambda x: np.einsum("a...,ac->c...", x, Q)  # noqa: E731
    matrix = lambda x: np.einsum("ab...,ac,bd->cd...", x, Q, Q)  # noqa: E731
    return {
        "S": vector(body.S),
        "H": matrix(body.H),
        "Kg_A": np.moveaxis(vector(body.Kg_A), 2, 0),
        "Kg_W": np.moveaxis(matrix(body.Kg_W), 3, 0),
        "P": np.moveaxis(matrix(body.P), 3, 0),
        "M": body.modal_mass,
    }
