"""Bodies whose stations are there for large deflections only: ``large_deflection = "auto"``."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import large_cantilever
from modalprep.formats.modalfile import read_body, write_body

HINGE = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", axis=(0, 0, 1))
CLAMP = mp.Joint(name="hinge", type="weld", parent="ground", child="beam")


@pytest.fixture(scope="module")
def beam():
    return large_cantilever(modes=2, stations=8)


def idle(beam, share=1e-4):
    return beam.with_(stations=beam.stations.with_(idle_below=share))


def system(beam, gravity, joint=CLAMP, **more):
    return mp.System(bodies={"beam": beam}, joints=(joint,), gravity=np.array([0, -gravity, 0]), **more)


def fall(*given, **options):
    return mp.simulate(system(*given, **options), t_end=0.8, rtol=1e-4, method="rosenbrock")


def test_a_body_that_stays_small_runs_as_without_stations(beam):
    """The same steps and the same numbers; and where the stations put it, to the error that is allowed."""
    found, plain, with_them = (fall(each, 1.0) for each in (idle(beam), beam.with_(stations=None), beam))
    assert found.stats["evaluations"] == plain.stats["evaluations"]
    np.testing.assert_array_equal(found["beam.modal"], plain["beam.modal"])
    assert 0.02 < np.abs(found["beam.tip.deflection"]).max() / 10 < 0.05  # of its length
    np.testing.assert_allclose(found["beam.tip.position"], with_them["beam.tip.position"], atol=1e-4 * 10)


def test_a_body_that_deflects_far_runs_with_its_stations(beam):
    found, expected = fall(idle(beam), 20.0), fall(beam, 20.0)
    np.testing.assert_array_equal(found["beam.modal"], expected["beam.modal"])
    assert found.notes == expected.notes
    assert any("8 stations leave about" in note for note in found.notes)


@pytest.mark.parametrize("gravity", [1.0, 20.0])
def test_equilibria_and_inverse_dynamics_take_what_they_need(beam, gravity):
    expected = beam if gravity > 2 else beam.with_(stations=None)
    rest = mp.static_equilibrium(system(idle(beam), gravity))
    np.testing.assert_array_equal(rest.y, mp.static_equilibrium(system(expected, gravity)).y)
    assert (rest.system.bodies["beam"].stations is None) == (gravity < 2)
    times = np.linspace(0, 0.5, 3)
    found, other = (
        mp.multibody.inverse_dynamics(system(each, gravity, HINGE), {"hinge": "0*t"}, times)
        for each in (idle(beam), expected)
    )
    np.testing.assert_array_equal(found.force["hinge"], other.force["hinge"])


def test_each_body_is_judged_by_itself(beam):
    """One of two hangs on a soft hinge far away; the other one keeps its modes alone."""
    stiff = beam.with_(stations=beam.stations, K=100 * beam.K, frequency=10 * beam.frequency)
    joints = tuple(mp.Joint(name=name, type="weld", parent="ground", child=name) for name in ("soft", "stiff"))
    bodies = {"soft": idle(beam), "stiff": idle(stiff)}
    rest = mp.static_equilibrium(mp.System(bodies=bodies, joints=joints, gravity=np.array([0, -20.0, 0])))
    assert rest.system.bodies["soft"].stations is not None
    assert rest.system.bodies["stiff"].stations is None


def test_what_does_not_know_stations_leaves_them_out_and_says_so(beam):
    orbit = mp.multibody.Orbit(rate=1e-3, radius=7e6)
    free = mp.Joint(name="free", type="free", parent="ground", child="beam")
    with pytest.raises(InputError, match="the orbit of body 'beam' does not work with a body of stations"):
        mp.System(bodies={"beam": beam}, joints=(free,), orbit=orbit)
    found = mp.System(bodies={"beam": idle(beam)}, joints=(free,), orbit=orbit)
    assert found.bodies["beam"].stations is None
    assert found.notes == (
        "body 'beam' is without its stations, its modes alone move it: the orbit of body 'beam' does not know "
        "stations yet",
    )


def test_modal_file_keeps_what_is_allowed(beam, tmp_path):
    assert read_body(write_body(idle(beam, 1e-3), tmp_path / "beam.h5")).stations.idle_below == 1e-3
    assert read_body(write_body(beam, tmp_path / "other.h5")).stations.idle_below == 0.0
