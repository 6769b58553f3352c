"""Laws that hold for every track: unit arc length, heading, mirror image, text and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.definitions.excitations.base import faded
from railsim.definitions.loading import load_track_text
from railsim.definitions.mirror import mirrored_track
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections, track_faults
from railsim.track.alignment import Alignment
from railsim.track.tables import track_tables

lengths = st.floats(20.0, 200.0)


@given(st.floats(0.5, 30.0), st.floats(0.0, 6.0))
def test_what_is_faded_in_and_out_has_the_slope_of_its_values(fade, phase):
    """Nothing up to `begin` and from `end` on, all of it in between, by 1 - cos over `fade`."""

    def wave(s):
        return np.stack([np.sin(0.3 * s + phase)] * 4), np.stack(
            [0.3 * np.cos(0.3 * s + phase)] * 4
        )

    moved, s, h = faded(wave, 20.0, 90.0, fade), np.linspace(0.0, 110.0, 997), 1e-5
    value, slope = moved(s)
    away = np.min(np.abs(s[:, None] - [20.0, 20.0 + fade, 90.0 - fade, 90.0]), axis=1) > h
    found = (moved(s + h)[0] - moved(s - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(slope[:, away], found[:, away], atol=1e-6)
    outside, whole = (s <= 20.0) | (s >= 90.0), (s >= 20.0 + fade) & (s <= 90.0 - fade)
    assert not value[:, outside].any()
    np.testing.assert_allclose(value[:, whole], wave(s)[0][:, whole], atol=1e-12)
    at = 20.0 + 0.25 * fade
    assert moved(np.array([at]))[0][0] == pytest.approx(
        0.5 * (1.0 - np.cos(0.25 * np.pi)) * np.sin(0.3 * at + phase), abs=1e-12
    )


radii = st.builds(
    lambda size, sign: size * sign, st.floats(150.0, 3000.0), st.sampled_from([1.0, -1.0])
)


@st.composite
def tracks(draw):
    """Straights and curves on either hand, each with its cant, and a transition between any two."""
    plan = [{"type": "STR", "length": draw(lengths)}]
    cant = [{"type": "CST", "length": plan[0]["length"], "cant": 0.0}]
    for _ in range(draw(st.integers(1, 4))):
        length, transition = draw(lengths), draw(lengths)
        curved = draw(st.booleans())
        radius = draw(radii)
        plan.append({"type": "CLO", "length": transition})
        cant.append({"type": "LIR", "length": transition})
        plan.append(
            {"type": "CIR", "length": length, "radius": radius}
            if curved
            else {"type": "STR", "length": length}
        )
        height = draw(st.floats(0.0, 0.15)) * np.sign(radius) if curved else 0.0
        cant.append({"type": "CST", "length": length, "cant": float(height)})
    return Track(
        format="railsim-track/1",
        name="any",
        plan=plan,
        cant=cant,
        vertical=[{"type": "CST", "length": 10.0, "gradient": draw(st.floats(-0.04, 0.04))}],
        rounding=draw(st.floats(1.0, 20.0)),
        cant_rotation=draw(st.sampled_from(["centre", "inner_rail"])),
    )


@given(tracks())
@settings(max_examples=25, deadline=None)
def test_centre_line_has_unit_speed(track):
    tables = track_tables(track)
    slope = tables.coefficients[:, :3, 1]
    np.testing.assert_allclose(np.linalg.norm(slope, axis=1), 1.0, atol=1e-14)
    # and between the nodes, to the order of the interpolation
    middle = slope + tables.ds * (
        tables.coefficients[:, :3, 2] + 0.75 * tables.ds * tables.coefficients[:, :3, 3]
    )
    np.testing.assert_allclose(np.linalg.norm(middle, axis=1), 1.0, atol=1e-8)


@given(tracks())
@settings(max_examples=25, deadline=None)
def test_heading_behind_the_track_is_the_integral_of_the_plan(track):
    assert track_faults(track) == []
    total = sum(
        0.5 * (section.start_value + section.end_value) * section.length
        for section in curvature_sections(track)
    )
    last = curvature_sections(track)[-1].end_value
    heading = Alignment(track).heading(track.length + 100.0)
    assert abs(heading - total - 100.0 * last) < 1e-11


@given(tracks())
@settings(max_examples=25, deadline=None)
def test_mirror_image_is_exact_and_its_own_inverse(track):
    mirrored = mirrored_track(track)
    assert mirrored_track(mirrored) == track
    signs = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_array_equal(
        track_tables(mirrored).coefficients, signs[:, None] * track_tables(track).coefficients
    )


@given(tracks())
@settings(max_examples=25, deadline=None)
def test_text_reads_back_to_the_same_track(track):
    assert load_track_text(track.to_toml()) == track
