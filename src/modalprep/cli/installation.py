"""What an installation consists of, and whether it computes what is known in closed form."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from modalprep.extras import EXTRA, missing
from modalprep.program import versions
from modalprep.verdicts.verdict import Requirement, Verdict

CLAMPED = 1.8751040687119611  # first root of 1 + cos(x) cosh(x)
BEAM_ERROR = 2e-4  # of elements that shear, 4e-5: the closed form is that of a beam which does not
SWING_ERROR = 1e-6  # of a run to 1e-8
LIBRARIES = ("numpy", "scipy", "scikit-fem", "meshio", "h5py", "matplotlib", "numba", "pypardiso", "gmsh", "pyvista")


def installation() -> dict[str, str]:
    """Return what the results and their speed depend on: machine, versions, factorisation, compiled code, pictures.

    Examples
    --------
    >>> installation()["Python"] == platform.python_version()
    True
    """
    from modalprep import __version__

    return {
        "modalprep": __version__,
        "Python": platform.python_version(),
        "machine": _machine(),
        "libraries": ", ".join(map(" ".join, versions(LIBRARIES).items())),
        "linear algebra": _blas(),
        "factorisation": _factorisation(),
        "compiled code": _compiled_code(),
        "pictures": _pictures(),
    }


def _machine() -> str:
    from modalprep.linalg.memory import available_memory
    from modalprep.workers.shares import processors

    free = f"{available_memory() / 2**30:.1f} GiB of memory free"
    return f"{platform.system()} {platform.machine()}, {processors()} processors, {free}"


def _blas() -> str:
    found: Any = np.show_config(mode="dicts")
    blas = found["Build Dependencies"]["blas"]
    threads = os.environ.get("OMP_NUM_THREADS")
    return f"{blas.get('name', 'unknown')} {blas.get('version', '')}" + (f", {threads} threads" if threads else "")


def _factorisation() -> str:
    if why := missing("pypardiso", "faster factorisation"):
        return f"SuperLU; {why}"
    return "PARDISO" + (", and MUMPS on disk" if find_spec("mumps") else "")


def _compiled_code() -> str:
    from modalprep.compiler.jit import DISABLED, has_numba, is_cached
    from modalprep.compiler.library import loaded
    from modalprep.multibody.evaluation.evaluate import evaluate

    if DISABLED:
        return "none, as NUMBA_DISABLE_JIT is set: runs take some hundred times as long"
    if loaded() is not None:
        return "of the package"
    if not has_numba():
        return "none, and numba is missing: pip install 'modalprep[build]'"
    return "by numba, kept on the disk" if is_cached(evaluate) else "by numba, in every process anew: no folder for it"


def _pictures() -> str:
    from modalprep.report.pictures.render import drawing_problem

    return drawing_problem() or "can be drawn"


def extras() -> dict[str, bool]:
    """Return whether the libraries of each extra are installed.

    Examples
    --------
    >>> set(extras()) == set(EXTRA.values())
    True
    """
    names = dict.fromkeys(EXTRA.values())
    return {name: all(find_spec(module) for module, extra in EXTRA.items() if extra == name) for name in names}


def trial() -> Verdict:
    """Return whether a small reduction and a small run agree with closed forms.

    Examples
    --------
    >>> trial().word
    'PASS'
    """
    return Verdict((_compared("a clamped beam", _beam, BEAM_ERROR), _compared("a swing", _swing, SWING_ERROR)))


def _compared(name: str, error: Callable[[], float], allowed: float) -> Requirement:
    found = error()
    says = f"off its closed form by {found:.1e} of at most {allowed:g}"
    return Requirement(name=name, result="passed" if found <= allowed else "FAILED", says=says)


def _beam() -> float:
    """Return the relative error of the first frequency of a slender cantilever, reduced to a modal body."""
    from modalprep.examples import uniform_beam

    body = uniform_beam(modes=4, elements=10)
    stiffness, mass, length = 7e10 * 2e-7, 1.2, 10.0  # N m2, kg/m, m
    exact = CLAMPED**2 * np.sqrt(stiffness / mass) / length**2 / (2 * np.pi)
    return abs(float(np.min(body.frequency)) / exact - 1)


def _swing() -> float:
    """Return the error of a pendulum after one period, over its angle: the period is a complete elliptic integral."""
    from scipy.special import ellipk

    from modalprep import Joint, System, rigid_body, simulate

    angle, length, g = 1.0, 1.0, 9.81
    period = float(4 * np.sqrt(length / g) * ellipk(np.sin(angle / 2) ** 2))
    bob = rigid_body("bob", mass=1.0, centre=(0, -length, 0), inertia=np.zeros((3, 3)), interfaces={"root": (0, 0, 0)})
    hinge = Joint(name="hinge", type="revolute", parent="ground", child="bob", axis=(0, 0, 1), angle=angle)
    pendulum = System(bodies={"bob": bob}, joints=(hinge,), gravity=(0, -g, 0))
    run = simulate(pendulum, t_end=period, output_step=period, rtol=1e-8)
    return abs(float(run["hinge.angle"][-1]) - angle) / angle
