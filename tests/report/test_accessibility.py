"""The page passes axe-core's rules of WCAG 2.1 A and AA, in light and in dark colours."""

import pytest
from report.accessibility import needs_axe, violations
from report.browser import needs_browser
from report.page_of_all import whole_page

pytestmark = [needs_browser, needs_axe]


@pytest.mark.parametrize("dark", [False, True])
def test_page_violates_no_rule(block, tmp_path, dark):
    out = violations(whole_page(block, tmp_path), tmp_path, dark=dark)
    assert out["faults"] == []
    assert out["dark"] is dark
    assert out["violations"] == []
    assert out["passes"] > 30


def test_rules_see_text_too_faint_to_read(block, tmp_path):
    page = whole_page(block, tmp_path)
    page.write_text(page.read_text(encoding="utf-8").replace("--soft: #56636f", "--soft: #a0a8b0"), encoding="utf-8")
    assert "color-contrast" in [rule for rule, *_ in violations(page, tmp_path, dark=False)["violations"]]
