"""The page of a study: what it says without scripts, and in chromium what its table, filters and plot do."""

import html
import json
import re

import numpy as np
import pytest
from report.browser import needs_browser, run_page
from report.studies import study_rows
from size import some

from modalprep.pipeline.study.write import write_study
from modalprep.report.study.facts import counts, troubles

TOOLS = """
const $ = id => document.getElementById(id), table = $("study-table"), form = $("study-form");
const heads = () => [...table.tHead.rows[0].cells].map(th => th.textContent.trim());
const at = name => heads().indexOf(name);
const lines = () => [...table.tBodies[0].rows].filter(row => !row.classList.contains("space"));
const column = name => lines().map(row => row.cells[at(name)].textContent);
const sort = name => { table.tHead.rows[0].cells[at(name)].querySelector("button").click(); return column(name); };
const shown = () => Number($("study-shown").textContent.split(" ")[0]);
const filter = (name, text) => { const input = table.tHead.rows[1].cells[at(name)].querySelector("input");
  input.value = text; input.dispatchEvent(new Event("input")); return [shown(), input.getAttribute("aria-invalid")]; };
const type = (input, value, kind = "input") => {
  input.value = value; input.dispatchEvent(new Event(kind, { bubbles: true })); };
const below = () => { const frame = $("study-frame"); frame.scrollTop = 1e9; frame.dispatchEvent(new Event("scroll"));
  return column("margin").slice(-6); };
const said = id => $(id).textContent;
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page of 60 jobs, and its folder."""
    folder = tmp_path_factory.mktemp("study") / "out"
    write_study([row | {"folder": str(folder / row["job"])} for row in study_rows(60)], folder)
    return folder / "index.html"


def probed(page, probe, **options):
    return run_page(page, page.parent, TOOLS + probe, **options)


def test_causes_that_differ_in_numbers_are_one():
    groups = troubles(study_rows(60))
    assert [(group.kind, group.says, len(group.jobs)) for group in groups] == [
        ("failed", "element 0 has no volume", 6),
        ("not met", "margin of strut N", 6),
    ]
    assert groups[0].jobs == [0, 10, 20, 30, 40, 50]


def test_many_causes_are_told_together():
    rows = [{"job": "a", "status": "failed", "cause": "cause " + "x" * k} for k in range(30)]
    groups = troubles(rows)
    assert len(groups) == 13
    assert (groups[-1].says, len(groups[-1].jobs)) == ("18 other sentences", 18)


def test_jobs_are_counted():
    assert counts(study_rows(60, waiting=20)) == (36, 6, 18, 4)  # two of the last twenty failed


def test_page_says_without_scripts_how_far_it_is_and_what_failed(tmp_path):
    write_study(study_rows(60, waiting=20), tmp_path / "out")
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    plain = " ".join(
        html.unescape(re.sub(r"<script.*?</script>|<style.*?</style>|<[^>]+>", " ", text, flags=re.S)).split()
    )
    assert "42 of 60 jobs have ended. Reload the page for more. Report of 2" in plain
    assert "6 failed, 4 not met done 36 failed 6 waiting 18" in plain
    assert plain.index("element 0 has no volume") < plain.index("Search")
    assert "only the first 50 of 60 jobs are shown" in plain
    assert len(re.findall(r"<tr><td>", text.partition('id="study-table"')[2].partition("</table>")[0])) == 50
    assert not re.search(r'(?:src|href)="(?:https?:)?//', text)


def test_links_lead_to_the_files_of_the_jobs(tmp_path):
    rows = [{"job": "a b", "folder": str(tmp_path / "out" / "a b"), "status": "done", "quantities": {"mass_kg": 1.0}},
            {"job": "c", "folder": str(tmp_path / "other" / "c"), "status": "failed", "cause": "none"}]  # fmt: skip
    write_study(rows, tmp_path / "out")
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert 'href="a%20b/a%20b.html"' in text
    assert 'href="../other/c/c.log"' in text


@needs_browser
def test_table_begins_with_failures_and_sorts_by_any_column(page):
    out = probed(page, """
    out.status = column("status").slice(0, 6); out.verdict = column("verdict").slice(6, 13);
    out.up = sort("margin"); out.said = table.tHead.rows[0].cells[at("margin")].getAttribute("aria-sort");
    out.below = [below()]; out.down = sort("margin"); out.below.push(below());
    out.ended = table.tHead.rows[0].cells[at("margin")].getAttribute("aria-sort");
    out.jobs = sort("job"); out.unsorted = table.tHead.querySelectorAll("[aria-sort]").length;
    form.elements.troubles.click(); out.again = column("status").slice(0, 6);
    """)  # fmt: skip
    assert out["faults"] == []
    assert out["status"] == out["again"] == ["failed"] * 6
    assert out["verdict"] == ["FAIL"] * 6 + ["PASS WITH WARNINGS"]
    assert (out["said"], out["ended"], out["unsorted"]) == ("ascending", "descending", 1)
    known = [float(x) for x in out["up"]]
    assert known == sorted(known)
    assert out["below"] == [[""] * 6] * 2  # jobs without a margin stay below in both orders
    assert out["down"][0] == "0.98333"  # 59 / 60
    assert out["jobs"][:3] == ["arm-0", "arm-1", "arm-2"]


@needs_browser
def test_filters_of_numbers_texts_and_words(page):
    rows = study_rows(60)
    mass = np.array([row.get("quantities", {}).get("mass_kg", np.nan) for row in rows])
    same = np.isclose(mass, 8.1)
    expected = {
        ">5": mass > 5,
        "2.7..8.1": (mass >= 2.69) & (mass <= 8.11),
        ">=5.4 <10.8": (mass > 5.39) & (mass < 10.79),
        "8.1": same,
        "!=8.1": ~same & np.isfinite(mass),
        "> 5": mass > 5,
    }
    probe = f"out.mass = {json.dumps(list(expected))}.map(text => filter('mass_kg', text)[0]);"
    out = probed(page, probe + """
    out.wrong = filter("mass_kg", "5 kg"); filter("mass_kg", "");
    [out.part, out.whole, out.not] = ["pass", "=pass", "!pass"].map(text => filter("verdict", text)[0]);
    filter("verdict", ""); type(form.elements.words, "Steel volume"); out.words = shown();
    form.elements.clear.click(); out.all = shown();
    document.querySelectorAll("[data-group]")[1].click(); out.group = column("margin"); out.said = said("study-shown");
    """)  # fmt: skip
    assert out["faults"] == []
    assert out["mass"] == [int(found.sum()) for found in expected.values()]
    assert out["wrong"] == [60, "true"]
    assert (out["part"], out["whole"], out["not"]) == (48, 42, 12)
    assert (out["words"], out["all"]) == (6, 60)
    assert out["group"] == ["-0.5"] * 6
    assert out["said"] == "6 of 60 jobs, not met: margin of strut N"


@needs_browser
def test_columns_are_chosen_and_kept_in_the_address(page):
    out = probed(page, """
    out.first = heads();
    const box = name => document.querySelector(`#study-columns input[value="${name}"]`);
    document.querySelector(".choice").open = true;
    box("mode_1").click(); box("material").click(); out.heads = heads(); out.focus = document.activeElement.value;
    sort("margin"); filter("mass_kg", ">5");
    out.kept = JSON.parse(decodeURIComponent(location.hash.slice(1)));
    document.querySelector("[data-choice=all]").click(); out.all = heads().length;
    """)  # fmt: skip
    assert out["faults"] == []
    assert out["first"] == [
        "job",
        "thickness",
        "material",
        "status",
        "verdict",
        "seconds",
        "mass_kg",
        "margin",
        "pages",
    ]
    assert "mode_1" in out["heads"]
    assert "material" not in out["heads"]
    assert out["focus"] == "material"
    assert (out["kept"]["sort"], out["kept"]["filters"]) == ("margin", {"mass_kg": ">5"})
    assert out["all"] == 1 + 2 + 4 + 6 + 1  # job, parameters, those of every job, quantities, pages


@needs_browser
@pytest.mark.parametrize(
    "hash", some(["#jobs", "#%7B%22shown%22%3A5%2C%22filters%22%3A%5B%5D%7D", "#%7B", "#null", "#7"], 3)
)
def test_an_address_with_other_things_is_let_be(page, hash):
    out = probed(page, "out.heads = heads().length; out.shown = shown();", before=f"location.hash = '{hash}';")
    assert out == {"faults": [], "heads": 9, "shown": 60}


@needs_browser
def test_a_reload_shows_what_was_chosen(page):
    state = {"sort": "margin", "up": False, "words": "arm", "filters": {"mass_kg": ">5", "gone": "1"}, "group": None,
             "shown": ["job", "margin", "mass_kg", "gone"], "plot": {"x": "seconds", "y": "gone"}}  # fmt: skip
    set_hash = f"location.hash = encodeURIComponent({json.dumps(json.dumps(state))});"
    out = probed(page, """
    out.heads = heads(); out.first = column("margin")[0]; out.shown = shown();
    out.words = form.elements.words.value; out.x = $("plot-form").elements.x.value;
    out.mass = table.tHead.rows[1].cells[at("mass_kg")].querySelector("input").value;
    """, before=set_hash)  # fmt: skip
    assert out["faults"] == []
    assert out["heads"] == ["job", "margin", "mass_kg", "pages"]
    assert (out["first"], out["words"], out["mass"], out["x"]) == ("0.98333", "arm", ">5", "seconds")
    mass = [row["quantities"]["mass_kg"] for row in study_rows(60) if "quantities" in row]
    assert out["shown"] == sum(value > 5 for value in mass)


@needs_browser
def test_plot_leads_to_the_rows(page):
    out = probed(page, """
    const canvas = $("plot-canvas"), plot = $("plot-form"), pen = canvas.getContext("2d");
    const press = key => canvas.dispatchEvent(new KeyboardEvent("keydown", { key }));
    const ink = () => {
      const data = pen.getImageData(0, 0, canvas.width, canvas.height).data, seen = new Set();
      for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 250) seen.add(data.slice(k, k + 3).join());
      return seen.size; };
    out.axes = ["x", "y", "colour"].map(name => plot.elements[name].value); out.said = said("plot-count");
    type(plot.elements.colour, "", "change"); out.plain = ink();
    type(plot.elements.colour, "energy_error", "change"); out.coloured = ink();
    out.legend = said("plot-legend");
    type(plot.elements.colour, "material", "change"); out.words = said("plot-legend");
    canvas.focus(); press("ArrowRight"); out.readout = said("plot-readout");
    press("Enter"); out.chosen = table.querySelector(".chosen td").textContent;
    type(plot.elements.colour, "", "change");
    const data = pen.getImageData(0, 0, canvas.width, canvas.height).data, box = canvas.getBoundingClientRect();
    const spot = data.findIndex((value, k) => k % 4 === 3 && value > 200 && value < 230) >> 2; // let through 15 %
    canvas.dispatchEvent(new PointerEvent("click", { clientX: box.left + spot % canvas.width,
      clientY: box.top + Math.floor(spot / canvas.width) }));
    out.highest = said("plot-readout"); out.clicked = table.querySelector(".chosen td").textContent;
    type(plot.elements.y, "energy_error", "change"); plot.elements.logy.click(); out.log = said("plot-count");
    filter("material", "alloy"); out.filtered = said("plot-count");
    """)  # fmt: skip
    assert out["faults"] == []
    assert out["axes"] == ["thickness", "mass_kg", "material"]
    assert out["said"] == "54 of 60 jobs drawn"
    assert out["coloured"] > out["plain"] + 5
    assert out["legend"].startswith("energy_error:")
    assert "steel" in out["words"]
    job = out["readout"].partition(":")[0]
    assert out["readout"].startswith(f"{job}: thickness = 0.001, material = steel, mass_kg = 2.7")
    assert out["chosen"] == job
    assert "thickness = 0.006" in out["highest"]  # the heaviest is drawn at the top
    assert out["highest"].startswith(f"{out['clicked']}:")
    assert (out["log"], out["filtered"]) == ("54 of 60 jobs drawn", "30 of 30 jobs drawn")


@needs_browser
def test_ten_thousand_jobs_are_a_window_of_rows(tmp_path):
    write_study(study_rows(10_000), tmp_path)
    out = probed(tmp_path / "index.html", """
    out.rows = lines().length; out.said = shown(); out.height = table.offsetHeight;
    const frame = $("study-frame"); frame.scrollTop = 140000; frame.dispatchEvent(new Event("scroll"));
    lines().at(-1).querySelector("a").focus(); const before = document.activeElement.textContent;
    frame.scrollTop += 600; frame.dispatchEvent(new Event("scroll"));
    out.focus = [before, document.activeElement.textContent]; frame.scrollTop = 140000;
    frame.dispatchEvent(new Event("scroll"));
    out.middle = lines()[0].getAttribute("aria-rowindex"); out.index = table.getAttribute("aria-rowcount");
    const seen = frame.getBoundingClientRect(), box = row => row.getBoundingClientRect();
    out.seen = lines().filter(row => box(row).bottom > seen.top && box(row).top < seen.bottom).length;
    frame.scrollTop = 1e9; frame.dispatchEvent(new Event("scroll")); out.last = column("job").at(-1);
    """)  # fmt: skip
    assert out["faults"] == []
    assert out["rows"] < 80
    assert out["said"] == 10_000
    assert out["height"] > 10_000 * 28
    assert 4900 < int(out["middle"]) < 5001
    assert out["index"] == "10002"
    assert out["seen"] >= 15
    assert out["focus"][0] == out["focus"][1]  # of a link whose row is made anew
    assert out["last"] == "arm-9999"


@needs_browser
@pytest.mark.parametrize("count", [0, 5])
def test_page_before_any_job_has_ended_has_no_plot(tmp_path, count):
    write_study([row | {"parameters": {"material": "steel"}} for row in study_rows(count, waiting=count)[1:]], tmp_path)
    out = probed(tmp_path / "index.html", 'out.shown = shown(); out.plot = $("plot-form");')
    assert out == {"faults": [], "shown": max(0, count - 1), "plot": None}


@needs_browser
def test_paper_has_the_first_thousand_rows_and_says_so(tmp_path):
    write_study(study_rows(1200), tmp_path)
    out = probed(tmp_path / "index.html", """
    dispatchEvent(new Event("beforeprint"));
    out.paper = [table.tBodies[0].rows.length, lines().length, said("study-printed")];
    dispatchEvent(new Event("afterprint")); out.rows = lines().length < 80;
    """)  # fmt: skip
    assert out == {"faults": [], "paper": [1000, 1000, "1000 of 1200 jobs."], "rows": True}


@needs_browser
def test_hostile_names_are_only_shown(tmp_path):
    hostile = "</script><script>faults.push('ran')</script><b>{{ 7*7 }}"
    row = {
        "job": hostile,
        "folder": str(tmp_path / "a"),
        "status": "failed",
        "cause": hostile,
        "parameters": {hostile: hostile},
    }
    write_study([row], tmp_path)
    out = probed(tmp_path / "index.html", 'out.jobs = column("job"); out.heads = heads()[1];')
    assert out == {"faults": [], "jobs": [hostile], "heads": hostile}


@needs_browser
def test_narrow_page_scrolls_its_table_inside_the_frame(page):
    out = probed(page, """
    out.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
    out.inside = $("study-frame").scrollWidth > $("study-frame").clientWidth;
    """, flags=("--window-size=500,900",))  # fmt: skip
    assert out == {"faults": [], "wide": 0, "inside": True}
