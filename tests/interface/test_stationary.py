"""`railsim stationary`: values computed apart from this program, verdicts, bad input."""

import json

import numpy as np
import pytest

import railsim
import railsim.studies.stationary
from railsim.cli import main
from railsim.definitions.loading import load_stationary_limits
from railsim.linear.circle import circle
from railsim.linear.stationary import WALKING_PACE, TwistLoop
from railsim.linear.steady import NotConverged
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.plot.stability import twist_figure
from railsim.stability.curving import curving
from railsim.studies.stationary import (
    LIFTED,
    UNLOADING,
    Stationary,
    StationaryValue,
    _force,
    stationary,
)

COACH = ["stationary", "benchmark_vehicle1", "--cant", "0.1"]


@pytest.fixture
def guided():
    """Guiding forces are given: they take two thirds of the time, and the test is about others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(railsim.studies.stationary, "_force", lambda *_: 10e3)
        patch.setattr(railsim.studies.stationary, "_quotient", lambda *_: 0.8)
        yield


@pytest.fixture
def by_newton():
    """Steady curving is that of Newton's method also where it is unstable."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(railsim.stability.curving, "GROWS", np.inf)
        yield


@pytest.mark.usefixtures("by_newton")
def test_values_of_the_benchmark_coach(capsys):
    """Q3, Q4 (`tests/verification/test_steady_curving.py`): 0.1781 on 7 permille, 0.1387 on 53 mm.

    Unloading is proportional to the twist: 7 - 5/2.56 = 5.047 permille instead of 7.
    """
    assert main([*COACH, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    values = {(v["case"].split()[0], v["quantity"].split()[0]): v for v in found["values"]}
    on_twists = [v["value"] for v in found["values"] if "twist" in v["case"]]
    # 15/19 + 2 = 2.789 permille over 19 m are 52.99 mm
    bogie = 0.1781 * (7.0 - 5.0 / 2.56) / 7.0
    assert on_twists[:3] == pytest.approx([bogie, 0.1387, bogie + 0.1387], rel=1e-2)
    assert values["cant", "roll"]["value"] == pytest.approx(0.1899, rel=5e-3)
    slope = 0.1 / 1.5
    assert values["cant", "angle"]["value"] == pytest.approx(slope * 1.1899, rel=2e-3)
    # guiding: the force of steady curving at walking pace over the least load on both twists
    steady = curving(
        railsim.load_vehicle("benchmark_vehicle1"),
        radius=[-150.0],
        cant=0.0,
        cant_deficiency=[1.5 / 9.81 / 150.0],
        track=railsim.load_track("straight"),
    )
    Q = 0.25 * steady.Q.sum() / 2.0 * (1.0 - on_twists[2])
    guiding = next(v for v in found["values"] if v["case"] == "R 150 m, level")
    assert guiding["value"] == pytest.approx(steady.Y.reshape(-1, 2)[0, 1] / Q, rel=5e-3)
    assert guiding["limit"] == 1.2
    combined = next(v for v in found["values"] if v["quantity"] == "guiding Y/Q, combined")
    # the force of the level curve over a load between that of the level curve and the least one
    assert steady.Y.reshape(-1, 2)[0, 1] / steady.Q.reshape(-1, 2)[0, 1] < combined["value"]
    assert combined["value"] < guiding["value"]
    assert found["verdict"] == "pass"
    assert not any(v["checked"] for v in found["values"])


@pytest.mark.usefixtures("guided")
def test_exceeded_limit_fails(tmp_path, capsys):
    limits = tmp_path / "mine.toml"
    limits.write_text('extends = "stationary"\nunloading = { value = 0.13, source = "mine" }\n')
    assert main([*COACH, "--limits", str(limits), "--fail", "--out", str(tmp_path / "out")]) == 4
    shown = capsys.readouterr().out
    assert "verdict: fail" in shown
    record = json.loads((tmp_path / "out" / "stationary.json").read_text())
    assert [v["exceeded"] for v in record["values"][:3]] == [False, True, True]


def test_both_branches_of_a_wagon_are_told_and_drawn(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["stationary", "wagon_uic_link_empty", "--out", str(out), "--fail"]) == 4
    shown = capsys.readouterr().out
    assert "on level track, twist rising" in shown
    assert "on level track, twist falling" in shown
    record = json.loads((out / "stationary.json").read_text())
    (loop,) = record["loops"].values()
    # 0.598 without friction; the loop begins at level track and ends where the twist is full again
    assert record["values"][0]["value"] > 0.6
    assert loop["share"][-1] == 1.0 > loop["share"][0]
    assert len(loop["Q"]) == len(loop["share"])
    assert (out / "stationary.png").stat().st_size > 5000


def test_the_picture_of_a_twist_begins_on_level_track_with_no_wheel_unloaded():
    """60 kN on level track: 54 and 48 kN on half and on the whole twist are 0.1 and 0.2 less."""
    share, less = np.array([0.5, 1.0, 0.5, 0.0]), np.array([6e3, 12e3, 9e3, 3e3])
    Q = 60e3 + less[:, None, None] * np.array([[0.5, -1.0], [1.0, -0.5]])
    figure = twist_figure({"bogie": TwistLoop(share, Q, np.full((2, 2), 60e3))}, 0.6, "coach")
    assert figure.axes[0].get_title(loc="left") == "bogie,\nwheelset 1 right"
    drawn = figure.axes[0].lines[0].get_xydata()
    expected = [(0.0, 0.0), (50.0, 0.1), (100.0, 0.2), (50.0, 0.15), (0.0, 0.05)]
    assert drawn == pytest.approx(np.array(expected))


@pytest.mark.usefixtures("guided")
def test_a_value_that_exceeds_its_limit_does_not_read_like_it():
    values = [
        StationaryValue("cant", "guiding Y/Q", 1.20004, 1.2, "wheelset 1 outer"),
        StationaryValue(
            "cant", "angle of the floor", np.radians(8.6), np.radians(8.599), "carbody"
        ),
    ]
    found = Stationary("coach", "EN 14363", True, tuple(values), ())
    assert found.verdict == "fail"
    assert [row[3:] for row in found.table().texts()] == [
        ["1.20004", "1.200"],
        ["8.600 deg", "8.60 deg"],
    ]


def test_limit_in_the_picture_has_its_value():
    figure = stationary(
        railsim.load_vehicle("coach_manchester"),
        railsim.load_track("straight"),
        load_stationary_limits("stationary"),
    ).plot()
    assert all(axes.texts[0].get_text() == "limit 0.6" for axes in figure.axes)


@pytest.mark.usefixtures("guided")
def test_load_to_one_side_is_leant_to_its_own_side():
    """The mirror image has the same worst wheel on the other side, and the same roll coefficient.

    Leaning takes as much load off the far wheels as without the offset, of a smaller static load.
    """
    found = {}
    for y in (0.08, 0.0, -0.08):
        coach = railsim.load_vehicle("benchmark_vehicle1", [f"bodies.carbody.position.1={y}"])
        on, limits = railsim.load_track("straight"), load_stationary_limits("stationary")
        found[y] = stationary(coach, on, limits, cant=0.1).values[-3:]
    unloading, angle, roll = ({y: values[k].value for y, values in found.items()} for k in range(3))
    assert unloading[-0.08] == pytest.approx(unloading[0.08], rel=1e-3)
    assert roll[-0.08] == pytest.approx(roll[0.08], rel=1e-3)
    assert angle[-0.08] == pytest.approx(angle[0.08], rel=1e-3)
    assert {found[y][0].place.split()[-1] for y in (0.08, -0.08)} == {"left", "right"}
    # the offset takes m g y/(4 1.5 m) off the static load Q0 to which unloading refers
    Q0 = float(railsim.static_loads(coach).axle_load.mean()) / 2.0
    lighter = Q0 - 32000.0 * 9.81 * 0.08 / (4.0 * 1.5)
    assert unloading[0.08] == pytest.approx(unloading[0.0] * Q0 / lighter, rel=0.02)


@pytest.mark.usefixtures("guided", "small_contact_tables")
def test_a_vehicle_whose_ends_differ_is_said_to_be_tested_with_one_of_them_ahead():
    """Metro trailer with its body 0.8 m off: guiding 0.895 or 0.983, whichever end leads."""
    on, limits = railsim.load_track("straight"), load_stationary_limits("stationary")

    def said(*changes):
        metro = railsim.load_vehicle("metro_b_trailer", changes)
        remarks = stationary(metro, on, limits, cant=0.1).remarks
        return any("turned round" in remark for remark in remarks)

    assert said("bodies.carbody.position.0=0.8")
    assert not said("bodies.carbody.position.1=0.05")  # to one side: both hands are tested
    assert not said()


@pytest.mark.usefixtures("by_newton")
@pytest.mark.parametrize(
    ("vehicle", "friction"), [([], (0.5, 0.2)), (["bodies.carbody.position.1=0.08"], (0.4, 0.4))]
)
def test_guiding_takes_the_worse_of_both_hands(vehicle, friction):
    """A load to one side, or unequal rails, and the mirror image give the same, the worse hand.

    In the level curve that is the larger of the forces of steady rolling to either hand.  With
    unequal rails a run leaves that state for one beside it, 0.3 % away, which curving would take.
    """
    on, limits = railsim.load_track("straight"), load_stationary_limits("stationary")
    mirrored = [text.replace("=0.08", "=-0.08") for text in vehicle]
    guiding = []
    for texts, mu in ((vehicle, friction), (mirrored, friction[::-1])):
        coach, rails = railsim.load_vehicle("benchmark_vehicle1", texts), on.replace(friction=mu)
        found = stationary(coach, rails, limits, cant=0.1)
        guiding.append([v.value for v in found.values if v.quantity.startswith("guiding")])
    load = min(float(loop.Q[:, 0].min()) for loop in found.loops.values())
    deficiency = [1.5 / 9.81 / 150.0]
    hands = curving(
        coach, radius=[150.0, -150.0], cant=0.0, cant_deficiency=deficiency, track=rails
    )
    right, left = -hands.Y[0, 0, 0, 0, 0], hands.Y[1, 0, 0, 0, 1]
    assert guiding[1][0] == pytest.approx(max(right, left) / load, rel=2e-3)
    assert guiding[0] == pytest.approx(guiding[1], rel=1e-3)


def test_guiding_with_a_wheel_that_twist_lifts_is_no_pass(monkeypatch):
    """Held wheelsets are drawn down by their rails: Y over a load below zero is below any limit.

    What no steady state is found for does not hide that another curve exceeds the limit.
    """
    stiff = ["assemblies.bogie.assemblies.axle.elements.primary.stiffness=[31e6, 1e6, 20e6]"]
    coach = railsim.load_vehicle("coach_manchester", stiff)
    track, limits = railsim.load_track("straight"), load_stationary_limits("stationary")
    low = limits.guiding.model_copy(update={"value": 0.7})
    on_level = railsim.studies.stationary.on_twist

    def only_level(*place, curvature):
        if np.any(place[2]) and curvature < 0.0:
            raise NotConverged("no steady state was found")
        return on_level(*place, curvature=curvature)

    monkeypatch.setattr(railsim.studies.stationary, "on_twist", only_level)
    found = stationary(coach, track, limits.model_copy(update={"guiding": low}))
    level, combined = (v for v in found.values if v.quantity.startswith("guiding"))
    assert max(v.value for v in found.values if "permille" in v.case and v is not combined) > 1.0
    assert level.value == np.inf
    assert level.exceeded
    assert combined.exceeded
    assert "no load" in str(found.table())
    assert any("the wheel lifts" in remark for remark in found.remarks)


@pytest.mark.usefixtures("guided")
def test_case_without_steady_state_is_no_pass(monkeypatch):
    def never(*_, **__):
        raise NotConverged("no steady state was found")

    monkeypatch.setattr(railsim.studies.stationary, "on_cant", never)
    found = stationary(
        railsim.load_vehicle("benchmark_vehicle1"), railsim.load_track("straight"),
        load_stationary_limits("stationary"), cant=0.1,
    )  # fmt: skip
    assert found.verdict == "incomplete"
    assert found.reasons == ("cant 100 mm: no steady state was found",)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--cant", "0.9"], "above 0, up to 0.5 m"),
        (["--cant", "nan"], "above 0, up to 0.5 m"),
        (["--limits", "comfort"], "format"),
        (["--limits", "nothing"], "nothing"),
    ],
)
def test_bad_input_is_told_in_a_line(capsys, arguments, words):
    assert main(["stationary", "coach_manchester", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


def test_without_service_table_a_cant_is_asked_for():
    coach = railsim.load_vehicle("coach_manchester").replace(service=None)
    with pytest.raises(railsim.InputError, match="give `cant`"):
        stationary(coach, railsim.load_track("straight"), load_stationary_limits("stationary"))


@pytest.mark.usefixtures("guided")
def test_check_rails_are_left_out_with_a_remark(capsys):
    assert main([*COACH, "--track", "depot_r150_check_rail"]) == 0
    assert "left out here, where rolling is steady: check rails" in capsys.readouterr().out


@pytest.mark.usefixtures("guided")
def test_support_is_that_at_the_beginning_of_the_track():
    coach, plain = railsim.load_vehicle("benchmark_vehicle1"), railsim.load_track("straight")
    rows = [[0.0, 1.0, 1.0], [20.0, 0.3, 0.3], [40.0, 0.3, 0.3]]
    varied = plain.replace(support={"preset": "ballasted", "variation": rows})
    limits, how = load_stationary_limits("stationary"), {"cant": 0.1, "held": False}
    found, wanted = (stationary(coach, track, limits, **how) for track in (varied, plain))
    assert [v.value for v in found.values] == pytest.approx([v.value for v in wanted.values])
    assert any("support that varies" in one for one in found.remarks)


@pytest.mark.usefixtures("small_contact_tables", "guided")
def test_twisted_rails_of_another_gauge():
    """The same difference of heights: angle and lever each as 1/2 b, the unloading as 1/(2 b)^2.

    The springs stand where they stood; 2 b is 1.500 m at 1435 mm, 1.065 m at 1000 mm.
    """
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.back_to_back"
    limits, unloading, said = load_stationary_limits("stationary"), [], []
    for gauge, backs in ((1.435, 1.360), (1.0, 0.925)):
        coach = railsim.load_vehicle("benchmark_vehicle1", [f"{key}={backs}"])
        track = railsim.load_track("straight", [f"gauge={gauge}"])
        found = stationary(coach, track, limits, cant=0.05)
        unloading.append([v.value for v in found.values if "permille" in v.case])
        said.append("limits are those of 1435 mm, the gauge is 1000 mm" in found.reasons)
        assert found.verdict in (("fail", "incomplete") if gauge == 1.0 else ("fail", "pass"))
    ratio = [metre / normal for normal, metre in zip(*unloading, strict=True)]
    assert ratio == pytest.approx([(1.5 / 1.065) ** 2] * 2, rel=0.02)
    assert said == [False, True]


def test_where_newton_fails_steady_curving_gives_the_same_guiding_force(monkeypatch):
    """Of the leading outer wheel, outwards, in a curve to the left of 150 m."""

    def never(*_, **__):
        raise NotConverged("no steady state was found")

    coach, track = railsim.load_vehicle("benchmark_vehicle1"), railsim.load_track("straight")
    balance = equilibrium(assemble(coach, circle(track), railsim.Settings()), WALKING_PACE)
    given = coach, balance, track, railsim.Settings(), -1.0 / 150.0
    by_newton = _force(*given)
    monkeypatch.setattr(railsim.studies.stationary, "on_twist", never)
    assert _force(*given) == pytest.approx(by_newton, rel=2e-3)
    assert by_newton > 10e3


@pytest.mark.usefixtures("small_contact_tables", "guided")
@pytest.mark.parametrize(("unloading", "lifted"), [(0.999, False), (1.001, True)])
def test_a_wheel_that_hangs_on_its_rail_is_told(monkeypatch, unloading, lifted):
    """More than all of its load is off it."""
    value = StationaryValue("twist", UNLOADING, unloading, None, "wheelset 1 left")
    monkeypatch.setattr(railsim.studies.stationary, "_unloading", lambda *_: [value])
    coach, track = railsim.load_vehicle("benchmark_vehicle1"), railsim.load_track("straight")
    found = stationary(coach, track, load_stationary_limits("stationary"), cant=0.05)
    assert (LIFTED in found.remarks) is lifted
