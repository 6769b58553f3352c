"""The same rails written twice: in the lists of a track file and as irregularities.

A wave of the plan, of the vertical profile or of the cant is a list of elements, from which the
centre line follows; the same wave as a measured irregularity displaces the rails of a smooth track.
Both describe one piece of steel, so that a vehicle must run over both alike.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.constants import CANT_BASE
from railsim.definitions.track.definition import Track
from railsim.simulation import simulate
from railsim.track.alignment import Alignment
from railsim.track.irregularity import displacement
from railsim.track.tables import track_tables

BEGIN, WAVES, AFTER = 30.0, 3, 20.0  # m, -, m
PIECE = 0.1  # m, length of an element
ROUNDING = 0.2  # m


@dataclass(frozen=True)
class Wave:
    """Waves that grow and fade within their first and last length.

    Attributes
    ----------
    length, height : float
        Wavelength and amplitude [m].
    """

    length: float
    height: float

    @property
    def end(self):
        """Arc length where the waves end [m]."""
        return BEGIN + WAVES * self.length

    def __call__(self, s):
        """Displacement at `s` [m]."""
        u = np.clip((np.asarray(s) - BEGIN) / self.length, 0.0, float(WAVES))
        depth = np.clip(np.minimum(u, WAVES - u), 0.0, 1.0)
        # the window's first three derivatives vanish at its ends, so that no curvature jumps
        window = depth**4 * (35.0 - 84.0 * depth + 70.0 * depth**2 - 20.0 * depth**3)
        return self.height * window * np.sin(2.0 * np.pi * u)


def _arc_lengths(wave):
    return BEGIN + PIECE * np.arange(round((wave.end - BEGIN) / PIECE) + 1)


def _slope(wave, order):
    s = np.arange(BEGIN - 10.0, wave.end + 10.0, 0.02)
    return CubicSpline(s, wave(s)).derivative(order)


def _elements(wave, kind, keys, values):
    """Ramps between `values` at the arc lengths of a wave."""
    return [
        {"type": kind, "length": PIECE, f"{keys}_start": a, f"{keys}_end": b}
        for a, b in pairwise(values)
    ]


def _radii(curvature):
    return [1.0 / k if abs(k) > 1e-12 else float("inf") for k in curvature.tolist()]


def _track(wave, plan, **more):
    return Track.model_validate(
        {
            "format": "railsim-track/1",
            "name": "twin",
            "plan": plan,
            "rounding": ROUNDING,
            "support": {"preset": "rigid"},
            **more,
        }
    )


def _measured(s, y_left, z_left, y_right, z_right):
    columns = np.broadcast_arrays(s, y_left, z_left, y_right, z_right)
    rows = np.column_stack(columns).tolist()
    return {"type": "measured", "rows": rows, "fade": 0.0}


def _base(wave, curvature):
    """Plan with a constant curvature [1/m], reached long before the waves."""
    if curvature == 0.0:
        return [{"type": "STR", "length": wave.end + AFTER}]
    return [{"type": "CIR", "length": wave.end + AFTER, "radius": 1.0 / curvature}]


def alignment(wave, curvature=0.0, cant=0.0):
    """The wave in the plan, and as lateral displacement of both rails."""
    level = {"cant": [{"type": "CST", "length": 1.0, "cant": cant}]}
    smooth = _track(wave, _base(wave, curvature), **level)
    radii = _radii(curvature + _slope(wave, 2)(_arc_lengths(wave)))
    radii[0] = radii[-1] = _radii(np.array([curvature]))[0]
    ends = [{"type": "CIR", "radius": radii[0]}, {"type": "CIR", "radius": radii[0]}]
    if curvature == 0.0:
        ends = [{"type": "STR"}, {"type": "STR"}]
    plan = [
        ends[0] | {"length": BEGIN},
        *_elements(wave, "CLO", "radius", radii),
        ends[1] | {"length": AFTER},
    ]
    waved = _track(wave, plan, **level)
    s, aside = _lateral(waved, smooth, wave)
    angle = np.arcsin(cant / CANT_BASE)
    y, z = aside * np.cos(angle), -aside * np.sin(angle)
    return waved, smooth.replace(irregularities=[_measured(s, y, z, y, z)])


def _lateral(waved, smooth, wave):
    """Distance of the first track's centre line to the right of the second's, on the level."""
    one, two = track_tables(waved), track_tables(smooth)
    s = _stations(wave)

    def row(tables, k):
        cell = np.floor((s - tables.s_start) / tables.ds).astype(int)
        u = s - tables.s_start - cell * tables.ds
        return (tables.coefficients[cell, k] * u[:, None] ** np.arange(4)).sum(axis=1)

    heading = row(two, 3)
    east, north = row(one, 0) - row(two, 0), row(one, 1) - row(two, 1)
    return s, np.cos(heading) * north - np.sin(heading) * east


def _stations(wave):
    """Where the displacements of the rails are given; they go on beyond the vehicle's way."""
    return np.arange(BEGIN - 10.0, wave.end + AFTER + 50.0, 0.05)


def level(wave, curvature=0.0):
    """The wave in the vertical profile (hollow = positive), and as height of both rails."""
    plan = _base(wave, curvature)
    gradient = -_slope(wave, 1)(_arc_lengths(wave))
    gradient[0] = gradient[-1] = 0.0
    ramps = _elements(wave, "LIR", "gradient", gradient.tolist())
    flat = [{"type": "CST", "length": BEGIN, "gradient": 0.0}]
    waved = _track(wave, plan, vertical=[*flat, *ramps, {**flat[0], "length": AFTER}])
    s = _stations(wave)
    z = -(Alignment(waved).gradient.integral(s))
    return waved, _track(wave, plan, irregularities=[_measured(s, 0.0, z, 0.0, z)])


def cross_level(wave, curvature=0.0, cant=0.0):
    """The wave in the cant (left rail higher = positive), and as heights of the single rails."""
    plan = _base(wave, curvature)
    rise = wave(_arc_lengths(wave))
    ramps = _elements(wave, "LIR", "cant", (cant + rise).tolist())
    flat = [{"type": "CST", "length": BEGIN, "cant": cant}]
    waved = _track(wave, plan, cant=[*flat, *ramps, {**flat[0], "length": AFTER}])
    s = _stations(wave)
    angle = Alignment(waved).cant_angle(s) - np.arcsin(cant / CANT_BASE)
    h = CANT_BASE * np.sin(angle)
    smooth = _track(wave, plan, cant=[{**flat[0], "length": 1.0}])
    return waved, smooth.replace(irregularities=[_measured(s, 0.0, -0.5 * h, 0.0, 0.5 * h)])


def widening(shift, length=5.0):
    """The left rail further out, and the track shifted to the left and widened by the rest."""
    wave = Wave(length, 0.0)
    one_sided = [[BEGIN, 0.0, 0.0], [BEGIN + length, shift, 0.0]]
    both = [[s, 0.5 * left, 0.5 * left] for s, left, _ in one_sided]
    plan = _base(wave, 0.0)
    s = _stations(wave)
    left = _track(wave, plan, gauge_widening=one_sided)
    y = 0.5 * displacement(left)(s)[0][0]
    moved = _measured(s, y, 0.0, y, 0.0)
    return left, _track(wave, plan, gauge_widening=both, irregularities=[moved])


def runs(vehicle, tracks, speed, until=None, settings=None):
    """One run over each track."""
    return [
        simulate(vehicle, track, speed=speed, settings=settings, until=until) for track in tracks
    ]


def differences(one, two, begin=BEGIN):
    """Largest difference over largest change of each quantity of the two runs.

    Forces of wheels and wheelsets, displacement and roll of these against their rails (those that
    change by 1e-5 at least), accelerations of the car body (those that change by 1e-3 m/s2 or
    rad/s2 at least); what hardly changes is measured against a tenth of the largest of its kind.
    """
    rows = one.distance > begin - 15.0
    assert np.allclose(one.distance, two.distance, atol=0.01)

    def of_both(*names):
        return {name: (one[name][rows], two[name][rows]) for name in names}

    forces = of_both("Q", "Y", "sum_Y")
    moved = {
        f"{name} acceleration": tuple(run.body_acceleration[rows][:, 0, k] for run in (one, two))
        for k, name in enumerate(("lateral", "vertical", "roll", "pitch", "yaw"), start=1)
    }
    moved = {name: pair for name, pair in moved.items() if np.ptp(pair[0]) > 1e-3}
    turned = {
        name: moved.pop(name)
        for name in list(moved)
        if not name.startswith(("lateral", "vertical"))
    }
    found = _ratios(forces) | _ratios(moved) | _ratios(turned)
    for name, pair in of_both("wheelset_lateral", "wheelset_roll").items():
        found |= _ratios({name: pair} if np.ptp(pair[0]) > 1e-5 else {})
    return found


def _ratios(pairs):
    """Largest difference over the largest change along the way, of all wheels together."""
    change = {name: 0.5 * np.max(np.ptp(a, axis=0)) for name, (a, _) in pairs.items()}
    least = 0.1 * max(change.values(), default=0.0)
    return {
        name: float(np.max(np.abs(a - b)) / max(change[name], least))
        for name, (a, b) in pairs.items()
    }
