"""What would the exact tangent gain in Rosenbrock steps, whose matrix holds modes, hinges, springs and bushings only?

    python benchmarks/exact_jacobian.py [--quick]

Three stiff motions that repeat themselves, a turn each by equal steps: an arm that turns in gravity, a slider crank
with a flexible coupler, a rotor with its weight on bushings. What is missed after the turn, of the largest deflection,
is compared with the same method (ROS34PW2) whose matrix is that of `linearise` at every step. Prints a table, and how
many iterations generalised-alpha takes, which needs a matrix only to contract; then one line of JSON.
"""

from __future__ import annotations

import argparse
import json

import numpy as np

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.multibody import Closure, TimeFunction
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.periodic import periodic_state
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.integration.rosenbrock import ALPHA, GAMMA, STAGES, WEIGHTS, G

GRAVITY = (0, -9.81, 0)


def beam(Iy: float, Iz: float, J: float) -> mp.body.FlexibleBody:
    """Return a steel beam of 1 m with six modes."""
    section = mp.Beam(material=mp.Material(E=2.1e11, nu=0.3, rho=7850.0), A=2e-4, Iy=Iy, Iz=Iz, J=J)
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(beam_mesh(10, 1.0), {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=6), name="beam")


def turning_arm() -> mp.System:
    """Return a flexible arm that turns in gravity at 20 rad/s."""
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam.root", rate=20.0)
    return mp.System(bodies={"beam": beam(1.7e-9, 6.7e-9, 4.6e-9)}, joints=(hinge,), gravity=GRAVITY)


def slider_crank() -> mp.System:
    """Return a crank at 20 rad/s whose coupler is flexible."""
    ends = {"root": np.zeros(3), "pin": np.array([0.1, 0, 0])}
    crank = mp.rigid_body("crank", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=ends)
    law = TimeFunction("pi/2 + 20*t")
    joints = (
        mp.Joint(name="main", type="revolute", parent="ground", child="crank.root", motion=law),
        mp.Joint(name="pin", type="revolute", parent="crank.pin", child="beam.root", angle=-np.pi / 2 - 0.1),
    )
    slot = Closure(name="slot", type="point_on_line", a="ground", b="beam.tip", axis=(1, 0, 0))
    return mp.System(bodies={"crank": crank, "beam": beam(1.7e-9, 6.7e-9, 4.6e-9)}, joints=joints, closures=(slot,))


def rotor() -> mp.System:
    """Return a shaft that turns at 100 rad/s between bushings."""
    stiffness = [0, 1e6, 1e6, 0, 0, 0]
    bearings = [
        mp.multibody.Bushing(name=end, between=("ground", f"beam.{end}"), stiffness=stiffness, position=[x, 0, 0])
        for end, x in (("root", 0.0), ("tip", 1.0))
    ]
    flight = mp.Joint(name="flight", type="free", parent="ground", child="beam.root", angular_velocity=(100.0, 0, 0))
    return mp.System(bodies={"beam": beam(1e-8, 1e-8, 2e-8)}, joints=(flight,), loads=bearings, gravity=GRAVITY)


def exact_steps(system: mp.System, y: np.ndarray, period: float, count: int) -> np.ndarray:
    """Return the state after a period, by steps whose matrix is that of `linearise`."""
    evaluator, h = Evaluator(system, until=2 * period), period / count
    for k in range(count):
        evaluator.set_time(k * h)
        A = mp.linearise(system, y, k * h).A
        chart = Chart(evaluator, y)
        n = len(chart.independent)
        inverse = np.linalg.inv(np.eye(2 * n) - h * G * A)
        stages = np.zeros((STAGES, 2 * n))
        for i in range(STAGES):
            evaluator.set_time(k * h + h * ALPHA[i].sum())
            z = h * ALPHA[i] @ stages
            state = chart.moved(z[:n], z[n:])
            evaluator.load(state)
            udot = evaluator.accelerations(np.zeros(evaluator.nu))
            rate = np.concatenate([state[evaluator.nx :], udot])[
                np.concatenate([chart.independent, chart.independent + evaluator.nu])
            ]
            stages[i] = inverse @ (rate + A @ (h * GAMMA[i] @ stages))
        evaluator.set_time((k + 1) * h)
        z = h * WEIGHTS @ stages
        y = chart.moved(z[:n], z[n:])
    return y


def missed(system: mp.System, period: float, count: int) -> tuple[float, float]:
    """Return what the method misses of a turn, of the largest deflection, and what it misses with the exact matrix."""
    first = periodic_state(system)
    own = Evaluator(system).coordinates("body", "beam")
    options = {"t_end": period, "output_step": period, "start": "periodic"}
    q = mp.simulate(system, method="rosenbrock", step=period / count, **options)["beam.modal"]
    exact = exact_steps(system, first, period, count)[own]
    size = np.abs(first[own]).max()
    return float(np.abs(q[-1] - q[0]).max() / size), float(np.abs(exact - first[own]).max() / size)


def main() -> None:
    """Print the table and the line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer steps")
    counts = (60, 120) if parser.parse_args().quick else (60, 120, 240, 480)
    systems = {"arm": (turning_arm(), 20.0), "slider crank": (slider_crank(), 20.0), "rotor": (rotor(), 100.0)}
    found = {}
    for name, (system, rate) in systems.items():
        period = 2 * np.pi / rate
        for count in counts:
            found[f"{name} {count}"] = errors = missed(system, period, count)
            print(
                f"{name}: {count} steps a turn miss {errors[0]:.1e}, with the exact matrix {errors[1]:.1e}", flush=True
            )
        run = mp.simulate(system, t_end=period, output_step=period, start="periodic", method="generalised_alpha")
        steps = run.stats["steps"] + run.stats["rejected"]
        found[f"{name} iterations"] = round(run.stats["evaluations"] / steps, 2)
        print(
            f"{name}: {found[f'{name} iterations']} evaluations a step of generalised-alpha, of which two are the least"
        )
    print(json.dumps(found))


if __name__ == "__main__":
    main()
