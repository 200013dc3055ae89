"""Loads per area and per length against closed forms: beams, strings, hanging chains, plates, membranes, rings."""

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_array
from scipy.special import jn_zeros
from structured import surface

import modalprep as mp
from modalprep.errors import InputError
from modalprep.reduction import Load, buckling, follower_stiffness, nodal_load, prestressed_modes
from modalprep.reduction.clamped import clamp

STEEL = mp.Material(E=2e11, nu=0.3, rho=8000.0)
THIN = mp.Beam(material=mp.Material(E=2e11, nu=0.3, rho=8000.0), A=1e-4, Iy=1e-19, Iz=1e-19, J=2e-19)  # no bending


def line(n, length, direction, section, terms=None, **supports):
    """Beams along a direction, clamped at their first node or held by supports."""
    mesh = mp.fe.Mesh(
        points=np.linspace(0, length, n + 1)[:, None] * np.array(direction, dtype=float),
        cells={"line": np.arange(n)[:, None] + [0, 1]},
        groups={"line": {"line": np.arange(n)}},
    )
    held = {name: mp.Support(near=at, components=digits) for name, (at, digits) in supports.items()}
    root = mp.Interface(kind="support") if held else mp.Interface(node=1, kind="node")
    return mp.assemble(mesh, {"line": section}, {"root": root}, supports=held, terms=terms), mesh


def plate(n, section, supports, terms=None, shape=None):
    points, quads = surface(n[0], n[1], "quad", shape)
    own = {"quad": np.arange(len(quads))}
    mesh = mp.fe.Mesh(points=points, cells={"quad": quads}, groups={"face": own, "sheet": own})
    root = mp.Interface(kind="support", position=(0.0, 0, 0))
    return mp.assemble(mesh, {"face": section}, {"root": root}, supports=supports, terms=terms), mesh


def edges(components):
    sides = [((x, x, 0.0), e) for x in (0.0, 1.0) for e in ((1.0, 0, 0), (0, 1.0, 0))]
    return {f"edge{k}": mp.Support(plane=side, components=components) for k, side in enumerate(sides)}


def static(model, load):
    clamped = clamp(model)
    x = np.zeros(clamped.K.shape[0])
    x[clamped.i] = clamped.factor.solve((model.C.T @ load)[clamped.i])
    return model.C @ x


def tension(T):
    """``int T u_i,x v_i,x`` of what is stretched by T."""
    form = skfem.BilinearForm(lambda u, t, v, s, w: T * np.einsum("ij...,ij...->...", u.grad[1:], v.grad[1:]))
    return {"tension": mp.fe.Term(form=form, group="line", to="stiffness")}


def test_cantilever_under_a_line_load():
    """``w = q L^4 / 8 E I`` and the slope ``q L^3 / 6 E I``, exact with two elements."""
    section = mp.Beam(material=STEEL, A=1e-4, Iy=8e-10, Iz=8e-10, J=1.6e-9, ky=1e9, kz=1e9)  # without shear
    model, mesh = line(2, 1.5, (1, 0, 0), section)
    d = static(model, nodal_load(model, mesh, "snow", Load(group="line", line_load=(0, 0, -5.0))))
    EI = STEEL.E * section.Iy
    assert d[model.dof[2, 2]] == pytest.approx(-5 * 1.5**4 / (8 * EI), rel=1e-9)
    assert d[model.dof[2, 4]] == pytest.approx(5 * 1.5**3 / (6 * EI), rel=1e-9)


def test_string_under_a_line_load():
    """``w = q L^2 / 8 T`` in the middle, less what bends at its ends: sqrt(E I / T) / L = 1e-6."""
    T = 5000.0
    ends = {"left": ((0.0, 0, 0), "1234"), "right": ((2.0, 0, 0), "123")}
    model, mesh = line(16, 2.0, (1, 0, 0), THIN, tension(T), **ends)
    d = static(model, nodal_load(model, mesh, "ice", Load(group="line", line_load=(0, 3.0, -4.0))))
    np.testing.assert_allclose(d[model.dof[8, 1:3]], np.array([3.0, -4.0]) * 4 / (8 * T), rtol=1e-5)


def test_hanging_chain():
    """Frequencies ``j_0k sqrt(g / L) / 4 pi`` under its weight as a line load, towards x."""
    L, g = 1.0, 9.81
    model, mesh = line(60, L, (1, 0, 0), THIN)
    weight = nodal_load(model, mesh, "weight", Load(group="line", line_load=(STEEL.rho * THIN.A * g, 0, 0)))
    np.testing.assert_allclose(weight, model.g @ [g, 0, 0], atol=1e-12 * weight.max())
    own = prestressed_modes(model, weight, 6).value
    exact = np.repeat(jn_zeros(0, 3), 2) * np.sqrt(g / L) / (4 * np.pi)
    np.testing.assert_allclose(own, exact, rtol=1e-3)  # 60 elements; the stiff layer at the clamp has 5e-5


def test_plate_under_pressure():
    """A simply supported square: ``w = 0.00406235 p a^4 / D`` (Timoshenko)."""
    model, mesh = plate((16, 16), mp.Shell(material=STEEL, thickness=0.01), edges("123"))
    p = Load(group="face", pressure=-1000.0)
    w = static(model, nodal_load(model, mesh, "gas", p))[model.dof[:, 2]]
    D = STEEL.E * 0.01**3 / (12 * (1 - 0.3**2))
    assert w.min() == pytest.approx(-0.00406235 * 1000 / D, rel=8e-3)  # twice the error of its frequency
    same = nodal_load(model, mesh, "gas", Load(group="face", traction=(0, 0, -1000.0)))
    np.testing.assert_allclose(same, nodal_load(model, mesh, "gas", p), atol=1e-12)


def test_membrane_under_pressure():
    """A stretched square: ``w = 0.0736713 p a^2 / T``, the series of Poisson's equation."""
    T = 1e5
    stretch = skfem.BilinearForm(lambda u, v, w: T * np.einsum("ij...,ij...->...", u.grad[2:], v.grad[2:]))
    term = {"stretch": mp.fe.Term(form=stretch, group="sheet", to="stiffness")}
    model, mesh = plate((16, 16), mp.Shell(material=STEEL, thickness=1e-5), edges("123"), term)
    w = static(model, nodal_load(model, mesh, "gas", Load(group="sheet", pressure=50.0)))[model.dof[:, 2]]
    assert w.max() == pytest.approx(0.0736713 * 50 / T, rel=5e-3)  # bilinear: (pi / 16)^2 / 12


@pytest.fixture(scope="module")
def ring():
    """A quarter of a ring of radius 1 m, 10 mm thick and 50 mm wide, that moves in its plane only; and its mesh."""
    section = mp.Shell(material=mp.Material(E=2e11, nu=0.0, rho=8000.0), thickness=0.01)
    supports = {
        "plane": mp.Support(box=((-1, -1, -1), (2, 2, 2)), components="345"),
        "x": mp.Support(plane=((0.0, 0, 0), (1, 0, 0)), components="16"),
        "y": mp.Support(plane=((0.0, 0, 0), (0, 1, 0)), components="26"),
    }
    arc = lambda s, t: (np.cos(s * np.pi / 2), np.sin(s * np.pi / 2), 0.05 * t)  # noqa: E731 (as `surface` takes it)
    return plate((24, 1), section, supports, shape=arc)


def test_ring_under_pressure(ring):
    """Buckling at ``3 E I / R^3`` where the pressure follows the ring, at ``4 E I / R^3`` where it does not turn."""
    model, mesh = ring
    inwards = Load(group="face", pressure=-1.0 if outwards(model, mesh) else 1.0)
    load = nodal_load(model, mesh, "sea", inwards)
    EI = 2e11 * 0.01**3 / 12
    dead = buckling(model, load).value[0]
    turning = buckling(model, load, load_stiffness=follower_stiffness(model, mesh, "sea", inwards)).value[0]
    assert dead == pytest.approx(4 * EI, rel=5e-3)  # facets of 24 to a quarter: (pi / 96)^2
    assert turning == pytest.approx(3 * EI, rel=5e-3)


def outwards(model, mesh):
    load = nodal_load(model, mesh, "sea", Load(group="face", pressure=1.0))
    return load[model.dof[0, 0]] > 0


def test_load_stiffness_is_the_change_of_the_load(ring):
    """Differences of the pressure on the moved mesh, along motions without work at the free edges."""
    model, mesh = ring
    K = follower_stiffness(model, mesh, "sea", Load(group="face", pressure=7.0))
    x, y, _ = model.points.T
    angle = np.arctan2(y, x)
    u = np.zeros((len(x), 3))
    u[:, 0], u[:, 1] = np.cos(2 * angle) * np.cos(angle), np.cos(2 * angle) * np.sin(angle)
    translations = model.dof[: len(x), :3]
    step = 1e-6
    moved = [mp.fe.Mesh(points=mesh.points + sign * step * u, cells=mesh.cells, groups=mesh.groups) for sign in (1, -1)]
    faces = {"root": mp.Interface(plane=((0.0, 0, 0), (1, 0, 0)))}
    section = {"face": mp.Shell(material=STEEL, thickness=0.01)}
    F = [nodal_load(mp.assemble(m, section, faces), m, "sea", Load(group="face", pressure=7.0)) for m in moved]
    change = (F[0] - F[1])[translations] / (2 * step)
    d = np.zeros(model.n_dof)
    d[translations] = u
    own = -(K @ d)[translations]
    assert np.einsum("ij,ij", u, own) == pytest.approx(np.einsum("ij,ij", u, change), rel=1e-6)


def test_what_has_no_load_stiffness(ring):
    model, mesh = ring
    with pytest.raises(InputError, match="load 'wind' has no pressure"):
        follower_stiffness(model, mesh, "wind", Load(group="face", traction=(1.0, 0, 0)))
    with pytest.raises(InputError, match=r"load_stiffness has the shape \(3, 3\)"):
        buckling(model, np.ones(model.n_dof), load_stiffness=csr_array((3, 3)))
