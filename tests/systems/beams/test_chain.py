"""A chain of six links: accelerations at the start and angles after a second by Pinocchio.

The numbers are those of its articulated-body algorithm (`aba`), which its composite-rigid-body algorithm (`crba`) with
a dense solution confirmed to 1e-13; the angles are `aba` integrated. They were computed once for this test and are not
published; tests/multibody/kernels/test_pinocchio.py compares with the Pinocchio that is installed.
"""

import numpy as np
from multibody.trees import order_n
from systems.shipped import run_shipped, shipped

from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import dense_accelerations

ACCELERATIONS = [0.3669005618, 6.3619115499, -1.1934497618, -7.7940173517, -0.6887351251, 3.1705808259]
ANGLES = [0.38849087, 1.5671674527, -0.1188121237, 0.2292910605, -0.4069655474, -0.0887477548]
OF_THREE = [0.2206252784, 7.2960204627, -1.7589838290]


def test_accelerations(tmp_path):
    """All figures given, also of the first three links alone; by the recursion and by the mass matrix."""
    system, _ = shipped("chain", tmp_path)
    names = list(system.bodies)
    short = system.with_(bodies={name: system.bodies[name] for name in names[:3]}, joints=system.joints[:3])
    for each, expected in ((system, ACCELERATIONS), (short, OF_THREE)):
        y, motion = start_state(pack(each)), np.zeros((len(expected), 3))
        np.testing.assert_allclose(order_n(each, y, motion)[0], expected, atol=6e-11)
        np.testing.assert_allclose(dense_accelerations(each, y), expected, atol=6e-11)


def test_angles_after_a_second(tmp_path):
    """The first is given with eight decimals, the others with ten."""
    (run,) = run_shipped("chain", tmp_path).runs.values()
    found = [run[f"hinge{i}.angle"][-1] for i in range(1, 7)]
    np.testing.assert_allclose(found, ANGLES, atol=6e-9)
    assert run.stats["energy_error"] < 1e-10
