"""How long a study takes to open and to go on when almost all of its runs are recorded.

Two coaches, two curves, ten speeds, many coefficients of friction; made-up results of no content,
records of the usual size.  Usage: python benchmarks/journal.py [runs]
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from railsim.studies.journal import Journal
from railsim.studies.plan import Plan
from railsim.studies.spec import StudySpec
from railsim.studies.study import study

sys.path.append(str(Path(__file__).parents[1] / "tests" / "interface"))
from example_result import example_result

from railsim.result import mid_curves, peaks


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    frictions = [f"{0.05 + 0.6 * i / runs:.7f}" for i in range(runs // 40)]
    how = {
        "vehicles": ["coach_manchester", "coach_flexicoil"],
        "tracks": ["curve_r250", "curve_r500"],
        "speeds": [10.0 + i for i in range(10)],
        "grid": {"track.friction": frictions},
    }
    result = example_result()
    facts = {
        "status": "complete", "status_reason": "", "step": 0.00125, "wall_time": 2.0,
        "cpu_time": 0.7, "remarks": [], "peaks": [peak.record() for peak in peaks(result)],
        "mid_curves": [curve.record() for curve in mid_curves(result)],
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        points = timed("points with their keys", lambda: Plan(StudySpec(**how)).points)
        with Journal(folder) as journal:
            journal._line = unsynced(journal)
            for point in points:
                file = folder / f"{point.name}.h5"
                file.write_bytes(b"\0")  # an empty one would not count as done
                record = {"name": point.name, "file": file.name, "labels": dict(point.labels)}
                journal.add({**record, **facts}, point.key, file.stat())
            size = journal.path.stat().st_size
        print(f"{len(points)} runs, journal {size / 1e6:.0f} MB")
        (folder / "study.json").touch()
        timed("journal opened", lambda: Journal(folder).close())
        timed("inputs new, index made", lambda: study(**how, out=folder, resume=True))
        outcome = timed("study resumed", lambda: study(**how, out=folder, resume=True))
        assert (outcome.computed, len(outcome.records)) == (0, len(points))
        timed("one record", lambda: outcome.records[-1])


def unsynced(journal):
    """As the journal writes its lines, without waiting for the disk after each."""
    from railsim.studies import journal as module

    def line(head, body):
        text = json.dumps(head).encode() + b"\t" + body
        offset = journal._end + 9 + len(text) - len(body)
        journal._append(b"%08x\t%s\n" % (module.zlib.crc32(text), text))
        return offset

    return line


def timed(what, work):
    begin, cpu = time.perf_counter(), time.process_time()
    found = work()
    print(f"{what}: {time.perf_counter() - begin:.2f} s, {time.process_time() - cpu:.2f} s CPU")
    return found


if __name__ == "__main__":
    main()
