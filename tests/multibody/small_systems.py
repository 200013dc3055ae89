"""The smallest system of every kind that the solver is compiled for, run by every method."""

import modalprep as mp
from modalprep.examples import small_systems

METHODS = ("auto", "explicit", "rosenbrock", "generalised_alpha")


def check_small_system(kind, method):
    """A millisecond of motion keeps the energy; the linear equations have one pair of states for each speed."""
    system = small_systems()[kind]
    run = mp.simulate(system, t_end=1e-3, method=method)
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-6
    if not system.closures:
        speeds = 1 + system.bodies["rod"].n
        assert mp.linearise(system).A.shape == (2 * speeds, 2 * speeds)
