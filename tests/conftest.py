"""Models shared by the tests; built once."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
from PIL import Image
from size import FULL

import modalprep as mp
from modalprep.report.charts import figures
from modalprep.report.pictures.render import drawing_problem

TESTS = Path(__file__).parent
PROJECT = TESTS.parent
COMPILING = ("test_rigid_systems.py", "test_flexible_systems.py")
WITHOUT_SOLVER = ("fe", "linalg", "reduction")
RUNNING = ("bad", "cli", "fe", "formats", "multibody", "pipeline", "reduction", "supplied", "systems", "verdicts")
draw_chart = figures._drawn


def folder(item):
    """Return the folder of a test in this one; empty of doctests."""
    return item.path.relative_to(TESTS).parts[0] if item.path.is_relative_to(TESTS) else ""


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Have broken pipes raise errors, also after gmsh has had them end the process; leave charts blank, or not.

    Drawing them takes half the time of a short run. Tests of runs look at none, and draw them at the full size only.
    """
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    figures._drawn = blank if folder(item) in RUNNING and not FULL else draw_chart


def blank(_):
    """Return a picture of one point."""
    return Image.new("P", (1, 1))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Compile the solver first, then run what does not need it, for workers that would wait, then the rest in order.

    Hypothesis reads all modules for numbers and words to try; at the reduced size it has its own.
    """
    providers = sys.modules.get("hypothesis.internal.conjecture.providers")
    if providers and not FULL:
        providers._get_local_constants = lambda: providers._local_constants

    def stage(item):
        if item.path.name in COMPILING:
            return 0
        return 1 if folder(item) in WITHOUT_SOLVER else 2

    items.sort(key=stage)


@pytest.fixture(scope="session")
def project() -> Path:
    """Root of the checkout, with meshes and pipelines."""
    return PROJECT


@pytest.fixture(scope="session")
def drawing():
    """Skip the test where VTK cannot draw."""
    if problem := drawing_problem():
        pytest.skip(f"cannot draw: {problem}")


@pytest.fixture
def charts(monkeypatch):
    """Charts that are drawn, for tests of runs that look at them."""
    monkeypatch.setattr(figures, "_drawn", draw_chart)


@pytest.fixture
def rough_edges(monkeypatch):
    """Pictures with rough edges, for tests that do not look at them: smooth ones take twice the time."""
    plotter = pytest.importorskip("pyvista").Plotter
    monkeypatch.setattr(plotter, "enable_anti_aliasing", lambda *_, **__: None)


@pytest.fixture(scope="session")
def bracket_model():
    """The solid bracket in the frame of bolt_a."""
    mesh = mp.read_mesh(PROJECT / "meshes" / "bracket.msh", "mm")
    aluminium = mp.Solid(material=mp.Material(E=70e9, nu=0.33, rho=2700.0))
    return mp.assemble(mesh, {"body": aluminium}, {name: mp.Interface(group=name) for name in ("bolt_a", "bolt_b")})


@pytest.fixture(scope="session")
def bracket_body(bracket_model):
    """Its Craig-Bampton body."""
    reduction = mp.craig_bampton(bracket_model, modes=10)
    return mp.flexible_body(bracket_model, reduction, name="bracket", damping=0.01)
