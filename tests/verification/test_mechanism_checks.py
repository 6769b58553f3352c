"""Checks of the pantograph's lifts against lengths, energies and angles of many positions.

Forces are those of the potential energy over the actuator's length, by differences; nothing of how
the program finds least and largest values between positions is used.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from railsim.definitions.loading import load_mechanism
from railsim.definitions.mechanism.parts import (
    Cylinder,
    GasSpring,
    HandForce,
    HandTorque,
    TorsionSpring,
)
from railsim.errors import InputError
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.cams import transitions
from railsim.mechanisms.checks import _forces, _gas_spring, checks, rod_drop
from railsim.mechanisms.dynamics import law_of
from railsim.mechanisms.forces import Rates, generalised_force
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.model import build
from railsim.mechanisms.remarks import _forces as held_back
from railsim.mechanisms.remarks import _gas_springs, _torsion_springs, remarks
from railsim.mechanisms.selection import selection
from railsim.mechanisms.summary import analysis_data
from railsim.mechanisms.tables import sentences

MASSES = {"boom": 22.68, "trapezoid": 16.17, "head": 14.58}
CHANGES = [
    "optimise.min_length=0.43", "optimise.max_stroke=0.11",
    "parameters.cylinders=2", "parameters.bore=0.12",
    "optimise.envelope=[{points=['boom.tip','slide.pin'],x=[0.3,1.8],y=[0.1,1.3]}]",
]  # fmt: skip


@pytest.fixture(scope="module")
def result():
    return analyse(load_mechanism("atr95_lift_4", CHANGES))


@pytest.fixture(scope="module")
def seen(result):
    """Lengths, heights, forces and angles at even positions of the travel."""
    model = result.model
    motion = solve(model, np.linspace(model.start, model.end, 4001))
    places = {name: motion.point(name)[0] for name in model.points}
    head = places[result.definition.output.point]
    tip, hinge, pin = (places[f"boom.{name}"] for name in ("tip", "hinge", "pin"))
    slide, foot = places["slide.pin"], places["ground.foot"]
    centre = 0.5 * (hinge + tip)[:, 1], 0.5 * (tip + head)[:, 1], head[:, 1]
    energy = 9.81 * sum(m * y for m, y in zip(MASSES.values(), centre, strict=True))
    length = np.hypot(*(foot - slide).T)
    force = np.gradient(energy, motion.s, edge_order=2) / np.gradient(
        length, motion.s, edge_order=2
    )
    d = {"rod": pin - slide, "crank": pin - hinge}
    lines = [np.arctan2(*d[name].T[::-1]) for name in ("rod", "crank")]
    return {
        "length": length, "height": head[:, 1] - head[0, 1], "force": force, "tip": tip,
        "slide": slide, "mu": lines[0] - lines[1], "mu_prime": lines[0] - 0.5 * np.pi,
        "energy": energy, "s": motion.s,
    }  # fmt: skip


def test_checks_are_those_of_all_positions(result, seen):
    length, force = seen["length"], seen["force"]
    area = 2.0 * 0.25 * np.pi * 0.12**2
    stroke = np.ptp(length)
    made = min(s for s in (0.08, 0.1, 0.125, 0.16) if s >= stroke)
    sharp = {name: np.min(np.arcsin(np.abs(np.sin(seen[name])))) for name in ("mu", "mu_prime")}
    both = np.concatenate([seen["tip"], seen["slide"]])
    height = [np.interp(y, seen["height"], seen["s"]) for y in (0.5955, 0.8955, 1.1955)]
    needed = [np.interp(s, seen["s"], seen["force"]) for s in height]
    rise = np.gradient(seen["height"], seen["s"]) / np.gradient(length, seen["s"])
    per_length = [np.interp(s, seen["s"], rise) for s in height]
    held = needed[1] + 100.0 * per_length[1]  # 100 N at work height
    contact = [(held - F) / tau for F, tau in zip(needed, per_length, strict=True)]
    wanted = [
        ("available_force", np.max(force), 0.7e6 * area, "below"),
        ("pulls", np.min(force), 0.0, "above"),
        ("runs_ahead", np.min(force), 0.0, "above"),
        ("mu", sharp["mu"], np.radians(40.0), "above"),
        ("mu_prime", sharp["mu_prime"], np.radians(40.0), "above"),
        ("min_length", np.min(length), 0.43, "above"),
        ("max_stroke", stroke, 0.11, "below"),
        ("pin_to_pin", np.min(length), 0.315 + made, "above"),
        ("envelope.0", np.min(both[:, 0]), 0.3, "above"),
        ("envelope.0", np.max(both[:, 0]), 1.8, "below"),
        ("envelope.0", np.min(both[:, 1]), 0.1, "above"),
        ("envelope.0", np.max(both[:, 1]), 1.3, "below"),
        ("contact_force", np.min(contact), 0.0, "above"),
        ("held_pressure", held / area, 0.7e6, "below"),
    ]
    found = checks(result)
    assert [(one.name, one.sense) for one in found] == [(row[0], row[3]) for row in wanted]
    for one, (name, value, limit, sense) in zip(found, wanted, strict=True):
        assert (one.value, one.limit) == pytest.approx((value, limit), rel=2e-5), name
        apart = (value - limit) * (1.0 if sense == "above" else -1.0)
        assert one.ok == (apart >= -1e-5 * abs(limit)), name
    assert result.contact.force == pytest.approx(
        dict(zip(("low", "work", "high"), contact, strict=True)), rel=1e-4
    )
    assert result.contact.pressure == pytest.approx(held / area, rel=1e-5)
    data = analysis_data(result, courses=False)
    assert data["ok"] == all(one.ok for one in found)
    assert data["max_force_at"] == pytest.approx(seen["s"][np.argmax(force)], abs=1e-3)
    zone = [data["zone"]["force"][name] for name in ("low", "work", "high")]
    assert zone == pytest.approx(needed, rel=1e-5)


def test_a_bore_is_chosen_that_gives_the_largest_force_and_a_stroke_that_fits(result, seen):
    """The least one: two cylinders of F/(2 p) each, one after the other of the made sizes."""
    bore = np.sqrt(4.0 * np.max(seen["force"]) / (2.0 * 0.7e6 * np.pi))
    stroke = np.ptp(seen["length"])
    made = min(s for s in (0.08, 0.1, 0.125, 0.16) if s >= stroke)
    short = np.min(seen["length"]) < 0.315 + made - 1e-9
    for choice in selection(result):
        size = 1e-3 * float(choice.name.split()[1])
        assert choice.fits == (size >= bore and not short), choice
        assert any("bore" in why for why in choice.reasons) == (size < bore)


@pytest.mark.parametrize("body", ["boom", "trapezoid"])
def test_friction_of_a_joint_takes_work_whichever_way_its_body_turns(body):
    """The trapezoid turns against the boom: Q = -M |theta'| on the way, and + on the way back."""
    rubbing = [f"elements.rub={{joint_friction='{body}',moment=50.0}}"]
    found = build(load_mechanism("atr95_lift_5", rubbing))
    motion = solve(found, np.linspace(found.start, found.end, 9))
    turning = motion.q1[:, found.bodies[body], 2]
    assert np.all(turning > 0.0) == (body == "boom")
    without = generalised_force(motion, Rates())
    for way in (1, -1):
        taken = generalised_force(motion, Rates(friction=way)) - without
        assert taken == pytest.approx(-way * 50.0 * np.abs(turning))


def test_a_motion_by_table_lasts_from_its_first_time_to_its_last():
    """Of rows that begin at 2 s; a cubic through four of them."""
    rows = [(2.0, 0.1), (3.0, 0.2), (4.5, 0.25), (5.0, 0.4)]
    law = SimpleNamespace(law="table", table=rows)
    function, duration = law_of(SimpleNamespace(number=float), law, 0.3)
    assert duration == 3.0
    cubic = np.polynomial.Polynomial.fit(*np.transpose(rows), 3)
    t = np.linspace(0.0, 3.0, 7)
    for k, values in enumerate(function(t)):
        assert values == pytest.approx(cubic.deriv(k)(t + 2.0) if k else cubic(t + 2.0))


def test_arcs_of_a_cam_are_counted_from_one_where_the_roller_changes_between_them():
    """Of three arcs in their order, at 9.16 and 26.70 degrees of travel; both rates agree there."""
    found = build(load_mechanism("atr95"))
    one, other = transitions(solve(found, np.linspace(found.start, found.end, 101)))
    assert (one.before, one.after, other.before, other.after) == (1, 2, 2, 3)
    travel = np.degrees([one.travel, other.travel])
    assert travel == pytest.approx([9.16, 26.70], abs=0.01)
    for change in (one, other):
        assert change.rate_before == pytest.approx(change.rate_after, rel=1e-6)
        assert change.gap < 1e-9


def by_name(found, name):
    (check,) = (one for one in checks(found) if one.name == name)
    return check


def test_the_supply_pressure_of_an_air_spring_is_a_limit():
    """The largest pressure is that at the end: 0.48390 MPa (MECHANISMS, cam with R1)."""
    for supply, ok in ((0.485e6, True), (0.480e6, False)):
        changed = load_mechanism("atr95", [f"parameters.supply_pressure={supply}"])
        check = by_name(analyse(changed), "available_pressure")
        assert check.value == pytest.approx(0.48390e6, abs=50.0)
        assert check.ok == ok


def test_no_pressure_above_the_supply_can_be_held():
    for pressure, ok in ((0.59e6, True), (0.61e6, False)):
        held = [f"parameters.held_pressure={pressure}", "parameters.supply_pressure=0.6e6"]
        assert by_name(analyse(load_mechanism("atr95", held)), "held_pressure").ok == ok


def test_a_force_that_the_search_allows_is_a_limit_of_a_cylinder_too():
    """9803 N are needed; bore and supply give 14074 N."""
    for allowed, ok in ((9900.0, True), (9000.0, False)):
        changed = load_mechanism("atr95_lift_5", [f"optimise.available_force={allowed}"])
        check = by_name(analyse(changed), "available_force")
        assert (check.limit, check.ok) == (allowed, ok)


def test_an_actuator_whose_ends_meet_has_no_direction():
    changed = load_mechanism("atr95_lift_4", ["parameters.shortest_length=0.0"])
    with pytest.raises(InputError, match=r"ground\.foot: driver at 0\.0000 deg: meets slide\.pin"):
        analyse(changed)  # was a traceback


PENDULUM = """
format = "railsim-mechanism/1"
name = "arm"
[ground.points]
hinge = [0.0, 0.0]
foot = [0.1, 0.0]
[bodies.arm]
points = { hinge = [0.0, 0.0], pin = [0.3, 0.0] }
mass = 10.0
[joints.hinge]
revolute = ["ground.hinge", "arm.hinge"]
[driver]
angle = "arm"
start = -0.7
end = 2.4
[output]
point = "arm.pin"
[actuators.lift]
piston = ["ground.foot", "arm.pin"]
[actuators.hand]
turn = "arm"
[solve]
unknown = "hand"
"""


def test_a_motion_law_is_refused_where_its_length_turns_back(tmp_path):
    """The pin is nearest to the foot at 0 degrees: the arm jumped from -0.7 to 0.7 rad."""
    path = tmp_path / "arm.toml"
    law = '[motion]\nactuator = "lift"\nunknown = "hand"\nduration = 2.0\n'
    path.write_text(PENDULUM + law)
    with pytest.raises(InputError, match=r"motion: driver at 0.* the length turns back"):
        analyse(load_mechanism(path))
    path.write_text(PENDULUM.replace("start = -0.7", "start = 0.1") + law)
    assert np.all(np.diff(analyse(load_mechanism(path)).timed.motion.s) > 0.0)


@pytest.mark.parametrize("turns", [0, -1])
def test_it_is_said_that_a_torsion_spring_is_wound_by_a_turn_too_many(tmp_path, turns):
    """The same rocker with its angle in [start] written as 69 or as -291 degrees."""
    path = tmp_path / "arm.toml"
    rocker = (
        "[bodies.rod]\npoints = { pin = [0.0, 0.0], end = [0.5, 0.0] }\n"
        f"[start]\nrod = {{ angle = {1.2 + turns * 2.0 * np.pi} }}\n"
        '[joints.end]\nrevolute = ["arm.pin", "rod.pin"]\n'
        '[joints.guide]\nslot = ["rod.end", "ground.hinge"]\nangle = "pi / 2"\n'
        '[elements.coil]\ntorsion_spring = ["rod", "ground"]\nstiffness = 2.0\nfree_angle = 1.0\n'
    )
    path.write_text(PENDULUM.replace("-0.7", "0.1").replace("2.4", "1.2") + rocker)
    said = [text for text in remarks(analyse(load_mechanism(path))) if "wound" in text]
    assert len(said) == abs(turns)


def test_it_is_said_that_what_is_let_go_leaves_the_travel(tmp_path):
    """Without friction the arm swings as high on the other side, -pi - 1."""
    path = tmp_path / "arm.toml"
    arm = PENDULUM.replace("mass = 10.0", "mass = 10.0\ncentre = [0.2, 0.0]")
    for until, left in ((2.4, True), (-0.7, False)):
        path.write_text(f"{arm}[release]\nstart = 1.0\nuntil = {until}\nduration = 3.0\n")
        (said,) = (text for text in sentences(analyse(load_mechanism(path))) if "let go" in text)
        assert ("leaves the travel, up to -237" in said) == left


def test_it_is_said_that_a_height_is_reached_again(tmp_path):
    """The pin is 0.25 m high before and after 90 degrees; it ends at 0.203 m."""
    path = tmp_path / "arm.toml"
    zone = "[zone]\nlow = 0.1\nwork = 0.25\nhigh = 0.25\n"
    path.write_text(PENDULUM.replace("-0.7", "0.0") + zone)
    found = [text for text in remarks(analyse(load_mechanism(path))) if "again" in text]
    at = np.degrees(np.arcsin(0.25 / 0.3))
    words = "the output reaches zone.{} again; results are those at {:.4f} deg"
    assert found == [words.format(name, at) for name in ("work", "high")]


UNDER, OVER = np.nextafter(20e5, 0.0), np.nextafter(250e5, 3e7)


@pytest.mark.parametrize(
    ("least", "most", "rod_end", "drop", "words"),
    [
        (20e5, 250e5, None, 0.0, []), (UNDER, 250e5, None, 0.0, ["usual 20 to 250 bar"]),
        (20e5, OVER, None, 0.0, ["20.0 to 250.0 bar, usual"]),
        (11e5, 262e5, None, 0.0, ["11.0 to 262.0 bar, usual"]),
        (None, None, None, 0.01, ["rod at ground.foot, the lower end"]),
        (None, None, None, -0.01, ["rod at arm.pin, the lower end"]),
        (None, None, "arm.pin", 0.01, []), (11e5, 90e5, None, 0.01, ["11.0 to 90.0", "rod at"]),
    ],
)  # fmt: skip
def test_what_is_said_of_a_gas_spring(monkeypatch, least, most, rod_end, drop, words):
    """Makers fill them to 20 to 250 bar; the oil lies at the rod's end where that is below."""
    monkeypatch.setattr("railsim.mechanisms.remarks.rod_drop", lambda *_: drop)
    spring = GasSpring.model_construct(gas_spring=("ground.foot", "arm.pin"), rod_end=rod_end)
    result = SimpleNamespace(
        definition=SimpleNamespace(elements={"other": None, "flap": spring}),
        output={} if least is None else {"flap_pressure": None},
        extremes=lambda name: SimpleNamespace(least=least, most=most),
    )
    found = list(_gas_springs(result))
    assert len(found) == len(words)
    assert all("'flap'" in said and word in said for word, said in zip(words, found, strict=True))


@pytest.mark.parametrize("value", [-30.0, 24.9, 25.1, 80.0])
@pytest.mark.parametrize(("rod_end", "sign"), [("ground.foot", 1.0), ("arm.pin", -1.0)])
def test_a_gas_spring_is_checked_against_temperature_and_the_end_of_its_rod(
    monkeypatch, value, rod_end, sign
):
    """The second end is 0.1 m over the first: a rod at the first one points down."""
    monkeypatch.setattr("railsim.mechanisms.checks.rod_drop", lambda *_: 0.1)
    spring = SimpleNamespace(
        temperature=value, service=(-30, 80), gas_spring=("ground.foot", "arm.pin"), rod_end=rod_end
    )
    warm, down = _gas_spring(SimpleNamespace(model=SimpleNamespace(number=float)), "flap", spring)
    assert (warm.limit, warm.sense) == ((-30.0, "above") if value < 25.0 else (80.0, "below"))
    assert warm.ok
    assert (down.value, down.limit, down.sense, down.ok) == (0.1 * sign, 0.0, "above", sign > 0.0)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("turned", [179.9, 180.1])
def test_a_torsion_spring_is_remarked_from_half_a_turn_on(turned, sense):
    """Angle of the first body less that of the second, less the free one."""
    at = np.radians([20.0, 20.0 + sense * turned])
    q = np.zeros((2, 3, 3))
    q[:, 1, 2], q[:, 2, 2] = at + 0.4, 0.4
    coil = TorsionSpring.model_construct(torsion_spring=("arm", "rod"), free_angle=at[0])
    table = TorsionSpring.model_construct(torsion_spring=("arm", "rod"), free_angle=None)
    result = SimpleNamespace(
        definition=SimpleNamespace(elements={"other": None, "table": table, "coil": coil}),
        motion=SimpleNamespace(q=q),
        model=SimpleNamespace(bodies={"arm": 1, "rod": 2}, number=float),
    )
    found = list(_torsion_springs(result))
    assert len(found) == (turned > 180.0)
    assert all(f"'coil' is wound by up to {turned:.1f} deg" in said for said in found)


def forces(kind, least, most, back=None, turns=1.0, sense=1, optimise=None, **part):
    """Checks of an unknown force between `least` and `most` [N], `back` on the way back."""
    values = {"force": (least, most)} | ({"force_back": back} if back else {})
    amounts = [abs(x) for pair in values.values() for x in pair]
    result = SimpleNamespace(
        model=SimpleNamespace(number=float, sense=sense), output=values, motion=None,
        definition=SimpleNamespace(optimise=optimise, held_by=None),
        extremes=lambda name: SimpleNamespace(least=values[name][0], most=values[name][1]),
        peak_force=max(amounts),
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("railsim.mechanisms.checks.unit_work", lambda *_: np.array([turns]))
        patch.setattr(
            "railsim.mechanisms.checks.chamber_area",
            lambda model, part, acting: {"push": 0.02, "pull": 0.015}[acting],
        )
        result.definition.held_by = unknown = kind.model_construct(**part)
        return {one.name: (one.value, one.limit, one.sense) for one in _forces(result, unknown)}


@pytest.mark.parametrize(("acts", "least", "most"), [
    ("push", -200.0, 9e3), ("pull", -200.0, 9e3), ("both", -7e3, 9e3), ("both", 100.0, 900.0),
    ("both", -900.0, -100.0), ("push", -1e-9, 9e3),
])  # fmt: skip
@pytest.mark.parametrize("wanted", [None, 8e3])
@pytest.mark.parametrize("along", [1.0, -1.0])
def test_a_cylinder_has_the_force_of_its_chambers(acts, least, most, wanted, along):
    """6 bar on 200 cm2, with the rod 150 cm2; on the way back up to 100 N more or less."""
    optimise = None if wanted is None else SimpleNamespace(available_force=wanted)
    back = least - 100.0, most + 100.0
    low, high = back if least != -1e-9 else (least, most)
    found = forces(
        Cylinder, least, most, back if low < least else None, turns=along, optimise=optimise,
        acts=acts, supply_pressure=6e5,
    )  # fmt: skip
    chamber = {"push": 12e3, "both": 12e3, "pull": 9e3}[acts]
    limit = min(chamber, wanted or np.inf)
    ahead = least if along > 0.0 else -most
    expected = {
        "available_force": (max(high, 0.0), limit, "below"),
        "runs_ahead": (0.0 if ahead == -1e-9 else ahead, 0.0, "above"),
    }
    if acts == "both":
        expected["available_pull"] = max(-low, 0.0), min(9e3, wanted or np.inf), "below"
    else:
        name = "pulls" if acts == "push" else "pushes"
        expected[name] = 0.0 if low == -1e-9 else low, 0.0, "above"
    assert found == expected


@pytest.mark.parametrize("kind", [HandForce, HandTorque, Cylinder])
@pytest.mark.parametrize("least", [-12.345, -1e-9, 0.0, 3.0])
def test_a_hand_that_has_to_hold_back_is_remarked(monkeypatch, kind, least):
    """A cylinder is not, its check `runs_ahead` says so; a torque has its own unit."""
    monkeypatch.setattr("railsim.mechanisms.remarks.runs_ahead", lambda _: least)
    definition = SimpleNamespace(
        solve=True,
        unknown="grip",
        held_by=kind.model_construct(),
        actuators={"grip": kind.model_construct()},
    )
    found = list(held_back(SimpleNamespace(definition=definition)))
    unit = "N m" if kind is HandTorque else "N"
    said = f"'grip' holds back with up to {-least:.2f} {unit}: the load runs ahead"
    assert found == ([said] if kind is not Cylinder and least < 0.0 else [])


def test_ends_of_a_gas_spring_are_compared_where_it_is_shortest():
    """Its ends by hand: A on the ground, E on the plate 74 mm from the pivot."""
    result = analyse(load_mechanism("tilting_one_spring"))
    angle = np.linspace(result.model.start, result.model.end, 20_001)
    foot = 0.250 * np.exp(-0.9365244779983853j)
    end = 0.074 * np.exp(1j * (np.radians(-150.0) + angle))
    shortest = np.argmin(np.abs(end - foot))
    drop = end[shortest].imag - foot.imag
    assert rod_drop(result, "front") == pytest.approx(drop, abs=1e-5)
