"""Linearised wheel-rail contact: critical speeds of cones, creep coefficients, runs from a mode."""

import functools

import numpy as np
import pytest
from dynamics import Settings, changed, load_track, load_vehicle
from rig import test_vehicle
from selection import points

from railsim.contact import contact_geometry, table
from railsim.contact.table import TableGrid
from railsim.errors import InputError
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.linear.eigenmodes import eigenmodes, oscillations
from railsim.linear.harmonic import ContactPath
from railsim.linear.modes import modes, root_locus
from railsim.linear.stability_loss import loss_of_stability
from railsim.linear.system import Linearisation
from railsim.linear.vehicle import Contact, LinearVehicle, smooth_law
from railsim.model.time_step import SCHEMES, Stability, empty_recorder
from railsim.model.work import CONSTANT_SPEED, level_track_with_friction, work_arrays
from railsim.profiles import Profile, load_profile
from railsim.profiles.builtin import arc_chain_rail

RIGID = {"preset": "rigid"}
STRAIGHT = load_track("straight").replace(support=RIGID)
CELLS = smooth_law(Settings())  # of 10 x 10 cells the creep coefficients are 0.5 % larger
LINEAR = Settings(creep_law="linear")


def on_springs(linearisation, lateral, yaw):
    """A linearised wheelset with springs to the ground."""
    names, matrix = list(linearisation.names), linearisation.matrix.copy()
    for name, stiffness, inertia in (("y", lateral, 1813.0), ("yaw", yaw, 1120.0)):
        entry = names.index(f"wheelset.{name}'"), names.index(f"wheelset.{name}")
        matrix[entry] -= stiffness / inertia
    return Linearisation(linearisation.names, matrix, linearisation.state, linearisation.parameter)


@pytest.mark.parametrize(
    "contact", [Contact("harmonic", 0.3e-3), Contact("harmonic", 1e-3), Contact("harmonic", 3e-3)]
)
@pytest.mark.usefixtures("small_contact_tables")
def test_critical_speed_of_a_wheelset_on_springs(contact):
    """L2: cones 1:20 on 60E1, friction 1; 41.37 m/s and 2.524 Hz computed independently, 2 %."""
    wheelset = LinearVehicle(
        test_vehicle("single_wheelset"), STRAIGHT.replace(friction=1.0), contact=contact
    )
    lost = loss_of_stability(
        lambda speed: on_springs(wheelset.linearised(speed), 2e5, 4e5), 20.0, 70.0, points=4
    )
    assert lost.parameter == pytest.approx(41.37, rel=0.02)
    assert lost.modes[0].frequencies[0] == pytest.approx(2.524, rel=0.02)


def on_cones(vehicle):
    """The vehicle on wheels of 1:20."""
    return changed(
        vehicle,
        lambda kind, _, part: part.update(profile="cone_1in20") if kind == "wheelsets" else None,
    )


@pytest.fixture(scope="module")
def coned():
    """The benchmark coach on cones 1:20; rails with a head of constant radius, no saturation."""
    y, z = arc_chain_rail((28.0,), (300.0, 8.0))
    arc = Profile("arc", "rail", 1e-3 * y, 1e-3 * z, "one arc of 300 mm, corners of 8 mm")
    vehicle = on_cones(load_vehicle("benchmark_vehicle1"))
    track = STRAIGHT.replace(rail="arc", friction=1000.0)

    def prepared(contact, settings):
        return LinearVehicle(
            vehicle, track, contact=contact, profiles={"arc": arc}, settings=settings
        )

    return prepared


def test_free_wheelset_hunts_as_in_a_run():
    """S1002 on 60E1 under 44 kN, 3 mm: 0.1645 in a run (RK4, FASTSIM 30 x 30) that decays past it.

    0.177 by quadrature of the rigid contact's rolling radii, the equivalent conicity.  Slopes of
    the creep force as at rest, where the patch is twice as large, made it 0.11.
    """
    alone = test_vehicle("single_wheelset")
    changes = {"profile": ("S1002", "S1002"), "mass": 9000.0}
    loaded = alone.wheelsets["wheelset"].model_copy(update=changes)
    speed, amplitude = 2.0, 3e-3
    slow = LinearVehicle(
        alone.replace(wheelsets={"wheelset": loaded}),
        STRAIGHT,
        contact=Contact("harmonic", amplitude),
    )
    values = np.linalg.eigvals(slow.linearised(speed).matrix).imag
    hunting = values[(values > 0.5) & (values < 5.0)]
    (expected,) = contact_geometry(
        load_profile("S1002"), load_profile("60E1"), inclination=STRAIGHT.inclination
    ).equivalent_conicity([amplitude])
    found = (hunting / speed) ** 2 * 0.46 * 0.75
    assert found == pytest.approx([0.1645], rel=0.02)
    assert found == pytest.approx([expected], rel=0.08)


def test_hunting_of_larger_amplitudes_follows_the_conicity_down_and_up_again():
    """By quadrature of the rigid contact 0.59 at 0.5 mm, least at 4 mm, 0.29 at 6 mm.

    Frequencies as Klingel's; growth but for 6 mm, where the flange brings the axle back.  Trailing
    wheelsets, which creep across, move by a fifth less.
    """
    amplitudes = [0.5e-3, 1e-3, 2e-3, 3e-3, 4e-3, 5.5e-3, 6e-3]
    rigid = STRAIGHT.replace(support={"preset": "rigid"})
    coach, hunting = LinearVehicle(load_vehicle("coach_manchester"), rigid), []
    for amplitude in amplitudes:
        values = np.linalg.eigvals(coach.linearised(48.0, ContactPath(amplitude)).matrix)
        swings = values[(values.imag > 3.0) & (np.abs(values) < 60.0)]
        hunting.append(swings[np.argmax(swings.real)])
    conicity = contact_geometry(
        load_profile("S1002"), load_profile("60E1"), inclination=STRAIGHT.inclination
    ).equivalent_conicity(amplitudes)
    rises = (np.diff(conicity) > 0.0).tolist()
    assert rises == [*4 * [False], True, True]
    assert (np.diff(np.imag(hunting)) > 0.0).tolist() == rises
    assert (np.diff(np.real(hunting[:-1])) > 0.0).tolist() == rises[:-1]


@points(
    ("name", "friction", "amplitude", "speed"),
    [
        ("coach_manchester", 0.05, 1.95e-3, 59.07),
        ("coach_manchester", 0.2, 2.02e-3, 46.54),
        ("coach_manchester", 0.4, 1.99e-3, 45.59),
        ("benchmark_vehicle1", 0.1, 2.01e-3, 73.16),
        ("benchmark_vehicle1", 0.4, 2.03e-3, 78.62),
    ],
    always=(0, 3),
)
def test_harmonic_linearisation_loses_its_stability_at_limit_cycles(
    name, friction, amplitude, speed
):
    """Periodic motions by shooting, rigid rails: damped 1 % below, growing 1 % above their speed.

    With spins held and wheelsets that creep only by their rolling radii 24 % below to 14 % above.
    """
    vehicle = LinearVehicle(load_vehicle(name), STRAIGHT.replace(friction=friction), settings=CELLS)
    for share, sign in ((0.99, -1.0), (1.01, 1.0)):
        matrix = vehicle.linearised(share * speed, ContactPath(amplitude)).matrix
        values = np.linalg.eigvals(matrix)
        hunting = values[(values.imag > 20.0) & (np.abs(values) < 60.0)]
        assert sign * np.max(hunting.real) > 0.0


def test_harmonic_linearisation_follows_one_of_two_bogies_that_hunt_alike():
    """At 8.0 and 8.8 rad/s: now the one, now the other one was balanced, for ever."""
    wagon, path = LinearVehicle(load_vehicle("wagon_three_piece_25t"), STRAIGHT), ContactPath(3e-3)
    wagon.linearised(33.3, path)
    assert not path.remarks


def test_harmonic_linearisation_about_a_wheelset_at_its_flange_says_that_it_does_not_hunt():
    """R 500: inwards of its flange the torque about the leading axle has no balance nearby.

    Balanced all the same, a mode of 1.0 Hz was undamped by 13 % at 20 m/s.
    """
    track, contact = load_track("straight"), Contact("harmonic", 1e-3)
    coach = LinearVehicle(load_vehicle("coach_manchester"), track, contact=contact, radius=500.0)
    values = np.linalg.eigvals(coach.linearised(20.0).matrix)
    assert np.max(values[values.imag > 2.0].real) < 0.0
    (remark,) = coach.path_remarks
    assert remark.startswith("no hunting of 1 mm was found to linearise about at 20 to 20 m/s")


@points(
    ("contact", "settings"),
    [(Contact(), CELLS), (Contact(), LINEAR), (Contact("harmonic", 3e-3), LINEAR)],
    always=(2,),
)
@pytest.mark.usefixtures("small_contact_tables")
def test_critical_speed_of_the_benchmark_coach_on_cones(coned, contact, settings):
    """L8: 96.70 m/s and 2.909 Hz computed independently, 0.2 %; on cones at any amplitude.

    Bodies and elements from the file, cones on an arc in closed form, patches after Hertz with
    Kalker's linear creep forces and the load that the lateral force of spin leaves them.
    """
    lost = loss_of_stability(coned(contact, settings).linearised, 60.0, 130.0, points=4)
    assert lost.parameter == pytest.approx(96.70, rel=2e-3)
    assert lost.modes[0].frequencies[0] == pytest.approx(2.909, rel=2e-3)


@points(
    ("name", "cones", "allowed"),
    [("benchmark_vehicle1", True, 0.01), ("coach_manchester", False, 0.02)],
    always=(),
)
def test_half_the_spacing_of_the_contact_table_keeps_the_tangent_critical_speed(
    name, cones, allowed, monkeypatch
):
    """On 60E1: the slope of the lateral force at the centre is no ripple; S1002 moves by 1.5 %."""
    vehicle = on_cones(load_vehicle(name)) if cones else load_vehicle(name)
    found = []
    for share in (1.0, 0.5):
        usual = TableGrid()
        narrow = functools.partial(
            TableGrid, s_min=-6e-3, s_max=6e-3, roll_max=3e-3, yaw_max=0.02, n_w=3,
            ds=share * usual.ds, droll=share * usual.droll,
        )  # fmt: skip
        with monkeypatch.context() as patched:
            patched.setattr(table, "TableGrid", narrow)
            rolling = LinearVehicle(vehicle, STRAIGHT.replace(friction=0.4), contact=Contact())
        found.append(loss_of_stability(rolling.linearised, 20.0, 130.0, points=5).parameter)
    assert found[1] == pytest.approx(found[0], rel=allowed)
    if cones:  # computed independently: 95 to 99 m/s
        assert 95.0 < found[0] < 99.0


@pytest.mark.usefixtures("small_contact_tables")
def test_creep_coefficients_without_saturation_are_kalkers(coned):
    """L8: f11 9.700e6, f22 8.832e6, f23 2.032e4 per wheel on planes at 2.9 degrees; 0.2 %."""
    speed, mass, level = 50.0, 1813.0, np.cos(np.arctan(0.05)) ** 2
    linear = coned(Contact(), CELLS).linearised(speed)
    names = list(linear.names)

    def slope(force, velocity):
        return linear.matrix[
            names.index(f"front.outer.wheelset.{force}'"),
            names.index(f"front.outer.wheelset.{velocity}'"),
        ]

    assert -slope("x", "x") * mass * speed / 2 == pytest.approx(9.700e6, rel=2e-3)
    assert -slope("y", "y") * mass * speed / 2 == pytest.approx(8.832e6 * level, rel=2e-3)
    assert -slope("y", "yaw") * mass * speed / 2 == pytest.approx(2.032e4 * level, rel=2e-3)


@pytest.mark.further
def test_given_conicity_puts_the_vehicle_on_cones(coned):
    """Halving the slope of the wheels lowers hunting's frequency by sqrt(2) (Klingel)."""
    vehicle = load_vehicle("coach_manchester")
    found = []
    for conicity in (0.05, 0.1):
        lowest = [
            mode
            for mode in modes(vehicle, STRAIGHT, speed=10.0, conicity=conicity)
            if mode.name.endswith("hunting")
        ]
        found.append(min(mode.frequency for mode in lowest))
    assert found[1] / found[0] == pytest.approx(np.sqrt(2.0), rel=0.1)


AMPLITUDE = 5e-6  # m


@pytest.mark.parametrize("name", ["coach_manchester", "coach_flexicoil"])
@points("below", [1.0, 3.0, 6.0], always=(2,))
def test_a_run_from_the_modes_own_shape_decays_with_its_damping(name, below):
    """L9: hunting, started with its shape, loses what the eigenvalue says.

    1e-4 (rk4) and 2e-4 (fast).  The run is read through the left eigenvector, which sees this mode
    alone.
    """
    prepared = LinearVehicle(load_vehicle(name), STRAIGHT)
    critical = loss_of_stability(prepared.linearised, 20.0, 100.0).parameter
    speed = critical - below
    linear = prepared.linearised(speed)
    found = oscillations(eigenmodes(linear), 40.0)
    hunting = found.taken([int(np.argmin(found.damping_ratios))])
    for scheme, tolerance in (("rk4", 1e-4), ("fast", 2e-4)):
        measured = run_from(prepared, hunting, speed, scheme)
        assert measured == pytest.approx(hunting.damping_ratios[0], abs=tolerance)


def run_from(prepared, mode, speed, scheme):
    """Damping ratio of a mode in a run that starts with its shape."""
    model, rest = prepared.model, prepared.steady(speed)
    names = mode.linearisation.names
    indices = prepared.coordinates.indices[[prepared.coordinates.names.index(n) for n in names]]
    lateral = [abs(mode.shapes[0, names.index(f"{w}.y")]) for w in model.index.wheelsets]
    state = rest.copy()
    state[indices] += AMPLITUDE * (mode.shapes[0] / max(lateral)).real
    system = prepared.system._replace(drive=CONSTANT_SPEED)
    level = level_track_with_friction(system)
    h = Stability(model, level, rest, scheme, lambda _: ()).choose(1.0 / 200.0)
    steps = round(1.0 / mode.frequencies[0] / 16.0 / h)
    work, derivative, stages = work_arrays(system), np.zeros_like(state), np.zeros((3, len(state)))
    time, seen = [], []
    for k in range(4 * 16):
        status, *_ = time_loop(
            system,
            work,
            state,
            derivative,
            stages,
            empty_recorder(model, 1),
            SCHEMES[scheme],
            h,
            Chunk(min(k, 1), steps, 1 << 40, fresh=int(k == 0)),
        )
        assert status == 0
        time.append((k + 1) * steps * h)
        seen.append(mode.left[0] @ (state[indices] - rest[indices]))
    later = slice(16, None)
    growth = np.polyfit(time[later], np.log(np.abs(seen[later])), 1)[0]
    omega = np.polyfit(time[later], np.unwrap(np.angle(seen[later])), 1)[0]
    return -growth / np.hypot(growth, omega)


def test_an_amplitude_beyond_the_contact_table_is_refused():
    with pytest.raises(InputError, match="amplitude"):
        modes(load_vehicle("coach_manchester"), STRAIGHT, linearisation="harmonic", amplitude=0.1)


def test_names_of_the_coachs_modes_over_speed():
    """Car body modes stay, hunting rises with speed; both bogies hunt."""
    locus = root_locus(
        load_vehicle("coach_manchester"),
        STRAIGHT,
        speeds=[10.0, 20.0, 30.0, 40.0],
        linearisation="harmonic",
    )
    names = locus.names
    for name in (
        "lower sway",
        "upper sway",
        "car body bounce",
        "car body pitch",
        "car body yaw",
        "bogie bounce, in phase",
        "bogie pitch, out of phase",
    ):
        values = locus.eigenvalues[:, names.index(name)]
        assert np.isfinite(values).all()
        assert np.ptp(values.imag) < 0.03 * np.max(values.imag)
    hunting = locus.eigenvalues[:, names.index("front hunting")]
    assert np.all(np.diff(hunting.imag) > 3.0)


def test_friction_elements_that_stick_are_told():
    found = modes(test_vehicle("two_axle_wagon"), STRAIGHT, speed=15.0)
    assert any("stick" in remark for remark in found.remarks)
