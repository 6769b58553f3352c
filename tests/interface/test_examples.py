"""Every example runs, as the notebook that the manual offers; its page shows what it prints."""

import json
import linecache
import re
import runpy

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
from generators import examples as GALLERY

import railsim

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


@pytest.mark.slow
def test_measured_run_is_that_of_today_but_for_its_noise():
    """2 % of the standard deviation; of an older state of railsim 2.2 % at the axlebox."""
    folder = GALLERY.ROOT / "examples" / "measured_run"
    make = runpy.run_path(str(folder / "make.py"))
    settings = {"output_rate": make["RATE"], "outputs": make["OUTPUTS"]}
    track = railsim.load_track(folder / "line" / "track.toml")
    result = railsim.simulate(
        make["true_vehicle"](), track, speed=make["SPEED"], until=500.0,
        settings=railsim.Settings.model_validate(settings),
    )  # fmt: skip
    with h5py.File(folder / "run.h5") as file:
        for channel, point, unit in (
            ("box1y", "axlebox_1_left", make["G"]),
            ("frame1y", "frame_1", 1.0),
        ):
            own = result.series("sensor_acceleration", sensor=point, axis="y") / unit
            measured = file[channel][:]
            share = np.std(measured[: len(own)] - own) / np.std(measured)
            assert share == pytest.approx(0.02, rel=0.03)


def test_gallery_is_up_to_date():
    written = {path: path.read_text("utf-8") for path in GALLERY.PAGES.glob("*.md")}
    assert written == GALLERY.pages(), (
        "python docs/generate.py examples, or examples:pages where texts changed"
    )
    pictures = sorted(GALLERY.IMAGES.glob("*.png"))
    assert [p.stem for p in GALLERY.SCRIPTS] == [p.stem for p in pictures]
