"""[supports] of a pipeline file, through the command line."""

import json

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main

pytestmark = pytest.mark.usefixtures("rough_edges")  # pictures are not looked at here

N, LENGTH = 12, 2000.0  # mm
DECK = (
    "".join(f"GRID,{i + 1},,{LENGTH * i / N:.6f},0.,0.\n" for i in range(N + 1))
    + "".join(f"CBAR,{i + 1},5,{i + 1},{i + 2},0.,1.,0.\n" for i in range(N))
    + f"SPC1,1,1234,1\nSPC1,1,23,{N + 1}\nPBAR,5,7,400.,2.+4,3.+4,4.+4\nMAT1,7,2.1+5,,.3,7.85-9\nENDDATA\n"
)
TOML = """
[mesh]
file = "beam.bdf"
length_unit = "mm"
mass_unit = "t"

[interfaces.base]
kind = "support"
{more}
[reduction]
modes = 4

[output]
pictures = 0
"""
OWN = """
[supports.pin]
near = [0, 0, 0]
components = "1234"

[supports.roller]
near = [2000, 1, 1]
components = "32"
axes = [[2, 0, 0], [1, 1, 0]]
"""


@pytest.fixture
def run(tmp_path, capsys):
    def runner(more):
        (tmp_path / "beam.bdf").write_text(DECK)
        (tmp_path / "job.toml").write_text(TOML.format(more=more))
        code = main(["run", str(tmp_path / "job.toml"), "--json"])
        captured = capsys.readouterr()
        return json.loads(captured.out) if code == 0 else captured.err

    return runner


def frequencies(found):
    return mp.read_body(next(file for file in found["files"] if file.endswith(".h5"))).frequency[:4]


def test_the_deck_s_own_supports_and_those_of_the_file_agree(run):
    """A pinned beam of Euler and Bernoulli: (pi / L)^2 sqrt(EI / rho A), first in the softer plane."""
    own, deck = (frequencies(run(more)) for more in (OWN, '[supports.all]\nset = "spc_1"\n'))
    np.testing.assert_allclose(deck, own, rtol=1e-9)
    first = np.pi / 2 / 4.0 * np.sqrt(2.1e11 * 2e-8 / (7850 * 4e-4))
    assert own[0] == pytest.approx(first, rel=1e-3)  # rotary inertia: (pi r / L)^2 / 2 = 1e-4


REFUSED = {
    "no supports": ("", "interface 'base' is of kind 'support', which needs supports"),
    "nodes of the frame": ('group = "spc_1"\n' + OWN, "has no nodes of its own"),
    "nothing named": ('[supports.a]\ncomponents = "1"\n', "plane, cylinder, set; it has none"),
    "set and components": ('[supports.a]\nset = "spc_1"\ncomponents = "1"\n', "by set 'spc_1' has its own"),
    "unknown set": ('[supports.a]\nset = "spc_2"\n', "did you mean 'spc_1'"),
    "mechanism": ('[supports.a]\nnode = 1\ncomponents = "123"\n', "mechanism|without strain"),
}  # fmt: skip


@pytest.mark.parametrize(("more", "said"), REFUSED.values(), ids=list(REFUSED))
def test_refusals(run, more, said):
    found = run(more)
    assert isinstance(found, str)
    assert any(part in found for part in said.split("|")), found
