"""The track from accelerations: state space, twins, channels that are wrong or blind."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from selection import points

import railsim
from railsim.cli import main
from railsim.definitions.excitations.recording import band_passed
from railsim.definitions.measurement import Channel, MeasurementFile
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.linear.track_response import QUANTITIES, RAILS, track_response
from railsim.linear.vehicle import LinearVehicle
from railsim.measurement import Measurement
from railsim.measurement.counterpart import amplified, amplifier
from railsim.observation import Assumed, contact, irregularity
from railsim.observation.estimate import BANDS, Estimate, join_pieces
from railsim.observation.estimate import rms as deviation
from railsim.observation.irregularity import _flanges, _Smooth
from railsim.observation.pieces import Piece, on_grid
from railsim.observation.simulated import SimulatedRun
from railsim.plot.observation import irregularity_figure
from railsim.result.sensors import all_sensors
from railsim.track.alignment import Alignment
from railsim.track.irregularity import displacement

pytestmark = pytest.mark.usefixtures("small_contact_tables_in_module")
COACH = "coach_25t"
V, RATE, NOISE, BIAS = 50.0, 1000.0, 0.05, 0.02
BOX_QUANTITY = "sensor_acceleration:axlebox_1_left:z"
BOX, BOX_Z = "axlebox_1_left.z", "axlebox_1_left_z"
PIECE = Piece(np.arange(100.0, 400.0, 0.25), *[np.zeros(0)] * 2, np.full(1200, V), RATE)
SENSORS = ("axlebox", "frame", "floor")
OTHER = {"carbody.mass": 38600.0 * 1.1, "secondary_spring.stiffness.z": 370e3 * 1.2,
         "coil_spring.stiffness.z": 991e3 * 0.8}  # fmt: skip
ERRI = {"type": "random", "spectrum": "erri_b176_low", "seed": 7}


STRAIGHT = railsim.load_track("straight")


@pytest.fixture(scope="module", autouse=True)
def contact_in_the_mean_once():
    """On the assumed track at one speed it is the same whatever is read: a third of an estimate."""
    kept, found = {}, contact.with_mean_contact

    def once(vehicle, track, linear, tangent, *rest):
        key = vehicle.name, track.gauge, track.friction, tangent.speed, repr(rest)
        if key not in kept:
            kept[key] = found(vehicle, track, linear, tangent, *rest)
        return kept[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contact, "LENGTH", 600.0)
        # the package has a function of the module's name
        patch.setattr(import_module("railsim.observation.irregularity"), "with_mean_contact", once)
        yield


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle(COACH)


def rough(length, **irregular):
    return railsim.load_track("straight").replace(
        plan=[{"type": "STR", "length": length}],
        cant=[{"type": "CST", "length": length, "cant": 0.0}],
        irregularities=[{**ERRI, **irregular}],
    )


def twin(vehicle, length, speed, points=SENSORS, **irregular):
    """A run on straight track with irregularities."""
    return run_over(vehicle, rough(length, **irregular), speed, points)


def run_over(vehicle, track, speed, points=SENSORS):
    """A run, its track, and what accelerometers with noise and bias read in y and z."""
    settings = Settings(output_rate=RATE, outputs={"sensors": "readings"})
    result = railsim.simulate(vehicle, track, speed=speed, settings=settings)
    return result, track, measured(result, vehicle, points, speed)


def speeding_up(vehicle):
    """The same from 30 to 40 m/s within 1.2 km."""
    track = rough(1200.0)
    s = np.linspace(0.0, 1200.0, 200)
    table = np.column_stack([s, np.sqrt(900.0 + 700.0 * s / 1200.0)]).tolist()
    outputs, drive = {"sensors": "readings"}, {"mode": "table", "speed_table": table}
    settings = Settings(output_rate=RATE, outputs=outputs, drive=drive)
    result = railsim.simulate(vehicle, track, settings=settings)
    return result, track, measured(result, vehicle, SENSORS, 35.0)


def measured(result, vehicle, points, speed, seed=0):
    rng = np.random.default_rng(seed)
    channels, how = {}, {}
    for name in all_sensors(vehicle):
        for axis in "yz":
            if name.startswith(points):
                x = result.series("sensor_acceleration", sensor=name, axis=axis)
                bias = BIAS * rng.choice([-1.0, 1.0])
                channels[f"{name}_{axis}"] = x + rng.normal(0.0, NOISE, len(x)) + bias
                how[f"{name}_{axis}"] = {"quantity": f"sensor_acceleration:{name}:{axis}"}
    definition = MeasurementFile(
        format="railsim-measurement/1", name="twin", file="-", channels=how, rate=RATE, speed=speed
    )
    s, time = result["distance"], result["time"]
    return Measurement(definition, time, s, np.gradient(s, time), channels)


def canted_curve(radius, cant, length=1200.0):
    """Straight, clothoid, curve, clothoid and straight, with irregularities."""
    plan = [
        {"type": "STR", "length": 250.0},
        {"type": "CLO", "length": 100.0, "radius_start": np.inf, "radius_end": radius},
        {"type": "CIR", "length": length - 700.0, "radius": radius},
        {"type": "CLO", "length": 100.0, "radius_start": radius, "radius_end": np.inf},
        {"type": "STR", "length": 250.0},
    ]
    ramp = {"type": "LIR", "length": 100.0}
    level = {"type": "CST", "length": 250.0, "cant": 0.0}
    canted = [
        level,
        {**ramp, "cant_start": 0.0, "cant_end": cant},
        {**level, "length": length - 700.0, "cant": cant},
        {**ramp, "cant_start": cant, "cant_end": 0.0},
        level,
    ]
    return rough(length).replace(plan=plan, cant=canted)


def errors(found, track, margin=60.0):
    """Truth, error and standard deviation by quantity and band, margins left out."""
    rows = (found.s > found.s[0] + margin) & (found.s < found.s[-1] - margin)
    truth = np.linalg.inv(RAILS.T) @ displacement(track)(found.s)[0]
    step = found.s[1] - found.s[0]
    return {
        (name, band): (
            band_passed(truth[q : q + 1], step, BANDS[band])[0][rows],
            (found.bands[band][q] - band_passed(truth[q : q + 1], step, BANDS[band])[0])[rows],
            found.band_deviations[band][q][rows],
        )
        for q, name in enumerate(QUANTITIES)
        for band in BANDS
    }


def force_errors(found, result, name, quantity, margin=60.0):
    """Values, errors and standard deviations of a force, one row a wheel or wheelset."""
    rows = (found.s > found.s[0] + margin) & (found.s < found.s[-1] - margin)
    s = result["distance"]
    true = result[quantity].reshape(len(s), -1)
    true = np.array([on_grid(s, x, found.s)[rows] for x in true.T])
    chosen = [i for i, o in enumerate(found.outputs) if o.startswith(name)]
    return true, found.forces[chosen][:, rows] - true, found.force_deviations[chosen][:, rows]


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


# the state space ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def linear(coach):
    return LinearVehicle(coach, railsim.load_track("straight"))


def test_long_waves_move_everything_with_the_track(coach, linear):
    """At 1 km a point reads the track's acceleration where it is: -(k V)^2 exp(i k x) z."""
    known = all_sensors(coach)
    response = track_response(linear, known, V)
    k = 2.0 * np.pi / 1000.0
    H = response.over(np.array([k]))[0]
    for name in ("axlebox_1_left", "axlebox_4_right", "frame_2"):
        expected = -((k * V) ** 2) * np.exp(1j * k * known[name].offset)
        if name == "frame_2":
            expected *= np.exp(1j * k * known[name].arm[0])
        assert H[response.outputs.index(f"{name}.z"), 1] == pytest.approx(expected, rel=5e-3)
    # a level raises no force worth mentioning: below 1 kN for a metre
    assert abs(H[response.outputs.index("Q.1.left"), 1]) < 1e3


def test_mirror_image():
    """Level moves both sides alike and nothing across; cross level and alignment the opposite."""
    vehicle = railsim.load_vehicle("coach_zhai_high_speed")
    linear = LinearVehicle(vehicle, railsim.load_track("straight"))
    response = track_response(linear, all_sensors(vehicle), V)
    H = response.over(2.0 * np.pi / np.array([25.0, 6.0]))
    left, right = (response.outputs.index(f"Q.2.{side}") for side in ("left", "right"))
    assert H[:, left, 1] == pytest.approx(H[:, right, 1], rel=1e-4)
    assert H[:, left, 2] == pytest.approx(-H[:, right, 2], rel=1e-4)
    across = response.outputs.index("sum_Y.2")
    assert np.all(np.abs(H[:, across, 1]) < 1e-3 * np.abs(H[:, across, 0]))


def test_both_wheelsets_cancel_in_the_middle_of_the_frame():
    """A frame follows the mean of its wheelsets: blind at the wheelbase over k + 1/2."""
    coach = railsim.load_vehicle("coach_zhai_high_speed")
    data = coach.model_dump(exclude_none=True)
    frame = all_sensors(coach)["frame_1"]
    wheelbase = 2.0 * frame.arm[0]
    data["sensors"] = {"middle": {"body": frame.body, "position": [frame.offset, 0.0, -0.5]}}
    vehicle = type(coach)(**data)
    linear = LinearVehicle(vehicle, railsim.load_track("straight"))
    whole = track_response(linear, all_sensors(vehicle), 30.0)
    waves = np.array([wheelbase / 0.5, wheelbase / 1.5, wheelbase])

    def by(wheelsets):
        B, D = np.zeros_like(whole.B), np.zeros_like(whole.D)
        B[:, wheelsets], D[:, wheelsets] = whole.B[:, wheelsets], whole.D[:, wheelsets]
        own = replace(whole, B=B, D=D).over(2.0 * np.pi / waves)
        return own[:, whole.outputs.index("middle.z"), 1]

    one, both = by([0]), by([0, 1])
    # of the long wave something is left: the rest of the vehicle couples pitch and bounce
    assert np.all(np.abs(both[:2]) < np.array([0.25, 0.02]) * np.abs(one[:2]))
    assert abs(both[2]) > 1.8 * abs(one[2])


# twins --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def short(coach):
    result, track, measurement = twin(coach, 500.0, V, points=("axlebox",))
    return result, track, measurement, irregularity(measurement, coach, track, simulations=0)


def test_level_cross_level_and_wheel_forces_of_a_twin(short):
    """Far inside of what is asked for: level 0.15 mm and coherence 0.99 in D1, 1 mm in D2."""
    result, track, _, found = short
    by = errors(found, track)
    for name in ("level", "cross_level"):
        true, error, _ = by[name, "D1"]
        assert rms(error) < 0.1e-3
        assert np.corrcoef(true, true + error)[0, 1] ** 2 > 0.99
        assert rms(by[name, "D2"][1]) < 0.3e-3
    assert rms(by["alignment", "D1"][1]) < 0.9 * rms(by["alignment", "D1"][0])
    assert rms(by["alignment", "D2"][1]) < 1e-3
    true, error, _ = force_errors(found, result, "Q.", "Q")
    assert rms(error) < 0.02 * true.mean()
    true, error, _ = force_errors(found, result, "sum_Y", "sum_Y")
    assert rms(error) < 0.3 * true.std()


def test_waves_shorter_than_those_assumed_are_said(short, coach):
    """Waves of 2.5 m beside those assumed: 95 % intervals of Q covered 39 %, without a word."""
    *_, plain = short
    _, track, read = twin(coach, 400.0, V, points=("axlebox",), wavelengths=[2.0, 70.0])
    said = [irregularity(read, coach, track, simulations=0).remarks, plain.remarks]
    assert ["waves shorter than the 3 m" in " ".join(remarks) for remarks in said] == [True, False]


@points("filters", [{"low_pass": 40.0}, {"high_pass": 0.5}], always=(0,))
def test_filters_of_the_amplifier_do_not_move_the_track(short, coach, filters):
    """40 Hz lags by 0.5 m at 50 m/s, 0.5 Hz turns waves of 60 m round: both are in the model."""
    _, track, measurement, plain = short
    how = {n: c.model_copy(update=filters) for n, c in measurement.definition.channels.items()}
    read = replace(
        measurement,
        definition=measurement.definition.model_copy(update={"channels": how}),
        channels={n: amplified(x, RATE, how[n]) for n, x in measurement.channels.items()},
    )
    found = irregularity(read, coach, track, simulations=0)
    own, whole = errors(found, track), errors(plain, track)
    for name in ("level", "cross_level"):
        assert rms(own[name, "D1"][1]) < 1.2 * rms(whole[name, "D1"][1])
        assert rms(own[name, "D2"][1]) < 3.0 * rms(whole[name, "D2"][1])  # less is seen of them
    run = SimulatedRun(coach, track.replace(irregularities=[]), PIECE, {BOX: how[BOX_Z]}, [])
    unfiltered = SimulatedRun(
        coach, track.replace(irregularities=[]), PIECE, {BOX: Channel(quantity=BOX_QUANTITY)}, []
    )
    fields = np.zeros((4, len(PIECE.grid)))
    fields[1] = 1e-3 * np.sin(2.0 * np.pi * PIECE.grid / 10.0)  # 5 Hz
    turned = amplifier(how[BOX_Z], np.array([V / 10.0]))[0]
    x, y = (one(fields).channels[0][400:800] for one in (unfiltered, run))
    wave = np.exp(-2j * np.pi * PIECE.grid[400:800] / 10.0)
    assert (y @ wave) / (x @ wave) == pytest.approx(turned, abs=0.02)


def test_what_is_not_seen_is_named_and_left_out(short):
    found = short[3]
    unseen = found.unseen()
    assert unseen["level"] == []
    assert unseen["alignment"][0][0] == pytest.approx(3.0, abs=0.1)
    assert unseen["gauge"][0][0] < 3.1
    assert unseen["gauge"][-1][1] > 90.0
    assert not found.values[3].any()
    assert any("gauge" in note for note in found.notes)
    # nothing at all of alignment between 3 m and the longest wave that is left out
    short_waves = band_passed(found.values[:1], 0.25, (1.0, 4.0))[0][400:-400]
    assert rms(short_waves) < 0.02 * rms(found.values[0])


def test_recording_is_read_as_a_track(short, tmp_path):
    found = short[3]
    found.write(tmp_path)
    track = railsim.load_track(tmp_path / "track.toml")
    rows = np.array(track.irregularities[0].rows)
    assert rows[:, 0] == pytest.approx(found.s, rel=1e-5)
    level = 0.5 * (rows[:, 2] + rows[:, 4])
    assert level == pytest.approx(found.values[1], abs=1e-8)
    assert rows[:, 4] - rows[:, 2] == pytest.approx(found.values[2], abs=1e-8)


def test_the_track_written_is_the_one_that_was_run_over(short, tmp_path):
    """Plan, gauge, rails and friction of the track given, not those of a straight by default."""
    curve = canted_curve(600.0, 0.1).replace(gauge=1.52, friction=0.3, irregularities=[])
    replace(short[3], track=curve).write(tmp_path)
    track = railsim.load_track(tmp_path / "track.toml")
    assert (track.plan, track.cant, track.gauge) == (curve.plan, curve.cant, 1.52)
    assert track.friction == curve.friction
    assert [part.type for part in track.irregularities] == ["measured"]
    short[3].write(tmp_path)
    straight = railsim.load_track(tmp_path / "track.toml")
    assert straight.length == np.ceil(short[3].s[-1])


def test_files_hold_all_estimates_and_forces_in_their_units(short, tmp_path):
    found = short[3]
    found.write(tmp_path)
    arrays = {"s_m": found.s}
    for q, name in enumerate(QUANTITIES):
        own = {"": (found.values, found.deviations)}
        own |= {f"_{band}": (found.bands[band], found.band_deviations[band]) for band in BANDS}
        for band, (values, deviations) in own.items():
            arrays[f"{name}{band}_mm"] = 1e3 * values[q]
            arrays[f"{name}{band}_deviation_mm"] = 1e3 * deviations[q]
    forces = {"s_m": found.s}
    for name, values, deviations in zip(
        found.outputs, found.forces, found.force_deviations, strict=True
    ):
        unit, factor = ("mm", 1e3) if name.startswith("lateral") else ("kN", 1e-3)
        forces[f"{name}_{unit}"] = factor * values
        forces[f"{name}_deviation_{unit}"] = factor * deviations
    for file, expected in (("estimates.csv", arrays), ("forces.csv", forces)):
        head = (tmp_path / file).read_text().partition("\n")[0].split(",")
        table = np.loadtxt(tmp_path / file, delimiter=",", skiprows=1)
        assert set(head) == set(expected)
        for name, column in zip(head, table.T, strict=True):
            assert np.allclose(column, expected[name], rtol=1e-4, atol=2e-5)


def test_lengths_of_which_no_channel_says_anything_are_named(short, coach):
    """Q was wrong there by twelve standard deviations after 50 m, without a word."""
    _, track, read, plain = short
    lost = (read.distance > 250.0) & (read.distance < 290.0)
    channels = {name: np.where(lost, np.nan, x) for name, x in read.channels.items()}
    found = irregularity(replace(read, channels=channels), coach, track, simulations=0)
    # with the steps beside a gap that are left out
    assert any("No channel has values at s = 248 to 292 m" in words for words in found.remarks)
    assert not any("No channel" in words for words in plain.remarks)


@pytest.mark.further
def test_gaps_signs_and_units(short, coach):
    """A gap of 40 m hardly matters; wrong signs and units and a dead sensor are said."""
    _, track, measurement, _ = short
    channels = dict(measurement.channels)
    s = measurement.distance
    channels["axlebox_3_left_z"] = np.where(
        (s > 300.0) & (s < 340.0), np.nan, channels["axlebox_3_left_z"]
    )
    channels["axlebox_2_right_z"] = -channels["axlebox_2_right_z"]
    channels["axlebox_4_left_z"] = 1e-3 * channels["axlebox_4_left_z"]
    channels["axlebox_1_right_z"] = np.full_like(s, 0.3)
    found = irregularity(replace(measurement, channels=channels), coach, track, simulations=0)
    said = "\n".join(found.remarks)
    assert "axlebox_2_right_z has the opposite sign" in said
    assert "axlebox_4_left_z is 0.001 times" in said
    assert "another 'unit'" in said
    assert "axlebox_3_left_z" not in said
    assert "axlebox_1_left_z" not in said
    assert "axlebox_1_right_z rests" in said


def test_a_curve_without_simulated_runs_is_said_and_spoils_nothing_elsewhere(short, coach):
    """What boxes read in a curve, v^2/R - g sin(cant angle), bent the alignment of both ends."""
    curve = canted_curve(2500.0, 0.1, 800.0).replace(irregularities=[])
    read, along = short[2].part(0.0, 420.0), Alignment(curve)
    steady = V**2 * along.curvature(read.distance)
    steady -= 9.81 * np.sin(along.cant_angle(read.distance))
    channels = {n: x + steady * n.endswith("_y") for n, x in read.channels.items()}
    found = irregularity(replace(read, channels=channels), coach, curve, simulations=0)
    assert any("curves between s = 250 and 450 m" in words for words in found.remarks)
    straight = found.s < 220.0
    off = (found.bands["D2"] - short[3].bands["D2"][:, : len(found.s)])[0, straight]
    assert rms(off) < 0.3e-3  # was 6 mm; 0.4 mm stated


@pytest.mark.parametrize(
    ("radius", "cant", "expected"),
    [(600.0, 0.1, (0.00167, 0.1)), (-600.0, -0.1, (-0.00167, -0.1)), (600.0, 0.0, (0.00167, 0.0)),
     (99e3, 0.1, (1.01e-5, 0.1)), (101e3, 0.1, (0.0, 0.0))],
)  # fmt: skip
def test_a_piece_is_estimated_in_its_sharpest_curve(radius, cant, expected):
    """Beyond R 100 km none."""
    grid = np.arange(0.0, 900.0, 0.5)
    where = SimpleNamespace(_alignment=Alignment(canted_curve(radius, cant, 900.0)))
    found = _Smooth._sharpest(where, SimpleNamespace(grid=grid))
    assert found == pytest.approx(expected)
    ahead = _Smooth._sharpest(where, SimpleNamespace(grid=grid[grid < 240.0]))
    assert ahead == (0.0, 0.0)


@pytest.mark.parametrize("curved", [True, False])
def test_a_record_of_curves_that_the_track_has_not_is_said_with_both_figures(curved):
    """R 600 m, 100 mm, 27.8 m/s: 27.8^2/600 - 9.81 sin(0.1/1.5) = 0.635 m/s2; a gap in one box."""
    curve, s = canted_curve(600.0, 0.1, 900.0), np.arange(0.0, 900.0, 0.5)
    along = Alignment(curve)
    steady = 27.8**2 * along.curvature(s) - 9.80665 * np.sin(along.cant_angle(s))
    gap = np.where((s > 420.0) & (s < 440.0), np.nan, steady)
    channels = {"a": steady + 0.2, "b": steady - 0.2, "c": steady, "d": gap}
    points = (f"axlebox_{k}_left:y" for k in (1, 2, 3, 4))
    how = {n: {"quantity": f"sensor_acceleration:{p}"} for n, p in zip("abcd", points, strict=True)}
    channels["yaw_rate"], how["yaw_rate"] = 27.8 * along.curvature(s), {"quantity": "yaw_rate"}
    definition = MeasurementFile(
        format="railsim-measurement/1", name="m", file="-", channels=how, rate=55.6, speed=27.8
    )
    run = Measurement(definition, s / 27.8, s, np.full(len(s), 27.8), channels)
    used = {name: f"box_{name}.y" for name in "abcd"}
    other_curves = import_module("railsim.observation.irregularity")._other_curves
    said = list(other_curves(curve if curved else STRAIGHT, run, used))
    assert len(said) == (0 if curved else 2)
    if not curved:
        assert "s = 400 to 500 m it has a curvature of 0.0017 1/m" in said[0]
        assert "s = 400 to 500 m it has a lateral acceleration of 0.63 m/s2" in said[1]
        assert all("the track one of 0;" in words for words in said)


def test_a_simulated_run_that_ends_early_says_why(coach, monkeypatch):
    """That its reason is an attribute of the file ended in a traceback."""
    ended = SimpleNamespace(status="derailed", attributes={"status_reason": "wheel lift"})
    monkeypatch.setattr("railsim.observation.simulated.simulate", lambda *_, **__: ended)
    run = SimulatedRun(coach, STRAIGHT, PIECE, {}, [])
    assert run(np.zeros((len(QUANTITIES), 1400))) == "derailed: wheel lift"


@pytest.mark.further
@pytest.mark.parametrize(("radius", "cant", "speed"), [(600.0, 0.1, 27.8), (2500.0, 0.1, 50.0)])
def test_twins_through_curves(coach, radius, cant, speed):
    """What is asked for on straight track holds with clothoids, cant and flanges that touch."""
    result, track, read = run_over(coach, canted_curve(radius, cant), speed)
    found = irregularity(read, coach, track.replace(irregularities=[]))
    by = holds(found, result, track)
    inside = [np.abs(e) < 1.96 * sd for (_, e, sd) in by.values()]
    assert 0.90 < np.mean(inside) < 0.99


@pytest.mark.further
def test_friction_elements_that_keep_their_state_have_no_equation_at_rest(monkeypatch):
    """Those of a wagon in sticking; the contact in the mean ended in a singular matrix."""
    monkeypatch.setattr(contact, "LENGTH", 300.0)
    wagon, track = railsim.load_vehicle("wagon_y25"), railsim.load_track("straight")
    linear = LinearVehicle(wagon, track)
    rough = {"spectrum": "erri_b176_low", "wavelengths": [3.0, 100.0]}
    tangent = track_response(linear, {}, 25.0)
    found, noise = contact.with_mean_contact(wagon, track, linear, tangent, rough)
    assert np.isfinite(found.A).all()
    assert np.isfinite(noise.power).all()


@pytest.mark.further
def test_twin_that_gains_speed(coach):
    """From 30 to 40 m/s: short pieces with their own modes."""
    result, track, read = speeding_up(coach)
    found = irregularity(read, coach, track.replace(irregularities=[]))
    assert len({piece.speed for piece in found.pieces}) > 3
    holds(found, result, track)


def holds(found, result, track):
    """Assert what is asked for: level, alignment, Q, sum Y; return the errors."""
    by = errors(found, track, 100.0)
    assert rms(by["level", "D1"][1]) < 0.15e-3
    assert rms(by["alignment", "D1"][1]) < 0.30e-3
    for name in ("level", "alignment", "cross_level"):
        assert rms(by[name, "D2"][1]) < 1e-3
    true, error, _ = force_errors(found, result, "Q.", "Q", 100.0)
    assert rms(error) < 0.02 * true.mean()
    true, error, _ = force_errors(found, result, "sum_Y", "sum_Y", 100.0)
    assert rms(error) < 0.10 * true.std()
    return by


def test_wrong_input(short, coach):
    _, track, measurement, _ = short
    with pytest.raises(InputError, match="300"):
        irregularity(measurement.part(100.0, 250.0), coach, track)
    with pytest.raises(InputError, match="erri_b176_low"):
        Assumed("erri_b176_lo").check()
    other = railsim.load_vehicle("coach_manchester")
    definition = measurement.definition.replace(
        channels={"a": {"quantity": "sensor_acceleration:axlebox_9_left:z"}}
    )
    wrong = replace(
        measurement, definition=definition, channels={"a": measurement["axlebox_1_left_z"]}
    )
    with pytest.raises(InputError, match="no sensor 'axlebox_9_left'"):
        irregularity(wrong, other, track)
    curve = canted_curve(600.0, 0.1, 1000.0)
    for shift, words in ((900.0, "900 to 1400 m"), (-100.0, "-100 to 400 m")):
        with pytest.raises(InputError, match=f"{words}; 0 to 1000 m as track"):
            irregularity(measurement.moved(shift), coach, curve)


def test_command(short, coach, tmp_path, capsys, monkeypatch, undrawn):
    _, _, measurement, _ = short
    monkeypatch.chdir(tmp_path)
    names = list(measurement.channels)[:4]
    table = np.column_stack([measurement.time, *(measurement[n] for n in names)])[:7000]
    np.savetxt("run.csv", table, delimiter=",", header=",".join(["t", *names]), comments="")
    lines = [f'{n} = {{ quantity = "{measurement.quantities[n]}" }}' for n in names]
    head = ['format = "railsim-measurement/1"', 'name = "run"', 'file = "run.csv"', "speed = 50.0"]
    head += ["[channels]", 't = { quantity = "time" }']
    (tmp_path / "run.toml").write_text("\n".join([*head, *lines]))
    assert main(["irregularity", "run.toml", "--out", "found"]) == 2
    assert "--vehicle" in capsys.readouterr().err
    arguments = ["irregularity", "run.toml", "--vehicle", COACH, "--out", "found", "--quiet"]
    with undrawn():
        assert main([*arguments, "--simulations", "0"]) == 0
    assert "cross level" in capsys.readouterr().out
    assert {p.name for p in (tmp_path / "found").iterdir()} == {
        "irregularity.json", "irregularity.png", "recording.csv", "track.toml", "estimates.csv",
        "forces.csv",
    }  # fmt: skip


def test_channels_in_another_unit_altogether(short, coach):
    """All a thousand times too large: nothing disagrees, and yet it is no track."""
    _, track, measurement, _ = short
    channels = {name: 1e3 * x for name, x in measurement.channels.items()}
    with pytest.raises(InputError, match="unit"):
        irregularity(replace(measurement, channels=channels), coach, track)


@pytest.mark.further
@pytest.mark.parametrize("speed", [20.0, 30.0, 45.0, 60.0])
def test_twins_over_speed(coach, speed):
    """What is asked for, and intervals that cover 90 to 98 %, pooled along the track."""
    result, track, measurement = twin(coach, 1500.0, speed, seed=21)
    found = irregularity(measurement, coach, track.replace(irregularities=[]))
    by = errors(found, track, 100.0)
    assert rms(by["level", "D1"][1]) < 0.15e-3
    assert rms(by["alignment", "D1"][1]) < 0.30e-3
    for name in ("level", "alignment", "cross_level"):
        assert rms(by[name, "D2"][1]) < 1e-3
    true, error, _ = force_errors(found, result, "Q.", "Q", 100.0)
    assert rms(error) < 0.02 * true.mean()
    true, error, _ = force_errors(found, result, "sum_Y", "sum_Y", 100.0)
    assert rms(error) < 0.10 * true.std()
    inside = [np.abs(e) < 1.96 * sd for (_, e, sd) in by.values()]
    assert 0.90 < np.mean(inside) < 0.99


@pytest.mark.further
def test_vehicle_that_is_another_one(coach):
    """Mass 10 % and stiffness 20 % off: less than twice as bad, or far inside of what is asked."""
    _, track, measurement = twin(coach, 1500.0, 40.0)
    bare = track.replace(irregularities=[])
    right = errors(irregularity(measurement, coach, bare, simulations=0), track)
    wrong = errors(irregularity(measurement, coach.with_values(OTHER), bare, simulations=0), track)
    for name in ("alignment", "level", "cross_level"):
        for band in BANDS:
            assert rms(wrong[name, band][1]) < 2.0 * rms(right[name, band][1])


def test_on_a_narrower_gauge_flanges_touch_by_half_of_it_earlier(linear):
    touching = _flanges(linear, STRAIGHT)
    assert len(touching) == 4
    assert np.all((touching > 0.005) & (touching < 0.010))  # 5 mm of clearance, and the fillet
    narrower = _flanges(linear, STRAIGHT.replace(gauge=1.431))
    assert touching - narrower == pytest.approx(0.002, abs=1.1e-4)  # places every 0.05 mm
    assert np.all(np.isinf(_flanges(linear, STRAIGHT.replace(gauge=1.445))))


def test_pieces_are_joined_linearly_and_flanges_named_from_their_first_to_their_last_place():
    """Two pieces of 100 m that share 20 m; the wheelset lies 8 mm aside from 40 to 50 m."""

    def piece(begin, value):
        s = begin + np.arange(0.0, 100.5, 0.5)
        rows = np.full((len(QUANTITIES), len(s)), value)
        aside = np.where((s >= 40.0) & (s <= 50.0) & (s != 44.0), 0.008, 0.001)[None]
        same = np.zeros(len(QUANTITIES))
        bands = dict.fromkeys(BANDS, rows)
        return Estimate(
            s=s, speed=20.0, values=rows, deviations=same, bands=bands,
            band_deviations=dict.fromkeys(BANDS, same), wave_numbers=same, seen=same, power=same,
            outputs=("lateral.1",), forces=aside, force_deviations=np.zeros(1),
        )  # fmt: skip

    found = join_pieces(
        "run", "coach", [piece(0.0, 1.0), piece(80.0, 3.0)], np.array([0.006]), (), STRAIGHT
    )
    assert found.flanges == ((1, 40.0, 50.0),)
    said = {1: "40 to 50 m:", 9: ", ".join(8 * ["40 to 50"]) + " m (9 places in all):"}
    for places, words in said.items():
        seen = SimpleNamespace(unseen=dict, flanges=found.flanges * places)
        (note,) = type(found).notes.fget(seen)
        assert note.startswith(f"A flange of wheelset 1 touches at s = {words} the alignment")
    (note,) = type(found).notes.fget(SimpleNamespace(unseen=dict, flanges=((3, 102.3, 102.3),)))
    assert "wheelset 3 touches at s = 102 m:" in note  # was: from s = 102 to 102 m
    expected = np.interp(found.s, [80.0, 100.0], [1.0, 3.0])
    np.testing.assert_allclose(found.values[0], expected, atol=1e-12)


def test_deviations_are_the_root_of_the_mean_square_by_parseval():
    """Powers |X|^2 / n of a series of n values, with a part at half the sampling rate."""
    x = np.random.default_rng(3).standard_normal((2, 16)) + 2.0 * (-1.0) ** np.arange(16)
    power = np.abs(np.fft.rfft(x, axis=1)) ** 2 / 16.0
    np.testing.assert_allclose(deviation(power, 16), np.sqrt(np.mean(x**2, axis=1)), rtol=1e-12)


def test_picture_shades_the_95_per_cent_interval_of_each_quantity():
    """1.96 standard deviations above and below the estimate, in mm."""
    s = np.arange(0.0, 100.5, 0.5)
    rows = 1e-3 * np.sin(s / 10.0) * np.array([[1.0], [2.0], [3.0], [4.0]])
    deviations = 1e-4 * np.arange(1.0, 5.0)
    bands, none = dict.fromkeys(BANDS, rows), np.zeros((len(QUANTITIES), 1))
    piece = Estimate(
        s=s, speed=20.0, values=rows, deviations=deviations, bands=bands,
        band_deviations=dict.fromkeys(BANDS, deviations), wave_numbers=none[0], seen=none,
        power=none, outputs=("lateral.1",), forces=rows[:1], force_deviations=np.zeros(1),
    )  # fmt: skip
    figure = irregularity_figure(
        join_pieces("run", "coach", [piece], np.array([0.1]), (), STRAIGHT)
    )
    assert len({line.get_linestyle() for line in figure.axes[3].lines[:3]}) == 3
    for q, axes in enumerate(figure.axes[:3]):
        for shaded in axes.collections:
            corners = shaded.get_paths()[0].vertices
            for side, end in ((-1.0, np.min), (1.0, np.max)):
                found = [end(corners[corners[:, 0] == at, 1]) for at in s]
                assert found == pytest.approx(1e3 * (rows[q] + side * 1.96 * deviations[q]))
