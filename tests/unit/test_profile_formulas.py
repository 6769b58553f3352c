"""Formulas of profiles on their own: smoothing, constructed profiles, what a file asks for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.profiles import load_profile
from railsim.profiles.builtin import builtin_profile
from railsim.profiles.readers import Points, _miniprof, _process_simpack
from railsim.profiles.smoothing import departures, smoothed_points


def points(y, z):
    return Points(file="made", name="made", y=y, z=z, line=np.arange(y.size))


@pytest.mark.parametrize(("noise", "spacing"), [(3e-6, 0.2e-3), (10e-6, 0.1e-3), (20e-6, 0.4e-3)])
def test_smoothing_halves_the_wave_whose_noise_of_curvature_is_3_per_metre(noise, spacing):
    """noise (2 pi/L)^2 sqrt(spacing/L) = 3/m gives L; a wave of 2 L passes to 16/17, L/2 to 1/17.

    A spline with a penalty on the second derivative passes 1/(1 + (L/wave)^4).
    """
    length = (noise * (2.0 * np.pi) ** 2 * np.sqrt(spacing) / 3.0) ** 0.4
    y = spacing * np.arange(1500)
    for wave, passed in ((length, 0.5), (2.0 * length, 16.0 / 17.0), (0.5 * length, 1.0 / 17.0)):
        z = noise * np.random.default_rng(1).normal(size=y.size)
        turns = 2.0 * np.pi * y / wave
        size = noise * min(0.3, (0.1 * wave / spacing) ** 2)  # that the noise is still told
        both = [
            smoothed_points(points(y, z + sign * size * np.sin(turns)))[1] for sign in (1.0, -1.0)
        ]
        middle = slice(300, -300)
        change = 0.5 * (both[0] - both[1])[middle]
        found = 2.0 * np.mean(change * np.sin(turns[middle])) / size
        assert found == pytest.approx(passed, abs=0.04)


@settings(max_examples=20)
@given(noise=st.floats(1e-7, 1e-4), seed=st.integers(0, 99))
def test_noise_of_points_on_any_cubic_is_told(noise, seed):
    random = np.random.default_rng(seed)
    s = np.cumsum(random.uniform(0.1e-3, 0.3e-3, 3000))
    cubic = np.polynomial.polynomial.polyval(s, random.normal(size=4))
    found = departures(s, cubic + noise * random.normal(size=s.size))
    assert np.median(np.abs(found)) / 0.6745 == pytest.approx(noise, rel=0.15)


def test_hollow_tread_is_s1002_less_its_squared_cosine():
    new, hollow = builtin_profile("S1002"), builtin_profile("S1002_hollow")
    inside = np.abs(new.y) < 35e-3
    depth = np.where(inside, 0.9e-3 * np.cos(np.pi * new.y / 70e-3) ** 2, 0.0)
    np.testing.assert_allclose(new.z - hollow.z, depth, atol=1e-12)


@settings(max_examples=40)
@given(st.dictionaries(
    st.sampled_from(["shift.y", "shift.z", "rotate", "units.ang.f", "mirror.y", "mirror.z",
                     "inversion", "bound.y.min", "bound.y.max", "bound.z.min", "bound.z.max"]),
    st.sampled_from([0.0, 1.0, -0.3, 0.8, 57.3]),
))  # fmt: skip
def test_a_simpack_file_is_shifted_turned_cut_and_mirrored_in_this_order(values):
    random = np.random.default_rng(5)
    y, z = random.uniform(-1.0, 1.0, (2, 60))
    work = points(y, z)
    if values.get("units.ang.f") == 0.0:
        del values["units.ang.f"]
    _process_simpack(work, values)
    angle = values.get("rotate", 0.0) / values.get("units.ang.f", 1.0)  # in radians by default
    both = (y + values.get("shift.y", 0.0)) + 1j * (z + values.get("shift.z", 0.0))
    both = both * np.exp(1j * angle)
    for axis, part in (("y", both.real), ("z", both.imag)):
        low, high = (values.get(f"bound.{axis}.{end}") for end in ("min", "max"))
        low, high = 1.0 if low is None else low, 0.0 if high is None else high
        if low < high:
            outside = (part < low) | (part > high)
            both = np.where(outside, np.nan, both)
    both = both[~np.isnan(both)]
    y = both.real * (-1.0 if values.get("mirror.y") == 1.0 else 1.0)
    z = both.imag * (-1.0 if values.get("mirror.z") == 1.0 else 1.0)
    order = slice(None, None, -1 if values.get("inversion") == 1.0 else 1)
    np.testing.assert_allclose(work.y, y[order], atol=1e-12)
    np.testing.assert_allclose(work.z, z[order], atol=1e-12)


def test_what_was_measured_stands_beside_what_is_smoothed(tmp_path):
    """In the same axes: they differ by the noise and no more."""
    new, noise = builtin_profile("S1002"), 8e-6
    random = np.random.default_rng(2)
    y, z = new.y[::4], new.z[::4] + 2.5e-3
    rows = np.column_stack([y, z]) + noise * random.normal(size=(y.size, 2))
    path = tmp_path / "wheel.csv"
    path.write_text("y_mm,z_mm\n" + "\n".join(f"{1e3 * a:.6f},{1e3 * b:.6f}" for a, b in rows))
    profile = load_profile(path, "wheel")
    assert profile.measured is not None
    apart = profile.measured - [profile.y, profile.z]
    assert np.max(np.abs(apart)) < 5.0 * noise
    assert np.std(apart[1]) == pytest.approx(noise, rel=0.3)
    assert np.interp(0.0, profile.y, profile.z) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("head", "order"),
    [
        (["Wheel 920", "12 left of 4", "car 3 4"], "XY"),  # a title block, with numbers in it
        (["ProgramName=MiniProf", "Radius=460", "XYPoints=3"], "XY"),
        (["ColumnDef=X,Y", "XYPoints=3"], "XY"),
        (["ColumnDef=A,Y, X", "XYPoints=3"], "AYX"),
        (["columndef=y,x", '"a remark 1 2'], "YX"),
    ],
)
def test_a_head_of_miniprof_is_no_point_and_names_the_columns(head, order):
    values = {"X": [-1.0, 0.5, 2.0], "Y": [2.0, 3.0, 4.5], "A": [9.0, 8.0, 7.0]}
    rows = [" ".join(map(str, row)) for row in zip(*(values[c] for c in order), strict=True)]
    found = _miniprof("w.whl", [*head, "", *rows])
    assert (found.y.tolist(), found.z.tolist()) == (values["X"], values["Y"])
    assert found.line.tolist() == [len(head) + 2 + k for k in range(3)]
    assert (found.unit, found.notes) == (1e-3, [])
