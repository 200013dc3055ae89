"""A family that is a weak form alone, as `docs/how-to/element.md` adds it: the bar of three nodes."""

from dataclasses import dataclass

import meshio
import numpy as np
import pytest
from structured import random_rotation

import modalprep as mp
from modalprep.fe.families import FAMILIES
from modalprep.fe.forms.basis import cell_basis
from modalprep.fe.forms.block import FormBlock
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term
from modalprep.fe.forms.truss import geometric_stiffness, stiffness, tension

STEEL = mp.Material(E=2e11, nu=0.3, rho=8000.0)
BAR = mp.Truss(material=STEEL, A=1e-4)
STUB = mp.fe.beam_section("rod", mp.Material(E=2e11, nu=0.3, rho=1.0), diameter=0.01, up=(0.3, 0.5, 0.4))


# --8<-- [start:bar]
@dataclass(frozen=True, eq=False)
class ThreeNodeBar(FormBlock):
    """Bars of three nodes: a displacement that is quadratic along a line, which may be curved."""

    components = 3
    section: mp.Truss
    nodes: np.ndarray
    x: np.ndarray

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin):
        return cls(section, nodes, points[nodes] - origin)

    def forms(self, dofmap):
        return ThreeNodeBarForms(self.section, self.nodes, dofmap)


@dataclass
class ThreeNodeBarForms:
    section: mp.Truss
    nodes: np.ndarray
    dofmap: object

    def motions(self):
        return [cell_basis("line3", self.nodes, self.dofmap, degree=4)]

    def stiffness(self):
        return [Term(stiffness, *self.motions(), {"EA": self.section.material.E * self.section.A})]

    def geometric_stiffness(self, d):
        [basis] = self.motions()
        return [Term(geometric_stiffness, basis, {"N": tension(basis, d, self.section)})]

    def masses(self):
        [basis] = self.motions()
        line = np.array(self.section.material.rho * self.section.A)
        return [Mass(basis, line, np.asarray(basis.global_coordinates()))]


# --8<-- [end:bar]


@pytest.fixture
def model(monkeypatch):
    """Assemble two bars on one line, with a family that only its weak forms make."""
    monkeypatch.setitem(FAMILIES[mp.Truss], "line3", ThreeNodeBar)

    def assembled(forms):
        points = np.column_stack([[*np.linspace(0, 2, 5), -1], np.zeros((6, 2))]) @ random_rotation(1).T
        cells = {"line3": np.array([[0, 2, 1], [2, 4, 3]]), "line": np.array([[5, 0]]), "vertex": np.array([[5]])}
        groups = {"bars": {"line3": np.arange(2)}, "stub": {"line": [0]}, "root": {"vertex": np.array([0])}}
        mesh = mp.fe.Mesh(points=points, cells=cells, groups=groups)
        held = {"root": mp.Interface(group="root", kind="node")}
        return mp.assemble(mesh, {"bars": BAR, "stub": STUB}, held, forms=forms)

    return assembled


@pytest.mark.parametrize("forms", ["compiled", "plain"])
def test_three_node_bar(model, forms):
    """Closed forms of the quadratic bar of length 1: EA/3 [[7, 1, -8], ..], rho A/30 [[4, -1, 2], ..], and N/L."""
    own = model(forms)
    axis = random_rotation(1)[:, 0]
    EA, line = STEEL.E * BAR.A, STEEL.rho * BAR.A
    one = np.array([[7.0, 1, -8], [1, 7, -8], [-8, -8, 16]]) / 3
    consistent = np.array([[4.0, -1, 2], [-1, 4, 2], [2, 2, 16]]) / 30
    dofs = own.dof[[2, 4, 3], :3]
    K = np.einsum("iajb,a,b->ij", own.K.toarray()[dofs[:, :, None, None], dofs], axis, axis)
    M = own.M.toarray()[dofs[:, 0][:, None], dofs[:, 0]]
    for found, wanted in ((K, EA * one), (M, line * consistent)):
        wanted[0, 0] *= 2  # the other bar ends there
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * wanted.max())
    assert own.groups.mass("bars") == pytest.approx(2 * line, rel=1e-12)
    pull = np.zeros(own.n_dof)
    pull[own.dof[:5, :3]] = np.outer(np.linspace(0, 2e-4, 5), axis)  # strain 1e-4
    across = np.zeros(own.n_dof)
    across[own.dof[:5, :3]] = np.outer(np.linspace(0, 2, 5), random_rotation(1)[:, 1])  # slope 1
    Kg = own.geometric_stiffness(pull, 0 * pull)
    assert across @ Kg @ across == pytest.approx(2 * EA * 1e-4, rel=1e-12)


@pytest.mark.parametrize("forms", ["compiled", "plain"])
def test_from_file_to_motion(forms, monkeypatch, tmp_path):
    """A bar on rails that falls against its wall: ``f = (2 k - 1) c / 4 L``, and twice the sag after ``2 L / c``."""
    monkeypatch.setitem(FAMILIES[mp.Truss], "line3", ThreeNodeBar)
    L, n, g = 2.0, 8, 9.81
    points = np.outer(np.linspace(0, L, 2 * n + 1), [1.0, 0, 0])
    cells = np.array([[0, 2, 1]]) + 2 * np.arange(n)[:, None]
    file = tmp_path / "bar.vtu"
    meshio.Mesh(points, {"line3": cells}, cell_data={"part": [np.ones(n, dtype=int)]}).write(file)
    supports = {
        "wall": mp.Support(near=(0, 0, 0), components="1"),
        "rails": mp.Support(group="part_1", components="23"),
    }
    root = {"root": mp.Interface(kind="support")}
    model = mp.assemble(mp.read_mesh(file), {"part_1": BAR}, root, supports=supports, forms=forms)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=5), name="bar")
    c = np.sqrt(STEEL.E / STEEL.rho)
    wanted = np.array([1, 3, 5]) * c / (4 * L)
    h = L / n / 2  # between nodes
    np.testing.assert_allclose(body.frequency[:3], wanted, rtol=(2 * np.pi * wanted[2] * h / c) ** 4 / 90)
    assert body.frequency[0] == pytest.approx(wanted[0], rel=(2 * np.pi * wanted[0] * h / c) ** 4 / 90)
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="bar.root")
    fall = mp.System(bodies={"bar": body}, joints=(wall,), gravity=np.array([g, 0, 0]))
    run = mp.simulate(fall, t_end=2 * L / c, output_step=L / c, rtol=1e-8)
    sag = (STEEL.rho * g) ** 2 * BAR.A * L**3 / (6 * STEEL.E)  # its energy
    assert run["energy.strain"][-1] == pytest.approx(4 * sag, rel=1e-3)  # modes six and on have 2e-5
