"""Lagrange's equations in quasi-coordinates, derived symbolically, for the spacecraft with rotors, damper and slosh.

With the body components v and w of the velocity of the bus and of its angular velocity, which are no rates of
coordinates, and the rates of everything else (Meirovitch, Methods of Analytical Dynamics, 1970, section 4.12):

    d/dt dT/dv + w x dT/dv = 0
    d/dt dT/dw + w x dT/dw + v x dT/dv = 0
    d/dt dT/dx' - dT/dx = Q

No acceleration of a point and no partial velocity appears in them, of which the engine is made.
"""

import numpy as np
import pytest
from systems.shipped import shipped

from modalprep.multibody.evaluation.evaluator import Evaluator

BUS, INERTIA, ROTORS = 1000.0, (500.0, 600.0, 800.0), (0.5, 0.5, 0.8)  # with the rotors, locked; kg, kg m^2
DAMPER, SPRING, DASHPOT = 10.0, 40.0, 6.0  # kg, N/m, N s/m, at x = 1.2 m
PROPELLANT, ARM, FRICTION = 60.0, 0.4, 8.0  # kg, m, N m s, at z = 0.5 m
Q, A, B = range(9, 12)  # of the damper and the propellant among x; the others have no coordinates of their own


def kinetic_energy(x, u):
    sympy = pytest.importorskip("sympy")
    v, w, spins, (q, a, b) = (sympy.Matrix(u[k : k + 3]) for k in (0, 3, 6, 9))
    place = {
        DAMPER: sympy.Matrix([sympy.Rational(6, 5), 0, x[Q]]),
        PROPELLANT: ARM * sympy.Matrix([sympy.cos(x[B]) * sympy.cos(x[A]), sympy.cos(x[B]) * sympy.sin(x[A]),
                                        sympy.sin(x[B])]) + sympy.Matrix([0, 0, 0.5]),
    }  # fmt: skip
    energy = BUS * v.dot(v) + sum(i * rate**2 for i, rate in zip(INERTIA, w, strict=True))
    energy += sum(i * (spin**2 + 2 * spin * rate) for i, spin, rate in zip(ROTORS, spins, w, strict=True))
    for mass, r in place.items():
        velocity = v + w.cross(r) + r.jacobian(x[Q:]) * sympy.Matrix([q, a, b])
        energy += mass * velocity.dot(velocity)
    return energy / 2


@pytest.fixture(scope="module")
def accelerations():
    """Function of (x (12,), u (12,)) that returns u': momenta, their change with x, and what is left, solved for u'."""
    sympy = pytest.importorskip("sympy")
    x, u = (sympy.Matrix(sympy.symbols(f"{name}:12")) for name in "xu")
    energy = kinetic_energy(x, u)
    momentum = sympy.Matrix([energy]).jacobian(u).T
    v, w, p, h = u[:3, 0], u[3:6, 0], momentum[:3, 0], momentum[3:6, 0]
    forces = sympy.zeros(12, 1)
    forces[:3, 0], forces[3:6, 0] = -w.cross(p), -w.cross(h) - v.cross(p)
    forces[Q, 0] = energy.diff(x[Q]) - SPRING * x[Q] - DASHPOT * u[Q]
    for angle in (A, B):
        forces[angle, 0] = energy.diff(x[angle]) - FRICTION * u[angle]
    rates = sympy.zeros(12, 1)
    rates[Q:, 0] = u[Q:, 0]
    parts = sympy.lambdify((x, u), (momentum.jacobian(u), forces - momentum.jacobian(x) * rates), cse=True)

    def solve(place, speed):
        mass, right = parts(place, speed)
        return np.linalg.solve(np.array(mass), np.array(right)).ravel()

    return solve


def test_the_engine_obeys_lagrange(accelerations, tmp_path):
    """At random places and speeds; the mass matrix goes from 0.5 kg m^2 (a rotor) to 1e3, its solution to 1e-12."""
    evaluator, random = Evaluator(shipped("spinning-spacecraft", tmp_path)[0]), np.random.default_rng(7)
    places = [*evaluator.coordinates("joint", "damper"), *evaluator.coordinates("joint", "slosh")]
    assert (len(evaluator.start), places) == (13 + 12, [10, 11, 12])
    for _ in range(20):
        x, u = np.zeros(12), random.standard_normal(12) * np.repeat([1.0, 20.0, 1.0], [6, 3, 3])
        x[Q:] = random.uniform(-1, 1, 3)
        turn = random.standard_normal(4)  # of the bus: nothing depends on it
        y = np.concatenate([random.standard_normal(3), turn / np.linalg.norm(turn), np.zeros(3), x[Q:], u])
        evaluator.load(y)
        expected = accelerations(x, u)
        np.testing.assert_allclose(
            evaluator.accelerations(np.zeros(12)), expected, rtol=0, atol=1e-11 * abs(expected).max()
        )
