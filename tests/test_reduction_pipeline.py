"""What [reduction] can say, through the command line."""

import json
from pathlib import Path

import pytest

from modalprep.cli import main

TOML = """
[mesh]
file = "{mesh}"

[materials.alloy]
E = 7e10
nu = 0.4
rho = 3000.0

[properties.beam]
type = "beam"
material = "alloy"
A = 4e-4
Iy = 8e-7
Iz = 2e-7
J = 5e-7

[interfaces.root]
group = "root"
kind = "node"

[interfaces.tip]
near = [10, 0, 0]

[reduction]
{reduction}

[output]
pictures = 0
"""


@pytest.fixture
def run(project, tmp_path, capsys):
    def runner(reduction):
        (tmp_path / "job.toml").write_text(TOML.format(mesh=project / "meshes" / "beam.msh", reduction=reduction))
        code = main(["run", str(tmp_path / "job.toml"), "--json"])
        captured = capsys.readouterr()
        return code, json.loads(captured.out) if code == 0 else captured.err

    return runner


@pytest.mark.parametrize("method", ["craig_bampton", "guyan", "irs", "free_interface"])
def test_every_method_gives_the_first_bending_mode(run, method):
    """Clamped root, 1.8751^2 sqrt(EI / rho A) / (2 pi L^2) = 0.6044 Hz; Guyan is 0.5 % high."""
    code, found = run(f'method = "{method}"\nmodes = 4')
    assert code == 0
    assert found["frequency"][0] == pytest.approx(0.60445, rel=6e-3 if method == "guyan" else 5e-4)


def test_error_is_stated(run):
    _, found = run("modes = 8\nup_to = 5.0")
    assert any("error against the full model below 5 Hz, where it has 3 modes" in note for note in found["notes"])


def test_error_is_drawn_in_the_report(run, tmp_path):
    for reduction, shown in (("modes = 8", False), ("modes = 8\nup_to = 5.0", True)):
        _, found = run(reduction)
        page = next(file for file in found["files"] if file.endswith(".html"))
        assert ("<h2>Errors" in Path(page).read_text()) is shown


def test_target_error_picks_the_modes(run):
    rough, fine = (len(run(f"up_to = 30.0\ntarget_error = {e}")[1]["frequency"]) for e in (1e-1, 1e-5))
    assert fine > rough


def test_listed_modes(run):
    _, found = run("modes = 6\nkeep = [1, 3]\ntruncation_vectors = []")
    assert len(found["frequency"]) == 8  # six constraint modes and these two


def test_target_without_a_band(run):
    code, error = run("target_error = 1e-3")
    assert code == 2
    assert "target_error needs up_to" in error
