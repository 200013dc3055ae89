"""The systems of the shipped pipeline files, read and run as `modalprep run` does."""

from pathlib import Path

from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system
from modalprep.pipeline.systems.systems import Simulated, simulate_pipeline

PIPELINES = Path(__file__).parents[2] / "pipelines"


def shipped(name: str, folder: Path):
    """System and [simulation] of a pipeline file; bodies it needs are made in `folder`."""
    source = load(PIPELINES / f"{name}.toml")
    return read_system(source, folder, Reporter(quiet=True)), source.pipeline.simulation


def run_shipped(name: str, folder: Path) -> Simulated:
    """Simulate a pipeline file as it stands."""
    return simulate_pipeline(PIPELINES / f"{name}.toml", folder, Reporter(quiet=True))
