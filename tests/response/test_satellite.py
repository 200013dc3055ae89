"""The responses of pipelines/satellite.toml against those of more modes, and without a warning."""

import numpy as np
import pytest
from size import FULL

import modalprep as mp
from modalprep.pipeline.building.model import assemble_pipeline, pipeline_recovery
from modalprep.pipeline.responses.respond import computed
from modalprep.pipeline.schema.load import load_pipeline


@pytest.fixture(scope="module")
def job(project):
    """The pipeline, and ``body(modes, keep)`` of its mesh."""
    pipeline = load_pipeline(project / "pipelines" / "satellite.toml")
    mesh = mp.read_mesh(project / "meshes" / "satellite.msh")
    model = assemble_pipeline(pipeline, mesh)
    recovery = pipeline_recovery(pipeline, mesh, model)

    def body(modes, keep):
        found = mp.craig_bampton(model, modes=modes, keep=keep, truncation=pipeline.reduction.truncation_vectors)
        return mp.flexible_body(model, found, name="satellite", recovery=recovery, second_order_mass=False)

    return pipeline, body


@pytest.fixture(scope="module")
def shipped(job):
    pipeline, body = job
    return body(pipeline.reduction.modes, pipeline.reduction.keep)


def respond(job, body, project):
    return {name: computed(table, body, project / "pipelines")[0] for name, table in job[0].response.items()}


def test_the_file_needs_no_warning(job, shipped, project):
    for name, found in respond(job, shipped, project).items():
        assert found.warnings == (), name


def test_too_few_modes_are_warned_of(job, project):
    """With 29 of 60 modes every response was wrong: the acceleration of the antenna across by 25 to 90 %."""
    found = respond(job, job[1](60, "effective_mass > 0.5% or frequency < 20 Hz"), project)
    assert all(any("drop" in text for text in each.warnings) for each in found.values())
    assert (
        "the body drops 15 modes in the band (21.19, 36.3, 36.79, 37.83, 41.9, ... Hz)" in found["sine_z"].warnings[0]
    )


@pytest.mark.skipif(not FULL, reason="takes half a minute")
def test_every_channel_is_that_of_150_modes(job, shipped, project):
    """Peaks and RMS within 0.2 %, and curves above half of their peak within 0.3 %; 2 % is what an engineer accepts."""
    whole, few = (respond(job, body, project) for body in (job[1](150, "all"), shipped))
    for name, exact in whole.items():
        for k, channel in enumerate(exact.names):
            curve = np.abs(exact.values[:, k])
            mine = np.interp(exact.axis, few[name].axis, np.abs(few[name][channel]))
            if exact.kind == "random":
                curve, mine = np.sqrt(curve), np.sqrt(mine)
            figure = "rms" if exact.kind == "random" else "peak"
            peaks = [x.peak(channel).figures[figure] for x in (few[name], exact)]
            assert peaks[0] == pytest.approx(peaks[1], rel=2e-3), (name, channel)
            high = curve >= curve.max() / 2
            assert np.abs(mine - curve)[high].max() <= 3e-3 * curve.max(), (name, channel)
