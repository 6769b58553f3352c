"""Pages made from files of others, in a real browser: names are texts, and run nothing."""

import html
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from railsim.cli import main
from railsim.page import render_page
from railsim.profiles import load_profile

sys.path.append(str(Path(__file__).parents[1] / "interface"))
from example_result import attributes, example_result

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
HOSTILE = (
    "@SCENE@@TITLE@{{ 7 * 7 }}<img src=x onerror='top.ran=1'><!--<script>top.ran=2</script>"
    '</title></style></script><svg onload="top.ran=3"></svg>"onerror="top.ran=4'
)
FILE = "=1 @SCENE@<img src=x onerror='top.ran=5'>"  # no slash in the name of a file

# of each page: what ran, what is shown, and whether more could run or be fetched
PROBE = """
const found = [];
for (const frame of document.querySelectorAll("iframe")) {
  const w = frame.contentWindow, d = w.document, body = d.body;
  const resources = w.performance.getEntriesByType("resource").length;
  const named = "[aria-label]:not([aria-label='']), [alt]:not([alt=''])";
  const unnamed = Array.from(body.querySelectorAll("img, svg, canvas")).filter(
    e => !e.closest(named)).map(e => e.outerHTML.slice(0, 120));
  const lost = Array.from(d.querySelectorAll("[href], [src]"), e =>
    e.getAttribute("href") || e.getAttribute("src")).filter(to =>
    to[0] === "#" ? !d.getElementById(to.slice(1)) : !to.startsWith("data:"));
  const script = d.createElement("script");
  script.textContent = "window.injected = 1";
  body.append(script);
  const image = d.createElement("div");
  image.innerHTML = "<img src=page0.html onerror='window.injected = 2'>";
  body.append(image);
  await new Promise(done => setTimeout(done, 50));
  found.push({
    ran: window.ran || w.ran || 0, injected: w.injected || 0,
    elements: body.querySelectorAll("img[src=x], svg[onload]").length,
    text: body.innerText + d.title,
    state: ["state", "told"].map(id => (d.getElementById(id) || {}).textContent || "").join(""),
    plots: d.querySelectorAll(".u-wrap canvas").length,
    styled: w.getComputedStyle(body).fontSize,
    resources, unnamed, lost,
  });
}
document.getElementById("found").textContent = JSON.stringify(found);
"""


def called(*arguments):
    assert main([*map(str, arguments)]) == 0, arguments


def pages(folder):
    """Every kind of page, from files with hostile names wherever a name may be any text."""
    name, source = f"name = {json.dumps(HOSTILE)}\n", f"source = {json.dumps(HOSTILE)}\n"
    extends = {
        "vehicle": 'format = "railsim-vehicle/1"\nextends = "coach_manchester"\n',
        "track": 'format = "railsim-track/1"\nextends = "curve_r250"\n',
        "spring": 'format = "railsim-spring/1"\nextends = "turasas_axlebox"\n',
        "mechanism": 'format = "railsim-mechanism/1"\nextends = "watt_axlebox_guide"\n',
    }
    for kind, head in extends.items():
        more = f"remarks = [{json.dumps(HOSTILE)}]\n" if kind == "mechanism" else ""
        (folder / f"{kind}.toml").write_text(head + name + source + more, encoding="utf-8")
    result = example_result(duration=20.0)
    given = attributes() | {"status": "stopped", "status_reason": HOSTILE, "remarks": HOSTILE}
    for key in ("vehicle_toml", "track_toml"):
        given[key] = re.sub("(?m)^name = .*\n", lambda _: name, given[key], count=1)
    profiles = {name: load_profile(name) for name in ("S1002", "60E1")}
    for stem in (FILE, "b"):
        arrays = {key: result[key] for key in result}
        made = type(result)(arrays, result.quantities, result.coordinates, given, profiles)
        made.to_hdf5(folder / f"{stem}.h5")
    shape = {"carbody.y": [1.0, 0.0], "carbody.roll": [0.4, 0.1]}
    mode = {"name": HOSTILE, "frequency": 0.56, "damping_ratio": 0.22, "shape": shape}
    modes = {"vehicle": str(folder / "vehicle.toml"), "modes": [mode]}
    (folder / "modes.json").write_text(json.dumps(modes))
    called("report", folder / f"{FILE}.h5", folder / "b.h5", "--out", folder / "page0.html")
    called("animate", folder / f"{FILE}.h5", "--out", folder / "page1.html")
    called("animate", folder / "modes.json", "--mode", HOSTILE, "--out", folder / "page2.html")
    called("spring", "verify", folder / "spring.toml", "--out", folder / "spring")
    few = ("--set", "sampling.points=21")
    called("mechanism", folder / "mechanism.toml", "--out", folder / "mechanism", *few)
    shutil.copy(folder / "spring" / "report.html", folder / "page3.html")
    shutil.copy(folder / "mechanism" / "report.html", folder / "page4.html")


def found(pages):
    """What a browser finds in each page."""
    frames = "".join(
        f'<iframe src="page{k}.html" width=1200 height=800></iframe>' for k in range(5)
    )
    (pages / "probe.html").write_text(
        f"<body>{frames}<pre id=found></pre><script type=module>"
        f"await new Promise(done => addEventListener('load', done));{PROBE}</script>"
    )
    done = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files",
         f"--user-data-dir={pages / 'profile'}", "--virtual-time-budget=8000", "--dump-dom",
         (pages / "probe.html").as_uri()],
        capture_output=True, text=True, check=False, env={**os.environ, "HOME": str(pages)},
    )  # fmt: skip
    text = re.search(r'<pre id="found">(.+?)</pre>', done.stdout, re.DOTALL)
    assert text, done.stdout[-3000:] + done.stderr[-2000:]
    return json.loads(html.unescape(text[1]))


def names_are_texts(number, page):
    assert page["ran"] == 0, number
    assert page["elements"] == 0, number
    assert "<img src=x onerror='top.ran=" in page["text"], number
    assert "{{ 7 * 7 }}" in page["text"] or number < 2, number


def pictures_have_names_and_links_targets(number, page):
    """For readers who do not see the pictures; pages need no file beside them."""
    assert page["unnamed"] == [], number
    assert page["lost"] == [], number


def nothing_else_runs_or_is_fetched(number, page):
    """Not even if a text had become part of the page: what is injected here does not run."""
    assert page["injected"] == 0, number
    assert page["resources"] == 0, number
    assert page["styled"] in ("14px", "15px"), number


def states_its_policy_before_anything_else(text):
    policy = re.search('<meta http-equiv="Content-Security-Policy" content="(.*?)">', text)
    assert policy.end() < min(
        text.find(f"<{tag}") % len(text) for tag in ("title", "style", "script")
    )
    assert policy[1].startswith("default-src 'none'; img-src data:; style-src 'sha256-")
    assert "unsafe" not in policy[1]
    for block in re.findall('<script type="application/json" id="data">(.*?)</script>', text, re.S):
        assert "<" not in block


@pytest.mark.slow
def test_pages_of_hostile_files_work_and_run_nothing_else(tmp_path):
    """One test: two processes of a test run would make the pages, and start a browser, each."""
    pages(tmp_path)
    for number in range(5):
        text = (tmp_path / f"page{number}.html").read_text(encoding="utf-8")
        states_its_policy_before_anything_else(text)
    if not BROWSER:
        pytest.skip("no chromium: policy of the pages checked, not what a browser shows and runs")
    seen = found(tmp_path)
    assert len(seen) == 5
    for number, page in enumerate(seen):
        names_are_texts(number, page)
        pictures_have_names_and_links_targets(number, page)
        nothing_else_runs_or_is_fetched(number, page)
    assert seen[0]["plots"] > 0
    # the choice of the wheel is not printed
    assert re.search(r"Derailment quotient, wheelset 1 (left|right) ", seen[0]["text"])
    assert seen[1]["state"].startswith("t 0.00 s, s ")
    assert seen[2]["state"].startswith("t 0.00 s")
    assert "driver at" in seen[4]["state"]


def test_data_without_a_value_is_refused():
    """Infinite numbers are no JSON: the page would be empty."""
    with pytest.raises(ValueError, match="not JSON compliant"):
        render_page("railsim.animation", "page.html", title="", styles=[], data=[float("nan")])
