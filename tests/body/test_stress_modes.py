"""Stress of a modal body: in other bases and frames, in its file, at rest and in motion."""

import h5py
import numpy as np
import pytest
from body.solids import horn_mesh, horn_model

import modalprep as mp
from modalprep.body.difference import compare_bodies
from modalprep.examples import beam_mesh
from modalprep.multibody.deploying.simulate import deployment_channels
from modalprep.multibody.free_body.flight import simulate_free_system
from modalprep.multibody.preparation import channel_names
from modalprep.reduction.projected import projected_basis

STEEL = mp.Material(E=2e11, nu=0.3, rho=7800.0)
LENGTH, B, H = 2.0, 0.03, 0.02
AREA, W = B * H, B * H**2 / 6  # against bending towards e3
G = 9.81


def beam(modes=6, elements=20, truncation=("inertia",), loads=None):
    """A rectangular cantilever along x, its stress at root and middle: fibre 1 is a corner up, 6 the upper middle."""
    mesh = beam_mesh(elements, LENGTH)
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(mesh, {"beam": mp.fe.beam_section("rectangle", STEEL, width=B, height=H)}, ends)
    load = {name: mp.reduction.nodal_load(model, mesh, name, each) for name, each in (loads or {}).items()}
    reduction = mp.craig_bampton(model, modes=modes, truncation=truncation, loads=load)
    points = {"root": mp.fe.StressPoint(group="root"), "middle": mp.fe.StressPoint(near=(LENGTH / 2, 0, 0))}
    return mp.flexible_body(model, reduction, name="beam", stress=mp.fe.stress_recovery(model, mesh, points))


@pytest.fixture(scope="module")
def horn():
    """All modes of a small solid, with the stress at every node, and its model."""
    model, mesh = horn_model(), horn_mesh()
    recovery = mp.fe.stress_recovery(model, mesh, {"all": mp.fe.StressPoint(group="body")})
    reduction = mp.craig_bampton(model, modes=10_000, truncation=())
    return model, recovery, mp.flexible_body(model, reduction, name="horn", stress=recovery)


@pytest.fixture
def file(horn, tmp_path):
    return mp.write_body(horn[2], tmp_path / "horn.h5")


def answer(body, interface, force):
    """Static modal coordinates under a force on an interface."""
    return np.asarray(force) @ body.phi[body.interface_name.index(interface)] / body.K


def stacked(found):
    return np.concatenate([np.atleast_1d(found[name]) for name in sorted(found)])


# --- what it is -------------------------------------------------------------------------------------------------------


def test_all_modes_have_the_static_stress_of_the_full_model(horn):
    """Force on an interface: the modal sum is the recovery of the finite-element solution."""
    model, recovery, body = horn
    force = np.array([30.0, -50.0, 20.0])
    load = mp.reduction.interface_load(model, "right", force=tuple(force))
    held = model.interfaces[0].dofs
    K = (model.C.T @ model.K @ model.C).toarray()
    keep = np.setdiff1d(np.arange(len(K)), np.searchsorted(model.free, held))
    x = np.zeros(len(K))
    x[keep] = np.linalg.solve(K[np.ix_(keep, keep)], (model.C.T @ load)[keep])
    full = recovery((model.C @ x)[:, None])
    found = body.stresses(answer(body, "right", force))
    assert len(full) == len(model.points)
    for name, at in full.items():
        for component, value in zip(at.components, at.modes[:, 0], strict=True):
            # 1e-16 of the stiffest mode's stress, which rigid interfaces make large
            assert found[f"{name}.{component}"] == pytest.approx(value, rel=1e-8, abs=1e-8 * np.abs(at.modes).max())


def test_von_mises_is_the_second_invariant(horn):
    """``sqrt(3/2 s : s)`` of the deviator s, for histories of any shape."""
    body = horn[2]
    q = np.random.default_rng(0).standard_normal((2, 3, body.n))
    point = body.stress["all.5"]
    found = point.histories(q)
    for place in np.ndindex(2, 3):
        xx, yy, zz, xy, yz, xz = point.modes @ q[place]
        s = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        s -= np.trace(s) / 3 * np.eye(3)
        assert found["von_mises"][place] == pytest.approx(np.sqrt(1.5 * np.sum(s * s)), rel=1e-12)
        assert found["yz"][place] == pytest.approx(yz)


def test_modes_without_strain_have_no_stress():
    """A bar on a universal joint: the modes in which it swings have exactly none, not round-off."""
    mesh = mp.fe.Mesh(
        points=np.array([[0.0, 0, 0], [0.5, 0, 0], [1, 0, 0]]),
        cells={"line": np.array([[0, 1], [1, 2]]), "vertex": np.array([[0], [2]])},
        groups={"hinge": {"line": np.array([0])}, "arm": {"line": np.array([1])}}
        | {name: {"vertex": np.array([k])} for k, name in enumerate(("root", "tip"))},
    )
    hinge = mp.Spring(translation=(1e8, 1e8, 1e8), rotation=(1e6, 0, 0), location=0.0)
    parts = {"hinge": hinge, "arm": mp.fe.beam_section("rod", STEEL, diameter=0.05)}
    model = mp.assemble(mesh, parts, {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")})
    recovery = mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=2)})
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=2, truncation=()), name="arm", stress=recovery)
    loose = body.frequency == 0
    assert loose.sum() == 2
    assert not any(at.modes[:, loose].any() for at in body.stress.values())
    assert all(at.modes[:, ~loose].any() for at in body.stress.values())


# --- other bases and frames -------------------------------------------------------------------------------------------


def test_the_stress_of_a_state_does_not_depend_on_its_description(horn):
    """Equal and opposite forces on two interfaces: rooted at either, in mean axes, in fewer modes: the same stress."""
    body, force = horn[2], np.array([100.0, 40.0, -30.0])

    def squeezed(b):
        arm = (
            b.interface_position[b.interface_name.index("right")] - b.interface_position[b.interface_name.index("left")]
        )
        moment = -np.cross(arm, force)  # keeps the pair in balance
        u = [b.interface_name.index(name) for name in ("left", "right")]
        Q = force @ (b.phi[u[1]] - b.phi[u[0]]) + moment @ b.psi[u[1]]
        return stacked(b.stresses(np.divide(Q, b.K, out=np.zeros(b.n), where=b.K > 1e-6 * b.K.max())))

    expected = squeezed(body)
    answers = np.concatenate([body.phi[1:].reshape(-1, body.n), body.psi[1:].reshape(-1, body.n)]).T / body.K[:, None]
    others = {
        "rooted elsewhere": mp.body.reroot(body, "right"),
        "mean axes": mp.body.in_mean_axes(body),
        "centre of mass": mp.body.at_centre_of_mass(body),
        "its static responses": mp.reduction.reduced_body(
            body, projected_basis(answers, np.diag(body.K), np.eye(body.n), tolerance=0)
        ),
        "frozen at rest": mp.body.linearised_geometric_stiffness(body, np.zeros(3)),
    }
    for name, other in others.items():
        np.testing.assert_allclose(squeezed(other), expected, rtol=0, atol=1e-6 * np.abs(expected).max(), err_msg=name)


def test_axes_and_places_turn_with_the_frame(horn):
    """The tensor in B turns, its components in the point's own axes stay."""
    body, rng = horn[2], np.random.default_rng(2)
    Q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    Q *= np.linalg.det(Q)
    moved = mp.body.in_frame(body, origin=np.array([0.1, -0.2, 0.3]), axes=Q)
    before, after = body.stress["all.3"], moved.stress["all.3"]
    assert np.array_equal(before.modes, after.modes)
    np.testing.assert_allclose(after.axes, before.axes @ Q, atol=1e-15)
    np.testing.assert_allclose(after.position, moved.points[2], atol=1e-15)


def test_stress_belongs_to_the_modes(horn):
    body = horn[2]
    for same in (body.with_(D=0 * body.D), body.conventional(), mp.body.with_density_factor(body, 2.0)):
        assert np.array_equal(same.stress["all.1"].modes, body.stress["all.1"].modes)
    assert body.with_(K=2 * body.K).stress == {}


def test_differences_of_stress_are_found(horn):
    body = horn[2]
    signs = np.random.default_rng(0).choice([-1.0, 1.0], body.n)
    flipped = mp.reduction.reduced_body(body, projected_basis(np.diag(signs), np.diag(body.K), np.eye(body.n)))
    assert all(check.passed for check in compare_bodies(body, flipped))
    some = {name: body.stress[name] for name in ("all.1", "all.2")}
    wrong = {
        "all.1": body.stress["all.1"].with_(modes=1.001 * body.stress["all.1"].modes),
        "else": body.stress["all.2"],
    }
    less = {"all.1": body.stress["all.1"].with_(components=("xx",), modes=body.stress["all.1"].modes[:1])}
    for other, failed in (({}, []), (some, []), (wrong, ["stress"]), (less, ["stress"])):
        checks = compare_bodies(body, body.with_(stress=other))
        assert [check.name for check in checks if not check.passed] == failed


# --- the file ---------------------------------------------------------------------------------------------------------


def test_file_keeps_the_stress(file, horn):
    back = mp.read_body(file)
    assert back.stress.keys() == horn[2].stress.keys()
    for name, at in horn[2].stress.items():
        assert back.stress[name].components == at.components
        assert all(np.array_equal(getattr(back.stress[name], k), getattr(at, k)) for k in ("position", "axes", "modes"))


def test_file_without_stress_is_read(file):
    with h5py.File(file, "a") as h5:
        del h5["stress"], h5.attrs["checksum"]
        h5.attrs["format_version"] = 1  # which had no checksum
    back = mp.read_body(file)
    assert back.stress == {}
    assert mp.read_body(mp.write_body(back, file)).stress == {}


def other_values(values):
    def change(h5):
        said = dict(h5["stress/all.1"].attrs)
        new = values(h5["stress/all.1"][()])
        del h5["stress/all.1"]
        h5["stress/all.1"] = new
        h5["stress/all.1"].attrs.update(said)

    return change


def other_words(key, value):
    return lambda h5: h5["stress/all.1"].attrs.update({key: value})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (other_values(lambda x: x[:, 1:]), "stress/all.1 has shape"),
        (other_values(lambda x: np.full_like(x, np.nan)), "stress/all.1 holds values that are not numbers"),
        (other_values(lambda x: x.astype("S8")), "stress/all.1 does not hold real numbers"),
        (other_words("components", ["xx", "yy", "zz", "xy", "yz", "w"]), "stress/all.1 has components"),
        (other_words("components", ["xx"] * 6), "stress/all.1 has components"),
        (other_words("components", 3.0), "damaged"),
        (other_words("axes", np.ones((3, 3))), "are not orthogonal unit vectors"),
        (other_words("axes", np.full((3, 3), np.nan)), "are not orthogonal unit vectors"),
        (other_words("axes", np.eye(2)), "no position or no axes"),
        (other_words("position", [0.0, np.inf, 0]), "no position or no axes"),
        (lambda h5: h5["stress/all.1"].attrs.pop("axes"), "damaged"),
        (lambda h5: h5.create_group("stress/more"), "damaged"),
    ],
)
def test_damaged_stress_is_refused(file, change, words):
    with h5py.File(file, "a") as h5:
        change(h5)
    with pytest.raises(mp.InputError, match=rf"{words}.*write it again"):
        mp.read_body(file)


# --- at rest and in motion --------------------------------------------------------------------------------------------


def wall(body, **options):
    joint = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    return mp.System(bodies={"beam": body}, joints=(joint,), **options)


def test_weight_of_a_cantilever_at_rest():
    """``M = rho A g x^2 / 2`` over W at root and middle, less ``rho A g l^2 / 12`` of elements of length l.

    Loads that are spread over an element enter its bending by the nodes only.
    """
    body, n = beam(), 20
    q = mp.static_equilibrium(wall(body, gravity=np.array([0, 0, -G]))).modal["beam"]
    found = body.stresses(q)
    weight, own = STEEL.rho * AREA * G, STEEL.rho * AREA * G * (LENGTH / n) ** 2 / 12
    for name, x in (("root", LENGTH), ("middle", LENGTH / 2)):
        exact = (weight * x**2 / 2 - own) / W
        for fibre, sign in ((1, 1), (2, 1), (3, -1), (4, -1), (6, 1), (8, -1)):
            # the tip turns by 0.015: arms are shorter by half its square, 1.2e-4, and the weight pulls by 9e-5
            assert found[f"{name}.{fibre}.xx"] == pytest.approx(sign * exact, rel=2.2e-4)
        assert found[f"{name}.1.von_mises"] == pytest.approx(exact, rel=1e-4)
        assert abs(found[f"{name}.5.xx"]) < 1e-3 * exact


def test_steady_spin_pulls_a_rod():
    """``rho w^2 (L^2 - x^2) / 2`` in all fibres of a beam that turns about z; elements have their mean."""
    body, w, n = beam(), 3.0, 20  # the stretch adds 6e-7, (w / w_axial)^2
    hub = mp.Joint(
        name="hub", type="revolute", parent="ground", child="beam", motion=mp.multibody.TimeFunction(f"{w}*t")
    )
    system = mp.System(bodies={"beam": body}, joints=(hub,))
    found = body.stresses(mp.static_equilibrium(system, steady=True).modal["beam"])
    middle = STEEL.rho * w**2 / 2 * (LENGTH**2 - (LENGTH / 2) ** 2 - (LENGTH / n) ** 2 / 3)
    first = STEEL.rho * w**2 / 2 * (LENGTH**2 - (LENGTH / n) ** 2 / 3)
    for fibre in range(1, 9):
        assert found[f"middle.{fibre}.xx"] == pytest.approx(middle, rel=1e-6)
        assert found[f"root.{fibre}.xx"] == pytest.approx(first, rel=1e-6)


def test_sudden_load_doubles_the_static_stress():
    """One coordinate, the static response to a tip force: ``sigma = F L / W (1 - cos w t)`` at the root."""
    force = 0.05
    push = mp.reduction.Load(group="tip", force=(0, 0, 1.0))
    body = beam(modes=0, truncation=("push",), loads={"push": push}).ruthless()
    assert body.n == 1
    load = mp.PointForce(name="push", at="beam.tip", force=np.array([0, 0, force]))
    period = 1 / body.frequency[0]
    run = mp.simulate(wall(body, loads=(load,)), t_end=period, output_step=period / 40, rtol=1e-9, atol=1e-12)
    static_stress = force * LENGTH / W
    for name, share in (("root", 1.0), ("middle", 0.5)):
        exact = -share * static_stress * (1 - np.cos(2 * np.pi * run.time / period))
        np.testing.assert_allclose(run[f"beam.stress.{name}.6.xx"], exact, atol=1e-6 * static_stress)
    np.testing.assert_allclose(run["beam.stress.root.6.von_mises"], np.abs(run["beam.stress.root.6.xx"]))
    assert run["beam.stress.root.6.von_mises"].max() == pytest.approx(2 * static_stress, rel=1e-6)
    assert set(channel_names(wall(body, loads=(load,)), 1.0)) == set(run)


def test_a_run_ends_where_the_stress_is_too_high():
    """Under a sudden load a single mode has its static stress after a quarter of its period: an event."""
    force = 0.05
    body = beam(
        modes=0, truncation=("push",), loads={"push": mp.reduction.Load(group="tip", force=(0, 0, 1.0))}
    ).ruthless()
    load = mp.PointForce(name="push", at="beam.tip", force=np.array([0, 0, force]))
    when = f"beam.stress.root.6.von_mises - {force * LENGTH / W!r}"
    period = 1 / body.frequency[0]
    event = mp.Event(name="crack", when=when, terminal=True)
    run = mp.simulate(wall(body, loads=(load,)), t_end=period, output_step=period / 10, rtol=1e-10, events=(event,))
    assert run.time[-1] == pytest.approx(period / 4, rel=1e-6)
    assert run["beam.stress.root.6.xx"][-1] == pytest.approx(-force * LENGTH / W, rel=1e-6)
    for wrong in ("beam.stress.root.9.xx", "beam.stress.root.6.zz", "beam.stress.xx"):
        with pytest.raises(mp.InputError, match=rf"no channel '{wrong}'; give .*\.stress\.<point>\.<component>"):
            mp.simulate(wall(body), t_end=1.0, events=(mp.Event(name="crack", when=f"{wrong} - 1"),))


def test_every_simulation_has_the_channels():
    """A free flight in momenta and a deployment at the tip: stress by the modal coordinates of the same row."""
    body = beam(modes=2)
    spin = mp.Joint(name="flight", type="free", parent="ground", child="beam", angular_velocity=np.array([0, 0.5, 1.0]))
    fixed = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    tip = mp.Joint(name="tip", type="weld", parent="beam.tip", child="hub")
    places = {"root": np.zeros(3), "exit": np.array([0.1, 0, 0])}
    hub = mp.rigid_body("hub", mass=0.1, centre=np.zeros(3), inertia=1e-4 * np.eye(3), interfaces=places)
    boom = mp.multibody.Deployment(
        name="boom", parent="hub.exit", length=0.5, segments=2, mass_per_length=0.1, EI=100.0, deployed_length="0.1 + t"
    )
    deploying = mp.multibody.DeployingSystem(
        bodies={"beam": body, "hub": hub}, joints=(fixed, tip), deployments=(boom,), gravity=np.array([0, 0, -G])
    )
    runs = [
        simulate_free_system(mp.System(bodies={"beam": body}, joints=(spin,)), t_end=0.02),
        mp.multibody.simulate_deployment(deploying, t_end=0.02),
    ]
    expected = {f"beam.stress.{name}" for name in body.stresses(np.zeros(body.n))}
    at = body.stress["root.1"]
    assert expected < deployment_channels(deploying).channels.keys()
    for run in runs:
        assert np.ptp(run["beam.modal"]) > 0
        assert {name for name in run.channels if ".stress." in name} == expected
        np.testing.assert_allclose(run["beam.stress.root.1.xx"], run["beam.modal"] @ at.modes[0])


def test_stress_answers_to_a_load_in_state_space():
    """At zero frequency the transfer from a tip force to the root's stress is ``-L / W``, to the middle half."""
    body = beam(modes=0, truncation=("interfaces",)).conventional()
    outputs = ["beam.stress.root.6.xx", "beam.stress.middle.6.xx"]
    linear = mp.linearise(wall(body), inputs=["beam.tip.force.z"], outputs=outputs)
    static = linear.D - linear.C @ np.linalg.solve(linear.A, linear.B)
    np.testing.assert_allclose(static[:, 0], [-LENGTH / W, -LENGTH / 2 / W], rtol=1e-8)
    for wrong in ("beam.stress.root.6.zz", "beam.stress.root.6.von_mises", "beam.stress.rot.6.xx"):
        with pytest.raises(mp.InputError, match="did you mean .* the linear stresses of beam are"):
            mp.linearise(wall(body), outputs=[wrong])


def test_bodies_without_points_have_no_channels():
    run = mp.simulate(wall(beam(modes=2).with_(stress={})), t_end=0.01)
    assert not [name for name in run.channels if ".stress" in name]
