"""Forces of random mechanisms: four-bars by slopes of energies, scissor lifts by free bodies.

The four-bar's loop is closed where two circles meet; energies and positions are differenced along
the driver, so that neither rates nor forces of railsim enter.  The scissor lift is cut into its
five bodies, whose fifteen conditions of equilibrium are solved.
"""

import numpy as np
import pytest

from railsim.definitions.mechanism.definition import Mechanism
from railsim.mechanisms.forces import actuator_force, generalised_force, inertia, reactions
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.model import build

G = 9.81
STEP = 1e-5  # rad


def turned(angle, point):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


def numbers(seed):
    """Lengths, points, springs and masses of a four-bar; `up`: on which side it is assembled."""
    draw = np.random.default_rng(seed).uniform
    lengths = {"a": draw(0.2, 0.3), "b": draw(0.6, 0.8), "c": draw(0.5, 0.7), "d": draw(0.6, 0.7)}
    points = {"centre": draw(-0.2, 0.4, 2), "eye": draw(-0.3, 0.3, 2), "post": draw(-1.5, -1.0, 2)}
    springs = {"k": draw(200.0, 900.0), "free": draw(0.5, 1.5), "twist": draw(5.0, 50.0)}
    gas = {"F1": draw(100.0, 500.0), "p": draw(1.2, 1.8), "T": draw(-30.0, 80.0)}
    law = ("linear", "isothermal")[seed // 2 % 2]
    masses = {"m": draw(1.0, 9.0), "I": draw(0.1, 0.5), "load": draw(1.0, 9.0)}
    return {**lengths, **points, **springs, **gas, **masses, "law": law, "up": (-1) ** seed}


def places(n, s):
    """Centre and eye of the coupler, end of the rocker, angle of the coupler at the driver `s`."""
    pin = turned(s, (n["a"], 0.0))
    away = np.array([n["d"] - pin[0], -pin[1]])
    square = np.sum(away**2, axis=0)
    share = (n["b"] ** 2 - n["c"] ** 2 + square) / (2.0 * square)
    across = n["up"] * np.sqrt(n["b"] ** 2 / square - share**2)
    rod = share * away + across * np.array([-away[1], away[0]])
    angle = np.arctan2(rod[1], rod[0])
    return pin + turned(angle, n["centre"]), pin + turned(angle, n["eye"]), pin + rod, angle


def energy(n, s):
    """Of weights, spring, torsion spring and gas spring [J]."""
    centre, eye, end, angle = places(n, s)
    total = G * (n["m"] * centre[1] + n["load"] * end[1])
    total += 0.5 * n["k"] * (np.hypot(*(eye.T - n["post"]).T) - n["free"]) ** 2
    total += 0.5 * n["twist"] * (s - angle - 0.3) ** 2
    share = (4.0 - np.hypot(*(end.T - n["post"]).T)) / 3.5  # of the stroke of 3.5 m
    if n["law"] == "linear":
        stored = share + 0.5 * (n["p"] - 1.0) * share**2
    else:
        stored = -np.log(1.0 - (1.0 - 1.0 / n["p"]) * share) / (1.0 - 1.0 / n["p"])
    return total + 3.5 * n["F1"] * (1.0 + 0.0036 * (n["T"] - 20.0)) * stored


def mechanism(n, begin, end):
    gas = {"gas_spring": ["ground.post", "coupler.end"], "F1": n["F1"], "progression": n["p"]}
    gas |= {"stroke": 3.5, "extended": 4.0, "law": n["law"], "temperature": n["T"]}
    spring = {"spring": ["coupler.eye", "ground.post"], "stiffness": n["k"]}
    points = {"pin": [0.0, 0.0], "end": [n["b"], 0.0], "eye": list(n["eye"])}
    body = {"mass": n["m"], "centre": list(n["centre"]), "inertia": n["I"]}
    return Mechanism.model_validate({
        "format": "railsim-mechanism/1",
        "ground": {"points": {"o": [0.0, 0.0], "right": [n["d"], 0.0], "post": list(n["post"])}},
        "bodies": {
            "crank": {"points": {"pin": [0.0, 0.0], "end": [n["a"], 0.0]}},
            "coupler": {"points": points, **body},
        },
        "start": {"crank": {"angle": begin}, "coupler": {"angle": float(places(n, begin)[3])}},
        "joints": {
            "left": {"revolute": ["ground.o", "crank.pin"]},
            "pin": {"revolute": ["crank.end", "coupler.pin"]},
            "rocker": {"link": ["coupler.end", "ground.right"], "length": n["c"]},
        },
        "driver": {"angle": "crank", "start": begin, "end": end},
        "actuators": {"hand": {"turn": "crank"}},
        "elements": {
            "gas": gas,
            "spring": spring | {"free_length": n["free"]},
            "bar": {"torsion_spring": ["crank", "coupler"], "stiffness": n["twist"],
                    "free_angle": 0.3},
            "load": {"point_mass": "coupler.end", "mass": n["load"]},
        },
        "solve": {"unknown": "hand"},
    })  # fmt: skip


@pytest.mark.parametrize("seed", range(8))
def test_forces_and_inertia_of_a_four_bar_are_those_of_its_energies(seed):
    n, s = numbers(seed), np.linspace(0.5, 1.8, 12)
    motion = solve(build(mechanism(n, s[0], s[-1])), s)
    force = -(energy(n, s + STEP) - energy(n, s - STEP)) / (2.0 * STEP)
    np.testing.assert_allclose(generalised_force(motion), force, atol=1e-8 * np.max(np.abs(force)))
    ahead, behind = places(n, s + STEP), places(n, s - STEP)
    centre, _, end, angle = ((p - q) / (2.0 * STEP) for p, q in zip(ahead, behind, strict=True))
    mass = n["m"] * np.sum(centre**2, axis=0) + n["load"] * np.sum(end**2, axis=0)
    mass += n["I"] * angle**2
    np.testing.assert_allclose(inertia(motion)[0], mass, rtol=1e-8)


# body 1 (None: ground), body 2, where on body 2: revolute joints, then pins on horizontal slots
HINGES = {
    "hinge": (None, "a1", "low"),
    "middle_1": ("a1", "b1", "middle"),
    "right": ("a1", "b2", "low"),
    "left": ("b1", "a2", "low"),
    "middle_2": ("a2", "b2", "middle"),
    "top": ("b2", "platform", "low"),
}
ROLLERS = {"roller": (None, "b1", "low"), "top_roller": ("platform", "a2", "top")}


def scissor(seed):
    """Points and masses of the bodies of a lift of two stages, its foot, travel and arm driven."""
    draw = np.random.default_rng(seed).uniform
    length = draw(1.2, 2.0)
    arm = {"low": [0.0, 0.0], "middle": [0.5 * length, 0.0], "top": [length, 0.0]}
    bodies = {}
    for name in ("a1", "b1", "a2", "b2"):
        lug = [draw(0.4, 0.9), draw(-0.2, 0.1)]
        mass = {"mass": draw(5.0, 40.0), "centre": [draw(0.4, 0.8), draw(-0.05, 0.05)]}
        bodies[name] = {"points": arm | {"lug": lug}, **mass}
    load = {"mass": draw(50.0, 300.0), "centre": [draw(0.1, 0.8), 0.1]}
    bodies["platform"] = {"points": {"low": [0.0, 0.0]}, **load}
    ends = draw(0.2, 0.35), draw(0.8, 1.1)
    return bodies, length, [draw(0.6, 1.2), -0.3], ends, ("a1", "a2")[seed % 2]


def poses(length, s):
    """Position and angle of the bodies of the lift at the angle `s` of its arms."""
    x, y = length * np.cos(s), length * np.sin(s)
    return {
        "a1": (0.0, 0.0, s),
        "b1": (x, 0.0, np.pi - s),
        "a2": (0.0, y, s),
        "b2": (x, y, np.pi - s),
        "platform": (0.0, 2.0 * y, 0.0),
    }


def free_bodies(lift, s):
    """Forces of the joints on body 2 by name, and the push of the actuator, last [N]."""
    bodies, length, foot, _, driven = lift
    pose = poses(length, s)

    def at(body, point):
        return np.array(pose[body][:2]) + turned(pose[body][2], point)

    def row(body, place, force):
        rows = np.zeros(15)
        k = 3 * list(bodies).index(body)
        rows[k : k + 2] = force
        rows[k + 2] = place[0] * force[1] - place[1] * force[0]  # about the origin
        return rows

    columns = []
    for joints, directions in ((HINGES, np.eye(2)), (ROLLERS, np.eye(2)[1:])):
        for one, two, name in joints.values():
            place = at(two, bodies[two]["points"][name])
            for force in directions:
                reaction = 0.0 if one is None else row(one, place, force)
                columns.append(row(two, place, force) - reaction)
    lug = at(driven, bodies[driven]["points"]["lug"])
    columns.append(row(driven, lug, (lug - foot) / np.hypot(*(lug - foot))))
    weights = [row(n, at(n, b["centre"]), (0.0, -G * b["mass"])) for n, b in bodies.items()]
    found = np.linalg.solve(np.array(columns).T, -np.sum(weights, axis=0))
    split = np.split(found, [2, 4, 6, 8, 10, 12, 13, 14])
    return dict(zip([*HINGES, *ROLLERS, "push"], split, strict=True))


@pytest.mark.parametrize("seed", range(4))
def test_forces_of_a_scissor_lift_are_those_of_its_free_bodies(seed):
    lift = scissor(seed)
    bodies, length, foot, ends, driven = lift
    start = poses(length, ends[0])
    joints = {
        n: {
            "revolute": [f"{one}.{'top' if p == 'low' else p}" if one else "ground.o", f"{two}.{p}"]
        }
        for n, (one, two, p) in HINGES.items()
    } | {
        n: {"slot": [f"{two}.{p}", f"{one}.low" if one else "ground.o"]}
        for n, (one, two, p) in ROLLERS.items()
    }
    model = build(Mechanism.model_validate({
        "format": "railsim-mechanism/1",
        "ground": {"points": {"o": [0.0, 0.0], "foot": foot}},
        "bodies": bodies,
        "start": {n: dict(zip(("x", "y", "angle"), p, strict=True)) for n, p in start.items()},
        "joints": joints,
        "driver": {"angle": "a1", "start": ends[0], "end": ends[1]},
        "actuators": {"lift": {"piston": ["ground.foot", f"{driven}.lug"]}},
        "solve": {"unknown": "lift"},
    }))  # fmt: skip
    s = np.linspace(*ends, 5)
    motion = solve(model, s)
    push = actuator_force(motion, "lift")
    found, _ = reactions(motion, {"lift": push})
    for k, angle in enumerate(s):
        expected = free_bodies(lift, angle)
        assert push[k] == pytest.approx(expected["push"][0], rel=1e-9)
        for name in [*HINGES, *ROLLERS]:
            size = np.linalg.norm(np.atleast_2d(found[name].T)[..., k])
            assert size == pytest.approx(np.linalg.norm(expected[name]), rel=1e-7), name
