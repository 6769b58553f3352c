"""Limits of the closed creep laws, falling friction and the third body."""

import typing

import numpy as np
import pytest

from railsim.contact.creep import LAWS, creep_force
from railsim.contact.creep_curves import Patch, forces_by_law
from railsim.contact.kalker import kalker_coefficients
from railsim.definitions.creep_law import CREEP_LAWS, CreepLawName
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.kernels import creep as kernel

# midpoint sums of FaStrip's elliptic bound over 10 x 10 cells, over mu N; FASTSIM's parabola 1.0065
CELLS = 1.0148
A, B, N, MU, G = 5e-3, 3e-3, 70e3, 0.35, 82e9
PATCH = {"a": A, "b": B, "N": N, "mu": MU}
laws = pytest.mark.parametrize("law", LAWS)


@laws
@pytest.mark.parametrize(
    "case", [{"mu": 0.0}, {"N": 0.0}, {"N": 0.0, "a": 0.0, "b": 0.0}, {"xi_x": 0.0, "phi": 0.0}]
)
def test_no_friction_no_load_or_no_creepage_gives_zero(law, case):
    values = {**PATCH, "xi_x": 0.01, "xi_y": 0.0, "phi": 1.0} | case
    assert creep_force(**values, law=law) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("cells", "beyond"), [(2, 0.24), (4, 0.048), (10, 0.0065)])
def test_few_cells_carry_more_than_coulomb_friction(cells, beyond):
    # midpoint sum of 8/pi (1 - x^2)(1 - y^2)^(3/2) over the cells by hand; settings begin with 4
    y = (2.0 * np.arange(cells) + 1.0 - cells) / cells
    along = np.mean(1.0 - y**2)
    sum_of_bounds = 8.0 / np.pi * along * np.mean((1.0 - y**2) ** 1.5)
    assert sum_of_bounds == pytest.approx(1.0 + beyond, abs=5e-4)
    force = creep_force(**PATCH, xi_x=0.0, xi_y=1e2, phi=0.0, nx=cells, ny=cells)
    assert force.T_y == pytest.approx(sum_of_bounds * MU * N, rel=1e-6)


@laws
@pytest.mark.parametrize("size", [1e2, 1e100])
def test_huge_creepage_is_full_sliding(law, size):
    along = creep_force(**PATCH, xi_x=size, xi_y=0.0, phi=0.0, law=law, nx=30, ny=30)
    across = creep_force(**PATCH, xi_x=0.0, xi_y=-size, phi=0.0, law=law, nx=30, ny=30)
    # FASTSIM: quadrature of the parabola over 30 x 30 cells
    assert along.T_x == pytest.approx(MU * N, rel=3e-3)
    assert across.T_y == pytest.approx(-MU * N, rel=3e-3)
    spin = creep_force(**PATCH, xi_x=0.0, xi_y=0.0, phi=size, law=law)
    mixed = creep_force(**PATCH, xi_x=size, xi_y=size, phi=-size, law=law)
    assert np.isfinite([*spin, *mixed]).all()


@pytest.mark.parametrize(
    ("law", "arm"),
    # mean radius of the patch over a, weighted with the bound: Hertz's 3 pi/16, the parabola's 8/15
    [("table", 3 * np.pi / 16), ("fastrip", 3 * np.pi / 16), ("fastsim", 8 / 15), ("polach", 0.0)],
)
def test_huge_pure_spin_turns_without_pushing(law, arm):
    force = creep_force(a=A, b=A, N=N, mu=MU, xi_x=0.0, xi_y=0.0, phi=1e4, law=law, nx=100, ny=100)
    # polach: no moment at all
    assert force.M_z == pytest.approx(arm * MU * N * A, rel=2e-3, abs=1e-9)
    # with cells the slip is that of half a cell upstream: the pole of the spin is off by 1/100
    allowed = 0.015 if law in ("fastsim", "fastrip") else 2e-3
    assert np.hypot(force.T_x, force.T_y) < allowed * MU * N


CURVE = [[0.0, 0.0], [0.002, 0.6], [0.01, 1.0], [0.1, 0.7]]


def test_adhesion_curve_is_met_in_every_direction():
    size = np.array([0.0, 1e-3, 2e-3, 6e-3, 1e-2, 5.5e-2, 0.1, 3.0])
    share = np.array([0.0, 0.3, 0.6, 0.8, 1.0, 0.85, 0.7, 0.7])
    for angle in (0.0, 0.7, 2.0, 4.0):
        x, y = np.cos(angle), np.sin(angle)
        force = creep_force(**PATCH, xi_x=x * size, xi_y=y * size, phi=0.0,
                            law="adhesion_curve", adhesion_curve=CURVE)  # fmt: skip
        np.testing.assert_allclose(force.T_x, share * x * MU * N, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(force.T_y, share * y * MU * N, rtol=1e-12, atol=1e-9)
        assert not force.M_z.any()


def test_spin_of_the_adhesion_curve_is_the_creepage_of_its_force_in_linear_theory():
    _, c22, c23, _ = (float(c) for c in kalker_coefficients(A / B))
    phi = 0.2
    curve = {"law": "adhesion_curve", "adhesion_curve": CURVE}
    spin = creep_force(**PATCH, xi_x=0.0, xi_y=0.0, phi=phi, **curve)
    same = creep_force(**PATCH, xi_x=0.0, xi_y=c23 / c22 * np.sqrt(A * B) * phi, phi=0.0, **curve)
    np.testing.assert_allclose([*spin], [*same], rtol=1e-12, atol=1e-9)
    assert spin.T_y > 0.0


def test_adhesion_curve_and_its_law_belong_together():
    for more in ({"law": "adhesion_curve"}, {"law": "polach", "adhesion_curve": CURVE}):
        with pytest.raises(InputError, match="adhesion_curve"):
            creep_force(**PATCH, xi_x=0.0, xi_y=0.0, phi=0.0, **more)
        with pytest.raises(InputError, match="adhesion_curve"):
            Settings(creep_law=more["law"], adhesion_curve=more.get("adhesion_curve"))


def test_numbers_of_the_creep_laws_are_those_of_the_kernels():
    assert {law.number for law in CREEP_LAWS.values()} == set(range(len(CREEP_LAWS)))
    for name, law in CREEP_LAWS.items():
        assert getattr(kernel, name.upper()) == law.number
    assert tuple(CREEP_LAWS) == typing.get_args(CreepLawName)


@laws
@pytest.mark.parametrize("mu_N", [1e-3, 1e-12, 1e-100, 1e-250, 5e-324])
def test_vanishing_load_gives_vanishing_force(law, mu_N):
    force = creep_force(a=A, b=B, N=mu_N, mu=1.0, xi_x=1e-3, xi_y=-1e-3, phi=0.5, law=law)
    assert np.isfinite(force).all()
    assert np.hypot(force.T_x, force.T_y) <= CELLS * mu_N


@laws
@pytest.mark.parametrize("ratio", [1e-3, 0.04, 30.0, 1e3])
@pytest.mark.filterwarnings("ignore:creep law 'table'")
def test_extreme_ellipses_give_finite_forces_within_friction(law, ratio):
    a, b = 4e-3 * ratio**0.5, 4e-3 / ratio**0.5
    for xi in ((1e-3, 0.0, 0.0), (0.0, 1e-3, 0.2), (1e-3, -1e-3, 3.0), (0.0, 0.0, 50.0)):
        force = creep_force(a, b, N, MU, *xi, law=law)
        assert np.isfinite(force).all()
        assert np.hypot(force.T_x, force.T_y) < CELLS * MU * N


@laws
def test_third_body_reduces_the_slope_and_not_the_friction(law):
    small, large = 1e-8, 0.5
    for k in (1.0, 0.3):
        slope = creep_force(
            **PATCH, xi_x=small, xi_y=0.0, phi=0.0, law=law, reduction=k, nx=100, ny=100
        ).T_x / small  # fmt: skip
        c11 = float(kalker_coefficients(A / B, 0.28)[0])
        # table: the solver's own coefficients, within 1 % of the printed ones
        assert slope == pytest.approx(k * G * A * B * c11, rel=0.01)
        full = creep_force(**PATCH, xi_x=large, xi_y=0.0, phi=0.0, law=law, reduction=k)
        assert full.T_x == pytest.approx(MU * N, rel=0.02)


@laws
def test_falling_friction_has_a_maximum_and_a_rest(law):
    xi = np.array([1e-3, 3e-3, 6e-3, 0.02, 0.1, 1.0, 10.0])
    force = creep_force(
        **PATCH, xi_x=xi, xi_y=0.0, phi=0.0, law=law, friction_rest=0.4, friction_decay=0.6,
        speed=20.0,
    ).T_x  # fmt: skip
    assert force.argmax() in (1, 2, 3)
    expected = MU * N * (0.6 * np.exp(-0.6 * 20.0 * xi[3:]) + 0.4)
    np.testing.assert_allclose(force[3:], expected, rtol=0.02)


def test_polach_on_wet_rails_is_softer_in_the_slip_area():
    xi = np.geomspace(1e-4, 0.1, 30)
    dry = creep_force(**PATCH, xi_x=xi, xi_y=0.0, phi=0.0, law="polach").T_x
    wet = creep_force(
        **PATCH, xi_x=xi, xi_y=0.0, phi=0.0, law="polach", reduction=0.3, slip_reduction=0.1
    ).T_x
    assert (wet < dry).all()
    assert wet[-1] < 0.85 * MU * N < 0.95 * MU * N < dry[-1]


def test_polach_slopes_are_linear_theory():
    small = 1e-9
    c11, c22, c23, _ = (float(c) for c in kalker_coefficients(A / B, 0.28))
    along = creep_force(**PATCH, xi_x=small, xi_y=0.0, phi=0.0, law="polach").T_x
    across = creep_force(**PATCH, xi_x=0.0, xi_y=small, phi=0.0, law="polach").T_y
    spin = creep_force(**PATCH, xi_x=0.0, xi_y=0.0, phi=small / A, law="polach").T_y
    assert along == pytest.approx(G * A * B * c11 * small, rel=1e-5)
    assert across == pytest.approx(G * A * B * c22 * small, rel=1e-5)
    assert spin == pytest.approx(G * (A * B) ** 1.5 * c23 * small / A, rel=1e-4)


def test_linear_is_shen_hedrick_elkins_without_spin():
    c11, c22, _, _ = (float(c) for c in kalker_coefficients(A / B, 0.28))
    xi = np.array([1e-4, 5e-4, 1e-3, 3e-3, 1e-2])
    force = creep_force(**PATCH, xi_x=xi, xi_y=-0.5 * xi, phi=0.0, law="linear")
    x, y = G * A * B * c11 * xi, -0.5 * G * A * B * c22 * xi
    u = np.hypot(x, y) / (MU * N)
    size = np.where(u < 3.0, u - u**2 / 3.0 + u**3 / 27.0, 1.0) * MU * N
    np.testing.assert_allclose(force.T_x, size * x / np.hypot(x, y), rtol=1e-12)
    np.testing.assert_allclose(force.T_y, size * y / np.hypot(x, y), rtol=1e-12)


@pytest.mark.parametrize(
    "option",
    [{"reduction": 0.0}, {"reduction": 1.5}, {"reduction": 0.3, "slip_reduction": 0.5},
     {"friction_rest": -0.1}, {"friction_decay": -1.0}, {"nx": 0}],
)  # fmt: skip
def test_options_out_of_range_are_refused(option):
    with pytest.raises(InputError):
        creep_force(**PATCH, xi_x=0.0, xi_y=0.0, phi=0.0, **option)


def test_forces_over_their_bounds_do_not_depend_on_the_size_of_the_patch():
    """Elastic bodies are similar: a patch of twice the axes and four times the load, all laws."""
    small = forces_by_law(Patch(A, B, N, MU, G))
    large = forces_by_law(Patch(2.0 * A, 2.0 * B, 4.0 * N, MU, G))
    for force in ("T_x", "T_y", "M_z"):
        expected = [row[force] for row in small]
        assert [row[force] for row in large] == pytest.approx(expected, rel=1e-12, abs=1e-12)
    one = next(row for row in small if row["case"] == "spin" and row["law"] == "linear")
    _, _, c23, c33 = (float(c) for c in kalker_coefficients(A / B, 0.28))
    assert one["M_z"] / one["T_y"] == pytest.approx(c33 / c23, rel=1e-9)


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.5])
def test_kalkers_printed_coefficients_run_smoothly_over_the_axis_ratio(nu):
    """Each row lies on the cubic through its four neighbours, over logarithms.

    Both halves of the table meet in the circle. Without a lateral contraction c11 = c22.
    """
    short = 0.1 * np.arange(1.0, 10.5)
    narrow, long = (np.array(kalker_coefficients(ratio, nu)) for ratio in (short, 1.0 / short))
    np.testing.assert_allclose(narrow[:, -1], long[:, -1], rtol=1e-12)
    x = np.log(short)
    for half in (narrow, long):
        for y in np.log(half):
            for i in range(10):
                near = [k for k in sorted(range(10), key=lambda k: abs(k - i)) if k != i][:4]
                cubic = np.polynomial.Polynomial.fit(x[near], y[near], 3)
                assert y[i] == pytest.approx(cubic(x[i]), abs=0.1 if i in (0, 9) else 0.01)
        if nu == 0.0:
            np.testing.assert_allclose(half[0], half[1], rtol=1e-12)


@laws
@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0])
def test_no_force_jumps_nor_is_steeper_than_linear_theory_twice(law, ratio):
    random, size, points = np.random.default_rng(0), 6e-3, 400
    a, b = size * np.sqrt(ratio), size / np.sqrt(ratio)
    c = np.max([np.max(part) for part in kalker_coefficients(ratio, 0.28)[:3]])
    begin, way = random.normal(size=(2, 3, 40, 1))
    begin *= random.uniform(2e-4, 5e-3, (40, 1)) / np.linalg.norm(begin, axis=0)
    way /= np.linalg.norm(way, axis=0)
    step = 5e-8  # of slip by creepage and spin
    x, y, spin = begin + way * step * np.arange(points)
    for cells in (10, 50) if CREEP_LAWS[law].grid else (10,):
        force = creep_force(a, b, N, MU, x, y, spin / size, G, law=law, nx=cells, ny=cells)
        change = np.hypot(np.diff(force.T_x), np.diff(force.T_y))
        assert np.max(change) < 2.0 * G * a * b * c * step
