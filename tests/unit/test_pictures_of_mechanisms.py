"""Pictures of mechanisms: plain numbers in the units of their axes."""

from collections import namedtuple
from dataclasses import make_dataclass
from types import SimpleNamespace as Made

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgba

from railsim.definitions.mechanism.parts import AirSpring, Cam
from railsim.errors import InputError
from railsim.mechanisms import cams, drawing
from railsim.plot import mechanisms as plots
from railsim.plot.style import LIMIT

S = np.radians([10.0, 20.0, 30.0, 40.0])  # of the driver
HEIGHT = np.array([0.0, 0.1, 0.3, 0.6])  # m


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def made(output=(), *, axis=1, angle=0.0, **given):
    """Results of a mechanism driven by an angle, or, without one, by a length."""
    of = {
        "driver": Made(angle=angle),
        "angles": {},
        "solve": None,
        "unknown": "cylinder",
        "output": Made(point="pan"),
        "optimise": None,
        "held_by": None,
        "joints": {},
    } | given.pop("definition", {})
    plain = {"zone": {}, "contact": None, "timed": None, "transitions": ()} | given
    model = plain.pop("model", Made(axis=axis))
    return Made(
        output={"travel": S, "height": HEIGHT, **dict(output)},
        definition=Made(**of),
        model=model,
        **plain,
    )


def zone_of(name, low, work, high):
    return {where: {name: x} for where, x in (("low", low), ("work", work), ("high", high))}


def long(axes):
    """Curves of more than two points by their label."""
    return {line.get_label(): line.get_xydata() for line in axes.lines if len(line.get_xdata()) > 2}


def over(x, *values):
    return [pytest.approx(np.stack((x, y), axis=1)) for y in values]


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.5), (0.5, 0.1)])
def test_a_zone_is_shaded_between_its_ends_with_the_work_height(low, high):
    axes = plt.figure().subplots()
    plots.mark_zone(axes, made(zone=zone_of("height", low, 0.2, high)), "height")
    assert axes.patches[0].get_extents().transformed(axes.transData.inverted()).intervalx == (
        pytest.approx((100.0, 500.0))
    )
    assert axes.lines[0].get_xdata()[0] == pytest.approx(200.0)
    bare = plt.figure().subplots()
    plots.mark_zone(bare, made(zone=zone_of("height", low, 0.2, high)), "length")
    plots.mark_zone(bare, made(), "height")
    assert not bare.patches
    assert not bare.lines


def test_a_path_is_drawn_in_millimetres():
    x = np.array([0.0, 0.01, 0.02, 0.01])
    zone = {"low": {"x": 0.005, "height": 0.05}}
    (axes,) = plots.path_figure(made({"x": x}, zone=zone)).axes
    path, point = (line.get_xydata() for line in axes.lines)
    assert [path] == over(1e3 * x, 1e3 * HEIGHT)
    assert point == pytest.approx(np.array([[5.0, 50.0]]))
    assert {text.get_text(): text.xy for text in axes.texts} == {"low": pytest.approx((5.0, 50.0))}


def test_transmission_angles_are_folded_and_have_their_limit():
    """An angle of 130 degrees between two lines is one of 50; a limit of 40 is named."""
    angles = {"one": Made(limited=True), "two": Made(limited=False)}
    output = {
        "one": np.radians([130.0, 50.0, 90.0, -30.0]),
        "two": S,
        "cam_pressure_angle": np.radians([5.0, -5.0, 1.0, 2.0]),
    }
    limits = Made(min_transmission_angle="a")
    result = made(
        output,
        definition={"angles": angles, "optimise": limits},
        model=Made(axis=1, number=lambda _: np.radians(40.0)),
    )
    (axes,) = plots.angles_figure(result).axes
    found, degrees = long(axes), np.degrees(S)
    assert [found["one"]] == over(degrees, [50.0, 50.0, 90.0, 30.0])
    assert [found["two"]] == over(degrees, degrees)
    assert [found["cam pressure angle"]] == over(degrees, [5.0, -5.0, 1.0, 2.0])
    (limit,) = [line for line in axes.lines if len(line.get_xdata()) == 2]
    assert limit.get_ydata() == pytest.approx([40.0, 40.0])
    assert to_rgba(limit.get_color()) == to_rgba(LIMIT)
    assert [text.get_text() for text in axes.texts] == ["limit of one"]
    for no_limit in (None, Made(min_transmission_angle=None)):
        bare = made(output, definition={"angles": angles, "optimise": no_limit})
        assert len(plots.angles_figure(bare).axes[0].lines) == 3


def test_pressures_are_in_megapascals_over_the_height_or_the_length():
    pressure, back = 1e6 * np.array([0.1, 0.2, 0.3, 0.2]), 1e6 * np.array([0.2, 0.3, 0.4, 0.3])
    output = {"pressure": pressure, "pressure_back": back, "length": 1.0 + HEIGHT}
    (axes,) = plots.pressure_figure(made(output, contact=Made(pressure=0.35e6))).axes
    found = long(axes)
    wanted = over(1e3 * HEIGHT, 1e-6 * pressure, 1e-6 * back, np.full(4, 0.35))
    assert [found[name] for name in ("needed", "needed on the way back", "held")] == wanted
    assert axes.get_ylim()[0] == 0.0
    del output["pressure_back"]
    (axes,) = plots.pressure_figure(made(output, definition={"output": None})).axes
    assert [long(axes)["needed"]] == over(1e3 * (1.0 + HEIGHT), 1e-6 * pressure)
    assert len(axes.lines) == 1


def test_a_contact_force_is_drawn_with_both_senses_and_its_rests():
    """Filled where the output comes back to its height, open where it does not."""
    curve = np.array([70.0, 71.0, 69.0, 70.0])
    contact = Made(
        curve=curve,
        pressure=0.35e6,
        bounds=(curve + 5.0, curve - 5.0),
        rising={"low": 1.0},
        falling={"low": 2.0},
        equilibria=((0.2, True), (0.4, False)),
    )
    (axes,) = plots.contact_figure(made(contact=contact)).axes
    assert [*long(axes)] == ["at 0.3500 MPa", "rising", "falling"]
    assert [*long(axes).values()] == over(1e3 * HEIGHT, curve, curve + 5.0, curve - 5.0)
    *_, stable, open_ = axes.lines
    assert np.ravel([stable.get_xydata(), open_.get_xydata()]) == pytest.approx([200, 0, 400, 0])
    assert (stable.get_mfc(), open_.get_mfc()) == ("k", "w")
    contact.falling = contact.rising
    assert [*long(plots.contact_figure(made(contact=contact)).axes[0])] == ["at 0.3500 MPa"]


def test_a_carpet_has_a_line_for_each_pressure_and_the_load(monkeypatch):
    heights, pressures = np.array([0.2, 0.25, 0.3]), 1e6 * np.array([0.3, 0.45])
    forces = 1e3 * np.array([[10.0, 20.0], [11.0, 21.0], [12.0, 23.0]])
    table = Made(heights=heights, pressures=pressures, forces=forces)
    monkeypatch.setattr(plots, "table_of", lambda *_: table)
    length, load = 0.2 + 0.1 * HEIGHT, 1e3 * np.array([12.0, 13.0, 15.0, 14.0])
    result = made(
        {"length": length, "force": load},
        motion=None,
        definition={"held_by": AirSpring.model_construct()},
    )
    (axes,) = plots.carpet_figure(result).axes
    first, second, drawn = (line.get_xydata() for line in axes.lines)
    assert [first, second] == over([200.0, 250.0, 300.0], [10, 11, 12], [20, 21, 23])
    assert [drawn] == over(1e3 * length, load / 1e3)
    assert axes.lines[-1].get_label() == "load"
    texts = {text.get_text(): text.xy for text in axes.texts}
    assert texts == {
        "0.3 MPa": pytest.approx((200.0, 10.0)),
        "0.45 MPa": pytest.approx((200.0, 20.0)),
    }
    assert axes.get_xlim()[0] < 200.0


def test_gas_springs_have_their_length_in_millimetres_and_their_push():
    output = {
        "a_length": 0.3 + HEIGHT,
        "a_force": 500.0 + S,
        "b_length": 0.5 - HEIGHT / 2.0,
        "b_force": 300.0 - S,
    }
    length, push = plots.gas_spring_figure(made(output)).axes
    degrees = np.degrees(S)
    assert [*long(length).values()] == over(degrees, 300.0 + 1e3 * HEIGHT, 500.0 - 500.0 * HEIGHT)
    assert [*long(push).values()] == over(degrees, 500.0 + S, 300.0 - S)
    assert [*long(push)] == ["a", "b"]


@pytest.mark.parametrize("unit", ["N", "N m"])
def test_motion_in_time_has_speed_and_acceleration_of_the_output(monkeypatch, unit):
    """Components and absolute value: of 3 and -4 it is 5."""
    monkeypatch.setattr(plots, "driving_actuator", lambda _: "motor")
    monkeypatch.setattr(plots, "force_unit", lambda *_: unit)
    time = np.array([0.0, 0.5, 1.0])
    speed = np.array([[0.3, -0.4], [0.6, 0.8], [0.0, 1.0]])
    point = (speed, 2.0 * speed)
    timed = Made(
        time=time,
        motion=Made(s=S[:3]),
        force=np.array([5.0, 6.0, 7.0]),
        point=lambda name: point if name == "pan" else None,
    )
    driver, force, first, second = plots.time_figure(made(timed=timed)).axes
    assert [line.get_xydata() for line in driver.lines] == over(time, np.degrees(S[:3]))
    assert [line.get_xydata() for line in force.lines] == over(time, timed.force)
    assert force.get_ylabel() == ("torque" if unit == "N m" else "force") + f" of 'motor' ({unit})"
    absolute = np.array([500.0, 1000.0, 1000.0])
    for axes, times in ((first, 1.0), (second, 2.0)):
        assert [*long(axes)] == ["x", "y", "absolute"]
        assert [*long(axes).values()] == over(
            time, *(times * values for values in (*(1e3 * speed.T), absolute))
        )
    alone = plots.time_figure(made(timed=timed, definition={"output": None})).axes
    assert [len(axes.lines) for axes in alone] == [1, 1, 0, 0]


def test_cases_have_a_line_each():
    one, two = (made({"force": np.arange(4.0) * k}) for k in (1.0, 2.0))
    (axes,) = plots.cases_figure({"empty": one, "laden": two}).axes
    found = long(axes)
    assert [*found] == ["empty", "laden"]
    assert [*found.values()] == over(np.degrees(S), np.arange(4.0), 2.0 * np.arange(4.0))


@pytest.mark.parametrize("angle", [0.0, None])
def test_the_rate_on_a_cam_is_drawn_arc_by_arc_and_beyond(monkeypatch, angle):
    """A roller's body that turns by 0.5, then by 0.25 of the driver: rates of 2 and 4."""
    arcs = [Made(turns="left"), Made(turns="right")]
    cam = Cam.model_construct(cam="rocker.roller", arcs=arcs)
    q1 = np.zeros((4, 3, 3))
    q1[:, 1, 2] = [0.5, -0.5, 0.25, 0.25]
    still = np.zeros((1, 2))
    motion = Made(q1=q1, arcs=np.array([[7], [7], [8], [8]]), point=lambda _: (still, still))
    asked = []

    def alone(given, row, arc, beyond):
        asked.append((given is motion, row, arc, beyond))
        return None if arc == 8 else Made(s=S[:3], q1=np.full((3, 3, 3), -0.2), point=motion.point)

    monkeypatch.setattr(plots, "cam_rows", lambda _: {"cam": 0})
    monkeypatch.setattr(plots, "on_one_arc", alone)
    linkage = Made(joint=np.array([[0, 0, 0, 0, 7, 2]]), point_body=np.array([0, 1]))
    result = made(
        motion=motion,
        angle=angle,
        model=Made(axis=1, linkage=linkage, points={cam.cam: 1}),
        travel=-0.5,
        definition={"joints": {"cam": cam}},
        transitions=(Made(travel=S[1]),),
    )
    (axes,) = plots.cam_figure(result).axes
    scale = 1e3 if angle is None else 180.0 / np.pi
    first, beyond, second, at = axes.lines[:4]
    assert (first.get_label(), second.get_label()) == ("arc 1, turns left", "arc 2, turns right")
    assert [first.get_xydata()] == over(scale * S[:2], [2.0, 2.0])
    assert [second.get_xydata()] == over(scale * S[2:], [4.0, 4.0])
    assert [beyond.get_xydata()] == over(scale * S[:3], [5.0, 5.0, 5.0])
    assert at.get_xdata()[0] == pytest.approx(scale * S[1])
    assert asked == [(True, 0, 7, pytest.approx(0.06)), (True, 0, 8, pytest.approx(0.06))]
    (text,) = axes.texts
    assert text.get_text() == ("20.00°" if angle is not None else "349.07 mm")


def test_a_cam_is_drawn_from_the_begin_to_the_end_of_its_arcs():
    """A quarter to the left, then three quarters to the right, then a circle without ends."""
    ends = np.array([[1, 0, 0, 1, 1], [1, 0, 0, 1, -1], [0, 0, 0, 0, 1]], dtype=float)
    linkage = Made(
        joint=np.array([[9, 9, 9, 9, 9, 9], [0, 0, 0, 0, 0, 3]]),
        arc_ends=ends,
        arc_radius=np.array([[0.5, 0.25, 2.0]]),
        arc_point=np.array([0, 1, 1]),
        point=np.array([[[1.0, 2.0], [3.0, 4.0]]]),
        point_body=np.array([0, 5]),
    )
    moved = {0: 0.0, 5: 10.0}  # how far the bodies lie to the right

    def at(body, x, y):
        return np.array([[x + moved[body], y]]), None

    motion = Made(model=Made(linkage=linkage), at=at)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "cam_rows", lambda _: {"cam": 1})
        line = drawing._cam(motion, "cam")
    assert (line.kind, line.name) == ("cam", "cam")
    (outline,) = line.xy
    for k, (centre, radius, turn) in enumerate(
        [
            ((1.0, 2.0), 0.5, 0.5 * np.pi),
            ((13.0, 4.0), 0.25, -1.5 * np.pi),
            ((13.0, 4.0), 2.0, 2.0 * np.pi),
        ]
    ):
        x, y = (outline[k * drawing.ARC_POINTS : (k + 1) * drawing.ARC_POINTS] - centre).T
        assert np.hypot(x, y) == pytest.approx(radius)
        turned = np.unwrap(np.arctan2(y, x))
        assert turned[-1] - turned[0] == pytest.approx(turn)
        assert np.diff(turned) == pytest.approx(turn / (drawing.ARC_POINTS - 1))
        assert (x[0], y[0]) == pytest.approx((radius, 0.0))


@pytest.mark.parametrize("start", [0.0, 2.0])
def test_a_roller_is_kept_on_its_arc_a_bit_beyond_its_ends(monkeypatch, start):
    """From 0.6 to 0.9 of the driver, 0.2 beyond both ends but not beyond the mechanism's."""
    Linkage = namedtuple("Linkage", "joint arc_ends")
    joint = np.arange(12).reshape(2, 6)
    model = Made(linkage=Linkage(joint, np.ones((4, 5))), start=start, end=2.0 - start)
    s = np.array([0.3, 0.6, 0.9, 1.5])
    motion = Made(
        model=model,
        arcs=np.array([[0, 2], [0, 3], [0, 3], [0, 2]]),
        s=s,
        q=np.arange(4.0)[:, None],
        known={"x": 1},
    )
    monkeypatch.setattr(cams, "replace", lambda one, **given: Made(**vars(one) | given))
    solved = []
    monkeypatch.setattr(cams, "solve", lambda *given: solved.append(given) or "found")
    assert cams.on_one_arc(motion, 1, 3, 0.2) == "found"
    free, places, first = solved[0]
    assert free.linkage.joint.tolist() == [[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 3, 1]]
    assert free.linkage.arc_ends.tolist() == [[1.0] * 5] * 3 + [[0.0] * 4 + [1.0]]
    assert (places[0], places[-1], len(places)) == (pytest.approx(0.4), pytest.approx(1.1), 101)
    assert (first.s, first.q, first.arcs.tolist(), first.known) == (0.6, 1.0, [[0, 3]], {})
    assert (joint == np.arange(12).reshape(2, 6)).all()
    cams.on_one_arc(motion, 1, 3, 5.0)
    assert (solved[1][1][0], solved[1][1][-1]) == (0.0, 2.0)

    def impossible(*_):
        raise InputError([])

    monkeypatch.setattr(cams, "solve", impossible)
    assert cams.on_one_arc(motion, 1, 3, 0.2) is None


def two_results(**first):
    ratio, force = 1.0 + HEIGHT, 1e3 + 100.0 * HEIGHT
    zone = {k: {"height": x} for k, x in (("low", 0.1), ("work", 0.2), ("high", 0.3))}
    one = made({"ratio": ratio, "force": force}, zone=zone, **first)
    other = made({"ratio": ratio + 0.5, "force": force - 20.0}, zone=zone)
    none = made({}, zone=zone)
    return {"one": one, "other": other, "none": none}


def test_mechanisms_are_compared_over_the_height(monkeypatch):
    monkeypatch.setattr(plots, "force_units", lambda _: "N")
    ratios, forces = plots.comparison_figure(two_results()).axes
    x = 1e3 * HEIGHT
    assert [*long(ratios).values()] == over(x, 1.0 + HEIGHT, 1.5 + HEIGHT)
    assert [*long(forces).values()] == over(x, 1e3 + 100.0 * HEIGHT, 980.0 + 100.0 * HEIGHT)
    assert [len(axes.patches) for axes in (ratios, forces)] == [1, 1]
    assert forces.get_ylabel() == "force (N)"
    above, force, less, change = plots.comparison_figure(two_results(), zoom=True).axes
    inside = np.array([100.0, 300.0])
    drawn = [line.get_xydata() for axes in (above, force, less, change) for line in axes.lines]
    assert drawn == over(
        inside,
        [1.1, 1.3],
        [1.6, 1.8],
        [1010.0, 1030.0],
        [990.0, 1010.0],
        [0.0, 0.0],
        [0.5, 0.5],
        [0.0, 0.0],
        [-20.0, -20.0],
    )
    assert not above.patches


def test_held_pressures_are_compared_with_their_contact_forces():
    results = two_results(contact=Made(pressure=0.35e6, curve=70.0 + HEIGHT))
    for result in list(results.values())[:2]:
        result.output["pressure"] = 1e6 * (0.3 + HEIGHT)
    needed, force = plots.held_figure(results).axes
    assert [*long(needed).values()] == over(1e3 * HEIGHT, 0.3 + HEIGHT, 0.3 + HEIGHT)
    assert [*long(force)] == ["one, 0.3500 MPa"]
    assert [*long(force).values()] == over(1e3 * HEIGHT, 70.0 + HEIGHT)
    assert needed.get_ylim()[0] == 0.0


def test_ends_of_a_search_are_drawn_by_what_they_keep():
    """A start that could not be assembled stands as high as the worst one."""
    ends = [(1, 2.0, True), (2, 5.0, False), (3, np.inf, False), (4, 1.5, True), (5, 0.0, True)]
    starts = [Start(*end) for end in ends]
    optimum = Made(starts=starts, objective=1.5, objective_before=4.0)
    (axes,) = plots.search_figure(optimum).axes
    drawn = {line.get_label(): line.get_xydata().tolist() for line in axes.lines}
    assert drawn["all constraints kept"] == [[1.0, 2.0], [4.0, 1.5]]
    assert drawn["a constraint broken"] == [[2.0, 5.0]]
    assert drawn["not assembled"] == [[3.0, 5.0]]
    assert [y for _, y in drawn["best 1.5"]] == [1.5, 1.5]
    assert [y for _, y in drawn["file 4"]] == [4.0, 4.0]
    nothing = Made(starts=[Start(1, np.inf, False)], objective=0.0, objective_before=0.0)
    (line,) = plots.search_figure(nothing).axes[0].lines
    assert line.get_xydata().tolist() == [[1.0, 1.0]]


Start = make_dataclass("Start", ["number", "objective", "feasible"])


def test_lines_of_a_mechanism_are_drawn_at_one_position_in_millimetres():
    xy = 1e-3 * np.arange(12.0).reshape(2, 3, 2)
    axes = plt.figure().subplots()
    parts = [drawing.Line(kind, "name", xy) for kind in ("link", "guide", "body")]
    first, second, third = plots.draw(axes, parts, 1, "k", "words")
    for line in (first, second, third):
        assert line.get_xydata() == pytest.approx(np.array([[6.0, 7.0], [8.0, 9.0], [10.0, 11.0]]))
    assert [line.get_marker() for line in (first, second, third)] == ["o", "", "o"]
    assert first.get_label() == "words"
    assert not {second.get_label(), third.get_label()} & {"words"}


@pytest.mark.parametrize("box", [None, (0.0, 0.25, 0.0, 0.3)])
def test_points_are_marked_where_they_are_at_first(monkeypatch, box):
    """Triangles on the ground; outside of a box none."""
    named = []
    known = {"ground.A": [0.1, 0.2], "rod.B": [0.2, 0.1], "rod.C": [0.3, 0.1], "rod.D": [0.1, 0.4]}
    monkeypatch.setattr(plots, "points", lambda _: {k: np.array([v]) for k, v in known.items()})
    monkeypatch.setattr(plots, "joint_points", lambda _: {i: k for i, k in enumerate(known)})
    monkeypatch.setattr(plots, "lines", lambda _: [])
    monkeypatch.setattr(plots, "name_points", lambda axes, points, lines: named.append(points))
    axes = plt.figure().subplots()
    plots.mark_points(axes, None, box)
    shown = {"A": [100.0, 200.0], "rod.B": [200.0, 100.0]}
    if box is None:
        shown |= {"rod.C": [300.0, 100.0], "rod.D": [100.0, 400.0]}
    assert {name: pytest.approx(xy) for name, xy in shown.items()} == named[0]
    drawn = [line.get_xydata()[0] for line in axes.lines]
    assert np.array(drawn) == pytest.approx(np.array([*shown.values()]))
    assert [line.get_marker() for line in axes.lines] == ["^"] + ["o"] * (len(shown) - 1)
