"""Merci (2017), the bottle tilting machine and its gas springs.

Vectors and masses are *reconstructed* (the source's are lost): one geometry that meets the printed
results with the slips of the source's equations; the product computes the right mechanics.  Laws
and catalogues are *printed*.  Ids and tolerances as in the list of acceptance numbers.
"""

import numpy as np
import pytest

from railsim.definitions.loading import load_mechanism
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.components import gas_spring_force, lid_force
from railsim.mechanisms.dynamics import polynomial_345
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.selection import selection

FILES = {"one": "tilting_one_spring", "two": "tilting_two_springs"}
FEW = ["sampling.points=401"]


@pytest.fixture(scope="module")
def machines():
    return {
        (springs, case): analyse(load_mechanism(name, FEW), case)
        for springs, name in FILES.items()
        for case in (None, "bordolese_5000")
    }


def operator_at(result, degrees):
    at = [result.at("travel", np.radians(angle))["force"] for angle in degrees[1:-1]]
    return [result.output["force"][0], *at, result.output["force"][-1]]


@pytest.mark.parametrize(
    ("springs", "case", "forces"),
    [
        ("one", None, [128.43, 133.15, 91.50, 14.88]),  # B1
        ("one", "bordolese_5000", [136.99, 130.44, 78.51, -3.70]),
        ("two", None, [67.46, 83.77, 65.03, 14.88]),  # B2
        ("two", "bordolese_5000", [76.02, 81.06, 52.04, -3.70]),
    ],
)
def test_b1_b2_operators_force_reconstructed(machines, springs, case, forces):
    result = machines[springs, case]
    assert operator_at(result, [-35, 0.0, 35.0, 70]) == pytest.approx(forces, abs=0.05)


def test_b3_change_of_sign_reconstructed(machines):
    for springs, angle in (("one", 68.554), ("two", 67.930)):
        (zero,) = machines[springs, "bordolese_5000"].force_zeros
        assert np.degrees(zero) == pytest.approx(angle, abs=0.01)
        assert machines[springs, None].force_zeros == ()


def source_equation_19(case, *, slips):
    """Operator's force at the start, `M1/Z1`, after the source's equation 19.

    `M1 = Fp dyD/df1 - Fm dZ4/df1`, yD = Z1 sin f1 + Z2 sin(f1 + alpha) with Z2 from C to the centre
    of gravity.  With its slips: Z2 sin(f1 + alpha) in the derivative, +Fm, and the law over
    the index of the angle, which gives F1 at the start.
    """
    model = analyse(load_mechanism("tilting_one_spring", FEW), case).model
    values = model.values
    f1 = values["theta_start"]
    m = values["m_plate"] + values["m_bottle"]
    x, y = (
        (values["m_plate"] * values[f"{a}_plate"] + values["m_bottle"] * values[f"{a}_bottle"]) / m
        for a in "xy"
    )
    Z1 = values["Z1"]
    Z2, alpha = np.hypot(x - Z1, y), np.arctan2(y, x - Z1)
    motion = solve(model, [f1])
    spring = values["front_F1"] * motion.length(("ground.A", "plate.E"))[1][0]
    if slips:
        return (m * 9.81 * (Z1 * np.cos(f1) + Z2 * np.sin(f1 + alpha)) + spring) / Z1
    return (m * 9.81 * (Z1 * np.cos(f1) + Z2 * np.cos(f1 + alpha)) - spring) / Z1


@pytest.mark.parametrize(
    ("case", "with_slips", "right"), [(None, 205.96, 128.43), ("bordolese_5000", 256.38, 136.99)]
)
def test_b4_equation_19_with_its_slips_gives_the_printed_range(case, with_slips, right):
    assert source_equation_19(case, slips=True) == pytest.approx(with_slips, abs=0.05)
    assert source_equation_19(case, slips=False) == pytest.approx(right, abs=0.05)


@pytest.mark.parametrize(
    ("springs", "case", "forces"),
    [
        ("one", None, [134.44, 144.37, 14.49]),
        ("one", "bordolese_5000", [143.41, 149.62, -25.52]),
        ("two", None, [70.62, 93.88, 12.75]),
        ("two", "bordolese_5000", [79.58, 89.80, -26.99]),
    ],
)
def test_b5_pistons_force_reconstructed(machines, springs, case, forces):
    force = machines[springs, case].timed.force
    assert [force[0], force.max(), force.min()] == pytest.approx(forces, abs=0.05)


def test_b6_motion_law_printed_and_spring_strokes_reconstructed(machines):
    law = [0.5425, -0.406875, 0.081375]
    assert list(polynomial_345(2.0, 0.434)) == pytest.approx(law, abs=1e-6)
    result = machines["two", None]
    assert np.ptp(result.output["front_length"]) * 1e3 == pytest.approx(117.4, abs=0.05)
    assert np.ptp(result.output["rear_length"]) * 1e3 == pytest.approx(44.3, abs=0.05)


def test_b7_temperature_and_isothermal_law_printed():
    temperatures = np.array([-30.0, 0.0, 60.0, 80.0])
    found = gas_spring_force(0.0, 400.0, 1.3, 0.1, temperature=temperatures)
    assert found == pytest.approx([328.0, 371.2, 457.6, 486.4], abs=0.01)
    assert gas_spring_force(0.05, 1.0, 1.3, 0.1, "isothermal") == pytest.approx(1.1304, abs=1e-4)


def test_b8_lid_formula_printed():
    assert lid_force(20.0, 0.400, 0.150, 2.0, 1.1) == pytest.approx(287.467, abs=1e-3)


def test_b9_rows_of_the_catalogue_that_fit(machines):
    fitting = [c.name for c in selection(machines["two", None]) if c.fits]
    assert [n.removeprefix("front: ") for n in fitting if n.startswith("front")] == [
        "AG", "AK", "AM"
    ]  # fmt: skip
    rear = [c for c in selection(machines["two", None]) if c.name.startswith("rear")]
    assert [c.name.removeprefix("rear: ") for c in rear if not c.fits] == ["AG"]
    assert all(c.reasons for c in rear)


def test_b10_plate_let_go_at_0_reconstructed(machines):
    released = machines["one", None].release
    assert released.reached
    assert released.time[-1] == pytest.approx(0.17896, abs=1e-4)
    assert abs(released.speed[-1]) == pytest.approx(6.823, abs=1e-3)


def test_b11_friction_and_temperature_reconstructed(machines):
    plain = machines["one", None].output["force"][0]
    rubbed = analyse(load_mechanism("tilting_one_spring", [*FEW, "parameters.front_friction=50"]))
    assert rubbed.output["force"][0] - plain == pytest.approx(7.878, abs=0.01)
    assert rubbed.output["force_back"][0] - plain == pytest.approx(-7.878, abs=0.01)
    # come to rest, friction still acts against the way: the piston takes the operator's torque
    held = rubbed.output["force"][-1] * 0.290 / rubbed.output["rate"][-1]
    assert rubbed.timed.force[-1] == pytest.approx(held, rel=1e-9)
    for name, force in (("tilting_one_spring", 130.13), ("tilting_two_springs", 55.99)):
        warm = analyse(load_mechanism(name, [*FEW, "parameters.temperature=80"]))
        assert warm.output["force"][0] == pytest.approx(force, abs=0.01)
