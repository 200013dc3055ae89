"""Pack bodies that lose mass: their integrals at each fill level in the axes of their links."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.kernels.loads.variable_mass import DEPLETION, Fill
from modalprep.multibody.model.depletion import Depletion
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.bodies import rigid_constants
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.time_tables import tabulate
from modalprep.multibody.packing.tree import rows

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
    >>> pack_fill(arm, pack(arm), [0], 1.0).mass.round(9)
    array([ 6., 12.])
    """
    found, mass, integrals = [], [], []
    for depletion, number in zip(system.depletions, tables, strict=True):
        levels = depletion.by_mass(system.bodies[depletion.body])
        link = packed.link_of(depletion.body)
        _refuse_outside(depletion, levels, t_end)
        own = [_integrals(level, packed.align(link)) for level in levels]
        found.append((link, number, len(mass), len(levels), len(own[0])))
        mass += [level.m for level in levels]
        integrals += own
    largest = max(map(len, integrals), default=0)
    padded = np.array([np.pad(row, (0, largest - len(row))) for row in integrals]).reshape(len(integrals), largest)
    return Fill(rows(DEPLETION, found), np.array(mass, dtype=float), padded, np.zeros(largest))


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


def _integrals(body: FlexibleBody, Q: np.ndarray) -> np.ndarray:
    """Return one level as `Fill` stores it, turned by Q."""
    turn = np.eye(4)
    turn[1:, 1:] = Q
    total = np.concatenate([body.S[:, None], body.H], axis=1), np.concatenate([body.Kg_A[:, None], body.Kg_W], axis=1)
    first, second = (np.einsum("as...,ac,sr->...rc", x, Q, turn) for x in total)
    tensor = np.einsum("abij,ac,bd->jicd", body.P, Q, Q)
    parts = (*rigid_constants([body], Q[None]), first, second.swapaxes(0, 1), tensor, body.modal_mass)
    return np.concatenate([part.ravel() for part in parts])
