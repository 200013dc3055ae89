"""Reactions under 1 g: statics of beams in closed form, and equilibrium with the weight."""

import itertools

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import cantilever_model, spinup_section, uniform_beam
from modalprep.fe.assembly.assemble import assemble
from modalprep.fe.links.interface import Interface
from modalprep.fe.mesh.mesh import Mesh
from modalprep.report.body_page.reactions import G, gravity_reactions

M, L = 12.0, 10.0  # kg and m of the example beam


def between(modes):
    """The beam with both ends held."""
    return mp.flexible_body(cantilever_model(tip="fixed"), mp.craig_bampton(cantilever_model(tip="fixed"), modes=modes),
                            name="beam")  # fmt: skip


def bent_beam():
    """A beam along x, then y, then z, held at its root, one of its bends and its end."""
    t = np.linspace(0, 1, 5)[:, None]
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [2, 3, 0], [2, 3, 1]])
    points = np.vstack([corners[:1], *(a + t[1:] * (b - a) for a, b in itertools.pairwise(corners))])
    n = len(points)
    lines, held = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1), {"root": 0, "middle": 4, "end": n - 1}
    groups = {name: {"vertex": np.array([k])} for k, name in enumerate(held)} | {"beam": {"line": np.arange(n - 1)}}
    mesh = Mesh(points=points, cells={"line": lines, "vertex": np.array([*held.values()])[:, None]}, groups=groups)
    ends = {name: Interface(group=name, kind="node") for name in held}
    model = assemble(mesh, {"beam": spinup_section(up=(1.0, 1.0, 1.0))}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=3), name="bent")


def test_cantilever_carries_its_weight_at_the_root():
    """F = m g and M = m g L / 2 (statics)."""
    found = gravity_reactions(uniform_beam(modes=1))[:, 0]
    np.testing.assert_allclose(found[1], [0, -M * G, 0, 0, 0, -M * G * L / 2], atol=1e-9 * M * G * L)
    np.testing.assert_allclose(found[2], [0, 0, -M * G, 0, M * G * L / 2, 0], atol=1e-9 * M * G * L)


@pytest.mark.parametrize("modes", [0, 1, 6])
def test_beam_with_both_ends_held_has_the_reactions_of_the_handbook(modes):
    """m g / 2 and m g L / 12 at each end (Young and Budynas, Roark's Formulas, table 8.1 case 2d).

    The coupled loads of Hermite elements make nodal forces and moments exact; the number of modes does not matter.
    """
    root, tip = gravity_reactions(between(modes), ["tip"])[1]
    force, moment = M * G / 2, M * G * L / 12
    np.testing.assert_allclose(root, [0, -force, 0, 0, 0, -moment], atol=1e-6 * moment)
    np.testing.assert_allclose(tip, [0, -force, 0, 0, 0, moment], atol=1e-6 * moment)


def test_all_reactions_balance_the_weight():
    """The identity that a wrong lever arm or sign breaks: sum F = -m g, sum (M + p x F) = -s0 x g."""
    body = bent_beam()
    others = ["middle", "end"]
    for held in ([], others[:1], others):
        for axis, found in zip(np.eye(3), gravity_reactions(body, held), strict=True):
            arms = body.interface_position[[0, *(body.interface_name.index(name) for name in held)]]
            force, moment = found[:, :3].sum(axis=0), (found[:, 3:] + np.cross(arms, found[:, :3])).sum(axis=0)
            np.testing.assert_allclose(force, -G * body.m * axis, atol=1e-10 * G * body.m)
            np.testing.assert_allclose(moment, -G * np.cross(body.s0, axis), atol=1e-10 * G * body.m)


def test_bodies_without_static_reactions_are_refused():
    beam = uniform_beam(modes=2)
    with pytest.raises(InputError, match=r"no interface 'hub'; it has root, tip"):
        gravity_reactions(beam, ["hub"])
    with pytest.raises(InputError, match="not in the frame of its root|in the frame of its root"):
        gravity_reactions(mp.body.in_mean_axes(uniform_beam(modes=8)))
    with pytest.raises(InputError, match="moves without strain"):
        gravity_reactions(beam.with_(K=np.array([0.0, 1.0])))
