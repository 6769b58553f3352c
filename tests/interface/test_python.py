"""What a notebook gets: public names, tables, pictures, changed values, frames of pandas."""

import base64
import copy
import inspect
import math
import pickle
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import click
import example_result
import numpy as np
import pytest

import railsim
from railsim import fmi, observation, simulate
from railsim.cli import main
from railsim.cli import railsim as commands
from railsim.contact.summary import contact_summary
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import InputError, ModelError
from railsim.linear.modes import Mode, Modes
from railsim.linear.vehicle import Contact
from railsim.mechanisms.analysis import analyse
from railsim.result import Hdf5Sink
from railsim.studies.assess_track import assess_track
from railsim.studies.rail_wear import rail_wear
from railsim.studies.stationary import stationary
from railsim.studies.wear_loop import wear_loop
from railsim.table import Table

COACH = "coach_manchester"


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle(COACH)


@pytest.fixture(scope="module")
def result():
    return example_result.example_result()


def test_every_public_name_is_there():
    assert [name for name in railsim.__all__ if not hasattr(railsim, name)] == []


def test_import_loads_neither_compiler_nor_pictures():
    heavy = "{'numba', 'matplotlib', 'scipy', 'h5py', 'pydantic', 'pandas'}"
    code = f"import sys, railsim; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_values_are_changed_as_in_a_file(coach):
    changed = coach.with_values(
        {"bodies.carbody.mass": np.float64(40e3), "bodies.carbody.position": (0, 0, -1.8)}
    )
    text = ["bodies.carbody.mass=40e3", "bodies.carbody.position=[0, 0, -1.8]"]
    assert changed == railsim.load_vehicle(COACH, text)
    assert coach == railsim.load_vehicle(COACH)


def test_lists_tables_and_settings_are_changed_too():
    track = railsim.load_track("curve_r250").with_values(
        {"friction": [0.2, 0.3], "plan.0.length": 60}
    )
    assert track.friction == (0.2, 0.3)
    assert track.plan[0].length == 60.0
    settings = railsim.Settings().with_values({"fastsim_grid.0": 20, "outputs.track": True})
    assert settings.fastsim_grid == (20, 10)
    assert settings.outputs.track
    mechanism = railsim.load_mechanism("atr95_lift_5", "parameters.a1=0.16")
    again = mechanism.with_values({"parameters.a2": mechanism.parameters["a2"]})
    assert set(again.provenance["set"]) == {"a1", "a2"}


def test_all_wrong_values_are_told_with_their_keys(coach):
    with pytest.raises(InputError) as caught:
        coach.with_values({"bodies.carbodi.mass": 40e3, "assemblies.bogi.bodies.frame.mass": 2e3})
    assert len(caught.value.faults) == 2
    with pytest.raises(InputError) as caught:
        coach.with_values({"bodies.carbody.mass": -1.0, "wheelset": math.nan})
    assert {"bodies.carbody.mass", "wheelset"} <= {fault.key for fault in caught.value.faults}


def test_tables_of_a_notebook_show_names_literally(coach, result):
    assert '<td class="words">carbody</td>' in coach._repr_html_()
    assert "<b>" not in coach.replace(name="<b>")._repr_html_()
    assert repr(coach) == f"<Vehicle {coach.name!r}>"
    assert "CIR" in railsim.load_track("curve_r250")._repr_html_()
    assert "creep_law" in railsim.Settings()._repr_html_()
    assert "<svg" in railsim.load_profile("S1002")._repr_html_()
    assert repr(railsim.load_profile("S1002")).startswith("<Profile 'S1002': wheel, ")
    assert '<td class="words">Q</td>' in result._repr_html_()


def test_a_value_of_60_characters_is_the_longest_that_a_notebook_shows():
    for resistance, shown in ((12.3456789012345, True), (123.4567890123456, False)):
        drive = {"mode": "free", "resistance": (resistance, 0.0, 0.0)}
        text, settings = str(drive), railsim.Settings(drive=drive)
        assert len(text) == (60 if shown else 61)
        assert (str(resistance) in settings._repr_html_()) is shown


def test_a_result_says_what_it_is_of_and_draws_its_forces(result):
    vehicle, track = result.vehicle().name, result.track().name
    title = f"{vehicle} on {track} at {result.speed:g} m/s"
    assert repr(result).startswith(f"<Result: {title}")
    page = result._repr_html_()
    assert title in page
    picture = page.split('src="data:image/png;base64,')[1].split('"')[0]
    assert base64.b64decode(picture).startswith(b"\x89PNG")


def test_frames_have_a_column_for_each_set_of_labels(result):
    pytest.importorskip("pandas")
    frame = result.to_pandas("Q", "body_position")
    wheelset, body = result.wheelsets[0], result.bodies[0]
    np.testing.assert_array_equal(frame[f"Q:{wheelset}:right"], result.Q[:, 0, 1])
    np.testing.assert_array_equal(frame[f"body_position:{body}:y"], result.body_position[:, 0, 1])
    assert frame.attrs["units"][f"body_position:{body}:roll"] == "rad"
    np.testing.assert_array_equal(frame.index, result.time)
    with pytest.raises(KeyError, match="no quantity 'Z'"):
        result.to_pandas("Z")


def test_results_and_tracks_draw_themselves(result, tmp_path):
    figure = result.plot("Q", "sum_Y", over="time", path=tmp_path / "forces.png")
    assert [axes.get_ylabel() for axes in figure.axes] == ["$Q$ (kN)", r"$\Sigma Y$ (kN)"]
    assert (tmp_path / "forces.png").stat().st_size > 10_000
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert railsim.load_track("curve_r250").plot().axes


def test_a_peak_fits_on_a_line_of_a_notebook(result):
    peak = railsim.peaks(result)[0]
    assert repr(peak).startswith(f"Peak(quantity=<Quantity Q [N]>, value={peak.value}, labels={{")
    assert len(repr(peak)) < 250


def test_static_loads_carry_the_weight(coach):
    loads = railsim.static_loads(coach)
    assert loads.Q0.sum() == pytest.approx(coach.mass * 9.81, rel=1e-6)
    assert loads.axle_load.shape == (4,)
    assert "axle load (kN)" in loads._repr_html_()


def test_wheelsets_have_names_numbers_from_1_in_texts_and_from_0_as_integers(result):
    second = result.Q[:, 1, 0]
    for label in ("2", "front.inner.wheelset", 1, -3):
        assert (result.series("Q", wheelset=label, side="left") == second).all()
    for text in ("Q:2:left", "Q:front.inner.wheelset:left"):
        (column,) = result.columns(text)
        assert column[0] == "Q:front.inner.wheelset:left"
        assert (column[2] == second).all()
    assert len(list(result.columns("Q:2"))) == 2
    for wrong in ("0", "5", "inner", 4, -5):
        with pytest.raises(KeyError, match=f"no wheelset '?{wrong}'?; "):
            result.series("Q", wheelset=wrong)
    with pytest.raises(KeyError, match="no label '5'"):
        list(result.columns("Q:5"))


def test_speeds_are_taken_with_their_unit(coach):
    track = railsim.load_track("curve_r250", ["speed=72 km/h"])
    assert track.speed == coach.with_values({"service.admissible_speed": "72 km/h"}
                                            ).service.admissible_speed == 20.0  # fmt: skip
    table = {"mode": "table", "speed_table": [[0.0, "72 km/h"], [50.0, 10.0]]}
    assert railsim.Settings(drive=table).drive.speed_table[0][1] == 20.0
    assert railsim.simulate(coach, track, speed="72 km/h", until=0.5).speed == 20.0
    assert railsim.modes(coach, speed="72 km/h").speed == 20.0
    found = railsim.critical_speed(
        coach, methods="linear", low="36 km/h", high="72km/h", over_amplitude=False
    )
    assert (found.low, found.high) == (10.0, 20.0)
    for single in (30, "72 km/h"):
        with pytest.raises(InputError, match=f"^speeds: found {single!r}; several"):
            railsim.root_locus(coach, track, speeds=single)
    assert railsim.describe(track, ["72 km/h"]).data == railsim.describe(track, [20.0]).data
    for wrong in ("fast", "20 kN"):
        for call in (railsim.modes, railsim.simulate):
            with pytest.raises(InputError, match=f"^speed: found '{wrong}'; "):
                call(coach, track, speed=wrong)


@pytest.mark.parametrize(("methods", "useless"), [
    ("linear", {"points", "excitations"}),
    (("ramp", "continuation"), {"points"}),
    ("bifurcation", {"high"}),
])  # fmt: skip
def test_arguments_that_a_method_does_not_use_are_refused(coach, methods, useless):
    """The range is wrong, too, where all are used: nothing is computed."""
    arguments = {"points": 30, "excitations": [2e-3], "high": 120.0}
    arguments |= {"high": 1e6} if "high" in useless else {}
    with pytest.raises(InputError) as caught:
        railsim.critical_speed(coach, methods=methods, **arguments)
    assert {fault.file or fault.key for fault in caught.value.faults} == useless


def test_analyses_say_what_they_are_of_and_draw_themselves(coach):
    found = railsim.modes(coach)
    assert repr(found).startswith(f"<Modes: {coach.name}: 20 m/s")
    assert "<img src=" in found._repr_html_()
    assert repr(railsim.Settings()) == "<Settings: defaults>"
    assert str(railsim.Settings(output_rate=500.0)) == "<Settings: output_rate=500.0>"


def test_completion_shows_keys_and_methods_for_users(coach):
    names = {name for name in dir(coach) if not name.startswith("_")}
    assert {"bodies", "with_values", "save", "plot"} <= names
    assert not {"model_dump", "copy", "json", "note_assigned", "KIND"} & names
    assert len(names) < 28


def test_faults_name_parameters_in_python_and_options_on_the_command_line(tmp_path, capsys):
    def study(**changes):
        given = {"vehicles": "coach_manchester", "tracks": "curve_r250", "speeds": [20]}
        with pytest.raises(InputError) as caught:
            railsim.study(**{**given, "out": tmp_path / "study", **changes})
        return str(caught.value)

    assert study(grid={"track.frictio": [1]}).startswith("grid: track.frictio: ")
    assert study(grid={"frictio": [1]}).startswith("grid: frictio: ")
    assert study(keep="nothing").startswith("keep: nothing: ")
    assert study(quantities="nothing").startswith("quantities: ")
    (tmp_path / "out.txt").write_text("")
    assert study(out=tmp_path / "out.txt").startswith("out: ")
    assert main(["study", "--vehicles", "coach_manchester", "--tracks", "curve_r250", "--speeds",
                 "20", "--keep", "nothing", "--out", str(tmp_path / "study")]) == 2  # fmt: skip
    assert capsys.readouterr().err.startswith("--keep: nothing: ")


def test_results_are_saved_like_definitions(result, tmp_path):
    assert railsim.open_result(result.save(tmp_path / "run.h5")).status == result.status
    with pytest.raises(InputError, match="give `overwrite`"):
        result.save(tmp_path / "run.h5")


def test_a_study_of_what_is_no_input_is_refused(tmp_path):
    of = {"vehicles": ["coach_manchester"], "tracks": "curve_r250", "speeds": 20.0, "out": tmp_path}
    for wrong in ({"vehicles": None}, {"tracks": [3]}, {"settings": {"step": 1e-3}}):
        with pytest.raises(TypeError, match="one of the inputs of the study is a"):
            railsim.study(**{**of, **wrong})
    with pytest.raises(InputError, match="workers: found '2'; a whole number"):
        railsim.study(**of, workers="2")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"speed": True}, "speed: found True; a number"),
        ({"speed": 1j}, "speed: found 1j; a number"),
        ({"speed": None, "resume": 3.0}, "resume: not finite numbers in a row"),
        ({"speed": None, "resume": np.full(60, np.nan)}, "resume: not finite numbers in a row"),
        ({"speed": None, "resume": np.ones(60, complex)}, "resume: not finite numbers in a row"),
        ({"speed": 20.0, "resume": np.ones(60)}, "speed: given together with `resume`"),
    ],
)
def test_a_wrong_argument_is_one_clear_error(given, words, coach):
    with pytest.raises(InputError) as caught:
        railsim.simulate(coach, railsim.load_track("straight"), **given)
    assert str(caught.value).startswith(words)


def test_arrays_and_paths_are_values_as_in_a_file():
    plan, rows = [{"type": "STR", "length": np.float32(50.0)}], np.zeros((2, 3))
    make = partial(railsim.Track, name="own", plan=plan)
    track = make(friction=np.array([0.3, 0.2]), rail=Path("54E1"))
    assert (track.friction, track.rail) == ((0.3, 0.2), ("54E1", "54E1"))
    with pytest.raises(InputError) as caught:
        make(rail=3, irregularities=[{"type": "measured", "rows": rows}])
    assert str(caught.value).splitlines() == [
        "track: rail: 3; must be a valid string",
        "track: irregularities.0.rows.0: 3 values; a list of 5",
        "track: irregularities.0.rows.1: 3 values; a list of 5",
    ]
    with pytest.raises(InputError, match=r"an assignment .* is needed"):
        railsim.load_track("straight", [("friction", 0.3)])


def test_one_vehicle_at_least_and_a_sink_for_each_run_together(coach):
    track = railsim.load_track("straight")
    with pytest.raises(InputError, match="vehicles: no vehicle"):
        railsim.simulate_together([], track, speed=20.0)
    with pytest.raises(InputError, match="sinks: 0 for 1 vehicles"):
        railsim.simulate_together([coach], track, speed=20.0, sinks=[])


def test_several_vehicles_over_one_track_are_runs_as_alone(coach):
    track, seen = railsim.load_track("straight"), []
    light = coach.with_values({"bodies.carbody.mass": 25e3})
    both = railsim.simulate_together(
        [coach, light], track, speed=20.0, until=2.0, progress=seen.append
    )
    for vehicle, result in zip((coach, light), both, strict=True):
        alone = railsim.simulate(vehicle, track, speed=20.0, until=2.0)
        np.testing.assert_array_equal(result.Q, alone.Q)
    (single,) = railsim.simulate_together(coach, track, speed=20.0, until=2.0)
    np.testing.assert_array_equal(single.Q, both[0].Q)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert 0.5 in seen


def test_a_vehicle_that_fails_fails_when_all_others_are_done(coach, tmp_path):
    floating = coach.with_values(
        {"assemblies.bogie.elements.secondary_spring.preload": [0.0, 0.0, 0.0]}
    )
    sinks = [Hdf5Sink(tmp_path / f"{number}.h5") for number in (1, 2, 3)]
    with pytest.raises(ModelError, match=f"no static equilibrium of '{coach.name}'") as caught:
        railsim.simulate_together(
            [coach, floating, coach], railsim.load_track("straight"), speed=20.0, until=1.0,
            sinks=sinks,
        )  # fmt: skip
    assert caught.value.__notes__ == ["this was vehicle 2 of 3"]
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["1.h5", "3.h5"]


def test_names_instead_of_what_they_stand_for_are_told(coach, result):
    track = railsim.load_track("straight")
    curving = partial(railsim.curving, radius=300.0)
    for analysis in (railsim.modes, railsim.critical_speed, railsim.static_loads, curving):
        with pytest.raises(TypeError, match="the vehicle is 'coach'; give what"):
            analysis("coach")
    for analysis in (railsim.modes, curving, partial(railsim.simulate, track=track, speed=20.0)):
        with pytest.raises(TypeError, match="the settings are a dict; give what"):
            analysis(coach, settings={"step": 1e-3})
    with pytest.raises(TypeError, match="the sink is a str; give"):
        railsim.simulate(coach, track, speed=20.0, sink="run.h5")
    with pytest.raises(TypeError, match="the results are a str; give what"):
        railsim.assess("run.h5")
    for load in (railsim.load_vehicle, railsim.load_track, railsim.load_settings):
        with pytest.raises(TypeError, match="is a Vehicle; give a path"):
            load(coach)
    for show in (railsim.peaks, railsim.mid_curves, partial(railsim.animate, path="a.html")):
        with pytest.raises(TypeError, match="the result is 'run"):
            show("run.h5")
    with pytest.raises(TypeError, match=r"found 'coach'; give what railsim.load_... or open_resu"):
        railsim.describe("coach")
    for how, words in (
        ({"over": "Q"}, "over: found 'Q'; distance or time"),
        ({"by": "axle"}, "by: found 'axle'; wheel or wheelset"),
        ({"between": 5}, "between: found 5; two numbers"),
    ):
        with pytest.raises(InputError, match=words):
            result.plot("Y", **how)
    with pytest.raises(InputError, match="frames_per_second: found 0; 1 or more"):
        railsim.animate(result, "film.gif", frames_per_second=0)
    with pytest.raises(InputError, match=r"files: found <Result: .*; the path of a result file"):
        railsim.write_report(result, "page.html")
    with pytest.raises(TypeError, match="the track is 'straight'"):
        railsim.simulate(coach, "straight", speed=20.0)
    with pytest.raises(TypeError, match="profiles: give a mapping of names"):
        railsim.simulate(coach, track, speed=20.0, profiles=["S1002"])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"y": [0.0, 1.0, math.nan]}, "values that are not finite"),
        ({"y": [0.0, 1.0]}, "arrays of shape (2,) and (3,)"),
        ({"kind": "wheels"}, "'wheels'; wheel or rail"),
        ({"y": [0.2, 0.1, 0.0]}, "y from 0.2 to 0, z 0 to 0; y rises from the flange or gauge"),
        (
            {"y": [-0.04, 0.0, 0.06], "z": [-0.028, 0.0, 0.003]},
            "y from -0.04 to 0.06, z -0.028 to 0.003; y rises from",
        ),
    ],
)
def test_points_that_are_no_profile_are_refused(changes, words):
    values = {"name": "own", "kind": "wheel", "y": [0.0, 0.1, 0.2], "z": [0.0, 0.0, 0.0]}
    with pytest.raises(InputError) as caught:
        railsim.Profile(**{**values, **changes})
    assert words in str(caught.value)


def test_definitions_and_results_cannot_be_changed(coach, result):
    with pytest.raises(TypeError, match="does not change"):
        coach.bodies["carbody"] = None
    with pytest.raises(TypeError, match="does not change"):
        coach.assemblies.clear()
    with pytest.raises(TypeError, match="does not change"):
        coach.bodies["carbody"].mass = 28e3
    with pytest.raises(TypeError, match="does not change"):
        del coach.name
    assert pickle.loads(pickle.dumps(coach)) == coach == copy.deepcopy(coach)
    assert pickle.loads(pickle.dumps(coach)).bodies.keys() == coach.bodies.keys()
    with pytest.raises(TypeError, match="does not change"):
        pickle.loads(pickle.dumps(coach)).bodies.clear()
    with pytest.raises(ValueError, match="WRITEABLE"):
        result.Q.setflags(write=True)


def test_definitions_are_keys_of_dictionaries(coach):
    one, other = railsim.Settings(initial={"axle": {"y": 1e-3}}), railsim.Settings()
    of = {coach: "coach", one: "one", other: "other"}
    again = railsim.Settings(initial={"axle": {"y": 1e-3}})
    assert (of[pickle.loads(pickle.dumps(coach))], of[again]) == ("coach", "one")


def test_what_follows_from_a_vehicle_is_worked_out_once_in_a_process(coach):
    """A worker gets the vehicle with each run of a study: the same one, not another copy."""
    first, second = (pickle.loads(pickle.dumps(coach)) for _ in range(2))
    assert first is second
    assert flatten(first) is flatten(second)
    other = pickle.loads(pickle.dumps(coach.with_values({"bodies.carbody.mass": 30e3})))
    assert (other.bodies["carbody"].mass, first.bodies) == (30e3, coach.bodies)
    assert first.model_fields_set == coach.model_fields_set


def test_name_that_is_not_there_says_which_are():
    mode = Mode("upper sway", -1.0 + 6.0j, {}, {})
    with pytest.raises(KeyError, match=r"no mode 'sway'; .*upper sway"):
        Modes(20.0, Contact(), (mode,))["sway"]
    with pytest.raises(KeyError, match="no column 'spede'; did you mean 'speed'"):
        Table(["speed"], [[20.0]])["spede"]
    with pytest.raises(TypeError, match="give keys with their values"):
        railsim.load_vehicle("coach_manchester").with_values("mass")


def test_runs_in_threads_are_those_one_after_the_other(coach):
    """To the bit: the time loop lets other threads run, and runs share no arrays that it writes."""
    track = railsim.load_track("curve_r250")

    def end(speed):
        return railsim.simulate(coach, track, speed=speed, until=30.0).groups["state"]["end"]

    speeds = (15.0, 18.0, 15.0, 18.0)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(end, speeds))
    for state, speed in zip(found, speeds, strict=True):
        assert np.array_equal(state, end(speed))


# functions of commands where they are not of its name
OF_COMMANDS = {
    "run": simulate,
    "stationary": stationary,
    "wear": wear_loop,
    "rail-wear": rail_wear,
    "irregularity": observation.irregularity,
    "contact": contact_summary,
    "mechanism": analyse,
    "fmu": fmi.fmu,
    "assess-track": assess_track,
}


def values(default):
    """Numbers and words of a default; one that stands for several once."""
    several = default if isinstance(default, list | tuple) else str(default).split(":")
    return {float(x) if re.fullmatch(r"[-.\de]*\d", str(x)) else x for x in several}


def test_a_command_and_its_function_begin_from_the_same_defaults():
    context, differ, alike = click.Context(commands), [], 0
    for name in commands.list_commands(context):
        function = OF_COMMANDS.get(name, getattr(railsim, name.replace("-", "_"), None))
        if not callable(function):
            continue
        own = inspect.signature(function).parameters
        for option in commands.get_command(context, name).params:
            parameter = own.get(option.name)
            given = option.to_info_dict()["default"]
            if None in (parameter, given) or parameter.default in (None, parameter.empty):
                continue
            alike += 1
            if values(given) != values(parameter.default):
                differ.append((name, option.name, given, parameter.default))
    assert differ == []
    assert alike > 25
