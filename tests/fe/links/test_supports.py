"""Supports by component: closed forms of pinned and rolling beams, equivalent models, and sentences."""

import numpy as np
import pytest
from analytic import thin_plate_simply_supported, timoshenko_simply_supported
from fe.decks import PBAR, STEEL
from scipy.sparse.linalg import spsolve
from structured import box, random_rotation, surface

import modalprep as mp
from modalprep.body.verify import check_projection
from modalprep.examples import beam_mesh, spinup_section
from modalprep.fe.mesh.mesh import Mesh

L, GROUND = 10.0, {"base": mp.Interface(kind="support")}
PINNED = {"pin": mp.Support(group="root", components="1234"), "roller": mp.Support(group="tip", components="23")}


def frequencies(model, n, **more):
    return mp.craig_bampton(model, modes=n, **more).table.frequency[:n]


def turned(mesh, R, shift=(0.0, 0.0, 0.0)):
    return mesh.with_(points=mesh.points @ R.T + shift)


def exact(n):
    section = spinup_section()
    m = section.material
    planes = [
        timoshenko_simply_supported(n, E=m.E, G=m.G, k=1.0, rho=m.rho, A=section.A, I=I, L=L)
        for I in (section.Iy, section.Iz)  # noqa: E741
    ]
    return np.sort(np.concatenate(planes))[:n] / (2 * np.pi)


def test_a_beam_on_a_pin_and_a_roller():
    """Timoshenko's closed form; the frame of the supports has no nodes of its own and sits in their middle."""
    model = mp.assemble(beam_mesh(60, L), {"beam": spinup_section()}, GROUND, supports=PINNED)
    np.testing.assert_allclose(frequencies(model, 5), exact(5), rtol=2e-5)  # (pi n h / L)^4 / 720 at n = 3: 2e-5
    np.testing.assert_allclose(model.origin, [L / 2, 0, 0], atol=1e-12)
    assert model.interfaces[0].nodes.tolist() == [0, 60]
    assert all(check.passed for check in mp.body.check_model(model))


def test_supports_turn_with_their_axes():
    """The same beam in a random orientation: the axes of the supports turn with it."""
    R = random_rotation(4)
    straight = mp.assemble(beam_mesh(12, L), {"beam": spinup_section()}, GROUND, supports=PINNED)
    axes = (tuple(R[:, 0]), tuple(R[:, 1] + 0.3 * R[:, 0]))
    held = {
        "pin": mp.Support(group="root", components="1234", axes=axes),
        "roller": mp.Support(group="tip", components="23", axes=axes),
    }
    section = spinup_section(up=tuple(R[:, 2]))
    model = mp.assemble(turned(beam_mesh(12, L), R, (3.0, -1.0, 2.0)), {"beam": section}, GROUND, supports=held)
    np.testing.assert_allclose(frequencies(model, 6), frequencies(straight, 6), rtol=1e-9)
    assert all(check.passed for check in mp.body.check_model(model))
    reduction = mp.craig_bampton(model, modes=6)
    body = mp.flexible_body(model, reduction, name="beam")
    assert all(check.passed for check in check_projection(model, reduction, body))
    other = mp.flexible_body(straight, mp.craig_bampton(straight, modes=6), name="beam")
    np.testing.assert_allclose(body.E0, R @ other.E0 @ R.T, atol=1e-9 * abs(other.E0).max())
    of_modes = [np.trace(b.Kg_A[:, :6, :6], axis1=1, axis2=2) for b in (body, other)]
    np.testing.assert_allclose(of_modes[0], R @ of_modes[1], atol=1e-7 * abs(of_modes[1]).max())


def test_a_full_support_is_a_rigid_root():
    """All six components of two nodes, at a frame of supports and at the frame of an rbe2 in their middle."""
    mesh = beam_mesh(12, L)
    ends = mesh.with_(groups={**mesh.groups, "ends": {"vertex": np.array([0, 1])}})
    rigid = mp.assemble(ends, {"beam": spinup_section()}, {"ends": mp.Interface(group="ends")})
    held = mp.assemble(ends, {"beam": spinup_section()}, GROUND, supports={"ends": mp.Support(group="ends")})
    np.testing.assert_allclose(frequencies(held, 6), frequencies(rigid, 6), rtol=1e-10)
    bodies = [mp.flexible_body(model, mp.craig_bampton(model, modes=6), name="beam") for model in (held, rigid)]
    np.testing.assert_allclose(np.abs(bodies[0].S), np.abs(bodies[1].S), atol=1e-8 * np.abs(bodies[1].S).max())


def test_a_support_beside_a_clamped_root():
    """A propped cantilever: tan x = tanh x, x = 3.926602 (Blevins 1979, table 8-1); thin, by Euler and Bernoulli."""
    section = spinup_section(theory="euler-bernoulli", Iy=2e-9, Iz=2e-9, J=4e-9)
    root = {"root": mp.Interface(group="root", kind="node")}
    model = mp.assemble(
        beam_mesh(40, L), {"beam": section}, root, supports={"prop": mp.Support(group="tip", components="23")}
    )
    found = 2 * np.pi * frequencies(model, 1)[0]
    assert found == pytest.approx(
        3.926602312**2 * np.sqrt(7e10 * 2e-9 / (1.2 * L**4)), rel=1e-5
    )  # rotary inertia: 5e-6


def test_edges_of_a_plate_share_their_corners():
    """Four supports, each of an edge; a corner is held once. Thin plate: Navier's series."""
    a, b, t = 1.0, 0.7, 0.002
    points, quads = surface(20, 14, "quad", lambda x, y: (a * x, b * y, 0 * x))
    mesh = Mesh(points=points, cells={"quad": quads}, groups={"plate": {"quad": np.arange(len(quads))}})
    steel = mp.Material(E=2.1e11, nu=0.3, rho=7850.0)
    far = (a, b, 0.0)
    edges = {
        f"{axis}{k}": mp.Support(plane=(point, normal), components=components)
        for axis, normal, components in (("x", (1.0, 0, 0), "23"), ("y", (0, 1.0, 0), "13"))
        for k, point in enumerate(((0.0, 0.0, 0.0), far))
    }
    model = mp.assemble(mesh, {"plate": mp.Shell(material=steel, thickness=t)}, GROUND, supports=edges)
    D = 2.1e11 * t**3 / 12 / (1 - 0.09)
    expected = thin_plate_simply_supported([(1, 1), (2, 1), (1, 2)], D=D, rho_h=7850 * t, a=a, b=b) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(model, 3), expected, rtol=8e-3)  # 14 elements along the shorter edge: 5e-3


def test_a_pinned_column_buckles_under_its_own_weight():
    """Pinned ends, the lower one holding: (q L) = 18.5687 EI / L^2 (Timoshenko and Gere 1961, section 2.12: 18.6)."""
    section = spinup_section(theory="euler-bernoulli")
    model = mp.assemble(beam_mesh(32, L), {"beam": section}, GROUND, supports=PINNED)
    factor = mp.reduction.buckling(model, None, gravity=(-1.0, 0.0, 0.0)).value[0]
    assert factor * 1.2 * L == pytest.approx(18.5687 * 1.4e4 / L**2, rel=1e-3)


def test_a_solid_is_held_in_the_components_that_it_has():
    """Three planes of symmetry of a bar, free to contract: uniaxial stress, u = F L / (E A)."""
    points, cells = box("hexahedron", (2, 2, 2), (2.0, 1.0, 1.0))
    mesh = Mesh(points=points, cells={"hexahedron": cells}, groups={"bar": {"hexahedron": np.arange(len(cells))}})
    material = mp.Material(E=7e10, nu=0.3, rho=2700.0)
    planes = {
        c: mp.Support(plane=((0.0, 0.0, 0.0), tuple(np.eye(3)[k])), components=c + "456") for k, c in enumerate("123")
    }
    model = mp.assemble(mesh, {"bar": mp.Solid(material=material)}, GROUND, supports=planes)
    pull = np.zeros(model.n_dof)
    end = np.flatnonzero(mesh.points[:, 0] == 2.0)
    weight = np.array([1 / 16, 1 / 8, 1 / 16, 1 / 8, 1 / 4, 1 / 8, 1 / 16, 1 / 8, 1 / 16])
    pull[model.dof[end, 0]] = weight
    K, root = model.C.T @ model.K @ model.C, np.searchsorted(model.free, model.interfaces[0].dofs)
    keep = np.setdiff1d(np.arange(K.shape[0]), root)
    x = np.zeros(K.shape[0])
    x[keep] = spsolve(K[keep][:, keep].tocsc(), (model.C.T @ pull)[keep])
    d = model.C @ x
    np.testing.assert_allclose(d[model.dof[end, 0]], 2.0 / 7e10, rtol=1e-9)
    side = np.flatnonzero(mesh.points[:, 1] == 1.0)
    np.testing.assert_allclose(d[model.dof[side, 1]], -0.3 / 7e10, rtol=1e-9)


def test_supports_that_leave_a_mechanism_are_refused():
    with pytest.raises(mp.MechanismError, match="without strain|mechanism"):
        mp.craig_bampton(
            mp.assemble(beam_mesh(6, L), {"beam": spinup_section()}, GROUND,
                        supports={"pin": mp.Support(group="root", components="123")}), modes=2)  # fmt: skip


def test_what_the_root_holds_already_is_left_to_it():
    """A support that includes nodes of a rigid root holds the others."""
    mesh, sections = beam_mesh(8, L), {"beam": spinup_section()}
    more = mesh.with_(groups={**mesh.groups, "ends": {"vertex": np.array([0, 1])}})
    root = {"root": mp.Interface(group="root", kind="node")}
    both = mp.assemble(more, sections, root, supports={"all": mp.Support(group="ends", components="23")})
    tip = mp.assemble(more, sections, root, supports={"tip": mp.Support(group="tip", components="23")})
    np.testing.assert_allclose(frequencies(both, 4), frequencies(tip, 4), rtol=1e-12)


SLOPE = ((1.0, 1.0, 0.0), (0.0, 1.0, 0.0))
OVERLAPS = {
    "a part of what another holds": ({}, {"components": "3"}),
    "along other axes what another holds wholly": ({"components": "123"}, {"components": "1", "axes": SLOPE}),
    "all along other axes": ({"components": "2", "axes": SLOPE}, {"components": "123456"}),
    "rotations of one and translations of another": (
        {"components": "1", "axes": SLOPE}, {"components": "456"},
    ),
    "translations and rotations along axes of their own": (
        {"components": "123", "axes": SLOPE}, {"components": "4", "axes": ((1.0, 0.0, 1.0), (0.0, 1.0, 0.0))},
    ),
    "other components along the same axes": (
        {"components": "1", "axes": SLOPE}, {"components": "234", "axes": SLOPE},
    ),
}  # fmt: skip


@pytest.mark.parametrize("overlap", OVERLAPS.values(), ids=OVERLAPS)
def test_the_order_of_supports_does_not_matter(overlap):
    """Two supports of one node hold what both name, whichever comes first."""
    mesh, sections = beam_mesh(8, L), {"beam": spinup_section()}
    root = {"root": mp.Interface(group="root", kind="node")}
    first, second = (mp.Support(group="tip", **values) for values in overlap)
    models = [
        mp.assemble(mesh, sections, root, supports=supports)
        for supports in ({"a": first, "b": second}, {"b": second, "a": first})
    ]
    ours, other = (model.C.toarray() for model in models)
    assert ours.shape == other.shape
    np.testing.assert_allclose(ours @ np.linalg.lstsq(ours, other, rcond=None)[0], other, atol=1e-9)


REFUSED = {
    "no supports": (GROUND, {}, "kind 'support', which needs supports"),
    "not the root": (
        {"root": mp.Interface(group="root", kind="node"), **GROUND}, PINNED, "only the root interface can be",
    ),
    "unknown set": (GROUND, {"a": mp.Support(set="spc_1")}, "no set of supports 'spc_1'; it has none"),
    "driven by the root": (
        {"root": mp.Interface(group="root", position=(0.0, 1.0, 0.0), kind="rbe3")},
        {"a": mp.Support(group="root", components="123")}, "interface 'root' and support 'a' drive the same node",
    ),
    "other axes": (
        GROUND, PINNED | {"x": mp.Support(group="tip", components="1", axes=((1.0, 1, 0), (0, 1.0, 0)))},
        "support 'x' holds a node that another holds along other axes",
    ),
    "an interface on a support": (
        {**GROUND, "tip": mp.Interface(group="tip", kind="node")}, PINNED, "'tip' sits on a node that support 'roller'",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("interfaces", "supports", "said"), REFUSED.values(), ids=list(REFUSED))
def test_refusals(interfaces, supports, said):
    mesh = beam_mesh(4, L)
    section = spinup_section()
    if "drive" in said:
        points = np.array([[0.0, 0, 0], [2.0, 1, 0], [4.0, -1, 1], [6.0, 0, 3], [8.0, 0, 0]])
        vertices = np.concatenate([mesh.cells["vertex"], [[1], [2], [3]]])
        groups = {**mesh.groups, "root": {"vertex": np.array([0, 2, 3, 4])}}
        mesh = mesh.with_(points=points, cells={**mesh.cells, "vertex": vertices}, groups=groups)
    with pytest.raises(mp.InputError, match=said):
        mp.assemble(mesh, {"beam": section}, interfaces, supports=supports)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"group": "a", "components": "127"}, "'127' of a support are not digits 1 to 6"),
        ({"group": "a", "components": ""}, "are not digits"),
        ({"group": "a", "axes": ((1.0, 0, 0), (2.0, 0, 0))}, "lie on one line"),
        ({"set": "spc_1", "components": "1"}, "has its own nodes"),
        ({"set": "spc_1", "group": "a"}, "has its own nodes"),
        ({}, "exactly one of"),
    ],
)
def test_a_support_says_what_is_wrong(given, said):
    with pytest.raises(mp.InputError, match=said):
        mp.Support(**given)


def test_supports_of_a_deck_along_its_displacement_systems(read):
    """A beam at 30 degrees in the basic system; the rolling end slides along the beam (CD = 5)."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    n = 12
    grids = "".join(
        f"GRID,{i + 1},,{i * L * c / n:.9f},{i * L * s / n:.9f},0.,{5 if i == n else ''}\n" for i in range(n + 1)
    )
    bars = "".join(f"CBAR,{i + 1},5,{i + 1},{i + 2},0.,0.,1.\n" for i in range(n))
    system = f"CORD2R,5,,0.,0.,0.,0.,0.,1.,\n,{c:.12f},{s:.12f},0.\n"
    text = system + grids + bars + PBAR + STEEL
    mesh = read(text + f"SPC1,1,123,1\nSPC1,2,23,{n + 1}\nSPC,3,1,4\nSPCADD,8,1,2,3\n")
    straight = "".join(f"GRID,{i + 1},,{i * L / n:.9f},0.,0.\n" for i in range(n + 1))
    plain = read(straight + bars + PBAR + STEEL, name="plain.bdf")
    assert set(mesh.supports) == {"spc_1", "spc_2", "spc_3", "spc_8"}
    held = {"deck": mp.Support(set="spc_8")}
    own = {"pin": mp.Support(node=1, components="123"), "turn": mp.Support(node=1, components="4"),
           "roller": mp.Support(node=n + 1, components="23")}  # fmt: skip
    expected = frequencies(mp.assemble(plain, {}, GROUND, supports=own), 5)
    # SPC 4 of grid 1 is about the basic x axis, 30 degrees off the beam: the twist is held through bending as well
    tilted = {**own, "turn": mp.Support(node=1, components="4", axes=((c, -s, 0.0), (s, c, 0.0)))}
    tilted = {k: v for k, v in tilted.items() if k != "pin"} | {
        "pin": mp.Support(node=1, components="123", axes=((c, -s, 0.0), (s, c, 0.0)))
    }
    found = frequencies(mp.assemble(mesh, {}, GROUND, supports=held), 5)
    np.testing.assert_allclose(found, frequencies(mp.assemble(plain, {}, GROUND, supports=tilted), 5), rtol=1e-7)
    assert abs(found - expected).max() > 1e-6 * expected.max()
