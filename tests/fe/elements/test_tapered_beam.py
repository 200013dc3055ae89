"""Tapered beams and released ends of beams, against closed forms and finer or equivalent models."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.points import Spring
from modalprep.fe.properties.properties import Beam
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp

STEEL = mp.Material(E=210e9, nu=0.3, rho=7800.0)
ROOT = {"root": mp.Interface(node=1, kind="node")}
WIDTH, HEIGHT, LENGTH = 0.02, 0.04, 1.2


def sections(x):
    """Of a wedge that is twice as high and wide at x = 0 as at x = 1: A, Iy, Iz, J, nsm."""
    b, h = WIDTH * (2 - x), HEIGHT * (2 - x)
    return b * h, b * h**3 / 12, h * b**3 / 12, 0.2 * h * b**3, 0.5


def wedge(places, **more):
    A, Iy, Iz, J, nsm = np.mean([sections(x) for x in places], axis=0).tolist()
    taper = tuple((float((x - places[0]) / (places[-1] - places[0])), *sections(x)) for x in places)
    return Beam(material=STEEL, A=A, Iy=Iy, Iz=Iz, J=J, nsm=nsm, taper=taper, **more)


def line(n, pins=None):
    points = np.linspace([0, 0, 0], [LENGTH, 0, 0], n + 1)
    row = np.arange(n)
    mesh = Mesh(
        points=points, cells={"line": np.stack([row, row + 1], 1)}, groups={f"e{k}": {"line": row[[k]]} for k in row}
    )
    return mesh.with_(data={"pins": {"line": np.array(pins, dtype=float)}}) if pins is not None else mesh


def tip_flexibility(model):
    clamped = clamp(model)
    K = model.K.toarray()
    free = model.free[clamped.i]
    inverse = np.linalg.inv(K[np.ix_(free, free)])
    tip = np.searchsorted(free, model.dof[-1])
    return inverse[np.ix_(tip, tip)]


def test_one_tapered_element_has_the_flexibility_of_its_wedge():
    """Exact by integration of the moments over the length (Gauss, 20 points per station)."""
    places = np.linspace(0, 1, 9)
    found = tip_flexibility(mp.assemble(line(1), {"e0": wedge(places, theory="euler-bernoulli")}, ROOT))
    beam = wedge(places)
    s, w = np.polynomial.legendre.leggauss(20)
    x = np.concatenate([(a + b + s * (b - a)) / 2 for a, b in pairwise(places)])
    w = np.tile(w / 16, 8) * LENGTH
    A, Iy, Iz, J, _ = np.array([beam.section_at(float(p)) for p in x]).T
    arm = (1 - x) * LENGTH
    E, G = STEEL.E, STEEL.G
    exact = {(0, 0): w @ (1 / (E * A)), (3, 3): w @ (1 / (G * J)), (1, 1): w @ (arm**2 / (E * Iz)),
             (1, 5): w @ (arm / (E * Iz)), (5, 5): w @ (1 / (E * Iz)), (2, 2): w @ (arm**2 / (E * Iy)),
             (4, 4): w @ (1 / (E * Iy))}  # fmt: skip
    for (i, j), value in exact.items():
        assert found[i, j] == pytest.approx(value, rel=1e-8), (i, j)  # six Gauss points between stations


def test_one_tapered_element_has_the_mass_and_frequency_of_many():
    """First bending frequency: within 3 % of sixteen tapered elements; the mass of the wedge to its segments."""
    one = mp.assemble(line(1), {"e0": wedge(np.linspace(0, 1, 9))}, ROOT)
    many = mp.assemble(line(16), {f"e{k}": wedge(np.linspace(k / 16, (k + 1) / 16, 3)) for k in range(16)}, ROOT)
    exact = STEEL.rho * WIDTH * HEIGHT * LENGTH * 7 / 3 + 0.5 * LENGTH  # int (2 - x)^2 = 7 / 3
    assert [one.rigid.m, many.rigid.m] == pytest.approx([exact, exact], rel=2e-3)
    first = [np.sqrt(lowest_modes(c.K_ii, c.M_ii, 1).w2[0]) for c in map(clamp, (one, many))]
    assert first[0] == pytest.approx(first[1], rel=0.03)
    for model in (one, many):
        assert [check.name for check in mp.body.check_model(model) if not check.passed] == []


def test_tapered_elements_converge():
    """Four elements have the third bending frequencies of sixteen; prismatic ones of the mean are 2 % off."""

    def frequency(n, prismatic=False):
        own = {f"e{k}": wedge(np.linspace(k / n, (k + 1) / n, 3)) for k in range(n)}
        if prismatic:
            own = {name: replace(section, taper=()) for name, section in own.items()}
        clamped = clamp(mp.assemble(line(n), own, ROOT))
        return np.sqrt(lowest_modes(clamped.K_ii, clamped.M_ii, 4).w2[3])

    assert frequency(8) == pytest.approx(frequency(16), rel=2e-3)
    assert abs(frequency(2, prismatic=True) / frequency(16) - 1) > 3 * abs(frequency(2) / frequency(16) - 1)


HINGE = np.zeros(12)
HINGE[[4, 5]] = 1  # free bending at the first end


def test_a_released_end_is_a_hinge():
    """Frequencies and static response of a bar on a hinge: the same with a node of its own on stiff springs."""
    section = Beam(material=STEEL, A=8e-4, Iy=1e-7, Iz=4e-8, J=1e-7)
    pins = np.zeros((8, 12))
    pins[3] = HINGE
    mesh = line(8)
    points = np.vstack([mesh.points, mesh.points[3]])
    lines = np.vstack([mesh.cells["line"], [3, 9]])
    lines[3, 0] = 9
    twin = mesh.with_(points=points, cells={"line": lines}, groups=mesh.groups | {"joint": {"line": np.array([8])}})
    k = 1e4 * 210e9 * 1e-7
    joint = Spring(translation=(1e3 * k, 1e3 * k, 1e3 * k), rotation=(k, 0.0, 0.0))
    properties, ends = {f"e{k}": section for k in range(8)}, ROOT | {"tip": mp.Interface(node=9, kind="node")}
    released = mp.assemble(line(8, pins), properties, ends)
    apart = mp.assemble(twin, properties | {"joint": joint}, ends)
    found, expected = (np.sqrt(lowest_modes(c.K_ii, c.M_ii, 4).w2) for c in map(clamp, (released, apart)))
    # the rotation of the released end follows statically, as in Guyan's reduction: from above, some 1e-4
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_a_hinged_strut_buckles_as_euler_says():
    """Both ends of a strut released: pi^2 E I / L^2 of its weaker plane, though its nodes are clamped."""
    n, section = 8, Beam(material=STEEL, A=8e-4, Iy=1e-7, Iz=4e-8, J=1e-7, theory="euler-bernoulli")
    pins = np.zeros((n, 12))
    pins[0, [4, 5]] = pins[-1, [10, 11]] = 1
    model = mp.assemble(line(n, pins), {f"e{k}": section for k in range(n)}, ROOT)
    d = np.zeros(model.n_dof)
    d[model.dof[:, 0]] = -model.points[:, 0] / LENGTH * 1e-3  # uniform compression
    Kg = model.geometric_stiffness(d, model.K @ d).toarray()
    free = np.setdiff1d(np.arange(model.n_dof), np.r_[model.dof[0], model.dof[-1]])
    values = np.linalg.eigvals(np.linalg.solve(model.K.toarray()[np.ix_(free, free)], -Kg[np.ix_(free, free)])).real
    force = 210e9 * 8e-4 * 1e-3 / LENGTH / values.max()
    assert force == pytest.approx(np.pi**2 * 210e9 * 4e-8 / LENGTH**2, rel=1e-3)


def test_a_force_beside_the_shear_centre_twists_the_beam():
    """A cantilever with nodes at its centroid: u = F L^3 / 3 E I + F s^2 L / G J, twist F s L / G J of the arm s."""
    section = Beam(
        material=STEEL, A=8e-4, Iy=1e-7, Iz=4e-8, J=1e-9, shear_centre=(0.03, -0.02), theory="euler-bernoulli"
    )
    E, G, L = STEEL.E, STEEL.G, LENGTH
    found = tip_flexibility(mp.assemble(line(3), {f"e{k}": section for k in range(3)}, ROOT))
    assert found[1, 1] == pytest.approx(L**3 / (3 * E * 4e-8) + 0.02**2 * L / (G * 1e-9))
    assert found[2, 2] == pytest.approx(L**3 / (3 * E * 1e-7) + 0.03**2 * L / (G * 1e-9))
    # the centroid is at (-0.03, 0.02) of the shear centre; torque y Fz - z Fy
    assert found[3, 1:4] == pytest.approx(np.array([-0.02, -0.03, 1]) * L / (G * 1e-9))


def test_mass_of_a_beam_with_a_shear_centre_is_at_its_centroid():
    section = Beam(material=STEEL, A=8e-4, Iy=1e-7, Iz=4e-8, J=1e-9, shear_centre=(0.03, -0.02), offset=(0.01, 0.0))
    model = mp.assemble(line(3), {f"e{k}": section for k in range(3)}, ROOT)
    assert [check.name for check in mp.body.check_model(model) if not check.passed] == []
    plain = mp.assemble(line(3), {f"e{k}": replace(section, shear_centre=(0.0, 0.0)) for k in range(3)}, ROOT)
    np.testing.assert_allclose(model.rigid.s0, plain.rigid.s0)


@pytest.mark.parametrize("theory", ["timoshenko", "euler-bernoulli"])
def test_a_section_may_be_named_by_either_of_its_axes(theory):
    """A quarter turn of `up` with Iy and Iz, ky and kz exchanged is the same beam: e2, e3 become e3, -e2."""
    first = Beam(material=STEEL, A=6e-4, Iy=4e-7, Iz=2e-7, J=4e-7, ky=0.7, kz=0.6, theory=theory)
    second = replace(first, Iy=2e-7, Iz=4e-7, ky=0.6, kz=0.7, up=(0.0, -1.0, 0.0))
    ends, d = np.array([[0.0, 0, 0], [1.3, 0, 0]]), 1e-3 * np.random.default_rng(3).normal(size=(1, 12))
    one, two = (BeamBlock.build("line", ends, np.array([[0, 1]]), s, {}, np.zeros(3)) for s in (first, second))
    for a, b in ((one.stiffness(), two.stiffness()), (one.geometric_stiffness(d), two.geometric_stiffness(d))):
        np.testing.assert_allclose(a, b, atol=1e-11 * np.abs(a).max())


def test_tapers_that_are_none_are_refused():
    with pytest.raises(InputError, match="the positions .* do not increase from 0 to 1"):
        replace(wedge([0.0, 1.0]), taper=((0.0, *sections(0)), (0.5, *sections(1))))
    with pytest.raises(InputError, match="taper of a beam A = -1 must be positive"):
        replace(wedge([0.0, 1.0]), taper=((0.0, *sections(0)), (1.0, -1.0, *sections(1)[1:])))
