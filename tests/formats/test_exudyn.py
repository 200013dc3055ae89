"""Exudyn file: each block against its own sum, against Exudyn's own reduction, and the same motions in Exudyn."""

import numpy as np
import pytest
from beam_series import spin_up_lag
from formats.exudyn_reduction import reduced_by_exudyn
from multibody.trees import random_body

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.formats.exudyn import inertia_blocks, surface_triangles, write_exudyn
from modalprep.vectors import skew

BLOCKS = (
    "Mtt totalMass chiU chiUtilde inertiaLocal mPhitTPsi mPhitTPsiTilde mXRefTildePsi mXRefTildePsiTilde "
    "mPsiTildePsi mPsiTildePsiTilde"
).split()


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=3)


# --- the blocks ---------------------------------------------------------------------------------------------------


def test_blocks_are_the_sums_over_particles():
    """Twelve particles with random masses, places and modes: integrals and blocks summed separately."""
    rng = np.random.default_rng(1)
    n, m, x, psi = 4, rng.uniform(1, 2, 12), rng.standard_normal((12, 3)), rng.standard_normal((12, 3, 4))
    body = random_body(rng, n).with_(
        m=m.sum(), s0=m @ x, E0=np.einsum("i,ia,ib->ab", m, x, x), S=np.einsum("i,iak->ak", m, psi),
        H=np.einsum("i,ib,iak->abk", m, x, psi), P=np.einsum("i,iaj,ibk->abjk", m, psi, psi),
    )  # fmt: skip
    M = np.kron(np.diag(m), np.eye(3))
    Phi, X, Psi = np.tile(np.eye(3), (12, 1)), skew(x).reshape(36, 3), psi.reshape(36, n)
    Psi_tilde = np.concatenate([skew(psi[:, :, k]).reshape(36, 3) for k in range(n)], axis=1)
    expected = {
        "Mtt": Phi.T @ M @ Phi, "totalMass": m.sum(), "chiU": m @ x / m.sum(), "chiUtilde": Phi.T @ M @ X / m.sum(),
        "inertiaLocal": X.T @ M @ X, "mPhitTPsi": Phi.T @ M @ Psi, "mPhitTPsiTilde": Phi.T @ M @ Psi_tilde,
        "mXRefTildePsi": X.T @ M @ Psi, "mXRefTildePsiTilde": X.T @ M @ Psi_tilde,
        "mPsiTildePsi": Psi_tilde.T @ M @ Psi, "mPsiTildePsiTilde": Psi_tilde.T @ M @ Psi_tilde,
    }  # fmt: skip
    found = inertia_blocks(body)
    assert set(found) == set(expected) == set(BLOCKS)
    for name, block in expected.items():
        np.testing.assert_allclose(found[name], block, atol=1e-12 * np.abs(block).max(), err_msg=name)


def test_file_equals_exudyns_own_reduction(bracket_model, bracket_body, tmp_path):
    """Exudyn reduces the bracket's mass matrix on the same modes: second implementation, consistent mass."""
    expected = reduced_by_exudyn(bracket_model, bracket_body).GetDictionary()
    with np.load(write_exudyn(bracket_body, tmp_path / "bracket.npz"), allow_pickle=True) as found:
        assert set(found) == {*expected, "fileVersion", "type", "interfaceNames", "interfaceNodes"}
        for name in (*BLOCKS, "massMatrixReduced", "stiffnessMatrixReduced"):
            # round-off of M and K summed over 16 thousand DOFs; modes are orthonormal to 1e-8
            np.testing.assert_allclose(
                found[name], expected[name], atol=1e-7 * np.abs(expected[name]).max(), err_msg=name
            )
        for name in ("modeBasis", "xRef"):
            assert np.array_equal(found[name][: 3 * len(bracket_model.points)], expected[name])
        assert found["postProcessingModes"].item() == {}


# --- nodes and surface --------------------------------------------------------------------------------------------


def test_nodes_around_an_interface_turn_with_it(bracket_body, tmp_path):
    """The mean of the six is the interface; a small turn of them is psi q."""
    with np.load(write_exudyn(bracket_body, tmp_path / "b.npz"), allow_pickle=True) as data:
        assert list(data["interfaceNames"]) == ["bolt_a", "bolt_b"]
        nodes = data["interfaceNodes"]
        x = data["xRef"].reshape(-1, 3)[nodes]
        move = data["modeBasis"].reshape(-1, 3, bracket_body.n)[nodes]
    np.testing.assert_allclose(x.mean(axis=1), bracket_body.interface_position, atol=1e-15)
    np.testing.assert_allclose(move.mean(axis=1), bracket_body.phi, atol=1e-12 * np.abs(move).max())
    arm = x - x.mean(axis=1, keepdims=True)
    spin = np.cross(arm[..., None], move, axisa=2, axisb=2, axisc=2).sum(axis=1)  # sum r x (psi x r) = 2/3 sum r^2 psi
    turned = spin * 1.5 / (arm**2).sum(axis=(1, 2))[:, None, None]
    np.testing.assert_allclose(turned, bracket_body.psi, atol=1e-11 * np.abs(bracket_body.psi).max())


def test_skin_of_the_bracket_encloses_its_volume(bracket_body):
    """Divergence theorem over the triangles through the corners; the drawing's volume, docs/reference/meshes.md."""
    triangles = surface_triangles({"tetra10": bracket_body.cells["tetra10"]})
    volume = np.linalg.det(bracket_body.points[triangles]).sum() / 6
    assert volume == pytest.approx(27808.46e-9, rel=5e-3)  # straight sides cut the holes and the round ends
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}  # closed


@pytest.mark.parametrize(
    ("kind", "nodes", "triangles"),
    [("tetra10", 10, 4), ("pyramid", 5, 6), ("wedge15", 15, 8), ("hexahedron", 8, 12), ("quad9", 9, 2),
     ("triangle", 3, 1), ("line", 2, 0)],
)  # fmt: skip
def test_faces_of_one_cell(kind, nodes, triangles):
    assert surface_triangles({kind: np.arange(nodes)[None]}).shape == (triangles, 3)


# --- the same motion in Exudyn ------------------------------------------------------------------------------------


class Run:
    """A body read by Exudyn from our file, free or hinged at its root about z, integrated by generalized-alpha."""

    def __init__(self, file, **start):
        self.exu, fem = pytest.importorskip("exudyn"), pytest.importorskip("exudyn.FEM")
        self.items = pytest.importorskip("exudyn.itemInterface")
        self.container = self.exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.body = fem.ObjectFFRFreducedOrderInterface()
        self.body.LoadFromFile(str(file), mode="NPZ")
        self.added = self.body.AddObjectFFRFreducedOrder(self.system, **start)
        self.frame = self.system.AddMarker(self.items.MarkerNodeRigid(nodeNumber=self.added["nRigidBody"]))
        with np.load(file, allow_pickle=True) as data:
            six = data["interfaceNodes"][-1]
        rigid = self.items.MarkerSuperElementRigid(
            bodyNumber=self.added["oFFRFreducedOrder"], meshNodeNumbers=six, weightingFactors=[1 / 6] * 6
        )
        self.last = self.system.AddMarker(rigid)

    def hinge(self, angle=None):
        ground = self.system.AddObject(self.items.ObjectGround())
        marker = self.system.AddMarker(self.items.MarkerBodyRigid(bodyNumber=ground))
        driven = {"offsetUserFunction": lambda mbs, t, item, p: [0, 0, 0, 0, 0, angle(t)]} if angle else {}
        axes = [1, 1, 1, 1, 1, 1 if angle else 0]
        joint = self.items.ObjectJointGeneric(markerNumbers=[marker, self.frame], constrainedAxes=axes, **driven)
        self.system.AddObject(joint)

    def torque_of_gravity_on_the_deflection(self, gravity):
        """``(A S q) x g``, which Exudyn's gravity load leaves out (it turns the undeformed centre of mass)."""
        output, kind = self.system.GetNodeOutput, self.exu.OutputVariableType

        def torque(mbs, t, load):
            A = np.reshape(output(self.added["nRigidBody"], kind.RotationMatrix), (3, 3))
            q = np.atleast_1d(output(self.added["nGenericODE2"], kind.Coordinates))
            return np.cross(A @ self.body.mPhitTPsi @ q, gravity)

        load = self.items.LoadTorqueVector(markerNumber=self.frame, loadVector=[0, 0, 0], loadVectorUserFunction=torque)
        self.system.AddLoad(load)

    def histories(self, t_end, step, period):
        """Modal coordinates (nt, n), rotation matrices (nt, 9), and the last interface's position and rotation."""
        kind, node, marker = self.exu.OutputVariableType, self.items.SensorNode, self.items.SensorMarker
        wanted = [
            node(nodeNumber=self.added["nGenericODE2"], outputVariableType=kind.Coordinates),
            node(nodeNumber=self.added["nRigidBody"], outputVariableType=kind.RotationMatrix),
            marker(markerNumber=self.last, outputVariableType=kind.Position),
            marker(markerNumber=self.last, outputVariableType=kind.RotationMatrix),
        ]
        sensors = [self.system.AddSensor(sensor) for sensor in wanted]
        for sensor in sensors:
            self.system.SetSensorParameter(sensor, "storeInternal", True)
        self.system.Assemble()
        settings = self.exu.SimulationSettings()
        settings.timeIntegration.endTime = t_end
        settings.timeIntegration.numberOfSteps = round(t_end / step)
        settings.timeIntegration.newton.relativeTolerance = 1e-10
        settings.timeIntegration.newton.absoluteTolerance = 1e-12
        settings.solution.sensors.writePeriod = period
        settings.solution.file.write = False
        self.system.SolveDynamic(settings, solverType=self.exu.DynamicSolverType.GeneralizedAlpha)
        return [self.system.GetSensorStoredData(s)[:, 1:] for s in sensors]


def converged(make, t_end, step, period):
    """Exudyn's histories at a step and at half of it, extrapolated in the step squared (its method is of order 2)."""
    coarse, fine = (make().histories(t_end, h, period) for h in (step, step / 2))
    return fine, [(4 * b - a) / 3 for a, b in zip(coarse, fine, strict=True)]


def compare(expected, fine, extrapolated, step_error, tolerance):
    """The difference is the step error of Exudyn and nothing else: extrapolation removes it."""
    size = np.abs(expected).max()
    assert np.abs(fine - expected).max() < step_error * size
    assert np.abs(extrapolated - expected).max() < tolerance * size


@pytest.fixture(scope="module")
def beam_file(beam, tmp_path_factory):
    return write_exudyn(beam, tmp_path_factory.mktemp("exudyn") / "beam.npz")


def ours(body, t_end, gravity=(0, 0, 0), period=0.1, **joint):
    hinge = mp.Joint(**({"name": "hinge", "type": "revolute", "parent": "ground", "child": "arm"} | joint))
    system = mp.System(bodies={"arm": body}, joints=(hinge,), gravity=np.array(gravity, dtype=float))
    return mp.simulate(system, t_end=t_end, output_step=period, rtol=1e-10, atol=1e-12)


def test_pendulum(beam, beam_file):
    """A soft beam hinged at its root falls from the horizontal for 2 s, through 133 degrees."""
    gravity = [0, -9.81, 0]

    def make():
        run = Run(beam_file, gravity=gravity)
        run.hinge()
        run.torque_of_gravity_on_the_deflection(gravity)
        return run

    run = ours(beam.conventional(), 2.0, gravity)
    fine, best = converged(make, 2.0, 1e-3, 0.1)
    # the highest mode of the hinged beam has 80 rad/s: a phase error of w^3 h^2 t / 12 = 2e-2 of its small share;
    # the method's damping is of order h^3 and stays after extrapolation
    compare(run["arm.modal"], fine[0], best[0], 5e-3, 1e-4)
    turned = np.unwrap(np.arctan2(best[1][:, 3], best[1][:, 0]))
    np.testing.assert_allclose(turned, run["hinge.angle"], atol=1e-5)


def spinup(fraction):
    return mp.multibody.TimeFunction([(15, f"{fraction}*0.4*(t**2/2 + (7.5/pi)**2*(cos(pi*t/7.5) - 1))"),
                      (float("inf"), f"{fraction}*(6*t - 45)")])  # fmt: skip


@pytest.mark.parametrize(("fraction", "t_end"), [(1 / 3, 18.0), (1, 7.5)])
def test_spin_up_is_the_conventional_theory(beam, beam_file, fraction, t_end):
    """Spin-up of Simo and Vu-Quoc, also to a third of the speed, which the conventional theory survives."""
    motion = spinup(fraction)

    def make():
        run = Run(beam_file)
        run.hinge(lambda t: motion(t)[0])
        return run

    run = ours(beam.conventional(), t_end, motion=motion)
    fine, best = converged(make, t_end, 2e-2, 0.1)
    # relative step error w^2 h^2 / 12 = 1e-4 for the first mode, more where it grows exponentially
    compare(run["arm.modal"], fine[0], best[0], 5e-4, 2e-6)


def test_what_exudyn_loses_is_the_stiffening(beam):
    """Tip lag after 7.5 s of spin-up: 1.46 m and growing in the conventional theory, 0.56 m on its way back in ours."""
    motion = spinup(1)
    lag = {body.has_geometric_stiffness: ours(body, 7.5, motion=motion)["arm.tip.deflection.y"][-1]
           for body in (beam, beam.conventional())}  # fmt: skip
    linear = {stiffened: spin_up_lag(np.array([7.5]), stiffened=stiffened)[0] for stiffened in lag}
    assert lag[False] == pytest.approx(linear[False], rel=1e-3)
    assert lag[True] == pytest.approx(linear[True], rel=1e-2)  # three modes


def test_tumbling_solid(bracket_body, tmp_path):
    """A free, soft, lopsided solid turns about no principal axis: every block of the file takes part."""
    pytest.importorskip("exudyn")
    soft = 1e-8 * bracket_body.K  # as with a hundred-millionth of Young's modulus
    body = bracket_body.with_(K=soft, D=0 * soft, frequency=np.sqrt(soft) / (2 * np.pi)).conventional()
    file = write_exudyn(body, tmp_path / "soft.npz")
    spin = [0.3, -0.4, 0.5]
    run = ours(body, 1.0, type="free", angular_velocity=np.array(spin))
    fine, best = converged(lambda: Run(file, initialAngularVelocity=spin), 1.0, 1e-3, 0.1)
    size = np.ptp(body.points, axis=0).max()
    assert np.abs(run["arm.bolt_b.deflection"]).max() > 0.05 * size  # far from rigid: 7.6 mm of 104 mm
    compare(run["arm.modal"], fine[0], best[0], 1e-4, 5e-6)
    np.testing.assert_allclose(best[2], run["arm.bolt_b.position"], atol=1e-7 * size)
    frame, marker = (R.reshape(-1, 3, 3) for R in (best[1], best[3]))
    angle = run["arm.modal"] @ body.psi[1].T
    turned = np.swapaxes(frame, 1, 2) @ marker - np.eye(3)
    np.testing.assert_allclose(turned, skew(angle), atol=np.abs(angle).max() ** 2)  # a finite turn against a small one
    assert np.abs(angle).max() > 0.1


# --- refusals -----------------------------------------------------------------------------------------------------


def test_refusals(beam, tmp_path):
    rigid = mp.rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    with pytest.raises(mp.InputError, match="body 'rod' has no modes to write for Exudyn; make it"):
        write_exudyn(rigid, tmp_path / "rod.npz")
    with pytest.raises(mp.InputError, match=r"beam\.dat: a body of Exudyn ends in \.npz"):
        write_exudyn(beam, tmp_path / "beam.dat")
    with pytest.raises(mp.InputError, match="cannot write"):
        write_exudyn(beam, "/proc/no/beam.npz")
    assert list(tmp_path.iterdir()) == []
