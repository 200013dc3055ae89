"""Hexahedra of 20 nodes by 2 x 2 x 2 points and wedges by 3 x 3: against CalculiX, closed forms, identities."""

import itertools

import numpy as np
import pytest
from calculix import deck, needs_ccx
from calculix import frequencies as theirs
from scipy.linalg import eigh
from structured import box, free_dofs, frequencies, random_rotation, rigid_residual, solid_model, submatrix

import modalprep as mp
from modalprep.body.verify import check_geometric_stiffness
from modalprep.fe.assembly.stress_recovery import StressPoint, stress_recovery
from modalprep.fe.elements.solid import SolidBlock

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
REDUCED = mp.Solid(material=STEEL, integration="reduced")
FULL = mp.Solid(material=STEEL, integration="full")
DIGITS = 5.1e-7  # half of the last of seven, of a number that begins with 1
SHIFT = 1e4  # (rad/s)^2, of free bodies


def ring(around, along, radius, thickness, length, kind="hexahedron20", angle=2 * np.pi):
    """Points and cells of one layer around an axis, z; nodes that coincide are one."""
    points, cells = box(kind, (around, 1, along))
    phi, r = -angle * points[:, 0], radius + thickness * (points[:, 1] - 0.5)
    return merged(np.column_stack([r * np.cos(phi), r * np.sin(phi), length * points[:, 2]]), cells, 1e-3 * thickness)


def merged(points, cells, tolerance):
    """The mesh with one node where several coincide."""
    _, first, own = np.unique(np.round(points / tolerance), axis=0, return_index=True, return_inverse=True)
    return points[first], own.ravel()[cells]


def tube(kind="hexahedron20"):
    """25 mm of radius, 1 mm thick, 150 mm long, with twelve by five elements."""
    points, cells = ring(12, 5, 0.025, 0.001, 0.15, kind)
    return points, cells, np.flatnonzero(np.isclose(points[:, 2], 0))


def bend():
    """A quarter of a pipe bend of 150 mm, 30 mm of radius and 1.5 mm thick, with twelve by eight elements."""
    points, cells = box("hexahedron20", (12, 1, 8))
    phi, r, angle = -2 * np.pi * points[:, 0], 0.03 + 0.0015 * (points[:, 1] - 0.5), np.pi / 2 * points[:, 2]
    R = 0.15 + r * np.cos(phi)
    points, cells = merged(np.column_stack([R * np.cos(angle), r * np.sin(phi), R * np.sin(angle)]), cells, 1e-6)
    return points, cells, np.flatnonzero(np.isclose(points[:, 2], 0))


def bar(kind="hexahedron20", n=(5, 1, 1), size=(0.1, 0.02, 0.001), distort=0.0):
    points, cells = box(kind, n, size, distort=distort, seed=3)
    return points @ random_rotation(2).T, cells, np.flatnonzero(np.isclose(points[:, 0], 0))


def ours(kind, points, cells, held, section=REDUCED, count=10):
    """Frequencies, Hz."""
    model = solid_model(points, cells, kind, section)
    return frequencies(model, free_dofs(model, model.dof[held, :3]), count) / (2 * np.pi)


# --- CalculiX -----------------------------------------------------------------------------------------------------

CASES = {
    "tube": ("C3D20R", "hexahedron20", tube()),
    "bend": ("C3D20R", "hexahedron20", bend()),
    "row": ("C3D20R", "hexahedron20", bar()),
    "distorted": ("C3D20R", "hexahedron20", bar(n=(4, 3, 2), size=(0.1, 0.06, 0.01), distort=0.3)),
    "wedges": ("C3D15", "wedge15", bar("wedge15", n=(4, 2, 1), size=(0.1, 0.06, 0.005), distort=0.3)),
    "tube of wedges": ("C3D15", "wedge15", tube("wedge15")),
}
PRINTED = {  # by ccx 2.20
    "tube": 2 * [1298.248] + 2 * [1937.452] + 2 * [3130.661] + 2 * [3834.018] + 2 * [3895.615],
    "bend": [650.7366, 661.147, 1413.396, 1437.809, 2462.39, 2605.499, 3071.474, 3476.458],
    "row": [86.50115, 543.7519, 849.5609, 1546.001, 1648.889, 2600.857, 3159.304, 4529.486, 5571.609, 6844.273],
    "distorted": [863.4017, 2960.679, 4117.733, 5281.116, 9638.092, 13076.32, 14330.5, 14383.02, 15789.23, 19312.44],
    "wedges": [459.3515, 1783.095, 2987.702, 4141.516, 6165.265, 8850.267, 10320.17, 13083.9, 13596.78, 14559.19],
    "tube of wedges": 2 * [1832.391] + 2 * [1970.895] + 2 * [4228.467] + [5363.36] + 2 * [5440.048] + [6214.296],
}


@pytest.mark.parametrize("name", CASES)
def test_frequencies_are_the_printed_ones_of_calculix(name):
    _, kind, mesh = CASES[name]
    printed = PRINTED[name]
    np.testing.assert_allclose(ours(kind, *mesh, count=len(printed)), printed, rtol=DIGITS)


@needs_ccx
@pytest.mark.parametrize("name", CASES)
def test_what_is_printed_is_what_calculix_prints(name, tmp_path):
    """By whatever version is there; repeated frequencies differ in their last digit."""
    element, _, (points, cells, held) = CASES[name]
    found = theirs(deck(points, held, **{element: cells}), len(PRINTED[name]), tmp_path)
    np.testing.assert_allclose(found, PRINTED[name], rtol=1e-6)


# --- closed forms -------------------------------------------------------------------------------------------------


def tube_frequencies(R, t, count):
    """Bending of the section of a long thin tube, Hz, each twice, of ``E' = E / (1 - nu^2)``.

    ``w^2 = n^2 (n^2 - 1)^2 / (n^2 + 1) E' I / (rho A R^4)``: S. Timoshenko, Vibration problems in engineering (rings).
    """
    n = np.repeat(np.arange(2, 2 + count), 2)
    w2 = (n * (n**2 - 1)) ** 2 / (n**2 + 1) * STEEL.E / (1 - STEEL.nu**2) * t**2 / 12 / (STEEL.rho * R**4)
    return np.sqrt(w2) / (2 * np.pi)


def in_plane(section):
    """The same by sixteen elements, R / t = 100, held in z."""
    points, cells = ring(16, 1, 0.5, 0.005, 0.005)
    model = solid_model(points, cells, "hexahedron20", section)
    keep = free_dofs(model, model.dof[:, 2:])
    K, M = (submatrix(A, keep).toarray() for A in (model.K, model.M))
    w2 = 1 / eigh(M, K + SHIFT * M, eigvals_only=True)[::-1][3:7] - SHIFT
    return np.sqrt(w2) / (2 * np.pi)


def test_section_of_a_long_thin_tube():
    """Three quadratic arcs in a wave; the ring has no shear, which takes 1e-4."""
    exact = tube_frequencies(0.5, 0.005, 2)
    np.testing.assert_allclose(in_plane(REDUCED), exact, rtol=0.01)
    assert np.all(in_plane(FULL) > 4 * exact)  # it locks


def test_stress_of_bending():
    """A bar under pure bending, whose exact displacements are quadratic: ``s = E k y`` at every node."""
    points, cells = box("hexahedron20", (3, 1, 1), (0.3, 0.1, 0.1))
    model = solid_model(points, cells, "hexahedron20", REDUCED)
    x, y, z = (points - [0, 0.05, 0.05]).T
    k, nu = 1e-2, STEEL.nu
    u = np.column_stack([-k * x * y, k * (x**2 + nu * (y**2 - z**2)) / 2, k * nu * y * z])
    d = np.zeros((model.n_dof, 1))
    d[model.dof[: len(points), :3], 0] = u
    mesh = mp.fe.Mesh(points=points, cells={"hexahedron20": cells}, groups={"body": {"hexahedron20": np.arange(3)}})
    everywhere = StressPoint(box=((-1, -1, -1), (1, 1, 1)))
    found = stress_recovery(model, mesh, {"at": everywhere})(d)
    at = np.array([stress.position for stress in found.values()]) + model.origin
    stress = np.array([stress.modes[:, 0] for stress in found.values()])
    exact = np.zeros_like(stress)
    exact[:, 0] = -STEEL.E * k * (at[:, 1] - 0.05)
    np.testing.assert_allclose(stress, exact, atol=1e-11 * STEEL.E * k * 0.05)


def test_stress_of_what_the_points_do_not_see():
    """None, at every node: motions without stiffness have no strain at the points."""
    points, cells = box("hexahedron20", (1, 1, 1), (0.3, 0.2, 0.1))
    points[:, 0] += 0.1 * points[:, 1] * points[:, 2] / 0.02 + 0.2 * points[:, 2]
    block = SolidBlock.build("hexahedron20", points, cells, REDUCED, {}, np.zeros(3))
    values, shapes = np.linalg.eigh(block.stiffness()[0])
    unseen = shapes[:, :12]
    assert np.abs(values[:12]).max() < 1e-14 * values[-1] < values[12]
    _, stress = block.nodal_stress(unseen[None])[""]
    _, seen = block.nodal_stress(shapes[None, :, 12:])[""]
    assert np.abs(stress).max() < 1e-12 * np.abs(seen).max()


# --- identities ---------------------------------------------------------------------------------------------------


def shifted(cells):
    """Bricks of unit edges at places (k, 3), moved at random as a lattice whose inner corners move."""
    points, bricks = box("hexahedron20", (3, 3, 3), distort=0.3, seed=5)
    number = np.ravel_multi_index(np.array(cells).T, (3, 3, 3))
    used, own = np.unique(bricks[number], return_inverse=True)
    return points[used], own.reshape(-1, 20)


BODIES = {
    "one": shifted([(0, 0, 0)]),
    "row": shifted([(0, 0, 0), (1, 0, 0), (2, 0, 0)]),
    "straight row": box("hexahedron20", (4, 1, 1), (0.4, 0.1, 0.01)),
    "L": shifted([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
    "post on a plate": shifted([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (1, 1, 1)]),
    "posts that meet": shifted([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 1, 1), (1, 0, 1)]),
    "plate": shifted(list(itertools.product(range(3), range(3), [0]))),
    "ring": ring(8, 1, 0.1, 0.01, 0.02),
    "tube": ring(8, 3, 0.1, 0.01, 0.1),
}


@pytest.mark.parametrize("name", BODIES)
def test_six_motions_are_free_of_stiffness_and_no_more(name):
    """The seventh eigenvalue is that of a real deformation: at least 1e-6 of the largest, as with full integration."""
    points, cells = BODIES[name]
    lowest = {}
    for section in (REDUCED, FULL):
        model = solid_model(points, cells, "hexahedron20", section)
        keep = free_dofs(model)
        values = np.linalg.eigvalsh(submatrix(model.K, keep).toarray())
        assert np.abs(values[:6]).max() < 1e-14 * values[-1]
        assert rigid_residual(model, keep) < 1e-14
        lowest[section.integration] = values[6] / values[-1]
    assert lowest["reduced"] > 0.05 * lowest["full"]


# --- bodies -------------------------------------------------------------------------------------------------------


def twisted_row(section):
    """Model of a tapered and twisted bar of five bricks, clamped, whose end follows the mean of its face."""
    points, cells = box("hexahedron20", (5, 1, 1), (1.0, 0.1, 0.1), distort=0.3, seed=2)
    x, y, z = points.T
    points = np.column_stack([x, y * (1 + 1.5 * x * z), z * (1 + 2.1 * x * y)])
    ends = {name: np.flatnonzero(np.isclose(x, at)) for name, at in (("root", 0.0), ("tip", 1.0))}
    rows = np.cumsum([0, *map(len, ends.values())])
    mesh = mp.fe.Mesh(
        points=points,
        cells={"hexahedron20": cells, "vertex": np.concatenate(list(ends.values()))[:, None]},
        groups={"body": {"hexahedron20": np.arange(5)}}
        | {name: {"vertex": np.arange(*rows[k : k + 2])} for k, name in enumerate(ends)},
    )
    return mp.assemble(
        mesh, {"body": section}, {"root": mp.Interface(group="root"), "tip": mp.Interface(group="tip", kind="rbe3")}
    )


def test_modal_body_of_a_row():
    """A tip that follows a mean finds no motion without stiffness: all modes are near those of full integration."""
    found = {}
    for section in (REDUCED, FULL):
        model = twisted_row(section)
        reduction = mp.craig_bampton(model, modes=6)
        body = mp.flexible_body(model, reduction, name="bar")
        assert [check.name for check in check_geometric_stiffness(model, reduction, body) if not check.within] == []
        found[section.integration] = body.frequency
    np.testing.assert_allclose(found["reduced"][:6], found["full"][:6], rtol=0.08)


def test_what_holds_a_row_is_told():
    notes = [note for note in twisted_row(REDUCED).notes if "hourglass" in note]
    assert len(notes) == 1
    assert notes[0].startswith("5 hexahedra of reduced integration have no neighbours across their row")
    assert "6 of their faces" in notes[0]
    points, cells, _ = tube()
    assert not [note for note in solid_model(points, cells, "hexahedron20", REDUCED).notes if "hourglass" in note]


def test_refusals():
    with pytest.raises(mp.InputError, match="solid: integration 'selective'"):
        mp.Solid(material=STEEL, integration="selective")
    points, cells = box("tetra10", (1, 1, 1))
    with pytest.raises(mp.InputError, match="tetra10 cells, and integration 'reduced' is of hexahedron20 and wedge15"):
        solid_model(points, cells, "tetra10", REDUCED)
