"""Outputs on request: named elements, contact patches, the track at each wheelset."""

import numpy as np
import pytest

import railsim
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.kernels import contact_columns as contact
from railsim.result.hdf5 import Hdf5Sink
from railsim.simulation.outputs import _of_wheels_there
from railsim.track.irregularity import displacement


@pytest.fixture(scope="module")
def result():
    settings = Settings(
        outputs={
            "elements": [
                "front.outer.primary.*",
                "front.anti_roll_bar",
                "front.outer.primary_vertical_damper.left",
            ],
            "contact_patches": True,
            "track": True,
        }
    )
    return railsim.simulate(
        railsim.load_vehicle("coach_manchester"),
        railsim.load_track("curve_r250"),
        speed=20.0,
        start=380.0,
        duration=1.0,
        settings=settings,
    )


def test_loads_of_the_patches_make_up_the_wheel_loads(result):
    """Q = sum(N cos g - T_y sin g), Y = sum(T_y cos g + N sin g); damping is in both."""
    N, T_y, angle = result.patch_N, result.patch_T_y, result.patch_angle
    Q = (N * np.cos(angle) - T_y * np.sin(angle)).sum(axis=-1)
    Y = (N * np.sin(angle) + T_y * np.cos(angle)).sum(axis=-1)
    # small corrections of the forces on elastic rails are not divided among the patches
    np.testing.assert_allclose(Q, result.Q, atol=1e-3 * result.Q0.mean())
    # the patch's angle is the mean of slope and force direction (see kernels/wheel_rail): in the
    # flange root the sum differs from the force, elsewhere they agree
    np.testing.assert_allclose(Y[:, :, 1], result.Y[:, :, 1], atol=200.0)
    np.testing.assert_allclose(Y[:, :, 0], result.Y[:, :, 0], atol=0.2 * np.abs(result.Y).max())


def test_a_wheel_that_carries_nothing_has_no_point_of_contact():
    wheel = np.zeros((1, 2, 2, contact.WHEEL_COLUMNS))
    wheel[..., contact.W_NORMAL] = [[0.0, 5e4], [1.0, 0.0]]
    wheel[..., contact.W_C_Y] = [[-0.75, 0.75], [-0.74, 0.76]]
    there = [[np.nan, 0.75], [-0.74, np.nan]]
    np.testing.assert_array_equal(_of_wheels_there(wheel, contact.W_C_Y)[0], there)


def test_pressure_is_that_of_hertz(result):
    loaded = result.patch_N > 0.0
    area = np.pi * result.patch_a * result.patch_b
    mean = result.patch_N[loaded] / area[loaded]
    np.testing.assert_allclose(result.patch_pressure[loaded], 1.5 * mean, rtol=1e-12)


def test_primary_springs_carry_the_frame(result):
    """The bushings of one axle press on the frame (body 1) upwards with about 59.9 kN each."""
    names = result.coordinates["element"]
    vertical = result.element_force[:, [n.startswith("front.outer.primary.") for n in names], 2]
    static = (43628.0 + 2 * 2615.0) * 9.81 / 8.0
    assert vertical.mean() == pytest.approx(-static, rel=0.1)


def test_track_is_seen_at_each_wheelset(result):
    assert result.track_curvature[0, 0] == pytest.approx(1.0 / 250.0, rel=1e-6)
    assert result.track_cant[0, 0] == pytest.approx(0.15, rel=1e-6)
    assert np.all(result.rail_vertical == 0.0)


def test_curvature_cant_and_mileage_are_those_of_the_reference_body(result):
    assert result.curvature[0] == pytest.approx(1.0 / 250.0, rel=1e-6)
    assert result.cant[0] == pytest.approx(0.15, rel=1e-6)
    np.testing.assert_array_equal(result.mileage, result.distance)


def test_mileage_counts_as_the_track_says():
    track = railsim.load_track("curve_r250").replace(mileage=12_300.0, falling_mileage=True)
    np.testing.assert_array_equal(track.mileage_at(np.array([0.0, 250.0])), [12_300.0, 12_050.0])


def test_unknown_element_is_refused_with_the_nearest_name():
    settings = Settings(outputs={"elements": ["front.outer.primery.left"]})
    with pytest.raises(InputError, match=r"front.outer.primary.left"):
        railsim.simulate(
            railsim.load_vehicle("coach_manchester"),
            railsim.load_track("straight"),
            speed=20.0,
            duration=0.1,
            settings=settings,
        )


def test_requested_outputs_reach_the_file(result, tmp_path):
    stored = railsim.open_result(result.to_hdf5(tmp_path / "r.h5"))
    np.testing.assert_array_equal(stored.element_power, result.element_power)
    assert stored.coordinates["patch"] == ("tread", "flange root", "flange")


def test_file_of_some_quantities_can_be_read_again(tmp_path):
    """Written by the run itself: peaks of the quantities that it keeps, and of no others."""
    outputs = {"outputs": {"quantities": ["Q", "Y"]}}
    sink = Hdf5Sink(tmp_path / "kept.h5")
    railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("straight"), speed=20.0,
        duration=1.0, settings=Settings.model_validate(outputs), sink=sink,
    )  # fmt: skip
    found = railsim.open_result(tmp_path / "kept.h5")
    assert {"Q", "Y", "Q0"} <= set(found.quantities)
    assert {name.split("_")[0] for name in found.groups["peaks"]} == {"Q", "Y"}


def test_peaks_over_all_steps_are_those_of_histories_of_all_steps():
    """With an output at every step; into a transition; axles have loads of their own."""
    vehicle = railsim.load_vehicle("coach_manchester", ["bodies.carbody.position=[0.4, 0, -1.8]"])
    settings = Settings(step=1e-3, output_rate=1000.0, outputs={"evaluate_after": 0.1})
    result = railsim.simulate(
        vehicle, railsim.load_track("curve_r250"), speed=20.0, start=289.0, duration=0.3,
        settings=settings,
    )  # fmt: skip
    assert np.ptp(result["Q0"]) > 1e3
    peaks, rows = result.groups["peaks"], result["time"] > 0.1 - 1e-9
    names = {name for name in peaks if name in result}
    assert names == {
        "Q", "dQ_over_Q0", "Y", "Y_over_Q", "sum_Y", "sum_abs_Y", "T_gamma", "wheelset_lateral",
        "wheelset_roll", "wheelset_yaw",
    }  # fmt: skip
    for name in names:
        values = result[name][rows]
        ends = (values.max(axis=0), values.argmax(0)), (values.min(axis=0), values.argmin(0))
        for row, (most, at) in enumerate(ends):
            scale = np.abs(values).max()
            np.testing.assert_allclose(peaks[name][row], most, atol=1e-6 * scale, err_msg=name)
            for of in ("time", "distance"):
                found = peaks[f"{name}_{of}"][row]
                np.testing.assert_allclose(found, result[of][rows][at], atol=0.021, err_msg=name)


def test_rails_are_displaced_each_as_the_track_says():
    track = railsim.load_track(
        "straight", ["irregularities=[{type='random', spectrum='erri_b176_low', seed=3}]"]
    )
    settings = Settings(outputs={"track": True}, output_rate=50.0)
    vehicle = railsim.load_vehicle("coach_manchester")
    result = railsim.simulate(vehicle, track, speed=20.0, start=50.0, duration=0.1,
                              settings=settings)  # fmt: skip
    y_left, z_left, y_right, z_right = displacement(track)(result["wheelset_distance"].ravel())[0]
    shape = result["rail_vertical"].shape
    for name, sides in (("rail_lateral", (y_left, y_right)), ("rail_vertical", (z_left, z_right))):
        expected = np.stack(sides, axis=-1).reshape(shape)
        assert np.ptp(expected, axis=-1).max() > 1e-5
        np.testing.assert_allclose(result[name], expected, atol=1e-12)


def test_peaks_evaluated_from_the_start_have_its_first_instant():
    """A wheelset let go 3 mm beside the middle of the track is never farther from it."""
    settings = Settings(outputs={"evaluate_after": 0.0}).with_values(
        {"initial": {"front.outer.wheelset": {"y": 3e-3}}}
    )
    result = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("straight"), speed=20.0,
        duration=0.05, settings=settings,
    )  # fmt: skip
    peaks = result.groups["peaks"]
    assert peaks["wheelset_lateral"][0, 0] == pytest.approx(3e-3, rel=1e-9)
    assert peaks["wheelset_lateral_time"][0, 0] == 0.0
