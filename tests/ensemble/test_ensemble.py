"""Ensembles: statistics against closed forms, each case as a run of its own, failures, resuming, threads, processes."""

import multiprocessing
import time

import h5py
import numpy as np
import pytest
from ensemble_systems import MASS, STIFFNESS, end_process, oscillator, pendulums

import modalprep as mp
from modalprep.ensemble import Ensemble, draw_cases, read_ensemble, write_ensemble
from modalprep.ensemble.pace import Pace
from modalprep.ensemble.parameters import Parameters
from modalprep.ensemble.simulate import plan
from modalprep.multibody.packing.tree import pack

OMEGA = np.sqrt(STIFFNESS / MASS)  # rad/s
SPAN = {"t_end": 2.0, "output_step": 0.05, "rtol": 1e-10, "atol": 1e-12}
SOLVED = 1e-8  # error of a run at these tolerances, with a margin


def test_mean_and_variance_of_a_random_start():
    """x = x0 cos wt + (v0/w) sin wt with independent x0, v0: mean m cos wt, variance s^2 cos^2 + (r/w)^2 sin^2.

    Textbook: e.g. N. C. Nigam, Introduction to Random Vibrations, MIT Press 1983, free vibration with random initial
    conditions. 1024 Sobol points have these moments to some 1e-3; against the moments of the cases drawn the
    histories hold to the error of the runs, since the motion is linear in the start.
    """
    law = {"slide.displacement": {"normal": [0.3, 0.1]}, "slide.speed": {"normal": [0.0, 0.5]}}
    drawn = draw_cases(law, 1024, seed=5, sampling="sobol")
    found = mp.simulate_many(oscillator(), drawn, channels=["slide.displacement"], **SPAN)
    x, wt = found["slide.displacement"], OMEGA * found.time
    exact = np.outer(drawn["slide.displacement"], np.cos(wt)) + np.outer(drawn["slide.speed"], np.sin(wt)) / OMEGA
    assert set(found.status) == {"done"}
    assert np.allclose(x, exact, rtol=0, atol=SOLVED)
    assert np.allclose(x.mean(axis=0), 0.3 * np.cos(wt), atol=2e-3 * 0.1)
    variance = 0.1**2 * np.cos(wt) ** 2 + (0.5 / OMEGA) ** 2 * np.sin(wt) ** 2
    assert np.allclose(x.var(axis=0), variance, rtol=0.02)
    band = found.percentiles([5, 95])["slide.displacement"]  # of a normal variable: mean -+ 1.6449 deviations
    assert np.allclose(band[1] - band[0], 2 * 1.6448536 * np.sqrt(variance), rtol=0.03)


def test_mean_of_a_random_stiffness():
    """k uniform on [a, b], unit mass: the mean of cos(sqrt(k) t) is 2 [cos s t + s t sin s t] / t^2 from sqrt a to
    sqrt b, over b - a (by substitution of s = sqrt k)."""
    a, b = 40.0 * MASS, 60.0 * MASS
    drawn = draw_cases({"slide.stiffness": {"uniform": [a, b]}}, 256, sampling="latin_hypercube")
    found = mp.simulate_many(oscillator(), drawn, channels=["slide.displacement"], **SPAN)
    t, s = found.time[1:], np.sqrt([[a / MASS], [b / MASS]])
    low, high = 2 * (np.cos(s * t) + s * t * np.sin(s * t)) / t**2
    assert np.allclose(found["slide.displacement"][:, 1:].mean(axis=0), 0.1 * (high - low) / 20, atol=1e-5)


def pendulum_cases():
    return {"shoulder.angle": [0.3, -1.0, 0.0], "stay.stiffness": [2.0, 8.0, 0.0], "push.amplitude": [1.0, 0.0, 2.0],
            "gravity.y": [-9.81, -1.6, -3.7], "elbow.damping": [0.0, 0.1, 0.2]}  # fmt: skip


def oscillator_cases():
    return {"slide.displacement": [0.3, 0.1, 0.2], "slide.stiffness": [50.0, 80.0, 50.0],
            "slide.friction": [0.0, 1.0, 0.0], "gravity.z": [0.0, -9.81, -1.6]}  # fmt: skip


def pinned_cases():
    return {"shoulder.angle": [-0.5, -0.7, -0.6], "elbow.rate": [0.0, 0.1, 0.2], "gravity.y": [-9.81, -9.81, -1.6]}


def pinned():
    """The double pendulum, its end in a slot."""
    slot = mp.multibody.Closure(name="slot", type="point_on_plane", a="ground", b="lower.tip", axis=(1.0, 0, 0),
                                position=(1.5, 0, 0))  # fmt: skip
    return pendulums().with_(closures=(slot,), loads=())


@pytest.mark.parametrize(("make", "make_cases"), [
    (pendulums, pendulum_cases), (oscillator, oscillator_cases), (pinned, pinned_cases),
])  # fmt: skip
def test_every_case_is_the_run_of_its_system(make, make_cases):
    """To the last bit, although cases take over what they do not change of a system that has been run."""
    system, cases, span = make(), make_cases(), {"t_end": 1.0, "output_step": 0.1}
    mp.simulate(system, **span)
    found = mp.simulate_many(system, cases, **span)
    assert len(found) == 3
    for case in range(3):
        changed = Parameters(system, list(cases)).change([values[case] for values in cases.values()])
        run = mp.simulate(changed, **span)
        assert found.message[case] == run.message
        assert found.energy_error[case] == run.stats["energy_error"]
        assert found.channels.keys() == run.channels.keys()
        assert all(np.array_equal(found[name][case], run[name]) for name in run)


def test_cases_of_other_starts_share_the_model_of_their_system():
    options = SPAN | {"method": "auto", "max_step": None, "shortest_event": None}
    task = plan(oscillator(), {"slide.displacement": [0.1, 0.2]}, (), options)
    assert pack(task.system_of(1)).model is pack(task.parameters.system).model


def test_cases_as_a_list():
    cases = pendulum_cases()
    rows = [dict(zip(cases, row, strict=True)) for row in zip(*cases.values(), strict=True)]
    span = {"t_end": 0.3, "channels": ["elbow.angle"]}
    one, other = (mp.simulate_many(pendulums(), given, **span) for given in (cases, rows))
    assert np.array_equal(one["elbow.angle"], other["elbow.angle"])


def test_threads_and_processes_give_the_same():
    drawn = draw_cases({"shoulder.angle": {"uniform": [-1, 1]}, "elbow.rate": {"normal": [0, 1]}}, 20)
    options = {"t_end": 0.5, "channels": ["lower.tip.position"]}
    serial = mp.simulate_many(pendulums(), drawn, workers=1, **options)
    threads = mp.simulate_many(pendulums(), drawn, workers=3, **options)
    processes = mp.simulate_many(pendulums(), drawn, workers=2, pool="processes", **options)
    for other in (threads, processes):
        assert other.status == serial.status == ("done",) * 20
        assert np.array_equal(other["lower.tip.position"], serial["lower.tip.position"])
    assert multiprocessing.active_children() == []


def test_a_case_that_fails_is_reported():
    """A negative stiffness is refused; a callback may raise; the other cases go on."""

    def wind(t, state):
        if state.joint("slide").position > 0.55:
            raise ZeroDivisionError("too far")
        return {}

    system = oscillator(loads=(mp.multibody.Callback(name="wind", function=wind),))
    cases = {"slide.displacement": [0.1, 0.6, 0.2], "slide.stiffness": [50.0, 50.0, -1.0]}
    found = mp.simulate_many(system, cases, t_end=0.2, workers=2)
    assert found.status == ("done", "failed", "failed")
    assert "ZeroDivisionError: too far" in found.message[1]
    assert found.message[2] == "stiffness = -1 must not be negative"
    assert np.isnan(found["slide.displacement"][1:]).all()
    assert np.isnan(found.end).tolist() == [False, True, True]
    assert found.failures[1] == (
        "case 2 (slide.displacement = 0.2, slide.stiffness = -1) failed: stiffness = -1 must not be negative"
    )
    assert np.isfinite(found.percentiles()["slide.displacement"]).all()  # of the first


def test_a_process_that_dies_fails_its_own_case_only(monkeypatch):
    """Others of its block are run again."""
    monkeypatch.setattr("modalprep.ensemble.simulate._block", lambda waiting, workers, seconds: min(4, waiting))
    system = oscillator(loads=(mp.multibody.Callback(name="fault", function=end_process),))
    start = np.full(12, 0.1)
    start[9] = 0.6
    found = mp.simulate_many(system, {"slide.displacement": start}, t_end=0.01, pool="processes", workers=1)
    assert [k for k, status in enumerate(found.status) if status != "done"] == [9]
    assert found.message[9] == "its process ended by itself with exit code 3"
    assert multiprocessing.active_children() == []


def test_a_cluster_gives_the_same():
    distributed = pytest.importorskip("distributed")
    cases = {"slide.displacement": [0.1, 0.2, 0.3]}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0"
    ) as cluster:
        found = mp.simulate_many(oscillator(), cases, t_end=0.1, scheduler=cluster.scheduler_address)
    alone = mp.simulate_many(oscillator(), cases, t_end=0.1)
    assert found.status == ("done",) * 3
    assert np.array_equal(found["slide.displacement"], alone["slide.displacement"])


def test_a_terminal_event_ends_its_case():
    """From 0.1 to 0.3 m it falls through 0.05 m at arccos(0.05 / x0) / w; below, it is there from the start."""
    stop = mp.Event(name="low", when="slide.displacement - 0.05", direction=-1, terminal=True)
    start = np.array([0.1, 0.3, -0.2])
    found = mp.simulate_many(oscillator(), {"slide.displacement": start}, events=[stop], **(SPAN | {"t_end": 0.5}))
    crossing = np.arccos(0.05 / start[:2]) / OMEGA
    assert np.allclose(found.events["low"][:2], crossing, rtol=1e-8)
    assert np.isnan(found.events["low"][2])
    assert found.end == pytest.approx([*crossing, 0.5], rel=1e-8)
    x = found["slide.displacement"]
    for case in range(3):
        assert np.array_equal(np.isfinite(x[case]), found.time <= found.end[case])
    final = found.outcomes()["slide.displacement", "final"]
    assert final[0] == x[0][found.time <= found.end[0]][-1]
    assert found.outcomes()["slide.displacement", "largest"] == pytest.approx([0.1, 0.3, 0.2 * np.cos(np.pi - 2.5)])


def test_notes_of_events_are_said_once_with_the_number_of_cases():
    """What a single run notes: a Python function is looked at so often that crossings may be missed."""
    given = {"events": [mp.Event(name="seen", when=lambda t, state: state.joint("slide").position[0])], "t_end": 0.5}
    found = mp.simulate_many(oscillator(), {"slide.displacement": [0.1, 0.2, 0.3]}, **(SPAN | given))
    alone = mp.simulate(oscillator(), **(SPAN | given)).notes
    assert len(alone) == 1
    assert found.notes == (f"{alone[0]} (3 of 3 cases)",)


def test_a_long_ensemble_says_how_far_it_is(monkeypatch, caplog):
    monkeypatch.setattr("modalprep.ensemble.pace.FIRST", 0.0)
    monkeypatch.setattr("modalprep.ensemble.pace.GROWTH", 0.0)
    mp.simulate_many(oscillator(), {"slide.displacement": np.linspace(0.1, 0.2, 30)}, workers=1, **SPAN)
    assert any(" of 30 cases after 0 s, " in line for line in caplog.messages)
    pace = Pace(0, 10)
    pace.begun -= 100.0
    pace.look(5)
    assert caplog.messages[-1] == "5 of 10 cases after 100 s, 100 s more at this rate"


def test_an_interrupted_ensemble_goes_on(tmp_path):
    """Ctrl-C after some cases: they are in the file, and the next call runs the others only."""
    drawn = draw_cases({"slide.displacement": {"uniform": [0.1, 0.5]}}, 300)
    options = {"t_end": 0.5, "channels": ["slide.displacement"], "workers": 2}
    whole = mp.simulate_many(oscillator(), drawn, **options)
    file, counts = tmp_path / "many.h5", []

    def interrupt(count):
        if count >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mp.simulate_many(oscillator(), drawn, file=file, progress=interrupt, **options)
    kept = read_ensemble(file)
    before = kept.status.count("done")
    assert 20 <= before < 300
    assert kept.status.count("waiting") == 300 - before
    found = mp.simulate_many(oscillator(), drawn, file=file, progress=counts.append, **options)
    assert before < counts[0] <= counts[-1] == 300
    for each in (found, read_ensemble(file)):
        assert each.status == ("done",) * 300
        assert np.array_equal(each["slide.displacement"], whole["slide.displacement"])
    mp.simulate_many(oscillator(), drawn, file=file, progress=pytest.fail, **options)  # nothing is left to run


LICENCE = [False]


def test_failed_cases_run_again(tmp_path):
    """As after a cause outside of the case, such as too little memory; here a thing that is not of the system."""

    def push(t, state):
        if not LICENCE[0] and state.joint("slide").rate > 0.5:
            raise OSError("no licence")
        return {}

    system = oscillator(loads=(mp.multibody.Callback(name="push", function=push),))
    cases, options, counts = {"slide.speed": [0.0, 1.0]}, {"t_end": 0.1, "file": tmp_path / "many.h5"}, []
    assert mp.simulate_many(system, cases, **options).status == ("done", "failed")
    LICENCE[0] = True
    assert mp.simulate_many(system, cases, progress=counts.append, **options).status == ("done", "done")
    assert len(counts) == 1


def test_a_file_of_another_ensemble_is_refused(tmp_path):
    file = tmp_path / "many.h5"
    cases, options = {"slide.speed": [0.0, 1.0]}, {"t_end": 0.1, "file": file}
    mp.simulate_many(oscillator(), cases, **options)
    others = {
        "another system": lambda: mp.simulate_many(oscillator(gravity=(0, 0, 1.0)), cases, **options),
        "other cases": lambda: mp.simulate_many(oscillator(), {"slide.speed": [0.0, 2.0]}, **options),
        "other times": lambda: mp.simulate_many(oscillator(), cases, **(options | {"t_end": 0.2})),
    }
    for what, call in others.items():
        with pytest.raises(mp.InputError, match=f"many.h5: it holds an ensemble of {what}.*; give another file"):
            call()
    (tmp_path / "text.h5").write_text("no")
    with pytest.raises(mp.InputError, match="text.h5 is damaged or not a file of an ensemble"):
        mp.simulate_many(oscillator(), cases, t_end=0.1, file=tmp_path / "text.h5")


def test_an_interrupt_does_not_wait_for_long_cases():
    """Runs in threads look every few hundred steps whether they are still wanted: the second would take minutes."""

    def interrupt(count):
        raise KeyboardInterrupt

    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        mp.simulate_many(
            oscillator(), {"slide.stiffness": [50.0, 1e10]}, t_end=1000.0, method="explicit", output_step=1.0,
            progress=interrupt, workers=2,
        )  # fmt: skip
    assert time.perf_counter() - begin < 20.0


def test_unusable_options():
    system, cases = oscillator(), {"slide.speed": [0.0, 1.0]}
    refused = {
        "simulate_many: workers = 0 must be a positive whole number": {"workers": 0},
        "simulate_many: pool 'thread' does not exist; did you mean 'threads'?": {"pool": "thread"},
        "simulation t_end = -1 must be a positive number": {"t_end": -1},
        "simulation method 'euler' is not one of": {"method": "euler"},
        "the result has no channel 'slide.angle'": {"channels": ["slide.angle"]},
    }
    for sentence, options in refused.items():
        with pytest.raises(mp.InputError) as caught:
            mp.simulate_many(system, cases, **({"t_end": 0.1} | options))
        assert str(caught.value).startswith(sentence)
    with pytest.raises(mp.InputError, match="simulate_many: the system must be of type System, not str"):
        mp.simulate_many("a", cases, t_end=0.1)
    local = oscillator(loads=(mp.multibody.Callback(name="push", function=lambda t, state: {}),))
    with pytest.raises(mp.InputError, match="cannot be sent to other processes"):
        mp.simulate_many(local, cases, t_end=0.1, pool="processes")


@pytest.fixture(scope="module")
def three():
    return mp.simulate_many(
        pendulums(), {"shoulder.angle": [0.3, -1.0, 0.0]}, t_end=0.2, output_step=0.1,
        channels=["elbow.angle", "lower.tip.position", "lower.orientation"],
    )  # fmt: skip


def test_files_keep_everything(three, tmp_path):
    again = read_ensemble(write_ensemble(three, tmp_path / "three.h5", levels=[10, 90]))
    assert again.status == three.status
    assert again.message == three.message
    for table in ("cases", "channels", "events"):
        one, other = getattr(three, table), getattr(again, table)
        assert one.keys() == other.keys()
        assert all(np.array_equal(one[name], other[name]) for name in one)
    with h5py.File(tmp_path / "three.h5") as file:
        assert file["percentiles"].attrs["levels"].tolist() == [10, 90]
        assert np.array_equal(file["percentiles/elbow.angle"][()], three.percentiles([10, 90])["elbow.angle"])


def test_energy_that_does_not_balance_is_a_failure():
    """The audit of `modalprep simulate` for every case: at a loose tolerance, Rosenbrock steps damp 500 rad/s away."""
    cases = {"slide.stiffness": [50.0, 5e5]}
    found = mp.simulate_many(oscillator(), cases, t_end=2.0, rtol=1e-2, method="rosenbrock")
    assert found.energy_error[0] < 0.1 < found.energy_error[1]  # the limit of `modalprep simulate` at this tolerance
    assert found.status == ("done", "done")
    assert found.audit[0] == ""
    (why,) = found.failures
    assert why.startswith("case 1 (slide.stiffness = 500000) failed its audit: the energy balances to 9e-01 only")


def test_components_and_tables(three):
    assert three["lower.tip.position.x"].shape == (3, 3)
    assert list(three.table(["lower.tip.position"])) == [f"lower.tip.position.{c}" for c in "xyz"]
    assert three["lower.orientation.4"].shape == (3, 3)
    with pytest.raises(mp.InputError, match="no channel 'elbow.angel'; did you mean 'elbow.angle'"):
        three["elbow.angel"]
    rows = {row[:2]: row[2:] for row in three.statistics([50], ["elbow.angle"])}
    last = three["elbow.angle"][:, -1]
    expected = (last.mean(), last.std(ddof=1), np.median(last))
    assert rows["elbow.angle", "final"] == pytest.approx(expected, rel=1e-14)
    assert "3 cases: 3 done" in repr(three)
    with pytest.raises(mp.InputError, match="must be numbers from 0 to 100"):
        three.percentiles([101])


def test_data_frame(three):
    pytest.importorskip("pandas")
    frame = three.to_dataframe(["elbow.angle"])
    assert frame.index.names == ["case", "time"]
    assert frame.loc[(1, 0.2), "elbow.angle"] == three["elbow.angle"][1, 2]


def test_labelled_arrays(three):
    pytest.importorskip("xarray")
    data = three.to_xarray()
    assert data["lower.tip.position"].dims == ("case", "time", "axis")
    value = data["lower.tip.position"].sel(case=2, time=0.1, axis="y").item()
    assert value == three["lower.tip.position.y"][2, 1]
    assert data["parameter.shoulder.angle"].values.tolist() == [0.3, -1.0, 0.0]
    assert data["lower.orientation"].shape == (3, 3, 4)


def test_missing_packages_get_a_sentence(three, monkeypatch):
    monkeypatch.setattr("modalprep.extras.find_spec", lambda name: None)
    with pytest.raises(mp.InputError, match=r"needs xarray: pip install 'modalprep\[xarray\]'"):
        three.to_xarray()
    with pytest.raises(mp.InputError, match=r"needs pandas: pip install 'modalprep\[dataframe\]'"):
        three.to_dataframe()


def test_no_case_has_a_value():
    empty = Ensemble(
        cases={"a.b": np.zeros(2)}, time=np.arange(2.0), channels={"x": np.array([[1.0, np.nan], [2.0, np.nan]])},
        status=("done", "done"), message=("", ""), end=np.zeros(2), energy_error=np.zeros(2),
    )  # fmt: skip
    assert np.isnan(empty.percentiles([50])["x"]).tolist() == [[False, True]]
