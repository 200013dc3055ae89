"""Component mode synthesis: cut structures give back the uncut one; closed forms, loops, hinges, bad input."""

from itertools import pairwise

import numpy as np
import pytest
from analytic import cantilever_roots, clamped_pinned_roots, free_free_roots
from beam_series import halves_error
from scipy.linalg import eigh
from structured import random_rotation

import modalprep as mp
from modalprep.body.checks import rigid_mass_matrix
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.reduction.projected import body_matrices
from modalprep.reduction.synthesis import synthesise
from modalprep.vectors import skew

TUBE = dict(A=4e-4, Iy=2e-7, Iz=2e-7, J=4e-7, ky=1.0, kz=1.0)
PLANAR = dict(A=4e-2, Iy=2e-3, Iz=2e-7, J=2e-3, theory="euler-bernoulli")  # soft in the x-y plane only
STEEL = mp.Material(E=7e10, nu=0.4, rho=3000.0)


@pytest.fixture
def cb():
    """PyYeti's Craig-Bampton tools, which set how numpy prints."""
    with np.printoptions():
        yield pytest.importorskip("pyyeti.cb")


def line_mesh(corners, elements):
    """A chain of straight lines through the corners, groups beam, root and tip; closed when it returns."""
    points = np.vstack([np.linspace(a, b, elements + 1)[:-1] for a, b in pairwise(corners)])
    closed = np.allclose(corners[0], corners[-1])
    points = points if closed else np.vstack([points, corners[-1]])
    count = len(points) if closed else len(points) - 1
    line = np.stack([np.arange(count), np.arange(1, count + 1) % len(points)], axis=1)
    ends = np.array([[0], [len(points) - 1]])
    vertex = {"root": {"vertex": np.array([0])}, "tip": {"vertex": np.array([1])}}
    return mp.fe.Mesh(
        points=points, cells={"line": line, "vertex": ends}, groups={"beam": {"line": np.arange(count)}} | vertex
    )


def beam_model(length, elements, tip="fixed", start=0.0, **section):
    mesh = line_mesh(np.array([[start, 0, 0], [start + length, 0, 0.0]]), elements)
    ends = {n: mp.Interface(group=n, kind="node", boundary=b) for n, b in (("root", "fixed"), ("tip", tip))}
    return mp.assemble(mesh, {"beam": mp.Beam(material=STEEL, **(section or TUBE))}, ends)


def beam_body(length, elements, tip="fixed", modes=10_000, **section):
    model = beam_model(length, elements, tip, **section)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name="beam")


def full_frequencies(model, held):
    keep = np.setdiff1d(np.arange(model.n_dof), held)
    w2 = eigh(model.K.toarray()[np.ix_(keep, keep)], model.M.toarray()[np.ix_(keep, keep)], eigvals_only=True)
    return np.sqrt(np.abs(w2)) / (2 * np.pi)


def chain(parts):
    return [(f"{a}.tip", f"{b}.root") for a, b in pairwise(parts)]


@pytest.mark.parametrize("cuts", [(4, 8), (3, 4, 5)])
@pytest.mark.parametrize("clamped", [True, False])
def test_a_cut_beam_with_all_modes_is_the_uncut_beam(cuts, clamped):
    parts = {f"part{k}": beam_body(float(n), n, "free" if k == len(cuts) - 1 else "fixed") for k, n in enumerate(cuts)}
    found = synthesise(parts, chain(parts), ground=["part0.root"] if clamped else [])
    whole = beam_model(12.0, 12)
    exact = full_frequencies(whole, whole.interfaces[0].dofs if clamped else [])
    rigid = 0 if clamped else 6
    assert found.rigid == rigid
    assert np.all(found.frequency[:rigid] == 0)
    assert found.redundant == ()
    np.testing.assert_allclose(found.frequency[rigid:], exact[rigid:], rtol=1e-9)


@pytest.mark.parametrize(("count", "frequencies"), [(0, 2), (1, 4), (2, 4)])
def test_truncated_halves_have_the_errors_of_the_method(count, frequencies):
    parts = {"a": beam_body(5.0, 20, modes=count, **PLANAR), "b": beam_body(5.0, 20, "free", modes=count, **PLANAR)}
    found = synthesise(parts, chain(parts), ground=["a.root"])
    whole = beam_model(10.0, 40, **PLANAR)
    exact = full_frequencies(whole, whole.interfaces[0].dofs)
    in_plane = np.abs(found.nodal_shape("a")[:, 1]).max(axis=0) > 1e-3 * np.abs(found.nodal_shape("a")).max(axis=(0, 1))
    error = found.frequency[in_plane][:frequencies] / exact[:frequencies] - 1
    expected = halves_error(count, frequencies)
    np.testing.assert_allclose(error, expected, rtol=2e-3, atol=5e-8)  # eigh has 1e-16 (w_n / w_1)^2


def test_shapes_satisfy_the_equations_of_the_uncut_beam():
    parts = {"a": beam_body(4.0, 4), "b": beam_body(8.0, 8, "free")}
    found = synthesise(parts, chain(parts), ground=["a.root"], modes=6)
    whole = beam_model(12.0, 12)
    keep = np.setdiff1d(np.arange(whole.n_dof), whole.interfaces[0].dofs)
    _, phi = eigh(whole.K.toarray()[np.ix_(keep, keep)], whole.M.toarray()[np.ix_(keep, keep)])
    full = np.zeros((whole.n_dof, len(keep)))
    full[keep] = phi
    exact = full[whole.dof[:, :3]]  # (13, 3, modes)
    shape = np.concatenate([found.nodal_shape("a"), found.nodal_shape("b")[1:]])
    np.testing.assert_allclose(found.points("b")[:, 0], np.arange(4.0, 13.0))
    for k in (0, 2, 4):  # pairs of equal frequency: compare the planes they span
        a, b = shape[:, :, k : k + 2].reshape(39, 2), exact[:, :, k : k + 2].reshape(39, 2)
        turn = np.linalg.lstsq(b, a, rcond=None)[0]
        np.testing.assert_allclose(a, b @ turn, atol=1e-8)
        np.testing.assert_allclose(turn @ turn.T, np.eye(2), atol=1e-8)


def test_modes_are_orthonormal_and_welds_closed():
    parts = {"a": beam_body(4.0, 4), "b": beam_body(8.0, 8, "free")}
    found = synthesise(parts, chain(parts))
    gram = sum(x.T @ body_matrices(parts[n])[0] @ x for n, x in found.coordinates.items())
    np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-8)
    gap = found.nodal_shape("a")[-1] - found.nodal_shape("b")[0]
    assert np.abs(gap).max() < 1e-10 * np.abs(found.nodal_shape("a")).max()


def test_a_free_beam_has_six_zeros_and_the_closed_form():
    plain = {key: value for key, value in TUBE.items() if key[0] != "k"}
    parts = {"a": beam_body(5.0, 20, theory="euler-bernoulli", **plain, modes=12)}
    parts["b"] = parts["a"]
    found = synthesise(parts, chain(parts))
    exact = free_free_roots(3) ** 2 * np.sqrt(1.4e4 / 1.2) / 100 / (2 * np.pi)
    assert found.rigid == 6
    np.testing.assert_allclose(found.frequency[6:11:2], exact, rtol=2e-3)  # rotary inertia and 12 modes a half
    np.testing.assert_allclose(found.frequency[7:12:2], exact, rtol=2e-3)


def test_rigid_motions_carry_the_rigid_mass_of_the_whole(cb):
    parts = {"a": beam_body(4.0, 4), "b": beam_body(8.0, 8)}
    found = synthesise(parts, chain(parts))
    x = found.coordinates["a"][:6, :6]  # motion of the system's first root in the rigid modes
    mass = np.linalg.inv(x @ x.T)  # Phi^T M Phi = 1, so that x^-T x^-1 is the mass matrix about it
    at_centre, centre = cb.cgmass((mass + mass.T) / 2)
    np.testing.assert_allclose(centre, [6.0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(at_centre[0, 0], 1.2 * 12)
    whole = beam_model(12.0, 12).rigid
    np.testing.assert_allclose(mass, rigid_mass_matrix(whole.m, whole.s0, whole.E0), atol=1e-8)


def square_frame(elements=4):
    """Bodies of a square frame of side 3, with their placement and the welds that close it."""
    side = beam_body(3.0, elements)
    corner = 3.0 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    place = {f"s{k}": (corner[k], np.linalg.matrix_power(quarter, k)) for k in range(4)}
    welds = [(f"s{k}.tip", f"s{(k + 1) % 4}.root") for k in range(4)]
    return dict.fromkeys(place, side), welds, place, corner


def test_a_closed_frame_is_the_frame_of_the_elements():
    bodies, welds, place, corner = square_frame()
    found = synthesise(bodies, welds, place)
    mesh = line_mesh(np.vstack([corner, corner[:1]]), 4)
    root = {"root": mp.Interface(group="root", kind="node")}
    whole = mp.assemble(mesh, {"beam": mp.Beam(material=STEEL, **TUBE)}, root)
    assert found.rigid == 6
    assert found.redundant == ()
    np.testing.assert_allclose(found.frequency[6:], full_frequencies(whole, [])[6:], rtol=1e-8)


def test_the_frame_does_not_care_how_it_is_turned_or_which_weld_comes_first():
    bodies, welds, place, _ = square_frame()
    R = random_rotation(3)
    turned = {name: (R @ p + np.array([1.0, 2, 3]), R @ T) for name, (p, T) in place.items()}
    first = synthesise(bodies, welds, place)
    second = synthesise(bodies, [w[::-1] for w in welds[::-1]], {k: turned[k] for k in ("s1", "s0", "s2", "s3")})
    np.testing.assert_allclose(second.frequency, first.frequency, rtol=1e-8)


def test_a_weld_given_twice_is_named_and_changes_nothing():
    bodies, welds, place, _ = square_frame()
    found = synthesise(bodies, [*welds, welds[0][::-1]], place)
    assert found.redundant == ("weld s1.root - s0.tip: x, y, z, rx, ry, rz cannot open anyway",)
    np.testing.assert_allclose(found.frequency, synthesise(bodies, welds, place).frequency, rtol=1e-9)


def test_a_rigid_loop_has_six_redundant_conditions():
    bar = mp.rigid_body(
        "bar", mass=2.0, centre=np.array([1.5, 0, 0]), inertia=np.diag([0.1, 1.5, 1.5]),
        interfaces={"root": np.zeros(3), "tip": np.array([3.0, 0, 0])},
    )  # fmt: skip
    bodies, welds, place, _ = square_frame()
    found = synthesise(dict.fromkeys(bodies, bar), welds, place)
    assert found.frequency.tolist() == [0.0] * 6
    assert found.redundant == ("weld s3.tip - s0.root: x, y, z, rx, ry, rz cannot open anyway",)


def test_modes_that_cannot_follow_a_second_ground_are_named():
    arm = beam_body(5.0, 10, "free", modes=2)  # one bending mode in each plane: no stretch, no twist
    found = synthesise({"a": arm}, ground=["a.root", "a.tip"])
    assert "a.tip" in found.redundant[0]
    assert "rx" in found.redundant[0]


def hinged_halves():
    """Clamped at both ends, hinged about z in the middle; bending in the plane only is soft."""
    parts = {"a": beam_body(5.0, 20, modes=20, **PLANAR), "b": beam_body(5.0, 20, modes=20, **PLANAR)}
    return synthesise(parts, [("a.tip", "b.root", ("rz",))], ground=["a.root", "b.tip"])


def test_a_hinge_in_the_middle_gives_the_hinged_frequencies():
    """Symmetric shapes are two cantilevers, antisymmetric ones two clamped-pinned beams."""
    roots = np.sort(np.concatenate([cantilever_roots(3), clamped_pinned_roots(3)]))[:5]
    exact = roots**2 * np.sqrt(1.4e4 / (1.2 * 100)) / 25 / (2 * np.pi)  # EI, and A = 4e-2: 120 kg/m
    np.testing.assert_allclose(hinged_halves().frequency[:5], exact, rtol=1e-4)


def test_a_hinge_on_the_ground_lets_the_beam_swing():
    beam = beam_body(10.0, 40, "free", modes=20, **PLANAR)
    found = synthesise({"a": beam}, ground=[("a.root", "rz")])
    exact = clamped_pinned_roots(3) ** 2 * np.sqrt(1.4e4 / 120) / 100 / (2 * np.pi)
    assert found.rigid == 1
    np.testing.assert_allclose(found.frequency[1:4], exact, rtol=1e-4)


def test_a_hinge_turns_with_the_first_body():
    beam = beam_body(10.0, 40, "free", modes=20, **PLANAR)
    R = random_rotation(1)
    found = synthesise({"a": beam}, placement={"a": (np.zeros(3), R)}, ground=[("a.root", "rz")])
    np.testing.assert_allclose(found.frequency, synthesise({"a": beam}, ground=[("a.root", "rz")]).frequency, rtol=1e-9)


def test_bodies_without_a_placement_follow_their_neighbours():
    parts = {"a": beam_body(4.0, 4), "b": beam_body(8.0, 8)}
    R = random_rotation(0)
    found = synthesise(parts, [("b.root", "a.tip")], {"b": (np.array([1.0, 2, 3]), R)})
    np.testing.assert_allclose(found.position["a"], [1, 2, 3] - R @ [4.0, 0, 0])
    np.testing.assert_allclose(found.rotation["a"], R)
    apart = synthesise(parts)
    assert apart.rigid == 12


def test_a_body_turned_at_its_weld_keeps_its_own_axes():
    """An L of two beams, the second turned by a quarter, against one mesh."""
    parts = {"a": beam_body(3.0, 4), "b": beam_body(3.0, 4, "free")}
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found = synthesise(parts, chain(parts), {"b": (np.array([3.0, 0, 0]), quarter), "a": (np.zeros(3), np.eye(3))},
                       ["a.root"])  # fmt: skip
    mesh = line_mesh(np.array([[0, 0, 0], [3.0, 0, 0], [3.0, 3.0, 0]]), 4)
    root = {"root": mp.Interface(group="root", kind="node")}
    whole = mp.assemble(mesh, {"beam": mp.Beam(material=STEEL, **TUBE)}, root)
    np.testing.assert_allclose(found.frequency, full_frequencies(whole, whole.interfaces[0].dofs), rtol=1e-8)
    tip = found.nodal_shape("b")[-1]
    bend = found.coordinates["b"]
    np.testing.assert_allclose(tip, quarter @ (bend[:3] - skew([3.0, 0, 0]) @ bend[3:6] + parts["b"].phi[1] @ bend[6:]))


def test_equal_bodies_bolted_together_at_both_ends(bracket_model, bracket_body):
    """Moving alike they are one free bracket, moving against each other one held at both bolts: no other mode."""
    welds = [("a.bolt_a", "b.bolt_a"), ("a.bolt_b", "b.bolt_b")]
    found = synthesise({"a": bracket_body, "b": bracket_body}, welds)
    alike = synthesise({"a": bracket_body}).frequency
    table = mp.craig_bampton(bracket_model, modes=10).table
    against = table.frequency[np.isfinite(table.frequency)]  # fixed-interface modes and truncation vectors
    assert found.redundant == ()
    np.testing.assert_allclose(found.frequency, np.sort(np.concatenate([alike, against])), rtol=1e-7)


def test_a_body_with_a_mechanism_of_its_own_has_one_zero_more():
    beam = beam_body(5.0, 10, "free", modes=6)
    loose = beam.with_(K=np.where(np.arange(beam.n) == 2, 0.0, beam.K))
    assert synthesise({"a": loose}, ground=["a.root"]).rigid == 1
    free = synthesise({"a": loose})
    M, K = body_matrices(loose)
    exact = np.sqrt(np.abs(eigh(np.diag(K), M, eigvals_only=True))) / (2 * np.pi)
    assert free.rigid == 7
    np.testing.assert_allclose(free.frequency[7:], exact[7:], rtol=1e-9)


ARM = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
ROD = mp.rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3), interfaces=ARM)
PAIR = {"left": ROD, "right": ROD}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(bodies={}), "no bodies"),
        (dict(welds=[("lift.tip", "right.root")]), "body 'lift' does not exist; did you mean 'left'"),
        (dict(welds=[("left.tap", "right.root")]), "'left.tap' names no interface; did you mean 'tip'"),
        (dict(welds=[("left", "right.root")]), "'left' names no interface"),
        (dict(welds=[("left.tip", "left.tip")]), "with itself"),
        (dict(welds=[("left.tip",)]), "must name 2 interfaces"),
        (dict(welds=[("left.tip", "right.root", ("rw",))]), "direction 'rw' does not exist"),
        (dict(ground=["left.top"]), "ground left.top: 'left.top' names no interface"),
        (dict(placement={"middle": (np.zeros(3), np.eye(3))}), "placement: body 'middle' does not exist"),
        (dict(placement={"left": (np.zeros(3), -np.eye(3))}), "is no rotation"),
        (dict(welds=[("left.tip", "right.root"), ("left.root", "right.tip")]), "2 m apart"),
        (dict(modes=-1), "modes = -1"),
    ],
)
def test_bad_input_is_one_message(arguments, message):
    with pytest.raises(InputError, match=message):
        synthesise(**({"bodies": PAIR} | arguments))


def test_modes_of_a_repeated_root_do_not_depend_on_round_off():
    """Two equal bodies that nothing joins have each frequency twice: the first mode is that of the first."""
    body = uniform_beam(modes=6)
    system = synthesise({"a": body, "b": body}, [], ground=["a.root", "b.root"])
    np.testing.assert_allclose(system.frequency[::2], system.frequency[1::2], rtol=1e-8)
    a, b = (np.abs(system.coordinates[name]).max(axis=0) for name in ("a", "b"))
    assert np.all(b[::2] < 1e-7 * a[::2])
    assert np.all(a[1::2] < 1e-7 * b[1::2])
