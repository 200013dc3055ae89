"""The table of a study: what jobs state against closed forms and their files, and the files that hold it."""

import csv
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bad.good import BEAM, HINGE
from batches import write_grid

from modalprep.cli import main
from modalprep.ensemble.record import Ensemble
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.multibody.results.envelopes import Envelope
from modalprep.multibody.results.result import Result
from modalprep.pipeline.building.built import Built
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.outcome import Outcome
from modalprep.pipeline.responses.respond import Responded
from modalprep.pipeline.run import run_pipeline
from modalprep.pipeline.study.quantities import collected, quantities
from modalprep.pipeline.study.table import study_table
from modalprep.pipeline.study.write import write_study
from modalprep.reduction.error import ReductionError
from modalprep.response.fatigue import Fatigue
from modalprep.response.result import Peak, Response

COLLECT = '[collect]\nchannels = ["hinge.angle", "job.root.position"]\n'
SINE = [("max", 1.0), ("min", -1.0), ("rms", 0.5**0.5), ("final", 0.0)]


@pytest.fixture
def hinged(tmp_path, project):
    """Write a pipeline file of a beam on a hinge with a spin of 2 rad/s; return its path by the text at its end."""

    def make(end=COLLECT):
        text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh")) + HINGE
        text = text.replace('child = "job.root"', 'child = "job.root"\nstart.rate = 2.0')
        (tmp_path / "job.toml").write_text(text + end)
        return tmp_path / "job.toml"

    return make


def stated(path, folder):
    return quantities(run_pipeline(path, folder / "out", Reporter(quiet=True), report=False))


def test_body_states_the_rod_of_the_textbook(tmp_path):
    """12 kg over 10 m: m L^2 / 12 about the middle, and a little of the section; a cantilever's first two modes."""
    body = uniform_beam(modes=3)
    found = quantities(Outcome(tmp_path, built=Built(body, tmp_path / "a.h5", [])))
    assert [found[f"centre_{axis}_m"] for axis in "xyz"] == pytest.approx([5.0, 0.0, 0.0])
    assert found["mass_kg"] == pytest.approx(12.0)
    assert found["inertia_zz_kg_m2"] == pytest.approx(12 * 10**2 / 12, rel=1e-4)
    assert found["mode_count"] == 3
    assert [found[f"frequency_{k}_Hz"] for k in (1, 2, 3)] == body.frequency.tolist()
    assert found["mode_1"] == body.mode_names[0]
    assert found["effective_mass_y"] == pytest.approx(0.613 + 0.188, abs=2e-3)  # of the first two modes in bending
    assert {"end_time_s", "margin", "cases"}.isdisjoint(found)


STATED = """
    cases cases_diverged cases_done cases_failed centre_x_m centre_y_m centre_z_m effective_mass_x effective_mass_y
    effective_mass_z end_time_s energy_error frequency_1_Hz frequency_10_Hz inertia_xx_kg_m2 inertia_yy_kg_m2
    inertia_zz_kg_m2 inertia_xy_kg_m2 inertia_yz_kg_m2 inertia_zx_kg_m2 margin margin_of mass_kg mode_1 mode_10
    mode_count momentum_error not_met reduction_error run_status stable steps synthesis_frequency_1_Hz
    synthesis_frequency_10_Hz system_damping_1 system_damping_10 system_frequency_1_Hz system_frequency_10_Hz verdict
    warnings
""".split()
OF_NAMES = {  # as the documentation writes them
    "arm.strut.N_min_N": "BODY.RECOVERY.COMPONENT_min_UNIT",
    "arm.strut.N_max_N": "BODY.RECOVERY.COMPONENT_max_UNIT",
    "life.a_damage": "FATIGUE.CHANNEL_damage",
    "shock.a_maximax_m_s2": "SRS.CHANNEL_maximax_UNIT",
    "shake.strut.N_peak_N": "RESPONSE.CHANNEL_peak_UNIT",
    "shake.tip.acceleration.x_peak_m_s2": "RESPONSE.CHANNEL_peak_UNIT",
    "touch_first_s": "EVENT_first_s",
}


def peak(place, component, unit, largest, margin=np.nan, block="strut"):
    return Peak(block, place, component, unit, largest, {}, margin)


@pytest.fixture
def everything(tmp_path):
    """An outcome with one of all that jobs state, put together from small records."""
    stats = {"steps": 7, "energy_error": 1e-9, "momentum_error": 1e-12}
    time, many = np.arange(2.0), np.arange(1.0, 13.0)
    run = Result(time=time, channels={}, status="done", message="", stats=stats, events={"touch": np.array([0.5])})
    places = {"places": ("left", "right"), "components": ("N",), "units": ("N",)}
    extremes = {"highest": np.array([[9.0], [3.0]]), "lowest": np.array([[-2.0], [-4.0]])}
    when = dict.fromkeys(("highest_time", "lowest_time"), np.zeros((2, 1)))
    strut = Envelope(body="arm", name="strut", allowable=10.0, **places, **extremes, **when)
    cases = {"cases": {"g": np.zeros(4)}, "time": time, "channels": {}, "end": time[[1, 1, 1, 0]]}
    status = {"status": ("done", "done", "failed", "diverged"), "message": ("",) * 4, "energy_error": np.zeros(4)}
    peaks = (peak("left", "N", "N", 40.0, 0.5), peak("right", "N", "N", 60.0, 0.0),
             peak("acceleration", "x", "m/s^2", 5.0, block="tip"))  # fmt: skip
    response = Response(kind="harmonic", axis=time, names=(), units=(), values=np.zeros((2, 0)), peaks=peaks,
                        inputs=(), input_values=np.zeros((2, 0)))  # fmt: skip
    none = np.zeros(0)
    damage = Fatigue(damage=0.25, duration=1.0, cycles=1.0, ranges=none, means=none, counts=none, largest=1.0,
                     method="rainflow")  # fmt: skip
    spectrum = SimpleNamespace(maximax=np.array([1.0, 8.0]), kind="absolute_acceleration", frequency=time)
    error = ReductionError(up_to=9.0, full=np.ones(1), reduced=np.full(1, 1.01), static=none, sweep=none, dynamic=none)
    modes = SimpleNamespace(frequency=many, damping=many / 100)
    return Outcome(
        tmp_path,
        built=Built(uniform_beam(modes=12), tmp_path / "a.h5", [], error=error),
        synthesised=SimpleNamespace(modes=modes, notes=()),
        analysed=SimpleNamespace(audits=(), notes=(), equilibrium=SimpleNamespace(stable=True), modes=modes),
        simulated=SimpleNamespace(
            main=run, audits=(), notes=(), envelopes=(strut,), ensemble=Ensemble(**cases, **status)
        ),
        responses=(Responded("shake", response, tmp_path / "a.png"),),
        strength=SimpleNamespace(shocks={"shock": {"a": spectrum}}, fatigue={"life": {"a": damage}}, notes=()),
    )


def test_everything_is_stated_by_the_names_of_the_documentation(everything, project):
    found = quantities(everything)
    assert {name for name in found if not re.search(r"_[2-9](?:_Hz)?$", name)} == {*STATED, *OF_NAMES}
    text = (project / "docs" / "how-to" / "batch.md").read_text().partition("{ #table }")[2]
    for name in (*STATED, *OF_NAMES.values()):
        assert f"`{name}`" in text, name


def test_extremes_and_margins_are_those_of_all_places(everything):
    """Of 40 and 60 N in the response, and of +9 and -4 N in the run, of which 10 N are allowed: 10 / 9 - 1."""
    found = quantities(everything)
    assert found["shake.strut.N_peak_N"] == 60.0
    assert (found["arm.strut.N_min_N"], found["arm.strut.N_max_N"]) == (-4.0, 9.0)
    assert (found["margin"], found["margin_of"]) == (0.0, "shake.strut.right.N")
    found = quantities(replace(everything, responses=()))
    assert (found["margin"], found["margin_of"]) == (pytest.approx(1 / 9), "arm.strut.left.N")
    assert (found["shock.a_maximax_m_s2"], found["life.a_damage"]) == (8.0, 0.25)
    assert (found["cases"], found["cases_done"], found["cases_failed"]) == (4, 2, 1)
    assert found["reduction_error"] == pytest.approx(0.01)


@pytest.mark.parametrize(("name", "expected"), SINE)
def test_statistics_of_a_sine(name, expected):
    """Over whole periods; times at which the extremes are, and times closer together in the middle."""
    t = np.unique(np.concatenate([np.linspace(0, 2, 401), np.linspace(0.5, 0.75, 300)]))
    run = Result(time=t, channels={"a.angle": np.sin(2 * np.pi * t)}, status="done", message="")
    found = dict(collected(run, ["a.angle"], [name]))
    assert found == {f"a.angle_{name}_rad": pytest.approx(expected, abs=1e-4)}  # trapezoids of 0.005 s


def test_job_states_its_run_and_what_is_collected(hinged, tmp_path):
    found = stated(hinged(), tmp_path)
    assert found["end_time_s"] == pytest.approx(0.01)
    assert found["run_status"] == "done"
    assert found["hinge.angle_final_rad"] == pytest.approx(0.02, rel=1e-3)  # nothing slows it: 2 rad/s for 0.01 s
    assert found["hinge.angle_min_rad"] == 0.0
    assert found["job.root.position.x_max_m"] == pytest.approx(0.0, abs=1e-12)
    assert found["verdict"] in ("PASS", "PASS WITH WARNINGS")
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    names = list(found)
    assert names.index("mass_kg") < names.index("end_time_s") < names.index("verdict")


def test_command_shows_the_quantities(hinged, tmp_path, capsys):
    assert main(["run", str(hinged()), "--output", str(tmp_path / "out"), "--no-report", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["quantities"]
    assert found["hinge.angle_max_rad"] == found["hinge.angle_final_rad"]


def test_collect_chooses_statistics(hinged, tmp_path):
    found = stated(hinged(COLLECT + 'statistics = ["rms"]\n'), tmp_path)
    assert [name for name in found if name.startswith("hinge.")] == ["hinge.angle_rms_rad"]


def test_unknown_channel_is_refused_before_the_body_is_built(hinged, tmp_path):
    with pytest.raises(InputError, match=r"no channel 'hinge\.angel'.*hinge\.angle"):
        stated(hinged('[collect]\nchannels = ["hinge.angel"]\n'), tmp_path)
    assert not list(tmp_path.rglob("*.h5"))


def test_collect_needs_a_run(hinged, tmp_path):
    file = hinged()
    file.write_text(file.read_text().partition("[joints")[0] + COLLECT)
    with pytest.raises(InputError, match="'collect' has no effect without 'simulation'"):
        stated(file, tmp_path)


ROWS = [
    {"job": "a-2", "parameters": {"modes": 2, "name": "x"}, "status": "done", "cause": "", "seconds": 1.5,
     "verdict": {"word": "PASS"}, "quantities": {"mass_kg": 1 / 3, "mode_1": "1st, bending", "modes": 5}},
    {"job": "=b", "parameters": {"modes": 4, "name": True}, "status": "failed", "cause": 'no "mesh"', "seconds": 0.5},
    {"job": "c", "parameters": {"modes": 6}, "status": "waiting", "quantities": {"margin": float("inf")}},
]  # fmt: skip


def test_columns_are_named_once_and_in_order():
    table = study_table(ROWS)
    assert list(table.columns) == [
        "job", "modes", "name", "status", "verdict", "cause", "seconds", "mass_kg", "mode_1", "modes_result", "margin"
    ]  # fmt: skip
    assert table.parameters == ("modes", "name")
    assert table.columns["modes"] == [2, 4, 6]
    assert table.columns["modes_result"] == [5, None, None]
    assert table.columns["margin"] == [None] * 3


def test_a_parameter_with_the_name_of_a_column_gets_another():
    table = study_table([{"job": "a", "parameters": {"status": 1}, "status": "done"}])
    assert table.columns["parameter_status"] == [1]
    assert table.columns["status"] == ["done"]


def test_parameters_in_one_unit_are_numbers():
    rows = [{"job": f"{E}", "status": "waiting", "parameters": {"E": E, "t": t, "file": f}}
            for E, t, f in (("70 GPa", "2 mm", "3 parts.msh"), ("2.1e2 GPa", 0.002, "b.msh"))]  # fmt: skip
    table = study_table(rows)
    assert table.parameters == ("E_GPa", "t", "file")
    assert table.columns["E_GPa"] == [70.0, 210.0]
    assert table.columns["t"] == ["2 mm", 0.002]


def test_batch_writes_the_table_that_the_documentation_reads(project, tmp_path, monkeypatch):
    """Over both moduli the mass is the same, and frequencies go with the root of the modulus."""
    pytest.importorskip("xarray")
    file = write_grid(project, tmp_path / "arm.toml", reduction__modes=[2, 3], materials__aluminium__E=[70e9, 280e9])
    file.write_text(file.read_text().replace("alloy", "aluminium"))
    assert main(["batch", str(file), "--quiet"]) == 0
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", (project / "docs/how-to/batch.md").read_text(), re.DOTALL)
    scope: dict = {}
    exec(compile(block, "batch.md", "exec"), scope)
    assert len(scope["study"]) == 4
    assert set(scope["best"]["verdict"]) <= {"PASS"}
    over = scope["over"]
    assert over["mass_kg"].sizes == {"reduction.modes": 2, "materials.aluminium.E": 2}
    assert np.ptp(over["mass_kg"].values) == pytest.approx(0.0)
    np.testing.assert_allclose(over["frequency_1_Hz"][:, 1] / over["frequency_1_Hz"][:, 0], 2.0, rtol=1e-6)
    assert "4 of 4 jobs have ended" in (tmp_path / "output" / "index.html").read_text()


def test_pandas_reads_the_same_from_both_files(tmp_path):
    pytest.importorskip("pyarrow")
    import pandas

    names = [file.name for file in write_study(ROWS, tmp_path).files]
    assert names == ["study.csv", "study.parquet", "index.html"]
    one, two = pandas.read_csv(tmp_path / "study.csv"), pandas.read_parquet(tmp_path / "study.parquet")
    assert list(one) == list(two)
    assert one["mass_kg"][0] == two["mass_kg"][0] == 1 / 3
    assert {two.dtypes[name].name for name in ("modes", "modes_result", "seconds", "mass_kg")} == {"float64"}
    assert two["name"].tolist()[:2] == ["x", "true"]
    assert two["job"].tolist() == ["a-2", "=b", "c"]
    assert one["job"].tolist() == ["a-2", "'=b", "c"]  # no formula for a spreadsheet
    assert one["mass_kg"].isna().tolist() == two["mass_kg"].isna().tolist() == [False, True, True]


def test_table_of_a_grid_is_an_array_over_its_parameters(tmp_path):
    pytest.importorskip("xarray")
    import pandas

    rows = [
        {"job": f"{a}{b}", "parameters": {"a": a, "b": b}, "status": "done", "quantities": {"mass_kg": 10 * a + b}}
        for a in (1, 2) for b in (3, 4, 5)
    ]  # fmt: skip
    write_study(rows, tmp_path)
    found = pandas.read_csv(tmp_path / "study.csv").set_index(["a", "b"])[["mass_kg"]].to_xarray()["mass_kg"]
    assert found.dims == ("a", "b")
    assert found.values.tolist() == [[13, 14, 15], [23, 24, 25]]


def test_without_pyarrow_the_rest_is_written_and_it_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr("modalprep.pipeline.study.write.missing", lambda module, what: f"{what} needs {module}")
    (tmp_path / "study.parquet").write_text("of an older study")
    written = write_study(ROWS, tmp_path)
    assert [file.name for file in written.files] == ["study.csv", "index.html"]
    assert written.notes == ("study.parquet needs pyarrow; study.csv has the same",)
    assert not (tmp_path / "study.parquet").exists()


def test_names_of_files_in_other_encodings_are_written(tmp_path):
    row = {"job": "caf\udce9", "folder": f"{tmp_path}/out/caf\udce9", "status": "failed", "cause": "no caf\udce9"}
    for file in write_study([row | {"parameters": {"seed": 2**60}}], tmp_path).files:
        assert file.stat().st_size > 0
    assert 'href="out/caf%E9/caf%E9.log"' in (tmp_path / "index.html").read_text(encoding="utf-8")
    with (tmp_path / "study.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.DictReader(file))["job"] == "caf\\udce9"


def test_csv_has_all_digits_and_a_line_for_each_job(tmp_path):
    write_study(ROWS, tmp_path, "panel")
    with (tmp_path / "panel.csv").open(newline="") as file:
        head, *lines = csv.reader(file)
    assert len(lines) == len(ROWS)
    assert float(lines[0][head.index("mass_kg")]) == 1 / 3
    assert lines[1][head.index("cause")] == 'no "mesh"'
