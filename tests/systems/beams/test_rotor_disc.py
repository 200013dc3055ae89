"""Disc on a flexible shaft that spins: as one finite-element body, as shaft and rigid disc, and by the closed form.

The shaft is clamped to a hub that turns at constant speed; all is seen from the hub, where a whirl of the circular
frequency w has ``|w - spin|``. Whirl of a disc on a massless shaft: Genta, Dynamics of Rotating Systems (2005), the
rotor with four degrees of freedom.
"""

import numpy as np
import pytest
from size import some

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.examples import beam_mesh

E, NU, RHO = 210e9, 0.3, 7800.0
STEEL = mp.Material(E=E, nu=NU, rho=RHO)
LENGTH, DIAMETER, MASS = 0.8, 0.03, 5.0
DISC = (0.05, 0.025, 0.025, 0.0, 0.0, 0.0)
PADDLE = (0.05, 0.02, 0.03, 0.0, 0.0, 0.004)  # not the same about y and z: parametric in the inertial frame
HEX20 = np.array(
    [
        *[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
        *[(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
        *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
    ]
)
ALONG, ACROSS = np.eye(3)[0], np.eye(3)[2]


def tensor(inertia):
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def shaft(at=1.0, disc=None, modes=6, elements=12, length=LENGTH, section=None, second_order_mass=False):
    """Body of the shaft, its interface at the share `at` of the length, where `disc` sits if given."""
    line = beam_mesh(elements, length)
    mesh = mp.fe.Mesh(
        points=line.points,
        cells={"line": line.cells["line"], "vertex": np.array([[0], [round(at * elements)]])},
        groups={"beam": {"line": np.arange(elements)}, "root": {"vertex": [0]}, "seat": {"vertex": [1]}},
    )
    properties = {"beam": section or mp.fe.beam_section("rod", STEEL, diameter=DIAMETER)}
    if disc is not None:
        properties["seat"] = disc
    held = {name: mp.Interface(group=name, kind="node") for name in ("root", "seat")}
    model = mp.assemble(mesh, properties, held)
    reduction = mp.craig_bampton(model, modes=modes, truncation=())
    return mp.flexible_body(model, reduction, name="shaft", second_order_mass=second_order_mass)


def on_a_hub(axis, rate, shaft, disc=None):
    """Shaft on a hub that turns, with a rigid disc welded to its interface."""
    motion = mp.multibody.TimeFunction(f"{rate}*t")
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="shaft", axis=axis, motion=motion)
    if disc is None:
        return mp.System(bodies={"shaft": shaft}, joints=(hub,))
    form = {"mass": disc.mass, "centre": np.array(disc.offset), "inertia": tensor(disc.inertia)}
    rigid = rigid_body("disc", **form, interfaces={"root": np.zeros(3)})
    seat = mp.Joint(name="seat", type="weld", parent="shaft.seat", child="disc")
    return mp.System(bodies={"shaft": shaft, "disc": rigid}, joints=(hub, seat))


def frequencies(system):
    rest = mp.static_equilibrium(system, steady=True)
    return np.sort(mp.system_modes(system, rest.y).frequency)


CASES = {
    "at the tip": (1.0, mp.PointMass(mass=MASS, inertia=DISC)),
    "amidships": (0.5, mp.PointMass(mass=MASS, inertia=DISC)),
    "overhung": (1.0, mp.PointMass(mass=MASS, inertia=DISC, offset=(0.06, 0.0, 0.0))),
    "a paddle": (1.0, mp.PointMass(mass=MASS, inertia=PADDLE)),
}


@pytest.mark.parametrize("rate", [0.0, 30.0, 400.0])  # critical speeds are at 82 to 169 rad/s
@pytest.mark.parametrize("case", CASES)
def test_whirl_of_one_body_is_that_of_shaft_and_disc(case, rate):
    """Both keep the same modes: the disc sits on an interface that is held while they are sought."""
    at, disc = CASES[case]
    expected = mp.multibody.spin_modes(shaft(at, disc), rate * ALONG).frequency
    found = frequencies(on_a_hub(ALONG, rate, shaft(at), disc))
    np.testing.assert_allclose(found, expected, rtol=1e-9)  # measured 3e-13: nothing bends under this spin


@pytest.mark.parametrize("rate", some([10.0, 30.0, 100.0], 2))
@pytest.mark.parametrize("case", CASES)
def test_disc_on_an_arm(case, rate):
    """Spin across the shaft, which stretches: its inertia changes in first order, so that both bodies need T."""
    at, disc = CASES[case]
    whole = shaft(at, disc, second_order_mass=True)
    one = frequencies(on_a_hub(ACROSS, rate, whole))
    two = frequencies(on_a_hub(ACROSS, rate, shaft(at, second_order_mass=True), disc))
    # the third order of the displacement of an interface is not exactly that of the body, and a paddle that twists
    # makes a finite turn: measured up to 5.3e-5 (rate / w)^4
    bent = (rate / (2 * np.pi * whole.frequency[0])) ** 4
    np.testing.assert_allclose(two, one, rtol=1e-8 + 6e-5 * bent)
    # spin_modes has the steady deflection in its mass alone, not in P: measured up to 4.5e-4 of the spin's fourth power
    np.testing.assert_allclose(mp.multibody.spin_modes(whole, rate * ACROSS).frequency, one, rtol=1e-8 + 5e-4 * bent)


def test_whirl_of_a_disc_on_a_massless_shaft():
    """Stiffness 12 EI/L^3, 6 EI/L^2, 4 EI/L of the tip; disc of polar inertia Jp: moment Jp w spin."""
    L, EI, GJ = LENGTH, E * np.pi * DIAMETER**4 / 64, E / (2 * (1 + NU)) * np.pi * DIAMETER**4 / 32
    light = mp.fe.beam_section("rod", mp.Material(E=E, nu=NU, rho=1e-3), diameter=DIAMETER, theory="euler-bernoulli")
    disc = mp.PointMass(mass=MASS, inertia=DISC)
    body = shaft(disc=disc, modes=0, section=light)
    K = EI / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])
    for rate in (0.0, 50.0, 300.0):
        # (K + w Jp spin - w^2 M) x = 0 as a first-order problem; its four roots are forward and backward whirl
        M, G = np.diag([MASS, DISC[1]]), np.diag([0.0, DISC[0] * rate])
        state = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(M, K), np.linalg.solve(M, G)]])
        whirl = np.linalg.eigvals(state).real
        expected = np.sort([*np.abs(whirl - rate), np.sqrt(GJ / (L * DISC[0]))]) / (2 * np.pi)
        stretch = np.sqrt(E * np.pi * DIAMETER**2 / 4 / (L * MASS)) / (2 * np.pi)
        found = mp.multibody.spin_modes(body, rate * ALONG).frequency
        found = np.delete(found, np.argmin(np.abs(found - stretch)))
        np.testing.assert_allclose(found, expected, rtol=1e-6)  # measured 1e-7; the shaft has 6e-7 kg of 5 kg


def hexahedra(x, y, solid):
    """HEX20 mesh on lines x, and lines y in both directions of the section, where ``solid(i, j, k)``."""
    lines = [np.interp(np.arange(2 * len(c) - 1) / 2, np.arange(len(c)), c) for c in (x, y, y)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    number = np.arange(points[..., 0].size).reshape(points.shape[:3])
    cells = [
        [number[tuple(2 * np.array(at) + step)] for step in HEX20]
        for at in np.ndindex(len(x) - 1, len(y) - 1, len(y) - 1)
        if solid(*at)
    ]
    used, new = np.unique(cells, return_inverse=True)
    return points.reshape(-1, 3)[used], new.reshape(-1, 20)


@pytest.mark.parametrize("rate", [0.0, 60.0, 200.0])
def test_plate_on_a_square_shaft_of_hexahedra(rate):
    """Against beams with a rigid plate, whose shaft is clamped to the middle of the plate's near face."""
    side, width, thick, length = 0.03, 0.2, 0.02, 0.6
    y = np.array([-width / 2, -0.05, -side / 2, 0.0, side / 2, 0.05, width / 2])
    x = np.append(np.linspace(0, length, 13), length + thick)
    points, cells = hexahedra(x, y, lambda i, j, k: i == 12 or {j, k} <= {2, 3})
    root = np.flatnonzero(points[:, 0] < 1e-9)
    mesh = mp.fe.Mesh(
        points=points,
        cells={"hexahedron20": cells, "vertex": root[:, None]},
        groups={"all": {"hexahedron20": np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}},
    )
    held = {"root": mp.Interface(group="root", kind="rbe2", position=(0.0, 0.0, 0.0))}
    model = mp.assemble(mesh, {"all": mp.Solid(material=STEEL)}, held)
    solid = mp.flexible_body(model, mp.craig_bampton(model, modes=20, truncation=("inertia",)), name="rotor")
    mass = RHO * width**2 * thick
    plate = (mass * width**2 / 6, *[mass * (width**2 + thick**2) / 12] * 2, 0.0, 0.0, 0.0)
    disc = mp.PointMass(mass=mass, inertia=plate, offset=(thick / 2, 0.0, 0.0))
    section = mp.fe.beam_section("rectangle", STEEL, width=side, height=side)
    beams = shaft(disc=disc, length=length, section=section)
    found, expected = (mp.multibody.spin_modes(b, rate * ALONG).frequency[:5] for b in (solid, beams))
    # a clamped root, held against lateral contraction, and four elements in the section: measured 0.8 % stiffer;
    # bending next to the critical speed is the difference of whirl and spin, so to 1 % of the whirl
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=0.01 * beams.frequency[0])
