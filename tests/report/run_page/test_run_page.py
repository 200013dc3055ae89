"""The page of a run: what it says is what the result has, and its box says when an audit fails."""

import html
import json
import re

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import small_systems
from modalprep.multibody.evaluation.impact import Impact
from modalprep.report import RunPage, write_run_page
from modalprep.report.run_page.channels import UNITS, channel_unit
from modalprep.report.run_page.curves import ABOVE, BELOW, HEIGHT, MOST, ROOM, curves
from modalprep.report.run_page.parts import audit_rows, extremes


def words(page):
    """The text of a page without scripts and styles, and its tables as CSV texts by name."""
    text = re.sub(r"<(script|style|pre).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", text)).split())


@pytest.fixture(scope="module")
def swung():
    """A rigid pendulum, and its run of half a second."""
    system = small_systems()["rigid bodies in trees"].with_(gravity=np.array([0, -9.81, 0]))
    return system, mp.simulate(system, t_end=0.5, output_step=0.01, rtol=1e-7)


def test_page_says_how_the_run_was_made_and_what_its_audits_found(swung, tmp_path):
    system, run = swung
    text = words(
        write_run_page(RunPage(run, system=system, rtol=1e-7, notes=["a warning of mine"]), tmp_path / "run.html")
    )
    assert text.count("PASS") == 1
    for said in (f"steps {run.stats['steps']}", f"evaluations of the equations {run.stats['evaluations']}",
                 "relative tolerance 10⁻⁷", f"method at the end {run.stats['method']}", "a warning of mine",
                 "energy balance", "Prepared", "Checked", "Approved"):  # fmt: skip
        assert said in text, said
    for name, body in system.bodies.items():
        assert re.search(rf"{re.escape(name)} {body.m:.5g}", text)
    for joint in system.joints:
        assert f"{joint.name} {joint.type} {joint.parent} {joint.child}" in text
    checks = text.index("Provenance") if "Provenance" in text else len(text)
    assert re.findall(r"\d[eE][+-]?\d+\b", text[:checks]) == []


def test_failed_audits_fail_the_page(swung, tmp_path):
    system, run = swung
    size = max(np.abs(run[name]).max() for name in run if name.startswith("energy."))
    wrong = run.with_(
        stats=run.stats | {"energy_error": 0.5}, channels=run.channels | {"energy.error": 0.5 * size + run.time}
    )
    text = words(write_run_page(RunPage(wrong, system=system, rtol=1e-7), tmp_path / "wrong.html"))
    assert "FAIL" in text
    assert "the energy balances to" in text
    lost = run.with_(status="diverged", message="it turned over")
    assert "the run did not reach its end: it turned over" in words(write_run_page(lost, tmp_path / "lost.html"))


def test_gaps_of_closures_count_while_they_carry_a_force():
    """Before an event closes it, the parts are 0.25 m apart, which is no error; one that never closes has no gap."""
    t = np.linspace(0.0, 1.0, 5)
    force = np.where(t[:, None] > 0.5, [[3.0, 0, 0]], 0.0)
    channels = {"dock.violation": np.where(t > 0.5, 1e-9, 0.25), "dock.force": force, "dock.torque": 0 * force,
                "idle.violation": np.full(5, 0.25), "idle.force": 0 * force, "gear.violation": np.full(5, -2e-8),
                "gear.multiplier": np.ones(5)}  # fmt: skip
    rows = audit_rows(mp.Result(time=t, channels=channels, status="done", message=""), 1e-6, ())
    assert {row[0]: row[1] for row in rows[1:]} == {"closure dock": 1e-9, "closure idle": None, "closure gear": 2e-8}


def test_extremes_are_those_of_the_channels():
    """Against sin and cos, whose extremes are known: 1 at a quarter of the period, and so on."""
    t = np.linspace(0.0, 2.0, 2001)
    channels = {"hinge.angle": np.sin(np.pi * t), "tip.position": np.stack([t, -t, np.cos(np.pi * t)], axis=1)}
    run = mp.Result(time=t, channels=channels, status="done", message="")
    section = extremes(run, list(run))[0]
    rows = [re.sub(r"<[^>]*>", " ", row).split() for row in re.findall(r"<tr>(.*?)</tr>", section.html)[1:]]
    assert rows[0][:6] == ["hinge.angle", "rad", "-1", "1.5", "1", "0.5"]
    assert rows[2][:6] == ["tip.position.y", "m", "-2", "2", "0", "0"]
    assert rows[3][:4] == ["tip.position.z", "m", "-1", "1"]


def test_events_and_impacts_are_listed(tmp_path):
    hit = Impact(t=0.25, y=np.zeros(2), impulse={"stop.force": np.array([3.0, 4.0, 0])}, energy_loss=1.5, sticks={})
    run = mp.Result(time=np.linspace(0, 1, 3), channels={"a.angle": np.zeros(3)}, status="done", message="",
                    events={"touch": np.array([0.25, 0.75])}, impacts={"touch": (hit,)})  # fmt: skip
    text = words(write_run_page(run, tmp_path / "hit.html"))
    assert "touch 2 0.25, 0.75" in text
    assert "touch 0.25 1.5 stop.force 5" in text


def test_a_long_curve_keeps_its_extremes():
    """A spike of one sample among a million is drawn at its height, though a thousand points are drawn."""
    t = np.linspace(0.0, 1.0, 1_000_001)
    values = np.zeros(len(t))
    values[123456], values[654321] = 1.0, -1.0
    path = re.search(r'<path d="M([^"]*)"', curves(t, {"a": values}, "a", "m"))[1]
    points = np.array([point.split() for point in path.split("L")], dtype=float)
    assert len(points) <= 2 * MOST
    high, span = ABOVE, HEIGHT - ABOVE - BELOW
    margin = ROOM / (1 + 2 * ROOM) * span
    np.testing.assert_allclose(
        [points[:, 1].min(), points[:, 1].max()], [high + margin, high + span - margin], atol=0.06
    )


def test_channels_of_a_simulation_have_units(swung):
    run = swung[1]
    without = {name.rpartition(".")[2] for name in run.table() if not channel_unit(run, name)}
    assert without <= {"w", "1", "2", "3", "4", "orientation", "violation", "acceleration", "drive"}
    assert set(UNITS) >= {"angle", "rate", "position", "force", "torque"}


@pytest.fixture(scope="module")
def written(project, tmp_path_factory):
    """Files of `run` and `simulate` of a system without flexible bodies, with a page and without."""
    file, found = project / "pipelines" / "double-pendulum.toml", {}
    for name, arguments in {"run": ["run"], "simulate": ["simulate"], "bare": ["simulate", "--no-report"]}.items():
        folder = tmp_path_factory.mktemp(name)
        assert main([*arguments, str(file), "--output", str(folder), "--quiet"]) == 0
        found[name] = folder / "double-pendulum"
    return found


def test_commands_write_the_page_beside_the_results(written, project):
    names = {name: {file.name for file in folder.iterdir()} for name, folder in written.items()}
    assert "double-pendulum-run.html" in names["run"]
    assert names["run"] == names["simulate"]
    assert names["simulate"] - names["bare"] == {"double-pendulum-run.html"}
    text = (written["run"] / "double-pendulum-run.html").read_text(encoding="utf-8")
    assert text.count("data:image/png;base64") == 2  # its [[plots]]
    from modalprep.program import file_digest

    assert file_digest(project / "pipelines" / "double-pendulum.toml") in text
    assert file_digest(written["run"] / "double-pendulum-run.h5") in text
    assert not re.search(r'(src|href)="(?!data:|#)', text)


def test_files_of_a_run_are_listed(project, tmp_path, capsys):
    file = project / "pipelines" / "double-pendulum.toml"
    assert main(["simulate", str(file), "-o", str(tmp_path / "a.h5"), "--json"]) == 0
    assert str(tmp_path / "a.html") in json.loads(capsys.readouterr().out)["files"]
