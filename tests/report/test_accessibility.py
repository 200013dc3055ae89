"""The page passes axe-core's rules of WCAG 2.1 A and AA, in light and in dark colours."""

import numpy as np
import pytest
from report.accessibility import needs_axe, violations
from report.browser import needs_browser
from report.page_of_all import whole_page
from report.studies import study_rows

from modalprep.multibody.results.result import Result
from modalprep.pipeline.study.write import write_study
from modalprep.report import write_run_page

pytestmark = [needs_browser, needs_axe]


@pytest.mark.parametrize("dark", [False, True])
def test_page_violates_no_rule(block, tmp_path, dark):
    out = violations(whole_page(block, tmp_path), tmp_path, dark=dark)
    assert out["faults"] == []
    assert out["dark"] is dark
    assert out["violations"] == []
    assert out["passes"] > 30


@pytest.mark.parametrize("dark", [False, True])
def test_page_of_a_run_violates_no_rule(tmp_path, dark):
    time = np.linspace(0.0, 1.0, 30)
    channels = {"hinge.angle": time**2, "tip.position": np.stack([time, -time, 0 * time], axis=1)}
    run = Result(time=time, channels=channels, status="done", message="reached t = 1 s", stats={"energy_error": 1e-9},
                 notes=("its mass is implausible",), events={"touch": time[3:5]})  # fmt: skip
    out = violations(write_run_page(run, tmp_path / "run.html"), tmp_path, dark=dark)
    assert out["faults"] == []
    assert out["violations"] == []


@pytest.mark.parametrize("dark", [False, True])
def test_page_of_a_study_violates_no_rule(tmp_path, dark):
    write_study(study_rows(60, waiting=20), tmp_path)
    out = violations(tmp_path / "index.html", tmp_path, dark=dark)
    assert out["faults"] == []
    assert out["violations"] == []
    assert out["passes"] > 20


def test_rules_see_text_too_faint_to_read(block, tmp_path):
    page = whole_page(block, tmp_path)
    page.write_text(page.read_text(encoding="utf-8").replace("--soft: #56636f", "--soft: #a0a8b0"), encoding="utf-8")
    assert "color-contrast" in [rule for rule, *_ in violations(page, tmp_path, dark=False)["violations"]]
