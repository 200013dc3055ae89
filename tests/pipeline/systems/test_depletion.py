"""Depletions, jets and control laws in pipeline files: what each key becomes, and what is said of wrong ones."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.analysis import analyse_pipeline
from modalprep.pipeline.systems.read import read_system

FILE = """
[bodies.rocket]
mass = 10
centre = [1, 0, 0]
inertia = [2, 3, 4]
interfaces = { base = [0.5, 0, 0], nose = [2, 0, 0] }
[bodies.fin]
file = "fin.h5"

[joints.flight]
type = "free"
child = "rocket.base"
[joints.root]
type = "universal"
parent = "rocket.nose"
child = "fin.root"
second_axis = [0, 1, 0]

[depletions.fuel]
body = "rocket"
rate = [{ until = 1, value = 2 }, { value = 0.5 }]
empty = { mass = 5, centre = [1.5, 0, 0], inertia = [1, 1, 1] }
intermediate = [{ mass = 8, centre = [1, 0, 0], inertia = [2, 2, 2] }]
[depletions.coolant]
body = "fin"
mass = "12 - t"
empty = { density_factor = 0.5 }

[jets.main]
at = "rocket.base"
depletion = "fuel"
speed = 100
axis = [-2, 0, 0]
mass_fraction = 0.5
pressure = 3
flow_path = ["rocket.nose"]

[controls.damper]
at = "root"
values = ["-2*root.rate.1 + t", "fin.tip.rotation.z*fin.modal.1"]

[simulation]
t_end = 1
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("depletions")
    mp.write_body(uniform_beam(modes=1, elements=4), path / "fin.h5")
    return path


def system_of(text, folder):
    path = folder / "job.toml"
    path.write_text(text)
    return read_system(load(path), None, Reporter(quiet=True))


def test_what_each_key_becomes(folder):
    system = system_of(FILE, folder)
    fuel, coolant = system.depletions
    assert [level.m for level in fuel.by_mass(system.bodies["rocket"])] == [5.0, 8.0, 10.0]
    np.testing.assert_allclose(fuel.levels[0].s0, [5 * 1.0, 0, 0])  # about the base, at x = 0.5
    assert fuel.mass.breaks == [1.0, 7.0]  # 2 kg, then 3 kg at 0.5 kg/s
    assert fuel.mass(3.0)[0] == pytest.approx(7.0, rel=1e-15)
    assert coolant.levels[0].modal_mass[0, 0] == 0.5
    _, jet = system.loads
    assert jet.flow_points == ("rocket.nose", "rocket.base")
    assert (jet.thrust(0.5), jet.thrust(2.0), jet.thrust(8.0)) == pytest.approx((103.0, 28.0, 0.0), rel=1e-12)
    at = system.with_masses_at(3.0).bodies["rocket"]
    np.testing.assert_allclose(at.s0[0], (1 * 5.0 + 2 * 4.0) / 3)  # a third of the way from 8 kg to 5 kg


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('mass = "12 - t"', 'mass = "12 - t"\nrate = 1.0', "either 'rate' or 'mass'"),
        ("{ density_factor = 0.5 }", "{ density_factor = 0.5, mass = 3 }", "either 'mass', 'density_factor' or 'file'"),
        (
            "{ density_factor = 0.5 }",
            "{ density_factor = 0.5, centre = [0, 0, 1] }",
            "'centre' has no effect without 'mass'; it is that of a rigid body",
        ),
        ("{ density_factor = 0.5 }", "{ mass = 3 }", "for rigid bodies"),
        ("{ density_factor = 0.5 }", '{ file = "no.h5" }', "no.h5 does not exist"),
        ('body = "fin"', 'body = "fan"', "did you mean 'fin'"),
        ("value = 2 }", 'value = "t" }', "pieces of a rate are numbers"),
        ('depletion = "fuel"', 'depletion = "duel"', "did you mean 'fuel'"),
        ('flow_path = ["rocket.nose"]', 'flow_path = ["rocket.knows"]', "rocket.knows"),
        ("root.rate.1", "root.rate", "no channel 'root.rate'"),
        ("root.rate.1", "root.rate.3", "no channel 'root.rate.3'"),
        ("2*root", "2*k*root", "unknown name k"),
        ('at = "root"', 'at = "ground"', "ground"),
        ("second_axis = [0, 1, 0]", "second_axis = [0, 1, 0]\nmotion = [0, 1, 2]", "motion has 3 value"),
    ],
)
def test_wrong_keys_get_one_message(folder, old, new, message):
    assert old in FILE
    with pytest.raises(mp.InputError, match=message):
        mp.simulate(system_of(FILE.replace(old, new), folder), t_end=1.0)


def test_sweep_of_modes(folder, charts):
    """A clamped beam that burns half of its mass: frequencies of the CSV file are sqrt(m0 / m) times the first."""
    text = FILE.partition("[depletions.fuel]")[0].replace("free", "weld").replace("universal", "weld")
    text = text.replace("second_axis = [0, 1, 0]\n", "")
    text += '[depletions.coolant]\nbody = "fin"\nmass = "12 - 2*t"\nempty = { density_factor = 0.2 }\n'
    text += '[analysis]\nabout = "start"\n[analysis.sweep]\nuntil = 3\npoints = 4\nmodes = 1\n'
    path = folder / "sweep.toml"
    path.write_text(text)
    analyse_pipeline(path, folder, Reporter(quiet=True))
    rows = np.loadtxt(folder / "sweep/sweep-sweep.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 2] / rows[0, 2], np.sqrt(12 / (12 - 2 * rows[:, 0])), rtol=1e-9)
    assert (folder / "sweep/sweep-sweep.png").stat().st_size > 1000
