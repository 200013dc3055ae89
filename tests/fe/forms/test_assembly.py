"""Models, bodies and runs by weak forms and by compiled loops: every family in one structure."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import skfem
from size import FULL
from structured import random_rotation, surface

import modalprep as mp
from modalprep.fe.assembly.bases import structure_of
from modalprep.fe.assembly.forms import FORMS
from modalprep.pipeline.building.model import assemble_pipeline
from modalprep.pipeline.schema.load import load_pipeline

SAME = 1e-11  # of the largest entry: rounding
STEEL = mp.Material(E=2e11, nu=0.3, rho=8000.0)
CARBON = mp.fe.Orthotropic(E1=130e9, E2=9e9, nu12=0.3, G12=5e9, G13=5e9, G23=3e9, rho=1600.0)
BAR = mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.03, up=(0, 0, 1), offset=(0.0, -0.02))
PLIES = tuple(mp.fe.Ply(material=CARBON, thickness=0.002, angle=angle) for angle in (0.0, 1.0))


def mesh():
    """A warped plate of quads and triangles on a brick and a tetrahedron, with a rib, a strut, a mass and a spring."""
    points, quads = surface(3, 3, "quad", lambda s, t: (s, t, 0.05 * s * t), distort=0.1)
    below = points[quads[0]] - (0, 0, 0.4)
    points = np.vstack([points, below, [[0.2, 0.1, -0.9], [1.3, 1.2, 0.3]]])
    n = len(points)
    cells = {
        "quad": quads[:8],
        "triangle": quads[8][[[0, 1, 2], [0, 2, 3]]],
        "line": np.array([[0, 4], [4, 8], [8, 12], [15, n - 1], [12, n - 1]]),
        "hexahedron": np.array([[*range(n - 6, n - 2), *quads[0]]]),
        "tetra": np.array([[n - 6, n - 4, n - 5, n - 2]]),
        "vertex": np.array([[12], [n - 1], [n - 2], [3]]),
    }
    groups = {
        "skin": {"quad": np.arange(8)},
        "corner": {"triangle": np.arange(2)},
        "rib": {"line": np.arange(3)},
        "strut": {"line": np.array([3])},
        "hinge": {"line": np.array([4])},
        "block": {"hexahedron": np.array([0]), "tetra": np.array([0])},
        "tip": {"vertex": np.array([1])},
        "box": {"vertex": np.array([3])},
        "foot": {"vertex": np.array([0])},
    }
    return mp.fe.Mesh(points=points @ random_rotation(5).T, cells=cells, groups=groups)


PROPERTIES = {
    "skin": mp.Shell(plies=PLIES, nsm=0.3),
    "corner": mp.Shell(material=STEEL, thickness=0.004, offset=0.01),
    "rib": BAR,
    "strut": mp.Truss(material=STEEL, A=1e-4, J=1e-9),
    "hinge": mp.Spring(translation=(1e6, 2e6, 3e6), rotation=(4e3, 5e3, 6e3)),
    "block": mp.Solid(material=STEEL),
    "tip": mp.PointMass(mass=0.5, inertia=(1e-3, 2e-3, 2e-3, 0.0, 0.0, 0.0)),
    "box": mp.PointMass(mass=0.2, offset=(0.0, 0.01, 0.02)),
}


@cache
def model(forms, mass="coupled"):
    held = {"foot": mp.Interface(group="foot", kind="node")}
    return mp.assemble(mesh(), PROPERTIES, held, mass=mass, forms=forms)


@cache
def body(forms):
    return mp.flexible_body(model(forms), mp.craig_bampton(model(forms), modes=4), name="body")


def agree(found, wanted, same=SAME):
    found, wanted = (x.toarray() if hasattr(x, "toarray") else np.asarray(x) for x in (found, wanted))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=same * np.abs(wanted).max(initial=0.0))


@pytest.mark.parametrize("mass", ["coupled", "lumped", "nastran"])
def test_models(mass):
    wanted, found = (model(forms, mass) for forms in ("compiled", "plain"))
    for name in ("K", "M", "g", "h", "C"):
        agree(getattr(found, name), getattr(wanted, name))
    for a in range(3):
        for b in range(3):
            agree(found.M_ab[a, b], wanted.M_ab[a, b])
    for name in ("m", "s0", "E0"):
        agree(getattr(found.rigid, name), getattr(wanted.rigid, name))
    assert found.groups.mass("skin") == pytest.approx(wanted.groups.mass("skin"), rel=SAME)


def test_geometric_stiffness():
    d = 1e-4 * np.random.default_rng(2).standard_normal(model("plain").n_dof)
    load = np.zeros_like(d)
    wanted, found = (model(forms).geometric_stiffness(d, load) for forms in ("compiled", "plain"))
    agree(found, wanted)


def test_projected_geometric_stiffness():
    """As bodies take it: of several prestresses, the second without a load."""
    rng = np.random.default_rng(3)
    static, Phi = 1e-4 * rng.standard_normal((2, model("plain").n_dof, 2))
    loads = np.zeros_like(static)
    loads[0, 0] = 1.0
    wanted, found = (model(forms).geometric_stiffness.project(static, loads, Phi) for forms in ("compiled", "plain"))
    agree(found, wanted)
    assert not wanted[1].any()


@pytest.mark.skipif(not FULL, reason="half a minute, for some fifty prestresses")
def test_bodies():
    """Every array of the body, to rounding times the condition of the stiffness, 1e9."""
    wanted, found = (body(forms) for forms in ("compiled", "plain"))
    checked = 0
    for field in dataclasses.fields(wanted):
        value = getattr(wanted, field.name)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            agree(getattr(found, field.name), value, 1e-6)
            checked += value.size > 0
    assert checked > 10


@pytest.mark.parametrize("forms", FORMS)
def test_one_call_for_both(forms):
    """`skfem.asm` of the same form over some parts; sums over several structures."""
    own = model(forms)
    some, other, both = (structure_of(own, *names) for names in (["skin"], ["block"], ["skin", "block"]))
    make = FORMS[forms]
    assert isinstance(make.stiffness, skfem.BilinearForm)
    agree(skfem.asm(make.stiffness, [some, other]), skfem.asm(make.stiffness, both))
    assert skfem.asm(make.total, [some, other]) == pytest.approx(skfem.asm(make.total, both), rel=SAME)
    agree(skfem.asm(make.first, [some, other], a=1), skfem.asm(make.first, both, a=1))
    assert (make.stiffness.assemble(both) != skfem.asm(make.stiffness, both)).nnz == 0


def test_forms_by_name():
    with pytest.raises(mp.InputError, match="forms"):
        mp.assemble(mesh(), PROPERTIES, {"foot": mp.Interface(group="foot", kind="node")}, forms="fast")


def test_pipeline_files_name_the_forms(project):
    """`[mesh] forms` of the panel, which has shells and beams."""
    source = load_pipeline(project / "pipelines" / "panel.toml")
    plain = source.model_copy(update={"mesh": source.mesh.model_copy(update={"forms": "plain"})})
    mesh = mp.read_mesh(project / "meshes" / "panel.msh")
    wanted, found = (assemble_pipeline(pipeline, mesh) for pipeline in (source, plain))
    agree(found.K, wanted.K)
    assert (found.K != wanted.K).nnz  # not the same loops
