"""Every example runs, as the notebook that the manual offers; its page shows what it prints."""

import json
import linecache
import re

import matplotlib.pyplot as plt
import pytest
from generators import examples as GALLERY

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


LONG = {  # some seconds and more; what they show has tests of its own
    "13_does_my_model_match",
    "14_which_spring_is_soft",
    "15_coach_as_recording_car",
    "17_through_a_crossing",
    "19_wheel_slide_protection",
    "20_speed_control",
    "21_active_steering",
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "script",
    [
        pytest.param(script, marks=[pytest.mark.further] if script.stem in LONG else [])
        for script in GALLERY.SCRIPTS
    ],
    ids=lambda script: script.stem,
)
def test_example_runs_and_draws_its_picture(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("Agg")
    names = {"__name__": "__main__"}
    for number, cell in enumerate(json.loads(GALLERY.notebook(script))["cells"]):
        if cell["cell_type"] == "code":
            # a notebook keeps the sources of its cells here, too
            lines, name = cell["source"].splitlines(keepends=True), f"<{script.stem} {number}>"
            linecache.cache[name] = (len(cell["source"]), None, lines, name)
            exec(compile(cell["source"], name, "exec"), names)
    plt.close("all")
    assert (tmp_path / f"{script.stem}.png").stat().st_size > 10_000
    assert all(axes.lines or axes.patches for axes in names["figure"].axes)
    printed, written = capsys.readouterr().out, GALLERY.output(GALLERY.PAGES / f"{script.stem}.md")
    assert NUMBER.sub("", printed).split() == NUMBER.sub("", written).split()


def test_gallery_is_up_to_date():
    written = {path: path.read_text("utf-8") for path in GALLERY.PAGES.glob("*.md")}
    assert written == GALLERY.pages(), (
        "python docs/generate.py examples, or examples:pages where texts changed"
    )
    pictures = sorted(GALLERY.IMAGES.glob("*.png"))
    assert [p.stem for p in GALLERY.SCRIPTS] == [p.stem for p in pictures]
