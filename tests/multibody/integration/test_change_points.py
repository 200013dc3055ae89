"""Closed loops at change points, where branches of their motion cross: a run keeps its own, and says what it passed.

The full size of the hunt is 200 loops, each with every method; `MODALPREP_FULL=10` takes others.
"""

import re
from typing import get_args

import numpy as np
import pytest
from compare import assert_close
from multibody.change_point_loops import FAMILIES, branch, distance_from, goldberg_linkage, system
from multibody.spatial_loops import planar, rod, spatial_loop
from size import FULL

import modalprep as mp
from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.constraints import Closure, ClosureType, Coupler

METHODS = ("explicit", "rosenbrock", "generalised_alpha")
EVERY = [(method, 10.0**-k) for method in METHODS for k in range(4, 10)]
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
        assert_close(ball[name], hinge[name], max(100 * rtol, 3e-7), name=name)  # output between steps
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


def test_a_loop_of_one_condition_tells_its_change_point():
    """A crank and a rod as long as it: folded up they may slide on, or turn on as one."""
    knee = np.array([np.cos(0.7), np.sin(0.7)])
    loop = spatial_loop(planar([[0, 0], knee, [2 * knee[0], 0]], np.eye(3)), rod, rates=[4.0, -8.0], gravity=(0, 0, 0))
    line = Closure(name="line", type="point_on_plane", a="ground", b="b2.tip", axis=np.array([0, 1.0, 0]))
    run = mp.simulate(loop.with_(closures=(line,)), t_end=0.4, rtol=1e-8, output_step=0.001)
    told = r"at t = (\S+) s .*closure 'line' .*straight on, (.*), and not along the other branch, ([^;]*)"
    time, kept, other = re.search(told, run.notes[0]).groups()
    assert abs(np.interp(float(time), run.time, run["j0.angle"]) + 0.7 - np.pi / 2) < 1e-5  # six digits of the time
    assert_close(ratios(kept) / ratios(kept)[0], [1.0, -2.0], 1e-2)  # three digits
    assert other in ("j0 1", "j0 -1")


def in_line(rates):
    """Bars of 1, 2 and -1 in line, so at a change point: the motions are those by turns of 1, 0, 1 and of 1, -2, -3."""
    return spatial_loop(planar([[0, 0], [1, 0], [3, 0], [2, 0]], np.eye(3)), rod, rates=rates, gravity=(0, 0, 0))


BRANCHES = (np.array([1.0, -1.0, 1.0]), np.array([1.0, -3.0, -1.0]))  # speeds of joints by these turns


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("one", [0, 1])
def test_a_start_at_a_change_point_is_told_and_goes_along_the_branch_of_its_speeds(one, method):
    own, across = BRANCHES[one], BRANCHES[1 - one]
    run = mp.simulate(in_line(4 * own), t_end=0.3, method=method, rtol=1e-5)
    told = r"starts at a change point, where closure 'pin' .*along (.*), and not along the other branch, ([^;]*)"
    kept, other = re.search(told, run.notes[0]).groups()
    assert_close(ratios(kept) / ratios(kept)[0], own, 1e-2)  # three digits
    assert_close(ratios(other) / ratios(other)[0], across, 1e-2)
    assert "taken off" not in run.notes[0]
    assert not any("change point" in note for note in run.notes[1:])
    assert (abs(run["j0.angle"][-1] + run["j1.angle"][-1]) < 1e-5) == (one == 0)  # a parallelogram
    assert run.stats["energy_error"] < 1e-3
    assert "(1, 0, 0), displacement" not in run.message  # what is redundant at the start only


@pytest.mark.parametrize("method", METHODS)
def test_start_speeds_that_no_branch_allows_keep_their_momentum_along_the_nearer_one(method):
    """Conditions do no work on its motions: t^T M (v - given) vanishes, and the least energy is taken off."""
    given = np.array([4.0, 0.0, 0.0])
    loop = in_line(given)
    run = mp.simulate(loop, t_end=0.3, method=method, rtol=1e-5)
    mass = Evaluator(loop).mass(np.zeros(6))
    left = [(t @ mass @ given) / (t @ mass @ t) * t for t in BRANCHES]
    nearer = left[int(np.argmax([v @ mass @ v for v in left]))]
    assert_close([run[f"j{k}.rate"][0] for k in range(3)], nearer, 1e-9)
    assert run.stats["energy_error"] < 1e-4
    row = np.array([2.0, 1.0, -1.0])  # of the end across the line
    way = np.linalg.solve(mass, row)
    closed = given - way * (row @ given) / (row @ way)
    share = float(re.search(r"to neither, (\S+) of the kinetic energy", run.notes[0])[1])
    assert_close(share, 1 - (nearer @ mass @ nearer) / (closed @ mass @ closed), 0.05)  # two digits


def test_a_loop_at_rest_in_a_change_point_tells_both_ways():
    (note,) = mp.simulate(in_line([0.0]), t_end=0.1).notes
    one, other = re.search(r"stays there, and may leave it along (.*) or along (.*)", note).groups()
    assert_close(sorted(float(ratios(way)[2] / ratios(way)[0]) for way in (one, other)), [-1.0, 1.0], 1e-2)


def test_lengths_that_nearly_make_a_change_point_are_told():
    """A coupler that is 1e-8 longer keeps branches apart by its root, as two circles that hardly miss each other."""
    loop = bars(1.0, 2.0 + 1e-8, 1.0, 2.0, 0.7)
    across, round_the_corner = (mp.simulate(loop, t_end=1.2, rtol=rtol) for rtol in (1e-4, 1e-8))
    apart = re.search(r"a change point.* but for (\S+) \(rad or m\)", across.notes[0])
    assert 1e-5 < float(apart[1]) < 1e-3
    assert not any("change point" in note for note in round_the_corner.notes)
    assert abs(across["j0.angle"][-1] + across["j1.angle"][-1]) < 1e-6  # as a parallelogram
    assert abs(round_the_corner["j0.angle"][-1] + round_the_corner["j1.angle"][-1]) > 0.1


def test_loops_without_change_points_have_no_note():
    notes = mp.simulate(bars(1.0, 3.0, 2.5, 3.5, 0.7), t_end=2.0, rtol=1e-6).notes
    assert not any("change point" in note for note in notes)


def examine(seed, methods):
    """Hold runs of a random loop against its branch; returns how many ended with a sentence, and how many told one."""
    rng = np.random.default_rng(seed)
    family = FAMILIES[seed % len(FAMILIES)]
    chain = family(rng)
    loop = system(rng, chain)
    hinges = [joint for joint in loop.joints if joint.name[0] == "j"]
    points = {side: (0.0, None) for side in (1, -1)}
    refused = seen = 0
    for method, rtol in methods:
        run = outcome(loop, t_end=DURATION, rtol=rtol, method=method, output_step=0.02)
        if isinstance(run, SimulationError):
            assert "change point" in str(run), (family.__name__, seed, method, rtol)
            refused += rtol > 1e-8 or method != "generalised_alpha"
            continue
        seen += any("change point" in note for note in run.notes)
        angles = np.column_stack([run[f"{joint.name}.angle"] for joint in hinges])
        length = 1.0 + np.linalg.norm(np.diff(angles, axis=0), axis=1).sum()
        far = np.inf
        for side in points:  # the motion may turn back, and go beyond its start
            if points[side][0] < length:
                points[side] = length, branch(chain, [side * joint.rate for joint in hinges], length)
            far = np.minimum(far, distance_from(points[side][1], angles))
            if far.max() < allowed(rtol):
                break
        assert far.max() < allowed(rtol), (
            f"{family.__name__} {seed}, {method} at {rtol:g}: {far.max():.2g} off its branch"
        )
    return refused, seen


def outcome(loop, **options):
    try:
        return mp.simulate(loop, **options)
    except SimulationError as error:
        return error


def allowed(rtol):
    """Errors along a branch do not count; across it there are those of its points, and of output between steps."""
    return 1e-3 + 100 * rtol


def test_random_loops_keep_their_branch():
    counts = []
    for seed in range(CASES):
        rng = np.random.default_rng(1000 + seed)
        methods = EVERY if FULL else [EVERY[k] for k in rng.choice(len(EVERY), 3, replace=False)]
        counts.append(examine(seed + 100_000 * int(FULL // 2), methods))
    refused, seen = np.sum(counts, axis=0)
    assert refused <= 0.02 * CASES * len(EVERY)
    assert seen > 0


def test_loops_whose_only_row_vanishes_near_the_end_of_a_step():
    """A distance on a sphere, whose rank is zero there, and a folded slider, which had to end a step elsewhere."""
    assert examine(19, [("explicit", 1e-9)])[0] == 0
    assert examine(21, [("generalised_alpha", 1e-4), ("generalised_alpha", 1e-5)])[0] == 0


def test_random_loops_have_all_closures():
    rng = np.random.default_rng(0)
    chains = [family(rng) for family in FAMILIES]
    assert {kind for chain in chains for kind in chain.closures} == set(get_args(ClosureType))
    assert any(isinstance(closure, Coupler) for chain in chains for closure in system(rng, chain).closures)
