"""Spin-up of a body of shells and solids: reduction against the whole mesh, block inside and outside of the body."""

import numpy as np
import pytest
from scipy.linalg import eigh
from systems.shipped import PIPELINES, run_shipped

from modalprep.multibody.analysis.spin import spin_modes
from modalprep.pipeline.building.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.systems import simulate_pipeline
from modalprep.reduction.clamped import clamp
from modalprep.vectors import skew

BODY, SPIN = "loaded-plate", np.array([0, -16.0, 0])
BLOCK = 300.0 * 0.2 * 0.2 * 0.1  # kg


@pytest.fixture(scope="module")
def spun(tmp_path_factory):
    return run_shipped("shell-and-solid", tmp_path_factory.mktemp("plate"))


@pytest.fixture(scope="module")
def mesh():
    """Stiffness, mass, gyroscopic matrix, load of the whole clamped mesh in steady spin; a corner's row; moved mass."""
    source = load(PIPELINES / "shell-and-solid.toml")
    model = assemble_pipeline(source.pipeline, read_pipeline_mesh(source))
    held, w = clamp(model), skew(SPIN)
    W, centrifugal = w @ w, -np.einsum("ab,nab->n", w @ w, model.h)
    rows = model.C[:, held.i]
    static = rows @ held.factor.solve(rows.T @ centrifugal)
    moving = sum(W[a, b] * model.M_ab[a, b] for a in range(3) for b in range(3) if W[a, b])
    arms = model.rotating_mass(np.concatenate([np.zeros(3), W.ravel()]))
    gyroscopic = 2 * sum(w[a, b] * model.M_ab[a, b] for a in range(3) for b in range(3) if w[a, b])
    stiffness = held.K_ii + rows.T @ (model.geometric_stiffness(static, centrifugal) + arms + moving) @ rows
    frame = next(frame for frame in model.interfaces if frame.name == "free_corner")
    corner = np.flatnonzero(np.linalg.norm(model.points - frame.position, axis=1) < 1e-9)[0]
    place = rows[[model.dof[corner, 2]]].toarray()[0]

    def moved(modes):
        """Mass of modes about the static deflection, with the second order of theory 4.7."""
        y, both = rows @ held.factor.solve(held.M_ii @ modes), np.column_stack([static, rows @ modes])
        A = -model.geometric_stiffness.project(y, model.M @ both[:, 1:], both)[:, 0, 1:]
        A += model.rotating_mass.project_modes(both, slice(1, None))[:, 0, 1:]
        M = modes.T @ (held.M_ii @ modes)
        return M + A + A.T + A.T @ np.linalg.solve(M, A)

    own = stiffness.toarray(), held.M_ii.toarray(), (rows.T @ gyroscopic @ rows).toarray(), rows.T @ centrifugal, place
    return *own, moved


def test_mass(spun):
    """Skin of 4 mm and the block."""
    body = spun.system.bodies[BODY]
    assert body.m == pytest.approx(2700 * 1.2 * 0.4 * 0.004 + BLOCK, rel=1e-12)


def test_steady_spin_is_that_of_the_whole_mesh(spun, mesh):
    """Twelve of 414 coordinates: where the body rests under the centrifugal field, and how it vibrates about it."""
    stiffness, mass, gyroscopic, load, place, moved = mesh
    body = spun.system.bodies[BODY]
    rest = place @ np.linalg.solve(stiffness, load)
    steady = spin_modes(body, SPIN)
    corner = list(body.interface_name).index("free_corner")
    found = body.phi[corner][2] @ steady.q0
    n = len(load)  # the drilling of shells has no mass
    modes = eigh(mass, (stiffness + stiffness.T) / 2, subset_by_index=(n - 100, n - 1))[1]
    gyroscopic = modes.T @ gyroscopic @ modes
    inverse = np.linalg.inv(moved(modes))  # the modes have unit stiffness
    state = np.block([[np.zeros((100, 100)), np.eye(100)], [-inverse, -inverse @ gyroscopic]])
    frequencies = np.sort(np.abs(np.linalg.eigvals(state).imag))[::2][:4] / (2 * np.pi)
    assert found == pytest.approx(rest, rel=5e-3)  # what the modes beyond the twelfth bend statically
    # faster than the first frequency: twelve modes have .3 % less of the square of the deflection than a hundred
    np.testing.assert_allclose(steady.frequency[:4], frequencies, rtol=4e-3)
    late = spun.runs[next(iter(spun.runs))]
    settled = late["loaded-plate.free_corner.deflection.z"][late.time > 6.5].mean()
    assert settled == pytest.approx(rest, rel=0.01)


def test_block_outside_of_the_body(spun, tmp_path):
    """The block's mass as a rigid body on the light block: its force in the joint stiffens as its inertia loads do."""
    text = (PIPELINES / "shell-and-solid.toml").read_text()
    corner = text[text.index("[interfaces.loaded_corner]") : text.index("[reduction]")]
    cross, upright = BLOCK * (0.2**2 + 0.1**2) / 12, BLOCK * 2 * 0.2**2 / 12
    for old, new in (
        ('"../meshes', f'"{PIPELINES.parent}/meshes'),
        ("rho = 300.0", "rho = 1e-3"),
        (corner, '[interfaces.block]\ngroup = "block"\nkind = "rbe3"\nboundary = "free"\n\n'),
        ('"loaded-plate.loaded_corner.deflection", ', ""),
        (', "loaded-plate.loaded_corner.deflection.z"', ""),
        ("compare_conventional = true\n", ""),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    cargo = f"[bodies.cargo]\nmass = {BLOCK}\ninertia = [{cross}, {cross}, {upright}]\n"
    weld = f'[joints.weld]\ntype = "weld"\nparent = "{BODY}.block"\nchild = "cargo"\n'
    path = tmp_path / "split.toml"
    path.write_text(text + cargo + weld)
    (apart,) = simulate_pipeline(path, tmp_path, Reporter(quiet=True)).runs.values()
    one = next(iter(spun.runs.values()))
    lag, expected = (run["loaded-plate.free_corner.deflection.z"] for run in (apart, one))
    np.testing.assert_allclose(lag, expected, atol=2e-3 * np.abs(expected).max())  # twelve modes of another body


def test_conventional_theory_diverges(spun):
    stiff, soft = spun.runs.values()
    assert (stiff.status, soft.status) == ("done", "diverged")
    assert stiff.stats["energy_error"] < 1e-7
    assert soft.time[-1] < 6
