"""Derivatives of runs: closed forms on a rig of one mode, decay rates of the linear analysis."""

from types import SimpleNamespace

import numpy as np
import pytest
from dynamics import load_track
from test_fixed_bodies import hanging, rig

import railsim
from railsim.definitions.settings import Settings
from railsim.identification.derivatives import _central, _central_derivative

pytestmark = pytest.mark.usefixtures("small_contact_tables_in_module")  # the anchor is fixed
STRAIGHT = load_track("straight")
MASS, STIFFNESS, DAMPING, AMPLITUDE = 1e3, 4e5, 2e3, 0.01
STIFF, DAMP = "spring.stiffness.z", "spring.damping.z"
HEIGHT = "sensor_displacement:probe:z"
SETTINGS = {"initial": {"probe": {"z": AMPLITUDE}}, "scheme": "rk4", "step": 5e-4}
RUN = {"speed": 5.0, "duration": 1.0}


def mass_on_spring():
    spring = {**hanging([2e5, 3e5, STIFFNESS]), "damping": [1e3, 1e3, DAMPING]}
    vehicle = rig("probe", spring=spring)
    point = {"body": "probe", "position": [0.0, 0.0, -1.0]}
    return vehicle.replace(sensors={"probe": point})


def closed(time, stiffness, damping):
    """Free decay z(t) from z0 at rest."""
    delta = damping / (2.0 * MASS)
    omega = np.sqrt(stiffness / MASS - delta**2)
    swing = np.cos(omega * time) + delta / omega * np.sin(omega * time)
    return AMPLITUDE * np.exp(-delta * time) * swing


def decay_rate(result):
    """Decay rate from the peaks of the free oscillation [1/s]."""
    t, z = result.time, result["sensor_displacement"][:, -1, 2]
    k = np.flatnonzero((np.abs(z[1:-1]) > np.abs(z[:-2])) & (np.abs(z[1:-1]) >= np.abs(z[2:]))) + 1
    # parabola through each peak
    left, middle, right = np.abs(z[k - 1]), np.abs(z[k]), np.abs(z[k + 1])
    bend = left - 2.0 * middle + right
    peak = middle - (left - right) ** 2 / (8.0 * bend)
    at = t[k] + 0.5 * (left - right) / bend * (t[1] - t[0])
    return -np.polyfit(at, np.log(peak), 1)[0]


@pytest.mark.parametrize("scheme", ["central", "forward"])
def test_derivatives_of_a_free_oscillation_are_the_closed_ones(scheme):
    """Central to 1e-4 of the largest one, forward to what it reports."""
    settings = Settings.model_validate(SETTINGS)
    found = railsim.sensitivity(
        mass_on_spring(), STRAIGHT, [STIFF, DAMP], [HEIGHT],
        scheme=scheme, settings=settings, **RUN,
    )  # fmt: skip
    time = found.result.time
    step = 1e-30
    exact = {
        STIFF: closed(time, STIFFNESS * (1.0 + 1j * step), DAMPING).imag / step,
        DAMP: closed(time, STIFFNESS, DAMPING * (1.0 + 1j * step)).imag / step,
    }
    for name, derivative in exact.items():
        error = np.abs(found[HEIGHT, name] - derivative).max() / np.abs(derivative).max()
        reported = found.derivatives[HEIGHT, name].error
        assert error < (1e-4 if scheme == "central" else 3.0 * reported + 1e-4)
        assert reported < (1e-3 if scheme == "central" else 0.05)
        assert found.derivatives[HEIGHT, name].is_smooth
    assert not found.remarks
    assert found.runs >= 5 if scheme == "central" else found.runs == 4


def test_derivative_of_a_decay_rate_is_that_of_the_linear_analysis():
    vehicle = mass_on_spring()
    settings = Settings.model_validate({**SETTINGS, "output_rate": 500.0})
    settings = settings.replace(outputs={"sensors": True})
    found = railsim.sensitivity(
        vehicle, STRAIGHT, [DAMP], {"decay": decay_rate}, settings=settings, **RUN
    )

    def linear(factor):
        changed = vehicle.with_values({DAMP: factor * DAMPING})
        modes = railsim.modes(changed, STRAIGHT, speed=5.0, held=True).oscillations
        mode = min(modes, key=lambda one: abs(one.natural_frequency - 20.0 / (2.0 * np.pi)))
        return -mode.eigenvalue.real

    expected = (linear(1.01) - linear(0.99)) / 0.02
    assert expected == pytest.approx(DAMPING / (2.0 * MASS), rel=1e-3)
    assert found["decay", DAMP][0] == pytest.approx(expected, rel=0.01)


def test_a_stop_is_said_to_have_no_derivative():
    """The mass strikes a stiff stop: the two sides of the derivative differ."""
    free = mass_on_spring()
    touched = float(np.abs(closed(0.1571, STIFFNESS, DAMPING)))
    stop = {
        "kind": "bump_stop", "bodies": ["anchor", "probe"], "point": [0.0, 0.0, -1.0], "axis": "z",
        "table": [[0.0, 0.0], [touched, 0.0], [touched + 0.02, 4e6]],
    }  # fmt: skip
    elements = {**free.model_dump(exclude_none=True)["elements"], "stop": stop}
    vehicle = free.replace(elements=elements)
    force = "element_force:stop:z"
    found = railsim.sensitivity(
        vehicle, STRAIGHT, [STIFF], [force],
        settings=Settings.model_validate(SETTINGS), speed=5.0, duration=0.25,
    )  # fmt: skip
    assert not found.derivatives[force, STIFF].is_smooth
    assert "no derivative" in found.remarks[0]


def test_the_error_is_what_two_steps_differ_by():
    """x + 3 x^2 + 1e-4 sin(2 pi x / 0.01): the first step, 0.01, does not see the ripple."""

    def variants(points, _):
        return [[x + 3.0 * x**2 + 1e-4 * np.sin(2.0 * np.pi * x / 0.01)] for x in points]

    job = SimpleNamespace(parameters=["x"], variants=variants)
    (((found,),), runs) = _central(job, [np.zeros(1)], None)
    assert runs == 5
    exact = 1.0 + 2e-4 * np.pi / 0.01
    assert found.error == pytest.approx(abs(exact - found.value[0]) / exact, rel=0.2)


@pytest.mark.parametrize(
    ("slope", "curvature", "share"),
    [
        (2.0, 3.0, 0.015),
        (-2.0, 3.0, 0.015),
        (0.5, -3.0, 0.06),
        (1.0, 20.0, 0.2),
        (0.0, 3.0, 1000.0),
    ],
)
def test_sides_of_a_parabola_differ_by_its_curvature(slope, curvature, share):
    """a x + b x^2, step h: a +- b h, so that b h/a is left; of an extremum 1/1000 of a side counts.

    The next term of the series is the square of this share; beyond a tenth it is told itself.
    """
    h = 0.01
    above, below = (np.full(3, slope * x + curvature * x**2) for x in (h, -h))
    found, ratio = _central_derivative(np.zeros(3), above, below, h, None)
    assert found.value == pytest.approx(slope)
    assert ratio == pytest.approx(share)
    assert found.error == pytest.approx(share**2 if share < 0.1 else max(share, share**2))
    other, _ = _central_derivative(np.zeros(3), 1.05 * above, 1.05 * below, h, found)
    if share < 0.1:  # a second step says what it differs by: 0.05 of 1.05
        assert other.error == pytest.approx(0.05 / 1.05)


@pytest.mark.parametrize(("kink", "kinked"), [(0.09, 0.0), (0.11, 0.5), (-0.11, 0.5)])
def test_sides_that_differ_by_a_fifth_of_the_largest_derivative_are_a_kink(kink, kinked):
    """x + k |x| beside x."""
    above, below = (np.array([x, x + kink * abs(x)]) for x in (0.01, -0.01))
    found, _ = _central_derivative(np.zeros(2), above, below, 0.01, None)
    assert found.value == pytest.approx(1.0)
    assert found.kinked == kinked


@pytest.mark.parametrize(
    ("parameters", "outputs", "words"),
    [
        (["spring.stifness.z"], [HEIGHT], "spring.stifness.z"),
        (["spring.kind"], [HEIGHT], "a number that is not 0"),
        ([STIFF, STIFF], [HEIGHT], "given twice"),
        ([], [HEIGHT], "one key at least"),
        ([STIFF + ":1.5:2"], [HEIGHT], "factors below and above 1"),
        ([STIFF + ":1.1:2"], [HEIGHT], "factors below and above 1"),
        ([STIFF + ":a:b"], [HEIGHT], "numbers LOW:HIGH"),
        ([STIFF], ["sensor_displacement:prob:z"], "no sensor 'prob'"),
        ([STIFF], ["speeed:1"], "speeed"),
    ],
)
def test_wrong_parameters_and_outputs_are_one_line(parameters, outputs, words):
    with pytest.raises(railsim.InputError) as caught:
        railsim.sensitivity(
            mass_on_spring(), STRAIGHT, parameters, outputs, speed=5.0, duration=0.1
        )
    assert len(caught.value.faults) == 1
    assert words in str(caught.value)


@pytest.mark.parametrize("scheme", ["central", "forward"])
def test_a_change_within_rounding_is_no_kink_and_variants_repeat_no_remarks(scheme, caplog):
    """1e10 m + z has steps of 2e-6 m: 1e-13 of it is ten times the change of z by the stiffness."""
    found = railsim.sensitivity(
        mass_on_spring(), STRAIGHT, [STIFF],
        {"far": lambda result: 1e10 + result["sensor_displacement"][-1, -1, 2]},
        scheme=scheme, settings=Settings.model_validate({**SETTINGS, "outputs": {"sensors": True}}),
        speed=5.0, duration=0.1,
    )  # fmt: skip
    assert found.remarks == (
        f"far does not depend on {STIFF}: what it changes by is within rounding.",
    )
    assert caplog.messages
    assert len(set(caplog.messages)) == len(caplog.messages)
