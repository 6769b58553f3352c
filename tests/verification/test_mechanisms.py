"""Planar linkages in two ways: closed forms, multipliers, power, differences, energy."""

import numpy as np
import pytest
from mechanism_closed_forms import LENGTHS, upper
from selection import points

from railsim.definitions.loading import load_mechanism
from railsim.definitions.mechanism.parts import Slot
from railsim.definitions.mechanism.values import ends, parameter_values
from railsim.errors import InputError
from railsim.mechanisms import quantities
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.drawing import lines
from railsim.mechanisms.dynamics import driven_motion, free_motion
from railsim.mechanisms.forces import (
    Rates,
    actuator_force,
    generalised_force,
    inertia,
    reactions,
    unit_work,
)
from railsim.mechanisms.inversion import driver_at
from railsim.mechanisms.judgement import Judge
from railsim.mechanisms.kinematics import derivative, solve, tangents
from railsim.mechanisms.model import build
from railsim.mechanisms.tolerance import sensitivities

ALL = (
    "atr95", *(f"atr95_lift_{i}" for i in range(1, 7)),
    "tilting_one_spring", "tilting_two_springs", "watt_axlebox_guide",
)  # fmt: skip
WITH_FORCE = ALL[:-1]
TWO_POINT = {name: "lift" for name in ALL[:7]} | {n: "piston" for n in ALL[7:9]}


@pytest.fixture(scope="module")
def models():
    return {name: build(load_mechanism(name)) for name in ALL}


@pytest.fixture(scope="module")
def motions(models):
    return {n: solve(m, np.linspace(m.start, m.end, 201)) for n, m in models.items()}


@pytest.mark.parametrize("lift", LENGTHS)
def test_kernel_agrees_with_the_closed_forms_of_the_lifts(models, motions, lift):
    name = f"atr95_lift_{lift}"
    p, motion = models[name].values, motions[name]
    length = motion.length(ends(models[name].definition.actuators["lift"]))[0]
    closed = LENGTHS[lift](p["alpha1_in"] + motion.s, p)
    assert length == pytest.approx(closed, rel=1e-10)
    _, _, gamma, head, slope, torque = upper(motion.s, p)
    r, _, _ = motion.point("trapezoid.head")
    assert r == pytest.approx(np.stack((head.real, head.imag), axis=-1), abs=1e-10)
    turned = motion.q[:, models[name].bodies["trapezoid"], 2] - gamma
    assert np.abs(np.exp(1j * turned) - 1).max() < 1e-10
    assert motion.q1[:, models[name].bodies["trapezoid"], 2] == pytest.approx(slope, abs=1e-10)
    assert -generalised_force(motion) == pytest.approx(torque, rel=1e-10)


@pytest.mark.parametrize("name", ALL)
def test_a17_derivatives_by_the_driver_are_those_of_differences(models, motions, name):
    model, motion = models[name], motions[name]
    h = 2e-4 * (model.end - model.start)
    inside = motion.s[10:-10:17]
    parts = [solve(model, inside + step * h) for step in (-2, -1, 1, 2)]
    here = solve(model, inside)
    same = np.all([p.arcs == here.arcs for p in parts], axis=(0, 2))  # not across an arc's end
    for value, slope in (("q", "q1"), ("q1", "q2")):
        a, b, c, d = (getattr(p, value) for p in parts)
        differences = (a - 8 * b + 8 * c - d) / (12 * h)  # fourth order
        exact = getattr(here, slope)
        scale = max(np.abs(exact).max(), 1e-3)
        assert np.abs(differences - exact)[same].max() < 1e-6 * scale


@points("name", ALL[:7], always=(0, 4, 6))
def test_a17_gradients_by_parameters_are_those_of_differences(name):
    mechanism = load_mechanism(name)
    values = parameter_values(mechanism)
    names = [n for n in mechanism.parameters if not isinstance(mechanism.parameters[n], str)]
    names = [n for n in names if n.startswith(("d", "a", "c", "f", "o", "gamma", "upper_"))]
    names = [n for n in names if not n.startswith(("assembly", "contact", "cylinders"))]
    model = build(mechanism)
    s = np.linspace(0.0, model.end, 5)[1:]
    pair = ends(mechanism.actuators["lift"])
    moved = tangents(solve(model, s), model.lanes(names))
    work = unit_work(moved, mechanism.actuators["lift"])
    exact = {
        "length": derivative(moved.length(pair)[0]),
        "force": derivative(-generalised_force(moved) / work),
    }
    h = 1e-6
    fixed = {n: values[n] for n in values if n in mechanism.parameters}
    fixed = {n: v for n, v in fixed.items() if not isinstance(mechanism.parameters[n], str)}
    for k, parameter in enumerate(names):
        found = {"length": [], "force": []}
        for sign in (-1, 1):
            near = solve(build(mechanism, {**fixed, parameter: values[parameter] + sign * h}), s)
            found["length"].append(near.length(pair)[0])
            found["force"].append(actuator_force(near, "lift"))
        for quantity, (low, high) in found.items():
            scale = max(np.abs(exact[quantity]).max(), 1e-6)
            assert (high - low) / (2 * h) == pytest.approx(exact[quantity][k], abs=1e-6 * scale)


@pytest.mark.parametrize("kind", ["follow", "constant_force", "peak_force"])
def test_gradients_of_the_search_are_those_of_differences(kind):
    changes = [f"optimise.objective={kind}", "optimise.min_length=0.1", "optimise.max_stroke=0.2"]
    judge = Judge(load_mechanism("atr95_lift_4", changes))
    x = np.array([float(judge.values[name]) for name in judge.names])
    here = judge(x, {})
    for k in range(len(x)):
        step = np.eye(len(x))[k] * 1e-6
        low, high = judge(x - step, {}), judge(x + step, {})
        slope = (high.objective - low.objective) / 2e-6
        assert slope == pytest.approx(
            (here.square_gradient + here.rivals[0])[k], rel=1e-5, abs=1e-6
        )
        margins = (high.margins - low.margins) / 2e-6
        assert margins == pytest.approx(here.slopes[:, k], rel=1e-5, abs=1e-5)


def test_a_search_at_every_fourth_position_weighs_as_one_at_all():
    """A sum over a quarter of the positions counts four times; the largest force is no sum."""
    mechanism = load_mechanism(
        "atr95_lift_4", ["optimise.objective={follow = 2.0, peak_force = 1e-5}"]
    )
    full, rough = Judge(mechanism), Judge(mechanism, every=4)
    x = np.array([float(full.values[name]) for name in full.names]) + 1e-3
    whole, part = full(x, {}), rough(x, {})
    ratio = whole.residuals / np.sqrt(2.0)
    assert part.residuals == pytest.approx(np.sqrt(4.0 * 2.0) * ratio[::4], rel=1e-9)
    assert part.peak == pytest.approx(whole.peak, rel=1e-3)  # at other positions


@pytest.mark.parametrize("name", WITH_FORCE)
def test_virtual_work_agrees_with_the_multipliers(models, motions, name):
    # with the force that virtual work gives, nothing is left for the driver to add
    unknown = models[name].definition.solve.unknown
    force = actuator_force(motions[name], unknown)
    _, driver = reactions(motions[name], {unknown: force})
    assert np.abs(driver).max() < 1e-9 * np.abs(generalised_force(motions[name])).max()


@pytest.mark.parametrize("name", WITH_FORCE)
def test_force_of_the_motion_agrees_with_the_multipliers(models, name):
    model = models[name]
    timed = driven_motion(solve(model, np.linspace(model.start, model.end, 201)))
    rates = Rates(timed.speed, timed.acceleration, 1)
    law = model.definition.motion
    joints, driver = reactions(timed.motion, {law.actuator: timed.force}, rates)
    scale = np.abs(generalised_force(timed.motion)).max()
    assert np.abs(driver).max() < 1e-9 * scale
    assert all(np.all(np.isfinite(rows)) for rows in joints.values())


@pytest.mark.parametrize("name", ["atr95_lift_5", "tilting_two_springs"])
def test_work_of_the_actuator_is_the_change_of_energy_and_what_dampers_take(models, name):
    model = models[name]
    timed = driven_motion(solve(model, np.linspace(model.start, model.end, 401)))
    rates = Rates(timed.speed, timed.acceleration, 1)
    mass, slope = inertia(timed.motion)
    push = timed.force * unit_work(timed.motion, model.definition.actuators[TWO_POINT[name]])
    power = (push + generalised_force(timed.motion, rates)) * timed.speed
    kinetic = (mass * timed.acceleration + 0.5 * slope * timed.speed**2) * timed.speed
    assert power == pytest.approx(kinetic, abs=1e-9 * np.abs(push * timed.speed).max())


def test_free_motion_under_the_driven_motions_force_returns_its_law():
    model = build(load_mechanism("tilting_two_springs"))
    dense = solve(model, np.linspace(model.start, model.end, 401))
    timed = driven_motion(dense)
    pair = ("ground.P", "plate.C")

    def push(t, motion):
        # the force between the points of the table would be interpolated: compute it at t
        u = t / 2.0
        stroke = dense.length(pair)[0][-1] - dense.length(pair)[0][0]
        speed = stroke * (30 * u**2 - 60 * u**3 + 30 * u**4) / 2.0
        acceleration = stroke * (60 * u - 180 * u**2 + 120 * u**3) / 4.0
        wanted = dense.length(pair)[0][0] + stroke * (10 * u**3 - 15 * u**4 + 6 * u**5)
        s = driver_at(dense, lambda m: m.length(pair)[:2], [wanted])
        at = solve(model, s)
        _, w, w1 = at.length(pair)
        s1 = speed / w
        s2 = (acceleration - w1 * s1**2) / w
        force = actuator_force(at, "piston", Rates(s1, s2, 1))
        return force * motion.length(pair)[1]

    found = free_motion(model, model.start, model.end + 1.0, 1.0, force=push)
    u = found.time / 2.0
    lengths = dense.length(pair)[0]
    wanted = lengths[0] + (lengths[-1] - lengths[0]) * (10 * u**3 - 15 * u**4 + 6 * u**5)
    law = driver_at(dense, lambda m: m.length(pair)[:2], wanted)
    assert found.time[-1] == pytest.approx(1.0)
    assert found.s == pytest.approx(law, abs=1e-6 * (model.end - model.start))
    assert found.s[-1] == pytest.approx(np.interp(1.0, timed.time, timed.motion.s), abs=1e-6)


@pytest.mark.parametrize("name", ["atr95_lift_5", "tilting_two_springs"])
def test_velocities_and_accelerations_of_points_are_differences_of_their_positions(models, name):
    """By the driver: r', r'' by central differences of second order over steps of 1e-4 of it."""
    model = models[name]
    h = 1e-4 * (model.end - model.start)
    middle = np.linspace(model.start, model.end, 7)[1:-1]
    before, here, after = (solve(model, middle + k * h) for k in (-1, 0, 1))
    points = [name for name in model.points if not name.startswith("ground.")]
    assert len(points) > 3
    for point in points:
        r, r1, r2 = here.point(point)
        low, high = before.point(point)[0], after.point(point)[0]
        size = np.abs(r1).max() + np.abs(r2).max()
        np.testing.assert_allclose(r1, (high - low) / (2.0 * h), atol=1e-5 * size)
        np.testing.assert_allclose(r2, (high - 2.0 * r + low) / h**2, atol=1e-4 * size)


def test_driver_at_the_ends_of_a_motion_is_an_end():
    model = build(load_mechanism("tilting_two_springs"))
    dense = solve(model, np.linspace(model.start, model.end, 401))
    lengths = dense.length(("ground.P", "plate.C"))[0]
    found = driver_at(dense, lambda m: m.length(("ground.P", "plate.C"))[:2], lengths[[0, -1]])
    assert found == pytest.approx([model.start, model.end], abs=1e-12)

    def there_and_back(motion):  # 0 at both ends: the first counts
        phase = 2.0 * np.pi * (motion.s - model.start) / (model.end - model.start)
        return np.sin(phase), np.cos(phase) * 2.0 * np.pi / (model.end - model.start)

    assert driver_at(dense, there_and_back, [0.0])[0] == model.start


def test_margin_of_the_stroke_is_what_is_left_of_it_in_metres():
    """The scale turns a margin back into metres, as it is told to the user."""
    judge = Judge(load_mechanism("atr95_lift_4", ["optimise.max_stroke=0.2"]))
    judged = judge(np.array([float(judge.values[name]) for name in judge.names]), {})
    ((scale, margin),) = [
        (scale, margin)
        for (name, scale), margin in zip(judge.labels, judged.margins, strict=True)
        if name == "max_stroke"
    ]
    mechanism = load_mechanism("atr95_lift_4")
    model = build(mechanism)
    both = solve(model, np.array([model.start, model.end]))
    stroke = np.ptp(both.length(ends(mechanism.actuators["lift"]))[0])
    assert scale * margin == pytest.approx(0.2 - stroke, abs=1e-9)


def test_energy_is_kept_without_damping():
    free = ["parameters.front_damping=0", "parameters.rear_damping=0"]
    model = build(load_mechanism("tilting_two_springs", free))
    found = free_motion(model, 0.0, model.start, 5.0)
    motion = solve(model, found.s)
    kinetic = 0.5 * inertia(motion)[0] * found.speed**2
    work = np.zeros(len(found.s))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for i, s in enumerate(found.s):
        positions = 0.5 * s * (nodes + 1.0)
        order = np.argsort(-positions)
        forces = generalised_force(solve(model, positions[order]))
        work[i] = 0.5 * s * float(np.sum(weights[order] * forces))
    assert kinetic == pytest.approx(work, abs=1e-8 * kinetic.max())


STOP = """
format = "railsim-mechanism/1"
[parameters]
m = 2.0
k = 4.0e5
[ground]
points = {{ wall = [1.0, 0.0], origin = [0.0, 0.0] }}
gravity = 0.0
[bodies.slide]
points = {{ pin = [0.0, 0.0] }}
mass = "m"
[start]
slide = {{ x = 0.0, y = 0.0 }}
[joints.slide]
prismatic = ["slide.pin", "ground.origin"]
[driver]
coordinate = "slide.pin"
axis = "x"
start = 0.0
end = 0.9
[elements.stop]
stop = ["slide.pin", "ground.wall"]
length = 0.5
stiffness = "k"
damping = {damping}
"""


def test_b12_mass_onto_a_stop(tmp_path):
    path = tmp_path / "stop.toml"
    path.write_text(STOP.format(damping=0.0))
    model = build(load_mechanism(path))
    v, m, k = 3.0, 2.0, 4.0e5
    half = 0.5 * np.pi * np.sqrt(m / k)
    deepest = free_motion(model, 0.5, 0.9, half, speed=v)
    assert deepest.s[-1] - 0.5 == pytest.approx(v * np.sqrt(m / k), rel=1e-4)
    force = generalised_force(solve(model, deepest.s[-1:]))[0]
    assert abs(force) == pytest.approx(v * np.sqrt(k * m), rel=1e-4)
    back = free_motion(model, 0.5 + 1e-12, 0.5, 1.0, speed=v)
    assert back.time[-1] == pytest.approx(np.pi * np.sqrt(m / k), rel=1e-4)
    assert back.speed[-1] == pytest.approx(-v, rel=1e-4)


def test_w1_watts_linkage_drifts_with_the_fifth_power_new(models):
    motion = solve(models["watt_axlebox_guide"], [0.02, 0.04, 0.06])
    drift = motion.point("coupler.axle")[0][:, 0] * 1e3
    assert drift == pytest.approx([6.266e-5, 2.0204e-3, 1.5545e-2], rel=5e-3)
    assert np.log2(drift[1] / drift[0]) == pytest.approx(5.0, abs=0.02)


def test_equilibrium_of_a_hanging_arm_is_stable_and_of_a_standing_one_not(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(
        'format = "railsim-mechanism/1"\n'
        "[ground]\npoints = { pin = [0, 0] }\n"
        "[bodies.arm]\npoints = { pin = [0, 0], end = [1, 0] }\nmass = 3.0\ncentre = [0.5, 0.0]\n"
        '[joints.pin]\nrevolute = ["ground.pin", "arm.pin"]\n'
        '[driver]\nangle = "arm"\nstart = -2.5\nend = 2.5\n'
    )
    rests = analyse(load_mechanism(path)).equilibria
    assert [stable for _, stable in rests] == [True, False]
    assert [s for s, _ in rests] == pytest.approx([-np.pi / 2, np.pi / 2], abs=1e-9)


def test_a_cubic_through_the_four_rows_of_a_table_is_its_law():
    """The spline through four rows is the one cubic through them; three are refused."""
    pair, stroke = ("ground.P", "plate.C"), 0.4
    rows = [[t, stroke * (3 * (t / 2.0) ** 2 - 2 * (t / 2.0) ** 3)] for t in (0.0, 0.5, 1.4, 2.0)]
    assignments = ["motion.law=table", f"motion.table={rows}", "motion.points=21"]
    model = build(load_mechanism("tilting_two_springs", assignments))
    timed = driven_motion(solve(model, np.linspace(model.start, model.end, 101)))
    length, rate, _ = timed.motion.length(pair)
    u = timed.time / 2.0
    assert length - length[0] == pytest.approx(stroke * (3 * u**2 - 2 * u**3), abs=1e-8)
    assert rate * timed.speed == pytest.approx(stroke * 3 * (u - u**2), abs=1e-6)
    with pytest.raises(InputError, match="four rows at least"):
        load_mechanism("tilting_two_springs", ["motion.law=table", f"motion.table={rows[1:]}"])


def test_a_spring_is_drawn_from_pin_to_pin_as_wide_as_a_part_of_its_first_length(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(
        'format = "railsim-mechanism/1"\n'
        "[ground]\npoints = { pin = [0, 0], foot = [-0.3, -0.5] }\n"
        "[bodies.arm]\npoints = { pin = [0, 0], end = [1, 0] }\nmass = 3.0\n"
        '[joints.pin]\nrevolute = ["ground.pin", "arm.pin"]\n'
        '[elements.coil]\nspring = ["ground.foot", "arm.end"]\n'
        "stiffness = 1e3\nfree_length = 1.0\n"
        '[elements.gas]\ngas_spring = ["ground.foot", "arm.end"]\n'
        "F1 = 100.0\nprogression = 1.2\nstroke = 1.2\nextended = 2.0\n"
        '[driver]\nangle = "arm"\nstart = 0.2\nend = 1.8\n'
    )
    model = build(load_mechanism(path))
    motion = solve(model, np.linspace(model.start, model.end, 11))
    coil, gas = (line.xy for line in lines(motion) if line.kind == "spring")
    ends = np.stack((np.cos(motion.s), np.sin(motion.s)), axis=-1)
    np.testing.assert_allclose(coil[:, 0], np.broadcast_to([-0.3, -0.5], ends.shape), atol=1e-12)
    np.testing.assert_allclose(coil[:, -1], ends, atol=1e-12)
    along = ends - coil[:, 0]
    length = np.hypot(*along.T)
    beside = np.abs(np.einsum("ik,ijk->ij", along[:, ::-1] * [-1, 1], coil - coil[:, :1]))
    width = np.max(beside, axis=1) / length
    assert width == pytest.approx(np.full(11, length[0] / 24.0), rel=1e-9)
    # the tube is nearly as long as the spring fully compressed, and keeps its length
    reach = np.einsum("ik,ijk->ij", along, gas - gas[:, :1]) / length[:, None]
    tube, rod = np.sort(np.unique(reach.round(9), axis=1))[:, 1:3].T
    assert tube == pytest.approx(np.full(11, 0.9 * (2.0 - 1.2)), abs=1e-6)
    assert rod == pytest.approx(length, abs=1e-6)


@pytest.mark.parametrize("lift", [1, 2, 3])
def test_the_line_of_a_slot_holds_its_pin_at_every_position(motions, lift):
    """The pin lies on the line, which keeps its length and is as much too long at both ends."""
    motion = motions[f"atr95_lift_{lift}"]
    guides = [line for line in lines(motion) if line.kind == "guide"]
    assert guides
    for guide in guides:
        first, last = np.moveaxis(guide.xy, 1, 0)
        joint = motion.model.definition.joints[guide.name]
        pin, _, _ = motion.point((joint.slot if isinstance(joint, Slot) else joint.prismatic)[0])
        length = np.linalg.norm(last - first, axis=1)
        parts = [np.linalg.norm(end - pin, axis=1) for end in (first, last)]
        assert sum(parts) == pytest.approx(length, abs=1e-9)
        assert np.ptp(length) < 1e-9
        assert 0.0 < np.min(parts[0]) == pytest.approx(np.min(parts[1]), abs=1e-9)


def test_an_angle_is_that_of_the_first_line_less_that_of_the_second():
    """With its sign: piston PC against plate BC, whose angle is the driver."""
    motion = analyse(load_mechanism("tilting_one_spring")).motion
    x, y = 0.290 * np.cos(motion.s) - 0.176426, 0.290 * np.sin(motion.s) + 0.356766
    wanted = np.arctan2(y, x) - motion.s
    assert np.min(wanted) > 0.0
    np.testing.assert_allclose(motion.angle("mu"), wanted, rtol=1e-12)


def test_ratios_whose_scatter_is_told_are_height_over_length():
    """Those of lift 5 at closed, work and end, from closed forms (with the upper links R1)."""
    found = sensitivities(load_mechanism("atr95_lift_5"), ["a1"])
    ratios = [found[f"ratio_{at}"][1] for at in ("start", "work", "end")]
    assert ratios == pytest.approx([32.984, 24.506, 18.474], abs=0.003)


def test_the_travel_is_shown_in_the_unit_of_the_driver():
    definition = load_mechanism("tilting_one_spring")
    by_length = definition.driver.model_copy(
        update={"angle": None, "length": ("ground.P", "plate.C")}
    )
    assert quantities.quantity("travel", definition).unit == "deg"
    moved = definition.model_copy(update={"driver": by_length})
    assert quantities.quantity("travel", moved).unit == "mm"
