"""Gritti (2012), the ATR95 pantograph: printed, derived and reconstructed numbers.

Every test says of its numbers: *printed* in the source, *derived* from printed numbers alone,
*reconstructed* (they hold for the four-bar R1 or the cam, which agree with what is printed but are
not unique), *new* (beyond the source; computed twice by others, with closed forms and with a
general planar solver).  The ids are those of the list of acceptance numbers.  Tolerances are those
of that list: half a unit of the printed digit, or of the second computation.
"""

import numpy as np
import pytest
from selection import points

from railsim.definitions.loading import load_mechanism
from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.parts import Cylinder
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.comparison import compare
from railsim.mechanisms.forces import table_of
from railsim.mechanisms.judgement import Judge
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.model import build
from railsim.mechanisms.optimisation import first_points, optimise
from railsim.mechanisms.selection import needed_bore
from railsim.mechanisms.targets import follow_error, positions
from railsim.mechanisms.tolerance import scatter, sensitivities

LIFTS = tuple(f"atr95_lift_{i}" for i in (1, 2, 3, 4, 5))
STROKES = (120.7408, 114.2241, 116.1322, 112.1972, 113.6682)
FORCES = (9877.2938, 10257.5192, 10253.8736, 10625.5782, 9803.4512)
RATES = (143.1503, 137.8439, 137.8929, 133.0692, 144.2285)
PRESSURES = (0.4913, 0.5102, 0.5100, 0.5285, 0.4876)
TO_WORK = ["optimise.reference=atr95_lift_5"]


def by_lift(values):
    return list(zip(LIFTS, values, strict=True))


@pytest.fixture(scope="module")
def lifts():
    names = (*LIFTS, "atr95", "atr95_lift_6")
    return {name: analyse(load_mechanism(name, ["sampling.points=401"])) for name in names}


def at_positions(result, name):
    """A result at closed, zone low, work, high, end."""
    zone = [result.zone[position][name] for position in ("low", "work", "high")]
    return np.array([result.output[name][0], *zone, result.output[name][-1]])


@pytest.mark.parametrize(("name", "stroke"), by_lift(STROKES))
def test_a1_strokes_printed(lifts, name, stroke):
    assert lifts[name].stroke * 1e3 == pytest.approx(stroke, abs=1e-3)


@pytest.mark.parametrize(("name", "stroke"), by_lift(STROKES))
def test_a2_travel_from_the_printed_strokes_derived(lifts, name, stroke):
    result = lifts[name]
    rate = result.output["rate"][-1]
    travel = result.travel + (stroke * 1e-3 - result.stroke) / rate
    assert np.degrees(travel) == pytest.approx(43.5525, abs=2e-4)


def test_a3_length_of_lift_5_and_of_its_wrong_assembly_derived(lifts):
    length = lifts["atr95_lift_5"].output["length"] * 1e3
    assert length[0] == pytest.approx(157.5893, abs=1e-3)
    assert length[-1] == pytest.approx(271.2574, abs=1e-3)
    wrong = build(load_mechanism("atr95_lift_5", ["parameters.assembly=-1"]))
    closed = solve(wrong, [0.0]).length(("ground.foot", "coupler.point"))[0][0]
    assert closed * 1e3 == pytest.approx(153.522, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "angle", "smallest"),
    [
        ("atr95_lift_1", "mu", 42.374),
        ("atr95_lift_1", "mu_prime", 40.000),
        ("atr95_lift_2", "mu", 55.255),
        ("atr95_lift_3", "mu", 40.000),
        ("atr95_lift_4", "mu", 75.488),
        ("atr95_lift_4", "mu_prime", 40.000),
        ("atr95_lift_5", "mu", 59.144),
        ("atr95_lift_5", "mu_prime", 82.447),
    ],
)
def test_a4_smallest_transmission_angles_derived(lifts, name, angle, smallest):
    assert np.degrees(lifts[name].min_angles[angle]) == pytest.approx(smallest, abs=2e-3)


@pytest.mark.parametrize(("name", "rate"), by_lift(RATES))
def test_a5_rate_of_the_actuator_closed_derived(lifts, name, rate):
    assert lifts[name].output["rate"][0] * 1e3 == pytest.approx(rate, abs=1e-3)


@pytest.mark.parametrize(("name", "force"), by_lift(FORCES))
def test_a6_torque_closed_from_the_printed_forces_derived(lifts, name, force):
    torque = force * lifts[name].output["rate"][0]
    assert torque == pytest.approx(1413.937, abs=3e-3)
    weight = lifts[name].output["effective_weight"][0]
    y1 = lifts[name].output["ratio"][0] * lifts[name].output["rate"][0]
    assert weight * y1 == pytest.approx(torque, abs=3e-3)


@pytest.mark.parametrize(("name", "force"), by_lift(FORCES))
def test_a7_largest_forces_printed_with_the_reconstructed_four_bar(lifts, name, force):
    result = lifts[name]
    assert result.max_force == pytest.approx(force, abs=0.1)
    assert result.output["travel"][np.argmax(result.output["force"])] == 0.0


@pytest.mark.parametrize(
    ("name", "error", "printed"),
    [
        ("atr95_lift_2", 0.28230, 0.28123),
        ("atr95_lift_3", 0.21826, 0.21743),
        ("atr95_lift_4", 1.03379, 1.0272),
    ],
)
def test_a8_errors_against_lift_5_printed_and_reconstructed(name, error, printed):
    mechanism = load_mechanism(name)
    found = follow_error(mechanism, positions(mechanism))
    assert found == pytest.approx(error, rel=5e-3)
    assert found == pytest.approx(printed, rel=1e-2)  # the four-bar is not the source's


@pytest.mark.parametrize(
    ("name", "optimum"),
    [
        ("atr95_lift_2", {"c": 0.134611, "alpha1_in": 81.197}),
        ("atr95_lift_3", {"c": 0.144212, "alpha1_in": 6.4475, "a1": 0.071782}),
        ("atr95_lift_4", {"c": -0.152042, "alpha1_in": 108.147, "a1": 0.129213, "a2": 0.118508}),
    ],
)
def test_a9_local_optima_from_the_printed_values_reconstructed(name, optimum):
    found = optimise(load_mechanism(name), starts=1).parameters
    for parameter, value in optimum.items():
        if parameter.startswith("alpha"):
            assert np.degrees(found[parameter]) == pytest.approx(value, abs=5e-3)
        else:
            assert found[parameter] == pytest.approx(value, abs=5e-6)


def test_a10_ratios_reconstructed(lifts):
    result = lifts["atr95_lift_5"]
    ratio = [32.984, 25.853, 24.506, 23.123, 18.474]
    across = [-2.306, -1.763, -2.141, -2.410, 1.712]
    assert at_positions(result, "ratio") == pytest.approx(ratio, abs=3e-3)
    assert at_positions(result, "ratio_x") == pytest.approx(across, abs=3e-3)


def test_a11_travel_of_the_zone_reconstructed(lifts):
    zone = lifts["atr95_lift_5"].zone
    travel = [np.degrees(zone[position]["travel"]) for position in ("low", "work", "high")]
    assert travel == pytest.approx([8.733, 13.796, 19.058], abs=5e-3)


@pytest.mark.parametrize(("bore", "force"), [(0.16, 14074.335), (0.125, 8590.292)])
def test_a12_force_of_a_cylinder_derived(bore, force):
    # the source's 140743.3509 N is a slip of a unit
    result = analyse(load_mechanism("atr95_lift_4", [f"parameters.bore={bore}"]))
    cylinder = result.definition.actuators["lift"]
    assert isinstance(cylinder, Cylinder)
    area = result.output["force"][0] / result.output["pressure"][0]
    assert area * 0.7e6 == pytest.approx(force, abs=1e-2)
    assert needed_bore(result, cylinder) * 1e3 == pytest.approx(139.02, abs=1e-2)


@pytest.mark.parametrize(("name", "pressure"), by_lift(PRESSURES))
def test_a13_pressure_at_the_largest_force_derived(lifts, name, pressure):
    assert lifts[name].output["pressure"][0] / 1e6 == pytest.approx(pressure, abs=1e-4)


@pytest.mark.parametrize(
    ("height", "force", "pressure"),
    [(130, 1000, 0.35333), (150, 800, 0.31111), (200, 560, 0.30000), (215, 700, 0.43529)],
)
def test_a14_pressure_of_the_air_spring_from_the_printed_table(lifts, height, force, pressure):
    result = lifts["atr95"]
    table = table_of(result.motion, result.definition.actuators["lift"])
    found = table.pressure(height * 1e-3, force * 10.0) / 1e6
    assert found == pytest.approx(pressure, abs=1e-5)


@pytest.mark.parametrize(("height", "pressure", "force"), [(110, 0.45, 1412.5), (210, 0.35, 590.0)])
def test_a15_force_of_the_air_spring_from_the_printed_table(lifts, height, pressure, force):
    result = lifts["atr95"]
    table = table_of(result.motion, result.definition.actuators["lift"])
    assert table.force(height * 1e-3, pressure * 1e6) / 10.0 == pytest.approx(force, abs=1e-3)


def test_a16_case_start_of_lift_1_printed():
    result = analyse(load_mechanism("atr95_lift_1"), "start")
    length = result.output["length"] * 1e3
    assert length[[0, -1]] == pytest.approx([129.5286, 245.8003], abs=1e-3)


def objective(overrides, *, best=False):
    mechanism = load_mechanism("atr95_lift_5", [*TO_WORK, *overrides])
    judge = Judge(mechanism)
    own = np.array([float(judge.values[name]) for name in judge.names])
    return (judge(own, {}).objective, optimise(mechanism, starts=1) if best else None)


@pytest.mark.slow
def test_a18_constant_ratio_new():
    before, found = objective(["optimise.objective=constant", "optimise.target=24.472"], best=True)
    assert before == pytest.approx(131.02, rel=1e-4)  # the four-bar R1
    assert found.objective <= 0.01
    assert found.feasible


@pytest.mark.slow
def test_a19_linear_ratio_new():
    space = ["optimise.sample=travel", "optimise.range=travel", "optimise.points=400"]
    line = ["optimise.target=29.2219", "optimise.slope=-4.8455"]
    before, found = objective([*space, *line, "optimise.objective=linear"], best=True)
    assert before == pytest.approx(200.41, abs=0.01)
    assert found.objective <= 0.05
    assert found.feasible


def test_a20_cam_reconstructed(lifts):
    result = lifts["atr95"]
    assert result.stroke * 1e3 == pytest.approx(115.11, abs=1e-2)
    rate = np.abs(result.output["rate"])
    assert rate.max() / rate.min() == pytest.approx(1.586, abs=2e-3)
    fine = solve(result.model, np.linspace(result.model.start, result.model.end, 20001))
    cam = list(result.definition.joints).index("cam")
    changes = np.flatnonzero(np.diff(fine.arcs[:, cam]))
    rocker = fine.q[changes, result.model.bodies["rocker"], 2]
    assert np.degrees(rocker[0] - rocker[1]) == pytest.approx(4.973, abs=2e-3)
    force = [10292.8, 8364.9, 7948.6, 7536.1, 4586.6]
    pressure = [0.36227, 0.32472, 0.32447, 0.33024, 0.48390]
    assert at_positions(result, "force") == pytest.approx(force, abs=0.5)
    assert at_positions(result, "pressure") / 1e6 == pytest.approx(pressure, abs=5e-5)


@pytest.mark.slow
@points(
    ("lift", "seed"),
    [*((lift, seed) for lift in (1, 2, 3) for seed in (1, 2, 3)), (5, 2)],
    always=(0, 3, 6),
)
def test_no_seed_ends_above_the_published_design_reconstructed(lift, seed):
    # lift 4: A21, lift 5 from three seeds: A22; the first start is the published design itself
    mechanism = load_mechanism(f"atr95_lift_{lift}")
    judge = Judge(mechanism)
    published = judge(np.array([float(judge.values[name]) for name in judge.names]), {})
    assert published.violation < 1e-5  # their angle of 40 degrees, printed to seven digits
    found = optimise(mechanism, starts=2, seed=seed)
    assert found.feasible
    assert found.objective <= published.objective


@pytest.mark.slow
@points("seed", [1, 2, 3], always=(0,))
@points(("lift", "optimum"), [(2, 0.2823), (3, 0.2183)], always=(1,))
def test_lifts_2_and_3_are_found_without_their_published_parameters_reconstructed(
    lift, optimum, seed
):
    starts = optimise(load_mechanism(f"atr95_lift_{lift}"), starts=5, seed=seed).starts
    drawn = [start.objective for start in starts if start.number > 0 and start.feasible]
    assert min(drawn) == pytest.approx(optimum, rel=1e-3)


@pytest.mark.slow
@points("seed", [1, 2, 3], always=(1,))
def test_a21_better_lift_4_from_every_seed_new(seed):
    found = optimise(load_mechanism("atr95_lift_4"), starts=20, seed=seed)
    assert found.feasible
    # 0.00435 by the other computation, to half a unit of its last digit; here 0.0043499 from
    # each seed
    assert found.objective <= 0.00435 + 5e-6
    assert {limit.name for limit in found.active} == {"mu", "mu_prime"}
    assert all(limit.multiplier > 0.0 for limit in found.active)


def test_lift_4_with_its_rod_on_the_other_side_new():
    # both assemblies asked for: the starts take turns, and the other one is better still
    mechanism = load_mechanism(
        "atr95_lift_4",
        [
            "optimise.assemblies={assembly=[1,-1]}",
            "optimise.bounds.alpha1_in=[0.7,2.6]",
            "parameters.assembly=-1",
            "parameters.c=-0.139720",
            f"parameters.alpha1_in={float(np.radians(57.560))!r}",
            "parameters.a1=0.160538",
            "parameters.a2=0.040052",
        ],
    )
    sides = [choice["assembly"] for _, choice in first_points(Judge(mechanism), 5, 1)]
    assert sides == [-1.0, -1.0, 1.0, -1.0, 1.0]  # the file's own, then in turn
    found = optimise(mechanism, starts=1)
    assert found.feasible
    assert found.objective <= 3e-7
    assert found.parameters["assembly"] == -1.0


def test_envelope_keeps_points_in_its_box_new():
    # the slider's pin of lift 2 moves on the line y = c above the hinge: lower it to 130 mm
    box = "optimise.envelope=[{points=['slide.pin'],y=[0.0,0.250]}]"
    found = optimise(load_mechanism("atr95_lift_2", [box]), starts=1)
    assert found.feasible
    assert found.parameters["c"] == pytest.approx(0.130, abs=1e-7)  # 0.250 less the hinge's 0.120
    assert [limit.name for limit in found.active] == ["envelope.0"]
    assert found.objective > 0.2823


def test_weighted_objectives_add_up_new():
    single = {}
    for kind in ("follow", "constant_force"):
        judge = Judge(load_mechanism("atr95_lift_2", [f"optimise.objective={kind}"]))
        own = np.array([float(judge.values[name]) for name in judge.names])
        single[kind] = judge(own, {}).objective
    both = "optimise.objective={follow=2.0,constant_force=30.0}"
    found = Judge(load_mechanism("atr95_lift_2", [both]))(own, {}).objective
    assert found == pytest.approx(2.0 * single["follow"] + 30.0 * single["constant_force"])


@pytest.mark.slow
@points("seed", [1, 2, 3], always=(1,))
def test_a22_lift_5_that_fits_its_cylinder_from_every_seed_new(seed):
    fits = load_mechanism("atr95_lift_5", [*TO_WORK, "optimise.min_length=0.440"])
    found = optimise(fits, starts=2, seed=seed)
    assert found.feasible
    assert found.objective <= 1e-3
    assert found.after.output["length"][0] >= 0.440 - 1e-7


def test_lift_5_follows_the_cam_as_closely_as_it_can_reconstructed():
    """From one start; a search that ends too early had 0.0025."""
    found = optimise(load_mechanism("atr95_lift_5"), starts=1)
    assert found.feasible
    assert found.objective <= 0.00172


@pytest.mark.slow
def test_a23_constant_actuator_force_new(lifts):
    def spread(result):
        low, high = (result.zone[position]["travel"] for position in ("low", "high"))
        inside = (result.output["travel"] >= low) & (result.output["travel"] <= high)
        force = result.output["force"][inside]
        force = np.append(force, [result.zone[p]["force"] for p in ("low", "high")])
        return np.ptp(force) / np.mean(force)

    assert spread(lifts["atr95_lift_5"]) == pytest.approx(0.1041, abs=2e-4)
    _, found = objective(["optimise.objective=constant_force"], best=True)
    assert spread(found.after) <= 0.001


def test_cam_by_its_rounded_centres_reconstructed(lifts):
    # two decimals of a mm leave a jump: the arcs change where the rates agree, the gap is told
    plain = lifts["atr95"]
    turn = np.exp(-1j * plain.model.values["upper_alpha_in"])  # from the lift's frame to the boom's
    arcs = [
        {"radius": radius * 1e-3, "turns": turns, "centre": [centre.real, centre.imag]}
        for centre, radius, turns in (
            ((253.67 + 134.78j) * 1e-3 * turn, 135.0, "left"),
            ((53.37 - 289.30j) * 1e-3 * turn, 334.0, "right"),
            ((2351.38 + 3669.00j) * 1e-3 * turn, 4243.0, "left"),
        )
    ]
    data = plain.definition.model_dump(exclude_none=True)
    data["joints"]["cam"] = {"cam": "rocker.roller", "body": "boom", "arcs": arcs}
    result = analyse(Mechanism.model_validate(data))
    for exact, rounded in zip(plain.transitions, result.transitions, strict=True):
        assert np.degrees(rounded.travel) == pytest.approx(np.degrees(exact.travel), abs=5e-3)
        assert exact.gap < 1e-9
        assert 0.0 < rounded.gap < 1e-5  # half a digit in each coordinate of two centres
        assert rounded.rate_after == pytest.approx(rounded.rate_before, rel=1e-4)
    travel = [np.degrees(change.travel) for change in plain.transitions]
    assert travel == pytest.approx([9.16, 26.70], abs=5e-3)
    assert at_positions(result, "force") == pytest.approx(at_positions(plain, "force"), rel=2e-5)


def test_a24_six_bar_new(lifts):
    result = lifts["atr95_lift_6"]
    length = result.output["length"] * 1e3
    assert length[[0, -1]] == pytest.approx([456.354, 571.695], abs=1e-2)
    assert result.output["rate"][0] * 1e3 == pytest.approx(136.447, abs=1e-2)
    assert result.max_force == pytest.approx(10362.5, abs=1.0)
    error = compare([lifts["atr95"], result])[1]["error"]
    assert error == pytest.approx(0.0031, abs=2e-4)


def test_a25_speed_and_acceleration_of_the_head_reconstructed(lifts):
    timed = lifts["atr95_lift_5"].timed
    work = lifts["atr95_lift_5"].zone["work"]["travel"]
    v, a = (
        [np.interp(work, timed.motion.s, values[:, i]) * 1e3 for i in (0, 1)]
        for values in timed.point("trapezoid.head")
    )
    assert v == pytest.approx([-21.409, 245.057], abs=1e-2)  # interpolated in time
    assert a == pytest.approx([-2.910, -10.758], abs=1e-2)


def test_a25_speed_and_acceleration_at_work_height_exactly(lifts):
    result = lifts["atr95_lift_5"]
    motion = solve(result.model, [result.zone["work"]["travel"]])
    _, w, w1 = motion.length(("ground.foot", "coupler.point"))
    s1 = 0.010 / w
    _, r1, r2 = motion.point("trapezoid.head")
    v = (r1 * s1[:, None])[0] * 1e3
    a = (r2 * s1[:, None] ** 2 - r1 * (w1 * s1**2 / w)[:, None])[0] * 1e3
    assert v == pytest.approx([-21.409, 245.057], abs=1e-3)
    assert a == pytest.approx([-2.910, -10.758], abs=1e-3)


def test_a26_generalised_ratio_at_work_reconstructed(lifts):
    result = lifts["atr95_lift_5"]
    motion = solve(result.model, [result.zone["work"]["travel"]])
    w = motion.length(("ground.foot", "coupler.point"))[1]
    boom = motion.at(result.model.bodies["boom"], 0.5 * 1.873, 0.0)[1]
    trapezoid = motion.at(result.model.bodies["trapezoid"], 0.5 * 1.8257, 0.0)[1]
    head = motion.point("trapezoid.head")[1]
    found = [r1[0, 1] / w[0] for r1 in (boom, trapezoid, head)]
    assert found == pytest.approx([6.5981, 18.8510, 24.5057], abs=1e-3)


def test_a27_pressure_angle_and_roller_force_of_the_cam_reconstructed(lifts):
    result = lifts["atr95"]
    angle = np.degrees(at_positions(result, "cam_pressure_angle"))
    assert angle == pytest.approx([-26.650, -12.926, -7.220, -1.841, 29.016], abs=5e-3)
    force = np.abs(result.reactions["cam"].components[:, 0])
    heights = result.output["height"]
    work = np.interp(result.zone["work"]["height"], heights, force)
    assert [force[0], work, force[-1]] == pytest.approx([8809.7, 6138.7, 3974.1], abs=0.5)


def test_a28_effective_weight_and_mass_reconstructed(lifts):
    result = lifts["atr95_lift_5"]
    weight = [297.22, 322.18, 324.96, 324.47, 296.01]
    mass = [24.20, 26.65, 27.23, 27.57, 26.21]
    assert at_positions(result, "effective_weight") == pytest.approx(weight, abs=2e-2)
    assert at_positions(result, "effective_mass") == pytest.approx(mass, abs=2e-2)


def test_a29_reactions_of_lift_5_reconstructed(lifts):
    result = lifts["atr95_lift_5"]
    heights, work = result.output["height"], result.zone["work"]["height"]

    def closed_and_work(values):
        return [values[0], np.interp(work, heights, values)]

    parts = {name: r.components for name, r in result.reactions.items()}
    sizes = {name: np.hypot.reduce(rows, axis=1) for name, rows in parts.items()}
    assert closed_and_work(-parts["rod"][:, 0]) == pytest.approx([5475.9, 2268.5], abs=0.2)
    assert closed_and_work(sizes["boom_tip"]) == pytest.approx([5522.0, 2398.0], abs=0.2)
    assert closed_and_work(sizes["boom_pin"]) == pytest.approx([10091.2, 8015.5], abs=0.2)
    assert closed_and_work(-parts["rocker"][:, 0]) == pytest.approx([1146.2, -803.5], abs=0.2)
    assert closed_and_work(sizes["boom_hinge"]) == pytest.approx([9008.4, 7074.4], abs=0.2)


def test_a30_contact_force_at_constant_pressure_reconstructed(lifts):
    contact = lifts["atr95_lift_5"].contact
    assert contact.pressure / 1e6 == pytest.approx(0.51795, abs=1e-5)
    assert list(contact.force.values()) == pytest.approx([80.64, 100.00, 125.90], abs=0.1)
    held = analyse(load_mechanism("atr95", ["parameters.held_pressure=0.36227e6"]))
    assert list(held.contact.force.values()) == pytest.approx([39.04, 39.71, 32.84], abs=0.1)


def test_a31_equilibria_at_constant_pressure_reconstructed():
    held = analyse(load_mechanism("atr95", ["parameters.held_pressure=0.33e6"]))
    heights = [y * 1e3 for y, _ in held.contact.equilibria]
    assert heights == pytest.approx([407.1, 1183.5], abs=0.5)
    assert [stable for _, stable in held.contact.equilibria] == [False, True]


def test_a32_derivatives_of_the_stroke_derived():
    names = ["d", "a1", "a2", "a3", "a4", "d_x", "d_y"]
    _, _, slopes = sensitivities(load_mechanism("atr95_lift_5"), names)["stroke"]
    expected = [0.37879, 0.31344, 0.06749, -0.39691, -0.01226, 0.05658, 0.00671]
    assert [slopes[name] for name in names] == pytest.approx(expected, abs=1e-4)


def test_scatter_of_the_stroke_follows_from_its_derivatives_derived():
    derivatives = {"d": 0.37879, "a1": 0.31344, "a2": 0.06749, "a3": -0.39691}  # A32
    deviation = 1e-4
    widths = ",".join(f"{name}={deviation}" for name in derivatives)
    stroke = next(
        one
        for one in scatter(load_mechanism("atr95_lift_5", [f"tolerances={{{widths}}}"]))
        if one.name == "stroke"
    )
    values = np.array(list(derivatives.values())) * deviation
    assert stroke.random == pytest.approx(np.hypot.reduce(values), abs=1e-8)
    assert stroke.worst == pytest.approx(np.abs(values).sum(), abs=1e-8)
    assert max(stroke.single, key=lambda name: abs(stroke.single[name])) == "a3"


def turned(angle):
    """Overrides that turn the frame of lift 5 about the boom hinge."""
    c, s = np.cos(angle), np.sin(angle)
    pin = f'{{ radius = "a1", angle = "alpha1_in - upper_alpha_in + {angle}" }}'
    rocker = f'["d * {c}", "upper_h + d * {s}"]'
    foot = f'["d_x * {c} + d_y * {s}", "upper_h + d_x * {s} - d_y * {c}"]'
    start = f'"atan2(rocker_dy, rocker_dx) + assembly * rocker_angle + {angle}"'
    return [
        f"bodies.boom.points.pin={pin}",
        f"ground.points.rocker={rocker}",
        f"ground.points.foot={foot}",
        f"start.coupler.angle={start}",
    ]


@points("angle", [0.4, -1.3, 2.9], always=(1,))
def test_a33_turning_the_lift_frame_changes_ground_reactions_only(lifts, angle):
    plain, other = lifts["atr95_lift_5"], None
    other = analyse(load_mechanism("atr95_lift_5", [*turned(angle), "sampling.points=401"]))
    for name in ("length", "rate", "ratio", "force", "pressure", "height"):
        assert other.output[name] == pytest.approx(plain.output[name], rel=1e-9, abs=1e-12)
    assert other.min_angles == pytest.approx(plain.min_angles, rel=1e-9)
    assert other.reactions["boom_hinge"].max != pytest.approx(plain.reactions["boom_hinge"].max)


def test_a33_scaling_all_lengths_scales_the_stroke(lifts):
    plain = lifts["atr95_lift_5"]
    lengths = ["d", "a1", "a2", "a3", "a4", "d_x", "d_y", "zone_low", "zone_work", "zone_high"]
    lengths += [f"upper_{name}" for name in "abcdeh"]
    values = plain.model.values
    k = 1.7
    scaled = [f"parameters.{name}={float(values[name]) * k!r}" for name in lengths]
    other = analyse(load_mechanism("atr95_lift_5", [*scaled, "sampling.points=401"]))
    assert other.stroke == pytest.approx(k * plain.stroke, rel=1e-9)
    for name in ("ratio", "force"):  # weights do not scale
        assert other.output[name] == pytest.approx(plain.output[name], rel=1e-9)
