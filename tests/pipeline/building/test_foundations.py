"""[foundations] and [added_masses] of a pipeline file, through the command line."""

import json
from pathlib import Path

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import beam_mesh, spinup_section
from modalprep.pipeline.building.energies import energy_tables
from modalprep.pipeline.building.inputs import inputs
from modalprep.pipeline.schema.load import load

pytestmark = pytest.mark.usefixtures("rough_edges")  # pictures are not looked at here

N, LENGTH = 12, 2.0
RHO_A, EI = 7850 * 4e-4, 2.1e11 * 3e-8
DECK = (
    "".join(f"GRID,{i + 1},,{LENGTH * i / N:.6f},0.,0.\n" for i in range(N + 1))
    + "".join(f"CBAR,{i + 1},5,{i + 1},{i + 2},0.,1.,0.\n" for i in range(N))
    + "PBAR,5,7,4.-4,3.-8,3.-8,4.-8\nMAT1,7,2.1+11,,.3,7850.\nENDDATA\n"
)
TOML = """
[mesh]
file = "beam.bdf"

[interfaces.base]
kind = "support"

[supports.pin]
near = [0, 0, 0]
components = "1234"

[supports.roller]
near = [2, 0, 0]
components = "23"

[foundations.bed]
group = "pbar_5"
{bed}

[added_masses.cable]
group = "pbar_5"
{cable}

[reduction]
modes = 4

[output]
pictures = 0
"""


@pytest.fixture
def run(tmp_path, capsys):
    def runner(bed='stiffness_per_length = "0.2 N/mm^2"', cable='mass_per_length = "500 g/m"'):
        (tmp_path / "beam.bdf").write_text(DECK)
        (tmp_path / "job.toml").write_text(TOML.format(bed=bed, cable=cable))
        code = main(["run", str(tmp_path / "job.toml"), "--json"])
        captured = capsys.readouterr()
        return json.loads(captured.out) if code == 0 else captured.err

    return runner


def test_pinned_beam_on_a_bed_with_a_cable(run):
    """``w^2 = ((n pi / L)^4 E I + k) / (rho A + m)`` in both planes, to rotary inertia and 12 elements."""
    found = run()
    body = mp.read_body(next(file for file in found["files"] if file.endswith(".h5")))
    n = np.array([1, 1, 2, 2])
    exact = ((n * np.pi / LENGTH) ** 4 * EI + 2e5) / (RHO_A + 0.5)
    np.testing.assert_allclose((2 * np.pi * body.frequency[:4]) ** 2, exact, rtol=2e-3)
    assert body.m == pytest.approx((RHO_A + 0.5) * LENGTH, rel=1e-9)
    page = Path(next(file for file in found["files"] if file.endswith(".html"))).read_text()
    assert "foundation" in page
    assert "added mass" in page


@pytest.mark.parametrize("change", [{"bed": "stiffness_per_length = 3e5"}, {"cable": "mass_per_length = 0.6"}])
def test_a_change_is_a_change_of_the_inputs(run, tmp_path, change):
    """The file of a body is out of date, and no entry of a cache is taken, when its bed or its added mass changes."""
    texts = {}
    for given in ({}, change):
        run(**given)
        texts[len(texts)] = inputs(load(tmp_path / "job.toml"))["options_sha256"]
    assert texts[0] != texts[1]


def test_energy_of_terms():
    """Shares of groups and terms sum up to all; that of the bed is ``k / ((n pi / L)^4 E I + k)``."""
    bed, cable = (
        mp.Foundation(group="beam", stiffness_per_length=300.0),
        mp.AddedMass(group="beam", mass_per_length=0.4),
    )
    root = {"base": mp.Interface(kind="support")}
    pins = {f"pin{x}": mp.Support(near=(x, 0.0, 0.0), components="1234"[: 4 - x // 10]) for x in (0, 10)}
    section = {"beam": spinup_section()}
    model = mp.assemble(beam_mesh(16), section, root, supports=pins, terms={"bed": bed, "cable": cable})
    reduction = mp.craig_bampton(model, modes=2)
    strain, kinetic = energy_tables(model, reduction, mp.flexible_body(model, reduction, name="beam"))
    assert strain.columns == kinetic.columns == ("mode", "Hz", "beam", "bed", "cable", "sum")
    np.testing.assert_allclose([row[-1] for row in (*strain.rows, *kinetic.rows)], 100, rtol=1e-6)  # float32
    EI = spinup_section().material.E * spinup_section().Iz
    assert strain.rows[0][3] == pytest.approx(100 * 300.0 / ((np.pi / 10) ** 4 * EI + 300.0), rel=2e-3)
    assert kinetic.rows[0][4] == pytest.approx(100 * 0.4 / 1.6, rel=2e-3)  # 1.2 kg/m of the beam


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"bed": "stiffness_per_area = 1e6"}, "term 'bed': group 'pbar_5' has line cells, but no triangles or quads"),
        ({"bed": 'stiffness_per_length = "2 N/mm^3"'}, "has another dimension than N/m^2"),
        ({"bed": ""}, r"[foundations.bed]: foundation needs exactly one of stiffness_per_area"),
        ({"cable": "mass_per_length = 1.0\ndepth = 2.0"}, "'depth' has no effect without 'fluid_density'"),
    ],
)
def test_refused(run, given, message):
    assert message in run(**given)
