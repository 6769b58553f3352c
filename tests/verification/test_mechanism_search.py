"""Searches with known answers: limits between the positions, forces by hand, catalogues."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from railsim.definitions.loading import load_mechanism
from railsim.errors import InputError
from railsim.mechanisms import optimisation
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.checks import checks
from railsim.mechanisms.judgement import Judge, Judgement, is_firm
from railsim.mechanisms.kinematics import folded, solve
from railsim.mechanisms.optimisation import FINISH, _least_breach, _rounds, optimise
from railsim.mechanisms.optimum import Start, best_of
from railsim.mechanisms.selection import selection
from railsim.mechanisms.tables import optimum_sentences, optimum_tables
from railsim.mechanisms.tolerance import scatter

# an arm against a torque; the rod's angle at the pin is largest, asin(d/r), within the travel
ARM = """
format = "railsim-mechanism/1"
name = "arm"
[parameters]
r = 0.3
d = 0.1
[ground.points]
hinge = [0.0, 0.0]
foot = ["d", 0.0]
[bodies.arm]
points = { hinge = [0.0, 0.0], pin = ["r", 0.0] }
[joints.hinge]
revolute = ["ground.hinge", "arm.hinge"]
[driver]
angle = "arm"
start = 0.4
end = 2.4
[output]
point = "arm.pin"
[elements.load]
torque = "arm"
size = -100.0
[actuators.lift]
piston = ["ground.foot", "arm.pin"]
[solve]
unknown = "lift"
[angles.mu]
between = [["ground.foot", "arm.pin"], ["ground.hinge", "arm.pin"]]
offset = "pi / 2"
[optimise]
objective = "peak_force"
range = "travel"
sample = "travel"
min_transmission_angle = 0.8726646259971648        # 50 deg
starts = 1
[optimise.bounds]
d = [0.05, 0.25]
"""


@pytest.mark.parametrize("workers", [1, 2])
def test_an_optimum_keeps_its_limits_between_the_positions_too(tmp_path, workers):
    path = tmp_path / "arm.toml"
    path.write_text(ARM)
    best = optimise(load_mechanism(path), starts=4, workers=workers)  # 4: in processes, if several
    # the longest lever with the rod's angle at the pin 40 degrees at most: d = r sin(40 deg);
    # held at 17 positions only it was 0.19291 and the angle 49.982 degrees
    assert best.parameters["d"] == pytest.approx(0.3 * np.sin(np.radians(40.0)), rel=1e-6)
    assert best.feasible
    assert [active.name for active in best.active] == ["mu"]
    fine = solve(best.after.model, np.linspace(0.4, 2.4, 20001))
    assert np.degrees(folded(fine.angle("mu"))).min() > 50.0 - 1e-4
    (check,) = (c for c in checks(best.after) if c.name == "mu")
    assert np.degrees(check.value) == pytest.approx(50.0, abs=1e-5)


@pytest.mark.parametrize(
    ("kind", "travel"),
    [("linear", (1.4, 0.4)), ("constant_force", (0.4, 1.4)), ("peak_force", (1.4, 0.4))],
)
def test_gradients_are_those_of_differences_where_parameters_move_the_output(
    tmp_path, kind, travel
):
    """The zone lies at fixed heights: another arm reaches them at other angles.

    They are counted from where the arm begins, which a parameter turns.
    """
    start, end = travel
    low, high = sorted((start - end) * h for h in (-0.05, -0.15))
    path = tmp_path / "arm.toml"
    head = ARM.partition("[angles.mu]")[0].replace("[ground.points]", "turn = 0.0\n[ground.points]")
    for old, new in (("start = 0.4", start), ("end = 2.4", end)):
        head = head.replace(old, f'{old.partition(" ")[0]} = "{new} + turn"')
    path.write_text(
        head
        + f"[zone]\nlow = {low}\nwork = {low}\nhigh = {high}\n"
        + f'[optimise]\nobjective = "{kind}"\nrange = "zone"\ntarget = 2.0\nslope = 3.0\n'
        + "[optimise.bounds]\nr = [0.2, 0.4]\nd = [0.05, 0.25]\nturn = [-0.1, 0.1]\n"
    )
    judge, x, h = Judge(load_mechanism(path)), np.array([0.31, 0.12, 0.02]), 1e-6
    found = [
        (judge(x + step, {}).objective - judge(x - step, {}).objective) / (2.0 * h)
        for step in h * np.eye(3)
    ]
    judged = judge(x, {})
    assert judged.square_gradient + judged.rivals[0] == pytest.approx(found, rel=1e-6)


def moving_window(tmp_path, tail):
    """The arm turns by 1.4 rad about the middle of its travel, a parameter."""
    head = ARM.partition("[angles.mu]")[0].replace("[ground.points]", "mid = 1.2\n[ground.points]")
    head = head.replace("start = 0.4", 'start = "mid - 0.7"').replace(
        "end = 2.4", 'end = "mid + 0.7"'
    )
    path = tmp_path / "arm.toml"
    path.write_text(head.replace('[output]\npoint = "arm.pin"\n', "") + tail)
    return load_mechanism(path)


def rod(angle, r=0.3, d=0.1):
    """Length of the rod by the law of cosines, and its derivative by the arm's angle [m]."""
    length = np.sqrt(r * r + d * d - 2.0 * r * d * np.cos(angle))
    return length, r * d * np.sin(angle) / length


def test_parameters_that_move_the_travel_are_searched_for_too(tmp_path):
    """The largest force of a window is least where both of its ends need the same."""
    search = '[optimise]\nobjective = "peak_force"\nrange = "travel"\nstarts = 1\n'
    best = optimise(moving_window(tmp_path, search + "[optimise.bounds]\nmid = [0.8, 2.2]\n"))
    alike = brentq(lambda mid: rod(mid - 0.7)[1] - rod(mid + 0.7)[1], 0.8, 2.2)
    assert best.parameters["mid"] == pytest.approx(alike, abs=1e-5)  # was left at 1.2
    assert best.objective == pytest.approx(100.0 / rod(alike - 0.7)[1], rel=1e-5)


def test_a_search_over_the_whole_travel_may_change_how_far_the_output_goes(tmp_path):
    """A shorter arm is better at the end, a longer one at the start; 0.4 m is too long."""
    path = tmp_path / "arm.toml"
    head = ARM.partition("min_transmission")[0].replace("r = 0.3", "r = 0.4")
    path.write_text(head + "starts = 1\n[optimise.bounds]\nr = [0.2, 0.5]\n")
    best = optimise(load_mechanism(path))
    alike = brentq(lambda r: np.subtract(rod(0.4, r=r)[1], rod(2.4, r=r)[1]), 0.2, 0.5)
    assert alike < 0.35
    assert best.parameters["r"] == pytest.approx(alike, rel=1e-5)  # was left at 0.4


def test_a_compromise_is_the_least_broken_between_the_positions_too(tmp_path):
    """The rod's angle at the pin is 90 deg less asin(d/r) at least, the force is largest last."""
    path = tmp_path / "arm.toml"
    path.write_text(ARM.replace("starts = 1", "starts = 1\navailable_force = 1000.0"))

    def breaches(d):
        angle = (np.sin(np.radians(50.0)) ** 2 - 1.0 + (d / 0.3) ** 2) / np.sin(np.radians(100.0))
        return angle, 100.0 / rod(2.4, d=d)[1] / 1000.0 - 1.0

    alike = brentq(lambda d: np.subtract(*breaches(d)), 0.15, 0.25)
    best = optimise(load_mechanism(path))
    assert not best.feasible
    assert best.parameters["d"] == pytest.approx(alike, rel=1e-6)  # held at 17 positions: 6e-6 more
    assert best.starts[0].violation == pytest.approx(breaches(alike)[0], rel=1e-6)


def test_a_compromise_takes_no_gas_spring_beyond_its_stroke(tmp_path):
    """A longer one pushes harder at the end, where most is needed; its stroke is used up."""
    path = tmp_path / "arm.toml"
    head = ARM.replace("d = 0.1", "long = 0.42").replace('"d"', "0.1").partition("min_trans")[0]
    gas = 'gas_spring = ["ground.foot", "arm.pin"]\nF1 = 300.0\nprogression = 1.3\nstroke = 0.25\n'
    head = head.replace("[solve]", f'[elements.gas]\n{gas}extended = "long"\n[solve]')
    head = head.replace('lift]\npiston = ["ground.foot", "arm.pin"]', 'lift]\nturn = "arm"')
    path.write_text(
        f"{head}available_force = 10.0\nstarts = 1\n[optimise.bounds]\nlong=[0.3,0.9]\n"
    )
    best = optimise(load_mechanism(path))  # was refused: it ended beyond the stroke
    assert best.parameters["long"] == pytest.approx(rod(0.4)[0] + 0.25, rel=1e-6)
    push = 300.0 * (1.0 + 0.3 * (best.parameters["long"] - rod(2.4)[0]) / 0.25)
    excess = 100.0 - push * rod(2.4)[1] - 10.0
    assert best.breaches == pytest.approx({"available_force": excess}, rel=1e-5)


def test_of_equal_breaches_the_better_objective_is_the_compromise():
    """A limit that bounds alone break is broken alike, to rounding, wherever a start ends."""
    ends = [(217.0, 0.3), (3.2, 0.3 + 1e-12), (1.0, 0.4), (np.nan, np.nan)]
    starts = [Start(i, {}, {}, *end, 1) for i, end in enumerate(ends)]
    assert best_of(starts).number == 1
    assert best_of([*starts, Start(4, {}, {}, 500.0, 1e-8, 1)]).number == 4


def test_a_search_may_begin_without_friction(tmp_path):
    """The number of constraints does not depend on it; was a traceback."""
    search = 'objective="constant_force",range="travel",points=21,starts=1,available_force=300'
    bounds = "front_F1=[20.0,100.0],rear_friction=[0.0,50.0]"
    definition = load_mechanism(
        "tilting_two_springs", [f"optimise={{{search},bounds={{{bounds}}}}}"]
    )
    best = optimise(definition).parameters
    assert best == pytest.approx({"front_F1": 100.0, "rear_friction": 0.0}, abs=1e-9)


def test_the_multiplier_of_a_peak_at_two_positions_is_that_of_both(tmp_path):
    """What a longer bracket would be worth, when the window is placed anew for it."""

    def least_peak(d):
        rates = lambda mid: [rod(mid + half, d=d)[1] for half in (-0.7, 0.7)]  # noqa: E731
        return 100.0 / rates(brentq(lambda mid: np.subtract(*rates(mid)), 0.8, 2.2))[0]

    search = '[optimise]\nobjective = "peak_force"\nrange = "travel"\nstarts = 1\n'
    bounds = "[optimise.bounds]\nmid = [0.8, 2.2]\nd = [0.05, 0.15]\n"
    best = optimise(moving_window(tmp_path, search + bounds))
    (limit,) = best.active
    assert (limit.name, limit.side) == ("d", "upper")
    worth = (least_peak(0.149) - least_peak(0.151)) / 0.002
    assert limit.multiplier == pytest.approx(worth, rel=1e-4)


def test_tolerances_of_parameters_that_move_the_travel_count(tmp_path):
    found = scatter(moving_window(tmp_path, "[tolerances]\nmid = 0.02\n"))
    single = {one.name: one.single["mid"] for one in found}
    (start, w0), (end, w1) = rod(0.5), rod(1.9)
    assert single["length_start"] == pytest.approx(0.02 * w0)
    assert single["stroke"] == pytest.approx(0.02 * (w1 - w0))  # was 0
    w, h = 100.0 / np.array([rod(1.9 + h)[1] for h in (-1e-6, 1e-6)]), 1e-6
    assert single["force_end"] == pytest.approx(0.02 * (w[1] - w[0]) / (2.0 * h), rel=1e-6)
    assert (found[1].name, found[1].value) == ("stroke", pytest.approx(end - start))


FOUR_BAR = """
format = "railsim-mechanism/1"
name = "four-bar"
[parameters]
coupler = 0.5
[ground.points]
left = [0.0, 0.0]
right = [0.9, 0.0]
foot = [0.2, 0.6]
[bodies.crank]
points = { pin = [0.0, 0.0], end = [0.3, 0.0] }
[bodies.rocker]
points = { pin = [0.0, 0.0], end = [0.4, 0.0] }
[start]
crank = { angle = 2.0 }
rocker = { angle = 2.9 }
[joints.left]
revolute = ["ground.left", "crank.pin"]
[joints.right]
revolute = ["ground.right", "rocker.pin"]
[joints.coupler]
link = ["crank.end", "rocker.end"]
length = "coupler"
[driver]
angle = "crank"
start = 1.2
end = 0.6
[output]
point = "rocker.end"
[actuators.lift]
piston = ["ground.foot", "rocker.end"]
[solve]
unknown = "lift"
[optimise]
objective = "constant"
target = 1.0
range = "travel"
[optimise.bounds]
coupler = [0.4, 0.6]
"""


def test_a_search_keeps_away_from_a_limit_position_of_the_driver(tmp_path):
    """Coupler and rocker in line: the actuator's rate has no end there, and no way back."""
    path = tmp_path / "four_bar.toml"
    path.write_text(FOUR_BAR)
    judge = Judge(load_mechanism(path))
    reach = np.sqrt(0.9**2 + 0.3**2 - 2.0 * 0.9 * 0.3 * np.cos(1.2))
    for longer, kept in ((1e-3, True), (1e-6, False)):
        assert bool(np.min(judge(np.array([reach - 0.4 + longer]), {}).margins) > 0.0) == kept


def test_a_zero_at_one_of_the_positions_is_found_whatever_its_rounding(tmp_path):
    """With crank and base in line the rocker is upright, 3 : 4 : 5, and its mass highest."""
    text = FOUR_BAR
    for old, new in (
        ("right = [0.9, 0.0]\nfoot = [0.2, 0.6]", "right = [0.6, 0.0]\nfoot = [0.1, -0.35]"),
        ("[0.4, 0.0] }", "[0.4, 0.0] }\nmass = 12.0\ncentre = ['0.4 / 2', 0.0]"),
        ("angle = 2.0", "angle = 0.6"),
        ("angle = 2.9", "angle = 1.2"),
        ("start = 1.2\nend = 0.6", "start = 0.6\nend = -1.0"),
        ('piston = ["ground.foot", "rocker', 'piston = ["ground.foot", "crank'),
    ):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "four_bar.toml"
    path.write_text(text)
    found = analyse(load_mechanism(path)).force_zeros  # was a traceback
    assert found[-1] == pytest.approx(0.0, abs=1e-9)


def test_every_position_with_a_value_is_found(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM)
    result = analyse(load_mechanism(path))
    wanted = 1300.0
    found = [row["travel"] for row in result.everywhere("force", wanted)]
    ends = (0.4, 1.2), (1.2, 2.4)  # least force in between
    both = [brentq(lambda angle: 100.0 / rod(angle)[1] - wanted, *pair) for pair in ends]
    assert found == pytest.approx(both)
    assert result.at("force", wanted)["travel"] == found[0]
    assert [row["travel"] for row in result.everywhere("travel", 0.4)] == [0.4]
    with pytest.raises(InputError, match="never reached"):
        result.everywhere("force", 900.0)


@pytest.mark.parametrize(("name", "value", "least"), [("starts", 0, 1), ("seed", -1, 0)])
def test_numbers_of_no_search_are_refused(name, value, least):
    with pytest.raises(InputError, match=f"{name}: found {value}; {least} at least"):
        optimise(load_mechanism("atr95_lift_4"), **{name: value})


def test_the_final_check_decides_whether_a_start_keeps_its_limits(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM.replace("d = [0.05, 0.25]", "d = [0.19287, 0.25]"))
    best = optimise(load_mechanism(path))
    assert not best.feasible  # at 17 positions 0.19287 passes
    gap = np.arcsin(0.19287 / 0.3) - np.radians(40.0)
    assert best.breaches["mu"] == pytest.approx(gap, rel=1e-2)
    assert f"mu by {np.degrees(best.breaches['mu']):.6g} deg" in optimum_sentences(best)[-1]


@pytest.mark.parametrize("high", [0.195, 0.2])
def test_a_bound_within_2_per_cent_of_the_range_is_told_though_a_limit_holds_the_optimum(
    tmp_path, high
):
    """The least angle of 40 degrees ends the arm at 0.3 sin(40) m, below its bound."""
    path = tmp_path / "arm.toml"
    path.write_text(ARM.replace("d = [0.05, 0.25]", f"d = [0.05, {high}]"))
    best = optimise(load_mechanism(path))
    share = (high - 0.3 * np.sin(np.radians(40.0))) / (high - 0.05)
    words = f"d ends {share:.1%} of its range from a bound that does not hold it"
    assert [active.name for active in best.active] == ["mu"]
    assert (words in optimum_sentences(best)) == (share <= 0.02)


def test_before_is_the_file_also_where_it_is_out_of_bounds_or_breaks_a_constraint(tmp_path):
    path = tmp_path / "arm.toml"
    for bounds, low, limits in (
        ("[0.15, 0.19]", 0.15, ""),
        ("[0.05, 0.25]", 0.1, "min_length = 0.25"),
    ):
        path.write_text(
            ARM.replace("[0.05, 0.25]", bounds).replace("starts = 1", f"starts = 1\n{limits}")
        )
        best = optimise(load_mechanism(path))
        assert best.starts[0].begin["d"] == low
        rows = str(optimum_tables(best)[0])
        assert "100 mm" in rows  # was the bound
        first, _, *more = optimum_sentences(best)
        assert any("exclude the file's own 0.1;" in text for text in more) == (not limits)
        assert first.endswith("which breaks constraints") == bool(limits)


def test_printed_parameters_keep_a_limit_to_their_rounding():
    """Lift 4 as printed has 40.0000 degrees, 4e-5 degrees too little."""
    first, *_ = optimum_sentences(optimise(load_mechanism("atr95_lift_4"), starts=1))
    assert "breaks" not in first


def test_the_least_angle_is_that_between_the_positions(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM + "\n[sampling]\npoints = 5\n")
    result = analyse(load_mechanism(path))
    exact = np.pi / 2 - np.arcsin(0.1 / 0.3)
    assert result.min_angles["mu"] == pytest.approx(exact, abs=1e-9)


def test_a_search_weighs_objective_and_breaches():
    """(1 - x)^2 + (2 + y)^2 + max(x + 0.5, 3 y - 1) at 0.

    Breaches count from 0, and ten more where nothing moves.
    """
    slopes, loose = np.zeros((3, 2)), np.zeros(3, dtype=bool)
    for margins, fixed, breach in (
        ([0.2, 0.1, 0.3], loose, 0.0),
        ([0.2, -0.3, -0.1], loose, 0.3),
        ([0.2, -0.3, -0.1], loose | [True, False, False], 0.3),
        ([0.2, -0.3, -0.1], loose | [False, False, True], 10.1),
        ([0.2, -0.3, -1e-8], loose | [False, False, True], 0.3),  # kept, but for round-off
    ):
        judged = Judgement(
            np.array([1.0, 2.0]), np.diag([-1.0, 1.0]),
            np.array([-1.0, 0.5]), np.array([[0.0, 3.0], [1.0, 0.0]]),
            np.array(margins), slopes, firm=fixed,
        )  # fmt: skip
        assert judged.violation == pytest.approx(breach)
        assert judged.objective == pytest.approx(5.5)
        assert judged.square_gradient + judged.rivals == pytest.approx(np.array([[-1.0, 4.0]]))
    names = ("dead_point", "lift_stroke", "max_stroke", "driver_dead_point", "min_force")
    assert [is_firm(name) for name in names] == [True, True, False, True, False]


def test_least_breach_is_found_where_limits_exclude_each_other_or_one_cannot_be_met():
    """x = 3 u.  x >= 2 and x^2 <= 1: where 2 - x = x^2 - 1.  (x - 1)^2 <= -0.5: at x = 1."""

    def judged(margins, slopes):
        slopes = 3.0 * np.array(slopes)[:, None]
        none = np.zeros(1), np.zeros((1, 1))
        return Judgement(*none, *none, np.array(margins), slopes)

    def both(u):
        x = 3.0 * u[0]
        return judged([x - 2.0, 1.0 - x * x], [1.0, -2.0 * x])

    def one(u):
        x = 3.0 * u[0]
        return judged([-0.5 - (x - 1.0) ** 2], [-2.0 * (x - 1.0)])

    begin = np.array([0.05])
    for problem, x, breach in (
        (both, 0.5 * (np.sqrt(13.0) - 1.0), 2.5 - 0.5 * np.sqrt(13.0)),
        (one, 1.0, 0.5),
    ):
        u, found = _least_breach(problem, begin, problem(begin))
        assert 3.0 * u[0] == pytest.approx(x, abs=1e-3)
        assert found.violation == pytest.approx(breach, abs=1e-6)


SPRINGS = """
[actuators.hand]
turn = "arm"
[elements.on]
gas_spring = ["ground.foot", "arm.pin"]
F1 = 300.0
progression = 1.3
stroke = 0.2
extended = 0.4
[elements.back]
gas_spring = ["ground.heel", "arm.pin"]
F1 = 300.0
progression = 1.3
stroke = 0.2
extended = 0.4
[solve]
unknown = "hand"
[[selection]]
element = "on"
catalogue = "made"
[catalogues]
made = [{ name = "A", strokes = [0.2], F1 = [100, 900], F1_tolerance = [[900, 30, 30]] }]
"""


def test_springs_against_each_other_are_worst_at_a_mixed_corner(tmp_path):
    """A weak spring is outdone most by the other one in the warmth; closed form."""
    head = ARM.partition("[elements.load]")[0].replace("d = 0.1", "d = 0.1\n[derived]\nb = '-d'")
    head = head.replace('foot = ["d", 0.0]', 'foot = ["d", 0.0]\nheel = ["b", 0.0]')
    path = tmp_path / "two.toml"
    head = head.replace("start = 0.4", "start = 1.5").replace("end = 2.4", "end = 1.6")
    path.write_text(head + SPRINGS)
    (row,) = selection(analyse(load_mechanism(path)))

    def hand(F1, temperature, angle):
        found = 0.0
        for F, sense in ((F1, 1.0), (300.0, -1.0)):
            length, rate = rod(angle, d=sense * 0.1)
            warm = 1.0 + 0.0036 * (temperature - 20.0)
            found = found - F * warm * (1.0 + 0.3 * (0.4 - length) / 0.2) * rate
        return found

    angles = np.linspace(1.5, 1.6, 1000)
    corners = [hand(F, T, angles) for F in (270.0, 330.0) for T in (-30.0, 80.0)]
    assert row.values["force_lowest"] == pytest.approx(np.min(corners), rel=1e-5)
    assert row.values["force_highest"] == pytest.approx(np.max(corners), rel=1e-5)


def test_the_order_of_strokes_and_tolerances_in_a_row_does_not_matter(tmp_path):
    head = ARM.partition("[elements.load]")[0].replace("d = 0.1", "d = 0.1\n[derived]\nb = '-d'")
    head = head.replace('foot = ["d", 0.0]', 'foot = ["d", 0.0]\nheel = ["b", 0.0]')
    springs = SPRINGS.replace("[0.2]", "[0.3, 0.2, 0.25]")
    springs = springs.replace("[[900, 30, 30]]", "[[900, 40, 40], [350, 30, 30]]")
    path = tmp_path / "two.toml"
    path.write_text(head.replace("start = 0.4", "start = 1.5").replace("2.4", "1.6") + springs)
    (row,) = selection(analyse(load_mechanism(path)))
    assert (row.values["stroke"], row.values["F1_low"]) == (0.2, 270.0)
    path.write_text(path.read_text().replace("[900, 40, 40], [350,", "[200, 20, 20], [250,"))
    (row,) = selection(analyse(load_mechanism(path)))
    assert row.reasons == ("stroke 200 mm", "no tolerance of F1 stated above 250 N")


def test_a_gas_spring_that_does_not_fit_says_by_how_much(tmp_path):
    """Lengths of its line by hand, in mm; what does not fit is written once for each row."""
    head = ARM.partition("[elements.load]")[0].replace("d = 0.1", "d = 0.1\n[derived]\nb = '-d'")
    head = head.replace('foot = ["d", 0.0]', 'foot = ["d", 0.0]\nheel = ["b", 0.0]')
    rows = (
        "strokes = [0.2], F1 = [400, 900]",
        "strokes = [0.001, 0.002], F1 = [100, 900]",
        "strokes = [0.05], F1 = [100, 900]",
        "strokes = [0.2], F1 = [100, 900], extended = [2.0, 0.3]",
    )
    made = ", ".join(f'{{ name = "{k}", {row} }}' for k, row in enumerate(rows))
    path = tmp_path / "two.toml"
    head = head.replace("start = 0.4", "start = 1.5").replace("end = 2.4", "end = 1.6")
    path.write_text(head + SPRINGS.partition("made =")[0] + f"made = [{made}]")
    least, most = sorted(1e3 * rod(angle, d=0.1)[0] for angle in (1.5, 1.6))
    assert [row.reasons for row in selection(analyse(load_mechanism(path)))] == [
        ("F1 300 N is not within 400 to 900 N",),
        (f"stroke {most - least:.1f} mm is needed, 2 mm the largest",),
        (f"compressed by {400.0 - least:.1f} mm, 50 mm at most",),
        (f"{least:.1f} to {most:.1f} mm is no range of its lengths",),
    ]


def test_largest_amount_is_least_on_a_kink():
    """Rosen and Suzuki's problem as a minimax one: least on a kink at (0, 1, 2, -1), where f = -44.

    max(f, f + 10 g_1, f + 10 g_2, f + 10 g_3), C. Charalambous, Math. Programming 12 (1977); raised
    by 100.
    """
    center, square = np.array([-5.0, -5.0, -21.0, 7.0]), np.array([1.0, 1.0, 2.0, 1.0])
    limits = [  # squares, linear parts and numbers of g
        ([1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], 8.0),
        ([1.0, 2.0, 1.0, 2.0], [-1.0, 0.0, 0.0, -1.0], 10.0),
        ([1.0, 1.0, 1.0, 0.0], [2.0, -1.0, 0.0, -1.0], 5.0),
    ]
    a = square + 10.0 * np.array([[0.0] * 4, *(np.array(one[0]) for one in limits)])
    b = center + 10.0 * np.array([[0.0] * 4, *(np.array(one[1]) for one in limits)])
    c = 100.0 - 10.0 * np.array([0.0, *(one[2] for one in limits)])

    def problem(u):
        x = 6.0 * u - 3.0
        none = np.zeros(1), np.zeros((1, 4))
        amounts, slopes = a @ x**2 + b @ x + c, 6.0 * (2.0 * a * x + b)
        return Judgement(*none, amounts, slopes, np.ones(1), np.zeros((1, 4)))

    for u in np.random.default_rng(0).uniform(size=(4, 4)):
        end, found = _rounds(problem, u, problem(u), FINISH)
        assert 6.0 * end - 3.0 == pytest.approx([0.0, 1.0, 2.0, -1.0], abs=1e-4)
        assert found.peak == pytest.approx(56.0, abs=1e-7)


@pytest.mark.parametrize(
    ("before", "after", "taken"),
    [
        ((5.0, 0.0), (4.0, 0.0), True),
        ((5.0, 0.0), (5.0, 0.0), False),
        ((5.0, 0.0), (6.0, 0.0), False),
        ((5.0, 0.0), (4.0, 0.1), False),
        ((5.0, 0.0), (6.0, 0.1), False),
        ((5.0, 0.2), (6.0, 0.1), True),
        ((5.0, 0.2), (4.0, 0.3), False),
        ((5.0, 0.2), (6.0, 0.0), True),
    ],
)
def test_a_round_is_kept_where_it_is_better_and_breaks_no_more(monkeypatch, before, after, taken):
    """Objective, and by how much limits are broken; else it is tried again with fewer steps."""
    tried = []

    def round_of(problem, u, here, steps):
        tried.append(steps)
        return u + 1.0 if len(tried) < 9 else u

    monkeypatch.setattr(optimisation, "_round", round_of)
    monkeypatch.setattr(optimisation, "_least_breach", lambda problem, u, found: (u, found))
    first, second = (SimpleNamespace(objective=o, violation=v) for o, v in (before, after))
    effort = SimpleNamespace(steps=16, rounds=5, gain=0.5)
    u, found = optimisation._rounds(lambda u: second, np.zeros(1), first, effort)
    assert (found is second, u.tolist() != [0.0]) == (taken, taken)
    if not taken:
        assert tried[:3] == [16, 4, 1]
