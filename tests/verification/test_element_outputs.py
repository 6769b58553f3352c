"""Outputs of elements, patches and rails against work, geometry and statics."""

from types import SimpleNamespace

import numpy as np
import pytest
from dynamics import load_any_track, load_track, load_vehicle
from independent_contact import rail_points
from scipy.spatial.transform import Rotation
from test_loads import GRAVITY, MASS, wagon
from test_one_sided import with_elements

import railsim
from railsim.animation import result_scene
from railsim.definitions.settings import Settings
from railsim.definitions.track.support import PRESETS
from railsim.kernels import element_columns, element_outputs, elements, internal
from railsim.kernels.element_columns import BOTH_ENDS, MOUNT_COLUMNS
from railsim.kernels.system import ANGULAR, FORCE, MOMENT, POSITION, VELOCITY
from railsim.model.assembly import assemble
from railsim.model.statics import _shortening
from railsim.model.work import work_arrays

X, Y, Z, ROLL, PITCH, YAW = range(6)
BAR, BAR_DAMPING, DAMPER = 8e5, 1.5e4, 2e4
INERTIA = np.array([8e3, 9e4, 9e4])  # of the wagon's body


@pytest.fixture(scope="module")
def shaken():
    """A wagon on springs, roll bars and dampers that is pushed, and left to itself after 0.2 s."""
    elements = {
        "bar": {
            "kind": "roll_bar",
            "bodies": ["axle", "body"],
            "stiffness": BAR,
            "damping": BAR_DAMPING,
        },
        "damper": {
            "kind": "spring_damper",
            "bodies": ["axle", "body"],
            "points": [[0.0, 1.0, -0.5], [0.0, 1.0, -1.0]],
            "sides": "both",
            "damping": DAMPER,
        },
    }
    push = {
        "kind": "applied_force",
        "bodies": ["body"],
        "force_table": [[0.0, 0.0, 0.0, 0.0], [0.1, 0.0, 5e3, 2e4], [0.2, 0.0, 0.0, 0.0]],
        "torque_table": [[0.0, 0.0, 0.0, 0.0], [0.1, 1.5e4, 4e4, 0.0], [0.2, 0.0, 0.0, 0.0]],
    }
    vehicle = with_elements(wagon(elements={"push": push}), "end", **elements)
    outputs = {"elements": ["*.nest.*", "*.bar", "*.damper.*"]}
    return railsim.simulate(
        vehicle,
        load_track("straight"),
        speed=10.0,
        duration=1.2,
        settings=Settings(outputs=outputs, output_rate=2000.0),
    )


def of_element(result, name):
    """Deflection, force and power of one element."""
    e = list(result.coordinates["element"]).index(name)
    return result.element_deflection[:, e], result.element_force[:, e], result.element_power[:, e]


def of_body(result, name):
    """Position and velocity of one body."""
    b = list(result.coordinates["body"]).index(name)
    return result.body_position[:, b], result.body_velocity[:, b]


def integral(time, values):
    """Trapezoidal rule from the begin to every instant."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])


def test_power_of_all_elements_is_the_energy_that_the_body_loses(shaken):
    """Once left alone: -d(kinetic energy + weight) of the body; the axles take 0.3 %."""
    free = shaken.time >= 0.2
    position, velocity = (values[free] for values in of_body(shaken, "body"))
    kinetic = 0.5 * MASS * np.sum(velocity[:, :3] ** 2, axis=1)
    kinetic += 0.5 * np.sum(INERTIA * velocity[:, 3:] ** 2, axis=1)
    energy = kinetic - MASS * GRAVITY * position[:, Z]
    taken = integral(shaken.time[free], shaken.element_power[free].sum(axis=1))
    lost = np.abs(taken).max()
    assert lost > 500.0
    np.testing.assert_allclose(energy[0] - energy, taken, atol=0.005 * lost)


@pytest.mark.parametrize("seed", range(3))
def test_power_of_mounts_is_what_their_forces_take_from_the_bodies(seed, plain):
    """-sum (F . v + M . omega) in any attitude and motion, of any springs, dampers and preloads."""
    model = assemble(load_vehicle("coach_manchester"), load_track("straight"), Settings())
    random, mounts = np.random.default_rng(seed), model.system.mounts
    row = mounts.row.copy()
    for name in ("stiffness", "damping", "preload"):
        row[:, MOUNT_COLUMNS[name]] = 1e4 * random.normal(size=(len(row), 3))
    system = model.system._replace(mounts=mounts._replace(row=row))
    work, n = work_arrays(system), system.bodies.kind.size
    turned = Rotation.from_rotvec(0.3 * random.normal(size=(n, 3)))
    work.pose[:, :9] = turned.as_matrix().reshape(n, 9)
    for first in (POSITION, VELOCITY, ANGULAR):
        work.pose[:, first : first + 3] = random.normal(size=(n, 3))
    inner = 1e3 * random.normal(size=system.internal.kind.size)
    for module in (internal, element_columns, elements, element_outputs):
        plain(module)
    elements.add_mount_forces(system, work, inner)
    given = np.zeros(n)
    for motion, force in ((VELOCITY, FORCE), (ANGULAR, MOMENT)):
        given += np.einsum(
            "bi,bi->b", work.pose[:, motion : motion + 3], work.pose[:, force : force + 3]
        )
    out = np.zeros((system.mounts.body.shape[0], element_outputs.RATE + 6))
    for e in range(len(out)):
        element_outputs.write_mount_output(system, work, inner, e, e, out)
    power = out[:, element_outputs.POWER]
    assert mounts.flags[:, BOTH_ENDS].any()
    assert power.sum() == pytest.approx(-given.sum(), abs=1e-9 * abs(power).sum())


def test_deflections_are_those_of_the_bodies(shaken):
    """Body 2 against body 1 at the point of the element, small angles."""
    body, axle = of_body(shaken, "body")[0], of_body(shaken, "front.axle")[0]
    deflection, _, _ = of_element(shaken, "front.nest.right")  # from the body to the axle
    below = body[:, Z] + 1.0 * body[:, ROLL] - 3.0 * body[:, PITCH]
    down = axle[:, Z] + 1.0 * axle[:, ROLL] - below
    assert np.ptp(down) > 2e-3
    np.testing.assert_allclose(deflection[:, Z], down, atol=2e-5)
    np.testing.assert_allclose(deflection[:, ROLL], axle[:, ROLL] - body[:, ROLL], atol=1e-5)
    np.testing.assert_allclose(deflection[:, PITCH], -body[:, PITCH], atol=1e-5)
    elongation, _, _ = of_element(shaken, "front.damper.right")  # from the axle up to the body
    np.testing.assert_allclose(elongation[:, 0], down, atol=2e-5)


def test_moment_and_power_of_a_roll_bar(shaken):
    """M = k theta + c theta'; its work is what the damping takes and the spring keeps."""
    deflection, force, power = of_element(shaken, "front.bar")
    angle = deflection[:, ROLL]
    rate = np.gradient(angle, shaken.time)
    assert np.ptp(angle) > 2e-3
    np.testing.assert_allclose(
        force[:, ROLL], BAR * angle + BAR_DAMPING * rate, atol=0.01 * np.ptp(force[:, ROLL])
    )
    work = integral(shaken.time, power)
    expected = 0.5 * BAR * (angle**2 - angle[0] ** 2)
    expected += integral(shaken.time, BAR_DAMPING * rate**2)
    np.testing.assert_allclose(work, expected, atol=0.01 * work.max())


def test_a_damper_takes_its_force_times_its_rate(shaken):
    """Tension is positive while it lengthens; the power is never given back."""
    deflection, force, power = of_element(shaken, "rear.damper.left")
    rate = np.gradient(deflection[:, 0], shaken.time)
    np.testing.assert_allclose(force[:, 0], DAMPER * rate, atol=0.01 * np.ptp(force[:, 0]))
    np.testing.assert_allclose(power, DAMPER * rate**2, atol=0.02 * power.max())
    assert power.min() >= 0.0


@pytest.mark.parametrize("height", [-0.1, 0.0, 0.1])
@pytest.mark.parametrize("force", [-3e4, 0.0, 3e4])
def test_a_spring_is_as_much_pressed_whichever_body_is_named_first(height, force):
    """With its bodies exchanged travel and force are reversed; z points down.

    Between points of equal height neither is the lower one: what acts is taken as pressure.
    """
    named = SimpleNamespace(point1=(0.0, 1.0, height), point2=(0.0, 1.0, 0.0))
    exchanged = SimpleNamespace(point1=named.point2, point2=named.point1)
    travel, acting = np.array([0.0, 0.0, 0.01]), np.array([0.0, 0.0, force])
    shorter, pressed = _shortening(named, travel, acting, is_link=False)
    other = _shortening(exchanged, -travel, -acting, is_link=False)
    if force or height:
        assert other == (shorter, pressed)
    if not height:
        assert str(pressed) == str(abs(force))  # no minus zero
    else:
        assert pressed == np.sign(height) * force


def test_a_spring_between_two_points_stands_as_its_free_length_says():
    """Longer by f than the distance of its points it pushes with k f: tension is positive.

    Four of them that carry just the weight leave the wagon in its nominal position.
    """
    k, distance = 4e5, 0.5
    more = MASS * GRAVITY / (4.0 * k)
    soft = wagon({"stiffness": [2e6, 2e6, 1.0], "preload": [0.0, 0.0, 0.0]})
    strut = {
        "kind": "spring_damper",
        "bodies": ["axle", "body"],
        "points": [[0.0, 1.0, -0.5], [0.0, 1.0, -0.5 - distance]],
        "sides": "both",
        "stiffness": k,
        "free_length": distance + more,
    }
    loads = railsim.static_loads(with_elements(soft, "end", strut=strut))
    for end in ("front", "rear"):
        for side in ("left", "right"):
            assert loads.preload[f"{end}.strut.{side}"] == pytest.approx([-k * more], rel=1e-12)
    assert loads.Q0.sum() == pytest.approx((MASS + 2 * 1300.0) * GRAVITY, rel=1e-9)


def test_forces_of_sheared_springs_hold_the_car_on_cant():
    """Across and down m g (sin, cos) of 150 mm of cant, 1e-4; the car leans more than its frames.

    In the axes of the frames alone, the load of the springs pulling across was left out: 9 %.
    """
    straight = load_track("straight").replace(cant=[{"type": "CST", "length": 9.0, "cant": 0.15}])
    outputs = {"elements": ["*.secondary_*", "*.lateral_bump_stop"]}
    found = railsim.simulate(
        load_vehicle("coach_manchester"),
        straight,
        speed=5.0,
        duration=0.01,
        settings=Settings(start_state="steady", outputs=outputs),
    )
    held = np.zeros(2)
    for e, name in enumerate(found.coordinates["element"]):
        if "damper" not in name:  # at rest
            lean = of_body(found, f"{name.split('.')[0]}.frame")[0][0, ROLL]
            _, across, down = found.element_force[0, e, :3]
            held += [
                across * np.cos(lean) - down * np.sin(lean),
                down * np.cos(lean) + across * np.sin(lean),
            ]
    weight, angle = 43628.0 * GRAVITY, np.arcsin(0.15 / 1.5)
    expected = weight * np.array([np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(held, expected, atol=1e-4 * weight)


# contact patches and rails ------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["rigid", "co-running"])
def curving(request):
    """Steady curving uphill, R 250 m."""
    track = load_any_track("curve_r250").replace(
        vertical=[{"type": "CST", "length": 500.0, "gradient": 0.01}],
        support={"preset": request.param},
    )
    return railsim.simulate(
        load_vehicle("coach_manchester"),
        track,
        speed=20.0,
        start=380.0,
        duration=0.5,
        settings=Settings(outputs={"contact_patches": True, "track": True}),
    )


def test_quantities_follow_from_each_other(curving):
    """By what docs/notation.md says they are, through R 250 m with 150 mm of cant, 1 % uphill."""
    axles = [curving.bodies.index(name) for name in curving.wheelsets]
    position, on_track = curving["body_position"][:, axles], curving["track_cant"]
    patches = {name: curving[f"patch_{name}"] for name in ("N", "a", "b", "T_x", "T_y", "pressure")}
    carries = patches["N"] > 0.0
    mu_N = curving["patch_friction"] * patches["N"]
    slip = np.hypot(patches["T_x"], patches["T_y"])
    pairs = {
        "wheelset_lateral_on_track": position[..., 1],
        "wheelset_roll_on_track": position[..., 3],
        "track_curvature": np.full(on_track.shape, 1.0 / 250.0),
        "track_cant": np.full(on_track.shape, 0.15),
        "track_gradient": np.full(on_track.shape, 0.01),
        "sum_Y": curving.Y[..., 0] + curving.Y[..., 1],
        "sum_abs_Y": np.abs(curving.Y[..., 0]) + np.abs(curving.Y[..., 1]),
        "Y_over_Q": curving.Y / curving.Q * [-1.0, 1.0],
        "dQ_over_Q0": curving.Q / curving.Q0 - 1.0,
        "T_gamma": curving["patch_T_gamma"].sum(axis=-1),
    }
    for name, expected in pairs.items():
        np.testing.assert_allclose(curving[name], expected, rtol=1e-9, atol=1e-12, err_msg=name)
    ellipse = np.pi * patches["a"] * patches["b"]
    mean = patches["N"][carries] / ellipse[carries]
    np.testing.assert_allclose(patches["pressure"][carries], 1.5 * mean)  # Hertz
    assert np.all(slip <= 1.01 * mu_N)  # FASTSIM's cells
    assert np.abs(position[..., 3]).max() > 1e-4


def test_normal_of_a_patch_meets_the_axle(curving):
    """A wheel is a surface of revolution: patch, normal and axle lie in one plane, c . (a x n) = 0.

    The rail's own direction at the patch, up to 10 mm ahead, turns by 0.04 mrad.
    """
    N, angle = curving.patch_N, curving.patch_angle
    yaw, roll = curving.wheelset_yaw[..., None, None], curving.wheelset_roll[..., None, None]
    a = np.stack(np.broadcast_arrays(-np.sin(yaw), np.cos(yaw), np.sin(roll)))
    n = np.stack([0.0 * angle, np.sin(angle), np.cos(angle)])
    c = np.stack([curving.patch_x, curving.patch_y, curving.patch_z])
    volume = np.einsum("i...,i...->...", c, np.cross(a * np.ones_like(n), n, axis=0))
    loaded = N > 1e3
    assert np.abs(curving.patch_x[loaded]).max() > 2e-3
    assert np.abs(volume[loaded]).max() < 1e-4  # m; x itself reaches some millimetres


def test_patches_lie_on_the_rails(curving):
    """Where the wheelset is and where its patch is from there: the rail, less its indentation.

    Up to 0.1 mm; the middle of a wide patch in the gauge corner lies deeper by its curvature.
    """
    rail_y, rail_z = rail_points()
    names = list(curving.coordinates["body"])
    axles = [names.index(name) for name in curving.coordinates["wheelset"]]
    position = curving.body_position[:, axles]
    side = np.array([-1.0, 1.0])[:, None]
    rail_moved = curving.rail_deflection_lateral, curving.rail_deflection_vertical
    y = side * (position[:, :, None, None, Y] + curving.patch_y - rail_moved[0][..., None])
    z = position[:, :, None, None, Z] - 0.46 + curving.patch_z - rail_moved[1][..., None]
    away = (z - np.interp(y, rail_y, rail_z)) * np.cos(curving.patch_angle)
    loaded = curving.patch_N > 1e3
    assert np.abs(away[loaded]).max() < 3e-4
    # the outer wheel of the leading axle touches on its tread or at the gauge corner, not elsewhere
    assert 0.71 < y[loaded].min() < y[loaded].max() < 0.79


def test_point_of_contact_is_that_of_the_most_loaded_patch(curving):
    """And where it is drawn, to what the slope of the profile changes within a patch."""
    most = np.argmax(curving.patch_N, axis=-1)[..., None]
    x, y, z = (np.take_along_axis(curving[f"patch_{c}"], most, axis=-1)[..., 0] for c in "xyz")
    np.testing.assert_array_equal(curving.contact_y, y)
    np.testing.assert_array_equal(curving.contact_z, z)
    scene = result_scene(curving, frames=20)
    rows = np.searchsorted(curving.time, scene.time)
    np.testing.assert_allclose(scene.contact, np.stack([x, y, z], axis=-1)[rows], atol=6e-4)
    lead = x + curving.wheelset_yaw[..., None] * y  # ahead of the axle
    assert lead[:, 0, 0].min() > 2e-3
    # sections meet: the point lies on the drawn rail, up to the width of a patch
    for w, pair in enumerate(scene.sections):
        pose = scene.pose[:, [body.name for body in scene.bodies].index(curving.wheelsets[w])]
        height, wider = scene.seats[:, w].T
        for side, section in enumerate(pair):
            across = pose[:, 1] + scene.contact[:, w, side, 1] - (side - 0.5) * wider
            rail = np.interp(across, section["rail_y"], section["rail_z"])
            assert np.abs(height + scene.contact[:, w, side, 2] - rail).max() < 8e-4
        widening = np.diff(curving.rail_deflection_lateral[rows, w], axis=-1)[:, 0]
        assert np.abs(wider - widening).max() < 2e-3  # what the drawing makes of touching alone


def test_rails_yield_as_their_pads_and_ballast_are_stiff(curving):
    """u_y = Y/k_pad + sum of Y/k_ballast, as steadily as the forces; u_z on both sides alike."""
    lateral, vertical = curving.rail_deflection_lateral, curving.rail_deflection_vertical
    values = PRESETS[curving.track().support.preset]
    if values is None:
        assert not lateral.any()
        assert not vertical.any()
        return
    expected = curving.Y / values.pad_lateral[0]
    expected += curving.sum_Y[..., None] / values.ballast_lateral[0]
    np.testing.assert_allclose(lateral, expected, atol=0.02 * np.abs(expected).max())
    both = curving.Q.sum(axis=-1)
    expected = both / values.pad_vertical[0] + both / values.ballast_vertical[0]
    np.testing.assert_allclose(vertical.sum(axis=-1), expected, rtol=0.02)


def test_gradient_is_that_of_the_track(curving):
    np.testing.assert_allclose(curving.track_gradient, 0.01, rtol=1e-9)
