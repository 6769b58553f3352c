"""Irregularities of the track against their definitions: spectra, shapes, measured data."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

from railsim.definitions.loading import load_track
from railsim.definitions.track import Track
from railsim.errors import InputError
from railsim.track.irregularity import (
    ERRI_B176,
    band_variance,
    displacement,
    spectral_density,
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


def test_coefficients_are_those_of_the_reference(reference_dir):
    text = (reference_dir / "irregularities.md").read_text()
    for value in ("2.119e-7, 4.032e-7, 5.32e-8", "6.125e-7, 1.080e-6, 1.032e-7"):
        assert value in text
    low, high = ERRI_B176["erri_b176_low"], ERRI_B176["erri_b176_high"]
    assert (low.lateral, low.vertical, low.gauge) == (2.119e-7, 4.032e-7, 5.32e-8)
    assert (high.lateral, high.vertical, high.gauge) == (6.125e-7, 1.080e-6, 1.032e-7)
    assert (low.omega_c, low.omega_r, low.omega_s, low.b) == (0.8246, 0.0206, 0.4380, 0.75)


@pytest.mark.parametrize("channel", CHANNELS)
def test_band_variance_is_the_integral_of_the_spectrum(channel):
    low = ERRI_B176["erri_b176_low"]
    exact, _ = quad(
        lambda omega: float(spectral_density(low, channel, np.array(omega))),
        2.0 * np.pi / 70.0,
        2.0 * np.pi / 3.0,
        epsabs=0.0,
        epsrel=1e-10,
    )
    assert band_variance(low, channel, (3.0, 70.0)) == pytest.approx(exact, rel=1e-9)


def test_vertical_spectrum_has_the_closed_integral_of_two_poles():
    # over all wave numbers: pi A omega_c / (2 omega_r (omega_c + omega_r))
    c = ERRI_B176["erri_b176_high"]
    closed = np.pi * c.vertical * c.omega_c / (2.0 * c.omega_r * (c.omega_c + c.omega_r))
    assert band_variance(c, "vertical", (1e-3, 1e9)) == pytest.approx(closed, rel=1e-6)


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("spectrum", ["erri_b176_low", "erri_b176_high"])
def test_variance_over_50_seeds_is_the_integral_of_the_band(channel, spectrum):
    wavelengths = (3.0, 25.0)
    s = np.arange(100.0, 900.0, 0.5)  # some stretch within, not the period
    variances = []
    for seed in range(50):
        part = random(spectrum=spectrum, seed=seed, wavelengths=wavelengths, channels=[channel])
        variances.append(np.mean(channels(track(part), s)[channel] ** 2))
    expected = band_variance(ERRI_B176[spectrum], channel, wavelengths)
    assert np.mean(variances) == pytest.approx(expected, rel=0.02)


def test_variance_over_the_whole_period_is_exact_for_every_seed():
    # default band: the period is 20 times 70 m
    s = 0.35 * np.arange(4000)
    for seed in range(3):
        found = channels(track(random(seed=seed, end=1400.0)), s)
        for channel in CHANNELS:
            expected = band_variance(ERRI_B176["erri_b176_low"], channel, (3.0, 70.0))
            # interpolation of the shortest waves on their lattice
            assert np.mean(found[channel] ** 2) == pytest.approx(expected, rel=1e-4)


def test_spectrum_of_a_long_track_is_the_given_one():
    s = np.arange(0.0, 20e3, 0.5)
    z = channels(track(random(end=20e3), length=20e3), s)["vertical"]
    frequency, density = welch(z, fs=2.0, nperseg=2048)
    omega = 2.0 * np.pi * frequency
    band = (omega > 0.15) & (omega < 2.0)
    given = spectral_density(ERRI_B176["erri_b176_low"], "vertical", omega[band])
    ratio = density[band] / (2.0 * np.pi) / given
    # each estimate averages 38 periodograms (16 %); their mean over 600 lines is close to one
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.03)
    assert np.percentile(ratio, [5, 95]) == pytest.approx([1.0, 1.0], abs=0.4)


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
    ],
)
def test_rate_is_the_derivative(part):
    s, h = np.linspace(20.003, 80.0, 500), 1e-5
    moved = displacement(track(part))
    difference = (moved(s + h)[0] - moved(s - h)[0]) / (2.0 * h)
    # round-off 1e-18 / 1e-5 and, at the ends of a cosine, half of h times its second derivative
    np.testing.assert_allclose(moved(s)[1], difference, atol=1e-7)


@pytest.mark.parametrize("part", [random(fade=10.0, end=90.0), DIP, KINK, TWIST, MEASURED])
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


def test_measured_track_geometry_becomes_displacements_of_the_rails(measured):
    rows = "\n".join(f"{x};0.001;0.002;0.004;0.006" for x in range(6))
    track_ = load_track(measured("s_m;y;z;cross_level;gauge\n" + rows))
    value, _ = rails(track_, [2.5])
    expected = [0.001 - 0.003, 0.002 - 0.002, 0.001 + 0.003, 0.002 + 0.002]
    np.testing.assert_allclose(value[:, 0], expected, atol=1e-15)


@pytest.mark.parametrize(
    ("csv", "expected"),
    [
        ("", "empty"),
        ("s,z_lefft\n0,1", "did you mean 'z_left'?"),
        ("z_left\n1", "no column s"),
        ("s,z,z_mm\n0,1,1", "a column occurs twice"),
        ("s,z\n0,0\n1,0\n2,nan\n3,0\n4,0", "line 4: not a finite number"),
        ("s,z\n0,0\n1,x\n2,0\n3,0\n4,0", "line 3: not a number"),
        ("s,z\n0,0\n1\n2,0\n3,0\n4,0", "line 3: 1 values"),
        ("s,z\n0,0\n1,0", "four rows at least"),
        ("s,z\n0,0\n1,0\n1,0\n2,0\n3,0", "line 4: s = 1 m does not increase"),
        ("s,z\n0,0\n1,0\n2,5\n3,0", "line 4: a displacement of 5 m"),
    ],
)
def test_wrong_measured_file_is_refused(measured, csv, expected):
    with pytest.raises(InputError) as caught:
        load_track(measured(csv))
    assert any(expected in str(fault) for fault in caught.value.faults)


def test_missing_measured_file_is_a_fault_of_its_key(measured):
    path = measured("", USE.replace("track.csv", "other.csv"))
    with pytest.raises(InputError) as caught:
        load_track(path)
    assert caught.value.faults[0].key == "irregularities.0.file"
    assert "other.csv" in caught.value.faults[0].found
