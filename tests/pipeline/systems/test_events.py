"""Events and water in pipeline files: what is read, and what is refused in one message."""

import numpy as np
import pytest

from modalprep.errors import InputError
from modalprep.multibody.model.hydrodynamics import ImmersedRod
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.changing import read_events
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system
from modalprep.pipeline.systems.systems import simulate_pipeline

FILE = """
[bodies.one]
mass = 2.0
inertia = [0.1, 0.2, 0.2]
interfaces = { root = [0, 0, 0], tip = [1, 0, 0] }

[bodies.other]
mass = 1.0

[joints.one]
type = "free"
child = "one.root"

[joints.other]
type = "weld"
parent = "one.tip"
child = "other"

[closures.floor]
type = "point_on_plane"
a = "ground"
b = "one.tip"
friction_coefficient = 0.2
transition_velocity = 0.01
active = false

[immersed.hull]
bodies = "on*"
diameter = 0.2
normal_drag = 0.9

[events.down]
when = "floor.gap"
direction = "falling"
activates = ["floor"]

[environment]
gravity = [0, 0, -9.81]
water = { density = 1000.0, depths = [0, 10], current = [[1, 0, 0], [0.5, 0, 0]], surface = 2.0 }

[simulation]
t_end = 0.1
"""


def read(text, folder):
    path = folder / "water.toml"
    path.write_text(text)
    source = load(path)
    return source.pipeline, read_system(source, None, Reporter(quiet=True))


def test_every_key_arrives(tmp_path):
    pipeline, system = read(FILE, tmp_path)
    (rod,) = (load for load in system.loads if isinstance(load, ImmersedRod))
    assert (rod.name, rod.body, rod.ends, rod.diameter, rod.normal_drag) == (
        "hull.one",
        "one",
        ("root", "tip"),
        0.2,
        0.9,
    )
    assert (rod.water.density, rod.water.surface) == (1000.0, 2.0)
    np.testing.assert_array_equal(rod.water.current_at(5.0), [0.75, 0, 0])
    (floor,) = system.closures
    assert (floor.friction_coefficient, floor.transition_velocity, floor.active) == (0.2, 0.01, False)
    (event,) = read_events(pipeline.events)
    assert (event.name, event.when, event.direction, event.activates) == ("down", "floor.gap", -1, ("floor",))


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('bodies = "on*"', 'bodies = "un*"', "immersed 'hull': no body is called 'un.'"),
        ("water = {", "# water = {", "there is no water; add .environment.water."),
        ('activates = ["floor"]', 'activates = ["flor"]', "closure 'flor' does not exist; did you mean 'floor'"),
        ('"floor.gap"', '"flor.gap"', "event 'down': no channel 'flor.gap'"),
        ("t_end = 0.1", 't_end = 0.1\nvariables = "momentum"', "events. need a .simulation."),
        ('bodies = "on*"', 'bodies = "other"', "body 'other': interface 'tip' does not exist"),
    ],
)
def test_mistakes_are_one_message(tmp_path, old, new, match):
    path = tmp_path / "water.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(InputError, match=match):
        simulate_pipeline(path, tmp_path, Reporter(quiet=True))
