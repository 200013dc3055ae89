"""Modes of a ring from one sector: against the whole ring, closed forms, CalculiX."""

import re
import subprocess

import numpy as np
import pytest
from calculix import deck, needs_ccx
from rings import HUB, STEEL, arc, beams, bricks, shells, solid_disc, with_nodes
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp

import modalprep as mp
from modalprep.examples import disc_sector
from modalprep.fe import CyclicSymmetry, make_ring
from modalprep.linalg.modes import lowest_modes
from modalprep.multibody.analysis.spin import spin_modes
from modalprep.reduction import cyclic_modes
from modalprep.reduction.clamped import clamp

EQUAL = 1e-10  # of frequencies: round-off of an eigenvalue is 1e-16 times the highest over the lowest, 1e5 here
NODE = {"hub": mp.Interface(group="hub", kind="node")}


def modes_of(sector, interfaces=HUB, **options):
    mesh, section, symmetry = sector
    model = mp.assemble(mesh, section, interfaces)
    return model, cyclic_modes(model, mesh, symmetry, **options)


def ring_of(sector, interfaces=HUB):
    mesh, section, symmetry = sector
    return mp.assemble(make_ring(mesh, symmetry, section), {}, interfaces)


def every(found, values):
    """Values of all modes of the ring, pairs twice, ascending."""
    return np.sort(np.repeat(values, found.multiplicity))


def on_the_ring(ring, model, symmetry, found, k):
    """The shape of a mode on the DOFs of the ring, whose nodes are found by their places."""
    shape = np.zeros(ring.n_dof)
    turned = symmetry.with_(point=symmetry.point - model.origin)
    for j in range(symmetry.sectors):
        phase = np.exp(1j * found.nodal_diameter[k] * symmetry.angle * j)
        for node, at in enumerate(turned.turned(model.points, j)):
            if model.dof[node, 0] >= 0:
                there = np.linalg.norm(ring.points + ring.origin - model.origin - at, axis=1) < 1e-9
                for triple in (slice(0, 3), slice(3, 6)):
                    if model.dof[node, triple.start] >= 0:
                        u = (found.shape[model.dof[node, triple], k] * phase).real
                        shape[ring.dof[: len(ring.points)][there, triple]] = symmetry.rotation(j) @ u
    return shape


# --- the whole ring ------------------------------------------------------------------------------------------------

SECTORS = {
    "shells, odd": (shells(7), HUB),
    "shells, even": (shells(8), HUB),
    "two sectors": (shells(2, 4), HUB),
    "solids": (bricks(), HUB),
    "the low edge behind": ((*bricks()[:2], CyclicSymmetry(sectors=6, low="high", high="low")), HUB),
    "curved edges": (bricks(n=(2, 2, 1), twist=0.4), HUB),
    "edges that do not match": (bricks(sectors=5, n=(2, 2, 1), bend=0.0, uneven=0.4), HUB),
    "free nodes on the axis": (solid_disc(), HUB),
    "beams and springs": (beams(), NODE),
}


@pytest.mark.parametrize("name", SECTORS)
def test_all_modes_are_those_of_the_ring(name):
    sector, interfaces = SECTORS[name]
    model, found = modes_of(sector, interfaces, modes=8)
    ring = ring_of(sector, interfaces)
    assert ring.rigid.m == pytest.approx(sector[2].sectors * model.rigid.m, rel=1e-12)
    clamped = clamp(ring)
    frequency = every(found, found.frequency)[:12]
    w2 = lowest_modes(clamped.K_ii, clamped.M_ii, 12).w2
    np.testing.assert_allclose(frequency, np.sqrt(w2) / (2 * np.pi), rtol=EQUAL)
    for k in np.argsort(found.frequency)[::4]:
        shape = on_the_ring(ring, model, sector[2], found, k)
        load = (2 * np.pi * found.frequency[k]) ** 2 * (ring.C.T @ (ring.M @ shape))[clamped.i]
        assert shape @ ring.M @ shape == pytest.approx(1.0, rel=1e-9)
        left = (ring.C.T @ (ring.K @ shape))[clamped.i] - load
        assert np.linalg.norm(left) < 1e-6 * np.linalg.norm(load)  # the energy, of second order, to 1e-10


@pytest.mark.parametrize(
    "sector",
    [shells(5, 1), (bricks(4, (1, 1, 1))[0], {"part": mp.Solid(material=STEEL)}, bricks(4)[2])],
    ids=["shells", "solids"],
)
def test_at_speed_it_vibrates_as_the_body_of_the_ring_does(sector):
    """Its body with all modes is a second implementation; they differ by the fourth power of the speed."""
    ring = ring_of(sector)
    body = mp.flexible_body(ring, mp.craig_bampton(ring, modes=ring.n_dof), name="ring", second_order_mass=True)
    lowest = body.frequency[0]
    for share, allowed in ((0.1, 1e-5), (0.05, 1e-5 / 16)):
        speed = share * 2 * np.pi * lowest
        _, found = modes_of(sector, modes=20, speed=speed)
        pairs = found.multiplicity == 2
        waves = np.sort(np.concatenate([found.backward, found.forward[pairs]]))[:10]
        other = spin_modes(body, np.array([0.0, 0.0, speed])).frequency[:10]
        np.testing.assert_allclose(waves, other, rtol=allowed)
        still = np.sort(np.repeat(modes_of(sector, modes=20)[1].frequency, found.multiplicity))[:10]
        assert np.abs(waves / still - 1).max() > 100 * allowed


# --- closed forms --------------------------------------------------------------------------------------------------


def free_plate(n, count, nu):
    """First ``lambda^2 = omega a^2 sqrt(rho h / D)`` of a free circular plate with n nodal diameters.

    A. W. Leissa, Vibration of Plates, NASA SP-160 (1969), equation 2.5; its table 2.5 has 5.253, 12.23 and 21.6 for
    n = 2, 3, 4 without a nodal circle, 9.084 and 38.55 for n = 0 (nu = 0.33).
    """

    def residual(x):
        J, dJ, own, dI = jv(n, x), jvp(n, x), iv(n, x), ivp(n, x)
        bending = x**2 * J + (1 - nu) * (x * dJ - n**2 * J), x**2 * own - (1 - nu) * (x * dI - n**2 * own)
        shear = x**3 * dJ + (1 - nu) * n**2 * (x * dJ - J), x**3 * dI - (1 - nu) * n**2 * (x * dI - own)
        return (bending[0] * shear[1] - shear[0] * bending[1]) / own**2

    x = np.linspace(0.8, 12.0, 400)
    y = [residual(v) for v in x]
    return [brentq(residual, x[k], x[k + 1]) ** 2 for k in range(len(x) - 1) if y[k] * y[k + 1] < 0][:count]


def test_a_free_circular_plate_has_its_closed_form():
    """The elements are a twentieth of the radius long; a node on the axis is free."""
    sectors, nu, thickness = 16, 0.33, 0.005
    points, number = arc(sectors, (0.05, 1.0), 19, 3)
    points = np.concatenate([points, [[0.0, 0, 0]]])
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    cells = {
        "quad": np.stack(corners, axis=-1).reshape(-1, 4),
        "triangle": np.column_stack([np.full(3, len(points) - 1), number[:-1, 0], number[1:, 0]]),
    }
    mesh = with_nodes(points, cells, hub=number[1, 5][None])
    material = mp.Material(E=2.1e11, nu=nu, rho=7800.0)
    sector = mesh, {"part": mp.Shell(material=material, thickness=thickness)}, CyclicSymmetry(sectors=sectors)
    _, found = modes_of(sector, NODE, modes=6, nodal_diameters=range(5), held=False)
    unit = np.sqrt(material.E * thickness**2 / (12 * (1 - nu**2) * material.rho)) / (2 * np.pi)
    rigid = [found.frequency[found.nodal_diameter == n] == 0 for n in range(5)]
    assert [int(own.sum()) for own in rigid] == [2, 2, 0, 0, 0]  # along and about the axis; across and about it
    assert free_plate(2, 1, nu)[0] == pytest.approx(5.253, abs=1e-2)
    for n in range(5):
        own = found.frequency[found.nodal_diameter == n]
        own = own[own > 0][: 1 if n < 2 else 2] / unit
        np.testing.assert_allclose(own, free_plate(n, len(own), nu), rtol=0.01)  # of the mesh


def test_the_waves_of_a_thin_ring_drift_as_bryan_found():
    """In the frame of a thin ring its pattern lags by 2 / (n^2 + 1) of the rotation: waves differ by 2 n times that.

    G. H. Bryan, On the beats in the vibrations of a revolving cylinder or bell, Proc. Camb. Phil. Soc. 7 (1890) 101.
    Springs hold the ring, far softer than it is; its section is 0.01 radii thick, which matters by 1e-4.
    """
    speed = 0.2
    _, found = modes_of(beams(9, spring=1.0), NODE, modes=6, nodal_diameters=[2, 3, 4], speed=speed)
    for n in (2, 3, 4):
        expected = np.sqrt(n**2 * (n**2 - 1) ** 2 / (n**2 + 1) * STEEL.E * 1e-9 / (STEEL.rho * 1e-4)) / (2 * np.pi)
        rows = np.flatnonzero(found.nodal_diameter == n)
        k = rows[np.argmin(np.abs(found.frequency[rows] / expected - 1))]
        assert found.frequency[k] == pytest.approx(expected, rel=1e-2)  # a polygon of 36 sides
        drift = 4 * n / (n**2 + 1) * speed / (2 * np.pi)
        assert found.backward[k] - found.forward[k] == pytest.approx(drift, rel=2e-3)


# --- CalculiX ------------------------------------------------------------------------------------------------------


def calculix_deck(sector):
    mesh, _, symmetry = sector
    low, high = mesh.nodes("low"), mesh.nodes("high")
    lines = [deck(mesh.points, np.setdiff1d(mesh.nodes("hub"), high), C3D20R=mesh.cells["hexahedron20"])]
    for name, nodes in (("MASTER", low), ("SLAVE", high)):  # the slave must not be held, for the master is
        lines += [f"*NSET, NSET=N{name}", *(f"{node + 1}," for node in nodes), f"*SURFACE, NAME={name}, TYPE=NODE"]
        lines += [f"N{name}"]
    lines += ["*TIE, CYCLIC SYMMETRY, NAME=T1", "SLAVE, MASTER"]
    lines += [f"*CYCLIC SYMMETRY MODEL, N={symmetry.sectors}, NGRAPH={symmetry.sectors}, TIE=T1", "0,0,0,0,0,1"]
    return "\n".join(lines) + "\n"


def theirs(text, speed, most, count, folder):
    """Frequencies (Hz) by nodal diameter, of seven digits, each of a pair."""
    load = f"*STEP, NLGEOM\n*STATIC\n*DLOAD\nE, CENTRIF, {speed**2}, 0,0,0, 0,0,1\n*END STEP\n*STEP, PERTURBATION\n"
    select = f"*FREQUENCY\n{count}\n*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX={most}\n*END STEP\n"
    (folder / "job.inp").write_text(text + (load if speed else "*STEP\n") + select)
    subprocess.run(["ccx", "job"], cwd=folder, check=True, capture_output=True)
    printed = (folder / "job.dat").read_text()
    rows = re.findall(r"^\s+(\d+)\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", printed, re.MULTILINE)
    return {n: [float(f) for own, f in rows if int(own) == n][:count] for n in range(most + 1)}


PRINTED = {  # by ccx 2.20, of the dished disc: speed (rad/s), and the first of each pair by nodal diameter
    0.0: [
        [1018.412, 1940.188, 2894.219],
        [527.501, 2163.853, 2904.465],
        [416.8411, 1340.077, 3478.823],
        [761.8757, 761.8757, 4200.73],
    ],
    100.0: [
        [1018.306, 1940.177, 2894.086],
        [527.6623, 2165.357, 2904.361],
        [417.8979, 1341.522, 3478.77],
        [763.2394, 763.2394, 4200.799],
    ],
}
DIGITS = 5.1e-7  # half of the last of seven, of a number that begins with 1


@needs_ccx
@pytest.mark.parametrize("speed", PRINTED)
def test_these_are_the_frequencies_of_calculix(speed, tmp_path):
    found = theirs(calculix_deck(bricks()), speed, 3, 6, tmp_path)
    for n, own in enumerate(PRINTED[speed]):
        np.testing.assert_allclose(found[n], np.repeat(own, 2), rtol=DIGITS)


@pytest.mark.parametrize("speed", PRINTED)
def test_a_deck_of_calculix_has_its_frequencies(speed, tmp_path):
    """At speed the other program has the initial displacements in its tangent, here they are in the mass."""
    (tmp_path / "deck.inp").write_text(calculix_deck(bricks()))
    mesh = mp.read_mesh(tmp_path / "deck.inp")
    assert (mesh.cyclic.sectors, mesh.cyclic.low, mesh.cyclic.high) == (6, "cyclic_low", "cyclic_high")
    held = {"held": mp.Support(set="boundary")}
    model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports=held)
    assert any("one of 6 sectors" in note for note in model.notes)
    found = cyclic_modes(model, mesh, modes=3, speed=speed)
    np.testing.assert_allclose(found.frequency.reshape(4, 3), PRINTED[speed], rtol=DIGITS)


# --- what is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sectors": 9}, "no node of the mesh onto another"),
        ({"point": np.array([0.0, 0.1, 0.0])}, "no node of the mesh onto another"),
        ({"axis": np.zeros(3)}, "no direction"),
        ({"sectors": 1}, "at least 2"),
        ({"sectors": 2}, "name them"),
        ({"low": "bore"}, "name low and high"),
        ({"low": "bore", "high": "bore"}, "that edge has no faces to follow"),
        ({"low": "bore", "high": "brim"}, "has no group 'brim'"),
    ],
)
def test_a_symmetry_that_the_mesh_does_not_have_is_refused(change, message):
    mesh, model, symmetry = disc_sector()
    with pytest.raises(mp.InputError, match=message):
        cyclic_modes(model, mesh, symmetry.with_(**change))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"nodal_diameters": [5]}, "8 sectors have 0 to 4"),
        ({"modes": 0}, "at least 1"),
        ({"speed": 10.0, "held": False}, "must be held"),
        ({"speed": 1e5}, "not stable at this speed"),
    ],
)
def test_options_that_cannot_be_are_refused(options, message):
    mesh, model, symmetry = disc_sector()
    with pytest.raises(mp.InputError, match=message):
        cyclic_modes(model, mesh, symmetry, **options)


def test_a_mesh_without_symmetry_and_a_whole_ring_are_refused():
    mesh, model, symmetry = disc_sector()
    with pytest.raises(mp.InputError, match="no cyclic symmetry; give"):
        cyclic_modes(model, mesh)
    ring = make_ring(mesh, symmetry)
    with pytest.raises(mp.InputError, match="more than one sector"):
        make_ring(ring, symmetry)


@pytest.mark.parametrize(("axis", "message"), [(False, "lies on both edges"), (True, "lies on the axis")])
def test_masses_on_both_edges_or_on_the_axis_are_refused(axis, message):
    mesh, section, symmetry = shells(6)
    points = np.concatenate([mesh.points, [[0.0, 0, 0]]])
    nodes = [len(mesh.points)] if axis else mesh.nodes("hub")[[0, -1]]
    cells = {**mesh.cells, "vertex": np.append(mesh.cells["vertex"], nodes)[:, None]}
    own = {"mass": {"vertex": len(mesh.cells["vertex"]) + np.arange(len(nodes))}}
    link = mp.fe.Link(kind="rbe3", node=len(mesh.points), nodes=mesh.nodes("hub"))
    heavy = mesh.with_(points=points, cells=cells, groups=mesh.groups | own, links=(link,) * axis)
    model = mp.assemble(heavy, section | {"mass": mp.PointMass(mass=1.0)}, HUB)
    with pytest.raises(mp.InputError, match=message):
        cyclic_modes(model, heavy, symmetry)


def test_single_elements_of_reduced_integration_around_are_told():
    assert not modes_of(bricks(n=(2, 2, 1)), modes=1)[1].notes
    assert "take two elements around" in modes_of(bricks(n=(1, 2, 1)), modes=1)[1].notes[0]


def test_a_link_on_an_edge_is_refused():
    mesh, section, symmetry = shells(6)
    model = mp.assemble(mesh, section, {"tip": mp.Interface(near=(0.4, 0.0, 0.0), kind="node"), **HUB})
    with pytest.raises(mp.InputError, match="follows a link or an equation"):
        cyclic_modes(model, mesh, symmetry, held=False)
