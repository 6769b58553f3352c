"""``railsim critical-speed`` and ``railsim curving``: tables, JSON, pictures, refusals."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import railsim
from railsim.cli import main
from railsim.errors import ModelError
from railsim.linear.steady import NotConverged
from railsim.linear.vehicle import Contact
from railsim.plot.stability import map_figure
from railsim.stability import critical_speed, curving
from railsim.stability.branches import Branch, Point
from railsim.studies import stability_map
from railsim.studies.stability_map import map_speeds, map_table


def test_linear_critical_speed(capsys, tmp_path):
    folder = tmp_path / "out"
    assert (
        main(
            [
                "critical-speed",
                "coach_manchester",
                "--method",
                "linear",
                "--json",
                "--quiet",
                "--linearisation",
                "harmonic",
                "--out",
                str(folder),
            ]
        )
        == 0
    )
    record = json.loads(capsys.readouterr().out)
    assert record["linear"]["mode"].endswith("hunting")
    assert {
        "linear",
        "nonlinear",
        "amplitude_limit",
        "instability_limit",
        "type",
        "branches",
    } <= set(record)
    assert (folder / "critical_speed.png").stat().st_size > 1000


def map_command(folder):
    """Arguments of a map of two linear critical speeds, kept in `folder`."""
    return [
        "critical-speed",
        "coach_manchester",
        "--method",
        "linear",
        "--friction",
        "0.2,0.4",
        "--from",
        "20",
        "--to",
        "80",
        "--workers",
        "1",
        "--out",
        str(folder),
        "--quiet",
    ]


def test_map_of_critical_speeds_goes_on_where_it_stopped(capsys, tmp_path, undrawn):
    folder = tmp_path / "map"
    command = map_command(folder)
    assert main(command) == 0
    told = capsys.readouterr().out
    assert "friction" in told
    assert "creep law FASTSIM 10 x 10 cells (linear: FASTSIM 100 x 100 cells)" in told
    kept = sorted((folder / "points").iterdir())
    assert len(kept) == 2
    (folder / "critical_speed.json").unlink()
    (folder / "critical_speed.png").unlink()
    before = [path.stat().st_mtime_ns for path in kept]
    with undrawn():
        assert main(command) == 0
    assert capsys.readouterr().err == ""
    assert [path.stat().st_mtime_ns for path in kept] == before  # not computed again


def test_progress_of_a_map_counts_the_points_that_were_stored(monkeypatch):
    """From their share on it rises by a point each to the whole."""
    points, seen = [stability_map.MapPoint({}, None, None, None)] * 4, []
    paths = iter(range(4))
    monkeypatch.setattr(stability_map, "checked", lambda *_, **__: None)
    monkeypatch.setattr(stability_map, "_stored_path", lambda *_: next(paths))
    monkeypatch.setattr(stability_map, "stored_record", lambda at, _: {} if at == 2 else None)
    monkeypatch.setattr(stability_map, "write_record", lambda *_: None)
    monkeypatch.setattr(stability_map, "_compute", lambda waiting, *_: ((k, {}) for k in waiting))
    stability_map.stability_map(
        points, {"linearisation": "tangent", "amplitude": 3e-3}, folder=None, workers=1,
        overwrite=False, progress=seen.append, on_remark=str,
    )  # fmt: skip
    assert seen == [0.25, 0.5, 0.75, 1.0]


def test_map_that_is_interrupted_while_it_is_drawn_goes_on(tmp_path, monkeypatch, undrawn):
    """Its points are kept; a record alone would refuse the command, `--overwrite` begin anew."""
    folder = tmp_path / "map"
    command = map_command(folder)

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("railsim.plot.stability.map_figure", interrupted)
        assert main(command) == 130
    assert [path.name for path in folder.iterdir()] == ["points"]
    with undrawn():
        assert main(command) == 0


def test_damaged_point_of_a_map_is_computed_again_and_told(capsys, tmp_path):
    folder = tmp_path / "map"
    command = map_command(folder)
    assert main(command) == 0
    told = capsys.readouterr().out
    whole = {path: path.read_bytes() for path in (folder / "points").iterdir()}
    damaged = next(iter(whole))
    damaged.write_bytes(whole[damaged].replace(b'"speed": ', b'"speed": 1', 1))
    (folder / "critical_speed.json").unlink()
    (folder / "critical_speed.png").unlink()
    assert main(command) == 0
    again = capsys.readouterr()
    assert again.out == told
    assert again.err.startswith(f"remark: {damaged}: ")
    assert again.err.endswith(": it is computed again\n")
    assert again.err.count("\n") == 1
    assert {path: path.read_bytes() for path in (folder / "points").iterdir()} == whole


def test_a_point_of_a_map_is_not_that_of_a_profile_file_before_its_change(tmp_path):
    """The vehicle names the file only: points kept for a new wheel were taken for a worn one."""
    wheel, kept = tmp_path / "wheel.csv", set()
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"
    for worn in (0.0, 0.5):  # mm off the tread
        new = railsim.load_profile("S1002")
        points = np.column_stack([1e3 * new.y, 1e3 * new.z - worn])
        np.savetxt(wheel, points, delimiter=",", header="y_mm,z_mm", comments="")
        coach = railsim.load_vehicle("coach_manchester", [f"{key}={wheel}"])
        point = stability_map.MapPoint(
            {}, coach, railsim.load_track("straight"), railsim.Settings()
        )
        kept |= {stability_map._stored_path(tmp_path, point, {}) for _ in range(2)}
    assert len(kept) == 2


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.further
def test_map_over_any_key_of_the_files(capsys, tmp_path):
    """Cones twice as steep cost speed, a heavier car a little; both keys stand in each record."""
    folder = tmp_path / "map"
    mass = "vehicle.bodies.carbody.mass"
    assert (
        main(
            [
                "critical-speed",
                "coach_manchester",
                "--method",
                "linear",
                "--from",
                "20",
                "--to",
                "100",
                "--over",
                f"{mass}=25e3,45e3",
                "--conicity",
                "0.1,0.2",
                "--workers",
                "1",
                "--json",
                "--quiet",
                "--out",
                str(folder),
            ]
        )
        == 0
    )
    records = json.loads(capsys.readouterr().out)
    speeds = {(r["at"][mass], r["at"]["conicity"]): r["linear"]["speed"] for r in records}
    assert len(speeds) == 4
    assert speeds[25e3, 0.1] > speeds[45e3, 0.1] > 1.2 * speeds[25e3, 0.2] > speeds[45e3, 0.2]
    assert (folder / "critical_speed.png").stat().st_size > 1000


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.further
def test_conicity_over_amplitude_stands_beside_the_critical_speed(capsys):
    """On given cones it is gamma (b0 + R gamma)/(b0 - r0 gamma) at all amplitudes but the largest.

    A cone 1:10 touches the 60E1 where the radius R of its head is 80 mm.
    """
    assert (
        main(
            [
                "critical-speed",
                "coach_manchester",
                "--method",
                "linear",
                "--conicity",
                "0.1",
                "--json",
                "--quiet",
            ]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)["conicity_over_amplitude"]
    near = [g for a, g in zip(found["amplitude"], found["conicity"], strict=True) if a < 4e-3]
    expected = 0.1 * (0.75 + 0.08 * 0.1) / (0.75 - 0.46 * 0.1)
    assert near == pytest.approx([expected] * len(near), rel=5e-3)
    assert len(near) > 10


def test_picture_of_a_short_wagon_in_a_curve_has_its_whole_title(monkeypatch):
    monkeypatch.setattr(curving, "SETTLING", 1.0)  # whatever the state
    monkeypatch.setattr(curving, "SAMPLED", 0.1)
    found = railsim.curving(railsim.load_vehicle("wagon_uic_link"), radius=[300.0])
    assert "cant 150 mm (outer rail higher)" in found.title  # in curves of either hand
    figure = found.plot()
    figure.draw_without_rendering()
    for axes in figure.get_axes():
        for title in (axes.title, axes._left_title):
            assert title.get_window_extent().x1 <= figure.bbox.x1


@pytest.mark.parametrize(("smallest", "words"), [(50.0, "unstable at its lower end"), (60.0, "")])
def test_the_lower_end_of_the_search_is_no_critical_speed_over_amplitude(smallest, words):
    """Unstable at 50 m/s, where the search begins: from which speed on is not known."""
    where = {"rails": "", "friction": "", "law": "", "linear_law": ""}
    found = critical_speed.CriticalSpeed(Contact(), conditions=where, low=50.0, high=120.0)
    found.linear_over_amplitude = critical_speed.OverAmplitude([1e-4, 3e-3], [smallest, 70.0])
    (row,) = (row for row in found.table().rows if "over amplitude" in row[0])
    assert row[1] == (None if words else smallest)
    assert row[-1] == words


def test_above_the_speed_of_a_derailment_nothing_is_said_of_hunting():
    """A bogie without its car derails above 8 m/s: what lies above, to 60 m/s, was not seen."""
    where = {"rails": "", "friction": "", "law": "", "linear_law": ""}
    found = critical_speed.CriticalSpeed(Contact(), conditions=where, low=5.0, high=60.0)
    found.branches = [Branch("up", [Point(5.0, 0.0, np.nan), Point(8.23, 0.0, np.nan)])]
    found.nonlinear = {"bifurcation": None}
    coach = railsim.load_vehicle("coach_manchester")
    begins = SimpleNamespace(Q0=np.full((4, 2), 7e4), already=False, parameter=10.0)
    critical_speed._conclude(found, coach, begins, begins)
    words = {row[0].split()[0]: row[-1] for row in found.table().rows}
    assert words["non-linear,"] == "none up to 8.23 m/s"
    assert words["amplitude"] == words["rms"] == "not reached up to 8.23 m/s"
    assert found.record()["nonlinear"]["searched_to"] == 8.23


def test_what_fails_on_rigid_rails_takes_no_critical_speed_on_others(monkeypatch):
    """Cones of 1:5 rest on the gauge corner, and on rigid rails no equilibrium was found there."""
    whole = critical_speed.LinearVehicle

    def prepared(vehicle, track, **how):
        if track.support.preset == "rigid":
            raise ModelError("no static equilibrium")
        return whole(vehicle, track, **how)

    monkeypatch.setattr(critical_speed, "LinearVehicle", prepared)
    coach = railsim.load_vehicle("coach_manchester")
    found = railsim.critical_speed(coach, methods="linear", low=35.0, high=45.0)
    assert found.linear.speed == pytest.approx(39.75, abs=0.1)
    assert found.linear.speed_on_rigid_rails is None
    assert "on rigid rails: no static equilibrium" in found.remarks


def test_a_map_names_the_cones_that_all_its_points_have():
    """Without them the speeds would be read as those of the vehicle's own wheels."""
    record = {"linearisation": "tangent", "amplitude": None, "linear": {"speed": 60.0}}
    same = [record | {"conicity": 0.1}] * 2
    assert [*map_speeds(same)] == ["linear, tangent, cones of 0.1"]
    assert [*map_speeds([record | {"conicity": g} for g in (0.1, 0.2)])] == ["linear, tangent"]
    assert [*map_speeds([record | {"conicity": None}])] == ["linear, tangent"]


def test_speed_to_which_a_limit_was_not_reached_is_that_to_which_motions_were_followed():
    followed = Branch("continuation", [Point(40.0, 1e-4, 4.5), Point(45.0, 1.8e-3, 4.7)])
    where = {"rails": "", "friction": "", "law": "", "linear_law": ""}
    found = critical_speed.CriticalSpeed(Contact(), conditions=where, low=5.0, high=120.0)
    found.branches, found.nonlinear = [followed], {"continuation": followed.points[0]}
    coach = railsim.load_vehicle("coach_manchester")
    begins = SimpleNamespace(Q0=np.full((4, 2), 7e4), already=False, parameter=40.0)
    critical_speed._conclude(found, coach, begins, begins)
    words = {row[0]: row[-1] for row in found.table().rows if "above" in row[0]}
    assert words == {"amplitude above 3 mm": "not reached up to 45 m/s"}  # no force is known


def test_a_map_says_how_many_points_have_no_critical_speed():
    axes = map_figure({"conicity": [0.1, 0.2]}, {"linear": np.array([70.0, np.nan])}, "").axes[0]
    assert axes.get_title(loc="left").startswith("1 of 2 points: no critical speed")
    assert axes.get_ylim()[1] > 70.0


def test_picture_of_curving_has_the_guiding_force_outwards_with_its_sign():
    """Magnitudes were drawn: a wheel that is pulled off its rail looked like one that guides."""
    wheels, sets, each = np.zeros((2, 1, 1, 1, 2)), np.zeros((2, 1, 1, 1)), np.zeros((2, 1, 1))
    Y = wheels.copy()
    Y[0, ..., 1], Y[1, ..., 0] = 5e3, 2e3  # to the right: outwards in a left-hand curve alone
    grid = np.array([-300.0, 300.0]), np.array([0.0]), np.array([0.2])
    of_wheels = wheels, Y, wheels, wheels, wheels, wheels
    found = curving.Curving(
        *grid, 0.15, each[..., 0], each.astype(int) + 1, *of_wheels, sets, sets, sets, sets, each,
        ("axle",), (), (0.0,), "wagon",
    )  # fmt: skip
    (axes,) = (ax for ax in found.plot().axes if "guiding force" in ax.get_title(loc="left"))
    drawn = axes.lines[0].get_ydata()
    np.testing.assert_allclose(drawn[np.isfinite(drawn)], [5.0, -2.0])
    titles = [ax.get_title(loc="left") for ax in found.plot().axes]
    assert "lateral displacement (mm), friction 0.2, cant deficiency 0 mm" in titles


def test_curving_over_a_grid(capsys, tmp_path):
    folder = tmp_path / "curving"
    assert (
        main(
            [
                "curving",
                "coach_manchester",
                "--radius",
                "300,-600",
                "--cant-deficiency",
                "0,0.1",
                "--friction",
                "0.3",
                "--out",
                str(folder),
                "--json",
                "--quiet",
            ]
        )
        == 0
    )
    record = json.loads(capsys.readouterr().out)
    assert record["converged"] == [[[1], [1]], [[1], [1]]]
    assert record["dims"]["Q"] == ["radius", "cant_deficiency", "friction", "wheelset", "side"]
    attack = record["attack"]
    # the leading wheelset points outwards, to the left in a right-hand curve
    assert attack[0][0][0][0] < 0.0 < attack[1][0][0][0]
    assert record["speed"][0][0] == pytest.approx((9.81 * 300.0 * 0.15 / 1.5) ** 0.5)
    assert (folder / "curving.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["critical-speed", "coach_manchester", "--from", "60", "--to", "50"], "--from"),
        (["critical-speed", "coach_manchester", "--to", "500"], "--to"),
        (["critical-speed", "coach_manchester", "--friction", "a"], "--friction"),
        (["critical-speed", "coach_manchester", "--friction", "0,4"], "--friction: found 4; "),
        (
            ["critical-speed", "coach_manchester", "--method", "bifurcation", "--points", "1"],
            "--points: found 1",
        ),
        (
            ["critical-speed", "coach_manchester", "--points", "5"],
            "--points goes with --method bifurcation or all",
        ),
        (
            ["critical-speed", "coach_manchester", "--method", "linear", "--excitation", "0.002"],
            "--excitation goes with --method ramp, bifurcation or all",
        ),
        (
            ["critical-speed", "coach_manchester", "--amplitude", "0.003"],
            "--amplitude goes with --linearisation harmonic",
        ),
        (["critical-speed", "coach_manchester", "--excitation", ""], "--excitation: found ''"),
        (["critical-speed", "coach_manchester", "--over", "friction"], "--over"),
        (
            ["critical-speed", "coach_manchester", "--over", "track.nothing=1:2:2"],
            "--over: nothing",
        ),
        (
            [
                "critical-speed",
                "coach_manchester",
                "--friction",
                "0.1",
                "--over",
                "track.friction=0.2,0.3",
            ],
            "--over: track.friction: given twice; each key once, or by its option",
        ),
        (
            [
                "critical-speed",
                "coach_manchester",
                "--friction",
                "0.2,0.3",
                "--conicity",
                "0.1,0.2",
                "--over",
                "vehicle.bodies.carbody.mass=2e4,3e4",
            ],
            "two at most",
        ),
        (["curving", "coach_manchester", "--radius", "5"], "--radius"),
        (["curving", "coach_manchester", "--radius", "inf"], "--radius"),
        (["curving", "coach_manchester", "--radius", "300", "--cant", "1"], "--cant"),
        (
            ["curving", "coach_manchester", "--radius", "300", "--cant-deficiency", "-0.15"],
            "--cant-deficiency",
        ),
        (["curving", "coach_manchester", "--radius", "300", "--friction", "-1"], "--friction"),
    ],
)
def test_wrong_input_is_told_in_a_line(capsys, arguments, words):
    assert main([*arguments, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


def test_gauge_widening_is_left_out_of_steady_curving_with_a_remark():
    """A run on it sees a greater gauge, steady curving does not."""
    track = railsim.load_track("straight", ["gauge_widening=[[0.0, 0.01]]"])
    found = railsim.curving(railsim.load_vehicle("coach_manchester"), track, radius=[500.0])
    assert any("left out" in one and "gauge widening" in one for one in found.remarks)


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [("straight", [], None),
     ("curve_r250", [], "curves, cant and gradients of the track"),
     ("straight", ["cant=[{type='CST',length=1e4,cant=0.05}]"], "curves, cant and gradients"),
     ("straight", ["vertical=[{type='CST',length=1e4,gradient=0.01}]"], "curves, cant and gr"),
     ("straight", ["irregularities=[{type='dip',s=9.0,length=2.0,depth=6e-3}]"], "irregularities")],
)  # fmt: skip
def test_curves_and_irregularities_of_a_track_are_left_out_with_a_remark(name, values, words):
    """Modes are those of straight, smooth track, on whatever line."""
    track = railsim.load_track(name, values)
    found = railsim.modes(railsim.load_vehicle("coach_manchester"), track, speed=35.0)
    said = [one for one in found.remarks if "left out" in one]
    assert [words in one for one in said] == ([True] if words else [])


def test_friction_and_support_are_those_at_the_beginning_of_the_track():
    """What they are further on counts for nothing, and is said."""
    coach, plain = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    soft = [[-50.0, 2.0, 2.0], [50.0, 0.4, 0.4], [51.0, 5.0, 5.0]]
    tables = {"friction_table": [[-10.0, 0.5], [10.0, 0.1]]}
    varied = plain.replace(support={"preset": "ballasted", "variation": soft}, **tables)
    same = plain.replace(
        support={"preset": "ballasted", "variation": [[0.0, 1.2, 1.2]]}, friction=0.3
    )
    found, wanted = (railsim.modes(coach, track, speed=35.0) for track in (varied, same))
    values, expected = ([mode.eigenvalue for mode in one.modes] for one in (found, wanted))
    assert values == pytest.approx(expected, rel=1e-6, abs=1e-6)
    curves, expected = (railsim.curving(coach, track, radius=[500.0]) for track in (varied, same))
    np.testing.assert_allclose(curves.Y, expected.Y, rtol=1e-6)
    for remarks in (found.remarks, curves.remarks):
        (said,) = [one for one in remarks if "left out" in one]
        assert "friction that varies" in said
        assert "support that varies" in said
    assert not any("left out" in one for one in wanted.remarks)


def test_controllers_and_given_forces_are_left_out_with_a_remark(tmp_path):
    """The actuator of the controller gets no command: modes are those of the vehicle without it."""
    law = tmp_path / "skyhook.py"
    law.write_text("def skyhook(time, v):\n    return -20e3 * v\n")
    passive = railsim.load_vehicle("coach_manchester")
    data = passive.model_dump(exclude_none=True)
    up = {"points": [[9.5, 0.0, -1.1], [9.5, 0.0, -0.6]], "bodies": ["carbody", "front.frame"]}
    wind = {"bodies": ["carbody"], "point": [0.0, 0.0, -2.0], "force_table": [[0.0, 0.0, 2e4, 0.0]]}
    data["elements"] = {
        "damper": {"kind": "actuator", **up},
        "wind": {"kind": "applied_force", **wind},
    }
    data["laws"] = {"skyhook": {"file": str(law)}}
    data["signals"] = {"v": {"quantity": "velocity", "body": "carbody", "axis": "z"}}
    data["controllers"] = {
        "skyhook": {"law": "skyhook", "period": 5e-3, "inputs": {"v": "v"}, "outputs": ["damper"]}
    }
    active = railsim.Vehicle.model_validate(data)
    found = railsim.modes(active, speed=20.0)
    for remarks in (found.remarks, railsim.curving(active, radius=[500.0]).remarks):
        (said,) = [one for one in remarks if "left out" in one]
        assert "controllers" in said
        assert "applied forces" in said
    bounce = railsim.modes(passive, speed=20.0)["car body bounce"].eigenvalue
    assert found["car body bounce"].eigenvalue == pytest.approx(bounce)


def test_instability_limit_is_that_of_the_category():
    """Half of k1 (10 kN + 2 Q0/3), k1 0.85 for freight; 2 Q0 the load of the lightest axle."""
    for name, k1 in (("coach_manchester", 1.0), ("wagon_y25", 0.85)):
        vehicle = railsim.load_vehicle(name)
        axles = railsim.static_loads(vehicle).axle_load
        uneven = np.outer(axles / 2.0, [0.9, 1.1])
        limit = 0.5 * k1 * (10e3 + min(axles) / 3.0)
        assert critical_speed._unstable_force(vehicle, uneven) == pytest.approx(limit)


def test_steady_curving_in_time_has_neither_given_forces_nor_a_speed_profile(monkeypatch):
    """Where Newton's method fails, the run on the circle finds what Newton's would have found."""
    data = railsim.load_vehicle("coach_manchester").model_dump(exclude_none=True)
    wind = {"bodies": ["carbody"], "point": [0.0, 0.0, -2.0], "force_table": [[0.0, 0.0, 2e4, 0.0]]}
    data["elements"] = {"wind": {"kind": "applied_force", **wind}}
    windy = railsim.Vehicle.model_validate(data)
    slow = {"mode": "table", "speed_table": [[0.0, 5.0], [100.0, 5.0]]}
    how = {"radius": [500.0], "cant": 0.1, "cant_deficiency": [0.05]}
    found = railsim.curving(windy, settings=railsim.Settings(drive=slow), **how)
    assert found.converged.item() == curving.NEWTON

    def fails(*_, **__):
        raise NotConverged("no steady state")

    monkeypatch.setattr(curving, "follow", fails)
    in_time = railsim.curving(windy, settings=railsim.Settings(drive=slow), **how)
    assert in_time.converged.item() == curving.TIME
    np.testing.assert_allclose(in_time.Y, found.Y, atol=50.0)


def test_friction_of_the_rails_is_not_refused_as_an_option(monkeypatch):
    """A track may be without friction; `stationary`, which has no such option, named --friction."""

    def searched(*_):
        raise ModelError("searched")

    monkeypatch.setattr(curving, "_Search", searched)
    track = railsim.load_track("straight", ["friction=0.0"])
    with pytest.raises(ModelError, match="searched"):
        railsim.curving(railsim.load_vehicle("coach_manchester"), track, radius=[1000.0])


def test_a_cant_deficiency_in_millimetres_is_refused(capsys):
    """1 m is 6.5 m/s2, beyond what any vehicle stands upright in."""
    given = ["curving", "coach_manchester", "--radius", "300", "--cant-deficiency", "0.1,100"]
    assert main(given) == 2
    words = "--cant-deficiency: found 100 m with a cant of 0.15 m; 1 m at most: 0.1 is 100 mm"
    assert words in capsys.readouterr().err


def test_a_map_tells_stable_points_from_those_unstable_throughout():
    """Both have no linear critical speed in the range."""
    points = [(None, False), ({"speed": 41.0}, False), (None, True)]
    records = [
        {"at": {"conicity": k}, "linear": linear, "nonlinear": None, "searched": [20.0, 80.0],
         "unstable_at_low": low}
        for k, (linear, low) in enumerate(points)
    ]  # fmt: skip
    records.append({"at": {"conicity": 9}, "linear": None, "nonlinear": None, "remarks": ["no"]})
    mass = [{**record, "at": {"vehicle.mass": 3e4}} for record in records]
    assert "vehicle.mass (kg)" in str(map_table(mass, {"vehicle.mass": "kg"}))
    rows = map_table(records, {"conicity": ""}).rows
    assert [row[-1] for row in rows] == [
        "none to 80 m/s", "", "unstable at 20 m/s", "not computed"
    ]  # fmt: skip
    # of several cones that which alone has a speed is not that of the column
    one = {"linearisation": "tangent", "conicity": 1, **records[1]}
    assert list(map_speeds([one, records[-1]])) == ["linear, tangent"]
    assert list(map_speeds([{**one, "at": {}}])) == ["linear, tangent, cones of 1"]


def test_a_point_of_a_map_without_a_solution_is_named(monkeypatch):
    def fails(*_, **__):
        raise ModelError("no static equilibrium")

    monkeypatch.setattr(stability_map, "critical_speed", fails)
    point = SimpleNamespace(values={"conicity": 0.2}, vehicle=None, track=None, settings=None)
    (remark,) = stability_map.point_record(point, {})["remarks"]
    assert remark == "conicity 0.2: no static equilibrium"
