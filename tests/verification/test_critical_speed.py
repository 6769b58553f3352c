"""Non-linear critical speed: three methods on Cooperrider's bogie and on a coach."""

import re
from dataclasses import replace
from types import SimpleNamespace

import cooperrider
import numpy as np
import pytest
from dynamics import load_track, load_vehicle
from selection import points

import railsim
from railsim.contact import contact_geometry
from railsim.errors import ModelError
from railsim.kernels.support import LMS
from railsim.kernels.system import MAX_PARTS
from railsim.linear.eigenmodes import eigenmodes
from railsim.linear.modes import modes
from railsim.linear.stability_loss import LossOfStability, loss_of_stability
from railsim.linear.system import Linearisation
from railsim.linear.vehicle import Contact, LinearVehicle
from railsim.model.equilibrium import tracks_under
from railsim.plot.stability import bifurcation_figure
from railsim.profiles import load_profile
from railsim.stability import continuation, vehicle_flow
from railsim.stability import motion as motion_of
from railsim.stability import ramp as ramp_of
from railsim.stability.branches import (
    RESOLUTION,
    THRESHOLD,
    Branch,
    Limit,
    Point,
    first_beyond,
    lowest_of,
)
from railsim.stability.continuation import settled_to
from railsim.stability.critical_speed import (
    _by_continuation,
    _by_ramp,
    _remark_range,
    critical_speed,
)
from railsim.stability.diagram import diagram, speeds_about, unresolved
from railsim.stability.motion import OUTPUT_RATE, LeftRange, Stretch
from railsim.stability.ramp import lasts_in_shorter_steps, ramp, sustain
from railsim.stability.result import OF_CONICITY, Conicity, CriticalSpeed, OverAmplitude
from railsim.stability.vehicle_flow import VehicleFlow

CRITICAL = railsim.stability.critical_speed
RIGID = load_track("straight").replace(support={"preset": "rigid"})


def test_ramp_finds_the_fold_of_cooperriders_bogie():
    """N2: 66.69 m/s; a ramp undershoots it, runs at constant speed do not."""
    lowest, branch = ramp(cooperrider.Rolling(), 60.0, 72.0)
    assert lowest.speed == pytest.approx(66.69, abs=0.15)
    assert 1e3 * lowest.amplitude == pytest.approx(9.36, abs=0.15)
    assert lowest.frequency == pytest.approx(3.80, rel=0.01)
    died = min(point.speed for point in branch.points if point.amplitude > 5e-3)
    assert 65.0 < died < lowest.speed
    assert np.all(np.diff(branch.column("speed")) <= 0.0)


def test_diagram_of_cooperriders_bogie_has_two_branches_between_fold_and_bifurcation():
    """N1 at 68 and 70 m/s; upwards nothing hunts below 68.67 m/s, downwards it does to 66.69."""
    speeds = [64.0, 66.0, 68.0, 70.0, 72.0]
    branches = diagram(cooperrider.Rolling(), speeds)
    up, down = branches[:2]
    assert set(speeds) <= {point.speed for point in up.points}
    assert np.all(np.diff(up.column("speed")) > 0.0)
    assert np.all(np.diff(down.column("speed")) < 0.0)
    amplitude = {point.speed: point.amplitude for point in up.points}
    assert max(amplitude[v] for v in (64.0, 66.0, 68.0)) < THRESHOLD
    back = {point.speed: point.amplitude for point in down.points}
    assert 1e3 * back[68.0] == pytest.approx(9.735, rel=5e-3)
    assert 1e3 * back[70.0] == pytest.approx(10.185, rel=5e-3)
    assert back[66.0] < THRESHOLD
    lowest = lowest_of(branches)
    assert lowest.speed == pytest.approx(66.69, abs=0.15)


@pytest.mark.parametrize("wrong", [4.5, 16.0, "5", 1, 201])
def test_a_number_of_speeds_that_is_none_is_refused_before_anything_is_computed(wrong):
    with pytest.raises(railsim.InputError, match=f"points: found {wrong!r}; a whole number, 2"):
        CRITICAL.checked(Contact("tangent", 3e-3, None), ["bifurcation"], 5.0, 120.0, wrong)


@pytest.mark.parametrize(
    ("how", "words"),
    [({"excitations": "3 mm"}, "excitations: found 3 mm m; 1e-05 to 0.02 m"),
     ({"excitations": 0.1}, "excitations: found 0.1 m; 1e-05 to 0.02 m"),
     ({"excitations": [1e-3, None]}, "excitations: found None m"),
     ({"excitations": ()}, "excitations: no size"),
     ({"conicity": "0.1"}, "conicity: found 0.1; 0.005 to 0.6"),
     ({"linearisation": "harmonic", "amplitude": "3 mm"}, "amplitude: found 3 mm m; a positive")],
)  # fmt: skip
def test_arguments_that_are_no_numbers_are_refused(how, words):
    """They ended in comparisons of texts with numbers."""
    with pytest.raises(railsim.InputError, match=words):
        railsim.critical_speed(load_vehicle("coach_manchester"), methods="ramp", **how)


def test_three_quarters_of_a_diagrams_speeds_lie_near_the_linear_critical_speed():
    """12 of 16 from 0.8 to 1.25 times 60 m/s, the others in equal steps above.

    Where a sway is undamped at 40 m/s as long as friction sticks, from 0.8 times that.
    """
    assert speeds_about([40.0, 60.0], 20.0, 120.0, 16)[0] == 32.0
    # 0.45 of the speed among 11 gaps are 4 % of it, among 2 they are 23 %
    assert not unresolved(speeds_about([60.0], 20.0, 120.0, 16), [60.0])
    words = unresolved(speeds_about([60.0], 20.0, 120.0, 4), [60.0])
    assert words.startswith("bifurcation: about 60 m/s, where rest is left, its speeds are 14 m/s")
    speeds = speeds_about([60.0], 20.0, 120.0, 16)
    assert speeds[:12] == pytest.approx(np.linspace(48.0, 75.0, 12))
    assert speeds[12:] == pytest.approx([86.25, 97.5, 108.75, 120.0])


def test_amplitudes_of_the_conicity_are_there_once_each_with_that_of_the_standard():
    """EN 15302 states the conicity at 3 mm; a second equal amplitude would be a step."""
    assert np.all(np.diff(OF_CONICITY) > 0.05e-3)
    assert np.any(np.isclose(OF_CONICITY, 3e-3, rtol=1e-12))


def test_conicities_of_all_amplitudes_in_the_picture_are_in_it():
    """Without a branch amplitudes reach to 6 mm."""
    over = Conicity("front", [3e-3, 6e-3, 7e-3], [0.1, 0.2, 0.9])
    where = {"rails": "rigid", "friction": "0.4", "law": "of runs", "linear_law": "smooth"}
    found = CriticalSpeed(Contact("tangent", 3e-3, None), "x", where, conicity_over_amplitude=over)
    axes = bifurcation_figure(found).axes[1]
    assert axes.get_ylim() == (0.0, 6.0)
    assert axes.get_xlim() == pytest.approx((0.0, 1.1 * 0.2))


def test_picture_of_a_vehicle_unstable_at_the_lower_end_says_so():
    """It denied a critical speed, drew the lower end as one, and named the law of runs."""
    line = OverAmplitude([1e-4, 1e-3, 2e-3], [5.0, 7.0, None], [None, 2.0, None])
    where = {"rails": "rigid", "friction": "0.4", "law": "of runs", "linear_law": "smooth"}
    found = CriticalSpeed(Contact("tangent", 3e-3, None), "x", where, low=5.0, high=90.0)
    found.unstable_at_low, found.linear_over_amplitude = True, line
    figure = bifurcation_figure(found)
    assert "friction 0.4, smooth" in figure.get_suptitle()
    assert figure.get_suptitle().endswith("unstable at 5 m/s, the lower end of the range")
    (drawn,) = figure.axes[0].lines
    np.testing.assert_array_equal(drawn.get_xdata(), [np.nan, 7.0, np.nan])


def test_frequencies_of_a_ramp_are_drawn_where_not_every_piece_has_one():
    """At 1.2 Hz every fourth piece of 1 s has two periods; points between gaps were no line."""
    rows = zip((23.0, 22.0, 21.0, 20.0, 19.0), (1.3, np.nan, 1.2, np.nan, 1.1), strict=True)
    branch = Branch("ramp", [Point(speed, 6e-3, frequency) for speed, frequency in rows])
    where = {"rails": "rigid", "friction": "0.4", "law": "fastsim"}
    found = CriticalSpeed(Contact("tangent", 3e-3, None), "x", where, branches=[branch])
    drawn = bifurcation_figure(found).axes[1].lines[0]
    assert drawn.get_xydata().tolist() == [[23.0, 1.3], [21.0, 1.2], [19.0, 1.1]]


@pytest.mark.parametrize(
    ("force", "labels", "limit"),
    [(np.nan, ["frequency (Hz)"], "limit: 3 mm"),
     (9e3, ["frequency (Hz)", "ΣY, rms (kN)"], "limits: 3 mm, half the limit of ΣY")],
)  # fmt: skip
def test_picture_without_forces_has_no_panel_for_them(force, labels, limit):
    """Of continuation alone the panel of the track shift force was empty."""
    branch = Branch("continuation", [Point(v, 1e-3, 4.0, force) for v in (40.0, 41.0)])
    where = {"rails": "rigid", "friction": "0.4", "law": "fastsim"}
    found = CriticalSpeed(Contact("tangent", 3e-3, None), "x", where, branches=[branch])
    found.amplitude_limit = Limit(None, 3e-3, False, 41.0)
    *panels, legend = bifurcation_figure(found).axes
    assert [axes.get_ylabel() for axes in panels] == ["amplitude of the wheelsets (mm)", *labels]
    assert panels[-1].get_xlabel() == "speed (m/s)"
    assert limit in [text.get_text() for text in legend.get_legend().get_texts()]


def test_diagram_follows_what_hunts_below_its_lowest_speed():
    """Speeds of the diagram end 3.3 m/s above the fold at 66.69 m/s (N2)."""
    assert lowest_of(diagram(cooperrider.Rolling(), [70.0, 72.0])).speed == 70.0
    lowest = lowest_of(diagram(cooperrider.Rolling(), [70.0, 72.0], low=60.0))
    assert lowest.speed == pytest.approx(66.69, abs=0.15)


class Cycles:
    """Amplitude a and phase of an oscillation, a' = growth(speed) a - 1e5 a^3, of given frequency.

    Its limit cycle is sqrt(growth/1e5) in closed form.
    """

    def __init__(self, growth, frequency):
        self.growth, self.frequency = growth, frequency

    def rest(self, speed, amplitude):
        return np.array([amplitude, 0.0])

    def stretch(self, state, begin, end, duration):
        step = 0.02
        rows, (a, phase) = [], state
        for k in range(round(duration / step)):
            rows.append(a * np.cos(phase))
            g = self.growth(begin + (end - begin) * k * step / duration)
            a *= np.exp(step * (g - 1e5 * a * a))
            phase += 2.0 * np.pi * self.frequency * step
        lateral = np.array(rows)[:, None]
        time = step * np.arange(len(rows))
        return Stretch(np.array([a, phase]), time, lateral, np.zeros_like(lateral))


@pytest.mark.parametrize("phase", np.linspace(0.0, np.pi, 6))
def test_whether_a_slow_oscillation_lasts_is_decided_by_whole_periods(phase):
    """0.36 Hz: 2.8 s, of which 1 s shows 0.1 to 0.9 of the amplitude."""
    dies = Cycles(lambda _: -0.02, 0.36)
    assert sustain(dies, np.array([2e-3, phase]), 16.0) is None
    lasts = sustain(Cycles(lambda _: 0.4, 0.36), np.array([1e-3, phase]), 16.0)
    assert lasts.amplitude == pytest.approx(2e-3, rel=0.02)


def test_a_ramp_goes_on_where_rest_is_unstable_below_the_speed_at_which_it_dies():
    """Unstable above 60 m/s and from 17 to 30 m/s: the slowest hunting is that near 17 m/s."""

    def growth(speed):
        return max(0.2 * (speed - 60.0), 0.5 - (speed - 23.5) ** 2 / 84.5)

    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=70.0)
    begins = LossOfStability(17.0, False, ())
    _by_ramp(found, Cycles(growth, 5.0), begins, None, (1e-3, 3e-3), lambda _: None)
    assert found.nonlinear["ramp"].speed == pytest.approx(17.0, abs=0.5)
    assert [branch.direction for branch in found.branches] == ["ramp", "ramp"]


@pytest.mark.parametrize("half", [0.5, 0.8, 6.5])
def test_a_ramp_goes_on_in_a_narrow_range_too(half):
    """Unstable from 17 m/s over twice `half`, and above 60 m/s."""

    def growth(speed):
        return max(0.2 * (speed - 60.0), 0.5 - 0.5 * ((speed - 17.0 - half) / half) ** 2)

    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=70.0)
    begins = LossOfStability(17.0, False, ())
    _by_ramp(found, Cycles(growth, 5.0), begins, None, (1e-3, 3e-3), lambda _: None)
    assert found.nonlinear["ramp"].speed == pytest.approx(17.0, abs=0.3)
    assert found.remarks == []


def test_motions_below_the_end_of_a_ramp_are_found_though_rest_is_stable_there():
    """One lasts above 60 m/s, another, from 2 mm on, between 25 and 45, where rest is stable."""

    class Thresholds(Cycles):
        def stretch(self, state, begin, end, duration):
            grows = max(begin, end) > 60.0 or (25.0 < end <= begin < 45.0 and state[0] > 2e-3)
            self.growth = lambda _: 1.0 if grows else -1.0
            return super().stretch(state, begin, end, duration)

    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=70.0)
    begins = LossOfStability(None, False, ())
    _by_ramp(found, Thresholds(None, 5.0), begins, None, (1e-3, 3e-3), lambda _: None)
    first, further = found.branches
    assert first.end == pytest.approx(60.0, abs=0.2)
    assert found.nonlinear["ramp"].speed == further.end == pytest.approx(25.0, abs=0.2)
    assert found.remarks == []


def test_a_motion_that_ends_little_below_another_one_is_found():
    """What is excited at 70 m/s ends at 60, what a disturbance becomes below that ends at 55.5."""

    class Two(Cycles):
        other = False

        def rest(self, speed, amplitude):
            self.other = speed < 65.0
            return super().rest(speed, amplitude)

        def stretch(self, state, begin, end, duration):
            self.growth = lambda v: 1.0 if v > (55.5 if self.other else 60.0) else -1.0
            return super().stretch(state, begin, end, duration)

    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=70.0)
    begins = LossOfStability(None, False, ())
    _by_ramp(found, Two(None, 5.0), begins, None, (3e-3,), lambda _: None)
    assert found.branches[0].end == pytest.approx(60.0, abs=0.2)
    assert found.nonlinear["ramp"].speed == pytest.approx(55.5, abs=0.2)


@pytest.mark.parametrize(("growth", "least"), [(0.02, 0.3e-3), (0.01, 0.26e-3)])
def test_a_ramp_begins_with_what_a_small_motion_grows_to(growth, least):
    """Below 15 m/s, down to 13, only more than `least` lasts; 0.1 mm grows beyond in 100 s or more.

    From there to 0.45 or 0.32 mm.
    """

    class Sway(Cycles):
        def stretch(self, state, begin, end, duration):
            lasts = end >= 15.0 or (end >= 13.0 and state[0] > least)
            self.growth = lambda _: growth if lasts else -0.05
            return super().stretch(state, begin, end, duration)

    lowest, branch = ramp(Sway(None, 5.0), 5.0, 15.5, excitations=(1e-4,))
    assert branch.points[0].amplitude == pytest.approx(np.sqrt(growth / 1e5), rel=0.1)
    assert lowest.speed == pytest.approx(13.0, abs=0.2)


def test_without_a_hunting_mode_one_that_moves_the_wheelsets_is_excited(monkeypatch):
    """A pitching car moves them by rounding only: in its shape 8 mm of them derail any vehicle.

    Undamped oscillators of 1 to 4 Hz, the pitch coupled to the wheelset by 1e-14; the one of 3 Hz
    is a sway that moves the wheelset by a tenth; of the others the one of less damping counts.
    """
    bodies = ("carbody.pitch", "wheelset.y", "carbody.y", "wheelset.yaw")
    names = (*bodies, *(f"{name}'" for name in bodies))
    stiffness = np.diag((2.0 * np.pi * np.array([1.0, 2.0, 3.0, 4.0])) ** 2)
    stiffness[1, [0, 2, 3]] = 1e-14, 20.0, 400.0
    damping = np.diag([0.1, 1.0, 0.2, 0.3])
    matrix = np.block([[np.zeros((4, 4)), np.eye(4)], [-stiffness, -damping]])
    at = Linearisation(names, matrix, np.zeros(8), 20.0)
    index = SimpleNamespace(wheelsets=("wheelset",))
    prepared = SimpleNamespace(linearised=lambda _: at, model=SimpleNamespace(index=index))
    for named, frequency in (((), 4.0), ((2.0, 3.0), 3.0)):
        hunts = lambda mode, named=named: round(mode.frequencies[0]) in named  # noqa: E731
        monkeypatch.setattr(CRITICAL, "_hunts", lambda _, hunts=hunts: hunts)
        (found,) = CRITICAL._hunting_shape(prepared, 20.0).frequencies
        assert found == pytest.approx(frequency, rel=0.01)


def test_a_diagram_that_derails_at_its_lowest_speed_has_found_nothing(monkeypatch):
    """It said that nothing hunts up to the highest speed."""
    monkeypatch.setattr(CRITICAL, "diagram", lambda *_: [Branch("up"), Branch("down")])
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=70.0)
    with pytest.raises(LeftRange, match="derails at 5 m/s, the lowest speed"):
        CRITICAL._by_diagram(found, None, [], 16, (1e-3,), None)
    assert not found.nonlinear


def test_what_a_ramp_alone_finds_counts_for_the_limits():
    """8.6 mm at 25.6 m/s by the ramp, where the diagram has 9.5 mm from 54.3 m/s on."""
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=120.0)
    slow, fast = Point(25.6, 8.6e-3, 0.9, 1e3), Point(54.3, 9.5e-3, 1.9, 40e3)
    found.nonlinear = {"ramp": slow, "bifurcation": fast}
    found.branches = [Branch("ramp", [fast, slow], 25.6), Branch("up", [fast])]
    begins = SimpleNamespace(Q0=np.full((4, 2), 7e4), already=False, parameter=83.2)
    CRITICAL._conclude(found, load_vehicle("coach_manchester"), begins, begins)
    assert found.amplitude_limit.speed == 25.6
    assert found.instability_limit.speed == 54.3


def test_a_ramp_counts_for_the_limits_beside_small_motions_without_forces():
    """Half the limit is passed on the way from 1 kN at 25.6 m/s to 40 kN at 54.3 m/s."""
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=120.0)
    slow, fast = Point(25.6, 8.6e-3, 0.9, 1e3), Point(54.3, 9.5e-3, 1.9, 40e3)
    late, small = Point(25.0, 8.5e-3, 0.9, 1e3), Point(84.0, 1e-3, 3.0)
    found.nonlinear = {"ramp": slow, "continuation": small}
    found.branches = [Branch("ramp", [fast, slow, late], 25.6), Branch("continuation", [small])]
    begins = SimpleNamespace(Q0=np.full((4, 2), 7e4), already=False, parameter=83.2)
    CRITICAL._conclude(found, load_vehicle("coach_manchester"), begins, begins)
    share = (found.instability_limit.limit - 1e3) / 39e3
    assert found.instability_limit.speed == pytest.approx(25.6 + share * 28.7)
    assert found.amplitude_limit.speed == 25.6  # at 25 m/s it was dying


@pytest.mark.parametrize(
    ("loses_stability", "unstable_at_low", "kind"),
    [(None, False, "none"), (40.1, False, ""), (None, True, "")],
)
def test_where_nothing_hunts_there_is_no_bifurcation_unless_rest_is_unstable(
    loses_stability, unstable_at_low, kind
):
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=120.0)
    found.nonlinear = {"ramp": None}
    begins = SimpleNamespace(
        Q0=np.full((4, 2), 7e4), already=unstable_at_low, parameter=loses_stability
    )
    CRITICAL._conclude(found, load_vehicle("coach_manchester"), begins, begins)
    assert found.type == kind


@pytest.mark.parametrize(
    ("slowest", "ramp", "kind"),
    [(40.06, None, ""), (39.2, None, "subcritical"), (40.06, 39.8, "subcritical"),
     (40.06, 40.1, "supercritical")],
)  # fmt: skip
def test_motions_that_begin_at_rest_alone_do_not_tell_that_nothing_hunts_below(slowest, ramp, kind):
    """`coach_manchester` loses its stability at 40.1 m/s, and hunts on the flange from 39.8 m/s."""
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=120.0)
    found.nonlinear = {"continuation": Point(slowest, 1e-4, 4.6)}
    if ramp is not None:
        found.nonlinear["ramp"] = Point(ramp, 8e-3, 4.0)
    found.onset = "supercritical"
    found.branches = [Branch("continuation", [Point(45.0, 1e-3, 4.7)])]
    begins = SimpleNamespace(Q0=np.full((4, 2), 7e4), already=False, parameter=40.1)
    CRITICAL._conclude(found, load_vehicle("coach_manchester"), begins, begins)
    assert found.type == kind
    assert any("may last to lower speeds" in said for said in found.remarks) is (ramp is None)
    # its motions have no forces: whether they exceed the limit is not known
    assert (found.instability_limit is None) is (ramp is None)


def test_branches_stand_in_a_dataset_as_they_were_found(monkeypatch):
    """Of the shorter one nothing is known beyond its end."""
    package = SimpleNamespace(Dataset=lambda values, coordinates: (values, coordinates))
    monkeypatch.setattr("railsim.stability.result.optional_package", lambda *_: package)
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=120.0)
    slow, fast = Point(25.6, 8.6e-3, 0.9, 1e3), Point(54.3, 9.5e-3, 1.9, 40e3)
    found.branches = [Branch("up", [fast]), Branch("ramp", [fast, slow], 25.6)]
    values, coordinates = found.to_xarray()
    assert coordinates == {"branch": ["up", "ramp"]}
    for name, two in (("speed", (54.3, 25.6)), ("frequency", (1.9, 0.9))):
        assert values[name][0] == ("branch", "point")
        np.testing.assert_array_equal(values[name][1], [[two[0], np.nan], two])


def test_a_ramp_goes_on_with_the_sway_of_stuck_friction_however_near():
    """One motion dies at 52.5 m/s; another, which dies above 54 m/s, lasts from there to 47 m/s.

    A linearisation has it undamped from 51.5 m/s on, within 5 % of the end of the first one.
    """
    both = [
        Cycles(lambda v: 0.2 * np.sign(v - 52.5), 5.0),
        Cycles(lambda v: 0.2 if 47.0 < v < 54.0 else -0.5, 1.0),
    ]

    def stretch(state, begin, end, duration):
        parts = [one.stretch(x, begin, end, duration) for one, x in zip(both, state, strict=True)]
        lateral = np.hstack([part.lateral for part in parts])
        return Stretch(np.array([part.state for part in parts]), parts[0].time, lateral, lateral)

    moved = SimpleNamespace(rest=lambda _, size: np.array([[size, 0.0]] * 2), stretch=stretch)
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=45.0, high=60.0)
    begins = LossOfStability(None, False, ())
    _by_ramp(found, moved, begins, 51.5, (1e-3, 3e-3), lambda _: None)
    assert found.branches[0].end == pytest.approx(52.5, abs=0.2)
    assert found.nonlinear["ramp"].speed == pytest.approx(47.0, abs=0.2)


def test_what_derails_at_the_highest_speed_is_not_said_to_die_there():
    """It derails above 50 m/s, and dies below; a search above 52 m/s ends."""
    tried = []

    class Derailing(Cycles):
        def stretch(self, state, begin, end, duration):
            if begin > 50.0:
                tried.append(begin)
                assert len(tried) < 200, "it is tried again and again"
                raise LeftRange("off the rails")
            return super().stretch(state, begin, end, duration)

    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=55.0)
    begins, dying = LossOfStability(None, False, ()), Derailing(lambda _: -1.0, 5.0)
    _by_ramp(found, dying, begins, None, (3e-3,), lambda _: None)
    nothing, derails = found.remarks
    assert nothing.endswith("at 49.64 m/s")
    assert derails == "ramp: the vehicle derails above 49.64 m/s"
    with pytest.raises(LeftRange, match="off the rails"):
        ramp(dying, 52.0, 55.0, excitations=(3e-3,))
    assert tried[-1] == 52.0


def test_motions_that_die_above_a_range_of_hunting_are_no_hunting():
    """Excited by 1 to 6 mm all dies above 35 m/s; it lasts from 17 to 30 m/s."""

    def growth(speed):
        return -0.02 if speed > 35.0 else 0.5 - 0.5 * ((speed - 23.5) / 6.5) ** 2

    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=5.0, high=70.0)
    begins, sizes = LossOfStability(17.0, False, ()), (1e-3, 3e-3, 6e-3)
    _by_ramp(found, Cycles(growth, 5.0), begins, None, sizes, lambda _: None)
    first, further = found.branches
    assert found.lowest.speed == pytest.approx(17.0, abs=0.5)
    assert first.end == np.inf
    assert further.end == found.lowest.speed


def test_a_departure_from_rest_that_is_slow_at_the_lower_end_is_told(monkeypatch):
    """It grows by 0.004 V, as on hollow treads: 0.02 1/s at 5 m/s, where it counts as none."""
    linearised = LinearVehicle.linearised

    def departing(prepared, speed, path=None):
        found = linearised(prepared, speed, path)
        matrix = found.matrix.copy()
        matrix[-1] = 0.0
        matrix[-1, -1] = 0.004 * speed
        return replace(found, matrix=matrix)

    monkeypatch.setattr(LinearVehicle, "linearised", departing)
    coach = load_vehicle("coach_manchester")
    found = critical_speed(coach, RIGID, methods="linear", high=50.0, over_amplitude=False)
    assert any("does not oscillate grows by 0.2 1/s" in remark for remark in found.remarks)


def test_where_rest_is_unstable_from_the_start_the_type_is_not_known():
    """The bifurcation lies below the range: its kind cannot be seen."""
    found = critical_speed(
        load_vehicle("coach_flexicoil"),
        RIGID,
        methods=("ramp",),
        low=80.0,
        high=80.5,
        over_amplitude=False,
    )
    assert found.unstable_at_low
    assert found.lowest is not None
    assert (found.type, found.verdict()) == ("", "")
    assert "unstable at its lower end" in str(found.table())
    assert any("after other disturbances perhaps" in remark for remark in found.remarks)


@pytest.mark.slow
@points(
    ("name", "kind"),
    [("coach_manchester", "supercritical"), ("coach_flexicoil", "subcritical")],
    always=(),
)
def test_three_methods_agree_on_a_coach(name, kind, monkeypatch):
    """Non-linear critical speed by ramp, bifurcation and continuation within 0.5 m/s.

    The branch is followed up to 2 mm: it turns below that, where it turns.  The unstable motions of
    the Flexicoil coach, within 0.2 m/s, lie between the speeds of runs, which find no threshold
    there: continuation passes them, slower than the loss of stability.
    """
    monkeypatch.setattr("railsim.stability.continuation.LARGEST_AMPLITUDE", 2e-3)
    found = critical_speed(
        load_vehicle(name),
        RIGID,
        methods=("ramp", "bifurcation", "continuation"),
        low=25.0,
        points=6,
    )
    speeds = [lowest.speed for lowest in found.nonlinear.values()]
    assert len(speeds) == 3
    assert np.ptp(speeds) < 0.5
    assert found.type == kind
    branches = found.to_xarray()
    assert {"ramp", "up", "down", "continuation"} <= set(branches.branch.values)
    assert float(branches.amplitude.max()) > 1e-3
    followed = next(branch for branch in found.branches if branch.direction == "continuation")
    begins = found.linear.speed_of_runs
    unstable = [point.speed for point in followed.points if not point.stable]
    if kind == "subcritical":
        assert begins - 0.5 < min(unstable) < begins
    else:
        assert "threshold" in branches.branch.values
        assert not unstable
        assert min(point.speed for point in followed.points) > begins


@points(
    ("name", "kind"),
    [("coach_manchester", "supercritical"), ("coach_flexicoil", "subcritical")],
    always=(1,),
)
@pytest.mark.further
def test_a_diagram_alone_tells_how_hunting_begins(name, kind):
    """As continuation does; the hysteresis of the Flexicoil coach, 0.2 m/s, lies between steps."""
    critical = critical_speed(load_vehicle(name), RIGID, methods=("linear",)).linear.speed
    found = critical_speed(
        load_vehicle(name),
        RIGID,
        methods=("bifurcation",),
        low=critical - 3.0,
        high=critical + 3.0,
        points=4,
    )
    assert found.type == kind


@pytest.mark.further
def test_without_critical_speed_in_the_range_the_least_damped_modes_are_told():
    coach = load_vehicle("coach_manchester")
    found = critical_speed(coach, RIGID, methods=("linear",), low=10.0, high=20.0)
    assert found.linear is None
    assert any(
        "no linear critical speed" in remark and "at 20 m/s" in remark for remark in found.remarks
    )
    unstable = critical_speed(coach, RIGID, methods=("linear",), low=60.0, high=70.0)
    assert any("unstable at the lower end" in remark for remark in unstable.remarks)


@pytest.mark.parametrize(
    ("already", "words"), [(False, "stable up to 62"), (True, "unstable at 5")]
)
def test_without_a_critical_speed_on_rigid_rails_a_remark_says_so(monkeypatch, already, words):
    """Its line was left out of the table, as where the rails of the track are rigid."""

    def lost(prepared, *_):
        modes = (eigenmodes(prepared.linearised(58.0)).taken([-1]),)
        elastic = prepared.system.support.elastic
        return LossOfStability(58.0 if elastic else None, already and not elastic, modes)

    monkeypatch.setattr(railsim.stability.critical_speed, "_loss_of_hunting", lost)
    monkeypatch.setattr(railsim.stability.critical_speed, "_over_amplitude", lambda *_: None)
    coach, law = load_vehicle("coach_flexicoil"), railsim.Settings(creep_law="linear")
    found = critical_speed(coach, low=5.0, high=62.0, methods="linear", settings=law)
    assert (found.linear.speed, found.linear.speed_on_rigid_rails) == (58.0, None)
    assert found.remarks == [f"on rigid rails: {words} m/s"]


@pytest.mark.usefixtures("small_contact_tables")
def test_without_friction_nothing_hunts_and_that_is_said():
    """Its longitudinal modes have no damping but by creep: growth by rounding was called loss."""
    law, free = railsim.Settings(creep_law="polach"), RIGID.replace(friction=0.0)
    coach, how = load_vehicle("cooperrider_vehicle"), {"settings": law, "over_amplitude": False}
    found = critical_speed(coach, free, methods="ramp", **how)
    assert (found.linear, found.unstable_at_low) == (None, False)
    assert found.nonlinear == {"ramp": None}
    least, _ = found.remarks[-2].split(" at 5 m/s")  # of four of one frequency: any mixture
    assert "least damped: wheelsets longitudinal" in least
    assert least.endswith("13.4 Hz, damping 0 %")
    assert "without creep forces there is no hunting" in found.remarks[-1]


def test_progress_names_each_method(monkeypatch, caplog):
    def lost(prepared, *_):
        modes = (eigenmodes(prepared.linearised(58.0)).taken([-1]),)
        return LossOfStability(None, False, modes)

    monkeypatch.setattr(CRITICAL, "_loss_of_hunting", lost)
    monkeypatch.setattr(CRITICAL, "VehicleMotion", lambda *_: None)
    for name in ("_by_ramp", "_by_diagram", "_by_continuation"):
        monkeypatch.setattr(CRITICAL, name, lambda *arguments: arguments[-1](1.0))
    monkeypatch.setattr(CRITICAL, "_conclude", lambda *_: None)
    caplog.set_level("INFO", "railsim.doing")
    coach, law, told = load_vehicle("coach_manchester"), railsim.Settings(creep_law="polach"), []
    how = {"settings": law, "over_amplitude": False, "progress": told.append}
    critical_speed(coach, RIGID, methods=CRITICAL.METHODS, **how)
    methods = ("ramp", "bifurcation", "continuation")
    assert [record.getMessage() for record in caplog.records if record.name == "railsim.doing"] == [
        f"{name}, method {k} of 3" for k, name in enumerate(methods, start=1)
    ]
    assert told == pytest.approx([0.02, 0.05, 0.05 + 0.95 / 3, 0.05 + 0.95 * 2 / 3, 1.0])


@pytest.mark.further
def test_the_critical_mode_is_undamped_there():
    coach = load_vehicle("coach_flexicoil")
    found = critical_speed(coach, RIGID, methods=("linear",), linearisation="harmonic")
    there = modes(coach, RIGID, speed=found.linear.speed, linearisation="harmonic")
    assert there.least_damped.damping_ratio == pytest.approx(0.0, abs=1e-5)
    assert there.least_damped.frequency == pytest.approx(found.linear.frequency, rel=1e-6)
    assert "hunting" in found.linear.mode


@points("support", ["rigid", "ballasted"], always=(0,))
def test_linear_critical_speed_has_no_jumps_over_friction(support):
    """FASTSIM's cells go over to sliding one by one: 2 m/s from friction 0.44 to 0.48, 10 x 10."""
    coach = load_vehicle("coach_flexicoil")
    found = [
        critical_speed(
            coach,
            RIGID.replace(support={"preset": support}, friction=float(friction)),
            methods=("linear",),
            low=55.0,
            high=90.0,
            over_amplitude=False,
        ).linear.speed
        for friction in np.arange(0.30, 0.601, 0.02)
    ]
    assert np.max(np.abs(np.diff(found))) < 0.5
    assert np.all(np.diff(found) < 0.02)  # more friction makes creep forces stiffer


@pytest.mark.further
def test_every_branch_of_the_manchester_coach_is_found():
    """Braked from the top a plain run hunts on the flange to 40 m/s, at 38.5 m/s it has died.

    That is below the speed at which rest loses its stability; upwards the motion jumps to the
    flange between 48 and 49 m/s.
    """
    found = critical_speed(
        load_vehicle("coach_manchester"),
        RIGID.replace(support={"preset": "ballasted"}),
        methods=("bifurcation",),
        over_amplitude=False,
    )
    lowest = found.nonlinear["bifurcation"].speed
    assert 38.5 < lowest <= 40.0
    assert lowest < found.linear.speed_of_runs
    assert found.type == "subcritical"
    (up,) = [jump for jump in found.jumps if jump.direction == "up"]
    assert 48.0 < up.speed < 49.0
    assert up.to > 1.5 * up.amplitude
    record = found.record()
    for limit in ("amplitude_limit", "instability_limit"):
        assert record[limit]["reached"]
        assert lowest <= record[limit]["speed"] < 60.0
    (between,) = [branch for branch in found.branches if branch.direction == "threshold"]
    assert not any(point.stable for point in between.points)


@pytest.mark.further
@pytest.mark.parametrize("support", ["rigid", "ballasted"])
def test_harmonic_linearisation_predicts_periodic_motions(support):
    """Motions of the whole coach by shooting, 0.5 to 2.4 mm."""
    coach, track = load_vehicle("coach_manchester"), RIGID.replace(support={"preset": support})
    found = critical_speed(coach, track, methods=("continuation",), over_amplitude=False)
    (branch,) = [b for b in found.branches if b.direction == "continuation"]
    points = [point for point in branch.points if point.amplitude > 0.5e-3][::4]
    assert len(points) > 2
    for point in points:
        about = {"linearisation": "harmonic", "amplitude": point.amplitude}
        linear = critical_speed(
            coach, track, methods=("linear",), over_amplitude=False, **about
        ).linear
        assert linear.speed == pytest.approx(point.speed, rel=0.01)


def test_a_limit_that_is_not_reached_is_said_so():
    """Nothing hunts from 15 to 20 m/s; 1.1 times the admissible speed is not searched."""
    found = critical_speed(
        load_vehicle("coach_manchester"),
        RIGID,
        methods=("ramp",),
        low=15.0,
        high=20.0,
        over_amplitude=False,
    )
    record = found.record()
    for name in ("nonlinear", "amplitude_limit", "instability_limit"):
        assert record[name]["speed"] is None
        assert record[name]["reached"] is False
        assert record[name]["searched_to"] == 20.0
    assert found.type == "none"
    assert any("disturbances of up to 11 mm" in remark for remark in found.remarks)
    assert any("1.1 times the admissible speed" in remark for remark in found.remarks)


def test_critical_speed_over_amplitude_and_its_smallest():
    """The speed rises from 0.3 mm to 4 mm, where the rigid conicity falls; at 6 mm that has risen.

    At 5 mm one wheelset of a bogie is at its flange, the other one moves by 4 mm.
    """
    found = critical_speed(load_vehicle("coach_manchester"), RIGID, methods=("linear",))
    line = found.linear_over_amplitude
    assert line.amplitude[0] == 0.1e-3
    assert line.amplitude[-1] == 6e-3
    between = [k for k, a in enumerate(line.amplitude) if a > 0.25e-3 and a != 5e-3]
    conicity = contact_geometry(
        load_profile("S1002"), load_profile("60E1"), inclination=RIGID.inclination
    ).equivalent_conicity(line.amplitude)
    rises = np.diff(np.array(line.speed)[between]) > 0.0
    assert rises.tolist() == (np.diff(conicity[between]) < 0.0).tolist() == [*5 * [True], False]
    assert line.smallest[0] == min(line.speed)
    assert line.speed[0] == pytest.approx(found.linear.speed, rel=0.03)


@pytest.mark.further
def test_a_vehicle_that_is_unstable_in_a_range_only_is_said_so():
    """The sway of the coach is undamped from 17 m/s on; displaced at 60 m/s it comes to rest."""
    coach = load_vehicle("coach_25t")
    found = critical_speed(coach, RIGID, methods=("linear",), over_amplitude=False)
    assert found.linear.speed == pytest.approx(17.0, abs=0.2)
    (remark,) = [words for words in found.remarks if "no longer" in words]
    already = critical_speed(coach, RIGID, methods=("linear",), low=20.0, over_amplitude=False)
    assert already.unstable_at_low
    (again,) = [words for words in already.remarks if "no longer" in words]
    assert again.split(" on, ")[1] == remark.split(" on, ")[1]
    border, loss = map(float, re.findall(r"(?:above|to) (\d+\.?\d*) m/s", remark))
    for speed, stable in ((border - 0.1, False), (border + 0.1, True), (loss - 0.1, True),
                          (loss + 0.1, False)):  # fmt: skip
        modes = railsim.modes(coach, RIGID, speed=speed)
        assert bool(modes.least_damped.damping_ratio > 0.0) is stable
    settings = railsim.Settings(initial={"front.outer.wheelset": {"y": 5e-3}})
    run = railsim.simulate(coach, RIGID, speed=60.0, duration=16.0, settings=settings)
    y, time = run["wheelset_lateral"], run["time"]
    first, last = (np.ptp(y[(time >= t) & (time < t + 2.0)], axis=0).max() for t in (0.0, 14.0))
    assert last < 0.02 * first


@pytest.mark.further
def test_where_friction_sticks_only_hunting_counts():
    """The sway of a wagon on links is undamped as long as they stick: that is no critical speed."""
    found = critical_speed(
        load_vehicle("wagon_uic_link"),
        RIGID,
        methods=("linear",),
        low=10.0,
        high=25.0,
        over_amplitude=False,
    )
    assert found.linear.mode.endswith("hunting")
    assert any("lower sway" in remark and "not count" in remark for remark in found.remarks)


@pytest.mark.further
def test_sway_that_lasts_where_friction_sticks_is_hunting():
    """A plain run at 14 m/s keeps swaying, below the speed at which hunting dies on a ramp."""
    # springs whose sliding releases the links, so that large hunting dies at 15.6 m/s, not at 12.1
    wagon = load_vehicle("wagon_uic_link").with_values(
        {"assemblies.axle.elements.spring_and_links.friction_limit": "circle"}
    )
    start = {f"{place}.wheelset": {"y": 1e-3} for place in ("front", "rear")}
    settings = railsim.Settings(initial=start)
    run = railsim.simulate(wagon, RIGID, speed=14.0, duration=60.0, settings=settings)
    last = run["wheelset_lateral"][run["time"] > 40.0]
    assert 0.5 * np.max(np.ptp(last, axis=0)) > 0.5e-3
    found = critical_speed(wagon, RIGID, methods=("ramp",), high=30.0, over_amplitude=False)
    assert found.branches[0].end > 15.0
    assert found.lowest.speed < 14.0


def test_limits_are_passed_between_points_of_one_motion():
    """Linear between 10 and 20 kN on one branch; none where the branch jumps."""
    points = [Point(60.0, 2e-3, 5.0, 10e3), Point(70.0, 2.2e-3, 5.0, 20e3)]
    jump = [Point(50.0, 1e-3, 5.0, 10e3), Point(50.1, 6e-3, 5.0, 40e3)]
    assert first_beyond([Branch("up", points)], 15e3, "sum_Y_rms", 80.0).speed == 65.0
    assert first_beyond([Branch("up", jump)], 15e3, "sum_Y_rms", 80.0).speed == 50.1
    none = first_beyond([Branch("up", points)], 30e3, "sum_Y_rms", 80.0)
    assert (none.speed, none.reached, none.searched_to) == (None, False, 80.0)


def test_pieces_of_a_branch_end_at_its_jumps():
    """A motion of continuation is stable where runs settle to it, whatever its multipliers."""
    run = Branch("down", [Point(v, 6e-3, 5.0) for v in (80.0, 72.0, 71.1)])
    run.points += [Point(v, 1.9e-3 * (v - 66.0) / 5.0, 5.8) for v in (71.0, 70.2, 69.4, 68.6)]
    slow, fast = run.pieces()
    assert (slow[0].speed, slow[-1].speed, fast[0].speed) == (68.6, 71.0, 71.1)
    shot = Branch("continuation", [Point(69.0, 1.14e-3, 5.8, stable=False)])
    assert settled_to(shot, [slow, fast]).points[0].stable
    # with the bogies in another phase: its own frequency, 10 % more amplitude, and unstable
    other = [Point(69.0, 1.14e-3, 5.7, stable=False), Point(69.0, 1.25e-3, 5.8, stable=False)]
    assert not any(p.stable for p in settled_to(Branch("continuation", other), [slow, fast]).points)
    shot = Branch("continuation", [Point(75.0, 4e-3, 5.0, stable=False)])
    assert not settled_to(shot, [slow, fast]).points[0].stable


@pytest.mark.parametrize("share", [0.25, 0.75])
def test_a_motion_between_two_runs_has_an_amplitude_and_a_frequency_between_theirs(share):
    """Runs at 60 and 70 m/s with 2 and 6 mm, 4 and 8 Hz: on the line between them, and only there.

    3 % of amplitude and 0.5 % of frequency beside it a motion is another one.
    """
    runs = [Point(60.0, 2e-3, 4.0), Point(70.0, 6e-3, 8.0)]
    on = 60.0 + 10.0 * share, 2e-3 + 4e-3 * share, 4.0 + 4.0 * share
    for factors, same in (((1, 1), True), ((1.02, 0.996), True), ((1.04, 1), False),
                          ((1, 1.01), False), ((1, 0.99), False)):  # fmt: skip
        at = Point(on[0], on[1] * factors[0], on[2] * factors[1], stable=False)
        for piece in (runs, runs[::-1]):
            assert settled_to(Branch("continuation", [at]), [piece]).points[0].stable == same


class Parabola:
    """A branch v = 60 - 4 p + p^2 m/s with p/2 mm, which turns back at 56 m/s and 1 mm."""

    def __init__(self, step=0.75, last=np.inf, factor=1.0):
        self.step, self.last, self.factor, self.lengths = step, last, factor, []

    def at(self, p):
        tangent, amplitude = np.array([0.6, 2.0 * p - 4.0]), 0.5e-3 * self.factor * p
        return SimpleNamespace(
            p=p, speed=60.0 - 4.0 * p + p**2, amplitude=amplitude, frequency=5.0 + 0.1 * p,
            tangent=tangent, is_stable=p > 2.0,
        )  # fmt: skip

    def motions(self, start, length, within):
        now, inside = start, True
        while inside:
            if now.p + self.step > self.last:
                raise ModelError("no motion further on")
            now = self.at(now.p + self.step)
            yield now
            inside = within(now)

    def fold(self, before, after):
        assert before.p < 2.0 < after.p
        return self.at(2.0)


def continued(monkeypatch, birth, known=(), seeds=None, speeds=(50.0, 64.0), parameter=60.0):
    """What continuation finds where `birth` begins, and `seeds` is told where runs' motions are."""

    def of_run(motion, seed):
        seeds.append((seed.speed, seed.amplitude))
        raise ModelError("its motion is not periodic")

    monkeypatch.setattr(continuation, "_birth", lambda *_: (birth, birth.at(0.0)))
    monkeypatch.setattr(continuation, "_motion_near", of_run)
    lost, told = SimpleNamespace(parameter=parameter), []
    return continuation.followed_branches(None, lost, known, speeds, told.append), told


def test_a_branch_is_followed_from_its_birth_through_its_fold_out_of_the_range(monkeypatch):
    """To the first motion above 64 m/s: p^2 - 4 p > 4, from p = 4.83 on."""
    found, _ = continued(monkeypatch, Parabola())
    (branch,) = found.branches
    p = 0.75 * np.arange(1, 8)
    np.testing.assert_allclose(branch.column("speed"), 60.0 - 4.0 * p + p**2)
    np.testing.assert_allclose(branch.column("amplitude"), 0.5e-3 * p)
    np.testing.assert_array_equal(branch.column("stable"), p > 2.0)
    assert found.begins == branch.points[0]
    assert [(fold.speed, fold.amplitude) for fold in found.folds] == [(56.0, 1e-3)]
    assert not found.remarks


def test_how_a_branch_begins_is_told_by_the_first_motion_at_another_speed(monkeypatch):
    """At 59.98 m/s, no more than the speed of birth is known to, both kinds look alike."""
    found, _ = continued(monkeypatch, Parabola(0.005))
    assert found.branches[0].points[0].speed == pytest.approx(59.98, abs=1e-4)
    assert found.begins == found.branches[0].points[2]
    assert found.begins.speed == pytest.approx(59.94, abs=1e-3)


def test_a_branch_ends_where_it_comes_back_to_rest(monkeypatch):
    """As the lower sway of a coach that is stable again from some speed on.

    |sin p| mm at 60 + 4 sin^2(p/2) m/s: rest at 64 m/s, p = pi, then all of it once more.
    """

    class Arch(Parabola):
        def at(self, p):
            speed, slope = 60.0 + 4.0 * np.sin(0.5 * p) ** 2, 2.0 * np.sin(p)
            return SimpleNamespace(
                p=p, speed=speed, amplitude=1e-3 * abs(np.sin(p)), frequency=5.0,
                tangent=np.array([1.0, slope]), is_stable=True,
            )  # fmt: skip

    found, _ = continued(monkeypatch, Arch(0.5), speeds=(50.0, 70.0))
    (branch,) = found.branches
    p = 0.5 * np.arange(1, 7)
    np.testing.assert_allclose(branch.column("amplitude"), 1e-3 * np.sin(p))
    assert not found.folds
    assert not found.remarks


@pytest.mark.parametrize(
    ("birth", "how", "count", "words"),
    [
        (Parabola(0.05), {}, 20, "is followed for 20 motions only, to 57 m/s"),
        (Parabola(last=3.2), {}, 4, "is followed to 57 m/s only: no motion further on"),
        (Parabola(factor=9.0), {}, 4, None),  # the first one above 12 mm
        (Parabola(), {"speeds": (57.5, 64.0)}, 2, None),
        (Parabola(), {"parameter": None}, 0, "no loss of stability at which it could begin"),
    ],
)
def test_a_branch_ends_at_a_number_an_amplitude_or_a_speed(monkeypatch, birth, how, count, words):
    found, _ = continued(monkeypatch, birth, **how)
    assert sum(len(branch.points) for branch in found.branches) == count
    assert [words in remark for remark in found.remarks] == ([True] if words else [])


# of 0.75 mm, on the lower arm
UNSTABLE = "at 56.25 m/s is unstable, no run stays at it"


@pytest.mark.parametrize(
    ("low", "last", "slowest", "words"),
    [(50.0, np.inf, 56.0, []), (50.0, 1.6, 56.25, ["to 56.25 m/s only", UNSTABLE]),
     (57.5, np.inf, 56.25, [UNSTABLE, "hunts still at the lower end, 57.5 m/s"])],
)  # fmt: skip
def test_a_branch_that_is_left_before_its_fold_goes_on_to_its_slowest_motion(
    monkeypatch, low, last, slowest, words
):
    """It is born at 60 m/s and turns back at 56: no critical speed of 60 m/s."""
    found = CriticalSpeed(Contact("tangent", 3e-3, None), low=low, high=64.0)
    monkeypatch.setattr(continuation, "_birth", lambda *_: (Parabola(last=last), Parabola().at(0)))
    lost = LossOfStability(60.0, False, (SimpleNamespace(frequencies=[5.0]),))
    _by_continuation(found, None, lost, lambda _: None)
    _remark_range(found, SimpleNamespace(service=None))
    assert found.nonlinear["continuation"].speed == slowest
    assert found.onset == "subcritical"
    assert len(found.remarks) == len(words)
    assert all(end in said for said, end in zip(found.remarks, words, strict=True))
    # at the fold begins the upper arm, which is stable
    stable = slowest == 56.0
    assert found.nonlinear["continuation"].record()["stable"] is stable
    assert found.title.endswith(
        "slowest sustained hunting 56 m/s" if stable else "unstable motion at 56.25 m/s"
    )


def test_a_branch_of_runs_is_followed_once_and_where_it_is_not_known_yet(monkeypatch):
    """From a motion 1 m/s above its slow end, 20 % beside what is known and 0.2 mm at least."""
    on = 0.5e-3 * (2.0 + np.sqrt(6.0))  # of the parabola at 62 m/s

    def run(direction, share, first=61.0):
        return Branch(direction, [Point(v, on * share, 5.0) for v in np.arange(first, 64.0, 0.5)])

    known = [run("up", 1.15), run("ramp", 2.0), run("up", 0.85), run("down", 0.19e-3 / on),
             run("down", 1.5), run("up", 1.6, 61.5), run("further", 2.1)]  # fmt: skip
    seeds = []
    found, told = continued(monkeypatch, Parabola(), known, seeds)
    assert seeds == [pytest.approx((62.0, 1.5 * on)), pytest.approx((62.0, 2.1 * on))]
    # 7 motions of 20 at most on the branch from rest, then each of the other branches
    assert told == pytest.approx(np.concatenate([np.arange(1, 8) / 20.0, np.arange(1, 7)]) / 7.0)
    said = (
        f"continuation: the branch of runs from 61 to 63.5 m/s, {1.5e3 * on:.2f} mm at 62 m/s, is"
    )
    assert found.remarks[0] == f"{said} not followed: its motion is not periodic"
    assert len(found.remarks) == 2


def test_a_branch_begins_in_the_shape_of_the_mode_that_loses_its_stability():
    """The lower sway of a coach whose hunting dies: the state a period later is the same one."""
    of = LinearVehicle(load_vehicle("coach_25t"), railsim.load_track("straight"))
    lost = loss_of_stability(of.linearised, 15.0, 20.0, points=3)
    hunting = eigenmodes(of.linearised(20.0)).taken([-1])
    motion = motion_of.VehicleMotion(of, "fast", hunting)
    shooting, start = continuation._birth(motion, lost)
    begin = np.append(start.state, [start.period, start.speed]) / shooting._scale
    begin += 0.1 * start.tangent
    assert np.linalg.norm(shooting._ends(begin[None])[0] - begin[:-2]) < 0.1 * 0.1


def test_no_branch_of_small_motions_is_sought_where_friction_sticks():
    """Stuck elements keep any force, with a multiplier of 1 each: shooting has no answer."""
    motion = SimpleNamespace(prepared=SimpleNamespace(sticking=12))
    lost, told = SimpleNamespace(parameter=33.0), []
    found = continuation.followed_branches(motion, lost, [], (5.0, 60.0), told.append)
    (said,) = found.remarks
    assert said.startswith("continuation: the branch of small motions is not followed: friction")
    assert "bifurcation" in said
    assert not found.branches


def test_what_moves_takes_part_in_periodic_motions_and_a_period_forgets_the_rest():
    """The reference body but its place along the track; rails, not what slopes have learnt."""
    of = LinearVehicle(load_vehicle("coach_manchester"), railsim.load_track("straight"))
    motion = SimpleNamespace(prepared=of, model=of.model, system=of.system, step_at=lambda _: 1e-3)
    flow = VehicleFlow(motion, 20.0)
    rest = flow.full(flow.reduce(of.steady(20.0)), 20.0)
    changed = rest + np.random.default_rng(1).standard_normal(rest.size)
    after = flow.full(flow.reduce(changed), 20.0)
    first = 6 * of.system.bodies.reference
    assert after[first] == rest[first]
    assert np.array_equal(after[first + 1 : first + 6], changed[first + 1 : first + 6])
    before, found, known = (tracks_under(of.system, state) for state in (changed, after, rest))
    assert len(found) == 4
    assert np.array_equal(found[:, :LMS], before[:, :LMS])
    assert np.array_equal(found[:, LMS:], known[:, LMS:])


def test_motions_in_threads_are_those_one_after_the_other(monkeypatch):
    """To the bit, whatever the number of threads; each a lateral displacement of its own."""
    of = LinearVehicle(load_vehicle("coach_manchester"), railsim.load_track("straight"))
    motion = motion_of.VehicleMotion(of, "fast", CRITICAL._hunting_shape(of, 20.0))
    flow = VehicleFlow(motion, 20.0)
    states = [flow.reduce(motion.rest(20.0, size)) for size in np.linspace(-4e-3, 4e-3, 7)]
    ends = []
    for cores in (1, 3):
        monkeypatch.setattr(vehicle_flow, "available_cores", lambda cores=cores: cores)
        again = VehicleFlow(motion, 20.0)
        ends.append(again.after(np.array(states), np.full(7, 0.1), np.full(7, 20.0)))
        assert len(again._threads) == cores
    assert np.array_equal(*ends)
    assert np.isfinite(ends[0]).all()
    assert np.ptp(ends[0], axis=0).max() > 1e-3


def test_the_step_at_a_speed_that_two_classes_share_is_judged_once(monkeypatch):
    judged, taken = [], {16: 2e-3, 17: 1e-3, 18: 1.5e-3}

    class Judge:
        def __init__(self, model, system, state, *_):
            self.end = round(np.log(state) / np.log(1.25))

        def choose(self, interval):
            judged.append(self.end)
            return taken[self.end]

    monkeypatch.setattr(motion_of, "Stability", Judge)
    motion = object.__new__(motion_of.VehicleMotion)
    motion.prepared = SimpleNamespace(steady=lambda speed: speed)
    motion.model = motion.system = motion.scheme = None
    motion._steps, motion._parts = {}, 1
    assert motion.step_at(1.25**17.5) == motion.step_at(1.25**16.5) == 1e-3
    assert judged == [17, 18, 16]


def test_a_stretch_passes_from_one_speed_to_the_other_on_the_way_of_their_mean():
    """Longer ones in parts: the speed falls evenly over them, each begins where the last ended."""
    motion, tables, begun = object.__new__(motion_of.VehicleMotion), [], []

    def advance(system, state, step, chunk):
        tables.append(system.drive.table.copy())
        begun.append((chunk.fresh, state[-1]))
        return round(chunk.steps / chunk.every)

    motion.system = SimpleNamespace(_replace=lambda drive: SimpleNamespace(drive=drive))
    motion.step_at, motion.advance = (lambda speed: 1e-3), advance
    motion._recorder = SimpleNamespace(wheel=np.zeros((100_000, 2, 2, 5)))
    motion.lateral = lambda rows: np.zeros((rows, 2))
    duration = 1.5 * motion_of.LONGEST
    seen = motion.stretch(np.array([-1.0, 0.0, 0.0]), 40.0, 37.0, duration)
    assert np.array(tables)[:, :, 1].tolist() == [[40.0, 38.0], [38.0, 37.0]]
    ways = np.diff(np.array(tables)[:, :, 0], axis=1).ravel()
    assert ways == pytest.approx([39.0 * motion_of.LONGEST, 37.5 * 0.5 * motion_of.LONGEST])
    assert begun == [(1, 40.0), (0, 38.0)]  # without memory at first
    assert np.diff(seen.time) == pytest.approx(np.full(len(seen.time) - 1, 1.0 / OUTPUT_RATE))


class HeldByTheStep:
    """Hunts with 1 mm at 2 Hz above a speed that depends on the step, and dies below it."""

    def __init__(self, ends, in_shorter_steps):
        self.ends, self.finer = ends, in_shorter_steps

    def in_shorter_steps(self):
        return HeldByTheStep(self.finer, self.finer)

    def stretch(self, state, begin, end, duration):
        time = np.arange(0.0, duration, 1.0 / OUTPUT_RATE)
        size = 1e-3 if end >= self.ends else 0.0
        lateral = (size * np.sin(4.0 * np.pi * time))[:, None]
        return Stretch(state, time, lateral, np.zeros_like(lateral))


@pytest.mark.parametrize(("finer", "lasts"), [(20.0, True), (20.3, True), (40.0, False)])
def test_what_a_long_step_holds_is_told_from_a_motion_whose_end_moves_with_it(finer, lasts):
    motion = HeldByTheStep(20.0, finer)
    found = sustain(motion, np.zeros(1), 20.0)
    assert found.hunts
    assert lasts_in_shorter_steps(motion, found) is lasts


def test_a_method_whose_slowest_motion_is_one_of_the_step_is_repeated_in_shorter_ones(monkeypatch):
    """Coach, friction 0.4 and 0.1: in steps of 2.5 ms a bogie stayed on its flange to 5 m/s."""
    tried, short = [], object()

    def by_ramp(found, motion, *_):
        tried.append(motion)
        found.branches.append(Branch("ramp"))
        found.nonlinear["ramp"] = Point(44.2 if motion is short else 5.0, 1e-3, 2.5)

    motion = SimpleNamespace(in_shorter_steps=lambda: short)
    monkeypatch.setattr(CRITICAL, "VehicleMotion", lambda *_: motion)
    monkeypatch.setattr(CRITICAL, "_by_ramp", by_ramp)
    monkeypatch.setattr(CRITICAL, "lasts_in_shorter_steps", lambda motion, _: motion is short)
    coach, law = load_vehicle("coach_manchester"), railsim.Settings(creep_law="polach")
    found = critical_speed(coach, RIGID, over_amplitude=False, settings=law)
    assert tried == [motion, short]
    assert (found.lowest.speed, len(found.branches)) == (44.2, 1)


@pytest.mark.parametrize("stays", [True, False])
def test_what_leaves_the_rails_in_long_steps_is_looked_at_in_divided_ones(monkeypatch, stays):
    """From the beginning: the state just before may be wrong already. Then long ones are back."""
    motion, begun = object.__new__(motion_of.VehicleMotion), []

    def stretch(state, begin, end, duration):
        begun.append((state, int(motion._work.counts[MAX_PARTS])))
        if not (stays and begun[-1][1]):
            raise LeftRange("rolled over")
        return "on the rails"

    def divide(system, work, scheme, step, speed):
        work.counts[MAX_PARTS] = 10

    monkeypatch.setattr(motion_of, "divide_strikes", divide)
    motion._work, motion.system = SimpleNamespace(counts=np.zeros(6, dtype=np.int64)), None
    motion.scheme, motion.step_at, motion._stretch = "fast", lambda speed: 1e-3, stretch
    if stays:
        assert motion.stretch(1.0, 40.0, 37.0, 10.0) == "on the rails"
    else:
        with pytest.raises(LeftRange, match="rolled over"):
            motion.stretch(1.0, 40.0, 37.0, 10.0)
    assert begun == [(1.0, 0), (1.0, 10)]
    assert not motion._work.counts[MAX_PARTS]


def test_rest_is_not_called_stable_where_hunting_is_named_after_the_body():
    """The empty wagon at 90 m/s: the car body yaws with its bogies, damping -22 %.

    A run from 10 nm reaches the flanges within two seconds.
    """
    wagon = load_vehicle("wagon_y25")
    found = critical_speed(wagon, methods=("linear",), over_amplitude=False)
    assert found.linear.speed == pytest.approx(33.7, abs=0.2)
    assert not [words for words in found.remarks if "no longer" in words]
    above = critical_speed(wagon, low=80.0, methods=("linear",), over_amplitude=False)
    assert above.unstable_at_low
    assert not [words for words in above.remarks if "not count" in words]
    settings = railsim.Settings(initial={"front.outer.wheelset": {"y": 1e-8}}, step=5e-4)
    run = railsim.simulate(
        wagon, railsim.load_track("straight"), speed=90.0, duration=2.0, settings=settings
    )
    assert np.abs(run["wheelset_lateral"]).max() > 5e-3


@pytest.mark.parametrize(
    ("fold", "gap"), [(41.03, ()), (43.0, ()), (44.2, ()), (49.99, ()), (44.3, (46.5, 49.5))]
)
def test_the_lowest_sustained_speed_is_sought_between_those_that_hunt_on_a_ramp(
    fold, gap, monkeypatch
):
    """Below the slowest state that hunts, or above it up to the fastest, and never beyond that."""
    tried = []

    def sustain(_motion, _state, speed):
        tried.append(speed)
        dies = speed < fold or (gap and gap[0] < speed < gap[1])
        return None if dies else Point(speed, 5e-3, 1.0)

    monkeypatch.setattr(ramp_of, "sustain", sustain)
    monkeypatch.setattr(ramp_of, "at_speed", lambda _motion, state, *_: state)
    speeds = (50.0, 47.0, 44.0, 41.0)
    points = [Point(speed, 5e-3 if speed > 43.5 else 0.0, 1.0) for speed in speeds]
    found = ramp_of._lowest(None, points)
    assert fold <= found.speed <= fold + RESOLUTION
    assert max(tried) <= 50.0
    assert ramp_of._lowest(None, points[3:]) is None
