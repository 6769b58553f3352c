"""Modes with wheelsets held: of the benchmark coach and of all vehicles without friction."""

from dataclasses import replace

import numpy as np
import pytest
from dynamics import Settings, changed, load_track, load_vehicle, undamped
from suspension import Suspension

from railsim.linear.coordinates import FreeVehicle
from railsim.linear.eigenmodes import eigenmodes
from railsim.linear.modes import Mode, modes
from railsim.linear.naming import apart, divergence, mode_name, parts_of
from railsim.linear.vehicle import LinearVehicle
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.work import level_track

SPRUNG = [  # without friction elements
    "locomotive_coco_a",
    "coach_25t",
    "coach_crh380a",
    "coach_flexicoil",
    "coach_manchester",
    "coach_zhai_high_speed",
    "coach_zhai_ordinary",
    "coach_zhai_raised_speed",
    "cooperrider_vehicle",
    "locomotive_coco_b",
    "metro_b_motor",
    "metro_b_trailer",
    "power_car_china_star",
]
STUCK = ["wagon_three_piece_25t", "wagon_c62a", "wagon_uic_link"]  # centre plates, bearers, wedges


def held_modes(vehicle, *, loaded):
    """Modes with held wheelsets at 1 m/s; `loaded` by gravity and preloads, or free of both."""
    model = assemble(vehicle, load_track("straight"), Settings())
    if loaded:
        balance = equilibrium(model, 1.0)
        model, state = balance.model, balance.state
        system = level_track(model.system)
    else:
        system = level_track(model.system)._replace(gravity=0.0)
        state = np.zeros(model.n_state)
        state[-1] = 1.0
    free = FreeVehicle(model, system, state, held=True)
    return eigenmodes(free.linearisation(free.tangent())), free.coordinates.names


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("benchmark_vehicle1")


@pytest.fixture(scope="module")
def elastic(coach):
    return held_modes(undamped(coach), loaded=False)


def test_frequencies_without_weight_and_damping(elastic):
    """L4: computed twice independently, 0.1 %."""
    modes, _ = elastic
    expected = [
        0.5962,
        0.8551,
        1.0739,
        1.2784,
        1.2812,
        2.8595,
        7.4705,
        7.4773,
        9.6398,
        9.6568,
        11.624,
        11.631,
        12.805,
        12.808,
        35.354,
        35.354,
        36.232,
        36.237,
    ]
    assert modes.natural_frequencies == pytest.approx(expected, rel=1e-3)
    assert np.max(np.abs(modes.damping_ratios)) < 1e-4


def test_poles_of_the_sway_modes(elastic):
    """L7: lower sway turns about a point below the rails, upper sway about one above; 0.02 m."""
    modes, names = elastic
    heights = []
    for shape in modes.shapes[:6]:
        y, roll = (shape[names.index(f"carbody.{name}")] for name in ("y", "roll"))
        if abs(roll) > 1e-2 * np.max(np.abs(shape[: len(names) // 2])):
            # a point dz below the centre of gravity moves by y - roll dz; 1.8 m above the rails
            heights.append(1.8 - (y / roll).real)
    assert heights == pytest.approx([-2.04, 2.26], abs=0.02)


def test_frequencies_with_weight(coach):
    """L5: gravity and preloads soften the lower sway and stiffen the upper one; 0.2 %."""
    modes, _ = held_modes(undamped(coach), loaded=True)
    expected = [0.5311, 0.8500, 1.0739, 1.2789, 1.3216, 2.8554]
    assert modes.natural_frequencies[:6] == pytest.approx(expected, rel=2e-3)


def test_frequencies_and_damping_with_weight_and_dampers(coach):
    """L6: f0 and zeta with all dampers and their series springs; 0.2 %."""
    modes, _ = held_modes(coach, loaded=True)
    expected = np.array(
        [
            [0.5631, 0.2215],
            [0.8757, 0.5339],
            [1.0835, 0.1346],
            [1.2961, 0.1594],
            [1.2982, 0.4309],
            [2.8614, 0.0428],
            [7.7457, 0.2464],
            [7.7553, 0.2412],
        ]
    )
    oscillations = modes.taken(np.flatnonzero(modes.frequencies > 1e-3))
    assert oscillations.natural_frequencies[:8] == pytest.approx(expected[:, 0], rel=2e-3)
    assert oscillations.damping_ratios[:8] == pytest.approx(expected[:, 1], rel=2e-3)


def on_air(vehicle):
    """The vehicle with air springs in the place of its secondary coils."""
    air = {
        "kind": "airspring",
        "bellows_stiffness": 400e3,
        "reservoir_stiffness": 300e3,
        "area_stiffness": 50e3,
        "orifice_damping": 20e3,
        "horizontal_stiffness": [130e3, 150e3],
        "horizontal_damping": [5e3, 4e3],
        "torsional_stiffness": 8e3,
    }

    def change(_kind, name, table):
        if name == "secondary_spring":
            kept = {key: table[key] for key in ("bodies", "sides", "points")}
            table.clear()
            table.update(kept, **air)

    return changed(vehicle, change)


def exchanged(vehicle):
    """The vehicle on air springs whose bodies are named the other way round."""

    def change(_kind, name, table):
        if name == "secondary_spring":
            table.update(bodies=table["bodies"][::-1], points=table["points"][::-1])

    return changed(on_air(vehicle), change)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("coach_flexicoil", on_air),
        ("coach_flexicoil", exchanged),
        ("coach_manchester", on_air),
        *((name, None) for name in [*SPRUNG, *STUCK]),
    ],
)
def test_all_modes_are_those_of_the_energies_of_the_elements(name, change, small_contact_tables):
    """Arms, three axles, air springs either way round, friction that sticks: all, 1e-6."""
    vehicle = load_vehicle(name)
    vehicle = change(vehicle) if change else vehicle
    found = held_modes(vehicle, loaded=True)[0].eigenvalues
    expected = np.linalg.eigvals(Suspension(vehicle.model_dump(exclude_none=True)).matrix())
    found, expected = (values[values.imag > 1e-2] for values in (found, expected))
    assert len(found) == len(expected)
    apart = np.abs(found[:, None] - expected) / np.abs(expected)
    assert np.max(np.min(apart, axis=0)) < 1e-6
    assert np.max(np.min(apart, axis=1)) < 1e-6


def test_held_reference_would_pitch_otherwise(coach):
    """Freed, the body pitches at 1.296 Hz; as in runs, with its x held, at 1.386 Hz."""
    model = assemble(coach, load_track("straight"), Settings())
    balance = equilibrium(model, 1.0)
    free = FreeVehicle(balance.model, level_track(balance.model.system), balance.state, held=True)
    linear = free.linearisation(free.tangent())
    assert np.min(np.abs(eigenmodes(linear).natural_frequencies - 1.2961)) < 2e-3
    rest = [k for k, name in enumerate(linear.names) if name.rstrip("'") != "carbody.x"]
    values = np.linalg.eigvals(linear.matrix[np.ix_(rest, rest)])
    assert np.min(np.abs(np.abs(values) / (2 * np.pi) - 1.386)) < 2e-3


def test_a_change_of_the_bodys_mass_moves_the_bounce_as_a_single_mass_would(coach):
    """Bounce of the body on four coils of 430 kN/m over eight primaries: f ~ sqrt(1/m)."""
    heavier = changed(
        coach,
        lambda kind, name, table: (
            table.update(mass=64e3) if (kind, name) == ("bodies", "carbody") else None
        ),
    )
    bounce = []
    for vehicle in (coach, heavier):
        modes, names = held_modes(undamped(vehicle), loaded=True)
        z = [abs(shape[names.index("carbody.z")]) for shape in modes.shapes]
        bounce.append(modes.natural_frequencies[int(np.argmax(z))])
    series = 4 * 430e3 * 8 * 1.22e6 / (4 * 430e3 + 8 * 1.22e6)
    assert bounce[1] == pytest.approx(np.sqrt(series / 64e3) / (2 * np.pi), rel=0.01)
    assert bounce[1] / bounce[0] == pytest.approx(np.sqrt(0.5), rel=0.01)


def test_a_car_between_held_bogies_bounces_on_its_springs():
    """f0 = sqrt(4 kz/m)/2 pi: four secondary springs of 430 kN/m; the other elements pull across.

    The bogies alone under a held car are left with modes of their own, none of the car.
    """
    car = modes(
        load_vehicle("benchmark_vehicle1"),
        speed=20.0,
        held=True,
        hold=["front.frame", "rear.frame"],
    )
    bounce = car["car body bounce"]
    assert {name.partition(".")[0] for name in bounce.shape} == {"carbody"}
    assert bounce.natural_frequency == pytest.approx(
        np.sqrt(4.0 * 430e3 / 32000.0) / (2.0 * np.pi), rel=5e-3
    )
    bogies = modes(load_vehicle("benchmark_vehicle1"), speed=20.0, hold=["carbody"])
    assert not any("carbody" in name for mode in bogies for name in mode.participation)
    assert any("hunting" in mode.name for mode in bogies)


@pytest.mark.usefixtures("small_contact_tables")
def test_modes_of_the_same_eigenvalue_are_those_of_the_front_and_rear_bogie_in_any_mixture():
    """Yaw of the frames of two bogies that do not feel each other, at 26.87 Hz."""
    speed = 20.0
    prepared = LinearVehicle(load_vehicle("metro_b_motor"), load_track("straight"))
    parts = parts_of(prepared.model, prepared.coordinates)
    found = eigenmodes(prepared.linearised(speed))
    pair = np.flatnonzero(np.abs(found.frequencies - 26.874) < 1e-3)
    assert len(pair) == 2
    frames = [b for b in parts.frames if parts.model.index.bodies[b].endswith(".frame")]
    for angle, phase in ((0.0, 0.0), (0.7, 0.0), (1.2, 2.0), (0.5 * np.pi, 1.0)):
        turn = np.exp(1j * phase)
        mixture = np.array([[1.0, turn], [-1.0 / turn, 1.0]]) * np.cos(angle)
        mixture[[0, 1], [1, 0]] *= np.tan(angle)
        shapes = found.shapes.copy()
        shapes[pair] = mixture @ found.shapes[pair]
        told = apart(parts, replace(found, shapes=shapes))
        assert [mode_name(parts, told, k) for k in pair] == ["bogie yaw, front", "bogie yaw, rear"]
        for k, frame in zip(pair, frames, strict=True):
            of_frame, *others = parts.energy_shares(told.shapes[k])[[frame, *frames]].sum(axis=1)
            assert of_frame == pytest.approx(sum(others), rel=1e-4)  # the other one is at rest
        remaining = (
            found.linearisation.matrix @ told.shapes[pair].T
            - told.shapes[pair].T * found.eigenvalues[pair]
        )
        assert np.abs(remaining).max() < 1e-5 * abs(found.eigenvalues[pair[0]])


def test_a_mode_that_neither_swings_nor_decays_has_no_damping_ratio():
    assert Mode("", 0j, {}, {}).damping_ratio == 0.0
    assert Mode("", -3.0 + 4.0j, {}, {}).damping_ratio == pytest.approx(3.0 / 5.0)


def test_a_car_that_tips_over_is_told_from_wheelsets_that_leave_the_middle():
    """9 m above the rails its weight outdoes the springs; beside it a shape as on hollow treads."""

    def raised(kind, name, table):
        if name == "carbody":
            table["position"] = [0.0, 0.0, -9.0]

    track = load_track("straight").replace(support={"preset": "rigid"})
    tall, coach = (
        LinearVehicle(vehicle, track, settings=Settings())
        for vehicle in (
            changed(load_vehicle("coach_manchester"), raised),
            load_vehicle("coach_manchester"),
        )
    )
    tips = divergence(parts_of(tall.model, tall.coordinates), eigenmodes(tall.linearised(20.0)))
    assert "and carbody moves farthest, as where springs do not hold it upright" in " ".join(tips)
    assert "hollow" not in " ".join(tips)
    parts, found = parts_of(coach.model, coach.coordinates), eigenmodes(coach.linearised(20.0))
    assert not divergence(parts, found)
    hunting = next(
        k for k in range(len(found.eigenvalues)) if "front hunting" in mode_name(parts, found, k)
    )
    grows = replace(found.taken([hunting]), eigenvalues=np.array([1.0 + 0.0j]))
    assert "as on hollow treads" in " ".join(divergence(parts, grows))
