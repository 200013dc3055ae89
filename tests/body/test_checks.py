"""The checks of the modal body: each passes on a sound body and fails on one that is wrong in what it guards."""

import json

import numpy as np
import pytest
from body.solids import ALUMINIUM, SIZE, horn_mesh, horn_model
from structured import box

import modalprep as mp
from modalprep.body.checks import CheckReport, check_body, deflections
from modalprep.body.mass import mass_matrix
from modalprep.body.verify import check_buckling, check_projection
from modalprep.cli import main
from modalprep.examples import beam_mesh, cantilever_model, spinup_section, uniform_beam
from modalprep.multibody.reference.equations import body_equations


@pytest.fixture(scope="module")
def model():
    return horn_model()


@pytest.fixture(scope="module")
def reduction(model):
    return mp.craig_bampton(model, modes=6)


@pytest.fixture(scope="module")
def body(model, reduction):
    return mp.flexible_body(model, reduction, name="horn")


def failing(checks):
    return [check.name for check in checks if not check.passed]


def test_mass_matrix_is_that_of_the_equations_of_motion(body):
    q = 1e-3 * np.random.default_rng(0).standard_normal(body.n)
    M, _ = body_equations(body, np.zeros(6), q, np.zeros(body.n))
    np.testing.assert_allclose(mass_matrix(body, q), M, rtol=1e-12, atol=1e-14 * np.abs(M).max())


@pytest.mark.parametrize("kind", ["hexahedron20", "tetra10"])
def test_projection_of_solids(kind):
    model = horn_model(kind=kind, n=(3, 1, 1))
    reduction = mp.reduction.free_interface(model, modes=3)
    assert failing(check_projection(model, reduction, mp.flexible_body(model, reduction, name="horn"))) == []


@pytest.mark.parametrize(("root", "names"), [("left", ("left",)), ("side", ("left", "right", "side")),
                                             ("right", ("left", "right"))])  # fmt: skip
def test_projection_with_any_root_and_any_number_of_interfaces(root, names):
    model = horn_model(root, names)
    reduction = mp.craig_bampton(model, modes=4)
    body = mp.flexible_body(model, reduction, name="horn")
    assert body.interface_name == (root, *(name for name in names if name != root))
    assert body.at_root
    assert body.Kg_F.shape == (len(names), 3, body.n, body.n)
    assert failing([*check_body(body), *check_projection(model, reduction, body)]) == []


def test_projection_of_beams():
    model = cantilever_model(tip="fixed")
    reduction = mp.reduction.improved_guyan(model)
    assert failing(check_projection(model, reduction, mp.flexible_body(model, reduction, name="beam"))) == []


def test_projection_catches_every_wrong_array(model, reduction, body):
    assert failing(check_projection(model, reduction, body)) == []
    wrong = {
        "mass matrix of the model": {"s0": body.s0 * 1.0001},
        "momentum of the modes": {"S": body.S * 1.0001},
        "kinetic energy": {"P": body.P * 1.0001},
        "prestress": {"Kg_W": body.Kg_W * 1.0001},
    }
    for name, change in wrong.items():
        assert name in failing(check_projection(model, reduction, body.with_(**change))), name
    bent = reduction.with_(static=reduction.static * 1.0001)
    assert "static responses" in failing(check_projection(model, bent, body))
    for name in ("Kg_A", "Kg_F", "Kg_T"):
        changed = body.with_(**{name: getattr(body, name) * 1.0001})
        assert failing(check_projection(model, reduction, changed)) == ["prestress"], name


def test_round_off_of_a_load_without_stiffness_is_not_scaled_up():
    """A beam 1e-8 off the x axis: gravity along y has that share of the stiffness along x, and the same round-off.

    Before, each load was scaled to one: the round-off of 1e-12 became 1e-4.
    """
    line = beam_mesh(8)
    mesh = line.with_(points=line.points + np.outer(line.points[:, 0], [0, 1e-8, 0]))
    model = mp.assemble(mesh, {"beam": spinup_section()}, {"root": mp.Interface(group="root", kind="node")})
    reduction = mp.craig_bampton(model, modes=1, truncation=())
    body = mp.flexible_body(model, reduction, name="beam")
    largest = np.abs(body.Kg_A).max(axis=(1, 2))
    assert 1e-9 < largest[1] / largest[0] < 1e-7
    noise = np.random.default_rng(0).uniform(-1, 1, body.Kg_A.shape)
    rounded = body.with_(Kg_A=body.Kg_A + 1e-12 * largest[0] * (noise + noise.transpose(0, 2, 1)) / 2)
    assert failing(check_projection(model, reduction, rounded)) == []
    assert failing(check_projection(model, reduction, body.with_(Kg_A=body.Kg_A * [[[1.0]], [[-1.0]], [[1.0]]]))) == [
        "prestress"
    ]


def test_symmetric_solids_pass_with_few_modes():
    """32 hex20 cells and three modes, where most unit loads have no geometric stiffness but round-off."""
    mesh = horn_mesh((8, 2, 2), "hexahedron20").with_(points=box("hexahedron20", (8, 2, 2), SIZE)[0])
    model = mp.assemble(mesh, {"body": ALUMINIUM}, {"left": mp.Interface(group="left")})
    for modes in (1, 3, 10):
        reduction = mp.craig_bampton(model, modes=modes, truncation=())
        assert failing(check_projection(model, reduction, mp.flexible_body(model, reduction, name="horn"))) == []


def test_bent_mass_matrix_cannot_be_indefinite(body):
    """It is a Gram matrix; a mass tensor that no shapes have breaks it."""
    assert failing(check_body(body)) == []
    P = body.P.copy()
    P[0, 1], P[1, 0] = P[0, 1] + 30 * np.eye(body.n), P[1, 0] - 30 * np.eye(body.n)
    assert "mass matrix, bent" in failing(check_body(body.with_(P=P)))


def test_deflections_reach_the_stated_size(body):
    reach = np.linalg.norm(body.shape @ deflections(body).T, axis=1).max(axis=0)
    assert reach.max() == pytest.approx(np.ptp(body.points, axis=0).max())
    assert len(deflections(mp.rigid_body("r", mass=1, centre=np.zeros(3), inertia=np.eye(3),
                                         interfaces={"a": np.zeros(3)}))) == 0  # fmt: skip


@pytest.mark.parametrize("tip", ["free", "fixed"])
def test_buckling_of_the_euler_column(tip):
    """Held at its root only, whatever the reduction fixes."""
    model = cantilever_model(elements=40, tip=tip)
    bound, load = check_buckling(model, uniform_beam(modes=6))
    assert bound.passed
    # Euler: pi^2 EI / (4 L^2) = 345.43 N; shear flexibility lowers it by P / GA = 4e-5
    assert load.meaning.endswith("of the mesh 345.4 N")
    assert 0 < load.value < 1e-3  # three bending modes in the plane
    crude = check_buckling(model, uniform_beam(modes=1))[1]
    assert crude.value > load.value
    stiff = uniform_beam(modes=6)
    soft = stiff.with_(K=stiff.K / 2)
    assert failing(check_buckling(model, soft)) == ["buckling bound tip"]


def test_buckling_of_a_large_model_is_that_of_a_small_one():
    """Lanczos above 500 DOFs, LAPACK below."""
    found = [check_buckling(cantilever_model(elements=n), uniform_beam(modes=6))[1].meaning for n in (60, 120)]
    assert found[0] == found[1]


def test_report_fails_with_its_checks_and_is_json(body):
    sound = CheckReport(subject="horn", checks=tuple(check_body(body)))
    assert sound.passed
    wrong = CheckReport(subject="horn", checks=tuple(check_body(body.with_(K=-body.K))))
    assert not wrong.passed
    rows = json.loads(json.dumps(wrong.summary(), allow_nan=False))["checks"]
    assert {row["name"]: row["value"] for row in rows}["modal stiffness"] is None


def test_check_command(project, tmp_path, capsys):
    assert main(["check", str(project / "pipelines" / "spinup-beam.toml"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    names = [check["name"] for check in found["checks"]]
    assert found["passed"] is True
    assert {
        "rigid motions are free of strain",
        "modal mass",
        "kinetic energy",
        "prestress",
        "buckling load tip",
    } <= set(names)
    heavy = mp.write_body(uniform_beam(modes=2).with_(m=1e300, E0=1e300 * np.eye(3)), tmp_path / "heavy.h5")
    assert main(["check", str(heavy)]) == 1  # eigenvalues of numbers that overflow
    capsys.readouterr()
    file = mp.write_body(uniform_beam(modes=2).with_(m=11.0), tmp_path / "light.h5")
    assert main(["check", str(file)]) == 1
    assert "FAILED mass and inertia" in capsys.readouterr().out
    assert main(["check", str(file), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["passed"] is False


def test_check_of_a_pipeline_without_a_mesh_is_refused(tmp_path, capsys):
    file = tmp_path / "system.toml"
    joint = '[joints.hinge]\ntype = "revolute"\nparent = "ground"\nchild = "arm"\n'
    file.write_text(f'[bodies.arm]\nfile = "arm.h5"\n{joint}[simulation]\nt_end = 1.0\n')
    assert main(["check", str(file)]) == 2
    assert "has no [mesh] or [matrices]" in capsys.readouterr().err
