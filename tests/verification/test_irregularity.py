"""Irregularities of the track against their definitions: spectra, shapes, measured data."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch
from selection import points

from railsim.definitions.excitations import TYPES
from railsim.definitions.excitations.measured import Measured, largest_between_rows
from railsim.definitions.excitations.measured_file import read_measured
from railsim.definitions.excitations.spectra import ERRI_B176, SPECTRA
from railsim.definitions.loading import load_track
from railsim.definitions.track.definition import Track
from railsim.errors import InputError
from railsim.track.irregularity import (
    displacement,
    measured_remarks,
    shortest_length,
    shortest_wave,
)
from railsim.track.tables import track_tables

Y_LEFT, Z_LEFT, Y_RIGHT, Z_RIGHT, MU_LEFT, MU_RIGHT = range(6)
CHANNELS = ("lateral", "vertical", "cross_level", "gauge")


def track(*irregularities, length=1000.0, **more):
    return Track(
        format="railsim-track/1",
        name="t",
        plan=[{"type": "STR", "length": length}],
        irregularities=irregularities,
        **more,
    )


def random(**more):
    return {"type": "random", "spectrum": "erri_b176_low", "fade": 0.0, **more}


def rails(track_, s):
    """Displacements of the four rows at `s` and their rates."""
    return displacement(track_)(np.asarray(s, dtype=float))


def channels(track_, s):
    """Lateral, vertical, cross level (angle), gauge at `s`."""
    y_left, z_left, y_right, z_right = rails(track_, s)[0]
    return {
        "lateral": 0.5 * (y_left + y_right),
        "vertical": 0.5 * (z_left + z_right),
        "cross_level": (z_right - z_left) / 1.5,
        "gauge": y_right - y_left,
    }


# spectra ------------------------------------------------------------------------------------------


def test_coefficients_are_those_of_erri_b176():
    # three independent public re-entries agree in these digits (ORE B176)
    low, high = ERRI_B176["erri_b176_low"], ERRI_B176["erri_b176_high"]
    assert (low.lateral, low.vertical, low.gauge) == (2.119e-7, 4.032e-7, 5.32e-8)
    assert (high.lateral, high.vertical, high.gauge) == (6.125e-7, 1.080e-6, 1.032e-7)
    assert (low.omega_c, low.omega_r, low.omega_s, low.b) == (0.8246, 0.0206, 0.4380, 0.75)


@pytest.mark.parametrize("channel", CHANNELS)
def test_band_variance_is_the_integral_of_the_spectrum(channel):
    low = SPECTRA["erri_b176_low"]
    exact, _ = quad(
        lambda omega: float(low.density(channel, np.array(omega))),
        2.0 * np.pi / 70.0,
        2.0 * np.pi / 3.0,
        epsabs=0.0,
        epsrel=1e-10,
    )
    assert low.band_variance(channel, (3.0, 70.0)) == pytest.approx(exact, rel=1e-9)


def test_vertical_spectrum_has_the_closed_integral_of_two_poles():
    # over all wave numbers: pi A omega_c / (2 omega_r (omega_c + omega_r))
    c = ERRI_B176["erri_b176_high"]
    closed = np.pi * c.vertical * c.omega_c / (2.0 * c.omega_r * (c.omega_c + c.omega_r))
    found = SPECTRA["erri_b176_high"].band_variance("vertical", (1e-3, 1e9))
    assert found == pytest.approx(closed, rel=1e-6)


@pytest.mark.parametrize("channel", CHANNELS)
@points("spectrum", ["erri_b176_low", "erri_b176_high"], always=(1,))
def test_variance_over_50_seeds_is_the_integral_of_the_band(channel, spectrum):
    wavelengths = (3.0, 25.0)
    s = np.arange(100.0, 900.0, 0.5)  # some stretch within, not the period
    variances = []
    for seed in range(50):
        part = random(spectrum=spectrum, seed=seed, wavelengths=wavelengths, channels=[channel])
        variances.append(np.mean(channels(track(part), s)[channel] ** 2))
    expected = SPECTRA[spectrum].band_variance(channel, wavelengths)
    assert np.mean(variances) == pytest.approx(expected, rel=0.02)


def test_variance_over_the_whole_period_is_exact_for_every_seed():
    # default band: the period is 20 times 70 m
    s = 0.35 * np.arange(4000)
    for seed in range(3):
        found = channels(track(random(seed=seed, end=1400.0)), s)
        for channel in CHANNELS:
            expected = SPECTRA["erri_b176_low"].band_variance(channel, (3.0, 70.0))
            # interpolation of the shortest waves on their lattice
            assert np.mean(found[channel] ** 2) == pytest.approx(expected, rel=1e-4)


def test_spectrum_of_a_long_track_is_the_given_one():
    s = np.arange(0.0, 20e3, 0.5)
    z = channels(track(random(end=20e3), length=20e3), s)["vertical"]
    frequency, density = welch(z, fs=2.0, nperseg=2048)
    omega = 2.0 * np.pi * frequency
    band = (omega > 0.15) & (omega < 2.0)
    given = SPECTRA["erri_b176_low"].density("vertical", omega[band])
    ratio = density[band] / (2.0 * np.pi) / given
    # each estimate averages 38 periodograms (16 %); their mean over 600 lines is close to one
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.03)
    assert np.percentile(ratio, [5, 95]) == pytest.approx([1.0, 1.0], abs=0.4)


def test_rails_are_correlated_as_independent_channels_say():
    """Mean of 24 seeds: both rails follow alignment and level, half of gauge and cross level apart.

    Of products of independent channels a share of 0.03 of the variances is left.
    """
    s = 0.7 * np.arange(2000)
    spectrum, found = SPECTRA["erri_b176_low"], np.zeros((4, 4))
    for seed in range(24):
        part = rails(track(random(seed=seed, end=1400.0)), s)[0][:4]
        found += part @ part.T / s.size / 24.0
    a, v, c, g = (spectrum.band_variance(channel, (3.0, 70.0)) for channel in CHANNELS)
    c, g = 0.75**2 * c, 0.25 * g  # of one rail
    expected = np.diag([a + g, v + c, a + g, v + c])
    expected[[0, 2], [2, 0]], expected[[1, 3], [3, 1]] = a - g, v - c
    size = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    np.testing.assert_allclose(found / size, expected / size, atol=0.05)


# class: A_v, A_a [cm2 rad/m], omega_s [rad/m]; omega_c = 0.8245 rad/m: the published table, written
# down a second time, from memory, without the first
FRA = {
    1: (1.2107, 3.3634, 0.6046),
    2: (1.0181, 1.2107, 0.9308),
    3: (0.6816, 0.4128, 0.8520),
    4: (0.5376, 0.3027, 1.1312),
    5: (0.2095, 0.0762, 0.8209),
    6: (0.0339, 0.0339, 0.4380),
}


@pytest.mark.parametrize("number", FRA)
def test_american_spectra_are_those_of_their_table(number):
    """k = 1/4; cross level and gauge with 4 k A_v; all one-sided, over rad/m."""
    A_v, A_a, omega_s = FRA[number]
    w = np.geomspace(0.05, 3.0, 40)
    single = 0.25e-4 * 0.8245**2 / (w**2 * (w**2 + 0.8245**2))
    double = 1e-4 * A_v * 0.8245**2 / ((w**2 + 0.8245**2) * (w**2 + omega_s**2))
    density = SPECTRA[f"fra_{number}"].density
    np.testing.assert_allclose(density("vertical", w), A_v * single, rtol=1e-9)
    np.testing.assert_allclose(density("lateral", w), A_a * single, rtol=1e-9)
    np.testing.assert_allclose(density("cross_level", w), double / 1.5**2, rtol=1e-9)
    np.testing.assert_allclose(density("gauge", w), double, rtol=1e-9)


def test_same_seed_gives_the_same_track_and_another_seed_another():
    s = np.linspace(0.0, 500.0, 300)
    first, again, other = (rails(track(random(seed=seed)), s)[0] for seed in (7, 7, 8))
    assert np.array_equal(first, again)
    assert abs(np.corrcoef(first[1], other[1])[0, 1]) < 0.5


def test_leaving_a_channel_out_does_not_change_the_others():
    s = np.linspace(0.0, 500.0, 300)
    alone = channels(track(random(channels=["vertical"])), s)
    among = channels(track(random()), s)
    np.testing.assert_allclose(alone["vertical"], among["vertical"], atol=1e-18)
    assert np.all(alone["lateral"] == 0.0)


def test_mirrored_irregularity_exchanges_the_rails():
    s = np.linspace(0.0, 500.0, 300)
    plain, mirrored = (rails(track(random(mirror=mirror)), s) for mirror in (False, True))
    for a, b in zip(plain, mirrored, strict=True):
        np.testing.assert_array_equal(b, np.stack((-a[2], a[3], -a[0], a[1])))


def test_own_coefficients_equal_to_the_published_ones_give_the_same_track():
    s = np.linspace(0.0, 500.0, 300)
    own = ERRI_B176["erri_b176_low"].model_dump()
    pair = [random(), random(spectrum="own", coefficients=own)]
    first, second = (rails(track(part), s)[0] for part in pair)
    np.testing.assert_array_equal(first, second)


def test_realisation_does_not_depend_on_the_cells_of_the_table():
    noisy = track(random(), length=100.0)
    fine, coarse = (track_tables(noisy, cell_length=ds) for ds in (0.05, 0.1))
    np.testing.assert_allclose(
        fine.rail[::2, :4, 0][:3000], coarse.rail[:, :4, 0][:3000], atol=1e-15
    )


# rates and tables ---------------------------------------------------------------------------------

DIP = {"type": "dip", "s": 50.0, "length": 8.0, "depth": 0.01, "rail": "right"}
KINK = {"type": "kink", "s": 50.0, "length": 10.0, "offset": 0.006, "rail": "left"}
TWIST = {"type": "twist", "s": 50.0, "length": 12.0, "height": 0.02}
ROWS = [[s, *(1e-3 * np.sin([s, 2 * s, 3 * s, s + 1.0]))] for s in np.arange(10.0, 90.0, 0.5)]
SWEEP = {"type": "sweep", "amplitude": 3e-3, "wavelengths": (20.0, 6.0), "begin": 5.0, "end": 90.0}
MEASURED = {"type": "measured", "rows": ROWS, "shift": 3.0, "scale": 2.0}


@pytest.mark.parametrize(
    "part",
    [
        random(fade=10.0, end=90.0),
        DIP,
        {**DIP, "shape": "triangle"},
        KINK,
        {**KINK, "shape": "cosine"},
        TWIST,
        MEASURED,
        {**MEASURED, "fade": 0.0},
        SWEEP,
        {**SWEEP, "channel": "lateral", "wavelengths": (5.0, 12.0)},
    ],
)
def test_rate_is_the_derivative(part):
    s, h = np.linspace(20.003, 80.0, 500), 1e-5
    moved = displacement(track(part))
    difference = (moved(s + h)[0] - moved(s - h)[0]) / (2.0 * h)
    # round-off 1e-18 / 1e-5 and, at the ends of a cosine, half of h times its second derivative
    np.testing.assert_allclose(moved(s)[1], difference, atol=1e-7)


@pytest.mark.parametrize("part", [random(fade=10.0, end=90.0), DIP, KINK, TWIST, MEASURED, SWEEP])
def test_table_follows_the_displacement(part):
    bumpy = track(part, length=100.0)
    tables = track_tables(bumpy)
    assert tables.has_irregularity == 1
    s = np.linspace(1.0, 99.0, 4001)
    cells = np.floor((s - tables.s_start) / tables.ds).astype(int)
    u = s - tables.s_start - cells * tables.ds
    found = (tables.rail[cells, :4] * u[:, None, None] ** np.arange(4)).sum(axis=2)
    # cells are a sixteenth of the shortest wave: (2 pi / 16)^4 / 384 = 6e-5 of 10 mm; where the
    # second derivative jumps within a cell of 0.25 m, up to 1/27 ds^2 of its jump of 1.4e-3 / m
    np.testing.assert_allclose(found, displacement(bumpy)(s)[0].T, atol=3e-6)


@pytest.mark.parametrize("wavelengths", [(20.0, 4.0), (4.0, 20.0), (8.0, 8.0)])
def test_sweep_has_its_amplitude_and_wavelength_where_they_should_be(wavelengths):
    """Zeros of sin(2 pi L (r^u - 1)/(first ln r)) at u = ln(1 + n first ln r/(2 L))/ln r."""
    first, last = wavelengths
    begin, length, height = 30.0, 400.0, 2e-3
    part = {"type": "sweep", "amplitude": height, "wavelengths": wavelengths, "begin": begin,
            "end": begin + length, "fade": 0.0}  # fmt: skip
    moved = displacement(track(part))
    n = np.arange(1, 40)
    ratio = np.log(first / last)
    u = np.log1p(n * first * ratio / (2.0 * length)) / ratio if ratio else n * first / 2.0 / length
    u, n = u[u < 1.0], n[u < 1.0]
    zeros = begin + length * u
    values, rates = moved(zeros)
    np.testing.assert_allclose(values[1], 0.0, atol=1e-15)
    local = first * (last / first) ** u
    np.testing.assert_allclose(rates[1], 2.0 * np.pi / local * height * (-1.0) ** n, rtol=1e-9)
    wave = moved(np.linspace(zeros[0], zeros[-1], 20001))[0]
    assert np.max(wave[1]) == pytest.approx(height, rel=1e-5)
    np.testing.assert_array_equal(wave[1], wave[3])
    assert not wave[[0, 2]].any()


def test_cross_level_of_a_sweep_is_the_difference_of_heights():
    part = {"type": "sweep", "amplitude": 4e-3, "wavelengths": (8.0, 8.0), "begin": 0.0,
            "end": 80.0, "channel": "cross_level", "fade": 0.0}  # fmt: skip
    _, left, _, right = displacement(track(part))(np.array([2.0]))[0]
    np.testing.assert_allclose((left, right), ([-2e-3], [2e-3]), rtol=1e-12)


def test_every_kind_of_irregularity_has_a_displacement_and_answers():
    assert len(TYPES) == 7
    for kind in TYPES.values():
        assert not kind.__abstractmethods__


def test_smooth_track_has_none():
    assert displacement(track()) is None
    assert track_tables(track()).has_irregularity == 0


# single disturbances ------------------------------------------------------------------------------


def test_dip_lowers_its_rail_only():
    value, _ = rails(track(DIP), [45.0, 48.0, 50.0, 55.0])
    np.testing.assert_allclose(value[3], [0.0, 0.005, 0.01, 0.0], atol=1e-16)
    assert np.all(value[[0, 1, 2]] == 0.0)


def test_kink_moves_its_rail_sideways():
    value, _ = rails(track(KINK), [45.0 - 0.6, 47.5, 50.0, 55.6])
    # the rounding over a tenth of the length takes a twentieth of the height
    np.testing.assert_allclose(value[0], [0.0, 0.003, 0.006 * 0.95, 0.0], atol=1e-12)


def test_twist_raises_one_rail_and_lowers_the_other():
    cosine = {**TWIST, "shape": "cosine"}
    value, _ = rails(track(cosine), [50.0])
    np.testing.assert_allclose(value[:, 0], [0.0, -0.01, 0.0, 0.01], atol=1e-16)


def test_irregularities_add_up():
    value, _ = rails(track(DIP, {**DIP, "rail": "both"}), [50.0])
    assert value[3, 0] == pytest.approx(0.02)
    assert value[1, 0] == pytest.approx(0.01)


def test_gauge_widening_moves_the_rails_apart():
    plain = track(gauge_widening=[[0.0, 0.0], [20.0, 0.0], [60.0, 0.01]])
    value, _ = rails(plain, [-50.0, 40.0, 90.0])
    np.testing.assert_allclose(value[2] - value[0], [0.0, 0.005, 0.01], atol=1e-15)
    np.testing.assert_allclose(value[2], -value[0], atol=1e-15)
    inner = track(gauge_widening=[[0.0, 0.0, 0.01]])
    value, _ = rails(inner, [-50.0, 5.0])
    np.testing.assert_allclose(value[0], 0.0, atol=0.0)
    np.testing.assert_allclose(value[2], 0.01, atol=1e-15)


def test_friction_follows_its_table_on_either_side():
    rows = [[10.0, 0.4], [20.0, 0.1, 0.3]]
    tables = track_tables(track(friction_table=rows, length=50.0))
    s = np.array([0.0, 12.5, 40.0])
    cells = np.floor((s - tables.s_start) / tables.ds).astype(int)
    np.testing.assert_allclose(tables.rail[cells, MU_LEFT, 0], [0.4, 0.325, 0.1], atol=1e-12)
    np.testing.assert_allclose(tables.rail[cells, MU_RIGHT, 0], [0.4, 0.375, 0.3], atol=1e-12)


# measured files -----------------------------------------------------------------------------------

HEAD = 'format = "railsim-track/1"\nname = "t"\nplan = [{type="STR", length=100.0}]\n'
USE = '[[irregularities]]\ntype = "measured"\nfile = "track.csv"\nfade = 0.0\n'


@pytest.fixture
def measured(tmp_path):
    def measured(csv, use=USE):
        (tmp_path / "track.csv").write_text(csv, encoding="utf-8")
        path = tmp_path / "track.toml"
        path.write_text(HEAD + use)
        return path

    return measured


def test_measured_file_is_interpolated_and_becomes_part_of_the_track(measured):
    s = np.arange(0.0, 60.0, 0.25)
    lines = [f"{x},{100.0 * np.sin(x / 3.0)}" for x in s]
    track_ = load_track(measured("s,z_left_mm\n# recorded backwards\n" + "\n".join(lines)))
    assert track_.irregularities[0].file is None
    value, rate = rails(track_, [10.1, 30.03])
    # cubic spline: 5/384 h^4 times the fourth derivative 0.1/81, its rate h^3/24 times that
    np.testing.assert_allclose(value[1], 0.1 * np.sin(np.array([10.1, 30.03]) / 3.0), atol=1e-6)
    np.testing.assert_allclose(rate[1], np.cos(np.array([10.1, 30.03]) / 3.0) / 30.0, atol=1e-5)
    assert np.all(value[[0, 2, 3]] == 0.0)


METRES = {"": 1.0, "_m": 1.0, "_mm": 0.001, "_km": 1000.0, "_in": 0.0254, "_ft": 12 * 0.0254}


def test_summary_of_a_record_says_its_scale_where_it_has_one():
    rows = [[float(s), 0.0, 0.0, 0.0, 0.0] for s in range(5)]
    assert Measured(type="measured", rows=rows).summary() == "measured, 5 rows"
    assert (
        Measured(type="measured", rows=rows, scale=2.5).summary() == "measured, 5 rows, times 2.5"
    )


@pytest.mark.parametrize("unit", METRES)
@pytest.mark.parametrize("form", ["rails", "track"])
def test_columns_of_a_measured_file_move_the_rails_as_they_are_defined(form, unit, tmp_path):
    """y and z are the means of both rails, cross level and gauge right less left, here with a sign
    turned and an offset of 2 mm; arc lengths are moved by none of them.
    """
    s = np.array([0.0, 1.0, 2.5, 3.0, 7.0])
    a, b, c, d = 0.01 / METRES[unit] * np.cos(np.outer([0.3, 0.7, 1.1, 1.9], s))
    of_rails, of_track = "y_left,z_left,y_right,z_right", "y,z,cross_level,gauge"
    names = (of_rails if form == "rails" else of_track).split(",")
    head = ",".join(["s_m", *(f"{name}{unit}" for name in names)])
    path = tmp_path / "track.csv"
    np.savetxt(path, np.column_stack([s, a, b, c, d]), delimiter=",", header=head, comments="")
    zero = 2e-3 / METRES[unit]
    how = {"reverse": (names[2],), "offset": {names[3]: zero}}
    rows, mileage = read_measured(path, Measured(type="measured", file="track.csv", **how))
    c, d = -c, d - zero
    parts = (a, b, c, d) if form == "rails" else (a - d / 2, b - c / 2, a + d / 2, b + c / 2)
    np.testing.assert_allclose(rows[:, 0], s, atol=1e-15)
    np.testing.assert_allclose(rows[:, 1:].T, METRES[unit] * np.array(parts), atol=1e-12)
    assert mileage is None


def test_absolute_gauge_and_another_encoding_are_read_when_the_file_says_so(tmp_path):
    rows = "\n".join(f"{x};{1435 + x}" for x in range(6))
    (tmp_path / "track.csv").write_bytes(f"Länge;Spurweite\n{rows}".encode("latin-1"))
    how = (
        'columns = { s = "Länge", gauge = "Spurweite" }\nunits = { gauge = "mm" }\n'
        'offset = { gauge = 1435.0 }\nencoding = "latin-1"\n'
    )
    path = tmp_path / "track.toml"
    path.write_text(HEAD + USE + how, encoding="utf-8")
    value, _ = rails(load_track(path), [4.0])
    np.testing.assert_allclose(value[:, 0], [-0.002, 0.0, 0.002, 0.0], atol=1e-15)
    path.write_text(HEAD + USE + how.replace('"latin-1"', '"latin-9x"'), encoding="utf-8")
    with pytest.raises(InputError, match="unknown encoding 'latin-9x'"):
        load_track(path)
    path.write_text(HEAD + USE + how.replace('encoding = "latin-1"\n', ""), encoding="utf-8")
    with pytest.raises(InputError, match='its encoding, such as encoding = "latin-1"'):
        load_track(path)


@pytest.mark.parametrize(
    ("csv", "expected"),
    [
        ("", "empty"),
        ("s,z_lefft\n0,1", "did you mean 'z_left'?"),
        ("z_left\n1", "no column s"),
        ("s,z,z_mm\n0,1,1", "a column occurs twice"),
        ("s,z\n0,0\n1,0\n2,nan\n3,0\n4,0", "line 4: not a finite number"),
        ("s,z\n0,0\n1,x\n2,0\n3,0\n4,0", "line 3: not a number ('x')"),
        ("s,z\n0,0\n1\n2,0\n3,0\n4,0", "line 3: 1 values"),
        ("s,z\n0,0\n1,0", "four rows at least"),
        ("s,z\n0,0\n1,0\n1,0\n2,0\n3,0", "line 4: s = 1 m does not increase"),
        ("s,z\n3,0\n2,0\n1,0\n0,0", "falling_mileage = true"),
        ("s,z\n0,0\n1,0\n2,5\n3,0", "line 4: a displacement of 5 m"),
        ("s,gauge_mm\n0,1435\n1,1436\n2,1437\n3,1436", "offset = { gauge = 1435.0 }"),
        ("s,gauge_mm\n0,-435\n1,-436\n2,-435\n3,-434", "line 2: a gauge of -0.435 m"),
    ],
)
def test_wrong_measured_file_is_refused(measured, csv, expected):
    with pytest.raises(InputError) as caught:
        load_track(measured(csv))
    assert any(expected in str(fault) for fault in caught.value.faults)


def test_names_that_no_column_has_are_refused_with_their_keys(measured):
    """A sign, a unit or an offset of the file's own name would change nothing."""
    how = (
        'columns = { s = "s", z_left = "LL", z_right = "LL", y = "AL" }\n',
        'columns = { s = "s", z_left = "LL", y = "AL" }\nreverse = ["LL", "y"]\n'
        'units = { z_rigth = "mm" }\noffset = { gauge = 1.0 }\n',
    )
    keys = []
    for lines in how:
        with pytest.raises(InputError) as caught:
            load_track(measured("s,LL,AL\n0,0,0\n1,0,0\n2,0,0\n3,0,0", USE + lines))
        keys.append([fault.key.removeprefix("irregularities.0.") for fault in caught.value.faults])
    assert keys == [["columns.z_right"], ["units", "offset", "reverse"]]
    assert "'LL' is no column that is read" in str(caught.value)


def test_missing_measured_file_is_a_fault_of_its_key(measured):
    path = measured("", USE.replace("track.csv", "other.csv"))
    with pytest.raises(InputError) as caught:
        load_track(path)
    assert caught.value.faults[0].key == "irregularities.0.file"
    assert "other.csv" in caught.value.faults[0].found


# spectra by name, standard deviations in mm between 3 and 70 m computed independently of railsim;
# the cross level as a height over 1.5 m; tolerance half a unit of the last digit printed
PRINTED = [
    *(
        (f"fra_{i}", "vertical", v)
        for i, v in ((1, 16.82), (2, 15.42), (3, 12.62), (5, 7.00), (6, 2.81))
    ),
    ("fra_6", "lateral", 2.81),
    ("fra_6", "cross_level", 2.51),
    ("fra_1983_6", "vertical", 3.37),
    ("china_trunk", "vertical", 2.43),
    ("china_trunk", "lateral", 2.34),
    ("china_trunk", "cross_level", 1.44),
]


@pytest.mark.parametrize(
    ("name", "channel", "mm", "digit"),
    [(*row, 0.01) for row in PRINTED]
    + [
        ("china_high_speed", c, v, 0.001)
        for c, v in (("vertical", 0.462), ("cross_level", 0.379), ("gauge", 0.301))
    ],
)
def test_standard_deviation_of_a_spectrum_is_the_published_one(name, channel, mm, digit):
    height = 1.5 if channel == "cross_level" else 1.0
    found = 1e3 * height * np.sqrt(SPECTRA[name].band_variance(channel, (3.0, 70.0)))
    assert found == pytest.approx(mm, abs=0.5 * digit + 1e-3 * mm)


@pytest.mark.parametrize(
    ("channel", "base", "printed"),
    [
        ("vertical", 1.0, (1.1029, -1.4709, 0.5941, 0.8480, 3.8016, -0.2500, 0.0112)),
        ("lateral", 1.0, (0.2244, -1.5746, 0.6683, -2.1466, 1.7665, -0.1506, 0.0052)),
        ("cross_level", 1.5, (0.1214, -2.1603, 2.0214, 4.5089, 2.2227, -0.0396, 0.0073)),
    ],
)
def test_spectra_of_chinese_trunk_lines_are_the_printed_fractions(channel, base, printed):
    """S = A (f2 + B f + C)/(f4 + D f3 + E f2 + F f + G) in mm2/(1/m), a height over 1.5 m."""
    A, B, C, *lower = printed
    f = np.array([1.0 / 70.0, 0.1, 1.0 / 3.0])
    printed = 1e-6 * A * np.polyval([1.0, B, C], f) / np.polyval([1.0, *lower], f)
    found = SPECTRA["china_trunk"].density(channel, 2.0 * np.pi * f)
    assert found * 2.0 * np.pi * base**2 == pytest.approx(printed, rel=1e-12)


@pytest.mark.parametrize(
    ("channel", "A", "f1", "f2"), [("cross_level", 0.7197, 0.0233, 0.1312),
                                   ("gauge", 0.5927, 0.0292, 0.2329)],
)  # fmt: skip
def test_variance_of_the_american_spectra_of_1983_is_their_integral(channel, A, f1, f2):
    """Class 6, S = 1e-7 A f2^2/((f^2 + f1^2)(f^2 + f2^2)), by partial fractions."""

    def antiderivative(f):
        return f2**2 / (f2**2 - f1**2) * (np.arctan(f / f1) / f1 - np.arctan(f / f2) / f2)

    expected = 1e-7 * A * (antiderivative(1 / 3.0) - antiderivative(1 / 70.0))
    height = 1.5 if channel == "cross_level" else 1.0
    found = height**2 * SPECTRA["fra_1983_6"].band_variance(channel, (3.0, 70.0))
    assert found == pytest.approx(expected, rel=1e-9)


def test_pieces_of_the_chinese_high_speed_spectra_join():
    for channel, density in SPECTRA["china_high_speed"].densities.items():
        f = np.geomspace(1e-2, 0.5, 20001)
        steps = np.abs(np.diff(np.log(density(f)))) - 5.0 * np.diff(np.log(f))
        assert np.max(steps) < 0.01, channel  # the source's pieces join within 0.3 %


@pytest.mark.parametrize("name", [n for n in SPECTRA if not n.startswith("erri")])
def test_realisation_of_every_spectrum_has_the_variance_of_its_band(name):
    s = 0.35 * np.arange(4000)
    found = channels(track(random(spectrum=name, end=1400.0)), s)
    for channel in SPECTRA[name].channels:
        expected = SPECTRA[name].band_variance(channel, (3.0, 70.0))
        assert np.mean(found[channel] ** 2) == pytest.approx(expected, rel=1e-4)


def test_names_of_the_definition_are_those_of_the_spectra():
    from typing import get_args

    from railsim.definitions.excitations.random import SpectrumName

    assert set(get_args(SpectrumName)) == {*SPECTRA, "own"}


# measured rows ------------------------------------------------------------------------------------


def track_of(rows, **more):
    return track({"type": "measured", "rows": rows, "fade": 0.0, **more}, length=rows[-1][0])


def test_a_step_between_few_rows_stays_a_step():
    points = ((0.0, 0.0), (50.0, 0.0), (50.05, 5e-3), (100.0, 5e-3))
    rows = [[s, 0, z, 0, z] for s, z in points]
    z = rails(track_of(rows), np.linspace(0.0, 99.9, 5000))[0][Z_LEFT]
    assert z.min() > -1e-12
    assert z.max() < 5e-3 + 1e-12


def test_a_joint_sampled_coarsely_does_not_swing():
    s = np.arange(0.0, 60.0, 0.5)
    z = np.where(np.abs(s - 30.0) < 0.3, 5e-3, 0.0)
    found = rails(
        track_of([[x, 0, v, 0, v] for x, v in zip(s, z, strict=True)]), np.linspace(0.0, 59.0, 6000)
    )[0][Z_LEFT]
    assert found.min() > -1.3e-3  # a quarter of the rows' range; the spline swings to -0.27 of it
    assert found.max() < 6.3e-3


def test_a_wave_of_eight_rows_is_followed_as_by_a_spline():
    s = np.arange(0.0, 100.0, 1.25)
    fine = np.linspace(10.0, 90.0, 3001)
    rows = [[x, 0, 4e-3 * np.sin(2 * np.pi * x / 10.0), 0, 0] for x in s]
    found = rails(track_of(rows), fine)[0][Z_LEFT]
    # error of a cubic spline at eight points a wave: (2 pi/8)^4/384 of the amplitude
    np.testing.assert_allclose(found, 4e-3 * np.sin(2 * np.pi * fine / 10.0), atol=0.004 * 4e-3)


# files of recording cars --------------------------------------------------------------------------


def recorded(tmp_path, text, **more):
    (tmp_path / "rec.csv").write_text(text)
    (tmp_path / "t.toml").write_text(
        'format = "railsim-track/1"\nname = "t"\nplan = [{ type = "STR", length = 100.0 }]\n'
        "[[irregularities]]\n"
        'type = "measured"\nfile = "rec.csv"\nfade = 0.0\n'
        + "".join(f"{key} = {value}\n" for key, value in more.items())
    )
    return load_track(tmp_path / "t.toml")


def test_columns_units_signs_decimal_comma_and_mileage_of_a_recording(tmp_path):
    lines = ["Km;Other;LL;AL"]
    for i in range(6):
        lines.append(f"{12.3 - 0.001 * i:.4f};x;{i:.1f};{2 * i}.5".replace(".", ","))
    found = recorded(
        tmp_path,
        "\n".join(lines),
        columns='{ s = "Km", z_left = "LL", y_right = "AL" }',
        units='{ s = "km", z_left = "mm", y_right = "mm" }',
        reverse='["z_left"]',
        falling_mileage="true",
    )
    assert [r for r in found.unusual() if "km" in str(r)] == []  # the track has no mileage
    for more, words in (
        ({"falling_mileage": True}, "shift = -250 makes them agree"),
        ({"falling_mileage": False}, "the file's mileage falls, that of the track rises"),
    ):
        (said,) = (
            str(r) for r in found.replace(mileage=12_050.0, **more).unusual() if r.key[-1:] == "0"
        )
        assert "begins at km 12.3000, which is put at s = 0 m, km 12.0500 of the track" in said
        assert said.endswith(words)
    found = found.irregularities[0]
    expected = [[i, 0.0, -1e-3 * i, 1e-3 * (2 * i + 0.5), 0.0] for i in range(6)]
    np.testing.assert_allclose(found.rows, expected, atol=1e-9)
    assert found.columns is None


def wave(wavelength, n=4000, step=0.25):
    s = step * np.arange(n)
    return s, 1e-3 * np.sin(2.0 * np.pi * s / wavelength)


def written(s, z):
    return "s,z_left\n" + "\n".join(f"{a:.3f},{b:.9f}" for a, b in zip(s, z, strict=True))


@pytest.mark.parametrize(
    ("wavelength", "gain"),
    # 1/sqrt(1 + (l/f)^8) at the edges is 0.707; an octave outside 1/16
    [(3.0, 0.7071), (8.0, 1.0), (25.0, 0.7071), (50.0, 0.0625)],
)
def test_band_D1_has_the_gains_of_a_butterworth_filter(tmp_path, wavelength, gain):
    s, z = wave(wavelength)
    rows = np.array(recorded(tmp_path, written(s, z), band='"D1"').irregularities[0].rows)
    inner = (s > 300.0) & (s < 700.0)
    found = np.sqrt(2.0) * np.std(rows[inner, 2])
    assert found == pytest.approx(1e-3 * gain, rel=0.01)


def test_space_curve_is_recovered_from_chord_offsets(tmp_path):
    # the chord of 4 + 6 m sees all waves of this sum; the record holds whole waves
    s = 0.25 * np.arange(4000)

    def curve(x):
        return 1e-3 * np.sin(2 * np.pi * x / 25.0) + 5e-4 * np.cos(2 * np.pi * x / 12.5)

    offsets = curve(s) - (6.0 * curve(s - 4.0) + 4.0 * curve(s + 6.0)) / 10.0
    found = recorded(tmp_path, written(s, offsets), chord="[4.0, 6.0]").irregularities[0].rows
    np.testing.assert_allclose(np.array(found)[:, 2], curve(s), atol=1e-6)


@pytest.mark.parametrize(
    ("text", "keys", "message"),
    [
        ("a;b\n0;0\n", {"columns": '{ s = "a", z_left = "c" }'}, "no column 'c'"),
        ("a;b\n0;0\n", {"columns": '{ z_left = "b" }'}, "no column for s"),
        ("s,z\n0,0\n1,0\n1.001,0.004\n2,0\n", {}, "mm within"),
        ("s,z\n0,0\n1,0\n2.5,0\n3,0\n", {"band": '"D1"'}, "unequal steps"),
    ],
)
def test_a_recording_that_cannot_be_read_is_refused(tmp_path, text, keys, message):
    with pytest.raises(InputError, match=message):
        recorded(tmp_path, text, **keys)


def test_equal_faults_of_a_recording_are_one_line_with_their_number(tmp_path):
    rows = "".join(f"{s},x\n" for s in range(25))
    with pytest.raises(InputError) as caught:
        recorded(tmp_path, f"s,z\n{rows}40,0,0\n")
    assert [str(fault).partition("rec.csv: ")[2] for fault in caught.value.faults] == [
        "line 2: not a number ('x'), and 24 more like it up to line 26; numbers only",
        "line 27: 3 values; 2 values as in the header",
    ]


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (
            "s,y_left,y_right,gauge",
            "gauge and y_left and y_right; y_left and y_right, or gauge and y",
        ),
        ("s,z_left,cross_level,y", "cross_level and z_left; z_left and z_right, or cross_level"),
    ],
)
def test_rails_and_what_is_worked_out_from_them_are_not_added_up(header, words, tmp_path):
    """A gauge 2 mm wider in all three columns would be 4 mm."""
    rows = "".join(f"{s},0.001,0.001,0.002\n" for s in range(5))
    with pytest.raises(InputError, match=words):
        recorded(tmp_path, f"{header}\n{rows}")
    kept = {"columns": '{ s = "s", gauge = "gauge" }', "units": '{ s = "m", gauge = "m" }'}
    if "gauge" in header:
        (row, *_) = recorded(tmp_path, f"{header}\n{rows}", **kept).irregularities[0].rows
        assert row[3] - row[1] == pytest.approx(0.002)


def test_a_recording_named_in_python_is_not_read():
    part = {"type": "measured", "file": "rec.csv"}
    track = load_track("straight").replace(irregularities=[part])
    for use in (displacement, shortest_length, measured_remarks):
        with pytest.raises(InputError, match=r"rec\.csv: a recording that has not been read"):
            use(track)


def test_missing_rows_are_remarked_on(tmp_path):
    s = np.arange(0.0, 90.0, 0.25)
    z = 1e-3 * np.sin(2.0 * np.pi * s / 12.0)
    assert measured_remarks(recorded(tmp_path, written(s, z))) == []
    kept = ((s <= 20.0) | (s >= 32.0)) & ((s <= 50.0) | (s >= 52.0))
    (remark,) = measured_remarks(recorded(tmp_path, written(s[kept], z[kept]), shift=5.0))
    assert "no rows from s = 25.0 to 37.0 m, the longest of 2 such gaps" in remark
    later = ((s <= 20.0) | (s >= 22.0)) & ((s <= 50.0) | (s >= 61.0))
    (remark,) = measured_remarks(recorded(tmp_path, written(s[later], z[later])))
    assert "no rows from s = 50.0 to 61.0 m, the longest of 2 such gaps" in remark
    few = kept & (s < 36.0) & (s > 15.0)  # a defect drawn by hand
    assert measured_remarks(recorded(tmp_path, written(s[few], z[few]))) == []
    (remark,) = measured_remarks(recorded(tmp_path, written(s, z), shift=-30.0))
    assert remark.startswith("What is recorded goes from s = -30 to 60 m of the 100 m of the track")
    for shift, words in ((5000.0, "5000 to 5090 m"), (-5000.0, "-5000 to -4910 m")):
        (remark,) = measured_remarks(recorded(tmp_path, written(s, z), shift=shift))
        assert remark.startswith(f"What is recorded goes from s = {words} of the 100 m")


def corrugated(wave, distance, amplitude=2e-5, length=12.0, **more):
    """A straight with waves of both rails, a row each `distance`, beside some level of 20 m."""
    s = np.arange(0.0, length, distance)
    z = amplitude * np.sin(2.0 * np.pi * s / wave) + 2e-3 * np.sin(2.0 * np.pi * s / 20.0)
    rows = [
        [at, 0.0, height, 0.0, height] for at, height in zip(s.tolist(), z.tolist(), strict=True)
    ]
    part = {"type": "measured", "rows": rows, "fade": 1.0}
    plan = [{"type": "STR", "length": length}]
    return load_track("straight").replace(plan=plan, cant=[], irregularities=[part], **more)


@pytest.mark.parametrize(("wave", "distance"), [(0.03, 0.004), (0.06, 0.005), (0.1, 0.01)])
def test_tables_follow_corrugation(wave, distance):
    """Cubics of the cells against the sine, between rows too: 1 % of its amplitude."""
    track = corrugated(wave, distance)
    tables = track_tables(track)
    s = np.linspace(3.0, 5.0, 1999)
    cell, u = np.divmod(s - tables.s_start, tables.ds)
    cubic = tables.rail[cell.astype(int), 1]
    found = sum(cubic[:, k] * u**k for k in range(4))
    exact = 2e-5 * np.sin(2.0 * np.pi * s / wave) + 2e-3 * np.sin(2.0 * np.pi * s / 20.0)
    np.testing.assert_allclose(found, exact, atol=2.5e-7)
    assert measured_remarks(track) == []


def test_close_rows_without_short_waves_make_no_fine_tables():
    assert shortest_length(corrugated(0.06, 0.005, amplitude=0.0)) == 0.05
    assert shortest_wave(corrugated(0.06, 0.005, amplitude=0.0)) == np.inf
    assert shortest_wave(corrugated(0.06, 0.005)) == pytest.approx(0.04)
    # two rows 1 mm apart, as where records are put together
    rows = [[s, 0.0, 1e-3 * (s == 5.0), 0.0, 0.0] for s in (0.0, 2.0, 4.0, 5.0, 5.001, 6.0, 8.0)]
    part = {"type": "measured", "rows": rows}
    assert shortest_length(load_track("straight").replace(irregularities=[part])) == 0.05


def test_rows_too_close_for_the_length_of_the_track_are_remarked_on():
    """20 km over 500 000 lengths of 40 mm each: four a wave."""
    (remark, _) = measured_remarks(
        corrugated(0.06, 0.005).replace(plan=[{"type": "STR", "length": 20e3}])
    )
    assert remark.startswith("irregularities.0 has rows closer than a track of 20000 m is resolved")
    assert "waves below 160 mm are not followed" in remark


def test_a_recording_smaller_than_any_track_is_remarked_on(tmp_path):
    """Values in m under a name in mm; the roughness of rails is as small, in rows close by."""
    s = np.arange(0.0, 90.0, 0.25)
    z = 1e-3 * np.sin(2.0 * np.pi * s / 12.0)
    (remark,) = measured_remarks(recorded(tmp_path, written(s, 1e-3 * z)))
    assert remark.startswith("irregularities.0 moves the rails by 0.001 mm at most")
    fine = np.arange(0.0, 90.0, 0.01)
    rough = 2e-5 * np.sin(2.0 * np.pi * fine / 0.2)
    assert measured_remarks(recorded(tmp_path, written(fine, rough))) == []


@pytest.mark.parametrize(("level", "remarked"), [(80.0, True), (-80.0, True), (8.0, False)])
def test_a_cross_level_that_holds_the_cant_is_remarked_on(level, remarked):
    """A recording car measures the cant too: added to that of the plan it would be 160 mm."""
    s = np.arange(0.0, 1000.0, 0.5)
    share = np.interp(s, [0.0, 300.0, 360.0, 420.0, 480.0], [0.0, 0.0, 1.0, 1.0, 0.0])
    half = 0.5e-3 * (level * share + np.sin(s))
    rows = [(a, 0.0, -b, 0.0, b) for a, b in zip(s.tolist(), half.tolist(), strict=True)]
    part = {"type": "measured", "rows": rows}
    curve = load_track("curve_r500").replace(
        cant=[
            {"type": "CST", "length": 300.0, "cant": 0.0},
            {"type": "LIR", "length": 60.0},
            {"type": "CST", "length": 60.0, "cant": 0.08},
            {"type": "LIR", "length": 60.0},
            {"type": "CST", "length": 300.0, "cant": 0.0},
        ],
        irregularities=[part],
    )
    found = measured_remarks(curve)
    assert bool(found) == remarked
    if remarked:
        assert f"is {level:.0f} mm in the mean about s = 390 m" in found[0]


@pytest.mark.parametrize("alike", [True, False])
def test_an_alignment_that_holds_the_versines_of_a_curve_is_remarked_on(alike):
    """A chord of 10 m in a right-hand curve of 500 m: (5 m)^2/(2 500 m) = 25 mm, to the left."""
    s = np.arange(0.0, 1000.0, 0.5)
    y = -25e-3 * np.interp(s, [300.0, 360.0, 420.0, 480.0], [0.0, 1.0, 1.0, 0.0]) * alike
    y += 3e-3 * np.sin(s)
    rows = [(a, b, 0.0, b, 0.0) for a, b in zip(s.tolist(), y.tolist(), strict=True)]
    part = {"type": "measured", "rows": rows}
    found = measured_remarks(load_track("curve_r500").replace(irregularities=[part]))
    assert len(found) == alike
    if alike:
        assert "alignment of irregularities.0 is -25 mm in the mean about s = 390 m, in" in found[0]
        assert "in the curve of 500 m" in found[0]


@pytest.mark.parametrize(("unit", "metres"), [("in", 0.0254), ("ft", 0.3048), ("mm", 0.001)])
def test_units_of_columns(tmp_path, unit, metres):
    rows = "\n".join(f"{2 * k},{0.01 * k}" for k in range(5))
    track = recorded(tmp_path, f"s_ft,z_left_{unit}\n{rows}")
    found = np.array(track.irregularities[0].rows)
    np.testing.assert_allclose(found[:, 0], 0.6096 * np.arange(5.0), rtol=1e-12)
    np.testing.assert_allclose(found[:, 2], 0.01 * metres * np.arange(5.0), rtol=1e-12)


def test_largest_value_between_the_rows_is_reported(tmp_path):
    """Eight rows a wave: with one on the crest, and with the crest between two."""
    s = np.arange(0.0, 60.0, 1.0)
    met = recorded(tmp_path, written(s, 4e-3 * np.sin(2.0 * np.pi * s / 8.0)))
    assert measured_remarks(met) == []
    z = 4e-3 * np.sin(2.0 * np.pi * s / 8.0 + np.pi / 8.0)
    column, at_rows, between, _ = largest_between_rows(
        recorded(tmp_path, written(s, z)).irregularities[0]
    )
    assert column == "z_left"
    assert at_rows == pytest.approx(4e-3 * np.cos(np.pi / 8.0), rel=1e-6)
    assert between == pytest.approx(4e-3, rel=0.01)
    (remark,) = measured_remarks(recorded(tmp_path, written(s, z)))
    assert "z_left reaches 4 mm" in remark
    assert "the largest row is 3.7 mm" in remark


@pytest.mark.parametrize("begin", [100.0, 101.5])
def test_rails_have_no_kink_at_the_ends_of_a_gap(begin):
    """Waves of 6 m and 5 mm bend by A k^2 = 5.5e-3 1/m; the gap nowhere bends more."""
    k, amplitude = 2.0 * np.pi / 6.0, 5e-3
    s = np.arange(0.0, 200.0, 0.25)
    s = s[(s <= begin) | (s >= begin + 12.0)]
    rows = [(float(x), 0.0, amplitude * float(np.sin(k * x)), 0.0, 0.0) for x in s]
    track = load_track("straight").replace(irregularities=[{"type": "measured", "rows": rows}])
    at = np.arange(begin - 5.0, begin + 17.0, 0.05)
    (_, z, *_), (_, slope, *_) = displacement(track)(at)
    assert np.abs(np.diff(slope)).max() / 0.05 <= 1.05 * amplitude * k**2
    assert np.abs(z).max() <= amplitude * np.hypot(1.0, 0.75 * k)  # a slope A k falls within 1.5 m
    assert slope == pytest.approx(np.gradient(z, at), abs=2e-4)
