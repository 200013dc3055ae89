"""Kane's method derived symbolically: direct and premature linearisation, constraints with multipliers."""

import numpy as np
import pytest
from multibody.trees import order_n
from scipy.integrate import quad

import modalprep as mp
from modalprep.examples import beam_mesh

# ---- rotating beam: one mode, generalised inertia force per unit of mass ----

LENGTH, MU, EI = 10.0, 1.0, 1e4
ROOT = 1.8751040687119611  # of cos x cosh x = -1
RATIO = (np.cosh(ROOT) + np.cos(ROOT)) / (np.sinh(ROOT) + np.sin(ROOT))
SPIN, SPIN_UP = 2.0, 0.3  # rad/s, rad/s^2


def inertia_forces():
    """Generalised inertia force of a mass point at x, to first order: directly and prematurely linearised.

    The point moves by phi q across the beam and, as the beam does not stretch, by ``c q^2 / 2`` back along it, c the
    integral of phi'^2 from the root to x.
    """
    sympy, mechanics = pytest.importorskip("sympy"), pytest.importorskip("sympy.physics.mechanics")
    t, (x, phi, c, epsilon) = mechanics.dynamicsymbols._t, sympy.symbols("x phi c epsilon")
    q, u, spin = mechanics.dynamicsymbols("q u Omega")

    def first_order(vector, frame):
        scaled = vector.to_matrix(frame).subs({u: epsilon * u, q: epsilon * q}).doit()
        kept = scaled.applyfunc(lambda entry: sympy.series(sympy.expand(entry), epsilon, 0, 2).removeO())
        return sum(
            (k * e for k, e in zip(kept.subs(epsilon, 1), (frame.x, frame.y, frame.z), strict=True)), 0 * frame.x
        )

    inertial, beam = mechanics.ReferenceFrame("N"), mechanics.ReferenceFrame("B")
    beam.orient_axis(inertial, inertial.z, sympy.Function("theta")(t))
    beam.set_ang_vel(inertial, spin * beam.z)
    place = (x - c * q**2 / 2) * beam.x + phi * q * beam.y
    exact = place.dt(beam).subs(q.diff(), u) + (spin * beam.z).cross(place)
    forces = []
    for velocity in (exact, first_order(exact, beam)):
        (partial,) = mechanics.partial_velocity([velocity], [u], beam)[0]
        acceleration = velocity.dt(beam).subs(q.diff(), u) + (spin * beam.z).cross(velocity)
        product = -first_order(acceleration, beam).dot(first_order(partial, beam))
        product = sympy.expand(first_order(product * beam.x, beam).dot(beam.x))
        forces.append(sympy.collect(product, [q, spin.diff(), u.diff()]))
    return forces, (q, u, spin, x, phi, c)


def shape(x, derivative=0):
    """First mode of a clamped uniform beam with unit modal mass, up to its sign, and derivatives."""
    k = ROOT / LENGTH
    a, b, d, e = np.cosh(k * x), np.sinh(k * x), np.cos(k * x), np.sin(k * x)
    value = (a - d - RATIO * (b - e), b + e - RATIO * (a - d))[derivative]
    return k**derivative * value / np.sqrt(MU * LENGTH)


def shortening(x):
    return quad(lambda s: shape(s, 1) ** 2, 0, x)[0]


def along(integrand):
    return MU * quad(integrand, 0, LENGTH, epsabs=1e-13)[0]


def one_mode(elements):
    slender = mp.Material(E=1e13, nu=0.3, rho=1000.0)
    section = mp.Beam(material=slender, A=1e-3, Iy=1e-5, Iz=1e-9, J=1e-5, theory="euler-bernoulli")
    root = {"root": mp.Interface(group="root", kind="node")}
    model = mp.assemble(beam_mesh(elements, LENGTH), {"beam": section}, root)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=1, truncation=()), name="beam")


def engine_terms(body):
    """Of ``q'' = -k q - h Omega'``: k at the spin, h."""
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="beam", motion=mp.multibody.TimeFunction("t"))
    system = mp.System(bodies={"beam": body}, joints=(hub,))
    small = 1e-3
    rest, bent = (order_n(system, np.array([q, 0.0]), np.array([[0.0, SPIN, SPIN_UP]]))[0][0] for q in (0.0, small))
    return (rest - bent) / small, abs(rest) / SPIN_UP


@pytest.fixture(scope="module")
def symbolic():
    """Stiffness by the spin (1/s^2 of Omega^2) by direct and by premature linearisation, and the spin-up's factor."""
    sympy = pytest.importorskip("sympy")
    forces, (q, u, spin, x, phi, c) = inertia_forces()
    found = []
    for force in forces:
        by_q = sympy.lambdify((x, phi, c), force.coeff(q).coeff(spin, 2))
        by_spin_up = sympy.lambdify((x, phi, c), force.coeff(spin.diff()))
        assert force.coeff(u.diff()) == -(phi**2)
        terms = [along(lambda s, f=f: f(s, shape(s), shortening(s))) for f in (by_q, by_spin_up)]
        found.append((-terms[0], abs(terms[1])))
    return dict(zip(("direct", "premature"), found, strict=True))


def test_premature_linearisation_lacks_the_motion_stiffness(symbolic):
    """The tension of the spin, added afterwards, makes up for what premature linearisation loses."""
    tension = quad(lambda s: MU * (LENGTH**2 - s**2) / 2 * shape(s, 1) ** 2, 0, LENGTH, epsabs=1e-13)[0]
    assert symbolic["premature"][0] == pytest.approx(-1.0, rel=1e-10)
    assert symbolic["premature"][0] + tension == pytest.approx(symbolic["direct"][0], rel=1e-9)
    assert symbolic["direct"][0] == pytest.approx(0.193336, abs=1e-6)  # seven digits given of 1.193336


def test_the_program_linearises_directly(symbolic):
    (direct, spin_up), (premature, _) = symbolic["direct"], symbolic["premature"]
    errors = []
    for elements in (10, 20, 40):
        body = one_mode(elements)
        (k, h), still = engine_terms(body), body.K[0]
        # cubic elements: (ROOT / elements)^4 / 720
        assert still == pytest.approx(EI / MU * (ROOT / LENGTH) ** 4, rel=3e-6)
        errors.append(abs(k - still - direct * SPIN**2))
        assert engine_terms(body.conventional())[0] == pytest.approx(still + premature * SPIN**2, rel=1e-8)
        assert h == pytest.approx(spin_up, rel=1e-5)
    assert errors[-1] < 1e-3 * SPIN**2  # tension constant in each element
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.2)


# ---- constraint: the tip of a double pendulum of point masses slides on a level plane ----


@pytest.fixture(scope="module")
def sliding():
    """Functions of (a, b, a', b'): tip force and accelerations with a multiplier, accelerations by elimination."""
    sympy, mechanics = pytest.importorskip("sympy"), pytest.importorskip("sympy.physics.mechanics")
    a, b, ua, ub = mechanics.dynamicsymbols("a b u_a u_b")
    force, g = sympy.Symbol("lambda"), sympy.Rational(981, 100)
    inertial = mechanics.ReferenceFrame("N")
    fixed = mechanics.Point("O")
    fixed.set_vel(inertial, 0)
    rates = {a.diff(): ua, b.diff(): ub}
    bob = fixed.locatenew("bob", sympy.sin(a) * inertial.x - sympy.cos(a) * inertial.y)
    tip = bob.locatenew("tip", sympy.sin(b) * inertial.x - sympy.cos(b) * inertial.y)
    for point in (bob, tip):
        point.set_vel(inertial, point.pos_from(fixed).dt(inertial).subs(rates))
    particles = [mechanics.Particle(point.name, point, 1) for point in (bob, tip)]
    weights = [(point, -g * inertial.y) for point in (bob, tip)]
    level, sink = tip.pos_from(fixed).dot(inertial.y) + 1, tip.vel(inertial).dot(inertial.y)
    kinematics = [ua - a.diff(), ub - b.diff()]

    free = mechanics.KanesMethod(inertial, [a, b], [ua, ub], kinematics)
    fr, inertia = free.kanes_equations(particles, [*weights, (tip, force * inertial.y)])
    unknown = [ua.diff(), ub.diff(), force]
    matrix, known = sympy.linear_eq_to_matrix([*(fr + inertia), sink.diff().subs(rates)], unknown)
    solved = matrix.LUsolve(known)

    bound = mechanics.KanesMethod(inertial, [a], [ua], kinematics, q_dependent=[b], u_dependent=[ub],
                                  configuration_constraints=[level], velocity_constraints=[sink])  # fmt: skip
    bound.kanes_equations(particles, weights)
    state = (a, b, ua, ub)
    eliminated = bound.mass_matrix.LUsolve(bound.forcing).subs(rates)
    return sympy.lambdify(state, list(solved)), sympy.lambdify(state, list(eliminated))


@pytest.fixture(scope="module")
def sliding_run():
    bob = mp.rigid_body("bob", mass=1.0, centre=np.array([0, -1.0, 0]), inertia=np.zeros((3, 3)),
                        interfaces={"pivot": np.zeros(3), "bob": np.array([0, -1.0, 0])})  # fmt: skip
    upper, lower = 0.4, -np.arccos(1 - np.cos(0.4))
    joints = (
        mp.Joint(name="a", type="revolute", parent="ground", child="upper", angle=upper, rate=0.7, keep_start=True),
        mp.Joint(name="b", type="revolute", parent="upper.bob", child="lower", angle=lower - upper, rate=-0.7),
    )
    plane = mp.multibody.Closure(name="plane", type="point_on_plane", a="ground", b="lower.bob",
                       axis=np.array([0, 1.0, 0]), position=np.array([0, -1.0, 0]))  # fmt: skip
    system = mp.System(
        bodies={"upper": bob, "lower": bob}, joints=joints, closures=(plane,), gravity=-9.81 * np.eye(3)[1]
    )
    return mp.simulate(system, t_end=1.0, output_step=0.05, rtol=1e-11, atol=1e-12)


def test_multiplier_is_kanes(sliding, sliding_run):
    run, (with_multiplier, eliminated) = sliding_run, sliding
    assert np.ptp(run["a.angle"]) > 0.5
    assert np.abs(run["lower.bob.position.y"] + 1).max() < 1e-10
    for row in range(len(run.time)):
        a, b = run["a.angle"][row], run["a.angle"][row] + run["b.angle"][row]
        ua, ub = run["a.rate"][row], run["a.rate"][row] + run["b.rate"][row]
        da, db, force = with_multiplier(a, b, ua, ub)
        np.testing.assert_allclose(eliminated(a, b, ua, ub), [da, db], rtol=1e-9, atol=1e-9)
        # positions and speeds hold the constraint to the projection's tolerance
        np.testing.assert_allclose(run["plane.force"][row], [0, force, 0], rtol=1e-8, atol=1e-8)
        across = da * np.cos(a) - ua**2 * np.sin(a) + db * np.cos(b) - ub**2 * np.sin(b)
        np.testing.assert_allclose(run["lower.bob.acceleration"][row, 0], across, rtol=1e-8, atol=1e-8)
