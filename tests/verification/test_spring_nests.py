"""What a search says of a nest: the same as the verification of that nest, and no better nest near.

The verification computes one nest after the other from a file, the search thousands at once.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from selection import points

from railsim.definitions.loading import load_spring
from railsim.errors import InputError
from railsim.springs import nests, search
from railsim.springs.datasheet import data_sheets
from railsim.springs.design import design
from railsim.springs.nests import Dimensions, evaluate
from railsim.springs.summary import coils_by_wire
from railsim.springs.vehicle_table import base_of, vehicle_part, vehicle_text
from railsim.springs.verification import fatigue, load_cases, verify

CHANGES = [
    "search.stress_ratio_max=0.98", "search.buckling_ratio_max=0.8", "search.active_coils_min=2.5",
    "checks.clearance_factor=0.01", "checks.fatigue_margin=1.2", 'loads."T.I."=75e3',
    'checks.solid_load="CUM"', "search.clearance_min=0.006",
]  # fmt: skip
# wires, mean diameters, coils of outer and inner spring, free heights of the outer one
NESTS = np.array(
    [
        [0.041, 0.027, 0.230, 0.142, 3.6, 6.0, 0.338],
        [0.040, 0.030, 0.225, 0.140, 3.2, 7.0, 0.345],
        [0.042, 0.024, 0.236, 0.150, 3.9, 4.2, 0.352],
        [0.039, 0.028, 0.232, 0.148, 3.9, 6.0, 0.420],
    ]
)


@pytest.fixture(scope="module")
def suspension():
    found = load_spring("turasas_axlebox", CHANGES)
    inner = found.inner.model_copy(update={"free_height": 0.330})
    return found.replace(inner=inner.model_dump(exclude_none=True))


@pytest.fixture(scope="module")
def seen(suspension):
    d, D, n, H0 = NESTS[:, :2].T, NESTS[:, 2:4].T, NESTS[:, 4:6].T, NESTS[:, 6]
    return evaluate(nests.task_of(suspension), Dimensions(d, D, H0), n)


def built(suspension, row):
    d, D, n, H0 = row[:2], row[2:4], row[4:6], (row[6], row[6] - 0.008)
    changes = {}
    for k, name in enumerate(("outer", "inner")):
        table = suspension.springs[name].model_dump(exclude_none=True)
        sizes = {"wire_diameter": d[k], "mean_diameter": D[k], "active_coils": n[k]}
        changes[name] = table | sizes | {"free_height": H0[k]}
    return suspension.replace(**changes)


@pytest.mark.parametrize("k", range(len(NESTS)))
def test_slacks_of_a_search_are_the_checks_of_the_verification(suspension, seen, k):
    own, limits = built(suspension, NESTS[k]), suspension.search
    result = verify(own)
    checks = {check.name: check for check in result.checks}
    sheets = data_sheets(own, result)
    slack = {name: values[k] for name, values in seen.slack.items()}
    largest = max(result.cases, key=lambda case: case.load)
    for i, name in enumerate(("outer", "inner")):
        d, D, n = NESTS[k, i], NESTS[k, 2 + i], NESTS[k, 4 + i]
        gap = [checks[f"{kind}_{name}"] for kind in ("solid_height", "coil_clearance")]
        solid = sheets[name].values["L_solid"]
        heights = [check.value / check.limit for check in gap]
        least = min(*heights, float(largest.springs[name].height) / solid)
        assert slack[f"height_{name}"] == pytest.approx(least - 1.0, rel=1e-9)
        stress = checks[f"yield_{name}"]
        assert slack[f"yield_{name}"] == pytest.approx(1.0 - stress.value / stress.limit / 0.98)
        bent = checks[f"buckling_{name}"]
        ratio = 0.0 if "does not buckle" in bent.note else bent.value / bent.limit
        assert slack[f"buckling_{name}"] == pytest.approx(1.0 - ratio / 0.8)
        margin = fatigue(own)[name].margin
        assert seen.margin[i, k] == pytest.approx(margin, rel=1e-9)
        assert slack[f"fatigue_{name}"] == pytest.approx(margin / 1.2 - 1.0)
        assert slack[f"coils_{name}"] == pytest.approx(n / 2.5 - 1.0)
        low, high = limits.spring_index
        assert slack[f"index_{name}"] == pytest.approx(min(D / d / low - 1.0, 1.0 - D / d / high))
    (d1, d2), (D1, D2), H0 = NESTS[k, :2], NESTS[k, 2:4], NESTS[k, 6]
    gap = checks["radial_clearance"]
    assert slack["radial_clearance"] == pytest.approx((gap.value - 0.006) / d2)
    assert slack["outer_diameter"] == pytest.approx(1.0 - (D1 + d1) / limits.outer_diameter_max)
    inside = D2 - d2 - limits.inner_diameter_min
    assert slack["inner_diameter"] == pytest.approx(inside / D2)
    low, high = limits.free_height
    assert slack["free_height_min"] == pytest.approx(H0 / low - 1.0)
    assert slack["free_height_max"] == pytest.approx(1.0 - H0 / high)
    mounting, target = suspension.mounting, suspension.target
    weaker = min(sheet.values["K_V"] for sheet in sheets.values())
    share = weaker * mounting.deflection / mounting.load  # 2 % of the nest's stiffness at least
    assert slack["stiffness"] == pytest.approx(share / 0.02 - 1.0)
    assert slack["equilibrium"] > 0.0
    assert seen.mass[k] == pytest.approx(sum(sheet.values["mass"] for sheet in sheets.values()))
    (there,) = [case for case in result.cases if case.load == pytest.approx(target.load)]
    errors = float(result.arm.coils[0].start) - mounting.deflection, there.deflection
    expected = errors[0], errors[1] - target.deflection
    assert seen.deflection_error[:, k] == pytest.approx(expected, abs=1e-12)
    assert seen.feasible[k] == (min(slack.values()) >= 0.0)


def test_coils_of_a_search_give_the_wanted_deflections(suspension):
    """And a target that no pair of springs meets breaks the limit of the stiffness."""
    task = nests.task_of(suspension)
    x = Dimensions(NESTS[:, :2].T, NESTS[:, 2:4].T, NESTS[:, 6])
    exact = evaluate(task, x)
    as_built = evaluate(task, x, exact.n)
    assert as_built.deflection_error == pytest.approx(0.0, abs=1e-10)
    for name, values in exact.slack.items():
        assert as_built.slack[name] == pytest.approx(values, rel=1e-7, abs=1e-9), name
    heavy = replace(task, demand=replace(task.demand, target_load=2.0 * task.demand.target_load))
    broken = evaluate(heavy, x)
    assert broken.slack["stiffness"].tolist() == [-1.0] * len(NESTS)
    assert not broken.feasible.any()


@pytest.mark.parametrize("objective", ["mass", "fatigue"])
def test_no_better_nest_lies_near_an_optimum(objective):
    """Random steps around it that keep every limit, of three sizes."""
    changes = ["search.wire_diameters=[0.027, 0.041]", f"search.objective={objective}"]
    suspension = load_spring("turasas_axlebox", changes)
    task = nests.task_of(suspension)
    d = np.array([[0.041], [0.027]])
    begin = Dimensions(d, np.array([[0.226], [0.135]]), np.array([0.330]))
    (found,) = search._run_together(task, [search._optimum(task, begin, 0)])
    assert found.worst > -1e-6

    def aim(seen):
        return seen.mass if objective == "mass" else 1.0 / np.min(seen.margin, axis=0)

    best = aim(evaluate(task, found.dimensions))[0]
    random, count = np.random.default_rng(1), 600
    size = np.repeat([1e-4, 1e-3, 1e-2], count // 3)
    D = found.dimensions.D * (1.0 + size * random.normal(size=(2, count)))
    H0 = found.dimensions.H0 * (1.0 + size * random.normal(size=count))
    near = evaluate(task, Dimensions(np.repeat(d, count, axis=1), D, H0))
    assert near.feasible.any()
    assert np.min(aim(near)[near.feasible]) >= best * (1.0 - 1e-6)


def test_candidates_use_the_space_and_keep_to_it(suspension):
    """Where the wires leave room, diameters lie evenly between the limits on either side."""
    task = nests.task_of(suspension)
    limits = task.limits.model_copy(update={"candidates": 2048})
    x = search.candidates(limits, task.wires)
    (d1, d2), (D1, D2) = x.d, x.D
    w_min, w_max = limits.spring_index
    wires = d1 + d2 + 2.0 * limits.clearance_min
    least = np.maximum(w_min * d2, limits.inner_diameter_min + d2)
    low = np.maximum(w_min * d1, least + wires), least
    high = (
        np.minimum(w_max * d1, limits.outer_diameter_max - d1),
        np.minimum(w_max * d2, D1 - wires),
    )
    shares = [(D - a) / (b - a) for D, a, b in zip((D1, D2), low, high, strict=True)]
    shares.append((x.H0 - limits.free_height[0]) / np.ptp(limits.free_height))
    room = (low[0] < high[0]) & (low[1] < high[1])
    assert room.sum() > 1000
    for share in shares:
        own = np.sort(share[room])
        assert own == pytest.approx((np.arange(len(own)) + 0.5) / len(own), abs=0.03)
    assert set(np.unique(x.d)) == set(task.wires)


@points(
    ("changes", "cause"),
    [
        ([], "solid height of the outer"),
        (["outer.active_coils=3.0"], "solid height of the inner"),
        (["outer.free_height=0.75", "outer.active_coils=5.8"], "solid height of the inner"),
        (["outer.free_height=0.75", "inner.active_coils=4"], "buckles the outer"),
        (["outer.free_height=0.75", "inner.free_height=0.5"], "buckles the inner"),
    ],
    always=(0, 4),
)  # fmt: skip
def test_of_two_ends_the_one_that_is_met_first_is_named_with_its_load(changes, cause):
    own = load_spring("turasas_axlebox", changes)

    def obstacle(load):
        try:
            load_cases(own, {"one": load})
        except InputError as error:
            return error.faults[0].found
        return ""

    low, high = own.mounting.load, 600e3
    assert not obstacle(low)
    assert cause in obstacle(high)
    while high - low > 1.0:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if obstacle(middle) else (middle, high)
    found = obstacle(high)
    assert cause in found
    said = re.search(r"(?:, under|reached under) ([\d.]+) kN", found)
    assert float(said[1]) == pytest.approx(1e-3 * high, abs=0.052)  # it is printed to 0.1 kN


@pytest.mark.parametrize(("load", "verb"), [(90e3, "raise"), (72e3, "reduce")])
def test_deflections_that_a_refused_design_offers_are_those_that_do(load, verb):
    changes = [f"target.load={load}"]
    with pytest.raises(InputError) as refusal:
        design(load_spring("turasas_axlebox", changes))
    told = refusal.value.faults[1]
    assert told.key == "target.deflection"
    assert f"or {verb} target.deflection" in told.allowed
    ends = re.search(r"between ([\d.]+) and ([\d.]+) mm", told.allowed).groups()
    spacing = 5.1e-5  # of the deflections that are tried
    for end, inwards in zip(ends, (1.0, -1.0), strict=True):
        for step, does in ((1e-5, True), (-spacing - 1e-5, False)):
            deflection = 1e-3 * float(end) + inwards * step
            tried = [*changes, f"target.deflection={deflection}"]
            try:
                design(load_spring("turasas_axlebox", tried))
            except InputError:
                assert not does
            else:
                assert does


def test_wires_of_a_design_are_those_within_the_spring_index_and_its_ends():
    """n = G d^4/(8 K D^3) for each."""
    changes = ["outer.mean_diameter=0.24", "search.spring_index=[6.0, 12.0]", "target.load=76e3"]
    own = load_spring(
        "turasas_axlebox", [*changes, "search.wire_diameters=[0.0199, 0.02, 0.03, 0.04, 0.041]"]
    )
    result = design(own)
    for name, D, K_V in zip(("outer", "inner"), (0.24, 0.142), result.K_V, strict=True):
        rows = coils_by_wire(own, result)[name]
        wires = [0.02, 0.03, 0.04] if name == "outer" else [0.0199, 0.02]
        assert [row["wire_diameter"] for row in rows] == wires
        for row in rows:
            d = row["wire_diameter"]
            assert row["spring_index"] == pytest.approx(D / d, rel=1e-12)
            n = own.material.G * d**4 / (8.0 * K_V * D**3)
            assert row["active_coils"] == pytest.approx(n, rel=1e-12)


def test_a_vehicle_file_says_which_spring_it_leaves_out():
    """The inner one works from 120 mm on; the outer one alone carries tare at 95 mm."""
    own = load_spring("turasas_axlebox", ["inner.engagement=0.12"])
    part = vehicle_part(own)
    (remark,) = [said for said in part.remarks if "inner spring" in said]
    assert f"# {remark}\n" in vehicle_text(own, part, *base_of(own)[:2])
    vertical = part.elements["coil_nest"]["stiffness"][2]
    assert vertical == pytest.approx(78.48e9 * 0.041**4 / (8.0 * 3.6 * 0.23**3), rel=1e-6)


def test_wires_are_the_bars_of_the_standard():
    """EN 10060:2003, hot rolled round bars for general purposes, 10 to 60 mm."""
    printed = "10 12 13 14 15 16 18 19 20 22 24 25 26 27 28 30 32 35 36 38 40 42 45 48 50 52 55 60"
    assert [round(1e3 * d, 9) for d in nests.EN_10060] == [float(d) for d in printed.split()]
