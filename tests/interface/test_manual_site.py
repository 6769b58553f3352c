"""The manual as a web site, in a browser: nothing runs off the page, nothing comes from outside."""

import functools
import json
import os
import re
import shutil
import subprocess
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
# Every page in a frame, measured at each width once it and its styles are loaded; what moves when
# the width changes comes to rest in half a second.
WALK = """<!doctype html>
<iframe id="f" style="height:900px;border:0;visibility:hidden"></iframe><script>
const frame = document.getElementById("f"), found = [];
const overflow = root => root.scrollWidth - root.clientWidth;
async function walk(pages) {
  for (const page of pages) {
    await new Promise(done => { frame.onload = done; frame.src = page; });
    const d = frame.contentDocument, root = d.documentElement;
    for (const width of [412, 1440]) {
      frame.style.width = width + "px";
      if (overflow(root)) await new Promise(done => setTimeout(done, 500));
      const text = d.querySelector("article").innerText;
      found.push({page, width, overflow: overflow(root),
        outside: frame.contentWindow.performance.getEntriesByType("resource")
          .map(r => r.name).filter(n => !n.startsWith(location.origin)),
        source: (text.match(/--8<--|\\$\\$|\\\\frac|\\\\[([]/g) || []),
        broken: Array.from(d.images).filter(i => i.complete && !i.naturalWidth).map(i => i.src)});
    }
  }
  fetch("found", {method: "POST", body: JSON.stringify(found)});
}
walk(PAGES);
</script>"""


class Site(SimpleHTTPRequestHandler):
    """Hands out the pages, with nothing to search; takes what the browser found."""

    def do_GET(self):
        if self.path.endswith("search_index.json"):  # read anew by every page
            self.path = "/walk.json"
        super().do_GET()

    def do_POST(self):
        self.server.found = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        self.server.shutdown()

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The manual as a site, that of `tests/check` where it has just been built."""
    if built := os.environ.get("RAILSIM_SITE"):
        return Path(built)
    folder = tmp_path_factory.mktemp("site")
    subprocess.run(["mkdocs", "build", "-q", "-d", folder], cwd=ROOT, check=True)
    return folder


@pytest.fixture(scope="module")
def walked(site, tmp_path_factory):
    """Measurements of every page at both widths, and what the browser's console said."""
    pages = sorted(str(p.relative_to(site).parent) + "/" for p in site.rglob("index.html"))
    (site / "walk.html").write_text(WALK.replace("PAGES", json.dumps(pages)), "utf-8")
    index = json.loads((site / "search" / "search_index.json").read_bytes())
    (site / "walk.json").write_text(json.dumps({**index, "docs": []}))
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Site, directory=site))
    log = tmp_path_factory.mktemp("log") / "stderr"
    with log.open("w") as stream:
        browser = subprocess.Popen(
            [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
             f"--user-data-dir={tmp_path_factory.mktemp('profile')}", "--window-size=1500,1000",
             "--remote-debugging-port=0", f"http://127.0.0.1:{server.server_port}/walk.html"],
            stdout=subprocess.DEVNULL, stderr=stream,
        )  # fmt: skip
        late = threading.Timer(300.0, server.shutdown)
        late.start()
        try:
            server.serve_forever()
        finally:
            late.cancel()
            browser.kill()
            server.server_close()
    return json.loads(server.found), re.findall(r"CONSOLE.*", log.read_text("utf-8", "replace"))


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium")
def test_no_page_of_the_manual_runs_off_the_screen_or_needs_a_network(walked):
    found, console = walked
    assert len(found) > 100
    faults = [
        f"{page['page']} at {page['width']}: {page}"
        for page in found
        if page["overflow"] > 0 or page["outside"] or page["source"] or page["broken"]
    ]
    assert faults == [], "\n".join(faults)
    assert console == []
