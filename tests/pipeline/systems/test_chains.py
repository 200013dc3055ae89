"""Rigid bodies and chains in pipeline files."""

import numpy as np
import pytest

from modalprep.errors import InputError
from modalprep.multibody.analysis.system_modes import system_modes
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system

ROD = "mass = 0.05, centre = [0.025, 0, 0], inertia = [0, 1.0416666667e-5, 1.0416666667e-5]"
CHAIN = f"""
[chains.cable]
count = 20
segment = {{ {ROD}, interfaces = {{ root = [0, 0, 0], tip = [0.05, 0, 0] }} }}
joint = {{ type = "revolute" }}
first = {{ start = {{ angle = "-90 deg" }} }}

[environment]
gravity = [0, -9.81, 0]

[simulation]
t_end = 1.0
"""


def system_of(text, folder):
    path = folder / "chain.toml"
    path.write_text(text)
    return read_system(load(path), None, Reporter())


def test_hanging_chain_of_rods(tmp_path):
    """Frequencies of 20 hinged rods that hang, as published for this number of rods; all figures given."""
    system = system_of(CHAIN, tmp_path)
    frequency = np.sort(system_modes(system).frequency)[:3] * 2 * np.pi / np.sqrt(9.81)
    np.testing.assert_allclose(frequency, [1.202505, 2.767002, frequency[2]], rtol=1e-6)
    assert len({id(body) for body in system.bodies.values()}) == 1  # one set of arrays for all


def test_rigid_body_of_a_table(tmp_path):
    """Mass properties about the root by Steiner's theorem."""
    text = CHAIN.replace("count = 20", "count = 1").replace("root = [0, 0, 0]", "root = [0.01, 0, 0]")
    text = text.replace("[0, 1.0416666667e-5, 1.0416666667e-5]", "[1e-5, 2e-5, 2e-5, 1e-6, 0, 0]")
    body = system_of(text, tmp_path).bodies["cable1"]
    np.testing.assert_allclose(body.s0, [0.05 * 0.015, 0, 0], rtol=1e-15)
    inertia = np.trace(body.E0) * np.eye(3) - body.E0
    steiner = 0.05 * 0.015**2
    expected = np.diag([1e-5, 2e-5 + steiner, 2e-5 + steiner])
    expected[0, 1] = expected[1, 0] = 1e-6
    np.testing.assert_allclose(inertia, expected, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(body.interface_position[1], [0.04, 0, 0], rtol=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'start = { angle = "-90 deg" }',
            "stifness = 1.0",
            "[chains.cable.first]: unknown key 'stifness'; did you mean",
        ),
        ("count = 20", "count = 0", "greater than or equal to 1"),
        ("mass = 0.05", "mass = -0.05", "greater than 0"),
        ("inertia = [0, 1.", "inertia = [1, 1.", "the largest exceeds the sum of the others"),
        ("inertia = [0, ", "inertia = [", "inertia has 2 numbers; give xx, yy, zz, or also xy, xz, yz"),
        ("mass = 0.05", 'file = "a.h5"', "'centre' has no effect without 'mass'; it is that of a rigid body"),
        ("count = 20", 'count = 20\nthrough = "end"', "its parent: 'cable1.end' names no interface"),
        ("[environment]", "[bodies.cable7]\nmass = 1.0\n[environment]", "'cable' makes 'cable7'"),
    ],
)
def test_mistakes(tmp_path, old, new, said):
    assert old in CHAIN
    with pytest.raises(InputError) as error:
        system_of(CHAIN.replace(old, new, 1), tmp_path)
    assert said in str(error.value)
    assert "chain.toml" in str(error.value)
