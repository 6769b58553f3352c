"""Planar linkages of any dimensions: laws that hold whatever the numbers are."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from selection import points

from railsim.definitions.loading import load_mechanism
from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.expressions import Expression, evaluate
from railsim.definitions.mechanism.values import number
from railsim.errors import InputError
from railsim.mechanisms.components import AirSpringTable, gas_spring_force, lid_force
from railsim.mechanisms.forces import Rates, actuator_force, generalised_force, reactions
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.model import STEP, build

FEW = settings(max_examples=40, deadline=None)
LENGTH = st.floats(0.2, 1.0)
ANGLE = st.floats(-3.0, 3.0)


def turned(point, angle):
    x, y = point
    c, s = math.cos(angle), math.sin(angle)
    return [c * x - s * y, s * x + c * y]


def four_bar(ground, crank, coupler, rocker, angle=0.0, k=1.0):
    """A four-bar with a hand's torque on the crank; all of it turned and all lengths times k."""
    start = 1.0
    x, y = ground - crank * math.cos(start), -crank * math.sin(start)
    distance = math.hypot(x, y)
    cosine = (coupler**2 + distance**2 - rocker**2) / (2 * coupler * distance)
    assume(abs(cosine) < 0.95)  # assembled at the start, and not close to a limit position
    along = math.atan2(y, x) + math.acos(cosine)
    return Mechanism.model_validate(
        {
            "format": "railsim-mechanism/1",
            "ground": {
                "points": {"left": [0.0, 0.0], "right": turned([k * ground, 0.0], angle)},
                "gravity": 9.81,
            },
            "bodies": {
                "crank": {"points": {"pin": [0, 0], "end": [k * crank, 0]}, "mass": 2.0,
                          "centre": [0.5 * k * crank, 0.01 * k], "inertia": 0.3 * k * k},
                "coupler": {"points": {"pin": [0, 0], "end": [k * coupler, 0]}, "mass": 3.0,
                            "centre": [0.4 * k * coupler, 0.05 * k], "inertia": 0.2 * k * k},
            },
            "start": {"crank": {"angle": start + angle}, "coupler": {"angle": along + angle}},
            "joints": {
                "left": {"revolute": ["ground.left", "crank.pin"]},
                "pin": {"revolute": ["crank.end", "coupler.pin"]},
                "rocker": {"link": ["coupler.end", "ground.right"], "length": k * rocker},
            },
            "driver": {"angle": "crank", "zero": angle, "start": start, "end": start + 0.15},
            "actuators": {"hand": {"turn": "crank"}},
            "elements": {"rub": {"joint_friction": "crank", "moment": 1.5}},
            "solve": {"unknown": "hand"},
        }
    )  # fmt: skip


def moved(mechanism, count=9):
    model = build(mechanism)
    try:
        return solve(model, np.linspace(model.start, model.end, count))
    except InputError:
        assume(False)  # the crank cannot go so far
        raise


@FEW
@given(LENGTH, LENGTH, LENGTH, LENGTH)
def test_a_four_bar_keeps_its_closed_form(ground, crank, coupler, rocker):
    motion = moved(four_bar(ground, crank, coupler, rocker))
    x, y = ground - crank * np.cos(motion.s), -crank * np.sin(motion.s)
    distance = np.hypot(x, y)
    cosine = (coupler**2 + distance**2 - rocker**2) / (2 * coupler * distance)
    assume(np.all(np.abs(cosine) < 0.98))  # an angle near 0 or pi amplifies round-off
    expected = np.arctan2(y, x) + np.arccos(cosine)
    assert motion.q[:, 2, 2] == pytest.approx(expected, abs=1e-10)


@FEW
@given(LENGTH, LENGTH, LENGTH, LENGTH, ANGLE)
def test_virtual_work_agrees_with_the_multipliers(ground, crank, coupler, rocker, turn):
    motion = moved(four_bar(ground, crank, coupler, rocker, turn))
    for rates in (Rates(), Rates(friction=1), Rates(np.full(9, 0.7), np.full(9, -2.0), -1)):
        force = actuator_force(motion, "hand", rates)
        joints, driver = reactions(motion, {"hand": force}, rates)
        scale = max(np.abs(rows).max() for rows in joints.values())
        assert np.abs(driver).max() < 1e-9 * scale


@FEW
@given(LENGTH, LENGTH, LENGTH, LENGTH, ANGLE, st.floats(0.1, 10.0))
def test_turned_and_scaled_linkages_move_alike(ground, crank, coupler, rocker, turn, k):
    plain = moved(four_bar(ground, crank, coupler, rocker))
    other = moved(four_bar(ground, crank, coupler, rocker, turn, k))
    assert other.q[:, 1:, 2] - turn == pytest.approx(plain.q[:, 1:, 2], abs=1e-9)
    assert other.q1[:, 1:, 2] == pytest.approx(plain.q1[:, 1:, 2], abs=1e-8)
    points = [m.point("coupler.end")[0] for m in (plain, other)]
    sizes = [np.hypot(*xy.T) for xy in points]
    assert sizes[1] == pytest.approx(k * sizes[0], rel=1e-9)


def mirrored(mechanism):
    """The same linkage seen in a mirror on the y axis: x and angles change, gravity does not."""
    data = mechanism.model_dump()
    data["ground"]["points"] = {n: [-x, y] for n, (x, y) in data["ground"]["points"].items()}
    for body in data["bodies"].values():
        body["points"] = {name: [u, -v] for name, (u, v) in body["points"].items()}
        body["centre"] = [body["centre"][0], -body["centre"][1]]
    for pose in data["start"].values():
        pose["angle"] = math.pi - pose["angle"]
    data["driver"] |= {key: -data["driver"][key] for key in ("start", "end")}
    data["driver"]["zero"] = math.pi - data["driver"]["zero"]
    return Mechanism.model_validate(data)


@FEW
@given(LENGTH, LENGTH, LENGTH, LENGTH, ANGLE)
def test_a_linkage_in_a_mirror_needs_the_opposite_torque(ground, crank, coupler, rocker, turn):
    plain = moved(mechanism := four_bar(ground, crank, coupler, rocker, turn))
    mirror = moved(mirrored(mechanism))
    # the driver of the mirror runs backwards: rates and friction change their sign with it
    cases = [(Rates(0.7, -2.0, 1), Rates(-0.7, 2.0, -1)), (Rates(), Rates())]
    for ours, theirs in cases:
        force, other = (actuator_force(m, "hand", r) for m, r in ((plain, ours), (mirror, theirs)))
        assert other == pytest.approx(-force, rel=1e-7, abs=1e-7)
        joints, _ = reactions(plain, {"hand": force}, ours)
        seen, _ = reactions(mirror, {"hand": other}, theirs)
        for name in ("left", "pin"):
            assert seen[name] == pytest.approx(joints[name] * [-1.0, 1.0], rel=1e-6, abs=1e-6)


@FEW
@given(LENGTH, LENGTH, LENGTH, LENGTH)
def test_friction_takes_as_much_on_either_way(ground, crank, coupler, rocker):
    motion = moved(four_bar(ground, crank, coupler, rocker))
    there, back, plain = (generalised_force(motion, Rates(friction=sense)) for sense in (1, -1, 0))
    assert plain - there == pytest.approx(1.5, rel=1e-9)
    assert back - plain == pytest.approx(1.5, rel=1e-9)


@points("lift", [1, 2, 3, 4, 5], always=(1, 4))
@settings(max_examples=5, deadline=None)
@given(turn=ANGLE)
def test_a33_lift_frame_turned_by_any_angle_changes_nothing_but_ground_reactions(lift, turn):
    # the parts of the lift on the ground and on the boom go round the boom's hinge, all by as much
    plain = load_mechanism(f"atr95_lift_{lift}")
    hinge = "upper_h"
    c, s = math.cos(turn), math.sin(turn)

    def round_hinge(where):
        x, y = (f"({quantity})" for quantity in where)
        y = f"({y} - {hinge})"
        return (f"{c} * {x} - {s} * {y}", f"{hinge} + {s} * {x} + {c} * {y}")

    def on_boom(where):
        if isinstance(where, dict):
            return {**where, "angle": f"({where['angle']}) + {turn}"}
        x, y = (f"({quantity})" for quantity in where)
        return (f"{c} * {x} - {s} * {y}", f"{s} * {x} + {c} * {y}")

    data = plain.model_dump(exclude_none=True)
    upper = ("boom_hinge", "rod_pivot")
    ground = data["ground"]["points"]
    data["ground"]["points"] = {
        name: where if name in upper else round_hinge(where) for name, where in ground.items()
    }
    boom = data["bodies"]["boom"]["points"]
    data["bodies"]["boom"]["points"] = {
        name: where if name in ("hinge", "tip") else on_boom(where) for name, where in boom.items()
    }
    for name, pose in data["start"].items():
        if name in ("boom", "trapezoid"):
            continue
        pose["angle"] = f"({pose['angle']}) + {turn}"
        if "auto" not in (pose["x"], pose["y"]):
            pose["x"], pose["y"] = round_hinge((pose["x"], pose["y"]))
    for joint in data["joints"].values():
        if "prismatic" in joint or ("slot" in joint and joint["slot"][1].startswith("boom.")):
            joint["angle"] = f"({joint['angle']}) + {turn}"
    model, other = build(plain), build(Mechanism.model_validate(data))
    pair = plain.actuators["lift"].cylinder
    s0 = np.linspace(model.start, model.end, 12)
    motions = [solve(m, s0) for m in (model, other)]
    lengths = [m.length(pair)[0] for m in motions]
    forces = [actuator_force(m, "lift") for m in motions]
    assert lengths[1] == pytest.approx(lengths[0], rel=1e-9)
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)
    angles = [np.abs(np.sin(m.angle("mu"))) for m in motions]
    assert angles[1] == pytest.approx(angles[0], abs=1e-9)


TERMS = st.recursive(
    st.one_of(st.sampled_from(["a", "b", "pi"]), st.floats(0.1, 9.0).map(lambda x: f"{x!r}")),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        inner.map(lambda t: f"sin({t})"),
        inner.map(lambda t: f"cos({t})"),
        inner.map(lambda t: f"sqrt(({t})**2 + 1)"),
        st.tuples(inner, inner).map(lambda t: f"hypot({t[0]}, 1 + {t[1]}**2)"),
        inner.map(lambda t: f"atan2({t}, 2)"),
    ),
    max_leaves=6,
)


@settings(max_examples=75, deadline=None)
@given(TERMS, st.floats(0.2, 3.0), st.floats(0.2, 3.0))
def test_expressions_are_the_arithmetic_that_they_say(text, a, b):
    assume(len(text) < 400)
    names = {n: getattr(math, n) for n in ("sin", "cos", "sqrt", "hypot", "atan2", "pi")}
    try:
        expected = eval(text, {"__builtins__": {}}, {**names, "a": a, "b": b})
        found = evaluate(Expression(text), {"a": a, "b": b})
    except (ZeroDivisionError, OverflowError, ValueError):
        assume(False)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
    # the derivative that is carried along is that of differences
    h = 1e-6
    sides = [evaluate(Expression(text), {"a": a + d, "b": b}) for d in (-h, h)]
    slope = (sides[1] - sides[0]) / (2 * h)
    carried = evaluate(Expression(text), {"a": np.array([[a + 1j * STEP]]), "b": b})
    exact = float(np.imag(np.ravel(carried))[0]) / STEP
    scale = max(1.0, abs(exact), abs(expected))
    assume(scale < 1e3)  # steep slopes need a finer difference
    assert exact == pytest.approx(slope, abs=1e-4 * scale)


@settings(max_examples=100, deadline=None)
@given(st.text(alphabet="abxpi_.,'\"()[]{}+-*/%@:=!<> \n0123456789jelamd", max_size=40))
def test_no_text_is_more_than_arithmetic(text):
    try:
        parsed = Expression(text)
    except ValueError:
        return
    allowed = {"a", "b"} | parsed.names
    try:
        evaluate(parsed, dict.fromkeys(allowed, 1.5))
    except ValueError:
        return


@pytest.mark.parametrize(
    ("text", "opens"),
    [("acos(a)", True), ("sqrt(1 - a)", True), ("(1 - a)**0.5", True), ("1 / acos(a - 1)", False)],
)
def test_only_what_leaves_its_domain_is_told_as_links_that_cannot_be_assembled(text, opens):
    """A division by zero is another fault, whatever functions stand beside it."""
    with pytest.raises(InputError) as caught:
        number(Expression(text), {"a": 2.0})
    assert ("cannot be assembled" in caught.value.faults[0].allowed) is opens


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("9" * 499, "not allowed"),
        ("1e999", "not allowed"),
        ("a" * 501, "at most 500"),
        ("9 ** 9 ** 9", "not finite"),
        ("1 / (a - a)", "divides by zero"),
    ],
)
def test_numbers_out_of_all_proportion_are_refused_with_a_sentence(text, words):
    with pytest.raises(ValueError, match=words):
        evaluate(Expression(text), {"a": 1.0})


@FEW
@given(st.floats(20.0, 2000.0), st.floats(1.0, 2.0), st.floats(0.0, 1.0), st.floats(-30.0, 80.0))
def test_gas_springs_rise_from_f1_to_their_progression(F1, p, share, temperature):
    for law in ("linear", "isothermal"):
        ends = [gas_spring_force(x, F1, p, 0.1, law) for x in (0.0, 0.1)]
        assert ends == pytest.approx([F1, p * F1])
        here = gas_spring_force(share * 0.1, F1, p, 0.1, law)
        assert F1 * (1 - 1e-12) <= here <= p * F1 * (1 + 1e-12)
        warm = gas_spring_force(share * 0.1, F1, p, 0.1, law, temperature)
        assert warm / here == pytest.approx(1.0 + 0.0036 * (temperature - 20.0))


@pytest.fixture(scope="module")
def table():
    spring = load_mechanism("atr95").actuators["lift"]
    return AirSpringTable(
        np.array(spring.heights), np.array(spring.pressures), np.array(spring.forces)
    )


@FEW
@given(x=st.floats(0.0, 1.0), y=st.floats(0.0, 1.0))
def test_air_spring_gives_the_pressure_back_that_it_was_given(table, x, y):
    height = 0.070 + x * 0.195
    pressure = 0.2e6 + y * 0.5e6
    force = table.force(height, pressure)
    assert table.pressure(height, force) == pytest.approx(pressure, rel=1e-9)
    assert np.isnan(table.force(height, 0.75e6))
    assert np.isnan(table.force(0.28, pressure))


def test_lid_formula_is_the_balance_of_moments_with_its_factor():
    # the makers' 9.8 m/s2; two springs at 150 mm hold 20 kg at 400 mm exactly with the factor 1
    assert 2 * 0.150 * lid_force(20.0, 0.400, 0.150, 2.0, 1.0) == pytest.approx(20 * 9.8 * 0.4)
