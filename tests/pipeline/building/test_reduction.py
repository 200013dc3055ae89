"""What [reduction] can say, through the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
from toml_beams import SLENDER

import modalprep as mp
from modalprep.cli import main

pytestmark = pytest.mark.usefixtures("rough_edges")  # pictures are not looked at here

TOML = (
    SLENDER
    + """
[interfaces.tip]
near = [10, 0, 0]

[reduction]
{reduction}

[output]
pictures = 0
"""
)


@pytest.fixture
def run(project, tmp_path, capsys):
    def runner(reduction, *options):
        (tmp_path / "job.toml").write_text(TOML.format(mesh=project / "meshes" / "beam.msh", reduction=reduction))
        code = main(["run", str(tmp_path / "job.toml"), "--json", *(options or ["--no-report"])])
        captured = capsys.readouterr()
        return code, json.loads(captured.out) if code == 0 else captured.err

    return runner


def modal_file(found):
    return mp.read_body(next(file for file in found["files"] if file.endswith(".h5")))


@pytest.mark.parametrize("method", ["craig_bampton", "guyan", "irs", "free_interface"])
def test_every_method_gives_the_first_bending_mode(run, method):
    """Clamped root, 1.8751^2 sqrt(EI / rho A) / (2 pi L^2) = 0.6044 Hz; Guyan is 0.5 % high."""
    modes = "" if method in ("guyan", "irs") else "\nmodes = 4"  # those have none of the interior
    code, found = run(f'method = "{method}"{modes}')
    assert code == 0
    assert found["frequency_Hz"][0] == pytest.approx(0.60445, rel=6e-3 if method == "guyan" else 5e-4)


def test_error_is_stated(run):
    _, found = run("modes = 8\nup_to = 5.0")
    assert any("error against the full model below 5 Hz, where it has 3 modes" in note for note in found["notes"])


def test_error_is_drawn_in_the_report(run):
    for reduction, shown in (("modes = 8", False), ("modes = 8\nup_to = 5.0", True)):
        _, found = run(reduction, "--report")
        page = next(file for file in found["files"] if file.endswith(".html"))
        assert ("<h2>Errors" in Path(page).read_text()) is shown


def test_target_error_picks_the_modes(run):
    rough, fine = (len(run(f"up_to = 30.0\ntarget_error = {e}")[1]["frequency_Hz"]) for e in (1e-1, 1e-5))
    assert fine > rough


RECOVERIES = """
[recovery.spar]
kind = "section_force"

[recovery.wall-1]
kind = "reaction"
method = "displacement"
"""


def test_modes_are_chosen_by_recoveries(run):
    keep = 'modes = 12\nkeep = "recovery.wall-1 > 10% or recovery.spar > 50%"\nup_to = 5.0'
    code, found = run(keep + RECOVERIES, "--report")
    assert code == 0
    table = modal_file(found).modes
    assert 0 < table.kept[:12].sum() < 12
    assert any("in wall-1 (root." in reason for reason in table.reason)
    (error,) = (note for note in found["notes"] if note.startswith("error against the full model"))
    assert "recovery spar" in error
    assert "recovery wall-1" in error
    page = next(file for file in found["files"] if file.endswith(".html"))
    text = Path(page).read_text()
    assert "Convergence of the recoveries</h2>" in text
    assert "<td>wall-1</td><td>displacement</td>" in text
    assert main(["check", str(Path(page).parents[2] / "job.toml")]) == 0  # which reduces it again


def test_recoveries_have_targets(run):
    sizes = [
        len(run(f'modes = 2\nup_to = 20.0\ntarget_error = {{ spar = "{target}" }}' + RECOVERIES)[1]["frequency_Hz"])
        for target in ("20%", "0.1%")
    ]
    assert sizes[1] > sizes[0]


@pytest.mark.parametrize(
    ("reduction", "words"),
    [
        ('keep = "recovery > 1%"', "there is no [recovery.NAME] table"),
        ('keep = "recovery.spa > 1%"' + RECOVERIES, "keep: did you mean 'spar'?"),
        ("up_to = 5.0\ntarget_error = { spa = 0.1 }" + RECOVERIES, "target_error: did you mean 'spar'?"),
        ('up_to = 5.0\ntarget_error = { spar = "much" }' + RECOVERIES, "'much' is no share"),
        ("up_to = 5.0\ntarget_error = { spar = 0 }" + RECOVERIES, "target_error"),
        ("up_to = 5.0\ntarget_error = -1" + RECOVERIES, "target_error"),
        ("target_error = { spar = 0.1 }" + RECOVERIES, "target_error needs up_to"),
    ],
)
def test_recoveries_that_are_not_there_are_refused(run, reduction, words):
    code, said = run(reduction)
    assert code == 2
    assert words in " ".join(said.split())


def test_listed_modes(run):
    _, found = run("modes = 6\nkeep = [1, 3]\ntruncation_vectors = []")
    assert len(found["frequency_Hz"]) == 8  # six constraint modes and these two


def test_target_without_a_band(run):
    code, error = run("target_error = 1e-3")
    assert code == 2
    assert "target_error needs up_to" in error


def test_every_run_says_that_no_mode_is_missing(run):
    for method, kind in (("craig_bampton", "fixed-interface"), ("free_interface", "elastic free-interface")):
        _, found = run(f'method = "{method}"\nmodes = 4')
        assert any(note.startswith(f"all 3 {kind} modes below") for note in found["notes"])
    _, found = run('method = "guyan"')
    assert not any("were found" in note for note in found["notes"])


def test_modes_dropped_below_up_to_are_said(run):
    _, found = run('modes = 8\nkeep = "effective_mass > 15%"\nup_to = 20.0')
    assert any("modes below up_to = 20 Hz" in note for note in found["notes"])
    _, found = run('modes = 8\nkeep = "effective_mass > 15% or frequency < 20"\nup_to = 20.0')
    assert not any("modes below up_to" in note for note in found["notes"])


@pytest.mark.parametrize(
    ("damping", "ratio"),
    [
        ("0.01", lambda f: 0.01 + 0 * f),
        ("[[1.0, 0.02], [11.0, 0.01]]", lambda f: np.clip(0.02 - 0.001 * (f - 1), 0.01, 0.02)),
        ("{ alpha = 0.2, beta = 1e-3 }", lambda f: 0.2 / (4 * np.pi * f) + 1e-3 * np.pi * f),
        ("[0.03, 0.02, 0.01, 0.0, 0.0, 0.0, 0.0, 0.04]", lambda f: np.array([3, 2, 1, 0, 0, 0, 0, 4]) / 100),
    ],
)
def test_damping(run, damping, ratio):
    """``D = 2 zeta w`` with zeta by hand; six constraint modes and two others."""
    _, found = run(f"modes = 2\ntruncation_vectors = []\ndamping = {damping}")
    body = modal_file(found)
    assert body.n == 8
    np.testing.assert_allclose(body.D, 4 * np.pi * body.frequency * ratio(body.frequency), rtol=1e-12)


@pytest.mark.parametrize(
    ("damping", "words"),
    [
        ("[0.01]", "1 damping ratios for 8 modes"),
        ("[]", "0 damping ratios for 8 modes"),
        ("[[1, 0.01, 3]]", "[reduction.damping"),
        ("[[1, -0.01]]", "[reduction.damping"),
        ("[[1, 0.01], [1, 0.02]]", "two ratios at one frequency"),
        ("{ alpha = -1 }", "[reduction.damping.alpha]"),
        ("{ gamma = 1 }", "unknown key 'gamma'"),
        ('"much"', "[reduction.damping]"),
    ],
)
def test_bad_damping_is_refused(run, damping, words):
    code, error = run(f"modes = 2\ntruncation_vectors = []\ndamping = {damping}")
    assert code == 2
    assert words in error


THRUST = """
[loads.thrust]
near = [5, 0, 0]
force = [0, 100, 20]
moment = [0, 0, 30]
"""


def test_a_load_of_the_file_is_answered_exactly(run):
    """Deflection under a force in the middle of a cantilever, ``P a^3 / 3 EI + P a / kGA``, by truncation vectors."""
    load = THRUST.replace("moment = [0, 0, 30]", "").replace("20]", "0]")
    exact = 100 * 5**3 / (3 * 1.4e4) + 100 * 5 / (5 / 6 * 2.5e10 * 4e-4)
    for names, right in (('["thrust"]', True), ("[]", False)):
        body = modal_file(run(f"modes = 1\ntruncation_vectors = {names}\n{load}")[1])
        (y,) = body.shape[np.isclose(body.points[:, 0], 5.0), 1]
        assert bool(100 * y @ (y / body.K) == pytest.approx(exact, rel=1e-9)) is right


def test_a_line_load_is_answered_exactly(run):
    """The tip of a cantilever under ``q``: ``q L^4 / 8 EI + q L^2 / 2 kGA``, by truncation vectors."""
    load = '[loads.snow]\ngroup = "beam"\nline_load = [0, "3 N/m", 0]\n'
    body = modal_file(run(f'modes = 1\ntruncation_vectors = ["snow"]\n{load}')[1])
    order = np.argsort(body.points[:, 0])
    y = body.shape[order, 1]
    h = np.diff(body.points[order, 0])
    assert len(y) > 2
    work = 3.0 * (np.append(h, 0) + np.append(0, h)) / 2 @ y  # of the forces; the end moments cancel but at the tip
    tip = y[-1] @ (work / body.K)
    assert tip == pytest.approx(3.0 * 10**4 / (8 * 1.4e4) + 3.0 * 10**2 / (2 * 5 / 6 * 2.5e10 * 4e-4), rel=2e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("force = [0, 100, 20]\nmoment = [0, 0, 30]", ""), ["[loads.thrust]", "zero"]),
        (("near = [5, 0, 0]", ""), ["[loads.thrust]", "exactly one of"]),
        (("near = [5, 0, 0]", 'group = "wing"'), ["[loads.thrust]", "no group 'wing'"]),
        (("force = [0, 100, 20]", "traction = [1, 0, 0]"), ["[loads.thrust]", "mesh group of faces or lines"]),
        (("near = [5, 0, 0]", 'group = "root"'), ["'thrust'", "fixed interfaces only"]),
        (("force = [0, 100, 20]", "pressure = 3"), ["[loads.thrust]", "pressure"]),
        (("thrust", "inertia"), ["[loads]", "'inertia'", "built-in"]),
        (("[loads.thrust]", "[loads.jet]"), ["[reduction]", "'thrust'", "known are interfaces, inertia, jet"]),
    ],
)
def test_bad_loads_are_refused(run, change, words):
    assert change[0] in THRUST
    code, error = run('truncation_vectors = ["thrust"]\n' + THRUST.replace(*change))
    assert code == 2
    for word in words:
        assert word in error


def test_loads_need_truncation_vectors(run):
    code, error = run('method = "guyan"\n' + THRUST)
    assert code == 2
    assert "[loads] are for method = 'craig_bampton'" in error
