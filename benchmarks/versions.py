"""Earlier states of railsim beside this one: the same runs and commands, taken in turn.

    python benchmarks/versions.py [--rounds 10] [--commands 5] [--jobs 1] [--out versions.json]

`--commands` is the number of times that `railsim run` is timed, `--jobs` that of the README's main
job from empty caches; `--small` takes this state only.

Sources of earlier states come from git into `build/versions`, with caches of their own.  A process
of each version makes the runs of a round one after the other, in every other round in the opposite
order: what disturbs the machine disturbs all, and the ratio within a round says more than times do.
"""

import argparse
import gc
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median, quantiles
from tempfile import TemporaryDirectory
from typing import Any

from commands import COACH, run_command

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "build" / "versions"
JOB = ("study", "curving_reference", "--out", "results", "--resume", "--report")
OLD_JOB = (
    *("study", "--vehicles", "coach_manchester", "coach_flexicoil"),
    *("--tracks", "curve_r250", "curve_r500", "--speeds", "20"),
    *("--out", "results", "--resume", "--plots"),
)


@dataclass(frozen=True)
class Version:
    """A state of railsim."""

    name: str  # commit, or "this one"
    supports: bool = True  # has supports of the track; else rails are rigid
    job: tuple[str, ...] = JOB  # the main job of its README

    @property
    def sources(self) -> Path:
        """Folder of its sources, from git if need be."""
        if self.name == "this one":
            return ROOT
        folder = FOLDER / self.name
        if not folder.exists():
            pack = subprocess.run(
                ["git", "archive", self.name], cwd=ROOT, check=True, stdout=subprocess.PIPE
            )
            folder.mkdir(parents=True)
            subprocess.run(["tar", "-x"], cwd=folder, input=pack.stdout, check=True)
        return folder

    def environment(self, cache: Path | None = None) -> dict[str, str]:
        """What a process of this version finds around it."""
        if cache is None and self.name != "this one":
            cache = FOLDER / "caches" / self.name
        found = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        found["PYTHONPATH"] = str(self.sources)
        return found | ({"XDG_CACHE_HOME": str(cache)} if cache else {})


RIGID = Version("cf602d2", supports=False, job=OLD_JOB)
ELASTIC = Version("4b5dcb9")
THIS = Version("this one")


@dataclass(frozen=True)
class Case:
    """A run."""

    vehicle: str
    track: str
    speed: float  # m/s
    until: float  # m
    irregularity: str | None = None
    rigid: bool = False  # rails; else as the track has them, elastic

    @property
    def name(self) -> str:
        """Its words in the table."""
        words = (self.vehicle, self.track, self.irregularity, f"{self.speed:g} m/s")
        return ", ".join(filter(None, words)) + (", rigid" if self.rigid else ", elastic")

    @property
    def left_out(self) -> tuple[Version, ...]:
        """Versions that it is not compared with: those without supports of the track.

        They lack the zones of EN 14363, and of the coach that hunts elastic rails are asked.
        """
        return (RIGID,) if self.track.startswith("en14363") or self == HUNTS else ()


LOW = "erri_b176_low"
HUNTS = Case("coach_manchester", "straight", 60.0, 900.0, LOW)
CURVE = Case("coach_manchester", "curve_r250", 20.0, 600.0)
STRAIGHT = Case("coach_manchester", "straight", 40.0, 600.0, LOW)
FLEXICOIL = Case("coach_flexicoil", "straight", 60.0, 900.0, LOW)
CASES = (
    *(CURVE, STRAIGHT, FLEXICOIL),
    *(replace(case, rigid=True) for case in (CURVE, STRAIGHT, FLEXICOIL)),
    Case("coach_manchester", "en14363_zone4", 20.0, 400.0),
    Case("coach_manchester", "en14363_zone2", 44.0, 900.0),
    HUNTS,
)


class Server:
    """A process of a version that makes runs on request."""

    def __init__(self, version: Version) -> None:
        self.version = version
        self.process = subprocess.Popen(
            [sys.executable, __file__, "--serve"],
            env=os.environ | version.environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def real_time(self, case: Case) -> float:
        """Simulated seconds per CPU second of the time loop."""
        assert self.process.stdin
        assert self.process.stdout
        asked = asdict(case) | {"rigid": case.rigid and self.version.supports}
        self.process.stdin.write(json.dumps(asked) + "\n")
        self.process.stdin.flush()
        for line in self.process.stdout:
            if line.startswith("x "):
                return float(line[2:])
        raise RuntimeError(f"{self.version.name} ended in {case.name}")


def serve() -> None:
    """Make the runs that come in, one a line, in the version that is on the path."""
    import railsim

    for line in sys.stdin:
        case = Case(**json.loads(line))
        track = railsim.load_track(case.track)
        if case.irregularity:
            wave = {"type": "random", "spectrum": case.irregularity, "seed": 1}
            track = track.replace(irregularities=[wave])
        if case.rigid:
            track = track.replace(support={"preset": "rigid"})
        vehicle = railsim.load_vehicle(case.vehicle)
        gc.disable()
        result = railsim.simulate(vehicle, track, speed=case.speed, until=case.until)
        gc.enable()
        print("x", float(result["time"][-1]) / float(result.attributes["cpu_time"]), flush=True)


def in_turn(versions: Sequence[Version], rounds: int) -> Iterator[Version]:
    """Every version in every round, in every other one in the opposite order."""
    for number in range(rounds):
        yield from versions if number % 2 else versions[::-1]


def loops(versions: Sequence[Version], cases: Sequence[Case], rounds: int) -> dict[str, Any]:
    """Multiples of real time of every case by version and round."""
    found: dict[str, Any] = {}
    for case in cases:
        servers = {version: Server(version) for version in versions if version not in case.left_out}
        for server in servers.values():
            server.real_time(case)  # compiles, builds tables, judges the step
        times: dict[str, list[float]] = {version.name: [] for version in servers}
        for version in in_turn([*servers], rounds):
            times[version.name].append(servers[version].real_time(case))
        for server in servers.values():
            server.process.communicate()
        found[case.name] = times
        print(f"{case.name}: x real time, {summary(times)}", flush=True)
    return found


def command_times(versions: Sequence[Version], repeats: int, *, job: bool) -> dict[str, Any]:
    """Wall and CPU times [s] of `railsim run`, or of the main job from empty caches, by version."""
    found: dict[str, dict[str, Any]] = {
        name: {version.name: [] for version in versions} for name in ("wall", "cpu")
    }
    for version in in_turn(versions, repeats):
        with TemporaryDirectory() as folder:
            done = run_command(
                *(version.job if job else ("run", *COACH)),
                folder=Path(folder),
                environment=version.environment(Path(folder) / "caches" if job else None),
            )
        if done["status"]:
            raise RuntimeError(f"{version.name}: exit status {done['status']}")
        for name in found:
            found[name][version.name].append(done[name])
    # the CPU time of workers is not the command's
    name, what = ("main job", "wall") if job else ("railsim run", "cpu")
    print(f"{name}: {what} time, {summary(found[what])}", flush=True)
    return found


def summary(found: dict[str, list[float]]) -> str:
    """Medians of all versions, and the ratio of the last to the first."""
    medians = ", ".join(f"{name} {median(values):.3g}" for name, values in found.items())
    before, *_, now = found.values() if len(found) > 1 else 2 * [*found.values()]
    return f"{medians}; ratio {ratio(before, now)}"


def ratio(before: Sequence[float], now: Sequence[float]) -> str:
    """Median and quartiles of the ratio within a round."""
    ratios = [b / a for a, b in zip(before, now, strict=True)]
    low, half, high = quantiles(ratios, n=4) if len(ratios) > 1 else 3 * ratios
    return f"{half:.2f} ({low:.2f} to {high:.2f})"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--commands", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        serve()
        return
    versions = [THIS] if asked.small else [RIGID, ELASTIC, THIS]
    cases = [replace(CASES[0], until=20.0)] if asked.small else CASES
    found: dict[str, Any] = {"loops": loops(versions, cases, asked.rounds)}
    if asked.commands:
        found["run"] = command_times(versions, asked.commands, job=False)
    if asked.jobs:
        found["job"] = command_times(versions, asked.jobs, job=True)
    if asked.out:
        asked.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
