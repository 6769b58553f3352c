"""Laws of libraries and installed packages: found, listed, executed by permission alone."""

import os
import subprocess
import sys

import pytest
from generators.keys import json_schema

import railsim
from railsim import laws
from railsim.cli import main
from railsim.errors import InputError

LAW = '''"""A damper of somebody else.

Second line.
"""

from pathlib import Path

Path({executed!r}).write_text("executed")


def their_damper(deflection, rate, c=30e3):
    return c * rate


def their_wave(s):
    return 0.0
'''
VEHICLE = """format = "railsim-vehicle/1"
extends = "coach_manchester"
name = "Theirs"

[elements.damper]
kind = "law"
law = "their_damper"
bodies = ["carbody", "front.frame"]
points = [[9.5, 0.0, -0.9], [9.5, 0.9, -0.9]]
"""
TRACK = """format = "railsim-track/1"
extends = "curve_r250"
name = "Their track"
irregularities = [{ type = "law", law = "wave", shortest = 3.0 }]

[laws.wave]
file = "their_damper"
function = "their_wave"
"""


@pytest.fixture
def executed(tmp_path, monkeypatch):
    """A package with a law, as its installation leaves it; the file that the law would write."""
    site = tmp_path / "site"
    (site / "theirs" / "laws").mkdir(parents=True)
    (site / "theirs" / "__init__.py").write_text("")
    written = tmp_path / "executed"
    (site / "theirs" / "laws" / "their_damper.py").write_text(LAW.format(executed=str(written)))
    info = site / "theirs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[railsim.library]\ntheirs = theirs\n")
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.delitem(sys.modules, "theirs", raising=False)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(laws.PERMITTED, raising=False)
    (tmp_path / "coach.toml").write_text(VEHICLE)
    (tmp_path / "track.toml").write_text(TRACK)
    return written


def test_looking_executes_nothing(executed, capsys, undrawn):
    assert main(["list", "laws", "vehicles"]) == 0
    assert "their_damper  A damper of somebody else." in capsys.readouterr().out
    assert main(["validate", "coach.toml", "track.toml"]) == 0
    assert "coach.toml: laws.their_damper: remark: not executed here" in capsys.readouterr().out
    assert main(["info", "coach.toml", "--static"]) == 0
    with undrawn():  # what is drawn is made
        assert main(["info", "track.toml", "--draw", "track.png"]) == 0
        assert main(["plot", "track.toml", "--out", "plan.png"]) == 0
    json_schema("railsim-vehicle/1")
    words = {"_RAILSIM_COMPLETE": "bash_complete", "COMP_WORDS": "railsim run c", "COMP_CWORD": "2"}
    code = "import sys; from railsim.cli import main; sys.exit(main())"
    path = os.pathsep.join(sys.path)
    ran = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **words, "PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "coach_manchester" in ran.stdout
    assert not executed.exists()


def test_a_law_of_a_package_runs_by_permission(executed, capsys):
    run = ["run", "coach.toml", "curve_r250", "--speed", "20", "--until", "2", "--quiet"]
    assert main([*run, "--out", "no.h5"]) == 2
    assert "'their_damper' is code of their_damper.py, which is not" in capsys.readouterr().err
    assert not executed.exists()
    assert main([*run, "--out", "run.h5", "--law", "their_damper"]) == 0
    assert executed.exists()
    executed.unlink()
    result = railsim.open_result("run.h5")
    assert "def their_damper" in result.vehicle().laws["their_damper"].source
    assert main(["info", "run.h5"]) == 0
    assert main(["report", "run.h5"]) == 0
    assert not executed.exists()


def test_studies_refuse_before_they_begin(executed, capsys, tmp_path):
    runs = ["--vehicles", "coach.toml", "--tracks", "curve_r250", "--speeds", "20", "25"]
    assert main(["study", *runs, "--until", "2", "--out", "study", "--quiet"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert main(["study", "--scenario", "en14363", *runs[:2], "--out", "campaign", "--quiet"]) == 2
    assert "'their_damper' is code of their_damper.py" in capsys.readouterr().err
    assert not (tmp_path / "study").exists()
    assert not (tmp_path / "campaign").exists()
    assert not executed.exists()


def test_whoever_gives_a_wrong_name_is_told(executed):
    assert "damper" in railsim.load_vehicle("coach.toml").elements
    with pytest.raises(InputError, match=r"damper.law: no law 'their_dampr'; .*'their_damper'"):
        railsim.load_vehicle("coach.toml", "elements.damper.law=their_dampr")
    with pytest.raises(InputError, match=r"laws.wave.file: .*a file .py, or the name of a library"):
        railsim.load_track("track.toml", "laws.wave.file=/etc/passwd")
