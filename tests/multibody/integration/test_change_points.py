"""Closed loops at change points, where branches of their motion cross: a run keeps its own, and says what it passed.

The full size of the hunt is 200 loops, each with every method; `MODALPREP_FULL=10` takes others.
"""

import re

import numpy as np
import pytest
from compare import assert_close
from multibody.change_point_loops import FAMILIES, branch, distance_from, goldberg_linkage, system
from multibody.spatial_loops import planar, rod, spatial_loop
from size import FULL

import modalprep as mp
from modalprep.errors import SimulationError

# orders 8, 3 and 2: beyond these tolerances an implicit run takes minutes
TOLERANCES = {
    "explicit": (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9), "rosenbrock": (1e-4, 1e-5, 1e-6, 1e-7),
    "generalised_alpha": (1e-4, 1e-5, 1e-6),
}  # fmt: skip
CASES = round(200 * FULL) or 5
DURATION = 2.0  # s, some four radians of each joint


@pytest.mark.parametrize(
    ("method", "rtol"),
    [*(("explicit", 10.0**-k) for k in range(4, 10)), ("rosenbrock", 1e-5), ("generalised_alpha", 1e-5)],
)
def test_goldbergs_linkage_keeps_its_branch(method, rtol):
    """With a ball joint as with the hinge, by whose five conditions no other branch crosses; at every tolerance."""
    options = {"t_end": 4.0, "method": method, "rtol": rtol}
    ball, hinge = (mp.simulate(goldberg_linkage(kind), **options) for kind in ("spherical", "revolute"))
    for k in range(4):
        name = f"j{k}.angle"
        assert_close(ball[name], hinge[name], max(100 * rtol, 1e-5), name=name)  # output between steps
    assert re.search(r"at t = 1\.18\d* s the loops pass a change point, where closure 'pin'", ball.notes[0])
    assert not any("change point" in note for note in hinge.notes)


def bars(crank, coupler, rocker, ground, angle):
    """Four bars in a plane with some speed; the angle of the crank where the loop closes by itself."""
    knee = crank * np.array([np.cos(angle), np.sin(angle)])
    apart = np.array([ground, 0.0]) - knee
    far = np.linalg.norm(apart)
    x = (far**2 + coupler**2 - rocker**2) / (2 * far)
    along = apart / far
    end = knee + x * along + np.sqrt(coupler**2 - x**2) * np.array([-along[1], along[0]])
    return spatial_loop(planar([np.zeros(2), knee, end, [ground, 0.0]], np.eye(3)), rod, rates=[4.0], gravity=(0, 0, 0))


def ratios(text):
    return np.array([float(part.split()[-1]) for part in text.split(" : ")])


def test_a_change_point_is_announced_with_both_branches():
    """Bars of -1, 2 and 1 in line: sums of l phi and of l phi^2 vanish for turns phi of 1, 0, 1 and of 3, 2, -1."""
    run = mp.simulate(bars(1.0, 2.0, 1.0, 2.0, 0.7), t_end=1.2, rtol=1e-8, output_step=0.001)
    (note,) = run.notes
    time, kept, other = re.search(
        r"at t = (\S+) s .*straight on, (.*), and not along the other branch, ([^;]*)", note
    ).groups()
    angle = np.interp(float(time), run.time, run["j0.angle"]) + 0.7
    assert abs(angle - np.pi) < 1e-5  # six digits of the time
    assert_close(ratios(kept) / ratios(kept)[0], [1.0, -1.0, 1.0], 1e-2)  # three digits
    assert_close(ratios(other) / ratios(other)[0], [1.0, -1 / 3, -1.0], 1e-2)


def test_lengths_that_nearly_make_a_change_point_are_told():
    """A coupler that is 1e-8 longer keeps branches apart by its root, as two circles that hardly miss each other."""
    loop = bars(1.0, 2.0 + 1e-8, 1.0, 2.0, 0.7)
    across, round_the_corner = (mp.simulate(loop, t_end=1.2, rtol=rtol) for rtol in (1e-4, 1e-8))
    apart = re.search(r"a change point.* but for (\S+) \(rad or m\)", across.notes[0])
    assert 1e-5 < float(apart[1]) < 1e-3
    assert not round_the_corner.notes
    assert abs(across["j0.angle"][-1] + across["j1.angle"][-1]) < 1e-6  # as a parallelogram
    assert abs(round_the_corner["j0.angle"][-1] + round_the_corner["j1.angle"][-1]) > 0.1


def test_loops_without_change_points_have_no_note():
    assert not mp.simulate(bars(1.0, 3.0, 2.5, 3.5, 0.7), t_end=2.0, rtol=1e-6).notes


def examine(seed, methods):
    """Hold runs of a random loop against its branch; returns how many ended with a sentence, and how many told one."""
    rng = np.random.default_rng(seed)
    family = FAMILIES[seed % len(FAMILIES)]
    chain = family(rng)
    loop = system(rng, chain)
    rates = np.array([joint.rate for joint in loop.joints[: len(chain.axes)]])
    points = {side: None for side in (1, -1)}
    refused = seen = 0
    for method, rtol in methods:
        try:
            run = mp.simulate(loop, t_end=DURATION, rtol=rtol, method=method, output_step=0.02)
        except SimulationError:
            refused += 1
            continue
        seen += bool(run.notes)
        angles = np.column_stack([run[f"j{k}.angle"] for k in range(len(chain.axes))])
        length = 1.0 + np.linalg.norm(np.diff(angles, axis=0), axis=1).sum()
        far = np.inf
        for side in points:  # the motion may turn back, and go beyond its start
            if points[side] is None or len(points[side]) * 0.019 < length:
                points[side] = branch(chain, side * rates, length)
            far = np.minimum(far, distance_from(points[side], angles))
            if far.max() < allowed(rtol):
                break
        assert far.max() < allowed(rtol), (
            f"{family.__name__} {seed}, {method} at {rtol:g}: {far.max():.2g} off its branch"
        )
    return refused, seen


def allowed(rtol):
    """Errors along a branch do not count; across it there are those of its points, and of output between steps."""
    return 1e-3 + 100 * rtol


def test_random_loops_keep_their_branch():
    every = [(method, rtol) for method, tolerances in TOLERANCES.items() for rtol in tolerances]
    counts = []
    for seed in range(CASES):
        rng = np.random.default_rng(1000 + seed)
        methods = every if FULL else [every[k] for k in rng.choice(len(every), 3, replace=False)]
        counts.append(examine(seed + 100_000 * int(FULL // 2), methods))
    refused, seen = np.sum(counts, axis=0)
    assert refused <= 0.02 * CASES * len(every)
    assert seen > 0
