"""The HTML page: complete, in one file, and safe from names."""

import base64
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import modalprep as mp
from modalprep.report.page import write_page

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
    checks = [SimpleNamespace(name="modal mass", value=2e-3, limit=1e-7, passed=False, meaning="P sums to 1")]
    page = outline(
        write_page(
            block, tmp_path / "p.html", pictures={1: picture, 2: picture}, mesh_picture=picture,
            plots=[("Spin-up", picture)], checks=checks, notes=["pictures not drawn: no EGL"],
        )
    )  # fmt: skip
    sources = [attrs[key] for _, attrs in page.tags for key in ("src", "href") if key in attrs]
    assert len(sources) == 5  # mesh, plot, bars, two modes
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert base64.b64decode(sources[0].partition(",")[2]) == picture.read_bytes()
    for words in ("pictures not drawn: no EGL", "1 of 1 checks failed", "FAILED", "P sums to 1", "ab" * 32):
        assert words in page.text


def test_page_holds_every_candidate_and_every_mode_of_the_body(cantilever, tmp_path):
    page = outline(write_page(cantilever, tmp_path / "p.html"))
    rows = [attrs["class"] for tag, attrs in page.tags if tag == "tr" and "class" in attrs]
    assert rows == ["kept" if kept else "dropped" for kept in cantilever.modes.kept]
    for mode in range(1, cantilever.n + 1):
        assert f"mode {mode} {2 * mode} Hz damping 1 %" in page.text
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
        write_page(cantilever, tmp_path / "p.html", pictures={1: tmp_path / "gone.png"})
    assert list(tmp_path.iterdir()) == []


def test_rigid_body_has_a_page(cantilever, tmp_path):
    table = cantilever.modes.with_(
        kind=(), frequency=np.zeros(0), effective_mass=np.zeros((0, 6)), kept=np.zeros(0, dtype=bool), reason=()
    )
    none = np.zeros(0)
    rigid = cantilever.with_(K=none, D=none, frequency=none, shape=np.zeros((21, 3, 0)), modes=table)
    assert "Modal body with 0 modes" in outline(write_page(rigid, tmp_path / "p.html")).text
