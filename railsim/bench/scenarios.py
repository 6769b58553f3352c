"""The runs that are timed: the study's four, and the ends of the range of speeds."""

from dataclasses import dataclass, replace
from typing import Any

from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.result import Result, Sink
from railsim.simulation import simulate

REFERENCE_STEP = 0.125e-3  # s, of RK4


@dataclass(frozen=True)
class Scenario:
    """One run."""

    name: str  # in tables
    vehicle: str  # name of a shipped file
    track: str  # likewise
    speed: float  # m/s
    irregularity: str | None = None  # spectrum of random irregularities on the track
    settings: tuple[tuple[str, Any], ...] = ()  # what differs from the default settings
    support: str | None = None  # preset of the track's support, by default its own
    until: float | None = None  # end of the run [m], by default that of the track
    target: float | None = None  # least multiple of real time that it is to reach

    def run(self, sink: Sink | None = None, **settings: Any) -> Result:
        """Run it, with further settings if given."""
        track = load_track(self.track)
        if self.irregularity:
            track = track.replace(
                irregularities=[{"type": "random", "spectrum": self.irregularity}]
            )
        if self.support:
            track = track.replace(support={"preset": self.support})
        return simulate(
            load_vehicle(self.vehicle),
            track,
            speed=self.speed,
            until=self.until,
            settings=Settings.model_validate(dict(self.settings) | settings),
            sink=sink,
        )

    def reference(self) -> Result:
        """Run it by RK4 at `REFERENCE_STEP`."""
        return self.run(scheme="rk4", step=REFERENCE_STEP)


STUDY = (
    Scenario("Manchester coach, R 250 m", "coach_manchester", "curve_r250", 20.0, target=300.0),
    Scenario("Manchester coach, R 500 m", "coach_manchester", "curve_r500", 20.0),
    Scenario("flexicoil coach, R 250 m", "coach_flexicoil", "curve_r250", 20.0, target=250.0),
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
    Scenario(
        "Manchester coach, straight, ERRI B176 low, 40 m/s",
        "coach_manchester",
        "straight",
        40.0,
        irregularity="erri_b176_low",
        until=600.0,
    ),
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
