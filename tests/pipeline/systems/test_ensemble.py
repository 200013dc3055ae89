"""The [ensemble] of a pipeline file: its files and tables, resuming, failing cases, what is refused."""

import csv
import json

import h5py
import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.ensemble import draw_cases, read_ensemble, task
from modalprep.pipeline.systems import ensembles

SYSTEM = """
[bodies.block]
mass = 2.0

[joints.slide]
type = "prismatic"
child = "block.root"
start = { displacement = 0.1 }
stiffness = 50.0

[simulation]
t_end = 0.5
"""
ENSEMBLE = """
[ensemble]
cases = 8
seed = 3
channels = ["slide.displacement", "block.root.position"]
percentiles = [10, 50, 90]

[ensemble.parameters]
"slide.speed" = { normal = [0.0, 0.5] }
"slide.stiffness" = { uniform = [40, 60] }
"""


@pytest.fixture
def run(tmp_path, capsys):
    """Return a function that simulates a file and returns exit code, JSON and the last line of errors."""

    def simulate(text, *options):
        file = tmp_path / "job.toml"
        file.write_text(text)
        code = main(["simulate", str(file), "--json", *options])
        said = capsys.readouterr()
        return code, json.loads(said.out) if said.out else {}, said.err

    return simulate


def table(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_files_and_tables(run, tmp_path, charts):
    code, found, _ = run(SYSTEM + ENSEMBLE)
    folder = tmp_path / "output/job"
    assert code == 0
    assert found["ensemble"] == {"cases": 8, "done": 8, "notes": [], "failures": []}
    names = ["job-run.h5", "job-run.csv", "job-ensemble.h5", "job-ensemble.csv", "job-ensemble-cases.csv",
             "job-ensemble-1.png", "job-ensemble-2.png", "job-run.html"]  # fmt: skip
    assert found["files"] == [str(folder / name) for name in names]
    assert all((folder / name).stat().st_size > 100 for name in names)
    kept = read_ensemble(folder / "job-ensemble.h5")
    drawn = draw_cases({"slide.speed": {"normal": [0.0, 0.5]}, "slide.stiffness": {"uniform": [40, 60]}}, 8, seed=3)
    assert all(np.array_equal(kept.cases[name], drawn[name]) for name in drawn)
    with h5py.File(folder / "job-ensemble.h5") as file:
        band = kept.percentiles([10, 50, 90])
        assert all(np.array_equal(file[f"percentiles/{name}"][()], band[name]) for name in band)
    rows = table(folder / "job-ensemble.csv")
    assert [row["value"] for row in rows[:3]] == ["final", "smallest", "largest"]
    last = kept["slide.displacement"][:, -1]
    assert float(rows[0]["p90"]) == pytest.approx(np.percentile(last, 90), rel=1e-9)
    cases = table(folder / "job-ensemble-cases.csv")
    assert [float(row["slide.displacement final"]) for row in cases] == pytest.approx(last, rel=1e-9)
    assert {row["status"] for row in cases} == {"done"}


def test_each_case_is_a_run_of_its_own_file(run, tmp_path):
    run(SYSTEM + ENSEMBLE)
    found = read_ensemble(tmp_path / "output/job/job-ensemble.h5")
    speed, stiffness = (found.cases[name][5].item() for name in ("slide.speed", "slide.stiffness"))
    start = f"displacement = 0.1, speed = {speed!r}"
    run(SYSTEM.replace("displacement = 0.1", start).replace("stiffness = 50.0", f"stiffness = {stiffness!r}"))
    alone = mp.read_result(tmp_path / "output/job/job-run.h5")
    assert np.array_equal(found["slide.displacement"][5], alone["slide.displacement"])


def test_lists_and_degrees(run, tmp_path):
    """A list with a value for each case, beside a distribution; its angle in degrees."""
    turning = SYSTEM.replace('"prismatic"', '"revolute"').replace("displacement = 0.1", "angle = 0.1")
    text = turning.replace("mass = 2.0", "mass = 2.0\ninertia = [1, 1, 1]")
    parameters = '"slide.angle" = ["0 deg", "90 deg"]\n"slide.damping" = { uniform = [0, 1] }\n'
    ensemble = f'[ensemble]\nchannels = ["slide.angle"]\n[ensemble.parameters]\n{parameters}'
    assert run(text + ensemble)[0] == 0
    found = read_ensemble(tmp_path / "output/job/job-ensemble.h5")
    assert found["slide.angle"][:, 0] == pytest.approx([0.0, np.pi / 2], rel=1e-15)
    assert found.cases["slide.damping"].shape == (2,)


def test_failed_cases_end_with_exit_code_1(run, tmp_path):
    """A negative stiffness: the other cases are run, everything is written, and a sentence names the case."""
    text = SYSTEM + ENSEMBLE.replace("cases = 8\n", "").replace("{ uniform = [40, 60] }", "[50, -1, 60]")
    code, found, said = run(text)
    assert code == 1
    assert "1 of 3 cases of the ensemble failed, the first: case 1 (slide.speed = " in said
    assert "stiffness = -1 must not be negative" in said
    assert len(said.splitlines()) == 1
    assert found["ensemble"]["failed"] == 1
    rows = table(tmp_path / "output/job/job-ensemble-cases.csv")
    assert [row["status"] for row in rows] == ["done", "failed", "done"]
    assert rows[1]["message"] == "stiffness = -1 must not be negative"


def test_finished_cases_are_kept(run, tmp_path, monkeypatch):
    """The same file again runs none; another one runs all of them."""
    ran = []

    def counted(system, **options):
        ran.append(1)
        return mp.simulate(system, **options)

    monkeypatch.setattr(task, "simulate", counted)
    for text, count in ((SYSTEM + ENSEMBLE, 8), (SYSTEM + ENSEMBLE, 0), (SYSTEM + ENSEMBLE.replace("3", "4", 1), 8)):
        ran.clear()
        assert run(text)[0] == 0
        assert len(ran) == count


def test_processes_give_the_numbers_of_threads(run, tmp_path, capsys):
    """To the last bit, as each case is the same sums; where they run is no part of what the results are of."""
    file, chosen = tmp_path / "output/job/job-ensemble.h5", 'pool = "processes"\nworkers = 2\nseed'
    assert run(SYSTEM + ENSEMBLE)[0] == 0
    threads = read_ensemble(file)
    file.unlink()
    assert run(SYSTEM + ENSEMBLE.replace("seed", chosen))[0] == 0
    processes = read_ensemble(file)
    assert all(np.array_equal(processes[name], threads[name]) for name in ("slide.displacement", "block.root.position"))
    assert main(["simulate", str(tmp_path / "job.toml")]) == 0
    assert "8 cases were finished before" in capsys.readouterr().out


@pytest.mark.parametrize("where", [{"pool": "processes", "workers": 3}, {"scheduler": "tcp://127.0.0.1:1"}])
def test_where_the_cases_run(run, monkeypatch, where):
    """As the table says, but in the threads of its own where it is a job of a batch."""
    found, real = [], ensembles.run_cases

    def ran(*given, progress, **options):
        found.append(options)
        return real(*given, progress=progress)

    monkeypatch.setattr(ensembles, "run_cases", ran)
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in where.items())
    assert run(SYSTEM + ENSEMBLE.replace("seed", lines + "seed"))[0] == 0
    monkeypatch.setattr("multiprocessing.parent_process", lambda: "batch")
    assert run(SYSTEM + ENSEMBLE.replace("seed", lines + "seed"))[0] == 0
    assert found == [{"pool": "threads", "workers": None, "scheduler": None} | where, {}]


def test_run_and_batch_do_ensembles_too(tmp_path, capsys):
    file = tmp_path / "job.toml"
    file.write_text(SYSTEM + ENSEMBLE)
    assert main(["run", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ensemble"]["done"] == 8
    assert main(["run", str(file)]) == 0
    said = capsys.readouterr().out
    assert "8 cases were finished before" in said
    assert "Statistics of 8 cases" in said


REFUSED = {
    "'scheduler.json' is no address; write for example 'tcp://host:8786'": (
        "seed",
        'scheduler = "scheduler.json"\nseed',
    ),
    "'pool' has no effect beside 'scheduler'": ("seed", 'scheduler = "tcp://a:1"\npool = "processes"\nseed'),
    "[ensemble.workers]: input should be greater than or equal to 1": ("seed", "workers = 0\nseed"),
    "[ensemble]: an ensemble of distributions needs the number of 'cases'": ("cases = 8\n", ""),
    "[ensemble.cases]: input should be greater than or equal to 1": ("cases = 8", "cases = 0"),
    "unknown key 'normel'; did you mean 'normal'?": ("{ normal", "{ normel"),
    "a distribution needs exactly one of normal, uniform": ("{ normal =", "{ uniform = [0, 1], normal ="),
    "distribution of 'slide.speed': normal needs 2 numbers": ("[0.0, 0.5]", "[0.0]"),
    "distribution of 'slide.stiffness': uniform cannot have lower, upper = [60.0, 40.0]": ("[40, 60]", "[60, 40]"),
    "parameter 'slide.sped': did you mean 'speed'?": ("slide.speed", "slide.sped"),
    "parameter 'slid.speed' names no joint, load or closure; did you mean 'slide'?": ("slide.speed", "slid.speed"),
    "the result has no channel 'slide.angle'": ('"slide.displacement"', '"slide.angle"'),
    "'slide.speed': '1 deg' has another dimension than m/s": ("[0.0, 0.5]", '["1 deg", 0.5]'),
    "'slide.stiffness' has 2 values, but there are 8 cases; give one for each": ("{ uniform = [40, 60] }", "[40, 60]"),
    "input should be 'random', 'latin_hypercube' or 'sobol'": ("seed = 3", 'sampling = "sobel"'),
    "[ensemble] needs a [simulation] in joint variables": ("[ensemble]\n", "[analysis]\n[ensemble]\n"),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_refused(sentence, run, tmp_path):
    text = SYSTEM + ENSEMBLE.replace(*REFUSED[sentence])
    if sentence.startswith("[ensemble] needs"):
        text = text.replace("[simulation]\nt_end = 0.5\n", "")
    code, _, said = run(text)
    assert code == 2
    assert sentence in said.replace("job.toml: [ensemble]: ", "")
    assert len(said.splitlines()) == 1
    assert not [file for file in tmp_path.glob("output/**/*") if file.is_file()]
