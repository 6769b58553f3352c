"""Lists of rails' sections as users get them wrong: one clear sentence for each."""

import numpy as np
import pytest

from railsim.definitions.loading import load_settings, load_track, load_track_text, load_vehicle
from railsim.definitions.section_files import read_sections
from railsim.errors import InputError
from railsim.model.assembly import assemble

PLACES = np.round(np.linspace(0.0, 2.0, 21), 9)
Y = np.linspace(-0.035, 0.035, 40)
TOP = 0.012 * (np.abs(Y) / 0.035) ** 4


def rows(y=Y, z=TOP):
    """Sections of a plain rail, all alike but for the one in the middle."""
    return [(s, y, z) if k == 10 else (s, Y, TOP) for k, s in enumerate(PLACES)]


def loaded(tmp_path, sections, more=""):
    """Track with these sections, from a file; `more` keys of the range."""
    lines = [f"{s},{y},{z}" for s, ys, zs in sections for y, z in zip(ys, zs, strict=True)]
    (tmp_path / "list.csv").write_text("s,y,z\n" + "\n".join(lines) + "\n")
    part = 'rail = "right"\nfile = "list.csv"\nshift = 50.0\nbegin = 50.2\nend = 51.8\n' + more
    head = 'format = "railsim-track/1"\nname = "x"\ngauge = 1.435\nrail = "60E1"\n'
    plan = 'inclination = 0.025\nfriction = 0.3\nplan = [{ type = "STR", length = 100.0 }]\n'
    file = tmp_path / "track.toml"
    file.write_text(head + plan + "[[sections]]\n" + part)
    return load_track(file)


def test_plain_sections_are_taken_without_a_remark(tmp_path):
    assert not loaded(tmp_path, rows()).unusual()


@pytest.mark.parametrize(
    ("sections", "said"),
    [
        (rows(y=-Y), "at 1 m goes back by 70 mm; from the gauge side"),
        (rows(y=np.concatenate([Y[:10], Y[25:9:-1], Y[26:]])), "without crossing itself"),
        (rows(z=-3.0 * TOP), "top at z = -36 mm; within 10 mm of the rail tops, z positive down"),
        (rows(y=Y + 0.03), "a jump of 30 mm from 0.9 to 1 m, which no blend can follow"),
        (rows(z=TOP * np.nan), r"row '1\.0, -0\.035, nan'; numbers s, y, z"),
        ([*rows()[:3], (np.nan, Y, TOP), *rows()[3:]], "row 'nan, -0.035"),
        (rows(y=1e3 * Y), "wide; 10 to 400 mm; y, z in m or mm"),
        ([*rows()[:5], rows()[6], rows()[5], *rows()[7:]], "0.5 after 0.6; rising positions"),
        ([(1e3 * s, *points) for s, *points in rows()], "are the positions in m"),
        (rows()[5:], "sections from 50.5 to 52 m do not reach over the range"),
    ],
)
def test_wrong_sections_are_refused(tmp_path, sections, said):
    with pytest.raises(InputError, match=said):
        loaded(tmp_path, sections)


def test_a_position_that_is_listed_twice_is_refused(tmp_path):
    """Of two files at one place none is left out in silence."""
    for name in ("one", "other"):
        np.savetxt(tmp_path / f"{name}.csv", np.transpose([Y, TOP]), delimiter=",")
    (tmp_path / "list.csv").write_text("s,file\n0,one.csv\n10,one.csv\n10.0,other.csv\n")
    with pytest.raises(InputError, match="position 10 after 10; rising positions"):
        read_sections(tmp_path / "list.csv", "rail")


def test_a_section_that_only_grows_wider_is_no_jump(tmp_path):
    """One edge moves by 30 mm, the other stays within 1 mm or moves to the other side."""
    for moved in ([1e-3, 30e-3], [-30e-3, -1e-3], [-30e-3, 30e-3]):
        wider = np.interp(Y, [Y[0], Y[-1]], np.add([Y[0], Y[-1]], moved))
        assert loaded(tmp_path, rows(y=wider)).sections


def test_gap_is_remarked(tmp_path):
    (remark,) = loaded(tmp_path, rows()[:7] + rows()[13:]).unusual()
    assert "no section from 50.6 to 51.3 m: the rail between is blended" in str(remark)


def test_first_section_without_a_gauge_face_is_named(tmp_path):
    """These sections end 12 mm below the top: found where contact tables are made."""
    track = loaded(tmp_path, rows())
    with pytest.raises(InputError, match="gauge_face: the gauge side ends 12"):
        assemble(load_vehicle("coach_manchester"), track, load_settings())


@pytest.mark.parametrize(
    "turned", [["begin=49.6", "end=50.5"], ["trailing=true", "begin=49.5", "end=50.4"]]
)
def test_range_that_ends_between_wing_and_nose_needs_a_gauge_face(turned):
    """At one end the wing is the highest rail: 97 mm from the gauge side of the other end."""
    track = load_track("crossing_56e1_r245_1in9.25", [f"sections.0.{one}" for one in turned])
    part = track.sections[0].model_copy(update={"gauge_face": None})
    with pytest.raises(InputError, match=r"gauge side is -?97 mm beside the first's; a number"):
        assemble(load_vehicle("wagon_y25"), track.replace(sections=[part]), load_settings())


def test_a_trailing_list_is_passed_from_its_end(tmp_path):
    """The flatter section at s = -1.5 m of the list is at 50 + 1.5 m of the track."""
    listed = [(s, Y, TOP * (0.9 if s == -1.5 else 1.0)) for s in np.round(PLACES - 2.0, 9)]
    (found,) = loaded(tmp_path, listed, "trailing = true\n").sections
    places = [one.s for one in found.contours]
    assert places == sorted(places)
    flatter = [one.s + found.shift for one in found.contours if one.z[0] < 0.95 * TOP[0]]
    assert flatter == [51.5]
    again = loaded(tmp_path, listed, "trailing = true\n")
    assert load_track_text(again.to_toml()).sections == again.sections  # not turned once more
    with pytest.raises(InputError, match="'trailing' turns the list of a 'file'"):
        again.replace(sections=[{**found.model_dump(exclude_none=True), "trailing": True}])
    with pytest.raises(InputError, match=r"sections.0.trailing: .*a valid boolean"):
        loaded(tmp_path, listed, 'trailing = "yes"\n')
