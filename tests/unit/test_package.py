"""The package as it is published: source archive and wheel hold all that a user needs."""

import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest

import railsim

ROOT = Path(__file__).parents[2]
PROBE = """
import railsim
assert "site" in railsim.__file__, railsim.__file__
print(railsim.load_track("curve_r250").length, railsim.load_vehicle("coach_manchester").name)
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Folder with the source archive, and the wheel that was built from it."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return folder


def test_wheel_is_installed_and_finds_its_vehicles_and_tracks(built, tmp_path):
    (wheel,) = built.glob("*.whl")
    site = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-compile"]
    subprocess.run([*install, "--target", site, wheel], check=True, capture_output=True)
    assert (site / "railsim" / "py.typed").exists()
    done = subprocess.run(
        [sys.executable, "-c", PROBE],
        cwd=tmp_path,
        env={"PYTHONPATH": str(site), "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("980.0 ")  # 300 + 60 + 60 + 60 + 500 m in the file


def test_source_archive_can_check_itself(built):
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as files:
        held = {name.partition("/")[2] for name in files.getnames()}
    assert {"README.md", "LICENSE", "CITATION.cff", "tests/check", "docs/index.md"} <= held


def test_one_version_everywhere():
    assert f"\nversion: {railsim.__version__}\n" in (ROOT / "CITATION.cff").read_text()


def test_versions_are_given_for_everything_that_railsim_depends_on():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    pinned = {
        line.partition("==")[0].lower().replace("_", "-")
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if "==" in line
    }
    named = {need.partition(">=")[0].lower() for need in project["dependencies"]}
    assert named <= pinned
