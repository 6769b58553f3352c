"""Borders: the last value that a definition takes and the next one, and what a limit belongs to."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import ValidationError

from railsim.assessment.comfort_report import class_of
from railsim.assessment.conditions import _conicity_conditions
from railsim.assessment.criteria import CRITERIA
from railsim.assessment.model_comparison import QUANTITIES, Comparison, Pair
from railsim.assessment.tables import zone_table
from railsim.assessment.wear import Patches, archard, krause_poll, pearce_sherratt_1991, usfd
from railsim.assessment.zones import Assessed
from railsim.definitions.elements.actuator import Actuator
from railsim.definitions.elements.friction import CentrePlate, Friction, SideBearer, Wedge
from railsim.definitions.elements.rows import FrictionLimit
from railsim.definitions.elements.springs import BumpStop, SpringDamper
from railsim.definitions.elements.traction import Traction
from railsim.definitions.excitations.measured import Measured
from railsim.definitions.excitations.random import Random
from railsim.definitions.excitations.sweep import Sweep
from railsim.definitions.limits import RunningLimits, Zone
from railsim.definitions.loading import (
    load_comfort_limits,
    load_running_limits,
    load_spring,
    load_wheel_limits,
)
from railsim.definitions.measurement import Channel
from railsim.definitions.settings import Settings
from railsim.definitions.spring import Fatigue, HelicalSpring, Search
from railsim.definitions.study.definition import Spread
from railsim.definitions.study.design import Optimise, Variable
from railsim.definitions.track.definition import Track
from railsim.definitions.track.rail_sections import Contour, RailSections
from railsim.definitions.vehicle.laws import Signal
from railsim.definitions.vehicle.names import size_faults
from railsim.definitions.vehicle.out_of_round import RadiusTable
from railsim.definitions.vehicle.out_of_round import Sections as WheelSections
from railsim.definitions.vehicle.tables import Service
from railsim.definitions.wear_law import ArchardMap, FrictionWork, WearLawFile
from railsim.errors import InputError
from railsim.observation import Assumed
from railsim.report.limits import _cell, _limit
from railsim.simulation.conditions import check_range, initial_speed
from railsim.studies.stationary import StationaryValue

TINY = 5e-324  # the smallest number above 0
PAIR = {"bodies": ["a", "b"]}
AT = {**PAIR, "point": [0.0, 1.0, -0.5]}
TRACK = {"format": "railsim-track/1", "name": "x", "plan": [{"type": "STR", "length": 99.0}]}
LINE = Track.model_validate(TRACK)
IN_TABLE = Settings(drive={"mode": "table", "speed_table": [[0.0, 10.0], [100.0, 30.0]]})
LAW = {"format": "railsim-wear-law/1", "name": "x", "source": "x"}
CURVE = [0.0, 1.0]


def below(x):
    """The next smaller number."""
    return math.nextafter(x, -math.inf)


def above(x):
    return math.nextafter(x, math.inf)


def plate(**how):
    return CentrePlate(
        **PAIR, kind="centre_plate", point=[0, 0, -1], radius=0.2, stiffness=1e8,
        friction_coefficient=0.2, stick_stiffness=1e7, **how,
    )  # fmt: skip


def wedge(mu=0.3, **how):
    where = {} if "points" in how else {"point": [0.0, 1.0, -0.5]}
    return Wedge(
        **PAIR, **where, kind="wedge", stiffness=[0, 0, 1e6], angle=0.5, friction_coefficient=mu,
        stick_stiffness=[1e7, 1e7], **how,
    )  # fmt: skip


def seats(z):
    return wedge(points=[[0.0, 1.0, z], [0.0, 1.0, -0.5]])


def friction(force, coefficient=0.0, sticking=1e6, **how):
    return Friction(
        **AT, kind="friction", friction_force=[force, 0, 0],
        friction_coefficient=[coefficient, 0, 0], stick_stiffness=[sticking, 0, 0], **how,
    )  # fmt: skip


def bearer(clearance):
    return SideBearer(
        **AT, kind="side_bearer", stiffness=1e7, preload=1e3, clearance=clearance,
        friction_coefficient=0.2, stick_stiffness=1e7,
    )  # fmt: skip


def stop(*rows):
    return BumpStop(**AT, kind="bump_stop", axis="z", table=rows)


def strut(**how):
    return SpringDamper(**PAIR, kind="spring_damper", points=[[0, 0, 0], [0, 0, -1]], **how)


def actuator(**how):
    return Actuator(**AT, kind="actuator", acts="z", **how)


def motor(*slips):
    return Traction(**PAIR, kind="traction", torque_table=[[0.0, 1e3]], slip_control=slips)


def signal(**how):
    return Signal(quantity="speed", **how)


def zone(**how):
    given = {"cant_deficiency": [0.0, 1.0], "section": [[40.0, 250.0]], "section_above": 500.0}
    return Zone(**{**given, "sections": 25, "source": "x", **how})


def helical(wire, mean=0.2):
    return HelicalSpring(mean_diameter=mean, free_height=0.4, wire_diameter=wire)


def variables(*names):
    found = {"variables": {names[0]: {"low": 1.0, "high": 2.0, "also": names[1:]}}}
    return Optimise(**found, objectives=[{"quantity": "Q"}])


def contour(back=0.0, top=0.0):
    """A rail's section that goes back by some way, with its top so far below the rail tops."""
    y = np.linspace(0.0, 0.07, 8)
    y[4] = y[3] - back
    return Contour(s=0.0, y=tuple(y), z=tuple(top + (y - y.mean()) ** 2))


def sections(end):
    return RailSections(rail="right", file="x.csv", begin=2.0, end=end)


def wear(*speeds):
    rest = dict.fromkeys(("hardness", "pressure", "slow", "medium", "fast", "seizure"), 1.0)
    return WearLawFile(**LAW, archard=ArchardMap(speeds=speeds, **rest))


def wheel(last):
    three = [0.0, 2.0, last]
    return WheelSections(type="sections", angles=three, positions=CURVE, heights=[CURVE] * 3)


# what is built of a value, values that are taken, values that are refused
BORDERS = {
    "a run has from 0.5 to 150 m/s": (
        lambda v: check_range(LINE, v, 0.0, None, None), [0.5, 150.0], [below(0.5), above(150.0)]
    ),
    "it begins on the track, of 99 m": (
        lambda s: check_range(LINE, 20.0, s, None, None), [0.0, below(99.0)], [below(0.0), 99.0]
    ),
    "ends there too, behind its start": (
        lambda s: check_range(LINE, 20.0, 9.0, None, s), [above(9.0), 99.0], [9.0, above(99.0)]
    ),
    "lasts some time": (
        lambda t: check_range(LINE, 20.0, 0.0, t, None), [TINY], [0.0, math.inf]
    ),
    "irregularities that are sought have waves of 1 m and longer": (
        lambda low: Assumed(wavelengths=(low, 300.0)).check(), [1.0, below(300.0)],
        [below(1.0), 300.0],
    ),
    "and of up to 300 m": (
        lambda high: Assumed(wavelengths=(3.0, high)).check(), [300.0], [above(300.0)]
    ),
    "has the speed of its table, to a thousandth": (
        lambda v: initial_speed(IN_TABLE, v, 50.0), [19.981, 20.019], [19.979, 20.021]
    ),
    "Poisson's ratio is below 0.5": (
        lambda x: Settings(poisson=x), [0.0, below(0.5)], [0.5]
    ),
    "the ring of a centre plate has a width": (
        lambda r: plate(inner_radius=r), [0.0, below(0.2)], [0.2]
    ),
    "a wedge slides where mu < tan(angle)": (
        wedge, [0.0, below(math.tan(0.5))], [math.tan(0.5)]
    ),
    "a wedge never pulls": (
        lambda f: wedge(preload=[0, 0, f]), [0.0, 1e3], [-TINY]
    ),
    "the bolster rests on the wedges, z down": (
        seats, [-0.5, -0.4], [below(-0.5)]
    ),
    "friction that falls has a speed": (
        lambda r: friction(1e3, sliding_ratio=r), [1.0], [below(1.0), 0.5]
    ),
    "a friction element has friction": (
        friction, [TINY, 1e3], [0.0]
    ),
    "and by the load alone too": (
        lambda mu: friction(0.0, mu, stiffness=[0, 0, 1e3]), [TINY, 0.3], [0.0]
    ),
    "what slides sticks elastically": (
        lambda k: friction(TINY, 0.0, k), [TINY, 1e6], [0.0]
    ),
    "what has a clearance has no preload": (
        bearer, [0.0], [TINY, 1e-3]
    ),
    "a characteristic has two rows, from 0 or below to above 0": (
        lambda rows: stop(*rows),
        [[[0, 0], [TINY, 0]], [[-1, -1], [TINY, 1]], [[-1, 0], [0, 0], [1, 0]]],
        [[[0, 0]], [[TINY, 0], [1, 1]], [[-1, -1], [0, 0]], [[0, 1], [1, 2]]],
    ),
    "its force may stay and not fall": (
        lambda f: stop([0, 0], [1, 2], [2, f]), [2.0, 3.0], [below(2.0)]
    ),
    "its first column rises": (
        lambda x: stop([0, 0], [1, 2], [x, 3]), [above(1.0)], [1.0, below(1.0)]
    ),
    "a spring has one law": (
        lambda k: strut(stiffness=k, spring_table=[[0, 0], [1, 2]]), [0.0], [TINY]
    ),
    "a damper has one law": (
        lambda c: strut(damping=c, damper_table=[[0, 0], [1, 2]]), [0.0], [TINY]
    ),
    "a stiffness in series has a damper": (
        lambda k: strut(series_stiffness=k), [0.0], [TINY]
    ),
    "a free length has a stiffness": (
        lambda k: strut(stiffness=k, free_length=1.1), [TINY], [0.0]
    ),
    "a position is held": (
        lambda k: actuator(command="position", stiffness=k), [TINY], [0.0]
    ),
    "a force is not held": (
        lambda k: actuator(stiffness=k), [0.0], [TINY]
    ),
    "nor damped": (
        lambda c: actuator(damping=c), [0.0], [TINY]
    ),
    "slips of a control rise": (
        lambda s: motor(s, 0.02), [0.0, below(0.02)], [0.02, 0.03]
    ),
    "a delay needs samples": (
        lambda t: signal(delay=t), [0.0], [TINY]
    ),
    "noise needs samples": (
        lambda t: signal(noise=t), [0.0], [TINY]
    ),
    "an irregularity has a length": (
        lambda end: Random(type="random", spectrum="erri_b176_low", begin=5.0, end=end),
        [above(5.0), None], [5.0, 4.0],
    ),
    "the second wavelength is the longer one": (
        lambda w: Random(type="random", spectrum="erri_b176_low", wavelengths=[3.0, w]),
        [above(3.0)], [3.0, 2.9],
    ),
    "a sweep has a length": (
        lambda end: Sweep(
            type="sweep", amplitude=1e-3, wavelengths=[3.0, 3.0], begin=5.0, end=end
        ),
        [above(5.0)], [5.0],
    ),
    "a measured irregularity has four rows": (
        lambda n: Measured(type="measured", rows=[[s, 0, 0, 0, 0] for s in range(n)]), [4], [3]
    ),
    "each irregularity once": (
        lambda names: Random(type="random", spectrum="erri_b176_low", channels=names),
        [["lateral"], ["lateral", "vertical"]], [["lateral", "lateral"]],
    ),
    **{
        f"{name} of a zone rises": (
            lambda x, name=name: zone(**{name: [0.5, x]}), [above(0.5)], [0.5, 0.4]
        )
        for name in ("radius", "mean_radius", "cant_deficiency", "speed")
    },
    **{
        f"{name} of a channel rises": (
            lambda x, name=name: Channel(quantity="Q:1:left", **{name: [2.0, x]}),
            [above(2.0)], [2.0, 1.0],
        )
        for name in ("zero", "range")
    },
    "a spring is wound": (
        helical, [below(0.2)], [0.2, 0.21]
    ),
    "bounds of a search do not fall": (
        lambda x: Search(outer_diameter_max=0.3, free_height=[0.4, x]), [0.4, 0.5], [below(0.4)]
    ),
    "stresses of a fatigue diagram do not cross": (
        lambda x: Fatigue(goodman=[[0.0, 4e8], [5e8, x]]),
        [5e8, 6e8], [below(5e8)],
    ),
    "the ends of a sample rise": (
        lambda x: Spread(low=1.0, high=x), [above(1.0)], [1.0, 0.9]
    ),
    "equal ratios need two ends of one sign": (
        lambda x: Spread(low=x, high=1.0, scale="log"), [TINY * 2, 0.5], [0.0, -1.0]
    ),
    "bounds of a design rise": (
        lambda x: Variable(low=1.0, high=x), [above(1.0)], [1.0, 0.9]
    ),
    "bounds in equal ratios lie above zero": (
        lambda x: Variable(low=x, high=1.0, scale="log"), [TINY], [0.0, -1.0]
    ),
    "each variable once": (
        lambda names: variables(*names),
        [["vehicle.a"], ["vehicle.a", "vehicle.b"]], [["vehicle.a", "vehicle.a"]],
    ),
    "the slip area is no stiffer than the adhesion area": (
        lambda x: Track(**TRACK, third_body=[0.5, x]), [TINY, 0.5], [above(0.5)]
    ),
    "a rail's section goes back by 5 mm at most": (
        lambda x: contour(back=x), [0.0, 4.99e-3], [5.01e-3]
    ),
    "its top is within 10 mm of the rail tops": (
        lambda x: contour(top=x), [-9.9e-3, 9.9e-3], [-10.2e-3, 10.1e-3]
    ),
    "sections reach over 0.1 m": (
        sections, [2.0 + 0.1], [below(2.0 + 0.1)]
    ),
    "sliding speeds rise": (
        lambda x: wear(0.2, x), [above(0.2)], [0.2, 0.1]
    ),
    "a table of radii is less than a turn": (
        lambda x: RadiusTable(type="table", rows=[[0.0, 0.0], [3.0, 1e-3], [x, 0.0]]),
        [6.28], [2.0 * math.pi],
    ),
    "sections of a wheel are a turn at most": (
        wheel, [2.0 * math.pi], [6.29]
    ),
    "and rise": (
        wheel, [above(2.0)], [2.0, 1.9]
    ),
}  # fmt: skip


def is_taken(build, value):
    try:
        build(value)
    except (ValidationError, InputError):
        return False
    return True


@pytest.mark.parametrize(("build", "taken", "refused"), BORDERS.values(), ids=BORDERS)
def test_the_last_value_is_taken_and_the_next_refused(build, taken, refused):
    assert [value for value in taken if not is_taken(build, value)] == []
    assert [value for value in refused if is_taken(build, value)] == []


COMFORT, RUNNING = load_comfort_limits("comfort"), load_running_limits("en14363")
WHEEL = load_wheel_limits("wheel")
SOUND = {"flange_thickness": 0.03, "flange_height": 0.03, "flange_slope": 0.01, "hollow": 0.0}
SERVICE = Service(admissible_speed=30.0, cant_deficiency=0.15)  # m/s, m
# a patch of 0.5 m2 under 1 N whose friction of 1 takes 1 J/m
PATCH = {"T_gamma": 1.0, "area": 0.5, "diameter": 1.0 / math.pi, "N": 1.0, "friction": 1.0}


def is_worn_out(name, value):
    return bool(WHEEL.reached({**SOUND, name: value}))


def compared(mean_limit, limit, least=2):
    """Differences of 0.25 and 0.75: their mean is 0.5, their standard deviation sqrt(1/8)."""
    pairs = [Pair("Q", "run", "1", k, k, 1.0, 1.0, 1.25 + 0.5 * k) for k in (0, 1)]
    return Comparison(QUANTITIES["Q_qst"], tuple(pairs), limit, mean_limit, least).verdict


def conicity(*values):
    return [c.state for c in _conicity_conditions(np.array(values), RUNNING.conicity, SERVICE)]


def archard_k(speed=0.1, pressure=4.0):
    """Coefficient of a map with slow 1, medium 2, fast 3, seizure 4."""
    law = ArchardMap(
        hardness=1.0, pressure=pressure, speeds=(0.25, 0.5), slow=1.0, medium=2.0, fast=3.0,
        seizure=4.0,
    )  # fmt: skip
    return float(archard(Patches(**{k: np.array(v) for k, v in PATCH.items()}, speed=speed), law))


def severe(speed):
    law = FrictionWork(mild=1.0, severe=2.0, transition=0.5)
    patch = Patches(**{k: np.array(v) for k, v in PATCH.items()}, speed=speed)
    return float(krause_poll(patch, law)) > 1.5 / 7850.0


def exceeded(share):
    estimate = SimpleNamespace(value=2.0 * share)
    return Assessed.exceeded.fget(SimpleNamespace(estimate=estimate, limit=2.0))


def index_remarks(ratio):
    """Of an outer spring of 32 mm wire."""
    suspension = load_spring("tare_laden_example")
    size = {"wire_diameter": 0.03125, "mean_diameter": 0.03125 * ratio}
    suspension = suspension.model_copy(update={"outer": suspension.outer.model_copy(update=size)})
    return any("spring index" in remark.text for remark in suspension.unusual())


# a function, and its values at a border and beside it
AT_THE_BORDER = {
    "comfort is worse from a border of its classes on (EN 12299)": (
        lambda n: class_of(COMFORT.mean_comfort, n),
        [(below(1.5), "very comfortable"), (1.5, "comfortable"), (2.5, "medium"),
         (3.5, "uncomfortable"), (below(4.5), "uncomfortable"), (4.5, "very uncomfortable")],
    ),
    "a value at its limit does not exceed it, but for rounding": (
        exceeded, [(1.0, False), (1.0 + 0.9e-9, False), (1.0 + 1.1e-9, True)]
    ),
    "nor in a stationary test": (
        lambda x: StationaryValue("", "", x, 1.0, "").exceeded, [(1.0, False), (above(1.0), True)]
    ),
    "of a model too, in the mean": (
        lambda x: compared(x, 1.0), [(0.5, "pass"), (below(0.5), "pass"), (0.499999, "fail")]
    ),
    "and in the standard deviation": (
        lambda x: compared(1.0, x), [(math.sqrt(0.125), "pass"), (0.3535, "fail")]
    ),
    "as many sections as needed are enough": (
        lambda n: compared(1.0, 1.0, n), [(2, "pass"), (3, "incomplete")]
    ),
    "conicities at the ends of their classes are of them, up to 120 km/h": (
        lambda x: conicity(*x),
        [((0.2, 0.4), ["met"] * 2), ((above(0.2), 0.4), ["not met", "met"]),
         ((0.2, below(0.4)), ["met", "not met"])],
    ),
    **{
        f"a wheel at the limit of its {name} is worn out": (
            lambda x, name=name: is_worn_out(name, x), [(value, True), (beside(value), False)]
        )
        for name, value, beside in (
            ("flange_thickness", 0.022, above), ("flange_slope", 0.0065, above),
            ("flange_height", 0.036, below), ("hollow", 0.002, below),
        )
    },
    "Pearce and Sherratt: 25 from 100 to 200 N, a step there": (
        lambda T: round(float(1e9 * pearce_sherratt_1991(T, 1e-3)), 6),
        [(100.0, 25.0), (200.0, 25.0), (200.001, 84.00119)],
    ),
    "USFD: 5.3 x to 10.4, a step to 55, which holds to 77.2": (
        lambda x: round(float(1e3 * usfd(1e6 * x)), 3),
        [(10.4, 55.12), (10.401, 55.0), (77.2, 55.0), (77.201, 55.062)],
    ),
    "Archard's map by sliding speed": (
        archard_k, [(below(0.25), 1.0), (0.25, 2.0), (below(0.5), 2.0), (0.5, 3.0)]
    ),
    "and by pressure, here 3 times the hardness": (
        lambda p: archard_k(pressure=p), [(3.0, 1.0), (below(3.0), 4.0)]
    ),
    "EN 13906-1 covers hot coiled springs of an index from 3 to 12": (
        index_remarks, [(2.99, True), (3.0, False), (12.0, False), (12.01, True)]
    ),
    "a vehicle of 200 wheelsets is one": (
        lambda n: bool(size_faults({"wheelsets": {str(k): {} for k in range(n)}})),
        [(200, False), (201, True)],
    ),
    "dry friction of any force is friction": (
        lambda force: FrictionLimit(force=force).exists, [(0.0, False), (TINY, True)]
    ),
    "and of any coefficient": (
        lambda mu: FrictionLimit(coefficient=mu).exists, [(0.0, False), (TINY, True)]
    ),
    "wear by the work of friction is severe above its transition": (
        severe, [(0.25, False), (above(0.25), True)]
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("of", "taken"),
    [("sum_Y", True), ("frame_y", True), ("frame_instability", False), ("unknown", False)],
)
def test_a_limit_is_a_share_of_one_that_is_no_share_itself(of, taken):
    share = {"law": "share", "value": 0.5, "of": of, "source": "x"}
    whole = RUNNING.model_dump(mode="json", exclude_none=True)
    whole["limits"]["instability"] = share
    assert is_taken(RunningLimits.model_validate, whole) is taken


@pytest.mark.parametrize(("function", "values"), AT_THE_BORDER.values(), ids=AT_THE_BORDER)
def test_what_a_border_belongs_to(function, values):
    assert [(x, function(x)) for x, _ in values] == values


def test_an_estimate_above_its_limit_reads_so_on_terminal_and_page():
    """38.652 kN beside 38.65 kN are 38.65 both, and 38.7 to three digits."""
    estimate = SimpleNamespace(value=38652.0, N=1, mean=38652.0, deviation=0.0, method="largest")
    row = Assessed(CRITERIA["sum_Y"], "wheelset 1", estimate, 38650.0)
    assert row.exceeded
    zone = SimpleNamespace(title="zone 4", values=[1], needed=25, nearest=[row])
    shown = zone_table(zone).texts()[0]
    assert shown[-3:] == ["38.652", "38.65", "100.01"]
    apart = SimpleNamespace(population=SimpleNamespace(name=""))
    assert (_cell((apart, row))[0], _limit(row)[0]) == ("38.652", "38.65 kN")
