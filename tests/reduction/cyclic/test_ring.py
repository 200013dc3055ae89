"""The body of a ring: its fixed-interface modes from problems of one sector, against those of the whole model."""

import numpy as np
import pytest
from rings import HUB, beams, bricks, shells, solid_disc

import modalprep as mp
from modalprep.fe import CyclicSymmetry, LoadSet, make_ring
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.reduction import ring_algebra

EQUAL = 1e-8  # of the largest: shapes, which lose half of the digits of the frequencies, to the square of their spread
ARRAYS = ("s0", "E0", "K", "S", "H", "P", "Kg_A", "Kg_W", "Kg_F", "Kg_T", "T", "phi", "psi")
TIPS = {f"tip {k}": mp.Interface(group=f"tip_{k}", kind="rbe2", boundary="fixed") for k in (1, 2, 3, 4)}


def tipped():
    """A disc of four sectors of bricks, with four nodes of the rim of each as an interface."""
    mesh, _, symmetry = bricks(4, (2, 2, 1), 0.0)
    rim = np.flatnonzero(np.isclose(np.hypot(*mesh.points[:, :2].T), 0.2))
    middle = np.arctan2(mesh.points[rim, 1], mesh.points[rim, 0])
    tip = rim[np.abs(middle + np.pi / 4) < 0.5]
    vertex = np.concatenate([mesh.cells["vertex"], tip[:, None]])
    groups = mesh.groups | {"tip": {"vertex": len(mesh.cells["vertex"]) + np.arange(len(tip))}}
    mesh = mesh.with_(cells={**mesh.cells, "vertex": vertex}, groups=groups)
    return mesh, {"part": mp.Solid(material=mp.Material(E=2.1e11, nu=0.3, rho=7800.0))}, symmetry


CASES = {
    "shells, even": (shells(8), HUB),
    "shells, odd": (shells(5), HUB),
    "solids": (bricks(), HUB),
    "an interface on each sector": (tipped(), HUB | TIPS),
}


def body_of(ring, algebra=DIRECT, **options):
    reduction = mp.craig_bampton(ring, algebra=algebra, **options)
    return mp.flexible_body(ring, reduction, name="r", second_order_mass=True)


def unused(*_, **__):
    raise AssertionError("the whole model was solved")


@pytest.mark.parametrize("name", CASES)
def test_the_body_is_that_of_the_whole_model(name):
    """The number of modes ends between pairs, of which a part would be any combination of both."""
    (mesh, section, symmetry), interfaces = CASES[name]
    ring = mp.assemble(make_ring(mesh, symmetry, section), {}, interfaces)
    frequency = mp.craig_bampton(ring, modes=20).table.frequency[:20]
    modes = int(np.flatnonzero(np.diff(frequency) > 1e-6 * frequency[1:])[-1]) + 1
    assert modes > 12
    whole = body_of(ring, modes=modes)
    found = body_of(ring, ring_algebra(ring, symmetry, Algebra(lowest_modes=unused)), modes=modes)
    np.testing.assert_allclose(found.frequency, whole.frequency, rtol=EQUAL)
    for array in ARRAYS:
        own, other = getattr(found, array), getattr(whole, array)
        np.testing.assert_allclose(own, other, rtol=0, atol=EQUAL * max(np.abs(other).max(initial=0), 1e-12))


@pytest.mark.parametrize("case", ["a node on the axis", "one sector is held", "another number of sectors"])
def test_what_no_rotation_keeps_is_left_to_the_whole_model(case):
    """And is found there: the frequencies are those without the symmetry."""
    mesh, section, symmetry = solid_disc() if case == "a node on the axis" else tipped()
    one = {"tip 1": TIPS["tip 1"]} if case == "one sector is held" else {}
    ring = mp.assemble(make_ring(mesh, symmetry, section), {}, HUB | one)
    if case == "another number of sectors":
        symmetry = CyclicSymmetry(sectors=5)
    found, whole = body_of(ring, ring_algebra(ring, symmetry), modes=8), body_of(ring, modes=8)
    np.testing.assert_allclose(found.frequency, whole.frequency, rtol=1e-12)


# --- the mesh of the ring ------------------------------------------------------------------------------------------


def test_directions_and_links_turn_with_their_sector():
    """The ring of beams has all inertia of a sector turned; a group for each sector, numbers that say which."""
    mesh, section, symmetry = beams(5)
    section["rim"] = mp.Beam(
        material=section["rim"].material, A=1e-4, Iy=1e-7, Iz=1e-9, J=1e-8, up=(0.9, 0.3, 0.2), offset=(0.0, 0.02)
    )
    ring = make_ring(mesh, symmetry, section)
    assert len(ring.points) == 5 * 4 + 1
    assert {"rim", "rim_1", "rim_5"} < set(ring.groups)
    assert len(ring.groups["rim"]["line"]) == 20
    assert ring.labels[ring.nodes("rim_3")].max() // 10 == 2
    assert set(ring.properties) == {*(f"rim_{k}" for k in range(1, 6)), "spoke"}
    hub = {"hub": mp.Interface(group="hub", kind="node")}
    one, all_five = (mp.assemble(m, s, hub).rigid for m, s in ((mesh, section), (ring, {})))
    turned = sum(R @ one.E0 @ R.T for R in map(symmetry.rotation, range(5)))
    np.testing.assert_allclose(all_five.E0, turned, atol=1e-12 * np.abs(turned).max())


def test_loads_act_on_every_sector():
    mesh, section, symmetry = beams(5)
    load = LoadSet.of_terms([(0, 0, 1.0), (4, 1, 2.0), (2, 5, 3.0)])  # the first and the last node are on the edges
    ring = make_ring(mesh.with_(loads={"a": load}), symmetry, section).loads["a"]
    assert len(ring.nodes) == 15
    turned = sum(symmetry.rotation(k) @ load.forces.sum(axis=0) for k in range(5))
    np.testing.assert_allclose(ring.forces.sum(axis=0), turned, atol=1e-12)
    np.testing.assert_allclose(ring.moments.sum(axis=0), [0, 0, 15.0])


def test_a_mesh_has_no_ring_without_symmetry():
    with pytest.raises(mp.InputError, match="no cyclic symmetry to make a ring of"):
        make_ring(shells()[0])
