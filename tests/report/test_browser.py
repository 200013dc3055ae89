"""The page in a real browser: its table sorts and filters, its modes move, its matrix answers."""

import re
import subprocess

import numpy as np
import pytest
from PIL import Image
from report.browser import CHROMIUM, FLAGS, needs_browser, run_page, run_viewer
from report.conftest import make_table
from report.page_of_all import whole_page

from modalprep.examples import uniform_beam
from modalprep.report.mac import auto_mac
from modalprep.report.page import BodyPage, write_page
from modalprep.report.scene.colour import WORDS

pytestmark = needs_browser

TABLE = """
const form = document.getElementById("filter"), table = document.getElementById("selection");
const count = () => [...table.tBodies[0].rows].filter(row => !row.hidden && row.offsetHeight > 0).length;
const set = (name, value) => { form.elements[name].value = value; form.dispatchEvent(new Event("input")); };
const column = k => [...table.tBodies[0].rows].map(row => row.cells[k].textContent.trim());
out.all = count(); out.said = document.getElementById("shown").textContent;
set("show", "dropped"); out.dropped = count(); set("show", "kept"); out.kept = count(); set("show", "all");
set("kind", "constraint"); out.constraint = count(); set("kind", "all");
set("words", "STATIC dropped"); out.words = count(); set("words", "no such word"); out.none = count();
out.saidNone = document.getElementById("shown").textContent;
set("words", "");
const heads = table.tHead.rows[0].cells;
heads[2].click(); out.up = column(2); heads[2].click(); out.down = column(2);
out.sorted = heads[2].getAttribute("aria-sort");
heads[4].click(); out.masses = [...table.tBodies[0].rows].map(row => Number(row.cells[4].dataset.sort));
heads[1].click(); out.kinds = column(1);
"""

# The moving pictures come when the probe asks: a busy machine shows fewer than it would.

VIEW = """
const box = document.getElementById("viewer"), canvas = box.querySelector("canvas");
const part = name => box.querySelector(`[name=${name}]`);
out.state = box.dataset.state;
const look = () => {
  const flat = document.createElement("canvas");
  flat.width = canvas.width; flat.height = canvas.height;
  const pen = flat.getContext("2d");
  pen.drawImage(canvas, 0, 0);
  const data = pen.getImageData(0, 0, flat.width, flat.height).data;
  const seen = { ink: 0, yellow: 0, violet: 0, left: 1e9, right: -1, top: 1e9, bottom: -1, sum: 0 };
  for (let k = 0; k < data.length; k += 4) {
    const [r, g, b] = [data[k], data[k + 1], data[k + 2]];
    seen.sum = (seen.sum * 31 + r + 256 * g + 65536 * b) % 4294967291;
    if (Math.max(r, g, b) - Math.min(r, g, b) < 30) continue;
    const x = (k / 4) % flat.width, y = Math.floor(k / 4 / flat.width);
    seen.ink++;
    if (g > b + 80 && r > b + 60) seen.yellow++;
    if (b > g + 30 && r > g + 15) seen.violet++;
    seen.left = Math.min(seen.left, x); seen.right = Math.max(seen.right, x);
    seen.top = Math.min(seen.top, y); seen.bottom = Math.max(seen.bottom, y);
  }
  return { ...seen, width: flat.width, height: flat.height };
};
const set = (name, value, kind) => { part(name).value = value; part(name).dispatchEvent(new Event(kind)); };
if (out.state === "drawn") {
  await wait(100);
  out.first = look(); out.ink = out.first.ink;
  out.labels = [...box.querySelectorAll(".stage span")].map(s => s.textContent);
  out.modes = part("mode").options.length;
  set("amplitude", 0, "input"); out.rest = look(); set("amplitude", 100, "input");
  canvas.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 120, movementY: 60 }));
  out.turned = look();
  part("reset").click(); out.back = look();
  const wheel = () => canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -300, cancelable: true }));
  out.scrolls = wheel(); out.unfocused = look();
  canvas.focus(); out.zooms = !wheel(); out.zoomed = look();
  part("reset").click();
  part("play").click(); out.playing = part("play").textContent;
  out.moving = [];
  for (let k = 0; k < 6; k++) { nextFrame(); out.moving.push(look().sum); }
  part("play").click(); out.paused = part("play").textContent; out.still = look();
  out.edges = (part("edges").click(), look()); part("edges").click();
  if (out.modes > 1) { set("mode", out.modes - 1, "change"); out.last = look(); }
  document.querySelector("a[href='#mode-1']").click(); await wait(50); out.shown = part("mode").value;
  if (out.modes > 1) { location.hash = "#mode-2"; await wait(50); out.linked = part("mode").value; }
}
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Write a body's page, and return it with an empty folder."""
    folder = tmp_path_factory.mktemp("pages")

    def make(body, **options):
        return write_page(BodyPage(body, **options), folder / f"{body.name}.html"), folder

    return make


@pytest.fixture(scope="module", params=["cantilever", "block", "frame"])
def viewed(request, pages):
    """What the probe of the viewer found of a body of beams, of solids, of both with shells."""
    out = run_viewer(*pages(request.getfixturevalue(request.param)), VIEW)
    if out["state"] == "no-webgl":
        pytest.skip("this chromium has no WebGL 2")
    return request.getfixturevalue(request.param), out


def test_table_sorts_and_filters(cantilever, pages):
    out = run_page(*pages(cantilever), TABLE)
    table = cantilever.modes
    assert out["faults"] == []
    assert (out["all"], out["kept"], out["dropped"]) == (9, table.kept.sum(), (~table.kept).sum())
    assert out["said"] == "9 of 9 rows"
    assert out["constraint"] == 2
    assert out["words"] == 1  # static response of dropped modes, in any case
    assert (out["none"], out["saidNone"]) == (0, "0 of 9 rows")
    assert out["up"] == out["down"][::-1]
    known = np.sort(table.frequency[np.isfinite(table.frequency)])
    np.testing.assert_allclose([float(text) for text in out["up"] if text], known, rtol=1e-4)
    assert out["sorted"] == "descending"
    assert out["masses"] == sorted(out["masses"])
    assert min(mass for mass in out["masses"] if mass > 0) < 0.1  # as words, 0.0667 comes after 0.15
    assert out["kinds"] == sorted(table.kind)


def test_body_is_drawn_in_the_colours_of_its_displacement(viewed):
    body, out = viewed
    first = out["first"]
    assert out["faults"] == []
    assert out["state"] == "drawn"
    assert first["ink"] > 1500
    assert first["yellow"] > 50
    assert first["violet"] > 50
    wide = (first["right"] - first["left"]) / first["width"]
    high = (first["bottom"] - first["top"]) / first["height"]
    assert max(wide, high) > 0.4
    assert 0 < first["left"] < first["right"] < first["width"] - 1
    assert out["labels"] == list(body.interface_name)
    assert out["modes"] == body.n


def test_body_moves_turns_and_zooms(viewed):
    body, out = viewed
    for other in ("rest", "turned", "zoomed", *(["last"] if body.n > 1 else [])):
        assert out[other]["sum"] != out["first"]["sum"], other
        assert out[other]["ink"] > 500, other
    for same in ("back", "unfocused", "still"):
        assert out[same]["sum"] == out["first"]["sum"], same
    assert len(set(out["moving"])) == 6
    assert out["zoomed"]["ink"] > 1.1 * out["first"]["ink"]
    assert out["scrolls"]  # the page, as long as the view is not in use
    assert out["zooms"]
    assert (out["playing"], out["paused"]) == ("Pause", "Play")
    assert out["shown"] == "0"
    assert out.get("linked", "1") == "1"


def test_element_edges_can_be_taken_away(viewed):
    body, out = viewed
    assert (out["edges"]["sum"] != out["first"]["sum"]) == (set(body.cells) != {"line"})


def strained(body):
    """The same body, with more strain energy the closer a cell is to its clamp; its second mode all in one cell."""
    nodes = body.cells["tetra10"]
    energy = np.zeros((len(nodes), 2))
    energy[:, 0], energy[0, 1] = (2 - body.points[nodes, 0].mean(axis=1)) ** 8, 1.0
    return body.with_(name="strained", energy={"tetra10": energy}, volume={"tetra10": np.ones(len(nodes))})


@pytest.mark.parametrize("name", ["beam", "block"])
def test_colour_can_be_the_strain(name, block, pages):
    """A clamped body in bending: yellow moves from its tip to its clamp, and back; another mode keeps the choice."""
    body = uniform_beam(modes=2) if name == "beam" else strained(block)
    probe = (
        VIEW.split("if (out.state")[0]
        + """
    const side = () => {
      const flat = document.createElement("canvas"); flat.width = canvas.width; flat.height = canvas.height;
      const pen = flat.getContext("2d"); pen.drawImage(canvas, 0, 0);
      const data = pen.getImageData(0, 0, flat.width, flat.height).data; let sum = 0, count = 0;
      for (let k = 0; k < data.length; k += 4) if (data[k + 1] > data[k + 2] + 80 && data[k] > data[k + 2] + 60
        && data[k + 1] > 0.7 * data[k]) { sum += (k / 4) % flat.width; count++; }
      return sum / count / flat.width; };
    const words = () => box.querySelector(".bar em").textContent;
    if (out.state === "drawn") { await wait(100); out.moved = [side(), words()];
      set("colour", "energy", "change"); out.strained = [side(), words()]; const first = look().sum;
      set("mode", 1, "change"); out.kept = part("colour").value; out.other = look().sum !== first;
      set("mode", 0, "change"); out.same = look().sum === first;
      set("colour", "displacement", "change"); out.back = [side(), words()]; }"""
    )
    out = run_page(*pages(body), probe)
    if out["state"] == "no-webgl":
        pytest.skip("this chromium has no WebGL 2")
    assert out["faults"] == []
    assert out["moved"] == out["back"]
    assert out["moved"][0] > 0.6
    assert out["strained"][0] < 0.4
    assert (out["moved"][1], out["strained"][1]) == (WORDS["displacement"], WORDS["energy"])
    assert (out["kept"], out["other"], out["same"]) == ("energy", True, True)


def test_body_without_energy_offers_no_colour(cantilever, pages):
    out = run_page(*pages(cantilever), 'out.none = document.querySelector("[name=colour]") === null;')
    assert out == {"none": True, "faults": []}


def test_browser_without_webgl_is_reported_and_keeps_the_rest(cantilever, pages):
    blind = "HTMLCanvasElement.prototype.getContext = () => null;"
    said = 'out.text = document.getElementById("viewer-status").textContent;'
    said += 'out.height = document.querySelector(".stage").offsetHeight;'
    out = run_page(*pages(cantilever), TABLE + said, before=blind)
    assert out["faults"] == []
    assert "no WebGL 2" in out["text"]
    assert out["height"] == 0
    assert out["all"] == 9


def test_matrix_says_the_value_under_the_pointer(block, pages):
    probe = """
    const area = document.querySelector("#mac .area").getBoundingClientRect(), mac = document.getElementById("mac");
    const at = (i, j) => { mac.dispatchEvent(new PointerEvent("pointermove", { bubbles: true,
      clientX: area.left + (j + 0.5) / 2 * area.width, clientY: area.top + (i + 0.5) / 2 * area.height }));
      return document.getElementById("mac-readout").textContent; };
    out.own = at(0, 0); out.other = at(1, 0);
    mac.dispatchEvent(new PointerEvent("pointerleave")); out.after = document.getElementById("mac-readout").textContent;
    """
    both = block.shape.copy()
    both[:, :, 1] += both[:, :, 0]
    body = block.with_(shape=both)
    out = run_page(*pages(body), probe)
    value = auto_mac(both)[1, 0]
    assert 0.2 < value < 0.8
    assert out["own"] == "mode 1 (2 Hz) and mode 1 (2 Hz): 1.000"
    assert out["other"] == f"mode 2 (4 Hz) and mode 1 (2 Hz): {value:.3f}"
    assert out["after"].startswith("Point at")


def test_nothing_sticks_out_of_the_page(cantilever, pages, tmp_path):
    """No text wider than its box, on a screen of 1200 and in the middle of the page."""
    file = tmp_path / "picture.png"
    Image.fromarray(np.zeros((30, 40, 3), dtype=np.uint8)).save(file)
    probe = """
    out.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
    out.cut = [...document.querySelectorAll("td, th, figcaption, h1, h2, p, .controls, .filter, figcaption span")]
      .filter(e => e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0).map(e => e.textContent.slice(0, 40));
    out.small = [...document.querySelectorAll("main *")].filter(e => e.childNodes.length && e.textContent.trim()
      && parseFloat(getComputedStyle(e).fontSize) < 11).length;
    """
    long = cantilever.with_(interface_name=("a_rather_long_name_of_an_interface" * 2, "top"))
    page, folder = pages(long, pictures={1: file}, mesh_picture=file, errors={"e": ([1, 2], [3, 4])})
    out = run_page(page, folder, probe)
    assert (out["faults"], out["wide"], out["cut"], out["small"]) == ([], 0, [], 0)


def test_narrow_page_folds_its_contents_and_scrolls_tables_inside_their_frames(block, tmp_path):
    probe = """
    const contents = document.querySelector("#contents details");
    out.width = innerWidth; out.open = contents.open;
    out.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
    out.framed = [...document.querySelectorAll("main table")].filter(t => t.scrollWidth > innerWidth)
      .every(t => t.closest(".frame").scrollWidth > t.closest(".frame").clientWidth);
    document.querySelector("#contents summary").click(); await wait(50); out.opened = contents.open;
    document.querySelector("#contents a").click(); await wait(50); out.folded = !contents.open;
    """
    out = run_page(whole_page(block, tmp_path), tmp_path, probe, flags=("--window-size=500,900",))
    assert out.pop("width") <= 500
    assert out == {"faults": [], "open": False, "wide": 0, "framed": True, "opened": True, "folded": True}


def test_hostile_names_are_only_shown(cantilever, pages):
    hostile = "</script><script>faults.push('ran')</script><b>{{ 7*7 }}"
    probe = 'out.labels = [...document.querySelectorAll(".stage span")].map(s => s.textContent);'
    out = run_page(*pages(cantilever.with_(name="hostile", interface_name=(hostile, "tip"))), probe)
    assert out == {"faults": [], "labels": [hostile, "tip"]}


def test_many_triangles_are_drawn_without_their_edges(block, pages, monkeypatch):
    probe = 'out.edges = document.querySelector("[name=edges]").checked;'
    assert run_page(*pages(block), probe)["edges"]
    monkeypatch.setattr("modalprep.report.viewer.still.EDGED", 10)
    assert not run_page(*pages(block), probe)["edges"]


def test_paper_has_no_controls_and_all_rows(block, pages, tmp_path):
    """The table is not cut at the height it has on the screen: more rows, more sheets."""
    few, many = (_sheets(pages(block.with_(modes=make_table(rows)))[0], tmp_path) for rows in (10, 250))
    assert few <= 6
    assert many >= few + 3


def _sheets(page, tmp_path) -> int:
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=4000"]
    paper = tmp_path / "page.pdf"
    subprocess.run([*command, f"--print-to-pdf={paper}", page.as_uri()], capture_output=True, timeout=120, check=True)
    return len(re.findall(rb"/Type\s*/Page\b", paper.read_bytes()))
