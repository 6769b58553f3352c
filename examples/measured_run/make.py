"""Compute the run that stands for a test: ``python make.py`` writes run.h5 beside this file.

The vehicle is the shipped coach with a primary spring that is too soft and a worn damper; the
channels get noise, offsets, a mounting angle of the floor's sensors and a gap, and the counter of
distance drifts.
"""

from pathlib import Path

import h5py
import numpy as np

import railsim

HERE = Path(__file__).parent
TRUE = {"coil_spring.stiffness.z": 0.80, "secondary_vertical_damper.damper_table": 0.85}
SPEED, RATE, GRAVITY, G = 26.0, 100.0, 9.81, 9.80665  # G: the unit
ROLL = 0.010  # rad, of the floor's sensors
SHIFT, DRIFT = 3.0, 8e-4  # m, 1: of the counter

OUTPUTS = {"sensors": "readings", "quantities": ["Q", "Y"], "low_pass": {"frequency": 40.0}}


def true_vehicle() -> railsim.Vehicle:
    """Return the vehicle that was "measured"."""
    coach = railsim.load_vehicle("coach_25t")
    spring = coach.assemblies["bogie"].assemblies["axle"].elements["coil_spring"].stiffness
    damper = coach.assemblies["bogie"].elements["secondary_vertical_damper"].damper_table
    factor, worn = TRUE.values()
    return coach.with_values({
        "coil_spring.stiffness": [*spring[:2], factor * spring[2]],
        "secondary_vertical_damper.damper_table": [[v, worn * F] for v, F in damper],
    })  # fmt: skip


def main() -> None:
    """Write the data."""
    track = railsim.load_track(HERE / "line" / "track.toml")
    settings = railsim.Settings.model_validate({"output_rate": RATE, "outputs": OUTPUTS})
    run = railsim.simulate(true_vehicle(), track, speed=SPEED, settings=settings)
    noise = np.random.default_rng(11)

    def noisy(x: np.ndarray, digits: int) -> np.ndarray:
        return np.round(x + 0.02 * np.std(x) * noise.standard_normal(len(x)), digits)

    def reading(point: str, axis: str) -> np.ndarray:
        return run.series("sensor_acceleration", sensor=point, axis=axis)

    s = run.distance
    data = {
        "time": run.time,
        "km": np.round((track.mileage + SHIFT + (1.0 + DRIFT) * s) / 1e3, 5),
        "V": np.round(np.full(len(s), 3.6 * SPEED), 2),
    }
    for side, letter in (("left", "L"), ("right", "R")):
        for name in ("Q", "Y"):
            force = run.series(name, wheelset=0, side=side)
            data[f"{name}1{letter}"] = noisy(force / 1e3, 2)
    for axis in "zy":
        data[f"box1{axis}"] = noisy(reading("axlebox_1_left", axis) / G, 4)
        data[f"frame1{axis}"] = noisy(reading("frame_1", axis), 3)
    for k, point in ((1, "floor_front"), (2, "floor_rear")):
        y, z = reading(point, "y"), reading(point, "z")
        data[f"floor{k}y"] = noisy(y + ROLL * (z - GRAVITY), 4)
        data[f"floor{k}z"] = noisy(z - ROLL * y + 0.05, 4)
    data["floor1y"] = -data["floor1y"]  # mounted the other way round
    data["frame1z"][4100:4150] = np.nan  # a lost telegram
    with h5py.File(HERE / "run.h5", "w") as file:
        for name, x in data.items():
            kind = np.float64 if name in ("time", "km") else np.float32
            file.create_dataset(name, data=x.astype(kind), compression="gzip", shuffle=True)


if __name__ == "__main__":
    main()
