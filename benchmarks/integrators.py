"""How fast are the step methods: ten flexible bodies against real time, and a stiff swing at equal accuracy?"""

from __future__ import annotations

import time

import numpy as np

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section


def link(length: float, modes: int, thickness: float) -> mp.FlexibleBody:
    """Aluminium link of square section, interfaces root and tip."""
    a = thickness
    section = spinup_section(A=a**2, Iy=a**4 / 12, Iz=a**4 / 12, J=0.14 * a**4)
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    model = mp.assemble(beam_mesh(20, length), {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes - 6, truncation=()), name="link")


def chain(body: mp.FlexibleBody, count: int, angle: float = 0.0) -> mp.System:
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


def main() -> None:
    """Print seconds, steps and errors."""
    ten = chain(link(0.5, 12, 0.02), 10, angle=-1.0)
    print(f"ten bodies of {ten.bodies['b0'].n} modes, top {max(ten.bodies['b0'].frequency):.0f} Hz")
    mp.simulate(ten, t_end=0.001, output_step=0.001)
    for options in ({"method": "generalized_alpha", "rtol": 1e-4},
                    {"method": "generalized_alpha", "step": 1e-3, "rtol": 1e-5},
                    {"method": "rosenbrock", "rtol": 1e-4}, {"method": "rosenbrock", "step": 1e-3},
                    {"rtol": 1e-4}, {"method": "explicit", "rtol": 1e-4}):  # fmt: skip
        wall, run = timed(ten, t_end=10.0, output_step=10.0, **options)
        rate = 1e6 * wall / run.stats["evaluations"]
        print(f"  {options}: {10.0 / wall:.2f} x real time, {rate:.1f} us per evaluation at most, {run.message}, "
              f"{run.stats['steps']:.0f} steps, energy error {run.stats['energy_error']:.0e}")  # fmt: skip
    swing = chain(link(0.5, 12, 0.02), 5)
    reference = mp.simulate(swing, t_end=0.4, output_step=0.4, method="explicit", rtol=1e-10, atol=1e-13)
    for method, rtols in (("explicit", (1e-3, 1e-6)), ("generalized_alpha", (1e-3, 1e-4, 1e-5, 1e-6)),
                          ("rosenbrock", (1e-3, 1e-4, 1e-5, 1e-6))):  # fmt: skip
        for rtol in rtols:
            wall, run = min((timed(swing, t_end=0.4, output_step=0.4, method=method, rtol=rtol) for _ in range(3)),
                            key=lambda pair: pair[0])  # fmt: skip
            error = np.abs(run["b4.tip.position"][-1] - reference["b4.tip.position"][-1]).max()
            print(f"  swing, {method}, rtol {rtol:g}: {wall:.3f} s, tip error {error:.1e} m, {run.stats}")


if __name__ == "__main__":
    main()
