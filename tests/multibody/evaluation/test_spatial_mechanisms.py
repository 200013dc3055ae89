"""Random spatial mechanisms of known mobility, over- and justly constrained: equations, energy, redundant conditions.

`MODALPREP_FULL=10` makes ten times as many mechanisms as the full size has, and others each time.
"""

import numpy as np
from bad.test_fuzz import bounded
from compare import assert_close
from hypothesis import given
from hypothesis import strategies as st
from multibody.spatial_loops import Pair, bennett, bricard, planar, rod, spatial_loop
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.evaluation.evaluate import evaluate
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import reduced_accelerations

FREEDOMS = {"revolute": 1, "prismatic": 1, "cylindrical": 2, "universal": 2, "spherical": 3}
TRANSLATIONS = ("prismatic", "cylindrical")
DURATION = 0.5  # s, some radians


def unit(rng):
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)


def turn(rng):
    return Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()


def moved(rng, pairs):
    """The same loop elsewhere in space, its joints anywhere on their axes."""
    R, away = turn(rng), rng.standard_normal(3)
    return [Pair(p.type, away + R @ (p.place + rng.uniform(-0.5, 0.5) * p.axis), R @ p.axis) for p in pairs]


def just(rng):
    """Joints anywhere: six of their freedoms close the loop."""
    while True:
        kinds = rng.choice(list(FREEDOMS), rng.integers(4, 8), p=[0.5, 0.1, 0.15, 0.1, 0.15])
        mobility = sum(FREEDOMS[kind] for kind in kinds) - 6
        if mobility in (1, 2) and sum(kind in TRANSLATIONS for kind in kinds) < 3:
            return [_hinge(rng, str(kind)) for kind in kinds], mobility


def flat(rng):
    """Axes normal to a plane."""
    count = int(rng.integers(4, 7))
    return moved(rng, planar(rng.standard_normal((count, 2)), np.eye(3))), count - 3


def round_a_point(rng):
    """Axes through a point."""
    count = int(rng.integers(4, 6))
    axes = [unit(rng) for _ in range(count)]
    return moved(rng, [Pair("revolute", 2.0 * axis, axis) for axis in axes]), count - 3


def of_bennett(rng):
    twist = rng.uniform(0.2, 1.2)
    other = rng.uniform(0.4, 0.9) * min(1 / np.sin(twist), 2.0)
    return moved(rng, bennett(1.0, other, twist, rng.uniform(0.3, 2.5))), 1


def of_bricard(rng):
    return moved(rng, bricard(rng.uniform(0.2, 2.0))), 1


def turned_half(rng):
    """Bricard's line-symmetric linkage: three axes anywhere, and the same turned by half a turn."""
    half = np.diag([-1.0, -1.0, 1.0])
    one = [_hinge(rng) for _ in range(3)]
    other = [Pair("revolute", half @ p.place, half @ p.axis) for p in one]
    return moved(rng, one + other), 1


def mirrored(rng):
    """Bricard's plane-symmetric linkage: two axes in a plane, two on one side of it, and their images."""
    image = np.diag([1.0, 1.0, -1.0])
    first, second, third, fourth = (_hinge(rng) for _ in range(4))
    fifth, sixth = (Pair("revolute", image @ p.place, image @ p.axis) for p in (third, second))
    return moved(rng, [_into_plane(first), second, third, _into_plane(fourth), fifth, sixth]), 1


def _hinge(rng, kind="revolute"):
    return Pair(kind, rng.standard_normal(3), unit(rng), unit(rng) if kind == "universal" else None)


def _into_plane(pair):
    level = pair.axis * [1, 1, 0]
    return Pair(pair.type, pair.place * [1, 1, 0], level / np.linalg.norm(level))


def of_sarrus(rng):
    """Three parallel axes, and three parallel ones across."""
    axes = [unit(rng)] * 3 + [unit(rng)] * 3
    return [Pair("revolute", rng.standard_normal(3), axis) for axis in axes], 1


FAMILIES = (just, just, just, flat, round_a_point, of_bennett, of_bricard, turned_half, mirrored, of_sarrus)


def lump(rng):
    """Bodies of some masses anywhere near, and mostly rods."""

    def body(start, end):
        if rng.random() < 0.5:
            return rod(start, end, rng.uniform(0.2, 2.0))
        mass, x = rng.uniform(0.05, 0.5, 6), rng.standard_normal((6, 3)) * 0.5
        centre = mass @ x / mass.sum()
        second = np.einsum("p,pa,pb->ab", mass, x - centre, x - centre)
        ends = {"root": np.zeros(3), "tip": end - start}
        inertia = np.trace(second) * np.eye(3) - second
        return mp.rigid_body("lump", mass=mass.sum(), centre=centre, inertia=inertia, interfaces=ends)

    return body


def mechanism(seed):
    """A system, and its mobility."""
    rng = np.random.default_rng(seed)
    family = FAMILIES[rng.integers(len(FAMILIES))]
    pairs, mobility = family(rng)
    bodies = lump(rng)
    rates = rng.uniform(-2.0, 2.0, len(pairs) - 1)
    system = spatial_loop(pairs, bodies, rates=rates, gravity=9.81 * unit(rng))
    return system, mobility, family.__name__


def integration(system, **options):
    packed = pack(system)
    loading = Loading(system, packed, DURATION)
    y = np.append(start_state(packed), 0.0)
    times = np.array([0.0, DURATION])
    return Integration(system, packed, loading, y, times, np.zeros(packed.nx), **options)


def accelerations(run, t):
    """Those of the kernel at the state of a run, and those in independent speeds with the full mass matrix."""
    eq, y, loops = run.equations, run.steps.y, run.loading.loops
    ydot = np.zeros(len(y))
    evaluate(eq, t, y, ydot)
    expected = reduced_accelerations(run.system, loops, y[:-1], run.loading.motion, t)
    return ydot[run.packed.nx : -1], expected, run.packed.nu - int(loops.work.rank[0])


def examine(seed):
    """Hold a mechanism against the equations in independent speeds at both ends of a run, and against its energy.

    The conditions said to be redundant are as many as its mobility asks for.
    """
    system, mobility, family = mechanism(seed)
    run = integration(system, method="explicit", rtol=1e-7, atol=1e-9)
    for t in (0.0, DURATION):
        if t > 0.0:
            run.run(lambda times, states: None, None)
        found, expected, freedoms = accelerations(run, t)
        assert freedoms == mobility, f"{family}: {freedoms} freedoms at {t:g} s, expected {mobility}"
        assert_close(found, expected, 1e-7, name=f"{family} at {t:g} s")
    result = mp.simulate(system, t_end=DURATION, rtol=1e-7, method="explicit", output_step=DURATION / 20)
    assert result.status == "done", family
    assert result.stats["energy_error"] < 1e-5, family
    named = result.message.count("displacement of") + result.message.count("rotation of")
    assert len(run.loading.loops.closing.rows) - named == run.packed.nu - mobility, f"{family}: {result.message}"


@bounded(40)
@given(seed=st.integers(0, 1 << 30))
def test_random_mechanisms(seed):
    examine(seed)
