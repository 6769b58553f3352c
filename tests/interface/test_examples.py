"""Every example runs and makes its picture; the gallery is up to date."""

import importlib.util
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted((ROOT / "examples").glob("[0-9]*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_example_runs_and_draws_its_picture(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("Agg")
    names = runpy.run_path(str(script))
    plt.close("all")
    assert (tmp_path / f"{script.stem}.png").stat().st_size > 10_000
    assert all(axes.lines or axes.patches for axes in names["figure"].axes)
    assert capsys.readouterr().out


def test_gallery_is_up_to_date():
    spec = importlib.util.spec_from_file_location("gallery", ROOT / "docs" / "generate_examples.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    written = {path: path.read_text("utf-8") for path in generate.PAGES.glob("*.md")}
    assert written == generate.pages(), "python docs/generate_examples.py"
    assert len(SCRIPTS) == 10
    assert [p.stem for p in SCRIPTS] == [p.stem for p in sorted(generate.IMAGES.glob("*.png"))]
