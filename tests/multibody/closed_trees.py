"""Random trees with random closures, and their accelerations by the kernel."""

from typing import get_args

import numpy as np
from closures import closure_of
from multibody.trees import random_state, random_tree
from scipy.spatial.transform import Rotation

from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.closed_loops.responses import gather_responses
from modalprep.multibody.model.constraints import ClosureType, Coupler
from modalprep.multibody.packing.tree import pack

TYPES = get_args(ClosureType)


def random_closures(system, seed, count):
    """Closures of random types between random interfaces or the ground, and a coupler."""
    rng = np.random.default_rng(seed)
    names, found = list(system.bodies), []
    for k in range(count):
        kind = TYPES[(seed + 3 * k) % len(TYPES)]
        one, two = (f"{name}.{rng.choice(['a', 'b'])}" for name in rng.choice(names, 2, replace=False))
        a, b = [(one, two), ("ground", two), (one, "ground")][rng.integers(3)]
        options = {"length": "2 + sin(t)/3"} if kind == "distance" else {}
        options |= {"path": ("1 + t", None, "cos(t)")} if kind == "position" else {}
        options |= {"second_axis": rng.standard_normal(3)} if kind == "universal" else {}
        turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        axis, place = rng.standard_normal((2, 3))
        options |= {"position": place} if "ground" in (a, b) else {}
        found.append(closure_of(name=f"c{k}", type=kind, a=a, b=b, axis=axis, rotation=turn, **options))
    coupled = [f"{name}.{count}" if count > 1 else name for name, count in system.coordinate_counts.items() if count]
    if coupled:
        found.append(Coupler(name="gear", factors=dict.fromkeys(coupled, 1.5), value="t + t**2"))
    return tuple(found)


class Evaluation:
    """One evaluation of the kernel at a state, loops included."""

    def __init__(self, system, y, motion, t=0.3):
        self.system, self.packed = system, pack(system)
        self.loops = Loops(system, self.packed, t_end=1.0)
        self.data = self.packed.data()
        self.udot, self.tau = np.zeros((2, self.packed.nu))
        self.y, self.motion, self.t = y, motion, t

    def solve(self):
        kernel.outward(self.packed.model, self.data, self.y, self.motion)
        self.loops.residual(self.data, self.y, self.motion, self.t)
        assert self.loops.accelerations(self.data, self.tau, self.udot) == -1
        gather_responses(self.loops.work)
        return self.udot


def closed_tree(seed):
    root = ["free", "revolute", "weld", "prescribed"][seed % 4]
    most = 1 if seed % 3 == 0 else 6  # rigid
    system = random_tree(seed, root=root, geometric=seed % 2 == 0, most=most)
    if pack(system).nu == 0:
        system = random_tree(seed, root="free", geometric=seed % 2 == 0, most=most)
    system = system.with_(closures=random_closures(system, seed, 1 + seed % 2))
    y = random_state(system, seed)
    motion = np.random.default_rng(seed).standard_normal((len(pack(system).links), 3))
    return system, y, motion
