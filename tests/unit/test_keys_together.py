"""Which keys of a definition go with each other: every combination against its rule by hand."""

from itertools import product

import pytest
from pydantic import ValidationError

from railsim.definitions.elements.actuator import Actuator
from railsim.definitions.elements.applied_force import AppliedForce
from railsim.definitions.elements.friction import SideBearer
from railsim.definitions.elements.springs import Bushing, SpringDamper
from railsim.definitions.elements.traction import Traction
from railsim.definitions.excitations.measured import Measured
from railsim.definitions.excitations.random import Random
from railsim.definitions.excitations.spectra import Coefficients
from railsim.definitions.measurement import MeasurementFile
from railsim.definitions.mechanism.definition import CatalogueRow, Driver, Motion
from railsim.definitions.mechanism.parts import Arc, Cam
from railsim.definitions.settings import Drive, Settings
from railsim.definitions.spring import InnerSpring
from railsim.definitions.study.definition import Spread
from railsim.definitions.study.design import Constraint, Optimise
from railsim.definitions.study.scenario import Speed
from railsim.definitions.track.rail_sections import RailSections
from railsim.definitions.track.support import Support
from railsim.definitions.vehicle.laws import Signal
from railsim.definitions.vehicle.loads import BodyLoad
from railsim.definitions.vehicle.out_of_round import Sections
from railsim.definitions.wear_law import WearLawFile
from railsim.errors import InputError

LAW = {"format": "railsim-wear-law/1", "name": "x", "source": "x"}
MAP = dict.fromkeys(("hardness", "pressure", "slow", "medium", "fast", "seizure"), 1.0)
ARCHARD, WORK = {"speeds": (0.2, 0.7), **MAP}, {"mild": 1.0, "severe": 2.0, "transition": 1.0}
TWO, ONE = ([0, 0, 0], [0, 0, -1]), [0.0, 0.0, 0.0]
PAIR = {"bodies": ["a", "b"]}
ACTS = {**PAIR, "kind": "actuator"}
PAD = {**PAIR, "kind": "side_bearer", "point": ONE, "stiffness": 1e7, "stick_stiffness": 1e7}
TABLE = [[0.0, 1.0], [10.0, 2.0]]
FORCES = [[0.0, 1.0, 0.0, 0.0]]
ROWS = [[s, 0.0, 0.0, 0.0, 0.0] for s in range(4)]
CONTOURS = [{"s": s, "y": [0.01 * k for k in range(8)], "z": [0.0] * 8} for s in (0.0, 0.5, 1.0)]
CATALOGUE = {"name": "x", "F1": (50.0, 400.0)}
DATA = {"format": "railsim-measurement/1", "name": "x", "file": "x.csv"}
OF_BODIES = {
    **dict.fromkeys(("displacement", "velocity", "acceleration"), ("x", "y", "z")),
    **dict.fromkeys(("angle", "angular_velocity"), ("roll", "pitch", "yaw")),
}
OF_ELEMENTS = ("deflection", "rate", "force", "power")
BALLAST = [1e8, 1e6]


def one(*values):
    """Exactly one is given."""
    return sum(value is not None for value in values) == 1


def none(*values):
    return all(value is None for value in values)


def together(*values):
    """All are given, or none."""
    return len({value is None for value in values}) == 1


def channels(time, distance, force):
    """A record's channels, those that are asked for."""
    found = {"time": time, "distance": distance, "Q:1:left": force}
    return {name.split(":")[0]: {"quantity": name} for name, there in found.items() if there}


def record(speed, rate, **there):
    given = {name: value for name, value in (("speed", speed), ("rate", rate)) if value}
    return MeasurementFile.model_validate({**DATA, **given, "channels": channels(**there)})


def of_signal(quantity, body, element, wheelset, side, axis, position, ahead):
    axes = OF_BODIES.get(quantity)
    return (
        (body is not None) == (axes is not None)
        and (element is not None) == (quantity in OF_ELEMENTS)
        and (wheelset is not None) == (quantity in ("wheel_speed", "Q", "Y"))
        and (side is not None) == (quantity in ("Q", "Y"))
        and (axis in axes if axes else axis is None or quantity in OF_ELEMENTS)
        and (position is None or "x" in (axes or ()))
        and (ahead is None or quantity in ("curvature", "cant_angle"))
    )


# a definition, what it needs, keys with the values that are tried, and which of them go together
RULES = {
    "speed of a test condition": (
        Speed, {}, {"fixed": [20.0], "admissible": [1.1], "cant_deficiency": [0.5], "radius": [9]},
        lambda fixed, admissible, cant_deficiency, radius: (
            one(fixed, True if admissible or cant_deficiency else None)
            and together(cant_deficiency, radius)
        ),
    ),
    "spread of a sample": (
        Spread, {}, {"low": [1.0], "high": [2.0], "nominal": [1.0], "tolerance": [0.1],
                     "mean": [1.0], "deviation": [0.1]},
        lambda low, high, nominal, tolerance, mean, deviation: (
            together(low, high) and together(nominal, tolerance) and together(mean, deviation)
            and one(low, nominal, mean)
        ),
    ),
    "limit of a design": (
        Constraint, {"quantity": "Q"}, {"low": [1.0], "high": [1.0, 2.0, 0.9]},
        lambda low, high: not none(low, high) and (low is None or high != 0.9),
    ),
    "what is sought": (
        Optimise, {"variables": {"vehicle.a": {"low": 1.0, "high": 2.0}}},
        {"method": ["nsga2", "differential_evolution"], "evaluations": [4, 5],
         "objectives": [[{"quantity": name} for name in names] for names in ("Q", "QY")]},
        lambda method, evaluations, objectives: (
            objectives is not None
            and (method != "differential_evolution" or (len(objectives) == 1 and evaluations != 4))
        ),
    ),
    "what is commanded of an actuator": (
        Actuator, ACTS, {"acts": ["x", "axle"], "command": ["damper", "position", "brake"],
                         "stiffness": [1e6], "damping": [1e3], "point": [ONE], "points": [TWO]},
        lambda acts, command, stiffness, damping, point, points: (
            (one(point, points) if acts == "x" else none(point, points) if acts == "axle"
             else none(point) and points is not None)
            and (stiffness is not None) == (command == "position")
            and (damping is None or command == "position")
            and command != ("position" if acts == "axle" else "brake")
        ),
    ),
    "limits of an actuator": (
        Actuator, {**ACTS, "points": TWO},
        {"acts": ["roll"], "lag": [0.0, 0.1], "rate_limit": [1.0], "against_axis": [True, False]},
        lambda acts, lag, rate_limit, against_axis: (
            (rate_limit is None or lag == 0.1) and (not against_axis or acts == "roll")
        ),
    ),
    "a torque about an axle": (
        Actuator, {**ACTS, "acts": "axle"}, {"stroke": [0.1], "sides": [True], "lag": [0.1]},
        lambda stroke, sides, lag: none(stroke, sides),
    ),
    "a drive over the distance": (
        Traction, {**PAIR, "kind": "traction", "torque_table": TABLE},
        {"over": ["time", "distance"], "demand_table": [TABLE]},
        lambda over, demand_table: over != "distance" or demand_table is not None,
    ),
    "a load on a body": (
        AppliedForce, {"bodies": ["a"], "kind": "applied_force"},
        {"force_table": [FORCES], "torque_table": [FORCES]},
        lambda force_table, torque_table: not none(force_table, torque_table),
    ),
    "a side bearer": (
        SideBearer, {**PAD, "friction_coefficient": 0.2},
        {"preload": [1e3], "clearance": [1e-3], "stop_travel": [0.01], "stop_stiffness": [1e8]},
        lambda preload, clearance, stop_travel, stop_stiffness: (
            none(preload and clearance) and together(stop_travel, stop_stiffness)
        ),
    ),
    "preload of a spring": (
        SpringDamper, {**PAIR, "kind": "spring_damper", "points": TWO, "stiffness": 1e5},
        {"free_length": [1.1], "load_at_length": [(1e3, 1.0)], "preload": ["auto", 0.0, 1e3]},
        lambda free_length, load_at_length, preload: (
            none(free_length and load_at_length)
            and (preload != 1e3 or none(free_length, load_at_length))
        ),
    ),
    "a bushing of a free length": (
        Bushing, {**PAIR, "kind": "bushing"},
        {"free_length": [1.1], "point": [ONE], "points": [TWO],
         "stiffness": [[1e6, 1e6, 0], [0, 0, 1e6]]},
        lambda free_length, point, points, stiffness: (
            one(point, points)
            and (free_length is None or (points is not None and stiffness == [0, 0, 1e6]))
        ),
    ),
    "laws of wear": (
        WearLawFile, LAW,
        {"archard": [ARCHARD], "krause_poll": [WORK], "whole_life_rail_model": [{}]},
        lambda archard, krause_poll, whole_life_rail_model: (
            one(archard, krause_poll)
            or (none(archard, krause_poll) and whole_life_rail_model is not None)
        ),
    ),
    "speed along the track": (
        Drive, {}, {"mode": ["constant", "table", "free"], "speed_table": [TABLE],
                    "traction_table": [TABLE], "resistance": [(0, 0, 1.0), (0.0, 0.0, 0.0)]},
        lambda mode, speed_table, traction_table, resistance: (
            (speed_table is not None) == (mode == "table")
            and (mode == "free" or (none(traction_table) and resistance != (0, 0, 1.0)))
        ),
    ),
    "a creep law's curve": (
        Settings, {}, {"creep_law": ["fastsim", "adhesion_curve"],
                       "adhesion_curve": [[[0.0, 0.0], [1.0, 0.3]]]},
        lambda creep_law, adhesion_curve: (
            (creep_law == "adhesion_curve") == (adhesion_curve is not None)
        ),
    ),
    "an inner spring": (
        InnerSpring, {"mean_diameter": 0.1, "free_height": 0.2},
        {"engagement": [0.0, 0.01], "seat_height": [0.0, 0.01]},
        lambda engagement, seat_height: None in (engagement, seat_height),
    ),
    "what drives a mechanism": (
        Driver, {"end": 1.0}, {"angle": ["a"], "length": [["a.p", "b.q"]], "coordinate": ["a.p"]},
        lambda angle, length, coordinate: one(angle, length, coordinate),
    ),
    "a law of motion": (
        Motion, {}, {"actuator": ["a"], "angle": ["b"],
                     "law": ["constant_speed", "polynomial_345", "table"], "speed": [1.0],
                     "duration": [1.0], "table": [[[t, t] for t in range(k)] for k in (3, 4)]},
        lambda actuator, angle, law, speed, duration, table: (
            one(actuator, angle)
            and (table is not None and len(table) == 4 if law == "table"
                 else duration is not None if law == "polynomial_345" else one(speed, duration))
        ),
    ),
    "strokes in a catalogue": (
        CatalogueRow, CATALOGUE, {"stroke": [(0.1, 0.2)], "strokes": [(0.1, 0.15)]},
        lambda stroke, strokes: one(stroke, strokes),
    ),
    "an arc of a cam": (
        Arc, {"radius": 1.0, "turns": "left"}, {"length": [1.0], "centre": [(0.0, 0.0)]},
        lambda length, centre: one(length, centre),
    ),
    "a cam": (
        Cam, {"cam": "a.p"},
        {"path": ["b.q"], "body": ["b"],
         "arcs": [[{"radius": 1.0, "turns": "left", key: value} for key, value in arcs]
                  for arcs in ([("length", 1.0)], [("length", 1.0)] * 2,
                               [("centre", (0.0, 0.0))] * 2,
                               [("length", 1.0), ("centre", (0.0, 0.0))])]},
        lambda path, body, arcs: (
            arcs is not None and len({*arcs[0]} ^ {*arcs[-1]}) == 0
            and (path is not None) == ("length" in arcs[0])
            and (body is not None) == ("centre" in arcs[0])
        ),
    ),
    "sections of a rail": (
        RailSections, {"rail": "left", "begin": 0.0, "end": 1.0},
        {"file": ["x.slcs"], "contours": [CONTOURS], "trailing": [True, False]},
        lambda file, contours, trailing: one(file, contours) and not (trailing and contours),
    ),
    "support of the rails": (
        Support, {}, {"preset": ["rigid", "ballasted", "p2"], "ballast_vertical": [BALLAST],
                      "ballast_lateral": [BALLAST], "ballast_base": [0.7], "sleeper_mass": [0.0],
                      "variation": [[[0.0, 1.0], [9.0, 2.0]]]},
        lambda preset, ballast_vertical, ballast_lateral, ballast_base, sleeper_mass, variation: (
            none(ballast_vertical, ballast_lateral, ballast_base, sleeper_mass, variation)
            if preset == "rigid"
            # `p2` has a rail with mass on pads alone: a sleeper beside it would need its own
            else none(ballast_vertical, ballast_lateral, ballast_base, sleeper_mass)
            if preset == "p2" else True
        ),
    ),
    "masses under a rail": (
        Support, {"preset": "co-running"},
        {"rail_mass": [0.0, 60.0], "sleeper_mass": [0.0, 1e3], "sleeper_inertia": [0.0, 400.0]},
        lambda rail_mass, sleeper_mass, sleeper_inertia: (
            len({rail_mass == 0.0, sleeper_mass == 0.0, sleeper_inertia == 0.0}) == 1
        ),
    ),
    "coefficients of spectra": (
        Coefficients, {},
        {"lateral": [1e-7], "vertical": [1e-7], "cross_level": [1e-7], "gauge": [1e-7]},
        lambda **given: not none(*given.values()),
    ),
    "spectra": (
        Random, {"type": "random"},
        {"spectrum": ["own", "china_trunk", "erri_b176_low"], "coefficients": [{"gauge": 1e-7}],
         "channels": [["gauge"], ["lateral", "vertical"]]},
        lambda spectrum, coefficients, channels: (
            spectrum is not None and (coefficients is not None) == (spectrum == "own")
            and (spectrum != "china_trunk" or channels != ["gauge"])
        ),
    ),
    "a recorded irregularity": (
        Measured, {"type": "measured"},
        {"file": ["x.csv"], "rows": [ROWS], "mileage": [0.0], "encoding": ["latin-1"],
         "reverse": [("y",)], "falling_mileage": [True, False], "chord": [(5.0, 5.0)],
         "shift": [3.0]},
        lambda file, rows, mileage, encoding, reverse, falling_mileage, chord, shift: (
            one(file, rows)
            and (rows is None or none(encoding, reverse, falling_mileage or None, chord))
            and (file is None or none(mileage))
        ),
    ),
    "sections of a wheel": (
        Sections, {"type": "sections"},
        {"file": ["x.slcw"], "angles": [[0.0, 2.0, 4.0]], "positions": [[0.0, 1.0]],
         "heights": [[[0.0, 0.0]] * 3]},
        lambda file, angles, positions, heights: (
            none(angles, positions, heights) if file
            else None not in (angles, positions, heights)
        ),
    ),
    "what a signal is of": (
        Signal, {},
        {"quantity": [*OF_BODIES, *OF_ELEMENTS, "wheel_speed", "Q", "Y", "curvature",
                      "cant_angle", "time", "distance", "speed"],
         "body": ["b"], "element": ["e"], "wheelset": ["w"], "side": ["left"],
         "axis": ["z", "yaw"], "position": [(0.0, 0.0, 0.0)], "ahead": [5.0]},
        lambda quantity, **rest: quantity is not None and of_signal(quantity, **rest),
    ),
    "samples of a signal": (
        Signal, {"quantity": "time"},
        {"rate": [1e3, 1e5], "delay": [0.0, 11.0, 10.0], "noise": [0.0, 0.1]},
        lambda rate, delay, noise: (
            not (rate == 1e5 and delay == 11.0) if rate else not (delay or noise)
        ),
    ),
    "what loads a body": (
        BodyLoad, {}, {"mass": [1e4], "inertia": [(1e3, 1e4, 1e4)], "position": [(0.0, 0.0, -1.0)]},
        lambda mass, inertia, position: not none(mass, inertia, position),
    ),
    "axes of a record": (
        record, {}, {"speed": [20.0], "rate": [200.0], "time": [True], "distance": [True],
                     "force": [True]},
        lambda speed, rate, time, distance, force: (
            one(rate, time) and not none(speed, distance) and force is not None
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "needed", "keys", "rule"), RULES.values(), ids=RULES)
def test_every_combination_is_taken_or_refused_by_its_rule(kind, needed, keys, rule):
    """A key is left out, or has one of its values."""
    wrong = []
    for values in product(*([None, *values] for values in keys.values())):
        given = {key: value for key, value in zip(keys, values, strict=True) if value is not None}
        all_keys = dict(zip(keys, values, strict=True))
        try:
            kind(**needed, **(all_keys if kind is record else given))
            taken = True
        except (ValidationError, InputError):
            taken = False
        if taken != rule(**all_keys):
            wrong.append(given)
    assert wrong == []
