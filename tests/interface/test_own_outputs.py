"""Laws of one's own for output quantities and for irregularities."""

import numpy as np
import pytest

import railsim
from railsim import laws
from railsim.definitions.mirror import mirrored_track
from railsim.errors import InputError
from railsim.notation import QUANTITIES
from railsim.simulation.own_outputs import OwnOutputs
from railsim.track.irregularity import displacement

WAY = {"speed": 20.0, "until": 4.0}


@laws.output_quantity
def share(left, right):
    return (left - right) / (left + right)


@laws.output_quantity
def late(time):
    return time if time < 0.102 else nan  # noqa: F821 - of math


@laws.excitation
def wave(s, amplitude, length):
    return amplitude * sin(2.0 * pi * s / length)  # noqa: F821 - of math


@laws.excitation
def pole(s):
    return 1.0 / (s - s)


@pytest.fixture(autouse=True)
def nothing_permitted(monkeypatch):
    monkeypatch.delenv(laws.PERMITTED, raising=False)


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle("coach_manchester")


@pytest.fixture(scope="module")
def curve():
    return railsim.load_track("curve_r250")


def settings(function, inputs, **more):
    name = function.__name__
    own = {"load_share": {"law": name, "inputs": inputs, **more}}
    return railsim.Settings(laws={name: laws.law(function)}, outputs={"own": own})


def test_an_output_is_its_formula_and_is_stored(coach, curve, tmp_path):
    """Over all instants, when read in a run, and in the file."""
    asked = settings(share, {"left": "Q:2:left", "right": "Q:front.inner.wheelset:right"})
    result = railsim.simulate(coach, curve, speed=20.0, start=340.0, until=345.0, settings=asked)
    left, right = result["Q"][:, 1].T
    assert np.array_equal(result["load_share"], (left - right) / (left + right))
    assert np.ptp(left - right) > 1e3
    file = result.save(tmp_path / "run.h5")
    assert np.array_equal(railsim.open_result(file)["load_share"], result["load_share"])
    with railsim.Simulation(coach, curve, **WAY, settings=asked) as sim:
        sim.step(0.05)
        assert "load_share" in sim.readable
        assert sim.read("load_share") == share(*sim.read("Q")[1])


def test_an_output_that_is_not_finite_ends_the_run(coach, curve):
    result = railsim.simulate(coach, curve, **WAY, settings=settings(late, {"time": "time"}))
    assert result.status == "stopped"
    expected = "the law of output load_share gave a value that is not finite at 0.105 s"
    assert result.attributes["status_reason"] == expected
    assert len(result["time"]) > 20


FAULTS = {
    "inputs.left: no quantity 'R'": {"left": "R:1"},
    "inputs.left: found 'Q:1'; one label of each: wheelset, side": {"left": "Q:1"},
    "inputs.left: no label '9'": {"left": "Q:9:left"},
    "'sensor_roll_rate' is not output; ask for it by": {"left": "sensor_roll_rate:x"},
    "load_share.parameters: no value for 'right'": {"left": "Q:1:left"},
    "the law 'share' has no argument 'top'": {"top": "Q:1:left"},
}


def test_faults_of_outputs_are_one_line():
    there = {"wheelset": ("front", "rear")}
    for words, inputs in FAULTS.items():
        with pytest.raises(InputError) as raised:
            OwnOutputs(settings(share, inputs), tuple(QUANTITIES.values()), there)
        assert words in str(raised.value)
        assert len(str(raised.value).splitlines()) == 1


def wavy(track, function, channel="vertical", **parameters):
    name = function.__name__
    own = {"type": "law", "law": name, "channel": channel, "parameters": parameters}
    ends = {"begin": 16.0, "end": 80.0, "shortest": 8.0}
    return track.replace(irregularities=[{**own, **ends}], laws={name: laws.law(function)})


@pytest.mark.parametrize("channel", ["lateral", "vertical", "cross_level", "gauge"])
def test_an_excitation_moves_the_rails_as_the_built_in_wave(curve, channel):
    """A sweep of one wavelength is a sine: values to round-off, rates to their differences."""
    built_in = {"type": "sweep", "channel": channel, "amplitude": 2e-3}
    ends = {"wavelengths": [8.0, 8.0], "begin": 16.0, "end": 80.0}
    sweep = curve.replace(irregularities=[{**built_in, **ends}])
    own = wavy(curve, wave, channel, amplitude=2e-3, length=8.0)
    s = np.linspace(0.0, 90.0, 3001)
    for one, other in ((own, sweep), (mirrored_track(own), mirrored_track(sweep))):
        (values, rates), (expected, slopes) = displacement(one)(s), displacement(other)(s)
        assert np.max(np.abs(expected)) > 9e-4
        assert np.allclose(values, expected, rtol=0.0, atol=1e-15)
        largest, inner = np.max(np.abs(slopes)), (s > 16.2) & (s < 79.8)
        assert np.allclose(rates[:, inner], slopes[:, inner], rtol=0.0, atol=1e-7 * largest)
        assert np.allclose(rates, slopes, rtol=0.0, atol=1e-3 * largest)


@pytest.mark.parametrize(
    ("named", "given", "words"),
    [("wve", True, "did you mean 'wave'?"), ("dip", True, "allowed: wave"),
     ("wave", False, "there is none")],
)  # fmt: skip
def test_an_excitation_by_an_unknown_law_is_told_what_there_is(curve, named, given, words):
    own = {"type": "law", "law": named, "shortest": 8.0, "parameters": {}}
    known = {"wave": laws.law(wave)} if given else None
    with pytest.raises(InputError) as raised:
        displacement(curve.replace(irregularities=[own], laws=known))
    assert len(raised.value.faults) == 1
    assert f"irregularities.0.law: no law '{named}'" in str(raised.value)
    assert words in str(raised.value)


def test_a_vehicle_runs_over_an_excitation(coach, curve):
    ends = {"wavelengths": [8.0, 8.0], "begin": 16.0, "end": 80.0}
    sweep = {"type": "sweep", "channel": "vertical", "amplitude": 2e-3, **ends}
    way = {"speed": 20.0, "until": 30.0}
    expected = railsim.simulate(coach, curve.replace(irregularities=[sweep]), **way)
    own = wavy(curve, wave, amplitude=2e-3, length=8.0)
    found = railsim.simulate(coach, own, **way)
    assert np.ptp(expected["Q"][:, 0, 0]) > 500.0
    assert np.allclose(found["Q"], expected["Q"], rtol=1e-6)
    assert found.track().laws["wave"].source == own.laws["wave"].source


def test_an_excitation_needs_permission_and_numbers(coach, curve, monkeypatch):
    with pytest.raises(InputError, match=r"irregularities.0: the law 'pole' gives .* at s = 16 m"):
        railsim.simulate(coach, wavy(curve, pole), **WAY)
    own = wavy(curve, wave, amplitude=2e-3, length=8.0)
    monkeypatch.delenv(laws.PERMITTED)
    with pytest.raises(InputError, match="'wave' is code of a result, which is not executed"):
        railsim.simulate(coach, own, **WAY)
