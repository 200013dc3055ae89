"""The section on the convergence of recoveries: numbers, names, pictures."""

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from modalprep.reduction.recoveries.convergence import Convergence
from modalprep.report.body_page.convergence import convergence_rows, convergence_section


def example(names=("struts", "<b>skin</b>"), share=(1.0, 0.25)):
    return Convergence(
        recoveries=names,
        methods=("acceleration", "displacement"),
        share=np.array(share),
        count=np.array([0, 1, 2, 5]),
        frequency=np.array([0.0, 3.25, 7.5, 120.0]),
        error=np.array([[2.0, 0.123456, 1e-5, 0.0], [1.0, 0.5, 0.25, 0.0]]),
        up_to=40.0,
    )


def test_rows_have_the_error_in_percent():
    rows = convergence_rows(example())
    assert rows[0] == [
        "struts",
        "acceleration",
        200.0,
        pytest.approx(12.3456, rel=1e-12),
        pytest.approx(1e-3, rel=1e-12),
        0.0,
    ]
    assert rows[1][1] == "displacement, 25 % of its places"


def test_section_is_whole_and_safe():
    text = str(convergence_section(example()).html)
    assert "&lt;b&gt;skin" in text
    assert "<b>skin" not in text
    assert "below 40 Hz" in text
    assert "evenly chosen places" in text
    assert "evenly chosen places" not in str(convergence_section(example(share=(1.0, 1.0))).html)
    picture = re.search(r'src="data:image/png;base64,([^"]+)"', text)[1]
    assert Image.open(io.BytesIO(base64.b64decode(picture))).size[0] > 1000
    assert "12.3" in text
