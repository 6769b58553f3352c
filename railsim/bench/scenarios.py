"""The runs that are timed."""

from dataclasses import dataclass
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


RUNS = (
    Scenario("Manchester coach, R 250 m", "coach_manchester", "curve_r250", 20.0, target=300.0),
    Scenario("flexicoil coach, R 250 m", "coach_flexicoil", "curve_r250", 20.0, target=250.0),
    Scenario(
        "Manchester coach, straight, ERRI B176 low, 40 m/s",
        "coach_manchester",
        "straight",
        40.0,
        irregularity="erri_b176_low",
        until=600.0,
    ),
)
"""Two coaches through a curve, and one on irregular rails; all on elastic ones."""
