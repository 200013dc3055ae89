"""Section forces, reactions, springs, cuts and accelerations: by hand, by equilibrium, by the order of convergence."""

from dataclasses import replace

import numpy as np
import pytest
from body.test_stress_modes import AREA, LENGTH, STEEL, B, H

import modalprep as mp
from modalprep.body.recovery import BodyMotion, at_rest
from modalprep.examples import beam_mesh, spinup_section
from modalprep.reduction.dropped import dropped_modes
from modalprep.vectors import skew

Recover = mp.fe.Recover
LINE_MASS = STEEL.rho * AREA
ROOT, TIP = mp.Interface(group="root", kind="node"), mp.Interface(group="tip", kind="node", boundary="free")


def cantilever(modes, elements=20, truncation=(), section=None, **wanted):
    """A steel cantilever of 2 m along x with recoveries."""
    mesh = beam_mesh(elements, LENGTH)
    section = section or mp.fe.beam_section("rectangle", STEEL, width=B, height=H)
    model = mp.assemble(mesh, {"beam": section}, {"root": ROOT, "tip": TIP})
    reduction = mp.craig_bampton(model, modes=modes, truncation=truncation)
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    return mp.flexible_body(model, reduction, name="beam", recovery=recovery)


def linear(body, *, q=None, A=(0, 0, 0), omega=(0, 0, 0), alpha=(0, 0, 0), loads=None):
    """A motion that satisfies ``q'' + K q = -S A - H : W + Phi^T F``; q None: static equilibrium."""
    A, omega, alpha = (np.asarray(x, dtype=float)[None] for x in (A, omega, alpha))
    loads = np.zeros((len(body.phi), 6)) if loads is None else np.asarray(loads, dtype=float)
    W = (skew(alpha) + skew(omega) @ skew(omega))[0]
    force = -np.einsum("an,a->n", body.S, A[0]) - np.einsum("abn,ab->n", body.H, W)
    force += np.einsum("kan,ka->n", np.concatenate([body.phi, body.psi], axis=1), loads)
    q = force / body.K if q is None else q
    qdd = force - body.K * q
    return BodyMotion(q[None], 0 * q[None], qdd[None], A, omega, alpha, loads[None])


def only(block, motion):
    """The values (p, c) at the one time of a motion."""
    return block.values(motion)[0]


# --- statics by hand --------------------------------------------------------------------------------------------------


def test_cantilever_under_a_tip_load():
    """N = Fx, V = F, My = -Fz (L - x), Mz = Fy (L - x), T = Mx: the face of normal +x feels what is beyond."""
    body = cantilever(4, elements=3, truncation=("interfaces",), beam=Recover(kind="section_force", stations=3))
    load = np.zeros((2, 6))
    load[1] = F, G, K, T, *_ = 7.0, 11.0, -5.0, 3.0, 0.0, 0.0
    block = body.recovery["beam"]
    assert block.places[:3] == ("1.start", "1.50%", "1.end")
    left = LENGTH - block.position[:, 0]
    expected = np.stack([F + 0 * left, G + 0 * left, K + 0 * left, T + 0 * left, -K * left, G * left], axis=1)
    found = only(block, linear(body, loads=load))
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8)  # of the solution of the finite-element model


def test_weight_of_a_cantilever_between_its_nodes():
    """V = w (L - x), M = w (L - x)^2 / 2 at every place along elements, with one mode and its static correction."""
    body = cantilever(1, elements=4, beam=Recover(kind="section_force", stations=5), base=Recover(kind="reaction"))
    g = 9.81
    found, motion = body.recovery["beam"], linear(body, A=(0, 0, g))
    left, w = LENGTH - found.position[:, 0], LINE_MASS * g
    values = only(found, motion)
    assert values[:, 2] == pytest.approx(-w * left, abs=1e-9 * w)  # round-off of the finite-element solution
    assert values[:, 4] == pytest.approx(w * left**2 / 2, abs=1e-8 * w)
    weight = w * LENGTH
    assert only(body.recovery["base"], motion)[0] == pytest.approx(
        [0, 0, weight, 0, -weight * LENGTH / 2, 0], abs=1e-8 * weight
    )


def test_weight_of_a_tapered_cantilever_between_its_nodes():
    """V and M of a beam whose area is linear in two panels: integrals of rho g A beyond each place, in one element."""
    ends = (0.0, 0.4, 1.0)
    areas = np.array([6e-4, 2e-4, 5e-4])
    taper = tuple((x, A, A**2, 2 * A**2, 2 * A**2, 0.5 * A) for x, A in zip(ends, areas, strict=True))
    section = mp.Beam(material=STEEL, A=6e-4, Iy=1e-8, Iz=1e-8, J=1e-8, taper=taper)
    body = cantilever(1, elements=1, section=section, beam=Recover(kind="section_force", stations=11))
    g, block = 9.81, body.recovery["beam"]
    values = only(block, linear(body, A=(0, 0, g)))
    x = np.linspace(0, LENGTH, 20_001)
    line = (STEEL.rho + 0.5) * np.interp(x, np.array(ends) * LENGTH, areas) * g
    for place, force in zip(block.position[:, 0], values, strict=True):
        beyond = line[x >= place - 1e-12]
        left = x[x >= place - 1e-12] - place
        weight = line.sum() * x[1]
        # of the trapezoidal rule, exact of the weight and to (1e-4)^2 of the moment
        assert force[2] == pytest.approx(-np.trapezoid(beyond, left), abs=1e-8 * weight)
        assert force[4] == pytest.approx(np.trapezoid(beyond * left, left), abs=1e-7 * weight * LENGTH)


def test_two_bars_carry_a_load_at_their_joint():
    """N = P / (2 cos 30 deg) in each; the supports take half of it, and a spring beside them k times its motion."""
    points = np.array([[-np.tan(np.pi / 6), 0, 1.0], [np.tan(np.pi / 6), 0, 1], [0, 0, 0]])
    mesh = mp.fe.Mesh(
        points=points,
        cells={"line": np.array([[0, 2], [1, 2]]), "vertex": np.array([[0], [1], [2]])},
        groups={
            "bars": {"line": np.arange(2)},
            "left": {"vertex": np.array([0])},
            "right": {"vertex": np.array([1])},
            "joint": {"vertex": np.array([2])},
        },
    )
    sections = {
        "bars": mp.Truss(material=STEEL, A=1e-4),
        "joint": mp.Spring(translation=(0.0, 1e5, 0.0)),
    }
    supports = {"a": mp.Support(group="left", components="123"), "b": mp.Support(group="right", components="123")}
    model = mp.assemble(mesh, sections, {"root": mp.Interface(kind="support")}, supports=supports)
    wanted = {
        "bars": Recover(kind="section_force", group="bars", method="displacement"),
        "left": Recover(kind="reaction", group="left", method="displacement"),
        "all": Recover(kind="reaction"),
        "spring": Recover(kind="force", group="joint", method="displacement"),
    }
    P, Q = 1000.0, 40.0
    load = np.zeros((model.n_dof, 1))
    load[model.dof[2, [1, 2]], 0] = Q, -P
    reduction = mp.craig_bampton(model, modes=9, truncation=("push",), loads={"push": load})
    body = mp.flexible_body(model, reduction, name="bars", recovery=mp.fe.model_recovery(model, mesh, wanted))
    motion = at_rest(((reduction.basis.T @ load)[:, 0] / body.K)[None], 1)
    N = P / (2 * np.cos(np.pi / 6))
    assert only(body.recovery["bars"], motion)[:, 0] == pytest.approx([N] * 4, rel=1e-9)  # round-off
    half = [-P / 2 * np.tan(np.pi / 6), 0, P / 2, 0, 0, 0]
    assert only(body.recovery["left"], motion)[0] == pytest.approx(half, abs=1e-9 * P)
    assert only(body.recovery["all"], motion)[0] == pytest.approx([0, 0, P, 0, 0, 0], abs=1e-9 * P)
    assert only(body.recovery["spring"], motion)[0] == pytest.approx([0, Q, 0, 0, 0, 0], abs=1e-9 * P)


# --- moving beams, closed forms ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("modes", [1, 5])
def test_axial_force_of_a_spinning_beam(modes):
    """N(x) = rho A w^2 (L^2 - x^2) / 2 (statics of a string of mass), with bending modes alone among the kept ones."""
    body = cantilever(modes, beam=Recover(kind="section_force", stations=6))
    w = 20.0
    block = body.recovery["beam"]
    expected = LINE_MASS * w**2 * (LENGTH**2 - block.position[:, 0] ** 2) / 2
    found = only(block, linear(body, omega=(0, 0, w)))[:, 0]
    assert found == pytest.approx(expected, abs=1e-10 * expected.max())  # round-off; exact at and between nodes


def test_bending_of_a_beam_that_starts_to_turn():
    """Inertia rho A alpha x: M(x) = rho A alpha (L - x)^2 (2 L + x) / 6, V(x) = rho A alpha (L^2 - x^2) / 2."""
    body = cantilever(2, beam=Recover(kind="section_force", stations=4), base=Recover(kind="reaction"))
    alpha = 5.0
    block, motion = body.recovery["beam"], linear(body, alpha=(0, 0, alpha))
    x, found = block.position[:, 0], only(block, motion)
    own, Iz = LINE_MASS * alpha, STEEL.rho * B**3 * H / 12 * alpha  # the sections turn as well
    assert found[:, 1] == pytest.approx(-own * (LENGTH**2 - x**2) / 2, abs=1e-10 * own * LENGTH**2)
    expected = -own * (LENGTH - x) ** 2 * (2 * LENGTH + x) / 6 - Iz * (LENGTH - x)
    assert found[:, 5] == pytest.approx(expected, abs=1e-9 * own * LENGTH**3)
    root = [0, own * LENGTH**2 / 2, 0, 0, 0, own * LENGTH**3 / 3 + Iz * LENGTH]
    assert only(body.recovery["base"], motion)[0] == pytest.approx(root, abs=1e-9 * own * LENGTH**3)


def test_a_lumped_beam_has_steps_at_its_nodes():
    """A string of point masses that spins: N between nodes i and i + 1 is w^2 of the first moment beyond."""
    mesh, n, w = beam_mesh(4, LENGTH), 4, 20.0
    model = mp.assemble(mesh, {"beam": spinup_section()}, {"root": ROOT, "tip": TIP}, mass="lumped")
    reduction = mp.craig_bampton(model, modes=1, truncation=())
    wanted = {"beam": Recover(kind="section_force")}
    body = mp.flexible_body(model, reduction, name="b", recovery=mp.fe.model_recovery(model, mesh, wanted))
    x = np.linspace(0, LENGTH, n + 1)
    mass = 1.2 * LENGTH / n * np.array([0.5, 1, 1, 1, 0.5])
    beyond = [w**2 * np.sum((mass * x)[i + 1 :]) for i in range(n)]
    found = only(body.recovery["beam"], linear(body, omega=(0, 0, w)))[:, 0]
    assert found == pytest.approx(np.repeat(beyond, 2), rel=1e-10)  # round-off


# --- equilibrium ------------------------------------------------------------------------------------------------------


def frame_mesh(seed):
    """A random space frame: a cloud of nodes joined to their neighbours; the far half is ``beyond``."""
    random = np.random.default_rng(seed)
    points = random.uniform(-1, 1, (12, 3))
    points = points[np.argsort(points[:, 0])]
    lines = {(i, i + 1) for i in range(11)}
    lines |= {tuple(sorted(random.choice(12, 2, replace=False).tolist())) for _ in range(12)}
    lines = np.array(sorted(line for line in lines if line[1] < 11 or line[0] > 5))  # the tip is not at the cut
    beyond = np.flatnonzero(lines.min(axis=1) >= 6)
    near = np.flatnonzero(lines.min(axis=1) < 6)
    groups = {"near": {"line": near}, "beyond": {"line": beyond}}
    groups |= {"root": {"vertex": np.array([0])}, "tip": {"vertex": np.array([1])}}
    return mp.fe.Mesh(points=points, cells={"line": lines, "vertex": np.array([[0], [11]])}, groups=groups)


def far_part(mesh):
    """The mesh without the lines of the near half."""
    lines = mesh.cells["line"][mesh.groups["beyond"]["line"]]
    groups = {"beyond": {"line": np.arange(len(lines))}, "tip": mesh.groups["tip"]}
    return mp.fe.Mesh(points=mesh.points, cells={"line": lines, "vertex": mesh.cells["vertex"]}, groups=groups)


def frame_section():
    return mp.Beam(material=STEEL, A=3e-4, Iy=4e-8, Iz=7e-8, J=5e-8, up=(0.3, 0.5, 0.8), offset=(0.01, -0.02))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("mass", ["coupled", "lumped", "nastran"])
def test_forces_through_a_cut_are_the_loads_beyond_it(seed, mass):
    """Whatever the modes: the far part's momentum rate, from a model of it alone, less the load at its tip."""
    mesh, ends = frame_mesh(seed), {"root": ROOT, "tip": TIP}
    section = frame_section()
    model = mp.assemble(mesh, {"near": section, "beyond": section}, ends, mass=mass)
    reduction = mp.craig_bampton(model, modes=5, truncation=("inertia",))
    wanted = {
        "cut": Recover(kind="cut", group="beyond"),
        "base": Recover(kind="reaction"),
        "motion": Recover(kind="acceleration", group="beyond"),
    }
    body = mp.flexible_body(model, reduction, name="frame", recovery=mp.fe.model_recovery(model, mesh, wanted))
    random = np.random.default_rng(seed)
    q = random.standard_normal(body.n) / (body.K**0.5)
    loads = random.standard_normal((2, 6)) * 100
    motion = linear(
        body, q=q, A=random.standard_normal(3) * 10, omega=random.standard_normal(3) * 3,
        alpha=random.standard_normal(3) * 20, loads=loads,
    )  # fmt: skip
    alone = mp.assemble(far_part(mesh), {"beyond": section}, {"tip": replace(TIP, boundary="fixed")}, mass=mass)
    drives = motion.drives()[0, :12]
    for name, part, at in (("cut", alone, None), ("base", model, model.points[0])):
        used = np.flatnonzero(part.dof[: len(mesh.points), 0] >= 0)
        a = np.zeros(part.n_dof)
        a[part.dof[used]] = (reduction.basis @ motion.qdd[0])[model.dof[used]]
        g, h = part.g, part.h + part.g[:, :, None] * (part.origin - model.origin)  # of the part alone: about its tip
        force = part.M @ a + np.concatenate([g, h.reshape(-1, 9)], axis=1) @ drives
        force[part.dof[11]] -= loads[1]
        at = body.recovery[name].position[0]
        rigid = np.zeros((part.n_dof, 6))
        for node in used:
            rigid[part.dof[node], :] = np.block(
                [[np.eye(3), -skew(model.points[node] - at)], [np.zeros((3, 3)), np.eye(3)]]
            )
        expected = rigid.T @ force
        assert only(body.recovery[name], motion)[0] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(2))
def test_section_forces_meet_at_every_node(seed):
    """At a node without load the section forces of all beams, in the axes of the mesh, add up to zero."""
    mesh, section = frame_mesh(seed), replace(frame_section(), offset=(0.0, 0.0))
    model = mp.assemble(mesh, {"near": section, "beyond": section}, {"root": ROOT, "tip": TIP})
    reduction = mp.craig_bampton(model, modes=3, truncation=())
    wanted = {"all": Recover(kind="section_force")}
    body = mp.flexible_body(model, reduction, name="frame", recovery=mp.fe.model_recovery(model, mesh, wanted))
    random = np.random.default_rng(seed)
    motion = linear(body, A=random.standard_normal(3), alpha=random.standard_normal(3), loads=[[0] * 6, [1.0] * 6])
    values = only(body.recovery["all"], motion).reshape(-1, 2, 6)
    total = np.zeros((12, 6))
    nodes, frames = (
        np.concatenate([getattr(b, key) for b in model.strain_energy.blocks]) for key in ("nodes", "frame")
    )
    for (i, j), R, (start, end) in zip(nodes, frames, values, strict=True):
        for node, sign, force in ((i, -1, start), (j, 1, end)):
            total[node] += sign * np.concatenate([R.T @ force[:3], R.T @ force[3:]])
    assert total[11] == pytest.approx(np.ones(6), abs=1e-9 * np.abs(values).max())
    assert np.abs(total[1:11]).max() < 1e-9 * np.abs(values).max()


def test_a_projected_body_keeps_its_statics():
    """Two of twelve directions kept: the section forces of a static load are those of the full basis."""
    wanted = {"beam": Recover(kind="section_force"), "bare": Recover(kind="section_force", method="displacement")}
    body = cantilever(12, elements=4, truncation=("interfaces",), **wanted)
    basis = mp.reduction.projected_basis(np.eye(body.n)[:, :2], np.diag(body.K), np.eye(body.n))
    small = mp.reduction.reduced_body(body, basis)
    load = np.zeros((2, 6))
    load[1] = 7.0, 11.0, -5.0, 3.0, 0.5, -0.4
    loads = {"A": (1.0, 2, 3), "omega": (3.0, 0, 1), "alpha": (0, 5.0, -2.0), "loads": load}
    expected, found = (only(x.recovery["beam"], linear(x, **loads)) for x in (body, small))
    assert small.n == 2
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())  # round-off of the flexibility
    bare = only(small.recovery["bare"], linear(small, **loads))
    assert np.abs(bare - expected).max() > 0.01 * np.abs(expected).max()
    # the same momentum: modes that do not rest
    q = np.array([1e-3, -2e-4])
    moving, same = linear(small, q=q, **loads), basis.basis @ q
    own = only(small.recovery["beam"], moving)
    qdd = basis.basis @ moving.qdd[0]
    whole = linear(body, **loads)
    rest = whole.q[0] - (basis.basis @ linear(small, **loads).q[0])
    inertia = (np.diag(1 / body.K) - basis.basis @ np.diag(1 / small.K) @ basis.basis.T) @ qdd
    full = whole._replace(q=(same + rest - inertia)[None], qdd=qdd[None])
    assert own == pytest.approx(only(body.recovery["beam"], full), abs=1e-9 * np.abs(own).max())


# --- convergence ------------------------------------------------------------------------------------------------------


def test_mode_acceleration_converges_faster(capsys):
    """Root moment under a harmonic tip force below the first frequency: error like n^-2, and n^-6 with correction.

    Moments of Euler beams grow as w_k and tip displacements not at all, so that the terms of the sums fall as
    w_k^-1 ~ k^-2 and, with the static part taken out, as w^2 w_k^-3 ~ k^-6; alternating sums have the order of
    their first missing term.
    """
    kept, errors = (2, 4, 8, 16), {}
    section = mp.Beam(material=STEEL, A=AREA, Iy=B * H**3 / 12, Iz=1e-6, J=1e-8, theory="euler-bernoulli")
    for method in ("displacement", "acceleration"):
        exact = None
        for modes in (10_000, *kept):
            wanted = {"beam": Recover(kind="section_force", method=method)}
            body = in_plane(modes, section, wanted)
            w, phi = 0.6 * np.sqrt(body.K[0]), body.phi[1, 2]
            q = phi / (body.K - w**2)
            loads = np.zeros((1, 2, 6))
            loads[0, 1, 2] = 1.0
            found = only(body.recovery["beam"], at_rest(q[None], 2, loads)._replace(qdd=-(w**2) * q[None]))[0, 4]
            exact = found if exact is None else exact
            errors.setdefault(method, []).append(abs(found / exact - 1))
    order = {method: np.polyfit(np.log(kept), np.log(e[1:]), 1)[0] for method, e in errors.items()}
    with capsys.disabled():
        print(f"\n  order of the root moment in the number of modes: {order}")
    assert -2.5 < order["displacement"] < -0.8
    assert order["acceleration"] < order["displacement"] - 3


def in_plane(modes, section, wanted):
    """A cantilever that bends in x-z only: supports hold the rest."""
    mesh = beam_mesh(60, LENGTH)
    model = mp.assemble(mesh, {"beam": section}, {"root": ROOT, "tip": TIP})
    reduction = mp.craig_bampton(model, modes=10_000, truncation=())
    bends = np.abs(reduction.basis[model.dof[-1, 2]]) > 1e-6 * np.abs(reduction.basis).max(axis=0)
    some = np.flatnonzero(bends)[:modes]
    own = reduction.with_(
        basis=reduction.basis[:, some], frequency=reduction.frequency[some], inertial=reduction.inertial[:, some]
    )
    return mp.flexible_body(
        model, own, name="beam", second_order_mass=False, recovery=mp.fe.model_recovery(model, mesh, wanted)
    )


def test_no_mode_is_dropped_from_a_complete_basis():
    mesh = beam_mesh(6, LENGTH)
    model = mp.assemble(mesh, {"beam": spinup_section()}, {"root": ROOT, "tip": TIP})
    complete = mp.craig_bampton(model, modes=10_000, truncation=())
    dropped = dropped_modes(complete)
    assert np.abs(dropped.to_loads).max() < 1e-9 * np.abs(complete.static).max()  # of the eigensolver
    assert np.abs(dropped.to_inertia).max() < 1e-9 * np.abs(complete.inertial).max()


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"x": {"kind": "resultant", "group": "beam"}}, "recovery 'x': there are no shells"),
        ({"x": {"kind": "force", "group": "beam"}}, "there are no springs"),
        ({"x": {"kind": "stress", "group": "beam"}}, "stress of beams is known in fibres"),
        ({"x": {"kind": "cut", "group": "beam"}}, "share no node with others"),
        ({"x": {"kind": "section_force", "stations": 1}}, "stations = 1 must be at least 2"),
        ({"x": {"kind": "section_force", "box": ((5.0, 5, 5), (6.0, 6, 6))}}, "no node lies at"),
        ({"x.y": {"kind": "reaction"}}, "cannot be the name of channels"),
        ({"x": {"kind": "section_force", "group": "bean"}}, "no group 'bean'"),
    ],
)
def test_what_is_not_there_is_refused(wanted, words):
    with pytest.raises(mp.InputError, match=words):
        cantilever(1, elements=2, **{name: Recover(**table) for name, table in wanted.items()})


def test_unknown_words_are_refused():
    with pytest.raises(mp.InputError, match="recovery: kind"):
        Recover(kind="section")
    with pytest.raises(mp.InputError, match="needs nodes or elements"):
        Recover(kind="acceleration")
