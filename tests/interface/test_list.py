"""``railsim list`` and libraries of others."""

import json
import subprocess
import sys
from contextlib import contextmanager

import pytest

import railsim
from railsim.cli import main
from railsim.definitions.loading import load_vehicle
from railsim.definitions.track.definition import Track
from railsim.errors import InputError
from railsim.files.sources import library_files


def test_list_names_what_is_there(capsys):
    assert main(["list", "vehicles"]) == 0
    out = capsys.readouterr().out
    assert "coach_manchester" in out
    assert "curve_r250" not in out


def test_list_as_json_has_name_title_trust_and_file(capsys):
    assert main(["list", "tracks", "profiles", "--json"]) == 0
    entries = json.loads(capsys.readouterr().out)
    names = {entry["name"] for entry in entries}
    assert {"curve_r250", "S1002", "60E1"} <= names
    assert set(entries[0]) == {"kind", "name", "title", "trust", "file"}


def test_springs_are_graded_by_most_of_their_numbers(capsys):
    """Those of the reference study are printed, those of the example assumed."""
    assert main(["list", "springs", "--json"]) == 0
    entries = json.loads(capsys.readouterr().out)
    assert {entry["name"]: entry["trust"][0] for entry in entries} == {
        "tare_laden_example": "A",
        "turasas_axlebox": "D",
    }


def test_limits_have_letters_of_their_own(capsys):
    """Their [R] says "from memory", where that of vehicles is public code that names its source."""
    assert main(["list", "limits", "--json"]) == 0
    entries = json.loads(capsys.readouterr().out)
    assert {entry["trust"] for entry in entries} == {""}


def test_what_is_offered_as_a_measurement_is_one():
    """Not the track beside it, which `railsim identify` then refuses."""
    for name in library_files("measurement"):
        assert railsim.load_measurement(name).name


def test_unknown_kind_is_refused(capsys):
    assert main(["list", "vehicle"]) == 2
    assert "vehicles" in capsys.readouterr().err


def test_drawing_all_shows_its_progress(tmp_path, monkeypatch):
    """Of 42 pictures, most of a minute, nothing was to be seen."""
    told = []
    bar = contextmanager(lambda *_, **__: iter([told.append]))
    monkeypatch.setattr("railsim.cli.common.progress_bar", bar)
    monkeypatch.setattr(Track, "plot", lambda *_, **__: None)
    assert main(["list", "tracks", "--draw", str(tmp_path / "pictures")]) == 0
    count = len(told)
    assert count > 15
    assert told == pytest.approx([k / count for k in range(1, count + 1)])


@pytest.mark.further
def test_list_draws_every_track(tmp_path, capsys):
    assert main(["list", "tracks", "--draw", str(tmp_path / "pictures")]) == 0
    assert (tmp_path / "pictures" / "turnout_190_1in9.png").stat().st_size > 1000


@pytest.fixture
def own_library(tmp_path, monkeypatch):
    (tmp_path / "vehicles").mkdir()
    (tmp_path / "vehicles" / "my_coach.toml").write_text(
        'format = "railsim-vehicle/1"\nname = "Mine"\nextends = "coach_manchester"\n'
        "[bodies.carbody]\nmass = 40e3\n"
    )
    monkeypatch.setenv("RAILSIM_PATH", str(tmp_path))


def test_a_name_is_looked_for_in_the_folders_of_RAILSIM_PATH(own_library, capsys):
    assert load_vehicle("my_coach").bodies["carbody"].mass == 40e3
    assert main(["list", "vehicles"]) == 0
    assert "my_coach" in capsys.readouterr().out


def test_an_own_file_of_a_shipped_name_comes_first(own_library, tmp_path):
    (tmp_path / "vehicles" / "benchmark_vehicle1.toml").write_text(
        'format = "railsim-vehicle/1"\nname = "Mine"\nextends = "benchmark_vehicle1"\n'
    )
    assert load_vehicle("benchmark_vehicle1").name == "Mine"


def test_library_of_an_installed_package_is_found_by_its_entry_point(tmp_path):
    package = tmp_path / "site" / "their_library"
    (package / "tracks").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "tracks" / "their_track.toml").write_text(
        'format = "railsim-track/1"\nname = "Theirs"\nplan = [{ type = "STR", length = 9.0 }]\n'
    )
    info = tmp_path / "site" / "their_library-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their_library\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[railsim.library]\nthem = their_library\n")
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'site')!r}); import railsim; "
        "print(railsim.load_track('their_track').name)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "Theirs"


def test_unknown_name_suggests_the_nearest_of_all_libraries(own_library):
    with pytest.raises(InputError, match="my_coach"):
        load_vehicle("my_coch")
