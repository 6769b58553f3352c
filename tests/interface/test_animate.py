"""Animations: scenes of runs and modes, the page, the film, the command."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from example_result import example_result
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

import railsim
from railsim.animation import mode_scene, result_scene, write_movie, write_page
from railsim.animation.movie import _extent, _on_screen, _polygons, _shape, draw
from railsim.animation.page import scene_data
from railsim.animation.scene import DrawnBody, _bodies_to_draw
from railsim.cli import main
from railsim.cli.animate import _scene
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.outlines import body_boxes
from railsim.errors import InputError
from railsim.profiles import load_profile

PROFILES = {name: load_profile(name) for name in ("S1002", "60E1")}


@pytest.fixture(scope="module")
def result():
    made = example_result()
    return railsim.Result(
        {name: made[name] for name in made}, made.quantities, made.coordinates, made.attributes,
        PROFILES,
    )  # fmt: skip


def test_scene_holds_the_vehicle_and_its_way(result):
    scene = result_scene(result, frames=50)
    kinds = [body.kind for body in scene.bodies]
    assert kinds == ["car", "frame", "frame", "wheelset", "wheelset", "wheelset", "wheelset"]
    assert len(scene.time) == 50
    wheels = [body for body in scene.bodies if body.kind == "wheelset"]
    assert [round(body.offset, 2) for body in wheels] == [10.78, 8.22, -8.22, -10.78]
    # 49 s at 20 m/s through a right-hand curve of 250 m: the track turns by 120/250 + 60/250 - ...
    turn = scene.track["heading"][-1] - scene.track["heading"][0]
    kappa = np.trapezoid(np.interp(np.arange(980.0), [300, 360, 420, 480], [0, 1, 1, 0])) / 250.0
    assert turn == pytest.approx(kappa, rel=1e-3)
    way = np.hypot(np.diff(scene.track["x"]), np.diff(scene.track["y"]))
    assert np.allclose(way, 1.0, atol=1e-5)


def test_wheels_stand_on_their_rails(result):
    """At rest the tread near the nominal rolling circle touches the rail's top within 0.2 mm."""
    scene = result_scene(result, frames=5)
    for section in scene.sections[0]:
        y = np.abs(section["wheel_y"])
        tread = (y > 0.73) & (y < 0.76)
        wheel = section["wheel_z"][tread] - 0.46
        order = np.argsort(np.abs(section["rail_y"]))
        rail = np.interp(y[tread], np.abs(section["rail_y"])[order], section["rail_z"][order])
        assert abs(np.max(wheel - rail)) < 2e-4


def test_wheelsets_are_drawn_where_they_are_on_irregular_rails():
    """The track as a whole lies 4 mm aside and 20 mm higher: no wheel is drawn within its rail."""
    rows = (
        "{type='kink', s=40.0, length=60.0, offset=0.004, shape='cosine'}, "
        "{type='dip', s=75.0, length=100.0, depth=-0.02}"
    )
    track = railsim.load_track("straight", [f"irregularities=[{rows}]"])
    coach = railsim.load_vehicle("coach_manchester")
    result = railsim.simulate(coach, track, speed=20.0, start=65.0, duration=0.3)
    scene = result_scene(result, frames=20)
    wheelsets = [k for k, body in enumerate(scene.bodies) if body.kind == "wheelset"]
    poses = scene.pose[:, wheelsets]
    moved = result.body_position[:, [result.bodies.index(name) for name in result.wheelsets]]
    assert np.max(np.abs(moved[..., 1])) > 2e-3
    assert np.max(np.abs(poses[..., 1])) < 1e-3
    # but for the settlement of elastic rails under the wheel loads
    assert np.min(moved[..., 2]) < -0.015
    assert np.max(np.abs(poses[..., 2])) < 2e-3


def test_contacts_lie_on_the_drawn_wheels_and_rails_on_tracks_with_cross_level():
    """The wheelset is drawn level with its rails: its contacts turn with it, by up to 3 mm."""
    rows = "{type='random', spectrum='erri_b176_high', seed=3}"
    track = railsim.load_track("straight", [f"irregularities=[{rows}]"])
    coach = railsim.load_vehicle("coach_manchester")
    result = railsim.simulate(coach, track, speed=30.0, start=60.0, duration=6.0)
    scene = result_scene(result, frames=200)
    first = next(k for k, body in enumerate(scene.bodies) if body.kind == "wheelset")
    _, y_rolled, _, roll, _, _ = scene.pose[:, first].T
    for side, section in enumerate(scene.sections[0]):
        y, z = scene.contact[:, 0, side, 1:].T
        order = np.argsort(section["wheel_y"])
        wheel = np.interp(y + roll * z, section["wheel_y"][order], section["wheel_z"][order])
        height, wider = scene.seats[:, 0].T
        across = y_rolled + y - (side - 0.5) * wider
        rail = np.interp(across, section["rail_y"], section["rail_z"])
        assert np.max(np.abs(z - roll * y - wheel)) < 2e-4
        assert np.max(np.abs(height + z - rail)) < 2e-4


def test_page_needs_nothing_from_elsewhere(result, tmp_path):
    page = write_page(result_scene(result, frames=40), tmp_path / "run.html").read_text()
    assert not re.search(r"(src|href)=|https?://|@import|url\(", page)
    data = json.loads(re.search(r'id="data">(.*?)</script>', page)[1])
    assert data["forces"]["Q"][0][0] == [68.8, 68.8]


def test_bodies_are_boxes_around_what_is_attached_to_them():
    vehicle = flatten(railsim.load_vehicle("wagon_c62a"))
    boxes = body_boxes(vehicle)
    assert set(boxes) == {body.name for body in vehicle.of_kind("body")}
    for element in vehicle.elements:
        for name, point in ((element.body1, element.point1), (element.body2, element.point2)):
            if name in boxes and name != vehicle.reference and point[2] < -0.1:
                assert np.all(np.array(boxes[name].low) <= point), element.name
                assert np.all(np.array(boxes[name].high) >= point), element.name


def test_arrows_begin_at_the_contact_and_wheels_without_contact_have_none(result):
    """Of results without `contact_y`, those of earlier versions, at the nominal circles."""
    arrays = {name: result[name] for name in result}
    arrays["contact_y"] = np.where(
        result["time"][:, None, None] == 0.0, np.nan, arrays["contact_y"]
    )
    before = {name: arrays[name] for name in arrays if not name.startswith("contact")}
    new, old = (
        result_scene(
            railsim.Result(
                kept,
                {name: result.quantities[name] for name in kept},
                result.coordinates,
                result.attributes,
                PROFILES,
            ),
            frames=5,
        )
        for kept in (arrays, before)
    )
    np.testing.assert_allclose(old.contact[..., 1], [[[-0.75, 0.75]] * 4] * 5)
    np.testing.assert_allclose(old.contact[..., 2], 0.46, atol=2e-4)
    assert np.isnan(new.contact[0, ..., 1]).all()
    rows = np.searchsorted(result["time"], new.time)[1:]
    roll = result["body_position"][rows][:, 3:, 3] - result["wheelset_roll"][rows]
    turned = result["contact_z"][rows] - roll[..., None] * result["contact_y"][rows]
    np.testing.assert_array_equal(new.contact[1:, ..., 2], turned)
    data = scene_data(new)
    assert data["contact"][0][0][0][1] == 0.0
    assert data["words"]["Q"] == "Q (kN): vertical wheel force"  # as in the tables


@pytest.mark.parametrize("yaw", [0.01, -0.02])
@pytest.mark.parametrize("aside", [0.72, 0.745, 0.775])  # flange root, tread
def test_a_yawed_wheel_touches_where_it_is_lowest_along_the_rail(result, yaw, aside):
    """Sought on the turned surface of the whole wheel, to second order in the yaw."""
    arrays = {name: result[name] for name in result}
    arrays["contact_y"] = np.broadcast_to([-aside, aside], arrays["contact_y"].shape)
    arrays["wheelset_yaw"] = np.full_like(arrays["wheelset_yaw"], yaw)
    y, z = (result_scene(result, frames=2).sections[0][1][f"wheel_{k}"] for k in "yz")
    radius = CubicSpline(np.sort(y), z[np.argsort(y)])
    arrays["contact_z"] = np.full_like(arrays["contact_z"], radius(aside))
    turned = railsim.Result(
        arrays, result.quantities, result.coordinates, result.attributes, PROFILES
    )
    for side, sign in enumerate((-1.0, 1.0)):
        along = np.linspace(-0.04, 0.04, 80_001)  # of the rail; at this Y the wheel is cut
        own_x = along * np.cos(yaw) + sign * aside * np.sin(yaw)
        own_y = -along * np.sin(yaw) + sign * aside * np.cos(yaw)
        lowest = along[np.argmax(radius(np.abs(own_y)) ** 2 - own_x**2)]
        found = result_scene(turned, frames=2).contact[0, 0, side, 0]
        assert found == pytest.approx(lowest, abs=2.0 * yaw**2 + 2e-4)
        assert abs(found) > 0.005


def test_a_wheelset_beside_its_rails_is_drawn_on_its_flanges(result):
    arrays = {name: result[name] for name in result}
    arrays["wheelset_lateral"] = np.full_like(arrays["wheelset_lateral"], 0.3)
    status = {**result.attributes, "status": "derailed"}
    derailed = railsim.Result(arrays, result.quantities, result.coordinates, status, PROFILES)
    scene = result_scene(derailed, frames=5)
    assert scene.title == f"{result_scene(result, frames=2).title} · derailed"
    flange = max(section["wheel_z"].max() for section in scene.sections[0])
    np.testing.assert_allclose(scene.seats[..., 0], -flange)
    json.dumps(scene_data(scene), allow_nan=False)


def test_curves_keep_the_peaks_between_frames(result):
    """Also with few frames, and the last instant of the run is the last frame."""
    scene = result_scene(result, frames=7)
    assert scene.time[-1] == result["time"][-1]
    assert scene.curves["distance"].shape == (14,)
    for name, values in (
        ("Q", result["Q"]),
        ("Y", result["Y"]),
        ("lateral", result["wheelset_lateral"][..., None]),
    ):
        for extreme in (np.max, np.min):
            np.testing.assert_array_equal(extreme(scene.curves[name], 0), extreme(values, 0))
    data = scene_data(scene)["curves"]
    assert data["Q"][0][0][1] == pytest.approx(1e-3 * scene.curves["Q"][0, 0, 1], abs=5e-3)


def test_part_of_a_run(result):
    scene = result_scene(result, between=(340.0, 420.0))
    assert scene.distance[0] >= 340.0
    assert scene.distance[-1] <= 420.0
    with pytest.raises(InputError, match="nothing between"):
        result_scene(result, between=(2000.0, 3000.0))


MODE = {"name": "lower sway", "frequency": 0.56, "damping_ratio": 0.22,
        "shape": {"carbody.y": [1.0, 0.0], "carbody.roll": [0.4, 0.1],
                  "front.frame.y": [0.1, -0.2]}}  # fmt: skip


def test_mode_moves_by_five_per_cent_of_the_length_with_its_phases():
    scene = mode_scene(railsim.load_vehicle("coach_manchester"), MODE)
    car = scene.bodies[0]
    # the roof moves most: y - roll z at the box's upper edge, z down
    roof = car.box[5] - car.box[2]
    moved = abs(1.0 - (0.4 + 0.1j) * roof)
    largest = np.max(np.abs(scene.pose[:, 0, 1] - roof * scene.pose[:, 0, 3]))
    assert largest == pytest.approx(0.05 * 21.56, rel=1e-2)
    scale = 0.05 * 21.56 / moved
    phase = 2.0 * np.pi * MODE["frequency"] * scene.time
    np.testing.assert_allclose(
        scene.pose[:, 1, 1], scale * np.real((0.1 - 0.2j) * np.exp(1j * phase)), atol=1e-9
    )


def test_command_writes_a_page_of_a_mode(tmp_path, capsys):
    modes = tmp_path / "modes.json"
    modes.write_text(json.dumps({"vehicle": "coach_manchester", "modes": [MODE]}))
    assert main(["animate", str(modes), "--mode", "lower sway"]) == 0
    assert (tmp_path / "modes.html").stat().st_size > 20_000
    assert main(["animate", str(modes), "--mode", "upper", "--overwrite"]) == 2
    assert "no such mode" in capsys.readouterr().err


@pytest.mark.parametrize(("number", "name"), [(None, "slow"), ("1", "slow"), ("2", "fast")])
def test_modes_are_counted_as_they_are_listed(number, name, tmp_path):
    """By rising natural frequency, without those that do not oscillate, such as rolling."""
    modes = [
        {**MODE, "name": "rolling", "frequency": 1e-6},
        {**MODE, "name": "fast", "frequency": 2.0, "natural_frequency": 3.0},
        {**MODE, "name": "slow", "frequency": 2.5, "natural_frequency": 2.6},
    ]
    file = tmp_path / "modes.json"
    file.write_text(json.dumps({"vehicle": "coach_manchester", "modes": modes}))
    assert name in _scene(file, False, None, number, None, None).title


@pytest.mark.parametrize(
    ("film", "frames", "cycles", "pictures"),
    [(True, None, 2, 60), (False, None, 3, 270), (True, 12, 3, 36)],
)
def test_a_mode_is_shown_through_whole_cycles(tmp_path, film, frames, cycles, pictures):
    modes = tmp_path / "modes.json"
    modes.write_text(json.dumps({"vehicle": "coach_manchester", "modes": [MODE]}))
    scene = _scene(modes, film, vehicle=None, mode=None, between=None, frames=frames)
    assert scene.time[-1] * MODE["frequency"] == pytest.approx(cycles)
    assert len(scene.time) == pictures
    np.testing.assert_allclose(scene.pose[-1], scene.pose[0], atol=1e-9)


def test_film_has_a_picture_for_each_frame(result, tmp_path):
    from PIL import Image

    path = railsim.animate(result_scene(result, frames=4), tmp_path / "run.gif")
    with Image.open(path) as film:
        assert film.n_frames == 4
        assert np.asarray(film.convert("RGB")).std() > 10.0


def test_a_result_is_written_as_what_the_name_says(result, tmp_path):
    page = railsim.animate(result, tmp_path / "run.HTML")
    assert page.read_text() == write_page(result_scene(result), tmp_path / "same.html").read_text()
    for name, words in (("run.HTML", "exists"), ("run.png", "in .html or .htm or .gif")):
        with pytest.raises(InputError, match=words):
            railsim.animate(result, tmp_path / name)


def test_a_film_says_how_many_times_larger_the_motion_is(result):
    view, *sections = Figure().subplots(1, 3)
    for gain, words in ((1.0, " m"), (20.0, " m; motion of the bodies magnified 20 times")):
        draw(view, sections, result_scene(result, frames=4), 1, gain)
        assert view.get_title(loc="left").endswith(words)
    assert [axes.get_ylabel() for axes in sections] == ["mm", "mm"]


def test_the_whole_vehicle_is_in_the_picture_of_a_film(result):
    """Also in the curve; the far end of the coach was cut off at its roof."""
    scene = result_scene(result, frames=12)
    low, high = _extent(scene)
    for frame in range(12):
        bodies = [points for *_, points, face, _ in _polygons(scene, frame, 1.0) if face[0] != "#"]
        assert np.all(np.concatenate(bodies) > low)
        assert np.all(np.concatenate(bodies) < high)


def test_the_drawn_rails_go_on_from_piece_to_piece(result):
    """In a curve too: where one piece ends the next begins, with both of its edges."""
    scene = result_scene(result, frames=4)
    for frame in range(4):
        rails = [points for *_, points, face, _ in _polygons(scene, frame, 1.0) if face[0] == "#"]
        assert len(rails) == 2 * 22
        for rail in rails[:22], rails[22:]:
            for one, following in pairwise(rail):
                np.testing.assert_allclose(one[[3, 2]], following[[0, 1]], atol=1e-9)


def test_a_moved_body_is_seen_where_it_would_be_if_it_stood_there(result):
    """Moved by 0.2 m aside and 0.1 m down, enlarged twice: as one that belongs 0.4 and 0.2 m off.

    To the right is to the right on the screen, down is down, and a track that is turned as a
    whole is seen as before.
    """
    scene = result_scene(result, frames=2)
    car = scene.bodies[0]
    still = replace(scene, bodies=(car,), pose=np.zeros((2, 1, 6)))
    pose = np.zeros((2, 1, 6))
    pose[0, 0, 1:3] = 0.2, 0.1
    there = replace(car, y=car.y + 0.4, z=car.z + 0.2)

    def seen(scene, gain=1.0):
        return [points for *_, points, face, _ in _polygons(scene, 0, gain) if face[0] != "#"]

    moved = seen(replace(still, pose=pose), 2.0)
    np.testing.assert_allclose(moved, seen(replace(still, bodies=(there,))), atol=1e-12)
    right, down = np.mean(moved, axis=(0, 1)) - np.mean(seen(still), axis=(0, 1))
    assert right > 0.2
    assert down > 0.1
    track = dict(scene.track)
    angle = 2.0
    turned = replace(still, track={
        **track,
        "x": np.cos(angle) * track["x"] - np.sin(angle) * track["y"],
        "y": np.sin(angle) * track["x"] + np.cos(angle) * track["y"],
        "heading": track["heading"] + angle,
    })  # fmt: skip
    np.testing.assert_allclose(seen(turned), seen(still), atol=1e-9)


def test_a_film_looks_down_along_the_track_from_its_right():
    """Orthogonal, 0.75 rad to the left of the way, 0.3 rad downwards, centred 1.4 m above it.

    By hand: ahead is away and to the right, to the right is nearer, down is down and away.
    """
    c, s, down, level = np.cos(0.75), np.sin(0.75), np.sin(0.3), np.cos(0.3)
    centre = np.array([0.0, 0.0, -1.4])
    wanted = [(s, -down * c, level * c), (c, down * s, -level * s), (0.0, level, down)]
    for axis, (x, y, depth) in zip(np.eye(3), wanted, strict=True):
        for point, size in ((centre, 0.0), (centre + axis, 1.0)):
            seen, far = _on_screen(point[None], np.zeros(4))
            np.testing.assert_allclose(seen, [[size * x, size * y]], atol=1e-15)
            assert far == pytest.approx(size * depth)
    # the view moves and turns with the track, whatever its cant
    there, there_far = _on_screen(
        np.array([[3.0, 5.0, -1.4]]), np.array([3.0, 4.0, np.pi / 2.0, 0.1])
    )
    np.testing.assert_allclose(there, [[s, -down * c]], atol=1e-15)
    assert there_far == pytest.approx(level * c)


def test_bodies_of_a_film_have_their_sizes():
    """A wheelset has two rims and an axle 20 mm thick between them, a box six whole faces."""
    rims = _shape(DrawnBody("w", "wheelset", 0.0, 0.0, 0.0, (0.46, 0.75, 0.0, 0.0, 0.0, 0.0)))
    for rim, y in zip(rims, (-0.75, 0.75), strict=False):
        np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 2]), 0.46)
        np.testing.assert_array_equal(rim[:, 1], y)
        steps = np.linalg.norm(np.diff(rim, axis=0), axis=1)  # all around, in 24 equal steps
        np.testing.assert_allclose(steps, 2.0 * 0.46 * np.sin(np.pi / 24.0))
    np.testing.assert_allclose(np.ptp(rims[2], axis=0), (0.0, 1.5, 0.02))
    faces = _shape(DrawnBody("c", "car", 0.0, 0.0, 0.0, (3.0, 2.0, 1.0, 0.3, 0.2, 0.1)))
    middles = sorted(tuple(np.round(np.mean(face, axis=0), 9).tolist()) for face in faces)
    out = [np.array([0.3, 0.2, 0.1]) + sign * axis for axis in np.diag([3.0, 2.0, 1.0])
           for sign in (-1.0, 1.0)]  # fmt: skip
    assert middles == sorted(tuple(np.round(middle, 9).tolist()) for middle in out)
    for face in faces:  # its corners in turn: opposite sides are equal
        np.testing.assert_allclose(face[1] - face[0], face[2] - face[3])
        assert np.linalg.matrix_rank(face[1:] - face[0], tol=1e-9) == 2


@pytest.mark.parametrize("side", [0, 1])
def test_a_section_of_a_film_shows_wheel_rail_and_forces(result, side):
    """80 mm to both sides of the nominal circle; forces of 1 kN are 0.35 and 0.7 mm long.

    The wheelset is 4 mm aside and rolled by 2 mrad, the rails stand 3 mm further apart.
    """
    scene = result_scene(result, frames=2)
    pose, seats = np.zeros_like(scene.pose), np.zeros_like(scene.seats)
    pose[..., 1], pose[..., 3] = 0.004, 0.002
    seats[..., 0], seats[..., 1] = -0.45, 0.003
    moved = replace(scene, pose=pose, seats=seats)
    view, *sections = Figure().subplots(1, 3)
    draw(view, sections, moved, 1)
    axes, sign, section = sections[side], (-1.0, 1.0)[side], scene.sections[0][side]
    assert axes.get_xlim() == pytest.approx((sign * 750.0 - 80.0, sign * 750.0 + 80.0))
    assert axes.get_ylim() == (45.0, -35.0)  # down
    rail, wheel = (line.get_xydata().T for line in axes.get_lines())
    np.testing.assert_allclose(rail[0], 1e3 * section["rail_y"] + sign * 1.5)
    np.testing.assert_allclose(rail[1], 1e3 * section["rail_z"])
    y, z = 1e3 * section["wheel_y"], 1e3 * section["wheel_z"]
    np.testing.assert_allclose(wheel, [4.0 + y - 0.002 * z, -450.0 + z + 0.002 * y], atol=1e-9)
    Q, Y = 1e-3 * scene.Q[1, 0, side], 1e-3 * scene.Y[1, 0, side]
    assert axes.get_title() == f"{('left', 'right')[side]} wheel 1: Q {Q:.1f} kN, Y {Y:.1f} kN"
    at = 1e3 * scene.contact[1, 0, side, 1:] + [4.0, -450.0]
    arrows = [arrow for arrow in axes.texts if arrow.arrow_patch is not None]
    for arrow, way in zip(arrows, ((0.0, 0.35 * Q), (0.7 * Y, 0.0)), strict=True):
        np.testing.assert_allclose(arrow.xyann, at)
        np.testing.assert_allclose(np.subtract(arrow.xy, at), way, atol=1e-9)


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg")
def test_mp4_has_a_picture_for_each_frame(result, tmp_path):
    path = write_movie(result_scene(result, frames=4), tmp_path / "run.mp4")
    asked = ["ffmpeg", "-loglevel", "error", "-i", str(path), str(tmp_path / "frame%d.png")]
    subprocess.run(asked, check=True)
    assert len(list(tmp_path.glob("frame*.png"))) == 4


def test_mp4_without_ffmpeg_is_told(result, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(InputError, match="MP4 needs ffmpeg"):
        write_movie(result_scene(result, frames=4), tmp_path / "run.mp4")
    assert not list(tmp_path.iterdir())


def test_wrong_calls_end_with_status_2(result, tmp_path, capsys):
    path = str(result.to_hdf5(tmp_path / "run.h5"))
    broken = tmp_path / "broken.json"
    broken.write_text('{"modes": []}')
    for wrong in ([path, "--out", str(tmp_path / "a.txt")], [str(broken)], ["no.h5"],
                  [path, "--mode", "1", "--out", str(tmp_path / "b.html")]):  # fmt: skip
        assert main(["animate", *wrong]) == 2, wrong
        assert "Traceback" not in capsys.readouterr().err


def test_numbers_are_rounded_to_what_a_screen_shows(result):
    data = scene_data(result_scene(result, frames=3))
    assert all(v == round(v, 5) for body in data["pose"][1] for v in body)


def test_boxes_are_drawn_about_the_centres_of_gravity_where_their_bodies_are():
    """Middle and half sizes, with the centre of gravity, give back the ends of each box."""
    vehicle = flatten(railsim.load_vehicle("coach_manchester"))
    boxes, reference = body_boxes(vehicle), vehicle.body(vehicle.reference)
    drawn = {body.name: body for body in _bodies_to_draw(vehicle)}
    assert len(boxes) == 3
    for name, (low, high) in boxes.items():
        half, middle = np.reshape(drawn[name].box, (2, 3))
        at = np.array([drawn[name].offset + reference.position[0], drawn[name].y, drawn[name].z])
        np.testing.assert_allclose(at + middle - half, low, atol=1e-12)
        np.testing.assert_allclose(at + middle + half, high, atol=1e-12)
