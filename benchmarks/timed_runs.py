"""Runs that are timed beside those of `railsim bench`: further curves, the ends of the speeds."""

from dataclasses import replace

from railsim.bench.runs import RUNS, Scenario

STUDY = (
    RUNS[0],
    Scenario("Manchester coach, R 500 m", "coach_manchester", "curve_r500", 20.0),
    RUNS[1],
    Scenario("flexicoil coach, R 500 m", "coach_flexicoil", "curve_r500", 20.0),
)
"""The runs of the curving study."""

OTHERS = (
    Scenario(
        "Manchester coach, R 250 m, rigid", "coach_manchester", "curve_r250", 20.0, support="rigid"
    ),
    Scenario(
        "Manchester coach, R 250 m, rigid, RK4 at 0.5 ms",
        "coach_manchester",
        "curve_r250",
        20.0,
        settings=(("scheme", "rk4"), ("step", 0.5e-3)),
        support="rigid",  # on elastic ones it would be unstable
        target=35.0,
    ),
    Scenario(
        "Manchester coach, R 250 m, 5 m/s", "coach_manchester", "curve_r250", 5.0, target=30.0
    ),
    Scenario(
        "flexicoil coach, straight, ERRI B176 low, 60 m/s",
        "coach_flexicoil",
        "straight",
        60.0,
        irregularity="erri_b176_low",
        target=100.0,
    ),
)
"""Rigid rails, the reference scheme, low speed, high speed on irregular track."""

IRREGULAR = (
    RUNS[2],
    replace(OTHERS[-1], until=900.0, target=None),
    Scenario(
        "Manchester coach, zone 2 of EN 14363, 44 m/s",
        "coach_manchester",
        "en14363_zone2",
        44.0,
        until=900.0,
    ),
    Scenario(
        "Manchester coach, zone 4 of EN 14363, 20 m/s",
        "coach_manchester",
        "en14363_zone4",
        20.0,
        until=400.0,
    ),
    Scenario(
        "Manchester coach, straight, ERRI B176 low, 60 m/s (hunts)",
        "coach_manchester",
        "straight",
        60.0,
        irregularity="erri_b176_low",
        until=900.0,
    ),
)
"""Irregular rails: what most people run."""
