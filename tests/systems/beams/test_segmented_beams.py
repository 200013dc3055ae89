"""Beams in rigid segments: statics, frequencies and large motion against closed forms and geometrically exact beams."""

import numpy as np
import pytest
from analytic import cantilever_roots
from beam_series import blade, spin_up_lag
from size import some
from systems.elastic_rod import rod_tip
from systems.exact_beams import exudyn_ends
from systems.planar_chain import Chain
from systems.segments import CANTILEVER, PIPELINES, cantilever, frequencies, order, rest, system_of, with_segments

import modalprep as mp
from modalprep.multibody.analysis.equilibrium import static_equilibrium

UNIT_BEAM = {"length": 1.0, "mass": 1.0, "EI": 1.0}


def test_frequencies_of_a_cantilever(tmp_path):
    """Those of the chain's own equations; order two against the closed form, which a clamp with EI/l would spoil."""
    first = []
    for n in (5, 10, 20):
        found = frequencies(cantilever(tmp_path, n))[:3]
        np.testing.assert_allclose(found, Chain(n, **UNIT_BEAM).frequencies()[:3], rtol=2e-7)
        first.append(found[0])
    exact = cantilever_roots(1)[0] ** 2
    assert order(np.array(first) / exact - 1) == pytest.approx(2.0, abs=0.02)
    soft = frequencies(cantilever(tmp_path, 10, more="root = { stiffness = [10.0] }"))[0]
    assert soft / exact - 1 == pytest.approx(-0.091, abs=1e-3)  # EI/l at the clamp: order one


def test_frequency_of_a_rotating_chain(tmp_path):
    """Flap at six times sqrt(EI/(rA L^4)); the stiffening needs no geometric stiffness."""
    hub = '[bodies.hub]\nmass = 1.0\n[joints.hub]\ntype = "revolute"\nchild = "hub.root"\nmotion = "6*t"'
    found = []
    for n in (10, 20, 40):
        system = cantilever(tmp_path, n, EI="[1.0, 100.0]", more='parent = "hub.root"\n' + hub)
        found.append(frequencies(system)[0])
        assert found[-1] == pytest.approx(Chain(n, **UNIT_BEAM).frequencies(spin=6.0)[0], rel=1e-6)
    assert order(np.array(found) - blade(6.0)[0]) == pytest.approx(2.0, abs=0.1)


ELASTICA = [  # P L^2/EI, deflection and shortening over L: elliptic integrals, five digits
    (0.5, 0.16214, 0.01592),
    (1, 0.30172, 0.05643),
    (2, 0.49346, 0.16064),
    (3, 0.60325, 0.25442),
    (5, 0.71379, 0.38763),
    (10, 0.81061, 0.55500),
]


@pytest.mark.parametrize(("load", "deflection", "shortening"), some(ELASTICA, 3))
def test_elastica(tmp_path, load, deflection, shortening):
    """Order two against the differential equation, which gives the printed digits; extrapolated, order four is left."""
    exact = rod_tip(1.0, (0, -load, 0), bending=(1.0, 1.0, 1.0))[:2]
    np.testing.assert_allclose(exact, [1 - shortening, -deflection], atol=6e-6)
    coarse, fine = (rest(with_segments("elastica", n, tmp_path), t=load)[:2] for n in (20, 40))
    np.testing.assert_allclose((4 * fine - coarse) / 3, exact, atol=2e-5)
    errors = np.linalg.norm([coarse - exact, fine - exact], axis=1)
    assert order(errors) == pytest.approx(2.0, abs=0.1)
    assert errors[0] < 1.5e-3  # as the header of the pipeline says


def test_roll_up(tmp_path):
    """Every hinge turns by M l/EI, half of it at the clamp: the rods are sides of a polygon, closed at f = 2."""
    for t, f in ((1.25, 0.5), (2.5, 1.0), (5.0, 2.0)):
        tips = [rest(with_segments("roll-up", n, tmp_path), t=t)[:2] for n in (10, 20, 40)]
        exact = np.array([np.sin(f * np.pi), 1 - np.cos(f * np.pi)]) / (f * np.pi)
        chord = [(f * np.pi / n / 2) / np.sin(f * np.pi / n / 2) for n in (10, 20, 40)]
        np.testing.assert_allclose(tips, np.outer(chord, exact), atol=1e-10)


# Tip displacement: Bathe and Bolourchi, Int. J. Numer. Methods Eng. 14 (1979) 961, as the test bd_curved_beam of
# OpenFAST prints it, and 16 elements of GXBeam.jl (its example "curved")
BEND = {"Bathe and Bolourchi": ((-23.5, -13.4, 53.4), 0.25), "GXBeam": ((-23.5453, -13.5774, 53.4580), 0.03)}


def test_curved_beam_out_of_its_plane(tmp_path):
    """Bend of 45 degrees under 600; order two against the differential equations of the rod, which programs confirm."""
    inertia, length, tips = 1e7 / 12, 25 * np.pi, []
    for n in (8, 16):
        text = CANTILEVER.format(n=n, EI=[inertia, inertia], more=f"GJ = {inertia}\ncurvature = 0.01")
        text = text.replace("length = 1.0", f"length = {length}")
        system = system_of(f'{text}[forces.tip]\nat = "arm{n}.tip"\nforce = [0, 0, "t"]\n', tmp_path)
        tips.append([rest(system, t=load) - rest(system) for load in (300.0, 600.0)])
    curved = {"bending": (inertia,) * 3, "curvature": (0.0, 0.0, 0.01)}
    start, *ends = (rod_tip(length, (0.0, 0.0, load), **curved) for load in (0.0, 300.0, 600.0))
    for printed, digits in BEND.values():
        np.testing.assert_allclose(ends[1] - start, printed, atol=digits)
    tips, exact = np.array(tips), np.array(ends) - start
    np.testing.assert_allclose(
        (4 * tips[1] - tips[0]) / 3, exact, atol=0.03
    )  # what is left of order four: 5e-4 of the largest
    np.testing.assert_allclose(order(np.linalg.norm(tips - exact, axis=2)), 2.0, atol=0.2)


# degrees from the thin side's normal: tip across the blade and along it, m, under 8.896 N, by finite elements of ANSYS
# as the test model geometricallyExactBeamTest.py of Exudyn prints them; the experiment is of Dowell and Traybar (1975)
PRINCETON = {
    0: (0, 0.010714),
    15: (0.042082, 0.010613),
    30: (0.079395, 0.010112),
    45: (0.108988, 0.008837),
    60: (0.129888, 0.006605),
    75: (0.142194, 0.003539),
    90: (0.146246, 0),
}


@pytest.mark.parametrize("beta", some(PRINCETON, 3))
def test_princeton_beam(tmp_path, beta):
    """Bending in two planes and twist; the load stands oblique to the section: the rod's differential equations."""
    E, h, thickness = 71.7e9, 12.3777e-3, 3.2024e-3
    strong, weak = thickness * h**3 / 12, h * thickness**3 / 12
    torsion = E / 2.62 * 0.198 * (strong + weak)
    more = f"GJ = {torsion}"
    text = CANTILEVER.format(n=20, EI=[E * weak, E * strong], more=more).replace("length = 1.0", "length = 0.508")
    force = [0.0, *(8.896 * float(f(np.radians(beta))) for f in (np.cos, np.sin))]
    tip = rest(system_of(f'{text}[forces.tip]\nat = "arm20.tip"\nforce = {force}\n', tmp_path))
    exact = rod_tip(0.508, force, bending=(torsion, E * weak, E * strong))
    flap, chord = PRINCETON[beta]
    np.testing.assert_allclose(exact[1:], [chord, flap], atol=2e-3 * 0.146)  # of the factor of the twist
    np.testing.assert_allclose(tip, exact, atol=2e-3 * 0.146)  # 20 rods, order two


# tip at 1, 2 .. 5 s by `exudyn_ends`: Exudyn 1.13, 20 and 40 elements extrapolated, step 5 ms, rotary inertia 1e-3 kg m
SLEW = [(9.7816, -0.0377), (6.6693, -0.7802), (6.0792, 2.8777), (1.9043, 8.7614), (-1.7203, 9.7586)]


def quarter_turn(t):
    return np.pi / 2 * (t / 2 - np.sin(np.pi * t) / (2 * np.pi)) if t < 2 else np.pi / 2


def test_slew_of_a_soft_beam(tmp_path):
    """Ten rods as their own equations say; extrapolated to the geometrically exact beam, order two."""
    tips = []
    for n in (10, 20, 40):
        run = mp.simulate(with_segments("slew-beam", n, tmp_path), t_end=5, output_step=1.0, method="explicit")
        assert run.stats["energy_error"] < 1e-8
        tips.append(run[f"arm{n}.tip.position"][1:, :2])
    rods = Chain(10, 10.0, 12.0, EI=140.0, base=quarter_turn)
    np.testing.assert_allclose(tips[0], rods.tip(rods.motion([1.0, 2.0, 3.0, 4.0, 5.0])), atol=1e-4)
    np.testing.assert_allclose((4 * tips[2] - tips[1]) / 3, SLEW, atol=6e-3)
    assert order([np.linalg.norm(tips[k] - tips[k + 1]) for k in (0, 1)]) == pytest.approx(2.0, abs=0.2)


def deepest(time, lag):
    """Least value of a curve, by the parabola through the lowest of its points."""
    near = np.argmin(lag) + np.arange(-1, 2)
    curve = np.polyfit(time[near] - time[near[1]], lag[near], 2)
    return curve[2] - curve[1] ** 2 / (4 * curve[0])


def spin_up_angle(t):
    return 0.4 * (t**2 / 2 + (7.5 / np.pi) ** 2 * (np.cos(np.pi * t / 7.5) - 1))


def test_spin_up_of_rods(tmp_path):
    """Five rods as their own equations say; 5 and 10, extrapolated, lag as deep as the beam, which bends 3e-3."""
    lags = []
    for n in (5, 10):
        run = mp.simulate(with_segments("spinup-rods", n, tmp_path), t_end=7.5, output_step=0.1, method="explicit")
        lags.append(run.relative_to("hub")[f"arm{n}.tip.position.y"])
    rods = Chain(5, 10.0, 12.0, EI=1.4e4, base=spin_up_angle)
    x, y = rods.tip(rods.motion(run.time, rtol=1e-8)).T
    angle = spin_up_angle(run.time)
    np.testing.assert_allclose(lags[0], y * np.cos(angle) - x * np.sin(angle), atol=3e-5)
    found, expected = (4 * deepest(run.time, lags[1]) - deepest(run.time, lags[0])) / 3, spin_up_lag(run.time)
    assert found == pytest.approx(deepest(run.time, expected), rel=2e-3)


# t: driven end, free end by `exudyn_ends`: Exudyn 1.13, 80 elements, step 2.5 ms
EXACT = {
    2.5: (4.962, 4.476, 3.584, 6.111),
    5.0: (9.783, 8.204, 8.076, 1.757),
    7.5: (16.273, -0.290, 17.235, 8.258),
    10.0: (22.971, 6.419, 21.328, 3.619),
}


def spaghetti(folder, n, t_end):
    return mp.simulate(with_segments("flying-spaghetti", n, folder), t_end=t_end, output_step=2.5)


def ends(run, n):
    return np.hstack([run["rod1.root.position"][:, :2], run[f"rod{n}.tip.position"][:, :2]])


def test_flying_spaghetti(tmp_path):
    """Momentum and centre of mass are exact; the ends to what forty rods lack, which grows with time."""
    run = spaghetti(tmp_path, 40, 10.0)
    np.testing.assert_allclose(run["momentum.linear"][1:], [[20, 0, 0]] * 4, atol=1e-6)
    origins = [run[f"rod{k}.{end}.position"] for k in range(1, 41) for end in ("root", "tip")]
    centre = [[5.5 + 2 * (t - 2.5), 4, 0] for t in EXACT]
    np.testing.assert_allclose(np.mean(origins, axis=0)[1:], centre, atol=1e-6)
    spin = run["momentum.angular"][1:, 2] + 20 * 4  # about the centre of mass
    np.testing.assert_allclose(spin, spin[0], rtol=1e-6)
    assert spin[0] == pytest.approx(-149.512, rel=3e-4)
    for found, expected, error in zip(ends(run, 40)[1:], EXACT.values(), (6e-3, 6e-3, 2e-2, 5e-2), strict=True):
        np.testing.assert_allclose(found, expected, atol=error)


@pytest.mark.parametrize("EI", [100.0, 500.0])
def test_flying_spaghetti_against_exudyn(tmp_path, EI):
    """Geometrically exact elements of Exudyn while the load acts, 20 and 40 extrapolated, as the rods are."""
    exudyn = pytest.importorskip("exudyn")
    rods, elements = [], []
    for n in (20, 40):
        system = with_segments("flying-spaghetti", n, tmp_path, {"EI = 100.0": f"EI = {EI}"})
        rods.append(ends(mp.simulate(system, t_end=2.5, output_step=2.5), n)[1])
        places, push = np.linspace([6.0, 0.0], [0.0, 8.0], n + 1), ((8, 0), -80)
        data = {"EI": EI, "mass": 1.0, "rotary": 10.0, "axial": 1e4, "shear": 1e4}
        elements.append(exudyn_ends(exudyn, places, 1.25e-3, [2.5], push=push, **data)[0])
    found, expected = ((4 * fine - coarse) / 3 for coarse, fine in (rods, elements))
    np.testing.assert_allclose(found, expected, atol=2e-3)  # a tenth of what 20 rods lack
    if EI == 500:  # the same elements, for those who do not have Exudyn
        np.testing.assert_allclose(expected, STIFF, atol=1e-4)


# ends at 2.5 s with EI = 500 N m^2 by `exudyn_ends`: Exudyn 1.13, 20 and 40 elements extrapolated, step 1.25 ms
STIFF = [4.4299, -0.7848, 5.9458, 8.9700]


def test_stiff_flying_spaghetti(tmp_path):
    """EI = 500 N m^2: rods extrapolated against the numbers above, and what no stiffness changes."""
    rods = []
    for n in (20, 40):
        run = mp.simulate(
            with_segments("flying-spaghetti", n, tmp_path, {"EI = 100.0": "EI = 500.0"}), t_end=5.0, output_step=2.5
        )
        rods.append(ends(run, n)[1])
    np.testing.assert_allclose((4 * rods[1] - rods[0]) / 3, STIFF, atol=2e-3)
    np.testing.assert_allclose(run["momentum.linear"][1:], [[20, 0, 0]] * 2, atol=1e-6)
    spin = run["momentum.angular"][1:, 2] + 20 * 4  # about the centre of mass, which flies along y = 4
    np.testing.assert_allclose(spin, spin[0], rtol=1e-6)


ARM = [  # tip at 1, 2 .. 10 s by `exudyn_ends`: Exudyn 1.13, 20 and 40 elements extrapolated, step 5 ms
    (9.9789, -0.0784), (9.8093, 1.5268), (7.9510, 6.0504), (3.0797, 9.4808), (-0.5856, 9.9200),
    (-1.2173, 9.8929), (0.2127, 9.9943), (2.1568, 9.7503), (2.4476, 9.6728), (0.7870, 9.9689),
]  # fmt: skip


@pytest.fixture(scope="module")
def rotating_arm(tmp_path_factory):
    """Tips (10, 2) of 20 and 40 rods, extrapolated; order two."""
    tips = []
    for n in (10, 20, 40):
        system = with_segments("rotating-arm", n, tmp_path_factory.mktemp("arm"))
        run = mp.simulate(system, t_end=10, output_step=1.0, method="explicit")
        assert run.stats["energy_error"] < 1e-8
        tips.append(run[f"arm{n}.tip.position"][1:, :2])
    assert np.linalg.norm(tips[1] - ARM, axis=1).max() < 0.02  # as the picture is drawn
    assert order([np.linalg.norm(tips[k] - tips[k + 1]) for k in (0, 1)]) == pytest.approx(2.0, abs=0.2)
    return (4 * tips[2] - tips[1]) / 3


def test_rotating_arm(rotating_arm):
    np.testing.assert_allclose(rotating_arm, ARM, atol=2e-3)  # a tenth of what 20 rods lack


def test_rotating_arm_against_exudyn(rotating_arm):
    """Elements 10 and 20, extrapolated, while the arm starts and stops."""
    exudyn = pytest.importorskip("exudyn")

    def turn(t):
        if t < 5:
            return 0.15 * (t - np.sin(np.pi * t) / np.pi) if t < 1 else 0.3 * t - 0.15
        return 1.35 + 0.15 * (t - 5 + np.sin(np.pi * (t - 5)) / np.pi) if t < 6 else 1.5

    data = {"EI": 1000.0, "mass": 1.0, "rotary": 1e-3, "axial": 1e6, "shear": 1e6}  # 1e-5 of the length at most
    coarse, fine = (
        exudyn_ends(exudyn, np.linspace([0, 0], [10, 0], n + 1), 0.01, range(1, 7), turn=turn, **data)[:, 2:]
        for n in (10, 20)
    )
    np.testing.assert_allclose(rotating_arm[:6], (4 * fine - coarse) / 3, atol=3e-3)


def test_short_beam_that_shears(tmp_path):
    """Half as high as a quarter of its length: Nachbagauer et al., J. Comput. Nonlinear Dyn. 8 (2013) 021004."""
    E, nu, height, width = 2.07e11, 0.3, 0.5, 0.1
    area, inertia = height * width, width * height**3 / 12
    shear = 10 * (1 + nu) / (12 + 11 * nu) * E / (2 * (1 + nu)) * area
    tips = []
    for n in (10, 20, 40):
        text = CANTILEVER.format(n=n, EI=E * inertia, more=f"EA = {E * area}\nGA = {shear}")
        loaded = f'[forces.tip]\nat = "arm{n}.tip"\nforce = [0, {5e8 * height**3}, 0]\n'
        tips.append(rest(system_of(text.replace("length = 1.0", "length = 2.0") + loaded, tmp_path))[:2])
    np.testing.assert_allclose(tips[1], [2 - 0.150971, 0.710568], atol=5e-4)
    # stretch and shear lie in the axes before the turn: an error of order one, of strain times turn, beside that of two
    extrapolated = (8 * tips[2] - 6 * tips[1] + tips[0]) / 3
    np.testing.assert_allclose(extrapolated, [2 - 0.150971, 0.710568], atol=5e-6)


def test_flying_spaghetti_in_space(tmp_path):
    """The impulse is 50 N s, so 10 kg fly at 5 m/s; afterwards nothing changes both momenta. Order two."""
    tips = []
    for n in (20, 40, 80):
        run = mp.simulate(with_segments("flying-spaghetti-3d", n, tmp_path), t_end=10, output_step=2.5, rtol=1e-7)
        tips.append(run[f"rod{n}.tip.position"])
        np.testing.assert_allclose(run["momentum.linear"][1:], [[25, 0, 0], *[[50, 0, 0]] * 3], atol=1e-5)
        np.testing.assert_allclose(run["momentum.angular"][3:], [run["momentum.angular"][2]] * 2, atol=1e-4)
        assert run.stats["energy_error"] < 1e-8
    assert order([np.linalg.norm(tips[k] - tips[k + 1]) for k in (0, 1)]) == pytest.approx(2.0, abs=0.2)


# t: tip of a geometrically exact beam of 40 elements to two or three digits; computed once for this test, a regression
# value and not a published one
PENDULUM = {
    0.2: (1.180, -0.196),
    0.4: (0.853, -0.787),
    0.5: (0.389, -1.214),
    0.6: (-0.334, -1.258),
    0.8: (-0.895, -0.802),
    1.0: (-1.152, -0.313),
}


def test_flexible_pendulum():
    """Within 2 % of the length, and within 0.5 % before the whip at 0.6 s."""
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.schema.load import load
    from modalprep.pipeline.systems.read import read_system

    path = PIPELINES / "flexible-pendulum.toml"
    system = read_system(load(path), None, Reporter(quiet=True))
    run = mp.simulate(system, t_end=1.0, output_step=0.1, rtol=1e-6)
    for t, expected in PENDULUM.items():
        tip = run["rope40.tip.position"][round(10 * t), :2]
        np.testing.assert_allclose(tip, expected, atol=6e-3 if t < 0.7 else 0.024)
    assert run.stats["energy_error"] < 1e-6


@pytest.mark.parametrize(("step", "elongation"), [(0.1, 0.083278), (0.5, 2.049704), (1.0, 7.840522)])
def test_newmark_lengthens_the_period(tmp_path, step, elongation):
    """Generalized-alpha without numerical damping is Newmark's rule of 1/4: tan(w h/2) = w0 h/2, exactly."""
    disc = 'mass = 1.0\ninertia = [1, 1, 1]\n[joints.hinge]\ntype = "revolute"\nchild = "disc.root"\n'
    spring = "stiffness = 1.0\nstart = { angle = 1.0 }\n[simulation]\nt_end = 1.0"
    system = system_of("[bodies.disc]\n" + disc + spring, tmp_path)
    run = mp.simulate(
        system, t_end=40 * step, output_step=step, method="generalised_alpha", rho_inf=1.0, step=step, rtol=1e-12
    )
    slow = 2 / step * np.arctan(step / 2)
    assert 100 * (1 / slow - 1) == pytest.approx(elongation, abs=5e-7)
    np.testing.assert_allclose(run["hinge.angle"], np.cos(slow * run.time), atol=1e-9)


def test_mistakes(tmp_path):
    with pytest.raises(mp.InputError, match="twists the beam out of its plane: give EI as two numbers"):
        cantilever(tmp_path, 3, more="GJ = 1.0")
    with pytest.raises(mp.InputError, match="EA and GA go together, with one EI"):
        cantilever(tmp_path, 3, more="EA = 1.0")
    with pytest.raises(mp.InputError, match=r"\[beams.arm.root\]: unknown key 'stifness'; did you mean 'stiffness'"):
        cantilever(tmp_path, 3, more="root = { stifness = 1.0 }")


def test_stretch_and_damping(tmp_path):
    """A pulled beam grows by N L/EA, half a segment at the clamp included; damping is the time times the stiffness."""
    more = 'EA = 8.0\nGA = 4.0\ndamping = 0.5\n[forces.pull]\nat = "arm4.tip"\nforce = [2.0, 0, 0]'
    system = cantilever(tmp_path, 4, more=more)
    found = static_equilibrium(system)
    assert sum(joint[0] for joint in found.joints.values()) == pytest.approx(2 / 8 * 3.5 / 4, rel=1e-9)
    assert [element.damping for element in system.joints[1].elements] == [16.0, 8.0, 2.0]
