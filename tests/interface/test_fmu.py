"""Units of FMI 3.0: written, run by FMPy in a process of its own, and as controller of a run."""

import json
import re
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from click.testing import CliRunner

import railsim
from railsim.cli import railsim as program
from railsim.errors import InputError
from railsim.fmi import Controller, fmu
from railsim.fmi.unit import Unit, exponents

pytest.importorskip("pythonfmu3", reason="no PythonFMU3")
validate_fmu = pytest.importorskip("fmpy.validation", reason="no FMPy").validate_fmu

WAY = {"speed": 20.0, "start": 300.0, "until": 330.0}
OUTPUTS = ["Q:1", "wheelset_lateral:1", "body_acceleration:carbody:y"]
DAMPER = """
from pythonfmu3 import Fmi3Slave, Float64, Fmi3Causality, Fmi3StepResult, Fmi3Variability


class Damper(Fmi3Slave):
    def __init__(self, **facts):
        super().__init__(**facts)
        self.time, self.velocity, self.force = 0.0, 0.0, 0.0
        changing = Fmi3Variability.continuous
        self.register_variable(
            Float64("time", causality=Fmi3Causality.independent, variability=changing)
        )
        self.register_variable(Float64("velocity", causality=Fmi3Causality.input, start=0.0))
        self.register_variable(Float64("force", causality=Fmi3Causality.output))

    def do_step(self, current_time, step_size):
        self.force = -2e4 * self.velocity
        return Fmi3StepResult()
"""
CALLER = """
import json, sys
from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave

file = sys.argv[1]
model = read_model_description(file)
unit = FMU3Slave(guid=model.guid, unzipDirectory=extract(file), instanceName="unit",
                 modelIdentifier=model.coSimulation.modelIdentifier)
unit.instantiate()
unit.enterInitializationMode(startTime=3.0)
unit.exitInitializationMode()
outputs = [v for v in model.modelVariables if v.causality == "output"]
references = [v.valueReference for v in outputs]
rows, time, done = [[3.0, *unit.getFloat64(references)]], 3.0, False
while not done:
    _, done, *_ = unit.doStep(time, 0.02)
    time += 0.02
    rows.append([time, *unit.getFloat64(references)])
    if len(rows) == 11:
        saved = unit.getFMUState()
        first = unit.serializeFMUState(saved)
unit.setFMUState(saved)
again = unit.serializeFMUState(saved)
time, repeated = rows[10][0], []
for row in rows[11:]:
    unit.doStep(time, 0.02)
    time += 0.02
    repeated.append([time, *unit.getFloat64(references)])
print(json.dumps({"names": [v.name for v in outputs], "rows": rows, "repeated": repeated,
                  "same": first == again}))
"""


@pytest.fixture(scope="module")
def active():
    """A coach with a lateral actuator between car body and front frame."""
    coach = railsim.load_vehicle("coach_manchester")
    push = {
        "kind": "actuator",
        "bodies": ["carbody", "front.frame"],
        "points": [[9.5, 0.0, -0.9], [9.5, 0.9, -0.9]],
    }
    return coach.replace(elements={**dict(coach.elements), "push": push})


@pytest.fixture(scope="module")
def track():
    return railsim.load_track("curve_r250")


@pytest.fixture(scope="module")
def unit(active, track, tmp_path_factory):
    return fmu(active, track, tmp_path_factory.mktemp("unit") / "coach.fmu", outputs=OUTPUTS, **WAY)


@pytest.mark.slow
def test_the_unit_without_commands_is_the_run(unit, active, track):
    """In a fresh process, steps of 20 ms; states saved and restored to the last bit."""
    script = unit.with_name("caller.py")
    script.write_text(CALLER)
    ran = subprocess.run([sys.executable, script, unit], capture_output=True, text=True, check=True)
    found = json.loads(ran.stdout.splitlines()[-1])
    rows = np.array(found["rows"])
    rows[:, 0] -= 3.0  # the calling program's time at the beginning
    result = railsim.simulate(active, track, **WAY)
    at = np.searchsorted(result["time"], rows[:, 0] - 1e-9)
    body = result.bodies.index("carbody")
    expected = [
        result["time"],
        *result["Q"][:, 0].T,
        result["wheelset_lateral"][:, 0],
        result["body_acceleration"][:, body, 1],
    ]
    assert found["names"][-1] == "body_acceleration.carbody.y"
    assert np.allclose(rows, np.transpose(expected)[at], rtol=1e-9, atol=1e-12)
    assert found["same"]
    assert found["repeated"] == found["rows"][11:]
    assert "the run has ended: complete" in ran.stdout + ran.stderr


class Slave:
    """What the wrapper of a unit has of PythonFMU3."""

    resources = ""

    def __init__(self, **facts):
        self.logged = []

    def register_units(self, units):
        """Leave the description of the unit out."""

    def register_variable(self, variable, nested):
        """Leave the description of the unit out."""

    def log(self, *words):
        self.logged.append(words)


class Called(Unit, Slave):
    """A unit without a program that calls it."""


def unpacked(path, folder):
    with zipfile.ZipFile(path) as packed:
        packed.extractall(folder)
    Called.resources = str(folder / "resources")
    return Called()


def test_steps_of_communication_may_be_a_little_longer_than_those_of_the_run(unit, tmp_path):
    """By less than a thousandth of one, in which a step of the run is not divided."""
    called = unpacked(unit, tmp_path)
    called.exit_initialization_mode()
    step = 1.0003 * called._run.step_length
    for k in range(20):
        assert called.do_step(3.0 + k * step, step).status.name == "ok", called.logged
    assert called._run.time == pytest.approx(20 * step, abs=0.001 * step)
    for wrong in (0.0, -step, np.nan):  # an error, after which the run goes on
        assert called.do_step(3.0 + 20 * step, wrong).status.name == "error"
    assert "more than 0" in called.logged[-1][0]
    assert called.do_step(3.0 + 20 * step, step).status.name == "ok"


def test_a_wrong_command_is_an_error_after_which_the_run_goes_on(unit, tmp_path):
    """Not a fatal one, which would end all units of the program."""
    called = unpacked(unit, tmp_path)
    called.exit_initialization_mode()
    called._commands["push"] = np.nan
    assert called.do_step(0.0, 0.02).status.name == "error"
    assert "push" in called.logged[-1][0]
    called._commands["push"] = 1e3
    assert called.do_step(0.0, 0.02).status.name == "ok"
    assert called._time == pytest.approx(0.02)


def test_a_step_out_of_turn_is_an_error_after_which_the_run_goes_on(unit, tmp_path):
    """Before the initialisation and after the end; a fatal one may take the program with it."""
    called = unpacked(unit, tmp_path)
    assert called.do_step(0.0, 0.02).status.name == "error"
    assert "initialisation" in called.logged[-1][0]
    called.exit_initialization_mode()
    assert called.do_step(0.0, 0.02).status.name == "ok"
    called.terminate()
    assert called.do_step(0.02, 0.02).status.name == "error"


def test_a_state_can_be_written_from_the_begin_on(unit, tmp_path):
    """Ahead of the part of the run that is evaluated, and within a step: to the last bit."""
    called = unpacked(unit, tmp_path)
    called.exit_initialization_mode()
    called.do_step(0.0, 0.0013)
    saved = json.loads(json.dumps(called._get_fmu_state()))
    called.do_step(0.0013, 0.02)
    first = dict(called._values)
    called._set_fmu_state(saved)
    called.do_step(0.0013, 0.02)
    assert called._values == first


def test_a_step_beyond_the_end_ends_with_the_run_at_the_time_of_the_program(unit, tmp_path):
    """30 m at 20 m/s, from 3 s on; what the program asks for later is an error."""
    called = unpacked(unit, tmp_path)
    called.exit_initialization_mode()
    last = called.do_step(3.0, 5.0)
    assert last.terminateSimulation
    assert last.status.name == "ok"
    assert called._time == pytest.approx(4.5, abs=1e-6)
    assert called._status == "complete"
    assert called.do_step(4.5, 0.1).status.name == "error"


@pytest.mark.parametrize(
    ("unit_of_si", "defined"),
    [("N", "kg m/s2"), ("Pa", "N/m2"), ("J", "N m"), ("W", "J/s"), ("N m/rad", "kg m2/s2 rad")],
)
def test_units_are_made_of_the_base_units_as_the_si_defines_them(unit_of_si, defined):
    left, right = exponents(unit_of_si), exponents(defined)
    assert left == right
    assert exponents("kg m/s2") == {"kg": 1, "m": 1, "s": -2}


def test_the_unit_holds_no_path_and_says_what_it_needs(unit):
    with zipfile.ZipFile(unit) as archive:
        description = archive.read("modelDescription.xml").decode()
        contents = [archive.read(n) for n in archive.namelist() if n.startswith("resources/")]
    assert f"Python that has railsim {railsim.__version__}" in description.replace("\n", " ")
    assert '<BaseUnit kg="1" m="1" s="-2"/>' in description
    assert re.search('<Float64 name="push"[^>]* unit="N"/>', description)
    of_unit = description.partition("<CoSimulation")[2].partition(">")[0]
    true = set(re.findall(r'(\w+)="true"', of_unit))
    # attributes of FMI 3.0: what a master may rely on, and that a Python has to be there
    assert true >= {
        "needsExecutionTool",
        "canGetAndSetFMUState",
        "canSerializeFMUState",
        "canHandleVariableCommunicationStepSize",
    }
    assert validate_fmu(str(unit)) == []
    assert not any(str(unit.parent).encode() in content for content in contents)


def test_the_end_of_a_unit_may_be_any_number(active, track, tmp_path):
    way = {**WAY, "until": np.int64(330)}
    found = fmu(active, track, tmp_path / "coach.fmu", outputs=["Q:1"], **way)
    assert json.loads(zipfile.ZipFile(found).read("resources/variables.json"))["until"] == 330.0


def test_quantities_of_ones_own_are_outputs_whatever_their_unit(active, track, tmp_path):
    own = {"law": "double", "inputs": {"q": "Q:1:left"}, "unit": "% of Hz"}
    text = "def double(q):\n    return 2.0 * q\n"
    settings = railsim.Settings.model_validate({
        "laws": {"double": {"source": text}}, "outputs": {"own": {"double": own}},
    })  # fmt: skip
    outputs, path = ["double", "Q:1:left"], tmp_path / "own.fmu"
    fmu(active, track, path, outputs=outputs, settings=settings, allow_code=True, **WAY)
    assert not validate_fmu(str(path))
    called = unpacked(path, tmp_path)
    called.exit_initialization_mode()
    twice, once = called._values.values()
    assert twice == pytest.approx(2.0 * once)


def test_a_unit_as_controller_acts_one_period_late(active, track, tmp_path):
    from pythonfmu3 import FmuBuilder

    script = tmp_path / "damper.py"
    script.write_text(DAMPER)
    damper = FmuBuilder.build_FMU(script, dest=tmp_path)
    body = railsim.simulate(active, track, speed=20.0, until=0.2).bodies.index("carbody")
    reading = f"body_velocity:{body}:1"
    with railsim.Simulation(active, track, **WAY, record=False) as own:
        commands = []
        while own.running:
            commands.append(-2e4 * own.read("body_velocity")[body, 1])
            own.step(0.01)
            own.set("push", commands[-1])
        by_hand = own.read("body_position")
    with (
        railsim.Simulation(active, track, **WAY, record=False) as run,
        Controller(
            damper, inputs={"velocity": reading}, outputs={"force": "push"}, period=0.01,
            allow_code=True,
        ) as controller,
    ):  # fmt: skip
        controller.run(run)
        assert np.array_equal(run.read("body_position"), by_hand)
    assert max(map(abs, commands)) > 10.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"inputs": ["pull"]}, "no actuator 'pull'; allowed: push"),
        ({"outputs": ["R"]}, "no quantity 'R'"),
        ({"outputs": ["R", "Q:9"]}, "outputs: Q:9: no label '9'"),  # both are named
    ],
)
def test_wrong_variables_are_input_errors(active, track, tmp_path, change, words):
    with pytest.raises(InputError, match="no ") as error:
        fmu(active, track, tmp_path / "coach.fmu", **WAY, **change)
    assert words in str(error.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        ("status", "outputs: 'status' is the name of a variable of every unit"),
        ("time", "outputs: 'time' is the name of a variable of every unit"),
        ("push", "outputs: 'push' is the name of one of its inputs"),
    ],
)
def test_names_of_variables_are_unique(active, track, tmp_path, signal, words):
    vehicle = active.replace(signals={signal: {"quantity": "time"}})
    with pytest.raises(InputError, match=words):
        fmu(vehicle, track, tmp_path / "coach.fmu", **WAY, outputs=[signal])


def test_inputs_of_a_unit_are_not_what_a_controller_commands(active, track, tmp_path):
    """A command of 0 from the program would replace the controller's at each step."""
    pull = {**dict(active.elements)["push"].model_dump(exclude_none=True), "delay": 0.1}
    both = active.replace(
        elements={**dict(active.elements), "pull": pull},
        laws={"ramp": {"source": "def ramp(time):\n    return 1e3 * time\n"}},
        controllers={"ramp": {"law": "ramp", "period": 0.01, "outputs": ["push"]}},
    )
    way = {**WAY, "allow_code": True, "outputs": ["Q:1"]}
    found = fmu(both, track, tmp_path / "coach.fmu", **way)
    facts = json.loads(zipfile.ZipFile(found).read("resources/variables.json"))
    assert [one["name"] for one in facts["inputs"]] == ["pull"]
    with pytest.raises(InputError, match=r"inputs: 'push', which controllers\.ramp commands"):
        fmu(both, track, tmp_path / "other.fmu", inputs=["push"], **way)


def test_low_pass_of_what_is_stored_does_not_pass_for_one_of_the_outputs(active, track, tmp_path):
    settings = railsim.Settings().with_values({"outputs.low_pass": {"frequency": 40.0}})
    with pytest.raises(InputError, match=r"settings: outputs\.low_pass: given"):
        fmu(active, track, tmp_path / "coach.fmu", **{**WAY, "settings": settings})
    assert not list(tmp_path.iterdir())


def test_native_code_needs_permission(unit):
    with pytest.raises(InputError, match="allow_code=True"):
        Controller(unit, inputs={}, outputs={}, period=0.01)


def test_command(tmp_path):
    out = tmp_path / "coach.fmu"
    run = [
        "fmu", "coach_manchester", "curve_r250", "--speed", "72km/h", "--until", "5", "--outputs",
        "sum_Y:1", "--out", str(out),
    ]  # fmt: skip
    answer = CliRunner().invoke(program, run)
    assert answer.exit_code == 0, answer.output
    with zipfile.ZipFile(out) as archive:
        assert b"sum_Y.front.outer.wheelset" in archive.read("modelDescription.xml")
    again = CliRunner().invoke(program, run)
    assert isinstance(again.exception, InputError)
    assert "exists" in str(again.exception)
