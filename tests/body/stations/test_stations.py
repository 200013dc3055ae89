"""Stations of bodies: files, exports, refusals, the interface of pipeline files."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.body.frames import in_frame, reroot
from modalprep.errors import InputError
from modalprep.examples import beam_mesh, cantilever_model, large_cantilever
from modalprep.formats.export import lost_in
from modalprep.formats.modalfile import read_body, write_body
from modalprep.pipeline.schema.reduction import ReductionTable


@pytest.fixture(scope="module")
def beam():
    return large_cantilever(modes=2, stations=4)


def test_modal_file_keeps_the_stations(beam, tmp_path):
    found = read_body(write_body(beam, tmp_path / "beam.h5")).stations
    for name in ("parent", "m", "centre", "E", "S", "H", "owner", "part"):
        np.testing.assert_array_equal(getattr(found, name), getattr(beam.stations, name))


def test_files_of_other_bodies_have_no_stations(beam, tmp_path):
    assert read_body(write_body(beam.with_(stations=None), tmp_path / "beam.h5")).stations is None


def test_exports_say_that_they_lose_them(beam):
    assert any("stations" in said for said in lost_in(beam, "sid"))
    assert not any("stations" in said for said in lost_in(beam.with_(stations=None), "sid"))


@pytest.mark.parametrize(
    "use",
    [
        lambda body: in_frame(body, origin=np.ones(3)),
        lambda body: reroot(body, "tip"),
        lambda body: held(body, loads=(mp.multibody.CentralGravity(mu=1e14, centre=(0, 0, -7e6)),)),
        lambda body: held(body, orbit=mp.multibody.Orbit(rate=1e-3, radius=7e6)),
    ],
)
def test_what_does_not_know_stations_refuses_them(beam, use):
    with pytest.raises(InputError, match=r"stations \(large_deflection\) yet"):
        use(beam)


def held(body, **system):
    joint = mp.Joint(name="clamp", type="weld", parent="ground", child="beam")
    return mp.System(bodies={"beam": body}, joints=(joint,), **system)


def test_recoveries_are_those_of_elements_by_mode_displacement():
    model = cantilever_model()
    reduction = mp.craig_bampton(model, modes=2)
    for wanted, match in (
        (mp.fe.Recover(kind="section_force", group="beam"), 'set method = "displacement"'),
        (mp.fe.Recover(kind="displacement", node=3), "of displacement does not work with a body of stations"),
    ):
        recovery = mp.fe.model_recovery(model, beam_mesh(10, 10.0), {"wanted": wanted})
        with pytest.raises(InputError, match=match):
            mp.flexible_body(model, reduction, name="beam", stations=4, recovery=recovery)


def test_pipeline_words_choose_the_stations():
    """By the law of the theory page: .05 (1.75 reach / N)^2."""
    assert ReductionTable().parts == 0
    assert ReductionTable(large_deflection=True).parts == 16
    assert ReductionTable(large_deflection=True, reach=0.6, deflection_error=1e-3).parts == 8
    assert ReductionTable(large_deflection=True, stations=5).parts == 5
    assert ReductionTable(large_deflection=True).truncation == ["interfaces", "inertia", "derivatives"]
    assert ReductionTable().truncation == ["interfaces", "inertia"]
