"""A coach on irregular straight track at the step that railsim chooses and at half of it."""

import numpy as np
from dynamics import Settings, load_track, load_vehicle

from railsim.simulation import simulate

QUANTITIES = (
    "dQ_over_Q0",
    "Y",
    "sum_Y",
    "Y_over_Q",
    "T_gamma",
    "wheelset_lateral",
    "wheelset_yaw",
    "body_acceleration",
)
RANDOM = {"type": "random", "spectrum": "erri_b176_low", "seed": 1}


def irregular_run(speed, until, **settings):
    """`coach_flexicoil` on ERRI B176 "low" irregularities, from the track's beginning."""
    track = load_track("straight").replace(irregularities=[RANDOM])
    return simulate(
        load_vehicle("coach_flexicoil"),
        track,
        speed=speed,
        until=until,
        settings=Settings(**settings),
    )


def half_as_long(result):
    """The same run at half the step."""
    inputs = result.inputs()
    inputs["settings"] = inputs["settings"].replace(step=0.5 * result.attributes["step"])
    return simulate(**inputs)


def changes(full, half):
    """Relative change of peak and rms of every quantity, over all wheels (car body: y, z)."""
    found = {}
    for name in QUANTITIES:
        a, b = np.abs(full[name]), np.abs(half[name])
        if name == "body_acceleration":
            a, b = a[:, 0, 1:3], b[:, 0, 1:3]
        peak = np.nanmax(a) / np.nanmax(b) - 1.0
        rms = np.sqrt(np.nanmean(a**2) / np.nanmean(b**2)) - 1.0
        found[name] = float(peak), float(rms)
    return found
