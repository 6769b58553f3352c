"""``railsim report``: the page's content, and the page in a real browser."""

import base64
import json
import os
import re
import shutil
import subprocess
from base64 import b64encode
from hashlib import sha256
from html import escape, unescape
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
import tomli_w
from example_result import example_result, feed
from made_record import Q0, curve, made, track
from test_study import arguments
from test_study import simulated as simulated

import railsim
from railsim.assessment.criteria import CRITERIA
from railsim.cli import main
from railsim.compare import differing, flat_keys
from railsim.definitions import Settings
from railsim.definitions.units_of_keys import unit_of_input, unit_of_key
from railsim.definitions.vehicle.laws import Signal
from railsim.report import drawings
from railsim.report.curves import (
    CELLS,
    MISSING,
    MOST_VALUES,
    cells_of,
    curve_data,
    encode,
    groups,
    thinned,
)
from railsim.report.document import Drawing, Section, day
from railsim.report.drawings import track_svg
from railsim.report.inputs import _settings, inputs_section
from railsim.report.limits import assess_runs
from railsim.report.measured import Part, as_section
from railsim.report.published import published_comparisons, reading
from railsim.report.runs import _lead, _peaks, _remarks, page
from railsim.report.spread import command, spread_rows, worst_rows, worst_runs
from railsim.result import Hdf5Sink, peaks
from railsim.result.export import selected
from railsim.result.extremes import run_facts
from railsim.studies.columns import columns, parameters
from railsim.studies.gathered import gather
from railsim.studies.inputs import inputs_of
from railsim.table import Column, Table
from railsim.text import in_words

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)

SECTIONS = ["peaks", "curves", "limits", "spread", "published", "inputs", "remarks"]

# What a reader does, in both widths: look, move over a plot, zoom into one, choose a wheel.
PROBE = """
function probe(frame) {
  const w = frame.contentWindow, d = w.document, found = {};
  const plots = d.querySelector('[data-plots="0"]').railsimPlots;
  found.errors = w.railsimErrors;
  found.resources = w.performance.getEntriesByType("resource").length;
  found.overflow = d.documentElement.scrollWidth - d.documentElement.clientWidth;
  const edge = d.documentElement.clientWidth + 1, scrolled = ".scroll, svg *";
  found.wide = Array.from(d.querySelectorAll("body *")).filter(e =>
    !e.matches(scrolled) && !e.closest(".scroll") && e.getBoundingClientRect().right > edge
  ).map(e => e.outerHTML.slice(0, 80));
  found.plots = d.querySelectorAll(".u-wrap canvas").length;
  found.sections = Array.from(d.querySelectorAll("section")).map(s => s.id);
  const over = plots[0].over, box = over.getBoundingClientRect(), y = box.top + 0.5 * box.height;
  const at = share => ({clientX: box.left + share * box.width, clientY: y, bubbles: true,
    button: 0, movementX: 9});
  over.dispatchEvent(new w.MouseEvent("mousemove", at(0.3)));
  over.dispatchEvent(new w.MouseEvent("mousemove", at(0.35)));
  found.readings = Array.from(d.querySelectorAll(".readings tbody td")).map(c => c.textContent);
  found.position = d.querySelector(".readings th").textContent;
  found.step = plots[0].data[0][2] - plots[0].data[0][0];
  found.axes = plots.map(u => u.axes.map(a => a.label));
  found.labels = plots[0].axes[1].values(plots[0], [-2e-4, 0, 2e-4, 0.3], 1, 50, 2e-4);
  found.linked = plots.map(u => u.cursor.idx);
  over.dispatchEvent(new w.MouseEvent("mousedown", at(0.3)));
  d.dispatchEvent(new w.MouseEvent("mousemove", at(0.5)));
  over.dispatchEvent(new w.MouseEvent("mousemove", at(0.5)));
  d.dispatchEvent(new w.MouseEvent("mouseup", at(0.5)));
  return new Promise(done => w.setTimeout(() => {
    found.steps = [found.step, plots[0].data[0][2] - plots[0].data[0][0]];
    found.zoomed = plots.map(u => [u.scales.x.min, u.scales.x.max]);
    const side = d.querySelectorAll(".controls select")[1], first = plots[0].data[1].slice();
    side.value = 1 - side.value;
    side.dispatchEvent(new w.Event("change"));
    found.changed = plots[0].data[1].some((v, i) => v !== first[i]);
    const g = plots[0].ctx, c = g.canvas, pixels = g.getImageData(0, 0, c.width, c.height).data;
    found.ink = pixels.filter((v, i) => i % 4 === 3 && v > 0).length / (c.width * c.height);
    found.width = d.documentElement.clientWidth;
    done(found);
  }, 60));
}
"""

# A study: every view, then the table sorted by wheel load change and filtered.
STUDY_PROBE = """
async function probe(frame) {
  const w = frame.contentWindow, d = w.document, box = d.querySelector('[data-plots="spread"]');
  const found = {errors: w.railsimErrors, views: []}, view = box.querySelector("select");
  const settle = () => new Promise(done => w.setTimeout(done, 30));
  for (const kind of [0, 1, 2]) {
    view.value = kind;
    view.dispatchEvent(new w.Event("change"));
    await settle();
    const count = name => box.querySelectorAll(name).length;
    found.views.push([count("canvas"), count("svg rect"), count("svg polyline")]);
    const texts = () => Array.from(box.querySelectorAll("svg text"), t => t.textContent);
    if (kind === 1) {
      found.texts = texts();
      const value = box.querySelectorAll("select")[1], before = value.value;
      const least = Array.from(value.options).find(o => /, smallest/.test(o.textContent));
      for (const one of [least.value, before]) {
        value.value = one;
        value.dispatchEvent(new w.Event("change"));
        await settle();
        const cells = box.querySelectorAll("svg text.cell");
        found.least = found.least || Array.from(cells, cell => Number(cell.textContent));
      }
    }
  }
  const table = d.querySelector('[data-plots="runs"]'), rows = () => Array.from(
    table.querySelectorAll("tbody tr"), row => Array.from(row.cells, cell => cell.textContent));
  const heads = Array.from(table.querySelectorAll("th button"), b => b.textContent);
  table.querySelectorAll("th button")[heads.indexOf("wheel load change, largest (%)")].click();
  found.heads = heads;
  found.rows = rows();
  const filter = table.querySelector("input");
  filter.value = "failed";
  filter.dispatchEvent(new w.Event("input"));
  found.failed = rows();
  table.querySelector("tbody tr").click();
  found.told = table.querySelector(".command").textContent;
  found.overflow = d.documentElement.scrollWidth - d.documentElement.clientWidth;
  return found;
}
"""

TINTS = """
async function probe(frame) {
  const d = frame.contentWindow.document, box = d.querySelector('[data-plots="spread"]');
  const [view, value] = box.querySelectorAll("select"), event = () => new Event("change");
  view.value = 1;
  value.value = Array.from(value.options).find(o => /, smallest/.test(o.textContent)).value;
  value.dispatchEvent(event());
  const all = name => Array.from(box.querySelectorAll(name));
  return {
    ends: all(".scale span").map(e => Number(e.textContent)),
    cells: all("svg text.cell").map(e => Number(e.textContent)),
    fills: all("svg rect").map(e => e.style.fill),
    strong: getComputedStyle(all(".scale i")[0]).backgroundImage.match(/rgb[^)]*\\)/g)[1],
  };
}
"""


# What is read on paper: the names of the runs, and no table beyond the edge.
PAPER = """
function probe(frame) {
  const d = frame.contentWindow.document, edge = d.documentElement.clientWidth + 1;
  return {
    errors: frame.contentWindow.railsimErrors,
    names: Array.from(d.querySelectorAll(".readings .chip")).filter(e => e.offsetWidth > 0)
      .map(e => e.textContent),
    wide: Array.from(d.querySelectorAll("table")).filter(e =>
      e.getBoundingClientRect().right > edge).map(e => e.innerText.slice(0, 80)),
  };
}
"""


def probed(folder, html, probe=PROBE, widths=(1200, 390)):
    """Open a page at desktop and phone width in one browser; return what was found in each."""
    catch = (
        "window.railsimErrors = [];"
        "addEventListener('error', e => railsimErrors.push(String(e.message)));"
    )
    code = b64encode(sha256(catch.encode()).digest()).decode()  # of what its policy lets run
    watched = html.replace("script-src ", f"script-src 'sha256-{code}' ", 1)
    watched = watched.replace("<title>", f"<script>{catch}</script><title>", 1)
    (folder / "page.html").write_text(watched, encoding="utf-8")
    frames = "".join(
        f'<iframe src="page.html" style="width:{w}px;height:900px"></iframe>' for w in widths
    )
    (folder / "probe.html").write_text(
        f"<body>{frames}<pre id=found></pre><script>{probe}"
        "addEventListener('load', async () => { const found = [];"
        "for (const f of document.querySelectorAll('iframe')) { found.push(await probe(f)); }"
        "document.getElementById('found').textContent = JSON.stringify(found); });</script>"
    )
    done = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files",
         f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=8000", "--dump-dom",
         (folder / "probe.html").as_uri()],
        capture_output=True, text=True, check=False, env={**os.environ, "HOME": str(folder)},
    )  # fmt: skip
    text = re.search(r"<pre id=\"found\">(.*?)</pre>", done.stdout, re.DOTALL)
    assert text, done.stderr[-2000:]
    assert text[1], done.stderr[-2000:]
    return json.loads(text[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with three made-up results."""
    path = tmp_path_factory.mktemp("results")
    for name, how in {"a": {}, "b": {"gain": 1.15}, "c": {"gain": 0.7, "speed": 15.0}}.items():
        with Hdf5Sink(path / f"{name}.h5") as sink:
            feed(sink, **how)
    return path


@pytest.fixture(scope="module")
def html(folder):
    out = folder / "report.html"
    assert main(["report", str(folder), "--out", str(out), "--quiet"]) == 0
    return out.read_text(encoding="utf-8")


class Outside(HTMLParser):
    """Everything that a page would fetch."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag == "link" or "src" in given or not given.get("href", "#").startswith("#"):
            self.found.append((tag, given))


def test_page_holds_everything_and_fetches_nothing(html):
    outside = Outside()
    outside.feed(html)
    assert outside.found == []
    assert "@import" not in html
    assert not re.search(r"url\((?!#)", html)
    assert len(html) < 2_000_000
    for words in ("All 3 runs are complete", "Nadal", "Prud", "Manchester primary suspension"):
        assert words in html


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium")
def test_page_works_in_a_browser_at_desktop_and_phone_width(html, tmp_path):
    for found in probed(tmp_path, html):
        assert found["errors"] == []
        assert found["resources"] == 0
        assert found["wide"] == [], found["width"]
        assert found["overflow"] <= 0
        assert found["plots"] == 7  # six quantities, one spread
        assert found["sections"] == SECTIONS
        # read-off: names of the runs, and a value of each quantity
        assert found["readings"][0] == "a"
        assert all(found["readings"][:7])
        assert found["position"].startswith("s = ")
        assert len(set(found["linked"])) == 1
        assert found["linked"][0] > 0
        low, high = found["zoomed"][0]
        assert found["zoomed"] == [[low, high]] * 6
        assert 0.0 < high - low < 0.3 * 980.0  # a fifth of the length was drawn over
        assert found["steps"][1] < 0.7 * found["steps"][0]  # finer where it is zoomed
        assert found["axes"][0] == ["s (m)", "ΔQ/Q₀ (%)"]
        assert all(all(labels) for labels in found["axes"])
        assert [float(text) for text in found["labels"]] == [-2e-4, 0.0, 2e-4, 0.3]
        assert found["changed"]
        assert 0.01 < found["ink"] < 0.9


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium")
def test_printed_page_names_the_runs_of_its_curves_and_cuts_off_no_table(folder, tmp_path):
    long = {f"coach_manchester_curve_r250_{name}": folder / f"{name}.h5" for name in "abc"}
    results = {name: railsim.open_result(file) for name, file in long.items()}
    many = {f"{name}_{k}": r for k in range(4) for name, r in list(results.items())[:2]}
    runs = [{**run_facts(r), "name": n, "labels": {"speed": 10.0}} for n, r in many.items()]
    printed = page("Runs", runs, many).replace("@media print", "@media all")
    printed = printed.replace("@media screen and (max-width", "@media print and (max-width")
    printed = printed.replace("<caption>", "<caption>" + "Name of a vehicle " * 12)
    printed = re.sub("style-src [^;]*", "style-src 'unsafe-inline'", printed)
    # A4 without its margins, at 96 dots per inch
    (found,) = probed(tmp_path, printed.replace("<details", "<details open"), PAPER, (688,))
    assert found["errors"] == []
    assert found["names"] == list(many)
    assert found["wide"] == []


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium")
def test_study_without_results_has_table_curves_map_and_parallel_coordinates(tmp_path):
    runs = []
    for i, record in enumerate(records(3) * 70):
        labels = {**record["labels"], "speed": 10.0 + i % 7, "vehicle": f"coach{i % 2}"}
        runs.append({**record, "name": f"run{i}", "labels": labels})
    runs[5] = {**runs[5], "status": "failed", "status_reason": "no equilibrium", "peaks": []}
    html = page("A study", runs, {}, inputs={"keep": "summary"})
    for found in probed(tmp_path, html, STUDY_PROBE):
        assert found["errors"] == []
        assert found["overflow"] <= 0
        assert found["views"][0] == [1, 0, 0]
        assert found["views"][1] == [0, 14, 0]  # seven speeds, two vehicles
        assert {str(speed) for speed in range(10, 17)} <= set(found["texts"])  # no 11.0, 12.00
        unloading = min(
            peak["value"]
            for run in runs
            for peak in run["peaks"]
            if (peak["quantity"], peak["kind"]) == ("dQ_over_Q0", "min")
        )
        # each cell has runs of all three gains, and shows the strongest unloading of them
        assert found["least"] == [pytest.approx(100.0 * unloading, abs=0.005)] * 14
        assert found["views"][2] == [0, 0, 209]  # the failed run has no values
        assert found["heads"][:4] == ["run", "vehicle", "speed (m/s)", "friction"]
        column = found["heads"].index("wheel load change, largest (%)")
        values = [float(row[column]) for row in found["rows"][:209]]
        assert values == sorted(values, reverse=True)
        assert [row[0] for row in found["failed"]] == ["run5"]
        assert found["told"].startswith("no equilibrium — railsim run coach1 curve --speed 15")


@pytest.mark.skipif(BROWSER is None, reason="no chromium")
def test_the_most_unloaded_wheel_has_the_strongest_colour_of_a_map(tmp_path):
    runs = []
    for i, record in enumerate(records(4)):
        labels = {**record["labels"], "speed": 10.0 + i % 2, "vehicle": f"coach{i // 2}"}
        runs.append({**record, "name": f"run{i}", "labels": labels})
    for found in probed(tmp_path, page("A study", runs, {}), TINTS):
        cells = found["cells"]
        assert found["ends"] == pytest.approx([max(cells), min(cells)], abs=0.01)
        assert found["fills"][cells.index(min(cells))] == found["strong"]
        assert len(set(found["fills"])) == len(cells) == 4


def test_study_without_results_tells_its_inputs_once_and_its_worst_runs(tmp_path, simulated):
    """And is the same study under another name."""
    study = tmp_path / "study.toml"
    study.write_text(
        'format = "railsim-study/1"\nname = "Friction of the curve"\nvehicles = '
        '["coach_manchester"]\ntracks = ["curve_r250"]\nspeeds = [20.0]\nuntil = 40.0\n'
        '[grid]\n"track.friction" = [0.2, 0.3, 0.4, 0.5]\n'
    )
    out = tmp_path / "out"
    given = ["study", str(study), "--out", str(out), "--keep", "summary", "--workers", "1"]
    assert main([*given, "--report"]) == 0
    page_text = (out / "report.html").read_text(encoding="utf-8")
    assert "<h1>Friction of the curve</h1>" in page_text
    assert "None" not in re.sub(r"<script.*?</script>", "", page_text, flags=re.DOTALL)
    for words in (
        "Worst runs",
        "FASTSIM 10 x 10",
        "Passenger coach, Manchester",
        'svg class="drawing"',
    ):
        assert page_text.count(words) >= 1, words
    assert page_text.count("contact damping") == 1
    study.write_text(study.read_text().replace("Friction of the curve", "Friction"))
    assert main(given) == 0


@pytest.mark.parametrize("number", [2, 4])
def test_values_of_analyses_alone_are_shown_however_few(number):
    """They have no peaks and no files."""
    runs = [
        {"name": f"run{k}", "file": "", "labels": {"speed": 20.0 + k}, "status": "complete",
         "quantities": {"hunting.linear": 80.0 - k}}
        for k in range(number)
    ]  # fmt: skip
    text = page("t", runs, {})
    assert "No run has values" not in text
    assert '"values":[80.0,79.0' in re.sub(r"\s", "", text)
    assert ("Largest values" in text) == ("Spread over 4 runs" in text) == (number == 4)
    assert "Worst runs" not in text


def test_values_are_told_in_words():
    assert day("2026-11-03T15:04:20+00:00") == "3 November 2026, 15:04"
    assert in_words(((10, 10), None, True)) == "10, 10, none, yes"
    grid = {"vehicle.primary.stiffness.x": ["16e6", "2e-5"], "track.rail": ["60E1", "54E1"]}
    rows = inputs_section([], {}, {"grid": grid}).tables[0].rows
    assert [words for _, words in rows] == ["16000000, 2e-05", "60E1, 54E1"]
    assert in_words(16e6) == "16000000"
    rails = parameters([{"labels": {"track.rail": rail}} for rail in ("60E1", "54E1")])
    assert rails["track.rail"]["values"] == ["60E1", "54E1"]  # not 600 and 540
    rows = worst_rows([{**r, "labels": {"speed": 20.0 + i}} for i, r in enumerate(records(7))])
    values = [[float(value) for value, _ in row[1:]] for row in rows]
    assert all(row == sorted(row, key=abs, reverse=True) and len(row) == 5 for row in values)
    assert "smallest" in str(rows[1][0])  # of the wheel load: the most unloaded wheel first
    assert values[1][0] < values[1][-1] < 0.0


@pytest.mark.parametrize(("count", "words"), [(1, "1 row: 0, 1"), (2, "2 rows: 0, 1; 0, 1")])
def test_rows_of_a_table_are_counted_in_the_differences(count, words):
    assert flat_keys({"damper": [(0.0, 1.0)] * count}) == [("damper", words)]


def test_tables_that_differ_far_behind_their_beginning_are_differences():
    rows = [(0.01 * k, 100.0 * k) for k in range(12)]
    bogies = {"placements": [{"name": "front", "position": (9.5, 0.0, 0.0)}]}
    one, other = (
        SimpleNamespace(model_dump=lambda end=end: {"damper": [*rows, (1.0, end)], **bogies})
        for end in (5e3, 6e3)
    )
    ((key, words),) = differing([one, other]).items()
    assert key == "damper"
    assert words == ["13 rows: 0, 0; 0.01, 100; 0.02, 200; 0.03, 300; 0.04, 400..."] * 2
    assert flat_keys(bogies) == [("placements", "1 row: name front, position 9.5, 0, 0")]


def test_a_drawn_track_has_its_curvature_and_cant_to_scale_and_wide_curves_their_radius():
    """1 m is one unit across; of -2.5 to 2 1/km and of 0 to 50 mm each is 48 units high."""
    track = railsim.load_track("straight").replace(
        plan=[
            {"type": "STR", "length": 300.0},
            {"type": "CIR", "length": 500.0, "radius": -400.0},
            {"type": "STR", "length": 150.0},
            {"type": "CIR", "length": 50.0, "radius": 500.0},
        ],
        cant=[
            {"type": "CST", "length": 300.0, "cant": 0.0},
            {"type": "LIR", "length": 100.0},
            {"type": "CST", "length": 600.0, "cant": 0.05},
        ],
    )
    drawn = track_svg(track)
    assert re.findall(r'class="curve" x="(\S+)" y="0" width="(\S+)"', drawn) == [
        ("300.0", "500.0"), ("950.0", "50.0"),
    ]  # fmt: skip
    words = re.findall(r'<text x="(\S+)" [^>]*>([^<]*)<', drawn)
    assert words == [
        ("550.0", "R \N{MINUS SIGN}400 m"), ("4", "curvature: -2.5 to 2 1/km"),
        ("4", "cant: 0 to 50 mm"), ("996", "s = 0 to 1000 m"),
    ]  # fmt: skip
    lines = [
        dict(tuple(map(float, point.split(","))) for point in points.split())
        for points in re.findall(r'points="([^"]*)"', drawn)
    ]
    even = [{"type": "CST", "length": 350.0, "cant": 0.05}]  # 350 m: 50 m of it are 143 units
    short = track_svg(track.replace(plan=[track.plan[0], track.plan[3]], cant=even))
    assert ">cant: 50 to 50 mm<" in short
    assert ">R 500 m<" in short
    zero, curvature, level, cant = lines
    assert zero == {0.0: 43.3, 1000.0: 43.3}  # 70 - 48 2.5/4.5
    assert [curvature[s] for s in (100.0, 550.0, 900.0, 975.0)] == [43.3, 70.0, 43.3, 22.0]
    assert level == {0.0: 164.0, 1000.0: 164.0}
    assert [cant[s] for s in (100.0, 350.0, 900.0)] == [164.0, 140.0, 116.0]


def test_drawn_tracks_have_no_lines_of_nothing():
    """Of straight track without cant two lines "0 to 0" were drawn."""
    straight = track_svg(railsim.load_track("straight"))
    assert re.findall(r">([^<]+)<", straight) == ["straight, without cant", "s = 0 to 1000 m"]
    assert "<polyline" not in straight
    curve = railsim.load_track("curve_r250").replace(
        cant=[{"type": "CST", "length": 980.0, "cant": 0.0}]
    )
    words = re.findall(r">([^<]+)<", track_svg(curve))
    assert words == ["R 250 m", "curvature: 0 to 4 1/km", "s = 0 to 980 m"]


def test_friction_beside_a_drawn_track_is_that_of_its_left_and_right_rail():
    """Of 0.35 left and 0.15 right "0.15, 0.35" was told."""
    (used,) = inputs_of([{"name": "a", "labels": {}}], {"a": example_result()})
    wet = [used.track.model_copy(update={"friction": one}) for one in ((0.35, 0.15), (0.4, 0.4))]
    section = inputs_section([used._replace(track=track) for track in wet], {}, {})
    assert "Friction 0.35 / 0.15, 0.4; rails" in section.drawings[-1].words


def test_remarks_on_a_track_stand_beside_its_drawing_and_names_once():
    result = example_result()
    (used,) = inputs_of([{"name": "a", "labels": {}}], {"a": result})
    coach, curve = inputs_section([used], {"a": result}, {}).drawings
    assert curve.words == (
        "Friction 0.4; rails elastic (ballasted). Remarks: plan.2: a cant of 150 mm is more than "
        "(R - 100 m)/2 = 75 mm."
    )
    assert not coach.words.startswith(coach.title)


def test_assumptions_are_those_of_all_runs_of_a_vehicle_on_a_track():
    result = example_result()
    (used,) = inputs_of([{"name": "a", "labels": {}}], {"a": result})
    runs = [used] + [
        used._replace(track=used.track.model_copy(update={"friction": (mu, mu)}))
        for mu in (0.3, 0.35, 0.45)
    ]
    (table,) = (t for t in inputs_section(runs, {}, {}).tables if t.caption == "Assumptions")
    cells = {row[0]: row[1] for row in table.rows}
    assert table.header == ["", "all runs"]
    for mu in ("0.4", "0.3", "0.35"):
        assert f"friction {mu}" in cells["contact"]
    assert cells["contact"].endswith("; and 1 more")
    assert "; or" not in cells["forces"]


def test_assumptions_without_results_are_not_said_to_be_of_all_runs():
    """The files tell those of the first run of each pair, whatever else was varied."""
    (used,) = inputs_of([{"name": "a", "labels": {}}], {"a": example_result()})
    section = inputs_section([used], {}, {"grid": {"track.friction": ["0.4", "0.1"]}})
    assert "of the first run of each vehicle on each track" in section.texts[0]
    (table,) = (t for t in section.tables if t.caption == "Assumptions")
    assert table.header == ["", "first runs"]


def test_inputs_are_those_of_all_runs_also_without_curves():
    """Of eight runs of 36 curves are shown: the page told the inputs of these alone."""
    shown = example_result()
    track = railsim.load_track("straight", ["friction=0.25"])
    other = railsim.simulate(
        railsim.load_vehicle("coach_flexicoil"), track, speed=20.0, duration=0.1
    )
    every = {"a": shown, "b": other}
    records = [{"name": name, "labels": {}, **run_facts(one)} for name, one in every.items()]
    text = unescape(page("page", records, {"a": shown}, assessable=every))
    inputs = text[text.index('id="inputs"') :]
    for words in (other.vehicle().name, track.name, "Differences between the vehicles"):
        assert words in inputs
    assert "friction 0.25" in inputs
    assert inputs.count("flexicoil primary suspension, load 'design' at rest") > 0
    assert 'id="published"' in page("page", records, {"b": other}, assessable=every)


def test_assumptions_of_more_vehicles_on_tracks_than_are_shown_are_counted():
    result = example_result()
    (used,) = inputs_of([{"name": "a", "labels": {}}], {"a": result})
    runs = [used._replace(track_label=f"track {k}") for k in range(6)]
    runs[5] = runs[5]._replace(track=used.track.model_copy(update={"friction": (0.1, 0.1)}))
    (table,) = (t for t in inputs_section(runs, {}, {}).tables if t.caption == "Assumptions")
    assert len(table.header) == 5  # not "all runs"
    assert table.note == "2 more vehicles on tracks."


def test_peaks_of_low_passed_outputs_are_not_said_to_be_of_all_steps():
    """The low pass at 2 Hz takes off what the steps have: the page shows the outputs'."""
    coach, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    how = {"speed": 20.0, "start": 290.0, "duration": 2.0}
    settings = railsim.Settings(outputs={"low_pass": {"frequency": 20.0}}, output_rate=100.0)
    runs = {
        "all": railsim.simulate(coach, track, **how),
        "low": railsim.simulate(coach, track, settings=settings, **how),
    }
    for names, words in (
        (["all"], "over all steps after"),
        (["low"], "over all outputs after"),
        (["all", "low"], "over all outputs, and over all steps where a result holds these, after"),
    ):
        shown = {name: runs[name] for name in names}
        records = [{"name": name, "labels": {}, **run_facts(one)} for name, one in shown.items()]
        assert words in page("page", records, shown)


def test_reasons_of_all_verdicts_are_told_once_and_points_below_a_body_are_below():
    found = assess_runs({"run": example_result()})[1]
    verdicts = next(table for table in found.tables if table.caption.startswith("Verdicts"))
    reasons = [row[2] for row in verdicts.rows]
    assert len(reasons) == len(set(reasons))
    assert "all of these" in [row[0] for row in verdicts.rows]
    setup = next(table for table in found.details if table.caption.startswith("Vehicle,"))
    places = {row[0]: row[1] for row in setup.rows}
    assert places["measuring point floor_rear"] == (
        "on carbody, 9.50 m behind the reference body's origin, 0.60 m below that of its body"
    )
    assert not any("-0.00" in words for words in places.values())


def test_a_run_without_forces_leaves_its_vehicle_without_a_verdict_and_that_is_said():
    whole = example_result()
    part = selected(whole, ["Q"])
    verdicts, _ = assess_runs({"whole": whole, "part": part})
    words = "not assessed to EN 14363; the remarks on these values say why."
    assert [text for _, text in verdicts] == [f"{whole.vehicle().name}: {words}"]
    assert assess_runs({"part": part})[0] == []  # kept without forces: nothing was to be assessed


def test_values_that_do_not_exist_are_no_nan_on_the_page():
    """The only section of zone 4 has no standard deviation and so no estimate."""
    for criterion in CRITERIA.values():
        assert criterion.text(float("nan")) == "-"


def test_thinned_curves_keep_every_peak_and_their_order():
    axis = np.linspace(0.0, 100.0, 5001)
    values = np.stack([np.sin(axis) + 0.3 * np.sin(37.0 * axis), axis], axis=1)
    thin = thinned(axis, values, np.linspace(0.0, 100.0, 41))
    for cell in range(40):
        inside = (axis >= 2.5 * cell) & ((axis < 2.5 * (cell + 1)) | (cell == 39))
        pair = thin[2 * cell : 2 * cell + 2]
        assert pair.min(axis=0) == pytest.approx(values[inside].min(axis=0), abs=0.0)
        assert pair.max(axis=0) == pytest.approx(values[inside].max(axis=0), abs=0.0)
    assert np.all(np.diff(thin[:, 1]) > 0.0)


def test_cells_without_an_instant_are_interpolated_and_none_is_made_up_beyond_the_run():
    axis = np.array([10.0, 20.0, 30.0])
    thin = thinned(axis, axis[:, None], np.linspace(0.0, 40.0, 17))
    there = np.isfinite(thin[:, 0])
    positions = np.ravel([[2.5 * c + 0.625, 2.5 * c + 1.875] for c in range(16)])
    assert np.all(there[(positions > 12.5) & (positions < 30.0)])
    assert not there[(positions < 10.0) | (positions > 32.5)].any()
    assert np.all(np.diff(thin[there, 0]) >= 0.0)


def test_coded_values_are_right_to_half_a_step():
    values = np.array([[-3.0, 0.1, np.nan, 8.0]])
    low, high, text = encode(values)
    codes = np.frombuffer(base64.b64decode(text), "<u2")
    assert codes[2] == MISSING
    back = low + codes[[0, 1, 3]] * (high - low) / (MISSING - 1)
    assert back == pytest.approx(values[0, [0, 1, 3]], abs=0.5 * 11.0 / (MISSING - 1))


@pytest.mark.parametrize(
    ("vehicles", "words"),
    [("a", "vehicle a"), ("abcd", "vehicles a, b, c, d"), ("abcde", "5 vehicles")],
)
def test_the_head_of_a_page_names_few_vehicles_and_counts_many(vehicles, words):
    records = [{"labels": {"vehicle": name, "track": "t"}} for name in vehicles]
    number = f"{len(vehicles)} run{'s' * (len(vehicles) > 1)}"
    assert _lead(records, {}) == f"{number}; {words}; track t."


@pytest.mark.parametrize(
    ("speeds", "words"),
    [
        ([8.0], "speed 8 m/s"),
        ([8.0, 22.5, 8.0], "speeds 8, 22.5 m/s"),
        ([30.0, 10.0, 15.0, 20.0, 25.0], "5 speeds from 10 to 30 m/s"),
    ],
)
def test_the_head_of_a_page_says_the_speeds_of_its_runs(speeds, words):
    records = [{"labels": {"vehicle": "a", "track": "t", "speed": speed}} for speed in speeds]
    assert _lead(records, {}).endswith(f"; vehicle a; track t; {words}.")


def test_the_head_of_the_page_of_one_run_says_its_load_case_and_speed():
    result = example_result(speed=20.0)
    records = [{"labels": {"vehicle": "a", "track": "t", "speed": 20.0}}]
    assert f"; {result.title}; " in _lead(records, {"run": result})
    assert "at 20 m/s (72 km/h)" in result.title


@pytest.mark.parametrize(("way", "axis"), [(0.9, "Time t (s)"), (1.1, "Distance along the track")])
def test_curves_of_a_run_of_less_than_a_metre_are_drawn_over_time(way, axis):
    """Of two instants, and beside a run that goes on."""
    moving = made(track({"type": "STR", "length": 500.0}), 20.0)
    rows = [0, np.argmin(np.abs(moving["distance"] - moving["distance"][0] - way))]
    first = moving["distance"][rows]
    assert np.ptp(first) == pytest.approx(way, abs=0.09)
    count = len(moving["time"])
    arrays = {n: v[rows] if len(v := moving[n]) == count else v for n in moving}
    short = railsim.Result(arrays, moving.quantities, moving.coordinates, moving.attributes)
    for runs in ({"short": short}, {"long": moving, "short": short}):
        data = curve_data(runs)
        assert data["axis"].startswith(axis)
        over = "time" if axis[0] == "T" else "distance"
        assert data["low"] == min(run[over][0] for run in runs.values())
        assert data["high"] == max(run[over][-1] for run in runs.values())


def test_curves_are_thinned_by_the_run_with_most_wheelsets():
    """Two bytes for each of nine curves a wheelset, smallest and largest value of every cell."""
    single, long = SimpleNamespace(wheelsets=["1"]), SimpleNamespace(wheelsets=[*"12345678"])
    for runs in ({"a": single, "b": long}, {"a": long, "b": single}):
        assert cells_of([runs]) == min(CELLS, MOST_VALUES // (2 * 2 * 8 * 9))
    assert cells_of([{str(k): long for k in range(40)}] * 2) == MOST_VALUES // (2 * 80 * 8 * 9)


def test_runs_over_other_tracks_are_drawn_apart():
    one = example_result()
    found = groups({"a": one, "b": example_result(gain=2.0)})
    assert [list(group) for group in found] == [["a", "b"]]
    data = curve_data(found[0])
    (q,) = [q for q in data["quantities"] if q["name"] == "dQ_over_Q0"]
    assert q["high"] == pytest.approx(200.0 * one.dQ_over_Q0.max())
    assert (q["unit"], q["limit"]) == ("%", None)  # of twisted track at walking speed alone
    (quotient,) = [q for q in data["quantities"] if q["name"] == "Y_over_Q"]
    assert quotient["limit"] == 0.8


def records(number):
    runs = []
    for i in range(number):
        facts = run_facts(example_result(gain=1.0 + i / number, rate=5.0))
        labels = {
            "vehicle": "coach",
            "track": "curve",
            "speed": 20.0,
            "track.friction": f"0.{i + 1}",
        }
        runs.append({"name": f"run{i}", "file": "", "labels": labels, **facts})
    return runs


def test_parameters_have_the_units_that_the_manual_says():
    """Mass [kg], stiffness of a bushing [N/m], damping of a damper and of a roll bar."""
    inputs = inputs_of([], {"a": example_result()})
    units = {
        "vehicle.bodies.carbody.mass": "kg",
        "vehicle.primary.stiffness.x": "N/m",
        "vehicle.secondary_vertical_damper.damping": "N s/m",
        "vehicle.anti_roll_bar.stiffness": "N m/rad",
        "track.friction": "",
        "track.cant.1.cant_end": "m",
        "settings.output_rate": "1/s",
        "vehicle.nothing.mass": "",
        "speed": "",
    }
    assert {key: unit_of_input(inputs[0], key) for key in units} == units
    signal = Signal(quantity="speed")
    keys = ("noise", "quantity", "delay")  # the first has the unit of the second, whichever
    assert [unit_of_key(signal, key) for key in keys] == ["", "", "s"]
    runs = [{**r, "labels": {"vehicle.carbody.mass": f"{i}e4"}} for i, r in enumerate(records(5))]
    found = page("t", runs, {"run0": example_result(), "run1": example_result()})
    assert '"unit":"kg"' in found
    assert "mass 40000 kg" in found
    own = [{"labels": {"track.speed": f"{speed}km/h"}} for speed in (60, 80)]
    found = parameters(own, {"track.speed": "m/s"})["track.speed"]
    assert (found["unit"], found["values"]) == ("m/s", pytest.approx([60.0 / 3.6, 80.0 / 3.6]))
    own = [{"labels": {"track.rounding": text}} for text in ("900 mm", "10m", "2.0")]
    assert parameters(own)["track.rounding"]["values"] == [0.9, 10.0, 2.0]  # in order, not as words


def test_spread_has_the_values_of_every_run():
    runs = records(4)
    assert list(parameters(runs)) == ["track.friction"]
    assert parameters(runs)["track.friction"]["values"] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert command(runs[1], {}) == ""  # of a result file alone: labels are names of vehicles
    scenario = {"scenario": "en14363", "vehicles": ["../coach.toml"], "tracks": []}
    campaign = "railsim study --scenario en14363 --vehicles ../coach.toml"
    assert command({"labels": {**runs[1]["labels"], "seed": 11}}, scenario) == campaign
    assert command(runs[1], {"vehicles": ["../coach.toml"], "until": 400.0}) == (
        "railsim run ../coach.toml curve --speed 20 --until 400 --set track.friction=0.2"
    )
    column = columns(runs)["Y_abs"]
    assert column["unit"] == "kN"
    assert column["values"] == pytest.approx([32.0, 40.0, 48.0, 56.0], rel=1e-5)
    words = "guiding force, peak magnitude (kN)"
    assert [words, "32.00", "run0", "44.00", "56.00", "run3"] in spread_rows(runs)
    assert (spread_rows(runs[:2]), len(spread_rows(runs[:3])) > 0) == ([], True)  # three at least
    assert worst_runs(runs, 2) == ["run2", "run3"]
    assert worst_runs(runs, 9) == ["run0", "run1", "run2", "run3"]


def test_vehicles_of_one_name_from_two_files_are_shown_apart():
    runs = records(2)
    runs[1] = {**runs[1], "labels": {**runs[1]["labels"], "vehicle": "softer_coach"}}
    text = page("t", runs, {"run0": example_result(), "run1": example_result()})
    assert "Differences between the vehicles" in text
    assert "<b>coach</b>" in text
    assert "<b>softer_coach</b>" in text


def test_a_table_of_one_row_is_a_difference_of_vehicles():
    """A motor's constant torque, which only one of two vehicles has."""
    runs = records(2)
    runs[1] = {**runs[1], "labels": {**runs[1]["labels"], "vehicle": "driven_coach"}}
    one, other = example_result(), example_result()
    motor = {
        "kind": "traction",
        "bodies": ["frame", "outer.wheelset"],
        "torque_table": [[0.0, 800]],
    }
    driven = one.vehicle().model_dump(exclude_none=True)
    driven["assemblies"]["bogie"]["elements"]["motor"] = motor
    attributes = {**other.attributes, "vehicle_toml": tomli_w.dumps(driven)}
    other = railsim.Result(
        {name: other[name] for name in other}, other.quantities, other.coordinates, attributes,
        other.profiles,
    )  # fmt: skip
    text = page("t", runs, {"run0": one, "run1": other})
    assert "motor.torque_table" in text
    assert "0, 800" in text


def test_failures_and_remarks_are_told_and_names_are_shown_literally():
    runs = records(3)
    runs[0]["remarks"] = runs[1]["remarks"] = ["A wheel lifts <b>off</b>."]
    reason = "there is no equilibrium </script>"
    runs[2] = {**runs[2], "status": "failed", "status_reason": reason, "peaks": []}
    text = page("<i>t</i>\x1b", runs, {"run0": example_result()}, ["1 of 3 runs has no file."])
    assert "Of 3 runs 2 complete, 1 failed." in text
    assert "A wheel lifts &lt;b&gt;off&lt;/b&gt;." in text
    assert text.count("A wheel lifts") == 1
    assert "run0, run1" in text
    assert "no equilibrium &lt;/script&gt;" in text
    assert "<i>t</i>" not in text
    assert "\x1b" not in text
    assert "1 of 3 runs has no file." in text


def test_published_values_stand_beside_the_run_they_belong_to():
    result = example_result()
    rows = {row.value.quantity: row for row in published_comparisons({"a": result})}
    assert set(rows) == {"dQ_over_Q0", "sum_abs_Y", "Y_over_Q", "wheelset_roll", "wheelset_yaw",
                         "wheelset_lateral"}  # fmt: skip
    largest = result.dQ_over_Q0[:, 0, 0].max()
    assert rows["dQ_over_Q0"].computed == largest
    assert rows["dQ_over_Q0"].difference == pytest.approx(largest / 0.3792 - 1.0)
    instant = int(np.argmin(np.abs(result.time - 19.8)))
    assert rows["wheelset_yaw"].computed == result.wheelset_yaw[instant, 0]
    assert published_comparisons({"a": example_result(speed=19.0)}) == []
    value = rows["wheelset_yaw"].value
    assert reading(example_result(duration=10.0), value) is None


def test_study_is_reported_with_its_failures(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path / "s", 10, 12, 13, 99)) == 1
    assert main(["report", str(tmp_path / "s"), "--out", str(tmp_path / "r.html"), "--json"]) == 0
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "Of 4 runs 2 complete, 1 failed, 1 derailed." in text
    assert "there is no equilibrium at 13 m/s" in text
    os.remove(tmp_path / "s" / "coach_manchester_curve_r250_10.h5")
    assert main(["report", str(tmp_path / "s"), "--out", str(tmp_path / "q.html")]) == 0
    told = "1 of 4 runs in"
    assert told in (tmp_path / "q.html").read_text(encoding="utf-8")


def test_page_of_failed_runs_alone_does_not_say_that_results_were_left_out(tmp_path, simulated):
    assert main(arguments(tmp_path / "s", 13)) == 1
    assert main(["report", str(tmp_path / "s"), "--out", str(tmp_path / "r.html")]) == 0
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "No run has values; why stands under the failures below." in text
    assert "there is no equilibrium at 13 m/s" in text
    assert "kept no results" not in text


def test_runs_that_ended_early_are_called_so_beside_their_curves_and_peaks():
    results = {"whole": example_result(), "short": example_result(status="derailed")}
    (group,) = groups(results)
    assert curve_data(group)["runs"] == ["whole", "short · derailed"]
    peaks = _peaks([{"name": name, **run_facts(one)} for name, one in results.items()], results)
    assert peaks.tables[0].header == ["", "whole", "short · derailed"]
    # of a peak that one run alone has, the other cell is empty: every row is as long as the head
    records = [{"name": name, **run_facts(one)} for name, one in results.items()]
    for without in (0, 1):
        changed = [dict(record) for record in records]
        changed[without]["peaks"] = changed[without]["peaks"][1:]
        rows = _peaks(changed, results).tables[0].rows
        assert {len(row) for row in rows} == {3}
        assert [row[1 + without] for row in rows].count("") == 1
        assert "" not in [row[2 - without] for row in rows]


def test_study_writes_its_report_where_asked(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10, more=["--report"])) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(tmp_path / "report.html")
    assert "The run is complete." in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["nowhere.h5"], "nowhere.h5"),
        (["."], "no results in this folder"),
        (["nowhere.h5", "--out", "r.pdf"], "must end in .html"),
    ],
)
def test_what_cannot_be_reported_is_told_in_a_line(tmp_path, monkeypatch, capsys, given, words):
    monkeypatch.chdir(tmp_path)
    assert main(["report", *given]) == 2
    assert words in capsys.readouterr().err
    assert os.listdir(tmp_path) == []


def test_peaks_of_the_page_are_those_of_the_result(html, folder):
    from railsim.result import open_result

    for peak in peaks(open_result(folder / "b.h5")):
        assert peak.quantity.text(peak.value) in html


def test_page_and_assessment_of_a_folder_agree(tmp_path, capsys):
    """More runs than curves are shown of, and quantities for curves were left out."""

    def Y(t, s):
        return np.stack([np.full(s.shape, -20e3), np.full(s.shape, 5e3)], axis=-1)

    folder = tmp_path / "runs"
    folder.mkdir()
    on = track(*curve(300.0, 300.0), cant=0.12)
    for number in range(3):
        run = made(on, 22.8 + 0.1 * number, Y=Y, without=("Y_over_Q",))
        run.to_hdf5(folder / f"run{number}.h5")
    page = tmp_path / "page.html"
    assert main(["report", str(folder), "--out", str(page), "--curves", "1", "--quiet"]) == 0
    assert main(["assess", str(folder), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    html = page.read_text()
    verdicts = {name: one["verdict"] for name, one in found["verdicts"].items()}
    assert (
        f"{found['verdict']} (running safety {verdicts['safety']}, track loading "
        f"{verdicts['loading']}, ride {verdicts['ride']})" in html
    )
    row = next(q for z in found["zones"] for q in z["quantities"] if q["name"] == "Y_qst")
    assert row["N"] == 3 * 4
    assert f"{100.0 * row['share']:.0f} %, {row['place']}" in html
    assert all(escape(condition["found"]) in html for condition in found["conditions"])
    assert html.count("run2") > 0
    # verdicts that are incomplete for the same reasons: neither green nor red, each reason once
    named = found["vehicle"]
    assert set(verdicts.values()) == {"incomplete"}
    assert f'<p class="verdict open">{escape(named)}, ' in html
    for reason in found["verdicts"]["safety"]["reasons"]:
        assert html.count(f">{escape(reason)}<") == 1
    # a section without curves says so instead of showing controls
    assert "The results hold none of the quantities that are drawn here." in html
    assert '"curves":[]' in html


def test_a_comparison_among_runs_has_its_first_table_open_and_all_others_folded():
    tables = [Table([Column("place")], [[k]], caption=f"of {k}") for k in range(4)]
    sections = [Section("one", ["first"], tables[:2], [drawn := Drawing("picture", "", "svg")])]
    sections += [Section("none", ["second"]), Section("two", [], tables[2:])]
    found = as_section(Part("against a test", "It matches.", True, ["rough"], sections, []), 3)
    assert (found.title, found.id) == ("against a test", "measured3")
    assert found.texts == ["It matches.", "rough", "first", "second"]
    assert found.drawings == [drawn]
    assert [table.caption for table in found.tables] == ["one: of 0"]
    assert [table.caption for table in found.details] == ["one: of 1", "two: of 2", "two: of 3"]


def test_assessments_of_two_vehicles_of_one_name_stand_side_by_side():
    """The one that exceeds Y/Q 0.8 is not hidden by the other, whichever comes first."""
    on = track(*curve(300.0, 300.0), cant=0.12)
    texts = [railsim.load_vehicle("coach_manchester").model_copy(update={"source": name}).to_toml()
             for name in ("one", "other")]  # fmt: skip

    def pushed(force, text):
        force_on = np.array([-force, 0.0])
        return made(on, 23.0, Y=lambda t, s: np.tile(force_on, (*s.shape, 1)), vehicle=text)

    for forces in ((80e3, 10e3), (10e3, 80e3)):
        runs = dict(zip("ab", map(pushed, forces, texts), strict=True))
        _, section = assess_runs(runs)
        zone = next(table for table in section.tables if "zone 4" in table.caption)
        assert [name[-3:] for name in zone.header[1:3]] == ["(a)", "(b)"]
        quotient = next(k for k, row in enumerate(zone.rows) if "quotient" in row[0][0])
        assert quotient in zone.failed
        large = zone.rows[quotient][1 + forces.index(80e3)]
        assert large[1].startswith(f"{100.0 * 80e3 / Q0 / 0.8:.0f} %")


def test_assessments_of_a_grid_are_told_apart_by_its_values():
    coach, on = railsim.load_vehicle("coach_manchester"), track(*curve(300.0, 300.0), cant=0.12)
    path = "bodies.carbody.mass"
    texts = [coach.with_values({path: mass}).to_toml() for mass in (40e3, 41e3)]
    runs = {f"run{k}": made(on, 23.0, vehicle=text) for k, text in enumerate(texts)}
    _, section = assess_runs(runs)
    zone = next(table for table in section.tables if "zone 4" in table.caption)
    assert [name[-20:] for name in zone.header[1:3]] == [
        f"(carbody mass {m})" for m in (40000, 41000)
    ]


def test_vehicles_are_shown_at_rest_in_their_load_case(tmp_path):
    coach = railsim.load_vehicle("coach_manchester", ["load=laden"])
    result = railsim.simulate(coach, railsim.load_track("straight"), speed=20.0, duration=0.1)
    result.to_hdf5(tmp_path / "one.h5")
    assert main(["report", str(tmp_path / "one.h5"), "--out", str(tmp_path / "r.html")]) == 0
    text = unescape((tmp_path / "r.html").read_text(encoding="utf-8"))
    for part in ("Static wheel loads", "Heights", "Springs", "Weights", "Natural frequencies"):
        assert f"{coach.name}, load 'laden' at rest: {part}" in text


def test_settings_other_than_the_default_are_marked_and_the_usual_six_always_shown():
    def run(**settings):
        return SimpleNamespace(settings=lambda: Settings(**settings), attributes={"step": 1e-3})

    shown = {"scheme", "step", "output_rate", "creep_law", "fastsim_grid", "normal_contact"}
    rows = {key: (value, mark) for key, value, mark in _settings({"a": run()}).rows}
    assert set(rows) == shown
    assert {mark for _, mark in rows.values()} == {""}
    both = {"a": run(), "b": run(creep_law="polach", contact_damping=0.0)}
    rows = {key: (value, mark) for key, value, mark in _settings(both).rows}
    assert set(rows) == shown | {"contact_damping"}
    assert {key for key, (_, mark) in rows.items() if mark} == {"creep_law", "contact_damping"}
    assert rows["creep_law"] == (f"{Settings().creep_law}, polach", "changed")
    assert rows["step"] == ("1 ms", "")


def test_results_are_counted_once_and_told_apart_by_their_folders(tmp_path, capsys):
    """A file beside its folder was a second run, and its sections counted twice."""
    folders = [tmp_path / name for name in ("a/results", "b/results", "c")]
    for folder, gain in zip(folders, (1.0, 1.2, 1.4), strict=True):
        folder.mkdir(parents=True)
        example_result(gain=gain).to_hdf5(folder / "run.h5")
    out = str(tmp_path / "page.html")
    for again in (folders[0] / "run.h5", folders[0] / ".." / "results"):
        assert main(["report", str(folders[0]), str(again), "--out", out]) == 2
        assert "given twice; give each result once" in capsys.readouterr().err
    for given in (folders, folders[::-1]):
        found = gather([str(folder) for folder in given])
        expected = [f"{folders[0]}/run", f"{folders[1]}/run", "c/run"]
        assert sorted(found.paths) == sorted(expected)
        assert found.paths["c/run"] == folders[2] / "run.h5"


def test_a_report_opens_each_result_once_beside_its_facts(folder, tmp_path, monkeypatch):
    opened, open_run = [], railsim.result.open_run
    monkeypatch.setattr(
        "railsim.studies.gathered.open_run", lambda path: opened.append(path.name) or open_run(path)
    )
    gather([str(folder)])
    facts = sorted(opened)
    opened.clear()
    assert main(["report", str(folder), "--out", str(tmp_path / "page.html"), "--quiet"]) == 0
    assert sorted(opened) == sorted(2 * facts) == sorted(2 * ["a.h5", "b.h5", "c.h5"])


def test_ends_are_counted_by_their_reason_without_its_numbers_the_most_first():
    def record(name, status, reason="", *remarks):
        return {"name": name, "status": status, "status_reason": reason, "remarks": remarks}

    records = [
        record("a", "failed", "no equilibrium"),
        record("b", "complete", "", "coarse"),
        record("c", "derailed", "at 12.5 m"),
        record("d", "derailed", "at 130 m", "coarse"),
        record("e", "derailed", "wheel 2 off"),
    ]
    section = _remarks(records, ["one sentence"])
    ends, remarks = section.tables
    assert ends.caption == "4 of 5 runs did not reach the requested end"
    assert [row[:3] for row in ends.rows] == [
        ["2", "derailed", "at 12.5 m"],
        ["1", "failed", "no equilibrium"],
        ["1", "derailed", "wheel 2 off"],
    ]
    assert remarks.rows == [["coarse", "b, d"]]
    assert section.texts == ["one sentence"]
    assert len(_remarks(records[1:2], []).texts) == 1


@pytest.mark.parametrize("y", [0.0, 0.1])
def test_a_wheelset_seen_from_above_is_its_axle_and_two_wheels(y):
    """From the side a circle; the left wheel is at negative y."""
    wheelset = SimpleNamespace(radius=(0.46, 0.42), tape_circle_distance=1.5)
    body = SimpleNamespace(wheelset=wheelset, position=(9.0, y, -0.46), name="a<b")
    found = [
        re.findall(r"[-.\d]+,[-.\d]+", text) for text in drawings._wheelset(body, drawings.TOP)
    ]
    axle, left, right = (np.array([one.split(",") for one in line], float) for line in found)
    assert axle == pytest.approx(np.array([[9.0, y - 0.75], [9.0, y + 0.75]]))
    assert left == pytest.approx(np.array([[8.54, y - 0.75], [9.46, y - 0.75]]))
    assert right == pytest.approx(np.array([[8.58, y + 0.75], [9.42, y + 0.75]]))
    (circle,) = drawings._wheelset(body, drawings.SIDE)
    assert 'cx="9.000" cy="-0.460" r="0.420"><title>a&lt;b</title>' in circle
