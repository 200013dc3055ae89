"""Elements of every family whose material has no density: they are stiff, and have no mass."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.fe.families import FAMILIES
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.properties.properties import Ply

NOTHING = mp.Material(E=2e11, nu=0.3, rho=0.0)
SECTIONS = {
    "beam": mp.Beam(material=NOTHING, A=1e-4, Iy=2e-9, Iz=1e-9, J=2e-9, offset=(0.01, 0.02)),
    "truss": mp.Truss(material=NOTHING, A=1e-4, J=1e-9),
    "shell": mp.Shell(material=NOTHING, thickness=0.01, offset=0.005),
    "laminate": mp.Shell(plies=(Ply(material=NOTHING, thickness=0.01), Ply(material=NOTHING, thickness=0.02))),
    "solid": mp.Solid(material=NOTHING),
}
CASES = [(name, kind) for name, section in SECTIONS.items() for kind in FAMILIES[type(section)]]


@pytest.mark.parametrize("mass", ["coupled", "lumped", "nastran"])
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_the_mass_is_that_of_the_points_alone(name, kind, mass):
    """The mass matrix has the point mass, and K is that of an element with mass."""
    unit = CELLS[kind].node_coordinates()
    points = np.pad(unit, ((0, 0), (0, 3 - unit.shape[1])))
    mesh = mp.fe.Mesh(
        points=points,
        cells={kind: np.arange(len(points))[None], "vertex": np.array([[1]])},
        groups={"part": {kind: np.array([0])}, "tip": {"vertex": np.array([0])}},
    )
    sections = {"part": SECTIONS[name], "tip": mp.PointMass(mass=3.0)}
    model = mp.assemble(mesh, sections, {"root": mp.Interface(group="part")}, mass=mass)
    expected = np.zeros(model.n_dof)
    expected[model.dof[1, :3]] = 3.0
    np.testing.assert_allclose(model.M.toarray(), np.diag(expected), atol=1e-15)
    assert model.rigid.m == pytest.approx(3.0, rel=1e-15)
    assert np.isfinite(model.K.data).all()


@pytest.mark.parametrize(
    "reduce", [mp.craig_bampton, mp.guyan, mp.reduction.free_interface, mp.reduction.improved_guyan]
)
def test_a_model_without_mass_has_no_body(reduce):
    mesh = mp.fe.Mesh(
        points=np.eye(3)[:2], cells={"line": np.array([[0, 1]])}, groups={"part": {"line": np.array([0])}}
    )
    model = mp.assemble(mesh, {"part": SECTIONS["beam"]}, {"root": mp.Interface(node=1, kind="node")})
    more = {"modes": 2} if reduce in (mp.craig_bampton, mp.reduction.free_interface) else {}
    with pytest.raises(mp.InputError, match="the model has no mass"):
        reduce(model, **more)
