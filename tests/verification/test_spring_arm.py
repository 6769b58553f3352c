"""The arm's equilibrium against energy, closed forms and its own inverse."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from railsim.definitions.loading import load_spring
from railsim.errors import InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import helical
from railsim.springs.arm import Arm, Coil
from railsim.springs.design import design, design_task, target_load_range
from railsim.springs.verification import load_cases, mounted_arm, verify

NU = 0.3125


def nest(form="grossi", **changes):
    K_V = {"outer": 632875.4, "inner": 303464.5}
    start = 68792.625 / sum(K_V.values())
    values = {"length": 0.4, "bush": 5704.5, "nu": NU, "form": form} | changes
    coils = (
        Coil(K_V["outer"], 0.230, 0.338, 0.159, start),
        Coil(K_V["inner"], 0.142, 0.338, 0.159, start),
    )
    return Arm(coils=values.pop("coils", coils), **values)


def work(arm, start, end):
    """Work of the load on the rising axle while the arm turns [J]."""

    def power(p):
        return float(trailing_arm.load(arm, p)) * arm.length * np.cos(p)

    value, _ = quad(power, start, end, epsabs=1e-10, epsrel=1e-12, limit=200)
    return value


@pytest.mark.parametrize(
    ("name", "ends"),
    [
        ("turasas_axlebox", (0.0, -4.0)),
        ("turasas_axlebox", (0.0, 3.0)),
        ("tare_laden_example", (-3.0, -0.95)),  # one spring: the other joins at -0.91 degrees
        ("tare_laden_example", (-0.4, 3.0)),  # both, the inner one settled
    ],
)
def test_energy_form_stores_the_work_of_the_load(name, ends):
    arm = mounted_arm(load_spring(name, ["arm.equilibrium=energy"]))
    start, end = np.radians(ends)
    stored = trailing_arm.stored_energy(arm, end) - trailing_arm.stored_energy(arm, start)
    assert work(arm, start, end) == pytest.approx(float(stored), rel=1e-12)  # the quadrature's own


def test_settling_of_a_spring_that_joins_costs_less_than_a_thousandth():
    # the lateral energy of the inner spring appears while it settles, without work of the load
    arm = mounted_arm(load_spring("tare_laden_example"))
    start, end = np.radians([-2.5, 2.0])
    stored = trailing_arm.stored_energy(arm, end) - trailing_arm.stored_energy(arm, start)
    assert work(arm, start, end) == pytest.approx(float(stored), rel=1e-3)


@pytest.mark.parametrize("degrees", [-3.46, 1.50])
def test_reference_form_misses_the_stored_energy_by_the_known_share(degrees):
    # Grossi's moment takes the lever L instead of L cos(phi) - h sin(phi), leaves out the lateral
    # force that the tilted seat causes, and the slope of K_L: about one percent at the stops
    arm, phi = nest("grossi"), np.radians(degrees)
    stored = trailing_arm.stored_energy(arm, phi) - trailing_arm.stored_energy(arm, 0.0)
    missed = abs(work(arm, 0.0, phi) / float(stored) - 1.0)
    assert 0.005 < missed < 0.012


def test_both_forms_agree_for_springs_that_only_carry_vertically():
    # very slender seats at the axle's height, no bush: only sum(K_V dz) L remains, and the lever
    # L against L cos(phi) differs by phi^2/2
    coil = Coil(1e6, 1e-4, 0.338, 0.0, 0.07)
    loads = [
        trailing_arm.load(Arm(0.4, 0.0, NU, (replace(coil, D=0.4),), form), 1e-3)
        for form in ("grossi", "energy")
    ]
    lateral = helical.lateral_and_tilting(1e6, 0.4, 0.338, 0.07, NU)[1] * 1e-3 / 0.4
    assert loads[0] == pytest.approx(1e6 * (0.07 + 0.4e-3) + lateral, rel=1e-4)
    assert loads[0] == pytest.approx(loads[1], rel=1e-4)


def unique_from(arm):
    """Rotation from which on every load is positive and belongs to one rotation alone [rad].

    Near lift-off on high seats the load of some rotations repeats, or is negative.
    """
    low, high = trailing_arm.rotation_range(arm)
    grid = np.linspace(low, 0.9 * high, 2001)
    load = trailing_arm.load(arm, grid)
    before = np.maximum.accumulate(np.concatenate(([0.0], load[:-1])))
    last = np.flatnonzero(load <= before)
    return float(grid[min(last[-1] + 2, 2000)]) if last.size else float(grid[0])


@settings(max_examples=40)
@given(
    form=st.sampled_from(["grossi", "energy"]),
    degrees=st.floats(-5.0, 4.0),
    seat=st.floats(0.0, 0.4),
    length=st.floats(0.2, 1.0),
    bush=st.floats(0.0, 2e4),
)
def test_rotation_inverts_load(form, degrees, seat, length, bush):
    base = nest()
    coils = tuple(replace(coil, seat=seat) for coil in base.coils)
    arm = Arm(length, bush, NU, coils, form)
    # springs settled: not nearer to lift-off than a fortieth of their diameter
    low = trailing_arm.rotation_of_rise(length, seat, 0.006 - coils[0].start)
    _, high = trailing_arm.rotation_range(arm)
    low = max(low, unique_from(arm))
    phi = float(np.clip(np.radians(degrees), low, 0.9 * high))
    found = trailing_arm.rotation(arm, trailing_arm.load(arm, phi))
    # 1e-14 of the solver and the load's round-off over its slope
    assert float(found) == pytest.approx(phi, abs=1e-12)


@settings(max_examples=30)
@given(scale=st.floats(0.2, 5.0))
def test_larger_suspension_turns_as_much_under_squared_load(scale):
    # lengths times s, stiffness K_V times s (same material, scaled wire): forces times s^2,
    # moments and bush times s^3
    small = nest()
    coils = tuple(
        Coil(scale * c.K_V, scale * c.D, scale * c.H0, scale * c.seat, scale * c.start)
        for c in small.coils
    )
    large = Arm(scale * small.length, scale**3 * small.bush, NU, coils, "grossi")
    P = np.array([40e3, 60e3, 80e3])
    turned = trailing_arm.rotation(large, scale**2 * P)
    assert turned == pytest.approx(trailing_arm.rotation(small, P), abs=1e-12)


def test_many_nests_and_loads_in_one_call_equal_single_calls():
    base = nest()
    factors = np.array([0.9, 1.0, 1.1])
    many = replace(base, coils=tuple(replace(c, K_V=c.K_V * factors[:, None]) for c in base.coils))
    loads = np.array([40e3, 80e3])
    together = trailing_arm.rotation(many, loads)
    for i, factor in enumerate(factors):
        one = replace(base, coils=tuple(replace(c, K_V=c.K_V * factor) for c in base.coils))
        single = [float(trailing_arm.rotation(one, P)) for P in loads]
        assert together[i] == pytest.approx(single, abs=1e-13)


def test_load_out_of_reach_gives_nan():
    assert np.isnan(trailing_arm.rotation(nest(), 1e7))


@pytest.mark.parametrize("form", ["grossi", "energy"])
@pytest.mark.parametrize("target", [(75826.395, 0.07839), (60e3, 0.0672)])
@pytest.mark.parametrize(
    "nested",
    [
        [],  # as in the reference
        ["inner.free_height=0.31"],  # shorter, seat raised
        ["inner.engagement=0.01"],  # starts to work later
        ["inner.seat_height=0.18", "inner.free_height=0.3"],
    ],
)
def test_nest_built_as_designed_has_the_wanted_deflections(form, target, nested):
    # wires so thin that the springs do not go solid with whatever coils come out
    thin = ["outer.wire_diameter=0.025", "inner.wire_diameter=0.015"]
    changes = [f"arm.equilibrium={form}", *nested, *thin]
    low, high = reachable(load_spring("turasas_axlebox", changes), target[1])
    load = target[0] if low < target[0] < high else float(0.4 * low + 0.6 * high)
    changes += [f"target.load={load!r}", f"target.deflection={target[1]!r}"]
    result = design(load_spring("turasas_axlebox", changes))
    for name, n in zip(("outer", "inner"), result.n, strict=True):
        changes.append(f"{name}.active_coils={n!r}")
    built = load_spring("turasas_axlebox", changes)
    _, cases = load_cases(built, {"mounting": built.mounting.load, "target": load})
    # round-off of about 1e3 operations
    assert cases[0].deflection == pytest.approx(built.mounting.deflection, rel=1e-11)
    assert cases[1].deflection == pytest.approx(target[1], rel=1e-11)


def reachable(suspension, deflection):
    """Target loads that two springs of these diameters can carry at a deflection [N]."""
    wanted, frame = design_task(suspension.replace(target={"load": 1.0, "deflection": deflection}))
    return target_load_range(frame, suspension.engagement, wanted)


def test_tare_and_laden_nest_follows_one_spring_then_two():
    arm = mounted_arm(load_spring("turasas_axlebox", ["inner.engagement=0.08"]))
    outer, inner = arm.coils
    # under the mounting load, arm horizontal: both springs, the inner one 80 mm behind
    assert outer.start - inner.start == pytest.approx(0.08, rel=1e-14)
    total = outer.K_V * outer.start + inner.K_V * inner.start
    assert total == pytest.approx(68792.625, rel=1e-14)
    before = trailing_arm.coil_state(arm, inner, trailing_arm.rotation(arm, 30e3))
    assert before.deflection == before.force == before.K_L == before.K_C == 0.0
    after = trailing_arm.coil_state(arm, inner, trailing_arm.rotation(arm, 90e3))
    assert after.deflection > 0.0


@pytest.mark.parametrize("form", ["grossi", "energy"])
def test_load_rises_steadily_where_the_inner_spring_starts_to_work(form):
    arm = mounted_arm(load_spring("tare_laden_example", [f"arm.equilibrium={form}"]))
    inner = arm.coils[1]
    touch = float(trailing_arm.rotation_of_rise(arm.length, inner.seat, -inner.start))
    load = trailing_arm.load(arm, touch + np.linspace(-1e-2, 1e-2, 4001))
    assert np.all(np.diff(load) > 0.0)
    # no step: 5e-6 rad raise the load by no more than a rate of 2 kN/mm does
    assert np.max(np.diff(load)) < 5e-6 * arm.length * 2.0e6


def test_heavier_load_always_deflects_more():
    suspension = load_spring("turasas_axlebox")
    loads = {f"{load:.0f}": load for load in np.linspace(20e3, 120e3, 30)}
    _, cases = load_cases(suspension, loads)
    assert np.all(np.diff([case.deflection for case in cases]) > 0.0)
    assert np.all(np.diff([case.rotation for case in cases]) > 0.0)


@settings(max_examples=20)
@given(P=st.floats(30e3, 100e3))
def test_rate_is_the_slope_of_the_load_over_the_axle_s_rise(P):
    suspension = load_spring("turasas_axlebox")
    step = 5.0
    arm, cases = load_cases(suspension, {"a": P - step, "m": P, "b": P + step})
    rise = [arm.length * np.sin(case.rotation) for case in cases]
    slope = 2.0 * step / (rise[2] - rise[0])
    assert cases[1].rate == pytest.approx(slope, rel=1e-6)  # curvature of the load over 10 N


def test_equal_springs_share_the_deflection():
    for case in verify(load_spring("turasas_axlebox")).cases:
        outer, inner = case.springs.values()
        assert outer.deflection == inner.deflection
        assert outer.height == inner.height


def test_deflections_beyond_the_arm_s_reach_are_refused_in_both_forms():
    # a seat forty times the arm's length above the axle: most deflections have no rotation
    for form in ("grossi", "energy"):
        changes = ["arm.seat_height=15.9", "mounting.load=82550", f"arm.equilibrium={form}"]
        with pytest.raises(InputError, match="target"):
            design(load_spring("turasas_axlebox", changes))
