"""How fast are the step methods: ten flexible bodies against real time, and a stiff swing at equal accuracy?"""

from __future__ import annotations

import time

import numpy as np

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section


def link(length: float, modes: int, thickness: float) -> mp.body.FlexibleBody:
    """Aluminium link of square section, interfaces root and tip."""
    a = thickness
    section = spinup_section(A=a**2, Iy=a**4 / 12, Iz=a**4 / 12, J=0.14 * a**4)
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    model = mp.assemble(beam_mesh(20, length), {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes - 6, truncation=()), name="link")


def chain(body: mp.body.FlexibleBody, count: int, angle: float = 0.0) -> mp.System:
    """Chain on the ground that starts straight and swings; level, it whips its modes out of their range after 3 s."""
    parents = ["ground", *(f"b{i}.tip" for i in range(count - 1))]
    joints = tuple(
        mp.Joint(name=f"j{i}", type="revolute", parent=p, child=f"b{i}", angle=0.0 if i else angle)
        for i, p in enumerate(parents)
    )
    bodies = {f"b{i}": body for i in range(count)}
    return mp.System(bodies=bodies, joints=joints, gravity=np.array([0, -9.81, 0]))


def timed(system: mp.System, **options) -> tuple[float, mp.Result]:
    """Wall time (s) and result of a run."""
    begin = time.perf_counter()
    run = mp.simulate(system, **options)
    return time.perf_counter() - begin, run


def mounted(stiffness: float) -> mp.System:
    """Double pendulum of rigid rods whose elbow is a bushing, stiff but for the turn about z."""
    ends = {"root": np.zeros(3), "end": np.array([1.0, 0, 0])}
    rod = mp.rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3) / 12, interfaces=ends)
    joints = (
        mp.Joint(name="hinge", type="revolute", parent="ground", child="b0"),
        mp.Joint(name="free", type="free", parent="ground", child="b1", position=ends["end"]),
    )
    held = stiffness * np.array([1.0, 1, 1, 1, 1, 0])
    elbow = mp.multibody.Bushing(name="elbow", between=("b0.end", "b1.root"), stiffness=held, damping=0 * held)
    return mp.System(bodies={"b0": rod, "b1": rod}, joints=joints, loads=(elbow,), gravity=np.array([0, -9.81, 0]))


def real_time() -> None:
    """Print how fast ten bodies of twelve modes run against real time."""
    ten = chain(link(0.5, 12, 0.02), 10, angle=-1.0)
    print(f"ten bodies of {ten.bodies['b0'].n} modes, top {max(ten.bodies['b0'].frequency):.0f} Hz")
    mp.simulate(ten, t_end=0.001, output_step=0.001)
    for options in ({"method": "generalised_alpha", "rtol": 1e-4},
                    {"method": "generalised_alpha", "step": 1e-3, "rtol": 1e-5},
                    {"method": "rosenbrock", "rtol": 1e-4}, {"method": "rosenbrock", "step": 1e-3},
                    {"rtol": 1e-4}, {"method": "explicit", "rtol": 1e-4}):  # fmt: skip
        wall, run = timed(ten, t_end=10.0, output_step=10.0, **options)
        rate = 1e6 * wall / run.stats["evaluations"]
        print(f"  {options}: {10.0 / wall:.2f} x real time, {rate:.1f} us per evaluation at most, {run.message}, "
              f"{run.stats['steps']:.0f} steps, energy error {run.stats['energy_error']:.0e}")  # fmt: skip


def work_precision(name: str, system: mp.System, at: str, t_end: float) -> None:
    """Print work and error of every method over the tolerance, work as a share of the explicit method's at 1e-6."""
    options = {"t_end": t_end, "output_step": t_end}
    reference, _ = mp.simulate(system, method="explicit", rtol=1e-9, atol=1e-12, **options), print(name)
    unit, _ = timed(system, method="explicit", rtol=1e-6, **options)
    for method in ("explicit", "generalised_alpha", "rosenbrock", "auto"):
        for rtol in (1e-3, 1e-4, 1e-5, 1e-6):
            wall, run = timed(system, method=method, rtol=rtol, **options)
            error = np.abs(run[at][-1] - reference[at][-1]).max()
            print(f"  {method}, rtol {rtol:g}: {wall / unit:.3f}, error {error:.1e} m, {run.stats['steps']:.0f} steps, "
                  f"{run.stats['evaluations']:.0f} evaluations, {run.message}")  # fmt: skip


def main() -> None:
    """Print speeds, and work against precision where modes or a bushing are stiff."""
    real_time()
    work_precision("five flexible bodies that swing", chain(link(0.5, 12, 0.02), 5), "b4.tip.position", 0.4)
    for stiffness in (1e6, 1e8):
        work_precision(f"elbow of {stiffness:g} N/m", mounted(stiffness), "b1.end.position", 0.5)


if __name__ == "__main__":
    main()
