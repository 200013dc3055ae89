"""Slider crank with an elastic rod: against a rod of hinged segments, and against Simeon's model."""

import tomllib

import numpy as np
import pytest
import tomli_w
from multibody.mechanisms import slider_crank
from systems.shipped import PIPELINES, run_shipped, shipped

import modalprep as mp
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system

SEGMENTS = 12


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """With geometric stiffness, and without."""
    return list(run_shipped("slider-crank", tmp_path_factory.mktemp("crank")).runs.values())


def segmented(folder):
    """The same file, its rod of rigid segments that bend as it does: no deflection need be small."""
    path = PIPELINES / "slider-crank.toml"
    tables = tomllib.loads(path.read_text())
    section, alloy = tables["properties"]["beam"], tables["materials"]["steel"]
    tables = {key: tables[key] for key in ("bodies", "joints", "closures", "couplers", "simulation")}
    del tables["joints"]["knee"], tables["simulation"]["output"]
    tables["closures"]["pin"]["b"] = f"rod{SEGMENTS}.tip"
    tables["beams"] = {
        "rod": {
            "length": 0.3, "segments": SEGMENTS, "mass_per_length": alloy["rho"] * section["A"],
            "EI": alloy["E"] * section["Iz"], "parent": "crank.end", "root": {"type": "revolute"},
        }
    }  # fmt: skip
    made = folder / "segments.toml"
    made.write_text(tomli_w.dumps(tables))
    return read_system(load(made), folder, Reporter(quiet=True))


def published(system):
    """Simeon's system with the drive of ours, from its dead centre."""
    other, V = slider_crank()
    drive = next(closure for closure in system.closures if closure.name == "drive")
    joints = tuple(joint.with_(displacement=0.45) if joint.name == "slide" else joint for joint in other.joints)
    return other.with_(closures=(other.closures[0], drive), joints=joints), V


def simulated(system, like):
    return mp.simulate(system, t_end=like.time[-1], output_step=like.time[1], rtol=1e-7, method="explicit")


def sag(run):
    """Deflection of the middle from the line through both ends, in the rod's frame."""
    return run["rod.middle.deflection.y"] - run["rod.tip.deflection.y"] / 2


def sag_of_segments(run):
    ends = [run[f"rod{k}.{end}.position"] for k, end in ((1, "root"), (SEGMENTS // 2, "tip"), (SEGMENTS, "tip"))]
    chord, arm = ends[2] - ends[0], ends[1] - ends[0]
    return np.cross(chord, arm)[:, 2] / np.linalg.norm(chord, axis=1)


def rms(values):
    return np.sqrt(np.mean(values**2))


def test_consistent_rod_is_the_rod_of_segments(runs, tmp_path):
    consistent, conventional = runs
    chain = simulated(segmented(tmp_path), consistent)
    exact = sag_of_segments(chain)
    # 12 segments and 8 modes differ by 0.4 %; what the conventional theory forgets is 15 %
    assert rms(sag(consistent) - exact) < 0.008 * rms(exact)
    assert rms(sag(conventional) - exact) > 0.1 * rms(exact)
    force = chain["pin.force"][:, :2]
    np.testing.assert_allclose(consistent["pin.force"][:, :2], force, atol=2e-3 * np.abs(force).max())


def test_published_model_lacks_the_stiffness_of_its_axial_force(runs, tmp_path):
    """Its rod bends in sine waves of constant stiffness; the pin's force reaches 0.051 of the Euler load."""
    run = runs[0]
    system, V = published(shipped("slider-crank", tmp_path)[0])
    other = simulated(system, run)
    waves = other["rod.modal"] @ V[0]
    euler = np.pi**2 * 2e11 * 3.41333e-10 / 0.3**2
    missing = np.abs(run["pin.force"]).max() / euler
    assert rms(sag(run) - waves) < 1.2 * missing * rms(waves)
    assert np.abs(sag(run)).max() == pytest.approx(np.abs(waves).max(), rel=1.2 * missing)
    # the rod shortens by (pi h)^2 / 4 L as it bends by h = 1.6 mm
    np.testing.assert_allclose(run["slide.displacement"], other["slide.displacement"], atol=3e-5)


def test_energy_and_loop(runs):
    for run in runs:
        assert run.stats["energy_error"] < 1e-8
        assert run["pin.violation"].max() < 1e-11  # after a projection to 1e-11 of the size
