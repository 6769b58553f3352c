"""Tables of `docs/user/irregularity.md`: errors of tracks found from a twin of a coach, minutes."""

import sys
from pathlib import Path

import numpy as np

import railsim
from generators.filling import fill_page, table
from railsim.observation import irregularity

DOCS = Path(__file__).parents[1]
sys.path[:0] = [str(DOCS.parent / "tests" / folder) for folder in ("", "verification")]
from test_track_from_accelerations import (  # noqa: E402
    COACH,
    OTHER,
    canted_curve,
    errors,
    force_errors,
    rms,
    run_over,
    speeding_up,
    twin,
)

MARGIN = 100.0  # m, left out at either end
ROWS = (("level", "D1"), ("level", "D2"), ("cross_level", "D1"), ("cross_level", "D2"),
        ("alignment", "D1"), ("alignment", "D2"))  # fmt: skip


def column(made, vehicle, **options):
    """Errors of one estimate: bands in mm with the deviation stated, Q, sum Y, cover."""
    result, track, measurement = made
    bare = track.replace(irregularities=[])
    found = irregularity(measurement, vehicle, bare, **options)
    by = errors(found, track, MARGIN)
    cells = [f"{1e3 * rms(by[row][1]):.3f} ({1e3 * rms(by[row][2]):.3f})" for row in ROWS]
    Q, error, _ = force_errors(found, result, "Q.", "Q", MARGIN)
    cells.append(f"{100.0 * rms(error) / Q.mean():.1f} %")
    across, error, _ = force_errors(found, result, "sum_Y", "sum_Y", MARGIN)
    cells.append(f"{100.0 * rms(error) / across.std():.0f} %")
    inside = [np.abs(e) < 1.96 * deviation for _, e, deviation in by.values()]
    cells.append(f"{100.0 * np.mean(inside):.0f} %")
    return cells, [f"{1e3 * rms(by[row][0]):.2f}" for row in ROWS], across.std()


def make(_parts):
    """Fill the table of errors."""
    coach = railsim.load_vehicle(COACH)
    fast, slow = twin(coach, 1500.0, 50.0), twin(coach, 1500.0, 40.0)
    columns = {
        "50 m/s": (fast, coach, {}),
        "50 m/s, linear": (fast, coach, {"simulations": 0}),
        "40 m/s, another vehicle": (slow, coach.with_values(OTHER), {}),
        "R 600 m, 27.8 m/s": (run_over(coach, canted_curve(600.0, 0.1), 27.8), coach, {}),
        "R 2500 m, 50 m/s": (run_over(coach, canted_curve(2500.0, 0.1), 50.0), coach, {}),
        "30 to 40 m/s": (speeding_up(coach), coach, {}),
    }
    found = {name: column(made, vehicle, **how) for name, (made, vehicle, how) in columns.items()}
    words = [f"{name.replace('_', ' ')} {band} (mm)" for name, band in ROWS]
    words += ["Q (share of Q0)", "sum Y (share of its rms)", "intervals of 95 % cover, pooled"]
    of_track = [*found["50 m/s"][1], "", f"{1e-3 * found['50 m/s'][2]:.2f} kN", ""]
    each = [cells for cells, *_ in found.values()]
    rows = list(zip(words, of_track, *each, strict=True))
    head = ("", "rms of the track, 50 m/s", *found)
    fill_page(DOCS / "user" / "irregularity.md", {"twins": lambda: table(head, rows)})
