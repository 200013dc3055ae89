"""The HTML page: complete, in one file, and safe from names."""

import base64
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

import modalprep as mp
from modalprep.body.checks import Check
from modalprep.report.page import BodyPage, write_page

HOSTILE = "\"><script>alert('x')</script><img src=http://example.org/x>{{ 7*7 }}"


class Outline(HTMLParser):
    """Collects tags with their attributes, and the text."""

    def __init__(self, html):
        super().__init__()
        self.tags, self.words = [], []
        self.feed(html)
        self.text = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture
def picture(tmp_path):
    file = tmp_path / "picture.png"
    Image.fromarray(np.zeros((4, 4, 3), dtype=np.uint8)).save(file)
    return file


def outline(page) -> Outline:
    return Outline(page.read_text(encoding="utf-8"))


def test_page_is_whole_and_loads_nothing(block, picture, tmp_path):
    checks = [Check("modal mass", 2e-3, 1e-7, "P sums to 1")]
    page = outline(
        write_page(
            BodyPage(
                block,
                pictures={1: picture, 2: picture},
                mesh_picture=picture,
                plots=[("Spin-up", picture)],
                checks=checks,
                notes=["pictures not drawn: no EGL"],
            ),
            tmp_path / "p.html",
        )
    )
    sources = [attrs["src"] for _, attrs in page.tags if "src" in attrs]
    assert len(sources) == 5  # mesh, plot, bars, two modes
    links = [attrs["href"] for _, attrs in page.tags if "href" in attrs]
    assert all(link.startswith(("data:text/csv;base64,", "#")) for link in links)
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert base64.b64decode(sources[0].partition(",")[2]) == picture.read_bytes()
    for words in ("pictures not drawn: no EGL", "FAIL", "1 not met", "FAILED", "P sums to 1", "ab" * 32):
        assert words in page.text


def test_page_holds_every_candidate_and_every_mode_of_the_body(cantilever, tmp_path):
    page = outline(write_page(cantilever, tmp_path / "p.html"))
    rows = [attrs["class"] for tag, attrs in page.tags if tag == "tr" and "class" in attrs]
    assert rows == ["kept" if kept else "dropped" for kept in cantilever.modes.kept]
    for mode in range(1, cantilever.n + 1):
        assert ("tr", f"mode-{mode}") in [(tag, attrs.get("id")) for tag, attrs in page.tags]
    for reason in cantilever.modes.reason:
        assert reason in page.text


def test_sorting_keys_are_the_full_numbers(cantilever, tmp_path):
    text = write_page(cantilever, tmp_path / "p.html").read_text(encoding="utf-8")
    keys = [float(key) for key in re.findall(r'data-sort="([^"]*)"', text)]
    table = cantilever.modes
    expected = np.nan_to_num(np.column_stack([table.frequency, table.fraction]), nan=-1)
    np.testing.assert_allclose(keys, expected.ravel(), rtol=1e-8)


def test_names_cannot_add_tags(cantilever, tmp_path):
    clean = [tag for tag, _ in outline(write_page(cantilever, tmp_path / "p.html")).tags]
    table = cantilever.modes.with_(reason=(HOSTILE,) * 9)
    body = cantilever.with_(name=HOSTILE, interface_name=(HOSTILE, HOSTILE), modes=table, provenance={HOSTILE: HOSTILE})
    page = outline(write_page(body, tmp_path / "p.html"))
    assert [tag for tag, _ in page.tags] == clean
    assert "{{ 7*7 }}" in page.text


def test_missing_picture_is_named_and_nothing_is_left(cantilever, tmp_path):
    with pytest.raises(mp.InputError, match=r"gone\.png cannot be read"):
        write_page(BodyPage(cantilever, pictures={1: tmp_path / "gone.png"}), tmp_path / "p.html")
    assert list(tmp_path.iterdir()) == []


def test_rigid_body_has_a_page(cantilever, tmp_path):
    table = cantilever.modes.with_(
        kind=(), frequency=np.zeros(0), effective_mass=np.zeros((0, 6)), kept=np.zeros(0, dtype=bool), reason=()
    )
    none = np.zeros(0)
    rigid = cantilever.with_(K=none, D=none, frequency=none, shape=np.zeros((21, 3, 0)), modes=table)
    assert "Modal body with 0 modes" in outline(write_page(rigid, tmp_path / "p.html")).text


def test_errors_have_a_section_only_where_there_are_any(cantilever, tmp_path):
    assert "Errors" not in outline(write_page(cantilever, tmp_path / "p.html")).text
    curves = {"reduced": ([1, 10, 100], [1e-6, 1e-4, 0.1])}
    page = outline(write_page(BodyPage(cantilever, errors=curves, error_axes=("Hz", "error")), tmp_path / "p.html"))
    assert "Errors" in page.text
    assert ("img", "error curves") in [(tag, attrs.get("alt")) for tag, attrs in page.tags]


def test_wrong_errors_and_masses_leave_nothing(cantilever, tmp_path):
    with pytest.raises(mp.InputError, match="error curve 'a' needs as many x as y"):
        write_page(BodyPage(cantilever, errors={"a": ([1, 2], [1])}), tmp_path / "p.html")
    with pytest.raises(mp.InputError, match="one mass >= 0 for each of the 21 nodes"):
        write_page(BodyPage(cantilever, nodal_mass=np.ones(3)), tmp_path / "p.html")
    assert list(tmp_path.iterdir()) == []


def test_masses_change_the_mac_and_its_text(block, tmp_path):
    plain = write_page(block, tmp_path / "p.html").read_text(encoding="utf-8")
    mass = np.linspace(1, 9, len(block.points))
    weighted = write_page(BodyPage(block, nodal_mass=mass), tmp_path / "q.html").read_text(encoding="utf-8")
    assert "with equal nodal weights" in plain
    assert "weighted by nodal mass" in weighted


def test_modes_with_rotations_only_are_named(cantilever, tmp_path):
    shape = cantilever.shape.copy()
    shape[:, :, 2] *= 1e-12
    text = outline(write_page(cantilever.with_(shape=shape), tmp_path / "p.html")).text
    assert "Mode 3 rotates the nodes without displacing them" in text
    assert "without moving" not in outline(write_page(cantilever, tmp_path / "q.html")).text


def test_cells_the_viewer_does_not_know_leave_the_rest(cantilever, tmp_path):
    body = cantilever.with_(cells={"polygon": np.array([[0, 1, 2]])})
    page = outline(write_page(body, tmp_path / "p.html"))
    assert "No animated view: cells of type polygon cannot be drawn" in page.text
    assert "viewer" not in [attrs.get("id") for _, attrs in page.tags]
    assert "mode-5" in [attrs.get("id") for _, attrs in page.tags]


def test_page_of_a_solid_stays_small(bracket_body, tmp_path):
    """Style, scripts, chart, surface of 5592 triangles and 20 or so modes."""
    assert write_page(bracket_body, tmp_path / "p.html").stat().st_size < 1_200_000
